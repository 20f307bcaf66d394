//! The report of `diagnose`.

use super::diagnose_words::{errors as errors_of, words};
use super::step_words::{alternatives, certainty, grade, in_words, seen, torque, worsened};
use super::{first_screen, formulas, found_effects, what_is_left};
use crate::report::sections::quality::{self, InspectedLog};
use crate::report::sections::torque::TorqueDrawing;
use crate::report::sections::{
    fit, free_run, friction, parameters, provenance, residual, sketch, torque,
};
use crate::report::table::{CellAlignment, Columns, Table};
use crate::report::traces::TraceStyle;
use crate::report::words::listed;
use crate::report::{Report, Writer, summary};
use cft_ident_core::diagnose::{
    ChangedTorque, Diagnosis, FoundEffect, LeftCandidate, SplitErrors, UseErrors,
};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{DataFault, Diagnosed, RobotSetup};
use cft_ident_stages::replay::ReplayedDiagnosis;

/// Candidates that a page shows.
const MAX_CANDIDATES: usize = 20;
/// Changes of friction that a screen has room for.
const MAX_CHANGES_ON_SCREEN: usize = 2;
/// Margin of the lines on an effect on a terminal.
const MARGIN: &str = "     ";

/// The parts of the report.
pub struct DiagnoseReport<'a> {
    pub setup: &'a RobotSetup,
    pub file: &'a ModelFile,
    /// The model file.
    pub given: &'a Provenance,
    pub found: &'a Diagnosed,
    /// The model that is written.
    pub refined: &'a ModelFile,
    /// Its path, and the logs, as a shell takes them.
    pub path: &'a str,
    pub logs: &'a str,
}

/// The effects, their numbers, the residual that is left, and the errors before and after.
pub fn diagnose(of: &DiagnoseReport) -> Report {
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&of.given.name)));
    words(of.setup, of.found).write(&mut report.everywhere());
    let typed = (of.refined, of.path, of.logs);
    diagnosed(&mut report, (of.setup, of.found), typed);
    let mut page = report.page();
    first_screen::show(&mut page, of.setup, of.found);
    errors(&mut page, of.setup, of.found);
    formulas::write(&mut page, of.setup, of.found);
    free_run::section(&mut page, of.found.free_run.as_ref());
    report
}

/// Further parts of the page.
pub fn pictures(
    page: &mut Writer,
    of: &DiagnoseReport,
    replayed: &ReplayedDiagnosis,
    quality: &[InspectedLog],
    command: &str,
) {
    let (setup, found) = (of.setup, of.found);
    sections(page, setup, found, replayed);
    parameters::section(page, of.refined, &|_| None);
    let logs: Vec<String> = found.logs.iter().map(|name| escape(name)).collect();
    friction::section(page, setup, &replayed.friction, &logs);
    page.heading("Correlated parameters");
    fit::pairs(page, of.refined);
    quality::section(page, quality, &found.in_memory.notes);
    let mut inputs = vec![of.given.clone()];
    inputs.extend(found.in_memory.inputs.iter().cloned());
    let (summary, made_from) = (Some(&found.in_memory.summary), &of.file.provenance.inputs);
    provenance::section(page, &setup.file, &inputs, made_from, summary, command);
}

/// Where the data are at fault, which comes before any physics.
pub fn data_fault(fault: &DataFault, given: &Provenance) -> Report {
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&given.name)));
    let mut terminal = report.terminal();
    terminal.line(&at_fault(fault));
    terminal.line(&format!("  {}", fault.remedy));
    let mut page = report.page();
    page.verdict(&at_fault(fault), false);
    page.paragraph(&format!("What to do: {}.", fault.remedy));
    report
}

/// A fault of the data in a sentence.
pub fn at_fault(fault: &DataFault) -> String {
    format!("The data are at fault ({}): {}.", fault.kind, fault.effect)
}

