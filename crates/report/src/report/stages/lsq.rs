//! The report of `lsq`.

use super::diagnose_words::DiagnosisWords;
use super::first_screen;
use super::quality_of_fit::{bodies, condition, consistent, fit_quality};
use crate::report::figure::{ErrorFigure, JointBars};
use crate::report::sections::quality::{self, InspectedLog};
use crate::report::sections::{fit, friction, parameters, provenance, residual, torque};
use crate::report::table::{Columns, unbroken};
use crate::report::words::{escaped, listed};
use crate::report::{
    FigureTone, FoundLine, Report, VerdictFigure, VerdictHeadline, Writer, summary, usual,
};
use cft_ident_core::number;
use cft_ident_core::verdict::IDENTIFIED;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{
    ErrorOfLog, FrictionOfFit, Gain, IdentifiedDynamics, JointResidual, MotionFit, RobotSetup,
};
use cft_ident_stages::replay::ReplayedLogs;

/// The parts of the report.
pub struct LsqReport<'a> {
    pub setup: &'a RobotSetup,
    pub found: &'a IdentifiedDynamics,
    /// The model that was fitted.
    pub file: &'a ModelFile,
    /// Its path as a shell takes it.
    pub path: &'a str,
    /// Names of the logs.
    pub logs: &'a [String],
    /// The logs as a shell takes them.
    pub typed: &'a str,
}

/// Parameters that a screen has room for.
const MAX_PARAMETERS_ON_SCREEN: usize = 8;

/// Logs that a screen has room for: those with the greatest errors.
const MAX_LOGS_ON_SCREEN: usize = 6;

/// The verdict, the residual of the fit, the parameters and the quality of the fit.
pub fn lsq(of: &LsqReport) -> Report {
    let mut report = Report::new(&format!("Least squares fit to {}", escaped(of.logs)));
    words(of).write(&mut report.everywhere());
    next(&mut report.terminal(), of.path);
    next(&mut report.page(), &first_screen::local(of.path));
    report.terminal().line("");
    gains(&mut report.terminal(), &of.found.gains);
    let relative: Vec<f64> = of
        .found
        .joints
        .iter()
        .map(JointResidual::headline)
        .collect();
    let (joints, more) = summary::most_wrong(&relative);
    residuals(&mut report.usual(), of.found, &joints);
    if let Some(more) = more {
        report.usual().line(&more);
    }
    by_log(&mut report.usual(), of.found, MAX_LOGS_ON_SCREEN);
    let all: Vec<usize> = (0..relative.len()).collect();
    residuals(&mut report.detail(), of.found, &all);
    by_log(&mut report.detail(), of.found, usize::MAX);
    let mut parameters = match of.found.unknowns.len() <= MAX_PARAMETERS_ON_SCREEN {
        true => report.terminal(),
        false => report.detail(),
    };
    parameters.line("");
    fitted(&mut parameters, of.found);
    groupings(&mut parameters, of.found);
    if let Some(fit) = &of.found.by_motion {
        motion(&mut report.terminal(), fit);
    }
    known_friction(&mut report.detail(), &of.found.friction);
    let mut detail = report.detail();
    detail.line("");
    condition(&mut detail, of.found);
    fit_quality(&mut detail, of.found);
    if let Some(links) = &of.found.consistent {
        detail.table(bodies(links));
        consistent(&mut detail, links);
    }
    let mut detail = report.detail();
    detail.paragraph("What the model lacks:");
    detail.code(&format!(
        "cft-ident diagnose {} -m {} -o refined.toml",
        of.typed, of.path
    ));
    first_screen::narrowing(&mut detail, of.file, of.path);
    let mut page = report.page();
    gains(&mut page, &of.found.gains);
    known_friction(&mut page, &of.found.friction);
    if let Some(fit) = &of.found.by_motion {
        motion(&mut page, fit);
    }
    page.figure(bars(of).svg());
    residuals(&mut page, of.found, &all);
    report
}

