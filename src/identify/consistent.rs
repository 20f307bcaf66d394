//! Physically consistent links: parameters of bodies that can exist, and by how much the fit suffers.

use std::collections::BTreeMap;

use super::error::IdentifyError;
use super::estimate::Estimated;
use super::logged_robot::LoggedRobot;
use crate::config::ModelFile;
use crate::config::model_file::LinkBody;
use crate::inertia::feasible::{ConsistencyProblem, Feasible, feasible};
use crate::inertia::solve::{factor, residual_of, weights_of};
use crate::math::descent::Ending;
use crate::robot::bodies::StandardMap;
use crate::robot::standard::{Body, pseudo_inertia};

/// Physically consistent links, and what they cost.
pub struct ConsistentLinks {
    pub map: StandardMap,
    pub found: Feasible,
    /// Relative residual per joint of the free fit and of the feasible one.
    pub before: Vec<f64>,
    pub after: Vec<f64>,
}

/// Puts the feasible parameters that are nearest in torque in place of the free ones. The
/// covariance stays that of the free fit.
///
/// # Errors
/// A prior that is no body, and [`crate::inertia::solve::FitError`].
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
    let before = fit.relative_error.clone();
    for j in 0..bound.len() {
        let growth = if free[j] > 0.0 {
            bound[j] / free[j]
        } else {
            1.0
        };
        fit.residual_std[j] *= growth;
        fit.relative_error[j] *= growth;
    }
    fit.theta = &found.theta + &basis.shift;
    Ok(ConsistentLinks {
        map,
        found,
        before,
        after: fit.relative_error.clone(),
    })
}

impl ConsistentLinks {
    /// Name of a joint.
    pub fn joint(machine: &LoggedRobot, j: usize) -> &str {
        machine
            .robot
            .joint_names()
            .get(j)
            .map_or("", String::as_str)
    }

    /// Names of the drives with their inertias.
    pub fn drives<'a>(
        &'a self,
        machine: &'a LoggedRobot,
    ) -> impl Iterator<Item = (&'a str, f64)> + 'a {
        let drives = self.map.drives.iter().zip(&self.found.drives);
        drives.map(|(j, inertia)| (Self::joint(machine, *j), *inertia))
    }

    /// Name, body and smallest eigenvalue of the pseudo-inertia of every link.
    pub fn bodies(&self) -> impl Iterator<Item = (&String, Body, f64)> + '_ {
        self.map
            .links
            .iter()
            .zip(&self.found.links)
            .map(|(name, s)| {
                let least = pseudo_inertia(s).symmetric_eigenvalues().min();
                (name, Body::of(s), least)
            })
    }

    /// What did not come as it should, as warnings.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut out = vec![format!(
            "parameters are those of links that can exist; standard deviations are those of the free fit, and what torques do not tell of the links is filled by {}",
            match self.found.given.iter().filter(|g| **g).count() {
                0 => "a plain body each (2 kg, radius of gyration 0.1 m)".to_owned(),
                n if n == self.found.given.len() => "the robot file's `inertial`".to_owned(),
                n => format!(
                    "the robot file's `inertial` of {n} links and a plain body for the others"
                ),
            }
        )];
        if self.found.ending == Ending::IterationLimit {
            out.push("the search for feasible links did not settle; its last result stands".into());
        }
        out
    }

    /// Writes the links into a model.
    pub(super) fn write_into(&self, machine: &LoggedRobot, model: &mut ModelFile) {
        model.links = self
            .bodies()
            .map(|(name, body, _)| LinkBody {
                name: name.clone(),
                mass: body.mass,
                centre: body.centre,
                inertia: body.inertia,
            })
            .collect();
        let drives = self.drives(machine).map(|(joint, x)| (joint.to_owned(), x));
        model.drive_inertia = drives.collect::<BTreeMap<_, _>>();
    }
}
