//! Configuration files: what comes with the tool is right, and what is wrong is reported with its line.

use std::path::Path;

use cft_ident_core::robot::cft::Setup;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::robot_file::{FilterKind, FrictionLawKind};
use cft_ident_files::config::trajectory::{Coordinates, Trajectory};
use cft_ident_files::config::{Campaign, ConfigError, EMBEDDED, RobotFile, embedded, text};
use proptest::prelude::*;

const SINGLE: &str = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"prismatic\"\n";
const CFT: &str = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n";

#[track_caller]
fn refused(result: Result<impl std::fmt::Debug, ConfigError>, words: &[&str]) {
    let message = result.expect_err("the file is wrong").to_string();
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in: {message}");
    }
    assert!(
        !message.chars().any(char::is_control),
        "one clean line: {message:?}"
    );
}

#[track_caller]
fn robot_refused(head: &str, rest: &str, words: &[&str]) {
    refused(RobotFile::parse("r.toml", &format!("{head}{rest}")), words);
}

#[test]
fn every_file_that_comes_with_the_tool_is_valid_and_found_from_anywhere() {
    for (name, content) in EMBEDDED {
        assert_eq!(embedded(Path::new(name)), Some(content));
        assert_eq!(embedded(&Path::new("./").join(name)), Some(content));
        if content.lines().any(|line| line.starts_with("[robot]")) {
            RobotFile::parse(name, content).unwrap();
        } else {
            Trajectory::parse(name, content).unwrap();
        }
    }
    let dspace = RobotFile::load(Path::new("configs/cft-dspace.toml")).unwrap();
    assert_eq!(dspace.robot.setup, Some(Setup::Dspace));
    assert_eq!(dspace.joint_names(), ["q1", "q2", "q4", "q5"]);
    assert_eq!(dspace.friction_law(), FrictionLawKind::DoubleTanh);
}

#[test]
fn a_file_on_the_disk_wins_over_the_one_that_comes_with_the_tool() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cft.toml");
    std::fs::write(&path, "mine").unwrap();
    assert_eq!(text(&path).unwrap(), "mine");
    refused(
        text(&folder.path().join("configs/cft.toml")),
        &["check the path", "configs/emps.toml"],
    );
}

#[test]
fn the_emps_files_ask_for_the_published_processing() {
    let emps = RobotFile::load(Path::new("configs/emps.toml")).unwrap();
    let filter = &emps.filter;
    assert_eq!(filter.kind, Some(FilterKind::ChebyshevDecimate));
    assert_eq!(
        (filter.order, filter.ripple_db, filter.cutoff_hz),
        (Some(8), Some(0.05), Some(40.0))
    );
    assert_eq!(
        (filter.position_order, filter.position_cutoff_hz),
        (Some(4), Some(100.0))
    );
    assert_eq!(filter.decimation, Some(10));
    assert!(emps.friction.fitted_with_inertias && emps.friction.offset);
    let symmetric = RobotFile::load(Path::new("configs/emps-symmetric.toml")).unwrap();
    assert!(symmetric.friction.fitted_with_inertias && !symmetric.friction.offset);
    assert_eq!(symmetric.filter, emps.filter);
}

#[test]
fn table_3_is_the_reports() {
    let Trajectory::Fourier(table) = Trajectory::load(Path::new("configs/table3.toml")).unwrap()
    else {
        panic!("Table 3 is a Fourier series");
    };
    assert_eq!(
        (table.coordinates, table.fundamental_hz),
        (Coordinates::Cartesian, 0.4)
    );
    let names: Vec<&str> = table.series.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["x_c1", "x_c2", "x_c3", "x_c4"]);
    let offsets: Vec<f64> = table.series.iter().map(|c| c.offset).collect();
    assert_eq!(offsets, [-0.1343, 0.2766, 2.4, 0.0869]);
    let a: Vec<&[f64]> = table.series.iter().map(|c| &c.a[..]).collect();
    let b: Vec<&[f64]> = table.series.iter().map(|c| &c.b[..]).collect();
    assert_eq!(
        a,
        [
            [-0.1102, 0.0042, -0.0014, -0.0173],
            [0.1629, -0.0118, 0.1438, -0.0043],
            [1.9698, 0.0014, -0.0267, 0.0021],
            [0.0002, -0.0302, 0.0021, -0.08]
        ]
    );
    assert_eq!(
        b,
        [
            [0.0037, 0.0009, 0.0005, -0.0168],
            [0.0188, -0.0257, 0.0033, -0.0277],
            [0.0011, 0.0005, -0.006, 0.0024],
            [-0.0347, 0.0273, 0.0294, 0.0447]
        ]
    );
}

