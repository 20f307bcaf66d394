//! `cft-ident excite`: a motion that makes the parameters as certain as the limits allow, judged
//! before the robot moves; or the same judgement of a motion that is there.

mod aim;
mod controllers;
mod criterion;
mod given;
pub(super) mod held;
mod judge;
mod names;
mod one_joint;
mod samples;
mod search;

use std::path::{Path, PathBuf};

use super::context::Context;
use super::error::CliError;
use super::exit::Exit;
use super::outcome::Outcome;
use super::{arguments, files, keep_what_there_is};
use crate::cli;
use cft_ident_files::config::{ModelFile, RobotFile, Trajectory};
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_plant::excite::ladder::foresee_ladder;
use cft_ident_plant::excite::machine::ForeseenRobot;
use cft_ident_plant::excite::usage::check_pose;
use cft_ident_plant::excite::{
    ExciteError, GivenInformation, InformationBefore, LawForeseen, Motion, MotionJudgement,
    MotionJudgements, PriorInformation, foresee, machine, usual_torque,
};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::sections::provenance;
use cft_ident_report::report::{Report, stages};

use aim::ExciteAim;
use criterion::weights;
use judge::{head, judged, refuse_broken};
use names::OutputNames;
use one_joint::{ladder, ladder_task, strokes};
use search::{blended, searched, task};

const EXAMPLE: &str = "\
Example:
  cft-ident excite -r configs/cft.toml -o excitation.toml --plot excitation.svg
  cft-ident excite -r configs/cft.toml --joint q4 -o ladder.toml
  cft-ident excite -r arm.toml --static 24 -o poses.toml
  cft-ident excite -m refined.toml --for ripple:q5 -o next.toml
  cft-ident excite --check configs/table3.toml";

/// Design a motion for identification that keeps every limit, or check one that exists.
///
/// The motion is a finite Fourier series, entered from rest and left to it. Printed before the
/// robot moves: the expected standard deviation of every parameter, what the motion confounds, and
/// how near it comes to each limit. Limits, motors and noise are those of the robot file; torques
/// are foreseen with the model.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Robot file, or a built-in one [default: the robot of the model, without a model configs/cft.toml]
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: Option<PathBuf>,
    /// Model file that torques and volts are foreseen with, limits kept for the 95 % band of its parameters
    /// [default: nominal numbers, or the inertials of the robot file; without any, torques are not foreseen]
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: Option<PathBuf>,
    /// What the next motion is for: the weak parameters of the model, whose intervals it narrows together with the
    /// logs that there are, or an effect that the logs do not distinguish from its like. Limits that the robot file does not
    /// give are the positions, speeds, accelerations and torques of the model's logs
    #[arg(long = "for", value_name = "weak|EFFECT:JOINT", requires = "model",
          conflicts_with_all = ["check", "joint", "criterion", "parameters"])]
    pub aim: Option<String>,
    /// Trajectory to judge instead of a design; status 1 when it breaks a limit
    #[arg(long, value_name = "TRAJECTORY.toml", conflicts_with_all = ["output", "with", "trajectories"])]
    pub check: Option<PathBuf>,
    /// Design the ladder of speeds of a one-joint experiment instead, for the friction of this joint
    #[arg(long, value_name = "JOINT", conflicts_with_all = ["check", "with", "trajectories"])]
    pub joint: Option<String>,
    /// Propose so many poses to hold instead, each reached from both sides, for `lsq --static`
    #[arg(long = "static", value_name = "N", conflicts_with_all = ["check", "joint", "with", "aim", "report", "plot"], value_parser = clap::value_parser!(u16).range(6..=1000))]
    pub held: Option<u16>,
    /// What the motion is to make small
    #[arg(hide_short_help = true, long, value_enum, default_value_t = CriterionName::Condition)]
    pub criterion: CriterionName,
    /// With a-optimal: only this parameter, by its relative error; may be given more than once
    #[arg(hide_short_help = true, long = "parameter", value_name = "NAME")]
    pub parameters: Vec<String>,
    /// Fundamental frequency [Hz] [default: 0.4; with --for slower, where the logs swing slower over their positions]
    #[arg(hide_short_help = true, long, value_name = "HZ", value_parser = frequency)]
    pub frequency: Option<f64>,
    /// Harmonics of each coordinate
    #[arg(hide_short_help = true, long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=32))]
    pub harmonics: u16,
    /// Whole periods between the ends
    #[arg(hide_short_help = true, long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub periods: u32,
    /// Share of every limit that the design leaves free, for what a controller strays
    #[arg(hide_short_help = true, long, value_name = "SHARE", default_value_t = 0.05, value_parser = share)]
    pub margin: f64,
    /// Pose from which the robot goes straight to the first point, coordinate by coordinate [m or rad]: limits are
    /// kept on the way too
    #[arg(hide_short_help = true, long, value_name = "X,X,..", value_delimiter = ',', allow_hyphen_values = true, value_parser = arguments::finite)]
    pub from: Option<Vec<f64>>,
    /// Log or trajectory (.toml) that is used together with the design; may be given more than once
    #[arg(hide_short_help = true, long, value_name = "LOG|TRAJECTORY.toml")]
    pub with: Vec<String>,
    /// Motions to design, each to complement those before it; written as TRAJECTORY-1.toml, ...
    #[arg(hide_short_help = true, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub trajectories: u16,
    /// Seed of the starts
    #[arg(hide_short_help = true, long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Trajectory to write
    #[arg(
        short,
        long,
        value_name = "TRAJECTORY.toml",
        required_unless_present = "check"
    )]
    pub output: Option<PathBuf>,
    /// Write the motion sample by sample, positions, speeds and accelerations
    #[arg(hide_short_help = true, long, value_name = "FILE.csv|.mcap", value_parser = arguments::log_file)]
    pub samples: Option<PathBuf>,
    /// Write the motion as a program for a controller of Universal Robots
    #[arg(hide_short_help = true, long, value_name = "FILE.script", value_parser = arguments::ends_in(["script"]))]
    pub urscript: Option<PathBuf>,
    /// Rate of the samples, and of the logs that deviations are foreseen for [Hz] [default: that of
    /// [control], else that of the model's logs, else 1000]
    #[arg(hide_short_help = true, long, value_name = "HZ", value_parser = arguments::positive)]
    pub rate: Option<f64>,
    /// Duration of a one-joint experiment, or of a checked motion that sets none [s] [default: 20, with --for what the
    /// effect takes]
    #[arg(hide_short_help = true, long, value_name = "S", value_parser = seconds)]
    pub seconds: Option<f64>,
    /// Draw positions, speeds and volts with their limits
    #[arg(hide_short_help = true, long, value_name = "FILE.svg", value_parser = arguments::ends_in(["svg"]))]
    pub plot: Option<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

