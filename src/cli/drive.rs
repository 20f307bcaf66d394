//! `cft-ident drive`: drives from commanded and measured positions.

use std::path::{Path, PathBuf};

use super::{
    CliError, Context, Outcome, arguments, each_log_once, file_name, files, names_of, paths_of,
};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_drive::drive::drive_file::DriveFile;
use cft_ident_drive::drive::identify::{DriveData, identify, joined_courses};
use cft_ident_drive::drive::law::{DriveLawKind, ServoFirmware};
use cft_ident_drive::drive::outcome::DriveResult;
use cft_ident_drive::drive::read::bam::RigGiven;
use cft_ident_drive::drive::read::{self, ReadRequest};
use cft_ident_drive::drive::track::DriveLog;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{DataRole, LogSpec, Provenance, escape};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages::drive as words;

const EXAMPLE: &str = "\
Example:
  cft-ident drive rig/*.json -o servo.toml --holdout-where kp=16
  cft-ident drive walk.csv -r a.toml --command 'q_des_*' --kp 20 -o legs.toml
  cft-ident drive arm/*/ --joints pan,lift,elbow -o arm.toml";

/// Find armature, friction, delay and limits of servos or legs from commanded and measured positions.
///
/// Positions are rolled out by the law of the drive and set against the measured ones. A log is a rig's JSON as BAM
/// writes it, a `.pt` of PACE, a folder of SAGE, or a table with columns of commands and positions.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident drive [OPTIONS] LOG... -o DRIVE.toml")]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file or URDF with the links that the drives move; without it each torque is a ratio to the inertia
    #[arg(short, long, value_name = "ROBOT")]
    pub robot: Option<PathBuf>,
    /// Model file to write
    #[arg(short, long, value_name = "DRIVE.toml")]
    pub output: PathBuf,
    /// Log that is evaluated and not fitted; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub holdout: Vec<LogSpec>,
    /// Hold out the logs in which a gain or a number of the rig has this value, as kp=16
    #[arg(long, value_name = "NAME=X", value_parser = fact)]
    pub holdout_where: Vec<(String, f64)>,
    /// Page with measured, given and refined positions
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
    /// Figure of the positions of the first held-out log, or of the first
    #[arg(long, value_name = "FILE.svg", value_parser = arguments::ends_in(["svg"]))]
    pub plot: Option<PathBuf>,
    /// Proportional gain of the controller [N m/rad, or counts of the firmware]
    #[arg(long, value_name = "X", value_parser = arguments::positive)]
    pub kp: Option<f64>,
    /// Gain of the speed
    #[arg(long, value_name = "X", value_parser = arguments::finite)]
    pub kd: Option<f64>,
    /// The gains are counts of the firmware of a servo, and no N m/rad
    #[arg(long)]
    pub volts: bool,
    /// Columns of the commands of a table
    #[arg(long, value_name = "PATTERN")]
    pub command: Option<String>,
    /// Columns of the positions of a table
    #[arg(long, value_name = "PATTERN", default_value = "q_*")]
    pub position: String,
    /// Names of the joints of a file that has none, in its order
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    pub joints: Vec<String>,
    /// Mass of the rod of a rig [kg]
    #[arg(hide_short_help = true, long, value_name = "KG", value_parser = arguments::finite)]
    pub arm_mass: Option<f64>,
    /// Duty of the servo's firmware per radian and unit of kp
    #[arg(hide_short_help = true, long, value_name = "X", value_parser = arguments::positive)]
    pub firmware_gain: Option<f64>,
    /// Largest duty of the servo's firmware
    #[arg(hide_short_help = true, long, value_name = "X", value_parser = arguments::part)]
    pub duty_max: Option<f64>,
}

/// `kp=16`.
fn fact(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("is no NAME=X, such as kp=16")?;
    Ok((name.trim().to_owned(), arguments::finite(value)?))
}

/// A robot whose links are known.
struct KnownLinks {
    robot: Robot,
    theta: Vec<f64>,
    joints: Vec<String>,
    provenance: Provenance,
}

