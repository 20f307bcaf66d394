//! Is an effect written where nothing is missing?
//!
//! Plants with what the robot file declares and nothing else, two logs fitted, one held out, one never seen. Soft friction
//! is declared friction with a wide corner: to name that corner is no false effect.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::campaign::{Campaign, is_done};
use crate::chance::Chance;
use crate::cover::pairwise;
use crate::coverage::word;
use crate::drive::Controller;
use crate::judge::{LIMITS, Share};
use crate::lab::Lab;
use crate::machine::{Drive, Kind, LawKind, Machine};
use crate::path::{MOTIONS, Motion};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

const MACHINES: [(Kind, Drive); 5] = [
    (Kind::Single, Drive::Direct),
    (Kind::Single, Drive::BallScrew),
    (Kind::Arm3, Drive::Direct),
    (Kind::Scara, Drive::BallScrew),
    (Kind::Arm6, Drive::Direct),
];
const LAWS: [LawKind; 2] = [LawKind::Coulomb, LawKind::Smooth];
const CONTROLLERS: [Controller; 2] = [Controller::Pd, Controller::FeedForward];
/// Runs of a cell that make 200 campaigns.
pub const USUAL_RUNS: u64 = 8;

pub struct Cell {
    kind: Kind,
    drive: Drive,
    motion: Motion,
    law: LawKind,
    controller: Controller,
}

pub fn cells() -> Vec<Cell> {
    let levels = [MACHINES.len(), MOTIONS.len(), LAWS.len(), CONTROLLERS.len()];
    let of = |c: &Vec<usize>| Cell {
        kind: MACHINES[c[0]].0,
        drive: MACHINES[c[0]].1,
        motion: MOTIONS[c[1]],
        law: LAWS[c[2]],
        controller: CONTROLLERS[c[3]],
    };
    let of_cft = |motion, law, controller| Cell {
        kind: Kind::Cft,
        drive: Drive::Direct,
        motion,
        law,
        controller,
    };
    let mut cells: Vec<Cell> = pairwise(&levels, |_| true).iter().map(of).collect();
    cells.extend([
        of_cft(Motion::SlowSines, LawKind::Coulomb, Controller::Pd),
        of_cft(Motion::FastSines, LawKind::Smooth, Controller::Pd),
        of_cft(
            Motion::PointToPoint,
            LawKind::Coulomb,
            Controller::FeedForward,
        ),
        of_cft(Motion::HandLed, LawKind::Smooth, Controller::FeedForward),
    ]);
    cells
}

impl Cell {
    pub fn name(&self) -> String {
        let words = [
            word(self.kind),
            word(self.drive),
            word(self.motion),
            word(self.law),
            word(self.controller),
        ];
        words.join(" / ")
    }

    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("clean {}", self.name()), number);
        let machine = Machine::draw(self.kind, self.drive, self.law, 0.0, &mut chance);
        let lab = Lab::new(
            machine,
            self.controller,
            self.kind != Kind::Arm6,
            &mut chance,
        );
        lab.lay_out(folder)?;
        for log in ["a.csv", "b.csv", "held.csv"] {
            lab.record(folder, log, self.motion, &mut chance)?;
        }
        let other = MOTIONS
            [(MOTIONS.iter().position(|m| *m == self.motion).unwrap_or(0) + 1) % MOTIONS.len()];
        lab.record(folder, "unseen.csv", other, &mut chance)?;
        let mut row = Campaign::simulated().diagnosed(tool, folder)?;
        if row["unseen_before"].is_array() && self.law == LawKind::Coulomb {
            row["unseen_truth"] = json!(lab.errors_of_truth(tool, folder, "unseen.csv")?);
        }
        Ok(row)
    }

    /// Whether a name is no falsehood on this plant.
    fn true_name(&self, effect: &str) -> bool {
        self.law == LawKind::Smooth && effect == "smooth-coulomb"
    }
}

/// Largest ratio over the joints of two lists of errors.
pub fn worst(row: &Value, over: &str, under: &str) -> Option<f64> {
    let list = |key: &str| row[key].as_array().cloned().unwrap_or_default();
    let ratio = |(a, b): (&Value, &Value)| Some(a.as_f64()? / b.as_f64()?);
    let both = (list(over), list(under));
    both.0
        .iter()
        .zip(&both.1)
        .filter_map(ratio)
        .max_by(f64::total_cmp)
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| machine / drive / motion / friction / controller | build | campaigns | not done | with a false effect | \
         names | a joint more than 2 % worse on unseen motion | error as fitted over that of the true parameters, \
         unseen, worst joint of all |\n| :-- | :-- | --: | --: | --: | :-- | --: | --: |\n",
    );
    let mut heads = Vec::new();
    for tool in rows.tools() {
        let (mut false_ones, mut done) = (0, 0);
        for cell in cells() {
            let name = cell.name();
            let own: Vec<&Value> = rows.of(&tool, &name).collect();
            if own.is_empty() {
                continue;
            }
            let written = |row: &Value| -> Vec<String> {
                let all = row["written"].as_array().cloned().unwrap_or_default();
                let effect = |w: &Value| w[0].as_str().unwrap_or_default().to_owned();
                all.iter()
                    .map(effect)
                    .filter(|e| !cell.true_name(e))
                    .collect()
            };
            let judged: Vec<&&Value> = own.iter().filter(|row| is_done(row)).collect();
            let bad = judged.iter().filter(|row| !written(row).is_empty()).count();
            let worse = judged
                .iter()
                .filter(|row| worst(row, "unseen_after", "unseen_before").is_some_and(|w| w > 1.02))
                .count();
            let over = judged
                .iter()
                .filter_map(|row| worst(row, "unseen_before", "unseen_truth"))
                .max_by(f64::total_cmp);
            let mut names: Vec<String> = judged.iter().flat_map(|row| written(row)).collect();
            names.sort();
            names.dedup();
            (false_ones, done) = (false_ones + bad, done + judged.len());
            text += &format!(
                "| {name} | {tool} | {} | {} | {bad} | {} | {worse} | {} |\n",
                own.len(),
                own.len() - judged.len(),
                names.join(", "),
                over.map_or("-".to_owned(), |o| format!("{o:.2}")),
            );
        }
        let share = Share::of(false_ones, done);
        let (low, high) = share.interval(LIMITS.confidence);
        heads.push(format!(
            "{tool}: something false is written in {false_ones} of {done} campaigns ({:.1}..{:.1} %; aim: below {:.0} %)",
            100.0 * low,
            100.0 * high,
            100.0 * LIMITS.written_on_clean
        ));
    }
    format!("{}.\n\n{text}", heads.join("; "))
}