/// What a design makes small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum CriterionName {
    /// Condition number of the stacked regressor
    Condition,
    /// The same with its columns scaled to norm 1
    ConditionNormalised,
    /// -log det(F'F): the volume of the parameters' uncertainty
    DOptimal,
    /// Sum of the parameters' variances, given each joint's noise
    AOptimal,
}

/// Duration of a one-joint experiment where nothing says \[s\].
pub(super) const LADDER_S: f64 = 20.0;

/// Fundamental frequency where nothing says \[Hz\].
pub(super) const FUNDAMENTAL_HZ: f64 = 0.4;

/// A duration of a motion: some hours at most.
fn seconds(text: &str) -> Result<f64, String> {
    match arguments::positive(text)? {
        value if value <= 1e5 => Ok(value),
        _ => Err("must be at most 100000 s".into()),
    }
}

/// A frequency of a machine's motion: a robot follows some Hz.
fn frequency(text: &str) -> Result<f64, String> {
    let wrong = "must lie in 0.0001..1000 Hz";
    arguments::number(text, wrong, |x| (1e-4..=1e3).contains(&x))
}

fn share(text: &str) -> Result<f64, String> {
    arguments::number(text, "must lie in 0..0.9", |x| (0.0..0.9).contains(&x))
}

impl From<ExciteError> for CliError {
    fn from(error: ExciteError) -> Self {
        match error {
            ExciteError::Config(error) => error.into(),
            ExciteError::Reference(error) => error.into(),
            error => Self::input(error),
        }
    }
}

