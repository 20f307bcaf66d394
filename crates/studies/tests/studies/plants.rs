//! The plants obey physics: closed forms, energy, order of the steps, and a stick that holds.

use cft_ident_studies::added::{Added, Shape};
use cft_ident_studies::arms;
use cft_ident_studies::chain::{JOINTS, Joints};
use cft_ident_studies::friction::{Friction, Law};
use cft_ident_studies::plant::{Bodies, Contact, Elastic, Plant, State};

fn one(inertia: f64, viscous: f64, coulomb: f64, law: Law) -> Plant {
    Plant {
        bodies: Bodies::Single {
            inertia,
            weight: 0.0,
            phase: 0.0,
        },
        joints: 1,
        drives: [None; JOINTS],
        friction: vec![Friction {
            viscous,
            coulomb,
            law,
        }],
        offset: [0.0; JOINTS],
        added: Vec::new(),
    }
}

fn joint(value: f64) -> Joints {
    let mut out = [0.0; JOINTS];
    out[0] = value;
    out
}

fn run(plant: &Plant, state: &mut State, u: impl Fn(f64) -> f64, seconds: f64, h: f64) {
    let steps = (seconds / h).round() as usize;
    for k in 0..steps {
        // torque amid the step
        let now = u((k as f64 + 0.5) * h);
        plant.step(state, &joint(now), h);
    }
}

#[test]
fn a_coasting_joint_stops_where_the_closed_form_says_and_holds() {
    let (j, b, c, v0) = (0.03, 0.4, 0.5, 1.5);
    let plant = one(j, b, c, Law::Coulomb);
    let mut state = plant.at_rest(joint(0.0));
    state.v[0] = v0;
    state.contact[0] = Contact::Slides(1.0);
    run(&plant, &mut state, |_| 0.0, 1.0, 5e-5);
    let (tau, end) = (j / b, (j / b) * (1.0 + b * v0 / c).ln());
    let way = tau * (v0 + c / b) * (1.0 - (-end / tau).exp()) - c / b * end;
    assert_eq!(state.v[0], 0.0);
    assert_eq!(state.contact[0], Contact::Holds);
    assert!((state.q[0] - way).abs() < 1e-8, "{} {way}", state.q[0]);
    run(&plant, &mut state, |_| 0.499, 1.0, 5e-5);
    assert_eq!(state.v[0], 0.0);
    assert!((state.q[0] - way).abs() < 1e-8);
}

#[test]
fn a_joint_breaks_loose_at_the_level_that_holds_it() {
    let (j, b, c) = (0.02, 0.5, 0.6);
    let plant = one(j, b, c, Law::Coulomb);
    let mut state = plant.at_rest(joint(0.0));
    // a ramp: loose at 0.6 s, from then J dv/dt + b v = t - 0.6
    run(&plant, &mut state, |t| t, 1.1, 5e-5);
    let (tau, t) = (j / b, 0.5_f64);
    let speed = (t - tau + tau * (-t / tau).exp()) / b;
    assert!((state.v[0] - speed).abs() < 1e-6, "{} {speed}", state.v[0]);
    // Stribeck's holds longer, and is overtaken by nothing below it
    let plant = one(
        j,
        b,
        c,
        Law::Stribeck {
            more: 0.3,
            vs: 0.05,
        },
    );
    let mut state = plant.at_rest(joint(0.0));
    run(&plant, &mut state, |_| 0.89, 0.5, 5e-5);
    assert_eq!(state.q[0], 0.0);
    run(&plant, &mut state, |_| 0.91, 0.5, 5e-5);
    assert!(state.q[0] > 0.1);
}

#[test]
fn halving_the_step_quarters_the_error() {
    let law = Law::Smooth { width: 0.2 };
    let end = |h: f64| {
        let plant = one(0.02, 0.4, 0.5, law);
        let mut state = plant.at_rest(joint(0.0));
        run(&plant, &mut state, |t| (7.0 * t).sin() * 1.5, 2.0, h);
        (state.q[0], state.v[0])
    };
    let fine = end(1e-3 / 32.0);
    let error = |h: f64| (end(h).0 - fine.0).hypot(end(h).1 - fine.1);
    let ratio = error(1e-3) / error(5e-4);
    assert!(ratio > 3.5 && ratio < 4.6, "{ratio}");
}

#[test]
fn reversals_with_an_ideal_stick_keep_their_order() {
    // over the same piecewise torque, so that only the reversals differ
    let end = |h: f64| {
        let plant = one(0.02, 0.4, 0.5, Law::Coulomb);
        let mut state = plant.at_rest(joint(0.0));
        let torque = |t: f64| ((9.0 * ((t / 1e-3).floor() * 1e-3)).sin()) * 0.9;
        run(&plant, &mut state, torque, 3.0, h);
        state.q[0]
    };
    let fine = end(1e-3 / 64.0);
    let (coarse, middle) = ((end(1e-3) - fine).abs(), (end(2.5e-4) - fine).abs());
    assert!(middle < 0.25 * coarse && middle < 2e-6, "{coarse} {middle}");
}

