//! A URDF file read into the `[[robot.link]]` tables of a robot file.
//!
//! Only what torques depend on is read: placements, axes, kinds, mimic joints, inertials (as a
//! prior), limits, and collision shapes for the capsules of `new`. The crate urdf-rs was tried and not taken: its errors
//! name no line, and a file of some thousand nested elements ends the process. Nor was stl_io: it takes a binary file
//! whose head begins with `solid` for a text.

pub(super) mod beside;
pub mod capsules;
mod held;
mod link;
pub mod mesh;
mod parts;
mod possible;
mod seat;
mod shapes;
pub(super) mod source;
mod tree;
mod whole;
pub mod xml;

use std::collections::BTreeMap;
use std::path::Path;

use super::ConfigError;
use super::document::TomlDocument;
use super::robot_file::{CoordinateLimits, ModelKind, RobotFile};
use super::serial_section::{FrameSection, LinkSection};
use super::text_file::text_of;
use cft_ident_core::robot::tree::space::{Rotation, product};
use cft_ident_logs::log::{named_beside, remedy, shown};
use shapes::LinkShape;
pub use whole::WholeUrdf;

/// A limit that is none, as files of links write it [m, rad, and their rates and torques].
pub const NO_LIMIT: f64 = 1e16;

/// What a URDF gives to a robot file.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfChain {
    /// Moving links from the base outward.
    pub links: Vec<LinkSection>,
    /// Limits of the independent joints that have some, in the order of the links.
    pub limits: Vec<(String, CoordinateLimits)>,
    /// Links that fixed joints hang on moving ones, by their placement alone.
    pub frames: Vec<FrameSection>,
    /// Collision shapes, for [`capsules`].
    collisions: Vec<CollisionShape>,
    /// What was taken otherwise than it is written, one sentence each.
    pub notes: Vec<String>,
}

/// A collision shape of a link.
#[derive(Debug, Clone, PartialEq)]
struct CollisionShape {
    /// The link of the URDF.
    of: String,
    /// The moving link, or the base, that it belongs to.
    on: String,
    /// In the frame of that; `None` where it cannot be read.
    shape: Option<LinkShape>,
}

/// What is asked of a URDF.
#[derive(Debug, Clone, Copy, Default)]
pub struct ChainRequest<'a> {
    /// Link where the chain ends; every branch is read where absent.
    pub tip: Option<&'a str>,
    /// Joints that stand still, and where [m or rad].
    pub held: Option<&'a BTreeMap<String, f64>>,
    angles: AngleConvention,
}

impl<'a> ChainRequest<'a> {
    /// A chain up to `tip`, joints of it held.
    pub fn new(tip: Option<&'a str>, held: &'a BTreeMap<String, f64>) -> Self {
        Self {
            tip,
            held: Some(held),
            ..Self::default()
        }
    }
}

/// How angles and axes are taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum AngleConvention {
    /// 1.5708 as pi/2.
    #[default]
    Meant,
    Written,
}

/// The URDF that errors speak of.
pub(super) struct UrdfPlace<'a> {
    file: &'a str,
    angles: AngleConvention,
}

impl UrdfPlace<'_> {
    fn wrong(&self, line: usize, what: &str, problem: &str, remedy: &str) -> ConfigError {
        ConfigError::Value {
            file: self.file.to_owned(),
            line,
            key: what.to_owned(),
            problem: problem.to_owned(),
            remedy: remedy.to_owned(),
        }
    }
}

/// R A R'.
fn turned(r: &Rotation, a: &Rotation) -> Rotation {
    let transposed = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
    product(&product(r, a), &transposed)
}

/// The error for a text that is no XML.
pub(super) fn no_xml(file: &str, wrong: xml::MalformedText) -> ConfigError {
    ConfigError::Syntax {
        file: file.to_owned(),
        line: wrong.line,
        problem: wrong.problem,
    }
}

