//! The URDF of an identified chain, and a model file beside it that holds what a URDF cannot.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::arm::{Arm, ArmJoint, ArmLink, FormatSupport, OwnJoint};
use super::dissipative::below_zero;
use super::error::ExportError;
use super::prepared::{
    Drive, PreparedModel, drive, dynamics, hashed, inertial, placed, quoted, unended, words,
};
use super::standard::ParameterIdentifiability;
use cft_ident_core::robot::model::Model;
use cft_ident_core::robot::standard::{STANDARD, STANDARD_NAMES};
use cft_ident_core::robot::tree::Link;
use cft_ident_core::robot::tree::space::{Rotation, Vector, roll_pitch_yaw, turn};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_files::config::model_file::Parameter;
use cft_ident_files::config::robot_file::CoordinateLimits;
use cft_ident_files::config::{ModelFile, NO_LIMIT, WEIGHTLESS};

/// What a URDF can say; a drive's inertia has no element but one of Drake's own.
pub const SAYS: FormatSupport = FormatSupport {
    armature: false,
    couplings: false,
    armature_readers: Some("Drake"),
    gravity_skipped_by: Some("every program takes"),
};

/// The two files.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfFiles {
    pub urdf: String,
    pub side: String,
}

/// The URDF of a model as an arm, and its side file; `urdf_name` is how the side file names the URDF beside it,
/// `notes` stand at the head of both.
///
/// # Errors
/// [`ExportError::NoLinks`] for robots that no URDF can be of.
pub fn urdf(
    file: &ModelFile,
    model: &Model,
    arm: &Arm,
    urdf_name: &str,
    notes: &[String],
) -> Result<UrdfFiles, ExportError> {
    let PreparedModel {
        file,
        model,
        standard,
        ..
    } = &PreparedModel::of(file, model)?;
    let robot = &model.robot;
    let mut out = String::from("<?xml version=\"1.0\"?>\n<!--\n");
    let below = below_zero(file, model);
    let below = below.iter().map(String::as_str);
    let lines = notes.iter().map(String::as_str).chain(below).chain([""]);
    let of_inertials = arm.of_inertials.iter().map(String::as_str);
    for line in lines.chain(of_inertials).chain(IN_GENERAL) {
        let _ = writeln!(out, "  {}", unended(line));
    }
    out.push_str("-->\n<robot name=\"identified\" xmlns:drake=\"https://drake.mit.edu\">\n");
    let mut joints = JointNames(robot.joint_names().iter().cloned().collect());
    base(&mut out, arm, &mut joints);
    for (i, link) in arm.links.iter().enumerate() {
        let described = &robot.tree().links()[i];
        let place = placement(file, i, described, &drive(robot, described)?);
        joint(&mut out, arm, link, place);
        let determined = &standard.identifiability[i * STANDARD..(i + 1) * STANDARD];
        body(&mut out, link, determined);
    }
    for frame in &arm.frames {
        let joint = joints.fixed(&frame.name);
        fixed(
            &mut out,
            &joint,
            [&frame.link, &frame.name],
            [frame.xyz, frame.rpy],
        );
        weightless(&mut out, &frame.name);
    }
    for joint in arm
        .joints()
        .into_iter()
        .filter(|joint| joint.armature > 0.0)
    {
        transmission(&mut out, joint);
    }
    out.push_str("</robot>\n");
    Ok(UrdfFiles {
        urdf: out,
        side: side_file(file, robot, arm, urdf_name, notes)?,
    })
}

/// The link that stands still; where it is turned it hangs on one of the world.
fn base(out: &mut String, arm: &Arm, joints: &mut JointNames) {
    let Some(turn) = &arm.turn else {
        let _ = writeln!(out, "  <link name=\"{}\"/>", quoted(&arm.root));
        return;
    };
    let mut world = "world".to_owned();
    let taken = |name: &str| {
        arm.links.iter().any(|l| l.name == name) || arm.frames.iter().any(|f| f.name == name)
    };
    while taken(&world) {
        world.push_str("_frame");
    }
    let _ = writeln!(out, "  <link name=\"{}\"/>", quoted(&world));
    let joint = joints.fixed(&arm.root);
    fixed(
        out,
        &joint,
        [&world, &arm.root],
        [[0.0; 3], roll_pitch_yaw(turn)],
    );
    weightless(out, &arm.root);
}

/// Names of joints, each once.
struct JointNames(BTreeSet<String>);

