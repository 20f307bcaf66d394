//! Torques that are functions of the state, against their formulas at the true motion.

use std::f64::consts::TAU;

use cft_ident_core::robot::cft::links::{PseudoInertia, base_parameters};
use cft_ident_core::robot::cft::pantograph::references_of_joints;
use cft_ident_core::robot::cft::{LaboratorySetup, linkage, regressor};
use cft_ident_core::robot::standard::{Body, pseudo_inertia};
use cft_ident_core::robot::tree::pose::{self, Frame};
use cft_ident_core::robot::tree::space::{add, turn};
use cft_ident_plant::simulate::CftTruth;
use cft_ident_plant::simulate::cft::effects;
use cft_ident_plant::simulate::effects::PlantEffects;
use cft_ident_plant::simulate::moving::MovingPlant;

use super::missing::{Row, assert_missing, axis, pushed, specs, table_3};

const EXACT: f64 = 1e-10;
/// Speed beyond which every smooth sign is a sign, and what is left of its smoothness there.
const MOVING: f64 = 0.05;
const SIGN: f64 = 1e-9;

fn at(joint: usize, torque: f64) -> [f64; 4] {
    std::array::from_fn(|i| if i == joint { torque } else { 0.0 })
}

#[test]
fn offset_ripple_and_spring_follow_their_formulas_at_every_row() {
    assert_missing("torque-offset:q4:c=2", 0.0, EXACT, |_, _| at(2, 2.0));
    assert_missing(
        "ripple:q1:order=3,sin=4,cos2=2",
        0.0,
        EXACT,
        |_, (q, ..)| {
            let angle = 3.0 * TAU * q[0];
            at(0, 4.0 * angle.sin() + 2.0 * (2.0 * angle).cos())
        },
    );
    assert_missing("spring:q2:k=3,q0=0.2,k3=5", 0.0, EXACT, |_, (q, ..)| {
        let x = q[1] - 0.2;
        at(1, 3.0 * x + 5.0 * x * x * x)
    });
    assert_missing("weight:q4:sin=2,cos=-3", 0.0, EXACT, |_, (q, ..)| {
        at(2, 2.0 * q[2].sin() - 3.0 * q[2].cos())
    });
}

#[test]
fn a_counterbalance_supplies_the_slope_of_its_spring_energy() {
    let energy = |q: f64| {
        let length = (0.16 + 0.01 - 2.0 * 0.4 * 0.1 * (q - 0.5_f64).cos()).sqrt();
        0.5 * 80.0 * (length - 0.2_f64).powi(2)
    };
    assert_missing(
        "counterbalance:q4:stiffness=80,free_length=0.2,a=0.4,b=0.1,angle=0.5",
        0.0,
        1e-8,
        |_, (q, ..)| at(2, (energy(q[2] + 1e-5) - energy(q[2] - 1e-5)) / 2e-5),
    );
}

#[test]
fn a_found_moment_is_a_cubic_spline_over_the_travel() {
    // A B-spline whose coefficients are those of q^2: c_i = x_i^2 - 1/3 at the knots' middles, in pieces.
    let (from, piece) = (-1.4, 0.3);
    let list: Vec<String> = (0..6)
        .map(|i| {
            let x = f64::from(i) - 1.0;
            format!("m_{}={}", i + 1, x * x - 1.0 / 3.0)
        })
        .collect();
    let text = format!("counterbalance:q4:from={from},to=-0.5,{}", list.join(","));
    assert_missing(&text, 0.0, 1e-9, |_, (q, ..)| {
        let x = ((q[2] - from) / piece).clamp(0.0, 3.0);
        at(2, x * x)
    });
}

#[test]
fn friction_beyond_the_declared_law_follows_its_formula_where_the_joint_moves() {
    assert_missing(
        "asymmetric-friction:q1:coulomb=3,viscous=20",
        0.001,
        SIGN,
        |_, (_, v, _)| at(0, if v[0] > 0.0 { 3.0 + 20.0 * v[0] } else { 0.0 }),
    );
    assert_missing("stribeck:q5:c=1.5,vs=0.2", MOVING, SIGN, |_, (_, v, _)| {
        at(3, 1.5 * v[3].signum() * (-(v[3] / 0.2).powi(2)).exp())
    });
    assert_missing(
        "nonlinear-viscous:q2:c=2,p=1.7",
        0.0,
        EXACT,
        |_, (_, v, _)| at(1, 2.0 * v[1].signum() * v[1].abs().powf(1.7)),
    );
    // The root is smooth within 1/w of rest, and a ten thousandth off at a hundred times that.
    assert_missing(
        "nonlinear-viscous:q2:c=2,p=0.5",
        MOVING,
        1e-3,
        |_, (_, v, _)| at(1, 2.0 * v[1].signum() * v[1].abs().sqrt()),
    );
    assert_missing(
        "position-friction:q4:order=3,sin=0.6,cos=-0.4",
        MOVING,
        SIGN,
        |_, (q, v, _)| {
            let angle = 3.0 * q[2];
            at(2, v[2].signum() * (0.6 * angle.sin() - 0.4 * angle.cos()))
        },
    );
}

