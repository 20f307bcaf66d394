//! What `lsq` says of a fit: its document's fields, and the tables for a person.

use serde_json::{Value, json};

use super::{estimate, feasible};
use crate::identify::{IdentifiedDynamics, LoggedRobot, Unknown};
use crate::motion::Summary;
use crate::number;
use crate::report::summary;
use crate::report::table::{hanging, unbroken};
use crate::verdict::{IDENTIFIED, Verdict, WEAK};

/// The JSON fields of the command.
pub fn json(machine: &LoggedRobot, found: &IdentifiedDynamics) -> Value {
    let fit = &found.fit;
    let parameters: Vec<Value> = found
        .unknowns
        .iter()
        .zip(&found.essential.essential)
        .map(|(u, essential)| {
            let known = u.verdict != Verdict::NotIdentifiable;
            json!({
                "name": u.grouping.as_ref().unwrap_or(&u.name),
                "key": u.name,
                "theta": u.theta,
                "joint": u.joint,
                "value": known.then_some(u.value),
                "std": known.then_some(u.std),
                "relative_std": known.then(|| u.relative_std()),
                "unit": u.unit,
                "verdict": u.verdict,
                "negligible": u.negligible,
                "essential": essential,
            })
        })
        .collect();
    let joints: Vec<Value> = (0..machine.robot.joints())
        .map(|j| {
            json!({
                "joint": machine.robot.joint_names()[j],
                "unit": machine.file.torque_unit(j),
                "rmse": fit.residual_std[j],
                "relative_error": fit.relative_error[j],
            })
        })
        .collect();
    let essential: Vec<Value> = found
        .essential_error
        .iter()
        .zip(machine.robot.joint_names())
        .map(|(error, joint)| json!({ "joint": joint, "relative_error": error }))
        .collect();
    json!({
        "parameters": parameters,
        "essential": { "count": essential_count(found), "joints": essential },
        "feasible": found.physical.as_ref().map(|p| feasible::json(p, machine)),
        "condition": fit.condition,
        "rank": fit.rank,
        "samples": fit.rows * machine.robot.joints() as u64,
        "effective_samples": fit.effective_rows * machine.robot.joints() as f64,
        "joints": joints,
        "estimator": estimate::json(&found.account, machine),
        "processing": processing(&found.summary),
    })
}

/// What was done to the logs before the fit.
pub fn processing(summary: &Summary) -> Value {
    json!({
        "cutoff_hz": summary.cutoff_hz,
        "decimation": summary.decimation,
        "position_cutoff_hz": summary.q_cutoff_hz,
    })
}

/// The tables for a person.
pub fn text(machine: &LoggedRobot, found: &IdentifiedDynamics) -> String {
    let rows: Vec<summary::Parameter> = found
        .unknowns
        .iter()
        .map(|u| {
            let known = u.verdict != Verdict::NotIdentifiable;
            summary::Parameter {
                joint: u.joint.as_deref().unwrap_or(""),
                name: &u.name,
                theta: None,
                value: if known { u.value } else { f64::NAN },
                std: if known { u.std } else { f64::NAN },
                unit: &u.unit,
                verdict: if u.negligible && u.relative_std() > IDENTIFIED {
                    "negligible"
                } else {
                    u.verdict.word()
                },
                truth: None,
            }
        })
        .collect();
    let mut out = format!(
        "{}{}\n{}",
        summary::parameters("parameters", &rows),
        groupings(found),
        quality(machine, found)
    );
    if let Some(physical) = &found.physical {
        out += &feasible::text(physical, machine);
    }
    out
}

/// What the short names of base parameters stand for; nothing where they are names already.
fn groupings(found: &IdentifiedDynamics) -> String {
    let grouped = found.unknowns.iter().filter_map(|u| {
        let grouping = u.grouping.as_ref()?;
        (*grouping != u.name).then(|| hanging("  ", grouping, 4))
    });
    let lines: Vec<String> = grouped.collect();
    match lines.is_empty() {
        true => String::new(),
        false => format!(
            "\nparameters that stand for combinations\n{}",
            lines.concat()
        ),
    }
}

/// Number of essential unknowns.
fn essential_count(found: &IdentifiedDynamics) -> usize {
    found.essential.essential.iter().filter(|e| **e).count()
}

/// What rank and verdicts say together, where a parameter is called not identifiable: that no torque
/// tells of it, or that what tells of it drowns in the noise.
fn open_directions(found: &IdentifiedDynamics) -> String {
    let unknowns = &found.unknowns;
    let named = |u: &&Unknown| u.verdict == Verdict::NotIdentifiable;
    let all = unknowns.iter().filter(named).count();
    let missing = unknowns.len().saturating_sub(found.fit.rank);
    if all == 0 {
        return String::new();
    }
    let noise = format!(
        "a standard deviation above {:.0} % of the value",
        100.0 * WEAK
    );
    let why = match missing {
        0 => format!(
            "the torques tell of every combination; {all} not-identifiable are so for their noise, with {noise}"
        ),
        _ => format!(
            "the torques tell nothing of {missing} combinations; the {all} not-identifiable are in these, or have \
             {noise}"
        ),
    };
    hanging("", &why, 2)
}

/// Condition, rank, independent rows and residual of the fit, and what is essential.
pub fn quality(machine: &LoggedRobot, found: &IdentifiedDynamics) -> String {
    let fit = &found.fit;
    let condition = |c: Option<f64>| c.map_or("infinite".to_owned(), |c| number::significant(c, 4));
    let told = format!(
        "condition {} raw, {} normalised; rank {} of {}; {} rows a joint, worth {:.0} independent ones",
        condition(fit.condition.raw),
        condition(fit.condition.normalised),
        fit.rank,
        found.unknowns.len(),
        fit.rows,
        fit.effective_rows,
    );
    let mut out = hanging("", &told, 2);
    out += &open_directions(found);
    let errors: Vec<String> = (0..machine.robot.joints())
        .map(|j| {
            unbroken(&format!(
                "{} {} ({} {})",
                machine.robot.joint_names()[j],
                number::percent(fit.relative_error[j]),
                number::significant(fit.residual_std[j], 3),
                machine.file.torque_unit(j)
            ))
        })
        .collect();
    let told = format!("residual of the fit: {}", errors.join(", "));
    out += &hanging("", &told, 2);
    out += &estimate::text(&found.account, machine);
    let alone: Vec<String> = machine
        .robot
        .joint_names()
        .iter()
        .zip(&found.essential_error)
        .map(|(joint, error)| unbroken(&format!("{joint} {}", number::percent(*error))))
        .collect();
    let told = format!(
        "{} of {} parameters are essential; residual with them alone: {}",
        essential_count(found),
        found.unknowns.len(),
        alone.join(", ")
    );
    out += &hanging("", &told, 2);
    out
}
