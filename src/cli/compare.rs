//! `cft-ident compare`: two models of one robot beside each other, and on the same logs.

use std::path::{Path, PathBuf};

use super::{
    CliError, Context, Outcome, arguments, files, logs_of, names_of, outputs, paths_of, pictures,
};
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_stages::identify;
use cft_ident_stages::replay::ReplayedPair;

const EXAMPLE: &str = "\
Example:
  cft-ident compare model.toml refined.toml
  cft-ident compare model.toml refined.toml unseen.csv --report compare.html";

/// Set two models of one robot side by side.
///
/// Differences of parameters are given in standard deviations; errors on the logs with an interval of their
/// difference. Both models are judged with the log mapping and the filter of the first.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// First model file
    #[arg(value_name = "A.toml")]
    pub a: PathBuf,
    /// Second model file
    #[arg(value_name = "B.toml")]
    pub b: PathBuf,
    /// Logs that both models are tried on; a span is chosen by LOG@0..70%
    #[arg(value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Draw the friction curves over each other; may be given more than once
    #[arg(long, value_name = "FILE.svg", value_parser = arguments::ends_in(["svg"]))]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let both: [&Path; 2] = [&args.a, &args.b];
    let drawn = args.report.is_some() || !args.plot.is_empty();
    let outputs = outputs::listed(None, &args.plot, args.report.as_deref());
    context.check_outputs(paths_of(&args.logs).chain(both), outputs)?;
    let document = |path: &&Path| path.extension().is_some_and(|end| end == "json");
    if let Some(document) = both.into_iter().find(document) {
        let what = format!("{} is a JSON document", document.display());
        return Err(CliError::usage(what).hint(
            "give two model files (.toml); documents are plain JSON, which `jq` or `diff` compares",
        ));
    }
    let a = files::model(&args.a, context)?;
    let b = files::model(&args.b, context)?;
    let models = [a.value, b.value];
    let of = identify::compare(models, &logs_of(&args.logs), &context.control)?;
    if of.curves.is_empty() && !args.plot.is_empty() {
        return Err(
            CliError::input("neither model has a friction law: there is nothing to draw")
                .hint("leave --plot out; --report shows the rest"),
        );
    }
    let mut read = vec![a.provenance, b.provenance];
    if let Some(tried) = &of.tried {
        read.extend(tried.in_memory.inputs.iter().cloned());
    }
    let document = JsonDocument::new("compare", &read, &of.notes, &of.result())?;
    let names = names_of(&args.logs);
    let shown: Vec<String> = names.iter().map(|name| escape(name)).collect();
    let mut report = stages::compare::compare(&of, &shown.join(", "));
    let in_memory = of.tried.as_ref().filter(|_| drawn).map(|t| &t.in_memory);
    let replay = pictures::replay(&of.setup, in_memory, &names)?;
    let replayed = replay.map(|replay| ReplayedPair::new(&replay, &of));
    let replayed = replayed.transpose().map_err(CliError::input)?;
    if args.report.is_some() {
        let quality = pictures::inspected(&args.logs, &of.setup, context)?;
        let (mut page, command) = (report.page(), &context.command);
        let replayed = replayed.as_ref();
        stages::compare::pictures(&mut page, &of, &read, replayed, &quality, command);
    }
    context.check()?;
    if let Some(path) = &args.report {
        context.write_text(path, &report.html())?;
    }
    for path in &args.plot {
        let figure = stages::compare::figure(&of, replayed.as_ref());
        context.write_text(path, &figure.svg())?;
    }
    Ok(Outcome::new(report.text_for(context.screen), document))
}
