//! Is the formula of a law found that stands in no catalogue, and none where nothing is missing?
//!
//! Right are the signals where those of the law are among those of the formula, and no others but a direction beside a
//! speed; right is a formula whose torque along unseen motion is that of the law within a fifth (rms), both beside what
//! the declared model can take up.

mod subjects;

use std::path::Path as File;

use serde_json::{Value, json};

pub use self::subjects::{Subject, subjects};
use crate::added::Shape;
use crate::chance::Chance;
use crate::drive::Run;
use crate::judge::{LIMITS, Share};
use crate::lab::{Lab, errors};
use crate::path::Motion;
use crate::planted::{band, put_in, sized};
use crate::signal::{beside, rms};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

pub const SIZES: [f64; 2] = [2.0, 6.0];
pub const USUAL_RUNS: u64 = 20;

/// What a search is to come to. Fixed before it is run.
#[derive(Debug, Clone, Copy)]
pub struct FormulaLimits {
    pub right_signals: f64,
    pub right_torque: f64,
    /// Part of the law's torque that a right formula may be off.
    pub off: f64,
    pub down_to_noise: f64,
    /// Error over that of the noise alone.
    pub over_noise: f64,
    pub on_clean: f64,
}

pub const FORMULA_LIMITS: FormulaLimits = FormulaLimits {
    right_signals: 0.9,
    right_torque: 0.8,
    off: 0.2,
    down_to_noise: 0.7,
    over_noise: 1.5,
    on_clean: 0.01,
};

impl Subject {
    pub fn cells(self) -> Vec<(Self, f64)> {
        match self.law {
            Some(_) => SIZES.map(|size| (self, size)).to_vec(),
            None => vec![(self, 0.0)],
        }
    }

    pub fn cell(&self, size: f64) -> String {
        sized(self.name, self.kind, size)
    }

