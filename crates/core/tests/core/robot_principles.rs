//! What holds for every robot: deviations by slopes, accelerations that solve the dynamics, power that motors and joints
//! share, and what a body or a gravity does by two ways of reckoning.

use cft_ident_core::robot::cft::{LaboratorySetup, ParameterStructure, geometry};
use cft_ident_core::robot::deviation::Deviation;
use cft_ident_core::robot::double_pendulum::double_pendulum;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::tree::{Coordinate, JointCoupling, Link, Tree, space};
use cft_ident_core::robot::{JointKind, Robot};

use crate::diagnosis_bench::{Chance, motion};
use crate::effect_bench::{Machine, machines};

type State = [Vec<f64>; 3];

fn state(machine: &Machine, t: f64) -> State {
    let at: Vec<[f64; 3]> = machine.waves.iter().map(|w| motion(w, t)).collect();
    [0, 1, 2].map(|i| at.iter().map(|s| s[i]).collect())
}

fn each(mut call: impl FnMut(&Machine, &State)) {
    for machine in machines() {
        for k in 0..20 {
            call(&machine, &state(&machine, 0.37 * f64::from(k)));
        }
    }
}

#[track_caller]
fn near(a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within * (1.0 + b.abs()), "{a} {b}");
}

/// A model with one of its parameters moved, in the order theta, friction, offset.
fn moved(model: &Model, i: usize, by: f64) -> Model {
    let mut out = model.clone();
    let p = model.theta.len();
    if i < p {
        out.theta[i] += by;
        return out;
    }
    let mut at = p;
    for law in &mut out.friction {
        let k = i.wrapping_sub(at);
        match law {
            JointFriction::ViscousCoulomb(law) if k < 2 => {
                *[&mut law.viscous, &mut law.coulomb][k] += by
            }
            JointFriction::DoubleTanh(law) if k < 5 => {
                let mut numbers = law.parameters();
                numbers[k] += by;
                *law = cft_ident_core::robot::friction::DoubleTanh::from_parameters(numbers);
            }
            _ => {}
        }
        at += law.parameters();
    }
    if i >= at {
        out.offset[i - at] += by;
    }
    out
}

#[test]
fn the_variance_of_a_torque_is_that_of_its_slopes_by_the_parameters() {
    each(|machine, [q, v, a]| {
        let model = &machine.model;
        let (n, u) = (model.robot.joints(), model.parameters());
        let mut chance = Chance(5);
        // C = L L'
        let l: Vec<f64> = (0..u * u).map(|_| 0.1 * chance.next()).collect();
        let c = |i: usize, k: usize| (0..u).map(|m| l[i * u + m] * l[k * u + m]).sum::<f64>();
        let covariance: Vec<f64> = (0..u * u).map(|at| c(at / u, at % u)).collect();
        let torque = |model: &Model| {
            let mut tau = vec![0.0; n];
            model.torque(q, v, a, &mut tau);
            tau
        };
        let slopes: Vec<Vec<f64>> = (0..u)
            .map(|i| {
                let by = 1e-5;
                let sides = torque(&moved(model, i, by))
                    .into_iter()
                    .zip(torque(&moved(model, i, -by)));
                sides
                    .map(|(more, less)| (more - less) / (2.0 * by))
                    .collect()
            })
            .collect();
        let mut found = [vec![0.0; n], vec![0.0; n]];
        Deviation::new(&covariance, model).variances([q, v, a], &mut found[0]);
        Deviation::owned(&covariance, model.clone()).variances([q, v, a], &mut found[1]);
        assert_eq!(found[0], found[1]);
        for j in 0..n {
            let along = |m: usize| (0..u).map(|i| slopes[i][j] * l[i * u + m]).sum::<f64>();
            let expected: f64 = (0..u).map(|m| along(m).powi(2)).sum();
            near(found[0][j], expected, 1e-6);
        }
    });
}

