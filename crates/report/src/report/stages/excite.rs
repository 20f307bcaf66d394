//! The report of `excite`: a motion, judged before the robot moves.

use std::collections::BTreeSet;

use super::diagnose_words::DiagnosisWords;
use crate::report::figure::{MotionFigure, MotionPanel};
use crate::report::table::{Columns, Table, unbroken};
use crate::report::traces::{FigureTraces, LogTrace, TraceLine, TracePanel, TraceStyle};
use crate::report::words::{self, condition, listed};
use crate::report::{FigureTone, FoundLine, Report, VerdictFigure, VerdictHeadline, Writer};
use cft_ident_core::number;
use cft_ident_logs::log::escape;
use cft_ident_plant::excite::foresee::ExpectedEstimate;
use cft_ident_plant::excite::judgement::{LimitUse, MotionJudgement};
use cft_ident_plant::excite::limits::{BoundedQuantity, Quantity};
use cft_ident_plant::excite::machine::ForeseenRobot;
use cft_ident_plant::excite::motion::Motion;

/// Parts of the weakest direction that a terminal shows.
const PARTS: usize = 4;

/// The judgement of a motion; `path` names the trajectory, `name` is the same without folders.
pub fn excite(judged: &MotionJudgement, path: &str, name: &str) -> Report {
    let name = escape(name);
    let mut report = Report::new(&format!("Motion {name}"));
    let first = judged.first_words().into_iter();
    // numbers of the robot file are a caution, and no verdict
    let (urgent, others): (Vec<&str>, Vec<&str>) = first
        .filter(|words| !words.is_empty())
        .partition(|words| judged.torques_first || *words == judged.not_checked);
    // what nobody foresees comes before any figure of it
    let (unforeseen, urgent): (Vec<&str>, Vec<&str>) = urgent
        .into_iter()
        .partition(|words| *words != judged.not_checked);
    for described in unforeseen {
        report.everywhere().verdict(described, false);
    }
    verdict(judged, &name).write(&mut report.everywhere());
    for described in urgent {
        report.everywhere().verdict(described, false);
    }
    for described in others {
        report.everywhere().paragraph(described);
    }
    report.terminal().line("");
    report.terminal().table(limits(judged, path));
    report.page().table(limits(judged, &name));
    report.page().list(judged.broken());
    if let Some(text) = limits_of_logs(judged) {
        report.terminal().line("");
        report.everywhere().paragraph(&text);
    }
    report.terminal().line("");
    if judged.separates.is_some() {
        return report;
    }
    report.page().heading("Expected parameters");
    let rows = number::significant(judged.rows, 5);
    if let Some(law) = &judged.friction {
        let caption = format!("friction of {} expected from {rows} samples:", law.joint);
        let usual = law.usual_relative_std.as_deref();
        let usual = usual.map(|stds| ("usual ladder", stds.to_vec()));
        let table = expected(&caption, &law.parameters, usual);
        report.everywhere().table(table);
        return report;
    }
    let friction = match judged.friction_fitted {
        true => "fitted with them",
        false => "known",
    };
    let noise = judged.noise_source.words();
    report
        .page()
        .paragraph(&format!("Friction is {friction}; the noise is {noise}."));
    let together = judged.together.as_ref().map(|together| {
        let stds = together.parameters.iter().map(|p| p.relative_std);
        ("with given", stds.collect())
    });
    let caption =
        format!("expected from {rows} samples, friction {friction}; the noise is {noise}:");
    let table = expected(&caption, &judged.parameters, together);
    report.everywhere().table(table);
    report.terminal().line("");
    apart(&mut report, judged);
    if let Some(bands) = bands(judged) {
        report.terminal().paragraph(&bands);
    }
    report
}

/// Further parts of the page: the motion over time, its spectrum, and the warnings.
pub fn course(page: &mut Writer, judged: &MotionJudgement, figure: &MotionFigure) {
    page.heading("Positions, speeds and drives");
    page.traces(&traces(figure), figure.svg());
    spectrum(page, judged);
    if !judged.warnings.is_empty() {
        page.heading("Warnings");
        page.list(&judged.warnings);
    }
}

