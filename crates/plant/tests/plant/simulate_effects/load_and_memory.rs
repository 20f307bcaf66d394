//! Effects of load, memory and timing: against the balance of torques and against exact solutions.

use cft_ident_core::robot::cft::LaboratorySetup;
use cft_ident_plant::simulate::effects::RobotSites;
use cft_ident_plant::simulate::{CftTruth, SimulatedRun};

use super::missing::{Row, assert_missing, axis, friction, missing, pushed, rigid, row, table_3};

fn at(joint: usize, torque: f64) -> [f64; 4] {
    std::array::from_fn(|i| if i == joint { torque } else { 0.0 })
}

#[test]
fn load_effects_take_their_share_of_the_rigid_body_torque() {
    assert_missing(
        "load-friction:q5:mu_c=0.08,mu_v=0.05,w=80",
        0.0,
        1e-10,
        |_, state| {
            let (load, v) = (rigid(state)[3], state.1[3]);
            at(3, (0.08 + 0.05 * v.abs()) * load.abs() * (80.0 * v).tanh())
        },
    );
    assert_missing("drive-efficiency:q4:k=0.25", 0.05, 1e-7, |_, state| {
        let load = rigid(state)[2];
        at(
            2,
            if load * state.1[2] > 0.0 {
                0.25 * load
            } else {
                0.0
            },
        )
    });
    let acting = |state: &Row, joint: usize| rigid(state)[joint] + friction(&state.1)[joint];
    assert_missing("gain:q2:k=-0.15", 0.0, 1e-10, |_, state| {
        at(1, -0.15 * acting(state, 1))
    });
    assert_missing(
        "gain-change:q2:signal=1,scale=2,k=0.2",
        0.0,
        1e-10,
        |t, state| at(1, 0.2 * (1.0 - (-t / 2.0).exp()) * acting(state, 1)),
    );
    assert_missing(
        "gain-change:q4:signal=2,scale=9,k=0.3",
        0.0,
        1e-9,
        |_, state| {
            let torque = acting(state, 2);
            at(2, 0.3 * (1.0 - (-torque.abs() / 9.0).exp()) * torque)
        },
    );
    assert_missing(
        "torque-ripple:q5:order=7,sin=0.06,cos=-0.02",
        0.0,
        1e-9,
        |_, state| {
            let angle = 7.0 * state.0[3];
            at(
                3,
                (0.06 * angle.sin() - 0.02 * angle.cos()) * acting(state, 3),
            )
        },
    );
}

#[test]
fn load_effects_on_one_joint_add_up() {
    let recording = table_3(&["load-friction:q5:mu_c=0.08,w=80", "gain:q5:k=0.1"]);
    let mut worst = 0.0_f64;
    for k in 0..recording.rows() {
        let state = row(&recording, k);
        let (load, v) = (rigid(&state)[3], state.1[3]);
        let acting = load + friction(&state.1)[3] + 0.08 * load.abs() * (80.0 * v).tanh();
        worst = worst.max((recording.actual.torque[k][3] - 1.1 * acting).abs());
    }
    assert!(worst < 1e-9, "{worst}");
}

/// Rows that lie inside the play at least `margin` from either end, and outside it, with their speeds.
fn play(recording: &SimulatedRun<4>, joint: usize, gap: f64) -> Vec<Option<bool>> {
    let positions = recording.actual.q.iter().map(|q| q[joint]);
    let mut centre = recording.actual.q[0][joint];
    let inside = positions.map(|q| {
        centre = centre.clamp(q - 0.5 * gap, q + 0.5 * gap);
        let to_contact = 0.5 * gap - (q - centre).abs();
        if to_contact > 0.05 * gap {
            Some(true)
        } else if to_contact < 1e-9 * gap {
            Some(false)
        } else {
            None
        }
    });
    inside.collect()
}

#[test]
fn backlash_takes_friction_away_for_a_fixed_distance_after_each_reversal() {
    let (gap, c) = (0.02, 1.5);
    let recording = table_3(&["backlash:q4:gap=0.02,c=1.5"]);
    let (mut inside, mut outside, mut spans) = (0, 0, 0);
    let mut was_inside = false;
    for (k, place) in play(&recording, 2, gap).into_iter().enumerate() {
        let v = recording.actual.v[k][2];
        let missing = missing(&recording, k)[2];
        match place {
            Some(true) if v.abs() > 0.05 => {
                inside += 1;
                spans += usize::from(!was_inside);
                was_inside = true;
                assert!(
                    (missing + c * v.signum()).abs() < 1e-6,
                    "row {k}: {missing}"
                );
            }
            // A row after the turn the play's end between two rows is not known.
            Some(false) if k > 1 && v * recording.actual.v[k - 2][2] > 0.0 => {
                outside += 1;
                was_inside = false;
                assert!(missing.abs() < 1e-9, "row {k}: {missing}");
            }
            _ => {}
        }
    }
    assert!(
        inside > 100 && outside > 3000 && spans >= 4,
        "{inside} rows in {spans} gaps, {outside} rows beyond"
    );
}

