//! The residual over position, velocity, load and time, and its spectra.

use crate::report::Writer;
use crate::report::figure::{ResidualFigure, ResidualLine, ResidualPanel};
use crate::report::words::{first_of, torque_or_force};
use cft_ident_core::diagnose::JointEvidence;
use cft_ident_core::number;
use cft_ident_stages::identify::RobotSetup;
use cft_ident_stages::replay::{ResidualEvidence, ResidualPair};

/// The figure.
pub fn figure(setup: &RobotSetup, of: &ResidualEvidence) -> ResidualFigure {
    let after = of.joints.iter().any(|joint| joint.after.is_some());
    let what = match after {
        true => "Residual before and after",
        false => "Residual",
    };
    let joints = setup.robot.joint_names().iter().zip(&of.joints);
    let begins = of.begins.iter();
    let begins = begins.map(|(at, log)| (*at, log.trim_end_matches(".csv").to_owned()));
    let begins: Vec<(f64, String)> = begins.collect();
    let panels = |(j, (name, of)): (usize, (&String, &ResidualPair))| {
        (name.clone(), panels(setup, j, of, &begins))
    };
    ResidualFigure {
        title: format!("{what}: {}", first_of(&of.logs)),
        joints: joints.enumerate().map(panels).collect(),
    }
}

/// An order as it stands at its mark.
fn short(order: f64) -> String {
    let text = number::significant(order, 3);
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

fn panels(
    setup: &RobotSetup,
    j: usize,
    of: &ResidualPair,
    begins: &[(f64, String)],
) -> Vec<ResidualPanel> {
    let torque = setup.file.torque_unit(j);
    let position = setup.robot.joint_kind(j).position_unit();
    let speed = format!("{position}/s");
    let wave = if position == "m" { "1/m" } else { "1/rev" };
    let load = format!("load {}", torque_or_force(torque));
    let one = |get: fn(&JointEvidence) -> &Vec<[f64; 2]>| {
        let mut lines = vec![(ResidualLine::Before, get(&of.before).clone())];
        lines.extend(
            of.after
                .as_ref()
                .map(|after| (ResidualLine::After, get(after).clone())),
        );
        lines
    };
    let two = |get: fn(&JointEvidence) -> &[Vec<[f64; 2]>; 2]| {
        let [forward, backward] = get(&of.before).clone();
        let mut lines = vec![
            (ResidualLine::Before, forward),
            (ResidualLine::BeforeBackward, backward),
        ];
        if let Some(after) = &of.after {
            let [forward, backward] = get(after).clone();
            lines.extend([
                (ResidualLine::After, forward),
                (ResidualLine::AfterBackward, backward),
            ]);
        }
        lines
    };
    let orders = of
        .orders
        .iter()
        .map(|order| (*order, short(*order)))
        .collect();
    let panels = [
        (
            "position",
            position,
            "mean residual",
            two(|e| &e.position),
            Vec::new(),
        ),
        (
            "velocity",
            &speed,
            "mean residual",
            one(|e| &e.velocity),
            Vec::new(),
        ),
        (&load, torque, "mean residual", two(|e| &e.load), Vec::new()),
        ("time", "s", "residual", one(|e| &e.time), begins.to_vec()),
        ("order", wave, "amplitude", one(|e| &e.order), orders),
        (
            "frequency",
            "Hz",
            "amplitude",
            one(|e| &e.frequency),
            Vec::new(),
        ),
    ];
    let panel = |(over, unit, quantity, lines, marks): (&str, &str, &str, _, _)| ResidualPanel {
        over: (over.into(), unit.into()),
        of: (quantity.into(), torque.into()),
        lines,
        marks,
    };
    panels.map(panel).into()
}

/// The section.
pub(crate) fn section(page: &mut Writer, setup: &RobotSetup, of: &ResidualEvidence) {
    page.heading("The residual and its spectra");
    page.paragraph(
        "Means over bins of the filtered residual, forward and backward apart; amplitudes of its \
         waves over position (order) and over time (frequency). Waves that were found are marked. A residual without \
         pattern is noise.",
    );
    for cells in figure(setup, of).cells() {
        page.figures(cells);
    }
}
