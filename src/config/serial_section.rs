//! The parts of `[robot]` that describe a serial chain: `[[robot.link]]` and `[[robot.coupling]]`.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::document::Document;
use super::robot_file::RobotSection;
use crate::log::{list, nearest};
use crate::robot::standard::Body;
use crate::robot::tree::{Coordinate, Coupling, Dependence, Link, Sine, Tree, TreeError};
use crate::robot::{JointKind, Robot};

/// A sine in a dependent coordinate: amplitude sin(phase + sum of `of`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SineSection {
    /// \[m or rad\]
    pub amplitude: f64,
    /// \[rad\]
    #[serde(default)]
    pub phase: f64,
    /// Coefficient of each independent joint.
    pub of: BTreeMap<String, f64>,
}

/// A coordinate that follows the independent joints, as a URDF mimic joint or a linkage does.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FollowsSection {
    /// Constant part [m or rad].
    #[serde(default)]
    pub offset: f64,
    /// Coefficient of each independent joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub linear: BTreeMap<String, f64>,
    /// Sines of combinations of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sine: Vec<SineSection>,
}

/// What a drawing or a URDF says of a link's mass: a prior, never taken for the answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InertialSection {
    /// \[kg\]
    pub mass: f64,
    /// Centre of gravity in the link's frame \[m\].
    pub centre: [f64; 3],
    /// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the centre of gravity, along the link's axes \[kg m^2\].
    pub inertia: [f64; 6],
}

impl InertialSection {
    /// The same as the physical model has it.
    pub fn body(&self) -> Body {
        Body {
            mass: self.mass,
            centre: self.centre,
            inertia: self.inertia,
        }
    }
}

/// One moving link and the joint before it: a modified Denavit-Hartenberg row (`a`, `alpha`, `d`,
/// `theta`) or a URDF origin (`xyz`, `rpy`, `axis`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkSection {
    /// Name of the link; `link_1`, `link_2`, ... where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Name of the link that it hangs on, or `base`; the link before it where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parent: Option<String>,
    /// Name of the independent joint that moves it; absent for a link that follows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Revolute where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<JointKind>,
    /// a_(i-1) \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a: Option<f64>,
    /// alpha_(i-1) \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// d_i \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub d: Option<f64>,
    /// Angle at q = 0 \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta: Option<f64>,
    /// Position of the joint in the parent's frame \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xyz: Option<[f64; 3]>,
    /// Roll, pitch and yaw of the joint in the parent's frame \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rpy: Option<[f64; 3]>,
    /// Axis of the joint in its own frame; z where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// The coordinate of a link that follows others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follows: Option<FollowsSection>,
    /// Prior of its mass properties.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertial: Option<InertialSection>,
}

/// A frame that is fixed to a moving link and carries nothing: a flange, a tool, a camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameSection {
    /// Name of the frame.
    pub name: String,
    /// Name of the link that it is fixed to.
    pub link: String,
    /// Position in the link's frame \[m\].
    #[serde(default)]
    pub xyz: [f64; 3],
    /// Roll, pitch and yaw in the link's frame \[rad\].
    #[serde(default)]
    pub rpy: [f64; 3],
}

/// Two joints whose gear trains are coupled: the motor of the first turns with the second too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingSection {
    /// Joint whose motor it is.
    pub motor: String,
    /// Joint that turns this motor too.
    pub other: String,
    /// Turns of the motor (in units of its own joint) per turn of the other joint.
    pub ratio: f64,
}

/// Free fall, where the file says nothing: along -z of the base \[m/s^2\].
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];
/// Name of the frame that does not move.
pub(super) const BASE: &str = "base";

impl RobotSection {
    /// Names of the independent joints of a chain, in the order of its links.
    pub(super) fn chain_joints(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for joint in self.link.iter().filter_map(|l| l.joint.as_ref()) {
            if !names.contains(joint) {
                names.push(joint.clone());
            }
        }
        names
    }

    /// Whether an independent joint turns or slides, by the first link that it moves.
    pub(super) fn chain_kind(&self, joint: usize) -> JointKind {
        let names = self.chain_joints();
        let moved =
            |link: &&LinkSection| link.joint.is_some() && link.joint.as_ref() == names.get(joint);
        let kind = self.link.iter().find(moved).and_then(|link| link.kind);
        kind.unwrap_or(JointKind::Revolute)
    }

