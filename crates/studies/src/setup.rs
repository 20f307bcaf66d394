//! Is a right robot file left in peace, and a mistake of a person named?
//!
//! The mistakes are made in the log, as they are made in the world: the robot file says one thing, the columns hold another.

mod table;

use std::path::Path as File;

use serde_json::{Value, json};

use crate::chain::JOINTS;
use crate::chance::Chance;
use crate::drive::{Controller, Course, Run};
use crate::files;
use crate::lab::Lab;
use crate::machine::{Drive, Kind, LawKind, Machine};
use crate::path::{Motion, Path};
use crate::plant::Bodies;
use crate::planted;
use crate::study::StudyError;
use crate::tool::{Answer, Tool};

pub use table::table;

pub const USUAL_RUNS: u64 = 10;

/// Right files on machines that were refused before, and on plain ones.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Right {
    Plain(Kind, Drive, Motion),
    /// Springs or counterweights take this share of gravity.
    Balanced(f64),
    /// Two wrist joints that always move in proportion.
    Proportional,
    /// Wrists whose torque is friction.
    FrictionWrists,
    /// Rows of zeros, as a logger writes that starts too early.
    ZeroRows,
    /// An effect of the catalogue, by its place there and its size over the noise.
    Effect(usize, f64),
}

/// Mistakes that people make.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mistake {
    TorqueSign,
    PositionSign,
    BothSigns,
    TorquesExchanged,
    PositionsExchanged,
    JointsExchanged,
    Degrees,
    Turns,
    MilliTorque,
    KiloTorque,
    TorqueOfMotor,
    PositionOfMotor,
    QuarterTurn,
    WallMount,
    GravityTakenOff,
    VelocityAsPosition,
    /// A factor that nobody writes: an estimate.
    AnyFactor,
}

const MISTAKES: [(Mistake, &str); 17] = [
    (Mistake::TorqueSign, "sign of a torque"),
    (Mistake::PositionSign, "sign of a position"),
    (Mistake::BothSigns, "both signs of a joint"),
    (Mistake::TorquesExchanged, "two torques exchanged"),
    (Mistake::PositionsExchanged, "two positions exchanged"),
    (Mistake::JointsExchanged, "two joints exchanged"),
    (Mistake::Degrees, "a position in degrees"),
    (Mistake::Turns, "a position in turns"),
    (Mistake::MilliTorque, "a torque in mNm"),
    (Mistake::KiloTorque, "a torque in kNm"),
    (Mistake::TorqueOfMotor, "a torque of the motor's side"),
    (Mistake::PositionOfMotor, "a position of the motor's side"),
    (Mistake::QuarterTurn, "a zero off by a quarter turn"),
    (Mistake::WallMount, "a base on the wall"),
    (Mistake::GravityTakenOff, "gravity taken off by the driver"),
    (Mistake::VelocityAsPosition, "a velocity column as position"),
    (Mistake::AnyFactor, "a torque by any factor"),
];

/// Gear ratios: as many below ten as above, up to 200.
fn ratio(chance: &mut Chance) -> f64 {
    chance.ratio(1.5, 200.0)
}

/// One that is a whole or half number.
fn round_ratio(chance: &mut Chance) -> f64 {
    (2.0 * ratio(chance)).round() / 2.0
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Case {
    Right(Right),
    Wrong(Kind, Mistake),
}

pub struct Cell {
    name: String,
    case: Case,
}

/// What the right line is of: kind, joints of which one is named, and the factor.
struct Expected {
    kinds: &'static [&'static str],
    joints: Vec<String>,
    channel: Option<&'static str>,
    factor: Option<f64>,
}

