//! Minimisation of a smooth or a rough function of several variables: the only door to `argmin`.
//!
//! [`nelder_mead`] needs values only (Nelder and Mead 1965), [`lbfgs`] a gradient (Liu and Nocedal
//! 1989, line search of More and Thuente 1994). Both stop by a count of evaluations, never by a
//! clock, so that a run repeats itself, and both give the best point that was evaluated, however
//! the search ended.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, Executor, Gradient, OptimizationResult, State};
use argmin::core::{TerminationReason, TerminationStatus};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::neldermead::NelderMead;
use argmin::solver::quasinewton::LBFGS;

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchEnding {
    /// Within the tolerance.
    Converged,
    /// The evaluations are used up; the best point so far is given.
    EvaluationLimit,
    /// No further descent was found, though the tolerance is not met.
    Stalled,
    /// The function has no finite value at the start.
    NoStart,
}

/// The best point that a search evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct MinimumPoint {
    pub x: Vec<f64>,
    pub value: f64,
    /// Evaluations of the function (and its gradient) that were spent.
    pub evaluations: u64,
    pub ending: SearchEnding,
}

/// Minimises `f` from `start` by the simplex method, its first simplex reaching `steps` along each
/// axis. Values that are NaN count as infinite: such points are avoided.
///
/// Converged: the values at the corners differ by less than `tolerance` (standard deviation), and
/// a fresh simplex at that point, a quarter of the first in size, finds nothing lower by more than
/// `tolerance` (a simplex can collapse before it has arrived).
pub fn nelder_mead(
    f: &mut dyn FnMut(&[f64]) -> f64,
    start: &[f64],
    steps: &[f64],
    tolerance: f64,
    max_evaluations: u64,
) -> MinimumPoint {
    let mut values = |x: &[f64], _: &mut [f64]| f(x);
    let mut search = BudgetedSearch::new(&mut values, start, max_evaluations);
    search.levels_out = true;
    if let Some(ending) = search.begin() {
        return search.end(ending);
    }
    let search = RefCell::new(search);
    let mut shrink = 1.0;
    loop {
        let (centre, before) = search.borrow().best.clone();
        let mut simplex = vec![centre.clone()];
        for (i, step) in steps.iter().enumerate().take(centre.len()) {
            let mut corner = centre.clone();
            corner[i] += shrink * step;
            simplex.push(corner);
        }
        let outcome = NelderMead::new(simplex)
            .with_sd_tolerance(tolerance)
            .and_then(|solver| {
                Executor::new(SearchProblem(&search), solver)
                    // every step asks for a value at least: this only bounds what follows a refusal
                    .configure(|state| state.max_iters(max_evaluations))
                    .timer(false)
                    .run()
            });
        let ending = search.borrow().ending(&outcome);
        let gained = before - search.borrow().best.1;
        if ending != SearchEnding::Converged || (shrink < 1.0 && gained <= tolerance) {
            return search.into_inner().end(ending);
        }
        shrink = 0.25;
    }
}

/// Minimises `f`, which writes its gradient into its second argument, from `start`.
///
/// Converged: the gradient's norm is below `gradient_tolerance`, or a step changes the value by
/// less than 2.2e-16.
/// The first step has length 1 at most: scale the variables so that this is a fair step.
pub fn lbfgs(
    f: &mut dyn FnMut(&[f64], &mut [f64]) -> f64,
    start: &[f64],
    gradient_tolerance: f64,
    max_evaluations: u64,
) -> MinimumPoint {
    let mut search = BudgetedSearch::new(f, start, max_evaluations);
    if let Some(ending) = search.begin() {
        return search.end(ending);
    }
    // The search tries `x - gradient` first: far out of range where the gradient is large.
    let norm = |g: &[f64]| g.iter().map(|g| g * g).sum::<f64>().sqrt();
    let scale = 1.0 / norm(&search.gradient).max(1.0);
    search.scale = scale;
    let search = RefCell::new(search);
    loop {
        let (centre, before) = search.borrow().best.clone();
        let outcome = LBFGS::new(MoreThuenteLineSearch::new(), 8)
            .with_tolerance_grad(gradient_tolerance * scale)
            .and_then(|solver| solver.with_tolerance_cost(f64::EPSILON * scale))
            .and_then(|solver| {
                Executor::new(SearchProblem(&search), solver)
                    .configure(|state| state.param(centre))
                    .timer(false)
                    .run()
            });
        let ending = search.borrow().ending(&outcome);
        // A line search that fails may only need a fresh memory.
        if ending != SearchEnding::Stalled || search.borrow().best.1 >= before {
            return search.into_inner().end(ending);
        }
    }
}

