//! The report of `diagnose`.

use super::diagnose_words::errors as errors_of;
pub use super::diagnose_words::words;
use super::step_words::{agreement, alternatives, grade, in_words, worsened};
use super::{first_screen, formulas, found_effects, what_is_left};
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::torque::Drawn;
use crate::report::sections::{
    fit, free_run, friction, parameters, provenance, residual, sketch, torque,
};
use crate::report::table::{Align, Table};
use crate::report::{Report, TraceStyle, Writer, summary};
use cft_ident_core::diagnose::{Diagnosis, Errors, FoundEffect, LeftCandidate, SplitErrors};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{DataFault, Diagnosed, LoggedRobot};
use cft_ident_stages::replay::ReplayedDiagnosis;

/// Candidates that a page shows.
const MAX_CANDIDATES: usize = 20;
/// Changes of friction that a screen has room for.
const MAX_CHANGES_ON_SCREEN: usize = 2;
/// Margin of what a terminal says of an effect.
const MARGIN: &str = "     ";

/// What the report is made from.
pub struct Diagnose<'a> {
    pub machine: &'a LoggedRobot,
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

/// The effects, their numbers, what is left, and the errors before and after.
pub fn diagnose(of: &Diagnose) -> Report {
    let mut report = Report::new(&format!("Diagnosis of {}", escape(&of.given.name)));
    let (text, good) = words(of.machine, of.found);
    report.everywhere().verdict(&text, good);
    let typed = (of.refined, of.path, of.logs);
    diagnosed(&mut report, (of.machine, of.found), typed);
    let mut page = report.page();
    first_screen::show(&mut page, (of.machine, of.found), (of.path, of.logs));
    errors(&mut page, of.machine, of.found);
    formulas::write(&mut page, of.machine, of.found);
    free_run::section(&mut page, of.found.free_run.as_ref());
    report
}

