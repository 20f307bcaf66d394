//! What the model cannot answer for.

use crate::explain::Explain;

/// A pose at which the model has no answer.
#[derive(Debug, Clone, Copy, PartialEq, Explain, thiserror::Error)]
pub enum RobotError {
    /// The pantograph cannot reach these references.
    #[explain(
        "the pantograph cannot reach x_r = {x_r:.6} m, y_r = {y_r:.6} m: their distance from the origin is {r:.6} m and must be above 0 and at most {reach:.6} m",
        "keep x_c1 and x_c2 inside the limits of Table 5"
    )]
    OutOfReach {
        x_r: f64,
        y_r: f64,
        r: f64,
        reach: f64,
    },
    /// Links 4 and 5 are in line.
    #[explain(
        "the arm is singular at q5 = {q5:.6} rad, where links 4 and 5 are in line",
        "keep q5 inside [0.78, 2.48] rad, where Table 5 keeps it"
    )]
    Singular { q5: f64 },
}
