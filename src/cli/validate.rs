//! `cft-ident validate`: the torque of a log that was not used, reconstructed by a model.

use std::path::PathBuf;

use super::arguments;
use crate::log::LogSpec;

const EXAMPLE: &str = "\
Example:
  cft-ident validate unseen.csv -m model.toml --plot unseen.svg
  cft-ident validate unseen.csv -m model.toml --max-relative-error 0.02";

/// Reconstruct the torque of logs that were not used, and say how far it is off.
///
/// The model file carries its robot and the processing that it was made with.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// End with status 1 when a joint's relative error is above X, a fraction
    #[arg(long, value_name = "X", value_parser = arguments::positive)]
    pub max_relative_error: Option<f64>,
    /// Write measured and reconstructed torque and the residual
    #[arg(short, long, value_name = "RESIDUAL.csv", value_parser = arguments::csv_file)]
    pub output: Option<PathBuf>,
    /// Draw measured and reconstructed torque; may be given more than once
    #[arg(long, value_name = "FILE.svg", value_parser = arguments::svg_file)]
    pub plot: Vec<PathBuf>,
}
