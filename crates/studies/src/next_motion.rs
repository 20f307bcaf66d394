//! What is the motion worth that `lsq` proposes to record next?
//!
//! A log over a small part of the ranges, a fit, the proposed motion within the limits of the robot file, and its log.
//! Beside it, for as long, a motion of the laboratory's own kind over the whole ranges. Intervals before, after either,
//! and what they hold.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::chance::Chance;
use crate::coverage::{TWO_SIDED_95, truth_of, word};
use crate::drive::{Controller, Course};
use crate::files;
use crate::judge::Share;
use crate::lab::{Lab, errors};
use crate::machine::{Drive, Kind, LawKind, Machine};
use crate::path::{Motion, Path, Range};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

const MACHINES: [(Kind, Drive); 3] = [
    (Kind::Arm3, Drive::Direct),
    (Kind::Scara, Drive::BallScrew),
    (Kind::Arm6, Drive::Direct),
];
/// What laboratories have before they know better, over a small part of each range and of the speeds.
const FIRST: [Motion; 3] = [Motion::SlowSines, Motion::PointToPoint, Motion::HandLed];
/// Duration of the first log [s].
const FIRST_S: f64 = 20.0;
const SHY: f64 = 0.25;
/// Acceleration that the robot file allows, over the top speed [1/s].
const ACCELERATION: f64 = 5.0;
pub const USUAL_RUNS: u64 = 4;

pub struct Cell {
    kind: Kind,
    drive: Drive,
    first: Motion,
}

pub fn cells() -> Vec<Cell> {
    let of = |(kind, drive): &(Kind, Drive)| {
        let (kind, drive) = (*kind, *drive);
        FIRST.map(|first| Cell { kind, drive, first })
    };
    MACHINES.iter().flat_map(of).collect()
}

impl Cell {
    pub fn name(&self) -> String {
        [word(self.kind), word(self.first)].join(" / ")
    }

    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("next {}", self.name()), number);
        let machine = Machine::draw(self.kind, self.drive, LawKind::Coulomb, 0.0, &mut chance);
        let lab = Lab::new(machine, Controller::FeedForward, false, &mut chance);
        lab.lay_out(folder)?;
        files::write(
            &folder.join("robot.toml"),
            &(files::robot_text(&lab.machine, lab.sensing.rate_hz, "arm.urdf", "")
                + &limits(&lab.machine)),
        )?;
        let shy: Vec<Range> = lab.machine.ranges.iter().map(Range::shy).collect();
        let shy = Path::new(self.first, &shy, FIRST_S, &mut chance);
        record(&lab, folder, ("first.csv", &shy), &mut chance)?;
        lab.record(folder, "unseen.csv", Motion::FastSines, &mut chance)?;
        let Some(before) = fitted(&lab, tool, folder, &["first.csv"])? else {
            return Ok(json!({ "said": "the first log gave no model" }));
        };
        let words = "excite -m model.toml --for weak --rate 1000 -o next.toml --samples next.csv";
        let words: Vec<&str> = words.split(' ').collect();
        let answer = tool.run(folder, &words)?;
        if answer.exit != 0 {
            return Ok(json!({ "before": before, "said": answer.last_words() }));
        }
        let path = files::read_path(&folder.join("next.csv"), lab.machine.plant.joints)?;
        let own = Path::new(self.first, &lab.machine.ranges, path.seconds, &mut chance);
        let seconds = path.seconds;
        for (name, path) in [("proposed.csv", path), ("own.csv", own)] {
            record(&lab, folder, (name, &path), &mut chance)?;
        }
        let own = fitted(&lab, tool, folder, &["first.csv", "own.csv"])?;
        let proposed = fitted(&lab, tool, folder, &["first.csv", "proposed.csv"])?;
        Ok(json!({ "seconds": seconds, "before": before, "own": own, "proposed": proposed }))
    }
}

/// Drives the machine along a path, and writes its log.
fn record(
    lab: &Lab,
    folder: &File,
    (name, path): (&str, &Path),
    chance: &mut Chance,
) -> Result<(), StudyError> {
    let course = Course::of(&lab.machine, path, lab.controller, lab.sensing.counts);
    let run = course.logged(&lab.machine, &lab.sensing, chance);
    files::write(&folder.join(name), &files::log_text(&lab.machine, &run))
}

/// What the robot file says of positions, speeds and accelerations.
fn limits(machine: &Machine) -> String {
    let one = |(name, range): (&String, &Range)| {
        format!(
            "\n[limits.{name}]\nposition = [{:?}, {:?}]\nspeed = {:?}\nacceleration = {:?}\n",
            range.centre - range.half,
            range.centre + range.half,
            range.speed,
            ACCELERATION * range.speed
        )
    };
    machine.names.iter().zip(&machine.ranges).map(one).collect()
}