/// The nearest limit and the condition as figures, and whether every limit is kept.
fn verdict(judged: &MotionJudgement, name: &str) -> DiagnosisWords {
    let broken = judged.broken().len();
    let (grade, text) = match broken {
        0 if !judged.torques_foreseen => (
            "limits kept",
            "The motion keeps every limit that was checked; torques were not checked.".to_owned(),
        ),
        0 if judged.torques_first => (
            "limits kept",
            "The motion keeps every limit; its torques are a guess.".to_owned(),
        ),
        0 if judged.limits.iter().any(|l| l.from_logs && l.used > 1.0) => (
            "limits kept",
            "The motion keeps every limit of the robot file, and goes beyond what the logs reached."
                .to_owned(),
        ),
        0 => ("limits kept", "The motion keeps every limit.".to_owned()),
        1 => ("not safe", "The motion breaks a limit.".to_owned()),
        n => ("not safe", format!("The motion breaks {n} limits.")),
    };
    let figure = |label, value, tone| VerdictFigure { label, value, tone };
    let mut figures = Vec::new();
    let all = judged.limits.iter();
    if let Some(nearest) = all.max_by(|a, b| a.used.total_cmp(&b.used)) {
        let tone = if broken > 0 {
            FigureTone::Worse
        } else {
            FigureTone::Plain
        };
        let value = format!(
            "{} ({} {}{})",
            number::percent(nearest.used),
            nearest.name,
            nearest.quantity.called(&nearest.unit),
            if nearest.from_logs { ", logs" } else { "" }
        );
        figures.push(figure("nearest limit", value, tone));
    }
    if judged.friction.is_none() && judged.separates.is_none() {
        let scaled = condition(judged.condition.normalised);
        figures.push(figure("condition", scaled, FigureTone::Plain));
    }
    let seconds = format!("{} s", number::significant(judged.seconds, 4));
    figures.push(figure("time", seconds, FigureTone::Plain));
    let mut found = vec![FoundLine { grade, text }];
    if let Some(of) = &judged.separates {
        let deviations = number::significant(of.deviations, 2);
        figures.insert(
            0,
            figure(
                "separates by",
                format!("{deviations} std errors"),
                FigureTone::Plain,
            ),
        );
        found.push(FoundLine {
            grade: "separates",
            text: format!(
                "strokes of {} at {} amplitudes around a width of {} tell the two apart by {deviations} standard errors; \
                 {} comes nearest",
                of.joint,
                of.amplitudes.len(),
                number::significant(of.width, 3),
                of.from
            ),
        });
        return DiagnosisWords {
            headline: VerdictHeadline {
                figures,
                of: name.to_owned(),
            },
            found,
        };
    }
    DiagnosisWords {
        headline: VerdictHeadline {
            figures,
            of: format!("{name}; condition of the regressor with columns scaled"),
        },
        found,
    }
}

/// Which limits are those of the logs, and what they cost.
fn limits_of_logs(judged: &MotionJudgement) -> Option<String> {
    let own: Vec<&LimitUse> = judged.limits.iter().filter(|l| l.from_logs).collect();
    let nearest = own.iter().max_by(|a, b| a.used.total_cmp(&b.used))?;
    let named = own.iter().map(|limit| limit.quantity.called(&limit.unit));
    let kinds: BTreeSet<&str> = named.collect();
    let kinds: Vec<&str> = kinds.into_iter().collect();
    let [lower, upper] = [nearest.lower, nearest.upper].map(|x| number::significant(x, 3));
    let line = match nearest.quantity.called(&nearest.unit) {
        "position" => format!("position = [{lower}, {upper}]"),
        key => format!("{key} = {upper}"),
    };
    let gain = judged.lifted.as_ref().map(|lifted| {
        let pace = number::significant(lifted.pace, 2);
        let [least, median, most] = lifted.narrower.map(|x| number::significant(x, 2));
        format!(
            " Without them the other limits allow the same path {pace} times as fast, whose parameters are {median} times as \
             certain in the median ({least} to {most} times)."
        )
    });
    Some(format!(
        "The robot file gives no limit of {}: what the logs reached counts, marked (logs) in the table. To allow more, write \
         what the robot can do: the nearest is `{line}` under `[limits.{}]`.{}",
        kinds.join(", "),
        nearest.name,
        gain.unwrap_or_default()
    ))
}

