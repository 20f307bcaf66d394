//! Plants of the study and their robot files: the CFT robot, a serial arm and two single drives, whose declared law
//! of friction has the plant's form.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use cft_ident::simulate::chance::{Purpose, stream};
use rand::RngExt;
use serde_json::Value;

use crate::tool::run;

const CFT: &str = include_str!("../../../../configs/cft.toml");
const ARM_URDF: &str = include_str!("../study_setup/arm.urdf");
/// Names of the arm's joints.
const ARM: [&str; 4] = ["turn", "lift", "elbow", "roll"];

/// A machine of the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Machine {
    Cft,
    Arm,
    Slide,
    Wheel,
}

/// How steep the plant's friction is at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Declared as viscous and Coulomb friction; the plant's is as steep as its integration carries.
    Jump,
    Sharp,
    Usual,
    Soft,
}

impl Law {
    pub fn words(self) -> &'static str {
        match self {
            Law::Jump => "jumps at rest",
            Law::Sharp => "tanh, up to 240 s/rad",
            Law::Usual => "tanh, up to 60 s/rad",
            Law::Soft => "tanh, up to 15 s/rad",
        }
    }

    /// Slopes over those of the CFT robot.
    fn times(self) -> f64 {
        match self {
            Law::Jump | Law::Usual => 1.0,
            Law::Sharp => 4.0,
            Law::Soft => 0.25,
        }
    }
}

impl Machine {
    pub fn words(self) -> &'static str {
        match self {
            Machine::Cft => "CFT robot",
            Machine::Arm => "serial arm of four joints",
            Machine::Slide => "single drive, slides",
            Machine::Wheel => "single drive, turns",
        }
    }

    pub fn joints(self) -> &'static [&'static str] {
        match self {
            Machine::Cft => &["q1", "q2", "q4", "q5"],
            Machine::Arm => &ARM,
            Machine::Slide => &["slide"],
            Machine::Wheel => &["wheel"],
        }
    }

    /// Coordinates of motions, and the box of poses that point-to-point motions go through.
    pub fn poses(self) -> (&'static str, &'static [[f64; 2]]) {
        match self {
            Machine::Cft => (
                "cartesian",
                &[[-0.22, -0.05], [0.08, 0.45], [2.1, 2.7], [0.14, 0.33]],
            ),
            Machine::Arm => ("joint", &[[-0.6, 0.6]; 4]),
            Machine::Slide => ("joint", &[[0.03, 0.22]]),
            Machine::Wheel => ("joint", &[[-1.0, 1.0]]),
        }
    }

    /// The robot file; `fitted`: friction is fitted with the inertias.
    fn robot(self, law: Law, fitted: bool) -> String {
        let own = match law {
            Law::Jump => "viscous-coulomb",
            _ => "double-tanh",
        };
        if self == Machine::Cft {
            let with = format!("[friction]\nfitted_with_inertias = {fitted}");
            return CFT.replace("[friction]", &with);
        }
        let (model, band) = match self {
            Machine::Arm => ("model = \"serial\"\nurdf = \"arm.urdf\"", 10.0),
            Machine::Slide => (
                "model = \"single-joint\"\njoint = \"slide\"\nkind = \"prismatic\"",
                20.0,
            ),
            _ => (
                "model = \"single-joint\"\njoint = \"wheel\"\nkind = \"revolute\"",
                20.0,
            ),
        };
        let mut text = format!(
            "[robot]\n{model}\n\n[friction]\nlaw = \"{own}\"\nfitted_with_inertias = {fitted}\n\n\
             [log]\ntorque_is = \"joint\"\ntorque_held = true\n\n[filter]\ncutoff_hz = {band:?}\n\n\
             [sensors]\ntorque_noise_relative = 0.01\n"
        );
        for joint in self.joints() {
            let [position, speed, acceleration] = match self {
                Machine::Arm => ["[-1.2, 1.2]", "2.0", "25.0"],
                Machine::Slide => ["[0.0, 0.25]", "0.4", "4.0"],
                _ => ["[-1.5, 1.5]", "3.0", "30.0"],
            };
            let _ = write!(
                text,
                "\n[limits.{joint}]\nposition = {position}\nspeed = {speed}\nacceleration = {acceleration}\n"
            );
        }
        text
    }

    /// Nominal numbers that no robot file holds: name, joint, value.
    fn nominal(self, law: Law) -> Vec<(&'static str, &'static str, f64)> {
        let friction = |joint: &'static str, [viscous, coulomb]: [f64; 2], times: f64| match law {
            Law::Jump => vec![("viscous", joint, viscous), ("coulomb", joint, coulomb)],
            _ => vec![
                ("viscous", joint, viscous),
                ("coulomb_1", joint, 0.7 * coulomb),
                ("coulomb_2", joint, 0.3 * coulomb),
                ("slope_1", joint, 60.0 * times * law.times()),
                ("slope_2", joint, 20.0 * times * law.times()),
            ],
        };
        match self {
            Machine::Cft => Vec::new(),
            Machine::Arm => (ARM.iter().enumerate())
                .flat_map(|(j, joint)| {
                    let size = 1.0 - 0.2 * j as f64;
                    let mut own = friction(joint, [3.0 * size, 2.0 * size], 1.0);
                    own.push(("drive_inertia", joint, 0.3 * size * size));
                    own
                })
                .collect(),
            // a tenth of a metre stands for a radian
            Machine::Slide => [
                vec![("inertia", "", 95.0)],
                friction("slide", [200.0, 20.0], 10.0),
            ]
            .concat(),
            Machine::Wheel => [
                vec![("inertia", "", 0.5)],
                friction("wheel", [1.0, 2.0], 1.0),
            ]
            .concat(),
        }
    }
}

