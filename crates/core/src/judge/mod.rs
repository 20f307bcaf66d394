//! The judge: whether a change of a model earns its place.
//!
//! ```text
//! rows -> blocks of time -> sums of products per block and joint
//!      -> each block left out: gain of a hypothesis with its standard error   (the screen)
//!      -> parts of the data: does every part ask for the same amplitude?       (the test)
//! ```
//!
//! Nothing here knows an effect or a robot. Rows come as columns of a linear problem; a *term* is an unknown
//! with the columns that it has in the rows of one joint or of several. Another hypothesis is other columns for
//! the same blocks: [`compare`] sets the errors of two against each other, [`agreement_on_share`] asks the parts.

mod block_errors;
mod blocks;
mod bounded;
mod left_out;
mod parts;
mod sums;
#[cfg(test)]
mod tests;

pub use block_errors::{BlockErrors, FitToAll};
pub use blocks::{Blocks, LogRows, TimeBlock, divide};
pub use bounded::Bound;
pub(crate) use left_out::weighted;
pub use left_out::{BlocksLeftOut, ErrorGain, compare};
pub use parts::{Agreement, agreement_on_share};
pub(crate) use parts::{LEAST_PARTS, agreement};
pub use sums::{BlockSums, Term, TermFit, Terms};

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct Numbers {
    /// A gain on blocks left out counts above so many standard errors. Half: noise fills the six places and all rests
    /// on the parts; twice: effects of a third of the residual are passed over.
    pub screen: f64,
    /// Number of parts that must ask for one amplitude; fewer, where logs are short or a joint rests, must agree so much
    /// the better that chance is as small. Half: one log cut in parts agrees with itself and a fifth of the joints gets
    /// worse; twice: logs of a minute confirm nothing.
    pub parts: usize,
    /// s = max(0, 1 - doubt / z). Half: noise along a motion is written; twice: a sixth of the gain is lost.
    pub doubt: f64,
    /// Blocks that each part is cut into for the screen. One: its standard error rests on 12 values; four: blocks as
    /// short as the residual's own memory.
    pub blocks_per_part: usize,
    /// A block is at least so many 1/e times of the residual long. Half: neighbours share their noise; twice: short
    /// logs give too few.
    pub memory_times: f64,
    /// Most effects beside the friction laws. Twice: the last ones fit what is left of the first.
    pub effects: usize,
    /// From this s on an effect is confirmed, and one that a person can measure is written. Lower: weak ones are
    /// called sure; 0.9: stiffness and delay need ten times the data.
    pub confirmed: f64,
    /// Two explanations are the same within so many standard errors of their difference: the one with fewer
    /// numbers is taken. Half: splines for constants; twice: constants for springs.
    pub same: f64,
    /// Part of a column's own square that is added to the diagonal: what the data determine less is left as it is.
    pub ridge: f64,
}

/// The numbers of `diagnose`.
pub const NUMBERS: Numbers = Numbers {
    screen: 2.0,
    parts: 12,
    doubt: 4.0,
    blocks_per_part: 2,
    memory_times: 5.0,
    effects: 6,
    confirmed: 0.8,
    same: 1.0,
    ridge: 1e-6,
};