    pub fn run(
        &self,
        tool: &Tool,
        folder: &File,
        size: f64,
        number: u64,
    ) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("formula {}", self.cell(size)), number);
        let mut lab = Lab::for_an_effect(self.kind, &mut chance);
        if let Some(law) = self.law {
            let course = lab.course(Motion::SlowSines, &mut chance);
            let run = course.logged(&lab.machine, &lab.sensing, &mut chance);
            let noise = band(&run, |r, k| r.tau[k][self.joint] - r.clean[k][self.joint]);
            let shape = Shape::Uncatalogued(law);
            put_in(&mut lab, (self.joint, shape), size, &noise, &mut chance);
        }
        lab.lay_out(folder)?;
        let motions = [
            ("a.csv", Motion::SlowSines),
            ("b.csv", Motion::FastSines),
            ("c.csv", Motion::SlowSines),
            ("held.csv", Motion::SlowSines),
        ];
        for (log, motion) in motions {
            lab.record(folder, log, motion, &mut chance)?;
        }
        let unseen = lab.record(folder, "unseen.csv", Motion::PointToPoint, &mut chance)?;
        self.searched(tool, (folder, &lab), &unseen)
    }

    fn searched(
        &self,
        tool: &Tool,
        (folder, lab): (&File, &Lab),
        unseen: &Run,
    ) -> Result<Value, StudyError> {
        let fit = [
            "lsq",
            "a.csv",
            "b.csv",
            "c.csv",
            "-r",
            "robot.toml",
            "-o",
            "model.toml",
        ];
        let fit = tool.run(folder, &fit)?;
        if fit.exit != 0 {
            return Ok(json!({ "exit": fit.exit, "said": fit.last_words() }));
        }
        let search = [
            "diagnose",
            "a.csv",
            "b.csv",
            "c.csv",
            "-m",
            "model.toml",
            "--holdout",
            "held.csv",
            "--search",
            "-o",
            "catalogue.toml",
        ];
        let answer = tool.run(folder, &search)?;
        let mut row = json!({ "exit": answer.exit });
        if answer.exit != 0 {
            row["said"] = json!(answer.last_words());
            return Ok(row);
        }
        let formulas = answer.list("formulas");
        let pick = |f: &Value| {
            json!([
                f["joint"],
                f["end"],
                f["text"],
                f["signals"],
                f["p_value"],
                f["symmetry"]
            ])
        };
        row["formulas"] = json!(formulas.iter().map(pick).collect::<Vec<_>>());
        row["steps"] = json!(
            answer
                .list("steps")
                .iter()
                .map(|s| json!([s["effect"], s["joint"], s["status"]]))
                .collect::<Vec<_>>()
        );
        let joint = &lab.machine.names[self.joint];
        let found = formulas
            .iter()
            .find(|f| f["joint"] == json!(joint) && f["end"] == "found");
        row["noise"] = json!(noise_share(unseen, self.joint));
        row["unseen_given"] = json!(errors(tool, folder, "unseen.csv", "model.toml")?[self.joint]);
        row["unseen_catalogue"] =
            json!(errors(tool, folder, "unseen.csv", "catalogue.toml")?[self.joint]);
        let Some(found) = found.filter(|_| self.law.is_some()) else {
            return Ok(row);
        };
        row["right_signals"] = json!(self.is_right(found, &lab.machine.names));
        let accept = format!("formula:{joint}");
        let with: Vec<&str> = search[..search.len() - 1]
            .iter()
            .copied()
            .chain(["with.toml", "--accept", &accept])
            .collect();
        let answer = tool.run(folder, &with)?;
        if answer.exit == 0 {
            row["unseen_formula"] =
                json!(errors(tool, folder, "unseen.csv", "with.toml")?[self.joint]);
            row["off"] = json!(self.off(tool, (folder, lab), unseen)?);
        }
        Ok(row)
    }

    /// Whether the signals of a formula are those of the law.
    fn is_right(&self, found: &Value, names: &[String]) -> bool {
        let signals = found["signals"].as_array().cloned().unwrap_or_default();
        let own = &names[self.joint];
        let class = |signal: &Value| -> String {
            let words = signal.as_str().unwrap_or_default();
            let (what, of) = words.split_once(" of ").unwrap_or((words, own));
            let class = match what {
                "position" => "q",
                "speed" | "direction" => "v",
                "acceleration" => "a",
                "load" => "load",
                "temperature" => "warm",
                _ => "memory",
            };
            match of == own || class == "warm" {
                true => class.to_owned(),
                false => format!("{class}_o"),
            }
        };
        let found: Vec<String> = signals.iter().map(class).collect();
        let known = |s: &String| self.signals.iter().chain(self.besides).any(|own| own == s);
        self.signals.iter().all(|s| found.iter().any(|f| f == s)) && found.iter().all(known)
    }

    /// Part of the law's torque that the formula's is off along unseen motion, beside what the declared model takes up.
    fn off(
        &self,
        tool: &Tool,
        (folder, lab): (&File, &Lab),
        unseen: &Run,
    ) -> Result<Option<f64>, StudyError> {
        let text = crate::files::read(&folder.join("with.toml"))?;
        let without = silent(&text);
        crate::files::write(&folder.join("without.toml"), &without)?;
        let mut torques = Vec::new();
        for (model, out) in [("with.toml", "t1.csv"), ("without.toml", "t0.csv")] {
            let answer = tool.run(folder, &["torque", "unseen.csv", "-m", model, "-o", out])?;
            if answer.exit != 0 {
                return Ok(None);
            }
            torques.push(column(
                &folder.join(out),
                &format!("tau_{}", lab.machine.names[self.joint]),
            )?);
        }
        let rows = unseen.t.len();
        if torques.iter().any(|t| t.len() != rows) {
            return Ok(None);
        }
        let moves = |k: usize| f64::from(u8::from(unseen.speed[k][self.joint].abs() > 0.02));
        let law = band(unseen, |r, k| r.planted[k][self.joint] * moves(k));
        let formula = band(unseen, |_, k| (torques[0][k] - torques[1][k]) * moves(k));
        let columns = taken_up(unseen, self.joint, &moves);
        let error: Vec<f64> = formula.iter().zip(&law).map(|(a, b)| a - b).collect();
        Ok(Some(
            rms(&beside(&error, &columns)) / rms(&beside(&law, &columns)),
        ))
    }
}

/// A model file whose formulas have no coefficients but zeros.
fn silent(model: &str) -> String {
    let (mut table, mut of_formula) = ("", false);
    let line = |line| {
        if str::starts_with(line, '[') {
            table = line;
        } else if table == "[[effect]]" && line.starts_with("name = ") {
            of_formula = line.contains("\"formula-");
        }
        let own = of_formula && table.starts_with("[effect.parameters.c");
        match own && line.starts_with("value = ") {
            true => "value = 0.0\n".to_owned(),
            false => format!("{line}\n"),
        }
    };
    model.lines().map(line).collect()
}

/// Error that the noise of a joint is along a log.
fn noise_share(run: &Run, joint: usize) -> f64 {
    let noise = band(run, |r, k| r.tau[k][joint] - r.clean[k][joint]);
    rms(&noise) / rms(&band(run, |r, k| r.tau[k][joint]))
}

/// What a declared model takes up of any torque at a joint: friction, inertia, offset and weights of two links.
fn taken_up(run: &Run, joint: usize, moves: &dyn Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let rate = 1.0 / (run.t[1] - run.t[0]);
    let last = run.t.len() - 1;
    let angle = |k: usize, both: bool| match both && joint > 0 {
        true => run.q[k][joint] + run.q[k][joint - 1],
        false => run.q[k][joint],
    };
    let of = |column: &dyn Fn(usize) -> f64| band(run, |_, k| column(k) * moves(k));
    let v = |k: usize| run.speed[k][joint];
    let mut all = vec![
        of(&|k| (v((k + 1).min(last)) - v(k.saturating_sub(1))) * 0.5 * rate),
        of(&v),
        of(&|k| v(k).signum()),
        of(&|_| 1.0),
    ];
    if joint > 0 {
        all.extend([false, true].map(|both| of(&|k| angle(k, both).cos())));
        all.extend([false, true].map(|both| of(&|k| angle(k, both).sin())));
    }
    all
}

