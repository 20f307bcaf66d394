//! What the cases say: rates per machine, family and effect, and what fails.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use crate::study::interval;

/// Most findings that a line of the table tells apart.
const TOLD: usize = 4;

/// Writes the summaries into a folder.
pub fn write(rows: &[Value], draws: u64, asked: usize, folder: &Path) {
    std::fs::create_dir_all(folder).expect("the folder can be made");
    let ran: Vec<&Value> = rows.iter().filter(|r| r["steps"].is_array()).collect();
    let put: Vec<&Value> = (ran.iter().copied())
        .filter(|r| r["effect"].is_string())
        .collect();
    let none: Vec<&Value> = (ran.iter().copied())
        .filter(|r| r["effect"].is_null())
        .collect();
    let mut rates = vec![
        rate("an effect put in", &put),
        rate("nothing put in", &none),
    ];
    for key in ["size", "machine", "family"] {
        let words = |r: &Value| r[key].as_str().map_or(r[key].to_string(), str::to_owned);
        let mut kinds: Vec<String> = put.iter().map(|r| words(r)).collect();
        kinds.sort();
        kinds.dedup();
        for kind in kinds {
            let of: Vec<&Value> = put.iter().copied().filter(|r| words(r) == kind).collect();
            rates.push(rate(&format!("{key}: {kind}"), &of));
        }
    }
    let mut effects: Vec<&str> = rows.iter().filter_map(|r| r["effect"].as_str()).collect();
    effects.sort_unstable();
    effects.dedup();
    let by_effect = effects.iter().map(|name| {
        let of: Vec<&Value> = (put.iter().copied())
            .filter(|r| r["effect"] == *name)
            .collect();
        let absent = (rows.iter())
            .filter(|r| r["effect"] == *name && r["absent"].is_array())
            .count();
        let mut line = json!({ "effect put in": name });
        for (key, value) in rate("", &of).as_object().into_iter().flatten() {
            if key != "cases" && key != "95 % interval" {
                line[key] = value.clone();
            }
        }
        line["not put in"] = absent.into();
        line["said"] = said(&of).into();
        line
    });
    let missed = |r: &Value| r["effect"].is_string() && r["right member"] == false;
    let fails = |r: &&&Value| missed(r) || r["false"] != 0;
    let title = format!("{} of {asked} cases, draws: {draws}", rows.len().min(asked));
    let command = format!("cargo run --release --example study_semi -- --draws={draws}");
    let document = |what: &str, lines: Vec<Value>| json!({ "study": format!("{what}, {title}"), "command": command, "rows": lines });
    let mut of_rates = document("one effect put into measured logs", rates);
    of_rates["failed"] = json!(ran.iter().filter(fails).collect::<Vec<_>>());
    let of_effects = document(
        "effects put into measured logs, and what the diagnosis said",
        by_effect.collect(),
    );
    for (name, document) in [("study_semi", of_rates), ("study_semi_effects", of_effects)] {
        let path = folder.join(format!("{name}.json"));
        std::fs::write(path, format!("{document:#}\n")).expect("the summary is written");
    }
}

fn rate(kind: &str, rows: &[&Value]) -> Value {
    let count = |of: &dyn Fn(&Value) -> bool| rows.iter().filter(|r| of(r)).count();
    let family = count(&|r| r["right family"] == true);
    let member = count(&|r| r["right member"] == true);
    let wrong = count(&|r| r["false"] != 0);
    json!({
        "cases": kind,
        "diagnosed": rows.len(),
        "right family": family,
        "95 % interval": interval(family, rows.len()),
        "right member or among the alternatives": member,
        "with a false step": wrong,
        "nothing found": count(&|r| r["steps"].as_array().is_some_and(Vec::is_empty)),
    })
}

/// What was said, the most frequent first.
fn said(rows: &[&Value]) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for row in rows {
        let steps = row["steps"].as_array().into_iter().flatten();
        let names: Vec<&str> = (steps.filter_map(|s| s["effect"].as_str()))
            .filter_map(|title| title.split(' ').next())
            .collect();
        let names = if names.is_empty() {
            vec!["nothing"]
        } else {
            names
        };
        for name in names {
            *counts.entry(name.to_owned()).or_default() += 1;
        }
    }
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    let told = counts.iter().take(TOLD);
    let told: Vec<String> = told.map(|(name, n)| format!("{name} ({n})")).collect();
    told.join(", ")
}
