//! One candidate effect with what became of it.

use super::score::CandidateScore;
use crate::effect::{Added, Law, Place};

/// An effect at a place.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub effect: Added,
    /// None where the data lack what it needs, or where nothing of it is its own.
    pub score: Option<CandidateScore>,
    pub accepted: bool,
    /// Whether the data tell it from chance; it is accepted where it also matters.
    pub significant: bool,
    /// Chance of one as good among all candidates where nothing is missing, by placebos; none where other tests
    /// had refused it.
    pub placebo_p_value: Option<f64>,
    /// It passes every test, with numbers that no machine has: a curve may take its place.
    pub impossible: bool,
    /// Why not; empty where accepted.
    pub reason: String,
}

impl Candidate {
    /// One that is not decided on.
    pub fn open(effect: Added, score: Option<CandidateScore>, reason: &str) -> Self {
        Candidate {
            effect,
            score,
            accepted: false,
            significant: false,
            placebo_p_value: None,
            impossible: false,
            reason: reason.to_owned(),
        }
    }

    /// One that was not tried.
    pub fn refused(law: &'static Law, place: Place, reason: &str) -> Self {
        let open = vec![f64::NAN; law.shape.len()];
        let effect = Added::new(law, place, open, vec![0.0; law.linear.len()]);
        Candidate::open(effect, None, reason)
    }

    /// Takes back what it was accepted for.
    pub fn reject(&mut self, reason: &str) {
        self.accepted = false;
        self.significant = false;
        self.impossible = false;
        reason.clone_into(&mut self.reason);
    }
}
