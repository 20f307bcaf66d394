//! Servos that the simulator moves: what was planted is found, and nothing else.

use cft_ident_drive::drive::candidate::DriveEffect;
use cft_ident_drive::drive::identify::{DriveData, IdentifiedDrives, identify};
use cft_ident_drive::drive::law::{DriveLawKind, JointLaw, MachineLaw, ServoFirmware};
use cft_ident_drive::drive::outcome::DriveResult;
use cft_ident_drive::drive::read::bam::{RigGiven, read};
use cft_ident_drive::drive::roll_out::{FINE_STEP, roll_axis};
use cft_ident_drive::drive::track::DriveLog;
use cft_ident_plant::simulate::servo::{BenchMotion, ServoPlant, ServoRig, ServoRun, run_servo};

const RIG: ServoRig = ServoRig {
    mass: 0.6,
    arm_mass: 0.05,
    length: 0.15,
};

fn log(run: &ServoRun) -> DriveLog {
    let json = run.to_json();
    read(&run.file_name(), json.as_bytes(), &RigGiven::default()).unwrap()
}

fn logs(servo: &ServoPlant, gains: &[f64], seed: u64) -> Vec<DriveLog> {
    let runs = gains.iter().flat_map(|kp| {
        BenchMotion::ALL.map(|motion| log(&run_servo(servo, &RIG, motion, *kp, seed)))
    });
    runs.collect()
}

fn identified(servo: &ServoPlant, seed: u64) -> IdentifiedDrives {
    let data = DriveData {
        fitted: logs(servo, &[8.0, 32.0], seed),
        held_out: logs(servo, &[16.0], seed),
        links: None,
        kind: DriveLawKind::Volts(ServoFirmware::default()),
    };
    identify(&data, &|_| {}).unwrap()
}

/// The law that the simulator has.
fn truth(servo: &ServoPlant) -> MachineLaw {
    let per_volt = servo.kt / servo.resistance;
    let damping = servo.kt * per_volt + servo.viscous;
    MachineLaw {
        joints: vec![JointLaw {
            stiffness: servo.firmware_gain * servo.supply * per_volt,
            damping,
            viscous: servo.viscous,
            coulomb: servo.coulomb,
            armature: servo.armature,
            slowness: servo.speed_limit.map_or(0.0, |limit| 1.0 / limit),
            torque_max: servo.duty_max * servo.supply * per_volt,
            load_friction: servo.load_friction,
            stribeck_speed: 1.0,
            ..JointLaw::default()
        }],
        command_delay: servo.command_delay,
        loop_delay: servo.loop_delay,
        supply: Some(servo.supply),
    }
}

const LIMITED: ServoPlant = ServoPlant {
    speed_limit: Some(4.8),
    command_delay: 0.032,
    ..ServoPlant::HOBBY
};

#[test]
fn roll_outs_by_the_numbers_of_the_simulator_are_off_by_half_a_step_of_its_encoder() {
    let late = ServoPlant {
        loop_delay: 0.004,
        load_friction: 0.1,
        ..LIMITED
    };
    for servo in [ServoPlant::HOBBY, LIMITED, late] {
        for log in logs(&servo, &[8.0, 32.0], 3) {
            let mut out = vec![0.0; log.t.len()];
            let kind = DriveLawKind::Volts(ServoFirmware::default());
            roll_axis(&log, (kind, FINE_STEP), &truth(&servo), 0, &mut out);
            let pairs = out.iter().zip(&log.joints[0].position);
            let mean = pairs.map(|(a, b)| (a - b).abs()).sum::<f64>() / out.len() as f64;
            let step = std::f64::consts::TAU / servo.ticks;
            assert!(mean < 0.5 * step, "{} {mean}", log.name);
        }
    }
}

#[test]
fn rows_without_supply_or_with_a_wrong_sign_of_it_are_rolled_through() {
    let mut log = logs(&ServoPlant::HOBBY, &[8.0], 3).remove(0);
    log.joints[0].supply = vec![12.0; log.t.len()];
    log.joints[0].supply[3..6].copy_from_slice(&[0.0, -12.0, f64::NAN]);
    let mut law = truth(&ServoPlant::HOBBY);
    law.joints[0].torque_max = f64::INFINITY;
    let kind = DriveLawKind::Volts(ServoFirmware::default());
    let mut out = vec![0.0; log.t.len()];
    roll_axis(&log, (kind, FINE_STEP), &law, 0, &mut out);
    assert!(out.iter().all(|q| q.is_finite()));
}

