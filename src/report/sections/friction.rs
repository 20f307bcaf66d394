//! Friction of a model, with everything that was found, over the cloud of what was measured.

use super::look::Look;
use crate::config::ModelFile;
use crate::effect::{Added, AugmentedModel};
use crate::identify::friction_curve;
use crate::motion::MotionError;
use crate::report::Writer;
use crate::report::figure::{FrictionFigure, FrictionPanel};
use crate::robot::model::JointFriction;

/// Points of a curve on each side of rest.
const POINTS: usize = 90;

/// The friction of every joint that has any, over the rows of all logs.
///
/// # Errors
/// Stretches that are too short for the filter.
pub fn figure(
    look: &Look,
    file: &ModelFile,
    model: &AugmentedModel,
) -> Result<FrictionFigure, MotionError> {
    let machine = look.machine;
    let mut clouds = clouds(look, model)?;
    let joints = machine.robot.joint_names().iter().enumerate();
    let panels = joints
        .filter_map(|(j, joint)| {
            let law = model.model.friction.get(j)?;
            let [low, high] = look.velocities(j)?;
            let beyond_curve = is_beyond_curve(model, j);
            if *law == JointFriction::None && !beyond_curve {
                return None;
            }
            let curve = match law {
                JointFriction::None => Vec::new(),
                law => friction_curve(file, law, joint, speeds(low.abs().max(high.abs()))),
            };
            let unit = machine.robot.joint_kind(j).position_unit();
            Some(FrictionPanel {
                joint: joint.clone(),
                note: String::new(),
                speed_unit: format!("{unit}/s"),
                torque_unit: machine.file.torque_unit(j).to_owned(),
                curve,
                covered: vec![[low, high]],
                plateaus: Vec::new(),
                cloud: std::mem::take(&mut clouds[j]),
                beyond_curve,
                truth: Vec::new(),
            })
        })
        .collect();
    let all: Vec<usize> = (0..look.names.len()).collect();
    Ok(FrictionFigure {
        title: format!("Friction of the model along {}", look.named(&all)),
        panels,
    })
}

fn is_friction(effect: &Added) -> bool {
    effect.law.entry.friction
}

/// Whether effects make the friction of a joint differ from its law over velocity.
pub fn is_beyond_curve(model: &AugmentedModel, joint: usize) -> bool {
    let mut effects = model.effects.iter();
    effects.any(|e| is_friction(e) && e.place.touches(joint))
}

/// Velocity, measured torque less all that is no friction, and friction of the model, row by row of every joint.
pub fn clouds(look: &Look, model: &AugmentedModel) -> Result<Vec<Vec<[f64; 3]>>, MotionError> {
    let mut bare = model.clone();
    bare.model.friction.fill(JointFriction::None);
    bare.effects.retain(|effect| !is_friction(effect));
    let mut all = vec![Vec::new(); model.model.robot.joints()];
    for stretch in look.stretches {
        let parallel = look.filters.of(stretch);
        let (full, rest) = (model.reconstruct(stretch), bare.reconstruct(stretch));
        for (j, rows) in all.iter_mut().enumerate() {
            let less =
                |x: &[f64]| -> Vec<f64> { x.iter().zip(&rest[j]).map(|(x, y)| x - y).collect() };
            let (measured, friction) = (less(&stretch.tau[j]), less(&full[j]));
            let filtered = parallel.run(&[&measured, &friction])?;
            rows.extend((0..filtered[0].len()).map(|i| {
                let v = stretch.v[j][parallel.sample_of(i)];
                [v, filtered[0][i], filtered[1][i]]
            }));
        }
    }
    Ok(all)
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
    page.figures(&figure.cells());
}
