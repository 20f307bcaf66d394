//! The user's own MJCF with what was identified: geoms, meshes, names and actuators stay. What changes bodies and joints
//! while MuJoCo compiles the file is taken out.

mod layout;
mod poses;
mod settings;

use std::collections::{BTreeMap, BTreeSet};

use super::arm::{Arm, ArmJoint, ArmLink};
use super::error::ExportError;
use super::mjcf::{damping_of, inertial};
use super::prepared::unended;
use super::source_link::{
    HERE, NEGLIGIBLE, Pose, SourceLink, composed, difference, displaced, rest, seen_from, without,
};
use super::source_text::{SourceText, WrittenSource};
use super::text_edits::TextEdits;
use super::urdf_source::hung_in_words;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::standard::Body;
use cft_ident_files::config::xml::{Element, XmlTree, without_comments};
use layout::{SourceJoint, SourceLayout};

/// The writing of one model into one source.
struct SourceWriting<'a, 't, 'p> {
    arm: &'a Arm,
    source: &'a SourceText<'a>,
    layout: SourceLayout<'p, 't>,
    edits: TextEdits<'p>,
    /// Body of each link of the model.
    found: Vec<Option<usize>>,
    links: Vec<Option<SourceLink>>,
    held: BTreeMap<String, f64>,
    /// Bodies whose inertials are written anew.
    given: BTreeSet<usize>,
    notes: Vec<String>,
}

/// The text of an MJCF with a model in it; `notes` stand at its head.
///
/// # Errors
/// [`ExportError::OtherSource`] for a file of another robot, or one with parts that are not read.
pub fn written(
    arm: &Arm,
    source: &SourceText,
    notes: &[String],
) -> Result<WrittenSource, ExportError> {
    // comments become as many spaces, so that places are those of the text
    let plain = without_comments(source.text);
    let tree = XmlTree::parse(&plain).map_err(|wrong| {
        let text = format!("line {}: {}", wrong.line, wrong.problem.what);
        source.refused(text, wrong.problem.remedies.join("; "))
    })?;
    let root = tree.root();
    if root.name() != "mujoco" {
        let problem = format!("is no MJCF: its root is <{}>", root.name());
        return Err(source.refused(problem, "give the file whose root is <mujoco>"));
    }
    let mut writing = SourceWriting {
        arm,
        source,
        layout: SourceLayout::read(root),
        edits: TextEdits::of(&plain),
        found: Vec::new(),
        links: Vec::new(),
        held: BTreeMap::new(),
        given: BTreeSet::new(),
        notes: Vec::new(),
    };
    if let Some(wrong) = writing.layout.wrong.first() {
        return Err(source.refused(wrong.clone(), "correct it"));
    }
    for link in &arm.links {
        writing.find(link)?;
    }
    writing.bodies()?;
    writing.frames();
    writing.bases();
    writing.poses();
    writing.compilers(root);
    writing.options(root);
    writing.actuators(root);
    writing.trains(root);
    let lines: Vec<String> = notes
        .iter()
        .chain(&writing.notes)
        .map(|x| unended(x))
        .collect();
    let comment: String = lines.iter().map(|line| format!("  {line}\n")).collect();
    writing
        .edits
        .put_before(&root, format!("<!--\n{comment}-->\n"));
    let joints = arm
        .joints()
        .into_iter()
        .map(|joint| writing.called(&joint.name));
    Ok(WrittenSource {
        joints: joints.collect(),
        text: writing.edits.made(source.text),
        held: writing.held,
        links: writing.links,
        notes: writing.notes,
    })
}

