//! The report of `compare`.

use crate::report::figure::{ErrorFigure, JointBars, OverlayFigure, OverlayPanel};
use crate::report::json::NO_WARNINGS;
use crate::report::sections::provenance;
use crate::report::sections::quality::{self, InspectedLog};
use crate::report::sections::torque::{self, TorqueDrawing};
use crate::report::table::{CellAlignment, Columns, Table};
use crate::report::traces::TraceStyle;
use crate::report::words::{listed, of_joint};
use crate::report::{Report, Writer, usual};
use cft_ident_core::number;
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::compare::{
    Difference, ParameterPair, SideBySide, UnpairedParameter, UnpairedReason,
};
use cft_ident_stages::identify::{Compared, DIFFERENT, FrictionCurves, TriedOnLogs};
use cft_ident_stages::replay::{ReplayedPair, is_beyond_curve, speeds};

/// Parameters that a screen has room for.
const MAX_PARAMETERS_ON_SCREEN: usize = 8;

/// The comparison; `logs` names the logs that both were tried on.
pub fn compare(of: &Compared, logs: &str) -> Report {
    let title = format!("{} and {}", of.name(0), of.name(1));
    let mut report = Report::new(&format!("Comparison of {title}"));
    let (names, letters) = (labels(of), LETTERS.map(str::to_owned));
    let legend = format!("A is {}, B is {}; ", names[0], names[1]);
    let all: Vec<&ParameterPair> = of.table.parameters.iter().collect();
    let parameters = parameter_table(&all, &letters, &legend);
    let mut everywhere = report.everywhere();
    everywhere.verdict(&words(of), of.notes.is_empty());
    if all.len() > MAX_PARAMETERS_ON_SCREEN {
        report.detail().table_apart(parameters);
        let mut differ = of.different();
        if !differ.is_empty() {
            differ.truncate(MAX_PARAMETERS_ON_SCREEN);
            let table = parameter_table(&differ, &letters, &legend);
            report.terminal().table_apart(table);
        }
    } else if !all.is_empty() {
        report.terminal().table_apart(parameters);
    }
    for table in apart_tables(&of.table, &names) {
        report.detail().table_apart(table);
    }
    if let Some(tried) = &of.tried {
        let mut terminal = report.terminal();
        terminal.table_apart(error_table(tried, logs, &letters));
        let mut page = report.page();
        page.figure(bars(of, tried, &names).svg());
        page.list(&of.notes);
        page.table(error_table(tried, logs, &names));
        used_before(&mut page, of, &tried.in_memory.inputs);
    } else {
        report.page().list(&of.notes);
    }
    let mut page = report.page();
    page.heading("Parameters");
    page.table_if_any(parameter_table(&all, &names, ""));
    for table in apart_tables(&of.table, &names) {
        page.table(table);
    }
    report
}

/// Further parts of the page; `read` are both model files and the logs, `replayed` is absent where
/// no log is given.
pub fn pictures(
    page: &mut Writer,
    of: &Compared,
    read: &[Provenance],
    replayed: Option<&ReplayedPair>,
    quality: &[InspectedLog],
    command: &str,
) {
    if !of.curves.is_empty() {
        page.heading("Friction");
        page.figures(figure(of, replayed).cells());
    }
    if let Some(replayed) = replayed {
        let [a, b] = labels(of);
        let drawn = |name: String, style| TorqueDrawing {
            names: [name.clone().into(), format!("residual of {name}").into()],
            styles: [style, style],
        };
        let models = [drawn(a, TraceStyle::Before), drawn(b, TraceStyle::After)];
        let title = replayed.logs.join(", ");
        torque::section(page, &of.setup, &replayed.torque, &models, &title);
        quality::section(page, quality, &NO_WARNINGS);
    }
    let summary = of.tried.as_ref().map(|tried| &tried.in_memory.summary);
    let inputs = of.sides.each_ref();
    let mut made_from = inputs
        .map(|side| &*side.given.file.provenance.inputs)
        .concat();
    made_from.dedup();
    provenance::section(page, &of.setup.file, read, &made_from, summary, command);
}

/// Friction of both over each other: a curve over velocity, or along the logs where effects make it depend on
/// more; of such a model without logs the declared law alone.
pub fn figure(of: &Compared, replayed: Option<&ReplayedPair>) -> OverlayFigure {
    let names = of.setup.robot.joint_names();
    let panel = |shown: &FrictionCurves| {
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
            of_joint(&most.name, most.joint.as_deref())
        );
    }
    text.push('.');
    text
}

/// Which model is closer on the logs, in a sentence.
fn closer(tried: &TriedOnLogs, names: &[String; 2]) -> String {
    let error = |k: usize| number::percent(tried.validations[k].errors.overall.mean_relative_error);
    let sign = tried.differences.overall.sign();
    let [first, second] = if sign == -1 { [1, 0] } else { [0, 1] };
    let closer = match sign {
        0 => "These logs do not show which model is closer".to_owned(),
        _ => format!("{} is closer on these logs", names[first]),
    };
    format!(
        "{closer}: {} misses {} of the torque (rms over the joints), {} {}.",
        names[first],
        error(first),
        names[second],
        error(second)
    )
}

