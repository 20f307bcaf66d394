//! `cft-ident tool`: what hangs on a wrist force-torque sensor.

use std::path::{Path, PathBuf};

use super::{CliError, Context, Outcome, arguments, each_log_once, paths_of, written};
use cft_ident_core::explain::Explain;
use cft_ident_logs::log::{LogSpec, Provenance, escape};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_tool::tool::{ForceUnit, ToolError, ToolFile, WrenchRequest, analyse, read_wrenches};

const EXAMPLE: &str = "\
Example:
  cft-ident tool poses.csv --wrench wrenches.csv -o tool.toml
  cft-ident tool run.mcap --urdf arm.urdf --frame tool0 -o tool.toml";

/// Find what hangs on a wrist force-torque sensor: bias, weight, centre of gravity, and the inertia where it moves.
///
/// A row holds a wrench and the orientation of the sensor in the base: a quaternion, or joint angles with --urdf and
/// --frame. Poses may be held or a motion; a file without names holds x y z qx qy qz qw, or fx fy fz tx ty tz. In
/// which frame the wrench is logged is asked of the data. Intervals are those of 95 % by the jackknife over blocks of
/// neighbouring poses; drift of the bias, a leaning base, a turned sensor, gains, a cable and taring are named where
/// the data bear them out.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident tool [OPTIONS] -o TOOL.toml LOG...")]
pub struct Args {
    /// Logs with poses and wrenches, or poses and wrenches in a file each
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// File of the wrenches beside the first log, or topic of the wrenches in a recording
    #[arg(long, value_name = "TOPIC|FILE")]
    pub wrench: Option<String>,
    /// URDF of the arm, where the log holds joint angles
    #[arg(long, value_name = "ARM.urdf", requires = "frame", value_parser = arguments::ends_in(["urdf", "xml"]))]
    pub urdf: Option<PathBuf>,
    /// Link or fixed frame of the URDF that the sensor is
    #[arg(long, value_name = "NAME", requires = "urdf")]
    pub frame: Option<String>,
    /// Unit of the forces, where no header states it (N, kN, kgf, lbf); moments are in it times a metre
    #[arg(hide_short_help = true, long, value_name = "UNIT")]
    pub force_unit: Option<ForceUnit>,
    /// Log that is evaluated after everything is decided, instead of blocks left out
    #[arg(long, value_name = "LOG")]
    pub holdout: Vec<LogSpec>,
    /// File to write: bias, mass, centre, effects, with their intervals
    #[arg(short, long, value_name = "TOOL.toml")]
    pub output: PathBuf,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

/// An error of the analysis by its exit status.
pub(super) fn failed(error: ToolError) -> CliError {
    use super::Exit;
    let exit = match error {
        ToolError::TooFew { .. } | ToolError::Alike { .. } => Exit::Undetermined,
        ToolError::FrameNeeded => Exit::Usage,
        _ => Exit::BadInput,
    };
    CliError::new(exit, error.explanation())
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs = paths_of(&args.logs).chain(paths_of(&args.holdout));
    let beside = args.wrench.as_deref().map(Path::new);
    let inputs = inputs.chain(beside).chain(args.urdf.as_deref());
    let outputs = [Some(args.output.as_path()), args.report.as_deref()];
    context.check_outputs(inputs, outputs.into_iter().flatten())?;
    each_log_once(&args.logs, &args.holdout)?;
    let request = |logs: &[LogSpec], wrench: Option<String>| WrenchRequest {
        logs: logs.to_vec(),
        wrench,
        urdf: args.urdf.clone(),
        frame: args.frame.clone(),
        force_unit: args.force_unit,
    };
    let (log, mut inputs) =
        read_wrenches(&request(&args.logs, args.wrench.clone())).map_err(failed)?;
    let held_out = match args.holdout.is_empty() {
        true => None,
        false => {
            // a topic is that of every recording, a file the one beside its log
            let topic = args.wrench.clone().filter(|name| !Path::new(name).exists());
            let (held_out, more) = read_wrenches(&request(&args.holdout, topic)).map_err(failed)?;
            inputs.extend(more);
            Some(held_out)
        }
    };
    if let Some(urdf) = &args.urdf {
        inputs.push(Provenance::of_file(urdf)?);
    }
    context.check()?;
    let found = analyse(&log, held_out.as_ref()).map_err(failed)?;
    let mut warnings = log.notes.clone();
    if !log.unit_is_stated {
        warnings.push(
            "forces are taken as N and moments as Nm, for no header states a unit; --force-unit says another"
                .to_owned(),
        );
    }
    let placed = log.samples.iter().any(|sample| sample.position.is_some());
    if found.motion && !placed {
        warnings.push(
            "the sensor moves and the log does not say where it is, so that its acceleration is not known: all numbers may be off by more than their intervals; hold poses, or log joint states with --urdf and --frame"
                .to_owned(),
        );
    }
    let file = ToolFile::of(&found, &context.command, &inputs);
    let path = escape(&args.output.to_string_lossy());
    let mut report = stages::tool::tool(&found, &file, &path);
    stages::tool::origin(&mut report.page(), &inputs, &context.command);
    context.write_text(&args.output, &file.to_toml().map_err(failed)?)?;
    if let Some(page) = &args.report {
        context.write_text(page, &report.html())?;
    }
    written(&mut report, &args.output);
    let document = JsonDocument::new("tool", &inputs, &warnings, &found)?;
    Ok(Outcome::new(report.text_for(context.screen), document))
}