/// The function with its budget and the best point so far.
struct BudgetedSearch<'a> {
    f: &'a mut dyn FnMut(&[f64], &mut [f64]) -> f64,
    evaluations: u64,
    limit: u64,
    /// Beyond the limit the simplex method, which unwraps errors, gets the best value so far: it levels out and ends.
    levels_out: bool,
    /// Whether an evaluation beyond the limit was asked for.
    refused: bool,
    /// Factor from the function to what `argmin` sees.
    scale: f64,
    best: (Vec<f64>, f64),
    /// Point of the latest evaluation: `argmin` asks for its value and gradient apart.
    latest: (Vec<f64>, f64),
    gradient: Vec<f64>,
}

impl<'a> BudgetedSearch<'a> {
    fn new(f: &'a mut dyn FnMut(&[f64], &mut [f64]) -> f64, start: &[f64], limit: u64) -> Self {
        Self {
            f,
            evaluations: 0,
            limit,
            levels_out: false,
            refused: false,
            scale: 1.0,
            best: (start.to_vec(), f64::INFINITY),
            latest: (Vec::new(), f64::INFINITY),
            gradient: vec![0.0; start.len()],
        }
    }

    /// Evaluates the start; the ending of a search that cannot go on from there.
    fn begin(&mut self) -> Option<SearchEnding> {
        let start = self.best.0.clone();
        match self.at(&start) {
            Ok(value) if value.is_finite() && !start.is_empty() => None,
            Ok(_) => Some(SearchEnding::NoStart),
            Err(_) => Some(SearchEnding::EvaluationLimit),
        }
    }

    fn end(self, ending: SearchEnding) -> MinimumPoint {
        let (x, value) = self.best;
        MinimumPoint {
            x,
            value,
            evaluations: self.evaluations,
            ending,
        }
    }

    fn ending<O, S, I: State>(
        &self,
        run: &Result<OptimizationResult<O, S, I>, Error>,
    ) -> SearchEnding {
        let done = TerminationStatus::Terminated(TerminationReason::SolverConverged);
        match run {
            _ if self.refused => SearchEnding::EvaluationLimit,
            Ok(run) if *run.state().get_termination_status() == done => SearchEnding::Converged,
            _ => SearchEnding::Stalled,
        }
    }

    fn at(&mut self, x: &[f64]) -> Result<f64, Error> {
        if self.latest.0 == x {
            return Ok(self.latest.1);
        }
        if self.evaluations >= self.limit {
            self.refused = true;
            return Err(Error::msg("evaluation limit"));
        }
        self.evaluations += 1;
        let value = (self.f)(x, &mut self.gradient);
        let value = if value.is_nan() { f64::INFINITY } else { value };
        if value < self.best.1 {
            self.best = (x.to_vec(), value);
        }
        self.latest.0.clear();
        self.latest.0.extend_from_slice(x);
        self.latest.1 = value;
        Ok(value)
    }
}

/// What `argmin` sees of a search.
struct SearchProblem<'s, 'f>(&'s RefCell<BudgetedSearch<'f>>);

impl CostFunction for SearchProblem<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        let mut search = self.0.borrow_mut();
        let value = match search.at(x) {
            Err(_) if search.levels_out => Ok(search.best.1),
            value => value,
        };
        Ok(value? * search.scale)
    }
}

