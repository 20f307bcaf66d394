//! From the links and couplings of `[robot]` to the serial robot that they describe.

use std::collections::{BTreeMap, BTreeSet};

use super::ConfigError;
use super::angles::FileChanges;
use super::document::{TomlDocument, near_and_all};
use super::robot_file::RobotSection;
use super::serial_section::{
    BASE, CouplingSection, FollowsSection, LinkSection, MOST_LINKS, SineSection,
};
use cft_ident_core::explain::Explain;
use cft_ident_core::robot::tree::space::{Rotation, Vector, of_roll_pitch_yaw};
use cft_ident_core::robot::tree::{
    Coordinate, DependentCoordinate, JointCoupling, Link, SineTerm, Tree, TreeError,
};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_logs::log::{escape, list, nearest};

/// Free fall, where the file says nothing: along -z of the base \[m/s^2\].
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

impl RobotSection {
    /// Names of the independent joints of a chain, in the order of its links.
    pub(super) fn chain_joints(&self) -> Vec<String> {
        SectionNames::of(&self.link).joints
    }

    /// Whether an independent joint turns or slides, by the first link that it moves.
    pub(super) fn chain_kind(&self, joint: usize) -> JointKind {
        let names = self.chain_joints();
        let moved =
            |link: &&LinkSection| link.joint.is_some() && link.joint.as_ref() == names.get(joint);
        let kind = self.link.iter().find(moved).and_then(|link| link.kind);
        kind.unwrap_or(JointKind::Revolute)
    }

    fn link_names(&self) -> Vec<String> {
        SectionNames::of(&self.link).links
    }

    /// The serial robot that the section describes.
    pub(super) fn serial(&self) -> Result<Robot, ChainMisfit> {
        let (links, names) = placed_links(&self.link)?;
        let couplings = self.coupling.iter().map(|c| names.coupling(c));
        let couplings = couplings.collect::<Result<Vec<JointCoupling>, ChainMisfit>>()?;
        let joints = names.joints;
        let tree = Tree::new(links, joints.len(), self.gravity.unwrap_or(GRAVITY))
            .map_err(|error| ChainMisfit::of_tree(&error))?;
        let drive_inertia = self.drive_inertia.unwrap_or(true);
        Ok(Robot::of_tree(tree, joints, drive_inertia, couplings))
    }

    /// The robot of a section that was checked.
    pub(super) fn checked_serial(&self) -> Robot {
        self.serial().expect("the robot section was checked")
    }
}

/// Rotation and origin of a link in its parent's frame, and its axis of length 1.
fn placement(i: usize, section: &LinkSection) -> Result<((Rotation, Vector), Vector), ChainMisfit> {
    let row = [section.a, section.alpha, section.d, section.theta];
    if section.xyz.is_none() && section.rpy.is_none() && section.axis.is_none() {
        let [a, alpha, d, theta] = row.map(Option::unwrap_or_default);
        return Ok((Link::of_row(a, alpha, d, theta), [0.0, 0.0, 1.0]));
    }
    if row.iter().any(Option::is_some) {
        return Err(ChainMisfit::of_link(
            i,
            "xyz",
            "stands beside a Denavit-Hartenberg row",
            "keep `a`, `alpha`, `d`, `theta` or `xyz`, `rpy`, `axis`",
        ));
    }
    let axis = section.axis.unwrap_or([0.0, 0.0, 1.0]);
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !(length.is_finite() && length > 1e-6) {
        let remedy = "give three numbers that are not all 0";
        return Err(ChainMisfit::of_link(i, "axis", "has no length", remedy));
    }
    let rotation = of_roll_pitch_yaw(&section.rpy.unwrap_or_default());
    let origin = section.xyz.unwrap_or_default();
    Ok(((rotation, origin), axis.map(|x| x / length)))
}

/// Names that a section gives and refers to.
pub(super) struct SectionNames {
    links: Vec<String>,
    /// The independent ones.
    pub(super) joints: Vec<String>,
}

/// Links on their parents, with what moves them, and their names.
pub(super) fn placed_links(
    sections: &[LinkSection],
) -> Result<(Vec<Link>, SectionNames), ChainMisfit> {
    let names = SectionNames::of(sections);
    let links = (0..sections.len()).map(|i| names.placed_link(i, sections));
    Ok((links.collect::<Result<_, _>>()?, names))
}

impl SectionNames {
    fn of(sections: &[LinkSection]) -> Self {
        let name = |(i, l): (usize, &LinkSection)| {
            l.name.clone().unwrap_or_else(|| format!("link_{}", i + 1))
        };
        let mut joints: Vec<String> = Vec::new();
        for joint in sections.iter().filter_map(|l| l.joint.as_ref()) {
            if !joints.contains(joint) {
                joints.push(joint.clone());
            }
        }
        Self {
            links: sections.iter().enumerate().map(name).collect(),
            joints,
        }
    }

