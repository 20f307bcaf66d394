//! `cft-ident diff`: two runs of one command beside each other, by their JSON documents.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{CliError, Context, Exit, Outcome};
use cft_ident_files::config;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_report::report::json::Document;
use cft_ident_report::report::stages;
use cft_ident_stages::compare::runs;

const EXAMPLE: &str = "\
Example:
  cft-ident validate unseen.csv -m model.toml --json before.json
  cft-ident validate unseen.csv -m refined.toml --json after.json
  cft-ident diff before.json after.json";

/// List what differs between two runs of one command, by the JSON documents that they wrote.
///
/// Parameters are compared in standard deviations of their difference; errors stand beside each other,
/// and verdicts are listed where they changed. Documents of `friction`, `lsq`, `validate`, `diagnose`
/// and `identify`.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Document of the first run
    #[arg(value_name = "A.json")]
    pub a: PathBuf,
    /// Document of the second run
    #[arg(value_name = "B.json")]
    pub b: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A file that is no such document; documents of two commands.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    context.check_outputs(&[&args.a, &args.b], &[])?;
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let names = [&a, &b].map(|(name, ..)| name.clone());
    let found = runs((&names[0], &a.1), (&names[1], &b.1))
        .map_err(|error| CliError::from_room(Exit::BadInput, &error))?;
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
