//! Why a stage ends without a result.

use super::error_kind::ErrorKind;
use super::gain_error::GainError;
use super::reduced::error::ReducedError;
use super::track_error::TrackError;
use crate::open_loop::AxisError;
use cft_ident_core::diagnose::DiagnoseError;
use cft_ident_core::effect::EffectError;
use cft_ident_core::effect::formula::FormulaError;
use cft_ident_core::explain::{ErrorText, Explain};
use cft_ident_core::friction::excitation::FrictionError;
use cft_ident_core::inertia::solution::FitError;
use cft_ident_core::motion::{MotionError, RunError};
use cft_ident_files::config::ConfigError;
use cft_ident_logs::inspect::LogFault;
use cft_ident_logs::log::{LogError, did_you_mean, escape};

/// An error of a stage. Its text reads `what is wrong; what to do`.
#[derive(Debug, Explain, thiserror::Error)]
pub enum IdentifyError {
    #[explain(_0.explanation())]
    Log(#[source] LogError),
    #[explain(_0.explanation())]
    Config(#[from] ConfigError),
    #[explain(_0.explanation())]
    Fit(#[from] FitError),
    #[explain(_0.explanation())]
    Reduced(#[from] ReducedError),
    #[explain(_0.explanation())]
    Track(#[from] TrackError),
    #[explain("interrupted")]
    Interrupted,
    #[explain("no log is given")]
    NoLog,
    /// Rows that would count twice, or be fitted and held out.
    #[explain(
        "{second} ({second_role}) holds rows that {first} ({first_role}) holds: deviations come out too small, or what was fitted is no holdout",
        "give each row once, spans as in LOG@0..70% and LOG@70..100%"
    )]
    SameRows {
        first: String,
        first_role: &'static str,
        second: String,
        second_role: &'static str,
    },
    /// Rows that are given as unseen by a model that was made from them.
    #[explain(
        "{log}: {model} was made from rows of it, so that it says nothing of motion that the model has not seen",
        "give a log, or a span of one, that made nothing of the model"
    )]
    RowsOfModel { log: String, model: String },
    /// A fault of the data for which a fit refuses a log; its remedy is a message of its own.
    #[explain(
        format!(
            "{log}: column `{}` {}",
            fault.channel.as_deref().map(escape).unwrap_or_default(),
            fault.effect
        ),
        &fault.remedy
    )]
    Refused { log: String, fault: Box<LogFault> },
    /// A robot whose last link has no place for a body.
    #[explain(
        "{model}: a body on this robot shows in too few numbers to be told by itself",
        "look for it with `cft-ident diagnose --keep`"
    )]
    NoPayload { model: String },
    /// Positions where a joint of the robot cannot stand.
    #[explain(
        "positions of {joint} run over {positions} {unit}, and its limits are {limits}: this is a log of another robot, or in another unit or with another zero",
        "give the log of this robot, or correct [log.joint] or [limits] of its file"
    )]
    OtherRobotLog {
        joint: String,
        positions: String,
        limits: String,
        unit: &'static str,
    },
    /// The motion of a log, or the processing that a robot file asks for.
    #[explain(left_out.iter().fold(error.explanation().of(of), ErrorText::remedy))]
    Motion {
        of: String,
        error: MotionError,
        /// What was left out of the log before, and why.
        left_out: Option<Box<str>>,
    },
    #[explain(
        "{log}: more than {most} rows",
        "the friction filter passes over a one-joint log many times and holds it in memory",
        "give a span of it, such as FILE@0..600s: minutes are enough for friction"
    )]
    TooManyRows { log: String, most: usize },
    #[explain(
        "{log}: {samples} samples are more than the {most} that are held in memory",
        "choose spans of the logs, as in LOG@0..20%"
    )]
    TooManySamples {
        log: String,
        samples: usize,
        most: usize,
    },
    #[explain(
        "the robot has no joint `{joint}`",
        format!("{}its joints are {known}", did_you_mean(joint, known))
    )]
    NoJoint { joint: String, known: String },
    #[explain(error.explanation().of(logs))]
    Friction { logs: String, error: FrictionError },
    #[explain(
        "{estimator} is linear, and the double-tanh law of friction is not",
        "take `--estimator oe`, which refines the law with the inertias",
        "or give the friction with -m, or set `law = \"viscous-coulomb\"`"
    )]
    LawIsNotLinear { estimator: &'static str },
    #[explain(
        "these data determine none of the parameters",
        "excite every joint with more speed and acceleration"
    )]
    NothingDetermined,
    #[explain(
        format!(
            "these data determine nothing: the noise is as large as the torque, {} of which is left at every joint",
            cft_ident_core::number::percent(*left)
        ),
        "move faster, or filter more by a lower `cutoff_hz` in [filter]"
    )]
    OnlyNoise { left: f64 },
    #[explain(
        "{model}: its data determine none of its parameters, so that nothing can be said of effects beside it",
        "fit it to data that determine it"
    )]
    NothingIdentified { model: String },
    #[explain(
        "{log}: rows are poses and no motion: {rate_hz:.3} Hz, and positions leap from row to row",
        "fit gravity to the poses by `cft-ident lsq --static`",
        "for inertia and friction record the way from pose to pose too, at 100 Hz or more"
    )]
    Poses { log: String, rate_hz: f64 },
    #[explain(
        format!("{log}: {} of the time the arm stands still: this is a log of held poses, which say nothing of inertia", cft_ident_core::number::percent(*share)),
        "fit gravity to the poses by `cft-ident lsq --static`",
        "for inertia and friction record a motion, such as `cft-ident excite` proposes"
    )]
    Held { log: String, share: f64 },
    #[explain(
        "{joint}: the model makes a torque of {torque:.4} {unit} at {t:.3} s of {log}, where no more than {measured:.4} {unit} was measured anywhere: it does not hold there",
        "see what its parameters were fitted to, and the clock and units of this log"
    )]
    Impossible {
        joint: String,
        log: String,
        t: f64,
        torque: f64,
        measured: f64,
        unit: &'static str,
    },
    /// Positions in counts of an unknown size.
    #[explain(
        "{robot}: the positions of {joints} are logged in counts, and nothing says what angle or length one is",
        "give `position_scale` (rad or m per count, the gear between encoder and joint in it) in [log.joint.NAME]: 2 pi / 4096 / gear ratio for an encoder of 4096 a turn",
        "or the unit that the numbers are in, in place of \"counts\": `position_unit = \"mdeg\"`",
        "or `position_scale = 1.0`, where they are rad or m"
    )]
    WithoutScale { robot: String, joints: String },
    /// Channels of several joints in a unit that is no torque.
    #[explain(
        "{robot}: the torques of {joints} are logged in {unit}, and nothing says what torque that is at each joint: gains differ from joint to joint, and masses and inertias need them",
        "give `torque_scale` (N or Nm per {unit} at the joint: torque constant times gear ratio) in [log.joint.NAME]",
        "or let `lsq` find them from a log with a known payload, `--fit-gains LOG:mass=KG`",
        "or go on with one gain for all joints, and a model in {unit}, by `--as-declared`"
    )]
    WithoutGains {
        robot: String,
        joints: String,
        unit: &'static str,
    },
    /// No axis that is fitted to its motion.
    #[explain(
        "--open-loop fits single axes whose robot file says `law = \"viscous-coulomb\"` and `fitted_with_inertias = true` in [friction]",
        "fit this robot without it"
    )]
    NotByMotion,
    #[explain(_0.explanation())]
    ByMotion(#[from] AxisError),
    #[explain(_0.explanation())]
    Gains(#[from] GainError),
    #[explain(
        error.explanation().of(model),
        format!("{}correct the [[effect]] table, or take it out", near(error))
    )]
    Effect { model: String, error: EffectError },
    /// A formula of the user's own that is none on this robot.
    #[explain(_0.explanation(), "correct the [[candidate]] table")]
    Formula(FormulaError),
    /// A log without a temperature that a formula takes.
    #[explain(why.clone().of(format!("{log}: `{effect}` takes the temperature of {joint}, and none is known")))]
    NoTemperature {
        log: String,
        effect: String,
        joint: String,
        why: Box<ErrorText>,
    },
    /// A candidate whose name the given model has for something else.
    #[explain(
        "candidate `{name}`: {model} has an effect of that name with another [[candidate]] table",
        "give the candidate another name, or leave it as it is there"
    )]
    CandidateOfModel { name: String, model: String },
    /// A model that nothing was set aside for.
    #[explain(
        "{model}: holds no [[held_out]] and [excesses], so that it is not known how large external torques are where nothing touches the robot",
        "fit it again with `lsq` or `diagnose` of this version, which set blocks of their logs aside",
        "or give a log of the robot moving freely by `--unloaded LOG`"
    )]
    NothingHeldOut { model: String },
    #[explain(_0.explanation())]
    Diagnose(DiagnoseError),
    #[explain(
        "{first} and {second} are models of different robots: the joints are {ours} in the first and {theirs} in the second",
        "give two models that were identified on one robot"
    )]
    OtherRobot {
        first: String,
        second: String,
        ours: String,
        theirs: String,
    },
}

