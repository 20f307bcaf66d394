//! URDF files as robots: placements, lumping, mimic joints and limits, against Pinocchio.

use crate::measured_support;

use cft_ident::config::RobotFile;
use cft_ident::robot::JointKind;
use cft_ident::robot::standard::STANDARD;
use cft_ident::robot::tree::space;
use measured_support::shared;
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

/// Place in Pinocchio's list (m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz) of ours (Ixx, Ixy, Ixz,
/// Iyy, Iyz, Izz, mx, my, mz, m).
const THEIRS: [usize; STANDARD] = [4, 5, 7, 6, 8, 9, 1, 2, 3, 0];

fn fixture(name: &str) -> PathBuf {
    Path::new(cft_ident_support::ROOT)
        .join("fixtures")
        .join(name)
}

/// A robot file that names this URDF.
fn file_of(urdf: &Path, more: &str) -> RobotFile {
    let text = format!(
        "[robot]\nmodel = \"serial\"\ndrive_inertia = false\nurdf = {:?}\n{more}",
        urdf.file_name().unwrap().to_str().unwrap()
    );
    RobotFile::parse_in("robot.toml", &text, urdf.parent()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list");
    list.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// Standard parameters of the inertials that the URDF gave.
fn prior(file: &RobotFile) -> Vec<f64> {
    let mut out = Vec::new();
    for link in &file.robot.link {
        let Some(body) = &link.inertial else {
            out.extend([0.0; STANDARD]);
            continue;
        };
        let (m, [x, y, z]) = (body.mass, body.centre);
        let [xx, xy, xz, yy, yz, zz] = body.inertia;
        out.extend([
            xx + m * (y * y + z * z),
            xy - m * x * y,
            xz - m * x * z,
            yy + m * (x * x + z * z),
            yz - m * y * z,
            zz + m * (x * x + y * y),
            m * x,
            m * y,
            m * z,
            m,
        ]);
    }
    out
}

/// Largest difference of torques and regressor entries, over the largest of the same joint.
fn compare(file: &RobotFile, oracle: &str, count: usize) -> f64 {
    let text = std::fs::read_to_string(fixture("oracle").join(oracle)).unwrap();
    let oracle: Value = serde_json::from_str(&text).unwrap();
    let robot = file.robot();
    let names = |key: &str| -> Vec<String> {
        let list = oracle[key].as_array().unwrap().iter();
        list.map(|x| x.as_str().unwrap().to_owned()).collect()
    };
    let joint_of: Vec<usize> = robot
        .joint_names()
        .iter()
        .map(|joint| names("joints").iter().position(|n| n == joint).unwrap())
        .collect();
    let link_of: Vec<usize> = robot
        .tree()
        .links()
        .iter()
        .map(|link| names("links").iter().position(|n| *n == link.name).unwrap())
        .collect();
    assert_eq!(names("links").len(), link_of.len());
    let n = joint_of.len();
    let p = robot.standard_parameters();
    let standard = prior(file);
    let theta = robot.base_of(&standard);
    let mut worst: f64 = 0.0;
    let states = oracle["states"].as_array().unwrap();
    assert_eq!(states.len(), count);
    for state in states {
        let ours = |key: &str| -> Vec<f64> {
            let theirs = numbers(&state[key]);
            joint_of.iter().map(|j| theirs[*j]).collect()
        };
        let (q, v, a, tau) = (ours("q"), ours("v"), ours("a"), ours("tau"));
        let mut y = vec![0.0; n * p];
        robot.standard_regressor(&q, &v, &a, &mut y);
        let mut base = vec![0.0; n * theta.len()];
        robot.regressor(&q, &v, &a, &mut base);
        for j in 0..n {
            let row = numbers(&state["Y"][joint_of[j]]);
            let size = row.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (i, link) in link_of.iter().enumerate() {
                for (k, theirs) in THEIRS.iter().enumerate() {
                    let difference = y[j * p + i * STANDARD + k] - row[link * STANDARD + theirs];
                    worst = worst.max(difference.abs() / size);
                }
            }
            let sum =
                |y: &[f64], theta: &[f64]| y.iter().zip(theta).map(|(y, t)| y * t).sum::<f64>();
            let load: f64 = (0..p).map(|k| (y[j * p + k] * standard[k]).abs()).sum();
            let whole = sum(&y[j * p..(j + 1) * p], &standard);
            let grouped = sum(&base[j * theta.len()..(j + 1) * theta.len()], &theta);
            worst = worst.max((whole - tau[j]).abs() / load);
            worst = worst.max((grouped - tau[j]).abs() / load);
        }
    }
    worst
}

/// Pinocchio read the angles as they are written.
const AS_WRITTEN: &str = "angles_as_written = true\n";

#[test]
fn a_made_up_arm_moves_as_pinocchio_says() {
    let file = file_of(&fixture("urdf/gantry.urdf"), AS_WRITTEN);
    let worst = compare(&file, "serial_gantry.json", 20);
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn the_tx40_moves_as_pinocchio_says() {
    let Some(urdf) = shared("tx40/tx40_mdh_modified.urdf") else {
        return;
    };
    let worst = compare(&file_of(&urdf, AS_WRITTEN), "serial_tx40.json", 20);
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn the_ur10_moves_as_pinocchio_says() {
    let Some(urdf) = shared("ur10/ur10_robot.urdf") else {
        return;
    };
    let worst = compare(&file_of(&urdf, AS_WRITTEN), "serial_ur10.json", 20);
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn a_pair_of_arms_moves_as_pinocchio_says() {
    let file = file_of(&fixture("urdf/two_arms.urdf"), AS_WRITTEN);
    assert_eq!(file.joint_names().len(), 14);
    let worst = compare(&file, "serial_two_arms.json", 6);
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn a_pair_of_arms_on_a_torso_that_turns_moves_as_pinocchio_says() {
    let urdf = std::fs::read_to_string(fixture("urdf/two_arms.urdf")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turning.urdf");
    let turning = urdf.replace(
        "name=\"stand\" type=\"fixed\"",
        "name=\"stand\" type=\"continuous\"",
    );
    std::fs::write(&path, turning).unwrap();
    let file = file_of(&path, AS_WRITTEN);
    assert_eq!(file.joint_names().len(), 15);
    let worst = compare(&file, "serial_two_arms_turning.json", 6);
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn what_a_joint_does_not_move_has_no_part_in_its_torque() {
    let robot = file_of(&fixture("urdf/two_arms.urdf"), AS_WRITTEN).robot();
    let (n, p) = (robot.joints(), robot.parameters().len());
    let mut y = vec![f64::NAN; n * p];
    robot.regressor(&[0.4; 14], &[0.7; 14], &[-0.9; 14], &mut y);
    let links = robot.groupings().iter().map(|g| g.kept / STANDARD);
    for (column, link) in links.enumerate() {
        for joint in 0..n {
            let moved = robot.tree().upstream(link).contains(&joint);
            assert!(moved || y[joint * p + column] == 0.0, "{joint} {link}");
        }
    }
    // an arm has the base parameters that it has alone
    let left = file_of(
        &fixture("urdf/two_arms.urdf"),
        "tip = \"left_wrist_turn_link\"\n",
    );
    assert_eq!(2 * left.robot().parameters().len(), p);
}

#[test]
fn a_urdf_becomes_link_tables_and_the_file_stands_alone() {
    let file = file_of(&fixture("urdf/gantry.urdf"), AS_WRITTEN);
    assert_eq!((&file.robot.urdf, &file.robot.tip), (&None, &None));
    assert_eq!(
        file.joint_names(),
        ["rail", "shoulder", "elbow", "finger_left"]
    );
    let names: Vec<&str> = file
        .robot
        .link
        .iter()
        .filter_map(|l| l.name.as_deref())
        .collect();
    assert_eq!(
        names,
        ["carriage", "upper", "fore", "weight", "left", "right"]
    );
    let parents: Vec<Option<&str>> = file
        .robot
        .link
        .iter()
        .map(|l| l.parent.as_deref())
        .collect();
    assert_eq!(
        parents,
        [None, None, None, None, Some("fore"), Some("fore")]
    );
    // the motor is lumped into the carriage, the hand into the fore-arm
    let mass = |i: usize| file.robot.link[i].inertial.as_ref().unwrap().mass;
    assert!((mass(0) - 8.7).abs() < 1e-14 && (mass(2) - 1.9).abs() < 1e-14);
    let robot = file.robot();
    assert_eq!(robot.joint_kind(0), JointKind::Prismatic);
    assert_eq!(robot.joint_kind(2), JointKind::Revolute);
    // read back as text, it is the same robot to the last bit
    let text = toml::to_string(&file).unwrap();
    assert!(!text.contains("urdf"), "{text}");
    let again = RobotFile::parse("again.toml", &text).unwrap();
    assert_eq!(again, file);
}

#[test]
fn limits_come_from_the_urdf_where_the_robot_file_is_silent() {
    let urdf = fixture("urdf/gantry.urdf");
    let file = file_of(&urdf, "[limits.rail]\nspeed = 0.5\n");
    let rail = &file.limits["rail"];
    assert_eq!(rail.position, Some([-0.8, 0.9]));
    assert_eq!((rail.speed, rail.torque), (Some(0.5), Some(400.0)));
    // a speed of 0 stands for one that nobody knows, and a continuous joint has no ends
    assert_eq!(file.limits["shoulder"].speed, None);
    assert_eq!(file.limits["elbow"].position, None);
    assert!(!file.limits.contains_key("counterweight"));
}

#[test]
fn a_tip_chooses_one_branch() {
    let file = file_of(&fixture("urdf/gantry.urdf"), "tip = \"weight\"\n");
    assert_eq!(file.joint_names(), ["rail", "shoulder", "elbow"]);
    assert_eq!(file.robot.link.len(), 4);
    // the hand is fixed to the forearm, and its fingers hang on it: the forearm carries their masses
    let fore = file.robot.link[2].inertial.as_ref().unwrap();
    let (sin, cos) = f64::sin_cos(0.3);
    let (hand, fingers) = (0.5, 2.0 * 0.08);
    let mass = 1.4 + hand + fingers;
    let along_hand = hand * 0.02 + fingers * 0.08;
    let moments = [
        1.4 * 0.01 + sin * along_hand,
        1.4 * -0.14 + (hand + fingers) * -0.3,
        1.4 * 0.02 + (hand + fingers) * 0.01 + cos * along_hand,
    ];
    assert!((fore.mass - mass).abs() < 1e-12, "{}", fore.mass);
    for (centre, moment) in fore.centre.iter().zip(moments) {
        assert!((centre - moment / mass).abs() < 1e-12, "{:?}", fore.centre);
    }
}

#[test]
fn a_moving_link_may_be_called_base_and_mimics_may_be_chained() {
    let text = r#"<robot name="r"><link name="world"/><link name="base"/><link name="a"/><link name="b"/>
        <joint name="j1" type="prismatic"><parent link="world"/><child link="base"/></joint>
        <joint name="j2" type="revolute"><parent link="base"/><child link="a"/>
          <mimic joint="j3" multiplier="2" offset="0.5"/></joint>
        <joint name="j3" type="revolute"><parent link="base"/><child link="b"/>
          <mimic joint="j1" multiplier="-3" offset="0.1"/></joint></robot>"#;
    let chain = cft_ident::config::UrdfChain::parse("r.urdf", text, None).unwrap();
    assert_eq!(chain.links[0].name.as_deref(), Some("base_link"));
    assert_eq!(chain.links[2].parent.as_deref(), Some("base_link"));
    let follows = chain.links[1].follows.as_ref().unwrap();
    assert_eq!(follows.linear["j1"], -6.0);
    assert!((follows.offset - 0.7).abs() < 1e-15);
    // the axis of a URDF joint is x where it says nothing
    assert_eq!(chain.links[0].axis, Some([1.0, 0.0, 0.0]));
}

#[test]
fn roll_pitch_and_yaw_of_a_rotation_give_it_back_also_at_the_pole() {
    let mut worst: f64 = 0.0;
    for i in -8..=8 {
        for bend in [
            0.0,
            0.4,
            1.5,
            FRAC_PI_2 - 3e-7,
            FRAC_PI_2 - 5e-12,
            FRAC_PI_2,
        ] {
            for (roll, pitch) in [(0.3, bend), (-2.9, -bend)] {
                let there = space::of_roll_pitch_yaw(&[roll, pitch, 0.37 * f64::from(i)]);
                let back = space::of_roll_pitch_yaw(&space::roll_pitch_yaw(&there));
                for (x, y) in there.iter().flatten().zip(back.iter().flatten()) {
                    worst = worst.max((x - y).abs());
                }
            }
        }
    }
    assert!(worst < 1e-15, "{worst:e}");
}
