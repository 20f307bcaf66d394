//! Is the set-up right that a robot file declares? Signs, order, scales and zeros of its channels, and
//! the direction of gravity, judged by the torques of a log before anything is fitted to them.
//!
//! A wrong set-up is a [`Correction`] away from the right one. Each that is thinkable is applied to a
//! thinned sample of the log and the declared model is fitted to what it gives. Two measures decide: the
//! likelihood of the residual, and physics: a body's inertia and the power that friction takes are
//! positive. What gains more than chance and unmodelled effects can is told.
//!
//! | file | what |
//! |---|---|
//! | `finding` | what is told: the entries of the key `setup` |
//! | `correction` | changes of a set-up, and their sum |
//! | `sample` | a bounded number of smoothed rows, spread over the logs |
//! | `channels` | from logged channels to joints, and back, under a correction |
//! | `normal` | normal equations of the sample under a correction, by joint and block of time |
//! | `fit` | their solution, with weights of its own, and its likelihood |
//! | `physics` | inertia and friction power of a solution with their deviations |
//! | `poses` | positions that belong to no pose as they are declared |
//! | `sizes` | how far a joint turns in a log, and how large its torque is beside the others' |
//! | `confirm` | held-out blocks: gains that did not choose the hypothesis |
//! | `doubt` | whether there is any reason to try them all |
//! | `hypotheses` | which corrections are tried |
//! | `fitted` | corrections whose number is fitted: zeros, scales, gravity of any direction |
//! | `trial` | one hypothesis, fitted |
//! | `decide` | the best one, and whether the evidence is enough |
//! | `hints` | small tilts, zeros and delays: what a fit looks like where the set-up is right |
//! | `search` | all of it, round by round |

mod channels;
mod confirm;
mod correction;
mod decide;
mod doubt;
mod finding;
mod fit;
mod fitted;
mod hints;
mod hypotheses;
mod normal;
mod physics;
mod poses;
mod sample;
mod search;
mod sizes;
#[cfg(test)]
mod tests;
mod trial;

pub use channels::{Channels, Drive};
pub use correction::{Change, Correction};
pub use decide::{Found, Negative};
pub use finding::{
    Alternative, ChannelKind, Evidence, Finding, FindingKind, FindingSeverity, FrictionPower,
    Setting, SetupReport,
};
pub use hints::{Hint, Small};
pub use normal::Problem;
pub use sample::{MOST_ROWS, Sample, Thinner};
pub use search::{Searched, search};
