//! Every stage of an identification as a function of a dataset and a request: what the command line, Python and other
//! programs call.
//!
//! An [`identify::Dataset`] holds a robot and its logs by what they are for. [`identify::lsq()`] fits it, and
//! [`identify::validate()`] tries an [`identify::GivenModel`] on it; [`identify`] lists the other stages. Beside them:
//! [`setup`] looks for mistakes of a robot file, [`band`] makes prediction bands, [`open_loop`] simulates motions,
//! [`observe`] external torques, [`compare`] sets models side by side, [`replay`] runs models along logs for figures.
//!
//! ```
//! use cft_ident_files::config::RobotFile;
//! use cft_ident_stages::identify::{Control, Dataset, Log, RobotSetup, LsqSettings, lsq};
//!
//! let robot = "robot = { model = \"single-joint\", joint = \"slide\", kind = \"prismatic\" }\n\
//!     friction = { law = \"viscous-coulomb\", fitted_with_inertias = true }";
//! let robot = RobotSetup::new("slide.toml", RobotFile::parse("slide.toml", robot)?);
//! // 3 kg, 5 N s/m and 2 N along two sines
//! let t: Vec<f64> = (0..4000).map(|k| 0.002 * f64::from(k)).collect();
//! let waves = [(0.1_f64, 2.1_f64), (0.02, 7.3)];
//! let sum = |t: f64, of: &dyn Fn(f64, f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w, t)).sum::<f64>();
//! let q: Vec<f64> = t.iter().map(|t| sum(*t, &|a, w, t| a * (w * t).sin())).collect();
//! let force = |t: &f64| {
//!     let v = sum(*t, &|a, w, t| a * w * (w * t).cos());
//!     3.0 * sum(*t, &|a, w, t| -a * w * w * (w * t).sin()) + 5.0 * v + 2.0 * v.signum()
//! };
//! let tau: Vec<f64> = t.iter().map(force).collect();
//!
//! let data = Dataset::read(&robot, &[Log::of_rows("monday", &t, &q, &tau)?], &Control::default())?;
//! let found = lsq(&data, &LsqSettings::default(), &Control::default())?;
//! assert!((found.unknowns[0].fitted - 3.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod band;
mod campaign;
pub mod compare;
mod find;
mod fit;
mod fleet;
mod held_out;
pub mod identify;
mod input;
mod note;
pub mod observe;
pub mod open_loop;
pub mod replay;
pub mod setup;
mod watch;
