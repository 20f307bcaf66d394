//! Between a model file and the numbers that formulas work with.

use super::ConfigError;
use super::model_file::{Covariance, ModelFile, Parameter};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::{JointFriction, Model};

/// Unit of a friction parameter of joint `j` by its name.
pub fn friction_unit(robot: &Robot, j: usize, name: &str, torque_unit: &str) -> String {
    let position = robot.joint_kind(j).position_unit();
    match name {
        "viscous" => format!("{torque_unit} s/{position}"),
        "slope_1" | "slope_2" => format!("s/{position}"),
        _ => torque_unit.to_owned(),
    }
}

/// Unit of an inertial parameter: the robot's own `si`, or, for a joint whose torque channel is left
/// in A, current per acceleration.
pub fn inertia_unit(robot: &Robot, si: &str, torque_unit: &str) -> String {
    robot.joint_kind(0).inertial_unit(si, torque_unit)
}

/// Meaning of a friction parameter.
pub fn friction_meaning(name: &str) -> &'static str {
    match name {
        "viscous" => "Bv: viscous friction",
        "coulomb_1" => "Bf1: height of the steeper saturating part",
        "coulomb_2" => "Bf2: height of the other saturating part; negative for a Stribeck dip",
        "slope_1" => "w1: slope of the steeper saturating part",
        "slope_2" => "w2: slope of the other saturating part",
        "coulomb" => "Fc: Coulomb friction",
        "offset" => "constant torque",
        _ => "",
    }
}

impl Covariance {
    /// Pairs of parameters whose errors correlate by `least` or more, the strongest first.
    pub fn correlated(&self, least: f64) -> Vec<([&str; 2], f64)> {
        let at = |i: usize, j: usize| self.matrix.get(i).and_then(|row| row.get(j)).copied();
        let mut found = Vec::new();
        for i in 0..self.names.len() {
            for j in 0..i {
                let (Some(a), Some(b), Some(both)) = (at(i, i), at(j, j), at(i, j)) else {
                    continue;
                };
                let correlation = both / (a * b).sqrt();
                if correlation.is_finite() && correlation.abs() >= least {
                    found.push((correlation, j, i));
                }
            }
        }
        found.sort_by(|x, y| {
            let places = (x.1, x.2).cmp(&(y.1, y.2));
            y.0.abs().total_cmp(&x.0.abs()).then(places)
        });
        let named = |(correlation, i, j): (f64, usize, usize)| {
            ([i, j].map(|k| self.names[k].as_str()), correlation)
        };
        found.into_iter().map(named).collect()
    }
}

impl ModelFile {
    /// The model that the file describes; `file` names it in errors.
    ///
    /// # Errors
    /// [`ConfigError::MissingParameter`] for the first inertial or friction parameter it lacks.
    pub fn model(&self, file: &str) -> Result<Model, ConfigError> {
        self.model_with(file, self.inertial(file)?)
    }

    /// The model of a file that may hold friction alone, as `friction` writes it: with inertias of 0 then, for
    /// what asks for no torque.
    ///
    /// # Errors
    /// [`ConfigError::MissingParameter`] for the first friction parameter that it lacks, or the first inertial
    /// one where it has some.
    pub fn model_or_friction(&self, file: &str) -> Result<Model, ConfigError> {
        let robot = self.robot.robot();
        let mut inertial = robot.parameters().iter();
        if inertial.any(|p| self.find(&p.name, None).is_some()) {
            return self.model(file);
        }
        self.model_with(file, vec![0.0; robot.parameters().len()])
    }

    fn model_with(&self, file: &str, theta: Vec<f64>) -> Result<Model, ConfigError> {
        let robot = self.robot.robot();
        let mut friction = Vec::with_capacity(robot.joints());
        let mut offset = Vec::with_capacity(robot.joints());
        for joint in robot.joint_names() {
            friction.push(self.joint_friction(file, joint)?);
            offset.push(self.offset(joint));
        }
        Ok(Model {
            robot,
            theta,
            friction,
            offset,
        })
    }

