//! What keeps held poses from being fitted.

use cft_ident_core::explain::Explain;
use cft_ident_files::config::ConfigError;
use cft_ident_logs::log::LogError;
use thiserror::Error;

/// Why gravity cannot be found.
#[derive(Debug, Explain, Error)]
pub enum HeldError {
    #[explain(source.explanation())]
    Log {
        #[from]
        source: LogError,
    },
    #[explain(source.explanation())]
    Config {
        #[from]
        source: ConfigError,
    },
    #[explain(
        "{logs}: {poses} poses are held, and {least} are the least",
        "stop at each pose for a second, or give one row for each pose; `cft-ident excite --static 24 -r ROBOT.toml -o POSES.toml` proposes them"
    )]
    TooFew {
        logs: String,
        poses: usize,
        least: usize,
    },
    #[explain(
        "{log}: `sign = \"hang\"` in [log] takes the sign of each current from the side on which the joint hangs off its command, and {joint} has no command",
        "name the command's column: `reference = \"..\"` in [log.joint.{joint}]"
    )]
    NoCommand { log: String, joint: String },
    #[explain(
        "{log}: {joint} never hangs off its command by more than a step of its encoder: its current has no sign",
        "log the signed current, or lower the controller's stiffness until the joint hangs"
    )]
    NeverHangs { log: String, joint: String },
    #[explain(
        "gravity does not move any joint of this robot: {robot}",
        "check `gravity` in [robot], and the axes of the joints"
    )]
    NoGravity { robot: String },
    #[explain(
        "the poses determine none of the parameters of gravity",
        "hold poses in which links stand out level and upright: `cft-ident excite --static 24 -r ROBOT.toml -o POSES.toml`"
    )]
    NothingDetermined,
    #[explain(
        "gravity explains nothing of these torques: {left} of {joint} is left",
        "check units and signs of the torques in [log.joint], and `gravity` in [robot]"
    )]
    NotGravity { joint: String, left: String },
}
