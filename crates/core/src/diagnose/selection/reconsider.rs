//! Whether other effects say the same as those that were added, with fewer numbers: one in place of two, a pair of
//! one kind in place of many terms, or one delay for each joint in place of one clock.
//!
//! A search that adds the best effect each time takes what lowers the error most beside what is there. One cause may
//! so take two names, and two places of one kind, neither of which explains anything without the other, the name of
//! something larger.

use super::physics::possible;
use crate::diagnose::candidates::baseline::Baseline;
use crate::diagnose::candidates::candidate::Candidate;
use crate::diagnose::candidates::columns::{CandidateColumns, columns};
use crate::diagnose::candidates::score::{CandidateTest, spread};
use crate::diagnose::candidates::search::search;
use crate::diagnose::problem::case::{Case, SelectionLimits};
use crate::diagnose::problem::fit::{FittedModel, fit};
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::watch::Watch;
use crate::effect::{Added, AugmentedModel, LAWS, Law, Place, Role, Search, Torques};
use crate::motion::MotionError;

/// Other effects in place of some.
pub(crate) struct Replacement {
    /// Indices of the effects that go.
    pub gone: Vec<usize>,
    /// What comes, in the order in which the model has it at its end.
    pub come: Vec<Candidate>,
    pub fitted: FittedModel,
}

/// Whether a set of effects has been tried.
type Known<'a> = dyn Fn(&[Added]) -> bool + 'a;

/// Most single effects and pairs that others are looked for in the place of.
const GROUPS: usize = 4;
/// Sets that are fitted jointly, the likeliest, in the place of one effect or two.
const FITTED: usize = 2;
/// Least part of what the effects removed that another must remove with the shape that its search begins from.
const NEEDED: f64 = 0.3;

/// The first replacement that these data do not tell from what is there and that has fewer numbers, or that they tell
/// to be better. Only effects in `found` go, by their indices; `known` says which sets have been tried.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn replacement(
    at: &FittedModel,
    problem: &FitProblem,
    case: &Case,
    baseline: &Baseline,
    found: &[usize],
    (known, watch): (&Known, Watch),
) -> Result<Option<Replacement>, MotionError> {
    let present = Errors::of(at, at, problem)?;
    let mut groups = groups(&at.model.effects, at.weights.len());
    groups.retain(|gone| gone.iter().all(|i| found.contains(i)));
    for gone in groups.into_iter().take(GROUPS) {
        if (watch.stop)() {
            return Ok(None);
        }
        let mut model = at.model.clone();
        let mut of_gone: Vec<Added> = Vec::new();
        for i in gone.iter().rev() {
            of_gone.push(model.effects.remove(*i));
        }
        let without = fit(&model, problem)?;
        let left = at.square_with(&without.weights, &problem.split) / without.square;
        let of = (of_gone.as_slice(), NEEDED * (1.0 - left).max(0.0));
        let sets = instead(&without, problem, case, baseline, of, watch)?;
        for come in sets {
            let mut model = without.model.clone();
            model.effects.extend(come.iter().map(|c| c.effect.clone()));
            if known(&model.effects) {
                continue;
            }
            let fitted = fit(&model, problem)?;
            if fitted
                .model
                .effects
                .iter()
                .all(|e| possible(e, &fitted, problem, case))
                && preferred(&Errors::of(&fitted, at, problem)?, &present, &case.limits)
            {
                return Ok(Some(Replacement { gone, come, fitted }));
            }
        }
    }
    Ok(None)
}

