//! The CFT robot with theta_1..theta_32, and experiments on it with sound defaults.

use rand::RngExt;

use super::SimulateError;
use super::chance::{ChancePurpose, stream};
use super::effects::{EffectSpec, EffectValue, PlantEffects, RobotSites};
use super::joint_friction::SmoothFriction;
use super::mechanism::Mechanism;
use super::plant::Plant;
use super::reference::{FourierReference, Path, Reference, ReferenceFrame};
use super::run::{MotionStart, MotorInput, run};
use super::settings::Settings;
use super::simulated_run::SimulatedRun;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::cft::actuation::LaboratorySetup;
use cft_ident_core::robot::cft::{PRINTED, ParameterStructure, practice};
use cft_ident_core::robot::friction::DoubleTanh;

/// The true parameters of a simulated CFT robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CftTruth {
    pub setup: LaboratorySetup,
    /// theta_1..theta_12, then the ten base parameters that the printed structure lacks, as `robot::cft::EXTENDED`.
    pub theta: [f64; 22],
    /// Friction of q1, q2, q4, q5 (theta_13..theta_32).
    pub friction: [DoubleTanh; 4],
}

/// Draws that [`CftTruth::varied`] makes before it gives up on a positive definite M.
const DRAWS: usize = 1000;

impl CftTruth {
    /// The synthetic robot that the built-in campaign simulates.
    pub fn synthetic(setup: LaboratorySetup) -> Self {
        let mut theta = [0.0; 22];
        theta[..12].copy_from_slice(&practice::INERTIA);
        Self {
            setup,
            theta,
            friction: DoubleTanh::cft_joints(&practice::FRICTION),
        }
    }

    /// The same robot with each parameter times 1 + U(-spread, spread), drawn anew until M is positive
    /// definite over the workspace.
    ///
    /// # Errors
    /// [`SimulateError::NotPositiveDefinite`] when no draw of a thousand is.
    pub fn varied(&self, spread: f64, seed: u64) -> Result<Self, SimulateError> {
        let mut chance = stream(seed, ChancePurpose::Plant);
        let mut draw = || {
            let mut near = |x: f64| x * (1.0 + spread * chance.random_range(-1.0..=1.0));
            let mut drawn = *self;
            drawn.theta = drawn.theta.map(&mut near);
            for law in &mut drawn.friction {
                *law = DoubleTanh::from_parameters(law.parameters().map(&mut near));
            }
            drawn.check().map(|()| drawn)
        };
        (1..DRAWS).fold(draw(), |found, _| found.or_else(|_| draw()))
    }

    pub fn check(&self) -> Result<(), SimulateError> {
        self.plant()?.check()
    }

    /// The plant: of 12 parameters where the ten others are 0.
    pub fn plant(&self) -> Result<Plant<4>, SimulateError> {
        let printed = self.theta[PRINTED..].iter().all(|x| *x == 0.0);
        let (structure, count) = match printed {
            true => (ParameterStructure::Printed12, PRINTED),
            false => (ParameterStructure::Full22, self.theta.len()),
        };
        let mechanism = Mechanism::new(Robot::cft(self.setup, structure))?;
        let law = |j: usize, _| SmoothFriction::DoubleTanh(self.friction[j]);
        Plant::new(mechanism, &self.theta[..count], law, [0.0; 4])
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

/// The CFT robot on a set-up, with the limits of Table 5.
pub fn mechanism(setup: LaboratorySetup) -> Result<Mechanism<4>, SimulateError> {
    Mechanism::new(Robot::cft(setup, ParameterStructure::Printed12))
}

/// The Table 3 run on the set-up: on dSPACE x_c4 moves about the middle of its own limits.
pub fn excitation(setup: LaboratorySetup) -> Reference<4> {
    excitation_of(FourierReference::of(&practice::of(setup).excitation))
}

/// [`excitation`], begun anywhere in its period.
pub fn excitation_at_random_phase(setup: LaboratorySetup, seed: u64) -> Reference<4> {
    excitation_of(FourierReference::of(&practice::of(setup).excitation).at_random_phase(seed))
}

fn excitation_of(series: FourierReference<4>) -> Reference<4> {
    let (frame, path) = (ReferenceFrame::Motors, Path::Fourier(series));
    Reference { frame, path }
}

/// The effects on a CFT robot.
pub fn effects(
    truth: &CftTruth,
    specs: &[EffectSpec],
) -> Result<(PlantEffects, Vec<EffectValue>), SimulateError> {
    PlantEffects::build(specs, &RobotSites::of(&truth.plant()?)?)
}

/// Runs a reference with the default gains, from the settled start.
pub fn follow(
    truth: &CftTruth,
    specs: &[EffectSpec],
    reference: Reference<4>,
    settings: &Settings<4>,
) -> Result<SimulatedRun<4>, SimulateError> {
    let plant = truth.plant()?;
    plant.check()?;
    let (effects, _) = PlantEffects::build(specs, &RobotSites::of(&plant)?)?;
    let control = plant.control();
    let drive = MotorInput::Follow { reference, control };
    run(&plant, effects, &MotionStart::Settled, &drive, settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn synthetic_robots_are_physical_and_varied_ones_stay_within_the_spread() {
        for setup in [LaboratorySetup::Tuedacs, LaboratorySetup::Dspace] {
            let nominal = CftTruth::synthetic(setup);
            nominal.check().expect("positive definite");
            for seed in 0..20 {
                let varied = nominal.varied(0.15, seed).expect("a draw is physical");
                assert_eq!(varied, nominal.varied(0.15, seed).expect("repeats"));
                let all = |truth: &CftTruth| [&truth.theta[..], &truth.friction_theta()].concat();
                for (a, b) in all(&nominal).iter().zip(all(&varied)) {
                    assert!((b - a).abs() <= 0.15 * a.abs() + 1e-15);
                }
            }
        }
    }

    #[test]
    fn impossible_inertia_is_refused_with_the_pose() {
        let mut truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
        truth.theta[11] = -5.0;
        let refused = truth.check();
        assert!(matches!(
            refused,
            Err(SimulateError::NotPositiveDefinite { .. })
        ));
        truth.theta[11] = f64::NAN;
        assert!(truth.check().is_err());
    }

    #[test]
    fn cft_parameters_carry_the_numbers_of_the_report() {
        let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
        assert_eq!(truth.friction_theta(), practice::FRICTION);
        assert_eq!(truth.printed(), practice::INERTIA);
        let parameters = truth.plant().expect("a pose").parameters();
        assert_eq!(parameters.len(), 32);
        let mut numbers: Vec<u32> = parameters.iter().filter_map(|p| p.theta).collect();
        numbers.sort_unstable();
        assert_eq!(numbers, (1..=32).collect::<Vec<_>>());
        let friction = truth.friction_theta();
        for p in &parameters {
            let number = p.theta.expect("every parameter has a number") as usize;
            let all = [&truth.printed()[..], &friction].concat();
            assert_eq!(p.value, all[number - 1], "theta_{number}");
        }
        let mut full = truth;
        full.theta[17] = 0.1;
        assert_eq!(full.plant().expect("a pose").parameters().len(), 42);
    }
}
