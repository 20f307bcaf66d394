//! A tool on a wrist sensor: wrenches of poses that are held, as a log has them.
//!
//! Weight and moment by hand, by the cosines of a roll and a pitch; nothing of the estimator.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What hangs on the sensor, and what else the sensor shows.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedTool {
    /// \[kg\]
    pub mass: f64,
    /// Centre of gravity along the sensor's axes \[m\].
    pub centre: [f64; 3],
    /// Force \[N\] and moment \[Nm\] without a load.
    pub bias: [f64; 6],
    /// What the force's bias grows by from the first pose to the last \[N\].
    pub drift: [f64; 3],
    /// Deviation of the noise of a pose's mean: force \[N\], moment \[Nm\].
    pub noise: [f64; 2],
    pub poses: usize,
}

impl SimulatedTool {
    /// The tool of the example.
    pub fn example() -> Self {
        Self {
            mass: 0.85,
            centre: [0.012, -0.004, 0.061],
            bias: [2.1, -1.4, 5.2, 0.05, -0.03, 0.01],
            drift: [0.9, -0.5, 1.2],
            noise: [0.03, 0.001],
            poses: 60,
        }
    }

    /// Free fall \[m/s^2\].
    const GRAVITY: f64 = 9.81;

    /// The log: roll and pitch of the sensor drawn in turn over their ranges, wrenches along its axes.
    pub fn log(&self, seed: u64) -> String {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut out =
            String::from("pose,qx,qy,qz,qw,fx [N],fy [N],fz [N],tx [Nm],ty [Nm],tz [Nm]\n");
        for k in 0..self.poses {
            let mut angle = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
            let (roll, pitch, yaw) = (angle(2.6), angle(1.3), angle(3.0));
            let [(sr, cr), (sp, cp), (sy, cy)] =
                [roll, pitch, yaw].map(|a: f64| (a / 2.0).sin_cos());
            // quaternion of roll, pitch, yaw about fixed axes
            let q = [
                sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy,
                cr * cp * sy - sr * sp * cy,
                cr * cp * cy + sr * sp * sy,
            ];
            // down, as the sensor sees it
            let weight = self.mass * Self::GRAVITY;
            let f = [
                weight * pitch.sin(),
                -weight * roll.sin() * pitch.cos(),
                -weight * roll.cos() * pitch.cos(),
            ];
            let [x, y, z] = self.centre;
            let t = [
                y * f[2] - z * f[1],
                z * f[0] - x * f[2],
                x * f[1] - y * f[0],
            ];
            let part = k as f64 / (self.poses.max(2) - 1) as f64;
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let force: Vec<f64> = (0..3)
                .map(|i| f[i] + self.bias[i] + part * self.drift[i] + self.noise[0] * normal())
                .collect();
            let moment: Vec<f64> = (0..3)
                .map(|i| t[i] + self.bias[3 + i] + self.noise[1] * normal())
                .collect();
            let numbers = q.iter().chain(&force).chain(&moment);
            let row: Vec<String> = numbers.map(|x| format!("{x:.6}")).collect();
            out += &format!("{k},{}\n", row.join(","));
        }
        out
    }
}
