//! Columns without names: what they hold says what they are.

use crate::inspect::ChannelRole;

/// Rows from which a clock is known.
const MIN_CLOCK_ROWS: usize = 100;
/// It is too coarse where it moves by more than this share of a step at once; longer and shorter steps have it each.
const MIN_SHARE_OF_EACH_STEP: f64 = 0.1;
/// Likeness of a column to the differences of another that makes it its velocity.
const VELOCITY_CORRELATION: f64 = 0.9;
/// Share of the farthest travel from which a joint moves.
const MIN_SHARE_OF_TRAVEL: f64 = 0.02;
/// Part of the joints that must show such a velocity.
const MIN_SHARE_OF_JOINTS: f64 = 0.6;

/// Whether numbers run as those of a clock do: upward, by steps of one size. A counter of rows is none.
pub(super) fn is_clock(numbers: &[f64]) -> bool {
    let mut steps: Vec<f64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.len() < 2 || !steps.iter().all(|step| *step > 0.0) {
        return false;
    }
    let counts = steps.iter().all(|step| *step == 1.0) && matches!(numbers[0], 0.0 | 1.0);
    steps.sort_by(f64::total_cmp);
    let middle = steps[steps.len() / 2];
    let even = |step: &&f64| (0.3..3.0).contains(&(**step / middle));
    !counts && 10 * steps.iter().filter(even).count() >= 9 * steps.len()
}

/// Whether numbers grow, as the times of rows do.
pub(super) fn rises(numbers: &[f64]) -> bool {
    let ends = numbers.first().zip(numbers.last());
    ends.is_some_and(|(first, last)| first < last) && numbers.is_sorted_by(|a, b| a <= b)
}

/// Whether numbers count rows, of which some may have been taken out.
pub(super) fn counts(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| x.fract() == 0.0) && usual_step(numbers) == 1.0
}

/// The step of even rows, where their times are rounded to more than a tenth of it: they lie within that of a line.
pub(super) fn rounded_step(times: &[f64]) -> Option<f64> {
    let (first, last) = (times.first()?, times.last()?);
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let step = (last - first) / (times.len() - 1) as f64;
    let least = steps().fold(f64::INFINITY, f64::min);
    let rounding = steps().fold(0.0, f64::max) - least;
    let even = |(k, t): (usize, &f64)| (t - first - k as f64 * step).abs() <= 1.01 * rounding;
    let whole = (least / rounding - (least / rounding).round()).abs() < 0.01;
    // seldom a longer step is a lost row, seldom a shorter one a row too many
    let longer = (step - least) / rounding;
    let longer = longer <= 1.0 - MIN_SHARE_OF_EACH_STEP
        && (longer >= MIN_SHARE_OF_EACH_STEP || least == 0.0);
    let coarse =
        times.len() > MIN_CLOCK_ROWS && least >= 0.0 && rounding > MIN_SHARE_OF_EACH_STEP * step;
    let coarse = coarse && whole && longer;
    (coarse && times.iter().enumerate().all(even)).then_some(step)
}