#[test]
fn accelerations_by_the_dynamics_give_back_the_torque() {
    each(|machine, [q, v, a]| {
        let model = &machine.model;
        let n = model.robot.joints();
        let dynamics = model.robot.dynamics(&model.theta);
        assert_eq!(
            (dynamics.theta(), dynamics.robot()),
            (model.theta.as_slice(), &model.robot)
        );
        let (mut mass, mut bias) = (vec![0.0; n * n], vec![0.0; n]);
        dynamics.inertia_and_bias(q, v, &mut mass, &mut bias);
        let mut tau = vec![0.0; n];
        model.robot.torque(&model.theta, q, v, a, &mut tau);
        for i in 0..n {
            let by_mass: f64 = (0..n).map(|k| mass[i * n + k] * a[k]).sum();
            near(by_mass + bias[i], tau[i], 1e-9);
            (0..n).for_each(|k| near(mass[i * n + k], mass[k * n + i], 1e-9));
        }
        let mut left: Vec<f64> = tau.iter().zip(&bias).map(|(tau, b)| tau - b).collect();
        if dynamics.solve(&mut mass.clone(), &mut left) {
            left.iter().zip(a).for_each(|(x, a)| near(*x, *a, 1e-7));
        }
        // without a positive inertia there is no acceleration
        let mut none = vec![0.0; n * n];
        assert!(!dynamics.solve(&mut none, &mut tau));
    });
}

/// Bodies of a pendulum, of which the inertia is positive.
fn pendulum() -> (Robot, Vec<f64>) {
    let robot = double_pendulum([0.0, -9.81, 0.0], false);
    let body = |mass: f64, x: f64, zz: f64| {
        [
            0.1,
            0.0,
            0.0,
            0.2,
            0.0,
            zz + mass * x * x,
            mass * x,
            0.0,
            0.0,
            mass,
        ]
    };
    let theta = robot.base_of(&[body(3.0, 0.2, 0.06), body(2.0, 0.15, 0.04)].concat());
    (robot, theta)
}

#[test]
fn a_pendulum_keeps_its_energy_where_nothing_acts_on_it() {
    let (robot, theta) = pendulum();
    let dynamics = robot.dynamics(&theta);
    let energy = |q: &[f64; 2], v: &[f64; 2]| {
        let (mut mass, mut bias) = ([0.0; 4], [0.0; 2]);
        dynamics.inertia_and_bias(q, v, &mut mass, &mut bias);
        let kinetic: f64 = (0..4).map(|i| 0.5 * v[i / 2] * mass[i] * v[i % 2]).sum();
        let height = 3.0 * 0.2 * q[0].sin() + 2.0 * (0.4 * q[0].sin() + 0.15 * (q[0] + q[1]).sin());
        kinetic + 9.81 * height
    };
    let rate = |q: &[f64; 2], v: &[f64; 2]| {
        let (mut mass, mut a) = ([0.0; 4], [0.0; 2]);
        dynamics.inertia_and_bias(q, v, &mut mass, &mut a);
        a.iter_mut().for_each(|a| *a = -*a);
        assert!(dynamics.solve(&mut mass, &mut a));
        a
    };
    let (mut q, mut v) = ([0.3, -0.7], [0.5, 1.2]);
    let begun = energy(&q, &v);
    let h = 1e-3;
    let step = |x: &[f64; 2], by: f64, dx: &[f64; 2]| [x[0] + by * dx[0], x[1] + by * dx[1]];
    for _ in 0..2000 {
        let a1 = rate(&q, &v);
        let (q2, v2) = (step(&q, h / 2.0, &v), step(&v, h / 2.0, &a1));
        let a2 = rate(&q2, &v2);
        let (q3, v3) = (step(&q, h / 2.0, &v2), step(&v, h / 2.0, &a2));
        let a3 = rate(&q3, &v3);
        let (q4, v4) = (step(&q, h, &v3), step(&v, h, &a3));
        let a4 = rate(&q4, &v4);
        for j in 0..2 {
            q[j] += h / 6.0 * (v[j] + 2.0 * v2[j] + 2.0 * v3[j] + v4[j]);
            v[j] += h / 6.0 * (a1[j] + 2.0 * a2[j] + 2.0 * a3[j] + a4[j]);
        }
    }
    near(energy(&q, &v), begun, 1e-8);
}

/// Two joints that turn about the same axis, each motor turned by the other joint too.
fn geared(ratio: f64) -> Robot {
    let link = |joint: usize| Link {
        name: format!("link_{joint}"),
        parent: joint.checked_sub(1),
        rotation: space::UNTURNED,
        origin: [0.1, 0.0, 0.0],
        axis: [0.0, 0.0, 1.0],
        kind: JointKind::Revolute,
        coordinate: Coordinate::Joint(joint),
    };
    let tree = Tree::new(vec![link(0), link(1)], 2, [0.0; 3]).expect("a chain");
    let train = |motor, other| JointCoupling {
        motor,
        other,
        ratio,
    };
    let names = vec!["a".to_owned(), "b".to_owned()];
    Robot::of_tree(tree, names, true, vec![train(1, 0), train(0, 1)])
}