/// Errors of the fitted data joint by joint as bars.
fn bars(of: &LsqReport) -> ErrorFigure {
    let moving = of.found.joints.iter().filter(|joint| joint.moves());
    let joints = moving.map(|joint| JointBars {
        joint: joint.joint.clone(),
        before: None,
        after: joint.headline().into(),
    });
    ErrorFigure {
        title: "Relative torque error on the fitted data".to_owned(),
        names: [String::new(), String::new()],
        joints: joints.collect(),
        limit: None,
        usual: Some(usual::drawn(of.setup.file.log.torque_is)),
    }
}

/// Further parts of the page; `given` are the robot file and the model that gave the friction,
/// `replayed` is absent where the logs are too long to be held.
pub fn pictures(
    page: &mut Writer,
    of: &LsqReport,
    replayed: Option<&ReplayedLogs>,
    given: &[Provenance],
    quality: &[InspectedLog],
    command: &str,
) {
    parameters::section(page, of.file, &|_| None);
    if let Some(replayed) = replayed {
        let (setup, logs) = (of.setup, &replayed.logs);
        friction::section(page, setup, &replayed.friction, logs);
        let title = logs.join(", ");
        torque::section(page, setup, &replayed.torque, &[torque::ONLY], &title);
        residual::section(page, setup, &replayed.residual);
    }
    fit::section(page, of.found, of.file);
    quality::section(page, quality, &of.found.notes);
    let inputs: Vec<Provenance> = given.iter().chain(&of.found.inputs).cloned().collect();
    let (file, summary) = (&of.setup.file, Some(&of.found.summary));
    provenance::section(page, file, &inputs, &[], summary, command);
}

/// The next step with the model at a path.
fn next(writer: &mut Writer, path: &str) {
    let text = "Next: test the model on a log that was not fitted:";
    writer.next(text, Some(format!("cft-ident validate LOG -m {path}")));
}

/// The error of the fit beside what is usual, and whether the model can be used.
fn words(of: &LsqReport) -> DiagnosisWords {
    let joints: Vec<&JointResidual> = of.found.joints.iter().filter(|j| j.moves()).collect();
    let square: f64 = joints.iter().map(|j| j.headline().powi(2)).sum();
    let rms = (square / joints.len().max(1) as f64).sqrt();
    let torque_is = of.setup.file.log.torque_is;
    let unusual = rms > usual::band(torque_is)[1];
    let useless = joints.iter().filter(|j| j.headline() >= 1.0);
    let useless = listed(useless.map(|j| j.joint.as_str()));
    let figure = |label, value, tone| VerdictFigure { label, value, tone };
    let tone = match (useless.is_empty(), unusual) {
        (false, _) => FigureTone::Worse,
        (true, true) => FigureTone::High,
        _ => FigureTone::Plain,
    };
    let mut figures = vec![figure("error", number::percent(rms), tone)];
    let worst = joints.iter();
    let worst = worst.max_by(|a, b| a.headline().total_cmp(&b.headline()));
    let mut over = String::new();
    if let Some(worst) = worst.filter(|_| joints.len() > 1) {
        let value = format!("{} ({})", number::percent(worst.headline()), worst.joint);
        figures.push(figure("largest", value, FigureTone::Plain));
        over = format!(", rms over {} joints", joints.len());
    }
    figures.push(figure("usual", usual::figure(torque_is), FigureTone::Plain));
    let resting = of.found.joints.iter().filter(|j| !j.moves());
    let mut found = super::validate::still(resting.map(|j| &*j.joint));
    let mut say = |grade, text| found.push(FoundLine { grade, text });
    if !useless.is_empty() {
        let text = format!("{useless}: no torque at all would be as close");
        say("not usable", text);
    } else {
        let apart = far_off(of.found);
        let none = apart.is_empty();
        apart.into_iter().for_each(|text| say("not usable", text));
        match (none, unusual) {
            (true, true) => say(
                "high",
                "look at what the model lacks before you use it".to_owned(),
            ),
            (true, false) => say("usable", "for motions like these".to_owned()),
            _ => {}
        }
    }
    let (tally, all) = parameters::tally(of.file);
    say(if all { "known" } else { "partly known" }, tally);
    DiagnosisWords {
        headline: VerdictHeadline {
            figures,
            of: format!("relative torque error of the fit, on the fitted data{over}"),
        },
        found,
    }
}

