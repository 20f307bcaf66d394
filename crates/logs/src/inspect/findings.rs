//! What is known of a log in the end.

use std::cmp::Reverse;

use schemars::JsonSchema;
use serde::Serialize;

use super::detectors::excitation::JointMotion;
use super::fault::{FaultKind, LogFault, Severity};
use super::words::ChannelRole;
use crate::log::{BridgedSample, EvenSpacing, LogError, TimeUnit};
use cft_ident_core::number::significant;

/// What logs hold: of one its findings; of several all of them, with their lists together.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Inspection {
    One(Box<LogFindings>),
    Several(SeveralLogs),
}

/// Several logs as they were found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Several")]
pub struct SeveralLogs {
    /// The slowest [Hz].
    pub rate_hz: Option<f64>,
    /// The worst.
    pub jitter: Option<f64>,
    pub channels: Vec<OfLog<ChannelFacts>>,
    pub gaps: Vec<OfLog<Gap>>,
    pub joints: Vec<OfLog<JointMotion>>,
    pub faults: Vec<OfLog<LogFault>>,
    pub logs: Vec<OfLog<LogFindings>>,
}

/// What belongs to one log of several.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OfLog<T> {
    #[serde(flatten)]
    pub found: T,
    /// Name of the log.
    pub log: String,
}

impl Inspection {
    /// The findings of logs, by their names.
    pub fn of(logs: &[(String, LogFindings)]) -> Self {
        if let [(_, only)] = logs {
            return Inspection::One(Box::new(only.clone()));
        }
        let all = || logs.iter().map(|(_, findings)| findings);
        Inspection::Several(SeveralLogs {
            rate_hz: all().filter_map(|f| f.rate_hz).reduce(f64::min),
            jitter: all().filter_map(|f| f.jitter).reduce(f64::max),
            channels: together(logs, |f| &f.channels),
            gaps: together(logs, |f| &f.gaps),
            joints: together(logs, |f| &f.joints),
            faults: together(logs, |f| &f.faults),
            logs: together(logs, std::slice::from_ref),
        })
    }
}

/// A list of every log in one, each entry with its log's name.
fn together<T: Clone>(
    logs: &[(String, LogFindings)],
    list: impl Fn(&LogFindings) -> &[T],
) -> Vec<OfLog<T>> {
    let mut out = Vec::new();
    for (log, findings) in logs {
        out.extend(list(findings).iter().map(|found| OfLog {
            found: found.clone(),
            log: log.clone(),
        }));
    }
    out
}

/// A log as it was found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Findings")]
pub struct LogFindings {
    /// Rows.
    pub rows: u64,
    /// Time of the first row by the log's own clock [s].
    pub begins_s: f64,
    /// Time from the first to the last row [s].
    pub duration_s: f64,
    /// Rows a second between lost ones [Hz]; absent where there is none.
    pub rate_hz: Option<f64>,
    /// Half the range that the middle 90 % of the steps take, over the median step.
    pub jitter: Option<f64>,
    /// Steps longer than 2.5 median ones.
    pub gaps: Vec<Gap>,
    /// Rate of the rows where the clock is too coarse for them [Hz].
    #[serde(skip)]
    pub even_rate_hz: Option<f64>,
    /// The channels, in the order of the columns.
    pub channels: Vec<ChannelFacts>,
    /// What the joints do, in the order of their position channels.
    pub joints: Vec<JointMotion>,
    /// What is wrong, the worst first, then in the order of time.
    pub faults: Vec<LogFault>,
    /// Rows that a fit leaves out or mends, by their causes, the most first.
    pub costs: Vec<RowCost>,
    /// Rows that a fit leaves out: first and last time [s], in order and apart.
    #[serde(skip)]
    pub cuts: Vec<[f64; 2]>,
    /// Numbers that a fit puts in the place of spikes, in the order of time.
    #[serde(skip)]
    pub bridges: Vec<BridgedSample>,
    /// Times of the rows that a fit leaves out because nothing was read [s].
    #[serde(skip)]
    pub failed: Vec<f64>,
    /// Positions that begin anew though no range is known, by the places of their channels.
    #[serde(skip)]
    pub wraps: Vec<(usize, f64)>,
    /// Torques that are exactly 0 in motion, by the places of their channels: from, to [s].
    #[serde(skip)]
    pub off: Vec<(usize, [f64; 2])>,
    /// Rows for which a sample was held at most.
    #[serde(skip)]
    pub held: Option<usize>,
    /// Rows lie evenly though their stamps do not.
    #[serde(skip)]
    pub even: Option<EvenSpacing>,
}

/// What becomes of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RowFate {
    /// They are not used.
    LeftOut,
    /// Numbers between those of their neighbours stand in their place.
    Bridged,
}

/// How many rows one cause costs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct RowCost {
    pub kind: FaultKind,
    /// Rows, those of several channels at one time counted once.
    pub rows: u64,
    pub fate: RowFate,
}

