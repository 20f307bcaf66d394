//! The report of `diagnose`.

use super::step_words::{alternatives, grade, in_words, titled, worsened};
use super::{first_screen, found_effects, what_is_left};
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::torque::Drawn;
use crate::report::sections::{
    fit, free_run, friction, parameters, provenance, residual, sketch, torque,
};
use crate::report::table::{Align, Table};
use crate::report::{Report, TraceStyle, Writer};
use cft_ident_core::diagnose::{
    Diagnosis, Errors, FoundEffect, LeftCandidate, SplitErrors, StepStatus,
};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{
    DataFault, Diagnosed, DiagnosisVerdict, LoggedRobot, separating_command,
};
use cft_ident_stages::replay::ReplayedDiagnosis;

/// Candidates that a page tells.
const MOST: usize = 20;
/// Margin of what a terminal says of an effect.
const MARGIN: &str = "     ";

/// What the report is made from.
pub struct Diagnose<'a> {
    pub machine: &'a LoggedRobot,
    pub file: &'a ModelFile,
    /// The model file.
    pub given: &'a Provenance,
    pub found: &'a Diagnosed,
}

/// The effects, their numbers, what is left, and the errors before and after.
pub fn diagnose(of: &Diagnose) -> Report {
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&of.given.name)));
    let (text, good) = words(of.machine, of.found);
    report.everywhere().verdict(&text, good);
    told(&mut report.terminal(), of.machine, of.found);
    let mut page = report.page();
    first_screen::show(&mut page, of.machine, of.found);
    errors(&mut page, of.machine, of.found);
    free_run::section(&mut page, of.found.free_run.as_ref());
    report
}

/// What a page has room for besides; `refined` is the file of the model that was found.
pub fn pictures(
    page: &mut Writer,
    of: &Diagnose,
    (refined, replayed): (&ModelFile, &ReplayedDiagnosis),
    quality: &[Inspected],
    command: &str,
) {
    let (machine, found) = (of.machine, of.found);
    sections(page, machine, found, replayed);
    parameters::section(page, refined, &|_| None);
    let logs: Vec<String> = found.logs.iter().map(|name| escape(name)).collect();
    friction::section(page, machine, &replayed.friction, &logs);
    page.heading("Correlated parameters");
    fit::pairs(page, refined);
    quality::section(page, quality, &found.in_memory.warnings);
    let mut inputs = vec![of.given.clone()];
    inputs.extend(found.in_memory.inputs.iter().cloned());
    let (summary, made_from) = (Some(&found.in_memory.summary), &of.file.provenance.inputs);
    provenance::section(page, &machine.file, &inputs, made_from, summary, command);
}

/// Where the data are at fault, which comes before any physics.
pub fn data_fault(fault: &DataFault, given: &Provenance) -> Report {
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&given.name)));
    fault_told(&mut report.terminal(), fault);
    let mut page = report.page();
    page.verdict(&at_fault(fault), false);
    page.paragraph(&format!("What to do: {}.", fault.remedy));
    report
}

/// A fault of the data for a terminal.
pub(crate) fn fault_told(terminal: &mut Writer, fault: &DataFault) {
    terminal.line(&at_fault(fault));
    terminal.line(&format!("  {}", fault.remedy));
}

/// The same in a sentence.
pub fn at_fault(fault: &DataFault) -> String {
    format!("The data are at fault ({}): {}.", fault.kind, fault.effect)
}

/// The errors and the effects for a terminal.
pub fn told(terminal: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    terminal.line("");
    terminal.table(before_and_after(machine, d));
    if !d.steps.is_empty() {
        terminal.line("");
    }
    for (i, step) in d.steps.iter().enumerate() {
        step_told(terminal, machine, found, (i + 1, step));
    }
    free_run::section(terminal, found.free_run.as_ref());
    terminal.list(doubts(machine, found));
    terminal.list(changes(machine, found));
    terminal.note("  ", &first_screen::next(machine, found), 4);
}

/// Friction that changes from a time on.
fn changes(machine: &LoggedRobot, found: &Diagnosed) -> Vec<String> {
    let d = &found.diagnosis;
    let told = d.changes.iter().map(|c| {
        format!(
            "friction of {} changes by {} {} from {:.2} s of {} on ({} standard errors): a change in time, and no law \
             of the motion",
            machine.robot.joint_names()[c.joint],
            number::significant(c.by, 2),
            machine.file.torque_unit(c.joint),
            c.at_s,
            found.logs[c.log],
            number::significant(c.certainty, 2)
        )
    });
    told.collect()
}

