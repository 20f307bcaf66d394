//! Formulas of what is left: a torque that no effect of the catalogue has is found as the function that it is, and
//! noise is none.

use cft_ident_core::diagnose::{AcceptedEffect, Diagnosis, FormulaEnd, FoundFormula};
use cft_ident_core::effect::{AugmentedModel, own};
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::FormulaSignal;

use crate::diagnosis_bench::{Waves, case, diagnosed, log, one_joint, written};

const SECONDS: f64 = 40.0;

type More = dyn Fn([f64; 3]) -> f64;

fn logs(more: &More, noise: f64) -> Vec<Stretch> {
    let one = |of: usize| {
        let by = 1.0 + 0.07 * of as f64;
        let waves: Waves = vec![
            [0.7, 1.3 * by, 0.4],
            [0.3, 2.9 * by, 1.9],
            [0.1, 7.1 * by, 0.7],
        ];
        let how = (SECONDS, noise, 31 + of as u32);
        log(&one_joint(1.0), &[waves], how, &|_, _, s| more(s[0]))
    };
    (0..2).map(one).collect()
}

/// A search for formulas, of which that of the joint is written where it is `wanted`.
fn searched(more: &More, wanted: bool) -> Diagnosis {
    let mut case = case(&one_joint(1.0), logs(more, 0.2), 0.02);
    case.wishes.search = true;
    if wanted {
        case.wishes.accepted = vec![AcceptedEffect::named("formula:q1")];
    }
    diagnosed(&case)
}

fn formula(found: &Diagnosis) -> &FoundFormula {
    assert_eq!(found.formulas.len(), 1);
    let own = &found.formulas[0];
    assert_eq!((own.joint, own.end), (0, FormulaEnd::Found));
    // none of 99 searches with other signs found as much
    assert!((own.p_value - 0.01).abs() < 1e-12);
    assert!(own.share > 0.95 && own.share < 1.0);
    own
}

/// Signals of one joint, in the order of their names.
fn signals(own: &FoundFormula) -> Vec<FormulaSignal> {
    assert!(own.signals.iter().all(|(_, joint)| *joint == 0));
    own.signals.iter().map(|(signal, _)| *signal).collect()
}

#[test]
fn an_inertia_that_hangs_on_the_position_is_found_as_a_formula_and_written_where_it_is_wanted() {
    let planted = |[q, _, a]: [f64; 3]| 0.15 * q * a;
    let found = searched(&planted, true);
    let own = formula(&found);
    assert_eq!(
        signals(own),
        [FormulaSignal::Position, FormulaSignal::Acceleration]
    );
    let parts = [
        own.symmetry.odd,
        own.symmetry.periodic,
        own.symmetry.coupled,
    ];
    assert!((own.symmetry.inertial - 1.0).abs() < 1e-9 && parts.iter().all(|x| x.abs() < 1e-9));
    assert!(!own.definition.friction);
    assert_eq!(written(&found), ["formula-q1"]);
    let step = found.written().next().expect("it is wanted");
    assert!(step.accepted_by_user);
    assert!((step.estimate.linear[0] / 0.15 - 1.0).abs() < 0.02);
    // on other rows the model with it makes the torques that there are
    let along = &logs(&planted, 0.0)[1];
    let (hat, plain) = (
        found.in_use.torques(along).hat,
        AugmentedModel::plain(one_joint(1.0)).torques(along).hat,
    );
    let rms = |x: &[f64]| {
        let pairs = x.iter().zip(&along.tau[0]);
        pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    assert!(rms(&hat[0]) < 0.05 * rms(&plain[0]));
    // drawn as the residual with and without it
    let picture = own.picture.as_ref().expect("rows were set aside");
    assert!(picture.rows.len() > 100);
    let square = |of: fn(&[f64; 3]) -> f64| picture.rows.iter().map(|r| of(r).powi(2)).sum::<f64>();
    let (left, whole) = (square(|[_, e, f]| e - f), square(|[_, e, _]| *e));
    assert!(left < 0.02 * whole, "{left} {whole}");
}

#[test]
fn a_damping_that_hangs_on_the_position_is_found_as_friction() {
    let planted = |[q, v, _]: [f64; 3]| 0.5 * q * q * v;
    let found = searched(&planted, false);
    let own = formula(&found);
    assert_eq!(
        signals(own),
        [FormulaSignal::Position, FormulaSignal::Speed]
    );
    let parts = [
        own.symmetry.inertial,
        own.symmetry.periodic,
        own.symmetry.coupled,
    ];
    assert!((own.symmetry.odd - 1.0).abs() < 1e-9 && parts.iter().all(|x| x.abs() < 1e-9));
    assert!(own.definition.friction);
    assert!((own.step.estimate.linear[0] / 0.5 - 1.0).abs() < 0.05);
    // the law of a definition is that of the formula along any motion
    let robot = one_joint(1.0).robot;
    let law = own::law(&own.definition, &robot).expect("it was found");
    assert!(std::ptr::eq(law, own.step.estimate.law));
    let [without, with] = own.at_reversals.expect("the joint reverses");
    assert!(with < 0.5 * without, "{without} {with}");
}

#[test]
fn of_noise_no_formula_is_made() {
    let found = searched(&|_| 0.0, false);
    assert!(found.formulas.is_empty() && written(&found).is_empty());
}
