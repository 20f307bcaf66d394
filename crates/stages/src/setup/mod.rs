//! Is the set-up right that a robot file declares? Signs, order, units and zeros of its channels, and the direction of
//! gravity, judged by the torques of a log before anything is fitted to them.
//!
//! ```text
//! rows of the logs -> each hypothesis: other columns for the same blocks of time
//!                  -> errors of every joint on blocks left out, and physics: friction brakes, inertia is positive
//!                  -> the one mistake that repairs what the declared set-up cannot explain, or none
//! ```
//!
//! A hypothesis is a mistake that a person makes, from a list. A factor that is on no list is an estimate and no fault.
//!
//! | file | holds |
//! |---|---|
//! | `finding` | the entries of the key `setup` |
//! | `correction` | changes of a set-up, and their sum |
//! | `hypotheses` | the list of mistakes |
//! | `sample` | a bounded number of smoothed rows, spread over the logs |
//! | `channels` | from logged channels to joints under a correction |
//! | `problem` | sums of products under a correction, by block and joint |
//! | `trial` | the fit of one hypothesis, its errors on blocks left out |
//! | `physics` | what no machine does: friction that drives, inertia below zero |
//! | `factor` | factors that are fitted: which round number they are, if any |
//! | `weight` | the masses of the robot file as a yardstick of its torques |
//! | `search` | all of it |

mod channels;
mod correction;
mod factor;
mod finding;
mod hypotheses;
mod physics;
mod problem;
mod sample;
mod search;
mod trial;
mod weight;

pub use channels::{Channels, Drive};
pub use correction::{Change, Correction};
pub use factor::Factor;
pub use finding::{
    Alternative, ChannelKind, Finding, FindingKind, FindingSeverity, FrictionPower, Setting,
    SetupErrors, SetupReport,
};
pub use physics::Driven;
pub use problem::{KnownBeforehand, Problem};
pub use sample::{MOST_ROWS, Sample, Thinner};
pub use search::{Found, Searched, search};
pub use weight::Weight;

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct SetupLimits {
    /// A set-up is absurd where a joint's error is above this share of its torque. Half: machines of much friction are
    /// refused; twice: only turned signs are.
    pub unexplained: f64,
    /// A repair leaves no more of the torque of such a joint, as sound machines do. Half: wrists are never repaired;
    /// twice: anything repairs.
    pub sound: f64,
    /// Below this error of every joint nobody asks. Half: all machines are searched for nothing; twice: it is `sound`.
    pub doubtful: f64,
    /// Squared errors of blocks left out, all joints together, are at most this share of those as declared: the floor
    /// of gain that a mistake makes. Half: exchanged neighbours are passed over; one: effects look like mistakes.
    pub floor: f64,
    /// A gain counts above so many standard errors of its blocks. Half: noise counts; twice: short logs say nothing.
    pub sure: f64,
    /// Another reading is far where it leaves so many times the squared error. One: what chance prefers is certain;
    /// twice: readings of neighbouring joints hide each other.
    pub far: f64,
    /// Errors closer than this share of themselves are the same: half of it is the luck of a few blocks, twice hides
    /// harm.
    pub same: f64,
    /// Torques of the robot file's own masses, and its limits of torque, are right within this factor.
    pub yardstick: f64,
    /// Blocks of time, of which each is left out once.
    pub blocks: usize,
    /// Hypotheses that few rows pass on to all rows.
    pub short_list: usize,
}

/// The numbers of the check.
pub const LIMITS: SetupLimits = SetupLimits {
    unexplained: 0.5,
    sound: 0.35,
    doubtful: 0.2,
    floor: 0.5,
    sure: 3.0,
    far: 1.5,
    same: 0.1,
    yardstick: 3.0,
    blocks: 24,
    short_list: 12,
};
