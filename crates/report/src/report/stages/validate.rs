//! The report of `validate`.

use super::diagnose_words::DiagnosisWords;
use crate::report::figure::{ErrorFigure, JointBars, JointTorque, TorqueFigure, parted};
use crate::report::sections::quality::{self, InspectedLog};
use crate::report::sections::{
    fit, free_run, friction, parameters, provenance, residual, sketch, torque,
};
use crate::report::table::{Columns, unbroken};
use crate::report::words::{escaped, listed, percent as known_percent, r2};
use crate::report::{
    FigureTone, FoundLine, Report, VerdictFigure, VerdictHeadline, Writer, summary, usual,
};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::number;
use cft_ident_core::validate::{JointError, TorqueErrors, TorqueValidation};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, TorqueIs, escape};
use cft_ident_stages::identify::{ErrorsByUse, RobotSetup, Validated, not_a_validation, used_for};
use cft_ident_stages::replay::ReplayedLogs;

/// The parts of the report.
pub struct ValidateReport<'a> {
    pub setup: &'a RobotSetup,
    pub file: &'a ModelFile,
    pub model: &'a AugmentedModel,
    /// Names of the logs.
    pub logs: &'a [String],
    pub found: &'a Validated,
    /// Limit that the user set on every joint's relative error.
    pub limit: Option<f64>,
    /// The model file.
    pub given: &'a Provenance,
    /// The command that looks for what the model lacks.
    pub next: &'a str,
    /// The command that writes the model for a controller.
    pub uses: &'a str,
}

