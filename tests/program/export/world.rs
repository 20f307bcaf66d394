//! What stands in files of links of gravity, flat bodies, payloads, limits and friction, so that every reader has the same robot.

use super::urdf::{difference, urdf_of};
use super::*;
use cft_ident::effect::{AugmentedModel, EffectPlace, LAWS, ModelEffect};
use cft_ident::export::arm::{Arm, ArmJoint, ArmSettings};
use cft_ident::export::{left_out, mjcf, sdf, usd};

/// The gantry in a gravity of its own, whose links can exist.
fn in_gravity(gravity: [f64; 3]) -> ModelFile {
    let mut robot = gantry();
    robot.robot.gravity = Some(gravity);
    feasible(robot)
}

fn arm_of(file: &ModelFile) -> Arm {
    let model = AugmentedModel::plain(file.model("model.toml").unwrap());
    Arm::of(file, &model, ArmSettings::PLAIN).unwrap()
}

/// The model that URDF and side file are read back as.
fn there_and_back(made: &export::urdf::UrdfFiles) -> ModelFile {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), &made.urdf).unwrap();
    std::fs::write(folder.path().join("arm.toml"), &made.side).unwrap();
    ModelFile::load(&folder.path().join("arm.toml")).unwrap()
}

#[test]
fn a_base_is_turned_until_gravity_is_along_minus_z_and_the_torques_stay() {
    for gravity in [[-9.81, 0.0, 0.0], [0.0, 0.0, 9.81], [-6.0, 2.0, -7.5]] {
        let file = in_gravity(gravity);
        let model = file.model("model.toml").unwrap();
        let made = urdf_of(&file, &model, &[]).unwrap();
        assert!(
            made.urdf.contains("<link name=\"world\"/>"),
            "{}",
            made.urdf
        );
        let back = there_and_back(&made);
        let [x, y, z] = back.robot.robot.gravity.unwrap_or([0.0, 0.0, -9.81]);
        let size = gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
        assert_eq!([x, y], [0.0; 2]);
        assert!((z + size).abs() < 1e-12, "{z}");
        let worst = difference(&model, &back.model("arm.toml").unwrap());
        assert!(worst < 1e-12, "{gravity:?}: {worst:e}");
        let arm = arm_of(&file);
        let down = format!("gravity=\"0.0 0.0 {:?}\"", -size);
        let text = mjcf::mjcf(&arm, &[]);
        assert!(
            text.contains(&down) && text.contains("<body name=\"base_turned\" quat="),
            "{text}"
        );
        let text = sdf::sdf(&arm, &[]);
        assert!(!text.contains("<pose>0 0 0 0.0 0.0 0.0</pose>"), "{text}");
        let text = usd::usd(&arm, &[]);
        assert!(
            text.contains("physics:gravityDirection = (0.0, 0.0, -1.0)"),
            "{text}"
        );
    }
    // upright it stays as it is
    let text = mjcf::mjcf(&arm_of(&in_gravity([0.0, 0.0, -9.81])), &[]);
    assert!(
        !text.contains("base_turned") && !text.contains("inertiafromgeom"),
        "{text}"
    );
}

#[test]
fn a_gravity_that_is_not_that_of_the_earth_is_named_where_readers_skip_it() {
    for (gravity, named) in [
        ([0.0, 0.0, -1.62], true),
        ([0.0, 0.0, 0.0], true),
        ([1.62, 0.0, 0.0], true),
        ([0.0, 9.81, 0.0], false),
        ([0.0, 0.0, -9.81], false),
    ] {
        let file = in_gravity(gravity);
        let model = AugmentedModel::plain(file.model("model.toml").unwrap());
        let arm = arm_of(&file);
        for (says, readers) in [
            (mjcf::SAYS, "Pinocchio and newton take"),
            (sdf::SAYS, "Drake takes"),
            (export::urdf::SAYS, "every program takes"),
        ] {
            let along = [crate::export_support::swing(arm.joints().len())];
            let found = left_out::left_out(&arm, &model, says, &along);
            let line = found
                .iter()
                .find(|part| part.what.starts_with("gravity along"));
            assert_eq!(line.is_some(), named, "{gravity:?}");
            if let Some(line) = line {
                assert!(line.what.contains(readers), "{}", line.what);
                assert!(line.percent_of_torque.unwrap() > 1.0);
            }
        }
        let of_usd = left_out::left_out(&arm, &model, usd::SAYS, &[]);
        assert!(of_usd.iter().all(|part| !part.what.starts_with("gravity")));
    }
}

