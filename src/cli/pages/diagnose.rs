//! The page of `diagnose`, and its picture.

use super::super::diagnose::in_words;
use super::super::diagnose_text::{doubts, nothing_missing};
use super::super::{CliError, Context};
use crate::cli::pictures::inspected;
use crate::config::ModelFile;
use crate::diagnose::{Candidate, Errors, SplitErrors};
use crate::identify::{DataFault, Diagnosed, LoggedRobot};
use crate::log::{LogSpec, Provenance, escape};
use crate::number;
use crate::report::figure::ResidualFigure;
use crate::report::sections::torque::Drawn;
use crate::report::sections::{
    Look, fit, friction, parameters, provenance, quality, residual, torque,
};
use crate::report::{Report, TraceStyle, Writer};

/// Candidates that are told.
const MOST: usize = 20;

/// What the page is made from.
pub struct Diagnose<'a> {
    pub machine: &'a LoggedRobot,
    pub file: &'a ModelFile,
    /// The model file.
    pub given: Provenance,
    /// Logs in their order: fitted, veto, holdout.
    pub logs: Vec<&'a LogSpec>,
}

/// The residual before and after, over the logs that were fitted.
pub fn figure(machine: &LoggedRobot, found: &Diagnosed) -> Result<ResidualFigure, CliError> {
    let look = look(machine, found)?;
    let fitted = found.diagnosis.fitted_logs;
    let after = &found.diagnosis.model;
    residual::figure(&look, &|log| log < fitted, &found.given, Some(after)).map_err(CliError::input)
}

fn look<'a>(machine: &'a LoggedRobot, found: &'a Diagnosed) -> Result<Look<'a>, CliError> {
    Look::new(machine, &found.held, found.logs.iter().cloned()).map_err(CliError::input)
}

/// The verdict in words, and whether nothing calls for attention.
pub fn words(machine: &LoggedRobot, found: &Diagnosed) -> (String, bool) {
    let d = &found.diagnosis;
    let titles: Vec<String> = d
        .steps
        .iter()
        .map(|s| d.model.effects[s.effect].title(&machine.robot))
        .collect();
    match found.verdict() {
        "effects-found" => {
            let mut text = format!("The model lacks: {}.", titles.join("; "));
            if let (Some(before), Some(after)) = (&d.before.holdout, &d.after.holdout) {
                text += &format!(
                    " With it the error on data that decided nothing goes from {} to {}, as the \
                     mean over the joints.",
                    number::percent(before.overall.mean_relative_error),
                    number::percent(after.overall.mean_relative_error)
                );
            }
            (text, true)
        }
        "nothing-missing" => (nothing_missing(d, ""), true),
        _ => {
            let mut text =
                "A residual above the noise is left that no known effect explains.".to_owned();
            if !titles.is_empty() {
                text += &format!(
                    " What comes near to it was added, and lowers the error: {}.",
                    titles.join("; ")
                );
            }
            (text, false)
        }
    }
}

/// The page as a file; `figure` is that of [`figure`].
///
/// # Errors
/// Interruption, and stretches that are too short for the filter.
pub fn diagnose(
    of: &Diagnose,
    found: &Diagnosed,
    figure: &str,
    context: &Context,
) -> Result<String, CliError> {
    let machine = of.machine;
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&of.given.name)));
    let mut page = report.page();
    let (text, good) = words(machine, found);
    page.verdict(&text, good);
    errors(&mut page, machine, found);
    sections(&mut page, machine, found, figure)?;
    let look = look(machine, found)?;
    let refined = found.model(machine, of.file);
    parameters::section(&mut page, &refined, &|_| None);
    friction::section(
        &mut page,
        &friction::figure(&look, &refined, &found.diagnosis.model),
    );
    page.heading("What the model hardly tells apart");
    fit::pairs(&mut page, &refined);
    let quality = inspected(of.logs.iter().copied(), machine, context)?;
    quality::section(&mut page, &quality, &found.held.warnings);
    let mut inputs = vec![of.given.clone()];
    inputs.extend(found.held.inputs.iter().cloned());
    let summary = Some(&found.held.summary);
    let made_from = &of.file.provenance.inputs;
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

/// What was added, the torque and the residual before and after, and what was not added.
///
/// # Errors
/// Stretches that are too short for the filter.
pub fn sections(
    page: &mut Writer,
    machine: &LoggedRobot,
    found: &Diagnosed,
    figure: &str,
) -> Result<(), CliError> {
    let look = look(machine, found)?;
    let d = &found.diagnosis;
    if !d.steps.is_empty() {
        page.heading("What was added");
        steps(page, machine, found);
    }
    page.list(doubts(machine, found));
    // logs that decided nothing, where there are any
    let all: Vec<usize> = (0..look.names.len()).collect();
    let (fitted, others) = all.split_at(d.fitted_logs.min(all.len()));
    let shown = if others.is_empty() { fitted } else { others };
    let names: Vec<&str> = shown.iter().map(|log| look.names[*log].as_str()).collect();
    let after = Drawn {
        names: ["after", "residual after"],
        styles: [TraceStyle::Model, TraceStyle::After],
        model: &d.model,
    };
    let before = Drawn {
        names: ["before", "residual before"],
        styles: [TraceStyle::Before, TraceStyle::Before],
        model: &found.given,
    };
    let models = match d.steps.is_empty() {
        true => vec![Drawn::only(&found.given)],
        false => vec![before, after],
    };
    torque::section(page, &look, shown, &models, &names.join(", ")).map_err(CliError::input)?;
    residual::section(page, figure);
    candidates(page, machine, found);
    Ok(())
}

