//! The report of `track`.

use crate::report::figure::{CourseFigure, CoursePanel};
use crate::report::sections::provenance;
use crate::report::table::{CellAlignment, Columns, Table};
use crate::report::words::of_joint;
use crate::report::{Report, Writer, words};
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
    let mut all = report.everywhere();
    all.verdict(&verdict(of), good);
    for table in [changes(of), fleet(of)] {
        if !table.is_empty() {
            all.table_apart(table);
        }
    }
    if let [robot] = of.robots.as_slice() {
        let mut writer = match robot.parameters.len() > MAX_PARAMETERS_ON_SCREEN {
            true => report.detail(),
            false => report.terminal(),
        };
        writer.table_apart(last(robot));
    }
    let mut page = report.page();
    page.paragraph(next(of));
    if let [robot] = of.robots.as_slice() {
        page.table(last(robot));
    }
    page.list(&of.notes);
    let mut robots: Vec<&TrackedRobot> = of.robots.iter().collect();
    robots.sort_by_key(|robot| robot.changes.is_empty());
    for robot in robots.into_iter().take(ROBOTS) {
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

/// The next step.
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

fn kind(kind: ChangeKind) -> &'static str {
    match kind {
        ChangeKind::Step => "step",
        ChangeKind::Ramp => "ramp",
    }
}

/// The verdict in words.
fn verdict(of: &Tracked) -> String {
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
    let sentence = |median: &f64| {
        let median = number::percent(*median);
        format!(
            " Changes smaller than {median} of the value, in the median over the parameters, could not be seen."
        )
    };
    least.get(least.len() / 2).map(sentence).unwrap_or_default()
}

/// The least change that could be seen, over the parameter.
fn relative_least(p: &TrackedParameter) -> Option<f64> {
    let last = p.values.iter().rev().flatten().next()?;
    (*last != 0.0).then(|| p.least_seen.map(|least| least / last.abs()))?
}

fn changes(of: &Tracked) -> Table {
    let all = of.robots.iter();
    let all = all.flat_map(|robot| robot.changes.iter().map(move |change| (robot, change)));
    Columns::new("changes", all)
        .words("robot", |(robot, _)| escape(&robot.name))
        .words("parameter", |(_, c)| {
            of_joint(&c.parameter, c.joint.as_deref())
        })
        .words("kind", |(_, c)| kind(c.kind))
        .words("log", |(robot, c)| escape(&robot.logs[c.log]))
        .estimates(["size", "std"], |(_, c)| (c.size, c.std))
        .words("unit", |(_, c)| &c.unit)
        .column(CellAlignment::Right, "change", |(_, c)| {
            words::percent(c.relative)
        })
        .into()
}

fn fleet(of: &Tracked) -> Table {
    let pair = |value: f64, std: f64| number::value_and_std(value, std);
    Columns::new("robots that differ from the others", &of.fleet)
        .words("robot", |one| escape(&one.robot))
        .words("parameter", |one| {
            of_joint(&one.parameter, one.joint.as_deref())
        })
        .numbers("value", |one| pair(one.value, one.std).0)
        .numbers("usual", |one| pair(one.usual, one.std).0)
        .numbers("std", |one| pair(one.value, one.std).1)
        .words("unit", |one| &one.unit)
        .into()
}

/// The parameters after the last log.
fn last(robot: &TrackedRobot) -> Table {
    let caption = format!(
        "parameters after {} logs; a step is seen from the least size on",
        robot.logs.len()
    );
    let last = |x: &[Option<f64>]| x.last().copied().flatten();
    Columns::new(&caption, &robot.parameters)
        .words("parameter", |p| of_joint(&p.name, p.joint.as_deref()))
        .estimates(["value", "std"], |p| (last(&p.values), last(&p.std)))
        .words("unit", |p| &p.unit)
        .digits("walk", 2, |p| p.walk)
        .digits("scatter", 2, |p| p.scatter)
        .digits("least seen", 2, |p| p.least_seen)
        .into()
}

/// The courses of one robot, those with changes first.
fn course(page: &mut Writer, robot: &TrackedRobot) {
    page.heading(&escape(&robot.name));
    let Some(first) = robot.parameters.first() else {
        return;
    };
    let [begin, end] = [first.times.first(), first.times.last()].map(|t| t.copied().unwrap_or(0.0));
    let numbered = first.times.iter().enumerate().all(|(k, t)| *t == k as f64);
    let (unit, seconds) = match end - begin {
        _ if numbered => ("", 1.0),
        s if s > 2.0 * 86_400.0 => ("d", 86_400.0),
        s if s > 7200.0 => ("h", 3600.0),
        _ => ("s", 1.0),
    };
    let zero = if numbered { 0.0 } else { begin };
    let of =
        |p: &TrackedParameter, c: &&TrackedChange| (&c.parameter, &c.joint) == (&p.name, &p.joint);
    let changed = |p: &&TrackedParameter| robot.changes.iter().any(|c| of(p, &c));
    let (changes, steady): (Vec<_>, Vec<_>) = robot.parameters.iter().partition(changed);
    let panel = |p: &TrackedParameter| CoursePanel {
        name: of_joint(&p.name, p.joint.as_deref()),
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
    let (name, logs) = (escape(&robot.name), robot.logs.len());
    let figure = |what: &str, of: &[&TrackedParameter]| CourseFigure {
        key: ["estimate of one log", "smoothed, 95 %"],
        title: format!("{what} of {name} over {logs} logs"),
        time_unit: unit.to_owned(),
        panels: of.iter().take(DRAWN).map(|p| panel(p)).collect(),
    };
    if !changes.is_empty() {
        page.figures(figure("Parameters that changed", &changes).cells());
    }
    // a robot of one joint is seen at a glance, all courses of an arm are not
    let courses = figure("Parameters without a change", &steady).cells();
    match steady.len() {
        0 => {}
        1..=AT_ONCE => page.figures(courses),
        many => page.folded(format!("{many} parameters without a change"), courses),
    }
}