#[test]
fn flat_links_are_exported_whatever_their_rounding_and_points_are_named() {
    let mut file = in_gravity([0.0, 0.0, -9.81]);
    let flat = |x: f64, y: f64, rounding: f64| [y + rounding, 0.0, 0.0, x + rounding, 0.0, x + y];
    let thin = [1e-17, -6e-17, 0.0, 3e-18];
    for (k, link) in file.links.iter_mut().enumerate() {
        link.inertia = flat(0.03, 0.02, thin[k % 4]);
    }
    let last = file.links.last_mut().unwrap();
    last.inertia = [0.0; 6];
    let name = last.name.clone();
    let robot = file.robot.robot();
    let bodies = file.links.iter().flat_map(|link| {
        let (mass, centre, inertia) = (link.mass, link.centre, link.inertia);
        Body {
            mass,
            centre,
            inertia,
        }
        .standard()
    });
    let mut standard: Vec<f64> = bodies.collect();
    standard.extend(
        robot
            .joint_names()
            .iter()
            .map(|name| file.drive_inertia[name]),
    );
    for (info, value) in robot.parameters().iter().zip(robot.base_of(&standard)) {
        let mut parameters = file.parameters.iter_mut();
        parameters.find(|p| p.name == *info.name).unwrap().value = value;
    }
    let arm = arm_of(&file);
    for link in &arm.links {
        let [xx, _, _, yy, _, zz] = link.body.inertia;
        let largest = xx.max(yy).max(zz);
        assert!(
            xx + yy + zz - 2.0 * largest > 1e-14,
            "{}: {:?}",
            link.name,
            link.body
        );
    }
    let said = arm.of_inertials.last().unwrap();
    assert!(
        said.contains("No extent") && said.ends_with(&format!("take: {name}.")),
        "{said}"
    );
    // what no body can be is refused
    file.links[0].inertia = flat(0.03, 0.02, -1e-4);
    let model = AugmentedModel::plain(file.model("model.toml").unwrap());
    let error = Arm::of(&file, &model, ArmSettings::PLAIN).unwrap_err();
    assert!(error.to_string().contains("can be no body"), "{error}");
}

#[test]
fn a_payload_and_a_rotor_are_in_the_urdf_and_not_a_second_time_beside_it() {
    let file = in_gravity([0.0, 0.0, -9.81]);
    let model = file.model("model.toml").unwrap();
    // of two laws of that name the one of a serial robot: its shape is the centre of the body
    let law = |name: &str, shape: usize| {
        let mut named = LAWS.iter().filter(|law| law.entry.name == name);
        *named.find(|law| law.shape.len() == shape).unwrap()
    };
    let payload = ModelEffect::new(
        law("payload", 3),
        EffectPlace::All,
        vec![0.05, 0.0, 0.1],
        vec![1.2, 0.01],
    );
    let rotor = ModelEffect::new(
        law("rotor-inertia", 0),
        EffectPlace::Joint(1),
        Vec::new(),
        vec![0.3],
    );
    let refined = AugmentedModel {
        model: model.clone(),
        effects: vec![payload, rotor],
    };
    let arm = Arm::of(&file, &refined, ArmSettings::PLAIN).unwrap();
    let made = export::urdf::urdf(&file, &model, &arm, "arm.urdf", &[]).unwrap();
    let back = there_and_back(&made).model("arm.toml").unwrap();
    let along = crate::export_support::swing(model.robot.joints());
    let wanted = refined.torques(&along).hat;
    let found = AugmentedModel::plain(back).torques(&along).hat;
    for (found, wanted) in found.iter().zip(&wanted) {
        let size = wanted.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        for (x, y) in found.iter().zip(wanted) {
            assert!((x - y).abs() < 1e-10 * size, "{x} {y}");
        }
    }
}