#[test]
fn friction_that_another_pose_sets_follows_the_other_position_and_its_own_direction() {
    assert_missing(
        "pose-friction:q4:from=2,order=2,sin=0.8,cos=-0.5",
        MOVING,
        SIGN,
        |_, (q, v, _)| {
            let angle = 2.0 * q[1];
            at(2, v[2].signum() * (0.8 * angle.sin() - 0.5 * angle.cos()))
        },
    );
    // of a slide the order is per metre
    assert_missing(
        "pose-friction:q2:from=1,order=1.5,sin=0.8",
        MOVING,
        SIGN,
        |_, (q, v, _)| at(1, v[1].signum() * 0.8 * (1.5 * TAU * q[0]).sin()),
    );
}

#[test]
fn friction_at_a_screw_is_its_force_times_the_slope_of_the_screw_position() {
    let screw = |q: &[f64; 4], row: usize| {
        let (x, y) = references_of_joints(q[2], q[3]);
        [x, y][row]
    };
    for (row, name) in ["x_r", "y_r"].into_iter().enumerate() {
        let text = format!("actuator-friction:{name}:viscous=300,coulomb=20,slope=500");
        assert_missing(&text, 0.0, 1e-7, |_, (q, v, _)| {
            let slope = |joint: usize| {
                let (mut up, mut down) = (*q, *q);
                up[joint] += 1e-5;
                down[joint] -= 1e-5;
                (screw(&up, row) - screw(&down, row)) / 2e-5
            };
            let to = [slope(2), slope(3)];
            let speed = to[0] * v[2] + to[1] * v[3];
            let force = 300.0 * speed + 20.0 * (500.0 * speed).tanh();
            [0.0, 0.0, to[0] * force, to[1] * force]
        });
    }
}

#[test]
fn time_dependent_torques_follow_their_formulas() {
    assert_missing("drift:q1:c=1.5", 0.0, EXACT, |t, _| at(0, 1.5 * t));
    assert_missing("warm-up:q1:k=-0.3,T=2", 0.0, EXACT, |t, (_, v, _)| {
        let law = CftTruth::synthetic(LaboratorySetup::Tuedacs).friction[0];
        at(0, -0.3 * (1.0 - (-t / 2.0).exp()) * law.torque(v[0]))
    });
    assert_missing("settling-drift:q4:level=2,T=1.3", 0.0, EXACT, |t, _| {
        at(2, 2.0 * (1.0 - (-t / 1.3).exp()))
    });
    assert_missing(
        "disturbance:q2:at=1.2345,seconds=0.5,c=4",
        0.0,
        EXACT,
        |t, _| {
            at(
                1,
                if (1.2345..1.7345).contains(&t) {
                    4.0
                } else {
                    0.0
                },
            )
        },
    );
}

#[test]
fn a_random_walk_has_its_rms_and_belongs_to_the_seed() {
    let recording = table_3(&["drift:q1:walk=2", "drift:q2:walk=1"]);
    let walk: Vec<[f64; 4]> = (0..recording.rows())
        .map(|k| super::missing::missing(&recording, k))
        .collect();
    // Steps over 10 ms have the rms walk sqrt(0.01 s).
    for (joint, rms) in [(0, 0.2), (1, 0.1)] {
        let steps: Vec<f64> = (0..499)
            .map(|k| walk[10 * k + 10][joint] - walk[10 * k][joint])
            .collect();
        let found = (steps.iter().map(|x| x * x).sum::<f64>() / 499.0).sqrt();
        assert!((found / rms - 1.0).abs() < 0.15, "joint {joint}: {found}");
    }
    let ratio = (walk[4000][0] / walk[4000][1], walk[3000][0] / walk[3000][1]);
    assert!((ratio.0 - ratio.1).abs() > 1e-3, "joints walk on their own");
    let again = table_3(&["drift:q1:walk=2", "drift:q2:walk=1"]);
    assert_eq!(recording, again);
}