/// The errors and the next step for a terminal; the effects one by one where it shows everything.
pub(super) fn diagnosed(
    report: &mut Report,
    (setup, found): (&RobotSetup, &Diagnosed),
    (file, path, logs): (&ModelFile, &str, &str),
) {
    let d = &found.diagnosis;
    first_screen::write_next(report, (setup, found), (file, path, logs));
    report.terminal().line("");
    in_short(&mut report.usual(), setup, d);
    report
        .terminal()
        .list(d.steps.iter().filter_map(|step| seen(setup, step)));
    let mut detail = report.detail();
    detail.table(before_and_after(setup, d));
    if !d.steps.is_empty() {
        detail.line("");
    }
    for (i, step) in d.steps.iter().enumerate() {
        numbered(&mut detail, setup, (i + 1, step));
    }
    found_effects::prediction_only(&mut detail, setup, d);
    free_run::section(&mut detail, found.free_run.as_ref());
    detail.list(doubts(setup, found));
    let changes = changes(setup, found);
    let (on_screen, more) = changes.split_at(changes.len().min(MAX_CHANGES_ON_SCREEN));
    report.terminal().list(on_screen);
    report.detail().list(more);
    formulas::in_short(&mut report.usual(), setup, found);
    formulas::write(&mut report.detail(), setup, found);
    formulas::candidates(&mut report.detail(), setup, found);
    first_screen::narrowing(&mut report.detail(), file, path);
}

/// Errors joint by joint, those of a screen.
fn in_short(usual: &mut Writer, setup: &RobotSetup, d: &Diagnosis) {
    let (_, before) = errors_of(&d.before);
    let (data, after) = errors_of(&d.after);
    let changed = d.changes_model();
    let hundred = number::hundredths;
    let relative: Vec<f64> = after.joints.iter().map(|e| e.headline()).collect();
    let (joints, more) = summary::most_wrong(&relative);
    let caption = format!("relative torque error [%] of each joint while it moves, {data}");
    let columns = Columns::new(&caption, joints)
        .words("joint", |j| &setup.robot.joint_names()[j])
        .when(changed, |t| {
            t.numbers("before", |j| hundred(before.joints[j].headline()))
        })
        .numbers(if changed { "after" } else { "error" }, |j| {
            hundred(relative[j])
        })
        .column(CellAlignment::Right, "95 % CI", |j| {
            after.joints[j].interval_95.map(hundred).join("..")
        })
        .when(
            after.joints.iter().any(|e| e.relative_error_rest.is_some()),
            |t| {
                t.numbers("at rest", |j| {
                    after.joints[j]
                        .relative_error_rest
                        .map_or(number::ABSENT.to_owned(), hundred)
                })
            },
        );
    usual.table(columns);
    if let Some(more) = more {
        usual.line(&more);
    }
}

/// Torques that change from a time on.
fn changes(setup: &RobotSetup, found: &Diagnosed) -> Vec<String> {
    let d = &found.diagnosis;
    let shown = d.changes.iter().map(|c| {
        let (what, meaning) = match c.of {
            ChangedTorque::Friction => (
                "friction",
                "a change in time, and no law of the motion",
            ),
            ChangedTorque::Offset => (
                "the constant torque",
                "a step of the zero of its channel, and no law tells the next one; fit the part of the log before or after it",
            ),
        };
        format!(
            "{what} of {} changes by {} {} from about {:.1} s of {} on ({} standard errors): {meaning}",
            setup.robot.joint_names()[c.joint],
            number::significant(c.by, 2),
            setup.file.torque_unit(c.joint),
            c.at_s,
            found.logs[c.log],
            number::significant(c.certainty, 2)
        )
    });
    shown.collect()
}

