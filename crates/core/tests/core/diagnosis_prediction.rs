//! What is written for prediction alone: it makes torques of other motions better, it is no name, and it harms nothing.

use cft_ident_core::diagnose::{Diagnosis, DiagnosisCase, LogRole, UseErrors};
use cft_ident_core::motion::Stretch;

use crate::diagnosis_bench::{Waves, case, diagnosed, log, one_joint, written};

const NOISE: f64 = 0.6;

/// A motion that does not repeat within minutes; each number another one.
fn waves(of: usize) -> Waves {
    let by = 1.0 + 0.07 * of as f64;
    vec![
        [0.7, 1.3 * by, 0.4],
        [0.3, 2.917 * by, 1.9],
        [0.1, 7.123 * by, 0.7],
    ]
}

/// Ripples of three orders, none of them large.
fn ripples(q: f64) -> f64 {
    let waves = [(9.0, 0.8), (14.0, 2.1), (23.0, 0.2)];
    waves
        .iter()
        .map(|(n, phase)| 0.045 * (n * q + phase).sin())
        .sum()
}

fn one(of: usize, seconds: f64, more: &dyn Fn(f64, f64) -> f64) -> Stretch {
    let how = (seconds, NOISE, 11 + of as u32);
    log(&one_joint(1.0), &[waves(of)], how, &|_, t, s| {
        more(t, s[0][0])
    })
}

/// Two logs that are fitted and a third that only tells.
fn weak() -> DiagnosisCase {
    let logs = (0..3).map(|of| one(of, 15.0, &|_, q| ripples(q)));
    let mut case = case(&one_joint(1.0), logs.collect(), 0.02);
    case.roles = vec![LogRole::Train, LogRole::Train, LogRole::Holdout];
    case
}

fn unseen(errors: &cft_ident_core::diagnose::SplitErrors) -> f64 {
    let errors: &UseErrors = errors.holdout.as_ref().expect("a log that is held out");
    errors.joints[0].headline()
}

#[test]
fn weak_terms_are_written_in_part_help_unseen_data_and_are_no_names() {
    let found = diagnosed(&weak());
    assert!(!found.predicting.is_empty() && found.changes_model());
    let named = written(&found);
    for term in &found.predicting {
        assert!(term.shrinkage > 0.0 && term.shrinkage < 1.0);
        let there = &found.model.effects[term.written];
        assert_eq!(there.name(), term.estimate.name());
        for (there, whole) in there.linear.iter().zip(&term.estimate.linear) {
            assert!((there - term.shrinkage * whole).abs() <= 1e-9 * whole.abs());
        }
    }
    assert_eq!(
        found.model.effects.len(),
        named.len() + found.predicting.len()
    );
    assert!(
        unseen(&found.after) < unseen(&found.named),
        "{} {}",
        unseen(&found.after),
        unseen(&found.named)
    );
}

#[test]
fn named_only_writes_what_is_named_as_it_is_beside_what_predicts() {
    let mut case = weak();
    let both = diagnosed(&case);
    case.wishes.named_only = true;
    let alone = diagnosed(&case);
    assert!(alone.predicting.is_empty());
    let sizes = |found: &Diagnosis| -> Vec<(&'static str, Vec<f64>)> {
        let own = found
            .written()
            .filter_map(|s| found.model.effects.get(s.written?));
        own.map(|e| (e.name(), e.linear.clone())).collect()
    };
    assert_eq!(sizes(&both), sizes(&alone));
    assert_eq!(unseen(&both.named), unseen(&alone.after));
}

#[test]
fn one_motion_of_few_independent_stretches_writes_nothing_for_prediction() {
    // four parts as long as a block is at least, over and over
    let period_s = 4.5 * diagnosed(&weak()).block_s;
    let turn = std::f64::consts::TAU / period_s;
    let waves = vec![[0.7, turn, 0.4], [0.3, 2.0 * turn, 1.9]];
    let how = (30.0, NOISE, 5);
    let repeated = log(&one_joint(1.0), &[waves], how, &|_, _, s| ripples(s[0][0]));
    let found = diagnosed(&case(&one_joint(1.0), vec![repeated], 0.02));
    assert!(found.predicting.is_empty());
    assert!(
        found.too_few_stretches.is_some_and(|n| n < 6),
        "{:?}",
        found.too_few_stretches
    );
}
