//! The loop: fit, search, add the best, refit, test every accepted effect for removal; where nothing is accepted any
//! more, look for other effects that say the same, and search again. Only then is the holdout looked at.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::baseline::Baseline;
use super::candidates::candidate::Candidate;
use super::candidates::orders;
use super::candidates::search::search;
use super::error::DiagnoseError;
use super::faults::disturbance::{self, CutDisturbance};
use super::outcome::{AcceptedEffect, Diagnosis, SplitErrors, Turn};
use super::prepare::{check, data_split, residuals};
use super::problem::case::Case;
use super::problem::data_split::{LogRole, RowRole};
use super::problem::fit::{FittedModel, fit};
use super::problem::fit_problem::{FitProblem, inertial_of};
use super::problem::normal_equations::InertialSums;
use super::problem::rests::rest_weight;
use super::problem::unknowns::Unknowns;
use super::selection::accept::{accept, beyond_chance};
use super::selection::choose::{alternatives, choose};
use super::selection::physics::{refused, seen, settled};
use super::selection::reconsider::{replacement, titles};
use super::selection::removal::superfluous;
use super::selection::stand_in::stand_in;
use super::uncertainty::covariance::covariance;
use super::unexplained::dependence::dependences;
use super::unexplained::errors::{self, Counted, Errors, Pieces};
use super::unexplained::{noise, part_unexplained, unexplained};
use super::watch::Watch;
use crate::effect::{Added, AugmentedModel, Cover, Law, Place, Torques};
use crate::math::rank_revealing::RankRevealingInverse;
use crate::motion::{MotionError, Stretch};
use crate::robot::model::JointFriction;

/// Most times that effects take the place of others.
const MOST_REPLACEMENTS: usize = 2;

/// Most disturbances that are cut out.
const MOST_DISTURBANCES: usize = 8;

/// Diagnoses; `watch` hears of every step and is asked now and then whether to stop.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(case: &Case, watch: Watch) -> Result<Diagnosis, DiagnoseError> {
    let mut work = Diagnosing::begin(case, watch)?;
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
    work.drop_refused()?;
    work.evaluate()
}

/// A diagnosis as far as it has come.
struct Diagnosing<'a> {
    case: &'a Case,
    watch: Watch<'a>,
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
    /// Noise in the residual, per joint, of the round that is under way.
    noise: Vec<f64>,
    /// Covariance of the last fit, once it is known.
    covariance: Option<DMatrix<f64>>,
}

impl<'a> Diagnosing<'a> {
    /// Divides the data, refuses what cannot be fitted, and fits the declared model.
    fn begin(case: &'a Case, watch: Watch<'a>) -> Result<Self, DiagnoseError> {
        let robot = &case.given.model.robot;
        let stretches = case.stretches_of(LogRole::Train);
        let split = data_split(case, &stretches);
        let cover = Cover::of(robot, &stretches, case.cutoff_hz);
        let unknowns = Unknowns::of(&case.given, &case.open, &cover).len();
        check(case, &split, unknowns)?;
        let joints = robot.joints();
        let mut problem = FitProblem {
            inertial: inertial_of(robot, &case.stretches, &case.filters, &split)?,
            inertial_sums: InertialSums::new(),
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
            problem.inertial_sums = InertialSums::new();
            at = fit(&case.given, &problem)?;
        }
        let inverse = RankRevealingInverse::of(&at.normal);
        if (0..at.normal.nrows()).all(|i| inverse.redundant(i)) {
            return Err(DiagnoseError::NothingDetermined { unknowns });
        }
        Ok(Diagnosing {
            case,
            watch,
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
            noise: Vec::new(),
            covariance: None,
        })
    }

    fn unless_stopped(&self) -> Result<(), DiagnoseError> {
        match (self.watch.stop)() {
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
            self.watch.said(&said);
        }
        self.disturbances.extend(cut);
        self.problem.inertial_sums = InertialSums::new();
        self.at = fit(&self.at.model, &self.problem)?;
        Ok(true)
    }