    /// Friction of one joint by the law whose parameters the file holds; `file` names it in errors.
    ///
    /// # Errors
    /// [`ConfigError::MissingParameter`] where it holds a part of a law.
    pub fn joint_friction(&self, file: &str, joint: &str) -> Result<JointFriction, ConfigError> {
        let has = |name| self.find(name, Some(joint)).is_some();
        Ok(if !has("slope_1") && has("coulomb") {
            JointFriction::ViscousCoulomb(self.viscous_coulomb(file, joint)?)
        } else if has("slope_1") || has("viscous") {
            // a viscous term alone is half a law: say what is missing
            JointFriction::DoubleTanh(self.double_tanh(file, joint)?)
        } else {
            JointFriction::None
        })
    }

    /// Second moments, in the order of [`Model::parameters`], of what the parameters in use are off the true ones: the
    /// covariance of the estimates, and what a model that predicts with other numbers is off those. Row-major; 0 where
    /// unknown.
    pub fn model_covariance(&self, model: &Model) -> Vec<f64> {
        let (inertial, joints) = (model.robot.parameters(), model.robot.joint_names());
        let mut keys: Vec<String> = inertial.iter().map(|p| p.name.to_string()).collect();
        for (joint, friction) in joints.iter().zip(&model.friction) {
            let names: &[&str] = match friction {
                JointFriction::None => &[],
                JointFriction::DoubleTanh(_) => &DoubleTanh::NAMES,
                JointFriction::ViscousCoulomb(_) => &ViscousCoulomb::NAMES,
            };
            keys.extend(names.iter().map(|n| format!("{n}:{joint}")));
        }
        keys.extend(joints.iter().map(|j| format!("offset:{j}")));
        let mut moments = self.estimated_covariance_of(&keys);
        let off: Vec<f64> = keys.iter().map(|key| self.off_estimate(key)).collect();
        for (row, a) in moments.chunks_exact_mut(keys.len().max(1)).zip(&off) {
            row.iter_mut().zip(&off).for_each(|(x, b)| *x += a * b);
        }
        moments
    }

    /// What the parameter of a key in use is off its estimate, where one stands beside it.
    fn off_estimate(&self, key: &str) -> f64 {
        let estimate = self.estimates.iter().find(|e| match &e.joint {
            Some(joint) => key.strip_suffix(joint.as_str()) == Some(&format!("{}:", e.name)),
            None => e.name == key,
        });
        let parameter = self.parameters.iter().find(|p| p.key() == key);
        let pair = parameter.zip(estimate);
        pair.map_or(0.0, |(parameter, estimate)| {
            parameter.in_use() - estimate.value
        })
    }

    /// Puts a joint's friction parameters in place of those that the file has of it, of which the covariance
    /// then says nothing any more.
    pub fn replace_joint(&mut self, joint: &str, parameters: Vec<Parameter>) {
        let kept = |p: &Parameter| p.joint.as_deref() != Some(joint) || p.name == "offset";
        let dropped: Vec<String> = (self.parameters.iter())
            .filter(|p| !kept(p))
            .map(Parameter::key)
            .collect();
        self.forget_covariance(&dropped);
        self.parameters.retain(kept);
        self.parameters.extend(parameters);
    }

    /// Takes parameters out of the covariance, of which it says nothing any more.
    pub fn forget_covariance(&mut self, keys: &[String]) {
        let Some(old) = self.covariance.take() else {
            return;
        };
        let kept: Vec<usize> = (0..old.names.len())
            .filter(|i| !keys.contains(&old.names[*i]))
            .collect();
        let of = |i: &usize| kept.iter().map(|j| old.matrix[*i][*j]).collect();
        self.covariance = Some(Covariance {
            names: kept.iter().map(|i| old.names[*i].clone()).collect(),
            matrix: kept.iter().map(of).collect(),
        });
    }

    /// Puts a block of covariance in place of what the file has between these keys; entries between
    /// them and other keys are dropped.
    pub fn replace_covariance(&mut self, keys: &[String], block: &dyn Fn(usize, usize) -> f64) {
        self.forget_covariance(keys);
        let Covariance { names, matrix } = self.covariance.get_or_insert_default();
        for row in matrix.iter_mut() {
            row.resize(names.len() + keys.len(), 0.0);
        }
        for i in 0..keys.len() {
            let before = vec![0.0; names.len()];
            let own = (0..keys.len()).map(|j| block(i, j));
            matrix.push(before.into_iter().chain(own).collect());
        }
        names.extend_from_slice(keys);
    }
}
