//! Is each kind of effect found, with its size, on machines that have it, and not on machines that do not?
//!
//! Twenty machines of another make with an effect and twenty without. Sizes, time constants, orders, gaps and phases are
//! drawn, so that none falls on a grid of shapes. A size is compared as a torque: what the law gives at the end of a log,
//! at the highest torque, or at its crest.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::added::Shape;
use crate::campaign::{Campaign, is_done};
use crate::chance::Chance;
use crate::judge::{LIMITS, Share};
use crate::lab::Lab;
use crate::machine::Kind;
use crate::path::Motion;
use crate::plant::{Bodies, Elastic};
use crate::planted::{band, put_in};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

pub const USUAL_RUNS: u64 = 20;
/// Rms of the effect's torque over the noise's, in the band that the fit keeps: from, to.
const SIZES: (f64, f64) = (6.0, 20.0);
/// Duration of a log [s].
const LOG_S: f64 = 20.0;
/// A size is recovered within this part of it.
const NEAR: f64 = 0.2;

/// A kind of effect, and the machine and joint that have it.
#[derive(Clone, Copy)]
pub struct Cell {
    effect: &'static str,
    family: &'static str,
    kind: Kind,
    joint: usize,
    what: What,
    /// Whether the machine has it.
    with: bool,
}

#[derive(Clone, Copy)]
enum What {
    SettlingDrift,
    WarmMotor,
    FullIron,
    UnevenMotor,
    PoseFriction,
    GearTrain,
    LooseLoad,
}

pub fn cells() -> Vec<Cell> {
    let of = |effect, family, kind, joint, what| {
        [true, false].map(|with| Cell {
            effect,
            family,
            kind,
            joint,
            what,
            with,
        })
    };
    let (single, arm) = (Kind::Single, Kind::Arm3);
    [
        of("settling-drift", "slow", arm, 0, What::SettlingDrift),
        of("gain-change", "slow", arm, 1, What::WarmMotor),
        of("gain-change", "load", arm, 1, What::FullIron),
        of("torque-ripple", "position", arm, 1, What::UnevenMotor),
        of("pose-friction", "cross", arm, 1, What::PoseFriction),
        of("coupling", "cross", arm, 2, What::GearTrain),
        of("backlash-impact", "memory", single, 0, What::LooseLoad),
    ]
    .concat()
}

/// What was planted, as the keys that the program prints, and the size that is compared.
struct Truth {
    keys: Value,
    size: f64,
}

impl Cell {
    pub fn name(&self) -> String {
        let with = if self.with { "with" } else { "without" };
        let machine = crate::coverage::word(self.kind);
        format!("{} ({}) / {machine} / {with}", self.effect, self.family)
    }

    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("kinds {}", self.name()), number);
        let mut lab = Lab::for_an_effect(self.kind, &mut chance);
        let course = lab.course(Motion::SlowSines, &mut chance);
        let run = course.logged(&lab.machine, &lab.sensing, &mut chance);
        let peak = run.clean.iter().map(|tau| tau[self.joint].abs());
        let peak = peak.fold(0.0, f64::max);
        let truth = self.with.then(|| self.plant(&mut lab, peak, &mut chance));
        lab.lay_out(folder)?;
        for log in ["a.csv", "b.csv", "held.csv"] {
            lab.record(folder, log, Motion::SlowSines, &mut chance)?;
        }
        let campaign = Campaign {
            unseen: None,
            ..Campaign::simulated()
        };
        let mut row = campaign.diagnosed(tool, folder)?;
        row["joint"] = json!(lab.machine.names[self.joint]);
        if let Some(truth) = truth {
            let found = self.found(&row, peak);
            row["truth"] = truth.keys;
            row["size"] = json!(truth.size);
            row["found"] = json!(found);
        }
        Ok(row)
    }

    /// Puts the effect into a machine whose joint takes torques up to `peak`.
    fn plant(&self, lab: &mut Lab, peak: f64, chance: &mut Chance) -> Truth {
        let time_s = chance.ratio(4.0, 11.0);
        let phase = chance.between(-1.5, 1.5);
        let order = chance.between(7.0, 19.0);
        let grown = 1.0 - (-LOG_S / time_s).exp();
        let shape = match self.what {
            What::LooseLoad => return self.loosen(lab, chance),
            What::SettlingDrift => Shape::SettlingDrift { time_s },
            What::WarmMotor => Shape::WarmMotor { time_s },
            What::FullIron => Shape::FullIron,
            What::UnevenMotor => Shape::UnevenMotor { order, phase },
            What::PoseFriction => Shape::PoseFriction { other: 0, phase },
            What::GearTrain => Shape::GearTrain {
                other: self.joint - 1,
                together: chance.between(0.0, 0.6),
                viscous: chance.between(0.0, 0.3),
            },
        };
        let course = lab.course(Motion::SlowSines, chance);
        let run = course.logged(&lab.machine, &lab.sensing, chance);
        let noise = band(&run, |r, k| r.tau[k][self.joint] - r.clean[k][self.joint]);
        let size = chance.ratio(SIZES.0, SIZES.1);
        put_in(lab, (self.joint, shape), size, &noise, chance);
        let k = lab.machine.plant.added[0].size;
        // what is logged over what acts, beyond one
        let gain = |lost: f64| lost / (1.0 - lost);
        match shape {
            Shape::SettlingDrift { .. } => Truth {
                keys: json!({ "level": k, "T": time_s }),
                size: k * grown,
            },
            Shape::WarmMotor { .. } => Truth {
                keys: json!({ "signal": 1, "T_of_the_loss": time_s, "loss": k }),
                size: gain(k * grown),
            },
            Shape::FullIron => Truth {
                keys: json!({ "signal": 2, "loss_per_torque": k }),
                size: gain(k * peak),
            },
            Shape::UnevenMotor { .. } => Truth {
                keys: json!({ "order": order, "loss": k, "phase": phase }),
                size: k,
            },
            Shape::GearTrain {
                together, viscous, ..
            } => Truth {
                keys: json!({ "coulomb_from": k, "coulomb": k * together, "viscous": k * viscous }),
                size: k * (1.0 + together),
            },
            _ => Truth {
                keys: json!({ "order": 1, "amplitude": k, "phase": phase }),
                size: k,
            },
        }
    }

    /// Sets the load loose on its motor.
    fn loosen(&self, lab: &mut Lab, chance: &mut Chance) -> Truth {
        let gap = chance.ratio(0.008, 0.025);
        let whole = lab.machine.inertia[self.joint];
        let load = chance.between(0.4, 0.7) * whole;
        let w = std::f64::consts::TAU * chance.between(35.0, 70.0);
        if let Bodies::Single { inertia, .. } = &mut lab.machine.plant.bodies {
            *inertia = load;
        }
        lab.machine.plant.drives[self.joint] = Some(Elastic {
            stiffness: load * w * w,
            damping: 2.0 * chance.between(0.3, 0.8) * load * w,
            gap,
            motor: whole - load,
            error: 0.0,
            order: 0.0,
        });
        Truth {
            keys: json!({ "gap": gap, "inertia": load }),
            size: gap,
        }
    }

    /// The size that was found, where the effect is among the steps.
    fn found(&self, row: &Value, peak: f64) -> Option<f64> {
        let steps = row["steps"].as_array()?;
        let keys = &steps.iter().find(|step| self.is_it(step, row))?[5];
        let value = |key: &str| keys[key]["value"].as_f64();
        let by = |x: f64| Some(1.0 - (-x / value("scale")?).exp());
        match self.what {
            What::SettlingDrift => Some(value("level")? * (1.0 - (-LOG_S / value("T")?).exp())),
            What::WarmMotor => Some(value("k")? * by(LOG_S)?),
            What::FullIron => Some(value("k")? * by(peak)?),
            What::UnevenMotor | What::PoseFriction => Some(value("sin")?.hypot(value("cos")?)),
            What::GearTrain => Some(value("coulomb")? + value("coulomb_from")?),
            What::LooseLoad => value("gap"),
        }
    }

    /// Whether a step is what was planted.
    fn is_it(&self, step: &Value, row: &Value) -> bool {
        step[0] == self.effect && step[1] == self.family && step[2] == row["joint"]
    }
}

