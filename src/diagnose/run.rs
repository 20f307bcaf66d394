//! The loop: fit, search, add the best, refit, until nothing is accepted; then every accepted effect
//! is tested for removal, and only then is the holdout looked at.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::orders;
use super::candidates::score::Judge;
use super::candidates::search::{Bar, choose, search};
use super::faults::channels::{Suspicion, suspicion};
use super::faults::episode::{self, Episode};
use super::problem::fit::{Fitted, Ground, Prior, fit, inertial_of};
use super::problem::plan::{LogRole, Plan, Role, SetAside};
use super::problem::rows::PieceSums;
use super::problem::unknowns::{Open, Unknown};
use super::selection::accept::{Candidate, Limits};
use super::uncertainty::covariance::covariance;
use super::unexplained::errors::{Counted, Errors, errors};
use super::unexplained::{Left, NEGLIGIBLE, STRUCTURED, left, noise, part_left};
use crate::effect::{Added, AugmentedModel, Cover, Torques, stationary_joints};
use crate::motion::{MotionError, Parallel, Stretch};
use crate::robot::model::JointFriction;

/// What a diagnosis works on.
pub struct Case {
    /// The declared model as it was given.
    pub given: AugmentedModel,
    pub prior: Prior,
    pub open: Open,
    pub stretches: Vec<Stretch>,
    /// Role of each log.
    pub roles: Vec<LogRole>,
    pub parallel: Parallel,
    pub cutoff_hz: f64,
    /// Torque unit per joint.
    pub units: Vec<String>,
    /// Torques are means of two rows, as of commands that are held.
    pub averaged: bool,
    /// The given model is held within its covariance.
    pub keep: bool,
    /// Names of effects that are not tried.
    pub without: Vec<String>,
    pub limits: Limits,
}

/// Why no diagnosis came out.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(
        "{rows} rows are left to fit after filtering and what is set aside, too few for {unknowns} \
         unknowns: give a longer log, or logs of their own by --veto and --holdout"
    )]
    TooFewRows { rows: usize, unknowns: usize },
    #[error("the torque of joint {joint} is zero throughout")]
    NoTorque { joint: String },
    #[error("a torque channel has another sign or place than the model knows")]
    Channels(Suspicion),
    #[error("interrupted")]
    Interrupted,
}

/// One accepted effect.
#[derive(Debug, Clone)]
pub struct Step {
    /// Its place in the final model's effects.
    pub effect: usize,
    pub candidate: Candidate,
    /// Candidates that these data do not separate from it, best first.
    pub alternatives: Vec<Candidate>,
    /// Mean relative error on the holdout before and after the step.
    pub holdout: Option<[f64; 2]>,
}

/// Errors before or after.
#[derive(Debug, Clone)]
pub struct Pair {
    pub train: Errors,
    pub holdout: Option<Errors>,
}

/// The outcome.
pub struct Diagnosis {
    /// The refined model.
    pub model: AugmentedModel,
    /// Unknowns of the final fit and their covariance.
    pub unknowns: Vec<Unknown>,
    pub covariance: DMatrix<f64>,
    pub steps: Vec<Step>,
    /// Candidates of the last round, in which none was accepted.
    pub candidates: Vec<Candidate>,
    pub before: Pair,
    /// The declared model refitted to these logs, with nothing added.
    pub refitted: Errors,
    pub after: Pair,
    pub left: Vec<Left>,
    /// Part of the structure of each joint's residual that is left on the fitted logs.
    pub part_left: Vec<f64>,
    pub set_aside: Vec<SetAside>,
    /// Disturbances that were cut out of the logs.
    pub episodes: Vec<Episode>,
    /// Root mean square of the filtered residual per joint.
    pub residual_std: Vec<f64>,
    /// Logs that were fitted: the first ones.
    pub fitted_logs: usize,
}

/// Most episodes that are cut out.
const MOST_EPISODES: usize = 8;
/// Part of a joint's structure that may be left where effects are named for the rest of it.
const NAMED: f64 = 0.1;

