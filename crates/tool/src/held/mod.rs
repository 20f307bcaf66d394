//! Gravity from poses that are held, each reached from both sides.
//!
//! ```text
//! rows -> holds: mean position and torque, and the side from which each joint came      (holds)
//!      -> tau = G(q) theta + side F + offset, gains of currents beside it where joints share parameters   (gravity)
//!      -> numbers with intervals by blocks of neighbouring holds, and poses to check them with
//! ```
//!
//! A joint that stops keeps the friction of the way it came: the mean of both sides is gravity, half their difference
//! friction at rest.

mod check;
mod error;
mod gravity;
mod holds;
mod problem;
mod python;

pub use check::HoldCheck;
pub use error::HeldError;
pub use gravity::{GravityFit, GravityNumber, JointAtRest, TouchedPose, fit_gravity};
pub use holds::{HeldLog, HeldPose, read_held};
pub use python::gravity_in_python;

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct HeldNumbers {
    /// Rows and time that a hold lasts at least \[s\].
    pub rows: usize,
    pub seconds: f64,
    /// A position stands still within so many steps of its encoder, or so much of its range.
    pub steps: f64,
    pub range: f64,
    /// Part of a hold at its beginning that is left out: the controller settles.
    pub settling: f64,
    /// Part of the rows in holds from which a log is one of held poses.
    pub held: f64,
    /// Part of the greatest pivot below which a parameter is one with others.
    pub singular: f64,
    /// Fewest poses.
    pub poses: usize,
    /// Torque of a joint that the model of gravity may leave; beyond it, it is none.
    pub explained: f64,
}

/// The numbers of `lsq --static`.
pub const HELD: HeldNumbers = HeldNumbers {
    rows: 5,
    seconds: 0.3,
    steps: 3.0,
    range: 1e-3,
    settling: 0.3,
    held: 0.5,
    singular: 1e-8,
    poses: 6,
    explained: 0.5,
};
