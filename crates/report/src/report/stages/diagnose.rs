//! The report of `diagnose`.

use super::step_words::{chance, in_words, tentative, titled, worsened};
use super::{first_screen, found_effects, what_is_left};
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::torque::Drawn;
use crate::report::sections::{fit, friction, parameters, provenance, residual, sketch, torque};
use crate::report::table::{Align, Table};
use crate::report::{Report, TraceStyle, Writer};
use cft_ident_core::diagnose::{
    AcceptedEffect, Candidate, Diagnosis, Errors, SplitErrors, StepStatus, Turn,
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
pub(crate) fn at_fault(fault: &DataFault) -> String {
    format!("The data are at fault ({}): {}.", fault.kind, fault.effect)
}

/// The errors and the effects for a terminal.
pub fn told(terminal: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    let robot = &machine.robot;
    terminal.line("");
    terminal.table(before_and_after(machine, d));
    if !d.steps.is_empty() {
        terminal.line("");
    }
    for (i, step) in d.steps.iter().enumerate() {
        step_told(terminal, machine, found, (i + 1, step));
    }
    if let Some(path) = path(found) {
        terminal.note("  ", &path, 4);
    }
    terminal.list(doubts(machine, found));
    terminal.note("  ", &first_screen::next(machine, found), 4);
    for e in &d.disturbances {
        let told = format!(
            "cut out: {:.2}..{:.2} s of {}, a disturbance on {} ({:.0} times the usual squared \
             residual)",
            e.from_s,
            e.to_s,
            found.logs[e.log],
            robot.joint_names()[e.joint],
            e.over
        );
        terminal.note("  ", &told, 4);
    }
}

/// One effect that was added, for a terminal.
fn step_told(
    terminal: &mut Writer,
    machine: &LoggedRobot,
    found: &Diagnosed,
    (number, step): (usize, &AcceptedEffect),
) {
    let effect = &found.diagnosis.model.effects[step.effect];
    let what = match effect.curve() {
        Some((signal, _)) => format!("{}; {}", titled(machine, effect), signal.words()[1]),
        None => format!(
            "{} ({}): {}",
            effect.title(&machine.robot),
            effect.family().name(),
            in_words(machine, found, step.effect)
        ),
    };
    terminal.note(&format!("{number:>3}. "), &what, 7);
    if let Some(s) = &step.candidate.score {
        let told = format!(
            "removes {} of the cross-validated squared error; BIC {:+.0} with {:.0} effective rows{}",
            number::percent(s.cv_gain),
            s.delta_bic,
            s.effective_rows,
            (step.candidate.placebo_p_value).map_or(String::new(), |p| format!("; {}", chance(p)))
        );
        terminal.note(MARGIN, &told, 7);
    }
    if let Some([before, after]) = step.holdout {
        let told = format!(
            "held-out data, refitted: {} without it, {} with it{}",
            number::percent(before),
            number::percent(after),
            worsened(step)
        );
        terminal.note(MARGIN, &told, 7);
    }
    if let Some(why) = tentative(&found.diagnosis, step) {
        terminal.note(MARGIN, &format!("tentative: {why}"), 7);
    }
    if step.alternatives.is_empty() {
        return;
    }
    let names = step.alternatives.iter();
    let names: Vec<String> = names.map(|c| c.effect.title(&machine.robot)).collect();
    let told = format!(
        "these data do not separate it from {}; to tell them apart, {}",
        names.join(", "),
        effect.law.entry.separate_by
    );
    terminal.note(MARGIN, &told, 7);
    if let Some(command) = separating_command(effect, &machine.robot) {
        terminal.line(&format!("{MARGIN}such a motion:"));
        terminal.code(&command);
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
    .caption("relative torque error [%] on fitted and held-out data, as given and after");
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

/// Nothing is missing, or nothing that matters.
fn nothing_missing(d: &Diagnosis) -> String {
    match d.remainder().next() {
        None => "Nothing is missing: the remaining residual is noise.".to_owned(),
        Some(_) => "Nothing that matters is missing.".to_owned(),
    }
}

/// Most candidates of a remainder that are named.
const NAMED: usize = 3;

/// Why what was found is an approximation, and what else is significant; nothing where only noise
/// is left.
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
    if !open.is_empty() && !d.steps.is_empty() {
        out.push(format!(
            "the residual of {} is not noise yet: treat the effects found as approximations, for the cause may be \
             one that no known effect describes",
            open.join(", ")
        ));
    }
    out.extend(what_is_left::sentences(machine, found));
    let mut remainder: Vec<&Candidate> = d.remainder().collect();
    let gain = |c: &Candidate| c.score.as_ref().map_or(0.0, |s| s.cv_gain);
    remainder.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let mut names: Vec<String> = remainder
        .iter()
        .take(NAMED)
        .map(|c| c.effect.title(robot))
        .collect();
    if remainder.len() > NAMED {
        names.push(format!("and {} more", remainder.len() - NAMED));
    }
    if !names.is_empty() {
        let doubt = match d.steps.is_empty() {
            true => "",
            false => "; treat the effects found as approximations",
        };
        out.push(format!(
            "significant, too small to add: {}{doubt}",
            names.join(", ")
        ));
    }
    out
}

/// How the search came to what it found, where it changed its mind.
fn path(found: &Diagnosed) -> Option<String> {
    let path = &found.diagnosis.path;
    if path.iter().all(|turn| matches!(turn, Turn::Added(_))) {
        return None;
    }
    let turns = path.iter().map(|turn| match turn {
        Turn::Added(effect) => format!("{effect} added"),
        Turn::Dropped(effect) => format!("{effect} dropped again"),
        Turn::Replaced { gone, come } => {
            format!("{} in place of {}", come.join(" and "), gone.join(" and "))
        }
    });
    Some(format!(
        "how the search went: {}",
        turns.collect::<Vec<_>>().join("; ")
    ))
}

/// How many of the names are tentative, as a sentence.
fn tentative_names(d: &Diagnosis) -> String {
    let tentative = |s: &&AcceptedEffect| d.status(s) == StepStatus::Tentative;
    match (d.steps.iter().filter(tentative).count(), d.steps.len()) {
        (0, _) => String::new(),
        (1, 1) => " The name is tentative.".to_owned(),
        (some, all) if some == all => " Their names are tentative.".to_owned(),
        (some, all) => format!(" Of the {all} names {some} are tentative."),
    }
}

/// Share of an error by which a joint must be worse to be named where chance makes as much.
const TENTH: f64 = 0.1;

/// Joints whose held-out error is larger than that of the model as given by a tenth or beyond its interval, and numbers
/// that stand at a bound of their search, as sentences.
fn reservations(machine: &LoggedRobot, found: &Diagnosed) -> String {
    let d = &found.diagnosis;
    let mut text = String::new();
    if let (Some(before), Some(after)) = (&d.before.holdout, &d.after.holdout) {
        let joints = machine.robot.joint_names().iter().enumerate();
        let worse = joints.filter_map(|(j, joint)| {
            let [from, to] = [before, after].map(|e| e.joints[j].relative_error);
            let interval = after.joints[j].interval_95;
            let [low, high] = interval.map(number::hundredths);
            (to > (1.0 + TENTH) * from || from < interval[0]).then(|| {
                let [from, to] = [from, to].map(number::percent);
                format!("{joint} from {from} to {to} (95 % CI {low}..{high} %)")
            })
        });
        let worse: Vec<String> = worse.collect();
        if !worse.is_empty() {
            text += &format!(" Held-out data are worse on {}.", worse.join(", "));
        }
    }
    let at_bound = d.steps.iter().flat_map(|step| {
        let of = d.model.effects[step.effect].title(&machine.robot);
        let told = found.told(machine, step.effect).into_iter();
        let bound = told.filter(|number| number.bound);
        bound.map(move |n| {
            let value = format!("{} = {} {}", n.key, number::significant(n.value, 3), n.unit);
            format!("{} of {of}", value.trim_end())
        })
    });
    let at_bound: Vec<String> = at_bound.collect();
    if !at_bound.is_empty() {
        text += &format!(
            " At a bound of the search, so not found by the data: {}.",
            at_bound.join(", ")
        );
    }
    text
}

/// The verdict in words, and whether nothing calls for attention.
pub fn words(machine: &LoggedRobot, found: &Diagnosed) -> (String, bool) {
    let d = &found.diagnosis;
    let titles: Vec<String> = d
        .steps
        .iter()
        .map(|s| titled(machine, &d.model.effects[s.effect]))
        .collect();
    match found.verdict() {
        DiagnosisVerdict::EffectsFound => {
            let mut text = format!("The model lacks: {}.", titles.join("; "));
            if let (Some(before), Some(after)) = (&d.before.holdout, &d.after.holdout) {
                text += &format!(
                    " {} the held-out error goes from {} as given to {}, as the rms over \
                     the joints.",
                    match titles.as_slice() {
                        [_] => "With it",
                        _ => "With them",
                    },
                    number::percent(before.overall.mean_relative_error),
                    number::percent(after.overall.mean_relative_error)
                );
            }
            text += &tentative_names(d);
            text += &reservations(machine, found);
            (text, true)
        }
        DiagnosisVerdict::NothingMissing => (nothing_missing(d), true),
        _ => {
            let mut text =
                "A residual above the noise is left that no known effect explains.".to_owned();
            if !titles.is_empty() {
                let errors = match (&d.before.holdout, &d.after.holdout) {
                    (Some(before), Some(after)) => ("held-out error", [before, after]),
                    _ => (
                        "error of the fitted data",
                        [&d.before.train, &d.after.train],
                    ),
                };
                let [before, after] = errors
                    .1
                    .map(|e| number::percent(e.overall.mean_relative_error));
                text += &format!(
                    " What comes near to it was added, and takes the {} from {before} as given to {after}: {}.",
                    errors.0,
                    titles.join("; ")
                );
                text += &reservations(machine, found);
            }
            (text, false)
        }
    }
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
    if let Some(path) = path(found) {
        page.paragraph(&path);
    }
    sketch::section(page, machine, replayed.poses.as_ref(), &errors);
    let after = Drawn {
        names: ["after", "residual after"],
        styles: [TraceStyle::Model, TraceStyle::After],
    };
    let before = Drawn {
        names: ["as given", "residual as given"],
        styles: [TraceStyle::Before, TraceStyle::Before],
    };
    let models = match d.steps.is_empty() {
        true => vec![torque::ONLY],
        false => vec![before, after],
    };
    let title = replayed.logs.join(", ");
    torque::section(page, machine, &replayed.torque, &models, &title);
    what_is_left::section(page, machine, found);
    residual::section(page, &residual::figure(machine, &replayed.residual));
    candidates(page, machine, found);
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
            "independent of the model",
            "why not",
        ],
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
