//! `cft-ident lsq`: the inertial parameters by linear least squares.

use std::path::{Path, PathBuf};

use super::held::{self, HeldRun};
use super::known_payload::KnownPayload;
use super::setup::CheckedDataset;
use super::{
    CliError, Context, Outcome, arguments, files, logs, names_of, outputs, paths_of, pictures,
    setup, typed,
};
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_logs::log::LogSpec;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::sections::quality::InspectedLog;
use cft_ident_report::report::stages::{self, lsq::LsqReport};
use cft_ident_stages::identify::{self, CurrentGains, Dataset, LsqSettings, RobotSetup, refined};
use cft_ident_stages::replay::ReplayedLogs;

const EXAMPLE: &str = "\
Example:
  cft-ident lsq identification.csv -r robot.toml -m friction.toml -o m.toml
  cft-ident lsq emps_id.csv -r configs/emps.toml -o emps.toml --json -
  cft-ident lsq empty.csv -r arm.toml -o m.toml \\
    --fit-gains loaded.csv:mass=2.8+-0.05
  cft-ident lsq --static poses.csv -r arm.toml -o gravity.toml";

/// Fit the inertial parameters by linear least squares, friction taken from a model file.
///
/// Where the robot file says that friction is fitted together with the inertias, -m is left out.
#[derive(Debug, Clone, clap::Args)]
#[command(visible_alias = "fit", after_help = EXAMPLE, override_usage = "cft-ident lsq [OPTIONS] -r ROBOT.toml -o MODEL.toml LOG...")]
pub struct Args {
    /// Logs, or reduced ones (PART.cfi); a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    #[command(flatten)]
    pub leave_out: arguments::LeaveOut,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// Model file that holds the friction, as `friction` writes it
    #[arg(short, long, value_name = "FRICTION.toml")]
    pub model: Option<PathBuf>,
    /// How parameters are estimated from the rows
    #[arg(long, value_parser = arguments::estimator(), default_value = "wls")]
    pub estimator: EstimatorKind,
    /// Fit the gain of every torque channel too, from a log in which the last link carries a known mass
    /// [kg] besides those without it; with no log given, ratios of gains alone
    #[arg(hide_short_help = true, long, value_name = "LOG:mass=KG[+-STD]", num_args = 0..=1, conflicts_with = "model")]
    pub fit_gains: Option<Option<KnownPayload>>,
    /// Leave the friction of the model file as it is; its covariance stays in the deviations
    #[arg(hide_short_help = true, long, requires = "model")]
    pub hold_friction: bool,
    /// The plain fit alone: no physically consistent parameters beside it, which torques are computed with
    #[arg(hide_short_help = true, long)]
    pub unconstrained: bool,
    /// Then fit a single axis to the motion that its torques make, in windows of so many seconds that begin
    /// at measured states [default: blocks set aside choose the length]
    #[arg(hide_short_help = true, long, value_name = "SECONDS", num_args = 0..=1, require_equals = true,
          value_parser = arguments::positive, conflicts_with_all = ["model", "fit_gains"])]
    pub open_loop: Option<Option<f64>>,
    /// The logs hold poses, each reached from both sides, or a row for each pose: gravity, friction at rest and ratios
    /// of gains are fitted to their means
    #[arg(long = "static", conflicts_with_all = ["model", "fit_gains", "open_loop", "unconstrained", "estimator", "leave_out", "fix_setup", "as_declared"])]
    pub held: bool,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub setup: setup::SetupArgs,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    if args.held {
        return held::run(&args.held_run(), context);
    }
    args.check_outputs(context)?;
    let robot = files::robot(Path::new(&args.robot))?;
    let friction = files::friction("lsq", args.model.as_deref(), &robot.value, context)?;
    let (checked, gains) = args.checked(robot.value, context)?;
    let settings = LsqSettings {
        estimator: args.estimator,
        consistent: !args.unconstrained && args.open_loop.is_none(),
        consistent_whatever: false,
        friction: friction.as_ref().map(|model| &model.value),
        hold_friction: args.hold_friction,
        open_loop: args.open_loop,
        gains: gains.as_ref(),
    };
    let (found, mut model) = checked.setup.lsq(&settings, &context.control)?;
    if args.open_loop.is_some() && !args.unconstrained {
        identify::project(&mut model)?;
    }
    let document = JsonDocument::new("lsq", &found.inputs, &found.notes, &found)?;
    let of = LsqReport {
        setup: &checked.setup.data.setup,
        found: &found,
        file: &model,
        path: &typed::quoted(&args.output.to_string_lossy()),
        logs: &names_of(&args.logs),
        typed: &typed_logs(&args.logs),
    };
    let mut report = stages::lsq::lsq(&of);
    if let Some(path) = &args.report {
        let mut given = vec![robot.provenance];
        given.extend(friction.map(|model| model.provenance));
        let (replayed, quality) = args.replayed(&of, &checked.setup.data, context)?;
        let (page, replayed) = (&mut report.page(), replayed.as_ref());
        stages::lsq::pictures(page, &of, replayed, &given, &quality, &context.command);
        context.write_text(path, &report.html())?;
    }
    checked.finish(report, document, (&args.output, &model), context)
}

