//! The kinds of blocks: each turns result JSON under docs/results into Markdown.

use std::fmt::Write;
use std::path::Path;

use super::{arms, drives, formulas, simulators};
use cft_ident::number::{percent, significant, value_and_std};
use cft_ident::report::usual::{ErrorScope, PUBLISHED, PublishedError, TorqueMeasurement};
use serde_json::Value;

pub type Rendered = Result<String, String>;

/// Renders the block of these words: a kind, then files of docs/results without their ending.
pub fn render(words: &[&str]) -> Rendered {
    match words {
        ["parameters", fit] => parameters(&json(fit)?, None),
        ["parameters", fit, published] => parameters(&json(fit)?, Some(&json(published)?)),
        ["errors", validations @ ..] => errors(validations),
        ["friction", result] => friction(&json(result)?),
        ["curve", result, published] => curve(&json(result)?, &json(published)?),
        ["study", study, columns @ ..] => self::study(&json(study)?, columns),
        ["steps", diagnosis] => steps(&json(diagnosis)?),
        ["estimators", validations @ ..] => estimators(validations),
        ["arm-errors", names @ ..] => arms::errors(names),
        ["arm-friction", names @ ..] => arms::friction(names),
        ["arm-parameters", names @ ..] => arms::named(names),
        ["formulas", names @ ..] => formulas::found(names),
        ["drive-parameters", names @ ..] => drives::parameters(names),
        ["drive-errors", names @ ..] => drives::errors(names),
        ["usual"] => Ok(usual()),
        ["left-out", result] => Ok(simulators::left_out(&json(result)?)),
        ["replay", result] => Ok(simulators::replay(&json(result)?)),
        ["readers", result] => Ok(simulators::readers(&json(result)?)),
        ["probes", result] => Ok(simulators::probes(&json(result)?)),
        ["same-robot", result] => Ok(simulators::same_robot(&json(result)?)),
        ["text", name] => {
            let text = read(&format!("{name}.txt"))?;
            Ok(format!("```text\n{}\n```\n", text.trim_end()))
        }
        _ => Err(format!("`{}` is no known kind of table", words.join(" "))),
    }
}

fn read(name: &str) -> Result<String, String> {
    let folder = Path::new(cft_ident_support::ROOT).join("docs/results");
    std::fs::read_to_string(folder.join(name))
        .map_err(|error| format!("docs/results/{name}: {error}"))
}

pub fn json(name: &str) -> Result<Value, String> {
    serde_json::from_str(&read(&format!("{name}.json"))?)
        .map_err(|error| format!("docs/results/{name}.json: {error}"))
}

/// A number, NaN where there is none.
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

pub fn text(value: &Value) -> &str {
    value.as_str().unwrap_or("")
}

