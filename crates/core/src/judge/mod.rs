//! The judge: whether a change of a model earns its place.
//!
//! ```text
//! rows -> blocks of time -> sums of products per block and joint
//!      -> each block left out: gain of a hypothesis with its standard error   (the screen)
//!      -> the joint fit with each block left out: an amplitude over its deviation   (the test)
//! ```
//!
//! Nothing here knows an effect or a robot. Rows come as columns of a linear problem; a *term* is an unknown
//! with the columns that it has in the rows of one joint or of several. Another hypothesis is other columns for
//! the same blocks: [`compare`] sets the errors of two against each other, [`agreement_on_share`] asks parts of the logs.

mod amplitude;
mod block_errors;
mod blocks;
mod bounded;
mod chance;
mod jackknife;
mod left_out;
mod parts;
mod set_aside;
mod sums;
#[cfg(test)]
mod tests;

pub use amplitude::{EffectAmplitude, EffectTerms, JointFit};
pub use block_errors::{BlockErrors, FitToAll};
pub use blocks::{Blocks, LogRows, TimeBlock, divide};
pub use bounded::Bound;
pub use chance::floor;
pub use jackknife::{hotelling, hotelling_floor, jackknife, width_95};
pub(crate) use left_out::weighted;
pub use left_out::{BlocksLeftOut, ErrorGain, WholeFit, compare};
pub use parts::{PARTS, PartNumbers, agreement_on_share};
pub use set_aside::{GroupError, kept_groups};
pub use sums::{BlockSums, Term, TermFit, Terms};

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct Numbers {
    /// A gain on blocks left out counts above so many standard errors. Half: noise fills the six places and all rests
    /// on the parts; twice: effects of a third of the residual are passed over.
    pub screen: f64,
    /// Blocks of equal time over all logs; fewer where these are short. Half: an effect of a few seconds passes by
    /// chance; twice: neighbours share their noise, and half as many joints again get worse.
    pub blocks: usize,
    /// With fewer blocks nothing is written: F has too few degrees of freedom. Half: one block decides; twice: logs of
    /// half a minute confirm nothing.
    pub least_blocks: usize,
    /// An amplitude is written from so many of its deviations on, s = max(0, 1 - deviations^2 / F). Four: three times as
    /// many joints get worse; six: a tenth of the gain is lost.
    pub deviations: f64,
    /// The same of an effect that every machine is expected to have: one question to a joint, and not one of some
    /// hundred. Half: of measured logs half as many joints again get worse, one of them by a fifth; five: a twelfth of
    /// the gain is lost.
    pub expected_deviations: f64,
    /// Degrees of freedom of the noise that all blocks tell, beside those of an effect's own blocks. Half: an effect of
    /// two blocks stays chance; twice: where its blocks are nine times noisier, one in a hundred of chance's is written.
    pub shared_noise: f64,
    /// The error of a gain by its scatter about what the change of torque in each block lets expect counts so many times.
    /// Half: what one block holds passes; twice: an effect of few blocks is not seen.
    pub about_line: f64,
    /// A block is at least so many 1/e times of the residual long. Half: neighbours share their noise; five: the logs
    /// of a robot that lacks an effect give a handful of blocks.
    pub memory_times: f64,
    /// An effect is named where it takes this part off some joint's error on blocks left out. Half: effects that no
    /// one sees; twice: friction shapes of a twentieth of the torque are passed over.
    pub noticeable: f64,
    /// The same in parts of that joint's torque. Half: a clean simulation is full of names; twice: a good sensor's are lost.
    pub noticeable_torque: f64,
    /// Most effects beside the friction laws. Twice: the last ones fit what is left of the first.
    pub effects: usize,
    /// From this s on an effect is confirmed, and one that a person can measure is written. Lower: weak ones are
    /// called sure; 0.9: stiffness and delay need ten times the data.
    pub confirmed: f64,
    /// Two explanations are the same within so many standard errors of their difference: the one with fewer
    /// numbers is taken. Half: splines for constants; twice: constants for springs.
    pub same: f64,
    /// Beside a best gain, candidates are looked at down to this part of it in the fit to all blocks; fits without a block
    /// gain less. Half: a fifth more looks for the same choice; two and a half times: an alternative of a step is lost.
    pub looked: f64,
    /// Part of a column's own square that is added to the diagonal: what the data determine less is left as it is.
    pub ridge: f64,
}

impl Numbers {
    /// The numbers by which an effect is judged that every machine is expected to have.
    pub fn of_expected(&self) -> Self {
        Numbers {
            deviations: self.expected_deviations,
            ..*self
        }
    }
}

/// The numbers of `diagnose`.
pub const NUMBERS: Numbers = Numbers {
    screen: 2.0,
    blocks: 24,
    least_blocks: 8,
    deviations: 5.0,
    expected_deviations: 3.0,
    shared_noise: 4.0,
    about_line: 2.0,
    memory_times: 1.0,
    noticeable: 0.02,
    noticeable_torque: 1e-3,
    effects: 6,
    confirmed: 0.8,
    same: 1.0,
    looked: 0.2,
    ridge: 1e-6,
};
