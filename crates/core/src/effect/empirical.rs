//! `empirical`: a torque that the data show and that no named law gives with numbers that a machine can have: a
//! natural cubic spline of one signal of one joint (de Boor 1978, ch. IV), described by its peak.

use std::sync::LazyLock;

use super::signal::{CurveSignal, SIGNALS};
use super::{
    CodeSite, EffectScene, Entry, Family, Key, Law, ModelEffect, Role, ShapeSearch, Unit, exact,
};
use crate::number;

/// Knots of the spline.
const KNOTS: usize = 6;
/// Way back that makes a reversal, over that between the ends of the curve.
const TURN: f64 = 0.01;
const VALUES: [&str; KNOTS] = ["m_1", "m_2", "m_3", "m_4", "m_5", "m_6"];

pub static ENTRY: Entry = Entry {
    name: "empirical",
    families: &[
        Family::Position,
        Family::Velocity,
        Family::Load,
        Family::Memory,
    ],
    keys: &[
        Key::shape("signal", Unit::One).within(
            1.0,
            SIGNALS as f64,
            "must be 1 (position), 2 (position, by direction), 3 (speed), 4 (load, by direction) or 5 (way \
             since the last reversal, by direction)",
        ),
        Key::shape("from", Unit::Signal),
        Key::shape("to", Unit::Signal),
        Key::torque("m_1"),
        Key::torque("m_2"),
        Key::torque("m_3"),
        Key::torque("m_4"),
        Key::torque("m_5"),
        Key::torque("m_6"),
    ],
    role: Role::StandIn,
    search: ShapeSearch::Grid,
    separate_by: "log the same motion with another payload, another routing of the cables, or a second sensor",
    formula: "a natural cubic spline through m_1..m_6 at six equal steps between from and to of q (signal \
              1), q by direction (2), v (3), tau_l by direction (4) or the way since the last reversal by \
              direction (5); constant beyond them",
    source: "cables, hoses, sensors and whatever has no law of its own; added only for an effect that passes \
             every test with numbers that no machine has",
    said: |f| {
        let Some((signal, peak)) = f.curve else {
            return format!("torque of {}", f.at);
        };
        let words = signal.words()[0].replacen(' ', &format!(" of {} ", f.at), 1);
        format!("{words}: peak {} {}", number::significant(peak, 2), f.torque)
    },
    remedy: "look where the curve is highest; no law of the catalogue has its shape with numbers that a machine has",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["signal", "from", "to"],
    starts: |_, _| {
        Err("it is used only in place of an effect with numbers that no machine has".into())
    },
    varied: Some(|shape| {
        let signal = CurveSignal::of(shape[0]);
        (signal.family(), signal == CurveSignal::Position)
    }),
    signal_unit: Some(|shape| CurveSignal::of(shape[0]).unit()),
    memory: Some(TURNING),
    code: Some(written),
    ..Law::linear(&ENTRY, &VALUES, |at, kept, out| {
        let (signal, wide) = (CurveSignal::of(at.shape[0]), at.shape[2] - at.shape[1]);
        let x = match signal {
            CurveSignal::Way => way(at.q(), TURN * wide, kept),
            signal => signal.value(at.scene, at.joint, at.k),
        };
        let sign = match signal {
            CurveSignal::Position | CurveSignal::Speed => 1.0,
            CurveSignal::Friction | CurveSignal::Load | CurveSignal::Way => at.direction(),
        };
        let values = splines((x - at.shape[1]) / wide.max(f64::MIN_POSITIVE));
        for (out, b) in out.iter_mut().zip(values) {
            *out = sign * b;
        }
    })
};

impl CurveSignal {
    /// Family of what depends on it.
    pub(crate) fn family(self) -> Family {
        match self {
            CurveSignal::Position | CurveSignal::Friction => Family::Position,
            CurveSignal::Speed => Family::Velocity,
            CurveSignal::Load => Family::Load,
            CurveSignal::Way => Family::Memory,
        }
    }

    /// Its unit.
    pub(crate) fn unit(self) -> Unit {
        match self {
            CurveSignal::Position | CurveSignal::Friction | CurveSignal::Way => Unit::Position,
            CurveSignal::Speed => Unit::Speed,
            CurveSignal::Load => Unit::Torque,
        }
    }