/// Work of the drives, energy and heat over a motion of an arm.
fn balance(plant: &Plant, energy: impl Fn(&State) -> f64, h: f64) -> (f64, f64) {
    let n = plant.joints;
    let mut state = plant.at_rest([0.1, -0.3, 0.5, 0.2, 0.4, -0.1]);
    let start = energy(&state);
    let (mut work, mut heat) = (0.0, 0.0);
    for k in 0..(1.0 / h) as usize {
        let t = k as f64 * h;
        let u: Joints = std::array::from_fn(|i| {
            (30.0 / (1.0 + i as f64 * i as f64)) * (9.0 * t + i as f64).sin()
        });
        let before = state.clone();
        plant.step(&mut state, &u, h);
        for (i, torque) in u.iter().enumerate().take(n) {
            let v = 0.5 * (before.v[i] + state.v[i]);
            let z = 0.5 * (before.bristle[i] + state.bristle[i]);
            work += torque * (state.q[i] - before.q[i]);
            heat += h * v * plant.friction[i].torque(v, v.signum(), z, 0.0).0;
            if let Some(drive) = &plant.drives[i] {
                let slip = v - 0.5 * (before.link_v[i] + state.link_v[i]);
                heat += h * drive.damping * slip * slip;
            }
        }
    }
    (work - heat, energy(&state) - start)
}

fn arm(law: Law) -> Plant {
    let chain = arms::arm6();
    let friction = (0..6).map(|i| Friction {
        viscous: 1.0 / (1.0 + f64::from(i)),
        coulomb: 1.0 / (1.0 + f64::from(i)),
        law,
    });
    Plant {
        friction: friction.collect(),
        bodies: Bodies::Chain(chain),
        joints: 6,
        drives: [None; JOINTS],
        offset: [0.0; JOINTS],
        added: Vec::new(),
    }
}

#[test]
fn work_is_energy_and_heat_on_a_stiff_arm() {
    let plant = arm(Law::Coulomb);
    let Bodies::Chain(chain) = &plant.bodies else {
        unreachable!()
    };
    let energy = |s: &State| {
        let drives: f64 = (0..6)
            .map(|i| 0.5 * chain.links[i].drive_inertia * s.v[i] * s.v[i])
            .sum();
        chain.energy(&s.q, &s.v) + drives
    };
    let (spent, gained) = balance(&plant, energy, 5e-5);
    assert!(
        (spent - gained).abs() < 1e-3 * (1.0 + spent.abs()),
        "{spent} {gained}"
    );
}

#[test]
fn work_is_energy_and_heat_on_an_elastic_arm() {
    let mut plant = arm(Law::Smooth { width: 0.02 });
    let Bodies::Chain(chain) = &mut plant.bodies else {
        unreachable!()
    };
    for i in 0..6 {
        let motor = std::mem::take(&mut chain.links[i].drive_inertia);
        plant.drives[i] = Some(Elastic {
            stiffness: 2e4 * motor,
            damping: 3.0 * motor,
            gap: 0.0,
            motor,
            error: 0.0,
            order: 1.0,
        });
    }
    let chain = chain.clone();
    let drives = plant.drives;
    let energy = |s: &State| {
        let of = |i: usize| {
            drives[i].map_or(0.0, |d| {
                0.5 * d.motor * s.v[i].powi(2) + 0.5 * d.stiffness * (s.q[i] - s.link_q[i]).powi(2)
            })
        };
        chain.energy(&s.link_q, &s.link_v) + (0..6).map(of).sum::<f64>()
    };
    let (spent, gained) = balance(&plant, energy, 5e-5);
    assert!(
        (spent - gained).abs() < 1e-3 * (1.0 + spent.abs()),
        "{spent} {gained}"
    );
}

#[test]
fn a_held_joint_does_not_move_while_another_pulls_at_it() {
    let mut plant = arm(Law::Coulomb);
    plant.bodies = Bodies::Chain({
        let mut chain = arms::arm6();
        chain.gravity = [0.0; 3];
        chain
    });
    plant.friction[0].coulomb = 1e3;
    let mut state = plant.at_rest([0.0; JOINTS]);
    for k in 0..20_000 {
        let swing = (8.0 * f64::from(k) * 5e-5).sin();
        plant.step(
            &mut state,
            &[0.0, 20.0 * swing, 5.0 * swing, 1.0, -1.0, 0.5],
            5e-5,
        );
    }
    assert_eq!(state.q[0], 0.0);
    assert!(state.q[1].abs() > 0.01);
}

#[test]
fn a_bristle_yields_in_proportion_and_then_slides_at_the_level() {
    let stiffness = 500.0;
    let plant = one(
        0.02,
        0.0,
        0.5,
        Law::Presliding {
            stiffness,
            damping: 2.0,
        },
    );
    let mut state = plant.at_rest(joint(0.0));
    // Dahl's way under a load that grows slowly
    run(&plant, &mut state, |t| 0.05 * t, 5.0, 5e-5);
    let way = -0.5 / stiffness * (1.0_f64 - 0.25 / 0.5).ln();
    assert!(
        (state.q[0] - way).abs() < 0.02 * way,
        "{} {way}",
        state.q[0]
    );
    // 0.02 Nm beyond the level
    run(&plant, &mut state, |_| 0.52, 1.0, 5e-5);
    let before = state.v[0];
    run(&plant, &mut state, |_| 0.52, 1.0, 5e-5);
    assert!(
        (state.v[0] - before - 1.0).abs() < 1e-3,
        "{}",
        state.v[0] - before
    );
}

#[test]
fn a_joint_that_turns_again_and_again_does_not_stop_the_others() {
    let mut plant = arm(Law::Coulomb);
    // gravity moves it, and what it meets when it moves throws it back
    plant.added = vec![Added {
        joint: 1,
        shape: Shape::Coupling { other: 1 },
        size: 1e9,
    }];
    let mut s = plant.at_rest([0.3; JOINTS]);
    s.v[4] = 0.5;
    s.contact[4] = Contact::Slides(1.0);
    for _ in 0..20 {
        let before = s.q[4];
        plant.step(&mut s, &[0.0; JOINTS], 5e-5);
        assert!(s.q[4] > before || s.v[4] <= 0.0, "{} at {}", s.q[4], s.t);
    }
}
