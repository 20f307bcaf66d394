//! `empirical`: a torque that the data show and that no named law gives with numbers that a machine can have: a
//! natural cubic spline of one signal of one joint (de Boor 1978, ch. IV), described by its peak.

use super::added::Added;
use super::entry::{Entry, Family, Key, Role, Search};
use super::law::{Law, Memory};
use super::law_text::exact;
use super::scene::Scene;
use super::signal::{CurveSignal, SIGNALS};
use super::site::CodeSite;
use super::unit::Unit;
use crate::number;

/// Knots of the spline.
const KNOTS: usize = 6;
/// Way back that makes a reversal, over that between the ends of the curve.
const TURN: f64 = 0.01;
const VALUES: [&str; KNOTS] = ["m_1", "m_2", "m_3", "m_4", "m_5", "m_6"];

const fn value(name: &'static str) -> Key {
    Key::size(name, Unit::Torque)
}

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
        value("m_1"),
        value("m_2"),
        value("m_3"),
        value("m_4"),
        value("m_5"),
        value("m_6"),
    ],
    role: Role::StandIn,
    search: Search::Grid,
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
    memory: Some(Memory {
        size: TURNING,
        step: |scene, place, shape, _, kept, out| {
            let Some(j) = place.joint() else { return };
            let (signal, least) = (CurveSignal::of(shape[0]), TURN * (shape[2] - shape[1]));
            let (mut x, sign) = signal.along(scene, j, least);
            if signal == CurveSignal::Way {
                x[0] = way(scene.stretch.q[j][0], least, kept);
            }
            let at = (x[0] - shape[1]) / (shape[2] - shape[1]).max(f64::MIN_POSITIVE);
            for (out, b) in out.iter_mut().zip(Basis::new().at(at)) {
                *out = sign[0] * b;
            }
        },
    }),
    code: Some(written),
    ..Law::linear(&ENTRY, &VALUES, |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let signal = CurveSignal::of(shape[0]);
        let (x, sign) = signal.along(scene, j, TURN * (shape[2] - shape[1]));
        let spline = Basis::new();
        for k in 0..scene.len() {
            let at = (x[k] - shape[1]) / (shape[2] - shape[1]).max(f64::MIN_POSITIVE);
            for (column, b) in out.iter_mut().zip(spline.at(at)) {
                column[k] = sign[k] * b;
            }
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

    /// The signal along a scene and the sign of the torque there; a reversal is a way back of `least`.
    fn along(self, scene: &Scene, j: usize, least: f64) -> (Vec<f64>, Vec<f64>) {
        let s = scene.stretch;
        let friction = || (0..s.len()).map(|k| scene.direction(j, k)).collect();
        match self {
            CurveSignal::Position => (s.q[j].clone(), vec![1.0; s.len()]),
            CurveSignal::Friction => (s.q[j].clone(), friction()),
            CurveSignal::Speed => (s.v[j].clone(), vec![1.0; s.len()]),
            CurveSignal::Load => (scene.load[j].clone(), friction()),
            CurveSignal::Way => (ways(&s.q[j], least), friction()),
        }
    }

    /// Ends of the curve to try on these scenes; none where nothing moves.
    pub fn ends(self, scenes: &[Scene], j: usize, range: f64) -> Vec<[f64; 2]> {
        if self == CurveSignal::Way {
            return [0.03, 0.1, 0.3].map(|share| [0.0, share * range]).to_vec();
        }
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for x in scenes.iter().flat_map(|s| self.along(s, j, 0.0).0) {
            ends = [ends[0].min(x), ends[1].max(x)];
        }
        if ends[0] < ends[1] {
            vec![ends]
        } else {
            Vec::new()
        }
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

/// The natural cubic splines that are one at a knot and zero at the others, over 0..1.
struct Basis {
    /// Second derivatives of each at the knots, per knot distance squared.
    bends: [[f64; KNOTS]; KNOTS],
}

impl Basis {
    fn new() -> Self {
        let unit = |i: usize| std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 });
        Basis {
            bends: std::array::from_fn(|i| bends(&unit(i))),
        }
    }

    /// Their values at x; constant beyond the ends.
    fn at(&self, x: f64) -> [f64; KNOTS] {
        let x = x.clamp(0.0, 1.0) * (KNOTS - 1) as f64;
        let k = (x as usize).min(KNOTS - 2);
        let (w, u) = ((k + 1) as f64 - x, x - k as f64);
        let bend = |s: f64| (s * s * s - s) / 6.0;
        std::array::from_fn(|i| {
            let own = |at: usize, share: f64| if i == at { share } else { 0.0 };
            own(k, w) + own(k + 1, u) + bend(w) * self.bends[i][k] + bend(u) * self.bends[i][k + 1]
        })
    }
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

impl Added {
    /// Signal and greatest torque of a curve in place of a law; none of a named effect.
    pub fn curve(&self) -> Option<(CurveSignal, f64)> {
        if self.law.entry.role != Role::StandIn {
            return None;
        }
        let spline = Basis::new();
        let at = |k: i32| spline.at(f64::from(k) / 100.0);
        let torque = |k: i32| -> f64 { at(k).iter().zip(&self.linear).map(|(b, c)| b * c).sum() };
        let peak = (0..=100).map(torque).map(f64::abs).fold(0.0, f64::max);
        Some((CurveSignal::of(self.shape[0]), peak))
    }
}

/// What it adds to generated code.
fn written(to: &mut CodeSite) {
    let signal = CurveSignal::of(to.shape()[0]);
    match signal {
        CurveSignal::Position | CurveSignal::Speed => {
            let over = if signal == CurveSignal::Speed {
                to.v()
            } else {
                to.q()
            };
            to.added(curve_text(to, &over));
        }
        CurveSignal::Friction | CurveSignal::Load => {
            let over = if signal == CurveSignal::Load {
                to.load()
            } else {
                to.q()
            };
            to.added(format!("{} * ({})", to.direction(), curve_text(to, &over)));
        }
        CurveSignal::Way => {
            let (q, least) = (to.q(), TURN * (to.shape()[2] - to.shape()[1]));
            let own = to.remember("turned", Some(TURNING + 1), "0.0", &q);
            let way = format!("way_{}", to.number());
            to.line(format!("let {way} = $way({q}, {}, &{own});", exact(least)));
            to.step(format!("{} * ({})", to.direction(), curve_text(to, &way)));
        }
    }
}

/// The curve over a signal, as a sum of cubes that begin at its knots.
fn curve_text(to: &CodeSite, signal: &str) -> String {
    let above = |x: &str| format!("0.5 * (({x}) + fabs({x}))");
    let (from, wide) = (to.shape()[1], to.shape()[2] - to.shape()[1]);
    let cubes = cubes(to.linear());
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
        let spline = Basis::new();
        for k in 0..KNOTS {
            let at = spline.at(k as f64 / 5.0);
            for (i, b) in at.into_iter().enumerate() {
                let wanted = if i == k { 1.0 } else { 0.0 };
                assert!((b - wanted).abs() < 1e-12, "{k} {i}");
            }
        }
        // a straight line has no bend; splines are smooth at the knots
        let line: f64 = (0..KNOTS).map(|i| spline.at(0.37)[i] * i as f64).sum();
        assert!((line - 0.37 * 5.0).abs() < 1e-12);
        let slope = |x: f64| (spline.at(x + 1e-6)[2] - spline.at(x)[2]) / 1e-6;
        assert!((slope(0.4) - slope(0.4 - 1e-6)).abs() < 1e-3);
        assert_eq!(spline.at(-3.0), spline.at(0.0));
        // the same as cubes that begin at the knots
        let values = [1.0, -2.0, 0.5, 3.0, 1.0, -1.0];
        let terms = cubes(&values);
        for x in [0.0, 0.7, 2.3, 4.9, 5.0] {
            let cube = |(k, c): (usize, &f64)| c * f64::max(x - k as f64, 0.0).powi(3);
            let sum: f64 = terms[2..].iter().enumerate().map(cube).sum();
            let shown = terms[0] + terms[1] * x + sum;
            let at = spline.at(x / 5.0);
            let wanted: f64 = at.iter().zip(&values).map(|(b, m)| b * m).sum();
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
