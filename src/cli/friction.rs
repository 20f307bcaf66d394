//! `cft-ident friction`: the friction of single joints from one-joint logs.

use std::path::PathBuf;

use super::arguments;
use crate::log::LogSpec;

const EXAMPLE: &str = "\
Example:
  cft-ident friction q1.csv q2.csv q4.csv q5.csv -r configs/cft.toml -o f.toml
  cft-ident friction q4b.csv -r configs/cft.toml --joint q4 -m f.toml -o g.toml";

/// Estimate the friction of single joints by a continuous-discrete extended Kalman filter.
///
/// Each log is a one-joint experiment: the joint moves over its range at several speeds and with
/// reversals, the others stay nearly still. Several logs of one joint are used together.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// The joint that the logs move [default: found from the data]
    #[arg(long, value_name = "NAME")]
    pub joint: Option<String>,
    /// Model whose other joints are kept
    #[arg(short, long, value_name = "OLD.toml")]
    pub model: Option<PathBuf>,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Draw the friction curves; may be given more than once
    #[arg(long, value_name = "FILE.svg", value_parser = arguments::svg_file)]
    pub plot: Vec<PathBuf>,
    /// Seed of the starting points
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}
