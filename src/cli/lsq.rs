//! `cft-ident lsq`: the inertial parameters by linear least squares.

use std::path::PathBuf;

use crate::log::LogSpec;

const EXAMPLE: &str = "\
Example:
  cft-ident lsq id.csv -r configs/cft.toml -m friction.toml -o model.toml
  cft-ident lsq emps_id.csv -r configs/emps.toml -o emps.toml --json -";

/// Fit the inertial parameters by linear least squares, friction taken from a model file.
///
/// Where the robot file says that friction is fitted together with the inertias, -m is left out.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// Model file that holds the friction, as `friction` writes it
    #[arg(short, long, value_name = "FRICTION.toml")]
    pub model: Option<PathBuf>,
    /// How the rows are weighted
    #[arg(long, value_enum, default_value_t = Estimator::Wls)]
    pub estimator: Estimator,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
}

/// The weighting of the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Estimator {
    /// Rows weighted by each joint's noise, in two steps
    Wls,
    /// All rows alike
    Ols,
}
