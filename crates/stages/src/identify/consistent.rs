//! Physically consistent links: parameters of bodies that can exist, and by how much the fit suffers.

use schemars::JsonSchema;
use serde::Serialize;

use super::error::IdentifyError;
use super::estimate::Estimated;
use super::logged_robot::LoggedRobot;
use super::residual::RelativeError;
use cft_ident_core::inertia::feasible::{ConsistencyProblem, PRIOR_WEIGHT, feasible};
use cft_ident_core::inertia::solve::{factor, residual_of, weights_of};
use cft_ident_core::math::descent::Ending;
use cft_ident_core::robot::standard::{Body, STANDARD, pseudo_inertia};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::LinkBody;

/// Physically consistent links, and what they cost.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ConsistentLinks {
    pub links: Vec<ConsistentLink>,
    pub drives: Vec<DriveInertia>,
    /// Residual of the free fit.
    pub relative_error_before: Vec<RelativeError>,
    /// Residual of the consistent one.
    pub relative_error_after: Vec<RelativeError>,
    /// Weight of the prior beside the rows.
    pub prior_weight: f64,
    pub iterations: usize,
    pub status: Ending,
}

/// A link that can exist.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ConsistentLink {
    pub name: String,
    /// \[kg\]
    pub mass: f64,
    /// Centre of gravity in the link's frame \[m\].
    pub centre: [f64; 3],
    /// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the centre of gravity \[kg m^2\].
    pub inertia: [f64; 6],
    /// Of the pseudo-inertia; positive for a body that can exist.
    pub smallest_eigenvalue: f64,
    pub prior: LinkPrior,
}

/// What fills in where torques tell nothing of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LinkPrior {
    /// Its `inertial` in the robot file.
    RobotFile,
    /// A plain body of 2 kg.
    PlainBody,
}

/// Inertia of a drive at its joint.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DriveInertia {
    pub joint: String,
    /// \[kg m^2 or kg\]
    pub inertia: f64,
}

/// Puts the feasible parameters that are nearest in torque in place of the free ones. The
/// covariance stays that of the free fit.
///
/// # Errors
/// A prior that is no body, and [`cft_ident_core::inertia::solution::FitError`].
pub(super) fn consistent(
    machine: &LoggedRobot,
    estimated: &mut Estimated,
) -> Result<ConsistentLinks, IdentifyError> {
    let map = machine.robot.standard_map();
    let body = |i: usize| {
        let given = machine.file.robot.link.get(i)?.inertial.as_ref()?;
        Some(given.body())
    };
    let bodies: Vec<Option<Body>> = (0..map.links.len()).map(body).collect();
    let basis = &estimated.basis;
    let fit = &mut estimated.fit;
    let weights = weights_of(
        &basis.sums,
        &residual_of(&basis.sums, &(&fit.theta - &basis.shift))?,
    );
    let found = feasible(&ConsistencyProblem {
        map: &map,
        bodies: &bodies,
        factor: &factor(&basis.sums, &weights)?,
        effective: fit.effective_rows / fit.rows as f64,
    })?;
    // on the rows of the fit, which a robust one has weighted; the residual of all rows grows alike
    let free = residual_of(&basis.sums, &(&fit.theta - &basis.shift))?;
    let bound = residual_of(&basis.sums, &found.theta)?;
    let before: Vec<f64> = fit.relative_error.iter().map(|e| e.all).collect();
    for j in 0..bound.len() {
        let growth = if free[j] > 0.0 {
            bound[j] / free[j]
        } else {
            1.0
        };
        fit.residual_std[j] *= growth;
        fit.relative_error[j].grow(growth);
    }
    let after: Vec<f64> = fit.relative_error.iter().map(|e| e.all).collect();
    fit.theta = &found.theta + &basis.shift;
    let links = map.links.iter().zip(&found.links).zip(&found.given);
    let link = |((name, s), given): ((&String, &[f64; STANDARD]), &bool)| {
        let body = Body::of(s);
        ConsistentLink {
            name: name.clone(),
            mass: body.mass,
            centre: body.centre,
            inertia: body.inertia,
            smallest_eigenvalue: pseudo_inertia(s).symmetric_eigenvalues().min(),
            prior: match given {
                true => LinkPrior::RobotFile,
                false => LinkPrior::PlainBody,
            },
        }
    };
    let joints = machine.robot.joint_names();
    let drives = map.drives.iter().zip(&found.drives);
    let drive = |(j, inertia): (&usize, &f64)| DriveInertia {
        joint: joints.get(*j).cloned().unwrap_or_default(),
        inertia: *inertia,
    };
    Ok(ConsistentLinks {
        links: links.map(link).collect(),
        drives: drives.map(drive).collect(),
        relative_error_before: RelativeError::each(machine, &before),
        relative_error_after: RelativeError::each(machine, &after),
        prior_weight: PRIOR_WEIGHT,
        iterations: found.iterations,
        status: found.ending,
    })
}

impl ConsistentLinks {
    /// What did not come as it should, as warnings.
    pub(super) fn warnings(&self) -> Vec<String> {
        let given = self.links.iter();
        let given = given.filter(|l| l.prior == LinkPrior::RobotFile).count();
        let mut out = vec![format!(
            "parameters are those of links that can exist; standard deviations are those of the free fit, and what the torques do not determine of the links is set by {}",
            match given {
                0 => "a plain body each (2 kg, radius of gyration 0.1 m)".to_owned(),
                n if n == self.links.len() => "the robot file's `inertial`".to_owned(),
                n => format!(
                    "the robot file's `inertial` of {n} links and a plain body for the others"
                ),
            }
        )];
        if self.status == Ending::IterationLimit {
            out.push("the search for feasible links did not settle; its last result stands".into());
        }
        out
    }

    /// Writes the links into a model.
    pub(super) fn write_into(&self, model: &mut ModelFile) {
        let body = |link: &ConsistentLink| LinkBody {
            name: link.name.clone(),
            mass: link.mass,
            centre: link.centre,
            inertia: link.inertia,
        };
        model.links = self.links.iter().map(body).collect();
        let drives = self.drives.iter();
        let drives = drives.map(|drive| (drive.joint.clone(), drive.inertia));
        model.drive_inertia = drives.collect();
    }
}
