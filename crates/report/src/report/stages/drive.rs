//! The report of `drive`.

use crate::report::Report;
use crate::report::figure::{PositionFigure, PositionPanel};
use crate::report::table::{Columns, Table};
use crate::report::traces::{FigureTraces, LogTrace, TraceLine, TracePanel, TraceStyle};
use crate::report::words::listed;
use cft_ident_core::number;
use cft_ident_drive::drive::identify::PositionCourse;
use cft_ident_drive::drive::outcome::{DriveParameter, DrivePositionError, DriveResult, DriveStep};

/// Verdict, errors before and after, steps and numbers.
pub fn drive(found: &DriveResult, name: &str) -> Report {
    let mut report = Report::new(&format!("Drives of {name}"));
    report.everywhere().verdict(&found.verdict.text, true);
    report.everywhere().line("");
    report.everywhere().table(errors(found));
    if !found.steps.is_empty() {
        report.terminal().line("");
        report.page().heading("Effects");
        report.everywhere().table(steps(found));
    }
    report.terminal().line("");
    report.page().heading("Parameters");
    report.everywhere().table(parameters(found));
    if !found.given.is_empty() {
        report.terminal().line("");
        report.everywhere().table(given(found));
    }
    let intervals = format!(
        "Intervals are those of the jackknife over {} blocks ({}).",
        found.blocks, found.blocks_are
    );
    report.terminal().line("");
    report.everywhere().paragraph(&intervals);
    if found.drive.ratios {
        report.everywhere().paragraph(
            "No mass is known: every torque is a ratio to the inertia that the joint turns.",
        );
    }
    report
}

/// Further parts of the page: measured, given and refined positions over each other.
pub fn courses(report: &mut Report, joints: &[String], courses: &[PositionCourse]) {
    let Some(first) = courses.first() else {
        return;
    };
    let mut page = report.page();
    page.heading("Positions, measured and rolled out");
    page.traces(&traces(joints, courses), picture(joints, first));
}

/// The still picture of a log.
pub fn picture(joints: &[String], course: &PositionCourse) -> String {
    let panel = |(j, joint): (usize, &String)| PositionPanel {
        joint: joint.clone(),
        t: course.t.clone(),
        command: course.command[j].clone(),
        measured: course.measured[j].clone(),
        given: course.given[j].clone(),
        refined: course.refined[j].clone(),
    };
    let figure = PositionFigure {
        title: course.log.clone(),
        panels: joints.iter().enumerate().map(panel).collect(),
    };
    figure.svg()
}

fn traces(joints: &[String], courses: &[PositionCourse]) -> FigureTraces {
    let line = |name: &str, style, values: &[f64]| TraceLine {
        name: name.to_owned(),
        style,
        values: values.to_vec(),
    };
    let trace = |course: &PositionCourse| {
        let panel = |(j, joint): (usize, &String)| TracePanel {
            name: joint.clone(),
            quantity: "position".to_owned(),
            unit: "rad".to_owned(),
            small: false,
            limits: None,
            lines: vec![
                line("command", TraceStyle::Motion, &course.command[j]),
                line("measured", TraceStyle::Measured, &course.measured[j]),
                line("without effects", TraceStyle::Before, &course.given[j]),
                line("refined", TraceStyle::After, &course.refined[j]),
            ],
        };
        let held_out = if course.held_out { ", held out" } else { "" };
        LogTrace {
            name: format!("{}{held_out}", course.log),
            t: course.t.clone(),
            breaks: Vec::new(),
            panels: joints.iter().enumerate().map(panel).collect(),
        }
    };
    FigureTraces {
        label: "positions over time, measured and rolled out".to_owned(),
        traces: courses.iter().map(trace).collect(),
    }
}

/// A row of the table of errors: which logs, without effects and with them.
type ErrorRow<'a> = (&'static str, &'a DrivePositionError, &'a DrivePositionError);

