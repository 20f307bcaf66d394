//! Blocks of rows, which joint a log moves, what logs cover, and units of places: by their definitions.

use cft_ident_core::block::Block;
use cft_ident_core::effect::{EffectPlace, LogCoverage, Unit, stationary_joints};
use cft_ident_core::friction::excitation::{FrictionError, moving_joint, speeds};
use cft_ident_core::friction::motions::motions;
use cft_ident_core::friction::prepare::SmoothedMotion;
use cft_ident_core::motion::{FilterSettings, Stretch};
use cft_ident_core::robot::JointKind::{Prismatic, Revolute};
use cft_ident_core::robot::double_pendulum::double_pendulum;
use cft_ident_core::robot::{JointKind, Robot};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Rows of two joints, each number its own.
fn block(rows: std::ops::Range<usize>) -> Block {
    let each = |first: f64| {
        let of = move |k: usize| [first + k as f64, first + k as f64 + 0.5];
        rows.clone().flat_map(of).collect::<Vec<f64>>()
    };
    Block {
        t: rows.clone().map(|k| k as f64).collect(),
        q: each(100.0),
        tau: each(200.0),
        dq: each(300.0),
        line0: rows.start as u64 + 1,
    }
}

fn joined(parts: &[&Block]) -> Block {
    let mut all = parts[0].clone();
    for part in &parts[1..] {
        all.t.extend(&part.t);
        all.q.extend(&part.q);
        all.tau.extend(&part.tau);
        all.dq.extend(&part.dq);
    }
    all
}

#[test]
fn parts_of_a_block_together_are_the_block() {
    let whole = block(0..9);
    assert_eq!(
        (whole.len(), whole.joints(), whole.is_empty()),
        (9, 2, false)
    );
    for last in 0..=9 {
        let (mut first, mut end) = (whole.clone(), block(50..60));
        end.split_from(&mut first, last);
        assert_eq!((first.len(), end.len()), (9 - last, last));
        assert_eq!(
            end,
            if last > 0 {
                block(9 - last..9)
            } else {
                Block {
                    line0: 10,
                    ..Block::default()
                }
            }
        );
        assert_eq!(joined(&[&first, &end]), whole);
        let mut short = whole.clone();
        short.truncate(last);
        assert_eq!(short, block(0..last));
        let mut without = whole.clone();
        without.remove_before_last(last.min(8));
        let end = block(8..9);
        assert_eq!(without, joined(&[&block(0..8 - last.min(8)), &end]));
        let mut kept = whole.clone();
        kept.retain(|t| t as usize != last);
        let expected = joined(&[&block(0..last.min(9)), &block((last + 1).min(9)..9)]);
        assert_eq!(kept, expected);
    }
    let mut none = whole;
    none.clear();
    assert_eq!(none, Block::default());
    assert_eq!((none.joints(), none.is_empty()), (0, true));
}

#[test]
fn a_row_repeats_beside_its_positions_where_torques_and_velocities_do() {
    let repeated = |change: &dyn Fn(&mut Block)| {
        let mut block = block(0..4);
        let last = |x: &mut Vec<f64>| x.copy_within(4..6, 6);
        last(&mut block.tau);
        last(&mut block.dq);
        change(&mut block);
        block.repeats_beside_positions()
    };
    assert!(repeated(&|_| {}));
    assert!(repeated(&|b| b.dq.clear()));
    // a velocity that was not measured is the same as another
    assert!(repeated(&|b| (b.dq[5], b.dq[7]) = (f64::NAN, f64::NAN)));
    assert!(!repeated(&|b| b.dq[7] = f64::NAN));
    assert!(!repeated(&|b| b.tau[6] += 1.0));
    assert!(!repeated(&|b| b.dq[7] += 1.0));
    assert!(!repeated(&|b| b.truncate(1)));
    assert!(!repeated(&|b| b.truncate(3)));
}

fn wave(count: usize, dt: f64, size: f64, hz: f64) -> [Vec<f64>; 3] {
    let w = TAU * hz;
    let at = |k: usize| (w * dt * k as f64).sin_cos();
    [
        (0..count).map(|k| size * at(k).0).collect(),
        (0..count).map(|k| size * w * at(k).1).collect(),
        (0..count).map(|k| -size * w * w * at(k).0).collect(),
    ]
}