#[test]
fn gear_trains_that_are_coupled_take_the_power_of_what_their_motors_do() {
    let ratio = 0.7;
    let robot = geared(ratio);
    let p = robot.parameters().len();
    let place = |name: &str| {
        robot
            .parameters()
            .iter()
            .position(|x| x.name == name)
            .expect(name)
    };
    let (inertia, viscous) = (place("inertia_b_a"), place("viscous_b_a"));
    let (coulomb, other) = (place("coulomb_b_a"), place("coulomb_a_b"));
    let theta = |i: usize| {
        let mut theta = vec![0.0; p];
        theta[i] = 1.0;
        theta
    };
    let mut chance = Chance(3);
    for _ in 0..50 {
        let mut draw = || [4.0 * chance.next(), 4.0 * chance.next()];
        let (q, v, a) = (draw(), draw(), draw());
        let torque = |i: usize| {
            let mut tau = [0.0; 2];
            robot.torque(&theta(i), &q, &v, &a, &mut tau);
            tau
        };
        // by the motor's kinetic energy, (v_b + r v_a)^2 / 2, without the squares, which drives of their own have
        let [on_a, on_b] = torque(inertia);
        near(on_a, ratio * a[1], 1e-12);
        near(on_b, ratio * a[0], 1e-12);
        let power = |tau: [f64; 2]| tau[0] * v[0] + tau[1] * v[1];
        near(power(torque(viscous)), 2.0 * ratio * v[0] * v[1], 1e-12);
        near(power(torque(coulomb)), (v[1] + ratio * v[0]).abs(), 1e-12);
        near(power(torque(other)), (v[0] + ratio * v[1]).abs(), 1e-12);
        // what is linear in the parameters is so by both ways
        let all: Vec<f64> = (0..p).map(|i| (1.0 + i as f64).sin()).collect();
        let mut y = vec![0.0; 2 * p];
        robot.regressor(&q, &v, &a, &mut y);
        let mut tau = [0.0; 2];
        robot.torque(&all, &q, &v, &a, &mut tau);
        for j in 0..2 {
            let sum: f64 = y[j * p..(j + 1) * p]
                .iter()
                .zip(&all)
                .map(|(y, x)| y * x)
                .sum();
            near(tau[j], sum, 1e-12);
        }
    }
    let all: Vec<f64> = (0..p).map(|i| 1.0 + i as f64).collect();
    let found = robot.coupling_parameters(&all);
    assert_eq!(found[0], [all[inertia], all[viscous], all[coulomb]]);
    assert_eq!(found[1], [0.0, 0.0, all[other]]);
    assert_eq!(robot.transmission().couplings().len(), 2);
}

#[test]
fn motors_at_the_joints_are_the_joints() {
    let (robot, _) = pendulum();
    let t = robot.transmission();
    let (q, v, a) = ([0.3, -0.7], [1.1, 0.2], [-2.0, 0.5]);
    let mut out = [0.0; 2];
    let mut same = |x: &[f64; 2], of: &dyn Fn(&mut [f64])| {
        of(&mut out);
        assert_eq!(out, *x);
    };
    same(&q, &|out| t.positions(&q, out));
    same(&v, &|out| t.velocities(&q, &v, out));
    same(&a, &|out| t.accelerations(&q, &v, &a, out));
    same(&q, &|out| t.joints(&q, out).expect("any pose"));
    same(&v, &|out| {
        t.joint_velocities(&q, &v, out).expect("any pose")
    });
    same(&a, &|out| {
        t.joint_accelerations(&q, &v, &a, out).expect("any pose")
    });
    same(&a, &|out| t.torques(&q, &a, out));
    same(&a, &|out| t.volts(&q, &a, out).expect("any pose"));
    same(&a, &|out| t.carry_torque(&q, &v, &a, out));
    assert_eq!(
        (t.joint_of(1), t.coordinate_kind(1)),
        (Some((1, 0.0)), None)
    );
    assert_eq!(
        (t.clearance(&q), t.full_travel(0), t.gains()),
        (None, None, None)
    );
    assert!(t.screws().is_empty() && t.coordinates().is_none() && t.encoder_steps().is_none());
    assert_eq!(robot.coordinate_names(), robot.joint_names());
    assert_eq!(robot.coordinate_kind(1), JointKind::Revolute);
    let mut rounded = q;
    t.round_at_encoders(&mut rounded, &[0.5; 4]);
    assert_eq!(rounded, q);
}

