//! Is a load found, and do its intervals hold it?
//!
//! A model of the empty arm by `lsq`, then a log of the arm with a body on its last link, on another day: friction and
//! offsets have changed by up to a tenth. In a third of the cells the torque channels' gains have changed too; in
//! another the arm carries nothing.

use std::path::Path as File;

use serde::Serialize;
use serde_json::{Value, json};

use crate::chain::{Chain, Link};
use crate::chance::Chance;
use crate::coverage::word;
use crate::drive::Controller;
use crate::files;
use crate::judge::{LIMITS, Share};
use crate::lab::Lab;
use crate::machine::{Drive, Kind, LawKind, Machine};
use crate::path::Motion;
use crate::plant::Bodies;
use crate::space::Vector;
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

pub const USUAL_RUNS: u64 = 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Case {
    Loaded,
    /// The gains are up to 15 % off those of the model's log.
    LoadedGainsOff,
    Empty,
}

pub struct Cell {
    kind: Kind,
    motion: Motion,
    case: Case,
}

pub fn cells() -> Vec<Cell> {
    let motions = [Motion::FastSines, Motion::PointToPoint];
    let cases = [Case::Loaded, Case::LoadedGainsOff, Case::Empty];
    let mut all = Vec::new();
    for kind in [Kind::Arm3, Kind::Arm6] {
        for motion in motions {
            all.extend(cases.map(|case| Cell { kind, motion, case }));
        }
    }
    all
}

/// A box whose sides are along the axes of the last link.
struct Load {
    mass: f64,
    centre: Vector,
    /// About its centre.
    inertia: Vector,
}

impl Load {
    fn drawn(chance: &mut Chance) -> Self {
        let mass = chance.ratio(0.3, 3.0);
        let centre = [0.1, 0.1, 0.15].map(|far| chance.between(-far, far));
        let square = [0; 3].map(|_| mass * chance.between(0.03, 0.1).powi(2) / 3.0);
        let inertia = [
            square[1] + square[2],
            square[0] + square[2],
            square[0] + square[1],
        ];
        Self {
            mass,
            centre,
            inertia,
        }
    }

    /// The link as it was, with this body on it.
    fn on(&self, link: &Link) -> Link {
        let own = |i: usize, j: usize| if i == j { self.inertia[i] } else { 0.0 };
        let body = Link {
            mass: self.mass,
            centre: self.centre,
            inertia: [0, 1, 2].map(|i| [0, 1, 2].map(|j| own(i, j))),
            ..link.clone()
        };
        link.joined(&body)
    }
}

impl Machine {
    /// Puts a body on the last link; neither the controller nor the URDF knows of it.
    fn carry(&mut self, load: &Load) {
        let Some(chain) = &self.chain else {
            return;
        };
        let mut links = chain.links.clone();
        if let Some(last) = links.last_mut() {
            *last = load.on(last);
        }
        let loaded = Chain::new(links, chain.gravity);
        self.plant.bodies = Bodies::Chain(loaded.clone());
        self.chain = Some(loaded);
    }

    /// Another day: friction and offsets change by up to a tenth.
    fn another_day(&mut self, chance: &mut Chance) {
        for friction in &mut self.plant.friction {
            friction.viscous *= chance.between(0.9, 1.1);
            friction.coulomb *= chance.between(0.9, 1.1);
        }
        for offset in &mut self.plant.offset {
            *offset *= chance.between(0.9, 1.1);
        }
    }
}

impl Cell {
    pub fn name(&self) -> String {
        [word(self.kind), word(self.motion), word(self.case)].join(" / ")
    }

    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("payload {}", self.name()), number);
        let machine = Machine::draw(self.kind, Drive::Direct, LawKind::Coulomb, 0.0, &mut chance);
        let fine = chance.sign() > 0.0;
        let mut lab = Lab::new(machine, Controller::FeedForward, fine, &mut chance);
        lab.lay_out(folder)?;
        lab.record(folder, "empty.csv", Motion::FastSines, &mut chance)?;
        let words = ["lsq", "empty.csv", "-r", "robot.toml", "-o", "model.toml"];
        let fitted = tool.run(folder, &words)?;
        if fitted.exit != 0 {
            return Ok(json!({ "exit": fitted.exit, "said": fitted.last_words() }));
        }
        let load = (self.case != Case::Empty).then(|| Load::drawn(&mut chance));
        if let Some(load) = &load {
            lab.machine.carry(load);
        }
        lab.machine.another_day(&mut chance);
        let course = lab.course(self.motion, &mut chance);
        let mut run = course.logged(&lab.machine, &lab.sensing, &mut chance);
        let off = if self.case == Case::LoadedGainsOff {
            0.15
        } else {
            0.0
        };
        let gains: Vec<f64> = (lab.machine.names.iter())
            .map(|_| 1.0 + chance.between(-off, off))
            .collect();
        for tau in &mut run.tau {
            tau.iter_mut()
                .zip(&gains)
                .for_each(|(tau, gain)| *tau *= gain);
        }
        files::write(
            &folder.join("log.csv"),
            &files::log_text(&lab.machine, &run),
        )?;
        let answer = tool.run(folder, &["payload", "log.csv", "-m", "model.toml"])?;
        let readings = answer.list("readings").iter();
        let document = answer.document.as_ref();
        Ok(json!({
            "exit": answer.exit,
            "verdict": document.map(|document| &document["verdict"]),
            "mass": load.as_ref().map_or(0.0, |load| load.mass),
            "readings": readings.map(|reading| judged(reading, load.as_ref(), &gains)).collect::<Vec<_>>(),
        }))
    }
}