#[test]
fn a_coupling_acts_on_its_own_joint_and_follows_the_other() {
    assert_missing(
        "coupling:q4:from=4,viscous=1.5,coulomb=0.6,inertia=0.03,r=2",
        MOVING,
        1e-4,
        |_, (_, v, a)| {
            let together = v[2] + 2.0 * v[3];
            // Where the sum of the speeds changes sign the sign is smooth.
            let sign = if together.abs() < 0.05 {
                f64::NAN
            } else {
                together.signum()
            };
            at(2, 1.5 * v[3] + 0.6 * sign + 0.03 * a[3])
        },
    );
    // wired the other way about, all of it turns with r
    assert_missing(
        "coupling:q4:from=4,viscous=1.5,inertia=0.03,coulomb_from=0.4,r=-1",
        MOVING,
        1e-4,
        |_, (_, v, a)| {
            let sign = if v[3].abs() < 0.05 {
                f64::NAN
            } else {
                v[3].signum()
            };
            at(2, -1.5 * v[3] - 0.4 * sign - 0.03 * a[3])
        },
    );
}

/// Regressor of the full chain, which is derived apart from M and C.
fn full(state: &Row, theta: &[f64; 22]) -> [f64; 4] {
    let mut y = [[0.0; 22]; 4];
    regressor::regressor22(&state.0, &state.1, &state.2, &mut y);
    y.map(|row| row.iter().zip(theta).map(|(y, t)| y * t).sum())
}

#[test]
fn rigid_body_terms_are_the_columns_that_the_printed_structure_drops() {
    let mut theta = [0.0; 22];
    (theta[12], theta[17], theta[20]) = (-0.02, 0.06, 0.04);
    assert_missing(
        "rigid-body-terms:BB=-0.02,S=0.06,OA=0.04",
        0.0,
        1e-9,
        |_, state| full(state, &theta),
    );
}

fn of_body(body: &Body) -> PseudoInertia {
    PseudoInertia(pseudo_inertia(&body.standard()).into())
}

#[test]
fn a_payload_is_a_point_mass_on_the_last_link() {
    let (mass, [mx, my, mz]) = (1.5, [0.6, -0.2, 0.15]);
    let nothing = PseudoInertia([[0.0; 4]; 4]);
    let mut links = [nothing; 8];
    links[7] = of_body(&Body {
        mass,
        centre: [mx / mass, my / mass, mz / mass],
        inertia: [0.0; 6],
    });
    let theta = base_parameters(&links);
    assert_missing(
        "payload:mass=1.5,mx=0.6,my=-0.2,mz=0.15",
        0.0,
        1e-9,
        |_, state| full(state, &theta),
    );
}

#[test]
fn rotor_inertia_is_felt_along_the_motor_motion() {
    assert_missing("rotor-inertia:q2:J=0.4", 0.0, 1e-9, |_, (_, _, a)| {
        at(1, 0.4 * a[1])
    });
    for (row, name) in ["x_r", "y_r"].into_iter().enumerate() {
        let text = format!("rotor-inertia:{name}:J=50");
        assert_missing(&text, 0.0, 1e-5, |_, (q, v, a)| {
            // The screw's position over a short time of constant acceleration.
            let screw = |t: f64, aside: [f64; 2]| {
                let moved = |i: usize| q[i] + v[i] * t + 0.5 * a[i] * t * t;
                let (x, y) = references_of_joints(moved(2) + aside[0], moved(3) + aside[1]);
                [x, y][row]
            };
            let h = 1e-4;
            let at = |t: f64| screw(t, [0.0; 2]);
            let acceleration = (at(h) - 2.0 * at(0.0) + at(-h)) / (h * h);
            let slope =
                |aside: [f64; 2]| (screw(0.0, aside) - screw(0.0, aside.map(|x| -x))) / 2e-5;
            let force = 50.0 * acceleration;
            [
                0.0,
                0.0,
                slope([1e-5, 0.0]) * force,
                slope([0.0, 1e-5]) * force,
            ]
        });
    }
}

