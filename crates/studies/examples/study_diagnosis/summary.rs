//! What the rows of the study say: single effects by kind and size, rates over all of them, two at once,
//! withheld ones.

use std::collections::BTreeMap;
use std::path::Path;

use cft_ident::effect::{Family, Role, entry};
use serde_json::{Value, json};

use crate::catalogue::{PLANTED, SIZES};
use crate::study::{interval, percent, quantile};

/// Power over the noise's below which nothing is looked for: the declared parameters stand in for it.
const SHOWS: f64 = 0.25;
/// Most findings that a line of a table tells apart.
const TOLD: usize = 4;
/// Most alternatives among which the truth counts as named.
const ALTERNATIVES: usize = 3;

/// Writes the summaries into a folder.
pub fn write(rows: &[Value], folder: &Path) {
    std::fs::create_dir_all(folder).expect("the folder can be made");
    let tables = [
        (
            "study_diagnosis",
            "effects put into simulated campaigns, and what the diagnosis said",
            by_kind(rows),
        ),
        (
            "study_diagnosis_rates",
            "how often the diagnosis is right",
            rates(rows),
        ),
        (
            "study_diagnosis_numbers",
            "numbers found against the truth, in their standard deviations",
            numbers(rows),
        ),
        (
            "study_diagnosis_pairs",
            "two effects at once, each of size 4",
            pairs(rows),
        ),
        (
            "study_diagnosis_withheld",
            "effects of size 6 that the catalogue was without",
            withheld(rows),
        ),
    ];
    for (name, title, lines) in tables {
        if lines.is_empty() {
            continue;
        }
        let document = json!({
            "study": format!("{title}, {} campaigns", rows.len()),
            "command": "cargo run --release --example study_diagnosis",
            "rows": lines,
        });
        let path = folder.join(format!("{name}.json"));
        std::fs::write(&path, format!("{document:#}\n")).expect("the summary is written");
        println!("{document:#}");
    }
}

fn text(v: &Value) -> &str {
    v.as_str().unwrap_or("")
}

fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

/// Names of all that was found, cut-out episodes among them.
fn said(row: &Value) -> Vec<&str> {
    let mut names: Vec<&str> = list(&row["steps"])
        .iter()
        .map(|s| text(&s["effect"]))
        .collect();
    if !list(&row["cut"]).is_empty() {
        names.push("disturbance");
    }
    names
}

/// Whether one of two or one step is that effect, itself or among its alternatives.
fn names(step: &Value, effect: &str) -> bool {
    let alike = list(&step["alternatives"]);
    text(&step["effect"]) == effect || alike.iter().take(ALTERNATIVES).any(|a| a == effect)
}

/// Right family, and right member, with nothing else found.
fn right(row: &Value) -> [bool; 2] {
    let put = &row["put"][0];
    let steps = list(&row["steps"]);
    let effect = text(&put["effect"]);
    let is_fault = entry(effect).is_some_and(|entry| entry.role == Role::Fault);
    match (is_fault, steps, list(&row["cut"])) {
        (true, [], [_, ..]) => [true, true],
        (true, ..) | (_, _, [_, ..]) => [false, false],
        (_, [step], _) => {
            let member = names(step, effect);
            let found = families(text(&step["effect"]));
            let family = families(effect).iter().any(|f| found.contains(f));
            [member || family, member]
        }
        _ => [false, false],
    }
}

/// Whether something of the effect is left once the declared parameters are fitted to it.
fn shows(row: &Value) -> bool {
    row["shown"].as_f64().is_none_or(|s| s >= SHOWS)
}

fn of<'a>(rows: &'a [Value], study: &str) -> Vec<&'a Value> {
    rows.iter().filter(|r| r["study"] == study).collect()
}

fn median(rows: &[&Value], key: &str) -> String {
    let x: Vec<f64> = rows.iter().filter_map(|r| r[key].as_f64()).collect();
    match x.is_empty() {
        true => "-".to_owned(),
        false => percent(quantile(x, 0.5)),
    }
}

