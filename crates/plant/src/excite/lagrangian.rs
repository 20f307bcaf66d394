//! The augmented Lagrangian around the minimiser: argmin has no constraints of its own.
//!
//! Rounds of unconstrained minimisation of f + sum (max(0, lambda + rho g)^2 - lambda^2) / (2 rho),
//! between which each multiplier moves to lambda + rho g (Nocedal and Wright 2006, section 17.3).
//! The criterion's kink is sharpened from round to round.

use cft_ident_core::math::minimise::lbfgs;

use super::objective::{LagrangeMultipliers, Objective, ObjectiveWorkspace};

/// One round: sharpness of the criterion, evaluations it may take.
pub(super) type LagrangianRound = (f64, u64);

/// A search that can be continued.
#[derive(Debug, Clone)]
pub(super) struct LagrangianSearch {
    pub z: Vec<f64>,
    multipliers: LagrangeMultipliers,
    pub evaluations: u64,
}

/// First weight of violations, its growth between rounds and its end.
const FIRST_WEIGHT: f64 = 2.0;
const GROWTH: f64 = 2.5;
const HEAVIEST: f64 = 2e3;
/// Derivative below which a round is done.
const FLAT: f64 = 1e-4;

impl LagrangianSearch {
    pub fn new(objective: &Objective, z: Vec<f64>) -> Self {
        Self {
            z,
            multipliers: LagrangeMultipliers::new(objective.constraints(), FIRST_WEIGHT),
            evaluations: 0,
        }
    }

    /// Runs the rounds, up to `most` evaluations since the search began; `stop` is looked at before each evaluation.
    pub fn run(
        &mut self,
        objective: &Objective,
        rounds: &[LagrangianRound],
        most: u64,
        work: &mut ObjectiveWorkspace,
        stop: &dyn Fn() -> bool,
    ) {
        for (sharpness, evaluations) in rounds {
            let left = most.saturating_sub(self.evaluations);
            if stop() || left == 0 {
                return;
            }
            let multipliers = &self.multipliers;
            let mut f = |z: &[f64], gradient: &mut [f64]| {
                if stop() {
                    return f64::INFINITY;
                }
                let value = objective.evaluate(z, *sharpness, multipliers, work, gradient);
                value.unwrap_or(f64::INFINITY)
            };
            let found = lbfgs(&mut f, &self.z, FLAT, left.min(*evaluations));
            self.evaluations += found.evaluations;
            if found.value.is_finite() {
                self.z = found.x;
            }
            let growth = match self.multipliers.weight < HEAVIEST {
                true => GROWTH,
                false => 1.0,
            };
            let updated = objective.update(&self.z, &mut self.multipliers, growth, work);
            if updated.is_err() {
                return;
            }
        }
    }
}
