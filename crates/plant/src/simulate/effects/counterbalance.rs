//! `counterbalance`: a spring between a point of the base and a point of the link, or a smooth moment.
//!
//! The base's point lies at the distance a from the axis in the direction `angle`, the link's at the distance
//! b in the direction q, so that the spring is l = sqrt(a^2 + b^2 - 2 a b cos(q - angle)) long and the motor
//! supplies d/dq of stiffness (l - free_length)^2/2. A moment that was found and not built is a cubic B-spline
//! with the coefficients m_1..m_6 on three equal pieces between `from` and `to`, constant beyond them.

use super::{BuiltLaw, Effect, EffectSite, PlantLaw, PlantRobot, PlantState};
use crate::simulate::SimulateError;
use cft_ident_core::effect::counterbalance::ENTRY;

/// Coefficients of the spline.
const COUNT: usize = 6;
/// Pieces between its ends.
const PIECES: usize = COUNT - 3;
/// Default distances of the two points from the axis \[m\].
const FAR_POINT_M: f64 = 0.4;
const NEAR_POINT_M: f64 = 0.1;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let stiffness = 0.4 * site.scale / (FAR_POINT_M * NEAR_POINT_M);
        let spring = [stiffness, 0.5 * FAR_POINT_M, FAR_POINT_M, NEAR_POINT_M];
        let (angle, (from, to)) = (site.middle() - std::f64::consts::FRAC_PI_2, site.travel);
        [&spring[..], &[angle, from, to], &[0.0; COUNT]].concat()
    },
    build,
};

fn build(site: &EffectSite, _: &PlantRobot, values: &[f64]) -> Result<BuiltLaw, SimulateError> {
    let refuse = |key, value, rule: &str| SimulateError::number(ENTRY.name, key, value, rule);
    let (stiffness, a, b) = (values[0], values[2], values[3]);
    if stiffness != 0.0 && !site.turns {
        return Err(site.refuse(
            ENTRY.name,
            "its lever turns about an axis, and this joint slides; use `spring`, or give m_1..m_6 without a \
             stiffness",
        ));
    }
    if !(a > 0.0 && b > 0.0) || a == b {
        let rule = "a and b must be above 0 and differ, or the spring's length reaches 0";
        return Err(refuse("a - b", a - b, rule));
    }
    let (from, to) = (values[5], values[6]);
    if to <= from {
        return Err(refuse("to - from", to - from, "must be above 0"));
    }
    BuiltLaw::plant(CounterbalanceEffect {
        joint: site.joint(),
        stiffness,
        free_length: values[1],
        a,
        b,
        angle: values[4],
        from,
        piece: (to - from) / PIECES as f64,
        coefficients: std::array::from_fn(|i| values[7 + i]),
    })
}

/// A spring that carries the weight of a link.
struct CounterbalanceEffect {
    joint: usize,
    stiffness: f64,
    free_length: f64,
    a: f64,
    b: f64,
    angle: f64,
    /// Where the spline begins and how long each piece is, m or rad.
    from: f64,
    piece: f64,
    coefficients: [f64; COUNT],
}

impl CounterbalanceEffect {
    /// The lever's moment at the position q.
    fn lever(&self, q: f64) -> f64 {
        let (s, c) = (q - self.angle).sin_cos();
        let moment = self.a * self.b * s;
        let length = (self.a * self.a + self.b * self.b - 2.0 * self.a * self.b * c).sqrt();
        self.stiffness * (length - self.free_length) * moment / length
    }

    /// The spline at the position q, by de Boor's corner cutting on equal knots.
    fn spline(&self, q: f64) -> f64 {
        let x = ((q - self.from) / self.piece).clamp(0.0, PIECES as f64);
        let first = (x as usize).min(PIECES - 1);
        let u = x - first as f64;
        let mut d: [f64; 4] = std::array::from_fn(|i| self.coefficients[first + i]);
        for round in 1..=3 {
            for i in (round..=3).rev() {
                let share = (u + (3 - i) as f64) / (4 - round) as f64;
                d[i] = (1.0 - share) * d[i - 1] + share * d[i];
            }
        }
        d[3]
    }
}

impl Effect for CounterbalanceEffect {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let q = motion.q[self.joint];
        if self.stiffness != 0.0 {
            torque[self.joint] += self.lever(q);
        }
        if self.coefficients != [0.0; COUNT] {
            torque[self.joint] += self.spline(q);
        }
    }
}