    /// Names of the links.
    fn link_names(&self) -> Vec<String> {
        let name = |(i, l): (usize, &LinkSection)| {
            l.name.clone().unwrap_or_else(|| format!("link_{}", i + 1))
        };
        self.link.iter().enumerate().map(name).collect()
    }

    /// The serial robot that the section describes.
    ///
    /// # Errors
    /// What is wrong, the index of the link or coupling and the key where one can be named, and
    /// what to do.
    pub(super) fn serial(&self) -> Result<Robot, Misfit> {
        let joints = self.chain_joints();
        let names = self.link_names();
        let find = |joint: &str| joints.iter().position(|name| name == joint);
        let unknown = |joint: &str| {
            let near = nearest(joint, joints.iter().map(String::as_str))
                .map(|near| format!("did you mean `{near}`? "))
                .unwrap_or_default();
            format!(
                "{near}the independent joints are {}",
                list(joints.iter().map(String::as_str))
            )
        };
        let mut links = Vec::with_capacity(self.link.len());
        for (i, section) in self.link.iter().enumerate() {
            let misfit = |key, problem: &str, remedy: String| Misfit {
                link: Some(i),
                key,
                problem: problem.to_owned(),
                remedy,
            };
            if names[..i].contains(&names[i]) {
                return Err(misfit(
                    "name",
                    "is the name of another link too",
                    "give each link a name of its own".into(),
                ));
            }
            let parent = match section.parent.as_deref() {
                None => i.checked_sub(1),
                Some(BASE) => None,
                Some(parent) => {
                    Some(names[..i].iter().position(|n| n == parent).ok_or_else(|| {
                        misfit(
                            "parent",
                            "is no link before this one",
                            "write `base` or the name of a link above".into(),
                        )
                    })?)
                }
            };
            let terms = |of: &BTreeMap<String, f64>| -> Result<Vec<(usize, f64)>, Misfit> {
                of.iter()
                    .map(|(joint, c)| {
                        let index = find(joint).ok_or_else(|| {
                            misfit("follows", "names no independent joint", unknown(joint))
                        })?;
                        Ok((index, *c))
                    })
                    .collect()
            };
            let coordinate = match (&section.joint, &section.follows) {
                (Some(joint), None) => {
                    let before = self.link[..i].iter();
                    if before
                        .filter_map(|l| l.joint.as_ref())
                        .any(|other| other == joint)
                    {
                        return Err(misfit(
                            "joint",
                            "moves another link too",
                            format!(
                                "let this link follow it: `follows = {{ linear = {{ {joint} = 1.0 }} }}`"
                            ),
                        ));
                    }
                    Coordinate::Joint(find(joint).unwrap_or_default())
                }
                (None, Some(f)) => {
                    let sine = |s: &SineSection| -> Result<Sine, Misfit> {
                        Ok(Sine {
                            amplitude: s.amplitude,
                            phase: s.phase,
                            of: terms(&s.of)?,
                        })
                    };
                    Coordinate::Follows(Dependence {
                        offset: f.offset,
                        linear: terms(&f.linear)?,
                        sines: f.sine.iter().map(sine).collect::<Result<_, _>>()?,
                    })
                }
                _ => {
                    return Err(misfit(
                        "joint",
                        "must stand in the link, or `follows`, and not both",
                        "name the joint that moves the link, or say which joints it follows".into(),
                    ));
                }
            };
            let row = [section.a, section.alpha, section.d, section.theta];
            let urdf = section.xyz.is_some() || section.rpy.is_some() || section.axis.is_some();
            let ((rotation, origin), axis) = if urdf {
                if row.iter().any(Option::is_some) {
                    return Err(misfit(
                        "xyz",
                        "stands beside a Denavit-Hartenberg row",
                        "keep `a`, `alpha`, `d`, `theta` or `xyz`, `rpy`, `axis`".into(),
                    ));
                }
                let placed = Link::of_origin(
                    section.xyz.unwrap_or_default(),
                    section.rpy.unwrap_or_default(),
                );
                let axis = section.axis.unwrap_or([0.0, 0.0, 1.0]);
                let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
                if !(length.is_finite() && length > 1e-6) {
                    return Err(misfit(
                        "axis",
                        "has no length",
                        "give three numbers that are not all 0".into(),
                    ));
                }
                (placed, axis.map(|x| x / length))
            } else {
                let [a, alpha, d, theta] = row.map(Option::unwrap_or_default);
                (Link::of_row(a, alpha, d, theta), [0.0, 0.0, 1.0])
            };
            links.push(Link {
                name: names[i].clone(),
                parent,
                rotation,
                origin,
                axis,
                kind: section.kind.unwrap_or(JointKind::Revolute),
                coordinate,
            });
        }
        let mut couplings = Vec::with_capacity(self.coupling.len());
        for c in &self.coupling {
            let joint = |name: &str| {
                find(name).ok_or_else(|| {
                    Misfit::of_robot(
                        &format!("couples `{name}`, which is no independent joint"),
                        unknown(name),
                    )
                })
            };
            let coupling = Coupling {
                motor: joint(&c.motor)?,
                other: joint(&c.other)?,
                ratio: c.ratio,
            };
            if coupling.motor == coupling.other || !c.ratio.is_finite() || c.ratio == 0.0 {
                return Err(Misfit::of_robot(
                    "has a coupling of a joint with itself, or of ratio 0",
                    "couple two joints with a ratio that is not 0".into(),
                ));
            }
            couplings.push(coupling);
        }
        let tree = Tree::new(links, joints.len(), self.gravity.unwrap_or(GRAVITY))
            .map_err(|error| Misfit::of_tree(&error))?;
        let drive_inertia = self.drive_inertia.unwrap_or(true);
        Ok(Robot::of_tree(tree, joints, drive_inertia, couplings))
    }

