//! `cft-ident validate`: the torque of a log that was not used, reconstructed by a model.

use std::path::PathBuf;

use super::{
    CliError, Context, Outcome, arguments, columns_of, files, logs, names_of, outputs, paths_of,
    pictures, typed, written,
};
use cft_ident_core::number;
use cft_ident_core::validate::{JointError, ReconstructedRow, TorqueErrors};
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_logs::output::LogWriter;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_report::report::table::{CellAlignment, Table};
use cft_ident_stages::identify::{self, Dataset, Log, ValidateSettings};
use cft_ident_stages::open_loop::OpenLoop;

const EXAMPLE: &str = "\
Example:
  cft-ident validate unseen.csv -m model.toml --plot unseen.svg
  cft-ident validate unseen.csv -m model.toml --max-relative-error 0.02";

/// Reconstruct the torque of logs that were not used, and say how far it is off.
///
/// The model file carries its robot and the processing that it was made with.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs, or reduced ones (PART.cfi); a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    #[command(flatten)]
    pub leave_out: arguments::LeaveOut,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// End with status 1 when a joint's relative error is above X, a fraction; on unseen logs where some of
    /// the logs made the model
    #[arg(long, value_name = "X", value_parser = arguments::positive)]
    pub max_relative_error: Option<f64>,
    /// Simulate the motion from the measured torques too, in windows of so many seconds that begin at
    /// measured states, and say by how much positions are off [default: single axes from begin to
    /// end, others 0.25]
    #[arg(hide_short_help = true, long, value_name = "SECONDS", num_args = 0..=1, require_equals = true, value_parser = arguments::positive)]
    pub open_loop: Option<Option<f64>>,
    /// Write measured and reconstructed torque, the residual and the 95 % band
    #[arg(short, long, value_name = "RESIDUAL.csv|.mcap", value_parser = arguments::log_file)]
    pub output: Option<PathBuf>,
    /// Draw measured and reconstructed torque; may be given more than once
    #[arg(hide_short_help = true, long, value_name = "FILE.svg", value_parser = arguments::ends_in(["svg"]))]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

/// Joints that miss a limit on the relative error.
pub fn missed(errors: &TorqueErrors, limit: Option<f64>) -> Vec<String> {
    let Some(limit) = limit else {
        return Vec::new();
    };
    // an error that is not a number is no error within the limit
    let above = |e: &&JointError| e.headline().is_nan() || e.headline() > limit;
    let words = |e: &JointError| {
        let [error, limit] = [e.headline(), limit].map(number::percent);
        format!("{}: error in motion {error} is above {limit}", e.joint)
    };
    errors.joints.iter().filter(above).map(words).collect()
}

fn residual_row(r: &ReconstructedRow, band: bool) -> impl Iterator<Item = f64> {
    let residual = r.measured.iter().zip(r.reconstructed).map(|(a, b)| a - b);
    let torques = r.measured.iter().chain(r.reconstructed).copied();
    let limits = |sign: f64| {
        let half = r.half_width.iter().take(if band { usize::MAX } else { 0 });
        (r.reconstructed.iter().zip(half)).map(move |(tau, half)| tau + sign * half)
    };
    let limits = limits(-1.0).chain(limits(1.0));
    let columns = torques.chain(residual).chain(limits);
    std::iter::once(r.t).chain(columns)
}

