//! Serial chains from the robot files that come with the tool: base parameters, and the parts of a
//! file that can be wrong.

use std::path::Path;

use cft_ident_core::robot::Robot;
use cft_ident_files::config::RobotFile;

fn serial(file: &str) -> Robot {
    RobotFile::load(Path::new(file)).unwrap().robot()
}

/// The file's text with one part replaced, and the error that this gives.
fn refused(file: &str, old: &str, new: &str) -> String {
    let text = std::fs::read_to_string(format!("{}/{file}", cft_ident_support::ROOT)).unwrap();
    assert!(text.contains(old), "{old}");
    let error = RobotFile::parse("robot.toml", &text.replacen(old, new, 1));
    error.expect_err("a file that is wrong").to_string()
}

#[test]
fn the_panda_has_the_43_base_parameters_of_its_publication() {
    let robot = serial("configs/panda.toml");
    assert_eq!(robot.parameters().len(), 43);
    let meaning = |name: &str| {
        let found = robot.parameters().iter().find(|p| p.name == name);
        found.map(|p| p.meaning.to_string()).unwrap_or_default()
    };
    // the groupings of Khalil and Dombre, by hand: masses of links 3..7 hang at d3 = 0.316 m
    assert_eq!(
        meaning("my2"),
        "my2 - mz3 - 0.316 m3 - 0.316 m4 - 0.316 m5 - 0.316 m6 - 0.316 m7"
    );
    assert_eq!(meaning("mx6"), "mx6 + 0.088 m7");
    assert_eq!(meaning("Izz7"), "Izz7");
}

#[test]
fn six_axes_with_drives_have_36_base_parameters_and_four_drives_of_their_own() {
    for file in ["configs/tx40.toml", "configs/ur10.toml"] {
        let robot = serial(file);
        let names: Vec<&str> = robot.parameters().iter().map(|p| &*p.name).collect();
        let drives = names.iter().filter(|n| n.starts_with("Ia")).count();
        // 40 in all: the first drive turns with the first link, the second with the second
        assert_eq!((names.len(), drives), (40, 4), "{file}: {names:?}");
    }
}

#[test]
fn the_grouping_is_the_same_every_time() {
    assert_eq!(serial("configs/ur10.toml"), serial("configs/ur10.toml"));
}

#[test]
fn what_is_no_chain_is_refused_with_the_line_and_the_way_out() {
    let panda = "configs/panda.toml";
    let twice = refused(panda, "joint = \"q2\"", "joint = \"q1\"");
    assert!(
        twice.contains("robot.toml:13: `robot.link.1.joint`"),
        "{twice}"
    );
    assert!(twice.contains("moves another link too"), "{twice}");
    let unknown = refused(
        panda,
        "joint = \"q7\"",
        "follows = { linear = { q9 = 1.0 } }",
    );
    assert!(unknown.contains("no independent joint"), "{unknown}");
    let parent = refused(
        panda,
        "joint = \"q3\"",
        "joint = \"q3\"\nparent = \"link_5\"",
    );
    assert!(parent.contains("is no link before this one"), "{parent}");
    let both = refused(panda, "a = 0.088", "a = 0.088\nxyz = [0.0, 0.0, 1.0]");
    assert!(both.contains("Denavit-Hartenberg"), "{both}");
    let axis = refused(panda, "d = 0.333", "axis = [0.0, 0.0, 0.0]");
    assert!(axis.contains("has no length"), "{axis}");
    let endless = refused(panda, "d = 0.333", "d = inf");
    assert!(endless.contains("give finite numbers"), "{endless}");
    // as `new` leaves it where it knows no table
    let nothing = refused(panda, "d = 0.333", "d = nan");
    assert!(nothing.contains("is not filled in yet"), "{nothing}");
    let foreign = refused(panda, "drive_inertia = false", "setup = \"tuedacs\"");
    assert!(foreign.contains("setup"), "{foreign}");
}
