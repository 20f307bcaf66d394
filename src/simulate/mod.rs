//! A plant to test against: volts in, motor coordinates, status and logs out (the report's section 5).
//!
//! | file | what |
//! |---|---|
//! | [`plant`], [`cft`], [`single_joint`] | tau = M a + C v + G + F(v) + effects, volts to torques |
//! | [`effects`] | what a declared model may lack |
//! | [`integrate`] | Dormand-Prince 5(4) with error control |
//! | [`reference`] | Fourier series (43), one-joint ladder, point list |
//! | [`controller`] | Cartesian P or PD controller, held volts |
//! | [`sensors`] | encoders, sampling, noise, all from one seed |
//! | [`run`](mod@run) | the experiment, with limits and saturation |
//! | [`recording`] | the log, and beside it what was true |
//! | [`order`], [`truth`] | the same from files, and to files |
//!
//! No estimator may see what is true: it goes to a file of its own.

pub mod cft;
pub mod cft_experiment;
pub mod chance;
pub mod controller;
pub mod effects;
mod error;
pub(crate) mod from_files;
pub mod integrate;
pub mod order;
pub mod plant;
pub mod recording;
pub mod reference;
pub mod run;
pub mod sensors;
pub mod serial;
mod serial_experiment;
pub mod settings;
pub mod single_joint;
pub mod truth;
pub mod volts;

pub use cft::{CftPlant, CftTruth};
pub use controller::Control;
pub use effects::{EffectSpec, Effects};
pub use error::SimulateError;
pub use order::{InitialConditions, Motion, Order, SimulatedLog, simulate, simulate_from};
pub use recording::{Ending, LimitEvent, Recording, Status};
pub use reference::{Frame, Path, Reference};
pub use run::{Drive, Start, run};
pub use sensors::{Noise, Sensors};
pub use settings::{OnLimit, Settings};
pub use single_joint::SingleJointTruth;
pub use truth::TruthFile;
pub use volts::VoltSeries;
