//! What a diagnosis must satisfy whatever the machine is: what is put in is found with its size, what is not is not, and
//! units, directions and clocks change nothing.

use cft_ident_core::diagnose::{
    AcceptedEffect, DiagnoseError, Diagnosis, DiagnosisCase, DiagnosisProgress, DiagnosisWatch,
    LogRole, ModelProposal, StepStatus, diagnose, value_of,
};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::model::Model;
use cft_ident_core::robot::{JointKind, Robot};
use std::sync::Mutex;

use crate::diagnosis_bench::{
    Waves, case, diagnosed, effect, log, number, one_joint, try_diagnosed, written,
};

const SECONDS: f64 = 40.0;
const NOISE: f64 = 0.2;

fn waves(of: usize) -> Waves {
    let by = 1.0 + 0.07 * of as f64;
    vec![
        [0.7, 1.3 * by, 0.4],
        [0.3, 2.9 * by, 1.9],
        [0.1, 7.1 * by, 0.7],
    ]
}

type More = dyn Fn(f64, [f64; 3]) -> f64;

fn logs(more: &More) -> Vec<Stretch> {
    let one = |of: usize| {
        let how = (SECONDS, NOISE, 11 + of as u32);
        log(&one_joint(1.0), &[waves(of)], how, &|_, t, s| more(t, s[0]))
    };
    (0..2).map(one).collect()
}

fn of(more: &More) -> (DiagnosisCase, Diagnosis) {
    let case = case(&one_joint(1.0), logs(more), 0.02);
    let found = diagnosed(&case);
    (case, found)
}

fn ripple(_: f64, [q, ..]: [f64; 3]) -> f64 {
    0.6 * (9.0 * q + 0.8).sin()
}

/// An effect's coefficients by name.
fn value(found: &Diagnosis, name: &str, key: &str) -> f64 {
    number(effect(found, name), &found.model.model.robot, key)
}

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    let off = (found - expected).abs();
    assert!(off <= relative * expected.abs(), "{found} {expected}");
}

#[test]
fn nothing_is_added_where_nothing_is_missing_and_the_numbers_are_the_machines() {
    let (case, found) = of(&|_, _| 0.0);
    assert!(written(&found).is_empty() && found.changes.is_empty());
    assert_eq!(found.model, case.given);
    assert_eq!(found.in_use, case.in_use);
    assert_eq!(found.unknowns.len(), 4);
    for (i, unknown) in found.unknowns.iter().enumerate() {
        let off = value_of(&found.estimates, *unknown) - value_of(&case.given, *unknown);
        let std = found.covariance[(i, i)].sqrt();
        assert!(off.abs() < 4.0 * std, "{unknown:?}: {off} {std}");
        assert!(std < 0.02, "{unknown:?}: {std}");
    }
    assert!(found.determined && found.long_enough() && !found.incomplete());
    assert_eq!(found.structured_joints().count(), 0);
    // of noise alone, filtered to a fifth of the band, a fit takes next to nothing
    let noise = NOISE / 12.0_f64.sqrt() * 0.2_f64.sqrt();
    near(found.residual_std[0], noise, 0.1);
    let [before, after] = [&found.before, &found.after].map(|e| e.train.joints[0].clone());
    assert_eq!(before.rmse, after.rmse);
    let refitted = &found.refitted.train.joints[0];
    assert!(refitted.rmse <= before.rmse * 1.001);
    near(before.rmse, noise, 0.1);
    // three parts of the rows, a fifth of them, were set aside
    assert_eq!(found.set_aside.len(), 4);
    let aside: f64 = found.set_aside.iter().map(|s| s.to_s - s.from_s).sum();
    near(aside, 0.2 * 2.0 * SECONDS, 0.1);
    let held = found.before.holdout.expect("rows that were set aside");
    near(held.joints[0].rmse, noise, 0.15);
    let [low, high] = held.joints[0].interval_95;
    assert!(low < held.joints[0].relative_error && held.joints[0].relative_error < high);
}

