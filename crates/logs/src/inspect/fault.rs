//! A fault of a log: what it is, where it is, what it does to a fit, and what to do about it.

use schemars::JsonSchema;
use serde::Serialize;

use crate::log::RowFault;
use cft_ident_core::number::clock;

/// How much a fault matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Worth knowing; a fit is not spoilt by it.
    Info,
    /// A fit goes on, without what is marked bad or with less accuracy.
    Warning,
    /// The log cannot be used as it is.
    Error,
}

impl Severity {
    /// As it is printed.
    pub fn word(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// The file breaks off, or the reader could not use all of it.
    IncompleteFile,
    /// Rows with more or fewer fields than the header.
    MalformedRows,
    /// A channel that the robot file names is not there, or is there twice.
    MissingChannel,
    /// Messages of a second publisher on the same topic, which contradict the others.
    OtherPublisher,
    /// NaN, infinity or no number.
    Nan,
    /// Two rows at one time.
    RepeatedTime,
    /// Time runs backwards.
    BackwardTime,
    /// A step much longer than the others.
    Dropout,
    /// Steps of different lengths.
    IrregularClock,
    /// Rows that show the positions of the row before while the robot moves.
    RepeatedRows,
    /// A stretch that stands in the log before it, number for number.
    RepeatedPart,
    /// A channel that stands still while what it measures does not.
    StuckChannel,
    /// Flat tops of a torque, current or voltage.
    Saturation,
    /// Flat tops of a position or velocity.
    Clipping,
    /// Beyond a limit of the robot file.
    BeyondLimits,
    /// A coarse step of the numbers.
    Quantisation,
    /// Single rows far off their neighbours.
    Spike,
    /// A position that leaps to and fro in more rows than can be spikes.
    Erratic,
    /// Rows in which every channel reads one number, 0 mostly.
    FailedRead,
    /// A channel that is another one's copy.
    CopiedChannel,
    /// A channel that holds what was commanded.
    CommandAsMeasurement,
    /// A channel that belongs to another joint, or has the other sign.
    WrongSignOrOrder,
    /// A velocity channel that is filtered: it lags behind the position's derivative.
    Filter,
    /// Torque and position are not of the same instant.
    Delay,
    /// Rows that hold each sample for several rows.
    SampleAndHold,
    /// A leap of a position that no drive can make, and that stays.
    PositionStep,
    /// A position that begins anew after its range.
    WrappedEncoder,
    /// All channels frozen while the robot moves.
    Stall,
    /// A torque of exactly 0 while the joint moves.
    MotorOff,
    /// A torque that is never below zero while its joint turns both ways.
    UnsignedTorque,
    /// A temperature that leaps as no drive's does.
    TemperatureStep,
}

impl FaultKind {
    /// As it is printed and stands in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::IncompleteFile => "incomplete-file",
            Self::MalformedRows => "malformed-rows",
            Self::MissingChannel => "missing-channel",
            Self::OtherPublisher => "other-publisher",
            Self::Nan => "nan",
            Self::RepeatedTime => "repeated-time",
            Self::BackwardTime => "backward-time",
            Self::Dropout => "dropout",
            Self::IrregularClock => "irregular-clock",
            Self::RepeatedRows => "repeated-rows",
            Self::RepeatedPart => "repeated-part",
            Self::StuckChannel => "stuck-channel",
            Self::Saturation => "saturation",
            Self::Clipping => "clipping",
            Self::BeyondLimits => "beyond-limits",
            Self::Quantisation => "quantisation",
            Self::Spike => "spike",
            Self::Erratic => "erratic",
            Self::FailedRead => "failed-read",
            Self::CopiedChannel => "copied-channel",
            Self::CommandAsMeasurement => "command-as-measurement",
            Self::WrongSignOrOrder => "wrong-sign-or-order",
            Self::Filter => "filter",
            Self::Delay => "delay",
            Self::SampleAndHold => "sample-and-hold",
            Self::PositionStep => "position-step",
            Self::WrappedEncoder => "wrapped-encoder",
            Self::Stall => "stall",
            Self::MotorOff => "motor-off",
            Self::UnsignedTorque => "unsigned-torque",
            Self::TemperatureStep => "temperature-step",
        }
    }

    /// Whether `[log] keep` says that its rows stay as they were logged.
    pub(super) fn kept(self, keep: &[RowFault]) -> bool {
        let of = match self {
            Self::Spike | Self::Erratic | Self::FailedRead => RowFault::Spike,
            Self::StuckChannel => RowFault::StuckChannel,
            Self::Saturation => RowFault::Saturation,
            Self::Clipping => RowFault::Clipping,
            Self::RepeatedRows => RowFault::RepeatedRows,
            Self::SampleAndHold => RowFault::SampleAndHold,
            Self::PositionStep => RowFault::PositionStep,
            Self::WrappedEncoder => RowFault::WrappedEncoder,
            Self::Stall => RowFault::Stall,
            _ => return false,
        };
        keep.contains(&of)
    }
}