/// Diagnoses. `told` hears of every step; `stop` is asked now and then.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(
    case: &Case,
    told: &mut dyn FnMut(&str),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Diagnosis, DiagnoseError> {
    let mut plan = Plan::of(&case.stretches, &case.roles, &case.parallel, case.cutoff_hz);
    let robot = &case.given.model.robot;
    let fitted = fitted_stretches(case);
    plan.held = held(case, &fitted);
    plan.rest = stationary_joints(robot, &case.stretches);
    let cover = Cover::of(robot, &fitted, case.cutoff_hz);
    let unknowns = super::problem::unknowns::Unknowns::of(&case.given, &case.open, &cover).len();
    if plan.fitted_rows() < 10 * unknowns || plan.folds < 3 {
        return Err(DiagnoseError::TooFewRows {
            rows: plan.fitted_rows(),
            unknowns,
        });
    }
    for (j, joint) in robot.joint_names().iter().enumerate() {
        if case
            .stretches
            .iter()
            .all(|s| s.tau[j].iter().all(|x| *x == 0.0))
        {
            return Err(DiagnoseError::NoTorque {
                joint: joint.clone(),
            });
        }
    }
    // faults of the data come before any physics
    if let Some(found) = suspicion(&case.given, &case.stretches, &case.parallel, &plan)? {
        return Err(DiagnoseError::Channels(found));
    }
    let mut ground = Ground {
        inertial: inertial_of(robot, &case.stretches, &case.parallel, &plan)?,
        stretches: &case.stretches,
        parallel: &case.parallel,
        plan,
        open: &case.open,
        prior: &case.prior,
        cover,
    };
    let mut at = fit(&case.given, &ground)?;
    let mut episodes: Vec<Episode> = Vec::new();
    let mut models = vec![at.model.clone()];
    let mut steps: Vec<Step> = Vec::new();
    let mut declared = None;
    let mut candidates;
    loop {
        if stop() {
            return Err(DiagnoseError::Interrupted);
        }
        let found = episode::find(&at, &ground, case.cutoff_hz);
        if !found.is_empty() && episodes.len() < MOST_EPISODES && case.limits.steps > 0 {
            let cut = episode::cut(&found, &mut ground.plan, &case.stretches, &case.parallel);
            for e in &cut {
                let joint = &robot.joint_names()[e.joint];
                told(&format!(
                    "cut out {:.2}..{:.2} s on {joint}",
                    e.from_s, e.to_s
                ));
            }
            episodes.extend(cut);
            at = fit(&at.model, &ground)?;
            continue;
        }
        let plan = &ground.plan;
        let declared = declared.get_or_insert_with(|| at.base.residual_squares(plan));
        let torques = ground.torques(&at.model);
        let residuals = residuals(&at.model, &fitted, fitted_torques(case, &torques));
        orders::find(&mut ground.cover, &residuals, &fitted, &case.parallel)?;
        let noise = noise(&residuals, case, &fitted)?;
        let bar = Bar {
            declared,
            noise: &noise,
        };
        let mut found = if case.limits.steps == 0 {
            Vec::new()
        } else {
            search(&at, &ground, case, &bar, &torques, stop)?
        };
        if stop() {
            return Err(DiagnoseError::Interrupted);
        }
        let mut skip = Vec::new();
        let mut next = None;
        if steps.len() < case.limits.steps {
            while let Some((chosen, others)) = choose(&found, &skip) {
                let mut model = at.model.clone();
                model.effects.push(found[chosen].effect.clone());
                let fitted = fit(&model, &ground)?;
                // the joint fit must keep what the linear tests promised
                let vetoing = |of: &Fitted| veto_squares(of, &fitted.weights, &ground.plan);
                let kept = !case.limits.vetoes(&vetoing(&at), &vetoing(&fitted));
                if kept && fitted.square_with(&at.weights, &ground.plan) < at.square {
                    next = Some((chosen, others, fitted));
                    break;
                }
                found[chosen].accepted = false;
                found[chosen].significant = false;
                found[chosen].reason =
                    "vetoed: the joint refit makes the error on data set aside larger".into();
                skip.push(chosen);
            }
        }
        let Some((chosen, others, fitted)) = next else {
            candidates = found;
            for candidate in candidates.iter_mut().filter(|c| c.accepted) {
                candidate.accepted = false;
                candidate.reason =
                    "as many effects as are looked for were found before it".to_owned();
            }
            break;
        };
        told(&format!(
            "{}: {:.1} % of the cross-validated squared error",
            found[chosen].effect.title(robot),
            100.0 * found[chosen].score.as_ref().map_or(0.0, |s| s.cv_gain)
        ));
        let mut alternatives: Vec<Candidate> = Vec::new();
        for i in others {
            let same = |c: &Candidate| c.effect.name() == found[i].effect.name();
            // what moves other joints explains another residual
            let places = [found[i].effect.place, found[chosen].effect.place];
            if !(0..robot.joints()).any(|j| places.iter().all(|p| p.touches(j))) {
                continue;
            }
            if !alternatives.iter().any(same) && !same(&found[chosen]) && alternatives.len() < 3 {
                alternatives.push(found[i].clone());
            }
        }
        steps.push(Step {
            effect: fitted.model.effects.len() - 1,
            candidate: found[chosen].clone(),
            alternatives,
            holdout: None,
        });
        models.push(fitted.model.clone());
        at = fitted;
    }
    // what a later effect made superfluous goes
    let mut dropped = Vec::new();
    while let Some(effect) = superfluous(&at, &ground, case)? {
        told(&format!(
            "{} is not needed any more",
            at.model.effects[effect].title(robot)
        ));
        let mut model = at.model.clone();
        model.effects.remove(effect);
        at = fit(&model, &ground)?;
        if let Some(k) = steps.iter().position(|s| s.effect == effect) {
            let mut gone = steps.remove(k).candidate;
            models.remove(k + 1);
            gone.accepted = false;
            gone.significant = false;
            gone.reason = "a later effect made it superfluous".into();
            dropped.push(gone);
        }
        for step in &mut steps {
            if step.effect > effect {
                step.effect -= 1;
            }
        }
    }
    candidates.extend(dropped);

    // everything is decided: the holdout may be looked at
    let plan = &ground.plan;
    let wanted = |role: Role| role == Role::Holdout;
    let measured = |model: &AugmentedModel, wanted: &dyn Fn(Role) -> bool, counted: Counted| {
        errors(
            model,
            &case.units,
            &case.stretches,
            &case.parallel,
            plan,
            (wanted, counted),
        )
    };
    let measure = |model: &AugmentedModel, wanted: &dyn Fn(Role) -> bool| {
        measured(model, wanted, Counted::All)
    };
    let mut means = Vec::with_capacity(models.len());
    for model in &models {
        means.push(measure(model, &wanted)?.map(|e| e.overall.mean_relative_error));
    }
    for (k, step) in steps.iter_mut().enumerate() {
        if let (Some(Some(before)), Some(Some(after))) = (means.get(k), means.get(k + 1)) {
            step.holdout = Some([*before, *after]);
        }
    }
    let pair_of = |model: &AugmentedModel, counted: Counted| -> Result<Pair, DiagnoseError> {
        let train = measured(model, &Role::fitted, counted)?
            .ok_or(DiagnoseError::TooFewRows { rows: 0, unknowns })?;
        Ok(Pair {
            train,
            holdout: measured(model, &wanted, counted)?,
        })
    };
    let pair = |model: &AugmentedModel| pair_of(model, Counted::All);
    let before = pair(&case.given)?;
    let refitted = pair(&models[0])?.train;
    let after = pair(&at.model)?;
    let held_out = |s: &&Stretch| case.roles[s.log] == LogRole::Holdout;
    let unseen: Vec<Stretch> = case.stretches.iter().filter(held_out).cloned().collect();
    let noise_along = |stretches: &[Stretch]| {
        let torques: Vec<Torques> = stretches.par_iter().map(|s| at.model.torques(s)).collect();
        noise(
            &residuals(&at.model, stretches, torques.iter()),
            case,
            stretches,
        )
    };
    let floor = noise_along(&fitted)?;
    let floor_unseen = match unseen.is_empty() {
        true => None,
        false => Some(noise_along(&unseen)?),
    };
    // friction at rest is no structure either, where the law jumps
    let (given, last) = match case.given.model.friction.iter().any(JointFriction::jumps) {
        true => (
            pair_of(&case.given, Counted::Moving)?,
            pair_of(&at.model, Counted::Moving)?,
        ),
        false => (before.clone(), after.clone()),
    };
    let part_left = part_left(&floor, &given.train, &last.train);
    let left = left(&last.train, &floor, last.holdout.as_ref().zip(floor_unseen));
    if stop() {
        return Err(DiagnoseError::Interrupted);
    }
    let size = at.base.unknowns.len();
    let covariance = match case.limits.deviations {
        true => covariance(&at, &ground, case.cutoff_hz)?,
        false => DMatrix::from_element(size, size, f64::NAN),
    };
    Ok(Diagnosis {
        unknowns: at.base.unknowns.list.clone(),
        covariance,
        residual_std: at.base.residual_rms(plan),
        model: at.model,
        steps,
        candidates,
        before,
        refitted,
        after,
        left,
        part_left,
        set_aside: plan.set_aside.clone(),
        episodes,
        fitted_logs: case.roles.iter().filter(|r| **r == LogRole::Train).count(),
    })
}

