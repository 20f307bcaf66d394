//! What is gathered of a log while its rows go by, in fixed memory: one detector a file.

pub(super) mod clock;
pub(super) mod copies;
pub(super) mod dips;
pub(super) mod excitation;
pub(super) mod failed;
pub(super) mod flat;
pub(super) mod grain;
pub(super) mod histogram;
pub(super) mod repeats;
pub(super) mod replays;
mod ring;
pub(super) mod sampling;
pub(super) mod spike;
pub(super) mod step;
pub(super) mod turn;
pub(super) mod velocity;
pub(super) mod windows;
pub(crate) mod word_leaps;
