//! The URDF of an identified chain, and a model file beside it that holds what a URDF cannot.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::dissipative::{below_zero, dissipative};
use super::standard::{Identifiability, Standard, nearest};
use super::{ExportError, single};
use crate::config::ModelFile;
use crate::config::model_file::Parameter;
use crate::config::serial_section::InertialSection;
use crate::robot::model::Model;
use crate::robot::standard::{Body, STANDARD, STANDARD_NAMES};
use crate::robot::tree::space::{Vector, about, add, product, roll_pitch_yaw, times, turn};
use crate::robot::tree::{Coordinate, Link};
use crate::robot::{JointKind, Robot};

/// The two files.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    pub urdf: String,
    pub side: String,
}

/// The URDF of a model and its side file; `urdf_name` is how the side file names the URDF beside it,
/// `notes` stand at the head of both.
///
/// # Errors
/// [`ExportError::NotInUrdf`] for robots that no URDF can be of; [`ExportError::NoMass`].
pub fn urdf(
    file: &ModelFile,
    model: &Model,
    urdf_name: &str,
    notes: &[String],
) -> Result<Exported, ExportError> {
    let robot = &model.robot;
    if robot.transmission().coordinates().is_some() {
        return Err(ExportError::NotInUrdf {
            what: "the pantograph: its q3 = d + L4 sin(q4 + q5) + L4 sin q4 is no multiple of another \
                   joint, which is all that <mimic> can say"
                .to_owned(),
            remedy: "export it with --c or --rust",
        });
    }
    let unit = file.robot.inertial_torque_unit();
    if !matches!(unit, "N" | "Nm") {
        return Err(ExportError::NotInUrdf {
            what: format!("an inertia in {unit} per acceleration"),
            remedy: "give `torque_scale` in [log.joint] of the robot file and fit again, or export it with \
                     --c or --rust",
        });
    }
    if !robot.knows_links() {
        let (file, model) = single::chain(file, model);
        return urdf(&file, &model, urdf_name, notes);
    }
    let found = feasible(file, robot);
    let (priors, drives) = match &found {
        Some((bodies, drives)) => (bodies.clone(), drives.as_slice()),
        None => {
            let links = file.robot.robot.link.iter();
            (links.map(|l| l.inertial.clone()).collect(), &[][..])
        }
    };
    let standard = nearest(robot, &model.theta, &priors, drives);
    let of_inertials = match (&found, standard.is_prior) {
        (Some(_), true) => &FEASIBLE[..],
        (Some(_), false) => &NEAR_FEASIBLE,
        (None, _) => &NEAREST,
    };
    let mut out = String::from("<?xml version=\"1.0\"?>\n<!--\n");
    let below = below_zero(file, model);
    let below = below.iter().map(String::as_str);
    let lines = notes.iter().map(String::as_str).chain(below).chain([""]);
    for line in lines.chain(of_inertials.iter().copied()).chain(IN_GENERAL) {
        // two hyphens would end the comment early
        let _ = writeln!(out, "  {}", line.replace("--", "- -"));
    }
    let _ = writeln!(
        out,
        "-->\n<robot name=\"identified\">\n  <link name=\"{}\"/>",
        root(robot, file)
    );
    for (i, link) in robot.tree().links().iter().enumerate() {
        joint(&mut out, model, file, i, link)?;
        body(&mut out, i, link, &standard)?;
    }
    frames(&mut out, robot, file);
    out.push_str("</robot>\n");
    Ok(Exported {
        urdf: out,
        side: side_file(file, robot, &standard, urdf_name, notes)?,
    })
}

