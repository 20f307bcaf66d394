//! `cft-ident torque`: feed-forward torque along a recorded or planned motion.

use std::path::PathBuf;

use super::arguments;
use crate::log::LogSpec;

const EXAMPLE: &str = "\
Example:
  cft-ident torque planned.csv -m model.toml -o feedforward.csv";

/// Write the feed-forward torque along a motion, with its prediction band.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Log or trajectory of q; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(value_name = "LOG")]
    pub log: LogSpec,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Log to write
    #[arg(short, long, value_name = "OUT.csv", value_parser = arguments::csv_file)]
    pub output: PathBuf,
}
