//! Physically consistent parameters beside those of the plain fit: bodies and drives that can exist, friction that
//! takes power. They are the nearest in the metric of the fit's information matrix.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use schemars::JsonSchema;
use serde::Serialize;

use super::estimate::InertialEstimate;
use crate::input::error::IdentifyError;
use crate::input::robot_setup::RobotSetup;
use crate::note::FitNote;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::inertia::feasible::{
    ConsistencyProblem, FeasibleParameters, FrictionColumns, PRIOR_WEIGHT, feasible,
};
use cft_ident_core::inertia::left_out::{FitsOnLeftOut, TrialLeftOut, left_out};
use cft_ident_core::inertia::solve::{factor, residual_of, weights_of};
use cft_ident_core::math::covariance::information_rows;
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::bodies::StandardMap;
use cft_ident_core::robot::standard::{Body, STANDARD, pseudo_inertia};
use cft_ident_files::config::model_file::{LinkBody, Parameter};
use cft_ident_files::config::{ModelFile, RobotFile};

/// Physically consistent links, and what they cost.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ConsistentLinks {
    pub links: Vec<ConsistentLink>,
    pub drives: Vec<DriveInertia>,
    /// Whether the model computes torques with them, and not with the plain fit.
    pub in_use: bool,
    /// What both fits leave on blocks left out; nothing where the fit is not linear in its rows, or they are too few.
    pub left_out: Vec<LeftOutResidual>,
    /// Weight of the prior beside the rows.
    pub prior_weight: f64,
    /// Most by which the weighted sum of squares is above its least over all physically consistent parameters, over
    /// itself.
    pub duality_gap: f64,
    pub iterations: usize,
    pub status: IterationEnding,
    /// Links whose mass properties in the robot file no body can have, so that a plain body stands for them.
    pub impossible_priors: Vec<String>,
    /// The unknowns of the fit, in their order.
    #[serde(skip)]
    pub(crate) values: Vec<f64>,
    /// How much the residual of each joint grows.
    #[serde(skip)]
    growth: Vec<f64>,
}

/// What both fits leave of a joint's torque on blocks left out, fractions.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LeftOutResidual {
    pub joint: String,
    pub consistent: f64,
    pub unconstrained: f64,
    /// The consistent one leaves more, by more than chance.
    pub worse: bool,
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

/// What fills in where torques say nothing of a link.
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

/// Mass properties that the robot file gives of each link.
fn bodies(file: &RobotFile, map: &StandardMap) -> Vec<Option<Body>> {
    let body = |i: usize| Some(file.robot.link.get(i)?.inertial.as_ref()?.body());
    (0..map.links.len()).map(body).collect()
}

/// Links whose prior is no body that can exist.
fn impossible(map: &StandardMap, bodies: &[Option<Body>], given: &[bool]) -> Vec<String> {
    let each = map.links.iter().zip(bodies).zip(given);
    let bad = each.filter(|((_, body), given)| body.is_some() && !**given);
    bad.map(|((name, _), _)| name.clone()).collect()
}

/// Links and drives that were found, as they are reported.
fn links_and_drives(
    robot: &Robot,
    map: &StandardMap,
    found: &FeasibleParameters,
) -> (Vec<ConsistentLink>, Vec<DriveInertia>) {
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
    let joints = robot.joint_names();
    let drives = map.drives.iter().zip(&found.drives);
    let drive = |(j, inertia): (&usize, &f64)| DriveInertia {
        joint: joints.get(*j).cloned().unwrap_or_default(),
        inertia: *inertia,
    };
    (links.map(link).collect(), drives.map(drive).collect())
}

/// Writes links and drives into a model.
fn write(links: &[ConsistentLink], drives: &[DriveInertia], model: &mut ModelFile) {
    let body = |link: &ConsistentLink| LinkBody {
        name: link.name.clone(),
        mass: link.mass,
        centre: link.centre,
        inertia: link.inertia,
    };
    model.links = links.iter().map(body).collect();
    let drives = drives.iter();
    let drives = drives.map(|drive| (drive.joint.clone(), drive.inertia));
    model.drive_inertia = drives.collect();
}

/// Columns of viscous and Coulomb friction that are fitted, with the speed that each joint reached.
fn friction_of(columns: &RegressorColumns, fastest: &[f64]) -> Vec<FrictionColumns> {
    let of = |(j, own): (usize, &Vec<JointTerm>)| {
        let at = |wanted: JointTerm| own.iter().position(|own| *own == wanted);
        let first = columns.first_own(j);
        Some(FrictionColumns {
            viscous: first + at(JointTerm::Viscous)?,
            coulomb: first + at(JointTerm::Coulomb)?,
            speed: fastest[j],
        })
    };
    let each = columns.own.iter().enumerate();
    each.filter_map(of).collect()
}

