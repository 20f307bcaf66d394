//! `cft-ident identify`: the whole way from logs to a validated model.

use std::path::PathBuf;

const EXAMPLE: &str = "\
Example:
  cft-ident identify
  cft-ident identify campaign.toml -o runs/monday";

/// Run a whole campaign: friction, inertias, validation, and a summary.
///
/// Without a file the built-in campaign of the CFT robot is simulated first, and the result is
/// compared with its truth at the end.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Campaign file: robot, logs by role, settings
    #[arg(value_name = "CAMPAIGN.toml")]
    pub campaign: Option<PathBuf>,
    /// Folder to write into [default: runs/ and the campaign's name]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Seed of the simulation and of the starting points [default: the campaign's]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}
