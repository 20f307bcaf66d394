//! What is known of a log in the end.

use serde::Serialize;

use super::channel::Role;
use super::excitation::JointMotion;
use super::fault::{Fault, Severity};

/// A log as it was found.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Findings {
    /// Rows.
    pub rows: u64,
    /// Time from the first to the last row [s].
    pub duration_s: f64,
    /// One over the median step [Hz]; absent where there is none.
    pub rate_hz: Option<f64>,
    /// Half the range that the middle 90 % of the steps take, over the median step.
    pub jitter: Option<f64>,
    /// Steps longer than 2.5 median ones.
    pub gaps: Vec<Gap>,
    /// The channels, in the order of the columns.
    pub channels: Vec<ChannelFacts>,
    /// What the joints do, in the order of their position channels.
    pub joints: Vec<JointMotion>,
    /// What is wrong, the worst first, then in the order of time.
    pub faults: Vec<Fault>,
    /// Rows that a fit leaves out: first and last time, by the log's own clock [s], in order and
    /// apart.
    #[serde(skip)]
    pub cuts: Vec<[f64; 2]>,
}

/// A stretch without rows, counted from the log's first row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// Last row before it [s].
    pub from_s: f64,
    /// First row after it [s].
    pub to_s: f64,
}

/// One channel in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelFacts {
    /// Name of the column.
    pub name: String,
    /// What it holds.
    pub role: Role,
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

impl Findings {
    /// Brings the faults into their order: the worst first, then by time.
    pub fn sort(&mut self) {
        self.faults.sort_by(|a, b| {
            let severity = b.severity.cmp(&a.severity);
            severity
                .then(a.from_s.total_cmp(&b.from_s))
                .then(a.kind.cmp(&b.kind))
        });
    }

    /// The faults of one severity.
    pub fn of(&self, severity: Severity) -> impl Iterator<Item = &Fault> {
        self.faults
            .iter()
            .filter(move |fault| fault.severity == severity)
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