/// What was said, the most frequent first.
fn tally(rows: &[&Value]) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for r in rows {
        let names = said(r);
        let name = match names.is_empty() {
            true => "nothing".to_owned(),
            false => names.join(" + "),
        };
        *counts.entry(name).or_default() += 1;
    }
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    let shown = if counts.len() > TOLD { TOLD - 1 } else { TOLD };
    let rest: usize = counts.iter().skip(shown).map(|(_, n)| n).sum();
    let first = counts.iter().take(shown);
    let mut told: Vec<String> = first.map(|(s, n)| format!("{s} ({n})")).collect();
    if rest > 0 {
        told.push(format!("others ({rest})"));
    }
    told.join(", ")
}

fn by_kind(rows: &[Value]) -> Vec<Value> {
    let single = of(rows, "one");
    let mut lines = Vec::new();
    for kind in PLANTED {
        for size in SIZES {
            let own: Vec<&Value> = single
                .iter()
                .copied()
                .filter(|r| r["put"][0]["effect"] == kind.name && r["put"][0]["size"] == size)
                .collect();
            if own.is_empty() {
                continue;
            }
            let count = |which: usize| own.iter().filter(|r| right(r)[which]).count();
            lines.push(json!({
                "effect put in": kind.name,
                "size": format!("{size}"),
                "campaigns": own.len(),
                "of them absorbed": own.iter().filter(|r| !shows(r)).count(),
                "right family, nothing else": count(0),
                "right member or among the alternatives": count(1),
                "unseen error before": median(&own, "before"),
                "after": median(&own, "after"),
                "effect known": median(&own, "oracle"),
                "said": tally(&own),
            }));
        }
    }
    lines
}

/// Hits of so many, with their interval.
fn rate(what: &str, asked: &str, hits: usize, total: usize) -> Value {
    let share = match total {
        0 => "-".to_owned(),
        _ => format!("{:.1} %", 100.0 * hits as f64 / total as f64),
    };
    json!({
        "what": what,
        "campaigns": total,
        "hits": hits,
        "share": share,
        "95 % interval": interval(hits, total),
        "asked": asked,
    })
}