/// Joints that are held along each stretch; all of them where a log decides nothing.
fn held(case: &Case, fitted: &[Stretch]) -> Vec<Vec<bool>> {
    let robot = &case.given.model.robot;
    let veto = |s: &&Stretch| case.roles[s.log] == LogRole::Veto;
    let vetoing: Vec<Stretch> = case.stretches.iter().filter(veto).cloned().collect();
    let mut of_fitted = stationary_joints(robot, fitted).into_iter();
    let mut of_vetoing = stationary_joints(robot, &vetoing).into_iter();
    let of = |s: &Stretch| match case.roles[s.log] {
        LogRole::Train => of_fitted.next(),
        LogRole::Veto => of_vetoing.next(),
        LogRole::Holdout => None,
    };
    let all = vec![true; robot.joints()];
    let found = case.stretches.iter().map(of);
    found.map(|h| h.unwrap_or_else(|| all.clone())).collect()
}

/// The stretches of logs that are fitted.
fn fitted_stretches(case: &Case) -> Vec<Stretch> {
    let fitted = |s: &&Stretch| case.roles[s.log] == LogRole::Train;
    case.stretches.iter().filter(fitted).cloned().collect()
}

/// Those of the stretches' torques that belong to logs that are fitted.
fn fitted_torques<'a>(case: &Case, all: &'a [Torques]) -> impl Iterator<Item = &'a Torques> {
    let pairs = case.stretches.iter().zip(all);
    let fitted = pairs.filter(|(s, _)| case.roles[s.log] == LogRole::Train);
    fitted.map(|(_, torques)| torques)
}