/// What a page has room for besides.
pub fn pictures(
    page: &mut Writer,
    of: &Diagnose,
    replayed: &ReplayedDiagnosis,
    quality: &[Inspected],
    command: &str,
) {
    let (machine, found) = (of.machine, of.found);
    sections(page, machine, found, replayed);
    parameters::section(page, of.refined, &|_| None);
    let logs: Vec<String> = found.logs.iter().map(|name| escape(name)).collect();
    friction::section(page, machine, &replayed.friction, &logs);
    page.heading("Correlated parameters");
    fit::pairs(page, of.refined);
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

/// The errors and what to do next for a terminal; the effects one by one where it shows everything.
pub fn diagnosed(
    report: &mut Report,
    (machine, found): (&LoggedRobot, &Diagnosed),
    (file, path, logs): (&ModelFile, &str, &str),
) {
    let d = &found.diagnosis;
    report.terminal().line("");
    in_short(&mut report.usual(), machine, d);
    let mut detail = report.detail();
    detail.table(before_and_after(machine, d));
    if !d.steps.is_empty() {
        detail.line("");
    }
    for (i, step) in d.steps.iter().enumerate() {
        step_told(&mut detail, machine, (i + 1, step));
    }
    free_run::section(&mut detail, found.free_run.as_ref());
    detail.list(doubts(machine, found));
    report.terminal().list(
        changes(machine, found)
            .into_iter()
            .take(MAX_CHANGES_ON_SCREEN),
    );
    report.detail().list(
        changes(machine, found)
            .into_iter()
            .skip(MAX_CHANGES_ON_SCREEN),
    );
    formulas::in_short(&mut report.usual(), machine, found);
    formulas::write(&mut report.detail(), machine, found);
    formulas::candidates(&mut report.detail(), machine, found);
    let mut terminal = report.terminal();
    terminal.line("");
    let next = first_screen::next(machine, found, (path, logs));
    terminal.note("", &next, 2);
    first_screen::next_motion(&mut terminal, (machine, found), (file, path));
}

/// Errors joint by joint, those of a screen.
fn in_short(usual: &mut Writer, machine: &LoggedRobot, d: &Diagnosis) {
    let (_, before) = errors_of(&d.before);
    let (data, after) = errors_of(d.errors_now());
    let changed = d.written().next().is_some();
    let mut columns = vec![
        ("joint", Align::Left),
        ("now", Align::Decimal),
        ("95 % CI", Align::Right),
    ];
    if changed {
        columns.insert(1, ("as given", Align::Decimal));
    } else {
        columns[1].0 = "error";
    }
    let mut table =
        Table::new(&columns).caption(&format!("relative torque error [%] of each joint, {data}"));
    let relative: Vec<f64> = after.joints.iter().map(|e| e.relative_error).collect();
    let (joints, more) = summary::most_wrong(&relative);
    for j in joints {
        let [low, high] = after.joints[j].interval_95.map(number::hundredths);
        let mut row = vec![machine.robot.joint_names()[j].clone()];
        if changed {
            row.push(number::hundredths(before.joints[j].relative_error));
        }
        row.extend([number::hundredths(relative[j]), format!("{low}..{high}")]);
        table.row(row);
    }
    usual.table(table);
    if let Some(more) = more {
        usual.line(&more);
    }
}

/// Friction that changes from a time on.
fn changes(machine: &LoggedRobot, found: &Diagnosed) -> Vec<String> {
    let d = &found.diagnosis;
    let shown = d.changes.iter().map(|c| {
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
    shown.collect()
}

/// One effect that was found, for a terminal.
fn step_told(terminal: &mut Writer, machine: &LoggedRobot, (number, step): (usize, &FoundEffect)) {
    let effect = &step.estimate;
    let name = format!(
        "{} ({}): {}",
        effect.title(&machine.robot),
        effect.family().name(),
        in_words(machine, step)
    );
    terminal.note(&format!("{number:>3}. "), &name, 7);
    let shown = format!("{}: {}", grade(step), agreement(step));
    terminal.note(MARGIN, &shown, 7);
    let shown = format!(
        "takes {} off the squared error of blocks left out ({} standard errors)",
        number::percent(step.share),
        number::significant(step.gain.value / step.gain.se.max(f64::MIN_POSITIVE), 2)
    );
    terminal.note(MARGIN, &shown, 7);
    if let Some([before, after]) = step.holdout {
        let shown = format!(
            "held-out data, the others kept and refitted: {} without it, {} with it{}",
            number::percent(before),
            number::percent(after),
            worsened(step)
        );
        terminal.note(MARGIN, &shown, 7);
    }
    if let Some(shown) = alternatives(machine, step) {
        terminal.note(MARGIN, &shown, 7);
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
    let now = d.errors_now();
    for (j, joint) in machine.robot.joint_names().iter().enumerate() {
        let of = |errors: &Errors| errors.joints[j].relative_error;
        let unseen = |p: &SplitErrors| p.holdout.as_ref().map(of);
        let interval = now.holdout.as_ref().map(|e| {
            let [low, high] = e.joints[j].interval_95;
            format!("{}..{}", hundred(low), hundred(high))
        });
        table.row([
            joint.as_str(),
            &hundred(of(&d.before.train)),
            &hundred(of(&now.train)),
            &known(unseen(&d.before)),
            &known(unseen(now)),
            interval.as_deref().unwrap_or(number::ABSENT),
            &hundred(d.left.unexplained[j].share),
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
        .map(|j| match d.left.unexplained[j].over_floor {
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
    if let Some(share) = explained(d).filter(|_| d.written().next().is_some()) {
        out.push(format!(
            "what is written explains {} of the residual power above the noise",
            number::percent(share)
        ));
    }
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

/// Part of the residual power above the noise that is explained, of all joints together.
fn explained(d: &Diagnosis) -> Option<f64> {
    let parts = d.left.unexplained.iter().zip(&d.left.part_unexplained);
    let known = parts.filter(|(left, part)| left.share > 0.0 && **part > 0.0 && part.is_finite());
    let (left, all) = known.fold((0.0, 0.0), |(left, all), (u, part)| {
        (left + u.share, all + u.share / part)
    });
    (all > 0.0)
        .then(|| 1.0 - left / all)
        .filter(|share| *share > 0.0)
}

/// What was added, the torque and the residual before and after, and what was not added.
pub fn sections(
    page: &mut Writer,
    machine: &LoggedRobot,
    found: &Diagnosed,
    replayed: &ReplayedDiagnosis,
) {
    let d = &found.diagnosis;
    let (_, errors) = errors_of(d.errors_now());
    let errors: Vec<f64> = errors.joints.iter().map(|e| e.relative_error).collect();
    if !d.steps.is_empty() {
        page.heading("What the model lacks");
    }
    page.list(doubts(machine, found));
    found_effects::show(page, machine, found, replayed);
    page.list(changes(machine, found));
    sketch::section(page, machine, replayed.poses.as_ref(), &errors);
    let after = Drawn {
        names: ["after", "residual after"].map(Into::into),
        styles: [TraceStyle::Model, TraceStyle::After],
    };
    let before = Drawn {
        names: ["as given", "residual as given"].map(Into::into),
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
    let rows: Vec<Vec<String>> = rest.iter().take(MAX_CANDIDATES).map(row).collect();
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

/// Errors of every joint, on the logs that were fitted and on those that were not: before and after where the model that
/// is written is another one.
pub fn errors(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    let now = d.errors_now();
    let sides: Vec<(&str, &SplitErrors)> = match d.written().next() {
        Some(_) => vec![(", as given", &d.before), (", after", now)],
        None => vec![("", now)],
    };
    let held_out = now.holdout.is_some();
    let mut head = vec!["joint".to_owned()];
    head.extend(sides.iter().map(|(side, _)| format!("fitted{side}")));
    if held_out {
        head.extend(sides.iter().map(|(side, _)| format!("held-out{side}")));
        head.push("95 % CI".to_owned());
    }
    head.push("rms".to_owned());
    head.push("residual with a pattern, of torque power".to_owned());
    let row = |(j, joint): (usize, &String)| {
        let percent = |e: &Errors| number::percent(e.joints[j].relative_error);
        let mut row = vec![joint.clone()];
        row.extend(sides.iter().map(|(_, errors)| percent(&errors.train)));
        let unseen = sides.iter().filter_map(|(_, e)| e.holdout.as_ref());
        row.extend(unseen.map(percent));
        if let Some(errors) = &now.holdout {
            let [low, high] = errors.joints[j].interval_95.map(number::percent);
            row.push(format!("{low} to {high}"));
        }
        let rms = number::significant(errors_of(now).1.joints[j].rmse, 3);
        row.push(format!("{rms} {}", machine.file.torque_unit(j)));
        row.push(number::percent(d.left.unexplained[j].share));
        row
    };
    let rows = machine.robot.joint_names().iter().enumerate().map(row);
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    page.rows("relative torque error", &head, rows.collect());
}
