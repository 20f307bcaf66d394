//! Is an effect written where the model is true and the rest is noise?
//!
//! Positions are those of measured logs, so motion, sensors and clock are real. The torque is the one that the fitted
//! model asks for along them, with noise as strong as what the model leaves of the measured torque. Half of its power
//! forgets in 0.05 to 2 s, the other half is white; in every second run all joints share it. Unseen is the first motion
//! backwards, with noise of its own: friction meets it at other times of the path.

use std::path::Path as File;

use serde_json::{Value, json};

use crate::campaign::{Campaign, is_done};
use crate::chance::Chance;
use crate::files;
use crate::judge::{LIMITS, Share};
use crate::measured::{MACHINES, Measured};
use crate::study::{Rows, StudyError};
use crate::tool::Tool;

/// Runs of a cell: 200 take days.
pub const USUAL_RUNS: u64 = 200;
/// Logs fitted.
const COUNTS: [usize; 3] = [1, 2, 4];
/// Times in which noise forgets \[s\].
const MEMORY_S: (f64, f64) = (0.05, 2.0);

pub struct Cell {
    machine: &'static Measured,
    count: usize,
}

pub fn cells() -> Vec<Cell> {
    let of = |machine| COUNTS.map(|count| Cell { machine, count });
    MACHINES.iter().flat_map(of).collect()
}

impl Cell {
    pub fn name(&self) -> String {
        format!("{}, {} fitted", self.machine.name, self.count)
    }

    /// The parts that are fitted: whole recordings, or as many spans of one as are asked for.
    fn parts(&self) -> Result<Vec<String>, StudyError> {
        let logs = self.machine.logs.len().min(self.count);
        let spans = self.count.div_ceil(logs);
        let mut parts = Vec::new();
        for k in 0..self.count {
            let (log, piece) = (k % logs, k / logs);
            let [from, to] = [piece, piece + 1].map(|p| 100 * p / spans);
            parts.push(self.machine.log(log, &format!("@{from}..{to}%"))?);
        }
        Ok(parts)
    }

    pub fn run(&self, tool: &Tool, folder: &File, number: u64) -> Result<Value, StudyError> {
        let mut chance = Chance::of(&format!("nulls {}", self.name()), number);
        let memory_s = chance.ratio(MEMORY_S.0, MEMORY_S.1);
        let shared = number % 2 == 1;
        let robot = self.machine.robot_path()?.display().to_string();
        let parts = self.parts()?;
        let mut words = vec!["lsq", "-r", &robot, "-o", "true.toml"];
        words.extend(parts.iter().map(String::as_str));
        let fit = tool.run(folder, &words)?;
        if fit.exit != 0 {
            return Ok(json!({ "exit": fit.exit, "said": fit.last_words() }));
        }
        let plain = without_channels(File::new(&robot))?;
        files::write(&folder.join("robot.toml"), &plain)?;
        let plain = without_channels(&folder.join("true.toml"))?;
        files::write(&folder.join("plain.toml"), &plain)?;
        let mut fitted = Vec::new();
        for (k, part) in parts.iter().enumerate() {
            let taken = [
                &["convert", part, "part.csv", "-r", &robot][..],
                &["validate", part, "-m", "true.toml", "-o", "left.csv"],
            ];
            if let Some(failed) = failure(tool, folder, &taken)? {
                return Ok(failed);
            }
            let strength = Columns::read(&folder.join("left.csv"))?.strength("residual_");
            let mut noise = Noise {
                memory_s,
                shared,
                strength,
                chance: &mut chance,
            };
            let part = Columns::read(&folder.join("part.csv"))?;
            let back = (k == 0).then(|| ("unseen.csv".to_owned(), part.backwards()));
            for (name, motion) in [(format!("null{k}.csv"), part)].into_iter().chain(back) {
                files::write(&folder.join("motion.csv"), &motion.text())?;
                let asked = [
                    "torque",
                    "motion.csv",
                    "-m",
                    "plain.toml",
                    "-o",
                    "asked.csv",
                ];
                if let Some(failed) = failure(tool, folder, &[&asked])? {
                    return Ok(failed);
                }
                let asked = Columns::read(&folder.join("asked.csv"))?;
                files::write(&folder.join(&name), &noise.on(&motion, &asked))?;
                if name != "unseen.csv" {
                    fitted.push(name);
                }
            }
        }
        let campaign = Campaign {
            robot: "robot.toml".to_owned(),
            fitted,
            holdout: None,
            unseen: Some("unseen.csv".to_owned()),
        };
        let mut row = campaign.diagnosed(tool, folder)?;
        row["memory_s"] = json!(memory_s);
        row["shared"] = json!(shared);
        Ok(row)
    }
}

