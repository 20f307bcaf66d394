//! `cft-ident example`: a small measured log with its robot file, so that everything can be tried.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Outcome, campaign};
use cft_ident_files::config;
use cft_ident_logs::log::unpacked;
use cft_ident_plant::simulate::held::SimulatedHolds;
use cft_ident_plant::simulate::servo::{BenchMotion, ServoPlant, ServoRig, run_servo};
use cft_ident_plant::simulate::wrist::SimulatedTool;
use cft_ident_report::report::json::{JsonDocument, NO_WARNINGS};
use cft_ident_report::report::table::{CellAlignment, Table};

const EXAMPLE: &str = "\
Example:
  cft-ident example
  cft-ident example ur10
  cft-ident example cft -o campaign";

/// Write a small log of a real machine with its robot file; without NAME, list what there is.
///
/// The logs are published ones, cut where they are long; their licence is written beside them. `cft`,
/// `wrist` and `holds` are simulated. A file that is there already and says something else stays, and is an error.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Machine
    #[arg(value_name = "NAME")]
    pub name: Option<ExampleMachine>,
    /// Folder to write into [default: the name]
    #[arg(short, long, value_name = "DIR", requires = "name")]
    pub output: Option<PathBuf>,
}

/// A machine whose log comes with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExampleMachine {
    /// UR10, six joints, 125 Hz, as CSV and as a recording of ROS 2
    Ur10,
    /// Staubli TX40, six joints, 5 kHz
    Tx40,
    /// One motor with cogging, current in A, 1 kHz
    Bldc,
    /// The built-in campaign of the CFT robot, simulated
    Cft,
    /// A servo on a pendulum rig, command and position, simulated
    Servo,
    /// A tool on a wrist force-torque sensor, 60 poses, simulated
    Wrist,
    /// A small arm that holds poses, sizes of currents without a sign, simulated
    Holds,
}