/// Correlation of the central differences of one column with another.
fn likeness(position: &[f64], velocity: &[f64]) -> f64 {
    let (mut n, mut a, mut b, mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    // over ten rows, which takes most of an encoder's grain
    for k in 5..position.len().saturating_sub(5) {
        let (x, y) = (position[k + 5] - position[k - 5], velocity[k]);
        if !(x.is_finite() && y.is_finite()) {
            continue;
        }
        n += 1.0;
        (a, b) = (a + x, b + y);
        (aa, bb, ab) = (aa + x * x, bb + y * y, ab + x * y);
    }
    let spread = (n * aa - a * a) * (n * bb - b * b);
    match spread > 0.0 {
        true => (n * ab - a * b) / spread.sqrt(),
        false => 0.0,
    }
}

/// Median step upward of some times; 0 where there is none.
pub(super) fn usual_step(times: &[f64]) -> f64 {
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Likeness from which a column is the derivative of another and nothing beside it, where its size is that too.
const SAME_CORRELATION: f64 = 0.999;
const SAME_SIZE: f64 = 0.02;

/// Whether a column is the derivative of a position by time, in its unit or by a factor of degrees.
pub(super) fn is_rate_of(position: &[f64], other: &[f64], step: f64) -> bool {
    if likeness(position, other) < SAME_CORRELATION {
        return false;
    }
    let spread = |of: &dyn Fn(usize) -> f64| {
        let all = (5..position.len().saturating_sub(5)).map(of);
        all.filter(|x| x.is_finite())
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt()
    };
    let rate = spread(&|k| (position[k + 5] - position[k - 5]) / (10.0 * step));
    let size = spread(&|k| other[k]) / rate;
    [1.0, 1f64.to_degrees(), 1f64.to_radians()]
        .iter()
        .any(|known| (size / known - 1.0).abs() < SAME_SIZE)
}

/// How many times a velocity the derivative of a position is, where one follows the other.
pub(super) fn rate_over(position: &[f64], velocity: &[f64], step: f64) -> Option<f64> {
    if step <= 0.0 || likeness(position, velocity) < VELOCITY_CORRELATION {
        return None;
    }
    let all = (5..position.len().saturating_sub(5)).map(|k| {
        let rate = (position[k + 5] - position[k - 5]) / (10.0 * step);
        [rate * velocity[k], velocity[k] * velocity[k]]
    });
    let finite = all.filter(|pair| pair[0].is_finite());
    let [both, own] = finite.fold([0.0; 2], |sum, pair| [sum[0] + pair[0], sum[1] + pair[1]]);
    Some(both / own).filter(|ratio| ratio.is_finite())
}

/// Whether a column is the difference of two others, to a thousandth of its size.
pub(super) fn is_difference(a: &[f64], b: &[f64], other: &[f64]) -> bool {
    let rows = a.len().min(b.len()).min(other.len());
    let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
        let all = (0..rows).map(of);
        all.filter(|x| x.is_finite()).map(|x| x * x).sum()
    };
    let size = sum(&|k| other[k]);
    let off = |sign: f64| sum(&|k| other[k] - sign * (a[k] - b[k]));
    size > 0.0 && off(1.0).min(off(-1.0)) < 1e-6 * size
}

/// How rough a column is: its steps beside its spread. Positions are smoother than torques.
fn roughness(numbers: &[f64]) -> f64 {
    let finite: Vec<f64> = numbers.iter().copied().filter(|x| x.is_finite()).collect();
    let n = finite.len().max(1) as f64;
    let mean = finite.iter().sum::<f64>() / n;
    let spread = finite.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    let steps = finite.windows(2).map(|p| (p[1] - p[0]).powi(2));
    let steps = steps.sum::<f64>();
    match spread > 0.0 {
        true => steps / spread,
        false => f64::INFINITY,
    }
}

/// Role and joint of each column of a log that names none, times left out.
// The blocks `q dq tau` or `q tau`, joint after joint in each, or the three of each joint together.
pub(super) fn roles(columns: &[&[f64]], joints: Option<usize>) -> Vec<(ChannelRole, String)> {
    let m = columns.len();
    let mut out = vec![(ChannelRole::Other, String::new()); m];
    let mut set = |at: usize, role: ChannelRole, joint: usize| {
        if let Some(place) = out.get_mut(at) {
            *place = (role, (joint + 1).to_string());
        }
    };
    use ChannelRole::{Position, Torque, Velocity};
    if let Some((first, n, stride)) = with_velocities(columns, joints) {
        let by = if stride == 1 { n } else { 1 };
        let place = |joint: usize, what: usize| first + joint * stride + what * by;
        // the rate of the velocities is no torque
        let rises = |j: &usize| {
            let last = place(*j, 3);
            last < m
                && likeness(columns[place(*j, 1)], columns[place(*j, 2)]) > VELOCITY_CORRELATION
        };
        let accelerations =
            stride == 1 && (0..n).filter(rises).count() as f64 >= MIN_SHARE_OF_JOINTS * n as f64;
        for joint in 0..n {
            set(place(joint, 0), Position, joint);
            set(place(joint, 1), Velocity, joint);
            let torque = if accelerations { 3 } else { 2 };
            set(place(joint, torque), Torque, joint);
        }
        return out;
    }
    let n = joints.filter(|n| m >= 2 * n).unwrap_or(m / 2);
    if n == 0 {
        return out;
    }
    let rough = |from: usize| (from..from + n).map(|k| roughness(columns[k])).sum::<f64>();
    let torques_first = rough(0) > rough(n);
    for joint in 0..n {
        let (q, tau) = match torques_first {
            true => (n + joint, joint),
            false => (joint, n + joint),
        };
        set(q, Position, joint);
        set(tau, Torque, joint);
    }
    out
}

/// Place of the first position, number of joints and distance between positions, where velocities show them.
fn with_velocities(columns: &[&[f64]], joints: Option<usize>) -> Option<(usize, usize, usize)> {
    let m = columns.len();
    let is_rate = |q: usize, dq: usize| likeness(columns[q], columns[dq]) > VELOCITY_CORRELATION;
    let mut best: Option<(f64, (usize, usize, usize))> = None;
    let mut consider = |first: usize, n: usize, stride: usize| {
        let by = if stride == 1 { n } else { 1 };
        let last = first + (n - 1) * stride + by;
        if n == 0 || last >= m || joints.is_some_and(|j| j != n) {
            return;
        }
        let positions = || (0..n).map(|j| first + j * stride);
        // a joint that stands still shows no velocity
        let travel = |q: usize| {
            let finite = columns[q].iter().filter(|x| x.is_finite());
            let (low, high) = finite.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
            (high - low).max(0.0)
        };
        let farthest = positions().map(travel).fold(0.0, f64::max);
        let moving = || positions().filter(|q| travel(*q) > MIN_SHARE_OF_TRAVEL * farthest);
        let like = moving().filter(|q| is_rate(*q, q + by)).count() as f64
            / moving().count().max(1) as f64;
        // of equal ones the one with more joints
        let score = like + 1e-3 * n as f64;
        if like >= MIN_SHARE_OF_JOINTS && best.is_none_or(|(found, _)| score > found) {
            best = Some((score, (first, n, stride)));
        }
    };
    for first in 0..m.min(3) {
        for n in 1..=(m - first) / 2 {
            consider(first, n, 1);
        }
        for n in 2..=m / 3 {
            consider(first, n, 3);
        }
    }
    best.map(|(_, found)| found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(k: usize, joint: usize, turned: f64) -> f64 {
        let w = 1.0 + 0.37 * joint as f64;
        (w * 0.002 * k as f64 + turned).sin() * (1.0 + joint as f64)
    }

    fn noise(k: usize, joint: usize) -> f64 {
        ((k * 7919 + joint * 104_729) % 1000) as f64 / 1000.0 - 0.5
    }

    fn column(kind: char, joint: usize) -> Vec<f64> {
        let at = |k: usize| match kind {
            'q' => wave(k, joint, 0.0),
            'v' => wave(k, joint, std::f64::consts::FRAC_PI_2),
            'a' => -wave(k, joint, 0.0),
            _ => 3.0 * wave(k, joint, 1.0) + noise(k, joint),
        };
        (0..4000).map(at).collect()
    }

    fn roles_of(order: &str, joints: Option<usize>) -> String {
        let one = |word: &str| {
            let (kind, joint) = word.split_at(1);
            column(kind.parse().unwrap(), joint.parse().unwrap())
        };
        let columns: Vec<Vec<f64>> = order.split(' ').map(one).collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let letter = |(role, joint): (ChannelRole, String)| match role {
            ChannelRole::Position => format!("q{joint}"),
            ChannelRole::Velocity => format!("v{joint}"),
            ChannelRole::Torque => format!("t{joint}"),
            _ => "-".to_owned(),
        };
        let found: Vec<String> = roles(&columns, joints).into_iter().map(letter).collect();
        found.join(" ")
    }

    #[test]
    fn times_that_are_rounded_lie_within_one_rounding_of_an_even_line() {
        let times = |step: f64, rounding: f64| -> Vec<f64> {
            let at = |k: i32| (f64::from(k) * step / rounding).floor() * rounding;
            (0..2000).map(at).collect()
        };
        for (step, rounding) in [(2.5e-3, 1e-3), (1e-3, 1e-2), (0.01, 1.0 / 128.0)] {
            let found = rounded_step(&times(step, rounding)).unwrap();
            assert!((found / step - 1.0).abs() < 1e-2, "{step}: {found}");
        }
        assert_eq!(rounded_step(&times(0.01, 1e-6)), None);
        let uneven: Vec<f64> = (0..2000)
            .map(|k| f64::from(k) + 0.3 * f64::from(k % 3))
            .collect();
        assert_eq!(rounded_step(&uneven), None);
        let late: Vec<f64> = (0..2000).map(|k| f64::from(k + k / 500)).collect();
        assert_eq!(rounded_step(&late), None);
    }

    #[test]
    fn a_velocity_and_a_position_error_are_known_by_their_numbers() {
        let (q, dq, tau) = (column('q', 0), column('v', 0), column('t', 0));
        assert!(is_rate_of(&q, &dq, 0.002) && !is_rate_of(&q, &tau, 0.002));
        assert!(!is_rate_of(
            &q,
            &dq.iter().map(|x| 3.0 * x).collect::<Vec<_>>(),
            0.002
        ));
        let wanted: Vec<f64> = q.iter().zip(&tau).map(|(q, tau)| q + 1e-3 * tau).collect();
        let error: Vec<f64> = wanted.iter().zip(&q).map(|(a, b)| b - a).collect();
        assert!(is_difference(&wanted, &q, &error) && !is_difference(&wanted, &q, &tau));
    }

    #[test]
    fn blocks_and_joints_in_turn_are_known_by_their_velocities() {
        for (columns, roles) in [
            ("q0 q1 v0 v1 t0 t1", "q1 q2 v1 v2 t1 t2"),
            ("q0 q1 v0 v1 a0 a1 t0 t1", "q1 q2 v1 v2 - - t1 t2"),
            ("q0 v0 t0 q1 v1 t1", "q1 v1 t1 q2 v2 t2"),
            ("q0 v0 t0", "q1 v1 t1"),
        ] {
            assert_eq!(roles_of(columns, None), roles);
        }
    }

    #[test]
    fn without_velocities_positions_are_the_smoother_half() {
        assert_eq!(roles_of("q0 q1 t0 t1", Some(2)), "q1 q2 t1 t2");
        assert_eq!(roles_of("t0 t1 q0 q1", None), "t1 t2 q1 q2");
    }

    #[test]
    fn a_clock_runs_evenly_and_a_counter_of_rows_is_none() {
        let clock: Vec<f64> = (0..500).map(|k| 3.0 + 0.002 * f64::from(k)).collect();
        let count: Vec<f64> = (0..500).map(f64::from).collect();
        assert!(is_clock(&clock));
        assert!(!is_clock(&count));
        assert!(!is_clock(&column('q', 0)));
    }
}