    /// The robot of a section that was checked.
    ///
    /// # Panics
    /// Where it was not: [`super::check`] lets no such file through.
    pub(super) fn checked_serial(&self) -> Robot {
        self.serial().expect("the robot section was checked")
    }
}

/// What keeps a section from being a chain.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Misfit {
    /// Which link, from 0; `None` for the robot as a whole.
    link: Option<usize>,
    key: &'static str,
    problem: String,
    remedy: String,
}

impl Misfit {
    fn of_robot(problem: &str, remedy: String) -> Self {
        Self {
            link: None,
            key: "model",
            problem: problem.to_owned(),
            remedy,
        }
    }

    fn of_tree(error: &TreeError) -> Self {
        let text = error.to_string();
        let (problem, remedy) = text
            .rsplit_once("; ")
            .unwrap_or((&text, "correct [[robot.link]]"));
        Self::of_robot(&format!("is \"serial\", but {problem}"), remedy.to_owned())
    }
}

/// Refuses a serial section that is no chain.
pub(super) fn check(section: &RobotSection, document: &Document) -> Result<(), ConfigError> {
    if section.link.is_empty() {
        return Err(document.missing(
            &["robot", "link"],
            "[[robot.link]] tables, or `urdf = \"FILE\"`",
        ));
    }
    for name in section.chain_joints() {
        super::check::plain_name(document, &["robot", "model"], &name)?;
    }
    match section.serial() {
        Ok(_) => frames(section, document),
        Err(misfit) => {
            let index = misfit.link.map(|i| i.to_string());
            let path = match &index {
                Some(index) => vec!["robot", "link", index.as_str(), misfit.key],
                None => vec!["robot", misfit.key],
            };
            Err(document.value(&path, &misfit.problem, &misfit.remedy))
        }
    }
}

/// Refuses frames that hang on nothing or share a name.
fn frames(section: &RobotSection, document: &Document) -> Result<(), ConfigError> {
    let links = section.link_names();
    let mut taken: BTreeSet<&str> = links.iter().map(String::as_str).collect();
    taken.insert(BASE);
    for (i, frame) in section.frame.iter().enumerate() {
        let index = i.to_string();
        let at = |key| ["robot", "frame", index.as_str(), key];
        if !links.contains(&frame.link) {
            let near = nearest(&frame.link, links.iter().map(String::as_str));
            let remedy = match near {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!(
                    "the links are {}",
                    list(links.iter().map(String::as_str).take(20))
                ),
            };
            return Err(document.value(&at("link"), "is no moving link of this robot", &remedy));
        }
        if !taken.insert(&frame.name) {
            let remedy = "give each frame a name of its own";
            return Err(document.value(
                &at("name"),
                "is the name of a link or frame before it",
                remedy,
            ));
        }
        let finite = |x: &[f64; 3]| x.iter().all(|x| x.is_finite());
        for (key, numbers) in [("xyz", &frame.xyz), ("rpy", &frame.rpy)] {
            if !finite(numbers) {
                return Err(document.value(&at(key), "is not finite", "give three numbers"));
            }
        }
    }
    Ok(())
}