/// One effect that was found, for a terminal.
fn step_told(
    terminal: &mut Writer,
    machine: &LoggedRobot,
    found: &Diagnosed,
    (number, step): (usize, &FoundEffect),
) {
    let effect = &step.estimate;
    let name = format!(
        "{} ({}): {}",
        effect.title(&machine.robot),
        effect.family().name(),
        in_words(machine, found, step)
    );
    terminal.note(&format!("{number:>3}. "), &name, 7);
    terminal.note(MARGIN, &grade(step, effect), 7);
    let told = format!(
        "takes {} off the squared error of blocks left out ({} standard errors)",
        number::percent(step.share),
        number::significant(step.gain.value / step.gain.se.max(f64::MIN_POSITIVE), 2)
    );
    terminal.note(MARGIN, &told, 7);
    if let Some([before, after]) = step.holdout {
        let told = format!(
            "held-out data, the others kept and refitted: {} without it, {} with it{}",
            number::percent(before),
            number::percent(after),
            worsened(step)
        );
        terminal.note(MARGIN, &told, 7);
    }
    if let Some(told) = alternatives(machine, step) {
        terminal.note(MARGIN, &told, 7);
        if let Some(command) = separating_command(effect, &machine.robot) {
            terminal.line(&format!("{MARGIN}such a motion:"));
            terminal.code(&command);
        }
    }
}

/// Relative errors joint by joint.
fn before_and_after(machine: &LoggedRobot, d: &Diagnosis) -> Table {
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("fitted", Align::Decimal),
        ("after", Align::Decimal),
        ("held-out", Align::Decimal),
        ("after", Align::Decimal),
        ("95 % CI", Align::Right),
        ("above noise", Align::Decimal),
    ])
    .caption(
        "relative torque error [%] on fitted and held-out data, as given and after; above noise: residual power beyond \
         the noise, over the torque's [%]",
    );
    let hundred = number::hundredths;
    let known = |e: Option<f64>| e.map_or(number::ABSENT.to_owned(), hundred);
    for (j, joint) in machine.robot.joint_names().iter().enumerate() {
        let of = |errors: &Errors| errors.joints[j].relative_error;
        let unseen = |p: &SplitErrors| p.holdout.as_ref().map(of);
        let interval = d.after.holdout.as_ref().map(|e| {
            let [low, high] = e.joints[j].interval_95;
            format!("{}..{}", hundred(low), hundred(high))
        });
        table.row([
            joint.as_str(),
            &hundred(of(&d.before.train)),
            &hundred(of(&d.after.train)),
            &known(unseen(&d.before)),
            &known(unseen(&d.after)),
            interval.as_deref().unwrap_or(number::ABSENT),
            &hundred(d.unexplained[j].share),
        ]);
    }
    table
}

/// Why what was found is an approximation; nothing where only noise is left.
fn doubts(machine: &LoggedRobot, found: &Diagnosed) -> Vec<String> {
    let d = &found.diagnosis;
    let robot = &machine.robot;
    let open: Vec<String> = d
        .structured_joints()
        .map(|j| match d.unexplained[j].over_floor {
            Some(over) => {
                let times = match over < 100.0 {
                    true => number::significant(over, 2),
                    false => "more than 100".to_owned(),
                };
                format!("{} ({times} times the noise)", robot.joint_names()[j])
            }
            None => robot.joint_names()[j].clone(),
        })
        .collect();
    let mut out = Vec::new();
    if !open.is_empty() && d.written().next().is_some() {
        out.push(format!(
            "the residual of {} is not noise yet: treat the effects found as approximations, for the cause may be \
             one that no known effect describes",
            open.join(", ")
        ));
    }
    out.extend(what_is_left::sentences(machine, found));
    out
}

/// Errors of two models in words, of held-out data where there are any.
fn from_to(before: &SplitErrors, after: &SplitErrors) -> String {
    let (data, errors) = match (&before.holdout, &after.holdout) {
        (Some(before), Some(after)) => ("held-out error", [before, after]),
        _ => ("error of the fitted data", [&before.train, &after.train]),
    };
    let [before, after] = errors.map(|e| number::percent(e.overall.mean_relative_error));
    format!("{data} goes from {before} as given to {after}, as the rms over the joints")
}

/// Part of the residual power above the noise that is explained, of all joints together.
fn explained(d: &Diagnosis) -> Option<f64> {
    let parts = d.unexplained.iter().zip(&d.part_unexplained);
    let known = parts.filter(|(left, part)| left.share > 0.0 && **part > 0.0 && part.is_finite());
    let (left, all) = known.fold((0.0, 0.0), |(left, all), (u, part)| {
        (left + u.share, all + u.share / part)
    });
    (all > 0.0)
        .then(|| 1.0 - left / all)
        .filter(|share| *share > 0.0)
}