/// What the head says of inertials that are nearest to the robot file's.
const NEAREST: [&str; 3] = [
    "Inertials: of all that give the identified torques, those nearest to the prior of the robot",
    "file (1 kg in the origin of a link that has none). They need not be those of a body that can",
    "be: `lsq --feasible` finds links that can.",
];
/// Of those of a feasible fit.
const FEASIBLE: [&str; 2] = [
    "Inertials: those of the [[link]] tables of the model, of links that can exist and give the",
    "identified torques, as `lsq --feasible` found them.",
];
/// Of a feasible fit whose parameters were changed afterwards.
const NEAR_FEASIBLE: [&str; 3] = [
    "Inertials: of all that give the torques of the model's parameters, those nearest to its",
    "[[link]] tables, which give other torques: the parameters were changed after they were found.",
    "They need not be those of a body that can be.",
];
/// Of everything.
const IN_GENERAL: [&str; 4] = [
    "What stands over each link says which of its numbers the data determine; the others are no",
    "measurement. Drive inertias, couplings, friction and offsets are in the file beside this one;",
    "damping and friction here repeat viscous and Coulomb friction where that is the law. Inertia",
    "of fixed frames is in the link that they hang on. A limit of 0 is one that is not known.",
];

/// Bodies and drives of a feasible fit, where the model has them for every link.
fn feasible(file: &ModelFile, robot: &Robot) -> Option<(Vec<Option<InertialSection>>, Vec<f64>)> {
    let bodies = robot.tree().links().iter().map(|link| {
        let body = file.links.iter().find(|body| body.name == link.name)?;
        Some(InertialSection {
            mass: body.mass,
            centre: body.centre,
            inertia: body.inertia,
        })
    });
    let bodies: Vec<Option<InertialSection>> = bodies.collect();
    let drives = match robot.drive_inertia() {
        true => {
            let names = robot.joint_names().iter();
            names
                .map(|name| file.drive_inertia.get(name).copied())
                .collect()
        }
        false => Some(Vec::new()),
    };
    bodies
        .iter()
        .all(Option::is_some)
        .then_some((bodies, drives?))
}

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

/// Name of the link that stands still.
fn root(robot: &Robot, file: &ModelFile) -> String {
    let mut name = "base".to_owned();
    let frames = &file.robot.robot.frame;
    while robot.tree().links().iter().any(|l| l.name == name)
        || frames.iter().any(|f| f.name == name)
    {
        name.push_str("_frame");
    }
    name
}

