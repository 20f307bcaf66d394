//! Parameters over time, and robots of a fleet compared.
//!
//! [`track::follow`] makes a [`track::ParameterCourse`] of one parameter from a [`track::LogEstimate`] per log;
//! [`track::apart`] finds the robots of a fleet that differ.
//!
//! ```
//! use cft_ident_fleet::track::{LogEstimate, follow};
//!
//! // friction of a joint, log by log: 2 Nm, and 3 Nm after a repair
//! let estimates: Vec<LogEstimate> = (0..40)
//!     .map(|k| {
//!         let noise = 0.05 * (12.9 * k as f64).sin();
//!         let value = if k < 20 { 2.0 } else { 3.0 } + noise;
//!         LogEstimate { time: k as f64, value, variance: 0.0025 }
//!     })
//!     .collect();
//! let course = follow(&estimates, 0.01);
//! assert_eq!(course.changes.len(), 1);
//! ```

#![forbid(unsafe_code)]

pub mod track;
