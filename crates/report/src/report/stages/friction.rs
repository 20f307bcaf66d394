//! The report of `friction`.

use crate::report::figure::{FrictionFigure, FrictionPanel};
use crate::report::sections::quality::{self, InspectedLog};
use crate::report::sections::{fit, parameters, provenance};
use crate::report::table::{CellAlignment, Columns};
use crate::report::words::escaped;
use crate::report::{Report, Writer};
use cft_ident_core::friction::estimate::{BEYOND, FrictionCurvePoint, curve_std};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::Provenance;
use cft_ident_stages::identify::{FrictionOfJoint, IdentifiedFriction, RobotSetup};

/// The parts of the report.
pub struct Friction<'a> {
    pub setup: &'a RobotSetup,
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
    let mut report = Report::new(&format!("Friction from {}", escaped(of.logs)));
    let (text, good) = words(of);
    report.everywhere().verdict(&text, good);
    report.terminal().line("");
    filter(&mut report.everywhere(), of);
    for joint in &of.found.joints {
        let mut laws = match of.found.joints.len() <= MAX_JOINTS_ON_SCREEN {
            true => report.terminal(),
            false => report.detail(),
        };
        law(&mut laws, of.setup, joint);
    }
    report.terminal().line("");
    let (tally, _) = parameters::tally(of.file);
    report.detail().paragraph(&format!("{tally}."));
    report.page().paragraph(&format!("{tally}."));
    report.terminal().note("", &next(of.path), 2);
    report
}

/// The next step with the model at a path.
fn next(path: &str) -> String {
    format!("Next: `cft-ident lsq LOG -r ROBOT.toml -m {path} -o model.toml` fits the inertias.")
}

/// Further parts of the page; `given` are the robot file and the model whose other joints are kept.
pub fn pictures(
    page: &mut Writer,
    of: &Friction,
    given: &[Provenance],
    quality: &[InspectedLog],
    command: &str,
) {
    page.heading("Friction");
    page.figures(figure(of.setup, of.found).cells());
    parameters::section(page, of.file, &|_| None);
    nuisance(page, of.setup, of.found);
    page.heading("Correlated parameters");
    fit::pairs(page, of.file);
    quality::section(page, quality, &of.found.notes);
    let inputs: Vec<Provenance> = given.iter().chain(&of.found.inputs).cloned().collect();
    provenance::section(page, &of.setup.file, &inputs, &[], None, command);
}

/// The parameters of one joint's law.
fn law(laws: &mut Writer, setup: &RobotSetup, found: &FrictionOfJoint) {
    let e = &found.estimate;
    let parameters = found.parameters.each();
    let caption = format!(
        "friction of {}: speeds {} to {} {}/s, residual {} ({} {}, NIS {:.2})",
        found.joint,
        number::significant(e.speeds.covered[0], 2),
        number::significant(e.speeds.covered[1], 3),
        setup.robot.joint_kind(found.index).position_unit(),
        number::percent(e.relative_error),
        number::significant(e.rmse, 3),
        setup.file.torque_unit(found.index),
        e.nis.mean
    );
    let columns = Columns::new(&caption, &parameters)
        .words("joint", |_| &found.joint)
        .words("parameter", |(name, _)| *name)
        .when(parameters.iter().any(|(_, p)| p.theta.is_some()), |t| {
            t.column(CellAlignment::Right, "theta", |(_, p)| {
                p.theta
                    .map_or(number::ABSENT.into(), |theta| theta.to_string())
            })
        })
        .estimates(["value", "std"], |(_, p)| (p.value, p.std))
        .words("unit", |(_, p)| &p.unit)
        .words("verdict", |(_, p)| p.verdict.word());
    laws.table_apart(columns);
}