/// Positions of joints, as measured.
fn motion(joints: &[&[f64]]) -> SmoothedMotion {
    let rows = joints[0].len();
    SmoothedMotion {
        measured: (0..rows)
            .flat_map(|k| joints.iter().map(move |q| q[k]))
            .collect(),
        ..SmoothedMotion::default()
    }
}

#[test]
fn the_joint_that_travels_most_of_its_range_is_the_one_that_a_log_is_about() {
    let names = ["a", "b", "c"].map(str::to_owned);
    let [q, ..] = wave(200, 0.01, 0.5, 1.0);
    let scaled = |by: f64| q.iter().map(|x| 3.0 + by * x).collect::<Vec<f64>>();
    let of = |sizes: [f64; 3], range: [f64; 3]| {
        let joints = sizes.map(scaled);
        let all = joints.each_ref().map(Vec::as_slice);
        moving_joint(&names, &[motion(&all)], &range)
    };
    assert_eq!(of([1.0, 0.0, 0.1], [1.0; 3]), Ok(0));
    assert_eq!(of([0.1, 0.0, 1.0], [1.0; 3]), Ok(2));
    // a long way is little of a long range
    assert_eq!(of([1.0, 0.2, 0.0], [100.0, 1.0, 1.0]), Ok(1));
    let several = of([1.0, 0.0, 0.5], [1.0, 1.0, 1.0]);
    let Err(FrictionError::SeveralMove {
        first,
        second,
        first_share,
        second_share,
    }) = several
    else {
        panic!("{several:?}")
    };
    assert_eq!((first.as_str(), second.as_str()), ("a", "c"));
    assert!((first_share / second_share - 2.0).abs() < 1e-9 && (first_share - 100.0).abs() < 0.1);
    let none = of([0.01, 0.0, 0.0], [1.0; 3]);
    assert!(
        matches!(none, Err(FrictionError::NothingMoves { travel }) if (travel - 0.01).abs() < 1e-4)
    );
}

#[test]
fn speeds_that_are_covered_are_those_of_both_directions() {
    let [_, v, _] = wave(10_000, 1e-3, 1.0 / TAU, 1.0);
    let found = speeds("a", &v, 5).expect("both directions");
    // of a wave of speed 1: the sine of a fiftieth of a quarter, and of nearly all of it
    assert!((found.covered[0] - (0.02_f64 * 0.5 * std::f64::consts::PI).sin()).abs() < 0.005);
    assert!(found.covered[1] > 0.999 && found.covered[1] <= 1.0);
    // the slower direction says what is covered
    let slower: Vec<f64> = v
        .iter()
        .map(|v| if *v < 0.0 { 0.5 * v } else { *v })
        .collect();
    let half = speeds("a", &slower, 5).expect("both directions");
    assert!((half.covered[1] / found.covered[1] - 0.5).abs() < 1e-3);
    assert!((half.covered[0] / found.covered[0] - 1.0).abs() < 1e-3);
    let turned: Vec<f64> = slower.iter().map(|v| -v).collect();
    assert_eq!(speeds("a", &turned, 5).expect("both directions"), half);
    let forward: Vec<f64> = v.iter().map(|v| v.abs()).collect();
    let refused = speeds("a", &forward, 5);
    assert!(
        matches!(refused, Err(FrictionError::NeverReverses { least, most, .. }) if least == 0.0 && most <= 1.0 && most > 0.99)
    );
    let refused = speeds("a", &v[..99], 5);
    assert!(
        matches!(refused, Err(FrictionError::TooShort { samples, unknowns: 5, .. }) if samples <= 99)
    );
}

