//! Diagnoses of two joints: what acts between them, on all of them, and on what the last one carries.

use cft_ident_core::diagnose::{Diagnosis, DiagnosisCase, evidence};
use cft_ident_core::effect::EffectPlace;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::double_pendulum::double_pendulum;
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::standard::{Body, STANDARD};
use nalgebra::DMatrix;

use crate::diagnosis_bench::{MarginalGain, Waves, case, diagnosed, effect, log, number, written};

const SECONDS: f64 = 30.0;
const NOISE: f64 = 0.2;
const LEAN: [f64; 3] = [0.5, -9.81, 0.0];

fn bodies() -> Vec<f64> {
    let of = |mass: f64, centre: [f64; 3]| Body {
        mass,
        centre,
        inertia: [0.01, 0.0, 0.0, 0.04, 0.0, 0.05],
    };
    let [upper, lower] = [of(3.0, [0.2, 0.01, 0.0]), of(2.0, [0.15, -0.02, 0.0])];
    [upper.standard(), lower.standard()].concat()
}

fn model(gravity: [f64; 3], bodies: &[f64]) -> Model {
    let robot = double_pendulum(gravity, false);
    let friction =
        |viscous, coulomb| JointFriction::ViscousCoulomb(ViscousCoulomb { viscous, coulomb });
    Model {
        theta: robot.base_of(bodies),
        friction: vec![friction(0.8, 1.5), friction(0.3, 0.6)],
        offset: vec![0.0; 2],
        robot,
    }
}

fn level() -> Model {
    model([0.0, -9.81, 0.0], &bodies())
}

fn waves(of: usize) -> [Waves; 2] {
    let by = 1.0 + 0.09 * of as f64;
    [
        vec![[0.9, 1.1 * by, 0.2], [0.4, 2.7 * by, 1.0]],
        vec![[0.8, 1.6 * by, 0.9], [0.5, 3.3 * by, 2.1]],
    ]
}

fn logs(truth: &Model, more: &MarginalGain<'_>) -> Vec<Stretch> {
    let one = |of: usize| log(truth, &waves(of), (SECONDS, NOISE, 21 + of as u32), more);
    (0..2).map(one).collect()
}

/// A diagnosis of the level machine; constant torques are not open.
fn of(truth: &Model, more: &MarginalGain<'_>) -> (DiagnosisCase, Diagnosis) {
    let mut case = case(&level(), logs(truth, more), 0.02);
    case.open.offset = vec![false; 2];
    let found = diagnosed(&case);
    (case, found)
}

/// The same of inertial parameters that stay as they are given.
fn kept(truth: &Model, covariance: f64) -> Diagnosis {
    let mut case = case(&level(), logs(truth, &|_, _, _| 0.0), 0.02);
    case.open.offset = vec![false; 2];
    let p = case.given.model.theta.len();
    case.kept = Some(DMatrix::identity(p, p) * covariance);
    diagnosed(&case)
}

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    let off = (found - expected).abs();
    assert!(off <= relative * expected.abs(), "{found} {expected}");
}

#[test]
fn friction_of_one_joint_by_the_pose_of_the_other_is_found_between_them() {
    let planted = |j: usize, _: f64, s: &[[f64; 3]]| match j {
        1 => 0.4 * s[1][1].signum() * (s[0][0] + 0.3).sin(),
        _ => 0.0,
    };
    let (case, found) = of(&level(), &planted);
    assert_eq!(written(&found), ["pose-friction"]);
    let own = effect(&found, "pose-friction");
    assert_eq!(own.place, EffectPlace::Pair { on: 1, of: 0 });
    let value = |key| number(own, &case.given.model.robot, key);
    near(value("sin"), 0.4 * 0.3_f64.cos(), 0.1);
    near(value("cos"), 0.4 * 0.3_f64.sin(), 0.1);
    assert_eq!(value("from"), 1.0);
    // what is on one joint changes nothing on the other
    let rmse = |errors: &cft_ident_core::diagnose::UseErrors, j: usize| errors.joints[j].rmse;
    let [before, after] = [&found.before.train, &found.after.train];
    near(rmse(after, 0), rmse(before, 0), 0.02);
    assert!(rmse(after, 1) < 0.4 * rmse(before, 1));
    near(rmse(after, 1), rmse(after, 0), 0.1);
}

#[test]
fn a_base_that_leans_is_found_on_both_joints_by_one_pair_of_numbers() {
    let (case, found) = of(&model(LEAN, &bodies()), &|_, _, _| 0.0);
    assert_eq!(written(&found), ["gravity-tilt"]);
    let own = effect(&found, "gravity-tilt");
    assert_eq!(own.place, EffectPlace::All);
    near(number(own, &case.given.model.robot, "gx"), LEAN[0], 0.02);
    let scale = number(own, &case.given.model.robot, "gy");
    assert!(scale.abs() < 0.05, "{scale}");
    let alone = found.left_alone.as_ref().expect("something is added");
    assert!(alone.unexplained.iter().any(|u| u.is_structure()));
    assert!(!found.left.unexplained.iter().any(|u| u.is_structure()));
}