#[test]
fn a_limit_that_nobody_knows_is_none_and_is_read_back_as_unknown() {
    let mut file = in_gravity([0.0, 0.0, -9.81]);
    file.robot.limits.of.clear();
    let model = file.model("model.toml").unwrap();
    let made = urdf_of(&file, &model, &[]).unwrap();
    // a slide without ends would be held by ends of 0
    let none = "<limit lower=\"-1e16\" upper=\"1e16\" effort=\"1e16\" velocity=\"1e16\"/>";
    assert!(made.urdf.contains(none), "{}", made.urdf);
    assert!(!made.urdf.contains("effort=\"0"), "{}", made.urdf);
    assert!(there_and_back(&made).robot.limits.of.is_empty());
}

#[test]
fn damping_and_friction_are_nearest_to_the_law_over_the_speeds_of_the_log() {
    let file = in_gravity([0.0, 0.0, -9.81]);
    let mut model = file.model("model.toml").unwrap();
    let law = DoubleTanh {
        viscous: 1.5,
        coulomb_1: 2.0,
        coulomb_2: -0.4,
        slope_1: 80.0,
        slope_2: 2.0,
    };
    model.friction.fill(JointFriction::DoubleTanh(law));
    let along = [crate::export_support::swing(model.robot.joints())];
    let settings = ArmSettings {
        along: &along,
        ..ArmSettings::PLAIN
    };
    let refined = AugmentedModel::plain(model);
    let arm = Arm::of(&file, &refined, settings).unwrap();
    let off = |j: usize, damping: f64, friction: f64| -> f64 {
        let speeds = along[0].v[j].iter();
        let said = |v: f64| damping * v + friction * cft_ident::robot::friction::sign(v);
        speeds
            .map(|v| (refined.model.friction[j].torque(*v) - said(*v)).powi(2))
            .sum()
    };
    for joint in arm.joints() {
        let best = off(joint.index, joint.damping, joint.friction);
        for (damping, friction) in [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)] {
            assert!(
                best < off(
                    joint.index,
                    joint.damping + damping,
                    joint.friction + friction
                )
            );
        }
        assert!(best < off(joint.index, 1.5, 1.6));
    }
}

#[test]
fn friction_that_bends_with_speed_is_in_the_mjcf_where_it_is_asked_for_and_its_error_in_the_table()
{
    let file = in_gravity([0.0, 0.0, -9.81]);
    let model = file.model("model.toml").unwrap();
    let law = LAWS
        .iter()
        .find(|law| law.entry.name == "nonlinear-viscous")
        .unwrap();
    let bent = |power: f64| ModelEffect::new(law, EffectPlace::Joint(1), vec![power], vec![0.8]);
    let along = [crate::export_support::swing(model.robot.joints())];
    for (power, exact) in [(3.0, true), (2.5, false)] {
        let refined = AugmentedModel {
            model: model.clone(),
            effects: vec![bent(power)],
        };
        let settings = ArmSettings {
            along: &along,
            bends: true,
            ..ArmSettings::PLAIN
        };
        let arm = Arm::of(&file, &refined, settings).unwrap();
        let found = left_out::left_out(&arm, &refined, mjcf::SAYS, &along);
        let name = format!("the friction law of {} ", model.robot.joint_names()[1]);
        let line = found.iter().find(|part| part.what.starts_with(&name));
        let percent = line.unwrap().percent_of_torque.unwrap();
        assert!(
            if exact {
                percent < 1e-3
            } else {
                percent > 1e-3
            },
            "{power}: {percent}"
        );
        assert!(
            found.iter().all(|part| !part.what.contains("nonlinear")),
            "{found:?}"
        );
        let plain = Arm::of(&file, &refined, ArmSettings::PLAIN).unwrap();
        let found = left_out::left_out(&plain, &refined, mjcf::SAYS, &along);
        assert!(
            found
                .iter()
                .any(|part| part.what.contains("nonlinear-viscous")),
            "{found:?}"
        );
        let bends = |arm: &Arm| {
            let mut joints = arm.links.iter();
            joints.any(|link| matches!(&link.joint, ArmJoint::Own(joint) if joint.bend != [0.0; 2]))
        };
        assert!(bends(&arm) && !bends(&plain));
        let words = |arm: &Arm| {
            mjcf::mjcf(arm, &[])
                .split("damping=\"")
                .nth(2)
                .map(|x| x.split('"').next().unwrap().split(' ').count())
        };
        assert_eq!([words(&arm), words(&plain)], [Some(3), Some(1)]);
    }
}
