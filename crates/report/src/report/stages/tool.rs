//! The report of `tool`.

use crate::report::figure::{CourseFigure, CoursePanel};
use crate::report::sections::provenance;
use crate::report::table::{CellAlignment, Table};
use crate::report::{Report, Writer};
use cft_ident_core::number;
use cft_ident_logs::log::Provenance;
use cft_ident_tool::tool::{
    RobotController, ToolFile, ToolNumber, ToolResult, ToolStep, number_95, step_in_words,
    touch_in_words,
};

/// Verdict, numbers, effects, and what to do next.
pub fn tool(of: &ToolResult, file: &ToolFile, path: &str) -> Report {
    let mut report = Report::new("What hangs on the sensor");
    let good = of.verdict.kind == "determined";
    let mut all = report.everywhere();
    all.verdict(&of.verdict.text, good);
    all.list(sentences(of));
    all.line("");
    all.table(parameters(of));
    let steps = steps(of);
    all.table_if_any(steps);
    all.table_apart(errors(of));
    report.detail().table_apart(readings(of));
    let mut page = report.page();
    page.table(readings(of));
    page.figures(course(of).cells());
    for controller in RobotController::ALL {
        if let Some(lines) = controller.lines(file) {
            page.paragraph(&format!("{}:", controller.name()));
            page.code(&lines);
        }
    }
    if file.body().is_some() {
        let command = format!("cft-ident export -m {path} --controller ur");
        report
            .everywhere()
            .line("next: the line for the controller (ur, franka, xarm, ros2)");
        report.everywhere().code(&command);
    }
    report
}

/// Where the page came from.
pub fn origin(page: &mut Writer, inputs: &[Provenance], command: &str) {
    page.heading("Where it came from");
    provenance::inputs(page, inputs);
    provenance::called(page, command);
}

/// What is to be said beside the verdict.
fn sentences(of: &ToolResult) -> Vec<String> {
    let mut out = Vec::new();
    let other = of
        .readings
        .iter()
        .filter(|r| r.reading.frame != of.reading.frame);
    let other = other.map(|r| r.force_error).fold(f64::INFINITY, f64::min);
    out.push(match of.reading_is_open {
        true => format!(
            "these poses do not tell in which frame the wrench is logged: taken along {}",
            of.reading.frame.word()
        ),
        false => format!(
            "the wrench is logged along {}: read along the other, {} N are left",
            of.reading.frame.word(),
            number::significant(other, 3)
        ),
    });
    let taken = of.reading.orientation;
    let others = of
        .readings
        .iter()
        .filter(|r| r.reading.orientation != taken);
    let next = others.min_by(|a, b| a.force_error.total_cmp(&b.force_error));
    if let Some(next) = next {
        out.push(format!(
            "orientations are {}: read as {}, the next best, {} N are left",
            taken.words(),
            next.reading.orientation.words(),
            number::significant(next.force_error, 3)
        ));
    }
    if of.reaction {
        out.push("the log holds what the sensor does to the tool: signs here are those of what the tool does to the sensor".to_owned());
    }
    let stands = |step: &&ToolStep| step.status == "confirmed";
    for step in of.steps.iter().filter(stands) {
        out.push(step_in_words(step, of.has_clock));
    }
    for step in of.steps.iter().filter(|step| !stands(step)) {
        out.push(format!(
            "not sure enough to stand in the model ({} of 5 deviations): {}",
            number::significant(step.deviations, 2),
            name(step)
        ));
    }
    if of.mass_by_differences.value.is_some() && of.steps.iter().any(|s| s.effect == "bias-drift") {
        out.push(format!(
            "mass by differences of neighbouring poses, which no slow drift reaches: {} kg",
            number_95(&of.mass_by_differences, 1.0)
        ));
    }
    for touch in &of.touches {
        out.push(touch_in_words(touch, of.has_clock));
    }
    let drifts = of.steps.iter().any(|s| s.effect == "bias-drift");
    if let Some(forecast) = of
        .forecast
        .as_ref()
        .filter(|of| drifts || of.with.force_error <= of.without.force_error)
    {
        let [without, with] =
            [forecast.without, forecast.with].map(|e| number::significant(e.force_error, 3));
        let part = number::percent(1.0 - forecast.fitted);
        let first = number::percent(forecast.fitted);
        out.push(match forecast.with.force_error > forecast.without.force_error {
            true => format!(
                "the drift explains this log and cannot be forecast: fitted to the first {first}, the last {part} come out {with} N off with it and {without} N without; tare the sensor before use"
            ),
            false => format!(
                "fitted to the first {first}, the last {part} come out {with} N off with what follows time, {without} N without"
            ),
        });
    }
    for what in &of.undetermined {
        out.push(format!("these poses do not determine the {what}"));
    }
    if let (Some(pose), false) = (&of.next_pose, of.undetermined.is_empty()) {
        let q = pose.quaternion.map(|x| number::significant(x, 3)).join(" ");
        out.push(format!(
            "the next pose that would: gravity along {} of the sensor's axes (x y z w {q})",
            direction(&pose.gravity_along)
        ));
    }
    out
}

