//! Friction of a model, with everything that was found, over the cloud of what was measured.

use super::first_of;
use crate::report::Writer;
use crate::report::figure::{FrictionFigure, FrictionPanel};
use cft_ident_stages::identify::LoggedRobot;
use cft_ident_stages::replay::FrictionRows;

fn figure(machine: &LoggedRobot, of: &[FrictionRows], logs: &[String]) -> FrictionFigure {
    let panel = |of: &FrictionRows| {
        let unit = machine.robot.joint_kind(of.joint).position_unit();
        FrictionPanel {
            joint: machine.robot.joint_names()[of.joint].clone(),
            note: String::new(),
            speed_unit: format!("{unit}/s"),
            torque_unit: machine.file.torque_unit(of.joint).to_owned(),
            curve: of.curve.clone(),
            covered: vec![of.covered],
            plateaus: Vec::new(),
            cloud: of.rows.clone(),
            beyond_curve: of.beyond_curve,
            truth: Vec::new(),
        }
    };
    let mut names = logs.to_vec();
    // spans of one log have its name
    names.dedup();
    FrictionFigure {
        title: format!("Friction of the model along {}", first_of(&names)),
        panels: of.iter().map(panel).collect(),
    }
}

/// The section; none for a model without friction.
pub fn section(page: &mut Writer, machine: &LoggedRobot, of: &[FrictionRows], logs: &[String]) {
    let figure = figure(machine, of, logs);
    if figure.panels.is_empty() {
        return;
    }
    page.heading("Friction");
    page.figures(&figure.cells());
}
