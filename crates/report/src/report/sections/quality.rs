//! The contents of the logs and their faults.

use std::fmt::Display;

use crate::report::Writer;
use crate::report::table::Columns;
use cft_ident_logs::inspect::{LogFindings, Severity};
use cft_ident_logs::log::escape;

/// Faults that are reported; a log with more of them has one cause.
const MAX_FAULTS: usize = 30;

/// Cells of a fault's row, and those that may differ where the fault is the same.
const HEADS: [&str; 7] = [
    "log",
    "severity",
    "fault",
    "channel",
    "when",
    "what it is",
    "remedy",
];
const CHANNEL: usize = 3;
const SPAN: usize = 4;

/// Whether two rows are of one fault, on other channels or in other spans.
fn alike(a: &[String], b: &[String]) -> bool {
    let mut cells = a.iter().zip(b).enumerate();
    cells.all(|(cell, (a, b))| a == b || cell == CHANNEL || cell == SPAN)
}

/// Adds an entry to a list in a cell, once.
fn also(cell: &mut String, entry: &str) {
    if !cell.split(", ").any(|known| known == entry) {
        *cell += &format!(", {entry}");
    }
}

/// A log as it was found, or why it could not be inspected.
pub struct InspectedLog {
    /// Name of the log.
    pub name: String,
    pub found: Result<LogFindings, String>,
}

/// The section: every log once, and its faults, the worst first.
pub fn section(page: &mut Writer, logs: &[InspectedLog], warnings: &[impl Display]) {
    page.heading("Data quality");
    let (mut inspected, mut faults) = (Vec::new(), Vec::<Vec<String>>::new());
    let mut hidden = 0;
    for log in logs {
        let name = escape(&log.name);
        let found = match &log.found {
            Ok(found) => found,
            Err(reason) => {
                page.paragraph(&format!("{name} was not inspected: {reason}"));
                continue;
            }
        };
        inspected.push((name.clone(), found));
        for fault in &found.faults {
            let row = vec![
                name.clone(),
                fault.severity.word().to_owned(),
                fault.kind.word().to_owned(),
                fault.channel.as_deref().map(escape).unwrap_or_default(),
                format!("{} s", fault.span()),
                fault.effect.clone(),
                fault.remedy.clone(),
            ];
            if let Some(known) = faults.iter_mut().find(|known| alike(known, &row)) {
                for cell in [CHANNEL, SPAN] {
                    also(&mut known[cell], &row[cell]);
                }
            } else if faults.len() == MAX_FAULTS {
                hidden += 1;
            } else {
                faults.push(row);
            }
        }
    }
    let count = |found: &LogFindings, severity| found.of(severity).count().to_string();
    let columns = Columns::new("logs", &inspected)
        .words("log", |(name, _)| name)
        .words("rows", |(_, of)| of.rows.to_string())
        .digits("duration [s]", 5, |(_, of)| of.duration_s)
        .digits("rate [Hz]", 5, |(_, of)| of.rate_hz)
        .percent("jitter", |(_, of)| of.jitter)
        .words("gaps", |(_, of)| of.gaps.len().to_string())
        .words("errors", |(_, of)| count(of, Severity::Error))
        .words("warnings", |(_, of)| count(of, Severity::Warning))
        .words("notes", |(_, of)| count(of, Severity::Info));
    page.table(columns);
    if faults.is_empty() {
        page.paragraph("No fault was found in the logs.");
    }
    let mut columns = Columns::new("faults, the worst of each log first", &faults);
    for (cell, name) in HEADS.into_iter().enumerate() {
        columns = columns.words(name, |row| &row[cell]);
    }
    page.table_if_any(columns);
    if hidden > 0 {
        page.paragraph(&format!("`cft-ident inspect` lists {hidden} more."));
    }
    if !warnings.is_empty() {
        page.paragraph("Warnings of this run:");
        page.list(warnings);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_fault_on_several_channels_is_one_row() {
        let row = |channel: &str, effect: &str| {
            let cells = [
                "a.csv", "info", "kind", channel, "0..1 s", effect, "mend it",
            ];
            cells.map(String::from)
        };
        let (mut first, second) = (row("q1", "noise"), row("q2", "noise"));
        assert!(alike(&first, &second) && !alike(&first, &row("q1", "gap")));
        also(&mut first[CHANNEL], &second[CHANNEL]);
        also(&mut first[SPAN], &second[SPAN]);
        assert_eq!(
            (first[CHANNEL].as_str(), first[SPAN].as_str()),
            ("q1, q2", "0..1 s")
        );
    }
}
