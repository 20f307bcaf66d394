//! A double pendulum whose torques are known, under set-ups that are wrong.

use super::*;
use cft_ident_core::inertia::columns::{Own, RegressorColumns};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::double_pendulum::double_pendulum;

fn robot(gravity: [f64; 3]) -> Robot {
    double_pendulum(gravity, false)
}

const DOWN: [f64; 3] = [0.0, -9.81, 0.0];

/// What is logged in 20 s: the noise of the torques goes up to half of `loud`, they are
/// `late` \[s\] behind the positions, and `alter` turns a row.
struct Logged<'a> {
    loud: f64,
    /// Rows that the noise stays the same.
    held: u32,
    late: f64,
    alter: &'a dyn Fn(&mut [f64]),
}

/// Positions, velocities, accelerations and signs of the velocities at a time.
fn motion(t: f64) -> [f64; 8] {
    let mut row = [0.0; 8];
    for (j, (w, size)) in [(1.1, 1.2), (1.7, 1.5)].into_iter().enumerate() {
        for harmonic in [1.0, 2.3] {
            let (w, size) = (w * harmonic, size / harmonic);
            let (s, c) = (w * t + harmonic).sin_cos();
            row[j] += size * s;
            row[2 + j] += size * w * c;
            row[4 + j] -= size * w * w * s;
        }
        row[6 + j] = cft_ident_core::robot::friction::sign(row[2 + j]);
    }
    row
}

/// Motion with friction.
fn sample(of: &Logged) -> Sample {
    let robot = robot(DOWN);
    let standard = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 0.9, 0.05, 0.0, 3.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.14, 0.4, -0.02, 0.0, 1.7],
    ];
    let theta = robot.base_of(standard.as_flattened());
    let mut thinner = Thinner::new(2, 10.0);
    let mut seed = 7_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        of.loud * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    };
    let mut disturbance = [0.0; 2];
    for k in 0..1000 {
        let t = f64::from(k) * 0.02;
        if k % of.held == 0 {
            disturbance = [noise(), noise()];
        }
        let mut row = [0.0; 10];
        row[..8].copy_from_slice(&motion(t));
        let then = motion(t - of.late);
        let mut tau = [0.0; 2];
        robot.torque(&theta, &then[0..2], &then[2..4], &then[4..6], &mut tau);
        for j in 0..2 {
            row[8 + j] = tau[j] + 0.3 * then[2 + j] + 0.4 * then[6 + j] + disturbance[j];
        }
        (of.alter)(&mut row);
        thinner.add((0, 0), t, 0.02, &row);
    }
    thinner.logged_every(0.001);
    thinner.finish()
}

/// A motion with little noise, altered.
fn quiet(alter: &dyn Fn(&mut [f64])) -> Logged<'_> {
    Logged {
        loud: 0.1,
        held: 1,
        late: 0.0,
        alter,
    }
}

fn searched(declared: [f64; 3], alter: &dyn Fn(&mut [f64])) -> Searched {
    searched_of(declared, &quiet(alter))
}

fn searched_of(declared: [f64; 3], of: &Logged) -> Searched {
    let robot_here = robot(declared);
    let columns = RegressorColumns {
        joints: 2,
        shared: robot_here.parameters().len(),
        own: vec![vec![Own::Viscous, Own::Coulomb, Own::Offset]; 2],
        known: vec![None, None],
        rest_speed: Default::default(),
    };
    let in_gravity = |gravity: [f64; 3]| Some(robot(gravity));
    let problem = Problem::new(
        &robot_here,
        Some(&in_gravity),
        Channels::of_joints(2),
        &columns,
        sample(of),
    );
    search(&problem, &|| false)
}

fn first(found: &Searched) -> &Change {
    &found.found.first().expect("something is found").change
}

#[test]
fn a_right_set_up_is_told_nothing() {
    let found = searched(DOWN, &|_| {});
    assert!(
        found.found.is_empty() && found.negative.is_empty(),
        "{:?}",
        found.found
    );
    assert_eq!(found.correction, Correction::none(2));
}

#[test]
fn a_joint_that_turns_a_thousand_times_is_the_less_likely_for_it() {
    let here = robot(DOWN);
    let columns = RegressorColumns {
        joints: 2,
        shared: here.parameters().len(),
        own: vec![vec![Own::Viscous]; 2],
        known: vec![None, None],
        rest_speed: Default::default(),
    };
    let rows = sample(&quiet(&|_| {}));
    let problem = Problem::new(&here, None, Channels::of_joints(2), &columns, rows);
    let none = Correction::none(2);
    assert_eq!(sizes::sizes(&problem, &none), 0.0);
    let of = |factor: f64| {
        let change = Change::Scale(ChannelKind::Position, vec![0], factor);
        sizes::sizes(&problem, &none.with(&change))
    };
    assert!(of(1000.0) < of(57.3) && of(57.3) < 0.0 && of(1e-3) < 0.0);
    // as many turns as one likes say no more than this
    assert_eq!(of(1e6), of(1e9));
}

#[test]
fn turned_and_exchanged_channels_are_named() {
    use ChannelKind::{Both, Position, Torque};
    let turned = searched(DOWN, &|row| row[9] = -row[9]);
    assert_eq!(*first(&turned), Change::Sign(Torque, vec![1]));
    assert!(turned.found[0].sure && turned.found.len() == 1);
    let position = searched(DOWN, &|row| {
        for k in [0, 2, 4, 6] {
            row[k] = -row[k];
        }
    });
    assert_eq!(*first(&position), Change::Sign(Position, vec![0]));
    let both = searched(DOWN, &|row| {
        row.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1))
    });
    assert_eq!(*first(&both), Change::Exchange(Both, 0, 1));
}

