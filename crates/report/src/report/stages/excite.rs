//! The report of `excite`: a motion, judged before the robot moves.

use crate::report::figure::{MotionFigure, MotionPanel};
use crate::report::table::{Align, Table, unbroken};
use crate::report::{Report, Trace, TraceLine, TracePanel, TraceStyle, Traces, Writer};
use cft_ident_core::number;
use cft_ident_logs::log::escape;
use cft_ident_plant::excite::foresee::Expected;
use cft_ident_plant::excite::judgement::{Judgement, LimitUse};
use cft_ident_plant::excite::limits::{BoundedQuantity, Quantity};
use cft_ident_plant::excite::machine::ForeseenRobot;
use cft_ident_plant::excite::motion::Motion;

/// Parts of the weakest direction that a terminal shows.
const PARTS: usize = 4;

/// The judgement of a motion; `path` names the trajectory, `name` is the same without folders.
pub fn excite(judged: &Judgement, path: &str, name: &str) -> Report {
    let name = escape(name);
    let mut report = Report::new(&format!("Motion {name}"));
    let (text, good) = words(judged);
    for described in judged.first_words() {
        report.terminal().paragraph(described);
        // numbers of the robot file are a caution, and no verdict
        if judged.torques_first || described == judged.not_checked {
            report.brief().verdict(described, false);
        }
    }
    if judged.torques_first {
        report.page().paragraph(&judged.torques);
    }
    report.brief().verdict(&text, good);
    report.page().verdict(&text, good);
    report.page().paragraph(&judged.not_checked);
    if !judged.torques_first {
        report.page().paragraph(&judged.torques);
    }
    report.terminal().table(limits(judged, path));
    report.page().table(limits(judged, &name));
    report.page().list(judged.broken());
    report.terminal().line("");
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
    report
        .page()
        .paragraph(match judged.torques_foreseen {
            true => "Friction is taken as known; the noise is that of the robot file.",
            false => "Friction is taken as known; the noise is that of the robot file, or 1 N or N m in every sample where it gives none.",
        });
    let together = judged.together.as_ref().map(|together| {
        let stds = together.parameters.iter().map(|p| p.relative_std);
        ("with given", stds.collect())
    });
    let caption = format!("expected from {rows} samples, friction known:");
    let table = expected(&caption, &judged.parameters, together);
    report.everywhere().table(table);
    report.terminal().line("");
    apart(&mut report, judged);
    if let Some(bands) = bands(judged) {
        report.terminal().paragraph(&bands);
    }
    report
}

/// What a page has room for besides: the motion over time, its spectrum, and the warnings.
pub fn course(page: &mut Writer, judged: &Judgement, figure: &MotionFigure) {
    page.heading("Positions, speeds and drives");
    page.traces(&traces(figure), &figure.svg());
    spectrum(page, judged);
    if !judged.warnings.is_empty() {
        page.heading("Warnings");
        page.list(&judged.warnings);
    }
}

fn words(judged: &Judgement) -> (String, bool) {
    let broken = judged.broken().len();
    let mut text = match broken {
        0 if judged.torques_foreseen => "The motion keeps every limit.".to_owned(),
        0 => "The motion keeps every limit that was checked; none of torque was.".to_owned(),
        1 => "The motion breaks a limit.".to_owned(),
        n => format!("The motion breaks {n} limits."),
    };
    let all = judged.limits.iter();
    let nearest = all.max_by(|a, b| a.used.total_cmp(&b.used));
    if let Some(nearest) = nearest.filter(|_| broken == 0) {
        text += &format!(
            " It comes nearest to that of {} ({}), of which it uses {}.",
            nearest.name,
            nearest.quantity.called(&nearest.unit),
            number::percent(nearest.used)
        );
    }
    if judged.friction.is_none() {
        let condition = &judged.condition;
        let shown = |c: Option<f64>| c.map_or("infinite".to_owned(), |c| number::significant(c, 4));
        text += &format!(
            " Condition of the regressor: {}, {} with columns scaled.",
            shown(condition.raw),
            shown(condition.normalised)
        );
    }
    (text, broken == 0)
}

fn limits(judged: &Judgement, name: &str) -> Table {
    let shown =
        |value: Option<f64>| value.map_or(number::ABSENT.into(), |v| number::significant(v, 4));
    let condition = &judged.condition;
    let periods = match judged.periods {
        Some(periods) => format!(", {periods} periods"),
        None => String::new(),
    };
    let caption = format!(
        "{name}: condition {} ({} with columns scaled), {} s{periods}",
        shown(condition.raw),
        shown(condition.normalised),
        number::significant(judged.seconds, 4),
    );
    let mut table = Table::new(&[
        ("limit", Align::Left),
        ("from", Align::Decimal),
        ("to", Align::Decimal),
        ("allowed", Align::Left),
        ("unit", Align::Left),
        ("used", Align::Decimal),
    ])
    .caption(&caption);
    for limit in &judged.limits {
        let value = |v: f64| number::significant(v, 4);
        let allowed = if limit.upper.is_finite() {
            format!("{} .. {}", value(limit.lower), value(limit.upper))
        } else {
            format!("{} ..", value(limit.lower))
        };
        let mark = if limit.broken { "  BROKEN" } else { "" };
        table.row([
            &format!("{} {}", limit.name, limit.quantity.called(&limit.unit)),
            &value(limit.least),
            &value(limit.most),
            &allowed,
            &limit.unit,
            &format!("{}{mark}", number::percent(limit.used)),
        ]);
    }
    table
}

