//! Friction curves of a model, with their bands and the speeds of the logs.

use super::look::Look;
use crate::config::ModelFile;
use crate::effect::AugmentedModel;
use crate::report::Writer;
use crate::report::figure::{CurvePoint, FrictionFigure, FrictionPanel};
use crate::robot::friction::{DoubleTanh, ViscousCoulomb};
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
            let curve = curve(file, law, joint, speeds(low.abs().max(high.abs())));
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

/// The curve of a joint's law at these speeds; a law that jumps has a point that is not finite at 0.
pub fn curve(
    file: &ModelFile,
    law: &JointFriction,
    joint: &str,
    speeds: impl Iterator<Item = f64>,
) -> Vec<CurvePoint> {
    let names: &[&str] = match law {
        JointFriction::None => return Vec::new(),
        JointFriction::DoubleTanh(_) => &DoubleTanh::NAMES,
        JointFriction::ViscousCoulomb(_) => &ViscousCoulomb::NAMES,
    };
    let keys: Vec<String> = names.iter().map(|n| format!("{n}:{joint}")).collect();
    let covariance = file.covariance_of(&keys);
    let jumps = matches!(law, JointFriction::ViscousCoulomb(_));
    speeds
        .map(|v| match v == 0.0 && jumps {
            true => CurvePoint {
                v: f64::NAN,
                torque: f64::NAN,
                std: f64::NAN,
            },
            false => CurvePoint {
                v,
                torque: law.torque(v),
                std: deviation(law, &covariance, v),
            },
        })
        .collect()
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

/// Standard deviation of F(v): the gradient through the covariance of the law's parameters.
fn deviation(law: &JointFriction, covariance: &[f64], v: f64) -> f64 {
    let n = law.parameters();
    let mut gradient = [0.0; 8];
    law.gradient(v, &mut gradient[..n]);
    let mut variance = 0.0;
    for i in 0..n {
        for j in 0..n {
            let entry = covariance.get(i * n + j).copied().unwrap_or(0.0);
            variance += gradient[i] * entry * gradient[j];
        }
    }
    variance.max(0.0).sqrt()
}

/// The section; none for a model without friction.
pub fn section(page: &mut Writer, figure: &FrictionFigure) {
    if figure.panels.is_empty() {
        return;
    }
    page.heading("Friction");
    page.figure(&figure.svg());
}
