//! A model as links with inertials: what URDF, MJCF, SDF and USD have in common.

use super::error::ExportError;
use super::single;
use super::standard::{Standard, nearest};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::model::Model;
use cft_ident_core::robot::tree::{Coordinate, Link};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::serial_section::InertialSection;

/// A model whose links have bodies.
pub(super) struct Prepared {
    /// The model's file; that of a chain of one link where the model is of a single joint.
    pub file: ModelFile,
    pub model: Model,
    /// Standard parameters of links and drives.
    pub standard: Standard,
    /// What is said of where they come from.
    pub of_inertials: &'static [&'static str],
}

impl Prepared {
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

/// Name of the joint before a link.
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
    while robot.tree().links().iter().any(|l| l.name == name)
        || frames.iter().any(|f| f.name == name)
    {
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
/// A text inside an attribute.
pub(super) fn quoted(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Numbers that are read back bit for bit.
pub(super) fn words(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    all.join(" ")
}