impl UrdfChain {
    /// Reads a URDF from text, up to the link `tip` where one is named; `file` names it in errors.
    /// Angles and axes that are rounded multiples of 15 degrees are taken as those.
    ///
    /// # Errors
    /// [`ConfigError::Syntax`] where it is no well-formed XML, [`ConfigError::Value`] with the line
    /// of the link or joint that cannot be used.
    pub fn parse(file: &str, text: &str, tip: Option<&str>) -> Result<Self, ConfigError> {
        let asked = ChainRequest {
            tip,
            ..ChainRequest::default()
        };
        Self::parse_with(file, text, &asked)
    }

    fn parse_with(file: &str, text: &str, asked: &ChainRequest) -> Result<Self, ConfigError> {
        let text = xml::without_comments(text);
        let tree = xml::XmlTree::parse(&text).map_err(|wrong| no_xml(file, wrong))?;
        let place = UrdfPlace {
            file,
            angles: asked.angles,
        };
        let mut parts = parts::parts(tree.root(), &place)?;
        if let Some(held) = asked.held {
            parts.hold(held, &place)?;
        }
        tree::chain(&parts, asked.tip, &place)
    }

    /// Reads a URDF file.
    ///
    /// # Errors
    /// A file that cannot be read, and those of [`Self::parse`].
    pub fn load(path: &Path, asked: &ChainRequest) -> Result<Self, ConfigError> {
        let file = shown(path);
        let text = text_of(path).map_err(|source| ConfigError::Read {
            file: file.clone(),
            remedy: match source.kind() {
                std::io::ErrorKind::InvalidData => {
                    "give a URDF file in UTF-8, below 16 MB: `iconv -f LATIN1 -t UTF-8 IN > OUT`"
                        .to_owned()
                }
                std::io::ErrorKind::NotFound => {
                    format!("{}{}", remedy(&source), named_beside(path, &["urdf"]))
                }
                _ => remedy(&source).to_owned(),
            },
            source,
        })?;
        Self::parse_with(&file, &text, asked)
    }
}

/// Reads the URDF that a robot file names into its links and limits, so that the file stands alone.
pub(super) fn resolve(
    file: &mut RobotFile,
    document: &TomlDocument,
    folder: Option<&Path>,
) -> Result<(), ConfigError> {
    let robot = &mut file.robot;
    if robot.model != ModelKind::Serial {
        // the check of the file says that these keys do not belong to the model
        return Ok(());
    }
    let Some(urdf) = &robot.urdf else {
        let remedy = "delete it, or name the URDF file";
        let alone = [
            ("tip", robot.tip.is_some()),
            ("held", !robot.held.is_empty()),
        ];
        return match alone.iter().find(|(_, there)| *there) {
            None => Ok(()),
            Some((key, _)) => {
                Err(document.value(&["robot", key], "stands without a `urdf`", remedy))
            }
        };
    };
    if !robot.link.is_empty() {
        let problem = "stands beside [[robot.link]] tables";
        return Err(document.value(&["robot", "urdf"], problem, "keep one of the two"));
    }
    let Some(folder) = folder else {
        return Err(document.value(
            &["robot", "urdf"],
            "names a file, but this text is not one of a folder",
            "read the robot file from the disk, the URDF beside it",
        ));
    };
    let angles = match robot.angles_as_written {
        Some(true) => AngleConvention::Written,
        _ => AngleConvention::Meant,
    };
    let asked = ChainRequest {
        tip: robot.tip.as_deref(),
        held: Some(&robot.held),
        angles,
    };
    let chain = UrdfChain::load(&folder.join(urdf), &asked)?;
    file.notes.0.extend(chain.notes);
    robot.link = chain.links;
    robot.frame.splice(0..0, chain.frames);
    robot.urdf = None;
    robot.tip = None;
    robot.held.clear();
    for (joint, found) in chain.limits {
        // what the robot file says stands
        let said = file.limits.entry(joint).or_default();
        said.position = said.position.or(found.position);
        said.speed = said.speed.or(found.speed);
        said.torque = said.torque.or(found.torque);
    }
    Ok(())
}
