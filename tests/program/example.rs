//! The logs that come with the program: complete, small, those that were published, and fit to begin with.

use crate::measured_support;

use std::path::Path;

use assert_cmd::Command;
use measured_support::{run, shared};
use predicates::str::contains;

#[test]
fn every_example_is_written_with_its_origin_and_its_licence() {
    let folder = tempfile::tempdir().unwrap();
    let listed = run(folder.path(), &["example"]);
    let examples = listed["examples"].as_array().unwrap();
    assert_eq!(examples.len(), 7);
    for example in examples {
        let name = example["name"].as_str().unwrap();
        let found = run(folder.path(), &["example", name]);
        let files = found["written"]["files"].as_array().unwrap();
        // what is simulated needs no licence, and may need no robot
        let least = if example["licence"].is_string() { 4 } else { 2 };
        assert!(files.len() >= least, "{name}: {files:?}");
        for file in files {
            let path = folder.path().join(name).join(file.as_str().unwrap());
            assert!(path.metadata().unwrap().len() > 0, "{}", path.display());
        }
        if let Some(licence) = example["licence"].as_str() {
            let read = |file: &str| std::fs::read_to_string(folder.path().join(name).join(file));
            let origin = read("README.txt").unwrap();
            assert!(
                origin.contains(licence) && origin.contains("commit"),
                "{origin}"
            );
            assert!(read("LICENSE").unwrap().len() > 1000, "{name}");
        }
    }
}

#[test]
fn what_the_program_carries_is_below_3_mb() {
    let data = Path::new(cft_ident_support::ROOT).join("data");
    let sizes = std::fs::read_dir(data).unwrap().flat_map(|folder| {
        let folder = folder.unwrap().path();
        let files = std::fs::read_dir(folder).into_iter().flatten();
        files.map(|file| file.unwrap().metadata().unwrap().len())
    });
    let total: u64 = sizes.sum();
    assert!((1..3_000_000).contains(&total), "{total}");
}

#[test]
fn the_logs_are_the_published_ones_or_their_beginning() {
    let folder = tempfile::tempdir().unwrap();
    for (name, file, published) in [
        ("ur10", "ur10.csv", "ur10/ur10_exciting.csv"),
        ("ur10", "ur10.mcap", "ur10/ur10_exciting_trajectory.mcap"),
        ("tx40", "tx40.csv", "tx40/tx40_joint.csv"),
        ("bldc", "bldc.csv", "bldc-cogging/speed_test1.txt"),
    ] {
        let Some(published) = shared(published) else {
            continue;
        };
        run(folder.path(), &["example", name]);
        let ours = std::fs::read(folder.path().join(name).join(file)).unwrap();
        let theirs = std::fs::read(published).unwrap();
        assert!(theirs.starts_with(&ours) && ours.len() > 100_000, "{file}");
    }
}

#[test]
fn the_commands_that_an_example_names_work_as_they_stand() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["ur10", "bldc"] {
        let found = run(folder.path(), &["example", name]);
        for line in found["written"]["next"].as_array().unwrap() {
            let words: Vec<&str> = line.as_str().unwrap().split_whitespace().collect();
            run(folder.path(), &words[1..]);
        }
        assert!(folder.path().join("report.html").exists());
    }
}

#[test]
fn a_file_of_the_users_stays() {
    let folder = tempfile::tempdir().unwrap();
    let example = || {
        let mut tool = Command::cargo_bin("cft-ident").unwrap();
        tool.current_dir(folder.path()).args(["example", "bldc"]);
        tool
    };
    example().assert().code(0);
    // the same again is no loss
    example().assert().code(0);
    let robot = folder.path().join("bldc/bldc.toml");
    std::fs::write(&robot, "# mine\n").unwrap();
    example()
        .assert()
        .code(5)
        .stderr(contains("bldc.toml is there already"));
    assert_eq!(std::fs::read_to_string(robot).unwrap(), "# mine\n");
}
