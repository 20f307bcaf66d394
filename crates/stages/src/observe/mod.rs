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

mod alarms;
mod excesses;
mod explain;
mod observer;
mod recipe;

pub use alarms::{AlarmDetector, JointOfAlarm, TorqueAlarm};
pub(crate) use excesses::{KEPT, QuietSample, QuietTorques};
pub(crate) use explain::TorqueExplainer;
pub use explain::{ExplainedNumber, TorqueExplanation};
pub use observer::{ExternalTorques, Observer};
pub use recipe::ObserverRecipe;
pub(crate) use recipe::recipe;
