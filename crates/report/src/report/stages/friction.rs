//! The report of `friction`.

use crate::report::figure::{FrictionFigure, FrictionPanel};
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::{fit, parameters, provenance};
use crate::report::table::Table;
use crate::report::{Report, Writer, summary};
use cft_ident_core::friction::estimate::{BEYOND, FrictionCurvePoint, curve_std};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{FrictionOfJoint, IdentifiedFriction, LoggedRobot};

/// What the report is made from.
pub struct Friction<'a> {
    pub machine: &'a LoggedRobot,
    pub found: &'a IdentifiedFriction,
    /// The model that was written.
    pub file: &'a ModelFile,
    /// Its path as a shell takes it.
    pub path: &'a str,
    /// Names of the logs.
    pub logs: &'a [String],
}

/// Joints whose laws a screen has room for.
const MAX_JOINTS_ON_SCREEN: usize = 2;

/// The verdict, how the filter went, and the laws.
pub fn friction(of: &Friction) -> Report {
    let names: Vec<String> = of.logs.iter().map(|name| escape(name)).collect();
    let mut report = Report::new(&format!("Friction from {}", names.join(", ")));
    let (text, good) = words(of);
    report.everywhere().verdict(&text, good);
    report.terminal().line("");
    filter(&mut report.everywhere(), of);
    for joint in &of.found.joints {
        let mut laws = match of.found.joints.len() <= MAX_JOINTS_ON_SCREEN {
            true => report.terminal(),
            false => report.detail(),
        };
        laws.line("");
        laws.table(law(of.machine, joint));
    }
    report.terminal().line("");
    let (tally, _) = parameters::tally(of.file);
    report.detail().paragraph(&format!("{tally}."));
    report.page().paragraph(&format!("{tally}."));
    report.terminal().note("", &next(of.path), 2);
    report
}

/// What to do next with the model at a path.
fn next(path: &str) -> String {
    format!("Next: `cft-ident lsq LOG -r ROBOT.toml -m {path} -o model.toml` fits the inertias.")
}

/// What a page has room for besides; `given` are the robot file and the model whose other joints are
/// kept.
pub fn pictures(
    page: &mut Writer,
    of: &Friction,
    given: &[Provenance],
    quality: &[Inspected],
    command: &str,
) {
    page.heading("Friction");
    page.figures(&figure(of.machine, of.found).cells());
    parameters::section(page, of.file, &|_| None);
    nuisance(page, of.machine, of.found);
    page.heading("Correlated parameters");
    fit::pairs(page, of.file);
    quality::section(page, quality, &of.found.warnings);
    let inputs: Vec<Provenance> = given.iter().chain(&of.found.inputs).cloned().collect();
    provenance::section(page, &of.machine.file, &inputs, &[], None, command);
}

/// The parameters of one joint's law.
fn law(machine: &LoggedRobot, found: &FrictionOfJoint) -> Table {
    let e = &found.estimate;
    let parameters = found.parameters.each();
    let rows: Vec<summary::ParameterRow> = parameters
        .iter()
        .map(|(name, p)| summary::ParameterRow {
            joint: &found.joint,
            name,
            theta: p.theta,
            value: p.value.unwrap_or(f64::NAN),
            std: p.std.unwrap_or(f64::NAN),
            unit: &p.unit,
            verdict: p.verdict.word(),
            truth: None,
        })
        .collect();
    let caption = format!(
        "friction of {}: speeds {} to {} {}/s, residual {} ({} {}, NIS {:.2})",
        found.joint,
        number::significant(e.speeds.covered[0], 2),
        number::significant(e.speeds.covered[1], 3),
        machine.robot.joint_kind(found.index).position_unit(),
        number::percent(e.relative_error),
        number::significant(e.rmse, 3),
        machine.file.torque_unit(found.index),
        e.nis.mean
    );
    summary::parameters(&caption, &rows)
}

/// The verdict in words, and whether nothing calls for attention.
fn words(of: &Friction) -> (String, bool) {
    let worst = of.found.joints.iter();
    let worst = worst.max_by(|a, b| {
        a.estimate
            .relative_error
            .total_cmp(&b.estimate.relative_error)
    });
    let mut text = worst.map_or_else(String::new, |worst| {
        let error = number::percent(worst.estimate.relative_error);
        match of.found.joints.len() {
            1 => format!(
                "The friction law of {} leaves {error} of its torque.",
                worst.joint
            ),
            n => format!(
                "The friction laws of {n} joints leave at most {error} of the torque, at {}.",
                worst.joint
            ),
        }
    });
    let mut good = true;
    for found in &of.found.joints {
        if !found.converged {
            good = false;
            text += &format!(" The search for {} ended without converging.", found.joint);
        }
        if !found.estimate.missed_plateaus().is_empty() {
            good = false;
            text += &format!(
                " The curve of {} misses the mean torque at constant speed (see the warnings).",
                found.joint
            );
        }
        let nis = &found.estimate.nis;
        if nis.mean > nis.upper_95 {
            good = false;
            text += &format!(
                " Something acts on {} that the friction law lacks.",
                found.joint
            );
        }
    }
    if good {
        text += " The curves can be used over the speeds covered.";
    }
    (text, good)
}

