//! Is the set-up right that a robot file declares? Signs, order, units and zeros of its channels, and the direction of
//! gravity, judged by the torques of a log before anything is fitted to them.
//!
//! ```text
//! rows of the logs -> each hypothesis: other columns for the same blocks of time
//!                  -> errors of every joint on blocks left out, the same gain in all parts of the logs,
//!                     and physics: friction brakes, inertia is positive
//!                  -> the one mistake that repairs what the declared set-up cannot explain, or none
//! ```
//!
//! A hypothesis is a mistake that a person makes, from a list. A factor that is on no list is an estimate and no fault.
//! Blocks, parts and what counts as sure are those of the judge ([`cft_ident_core::judge`]).

mod channels;
mod condition;
mod correction;
mod decide;
mod estimate;
mod finding;
mod found;
mod hypotheses;
mod physics;
mod problem;
mod rows;
mod sample;
mod search;
mod sum_waves;
mod trial;
mod undecided;
mod undelivered;
mod weight;

pub(crate) use channels::{Channels, Drive};
pub use condition::{DecidedBy, SetupCriterion};
pub(crate) use correction::{Change, Correction};
pub(crate) use estimate::SetupEstimate;
pub use finding::{
    Alternative, ChannelKind, Finding, FindingKind, FindingSeverity, FoundTorqueLimit,
    FrictionPower, Setting, SetupErrors, SetupReport,
};
pub(crate) use found::{Found, Searched};
pub(crate) use physics::Driven;
pub(crate) use problem::{KnownBeforehand, Problem};
pub(crate) use sample::{Sample, Thinner};
pub(crate) use search::search;
pub(crate) use undecided::{Cause, Undecided};
pub use undelivered::UndeliveredTorque;
pub(crate) use weight::{Weight, WeightGain};

/// The numbers that decide beside those of the judge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SetupLimits {
    /// A set-up is absurd where a joint's error is above this share of its torque. Half: machines of much friction are
    /// refused; twice: only turned signs are.
    pub unexplained: f64,
    /// A repair leaves no more of the torque of such a joint, as sound machines do. Half: wrists are never repaired;
    /// twice: anything repairs.
    pub sound: f64,
    /// Below this error of every joint nobody asks. Half: all machines are searched for nothing; twice: ratios of two
    /// are passed over.
    pub doubtful: f64,
    /// Squared errors of blocks left out are at most this share of those as declared, in the joints that gain: the
    /// floor of gain that a mistake makes. Half: exchanged neighbours are passed over; one: effects look like mistakes.
    pub floor: f64,
    /// Another reading is far where it leaves so many times the squared error. One: what chance prefers is certain;
    /// twice: readings of neighbouring joints hide each other.
    pub far: f64,
    /// Errors closer than this share of themselves are the same: half of it is the luck of a few blocks, twice hides
    /// harm.
    pub same: f64,
    /// Torques of the robot file's own masses, and its limits of torque, are right within this factor.
    pub yardstick: f64,
    /// A joint that travels less \[rad, m\], or is slower than this share of its rms speed, stands still.
    pub still: f64,
    /// Most rows that are kept of all logs, and of few a fifth.
    pub rows: usize,
    /// Hypotheses that few rows pass on to all rows.
    pub short_list: usize,
    /// Share of the squares of a torque that varies, below which errors are held against what varies: half of the torque
    /// itself. Half: a joint that carries a weight hides an error of its sign; twice: errors of sound arms look larger.
    pub varies: f64,
}

pub(crate) const LIMITS: SetupLimits = SetupLimits {
    unexplained: 0.5,
    sound: 0.25,
    doubtful: 0.05,
    floor: 0.5,
    far: 1.5,
    same: 0.1,
    yardstick: 3.0,
    still: 0.01,
    rows: 2000,
    short_list: 12,
    varies: 0.25,
};