/// The verdict in words, and whether nothing calls for attention.
pub fn words(machine: &LoggedRobot, found: &Diagnosed) -> (String, bool) {
    let d = &found.diagnosis;
    let graded = |s: &FoundEffect| {
        let grade = match (s.accepted_by_user, s.status) {
            (true, _) => "accepted by you",
            (_, StepStatus::Confirmed) => "confirmed",
            (_, StepStatus::Indicated) => "indicated",
            (_, StepStatus::Seen) => "seen",
        };
        format!("{} ({grade})", titled(machine, &s.estimate))
    };
    let written: Vec<String> = d.written().map(graded).collect();
    let unconfirmed = d.steps.iter().filter(|s| s.judged.is_none());
    let seen: Vec<String> = unconfirmed.map(|s| titled(machine, &s.estimate)).collect();
    let mut text = match found.verdict() {
        DiagnosisVerdict::EffectsFound => {
            let mut text = format!("The model lacks: {}.", written.join("; "));
            text += &format!(" With this the {}.", from_to(&d.before, &d.after));
            if let Some(share) = explained(d) {
                text += &format!(
                    " It explains {} of the residual power above the noise.",
                    number::percent(share)
                );
            }
            text
        }
        _ if !d.determined => {
            "These data determine nothing: the noise is as large as the torque that the model explains.".to_owned()
        }
        _ if !d.long_enough() => format!(
            "These logs are too short to confirm any effect: they give {} parts that are independent of each other, of \
             {} s, and {} are needed. The model is as it was.",
            d.parts,
            number::significant(d.block_s, 2),
            d.parts_needed
        ),
        DiagnosisVerdict::NothingMissing if seen.is_empty() => {
            "Nothing is missing: the remaining residual is noise.".to_owned()
        }
        DiagnosisVerdict::NothingMissing => "Nothing that matters is missing.".to_owned(),
        _ => "A residual above the noise is left that no effect explains in all parts of the data. The model is as it \
              was."
            .to_owned(),
    };
    if let Some(selected) = &d.selected {
        let vetoed = d.steps.iter().filter(|s| s.vetoed());
        let names: Vec<String> = vetoed.map(|s| titled(machine, &s.estimate)).collect();
        text += &format!(
            " Held-out data are worse on a joint with {}, which is not written: with the written model, selected on \
             these data, the {} (optimistic).",
            names.join("; "),
            from_to(&d.before, selected)
        );
    }
    if !seen.is_empty() {
        text += &format!(" Seen and not confirmed: {}.", seen.join("; "));
    }
    let good = d.determined && !matches!(found.verdict(), DiagnosisVerdict::UnexplainedResidual);
    (text, good)
}

/// What was added, the torque and the residual before and after, and what was not added.
pub fn sections(
    page: &mut Writer,
    machine: &LoggedRobot,
    found: &Diagnosed,
    replayed: &ReplayedDiagnosis,
) {
    let d = &found.diagnosis;
    let errors = d.after.holdout.as_ref().unwrap_or(&d.after.train);
    let errors = errors.joints.iter().map(|joint| joint.relative_error);
    let errors: Vec<f64> = errors.collect();
    if !d.steps.is_empty() {
        page.heading("What the model lacks");
    }
    page.list(doubts(machine, found));
    found_effects::show(page, machine, found, replayed);
    page.list(changes(machine, found));
    sketch::section(page, machine, replayed.poses.as_ref(), &errors);
    let after = Drawn {
        names: ["after", "residual after"],
        styles: [TraceStyle::Model, TraceStyle::After],
    };
    let before = Drawn {
        names: ["as given", "residual as given"],
        styles: [TraceStyle::Before, TraceStyle::Before],
    };
    let models = match d.written().next() {
        None => vec![torque::ONLY],
        Some(_) => vec![before, after],
    };
    let title = replayed.logs.join(", ");
    torque::section(page, machine, &replayed.torque, &models, &title);
    what_is_left::section(page, machine, found);
    residual::section(page, &residual::figure(machine, &replayed.residual));
    candidates(page, machine, found);
}

fn candidates(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let all = found.diagnosis.candidates.iter();
    let mut rest: Vec<(&LeftCandidate, f64)> = all.filter_map(|c| Some((c, c.score?))).collect();
    rest.sort_by(|a, b| b.1.total_cmp(&a.1));
    let row = |(c, score): &(&LeftCandidate, f64)| {
        let effect = c.effect.as_ref();
        vec![
            effect.map_or(c.law.entry.name.to_owned(), |e| e.title(&machine.robot)),
            effect
                .map_or(c.law.entry.family(), |e| e.family())
                .name()
                .to_owned(),
            number::percent(*score),
            c.reason.clone(),
        ]
    };
    let rows: Vec<Vec<String>> = rest.iter().take(MOST).map(row).collect();
    if rows.is_empty() {
        return;
    }
    page.heading("Candidates that were not chosen");
    page.rows(
        "the best of them beside those that were",
        &["effect", "family", "gain on blocks left out", "why not"],
        rows,
    );
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
            "fitted, as given",
            "fitted, after",
            "held-out, as given",
            "held-out, after",
            "95 % CI",
            "rms after",
            "residual with a pattern, of torque power",
        ],
        rows,
    );
}