fn rates(rows: &[Value]) -> Vec<Value> {
    let clean = of(rows, "clean");
    let single = of(rows, "one");
    let large: Vec<&Value> = single
        .iter()
        .copied()
        .filter(|r| r["put"][0]["size"].as_f64().is_some_and(|s| s >= 2.0))
        .collect();
    let shown: Vec<&Value> = large.iter().copied().filter(|r| shows(r)).collect();
    let count = |rows: &[&Value], which: usize| rows.iter().filter(|r| right(r)[which]).count();
    let named = |r: &&Value| right(r)[1] && !list(&r["steps"]).is_empty();
    let certain: Vec<&Value> = shown.iter().copied().filter(named).collect();
    let certainly = |r: &Value| list(&r["steps"]).iter().all(|s| s["assured"] == true);
    let two = of(rows, "two");
    let out = of(rows, "withheld");
    let alternatives: Vec<f64> = shown
        .iter()
        .flat_map(|r| list(&r["steps"]))
        .map(|s| list(&s["alternatives"]).len() as f64)
        .collect();
    let ratios: Vec<f64> = shown
        .iter()
        .filter_map(|r| Some(r["after"].as_f64()? / r["oracle"].as_f64()?))
        .collect();
    let off: Vec<f64> = single
        .iter()
        .flat_map(|r| list(&r["steps"]))
        .filter_map(|s| s["off"].as_object())
        .flat_map(|o| o.values().filter_map(Value::as_f64))
        .collect();
    let within = |stds: f64| off.iter().filter(|z| z.abs() <= stds).count();
    let number = |what: &str, asked: &str, x: f64, of: usize| {
        json!({
            "what": what, "campaigns": of, "hits": "-", "share": format!("{x:.2}"),
            "95 % interval": "-", "asked": asked,
        })
    };
    let middle = |x: &[f64]| match x.is_empty() {
        true => f64::NAN,
        false => quantile(x.to_vec(), 0.5),
    };
    let mean = alternatives.iter().sum::<f64>() / alternatives.len().max(1) as f64;
    vec![
        rate(
            "a false effect on clean data",
            "at most 1 %",
            clean.iter().filter(|r| !said(r).is_empty()).count(),
            clean.len(),
        ),
        rate(
            "right family, sizes 2 and 6",
            "95 %",
            count(&large, 0),
            large.len(),
        ),
        rate(
            "right family, of those that show",
            "-",
            count(&shown, 0),
            shown.len(),
        ),
        rate(
            "right member, sizes 2 and 6",
            "90 %",
            count(&large, 1),
            large.len(),
        ),
        rate(
            "right member, of those that show",
            "-",
            count(&shown, 1),
            shown.len(),
        ),
        rate(
            "of these with an effect added, assured",
            "-",
            certain.iter().filter(|r| certainly(r)).count(),
            certain.len(),
        ),
        rate(
            "both of two at once",
            "80 %",
            two.iter().filter(|r| both(r)).count(),
            two.len(),
        ),
        rate(
            "withheld: unexplained or its family",
            "90 %",
            out.iter().filter(|r| honest(r)).count(),
            out.len(),
        ),
        rate(
            "withheld: verdict of unexplained, or of its family alone",
            "-",
            out.iter().filter(|r| unclaimed(r)).count(),
            out.len(),
        ),
        rate(
            "withheld, and nothing of another family added",
            "-",
            out.iter().filter(|r| unnamed(r)).count(),
            out.len(),
        ),
        rate(
            "numbers within 2 standard deviations",
            "95 %",
            within(2.0),
            off.len(),
        ),
        rate(
            "numbers within 3 standard deviations",
            "-",
            within(3.0),
            off.len(),
        ),
        number("mean number of alternatives", "-", mean, alternatives.len()),
        number(
            "median error after, over that with the effect known",
            "at most 1.1",
            middle(&ratios),
            ratios.len(),
        ),
    ]
}

/// How far each number of each effect is from the truth, and how well it is known.
fn numbers(rows: &[Value]) -> Vec<Value> {
    let single = of(rows, "one");
    let mut lines = Vec::new();
    for kind in PLANTED {
        let mut by_key: BTreeMap<&str, (Vec<f64>, Vec<f64>)> = BTreeMap::new();
        let own = single.iter().filter(|r| r["put"][0]["effect"] == kind.name);
        let steps = own.flat_map(|r| {
            list(&r["steps"])
                .iter()
                .map(|s| (&r["put"][0]["values"], s))
        });
        for (truth, step) in steps.filter(|(_, s)| s["effect"] == kind.name) {
            let truth = |key: &str| {
                let mut pairs = list(truth).iter();
                pairs.find(|p| p[0] == key).and_then(|p| p[1].as_f64())
            };
            for (key, off) in step["off"].as_object().into_iter().flatten() {
                let (all, parts) = by_key.entry(key).or_default();
                all.extend(off.as_f64());
                let std = step["std"][key].as_f64();
                let truth = truth(key).filter(|x| *x != 0.0);
                parts.extend(std.zip(truth).map(|(std, truth)| (std / truth).abs()));
            }
        }
        for (key, (off, parts)) in by_key.into_iter().filter(|(_, (off, _))| !off.is_empty()) {
            let within = |stds: f64| off.iter().filter(|z| z.abs() <= stds).count();
            let n = off.len() as f64;
            let largest = off
                .iter()
                .copied()
                .max_by(|a, b| a.abs().total_cmp(&b.abs()));
            lines.push(json!({
                "effect": kind.name,
                "number": key,
                "campaigns": off.len(),
                "within 2": within(2.0),
                "within 3": within(3.0),
                "mean": format!("{:+.2}", off.iter().sum::<f64>() / n),
                "rms": format!("{:.2}", (off.iter().map(|z| z * z).sum::<f64>() / n).sqrt()),
                "farthest": largest.map(|z| format!("{z:+.1}")),
                "median deviation over the truth": match parts.is_empty() {
                    true => "-".to_owned(),
                    false => percent(quantile(parts, 0.5)),
                },
            }));
        }
    }
    lines
}

