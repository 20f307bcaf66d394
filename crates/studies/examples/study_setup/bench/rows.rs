//! Faults in the rows of a log.

use std::path::Path;

use super::machines::Machine;
use super::table::Table;
use super::tool::run;

/// Unit of times since 1970.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Epoch {
    Second,
    Millisecond,
    Microsecond,
    Nanosecond,
}

impl Epoch {
    pub const ALL: [Self; 4] = [
        Self::Second,
        Self::Millisecond,
        Self::Microsecond,
        Self::Nanosecond,
    ];

    pub fn word(self) -> &'static str {
        match self {
            Self::Second => "s",
            Self::Millisecond => "ms",
            Self::Microsecond => "us",
            Self::Nanosecond => "ns",
        }
    }

    /// A time of the log as it stands in the file.
    pub fn written(self, t: f64) -> String {
        let nanoseconds = 1_700_000_000_000_000_000 + (t * 1e9).round() as i64;
        match self {
            Self::Second => format!(
                "{}.{:09}",
                nanoseconds / 1_000_000_000,
                nanoseconds % 1_000_000_000
            ),
            Self::Millisecond => {
                format!("{}.{:06}", nanoseconds / 1_000_000, nanoseconds % 1_000_000)
            }
            Self::Microsecond => format!("{}", (nanoseconds + 500) / 1000),
            Self::Nanosecond => nanoseconds.to_string(),
        }
    }
}

/// Numbers without pattern in (0, 1), the same ones in every run.
pub struct Chance(pub u64);

impl Chance {
    pub fn next(&mut self) -> f64 {
        // Knuth's multiplier; the upper bits are good
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The encoder starts again in the middle of the joint's range.
pub fn wrap(logs: &mut [Table], position: &str, turn: f64) {
    let all = || logs.iter().flat_map(|log| log.column(position));
    let low = all().fold(f64::INFINITY, |a, b| a.min(*b));
    let high = all().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
    let edge = 0.5 * (low + high);
    for log in logs {
        for q in log.column_mut(position) {
            *q = edge + (*q - edge).rem_euclid(turn);
        }
    }
}

/// The position is `size` larger from a row after the middle on.
pub fn step(log: &mut Table, position: &str, size: f64) {
    let from = log.rows() * 11 / 20;
    for q in &mut log.column_mut(position)[from..] {
        *q += size;
    }
}

/// The recorder is `n` times as fast as what it records.
pub fn hold(log: &mut Table, n: usize) {
    for column in &mut log.columns[1..] {
        for k in 0..column.len() {
            column[k] = column[k - k % n];
        }
    }
}

/// Bursts of 1 to 10 rows are missing.
pub fn drop(log: &mut Table, percent: usize) {
    let rows = log.rows();
    let mut missing = vec![false; rows];
    let mut chance = Chance(17);
    let mut count = 0;
    while count * 100 < rows * percent {
        let from = (chance.next() * rows as f64) as usize;
        let burst = 1 + (chance.next() * 10.0) as usize;
        for gone in missing.iter_mut().skip(from).take(burst) {
            count += usize::from(!*gone);
            *gone = true;
        }
    }
    log.retain(|k| !missing[k]);
}

/// The logs with pauses at rest behind each, so long that they are `percent` of all rows: poses of the
/// machine's own logs, the torque that `model` has there, and of each joint a share of its Coulomb level
/// that nothing tells. Positions rest on a count; the recorder stood still for a second before.
pub fn resting(
    machine: &Machine,
    percent: usize,
    folder: &Path,
    model: &str,
) -> Option<Vec<Table>> {
    let coulomb = coulomb_levels(machine, model);
    let mut chance = Chance(5);
    let mut out = machine.logs.clone();
    for (log, with) in machine.logs.iter().zip(&mut out) {
        let rows = log.rows() * percent / (100 - percent);
        let poses = (rows / 1000).clamp(1, 3);
        for pose in 0..poses {
            let at = log.rows() * (2 * pose + 1) / (2 * poses);
            let torque = torque_at_rest(machine, log, at, folder, model)?;
            let t = with.columns[0].clone();
            let step = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
            let from = t[t.len() - 1] + 1.0;
            let more = rows / poses;
            with.columns[0].extend((0..more).map(|k| from + step * k as f64));
            for (j, joint) in machine.joints.iter().enumerate() {
                let q = log.column(&joint.position)[at];
                with.column_mut(&joint.position).extend(vec![q; more]);
                let own = log.column(&joint.torque);
                let rms = (own.iter().map(|x| x * x).sum::<f64>() / own.len() as f64).sqrt();
                let held = coulomb[j] * (2.0 * chance.next() - 1.0);
                let middle = (torque[j] + held) / machine.torque_of_column(j);
                let noise = (0..more).map(|_| middle + 0.02 * rms * (chance.next() - 0.5));
                with.column_mut(&joint.torque).extend(noise);
            }
        }
    }
    Some(out)
}

/// Torque of the model [Nm or N] where the machine stands still in the pose of a row.
fn torque_at_rest(
    machine: &Machine,
    log: &Table,
    row: usize,
    folder: &Path,
    model: &str,
) -> Option<Vec<f64>> {
    let mut rest = log.clone();
    for column in &mut rest.columns[1..] {
        let value = column[row];
        column.fill(value);
    }
    rest.retain(|k| k < 1000);
    rest.write(&folder.join("rest.csv"), |t| t.to_string());
    std::fs::write(folder.join("rest-model.toml"), model).ok()?;
    let words = "torque rest.csv -m rest-model.toml -o rest-torque.csv";
    let done = run(folder, &words.split_whitespace().collect::<Vec<_>>());
    assert_eq!(done.status, 0, "{}", done.message);
    let names: Vec<String> = machine
        .joints
        .iter()
        .map(|j| format!("tau_{}", j.name))
        .collect();
    let torque = Table::read(&folder.join("rest-torque.csv"), &names)?;
    Some(
        torque
            .columns
            .iter()
            .map(|column| column[column.len() / 2])
            .collect(),
    )
}

/// Coulomb friction of each joint in a model file.
fn coulomb_levels(machine: &Machine, model: &str) -> Vec<f64> {
    let file: toml::Table = toml::from_str(model).expect("a model file");
    let parameters = file["parameter"].as_array().expect("parameters");
    let of = |joint: &str, name: &str| {
        let text =
            |p: &toml::Value, key: &str| p.get(key).and_then(|v| v.as_str().map(str::to_owned));
        let found = parameters.iter().find(|p| {
            text(p, "joint").as_deref() == Some(joint) && text(p, "name").as_deref() == Some(name)
        });
        found.and_then(|p| p["value"].as_float())
    };
    let level = |joint: &str| {
        let two = of(joint, "coulomb_1")
            .zip(of(joint, "coulomb_2"))
            .map(|(a, b)| a + b);
        of(joint, "coulomb").or(two).unwrap_or(0.0).abs()
    };
    machine
        .joints
        .iter()
        .map(|joint| level(&joint.name))
        .collect()
}
