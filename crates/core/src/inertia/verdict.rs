//! What the data say about each inertial parameter.

use crate::verdict::{Verdict, verdict_of};

/// Share of the torque below which twice a parameter's uncertainty does not matter.
pub const NEGLIGIBLE: f64 = 0.005;

/// Verdict from value and standard deviation, and whether the parameter's uncertainty is
/// negligible. `torque_share` is the largest over joints of 2 std x rms of the parameter's column
/// over rms of the torque.
pub fn verdict(value: f64, std: f64, determined: bool, torque_share: f64) -> (Verdict, bool) {
    if !determined || !std.is_finite() {
        return (Verdict::NotIdentifiable, false);
    }
    match torque_share < NEGLIGIBLE {
        true => (Verdict::Identified, true),
        false => (verdict_of(value, std), false),
    }
}