/// Whether both effects that were put in are among what was found.
fn both(row: &Value) -> bool {
    let found = |put: &Value| {
        list(&row["steps"])
            .iter()
            .any(|s| names(s, text(&put["effect"])))
    };
    list(&row["put"]).iter().all(found)
}

/// Families of an effect; some belong to two.
fn families(effect: &str) -> &'static [Family] {
    entry(effect).map_or(&[], |entry| entry.families)
}

/// Whether a step is of the family of what was put in.
fn related(row: &Value, step: &Value) -> bool {
    let own = families(text(&row["put"][0]["effect"]));
    let found = families(text(&step["effect"]));
    own.iter().any(|f| found.contains(f))
}

/// Whether all that was named is of a withheld effect's family; where nothing was, whether nothing of it
/// shows.
fn only_family(row: &Value) -> bool {
    match list(&row["steps"]) {
        [] => !shows(row),
        some => some.iter().all(|step| related(row, step)),
    }
}

/// Whether a step of another family than the withheld effect's is marked so.
fn stranger(row: &Value, mark: &str) -> bool {
    let mut steps = list(&row["steps"]).iter();
    steps.any(|s| s[mark] == true && !related(row, s))
}

/// Whether a withheld effect ends as an unexplained residual, told from noise by its size or by a test, with
/// nothing of another family assured, or as its own family.
fn honest(row: &Value) -> bool {
    let told = row["structured"] == true || !list(&row["remainder"]).is_empty();
    only_family(row) || told && !stranger(row, "assured")
}

/// Whether nothing of another family is behind a verdict of effects found.
fn unclaimed(row: &Value) -> bool {
    only_family(row) || row["structured"] == true && !stranger(row, "explained")
}

/// Whether a withheld effect has no name but its family's: a residual without a name, or that.
fn unnamed(row: &Value) -> bool {
    only_family(row) || list(&row["steps"]).is_empty() && row["structured"] == true
}

fn pairs(rows: &[Value]) -> Vec<Value> {
    let mut by_pair: BTreeMap<String, Vec<&Value>> = BTreeMap::new();
    for r in of(rows, "two") {
        let put = list(&r["put"]).iter();
        let put = put.map(|p| format!("{} of {}", text(&p["effect"]), text(&p["place"])));
        by_pair
            .entry(put.collect::<Vec<_>>().join(" and "))
            .or_default()
            .push(r);
    }
    by_pair
        .into_iter()
        .map(|(pair, own)| {
            json!({
                "put in": pair,
                "campaigns": own.len(),
                "both found": own.iter().filter(|r| both(r)).count(),
                "unseen error before": median(&own, "before"),
                "after": median(&own, "after"),
                "effects known": median(&own, "oracle"),
                "said": tally(&own),
            })
        })
        .collect()
}

fn withheld(rows: &[Value]) -> Vec<Value> {
    let all = of(rows, "withheld");
    let own = |kind: &str| -> Vec<&Value> {
        let with = all.iter().copied();
        with.filter(|r| r["put"][0]["effect"] == kind).collect()
    };
    PLANTED
        .iter()
        .map(|kind| (kind, own(kind.name)))
        .filter(|(_, own)| !own.is_empty())
        .map(|(kind, own)| {
            json!({
                "withheld": kind.name,
                "campaigns": own.len(),
                "unexplained, absorbed or its family": own.iter().filter(|r| honest(r)).count(),
                "verdict of unexplained, or of its family": own.iter().filter(|r| unclaimed(r)).count(),
                "said": tally(&own),
            })
        })
        .collect()
}
