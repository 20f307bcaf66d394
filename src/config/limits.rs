//! `[limits]`: of joints and coordinates, and the room that points and links have.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::{Deref, DerefMut};

use schemars::JsonSchema;
use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor};
use serde::{Deserialize as Read, Serialize};

use super::document::Document;
use super::robot_file::CoordinateLimits;
use super::serial_section::BASE;
use super::{ConfigError, RobotFile};
use crate::log::{list, nearest};
use crate::robot::tree::Tree;

/// Most capsules: a motion is looked through for every pair of links.
const MOST_CAPSULES: usize = 64;
/// Most points.
const MOST_POINTS: usize = 64;

/// `[limits]`: the keys below, and a table by joint or actuator coordinate.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Limits {
    /// Height of the floor above the origin of the base, against gravity [m]; points stay above it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// Low and high corner of a box, along the axes of the base [m]; points stay inside.
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Least distance of points from the floor and of capsules from each other [m]; 0.02 where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
    /// Pairs of links whose capsules may touch, besides those of neighbours.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub touching: Vec<[String; 2]>,
    /// Points of links that box and floor hold for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<PointSection>,
    /// Shapes of links that keep apart.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub capsule: Vec<CapsuleSection>,
    /// Limits by joint or actuator coordinate.
    #[serde(flatten)]
    pub of: BTreeMap<String, CoordinateLimits>,
}

/// `[[limits.point]]`: a point of a link.
#[derive(Debug, Clone, PartialEq, Serialize, Read, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointSection {
    /// Name, for messages.
    pub name: String,
    /// Name of the link that it moves with.
    pub link: String,
    /// Position in the link's frame [m]; its origin where absent.
    #[serde(default)]
    pub xyz: [f64; 3],
}

/// `[[limits.capsule]]`: all that is within a radius of a straight piece, fixed to a link.
#[derive(Debug, Clone, PartialEq, Serialize, Read, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CapsuleSection {
    /// Name of the link, or `base`.
    pub link: String,
    /// One end of the piece in the link's frame [m].
    pub from: [f64; 3],
    /// Its other end [m]; the same for a sphere.
    pub to: [f64; 3],
    /// Radius [m].
    pub radius: f64,
}

impl Deref for Limits {
    type Target = BTreeMap<String, CoordinateLimits>;

    fn deref(&self) -> &Self::Target {
        &self.of
    }
}

impl DerefMut for Limits {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.of
    }
}

/// By hand: serde's flatten forgets the lines of what it reads.
impl<'de> Deserialize<'de> for Limits {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;
        impl<'de> Visitor<'de> for Table {
            type Value = Limits;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table of limits")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Limits, A::Error> {
                let mut out = Limits::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "floor" => out.floor = Some(map.next_value()?),
                        "box" => out.bounds = Some(map.next_value()?),
                        "distance" => out.distance = Some(map.next_value()?),
                        "touching" => out.touching = map.next_value()?,
                        "point" => out.point = map.next_value()?,
                        "capsule" => out.capsule = map.next_value()?,
                        _ => {
                            let value = map.next_value()?;
                            if out.of.insert(key, value).is_some() {
                                return Err(de::Error::custom("duplicate key"));
                            }
                        }
                    }
                }
                Ok(out)
            }
        }
        deserializer.deserialize_map(Table)
    }
}

impl Limits {
    /// Whether anything is said of points or links.
    pub fn knows_places(&self) -> bool {
        self.floor.is_some()
            || self.bounds.is_some()
            || self.distance.is_some()
            || !(self.touching.is_empty() && self.point.is_empty() && self.capsule.is_empty())
    }
}

/// Index of a link of the tree; `None` within for the base, `None` for a name that no link has.
pub fn link_of(tree: &Tree, name: &str) -> Option<Option<usize>> {
    if name == BASE {
        return Some(None);
    }
    let at = tree.links().iter().position(|link| link.name == name);
    at.map(Some)
}

/// Checks what `[limits]` says of points and links.
pub(super) fn check_places(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    let limits = &file.limits;
    if !limits.knows_places() {
        return Ok(());
    }
    let robot = file.robot();
    if !robot.knows_links() {
        return Err(document.value(
            &["limits"],
            "speaks of points or links, and a single joint has no places of them",
            "delete floor, box, distance, touching, point and capsule; `position` bounds the joint",
        ));
    }
    for (key, too_many, most) in [
        ("point", limits.point.len() > MOST_POINTS, MOST_POINTS),
        (
            "capsule",
            limits.capsule.len() > MOST_CAPSULES,
            MOST_CAPSULES,
        ),
    ] {
        if too_many {
            let problem = format!("stands more than {most} times");
            return Err(document.value(&["limits", key], &problem, "keep those that matter"));
        }
    }
    if let Some([low, high]) = limits.bounds
        && low.iter().zip(&high).any(|(low, high)| low >= high)
    {
        let remedy = "write the low corner first: box = [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.5]]";
        return Err(document.value(&["limits", "box"], "is empty", remedy));
    }
    if let Some(distance) = limits.distance {
        document.positive(&["limits", "distance"], distance)?;
    }
    for (key, given) in [
        ("floor", limits.floor.is_some()),
        ("box", limits.bounds.is_some()),
    ] {
        if given && limits.point.is_empty() {
            return Err(document.value(
                &["limits", key],
                "holds for points, and there is none",
                "add [[limits.point]] tables: name, link and xyz of the flange, the elbow ..",
            ));
        }
    }
    let known = |path: &[&str], link: &str| match link_of(robot.tree(), link) {
        Some(_) => Ok(()),
        None => {
            let links = || {
                let names = robot.tree().links().iter().map(|link| link.name.as_str());
                names.chain([BASE])
            };
            let near = nearest(link, links()).map(|near| format!("did you mean `{near}`? "));
            let remedy = format!(
                "{}the links are {}",
                near.unwrap_or_default(),
                list(links())
            );
            Err(document.value(path, "is no link of this robot", &remedy))
        }
    };
    for (i, point) in limits.point.iter().enumerate() {
        let i = i.to_string();
        document.plain_name(&["limits", "point", &i, "name"], &point.name)?;
        known(&["limits", "point", &i, "link"], &point.link)?;
    }
    for (i, capsule) in limits.capsule.iter().enumerate() {
        let i = i.to_string();
        known(&["limits", "capsule", &i, "link"], &capsule.link)?;
        document.positive(&["limits", "capsule", &i, "radius"], capsule.radius)?;
    }
    let links = limits.touching.iter().flatten();
    for link in links {
        known(&["limits", "touching"], link)?;
    }
    Ok(())
}