/// Raw residuals along stretches, `[stretch][joint][sample]`.
fn residuals<'a>(
    model: &AugmentedModel,
    stretches: &[Stretch],
    torques: impl Iterator<Item = &'a Torques>,
) -> Vec<Vec<Vec<f64>>> {
    let of = |(stretch, torques): (&Stretch, &Torques)| match torques.hat.is_empty() {
        // along a log in which nothing moves
        true => model.residual(stretch, &model.torques(stretch)),
        false => model.residual(stretch, torques),
    };
    stretches.iter().zip(torques).map(of).collect()
}

/// Squared residual of each veto piece in given weights.
fn veto_squares(at: &Fitted, weights: &[f64], plan: &Plan) -> Vec<f64> {
    let pieces = plan.pieces.iter().zip(&at.base.sums);
    let vetoing = pieces.filter(|(p, _)| p.role == Role::Veto);
    let square = |sums: &Vec<PieceSums>| {
        sums.iter()
            .zip(weights)
            .map(|(s, w)| w * w * s.square)
            .sum()
    };
    vetoing.map(|(_, sums)| square(sums)).collect()
}

fn squares(at: &Fitted, weights: &[f64], plan: &Plan, wanted: &dyn Fn(Role) -> bool) -> f64 {
    let pieces = plan.pieces.iter().zip(&at.base.sums);
    pieces
        .filter(|(p, _)| wanted(p.role))
        .flat_map(|(_, sums)| sums.iter().zip(weights).map(|(s, w)| w * w * s.square))
        .sum()
}

