//! Measured and reconstructed torque over time, and how far they are apart.

use std::borrow::Cow;

use crate::report::Writer;
use crate::report::figure::{JointTorque, TorqueFigure, parted};
use crate::report::traces::{FigureTraces, LogTrace, TraceLine, TracePanel, TraceStyle};
use crate::report::words::torque_or_force;
use cft_ident_core::number;
use cft_ident_stages::identify::RobotSetup;
use cft_ident_stages::replay::{JointSeries, TorqueSeries};

/// How the torque of a model is drawn.
#[derive(Debug, Clone)]
pub struct TorqueDrawing {
    /// Name of its torque, and of its residual.
    pub names: [Cow<'static, str>; 2],
    pub styles: [TraceStyle; 2],
}

/// The only model.
pub const ONLY: TorqueDrawing = TorqueDrawing {
    names: [
        Cow::Borrowed("reconstructed"),
        Cow::Borrowed("measured \u{2212} reconstructed"),
    ],
    styles: [TraceStyle::Model, TraceStyle::Residual],
};

/// Torques of logs by models that are drawn so.
fn traces(setup: &RobotSetup, of: &[TorqueSeries], models: &[TorqueDrawing]) -> FigureTraces {
    // each log in two forms
    let several = of.len() > 2;
    let traces = of.iter().map(|series| {
        let what = match series.cutoff_hz {
            Some(cutoff) => format!(
                "below {} Hz, as in the errors",
                number::significant(cutoff, 3)
            ),
            None => "as logged, every sample".to_owned(),
        };
        let name = match several {
            true => format!("{}: {what}", series.log),
            false => what,
        };
        trace(setup, series, models, name)
    });
    FigureTraces {
        label: "Measured and reconstructed torque over time".into(),
        traces: traces.collect(),
    }
}

fn trace(
    setup: &RobotSetup,
    of: &TorqueSeries,
    models: &[TorqueDrawing],
    name: String,
) -> LogTrace {
    let mut panels = Vec::new();
    let joints = setup.robot.joint_names().iter().zip(&of.joints);
    for (j, (joint, series)) in joints.enumerate() {
        let unit = setup.file.torque_unit(j).to_owned();
        let line = |name: &str, style, values| TraceLine {
            name: name.to_owned(),
            style,
            values,
        };
        let measured = series.measured.clone();
        let mut lines = vec![line("measured", TraceStyle::Measured, measured)];
        let mut differences = Vec::new();
        for (drawn, hat) in models.iter().zip(&series.reconstructed) {
            let apart = series.measured.iter().zip(hat).map(|(a, b)| a - b);
            let [(model, as_model), (left, as_left)] =
                [0, 1].map(|k| (&drawn.names[k], drawn.styles[k]));
            lines.push(line(model, as_model, hat.clone()));
            differences.push(line(left, as_left, apart.collect()));
        }
        let quantity = torque_or_force(&unit);
        let panel = |small, name: &str, quantity: &str, lines| TracePanel {
            name: name.to_owned(),
            quantity: quantity.to_owned(),
            unit: unit.clone(),
            small,
            limits: None,
            lines,
        };
        panels.push(panel(false, joint, quantity, lines));
        panels.push(panel(true, "", "residual", differences));
    }
    LogTrace {
        name,
        t: of.t.clone(),
        breaks: of.breaks.clone(),
        panels,
    }
}

/// The still picture of a log, by the last of its models.
fn still(setup: &RobotSetup, of: &TorqueSeries, title: &str) -> TorqueFigure {
    let whole = |values: &[f64]| parted(values.iter().copied(), &of.breaks);
    let joint = |(j, (name, series)): (usize, (&String, &JointSeries))| {
        Some(JointTorque {
            joint: name.clone(),
            unit: setup.file.torque_unit(j).to_owned(),
            t: whole(&of.t),
            measured: whole(&series.measured),
            reconstructed: whole(series.reconstructed.last()?),
            relative_error: series.relative_error,
            rmse: series.rmse,
        })
    };
    let joints = setup.robot.joint_names().iter().zip(&of.joints);
    TorqueFigure {
        title: title.to_owned(),
        joints: joints.enumerate().filter_map(joint).collect(),
    }
}

/// The section.
pub fn section(
    page: &mut Writer,
    setup: &RobotSetup,
    of: &[TorqueSeries],
    models: &[TorqueDrawing],
    title: &str,
) {
    page.heading("Torque, measured and reconstructed");
    let figure = of.first().map_or(String::new(), |first| {
        // without a script, and in print, one log stands for all
        let title = match of.len() > 2 {
            true => format!("{}, the first of {} logs", first.log, of.len() / 2),
            false => title.to_owned(),
        };
        let title = match models {
            [.., last] if models.len() > 1 => format!("{title}: {}", last.names[0]),
            _ => title,
        };
        still(setup, first, &title).by_joint()
    });
    page.traces(&traces(setup, of, models), figure);
}
