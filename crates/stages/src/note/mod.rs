//! What a stage noticed beside its result, as plain data. The sentences are in `words.rs` and its folder.

mod words;

use crate::band::{BeyondSeen, Reach};
use crate::setup::{Finding, FoundTorqueLimit, FrictionPower};
use cft_ident_core::friction::plateau::MissedPlateau;
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_logs::inspect::RowCost;

/// What a stage noticed; its text is a sentence without a full stop.
#[derive(Debug, Clone, PartialEq)]
pub enum StageNote {
    /// A sentence of the reader of a log.
    OfReader(String),
    /// A sentence about how the robot file was read.
    OfRobotFile(String),
    /// A sentence that a file of reduced logs keeps.
    OfReducedLog(String),
    /// Of the rows of a log.
    Log(LogNote),
    /// Of the check of the set-up.
    Setup(SetupNote),
    /// Of the friction of one joint.
    Friction { joint: String, note: FrictionNote },
    /// Of a fit.
    Fit(FitNote),
    /// Of a model that is applied.
    Model(ModelNote),
    /// Of one robot that is followed.
    Track { robot: String, note: TrackNote },
}

impl StageNote {
    /// What was taken otherwise than a robot file writes it.
    pub(crate) fn of_robot(file: &RobotFile) -> impl Iterator<Item = StageNote> {
        file.notes.0.iter().cloned().map(StageNote::OfRobotFile)
    }

    /// The joints that leave what was seen of them; that there is no band where nothing was.
    pub(crate) fn of_reach(reach: Option<&Reach>) -> Vec<StageNote> {
        let notes = match reach {
            Some(reach) => (reach.beyond().into_iter())
                .map(ModelNote::BeyondSeen)
                .collect(),
            None => vec![ModelNote::NoBand],
        };
        notes.into_iter().map(StageNote::Model).collect()
    }
}

/// What was noticed of the rows of a log; `log` is its name.
#[derive(Debug, Clone, PartialEq)]
pub enum LogNote {
    /// Rows are left out or mended by the first look, as one sentence for each kind of fault.
    Marked { log: String, sentence: String },
    /// Rows are left out or mended: `left_out` of `rows`, by causes, the most first.
    RowsLost {
        log: String,
        rows: u64,
        left_out: u64,
        losses: Vec<RowLoss>,
    },
    /// Velocity columns are no derivatives of the positions: joints with the factor between them.
    VelocityScale {
        log: String,
        joints: Vec<(String, f64)>,
        /// The factor is one for all joints, as where the clock is wrong.
        alike: bool,
    },
    /// Stretches between gaps are too short to filter.
    TooShort {
        log: String,
        stretches: usize,
        samples: u64,
        /// First and last time of the first ones, by the clock of the log \[s\].
        spans: Vec<[f64; 2]>,
    },
    /// Gaps part the log into stretches.
    Gaps { log: String, stretches: usize },
    /// The clock is uneven, and samples were put on an even one.
    UnevenClock {
        log: String,
        samples: u64,
        interpolated: u64,
    },
    /// A column of temperatures is named, and the log lacks it.
    NoTemperature { why: String },
    /// Two logs share rows.
    Repeated { first: String, second: String },
}