fn drifts(found: &OpenLoop) -> String {
    let mut table = Table::new(&[
        ("joint", CellAlignment::Left),
        ("rms", CellAlignment::Decimal),
        ("at the end", CellAlignment::Decimal),
        ("largest", CellAlignment::Decimal),
        ("of the motion", CellAlignment::Decimal),
        ("unit", CellAlignment::Left),
    ])
    .caption(&match found.window_s {
        Some(s) => format!(
            "positions simulated from torques, {} windows of {s} s",
            found.windows
        ),
        None => "positions simulated from torques, from begin to end".to_owned(),
    });
    for joint in &found.joints {
        let [rms, end, largest] =
            [joint.rms, joint.rms_at_end, joint.max_abs].map(|x| number::significant(x, 4));
        let share = number::percent(joint.relative);
        table.row([&joint.joint, &rms, &end, &largest, &share, joint.unit]);
    }
    let astray = match found.astray {
        0 => String::new(),
        count => format!("{count} of them went astray\n"),
    };
    format!("\n{table}{astray}")
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let outputs = outputs::listed(args.output.as_deref(), &args.plot, args.report.as_deref());
    context.check_outputs(paths_of(&args.logs).chain([&*args.model]), outputs)?;
    let given = files::model(&args.model, context)?;
    let (file, model) = (&given.value.file, given.value.numbers()?);
    let machine = given.value.setup();
    let band = !file.held_out.is_empty();
    let kinds = ["tau", "tau_hat", "residual", "band_lower", "band_upper"];
    let kinds = &kinds[..if band { 5 } else { 3 }];
    let columns = columns_of(kinds, machine.robot.joint_names());
    let output = args.output.as_ref();
    let output = output.map(|path| LogWriter::create(path, &columns));
    let mut residual = output.transpose()?;
    let mut failed = None;
    let logs = logs(&args.leave_out.of(&args.logs))?;
    let part = logs.iter().find(|log| matches!(log, Log::Reduced(_)));
    if let Some(part) = part
        && (args.output.is_some() || args.report.is_some() || !args.plot.is_empty())
    {
        let name = escape(&part.name());
        let text = format!("{name} is a reduced log: there are no rows of it to write or to draw");
        return Err(
            CliError::input(text).hint("give the log itself, or leave -o, --plot and --report out")
        );
    }
    let settings = ValidateSettings {
        free_run: true,
        open_loop: args.open_loop,
        ..ValidateSettings::of(&given.value)
    };
    let data = Dataset::read(&machine, &logs, &context.control)?;
    let found = identify::validate(&data, &settings, &context.control, &mut |r, origin| {
        if let Some(file) = &mut residual
            && failed.is_none()
        {
            file.set_origin(origin);
            failed = file.row(residual_row(r, band)).err();
        }
    })?;
    if let Some(error) = failed {
        return Err(error.into());
    }
    let names = names_of(&args.logs);
    let document = JsonDocument::new("validate", &found.inputs, &found.notes, &found)?;
    let model_path = typed::quoted(&args.model.to_string_lossy());
    let unseen = args
        .logs
        .iter()
        .filter(|log| !identify::is_reduced(&log.path));
    let unseen = unseen.take(typed::MAX_LOGS);
    let unseen: String = unseen
        .map(|log| format!(" --holdout {}", typed::quoted(&log.to_string())))
        .collect();
    let next = format!("cft-ident diagnose LOG -m {model_path}{unseen}");
    let of = stages::validate::ValidateReport {
        setup: &machine,
        file,
        model: &model,
        logs: &names,
        found: &found,
        limit: args.max_relative_error,
        given: &given.provenance,
        next: &next,
        uses: &format!("cft-ident export -m {model_path} --c model.h"),
    };
    let mut report = stages::validate::validate(&of);
    if let Some(found) = &found.open_loop {
        report.terminal().line(&drifts(found));
    }
    if args.report.is_some() {
        // pictures are of the rows that the numbers are of
        let smoothed = machine.smoothed_for(&data.logs, &model, &context.control)?;
        let in_memory = pictures::in_memory(&smoothed, &data.logs, context)?;
        let used = match found.by_use {
            Some(_) => identify::used_for(file, &found.inputs),
            None => Vec::new(),
        };
        let mut named = names.clone();
        for (name, _) in named.iter_mut().zip(&used).filter(|(_, used)| **used) {
            *name += " (which made the model)";
        }
        let of_model = (file, &model);
        let replayed = pictures::replayed(&smoothed, in_memory.as_ref(), &named, of_model, &used)?;
        let quality = pictures::inspected(&args.logs, &machine, context)?;
        let mut page = report.page();
        let replayed = replayed.as_ref();
        stages::validate::pictures(&mut page, &of, replayed, &quality, &context.command);
    }
    context.check()?;
    if let Some(path) = &args.report {
        context.write_text(path, &report.html())?;
    }
    for path in &args.plot {
        let figure = stages::validate::figure(&found.validation, &names.join(", "));
        context.write_text(path, &figure.svg())?;
    }
    if let Some(file) = residual {
        context.files.add_log(file)?;
    }
    for path in args.output.iter().chain(&args.plot) {
        written(&mut report, path);
    }
    Ok(Outcome {
        missed: missed(found.judged(), args.max_relative_error),
        ..Outcome::new(report.text_for(context.screen), document)
    })
}
