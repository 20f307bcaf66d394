//! The report of `track`.

use crate::report::figure::{CourseFigure, CoursePanel};
use crate::report::sections::provenance;
use crate::report::table::{Align, Table};
use crate::report::{Report, Writer};
use cft_ident_core::number;
use cft_ident_fleet::track::ChangeKind;
use cft_ident_logs::log::escape;
use cft_ident_stages::identify::{Tracked, TrackedChange, TrackedParameter, TrackedRobot};

/// Parameters that a screen has room for.
const MAX_PARAMETERS_ON_SCREEN: usize = 12;
/// Most courses of a robot without a change that a page draws.
const DRAWN: usize = 60;
/// Courses without a change that are shown at once.
const AT_ONCE: usize = 6;
/// Most robots of which a page draws courses.
const ROBOTS: usize = 20;

/// The changes, and the courses.
pub fn track(of: &Tracked) -> Report {
    let mut report = Report::new("Parameters over time");
    let same = of.robots.iter().all(|r| r.changes.is_empty()) && of.fleet.is_empty();
    let good = same && !too_few(of);
    report.everywhere().verdict(&words(of), good);
    if let Some(table) = changes(of) {
        let mut all = report.everywhere();
        all.line("");
        all.table(table);
    }
    if let Some(table) = fleet(of) {
        let mut all = report.everywhere();
        all.line("");
        all.table(table);
    }
    if let [robot] = of.robots.as_slice() {
        let mut table = match robot.parameters.len() > MAX_PARAMETERS_ON_SCREEN {
            true => report.detail(),
            false => report.terminal(),
        };
        table.line("");
        table.table(last(robot));
    }
    let mut page = report.page();
    page.paragraph(next(of));
    if let [robot] = of.robots.as_slice() {
        page.table(last(robot));
    }
    page.list(&of.warnings);
    let changed = |r: &&TrackedRobot| !r.changes.is_empty();
    let first = of.robots.iter().filter(changed);
    let others = of.robots.iter().filter(|r| !changed(r));
    for robot in first.chain(others).take(ROBOTS) {
        course(&mut page, robot);
    }
    if of.robots.len() > ROBOTS {
        page.paragraph(&format!(
            "{} more robots are in the JSON document and in the CSV file.",
            of.robots.len() - ROBOTS
        ));
    }
    report
}

/// What to do next.
fn next(of: &Tracked) -> &'static str {
    let changed = of.robots.iter().any(|r| !r.changes.is_empty());
    match changed || !of.fleet.is_empty() {
        true => {
            "Next: look at the joint that changed, and fit a model to the logs since (`cft-ident lsq`), which \
             `cft-ident compare` sets beside the old one."
        }
        false => {
            "Next: reduce the next logs of the same motion (`cft-ident reduce`) and track them with these: smaller \
             changes are seen with more logs."
        }
    }
}

/// Where the page came from, so that the run can be repeated.
pub fn origin(page: &mut Writer, of: &Tracked, command: &str) {
    page.heading("Where it came from");
    provenance::inputs(page, &of.inputs);
    provenance::called(page, command);
}

/// Name of a parameter with its joint.
fn named(name: &str, joint: Option<&String>) -> String {
    match joint {
        Some(joint) => format!("{name} of {}", escape(joint)),
        None => name.to_owned(),
    }
}

fn kind(kind: ChangeKind) -> &'static str {
    match kind {
        ChangeKind::Step => "step",
        ChangeKind::Ramp => "ramp",
    }
}

/// The verdict in words.
fn words(of: &Tracked) -> String {
    let logs: usize = of.robots.iter().map(|r| r.logs.len()).sum();
    let changed = of.robots.iter().filter(|r| !r.changes.is_empty()).count();
    let changes: usize = of.robots.iter().map(|r| r.changes.len()).sum();
    let of_robots = match of.robots.len() {
        1 => String::new(),
        n => format!(" of {n} robots"),
    };
    let mut text = match changes {
        0 if too_few(of) => format!(
            "{logs} logs{of_robots} are too few to show a change: it needs six logs before it and six from it on."
        ),
        0 => format!("No parameter changed over {logs} logs{of_robots}."),
        n => format!("{n} changes of parameters over {logs} logs{of_robots}, in {changed} robots."),
    };
    if changes == 0 {
        text += &unseen(of);
    }
    if !of.fleet.is_empty() {
        text += &format!(
            " {} parameters differ from those of the other robots.",
            of.fleet.len()
        );
    }
    text
}

/// Whether no change could have been seen.
fn too_few(of: &Tracked) -> bool {
    let mut all = of.robots.iter().flat_map(|r| &r.parameters);
    all.all(|p| p.least_seen.is_none())
}

/// How small a change the logs could not have shown, as a sentence.
fn unseen(of: &Tracked) -> String {
    let all = || of.robots.iter().flat_map(|r| &r.parameters);
    let mut least: Vec<f64> = all().filter_map(relative_least).collect();
    least.sort_by(f64::total_cmp);
    match least.get(least.len() / 2) {
        Some(median) => format!(
            " Changes smaller than {} of the value, in the median over the parameters, could not be seen.",
            number::percent(*median)
        ),
        None => String::new(),
    }
}

/// The least change that could be seen, over the parameter.
fn relative_least(p: &TrackedParameter) -> Option<f64> {
    let last = p.values.iter().rev().flatten().next()?;
    (*last != 0.0).then(|| p.least_seen.map(|least| least / last.abs()))?
}

