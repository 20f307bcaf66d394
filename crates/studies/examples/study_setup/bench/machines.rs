//! The machines of the bench: seven that were measured, the CFT robot and an arm that are simulated.

use std::path::{Path, PathBuf};

use super::robot_text;
use super::table::Table;
use super::tool::run;

/// A joint, or a motor where channels are the motors', and its columns.
#[derive(Debug, Clone)]
pub struct Joint {
    pub name: String,
    pub position: String,
    pub torque: String,
    /// A turn in the unit of the column; none where the joint slides.
    pub turn: Option<f64>,
}

impl Joint {
    /// SI units in one of the column's.
    pub fn in_si(&self) -> f64 {
        self.turn.map_or(1.0, |turn| std::f64::consts::TAU / turn)
    }
}

/// A machine with logs in which nothing is wrong.
#[derive(Debug, Clone)]
pub struct Machine {
    pub name: &'static str,
    pub robot: toml::Table,
    /// A URDF that the robot file names.
    pub urdf: Option<String>,
    pub joints: Vec<Joint>,
    pub logs: Vec<Table>,
    /// A model file that holds the friction, where it is not fitted with the inertias.
    pub friction: Option<String>,
}

impl Machine {
    /// Whether gravity has a direction in its robot file.
    pub fn serial(&self) -> bool {
        self.robot["robot"]["model"].as_str() == Some("serial")
    }

    /// Whether its channels are those of motors and not of joints.
    pub fn of_motors(&self) -> bool {
        self.name == "cft-motors"
    }

    /// Torque at the joint for one unit of its column, as the robot file declares it.
    pub fn torque_of_column(&self, joint: usize) -> f64 {
        let scale = || {
            let channels = self.robot.get("log")?.get("joint")?;
            channels
                .get(&self.joints[joint].name)?
                .get("torque_scale")?
                .as_float()
        };
        scale().unwrap_or(1.0)
    }

    pub fn torques(&self) -> Vec<String> {
        self.joints.iter().map(|j| j.torque.clone()).collect()
    }

    /// The machine with the same logs cut to a share of their rows.
    pub fn span(&self, from: f64, to: f64) -> Self {
        let mut out = self.clone();
        out.logs = out.logs.into_iter().map(|log| log.span(from, to)).collect();
        out
    }
}

/// Names of all machines, in the order of the table.
pub const NAMES: [&str; 10] = [
    "emps",
    "tx40",
    "panda",
    "ur10",
    "kr300",
    "pendulum",
    "bldc",
    "cft",
    "cft-motors",
    "arm",
];

/// The machine of this name; nothing, said aloud, where its log is not there. What is simulated is
/// kept in `folder`.
pub fn machine(name: &str, folder: &Path) -> Option<Machine> {
    let found = match name {
        "emps" => measured("emps", &["q1"], "q#", "tau#", "t", &["emps/emps_id.csv"]),
        "tx40" => measured("tx40", &[], "q#", "tau#", "t", &["tx40/tx40_joint.csv"])
            // 45000 rows at 5 kHz: a tenth of a second of the processor less for each fit
            .map(|m| each(m, |log, torques| log.thinned(5, torques))),
        "panda" => measured(
            "panda",
            &[],
            "q#",
            "tau#",
            "t",
            &["panda/panda_exciting.csv"],
        )
        .map(|m| m.span(0.0, 0.6)),
        "ur10" => measured("ur10", &[], "q#", "tau#", "t", &["ur10/ur10_exciting.csv"]),
        "kr300" => measured(
            "kr300",
            &[],
            "act_pos_mot_deg_#",
            "act_torque_abs_nm_#",
            "time",
            &["kr300/A.csv", "kr300/B.csv"],
        ),
        "pendulum" => measured("pendulum", &[], "pos#", "tau#", "time", &PENDULUM),
        "bldc" => measured(
            "bldc",
            &["motor"],
            "Position",
            "Iq",
            "Time",
            &["bldc-cogging/speed_test1.txt"],
        )
        .map(|m| each(m, |log, _| log.between(0.5, 10.0))),
        "cft" => cft(folder, "q_#", "tau_#", &["q1", "q2", "q4", "q5"]),
        "cft-motors" => cft(folder, "x_#", "u_#", &["c1", "c2", "c3", "c4"]),
        "arm" => Some(arm(folder)),
        _ => None,
    };
    if found.is_none() {
        eprintln!(
            "SKIPPED: the log of {name} is not there (docs/results/measured/data.md says where it is from)"
        );
    }
    found
}

/// Logs of one rate; those in which the motors are off among them.
const PENDULUM: [&str; 5] = [
    "pendulum/060143.csv",
    "pendulum/060245.csv",
    "pendulum/060329.csv",
    "pendulum/060440.csv",
    "pendulum/061705.csv",
];

fn each(mut machine: Machine, change: impl Fn(Table, &[String]) -> Table) -> Machine {
    let torques = machine.torques();
    let logs = machine.logs.into_iter().map(|log| change(log, &torques));
    machine.logs = logs.collect();
    machine
}

/// Folder of the measured logs.
pub fn data() -> PathBuf {
    Path::new(cft_ident_support::ROOT).join("../shared/data")
}

pub fn robot(name: &str) -> toml::Table {
    let configs = Path::new(cft_ident_support::ROOT).join("configs");
    let text = std::fs::read_to_string(configs.join(format!("{name}.toml")));
    toml::from_str(&text.expect("it comes with the tool")).expect("a robot file")
}