impl Range {
    fn shy(&self) -> Self {
        Self {
            half: SHY * self.half,
            speed: SHY * self.speed,
            ..*self
        }
    }
}

/// Fits logs: each parameter with its deviation, verdict and truth, and the errors on the motion that nobody fitted.
fn fitted(
    lab: &Lab,
    tool: &Tool,
    folder: &File,
    logs: &[&str],
) -> Result<Option<Value>, StudyError> {
    let words = [&["lsq"], logs, &["-r", "robot.toml", "-o", "model.toml"]].concat();
    let answer = tool.run(folder, &words)?;
    if answer.exit != 0 {
        return Ok(None);
    }
    let one = |p: &Value| {
        let truth = truth_of(&lab.machine, p).map(|(_, truth)| truth);
        json!([
            p["name"],
            p["joint"],
            p["value"],
            p["std"],
            p["verdict"],
            truth
        ])
    };
    let parameters: Vec<Value> = answer.list("parameters").iter().map(one).collect();
    let unseen = errors(tool, folder, "unseen.csv", "model.toml")?;
    Ok(Some(json!({ "parameters": parameters, "unseen": unseen })))
}

fn list<'a>(row: &'a Value, fit: &str, key: &str) -> &'a [Value] {
    row[fit][key].as_array().map_or(&[], Vec::as_slice)
}

/// Deviations of the weak parameters of the first fit after another log over those before it.
fn narrowed(row: &Value, fit: &str) -> Vec<f64> {
    let weak = |p: &&Value| matches!(p[4].as_str(), Some("weak" | "not-identifiable"));
    let before = list(row, "before", "parameters").iter().filter(weak);
    let ratio = |p: &Value| {
        let mut after = list(row, fit, "parameters").iter();
        let after = after.find(|a| a[0] == p[0] && a[1] == p[1])?;
        Some(after[3].as_f64()? / p[3].as_f64()?)
    };
    before.filter_map(ratio).collect()
}

fn middle(mut x: Vec<f64>) -> String {
    x.sort_by(f64::total_cmp);
    x.get(x.len() / 2)
        .map_or("-".to_owned(), |x| format!("{x:.2}"))
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| machine / first motion | build | runs | parameters that are not identified: first log | with the own \
         motion too | with the proposed one | their deviations over those of the first log (median): own motion | \
         proposed | 95 % intervals that hold the truth, proposed | error on unseen fast motion, worst joint (median): \
         first log | own motion | proposed |\n\
         | :-- | :-- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    for tool in rows.tools() {
        for cell in cells() {
            let name = cell.name();
            let all: Vec<&Value> = rows.of(&tool, &name).collect();
            let done: Vec<&&Value> = all
                .iter()
                .filter(|row| row["proposed"].is_object())
                .collect();
            if done.is_empty() {
                continue;
            }
            let open = |fit: &str| {
                let weak = |p: &&Value| matches!(p[4].as_str(), Some("weak" | "not-identifiable"));
                let of = |row: &&&Value| list(row, fit, "parameters").iter().filter(weak).count();
                let count: usize = done.iter().map(of).sum();
                format!("{:.1}", count as f64 / done.len() as f64)
            };
            let ratios = |fit: &str| {
                let of = |row: &&&Value| narrowed(row, fit);
                middle(done.iter().flat_map(of).collect())
            };
            let worst = |fit: &str| {
                let of = |row: &&&Value| {
                    let errors = list(row, fit, "unseen").iter().filter_map(Value::as_f64);
                    100.0 * errors.fold(0.0, f64::max)
                };
                format!("{} %", middle(done.iter().map(of).collect()))
            };
            let held = done.iter().map(|row| {
                let known = list(row, "proposed", "parameters").iter();
                let known = known.filter(|p| p[4] == "identified");
                let off = |p: &Value| {
                    let [value, std, truth] = [2, 3, 5].map(|k| p[k].as_f64());
                    Some((value? - truth?).abs() <= TWO_SIDED_95 * std?)
                };
                let off: Vec<bool> = known.filter_map(off).collect();
                (off.iter().filter(|h| **h).count(), off.len())
            });
            let share = Share::of_runs(&held.collect::<Vec<_>>());
            let share = share
                .share()
                .map_or("-".to_owned(), |s| format!("{:.0} %", 100.0 * s));
            text += &format!(
                "| {name} | {tool} | {} | {} | {} | {} | {} | {} | {share} | {} | {} | {} |\n",
                done.len(),
                open("before"),
                open("own"),
                open("proposed"),
                ratios("own"),
                ratios("proposed"),
                worst("before"),
                worst("own"),
                worst("proposed"),
            );
        }
    }
    text
}
