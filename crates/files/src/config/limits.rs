//! `[limits]`: of joints and coordinates, and the room that points and links have.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::{Deref, DerefMut};

use schemars::JsonSchema;
use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor};
use serde::{Deserialize as Read, Serialize};

use super::serial_section::BASE;
use cft_ident_core::robot::tree::Tree;

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

/// `[limits.NAME]` of a joint or an actuator coordinate.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Read, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoordinateLimits {
    /// Lower and upper end [m or rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 2]>,
    /// Largest speed [m/s or rad/s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// Largest acceleration [m/s^2 or rad/s^2].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<f64>,
    /// Largest torque [N or Nm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
    /// Largest voltage [V].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volts: Option<f64>,
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
