//! Delay between positions and torques, from the motion itself.
//!
//! For each trial delay the torque of each joint is fitted by its own motion: inertia, viscous and
//! Coulomb friction, gravity of one link and an offset, with one set of coefficients for all
//! stretches of the log. Inertia and friction take power and give none: their coefficients have one
//! sign. Without these two, a torque that depends on position (cogging) looks like any delay at one
//! speed. The delay of the least residual is the one by which the torques lag; its standard
//! deviation is that of the jackknife over the stretches.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Rows that are used at most.
const MAX_ROWS: usize = 1 << 14;
/// Trial delays on each side of 0, in steps of the positions' clock.
const TRIALS: usize = 40;
/// Columns of the fit: acceleration, speed, a soft and a sharp step of friction, sine, cosine, 1.
const COLUMNS: usize = 7;
/// Of them the first ones, that only take power.
const PASSIVE_COLUMNS: usize = 4;
/// Share of the torque that the motion must explain.
const MIN_EXPLAINED_SHARE: f64 = 0.5;
/// Least share of each direction in the squared speed: one way at one speed, cogging looks like any delay.
const MIN_SHARE_EACH_WAY: f64 = 0.1;
/// Share of the gain over no delay that another minimum may reach.
const MAX_GAIN_OF_SECOND_BEST: f64 = 0.5;
/// Stretches of the jackknife: the most, and the least that give a deviation.
const JACKKNIFE_STRETCHES: std::ops::RangeInclusive<usize> = 3..=8;

#[derive(Debug, Default)]
pub(crate) struct DelayEstimator {
    joints: usize,
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
    /// Rows at which a new stretch begins.
    begins: Vec<usize>,
}

/// An estimated delay of the torques behind the positions, and its standard deviation [s].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DelayEstimate {
    pub(crate) delay_s: f64,
    pub(crate) std_s: f64,
}

/// Sums of one joint over one stretch.
#[derive(Debug, Clone, Copy)]
struct DelaySums {
    rows: f64,
    /// Y' Y.
    normal: [[f64; COLUMNS]; COLUMNS],
    /// Y' tau of each trial.
    right: [[f64; COLUMNS]; 2 * TRIALS + 1],
    /// tau' tau of each trial.
    power: [f64; 2 * TRIALS + 1],
    /// Sum of the torque that is not shifted.
    total: f64,
}

impl DelayEstimator {
    /// Adds a row; those beyond the first some thousands are not needed.
    pub(crate) fn add(&mut self, t: f64, q: &[f64], tau: &[f64]) {
        if self.t.len() == MAX_ROWS || q.len() != tau.len() || q.is_empty() {
            return;
        }
        let finite = q.iter().chain(tau).all(|value| value.is_finite());
        if !finite || (!self.t.is_empty() && q.len() != self.joints) {
            return;
        }
        self.joints = q.len();
        self.t.push(t);
        self.q.extend(q);
        self.tau.extend(tau);
    }

    /// The next row does not follow the last one.
    pub(crate) fn begin_stretch(&mut self) {
        self.begins.push(self.t.len());
    }

    /// One sentence about the delay for the user; `removed_s` is already taken off.
    pub(super) fn describe(&self, positions: &str, torques: &str, removed_s: f64) -> String {
        let removed = match removed_s {
            0.0 => "not removed: `torque_delay_s` in [log] of the robot file does that".to_owned(),
            removed => format!("{:.1} ms are taken off already", removed * 1e3),
        };
        match self.estimate() {
            None => format!(
                "the delay between {positions} and {torques} cannot be determined from the motion ({removed})"
            ),
            Some(DelayEstimate { delay_s, std_s }) => format!(
                "{torques} lags behind {positions} by {:.1} ms (standard deviation {:.1} ms), estimated from the motion; {removed}",
                delay_s * 1e3,
                std_s * 1e3
            ),
        }
    }

    /// The delay; `None` where the motion explains too little of the torques, or some stretches alone decide it.
    pub(crate) fn estimate(&self) -> Option<DelayEstimate> {
        let mut steps: Vec<f64> = self.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let dt = *steps.get(steps.len() / 2)?;
        let half = ((0.01 / dt).round() as usize).clamp(1, 25);
        let stretches = self.stretches(TRIALS + 2 * half + 2);
        if !(dt > 0.0 && JACKKNIFE_STRETCHES.contains(&stretches.len())) {
            return None;
        }
        let sums: Vec<Vec<DelaySums>> = (0..self.joints)
            .filter_map(|joint| self.sums(joint, &stretches, dt, half))
            .collect();
        let delay = best_delay(&sums, None)? * dt;
        let without = |left_out| Some(best_delay(&sums, Some(left_out))? * dt);
        let without: Vec<f64> = (0..stretches.len()).map(without).collect::<Option<_>>()?;
        let count = without.len() as f64;
        let mean = without.iter().sum::<f64>() / count;
        let scatter: f64 = without.iter().map(|delay| (delay - mean).powi(2)).sum();
        Some(DelayEstimate {
            delay_s: delay,
            std_s: (scatter * (count - 1.0) / count).sqrt(),
        })
    }