fn parameter(text: &mut String, name: &str, joint: Option<&str>, value: f64) {
    let joint = joint.map_or(String::new(), |joint| format!("joint = \"{joint}\"\n"));
    let _ = write!(
        text,
        "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value:?}\nunit = \"SI\"\n"
    );
}

/// What campaigns of a machine with a law share: `robot.toml`, `nominal.toml`, and the motions that `excite` designs for
/// them. They are made once.
pub struct Designs {
    folder: PathBuf,
    machine: Machine,
    law: Law,
}

/// Two campaigns that want the same design wait for each other.
static MAKING: Mutex<()> = Mutex::new(());

impl Designs {
    /// Their folder within another; `fitted`: friction is fitted with the inertias.
    ///
    /// # Errors
    /// What the tool says of a plant that it cannot simulate.
    pub fn of(root: &Path, machine: Machine, law: Law, fitted: bool) -> Result<Self, String> {
        let own = if fitted { "fitted" } else { "one-joint" };
        let designs = Designs {
            folder: root.join(format!("{machine:?}-{law:?}-{own}")),
            machine,
            law,
        };
        designs.once("nominal.toml", || designs.nominal(fitted))?;
        Ok(designs)
    }

    /// A file of the folder, made where it is not there.
    fn once(&self, name: &str, make: impl Fn() -> Result<(), String>) -> Result<PathBuf, String> {
        let _one = MAKING.lock().map_err(|error| error.to_string())?;
        let path = self.folder.join(name);
        if !path.exists() {
            std::fs::create_dir_all(&self.folder).expect("the folder can be made");
            make()?;
        }
        Ok(path)
    }

    fn put(&self, name: &str, text: &str) {
        std::fs::write(self.folder.join(name), text).expect("a design is written");
    }

    fn nominal(&self, fitted: bool) -> Result<(), String> {
        let (machine, law) = (self.machine, self.law);
        let robot = machine.robot(law, fitted);
        self.put("arm.urdf", ARM_URDF);
        self.put("robot.toml", &robot);
        let mut given = robot.clone();
        for (name, joint, value) in machine.nominal(law) {
            let joint = (!joint.is_empty()).then_some(joint);
            parameter(&mut given, name, joint, value);
        }
        self.put("given.toml", &given);
        // the plant tells all its numbers
        let mut words = vec!["-o", "brief.csv", "--seconds", "12"];
        if machine != Machine::Cft {
            words.extend(["-m", "given.toml", "--move", machine.joints()[0]]);
        }
        done(&self.folder, "simulate -r robot.toml", &words)?;
        let told = std::fs::read_to_string(self.folder.join("brief.truth.toml"));
        let told: toml::Table = toml::from_str(&told.expect("it was written")).expect("TOML");
        let parameters = told["parameter"].as_array().expect("parameters");
        let slopes = match machine {
            Machine::Cft => law.times(),
            _ => 1.0,
        };
        let mut text = robot;
        for p in parameters {
            let name = p["name"].as_str().expect("a name");
            let own = if name.starts_with("slope_") {
                slopes
            } else {
                1.0
            };
            let joint = p.get("joint").and_then(toml::Value::as_str);
            let value = p["value"].as_float().expect("a number");
            parameter(&mut text, name, joint, own * value);
        }
        self.put("nominal.toml", &text);
        Ok(())
    }

    /// A motion by `excite` with these options.
    ///
    /// # Errors
    /// What the tool says where there is none.
    pub fn motion(&self, options: &[&str]) -> Result<PathBuf, String> {
        let name = format!("designed{}.toml", options.concat());
        self.once(&name, || {
            let words = "excite -r robot.toml -m nominal.toml -o";
            done(&self.folder, words, &[&[name.as_str()], options].concat()).map(drop)
        })
    }

    /// Writes the robot file and `truth.toml`, each number within 15 % of the nominal one, into a campaign's folder.
    pub fn vary(&self, folder: &Path, seed: u64) {
        for name in ["robot.toml", "arm.urdf"] {
            let copied = std::fs::copy(self.folder.join(name), folder.join(name));
            copied.expect("a file of the campaign is written");
        }
        let text = std::fs::read_to_string(self.folder.join("nominal.toml"));
        let mut file: toml::Table = toml::from_str(&text.expect("it is there")).expect("TOML");
        let mut chance = stream(seed, Purpose::Plant);
        let parameters = file["parameter"].as_array_mut().expect("parameters");
        for p in parameters {
            let value = p["value"].as_float().expect("a number");
            p["value"] = (value * (1.0 + 0.15 * chance.random_range(-1.0..=1.0))).into();
        }
        std::fs::write(folder.join("truth.toml"), file.to_string()).expect("it is written");
    }
}

/// Runs a command in a folder, and gives its JSON document.
///
/// # Errors
/// What it says where it fails.
pub fn done(folder: &Path, words: &str, more: &[&str]) -> Result<Value, String> {
    let mut all: Vec<&str> = words.split(' ').collect();
    all.extend(more);
    let done = run(folder, &all);
    match done.status {
        0 => Ok(done.document),
        _ => Err(format!("{words}: {}", done.message.trim())),
    }
}
