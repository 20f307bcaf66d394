//! The page of `compare`.

use super::super::compare::{apart_table, error_table, parameter_table};
use super::super::{CliError, Context};
use crate::cli::pictures::inspected;
use crate::identify::Compared;
use crate::log::{LogSpec, Provenance, escape};
use crate::report::sections::torque::Drawn;
use crate::report::sections::{Look, provenance, quality, torque};
use crate::report::{Report, TraceStyle, Writer};

/// What the page is made from.
pub struct Compare<'a> {
    pub of: &'a Compared,
    pub logs: &'a [&'a LogSpec],
    /// Names of the logs.
    pub title: &'a str,
    /// Both model files and the logs.
    pub read: &'a [Provenance],
    /// Absent where no log is given.
    pub look: Option<Look<'a>>,
}

/// The page as a file.
///
/// # Errors
/// Interruption, and stretches that are too short for the filter.
pub fn compare(page: &Compare, context: &Context) -> Result<String, CliError> {
    let Compare { of, logs, .. } = *page;
    let read = page.read;
    let title = format!("{} and {}", of.name(0), of.name(1));
    let mut report = Report::new(&format!("Comparison of {title}"));
    let mut out = report.page();
    out.verdict(&of.words(), of.warnings.is_empty());
    out.list(&of.warnings);
    if let Some(tried) = &of.tried {
        out.table(error_table(tried, &of.machine, page.title));
        used_before(&mut out, of, &tried.held.inputs);
    }
    out.heading("Parameters");
    if !of.table.parameters.is_empty() {
        out.table(parameter_table(of));
    }
    for table in [0, 1].into_iter().filter_map(|side| apart_table(of, side)) {
        out.table(table);
    }
    if !of.curves.is_empty() {
        out.heading("Friction");
        out.figure(&of.figure().svg());
    }
    if let Some(look) = &page.look {
        let models = [
            Drawn {
                names: ["A", "residual of A"],
                styles: [TraceStyle::Before, TraceStyle::Before],
                model: &of.sides[0].model,
            },
            Drawn {
                names: ["B", "residual of B"],
                styles: [TraceStyle::Model, TraceStyle::After],
                model: &of.sides[1].model,
            },
        ];
        let all: Vec<usize> = (0..logs.len()).collect();
        torque::section(&mut out, look, &all, &models, page.title).map_err(CliError::input)?;
        let found = inspected(logs.iter().copied(), &of.machine, context)?;
        quality::section(&mut out, &found, &[]);
    }
    let summary = of.tried.as_ref().map(|tried| &tried.held.summary);
    let mut made_from: Vec<Provenance> = Vec::new();
    for side in &of.sides {
        made_from.extend(side.given.file.provenance.inputs.iter().cloned());
    }
    made_from.dedup();
    let file = &of.machine.file;
    provenance::section(&mut out, file, read, &made_from, summary, context.command());
    Ok(report.html())
}

/// A log that one of the models was made from favours that model.
fn used_before(page: &mut Writer, of: &Compared, inputs: &[Provenance]) {
    for (letter, side) in ["A", "B"].iter().zip(&of.sides) {
        let made_from = &side.given.file.provenance.inputs;
        let known = |i: &&Provenance| {
            let mut made = made_from.iter().filter(|m| m.samples > 0);
            made.any(|m| m.sha256 == i.sha256)
        };
        let names: Vec<String> = inputs
            .iter()
            .filter(known)
            .map(|i| escape(&i.name))
            .collect();
        if !names.is_empty() {
            page.verdict(
                &format!(
                    "{} was used to make {letter}, unless the spans are apart: it favours {letter}.",
                    names.join(", ")
                ),
                false,
            );
        }
    }
}
