//! Friction of a model, with everything that was found, beside what was measured.

use super::LogReplay;
use crate::input::curve::friction_curve;
use cft_ident_core::effect::{AugmentedModel, ModelEffect};
use cft_ident_core::friction::joint_estimate::FrictionCurvePoint;
use cft_ident_core::motion::MotionError;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::ModelFile;

/// Points of a curve on each side of rest.
const POINTS: usize = 90;

/// The friction of one joint.
#[derive(Debug, Clone)]
pub struct FrictionRows {
    pub joint: usize,
    /// By the declared law, in order of velocity; empty for a joint without one.
    pub curve: Vec<FrictionCurvePoint>,
    /// Lowest and highest velocity along the logs [m/s or rad/s].
    pub covered: [f64; 2],
    /// Velocity, measured torque less all that is no friction, and friction of the model.
    pub rows: Vec<[f64; 3]>,
    /// Effects make the friction differ from the curve.
    pub beyond_curve: bool,
}

/// The friction of every joint that has any, over the rows of all logs.
pub(super) fn friction(
    replay: &LogReplay,
    file: &ModelFile,
    model: &AugmentedModel,
) -> Result<Vec<FrictionRows>, MotionError> {
    let mut rows = friction_rows(replay, model)?;
    let joints = replay.setup.robot.joint_names().iter().enumerate();
    let of_joint = |(j, joint): (usize, &String)| {
        let law = model.model.friction.get(j)?;
        let [low, high] = replay.velocities(j)?;
        let beyond_curve = is_beyond_curve(model, j);
        if *law == JointFriction::None && !beyond_curve {
            return None;
        }
        Some(FrictionRows {
            joint: j,
            curve: match law {
                JointFriction::None => Vec::new(),
                law => friction_curve(file, law, joint, speeds(low.abs().max(high.abs()))),
            },
            covered: [low, high],
            rows: std::mem::take(&mut rows[j]),
            beyond_curve,
        })
    };
    Ok(joints.filter_map(of_joint).collect())
}

fn is_friction(effect: &ModelEffect) -> bool {
    effect.law.entry.friction
}

/// Whether effects make the friction of a joint differ from its law over velocity.
pub fn is_beyond_curve(model: &AugmentedModel, joint: usize) -> bool {
    let mut effects = model.effects.iter();
    effects.any(|e| is_friction(e) && e.place.touches(joint))
}

/// Velocity, measured torque less all that is no friction, and friction of the model, row by row of every joint.
pub(super) fn friction_rows(
    replay: &LogReplay,
    model: &AugmentedModel,
) -> Result<Vec<Vec<[f64; 3]>>, MotionError> {
    let mut bare = model.clone();
    bare.model.friction.fill(JointFriction::None);
    bare.effects.retain(|effect| !is_friction(effect));
    let mut all = vec![Vec::new(); model.model.robot.joints()];
    for stretch in replay.stretches {
        let parallel = replay.filters.of(stretch);
        let (full, rest) = (model.reconstruct(stretch), bare.reconstruct(stretch));
        for (j, rows) in all.iter_mut().enumerate() {
            let less =
                |x: &[f64]| -> Vec<f64> { x.iter().zip(&rest[j]).map(|(x, y)| x - y).collect() };
            let (measured, friction) = (less(&stretch.tau[j]), less(&full[j]));
            // speeds through the same filter, or a slope comes out flatter than it is
            let filtered = parallel.run(&[&stretch.v[j], &measured, &friction])?;
            rows.extend((0..filtered[0].len()).map(|i| std::array::from_fn(|k| filtered[k][i])));
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