#[test]
fn an_unknown_key_is_told_with_its_line_and_the_nearest_known_key() {
    robot_refused(
        CFT,
        "[filter]\ncutof_hz = 5\n",
        &[
            "r.toml:5",
            "unknown key `cutof_hz`",
            "did you mean `cutoff_hz`?",
        ],
    );
    robot_refused(CFT, "[fitler]\n", &["r.toml:4", "`fitler`", "`filter`"]);
    robot_refused(
        CFT,
        "[filter]\nbanana = 5\n",
        &["r.toml:5", "`banana`", "known keys here: kind, cutoff_hz"],
    );
    robot_refused(
        CFT,
        "[log.joint.q1]\n\"a\\u001bb\" = 1\n",
        &["r.toml:5", "a\\u{1b}b"],
    );
    robot_refused(
        "[robot]\nmodel = \"ctf\"\n",
        "",
        &["r.toml:2", "`ctf`", "did you mean `cft`?"],
    );
}

#[test]
fn broken_toml_and_wrong_types_are_told_with_their_line() {
    robot_refused(CFT, "[filter\n", &["r.toml:4"]);
    robot_refused(
        CFT,
        "[filter]\n\ncutoff_hz = \"fast\"\n",
        &["r.toml:6", "f64"],
    );
    robot_refused(
        CFT,
        "[filter]\ncutoff_hz = 1\ncutoff_hz = 2\n",
        &["r.toml:6", "duplicate key"],
    );
    robot_refused("", "", &["r.toml:1", "robot"]);
}

#[test]
fn the_robot_section_says_what_it_needs() {
    robot_refused(
        "[robot]\nmodel = \"serial\"\n",
        "",
        &["`robot.link` is missing", "[[robot.link]]", "urdf"],
    );
    robot_refused(
        "[robot]\nmodel = \"cft\"\n",
        "",
        &["`robot.setup` is missing", "tuedacs"],
    );
    robot_refused(CFT, "parameters = 13\n", &["r.toml:4", "is 13", "12", "22"]);
    robot_refused(
        CFT,
        "joint = \"q1\"\n",
        &["r.toml:4", "`robot.joint` does not belong"],
    );
    robot_refused(
        "[robot]\nmodel = \"single-joint\"\nkind = \"revolute\"\n",
        "",
        &["`robot.joint` is missing"],
    );
    robot_refused(
        "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\n",
        "",
        &["`robot.kind` is missing"],
    );
    robot_refused(
        "[robot]\nmodel = \"single-joint\"\njoint = \"q:1\"\nkind = \"revolute\"\n",
        "",
        &["r.toml:3", "no name"],
    );
    robot_refused(
        SINGLE,
        "setup = \"dspace\"\n",
        &["r.toml:5", "`robot.setup`"],
    );
}

#[test]
fn friction_that_cannot_be_is_refused() {
    robot_refused(
        SINGLE,
        "[friction]\noffset = true\n",
        &["r.toml:6", "fitted_with_inertias = true"],
    );
    robot_refused(
        CFT,
        "[friction.joint.q3]\nviscous = 1\n",
        &["r.toml:4", "friction.joint.q3", "q1, q2, q4, q5"],
    );
    robot_refused(
        CFT,
        "[friction.joint.q4]\ncoulomb = 1\n",
        &["r.toml:5", "does not belong to this friction law"],
    );
    robot_refused(
        CFT,
        "[friction.joint.q4]\nslope_1 = 6\nslope_2 = 60\n",
        &["r.toml:5", "not above slope_2"],
    );
    robot_refused(
        CFT,
        "[friction.joint.q4]\nslope_1 = -6\n",
        &["r.toml:5", "is -6"],
    );
}

