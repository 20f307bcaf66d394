//! The unknowns of a fit: which columns the rows have, and what the data say about each.

use schemars::JsonSchema;
use serde::Serialize;

use super::robot_setup::RobotSetup;
use cft_ident_core::inertia::columns::{JointTerm, KnownFriction, RegressorColumns};
use cft_ident_core::inertia::essential::EssentialParameters;
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::inertia::verdict::verdict;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::identified::{friction_meaning, friction_unit, inertia_unit};
use cft_ident_files::config::model_file::Parameter;

/// One unknown of the fit with what the data say about it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FittedUnknown {
    /// The combination of standard parameters that it stands for, else its short name.
    pub name: String,
    /// Short name, that of the model file.
    pub key: String,
    /// Number in the report's Table 4, where it has one.
    pub theta: Option<u32>,
    /// Joint that it belongs to alone.
    pub joint: Option<String>,
    /// Estimate \[unit\]; null where the data do not determine it.
    pub value: Option<f64>,
    /// Its standard deviation \[unit\].
    pub std: Option<f64>,
    /// Standard deviation over the size of the value.
    pub relative_std: Option<f64>,
    pub unit: String,
    pub verdict: Verdict,
    /// Its torque is not worth mentioning: it is identified though uncertain.
    pub negligible: bool,
    /// The data are really about it.
    pub essential: bool,
    /// What it is, in words.
    #[serde(skip)]
    pub meaning: String,
    /// Fitted value \[unit\], also where the data do not determine it: the torque is computed with all
    /// of them together.
    #[serde(skip)]
    pub fitted: f64,
    /// Standard deviation of that \[unit\].
    #[serde(skip)]
    pub fitted_std: f64,
}

impl FittedUnknown {
    /// Standard deviation of the fitted value over its size.
    pub fn fitted_relative_std(&self) -> f64 {
        self.fitted_std / self.fitted.abs()
    }

    /// The parameter as a model file holds it.
    pub(crate) fn parameter(&self) -> Parameter {
        Parameter {
            name: self.key.clone(),
            theta: self.theta,
            joint: self.joint.clone(),
            value: self.fitted,
            consistent: None,
            std: self.fitted_std.is_finite().then_some(self.fitted_std),
            unit: self.unit.clone(),
            meaning: self.meaning.clone(),
            verdict: Some(self.verdict),
        }
    }
}

/// Which columns this robot's rows have.
pub(crate) fn columns(setup: &RobotSetup, friction: Option<&[KnownFriction]>) -> RegressorColumns {
    let robot = &setup.robot;
    let n = robot.joints();
    let section = &setup.file.friction;
    let mut own = vec![Vec::new(); n];
    let mut known = vec![None; n];
    for j in 0..n {
        match friction {
            Some(of_joints) => known[j] = Some(of_joints[j].clone()),
            None => own[j].extend([JointTerm::Viscous, JointTerm::Coulomb]),
        }
        if section.offset {
            own[j].push(JointTerm::Offset);
        }
    }
    RegressorColumns {
        joints: n,
        shared: robot.parameters().len(),
        own,
        known,
        rest_speed: Vec::new(),
    }
}

/// Every unknown, in the order of the columns.
pub(crate) fn unknowns(
    setup: &RobotSetup,
    columns: &RegressorColumns,
    fit: &Fit,
    essential: &EssentialParameters,
) -> Vec<FittedUnknown> {
    let robot = &setup.robot;
    // of the unknown in column i
    let rated = |i: usize, key: &str, unit: String, meaning: &str| {
        let fitted = fit.theta[i];
        let std = fit.covariance[(i, i)].max(0.0).sqrt();
        let share = (0..columns.joints)
            .filter(|j| fit.torque_rms[*j] > 0.0)
            .map(|j| 2.0 * std * fit.column_rms[(j, i)] / fit.torque_rms[j])
            .fold(0.0, f64::max);
        let (verdict, negligible) = verdict(fitted, std, fit.determined[i], share);
        let known = verdict != Verdict::NotIdentifiable;
        FittedUnknown {
            name: key.to_owned(),
            key: key.to_owned(),
            theta: None,
            joint: None,
            value: known.then_some(fitted),
            std: known.then_some(std),
            relative_std: known.then(|| std / fitted.abs()),
            unit,
            verdict,
            negligible,
            essential: essential.essential[i],
            meaning: meaning.to_owned(),
            fitted,
            fitted_std: std,
        }
    };
    let mut out = Vec::with_capacity(columns.unknowns());
    for (i, info) in robot.parameters().iter().enumerate() {
        let unit = inertia_unit(robot, &info.unit, setup.file.inertial_torque_unit());
        let mut unknown = rated(i, &info.name, unit, &info.meaning);
        if i < robot.groupings().len() {
            unknown.name.clone_from(&unknown.meaning);
        }
        unknown.theta = info.theta;
        out.push(unknown);
    }
    for (j, joint) in robot.joint_names().iter().enumerate() {
        for own in &columns.own[j] {
            let name = own.name();
            let unit = friction_unit(robot, j, name, setup.file.torque_unit(j));
            let mut unknown = rated(out.len(), name, unit, friction_meaning(name));
            unknown.joint = Some(joint.clone());
            out.push(unknown);
        }
    }
    out
}
