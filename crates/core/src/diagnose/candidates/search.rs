//! All candidates of one round: every effect at every place where it can sit, its shape searched.

use rayon::prelude::*;

use super::baseline::Baseline;
use super::candidate::Candidate;
use super::columns::{CandidateColumns, columns, kept_by_filter};
use super::orders::SCANNED;
use super::score::CandidateTest;
use crate::diagnose::placebo::draws::Tried;
use crate::diagnose::problem::case::Case;
use crate::diagnose::problem::cross_products::CrossProducts;
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::watch::Watch;
use crate::effect::{Added, LAWS, Law, Place, Role, Search, Torques, order_is_whole};
use crate::math::minimise::nelder_mead;
use crate::motion::MotionError;

/// Most evaluations of a shape's refinement, per shape parameter.
const REFINEMENTS: u64 = 24;
/// A shape is refined where the best start removes at least this share of what it must.
const HOPELESS: f64 = 0.2;
/// Least part of a periodic column's power that the parallel filter must keep.
const LEAST_KEPT: f64 = 0.2;

/// What a round of candidates comes to.
pub struct RoundResult<'a> {
    /// Not yet decided on.
    pub candidates: Vec<Candidate>,
    /// What each was tried with.
    pub tried: Vec<Tried>,
    pub test: CandidateTest<'a>,
}

/// Whether a law is looked for at a place.
pub(crate) type Wanted<'w> = dyn Fn(&Law, Place) -> bool + Sync + 'w;

/// Tries once everything that is `wanted`, and goes into what removes at least the fraction `needed` of the weighted
/// squares.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn search<'a>(
    at: &'a FittedModel,
    problem: &'a FitProblem<'a>,
    case: &Case,
    baseline: &Baseline,
    torques: &'a [Torques],
    (wanted, needed): (&Wanted<'_>, f64),
    (watch, name): (Watch, &str),
) -> Result<RoundResult<'a>, MotionError> {
    let round = SearchRound {
        at,
        problem,
        test: CandidateTest::new(at, problem),
        torques,
        keep: case.keep,
        needed,
    };
    let robot = &at.model.model.robot;
    let laws = &at.model.model.friction;
    let places: Vec<(&'static Law, Place)> = LAWS
        .iter()
        .chain(&case.own)
        .filter(|law| law.entry.role != Role::StandIn)
        .filter(|law| !case.without.iter().any(|name| name == law.entry.name))
        .flat_map(|law| law.places(robot, laws).into_iter().map(|p| (*law, p)))
        .filter(|(law, place)| wanted(law, *place))
        .collect();
    let part = watch.part(name, places.len());
    let found: Vec<(Candidate, Tried)> = places
        .par_iter()
        .map(|&(law, place)| {
            if (watch.stop)() {
                return Ok((
                    Candidate::refused(law, place, "interrupted"),
                    Tried::default(),
                ));
            }
            let noise = baseline.noise_square(at, &problem.split, place);
            let least = noise * case.limits.over_noise / at.square;
            let tried = round.tried(law, place, HOPELESS * least);
            part.step();
            tried
        })
        .collect::<Result<_, MotionError>>()?;
    let (candidates, tried) = found.into_iter().unzip();
    Ok(RoundResult {
        candidates,
        tried,
        test: round.test,
    })
}

/// What every candidate of a round is tried against.
struct SearchRound<'a> {
    at: &'a FittedModel,
    problem: &'a FitProblem<'a>,
    test: CandidateTest<'a>,
    torques: &'a [Torques],
    /// The given model is kept within its covariance.
    keep: bool,
    /// Least fraction of the weighted squares that a candidate must remove before its shape is refined.
    needed: f64,
}

/// Columns of a candidate and their sums over every piece.
type Sums = (CandidateColumns, Vec<CrossProducts>);