/// What the campaigns of a cell came to.
#[derive(Default)]
struct Tally {
    done: usize,
    named: usize,
    near: usize,
    clean: usize,
    others: Vec<String>,
}

fn tally(cell: &Cell, rows: &[&Value]) -> Tally {
    let mut all = Tally::default();
    for row in rows.iter().filter(|row| is_done(row)) {
        all.done += 1;
        let written = row["written"].as_array().cloned().unwrap_or_default();
        let right = |w: &&Value| cell.with && w[0] == cell.effect && w[1] == row["joint"];
        let named = written.iter().any(|w| right(&w));
        all.named += usize::from(named);
        let ratio = row["found"].as_f64().zip(row["size"].as_f64());
        let near = ratio.is_some_and(|(found, size)| (found / size - 1.0).abs() <= NEAR);
        all.near += usize::from(named && near);
        all.clean += usize::from(written.iter().all(|w| right(&w)));
        let others = written.iter().filter(|w| !right(w));
        all.others
            .extend(others.map(|w| w[0].as_str().unwrap_or_default().to_owned()));
    }
    all.others.sort();
    all.others.dedup();
    all
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| effect / machine | build | campaigns | written | size within 20 % | nothing else written | others |\n\
         | :-- | :-- | --: | --: | --: | --: | :-- |\n",
    );
    let mut heads = Vec::new();
    for tool in rows.tools() {
        let (mut with, mut without) = (Tally::default(), Tally::default());
        for cell in cells() {
            let name = cell.name();
            let own: Vec<&Value> = rows.of(&tool, &name).collect();
            if own.is_empty() {
                continue;
            }
            let t = tally(&cell, &own);
            let planted = |count: usize| match cell.with {
                true => format!("{count} of {}", t.done),
                false => "-".to_owned(),
            };
            text += &format!(
                "| {name} | {tool} | {} | {} | {} | {} of {} | {} |\n",
                own.len(),
                planted(t.named),
                planted(t.near),
                t.clean,
                t.done,
                t.others.join(", "),
            );
            let sum = if cell.with { &mut with } else { &mut without };
            sum.done += t.done;
            sum.named += t.named;
            sum.near += t.near;
            sum.clean += t.clean;
        }
        let said = |hits: usize, of: usize| {
            let (low, high) = Share::of(hits, of).interval(LIMITS.confidence);
            format!("{hits} of {of} ({:.0}..{:.0} %)", 100.0 * low, 100.0 * high)
        };
        heads.push(format!(
            "- {tool}: written where it is {}, its size within 20 % {}, nothing else beside it {}; nothing written where \
             nothing is {}.",
            said(with.named, with.done),
            said(with.near, with.done),
            said(with.clean, with.done),
            said(without.clean, without.done)
        ));
    }
    format!("{}\n\n{text}", heads.join("\n"))
}