    /// Link `i` on its parent, with what moves it.
    fn placed_link(&self, i: usize, sections: &[LinkSection]) -> Result<Link, ChainMisfit> {
        let section = &sections[i];
        if self.links[..i].contains(&self.links[i]) {
            return Err(ChainMisfit::of_link(
                i,
                "name",
                "is the name of another link too",
                "give each link a name of its own",
            ));
        }
        let parent = self.parent(i, section)?;
        let coordinate = match (&section.joint, &section.follows) {
            (Some(joint), None) => {
                let mut before = sections[..i].iter();
                if before.any(|link| link.joint.as_ref() == Some(joint)) {
                    let remedy = format!(
                        "let this link follow it: `follows = {{ linear = {{ {joint} = 1.0 }} }}`"
                    );
                    let problem = "moves another link too";
                    return Err(ChainMisfit::of_link(i, "joint", problem, &remedy));
                }
                Coordinate::Joint(self.joint(joint).unwrap_or_default())
            }
            (None, Some(follows)) => Coordinate::Follows(self.dependence(i, follows)?),
            _ => {
                return Err(ChainMisfit::of_link(
                    i,
                    "joint",
                    "must stand in the link, or `follows`, and not both",
                    "name the joint that moves the link, or say which joints it follows",
                ));
            }
        };
        let ((rotation, origin), axis) = placement(i, section)?;
        Ok(Link {
            name: self.links[i].clone(),
            parent,
            rotation,
            origin,
            axis,
            kind: section.kind.unwrap_or(JointKind::Revolute),
            coordinate,
        })
    }

    fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint == name)
    }

    /// What to do about a name that is no independent joint.
    fn instead_of(&self, joint: &str) -> String {
        let all = self.joints.iter().map(String::as_str);
        near_and_all(joint, all, "the independent joints are")
    }

    /// The link that link `i` hangs on; `None` for the base.
    fn parent(&self, i: usize, section: &LinkSection) -> Result<Option<usize>, ChainMisfit> {
        match section.parent.as_deref() {
            None => Ok(i.checked_sub(1)),
            Some(BASE) => Ok(None),
            Some(parent) => match self.links[..i].iter().position(|n| n == parent) {
                None => Err(ChainMisfit::of_link(
                    i,
                    "parent",
                    "is no link before this one",
                    "write `base` or the name of a link above",
                )),
                found => Ok(found),
            },
        }
    }

    /// The coordinate of link `i`, which follows others.
    fn dependence(
        &self,
        i: usize,
        follows: &FollowsSection,
    ) -> Result<DependentCoordinate, ChainMisfit> {
        let terms = |of: &BTreeMap<String, f64>| -> Result<Vec<(usize, f64)>, ChainMisfit> {
            let term = |(joint, c): (&String, &f64)| match self.joint(joint) {
                Some(index) => Ok((index, *c)),
                None => Err(ChainMisfit::of_link(
                    i,
                    "follows",
                    "names no independent joint",
                    &self.instead_of(joint),
                )),
            };
            of.iter().map(term).collect()
        };
        let sine = |s: &SineSection| -> Result<SineTerm, ChainMisfit> {
            Ok(SineTerm {
                amplitude: s.amplitude,
                phase: s.phase,
                of: terms(&s.of)?,
            })
        };
        Ok(DependentCoordinate {
            offset: follows.offset,
            linear: terms(&follows.linear)?,
            sines: follows.sine.iter().map(sine).collect::<Result<_, _>>()?,
        })
    }

    fn coupling(&self, c: &CouplingSection) -> Result<JointCoupling, ChainMisfit> {
        let joint = |name: &str| {
            self.joint(name).ok_or_else(|| {
                ChainMisfit::of_robot(
                    &format!("couples `{name}`, which is no independent joint"),
                    &self.instead_of(name),
                )
            })
        };
        let coupling = JointCoupling {
            motor: joint(&c.motor)?,
            other: joint(&c.other)?,
            ratio: c.ratio,
        };
        if coupling.motor == coupling.other || !c.ratio.is_finite() || c.ratio == 0.0 {
            return Err(ChainMisfit::of_robot(
                "has a coupling of a joint with itself, or of ratio 0",
                "couple two joints with a ratio that is not 0",
            ));
        }
        Ok(coupling)
    }
}

/// What keeps a section from being a chain.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChainMisfit {
    /// Which link, from 0; `None` for the robot as a whole.
    link: Option<usize>,
    key: &'static str,
    pub(super) problem: String,
    pub(super) remedy: String,
}

impl ChainMisfit {
    fn of_robot(problem: &str, remedy: &str) -> Self {
        Self {
            link: None,
            key: "model",
            problem: problem.to_owned(),
            remedy: remedy.to_owned(),
        }
    }

    fn of_link(i: usize, key: &'static str, problem: &str, remedy: &str) -> Self {
        Self {
            link: Some(i),
            key,
            ..Self::of_robot(problem, remedy)
        }
    }

    fn of_tree(error: &TreeError) -> Self {
        let problem = error.explanation();
        let remedy = problem.remedies.first().map(String::as_str);
        Self::of_robot(
            &format!("is \"serial\", but {}", problem.what),
            remedy.unwrap_or("correct [[robot.link]]"),
        )
    }
}

