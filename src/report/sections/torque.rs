//! Measured and reconstructed torque over time, and how far they are apart.

use super::look::Look;
use crate::effect::AugmentedModel;
use crate::identify::LoggedRobot;
use crate::motion::{MotionError, Stretch};
use crate::number;
use crate::report::figure::{JointTorque, TorqueFigure};
use crate::report::{Trace, TraceLine, TracePanel, TraceStyle, Traces, Writer};

/// A model whose torque is drawn.
pub struct Drawn<'a> {
    /// Name of its torque, and of its residual.
    pub names: [&'a str; 2],
    pub styles: [TraceStyle; 2],
    pub model: &'a AugmentedModel,
}

impl<'a> Drawn<'a> {
    /// The only model.
    pub fn only(model: &'a AugmentedModel) -> Self {
        Drawn {
            names: ["reconstructed", "measured \u{2212} reconstructed"],
            styles: [TraceStyle::Model, TraceStyle::Residual],
            model,
        }
    }
}

/// The torque of `logs` as it was filtered, which the errors are of, and as it was logged.
///
/// # Errors
/// Stretches that are too short for the filter.
pub fn traces(look: &Look, logs: &[usize], models: &[Drawn]) -> Result<Traces, MotionError> {
    let (mut filtered, mut raw) = (Vec::new(), Vec::new());
    for &log in logs {
        let name = look.names.get(log).cloned().unwrap_or_default();
        let words = |what: &str| match logs.len() {
            1 => what.to_owned(),
            _ => format!("{name}: {what}"),
        };
        let mut smooth = Series::new(look, models);
        let mut plain = Series::new(look, models);
        for stretch in look.of_log(log) {
            let hats: Vec<Vec<Vec<f64>>> = models
                .iter()
                .map(|m| m.model.reconstruct(stretch))
                .collect();
            let channels: Vec<&[f64]> = stretch
                .tau
                .iter()
                .chain(hats.iter().flatten())
                .map(Vec::as_slice)
                .collect();
            plain.add(&stretch.t, &channels);
            let rows = look.filters.of(stretch).run(&channels)?;
            let times = sampled(look, stretch);
            let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
            smooth.add(&times, &rows);
        }
        let cutoff = number::significant(look.cutoff_hz, 3);
        filtered.push(smooth.trace(words(&format!("below {cutoff} Hz, as in the errors"))));
        raw.push(plain.trace(words("as logged, every sample")));
    }
    let traces = filtered.into_iter().zip(raw);
    Ok(Traces {
        label: "Measured and reconstructed torque over time".into(),
        traces: traces.flat_map(|(a, b)| [a, b]).collect(),
    })
}

fn sampled(look: &Look, stretch: &Stretch) -> Vec<f64> {
    let filter = look.filters.of(stretch);
    let rows = filter.rows(stretch.len());
    let at = |i| stretch.t.get(filter.sample_of(i)).copied();
    (0..rows).filter_map(at).collect()
}

/// Torques of one log, stretch after stretch.
struct Series<'a> {
    machine: &'a LoggedRobot,
    models: &'a [Drawn<'a>],
    t: Vec<f64>,
    breaks: Vec<usize>,
    /// Measured, then of each model, joint by joint.
    channels: Vec<Vec<f64>>,
}

impl<'a> Series<'a> {
    fn new(look: &Look<'a>, models: &'a [Drawn<'a>]) -> Self {
        let joints = look.machine.robot.joints();
        Series {
            machine: look.machine,
            models,
            t: Vec::new(),
            breaks: Vec::new(),
            channels: vec![Vec::new(); joints * (1 + models.len())],
        }
    }

    fn add(&mut self, t: &[f64], channels: &[&[f64]]) {
        self.breaks.push(self.t.len());
        self.t.extend_from_slice(t);
        for (all, channel) in self.channels.iter_mut().zip(channels) {
            all.extend_from_slice(&channel[..t.len().min(channel.len())]);
        }
    }

    fn trace(self, name: String) -> Trace {
        let joints = self.machine.robot.joint_names();
        let mut panels = Vec::new();
        for (j, joint) in joints.iter().enumerate() {
            let unit = self.machine.file.torque_unit(j).to_owned();
            let measured = &self.channels[j];
            let mut lines = vec![TraceLine {
                name: "measured".into(),
                style: TraceStyle::Measured,
                values: measured.clone(),
            }];
            let mut differences = Vec::new();
            for (m, drawn) in self.models.iter().enumerate() {
                let hat = &self.channels[joints.len() * (m + 1) + j];
                lines.push(TraceLine {
                    name: drawn.names[0].into(),
                    style: drawn.styles[0],
                    values: hat.clone(),
                });
                differences.push(TraceLine {
                    name: drawn.names[1].into(),
                    style: drawn.styles[1],
                    values: measured.iter().zip(hat).map(|(a, b)| a - b).collect(),
                });
            }
            let quantity = if unit == "N" { "force" } else { "torque" };
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
        Trace {
            name,
            t: self.t,
            breaks: self.breaks,
            panels,
        }
    }
}

/// The still picture of a trace, by the last of its models.
pub fn still(machine: &LoggedRobot, trace: &Trace, title: &str) -> TorqueFigure {
    let whole = |values: &[f64]| -> Vec<f64> {
        let mut out = Vec::with_capacity(values.len() + trace.breaks.len());
        for (k, v) in values.iter().enumerate() {
            if k > 0 && trace.breaks.contains(&k) {
                // a row that is not finite parts the lines at a gap
                out.push(f64::NAN);
            }
            out.push(*v);
        }
        out
    };
    let pairs = trace.panels.chunks(2).zip(machine.robot.joint_names());
    let joints = pairs
        .enumerate()
        .filter_map(|(j, (panels, name))| {
            let lines = &panels.first()?.lines;
            let (measured, hat) = (lines.first()?, lines.last()?);
            let square = |x: &mut dyn Iterator<Item = f64>| x.map(|v| v * v).sum::<f64>();
            let pairs = || measured.values.iter().zip(&hat.values);
            let error = square(&mut pairs().map(|(a, b)| a - b));
            let torque = square(&mut measured.values.iter().copied());
            Some(JointTorque {
                joint: name.clone(),
                unit: machine.file.torque_unit(j).to_owned(),
                t: whole(&trace.t),
                measured: whole(&measured.values),
                reconstructed: whole(&hat.values),
                relative_error: (error / torque).sqrt(),
                rmse: (error / measured.values.len() as f64).sqrt(),
            })
        })
        .collect();
    TorqueFigure {
        title: title.to_owned(),
        joints,
    }
}

/// The section.
///
/// # Errors
/// Stretches that are too short for the filter.
pub fn section(
    page: &mut Writer,
    look: &Look,
    logs: &[usize],
    models: &[Drawn],
    title: &str,
) -> Result<(), MotionError> {
    let traces = traces(look, logs, models)?;
    page.heading("Torque, measured and reconstructed");
    let first = traces.traces.first();
    let figure = first.map_or(String::new(), |t| still(look.machine, t, title).by_joint());
    page.traces(&traces, &figure);
    Ok(())
}
