//! Friction that is known before a fit: what of it the fit may move, and what it made of it.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::robot_setup::RobotSetup;
use crate::note::{FrictionNote, NumberWithStd, StageNote};
use cft_ident_core::friction::estimate::curve_std;
use cft_ident_core::inertia::columns::{GRADIENT, KnownFriction, RegressorColumns};
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_core::verdict::{Verdict, WEAK, verdict_of};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::identified::friction_unit;
use cft_ident_files::config::model_file::FrictionPrior;
use cft_ident_files::config::robot_file::FrictionLawKind;
use cft_ident_logs::log::Provenance;

/// The friction of a joint before and after a fit.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrictionOfFit {
    pub joint: String,
    /// By the keys of the law (18).
    pub parameters: BTreeMap<String, FrictionParameter>,
}

/// A friction parameter before and after a fit.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrictionParameter {
    /// Value after the fit \[unit\].
    pub value: f64,
    /// Its standard deviation \[unit\]; null where it was taken as exact.
    pub std: Option<f64>,
    pub unit: String,
    /// Value before the fit \[unit\].
    pub prior: f64,
    /// Its standard deviation \[unit\]; null where none was known, or the logs that gave it are fitted here.
    pub prior_std: Option<f64>,
    /// The fit left it where it was.
    pub held: bool,
    #[serde(skip)]
    pub verdict: Option<Verdict>,
}

/// What is known of the friction of every joint, and which logs determine it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrictionBefore {
    pub known: Vec<KnownFriction>,
    /// As a model file of the fit keeps it.
    pub priors: Vec<FrictionPrior>,
    /// Logs of the fit that gave a joint's prior, which is left out there.
    left_out: Vec<bool>,
}

fn any_shared(a: &[Provenance], b: &[Provenance]) -> bool {
    let mut made = b.iter().filter(|b| b.made());
    made.any(|b| a.iter().any(|a| a.shares_rows(b)))
}

impl FrictionBefore {
    /// What the model `file`, called `name`, knows of the friction before the logs are fitted: its own values, or where
    /// these logs made them those of before. With `hold` they are the file's own, and a fit moves none of them.
    ///
    /// # Errors
    /// A model without a joint's friction, and logs that cannot be read.
    pub fn of(
        data: &Dataset,
        (name, file): (&str, &ModelFile),
        (estimator, hold): (EstimatorKind, bool),
    ) -> Result<Self, IdentifyError> {
        let mut given = Vec::new();
        if !hold {
            given.extend(data.reduced.iter().map(|part| part.provenance.clone()));
            for log in &data.logs {
                given.push(log.usable()?.identity()?);
            }
        }
        let mut before = FrictionBefore {
            known: Vec::new(),
            priors: Vec::new(),
            left_out: Vec::new(),
        };
        for joint in data.setup.robot.joint_names() {
            let prior = prior_of((name, file), joint, &given)?;
            let law = file.double_tanh(name, joint)?;
            let (values, mut covariance) = (
                prior.values.unwrap_or(law.parameters()),
                prior.covariance.unwrap_or_default(),
            );
            // a log of this joint alone, not one of all joints that a whole model was made from
            let left_out = any_shared(&given, &prior.logs);
            let bound = |k: usize| {
                let parameter = file.find(DoubleTanh::NAMES[k], Some(joint));
                k >= 3 && parameter.is_some_and(|p| p.verdict == Some(Verdict::LowerBound))
            };
            // `oe` moves what it knows nothing of, too
            let free = estimator == EstimatorKind::Oe && !hold;
            let held = |k: usize| hold || !free && (covariance[k][k] <= 0.0 || bound(k));
            let held = std::array::from_fn(held);
            if left_out {
                covariance = [[0.0; GRADIENT]; GRADIENT];
            }
            before.known.push(KnownFriction {
                law: DoubleTanh::from_parameters(values),
                covariance,
                held,
            });
            before.left_out.push(left_out);
            before.priors.push(prior);
        }
        Ok(before)
    }

    /// As a model file keeps it after a fit of the logs `inputs` that took it from `file`; what the fit contradicts is no
    /// prior.
    pub fn kept(
        &self,
        file: &ModelFile,
        (columns, contradicted): (&RegressorColumns, &[usize]),
        inputs: &[Provenance],
    ) -> Vec<FrictionPrior> {
        if !self.known.iter().any(KnownFriction::moves) {
            return file.friction_prior.clone();
        }
        let mut priors = refined_by(self.priors.clone(), inputs);
        for j in contradicted {
            if let Some(now) = &columns.known[*j] {
                priors[*j].values = Some(now.law.parameters());
                priors[*j].covariance = Some(self.known[*j].clone().doubted().covariance);
            }
        }
        priors
    }