/// A text inside an attribute.
fn quoted(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Numbers that are read back bit for bit.
fn words(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    all.join(" ")
}

/// What moves a link, in the words of a URDF.
enum Drive {
    /// The independent joint of this index.
    Joint(usize),
    /// A multiple of one: its name, the factor, an offset.
    Mimic(String, f64, f64),
    /// Nothing: the link is at rest at this offset.
    Rest(f64),
}

fn drive(robot: &Robot, link: &Link) -> Result<Drive, ExportError> {
    let follows = match &link.coordinate {
        Coordinate::Joint(j) => return Ok(Drive::Joint(*j)),
        Coordinate::Follows(follows) => follows,
    };
    match (&follows.linear[..], &follows.sines[..]) {
        ([], []) => Ok(Drive::Rest(follows.offset)),
        ([(j, factor)], []) => {
            let joint = robot.joint_names()[*j].clone();
            Ok(Drive::Mimic(joint, *factor, follows.offset))
        }
        _ => Err(ExportError::NotInUrdf {
            what: format!(
                "link `{}`, which follows several joints or the sine of one",
                link.name
            ),
            remedy: "export it with --c or --rust",
        }),
    }
}

/// Where a joint sits: position, then roll, pitch and yaw.
fn placement(file: &ModelFile, i: usize, link: &Link, drive: &Drive) -> [Vector; 2] {
    // what the robot file says in these words is kept to the last digit
    let section = file.robot.robot.link.get(i);
    let said = section.filter(|s| s.xyz.is_some() || s.rpy.is_some());
    let (xyz, rpy) = match said {
        Some(s) => (s.xyz.unwrap_or_default(), s.rpy.unwrap_or_default()),
        None => (link.origin, roll_pitch_yaw(&link.rotation)),
    };
    match (drive, link.kind) {
        (Drive::Rest(at), JointKind::Revolute) => {
            let turned = product(&link.rotation, &about(&link.axis, *at));
            [xyz, roll_pitch_yaw(&turned)]
        }
        (Drive::Rest(at), JointKind::Prismatic) => {
            let moved = turn(&link.rotation, &times(*at, &link.axis));
            [add(&xyz, &moved), rpy]
        }
        _ => [xyz, rpy],
    }
}

/// The joint before a link.
fn joint(
    out: &mut String,
    model: &Model,
    file: &ModelFile,
    i: usize,
    link: &Link,
) -> Result<(), ExportError> {
    let robot = &model.robot;
    let names = robot.joint_names();
    let drive = drive(robot, link)?;
    let mut name = format!("{}_joint", link.name);
    while names.contains(&name) {
        name.push_str("_follows");
    }
    let mut limits = None;
    if let Drive::Joint(j) = drive {
        name = names[j].clone();
        limits = file.robot.limits.get(&name);
    }
    let limits = limits.cloned().unwrap_or_default();
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
            if let Some([damping, friction]) = dissipative(model, j) {
                let _ = writeln!(
                    out,
                    "    <dynamics damping=\"{damping:?}\" friction=\"{friction:?}\"/>"
                );
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

fn body(out: &mut String, i: usize, link: &Link, standard: &Standard) -> Result<(), ExportError> {
    let range = i * STANDARD..(i + 1) * STANDARD;
    let values: [f64; STANDARD] = std::array::from_fn(|k| standard.values[range.start + k]);
    let told = &standard.identifiability[range];
    let of = |what: Identifiability| -> String {
        let names = STANDARD_NAMES.iter().zip(told);
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
    let body = Body::of(&values);
    let keys = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
    let inertia: Vec<String> = keys
        .iter()
        .zip(body.inertia)
        .map(|(k, x)| format!("{k}=\"{x:?}\""))
        .collect();
    let _ = write!(
        out,
        "  <!-- about the origin of the link: determined {}; only in sums with others {}; not at all {} -->\n  \
         <link name=\"{}\">\n    <inertial>\n      <origin xyz=\"{}\" rpy=\"0 0 0\"/>\n      \
         <mass value=\"{m:?}\"/>\n      <inertia {}/>\n    </inertial>\n  </link>\n",
        of(Identifiability::Alone),
        of(Identifiability::InSum),
        of(Identifiability::Nothing),
        quoted(&link.name),
        words(&body.centre),
        inertia.join(" ")
    );
    Ok(())
}

/// A model file that takes links and inertials from the URDF beside it.
fn side_file(
    file: &ModelFile,
    robot: &Robot,
    standard: &Standard,
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
    side.effects.clear();
    // base parameters come out of the URDF; what the drives add to them stands here
    let base: Vec<&str> = robot
        .parameters()
        .iter()
        .take(robot.groupings().len())
        .map(|p| &*p.name)
        .collect();
    side.parameters
        .retain(|p| p.joint.is_some() || !base.contains(&p.name.as_str()));
    let first = robot.tree().links().len() * STANDARD;
    for (j, value) in standard.values.iter().skip(first).enumerate() {
        side.parameters.push(Parameter {
            name: crate::config::DRIVE_INERTIA.to_owned(),
            theta: None,
            joint: robot.joint_names().get(j).cloned(),
            value: *value,
            std: None,
            unit: robot.joint_kind(j).inertia_unit().to_owned(),
            meaning: "inertia of the drive at the joint".to_owned(),
            verdict: None,
        });
    }
    let mut text = String::new();
    for line in notes {
        let _ = writeln!(text, "{}", format!("# {line}").trim_end());
    }
    text.push_str(
        "# What the URDF cannot hold: drive inertias, couplings, friction, offsets. A model file: give\n\
         # it as -m; links and inertials are read from the URDF beside it.\n\n",
    );
    text.push_str(&side.sections()?);
    Ok(text)
}
