//! The report of `compare`.

use crate::report::figure::{ErrorBar, ErrorFigure, JointBars, OverlayFigure, OverlayPanel};
use crate::report::sections::provenance;
use crate::report::sections::quality::{self, Inspected};
use crate::report::sections::torque::{self, Drawn};
use crate::report::table::{Align, Table};
use crate::report::{Report, TraceStyle, Writer, usual};
use cft_ident_core::number;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::compare::{
    Apart, Difference, ParameterEstimate, ParameterPair, Reason, SideBySide,
};
use cft_ident_stages::identify::{Compared, Curves, DIFFERENT, TriedOnLogs};
use cft_ident_stages::replay::{ReplayedPair, is_beyond_curve, speeds};

/// Parameters that a screen has room for.
const MAX_PARAMETERS_ON_SCREEN: usize = 8;

/// The comparison; `logs` names the logs that both were tried on.
pub fn compare(of: &Compared, logs: &str) -> Report {
    let title = format!("{} and {}", of.name(0), of.name(1));
    let mut report = Report::new(&format!("Comparison of {title}"));
    let (names, letters) = (labels(of), LETTERS.map(str::to_owned));
    let legend = format!("A is {}, B is {}; ", names[0], names[1]);
    let apart = || apart_tables(&of.table, &names);
    let all = &of.table.parameters;
    let table = |heads: &[String; 2], legend: &str| {
        (!all.is_empty()).then(|| parameter_table(all.iter(), heads, legend))
    };
    let parameters = table(&letters, &legend);
    report
        .everywhere()
        .verdict(&words(of), of.warnings.is_empty());
    if let Some(table) = parameters
        .clone()
        .filter(|_| of.table.parameters.len() > MAX_PARAMETERS_ON_SCREEN)
    {
        report.detail().line("");
        report.detail().table(table);
        let differ = of.different();
        if !differ.is_empty() {
            let table = parameter_table(
                differ.into_iter().take(MAX_PARAMETERS_ON_SCREEN),
                &letters,
                &legend,
            );
            report.terminal().line("");
            report.terminal().table(table);
        }
    } else if let Some(table) = parameters.clone() {
        report.terminal().line("");
        report.terminal().table(table);
    }
    for table in apart() {
        report.detail().line("");
        report.detail().table(table);
    }
    if let Some(tried) = &of.tried {
        report.terminal().line("");
        report.terminal().table(error_table(tried, logs, &letters));
        let mut page = report.page();
        page.figure(&bars(of, tried, &names).svg());
        page.list(&of.warnings);
        page.table(error_table(tried, logs, &names));
        used_before(&mut page, of, &tried.in_memory.inputs);
    } else {
        report.page().list(&of.warnings);
    }
    let mut page = report.page();
    page.heading("Parameters");
    for table in table(&names, "").into_iter().chain(apart()) {
        page.table(table);
    }
    report
}

/// What a page has room for besides; `read` are both model files and the logs, `replayed` is absent where
/// no log is given.
pub fn pictures(
    page: &mut Writer,
    of: &Compared,
    read: &[Provenance],
    replayed: Option<&ReplayedPair>,
    quality: &[Inspected],
    command: &str,
) {
    if !of.curves.is_empty() {
        page.heading("Friction");
        page.figures(&figure(of, replayed).cells());
    }
    if let Some(replayed) = replayed {
        let [a, b] = labels(of);
        let drawn = |name: String, style| Drawn {
            names: [name.clone().into(), format!("residual of {name}").into()],
            styles: [style, style],
        };
        let models = [drawn(a, TraceStyle::Before), drawn(b, TraceStyle::After)];
        let title = replayed.logs.join(", ");
        torque::section(page, &of.machine, &replayed.torque, &models, &title);
        quality::section(page, quality, &[]);
    }
    let summary = of.tried.as_ref().map(|tried| &tried.in_memory.summary);
    let made_from = of.sides.iter();
    let made_from = made_from.flat_map(|side| side.given.file.provenance.inputs.iter().cloned());
    let mut made_from: Vec<Provenance> = made_from.collect();
    made_from.dedup();
    provenance::section(page, &of.machine.file, read, &made_from, summary, command);
}