impl RowCost {
    /// For a person: `999 stuck-channel`, `12 spike (bridged)`.
    pub fn text(&self) -> String {
        let fate = match self.fate {
            RowFate::LeftOut => "",
            RowFate::Bridged => " (bridged)",
        };
        format!("{} {}{fate}", self.rows, self.kind.word())
    }

    /// Brings costs into their order, the most first.
    pub(super) fn sort(costs: &mut [Self]) {
        costs.sort_by_key(|cost| (Reverse(cost.rows), cost.kind));
    }
}

/// A stretch without rows, counted from the log's first row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Gap {
    /// Last row before it [s].
    pub from_s: f64,
    /// First row after it [s].
    pub to_s: f64,
}

/// One channel in numbers.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ChannelFacts {
    /// Name of the column.
    pub name: String,
    /// What it holds.
    pub role: ChannelRole,
    /// Unit of its numbers, where it is known.
    pub unit: Option<String>,
    /// Smallest number; absent where there is none.
    pub min: Option<f64>,
    /// Largest number.
    pub max: Option<f64>,
    /// Rows with a number per second [Hz].
    pub rate_hz: Option<f64>,
    /// Step that all differences of its numbers are multiples of, where there is one.
    pub step: Option<f64>,
    /// Limits by the robot file.
    pub limits: Option<[f64; 2]>,
}

/// Rate that no log of a robot has \[Hz\]: scopes of drives reach half of it. At half it some of those would be
/// refused; at twice it hours that are taken for seconds pass at 50 Hz.
const MAX_RATE_HZ: f64 = 1e5;
/// Fewest rows whose rate is known.
const MIN_CLOCKED_ROWS: u64 = 16;

impl LogFindings {
    /// Refuses a clock that no log of a robot has: the times are in another unit than they were read in.
    ///
    /// # Errors
    /// [`LogError::ImpossibleClock`].
    pub(crate) fn check_clock(&self, log: &str, recording: bool) -> Result<(), LogError> {
        let rate = self.rows.saturating_sub(1) as f64 / self.duration_s;
        if self.rows < MIN_CLOCKED_ROWS || !rate.is_finite() || rate <= MAX_RATE_HZ {
            return Ok(());
        }
        let units = [TimeUnit::Minute, TimeUnit::Hour, TimeUnit::Day].map(TimeUnit::in_seconds);
        let possible = units
            .iter()
            .filter(|(_, seconds)| rate / seconds <= MAX_RATE_HZ);
        let of_unit = |(unit, seconds): &(&str, f64)| {
            let rate = significant(rate / seconds, 3);
            format!("`time_unit = \"{unit}\"` makes it {rate} Hz")
        };
        let possible: Vec<String> = possible.map(of_unit).collect();
        let rate_hz = "or `rate_hz = ..` in place of the times, where rows lie evenly";
        Err(LogError::ImpossibleClock {
            log: log.to_owned(),
            rows: self.rows,
            duration_s: self.duration_s,
            rate_hz: rate,
            remedy: match recording {
                true => format!(
                    "in [log] of the robot file: the other time of messages, `stamp = \"log\"` or `stamp = \"header\"`; {rate_hz}"
                ),
                false => format!(
                    "in [log] of the robot file: {}; {rate_hz}",
                    possible.join(", ")
                ),
            },
        })
    }

    /// Brings the faults into their order: the worst first, then by time.
    pub fn sort(&mut self) {
        self.faults.sort_by(|a, b| {
            let severity = b.severity.cmp(&a.severity);
            severity
                .then(a.from_s.total_cmp(&b.from_s))
                .then(a.kind.cmp(&b.kind))
        });
    }

    /// Puts a fault of the whole log before the others.
    pub(super) fn put_first(
        &mut self,
        (severity, kind): (Severity, FaultKind),
        rows: u64,
        effect: String,
        remedy: &str,
    ) {
        let whole = LogFault::whole(severity, kind, self.duration_s, effect, remedy);
        self.faults.insert(0, LogFault { rows, ..whole });
    }

    /// Gives every fault its time by the log's own clock, which has `zero` where times are 0 [s].
    pub(super) fn count_from(&mut self, zero: f64) {
        self.begins_s += zero;
        self.place();
    }

    /// Gives every fault its time by the log's own clock.
    pub fn place(&mut self) {
        for fault in &mut self.faults {
            fault.log_from_s = self.begins_s + fault.from_s;
            fault.log_to_s = self.begins_s + fault.to_s;
        }
    }

    /// The faults of one severity.
    pub fn of(&self, severity: Severity) -> impl Iterator<Item = &LogFault> {
        let all = self.faults.iter();
        all.filter(move |fault| fault.severity == severity)
    }
}

/// Spans in order, joined where they touch.
pub(super) fn joined(mut spans: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut out: Vec<[f64; 2]> = Vec::with_capacity(spans.len());
    for [from, to] in spans {
        match out.last_mut() {
            Some(last) if from <= last[1] => last[1] = last[1].max(to),
            _ => out.push([from, to]),
        }
    }
    out
}
