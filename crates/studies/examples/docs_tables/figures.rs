//! Figures that are drawn from docs/results.

use std::path::Path;

use cft_ident::report::figure::{RateFigure, RatePanel};
use serde_json::Value;

/// Name and SVG of each.
pub fn all(root: &Path) -> Vec<(&'static str, String)> {
    let found = result(root, "study_track.json").map(|of| track(&of));
    Vec::from_iter(found.map(|figure| ("track_found.svg", figure.svg())))
}

fn result(root: &Path, name: &str) -> Option<Value> {
    let text = std::fs::read_to_string(root.join("docs/results").join(name)).ok()?;
    serde_json::from_str(&text).ok()
}

/// How soon changes of friction are found.
fn track(of: &Value) -> RateFigure {
    let (mut names, mut panels) = (Vec::<String>::new(), Vec::<RatePanel>::new());
    for row in of["curves"].as_array().into_iter().flatten() {
        let text = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
        let (panel, line) = (text("panel"), text("line"));
        if !names.contains(&line) {
            names.push(line);
        }
        let shares = row["found"].as_array().into_iter().flatten();
        let shares = shares.filter_map(Value::as_f64).collect();
        match panels.iter_mut().find(|p| p.name == panel) {
            Some(own) => own.lines.push(shares),
            None => panels.push(RatePanel {
                name: panel,
                lines: vec![shares],
            }),
        }
    }
    RateFigure {
        title: "Changes of one joint's friction that are found".to_owned(),
        names,
        panels,
    }
}