/// One fault of a log.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LogFault {
    /// What is wrong.
    pub kind: FaultKind,
    /// How much it matters.
    pub severity: Severity,
    /// The channel, by the name that the log gives it; absent for what concerns all of them.
    pub channel: Option<String>,
    /// Where it begins, counted from the log's first row [s].
    pub from_s: f64,
    /// Where it ends [s].
    pub to_s: f64,
    /// Where it begins and ends by the log's own clock [s].
    pub log_from_s: f64,
    pub log_to_s: f64,
    /// Rows concerned.
    pub rows: u64,
    /// Height of a step, or range of an encoder that begins anew [unit of the channel]; absent for
    /// other kinds.
    pub size: Option<f64>,
    /// What it is in numbers, and what it does to a fit.
    pub effect: String,
    /// What to do about it.
    pub remedy: String,
    /// Whether a fit leaves these rows out.
    #[serde(skip)]
    pub cut: bool,
}

impl LogFault {
    /// A fault of a log from its first row to `to_s` [s], of no rows in particular.
    pub fn whole(
        severity: Severity,
        kind: FaultKind,
        to_s: f64,
        effect: String,
        remedy: &str,
    ) -> Self {
        Self {
            kind,
            severity,
            channel: None,
            from_s: 0.0,
            to_s,
            log_from_s: 0.0,
            log_to_s: to_s,
            rows: 0,
            size: None,
            effect,
            remedy: remedy.to_owned(),
            cut: false,
        }
    }

    /// Where it is by the log's own clock, for a person: `5.000..5.399`, or `5.000` for a single row.
    pub fn span(&self) -> String {
        match self.log_to_s > self.log_from_s {
            true => format!("{}..{}", clock(self.log_from_s), clock(self.log_to_s)),
            false => clock(self.log_from_s),
        }
    }
}

/// Stretches of a log, in the order of time, few enough to be listed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct FaultEpisodes {
    pub(super) list: Vec<FaultEpisode>,
}

/// One stretch: times of its first and last row [s], and how many rows of it are concerned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FaultEpisode {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) rows: u64,
}

/// Stretches that are kept; what comes after them lengthens the last.
const MAX_STRETCHES: usize = 1 << 18;
/// Stretches that are faults of their own; more are one fault from the first to the last.
const LISTED: usize = 12;

impl FaultEpisodes {
    /// Adds rows from `from` to `to`; joined to the last stretch where at most `join` s lie between.
    pub(super) fn add(&mut self, from: f64, to: f64, rows: u64, join: f64) {
        let full = self.list.len() >= MAX_STRETCHES;
        match self.list.last_mut() {
            Some(last) if full || (from >= last.from && from - last.to <= join) => {
                last.to = last.to.max(to);
                last.rows += rows;
            }
            _ => self.list.push(FaultEpisode { from, to, rows }),
        }
    }

    pub(super) fn rows(&self) -> u64 {
        self.list.iter().map(|episode| episode.rows).sum()
    }

    /// As they are reported: one by one, or all as one where there are many.
    pub(super) fn merged(&self) -> Vec<(FaultEpisode, usize)> {
        let (Some(first), true) = (self.list.first(), self.list.len() > LISTED) else {
            return self.list.iter().map(|episode| (*episode, 1)).collect();
        };
        let to = self.list.iter().fold(first.to, |to, e| to.max(e.to));
        let from = self
            .list
            .iter()
            .fold(first.from, |from, e| from.min(e.from));
        let rows = self.rows();
        vec![(FaultEpisode { from, to, rows }, self.list.len())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_stretches_are_joined_and_many_are_reported_as_one() {
        let first =
            |found: &[(FaultEpisode, usize)]| (found[0].0.from, found[0].0.to, found[0].0.rows);
        let mut episodes = FaultEpisodes::default();
        episodes.add(1.0, 1.1, 2, 0.05);
        episodes.add(1.14, 1.2, 1, 0.05);
        episodes.add(2.0, 2.0, 1, 0.05);
        let found = episodes.merged();
        assert_eq!((found.len(), first(&found)), (2, (1.0, 1.2, 3)));
        for k in 0..20 {
            episodes.add(3.0 + f64::from(k), 3.5 + f64::from(k), 4, 0.0);
        }
        let found = episodes.merged();
        assert_eq!((found.len(), found[0].1), (1, 22));
        assert_eq!(first(&found), (1.0, 22.5, 84));
    }

    #[test]
    fn a_kind_is_printed_as_it_stands_in_json() {
        for kind in [
            FaultKind::Nan,
            FaultKind::WrongSignOrOrder,
            FaultKind::RepeatedTime,
            FaultKind::Filter,
        ] {
            let json = serde_json::to_value(kind).unwrap();
            assert_eq!(json, kind.word());
        }
    }
}