#[test]
fn log_mappings_that_cannot_be_are_refused() {
    robot_refused(
        SINGLE,
        "[log.joint.q1]\ntorque = \"tau1\"\n",
        &["`log.torque_is` is missing", "commanded"],
    );
    robot_refused(
        SINGLE,
        "[log.joint.q2]\n",
        &["r.toml:5", "log.joint.q2", "this robot has q1"],
    );
    robot_refused(
        SINGLE,
        "[log.joint.q1]\nposition_unit = \"deg\"\n",
        &["r.toml:6", "prismatic", "\"mm\""],
    );
    robot_refused(
        CFT,
        "[log.joint.q2]\nposition_unit = \"mm\"\n",
        &["r.toml:5", "revolute", "\"deg\""],
    );
    robot_refused(
        CFT,
        "[log.joint.q2]\nposition_unit = \"counts\"\n",
        &["r.toml:5", "does not fit"],
    );
    robot_refused(
        CFT,
        "[log.joint.q2]\ntorque_unit = \"N\"\n",
        &["r.toml:5", "torque_scale"],
    );
    robot_refused(
        SINGLE,
        "[log.joint.q1]\nposition_sign = 2\n",
        &["r.toml:6", "is 2", "1 or -1"],
    );
    robot_refused(
        SINGLE,
        "[log.joint.q1]\nposition_scale = 0\n",
        &["r.toml:6", "other than 0"],
    );
    robot_refused(
        SINGLE,
        "[log]\ntorque_is = \"motor\"\n[log.joint.q1]\ntorque = \"c\"\n",
        &["log.joint.q1.torque_scale", "gear ratio"],
    );
    robot_refused(
        SINGLE,
        "[log]\ntorque_is = \"current\"\n[log.joint.q1]\ntorque = \"c\"\n",
        &["torque constant", "\"A\""],
    );
    robot_refused(
        CFT,
        "[log.joint.q1]\nposition = \"p\"\n[log.joint.q2]\nposition = \"p\"\n",
        &["r.toml:7", "log.joint.q1.position", "its own column"],
    );
    robot_refused(
        SINGLE,
        "[log.actuator.x_c1]\n",
        &["r.toml:5", "does not belong to this model"],
    );
    robot_refused(
        CFT,
        "[log.actuator.x_c3]\nposition_unit = \"m\"\n",
        &["r.toml:5", "x_c3"],
    );
}

#[test]
fn filters_limits_and_simulator_settings_that_cannot_be_are_refused() {
    for (rest, words) in [
        ("[filter]\ncutoff_hz = 0\n", ["is 0", "above 0"]),
        ("[filter]\ncutoff_hz = nan\n", ["NaN", "finite"]),
        ("[filter]\ndecimation = 0\n", ["is 0", "every row"]),
        ("[filter]\norder = 40\n", ["is 40", "1 to 12"]),
        (
            "[filter]\nripple_db = 1\n",
            ["Butterworth", "chebyshev-decimate"],
        ),
        ("[filter]\ngap_factor = 1\n", ["is 1", "above 1"]),
        ("[filter]\ntrim_s = -1\n", ["is -1", "give 0"]),
        (
            "[noise.joint.q4]\ntorque_std = -1\n",
            ["is -1", "noise.joint.q4"],
        ),
        (
            "[limits.x_c1]\nposition = [1, 0]\n",
            ["is empty", "lower end"],
        ),
        ("[limits.q4]\nspeed = -2\n", ["is -2", "limits.q4.speed"]),
        (
            "[drive.q4]\nbacklash_max = -1\n",
            ["is -1", "drive.q4.backlash_max"],
        ),
        ("[control]\nkp = [1, 2]\n", ["2 numbers", "give 4"]),
        ("[control]\nrate_hz = 0\n", ["is 0", "control.rate_hz"]),
        ("[sensors]\ndropouts = 0.7\n", ["0.5", "sensors.dropouts"]),
    ] {
        let mut words = words.to_vec();
        words.push("r.toml:5");
        robot_refused(CFT, rest, &words);
    }
    robot_refused(CFT, "[limits.x_c9]\n", &["limits.x_c9", "x_c1"]);
    robot_refused(CFT, "[drive.q9]\n", &["drive.q9", "q1"]);
    robot_refused(CFT, "[drive.q4]\nkind = \"magic\"\n", &["harmonic"]);
    robot_refused(
        CFT,
        "[sensors]\ntorque_noise = [1, 1, 1, 1]\ntorque_noise_relative = 0.1\n",
        &["r.toml:6", "keep one"],
    );
}

#[test]
fn trajectories_are_read_in_three_kinds() {
    let ladder =
        "kind = \"single-joint\"\njoint = \"q4\"\nspeeds = [0.1, 1]\nrange = [-0.5, 0.5]\n";
    let Trajectory::SingleJoint(ladder) = Trajectory::parse("t.toml", ladder).unwrap() else {
        panic!("one joint moves");
    };
    assert_eq!(
        (ladder.joint.as_str(), ladder.speeds, ladder.range),
        ("q4", vec![0.1, 1.0], Some([-0.5, 0.5]))
    );
    let points = "kind = \"points\"\ncoordinates = \"joint\"\npoint = [{ t = 0, position = [1, 2] }, { t = 1, position = [3, 4] }]\n";
    let Trajectory::Points(points) = Trajectory::parse("t.toml", points).unwrap() else {
        panic!("points");
    };
    assert_eq!(points.points[1].position, [3.0, 4.0]);
}