impl SearchRound<'_> {
    /// One effect at one place: the best of its shapes, refined where it removes more than `least`; and the shapes
    /// that it began from.
    fn tried(
        &self,
        law: &'static Law,
        place: Place,
        least: f64,
    ) -> Result<(Candidate, Tried), MotionError> {
        let mut tried = Tried::default();
        let refused =
            |reason: &str, tried: Tried| Ok((Candidate::refused(law, place, reason), tried));
        if let Some(reason) = self.refusal(law, place) {
            return refused(reason, tried);
        }
        let starts = match law.starts_on(&self.problem.cover, place) {
            Ok(starts) => starts,
            Err(lacking) => return refused(&lacking, tried),
        };
        if law.entry.search == Search::Orders {
            // a peak was picked out of all orders that were looked at
            tried.picked_from = SCANNED;
        }
        let open = vec![f64::NAN; law.shape.len()];
        let mut effect = Added::new(law, place, open, vec![0.0; law.linear.len()]);
        let (gain, mut sums) = match self.best_start(&mut effect, starts, &mut tried)? {
            Ok(best) => best,
            Err(reason) => return refused(reason, tried),
        };
        if gain < self.needed {
            return refused(
                "it removes less than the effect that it would replace",
                tried,
            );
        }
        if gain > least && self.refine(&mut effect)? {
            sums = self.sums(&effect)?;
            let (_, scores) = self.test.gain_by_blocks(&sums.1, effect.linear.len());
            tried.best = tried.starts.len();
            tried.starts.extend(scores);
        }
        if self
            .added(law, place)
            .any(|e| near(&e.shape, &effect.shape))
        {
            return refused("it is in the model", tried);
        }
        if law.entry.search == Search::Orders {
            let order = effect.shape[0];
            if !order_is_whole(&self.problem.cover, place, order) {
                let reason = format!(
                    "{order:.3} waves a turn: after a full turn the joint is where it was, and orders are whole"
                );
                return refused(&reason, tried);
            }
        }
        let numbers = (effect.linear.len(), effect.shape.len());
        let score = self.test.score_of(&sums.0, &sums.1, numbers);
        let reason = match &score {
            None => "the declared parameters explain all of it",
            Some(s) => {
                effect.linear.clone_from(&s.beta);
                ""
            }
        };
        Ok((Candidate::open(effect, score, reason), tried))
    }

    /// Effects of this law that the model has at this place.
    fn added(&self, law: &'static Law, place: Place) -> impl Iterator<Item = &Added> {
        let effects = self.at.model.effects.iter();
        effects.filter(move |e| e.name() == law.entry.name && e.place == place)
    }

    /// Why an effect is not tried at a place.
    fn refusal(&self, law: &'static Law, place: Place) -> Option<&'static str> {
        let mut touched = (0..self.at.weights.len()).filter(|j| place.touches(*j));
        if touched.all(|j| self.problem.cover.joints[j].stationary) {
            return Some("the joint is held in these logs: move it to see what it does");
        }
        if law.entry.role == Role::Kept && !self.keep {
            return Some(
                "a fit that is free while carrying it absorbs it; give the model of logs \
                 without it, and --keep",
            );
        }
        // only waves come more than once, each with an order of its own
        let once = law.entry.search != Search::Orders;
        (once && self.added(law, place).next().is_some()).then_some("it is in the model")
    }

    fn columns(&self, effect: &Added) -> Result<CandidateColumns, MotionError> {
        columns(&self.at.model, self.problem, self.torques, effect)
    }

    /// What an effect removes with its shape.
    fn gain(&self, effect: &Added) -> Result<f64, MotionError> {
        let columns = self.columns(effect)?;
        Ok(self.test.gain(&columns, effect.linear.len()))
    }

    /// Gives the effect the best of the shapes to start from, and says what it removes; or why there is
    /// none.
    fn best_start(
        &self,
        effect: &mut Added,
        starts: Vec<Vec<f64>>,
        tried: &mut Tried,
    ) -> Result<Result<(f64, Sums), &'static str>, MotionError> {
        let mut best = None;
        let mut highest = f64::NEG_INFINITY;
        for shape in starts {
            effect.shape = shape;
            if effect.law.entry.search == Search::Orders {
                let kept = kept_by_filter(&self.at.model, self.problem, self.torques, effect)?;
                if kept < LEAST_KEPT {
                    continue;
                }
            }
            let sums = self.sums(effect)?;
            if effect.law.formula.is_some() && !is_finite(&sums.0) {
                // nothing that was tried before counts then
                *tried = Tried::default();
                return Ok(Err(
                    "its formula gives no number somewhere along these logs",
                ));
            }
            let (gain, scores) = self.test.gain_by_blocks(&sums.1, effect.linear.len());
            if gain > highest {
                highest = gain;
                best = Some((effect.shape.clone(), sums));
                tried.best = tried.starts.len();
            }
            tried.starts.extend(scores);
        }
        let Some((shape, sums)) = best else {
            return Ok(Err(
                "the filter's cut-off takes the orders that are there: raise cutoff_hz in [filter] to look for them",
            ));
        };
        effect.shape = shape;
        Ok(Ok((highest, sums)))
    }

    /// Columns of an effect and their sums.
    fn sums(&self, effect: &Added) -> Result<Sums, MotionError> {
        let columns = self.columns(effect)?;
        let cross = self.test.cross(&columns, effect.linear.len());
        Ok((columns, cross))
    }

    /// Refines a shape that is free, in ratios to where it starts; whether there is one.
    fn refine(&self, effect: &mut Added) -> Result<bool, MotionError> {
        let (law, cover) = (effect.law, &self.problem.cover);
        let limits = law.limits_on(cover, effect.place);
        let free = limits.iter().all(|[low, high]| low < high);
        if effect.shape.is_empty() || !law.entry.search.refines() || !free {
            return Ok(false);
        }
        let centre = effect.shape.clone();
        let shape_at = |x: &[f64]| -> Vec<f64> {
            let parts = centre.iter().zip(x).zip(&limits);
            let of = |((c, x), [low, high]): ((&f64, &f64), &[f64; 2])| {
                (c + c.abs().max(1e-9) * x).clamp(*low, *high)
            };
            parts.map(of).collect()
        };
        // an order's peak is as narrow as one wave over the travel
        let step = |order: &f64| match law.entry.search {
            Search::Orders => 0.15 / (order.abs() * cover.travel(effect.place)).max(0.5),
            _ => 0.2,
        };
        let steps: Vec<f64> = centre.iter().map(step).collect();
        let mut failed = None;
        let mut cost = |x: &[f64]| {
            let moved = Added {
                shape: shape_at(x),
                ..effect.clone()
            };
            self.gain(&moved).map_or_else(
                |error| {
                    failed = Some(error);
                    f64::INFINITY
                },
                // a formula may have holes between the shapes that were tried
                |gain| if gain.is_nan() { f64::INFINITY } else { -gain },
            )
        };
        let budget = REFINEMENTS * centre.len() as u64;
        let start = vec![0.0; centre.len()];
        let found = nelder_mead(&mut cost, &start, &steps, 1e-6, budget);
        match failed {
            Some(error) => Err(error),
            None => {
                effect.shape = shape_at(&found.x);
                Ok(true)
            }
        }
    }
}

/// Whether the columns of an effect are numbers everywhere.
fn is_finite(columns: &CandidateColumns) -> bool {
    let mut all = columns.iter().flatten().flatten().flatten();
    all.all(|x| x.is_finite())
}

/// Whether two shapes are one and the same effect.
fn near(a: &[f64], b: &[f64]) -> bool {
    a.iter()
        .zip(b)
        .all(|(a, b)| (a - b).abs() <= 0.05 * a.abs().max(b.abs()))
}
