//! What the logs hold and what is wrong with them.

use crate::inspect::{Findings, Severity};
use crate::log::escape;
use crate::number;
use crate::report::Writer;

/// Faults that are told; a log with more of them has one cause.
const MOST: usize = 30;

/// A log as it was found, or why it could not be inspected.
pub struct Inspected {
    /// Name of the log.
    pub name: String,
    pub found: Result<Findings, String>,
}

/// The section: every log once, and its faults, the worst first.
pub fn section(page: &mut Writer, logs: &[Inspected], warnings: &[String]) {
    page.heading("Data quality");
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
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
        let count = |severity| found.of(severity).count().to_string();
        let absent = f64::NAN;
        rows.push(vec![
            name.clone(),
            found.rows.to_string(),
            number::significant(found.duration_s, 5),
            number::significant(found.rate_hz.unwrap_or(absent), 5),
            number::percent(found.jitter.unwrap_or(absent)),
            found.gaps.len().to_string(),
            count(Severity::Error),
            count(Severity::Warning),
            count(Severity::Info),
        ]);
        for fault in &found.faults {
            if faults.len() == MOST {
                hidden += 1;
                continue;
            }
            faults.push(vec![
                name.clone(),
                fault.severity.word().to_owned(),
                fault.kind.word().to_owned(),
                fault.channel.as_deref().map(escape).unwrap_or_default(),
                format!("{} s", fault.span()),
                fault.effect.clone(),
                fault.remedy.clone(),
            ]);
        }
    }
    page.rows(
        "logs",
        &[
            "log",
            "rows",
            "duration [s]",
            "rate [Hz]",
            "jitter",
            "gaps",
            "errors",
            "warnings",
            "notes",
        ],
        rows,
    );
    match faults.is_empty() {
        true => page.paragraph("No fault was found in the logs."),
        false => page.rows(
            "faults, the worst of each log first",
            &[
                "log",
                "severity",
                "fault",
                "channel",
                "when",
                "what it is",
                "remedy",
            ],
            faults,
        ),
    }
    if hidden > 0 {
        page.paragraph(&format!("{hidden} more are told by `cft-ident inspect`."));
    }
    if !warnings.is_empty() {
        page.paragraph("Warnings of this run:");
        page.list(warnings);
    }
}
