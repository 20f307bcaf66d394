//! Two runs of one command beside each other, by their JSON documents.

use std::path::Path;

use serde_json::Value;

use crate::cli::{CliError, Context, Outcome};
use cft_ident_files::config;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_report::report::json::Document;
use cft_ident_report::report::stages;
use cft_ident_stages::compare::runs;

/// Lists what differs between two documents.
pub(super) fn run([a, b]: [&Path; 2], context: &Context) -> Result<Outcome, CliError> {
    let (a, b) = (read(a)?, read(b)?);
    let names = [&a, &b].map(|(name, ..)| name.clone());
    let found = runs((&names[0], &a.1), (&names[1], &b.1)).map_err(CliError::input)?;
    let report = stages::diff::diff(&found, &names);
    Ok(Outcome {
        text: report.text_for(context.detail()),
        document: Document::new("diff", &[a.2, b.2], &[], &found)?,
        missed: Vec::new(),
    })
}

fn read(path: &Path) -> Result<(String, Value, Provenance), CliError> {
    let name = escape(&path.to_string_lossy());
    let text = config::text_of_kind(path, config::Wanted::Own)?;
    let value = serde_json::from_str(&text).map_err(|error| {
        CliError::input(format!("{name}:{}: no JSON: {error}", error.line()))
            .hint("give documents that a command wrote with --json FILE")
    })?;
    let file = path.file_name().unwrap_or(path.as_os_str());
    let provenance = Provenance::of_text(&file.to_string_lossy(), &text);
    Ok((name, value, provenance))
}