#[test]
fn a_body_that_the_last_link_carries_is_found_by_its_mass_and_place_where_the_rest_is_kept() {
    let load = Body {
        mass: 0.8,
        centre: [0.25, 0.05, 0.0],
        inertia: [0.002, 0.0, 0.0, 0.002, 0.0, 0.002],
    };
    let mut all = bodies();
    let last = all[STANDARD..].iter_mut().zip(load.standard());
    last.for_each(|(x, more)| *x += more);
    let found = kept(&model([0.0, -9.81, 0.0], &all), 0.0);
    assert_eq!(written(&found), ["payload"]);
    let robot = level().robot;
    let value = |key| number(effect(&found, "payload"), &robot, key);
    near(value("mass"), load.mass, 0.03);
    near(value("mx"), load.mass * load.centre[0], 0.03);
    near(value("my"), load.mass * load.centre[1], 0.1);
    // what was given is as it was
    assert_eq!(found.model.model.theta, level().theta);
    assert!(
        found
            .unknowns
            .iter()
            .all(|u| !matches!(u, cft_ident_core::diagnose::Unknown::Theta(_)))
    );
    // of numbers that are not sure the mass is less sure, and the same
    let unsure = kept(&model([0.0, -9.81, 0.0], &all), 1e-4);
    let torque = |found: &Diagnosis| found.steps[0].torque;
    let ([a, a_std], [b, b_std]) = (torque(&found), torque(&unsure));
    near(b, a, 1e-6);
    assert!(b_std > 1.2 * a_std, "{a_std} {b_std}");
}

#[test]
fn evidence_shows_the_residual_over_what_it_depends_on() {
    let wave = |j: usize, _: f64, s: &[[f64; 3]]| match j {
        0 => 0.5 * (8.0 * s[0][0]).sin(),
        _ => 0.0,
    };
    let logs = logs(&level(), &wave);
    let case = case(&level(), logs, 0.02);
    let stretches: Vec<&Stretch> = case.stretches.iter().collect();
    let shown = evidence(&case.given, &stretches, &case.filters, (10.0, &[8.0, 0.0]));
    let shown = shown.expect("stretches that can be filtered");
    assert_eq!(shown.len(), 2);
    for forward in &shown[0].position {
        let seen = forward.iter().filter(|p| p[1].is_finite());
        for [q, e] in seen.filter(|p| p[0].abs() < 1.0) {
            // as much as the filter leaves of it
            assert!((e - 0.5 * (8.0 * q).sin()).abs() < 0.2, "{q} {e}");
        }
    }
    let peak = shown[0].order.iter().max_by(|a, b| a[1].total_cmp(&b[1]));
    let [order, size] = *peak.expect("a spectrum");
    assert!(
        (order - 8.0).abs() < 0.5 && (0.3..0.6).contains(&size),
        "{order} {size}"
    );
    let flat = shown[1].order.iter().fold(0.0, |top: f64, p| top.max(p[1]));
    assert!(flat < 0.1, "{flat}");
    // rows of both logs, one behind the other, and a break before each
    let times: Vec<f64> = shown[0]
        .time
        .iter()
        .map(|p| p[0])
        .filter(|t| t.is_finite())
        .collect();
    assert!(times.windows(2).all(|t| t[1] > t[0]));
    let breaks = shown[0].time.iter().filter(|p| p[0].is_nan()).count();
    assert_eq!(breaks, 2);
    assert!((times[times.len() - 1] - times[0] - 2.0 * SECONDS).abs() < 5.0);
}

#[test]
fn what_gains_little_in_a_fit_to_all_blocks_is_not_looked_at_and_the_choice_stays() {
    let planted = |j: usize, _: f64, s: &[[f64; 3]]| match j {
        1 => 0.4 * s[1][1].signum() * (s[0][0] + 0.3).sin() + 0.5 * (7.0 * s[1][0]).sin(),
        _ => 0.6 * s[0][0] + 0.3 * s[0][1] * s[0][1].abs(),
    };
    let (mut case, found) = of(&level(), &planted);
    assert!(found.steps.len() > 2, "{:?}", written(&found));
    case.numbers.looked = 0.0;
    let full = diagnosed(&case);
    let said = |of: &Diagnosis| format!("{:?} {:?}", of.steps, of.candidates);
    assert_eq!(said(&found), said(&full));
}