pub fn cells() -> Vec<Cell> {
    let mut all = Vec::new();
    let mut right = |name: String, case: Right| {
        all.push(Cell {
            name: format!("right / {name}"),
            case: Case::Right(case),
        });
    };
    let direct = |kind| {
        if kind == Kind::Scara {
            Drive::BallScrew
        } else {
            Drive::Direct
        }
    };
    for (kind, motion) in [
        (Kind::Single, Motion::SlowSines),
        (Kind::Single, Motion::PointToPoint),
        (Kind::Arm3, Motion::SlowSines),
        (Kind::Arm3, Motion::HandLed),
        (Kind::Scara, Motion::SlowSines),
        (Kind::Arm6, Motion::FastSines),
        (Kind::Arm6, Motion::PointToPoint),
    ] {
        let words = [crate::coverage::word(kind), crate::coverage::word(motion)].join(" / ");
        right(words, Right::Plain(kind, direct(kind), motion));
    }
    for share in [0.97, 0.99, 1.0] {
        right(format!("balanced {share}"), Right::Balanced(share));
    }
    right("proportional wrists".into(), Right::Proportional);
    right("friction wrists".into(), Right::FrictionWrists);
    right("zero rows".into(), Right::ZeroRows);
    for (k, member) in planted::members().iter().enumerate() {
        for size in [2.0, 6.0, 20.0] {
            right(member.cell(size), Right::Effect(k, size));
        }
    }
    for kind in [Kind::Arm3, Kind::Arm6] {
        for (mistake, name) in MISTAKES {
            all.push(Cell {
                name: format!("wrong / {} / {name}", crate::coverage::word(kind)),
                case: Case::Wrong(kind, mistake),
            });
        }
    }
    all
}

impl Cell {
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("setup {}", self.name), number);
        match self.case {
            Case::Right(right) => {
                right.lay_out(folder, &mut chance)?;
                let answer = tool.run(folder, &LSQ)?;
                Ok(
                    json!({ "exit": answer.exit, "setup": short(&answer), "said": answer.last_words() }),
                )
            }
            Case::Wrong(kind, mistake) => {
                let expected = mistake.lay_out(kind, folder, &mut chance)?;
                // a fit that is refused leaves no document; `inspect` says why
                let fit = tool.run(folder, &LSQ)?;
                let answer = tool.run(folder, &["inspect", "log.csv", "-r", "robot.toml"])?;
                Ok(json!({
                    "exit": fit.exit,
                    "setup": short(&answer),
                    "answer": expected.judged(&answer),
                    "expected": [expected.kinds, expected.joints, expected.factor],
                }))
            }
        }
    }
}

const LSQ: [&str; 6] = ["lsq", "log.csv", "-r", "robot.toml", "-o", "model.toml"];

fn short(answer: &Answer) -> Vec<Value> {
    let of = |s: &Value| {
        json!([
            s["kind"],
            s["channel"],
            s["joint"],
            s["with"],
            s["found"],
            s["severity"],
            s["error_before"],
            s["error_after"]
        ])
    };
    answer.list("setup").iter().map(of).collect()
}

impl Right {
    fn lay_out(self, folder: &File, chance: &mut Chance) -> Result<(), StudyError> {
        if let Self::Effect(k, size) = self {
            let (lab, _) = planted::members()[k].lab(size, chance);
            lab.lay_out(folder)?;
            lab.record(folder, "log.csv", Motion::SlowSines, chance)?;
            return Ok(());
        }
        let (kind, drive, motion) = match self {
            Self::Plain(kind, drive, motion) => (kind, drive, motion),
            Self::Balanced(_) => (Kind::Arm3, Drive::Direct, Motion::SlowSines),
            _ => (Kind::Arm6, Drive::Direct, Motion::SlowSines),
        };
        let mut machine = Machine::draw(kind, drive, LawKind::Coulomb, 0.0, chance);
        if let Self::Balanced(share) = self {
            take_gravity_off(&mut machine, share);
        }
        if self == Self::FrictionWrists {
            for friction in &mut machine.plant.friction[3..] {
                friction.coulomb *= 6.0;
                friction.viscous *= 6.0;
            }
        }
        let lab = Lab::new(machine, Controller::FeedForward, true, chance);
        lab.lay_out(folder)?;
        let mut path = Path::new(motion, &lab.machine.ranges, 20.0, chance);
        if self == Self::Proportional {
            path.tied = Some((5, 4, 0.7));
        }
        let course = Course::of(&lab.machine, &path, lab.controller, lab.sensing.counts);
        let mut run = course.logged(&lab.machine, &lab.sensing, chance);
        if self == Self::ZeroRows {
            for row in 0..25 {
                (run.q[row], run.tau[row]) = ([0.0; JOINTS], [0.0; JOINTS]);
            }
        }
        files::write(
            &folder.join("log.csv"),
            &files::log_text(&lab.machine, &run),
        )
    }
}

