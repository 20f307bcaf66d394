//! Rows of cases to counts: per kind and machine, and the misses by name.

use serde_json::{Value, json};

use crate::bench::judge::{is, met};
use crate::bench::machines::NAMES;

/// Kinds in the order of the table.
const KINDS: [&str; 15] = [
    "sign",
    "exchange",
    "base and tip",
    "scale",
    "zero",
    "gravity",
    "currents",
    "rounded angles",
    "wrap",
    "step",
    "hold",
    "rest",
    "dropped rows",
    "column names",
    "epoch time",
];

#[derive(Default)]
struct Count {
    cases: usize,
    matter: usize,
    named: usize,
    /// Named as likely and no more: a warning.
    likely: usize,
    first: usize,
    tied: usize,
    right_joint: usize,
    fixed: usize,
    met: usize,
}

impl Count {
    fn of<'a>(rows: impl Iterator<Item = &'a Value>) -> Self {
        let mut out = Self::default();
        for row in rows {
            out.cases += 1;
            if !is(row, "matters") {
                continue;
            }
            out.matter += 1;
            out.named += usize::from(is(row, "named"));
            out.likely += usize::from(row["sure"] == false && shown(row));
            out.first += usize::from(is(row, "first"));
            out.tied += usize::from(!is(row, "first") && is(row, "tied"));
            out.right_joint += usize::from(is(row, "right_joint"));
            out.fixed += usize::from(is(row, "fixed"));
            out.met += usize::from(met(row));
        }
        out
    }

    fn json(&self) -> Value {
        json!({
            "cases": self.cases,
            "matter": self.matter,
            "named": self.named,
            "likely": self.likely,
            "first": self.first,
            "tied": self.tied,
            "right_joint": self.right_joint,
            "fixed": self.fixed,
            "met": self.met,
        })
    }
}

/// Whether the check of the set-up said anything of a case.
fn shown(row: &Value) -> bool {
    row["setup"].as_array().is_some_and(|list| !list.is_empty())
}

/// Counts of rows. `all` is how many cases there are.
pub fn summary(rows: &[Value], all: usize) -> Value {
    let faults: Vec<&Value> = rows.iter().filter(|r| r["kind"] != "clean").collect();
    let clean: Vec<&Value> = rows.iter().filter(|r| r["kind"] == "clean").collect();
    let of = |key: &str, name: &str| {
        let same = faults.iter().copied().filter(|r| r[key] == name);
        let mut count = Count::of(same).json();
        count["name"] = name.into();
        count
    };
    let some = |count: &Value| count["cases"] != 0;
    let kinds: Vec<Value> = KINDS
        .iter()
        .map(|kind| of("kind", kind))
        .filter(some)
        .collect();
    let machines: Vec<Value> = NAMES
        .iter()
        .map(|name| of("machine", name))
        .filter(some)
        .collect();
    let label = |r: &Value| {
        let text = |key: &str| r[key].as_str().unwrap_or("").to_owned();
        format!("{}: {}", text("machine"), text("case"))
    };
    let mut misses: Vec<Value> = faults
        .iter()
        .filter(|r| is(r, "matters") && !met(r))
        .map(|r| {
            json!({
                "case": label(r),
                "why": r["why"],
                "named": r["named"],
                "first": r["first"],
                "tied": r["tied"],
                "fixed": r["fixed"],
                "distance": r["distance"],
                "parameter": r["parameter"],
                "setup": r["setup"],
            })
        })
        .collect();
    misses.sort_by_key(|m| m["case"].as_str().map(str::to_owned));
    let wrongly = |r: &&&Value| is(r, "false");
    let by_what = |r: &Value| {
        let kinds: Vec<&str> = (r["kinds"].as_array().into_iter().flatten())
            .filter_map(Value::as_str)
            .collect();
        let entries = |key: &str| r[key].as_array().is_some_and(|list| !list.is_empty());
        match (entries("setup") || entries("inspected"), kinds.is_empty()) {
            (true, _) => "by the check of the set-up".to_owned(),
            (false, true) => "by the look at its rows".to_owned(),
            (false, false) => format!("by the look at its rows: {}", kinds.join(", ")),
        }
    };
    let accused = |r: &&Value| format!("{} ({})", label(r), by_what(r));
    let mut false_cases: Vec<String> = clean.iter().filter(wrongly).map(accused).collect();
    false_cases.sort();
    let seconds: f64 = rows.iter().filter_map(|r| r["seconds"].as_f64()).sum();
    json!({
        "study": "faults of the set-up",
        "command": "cargo build --release && cargo run --release -p cft-ident-studies --example study_setup",
        "sample": {"cases": rows.len(), "of": all},
        "all": Count::of(faults.iter().copied()).json(),
        "kinds": kinds,
        "machines": machines,
        "clean": {"cases": clean.len(), "false": false_cases},
        "misses": misses,
        "minutes": (seconds / 6.0).round() / 10.0,
    })
}

pub fn print(summary: &Value) {
    println!("{:16} cases matter named first tied joint fixed", "");
    let line = |name: &str, c: &Value| {
        println!(
            "{name:16} {:>5} {:>6} {:>5} {:>5} {:>4} {:>5} {:>5}",
            c["cases"].to_string(),
            c["matter"].to_string(),
            c["named"].to_string(),
            c["first"].to_string(),
            c["tied"].to_string(),
            c["right_joint"].to_string(),
            c["fixed"].to_string()
        );
    };
    for list in ["kinds", "machines"] {
        for count in summary[list].as_array().into_iter().flatten() {
            line(count["name"].as_str().unwrap_or(""), count);
        }
    }
    line("all", &summary["all"]);
    println!("clean: {}", summary["clean"]);
    println!(
        "{} misses, {} min",
        summary["misses"].as_array().map_or(0, Vec::len),
        summary["minutes"]
    );
}