impl JointNames {
    /// One for the joint that fixes a link.
    fn fixed(&mut self, link: &str) -> String {
        let mut joint = format!("{link}_fixed");
        while !self.0.insert(joint.clone()) {
            joint.push_str("_frame");
        }
        joint
    }
}

fn fixed(out: &mut String, joint: &str, [parent, child]: [&str; 2], [xyz, rpy]: [Vector; 2]) {
    let _ = write!(
        out,
        "\n  <joint name=\"{}\" type=\"fixed\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    \
         <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>\n",
        quoted(joint),
        quoted(parent),
        quoted(child),
        words(&xyz),
        words(&rpy),
    );
}

/// A link that weighs nothing and says so: PyBullet gives one that is silent a kilogram.
fn weightless(out: &mut String, name: &str) {
    let name = quoted(name);
    let _ = writeln!(out, "  <link name=\"{name}\">\n    {WEIGHTLESS}\n  </link>");
}

/// The inertia of a drive, in the words of Drake.
fn transmission(out: &mut String, joint: &OwnJoint) {
    let name = quoted(&joint.name);
    let _ = write!(
        out,
        "\n  <transmission name=\"{name}_drive\">\n    <type>transmission_interface/SimpleTransmission</type>\n    \
         <joint name=\"{name}\"/>\n    <actuator name=\"{name}\">\n      \
         <drake:rotor_inertia value=\"{:?}\"/>\n      <drake:gear_ratio value=\"1\"/>\n    </actuator>\n  </transmission>\n",
        joint.armature
    );
}

/// Of everything.
const IN_GENERAL: [&str; 4] = [
    "What stands over each link says which of its numbers the data determine; the others are no",
    "measurement. Drive inertias, couplings, friction and offsets are in the file beside this one;",
    "damping and friction are those nearest to the law there. Inertia of fixed frames is in the link",
    "that they hang on. A limit of 1e16 is one that is not known.",
];

/// Where a joint sits: position, then roll, pitch and yaw.
fn placement(file: &ModelFile, i: usize, link: &Link, drive: &Drive) -> [Vector; 2] {
    // what the robot file says in these words is kept to the last digit
    let section = file.robot.robot.link.get(i);
    let said = section.filter(|s| s.xyz.is_some() || s.rpy.is_some());
    let (rotation, origin) = placed(link, drive);
    let turned = matches!((drive, link.kind), (Drive::Rest(_), JointKind::Revolute));
    match said.filter(|_| !turned) {
        Some(s) => [origin, s.rpy.unwrap_or_default()],
        None => [origin, roll_pitch_yaw(&rotation)],
    }
}

fn joint(out: &mut String, arm: &Arm, link: &ArmLink, [xyz, rpy]: [Vector; 2]) {
    let unlimited = CoordinateLimits::default();
    let (name, limits) = match &link.joint {
        ArmJoint::Own(joint) => (joint.name.clone(), &joint.limits),
        ArmJoint::Mimic { name, .. } => (name.clone(), &unlimited),
        ArmJoint::Fixed => (format!("{}_joint", link.name), &unlimited),
    };
    let kind = match (&link.joint, link.kind, limits.position) {
        (ArmJoint::Fixed, ..) => "fixed",
        (_, JointKind::Prismatic, _) => "prismatic",
        (_, JointKind::Revolute, Some(_)) => "revolute",
        (_, JointKind::Revolute, None) => "continuous",
    };
    let parent = link
        .parent
        .map_or(&arm.root, |parent| &arm.links[parent].name);
    let _ = write!(
        out,
        "\n  <joint name=\"{}\" type=\"{kind}\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    \
         <origin xyz=\"{}\" rpy=\"{}\"/>\n",
        quoted(&name),
        quoted(parent),
        quoted(&link.name),
        words(&xyz),
        words(&rpy)
    );
    if kind != "fixed" {
        let _ = writeln!(out, "    <axis xyz=\"{}\"/>", words(&link.axis));
        limit(out, kind, limits);
    }
    match &link.joint {
        ArmJoint::Own(joint) => {
            let _ = writeln!(out, "    {}", dynamics([joint.damping, joint.friction]));
        }
        ArmJoint::Mimic {
            of, factor, offset, ..
        } => {
            let _ = writeln!(
                out,
                "    <mimic joint=\"{}\" multiplier=\"{factor:?}\" offset=\"{offset:?}\"/>",
                quoted(of)
            );
        }
        ArmJoint::Fixed => {}
    }
    out.push_str("  </joint>\n");
}

