//! The page of `validate`.

use super::super::{CliError, Context};
use super::look::Look;
use super::torque::Drawn;
use super::{fit, friction, parameters, quality, residual, torque};
use crate::config::ModelFile;
use crate::effect::AugmentedModel;
use crate::identify::{LoggedRobot, Validated};
use crate::log::{LogSpec, Provenance, escape};
use crate::number;
use crate::report::sections::provenance;
use crate::report::{Report, Writer};
use crate::validate::Validation;

/// What the page is made from.
pub struct Validate<'a> {
    pub machine: &'a LoggedRobot,
    pub file: &'a ModelFile,
    pub model: &'a AugmentedModel,
    pub logs: &'a [LogSpec],
    pub found: &'a Validated,
    /// Limit that the user set on every joint's relative error.
    pub limit: Option<f64>,
    /// The model file.
    pub given: Provenance,
    /// Absent where the logs are too long to be held.
    pub look: Option<Look<'a>>,
}

/// The verdict in words, and whether nothing calls for attention.
pub fn words(validation: &Validation, limit: Option<f64>, title: &str) -> (String, bool) {
    let mut text = format!(
        "The model gives the torque of {title} to within {}, as the mean over the joints.",
        number::percent(validation.overall.mean_relative_error)
    );
    let joints = validation.joints.iter();
    if let Some(worst) = joints.max_by(|a, b| a.relative_error.total_cmp(&b.relative_error))
        && validation.joints.len() > 1
    {
        text += &format!(
            " The worst joint is {} with {}.",
            worst.joint,
            number::percent(worst.relative_error)
        );
    }
    let Some(limit) = limit else {
        return (text, true);
    };
    let beyond: Vec<&str> = validation
        .joints
        .iter()
        .filter(|e| e.relative_error.is_nan() || e.relative_error > limit)
        .map(|e| e.joint.as_str())
        .collect();
    match beyond.as_slice() {
        [] => {
            text += &format!(
                " Every joint keeps the limit of {}.",
                number::percent(limit)
            )
        }
        some => {
            text += &format!(
                " The limit of {} is missed by {}.",
                number::percent(limit),
                some.join(", ")
            );
        }
    }
    (text, beyond.is_empty())
}

/// The errors of every joint.
pub fn errors(page: &mut Writer, machine: &LoggedRobot, validation: &Validation, caption: &str) {
    let rows: Vec<Vec<String>> = validation
        .joints
        .iter()
        .enumerate()
        .map(|(j, e)| {
            let torque = |v: f64| {
                format!(
                    "{} {}",
                    number::significant(v, 3),
                    machine.file.torque_unit(j)
                )
            };
            vec![
                e.joint.clone(),
                number::percent(e.relative_error),
                torque(e.rmse),
                torque(e.max_abs),
                match e.r2.is_finite() {
                    true => format!("{:.5}", e.r2),
                    false => number::ABSENT.to_owned(),
                },
                number::percent(e.relative_error_raw),
                e.samples.to_string(),
            ]
        })
        .collect();
    page.rows(
        caption,
        &[
            "joint",
            "relative error",
            "rms error",
            "largest",
            "R\u{b2}",
            "relative error before the filter",
            "rows",
        ],
        rows,
    );
}

/// Logs that the model was made from are no test of it.
fn used_before(page: &mut Writer, file: &ModelFile, inputs: &[Provenance]) {
    let made_from = &file.provenance.inputs;
    let known = |i: &&Provenance| {
        made_from
            .iter()
            .any(|m| m.sha256 == i.sha256 && m.samples > 0)
    };
    let names: Vec<String> = inputs
        .iter()
        .filter(known)
        .map(|i| escape(&i.name))
        .collect();
    if !names.is_empty() {
        page.verdict(
            &format!(
                "{} was used to make this model (the checksum is the same), unless the spans are \
                 apart: its error is no test of it.",
                names.join(", ")
            ),
            false,
        );
    }
}

/// The page as a file.
///
/// # Errors
/// Interruption, and stretches that are too short for the filter.
pub fn validate(of: &Validate, context: &Context) -> Result<String, CliError> {
    let (machine, validation) = (of.machine, &of.found.validation);
    let names: Vec<String> = of.logs.iter().map(|l| escape(&l.name())).collect();
    let title = names.join(", ");
    let mut report = Report::new(&format!(
        "Validation of {} on {title}",
        escape(&of.given.name)
    ));
    let mut page = report.page();
    let (text, good) = words(validation, of.limit, &title);
    page.verdict(&text, good);
    used_before(&mut page, of.file, &of.found.inputs);
    errors(
        &mut page,
        machine,
        validation,
        "errors of the reconstructed torque",
    );
    parameters::section(&mut page, of.file, &|_| None);
    match &of.look {
        Some(look) => {
            let every = |_| true;
            friction::section(&mut page, &friction::figure(look, of.file, of.model));
            let logs: Vec<usize> = (0..of.logs.len()).collect();
            torque::section(&mut page, look, &logs, &[Drawn::only(of.model)], &title)?;
            let figure = residual::figure(look, &every, of.model, None)?;
            residual::section(&mut page, &figure.svg());
        }
        None => {
            page.heading("Torque, measured and reconstructed");
            page.paragraph(
                "These logs are too long to be held in memory, so this picture shows extremes only; \
                 choose spans of them, as in LOG@0..20%, for pictures that can be zoomed.",
            );
            page.figure(&super::super::validate::figure(machine, validation, &title).svg());
        }
    }
    page.heading("What the model hardly tells apart");
    fit::pairs(&mut page, of.file);
    let logs: Vec<&LogSpec> = of.logs.iter().collect();
    quality::section(&mut page, machine, &logs, &of.found.warnings, context)?;
    let mut inputs = vec![of.given.clone()];
    inputs.extend(of.found.inputs.iter().cloned());
    let made_from = &of.file.provenance.inputs;
    let summary = Some(&validation.summary);
    provenance::section(
        &mut page,
        &machine.file,
        &inputs,
        made_from,
        summary,
        context.command(),
    );
    Ok(report.html())
}