    /// The signal at sample k; the position where the way hangs on samples before.
    fn value(self, scene: &EffectScene, j: usize, k: usize) -> f64 {
        match self {
            CurveSignal::Position | CurveSignal::Friction | CurveSignal::Way => {
                scene.stretch.q[j][k]
            }
            CurveSignal::Speed => scene.stretch.v[j][k],
            CurveSignal::Load => scene.load[j][k],
        }
    }

    /// Ends of the curve to try on these scenes; none where nothing moves.
    pub fn ends(self, scenes: &[EffectScene], j: usize, range: f64) -> Vec<[f64; 2]> {
        if self == CurveSignal::Way {
            return [0.03, 0.1, 0.3].map(|share| [0.0, share * range]).to_vec();
        }
        let values = scenes
            .iter()
            .flat_map(|s| (0..s.len()).map(move |k| self.value(s, j, k)));
        let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |ends, x| {
            [ends[0].min(x), ends[1].max(x)]
        });
        Vec::from_iter((ends[0] < ends[1]).then_some(ends))
    }
}

/// Ways since the last turning point.
pub fn ways(q: &[f64], least: f64) -> Vec<f64> {
    let mut turning = [f64::NAN; TURNING];
    q.iter().map(|q| way(*q, least, &mut turning)).collect()
}

/// Numbers that a way keeps: where it began, turned and came farthest, and the direction.
const TURNING: usize = 4;

/// Way since the last turning point; a way back of `least` makes one. NaN is kept before the first sample.
fn way(q: f64, least: f64, kept: &mut [f64]) -> f64 {
    if kept[0].is_nan() {
        kept.copy_from_slice(&[q, q, q, 0.0]);
    }
    let [first, turn, extreme, direction] = kept else {
        return 0.0;
    };
    if *direction == 0.0 && (q - *first).abs() > least {
        *direction = if q > *first { 1.0 } else { -1.0 };
    }
    if *direction * (q - *extreme) >= 0.0 {
        *extreme = q;
    } else if (q - *extreme).abs() > least {
        (*turn, *extreme, *direction) = (*extreme, q, -*direction);
    }
    (q - *turn).abs()
}

/// Bends of the natural cubic splines that are one at a knot and zero at the others.
static BENDS: LazyLock<[[f64; KNOTS]; KNOTS]> = LazyLock::new(|| {
    let unit = |i: usize| std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 });
    std::array::from_fn(|i| bends(&unit(i)))
});

/// Values of those splines at x in 0..1; constant beyond the ends.
fn splines(x: f64) -> [f64; KNOTS] {
    let x = x.clamp(0.0, 1.0) * (KNOTS - 1) as f64;
    let k = (x as usize).min(KNOTS - 2);
    let (w, u) = ((k + 1) as f64 - x, x - k as f64);
    let bend = |s: f64| (s * s * s - s) / 6.0;
    let bends = &*BENDS;
    std::array::from_fn(|i| {
        let own = |at: usize, share: f64| if i == at { share } else { 0.0 };
        own(k, w) + own(k + 1, u) + bend(w) * bends[i][k] + bend(u) * bends[i][k + 1]
    })
}

/// Second derivatives of the natural cubic spline through values at unit distance, by elimination.
fn bends(y: &[f64; KNOTS]) -> [f64; KNOTS] {
    let mut m = [0.0; KNOTS];
    let mut diagonal = [0.0; KNOTS];
    for k in 1..KNOTS - 1 {
        let right = 6.0 * (y[k + 1] - 2.0 * y[k] + y[k - 1]);
        let above = if k > 1 { 1.0 / diagonal[k - 1] } else { 0.0 };
        diagonal[k] = 4.0 - above;
        m[k] = right - above * m[k - 1];
    }
    for k in (1..KNOTS - 1).rev() {
        m[k] = (m[k] - m[k + 1]) / diagonal[k];
    }
    m
}

/// The spline through values at unit distance as m + s x + sum over k of c_k (x - k)^3 for x > k: m, s, then c_k.
fn cubes(values: &[f64]) -> Vec<f64> {
    let y: [f64; KNOTS] = std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0));
    let m = bends(&y);
    let third = |k: usize| (m[k + 1] - m[k]) / 6.0;
    let mut out = vec![y[0], y[1] - y[0] - m[1] / 6.0, third(0)];
    out.extend((1..KNOTS - 1).map(|k| third(k) - third(k - 1)));
    out
}