fn direction(d: &[f64; 3]) -> String {
    let word = |(x, axis): (&f64, char)| match x {
        x if *x > 0.1 => Some(format!("+{axis}")),
        x if *x < -0.1 => Some(format!("-{axis}")),
        _ => None,
    };
    let words: Vec<String> = d.iter().zip(['x', 'y', 'z']).filter_map(word).collect();
    words.join(" ")
}

fn name(step: &ToolStep) -> String {
    step.effect.replace('-', " ")
}

/// A number with its unit as people read it.
fn shown(p: &ToolNumber) -> [String; 3] {
    let (scale, unit) = match p.unit.as_str() {
        "m" => (1e3, "mm"),
        unit => (1.0, unit),
    };
    [p.name.clone(), number_95(p, scale), unit.to_owned()]
}

fn parameters(of: &ToolResult) -> Table {
    let mut columns = vec![
        ("", CellAlignment::Left),
        ("value (95 %)", CellAlignment::Left),
        ("unit", CellAlignment::Left),
        ("", CellAlignment::Left),
    ];
    if !of.touches.is_empty() {
        columns.push(("with the touched rows", CellAlignment::Left));
    }
    let mut table = Table::new(&columns).caption(&format!(
        "along the sensor's axes, from its origin; intervals by {} groups of adjacent samples",
        of.blocks
    ));
    for (k, p) in of.parameters.iter().enumerate() {
        let [name, value, unit] = shown(p);
        let with_all = of.with_touches.get(k).map(|p| shown(p)[1].clone());
        let cells = [name.as_str(), &value, &unit, p.verdict];
        table.row(cells.into_iter().chain(with_all.as_deref()));
    }
    table
}

fn steps(of: &ToolResult) -> Table {
    let columns = [
        ("effect", CellAlignment::Left),
        ("status", CellAlignment::Left),
        ("deviations", CellAlignment::Decimal),
        ("force error [N]", CellAlignment::Left),
    ];
    let mut table = Table::new(&columns);
    for step in &of.steps {
        let [before, after] =
            [step.before, step.after].map(|e| number::significant(e.force_error, 3));
        let deviations = number::significant(step.deviations, 3);
        let errors = format!("{before} -> {after}");
        table.row([name(step).as_str(), step.status, &deviations, &errors]);
    }
    table
}

fn errors(of: &ToolResult) -> Table {
    let columns = [
        ("mean norm of the error", CellAlignment::Left),
        ("bias and weight", CellAlignment::Decimal),
        ("with effects", CellAlignment::Decimal),
    ];
    let mut table = Table::new(&columns);
    let mut row = |name: &str, before: f64, after: f64| {
        let [before, after] = [before, after].map(|x| number::significant(x, 3));
        table.row([name, &before, &after]);
    };
    let (a, b) = (&of.before, &of.after);
    row(
        "force, fitted rows [N]",
        a.train.force_error,
        b.train.force_error,
    );
    row(
        "force, rows left out [N]",
        a.holdout.force_error,
        b.holdout.force_error,
    );
    row(
        "moment, fitted rows [Nm]",
        a.train.moment_error,
        b.train.moment_error,
    );
    row(
        "moment, rows left out [Nm]",
        a.holdout.moment_error,
        b.holdout.moment_error,
    );
    table
}

fn readings(of: &ToolResult) -> Table {
    let columns = [
        ("wrench along", CellAlignment::Left),
        ("orientation is", CellAlignment::Left),
        ("force error, rows left out [N]", CellAlignment::Decimal),
    ];
    let mut table = Table::new(&columns).caption("ways to read the log");
    for tried in &of.readings {
        let error = number::significant(tried.force_error, 3);
        let reading = tried.reading;
        table.row([reading.frame.word(), reading.orientation.words(), &error]);
    }
    table
}

/// What is left of each force over the rows.
fn course(of: &ToolResult) -> CourseFigure {
    let panel = |k: usize, name: &str| CoursePanel {
        name: name.to_owned(),
        unit: "N".to_owned(),
        times: of.residuals.iter().map(|(t, ..)| *t).collect(),
        estimates: of
            .residuals
            .iter()
            .map(|(_, before, _)| Some(before[k]))
            .collect(),
        course: of
            .residuals
            .iter()
            .map(|(_, _, after)| Some([after[k], 0.0]))
            .collect(),
        changes: Vec::new(),
    };
    CourseFigure {
        title: "force error, before and after the correction".to_owned(),
        key: ["by bias and weight alone", "with the effects"],
        time_unit: if of.has_clock { "s" } else { "" }.to_owned(),
        panels: [(0, "fx"), (1, "fy"), (2, "fz")]
            .map(|(k, name)| panel(k, name))
            .to_vec(),
    }
}
