//! Configuration files: what comes with the tool is right, and what is wrong is reported with its line.

use std::path::Path;

use cft_ident_core::robot::cft::LaboratorySetup;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::robot_file::{FilterKind, FrictionLawKind};
use cft_ident_files::config::trajectory::{Trajectory, TrajectoryCoordinates};
use cft_ident_files::config::{CampaignFile, ConfigError, EMBEDDED, RobotFile, embedded, text};
use proptest::prelude::*;

const SINGLE: &str = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"prismatic\"\n";
const CFT: &str = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n";
const FOURIER: &str = "kind = \"fourier\"\ncoordinates = \"cartesian\"\nfundamental_hz = 0.4\n";

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
    assert_eq!(dspace.robot.setup, Some(LaboratorySetup::Dspace));
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
        (TrajectoryCoordinates::Cartesian, 0.4)
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

/// A file a line that is refused: its kind with its head, the lines below, and words of the error.
const REFUSED: &str = r##"
# unknown keys, with the nearest known one
cft | [filter]\ncutof_hz = 5\n | r.toml:5 | unknown key `cutof_hz` | did you mean `cutoff_hz`?
cft | [fitler]\n | r.toml:4 | `fitler` | `filter`
cft | [filter]\nbanana = 5\n | r.toml:5 | `banana` | known keys here: kind, cutoff_hz
cft | [log.joint.q1]\n"a\u001bb" = 1\n | r.toml:5 | a\u{1b}b
whole | [robot]\nmodel = "ctf"\n | r.toml:2 | `ctf` | did you mean `cft`?
# broken TOML and wrong types
cft | [filter\n | r.toml:4
cft | [filter]\n\ncutoff_hz = "fast"\n | r.toml:6 | f64
cft | [filter]\ncutoff_hz = 1\ncutoff_hz = 2\n | r.toml:6 | duplicate key
whole |  | r.toml:1 | robot
# what [robot] lacks or may not have
whole | [robot]\nmodel = "serial"\n | `robot.link` is missing | [[robot.link]] | urdf
whole | [robot]\nmodel = "cft"\n | `robot.setup` is missing | tuedacs
cft | parameters = 13\n | r.toml:4 | is 13 | 12 | 22
cft | joint = "q1"\n | r.toml:4 | `robot.joint` does not belong
whole | [robot]\nmodel = "single-joint"\nkind = "revolute"\n | `robot.joint` is missing
whole | [robot]\nmodel = "single-joint"\njoint = "q1"\n | `robot.kind` is missing
whole | [robot]\nmodel = "single-joint"\njoint = "q:1"\nkind = "revolute"\n | r.toml:3 | no name
single | setup = "dspace"\n | r.toml:5 | `robot.setup`
# friction
single | [friction]\noffset = true\n | r.toml:6 | fitted_with_inertias = true
cft | [friction.joint.q3]\nviscous = 1\n | r.toml:4 | friction.joint.q3 | q1, q2, q4, q5
cft | [friction.joint.q4]\ncoulomb = 1\n | r.toml:5 | does not belong to this friction law
cft | [friction.joint.q4]\nslope_1 = 6\nslope_2 = 60\n | r.toml:5 | not above slope_2
cft | [friction.joint.q4]\nslope_1 = -6\n | r.toml:5 | is -6
# columns of logs
single | [log.joint.q1]\ntorque = "tau1"\n | `log.torque_is` is missing | commanded
single | [log.joint.q2]\n | r.toml:5 | log.joint.q2 | this robot has q1
single | [log.joint.q1]\nposition_unit = "deg"\n | r.toml:6 | prismatic | "mm"
cft | [log.joint.q2]\nposition_unit = "mm"\n | r.toml:5 | revolute | "deg"
cft | [log.joint.q2]\ntorque_unit = "N"\n | r.toml:5 | torque_scale
single | [log.joint.q1]\nposition_sign = 2\n | r.toml:6 | is 2 | 1 or -1
single | [log.joint.q1]\nposition_scale = 0\n | r.toml:6 | other than 0
single | [log]\ntorque_is = "motor"\n[log.joint.q1]\ntorque = "c"\n | log.joint.q1.torque_scale | gear ratio
single | [log]\ntorque_is = "current"\n[log.joint.q1]\ntorque = "c"\n | torque constant | "A"
cft | [log.joint.q1]\nposition = "p"\n[log.joint.q2]\nposition = "p"\n | r.toml:7 | log.joint.q1.position | its own column
single | [log.actuator.x_c1]\n | r.toml:5 | does not belong to this model
cft | [log.actuator.x_c3]\nposition_unit = "m"\n | r.toml:5 | x_c3
# filters, limits, drives and the simulator
cft | [filter]\ncutoff_hz = 0\n | is 0 | above 0 | r.toml:5
cft | [filter]\ncutoff_hz = nan\n | NaN | finite | r.toml:5
cft | [filter]\ndecimation = 0\n | is 0 | every row | r.toml:5
cft | [filter]\norder = 40\n | is 40 | 1 to 12 | r.toml:5
cft | [filter]\nripple_db = 1\n | Butterworth | chebyshev-decimate | r.toml:5
cft | [filter]\ngap_factor = 1\n | is 1 | above 1 | r.toml:5
cft | [filter]\ntrim_s = -1\n | is -1 | give 0 | r.toml:5
cft | [noise.joint.q4]\ntorque_std = -1\n | is -1 | noise.joint.q4 | r.toml:5
cft | [limits.x_c1]\nposition = [1, 0]\n | is empty | lower end | r.toml:5
cft | [limits.q4]\nspeed = -2\n | is -2 | limits.q4.speed | r.toml:5
cft | [drive.q4]\nbacklash_max = -1\n | is -1 | drive.q4.backlash_max | r.toml:5
cft | [control]\nkp = [1, 2]\n | 2 numbers | give 4 | r.toml:5
cft | [control]\nrate_hz = 0\n | is 0 | control.rate_hz | r.toml:5
cft | [sensors]\ndropouts = 0.7\n | 0.5 | sensors.dropouts | r.toml:5
cft | [limits.x_c9]\n | limits.x_c9 | x_c1
cft | [drive.q9]\n | drive.q9 | q1
cft | [drive.q4]\nkind = "magic"\n | harmonic
cft | [sensors]\ntorque_noise = [1, 1, 1, 1]\ntorque_noise_relative = 0.1\n | r.toml:6 | keep one
# gears
single | [log]\ngears = [[2, 0]]\n | log.gears | 1 rows and columns
single | [log]\ngears = [[0]]\n | log.gears | inverted
single | [log]\ngears = [[2]]\n\n | log.gears | torque_is
# columns by number
single | [log]\ntime = 0\n | r.toml:6 | numbered from 1
# trajectories
fourier |  | `coordinate` is missing
fourier | [[coordinate]]\nname = "q1"\noffset = 0\na = [1]\nb = [1]\n | t.toml:5 | no actuator coordinate
fourier | [[coordinate]]\nname = "x_c1"\noffset = 0\na = [1]\nb = [1, 2]\n | t.toml:8 | as many numbers
fourier | [[coordinate]]\nname = "x_c1"\noffset = nan\na = [1]\nb = [1]\n | t.toml:6 | NaN
fourier | [[coordinate]]\nname = "x_c1"\noffset = 0\na = [1]\nb = [1]\n[[coordinate]]\nname = "x_c1"\noffset = 0\na = [1]\nb = [1]\n | named twice
motion | kind = "spline"\n | t.toml:1 | `spline` | fourier
motion | kind = "single-joint"\njoint = "q4"\n | `speeds` is missing
motion | kind = "points"\ncoordinates = "joint"\n[[point]]\nt = 1\nposition = [1]\n[[point]]\nt = 1\nposition = [1]\n | t.toml:7 | after the time before
# a key of another kind is no typing error, but it would be ignored
motion | kind = "single-joint"\njoint = "q4"\nspeeds = [1]\nfundamental_hz = 1\n | t.toml:4 | does not belong
# campaigns
campaign | robot = "r.toml"\n[logs]\nvalidation = ["a.csv"]\n | c.toml:2 | logs.identification
campaign | robot = "r.toml"\n[logs]\nidentification = ["a.csv@9..3s"]\n | c.toml:3 | a.csv@9..3s | after its beginning
"##;

#[test]
fn files_that_cannot_be_are_refused_with_the_line_and_the_way_out() {
    for case in REFUSED.lines().filter(|line| line.contains(" | ")) {
        let parts: Vec<&str> = case.split(" | ").collect();
        let [head, rest, words @ ..] = &parts[..] else {
            panic!("{case}");
        };
        let rest = rest.replace("\\n", "\n");
        let robot = |head: &str| RobotFile::parse("r.toml", &format!("{head}{rest}")).map(drop);
        let motion = |head: &str| Trajectory::parse("t.toml", &format!("{head}{rest}")).map(drop);
        let result = match *head {
            "single" => robot(SINGLE),
            "cft" => robot(CFT),
            "fourier" => motion(FOURIER),
            "motion" => motion(""),
            "campaign" => CampaignFile::parse("c.toml", &rest).map(drop),
            _ => robot(""),
        };
        refused(result, words);
    }
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
fn campaigns_name_robot_logs_and_settings() {
    let campaign = "robot = \"configs/cft.toml\"\n[logs]\nfriction = [\"a.csv\"]\nidentification = [\"b.csv@0..70%\"]\n[settings]\nestimator = \"ols\"\n";
    let campaign = CampaignFile::parse("c.toml", campaign).unwrap();
    assert_eq!(campaign.settings.estimator, EstimatorKind::Ols);
    assert_eq!(campaign.logs.identification, ["b.csv@0..70%"]);
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
        let _ = CampaignFile::parse("c", &text);
        let _ = cft_ident_files::config::ModelFile::parse("m", &format!("{SINGLE}{text}"));
    }
}