    /// One round of candidates, judged.
    fn search(&mut self) -> Result<Vec<Candidate>, DiagnoseError> {
        let case = self.case;
        let squares = || self.at.base.residual_squares(&self.problem.split);
        let declared = self.declared.get_or_insert_with(squares).clone();
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
            declared: &declared,
            noise: &noise,
        };
        let (at, problem) = (&self.at, &self.problem);
        let all = |_: &Law, _: Place| true;
        let wanted = (&all as &(dyn Fn(&Law, Place) -> bool + Sync), 0.0);
        let named = format!("search for effect {}", self.steps.len() + 1);
        let watch = (self.watch, named.as_str());
        let mut found = search(at, problem, case, &baseline, &torques, wanted, watch)?;
        self.judge(&mut found.candidates, &baseline);
        let wide = case.wide.as_ref();
        beyond_chance(&mut found, &case.limits, (at, problem), &torques, wide)?;
        let found = found.candidates;
        self.noise = noise;
        Ok(found)
    }

    /// Decides on candidates but for chance.
    fn judge(&self, found: &mut [Candidate], baseline: &Baseline) {
        let (case, at, problem) = (self.case, &self.at, &self.problem);
        let seen = |place| seen(&at.model, &problem.cover, &case.drives, place);
        accept(found, &case.limits, (at, &problem.split), baseline, &seen);
    }

    /// Adds to the candidates a curve in the place of each whose numbers no machine has, where there is one to add.
    fn add_curves(&self, found: &mut Vec<Candidate>) -> Result<(), MotionError> {
        let baseline = Baseline {
            declared: self.declared.as_deref().unwrap_or_default(),
            noise: &self.noise,
        };
        let impossible = found.iter().filter(|c| c.impossible).cloned();
        for refused in impossible.collect::<Vec<_>>() {
            let curve = stand_in(&refused, &self.at, &self.problem, found)?;
            let mut curve = Vec::from_iter(curve);
            self.judge(&mut curve, &baseline);
            found.extend(curve);
        }
        Ok(())
    }

    /// Adds the best of the accepted candidates that a joint refit confirms; whether there is one. The others
    /// are kept for the report where it is the last round.
    fn add_best(&mut self, mut found: Vec<Candidate>) -> Result<bool, DiagnoseError> {
        let mut best = self.confirmed(&mut found)?;
        if best.is_none() {
            // a curve is the last resort: it fits what a name would explain
            self.add_curves(&mut found)?;
            best = self.confirmed(&mut found)?;
        }
        let Some((chosen, others, fitted)) = best else {
            for candidate in found.iter_mut().filter(|c| c.accepted) {
                candidate.accepted = false;
                candidate.reason =
                    "as many effects as are looked for were found before it".to_owned();
            }
            self.candidates = found;
            return Ok(false);
        };
        let robot = &self.case.given.model.robot;
        self.watch.said(&format!(
            "added {}: {:.1} % of the cross-validated squared error",
            found[chosen].effect.title(robot),
            100.0 * found[chosen].score.as_ref().map_or(0.0, |s| s.cv_gain)
        ));
        self.steps.push(AcceptedEffect {
            effect: fitted.model.effects.len() - 1,
            candidate: found[chosen].clone(),
            alternatives: alternatives(&found, chosen, &others, robot.joints()),
            holdout: None,
            joints: Vec::new(),
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
            let newest = fitted.model.effects.len() - 1;
            let fitted = match settled(fitted, &self.problem, self.case, newest)? {
                Ok(fitted) => fitted,
                Err(refusal) => {
                    found[chosen].reject(&refusal.reason);
                    found[chosen].impossible = refusal.impossible;
                    vetoed.push(chosen);
                    continue;
                }
            };
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
            let title = self.at.model.effects[effect].title(&self.at.model.model.robot);
            self.watch.said(&format!("{title} is not needed any more"));
            self.drop(effect)?;
        }
        Ok(self.at.model.effects.len() < before)
    }

    /// Takes an effect out of the model and fits the rest again; the step that it came with.
    fn drop(&mut self, effect: usize) -> Result<Option<AcceptedEffect>, MotionError> {
        let mut model = self.at.model.clone();
        let gone = model.effects.remove(effect);
        self.at = fit(&model, &self.problem)?;
        self.known
            .push(titles(&self.at.model, &self.at.model.effects));
        let title = gone.title(&model.model.robot);
        self.path.push(Turn::Dropped(title));
        Ok(self.forget(effect))
    }

    /// What the whole covariance of the last fit says to be unknown, or beyond what a machine has, goes too.
    fn drop_refused(&mut self) -> Result<(), DiagnoseError> {
        while self.case.limits.deviations && !self.steps.is_empty() {
            let covariance = covariance(&self.at, &self.problem, self.case.cutoff_hz)?;
            let refused = self.steps.iter().find_map(|step| {
                let of = (step.effect, &covariance);
                let refusal = refused(&self.at, &self.problem, self.case, of)?;
                Some((step.effect, refusal))
            });
            let Some((effect, refusal)) = refused else {
                self.covariance = Some(covariance);
                return Ok(());
            };
            self.unless_stopped()?;
            if let Some(step) = self.drop(effect)? {
                let mut gone = step.candidate;
                gone.reject(&refusal.reason);
                self.candidates.push(gone);
            }
        }
        Ok(())
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
        let found = replacement(
            at,
            problem,
            self.case,
            &baseline,
            &own,
            (&known, self.watch),
        )?;
        self.unless_stopped()?;
        let Some(mut found) = found else {
            return Ok(false);
        };
        let first = found.fitted.model.effects.len() - found.come.len();
        let tried = titles(&found.fitted.model, &found.fitted.model.effects);
        match settled(found.fitted, &self.problem, self.case, first)? {
            Ok(fitted) => found.fitted = fitted,
            // numbers that no machine has, or that these data do not tell: another set is tried
            Err(_) => {
                self.known.push(tried);
                return self.replace();
            }
        }
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
        self.watch.said(&format!(
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
                joints: Vec::new(),
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
        let unseen = |model| self.pieces(model, &is_holdout, Counted::All);
        let unseen = self.models.iter().map(unseen);
        let unseen = unseen.collect::<Result<Vec<_>, MotionError>>()?;
        let joints = case.given.model.robot.joint_names();
        for (step, pair) in self.steps.iter_mut().zip(unseen.windows(2)) {
            let [before, after] = [&pair[0], &pair[1]];
            let means = [before, after].map(errors::mean_relative_error);
            step.holdout = means[0]
                .zip(means[1])
                .map(|(before, after)| [before, after]);
            step.joints = errors::changes(joints, before, after);
        }
        // without an effect the given model stands; what it lacks is judged with its numbers refitted, for those
        // that other logs gave are no missing physics
        let last = match self.steps.is_empty() {
            true => &case.given,
            false => &self.at.model,
        };
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
                self.split_errors(&self.at.model, Counted::Moving)?,
            ),
            false => (
                before.clone(),
                self.split_errors(&self.at.model, Counted::All)?,
            ),
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
            covariance: match (self.covariance, case.limits.deviations) {
                (Some(known), _) => known,
                (None, true) => covariance(&self.at, &self.problem, case.cutoff_hz)?,
                (None, false) => DMatrix::from_element(unknowns, unknowns, f64::NAN),
            },
            unknowns: base.unknowns.list.clone(),
            residual_std: base.residual_rms(split),
            set_aside: split.set_aside.clone(),
            model: last.clone(),
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
        let pieces = self.pieces(model, wanted, counted)?;
        Ok(errors::summed(model, &self.case.units, &pieces))
    }

    /// The same piece by piece.
    fn pieces(
        &self,
        model: &AugmentedModel,
        wanted: &dyn Fn(RowRole) -> bool,
        counted: Counted,
    ) -> Result<Pieces, MotionError> {
        let case = self.case;
        errors::pieces(
            model,
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

fn is_holdout(role: RowRole) -> bool {
    role == RowRole::Holdout
}
