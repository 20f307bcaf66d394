//! Formulas that `diagnose --search` finds in measured logs.

use cft_ident::number::{percent, significant};
use serde_json::Value;

use super::tables::{Rendered, json, number, rows, table, text};

/// A row for each formula of some results.
pub fn found(names: &[&str]) -> Rendered {
    let mut all = Vec::new();
    for name in names {
        let result = json(name)?;
        let machine = name.split('_').next().unwrap_or(name).to_uppercase();
        let formulas = rows(&result["formulas"]);
        if formulas.is_empty() {
            let none = ["-", "no formula", "-", "-", "-", "-", "-"].map(str::to_owned);
            all.push([vec![machine.clone()], none.to_vec()].concat());
        }
        all.extend(formulas.iter().map(|f| row(&machine, f)));
    }
    let heads = [
        "<machine",
        "<joint",
        "<formula",
        "<kind",
        "of what is left",
        "<unseen error without, with",
        "<rms at reversals without, with",
        "<end",
    ];
    Ok(table(&heads, &all))
}

fn row(machine: &str, of: &Value) -> Vec<String> {
    let own = rows(&of["joints"])
        .iter()
        .find(|j| j["joint"] == of["joint"]);
    let errors = own.map_or("-".to_owned(), |j| {
        let shown = |key: &str| significant(100.0 * number(&j[key]), 3);
        format!("{}, {} %", shown("before"), shown("after"))
    });
    let at_reversals = match rows(&of["at_reversals"]) {
        [without, with] => [without, with]
            .map(|x| significant(number(x), 3))
            .join(", "),
        _ => "-".to_owned(),
    };
    vec![
        machine.to_owned(),
        text(&of["joint"]).to_owned(),
        format!("`{}`", text(&of["text"])),
        text(&of["kind"]).to_owned(),
        percent(number(&of["share"])),
        errors,
        at_reversals,
        text(&of["end"]).to_owned(),
    ]
}
