//! `cft-ident simulate`: a log of the simulated robot, and its truth beside it.

mod servo;

use std::ffi::OsStr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::error::CliError;
use super::outcome::Outcome;
use super::{arguments, file_name, files};
use cft_ident_core::number;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::model_file::Parameter;
use cft_ident_logs::log::{Block, LogSpec, Provenance, Reader};
use cft_ident_logs::output::LogWriter;
use cft_ident_plant::simulate::effects::EffectValue;
use cft_ident_plant::simulate::servo::BenchMotion;
use cft_ident_plant::simulate::{
    self, EffectSpec, Experiment, InitialConditions, LimitEvent, Order, RunEnding,
};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::table::{CellAlignment, Table};

const EXAMPLE: &str = "\
Example:
  cft-ident simulate -r configs/cft.toml --move q4 --seconds 20 -o moved.csv
  cft-ident simulate --servo sines --drive command_delay=0.03 -o late.json";

/// Simulate the robot under control and write its log.
///
/// Without --reference, --move or --volts it runs the excitation trajectory of the report's Table 3.
/// The truth (parameters, effects, seed) goes to a file of its own beside the log: LOG's stem with
/// .truth.toml. With --servo it is command and position of a servo on a pendulum rig: driven by volts
/// with counts as gains, or by torque where --kd is given.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident simulate [OPTIONS] -r ROBOT.toml -o LOG.csv|.mcap\n       cft-ident simulate [OPTIONS] --servo MOTION -o LOG.json|.csv")]
pub struct Args {
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(
        short,
        long,
        value_name = "ROBOT.toml",
        required_unless_present = "servo"
    )]
    pub robot: Option<PathBuf>,
    /// Model file whose parameters are the truth [default: the robot's nominal ones]
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: Option<PathBuf>,
    /// Trajectory that the controller follows
    #[arg(long, value_name = "TRAJECTORY.toml", group = "motion")]
    pub reference: Option<PathBuf>,
    /// One-joint experiment: JOINT moves over its range at several speeds, the others are held
    #[arg(long = "move", value_name = "JOINT", group = "motion")]
    pub move_joint: Option<String>,
    /// A servo on a pendulum rig instead of a robot, and its motion: step, sines, chirp, ramps or
    /// places
    #[arg(
        long,
        value_name = "MOTION",
        group = "motion",
        value_parser = servo::motion,
        conflicts_with_all = ["robot", "model", "seconds", "travel", "position", "speed", "effects", "candidates"]
    )]
    pub servo: Option<BenchMotion>,
    /// Proportional gain of the servo [counts of its firmware, or N m/rad with --kd] [default: 16]
    #[arg(long, value_name = "X", requires = "servo", value_parser = arguments::positive)]
    pub kp: Option<f64>,
    /// Gain of the speed of a servo that is driven by torque [N m s/rad]; a URDF of the rig is
    /// written beside LOG.csv
    #[arg(long, value_name = "X", requires = "servo", value_parser = arguments::not_negative)]
    pub kd: Option<f64>,
    /// Numbers of the servo and of its rig that are not those of a hobby servo, as
    /// armature=0.03,speed_limit=4.8,command_delay=0.03
    #[arg(
        long,
        value_name = "NAME=X,..",
        value_delimiter = ',',
        requires = "servo",
        value_parser = servo::numbered
    )]
    pub drive: Vec<(String, f64)>,
    /// Part of its range that JOINT moves over, about the middle [default: 1]
    #[arg(hide_short_help = true, long, value_name = "PART", value_parser = arguments::part, requires = "move_joint")]
    pub travel: Option<f64>,
    /// Log whose volts u_1..u_4 drive the motors, without a controller
    #[arg(hide_short_help = true, long, value_name = "LOG", group = "motion")]
    pub volts: Option<LogSpec>,
    /// Duration [s] [default: that of the motion, else 20]
    #[arg(long, value_name = "S", value_parser = arguments::positive)]
    pub seconds: Option<f64>,
    /// Start of every motor coordinate: x_c1,x_c2,x_c3,x_c4 [m, m, rad, m], or the joint of a single
    /// one [default: at rest on the motion]
    #[arg(hide_short_help = true,
        long,
        value_name = "X,...",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = arguments::finite
    )]
    pub position: Vec<f64>,
    /// Speeds of the same at the start [m/s, m/s, rad/s, m/s] [default: 0]
    #[arg(hide_short_help = true,
        long,
        value_name = "V,...",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = arguments::finite,
        requires = "position"
    )]
    pub speed: Vec<f64>,
    /// Effect that the plant has beyond the model, or fault of its log; may be given more than once
    #[arg(long = "effect", value_name = "NAME[:JOINT][:key=value,...]")]
    pub effects: Vec<EffectSpec>,
    /// Effects of your own for --effect: [[candidate]] tables with formulas, whose numbers --effect gives
    #[arg(
        hide_short_help = true,
        long,
        value_name = "FILE.toml",
        requires = "effects"
    )]
    pub candidates: Option<PathBuf>,
    /// Seed of every random number; of the motions of a servo, places are drawn
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Log to write
    #[arg(short, long, value_name = "LOG.csv|.mcap|.json", value_parser = servo::log_or_rig)]
    pub output: PathBuf,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let truth_path = truth_beside(&args.output);
    let log = args.volts.as_ref().map(|log| &*log.path);
    let (reference, model) = (args.reference.as_deref(), args.model.as_deref());
    let candidates = args.candidates.as_deref();
    let read = [args.robot.as_deref(), reference, model, candidates, log];
    let read = read.into_iter().flatten();
    context.check_outputs(read, [&*args.output, &*truth_path])?;

    let path = match (args.servo, &args.robot) {
        (Some(motion), _) => return servo::run(motion, args, &truth_path, context),
        (None, Some(_)) if args.kp.is_some() || args.kd.is_some() || !args.drive.is_empty() => {
            let text = "--kp, --kd and --drive are of a servo, --servo MOTION";
            return Err(CliError::usage(text));
        }
        (None, Some(path)) => path,
        (None, None) => return Err(CliError::usage("no robot is given").hint("-r ROBOT.toml")),
    };
    if servo::is_of_rig(&args.output) {
        let text = "-o: a .json is the log of a servo, --servo MOTION";
        return Err(CliError::usage(text));
    }
    let robot = files::robot(path)?;
    let mut inputs = vec![robot.provenance];
    let mut robot = robot.value;
    let model = model
        .map(|path| files::model_of(path, &robot, context))
        .transpose()?;
    inputs.extend(model.iter().map(|model| model.provenance.clone()));
    let reference = reference.map(files::trajectory).transpose()?;
    inputs.extend(reference.iter().map(|file| file.provenance.clone()));
    let motors = args.volts.as_ref();
    let motors = motors.map(|log| volts(log, &robot, context)).transpose()?;
    inputs.extend(motors.iter().map(|(_, provenance)| provenance.clone()));
    let own = candidates.map(files::candidates).transpose()?;
    inputs.extend(own.iter().map(|file| file.provenance.clone()));
    let own = own.map(|file| file.value).unwrap_or_default();
    let effects = args.effects.iter().cloned();

    let experiment = match (&reference, &args.move_joint, &motors) {
        (Some(reference), ..) => Experiment::Trajectory(&reference.value),
        (_, Some(joint), _) => Experiment::OneJoint {
            joint,
            part: args.travel.unwrap_or(1.0),
        },
        (_, _, Some((log, _))) => Experiment::Volts {
            times: &log.t,
            volts: &log.tau,
        },
        _ => Experiment::Usual,
    };
    if let (Experiment::Usual | Experiment::OneJoint { .. }, Some(model)) = (&experiment, &model) {
        model.value.file.travel_of_seen(&mut robot.limits);
    }
    let model = model.as_ref();
    let order = Order {
        robot: &robot,
        model: model.map(|model| (model.name.as_str(), &model.value.file)),
        experiment,
        seconds: args.seconds,
        effects: effects.map(|effect| effect.or_own(&own)).collect(),
        seed: args.seed,
    };
    // speeds that are not given are 0
    let initial = (!args.position.is_empty()).then(|| InitialConditions {
        position: args.position.clone(),
        speed: match &args.speed[..] {
            [] => vec![0.0; args.position.len()],
            given => given.to_vec(),
        },
    });
    let bar = context.progress("simulating", None);
    let (simulated, log) = simulate_to(&order, initial.as_ref(), &args.output, context)?;
    drop(bar);

    let names = (file_name(&args.output), file_name(&truth_path));
    let result = SimulationResult::of(&simulated, args.seed, &log, &names);
    let shown = [robot.notes.0.clone(), warnings(&simulated)].concat();
    let all = render(&robot, &log, &names.0);
    let text = context.text(all, &format!("written: {}", names.0));
    let document = JsonDocument::new("simulate", &inputs, &shown, &result)?;
    Ok(Outcome::new(text, document))
}

