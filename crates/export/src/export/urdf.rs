//! The URDF of an identified chain, and a model file beside it that holds what a URDF cannot.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::dissipative::{below_zero, damping_and_friction};
use super::error::ExportError;
use super::prepared::{
    Drive, PreparedModel, drive, dynamics, hashed, inertial, joint_name, placed, quoted, root,
    unended, words,
};
use super::standard::{ParameterIdentifiability, StandardParameters};
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::standard::{Body, STANDARD, STANDARD_NAMES};
use cft_ident_core::robot::tree::Link;
use cft_ident_core::robot::tree::space::{Vector, roll_pitch_yaw};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;

/// The two files.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfFiles {
    pub urdf: String,
    pub side: String,
}

/// The URDF of a model and its side file; `urdf_name` is how the side file names the URDF beside it,
/// `notes` stand at the head of both.
///
/// # Errors
/// [`ExportError::NoLinks`] for robots that no URDF can be of; [`ExportError::NoMass`].
pub fn urdf(
    file: &ModelFile,
    model: &Model,
    urdf_name: &str,
    notes: &[String],
) -> Result<UrdfFiles, ExportError> {
    let PreparedModel {
        file,
        model,
        standard,
        of_inertials,
    } = &PreparedModel::of(file, model)?;
    let robot = &model.robot;
    let mut out = String::from("<?xml version=\"1.0\"?>\n<!--\n");
    let below = below_zero(file, model);
    let below = below.iter().map(String::as_str);
    let lines = notes.iter().map(String::as_str).chain(below).chain([""]);
    for line in lines.chain(of_inertials.iter().copied()).chain(IN_GENERAL) {
        let _ = writeln!(out, "  {}", unended(line));
    }
    let _ = writeln!(
        out,
        "-->\n<robot name=\"identified\">\n  <link name=\"{}\"/>",
        root(robot, file)
    );
    for (i, link) in robot.tree().links().iter().enumerate() {
        joint(&mut out, model, file, i, link)?;
        body(&mut out, i, link, standard)?;
    }
    frames(&mut out, robot, file);
    out.push_str("</robot>\n");
    Ok(UrdfFiles {
        urdf: out,
        side: side_file(file, robot, standard, urdf_name, notes)?,
    })
}

/// Of everything.
const IN_GENERAL: [&str; 4] = [
    "What stands over each link says which of its numbers the data determine; the others are no",
    "measurement. Drive inertias, couplings, friction and offsets are in the file beside this one;",
    "damping and friction here repeat viscous and Coulomb friction where that is the law. Inertia",
    "of fixed frames is in the link that they hang on. A limit of 0 is one that is not known.",
];

/// Frames that are fixed to links, each as a link without inertia.
fn frames(out: &mut String, robot: &Robot, file: &ModelFile) {
    let mut taken: BTreeSet<String> = robot.joint_names().iter().cloned().collect();
    for frame in &file.robot.robot.frame {
        let mut joint = format!("{}_fixed", frame.name);
        while !taken.insert(joint.clone()) {
            joint.push_str("_frame");
        }
        let _ = write!(
            out,
            "\n  <joint name=\"{}\" type=\"fixed\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    \
             <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>\n  <link name=\"{2}\"/>\n",
            quoted(&joint),
            quoted(&frame.link),
            quoted(&frame.name),
            words(&frame.xyz),
            words(&frame.rpy),
        );
    }
}

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

