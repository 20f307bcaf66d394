//! What a diagnosis does to data that nobody used: the measured machines, each part of their logs unseen in turn.

use std::path::Path as File;

use serde_json::Value;

use crate::campaign::{Campaign, is_done};
use crate::chance::Chance;
use crate::clean::worst;
use crate::measured::{MACHINES, Measured};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

/// Draws of the bootstrap over machines.
const DRAWS: usize = 2000;
const THIRDS: [&str; 3] = ["@0..33%", "@33..67%", "@67..100%"];

/// How the unseen part differs from the fitted ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unseen {
    SameLog,
    OtherMotion,
}

/// A part of a recording: its number, and the span.
type Part = (usize, &'static str);

pub struct Cell {
    machine: &'static Measured,
    fitted: Vec<Part>,
    unseen: Part,
    kind: Unseen,
}

pub fn cells() -> Vec<Cell> {
    let mut cells = Vec::new();
    for machine in &MACHINES {
        let mut add = |fitted: &[Part], unseen: Part, kind: Unseen| {
            let fitted = fitted.to_vec();
            cells.push(Cell {
                machine,
                fitted,
                unseen,
                kind,
            });
        };
        match machine.name {
            "EMPS" => add(&[(0, "")], (1, ""), Unseen::OtherMotion),
            "motor" => add(&[(0, "@15.2..23s")], (0, "@23..29.5s"), Unseen::SameLog),
            _ => {
                let (parts, kind): (Vec<Part>, _) = match machine.logs.len() {
                    1 => (THIRDS.map(|span| (0, span)).to_vec(), Unseen::SameLog),
                    n => ((0..n).map(|k| (k, "")).collect(), Unseen::OtherMotion),
                };
                for (k, unseen) in parts.iter().enumerate() {
                    let others: Vec<Part> =
                        parts.iter().filter(|p| *p != unseen).copied().collect();
                    add(&others, *unseen, kind);
                    add(&[parts[(k + 1) % parts.len()]], *unseen, kind);
                }
            }
        }
    }
    cells
}

impl Cell {
    pub fn name(&self) -> String {
        let part = |(log, span): &Part| {
            let file = File::new(self.machine.logs[*log]).file_stem();
            format!("{}{span}", file.unwrap_or_default().to_string_lossy())
        };
        let fitted: Vec<String> = self.fitted.iter().map(part).collect();
        let (name, unseen) = (self.machine.name, part(&self.unseen));
        format!("{name}: {} -> {unseen}", fitted.join(" + "))
    }

    pub fn run(&self, tool: &Tool, folder: &File) -> Result<Value, StudyError> {
        let path = |(log, span): &Part| self.machine.log(*log, span);
        let campaign = Campaign {
            robot: self.machine.robot_path()?.display().to_string(),
            fitted: self.fitted.iter().map(path).collect::<Result<_, _>>()?,
            holdout: None,
            unseen: Some(path(&self.unseen)?),
        };
        campaign.diagnosed(tool, folder)
    }
}

/// Errors after over before of the joints of one machine.
struct Judged {
    machine: &'static str,
    ratios: Vec<f64>,
    written: usize,
}

fn list(row: &Value, key: &str) -> Vec<f64> {
    let list = row[key].as_array().cloned().unwrap_or_default();
    list.iter()
        .map(|x| x.as_f64().unwrap_or(f64::NAN))
        .collect()
}

fn judged(cell: &Cell, row: &Value) -> Judged {
    let (before, after) = (list(row, "unseen_before"), list(row, "unseen_after"));
    Judged {
        machine: cell.machine.name,
        ratios: before.iter().zip(&after).map(|(b, a)| a / b).collect(),
        written: row["written"].as_array().map_or(0, Vec::len),
    }
}

/// Mean and median over machines of the mean gain of their joints; nothing of none.
fn gains(all: &[&Judged], machines: &[&str]) -> [f64; 2] {
    let mut each: Vec<f64> = machines
        .iter()
        .map(|name| {
            let own: Vec<f64> = (all.iter().filter(|j| j.machine == *name))
                .flat_map(|j| &j.ratios)
                .map(|ratio| 1.0 - ratio)
                .collect();
            own.iter().sum::<f64>() / own.len().max(1) as f64
        })
        .collect();
    each.sort_by(f64::total_cmp);
    let n = each.len();
    let median = 0.5 * (each[(n - 1) / 2] + each[n / 2]);
    [each.iter().sum::<f64>() / n as f64, median]
}

/// The 2.5 % and 97.5 % quantiles of what machines drawn with replacement give.
fn bootstrap(
    all: &[&Judged],
    machines: &[&str],
    of: impl Fn(&[&Judged], &[&str]) -> f64,
) -> [f64; 2] {
    let mut chance = Chance::of("rotations", 0);
    let mut drawn: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let names: Vec<&str> = machines.iter().map(|_| chance.pick(machines)).collect();
            of(all, &names)
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|p| drawn[(p * (DRAWS - 1) as f64) as usize])
}