fn limits(judged: &MotionJudgement, name: &str) -> Table {
    let value = |v: f64| number::significant(v, 4);
    let periods = judged.periods.map(|periods| format!(", {periods} periods"));
    let caption = format!(
        "{name}: condition {} ({} with columns scaled), {} s{}",
        words::significant(judged.condition.raw, 4),
        words::significant(judged.condition.normalised, 4),
        value(judged.seconds),
        periods.unwrap_or_default()
    );
    Columns::new(&caption, &judged.limits)
        .words("limit", |limit| {
            format!("{} {}", limit.name, limit.quantity.called(&limit.unit))
        })
        .numbers("from", |limit| value(limit.least))
        .numbers("to", |limit| value(limit.most))
        .words("allowed", |limit| {
            let of_logs = if limit.from_logs { " (logs)" } else { "" };
            match limit.upper.is_finite() {
                true => format!("{} .. {}{of_logs}", value(limit.lower), value(limit.upper)),
                false => format!("{} ..", value(limit.lower)),
            }
        })
        .words("unit", |limit| &limit.unit)
        .numbers("used", |limit| {
            let mark = if limit.broken { "  BROKEN" } else { "" };
            format!("{}{mark}", number::percent(limit.used))
        })
        .into()
}

/// Expected deviations, and the relative ones of `beside` in a column of their own.
fn expected(
    caption: &str,
    parameters: &[ExpectedEstimate],
    beside: Option<(&str, Vec<Option<f64>>)>,
) -> Table {
    let (name, stds) = beside.unwrap_or_default();
    Columns::new(caption, parameters.iter().enumerate())
        .words("parameter", |(_, p)| &p.name)
        .digits("value", 5, |(_, p)| p.value)
        .digits("std", 2, |(_, p)| p.std)
        .percent("relative", |(_, p)| p.relative_std)
        .when(!name.is_empty(), |t| {
            t.percent(name, |(k, _)| stds.get(k).copied().flatten())
        })
        .words("unit", |(_, p)| &p.unit)
        .into()
}

/// The combination of parameters that the motion separates least.
fn apart(report: &mut Report, judged: &MotionJudgement) {
    let parts = judged.weakest_direction.iter();
    let words = parts.clone().take(PARTS);
    let words = words.map(|part| format!("{:+.2} {}", part.weight, part.parameter));
    let words = words.collect::<Vec<_>>().join(" ");
    let line = format!("least certain combination: {words}");
    report.terminal().paragraph(&line);
    let large = parts.take_while(|part| part.weight.abs() > 0.1);
    let columns = Columns::new(
        "least certain combination, of columns scaled to norm 1",
        large,
    )
    .words("parameter", |part| &part.parameter)
    .words("part", |part| format!("{:+.2}", part.weight));
    report.page().table(columns);
    if let Some(pair) = &judged.confounded {
        let (first, second) = (&pair.first, &pair.second);
        let described = format!("{first} and {second}, correlation {:.2}", pair.correlation);
        let line = format!("most correlated: {described}");
        report.terminal().line(&line);
        let sentence = format!("Most correlated: {described}.");
        report.page().paragraph(&sentence);
    }
}

