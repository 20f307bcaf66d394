//! What a URDF says: links with their inertials, joints with their placements.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::link::{Body, Link};
use super::possible;
use super::shapes::{numbers, of_link};
use super::xml::{EXPAND, Element, MACRO};
use super::{AngleConvention, NO_LIMIT, UrdfPlace};
use crate::config::ConfigError;
use crate::config::angles::FileChanges;
use crate::config::document::is_plain_name;
use crate::config::robot_file::CoordinateLimits;
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::tree::space::{Vector, of_roll_pitch_yaw};
use cft_ident_logs::log::{escape, list, nearest};

/// The types of joints that a URDF knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UrdfJointKind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    Floating,
    Planar,
}

/// The names of joint types, in the order of [`UrdfJointKind`].
const KINDS: [(&str, UrdfJointKind); 6] = [
    ("fixed", UrdfJointKind::Fixed),
    ("revolute", UrdfJointKind::Revolute),
    ("continuous", UrdfJointKind::Continuous),
    ("prismatic", UrdfJointKind::Prismatic),
    ("floating", UrdfJointKind::Floating),
    ("planar", UrdfJointKind::Planar),
];

/// The joint that another one follows: position = multiplier * that of `joint` + offset.
#[derive(Debug)]
pub(super) struct MimicJoint {
    pub joint: String,
    pub multiplier: f64,
    pub offset: f64,
}

#[derive(Debug)]
pub(super) struct Joint {
    pub name: String,
    pub line: usize,
    pub kind: UrdfJointKind,
    pub parent: String,
    pub child: String,
    pub xyz: Vector,
    pub rpy: Vector,
    pub axis: Vector,
    pub limits: CoordinateLimits,
    pub mimic: Option<MimicJoint>,
}

impl Joint {
    pub(super) fn wrong(&self, place: &UrdfPlace, problem: &str, remedy: &str) -> ConfigError {
        let what = format!("joint {}", escape(&self.name));
        place.wrong(self.line, &what, problem, remedy)
    }
}

/// A robot as its URDF lists it.
#[derive(Debug, Default)]
pub(super) struct UrdfParts {
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    /// Angles and axes that were taken for what they stand for.
    pub changes: FileChanges,
    /// What was said of inertials that no body has.
    pub impossible: Option<String>,
    /// Joints whose names are written otherwise here, as the URDF has them.
    pub renamed: Vec<String>,
}

/// Reads what stands in a `<robot>`.
pub(super) fn parts(root: Element, place: &UrdfPlace) -> Result<UrdfParts, ConfigError> {
    if root.name() != "robot" {
        return Err(place.wrong(
            root.line(),
            &format!("<{}>", escape(root.name())),
            "is not the <robot> of a URDF",
            "give a URDF file; an SDF or a xacro file is to be converted first",
        ));
    }
    let mut parts = UrdfParts::default();
    let mut links: BTreeMap<&str, usize> = BTreeMap::new();
    let mut joints: BTreeMap<&str, usize> = BTreeMap::new();
    for child in root.children() {
        let known = match child.name() {
            "link" => &mut links,
            "joint" => &mut joints,
            name if name.starts_with("xacro:") => {
                let what = format!("<{}>", escape(name));
                return Err(place.wrong(child.line(), &what, MACRO, EXPAND));
            }
            // materials, transmissions, sensors, gazebo
            _ => continue,
        };
        let name = child.attribute("name").unwrap_or_default();
        if name.trim().is_empty() {
            let (what, remedy) = (format!("<{}>", child.name()), "give it one: name=\"...\"");
            return Err(place.wrong(child.line(), &what, "has no name", remedy));
        }
        let what = format!("{} {}", child.name(), escape(name));
        if let Some(line) = known.insert(name, child.line()) {
            let problem = format!("has the name of that of line {line}");
            return Err(place.wrong(child.line(), &what, &problem, "give each its own name"));
        }
        if child.name() == "link" {
            parts.links.push(link(child, name, place)?);
        } else {
            let clean = clean_name(name);
            if let Some(other) = parts.joints.iter().find(|joint| joint.name == *clean) {
                return Err(place.wrong(
                    child.line(),
                    &what,
                    &format!("is written {clean}, as that of line {}", other.line),
                    "give each joint a name of its own in letters, digits, `_`, `-` and `.`",
                ));
            }
            if clean != name {
                parts.renamed.push(name.to_owned());
            }
            let joint = joint(child, &clean, place, &mut parts.changes)?;
            parts.joints.push(joint);
        }
    }
    if parts.links.is_empty() {
        return Err(place.wrong(
            root.line(),
            "<robot>",
            "has no <link>",
            "give the URDF of a whole robot",
        ));
    }
    parts.impossible = possible::impossible(&parts.links);
    if let Some(root) = undeclared_root(&parts, &links) {
        parts.links.insert(0, root);
    }
    for joint in &parts.joints {
        for (what, link) in [("parent", &joint.parent), ("child", &joint.child)] {
            if !parts.links.iter().any(|known| known.name == *link) {
                let problem = format!("has the {what} `{}`, which is no link", escape(link));
                return Err(joint.wrong(place, &problem, &instead_of(link, &parts.links)));
            }
        }
    }
    Ok(parts)
}