/// Friction of both over each other: a curve over velocity, or along the logs where effects make it depend on
/// more; of such a model without logs the declared law alone.
pub fn figure(of: &Compared, replayed: Option<&ReplayedPair>) -> OverlayFigure {
    let names = of.machine.robot.joint_names();
    let panel = |shown: &Curves| {
        let speeds: Vec<f64> = speeds(shown.most).collect();
        let mut curves = of.at(shown, speeds.into_iter());
        let joint = names.iter().position(|name| *name == shown.joint);
        let clouds = [0, 1].map(|k| {
            let rows = replayed.and_then(|pair| pair.friction[k].as_ref());
            let (Some(rows), Some(j)) = (rows, joint) else {
                return Vec::new();
            };
            if !is_beyond_curve(&of.sides[k].model, j) {
                return Vec::new();
            }
            curves[k].clear();
            rows[j].iter().map(|[v, _, model]| [*v, *model]).collect()
        });
        OverlayPanel {
            joint: shown.joint.clone(),
            speed_unit: shown.speed_unit.clone(),
            torque_unit: shown.torque_unit.clone(),
            curves,
            clouds,
        }
    };
    let range = match of.curves.first().map(|c| c.speeds_from) {
        Some("logs") => "up to the fastest of the logs",
        Some("limits") => "up to the speed limit",
        _ => "speeds assumed, no log is given",
    };
    let declared = match replayed {
        None if of.sides.iter().any(|side| !side.model.effects.is_empty()) => {
            ", without their effects"
        }
        _ => "",
    };
    OverlayFigure {
        title: format!("Friction of two models{declared}, {range}"),
        names: labels(of),
        panels: of.curves.iter().map(panel).collect(),
    }
}

/// The verdict in words.
fn words(of: &Compared) -> String {
    let rated = of.table.parameters.iter().filter(|p| p.deviation.is_some());
    let (rated, different) = (rated.count(), of.different());
    let closer = of.tried.as_ref().map(|tried| closer(tried, &labels(of)));
    if rated == 0 {
        return closer
            .unwrap_or_else(|| "No parameter of both has a known uncertainty.".to_owned());
    }
    let mut text = closer.map_or(String::new(), |closer| closer + " ");
    text += &format!(
        "{} of {rated} parameters with known uncertainty differ by more than {DIFFERENT} \
         standard deviations",
        different.len()
    );
    if let Some(most) = different.first() {
        text += &format!(
            "; the most by {} of {}",
            number::significant(most.deviation.unwrap_or(f64::NAN).abs(), 3),
            key(&most.name, most.joint.as_deref())
        );
    }
    text.push('.');
    text
}

/// Which model is closer on the logs, in a sentence.
fn closer(tried: &TriedOnLogs, names: &[String; 2]) -> String {
    let error = |k: usize| number::percent(tried.validations[k].errors.overall.mean_relative_error);
    let both = |first: usize| {
        let second = 1 - first;
        format!(
            "{} misses {} of the torque (rms over the joints), {} {}",
            names[first],
            error(first),
            names[second],
            error(second)
        )
    };
    match tried.differences.overall.sign() {
        -1 => format!("{} is closer on these logs: {}.", names[1], both(1)),
        1 => format!("{} is closer on these logs: {}.", names[0], both(0)),
        _ => format!("These logs do not show which model is closer: {}.", both(0)),
    }
}

/// Errors of both joint by joint as bars.
fn bars(of: &Compared, tried: &TriedOnLogs, names: &[String; 2]) -> ErrorFigure {
    let [a, b] = tried.validations.each_ref().map(|v| &v.errors.joints);
    let bar = |error: f64| ErrorBar {
        error,
        interval_95: None,
    };
    let joints = a.iter().zip(b).map(|(a, b)| JointBars {
        joint: a.joint.clone(),
        before: Some(bar(a.relative_error)),
        after: bar(b.relative_error),
    });
    ErrorFigure {
        title: "Relative torque error on these logs".to_owned(),
        names: names.clone(),
        joints: joints.collect(),
        limit: None,
        usual: Some(usual::drawn(of.machine.file.log.torque_is)),
    }
}

/// Names of the files, apart from each other.
fn labels(of: &Compared) -> [String; 2] {
    let names = [of.name(0), of.name(1)];
    match names[0] == names[1] {
        true => [(0, "first"), (1, "second")].map(|(k, word)| format!("{} ({word})", names[k])),
        false => names,
    }
}

pub(super) const LETTERS: [&str; 2] = ["A", "B"];

pub(super) fn key(name: &str, joint: Option<&str>) -> String {
    match joint {
        Some(joint) => format!("{} of {}", escape(name), escape(joint)),
        None => escape(name),
    }
}

/// Parameters that both have under the `heads` of both, which `legend` explains.
pub(super) fn parameter_table<'a>(
    parameters: impl Iterator<Item = &'a ParameterPair> + Clone,
    [a, b]: &[String; 2],
    legend: &str,
) -> Table {
    let difference = format!("{b} - {a}");
    let joints = parameters.clone().any(|p| p.joint.is_some());
    let mut columns = vec![("parameter", Align::Left)];
    if joints {
        columns.insert(0, ("joint", Align::Left));
    }
    columns.extend([
        (a.as_str(), Align::Decimal),
        ("std", Align::Decimal),
        (b.as_str(), Align::Decimal),
        ("std", Align::Decimal),
        (difference.as_str(), Align::Decimal),
        ("unit", Align::Left),
    ]);
    let mut table = Table::new(&columns).caption(&format!(
        "parameters: {legend}{difference} in standard deviations of the difference"
    ));
    for p in parameters {
        let cells = |e: &ParameterEstimate| {
            let (value, std) = number::value_and_std(e.value, e.std.unwrap_or(f64::NAN));
            [value, std]
        };
        let mut row = vec![p.name.clone()];
        if joints {
            row.insert(0, p.joint.clone().unwrap_or_default());
        }
        row.extend(cells(&p.a));
        row.extend(cells(&p.b));
        row.push(match p.deviation {
            Some(d) if d.abs() < 1000.0 => format!("{d:+.1}"),
            Some(d) => format!("{d:+.1e}"),
            None => number::ABSENT.into(),
        });
        row.push(p.unit.clone());
        table.row(row);
    }
    table
}

