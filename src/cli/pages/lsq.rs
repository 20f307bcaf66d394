//! The page of `lsq`.

use super::super::{CliError, Context};
use super::look::Look;
use super::torque::Drawn;
use super::{fit, friction, parameters, quality, residual, torque};
use crate::config::ModelFile;
use crate::effect::AugmentedModel;
use crate::identify::{IdentifiedDynamics, LoggedRobot};
use crate::log::{LogSpec, Provenance, escape};
use crate::number;
use crate::report::sections::provenance;
use crate::report::{Report, Writer};

/// What the page is made from.
pub struct Lsq<'a> {
    pub machine: &'a LoggedRobot,
    pub found: &'a IdentifiedDynamics,
    /// The model that was fitted.
    pub file: &'a ModelFile,
    pub model: &'a AugmentedModel,
    pub logs: &'a [LogSpec],
    /// Robot file, and the model file that gave the friction.
    pub given: Vec<Provenance>,
    /// Absent where the logs are too long to be held.
    pub look: Option<Look<'a>>,
}

/// The residual of the fit, joint by joint.
pub fn residuals(page: &mut Writer, machine: &LoggedRobot, found: &IdentifiedDynamics) {
    let joints = machine.robot.joint_names().iter().enumerate();
    let rows: Vec<Vec<String>> = joints
        .map(|(j, joint)| {
            let torque = |v: f64| {
                format!(
                    "{} {}",
                    number::significant(v, 3),
                    machine.file.torque_unit(j)
                )
            };
            vec![
                joint.clone(),
                number::percent(found.fit.relative_error[j]),
                torque(found.fit.residual_std[j]),
                torque(found.fit.torque_rms[j]),
            ]
        })
        .collect();
    page.rows(
        "residual of the fit, on the logs that were fitted",
        &["joint", "relative error", "residual rms", "torque rms"],
        rows,
    );
}

/// The page as a file.
///
/// # Errors
/// Interruption, and stretches that are too short for the filter.
pub fn lsq(of: &Lsq, context: &Context) -> Result<String, CliError> {
    let names: Vec<String> = of.logs.iter().map(|l| escape(&l.name())).collect();
    let title = names.join(", ");
    let mut report = Report::new(&format!("Least squares fit to {title}"));
    let mut page = report.page();
    let (text, good) = parameters::tally(of.file);
    page.verdict(&format!("{text}."), good);
    residuals(&mut page, of.machine, of.found);
    page.paragraph(
        "These errors are those of the data that were fitted; `validate` gives those of others.",
    );
    parameters::section(&mut page, of.file, &|_| None);
    if let Some(look) = &of.look {
        friction::section(&mut page, &friction::figure(look, of.file, of.model));
        let logs: Vec<usize> = (0..of.logs.len()).collect();
        torque::section(&mut page, look, &logs, &[Drawn::only(of.model)], &title)?;
        let figure = residual::figure(look, &|_| true, of.model, None)?;
        residual::section(&mut page, &figure.svg());
    }
    fit::section(&mut page, of.found, of.file);
    let logs: Vec<&LogSpec> = of.logs.iter().collect();
    quality::section(&mut page, of.machine, &logs, &of.found.warnings, context)?;
    let mut inputs = of.given.clone();
    inputs.extend(of.found.inputs.iter().cloned());
    let summary = Some(&of.found.summary);
    provenance::section(
        &mut page,
        &of.machine.file,
        &inputs,
        &[],
        summary,
        context.command(),
    );
    Ok(report.html())
}
