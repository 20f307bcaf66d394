//! Friction curves of a model, with their bands and the speeds of the logs.

use super::look::Look;
use crate::config::ModelFile;
use crate::effect::AugmentedModel;
use crate::identify::friction_curve;
use crate::report::Writer;
use crate::report::figure::{FrictionFigure, FrictionPanel};
use crate::robot::model::JointFriction;

/// Points of a curve on each side of rest.
const POINTS: usize = 90;

/// The curves of every joint that has friction.
pub fn figure(look: &Look, file: &ModelFile, model: &AugmentedModel) -> FrictionFigure {
    let machine = look.machine;
    let joints = machine.robot.joint_names().iter().enumerate();
    let panels = joints
        .filter_map(|(j, joint)| {
            let law = model.model.friction.get(j)?;
            let [low, high] = look.velocities(j)?;
            if *law == JointFriction::None {
                return None;
            }
            let curve = friction_curve(file, law, joint, speeds(low.abs().max(high.abs())));
            let unit = machine.robot.joint_kind(j).position_unit();
            Some(FrictionPanel {
                joint: joint.clone(),
                note: String::new(),
                speed_unit: format!("{unit}/s"),
                torque_unit: machine.file.torque_unit(j).to_owned(),
                curve,
                covered: vec![[low, high]],
                plateaus: Vec::new(),
                truth: Vec::new(),
            })
        })
        .collect();
    FrictionFigure {
        title: format!(
            "Friction of the model, and the speeds of {}",
            look.names.join(", ")
        ),
        panels,
    }
}

/// From the fastest backward to the fastest forward, closer together towards rest, where laws bend.
pub fn speeds(most: f64) -> impl Iterator<Item = f64> {
    let side = move |k: usize| {
        let share = k as f64 / POINTS as f64;
        most * share * share * share
    };
    let backward = (1..=POINTS).rev().map(move |k| -side(k));
    backward.chain((0..=POINTS).map(side))
}

/// The section; none for a model without friction.
pub fn section(page: &mut Writer, figure: &FrictionFigure) {
    if figure.panels.is_empty() {
        return;
    }
    page.heading("Friction");
    page.figure(&figure.svg());
}