#[test]
fn all_torques_turned_are_told_by_physics_alone() {
    let found = searched(DOWN, &|row| row[8..].iter_mut().for_each(|x| *x = -*x));
    assert_eq!(
        *first(&found),
        Change::Sign(ChannelKind::Torque, vec![0, 1])
    );
    let told = &found.found[0];
    assert_eq!(told.error[0], told.error[1]);
    assert!(
        told.violated[0].len() > 1 && told.violated[1].is_empty(),
        "{:?}",
        told.violated
    );
}

#[test]
fn two_faults_are_found_one_after_the_other() {
    let found = searched(DOWN, &|row| {
        row[8] = -row[8];
        for k in [1, 3, 5] {
            row[k] = row[k].to_degrees();
        }
    });
    assert_eq!(found.found.len(), 2, "{:?}", found.found);
    assert_eq!(found.correction.torque_factor, [-1.0, 1.0]);
    let factor = found.correction.position_factor[1];
    assert!((factor.to_degrees() - 1.0).abs() < 1e-12, "{factor}");
}

#[test]
fn all_positions_in_thousandths_are_no_robot_at_rest() {
    let found = searched(DOWN, &|row| {
        row[..6].iter_mut().for_each(|x| *x *= 1e-3);
    });
    let all = Change::Scale(ChannelKind::Position, vec![0, 1], 1e3);
    assert_eq!(*first(&found), all);
}

#[test]
fn the_zero_of_the_last_link_leaves_no_trace() {
    let found = searched(DOWN, &|row| row[1] -= 0.5);
    assert!(found.found.is_empty(), "{:?}", found.found);
}

#[test]
fn gravity_along_another_axis_is_found_or_the_zero_that_is_the_same() {
    let found = searched([9.81, 0.0, 0.0], &|_| {});
    let told = &found.found[0];
    let all = [&told.change].into_iter().chain(&told.tied);
    let down = |change: &&Change| matches!(change, Change::Gravity(g) if g[1] < -9.8);
    assert_eq!(all.filter(down).count(), 1, "{told:?}");
}

#[test]
fn degrees_are_told_with_their_factor() {
    let found = searched(DOWN, &|row| {
        for k in [1, 3, 5] {
            row[k] = row[k].to_degrees();
        }
    });
    let Change::Scale(ChannelKind::Position, joints, factor) = first(&found) else {
        panic!("{:?}", found.found);
    };
    assert_eq!(*joints, [1]);
    assert!((factor.to_degrees() - 1.0).abs() < 1e-12, "{factor}");
}

#[test]
fn torques_that_lag_behind_are_a_hint_with_their_size() {
    for late in [-0.01, 0.02] {
        let of = Logged {
            late,
            ..quiet(&|_| {})
        };
        let found = searched_of(DOWN, &of);
        assert!(found.found.is_empty(), "{:?}", found.found);
        let hint = found.hint.expect("a hint");
        let Small::Delay(told, std) = hint.small else {
            panic!("{hint:?}");
        };
        assert!((told / late - 1.0).abs() < 0.05 && std < 0.1 * late.abs());
        assert!(hint.gain >= hint.needed && hint.error[1] < hint.error[0]);
    }
    // less than two rows of the log, which are 1 ms apart
    let of = Logged {
        late: 0.0015,
        ..quiet(&|_| {})
    };
    assert!(searched_of(DOWN, &of).hint.is_none());
}

#[test]
fn a_reading_that_leaves_more_than_a_third_of_the_torque_is_likely_and_mends_nothing() {
    let of = Logged {
        loud: 8.5,
        ..quiet(&|row| row[9] = -row[9])
    };
    let found = searched_of(DOWN, &of);
    assert_eq!(*first(&found), Change::Sign(ChannelKind::Torque, vec![1]));
    let told = &found.found[0];
    assert!(told.gain > told.needed && told.error[1] > 0.33, "{told:?}");
    assert!(!told.sure && found.found.len() == 1);
    assert_eq!(found.correction, Correction::none(2));
}

#[test]
fn as_what_disturbs_the_torques_grows_a_turned_one_is_sure_then_likely_then_not_told() {
    let told = |loud: f64| {
        let of = Logged {
            loud,
            held: 200,
            ..quiet(&|row| row[9] = -row[9])
        };
        searched_of(DOWN, &of)
    };
    let turned = Change::Sign(ChannelKind::Torque, vec![1]);
    assert!(told(5.0).found[0].sure);
    assert!(told(40.0).found.is_empty());
    // odds of more than 20 to 1 and of less than 3000 to 1
    let between = |found: &Searched| found.found.first().is_some_and(|f| f.gain < f.needed);
    let likely = (11..30).map(|k| told(0.5 * f64::from(k))).find(between);
    let likely = likely.expect("between the two");
    assert_eq!(*first(&likely), turned);
    assert!(!likely.found[0].sure && likely.found.len() == 1);
    assert!(likely.found[0].gain > likely.found[0].needed - 5.0);
    // the fit goes on as declared
    assert_eq!(likely.correction, Correction::none(2));
}