/// A file that the program carries.
enum ExampleContent {
    Plain(&'static [u8]),
    /// Compressed with zstd.
    Packed(&'static [u8]),
    /// A robot file that comes with the program.
    Config(&'static str),
    /// Simulated.
    Made(fn() -> String),
}

pub(super) struct Machine {
    name: &'static str,
    what: &'static str,
    /// Licence of its data; null of a simulation.
    licence: Option<&'static str>,
    origin: &'static str,
    files: &'static [(&'static str, ExampleContent)],
    /// Commands to go on with; `{}` is the folder.
    next: &'static str,
}

macro_rules! carried {
    ($name:literal) => {
        include_bytes!(concat!("../../data/", $name))
    };
}

static UR10: Machine = Machine {
    name: "ur10",
    what: "UR10, 6 joints, 27.5 s at 125 Hz; CSV, MCAP, URDF",
    licence: Some("BSD-3-Clause"),
    origin: "A measured motion of a UR10: /joint_states at 125 Hz, efforts of the controller [Nm].\n\
        Source: repository unisa-acg/inverse-dynamics-solver, commit 41e196de, BSD-3-Clause (LICENSE).\n\
        ur10.mcap holds its messages; ur10.csv the same numbers; ur10.urdf its ur10_robot.urdf.\n\
        ur10.toml is the robot file.\n",
    files: &[
        (
            "ur10.csv",
            ExampleContent::Packed(carried!("ur10/ur10.csv.zst")),
        ),
        (
            "ur10.mcap",
            ExampleContent::Plain(carried!("ur10/ur10.mcap")),
        ),
        (
            "ur10.urdf",
            ExampleContent::Plain(carried!("ur10/ur10.urdf")),
        ),
        ("ur10.toml", ExampleContent::Config("configs/ur10.toml")),
        ("LICENSE", ExampleContent::Plain(carried!("ur10/LICENSE"))),
    ],
    next: "cft-ident lsq {}/ur10.csv@0..70% -r {}/ur10.toml -o model.toml\n\
        cft-ident validate {}/ur10.csv@70..100% -m model.toml --report report.html\n",
};

static TX40: Machine = Machine {
    name: "tx40",
    what: "Staubli TX40, 6 joints, 6.3 s at 5 kHz; CSV, URDF",
    licence: Some("Apache-2.0"),
    origin: "A measured motion of a Staubli TX40, joint side [rad, Nm], at 5 kHz.\n\
        Source: repository thanhndv212/figaroh-examples, commit c0b5c7f0, examples/staubli_TX40,\n\
        Apache-2.0 (LICENSE, NOTICE).\n\
        Changed: positions and torques are converted from the motors' side to the joints; only the first\n\
        70 % of the record, for joints 5 and 6 hardly move in the rest.\n\
        tx40.toml is the robot file; the coupling of joints 5 and 6 is not declared in it.\n",
    files: &[
        (
            "tx40.csv",
            ExampleContent::Packed(carried!("tx40/tx40.csv.zst")),
        ),
        (
            "tx40.urdf",
            ExampleContent::Plain(carried!("tx40/tx40.urdf")),
        ),
        ("tx40.toml", ExampleContent::Config("configs/tx40.toml")),
        (
            "LICENSE",
            ExampleContent::Plain(include_bytes!("../../LICENSE-APACHE")),
        ),
        ("NOTICE", ExampleContent::Plain(carried!("tx40/NOTICE"))),
    ],
    next: "cft-ident lsq {}/tx40.csv -r {}/tx40.toml -o model.toml\n\
        cft-ident diagnose {}/tx40.csv -m model.toml -o refined.toml --report report.html\n",
};

static BLDC: Machine = Machine {
    name: "bldc",
    what: "one motor with cogging, 30 s at 1 kHz; CSV",
    licence: Some("BSD-3-Clause"),
    origin: "A measured BLDC motor at constant speeds: position [rad] and current [A] at about 1 kHz. The\n\
        compensation of its cogging is switched on after half of the log.\n\
        Source: repository heitor-andrade/laas_anti_cogging, commit eb0391d7, BSD-3-Clause (LICENSE).\n\
        bldc.toml is the robot file.\n",
    files: &[
        (
            "bldc.csv",
            ExampleContent::Packed(carried!("bldc/bldc.csv.zst")),
        ),
        ("bldc.toml", ExampleContent::Config("configs/bldc.toml")),
        ("LICENSE", ExampleContent::Plain(carried!("bldc/LICENSE"))),
    ],
    next: "cft-ident lsq {}/bldc.csv@15.2..23s -r {}/bldc.toml -o model.toml\n\
        cft-ident diagnose {}/bldc.csv@15.2..23s -m model.toml \\\n  \
        --holdout {}/bldc.csv@23..29.5s --report report.html\n",
};

/// The simulated one: its files are made.
static CFT: Machine = Machine {
    name: "cft",
    what: "CFT robot, 4 joints, simulated; a campaign of 6 logs",
    licence: None,
    origin: "",
    files: &[],
    next: "cft-ident identify {}/campaign.toml -o run\n",
};
/// Likewise.
static SERVO: Machine = Machine {
    name: "servo",
    what: "a servo on a pendulum rig, simulated; 15 logs of command and position",
    licence: None,
    origin: "A simulated servo on a pendulum rig: five motions at three gains, command and position at 200 Hz.\n\
        Its command comes late, and its firmware limits the speed of the set point: `drive` is to find how much.\n",
    files: &[],
    next: "cft-ident drive {}/*.json --holdout-where kp=16 -o servo.toml --report servo.html\n\
        cft-ident export -m servo.toml --mjcf-actuators servo.xml --kp 16\n",
};

/// The logs of its rig by name.
fn servo_logs() -> Vec<(String, Vec<u8>)> {
    let servo = ServoPlant {
        speed_limit: Some(4.8),
        command_delay: 0.032,
        ..ServoPlant::HOBBY
    };
    let rig = ServoRig {
        mass: 0.6,
        arm_mass: 0.05,
        length: 0.15,
    };
    let mut out = Vec::new();
    for kp in [8.0, 16.0, 32.0] {
        for motion in BenchMotion::ALL {
            let run = run_servo(&servo, &rig, motion, kp, SEED);
            out.push((run.file_name(), run.to_json().into_bytes()));
        }
    }
    out
}

/// Seed of its simulation: that of `identify`.
/// Simulated: made as it is written.
static WRIST: Machine = Machine {
    name: "wrist",
    what: "a tool on a wrist sensor whose bias drifts, simulated; 60 poses as CSV",
    licence: None,
    origin: "A simulated tool of 0.85 kg on a wrist force-torque sensor whose bias drifts over 60 poses.\n",
    files: &[(
        "wrist.csv",
        ExampleContent::Made(|| SimulatedTool::example().log(SEED)),
    )],
    next: "cft-ident tool {}/wrist.csv -o tool.toml --report tool.html\n\
        cft-ident export -m tool.toml --controller ur\n",
};

static HOLDS: Machine = Machine {
    name: "holds",
    what: "a small arm that holds 30 poses from both sides, simulated; CSV",
    licence: None,
    origin: "A simulated arm of two links whose servos log the size of the current alone: 30 poses, each held\n\
        from below and from above. holds.toml is the robot file.\n",
    files: &[
        (
            "holds.csv",
            ExampleContent::Made(|| SimulatedHolds::example().log(SEED)),
        ),
        (
            "holds.toml",
            ExampleContent::Made(|| SimulatedHolds::ROBOT.to_owned()),
        ),
    ],
    next: "cft-ident lsq --static {}/holds.csv -r {}/holds.toml -o gravity.toml\n\
        cft-ident export -m gravity.toml --python gravity.py\n",
};

/// Seed of simulations: that of `identify`.
const SEED: u64 = 1;

impl ExampleMachine {
    /// Its description and its log, by which it is identified; none of the simulated one, which has a campaign.
    pub(super) fn robot_and_log(self) -> Option<[&'static str; 2]> {
        match self {
            ExampleMachine::Ur10 => Some(["ur10.urdf", "ur10.csv"]),
            ExampleMachine::Tx40 => Some(["tx40.toml", "tx40.csv"]),
            ExampleMachine::Bldc => Some(["bldc.toml", "bldc.csv"]),
            ExampleMachine::Cft
            | ExampleMachine::Servo
            | ExampleMachine::Wrist
            | ExampleMachine::Holds => None,
        }
    }