impl<'p, 't> SourceWriting<'_, 't, 'p> {
    /// What a joint of the model is called there.
    fn called(&self, joint: &str) -> String {
        let there = self.layout.bodies.iter().flat_map(|body| &body.joints);
        self.source.called(joint, there.map(|joint| joint.name))
    }

    /// Finds the body of the next link of the model, which must stand where the model has it.
    fn find(&mut self, link: &ArmLink) -> Result<(), ExportError> {
        let index = match &link.joint {
            ArmJoint::Own(joint) => Some(self.moved_by(&self.called(&joint.name))?),
            ArmJoint::Fixed => Some(self.named(&link.name).ok_or_else(|| {
                let problem = format!("has no body `{}`", link.name);
                self.source.refused(problem, "give the MJCF of this robot")
            })?),
            ArmJoint::Mimic {
                of, factor, offset, ..
            } => {
                let master = self.called(of);
                let index = self.follower(link, &master, [*offset, *factor]);
                if let Some(index) = index {
                    self.check_law(index, &master, [*offset, *factor])?;
                }
                index
            }
        };
        self.found.push(index);
        let there = index.map(|index| self.link_at(index, link));
        if let Some(there) = &there {
            if let Some(differs) = difference(link, there) {
                let between = self.between(index);
                return Err(self.source.refused(
                    format!(
                        "body `{}` is not where the model has `{}`: {differs}{between}",
                        there.name, link.name
                    ),
                    "identify with a robot file of the URDF of this file, so that frames are one",
                ));
            }
            if let (ArmJoint::Fixed, Some(joint)) = (&link.joint, &there.joint) {
                self.held.insert(joint.clone(), rest(link, there));
            }
        }
        self.links.push(there);
        Ok(())
    }

    /// The body that a joint moves.
    fn moved_by(&self, name: &str) -> Result<usize, ExportError> {
        let bodies = &self.layout.bodies;
        let index = bodies
            .iter()
            .position(|body| body.joints.iter().any(|j| j.name == name));
        let Some(index) = index else {
            let all = bodies
                .iter()
                .flat_map(|body| &body.joints)
                .map(|joint| joint.name);
            let all: Vec<&str> = all.filter(|name| !name.is_empty()).collect();
            let unread = bodies.iter().filter_map(|body| body.unread).next();
            let unread = unread.map_or(String::new(), |(name, line)| {
                format!("; <{name}> of line {line} is not read")
            });
            return Err(self.source.refused(
                format!("has no joint `{name}`; it has {}{unread}", all.join(", ")),
                "give the MJCF of this robot, or name its joints by `name` in [log.joint] of the robot file",
            ));
        };
        let body = &bodies[index];
        let own: BTreeSet<String> = self
            .arm
            .joints()
            .iter()
            .map(|j| self.called(&j.name))
            .collect();
        let others = body.joints.iter().filter(|joint| joint.name != name);
        for other in others {
            if own.contains(other.name) || other.reference != 0.0 {
                let text = format!(
                    "body `{}` is moved by `{name}` and `{}`",
                    body.name, other.name
                );
                return Err(self.source.refused(
                    text,
                    "give each of them a body of its own, as the model has it",
                ));
            }
        }
        let joint = body.joints.iter().find(|joint| joint.name == name);
        let joint = joint.filter(|joint| !matches!(joint.kind, "hinge" | "slide"));
        if let Some(joint) = joint {
            let text = format!("joint `{name}` is of the type {}", joint.kind);
            return Err(self.source.refused(
                text,
                "the model's turns or slides: give the MJCF of this robot",
            ));
        }
        Ok(index)
    }

    fn named(&self, name: &str) -> Option<usize> {
        self.layout.bodies.iter().position(|body| body.name == name)
    }

    /// The body of a link that follows: of its name, or that of an equality where the model has it.
    fn follower(&self, link: &ArmLink, master: &str, [offset, factor]: [f64; 2]) -> Option<usize> {
        if let Some(index) = self.named(&link.name) {
            return Some(index);
        }
        let ties = self.layout.ties.iter().filter(|tie| tie.of == master);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-4 * b.abs().max(1.0);
        let ties = ties.filter(|tie| near(tie.law[0], offset) && near(tie.law[1], factor));
        let mut bodies = ties.filter_map(|tie| self.moved_by(tie.follower).ok());
        bodies.find(|index| difference(link, &self.link_at(*index, link)).is_none())
    }

    /// The model's link before a body, and the body's pose in it, joints between them at 0.
    fn carried_by(&self, index: usize) -> (Option<usize>, Pose) {
        let bodies = &self.layout.bodies;
        let mut pose = bodies[index].pose;
        let mut next = bodies[index].parent;
        while let Some(k) = next {
            if let Some(link) = self.found.iter().position(|found| *found == Some(k)) {
                return (Some(link), pose);
            }
            pose = composed(&self.behind(bodies[k].pose, &bodies[k].joints), &pose);
            next = bodies[k].parent;
        }
        (None, pose)
    }

    /// A frame behind joints at 0, or where an equality holds them while what they follow is at 0.
    fn behind(&self, frame: Pose, joints: &[SourceJoint]) -> Pose {
        joints.iter().fold(frame, |pose, joint| {
            let kind = match joint.kind {
                "hinge" => JointKind::Revolute,
                "slide" => JointKind::Prismatic,
                _ => return pose,
            };
            let to_point = composed(&pose, &(HERE.0, joint.point));
            let turned = displaced(&to_point, kind, &joint.axis, self.way_at_zero(joint));
            composed(&turned, &(HERE.0, joint.point.map(|x| -x)))
        })
    }

    fn way_at_zero(&self, joint: &SourceJoint) -> f64 {
        let tie = self
            .layout
            .ties
            .iter()
            .find(|tie| tie.follower == joint.name);
        let all = || self.layout.bodies.iter().flat_map(|body| &body.joints);
        let master = tie.and_then(|tie| Some((tie, all().find(|other| other.name == tie.of)?)));
        match master {
            None => -joint.reference,
            Some((tie, master)) => {
                let way = -master.reference;
                tie.law.iter().rev().fold(0.0, |sum, c| sum * way + c)
            }
        }
    }

    /// A body as a link of the model.
    fn link_at(&self, index: usize, link: &ArmLink) -> SourceLink {
        let body = &self.layout.bodies[index];
        let (parent, pose) = self.carried_by(index);
        let wanted = match &link.joint {
            ArmJoint::Own(joint) => Some(self.called(&joint.name)),
            _ => None,
        };
        let is = |joint: &&SourceJoint| wanted.as_deref().is_none_or(|name| joint.name == name);
        let joint = body.joints.iter().find(is);
        // the frame of the model is that of the body where the joint is at 0
        let kind = match joint.map(|joint| joint.kind) {
            Some("slide") => JointKind::Prismatic,
            _ => JointKind::Revolute,
        };
        let axis = joint.map_or([0.0, 0.0, 1.0], |joint| joint.axis);
        let pose = match joint.filter(|joint| joint.reference != 0.0) {
            Some(joint) => displaced(&pose, kind, &axis, -joint.reference),
            None => pose,
        };
        let turns = joint.filter(|_| kind == JointKind::Revolute);
        SourceLink {
            name: body.name.to_owned(),
            parent,
            kind,
            rotation: pose.0,
            origin: pose.1,
            axis,
            point: turns.map_or([0.0; 3], |joint| joint.point),
            joint: joint.map(|joint| joint.name.to_owned()),
        }
    }

    /// What lies between a body and the one that carries it, in words.
    fn between(&self, index: Option<usize>) -> String {
        let Some(body) = index.map(|index| &self.layout.bodies[index]) else {
            return String::new();
        };
        let mut between = Vec::new();
        let mut next = body.parent;
        while let Some(k) = next.filter(|k| !self.found.contains(&Some(*k))) {
            between.push(format!("`{}`", self.layout.bodies[k].name));
            next = self.layout.bodies[k].parent;
        }
        let mut out = String::new();
        if let Some(joint) = body.joints.iter().find(|joint| joint.reference != 0.0) {
            out += &format!("; joint `{}` has the ref {}", joint.name, joint.reference);
        }
        if !between.is_empty() {
            out += &format!("; between them stand {}", between.join(", "));
        }
        out
    }

    /// Inertials, joints, and what hangs on the links beside the model.
    fn bodies(&mut self) -> Result<(), ExportError> {
        for (i, link) in self.arm.links.iter().enumerate() {
            let Some(index) = self.found[i] else {
                let text = format!("link {} of the model is not in this file", link.name);
                self.notes.push(text);
                continue;
            };
            let hung: Vec<usize> = (0..self.layout.bodies.len())
                .filter(|k| !self.found.contains(&Some(*k)) && self.carried_by(*k).0 == Some(i))
                .collect();
            let there = [index].into_iter().chain(hung.iter().copied());
            if let Some((name, line)) = there.filter_map(|k| self.layout.bodies[k].unread).next() {
                return Err(self.source.refused(
                    format!("what <{name}> of line {line} hangs on link `{}` is not read", link.name),
                    "let MuJoCo write it out: mujoco.mj_saveLastXML(\"flat.xml\", mujoco.MjModel.from_xml_path(FILE)), and give that",
                ));
            }
            let body = self.body_beside(link, &hung);
            self.joints_of(index, link);
            self.give(index, &inertial(&body));
        }
        Ok(())
    }

    /// What is left for a link, where bodies hang on it that are in its mass: those that move keep theirs where the rest is a
    /// body, those that are fixed weigh nothing.
    fn body_beside(&mut self, link: &ArmLink, hung: &[usize]) -> Body {
        let moves = |k: usize| {
            let mut next = Some(k);
            while let Some(at) = next.filter(|at| hung.contains(at)) {
                if !self.layout.bodies[at].joints.is_empty() {
                    return true;
                }
                next = self.layout.bodies[at].parent;
            }
            false
        };
        let (moving, fixed): (Vec<usize>, Vec<usize>) = hung.iter().partition(|k| moves(**k));
        for k in fixed {
            self.weigh_nothing(k);
        }
        if moving.is_empty() {
            return link.body;
        }
        let bodies: Option<Vec<Body>> = moving.iter().map(|k| self.weight_of(*k)).collect();
        let rest = bodies
            .as_deref()
            .and_then(|bodies| without(&link.body, bodies));
        let names = moving.iter().map(|k| self.layout.bodies[*k].name);
        let names = names.collect::<Vec<&str>>().join(", ");
        self.notes
            .push(hung_in_words(&link.name, &names, rest.is_some()));
        if rest.is_none() {
            for k in moving {
                self.weigh_little(k);
            }
        }
        rest.unwrap_or(link.body)
    }

    /// A body as its link sees it, its joints at 0; none where only its geoms say what it weighs.
    fn weight_of(&self, index: usize) -> Option<Body> {
        let body = &self.layout.bodies[index];
        let nothing = Body {
            mass: 0.0,
            centre: [0.0; 3],
            inertia: [0.0; 6],
        };
        let massless = |geom: &Element<'p, 't>| {
            geom.attribute("mass").and_then(|x| x.parse().ok()) == Some(0.0)
        };
        let own = match (body.inertial, self.layout.inertia_from_geoms) {
            (_, "true") => return None,
            (Some(own), _) => own,
            (None, "false") => nothing,
            (None, _) if body.geoms.iter().all(massless) => nothing,
            (None, _) => return None,
        };
        let (_, pose) = self.carried_by(index);
        Some(seen_from(&own, &self.behind(pose, &body.joints)))
    }

    /// Frames that say that they have no mass, or say nothing where geoms have no part in it: Drake refuses the one,
    /// Pinocchio and Drake the other.
    fn frames(&mut self) {
        let silent = self.layout.inertia_from_geoms == "false";
        for index in 0..self.layout.bodies.len() {
            let body = &self.layout.bodies[index];
            let none = body.inertial.map_or(silent, |own| own.mass == 0.0);
            if none && body.joints.is_empty() && !self.found.contains(&Some(index)) {
                self.weigh_nothing(index);
            }
        }
    }

    /// A body without mass has no inertial, or the least where none would be refused.
    fn weigh_nothing(&mut self, index: usize) {
        if self.given.contains(&index) {
            return;
        }
        match self.layout.inertia_from_geoms {
            "false" => self.give(index, &inertial(&NEGLIGIBLE)),
            _ => self.give(index, ""),
        }
        for geom in &self.layout.bodies[index].geoms {
            self.edits.set(geom, "mass", "0");
        }
    }

    /// A body on a joint cannot be without mass.
    fn weigh_little(&mut self, index: usize) {
        match self.layout.bodies[index].joints.is_empty() {
            true => self.weigh_nothing(index),
            false => self.give(index, &inertial(&NEGLIGIBLE)),
        }
    }

    /// Writes the inertial of a body.
    fn give(&mut self, index: usize, anew: &str) {
        self.given.insert(index);
        let element = self.layout.bodies[index].element;
        match element.child("inertial") {
            Some(old) => self.edits.replace(&old, anew),
            None if anew.is_empty() => {}
            None => self.edits.put_into(&element, anew),
        }
    }

    /// Armature, damping and friction of the joint of a link; those of one that follows are in the joint that it follows.
    fn joints_of(&mut self, index: usize, link: &ArmLink) {
        let none = || ["0.0", "0.0", "0.0"].map(str::to_owned);
        let (name, numbers) = match &link.joint {
            ArmJoint::Fixed => return,
            ArmJoint::Mimic { .. } => (None, none()),
            ArmJoint::Own(joint) => {
                let whole = [joint.armature, joint.damping];
                let own = self.arm.trains();
                let [armature, damping] = own.map_or(whole, |own| own[joint.index]);
                let friction = format!("{:?}", joint.friction);
                let numbers = [
                    format!("{armature:?}"),
                    damping_of(joint, damping),
                    friction,
                ];
                (Some(self.called(&joint.name)), numbers)
            }
        };
        let body = &self.layout.bodies[index];
        let joints = body.joints.iter();
        for joint in joints.filter(|joint| name.as_ref().is_none_or(|name| joint.name == name)) {
            if joint.reference != 0.0 {
                let text = format!("joint {} has a ref, which newton skips.", joint.name);
                self.notes.push(text);
            }
            for (key, x) in ["armature", "damping", "frictionloss"].iter().zip(&numbers) {
                self.edits.set(&joint.element, key, x);
            }
            if let Some(old) = self
                .layout
                .value(&joint.element, "springdamper", joint.class)
            {
                let text = format!("Taken out: springdamper=\"{old}\" of joint {}.", joint.name);
                self.notes.push(text);
                self.edits.set(&joint.element, "springdamper", "0 0");
            }
        }
    }
}
