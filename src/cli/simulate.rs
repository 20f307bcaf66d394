//! `cft-ident simulate`: a log of the simulated robot, and its truth beside it.

use std::path::PathBuf;

use super::arguments;
use crate::log::LogSpec;

const EXAMPLE: &str = "\
Example:
  cft-ident simulate -r configs/cft.toml --move q4 --seconds 20 -o q4.csv";

/// Simulate the robot under control and write its log.
///
/// The truth (parameters, effects, seed) goes to a file of its own beside the log: LOG's stem with
/// .truth.toml.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// Model file whose parameters are the truth [default: the robot's nominal ones]
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: Option<PathBuf>,
    /// Trajectory that the controller follows
    #[arg(long, value_name = "TRAJECTORY.toml", group = "motion")]
    pub reference: Option<String>,
    /// One-joint experiment: JOINT moves over its range at several speeds, the others are held
    #[arg(long = "move", value_name = "JOINT", group = "motion")]
    pub move_joint: Option<String>,
    /// Log whose volts u_1..u_4 drive the motors, without a controller
    #[arg(long, value_name = "LOG", group = "motion")]
    pub volts: Option<LogSpec>,
    /// Duration [s]
    #[arg(long, value_name = "S", value_parser = arguments::positive)]
    pub seconds: Option<f64>,
    /// Effect that the plant has beyond the model; may be given more than once
    #[arg(long = "effect", value_name = "NAME[:JOINT][:key=value,...]")]
    pub effects: Vec<String>,
    /// Seed of every random number
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Log to write
    #[arg(short, long, value_name = "LOG.csv", value_parser = arguments::csv_file)]
    pub output: PathBuf,
}