/// A run of `excite`: its arguments and the robot that it designs for.
struct ExciteRun<'a> {
    args: &'a Args,
    context: &'a Context,
    file: RobotFile,
    machine: ForeseenRobot,
    /// Name of the file that the robot is from.
    robot: String,
    model: Option<ModelFile>,
    aim: Option<ExciteAim>,
    rate_hz: f64,
    frequency_hz: f64,
    /// Duration of a one-joint experiment, or of a checked motion that sets none \[s\].
    seconds: f64,
    inputs: Vec<Provenance>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let all = OutputNames::of(args);
    let read = [&args.robot, &args.model, &args.check];
    let read = read.into_iter().filter_map(|path| path.as_deref());
    let read = read.chain(args.with.iter().map(Path::new));
    context.check_outputs(read, all.iter().flat_map(OutputNames::paths))?;

    let model = args.model.as_deref();
    let model = model.map(|path| files::model(path, context)).transpose()?;
    let mut inputs = Vec::new();
    let (robot, mut file) = match (&args.robot, &model) {
        (None, Some(given)) => (given.name.clone(), given.value.file.robot.clone()),
        (path, _) => {
            let path = path.as_deref().unwrap_or(Path::new(ROBOT));
            let given = files::robot(path)?;
            inputs.push(given.provenance);
            (cli::file_name(path), given.value)
        }
    };
    if let Some(given) = &model {
        given.value.file.belongs_to(&given.name, &file)?;
        inputs.push(given.provenance.clone());
    }
    let named = model.as_ref();
    let named = named.map(|given| (given.name.as_str(), &given.value.file));
    let aim = args.aim.as_ref();
    let aim = aim.map(|text| ExciteAim::of(text, &file, named.map(|(_, model)| model)));
    let aim = aim.transpose()?;
    // one motion and one model give one table, whether it is designed or checked
    let fitted = named
        .filter(|(_, model)| aim.is_some() || args.check.is_some() && !model.held_out.is_empty());
    let mut bounded = machine(&file, named)?;
    if let Some((_, model)) = fitted {
        let declared = bounded.channels;
        model.limit_to_seen(&mut file.limits);
        bounded = machine(&file, named)?;
        for channel in &mut bounded.channels {
            channel.from_logs = !declared.contains(channel);
        }
    }
    let mut machine = bounded;
    let names = machine.coordinate_names();
    if let Some(from) = args.from.as_ref().filter(|from| from.len() != names.len()) {
        let text = format!("--from gives {} numbers", from.len());
        let hint = format!("give one for each of {}", names.join(", "));
        return Err(CliError::usage(text).hint(hint));
    }
    let frequency_hz = args.frequency.unwrap_or_else(|| match aim {
        Some(_) => aim::fundamental(&machine),
        None => FUNDAMENTAL_HZ,
    });
    let fundamental = std::f64::consts::TAU * frequency_hz;
    let usual = usual_torque(&machine, fundamental, usize::from(args.harmonics));
    given::noise(&file, &usual, &mut machine);
    let of_logs = named.and_then(|(_, model)| aim::rate_of_logs(model));
    let rate_hz = args.rate.or(file.control.rate_hz).or(of_logs);
    let rate_hz = rate_hz.unwrap_or(RATE_HZ);
    if let Some((_, model)) = named {
        aim::noise(model, rate_hz, &mut machine);
    }
    let mut bench = ExciteRun {
        args,
        context,
        rate_hz,
        frequency_hz,
        seconds: args.seconds.unwrap_or(match &aim {
            Some(ExciteAim::Ladder { seconds, .. }) => *seconds,
            _ => LADDER_S,
        }),
        file,
        machine,
        robot,
        model: model.map(|given| given.value.file),
        aim,
        inputs,
    };
    let joint = match (&args.joint, &bench.aim) {
        (_, Some(ExciteAim::Ladder { joint, .. })) => Some(joint.clone()),
        (joint, _) => joint.clone(),
    };
    if let (Some(count), Some(path)) = (args.held, &args.output) {
        return held::run(&bench, usize::from(count), path);
    }
    match (&args.check, joint) {
        (Some(path), _) => check(&mut bench, path, &all[0]),
        (None, Some(joint)) => ladder(&bench, &joint, &all[0]),
        (None, None) if matches!(bench.aim, Some(ExciteAim::Strokes { .. })) => {
            strokes(&bench, &all[0])
        }
        (None, None) => designs(&mut bench, &all),
    }
}

/// The robot where neither a robot file nor a model is given.
const ROBOT: &str = "configs/cft.toml";

/// Rate of a log where nothing says [Hz].
const RATE_HZ: f64 = 1000.0;

/// Judges a trajectory that is there.
fn check(bench: &mut ExciteRun, path: &Path, names: &OutputNames) -> Result<Outcome, CliError> {
    let args = bench.args;
    let given = files::trajectory(path)?;
    bench.inputs.push(given.provenance);
    let shown = given.name;
    let motion = Motion::of_file(&bench.machine, &given.value, bench.seconds, args.seed)?;
    let channels = bench.machine.channels.clone();
    let joints = bench.machine.model.robot.joint_names();
    let friction = match &given.value {
        Trajectory::SingleJoint(file) if joints.contains(&file.joint) => {
            let task = ladder_task(bench, &file.joint);
            Some(LawForeseen {
                joint: file.joint.clone(),
                parameters: foresee_ladder(&bench.machine, &task, file)?,
                usual_relative_std: None,
            })
        }
        _ => None,
    };
    let known = bench
        .model
        .as_ref()
        .filter(|model| model.covariance.is_some());
    let known = known.map(|model| InformationBefore::of(&bench.machine, model));
    let given = known.map(|known| {
        let mut given = GivenInformation::nothing(&bench.machine);
        given.add_known(&known.information);
        given
    });
    let judged = judged(bench, &motion, &channels, given.as_ref(), friction)?;
    let report = written(bench, &motion, &judged, names, (&shown, None))?;
    let document = JsonDocument::new("excite", &bench.inputs, &judged.warnings, &judged)?;
    Ok(Outcome {
        missed: judged.broken(),
        ..Outcome::new(report.text_for(bench.context.screen), document)
    })
}

