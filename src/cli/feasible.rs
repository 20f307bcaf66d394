//! `lsq --feasible`: physically consistent links, and by how much the fit suffers.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::CliError;
use super::estimate::Estimated;
use super::machine::Machine;
use crate::config::ModelFile;
use crate::config::model_file::LinkBody;
use crate::inertia::feasible::{ConsistencyProblem, Feasible, PRIOR_WEIGHT, feasible};
use crate::inertia::robust::Status;
use crate::inertia::solve::{factor, residual_of, weights_of};
use crate::number;
use crate::report::table::{Align, Table, hanging, unbroken};
use crate::robot::bodies::StandardMap;
use crate::robot::standard::{Body, pseudo_inertia};

/// Physically consistent links, and what they cost.
pub struct Physical {
    map: StandardMap,
    found: Feasible,
    /// Relative residual per joint of the free fit and of the feasible one.
    before: Vec<f64>,
    after: Vec<f64>,
}

/// Puts the feasible parameters that are nearest in torque in place of the free ones. The
/// covariance stays that of the free fit.
///
/// # Errors
/// A prior that is no body, and [`crate::inertia::solve::FitError`].
pub fn physical(machine: &Machine, estimated: &mut Estimated) -> Result<Physical, CliError> {
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
    Ok(Physical {
        map,
        found,
        before,
        after: fit.relative_error.clone(),
    })
}

impl Physical {
    fn joint(machine: &Machine, j: usize) -> &str {
        machine
            .robot
            .joint_names()
            .get(j)
            .map_or("", String::as_str)
    }

    /// Names of the drives with their inertias.
    fn drives<'a>(&'a self, machine: &'a Machine) -> impl Iterator<Item = (&'a str, f64)> + 'a {
        let drives = self.map.drives.iter().zip(&self.found.drives);
        drives.map(|(j, inertia)| (Self::joint(machine, *j), *inertia))
    }

    fn bodies(&self) -> impl Iterator<Item = (&String, Body, f64)> + '_ {
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
    pub fn warnings(&self) -> Vec<String> {
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
        if self.found.status == Status::IterationLimit {
            out.push("the search for feasible links did not settle; its last result stands".into());
        }
        out
    }

    /// The field `feasible` of the document.
    pub fn json(&self, machine: &Machine) -> Value {
        let links: Vec<Value> = self
            .bodies()
            .zip(&self.found.given)
            .map(|((name, body, least), given)| {
                json!({
                    "name": name,
                    "mass": body.mass,
                    "centre": body.centre,
                    "inertia": body.inertia,
                    "smallest_eigenvalue": least,
                    "prior": if *given { "robot-file" } else { "plain-body" },
                })
            })
            .collect();
        let drives: Vec<Value> = self
            .drives(machine)
            .map(|(joint, inertia)| json!({ "joint": joint, "inertia": inertia }))
            .collect();
        let per_joint = |errors: &[f64]| -> Vec<Value> {
            let all = errors.iter().enumerate();
            all.map(|(j, e)| json!({ "joint": Self::joint(machine, j), "relative_error": e }))
                .collect()
        };
        json!({
            "links": links,
            "drives": drives,
            "relative_error_before": per_joint(&self.before),
            "relative_error_after": per_joint(&self.after),
            "prior_weight": PRIOR_WEIGHT,
            "iterations": self.found.iterations,
            "status": self.found.status,
        })
    }

    /// The same for a person.
    pub fn text(&self, machine: &Machine) -> String {
        let rows: Vec<Vec<String>> = self
            .bodies()
            .map(|(name, body, _)| {
                let mut row = vec![name.clone(), number::significant(body.mass, 4)];
                row.extend(body.centre.map(|x| number::significant(x, 3)));
                let [xx, _, _, yy, _, zz] = body.inertia;
                row.extend([xx, yy, zz].map(|x| number::significant(x, 3)));
                row
            })
            .collect();
        let numbers =
            ["mass", "x", "y", "z", "Ixx", "Iyy", "Izz"].map(|name| (name, Align::Decimal));
        let mut columns = vec![("link", Align::Left)];
        columns.extend(numbers);
        let mut table = Table::new(&columns).caption(
            "links that can exist: kg, centre of gravity in m, moments about it in kg m^2",
        );
        for row in rows {
            table.row(row);
        }
        let mut out = table.to_string();
        let drives: Vec<String> = self
            .drives(machine)
            .map(|(joint, inertia)| format!("{joint} {}", number::significant(inertia, 3)))
            .collect();
        if !drives.is_empty() {
            out += &format!("drive inertias: {}\n", drives.join(", "));
        }
        let change: Vec<String> = self
            .before
            .iter()
            .zip(&self.after)
            .enumerate()
            .map(|(j, (before, after))| {
                unbroken(&format!(
                    "{} {} to {}",
                    Self::joint(machine, j),
                    number::percent(*before),
                    number::percent(*after)
                ))
            })
            .collect();
        let told = format!("the fit suffers: {}", change.join(", "));
        out += &hanging("", &told, 2);
        out
    }

    /// Writes the links into a model.
    pub fn write_into(&self, machine: &Machine, model: &mut ModelFile) {
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
