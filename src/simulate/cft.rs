//! The CFT robot as a plant: theta_1..theta_32, volts through Table 6, encoders of Table 5.

use rand::RngExt;

use super::SimulateError;
use super::chance::{Purpose, stream};
use super::plant::Plant;
use crate::robot::cft::actuation::{ENCODER_SCALE, Limits, Setup};
use crate::robot::cft::dynamics::{Coefficients, inertia, inertia_and_bias, solve_positive};
use crate::robot::cft::{COORDINATES, JOINTS, pantograph};
use crate::robot::friction::DoubleTanh;

/// The true parameters of a simulated CFT robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CftTruth {
    pub setup: Setup,
    /// theta_1..theta_12, then the ten base parameters that the printed structure lacks (zero where
    /// the robot is as the report models it), in the order of `robot::cft::EXTENDED`.
    pub theta: [f64; 22],
    /// Friction of q1, q2, q4, q5 (theta_13..theta_32).
    pub friction: [DoubleTanh; 4],
}

/// theta_1..theta_12: the three values of Table 4 that survive, and synthetic ones that make M
/// positive definite over the workspace.
const SYNTHETIC_INERTIA: [f64; 12] = [
    121.3049, 0.3107, 4.1955, 0.95, -0.07, 0.0012, 0.08, 0.0128, -0.94, -0.02, 4.67, 2.83,
];

/// theta_13..theta_32, synthetic: Bv, Bf1, Bf2, w1, w2, each for q1, q2, q4, q5.
const SYNTHETIC_FRICTION: [f64; 20] = [
    120.0, 9.0, 5.0, 4.0, 55.0, 9.0, 7.0, 5.0, -20.0, -3.0, -2.5, -1.8, 200.0, 60.0, 60.0, 60.0,
    20.0, 6.0, 6.0, 6.0,
];

/// Draws that [`CftTruth::varied`] makes before it gives up on a positive definite M.
const DRAWS: usize = 1000;

impl CftTruth {
    /// The synthetic robot that the built-in campaign simulates.
    pub fn synthetic(setup: Setup) -> Self {
        let mut theta = [0.0; 22];
        theta[..12].copy_from_slice(&SYNTHETIC_INERTIA);
        Self {
            setup,
            theta,
            friction: DoubleTanh::cft_joints(&SYNTHETIC_FRICTION),
        }
    }

    /// The same robot with each parameter times 1 + U(-spread, spread), drawn anew until M is positive
    /// definite over the workspace.
    ///
    /// # Errors
    /// [`SimulateError::NotPositiveDefinite`] when no draw of a thousand is.
    pub fn varied(&self, spread: f64, seed: u64) -> Result<Self, SimulateError> {
        let mut chance = stream(seed, Purpose::Plant);
        let mut outcome = Ok(*self);
        for _ in 0..DRAWS {
            let mut near = |x: f64| x * (1.0 + spread * chance.random_range(-1.0..=1.0));
            let mut drawn = *self;
            for value in &mut drawn.theta {
                *value = near(*value);
            }
            for law in &mut drawn.friction {
                *law = DoubleTanh::from_parameters(law.parameters().map(&mut near));
            }
            outcome = drawn.check().map(|()| drawn);
            if outcome.is_ok() {
                break;
            }
        }
        outcome
    }

    /// # Errors
    /// [`SimulateError::NotPositiveDefinite`] when M is not positive definite on a grid over the
    /// limits of this set-up (or a parameter is not finite).
    pub fn check(&self) -> Result<(), SimulateError> {
        const STEPS: usize = 12;
        let limits = self.setup.limits();
        let coefficients = Coefficients::from_theta22(&self.theta);
        let share =
            |k: usize, i: usize| limits.lower[i] + limits.spans()[i] * k as f64 / STEPS as f64;
        let laws = self.friction.iter().flat_map(DoubleTanh::parameters);
        let finite = laws.chain(self.theta).all(f64::is_finite);
        for (i, j, k) in (0..=STEPS)
            .flat_map(|i| (0..=STEPS).flat_map(move |j| (0..=STEPS).map(move |k| (i, j, k))))
        {
            let x = [share(i, 0), share(j, 1), share(k, 2), share(0, 3)];
            let q = pantograph::joints(&x)?;
            if !finite || solve_positive(&inertia(&q, &coefficients), &[0.0; 4]).is_none() {
                return Err(SimulateError::NotPositiveDefinite { x: x.to_vec() });
            }
        }
        Ok(())
    }