/// The consistent parameters nearest to a fit, on its rows; `fastest` are the speeds that the joints reached. None where the
/// search failed or left the finite. They are in use `whatever` the plain fit gains, or where it gains nothing.
pub(crate) fn consistent(
    setup: &RobotSetup,
    estimated: &InertialEstimate,
    fastest: &[f64],
    whatever: bool,
) -> Option<ConsistentLinks> {
    let found = nearest_consistent(setup, estimated, fastest, whatever).ok()?;
    let numbers = found.values.iter().chain(&found.growth);
    numbers.clone().all(|x| x.is_finite()).then_some(found)
}

fn nearest_consistent(
    setup: &RobotSetup,
    estimated: &InertialEstimate,
    fastest: &[f64],
    whatever: bool,
) -> Result<ConsistentLinks, IdentifyError> {
    let map = setup.robot.standard_map();
    let bodies = bodies(&setup.file, &map);
    let (basis, fit) = (&estimated.basis, &estimated.fit);
    let free = residual_of(&basis.sums, &(&fit.theta - &basis.shift))?;
    let weights = weights_of(&basis.sums, &free);
    let mut rows = factor(&basis.sums, &weights)?;
    // towards the fit itself, whatever weights it gave the rows; they are linear about a shift
    let u = fit.theta.len();
    let towards = rows.columns(0, u) * (&fit.theta - &basis.shift);
    rows.set_column(u, &towards);
    let friction = friction_of(&basis.sums.columns, fastest);
    let task = ConsistencyProblem {
        map: &map,
        bodies: &bodies,
        factor: &rows,
        effective: fit.effective_rows / fit.rows as f64,
        friction: &friction,
    };
    let found = feasible(&task)?;
    // parts that determine no fit by themselves are not tried
    let trial = || left_out(&basis.sums, &basis.parts, &weights, &task).ok()?;
    let tried = (!whatever).then(trial).flatten();
    let bound = residual_of(&basis.sums, &found.theta)?;
    let growth = |(free, bound): (&f64, &f64)| if *free > 0.0 { bound / free } else { 1.0 };
    let growth: Vec<f64> = free.iter().zip(&bound).map(growth).collect();
    let squares: f64 = growth.iter().map(|g| g * g * fit.effective_rows).sum();
    let (links, drives) = links_and_drives(&setup.robot, &map, &found);
    let names = setup.robot.joint_names().iter();
    let residual = |(joint, of): (&String, &TrialLeftOut)| LeftOutResidual {
        joint: joint.clone(),
        consistent: of.consistent,
        unconstrained: of.plain,
        worse: of.costs,
    };
    let joints = tried.iter().flat_map(|tried| &tried.joints);
    Ok(ConsistentLinks {
        links,
        drives,
        in_use: !tried.as_ref().is_some_and(FitsOnLeftOut::plain_is_better),
        left_out: names.zip(joints).map(residual).collect(),
        prior_weight: PRIOR_WEIGHT,
        duality_gap: found.gap / squares.max(f64::MIN_POSITIVE),
        iterations: found.iterations,
        status: found.ending,
        impossible_priors: impossible(&map, &bodies, &found.given),
        values: (&found.theta + &basis.shift).iter().copied().collect(),
        growth,
    })
}

impl ConsistentLinks {
    /// What did not come as it should.
    pub(crate) fn notes(&self) -> Vec<FitNote> {
        let impossible = (!self.impossible_priors.is_empty()).then(|| FitNote::ImpossibleBodies {
            links: self.impossible_priors.clone(),
        });
        let ended = self.status == IterationEnding::IterationLimit;
        let ended = ended.then_some(FitNote::DualityGap {
            gap: self.duality_gap,
        });
        let notes = [impossible, ended, self.worse_on_left_out()];
        notes.into_iter().flatten().collect()
    }

    /// Joints whose torque physically consistent parameters fit worse by more than chance: a finding about the machine.
    fn worse_on_left_out(&self) -> Option<FitNote> {
        let worse = self.left_out.iter().filter(|of| of.worse);
        let errors = |of: &LeftOutResidual| [of.consistent, of.unconstrained];
        let joints: Vec<_> = worse.map(|of| (of.joint.clone(), errors(of))).collect();
        (!joints.is_empty()).then_some(FitNote::ConsistentWorse {
            joints,
            in_use: self.in_use,
        })
    }

