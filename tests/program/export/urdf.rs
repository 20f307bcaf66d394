//! The URDF of a model, as it is read back.

use super::*;
use cft_ident::effect::AugmentedModel;
use cft_ident::export::ExportError;
use cft_ident::export::arm::{Arm, ArmSettings};
use cft_ident::export::urdf::UrdfFiles;

/// Parameters of links that could be, and of some couplings.
fn bodies(model: &Model, seed: u64) -> Vec<f64> {
    let robot = &model.robot;
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
    let mut standard = Vec::new();
    for _ in robot.tree().links() {
        let centre: [f64; 3] = std::array::from_fn(|_| draw.one(0.2));
        let small: [f64; 3] = std::array::from_fn(|_| draw.one(0.002));
        let inertia = [0.03, small[0], small[1], 0.04, small[2], 0.05];
        let body = Body {
            mass: 3.0 + draw.one(1.0),
            centre,
            inertia,
        };
        standard.extend(body.standard());
    }
    standard.extend((standard.len()..robot.standard_parameters()).map(|_| 0.1 + draw.one(0.05)));
    let mut theta = robot.base_of(&standard);
    theta.extend((theta.len()..robot.parameters().len()).map(|_| draw.one(0.2)));
    theta
}

/// A model file whose links can exist, with the bodies as `lsq --feasible` writes them.
pub(super) fn feasible(robot: RobotFile) -> ModelFile {
    let mut model = model(robot.robot(), false, 3);
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(41));
    let robot_model = model.robot.clone();
    let links = robot_model.tree().links().iter().map(|link| LinkBody {
        name: link.name.clone(),
        mass: 2.0 + draw.one(1.0),
        centre: std::array::from_fn(|_| draw.one(0.1)),
        inertia: [0.03, draw.one(0.002), 0.0, 0.04, draw.one(0.002), 0.05],
    });
    let links: Vec<LinkBody> = links.collect();
    let mut standard: Vec<f64> = Vec::new();
    for link in &links {
        let body = Body {
            mass: link.mass,
            centre: link.centre,
            inertia: link.inertia,
        };
        standard.extend(body.standard());
    }
    let mut drives = std::collections::BTreeMap::new();
    if robot_model.drive_inertia() {
        for name in robot_model.joint_names() {
            drives.insert(name.clone(), 0.2 + draw.one(0.1));
            standard.push(drives[name]);
        }
    }
    model.theta = robot_model.base_of(&standard);
    let couplings = model.theta.len()..robot_model.parameters().len();
    model.theta.extend(couplings.map(|_| 0.02));
    ModelFile {
        links,
        drive_inertia: drives,
        candidates: Vec::new(),
        ..file_of(robot, &model)
    }
}

/// The URDF of a model and its side file.
pub(super) fn urdf_of(
    file: &ModelFile,
    model: &Model,
    notes: &[String],
) -> Result<UrdfFiles, ExportError> {
    let settings = ArmSettings {
        any_bodies: true,
        ..ArmSettings::PLAIN
    };
    let arm = Arm::of(file, &AugmentedModel::plain(model.clone()), settings)?;
    export::urdf::urdf(file, model, &arm, "arm.urdf", notes)
}

/// Largest difference of the torques of two models, over the size of the terms of the first.
pub(super) fn difference(one: &Model, other: &Model) -> f64 {
    let mut worst: f64 = 0.0;
    for state in states(one.friction.len(), 21) {
        let (first, load) = torque(one, &state);
        let (second, _) = torque(other, &state);
        for (x, y) in first.iter().zip(&second) {
            worst = worst.max((x - y).abs() / load);
        }
    }
    worst
}

#[test]
fn a_urdf_with_its_side_file_is_the_same_model() {
    let panda = include_str!("../../../configs/panda.toml");
    let panda = RobotFile::parse("panda.toml", panda).unwrap();
    for (name, robot, smooth) in [
        ("gantry", gantry(), false),
        ("gantry-smooth", gantry(), true),
        ("panda", panda, false),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut model = model(robot.robot(), smooth, 9);
        model.theta = bodies(&model, 13);
        let file = file_of(robot, &model);
        let made = urdf_of(&file, &model, &["a note -- of a test".to_owned()]).unwrap();
        std::fs::write(folder.path().join("arm.urdf"), &made.urdf).unwrap();
        std::fs::write(folder.path().join("arm.toml"), &made.side).unwrap();
        let back = ModelFile::load(&folder.path().join("arm.toml")).unwrap();
        let again = back.model("arm.toml").unwrap();
        assert_eq!(again.robot.joint_names(), model.robot.joint_names());
        let worst = difference(&model, &again);
        eprintln!("{name}: {worst:.1e} of the terms");
        assert!(worst < 1e-12, "{name}: {worst:e}");
        // and as a model file of its own, without the URDF
        let alone = ModelFile::parse("alone.toml", &back.to_toml().unwrap()).unwrap();
        assert_eq!(alone.model("alone.toml").unwrap(), again);
    }
}