/// The verdict in words, and whether nothing calls for attention.
fn words(of: &Friction) -> (String, bool) {
    let error = |found: &FrictionOfJoint| found.estimate.relative_error;
    let joints = of.found.joints.iter();
    let worst = joints.max_by(|a, b| error(a).total_cmp(&error(b)));
    let mut text = worst.map_or_else(String::new, |worst| {
        let (joint, error) = (&worst.joint, number::percent(error(worst)));
        match of.found.joints.len() {
            1 => format!("The friction law of {joint} leaves {error} of its torque."),
            n => format!(
                "The friction laws of {n} joints leave at most {error} of the torque, at {joint}."
            ),
        }
    });
    let mut doubts = String::new();
    for found in &of.found.joints {
        let joint = &found.joint;
        if !found.converged {
            doubts += &format!(" The search for {joint} ended without converging.");
        }
        if !found.estimate.missed_plateaus().is_empty() {
            doubts += &format!(
                " The curve of {joint} misses the mean torque at constant speed (see the warnings)."
            );
        }
        if let Some(part) = found.estimate.lacking() {
            doubts += &format!(
                " Something acts on {joint} that the friction law lacks, {} of its torque.",
                number::percent(part)
            );
        }
    }
    text += match doubts.as_str() {
        "" => " The curves can be used over the speeds covered.",
        doubts => doubts,
    };
    (text, doubts.is_empty())
}

/// How the filter went, joint by joint.
fn filter(page: &mut Writer, of: &Friction) {
    let position = |j: usize| of.setup.robot.joint_kind(j).position_unit();
    let range = |[low, high]: [f64; 2], digits: [usize; 2]| {
        let high = number::significant(high, digits[1]);
        format!("{} to {high}", number::significant(low, digits[0]))
    };
    let caption = "relative error of the fit, and normalised innovations squared (NIS, 1 is ideal)";
    let columns = Columns::new(caption, &of.found.joints)
        .words("joint", |joint| &joint.joint)
        .words("error", |joint| {
            number::percent(joint.estimate.relative_error)
        })
        .words("residual rms", |joint| {
            let unit = of.setup.file.torque_unit(joint.index);
            format!("{} {unit}", number::significant(joint.estimate.rmse, 3))
        })
        .words("speeds covered", |joint| {
            let speeds = range(joint.estimate.speeds.covered, [2, 3]);
            format!("{speeds} {}/s", position(joint.index))
        })
        .words("NIS", |joint| {
            number::significant(joint.estimate.nis.mean, 3)
        })
        .words("95 % bounds", |joint| {
            let nis = &joint.estimate.nis;
            range([nis.lower_95, nis.upper_95], [3, 3])
        });
    page.table(columns);
}

/// Quantities that were estimated beside the friction.
fn nuisance(page: &mut Writer, setup: &RobotSetup, found: &IdentifiedFriction) {
    let all = found.joints.iter();
    let all = all.flat_map(|joint| joint.estimate.nuisance.iter().map(move |n| (joint, n)));
    let all: Vec<_> = all.collect();
    if all.is_empty() {
        return;
    }
    page.heading("Other quantities estimated");
    page.paragraph(
        "Inertia, gravity and the torque from the motion of the other joints; not part of the model.",
    );
    let columns = Columns::new("nuisance quantities", all)
        .words("quantity", |(_, n)| &n.name)
        .words("joint", |(joint, _)| &joint.joint)
        .estimates(["value", "std"], |(_, n)| (n.value, n.std))
        .words("unit", |(joint, n)| {
            let torque = setup.file.torque_unit(joint.index);
            let position = setup.robot.joint_kind(joint.index).position_unit();
            match n.unit.as_str() {
                "torque" => torque.to_owned(),
                "torque/acceleration" => format!("{torque} s^2/{position}"),
                unit => unit.to_owned(),
            }
        });
    page.table(columns);
}

/// Rising velocities at which a curve is drawn: in equal ratios, for the law bends close to 0, and in equal steps.
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
pub fn figure(setup: &RobotSetup, found: &IdentifiedFriction) -> FrictionFigure {
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
            speed_unit: format!("{}/s", setup.robot.joint_kind(j).position_unit()),
            torque_unit: setup.file.torque_unit(j).to_owned(),
            curve: curve.collect(),
            covered: vec![[-high, -low], [low, high]],
            plateaus: plateaus.collect(),
            ..FrictionPanel::default()
        }
    };
    FrictionFigure {
        title: "Friction by the Kalman filter".into(),
        panels: found.joints.iter().map(panel).collect(),
    }
}
