//! What a log holds, and what is wrong with it, before it spoils a fit.
//!
//! ```text
//! rows of any log -> judge -> facts (rate, range, motion per joint)
//!   (NaN and all)     |       faults (what, where, what it does, what to do)
//!                     +-----> spans to leave out of a fit
//! ```
//!
//! One pass in fixed memory: each detector keeps what it needs of the rows just seen, a histogram,
//! and a bounded list of candidates; what is unusual is decided at the end, by the log's own
//! measure. Nothing is assumed about rate, units or noise.

mod channel;
pub(crate) mod detectors;
mod draft;
mod fault;
mod findings;
mod gate;
mod judge;
mod lag;
mod look;
mod order;
mod position;
mod shape;
pub(crate) mod speeds;
mod together;
mod unsigned;
mod verdicts;
pub(crate) mod words;

pub use channel::{InspectedChannel, is_time};
pub use detectors::excitation::JointMotion;
pub use fault::{FaultKind, LogFault, Severity};
pub use findings::{ChannelFacts, Gap, Inspection, LogFindings, RowCost, RowFate};
pub use gate::{InspectionGate, RowCutter};
pub use judge::{InspectionDepth, LogJudge};
pub use look::{ChannelColumn, ColumnPlan, look, look_again};
pub use order::{OrderComparison, OrderFault};
pub use words::{ChannelRole, commanded_role};