    /// Whether `identify` makes a model of it.
    pub(super) fn is_robot(self) -> bool {
        self == ExampleMachine::Cft || self.robot_and_log().is_some()
    }

    pub(super) fn machine(self) -> &'static Machine {
        match self {
            ExampleMachine::Ur10 => &UR10,
            ExampleMachine::Tx40 => &TX40,
            ExampleMachine::Bldc => &BLDC,
            ExampleMachine::Cft => &CFT,
            ExampleMachine::Servo => &SERVO,
            ExampleMachine::Wrist => &WRIST,
            ExampleMachine::Holds => &HOLDS,
        }
    }
}

/// All examples, in the order of the list.
fn known() -> impl Iterator<Item = KnownExample> {
    let all = ExampleMachine::value_variants().iter();
    all.map(|of| of.machine()).map(|machine| KnownExample {
        name: machine.name,
        what: machine.what,
        licence: machine.licence,
    })
}

/// An example that can be written.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Known")]
struct KnownExample {
    name: &'static str,
    /// The machine and its files.
    what: &'static str,
    /// Licence of its data; null of a simulation.
    licence: Option<&'static str>,
}

/// Examples that there are, and what was written of the one that was asked for.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Examples")]
pub struct ExampleList {
    examples: Vec<KnownExample>,
    /// Null where none was asked for.
    written: Option<WrittenExample>,
}