/// A column of a table.
fn column(path: &File, name: &str) -> Result<Vec<f64>, StudyError> {
    let text = crate::files::read(path)?;
    let mut lines = text.lines();
    let at = lines
        .next()
        .and_then(|head| head.split(',').position(|own| own == name));
    let at = at.ok_or_else(|| StudyError::Line {
        path: path.to_owned(),
        line: 1,
        message: format!("has no column {name}"),
    })?;
    let value = |line: &str| {
        line.split(',')
            .nth(at)
            .and_then(|x| x.parse().ok())
            .unwrap_or(f64::NAN)
    };
    Ok(lines.map(value).collect())
}

/// How often of how many runs.
#[derive(Default, Clone, Copy)]
struct Counts {
    runs: usize,
    found: usize,
    signals: usize,
    torque: usize,
    noise: usize,
    /// Runs with a formula at any joint, where there is nothing.
    false_ones: usize,
}

fn counts<'a>(subject: &Subject, rows: impl Iterator<Item = &'a Value>) -> Counts {
    let limits = FORMULA_LIMITS;
    let mut all = Counts::default();
    for row in rows.filter(|row| row["exit"] == 0) {
        all.runs += 1;
        let formulas = row["formulas"].as_array().cloned().unwrap_or_default();
        let any = formulas.iter().any(|f| f[1] == "found");
        all.false_ones += usize::from(subject.law.is_none() && any);
        let below = |key: &str, most: f64| row[key].as_f64().is_some_and(|x| x <= most);
        all.found += usize::from(row["right_signals"].is_boolean());
        all.signals += usize::from(row["right_signals"] == true);
        all.torque += usize::from(below("off", limits.off));
        let noise = row["noise"].as_f64().unwrap_or(0.0);
        all.noise += usize::from(below("unseen_formula", limits.over_noise * noise));
    }
    all
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| law / machine / times the noise | build | runs | a formula | right signals | torque within a fifth | unseen error down \
         to 1.5 times the noise |\n| :-- | :-- | --: | --: | --: | --: | --: |\n",
    );
    let mut heads = Vec::new();
    for tool in rows.tools() {
        let mut all = [Counts::default(); 5];
        for (subject, size) in subjects().into_iter().flat_map(Subject::cells) {
            let cell = subject.cell(size);
            let c = counts(&subject, rows.of(&tool, &cell));
            if c.runs == 0 {
                continue;
            }
            let clean = subject.law.is_none();
            let at = if clean {
                4
            } else {
                2 * usize::from(subject.reviewed) + usize::from(size > SIZES[0])
            };
            let sum = &mut all[at];
            for (sum, own) in [
                (&mut sum.runs, c.runs),
                (&mut sum.signals, c.signals),
                (&mut sum.torque, c.torque),
                (&mut sum.noise, c.noise),
                (&mut sum.false_ones, c.false_ones),
            ] {
                *sum += own;
            }
            let found = if clean { c.false_ones } else { c.found };
            let told = |n: usize| if clean { "-".to_owned() } else { n.to_string() };
            text += &format!(
                "| {cell} | {tool} | {} | {found} | {} | {} | {} |\n",
                c.runs,
                told(c.signals),
                told(c.torque),
                told(c.noise)
            );
        }
        let said = |hits: usize, of: usize, aim: f64| {
            let (low, high) = Share::of(hits, of).interval(LIMITS.confidence);
            format!(
                "{hits} of {of} ({:.0}..{:.0} %, aim {:.0} %)",
                100.0 * low,
                100.0 * high,
                100.0 * aim
            )
        };
        let limits = FORMULA_LIMITS;
        let of = SIZES
            .map(|size| (size, ""))
            .into_iter()
            .chain(SIZES.map(|size| (size, "of the ten laws of a reviewer, ")));
        for (sum, (size, whose)) in all.iter().zip(of).filter(|(sum, _)| sum.runs > 0) {
            heads.push(format!(
                "- {tool}, {whose}at {size} times the noise: right signals {}; torque within a fifth {}; unseen error down to {} times \
                 the noise {}.",
                said(sum.signals, sum.runs, limits.right_signals),
                said(sum.torque, sum.runs, limits.right_torque),
                limits.over_noise,
                said(sum.noise, sum.runs, limits.down_to_noise)
            ));
        }
        let clean = all[4];
        if clean.runs > 0 {
            heads.push(format!(
                "- {tool}, on clean machines: a formula in {}.",
                said(clean.false_ones, clean.runs, limits.on_clean)
            ));
        }
    }
    format!("{}\n\n{text}", heads.join("\n"))
}