/// The one undeclared parent (`world`) where every declared link hangs on something; else it is a slip of the pen.
fn undeclared_root(parts: &UrdfParts, declared: &BTreeMap<&str, usize>) -> Option<Link> {
    let mut undeclared = (parts.joints.iter()).filter(|j| !declared.contains_key(&*j.parent));
    let first = undeclared.next()?;
    let alone = undeclared.all(|other| other.parent == first.parent);
    let hangs = |link: &Link| parts.joints.iter().any(|j| j.child == link.name);
    let no_child = parts.joints.iter().all(|j| j.child != first.parent);
    (alone && no_child && parts.links.iter().all(hangs)).then(|| Link {
        name: first.parent.clone(),
        line: first.line,
        body: None,
        shapes: Vec::new(),
    })
}

/// What to do about a name that is no link.
pub(super) fn instead_of(link: &str, links: &[Link]) -> String {
    let all = links.iter().map(|l| l.name.as_str());
    match nearest(link, all.clone()) {
        Some(near) => format!("did you mean `{}`?", escape(near)),
        None => format!("the links are {}", list(all.take(20))),
    }
}

fn link(element: Element, name: &str, place: &UrdfPlace) -> Result<Link, ConfigError> {
    let at = ElementReading {
        place,
        what: format!("link {}", escape(name)),
    };
    let body = match element.child("inertial") {
        None => None,
        Some(inertial) => {
            let (xyz, rpy) = at.origin(inertial)?;
            let mass = at.number(at.part(inertial, "mass")?, "value", None)?;
            let tensor = at.part(inertial, "inertia")?;
            let moment = |key| at.number(tensor, key, None);
            let product = |key| at.number(tensor, key, Some(0.0));
            let (xy, xz, yz) = (product("ixy")?, product("ixz")?, product("iyz")?);
            let tensor = [
                [moment("ixx")?, xy, xz],
                [xy, moment("iyy")?, yz],
                [xz, yz, moment("izz")?],
            ];
            Some(Body {
                mass,
                centre: xyz,
                inertia: super::turned(&of_roll_pitch_yaw(&rpy), &tensor),
            })
        }
    };
    Ok(Link {
        name: name.to_owned(),
        line: element.line(),
        body,
        shapes: of_link(element),
    })
}

fn joint(
    element: Element,
    name: &str,
    place: &UrdfPlace,
    changes: &mut FileChanges,
) -> Result<Joint, ConfigError> {
    let at = ElementReading {
        place,
        what: format!("joint {}", escape(name)),
    };
    let kind = element.attribute("type").unwrap_or_default();
    let Some((_, kind)) = KINDS.iter().find(|(known, _)| *known == kind) else {
        return Err(at.wrong(
            element,
            &format!("has the type `{}`", escape(kind)),
            "give revolute, continuous, prismatic or fixed",
        ));
    };
    let linked = |what: &str| -> Result<String, ConfigError> {
        let part = at.part(element, what)?;
        let link = part.attribute("link");
        Ok(link.ok_or_else(|| at.lacks(part, "link"))?.to_owned())
    };
    let (xyz, mut rpy) = at.origin(element)?;
    let mut axis = match element.child("axis") {
        // the default of the format
        None => [1.0, 0.0, 0.0],
        Some(axis) => at.vector(axis, "xyz", [1.0, 0.0, 0.0])?,
    };
    if place.angles == AngleConvention::Meant {
        let written = |child: &str, key| words(element.child(child)?.attribute(key)?);
        if let Some(written) = written("origin", "rpy") {
            for (angle, written) in rpy.iter_mut().zip(written) {
                *angle = changes.angle(*angle, written, &format!("rpy of {}", at.what));
            }
        }
        if let Some(written) = written("axis", "xyz") {
            axis = changes.axis(axis, written, &format!("axis of {}", at.what));
        }
    }
    let moving = !matches!(kind, UrdfJointKind::Fixed | UrdfJointKind::Floating);
    if moving && axis.iter().all(|x| x.abs() < 1e-6) {
        let remedy = "give an axis, e.g. xyz=\"0 0 1\"";
        return Err(at.wrong(element, "has an axis without length", remedy));
    }
    let limits = at.limits(element, *kind)?;
    Ok(Joint {
        name: name.to_owned(),
        line: element.line(),
        kind: *kind,
        parent: linked("parent")?,
        child: linked("child")?,
        xyz,
        rpy,
        axis,
        mimic: at.mimic(element)?,
        limits,
    })
}