#[test]
fn tilted_gravity_pulls_at_every_link_of_the_chain() {
    // Eight links with known masses; the potential by their frames, its slope by differences.
    let link = |number: usize| Body {
        mass: 0.8 + 0.3 * number as f64,
        centre: [0.03 * number as f64, 0.05 - 0.01 * number as f64, 0.02],
        inertia: [0.05, 0.0, 0.0, 0.06, 0.0, 0.07],
    };
    let links: [Body; 8] = std::array::from_fn(link);
    let truth = CftTruth {
        theta: base_parameters(&links.map(|link| of_body(&link))),
        ..CftTruth::synthetic(LaboratorySetup::Tuedacs)
    };
    let (gx, gy) = (0.7, -0.4);
    let potential = |q: &[f64; 4]| -> f64 {
        let frames = pose::frames(&linkage::chain().expect("a chain"), q);
        let pull = |(link, (rotation, origin)): (&Body, &Frame)| {
            let p = add(origin, &turn(rotation, &link.centre));
            -link.mass * (gx * p[0] + gy * p[1])
        };
        links.iter().zip(&frames).map(pull).sum()
    };
    let plant = truth.plant().expect("a pose");
    let load = |texts: &[&str], q: &[f64; 4]| {
        let (effects, _) = effects(&truth, &specs(texts)).expect("known");
        let moving = MovingPlant {
            plant: &plant,
            effects,
            volts: [0.0; 4],
        };
        moving.load(0.0, q, &[0.1, 0.2, 0.3, 0.4], &[])
    };
    for q in [[0.4, 0.3, -0.9, 1.9], [0.2, -1.2, -1.3, 1.2]] {
        let (with, without) = (load(&["gravity-tilt:gx=0.7,gy=-0.4"], &q), load(&[], &q));
        for i in 0..4 {
            let (mut up, mut down) = (q, q);
            up[i] += 1e-5;
            down[i] -= 1e-5;
            let slope = (potential(&up) - potential(&down)) / 2e-5;
            assert!(
                (with[i] - without[i] - slope).abs() < 1e-8,
                "joint {i}: {} for {slope}",
                with[i] - without[i]
            );
        }
    }
    // And in a log: a rail that leans along y needs a constant force.
    let recording = table_3(&["gravity-tilt:gx=0.2"]);
    let largest = |joint: usize| {
        let rows = (0..recording.rows()).map(|k| super::missing::missing(&recording, k)[joint]);
        rows.fold(0.0_f64, |most, x| most.max(x.abs()))
    };
    assert!(largest(0) < 1e-9 && largest(1) > 0.1, "{}", largest(1));
}

#[test]
fn a_single_joint_has_the_same_effects_where_they_have_a_place() {
    let truth = axis();
    let assert_axis = |text: &str, tolerance: f64, formula: &dyn Fn(f64, f64, f64) -> f64| {
        let (recording, missing) = pushed(&truth, &[text]).expect(text);
        let actual = &recording.actual;
        let mut worst = 0.0_f64;
        for (k, missing) in missing.iter().enumerate() {
            let (q, v, a) = (actual.q[k][0], actual.v[k][0], actual.a[k][0]);
            if v.abs() > 0.002 {
                worst = worst.max((missing - formula(q, v, a)).abs());
            }
        }
        assert!(worst < tolerance, "{text}: {worst}");
    };
    assert_axis("payload:mass=4", 1e-9, &|_, _, a| 4.0 * a);
    assert_axis("rotor-inertia:q1:J=4", 1e-9, &|_, _, a| 4.0 * a);
    assert_axis("gravity-tilt:gx=0.1", 1e-9, &|_, _, _| -9.5);
    assert_axis("spring:q1:k=30,q0=0.1", 1e-9, &|q, _, _| 30.0 * (q - 0.1));
    assert_axis("stribeck:q1:c=5,vs=0.05", 1e-6, &|_, v, _| {
        5.0 * v.signum() * (-(v / 0.05_f64).powi(2)).exp()
    });
    assert_axis("smooth-coulomb:q1:vs=0.02,fc=12", 1e-9, &|_, v, _| {
        12.0 * (v / 0.02).tanh() - (truth.friction.torque(v) - 200.0 * v)
    });
    // knots on a straight line
    assert_axis(
        "empirical:q1:signal=3,from=-1,to=1,m_1=-5,m_2=-3,m_3=-1,m_4=1,m_5=3,m_6=5",
        1e-9,
        &|_, v, _| 5.0 * v.clamp(-1.0, 1.0),
    );
    assert_axis("load-friction:q1:mu_c=0.1,w=5000", 1e-6, &|_, v, a| {
        0.1 * (95.0 * a).abs() * v.signum()
    });
    assert_axis("gain:q1:k=0.1", 1e-9, &|_, v, a| {
        0.1 * (95.0 * a - 3.0 + truth.friction.torque(v))
    });
}

#[test]
fn effects_of_nothing_are_not_there() {
    assert!(PlantEffects::default().is_empty());
    assert_eq!(table_3(&["spring:q2:k=0"]).rows(), 5000);
}