/// The log's stem with `.truth.toml`, beside it.
pub(super) fn truth_beside(log: &Path) -> PathBuf {
    let packed = |end: &OsStr| end.eq_ignore_ascii_case("gz") || end.eq_ignore_ascii_case("zst");
    match log.extension().is_some_and(packed) {
        true => log.with_extension("").with_extension("truth.toml"),
        false => log.with_extension("truth.toml"),
    }
}

/// Simulates one order and writes its log, with the truth beside it.
pub(super) fn simulate_to(
    order: &Order,
    initial: Option<&InitialConditions>,
    path: &Path,
    context: &Context,
) -> Result<(simulate::SimulationSummary, LogFigures), CliError> {
    context.check()?;
    let mut rows = ToFile {
        path,
        context,
        time_factor: order.robot.layout().time.factor,
        writer: None,
        figures: LogFigures::default(),
        failed: None,
    };
    let simulated = match simulate::simulate_rows(order, initial, &mut rows) {
        // why is known better here
        Err(error) => return Err(rows.failed.unwrap_or(error.into())),
        Ok(simulated) => simulated,
    };
    // The log gets its name last: where it stands, its truth stands too.
    write_truth(&truth_beside(path), &simulated, context)?;
    if let Some(log) = rows.writer {
        context.files.add_log(log)?;
    }
    Ok((simulated, rows.figures))
}