fn candidates(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let gain = |c: &Candidate| c.score.as_ref().map_or(0.0, |s| s.cv_gain);
    let all = found.diagnosis.candidates.iter();
    let mut rest: Vec<_> = all.filter(|c| c.score.is_some()).collect();
    rest.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let rows: Vec<Vec<String>> = rest
        .iter()
        .take(MOST)
        .map(|c| {
            vec![
                c.effect.title(&machine.robot),
                c.effect.family().name().to_owned(),
                number::percent(gain(c)),
                number::percent(c.score.as_ref().map_or(0.0, |s| s.unique_share)),
                c.reason.clone(),
            ]
        })
        .collect();
    if rows.is_empty() {
        return;
    }
    page.heading("Candidates that were not added");
    page.rows(
        "the best of them, of the last round",
        &[
            "effect",
            "family",
            "cross-validated gain",
            "own share",
            "why not",
        ],
        rows,
    );
}

/// The page where the data are at fault, which comes before any physics.
///
/// # Errors
/// Interruption.
pub fn data_fault(of: &Diagnose, fault: &DataFault, context: &Context) -> Result<String, CliError> {
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&of.given.name)));
    let mut page = report.page();
    page.verdict(
        &format!("The data are at fault ({}): {}.", fault.kind, fault.effect),
        false,
    );
    page.paragraph(&format!("What to do: {}.", fault.remedy));
    let quality = inspected(of.logs.iter().copied(), of.machine, context)?;
    quality::section(&mut page, &quality, &[]);
    let inputs = [of.given.clone()];
    let made_from = &of.file.provenance.inputs;
    provenance::section(
        &mut page,
        &of.machine.file,
        &inputs,
        made_from,
        None,
        context.command(),
    );
    Ok(report.html())
}

/// Errors of every joint before and after, on the logs that were fitted and on those that were not.
pub fn errors(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    let percent = |e: Option<f64>| e.map_or("-".to_owned(), number::percent);
    let rows: Vec<Vec<String>> = machine
        .robot
        .joint_names()
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let relative = |e: &Errors| e.joints[j].relative_error;
            let unseen = |p: &SplitErrors| p.holdout.as_ref().map(relative);
            let interval = d.after.holdout.as_ref().map_or("-".to_owned(), |e| {
                let [low, high] = e.joints[j].interval_95;
                format!("{} to {}", number::percent(low), number::percent(high))
            });
            let rms = d.after.holdout.as_ref().unwrap_or(&d.after.train).joints[j].rmse;
            vec![
                joint.clone(),
                percent(Some(relative(&d.before.train))),
                percent(Some(relative(&d.after.train))),
                percent(unseen(&d.before)),
                percent(unseen(&d.after)),
                interval,
                format!(
                    "{} {}",
                    number::significant(rms, 3),
                    machine.file.torque_unit(j)
                ),
                number::percent(d.unexplained[j].share),
            ]
        })
        .collect();
    page.rows(
        "relative torque error",
        &[
            "joint",
            "fitted, before",
            "after",
            "unseen, before",
            "after",
            "95 % of it",
            "rms after",
            "torque power left above noise",
        ],
        rows,
    );
}

fn steps(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    let mut rows = Vec::new();
    for step in &d.steps {
        let effect = &d.model.effects[step.effect];
        let unseen = step.holdout.map_or("-".to_owned(), |[before, after]| {
            format!("{} to {}", number::percent(before), number::percent(after))
        });
        let alike: Vec<String> = step
            .alternatives
            .iter()
            .map(|c| c.effect.title(&machine.robot))
            .collect();
        let score = step.candidate.score.as_ref();
        let title = effect.title(&machine.robot);
        rows.push(vec![
            if d.assured() {
                title
            } else {
                format!("{title}, or what it stands in for")
            },
            in_words(machine, found, step.effect),
            score.map_or("-".to_owned(), |s| number::percent(s.cv_gain)),
            unseen,
            if alike.is_empty() {
                "separated from all others".to_owned()
            } else {
                format!("{}: {}", alike.join(", "), effect.law.entry.separate_by)
            },
        ]);
    }
    page.rows(
        "in the order in which they were added; numbers of the last fit",
        &[
            "effect",
            "parameters",
            "cross-validated gain",
            "unseen",
            "not separated from; what would",
        ],
        rows,
    );
}
