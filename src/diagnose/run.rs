//! The loop: fit, search, add the best, refit, test every accepted effect for removal; where nothing is accepted any
//! more, look for other effects that say the same, and search again. Only then is the holdout looked at.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::baseline::Baseline;
use super::candidates::candidate::Candidate;
use super::candidates::orders;
use super::candidates::search::search;
use super::faults::channels::{Suspicion, suspicion};
use super::faults::disturbance::{self, CutDisturbance};
use super::outcome::{AcceptedEffect, Diagnosis, SplitErrors, Turn};
use super::problem::case::Case;
use super::problem::data_split::{DataSplit, LogRole, RowRole};
use super::problem::fit::{FittedModel, fit};
use super::problem::fit_problem::{FitProblem, inertial_of};
use super::problem::rests::rest_weight;
use super::problem::unknowns::Unknowns;
use super::selection::accept::{accept, beyond_chance};
use super::selection::choose::{alternatives, choose};
use super::selection::reconsider::replacement;
use super::selection::removal::superfluous;
use super::uncertainty::covariance::covariance;
use super::unexplained::dependence::dependences;
use super::unexplained::errors::{Counted, Errors, errors};
use super::unexplained::{noise, part_unexplained, unexplained};
use crate::effect::{Added, AugmentedModel, Cover, Law, Place, Search, Torques, stationary_joints};
use crate::math::rank_revealing::RankRevealingInverse;
use crate::motion::{MotionError, Stretch};
use crate::robot::model::JointFriction;

/// Why no diagnosis came out.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(
        "{rows} rows are left to fit after filtering and what is set aside, too few for {unknowns} \
         unknowns; give a longer log, or logs of their own by --veto and --holdout"
    )]
    TooFewRows { rows: usize, unknowns: usize },
    #[error(
        "these logs determine none of the {unknowns} unknowns of the model; log a motion of every joint"
    )]
    NothingDetermined { unknowns: usize },
    #[error("the torque of joint {joint} is zero throughout; check its channel")]
    NoTorque { joint: String },
    #[error("a torque channel looks sign-flipped or swapped")]
    Channels(Suspicion),
    #[error("interrupted")]
    Interrupted,
}

/// Most times that effects take the place of others.
const MOST_REPLACEMENTS: usize = 3;
/// Most disturbances that are cut out.
const MOST_DISTURBANCES: usize = 8;

/// Diagnoses. `progress` hears of every step; `stop` is asked now and then.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(
    case: &Case,
    progress: &mut dyn FnMut(&str),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Diagnosis, DiagnoseError> {
    let mut work = Diagnosing::begin(case, progress, stop)?;
    loop {
        work.unless_stopped()?;
        if work.cut_disturbances()? {
            continue;
        }
        let found = work.search()?;
        work.unless_stopped()?;
        if work.add_best(found)? {
            work.drop_superfluous()?;
        } else if !work.drop_superfluous()? && !work.replace()? {
            break;
        }
    }
    work.evaluate()
}

/// A diagnosis as far as it has come.
struct Diagnosing<'a> {
    case: &'a Case,
    progress: &'a mut dyn FnMut(&str),
    stop: &'a (dyn Fn() -> bool + Sync),
    problem: FitProblem<'a>,
    /// The stretches of logs that are fitted.
    stretches: Vec<Stretch>,
    /// Number of unknowns of the declared model.
    unknowns: usize,
    at: FittedModel,
    /// Squared residual of the declared model over the fitted rows, per joint.
    declared: Option<Vec<f64>>,
    /// The declared model refitted, then the model of each step.
    models: Vec<AugmentedModel>,
    steps: Vec<AcceptedEffect>,
    path: Vec<Turn>,
    /// Sets of effects that the model has had, so that the search does not go in circles.
    known: Vec<Vec<String>>,
    disturbances: Vec<CutDisturbance>,
    /// Candidates that came to nothing.
    candidates: Vec<Candidate>,
}