fn links(path: &Path) -> Result<KnownLinks, CliError> {
    let urdf = path
        .extension()
        .is_some_and(|end| end == "urdf" || end == "xml");
    let (name, file, provenance) = match urdf {
        true => {
            let shown = escape(&path.to_string_lossy());
            let section = toml::Value::from(file_name(path));
            let text = format!("[robot]\nmodel = \"serial\"\nurdf = {section}\n");
            let file = RobotFile::parse_in(&shown, &text, path.parent())?;
            (shown, file, Provenance::of_file(path)?)
        }
        false => {
            let read = files::robot(path)?;
            (read.name, read.value, read.provenance)
        }
    };
    let robot = file.robot();
    let mut standard = vec![0.0; robot.standard_parameters()];
    let mut known = false;
    for (i, link) in file.robot.link.iter().enumerate() {
        if let Some(inertial) = &link.inertial {
            known = true;
            let values = inertial.body().standard();
            standard[i * STANDARD..(i + 1) * STANDARD].copy_from_slice(&values);
        }
    }
    if !known {
        let text = format!("{name}: the links have no mass");
        return Err(CliError::input(text)
            .hint("give a robot file whose URDF has inertials")
            .hint("or leave -r out: torques are then ratios to the inertia"));
    }
    Ok(KnownLinks {
        theta: robot.base_of(&standard),
        joints: file.joint_names(),
        robot,
        provenance,
    })
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs = paths_of(&args.logs).chain(paths_of(&args.holdout));
    let inputs = inputs.chain(args.robot.as_deref());
    let outputs = [
        Some(&*args.output),
        args.report.as_deref(),
        args.plot.as_deref(),
    ];
    context.check_outputs(inputs, outputs.into_iter().flatten())?;
    each_log_once(&args.logs, &args.holdout)?;
    let links = args.robot.as_deref().map(links).transpose()?;
    let told = ReadRequest {
        rig: RigGiven {
            arm_mass: args.arm_mass,
            kp: args.kp,
            kd: args.kd,
        },
        joints: match (&links, args.joints.is_empty()) {
            (Some(links), true) => links.joints.clone(),
            _ => args.joints.clone(),
        },
        command: args.command.clone(),
        position: Some(args.position.clone()),
        robot: links.is_some(),
        volts: args.volts,
    };
    let mut provenances = Vec::new();
    let (mut fitted, mut held_out) = (Vec::new(), Vec::new());
    let all = args.logs.iter().map(|spec| (spec, false));
    for (spec, named) in all.chain(args.holdout.iter().map(|spec| (spec, true))) {
        context.check()?;
        let (log, provenance) = read::read(spec, &told)?;
        let held = |(name, value): &(String, f64)| log.fact(name) == Some(*value);
        let held = named || args.holdout_where.iter().any(held);
        let role = if held {
            DataRole::HeldOut
        } else {
            DataRole::Fitted
        };
        provenances.push(provenance.used_as(role));
        match held {
            true => held_out.push(log),
            false => fitted.push(log),
        }
    }
    for (name, value) in &args.holdout_where {
        if !held_out
            .iter()
            .any(|log: &DriveLog| log.fact(name) == Some(*value))
        {
            let text = format!("--holdout-where {name}={value}: no log has it");
            let first = fitted.first();
            let facts = first.map_or(String::new(), |log: &DriveLog| {
                let each = log
                    .facts
                    .iter()
                    .map(|(name, value)| format!("{name}={value}"));
                each.collect::<Vec<_>>().join(", ")
            });
            return Err(CliError::usage(text).hint(format!("the first log has {facts}")));
        }
    }
    if fitted.is_empty() {
        return Err(CliError::usage("every log is held out").hint("hold out fewer"));
    }
    let torque = links.is_some() && !args.volts;
    let warnings = warnings(fitted.iter().chain(&held_out));
    let data = DriveData {
        fitted,
        held_out,
        links: links
            .as_ref()
            .map(|of| (of.robot.clone(), of.theta.clone())),
        kind: match torque {
            true => DriveLawKind::Torque,
            false => DriveLawKind::Volts(ServoFirmware {
                gain: args.firmware_gain,
                duty_max: args.duty_max,
            }),
        },
    };
    let bar = context.progress("drives", None);
    let mut each = Vec::new();
    for data in data.by_joint()? {
        context.check()?;
        each.push(identify(&data, &|what| bar.label(what))?);
    }
    drop(bar);
    context.check()?;
    let Some(drives) = DriveResult::joined(&each) else {
        return Err(CliError::input("the logs hold no joint"));
    };
    let courses = joined_courses(&each);
    provenances.extend(links.map(|of| of.provenance));
    let file = DriveFile::new(&drives, env!("CARGO_PKG_VERSION"), &provenances);
    context.write_text(&args.output, &file.to_toml()?)?;
    let name = match args.logs.as_slice() {
        [one] => escape(&one.name()),
        many => format!("{} logs", many.len()),
    };
    let mut report = words::drive(&drives, &name);
    super::written(&mut report, &args.output);
    if let (Some(path), Some(first)) = (&args.plot, courses.first()) {
        context.write_text(path, &words::picture(&drives.drive.joints, first))?;
        super::written(&mut report, path);
    }
    if let Some(path) = &args.report {
        words::courses(&mut report, &drives.drive.joints, &courses);
        report.page().heading("Logs");
        report.page().list(&warnings);
        report
            .page()
            .list(names_of(&args.logs).iter().map(|name| escape(name)));
        report.page().code(&context.command);
        context.write_text(path, &report.html())?;
    }
    Ok(Outcome::new(
        report.text_for(context.screen),
        JsonDocument::new("drive", &provenances, &warnings, &drives)?,
    ))
}

/// What is found of logs, each sentence once with the logs that it holds for.
fn warnings<'a>(logs: impl Iterator<Item = &'a DriveLog>) -> Vec<String> {
    let mut all: Vec<(&str, Vec<String>)> = Vec::new();
    for log in logs {
        for finding in &log.findings {
            let name = escape(&log.name);
            match all.iter_mut().find(|(known, _)| known == finding) {
                Some((_, names)) => names.push(name),
                None => all.push((finding, vec![name])),
            }
        }
    }
    let sentence = |(finding, names): (&str, Vec<String>)| match names.as_slice() {
        [one] => format!("{one}: {finding}"),
        [first, ..] => format!("{first} and {} more logs: {finding}", names.len() - 1),
        [] => finding.to_owned(),
    };
    all.into_iter().map(sentence).collect()
}