/// Class, truth, value and interval of each number of a reading, and the joints that it makes worse.
fn judged(reading: &Value, load: Option<&Load>, gains: &[f64]) -> Value {
    let one = |class: &str, truth: f64, number: &Value| {
        json!([class, truth, number["value"], number["interval_95"]])
    };
    let mut numbers = vec![one(
        "mass",
        load.map_or(0.0, |load| load.mass),
        &reading["mass"],
    )];
    if let Some(load) = load {
        let centre = load.centre.iter().enumerate();
        numbers.extend(centre.map(|(i, x)| one("centre", *x, &reading["centre"][i])));
        let places = [0, 3, 5].iter().zip(&load.inertia);
        numbers.extend(places.map(|(at, x)| one("inertia", *x, &reading["inertia"][*at])));
    }
    let of = reading["gains"].as_array().map_or(&[][..], Vec::as_slice);
    let of = of.iter().zip(gains);
    numbers.extend(of.map(|(described, gain)| one("gain", gain - 1.0, &described["error"])));
    let joints = reading["joints"].as_array().map_or(&[][..], Vec::as_slice);
    let worse = joints.iter().filter(|joint| joint["worse"] == true).count();
    json!({ "gains_free": reading["gains_free"], "numbers": numbers, "worse": worse })
}

/// Hits and trials of a class in one reading of one run.
fn held(row: &Value, reading: usize, class: &str) -> (usize, usize) {
    let all = row["readings"][reading]["numbers"].as_array();
    let own = all.map_or(&[][..], Vec::as_slice).iter();
    let holds = |number: &Value| {
        let (truth, low, high) = (
            number[1].as_f64()?,
            number[3][0].as_f64()?,
            number[3][1].as_f64()?,
        );
        Some(low <= truth && truth <= high)
    };
    let found: Vec<bool> = own
        .filter(|number| number[0] == class)
        .filter_map(holds)
        .collect();
    (found.iter().filter(|holds| **holds).count(), found.len())
}

/// Half the width of the mass's interval, the middle one of the runs.
fn half_width(rows: &[&Value], reading: usize) -> String {
    let width = |row: &&Value| {
        let mass = &row["readings"][reading]["numbers"][0][3];
        Some(0.5 * (mass[1].as_f64()? - mass[0].as_f64()?))
    };
    let mut all: Vec<f64> = rows.iter().filter_map(width).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2)
        .map_or("-".to_owned(), |width| format!("{width:.3} kg"))
}

/// The columns: a reading and what is counted of it.
const COLUMNS: [(usize, &str, &str); 7] = [
    (0, "mass", "mass, gains as in the model"),
    (0, "centre", "centre"),
    (0, "inertia", "inertia"),
    (1, "mass", "mass, gains free"),
    (1, "centre", "centre"),
    (1, "inertia", "inertia"),
    (1, "gain", "gains"),
];

/// The table, one line a cell and binary.
pub fn table(rows: &Rows) -> String {
    let heads: Vec<&str> = COLUMNS.iter().map(|column| column.2).collect();
    let mut text = format!(
        "| arm / motion / case | build | runs | {} | half width of the mass's interval (median): gains as in the model | \
         gains free | a load is said to be seen | a joint is made worse | |\n| :-- | :-- |{} :-- |\n",
        heads.join(" | "),
        " --: |".repeat(COLUMNS.len() + 5),
    );
    for tool in rows.tools() {
        for cell in cells() {
            let name = cell.name();
            let all: Vec<&Value> = rows.of(&tool, &name).collect();
            if all.is_empty() {
                continue;
            }
            let mut fails = false;
            let mut shown = String::new();
            for (reading, class, _) in COLUMNS {
                let runs: Vec<(usize, usize)> =
                    all.iter().map(|row| held(row, reading, class)).collect();
                let share = Share::of_runs(&runs);
                // gains that are off are no business of the reading that holds them
                let asked = reading == 1 || cell.case != Case::LoadedGainsOff;
                let out = asked && share.outside(LIMITS.covered, LIMITS.confidence);
                fails |= out;
                let part = share.share().filter(|_| asked);
                shown += &part.map_or(" - |".to_owned(), |part| {
                    format!(" {:.0} % |", 100.0 * part)
                });
            }
            let seen = |row: &&&Value| {
                let low = &row["readings"][0]["numbers"][0][3][0];
                low.as_f64().is_some_and(|low| low > 0.0)
            };
            let worse = |row: &&&Value| row["readings"][0]["worse"].as_u64().unwrap_or(0) > 0;
            let count = all.len();
            text += &format!(
                "| {name} | {tool} | {count} |{shown} {} | {} | {} | {} | {} |\n",
                half_width(&all, 0),
                half_width(&all, 1),
                all.iter().filter(seen).count(),
                all.iter().filter(worse).count(),
                if fails { "fails" } else { "" },
            );
        }
    }
    text
}