/// The plant, and what its controller reckons with, feel this share of gravity less.
fn take_gravity_off(machine: &mut Machine, share: f64) {
    for bodies in [&mut machine.plant.bodies, &mut machine.nominal] {
        if let Bodies::Chain(chain) = bodies {
            chain.gravity = chain.gravity.map(|g| (1.0 - share) * g);
        }
    }
}

impl Mistake {
    fn lay_out(
        self,
        kind: Kind,
        folder: &File,
        chance: &mut Chance,
    ) -> Result<Expected, StudyError> {
        let mut machine = Machine::draw(kind, Drive::Direct, LawKind::Coulomb, 0.0, chance);
        match self {
            Self::GravityTakenOff => take_gravity_off(&mut machine, 1.0),
            Self::WallMount => {
                let turned = chance.pick(&[
                    [1.0, 0.0, 0.0],
                    [-1.0, 0.0, 0.0],
                    [0.0, 1.0, 0.0],
                    [0.0, -1.0, 0.0],
                ]);
                for bodies in [&mut machine.plant.bodies, &mut machine.nominal] {
                    if let Bodies::Chain(chain) = bodies {
                        chain.gravity = turned.map(|g| 9.81 * g);
                    }
                }
            }
            _ => {}
        }
        let lab = Lab::new(machine, Controller::FeedForward, true, chance);
        lab.lay_out(folder)?;
        let course = lab.course(Motion::SlowSines, chance);
        let mut run = course.logged(&lab.machine, &lab.sensing, chance);
        // a joint that carries weight or moves others: not the last two of a wrist
        let mut joint = 1 + usize::from(chance.sign() > 0.0);
        if self == Self::QuarterTurn {
            // the zero of a last link is seen by nobody: its link is described in turned axes
            joint = 1;
        }
        let expected = self.made(&mut run, joint, chance);
        let names = |of: &[usize]| of.iter().map(|&i| lab.machine.names[i].clone()).collect();
        files::write(
            &folder.join("log.csv"),
            &files::log_text(&lab.machine, &run),
        )?;
        Ok(Expected {
            kinds: expected.0,
            joints: names(&expected.1),
            channel: self.channel(),
            factor: expected.2,
        })
    }

