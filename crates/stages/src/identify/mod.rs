//! The stages of an identification as functions of a dataset and a request.
//!
//! A [`Dataset`] is a robot as its file describes it ([`LoggedRobot`]) with its logs by what they are for; a [`Log`] is a
//! file, arrays in memory or a reduced log. Of a file the rows are parsed once and serve every stage. A [`GivenModel`] is
//! a model file, a [`Control`] the callbacks for progress and cancellation. Each stage returns its result as plain data,
//! with warnings as sentences; it writes nothing. `validate`, `torque` and `watch` hand over single rows as they come.
//!
//! | stage | from | to |
//! |---|---|---|
//! | [`check_setup()`] | logs | [`CheckedSetup`]: mistakes of the robot file that the torques show |
//! | [`friction()`] | one-joint logs | [`IdentifiedFriction`]: theta 13..32 with covariance |
//! | [`fit_gains()`] | logs of currents, one with a known payload | [`FittedGains`]: torque per ampere of each joint |
//! | [`lsq()`] | logs of all joints, friction | [`IdentifiedDynamics`]: theta 1..12, or base parameters |
//! | [`diagnose()`] | a model, logs | [`Diagnosed`]: effects that the model lacks, the refined model |
//! | [`reduce()`] | logs | [`ReducedLogs`]: what a linear fit needs of each, for a small file |
//! | [`validate()`] | logs that were not used, a model | [`Validated`]: torque errors |
//! | [`payload()`] | logs with a load, a model without it | [`Payload`]: mass, centre and inertia of the load |
//! | [`track()`] | reduced logs or models in order of time | [`Tracked`]: courses of parameters, changes, robots that differ |
//! | [`compare()`] | two models, logs | [`Compared`]: differences of parameters and of errors |
//! | [`torque()`] | positions, a model | [`FeedForward`]: torques with their band |
//! | [`watch()`] | rows as they come, a model | [`Watched`]: external torques, alarms |
//! | [`identify()`] | logs by what they are for | [`Campaigned`]: all of it, one after the other |

mod by_motion;
mod campaign;
mod compare;
mod consistent;
mod contact;
mod control;
mod curve;
mod dataset;
mod diagnose;
mod diagnosis;
mod dynamics;
mod error;
mod error_kind;
mod estimate;
mod first_look;
mod formulas;
mod free_swing;
mod friction;
mod gain_error;
mod gains;
mod geometry;
mod held_torque;
mod hold_out;
mod in_memory;
mod in_use;
mod known_friction;
mod log;
mod logged_robot;
mod lsq;
mod lsq_warnings;
mod model;
mod motion_fit;
mod next_motion;
mod of_robot;
mod one_joint;
mod one_log;
mod open_log;
mod open_loop;
mod own_fit;
mod own_settings;
mod passes;
mod payload;
mod payload_result;
mod position_cutoff;
mod prior;
mod reduce;
mod reduced;
mod reference;
mod refined_model;
mod repeated;
mod residual;
mod setup;
mod setup_file;
mod setup_words;
mod speeds;
mod temperatures;
mod torque;
mod track;
mod track_error;
mod track_source;
mod unknown_key;
mod unknowns;
mod validate;
mod watch;
mod weakest;

pub use campaign::{Campaigned, IdentifySettings, StageEnd, identify};
pub use compare::{Compared, ComparisonResult, Curves, DIFFERENT, Side, TriedOnLogs, compare};
pub use consistent::{ConsistentLink, ConsistentLinks, DriveInertia, LinkPrior, project};
pub use control::{Control, Progress};
pub use curve::friction_curve;
pub use dataset::{Dataset, GivenModel};
pub use diagnose::{DataFault, DiagnoseEnd, DiagnoseSettings, Diagnosed, diagnose};
pub use diagnosis::{DiagnosisResult, DiagnosisVerdict, accept_option, signal_words};
pub use dynamics::{EssentialFit, IdentifiedDynamics};
pub use error::{IdentifyError, ReadError};
pub use error_kind::ErrorKind;
pub use estimate::{Account, JointAccount};
pub use formulas::{FormulaResult, formula_result, formula_section, numbers_of};
pub use friction::{
    FrictionOfJoint, FrictionSettings, IdentifiedFriction, LawParameter, LawParameters, friction,
};
pub use gain_error::GainError;
pub use gains::{CurrentGains, FittedGains, Gain, PayloadLog, fit_gains};
pub use hold_out::Held;
pub use in_memory::{InMemory, read_whole};
pub use in_use::{BANDWIDTH_HZ, JointInUse, in_use, levers};
pub use known_friction::{FrictionOfFit, FrictionParameter};
pub use log::Log;
pub use logged_robot::{LoggedRobot, narrowed};
pub use lsq::{LsqSettings, lsq};
pub use model::{new_model, refined, refined_or_friction};
pub use motion_fit::MotionFit;
pub use next_motion::{narrowing_command, separating_command};
pub use open_log::OpenLog;
pub use passes::SimulatedLoop;
pub use payload::payload;
pub use payload_result::{GainOff, LeftOfJoint, Number95, Payload, PayloadReading, PayloadVerdict};
pub use position_cutoff::PositionCutoff;
pub use reduce::reduce;
pub use reduced::{
    FORMAT, FrictionGiven, MadeWith, ReducedError, ReducedLog, ReducedLogs, is_reduced,
};
pub use repeated::repeated_rows;
pub use residual::{JointResidual, RelativeError};
pub use setup::{CheckedSetup, check_setup};
pub use torque::{FeedForward, JointAlong, TorqueAlong, torque};
pub use track::{
    FleetDifference, RobotSources, Tracked, TrackedChange, TrackedParameter, TrackedRobot, track,
};
pub use track_error::TrackError;
pub use track_source::TrackSource;
pub use unknowns::FittedUnknown;
pub use validate::{
    ErrorsByUse, ErrorsOfLogs, ValidateSettings, Validated, not_a_validation, used_for, validate,
};
pub use watch::{
    STREAM, WatchLine, WatchSettings, Watchable, Watched, WatchedJoint, watch, watch_recipe,
};
pub use weakest::WeakestPart;
