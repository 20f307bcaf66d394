//! What the residual depends on: over position, velocity, load and time, and its spectra.

use super::first_of;
use crate::report::Writer;
use crate::report::figure::{ResidualFigure, ResidualPanel, When};
use cft_ident_core::diagnose::JointEvidence;
use cft_ident_core::number;
use cft_ident_stages::identify::LoggedRobot;
use cft_ident_stages::replay::{ResidualEvidence, ResidualPair};

/// The figure.
pub fn figure(machine: &LoggedRobot, of: &ResidualEvidence) -> ResidualFigure {
    let after = of.joints.iter().any(|joint| joint.after.is_some());
    let what = match after {
        true => "Residual of the model as given, and after",
        false => "Residual",
    };
    let joints = machine.robot.joint_names().iter().zip(&of.joints);
    let begins: Vec<(f64, String)> = (of.begins.iter())
        .map(|(at, log)| (*at, log.trim_end_matches(".csv").to_owned()))
        .collect();
    let panels = |(j, (name, of)): (usize, (&String, &ResidualPair))| {
        let mut panels = panels(machine, j, &of.before, of.after.as_ref());
        let marks = of.orders.iter().map(|order| (*order, short(*order)));
        let over_order = panels.iter_mut().filter(|panel| panel.over.0 == ORDER);
        over_order.for_each(|panel| panel.marks = marks.clone().collect());
        let over_time = panels.iter_mut().filter(|panel| panel.over.0 == TIME);
        over_time.for_each(|panel| panel.marks = begins.clone());
        (name.clone(), panels)
    };
    ResidualFigure {
        title: format!("{what}: {}", first_of(&of.logs)),
        joints: joints.enumerate().map(panels).collect(),
    }
}

/// Name of the axis of waves over position.
const ORDER: &str = "order";
/// Name of the axis of time.
const TIME: &str = "time";

/// An order as it stands at its mark.
fn short(order: f64) -> String {
    let text = number::significant(order, 3);
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
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
    let load = if torque == "N" {
        "load force"
    } else {
        "load torque"
    };
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
        panel(load, &torque, "mean residual", two(|e| &e.load)),
        panel(TIME, "s", "residual", one(|e| &e.time)),
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
