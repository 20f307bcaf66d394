//! A formula over its first signal, on data that nothing was fitted to.

use crate::diagnose::error::DiagnoseError;
use crate::diagnose::outcome::FormulaPicture;
use crate::diagnose::prepared::{PreparedCase, filtered};
use crate::diagnose::problem::data_split::LogRole;
use crate::diagnose::unexplained::signal::{Signal, values};
use crate::effect::{AugmentedModel, Torques};
use crate::robot::FormulaSignal;

/// Rows that are kept of it, about.
const MOST: usize = 700;

impl PreparedCase<'_> {
    /// The effect that stands at a place in a model, over a signal of joint `j`, on held-out rows.
    pub(super) fn picture(
        &self,
        (model, place): (&AugmentedModel, usize),
        j: usize,
        signals: &[(FormulaSignal, usize)],
    ) -> Result<Option<FormulaPicture>, DiagnoseError> {
        let Some(over) = signals.iter().map(shown).next() else {
            return Ok(None);
        };
        let mut without = model.clone();
        without.effects[place].linear.fill(0.0);
        let [with, without] = [
            filtered(model, &self.data)?,
            filtered(&without, &self.data)?,
        ];
        let held = self
            .split
            .pieces
            .iter()
            .filter(|p| p.role == LogRole::Holdout && !self.split.is_stationary(p.stretch, j));
        let of_piece = |p: &crate::diagnose::problem::data_split::Piece| {
            p.rows
                .clone()
                .map(|row| (p.stretch, row))
                .collect::<Vec<_>>()
        };
        let rows: Vec<(usize, usize)> = held.flat_map(of_piece).collect();
        let every = rows.len().div_ceil(MOST).max(1);
        let rows: Vec<(usize, usize)> = rows.into_iter().step_by(every).collect();
        let stretches = &self.case.stretches;
        let sample =
            |(s, row): &(usize, usize)| (*s, self.data.filters.of(&stretches[*s]).sample_of(*row));
        let samples: Vec<(usize, usize)> = rows.iter().map(sample).collect();
        let torques: Vec<Torques> = match over {
            Signal::Load => stretches.iter().map(|s| model.torques(s)).collect(),
            _ => stretches.iter().map(|_| Torques::default()).collect(),
        };
        let x = values(over, j, &samples, stretches, &torques);
        let of_row = |(x, (s, row)): (f64, (usize, usize))| {
            let (a, b) = (without[s][j][row], with[s][j][row]);
            [x, a, a - b]
        };
        let rows: Vec<[f64; 3]> = x.into_iter().zip(rows).map(of_row).collect();
        Ok((!rows.is_empty()).then_some(FormulaPicture { over, rows }))
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