    /// What these logs contradict of it.
    pub fn contradictions(
        &self,
        setup: &RobotSetup,
        (columns, all): (&RegressorColumns, &DMatrix<f64>),
        contradicted: &[usize],
    ) -> Vec<StageNote> {
        let after = self.after(setup, columns, all);
        let of = |j: &usize| {
            let FrictionOfFit { joint, parameters } = &after[*j];
            let moved = DoubleTanh::NAMES.into_iter().filter_map(|name| {
                let p = parameters.get(name)?;
                let before = NumberWithStd {
                    value: p.prior,
                    std: p.prior_std?,
                };
                let now = NumberWithStd {
                    value: p.value,
                    std: p.std?,
                };
                Some((name, [before, now], p.unit.clone()))
            });
            StageNote::Friction {
                joint: joint.clone(),
                note: FrictionNote::Contradicted {
                    moved: moved.collect(),
                },
            }
        };
        contradicted.iter().map(of).collect()
    }

    /// The friction of every joint as a fit leaves it in `columns`; `all` is the covariance of unknowns and friction.
    pub fn after(
        &self,
        setup: &RobotSetup,
        columns: &RegressorColumns,
        all: &DMatrix<f64>,
    ) -> Vec<FrictionOfFit> {
        let first = all.nrows() - GRADIENT * self.known.len();
        let joints = setup.robot.joint_names().iter().enumerate();
        let of = |(j, joint): (usize, &String)| {
            let before = &self.known[j];
            let now = columns.known[j].as_ref().unwrap_or(before).law.parameters();
            let old = before.law.parameters();
            let parameter = |k: usize| {
                let variance = |v: f64| (v > 0.0).then(|| v.sqrt());
                let at = first + GRADIENT * j + k;
                let std = variance(all[(at, at)]);
                let held = before.held[k];
                let unit = friction_unit(
                    &setup.robot,
                    j,
                    DoubleTanh::NAMES[k],
                    setup.file.torque_unit(j),
                );
                FrictionParameter {
                    value: now[k],
                    std,
                    unit,
                    prior: old[k],
                    prior_std: variance(before.covariance[k][k]),
                    held,
                    verdict: std.filter(|_| !held).map(|std| verdict_of(now[k], std)),
                }
            };
            let named = |k: usize| (DoubleTanh::NAMES[k].to_owned(), parameter(k));
            FrictionOfFit {
                joint: joint.clone(),
                parameters: (0..GRADIENT).map(named).collect(),
            }
        };
        joints.map(of).collect()
    }

    /// Joints that move faster here than in their one-joint logs, with what it costs; `fastest` is the
    /// greatest speed of each joint.
    pub fn beyond(
        &self,
        setup: &RobotSetup,
        columns: &RegressorColumns,
        all: &DMatrix<f64>,
        fastest: &[f64],
    ) -> Vec<StageNote> {
        let first = all.nrows() - GRADIENT * self.known.len();
        let mut out = Vec::new();
        for (j, joint) in setup.robot.joint_names().iter().enumerate() {
            let (Some(covered), speed) = (self.priors[j].speeds_covered, fastest[j]) else {
                continue;
            };
            if speed <= MAX_SPEED_RATIO * covered[1] || self.left_out[j] {
                continue;
            }
            let law = columns.known[j]
                .as_ref()
                .map_or(self.known[j].law, |k| k.law);
            let covariance = of_joint(all, first + GRADIENT * j);
            let (torque, std) = (law.torque(speed), curve_std(&law, &covariance, speed));
            let position = setup.robot.joint_kind(j).position_unit();
            out.push(StageNote::Friction {
                joint: joint.clone(),
                note: FrictionNote::FasterThanLogged {
                    speed,
                    logged: covered[1],
                    unit: position,
                    uncertain: 2.0 * std > WEAK * torque.abs(),
                },
            });
        }
        out
    }
}

/// Covariance of one joint's friction, which begins at row `at` of that of all.
pub(crate) fn of_joint(all: &DMatrix<f64>, at: usize) -> [[f64; GRADIENT]; GRADIENT] {
    std::array::from_fn(|a| std::array::from_fn(|b| all[(at + a, at + b)]))
}

/// A joint's friction without the logs `given`: the file's own, or where these logs refined it that of before.
fn prior_of(
    (name, file): (&str, &ModelFile),
    joint: &str,
    given: &[Provenance],
) -> Result<FrictionPrior, IdentifyError> {
    let entry = file.friction_prior.iter().find(|p| p.joint == joint);
    let again = entry.filter(|e| e.values.is_some() && any_shared(given, &e.refined_by));
    if let Some(again) = again {
        return Ok(again.clone());
    }
    let keys = DoubleTanh::NAMES.map(|key| format!("{key}:{joint}"));
    let flat = file.covariance_of(&keys);
    let mut prior = entry.cloned().unwrap_or_default();
    match entry {
        Some(entry) => prior.logs.extend(entry.refined_by.iter().cloned()),
        None => prior.logs.clone_from(&file.provenance.inputs),
    }
    Ok(FrictionPrior {
        joint: joint.to_owned(),
        values: Some(file.double_tanh(name, joint)?.parameters()),
        covariance: Some(std::array::from_fn(|a| {
            std::array::from_fn(|b| flat[a * GRADIENT + b])
        })),
        refined_by: Vec::new(),
        ..prior
    })
}

