//! A small arm that holds poses, as a log of its servos has them: sizes of currents without a sign, in steps, and
//! friction at rest that keeps each joint on the side from which it came.
//!
//! Two links in a plane, by hand: torques of their weights at their levers.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A planar arm of two links with servos.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedHolds {
    /// Mass times distance of the centre from the joint, of each link \[kg m\]; the first with all of the second at its end.
    pub moments: [f64; 2],
    /// Friction at rest \[Nm\].
    pub stiction: [f64; 2],
    /// Stiffness of the controllers \[Nm/rad\].
    pub stiffness: [f64; 2],
    /// Steps of the torque's size \[Nm\].
    pub step: f64,
    pub poses: usize,
}

impl SimulatedHolds {
    /// The arm of the example.
    pub fn example() -> Self {
        Self {
            moments: [0.16, 0.055],
            stiction: [0.10, 0.06],
            stiffness: [9.0, 7.0],
            step: 0.023,
            poses: 30,
        }
    }

    /// The robot file.
    pub const ROBOT: &'static str = "\
# A planar arm of two links; its servos log the size of the current alone.
[robot]
model = \"serial\"
drive_inertia = false

[[robot.link]]
name = \"upper\"
joint = \"shoulder\"
rpy = [1.5707963267948966, 0.0, 0.0]

[[robot.link]]
name = \"fore\"
joint = \"elbow\"
xyz = [0.12, 0.0, 0.0]

[friction]
law = \"viscous-coulomb\"
fitted_with_inertias = true

[log]
torque_is = \"joint\"
sign = \"hang\"

[log.joint]
shoulder = { position = \"q_shoulder\", torque = \"load_shoulder\", reference = \"command_shoulder\" }
elbow = { position = \"q_elbow\", torque = \"load_elbow\", reference = \"command_elbow\" }

[limits]
shoulder = { position = [-1.6, 1.6] }
elbow = { position = [-2.4, 2.4] }
";

    /// Torques that hold the links at these angles \[Nm\]: up is against the weights.
    fn weights(&self, q: [f64; 2]) -> [f64; 2] {
        let elbow = self.moments[1] * 9.81 * (q[0] + q[1]).cos();
        [self.moments[0] * 9.81 * q[0].cos() + elbow, elbow]
    }

    /// The log: each pose from below and from above, at 50 Hz.
    pub fn log(&self, seed: u64) -> String {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut out = String::from(
            "t,q_shoulder,q_elbow,command_shoulder,command_elbow,load_shoulder,load_elbow\n",
        );
        let mut row = 0;
        let mut line = |q: [f64; 2], command: [f64; 2], tau: [f64; 2]| {
            let size = tau.map(|x| self.step * (x.abs() / self.step).round());
            out += &format!(
                "{:.2},{:.5},{:.5},{:.5},{:.5},{:.3},{:.3}\n",
                0.02 * row as f64,
                q[0],
                q[1],
                command[0],
                command[1],
                size[0],
                size[1]
            );
            row += 1;
        };
        let mut from = [0.0, 0.0];
        for _ in 0..self.poses {
            let goal = [
                1.4 * (2.0 * random.random::<f64>() - 1.0),
                2.2 * (2.0 * random.random::<f64>() - 1.0),
            ];
            for side in [1.0, -1.0] {
                let begin = goal.map(|q| q - 0.12 * side);
                for (a, b) in [(from, begin), (begin, goal)] {
                    for k in 0..20 {
                        let part = f64::from(k) / 20.0;
                        let q = [0, 1].map(|j| a[j] + part * (b[j] - a[j]));
                        let moving = [0, 1].map(|j| (b[j] - a[j]).signum());
                        let tau = self.torques(q, moving);
                        let command = [0, 1].map(|j| q[j] + tau[j] / self.stiffness[j]);
                        line(q, command, tau);
                    }
                }
                // friction at rest stays about as the way there left it
                let left = 0.9 + 0.1 * random.random::<f64>();
                let tau = self.torques(goal, [side * left; 2]);
                let command = [0, 1].map(|j| goal[j] + tau[j] / self.stiffness[j]);
                (0..50).for_each(|_| line(goal, command, tau));
                from = goal;
            }
        }
        out
    }

    fn torques(&self, q: [f64; 2], friction: [f64; 2]) -> [f64; 2] {
        let weights = self.weights(q);
        [0, 1].map(|j| weights[j] + friction[j] * self.stiction[j])
    }
}
