//! What kind of physics a formula is, by its symmetries: these hold where no formula is unique.

use super::term::FormulaTerm;
use crate::diagnose::outcome::Symmetry;

impl Symmetry {
    pub fn of(terms: &[FormulaTerm], squares: &[f64], joint: usize) -> Self {
        let total: f64 = squares.iter().sum();
        let part = |of: &dyn Fn(&FormulaTerm) -> bool| {
            let own = terms.iter().zip(squares).filter(|(t, _)| of(t));
            own.map(|(_, square)| square).sum::<f64>() / total.max(f64::MIN_POSITIVE)
        };
        Symmetry {
            odd: part(&FormulaTerm::is_odd),
            periodic: part(&|t| t.wave.is_some()),
            coupled: part(&|t| t.joints().iter().any(|k| *k != joint)),
        }
    }

    /// In words: what most of it is.
    pub fn words(&self) -> String {
        let mut all = vec![match (self.odd > 0.5, self.periodic > 0.5) {
            (true, true) => "friction that goes round with a position: it flips with the direction",
            (true, false) => "friction: it flips with the direction",
            (false, true) => "a transmission: it goes round with a position, the same both ways",
            (false, false) => "a force or an error of gravity: it is the same both ways",
        }];
        if self.coupled > 0.5 {
            all.push("and a coupling: another joint sets it");
        }
        all.join(", ")
    }
}
