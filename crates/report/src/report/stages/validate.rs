//! The report of `validate`.

use crate::report::figure::{ErrorBar, ErrorFigure, JointBars, JointTorque, TorqueFigure};
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::{
    fit, free_run, friction, parameters, provenance, residual, sketch, torque,
};
use crate::report::table::unbroken;
use crate::report::{Report, Writer, summary, usual};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::number;
use cft_ident_core::validate::{JointError, TorqueErrors, Validation};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{ErrorsByUse, LoggedRobot, Validated, not_a_validation, used_for};
use cft_ident_stages::replay::Replayed;

/// What the report is made from.
pub struct Validate<'a> {
    pub machine: &'a LoggedRobot,
    pub file: &'a ModelFile,
    pub model: &'a AugmentedModel,
    /// Names of the logs.
    pub logs: &'a [String],
    pub found: &'a Validated,
    /// Limit that the user set on every joint's relative error.
    pub limit: Option<f64>,
    /// The model file.
    pub given: &'a Provenance,
}

/// The errors, and the verdict on them.
pub fn validate(of: &Validate) -> Report {
    let judged = of.found.judged();
    let title = escaped(of.logs);
    let mut report = Report::new(&format!(
        "Validation of {} on {title}",
        escape(&of.given.name)
    ));
    let by_use = of.found.by_use.as_ref();
    let logs = by_use.map_or(of.logs, |by_use| &by_use.unseen.logs);
    let (mut text, mut good) = words(judged, of.limit, &escaped(logs));
    text += &format!(" {}", usual::words(of.machine.file.log.torque_is));
    if let Some(shown) = not_a_validation(judged) {
        text = format!("NOT A VALIDATION: {shown}.");
        good = false;
    }
    report.everywhere().verdict(&text, good);
    used_before(&mut report.everywhere(), of);
    report.terminal().line("");
    let caption = |logs: &[String]| format!("torque of {} by {}", logs.join(", "), of.machine.name);
    let whole = caption(logs);
    summary::largest_errors(&mut report.usual(), &whole, &judged.joints);
    errors_by_joint(&mut report.detail(), judged, &whole);
    if let Some(ErrorsByUse { used, .. }) = by_use {
        let mut detail = report.detail();
        detail.line("");
        let caption = format!("{}, which the model was made from", caption(&used.logs));
        detail.table(summary::torque_errors(&caption, &used.errors.joints));
    }
    free_run::section(&mut report.detail(), of.found.free_run.as_ref());
    overall(&mut report.detail(), judged);
    let mut page = report.page();
    page.figure(&bars(of).svg());
    errors(&mut page, judged, "errors of the reconstructed torque");
    if let Some(ErrorsByUse { used, .. }) = by_use {
        let logs = escaped(&used.logs);
        let caption = format!("errors on {logs}, which the model was made from");
        errors(&mut page, &used.errors, &caption);
    }
    free_run::section(&mut page, of.found.free_run.as_ref());
    report
}

/// Errors joint by joint as bars, with the limit that the user set.
fn bars(of: &Validate) -> ErrorFigure {
    let bar = |e: &JointError| ErrorBar {
        error: e.relative_error,
        interval_95: None,
    };
    let used = |j: usize| {
        let by_use = of.found.by_use.as_ref()?;
        by_use.used.errors.joints.get(j).map(bar)
    };
    let joints = of.found.judged().joints.iter().enumerate();
    let joints = joints.map(|(j, e)| JointBars {
        joint: e.joint.clone(),
        before: used(j),
        after: bar(e),
    });
    ErrorFigure {
        title: "Relative torque error".to_owned(),
        names: ["on logs that made the model", "on unseen logs"].map(str::to_owned),
        joints: joints.collect(),
        limit: of.limit,
        usual: Some(usual::drawn(of.machine.file.log.torque_is)),
    }
}