/// Designs one motion after the other, each with those before it given.
fn designs(bench: &mut ExciteRun, names: &[OutputNames]) -> Result<Outcome, CliError> {
    let args = bench.args;
    if let Some(from) = &args.from {
        check_pose(&bench.machine, from)?;
    }
    let mut task = task(bench)?;
    let mut given = GivenInformation::nothing(&bench.machine);
    let mut warnings = Vec::new();
    let mut any = false;
    for name in &args.with {
        given::add(bench, name, &mut given, &mut warnings)?;
        any = true;
    }
    if let (Some(ExciteAim::Weak), Some(model)) = (&bench.aim, &bench.model) {
        let (known, criterion) = aim::weak(bench, model)?;
        given.add_known(&known.information);
        task.criterion = criterion;
        any = true;
    }
    let weights = weights(&bench.machine, &task.criterion);
    let period = 1.0 / bench.frequency_hz;
    let rows = bench.rate_hz * period * f64::from(args.periods);
    let mut text = String::new();
    let mut all: Vec<MotionJudgement> = Vec::new();
    keep_what_there_is();
    for names in names {
        task.prior = any.then(|| PriorInformation {
            information: given.weighted(&weights),
            rows,
        });
        let found = searched(bench, &task)?;
        let (motion, fourier) = blended(bench, found.series)?;
        let channels = &bench.machine.channels;
        let mut judged = judged(bench, &motion, channels, any.then_some(&given), None)?;
        judged.evaluations = Some(found.evaluations);
        refuse_broken(&judged)?;
        let (shown, context) = (names.shown(), bench.context);
        let trajectory = Some(Trajectory::Fourier(fourier));
        let report = written(bench, &motion, &judged, names, (&shown, trajectory))?;
        text += &report.text_for(context.screen);
        warnings.extend(judged.warnings.iter().cloned());
        all.push(judged);
        if found.stopped {
            context.files.commit()?;
            return Err(CliError::new(Exit::Interrupted, "interrupted")
                .hint(format!("the best motion so far is written to {shown}")));
        }
        let (information, rows) =
            foresee::information(&bench.machine, &motion, bench.rate_hz, bench.seconds)?;
        given.add_motion(&information, rows);
        any = true;
    }
    let result =
        MotionJudgements::of(all).ok_or_else(|| CliError::usage("no motion is asked for"))?;
    let document = JsonDocument::new("excite", &bench.inputs, &warnings, &result)?;
    Ok(Outcome::new(text, document))
}

/// The report of a motion, after all that is asked for is written: its trajectory, named `shown`, where it is new.
fn written(
    bench: &ExciteRun,
    motion: &Motion,
    judged: &MotionJudgement,
    names: &OutputNames,
    (shown, trajectory): (&str, Option<Trajectory>),
) -> Result<Report, CliError> {
    let title = cli::file_name(Path::new(shown));
    let mut report = stages::excite::excite(judged, shown, &title);
    let figure = |title: &str| stages::excite::figure(&bench.machine, motion, judged, title);
    if let Some(path) = &names.report {
        let mut page = report.page();
        stages::excite::course(&mut page, judged, &figure(&escape(&title)));
        let (file, command) = (&bench.file, &bench.context.command);
        provenance::section(&mut page, file, &bench.inputs, &[], None, command);
        bench.context.write_text(path, &report.html())?;
        cli::written(&mut report, path);
    }
    if let Some(path) = &names.plot {
        bench.context.write_text(path, &figure(&title).svg())?;
        cli::written(&mut report, path);
    }
    if let Some(path) = &names.samples {
        samples::write(bench, motion, path)?;
        cli::written(&mut report, path);
    }
    if let Some(path) = &names.urscript {
        controllers::write(bench, motion, judged, path)?;
        cli::written(&mut report, path);
    }
    if let (Some(path), Some(trajectory)) = (&names.trajectory, trajectory) {
        let text = trajectory.to_toml(&head(judged));
        bench.context.write_text(path, &text)?;
        cli::written(&mut report, path);
    }
    Ok(report)
}