/// Takes angles and axes for what they stand for, unless the file says otherwise; what was changed, in a sentence.
pub(super) fn take_as_meant(
    section: &mut RobotSection,
    document: &TomlDocument,
    file: &str,
) -> Option<String> {
    // more links than a file may have are refused by the check
    if section.angles_as_written == Some(true) || section.link.len() > MOST_LINKS {
        return None;
    }
    let mut changes = FileChanges::default();
    for (i, link) in section.link.iter_mut().enumerate() {
        let index = i.to_string();
        let name = link.joint.as_ref().or(link.name.as_ref());
        let of = name.map_or_else(|| format!("link {}", i + 1), |name| escape(name));
        let at = |key| document.written(&["robot", "link", &index, key]);
        for (key, angle) in [("alpha", &mut link.alpha), ("theta", &mut link.theta)] {
            if let (Some(angle), Some(written)) = (angle, at(key)) {
                *angle = changes.angle(*angle, written, &format!("{key} of {of}"));
            }
        }
        let part = |key, k: &str| document.written(&["robot", "link", &index, key, k]);
        let parts = |key| Some([part(key, "0")?, part(key, "1")?, part(key, "2")?]);
        if let (Some(rpy), Some(written)) = (&mut link.rpy, parts("rpy")) {
            for (angle, written) in rpy.iter_mut().zip(written) {
                *angle = changes.angle(*angle, written, &format!("rpy of {of}"));
            }
        }
        if let (Some(axis), Some(written)) = (&mut link.axis, parts("axis")) {
            *axis = changes.axis(*axis, written, &format!("axis of {of}"));
        }
    }
    changes.in_words(file)
}

/// Refuses rows that `new` wrote and nobody filled in.
fn filled_in(section: &RobotSection, document: &TomlDocument) -> Result<(), ConfigError> {
    for (i, link) in section.link.iter().enumerate() {
        let row = [link.a, link.alpha, link.d, link.theta];
        for (key, value) in ["a", "alpha", "d", "theta"].into_iter().zip(row) {
            if value.is_some_and(f64::is_nan) {
                return Err(document.value(
                    &["robot", "link", &i.to_string(), key],
                    "is not filled in yet",
                    "write the row of the modified Denavit-Hartenberg table of each joint, 0.0 where it is zero, or give the arm's URDF: `urdf = \"FILE\"` in [robot] in place of the rows",
                ));
            }
        }
    }
    let still = |l: &LinkSection| {
        let row = [l.a, l.alpha, l.d, l.theta].into_iter().flatten();
        let placed = l.xyz.into_iter().chain(l.rpy).flatten();
        row.chain(placed).all(|x| x == 0.0)
            && l.parent.is_none()
            && l.kind.unwrap_or(JointKind::Revolute) == JointKind::Revolute
            && l.axis == section.link[0].axis
    };
    if section.link.len() > 1 && section.link.iter().all(still) {
        return Err(document.value(
            &["robot", "link"],
            &format!(
                "has {} rows of zeros: all joints would turn about one line",
                section.link.len()
            ),
            "fill in the modified Denavit-Hartenberg table, or give the arm's URDF: `urdf = \"FILE\"` in [robot] in place of the rows",
        ));
    }
    Ok(())
}

/// Refuses a serial section that is no chain.
pub(super) fn check(section: &RobotSection, document: &TomlDocument) -> Result<(), ConfigError> {
    if section.link.is_empty() {
        return Err(document.missing(
            &["robot", "link"],
            "[[robot.link]] tables, or `urdf = \"FILE\"`",
        ));
    }
    if section.link.len() > MOST_LINKS {
        let problem = format!("is one of {} links", section.link.len());
        let remedy = format!("give at most {MOST_LINKS}: the chain that was measured");
        let at = ["robot", "link", &MOST_LINKS.to_string()];
        return Err(document.value(&at, &problem, &remedy));
    }
    filled_in(section, document)?;
    for name in section.chain_joints() {
        document.plain_name(&["robot", "model"], &name)?;
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
fn frames(section: &RobotSection, document: &TomlDocument) -> Result<(), ConfigError> {
    let links = section.link_names();
    let mut taken: BTreeSet<&str> = links.iter().map(String::as_str).collect();
    taken.insert(BASE);
    for (i, frame) in section.frame.iter().enumerate() {
        let index = i.to_string();
        let at = |key| ["robot", "frame", index.as_str(), key];
        if !links.contains(&frame.link) {
            let all = || links.iter().map(String::as_str);
            let remedy = match nearest(&frame.link, all()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("the links are {}", list(all().take(20))),
            };
            return Err(document.value(&at("link"), "is no moving link of this robot", &remedy));
        }
        if !taken.insert(&frame.name) {
            let problem = "is the name of a link or frame before it";
            let remedy = "give each frame a name of its own";
            return Err(document.value(&at("name"), problem, remedy));
        }
        for (key, numbers) in [("xyz", &frame.xyz), ("rpy", &frame.rpy)] {
            if !numbers.iter().all(|x| x.is_finite()) {
                return Err(document.value(&at(key), "is not finite", "give three numbers"));
            }
        }
    }
    Ok(())
}
