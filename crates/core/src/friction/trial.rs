//! One-joint records for the tests of this room: integrated here, by Euler steps of 10 us, so that
//! they share no code with the filter.

use super::prepare::{PreparedProblem, SensorModel, SmoothedMotion, prepare};
use crate::robot::friction::DoubleTanh;
use crate::robot::{JointKind, Robot};

/// Plant and experiment.
pub struct FrictionTrial {
    pub law: DoubleTanh,
    pub inertia: f64,
    pub offset: f64,
    /// Amplitudes [m] and frequencies [Hz] of the wanted motion.
    pub motion: Vec<(f64, f64)>,
    pub seconds: f64,
    /// Encoder step [m], and standard deviation of the logged torque's noise [N].
    pub step: f64,
    pub noise: f64,
}

impl FrictionTrial {
    /// A drive with a Stribeck dip that passes slowly and quickly through zero speed.
    pub fn usual() -> Self {
        FrictionTrial {
            law: DoubleTanh::from_parameters([30.0, 14.0, -5.0, 150.0, 12.0]),
            inertia: 12.0,
            offset: 1.5,
            motion: vec![(0.12, 0.17), (0.03, 0.61), (0.006, 1.7)],
            seconds: 12.0,
            step: 4e-6,
            noise: 0.2,
        }
    }

    /// Motion as a log would show it; `seed` draws the noise.
    pub fn motion(&self, seed: u64) -> SmoothedMotion {
        let mut bits = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut uniform = move || {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            (bits >> 11) as f64 / (1u64 << 53) as f64
        };
        // sum of twelve uniforms: normal enough for a test
        let mut normal = move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let wanted = |t: f64| -> (f64, f64) {
            self.motion.iter().fold((0.0, 0.0), |(x, v), (a, f)| {
                let w = std::f64::consts::TAU * f;
                (x + a * (w * t).sin(), v + a * w * (w * t).cos())
            })
        };
        let (mut q, mut v) = (0.0, wanted(0.0).1);
        let mut out = SmoothedMotion::default();
        let (dt, parts) = (1e-3, 100);
        for k in 0..(self.seconds / dt) as usize {
            let t = k as f64 * dt;
            let measured = (q / self.step).round() * self.step;
            let (x, xv) = wanted(t);
            let tau = 9000.0 * (x - measured) + 300.0 * (xv - v);
            let acceleration = |v: f64| (tau - self.law.torque(v) - self.offset) / self.inertia;
            out.t.push(t);
            out.measured.push(measured);
            out.q.push(q);
            out.v.push(v);
            out.a.push(acceleration(v));
            out.tau.push(tau + self.noise * normal());
            for _ in 0..parts {
                v += acceleration(v) * dt / f64::from(parts);
                q += v * dt / f64::from(parts);
            }
        }
        out
    }

    /// The one-joint problem of that motion.
    pub fn prepared(&self, seed: u64) -> PreparedProblem {
        self.prepared_of(self.motion(seed))
    }

    /// That of another motion.
    pub fn prepared_of(&self, motion: SmoothedMotion) -> PreparedProblem {
        let robot = Robot::single_joint("q1", JointKind::Prismatic);
        let variance = self.step * self.step / 12.0;
        let sensors = SensorModel {
            variance: &|_| variance,
            zero_order_hold: true,
        };
        prepare(&robot, 0, &[motion], &sensors).expect("it moves")
    }
}