#[test]
fn motors_of_a_linkage_share_the_joints_power_and_move_as_they_do() {
    let machine = machines()
        .into_iter()
        .find(|m| m.name == "cft")
        .expect("it is one");
    let robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::Full22);
    let t = robot.transmission();
    let gains = t.gains().expect("amplifiers are known");
    for k in 0..20 {
        let [q, v, a] = state(&machine, 0.37 * f64::from(k));
        let [mut x, mut xd, mut xdd, mut back] = [[0.0; 4]; 4];
        t.positions(&q, &mut x);
        t.velocities(&q, &v, &mut xd);
        t.accelerations(&q, &v, &a, &mut xdd);
        let at = |by: f64| {
            let there = state(&machine, 0.37 * f64::from(k) + by);
            let mut x = [0.0; 4];
            t.positions(&there[0], &mut x);
            x
        };
        let h = 1e-4;
        let (more, less) = (at(h), at(-h));
        for i in 0..4 {
            near(xd[i], (more[i] - less[i]) / (2.0 * h), 1e-6);
            near(xdd[i], (more[i] - 2.0 * x[i] + less[i]) / (h * h), 1e-5);
        }
        t.joints(&x, &mut back).expect("within reach");
        (0..4).for_each(|j| near(back[j], q[j], 1e-9));
        t.joint_velocities(&q, &xd, &mut back)
            .expect("within reach");
        (0..4).for_each(|j| near(back[j], v[j], 1e-9));
        t.joint_accelerations(&q, &v, &xdd, &mut back)
            .expect("within reach");
        (0..4).for_each(|j| near(back[j], a[j], 1e-8));
        // volts times gains are the motors' forces
        let volts = [0.7, -1.1, 0.4, 2.0];
        let mut tau = [0.0; 4];
        t.torques(&q, &volts, &mut tau);
        let by_joints: f64 = tau.iter().zip(&v).map(|(tau, v)| tau * v).sum();
        // forces of the first two are those at the pantograph's references
        let ratio = [
            (geometry::L4 + geometry::L6) / geometry::L4,
            geometry::L6 / geometry::L4,
            1.0,
            1.0,
        ];
        let by_motors: f64 = (0..4).map(|i| volts[i] * gains[i] * xd[i] / ratio[i]).sum();
        near(by_joints, by_motors, 1e-9);
        t.volts(&q, &tau, &mut back).expect("within reach");
        (0..4).for_each(|i| near(back[i], volts[i], 1e-9));
        // the same forces at another pose, and back again
        let there = state(&machine, 0.1 + 0.2 * f64::from(k))[0].clone();
        let (mut carried, mut expected) = ([0.0; 4], [0.0; 4]);
        t.carry_torque(&q, &there, &tau, &mut carried);
        t.torques(&there, &volts, &mut expected);
        (0..4).for_each(|j| near(carried[j], expected[j], 1e-9));
        near(t.clearance(&q).expect("a linkage"), q[3].sin(), 1e-15);
        for (i, x) in x.iter().enumerate() {
            if let Some((joint, constant)) = t.joint_of(i) {
                near(*x, q[joint] + constant, 1e-12);
                assert_eq!(t.coordinate_kind(i), Some(robot.joint_kind(joint)));
            }
        }
        // on a grid of the encoders, and half a step away at most
        let steps = t.encoder_steps().expect("encoders are known");
        let shift = [0.1, 0.6, 0.3, 0.8];
        let mut rounded = q.clone();
        t.round_at_encoders(&mut rounded, &shift);
        let mut grid = [0.0; 4];
        t.positions(&rounded, &mut grid);
        for i in 0..4 {
            assert!((grid[i] - x[i]).abs() <= 0.5001 * steps[i], "{i}");
        }
        let mut again = rounded.clone();
        t.round_at_encoders(&mut again, &shift);
        rounded
            .iter()
            .zip(&again)
            .for_each(|(a, b)| near(*a, *b, 1e-9));
    }
    assert_eq!(robot.coordinate_names().len(), 4);
    assert_eq!((t.screws().len(), t.joint_of(0)), (2, None));
}