/// Where the power of the torques lies, of a series.
fn bands(judged: &MotionJudgement) -> Option<String> {
    let bands = judged.band.as_ref()?.iter().map(|band| {
        let hz = number::significant(band.torque_power_99_below_hz, 2);
        unbroken(&format!("{} {hz} Hz", band.joint))
    });
    Some(format!(
        "99 % of the torque's power lies below: {}",
        listed(bands)
    ))
}

fn traces(figure: &MotionFigure) -> FigureTraces {
    let panels = figure.rows.iter().flat_map(|(name, panels)| {
        panels.iter().map(move |panel| TracePanel {
            name: name.clone(),
            quantity: panel.quantity.clone(),
            unit: panel.unit.clone(),
            small: false,
            limits: panel.limits,
            lines: vec![TraceLine {
                name: "motion".into(),
                style: TraceStyle::Motion,
                values: panel.values.clone(),
            }],
        })
    });
    FigureTraces {
        label: "Positions, speeds and drives over time".into(),
        traces: vec![LogTrace {
            name: figure.title.clone(),
            t: figure.t.clone(),
            breaks: vec![0],
            panels: panels.collect(),
        }],
    }
}

/// Speed amplitudes by harmonic, and the band of the torque.
fn spectrum(page: &mut Writer, judged: &MotionJudgement) {
    let Some(spectrum) = &judged.spectrum else {
        return;
    };
    page.heading("Spectrum");
    let each = spectrum.iter().map(|row| row.speed_amplitudes.len());
    let mut columns = Columns::new("amplitude of the speed by harmonic", spectrum)
        .words("coordinate", |row| &row.coordinate)
        .words("unit", |row| &row.unit);
    for l in 0..each.max().unwrap_or(0) {
        columns = columns.words(&format!("{}", l + 1), |row| {
            let amplitude = row.speed_amplitudes.get(l);
            amplitude.map_or(String::new(), |a| number::significant(*a, 3))
        });
    }
    page.table(columns);
    if let Some(bands) = bands(judged) {
        page.paragraph(&format!("{bands}."));
    }
}

/// Samples of a line of the picture.
const POINTS: usize = 1500;

/// The picture of a motion.
pub fn figure(
    machine: &ForeseenRobot,
    motion: &Motion,
    judged: &MotionJudgement,
    title: &str,
) -> MotionFigure {
    let seconds = motion.seconds();
    let t = (0..=POINTS).map(|k| seconds * k as f64 / POINTS as f64);
    let t: Vec<f64> = t.collect();
    let state = |t: &f64| machine.state(&motion.at(*t)).ok();
    let states: Vec<_> = t.iter().map(state).collect();
    let panel = |kind: Quantity, (i, name): (usize, &str), unit: String| {
        let found = judged.limit(name, kind);
        let of = BoundedQuantity::symmetric(kind, i, "", "", 1.0);
        let value = |state| machine.quantities(state).of(&of);
        MotionPanel {
            quantity: kind.called(&unit).into(),
            unit,
            values: (states.iter())
                .map(|state| state.as_ref().map_or(f64::NAN, value))
                .collect(),
            limits: found
                .map(|limit: &LimitUse| [limit.lower, limit.upper])
                .filter(|limits| limits.iter().all(|limit| limit.is_finite())),
            used: (found.map(|limit| limit.used)).filter(|share| share.is_finite()),
        }
    };
    let row = |(i, name): (usize, String)| {
        let (unit, of) = (machine.coordinate_unit(i), (i, name.as_str()));
        let mut panels = vec![
            panel(Quantity::Position, of, unit.to_owned()),
            panel(Quantity::Speed, of, format!("{unit}/s")),
        ];
        if judged.torques_foreseen {
            panels.push(panel(Quantity::Drive, of, machine.drive_unit(i).to_owned()));
        }
        (name, panels)
    };
    let names = machine.coordinate_names().into_iter();
    let rows = names.enumerate().map(row).collect();
    let title = match judged.torques_foreseen {
        true => title.to_owned(),
        false => format!("{title} (torques are not foreseen)"),
    };
    MotionFigure { title, t, rows }
}
