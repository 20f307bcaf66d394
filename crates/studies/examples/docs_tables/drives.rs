//! What `drive` found, and how well its drives follow.

use cft_ident::number::significant;

use super::tables::{Rendered, json, number, rows, table, text};

/// Every parameter of some results with its interval.
pub fn parameters(names: &[&str]) -> Rendered {
    let mut lines = Vec::new();
    for name in names {
        for parameter in rows(&json(name)?["parameters"]) {
            let shown = |value| significant(number(value), 3);
            let interval = rows(&parameter["interval_95"]);
            let interval = match interval {
                [low, high] => format!("{} .. {}", shown(low), shown(high)),
                _ => "-".to_owned(),
            };
            lines.push(vec![
                parameter["joint"].as_str().unwrap_or("all").to_owned(),
                format!("`{}`", text(&parameter["name"])),
                shown(&parameter["value"]),
                interval,
                text(&parameter["unit"]).to_owned(),
                text(&parameter["meaning"]).to_owned(),
            ]);
        }
    }
    let columns = [
        "<drive",
        "<parameter",
        "value",
        "95 % interval",
        "<unit",
        "<it is",
    ];
    Ok(table(&columns, &lines))
}

/// Mean errors of rolled-out positions by the plain law, and with the effects that were found.
pub fn errors(names: &[&str]) -> Rendered {
    let mut lines = Vec::new();
    for name in names {
        let result = json(name)?;
        let joints = rows(&result["drive"]["joints"]);
        let joints: Vec<&str> = joints.iter().map(text).collect();
        let inputs = rows(&result["inputs"]);
        let mut line = vec![joints.join(", "), inputs.len().to_string()];
        for part in ["train", "holdout", "holdout_motion_unseen"] {
            let [before, after] = ["before", "after"].map(|end| {
                let error = &result[end][part];
                let milli = significant(1000.0 * number(&error["mae"]), 3);
                format!("{milli} m{}", text(&error["unit"]))
            });
            line.push(format!("{before}, {after}"));
        }
        lines.push(line);
    }
    let columns = [
        "<drive",
        "logs",
        "fitted: before, after",
        "held out",
        "held out, motion never seen",
    ];
    Ok(table(&columns, &lines))
}
