//! A clean campaign: the plant simulated along its motions, identified and diagnosed by the tool's commands.

use std::fmt::Write as _;
use std::path::Path;

use cft_ident::config::ModelFile;
use cft_ident::diagnose::SelectionLimits;
use cft_ident::identify::{
    Control, DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, Log, LoggedRobot, diagnose,
};
use cft_ident::log::LogSpec;
use rand::{RngExt, SeedableRng};
use serde_json::{Value, json};

use crate::plants::{Designs, Law, Machine, done};

/// The motion that the inertias are fitted on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    Table3,
    /// By `excite`, at a fundamental frequency \[Hz\].
    Designed(f64),
    Points,
    /// One joint's ladder of speeds: all there is of a single drive.
    Ladder(Ladder),
}

/// What makes ladders of speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ladder {
    Move,
    Excite,
}

/// What is known of friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Friction {
    /// Fitted with the inertias.
    Fitted,
    /// From one-joint logs, which the diagnosis gets too or does not.
    OneJoint { by: Ladder, given: bool },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Campaign {
    pub machine: Machine,
    pub law: Law,
    pub motion: Motion,
    pub friction: Friction,
    /// By which the plant and all noise are drawn.
    pub plant: u64,
}

impl Motion {
    pub fn words(self) -> String {
        match self {
            Motion::Table3 => "Table 3".to_owned(),
            Motion::Designed(hz) => format!("designed at {hz} Hz"),
            Motion::Points => "point to point".to_owned(),
            Motion::Ladder(Ladder::Move) => "a ladder by `--move`".to_owned(),
            Motion::Ladder(Ladder::Excite) => "a ladder by `excite --joint`".to_owned(),
        }
    }
}

impl Friction {
    pub fn words(self) -> &'static str {
        match self {
            Friction::Fitted => "none",
            Friction::OneJoint { by, given } => match (by, given) {
                (Ladder::Move, false) => "by `--move`, for friction alone",
                (Ladder::Move, true) => "by `--move`, diagnosed too",
                (Ladder::Excite, false) => "by `excite --joint`, for friction alone",
                (Ladder::Excite, true) => "by `excite --joint`, diagnosed too",
            },
        }
    }
}

/// All campaigns of a seed: every motion with every way to friction, in turn by each law; drives with every law.
pub fn of_seed(seed: u64) -> Vec<Campaign> {
    let mut friction = vec![Friction::Fitted];
    for by in [Ladder::Move, Ladder::Excite] {
        friction.extend([false, true].map(|given| Friction::OneJoint { by, given }));
    }
    let [low, high] = [0.2, 0.4].map(Motion::Designed);
    let ladders = [Ladder::Move, Ladder::Excite].map(Motion::Ladder);
    let mut out = Vec::new();
    let mut add = |machine, law, motion, friction| {
        out.push(Campaign {
            machine,
            law,
            motion,
            friction,
            // a plant of its own for every campaign
            plant: 1000 * seed + out.len() as u64,
        });
    };
    // the plant of an arm's light joints cannot jump, and a declared jump would truly be smooth
    let arms: [(Machine, &[Law], &[Motion]); 2] = [
        (
            Machine::Cft,
            &[Law::Usual, Law::Sharp, Law::Soft],
            &[Motion::Table3, low, high, Motion::Points],
        ),
        (
            Machine::Arm,
            &[Law::Sharp, Law::Soft],
            &[low, high, Motion::Points],
        ),
    ];
    for (machine, laws, motions) in arms {
        for (m, motion) in motions.iter().enumerate() {
            for (f, friction) in friction.iter().enumerate() {
                let law = laws[(m + f + seed as usize) % laws.len()];
                add(machine, law, *motion, *friction);
            }
        }
    }
    for drive in [Machine::Slide, Machine::Wheel] {
        for motion in [low, high, Motion::Points, ladders[0], ladders[1]] {
            for law in [Law::Jump, Law::Sharp, Law::Soft] {
                add(drive, law, motion, Friction::Fitted);
            }
        }
    }
    out
}

impl Campaign {
    /// By which a finished campaign is known again.
    pub fn key(&self) -> String {
        let (motion, friction) = (self.motion.words(), self.friction.words());
        format!(
            "{} {:?}, {:?}, {motion}, {friction}",
            self.plant, self.machine, self.law
        )
    }

    /// Runs it in a folder of its own, with designs from another.
    pub fn run(&self, folder: &Path, designs: &Path) -> Value {
        let mut row = json!({
            "key": self.key(),
            "machine": self.machine.words(),
            "friction law": self.law.words(),
            "motion": self.motion.words(),
            "one-joint logs": self.friction.words(),
        });
        match self.diagnosed(folder, designs) {
            Ok(found) => {
                for (key, value) in found.as_object().into_iter().flatten() {
                    row[key] = value.clone();
                }
            }
            Err(message) => row["error"] = message.into(),
        }
        row
    }