/// A robot or model file without the names and units of channels: `convert` writes the usual ones.
fn without_channels(path: &File) -> Result<String, StudyError> {
    let mut table: toml::Table = files::read(path)?
        .parse()
        .map_err(|error: toml::de::Error| StudyError::Line {
            path: path.to_owned(),
            line: 0,
            message: error.to_string(),
        })?;
    if let Some(log) = table.get_mut("log").and_then(toml::Value::as_table_mut) {
        log.retain(|key, _| key.starts_with("torque_"));
    }
    Ok(table.to_string())
}

/// Columns of a table by their names, without those that are not there in every row.
struct Columns {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Columns {
    fn read(path: &File) -> Result<Self, StudyError> {
        let text = files::read(path)?;
        let mut lines = text.lines();
        let names = lines.next().unwrap_or_default().split(',');
        let number = |word: &str| word.parse().unwrap_or(f64::NAN);
        Ok(Self {
            names: names.map(str::to_owned).collect(),
            rows: lines
                .map(|line| line.split(',').map(number).collect())
                .collect(),
        })
    }

    fn text(&self) -> String {
        let mut text = self.names.join(",") + "\n";
        for row in &self.rows {
            let cells: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
            text += &cells.join(",");
            text.push('\n');
        }
        text
    }

    /// The positions from the last row to the first, at the times of the rows.
    fn backwards(&self) -> Columns {
        let mut places = vec![0];
        places.extend(self.places("q_"));
        let last = self.rows.last().map_or(0.0, |row| row[0]) + self.rows[0][0];
        let of_row = |row: &Vec<f64>| {
            let mut own: Vec<f64> = places.iter().map(|k| row[*k]).collect();
            own[0] = last - own[0];
            own
        };
        Columns {
            names: places.iter().map(|k| self.names[*k].clone()).collect(),
            rows: self.rows.iter().rev().map(of_row).collect(),
        }
    }

    /// Root mean square of columns.
    fn strength(&self, begin: &str) -> Vec<f64> {
        let rms = |k: &usize| {
            let squares: f64 = self.rows.iter().map(|row| row[*k] * row[*k]).sum();
            (squares / self.rows.len() as f64).sqrt()
        };
        self.places(begin).iter().map(rms).collect()
    }

    fn places(&self, begin: &str) -> Vec<usize> {
        let fits = |k: &usize| self.names[*k].starts_with(begin);
        (0..self.names.len()).filter(fits).collect()
    }