fn changes(of: &Tracked) -> Option<Table> {
    let columns = [
        ("robot", Align::Left),
        ("parameter", Align::Left),
        ("kind", Align::Left),
        ("log", Align::Left),
        ("size", Align::Decimal),
        ("std", Align::Decimal),
        ("unit", Align::Left),
        ("change", Align::Right),
    ];
    let mut table = Table::new(&columns).caption("changes");
    for robot in &of.robots {
        for change in &robot.changes {
            table.row(change_row(robot, change));
        }
    }
    (!table.is_empty()).then_some(table)
}

fn change_row(robot: &TrackedRobot, change: &TrackedChange) -> Vec<String> {
    let (size, std) = number::value_and_std(change.size, change.std);
    vec![
        escape(&robot.name),
        named(&change.parameter, change.joint.as_ref()),
        kind(change.kind).to_owned(),
        escape(&robot.logs[change.log]),
        size,
        std,
        change.unit.clone(),
        change
            .relative
            .map_or(number::ABSENT.to_owned(), number::percent),
    ]
}

fn fleet(of: &Tracked) -> Option<Table> {
    let columns = [
        ("robot", Align::Left),
        ("parameter", Align::Left),
        ("value", Align::Decimal),
        ("usual", Align::Decimal),
        ("std", Align::Decimal),
        ("unit", Align::Left),
    ];
    let mut table = Table::new(&columns).caption("robots that differ from the others");
    for one in &of.fleet {
        let (value, std) = number::value_and_std(one.value, one.std);
        table.row(vec![
            escape(&one.robot),
            named(&one.parameter, one.joint.as_ref()),
            value,
            number::value_and_std(one.usual, one.std).0,
            std,
            one.unit.clone(),
        ]);
    }
    (!table.is_empty()).then_some(table)
}

/// The parameters after the last log.
fn last(robot: &TrackedRobot) -> Table {
    let columns = [
        ("parameter", Align::Left),
        ("value", Align::Decimal),
        ("std", Align::Decimal),
        ("unit", Align::Left),
        ("walk", Align::Decimal),
        ("scatter", Align::Decimal),
        ("least seen", Align::Decimal),
    ];
    let caption = format!(
        "parameters after {} logs; a step is seen from the least size on",
        robot.logs.len()
    );
    let mut table = Table::new(&columns).caption(&caption);
    for p in &robot.parameters {
        let last = |x: &[Option<f64>]| x.last().copied().flatten().unwrap_or(f64::NAN);
        let (value, std) = number::value_and_std(last(&p.values), last(&p.std));
        table.row(vec![
            named(&p.name, p.joint.as_ref()),
            value,
            std,
            p.unit.clone(),
            number::significant(p.walk, 2),
            number::significant(p.scatter, 2),
            number::significant(p.least_seen.unwrap_or(f64::NAN), 2),
        ]);
    }
    table
}

/// The courses of one robot, those with changes first.
fn course(page: &mut Writer, robot: &TrackedRobot) {
    page.heading(&escape(&robot.name));
    let Some(first) = robot.parameters.first() else {
        return;
    };
    let span = match (first.times.first(), first.times.last()) {
        (Some(a), Some(b)) => b - a,
        _ => 0.0,
    };
    let numbered = first.times.iter().enumerate().all(|(k, t)| *t == k as f64);
    let (unit, seconds) = match span {
        _ if numbered => ("", 1.0),
        s if s > 2.0 * 86_400.0 => ("d", 86_400.0),
        s if s > 7200.0 => ("h", 3600.0),
        _ => ("s", 1.0),
    };
    let zero = match numbered {
        true => 0.0,
        false => first.times.first().copied().unwrap_or_default(),
    };
    let of =
        |p: &TrackedParameter, c: &&TrackedChange| (&c.parameter, &c.joint) == (&p.name, &p.joint);
    let changed = |p: &&TrackedParameter| robot.changes.iter().any(|c| of(p, &c));
    let (changes, steady): (Vec<_>, Vec<_>) = robot.parameters.iter().partition(changed);
    let panel = |p: &TrackedParameter| CoursePanel {
        name: named(&p.name, p.joint.as_ref()),
        unit: p.unit.clone(),
        times: p.times.iter().map(|t| (t - zero) / seconds).collect(),
        estimates: p.estimates.clone(),
        course: (p.values.iter().zip(&p.std))
            .map(|(x, std)| Some([(*x)?, (*std)?]))
            .collect(),
        changes: (robot.changes.iter().filter(|c| of(p, c)))
            .map(|c| (c.time - zero) / seconds)
            .collect(),
    };
    let figure = |what: &str, of: &[&TrackedParameter]| CourseFigure {
        title: format!(
            "{what} of {} over {} logs",
            escape(&robot.name),
            robot.logs.len()
        ),
        time_unit: unit.to_owned(),
        panels: of.iter().take(DRAWN).map(|p| panel(p)).collect(),
    };
    if !changes.is_empty() {
        page.figures(&figure("Parameters that changed", &changes).cells());
    }
    // a robot of one joint is seen at a glance, all courses of an arm are not
    let few = steady.len() <= AT_ONCE;
    let courses = figure("Parameters without a change", &steady).cells();
    match steady.as_slice() {
        [] => {}
        _ if few => page.figures(&courses),
        _ => page.folded(
            &format!("{} parameters without a change", steady.len()),
            &courses,
        ),
    }
}