/// Errors of both joint by joint as bars.
fn bars(of: &Compared, tried: &TriedOnLogs, names: &[String; 2]) -> ErrorFigure {
    let [a, b] = tried.validations.each_ref().map(|v| &v.errors.joints);
    let joints = a.iter().zip(b).map(|(a, b)| JointBars {
        joint: a.joint.clone(),
        before: Some(a.relative_error.into()),
        after: b.relative_error.into(),
    });
    ErrorFigure {
        title: "Relative torque error on these logs".to_owned(),
        names: names.clone(),
        joints: joints.collect(),
        limit: None,
        usual: Some(usual::drawn(of.setup.file.log.torque_is)),
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

/// Parameters that both have under the `heads` of both, which `legend` explains.
pub(super) fn parameter_table(
    parameters: &[&ParameterPair],
    [a, b]: &[String; 2],
    legend: &str,
) -> Table {
    let difference = format!("{b} - {a}");
    let caption =
        format!("parameters: {legend}{difference} in standard deviations of the difference");
    let joints = parameters.iter().any(|p| p.joint.is_some());
    Columns::new(&caption, parameters)
        .when(joints, |t| {
            t.words("joint", |p| p.joint.as_deref().unwrap_or(""))
        })
        .words("parameter", |p| &p.name)
        .estimates([a, "std"], |p| (p.a.value, p.a.std))
        .estimates([b, "std"], |p| (p.b.value, p.b.std))
        .numbers(&difference, |p| match p.deviation {
            Some(d) if d.abs() < 1000.0 => format!("{d:+.1}"),
            Some(d) => format!("{d:+.1e}"),
            None => number::ABSENT.into(),
        })
        .words("unit", |p| &p.unit)
        .into()
}

/// Parameters that one side has alone, a table of each side that has some.
pub(super) fn apart_tables(of: &SideBySide, names: &[String; 2]) -> impl Iterator<Item = Table> {
    let sides = names.iter().zip([&of.only_in_a, &of.only_in_b]);
    let sides = sides.filter(|(_, only)| !only.is_empty());
    sides.map(|(name, only)| apart_table(only, name))
}

fn apart_table(only: &[UnpairedParameter], name: &str) -> Table {
    let reasons = only.iter().any(|p| p.reason != UnpairedReason::Absent);
    Columns::new(&format!("only in {name}"), only)
        .words("joint", |p| p.joint.as_deref().unwrap_or(""))
        .words("parameter", |p| &p.name)
        .estimates(["value", "std"], |p| (p.value, p.std))
        .words("unit", |p| &p.unit)
        .when(reasons, |t| {
            t.words("in the other", |p| match p.reason {
                UnpairedReason::Absent => "absent",
                UnpairedReason::OtherUnit => "in another unit",
                UnpairedReason::OtherMeaning => "of another meaning",
            })
        })
        .into()
}

/// Errors of a joint, or of all, by both models.
struct BothErrors<'a> {
    joint: &'a str,
    relative: [f64; 2],
    difference: &'a Difference,
    rms: [String; 2],
    unit: &'static str,
}

/// Errors of both on the same logs, under the heads of both.
fn error_table(tried: &TriedOnLogs, logs: &str, [head_a, head_b]: &[String; 2]) -> Table {
    let [a, b] = tried.validations.each_ref().map(|v| &v.errors);
    let joints = a
        .joints
        .iter()
        .zip(&b.joints)
        .zip(&tried.differences.joints);
    let joints = joints.map(|((a, b), difference)| BothErrors {
        joint: &a.joint,
        relative: [a.relative_error, b.relative_error],
        difference,
        rms: [a.rmse, b.rmse].map(|e| number::significant(e, 3)),
        unit: a.unit,
    });
    let overall = BothErrors {
        joint: "all",
        relative: [a, b].map(|errors| errors.overall.mean_relative_error),
        difference: &tried.differences.overall,
        rms: [String::new(), String::new()],
        unit: "",
    };
    let overall = Some(overall).filter(|_| a.joints.len() > 1);
    let rows: Vec<BothErrors> = joints.chain(overall).collect();
    let hundred = number::hundredths;
    Columns::new(
        &format!("relative torque error of {logs} [%], and its rms"),
        &rows,
    )
    .words("joint", |of| of.joint)
    .numbers(head_a, |of| hundred(of.relative[0]))
    .numbers(head_b, |of| hundred(of.relative[1]))
    .numbers(&format!("{head_b} - {head_a}"), |of| {
        hundred(of.difference.difference)
    })
    .column(CellAlignment::Right, "95 % CI", |of| {
        match of.difference.interval_95 {
            Some([low, high]) => format!("{}..{}", hundred(low), hundred(high)),
            None => number::ABSENT.to_owned(),
        }
    })
    .numbers(&format!("rms {head_a}"), |of| &of.rms[0])
    .numbers(&format!("rms {head_b}"), |of| &of.rms[1])
    .words("unit", |of| of.unit)
    .words("closer", |of| match of.difference.sign() {
        -1 => head_b,
        1 => head_a,
        _ => number::ABSENT,
    })
    .into()
}

/// A log that one of the models was made from favours that model.
fn used_before(page: &mut Writer, of: &Compared, inputs: &[Provenance]) {
    for (name, side) in labels(of).iter().zip(&of.sides) {
        let made_from = &side.given.file.provenance.inputs;
        let known = |i: &&Provenance| {
            let mut made = made_from.iter().filter(|m| m.made());
            made.any(|m| m.shares_rows(i))
        };
        let names = listed(inputs.iter().filter(known).map(|i| escape(&i.name)));
        if !names.is_empty() {
            let text = format!("{names} was used to make {name}: it favours {name}.");
            page.verdict(&text, false);
        }
    }
}
