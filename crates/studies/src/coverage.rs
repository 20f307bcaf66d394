//! Do 95 % intervals hold the truth, or is the verdict no "identified"?
//!
//! Each cell is a machine on a drive with a law of friction, under a controller along a motion, seen by sensors; the
//! cells are a pairwise cover. Friction parameters count where the plant has the declared law; else the curve.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::chain::JOINTS;
use crate::chance::Chance;
use crate::cover::pairwise;
use crate::drive::{CONTROLLERS, Controller, Run};
use crate::files;
use crate::judge::{LIMITS, Share};
use crate::lab::Lab;
use crate::machine::{DRIVES, Drive, KINDS, Kind, LAWS, LawKind, Machine};
use crate::model::Model;
use crate::path::{MOTIONS, Motion};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

/// Factor of a normal deviation for 95 %.
pub(crate) const TWO_SIDED_95: f64 = 1.96;
/// Periodic error of harmonic gears [rad].
const GEAR_ERROR: f64 = 1.5e-5;
/// Speeds at which the curve of a joint is asked for.
const SPEEDS: usize = 20;

/// One cell of the cover.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    pub kind: Kind,
    pub motion: Motion,
    pub drive: Drive,
    pub law: LawKind,
    pub controller: Controller,
    pub fine: bool,
}

pub fn cells() -> Vec<Cell> {
    let levels = [
        KINDS.len(),
        MOTIONS.len(),
        DRIVES.len(),
        LAWS.len(),
        CONTROLLERS.len(),
        2,
    ];
    let of = |c: &[usize]| Cell {
        kind: KINDS[c[0]],
        motion: MOTIONS[c[1]],
        drive: DRIVES[c[2]],
        law: LAWS[c[3]],
        controller: CONTROLLERS[c[4]],
        fine: c[5] == 0,
    };
    let may = |c: &[usize]| KINDS[c[0]].may_have(DRIVES[c[2]]);
    let mut cells: Vec<Cell> = pairwise(&levels, may).iter().map(|c| of(c)).collect();
    cells.extend(of_cft());
    cells
}

/// The CFT robot, once with each law of friction.
fn of_cft() -> [Cell; 4] {
    let of = |k: usize| Cell {
        kind: Kind::Cft,
        motion: MOTIONS[k],
        drive: Drive::Direct,
        law: LAWS[k],
        controller: CONTROLLERS[(k + 2) % 4],
        fine: k.is_multiple_of(2),
    };
    [0, 1, 2, 3].map(of)
}

pub fn word(value: impl serde::Serialize) -> String {
    serde_json::to_value(value)
        .ok()
        .and_then(|v| v.as_str().map(str::to_owned))
        .unwrap_or_default()
}

impl Cell {
    pub fn name(&self) -> String {
        let fine = if self.fine { "fine" } else { "coarse" };
        [
            word(self.kind),
            word(self.motion),
            word(self.drive),
            word(self.law),
            word(self.controller),
            fine.to_owned(),
        ]
        .join(" / ")
    }

    pub fn usual_runs(&self) -> u64 {
        if self.kind == Kind::Single { 200 } else { 50 }
    }

    /// Draws a machine, drives it, and asks the binary.
    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&self.name(), number);
        let machine = Machine::draw(self.kind, self.drive, self.law, GEAR_ERROR, &mut chance);
        let lab = Lab::new(machine, self.controller, self.fine, &mut chance);
        lab.lay_out(folder)?;
        let run = lab.record(folder, "log.csv", self.motion, &mut chance)?;
        let machine = &lab.machine;

        let lsq = tool.run(
            folder,
            &["lsq", "log.csv", "-r", "robot.toml", "-o", "model.toml"],
        )?;
        let mut row = json!({
            "exit": lsq.exit,
            "still": run.still.iter().map(|s| (s * 1000.0).round() / 1000.0).collect::<Vec<_>>(),
            "parameters": judged(machine, lsq.list("parameters")),
        });
        if lsq.exit == 0 {
            let model = Model::read(&folder.join("model.toml"))?;
            row["curve"] = json!(model_curve(machine, &run, &model));
        } else {
            row["said"] = json!(lsq.last_words());
        }
        if self.kind == Kind::Single {
            let words = [
                "friction",
                "log.csv",
                "-r",
                "robot.toml",
                "-o",
                "friction.toml",
            ];
            let answer = tool.run(folder, &words)?;
            row["friction_exit"] = json!(answer.exit);
            row["friction_curve"] = json!(filter_curve(machine, answer.list("joints")));
        }
        Ok(row)
    }
}

/// Class, name, error in deviations, whether its interval holds the truth, and whether it is "identified".
fn judged(machine: &Machine, parameters: &[Value]) -> Vec<Value> {
    let one = |p: &Value| {
        let truth = truth_of(machine, p)?;
        let (value, std) = (p["value"].as_f64()?, p["std"].as_f64()?);
        let z = (value - truth.1) / std;
        let holds = match p["interval_95"].as_array() {
            Some(bounds) => {
                bounds.first()?.as_f64()? <= truth.1 && truth.1 <= bounds.get(1)?.as_f64()?
            }
            None => z.abs() <= TWO_SIDED_95,
        };
        let name = p["key"].as_str().or(p["name"].as_str())?;
        let joint = p["joint"].as_str().unwrap_or("");
        let z = (100.0 * z).round() / 100.0;
        Some(json!([
            truth.0,
            format!("{name} {joint}").trim(),
            z,
            holds,
            p["verdict"] == "identified"
        ]))
    };
    parameters.iter().filter_map(one).collect()
}