/// The errors, and the verdict on them.
pub fn validate(of: &ValidateReport) -> Report {
    let judged = of.found.judged();
    let title = escaped(of.logs);
    let mut report = Report::new(&format!(
        "Validation of {} on {title}",
        escape(&of.given.name)
    ));
    let by_use = of.found.by_use.as_ref();
    let logs = by_use.map_or(of.logs, |by_use| &by_use.unseen.logs);
    let torque_is = of.setup.file.log.torque_is;
    let mut said = words(judged, (of.limit, torque_is), &escaped(logs));
    if let Some(note) = not_a_validation(judged) {
        let (grade, text) = ("not a validation", note.to_string());
        said.found.insert(0, FoundLine { grade, text });
    }
    said.write(&mut report.everywhere());
    used_before(&mut report.everywhere(), of);
    let used = used_for(of.file, &of.found.inputs).contains(&true);
    let fine = judged.overall.mean_relative_error_moving < usual::band(torque_is)[0];
    // a page is the same wherever its logs lie
    let (next, command, on_page) = match fine && !used {
        true => (
            "Next: use the model:",
            of.uses,
            "Next: use the model: `cft-ident export` writes it for controllers and simulators.",
        ),
        false => (
            "Next: find what the model lacks, from the log that it was fitted to:",
            of.next,
            "Next: find what the model lacks: diagnose the log that it was fitted to, with this one held out.",
        ),
    };
    report.terminal().next(next, Some(command.to_owned()));
    report.page().next(on_page, None);
    report.terminal().line("");
    let caption = |logs: &[String]| format!("torque of {} by {}", logs.join(", "), of.setup.name);
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
    page.figure(bars(of).svg());
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
fn bars(of: &ValidateReport) -> ErrorFigure {
    let used = |j: usize| {
        let by_use = of.found.by_use.as_ref()?;
        by_use.used.errors.joints.get(j)
    };
    let joints = of.found.judged().joints.iter().enumerate();
    let joints = joints.map(|(j, e)| JointBars {
        joint: e.joint.clone(),
        before: used(j).map(|used| used.headline().into()),
        after: e.headline().into(),
    });
    ErrorFigure {
        title: "Relative torque error".to_owned(),
        names: ["on logs that made the model", "on unseen logs"].map(str::to_owned),
        joints: joints.collect(),
        limit: of.limit,
        usual: Some(usual::drawn(of.setup.file.log.torque_is)),
    }
}

/// Further parts of the page; `replayed` is absent where the logs are too long to be held.
pub fn pictures(
    page: &mut Writer,
    of: &ValidateReport,
    replayed: Option<&ReplayedLogs>,
    quality: &[InspectedLog],
    command: &str,
) {
    let validation = &of.found.validation;
    let title = escaped(of.logs);
    parameters::section(page, of.file, &|_| None);
    match replayed {
        Some(replayed) => {
            let setup = of.setup;
            let errors = of.found.judged().joints.iter().map(JointError::headline);
            sketch::section(page, setup, replayed.poses.as_ref(), errors);
            friction::section(page, setup, &replayed.friction, &replayed.logs);
            torque::section(page, setup, &replayed.torque, &[torque::ONLY], &title);
            residual::section(page, setup, &replayed.residual);
        }
        None => {
            page.heading("Torque, measured and reconstructed");
            page.paragraph(
                "These logs are too long to be held in memory, so this picture shows extremes only; \
                 choose spans of them, as in LOG@0..20%, for pictures that can be zoomed.",
            );
            page.figure(figure(validation, &title).svg());
        }
    }
    page.heading("Correlated parameters");
    fit::pairs(page, of.file);
    quality::section(page, quality, &of.found.notes);
    let mut inputs = vec![of.given.clone()];
    inputs.extend(of.found.inputs.iter().cloned());
    let (file, made_from) = (&of.setup.file, &of.file.provenance.inputs);
    let summary = Some(&validation.summary);
    provenance::section(page, file, &inputs, made_from, summary, command);
}

/// The errors for a terminal.
pub(super) fn errors_by_joint(terminal: &mut Writer, of: &TorqueErrors, caption: &str) {
    terminal.table(summary::torque_errors(caption, &of.joints));
    if let Some(text) = at_rest(of) {
        terminal.line("");
        terminal.paragraph(&text);
    }
}

/// Errors over all joints and before the parallel filter, for a terminal that shows everything.
pub(super) fn overall(terminal: &mut Writer, of: &TorqueErrors) {
    let joints = &of.joints;
    terminal.line("");
    let raw = joints.iter().map(|e| {
        let error = number::percent(e.relative_error_raw);
        unbroken(&format!("{} {error}", e.joint))
    });
    let pooled = match of.overall.relative_error {
        Some(error) if joints.len() > 1 => {
            format!(", {} pooled (stacked norms)", number::percent(error))
        }
        _ => String::new(),
    };
    terminal.paragraph(&format!(
        "all rows, over joints {}{pooled}; before the parallel filter: {}",
        number::percent(of.overall.mean_relative_error),
        listed(raw)
    ));
}

/// The errors of moving and of resting joints apart, where one rests in a hundredth of its rows.
fn at_rest(of: &TorqueErrors) -> Option<String> {
    let rests = |e: &&JointError| 100 * e.resting >= e.samples && e.resting > 0;
    let each = of.joints.iter().filter(rests).map(|e| {
        unbroken(&format!(
            "{} {} moving, {} at rest ({} of its rows)",
            e.joint,
            known_percent(e.relative_error_moving),
            known_percent(e.relative_error_rest),
            number::percent(e.resting as f64 / e.samples as f64)
        ))
    });
    let each = listed(each);
    (!each.is_empty()).then(|| {
        format!("At rest friction takes any torque up to its Coulomb level, which no model predicts: {each}")
    })
}

/// The joints that stand still, which count in no error.
pub(super) fn still<'a>(joints: impl Iterator<Item = &'a str>) -> Vec<FoundLine> {
    let names: Vec<&str> = joints.collect();
    let text = match names.as_slice() {
        [] => return Vec::new(),
        [one] => format!("{one} stands still and is not counted"),
        all => format!("{} stand still and are not counted", all.join(", ")),
    };
    vec![FoundLine {
        grade: "at rest",
        text,
    }]
}