/// What a page has room for besides; `replayed` is absent where the logs are too long to be held.
pub fn pictures(
    page: &mut Writer,
    of: &Validate,
    replayed: Option<&Replayed>,
    quality: &[Inspected],
    command: &str,
) {
    let validation = &of.found.validation;
    let title = escaped(of.logs);
    page.paragraph(
        "Next: `cft-ident diagnose` with this log as `--holdout` finds the effects that the model lacks.",
    );
    parameters::section(page, of.file, &|_| None);
    match replayed {
        Some(replayed) => {
            let machine = of.machine;
            let judged = of.found.judged().joints.iter();
            let errors: Vec<f64> = judged.map(|joint| joint.relative_error).collect();
            sketch::section(page, machine, replayed.poses.as_ref(), &errors);
            friction::section(page, machine, &replayed.friction, &replayed.logs);
            torque::section(page, machine, &replayed.torque, &[torque::ONLY], &title);
            let figure = residual::figure(machine, &replayed.residual);
            residual::section(page, &figure);
        }
        None => {
            page.heading("Torque, measured and reconstructed");
            page.paragraph(
                "These logs are too long to be held in memory, so this picture shows extremes only; \
                 choose spans of them, as in LOG@0..20%, for pictures that can be zoomed.",
            );
            page.figure(&figure(validation, &title).svg());
        }
    }
    page.heading("Correlated parameters");
    fit::pairs(page, of.file);
    quality::section(page, quality, &of.found.warnings);
    let mut inputs = vec![of.given.clone()];
    inputs.extend(of.found.inputs.iter().cloned());
    let (file, made_from) = (&of.machine.file, &of.file.provenance.inputs);
    let summary = Some(&validation.summary);
    provenance::section(page, file, &inputs, made_from, summary, command);
}

/// Names as a page shows them.
fn escaped(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| escape(name)).collect();
    names.join(", ")
}

/// The errors for a terminal.
pub fn errors_by_joint(terminal: &mut Writer, of: &TorqueErrors, caption: &str) {
    terminal.table(summary::torque_errors(caption, &of.joints));
    if let Some(text) = at_rest(of) {
        terminal.line("");
        terminal.paragraph(&text);
    }
}

/// Errors over all joints and before the parallel filter, for a terminal that shows everything.
pub fn overall(terminal: &mut Writer, of: &TorqueErrors) {
    let joints = &of.joints;
    terminal.line("");
    let raw = joints.iter().map(|e| {
        let error = number::percent(e.relative_error_raw);
        unbroken(&format!("{} {error}", e.joint))
    });
    let pooled = of.overall.relative_error;
    let pooled = pooled
        .filter(|_| joints.len() > 1)
        .map(|error| format!(", {} pooled (stacked norms)", number::percent(error)));
    terminal.paragraph(&format!(
        "over joints {}{}; before the parallel filter: {}",
        number::percent(of.overall.mean_relative_error),
        pooled.unwrap_or_default(),
        raw.collect::<Vec<_>>().join(", ")
    ));
}

/// The errors of moving and of resting joints apart, where one rests in a hundredth of its rows.
fn at_rest(of: &TorqueErrors) -> Option<String> {
    let rests = |e: &&JointError| 100 * e.resting >= e.samples && e.resting > 0;
    let joints = of.joints.iter().filter(rests);
    let each: Vec<String> = joints
        .map(|e| {
            let error = |e: Option<f64>| e.map_or(number::ABSENT.to_owned(), number::percent);
            unbroken(&format!(
                "{} {} moving, {} at rest ({} of its rows)",
                e.joint,
                error(e.relative_error_moving),
                error(e.relative_error_rest),
                number::percent(e.resting as f64 / e.samples as f64)
            ))
        })
        .collect();
    (!each.is_empty()).then(|| {
        format!(
            "At rest friction takes any torque up to its Coulomb level, which no model predicts: {}",
            each.join(", ")
        )
    })
}

/// The joints that stand still, which count in no error.
pub(super) fn still<'a>(joints: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = joints.collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => format!(" {one} stands still and is not counted."),
        all => format!(" {} stand still and are not counted.", all.join(", ")),
    }
}

