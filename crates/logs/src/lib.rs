//! Logs of robots: reading, inspecting, mapping and writing.
//!
//! [`log::LogSpec`] names a file and a span of it, [`log::Layout`] says which channels are what, and [`log::Reader`]
//! hands out [`log::Block`]s of t, q and tau in SI units. [`inspect::look`] says what is wrong with a log,
//! [`mapping::look`] what its columns are where nobody has described them, [`output::LogWriter`] writes one.
//!
//! ```
//! use cft_ident_logs::mapping::{LogHints, look};
//! use cft_ident_logs::log::LogSpec;
//!
//! let dir = tempfile::tempdir()?;
//! let file = dir.path().join("monday.csv");
//! let mut text = String::from("time [s],q1 [rad],tau1 [Nm]\n");
//! for k in 0..500 {
//!     let t = 0.01 * k as f64;
//!     text += &format!("{t:.2},{:.6},{:.6}\n", t.sin(), 2.0 * t.cos());
//! }
//! std::fs::write(&file, text)?;
//! let seen = look(&LogSpec::whole(&file), &LogHints::default(), None, &|| false)?;
//! let units: Vec<_> = seen.columns.iter().filter_map(|column| column.unit.as_deref()).collect();
//! assert_eq!(units, ["rad", "Nm"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod inspect;
pub mod log;
pub mod mapping;
pub mod output;
pub mod recording;
