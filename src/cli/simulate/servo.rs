//! `simulate --servo`: a log of command and position of a servo on a pendulum rig.

use std::path::{Path, PathBuf};

use super::{Args, CliError, Context, LogFigures, Outcome, SimulationResult, write_truth};
use crate::cli::{arguments, file_name, typed};
use cft_ident_logs::output::{LogForm, LogWriter};
use cft_ident_plant::simulate::servo::{
    BenchMotion, ServoDrive, ServoPlant, ServoRig, ServoRun, run_servo,
};
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};

/// The motion of that name.
pub(super) fn motion(name: &str) -> Result<BenchMotion, String> {
    let known = BenchMotion::ALL;
    let found = known.into_iter().find(|motion| motion.name() == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|motion| motion.name()).collect();
        format!("the motions are {}", names.join(", "))
    })
}

/// A number of the servo or of its rig.
type ServoNumber = fn(&mut ServoNumbers) -> &mut f64;

/// Everything that --drive gives.
struct ServoNumbers {
    servo: ServoPlant,
    rig: ServoRig,
    speed_limit: f64,
    torque_limit: f64,
}

/// Their names and the least that each may be.
const NUMBERS: [(&str, f64, ServoNumber); 15] = [
    ("armature", 1e-9, |n| &mut n.servo.armature),
    ("viscous", 0.0, |n| &mut n.servo.viscous),
    ("coulomb", 0.0, |n| &mut n.servo.coulomb),
    ("load_friction", 0.0, |n| &mut n.servo.load_friction),
    ("kt", 1e-9, |n| &mut n.servo.kt),
    ("resistance", 1e-9, |n| &mut n.servo.resistance),
    ("supply", 1e-9, |n| &mut n.servo.supply),
    ("speed_limit", 1e-9, |n| &mut n.speed_limit),
    ("torque_limit", 1e-9, |n| &mut n.torque_limit),
    ("command_delay", 0.0, |n| &mut n.servo.command_delay),
    ("loop_delay", 0.0, |n| &mut n.servo.loop_delay),
    ("ticks", 16.0, |n| &mut n.servo.ticks),
    ("mass", 0.0, |n| &mut n.rig.mass),
    ("arm_mass", 1e-9, |n| &mut n.rig.arm_mass),
    ("length", 1e-9, |n| &mut n.rig.length),
];

/// `armature=0.03`.
pub(super) fn numbered(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text
        .split_once('=')
        .ok_or("is no NAME=X, such as armature=0.03")?;
    let (name, value) = (name.trim(), arguments::finite(value)?);
    let Some((_, least, _)) = NUMBERS.iter().find(|(known, ..)| *known == name) else {
        let names: Vec<&str> = NUMBERS.iter().map(|(known, ..)| *known).collect();
        return Err(format!("the names are {}", names.join(", ")));
    };
    match value >= *least {
        true => Ok((name.to_owned(), value)),
        false => Err(format!("{name} must be {least} or more")),
    }
}

/// Travel of a servo that holds on to its commands [rad].
const MOST_TRAVEL: f64 = 4.0 * std::f64::consts::PI;

/// Delays that the simulation remembers [s].
const LATEST_S: f64 = 1.0;

