//! Faults of the set-up, a few of the bench's (`examples/study_setup`) on measured machines: each is named with
//! its kind and joint by `inspect`, and nothing is said of what is right.

#[path = "../examples/study_setup/bench/mod.rs"]
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