#[test]
fn an_effect_is_found_with_its_size_and_takes_the_error_down_to_the_noise() {
    let (case, found) = of(&ripple);
    assert_eq!(written(&found), ["ripple"]);
    near(value(&found, "ripple", "order"), 9.0, 0.01);
    near(value(&found, "ripple", "sin"), 0.6 * 0.8_f64.cos(), 0.05);
    near(value(&found, "ripple", "cos"), 0.6 * 0.8_f64.sin(), 0.05);
    let step = &found.steps[0];
    assert_eq!((step.status, step.left), (StepStatus::Confirmed, None));
    assert_eq!(step.written, Some(0));
    // rms of a wave
    near(step.torque[0], 0.6 / 2.0_f64.sqrt(), 0.1);
    assert!(step.torque[1] < 0.1 * step.torque[0]);
    assert!(step.shrinkage > 0.95 && step.shrinkage <= 1.0);
    assert!(step.share > 0.9 && step.share < 1.0);
    let [without, with] = step.holdout.expect("rows that were set aside");
    assert!(with < 0.2 * without);
    let rmse = |errors: &cft_ident_core::diagnose::UseErrors| errors.joints[0].rmse;
    assert!(rmse(&found.after.train) < 0.15 * rmse(&found.refitted.train));
    assert!(rmse(&found.refitted.train) <= rmse(&found.before.train));
    // what it takes off is what the model without it leaves
    let alone = step.without.as_ref().expect("it is written");
    assert!(alone.effects.is_empty());
    for unknown in &found.unknowns {
        near(
            value_of(&found.model, *unknown),
            value_of(&case.given, *unknown),
            0.05,
        );
    }
    // over all blocks its own amplitude
    let sin: f64 = step.parts.iter().map(|p| p[0]).sum::<f64>() / step.parts.len() as f64;
    near(sin, 0.6 * 0.8_f64.cos(), 0.1);
    let structure = |left: &cft_ident_core::diagnose::UnexplainedResidual| left.is_structure();
    assert!(!found.left.unexplained.iter().any(structure));
    let alone = found.left_alone.as_ref().expect("something was added");
    assert!(alone.unexplained.iter().all(structure));
    let on: Vec<_> = alone.dependence.iter().map(|d| d.joint).collect();
    assert!(!on.is_empty() && on.iter().all(|j| *j == 0));
}

#[test]
fn a_spring_on_a_slide_without_an_offset_holds_the_constant_force_too() {
    let slide = Model {
        robot: Robot::single_joint("q1", JointKind::Prismatic),
        offset: vec![0.0],
        ..one_joint(1.0)
    };
    for (k, rest) in [(0.9, 0.2), (0.9, -0.35), (0.6, 0.52)] {
        let one = |of: usize| {
            let how = (SECONDS, NOISE, 11 + of as u32);
            log(&slide, &[waves(of)], how, &|_, _, s| k * (s[0][0] - rest))
        };
        let mut case = case(&slide, (0..2).map(one).collect(), 0.02);
        case.open.offset = vec![false];
        let found = diagnosed(&case);
        assert_eq!(written(&found), ["spring"]);
        near(value(&found, "spring", "k"), k, 0.03);
        assert!((value(&found, "spring", "q0") - rest).abs() < 0.02);
        // what the data do not show of it is not in it
        assert_eq!(value(&found, "spring", "k3"), 0.0);
    }
}