    /// Stretches of at least four edges, as many as the jackknife wants.
    fn stretches(&self, edge: usize) -> Vec<Range<usize>> {
        let mut ends = self.begins.clone();
        ends.push(self.t.len());
        let mut whole = Vec::new();
        let mut from = 0;
        for end in ends {
            if end - from >= 4 * edge {
                whole.push(from..end);
            }
            from = end;
        }
        if whole.len() >= *JACKKNIFE_STRETCHES.start() {
            let stride = whole.len().div_ceil(*JACKKNIFE_STRETCHES.end());
            return whole.into_iter().step_by(stride).collect();
        }
        let pieces = |range: Range<usize>| {
            let most = JACKKNIFE_STRETCHES.end().div_ceil(whole.len());
            let count = (range.len() / (4 * edge)).clamp(1, most);
            let step = range.len() / count;
            (0..count).map(move |i| range.start + i * step..range.start + (i + 1) * step)
        };
        whole.iter().cloned().flat_map(pieces).collect()
    }

    /// Sums of one joint over each stretch; `None` for a joint that rests or does not move both ways.
    fn sums(
        &self,
        joint: usize,
        stretches: &[Range<usize>],
        dt: f64,
        half: usize,
    ) -> Option<Vec<DelaySums>> {
        let of = |values: &[f64], rows: &Range<usize>| -> Vec<f64> {
            let values = &values[rows.start * self.joints..rows.end * self.joints];
            let values = values.iter().skip(joint).step_by(self.joints);
            values.copied().collect()
        };
        let motion = |rows: &Range<usize>| {
            // lightly smoothed for the sign of the speed; torque and motion alike for the fit
            let q = smoothed(&of(&self.q, rows), half.min(2));
            let v = derivative(&q, dt);
            let a = derivative(&v, dt);
            [q, v, a, of(&self.tau, rows)]
        };
        let motions: Vec<[Vec<f64>; 4]> = stretches.iter().map(motion).collect();
        let rows: usize = motions.iter().map(|m| m[0].len()).sum();
        let rms = |which: usize| {
            let squares = motions.iter().flat_map(|m| &m[which]).map(|x| x * x);
            (squares.sum::<f64>() / rows as f64).sqrt()
        };
        let (v_rms, a_rms) = (rms(1), rms(2));
        let speeds = motions.iter().flat_map(|m| &m[1]);
        let back: f64 = speeds.map(|v| v.min(0.0).powi(2)).sum();
        let back = back / (v_rms * v_rms * rows as f64);
        let both_ways = (MIN_SHARE_EACH_WAY..=1.0 - MIN_SHARE_EACH_WAY).contains(&back);
        if v_rms == 0.0 || a_rms == 0.0 || !both_ways {
            return None;
        }
        let sums = motions.iter().map(|[q, v, a, tau]| {
            let of = |column: &dyn Fn(usize) -> f64| {
                twice(&(0..q.len()).map(column).collect::<Vec<_>>(), half)
            };
            let columns: [Vec<f64>; COLUMNS] = [
                of(&|i| a[i] / a_rms),
                of(&|i| v[i] / v_rms),
                of(&|i| (10.0 * v[i] / v_rms).tanh()),
                of(&|i| (50.0 * v[i] / v_rms).tanh()),
                of(&|i| q[i].sin()),
                of(&|i| q[i].cos()),
                vec![1.0; q.len()],
            ];
            DelaySums::of(&columns, &twice(tau, half), TRIALS + 2 * half + 2)
        });
        Some(sums.collect())
    }
}

impl DelaySums {
    const NONE: Self = Self {
        rows: 0.0,
        normal: [[0.0; COLUMNS]; COLUMNS],
        right: [[0.0; COLUMNS]; 2 * TRIALS + 1],
        power: [0.0; 2 * TRIALS + 1],
        total: 0.0,
    };

