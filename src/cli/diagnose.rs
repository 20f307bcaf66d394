//! `cft-ident diagnose`: what the torque residual still holds, and the effect behind it.

use std::path::PathBuf;

use super::{
    CliError, Context, Outcome, arguments, files, logs_of, outputs, pictures, setup, typed,
};
use cft_ident_core::diagnose::{AcceptedEffect, DiagnosisOptions};
use cft_ident_logs::log::LogSpec;
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};
use cft_ident_report::report::sections::{provenance, quality, residual};
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{self, DataFault, Dataset, DiagnoseEnd, DiagnoseSettings};
use cft_ident_stages::replay::ReplayedDiagnosis;

const EXAMPLE: &str = "\
Example:
  cft-ident diagnose identification.csv -m model.toml --holdout unseen.csv
  cft-ident diagnose loaded.csv -m refined.toml --keep -o loaded.toml";

/// Trace the torque residual to effects that the model lacks, add them, and refit.
///
/// Errors are reported before and after on held-out data: the --holdout logs, or blocks
/// that are set aside.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    #[command(flatten)]
    pub leave_out: arguments::LeaveOut,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Log that is never fitted and judges what is added; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub holdout: Vec<LogSpec>,
    /// Effects of your own to try beside the known ones: [[candidate]] tables with formulas in q, v, a, load and t
    #[arg(hide_short_help = true, long, value_name = "FILE.toml")]
    pub candidates: Option<PathBuf>,
    /// Keep the inertial parameters of the given model: finds payload, gain and tilt
    #[arg(long)]
    pub keep: bool,
    /// Leave the friction of the model file as it is; its covariance stays in the deviations
    #[arg(hide_short_help = true, long, conflicts_with = "keep")]
    pub hold_friction: bool,
    /// Search a formula for what is left of each joint; --accept formula:JOINT writes it
    #[arg(long)]
    pub search: bool,
    /// Write this effect whatever the data say, as NAME or NAME:JOINT, a wave with its order as ripple:JOINT:order=12;
    /// may be given more than once
    #[arg(hide_short_help = true, long, value_name = "EFFECT:JOINT")]
    pub accept: Vec<String>,
    /// Write what is named alone, and nothing for prediction only
    #[arg(long)]
    pub named_only: bool,
    /// Go on with the set-up as it is declared, whatever the torques say
    #[arg(hide_short_help = true, long)]
    pub as_declared: bool,
    /// Refined model file to write: the given one, byte for byte, where nothing is added
    #[arg(short, long, value_name = "REFINED.toml")]
    pub output: Option<PathBuf>,
    /// Draw the residual before and after; may be given more than once
    #[arg(hide_short_help = true, long, value_name = "FILE.svg", value_parser = arguments::ends_in(["svg"]))]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let specs = args.logs.iter().chain(&args.holdout);
    let files = [args.model.as_path()]
        .into_iter()
        .chain(args.candidates.as_deref());
    let inputs = specs.clone().map(|l| l.path.as_path()).chain(files);
    let outputs = outputs::listed(args.output.as_deref(), &args.plot, args.report.as_deref());
    context.check_outputs(inputs, outputs)?;
    let given = files::model(&args.model, context)?;
    let file = &given.value.file;
    let mut machine = given.value.setup();
    if args.as_declared {
        machine = machine.as_declared();
    }
    let own = args.candidates.as_deref();
    let own = own.map(files::candidates).transpose()?;
    let settings = DiagnoseSettings {
        model: &given.value,
        keep: args.keep,
        candidates: own.map_or(Vec::new(), |given| given.value),
        hold_friction: args.hold_friction,
        wishes: DiagnosisOptions {
            search: args.search,
            accepted: args
                .accept
                .iter()
                .map(|text| AcceptedEffect::named(text))
                .collect(),
            named_only: args.named_only,
        },
    };
    // before the logs are looked at
    settings.check_candidates(&machine)?;
    let data = Dataset::read(
        &machine,
        &logs_of(&args.leave_out.of(&args.logs)),
        &context.control,
    )?
    .holding_out(&logs_of(&args.holdout), &context.control)?;
    let setup = setup::report(&data, context)?;
    if let (Some(finding), false) = (setup.refusals().next(), args.as_declared) {
        return Err(at_fault(&DataFault::of_setup(finding)));
    }
    let end = identify::diagnose(&data, &settings, &context.control)?;
    let found = match end {
        DiagnoseEnd::Diagnosed(found) => *found,
        DiagnoseEnd::DataFault(fault) if !args.as_declared => return Err(at_fault(&fault)),
        DiagnoseEnd::DataFault(fault) => {
            let mut report = stages::diagnose::data_fault(&fault, &given.provenance);
            if let Some(path) = &args.report {
                let mut page = report.page();
                let found = pictures::inspected(specs, &machine, context)?;
                quality::section(&mut page, &found, &NO_WARNINGS);
                let (inputs, made_from) = ([given.provenance], &file.provenance.inputs);
                let (robot, command) = (&machine.file, &context.command);
                provenance::section(&mut page, robot, &inputs, made_from, None, command);
                context.write_text(path, &report.html())?;
            }
            let result = fault.result().with_setup(setup);
            let document = JsonDocument::new("diagnose", &[], &NO_WARNINGS, &result)?;
            return Ok(Outcome::new(report.text_for(context.screen), document));
        }
    };
    let (inputs, notes) = (&found.in_memory.inputs, &found.in_memory.notes);
    let result = found.result(&machine).with_setup(setup);
    let document = JsonDocument::new("diagnose", inputs, notes, &result)?;
    let refined = found.model(&machine, file);
    let written = args.output.as_ref().unwrap_or(&args.model);
    let of = stages::diagnose::DiagnoseReport {
        setup: &machine,
        file,
        given: &given.provenance,
        found: &found,
        refined: &refined,
        path: &typed::quoted(&written.to_string_lossy()),
        logs: &typed::logs(args.logs.iter().map(LogSpec::to_string)),
    };
    let mut report = stages::diagnose::diagnose(&of);
    context.check()?;
    if !args.plot.is_empty() || args.report.is_some() {
        let replayed =
            ReplayedDiagnosis::new(&machine, &found, &refined).map_err(CliError::input)?;
        if !args.plot.is_empty() {
            let picture = residual::figure(&machine, &replayed.residual).svg();
            for path in &args.plot {
                context.write_text(path, &picture)?;
            }
        }
        if let Some(path) = &args.report {
            let quality = pictures::inspected(specs, &machine, context)?;
            let mut page = report.page();
            stages::diagnose::pictures(&mut page, &of, &replayed, &quality, &context.command);
            context.write_text(path, &report.html())?;
        }
    }
    if let Some(path) = &args.output {
        let unchanged = !found.diagnosis.changes_model();
        match unchanged {
            true => context.write_text(path, &files::text(&args.model)?)?,
            false => files::write_model(path, &refined, context)?,
        }
        let unchanged = match unchanged {
            true => ", the given model byte for byte: nothing is added",
            false => "",
        };
        let written = format!("written: {}{unchanged}", path.display());
        report.terminal().line(&written);
    }
    Ok(Outcome::new(report.text_for(context.screen), document))
}

fn at_fault(fault: &DataFault) -> CliError {
    CliError::input(stages::diagnose::at_fault(fault))
        .hint(fault.remedy.clone())
        .hint("--as-declared goes on without")
}