/// A joint's error is far above the others from so many times their median on, and from so much.
const OUTLYING_RATIO: f64 = 3.0;
const OUTLYING_ERROR: f64 = 0.05;

/// Joints whose error is far above those of the others, a sentence each.
fn far_off(found: &IdentifiedDynamics) -> Vec<String> {
    let error = |j: usize| found.joints[j].headline();
    let moving = || (0..found.joints.len()).filter(|j| found.joints[*j].moves());
    let median = |without: usize| {
        let others = moving().filter(|k| *k != without);
        let mut errors: Vec<f64> = others.map(error).collect();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied()
    };
    let sentence = |j: usize| {
        let median = median(j)?;
        (error(j) > OUTLYING_ERROR && error(j) > OUTLYING_RATIO * median).then(|| {
            format!(
                "{}: its error of {} is far above that of the others ({} in the median)",
                found.joints[j].joint,
                number::percent(error(j)),
                number::percent(median)
            )
        })
    };
    moving().filter_map(sentence).collect()
}

/// The residual of the fit, of these joints.
pub fn residuals(writer: &mut Writer, found: &IdentifiedDynamics, joints: &[usize]) {
    let torque = |v: f64| number::significant(v, 3);
    let rows = joints.iter().map(|&j| &found.joints[j]);
    let caption = "residual of the model in motion, on the logs that were fitted";
    let columns = Columns::new(caption, rows)
        .words("joint", |joint| &joint.joint)
        .percent("relative error", |joint| joint.headline())
        .numbers("residual rms", |joint| {
            torque(joint.rmse_moving.unwrap_or(joint.rmse))
        })
        .numbers("torque rms", |joint| match joint.rmse_moving {
            Some(residual) => torque(residual / joint.headline()),
            None => number::ABSENT.to_owned(),
        })
        .words("unit", |joint| joint.unit);
    writer.table(columns);
    let plain = &found.unconstrained_residual;
    if !plain.is_empty() {
        let shown = joints.iter().map(|&j| {
            let error = number::percent(plain[j].relative_error);
            unbroken(&format!("{} {error}", plain[j].joint))
        });
        writer.line(&format!("unconstrained residual: {}", listed(shown)));
    }
}

/// What the model leaves of each log, the greatest errors first; nothing of a single log.
fn by_log(writer: &mut Writer, found: &IdentifiedDynamics, most: usize) {
    let mean = |log: &ErrorOfLog| {
        let squares = log.joints.iter().map(|joint| joint.relative_error.powi(2));
        (squares.sum::<f64>() / log.joints.len().max(1) as f64).sqrt()
    };
    let mut logs: Vec<&ErrorOfLog> = found.by_log.iter().collect();
    logs.sort_by(|a, b| mean(b).total_cmp(&mean(a)));
    if logs.is_empty() {
        return;
    }
    let largest = |log: &ErrorOfLog| {
        let joints = log.joints.iter();
        let of = joints.max_by(|a, b| a.relative_error.total_cmp(&b.relative_error));
        of.map_or(number::ABSENT.to_owned(), |joint| {
            unbroken(&format!(
                "{} {}",
                joint.joint,
                number::percent(joint.relative_error)
            ))
        })
    };
    let columns = Columns::new("relative error in each log", logs.iter().take(most))
        .words("log", |log| escape(&log.log))
        .percent("relative error", |log| mean(log))
        .words("largest", |log| largest(log));
    writer.line("");
    writer.table(columns);
    if logs.len() > most {
        writer.line(&format!(
            "{} more logs with smaller errors",
            logs.len() - most
        ));
    }
}