/// One effect that was found, for a terminal.
fn numbered(terminal: &mut Writer, setup: &RobotSetup, (number, step): (usize, &FoundEffect)) {
    let effect = &step.estimate;
    let name = format!(
        "{} ({}): {}",
        effect.title(&setup.robot),
        effect.family().name(),
        in_words(setup, step)
    );
    terminal.note(&format!("{number:>3}. "), &name, 7);
    let gain = format!(
        "takes {} off the squared error of blocks left out ({} standard errors)",
        number::percent(step.share),
        number::significant(step.gain.value / step.gain.se.max(f64::MIN_POSITIVE), 2)
    );
    let unseen = step.holdout.map(|errors| {
        let [before, after] = errors.map(number::percent);
        let worse = worsened(step);
        format!("held-out data, the others kept and refitted: {before} without it, {after} with it{worse}")
    });
    let sure = format!(
        "{}: torque {} (rms, 95 % CI), {}",
        grade(step),
        torque(setup, &step.estimate, step.torque),
        certainty(step)
    );
    let lines = [sure, gain];
    let more = unseen.into_iter().chain(alternatives(setup, step));
    for line in lines.into_iter().chain(more) {
        terminal.note(MARGIN, &line, 7);
    }
}

/// Relative errors joint by joint.
fn before_and_after(setup: &RobotSetup, d: &Diagnosis) -> Table {
    let caption = "relative torque error [%] of moving rows on fitted and held-out data, before and after; above noise: residual power beyond \
         the noise, over the torque's [%]";
    let hundred = number::hundredths;
    let fitted = |errors: &SplitErrors, j: usize| hundred(errors.train.joints[j].headline());
    let unseen = |errors: &SplitErrors, j: usize| match &errors.holdout {
        Some(errors) => hundred(errors.joints[j].headline()),
        None => number::ABSENT.to_owned(),
    };
    let (names, now) = (setup.robot.joint_names(), &d.after);
    Columns::new(caption, 0..names.len())
        .words("joint", |j| &names[j])
        .numbers("fitted", |j| fitted(&d.before, j))
        .numbers("after", |j| fitted(now, j))
        .numbers("held-out", |j| unseen(&d.before, j))
        .numbers("after", |j| unseen(now, j))
        .column(CellAlignment::Right, "95 % CI", |j| match &now.holdout {
            Some(errors) => errors.joints[j].interval_95.map(hundred).join(".."),
            None => number::ABSENT.to_owned(),
        })
        .numbers("above noise", |j| hundred(d.left.unexplained[j].share))
        .into()
}

/// Why the effects found are an approximation; nothing where only noise is left.
fn doubts(setup: &RobotSetup, found: &Diagnosed) -> Vec<String> {
    let d = &found.diagnosis;
    let open = d.structured_joints().map(|j| {
        let times = match d.left.unexplained[j].over_floor {
            Some(over) if over < 100.0 => {
                format!(" ({} times the noise)", number::significant(over, 2))
            }
            Some(_) => " (more than 100 times the noise)".to_owned(),
            None => String::new(),
        };
        format!("{}{times}", setup.robot.joint_names()[j])
    });
    let open = listed(open);
    let mut out = Vec::new();
    if let Some(share) = explained(d).filter(|_| d.changes_model()) {
        out.push(format!(
            "what is written explains {} of the residual power above the noise",
            number::percent(share)
        ));
    }
    if !open.is_empty() && d.written().next().is_some() {
        out.push(format!(
            "the residual of {open} is not noise yet: treat the effects found as approximations, for the cause may be \
             one that no known effect describes"
        ));
    }
    out.extend(what_is_left::sentences(setup, found));
    out
}

/// Part of the residual power above the noise that is explained, of all joints together.
fn explained(d: &Diagnosis) -> Option<f64> {
    let parts = d.left.unexplained.iter().zip(&d.left.part_unexplained);
    let known = parts.filter(|(left, part)| left.share > 0.0 && **part > 0.0 && part.is_finite());
    let (left, all) = known.fold((0.0, 0.0), |(left, all), (u, part)| {
        (left + u.share, all + u.share / part)
    });
    let share = (all > 0.0).then(|| 1.0 - left / all);
    share.filter(|share| *share > 0.0)
}

