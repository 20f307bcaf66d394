//! What the residual depends on: over position, velocity, load and time, and its spectra.

use super::look::Look;
use crate::diagnose::JointEvidence;
use crate::effect::AugmentedModel;
use crate::identify::LoggedRobot;
use crate::motion::MotionError;
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
    let names: Vec<&str> = names
        .filter(|(log, _)| wanted(*log))
        .map(|(_, name)| name.as_str())
        .collect();
    let before = look.evidence(before, wanted)?;
    let after = after
        .map(|model| look.evidence(model, wanted))
        .transpose()?;
    let what = match after {
        Some(_) => "Residual before and after",
        None => "Residual",
    };
    let joints = look.machine.robot.joint_names().iter().enumerate();
    Ok(ResidualFigure {
        title: format!("{what}: {}", names.join(", ")),
        joints: joints
            .map(|(j, name)| {
                let after = after.as_ref().map(|after| &after[j]);
                (name.clone(), panels(look.machine, j, &before[j], after))
            })
            .collect(),
    })
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
        panel("order", wave, "amplitude", one(|e| &e.order)),
        panel("frequency", "Hz", "amplitude", one(|e| &e.frequency)),
    ]
}

/// The section.
pub fn section(page: &mut Writer, figure: &str) {
    page.heading("The residual and its spectra");
    page.paragraph(
        "Means over bins of the filtered residual, forward and backward apart; amplitudes of its \
         waves over position (order) and over time (frequency). A residual without pattern is noise.",
    );
    page.figure(figure);
}