/// The fit to the motion: the friction that it added, and errors of simulated positions before and after.
fn motion(writer: &mut Writer, fit: &MotionFit) {
    writer.line("");
    let chosen = match fit.window_given {
        true => String::new(),
        false => format!(", a length that {} blocks set aside chose", fit.blocks),
    };
    writer.paragraph(&format!(
        "Fitted to the motion that the torques of {} make in windows of {} s{chosen}.",
        fit.joint, fit.window_s
    ));
    let (before, after) = (&fit.before, &fit.after);
    let windows = format!("windows of {} s", fit.window_s);
    let blocks = "blocks set aside, from begin to end";
    let rows = [
        (&*windows, [before.windows, after.windows]),
        (blocks, [before.blocks, after.blocks]),
    ];
    let columns = Columns::new("", &rows)
        .words("rms error of simulated positions", |(name, _)| *name)
        .digits("least squares", 3, |(_, errors)| errors[0])
        .digits("fit to the motion", 3, |(_, errors)| errors[1])
        .words("unit", |_| fit.unit);
    writer.table(columns);
    if !fit.taken {
        writer.paragraph("It runs no better than least squares, which stands in the model.");
    }
    let added = fit.effects.iter().flat_map(|effect| {
        let numbers = effect.parameters.iter().filter(|(_, p)| !p.bound);
        numbers.map(move |(key, p)| {
            let value = with_deviation(p.value, p.std);
            format!("{} {key} {value} {}", effect.name, p.unit)
        })
    });
    let added = listed(added);
    if !added.is_empty() {
        writer.paragraph(&format!("Friction that was added: {added}."));
    }
}

/// A number with its deviation, where it has one.
fn with_deviation(value: f64, std: Option<f64>) -> String {
    match std {
        Some(std) => number::plus_minus(value, std),
        None => number::significant(value, 4),
    }
}

/// Gains of the torque channels, where they were fitted.
fn gains(writer: &mut Writer, gains: &[Gain]) {
    if gains.is_empty() {
        return;
    }
    let columns = Columns::new("gains of the torque channels", gains)
        .words("joint", |gain| &gain.joint)
        .estimates(["gain", "std"], |gain| (gain.value, gain.std))
        .words("unit", |gain| &gain.unit)
        .words("verdict", |gain| gain.verdict.word());
    writer.table(columns);
    writer.line("");
}

/// The friction that was known before, and its shift by the fit in deviations of before.
fn known_friction(writer: &mut Writer, friction: &[FrictionOfFit]) {
    let moved = friction.iter();
    let moved = moved.filter(|joint| joint.parameters.values().any(|p| !p.held));
    let rows = moved.flat_map(|of| of.parameters.iter().map(|(name, p)| (&of.joint, name, p)));
    let rows: Vec<_> = rows.collect();
    if rows.is_empty() {
        return;
    }
    let pair = |value: f64, std: Option<f64>| match std {
        Some(std) => number::value_and_std(value, std),
        None => (number::significant(value, 4), String::new()),
    };
    let caption = "friction refined with the inertias; the shift is in deviations of before";
    let columns = Columns::new(caption, &rows)
        .words("joint", |(joint, ..)| *joint)
        .words("parameter", |(_, name, _)| *name)
        .pair(["value", "std"], |(.., p)| pair(p.value, p.std))
        .pair(["before", "std before"], |(.., p)| {
            pair(p.prior, p.prior_std)
        })
        .numbers("shift", |(.., p)| match (p.held, p.prior_std) {
            (true, _) => "held".to_owned(),
            (false, Some(std)) => format!("{:+.1}", (p.value - p.prior) / std),
            (false, None) => String::new(),
        })
        .words("unit", |(.., p)| &p.unit);
    writer.table_apart(columns);
}

/// The parameters for a terminal.
fn fitted(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let unknowns = &found.unknowns;
    let columns = Columns::new("parameters", unknowns)
        .when(unknowns.iter().any(|u| u.joint.is_some()), |t| {
            t.words("joint", |u| u.joint.as_deref().unwrap_or(""))
        })
        .words("parameter", |u| &u.key)
        .estimates(["value", "std"], |u| (u.value, u.std))
        .words("unit", |u| &u.unit)
        .words("verdict", |u| {
            match u.negligible && u.fitted_relative_std() > IDENTIFIED {
                true => "negligible",
                false => u.verdict.word(),
            }
        });
    terminal.table(columns);
}

/// The combinations that the short names of base parameters stand for; nothing where they are names already.
fn groupings(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let mut grouped = found.unknowns.iter().filter(|u| u.name != u.key).peekable();
    if grouped.peek().is_some() {
        terminal.line("");
        terminal.line("parameters that stand for combinations");
        terminal.list(grouped.map(|u| &u.name));
    }
}
