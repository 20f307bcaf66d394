//! The page of `friction`.

use super::super::friction::figure;
use super::super::{CliError, Context};
use super::{fit, parameters, quality};
use crate::config::ModelFile;
use crate::identify::{IdentifiedFriction, LoggedRobot};
use crate::log::{LogSpec, Provenance, escape};
use crate::math::descent::Ending;
use crate::number;
use crate::report::sections::provenance;
use crate::report::{Report, Writer};

/// What the page is made from.
pub struct FrictionFit<'a> {
    pub machine: &'a LoggedRobot,
    pub found: &'a IdentifiedFriction,
    /// The model that was written.
    pub file: &'a ModelFile,
    pub logs: &'a [LogSpec],
    /// Robot file, and the model whose other joints are kept.
    pub given: Vec<Provenance>,
}

/// The verdict in words, and whether nothing calls for attention.
fn words(of: &FrictionFit) -> (String, bool) {
    let (mut text, mut good) = parameters::tally(of.file);
    text.push('.');
    for (j, e) in &of.found.joints {
        let joint = &of.machine.robot.joint_names()[*j];
        if e.ending != Ending::Converged {
            good = false;
            text += &format!(" The search for {joint} ended without converging.");
        }
        if e.nis.mean > e.nis.upper_95 {
            good = false;
            text += &format!(" Something acts on {joint} that the friction law lacks.");
        }
    }
    (text, good)
}

/// The page as a file.
///
/// # Errors
/// Interruption.
pub fn friction_fit(of: &FrictionFit, context: &Context) -> Result<String, CliError> {
    let machine = of.machine;
    let names: Vec<String> = of.logs.iter().map(|l| escape(&l.name())).collect();
    let mut report = Report::new(&format!("Friction from {}", names.join(", ")));
    let mut page = report.page();
    let (text, good) = words(of);
    page.verdict(&text, good);
    let rows: Vec<Vec<String>> = of
        .found
        .joints
        .iter()
        .map(|(j, e)| {
            let unit = machine.file.torque_unit(*j);
            let speed = machine.robot.joint_kind(*j).position_unit();
            let [low, high] = e.speeds.covered;
            vec![
                machine.robot.joint_names()[*j].clone(),
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
                e.samples.to_string(),
            ]
        })
        .collect();
    page.rows(
        "the filter, joint by joint (NIS: normalised innovations squared, 1 where all is modelled)",
        &[
            "joint",
            "relative error",
            "residual rms",
            "speeds covered",
            "NIS",
            "its 95 % bounds",
            "samples",
        ],
        rows,
    );
    page.heading("Friction");
    page.figure(&figure(machine, of.found).svg());
    parameters::section(&mut page, of.file, &|_| None);
    nuisance(&mut page, of);
    page.heading("What the model hardly tells apart");
    fit::pairs(&mut page, of.file);
    let logs: Vec<&LogSpec> = of.logs.iter().collect();
    quality::section(&mut page, machine, &logs, &of.found.warnings, context)?;
    let mut inputs = of.given.clone();
    inputs.extend(of.found.inputs.iter().cloned());
    provenance::section(
        &mut page,
        &machine.file,
        &inputs,
        &[],
        None,
        context.command(),
    );
    Ok(report.html())
}

/// What was estimated along, and is no friction.
fn nuisance(page: &mut Writer, of: &FrictionFit) {
    let rows: Vec<Vec<String>> = of
        .found
        .joints
        .iter()
        .flat_map(|(j, e)| {
            let joint = &of.machine.robot.joint_names()[*j];
            e.nuisance.iter().map(move |n| {
                let (value, std) = number::value_and_std(n.value, n.std);
                vec![n.name.clone(), joint.clone(), value, std, n.unit.clone()]
            })
        })
        .collect();
    if !rows.is_empty() {
        page.heading("Estimated along");
        page.paragraph(
            "Inertia, gravity and what the other joints' motion adds; not part of the model.",
        );
        let head = ["quantity", "joint", "value", "std", "unit"];
        page.rows("nuisance quantities", &head, rows);
    }
}
