//! A fit as the bench judges it: errors, parameters, and whether bodies and friction can be such.

use std::path::Path;

use serde_json::Value;

use super::machines::Machine;
use super::table::Table;
use super::tool::Done;

/// A parameter of the model file.
#[derive(Debug, Clone)]
pub struct Parameter {
    pub name: String,
    pub joint: String,
    pub value: f64,
    pub std: f64,
}

/// What a fit gave.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Relative error of each joint.
    pub errors: Vec<f64>,
    pub parameters: Vec<Parameter>,
    /// What is negative by more than two deviations and cannot be.
    pub impossible: Vec<String>,
}

impl Fit {
    /// Reads the fit that a command wrote to `model`; nothing where it failed.
    pub fn read(machine: &Machine, logs: &[Table], done: &Done, model: &Path) -> Option<Self> {
        if done.status != 0 {
            return None;
        }
        let text = std::fs::read_to_string(model).ok()?;
        let file: toml::Table = toml::from_str(&text).ok()?;
        let parameters: Vec<Parameter> = file["parameter"]
            .as_array()?
            .iter()
            .map(parameter)
            .collect::<Option<_>>()?;
        let errors = rows(&done.document["joints"])
            .iter()
            .map(|joint| joint["relative_error"].as_f64().unwrap_or(f64::NAN))
            .collect();
        let covariance = Covariance::read(&file);
        let mut impossible = bodies(&done.document["parameters"], &parameters);
        impossible.extend(friction(machine, logs, &parameters, covariance.as_ref()));
        Some(Self {
            errors,
            parameters,
            impossible,
        })
    }

    /// Mean of the squares over the joints, its root.
    pub fn error(&self) -> f64 {
        let squares: f64 = self.errors.iter().map(|e| e * e).sum();
        (squares / self.errors.len() as f64).sqrt()
    }

    /// Largest distance of a parameter to that of another fit, in the other's deviations.
    pub fn distance(&self, clean: &Self) -> (f64, String) {
        let mut worst = (0.0, String::new());
        for theirs in &clean.parameters {
            let same = |p: &&Parameter| p.name == theirs.name && p.joint == theirs.joint;
            let name = || format!("{} {}", theirs.name, theirs.joint);
            let Some(ours) = self.parameters.iter().find(same) else {
                return (f64::INFINITY, name());
            };
            let off = (ours.value - theirs.value).abs() / theirs.std;
            if off > worst.0 {
                worst = (off, name());
            }
        }
        worst
    }
}

pub fn rows(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn parameter(p: &toml::Value) -> Option<Parameter> {
    let text = |key: &str| p.get(key).and_then(toml::Value::as_str).unwrap_or("");
    Some(Parameter {
        name: text("name").to_owned(),
        joint: text("joint").to_owned(),
        value: number(p.get("value")?)?,
        std: p.get("std").and_then(number).unwrap_or(0.0),
    })
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|i| i as f64))
}

/// `[covariance]` of a model file.
struct Covariance {
    names: Vec<String>,
    values: Vec<Vec<f64>>,
}

impl Covariance {
    fn read(file: &toml::Table) -> Option<Self> {
        let section = file.get("covariance")?;
        let words = |v: &toml::Value| v.as_str().map(str::to_owned);
        let names = section.get("names")?.as_array()?.iter().map(words);
        let row = |v: &toml::Value| v.as_array()?.iter().map(number).collect();
        let values = section.get("matrix")?.as_array()?.iter().map(row);
        Some(Self {
            names: names.collect::<Option<_>>()?,
            values: values.collect::<Option<_>>()?,
        })
    }

    fn of(&self, a: &str, b: &str) -> Option<f64> {
        let place = |name: &str| self.names.iter().position(|known| known == name);
        self.values.get(place(a)?)?.get(place(b)?).copied()
    }
}

/// Masses and moments of inertia that came out negative: unknowns that are sums of such alone.
fn bodies(unknowns: &Value, parameters: &[Parameter]) -> Vec<String> {
    let mut out = Vec::new();
    for unknown in rows(unknowns) {
        let text = |key: &str| unknown[key].as_str().unwrap_or("");
        // single joints have no short names
        let key = match text("key") {
            "" => text("name"),
            key => key,
        };
        if !positive_sum(text("name")) {
            continue;
        }
        let of = parameters.iter().find(|p| p.name == key);
        if of.is_some_and(|p| p.value < -2.0 * p.std) {
            out.push(key.to_owned());
        }
    }
    out
}

/// Whether a grouping is a sum of masses and moments of inertia.
fn positive_sum(grouping: &str) -> bool {
    if grouping == "inertia" {
        return true;
    }
    let letters = |word: &str| {
        word.trim_end_matches(|c: char| c.is_ascii_digit())
            .to_owned()
    };
    grouping.split_whitespace().all(|word| {
        let symbol = letters(word);
        word == "+"
            || word.parse::<f64>().is_ok_and(|factor| factor > 0.0)
            || ["Ixx", "Iyy", "Izz", "Ia", "m"].contains(&symbol.as_str())
    })
}

/// Joints whose viscous and Coulomb friction together drive them, over the speeds of the logs.
fn friction(
    machine: &Machine,
    logs: &[Table],
    parameters: &[Parameter],
    covariance: Option<&Covariance>,
) -> Vec<String> {
    let mut out = Vec::new();
    for joint in &machine.joints {
        let of = |name: &str| {
            let same = |p: &&Parameter| p.name == name && p.joint == joint.name;
            parameters.iter().find(same)
        };
        let (Some(viscous), Some(coulomb)) = (of("viscous"), of("coulomb")) else {
            continue;
        };
        let (square, size) = speeds(logs, &joint.position, joint.in_si());
        let power = viscous.value * square + coulomb.value * size;
        let (a, b) = (
            name_in("viscous", &joint.name),
            name_in("coulomb", &joint.name),
        );
        let both = covariance.and_then(|c| c.of(&a, &b)).unwrap_or(0.0);
        let variance = (viscous.std * square).powi(2)
            + (coulomb.std * size).powi(2)
            + 2.0 * both * square * size;
        if power < -2.0 * variance.max(0.0).sqrt() {
            out.push(format!("friction of {}", joint.name));
        }
    }
    out
}

/// A parameter of a joint as the covariance names it.
fn name_in(name: &str, joint: &str) -> String {
    format!("{name}:{joint}")
}

/// Means of the square and of the size of a joint's speed.
fn speeds(logs: &[Table], position: &str, in_si: f64) -> (f64, f64) {
    let (mut square, mut size, mut rows) = (0.0, 0.0, 0.0);
    for log in logs {
        let (t, q) = (&log.columns[0], log.column(position));
        // over 10 rows: what quantisation adds is small
        for k in (10..log.rows()).step_by(10) {
            let v = in_si * (q[k] - q[k - 10]) / (t[k] - t[k - 10]).max(1e-6);
            square += v * v;
            size += v.abs();
            rows += 1.0;
        }
    }
    (square / rows, size / rows)
}