/// How the filter went, joint by joint.
fn filter(page: &mut Writer, of: &Friction) {
    let row = |found: &FrictionOfJoint| {
        let e = &found.estimate;
        let unit = of.machine.file.torque_unit(found.index);
        let speed = of.machine.robot.joint_kind(found.index).position_unit();
        let [low, high] = e.speeds.covered;
        vec![
            found.joint.clone(),
            number::percent(e.relative_error),
            format!("{} {unit}", number::significant(e.rmse, 3)),
            format!(
                "{} to {} {speed}/s",
                number::significant(low, 2),
                number::significant(high, 3)
            ),
            number::significant(e.nis.mean, 3),
            format!(
                "{} to {}",
                number::significant(e.nis.lower_95, 3),
                number::significant(e.nis.upper_95, 3)
            ),
        ]
    };
    page.rows(
        "relative error of the fit, and normalised innovations squared (NIS, 1 is ideal)",
        &[
            "joint",
            "error",
            "residual rms",
            "speeds covered",
            "NIS",
            "95 % bounds",
        ],
        of.found.joints.iter().map(row).collect(),
    );
}

/// What was estimated beside the friction.
fn nuisance(page: &mut Writer, machine: &LoggedRobot, found: &IdentifiedFriction) {
    let of_joint = |found: &FrictionOfJoint| {
        let joint = found.joint.clone();
        let torque = machine.file.torque_unit(found.index);
        let position = machine.robot.joint_kind(found.index).position_unit();
        let each = found.estimate.nuisance.iter();
        let rows = each.map(|n| {
            let (value, std) = number::value_and_std(n.value, n.std);
            let unit = match n.unit.as_str() {
                "torque" => torque.to_owned(),
                "torque/acceleration" => format!("{torque} s^2/{position}"),
                unit => unit.to_owned(),
            };
            vec![n.name.clone(), joint.clone(), value, std, unit]
        });
        rows.collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = found.joints.iter().flat_map(of_joint).collect();
    if !rows.is_empty() {
        page.heading("Other quantities estimated");
        page.paragraph(
            "Inertia, gravity and the torque from the motion of the other joints; not part of the model.",
        );
        let head = ["quantity", "joint", "value", "std", "unit"];
        page.rows("nuisance quantities", &head, rows);
    }
}

/// Velocities at which a curve is drawn, from the most negative to the most positive: in equal
/// ratios, for the law bends close to 0, and in equal steps.
fn speeds_to_draw([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    const POINTS: usize = 80;
    let slowest = (0.1 * low).max(1e-4 * high);
    let share = |k: usize| k as f64 / (POINTS - 1) as f64;
    let ratios = (0..POINTS).map(|k| slowest * (high / slowest).powf(share(k)));
    let steps = (0..POINTS).map(|k| low + (BEYOND * high - low) * share(k));
    let mut speeds: Vec<f64> = ratios.chain(steps).chain([low, high]).collect();
    speeds.sort_by(f64::total_cmp);
    let down: Vec<f64> = speeds.iter().rev().map(|v| -v).collect();
    down.into_iter().chain([0.0]).chain(speeds)
}

/// The friction curves with their bands and the plateau map.
pub fn figure(machine: &LoggedRobot, found: &IdentifiedFriction) -> FrictionFigure {
    let panel = |found: &FrictionOfJoint| {
        let (j, e) = (found.index, &found.estimate);
        let [low, high] = e.speeds.covered;
        let curve = speeds_to_draw([low, high]).map(|v| FrictionCurvePoint {
            v,
            torque: e.law.torque(v),
            std: curve_std(&e.law, &e.covariance, v),
        });
        let plateaus = e.plateaus.iter().map(|p| FrictionCurvePoint {
            v: p.v,
            torque: p.torque,
            std: p.std,
        });
        FrictionPanel {
            joint: found.joint.clone(),
            note: format!("NIS {:.2}", e.nis.mean),
            speed_unit: format!("{}/s", machine.robot.joint_kind(j).position_unit()),
            torque_unit: machine.file.torque_unit(j).to_owned(),
            curve: curve.collect(),
            covered: vec![[-high, -low], [low, high]],
            plateaus: plateaus.collect(),
            cloud: Vec::new(),
            beyond_curve: false,
            truth: Vec::new(),
        }
    };
    FrictionFigure {
        title: "Friction by the Kalman filter".into(),
        panels: found.joints.iter().map(panel).collect(),
    }
}
