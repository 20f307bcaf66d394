//! What the logs hold and what is wrong with them.

use super::super::{CliError, Context, Exit, inspect};
use crate::identify::LoggedRobot;
use crate::inspect::Severity;
use crate::log::{LogSpec, escape};
use crate::number;
use crate::report::Writer;

/// Faults that are told; a log with more of them has one cause.
const MOST: usize = 30;

/// The section: every log once, and its faults, the worst first.
///
/// # Errors
/// Interruption.
pub fn section(
    page: &mut Writer,
    machine: &LoggedRobot,
    logs: &[&LogSpec],
    warnings: &[String],
    context: &Context,
) -> Result<(), CliError> {
    page.heading("Data quality");
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
    let mut hidden = 0;
    for spec in logs {
        let name = escape(&spec.name());
        let found = match inspect::findings(spec, machine, context) {
            Ok(found) => found,
            Err(error) if error.exit() == Exit::Interrupted => return Err(error),
            Err(error) => {
                page.paragraph(&format!("{name} was not inspected: {}", error.message()));
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
    Ok(())
}