#[test]
fn effects_of_every_kind_are_named_and_measured() {
    let stribeck = |_: f64, [_, v, _]: [f64; 3]| 0.8 * v.signum() * (-(v / 0.12).powi(2)).exp();
    let (_, found) = of(&stribeck);
    assert_eq!(written(&found), ["stribeck"]);
    near(value(&found, "stribeck", "c"), 0.8, 0.15);
    near(value(&found, "stribeck", "vs"), 0.12, 0.15);

    let along = |_: f64, [q, v, _]: [f64; 3]| 0.5 * v.signum() * (7.0 * q).sin();
    let (_, found) = of(&along);
    assert_eq!(written(&found), ["position-friction"]);
    near(value(&found, "position-friction", "sin"), 0.5, 0.1);

    // where a straight spring is at rest is the torque offset, which is open here; how stiff it is shows
    let spring = |_: f64, [q, ..]: [f64; 3]| 0.9 * (q - 0.2);
    let (_, found) = of(&spring);
    assert_eq!(written(&found), ["spring"]);
    near(value(&found, "spring", "k"), 0.9, 0.02);

    // a spring that bends is no constant torque wherever it is at rest
    let spring = |_: f64, [q, ..]: [f64; 3]| 0.9 * (q - 0.2) + 1.5 * (q - 0.2).powi(3);
    let (_, found) = of(&spring);
    assert_eq!(written(&found), ["spring"]);
    near(value(&found, "spring", "k"), 0.9, 0.05);
    near(value(&found, "spring", "k3"), 1.5, 0.05);
    near(value(&found, "spring", "q0"), 0.2, 0.05);

    let warm = |t: f64, [_, v, _]: [f64; 3]| {
        let friction = 0.8 * v + 1.5 * v.signum();
        -0.4 * friction * (1.0 - (-t / 12.0_f64).exp())
    };
    let (_, found) = of(&warm);
    assert_eq!(written(&found), ["warm-up"]);
    near(value(&found, "warm-up", "k"), -0.4, 0.15);
    near(value(&found, "warm-up", "T"), 12.0, 0.3);
}

#[test]
fn torques_in_another_unit_give_the_same_effects_of_another_size() {
    let (_, plain) = of(&ripple);
    let by = 1024.0;
    let mut logs = logs(&ripple);
    let torques = logs.iter_mut().flat_map(|s| s.tau.iter_mut().flatten());
    torques.for_each(|tau| *tau *= by);
    let found = diagnosed(&case(&one_joint(by), logs, 0.02));
    assert_eq!(written(&found), written(&plain));
    let [a, b] = [&plain, &found].map(|f| &f.steps[0]);
    near(b.estimate.shape[0], a.estimate.shape[0], 1e-6);
    for (a, b) in a.estimate.linear.iter().zip(&b.estimate.linear) {
        near(*b, by * a, 1e-5);
    }
    near(b.torque[0], by * a.torque[0], 1e-5);
    near(b.torque[1], by * a.torque[1], 1e-4);
    near(b.share, a.share, 1e-5);
    near(b.shrinkage, a.shrinkage, 1e-5);
    near(b.gain.value / b.gain.se, a.gain.value / a.gain.se, 1e-4);
    near(found.residual_std[0], by * plain.residual_std[0], 1e-5);
    let relative = |f: &Diagnosis| f.after.train.joints[0].relative_error;
    near(relative(&found), relative(&plain), 1e-5);
    for i in 0..found.unknowns.len() {
        let std = |f: &Diagnosis| f.covariance[(i, i)].sqrt();
        near(std(&found), by * std(&plain), 1e-4);
    }
    assert_eq!(found.candidates.len(), plain.candidates.len());
    assert_eq!((found.blocks, found.block_s), (plain.blocks, plain.block_s));
}

#[test]
fn a_joint_that_is_counted_the_other_way_round_has_the_mirrored_effects() {
    let (_, plain) = of(&ripple);
    let mut logs = logs(&ripple);
    for s in &mut logs {
        for x in [&mut s.q, &mut s.v, &mut s.a, &mut s.tau] {
            x.iter_mut().flatten().for_each(|x| *x = -*x);
        }
    }
    let mut given = one_joint(1.0);
    given.offset[0] *= -1.0;
    let found = diagnosed(&case(&given, logs, 0.02));
    assert_eq!(written(&found), ["ripple"]);
    near(
        value(&found, "ripple", "order"),
        value(&plain, "ripple", "order"),
        1e-5,
    );
    near(
        value(&found, "ripple", "sin"),
        value(&plain, "ripple", "sin"),
        1e-4,
    );
    near(
        value(&found, "ripple", "cos"),
        -value(&plain, "ripple", "cos"),
        1e-4,
    );
    near(found.steps[0].share, plain.steps[0].share, 1e-4);
    near(found.model.model.theta[0], plain.model.model.theta[0], 1e-5);
    near(
        found.model.model.offset[0],
        -plain.model.model.offset[0],
        1e-3,
    );
}