/// The verdict in words, and whether nothing calls for attention.
pub fn words(of: &TorqueErrors, limit: Option<f64>, title: &str) -> (String, bool) {
    let mut text = format!(
        "The model misses {} of the torque of {title}",
        number::percent(of.overall.mean_relative_error)
    );
    let joints = of.joints.iter().filter(|e| e.moves());
    if let Some(worst) = joints.max_by(|a, b| a.relative_error.total_cmp(&b.relative_error))
        && of.joints.len() > 1
    {
        text += &format!(
            " (rms over the joints), most at {}: {}",
            worst.joint,
            number::percent(worst.relative_error)
        );
    }
    text += ".";
    text += &still(of.joints.iter().filter(|e| !e.moves()).map(|e| &*e.joint));
    let Some(limit) = limit else {
        return (text, true);
    };
    let beyond: Vec<&str> = of
        .joints
        .iter()
        .filter(|e| e.moves() && (e.relative_error.is_nan() || e.relative_error > limit))
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
pub fn errors(page: &mut Writer, of: &TorqueErrors, caption: &str) {
    let rows: Vec<Vec<String>> = of
        .joints
        .iter()
        .map(|e| {
            let torque = |v: f64| format!("{} {}", number::significant(v, 3), e.unit);
            let rest = |e: Option<f64>| e.map_or(number::ABSENT.to_owned(), number::percent);
            vec![
                e.joint.clone(),
                number::percent(e.relative_error),
                torque(e.rmse),
                torque(e.max_abs),
                match e.r2.is_finite() {
                    true => format!("{:.5}", e.r2),
                    false => number::ABSENT.to_owned(),
                },
                rest(e.relative_error_moving),
                rest(e.relative_error_rest),
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
            "moving",
            "at rest",
            "relative error before the filter",
            "rows",
        ],
        rows,
    );
}

/// Logs that the model was made from are no test of it.
fn used_before(page: &mut Writer, of: &Validate) {
    let used = used_for(of.file, &of.found.inputs);
    let names: Vec<String> = (of.found.inputs.iter().zip(&used))
        .filter(|(_, used)| **used)
        .map(|(input, _)| escape(&input.name))
        .collect();
    if names.is_empty() {
        return;
    }
    let names = names.join(", ");
    let made = "used to make this model (the checksum is the same)";
    match of.found.by_use {
        Some(_) => page.paragraph(&format!(
            "{names} was {made}: its error stands apart and is no test of the model."
        )),
        None => page.verdict(
            &format!("{names} was {made}: its error is no test of the model."),
            false,
        ),
    }
}

/// Measured and reconstructed torque over time (Figures 7 and 8 of the report).
pub fn figure(validation: &Validation, title: &str) -> TorqueFigure {
    let traces = &validation.traces;
    let n = validation.errors.joints.len();
    let joints = validation
        .errors
        .joints
        .iter()
        .enumerate()
        .map(|(j, e)| {
            let mut joint = JointTorque {
                joint: e.joint.clone(),
                unit: e.unit.to_owned(),
                t: Vec::with_capacity(traces.t.len()),
                measured: Vec::with_capacity(traces.t.len()),
                reconstructed: Vec::with_capacity(traces.t.len()),
                relative_error: e.relative_error,
                rmse: e.rmse,
            };
            for (k, t) in traces.t.iter().enumerate() {
                if k > 0 && traces.breaks.contains(&k) {
                    // a row that is not finite parts the lines at a gap
                    joint.t.push(*t);
                    joint.measured.push(f64::NAN);
                    joint.reconstructed.push(f64::NAN);
                }
                joint.t.push(*t);
                joint.measured.push(traces.measured[k * n + j]);
                joint.reconstructed.push(traces.reconstructed[k * n + j]);
            }
            joint
        })
        .collect();
    TorqueFigure {
        title: title.to_owned(),
        joints,
    }
}
