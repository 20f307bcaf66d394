//! What is wrong with logs of drives, and the ways out.

use cft_ident_core::explain::Explain;

#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum DriveError {
    #[explain("{file}: {what}", "{remedy}")]
    File {
        file: String,
        what: String,
        remedy: String,
    },
    #[explain(
        "{file}: joint {joint}: the command never moves",
        "log a motion: steps and sines of the command over the range in which the drive is used"
    )]
    CommandAtRest { file: String, joint: String },
    #[explain(
        "{file}: joint {joint}: the position never moves while the command does",
        "check that the torque is enabled and that the encoder is read, or leave the joint out"
    )]
    PositionAtRest { file: String, joint: String },
    #[explain(
        "{file}: joint {joint}: positions {seen} are no radians: they look like {unit}",
        "{remedy}"
    )]
    Unit {
        file: String,
        joint: String,
        seen: String,
        unit: &'static str,
        remedy: &'static str,
    },
    #[explain(
        "{file}: joint {joint}: the command is in another unit than the position: it moves {ratio} times as far",
        "convert both to radians from the same zero, then read the log again"
    )]
    OtherUnit {
        file: String,
        joint: String,
        ratio: String,
    },
    #[explain(
        "these logs determine no number of {joint}: {why}",
        "log steps and sines of the command at two gains or more"
    )]
    Undetermined { joint: String, why: String },
    #[explain("{what}", "{remedy}")]
    Request { what: String, remedy: String },
}