/// The verdict: the error over the joints, that of the worst joint, what is usual, and the limit that the user set.
pub(super) fn words(
    of: &TorqueErrors,
    (limit, torque_is): (Option<f64>, Option<TorqueIs>),
    title: &str,
) -> DiagnosisWords {
    let figure = |label, value, tone| VerdictFigure { label, value, tone };
    let error = of.overall.mean_relative_error_moving;
    let beyond =
        |e: &&JointError| limit.is_some_and(|limit| e.headline().is_nan() || e.headline() > limit);
    let beyond = of.joints.iter().filter(|e| e.moves()).filter(beyond);
    let beyond = listed(beyond.map(|e| e.joint.as_str()));
    let tone = match (beyond.is_empty(), error > usual::band(torque_is)[1]) {
        (false, _) => FigureTone::Worse,
        (true, true) => FigureTone::High,
        _ => FigureTone::Plain,
    };
    let mut figures = vec![figure("error", number::percent(error), tone)];
    let joints = of.joints.iter().filter(|e| e.moves());
    let worst = joints.max_by(|a, b| a.headline().total_cmp(&b.headline()));
    let mut over = String::new();
    if let Some(worst) = worst.filter(|_| of.joints.len() > 1) {
        let value = format!("{} ({})", number::percent(worst.headline()), worst.joint);
        figures.push(figure("largest", value, FigureTone::Plain));
        over = format!(", rms over {} joints", of.joints.len());
    }
    figures.push(figure("usual", usual::figure(torque_is), FigureTone::Plain));
    let mut found = still(of.joints.iter().filter(|e| !e.moves()).map(|e| &*e.joint));
    if let Some(limit) = limit {
        let limit = number::percent(limit);
        found.push(match beyond.is_empty() {
            true => FoundLine {
                grade: "limit kept",
                text: format!("every joint is within {limit}"),
            },
            false => FoundLine {
                grade: "limit missed",
                text: format!("{beyond} above {limit}"),
            },
        });
    }
    DiagnosisWords {
        headline: VerdictHeadline {
            figures,
            of: format!("relative torque error in motion, on {title}{over}"),
        },
        found,
    }
}

/// The errors of every joint.
fn errors(page: &mut Writer, of: &TorqueErrors, caption: &str) {
    let torque = |v: f64, e: &JointError| format!("{} {}", number::significant(v, 3), e.unit);
    let columns = Columns::new(caption, &of.joints)
        .words("joint", |e| &e.joint)
        .percent("in motion", |e| e.relative_error_moving)
        .words("rms error", |e| {
            torque(e.rmse_moving.unwrap_or(f64::NAN), e)
        })
        .percent("at rest", |e| e.relative_error_rest)
        .percent("all rows", |e| e.relative_error)
        .words("largest", |e| torque(e.max_abs, e))
        .words("R\u{b2}", |e| r2(e.r2))
        .percent("before the filter", |e| e.relative_error_raw)
        .words("rows", |e| e.samples.to_string());
    page.table(columns);
}

/// Logs that the model was made from are no test of it.
fn used_before(page: &mut Writer, of: &ValidateReport) {
    let used = used_for(of.file, &of.found.inputs);
    let used = of.found.inputs.iter().zip(&used).filter(|(_, used)| **used);
    let names = listed(used.map(|(input, _)| escape(&input.name)));
    if names.is_empty() {
        return;
    }
    let made = format!("{names} was used to make this model (the checksum is the same)");
    match of.found.by_use {
        Some(_) => page.paragraph(&format!(
            "{made}: its error stands apart and is no test of the model."
        )),
        None => page.verdict(
            &format!("{made}: its error is no test of the model."),
            false,
        ),
    }
}

/// Measured and reconstructed torque over time (Figures 7 and 8 of the report).
pub fn figure(validation: &TorqueValidation, title: &str) -> TorqueFigure {
    let (traces, joints) = (&validation.traces, &validation.errors.joints);
    let of = |values: &[f64], j: usize| {
        let values = values.iter().skip(j).step_by(joints.len());
        parted(values.copied(), &traces.breaks)
    };
    let joint = |(j, e): (usize, &JointError)| JointTorque {
        joint: e.joint.clone(),
        unit: e.unit.to_owned(),
        t: parted(traces.t.iter().copied(), &traces.breaks),
        measured: of(&traces.measured, j),
        reconstructed: of(&traces.reconstructed, j),
        relative_error: e.relative_error,
        rmse: e.rmse,
    };
    let joints = joints.iter().enumerate().map(joint).collect();
    TorqueFigure {
        title: title.to_owned(),
        joints,
    }
}