pub fn rows(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// A Markdown table; columns whose name begins with `<` stand at the left.
pub fn table(columns: &[&str], rows: &[Vec<String>]) -> String {
    let mut out = String::new();
    let names: Vec<&str> = columns.iter().map(|c| c.trim_start_matches('<')).collect();
    let rules: Vec<&str> = columns
        .iter()
        .map(|c| if c.starts_with('<') { ":--" } else { "--:" })
        .collect();
    let _ = writeln!(out, "| {} |\n| {} |", names.join(" | "), rules.join(" | "));
    for row in rows {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
    out
}

/// What `lsq` found, beside published values where there are some.
fn parameters(fit: &Value, published: Option<&Value>) -> Rendered {
    let mut columns = vec!["<parameter", "fitted", "std"];
    if published.is_some() {
        columns.extend(["published", "difference"]);
    }
    columns.extend(["<unit", "<verdict"]);
    let mut lines = Vec::new();
    for parameter in rows(&fit["parameters"]) {
        let name = text(&parameter["name"]);
        let (value, std) = value_and_std(number(&parameter["value"]), number(&parameter["std"]));
        let mut line = vec![name.to_owned(), value, std];
        if let Some(published) = published {
            let theirs = number(&published["parameters"][name]);
            let off = number(&parameter["value"]) / theirs - 1.0;
            line.extend([theirs.to_string(), signed_percent(off)]);
        }
        line.extend([
            text(&parameter["unit"]).to_owned(),
            text(&parameter["verdict"]).to_owned(),
        ]);
        lines.push(line);
    }
    let mut out = table(&columns, &lines);
    let condition = significant(number(&fit["condition"]["raw"]), 4);
    let _ = write!(
        out,
        "\nCondition number of the stacked regressor: {condition}"
    );
    if let Some(published) = published {
        let theirs = significant(number(&published["condition"]), 4);
        let _ = write!(out, " (published: {theirs})");
    }
    let _ = writeln!(
        out,
        "; {} rows after decimation, effective sample size {}.",
        fit["samples"],
        significant(number(&fit["effective_samples"]).round(), 3)
    );
    Ok(out)
}

/// What `diagnose` chose, step by step.
fn steps(diagnosis: &Value) -> Rendered {
    let mut lines = Vec::new();
    for step in rows(&diagnosis["steps"]) {
        let mut numbers = Vec::new();
        for (key, p) in step["parameters"].as_object().into_iter().flatten() {
            let (value, std) = value_and_std(number(&p["value"]), number(&p["std"]));
            let known = p["std"].as_f64().is_some_and(|s| s > 0.0);
            let std = if known {
                format!(" \u{b1} {std}")
            } else {
                String::new()
            };
            numbers.push(
                format!("{key} {value}{std} {}", text(&p["unit"]))
                    .trim_end()
                    .to_owned(),
            );
        }
        let alike: Vec<&str> = rows(&step["alternatives"]).iter().map(text).collect();
        lines.push(vec![
            format!(
                "{} of {}",
                text(&step["effect"]),
                step["joint"].as_str().unwrap_or("all")
            ),
            text(&step["family"]).to_owned(),
            numbers.join(", "),
            percent(number(&step["share"])),
            text(&step["status"]).to_owned(),
            significant(number(&step["shrinkage"]), 2),
            percent(number(&step["holdout_before"])),
            percent(number(&step["holdout_after"])),
            if alike.is_empty() {
                "-".to_owned()
            } else {
                alike.join(", ")
            },
        ]);
    }
    let columns = [
        "<effect",
        "<family",
        "<parameters of the joint fit",
        "gain on blocks left out",
        "<status",
        "s",
        "unseen before",
        "after",
        "<not separated from",
    ];
    Ok(table(&columns, &lines))
}

/// Errors over the joints of validations named MACHINE_est_ESTIMATOR: a row an estimator, a column a machine.
fn estimators(names: &[&str]) -> Rendered {
    let mut machines: Vec<&str> = Vec::new();
    let mut lines: Vec<Vec<String>> = Vec::new();
    for name in names {
        let (machine, estimator) = name
            .split_once("_est_")
            .ok_or_else(|| format!("`{name}` is no MACHINE_est_ESTIMATOR"))?;
        if !machines.contains(&machine) {
            machines.push(machine);
        }
        let error = percent(number(&json(name)?["overall"]["mean_relative_error"]));
        match lines.iter_mut().find(|line| line[0] == estimator) {
            Some(line) => line.push(error),
            None => lines.push(vec![estimator.to_owned(), error]),
        }
    }
    Ok(table(&[&["<estimator"], &machines[..]].concat(), &lines))
}

fn signed_percent(fraction: f64) -> String {
    if fraction.is_finite() {
        format!("{:+.2} %", 100.0 * fraction)
    } else {
        "-".to_owned()
    }
}

/// Torque errors of `validate`, one row per log; the first name may be of published values.
fn errors(names: &[&str]) -> Rendered {
    let mut published = None;
    let mut lines = Vec::new();
    for name in names {
        let result = json(name)?;
        if result["schema"].is_null() {
            published = Some(result["relative_error"].clone());
            continue;
        }
        let log = rows(&result["inputs"]).first().unwrap_or(&Value::Null);
        let label = match log["span"].as_str() {
            None => text(&log["name"]).to_owned(),
            Some(span) => format!("{}@{span}", text(&log["name"])),
        };
        for joint in rows(&result["joints"]) {
            let mut line = vec![
                label.clone(),
                text(&joint["joint"]).to_owned(),
                percent(number(&joint["relative_error"])),
            ];
            if let Some(published) = &published {
                line.push(percent(number(&published[&label])));
            }
            line.extend([
                percent(number(&joint["relative_error_raw"])),
                format!(
                    "{} {}",
                    significant(number(&joint["rmse"]), 3),
                    text(&joint["unit"])
                ),
                format!(
                    "{} {}",
                    significant(number(&joint["max_abs"]), 3),
                    text(&joint["unit"])
                ),
                significant(number(&joint["r2"]), 4),
            ]);
            lines.push(line);
        }
    }
    let mut columns = vec!["<log", "<joint", "relative error"];
    if published.is_some() {
        columns.push("published");
    }
    columns.extend(["before the parallel filter", "rms", "largest", "R2"]);
    Ok(table(&columns, &lines))
}

/// Parameters of the friction law by the filter, with one-sided bounds as such.
fn friction(result: &Value) -> Rendered {
    let mut lines = Vec::new();
    for joint in rows(&result["joints"]) {
        let parameters = joint["parameters"].as_object().into_iter().flatten();
        for (name, parameter) in parameters {
            let (value, std) =
                value_and_std(number(&parameter["value"]), number(&parameter["std"]));
            let verdict = text(&parameter["verdict"]);
            let value = match verdict {
                "lower-bound" => format!("> {}", significant(number(&parameter["value"]), 3)),
                _ => value,
            };
            lines.push(vec![
                text(&joint["joint"]).to_owned(),
                name.clone(),
                value,
                std,
                text(&parameter["unit"]).to_owned(),
                verdict.to_owned(),
            ]);
        }
    }
    let columns = ["<joint", "<parameter", "value", "std", "<unit", "<verdict"];
    Ok(table(&columns, &lines))
}

/// The filter's friction curve beside a published law Fv v + Fc sgn v.
fn curve(result: &Value, published: &Value) -> Rendered {
    let law = |v: f64| {
        let of = |name: &str| number(&published["parameters"][name]);
        of("viscous") * v + of("coulomb") * v.signum()
    };
    let joint = &result["joints"][0];
    let points: Vec<[f64; 3]> = rows(&joint["curve"])
        .iter()
        .map(|p| [number(&p["v"]), number(&p["torque"]), number(&p["std"])])
        .collect();
    let shown = [0.0, 0.25, 0.5, 0.75, 1.0];
    let speeds = |direction: f64| {
        let mut side: Vec<[f64; 3]> = points.clone();
        side.retain(|p| p[0] * direction > 0.0);
        side.sort_by(|a, b| a[0].abs().total_cmp(&b[0].abs()));
        let last = side.len().saturating_sub(1) as f64;
        let picked = shown.iter().map(|share| (share * last).round() as usize);
        picked
            .filter_map(|k| side.get(k).copied())
            .collect::<Vec<_>>()
    };
    let mut picked = speeds(-1.0);
    picked.reverse();
    picked.extend(speeds(1.0));
    let lines: Vec<Vec<String>> = picked
        .iter()
        .map(|&[v, torque, std]| {
            let (torque_text, std_text) = value_and_std(torque, std);
            let (theirs, off) = (law(v), torque - law(v));
            vec![
                significant(v, 3),
                torque_text,
                std_text,
                format!("{theirs:.2}"),
                format!("{off:+.2}"),
            ]
        })
        .collect();
    let mut out = table(
        &[
            "v [m/s]",
            "filter [N]",
            "std [N]",
            "published [N]",
            "difference [N]",
        ],
        &lines,
    );
    let norm =
        |f: &dyn Fn(&[f64; 3]) -> f64| points.iter().map(|p| f(p).powi(2)).sum::<f64>().sqrt();
    let distance = norm(&|p| p[1] - law(p[0])) / norm(&|p| law(p[0]));
    let covered = &joint["speeds_covered"];
    let _ = writeln!(
        out,
        "\nOver the speeds covered ({} to {} m/s in both directions, {} points) the curves differ by {} in relative norm.",
        significant(number(&covered[0]), 2),
        significant(number(&covered[1]), 3),
        points.len(),
        percent(distance)
    );
    Ok(out)
}

/// A study: its command, its seeds, and its rows with their keys as columns; those of these numbers, from 1, or all.
fn study(study: &Value, chosen: &[&str]) -> Rendered {
    let all: Vec<&str> = rows(&study["rows"])
        .first()
        .and_then(Value::as_object)
        .map(|row| row.keys().map(String::as_str).collect())
        .ok_or("the study has no rows")?;
    let chosen = chosen.iter().map(|column| {
        let number: Option<usize> = column.parse().ok();
        let found = number.and_then(|k| all.get(k.wrapping_sub(1)));
        found.ok_or_else(|| format!("the study has no column {column}"))
    });
    let mut columns: Vec<&str> = chosen
        .map(|found| found.copied())
        .collect::<Result<_, _>>()?;
    if columns.is_empty() {
        columns = all.clone();
    }
    let lines: Vec<Vec<String>> = rows(&study["rows"])
        .iter()
        .map(|row| columns.iter().map(|column| cell(&row[*column])).collect())
        .collect();
    let left = |column: &&str| {
        rows(&study["rows"])
            .iter()
            .all(|row| is_name(&row[*column]))
    };
    let headers: Vec<String> = columns
        .iter()
        .map(|column| format!("{}{column}", if left(column) { "<" } else { "" }))
        .collect();
    let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
    let seeds = match study["seeds"].as_u64() {
        Some(seeds) => format!(", {seeds} seeds"),
        None => String::new(),
    };
    Ok(format!(
        "Table of {}{seeds}: `{}`\n\n{}",
        text(&study["study"]),
        text(&study["command"]),
        table(&headers, &lines)
    ))
}

/// Errors of published models.
fn usual() -> String {
    let error = |value: Option<f64>| value.map_or("-".to_owned(), percent);
    let line = |row: &PublishedError| {
        vec![
            row.machine.to_owned(),
            match row.measured {
                TorqueMeasurement::Sensors => "joint sensors".to_owned(),
                TorqueMeasurement::Currents => "motor currents".to_owned(),
            },
            match row.over {
                ErrorScope::All => "all torques".to_owned(),
                ErrorScope::Joints => "rms over joints".to_owned(),
            },
            error(row.fitted),
            error(row.unseen),
            row.source.to_owned(),
        ]
    };
    let lines: Vec<Vec<String>> = PUBLISHED.iter().map(line).collect();
    let columns = [
        "<machine",
        "<torques from",
        "<error over",
        "fitted",
        "not fitted",
        "<source",
    ];
    table(&columns, &lines)
}

/// A cell as it is where it is text, with four digits where it is a number.
fn cell(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Number(n) if n.is_f64() => significant(number(value), 4),
        Value::Number(n) => n.to_string(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        _ => "-".to_owned(),
    }
}

/// Whether a cell is a word, not a number with or without a unit.
fn is_name(value: &Value) -> bool {
    let number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
    value.as_str().is_some_and(|text| !number(text))
}
