//! The report of `lsq --static`.

use crate::report::Report;
use crate::report::table::{CellAlignment, Table};
use crate::report::words::torques_off;
use cft_ident_core::number;
use cft_ident_core::verdict::Verdict;
use cft_ident_logs::log::escape;
use cft_ident_tool::held::{GravityFit, GravityNumber, HoldCheck, TouchedPose};

/// Gravity's parameters, joints at rest, and poses to check them with.
pub fn held(of: &GravityFit, path: &str, logs: &str) -> Report {
    let mut report = Report::new("Gravity from held poses");
    let mut all = report.everywhere();
    all.verdict(&verdict(of), is_determined(of));
    all.list(sentences(of));
    all.line("");
    all.table(parameters(of));
    all.table_apart(joints(of));
    all.line("");
    all.line("hold these poses and compare:");
    all.list(of.checks.iter().map(in_words));
    all.line(&format!(
        "fitted to {logs}; next: gravity(q) for the controller"
    ));
    all.code(&format!("cft-ident export -m {path} --c gravity.h"));
    all.code(&format!("cft-ident export -m {path} --python gravity.py"));
    report
}

/// Whether the poses determine any of gravity's parameters.
fn is_determined(of: &GravityFit) -> bool {
    let mut all = of.parameters.iter();
    all.any(|p| p.verdict != Verdict::NotIdentifiable)
}

fn verdict(of: &GravityFit) -> String {
    let (torque, left) = of.joints.iter().fold((0.0, 0.0), |(torque, left), joint| {
        (
            torque + joint.torque.powi(2),
            left + joint.left_held_out.powi(2),
        )
    });
    let share = number::percent((left / f64::max(torque, f64::MIN_POSITIVE)).sqrt());
    let text = format!(
        "Gravity from {} held poses: {} parameters, {share} of the torques left on poses that were not fitted.",
        of.poses,
        of.parameters.len()
    );
    match is_determined(of) {
        true => text,
        false => format!(
            "{text} None of the parameters is determined: friction at rest is as large as gravity in these poses; hold more of them, in which links stand out level, each from both sides."
        ),
    }
}

fn sentences(of: &GravityFit) -> Vec<String> {
    let mut out = Vec::new();
    if of.rows_are_poses {
        out.push("each row of the log is a pose".to_owned());
    }
    out.extend(
        of.touched
            .iter()
            .map(|pose| touched_in_words(pose, of.rows_are_poses)),
    );
    let one_sided = of
        .joints
        .iter()
        .filter(|joint| joint.stiction.value.is_none());
    let names: Vec<String> = one_sided.map(|joint| escape(&joint.joint)).collect();
    if !names.is_empty() {
        out.push(format!(
            "{} came to rest from one side alone: friction at rest is not determined there, and may be in the gravity; reach each pose from both sides",
            names.join(", ")
        ));
    }
    out
}

/// A pose that is set aside: when, and how much its torques are off.
fn touched_in_words(pose: &TouchedPose, rows_are_poses: bool) -> String {
    let when = match rows_are_poses {
        true => String::new(),
        false => format!(", at {} s,", number::significant(pose.t, 4)),
    };
    format!(
        "pose {}{when} is off: {}; a touch? It is left out",
        pose.pose,
        torques_off(&pose.off)
    )
}

/// A number with its interval, as many digits as that deserves.
fn shown(number: &GravityNumber) -> String {
    match (number.value, number.interval_95) {
        (Some(value), Some([low, high])) => {
            let half = (high - low) / 2.0;
            let [value, low, high] = [value, low, high].map(|x| number::value_and_std(x, half).0);
            format!("{value} ({low} .. {high})")
        }
        _ => number::ABSENT.to_owned(),
    }
}

fn parameters(of: &GravityFit) -> Table {
    let mut columns = vec![
        ("parameter", CellAlignment::Left),
        ("value (95 %)", CellAlignment::Left),
        ("unit", CellAlignment::Left),
        ("", CellAlignment::Left),
        ("meaning", CellAlignment::Left),
    ];
    if !of.touched.is_empty() {
        columns.push(("with the touched poses", CellAlignment::Left));
    }
    let mut table = Table::new(&columns).caption(&format!(
        "gravity, with intervals by {} blocks of neighbouring poses",
        of.blocks
    ));
    for p in &of.parameters {
        let with_touched = of.with_touched.iter().find(|all| all.name == p.name);
        let with_touched = with_touched.map_or(String::new(), shown);
        let cells = [
            p.name.as_str(),
            &shown(p),
            &p.unit,
            p.verdict.word(),
            &p.meaning,
            &with_touched,
        ];
        table.row(cells.into_iter().take(columns.len()));
    }
    table
}

fn joints(of: &GravityFit) -> Table {
    let gains = of.joints.iter().any(|joint| joint.gain.is_some());
    let mut columns = vec![
        ("joint", CellAlignment::Left),
        ("friction at rest", CellAlignment::Left),
        ("offset", CellAlignment::Left),
        ("torque", CellAlignment::Decimal),
        ("left", CellAlignment::Decimal),
        ("unit", CellAlignment::Left),
    ];
    if gains {
        columns.push(("gain", CellAlignment::Left));
    }
    let mut table = Table::new(&columns);
    for joint in &of.joints {
        let offset = joint.offset.as_ref().map_or(String::new(), shown);
        let gain = joint.gain.as_ref().map_or("1".to_owned(), shown);
        let [torque, left] = [joint.torque, joint.left_held_out].map(|x| number::significant(x, 3));
        let cells = [
            &joint.joint,
            &shown(&joint.stiction),
            &offset,
            &torque,
            &left,
            &joint.unit,
            &gain,
        ];
        table.row(cells.into_iter().take(columns.len()));
    }
    table
}

fn in_words(check: &HoldCheck) -> String {
    let joints = check.joints.iter().map(|joint| {
        let (expected, within) = number::value_and_std(joint.expected, joint.within);
        format!(
            "{} at {}: {expected} ± {within} {}",
            escape(&joint.joint),
            number::significant(joint.position, 3),
            joint.unit
        )
    });
    format!(
        "pose {}: {}",
        check.pose,
        joints.collect::<Vec<_>>().join("; ")
    )
}
