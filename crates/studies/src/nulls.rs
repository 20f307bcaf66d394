//! Is an effect written where the model is true and the rest is noise?
//!
//! Positions are those of measured logs, so motion, sensors and clock are real. The torque is the one that the fitted
//! model asks for along them, with noise as strong as what the model leaves of the measured torque. Half of its power
//! forgets in 0.05 to 2 s, the other half is white; in every second run all joints share it.

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
            for words in [
                &["convert", part, "part.csv", "-r", &robot][..],
                &["validate", part, "-m", "true.toml", "-o", "left.csv"],
                &["torque", "part.csv", "-m", "plain.toml", "-o", "asked.csv"],
            ] {
                let done = tool.run(folder, words)?;
                if done.exit != 0 {
                    return Ok(json!({ "exit": done.exit, "said": done.last_words() }));
                }
            }
            let name = format!("null{k}.csv");
            let text = null(folder, memory_s, shared, &mut chance)?;
            files::write(&folder.join(&name), &text)?;
            fitted.push(name);
        }
        let campaign = Campaign {
            robot: "robot.toml".to_owned(),
            fitted,
            holdout: None,
            unseen: None,
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

/// The positions of `part.csv` with the torque of `asked.csv` and noise as strong as the residual in `left.csv`.
fn null(
    folder: &File,
    memory_s: f64,
    shared: bool,
    chance: &mut Chance,
) -> Result<String, StudyError> {
    let [part, left, asked] =
        ["part.csv", "left.csv", "asked.csv"].map(|name| Columns::read(&folder.join(name)));
    let (part, left, asked) = (part?, left?, asked?);
    let strength: Vec<f64> = (left.places("residual_").iter())
        .map(|k| {
            let squares: f64 = left.rows.iter().map(|row| row[*k] * row[*k]).sum();
            (squares / left.rows.len() as f64).sqrt()
        })
        .collect();
    let seconds = part.rows[part.rows.len() - 1][0] - part.rows[0][0];
    let rate_hz = (part.rows.len() - 1) as f64 / seconds;
    let mut noise = || chance.noise(part.rows.len(), rate_hz, Some(memory_s));
    let common = noise();
    let each: Vec<Vec<f64>> = strength
        .iter()
        .map(|_| match shared {
            true => common.clone(),
            false => noise(),
        })
        .collect();
    let positions = part.places("q_");
    let torques: Vec<usize> = (asked.places("tau_").into_iter())
        .filter(|k| !asked.names[*k].starts_with("tau_std_"))
        .collect();
    let name = |k: &usize| part.names[*k].clone();
    let mut heads = vec!["t".to_owned()];
    heads.extend(positions.iter().map(name));
    heads.extend(torques.iter().map(|k| asked.names[*k].clone()));
    let mut text = heads.join(",") + "\n";
    for (r, row) in part.rows.iter().enumerate() {
        let mut cells = vec![format!("{:?}", row[0])];
        cells.extend(positions.iter().map(|k| format!("{:?}", row[*k])));
        let asked = asked.at(row[0], &torques);
        let torque = |(j, tau): (usize, f64)| format!("{:?}", tau + strength[j] * each[j][r]);
        cells.extend(asked.into_iter().enumerate().map(torque));
        text += &cells.join(",");
        text.push('\n');
    }
    Ok(text)
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| motion of | build | runs | not done | something written | joints share the noise | names |\n\
         | :-- | :-- | --: | --: | --: | --: | :-- |\n",
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
            text += &format!(
                "| {name} | {tool} | {} | {} | {} | {common} | {} |\n",
                own.len(),
                own.len() - judged.len(),
                hit.len(),
                names.join(", ")
            );
        }
        let (low, high) = Share::of(written, done).interval(LIMITS.confidence);
        heads.push(format!(
            "{tool}: something is written in {written} of {done} campaigns ({:.1}..{:.1} %; aim: at most {:.0} %)",
            100.0 * low,
            100.0 * high,
            100.0 * LIMITS.written_on_clean
        ));
    }
    format!("{}.\n\n{text}", heads.join("; "))
}