impl Fitted {
    /// Squared residual of the fitted rows in given weights.
    pub fn square_with(&self, weights: &[f64], plan: &Plan) -> f64 {
        squares(self, weights, plan, &Role::fitted)
    }
}

/// An effect without which the model is as good: it no longer passes what let it in.
fn superfluous(at: &Fitted, ground: &Ground, case: &Case) -> Result<Option<usize>, MotionError> {
    if at.model.effects.len() < 2 {
        return Ok(None);
    }
    let mut worst: Option<(usize, f64)> = None;
    for (i, effect) in at.model.effects.iter().enumerate() {
        let mut model = at.model.clone();
        model.effects.remove(i);
        let without = fit(&model, ground)?;
        let judge = Judge::new(&without, ground);
        let torques = ground.torques(&without.model);
        let columns = super::candidates::search::columns(&without.model, ground, &torques, effect)?;
        let score = judge.score(&columns, effect.linear.len(), effect.shape.len());
        let (gain, needed) = match score {
            None => (0.0, false),
            Some(s) => (
                s.cv_gain,
                s.cv_gain >= case.limits.cv_gain
                    && s.delta_bic > 0.0
                    && s.p_value <= case.limits.false_alarm,
            ),
        };
        if !needed && worst.is_none_or(|(_, least)| gain < least) {
            worst = Some((i, gain));
        }
    }
    Ok(worst.map(|(i, _)| i))
}

impl Diagnosis {
    /// Whether some joint's residual still holds structure.
    pub fn structured(&self) -> bool {
        self.structured_joints().next().is_some()
    }

    /// Joints whose residual still holds structure.
    pub fn structured_joints(&self) -> impl Iterator<Item = usize> {
        let joints = self.left.iter().enumerate();
        joints
            .filter(|(_, l)| {
                l.over_floor.is_none_or(|over| over > STRUCTURED) && l.share > NEGLIGIBLE
            })
            .map(|(j, _)| j)
    }

    /// Candidates of the last round that the data tell from chance, and that were not added, for they are too
    /// small to matter or came after the last that is looked for: what was added is then not all that is there,
    /// or not quite what is there.
    pub fn remainder(&self) -> impl Iterator<Item = &Candidate> {
        self.candidates.iter().filter(|c| c.significant)
    }

    /// Whether what was added leaves nothing that is told from noise on any joint. Otherwise it lowers the
    /// error and may stand in for an effect that the catalogue does not have: joints share inertial
    /// parameters, and what is missing on one forges effects on the others.
    pub fn assured(&self) -> bool {
        !self.structured() && self.remainder().next().is_none()
    }

    /// Whether what was added leaves at most a small part of the structure on the joints that a step's effect
    /// touches, so that there is something to its name.
    pub fn explained(&self, step: &Step) -> bool {
        let place = self.model.effects[step.effect].place;
        let mut open = self.structured_joints().filter(|j| place.touches(*j));
        open.all(|j| self.part_left[j] <= NAMED)
    }

    /// Covariance of (shape, linear) of one effect, row-major; a shape that was not refined has none.
    pub fn covariance_of(&self, effect: usize) -> Vec<f64> {
        let added: &Added = &self.model.effects[effect];
        let k = added.parameters();
        let shapes = added.shape.len();
        let place = |wanted: Unknown| self.unknowns.iter().position(|u| *u == wanted);
        let places: Vec<Option<usize>> = (0..k)
            .map(|i| {
                if i < shapes {
                    place(Unknown::Shape { effect, k: i })
                } else {
                    place(Unknown::Linear {
                        effect,
                        k: i - shapes,
                    })
                }
            })
            .collect();
        let mut out = vec![0.0; k * k];
        for (a, pa) in places.iter().enumerate() {
            for (b, pb) in places.iter().enumerate() {
                if let (Some(pa), Some(pb)) = (pa, pb) {
                    out[a * k + b] = self.covariance[(*pa, *pb)];
                }
            }
        }
        out
    }
}
