//! What is known of a log before it is used.

use cft_ident_logs::inspect::InspectionGate;

/// What the first look at a log found.
#[derive(Debug, Clone)]
pub(crate) struct FirstLook {
    /// Faults, and rows to leave out.
    pub(crate) gate: InspectionGate,
    /// Speed up to which each joint rests [m/s or rad/s].
    pub(crate) rest_speed: Vec<f64>,
    /// Greatest speed of each joint [m/s or rad/s].
    pub(crate) fastest: Vec<f64>,
    /// Its first and last time, from where its times are counted [s].
    pub(crate) bounds: [f64; 2],
    /// Rate of a log whose rows are poses [Hz].
    pub(crate) poses_hz: Option<f64>,
    /// Part of the time at rest, of a log that holds pose after pose.
    pub(crate) held_share: Option<f64>,
    /// How many times the derivative of its position each joint's velocity column is, where it follows that.
    pub(crate) velocities: Vec<Option<f64>>,
}