#[test]
fn the_clock_of_a_log_changes_the_times_that_are_reported_alone() {
    let (_, plain) = of(&ripple);
    let mut logs = logs(&ripple);
    logs.iter_mut().for_each(|s| s.zero = 5000.0);
    let found = diagnosed(&case(&one_joint(1.0), logs, 0.02));
    for (a, b) in plain.set_aside.iter().zip(&found.set_aside) {
        assert_eq!(a.log, b.log);
        assert!((b.from_s - a.from_s - 5000.0).abs() < 1e-9);
        assert!((b.to_s - a.to_s - 5000.0).abs() < 1e-9);
    }
    assert_eq!(found.model, plain.model);
    assert_eq!(found.covariance, plain.covariance);
}

#[test]
fn friction_that_changes_from_a_time_on_is_reported_with_its_time_and_size() {
    let change = |t: f64, v: f64| if t < 50.0 { 0.0 } else { 0.7 * v.signum() };
    let how = (2.0 * SECONDS, NOISE, 5);
    let one = log(&one_joint(1.0), &[waves(0)], how, &|_, t, s| {
        change(t, s[0][1])
    });
    let found = diagnosed(&case(&one_joint(1.0), vec![one], 0.02));
    assert_eq!(found.changes.len(), 1);
    let own = &found.changes[0];
    assert_eq!((own.joint, own.log), (0, 0));
    assert!((own.at_s - 50.0).abs() < 4.0, "{own:?}");
    near(own.by, 0.7, 0.3);
    assert!(own.certainty > 3.0);
    assert!(found.incomplete());
}

#[test]
fn what_the_user_wants_is_written_and_is_nothing_where_nothing_is() {
    let mut case = case(&one_joint(1.0), logs(&|_, _| 0.0), 0.02);
    let name = |name: &str, joint: &str| AcceptedEffect::named(&format!("{name}:{joint}"));
    case.wishes.accepted = vec![name("asymmetric-friction", "q1")];
    // another Coulomb friction forward is an offset and another in both directions
    assert!(matches!(
        try_diagnosed(&case),
        Err(DiagnoseError::Accept { .. })
    ));
    case.open.offset = vec![false];
    let found = diagnosed(&case);
    assert_eq!(written(&found), ["asymmetric-friction"]);
    let step = found.written().next().expect("it is wanted");
    assert!(step.accepted_by_user);
    let [torque, std] = step.torque;
    assert!(torque < 4.0 * std && std < 0.02, "{torque} {std}");
    case.wishes.accepted = vec![name("coupling", "q1")];
    assert!(matches!(
        try_diagnosed(&case),
        Err(DiagnoseError::Accept { .. })
    ));
    case.wishes.accepted = vec![name("stribeck", "q2")];
    assert!(matches!(
        try_diagnosed(&case),
        Err(DiagnoseError::Accept { .. })
    ));
}

#[test]
fn logs_that_determine_nothing_are_refused_with_why() {
    let short: Vec<Stretch> = logs(&|_, _| 0.0).iter().map(|s| s.part(0, 100)).collect();
    let refused = try_diagnosed(&case(&one_joint(1.0), short, 0.02));
    assert!(matches!(
        refused,
        Err(DiagnoseError::TooFewRows { unknowns: 4, .. })
    ));
    let mut silent = logs(&|_, _| 0.0);
    silent.iter_mut().for_each(|s| s.tau[0].fill(0.0));
    let refused = try_diagnosed(&case(&one_joint(1.0), silent, 0.02));
    assert!(matches!(refused, Err(DiagnoseError::NoTorque { joint }) if joint == "q1"));
}