/// What was meant by a name that is not known.
fn near(error: &EffectError) -> String {
    match error {
        EffectError::Unknown { name, known } => did_you_mean(name, known),
        EffectError::Joint { joint, known, .. } => did_you_mean(joint, known),
        _ => String::new(),
    }
}

impl IdentifyError {
    /// What it is about.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Interrupted => ErrorKind::Interrupted,
            Self::NoLog
            | Self::NoJoint { .. }
            | Self::LawIsNotLinear { .. }
            | Self::Diagnose(DiagnoseError::Exclusive { .. })
            | Self::NotByMotion => ErrorKind::Usage,
            Self::Fit(FitError::TooFewRows { .. } | FitError::NothingExcited)
            | Self::Friction { .. }
            | Self::ByMotion(_)
            | Self::OnlyNoise { .. }
            | Self::NothingIdentified { .. }
            | Self::NothingDetermined => ErrorKind::Undetermined,
            Self::Diagnose(DiagnoseError::Motion(_)) => ErrorKind::Input,
            Self::Diagnose(_) => ErrorKind::Undetermined,
            Self::Gains(error) => error.kind(),
            Self::Reduced(ReducedError::Empty) | Self::Track(TrackError::Empty) => ErrorKind::Usage,
            Self::Reduced(_)
            | Self::Track(_)
            | Self::WithoutGains { .. }
            | Self::WithoutScale { .. }
            | Self::Log(_)
            | Self::Config(_)
            | Self::Fit(FitError::Math(_))
            | Self::Poses { .. }
            | Self::Held { .. }
            | Self::Impossible { .. }
            | Self::Refused { .. }
            | Self::OtherRobotLog { .. }
            | Self::NoPayload { .. }
            | Self::SameRows { .. }
            | Self::RowsOfModel { .. }
            | Self::Motion { .. }
            | Self::TooManyRows { .. }
            | Self::TooManySamples { .. }
            | Self::Effect { .. }
            | Self::Formula(_)
            | Self::NoTemperature { .. }
            | Self::NothingHeldOut { .. }
            | Self::CandidateOfModel { .. }
            | Self::OtherRobot { .. } => ErrorKind::Input,
        }
    }

    /// The motion of a log.
    pub(crate) fn motion(of: &str, error: MotionError) -> Self {
        Self::Motion {
            of: of.to_owned(),
            error,
            left_out: None,
        }
    }

    /// What ended a run through a log.
    pub fn of_run(log: &str, error: RunError<LogError>) -> Self {
        match error {
            RunError::Source(error) => error.into(),
            RunError::Motion(error) => Self::motion(log, error),
        }
    }
}

impl From<LogError> for IdentifyError {
    fn from(error: LogError) -> Self {
        match error {
            LogError::Interrupted => Self::Interrupted,
            error => Self::Log(error),
        }
    }
}