impl ModelEffect {
    /// Signal and greatest torque of a curve in place of a law; none of a named effect.
    pub fn curve(&self) -> Option<(CurveSignal, f64)> {
        if self.law.entry.role != Role::StandIn {
            return None;
        }
        let torque = |k: i32| {
            let values = splines(f64::from(k) / 100.0);
            values.iter().zip(&self.linear).map(|(b, c)| b * c).sum()
        };
        let peak = (0..=100).map(torque).map(f64::abs).fold(0.0, f64::max);
        Some((CurveSignal::of(self.shape[0]), peak))
    }
}

/// What it adds to generated code.
fn written(to: &mut CodeSite) {
    let by_direction =
        |to: &CodeSite, over: &str| format!("{} * ({})", to.direction(), curve_text(to, over));
    match CurveSignal::of(to.shape[0]) {
        CurveSignal::Position => to.added(curve_text(to, &to.q())),
        CurveSignal::Speed => to.added(curve_text(to, &to.v())),
        CurveSignal::Friction => to.added(by_direction(to, &to.q())),
        CurveSignal::Load => to.added(by_direction(to, &to.load())),
        CurveSignal::Way => {
            let (q, least) = (to.q(), TURN * (to.shape[2] - to.shape[1]));
            let own = to.remember("turned", Some(TURNING + 1), "0.0", &q);
            let way = format!("way_{}", to.number);
            to.line(format!("let {way} = $way({q}, {}, &{own});", exact(least)));
            to.step(by_direction(to, &way));
        }
    }
}

/// The curve over a signal, as a sum of cubes that begin at its knots.
fn curve_text(to: &CodeSite, signal: &str) -> String {
    let above = |x: &str| format!("0.5 * (({x}) + fabs({x}))");
    let (from, wide) = (to.shape[1], to.shape[2] - to.shape[1]);
    let cubes = cubes(to.linear);
    let (steps, terms) = cubes.split_at(2);
    let per_step = terms.len() as f64 / wide;
    let x = above(&format!(
        "({signal} - {}) * {}",
        exact(from),
        exact(per_step)
    ));
    let beyond = above(&format!("{x} - {}", exact(terms.len() as f64)));
    let x = format!("({x} - {beyond})");
    let mut out = format!("{} + {} * {x}", exact(steps[0]), exact(steps[1]));
    for (k, cube) in terms.iter().enumerate() {
        let part = above(&format!("{x} - {}", exact(k as f64)));
        out += &format!(" + {} * pow({part}, 3.0)", exact(*cube));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_passes_its_knots_and_is_straight_where_they_are() {
        for k in 0..KNOTS {
            for (i, b) in splines(k as f64 / 5.0).into_iter().enumerate() {
                let wanted = if i == k { 1.0 } else { 0.0 };
                assert!((b - wanted).abs() < 1e-12, "{k} {i}");
            }
        }
        // a straight line has no bend; splines are smooth at the knots
        let line: f64 = (0..KNOTS).map(|i| splines(0.37)[i] * i as f64).sum();
        assert!((line - 0.37 * 5.0).abs() < 1e-12);
        let slope = |x: f64| (splines(x + 1e-6)[2] - splines(x)[2]) / 1e-6;
        assert!((slope(0.4) - slope(0.4 - 1e-6)).abs() < 1e-3);
        assert_eq!(splines(-3.0), splines(0.0));
        // the same as cubes that begin at the knots
        let values = [1.0, -2.0, 0.5, 3.0, 1.0, -1.0];
        let terms = cubes(&values);
        for x in [0.0, 0.7, 2.3, 4.9, 5.0] {
            let cube = |(k, c): (usize, &f64)| c * f64::max(x - k as f64, 0.0).powi(3);
            let sum: f64 = terms[2..].iter().enumerate().map(cube).sum();
            let shown = terms[0] + terms[1] * x + sum;
            let wanted: f64 = splines(x / 5.0)
                .iter()
                .zip(&values)
                .map(|(b, m)| b * m)
                .sum();
            assert!((shown - wanted).abs() < 1e-12, "{x}: {shown} {wanted}");
        }
    }

    #[test]
    fn the_way_since_a_reversal_begins_anew_where_the_joint_turns_and_not_where_it_trembles() {
        let q = [0.0, 0.1, 0.3, 0.299, 0.4, 0.2, 0.1, 0.3];
        let way = ways(&q, 0.01);
        let wanted = [0.0, 0.1, 0.3, 0.299, 0.4, 0.2, 0.3, 0.2];
        for (k, (x, wanted)) in way.iter().zip(wanted).enumerate() {
            assert!((x - wanted).abs() < 1e-12, "{k}: {x}");
        }
    }
}