impl Gradient for SearchProblem<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let mut search = self.0.borrow_mut();
        search.at(x)?;
        Ok(search.gradient.iter().map(|g| g * search.scale).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rosenbrock(x: &[f64]) -> f64 {
        (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2)
    }

    fn rosenbrock_with_gradient(x: &[f64], g: &mut [f64]) -> f64 {
        let bend = x[1] - x[0] * x[0];
        g[0] = -2.0 * (1.0 - x[0]) - 400.0 * x[0] * bend;
        g[1] = 200.0 * bend;
        rosenbrock(x)
    }

    #[test]
    fn both_methods_find_the_bottom_of_a_bent_valley() {
        let start = [-1.2, 1.0];
        let simplex = nelder_mead(&mut |x| rosenbrock(x), &start, &[0.5, 0.5], 1e-14, 2000);
        let newton = lbfgs(&mut rosenbrock_with_gradient, &start, 1e-8, 500);
        for (found, most) in [(simplex, 1000), (newton, 150)] {
            assert_eq!(found.ending, SearchEnding::Converged);
            for x in &found.x {
                assert!((x - 1.0).abs() < 1e-6, "{found:?}");
            }
            assert!(found.evaluations < most, "{}", found.evaluations);
            assert_eq!(found.value, rosenbrock(&found.x));
        }
    }

    #[test]
    fn any_budget_is_kept_even_where_it_ends_within_a_shrinking_step() {
        // rough: makes the simplex shrink, which takes several values at once
        let rough = |x: &[f64]| {
            rosenbrock(&x[..2]) + 30.0 * ((40.0 * x[2]).sin() + (50.0 * x[0]).cos()).abs()
        };
        for limit in 1..300 {
            let mut calls = 0;
            let mut counted = |x: &[f64]| {
                calls += 1;
                rough(x)
            };
            let start = [-1.2, 1.0, 0.3];
            let found = nelder_mead(&mut counted, &start, &[0.5; 3], 1e-14, limit);
            assert_eq!(found.evaluations, calls);
            assert!(calls <= limit, "{calls} of {limit}");
            assert!(found.value <= rough(&start));
        }
    }

    #[test]
    fn a_budget_ends_a_search_with_its_best_point() {
        let mut seen = Vec::new();
        let found = nelder_mead(
            &mut |x| {
                seen.push(rosenbrock(x));
                rosenbrock(x)
            },
            &[-1.2, 1.0],
            &[0.5, 0.5],
            1e-14,
            40,
        );
        assert_eq!(found.ending, SearchEnding::EvaluationLimit);
        assert_eq!((found.evaluations, seen.len()), (40, 40));
        assert_eq!(
            found.value,
            seen.iter().copied().fold(f64::INFINITY, f64::min)
        );
        let found = lbfgs(&mut rosenbrock_with_gradient, &[-1.2, 1.0], 1e-8, 7);
        assert_eq!(
            (found.ending, found.evaluations),
            (SearchEnding::EvaluationLimit, 7)
        );
    }

    #[test]
    fn points_without_a_value_are_avoided() {
        let mut f = |x: &[f64]| {
            if x[0] < 0.5 {
                f64::NAN
            } else {
                (x[0] - 0.6).powi(2) + x[1] * x[1]
            }
        };
        let found = nelder_mead(&mut f, &[3.0, 2.0], &[1.0, 1.0], 1e-16, 1000);
        assert_eq!(found.ending, SearchEnding::Converged);
        assert!((found.x[0] - 0.6).abs() < 1e-6 && found.x[1].abs() < 1e-6);
    }

    #[test]
    fn a_start_without_a_value_is_said() {
        let found = nelder_mead(&mut |_| f64::NAN, &[1.0], &[1.0], 1e-9, 100);
        assert_eq!(
            (found.ending, found.evaluations),
            (SearchEnding::NoStart, 1)
        );
        assert_eq!(found.x, [1.0]);
        assert_eq!(
            lbfgs(&mut |_, _| f64::NAN, &[1.0], 1e-9, 100).ending,
            SearchEnding::NoStart
        );
        let found = lbfgs(&mut |_, _| 1.0, &[1.0], 1e-9, 0);
        assert_eq!(found.ending, SearchEnding::EvaluationLimit);
    }

    #[test]
    fn a_start_at_the_minimum_stays_there() {
        let found = lbfgs(&mut rosenbrock_with_gradient, &[1.0, 1.0], 1e-8, 100);
        assert_eq!((found.ending, found.value), (SearchEnding::Converged, 0.0));
        let found = nelder_mead(
            &mut |x| rosenbrock(x),
            &[1.0, 1.0],
            &[0.1, 0.1],
            1e-14,
            1000,
        );
        assert_eq!((found.ending, found.value), (SearchEnding::Converged, 0.0));
    }

    #[test]
    fn many_variables_of_different_size_are_no_trouble_to_a_gradient() {
        let size = |i: usize| 10f64.powi(i as i32 % 4);
        let mut f = |x: &[f64], g: &mut [f64]| {
            let mut sum = 0.0;
            for (i, (x, g)) in x.iter().zip(g).enumerate() {
                let off = x - i as f64;
                *g = size(i) * off.sinh();
                sum += size(i) * 2.0 * (0.5 * off).sinh().powi(2);
            }
            sum
        };
        let found = lbfgs(&mut f, &[0.0; 12], 1e-6, 2000);
        assert_eq!(found.ending, SearchEnding::Converged);
        for (i, x) in found.x.iter().enumerate() {
            assert!((x - i as f64).abs() < 1e-5, "{i}: {x}");
        }
    }
}
