//! The unknowns of a fit: which columns the rows have, and what the data say about each.

use super::error::IdentifyError;
use super::logged_robot::LoggedRobot;
use crate::config::ModelFile;
use crate::config::identified::{friction_meaning, friction_unit, inertia_unit};
use crate::config::model_file::Parameter;
use crate::inertia::columns::{KnownFriction, Own, RegressorColumns};
use crate::inertia::solve::Fit;
use crate::inertia::verdict::verdict;
use crate::robot::friction::DoubleTanh;
use crate::verdict::Verdict;

/// One unknown of the fit with what the data say about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Short name, that of the model file.
    pub name: String,
    /// The combination of standard parameters that it stands for, where that is its name.
    pub grouping: Option<String>,
    pub theta: Option<u32>,
    pub joint: Option<String>,
    pub unit: String,
    pub meaning: String,
    pub value: f64,
    pub std: f64,
    pub verdict: Verdict,
    pub negligible: bool,
}

impl Unknown {
    /// Standard deviation over the size of the value.
    pub fn relative_std(&self) -> f64 {
        self.std / self.value.abs()
    }

    /// The parameter as a model file holds it: the value is kept even where the data do not
    /// determine it, for the torque is computed with all of them together.
    pub(super) fn parameter(&self) -> Parameter {
        Parameter {
            name: self.name.clone(),
            theta: self.theta,
            joint: self.joint.clone(),
            value: self.value,
            std: self.std.is_finite().then_some(self.std),
            unit: self.unit.clone(),
            meaning: self.meaning.clone(),
            verdict: Some(self.verdict),
        }
    }
}

/// Which columns this robot's rows have.
pub(super) fn columns(
    machine: &LoggedRobot,
    friction: Option<(&str, &ModelFile)>,
) -> Result<RegressorColumns, IdentifyError> {
    let robot = &machine.robot;
    let n = robot.joints();
    let section = &machine.file.friction;
    let mut own = vec![Vec::new(); n];
    let mut known = vec![None; n];
    for (j, joint) in robot.joint_names().iter().enumerate() {
        match friction {
            Some((file, model)) => {
                let law = model.double_tanh(file, joint)?;
                let keys: Vec<String> = DoubleTanh::NAMES
                    .iter()
                    .map(|n| format!("{n}:{joint}"))
                    .collect();
                let flat = model.covariance_of(&keys);
                let covariance = std::array::from_fn(|a| std::array::from_fn(|b| flat[a * 5 + b]));
                known[j] = Some(KnownFriction { law, covariance });
            }
            None => own[j].extend([Own::Viscous, Own::Coulomb]),
        }
        if section.offset {
            own[j].push(Own::Offset);
        }
    }
    Ok(RegressorColumns {
        joints: n,
        shared: robot.parameters().len(),
        own,
        known,
    })
}

/// Every unknown, in the order of the columns.
pub(super) fn unknowns(
    machine: &LoggedRobot,
    columns: &RegressorColumns,
    fit: &Fit,
) -> Vec<Unknown> {
    let robot = &machine.robot;
    let rate = |i: usize, value: f64| {
        let std = fit.covariance[(i, i)].max(0.0).sqrt();
        let share = (0..columns.joints)
            .filter(|j| fit.torque_rms[*j] > 0.0)
            .map(|j| 2.0 * std * fit.column_rms[(j, i)] / fit.torque_rms[j])
            .fold(0.0, f64::max);
        let (verdict, negligible) = verdict(value, std, fit.determined[i], share);
        (std, verdict, negligible)
    };
    let mut out = Vec::with_capacity(columns.unknowns());
    for (i, info) in robot.parameters().iter().enumerate() {
        let value = fit.theta[i];
        let (std, verdict, negligible) = rate(i, value);
        let grouped = i < robot.groupings().len();
        out.push(Unknown {
            name: info.name.to_string(),
            grouping: grouped.then(|| info.meaning.to_string()),
            theta: info.theta,
            joint: None,
            unit: inertia_unit(robot, &info.unit, machine.file.torque_unit(0)),
            meaning: info.meaning.to_string(),
            value,
            std,
            verdict,
            negligible,
        });
    }
    for (j, joint) in robot.joint_names().iter().enumerate() {
        for own in &columns.own[j] {
            let i = out.len();
            let value = fit.theta[i];
            let (std, verdict, negligible) = rate(i, value);
            out.push(Unknown {
                name: own.name().to_owned(),
                grouping: None,
                theta: None,
                joint: Some(joint.clone()),
                unit: friction_unit(robot, j, own.name(), machine.file.torque_unit(j)),
                meaning: friction_meaning(own.name()).to_owned(),
                value,
                std,
                verdict,
                negligible,
            });
        }
    }
    out
}
