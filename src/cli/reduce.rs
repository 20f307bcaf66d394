//! `cft-ident reduce`: what a fit needs of logs, in a small file.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, arguments, files, logs, outputs, paths_of, setup};
use cft_ident_logs::log::{LogSpec, Provenance, escape};
use cft_ident_report::report::Report;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::table::{CellAlignment, Table};
use cft_ident_stages::identify::{
    self, Dataset, FORMAT, MadeWith, ReducedLogs, RobotSetup, StageNote,
};
use cft_ident_stages::setup::Finding;

const EXAMPLE: &str = "\
Example:
  cft-ident reduce identification.csv -r robot.toml -m friction.toml -o a.cfi
  cft-ident reduce unseen.csv -r robot.toml -m friction.toml -o b.cfi
  cft-ident reduce a.cfi b.cfi -r robot.toml -m friction.toml -o all.cfi";

/// Reduce logs to what a linear fit needs of them: a small file that stands where `lsq` and
/// `validate` take a log.
///
/// From it `lsq` fits by `wls`; the other estimators and everything that
/// looks at single rows need the logs. Friction that a model gives with -m is held. Reduced logs may be
/// merged: give them instead of logs.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident reduce [OPTIONS] -r ROBOT.toml -o PART.cfi LOG...")]
pub struct Args {
    /// Logs, or reduced ones to merge; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/emps.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// Model file that holds the friction; left out where friction is fitted with the inertias
    #[arg(short, long, value_name = "FRICTION.toml")]
    pub model: Option<PathBuf>,
    /// File of reduced logs to write
    #[arg(short, long, value_name = "PART.cfi", value_parser = arguments::ends_in(["cfi"]))]
    pub output: PathBuf,
    #[command(flatten)]
    pub setup: setup::SetupArgs,
}

/// What a file of reduced logs holds.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Reduced")]
pub struct ReducedFile {
    /// Number of the file's format.
    format: u32,
    /// What the logs were reduced with.
    made_with: MadeWith,
    /// The logs, in the order of their checksums.
    logs: Vec<LogInFile>,
    /// Size of the file.
    bytes: u64,
    /// What the torques say against the set-up that the robot file declares.
    setup: Vec<Finding>,
}

/// One log in the file.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct LogInFile {
    #[serde(flatten)]
    log: Provenance,
    /// First and last time, by the log's own clock [s].
    bounds_s: [f64; 2],
    /// Blocks of time that are kept, from which deviations come.
    blocks: usize,
    /// Filtered, decimated rows.
    rows: u64,
    /// What was left out of it or mended.
    faults: Vec<String>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let outputs = outputs::listed(Some(&args.output), &[], args.setup.fix_setup.as_deref());
    context.check_outputs(paths_of(&args.logs), outputs)?;
    let robot = files::robot(Path::new(&args.robot))?;
    let setup = RobotSetup::new(&args.robot, robot.value);
    let friction = files::friction("reduce", args.model.as_deref(), &setup.file, context)?;
    let known = friction.as_ref().map(|model| &model.value);
    let data = Dataset::read(&setup, &logs(&args.logs)?, &context.control)?;
    let robot = Path::new(&args.robot);
    let checked = setup::checked(data, (robot, &[]), &args.setup, context)?;
    let setup = &checked.setup;
    let found = identify::reduce(&setup.data, known, &context.control)?;
    context.check()?;
    let bytes = found.to_bytes().map_err(identify::IdentifyError::from)?;
    let result = ReducedFile {
        format: FORMAT,
        made_with: (found.made_with().cloned())
            .ok_or_else(|| CliError::usage("no log is given"))?,
        logs: found.logs().iter().map(|log| in_file(log)).collect(),
        bytes: bytes.len() as u64,
        setup: setup.report.findings.clone(),
    };
    let of_logs = found.logs().iter().flat_map(|log| &log.notes);
    let notes: Vec<&StageNote> = setup.notes.iter().chain(of_logs).collect();
    let inputs: Vec<Provenance> = found.logs().iter().map(|l| l.provenance.clone()).collect();
    let document = JsonDocument::new("reduce", &inputs, &notes, &result)?;
    checked.write(context)?;
    context.files.write(&args.output, &bytes)?;
    Ok(Outcome::new(
        report(&found, &result, args).text_for(context.screen),
        document,
    ))
}

fn in_file(log: &identify::ReducedLog) -> LogInFile {
    LogInFile {
        log: log.provenance.clone(),
        bounds_s: log.bounds_s,
        blocks: log.blocks(),
        rows: log.summary.rows,
        faults: log.notes.iter().map(ToString::to_string).collect(),
    }
}

fn report(found: &ReducedLogs, result: &ReducedFile, args: &Args) -> Report {
    let columns = [
        ("log", CellAlignment::Left),
        ("samples", CellAlignment::Right),
        ("duration [s]", CellAlignment::Decimal),
        ("rows", CellAlignment::Right),
        ("blocks", CellAlignment::Right),
    ];
    let mut table = Table::new(&columns).caption("reduced logs");
    for log in found.logs() {
        let p = &log.provenance;
        let span = p.span.as_ref().map(|span| format!("@{span}"));
        table.row(vec![
            format!("{}{}", escape(&p.name), span.unwrap_or_default()),
            p.samples.to_string(),
            format!("{:.1}", p.duration_s),
            log.summary.rows.to_string(),
            log.blocks().to_string(),
        ]);
    }
    let mut report = Report::new("Reduced logs");
    let mut terminal = report.terminal();
    terminal.table(table);
    terminal.line("");
    terminal.paragraph(
        "From these `lsq` fits by wls, and `validate` tells the errors of \
         models that are linear in their columns; ols, irls, iv, oe and everything that looks at single rows \
         need the logs.",
    );
    let (file, size) = (args.output.display(), result.bytes.div_ceil(1000));
    let written = format!("written: {file} ({size} kB)");
    terminal.line(&written);
    report.brief().verdict(&written, true);
    report
}