/// Rows that one cause takes from a log.
#[derive(Debug, Clone, PartialEq)]
pub enum RowLoss {
    /// By the first look.
    Marked(RowCost),
    /// By the reader: how many rows, and the kind of fault.
    Dropped(u64, &'static str),
    /// In stretches that are too short to filter.
    TooShort(u64),
}

impl RowLoss {
    /// How many rows.
    pub fn rows(&self) -> u64 {
        match self {
            Self::Marked(cost) => cost.rows,
            Self::Dropped(rows, _) | Self::TooShort(rows) => *rows,
        }
    }
}

/// What the check of the set-up says before a fit.
#[derive(Debug, Clone, PartialEq)]
pub enum SetupNote {
    /// A mistake is likely, and the set-up as declared is possible too.
    Likely(Box<Finding>),
    /// A mistake was put right in a new robot file.
    PutRight { file: String, finding: Box<Finding> },
    /// The friction of a joint would drive it.
    FrictionPower(FrictionPower),
    /// A drive gives no more than a torque, and rows beyond are left out.
    TorqueLimit(FoundTorqueLimit),
}

/// What was noticed of the friction of a joint.
#[derive(Debug, Clone, PartialEq)]
pub enum FrictionNote {
    /// The search ended without converging.
    NotConverged(IterationEnding),
    /// The law drives the joint at a speed \[m/s or rad/s\].
    Drives { speed: f64 },
    /// The mean of the normalised innovations squared is above its 95 % bounds.
    NisAbove { mean: f64, bounds: [f64; 2] },
    /// The same below its bounds.
    NisBelow { mean: f64, bounds: [f64; 2] },
    /// The innovations are coloured; standard deviations are so many times larger for it.
    Coloured { factor: f64 },
    /// One Coulomb term does.
    OneCoulombTerm,
    /// Two Coulomb terms \[N or Nm\] nearly cancel; the uncertainty of the curve is a fraction.
    TermsCancel { coulomb: [f64; 2], uncertainty: f64 },
    /// The curve misses the mean torque at constant speed.
    MissedPlateaus(Vec<MissedPlateau>),
    /// A slope is only known to be above a value, 95 % \[s/m or s/rad\].
    LowerBound { parameter: &'static str, above: f64 },
    /// The data do not determine a parameter.
    NotDetermined { parameter: &'static str },
    /// The logs of a fit contradict the friction that was known before; its parameters with their units, before and after.
    Contradicted {
        moved: Vec<(&'static str, [NumberWithStd; 2], String)>,
    },
    /// The joint moves faster than in its one-joint logs \[`unit`/s\].
    FasterThanLogged {
        speed: f64,
        logged: f64,
        /// m or rad.
        unit: &'static str,
        /// The friction there is uncertain by the law's own deviation too.
        uncertain: bool,
    },
}

/// A number with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberWithStd {
    pub value: f64,
    pub std: f64,
}

/// What was noticed of a fit by least squares.
#[derive(Debug, Clone, PartialEq)]
pub enum FitNote {
    /// A log that one fit does not bring together with the others.
    Disagrees {
        log: String,
        /// The others, where it is one of two.
        other: Option<String>,
        joint: String,
        /// Relative residual of the joint in this log by the fit of all logs, and by its own.
        own: [f64; 2],
        /// The same in the others.
        others: [f64; 2],
    },
    /// Friction is fitted with the inertias; `law` where that is law (18), by refinement.
    FrictionFitted { law: bool },
    /// The friction stays as a reduced log, which is named, was made with.
    FrictionOfReduced { log: String },
    /// `oe` was asked for, and no parameter is nonlinear.
    NothingNonlinear,
    /// `iv` has no reference channel, and the smoothed position stands for it.
    SmoothedReference,
    /// At a share of the steps of `iv` no motion could be simulated.
    FailedSteps { share: f64 },
    /// Columns of torques that were commanded or computed, by their names.
    AskedFor { columns: Vec<String> },
    /// Torques of two logs are equal to the last digit, and their motions are not.
    ReplayedTorque { logs: [String; 2] },
    /// A torque that is an offset for the most part: the relative error, and that of what varies, fractions.
    MostlyOffset { joint: String, errors: [f64; 2] },
    /// Columns of commands that the law of the controller in `[log] torque` leaves out, and its key for them.
    UnusedCommands {
        key: &'static str,
        columns: Vec<String>,
    },
    /// The torque is one that no drive was measured to give: largest relative error of a joint, and largest share of its
    /// torque that is friction at its top speed, fractions.
    NoDrive { error: f64, friction: f64 },
    /// An estimator did not settle.
    NotSettled {
        estimator: EstimatorKind,
        passes: usize,
    },
    /// Something may push the robot in a stretch.
    Contact {
        log: String,
        joints: Vec<String>,
        /// Largest residual over the usual one.
        ratio: f64,
        /// From the first row of the log \[s\].
        span: [f64; 2],
        /// What is to be left out, with room for the filters \[s\].
        leave_out: [f64; 2],
    },
    /// A load is carried in a part of a log, which is left out.
    LoadLeftOut {
        log: String,
        /// From its first row on \[s\]; none where it is there from the beginning.
        from_s: Option<f64>,
        /// The same; none where it stays to the end.
        to_s: Option<f64>,
    },
    /// Samples at rest are left out: shares by joints.
    AtRest { joints: Vec<(String, f64)> },
    /// Parameters are other ones where spikes are not bridged: each with the bridges and without.
    HangsOnBridged {
        moved: Vec<(String, [NumberWithStd; 2])>,
    },
    /// No motion excites these unknowns.
    NotExcited { unknowns: Vec<String> },
    /// The data do not separate these unknowns: each with its part in the combination.
    Confounded { terms: Vec<(String, f64)> },
    /// Friction or inertia is below zero: names, numbers and units.
    BelowZero {
        unknowns: Vec<(String, NumberWithStd, String)>,
    },
    /// A number of the geometry is nearly a plain one, and makes a parameter that no motion shows.
    Geometry(Box<Finding>),
    /// A declared position cut-off costs much more than the best one.
    PositionCutoff {
        joint: String,
        /// As it is declared, and the best one \[Hz\].
        cutoff_hz: f64,
        best_hz: f64,
        /// What it costs, and the rms of the residual \[`unit`\].
        cost: f64,
        residual: f64,
        unit: String,
    },
    /// The search for physically consistent parameters failed, and the plain fit stands.
    NotConsistent,
    /// Links whose mass properties in the robot file no body can have.
    ImpossibleBodies { links: Vec<String> },
    /// The search for physically consistent links ended early: the gap is a fraction of the sum of squares.
    DualityGap { gap: f64 },
    /// Physically consistent parameters fit worse on blocks left out: relative errors by joints, theirs and those of
    /// the plain fit.
    ConsistentWorse {
        joints: Vec<(String, [f64; 2])>,
        /// The model computes with them all the same.
        in_use: bool,
    },
    /// Gains are ratios to that of a joint.
    GainRatios { reference: String },
    /// The gains did not settle.
    GainsNotSettled { steps: usize },
    /// A fit to the motion is no better than least squares.
    MotionNoBetter,
    /// A fit to the motion has few windows for its numbers; windows behind one another, and their length \[s\].
    FewWindows {
        windows: f64,
        window_s: f64,
        numbers: usize,
    },
    /// A fit to the motion did not settle.
    MotionNotSettled { steps: usize },
    /// No block could be set aside: the error of it as text.
    NothingSetAside { error: String },
}

/// What was noticed where a model is applied.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelNote {
    /// The model file holds no errors on data set aside, so that there is no band.
    NoBand,
    /// A joint leaves what the model was fitted on.
    BeyondSeen(BeyondSeen),
    /// The torque of a joint is off by as much as itself or more: a fraction.
    NoValidation { joint: String, error: f64 },
    /// The model makes an impossible torque: the error of it as text.
    ImpossibleTorque { error: String },
    /// Windows of a simulation without feedback went astray.
    Astray { astray: u64, windows: u64 },
    /// Of a reduced log the errors of single rows are not known.
    ErrorsOfReduced { log: String },
    /// A refined model leaves measured positions faster than the one given: rms of both by joints, with units.
    FreeRunWorse {
        window_s: f64,
        joints: Vec<(String, [f64; 2], &'static str)>,
    },
    /// Two models are made from the same logs.
    SharedLogs { logs: Vec<String> },
    /// Two models are of different set-ups of the robot.
    OtherSetup,
    /// Two models map logs differently.
    OtherMapping,
    /// Two models declare different filters.
    OtherFilter,
    /// The torques of a payload are currents times declared gains: half the interval for those, a fraction.
    DeclaredGains { interval: f64 },
    /// An alarm of a joint takes more than a large share of its greatest torque \[`unit`\].
    Blind {
        joint: String,
        threshold: f64,
        torque: f64,
        unit: String,
    },
    /// The threshold of alarms is extrapolated: false alarms an hour, time observed \[s\], the rate that it proves.
    Extrapolated {
        per_hour: f64,
        observed_s: f64,
        proven_per_hour: f64,
    },
}

/// What was noticed of a robot whose parameters are followed.
#[derive(Debug, Clone, PartialEq)]
pub enum TrackNote {
    /// There is only one log.
    OneLog { log: String },
    /// Models are followed, which have no time.
    NoTimes,
    /// The clocks of the logs overlap.
    ClocksOverlap,
    /// The logs are not given in the order of their clocks.
    OutOfOrder,
    /// The clock jumps between two logs by a time \[s\] of so many usual steps.
    ClockJump {
        by_s: f64,
        between: [String; 2],
        steps: f64,
    },
}
