//! What can be wrong with a log, and the way out. Lines count from 1; names from files are escaped.

use cft_ident_core::explain::Explain;
use thiserror::Error;

/// An error in a log or in the way it was asked for.
///
/// Files and folders are shown as the user named them; `at` is a file with the line or the message in
/// it, whose count begins at 1, a `remedy` says what to do.
#[derive(Debug, Clone, Explain, Error)]
pub enum LogError {
    /// Reading was stopped.
    #[explain("interrupted")]
    Interrupted,
    /// A span that makes no sense.
    #[explain(
        "`{spec}`: the span after @ cannot be used: {reason}",
        "write FILE@0..70% or FILE@15.2..23s"
    )]
    Span { spec: String, reason: &'static str },
    /// The system cannot read the file.
    #[explain("{file}: cannot be read: {source}", remedy)]
    Read {
        file: String,
        source: std::sync::Arc<std::io::Error>,
        remedy: String,
    },
    /// The file is of a kind that is not read.
    #[explain("{file}: is {kind}", remedy)]
    Format {
        file: String,
        kind: &'static str,
        remedy: &'static str,
    },
    /// Arrays or a Parquet file that are no table of numbers.
    #[explain(
        "{file}: cannot be read: {problem}",
        "copy it again from where it was recorded, or write it as CSV, a column for each channel"
    )]
    Table { file: String, problem: String },
    /// A part of a recording that is not what was written.
    #[explain(
        "{file}: {part} is damaged: its checksum is {calculated:08x}, not {saved:08x}",
        "copy the file again from where it was recorded, or use the part before it: FILE@0..10s"
    )]
    Damaged {
        file: String,
        part: String,
        /// Checksum in the file.
        saved: u32,
        /// Checksum of what was read.
        calculated: u32,
    },
    /// A database that is no recording, or that cannot be read.
    #[explain(
        "{file}: is no rosbag2 database that can be read: {reason}",
        "check it with `ros2 bag info`"
    )]
    Database { file: String, reason: String },
    /// A folder that is no recording.
    #[explain(
        "{folder}: {problem}",
        "name a file inside this folder, or the folder of one rosbag2 recording"
    )]
    Folder {
        folder: String,
        problem: &'static str,
    },
    /// A recording without messages that hold the robot's channels.
    #[explain("{file}: {problem}", remedy)]
    Topic {
        file: String,
        problem: String,
        remedy: String,
    },
    /// No header line.
    #[explain(
        "{file}: is empty",
        "record again, or check that the recorder closed the file"
    )]
    Empty { file: String },
    /// The first line holds numbers.
    #[explain(
        "{at}: there is no header: the first line holds only numbers",
        "add a line that names the columns, e.g. `t,q_q1,tau_q1`, or give them by number in [log] of the robot file, e.g. `time = 1`"
    )]
    NoHeader { at: String },
    /// A header and fewer than two rows.
    #[explain(
        "{file}: holds {rows} row(s) after its header, which determine nothing",
        "two at least, and some seconds of motion, are needed"
    )]
    TooFewRows { file: String, rows: u64 },
    /// A span with fewer than two rows in it.
    #[explain(
        "{spec}: the span holds {rows} row(s)",
        "the log lasts {duration_s} s: choose a span inside it"
    )]
    EmptySpan {
        spec: String,
        rows: u64,
        /// Time from the first to the last row that was seen [s].
        duration_s: f64,
    },
    /// Arrays whose sizes do not belong together.
    #[explain("{log}: {channel} holds {values} values for {rows} rows", remedy)]
    Shape {
        log: String,
        channel: &'static str,
        values: usize,
        rows: usize,
        remedy: &'static str,
    },
    /// A column that the robot needs.
    #[explain("{at}: column `{column}` ({purpose}) is missing", remedy)]
    MissingColumn {
        at: String,
        column: String,
        purpose: String,
        remedy: String,
    },
    /// A column that is there more than once.
    #[explain(
        "{at}: column `{column}` is named {count} times",
        "rename or delete all but one"
    )]
    RepeatedColumn {
        at: String,
        column: String,
        count: usize,
    },
    /// A header that states another unit than the robot file.
    #[explain(
        "{at}: column `{column}` is in {found}, but is to be read in {declared}",
        remedy
    )]
    Unit {
        at: String,
        column: String,
        /// Unit in the header.
        found: String,
        /// Unit that was declared or assumed.
        declared: String,
        remedy: String,
    },
    /// A header that states a unit which nobody knows.
    #[explain(
        "{at}: column `{column}` is in `{unit}`, which is no unit that is known",
        remedy
    )]
    UnknownUnit {
        at: String,
        column: String,
        unit: String,
        remedy: String,
    },
    /// A row that lists other joints than the first.
    #[explain(
        "{at}: the row does not list the joints of the first row, {names}",
        "part the log where the joints change, or delete these rows"
    )]
    OtherNames { at: String, names: String },
    /// A table of another form.
    #[explain("{at}: column `{column}` holds {what}", remedy)]
    Cells {
        at: String,
        column: String,
        what: &'static str,
        remedy: String,
    },
    /// Columns of times that differ.
    #[explain(
        "{at}: `{column}` is another time than that of the first channel: each channel has a clock of its own",
        "export all channels with one sample time, or interpolate them onto one clock"
    )]
    Clocks { at: String, column: String },
    /// A row with more or fewer fields than the header.
    #[explain(
        "{at}: the row has {found} fields, the header names {expected}",
        remedy
    )]
    Fields {
        at: String,
        found: usize,
        expected: usize,
        remedy: &'static str,
    },
    /// Text where a number is needed.
    #[explain("{at}: column `{column}` holds `{text}`, which is no number", remedy)]
    NotANumber {
        at: String,
        column: String,
        text: String,
        remedy: &'static str,
    },
    /// A line of JSON that is no row.
    #[explain(
        "{at}: {problem}",
        "write one object a line: {{\"t\": .., \"q\": [..], \"tau\": [..]}}, or the columns by their names"
    )]
    JsonLine { at: String, problem: String },
    /// A row of JSON without one of the numbers that are read.
    #[explain(
        "{at}: has no number {key}",
        "write one object a line: {{\"t\": .., \"q\": [..], \"tau\": [..]}}, or the columns by their names"
    )]
    JsonNumber { at: String, key: String },
    /// The input ends within a line.
    #[explain("{at}: the input ends within this line", "what came before it is used")]
    CutLine { at: String },
    /// NaN or infinity.
    #[explain("{at}: column `{column}` holds {text}", remedy)]
    NotFinite {
        at: String,
        column: String,
        text: String,
        remedy: &'static str,
    },
    /// Two rows at one time.
    #[explain(
        "{at}: time stands still at {t} s, with other values than the row before",
        remedy
    )]
    TimeStandsStill {
        at: String,
        /// The time [s].
        t: f64,
        remedy: String,
    },
    /// The same row twice.
    #[explain(
        "{at}: the row repeats the row before it (t = {t} s)",
        "delete duplicate rows: each sample may stand there once"
    )]
    DuplicateRow {
        at: String,
        /// The time [s].
        t: f64,
    },
    /// Time runs backwards.
    #[explain("{at}: time runs backwards, from {before} s to {t} s", remedy)]
    TimeBackwards {
        at: String,
        /// Time of the row before [s].
        before: f64,
        /// Time of this row [s].
        t: f64,
        remedy: String,
    },
    /// A joint that moves though its torque channel is dead.
    #[explain(
        "{file}: torque column `{column}` is 0 in all {rows} rows although {joint} moves",
        "check the channel, or name the right column in the [log] section of the robot file"
    )]
    ZeroTorque {
        file: String,
        column: String,
        joint: String,
        rows: u64,
    },
    /// An actuator position that the robot cannot take.
    #[explain(
        "{at}: the actuator positions {positions} belong to no pose of the robot",
        "check units, homing offsets and column order in [log.actuator]"
    )]
    NoPose {
        at: String,
        /// x_c1..x_c4 [m, m, rad, m].
        positions: String,
    },
    /// A damping without velocities.
    #[explain(
        "{at}: the damping of the controller, kd in [log] torque, acts on velocities and this log has none",
        "name the columns of the velocities, `velocity = ..` in [log.joint]",
        "or give kd = 0, if the controller had no damping"
    )]
    NoVelocities { at: String },
    /// A clock that no log of a robot has.
    #[explain(
        "{log}: {rows} rows in {duration_s:e} s, {rate_hz:.3e} Hz: no recorder is that fast, and the times are in another unit",
        remedy
    )]
    ImpossibleClock {
        log: String,
        rows: u64,
        duration_s: f64,
        rate_hz: f64,
        remedy: String,
    },
    /// A log that ends before its filter has begun.
    #[explain(
        "{log}: lasts {duration_s} s, less than one period of its filter of {cutoff_hz} Hz",
        "record some seconds of motion; or, where the times are in another unit, say it: `time_unit = ..` in [log] of the robot file"
    )]
    ShorterThanFilter {
        log: String,
        duration_s: f64,
        cutoff_hz: f64,
    },
    /// A line or a quoted field without an end.
    #[explain(
        "{at}: a line or a quoted field is longer than {limit} bytes",
        "this is no text log, or a quote is never closed"
    )]
    LongLine { at: String, limit: usize },
}

impl LogError {
    /// Whether a row that lost some of its bytes is refused so.
    pub(super) fn is_of_a_torn_row(&self) -> bool {
        matches!(
            self,
            Self::Fields { .. } | Self::NotANumber { .. } | Self::JsonLine { .. }
        )
    }
}