#[test]
fn a_body_on_a_tool_that_stays_level_is_the_same_by_its_ten_numbers_and_by_five() {
    let machine = machines()
        .into_iter()
        .find(|m| m.name == "cft")
        .expect("it is one");
    let full = Robot::cft(LaboratorySetup::default(), ParameterStructure::Full22);
    let printed = Robot::cft(LaboratorySetup::default(), ParameterStructure::Printed12);
    assert!(full.tool_stays_level());
    let mut theta: Vec<f64> = (0..22).map(|i| 0.2 + 0.1 * f64::from(i).sin()).collect();
    for k in 0..10 {
        let [q, v, a] = state(&machine, 0.41 * f64::from(k));
        for j in 0..4 {
            let ten = full.tool_row(j, &q, &v, &a);
            let five = full.level_tool_row(j, &q, &v, &a);
            // its place over the joints shows by gravity alone
            let expected = [ten[9], ten[6], ten[7], ten[8], ten[3] + ten[5]];
            (0..5).for_each(|i| near(five[i], expected[i], 1e-9));
        }
        let torque = |robot: &Robot, theta: &[f64]| {
            let mut tau = [0.0; 4];
            robot.torque(theta, &q, &v, &a, &mut tau);
            tau
        };
        let (all, some) = (torque(&full, &theta), torque(&printed, &theta[..12]));
        let mut row = [0.0; 10];
        for j in 0..4 {
            printed.dropped_row(j, &q, &v, &a, &mut row);
            let more: f64 = row.iter().zip(&theta[12..]).map(|(y, x)| y * x).sum();
            near(some[j] + more, all[j], 1e-10);
        }
        // gravity along the slide is as if all slid against it
        let still = [0.0; 4];
        let mut tilt = [[0.0; 2]; 4];
        full.tilt(&theta).torques(&q, &mut tilt);
        let weight = |slide: f64| {
            let mut tau = [0.0; 4];
            full.torque(&theta, &q, &still, &[slide, 0.0, 0.0, 0.0], &mut tau);
            tau
        };
        let (with, without) = (weight(-1.0), weight(0.0));
        (0..4).for_each(|j| near(tilt[j][1], with[j] - without[j], 1e-10));
        // a potential: what one joint's torque changes with another is the same the other way
        let h = 1e-5;
        let slope = |on: usize, by: usize, axis: usize| {
            let at = |s: f64| {
                let mut there = q.clone();
                there[by] += s * h;
                let mut tilt = [[0.0; 2]; 4];
                full.tilt(&theta).torques(&there, &mut tilt);
                tilt[on][axis]
            };
            (at(1.0) - at(-1.0)) / (2.0 * h)
        };
        for (i, j, axis) in [
            (0, 1, 1),
            (1, 2, 0),
            (1, 3, 0),
            (2, 3, 1),
            (1, 2, 1),
            (0, 3, 0),
        ] {
            near(slope(i, j, axis), slope(j, i, axis), 1e-7);
        }
        theta.rotate_left(1);
    }
    assert_eq!(printed.dropped_parameters().len(), 10);
    assert!(full.dropped_parameters().is_empty());
}

#[test]
fn a_base_that_leans_turns_a_pendulum_as_gravity_from_there_does() {
    let (robot, theta) = pendulum();
    let leaning = double_pendulum([0.8, -9.81, 0.0], false);
    for k in 0..10 {
        let q = [0.4 * f64::from(k), 1.0 - 0.3 * f64::from(k)];
        let still = [0.0; 2];
        let torque = |robot: &Robot| {
            let mut tau = [0.0; 2];
            robot.torque(&theta, &q, &still, &still, &mut tau);
            tau
        };
        let mut tilt = [[0.0; 2]; 2];
        robot.tilt(&theta).torques(&q, &mut tilt);
        let (level, leans) = (torque(&robot), torque(&leaning));
        for j in 0..2 {
            near(0.8 * tilt[j][0], leans[j] - level[j], 1e-10);
            near(-9.81 * tilt[j][1], level[j], 1e-10);
        }
    }
    // a single joint's link has no place
    let mut none = [[1.0; 2]];
    let wheel = Robot::single_joint("q1", JointKind::Revolute);
    wheel.tilt(&[1.0]).torques(&[0.3], &mut none);
    assert_eq!(none, [[0.0; 2]]);
    assert_eq!(
        wheel.level_tool_row(0, &[0.1], &[0.2], &[0.3]),
        [0.3, 0.0, 0.0, 0.0, 0.0]
    );
}