struct ToFile<'a> {
    path: &'a Path,
    context: &'a Context,
    /// Seconds of one unit of the column of times.
    time_factor: f64,
    writer: Option<LogWriter>,
    figures: LogFigures,
    failed: Option<CliError>,
}

impl ToFile<'_> {
    fn write(&mut self, header: &[String], values: &[f64]) -> Result<(), CliError> {
        self.context.check()?;
        let writer = match &mut self.writer {
            Some(writer) => writer,
            none => none.insert(LogWriter::create(self.path, header)?),
        };
        for row in values.chunks_exact(header.len()) {
            writer.row(row.iter().copied())?;
            self.figures.add(header, row, self.time_factor);
        }
        Ok(())
    }

    fn ending(&mut self, result: Result<(), CliError>) -> ControlFlow<()> {
        match result {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.failed = Some(error);
                ControlFlow::Break(())
            }
        }
    }
}

impl simulate::Rows for ToFile<'_> {
    fn goes_on(&mut self) -> ControlFlow<()> {
        let result = self.context.check();
        self.ending(result)
    }

    fn take(&mut self, header: &[String], values: &[f64]) -> ControlFlow<()> {
        let result = self.write(header, values);
        self.ending(result)
    }
}

/// What is reported of a log that is on its way to the file.
#[derive(Debug, Default)]
pub(super) struct LogFigures {
    columns: Vec<ColumnFigures>,
    rows: usize,
    first_s: f64,
    last_s: f64,
}

#[derive(Debug)]
struct ColumnFigures {
    name: String,
    low: f64,
    high: f64,
    squares: f64,
}

impl LogFigures {
    fn add(&mut self, header: &[String], row: &[f64], time_factor: f64) {
        if self.columns.is_empty() {
            self.columns.extend(header.iter().map(|name| ColumnFigures {
                name: name.clone(),
                low: f64::INFINITY,
                high: f64::NEG_INFINITY,
                squares: 0.0,
            }));
            self.first_s = row[0] * time_factor;
        }
        for (column, x) in self.columns.iter_mut().zip(row) {
            column.low = column.low.min(*x);
            column.high = column.high.max(*x);
            column.squares += x * x;
        }
        self.last_s = row[0] * time_factor;
        self.rows += 1;
    }

    fn duration_s(&self) -> f64 {
        self.last_s - self.first_s
    }
}

/// Volts of a log, to be played back.
fn volts(
    log: &LogSpec,
    robot: &RobotFile,
    context: &Context,
) -> Result<(Block, Provenance), CliError> {
    let mut reader = Reader::open(log, &robot.volts_layout())?;
    let (mut block, mut all) = (Block::default(), Block::default());
    while reader.read(&mut block)? {
        context.check()?;
        all.t.extend_from_slice(&block.t);
        all.tau.extend_from_slice(&block.tau);
    }
    Ok((all, reader.provenance()?))
}