#[test]
fn trajectories_that_cannot_be_are_refused() {
    let fourier = "kind = \"fourier\"\ncoordinates = \"cartesian\"\nfundamental_hz = 0.4\n";
    let of = |rest: &str| Trajectory::parse("t.toml", &format!("{fourier}{rest}"));
    refused(of(""), &["`coordinate` is missing"]);
    refused(
        of("[[coordinate]]\nname = \"q1\"\noffset = 0\na = [1]\nb = [1]\n"),
        &["t.toml:5", "no actuator coordinate"],
    );
    refused(
        of("[[coordinate]]\nname = \"x_c1\"\noffset = 0\na = [1]\nb = [1, 2]\n"),
        &["t.toml:8", "as many numbers"],
    );
    refused(
        of("[[coordinate]]\nname = \"x_c1\"\noffset = nan\na = [1]\nb = [1]\n"),
        &["t.toml:6", "NaN"],
    );
    let twice = "[[coordinate]]\nname = \"x_c1\"\noffset = 0\na = [1]\nb = [1]\n";
    refused(of(&format!("{twice}{twice}")), &["named twice"]);
    refused(
        Trajectory::parse("t.toml", "kind = \"spline\"\n"),
        &["t.toml:1", "`spline`", "fourier"],
    );
    refused(
        Trajectory::parse("t.toml", "kind = \"single-joint\"\njoint = \"q4\"\n"),
        &["`speeds` is missing"],
    );
    let points = "kind = \"points\"\ncoordinates = \"joint\"\n[[point]]\nt = 1\nposition = [1]\n[[point]]\nt = 1\nposition = [1]\n";
    refused(
        Trajectory::parse("t.toml", points),
        &["t.toml:7", "after the time before"],
    );
    // A key of another kind is no typing error, but it would be ignored.
    refused(
        Trajectory::parse(
            "t.toml",
            "kind = \"single-joint\"\njoint = \"q4\"\nspeeds = [1]\nfundamental_hz = 1\n",
        ),
        &["t.toml:4", "does not belong"],
    );
}

#[test]
fn campaigns_name_robot_logs_and_settings() {
    let campaign = "robot = \"configs/cft.toml\"\n[logs]\nfriction = [\"a.csv\"]\nidentification = [\"b.csv@0..70%\"]\n[settings]\nestimator = \"ols\"\n";
    let campaign = Campaign::parse("c.toml", campaign).unwrap();
    assert_eq!(campaign.settings.estimator, EstimatorKind::Ols);
    assert_eq!(campaign.logs.identification, ["b.csv@0..70%"]);
    refused(
        Campaign::parse(
            "c.toml",
            "robot = \"r.toml\"\n[logs]\nvalidation = [\"a.csv\"]\n",
        ),
        &["c.toml:2", "logs.identification"],
    );
    refused(
        Campaign::parse(
            "c.toml",
            "robot = \"r.toml\"\n[logs]\nidentification = [\"a.csv@9..3s\"]\n",
        ),
        &["c.toml:3", "a.csv@9..3s", "after its beginning"],
    );
}

#[test]
fn deeply_nested_text_is_refused_without_overflowing_the_stack() {
    for (open, close) in [("[", "]"), ("{ a = ", "}")] {
        let text = format!("robot = {}{}", open.repeat(100_000), close.repeat(100_000));
        assert!(RobotFile::parse("r.toml", &text).is_err());
    }
}

proptest! {
    #[test]
    fn no_text_makes_a_reader_of_configurations_panic(text in "[\\[\\]a-z_=\" .0-9\n{},#\\\\-]{0,200}") {
        let _ = RobotFile::parse("r", &text);
        let _ = RobotFile::parse("r", &format!("{CFT}{text}"));
        let _ = Trajectory::parse("t", &text);
        let _ = Campaign::parse("c", &text);
        let _ = cft_ident_files::config::ModelFile::parse("m", &format!("{SINGLE}{text}"));
    }
}

#[test]
fn gears_that_cannot_be_turned_back_are_refused() {
    for (gears, words) in [
        ("[[2, 0]]", &["log.gears", "1 rows and columns"][..]),
        ("[[0]]", &["log.gears", "inverted"]),
        ("[[2]]\n", &["log.gears", "torque_is"]),
    ] {
        robot_refused(SINGLE, &format!("[log]\ngears = {gears}\n"), words);
    }
}

#[test]
fn columns_by_number_begin_at_one() {
    robot_refused(
        SINGLE,
        "[log]\ntime = 0\n",
        &["r.toml:6", "numbered from 1"],
    );
}
