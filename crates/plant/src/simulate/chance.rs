//! Random streams: one seed, and an own stream of ChaCha8 for each purpose.
//!
//! A stream that one purpose draws more or less from does not move the others: the noise of a log is
//! the same whether effects are on or off, and whether samples are dropped or not.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What chance is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChancePurpose {
    /// Parameters of a plant that vary from study to study.
    Plant = 1,
    /// Order and start phase of a reference.
    Reference = 2,
    /// Times of the samples.
    Jitter = 3,
    /// Rows that are lost.
    Dropout = 4,
    /// Noise of the logged volts.
    Volts = 5,
    /// Noise of the logged joint torques.
    Torque = 6,
    /// Torques that wander.
    Drift = 7,
}

/// Purposes leave this many streams to the things of one kind that each have their own.
const STREAMS_PER_PURPOSE: u64 = 1 << 32;

/// Generator of the given purpose.
pub fn stream(seed: u64, purpose: ChancePurpose) -> ChaCha8Rng {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    generator.set_stream(purpose as u64);
    generator
}

/// Generator of the given purpose for one of several things, such as joints.
pub(super) fn stream_of(seed: u64, purpose: ChancePurpose, number: usize) -> ChaCha8Rng {
    let mut generator = stream(seed, purpose);
    generator.set_stream(purpose as u64 + STREAMS_PER_PURPOSE * (number as u64 + 1));
    generator
}