fn errors(found: &DriveResult) -> Table {
    let (before, after) = (&found.before, &found.after);
    let mut rows: Vec<ErrorRow> = vec![("fitted", &before.train, &after.train)];
    let pairs = [
        ("held out", &before.holdout, &after.holdout),
        (
            "held out, motion unseen",
            &before.holdout_motion_unseen,
            &after.holdout_motion_unseen,
        ),
    ];
    for (name, before, after) in pairs {
        if let (Some(before), Some(after)) = (before, after) {
            rows.push((name, before, after));
        }
    }
    let milli = |x: f64| number::significant(1e3 * x, 3);
    let caption = "mean position error in simulation [mrad]";
    Columns::new(caption, &rows)
        .words("logs", |row| row.0)
        .numbers("without effects", |row| milli(row.1.mae))
        .numbers("refined", |row| milli(row.2.mae))
        .numbers("rms", |row| milli(row.2.rmse))
        .words("number", |row| row.2.logs.len().to_string())
        .into()
}

fn steps(found: &DriveResult) -> Table {
    let size = |step: &DriveStep| {
        let each = step.parameters.iter().map(|(name, amplitude)| {
            let value = match amplitude.std {
                Some(std) => number::plus_minus(amplitude.value, std),
                None => number::significant(amplitude.value, 3),
            };
            let unit = if amplitude.unit == "1" {
                ""
            } else {
                &amplitude.unit
            };
            match step.parameters.len() {
                1 => format!("{value} {unit}").trim_end().to_owned(),
                _ => format!("{name} {value} {unit}").trim_end().to_owned(),
            }
        });
        listed(each)
    };
    let status = |step: &DriveStep| {
        let word = match (step.written, &step.reason) {
            (true, _) => format!("{:?}", step.status).to_lowercase(),
            (false, Some(reason)) => format!("not written: {reason}"),
            (false, None) => "not written".to_owned(),
        };
        match step.alternatives.as_slice() {
            [] => word,
            others => {
                let names = listed(others.iter().map(|e| e.name().to_owned()));
                format!("{word}; not told apart from {names}")
            }
        }
    };
    let needed = |step: &DriveStep| {
        let needed = step
            .needed
            .map_or(number::ABSENT.to_owned(), |x| number::significant(x, 2));
        format!("{} of {needed}", number::significant(step.deviations, 2))
    };
    let names_joints = found.steps.iter().any(|step| step.joint.is_some());
    Columns::new("effects", &found.steps)
        .when(names_joints, |table| {
            table.words("joint", |step| step.joint.as_deref().unwrap_or("all"))
        })
        .words("effect", |step| step.effect.name())
        .words("size", size)
        .words("deviations", needed)
        .percent("error removed", |step| step.gain.value)
        .words("", status)
        .into()
}

fn parameters(found: &DriveResult) -> Table {
    let value = |p: &DriveParameter| match p.std {
        Some(std) => number::plus_minus(p.value, std),
        None => number::significant(p.value, 4),
    };
    let interval = |p: &DriveParameter| match p.interval_95 {
        Some([low, high]) => {
            let [low, high] = [low, high].map(|x| number::significant(x, 3));
            format!("{low} .. {high}")
        }
        None => number::ABSENT.to_owned(),
    };
    Columns::new(
        "parameters with their standard deviations",
        &found.parameters,
    )
    .words("joint", |p| p.joint.as_deref().unwrap_or("all"))
    .words("name", |p| &p.name)
    .words("value", value)
    .words("95 %", interval)
    .words("unit", |p| &p.unit)
    .words("verdict", |p| p.verdict.word())
    .into()
}

fn given(found: &DriveResult) -> Table {
    Columns::new("single numbers, with what they hold with", &found.given)
        .words("joint", |g| &g.joint)
        .words("name", |g| &g.name)
        .numbers("value", |g| number::significant(g.value, 4))
        .words("unit", |g| &g.unit)
        .words("given", |g| &g.given)
        .into()
}