pub(crate) fn truth_of(machine: &Machine, parameter: &Value) -> Option<(&'static str, f64)> {
    let (name, joint) = (parameter["name"].as_str()?, parameter["joint"].as_str());
    let class = match name {
        "viscous" | "coulomb" if !machine.law_declared() => return None,
        "viscous" => "viscous",
        "coulomb" => "coulomb",
        "offset" => "offset",
        _ => "inertial",
    };
    Some((class, files::declared(machine, name, joint)?))
}

/// By joint whose friction is "identified": at how many of the speeds covered the band holds the plant's curve.
fn model_curve(machine: &Machine, run: &Run, model: &Model) -> Vec<(usize, usize)> {
    let n = machine.plant.joints.min(JOINTS);
    let of_joint = |i: usize| {
        let mut speeds: Vec<f64> = run
            .speed
            .iter()
            .map(|v| v[i].abs())
            .filter(|v| *v > 0.0)
            .collect();
        speeds.sort_by(f64::total_cmp);
        let at = |part: f64| speeds.get((part * speeds.len() as f64) as usize).copied();
        let (low, high) = (at(0.1)?, at(0.95)?);
        let speed = |k: usize| low + (high - low) * k as f64 / (SPEEDS - 1) as f64;
        let holds = |k: &usize| {
            let (value, std) = model.friction(&machine.names[i], speed(*k))?;
            Some((value - machine.plant.friction[i].lasting(speed(*k))).abs() <= TWO_SIDED_95 * std)
        };
        let held: Option<Vec<bool>> = (0..SPEEDS).map(|k| holds(&k)).collect();
        Some((held?.iter().filter(|h| **h).count(), SPEEDS))
    };
    (0..n).filter_map(of_joint).collect()
}

/// The same of the curve that `friction` gives.
fn filter_curve(machine: &Machine, joints: &[Value]) -> Option<(usize, usize)> {
    let joint = joints.first()?;
    if joint["parameters"]["viscous"]["verdict"] != "identified" {
        return None;
    }
    let curve = joint["curve"].as_array()?;
    let holds = |p: &&Value| {
        let (v, torque, std) = (p["v"].as_f64(), p["torque"].as_f64(), p["std"].as_f64());
        let (Some(v), Some(torque), Some(std)) = (v, torque, std) else {
            return false;
        };
        (torque - machine.plant.friction[0].lasting(v)).abs() <= TWO_SIDED_95 * std
    };
    Some((curve.iter().filter(holds).count(), curve.len()))
}

const CLASSES: [&str; 6] = [
    "inertial",
    "viscous",
    "coulomb",
    "offset",
    "curve",
    "friction_curve",
];

/// Hits and trials of a class in one run.
fn counted(row: &Value, class: &str) -> (usize, usize) {
    let pair = |p: &Value| {
        let at = |k: usize| p[k].as_u64().unwrap_or(0) as usize;
        (at(0), at(1))
    };
    match class {
        "curve" => {
            let all = row["curve"].as_array().map_or(&[][..], Vec::as_slice);
            all.iter()
                .map(pair)
                .fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
        }
        "friction_curve" => pair(&row["friction_curve"]),
        _ => {
            let all = row["parameters"].as_array().map_or(&[][..], Vec::as_slice);
            let own: Vec<_> = all
                .iter()
                .filter(|p| p[0] == class && p[4] == true)
                .collect();
            (own.iter().filter(|p| p[3] == true).count(), own.len())
        }
    }
}

/// The table, one line a cell and binary.
pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| machine / motion / drive / friction / controller / sensors | build | runs | inertias, gravity | viscous | Coulomb | \
         offset | friction curve, `lsq` | friction curve, `friction` | |\n\
         | :-- | :-- | --: | --: | --: | --: | --: | --: | --: | :-- |\n",
    );
    let tools = rows.tools();
    let mut failed: Vec<(usize, usize)> = vec![(0, 0); tools.len()];
    let mut least = vec![usize::MAX; tools.len()];
    for cell in cells() {
        let name = cell.name();
        for (which, tool) in tools.iter().enumerate() {
            let own: Vec<&Value> = rows.of(tool, &name).collect();
            if own.is_empty() {
                continue;
            }
            let (mut fails, mut shown) = (false, String::new());
            for class in CLASSES {
                let runs: Vec<(usize, usize)> = own.iter().map(|row| counted(row, class)).collect();
                let share = Share::of_runs(&runs);
                let out = share.outside(LIMITS.covered, LIMITS.confidence);
                fails |= out;
                shown += &format!(" {} |", said(&share, &runs, out));
            }
            failed[which].1 += 1;
            least[which] = least[which].min(own.len());
            failed[which].0 += usize::from(fails);
            let verdict = if fails { "fails" } else { "" };
            text += &format!("| {name} | {tool} | {} |{shown} {verdict} |\n", own.len());
        }
    }
    let sums = tools.iter().enumerate().map(|(k, tool)| {
        let ((bad, all), runs) = (failed[k], least[k]);
        format!("{tool}: {bad} of {all} cells fail, with {runs} runs a cell or more (few runs show gross failures only)")
    });
    format!("{}.\n\n{text}", sums.collect::<Vec<_>>().join("; "))
}

fn said(share: &Share, runs: &[(usize, usize)], out: bool) -> String {
    let Some(part) = share.share() else {
        return "-".to_owned();
    };
    let trials: usize = runs.iter().map(|r| r.1).sum();
    let (low, high) = share.interval(LIMITS.confidence);
    let bold = if out { "**" } else { "" };
    format!(
        "{bold}{:.0} %{bold} of {trials} ({:.0}..{:.0})",
        100.0 * part,
        100.0 * low,
        100.0 * high
    )
}