pub(super) fn run(
    motion: BenchMotion,
    args: &Args,
    truth: &Path,
    context: &Context,
) -> Result<Outcome, CliError> {
    let json = is_of_rig(&args.output);
    if json == args.kd.is_some() {
        let text = match json {
            true => "with --kd the log is a .csv",
            false => "without --kd the log is a .json",
        };
        return Err(CliError::usage(text).hint(
            "-o LOG.json for a servo that is driven by volts, -o LOG.csv with --kd for one that is driven by torque",
        ));
    }
    let urdf = args
        .kd
        .is_some()
        .then(|| args.output.with_extension("urdf"));
    context.check_outputs([], urdf.as_deref())?;
    let mut numbers = ServoNumbers {
        servo: ServoPlant::HOBBY,
        rig: ServoRig {
            mass: 0.6,
            arm_mass: 0.05,
            length: 0.15,
        },
        speed_limit: f64::INFINITY,
        torque_limit: f64::INFINITY,
    };
    for (name, value) in &args.drive {
        if let Some((_, _, place)) = NUMBERS.iter().find(|(known, ..)| known == name) {
            *place(&mut numbers) = *value;
        }
    }
    let mut servo = numbers.servo;
    for (name, late) in [
        ("command_delay", servo.command_delay),
        ("loop_delay", servo.loop_delay),
    ] {
        if late > LATEST_S {
            let text = format!("--drive {name}={late}: a delay is in seconds, {LATEST_S} at most");
            return Err(CliError::usage(text));
        }
    }
    servo.speed_limit = Some(numbers.speed_limit).filter(|limit| limit.is_finite());
    let limit = numbers.torque_limit;
    servo.drive = match args.kd {
        Some(kd) => ServoDrive::Torque { kd, limit },
        None => {
            // the largest torque at standstill is that of the largest duty
            let whole = servo.kt * servo.supply / servo.resistance;
            servo.duty_max = servo.duty_max.min(limit / whole);
            ServoDrive::Volts
        }
    };
    let kp = args.kp.unwrap_or(16.0);
    let made = run_servo(&servo, &numbers.rig, motion, kp, args.seed);
    // a hanging rod that swings over is thrown about
    if made
        .position
        .iter()
        .any(|q| q.is_nan() || q.abs() > MOST_TRAVEL)
    {
        return Err(
            CliError::input("this servo runs away: its loop is not stable")
                .hint("a lower --kp, a smaller delay, or more armature"),
        );
    }
    let summary = made.summary(env!("CARGO_PKG_VERSION"), args.seed);
    write_truth(truth, &summary, context)?;
    let figures = write(&made, &args.output, json, context)?;
    if let Some(urdf) = &urdf {
        context.write_text(urdf, &made.urdf())?;
    }
    let names = (file_name(&args.output), file_name(truth));
    let result = SimulationResult::of(&summary, args.seed, &figures, &names);
    let log = typed::quoted(&args.output.to_string_lossy());
    let next = match (&urdf, args.kd) {
        (Some(urdf), Some(kd)) => format!(
            "cft-ident drive {log} -r {} --command 'q_des_*' --kp {kp} --kd {kd} -o drive.toml",
            typed::quoted(&urdf.to_string_lossy())
        ),
        _ => format!("cft-ident drive {log} -o drive.toml"),
    };
    let text = format!(
        "written: {log}, {} rows of command and position\nwritten: {}\nNext: find the drive:\n       {next}\n",
        figures.rows,
        truth.display()
    );
    Ok(Outcome::new(
        context.text(text, &format!("written: {}", names.0)),
        JsonDocument::new("simulate", &[], &NO_WARNINGS, &result)?,
    ))
}

/// Writes the log as a rig's JSON or as a table.
fn write(
    made: &ServoRun,
    path: &Path,
    json: bool,
    context: &Context,
) -> Result<LogFigures, CliError> {
    let (header, rows) = made.table();
    let header = header.map(str::to_owned);
    let mut figures = LogFigures::default();
    let mut writer = match json {
        true => None,
        false => Some(LogWriter::create(path, &header)?),
    };
    for row in rows {
        if let Some(writer) = &mut writer {
            writer.row(row.iter().copied())?;
        }
        figures.add(&header, &row, 1.0);
    }
    match writer {
        Some(writer) => context.files.add_log(writer)?,
        None => context.write_text(path, &made.to_json())?,
    }
    Ok(figures)
}

/// Whether a file is to be a rig's log.
pub(super) fn is_of_rig(path: &Path) -> bool {
    path.extension().is_some_and(|end| end == "json")
}

/// A log to be written, or that of a rig.
pub(super) fn log_or_rig(text: &str) -> Result<PathBuf, String> {
    match is_of_rig(Path::new(text)) {
        true => Ok(PathBuf::from(text)),
        false => arguments::log_file(text)
            .map_err(|_| format!("must end in {}, or in .json with --servo", LogForm::ENDINGS)),
    }
}