#[test]
fn presliding_bristles_obey_their_equation_over_position() {
    let (sigma, level) = (2000.0, 7.0 - 2.5);
    let recording = table_3(&["presliding:q4:sigma0=2000"]);
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    // All that opposes the joint beyond viscous friction is sigma0 z.
    let bristles: Vec<f64> = (0..recording.rows())
        .map(|k| {
            let v = recording.actual.v[k][2];
            let law = truth.friction[2];
            (missing(&recording, k)[2] + law.torque(v) - law.viscous * v) / sigma
        })
        .collect();
    let (mut worst, mut turned, mut checked) = (0.0_f64, 0, 0);
    for k in 1..recording.rows() {
        let (before, here) = (recording.actual.v[k - 1][2], recording.actual.v[k][2]);
        assert!((sigma * bristles[k]).abs() < level * (1.0 + 1e-6));
        if before * here <= 0.0 {
            turned += 1;
            continue;
        }
        let travel = recording.actual.q[k][2] - recording.actual.q[k - 1][2];
        let slipping = here.signum() * level / sigma;
        let expected =
            slipping + (bristles[k - 1] - slipping) * (-(sigma / level) * travel.abs()).exp();
        worst = worst.max((bristles[k] - expected).abs());
        checked += 1;
    }
    println!("presliding: {worst:.1e} rad over {checked} rows");
    assert!(turned >= 4 && checked > 4000, "{turned}, {checked}");
    assert!(worst < 1e-7 * level, "{worst}");
}

#[test]
fn damped_bristles_add_their_rate() {
    // A constant push below the level: the joint comes to rest where sigma0 z carries it.
    let (recording, missing) =
        pushed(&axis(), &["presliding:q1:sigma0=2e5,sigma1=400"]).expect("runs");
    let moving = (0..recording.rows()).filter(|&k| recording.actual.v[k][0].abs() > 0.05);
    let mut rows = 0;
    for k in moving {
        // Full slip: the level is that of the law it replaced.
        let v = recording.actual.v[k][0];
        assert!(missing[k].abs() < 45.0, "{} at v = {v}", missing[k]);
        rows += 1;
    }
    assert!(rows > 1000, "{rows}");
    let last = recording.rows() - 1;
    assert!(recording.actual.q[last][0].is_finite());
}

#[test]
fn elastic_joints_deflect_by_what_the_link_needs() {
    let stiffness = 9000.0;
    let recording = table_3(&["elasticity:q5:stiffness=9000"]);
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let plant = truth.plant().expect("a pose");
    let sites = RobotSites::of(&plant).expect("physical");
    let site = &sites.joints[3];
    let rotor = (0.2 * site.inertia).min(0.3 * site.least_inertia);
    let damping = 2.0 * 0.025 * (stiffness * (site.inertia - rotor)).sqrt();
    // The encoder sits on the motor.
    let deflection: Vec<f64> = (recording.q.iter().zip(&recording.actual.q))
        .map(|(motor, link)| motor[3] - link[3])
        .collect();
    let (mut squares, mut errors) = (0.0, 0.0);
    for (before, around) in deflection.windows(5).enumerate() {
        let state = row(&recording, before + 2);
        let needed = rigid(&state)[3] - rotor * state.2[3];
        let rate = (8.0 * (around[3] - around[1]) - (around[4] - around[0])) / 12e-3;
        squares += needed * needed;
        errors += (needed - stiffness * around[2] - damping * rate).powi(2);
    }
    let share: f64 = (errors / squares).sqrt();
    println!("elasticity: the spring carries the link but for {share:.1e}");
    assert!(share < 1e-3, "{share}");
    let largest = deflection.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(largest > 5e-4, "{largest}");
    // What the motor gives is the friction of its own side and what its inertia and the spring need.
    let others = missing(&recording, 4000);
    assert!(
        others[0].abs() < 1e-9 && others[1].abs() < 1e-9,
        "{others:?}"
    );
}

#[test]
fn a_stiff_spring_gives_the_rigid_joint_back() {
    let rigid = pushed(&axis(), &[]).expect("runs").0;
    let stiff = pushed(&axis(), &["elasticity:q1:stiffness=4e10"])
        .expect("runs")
        .0;
    let soft = pushed(&axis(), &["elasticity:q1:stiffness=4e5"])
        .expect("runs")
        .0;
    let apart = |other: &SimulatedRun<1>| {
        let pairs = rigid.q.iter().zip(&other.q);
        pairs.fold(0.0_f64, |most, (a, b)| most.max((a[0] - b[0]).abs()))
    };
    println!(
        "elasticity: {:.1e} m stiff, {:.1e} m soft",
        apart(&stiff),
        apart(&soft)
    );
    assert!(apart(&stiff) < 1e-6, "{}", apart(&stiff));
    assert!(apart(&soft) > 1e-4, "{}", apart(&soft));
}

#[test]
fn the_spring_of_a_single_joint_rings_at_its_own_frequency() {
    // The motor's side 0.2 m and the link's 0.8 m on the spring: w^2 = K (1/0.2 + 1/0.8)/m.
    let (recording, _) = pushed(&axis(), &["elasticity:q1:stiffness=3e6"]).expect("runs");
    let deflection: Vec<f64> = (0..recording.rows())
        .map(|k| recording.q[k][0] - recording.actual.q[k][0])
        .collect();
    let frequency = (3e6 / 95.0 * (1.0 / 0.2 + 1.0 / 0.8_f64)).sqrt();
    // After a jump of the volts: second differences leave the ringing, and its zeros tell the time.
    let bends: Vec<f64> = deflection[1201..1270]
        .windows(3)
        .map(|w| w[0] - 2.0 * w[1] + w[2])
        .collect();
    let crossings: Vec<f64> = bends
        .windows(2)
        .enumerate()
        .filter(|(_, w)| w[0] * w[1] < 0.0)
        .map(|(k, w)| k as f64 - w[0] / (w[1] - w[0]))
        .collect();
    let count = crossings.len();
    assert!(count > 6, "{count}");
    let half = (crossings[count - 1] - crossings[0]) / (count - 1) as f64 * 1e-3;
    let found = std::f64::consts::PI / half;
    assert!(
        (found / frequency - 1.0).abs() < 0.05,
        "{found} for {frequency} rad/s"
    );
}
