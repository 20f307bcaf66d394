//! `cft-ident torque`: feed-forward torque along a recorded or planned motion.

use std::path::{Path, PathBuf};

use super::excite::LADDER_S;
use super::{CliError, Context, Outcome, arguments, columns_of, files, written};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{LogSpec, Provenance, escape};
use cft_ident_logs::output::LogWriter;
use cft_ident_plant::excite::{self, ExciteError, Motion};
use cft_ident_report::report::Report;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::sections::provenance;
use cft_ident_report::report::table::{CellAlignment, Table};
use cft_ident_stages::identify::{self, Log};

const EXAMPLE: &str = "\
Example:
  cft-ident torque unseen.csv -m model.toml -o feedforward.csv
  cft-ident torque motion.toml -m model.toml -o feedforward.csv";

/// Write the feed-forward torque along a motion, with its prediction band.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident torque [OPTIONS] -m MODEL.toml -o OUT.csv|.mcap LOG|MOTION.toml")]
pub struct Args {
    /// Log or trajectory (.toml, .csv) of q; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(value_name = "LOG|TRAJECTORY.toml")]
    pub log: LogSpec,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Log to write
    #[arg(short, long, value_name = "OUT.csv|.mcap", value_parser = arguments::log_file)]
    pub output: PathBuf,
    /// Write the same as a page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

/// Rate of a planned motion where the robot file names none \[Hz\].
const RATE_HZ: f64 = 1000.0;
/// Most samples of one: it is held in memory.
const MOST_ROWS: f64 = 1e7;

/// A trajectory file as a log of positions, and its entry among the inputs.
fn planned(
    path: &Path,
    (name, file): (&str, &ModelFile),
    context: &Context,
) -> Result<(Log, Option<Provenance>), CliError> {
    let given = files::trajectory(path)?;
    let robot = excite::machine(&file.robot, Some((name, file)))?;
    let motion = Motion::of_file(&robot, &given.value, LADDER_S, 1)?;
    let rate = file.robot.control.rate_hz.unwrap_or(RATE_HZ);
    let rows = (motion.seconds() * rate + 1e-6).floor() + 1.0;
    if rows > MOST_ROWS {
        let [s, hz] = [motion.seconds(), rate].map(|x| number::significant(x, 4));
        let text = format!(
            "{}: {s} s at {hz} Hz are more than {MOST_ROWS:e} samples",
            given.name
        );
        return Err(
            CliError::input(text).hint("give a shorter motion, or a lower `rate_hz` in [control]")
        );
    }
    let n = robot.coordinates();
    let (mut t, mut q) = (Vec::new(), Vec::new());
    for k in 0..rows as usize {
        if k % 4096 == 0 {
            context.check()?;
        }
        let at = k as f64 / rate;
        let state = robot.joints(&motion.at(at)).map_err(ExciteError::Robot)?;
        t.push(at);
        q.extend(&state.q[..n]);
    }
    let log = Log::of_rows(&given.name, &t, &q, &[])?;
    Ok((log, Some(given.provenance)))
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let outputs = args.report.iter().chain([&args.output]).map(|path| &**path);
    context.check_outputs([&*args.log.path, &*args.model], outputs)?;
    let given = files::model(&args.model, context)?;
    let (name, file) = (&given.value.name, &given.value.file);
    let joints = given.value.file.robot.joint_names();
    let n = joints.len();
    let kinds = ["tau", "tau_std", "band_lower", "band_upper"];
    let kinds = &kinds[..if file.held_out.is_empty() { 2 } else { 4 }];
    let columns = columns_of(kinds, &joints);
    let (log, trajectory) = match args.log.path.extension().is_some_and(|end| end == "toml") {
        true => planned(&args.log.path, (name, file), context)?,
        false => (Log::from(&args.log), None),
    };
    let mut out = LogWriter::create(&args.output, &columns)?;
    let mut failed = None;
    let found = identify::torque(
        &given.value,
        &log,
        &context.control,
        &mut |t, values, origin| {
            if failed.is_none() {
                out.set_origin(origin);
                let (plain, half) = values.split_at(2 * n);
                let limits = [-1.0, 1.0].into_iter().flat_map(|sign| {
                    let both = plain.iter().zip(half);
                    both.map(move |(tau, half)| tau + sign * half)
                });
                let plain = plain.iter().copied();
                failed = out.row(std::iter::once(t).chain(plain).chain(limits)).err();
            }
        },
    )?;
    if let Some(error) = failed {
        return Err(error.into());
    }
    let mut table = Table::new(&[
        ("joint", CellAlignment::Left),
        ("rms", CellAlignment::Decimal),
        ("peak", CellAlignment::Decimal),
        ("unit", CellAlignment::Left),
    ])
    .caption(&format!("torque of {} along {}", name, args.log.name()));
    for joint in &found.along.joints {
        table.row([
            joint.joint.as_str(),
            &number::significant(joint.rms, 4),
            &number::significant(joint.peak, 4),
            &joint.unit,
        ]);
    }
    let mut inputs = found.inputs.clone();
    inputs.splice(0..0, trajectory);
    let document = JsonDocument::new("torque", &inputs, &found.notes, &found.along)?;
    context.files.add_log(out)?;
    let mut report = Report::new(&format!("Torque along {}", escape(&args.log.name())));
    report.everywhere().table(table);
    if let Some(path) = &args.report {
        let page = &mut report.page();
        provenance::section(page, &file.robot, &inputs, &[], None, &context.command);
        context.write_text(path, &report.html())?;
        written(&mut report, path);
    }
    let line = format!("written: {}", args.output.display());
    report.terminal().line(&line);
    report.brief().verdict(&line, true);
    Ok(Outcome::new(report.text_for(context.screen), document))
}
