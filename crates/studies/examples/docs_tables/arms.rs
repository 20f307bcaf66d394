//! Tables of robots of several joints: errors with a column per joint, and what joints have each.

use serde_json::Value;

use super::tables::{Rendered, json, number, rows, table, text};
use cft_ident::number::{percent, value_and_std};

/// Errors of validations, a column per joint; `NAME:WORDS_WITH_UNDERSCORES` gives a line its name,
/// and a name that is no validation's holds published errors in per cent.
pub fn errors(names: &[&str]) -> Rendered {
    let mut columns: Vec<String> = Vec::new();
    let mut lines = Vec::new();
    for name in names {
        let (name, title) = name.split_once(':').unwrap_or((name, name));
        let result = json(name)?;
        let joints = rows(&result["joints"]);
        if columns.is_empty() {
            columns.push("<model and log".to_owned());
            columns.extend(joints.iter().map(|j| text(&j["joint"]).to_owned()));
            columns.extend([
                "all".to_owned(),
                "rms of these".to_owned(),
                "rows".to_owned(),
            ]);
        }
        let mut line = vec![title.replace('_', " ")];
        let error = |value: &Value| value.as_f64().map_or("-".to_owned(), percent);
        line.extend(joints.iter().map(|j| error(&j["relative_error"])));
        line.push(error(&result["overall"]["relative_error"]));
        line.push(error(&result["overall"]["mean_relative_error"]));
        let samples = joints.first().and_then(|j| j["samples"].as_u64());
        line.push(samples.map_or("-".to_owned(), |n| n.to_string()));
        lines.push(line);
    }
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    Ok(table(&columns, &lines))
}

/// What `lsq` found of each joint's friction and offset, beside published values where there are any.
pub fn friction(names: &[&str]) -> Rendered {
    let [fit, published @ ..] = names else {
        return Err("`joints` needs a fit".to_owned());
    };
    let (fit, published) = (json(fit)?, published.first().map(|p| json(p)).transpose()?);
    let kinds = ["viscous", "coulomb", "offset"];
    let mut columns = vec!["<joint"];
    for kind in kinds {
        columns.push(kind);
        if published.is_some() {
            columns.push("published");
        }
    }
    let joints = rows(&fit["joints"]);
    let mut lines = Vec::new();
    for (i, joint) in joints.iter().enumerate() {
        let mut line = vec![text(&joint["joint"]).to_owned()];
        for kind in kinds {
            let of = |p: &&Value| p["joint"] == joint["joint"] && p["name"] == kind;
            let found = rows(&fit["parameters"]).iter().find(of);
            line.push(match found.filter(|p| p["value"].is_f64()) {
                Some(p) => {
                    let (value, std) = value_and_std(number(&p["value"]), number(&p["std"]));
                    format!("{value} \u{b1} {std} {}", text(&p["unit"]))
                }
                None => "not determined".to_owned(),
            });
            if let Some(published) = &published {
                let theirs = published[kind][i].as_f64();
                line.push(theirs.map_or("-".to_owned(), |x| x.to_string()));
            }
        }
        lines.push(line);
    }
    Ok(table(&columns, &lines))
}

/// Parameters of a fit whose name begins with a word, beside published values.
pub fn named(names: &[&str]) -> Rendered {
    let [fit, published] = names else {
        return Err("`named` needs a fit and published values".to_owned());
    };
    let (fit, published) = (json(fit)?, json(published)?);
    let mut lines = Vec::new();
    for (name, theirs) in published["parameters"].as_object().into_iter().flatten() {
        let found = rows(&fit["parameters"]).iter().find(|p| p["name"] == *name);
        let found = found.ok_or_else(|| format!("no parameter `{name}`"))?;
        let (value, std) = value_and_std(number(&found["value"]), number(&found["std"]));
        lines.push(vec![
            name.clone(),
            value,
            std,
            number(theirs).to_string(),
            text(&found["unit"]).to_owned(),
        ]);
    }
    Ok(table(
        &["<parameter", "fitted", "std", "published", "<unit"],
        &lines,
    ))
}
