//! The logs say what the machine did: their torque is what bodies and friction ask for along the motion, without a lag,
//! and noise and steps are as large as they are said to be.

use cft_ident_studies::chain::Joints;
use cft_ident_studies::chance::Chance;
use cft_ident_studies::drive::{CONTROLLERS, Controller, Run, Sensing};
use cft_ident_studies::lab::Lab;
use cft_ident_studies::machine::{DRIVES, Drive, Kind, LawKind, Machine};
use cft_ident_studies::path::{MOTIONS, Motion};
use cft_ident_studies::plant::Bodies;
use cft_ident_studies::signal::rms;

fn log(
    kind: Kind,
    drive: Drive,
    motion: Motion,
    controller: Controller,
    sensing: &Sensing,
) -> (Machine, Run) {
    let chance = &mut Chance::of("logs", 3);
    let machine = Machine::draw(kind, drive, LawKind::Coulomb, 0.0, chance);
    let mut lab = Lab::new(machine, controller, true, chance);
    lab.sensing = *sensing;
    let run = lab
        .course(motion, chance)
        .logged(&lab.machine, &lab.sensing, chance);
    (lab.machine, run)
}

const IDEAL: Sensing = Sensing {
    rate_hz: 1000.0,
    noise: 0.0,
    memory_s: None,
    counts: 1e12,
    delay_s: 0.0,
};

/// Share of each joint's torque that the true model, along the logged positions, does not give; rows near a
/// reversal of any joint are left out.
fn unexplained(machine: &Machine, run: &Run) -> Vec<f64> {
    let (n, kind) = (machine.plant.joints, machine.kind);
    let h = run.t[1] - run.t[0];
    let moving = |k: usize, i: usize| {
        let fast = 0.03 * machine.ranges[i].speed;
        run.speed[k - 8..=k + 8]
            .iter()
            .all(|v| v[i] * run.speed[k][i].signum() > fast)
    };
    let (mut left, mut whole) = (vec![Vec::new(); n], vec![Vec::new(); n]);
    for k in (500..run.t.len() - 500).filter(|&k| (0..n).all(|i| moving(k, i))) {
        let v: Joints = std::array::from_fn(|i| (run.q[k + 1][i] - run.q[k - 1][i]) / (2.0 * h));
        let a: Joints = std::array::from_fn(|i| {
            (run.q[k + 1][i] - 2.0 * run.q[k][i] + run.q[k - 1][i]) / (h * h)
        });
        let bodies = match &machine.chain {
            // an elastic drive's inertia is the motor's, which the plant's own chain does not have
            Some(chain) => Bodies::Chain(chain.clone()),
            None if kind == Kind::Single => Bodies::Single {
                inertia: machine.inertia[0],
                weight: 0.0,
                phase: 0.0,
            },
            None => machine.plant.bodies.clone(),
        };
        let bodies = bodies.inverse(&run.q[k], &v, &a);
        for i in 0..n {
            let friction = machine.plant.friction[i].lasting(v[i]);
            left[i].push(run.tau[k][i] - bodies[i] - friction - machine.plant.offset[i]);
            whole[i].push(run.tau[k][i]);
        }
    }
    assert!(left[0].len() > 100, "{} rows", left[0].len());
    (0..n).map(|i| rms(&left[i]) / rms(&whole[i])).collect()
}

#[test]
fn the_logged_torque_is_what_the_motion_asks_for() {
    for (kind, drive) in [
        (Kind::Single, Drive::Direct),
        (Kind::Single, Drive::BallScrew),
        (Kind::Arm3, Drive::Direct),
        (Kind::Scara, Drive::BallScrew),
        (Kind::Arm6, Drive::Direct),
        (Kind::Cft, Drive::Direct),
    ] {
        let all = if kind == Kind::Single {
            &CONTROLLERS[..]
        } else {
            &CONTROLLERS[2..3]
        };
        for &controller in all {
            let motion = if kind == Kind::Arm6 {
                Motion::SlowSines
            } else {
                Motion::FastSines
            };
            let (machine, run) = log(kind, drive, motion, controller, &IDEAL);
            let shares = unexplained(&machine, &run);
            let worst = shares.iter().copied().fold(0.0, f64::max);
            assert!(worst < 2e-3, "{kind:?} {controller:?} {shares:?}");
        }
    }
}

#[test]
fn an_elastic_drive_leaves_little_below_its_frequency() {
    for kind in [Kind::Single, Kind::Arm3] {
        let (machine, run) = log(
            kind,
            Drive::Harmonic,
            Motion::SlowSines,
            Controller::FeedForward,
            &IDEAL,
        );
        let shares = unexplained(&machine, &run);
        assert!(
            shares.iter().all(|s| *s > 1e-6 && *s < 0.15),
            "{kind:?} {shares:?}"
        );
    }
}

#[test]
fn noise_and_counts_are_as_they_are_said_to_be() {
    let sensing = Sensing {
        rate_hz: 250.0,
        noise: 0.02,
        memory_s: Some(0.03),
        counts: 4096.0,
        delay_s: 0.0,
    };
    let (machine, run) = log(
        Kind::Arm3,
        Drive::Direct,
        Motion::SlowSines,
        Controller::Pd,
        &sensing,
    );
    for i in 0..3 {
        let noise: Vec<f64> = run
            .tau
            .iter()
            .zip(&run.clean)
            .map(|(a, b)| a[i] - b[i])
            .collect();
        let clean: Vec<f64> = run.clean.iter().map(|a| a[i]).collect();
        let share = rms(&noise) / rms(&clean);
        assert!((share - 0.02).abs() < 0.002, "{share}");
        let step = machine.step(i, 4096.0);
        assert!(
            run.q
                .iter()
                .all(|q| ((q[i] / step).round() * step - q[i]).abs() < 1e-9)
        );
    }
}

#[test]
fn the_same_seed_gives_the_same_log_and_every_machine_keeps_its_range() {
    let singles = DRIVES
        .into_iter()
        .flat_map(|d| MOTIONS.map(|m| (Kind::Single, d, m)));
    let arms = [
        (Kind::Arm3, Drive::Direct, Motion::Ladder),
        (Kind::Scara, Drive::BallScrew, Motion::HandLed),
    ];
    for (kind, drive, motion) in singles.chain(arms) {
        let (machine, run) = log(kind, drive, motion, Controller::Pid, &IDEAL);
        for (i, range) in machine.ranges.iter().enumerate() {
            let far = run
                .q
                .iter()
                .map(|q| (q[i] - range.centre).abs())
                .fold(0.0, f64::max);
            assert!(
                far < 1.6 * range.half,
                "{kind:?} {drive:?} {motion:?} {i} {far}"
            );
        }
    }
    let once = || {
        log(
            Kind::Arm3,
            Drive::Direct,
            Motion::HandLed,
            Controller::Slow,
            &IDEAL,
        )
        .1
    };
    let (a, b) = (once(), once());
    assert!(a.tau == b.tau && a.q == b.q);
}