/// The limits of a joint that moves: one that is not known is none, where 0 would hold the joint.
fn limit(out: &mut String, kind: &str, limits: &CoordinateLimits) {
    if kind == "continuous" && limits.speed.is_none() && limits.torque.is_none() {
        return;
    }
    let ends = limits.position.unwrap_or([-NO_LIMIT, NO_LIMIT]);
    let ends = match kind {
        "continuous" => String::new(),
        _ => format!("lower=\"{:?}\" upper=\"{:?}\" ", ends[0], ends[1]),
    };
    let _ = writeln!(
        out,
        "    <limit {ends}effort=\"{:?}\" velocity=\"{:?}\"/>",
        limits.torque.unwrap_or(NO_LIMIT),
        limits.speed.unwrap_or(NO_LIMIT)
    );
}

/// A link, with which of its numbers the data determine.
fn body(out: &mut String, link: &ArmLink, determined: &[ParameterIdentifiability]) {
    let of = |what: ParameterIdentifiability| -> String {
        let names = STANDARD_NAMES.iter().zip(determined);
        let list: Vec<&str> = names
            .filter(|(_, t)| **t == what)
            .map(|(n, _)| *n)
            .collect();
        match list.is_empty() {
            true => "none".to_owned(),
            false => list.join(" "),
        }
    };
    let _ = write!(
        out,
        "  <!-- about the origin of the link: determined {}; only in sums with others {}; not at all {} -->\n  \
         <link name=\"{}\">\n    {}\n  </link>\n",
        of(ParameterIdentifiability::Alone),
        of(ParameterIdentifiability::InSum),
        of(ParameterIdentifiability::Nothing),
        quoted(&link.name),
        inertial(&link.body)
    );
}

/// What tells a file beside a URDF from any other.
pub const SIDE: &str = "# What the URDF cannot hold:";

/// A model file that takes links and inertials from the URDF beside it.
fn side_file(
    file: &ModelFile,
    robot: &Robot,
    arm: &Arm,
    urdf_name: &str,
    notes: &[String],
) -> Result<String, ExportError> {
    let mut side = file.clone();
    side.robot.robot.link.clear();
    side.robot.robot.urdf = Some(urdf_name.to_owned());
    side.robot.robot.frame.clear();
    side.links.clear();
    let mut places = 0..;
    side.effects
        .retain(|_| places.next().is_none_or(|i| !arm.held.contains(&i)));
    if let Some(turn) = &arm.turn {
        side.robot.robot.gravity = Some(arm.world_gravity());
        turn_room(&mut side, turn);
    }
    side.drive_inertia.clear();
    side.covariance = None;
    side.estimate_covariance = None;
    // base parameters come out of the URDF; what the drives add to them stands here
    let base = robot.parameters().iter().take(robot.groupings().len());
    let base: Vec<&str> = base.map(|p| &*p.name).collect();
    side.parameters
        .retain(|p| p.joint.is_some() || !base.contains(&p.name.as_str()));
    let drives: &[f64] = if robot.drive_inertia() {
        &arm.drives
    } else {
        &[]
    };
    for (j, value) in drives.iter().enumerate() {
        side.parameters.push(Parameter {
            name: cft_ident_files::config::DRIVE_INERTIA.to_owned(),
            theta: None,
            joint: robot.joint_names().get(j).cloned(),
            value: *value,
            consistent: None,
            std: None,
            unit: robot.joint_kind(j).inertia_unit().to_owned(),
            meaning: "inertia of the drive at the joint".to_owned(),
            verdict: None,
        });
    }
    Ok(format!(
        "{}{SIDE} drive inertias, couplings, friction, offsets. A model file: give\n\
         # it as -m; links and inertials are read from the URDF beside it.\n\n{}",
        hashed(notes),
        side.sections()?
    ))
}

/// Turns the room of the robot file with its base. A box that would stand askew is none.
fn turn_room(side: &mut ModelFile, standing: &Rotation) {
    let limits = &mut side.robot.limits;
    let straight = standing
        .iter()
        .flatten()
        .all(|x| (x.abs() - x.abs().round()).abs() < 1e-9);
    limits.bounds = limits.bounds.filter(|_| straight).map(|corners| {
        let [a, b] = corners.map(|corner| turn(standing, &corner));
        let pick = |f: fn(f64, f64) -> f64| std::array::from_fn(|k| f(a[k], b[k]));
        [pick(f64::min), pick(f64::max)]
    });
    for capsule in limits
        .capsule
        .iter_mut()
        .filter(|capsule| capsule.link == "base")
    {
        capsule.from = turn(standing, &capsule.from);
        capsule.to = turn(standing, &capsule.to);
    }
}
