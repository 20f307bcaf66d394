//! What a candidate must pass to be added: all tests must agree.

use crate::diagnose::candidates::score::{Score, spread};
use crate::effect::Added;

/// Standard errors by which the error on the veto pieces may grow by chance.
const VETO_CHANCE: f64 = 1.0;

/// Limits that a candidate must keep. All tests must agree.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Chance of one false effect or more among all candidates of a round.
    pub false_alarm: f64,
    /// Least share of the effect's torque that nothing declared can stand in for.
    pub unique_share: f64,
    /// Least fraction of cross-validated squared error removed.
    pub cv_gain: f64,
    /// Least cross-validated gain in its own standard errors.
    pub cv_certainty: f64,
    /// Largest squared error on the veto pieces, over that without the effect; a standard error of their
    /// difference comes on top.
    pub veto_ratio: f64,
    /// Least part of the declared model's squared residual, on the joints concerned, that it
    /// removes: below it an effect may be there and does not matter.
    pub worth: f64,
    /// Least power that it removes, over that of the noise.
    pub over_noise: f64,
    /// Most effects that are added; with none the given model is fitted and nothing is looked for.
    pub steps: usize,
    /// Whether standard deviations are worked out, which takes several fits; without them they are not a number.
    pub deviations: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            false_alarm: 0.005,
            unique_share: 0.001,
            cv_gain: 0.003,
            cv_certainty: 1.0,
            veto_ratio: 1.002,
            worth: 0.01,
            over_noise: 0.1,
            steps: 8,
            deviations: true,
        }
    }
}

impl Limits {
    /// Whether the squared errors on the pieces that may veto grow by more than the limit, and by more than
    /// chance makes of them.
    pub fn vetoes(&self, before: &[f64], after: &[f64]) -> bool {
        let sum = |x: &[f64]| x.iter().sum::<f64>();
        let chance = match before.len() {
            0 | 1 => 0.0,
            _ => VETO_CHANCE * spread(before, after),
        };
        sum(after) > self.veto_ratio * sum(before) + chance
    }
}

/// One candidate with what became of it.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub effect: Added,
    /// None where the data lack what it needs, or where nothing of it is its own.
    pub score: Option<Score>,
    pub accepted: bool,
    /// Whether the data tell it from chance; it is accepted where it also matters.
    pub significant: bool,
    /// Why not; empty where accepted.
    pub reason: String,
}

/// How much a candidate removes, over what there is.
#[derive(Debug, Clone, Copy)]
pub struct Worth {
    pub of_declared: f64,
    pub of_noise: f64,
}

/// Puts a candidate to every test.
pub fn decide(
    candidate: &mut Candidate,
    tried: usize,
    limits: &Limits,
    worth: &dyn Fn(f64) -> Worth,
) {
    let Some(s) = &candidate.score else { return };
    let corrected = s.p_value * tried as f64;
    let refusal = if !s.beta.iter().all(|b| b.is_finite()) {
        Some("its coefficients are not finite".to_owned())
    } else if s.unique_share < limits.unique_share {
        Some(format!(
            "only {:.2} % of it is its own: what is declared stands in for the rest",
            100.0 * s.unique_share
        ))
    } else if !candidate.effect.is_possible() {
        Some("its coefficient has a sign that the effect cannot have".to_owned())
    } else if corrected > limits.false_alarm {
        Some(format!(
            "chance gives as much: p = {} among all candidates",
            match corrected {
                // by Bonferroni's bound, which may pass 1
                p if p >= 1.0 => "1".to_owned(),
                p => format!("{p:.2e}"),
            }
        ))
    } else {
        None
    };
    let small = (worth(s.gain).of_declared < limits.worth
        || worth(s.gain).of_noise < limits.over_noise)
        .then(|| {
            format!(
                "too small to matter: {:.2} % of the declared model's squared residual, {:.2} of \
                 the noise's power",
                100.0 * worth(s.gain).of_declared,
                worth(s.gain).of_noise
            )
        });
    let doubt = if s.delta_bic <= 0.0 {
        Some(format!(
            "not worth its parameters: BIC changes by {:.1} with {:.0} effective rows",
            s.delta_bic, s.effective_rows
        ))
    } else if s.cv_gain < limits.cv_gain {
        Some(format!(
            "cross-validation: {:+.2} % of the squared error",
            100.0 * s.cv_gain
        ))
    } else if s.cv_gain < limits.cv_certainty * s.cv_std {
        Some(format!(
            "cross-validation is not of one mind: {:+.2} +- {:.2} %",
            100.0 * s.cv_gain,
            100.0 * s.cv_std
        ))
    } else if limits.vetoes(&s.vetoes[0], &s.vetoes[1]) {
        Some(format!(
            "vetoed: it makes the squared error on data set aside {:.3} times as large",
            s.vetoes[1].iter().sum::<f64>() / s.vetoes[0].iter().sum::<f64>()
        ))
    } else {
        None
    };
    candidate.significant = refusal.is_none() && doubt.is_none();
    candidate.accepted = candidate.significant && small.is_none();
    candidate.reason = refusal.or(small).or(doubt).unwrap_or_default();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::Place;

    fn decided(change: impl Fn(&mut Score), worth: Worth) -> Candidate {
        let mut score = Score {
            beta: vec![1.0],
            gain: 0.2,
            unique_share: 0.5,
            p_value: 1e-9,
            delta_bic: 30.0,
            effective_rows: 500.0,
            cv_gain: 0.2,
            cv_std: 0.05,
            folds: vec![1.0; 10],
            vetoes: [vec![1.0; 10], vec![0.9; 10]],
        };
        change(&mut score);
        let laws = crate::effect::LAWS;
        let law = laws.iter().find(|l| l.entry.name == "torque-offset");
        let law = law.unwrap();
        let mut candidate = Candidate {
            effect: Added {
                law,
                place: Place::Joint(0),
                shape: Vec::new(),
                linear: vec![1.0],
            },
            score: Some(score),
            accepted: false,
            significant: false,
            reason: String::new(),
        };
        decide(&mut candidate, 100, &Limits::default(), &|_| worth);
        candidate
    }

    #[test]
    fn what_is_no_chance_and_too_small_is_significant_and_not_accepted() {
        let large = Worth {
            of_declared: 0.5,
            of_noise: 3.0,
        };
        let small = Worth {
            of_noise: 0.05,
            ..large
        };
        let found = decided(|_| {}, large);
        assert!(found.accepted && found.significant && found.reason.is_empty());
        let found = decided(|_| {}, small);
        assert!(!found.accepted && found.significant);
        assert!(found.reason.starts_with("too small"), "{}", found.reason);
        // what fails another test too is no remainder, whichever reason is told
        type Change = fn(&mut Score);
        let failures: [(Change, &str); 6] = [
            (|s| s.unique_share = 1e-4, "only 0.01 %"),
            (|s| s.p_value = 1e-3, "chance"),
            (|s| s.delta_bic = -1.0, "not worth"),
            (|s| s.cv_gain = 0.001, "cross-validation:"),
            (|s| s.cv_std = 0.3, "cross-validation is not"),
            (|s| s.vetoes[1] = vec![1.1; 10], "vetoed"),
        ];
        for (change, says) in failures {
            let found = decided(change, large);
            assert!(!found.accepted && !found.significant, "{says}");
            assert!(found.reason.starts_with(says), "{}", found.reason);
            assert!(!decided(change, small).significant, "{says}");
        }
    }
}
