//! Parameters over time: each course smoothed, its changes found, and robots of a fleet compared.
//!
//! A log gives one estimate of each parameter with its variance. Between logs a parameter walks at random, and
//! estimates scatter by more than their variances say, with temperature, payload and motion: the sizes of both
//! are estimated from the course itself (`walk`). On top of that stand steps and ramps, which are sought one
//! after the other by generalised least squares (`changes`); the course is what a Kalman smoother makes of
//! it (`course`). `fleet` says which robot differs from the others in what.

mod changes;
mod course;
mod fleet;
mod local_level;
mod together;
mod walk;

pub use changes::{ChangeKind, ParameterChange};
pub use course::{LogEstimate, ParameterCourse, follow, follow_together};
pub use fleet::{ParameterLevel, RobotApart, apart};