    /// Writes the parameters beside those of a model whose first ones are the unknowns of the fit.
    pub(crate) fn write_into(&self, model: &mut ModelFile) {
        write(&self.links, &self.drives, model);
        if !self.in_use {
            return;
        }
        for (p, value) in model.parameters.iter_mut().zip(&self.values) {
            p.consistent = Some(*value);
        }
        let names = model.robot.joint_names();
        for (joint, growth) in names.iter().zip(&self.growth) {
            if let Some(std) = model.residual_std.get_mut(joint) {
                *std *= growth;
            }
        }
    }
}

/// Puts beside the parameters of a model the physically consistent ones nearest to them in the metric of their
/// covariance: for a model whose rows are gone. Nothing where it holds no covariance of inertial parameters.
pub fn project(model: &mut ModelFile) -> Result<(), IdentifyError> {
    let Some(covariance) = &model.covariance else {
        model.forget_consistent();
        return Ok(());
    };
    let mut keys = inertial_keys(model);
    let others = covariance.names.iter();
    let others: Vec<String> = others
        .filter(|name| !keys.contains(name))
        .cloned()
        .collect();
    keys.extend(others);
    let rows = information_rows(&model.covariance_of(&keys), keys.len());
    project_in(model, &keys, rows)
}

/// The same in the metric of an information matrix of these unknowns, inertial ones among them or not.
pub(crate) fn project_by(
    model: &mut ModelFile,
    unknowns: &[String],
    information: &DMatrix<f64>,
) -> Result<(), IdentifyError> {
    let mut keys = inertial_keys(model);
    let others = unknowns.iter().filter(|key| !keys.contains(key));
    let others: Vec<String> = others.cloned().collect();
    keys.extend(others);
    let place: Vec<Option<usize>> = keys
        .iter()
        .map(|key| unknowns.iter().position(|u| u == key))
        .collect();
    let at = |i: usize, j: usize| {
        let of = place[i].zip(place[j]);
        of.map_or(0.0, |(a, b)| information[(a, b)])
    };
    let rows = rows_of_information(DMatrix::from_fn(keys.len(), keys.len(), at));
    project_in(model, &keys, rows)
}

/// Keys of the robot's inertial parameters, in its order.
fn inertial_keys(model: &ModelFile) -> Vec<String> {
    let robot = model.robot.robot();
    let names = robot.parameters().iter();
    names.map(|info| info.name.to_string()).collect()
}

/// The nearest consistent parameters, where `rows` are those of a factor of the information matrix of `keys`.
fn project_in(
    model: &mut ModelFile,
    keys: &[String],
    rows: DMatrix<f64>,
) -> Result<(), IdentifyError> {
    model.forget_consistent();
    let robot = model.robot.robot();
    let shared = robot.parameters().len();
    let of_key = |key: &String| model.parameters.iter().find(|p| p.key() == *key);
    if keys[..shared].iter().any(|key| of_key(key).is_none()) {
        return Ok(());
    }
    let value = |key: &String| of_key(key).map_or(0.0, |p| p.value);
    let theta = DVector::from_iterator(keys.len(), keys.iter().map(value));
    let target = &rows * &theta;
    let last = keys.len();
    let mut rows = rows.insert_column(last, 0.0);
    rows.set_column(last, &target);
    let place = |name: &str, joint: &str| {
        let key = format!("{name}:{joint}");
        keys.iter().position(|k| *k == key)
    };
    let names = robot.joint_names().iter().enumerate();
    let friction = names.filter_map(|(j, joint)| {
        let held = model.held_out.get(j);
        Some(FrictionColumns {
            viscous: place("viscous", joint)?,
            coulomb: place("coulomb", joint)?,
            speed: held.map_or(f64::INFINITY, |held| held.speed_seen),
        })
    });
    let friction: Vec<FrictionColumns> = friction.filter(|of| of.viscous >= shared).collect();
    let map = robot.standard_map();
    let task = ConsistencyProblem {
        map: &map,
        bodies: &bodies(&model.robot, &map),
        factor: &rows,
        effective: 1.0,
        friction: &friction,
    };
    let found = feasible(&task)?;
    if !found.theta.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    let (links, drives) = links_and_drives(&robot, &map, &found);
    for (key, value) in keys.iter().zip(&found.theta) {
        let of_key = |p: &&mut Parameter| p.key() == *key;
        if let Some(p) = model.parameters.iter_mut().find(of_key) {
            p.consistent = Some(*value);
        }
    }
    write(&links, &drives, model);
    Ok(())
}

/// Rows whose square is an information matrix.
fn rows_of_information(information: DMatrix<f64>) -> DMatrix<f64> {
    let parts = SymmetricEigen::new(information);
    let mut rows = parts.eigenvectors.transpose();
    for (k, size) in parts.eigenvalues.iter().enumerate() {
        rows.row_mut(k).scale_mut(size.max(0.0).sqrt());
    }
    rows
}