#[test]
fn motions_of_a_log_are_its_stretches_between_gaps_without_their_ends() {
    let [q, v, a] = wave(6000, 1e-3, 0.4, 0.7);
    let t: Vec<f64> = (0..6000)
        .map(|k| 1e-3 * k as f64 + if k < 3500 { 0.0 } else { 5.0 })
        .collect();
    let both: Vec<f64> = q.iter().flat_map(|q| [*q, 0.25]).collect();
    let tau: Vec<f64> = (0..12_000).map(f64::from).collect();
    let found = motions(&t, &both, &tau, 2, &FilterSettings::default()).expect("long enough");
    assert_eq!(found.len(), 2);
    for (own, range) in found.iter().zip([0..3500, 3500..6000]) {
        let first = t
            .iter()
            .position(|t| *t == own.t[0])
            .expect("a time of the log");
        assert!(first > range.start && first + own.t.len() < range.end);
        for k in [0, own.t.len() / 2, own.t.len() - 1] {
            assert_eq!(own.measured[2 * k], q[first + k]);
            assert_eq!(own.tau[2 * k + 1], f64::from(2 * (first + k) as u32 + 1));
            assert!((own.v[2 * k] - v[first + k]).abs() < 1e-3);
            assert!((own.a[2 * k] - a[first + k]).abs() < 0.05);
            assert!((own.q[2 * k] - q[first + k]).abs() < 1e-4);
        }
    }
    let short = motions(
        &t[..50],
        &both[..100],
        &tau[..100],
        2,
        &FilterSettings::default(),
    );
    assert!(short.is_err());
}

#[test]
fn what_a_wave_covers_is_its_range_speed_and_turns() {
    let robot = double_pendulum([0.0, -9.81, 0.0], false);
    let (dt, count) = (0.002, 10_000);
    let (one, other) = (wave(count, dt, 0.5, 0.6), wave(count, dt, 1e-4, 0.6));
    let both = |i: usize| vec![one[i].clone(), other[i].clone()];
    let stretch = Stretch {
        dt,
        began: 3.0,
        t: (0..count).map(|k| dt * k as f64).collect(),
        q: both(0),
        v: both(1),
        a: both(2),
        tau: vec![vec![-7.0; count], vec![2.0; count]],
        ..Stretch::default()
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-3 * b.abs(), "{a} {b}");
    let w = TAU * 0.6;
    let mut moving = stretch.clone();
    moving.q[1].iter_mut().for_each(|q| *q *= 1000.0);
    moving.log = 1;
    let logs = [stretch, moving];
    let cover = LogCoverage::of(&robot, &logs, 10.0);
    let joint = &cover.joints[0];
    near(joint.range(), 1.0);
    near(joint.fastest(), 0.5 * w);
    near(joint.speed_rms, 0.5 * w * FRAC_1_SQRT_2);
    near(joint.acceleration_rms, 0.5 * w * w * FRAC_1_SQRT_2);
    near(joint.torque, 7.0);
    // twice a period, in both logs
    assert_eq!(joint.reversals, 48);
    near(cover.duration_s, 3.0 + 20.0);
    assert_eq!(
        (cover.dt, joint.stationary, joint.weight),
        (dt, false, true)
    );
    // the second joint stands in the first log
    assert_eq!(
        stationary_joints(&robot, &logs),
        [[false, true], [false, false]]
    );
    near(cover.joints[1].range(), 0.2);
    assert_eq!(cover.joints[1].reversals, 24);
    let mut wheel = logs[0].clone();
    for x in [&mut wheel.q, &mut wheel.v, &mut wheel.a, &mut wheel.tau] {
        x.truncate(1);
    }
    let alone = LogCoverage::of(&Robot::single_joint("q1", Revolute), &[wheel], 10.0);
    assert!(!alone.joints[0].weight);
    assert_eq!(cover.at(EffectPlace::Joint(1)).torque, 2.0);
    assert_eq!(cover.at(EffectPlace::All).torque, 7.0);
}