    /// The motion stays and the torques are shifted, so that all trials have one normal matrix.
    fn of(columns: &[Vec<f64>; COLUMNS], tau: &[f64], edge: usize) -> Self {
        let mut sums = Self::NONE;
        for row in edge..tau.len() - edge {
            sums.rows += 1.0;
            sums.total += tau[row];
            for i in 0..COLUMNS {
                for j in 0..=i {
                    sums.normal[i][j] += columns[i][row] * columns[j][row];
                }
            }
            for trial in 0..=2 * TRIALS {
                let tau = tau[row + trial - TRIALS];
                sums.power[trial] += tau * tau;
                for (sum, column) in sums.right[trial].iter_mut().zip(columns) {
                    *sum += column[row] * tau;
                }
            }
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        self.rows += other.rows;
        self.total += other.total;
        for (sum, value) in self.power.iter_mut().zip(&other.power) {
            *sum += value;
        }
        let rows = self.normal.iter_mut().chain(&mut self.right);
        for (sum, value) in rows.zip(other.normal.iter().chain(&other.right)) {
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum += value;
            }
        }
    }

    /// Normal matrix of some columns, with a ridge far below what is measured.
    fn of_columns(&self, columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            let (i, j) = (columns[i.max(j)], columns[i.min(j)]);
            self.normal[i][j] + if i == j { 1e-9 * self.rows } else { 0.0 }
        })
    }

    /// Share of the torque's variation that is left at each trial.
    fn left(&self) -> Option<Vec<f64>> {
        let variation = self.power[TRIALS] - self.total * self.total / self.rows;
        if variation <= 0.0 {
            return None;
        }
        // the columns of each subset of the passive ones, with those of any sign
        let factored = |subset: usize| {
            let taken = |column: &usize| *column >= PASSIVE_COLUMNS || subset >> column & 1 == 1;
            let columns: Vec<usize> = (0..COLUMNS).filter(taken).collect();
            let factor = self.of_columns(&columns).cholesky()?;
            Some((columns, factor))
        };
        let subsets: Vec<_> = (0..1 << PASSIVE_COLUMNS).filter_map(factored).collect();
        let (mut ahead, mut turned) = (Vec::new(), Vec::new());
        for (right, power) in self.right.iter().zip(&self.power) {
            let all = subsets.iter();
            let explained = all.map(|(columns, factor)| explained(columns, factor, right));
            let most = explained.fold([0.0f64; 2], |[a, b], [x, y]| [a.max(x), b.max(y)]);
            let [own, other] = most.map(|most| ((power - most) / variation).max(0.0));
            ahead.push(own);
            turned.push(other);
        }
        // a torque whose sign is turned has its delay too
        let least = |left: &[f64]| left.iter().copied().fold(f64::INFINITY, f64::min);
        match least(&turned) < least(&ahead) {
            true => Some(turned),
            false => Some(ahead),
        }
    }
}

/// The delay in steps at which all joints together leave least, without one stretch if asked.
fn best_delay(joints: &[Vec<DelaySums>], left_out: Option<usize>) -> Option<f64> {
    let mut residuals = [0.0; 2 * TRIALS + 1];
    let mut any = false;
    for stretches in joints {
        let mut sums = DelaySums::NONE;
        for (index, stretch) in stretches.iter().enumerate() {
            if Some(index) != left_out {
                sums.add(stretch);
            }
        }
        let Some(left) = sums.left() else { continue };
        let least = left.iter().copied().fold(f64::INFINITY, f64::min);
        if least > 1.0 - MIN_EXPLAINED_SHARE {
            continue;
        }
        any = true;
        // a joint weighs by how its residual rises away from the delay
        for (sum, value) in residuals.iter_mut().zip(&left) {
            *sum += value / least.max(1e-12);
        }
    }
    let least = (0..residuals.len()).min_by(|a, b| residuals[*a].total_cmp(&residuals[*b]))?;
    // at the edge of the trials it is no minimum
    if !any || least == 0 || least + 1 == residuals.len() {
        return None;
    }
    // as good at another delay: a motion of one frequency determines it up to whole periods
    let gain = |trial: usize| residuals[TRIALS] - residuals[trial];
    let minimum = |trial: &usize| {
        let higher = |other: Option<&f64>| other.is_none_or(|other| *other >= residuals[*trial]);
        higher(residuals[..*trial].last()) && higher(residuals.get(trial + 1))
    };
    let mut others = (0..residuals.len()).filter(|trial| *trial != least && minimum(trial));
    if others.any(|other| gain(other) > MAX_GAIN_OF_SECOND_BEST * gain(least)) {
        return None;
    }
    let [before, middle, after] = [residuals[least - 1], residuals[least], residuals[least + 1]];
    let curvature = before - 2.0 * middle + after;
    (curvature > 0.0).then(|| least as f64 - TRIALS as f64 + 0.5 * (before - after) / curvature)
}

