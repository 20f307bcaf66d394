//! Gains of torque channels: what a channel counts in another unit is found, and the unit itself changes nothing else.

use cft_ident_core::inertia::accumulate::{BlockFactors, RowAccumulator};
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::inertia::gains::{GainFit, GainRows, PayloadColumns, by_gains, fit_gains};
use cft_ident_core::inertia::solve::{RowWeighting, fit};
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::robot::double_pendulum::double_pendulum;
use cft_ident_core::robot::standard::{Body, STANDARD};
use cft_ident_core::robot::{JointKind, Robot};
use nalgebra::DVector;

use crate::diagnosis_bench::{Chance, Waves, motion};

const STEP: f64 = 0.01;
const ROWS: usize = 3000;
const MASS: f64 = 1.7;
/// Viscous and Coulomb friction of each joint.
const FRICTION: [[f64; 2]; 2] = [[0.6, 1.1], [0.2, 0.5]];

pub fn robot() -> Robot {
    double_pendulum([0.0, -9.81, 0.0], false)
}

pub fn bodies() -> Vec<f64> {
    let upper = Body {
        mass: 3.0,
        centre: [0.2, 0.01, 0.0],
        inertia: [0.01, 0.0, 0.0, 0.05, 0.0, 0.06],
    };
    let lower = Body {
        mass: 2.0,
        centre: [0.15, -0.02, 0.0],
        inertia: [0.01, 0.0, 0.0, 0.03, 0.0, 0.04],
    };
    [upper.standard(), lower.standard()].concat()
}

/// The same with a body of known mass on the last link.
fn loaded_bodies() -> Vec<f64> {
    let load = Body {
        mass: MASS,
        centre: [0.3, 0.04, 0.0],
        inertia: [0.004, 0.0, 0.0, 0.005, 0.0, 0.006],
    };
    let mut all = bodies();
    let last = all[STANDARD..].iter_mut().zip(load.standard());
    last.for_each(|(x, more)| *x += more);
    all
}

pub fn waves(first: f64) -> [Waves; 2] {
    [
        vec![[0.9, 1.1 * first, 0.2], [0.4, 2.7 * first, 1.0]],
        vec![[0.8, 1.6 * first, 0.9], [0.5, 3.3 * first, 2.1]],
    ]
}

/// Rows of a motion, of which channel j counts `channel[j]` a unit of torque, with noise in the channels.
pub fn rows(bodies: &[f64], waves: &[Waves; 2], channel: [f64; 2], noise: f64) -> BlockFactors {
    let robot = robot();
    let theta = robot.base_of(bodies);
    let columns = RegressorColumns {
        joints: 2,
        shared: theta.len(),
        own: vec![vec![JointTerm::Viscous, JointTerm::Coulomb]; 2],
        known: vec![None, None],
        rest_speed: Vec::new(),
    };
    let mut all = RowAccumulator::new(columns.clone(), 0.05);
    let mut out = vec![0.0; columns.channels()];
    let (mut chance, mut tau) = (Chance(7), [0.0; 2]);
    for k in 0..ROWS {
        let state = [0, 1].map(|j| motion(&waves[j], STEP * k as f64));
        let [q, v, a] = [0, 1, 2].map(|i| state.map(|s| s[i]));
        robot.torque(&theta, &q, &v, &a, &mut tau);
        let y: [f64; 2] = std::array::from_fn(|j| {
            let [viscous, coulomb] = FRICTION[j];
            channel[j] * (tau[j] + viscous * v[j] + coulomb * v[j].signum() + noise * chance.next())
        });
        columns.fill(&robot, &q, &v, &a, &y, &mut out);
        all.add(0, STEP, &out);
    }
    all.finish()
}

fn with_payload(channel: [f64; 2], noise: f64) -> GainFit {
    let unloaded = rows(&bodies(), &waves(1.0), channel, noise);
    let loaded = rows(&loaded_bodies(), &waves(1.2), channel, noise);
    let payload = PayloadColumns::of(&robot()).expect("a robot with links");
    let rows = GainRows {
        unloaded: &unloaded,
        loaded: Some((&loaded, &payload)),
    };
    fit_gains(&rows).expect("rows that determine all")
}

fn alone(channel: [f64; 2], noise: f64) -> GainFit {
    let unloaded = rows(&bodies(), &waves(1.0), channel, noise);
    let rows = GainRows {
        unloaded: &unloaded,
        loaded: None,
    };
    fit_gains(&rows).expect("rows that determine all")
}

#[test]
fn channels_without_noise_give_the_known_mass_on_every_joint() {
    for channel in [[1.0, 1.0], [0.05, -2.5], [-300.0, 0.4]] {
        let found = with_payload(channel, 0.0);
        for (j, c) in channel.iter().enumerate() {
            let off = found.channel[j] / (c * MASS) - 1.0;
            assert!(off.abs() < 1e-6, "{channel:?} {j}: {off:e}");
        }
        assert_eq!(found.ending, IterationEnding::Converged);
        assert_eq!((found.determined, found.reference), (vec![true; 2], None));
    }
}