/// An example in a folder.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Written")]
struct WrittenExample {
    name: &'static str,
    /// Folder as it was named.
    folder: String,
    files: Vec<String>,
    /// Commands to go on with, from the folder that the command ran in.
    next: Vec<String>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let text;
    let mut written = None;
    match args.name.map(ExampleMachine::machine) {
        None => text = list(),
        Some(machine) => {
            let folder = args.output.clone();
            let folder = folder.unwrap_or_else(|| PathBuf::from(machine.name));
            let files = write(machine, &folder, context)?;
            let shown = folder.display().to_string();
            let next = machine.next.replace("{}", shown.trim_end_matches('/'));
            let listed = format!("written to {shown}: {}", files.join(", "));
            let then = next.trim_end().replace('\n', "\n  ");
            text = context.text(format!("{listed}\n\ngo on with:\n  {then}\n"), &listed);
            written = Some(WrittenExample {
                name: machine.name,
                folder: shown,
                files,
                next: commands(&next),
            });
        }
    }
    let result = ExampleList {
        examples: known().collect(),
        written,
    };
    let document = JsonDocument::new("example", &[], &NO_WARNINGS, &result)?;
    Ok(Outcome::new(text, document))
}

fn list() -> String {
    let columns = ["name", "machine", "licence"].map(|name| (name, CellAlignment::Left));
    let mut table = Table::new(&columns);
    known().for_each(|known| table.row([known.name, known.what, known.licence.unwrap_or("")]));
    format!("{table}\ncft-ident example NAME writes it into the folder NAME\n")
}

/// Commands, continued lines as one.
fn commands(next: &str) -> Vec<String> {
    let whole = next.replace("\\\n  ", "");
    whole.lines().map(str::to_owned).collect()
}

/// Writes the files of an example into a folder; their names.
pub(super) fn write(
    machine: &Machine,
    folder: &Path,
    context: &Context,
) -> Result<Vec<String>, CliError> {
    let unusable = |e: &dyn std::fmt::Display| {
        CliError::output(format!("cannot write into {}: {e}", folder.display()))
            .hint("name another folder with -o")
    };
    let make_folder = || context.files.make_folder(folder).map_err(|e| unusable(&e));
    if std::ptr::eq(machine, &CFT) {
        let robot = config::embedded(Path::new(campaign::ROBOT)).unwrap_or_default();
        stays(&folder.join("robot.toml"), robot.as_bytes())?;
        make_folder()?;
        let (files, warnings) = campaign::simulate(folder, SEED, context)?;
        warnings.iter().for_each(|warning| context.warn(warning));
        return Ok(files);
    }
    let mut contents: Vec<(String, Vec<u8>)> = Vec::with_capacity(machine.files.len() + 1);
    if std::ptr::eq(machine, &SERVO) {
        contents = servo_logs();
    }
    for (name, content) in machine.files {
        let bytes = match content {
            ExampleContent::Plain(bytes) => bytes.to_vec(),
            ExampleContent::Packed(bytes) => unpacked(bytes).map_err(|e| unusable(&e))?,
            ExampleContent::Made(made) => made().into_bytes(),
            ExampleContent::Config(path) => {
                config::embedded(Path::new(path)).unwrap_or_default().into()
            }
        };
        contents.push(((*name).to_owned(), bytes));
    }
    contents.push(("README.txt".to_owned(), machine.origin.into()));
    for (name, bytes) in &contents {
        stays(&folder.join(name), bytes)?;
    }
    make_folder()?;
    for (name, bytes) in &contents {
        context.files.write(&folder.join(name), bytes)?;
    }
    Ok(contents.into_iter().map(|(name, _)| name).collect())
}

/// A file that is there and says something else is the user's.
fn stays(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    match std::fs::read(path) {
        Ok(there) if there != bytes => Err(CliError::output(format!(
            "{} is there already and is not that of the example",
            path.display()
        ))
        .hint("name another folder with -o, or delete the file")),
        _ => Ok(()),
    }
}