    /// The numbers of some columns at a time, on the line between two rows.
    fn at(&self, t: f64, places: &[usize]) -> Vec<f64> {
        let after = self.rows.partition_point(|row| row[0] < t);
        let after = after.clamp(1, self.rows.len() - 1);
        let (a, b) = (&self.rows[after - 1], &self.rows[after]);
        let share = ((t - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
        places
            .iter()
            .map(|k| a[*k] + share * (b[*k] - a[*k]))
            .collect()
    }
}

/// What the first command that fails says, where one does.
fn failure(tool: &Tool, folder: &File, all: &[&[&str]]) -> Result<Option<Value>, StudyError> {
    for words in all {
        let done = tool.run(folder, words)?;
        if done.exit != 0 {
            let failed = json!({ "exit": done.exit, "said": done.last_words() });
            return Ok(Some(failed));
        }
    }
    Ok(None)
}

/// Noise of the joints' torques, as strong as what a model leaves.
struct Noise<'a> {
    memory_s: f64,
    shared: bool,
    strength: Vec<f64>,
    chance: &'a mut Chance,
}

impl Noise<'_> {
    /// A log of a motion: its positions with the torque that was asked for, and noise.
    fn on(&mut self, motion: &Columns, asked: &Columns) -> String {
        let rows = motion.rows.len();
        let seconds = motion.rows[rows - 1][0] - motion.rows[0][0];
        let rate_hz = (rows - 1) as f64 / seconds;
        let mut noise = || self.chance.noise(rows, rate_hz, Some(self.memory_s));
        let common = noise();
        let each: Vec<Vec<f64>> = (self.strength.iter())
            .map(|_| match self.shared {
                true => common.clone(),
                false => noise(),
            })
            .collect();
        let positions = motion.places("q_");
        let torques: Vec<usize> = (asked.places("tau_").into_iter())
            .filter(|k| !asked.names[*k].starts_with("tau_std_"))
            .collect();
        let name = |k: &usize| motion.names[*k].clone();
        let mut names = vec!["t".to_owned()];
        names.extend(positions.iter().map(name));
        names.extend(torques.iter().map(|k| asked.names[*k].clone()));
        let of_row = |(r, row): (usize, &Vec<f64>)| {
            let mut cells = vec![row[0]];
            cells.extend(positions.iter().map(|k| row[*k]));
            let asked = asked.at(row[0], &torques).into_iter().enumerate();
            cells.extend(asked.map(|(j, tau)| tau + self.strength[j] * each[j][r]));
            cells
        };
        let rows = motion.rows.iter().enumerate().map(of_row).collect();
        Columns { names, rows }.text()
    }
}

/// By how much the error of each joint changes on unseen motion, as a part of it before.
pub fn unseen_changes(row: &Value) -> Vec<f64> {
    let list = |key: &str| row[key].as_array().cloned().unwrap_or_default();
    let change = |(a, b): (&Value, &Value)| Some(a.as_f64()? / b.as_f64()? - 1.0);
    let (after, before) = (list("unseen_after"), list("unseen_before"));
    after.iter().zip(&before).filter_map(change).collect()
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| motion of | build | runs | not done | something named | joints share the noise | names | something written for prediction | unseen error by it, mean | worst joint |\n\
         | :-- | :-- | --: | --: | --: | --: | :-- | --: | --: | --: |\n",
    );
    let mut heads = Vec::new();
    for tool in rows.tools() {
        let (mut written, mut done) = (0, 0);
        for cell in cells() {
            let name = cell.name();
            let own: Vec<&Value> = rows.of(&tool, &name).collect();
            if own.is_empty() {
                continue;
            }
            let judged: Vec<&&Value> = own.iter().filter(|row| is_done(row)).collect();
            let effects = |row: &Value| row["written"].as_array().cloned().unwrap_or_default();
            let hit: Vec<&&&Value> = judged
                .iter()
                .filter(|row| !effects(row).is_empty())
                .collect();
            let mut names: Vec<String> = (hit.iter().flat_map(|row| effects(row)))
                .map(|w| w[0].as_str().unwrap_or_default().to_owned())
                .collect();
            names.sort();
            names.dedup();
            let common = hit.iter().filter(|row| row["shared"] == true).count();
            (written, done) = (written + hit.len(), done + judged.len());
            let predicting =
                |row: &&&&Value| row["predicting"].as_array().is_some_and(|p| !p.is_empty());
            let changes: Vec<f64> = judged.iter().flat_map(|row| unseen_changes(row)).collect();
            let percent = |x: f64| format!("{:+.2} %", 100.0 * x);
            let mean = changes.iter().sum::<f64>() / changes.len() as f64;
            let worst = changes.iter().copied().max_by(f64::total_cmp);
            text += &format!(
                "| {name} | {tool} | {} | {} | {} | {common} | {} | {} | {} | {} |\n",
                own.len(),
                own.len() - judged.len(),
                hit.len(),
                names.join(", "),
                judged.iter().filter(predicting).count(),
                worst.map_or("-".to_owned(), |_| percent(mean)),
                worst.map_or("-".to_owned(), percent),
            );
        }
        let (low, high) = Share::of(written, done).interval(LIMITS.confidence);
        heads.push(format!(
            "{tool}: something is named in {written} of {done} campaigns ({:.1}..{:.1} %; aim: at most {:.0} %)",
            100.0 * low,
            100.0 * high,
            100.0 * LIMITS.written_on_clean
        ));
    }
    format!("{}.\n\n{text}", heads.join("; "))
}
