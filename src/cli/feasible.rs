//! `lsq --feasible`: links that can exist, and by how much the fit suffers, as it is told.

use serde_json::{Value, json};

use crate::identify::{ConsistentLinks, LoggedRobot};
use crate::inertia::feasible::PRIOR_WEIGHT;
use crate::number;
use crate::report::table::{Align, Table, hanging, unbroken};

/// The field `feasible` of the document.
pub fn json(of: &ConsistentLinks, machine: &LoggedRobot) -> Value {
    let links: Vec<Value> = of
        .bodies()
        .zip(&of.found.given)
        .map(|((name, body, least), given)| {
            json!({
                "name": name,
                "mass": body.mass,
                "centre": body.centre,
                "inertia": body.inertia,
                "smallest_eigenvalue": least,
                "prior": if *given { "robot-file" } else { "plain-body" },
            })
        })
        .collect();
    let drives: Vec<Value> = of
        .drives(machine)
        .map(|(joint, inertia)| json!({ "joint": joint, "inertia": inertia }))
        .collect();
    let per_joint = |errors: &[f64]| -> Vec<Value> {
        let all = errors.iter().enumerate();
        all.map(
            |(j, e)| json!({ "joint": ConsistentLinks::joint(machine, j), "relative_error": e }),
        )
        .collect()
    };
    json!({
        "links": links,
        "drives": drives,
        "relative_error_before": per_joint(&of.before),
        "relative_error_after": per_joint(&of.after),
        "prior_weight": PRIOR_WEIGHT,
        "iterations": of.found.iterations,
        "status": of.found.ending,
    })
}

/// The same for a person.
pub fn text(of: &ConsistentLinks, machine: &LoggedRobot) -> String {
    let rows: Vec<Vec<String>> = of
        .bodies()
        .map(|(name, body, _)| {
            let mut row = vec![name.clone(), number::significant(body.mass, 4)];
            row.extend(body.centre.map(|x| number::significant(x, 3)));
            let [xx, _, _, yy, _, zz] = body.inertia;
            row.extend([xx, yy, zz].map(|x| number::significant(x, 3)));
            row
        })
        .collect();
    let numbers = ["mass", "x", "y", "z", "Ixx", "Iyy", "Izz"].map(|name| (name, Align::Decimal));
    let mut columns = vec![("link", Align::Left)];
    columns.extend(numbers);
    let mut table = Table::new(&columns)
        .caption("links that can exist: kg, centre of gravity in m, moments about it in kg m^2");
    for row in rows {
        table.row(row);
    }
    let mut out = table.to_string();
    let drives: Vec<String> = of
        .drives(machine)
        .map(|(joint, inertia)| format!("{joint} {}", number::significant(inertia, 3)))
        .collect();
    if !drives.is_empty() {
        out += &format!("drive inertias: {}\n", drives.join(", "));
    }
    let change: Vec<String> = of
        .before
        .iter()
        .zip(&of.after)
        .enumerate()
        .map(|(j, (before, after))| {
            unbroken(&format!(
                "{} {} to {}",
                ConsistentLinks::joint(machine, j),
                number::percent(*before),
                number::percent(*after)
            ))
        })
        .collect();
    let told = format!("the fit suffers: {}", change.join(", "));
    out += &hanging("", &told, 2);
    out
}