#[test]
fn whoever_listens_hears_parts_that_begin_and_end_and_may_stop_them() {
    let case = case(&one_joint(1.0), logs(&ripple), 0.02);
    let refit = |proposal: &ModelProposal| Ok(proposal.model.clone());
    let heard = Mutex::new((0_i32, 0, 0));
    let tell = |h: DiagnosisProgress| {
        let mut at = heard.lock().expect("no test panics here");
        match h {
            DiagnosisProgress::Begin(_, steps) => (at.0, at.1) = (at.0 + 1, at.1 + steps),
            DiagnosisProgress::Step => at.2 += 1,
            DiagnosisProgress::End => at.0 -= 1,
        }
        assert!((0..=1).contains(&at.0));
    };
    let watch = |stop| DiagnosisWatch { tell: &tell, stop };
    diagnose(&case, &refit, watch(&|| false)).expect("logs that can be diagnosed");
    let (open, promised, done) = *heard.lock().expect("no test panics here");
    assert_eq!((open, promised), (0, done));
    assert!(done > 100);
    let stopped = diagnose(&case, &refit, watch(&|| true));
    assert!(matches!(stopped, Err(DiagnoseError::Interrupted)));
    // who fits the model is asked, and may refuse
    let refuses = |_: &ModelProposal| -> Result<AugmentedModel, _> { Err(DiagnoseError::Refit) };
    let refused = diagnose(&case, &refuses, watch(&|| false));
    assert!(matches!(refused, Err(DiagnoseError::Refit)));
}

#[test]
fn what_is_not_open_stays_and_what_is_known_before_holds_as_firmly_as_it_is_known() {
    let mut case = case(&one_joint(1.0), logs(&|_, _| 0.4), 0.02);
    case.open.offset = vec![false];
    case.open.friction = vec![vec![false, true]];
    let found = diagnosed(&case);
    assert_eq!(found.unknowns.len(), 2);
    assert_eq!(found.estimates.model.offset, case.given.model.offset);
    let viscous = |m: &AugmentedModel| {
        m.model.friction[0].torque(1.0) - m.model.friction[0].coulomb().unwrap_or(0.0)
    };
    near(viscous(&found.estimates), viscous(&case.given), 1e-12);
    // an offset of 0.4 more is found where it is open, and not where 0.3 is sure
    case.open.offset = vec![true];
    let offset = |case: &DiagnosisCase| diagnosed(case).estimates.model.offset[0];
    near(offset(&case), 0.7, 0.02);
    let last = case.prior.information.nrows() - 1;
    case.prior.information[(last, last)] = 1e12;
    near(offset(&case), 0.3, 1e-3);
}

#[test]
fn a_log_that_is_given_for_it_judges_what_the_others_show() {
    let sign = [1.0, -1.0];
    let one = |of: usize| {
        let how = (2.0 * SECONDS, NOISE, 11 + of as u32);
        log(&one_joint(1.0), &[waves(of)], how, &|_, t, s| {
            sign[of] * ripple(t, s[0])
        })
    };
    let mut case = case(&one_joint(1.0), (0..2).map(one).collect(), 0.02);
    case.roles = vec![LogRole::Train, LogRole::Holdout];
    let found = diagnosed(&case);
    assert!(found.set_aside.is_empty());
    assert_eq!(found.fitted_logs, 1);
    // a ripple of the other sign there takes it out
    assert!(found.holdout_had_a_say() && written(&found).is_empty());
    let vetoed = found
        .steps
        .iter()
        .find(|s| s.vetoed())
        .expect("one is taken out");
    assert_eq!(vetoed.estimate.name(), "ripple");
    // the errors are those of the model that is written
    let errors = [&found.before, &found.named, &found.after];
    let [given, named, written] = errors.map(|e| e.holdout.as_ref().expect("a log is held out"));
    assert_eq!(given.joints[0].rmse, named.joints[0].rmse);
    assert!(written.joints[0].rmse <= named.joints[0].rmse);
}