/// Parameters that one side has alone, a table of each side that has some.
pub(super) fn apart_tables(of: &SideBySide, names: &[String; 2]) -> impl Iterator<Item = Table> {
    let only = [&of.only_in_a, &of.only_in_b];
    let sides = names.iter().zip(only);
    let tables = sides.filter_map(|(name, only)| apart_table(only, name));
    tables.collect::<Vec<_>>().into_iter()
}

fn apart_table(only: &[Apart], name: &str) -> Option<Table> {
    if only.is_empty() {
        return None;
    }
    let caption = format!("only in {name}");
    let mut columns = vec![
        ("joint", Align::Left),
        ("parameter", Align::Left),
        ("value", Align::Decimal),
        ("std", Align::Decimal),
        ("unit", Align::Left),
    ];
    let reasons = only.iter().any(|p| p.reason != Reason::Absent);
    if reasons {
        columns.push(("in the other", Align::Left));
    }
    let mut table = Table::new(&columns).caption(&caption);
    for p in only {
        let (value, std) = number::value_and_std(p.value, p.std.unwrap_or(f64::NAN));
        let reason = match p.reason {
            Reason::Absent => "absent",
            Reason::OtherUnit => "in another unit",
            Reason::OtherMeaning => "of another meaning",
        };
        let joint = p.joint.as_deref().unwrap_or("");
        // a table takes as many cells as it has columns
        table.row([joint, &p.name, &value, &std, &p.unit, reason]);
    }
    Some(table)
}

/// Errors of both on the same logs, under the heads of both.
fn error_table(tried: &TriedOnLogs, logs: &str, [head_a, head_b]: &[String; 2]) -> Table {
    let difference = format!("{head_b} - {head_a}");
    let rms = [head_a, head_b].map(|head| format!("rms {head}"));
    let mut table = Table::new(&[
        ("joint", Align::Left),
        (head_a, Align::Decimal),
        (head_b, Align::Decimal),
        (&difference, Align::Decimal),
        ("95 % CI", Align::Right),
        (&rms[0], Align::Decimal),
        (&rms[1], Align::Decimal),
        ("unit", Align::Left),
        ("closer", Align::Left),
    ])
    .caption(&format!("relative torque error of {logs} [%], and its rms"));
    let hundred = number::hundredths;
    let cells = |a: f64, b: f64, d: &Difference| {
        let interval = d
            .interval_95
            .map_or(number::ABSENT.to_owned(), |[low, high]| {
                format!("{}..{}", hundred(low), hundred(high))
            });
        [hundred(a), hundred(b), hundred(d.difference), interval]
    };
    let closer = |d: &Difference| match d.sign() {
        -1 => head_b.as_str(),
        1 => head_a.as_str(),
        _ => number::ABSENT,
    };
    let [a, b] = tried.validations.each_ref().map(|v| &v.errors);
    let described = a
        .joints
        .iter()
        .zip(&b.joints)
        .zip(&tried.differences.joints);
    for ((a, b), d) in described {
        let [ours, theirs, difference, interval] = cells(a.relative_error, b.relative_error, d);
        let rms = [a.rmse, b.rmse].map(|e| number::significant(e, 3));
        let unit = a.unit;
        let row = [
            &a.joint,
            &ours,
            &theirs,
            &difference,
            &interval,
            &rms[0],
            &rms[1],
            unit,
            closer(d),
        ];
        table.row(row);
    }
    if a.joints.len() > 1 {
        let d = &tried.differences.overall;
        let [a, b] = [a, b].map(|v| v.overall.mean_relative_error);
        let [ours, theirs, difference, interval] = cells(a, b, d);
        table.row([
            "all",
            &ours,
            &theirs,
            &difference,
            &interval,
            "",
            "",
            "",
            closer(d),
        ]);
    }
    table
}

/// A log that one of the models was made from favours that model.
fn used_before(page: &mut Writer, of: &Compared, inputs: &[Provenance]) {
    for (name, side) in labels(of).iter().zip(&of.sides) {
        let made_from = &side.given.file.provenance.inputs;
        let known = |i: &&Provenance| {
            let mut made = made_from.iter().filter(|m| m.made());
            made.any(|m| m.shares_rows(i))
        };
        let names: Vec<String> = inputs
            .iter()
            .filter(known)
            .map(|i| escape(&i.name))
            .collect();
        if !names.is_empty() {
            page.verdict(
                &format!(
                    "{} was used to make {name}: it favours {name}.",
                    names.join(", ")
                ),
                false,
            );
        }
    }
}
