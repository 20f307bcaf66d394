//! The page of a motion, judged before the robot moves.

use super::Bench;
use super::judge::{self, Judged};
use crate::cli::pages::provenance;
use crate::excite::Motion;
use crate::log::escape;
use crate::number;
use crate::report::figure::MotionFigure;
use crate::report::{Report, Trace, TraceLine, TracePanel, TraceStyle, Traces, Writer};

/// The page as a file; `name` is the trajectory's, without folders.
pub(super) fn page(bench: &Bench, motion: &Motion, judged: &Judged, name: &str) -> String {
    let name = escape(name);
    let mut report = Report::new(&format!("Motion {name}"));
    let mut page = report.page();
    let (text, good) = words(judged);
    page.verdict(&text, good);
    page.table(judged.limits_table(bench, &name));
    page.list(judged.broken());
    page.heading("Expected parameters");
    match &judged.friction {
        Some(friction) => page.table(friction.table(judged.foresight.rows)),
        None => {
            page.paragraph("Friction is taken as known; the noise is that of the robot file.");
            page.table(judged.parameters_table());
            directions(&mut page, judged);
        }
    }
    page.heading("Positions, speeds and drives");
    let figure = judge::figure(bench, motion, judged, &name);
    page.traces(&traces(&figure), &figure.svg());
    spectrum(&mut page, bench, judged);
    if !judged.warnings.is_empty() {
        page.heading("Warnings");
        page.list(&judged.warnings);
    }
    provenance::section(
        &mut page,
        &bench.file,
        &bench.inputs,
        &[],
        None,
        bench.context,
    );
    report.html()
}

fn words(judged: &Judged) -> (String, bool) {
    let broken = judged.broken().len();
    let mut text = match broken {
        0 => "The motion keeps every limit.".to_owned(),
        1 => "The motion breaks a limit.".to_owned(),
        n => format!("The motion breaks {n} limits."),
    };
    let nearest = judged
        .uses
        .iter()
        .max_by(|a, b| a.share.total_cmp(&b.share));
    if let Some(nearest) = nearest.filter(|_| broken == 0) {
        text += &format!(
            " It comes nearest to that of {} ({}), of which it uses {}.",
            nearest.channel.name,
            nearest.channel.quantity.name(),
            number::percent(nearest.share)
        );
    }
    if judged.friction.is_none() {
        let condition = &judged.foresight.condition;
        let shown = |c: Option<f64>| c.map_or("infinite".to_owned(), |c| number::significant(c, 4));
        text += &format!(
            " Condition of the regressor: {}, {} with columns scaled.",
            shown(condition.raw),
            shown(condition.normalised)
        );
    }
    (text, broken == 0)
}

fn directions(page: &mut Writer, judged: &Judged) {
    let f = &judged.foresight;
    let rows: Vec<Vec<String>> = f
        .weakest_direction
        .iter()
        .take_while(|part| part.weight.abs() > 0.1)
        .map(|part| vec![part.parameter.clone(), format!("{:+.2}", part.weight)])
        .collect();
    page.rows(
        "weakest direction, of columns scaled to norm 1",
        &["parameter", "part"],
        rows,
    );
    if let Some(pair) = &f.confounded {
        page.paragraph(&format!(
            "Errors most alike: {} and {}, correlation {:.2}.",
            pair.first, pair.second, pair.correlation
        ));
    }
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
fn spectrum(page: &mut Writer, bench: &Bench, judged: &Judged) {
    let Some(spectrum) = &judged.spectrum else {
        return;
    };
    page.heading("Spectrum");
    let harmonics = spectrum.iter().map(Vec::len).max().unwrap_or(0);
    let head: Vec<String> = ["coordinate".to_owned(), "unit".to_owned()]
        .into_iter()
        .chain((1..=harmonics).map(|l| format!("{l}")))
        .collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let names = bench.machine.coordinate_names();
    let rows: Vec<Vec<String>> = names
        .into_iter()
        .zip(spectrum)
        .enumerate()
        .map(|(i, (name, row))| {
            let unit = format!("{}/s", bench.machine.coordinate_unit(i));
            let values = row.iter().map(|a| number::significant(*a, 3));
            [name, unit].into_iter().chain(values).collect()
        })
        .collect();
    page.rows("amplitude of the speed by harmonic", &head, rows);
    if let Some(band) = &judged.band {
        let joints = bench.machine.model.robot.joint_names().iter().zip(band);
        let bands: Vec<String> = joints
            .map(|(joint, hz)| format!("{joint} {} Hz", number::significant(*hz, 2)))
            .collect();
        page.paragraph(&format!(
            "99 % of the torque's power lies below: {}.",
            bands.join(", ")
        ));
    }
}
