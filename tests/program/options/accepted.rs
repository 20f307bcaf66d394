//! Every effect of the catalogue accepted, one by one and in pairs at one joint.

use std::fs;
use std::path::Path;

use cft_ident::config::ModelFile;
use cft_ident::effect::LAWS;

use super::{faults, run};
use crate::measured_support::shared;

/// A machine: its name, the log, the robot file, and a joint.
const MACHINES: [(&str, &str, &str, &str); 4] = [
    (
        "motor",
        "bldc-cogging/speed_test1.txt@15.2..23s",
        "configs/bldc.toml",
        "motor",
    ),
    ("emps", "emps/emps_id.csv@0..60%", "configs/emps.toml", "q1"),
    (
        "pendulum",
        "pendulum/055032.csv",
        "configs/pendulum.toml",
        "q2",
    ),
    (
        "ur10",
        "ur10/ur10_exciting.csv@0..40%",
        "configs/ur10.toml",
        "q3",
    ),
];

/// Sizes below which an effect is none: of what was printed with three digits beside the torque of the joint.
const NOTHING: f64 = 1e-12;

/// What is wrong with an end of `diagnose --accept ..`: a crash, an effect of no size, a model that nobody can read, one
/// that lacks what was asked for, one that fits worse than the one given.
fn fault(folder: &Path, log: &str, wanted: &[String], to: &str) -> Option<String> {
    let accepts: Vec<String> = wanted.iter().map(|w| format!("--accept {w}")).collect();
    let line = format!("diagnose {log} -m m.toml -o {to} {}", accepts.join(" "));
    let ended = run(folder, &line);
    let said = |what: &str| Some(format!("{line}: {what}: {}", ended.stderr));
    match ended.status {
        Some(0) => {}
        Some(2 | 4) => {
            let named = wanted
                .iter()
                .any(|w| ended.stderr.contains(w.split(':').next().unwrap()));
            let left = folder.join(to).exists();
            return match named && !left {
                true => None,
                false => said("refused without the effect's name, or written all the same"),
            };
        }
        _ => return said("a crash, or the status of something else"),
    }
    let shown = run(folder, &format!("show {to}"));
    if shown.status != Some(0) {
        return said(&format!("`show` refuses it: {}", shown.stderr));
    }
    let text = fs::read_to_string(folder.join(to)).unwrap();
    let file = ModelFile::parse(to, &text).unwrap();
    for one in wanted {
        let name = one.split(':').next().unwrap();
        let own = file
            .effects
            .iter()
            .find(|e| e.name == name && e.accepted_by_user);
        let Some(own) = own else {
            return said(&format!("{one} is not in the file"));
        };
        let law = LAWS.iter().find(|law| law.entry.name == name).unwrap();
        let sizes = own
            .parameters
            .iter()
            .filter(|(key, _)| law.linear.contains(&key.as_str()));
        let sizes: Vec<f64> = sizes.map(|(_, p)| p.value.abs()).collect();
        if !sizes.is_empty() && sizes.iter().all(|size| *size < NOTHING) {
            return said(&format!("{one} has no size"));
        }
    }
    let error = |model: &str| run(folder, &format!("validate {log} -m {model}")).error();
    let [before, after] = ["m.toml", to].map(error);
    match after <= 1.2 * before {
        true => None,
        false => said(&format!(
            "fits worse than the model given: {before} -> {after}"
        )),
    }
}

/// Every effect of the catalogue, at a joint and at none.
fn wishes(joint: &str) -> Vec<String> {
    let each = LAWS.iter().map(|law| law.entry.name);
    each.flat_map(|name| [name.to_owned(), format!("{name}:{joint}")])
        .collect()
}

/// A folder with a model of a machine, and its log.
fn fitted((_, log, robot, _): (&str, &str, &str, &str)) -> Option<(tempfile::TempDir, String)> {
    let log = shared(log)?.to_str().unwrap().to_owned();
    let folder = tempfile::tempdir().unwrap();
    super::done(folder.path(), &format!("lsq {log} -r {robot} -o m.toml"));
    Some((folder, log))
}

fn check(machine: (&str, &str, &str, &str), pairs: bool) {
    let Some((folder, log)) = fitted(machine) else {
        return;
    };
    let mut wanted: Vec<Vec<String>> = wishes(machine.3).into_iter().map(|w| vec![w]).collect();
    if pairs {
        // those that can be written alone
        let alone = |w: &Vec<String>| {
            let to = format!("{}.toml", w[0].replace(':', "-"));
            folder.path().join(to).exists()
        };
        let found = faults(&wanted, |w| {
            let to = format!("{}.toml", w[0].replace(':', "-"));
            fault(folder.path(), &log, w, &to)
        });
        assert!(found.is_empty(), "{found:#?}");
        let alone: Vec<String> = wanted
            .iter()
            .filter(|w| alone(w))
            .map(|w| w[0].clone())
            .collect();
        assert!(alone.len() > 1, "{alone:?}");
        let two = |i: usize| alone[..i].iter().map(move |a| (a, i));
        wanted = (0..alone.len())
            .flat_map(two)
            .map(|(a, i)| vec![a.clone(), alone[i].clone()])
            .collect();
    }
    let named: Vec<(usize, Vec<String>)> = wanted.into_iter().enumerate().collect();
    let found = faults(&named, |(i, wanted)| {
        fault(folder.path(), &log, wanted, &format!("r{i}.toml"))
    });
    assert!(
        found.is_empty(),
        "{} of {}: {found:#?}",
        found.len(),
        named.len()
    );
}

#[test]
fn every_effect_of_the_catalogue_accepted_on_a_motor_is_written_with_a_size_or_refused_by_name() {
    check(MACHINES[0], false);
}

#[test]
fn every_pair_of_accepted_effects_of_a_motor_is_written_or_refused_by_name() {
    check(MACHINES[0], true);
}

#[test]
#[ignore = "measured logs, some minutes; `cargo test -- --ignored`"]
fn every_effect_accepted_on_an_arm_and_every_pair_on_a_drive_and_a_pendulum_is_written_or_refused_by_name()
 {
    check(MACHINES[1], true);
    check(MACHINES[2], true);
    check(MACHINES[3], false);
}
