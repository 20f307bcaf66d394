//! The stages of an identification as functions of a dataset and a request.
//!
//! A [`Dataset`] is a robot as its file describes it ([`RobotSetup`]) with its logs by what they are for; a [`Log`] is a
//! file, arrays in memory or a reduced log. Of a file the rows are parsed once and serve every stage. A [`GivenModel`] is
//! a model file, a [`Control`] the callbacks for progress and cancellation. Each stage returns its result as plain data,
//! with what it noticed as [`StageNote`]s; it writes nothing. `validate`, `torque` and `watch` hand over single rows as they come.
//!
//! | stage | from | to |
//! |---|---|---|
//! | [`check_setup()`] | logs | [`CheckedSetup`]: mistakes of the robot file that the torques show |
//! | [`accepted_setup()`] | logs | [`AcceptedSetup`]: what a fit goes on with, or a [`SetupRefusal`] |
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

pub use crate::campaign::{Campaigned, IdentifySettings, StageEnd, identify};
pub use crate::find::accepted_setup::{
    AcceptedSetup, ContradictedSetup, SetupRefusal, accepted_setup,
};
pub use crate::find::check_setup::{CheckedSetup, check_setup, check_setup_where_possible};
pub use crate::find::diagnose::{DataFault, DiagnoseEnd, DiagnoseSettings, Diagnosed, diagnose};
pub use crate::find::diagnosis::{DiagnosisResult, DiagnosisVerdict, accept_option, signal_words};
pub use crate::find::formulas::{FormulaResult, formula_result, formula_section, numbers_of};
pub use crate::find::next_motion::{narrowing_command, separating_command};
pub use crate::fit::consistent::{
    ConsistentLink, ConsistentLinks, DriveInertia, LinkPrior, project,
};
pub use crate::fit::dynamics::{EssentialFit, IdentifiedDynamics};
pub use crate::fit::estimate::{EstimatorAccount, JointAccount};
pub use crate::fit::friction::{
    FrictionOfJoint, FrictionSettings, IdentifiedFriction, LawParameter, LawParameters, friction,
};
pub use crate::fit::gains::{CurrentGains, FittedGains, Gain, PayloadLog, fit_gains};
pub use crate::fit::instrumental::SimulatedLoop;
pub use crate::fit::known_friction::{FrictionOfFit, FrictionParameter};
pub use crate::fit::lsq::lsq;
pub use crate::fit::lsq_problem::LsqSettings;
pub use crate::fit::motion_fit::MotionFit;
pub use crate::fit::payload::payload;
pub use crate::fit::payload_result::{
    CarriedSpan, GainOff, IntervalNumber, LeftOfJoint, Payload, PayloadReading, PayloadVerdict,
    TouchedSpan,
};
pub use crate::fit::weakest::WeakestPart;
pub use crate::fleet::reduce::reduce;
pub use crate::fleet::track::{
    FleetDifference, RobotSources, Tracked, TrackedChange, TrackedParameter, TrackedRobot, track,
};
pub use crate::fleet::track_source::TrackSource;
pub use crate::held_out::compare::{
    Compared, ComparedFile, ComparisonResult, DIFFERENT, FrictionCurves, TriedOnLogs, compare,
};
pub use crate::held_out::hold_out::Held;
pub use crate::held_out::residual::{ErrorOfLog, JointResidual, RelativeError};
pub use crate::held_out::torque::{FeedForward, JointAlong, TorqueAlong, torque};
pub use crate::held_out::validate::{
    ErrorsByUse, ErrorsOfLogs, ValidateSettings, Validated, not_a_validation, validate,
};
pub use crate::input::control::{Control, Progress};
pub use crate::input::curve::friction_curve;
pub use crate::input::dataset::{Dataset, GivenModel};
pub use crate::input::error::IdentifyError;
pub use crate::input::error_kind::ErrorKind;
pub use crate::input::filtered_motion::FilteredMotion;
pub use crate::input::gain_error::GainError;
pub use crate::input::in_memory::{InMemory, read_whole};
pub use crate::input::in_use::{BANDWIDTH_HZ, FALSE_ALARMS_PER_HOUR, JointInUse, in_use, levers};
pub use crate::input::log::Log;
pub use crate::input::log_data::LogData;
pub use crate::input::model::{new_model, refined, refined_or_friction};
pub use crate::input::position_cutoff::PositionCutoff;
pub use crate::input::reduced::{
    FORMAT, FrictionGiven, MadeWith, ReducedError, ReducedLog, ReducedLogs, is_reduced,
};
pub use crate::input::repeated::{each_log_once, repeated_files, used_for};
pub use crate::input::robot_setup::{RobotSetup, narrowed};
pub use crate::input::track_error::TrackError;
pub use crate::input::unknowns::FittedUnknown;
pub use crate::note::{
    FitNote, FrictionNote, LogNote, ModelNote, NumberWithStd, RowLoss, SetupNote, StageNote,
    TrackNote,
};
pub use crate::watch::{
    RowSource, STREAM, WatchLine, WatchSettings, Watched, WatchedJoint, watch, watch_recipe,
};
