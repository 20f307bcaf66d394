//! Faults of the set-up, a few of the bench's (`examples/study_setup`) on measured machines: each is named with
//! its kind and joint by `inspect`, and nothing is said of what is right.

#[path = "../../crates/studies/examples/study_setup/bench/mod.rs"]
mod bench;

use bench::faults::{Fault, Side};
use bench::judge::{heard, heard_of_right};
use bench::machines::{Machine, machine};
use bench::rows::Chance;
use rayon::prelude::*;

/// A measured machine; nothing where its log is not there.
fn measured(name: &str) -> Option<Machine> {
    // what is simulated is kept there, and these are measured
    machine(name, &std::env::temp_dir())
}

/// One fault of each kind, on joints and along directions that chance chooses: of the six joints the first four,
/// for the wrist of this arm moves its torques by less than a tenth.
fn chosen(seed: u64) -> Vec<Fault> {
    let mut chance = Chance(seed);
    let mut one_of = |n: usize| (chance.next() * n as f64) as usize;
    let mut out = vec![
        Fault::Sign(Side::Torque, vec![one_of(4)]),
        Fault::Sign(Side::Torque, (0..6).collect()),
        Fault::Sign(Side::Position, vec![one_of(4)]),
    ];
    for side in Side::ALL {
        let first = one_of(3);
        out.push(Fault::Exchange(side, first, first + 1));
    }
    out.push(Fault::Scale(
        Side::Torque,
        vec![one_of(3)],
        57.295_779_513_082_32,
    ));
    out.push(Fault::Zero(1 + one_of(2), 90.0));
    let across = [9.81, -9.81][one_of(2)];
    out.push(Fault::Gravity([across, 0.0, 0.0]));
    out
}

#[test]
fn a_fault_of_each_kind_is_named_with_its_kind_and_joint() {
    let Some(arm) = measured("ur10") else { return };
    let missed: Vec<String> = chosen(17)
        .par_iter()
        .filter_map(|fault| {
            let folder = tempfile::tempdir().expect("a folder");
            let heard = heard(&arm, fault, folder.path()).expect("the arm can have it");
            let told = heard.first || heard.tied;
            let right = heard.named && heard.right_joint && told;
            (!right).then(|| format!("{fault:?} {heard:?}"))
        })
        .collect();
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn the_turned_torque_of_one_axis_is_named_though_the_residual_is_the_same() {
    let Some(axis) = measured("emps") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let fault = Fault::Sign(Side::Torque, vec![0]);
    let heard = heard(&axis, &fault, folder.path()).expect("the axis can have it");
    assert!(heard.first && heard.right_joint, "{heard:?}");
}

#[test]
fn nothing_is_said_of_right_set_ups_and_of_their_spans() {
    let spans = [(0.0, 1.0), (0.0, 0.5), (0.5, 1.0)];
    for name in ["ur10", "emps"] {
        let Some(machine) = measured(name) else {
            continue;
        };
        spans.par_iter().for_each(|(from, to)| {
            let folder = tempfile::tempdir().expect("a folder");
            let said = heard_of_right(&machine.span(*from, *to), folder.path());
            assert!(said.is_empty(), "{name} {from}..{to}: {said:?}");
        });
    }
}

const MOTORS: [&str; 8] = ["x_c1", "x_c2", "x_c3", "x_c4", "u_1", "u_2", "u_3", "u_4"];

/// What `inspect` says of a log of the motors behind the pantograph whose channels are altered row by row.
fn said_of_motors(made: &str, alter: &dyn Fn(&mut [f64])) -> Vec<serde_json::Value> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut lines = made.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let place = |name: &&str| header.iter().position(|column| column == name);
    let places: Vec<usize> = MOTORS.iter().filter_map(place).collect();
    let mut out = format!("t,{}\n", MOTORS.join(","));
    for line in lines {
        let number = |at: &usize| line[*at].parse().expect("a number");
        let mut channels: Vec<f64> = places.iter().map(number).collect();
        alter(&mut channels);
        let written: Vec<String> = channels.iter().map(f64::to_string).collect();
        out += &format!("{},{}\n", line[0], written.join(","));
    }
    std::fs::write(folder.path().join("log.csv"), out).expect("the log is written");
    let done = bench::tool::run(
        folder.path(),
        &["inspect", "log.csv", "-r", "configs/cft.toml"],
    );
    bench::fit::rows(&done.document["setup"]).to_vec()
}