#[test]
fn deviations_of_the_gains_are_those_of_their_errors() {
    let channel = [0.5, 4.0];
    let found = with_payload(channel, 1.0);
    for (j, c) in channel.iter().enumerate() {
        let error = (found.channel[j] / (c * MASS)).ln();
        let std = found.covariance[(j, j)].sqrt();
        assert!(error.abs() < 4.0 * std, "{j}: {error} {std}");
        // noise even over 1, and of a thousand rows a number is known well
        assert!((1e-4..0.05).contains(&std), "{j}: {std}");
        let noise = c / 12.0_f64.sqrt();
        assert!((found.residual_std[j] / noise - 1.0).abs() < 0.05);
    }
}

#[test]
fn a_channel_in_another_unit_changes_its_gain_alone() {
    let (one, other) = (
        with_payload([0.5, 4.0], 0.5),
        with_payload([500.0, -4.0], 0.5),
    );
    assert!((other.channel[0] / one.channel[0] / 1000.0 - 1.0).abs() < 1e-6);
    assert!((other.channel[1] / one.channel[1] + 1.0).abs() < 1e-6);
    assert!((other.residual_std[0] / one.residual_std[0] / 1000.0 - 1.0).abs() < 1e-6);
    // of logarithms
    let off = (&other.covariance - &one.covariance).amax() / one.covariance.amax();
    assert!(off < 1e-4, "{off:e}");
}

#[test]
fn without_a_mass_the_ratio_of_the_gains_is_left() {
    let found = alone([0.5, -4.0], 0.0);
    assert!((found.channel[1] / found.channel[0] + 8.0).abs() < 1e-5);
    assert_eq!(found.determined, [true, true]);
    let reference = found.reference.expect("no mass is known");
    // beside itself it is sure
    assert_eq!(found.covariance[(reference, reference)], 0.0);
    let noisy = alone([0.5, 4.0], 0.5);
    let other = 1 - noisy.reference.expect("no mass is known");
    let error = (noisy.channel[1] / noisy.channel[0] / 8.0).ln();
    let std = noisy.covariance[(other, other)].sqrt();
    assert!(error.abs() < 4.0 * std && std < 0.05, "{error} {std}");
}

#[test]
fn a_payload_shows_its_mass_where_gravity_or_a_lever_takes_it() {
    assert!(PayloadColumns::of(&robot()).expect("links").shows_mass());
    // the mass of what turns about its own axis shows nothing but a moment of inertia
    let wheel = Robot::single_joint("q1", JointKind::Revolute);
    assert!(!PayloadColumns::of(&wheel).expect("a link").shows_mass());
    let slide = Robot::single_joint("q1", JointKind::Prismatic);
    assert!(PayloadColumns::of(&slide).expect("a link").shows_mass());
}

#[test]
fn slopes_by_gains_are_what_a_torque_of_another_size_does_to_the_fit_and_sum_up_to_it() {
    let of = |channel| rows(&bodies(), &waves(1.0), channel, 0.5);
    let base = of([1.0, 1.0]);
    let none = DVector::zeros(base.columns.unknowns());
    let slopes = by_gains(&base, &[1.0, 1.0], &none).expect("rows that determine all");
    let plain = fit(&base, RowWeighting::Ols).expect("rows").theta;
    for (j, channel) in [[1.25, 1.0], [1.0, 1.25]].into_iter().enumerate() {
        let moved = fit(&of(channel), RowWeighting::Ols).expect("rows").theta;
        let off = ((moved - &plain) - 0.25 * slopes.column(j)).amax() / plain.amax();
        assert!(off < 1e-9, "{j}: {off:e}");
    }
    let off = (slopes.column_sum() - &plain).amax() / plain.amax();
    assert!(off < 1e-9, "{off:e}");
    // with other weights it is the weighted fit that they sum up to
    let weighted = by_gains(&base, &[3.0, 0.5], &none)
        .expect("rows")
        .column_sum();
    let again = by_gains(&base, &[6.0, 1.0], &none)
        .expect("rows")
        .column_sum();
    assert!((&weighted - again).amax() < 1e-9 * plain.amax());
    assert!((&weighted - &plain).amax() > 1e-6 * plain.amax());
    // what the rows lack to the parameters is a torque too
    let shift = DVector::from_fn(none.len(), |i, _| 0.1 * (i as f64 + 1.0));
    let shifted = by_gains(&base, &[3.0, 0.5], &shift)
        .expect("rows")
        .column_sum();
    let off = (shifted - weighted - shift).amax() / plain.amax();
    assert!(off < 1e-9, "{off:e}");
}
