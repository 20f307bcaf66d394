//! The unknowns of the joint fit: inertias, friction, offsets, and what effects bring.

use crate::effect::{AugmentedModel, Cover, Role};
use crate::robot::model::JointFriction;

/// One unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// Inertial parameter i.
    Theta(usize),
    /// Parameter k of a joint's friction law.
    Friction { joint: usize, k: usize },
    /// Declared constant torque of a joint.
    Offset(usize),
    /// Coefficient k of an effect.
    Linear { effect: usize, k: usize },
    /// Shape parameter k of an effect.
    Shape { effect: usize, k: usize },
}

/// The unknowns, and which of them have a column in a joint's rows.
#[derive(Debug, Clone)]
pub struct Unknowns {
    pub list: Vec<Unknown>,
    /// Index in the list of each column of a joint's rows.
    pub columns: Vec<Vec<usize>>,
}

/// Which parameters of the declared model are open to the fit.
#[derive(Debug, Clone)]
pub struct FreeParameters {
    /// Constant torque per joint.
    pub offset: Vec<bool>,
    /// Friction parameters per joint: false where the friction stage found none or only a bound.
    pub friction: Vec<Vec<bool>>,
}

impl Unknowns {
    /// The unknowns of a model.
    pub fn of(model: &AugmentedModel, open: &FreeParameters, cover: &Cover) -> Self {
        let plain = &model.model;
        let n = plain.robot.joints();
        let mut list: Vec<Unknown> = (0..plain.theta.len()).map(Unknown::Theta).collect();
        for (joint, law) in plain.friction.iter().enumerate() {
            let all = 0..law.parameters();
            let free = all.filter(|k| open.friction[joint].get(*k).copied().unwrap_or(true));
            list.extend(free.map(|k| Unknown::Friction { joint, k }));
        }
        list.extend((0..n).filter(|j| open.offset[*j]).map(Unknown::Offset));
        for (effect, added) in model.effects.iter().enumerate() {
            let shapes = added.shape.len();
            let linear = (0..added.linear.len()).filter(|k| !added.held[shapes + k]);
            list.extend(linear.map(|k| Unknown::Linear { effect, k }));
            if !added.law.entry.search.refines() {
                continue;
            }
            let limits = added.law.limits_on(cover, added.place);
            let open = |k: &usize| limits[*k][0] < limits[*k][1] && !added.held[*k];
            let free = (0..shapes).filter(open);
            list.extend(free.map(|k| Unknown::Shape { effect, k }));
        }
        let held = plain.robot.parameters_by_joint();
        let touches = |u: &Unknown, j: usize| match *u {
            Unknown::Theta(i) => held[j].contains(&i),
            Unknown::Friction { joint, .. } | Unknown::Offset(joint) => joint == j,
            Unknown::Linear { effect, .. } | Unknown::Shape { effect, .. } => {
                model.effects[effect].place.touches(j)
            }
        };
        let columns = (0..n)
            .map(|j| (0..list.len()).filter(|i| touches(&list[*i], j)).collect())
            .collect();
        Unknowns { list, columns }
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.list.len()
    }
}

/// Adds a step to a model; shapes stay within their limits, slopes positive.
pub fn step(model: &mut AugmentedModel, unknowns: &Unknowns, delta: &[f64], cover: &Cover) {
    for (unknown, d) in unknowns.list.iter().zip(delta) {
        match *unknown {
            Unknown::Theta(i) => model.model.theta[i] += d,
            Unknown::Offset(j) => model.model.offset[j] += d,
            Unknown::Friction { joint, k } => {
                friction_step(&mut model.model.friction[joint], k, *d)
            }
            Unknown::Linear { effect, k } => {
                let added = &mut model.effects[effect];
                added.linear[k] += d;
                if added.law.entry.role == Role::Shift {
                    // a derivative holds for a few samples
                    let most = 50.0 * cover.dt;
                    added.linear[k] = added.linear[k].clamp(-most, most);
                }
            }
            Unknown::Shape { effect, k } => {
                let added = &mut model.effects[effect];
                let [low, high] = added.law.limits_on(cover, added.place)[k];
                // half of the way at most: a derivative by a shape holds near by
                let most = 0.5 * added.shape[k].abs().max(1e-3 * (high - low));
                let next = added.shape[k] + d.clamp(-most, most);
                added.shape[k] = next.clamp(low, high);
            }
        }
    }
}

fn friction_step(law: &mut JointFriction, k: usize, d: f64) {
    match law {
        JointFriction::None => {}
        JointFriction::ViscousCoulomb(law) => match k {
            0 => law.viscous += d,
            _ => law.coulomb += d,
        },
        JointFriction::DoubleTanh(law) => {
            let mut p = law.parameters();
            p[k] = if k >= 3 {
                // a slope stays positive and moves by a factor of two at most
                (p[k] + d).clamp(0.5 * p[k], 2.0 * p[k])
            } else {
                p[k] + d
            };
            *law = crate::robot::friction::DoubleTanh::from_parameters(p);
        }
    }
}