/// What is altered, and the kind, channel, joint and line that are reported.
type Case = (&'static dyn Fn(&mut [f64]), [&'static str; 4]);

#[test]
fn motors_whose_positions_are_no_poses_or_in_other_units_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let words = "simulate -r configs/cft.toml --seconds 20 --seed 5 -o made.csv";
    let done = bench::tool::run(folder.path(), &words.split(' ').collect::<Vec<_>>());
    assert_eq!(done.status, 0, "{}", done.message);
    let made = std::fs::read_to_string(folder.path().join("made.csv")).expect("it was written");
    assert!(said_of_motors(&made, &|_| {}).is_empty());
    let cases: [Case; 3] = [
        (
            &|x| x[1] = -x[1],
            ["sign", "position", "x_c2", "position_sign = -1"],
        ),
        (
            &|x| x[3] *= 1000.0,
            ["scale", "position", "x_c4", "position_unit = \"mm\""],
        ),
        (
            &|x| x[7] *= 1000.0,
            ["scale", "torque", "x_c4", "volts_scale = 0.001"],
        ),
    ];
    for (alter, [kind, channel, joint, remedy]) in cases {
        let said = said_of_motors(&made, alter);
        let entry = said.first().expect("something is said");
        let told = ["kind", "channel", "joint"].map(|key| entry[key].as_str());
        assert_eq!(told, [kind, channel, joint].map(Some), "{entry}");
        let told = entry["remedy"].as_str().expect("a line");
        assert!(told.contains(remedy), "{told}");
    }
}

/// What is said of the simulated arm under an altered robot file or log.
fn said_of_arm(alter: &dyn Fn(&mut Machine)) -> Vec<serde_json::Value> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut arm = machine("arm", folder.path()).expect("it is simulated");
    alter(&mut arm);
    heard_of_right(&arm, folder.path())
}

#[test]
fn a_base_that_leans_a_little_is_a_hint_that_names_the_command() {
    assert!(said_of_arm(&|_| {}).is_empty());
    let lean = 8.0_f64.to_radians();
    let said = said_of_arm(&|arm| {
        let gravity = [9.81 * lean.sin(), 0.0, -9.81 * lean.cos()];
        bench::robot_text::declare_gravity(&mut arm.robot, gravity);
    });
    let [hint] = &said[..] else {
        panic!("{said:?}");
    };
    assert_eq!(
        (&hint["severity"], &hint["kind"]),
        (&"hint".into(), &"gravity".into())
    );
    assert_eq!(hint["sure"], false);
    let found: Vec<f64> = hint["found"]
        .as_array()
        .expect("a vector")
        .iter()
        .filter_map(|x| x.as_f64())
        .collect();
    // as it is: upright to half a degree
    let off = found[0].hypot(found[1]).atan2(-found[2]).to_degrees();
    assert!(off < 0.5, "{hint}");
    let command = hint["remedy"].as_str().expect("a command");
    assert!(
        command.starts_with("cft-ident diagnose log1.csv -m"),
        "{command}"
    );
}

#[test]
fn torques_that_come_late_are_a_hint_with_their_delay() {
    let rows = 10;
    let said = said_of_arm(&|arm| {
        let log = &mut arm.logs[0];
        for joint in &arm.joints {
            let torque = log.column_mut(&joint.torque);
            torque.rotate_right(rows);
        }
        // what was rotated to the front is of the end
        let (t, all) = (log.columns[0].clone(), log.rows());
        log.retain(|k| k >= rows);
        assert_eq!((log.columns[0][0], log.rows()), (t[rows], all - rows));
    });
    let [hint] = &said[..] else {
        panic!("{said:?}");
    };
    assert_eq!(
        (&hint["severity"], &hint["kind"]),
        (&"hint".into(), &"delay".into())
    );
    let late = hint["found"].as_f64().expect("a number");
    let step = 1e-3;
    assert!((late / (rows as f64 * step) - 1.0).abs() < 0.1, "{hint}");
}