fn write_truth(
    path: &Path,
    simulated: &simulate::SimulationSummary,
    context: &Context,
) -> Result<(), CliError> {
    let text = simulated.truth.to_toml().map_err(|error| {
        CliError::output(format!("the truth cannot be expressed in TOML: {error}"))
    })?;
    let head = "# What was true in the simulated log beside this file. SI units and radians.";
    context.write_text(path, &format!("{head}\n\n{text}"))
}

/// Time from the first to the last row [s]; the robot file may log it in another unit.
/// A simulated log in numbers.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SimulationResult<'a> {
    /// Effects that the plant has beyond the model, or faults of its log.
    effects: &'a [EffectValue],
    /// The true parameters.
    parameters: &'a [Parameter],
    /// Seed of everything that chance decided.
    seed: u64,
    /// Rows of the log.
    samples: usize,
    /// Time from the first to the last row \[s\].
    duration_s: f64,
    ending: RunEnding,
    limits_reached: &'a [LimitEvent],
    saturated: Vec<Saturation<'a>>,
    files: SimulatedFiles<'a>,
}

/// How often an amplifier saturates.
#[derive(Debug, Serialize, JsonSchema)]
struct Saturation<'a> {
    coordinate: &'a str,
    /// Share of the rows.
    share: f64,
}

/// Names of what was written.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Files")]
struct SimulatedFiles<'a> {
    log: &'a str,
    truth: &'a str,
}

impl<'a> SimulationResult<'a> {
    fn of(
        log: &'a simulate::SimulationSummary,
        seed: u64,
        figures: &LogFigures,
        (name, truth): &'a (String, String),
    ) -> Self {
        let saturated = log.saturated.iter();
        let saturated = saturated.map(|(coordinate, share)| Saturation {
            coordinate,
            share: *share,
        });
        SimulationResult {
            effects: &log.truth.effects,
            parameters: &log.truth.parameters,
            seed,
            samples: figures.rows,
            duration_s: figures.duration_s(),
            ending: log.ending,
            limits_reached: &log.limits,
            saturated: saturated.collect(),
            files: SimulatedFiles { log: name, truth },
        }
    }
}

pub(super) fn warnings(simulated: &simulate::SimulationSummary) -> Vec<String> {
    let ends = match simulated.ending {
        RunEnding::StoppedAtLimit => ", and the log ends there",
        RunEnding::Completed => "",
    };
    let limits = simulated.limits.iter().map(|event| {
        format!(
            "{} reached {:.4} at {:.3} s, beyond its limits [{}, {}]{ends}",
            event.coordinate, event.value, event.t, event.lower, event.upper
        )
    });
    let saturated = simulated.saturated.iter().filter(|(_, share)| *share > 0.0);
    let saturated = saturated.map(|(name, share)| {
        let share = number::percent(*share);
        format!("the amplifier of {name} saturates in {share} of the samples")
    });
    let left_out = simulated.left_out.iter();
    let left_out = left_out.map(|why| {
        format!("left out of the simulation, for it is written for prediction only and no machine can have it: {why}")
    });
    limits.chain(saturated).chain(left_out).collect()
}

/// Range and root mean square of every channel of the log.
fn render(robot: &RobotFile, figures: &LogFigures, log: &str) -> String {
    let mut table = Table::new(&[
        ("column", CellAlignment::Left),
        ("from", CellAlignment::Decimal),
        ("to", CellAlignment::Decimal),
        ("rms", CellAlignment::Decimal),
        ("unit", CellAlignment::Left),
    ])
    .caption(&format!(
        "{log}: {} samples, {} s",
        figures.rows,
        number::significant(figures.duration_s(), 5)
    ));
    let layout = robot.layout();
    let parts = [Some(&layout), layout.otherwise.as_deref()];
    let parts = parts.into_iter().flatten();
    let channels = parts.flat_map(|part| part.positions.iter().chain(&part.torques));
    for column in &figures.columns {
        let Some(channel) = channels.clone().find(|c| c.column == column.name) else {
            continue;
        };
        let rms = (column.squares / figures.rows.max(1) as f64).sqrt();
        table.row([
            column.name.as_str(),
            &number::significant(column.low, 4),
            &number::significant(column.high, 4),
            &number::significant(rms, 3),
            &channel.unit,
        ]);
    }
    table.to_string()
}
