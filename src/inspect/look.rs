//! Shows a log, as it stands in its files, to the judge.

use super::channel::InspectedChannel;
use super::fault::{FaultKind, LogFault, Severity};
use super::findings::Findings;
use super::judge::{Depth, LogJudge};
use crate::log::{LogError, RawBlock, RawReader};

/// One column that is looked at: its number, times `factor`, plus `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelColumn {
    /// Place of the column.
    pub column: usize,
    /// Unit of the channel per unit of the column, sign included.
    pub factor: f64,
    /// Added after it.
    pub offset: f64,
    /// What it is.
    pub channel: InspectedChannel,
}

/// Which columns of a table are what.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnPlan {
    /// Place of the time, and seconds per unit of it; absent where rows carry their own.
    pub time: Option<(usize, f64)>,
    /// The other columns.
    pub channels: Vec<ChannelColumn>,
}

/// Reads a table to its end and says what there is to say; `None` where `stop` asks for it.
///
/// # Errors
/// A file that can no longer be read.
pub fn look(
    log: &mut RawReader,
    plan: &ColumnPlan,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Findings>, LogError> {
    if let Some((column, seconds)) = plan.time {
        log.set_time(column, seconds);
    }
    let channels = plan.channels.iter().map(|planned| planned.channel.clone());
    let mut judge = LogJudge::new(channels.collect(), Depth::Whole);
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
    let rows = log.malformed();
    if rows > 0 {
        let effect = format!(
            "{rows} rows have more or fewer fields than the header names: a fit refuses the log"
        );
        let remedy = "complete or delete these rows; write decimal points, not commas";
        let to_s = findings.duration_s;
        let fault = LogFault::whole(
            Severity::Error,
            FaultKind::MalformedRows,
            to_s,
            effect,
            remedy,
        );
        findings.faults.insert(0, LogFault { rows, ..fault });
    }
    let rows = findings.rows;
    if rows < 2 {
        let effect = format!("{rows} row(s): nothing can be said, and a fit refuses the log");
        let remedy = "record again, or check the span";
        let fault = LogFault::whole(
            Severity::Error,
            FaultKind::IncompleteFile,
            0.0,
            effect,
            remedy,
        );
        findings.faults.insert(0, LogFault { rows, ..fault });
    }
    for effect in log.breaks() {
        let remedy = "copy it again from where it was recorded; a recorder that is killed loses its last chunk";
        let at_s = findings.duration_s;
        let kind = FaultKind::IncompleteFile;
        let fault = LogFault::whole(Severity::Warning, kind, at_s, effect, remedy);
        findings.faults.insert(
            0,
            LogFault {
                from_s: at_s,
                ..fault
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
