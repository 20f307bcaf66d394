//! The user's own URDF with the inertia and the friction that were identified: meshes, names and frames stay.

use std::collections::{BTreeMap, BTreeSet};

use super::arm::{Arm, ArmJoint, ArmLink};
use super::error::ExportError;
use super::prepared::{dynamics, inertial, words};
use cft_ident_core::robot::tree::{Coordinate, Link};
use cft_ident_files::config::{RobotFile, UrdfReplacement};

/// Numbers of frames that differ by less are one: URDFs have six digits.
const SIX_DIGITS: f64 = 2e-5;

/// What replaces inertials and friction in the URDF that `source` was read from; `file` names it in errors.
/// `names` are what a controller calls the joints of the model, where it calls them otherwise. Joints are
/// matched by name, and each joint's frame must be that of the model.
///
/// # Errors
/// [`ExportError::OtherUrdf`] for a joint that is not there or sits elsewhere.
pub fn replacement(
    arm: &Arm,
    source: &RobotFile,
    file: &str,
    names: &BTreeMap<String, String>,
) -> Result<UrdfReplacement, ExportError> {
    let robot = source.robot();
    let (links, joints) = (robot.tree().links(), robot.joint_names());
    let other = |problem: String, remedy: &'static str| ExportError::OtherUrdf {
        file: file.to_owned(),
        problem,
        remedy,
    };
    let moved_by = |name: &str| {
        links.iter().position(|link| match &link.coordinate {
            Coordinate::Joint(j) => joints[*j] == name,
            Coordinate::Follows(_) => false,
        })
    };
    let mut found: Vec<usize> = Vec::new();
    let mut out = UrdfReplacement::default();
    for link in &arm.links {
        let at = match &link.joint {
            ArmJoint::Own(joint) => {
                let called = names.get(&joint.name).map_or(&joint.name, |name| name);
                let at = moved_by(&joint.name).or_else(|| moved_by(called));
                let problem = || format!("has no joint `{called}`; it has {}", joints.join(", "));
                let remedy = "give the URDF of this robot, or name its joints by `name` in [log.joint] of the robot file";
                at.ok_or_else(|| other(problem(), remedy))?
            }
            _ => {
                let at = links.iter().position(|l| l.name == link.name);
                let problem = || format!("has no link `{}`, which follows a joint", link.name);
                at.ok_or_else(|| other(problem(), "give the URDF of this robot"))?
            }
        };
        let parent = link.parent.map(|parent| found[parent]);
        if let Some(differs) = difference(link, &links[at], parent) {
            return Err(other(
                format!(
                    "link `{}` is not where the model has `{}`: {differs}",
                    links[at].name, link.name
                ),
                "identify with a robot file of this URDF (`cft-ident new NAME --urdf FILE`), so that frames are one",
            ));
        }
        found.push(at);
        let name = &links[at].name;
        out.inertials.insert(name.clone(), inertial(&link.body));
        let frames = source.robot.frame.iter();
        let lumped = frames.filter(|frame| frame.link == *name);
        out.bare.extend(lumped.map(|frame| frame.name.clone()));
        if let (ArmJoint::Own(joint), Coordinate::Joint(j)) = (&link.joint, &links[at].coordinate) {
            let dynamics = dynamics([joint.damping, joint.friction]);
            out.dynamics.insert(joints[*j].clone(), dynamics);
        }
    }
    let inertials: BTreeSet<&String> = out.inertials.keys().collect();
    out.bare.retain(|name| !inertials.contains(name));
    Ok(out)
}

/// Whether the joints of the URDF have the names of the model's, in the same order.
pub fn same_names(arm: &Arm, source: &RobotFile) -> bool {
    let own: Vec<&str> = arm.joints().iter().map(|j| j.name.as_str()).collect();
    source.robot().joint_names() == own
}

/// In what two links differ, in words.
fn difference(link: &ArmLink, there: &Link, parent: Option<usize>) -> Option<String> {
    if there.parent != parent {
        return Some("it hangs on another link".to_owned());
    }
    if there.kind != link.kind {
        return Some("the one joint slides and the other turns".to_owned());
    }
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > SIX_DIGITS);
    if off(&link.origin, &there.origin) {
        let [a, b] = [words(&there.origin), words(&link.origin)];
        return Some(format!("its origin is {a} m and not {b} m"));
    }
    if (0..3).any(|i| off(&link.rotation[i], &there.rotation[i])) {
        return Some("its frame is turned otherwise".to_owned());
    }
    off(&link.axis, &there.axis).then(|| {
        let [a, b] = [words(&there.axis), words(&link.axis)];
        format!("its axis is {a} and not {b}")
    })
}