impl<'a> Diagnosing<'a> {
    /// Divides the data, refuses what cannot be fitted, and fits the declared model.
    fn begin(
        case: &'a Case,
        progress: &'a mut dyn FnMut(&str),
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Result<Self, DiagnoseError> {
        let robot = &case.given.model.robot;
        let stretches = case.stretches_of(LogRole::Train);
        let split = data_split(case, &stretches);
        let cover = Cover::of(robot, &stretches, case.cutoff_hz);
        let unknowns = Unknowns::of(&case.given, &case.open, &cover).len();
        check(case, &split, unknowns)?;
        let joints = robot.joints();
        let mut problem = FitProblem {
            inertial: inertial_of(robot, &case.stretches, &case.filters, &split)?,
            stretches: &case.stretches,
            filters: &case.filters,
            split,
            open: &case.open,
            prior: &case.prior,
            cover,
            rest_weight: vec![0.0; joints],
        };
        let mut at = fit(&case.given, &problem)?;
        // friction and noise of the moving rows say what those at rest are worth
        let noise = at.base.residual_rms(&problem.split);
        problem.rest_weight = rest_weight(&at.model, &case.stretches, &case.filters, &noise);
        if problem.rest_weight.iter().any(|weight| *weight > 0.0) {
            at = fit(&case.given, &problem)?;
        }
        let inverse = RankRevealingInverse::of(&at.normal);
        if (0..at.normal.nrows()).all(|i| inverse.redundant(i)) {
            return Err(DiagnoseError::NothingDetermined { unknowns });
        }
        Ok(Diagnosing {
            case,
            progress,
            stop,
            problem,
            stretches,
            unknowns,
            declared: None,
            models: vec![at.model.clone()],
            at,
            steps: Vec::new(),
            path: Vec::new(),
            known: Vec::new(),
            disturbances: Vec::new(),
            candidates: Vec::new(),
        })
    }

    fn unless_stopped(&self) -> Result<(), DiagnoseError> {
        match (self.stop)() {
            true => Err(DiagnoseError::Interrupted),
            false => Ok(()),
        }
    }

    /// Cuts disturbances out of the fitted rows and fits again; whether there were any.
    fn cut_disturbances(&mut self) -> Result<bool, DiagnoseError> {
        let case = self.case;
        if self.disturbances.len() >= MOST_DISTURBANCES || case.limits.steps == 0 {
            return Ok(false);
        }
        let found = disturbance::find(&self.at, &self.problem, case.cutoff_hz);
        if found.is_empty() {
            return Ok(false);
        }
        let split = &mut self.problem.split;
        let cut = disturbance::cut(&found, split, &case.stretches, &case.filters);
        for e in &cut {
            let joint = &case.given.model.robot.joint_names()[e.joint];
            let said = format!("cut out {:.2}..{:.2} s on {joint}", e.from_s, e.to_s);
            (self.progress)(&said);
        }
        self.disturbances.extend(cut);
        self.at = fit(&self.at.model, &self.problem)?;
        Ok(true)
    }

    /// One round of candidates, judged.
    fn search(&mut self) -> Result<Vec<Candidate>, DiagnoseError> {
        let case = self.case;
        let squares = || self.at.base.residual_squares(&self.problem.split);
        let declared = self.declared.get_or_insert_with(squares);
        let torques = self.problem.torques(&self.at.model);
        let of_fitted = case.fitted_torques(&torques);
        let residuals = residuals(&self.at.model, &self.stretches, of_fitted);
        let cover = &mut self.problem.cover;
        orders::find(cover, &residuals, &self.stretches, &case.filters)?;
        let noise = noise(&residuals, case, &self.stretches)?;
        if case.limits.steps == 0 {
            return Ok(Vec::new());
        }
        let baseline = Baseline {
            declared,
            noise: &noise,
        };
        let (at, problem) = (&self.at, &self.problem);
        let all = |_: &Law, _: Place| true;
        let mut found = search(
            at,
            problem,
            case,
            &baseline,
            &torques,
            (&all, 0.0),
            self.stop,
        )?;
        accept(
            &mut found.candidates,
            &case.limits,
            (at, &problem.split),
            &baseline,
        );
        let wide = case.wide.as_ref();
        beyond_chance(&mut found, &case.limits, (at, problem), &torques, wide)?;
        Ok(found.candidates)
    }

    /// Adds the best of the accepted candidates that a joint refit confirms; whether there is one. The others
    /// are kept for the report where it is the last round.
    fn add_best(&mut self, mut found: Vec<Candidate>) -> Result<bool, DiagnoseError> {
        let Some((chosen, others, fitted)) = self.confirmed(&mut found)? else {
            for candidate in found.iter_mut().filter(|c| c.accepted) {
                candidate.accepted = false;
                candidate.reason =
                    "as many effects as are looked for were found before it".to_owned();
            }
            self.candidates = found;
            return Ok(false);
        };
        let robot = &self.case.given.model.robot;
        (self.progress)(&format!(
            "{}: {:.1} % of the cross-validated squared error",
            found[chosen].effect.title(robot),
            100.0 * found[chosen].score.as_ref().map_or(0.0, |s| s.cv_gain)
        ));
        self.steps.push(AcceptedEffect {
            effect: fitted.model.effects.len() - 1,
            candidate: found[chosen].clone(),
            alternatives: alternatives(&found, chosen, &others, robot.joints()),
            holdout: None,
        });
        self.models.push(fitted.model.clone());
        self.at = fitted;
        self.path
            .push(Turn::Added(found[chosen].effect.title(robot)));
        self.known
            .push(titles(&self.at.model, &self.at.model.effects));
        Ok(true)
    }

    /// The best accepted candidate, those that the data do not separate from it, and the joint fit with it, which must
    /// keep what the linear tests promised.
    fn confirmed(
        &self,
        found: &mut [Candidate],
    ) -> Result<Option<(usize, Vec<usize>, FittedModel)>, MotionError> {
        if self.steps.len() >= self.case.limits.steps {
            return Ok(None);
        }
        let (at, split) = (&self.at, &self.problem.split);
        let mut vetoed = Vec::new();
        while let Some((chosen, others)) = choose(found, &vetoed) {
            let mut model = at.model.clone();
            model.effects.push(found[chosen].effect.clone());
            if self.known.contains(&titles(&model, &model.effects)) {
                found[chosen].reject("it was in the model, and others took its place");
                vetoed.push(chosen);
                continue;
            }
            let fitted = fit(&model, &self.problem)?;
            let vetoing = |of: &FittedModel| of.veto_squares(&fitted.weights, split);
            let kept = !self.case.limits.vetoes(&vetoing(at), &vetoing(&fitted));
            if kept && fitted.square_with(&at.weights, split) < at.square {
                return Ok(Some((chosen, others, fitted)));
            }
            let reason = "vetoed: the joint refit makes the error on data set aside larger";
            found[chosen].reject(reason);
            vetoed.push(chosen);
        }
        Ok(None)
    }

    /// What later effects made superfluous goes; whether there was any.
    fn drop_superfluous(&mut self) -> Result<bool, DiagnoseError> {
        let before = self.at.model.effects.len();
        while let Some(effect) = superfluous(&self.at, &self.problem, &self.case.limits)? {
            let mut model = self.at.model.clone();
            let title = model.effects[effect].title(&model.model.robot);
            (self.progress)(&format!("{title} is not needed any more"));
            model.effects.remove(effect);
            self.at = fit(&model, &self.problem)?;
            self.forget(effect);
            self.known
                .push(titles(&self.at.model, &self.at.model.effects));
            self.path.push(Turn::Dropped(title));
        }
        Ok(self.at.model.effects.len() < before)
    }

    /// The step that an effect of the model came with, and the places of the others beside it.
    fn forget(&mut self, effect: usize) -> Option<AcceptedEffect> {
        let step = self.steps.iter().position(|s| s.effect == effect);
        let gone = step.map(|k| {
            self.models.remove(k + 1);
            self.steps.remove(k)
        });
        for step in self.steps.iter_mut().filter(|s| s.effect > effect) {
            step.effect -= 1;
        }
        gone
    }

    /// Puts other effects in the place of some, where they say the same with fewer numbers or more; whether it did.
    fn replace(&mut self) -> Result<bool, DiagnoseError> {
        let replaced = |turn: &&Turn| matches!(turn, Turn::Replaced { .. });
        let times = self.path.iter().filter(replaced).count();
        if self.steps.is_empty() || times >= MOST_REPLACEMENTS {
            return Ok(false);
        }
        let own: Vec<usize> = self.steps.iter().map(|s| s.effect).collect();
        let torques = self.problem.torques(&self.at.model);
        let of_fitted = self.case.fitted_torques(&torques);
        let residuals = residuals(&self.at.model, &self.stretches, of_fitted);
        let noise = noise(&residuals, self.case, &self.stretches)?;
        let declared = self.declared.clone().unwrap_or_default();
        let baseline = Baseline {
            declared: &declared,
            noise: &noise,
        };
        let model = &self.at.model;
        let known = |effects: &[Added]| self.known.contains(&titles(model, effects));
        let (at, problem) = (&self.at, &self.problem);
        let found = replacement(at, problem, self.case, &baseline, &own, (&known, self.stop))?;
        self.unless_stopped()?;
        let Some(found) = found else {
            return Ok(false);
        };
        let named = |effects: &[Added]| -> Vec<String> {
            let robot = &self.case.given.model.robot;
            effects.iter().map(|e| e.title(robot)).collect()
        };
        let before: Vec<Added> = found
            .gone
            .iter()
            .map(|i| self.at.model.effects[*i].clone())
            .collect();
        let come: Vec<Added> = found.come.iter().map(|c| c.effect.clone()).collect();
        let (gone, come) = (named(&before), named(&come));
        (self.progress)(&format!(
            "{} in place of {}",
            come.join(", "),
            gone.join(", ")
        ));
        let mut chance: Option<f64> = None;
        for effect in found.gone.iter().rev() {
            let of_step = self
                .forget(*effect)
                .and_then(|s| s.candidate.placebo_p_value);
            chance = match (chance, of_step) {
                (Some(a), Some(b)) => Some(f64::max(a, b)),
                (a, b) => a.or(b),
            };
        }
        let first = found.fitted.model.effects.len() - found.come.len();
        for (i, mut candidate) in found.come.into_iter().enumerate() {
            candidate.accepted = true;
            candidate.significant = true;
            candidate.reason.clear();
            candidate.placebo_p_value = chance;
            self.steps.push(AcceptedEffect {
                effect: first + i,
                candidate,
                alternatives: Vec::new(),
                holdout: None,
            });
            self.models.push(found.fitted.model.clone());
        }
        self.at = found.fitted;
        self.known
            .push(titles(&self.at.model, &self.at.model.effects));
        self.path.push(Turn::Replaced { gone, come });
        Ok(true)
    }

    /// Everything is decided: the holdout may be looked at.
    fn evaluate(mut self) -> Result<Diagnosis, DiagnoseError> {
        let case = self.case;
        let mean = |model| {
            let errors = self.errors(model, &is_holdout, Counted::All)?;
            Ok(errors.map(|e| e.overall.mean_relative_error))
        };
        let means = self.models.iter().map(mean);
        let means = means.collect::<Result<Vec<_>, MotionError>>()?;
        for (step, pair) in self.steps.iter_mut().zip(means.windows(2)) {
            step.holdout = pair[0].zip(pair[1]).map(|(before, after)| [before, after]);
        }
        let last = &self.at.model;
        let before = self.split_errors(&case.given, Counted::All)?;
        let refitted = self.split_errors(&self.models[0], Counted::All)?.train;
        let after = self.split_errors(last, Counted::All)?;
        let floor = self.noise_floor(&self.stretches)?;
        let unseen = case.stretches_of(LogRole::Holdout);
        let floor_unseen = match unseen.is_empty() {
            true => None,
            false => Some(self.noise_floor(&unseen)?),
        };
        // friction at rest is no structure either, where the law jumps
        let (given, found) = match case.given.model.friction.iter().any(JointFriction::jumps) {
            true => (
                self.split_errors(&case.given, Counted::Moving)?,
                self.split_errors(last, Counted::Moving)?,
            ),
            false => (before.clone(), after.clone()),
        };
        self.unless_stopped()?;
        let (base, split) = (&self.at.base, &self.problem.split);
        let unknowns = base.unknowns.len();
        let unseen = found.holdout.as_ref().zip(floor_unseen);
        let left = unexplained(&found.train, &floor, unseen);
        let structured = left.iter().enumerate().filter(|(_, l)| l.is_structure());
        let structured: Vec<usize> = structured.map(|(j, _)| j).collect();
        let dependence = match case.limits.deviations {
            true => {
                let torques = self.problem.torques(&self.at.model);
                dependences(&self.at, &self.problem, &torques, &structured)
            }
            false => Vec::new(),
        };
        Ok(Diagnosis {
            part_unexplained: part_unexplained(&floor, &given.train, &found.train),
            unexplained: left,
            dependence,
            covariance: match case.limits.deviations {
                true => covariance(&self.at, &self.problem, case.cutoff_hz)?,
                false => DMatrix::from_element(unknowns, unknowns, f64::NAN),
            },
            unknowns: base.unknowns.list.clone(),
            residual_std: base.residual_rms(split),
            set_aside: split.set_aside.clone(),
            model: self.at.model,
            steps: self.steps,
            path: self.path,
            candidates: self.candidates,
            before,
            refitted,
            after,
            disturbances: self.disturbances,
            fitted_logs: case.roles.iter().filter(|r| **r == LogRole::Train).count(),
        })
    }

    /// Errors of a model over the rows of one use; none where there are no such rows.
    fn errors(
        &self,
        model: &AugmentedModel,
        wanted: &dyn Fn(RowRole) -> bool,
        counted: Counted,
    ) -> Result<Option<Errors>, MotionError> {
        let case = self.case;
        errors(
            model,
            &case.units,
            &case.stretches,
            (&case.filters, &case.rest_speed),
            &self.problem.split,
            (wanted, counted),
        )
    }

    fn split_errors(
        &self,
        model: &AugmentedModel,
        counted: Counted,
    ) -> Result<SplitErrors, DiagnoseError> {
        let train = self.errors(model, &RowRole::fitted, counted)?;
        Ok(SplitErrors {
            train: train.ok_or(DiagnoseError::TooFewRows {
                rows: 0,
                unknowns: self.unknowns,
            })?,
            holdout: self.errors(model, &is_holdout, counted)?,
        })
    }

    /// Noise in the residual of the model along stretches, per joint.
    fn noise_floor(&self, stretches: &[Stretch]) -> Result<Vec<f64>, MotionError> {
        let model = &self.at.model;
        let torques: Vec<Torques> = stretches.par_iter().map(|s| model.torques(s)).collect();
        let residuals = residuals(model, stretches, torques.iter());
        noise(&residuals, self.case, stretches)
    }
}

/// Effects of a model by their titles, in one order; waves with their orders, to two digits.
fn titles(model: &AugmentedModel, effects: &[Added]) -> Vec<String> {
    let title = |e: &Added| {
        let order = match e.law.entry.search {
            Search::Orders => e
                .shape
                .first()
                .map_or(String::new(), |o| format!(" {o:.1e}")),
            _ => String::new(),
        };
        e.title(&model.model.robot) + &order
    };
    let mut titles: Vec<String> = effects.iter().map(title).collect();
    titles.sort();
    titles
}

fn is_holdout(role: RowRole) -> bool {
    role == RowRole::Holdout
}

/// Which rows do what. Of a log that is fitted or may veto those of stationary joints count for nothing; along the
/// others nothing counts.
fn data_split(case: &Case, fitted: &[Stretch]) -> DataSplit {
    let robot = &case.given.model.robot;
    let mut of_fitted = stationary_joints(robot, fitted).into_iter();
    let vetoing = case.stretches_of(LogRole::Veto);
    let mut of_vetoing = stationary_joints(robot, &vetoing).into_iter();
    let of = |s: &Stretch| match case.roles[s.log] {
        LogRole::Train => of_fitted.next(),
        LogRole::Veto => of_vetoing.next(),
        LogRole::Holdout => None,
    };
    let all = vec![true; robot.joints()];
    let ignored = case.stretches.iter().map(of);
    DataSplit {
        ignored: ignored.map(|i| i.unwrap_or_else(|| all.clone())).collect(),
        stationary: stationary_joints(robot, &case.stretches),
        ..DataSplit::of(&case.stretches, &case.roles, &case.filters, case.cutoff_hz)
    }
}

/// Refuses what cannot be fitted. Faults of the data come before any physics.
fn check(case: &Case, split: &DataSplit, unknowns: usize) -> Result<(), DiagnoseError> {
    let rows = split.fitted_rows();
    if rows < 10 * unknowns || split.folds < 3 {
        return Err(DiagnoseError::TooFewRows { rows, unknowns });
    }
    for (j, joint) in case.given.model.robot.joint_names().iter().enumerate() {
        let silent = |s: &Stretch| s.tau[j].iter().all(|x| *x == 0.0);
        if case.stretches.iter().all(silent) {
            return Err(DiagnoseError::NoTorque {
                joint: joint.clone(),
            });
        }
    }
    match suspicion(&case.given, &case.stretches, &case.filters, split)? {
        Some(found) => Err(DiagnoseError::Channels(found)),
        None => Ok(()),
    }
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
