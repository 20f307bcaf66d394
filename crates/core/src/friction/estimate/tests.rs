use super::super::prepare::{SensorModel, SmoothedMotion};
use super::super::trial::FrictionTrial;
use super::*;
use crate::math::descent::IterationEnding;
use crate::robot::{JointKind, Robot};

fn run(
    trial: &FrictionTrial,
    seed: u64,
    options: &FrictionOptions,
) -> Result<JointEstimate, FrictionError> {
    of(&trial.prepared(seed), options)
}

fn of(
    prepared: &PreparedProblem,
    options: &FrictionOptions,
) -> Result<JointEstimate, FrictionError> {
    estimate("q1", &["inertia".to_owned()], prepared, None, options)
}

fn curve_error(e: &JointEstimate, law: &DoubleTanh) -> f64 {
    let (mut off, mut size) = (0.0, 0.0);
    for c in &e.curve {
        off += (c.torque - law.torque(c.v)).powi(2);
        size += law.torque(c.v).powi(2);
    }
    (off / size).sqrt()
}

#[test]
fn friction_inertia_and_offset_come_out_of_a_quantised_noisy_log() {
    let trial = FrictionTrial::usual();
    let e = run(&trial, 3, &FrictionOptions::default()).unwrap();
    assert_eq!(e.ending, IterationEnding::Converged);
    assert!(curve_error(&e, &trial.law) < 2e-3);
    for (v, truth) in e.values.iter().zip(trial.law.parameters()) {
        assert_eq!(v.verdict, Verdict::Identified);
        assert!((v.value - truth).abs() < 3.5 * v.std, "{v:?} {truth}");
        assert!(v.std < 0.05 * truth.abs());
    }
    for (nuisance, (truth, near)) in e.nuisance.iter().zip([(12.0, 0.05), (1.5, 0.1)]) {
        assert!((nuisance.value - truth).abs() < near, "{nuisance:?}");
    }
    assert!(e.nis.consistent(), "{:?}", e.nis);
    assert!((0.95..1.05).contains(&e.nis.per_sample), "{:?}", e.nis);
    assert!((e.noise.torque_std / trial.noise - 1.0).abs() < 0.3);
}

#[test]
fn a_start_wrong_by_three_in_everything_ends_at_the_same_law() {
    let trial = FrictionTrial::usual();
    let wrong = [3.0, 1.0 / 3.0, 3.0, 1.0 / 3.0, 3.0];
    let mut p = trial.law.parameters();
    for (x, f) in p.iter_mut().zip(wrong) {
        *x *= f;
    }
    let options = FrictionOptions {
        start: Some(DoubleTanh::from_parameters(p)),
        start_inertia: Some(4.0),
        ..FrictionOptions::default()
    };
    let e = run(&trial, 4, &options).unwrap();
    assert!(curve_error(&e, &trial.law) < 2e-3);
}

#[test]
fn a_reversal_too_quick_to_see_bounds_the_slope_from_below_only() {
    let mut trial = FrictionTrial::usual();
    trial.law = DoubleTanh::from_parameters([30.0, 14.0, 0.0, 1e5, 12.0]);
    trial.motion = vec![(0.05, 1.1)];
    let e = run(&trial, 5, &FrictionOptions::default()).unwrap();
    let steep = &e.values[3];
    assert_eq!(steep.verdict, Verdict::LowerBound, "{:?}", e.values);
    assert!(steep.value < 1e5 && steep.value > 100.0, "{steep:?}");
    assert!(curve_error(&e, &trial.law) < 1e-2);
}

#[test]
fn a_force_that_the_model_lacks_leaves_innovations_beyond_their_bounds() {
    let trial = FrictionTrial::usual();
    let mut motion = trial.motion(7);
    for (tau, q) in motion.tau.iter_mut().zip(&motion.q) {
        *tau += 3.0 * (300.0 * q).sin();
    }
    let nis = of(&trial.prepared_of(motion), &FrictionOptions::default());
    let nis = nis.unwrap().nis;
    assert!(nis.mean > 2.0 * nis.upper_95, "{nis:?}");
    // what single innovations do not show
    assert!((0.8..1.2).contains(&nis.per_sample), "{nis:?}");
}

#[test]
fn motion_in_one_direction_is_answered_with_what_is_missing() {
    let trial = FrictionTrial::usual();
    let mut prepared = trial.prepared(6);
    for v in &mut prepared.velocity {
        *v = v.abs();
    }
    let error = of(&prepared, &FrictionOptions::default()).unwrap_err();
    let named = matches!(error, FrictionError::NeverReverses { .. });
    assert!(named, "{error}");
    assert!(error.to_string().contains("both directions"));
}

#[test]
fn the_plateau_map_lies_on_the_curve() {
    let mut trial = FrictionTrial::usual();
    // triangles of constant speed, from odd harmonics
    trial.motion = (0..40)
        .map(|k| {
            let n = f64::from(2 * k + 1);
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            (sign * 0.1 / (n * n), 0.2 * n)
        })
        .collect();
    let e = run(&trial, 7, &FrictionOptions::default()).unwrap();
    assert!(e.plateaus.len() >= 3);
    for p in &e.plateaus {
        let f = trial.law.torque(p.v);
        assert!((p.torque - f).abs() < 0.03 * f.abs(), "{p:?} {f}");
    }
}

#[test]
fn what_another_smoothing_and_another_weight_of_the_encoder_change_is_in_the_deviations() {
    let mut trial = FrictionTrial::usual();
    trial.seconds = 6.0;
    let motion = trial.motion(3);
    // the same motion as a narrower filter would give it: a hundredth less of every acceleration
    let mut narrower = motion.clone();
    narrower.a.iter_mut().for_each(|a| *a *= 0.99);
    let prepared = trial.prepared_of(motion.clone());
    let robot = Robot::single_joint("q1", JointKind::Prismatic);
    let variance = trial.step * trial.step / 12.0;
    let sensors = SensorModel {
        variance: &|_| variance,
        zero_order_hold: true,
    };
    let with = |narrower: &SmoothedMotion| {
        let inputs = FrictionInputs {
            robot: &robot,
            joint: 0,
            motions: std::slice::from_ref(&motion),
            narrower: std::slice::from_ref(narrower),
            sensors: &sensors,
        };
        let names = ["inertia".to_owned()];
        estimate(
            "q1",
            &names,
            &prepared,
            Some(&inputs),
            &FrictionOptions::default(),
        )
        .unwrap()
    };
    let alone = of(&prepared, &FrictionOptions::default()).unwrap();
    let (same, other) = (with(&motion), with(&narrower));
    assert_eq!((same.law, other.law), (alone.law, alone.law));
    assert_eq!(same.cutoffs, [f64::INFINITY]);
    for k in 0..FRICTION {
        let [alone, same] = [&alone, &same].map(|e| e.covariance[k][k]);
        assert!(same >= alone * (1.0 - 1e-9), "{k}: {alone} {same}");
    }
    // an inertia is known to what another acceleration makes of it
    let [own, changed] = [&same, &other].map(|e| e.nuisance[0].std);
    assert!(changed >= own * (1.0 - 1e-9), "{own} {changed}");
}