    /// The channel that has it, where it is one.
    fn channel(self) -> Option<&'static str> {
        match self {
            Self::TorqueSign
            | Self::TorquesExchanged
            | Self::MilliTorque
            | Self::KiloTorque
            | Self::TorqueOfMotor
            | Self::AnyFactor => Some("torque"),
            Self::PositionSign
            | Self::PositionsExchanged
            | Self::Degrees
            | Self::Turns
            | Self::PositionOfMotor
            | Self::QuarterTurn
            | Self::VelocityAsPosition => Some("position"),
            Self::BothSigns | Self::JointsExchanged | Self::WallMount | Self::GravityTakenOff => {
                None
            }
        }
    }

    /// Makes the mistake in the log; gives the kinds that name it, the joints, and the factor in the columns.
    fn made(
        self,
        run: &mut Run,
        i: usize,
        chance: &mut Chance,
    ) -> (&'static [&'static str], Vec<usize>, Option<f64>) {
        let other = i - 1;
        let scale = |rows: &mut Vec<[f64; JOINTS]>, k: f64| rows.iter_mut().for_each(|r| r[i] *= k);
        let swap = |rows: &mut Vec<[f64; JOINTS]>| rows.iter_mut().for_each(|r| r.swap(i, other));
        let scaled = |k: f64| (&["scale"][..], vec![i], Some(k));
        match self {
            Self::TorqueSign => scale(&mut run.tau, -1.0),
            Self::PositionSign => scale(&mut run.q, -1.0),
            Self::BothSigns => {
                scale(&mut run.tau, -1.0);
                scale(&mut run.q, -1.0);
            }
            Self::TorquesExchanged => swap(&mut run.tau),
            Self::PositionsExchanged => swap(&mut run.q),
            Self::JointsExchanged => {
                swap(&mut run.tau);
                swap(&mut run.q);
            }
            Self::Degrees => {
                let k = 180.0 / std::f64::consts::PI;
                scale(&mut run.q, k);
                return scaled(k);
            }
            Self::Turns => {
                let k = 0.5 / std::f64::consts::PI;
                scale(&mut run.q, k);
                return scaled(k);
            }
            Self::MilliTorque => {
                scale(&mut run.tau, 1e3);
                return scaled(1e3);
            }
            Self::KiloTorque => {
                scale(&mut run.tau, 1e-3);
                return scaled(1e-3);
            }
            Self::TorqueOfMotor => {
                let k = 1.0 / round_ratio(chance);
                scale(&mut run.tau, k);
                return scaled(k);
            }
            Self::AnyFactor => {
                let k = 1.0 / ratio(chance);
                scale(&mut run.tau, k);
                return scaled(k);
            }
            Self::PositionOfMotor => {
                let k = round_ratio(chance);
                scale(&mut run.q, k);
                return scaled(k);
            }
            Self::QuarterTurn => {
                let off = chance.sign() * std::f64::consts::FRAC_PI_2;
                run.q.iter_mut().for_each(|q| q[i] += off);
                return (&["zero", "geometry"], vec![i], None);
            }
            Self::WallMount | Self::GravityTakenOff => return (&["gravity"], Vec::new(), None),
            Self::VelocityAsPosition => {
                for (q, v) in run.q.iter_mut().zip(&run.speed) {
                    q[i] = v[i];
                }
                return (&["order"], vec![i], None);
            }
        }
        match self {
            Self::TorqueSign | Self::PositionSign | Self::BothSigns => (&["sign"], vec![i], None),
            _ => (&["order"], vec![i, other], None),
        }
    }
}

impl Expected {
    /// "named" by a warning or a refusal; "told" as an estimate whose interval holds it or as what these data cannot tell;
    /// "misnamed" or "silent".
    fn judged(&self, answer: &Answer) -> &'static str {
        let found = answer.list("setup");
        let of_joint = |s: &Value| {
            let is = |j: &String| s["joint"] == **j || s["with"] == **j;
            self.joints.is_empty() || self.joints.iter().any(is)
        };
        let right = |s: &Value| {
            let kind = self.kinds.iter().any(|k| s["kind"] == *k);
            let factor = self.factor.is_none_or(|k| {
                // the document gives what the column is to be taken by, or its reciprocal
                s["found"].as_f64().is_none_or(|f| {
                    let within = match s["found_std"].as_f64() {
                        Some(std) => 1.96 * std / f.abs(),
                        None => 0.05,
                    };
                    let off = |r: f64| (r - 1.0).abs() < within;
                    off(f * k) || off(f / k)
                })
            });
            let channel = self
                .channel
                .is_none_or(|c| s["channel"] == c || s["channel"] == "both");
            kind && of_joint(s) && channel && factor
        };
        let sure = |s: &&Value| s["severity"] != "hint";
        let open = |s: &Value| s["kind"] == "undecided" && of_joint(s);
        if found.iter().filter(sure).any(right) {
            "named"
        } else if found.iter().any(|s| sure(&s)) {
            "misnamed"
        } else if found.iter().any(|s| right(s) || open(s)) {
            "told"
        } else {
            "silent"
        }
    }
}