/// Writes URDF and side file, and reads the side file back.
fn there_and_back(file: &ModelFile, model: &Model) -> (String, ModelFile) {
    let folder = tempfile::tempdir().unwrap();
    let made = urdf_of(file, model, &[]).unwrap();
    std::fs::write(folder.path().join("arm.urdf"), &made.urdf).unwrap();
    std::fs::write(folder.path().join("arm.toml"), &made.side).unwrap();
    let back = ModelFile::load(&folder.path().join("arm.toml")).unwrap();
    (made.urdf, back)
}

#[test]
fn links_of_a_feasible_fit_go_into_the_urdf_as_they_are() {
    let panda = include_str!("../../../configs/panda.toml");
    let panda = RobotFile::parse("panda.toml", panda).unwrap();
    let mut model = model(panda.robot(), false, 9);
    let robot = &model.robot;
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(31));
    let links: Vec<LinkBody> = robot
        .tree()
        .links()
        .iter()
        .map(|link| LinkBody {
            name: link.name.clone(),
            mass: 2.0 + draw.one(1.0),
            centre: std::array::from_fn(|_| draw.one(0.1)),
            inertia: [0.03, draw.one(0.002), 0.0, 0.04, draw.one(0.002), 0.05],
        })
        .collect();
    let mut standard: Vec<f64> = links
        .iter()
        .flat_map(|l| {
            let body = Body {
                mass: l.mass,
                centre: l.centre,
                inertia: l.inertia,
            };
            body.standard()
        })
        .collect();
    let mut drives = std::collections::BTreeMap::new();
    if robot.drive_inertia() {
        for name in robot.joint_names() {
            drives.insert(name.clone(), 0.2 + draw.one(0.1));
            standard.push(drives[name]);
        }
    }
    model.theta = robot.base_of(&standard);
    let mut file = file_of(panda, &model);
    file.links = links.clone();
    file.drive_inertia = drives;
    let (urdf, back) = there_and_back(&file, &model);
    assert!(
        urdf.contains("of links that can exist and give the"),
        "{urdf}"
    );
    for (link, found) in links.iter().zip(&back.robot.robot.link) {
        let found = found.inertial.as_ref().unwrap();
        assert!((found.mass - link.mass).abs() < 1e-9, "{}", link.name);
        for (x, y) in found.centre.iter().zip(&link.centre) {
            assert!((x - y).abs() < 1e-9, "{}", link.name);
        }
        for (x, y) in found.inertia.iter().zip(&link.inertia) {
            assert!((x - y).abs() < 1e-9, "{}", link.name);
        }
    }
    let worst = difference(&model, &back.model("arm.toml").unwrap());
    assert!(worst < 1e-12, "{worst:e}");
    // parameters that were changed since: the torques are theirs, and the head says so
    model.theta[0] *= 1.1;
    let changed = ModelFile {
        parameters: file_of(file.robot.clone(), &model).parameters,
        ..file
    };
    let (urdf, back) = there_and_back(&changed, &model);
    assert!(urdf.contains("changed after they were found"), "{urdf}");
    let worst = difference(&model, &back.model("arm.toml").unwrap());
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn frames_that_are_fixed_to_links_are_kept() {
    let mut model = model(gantry().robot(), false, 9);
    model.theta = bodies(&model, 13);
    let file = file_of(gantry(), &model);
    let frame = |file: &ModelFile, name: &str| {
        let frames = &file.robot.robot.frame;
        frames.iter().find(|f| f.name == name).cloned().unwrap()
    };
    let names: Vec<&str> = file
        .robot
        .robot
        .frame
        .iter()
        .map(|f| f.name.as_str())
        .collect();
    assert_eq!(names, ["motor", "hand"]);
    let hand = frame(&file, "hand");
    assert_eq!(hand.link, "fore");
    assert_eq!((hand.xyz, hand.rpy), ([0.0, -0.3, 0.01], [0.0, 0.3, 0.0]));
    let (urdf, back) = there_and_back(&file, &model);
    // PyBullet gives a link that does not say what it weighs a kilogram
    let hand = "<link name=\"hand\">\n    <inertial><mass value=\"0\"/>";
    assert!(urdf.contains(hand), "{urdf}");
    assert!(urdf.contains("<link name=\"base\"/>"), "{urdf}");
    assert_eq!(back.robot.robot.frame, file.robot.robot.frame);
    // and the frames of a model file of its own, without the URDF
    let alone = ModelFile::parse("alone.toml", &file.to_toml().unwrap()).unwrap();
    assert_eq!(alone.robot.robot.frame, file.robot.robot.frame);
    let worst = difference(&model, &back.model("arm.toml").unwrap());
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn a_single_joint_is_a_chain_of_one_link_that_can_be() {
    for kind in ["prismatic", "revolute"] {
        let text = format!(
            "[robot]\nmodel = \"single-joint\"\njoint = \"x\"\nkind = \"{kind}\"\n\
             [limits.x]\nposition = [-1.0, 2.0]\n"
        );
        let robot = RobotFile::parse("robot.toml", &text).unwrap();
        let mut model = model(robot.robot(), false, 6);
        model.theta = vec![0.37];
        let (urdf, back) = there_and_back(&file_of(robot, &model), &model);
        assert!(
            urdf.contains(&format!("<joint name=\"x\" type=\"{kind}\">")),
            "{urdf}"
        );
        let body = back.robot.robot.link[0].inertial.clone().unwrap();
        assert!(body.mass > 0.0 && body.inertia[0] > 0.0, "{body:?}");
        let again = back.model("arm.toml").unwrap();
        assert_eq!(again.robot.joint_names(), ["x"]);
        let worst = difference(&model, &again);
        assert!(worst < 1e-12, "{kind}: {worst:e}");
    }
    let current = "[robot]\nmodel = \"single-joint\"\njoint = \"x\"\nkind = \"revolute\"\n\
                   [log.joint.x]\ntorque_unit = \"A\"\n";
    let robot = RobotFile::parse("robot.toml", current).unwrap();
    let model = model(robot.robot(), false, 6);
    let error = urdf_of(&file_of(robot, &model), &model, &[]).unwrap_err();
    assert!(error.to_string().contains("torque_scale"), "{error}");
}

#[test]
fn a_urdf_says_what_the_data_determine() {
    let panda = include_str!("../../../configs/panda.toml");
    let robot = RobotFile::parse("panda.toml", panda).unwrap();
    let mut model = model(robot.robot(), false, 9);
    model.theta = bodies(&model, 13);
    model
        .friction
        .fill(JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 0.3,
            coulomb: 0.2,
        }));
    let made = urdf_of(&file_of(robot, &model), &model, &[]).unwrap();
    // of the first link only its inertia about z tells, in a sum with what hangs on it
    assert!(
        made.urdf.contains(
            "determined none; only in sums with others Izz; not at all Ixx Ixy Ixz Iyy Iyz mx my mz m"
        ) || made.urdf.contains("only in sums with others"),
        "{}",
        made.urdf
    );
    assert!(made.urdf.contains("<dynamics damping="));
    assert!(!made.urdf.contains("which would drive it"));
    // a coefficient below zero would drive a simulated joint
    model.friction[1] = JointFriction::ViscousCoulomb(ViscousCoulomb {
        viscous: -0.09,
        coulomb: 0.4,
    });
    let robot = RobotFile::parse("panda.toml", panda).unwrap();
    let made = urdf_of(&file_of(robot, &model), &model, &[]).unwrap();
    assert!(
        made.urdf
            .contains("<dynamics damping=\"0.0\" friction=\"0.4\"/>")
    );
    assert!(
        made.urdf.contains("the viscous friction of q2 is -0.09"),
        "{}",
        made.urdf
    );
    assert!(
        made.side.contains("-0.09"),
        "the side file keeps what was identified"
    );
}