    /// theta_1..theta_12.
    pub fn printed(&self) -> [f64; 12] {
        std::array::from_fn(|i| self.theta[i])
    }

    /// theta_13..theta_32 in the report's order.
    pub fn friction_theta(&self) -> [f64; 20] {
        std::array::from_fn(|i| self.friction[i % 4].parameters()[i / 4])
    }
}

/// The plant of a [`CftTruth`].
#[derive(Debug, Clone)]
pub struct CftPlant {
    setup: Setup,
    limits: Limits,
    coefficients: Coefficients,
    friction: [DoubleTanh; 4],
}

impl CftPlant {
    /// Plant with the true parameters.
    pub fn new(truth: &CftTruth) -> Self {
        Self {
            setup: truth.setup,
            limits: truth.setup.limits(),
            coefficients: Coefficients::from_theta22(&truth.theta),
            friction: truth.friction,
        }
    }

    /// The same plant with other limits of x_c1..x_c4 than its set-up has.
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }
}

impl Plant<4> for CftPlant {
    fn joint_names(&self) -> [String; 4] {
        JOINTS.map(str::to_owned)
    }

    fn coordinate_names(&self) -> [String; 4] {
        COORDINATES.map(str::to_owned)
    }

    fn coordinates(&self, q: &[f64; 4]) -> [f64; 4] {
        pantograph::cartesian(q)
    }

    fn coordinate_speeds(&self, q: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
        pantograph::cartesian_velocities(q, v)
    }

    fn joints(&self, x: &[f64; 4]) -> Result<[f64; 4], SimulateError> {
        Ok(pantograph::joints(x)?)
    }

    fn joint_speeds(&self, q: &[f64; 4], xd: &[f64; 4]) -> Result<[f64; 4], SimulateError> {
        Ok(pantograph::joint_velocities(q, xd)?)
    }

    #[inline]
    fn torque(&self, q: &[f64; 4], volts: &[f64; 4]) -> [f64; 4] {
        self.setup.volts_to_torques(q, volts)
    }

    fn volts(&self, q: &[f64; 4], torque: &[f64; 4]) -> Result<[f64; 4], SimulateError> {
        Ok(self.setup.torques_to_volts(q, torque)?)
    }

    #[inline]
    fn rigid(&self, q: &[f64; 4], v: &[f64; 4]) -> ([[f64; 4]; 4], [f64; 4]) {
        inertia_and_bias(q, v, &self.coefficients)
    }

    #[inline]
    fn friction(&self, v: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|i| self.friction[i].torque(v[i]))
    }

    #[inline]
    fn solve(&self, mass: &[[f64; 4]; 4], b: &[f64; 4]) -> Option<[f64; 4]> {
        solve_positive(mass, b)
    }

    fn limits(&self) -> ([f64; 4], [f64; 4]) {
        (self.limits.lower, self.limits.upper)
    }

    fn resolution(&self) -> [f64; 4] {
        ENCODER_SCALE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn synthetic_robots_are_physical_and_varied_ones_stay_within_the_spread() {
        for setup in [Setup::Tuedacs, Setup::Dspace] {
            let nominal = CftTruth::synthetic(setup);
            nominal.check().expect("positive definite");
            for seed in 0..20 {
                let varied = nominal.varied(0.15, seed).expect("a draw is physical");
                assert_eq!(varied, nominal.varied(0.15, seed).expect("repeats"));
                let pairs = nominal.theta.iter().zip(&varied.theta);
                let laws = nominal
                    .friction_theta()
                    .into_iter()
                    .zip(varied.friction_theta());
                for (a, b) in pairs.map(|(a, b)| (*a, *b)).chain(laws) {
                    assert!((b - a).abs() <= 0.15 * a.abs() + 1e-15);
                }
            }
        }
    }

    #[test]
    fn impossible_inertia_is_refused_with_the_pose() {
        let mut truth = CftTruth::synthetic(Setup::Tuedacs);
        truth.theta[11] = -5.0;
        assert!(matches!(
            truth.check(),
            Err(SimulateError::NotPositiveDefinite { .. })
        ));
        truth.theta[11] = f64::NAN;
        assert!(truth.check().is_err());
    }

    #[test]
    fn friction_parameters_come_back_in_the_order_of_the_report() {
        let truth = CftTruth::synthetic(Setup::Tuedacs);
        assert_eq!(truth.friction_theta(), SYNTHETIC_FRICTION);
        assert_eq!(truth.printed(), SYNTHETIC_INERTIA);
    }
}