/// The effects that were added, the torque and the residual before and after, and the effects that were not added.
pub(super) fn sections(
    page: &mut Writer,
    setup: &RobotSetup,
    found: &Diagnosed,
    replayed: &ReplayedDiagnosis,
) {
    let d = &found.diagnosis;
    if !d.steps.is_empty() {
        page.heading("What the model lacks");
    }
    page.list(doubts(setup, found));
    found_effects::show(page, setup, found, replayed);
    page.list(d.steps.iter().filter_map(|step| seen(setup, step)));
    page.list(changes(setup, found));
    let errors = errors_of(&d.after).1.joints.iter();
    let errors = errors.map(|e| e.headline());
    sketch::section(page, setup, replayed.poses.as_ref(), errors);
    let drawn = |name: &'static str, styles| TorqueDrawing {
        names: [name.into(), format!("residual {name}").into()],
        styles,
    };
    let before = drawn("before", [TraceStyle::Before, TraceStyle::Before]);
    let after = drawn("after", [TraceStyle::Model, TraceStyle::After]);
    let models = match d.changes_model() {
        false => vec![torque::ONLY],
        true => vec![before, after],
    };
    let title = replayed.logs.join(", ");
    torque::section(page, setup, &replayed.torque, &models, &title);
    what_is_left::section(page, setup, found);
    residual::section(page, setup, &replayed.residual);
    candidates(page, setup, found);
}

fn candidates(page: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    let all = found.diagnosis.candidates.iter();
    let mut rest: Vec<(&LeftCandidate, f64)> = all.filter_map(|c| Some((c, c.score?))).collect();
    rest.sort_by(|a, b| b.1.total_cmp(&a.1));
    rest.truncate(MAX_CANDIDATES);
    if rest.is_empty() {
        return;
    }
    page.heading("Candidates that were not chosen");
    let name = |c: &LeftCandidate| match &c.effect {
        Some(effect) => effect.title(&setup.robot),
        None => c.law.entry.name.to_owned(),
    };
    let family = |c: &LeftCandidate| match &c.effect {
        Some(effect) => effect.family().name(),
        None => c.law.entry.family().name(),
    };
    let columns = Columns::new("the best of them beside those that were", &rest)
        .words("effect", |(c, _)| name(c))
        .words("family", |(c, _)| family(c))
        .percent("gain on blocks left out", |(_, score)| *score)
        .words("why not", |(c, _)| &c.reason);
    page.table(columns);
}

/// Errors of every joint on fitted and held-out logs; before and after where another model is written.
pub(super) fn errors(page: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    let d = &found.diagnosis;
    let now = &d.after;
    let sides: Vec<(&str, &SplitErrors)> = match d.changes_model() {
        true => vec![(", before", &d.before), (", after", now)],
        false => vec![("", now)],
    };
    let names = setup.robot.joint_names();
    let percent = |e: &UseErrors, j: usize| number::percent(e.joints[j].headline());
    let mut columns =
        Columns::new("relative torque error", 0..names.len()).words("joint", |j| &names[j]);
    for (side, errors) in &sides {
        columns = columns.words(&format!("fitted{side}"), |j| percent(&errors.train, j));
    }
    for (side, errors) in &sides {
        if let Some(errors) = &errors.holdout {
            columns = columns.words(&format!("held-out{side}"), |j| percent(errors, j));
        }
    }
    if let Some(errors) = &now.holdout {
        let ends = |j: usize| errors.joints[j].interval_95.map(number::percent);
        columns = columns.words("95 % CI", |j| ends(j).join(" to "));
    }
    let counted = errors_of(now).1;
    let columns = columns
        .words("rms", |j| {
            let rms = number::significant(counted.joints[j].rmse, 3);
            format!("{rms} {}", setup.file.torque_unit(j))
        })
        .percent(
            "structured residual, share of the torque's mean square",
            |j| d.left.unexplained[j].share,
        );
    page.table(columns);
}