#[test]
fn what_a_urdf_cannot_hold_is_refused_with_a_way_out() {
    let chain = include_str!("../../../fixtures/robots/cft-chain.toml");
    let robot = RobotFile::parse("chain.toml", chain).unwrap();
    let model = model(robot.robot(), true, 4);
    let error = urdf_of(&file_of(robot, &model), &model, &[]).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("`link_3`") && text.ends_with("--c or --rust"),
        "{text}"
    );
}

#[test]
fn the_users_urdf_keeps_what_is_not_inertia_or_friction() {
    let folder = tempfile::tempdir().unwrap();
    let file = feasible(gantry());
    let source = std::fs::read_to_string(fixtures("urdf").join("gantry.urdf")).unwrap();
    let source = source.replace(
        "<robot name=\"gantry\">",
        "<robot name=\"gantry\">\n  <!-- of the maker --><gazebo><plugin name=\"x\"/></gazebo>",
    );
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("gantry.urdf"), &source).unwrap();
    std::fs::write(path("model.toml"), file.to_toml().unwrap()).unwrap();
    let command = |more: &[&str]| {
        assert_cmd::Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(folder.path())
            .args([
                "export",
                "-m",
                "model.toml",
                "--urdf",
                "new.urdf",
                "--urdf-source",
            ])
            .args(more)
            .assert()
    };
    command(&["gantry.urdf"]).success();
    let text = std::fs::read_to_string(path("new.urdf")).unwrap();
    assert!(text.contains("<!-- of the maker --><gazebo><plugin name=\"x\"/></gazebo>"));
    let origins = |text: &str| text.matches("<parent link=").count();
    assert_eq!(origins(&text), origins(&source));
    // with the model file beside it, it is the model
    let back = ModelFile::load(&path("new.toml")).unwrap();
    let model = file.model("model.toml").unwrap();
    let worst = difference(&model, &back.model("new.toml").unwrap());
    assert!(worst < 1e-9, "{worst:e}");
    // a joint that is not there, and one that sits elsewhere
    let elsewhere = source.replace("\"elbow\"", "\"knee\"");
    std::fs::write(path("knee.urdf"), elsewhere).unwrap();
    command(&["knee.urdf"])
        .code(3)
        .stderr(predicates::str::contains("has no joint `elbow`"));
}
