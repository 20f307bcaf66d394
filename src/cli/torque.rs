//! `cft-ident torque`: feed-forward torque along a recorded or planned motion.

use std::path::{Path, PathBuf};

use super::{CliError, Context, Outcome, arguments, files};
use cft_ident_core::number;
use cft_ident_logs::log::LogSpec;
use cft_ident_logs::output::LogWriter;
use cft_ident_report::report::json::Document;
use cft_ident_report::report::table::{Align, Table};
use cft_ident_stages::identify::{self, Log, LoggedRobot, refined};

const EXAMPLE: &str = "\
Example:
  cft-ident torque unseen.csv -m model.toml -o feedforward.csv";

/// Write the feed-forward torque along a motion, with its prediction band.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident torque [OPTIONS] -m MODEL.toml -o OUT.csv|.mcap LOG")]
pub struct Args {
    /// Log or trajectory of q; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(value_name = "LOG")]
    pub log: LogSpec,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Log to write
    #[arg(short, long, value_name = "OUT.csv|.mcap", value_parser = arguments::log_file)]
    pub output: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs: [&Path; 2] = [&args.log.path, &args.model];
    context.check_outputs(&inputs, &[args.output.as_path()])?;
    let given = files::model(&args.model, context)?;
    let (name, file) = (given.name, given.value);
    let refined = refined(&file, &name)?;
    let machine = LoggedRobot::new(&name, file.robot.clone());
    let joints = machine.robot.joint_names();
    let named = |kind: &'static str| joints.iter().map(move |j| format!("{kind}_{j}"));
    let band = match file.held_out.is_empty() {
        true => Vec::new(),
        false => vec!["band_lower", "band_upper"],
    };
    let n = joints.len();
    let columns: Vec<String> = std::iter::once("t".to_owned())
        .chain(named("tau"))
        .chain(named("tau_std"))
        .chain(band.into_iter().flat_map(named))
        .collect();
    let mut out = LogWriter::create(&args.output, &columns)?;
    let mut failed = None;
    let found = identify::torque(
        &machine,
        (&file, &refined),
        &Log::from(&args.log),
        context.control(),
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
        ("joint", Align::Left),
        ("rms", Align::Decimal),
        ("peak", Align::Decimal),
        ("unit", Align::Left),
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
    let document = Document::new("torque", &found.inputs, &found.warnings, &found.along)?;
    context.files().add_log(out)?;
    let written = format!("written: {}", args.output.display());
    Ok(Outcome {
        text: context.text(format!("{table}{written}\n"), &written),
        document,
        missed: Vec::new(),
    })
}
