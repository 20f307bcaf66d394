//! A double pendulum whose torques are known, under set-ups that are wrong.

use super::*;
use crate::inertia::columns::{Own, RegressorColumns};
use crate::robot::Robot;
use crate::robot::double_pendulum::double_pendulum;

fn robot(gravity: [f64; 3]) -> Robot {
    double_pendulum(gravity, false)
}

const DOWN: [f64; 3] = [0.0, -9.81, 0.0];

/// 20 s of motion with friction and a little noise; `alter` turns what was logged.
fn sample(alter: &dyn Fn(&mut [f64])) -> Sample {
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
        0.1 * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    };
    for k in 0..1000 {
        let t = f64::from(k) * 0.02;
        let mut row = [0.0; 10];
        for (j, (w, size)) in [(1.1, 1.2), (1.7, 1.5)].into_iter().enumerate() {
            for harmonic in [1.0, 2.3] {
                let (w, size) = (w * harmonic, size / harmonic);
                let (s, c) = (w * t + harmonic).sin_cos();
                row[j] += size * s;
                row[2 + j] += size * w * c;
                row[4 + j] -= size * w * w * s;
            }
            row[6 + j] = crate::robot::friction::sign(row[2 + j]);
        }
        let mut tau = [0.0; 2];
        robot.torque(&theta, &row[0..2], &row[2..4], &row[4..6], &mut tau);
        for j in 0..2 {
            row[8 + j] = tau[j] + 0.3 * row[2 + j] + 0.4 * row[6 + j] + noise();
        }
        alter(&mut row);
        thinner.add(0, 0.02, &row);
    }
    thinner.finish()
}

fn searched(declared: [f64; 3], alter: &dyn Fn(&mut [f64])) -> Searched {
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
        sample(alter),
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