/// A joint's name as files hold it: `_` for what is no letter, digit, `_`, `-` or `.`.
pub(super) fn clean_name(name: &str) -> Cow<'_, str> {
    if is_plain_name(name) {
        return Cow::Borrowed(name);
    }
    let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    let clean = name.trim().chars();
    Cow::Owned(clean.map(|c| if plain(c) { c } else { '_' }).collect())
}

/// The three words of a text.
fn words(text: &str) -> Option<[&str; 3]> {
    let words: Vec<&str> = text.split_whitespace().collect();
    words.try_into().ok()
}

/// The reading of one link or joint, which errors name.
struct ElementReading<'a> {
    place: &'a UrdfPlace<'a>,
    what: String,
}

impl ElementReading<'_> {
    fn wrong(&self, element: Element, problem: &str, remedy: &str) -> ConfigError {
        self.place
            .wrong(element.line(), &self.what, problem, remedy)
    }

    fn part<'a, 't>(
        &self,
        element: Element<'a, 't>,
        name: &str,
    ) -> Result<Element<'a, 't>, ConfigError> {
        element.child(name).ok_or_else(|| {
            let remedy = format!("add <{name} .../> to it");
            self.wrong(element, &format!("has no <{name}>"), &remedy)
        })
    }

    fn lacks(&self, element: Element, key: &str) -> ConfigError {
        let problem = format!("has a <{}> without {key}", element.name());
        self.wrong(element, &problem, &format!("add {key}=\"...\""))
    }

    fn unusable(&self, element: Element, key: &str, text: &str, remedy: &str) -> ConfigError {
        let text = escape(text);
        let problem = format!("has {key}=\"{text}\" in <{}>", element.name());
        self.wrong(element, &problem, remedy)
    }

    fn number(&self, element: Element, key: &str, absent: Option<f64>) -> Result<f64, ConfigError> {
        let Some(text) = element.attribute(key) else {
            return absent.ok_or_else(|| self.lacks(element, key));
        };
        let value = text.trim().parse::<f64>().ok().filter(|x| is_usable(*x));
        value.ok_or_else(|| {
            let remedy = "give a finite number with a decimal point";
            self.unusable(element, key, text, remedy)
        })
    }

    fn vector(&self, element: Element, key: &str, absent: Vector) -> Result<Vector, ConfigError> {
        let Some(text) = element.attribute(key) else {
            return Ok(absent);
        };
        numbers(text).ok_or_else(|| {
            let remedy = "give three finite numbers with spaces between";
            self.unusable(element, key, text, remedy)
        })
    }

    /// Position [m] and roll, pitch, yaw [rad] of the `<origin>` inside.
    fn origin(&self, element: Element) -> Result<(Vector, Vector), ConfigError> {
        let Some(origin) = element.child("origin") else {
            return Ok(([0.0; 3], [0.0; 3]));
        };
        let at = |key| self.vector(origin, key, [0.0; 3]);
        Ok((at("xyz")?, at("rpy")?))
    }

    /// The limits of a joint, where they are given; 0 stands in many files for one that nobody knows, and [`NO_LIMIT`] for none.
    fn limits(&self, joint: Element, kind: UrdfJointKind) -> Result<CoordinateLimits, ConfigError> {
        let Some(limit) = joint.child("limit") else {
            return Ok(CoordinateLimits::default());
        };
        let value = |key| self.number(limit, key, Some(0.0));
        let (speed, effort) = (value("velocity")?, value("effort")?);
        let (low, high) = (value("lower")?, value("upper")?);
        if low > high {
            let problem = format!("has the lower limit {low} above the upper {high}");
            return Err(self.wrong(limit, &problem, "exchange the two"));
        }
        Ok(CoordinateLimits {
            position: (low < high && high < NO_LIMIT && kind != UrdfJointKind::Continuous)
                .then_some([low, high]),
            speed: (speed > 0.0 && speed < NO_LIMIT).then_some(speed),
            torque: (effort > 0.0 && effort < NO_LIMIT).then_some(effort),
            ..CoordinateLimits::default()
        })
    }

    fn mimic(&self, joint: Element) -> Result<Option<MimicJoint>, ConfigError> {
        let Some(mimic) = joint.child("mimic") else {
            return Ok(None);
        };
        let followed = mimic.attribute("joint");
        Ok(Some(MimicJoint {
            joint: clean_name(followed.ok_or_else(|| self.lacks(mimic, "joint"))?).into_owned(),
            multiplier: self.number(mimic, "multiplier", Some(1.0))?,
            offset: self.number(mimic, "offset", Some(0.0))?,
        }))
    }
}