fn refined_by(mut priors: Vec<FrictionPrior>, inputs: &[Provenance]) -> Vec<FrictionPrior> {
    for prior in &mut priors {
        prior.refined_by = inputs.to_vec();
    }
    priors
}

/// The model with the friction that is known without the logs `given`, and what a refined model keeps of it.
pub(crate) fn before_these(
    (name, file): (&str, &ModelFile),
    given: &[Provenance],
) -> Result<(ModelFile, Vec<FrictionPrior>), IdentifyError> {
    let mut model = file.clone();
    let mut priors = Vec::new();
    let declared = file.robot.friction_law() == FrictionLawKind::DoubleTanh;
    for joint in file.robot.joint_names() {
        // a robot file may name another law than the friction has that was given to the model's fit
        let holds = file.joint_friction(name, &joint)?;
        if !declared && !matches!(holds, JointFriction::DoubleTanh(_)) {
            continue;
        }
        let prior = prior_of((name, file), &joint, given)?;
        let keys = DoubleTanh::NAMES.map(|key| format!("{key}:{joint}"));
        let changed = file.double_tanh(name, &joint)?.parameters();
        let flat = file.covariance_of(&keys);
        if let (Some(values), Some(covariance)) = (prior.values, prior.covariance)
            && (values != changed || flat != covariance.as_flattened())
        {
            model.replace_covariance(&keys, &|a, b| covariance[a][b]);
            for parameter in &mut model.parameters {
                if let Some(k) = keys.iter().position(|key| *key == parameter.key()) {
                    parameter.value = values[k];
                    parameter.std = Some(covariance[k][k].max(0.0).sqrt());
                }
            }
        }
        priors.push(prior);
    }
    Ok((model, refined_by(priors, given)))
}

/// A speed over the greatest of the one-joint logs up to which their law is not continued.
const MAX_SPEED_RATIO: f64 = 1.1;

/// Covariance of unknowns and known friction: cov(theta, theta_f) = S Sigma_f, with S = d theta / d theta_f.
pub(crate) fn with_friction(columns: &RegressorColumns, fit: &Fit) -> DMatrix<f64> {
    let u = fit.theta.len();
    let known = columns.known.iter().flatten().count();
    let mut all = DMatrix::zeros(u + GRADIENT * known, u + GRADIENT * known);
    all.view_mut((0, 0), (u, u)).copy_from(&fit.covariance);
    let joints = columns.known.iter().enumerate();
    let joints = joints.filter_map(|(j, known)| Some((j, known.as_ref()?)));
    for (place, (j, known)) in joints.enumerate() {
        let at = u + GRADIENT * place;
        let own = DMatrix::from_fn(GRADIENT, GRADIENT, |a, b| known.covariance[a][b]);
        if let Some(sensitivity) = &fit.friction_sensitivity[j] {
            let cross = sensitivity * &own;
            all.view_mut((0, at), (u, GRADIENT)).copy_from(&cross);
            all.view_mut((at, 0), (GRADIENT, u))
                .copy_from(&cross.transpose());
        }
        all.view_mut((at, at), (GRADIENT, GRADIENT)).copy_from(&own);
    }
    all
}

/// The same from `whole`, the covariance of a refinement with columns `free`; held friction keeps its variance.
pub(crate) fn of_refinement(
    columns: &RegressorColumns,
    free: &RegressorColumns,
    whole: &DMatrix<f64>,
    held: &[Option<KnownFriction>],
) -> DMatrix<f64> {
    let mut places: Vec<Option<usize>> = (0..columns.shared).map(Some).collect();
    for (j, own) in columns.own.iter().enumerate() {
        places.extend((0..own.len()).map(|k| Some(free.first_own(j) + k)));
    }
    let mut fixed = vec![0.0; places.len()];
    for (j, known) in held.iter().enumerate() {
        let Some(known) = known else { continue };
        let mut of_law = [None; GRADIENT];
        free.law_unknowns(j)
            .for_each(|(at, k)| of_law[k] = Some(at));
        places.extend(of_law);
        fixed.extend((0..GRADIENT).map(|k| known.covariance[k][k]));
    }
    DMatrix::from_fn(places.len(), places.len(), |a, b| {
        match (places[a], places[b]) {
            (Some(a), Some(b)) => whole[(a, b)],
            (None, None) if a == b => fixed[a],
            _ => 0.0,
        }
    })
}