/// Effects of a model by their titles, in one order; waves with their orders, to two digits.
pub(crate) fn titles(model: &AugmentedModel, effects: &[Added]) -> Vec<String> {
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

/// Effects that may be one: those with three numbers or more, delays of all joints, and every two that move a joint
/// of theirs together.
fn groups(effects: &[Added], joints: usize) -> Vec<Vec<usize>> {
    let together =
        |a: &Added, b: &Added| (0..joints).any(|j| a.place.touches(j) && b.place.touches(j));
    let single = |e: &Added| e.parameters() > 2 || is_of_one_clock(e);
    let mut found: Vec<Vec<usize>> = (0..effects.len())
        .filter(|i| single(&effects[*i]))
        .map(|i| vec![i])
        .collect();
    for (i, a) in effects.iter().enumerate() {
        let later = effects.iter().enumerate().skip(i + 1);
        let pairs = later.filter(|(_, b)| together(a, b) && a.law.entry.role == b.law.entry.role);
        found.extend(pairs.map(|(k, _)| vec![i, k]));
    }
    found
}

fn is_of_one_clock(effect: &Added) -> bool {
    effect.law.entry.role == Role::Shift && effect.place == Place::All
}

/// Sets of candidates that may stand in the place of effects, the likeliest first.
fn instead(
    without: &FittedModel,
    problem: &FitProblem,
    case: &Case,
    baseline: &Baseline,
    (gone, needed): (&[Added], f64),
    watch: Watch,
) -> Result<Vec<Vec<Candidate>>, MotionError> {
    let torques = problem.torques(&without.model);
    let joints = without.weights.len();
    let moved = |place: Place| {
        (0..joints).any(|j| place.touches(j) && gone.iter().any(|e| e.place.touches(j)))
    };
    let most: usize = gone.iter().map(Added::parameters).sum();
    let fewer = |law: &Law| law.shape.len() + law.linear.len() < most;
    let same = |law: &Law, place: Place| {
        gone.len() == 1 && gone[0].name() == law.entry.name && gone[0].place == place
    };
    // an order is not simpler than what it would replace
    let open = |law: &Law| law.entry.search != Search::Orders && fewer(law);
    let wanted = |law: &Law, place: Place| open(law) && moved(place) && !same(law, place);
    let of = (&wanted as &(dyn Fn(&Law, Place) -> bool + Sync), needed);
    let name = (watch, "other effects instead");
    let found = search(without, problem, case, baseline, &torques, of, name)?;
    let mut sets: Vec<(f64, Vec<Candidate>)> = Vec::new();
    for candidate in found.candidates {
        if let Some(score) = candidate
            .score
            .as_ref()
            .filter(|_| possible(&candidate.effect, without, problem, case))
        {
            sets.push((score.cv_gain, vec![candidate]));
        }
    }
    for pair in pairs(&case.without, without, problem, most) {
        if moved(pair[0].place)
            && moved(pair[1].place)
            && let Some((gain, pair)) = tried(&found.test, without, problem, &torques, pair)?
            && pair
                .iter()
                .all(|c| possible(&c.effect, without, problem, case))
        {
            sets.push((gain, pair));
        }
    }
    sets.sort_by(|a, b| b.0.total_cmp(&a.0));
    sets.truncate(FITTED);
    if gone.iter().any(is_of_one_clock) {
        let law = gone[0].law;
        let own = (0..joints).filter(|j| !problem.cover.joints[*j].stationary);
        let each = own.map(|j| Candidate::open(plain(law, Place::Joint(j)), None, ""));
        sets.insert(0, (0.0, each.collect()));
    }
    Ok(sets.into_iter().map(|(_, set)| set).collect())
}

fn plain(law: &'static Law, place: Place) -> Added {
    Added::new(law, place, Vec::new(), vec![0.0; law.linear.len()])
}

/// Pairs of one kind: both motors of the pantograph, and joints that follow each other, with fewer numbers than
/// `most`.
fn pairs(
    without: &[String],
    at: &FittedModel,
    problem: &FitProblem,
    most: usize,
) -> Vec<[Added; 2]> {
    let (robot, laws) = (&at.model.model.robot, &at.model.model.friction);
    let open = LAWS.iter().filter(|law| {
        law.shape.is_empty()
            && 2 * law.linear.len() < most
            && law.entry.role == Role::Columns
            && !without.iter().any(|name| name == law.entry.name)
    });
    let mut found = Vec::new();
    for law in open {
        let present = |place: &Place| {
            let mut effects = at.model.effects.iter();
            effects.any(|e| e.name() == law.entry.name && e.place == *place)
        };
        let possible =
            |place: &Place| !present(place) && law.starts_on(&problem.cover, *place).is_ok();
        let places: Vec<Place> = law
            .places(robot, laws)
            .into_iter()
            .filter(possible)
            .collect();
        for (i, a) in places.iter().enumerate() {
            for b in &places[i + 1..] {
                let neighbours = match (a, b) {
                    (Place::Actuator(_), Place::Actuator(_)) => true,
                    (Place::Joint(a), Place::Joint(b)) => a.abs_diff(*b) == 1,
                    _ => false,
                };
                if neighbours {
                    found.push([plain(law, *a), plain(law, *b)]);
                }
            }
        }
    }
    found
}

/// What a pair would remove together, with its coefficients; none where one of them has nothing of its own.
fn tried(
    test: &CandidateTest,
    at: &FittedModel,
    problem: &FitProblem,
    torques: &[Torques],
    mut pair: [Added; 2],
) -> Result<Option<(f64, Vec<Candidate>)>, MotionError> {
    let k = pair[0].linear.len();
    let of = |effect: &Added| columns(&at.model, problem, torques, effect);
    let (a, b) = (of(&pair[0])?, of(&pair[1])?);
    let Some(score) = test.score(&beside(a, b, k), 2 * k, 0) else {
        return Ok(None);
    };
    let (first, second) = score.beta.split_at(k);
    pair[0].linear = first.to_vec();
    pair[1].linear = second.to_vec();
    let gain = score.cv_gain;
    let candidates = pair
        .into_iter()
        .map(|effect| Candidate::open(effect, Some(score.clone()), ""));
    Ok(Some((gain, candidates.collect())))
}

/// Columns of two effects with `k` each as those of one.
fn beside(mut a: CandidateColumns, b: CandidateColumns, k: usize) -> CandidateColumns {
    for (a, b) in a.iter_mut().zip(b) {
        for (a, b) in a.iter_mut().zip(b) {
            let rows = a.first().or(b.first()).map_or(0, Vec::len);
            if rows == 0 {
                continue;
            }
            let filled = |x: Vec<Vec<f64>>| match x.is_empty() {
                true => vec![vec![0.0; rows]; k],
                false => x,
            };
            *a = [filled(std::mem::take(a)), filled(b)].concat();
        }
    }
    a
}

/// Squared errors of a model on data that its fit left out.
struct Errors {
    folds: Vec<f64>,
    vetoes: Vec<f64>,
    numbers: usize,
}

impl Errors {
    /// In the weights of another model.
    fn of(
        fitted: &FittedModel,
        weights: &FittedModel,
        problem: &FitProblem,
    ) -> Result<Self, MotionError> {
        let weighted = weights.with(fitted.model.clone(), problem)?;
        let test = CandidateTest::new(&weighted, problem);
        Ok(Errors {
            folds: test.base_folds,
            vetoes: test.base_vetoes,
            numbers: fitted.model.effects.iter().map(Added::parameters).sum(),
        })
    }
}

/// Standard errors by which a set with more numbers must be better.
const BETTER: f64 = 2.0;

/// Whether another set is taken in the place of what is there.
fn preferred(other: &Errors, present: &Errors, limits: &SelectionLimits) -> bool {
    let sum = |x: &[f64]| x.iter().sum::<f64>();
    let worse = sum(&other.folds) - sum(&present.folds);
    let chance = spread(&other.folds, &present.folds);
    let vetoed = limits.vetoes(&present.vetoes, &other.vetoes);
    let enough = match other.numbers < present.numbers {
        true => worse <= chance,
        false => {
            let least = limits.cv_gain * sum(&present.folds);
            -worse > least.max(BETTER * chance)
        }
    };
    enough && !vetoed
}
