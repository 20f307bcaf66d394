//! A formula on data that nothing was fitted to: over its first signal, and next to reversals.

use crate::diagnose::error::DiagnoseError;
use crate::diagnose::outcome::FormulaPicture;
use crate::diagnose::prepared::{PreparedCase, filtered};
use crate::diagnose::problem::data_split::LogRole;
use crate::diagnose::unexplained::signal::{Signal, values};
use crate::effect::cover::{TURN, reversals};
use crate::effect::{AugmentedModel, StretchTorques};
use crate::robot::FormulaSignal;

const MOST: usize = 700;

/// Time about a reversal [s] within which hysteresis is judged by itself.
const ABOUT_REVERSAL: f64 = 0.1;

/// A joint on held-out rows.
pub(super) struct OnHeldOut<'a> {
    prepared: &'a PreparedCase<'a>,
    model: &'a AugmentedModel,
    joint: usize,
    /// Stretch and sample of each row, the residual without the formula, and with it.
    rows: Vec<([usize; 2], [f64; 2])>,
}

impl<'a> OnHeldOut<'a> {
    /// The effect that stands at a place in a model, at a joint.
    pub fn of(
        prepared: &'a PreparedCase<'a>,
        (model, place): (&'a AugmentedModel, usize),
        joint: usize,
    ) -> Result<Self, DiagnoseError> {
        let (split, data) = (prepared.data.split, &prepared.data);
        let mut without = model.clone();
        without.effects[place].linear.fill(0.0);
        let [without, with] = [filtered(&without, data)?, filtered(model, data)?];
        let held = split.pieces.iter().filter(|p| p.role == LogRole::Holdout);
        let held = held.filter(|p| !split.is_stationary(p.stretch, joint));
        let rows = held.flat_map(|p| p.rows.clone().map(|row| (p.stretch, row)));
        let of_row = |(s, row): (usize, usize)| {
            let sample = data.filters.of(&prepared.case.stretches[s]).sample_of(row);
            let left = [&without, &with].map(|left| left[s][joint][row]);
            ([s, sample], left)
        };
        let rows = rows.map(of_row).collect();
        Ok(Self {
            prepared,
            model,
            joint,
            rows,
        })
    }

    /// Its torque over the first of these signals.
    pub fn picture(&self, signals: &[(FormulaSignal, usize)]) -> Option<FormulaPicture> {
        let over = shown(signals.first()?);
        let stretches = &self.prepared.case.stretches;
        let every = self.rows.len().div_ceil(MOST).max(1);
        let rows: Vec<_> = self.rows.iter().step_by(every).collect();
        let samples: Vec<(usize, usize)> = rows.iter().map(|([s, k], _)| (*s, *k)).collect();
        let torques: Vec<StretchTorques> = match over {
            Signal::Load => stretches.iter().map(|s| self.model.torques(s)).collect(),
            _ => stretches
                .iter()
                .map(|_| StretchTorques::default())
                .collect(),
        };
        let x = values(over, self.joint, &samples, stretches, &torques);
        let of_row = |(x, (_, [a, b])): (f64, &([usize; 2], [f64; 2]))| [x, *a, a - b];
        let rows: Vec<[f64; 3]> = x.into_iter().zip(rows).map(of_row).collect();
        (!rows.is_empty()).then_some(FormulaPicture { over, rows })
    }

    /// Root mean square of the residual without and with it next to reversals.
    pub fn at_reversals(&self) -> Option<[f64; 2]> {
        let least = TURN * self.prepared.cover.joints[self.joint].range();
        let stretches = self.prepared.case.stretches.iter();
        let turns: Vec<Vec<usize>> = stretches
            .map(|s| reversals(&s.q[self.joint], least))
            .collect();
        let near = |s: usize, k: usize| {
            let most = ABOUT_REVERSAL / self.prepared.case.stretches[s].dt;
            let after = turns[s].partition_point(|turn| *turn < k);
            let both = [after.checked_sub(1), Some(after)].into_iter().flatten();
            both.filter_map(|i| turns[s].get(i))
                .any(|turn| turn.abs_diff(k) as f64 <= most)
        };
        let own = self.rows.iter().filter(|([s, k], _)| near(*s, *k));
        let own: Vec<[f64; 2]> = own.map(|(_, left)| *left).collect();
        let rms = |i: usize| {
            let square: f64 = own.iter().map(|left| left[i] * left[i]).sum();
            (square / own.len() as f64).sqrt()
        };
        (!own.is_empty()).then(|| [0, 1].map(rms))
    }
}

/// The signal that a formula's is drawn over.
fn shown((signal, j): &(FormulaSignal, usize)) -> Signal {
    match signal {
        FormulaSignal::Position => Signal::Position(*j),
        FormulaSignal::Speed | FormulaSignal::Direction => Signal::Speed(*j),
        FormulaSignal::Acceleration => Signal::Acceleration,
        FormulaSignal::Load => Signal::Load,
        FormulaSignal::Temperature => Signal::Temperature(*j),
        FormulaSignal::Time => Signal::Time,
        FormulaSignal::SinceReversal | FormulaSignal::Play | FormulaSignal::Dahl => {
            Signal::SinceReversal
        }
    }
}
