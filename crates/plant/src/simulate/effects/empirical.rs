//! `empirical`: a curve that was measured, and no law of its own.
//!
//! A natural cubic spline through m_1..m_6 at equal steps between `from` and `to`, in Hermite's form: its slopes
//! solve s_(k-1) + 4 s_k + s_(k+1) = 3 (m_(k+1) - m_(k-1)), and 2 s_1 + s_2 = 3 (m_2 - m_1) at each end. Over the
//! way since the last reversal it turns with the accepted steps ([`Effect::moved`]). A curve over the load would have
//! to be solved with the balance of torques, and is refused.

use cft_ident_core::explain::ErrorText;
use nalgebra::{SMatrix, SVector};

use super::{
    BuiltLaw, Effect, EffectSite, InitialCondition, PlantLaw, PlantRobot, PlantState, sign,
};
use crate::simulate::SimulateError;
use cft_ident_core::effect::empirical::ENTRY;

const KNOTS: usize = 6;
/// Way back that makes a reversal, over that between the ends of the curve.
const TURN: f64 = 0.01;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let (from, to) = site.travel;
        let size = 0.2 * site.scale;
        vec![1.0, from, to, size, 0.0, -size, -size, 0.0, size]
    },
    build,
};

fn build(site: &EffectSite, _: &PlantRobot, values: &[f64]) -> Result<BuiltLaw, SimulateError> {
    let (signal, from, to) = (values[0].round() as u32, values[1], values[2]);
    if to <= from {
        let (key, rule) = ("to - from", "must be above 0");
        return Err(SimulateError::number(ENTRY.name, key, to - from, rule));
    }
    if signal == 4 {
        return Err(site.refuse(
            ENTRY.name,
            ErrorText::new("a curve over the load is not simulated")
                .remedy("use `load-friction` or `drive-efficiency`"),
        ));
    }
    let knots: [f64; KNOTS] = std::array::from_fn(|i| values[3 + i]);
    BuiltLaw::plant(Curve {
        joint: site.joint(),
        signal,
        from,
        step: (to - from) / (KNOTS - 1) as f64,
        knots,
        slopes: slopes(knots),
        slope: site.slope(),
        turning: [0.0; 2],
        forward: true,
    })
}

/// Slopes at the knots, per step.
fn slopes(m: [f64; KNOTS]) -> [f64; KNOTS] {
    let last = KNOTS - 1;
    let matrix = SMatrix::<f64, KNOTS, KNOTS>::from_fn(|i, j| match i.abs_diff(j) {
        0 if i == 0 || i == last => 2.0,
        0 => 4.0,
        1 => 1.0,
        _ => 0.0,
    });
    let right = SVector::<f64, KNOTS>::from_fn(|i, _| {
        3.0 * (m[(i + 1).min(last)] - m[i.saturating_sub(1)])
    });
    // rows outweigh their neighbours: there is a solution
    matrix.lu().solve(&right).unwrap_or_default().into()
}

struct Curve {
    joint: usize,
    signal: u32,
    /// Where the spline begins and how far its knots are apart.
    from: f64,
    step: f64,
    knots: [f64; KNOTS],
    slopes: [f64; KNOTS],
    /// Slope of the sign of the speed.
    slope: f64,
    /// Position of the last reversal, and the farthest since.
    turning: [f64; 2],
    forward: bool,
}

impl Curve {
    fn at(&self, x: f64) -> f64 {
        let x = ((x - self.from) / self.step).clamp(0.0, (KNOTS - 1) as f64);
        let k = (x as usize).min(KNOTS - 2);
        let u = x - k as f64;
        let (value, slope) = (|i: usize| self.knots[k + i], |i: usize| self.slopes[k + i]);
        let ease = u * u * (3.0 - 2.0 * u);
        (1.0 - ease) * value(0)
            + ease * value(1)
            + u * (1.0 - u) * ((1.0 - u) * slope(0) - u * slope(1))
    }
}

impl Effect for Curve {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let (q, v) = (motion.q[self.joint], motion.v[self.joint]);
        let direction = sign(self.slope, v);
        torque[self.joint] += match self.signal {
            1 => self.at(q),
            2 => direction * self.at(q),
            3 => self.at(v),
            _ => direction * self.at((q - self.turning[0]).abs()),
        };
    }

    fn begin(&mut self, beginning: &InitialCondition, _z: &mut [f64]) {
        self.turning = [beginning.q.get(self.joint).copied().unwrap_or(0.0); 2];
    }

    fn moved(&mut self, motion: &PlantState) -> bool {
        if self.signal != 5 {
            return false;
        }
        let (q, farthest) = (motion.q[self.joint], self.turning[1]);
        let back = match self.forward {
            true => farthest - q,
            false => q - farthest,
        };
        let turned = back > TURN * (KNOTS - 1) as f64 * self.step;
        if turned {
            self.turning[0] = farthest;
            self.forward = !self.forward;
        }
        if turned || back <= 0.0 {
            self.turning[1] = q;
        }
        turned
    }
}
