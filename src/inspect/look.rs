//! Shows a log, as it stands in its files, to the judge.

use super::channel::Channel;
use super::fault::{Fault, Kind, Severity};
use super::findings::Findings;
use super::judge::{Depth, Judge};
use crate::log::{LogError, RawBlock, RawReader};

/// One column that is looked at: its number, times `factor`, plus `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Place of the column.
    pub column: usize,
    /// Unit of the channel per unit of the column, sign included.
    pub factor: f64,
    /// Added after it.
    pub offset: f64,
    /// What it is.
    pub channel: Channel,
}

/// Which columns of a table are what.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Place of the time, and seconds per unit of it; absent where rows carry their own.
    pub time: Option<(usize, f64)>,
    /// The other columns.
    pub channels: Vec<Planned>,
}

/// Reads a table to its end and says what there is to say; `None` where `stop` asks for it.
///
/// # Errors
/// A file that can no longer be read.
pub fn look(
    log: &mut RawReader,
    plan: &Plan,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Findings>, LogError> {
    if let Some((column, seconds)) = plan.time {
        log.set_time(column, seconds);
    }
    let channels = plan.channels.iter().map(|planned| planned.channel.clone());
    let mut judge = Judge::new(channels.collect(), Depth::Whole);
    let mut block = RawBlock::default();
    while log.read(&mut block)? {
        if stop() {
            return Ok(None);
        }
        for planned in &plan.channels {
            scale(
                &mut block.columns[planned.column],
                planned.factor,
                planned.offset,
            );
        }
        let columns: Vec<&[f64]> = plan
            .channels
            .iter()
            .map(|planned| block.columns[planned.column].as_slice())
            .collect();
        judge.take(&block.t, &columns);
    }
    let mut findings = judge.finish();
    if log.malformed() > 0 {
        let rows = log.malformed();
        findings.faults.insert(
            0,
            Fault {
                kind: Kind::MalformedRows,
                severity: Severity::Error,
                channel: None,
                from_s: 0.0,
                to_s: findings.duration_s,
                rows,
                effect: format!("{rows} rows have more or fewer fields than the header names: a fit refuses the log"),
                remedy: "complete or delete these rows; write decimal points, not commas".to_owned(),
                cut: false,
            },
        );
    }
    if findings.rows < 2 {
        let rows = findings.rows;
        findings.faults.insert(
            0,
            Fault {
                kind: Kind::IncompleteFile,
                severity: Severity::Error,
                channel: None,
                from_s: 0.0,
                to_s: 0.0,
                rows,
                effect: format!("{rows} row(s): nothing can be said, and a fit refuses the log"),
                remedy: "record again, or check the span".to_owned(),
                cut: false,
            },
        );
    }
    for effect in log.breaks() {
        findings.faults.insert(
            0,
            Fault {
                kind: Kind::IncompleteFile,
                severity: Severity::Warning,
                channel: None,
                from_s: findings.duration_s,
                to_s: findings.duration_s,
                rows: 0,
                effect,
                remedy: "copy it again from where it was recorded; a recorder that is killed loses its last chunk".to_owned(),
                cut: false,
            },
        );
    }
    Ok(Some(findings))
}

fn scale(column: &mut [f64], factor: f64, offset: f64) {
    if factor != 1.0 || offset != 0.0 {
        for value in column {
            *value = *value * factor + offset;
        }
    }
}
