//! What keeps wrenches from being analysed.

use cft_ident_core::explain::Explain;
use cft_ident_files::config::ConfigError;
use cft_ident_logs::log::LogError;
use thiserror::Error;

/// Why nothing can be said of a tool.
#[derive(Debug, Explain, Error)]
pub enum ToolError {
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
    #[explain("{file}: no columns of {missing}; there are {found}", remedy)]
    Columns {
        file: String,
        missing: &'static str,
        found: String,
        remedy: &'static str,
    },
    #[explain("{files}: neither orientation nor joint angles", remedy)]
    NoOrientation { files: String, remedy: &'static str },
    #[explain(
        "{file}: row {row}: the quaternion ({columns}) has length {length:.4}, not 1",
        "check which columns are the orientation: qx qy qz qw, each of all rows with length one"
    )]
    Quaternion {
        file: String,
        row: usize,
        columns: String,
        length: f64,
    },
    #[explain(
        "{file}: its orientations are not of the kind of those in the logs before it",
        "give logs of one kind together, the others by themselves"
    )]
    Mixed { file: String },
    #[explain(
        "{file}: row {row}: `{column}` is no number",
        "delete the row, or record it again"
    )]
    NoNumber {
        file: String,
        row: usize,
        column: String,
    },
    #[explain(
        "{poses} has {pose_rows} poses and {wrenches} {wrench_rows} wrenches, and no clock pairs them",
        "give one wrench for each pose, in the same order, or a column of time in both files"
    )]
    RowsDiffer {
        poses: String,
        pose_rows: usize,
        wrenches: String,
        wrench_rows: usize,
    },
    #[explain(
        "{poses} and {wrenches} have no time in common",
        "record both by one clock, or give one wrench for each pose, in the same order and without times"
    )]
    ClocksApart { poses: String, wrenches: String },
    #[explain(
        "{file}: the forces never change",
        "check cable and driver of the sensor, and which topic or columns hold its forces"
    )]
    Silent { file: String },
    #[explain(
        "{rows} rows with wrench and orientation are too few for {unknowns} unknowns",
        "hold at least six poses, the sensor's axes up, down and to the sides"
    )]
    TooFew { rows: usize, unknowns: usize },
    #[explain(
        "the poses are all alike: gravity's direction in the sensor spreads by {degrees:.2} degrees",
        "hold poses in which the sensor points down, up and to two sides: bias and weight look the same in one pose"
    )]
    Alike { degrees: f64 },
    #[explain(
        "no weight explains these forces in any frame: {left} of their change is left at best ({readings})",
        "check that every wrench belongs to its pose (order, clock, delay), and that the orientation is that of the sensor in the base frame\nwhere the arm moved fast, log poses that are held, or give joint angles with --urdf and --frame"
    )]
    Frames { left: String, readings: String },
    #[explain(
        "the centre of gravity would be {centre_m:.2} m away from the sensor: forces and moments are not in N and Nm alike",
        "say the unit of the forces: --force-unit kgf, or `fx [kgf]` in the header; --force-unit N where it is N and the tool is that long"
    )]
    Units { centre_m: f64 },
    #[explain(
        "{file}: `{column}` states the unit `{unit}`, which is none of {kind}",
        "write {known}"
    )]
    Unit {
        file: String,
        column: String,
        unit: String,
        kind: &'static str,
        known: &'static str,
    },
    #[explain(
        "{file}: no frame or link `{frame}`; there are {known}",
        "name one of these with --frame"
    )]
    Frame {
        file: String,
        frame: String,
        known: String,
    },
    #[explain(
        "{file}: no column of joint {joint}; there are {found}",
        "name columns by the joints of the URDF: {joint}, q_{joint}, or a JointState"
    )]
    Joint {
        file: String,
        joint: String,
        found: String,
    },
    #[explain(
        "{file}: no topic of wrenches; the topics are {topics}",
        "name it with --wrench TOPIC"
    )]
    NoTopic { file: String, topics: String },
    #[explain(
        "--urdf needs the frame of the sensor",
        "name the link of the URDF that the sensor is: --frame tool0"
    )]
    FrameNeeded,
    #[explain(
        "the model is that of {what}, and cannot be read: {problem}",
        "write it again with `cft-ident tool`"
    )]
    File { what: String, problem: String },
}
