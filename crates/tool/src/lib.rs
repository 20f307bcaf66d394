//! What hangs on a wrist force-torque sensor, and gravity from held poses.
//!
//! [`tool::read_wrenches`] makes a [`tool::WrenchLog`] of files, [`tool::analyse`] a [`tool::ToolResult`] of it.
//!
//! ```
//! use cft_ident_tool::tool::{WrenchLog, WrenchSample, analyse};
//!
//! // 1 kg in the sensor's origin, turned about x
//! let sample = |k: usize| {
//!     let angle = 0.1 * k as f64;
//!     let (s, c) = (angle / 2.0).sin_cos();
//!     WrenchSample {
//!         t: k as f64,
//!         quaternion: [s, 0.0, 0.0, c],
//!         position: None,
//!         force: [0.5, -9.81 * angle.sin(), -9.81 * angle.cos()],
//!         moment: [0.0; 3],
//!     }
//! };
//! let log = WrenchLog { samples: (0..40).map(sample).collect(), ..WrenchLog::default() };
//! let found = analyse(&log, None)?;
//! assert!((found.number("mass").unwrap() - 1.0).abs() < 1e-9);
//! # Ok::<(), cft_ident_tool::tool::ToolError>(())
//! ```

#![forbid(unsafe_code)]

pub mod held;
pub mod tool;
