//! SDFormat 1.9, as Gazebo reads it: links with inertials, joints with damping, friction and limits.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::arm::{Arm, ArmJoint, ArmLink, FormatSupport, OwnJoint};
use super::prepared::{MOMENTS, UsedNames, in_comment, quoted, words};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::tree::space::roll_pitch_yaw;

/// What SDF can say: a drive's inertia has no element but one of Drake's own, and joints share nothing.
pub const SAYS: FormatSupport = FormatSupport {
    armature: false,
    couplings: false,
    armature_readers: Some("Drake"),
    gravity_skipped_by: Some("Drake takes"),
};

/// Largest number that stands for none.
const NONE: &str = "1e16";

/// The text of a model in a world of its own, where gravity is the model's; `notes` stand at its head.
pub fn sdf(arm: &Arm, notes: &[String]) -> String {
    let arm = &with_names_apart(arm);
    let mut out = format!("<?xml version=\"1.0\"?>\n<!--\n{}", in_comment(notes));
    let root = quoted(&arm.root);
    let _ = write!(
        out,
        "-->\n<sdf version=\"1.9\" xmlns:drake=\"drake.mit.edu\">\n  <world name=\"identified\">\n    \
         <gravity>{}</gravity>\n    <model name=\"identified\">\n      <link name=\"{root}\">\n        \
         <pose>0 0 0 {}</pose>\n      </link>\n      <joint name=\"{root}_to_world\" type=\"fixed\">\n        <parent>world</parent>\n        \
         <child>{root}</child>\n      </joint>\n",
        words(&arm.world_gravity()),
        words(&roll_pitch_yaw(&arm.standing()))
    );
    for link in &arm.links {
        let parent = link
            .parent
            .map_or(&arm.root, |parent| &arm.links[parent].name);
        let (name, parent) = (quoted(&link.name), quoted(parent));
        let body = &link.body;
        let _ = write!(
            out,
            "      <link name=\"{name}\">\n        <pose relative_to=\"{parent}\">{} {}</pose>\n        \
             <inertial>\n          <pose>{} 0 0 0</pose>\n          <mass>{:?}</mass>\n          <inertia>",
            words(&link.origin),
            words(&roll_pitch_yaw(&link.rotation)),
            words(&body.centre),
            body.mass
        );
        for (key, x) in MOMENTS.iter().zip(body.inertia) {
            let _ = write!(out, "<{key}>{x:?}</{key}>");
        }
        out.push_str("</inertia>\n        </inertial>\n      </link>\n");
        joint(&mut out, link, &parent);
    }
    for frame in &arm.frames {
        let _ = writeln!(
            out,
            "      <frame name=\"{}\" attached_to=\"{}\">\n        <pose>{} {}</pose>\n      </frame>",
            quoted(&frame.name),
            quoted(&frame.link),
            words(&frame.xyz),
            words(&frame.rpy)
        );
    }
    out.push_str("    </model>\n  </world>\n</sdf>\n");
    out
}

/// Links and frames that are called as a joint is are told from it, for in a model of SDF no two parts have one name.
fn with_names_apart(arm: &Arm) -> Arm {
    let mut arm = arm.clone();
    let joints = arm.links.iter().filter_map(|link| match &link.joint {
        ArmJoint::Own(joint) => Some(joint.name.clone()),
        ArmJoint::Mimic { name, .. } => Some(name.clone()),
        ArmJoint::Fixed => None,
    });
    let joints: BTreeSet<String> = joints.collect();
    let links = arm.links.iter().map(|link| &link.name);
    let frames = arm.frames.iter().map(|frame| &frame.name);
    let others = links.chain(frames).chain([&arm.root]).cloned();
    let mut names = UsedNames(joints.iter().cloned().chain(others).collect());
    let mut told_apart = |name: &mut String, kind: &str| {
        if joints.contains(name) {
            *name = names.give(format!("{name}_{kind}"));
        }
    };
    for frame in &mut arm.frames {
        told_apart(&mut frame.name, "frame");
    }
    let links = arm.links.iter_mut().map(|link| &mut link.name);
    for link in links.chain([&mut arm.root]) {
        let old = link.clone();
        told_apart(link, "link");
        let carried = arm.frames.iter_mut().filter(|frame| frame.link == old);
        carried.for_each(|frame| frame.link.clone_from(link));
    }
    arm
}

fn joint(out: &mut String, link: &ArmLink, parent: &str) {
    let child = quoted(&link.name);
    let (name, limits, loss, more, mimic) = match &link.joint {
        ArmJoint::Fixed => {
            let _ = write!(
                out,
                "      <joint name=\"{child}_joint\" type=\"fixed\">\n        <parent>{parent}</parent>\n        \
                 <child>{child}</child>\n      </joint>\n"
            );
            return;
        }
        ArmJoint::Own(joint) => (
            quoted(&joint.name),
            joint.limits.clone(),
            [joint.damping, joint.friction],
            rotor(joint),
            String::new(),
        ),
        ArmJoint::Mimic {
            name,
            of,
            factor,
            offset,
        } => (
            quoted(name),
            Default::default(),
            [0.0; 2],
            String::new(),
            format!(
                "          <mimic joint=\"{}\"><multiplier>{factor:?}</multiplier><offset>{offset:?}</offset>\
                 <reference>0</reference></mimic>\n",
                quoted(of)
            ),
        ),
    };
    let kind = match link.kind {
        JointKind::Revolute => "revolute",
        JointKind::Prismatic => "prismatic",
    };
    let shown = |x: Option<f64>| x.map_or(NONE.to_owned(), |x| format!("{x:?}"));
    let [low, high] = match limits.position {
        Some(ends) => ends.map(|x| format!("{x:?}")),
        None => [format!("-{NONE}"), NONE.to_owned()],
    };
    let _ = write!(
        out,
        "      <joint name=\"{name}\" type=\"{kind}\">\n        <parent>{parent}</parent>\n        \
         <child>{child}</child>\n        <axis>\n          <xyz>{}</xyz>\n          \
         <limit><lower>{low}</lower><upper>{high}</upper><effort>{}</effort><velocity>{}</velocity></limit>\n          \
         <dynamics><damping>{:?}</damping><friction>{:?}</friction></dynamics>\n{mimic}        </axis>\n{more}      </joint>\n",
        words(&link.axis),
        shown(limits.torque),
        shown(limits.speed),
        loss[0],
        loss[1]
    );
}

/// The inertia of a drive, for Drake.
fn rotor(joint: &OwnJoint) -> String {
    match joint.armature > 0.0 {
        true => format!(
            "        <drake:rotor_inertia>{:?}</drake:rotor_inertia>\n        \
             <drake:gear_ratio>1</drake:gear_ratio>\n",
            joint.armature
        ),
        false => String::new(),
    }
}