impl Args {
    fn held_run(&self) -> HeldRun<'_> {
        HeldRun {
            logs: &self.logs,
            robot: &self.robot,
            output: &self.output,
            report: self.report.as_deref(),
        }
    }

    fn check_outputs(&self, context: &Context) -> Result<(), CliError> {
        let payload = self.fit_gains.iter().flatten().map(|p| &*p.log.path);
        let outputs = outputs::listed(Some(&self.output), &[], self.report.as_deref());
        let outputs = outputs.chain(self.setup.fix_setup.as_deref());
        context.check_outputs(paths_of(&self.logs).chain(payload), outputs)
    }

    /// The logs as the robot file reads them, with the gains of its torque channels where those are fitted.
    fn checked(
        &self,
        file: RobotFile,
        context: &Context,
    ) -> Result<(CheckedDataset, Option<CurrentGains>), CliError> {
        let control = &context.control;
        let setup = RobotSetup::new(&self.robot, file);
        let logs = logs(&self.leave_out.of(&self.logs))?;
        let data = Dataset::read(&setup, &logs, control)?;
        data.check_moving()?;
        let (data, gains, edits) = match &self.fit_gains {
            None => (data, None, Vec::new()),
            Some(payload) => {
                let payload = payload.as_ref().map(KnownPayload::known);
                let fitted = identify::fit_gains(&data, payload.as_ref(), control)?;
                let data = fitted.data(&data, control)?;
                (data, Some(fitted.gains), fitted.edits)
            }
        };
        let robot = Path::new(&self.robot);
        let checked = setup::checked(data, (robot, &edits), &self.setup, context)?;
        Ok((checked, gains))
    }

    /// The model along the logs, where they fit into memory, and what is wrong with them.
    fn replayed(
        &self,
        of: &LsqReport,
        data: &Dataset,
        context: &Context,
    ) -> Result<(Option<ReplayedLogs>, Vec<InspectedLog>), CliError> {
        let smoothed = data.setup.smoothed_as(&of.found.position_cutoffs);
        let in_memory = match data.reduced.is_empty() {
            true => pictures::in_memory(&smoothed, &data.logs, context)?,
            false => None,
        };
        let numbers = refined(of.file, &self.output.to_string_lossy())?;
        let of_model = (of.file, &numbers);
        let replayed = pictures::replayed(&smoothed, in_memory.as_ref(), of.logs, of_model, &[])?;
        let files = self.logs.iter().filter(|l| !identify::is_reduced(&l.path));
        let quality = pictures::inspected(files, &data.setup, context)?;
        context.check()?;
        Ok((replayed, quality))
    }
}

/// Logs as a shell takes them; of many, and of reduced ones, which hold no rows to diagnose, a word.
fn typed_logs(logs: &[LogSpec]) -> String {
    if logs.len() > typed::MAX_LOGS || logs.iter().any(|log| identify::is_reduced(&log.path)) {
        return "LOG".to_owned();
    }
    typed::logs(logs.iter().map(LogSpec::to_string))
}
