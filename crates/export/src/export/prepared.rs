//! A model as links with inertials: what URDF, MJCF, SDF and USD have in common.

use std::collections::BTreeSet;

use super::error::ExportError;
use super::single;
use super::standard::{StandardParameters, nearest};
use cft_ident_core::robot::model::Model;
use cft_ident_core::robot::standard::Body;
use cft_ident_core::robot::tree::space::{Rotation, Vector, about, add, product, times, turn};
use cft_ident_core::robot::tree::{Coordinate, Link};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::serial_section::InertialSection;

/// A model whose links have bodies.
pub(super) struct PreparedModel {
    /// The model's file; that of a chain of one link where the model is of a single joint.
    pub file: ModelFile,
    pub model: Model,
    /// Standard parameters of links and drives.
    pub standard: StandardParameters,
    /// What is said of where they come from.
    pub of_inertials: &'static [&'static str],
}

impl PreparedModel {
    /// Links of a model.
    ///
    /// # Errors
    /// [`ExportError::NoLinks`] for robots that no such file can be of.
    pub fn of(file: &ModelFile, model: &Model) -> Result<Self, ExportError> {
        let robot = &model.robot;
        if robot.transmission().coordinates().is_some() {
            return Err(ExportError::NoLinks {
                what: "the pantograph: its q3 = d + L4 sin(q4 + q5) + L4 sin q4 is no multiple of another \
                       joint, which is all that they can say of one that follows"
                    .to_owned(),
                remedy: "export it with --c or --rust",
            });
        }
        let unit = file.robot.inertial_torque_unit();
        if !matches!(unit, "N" | "Nm") {
            return Err(ExportError::NoLinks {
                what: format!("an inertia in {unit} per acceleration"),
                remedy: "give `torque_scale` in [log.joint] of the robot file and fit again, or export it with \
                         --c or --rust",
            });
        }
        if !robot.knows_links() {
            let (file, model) = single::chain(file, model);
            return Self::of(&file, &model);
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
        Ok(Self {
            file: file.clone(),
            model: model.clone(),
            standard,
            of_inertials,
        })
    }
}

/// Rotation and origin of a link's frame in that of the link before.
pub(super) fn placed(link: &Link, drive: &Drive) -> (Rotation, Vector) {
    let (rotation, origin) = (link.rotation, link.origin);
    match (drive, link.kind) {
        (Drive::Rest(at), JointKind::Revolute) => {
            (product(&rotation, &about(&link.axis, *at)), origin)
        }
        (Drive::Rest(at), JointKind::Prismatic) => {
            let moved = turn(&rotation, &times(*at, &link.axis));
            (rotation, add(&origin, &moved))
        }
        _ => (rotation, origin),
    }
}

/// Names that are given away, each once.
#[derive(Default)]
pub(super) struct UsedNames(pub(super) BTreeSet<String>);

impl UsedNames {
    /// Gives a name away, with underscores behind it where it is taken.
    pub(super) fn give(&mut self, mut name: String) -> String {
        while !self.0.insert(name.clone()) {
            name.push('_');
        }
        name
    }
}

pub(super) fn joint_name(robot: &Robot, link: &Link, drive: &Drive) -> String {
    let names = robot.joint_names();
    if let Drive::Joint(j) = drive {
        return names[*j].clone();
    }
    let mut name = format!("{}_joint", link.name);
    while names.contains(&name) {
        name.push_str("_follows");
    }
    name
}

/// What moves a link, in the words of files of links.
pub(super) enum Drive {
    /// The independent joint of this index.
    Joint(usize),
    /// A multiple of one: its name, the factor, an offset.
    Mimic(String, f64, f64),
    /// Nothing: the link is at rest at this offset.
    Rest(f64),
}

pub(super) fn drive(robot: &Robot, link: &Link) -> Result<Drive, ExportError> {
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
        _ => Err(ExportError::NoLinks {
            what: format!(
                "link `{}`, which follows several joints or the sine of one",
                link.name
            ),
            remedy: "export it with --c or --rust",
        }),
    }
}

/// Name of the link that stands still.
pub(super) fn root(robot: &Robot, file: &ModelFile) -> String {
    let mut name = "base".to_owned();
    let frames = &file.robot.robot.frame;
    let links = robot.tree().links();
    while links.iter().any(|l| l.name == name) || frames.iter().any(|f| f.name == name) {
        name.push_str("_frame");
    }
    name
}

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
    let bodies: Option<Vec<InertialSection>> = bodies.collect();
    let drives = match robot.drive_inertia() {
        true => (robot.joint_names().iter())
            .map(|name| file.drive_inertia.get(name).copied())
            .collect(),
        false => Some(Vec::new()),
    };
    Some((bodies?.into_iter().map(Some).collect(), drives?))
}

/// What the head says of inertials that are nearest to the robot file's.
const NEAREST: [&str; 3] = [
    "Inertials: of all that give the identified torques, those nearest to the prior of the robot",
    "file (1 kg in the origin of a link that has none). They need not be those of a body that can",
    "be: a fit without --unconstrained finds links that can.",
];
/// Of those of a feasible fit.
const FEASIBLE: [&str; 2] = [
    "Inertials: those of the [[link]] tables of the model, of links that can exist and give the",
    "torques of the model's consistent parameters.",
];
/// Of a feasible fit whose parameters were changed afterwards.
const NEAR_FEASIBLE: [&str; 3] = [
    "Inertials: of all that give the torques of the model's parameters, those nearest to its",
    "[[link]] tables, which give other torques: the parameters were changed after they were found.",
    "They need not be those of a body that can be.",
];

/// Lines that begin with the mark of a comment.
pub(super) fn hashed(lines: &[String]) -> String {
    let each = lines.iter();
    each.map(|line| format!("# {line}").trim_end().to_owned() + "\n")
        .collect()
}

/// Lines inside a comment of XML.
pub(super) fn in_comment(lines: &[String]) -> String {
    let each = lines.iter().map(|line| format!("  {}", unended(line)));
    each.map(|line| line.trim_end().to_owned() + "\n").collect()
}

/// A line without two hyphens, which would end a comment of XML early.
pub(super) fn unended(line: &str) -> String {
    line.replace("--", "- -")
}

/// Names of the moments and products of inertia of a body, in their order.
pub(super) const MOMENTS: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];

/// A body as a URDF has it.
pub(super) fn inertial(body: &Body) -> String {
    let inertia = MOMENTS.iter().zip(body.inertia);
    let inertia: Vec<String> = inertia.map(|(key, x)| format!("{key}=\"{x:?}\"")).collect();
    format!(
        "<inertial>\n      <origin xyz=\"{}\" rpy=\"0 0 0\"/>\n      <mass value=\"{:?}\"/>\n      \
         <inertia {}/>\n    </inertial>",
        words(&body.centre),
        body.mass,
        inertia.join(" ")
    )
}

/// Damping and friction of a joint as a URDF has them.
pub(super) fn dynamics([damping, friction]: [f64; 2]) -> String {
    format!("<dynamics damping=\"{damping:?}\" friction=\"{friction:?}\"/>")
}

/// A text inside an attribute.
pub(super) fn quoted(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

/// Numbers that are read back bit for bit.
pub(super) fn words(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    all.join(" ")
}
