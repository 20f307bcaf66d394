//! Tables of the study of set-up faults.

use std::fmt::Write;

use serde_json::Value;

use super::tables::{Rendered, json, rows, table, text};

/// Counts by kind of fault and by machine, and the misses by name.
pub fn faults(name: &str) -> Rendered {
    let study = json(name)?;
    let mut out = counts("fault", &study["kinds"], Some(&study["all"]));
    let _ = write!(out, "\n{}", counts("machine", &study["machines"], None));
    let sample = &study["sample"];
    if sample["cases"] != sample["of"] {
        let _ = writeln!(
            out,
            "\nA sample: {} of {} cases, faults and right set-ups together.",
            sample["cases"], sample["of"]
        );
    }
    let falsely = rows(&study["clean"]["false"]);
    let clean = &study["clean"]["cases"];
    let _ = match falsely {
        [] => writeln!(
            out,
            "\nNothing was said of any of {clean} set-ups that are right."
        ),
        some => {
            let names: Vec<&str> = some.iter().map(text).collect();
            let count = names.len();
            let names = names.join("; ");
            writeln!(
                out,
                "\nSaid falsely of {count} of {clean} set-ups that are right: {names}."
            )
        }
    };
    let misses = rows(&study["misses"]);
    if !misses.is_empty() {
        let names: Vec<String> = misses.iter().map(miss).collect();
        let _ = writeln!(out, "\nNot met: {}.", names.join("; "));
    }
    let _ = writeln!(out, "\nMade by `{}`.", text(&study["command"]));
    Ok(out)
}

fn counts(first: &str, counts: &Value, all: Option<&Value>) -> String {
    let line = |count: &Value, name: &str| {
        let keys = [
            "cases",
            "matter",
            "named",
            "likely",
            "first",
            "tied",
            "right_joint",
            "fixed",
        ];
        let numbers = keys.iter().map(|key| count[*key].to_string());
        [name.to_owned()].into_iter().chain(numbers).collect()
    };
    let mut lines: Vec<Vec<String>> = rows(counts)
        .iter()
        .map(|count| line(count, text(&count["name"])))
        .collect();
    lines.extend(all.map(|count| line(count, "all")));
    let first = format!("<{first}");
    let columns = [
        first.as_str(),
        "cases",
        "that matter",
        "named",
        "as likely only",
        "truth first",
        "one of two",
        "right joint",
        "mended",
    ];
    table(&columns, &lines)
}

/// A case that was not met, and what of it.
fn miss(miss: &Value) -> String {
    let is = |key: &str| miss[key].as_bool() == Some(true);
    let what = if !is("named") {
        "not named"
    } else if !is("first") && !is("tied") {
        "named as something else"
    } else {
        "not mended"
    };
    format!("{} ({what})", text(&miss["case"]))
}
