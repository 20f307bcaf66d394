//! Friction of a model with all its effects, over the cloud of the measured friction.

use crate::report::Writer;
use crate::report::figure::{FrictionFigure, FrictionPanel};
use crate::report::words::first_of;
use cft_ident_stages::identify::RobotSetup;
use cft_ident_stages::replay::FrictionRows;

/// The section; none for a model without friction.
pub fn section(page: &mut Writer, setup: &RobotSetup, of: &[FrictionRows], logs: &[String]) {
    if of.is_empty() {
        return;
    }
    let panel = |of: &FrictionRows| {
        let unit = setup.robot.joint_kind(of.joint).position_unit();
        FrictionPanel {
            joint: setup.robot.joint_names()[of.joint].clone(),
            speed_unit: format!("{unit}/s"),
            torque_unit: setup.file.torque_unit(of.joint).to_owned(),
            curve: of.curve.clone(),
            covered: vec![of.covered],
            cloud: of.rows.clone(),
            beyond_curve: of.beyond_curve,
            ..FrictionPanel::default()
        }
    };
    let mut names = logs.to_vec();
    // spans of one log have its name
    names.dedup();
    let figure = FrictionFigure {
        title: format!("Friction of the model along {}", first_of(&names)),
        panels: of.iter().map(panel).collect(),
    };
    page.heading("Friction");
    page.figures(figure.cells());
}
