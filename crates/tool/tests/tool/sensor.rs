//! A sensor with a tool, simulated by hand: roll, pitch and yaw, no code of the estimator.

use cft_ident_tool::tool::{WrenchLog, WrenchSample};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A tool, its sensor, and what else is wrong with it.
#[derive(Debug, Clone)]
pub struct Sensor {
    pub mass: f64,
    pub centre: [f64; 3],
    pub bias: [f64; 6],
    pub noise: [f64; 2],
    pub poses: usize,
    /// Force by which the bias has grown at the end, along a parabola.
    pub drift: [f64; 3],
    /// Gravity along these axes of the base, per unit.
    pub down: [f64; 3],
    /// Turn of the sensor about the z axis of the flange \[rad\].
    pub turned: f64,
    /// Gains of the force channels.
    pub gains: [f64; 3],
    /// Force along the base's axes per metre of place \[N/m\].
    pub cable: [f64; 3],
    /// Change of the force's bias from the middle on \[N\].
    pub tared: [f64; 3],
    pub in_base: bool,
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            mass: 1.2,
            centre: [0.01, -0.02, 0.06],
            bias: [1.0, -2.0, 3.0, 0.1, -0.05, 0.02],
            noise: [0.05, 0.002],
            poses: 100,
            drift: [0.0; 3],
            down: [0.0, 0.0, -1.0],
            turned: 0.0,
            gains: [1.0; 3],
            cable: [0.0; 3],
            tared: [0.0; 3],
            in_base: false,
        }
    }
}

type Matrix = [[f64; 3]; 3];

fn times(a: &Matrix, x: [f64; 3]) -> [f64; 3] {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

fn back(a: &Matrix, x: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|j| a[0][j] * x[0] + a[1][j] * x[1] + a[2][j] * x[2])
}

impl Sensor {
    pub fn log(&self, seed: u64) -> WrenchLog {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let samples = (0..self.poses)
            .map(|k| self.sample(k, &mut random))
            .collect();
        WrenchLog {
            samples,
            unit_is_stated: true,
            ..WrenchLog::default()
        }
    }

    fn sample(&self, k: usize, random: &mut ChaCha8Rng) -> WrenchSample {
        let mut within = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
        let (roll, pitch, yaw) = (within(3.0), within(1.4), within(3.0));
        let place = [within(0.4), within(0.4), within(0.4)];
        let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(f64::sin_cos);
        // flange in the base
        let r = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        let [hr, hp, hy] = [roll, pitch, yaw].map(|a| (a / 2.0).sin_cos());
        let quaternion = [
            hr.0 * hp.1 * hy.1 - hr.1 * hp.0 * hy.0,
            hr.1 * hp.0 * hy.1 + hr.0 * hp.1 * hy.0,
            hr.1 * hp.1 * hy.0 - hr.0 * hp.0 * hy.1,
            hr.1 * hp.1 * hy.1 + hr.0 * hp.0 * hy.0,
        ];
        let weight = self.down.map(|x| 9.81 * self.mass * x);
        // sensor in the flange, about z
        let (s, c) = self.turned.sin_cos();
        let own = |x: [f64; 3]| [c * x[0] + s * x[1], -s * x[0] + c * x[1], x[2]];
        let f = own(back(&r, weight));
        let cable = own(back(&r, [0, 1, 2].map(|i| self.cable[i] * place[i])));
        let [x, y, z] = self.centre;
        let t = [
            y * f[2] - z * f[1],
            z * f[0] - x * f[2],
            x * f[1] - y * f[0],
        ];
        let part = k as f64 / (self.poses - 1) as f64;
        let late = f64::from(u8::from(2 * k >= self.poses));
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let mut force = [0, 1, 2].map(|i| {
            self.gains[i] * f[i]
                + cable[i]
                + self.bias[i]
                + part * part * self.drift[i]
                + late * self.tared[i]
                + self.noise[0] * normal()
        });
        let mut moment = [0, 1, 2].map(|i| t[i] + self.bias[3 + i] + self.noise[1] * normal());
        if self.in_base {
            (force, moment) = (times(&r, force), times(&r, moment));
        }
        WrenchSample {
            t: k as f64,
            quaternion,
            position: Some(place),
            force,
            moment,
        }
    }
}
