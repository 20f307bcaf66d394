//! What kind of physics a formula is, by its symmetries: these hold where no formula is unique.

use super::term::{FormulaTerm, Source};
use crate::diagnose::outcome::FormulaSymmetry;
use crate::robot::FormulaSignal;

impl FormulaSymmetry {
    pub fn of(terms: &[FormulaTerm], squares: &[f64], joint: usize) -> Self {
        let own = Source::Signal(FormulaSignal::Position, joint);
        let total: f64 = squares.iter().sum();
        let part = |of: &dyn Fn(&FormulaTerm) -> bool| {
            let own = terms.iter().zip(squares).filter(|(t, _)| of(t));
            own.map(|(_, square)| square).sum::<f64>() / total.max(f64::MIN_POSITIVE)
        };
        FormulaSymmetry {
            odd: part(&FormulaTerm::is_odd),
            periodic: part(&|t| t.wave.is_some_and(|(source, _)| source == own)),
            inertial: part(&|t| {
                t.sources()
                    .any(|s| matches!(s, Source::Signal(FormulaSignal::Acceleration, _)))
            }),
            coupled: part(&|t| t.sources().flat_map(Source::joints).any(|k| k != joint)),
        }
    }

    /// In words: what most of it is.
    pub fn words(&self) -> String {
        let mut all = vec![
            match [self.odd, self.periodic, self.inertial].map(|part| part > 0.5) {
                [true, true, _] => {
                    "friction that goes round with the position: it flips with the direction"
                }
                [true, false, _] => "friction: it flips with the direction",
                [false, true, _] => {
                    "a transmission: it goes round with the position, the same both ways"
                }
                [false, false, true] => "an inertia: it goes by the acceleration",
                [false, false, false] => "a force or an error of gravity: it is the same both ways",
            },
        ];
        if self.coupled > 0.5 {
            all.push("and a coupling: another joint sets it");
        }
        all.join(", ")
    }
}