/// Share of joints that are worse than before by more than `limit`, over machines with their weights.
fn worse(all: &[&Judged], machines: &[&str], limit: f64) -> f64 {
    let (mut hits, mut joints) = (0, 0);
    for name in machines {
        for ratio in all
            .iter()
            .filter(|j| j.machine == *name)
            .flat_map(|j| &j.ratios)
        {
            joints += 1;
            hits += usize::from(*ratio > 1.0 + limit);
        }
    }
    hits as f64 / f64::from(joints.max(1) as u32)
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| unseen | logs fitted | build | campaigns, machines | joints | > 2 % worse | > 5 % | > 10 % | worst joint | \
         mean gain over machines | median | effects a campaign |\n| :-- | --: | :-- | --: | --: | --: | --: | --: | --: \
         | --: | --: | --: |\n",
    );
    let cells = cells();
    let percent = |x: f64| format!("{:.1}", 100.0 * x);
    for tool in rows.tools() {
        for (kind, word) in [
            (Unseen::SameLog, "a part of the same log"),
            (Unseen::OtherMotion, "another motion"),
        ] {
            for count in [1, 2] {
                let fits = |cell: &&Cell| cell.kind == kind && cell.fitted.len() == count;
                let all: Vec<Judged> = (cells.iter().filter(fits))
                    .flat_map(|cell| {
                        let name = cell.name();
                        let own: Vec<Judged> = (rows.of(&tool, &name))
                            .filter(|row| is_done(row))
                            .map(|row| judged(cell, row))
                            .collect();
                        own
                    })
                    .collect();
                let all: Vec<&Judged> = all.iter().collect();
                let mut machines: Vec<&str> = all.iter().map(|j| j.machine).collect();
                machines.dedup();
                if machines.is_empty() {
                    continue;
                }
                let joints: usize = all.iter().map(|j| j.ratios.len()).sum();
                let worst = (all.iter().flat_map(|j| &j.ratios)).fold(1.0_f64, |a, b| a.max(*b));
                let share = |limit: f64| worse(&all, &machines, limit);
                let spread = bootstrap(&all, &machines, |a, m| worse(a, m, 0.02));
                let [mean, median] = gains(&all, &machines);
                let gain = bootstrap(&all, &machines, |a, m| gains(a, m)[0]);
                let effects: usize = all.iter().map(|j| j.written).sum();
                text += &format!(
                    "| {word} | {count} | {tool} | {}, {} | {joints} | {} % ({}..{}) | {} % | {} % | {:+.1} % | {} % \
                     ({}..{}) | {} % | {:.1} |\n",
                    all.len(),
                    machines.len(),
                    percent(share(0.02)),
                    percent(spread[0]),
                    percent(spread[1]),
                    percent(share(0.05)),
                    percent(share(0.10)),
                    100.0 * (worst - 1.0),
                    percent(mean),
                    percent(gain[0]),
                    percent(gain[1]),
                    percent(median),
                    effects as f64 / all.len() as f64,
                );
            }
        }
    }
    text += "\n| machine: fitted -> unseen | build | written | mean error of the joints before -> after | worst joint \
             |\n| :-- | :-- | :-- | --: | --: |\n";
    for cell in &cells {
        let name = cell.name();
        for tool in rows.tools() {
            for row in rows.of(&tool, &name) {
                text += &line(&name, &tool, row);
            }
        }
    }
    text
}

fn line(name: &str, tool: &str, row: &Value) -> String {
    let written: Vec<String> = (row["written"].as_array().into_iter().flatten())
        .map(|w| {
            let [effect, joint] = [&w[0], &w[1]].map(|x| x.as_str().unwrap_or_default());
            format!("{effect} {joint}").trim_end().to_owned()
        })
        .collect();
    let (before, after) = (list(row, "unseen_before"), list(row, "unseen_after"));
    let mean = |x: &[f64]| 100.0 * x.iter().sum::<f64>() / x.len().max(1) as f64;
    let ends = match (is_done(row), before.is_empty()) {
        (false, _) => format!("not done ({})", row["exit"]),
        (true, true) => "nothing is written".to_owned(),
        (true, false) => format!("{:.2} -> {:.2} %", mean(&before), mean(&after)),
    };
    let worst = worst(row, "unseen_after", "unseen_before")
        .map_or("-".to_owned(), |w| format!("{:+.1} %", 100.0 * (w - 1.0)));
    format!(
        "| {name} | {tool} | {} | {ends} | {worst} |\n",
        written.join(", ")
    )
}