fn joint(
    out: &mut String,
    model: &Model,
    file: &ModelFile,
    i: usize,
    link: &Link,
) -> Result<(), ExportError> {
    let robot = &model.robot;
    let drive = drive(robot, link)?;
    let name = joint_name(robot, link, &drive);
    let limits = match drive {
        Drive::Joint(_) => file.robot.limits.get(&name).cloned(),
        _ => None,
    };
    let limits = limits.unwrap_or_default();
    let kind = match (&drive, link.kind, limits.position) {
        (Drive::Rest(_), ..) => "fixed",
        (_, JointKind::Prismatic, _) => "prismatic",
        (_, JointKind::Revolute, Some(_)) => "revolute",
        (_, JointKind::Revolute, None) => "continuous",
    };
    let parent = match link.parent {
        None => root(robot, file),
        Some(parent) => robot.tree().links()[parent].name.clone(),
    };
    let [xyz, rpy] = placement(file, i, link, &drive);
    let _ = write!(
        out,
        "\n  <joint name=\"{}\" type=\"{kind}\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    \
         <origin xyz=\"{}\" rpy=\"{}\"/>\n",
        quoted(&name),
        quoted(&parent),
        quoted(&link.name),
        words(&xyz),
        words(&rpy)
    );
    if kind != "fixed" {
        let _ = writeln!(out, "    <axis xyz=\"{}\"/>", words(&link.axis));
        if kind != "continuous" || limits.speed.is_some() || limits.torque.is_some() {
            let ends = limits.position.map_or(String::new(), |[low, high]| {
                format!("lower=\"{low:?}\" upper=\"{high:?}\" ")
            });
            let _ = writeln!(
                out,
                "    <limit {ends}effort=\"{:?}\" velocity=\"{:?}\"/>",
                limits.torque.unwrap_or(0.0),
                limits.speed.unwrap_or(0.0)
            );
        }
    }
    match drive {
        Drive::Joint(j) => {
            if let law @ JointFriction::ViscousCoulomb(_) = &model.friction[j] {
                let loss = damping_and_friction(law).map(|x| x.max(0.0));
                let _ = writeln!(out, "    {}", dynamics(loss));
            }
        }
        Drive::Mimic(joint, factor, offset) => {
            let _ = writeln!(
                out,
                "    <mimic joint=\"{}\" multiplier=\"{factor:?}\" offset=\"{offset:?}\"/>",
                quoted(&joint)
            );
        }
        Drive::Rest(_) => {}
    }
    out.push_str("  </joint>\n");
    Ok(())
}

fn body(
    out: &mut String,
    i: usize,
    link: &Link,
    standard: &StandardParameters,
) -> Result<(), ExportError> {
    let range = i * STANDARD..(i + 1) * STANDARD;
    let values: [f64; STANDARD] = std::array::from_fn(|k| standard.values[range.start + k]);
    let shown = &standard.identifiability[range];
    let of = |what: ParameterIdentifiability| -> String {
        let names = STANDARD_NAMES.iter().zip(shown);
        let list: Vec<&str> = names
            .filter(|(_, t)| **t == what)
            .map(|(n, _)| *n)
            .collect();
        match list.is_empty() {
            true => "none".to_owned(),
            false => list.join(" "),
        }
    };
    let (m, moment) = (values[9], &values[6..9]);
    let size = moment.iter().map(|x| x * x).sum::<f64>().sqrt();
    // a centre of gravity a kilometre away would cost the digits of the inertia
    if size > 1e3 * m.abs() {
        return Err(ExportError::NoMass {
            link: link.name.clone(),
            mass: m,
            moment: size,
        });
    }
    let _ = write!(
        out,
        "  <!-- about the origin of the link: determined {}; only in sums with others {}; not at all {} -->\n  \
         <link name=\"{}\">\n    {}\n  </link>\n",
        of(ParameterIdentifiability::Alone),
        of(ParameterIdentifiability::InSum),
        of(ParameterIdentifiability::Nothing),
        quoted(&link.name),
        inertial(&Body::of(&values))
    );
    Ok(())
}

/// What tells a file beside a URDF from any other.
pub const SIDE: &str = "# What the URDF cannot hold:";

/// A model file that takes links and inertials from the URDF beside it.
fn side_file(
    file: &ModelFile,
    robot: &Robot,
    standard: &StandardParameters,
    urdf_name: &str,
    notes: &[String],
) -> Result<String, ExportError> {
    let mut side = file.clone();
    side.robot.robot.link.clear();
    side.robot.robot.urdf = Some(urdf_name.to_owned());
    side.robot.robot.frame.clear();
    side.links.clear();
    side.drive_inertia.clear();
    side.covariance = None;
    side.estimate_covariance = None;
    // base parameters come out of the URDF; what the drives add to them stands here
    let base = robot.parameters().iter().take(robot.groupings().len());
    let base: Vec<&str> = base.map(|p| &*p.name).collect();
    side.parameters
        .retain(|p| p.joint.is_some() || !base.contains(&p.name.as_str()));
    let first = robot.tree().links().len() * STANDARD;
    for (j, value) in standard.values.iter().skip(first).enumerate() {
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
