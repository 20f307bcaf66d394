//! The unknowns of the declared model: inertias, friction and offsets.

use crate::effect::AugmentedModel;
use crate::robot::friction::DoubleTanh;
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
}

/// The unknowns, and which of them have a column in a joint's rows.
#[derive(Debug, Clone)]
pub struct DiagnosisUnknowns {
    pub list: Vec<Unknown>,
    /// Parameters that are held as given: their columns tell what their own covariance does to the unknowns.
    pub held: Vec<Unknown>,
    /// Of each column of a joint's rows its index in the list, and behind it in that of what is held.
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

impl DiagnosisUnknowns {
    /// By how much each unknown of one model is off that of another.
    pub fn moved(&self, from: &AugmentedModel, to: &AugmentedModel) -> Vec<f64> {
        let by = |unknown: &Unknown| value_of(to, *unknown) - value_of(from, *unknown);
        self.list.iter().map(by).collect()
    }

    /// The unknowns of a model; its inertial parameters are held where these are kept.
    pub fn of(model: &AugmentedModel, open: &FreeParameters, keep: bool) -> Self {
        let plain = &model.model;
        let n = plain.robot.joints();
        let inertial = (0..plain.theta.len()).map(Unknown::Theta);
        let (mut list, held): (Vec<Unknown>, Vec<Unknown>) = inertial.partition(|_| !keep);
        for (joint, law) in plain.friction.iter().enumerate() {
            let free = |k: &usize| open.friction[joint].get(*k).copied().unwrap_or(true);
            let own = (0..law.parameters()).filter(free);
            list.extend(own.map(|k| Unknown::Friction { joint, k }));
        }
        list.extend((0..n).filter(|j| open.offset[*j]).map(Unknown::Offset));
        let inertial = plain.robot.parameters_by_joint();
        let touches = |u: &Unknown, j: usize| match *u {
            Unknown::Theta(i) => inertial[j].contains(&i),
            Unknown::Friction { joint, .. } | Unknown::Offset(joint) => joint == j,
        };
        let of_joint = |j: usize| {
            let all = list.iter().chain(&held).enumerate();
            all.filter(|(_, u)| touches(u, j)).map(|(i, _)| i).collect()
        };
        let columns = (0..n).map(of_joint).collect();
        DiagnosisUnknowns {
            list,
            held,
            columns,
        }
    }

    /// The same without the columns of what is held.
    pub fn without_held(&self) -> Self {
        let free = |own: &Vec<usize>| own.iter().copied().filter(|i| *i < self.len()).collect();
        DiagnosisUnknowns {
            list: self.list.clone(),
            held: Vec::new(),
            columns: self.columns.iter().map(free).collect(),
        }
    }

    /// What a column is of.
    pub fn of_column(&self, index: usize) -> Unknown {
        match index.checked_sub(self.len()) {
            Some(held) => self.held[held],
            None => self.list[index],
        }
    }

    pub fn len(&self) -> usize {
        self.list.len()
    }
}

/// Adds a step to a model; slopes stay positive.
pub fn step(model: &mut AugmentedModel, unknowns: &DiagnosisUnknowns, delta: &[f64]) {
    let model = &mut model.model;
    for (unknown, d) in unknowns.list.iter().zip(delta) {
        match *unknown {
            Unknown::Theta(i) => model.theta[i] += d,
            Unknown::Offset(j) => model.offset[j] += d,
            Unknown::Friction { joint, k } => match &mut model.friction[joint] {
                JointFriction::None => {}
                JointFriction::ViscousCoulomb(law) => {
                    *[&mut law.viscous, &mut law.coulomb][k] += d;
                }
                JointFriction::DoubleTanh(law) => {
                    let mut p = law.parameters();
                    let free = p[k] + d;
                    // a slope stays positive and moves by a factor of two at most
                    let [least, most] = [0.5, 2.0].map(|times| times * p[k]);
                    p[k] = if k < 3 { free } else { free.clamp(least, most) };
                    *law = DoubleTanh::from_parameters(p);
                }
            },
        }
    }
}

/// Value of an unknown in a model.
pub fn value_of(model: &AugmentedModel, unknown: Unknown) -> f64 {
    match unknown {
        Unknown::Theta(i) => model.model.theta[i],
        Unknown::Offset(j) => model.model.offset[j],
        Unknown::Friction { joint, k } => match &model.model.friction[joint] {
            JointFriction::None => 0.0,
            JointFriction::DoubleTanh(law) => law.parameters()[k],
            JointFriction::ViscousCoulomb(law) => [law.viscous, law.coulomb][k],
        },
    }
}