    fn diagnosed(&self, folder: &Path, designs: &Path) -> Result<Value, String> {
        let tool = |words: &str, more: &[&str]| done(folder, words, more);
        let fitted = self.friction == Friction::Fitted;
        let designs = Designs::of(designs, self.machine, self.law, fitted)?;
        designs.vary(folder, self.plant);
        let joints = self.machine.joints();
        let simulated = |log: &str, along: &[&str], seed: u64| {
            let seed = (10 * self.plant + seed).to_string();
            let words = "simulate -r robot.toml -m truth.toml --seed";
            tool(words, &[&[seed.as_str(), "-o", log], along].concat()).map(drop)
        };
        let designed = |options: &[&str], log: &str, seed: u64| {
            std::fs::copy(designs.motion(options)?, folder.join("designed.toml"))
                .expect("a design is copied");
            simulated(log, &["--reference", "designed.toml"], seed)
        };
        let ladder = |joint: &str, by: Ladder, log: &str, seed: u64| match by {
            Ladder::Move => simulated(log, &["--seconds", "20", "--move", joint], seed),
            Ladder::Excite => designed(&["--joint", joint], log, seed),
        };
        let mut logs = vec!["id.csv".to_owned()];
        match self.motion {
            Motion::Ladder(by) => ladder(joints[0], by, "id.csv", 9)?,
            Motion::Table3 => simulated("id.csv", &["--seconds", "20"], 9)?,
            Motion::Designed(hz) => {
                // some 20 s either way, five motions in turn
                let (hz, periods) = (hz.to_string(), ((20.0 * hz) as u32).to_string());
                let seed = (1 + self.plant % 5).to_string();
                let options = ["--frequency", &hz, "--periods", &periods, "--seed", &seed];
                designed(&options, "id.csv", 9)?;
            }
            Motion::Points => {
                let points = self.points();
                std::fs::write(folder.join("points.toml"), points).expect("points are written");
                simulated("id.csv", &["--reference", "points.toml"], 9)?;
            }
        }
        if let Friction::OneJoint { by, given } = self.friction {
            let own: Vec<String> = joints.iter().map(|joint| format!("{joint}.csv")).collect();
            for (j, (joint, log)) in joints.iter().zip(&own).enumerate() {
                ladder(joint, by, log, j as u64)?;
            }
            let names: Vec<&str> = own.iter().map(String::as_str).collect();
            tool("friction -r robot.toml -o friction.toml", &names)?;
            tool(
                "lsq id.csv -r robot.toml -m friction.toml -o model.toml",
                &[],
            )?;
            if given {
                logs.extend(own);
            }
        } else {
            let estimator = match self.law {
                Law::Jump => "wls",
                _ => "oe",
            };
            let words = "lsq id.csv -r robot.toml -o model.toml --estimator";
            tool(words, &[estimator])?;
        }
        let names: Vec<&str> = logs.iter().map(String::as_str).collect();
        let found = tool("diagnose -m model.toml", &names)?;
        let steps = found["steps"].as_array().into_iter().flatten();
        let steps = steps.map(|s| {
            let word = |key: &str| s[key].as_str().unwrap_or_default();
            format!("{} of {}", word("effect"), word("joint"))
        });
        Ok(json!({
            "verdict": found["verdict"],
            "steps": steps.collect::<Vec<_>>(),
            "chance": lowest(folder, &names)?,
        }))
    }

    /// A pose a second, a fifth of it at rest.
    fn points(&self) -> String {
        let (coordinates, spans) = self.machine.poses();
        let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(self.plant ^ 0x901);
        let mut text = format!("kind = \"points\"\ncoordinates = \"{coordinates}\"\n");
        for k in 0..20 {
            let pose: Vec<f64> = spans
                .iter()
                .map(|s| chance.random_range(s[0]..s[1]))
                .collect();
            for t in [f64::from(k), f64::from(k) + 0.2] {
                let _ = write!(text, "\n[[point]]\nt = {t:?}\nposition = {pose:?}\n");
            }
        }
        text
    }
}

/// The lowest chance value of the first search by placebos over ALL candidates that gain in the criterion: every other
/// test lets pass whatever comes, and nothing is added. None where no candidate gains.
fn lowest(folder: &Path, logs: &[&str]) -> Result<Option<f64>, String> {
    let path = folder.join("model.toml");
    let text = std::fs::read_to_string(&path).expect("the model was written");
    let file = ModelFile::parse_in("model.toml", &text, Some(folder))
        .map_err(|error| error.to_string())?;
    let machine = LoggedRobot::new("model.toml", file.robot.clone());
    let log = |name: &&str| {
        let spec = folder.join(name).display().to_string().parse::<LogSpec>();
        spec.map(Log::from).map_err(|error| error.to_string())
    };
    let train: Result<Vec<Log>, String> = logs.iter().map(log).collect();
    let logs = DiagnoseLogs {
        train: &train?,
        ..DiagnoseLogs::default()
    };
    let settings = DiagnoseSettings {
        limits: SelectionLimits {
            false_alarm: 0.0,
            unique_share: 0.0,
            cv_gain: f64::NEG_INFINITY,
            cv_certainty: f64::NEG_INFINITY,
            veto_ratio: f64::INFINITY,
            worth: 0.0,
            over_noise: 0.0,
            deviations: false,
            ..SelectionLimits::default()
        },
        ..DiagnoseSettings::default()
    };
    let model = ("model.toml", &file);
    match diagnose(&machine, model, &logs, &settings, &Control::default()) {
        Ok(DiagnoseEnd::Diagnosed(found)) => {
            let all = found.diagnosis.candidates.iter();
            Ok(all.filter_map(|c| c.placebo_p_value).reduce(f64::min))
        }
        Ok(DiagnoseEnd::DataFault(fault)) => Err(fault.effect),
        Err(error) => Err(error.to_string()),
    }
}
