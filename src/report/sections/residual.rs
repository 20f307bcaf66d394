//! What the residual depends on: over position, velocity, load and time, and its spectra.

use super::look::Look;
use crate::diagnose::JointEvidence;
use crate::effect::{AugmentedModel, Place, Search};
use crate::identify::LoggedRobot;
use crate::motion::MotionError;
use crate::number;
use crate::report::Writer;
use crate::report::figure::{ResidualFigure, ResidualPanel, When};

/// The residual of the first model, and of the second where there is one, over the logs of `wanted`.
///
/// # Errors
/// Stretches that are too short for the filter.
pub fn figure(
    look: &Look,
    wanted: &dyn Fn(usize) -> bool,
    before: &AugmentedModel,
    after: Option<&AugmentedModel>,
) -> Result<ResidualFigure, MotionError> {
    let names = look.names.iter().enumerate();
    let mut names: Vec<&str> = names
        .filter(|(log, _)| wanted(*log))
        .map(|(_, name)| name.as_str())
        .collect();
    names.dedup();
    let found = after.unwrap_or(before);
    let reach: Vec<f64> = (0..look.machine.robot.joints())
        .map(|j| orders(found, j).fold(0.0, f64::max))
        .collect();
    let before = look.evidence(before, wanted, &reach)?;
    let after = after
        .map(|model| look.evidence(model, wanted, &reach))
        .transpose()?;
    let what = match after {
        Some(_) => "Residual before and after",
        None => "Residual",
    };
    let joints = look.machine.robot.joint_names().iter().enumerate();
    Ok(ResidualFigure {
        title: format!("{what}: {}", named(&names)),
        joints: joints
            .map(|(j, name)| {
                let after = after.as_ref().map(|after| &after[j]);
                let mut panels = panels(look.machine, j, &before[j], after);
                let marks = orders(found, j).map(|order| (order, short(order)));
                let over_order = panels.iter_mut().filter(|panel| panel.over.0 == ORDER);
                over_order.for_each(|panel| panel.marks = marks.clone().collect());
                (name.clone(), panels)
            })
            .collect(),
    })
}

/// Orders of the waves that a model has at a joint.
fn orders(model: &AugmentedModel, joint: usize) -> impl Iterator<Item = f64> + Clone {
    let effects = model.effects.iter();
    let waves = effects.filter(|e| e.law.entry.search == Search::Orders);
    let here = waves.filter(move |e| e.place == Place::Joint(joint));
    here.filter_map(|e| e.shape.first().copied())
}

/// Name of the axis of waves over position.
const ORDER: &str = "order";

/// An order as it stands at its mark.
fn short(order: f64) -> String {
    let text = number::significant(order, 3);
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// The first few of many names.
fn named(names: &[&str]) -> String {
    const MOST: usize = 3;
    match names.len() > MOST {
        true => format!(
            "{} and {} more",
            names[..MOST].join(", "),
            names.len() - MOST
        ),
        false => names.join(", "),
    }
}

fn panels(
    machine: &LoggedRobot,
    j: usize,
    before: &JointEvidence,
    after: Option<&JointEvidence>,
) -> Vec<ResidualPanel> {
    let torque = machine.file.torque_unit(j).to_owned();
    let position = machine.robot.joint_kind(j).position_unit();
    let wave = if position == "m" { "1/m" } else { "1/rev" };
    let panel = |over: &str, unit: &str, of: &str, lines| ResidualPanel {
        over: (over.into(), unit.into()),
        of: (of.into(), torque.clone()),
        lines,
        marks: Vec::new(),
    };
    let one = |get: fn(&JointEvidence) -> &Vec<[f64; 2]>| {
        let mut lines = vec![(When::Before, get(before).clone())];
        lines.extend(after.map(|after| (When::After, get(after).clone())));
        lines
    };
    let two = |get: fn(&JointEvidence) -> &[Vec<[f64; 2]>; 2]| {
        let [forward, backward] = get(before).clone();
        let mut lines = vec![(When::Before, forward), (When::BeforeBackward, backward)];
        if let Some(after) = after {
            let [forward, backward] = get(after).clone();
            lines.extend([(When::After, forward), (When::AfterBackward, backward)]);
        }
        lines
    };
    vec![
        panel("position", position, "mean residual", two(|e| &e.position)),
        panel(
            "velocity",
            &format!("{position}/s"),
            "mean residual",
            one(|e| &e.velocity),
        ),
        panel("load torque", &torque, "mean residual", two(|e| &e.load)),
        panel("time", "s", "residual", one(|e| &e.time)),
        panel(ORDER, wave, "amplitude", one(|e| &e.order)),
        panel("frequency", "Hz", "amplitude", one(|e| &e.frequency)),
    ]
}

/// The section.
pub fn section(page: &mut Writer, figure: &ResidualFigure) {
    page.heading("The residual and its spectra");
    page.paragraph(
        "Means over bins of the filtered residual, forward and backward apart; amplitudes of its \
         waves over position (order) and over time (frequency). Waves that were found are marked. A residual without \
         pattern is noise.",
    );
    for cells in figure.cells() {
        page.figures(&cells);
    }
}