#[test]
fn units_of_an_effect_are_those_of_its_torque_over_what_it_goes_by() {
    let text =
        |unit: Unit, kind: JointKind, from: JointKind, torque: &str| unit.text(kind, from, torque);
    for (kind, position, torque) in [(Revolute, "rad", "Nm"), (Prismatic, "m", "N")] {
        let own = |unit| text(unit, kind, kind, torque);
        assert_eq!(own(Unit::Torque), torque);
        assert_eq!(own(Unit::Position), position);
        assert_eq!(own(Unit::Speed), format!("{position}/s"));
        assert_eq!(own(Unit::Slope), format!("s/{position}"));
        assert_eq!(own(Unit::TorqueRate), format!("{torque}/s"));
        assert_eq!(own(Unit::TorqueWalk), format!("{torque}/s^0.5"));
        assert_eq!(own(Unit::Viscous), format!("{torque} s/{position}"));
        assert_eq!(own(Unit::CoupledViscous), own(Unit::Viscous));
        assert_eq!(own(Unit::Stiffness), format!("{torque}/{position}"));
        assert_eq!(own(Unit::Cubic), format!("{torque}/{position}^3"));
        assert_eq!(own(Unit::Power), format!("{torque} (s/{position})^p"));
        assert_eq!(own(Unit::Inertia), own(Unit::CoupledInertia));
        assert_eq!(
            (own(Unit::One), own(Unit::CoupledRatio)),
            ("1".into(), "1".into())
        );
        assert_eq!(own(Unit::Order), own(Unit::OtherOrder));
        // torques in another unit carry it along
        assert_eq!(
            text(Unit::Inertia, kind, kind, "A"),
            format!("A s^2/{position}")
        );
    }
    assert_eq!(text(Unit::Inertia, Revolute, Revolute, "Nm"), "kg m^2");
    assert_eq!(text(Unit::Inertia, Prismatic, Prismatic, "N"), "kg");
    assert_eq!(
        text(Unit::CoupledInertia, Revolute, Prismatic, "Nm"),
        "kg m"
    );
    assert_eq!(
        text(Unit::CoupledViscous, Revolute, Prismatic, "Nm"),
        "Nm s/m"
    );
    assert_eq!(text(Unit::CoupledRatio, Revolute, Prismatic, "Nm"), "rad/m");
    assert_eq!(text(Unit::Order, Revolute, Prismatic, "Nm"), "1/rev");
    assert_eq!(text(Unit::OtherOrder, Revolute, Prismatic, "Nm"), "1/m");
    assert_eq!(text(Unit::Fixed("s"), Revolute, Prismatic, "Nm"), "s");
    for kind in [Revolute, Prismatic] {
        for si in ["kg", "kg m", "kg m^2"] {
            assert_eq!(kind.inertial_unit(si, kind.torque_unit()), si);
        }
        assert_eq!(
            kind.inertial_unit(kind.inertia_unit(), "A"),
            format!("A s^2/{}", kind.position_unit())
        );
    }
    // a first moment turns a sliding joint's force by an acceleration of rad/s^2, a turning joint's torque by one of m/s^2
    assert_eq!(Prismatic.inertial_unit("kg m", "A"), "A s^2/rad");
    assert_eq!(Revolute.inertial_unit("kg m", "A"), "A s^2/m");
}

#[test]
fn a_place_touches_the_joints_that_it_names_and_is_found_again_by_its_name() {
    let robot = double_pendulum([0.0; 3], false);
    let places = [
        (EffectPlace::Joint(1), [false, true], Some(1), None),
        (
            EffectPlace::Pair { on: 0, of: 1 },
            [true, false],
            Some(0),
            Some(1),
        ),
        (
            EffectPlace::Geared { motor: 1, other: 0 },
            [true, true],
            Some(1),
            Some(0),
        ),
        (EffectPlace::All, [true, true], None, None),
    ];
    for (place, touched, joint, from) in places {
        assert_eq!([0, 1].map(|j| place.touches(j)), touched);
        assert_eq!((place.joint(), place.from()), (joint, from));
        let name = joint.map(|j| robot.joint_names()[j].clone());
        assert_eq!(place.name(&robot), name);
        let keys = place.keys();
        assert_eq!(
            keys.iter().find(|k| k.0 == "from").map(|k| k.1),
            from.map(|j| j as f64 + 1.0)
        );
        assert_eq!(
            keys.len(),
            from.map_or(0, |_| 1 + usize::from(touched == [true, true]))
        );
        assert_eq!(place.kind(&robot), Revolute);
    }
    // the screws of the pantograph move the two joints behind it
    for place in [EffectPlace::Actuator(0), EffectPlace::Actuators] {
        assert_eq!(
            [0, 1, 2, 3].map(|j| place.touches(j)),
            [false, false, true, true]
        );
        assert_eq!(place.kind(&robot), Prismatic);
    }
}