/// A measured machine: `#` in the names of columns stands for the number of the joint.
fn measured(
    name: &'static str,
    joints: &[&str],
    position: &str,
    torque: &str,
    time: &str,
    files: &[&str],
) -> Option<Machine> {
    let mut robot = robot(name);
    robot_text::forget_velocities(&mut robot);
    let mut names: Vec<String> = joints.iter().map(|&j| j.to_owned()).collect();
    if names.is_empty() {
        names = robot_text::joint_names(&robot);
    }
    let joints: Vec<Joint> = (1..)
        .zip(&names)
        .map(|(n, joint)| Joint {
            name: joint.clone(),
            position: position.replace('#', &n.to_string()),
            torque: torque.replace('#', &n.to_string()),
            turn: match name {
                "emps" => None,
                "kr300" => Some(360.0),
                _ => Some(std::f64::consts::TAU),
            },
        })
        .collect();
    let keep = columns(time, &joints);
    let logs = files
        .iter()
        .map(|file| Table::read(&data().join(file), &keep));
    Some(Machine {
        name,
        robot,
        urdf: None,
        logs: logs.collect::<Option<_>>()?,
        joints,
        friction: None,
    })
}

fn columns(time: &str, joints: &[Joint]) -> Vec<String> {
    let mut keep = vec![time.to_owned()];
    keep.extend(joints.iter().map(|joint| joint.position.clone()));
    keep.extend(joints.iter().map(|joint| joint.torque.clone()));
    keep
}

/// The CFT robot along the motion of its campaign, its friction identified from one-joint logs as the
/// campaign does.
fn cft(folder: &Path, position: &str, torque: &str, channels: &[&str]) -> Option<Machine> {
    let kept = folder.join("cft");
    let (log, friction) = (kept.join("identification.csv"), kept.join("friction.toml"));
    if !log.exists() || !friction.exists() {
        let made = run(folder, &["identify", "-o", "cft"]);
        assert_eq!(made.status, 0, "{}", made.message);
    }
    let turns = position.starts_with("q_");
    let joints: Vec<Joint> = channels
        .iter()
        .map(|&channel| Joint {
            name: match turns {
                true => channel.to_owned(),
                false => format!("x_{channel}"),
            },
            position: position.replace('#', channel),
            torque: match turns {
                true => torque.replace('#', channel),
                false => torque.replace('#', &channel[1..]),
            },
            turn: (turns && channel != "q1" || channel == "c3").then_some(std::f64::consts::TAU),
        })
        .collect();
    let table = Table::read(&log, &columns("t", &joints))?;
    Some(Machine {
        name: if turns { "cft" } else { "cft-motors" },
        robot: robot("cft"),
        urdf: None,
        // 39 s of a motion of 5 s that repeats itself
        logs: vec![table.span(0.0, 0.4)],
        joints,
        friction: Some(std::fs::read_to_string(friction).ok()?),
    })
}

const ARM_URDF: &str = include_str!("../arm.urdf");
const ARM: &str = r#"
[robot]
model = "serial"
urdf = "arm.urdf"

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
torque_is = "joint"

[filter]
cutoff_hz = 10.0

[sensors]
torque_noise_relative = 0.02
"#;

/// An arm of four joints, simulated by the plant of the tool, whose dynamics are not the estimator's.
fn arm(folder: &Path) -> Machine {
    let names = ["turn", "lift", "elbow", "roll"];
    let log = folder.join("arm.csv");
    if !log.exists() {
        let mut truth = ARM.to_owned();
        let mut motion =
            "kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.1\n".to_owned();
        for (j, joint) in names.iter().enumerate() {
            let size = 1.0 - 0.2 * j as f64;
            for (name, value) in [
                ("drive_inertia", 0.3 * size * size),
                ("viscous", 3.0 * size),
                ("coulomb", 2.0 * size),
                ("offset", 0.0),
            ] {
                truth += &format!(
                    "\n[[parameter]]\nname = \"{name}\"\njoint = \"{joint}\"\nvalue = {value:?}\nunit = \"SI\"\n"
                );
            }
            let terms = |shift: f64| {
                let term = |l: usize| 0.55 * (1.7 * j as f64 + 2.3 * l as f64 + shift).sin();
                (1..=5)
                    .map(|l| format!("{:.4}", term(l)))
                    .collect::<Vec<_>>()
                    .join(", ")
            };
            motion += &format!(
                "\n[[coordinate]]\nname = \"{joint}\"\noffset = 0.0\na = [{}]\nb = [{}]\n",
                terms(0.0),
                terms(0.9)
            );
        }
        let files = [
            ("arm.urdf", ARM_URDF),
            ("arm-robot.toml", ARM),
            ("arm-truth.toml", &truth),
            ("arm-motion.toml", &motion),
        ];
        for (name, text) in files {
            std::fs::write(folder.join(name), text).expect("the arm's files are written");
        }
        let words = "simulate -r arm-robot.toml -m arm-truth.toml --reference arm-motion.toml \
                     --seconds 12 --seed 3 -o arm.csv";
        let made = run(folder, &words.split_whitespace().collect::<Vec<_>>());
        assert_eq!(made.status, 0, "{}", made.message);
    }
    let joints: Vec<Joint> = names
        .iter()
        .map(|name| Joint {
            name: (*name).to_owned(),
            position: format!("q_{name}"),
            torque: format!("tau_{name}"),
            turn: Some(std::f64::consts::TAU),
        })
        .collect();
    let table = Table::read(&log, &columns("t", &joints)).expect("it was simulated");
    Machine {
        name: "arm",
        robot: toml::from_str(ARM).expect("a robot file"),
        urdf: Some(ARM_URDF.to_owned()),
        logs: vec![table],
        joints,
        friction: None,
    }
}
