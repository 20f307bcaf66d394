//! A plant to test against: volts in, motor coordinates, status and logs out (the report's section 5).
//!
//! | file | what |
//! |---|---|
//! | [`mechanism`], [`joint_friction`] | joints, motors, encoders, limits; friction without a jump |
//! | [`plant`], [`moving`] | tau = M a + C v + G + F(v) + effects, volts to torques |
//! | [`cft`], [`single_joint`] | plants of the report's robot and of one joint, from their numbers |
//! | [`effects`] | what a declared model may lack |
//! | [`integrate`] | Dormand-Prince 5(4) with error control |
//! | [`experiment`], [`one_joint`] | what the robot is asked to do |
//! | [`reference`] | Fourier series (43), one-joint ladder, point list |
//! | [`controller`] | Cartesian P or PD controller with zero-order hold |
//! | [`sensors`] | encoders, sampling, noise, all from one seed |
//! | [`temperature`] | how warm the drives are |
//! | [`run`](mod@run) | the experiment, with limits and saturation |
//! | [`simulated_run`] | the log, and beside it what was true |
//! | [`order`], [`truth`] | the same from files, and to files |
//!
//! No estimator may see what is true: it goes to a file of its own.

pub mod cft;
pub mod chance;
pub mod controller;
pub mod effects;
mod error;
pub mod experiment;
pub mod held;
pub mod integrate;
pub mod joint_friction;
mod log_layout;
pub mod mechanism;
pub mod moving;
pub mod one_joint;
pub mod order;
pub mod plant;
mod recorder;
pub mod reference;
pub mod run;
pub mod sensors;
pub mod servo;
pub mod settings;
mod settings_file;
pub mod simulated_run;
pub mod single_joint;
pub mod temperature;
pub mod truth;
pub mod volts;
pub mod wrist;

pub use cft::CftTruth;
pub use controller::ControllerSettings;
pub use effects::{EffectSpec, PlantEffects};
pub use error::SimulateError;
pub use experiment::Experiment;
pub use joint_friction::SmoothFriction;
pub use mechanism::Mechanism;
pub use one_joint::{MovedAxis, OneJointMove};
pub use order::{
    InitialConditions, Order, Rows, SimulatedLog, SimulationSummary, simulate, simulate_from,
    simulate_rows,
};
pub use plant::Plant;
pub use reference::{Path, Reference, ReferenceFrame};
pub use run::{MotionStart, MotorInput, run};
pub use sensors::{Noise, PlantSensors};
pub use settings::Settings;
pub use simulated_run::{LimitEvent, MotorStatus, RunEnding, SimulatedRun};
pub use single_joint::SingleJointTruth;
pub use temperature::PlantTemperatures;
pub use truth::TruthFile;
pub use volts::VoltSeries;