/// Expected deviations, and the relative ones of `beside` in a column of their own.
fn expected(
    caption: &str,
    parameters: &[Expected],
    beside: Option<(&str, Vec<Option<f64>>)>,
) -> Table {
    let mut columns = vec![
        ("parameter", Align::Left),
        ("value", Align::Decimal),
        ("std", Align::Decimal),
        ("relative", Align::Decimal),
        ("unit", Align::Left),
    ];
    if let Some((name, _)) = &beside {
        columns.insert(4, (name, Align::Decimal));
    }
    let relative = |std: Option<f64>| std.map_or(number::ABSENT.into(), number::percent);
    let mut table = Table::new(&columns).caption(caption);
    for (k, p) in parameters.iter().enumerate() {
        let std = p.std.map(|s| number::significant(s, 2));
        let mut row = vec![
            p.name.clone(),
            p.value
                .map_or(number::ABSENT.into(), |v| number::significant(v, 5)),
            std.unwrap_or(number::ABSENT.into()),
            relative(p.relative_std),
        ];
        if let Some((_, stds)) = &beside {
            row.push(relative(stds.get(k).copied().flatten()));
        }
        row.push(p.unit.clone());
        table.row(row);
    }
    table
}

/// What the motion hardly separates.
fn apart(report: &mut Report, judged: &Judgement) {
    let parts = &judged.weakest_direction;
    let words: Vec<String> = parts
        .iter()
        .take(PARTS)
        .map(|part| format!("{:+.2} {}", part.weight, part.parameter))
        .collect();
    report
        .terminal()
        .line(&format!("weakest direction: {}", words.join(" ")));
    let rows = parts
        .iter()
        .take_while(|part| part.weight.abs() > 0.1)
        .map(|part| vec![part.parameter.clone(), format!("{:+.2}", part.weight)])
        .collect();
    report.page().rows(
        "weakest direction, of columns scaled to norm 1",
        &["parameter", "part"],
        rows,
    );
    if let Some(pair) = &judged.confounded {
        let (first, second) = (&pair.first, &pair.second);
        let described = format!("{first} and {second}, correlation {:.2}", pair.correlation);
        report
            .terminal()
            .line(&format!("most correlated: {described}"));
        report
            .page()
            .paragraph(&format!("Most correlated: {described}."));
    }
}

/// Where the power of the torques lies, of a series.
fn bands(judged: &Judgement) -> Option<String> {
    let bands: Vec<String> = judged
        .band
        .as_ref()?
        .iter()
        .map(|band| {
            let hz = number::significant(band.torque_power_99_below_hz, 2);
            unbroken(&format!("{} {hz} Hz", band.joint))
        })
        .collect();
    let described = bands.join(", ");
    Some(format!(
        "99 % of the torque's power lies below: {described}"
    ))
}

fn traces(figure: &MotionFigure) -> Traces {
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
    Traces {
        label: "Positions, speeds and drives over time".into(),
        traces: vec![Trace {
            name: figure.title.clone(),
            t: figure.t.clone(),
            breaks: vec![0],
            panels: panels.collect(),
        }],
    }
}

/// Speed amplitudes by harmonic, and the band of the torque.
fn spectrum(page: &mut Writer, judged: &Judgement) {
    let Some(spectrum) = &judged.spectrum else {
        return;
    };
    page.heading("Spectrum");
    let each = spectrum.iter().map(|row| row.speed_amplitudes.len());
    let harmonics = each.max().unwrap_or(0);
    let head: Vec<String> = ["coordinate".to_owned(), "unit".to_owned()]
        .into_iter()
        .chain((1..=harmonics).map(|l| format!("{l}")))
        .collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let rows = spectrum
        .iter()
        .map(|row| {
            let values = row.speed_amplitudes.iter();
            let values = values.map(|a| number::significant(*a, 3));
            let names = [row.coordinate.clone(), row.unit.clone()];
            names.into_iter().chain(values).collect()
        })
        .collect();
    page.rows("amplitude of the speed by harmonic", &head, rows);
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
    judged: &Judgement,
    title: &str,
) -> MotionFigure {
    let seconds = motion.seconds();
    let t: Vec<f64> = (0..=POINTS)
        .map(|k| seconds * k as f64 / POINTS as f64)
        .collect();
    let states: Vec<_> = t
        .iter()
        .map(|t| machine.state(&motion.at(*t)).ok())
        .collect();
    let panel = |kind: Quantity, (i, name): (usize, &str), unit: String| {
        let found = judged.limit(name, kind);
        let of = BoundedQuantity::symmetric(kind, i, "", "", 1.0);
        let value = |state| machine.quantities(state).of(&of);
        MotionPanel {
            quantity: kind.called(&unit).into(),
            unit,
            values: states
                .iter()
                .map(|state| state.as_ref().map_or(f64::NAN, value))
                .collect(),
            limits: found
                .map(|limit: &LimitUse| [limit.lower, limit.upper])
                .filter(|[lower, upper]| lower.is_finite() && upper.is_finite()),
            used: found
                .map(|limit| limit.used)
                .filter(|share| share.is_finite()),
        }
    };
    let rows = machine
        .coordinate_names()
        .into_iter()
        .enumerate()
        .map(|(i, name)| {
            let (unit, of) = (machine.coordinate_unit(i), (i, name.as_str()));
            let mut panels = vec![
                panel(Quantity::Position, of, unit.to_owned()),
                panel(Quantity::Speed, of, format!("{unit}/s")),
            ];
            if judged.torques_foreseen {
                panels.push(panel(Quantity::Drive, of, machine.drive_unit(i).to_owned()));
            }
            (name, panels)
        })
        .collect();
    let unforeseen = match judged.torques_foreseen {
        true => "",
        false => " (torques are not foreseen)",
    };
    MotionFigure {
        title: format!("{title}{unforeseen}"),
        t,
        rows,
    }
}