#[test]
fn a_late_command_and_a_speed_limit_are_named_with_their_sizes() {
    let found = identified(&LIMITED, 5);
    let drives = DriveResult::new(&found);
    let mut named: Vec<DriveEffect> = drives
        .steps
        .iter()
        .filter(|s| s.written)
        .map(|s| s.effect)
        .collect();
    named.sort_by_key(|e| e.name());
    assert_eq!(named, [DriveEffect::CommandDelay, DriveEffect::SpeedLimit]);
    let delay = drives.find("command_delay", None).unwrap();
    assert!((delay - 0.032).abs() < 1e-3, "{delay}");
    let limit = drives.find("speed_limit", Some("servo")).unwrap();
    assert!((limit - 4.8).abs() < 0.05, "{limit}");
    let truth = &truth(&LIMITED).joints[0];
    for (name, expected) in [
        ("stiffness", truth.stiffness),
        ("damping", truth.damping),
        ("armature", truth.armature),
        ("torque_limit", truth.torque_max),
    ] {
        let value = drives.find(name, Some("servo")).unwrap();
        assert!(
            (value / expected - 1.0).abs() < 0.05,
            "{name} {value} {expected}"
        );
    }
    let (before, after) = (
        drives.before.holdout.unwrap(),
        drives.after.holdout.unwrap(),
    );
    assert!(after.mae < 0.2 * before.mae, "{} {}", before.mae, after.mae);
}

/// One log of one motion, as somebody has it who has no time for more.
fn of_one_log(servo: &ServoPlant, motion: BenchMotion, seed: u64) -> DriveResult {
    let data = DriveData {
        fitted: vec![log(&run_servo(servo, &RIG, motion, 16.0, seed))],
        held_out: Vec::new(),
        links: None,
        kind: DriveLawKind::Volts(ServoFirmware::default()),
    };
    DriveResult::new(&identify(&data, &|_| {}).unwrap())
}

/// The log begins in a jump, and its torque is at the limit for a few samples alone.
#[test]
fn one_log_tells_the_two_delays_apart_and_its_intervals_hold() {
    let (mut held, mut all) = (0, 0);
    for (seed, late) in [(1u64, 0.012), (2, 0.028)] {
        for (motion, of) in [BenchMotion::Places, BenchMotion::Sines]
            .into_iter()
            .flat_map(|motion| [true, false].map(|command| (motion, command)))
        {
            let servo = ServoPlant {
                armature: 0.01 * (1.0 + seed as f64),
                command_delay: if of { late } else { 0.0 },
                loop_delay: if of { 0.0 } else { late },
                ..ServoPlant::HOBBY
            };
            let found = of_one_log(&servo, motion, seed);
            let name = if of { "command_delay" } else { "loop_delay" };
            let truth = &truth(&servo).joints[0];
            for (name, expected) in [
                (name, late),
                ("stiffness", truth.stiffness),
                ("damping", truth.damping),
                ("armature", truth.armature),
                ("coulomb", truth.coulomb),
                ("torque_limit", truth.torque_max),
            ] {
                let own = found.parameters.iter().find(|p| p.name == name);
                let own = own.unwrap_or_else(|| panic!("{name}: {}", found.verdict.text));
                assert!(
                    (own.value / expected - 1.0).abs() < 0.05,
                    "{own:?} {expected}"
                );
                let [low, high] = own.interval_95.unwrap();
                held += usize::from(low <= expected && expected <= high);
                all += 1;
            }
        }
    }
    assert!(10 * held >= 8 * all, "{held} of {all}");
}

#[test]
fn a_servo_without_delay_and_without_limit_shows_none() {
    for seed in 0..3 {
        let servo = ServoPlant {
            coulomb: 0.05 + 0.04 * seed as f64,
            ..ServoPlant::HOBBY
        };
        let found = identified(&servo, seed);
        let named: Vec<_> = found.found.steps.iter().filter(|s| s.written()).collect();
        assert!(named.is_empty(), "{named:?}");
    }
}
