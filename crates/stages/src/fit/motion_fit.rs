//! What a fit to the motion of an axis came to.

use schemars::JsonSchema;
use serde::Serialize;

use crate::open_loop::{PositionErrors, TriedAxis};
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_files::config::model_file::EffectSection;

/// What a fit to the motion of an axis came to.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MotionFit {
    pub joint: String,
    /// Unit of positions.
    pub unit: &'static str,
    /// Length of the windows \[s\].
    pub window_s: f64,
    /// That length is the user's own; otherwise blocks set aside chose it.
    pub window_given: bool,
    /// Windows, which overlap.
    pub windows: u64,
    /// Windows that do not.
    pub windows_apart: f64,
    /// Blocks that were set aside one after the other.
    pub blocks: u64,
    /// The model of least squares.
    pub before: PositionErrors,
    pub after: PositionErrors,
    /// It is in the model: on blocks set aside it runs better than least squares.
    pub taken: bool,
    pub status: IterationEnding,
    pub steps: u64,
    /// Friction that was added.
    pub effects: Vec<EffectSection>,
    /// What was tried on the blocks, in order.
    pub tried: Vec<TriedAxis>,
}
