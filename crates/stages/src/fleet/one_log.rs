//! What one reduced log or model says about a robot's parameters by itself.

use crate::fit::estimate::estimate;
use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::lsq_rows::LsqRows;
use crate::input::reduced::reduced_log::ReducedLog;
use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::columns;
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::identified::{friction_unit, inertia_unit};
use cft_ident_files::config::model_file::Parameter;
use cft_ident_files::config::{ModelFile, RobotFile};

/// What one source says about one parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OneEstimate {
    pub name: String,
    pub joint: Option<String>,
    pub unit: String,
    pub value: f64,
    /// Infinite where it is not determined.
    pub variance: f64,
}

impl OneEstimate {
    pub(crate) fn is(&self, other: &Self) -> bool {
        (&self.name, &self.joint) == (&other.name, &other.joint)
    }

    /// Whether it is a size of its joint's friction, which all of them change with.
    pub(crate) fn is_friction(&self) -> bool {
        self.joint.is_some() && (self.name == "viscous" || self.name.starts_with("coulomb"))
    }
}

/// What one source says.
#[derive(Debug, Clone, Default)]
pub(crate) struct Source {
    pub estimates: Vec<OneEstimate>,
    /// Covariance in their order, row by row; 0 where unknown.
    covariance: Vec<f64>,
}

impl Source {
    /// Correlation of the errors of two parameters, where both are determined.
    pub(crate) fn correlation(&self, one: &OneEstimate, other: &OneEstimate) -> Option<f64> {
        let place = |of: &OneEstimate| self.estimates.iter().position(|t| t.is(of));
        let (i, j) = (place(one)?, place(other)?);
        let n = self.estimates.len();
        let norm = (self.estimates[i].variance * self.estimates[j].variance).sqrt();
        let covariance = *self.covariance.get(i * n + j)?;
        norm.is_finite().then_some(covariance / norm)
    }

    /// What a model says.
    pub(crate) fn of_model(file: &ModelFile) -> Self {
        let estimate = |p: &Parameter| {
            let known = p.verdict != Some(Verdict::NotIdentifiable);
            let std = p.std.filter(|std| known && *std > 0.0);
            OneEstimate {
                name: p.name.clone(),
                joint: p.joint.clone(),
                unit: p.unit.clone(),
                value: p.value,
                variance: std.map_or(f64::INFINITY, |std| std * std),
            }
        };
        let keys: Vec<String> = file.parameters.iter().map(Parameter::key).collect();
        Source {
            estimates: file.parameters.iter().map(estimate).collect(),
            covariance: file.covariance_of(&keys),
        }
    }

    /// What a reduced log says by itself; all that is not determined has an infinite variance.
    pub(crate) fn of_part(part: &ReducedLog, control: &Control) -> Result<Self, IdentifyError> {
        let name = format!("the robot file of {}", part.name().replace('.', "-"));
        let file = RobotFile::parse(&name, &part.made_with.robot_file)?;
        let setup = RobotSetup::new(&name, file);
        part.belongs_to_robot(&setup.file)?;
        let known = part.known_friction();
        let linear = columns(&setup, known.as_deref());
        let mut rows = LsqRows::of_reduced(&setup, part, control);
        let found = match estimate(&mut rows, linear.clone(), EstimatorKind::Wls, false) {
            Ok(found) => Some(found.fit),
            // a log that says nothing is a log that says nothing
            Err(IdentifyError::Fit(_)) => None,
            Err(error) => return Err(error),
        };
        let robot = &setup.robot;
        let inertial = robot.parameters().iter().map(|info| {
            let unit = inertia_unit(robot, &info.unit, setup.file.inertial_torque_unit());
            (info.name.to_string(), None, unit)
        });
        let joints = robot.joint_names().iter().enumerate();
        let own = joints.flat_map(|(j, joint)| {
            let unit = setup.file.torque_unit(j);
            linear.own[j].iter().map(move |own| {
                let unit = friction_unit(robot, j, own.name(), unit);
                (own.name().to_owned(), Some(joint.clone()), unit)
            })
        });
        let named = inertial.chain(own).enumerate();
        let estimates: Vec<OneEstimate> = named
            .map(|(i, (name, joint, unit))| {
                let fitted = found.as_ref().filter(|fit| fit.determined[i]);
                let variance = fitted.map(|fit| fit.covariance[(i, i)]);
                OneEstimate {
                    name,
                    joint,
                    unit,
                    value: fitted.map_or(0.0, |fit| fit.theta[i]),
                    variance: variance.filter(|v| *v > 0.0).unwrap_or(f64::INFINITY),
                }
            })
            .collect();
        let n = estimates.len();
        let of = |fit: &Fit| {
            let places = (0..n * n).map(|k| (k / n, k % n));
            places.map(|(i, j)| fit.covariance[(i, j)]).collect()
        };
        Ok(Source {
            covariance: found.as_ref().map(of).unwrap_or_default(),
            estimates,
        })
    }
}
