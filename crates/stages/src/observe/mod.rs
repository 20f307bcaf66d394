//! External torques of joints sample by sample, as rows arrive: measured less the model's torque, both behind
//! the same causal filters.
//!
//! ```text
//! rows -> causal position filter -> q, v, a, tau (late alike) -> tau - model -> low-pass -> external torque
//! ```
//!
//! Without contact what comes out is noise and the model's error. How large they are was learnt from blocks of
//! the logs that the model was fitted to, each seen by the model of the others; an alarm is an external torque
//! beyond a threshold that such torques cross so often an hour (peaks over a threshold: Pickands 1975). Excesses
//! that touch are one, so that their being alike from sample to sample makes no alarms more.
//!
//! | file | what |
//! |---|---|
//! | `observer` | from rows to external torques |
//! | `alarms` | their deviations, alarms with joints, size, begin and end |
//! | `excesses` | from torques of an untouched robot to thresholds |
//! | `recipe` | the same as numbers for generated code |
//! | `explain` | a payload or a change of friction behind what was left |

mod alarms;
mod excesses;
mod explain;
mod observer;
mod recipe;

pub use alarms::{Alarm, Alarms, JointOfAlarm};
pub use excesses::{KEPT, Quiet, QuietSample, hold_s};
pub use explain::{ExplainedNumber, Explainer, Explanation};
pub use observer::{Observed, Observer};
pub use recipe::{Recipe, recipe};