/// Power that these columns explain where passive ones take power, and where all of them drive; else 0.
fn explained(columns: &[usize], factor: &Cholesky<f64, Dyn>, right: &[f64; COLUMNS]) -> [f64; 2] {
    let right = DVector::from_iterator(columns.len(), columns.iter().map(|i| right[*i]));
    let x = factor.solve(&right);
    let explained = right.dot(&x);
    [1.0, -1.0].map(|sign| {
        let drives = |(column, x): (&usize, &f64)| *column < PASSIVE_COLUMNS && sign * x < 0.0;
        match columns.iter().zip(&x).any(drives) {
            true => 0.0,
            false => explained,
        }
    })
}

/// Mean over `half` neighbours on each side.
fn smoothed(x: &[f64], half: usize) -> Vec<f64> {
    let mean = |i: usize| {
        let near = &x[i.saturating_sub(half)..(i + half + 1).min(x.len())];
        near.iter().sum::<f64>() / near.len() as f64
    };
    (0..x.len()).map(mean).collect()
}

/// Central differences; 0 at the ends.
fn derivative(x: &[f64], dt: f64) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for (to, near) in out.iter_mut().skip(1).zip(x.windows(3)) {
        *to = (near[2] - near[0]) / (2.0 * dt);
    }
    out
}

/// The mean of means: a triangular window.
fn twice(x: &[f64], half: usize) -> Vec<f64> {
    smoothed(&smoothed(x, half), half)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint whose torque lags by `delay_s`, with measurement noise from a fixed pattern.
    fn moved(delay_s: f64, noise: f64) -> DelayEstimator {
        let mut delay = DelayEstimator::default();
        let dt = 0.004;
        let q = |t: f64| 0.8 * (1.7 * t).sin() + 0.3 * (4.1 * t).sin();
        let v = |t: f64| 0.8 * 1.7 * (1.7 * t).cos() + 0.3 * 4.1 * (4.1 * t).cos();
        let a = |t: f64| {
            -0.8 * 1.7f64.powi(2) * (1.7 * t).sin() - 0.3 * 4.1f64.powi(2) * (4.1 * t).sin()
        };
        let mut seed = 1u64;
        for i in 0..5000 {
            let t = i as f64 * dt;
            let s = t - delay_s;
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let white = (seed >> 33) as f64 / (1u64 << 30) as f64 - 1.0;
            let tau = 2.0 * a(s) + 0.7 * v(s) + 1.5 * (20.0 * v(s)).tanh() + 4.0 * q(s).cos();
            delay.add(t, &[q(t)], &[tau + noise * white]);
        }
        delay
    }

    #[test]
    fn a_lag_between_two_steps_of_the_clock_is_found() {
        for delay_s in [0.0, 0.0131, -0.0062, 0.05] {
            for noise in [0.0, 0.5] {
                let found = moved(delay_s, noise).estimate().unwrap();
                assert!(
                    (found.delay_s - delay_s).abs() < 2e-4 + 4.0 * noise * found.std_s,
                    "{delay_s}: {found:?}"
                );
                assert!((1e-6..5e-4).contains(&found.std_s), "{found:?}");
            }
        }
    }

    #[test]
    fn torques_that_have_nothing_to_do_with_the_motion_have_no_delay() {
        let mut other = moved(0.0, 0.0);
        for (index, tau) in other.tau.iter_mut().enumerate() {
            *tau = ((index * 7919) % 104729) as f64;
        }
        assert_eq!(other.estimate(), None);
        assert_eq!(DelayEstimator::default().estimate(), None);
        assert!(
            DelayEstimator::default()
                .describe("/a", "/b", 0.0)
                .contains("cannot be determined")
        );
    }

    /// A slow drive whose torque ripples with position at constant speed, its controller in phase.
    fn rippling(both_ways: bool) -> DelayEstimator {
        let mut delay = DelayEstimator::default();
        let dt = 0.004;
        for i in 0..8000 {
            let t = i as f64 * dt;
            let way = if both_ways && t > 16.0 { -1.0 } else { 1.0 };
            let q = if way > 0.0 { t } else { 32.0 - t };
            // the position follows the ripple a quarter of a period late
            let q = q + 1e-3 * (42.0 * q).cos() * way;
            let tau = 0.3 * way + 0.4 * (42.0 * q).sin();
            delay.add(t, &[q], &[tau]);
        }
        delay
    }

    #[test]
    fn a_torque_that_ripples_with_position_is_no_delay() {
        for both_ways in [false, true] {
            let found = rippling(both_ways).estimate();
            let claims =
                |found: DelayEstimate| found.delay_s.abs() > 0.008_f64.max(6.0 * found.std_s);
            assert!(!found.is_some_and(claims), "{both_ways}: {found:?}");
        }
    }
}
