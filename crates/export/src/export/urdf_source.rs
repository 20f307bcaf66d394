//! The user's own URDF with the inertia and the friction that were identified: meshes, names and frames stay.

use std::collections::{BTreeMap, BTreeSet};

use super::arm::{Arm, ArmJoint, ArmLink};
use super::error::ExportError;
use super::prepared::{dynamics, inertial};
use super::source_link::{
    NEGLIGIBLE, Pose, SourceLink, composed, difference, displaced, rest, seen_from, without,
};
use super::source_text::{SourceText, WrittenSource};
use super::text_edits::TextEdits;
use cft_ident_core::robot::standard::Body;
use cft_ident_core::robot::tree::{Coordinate, Link};
use cft_ident_files::config::xml::{XmlTree, without_comments};
use cft_ident_files::config::{UrdfReplacement, WholeUrdf, replaced_in_urdf};

/// The writing of one model into one source.
struct UrdfWriting<'a> {
    source: &'a SourceText<'a>,
    /// The whole of the source.
    whole: &'a WholeUrdf,
    /// Link there of each link of the model.
    found: Vec<usize>,
    stand: Vec<SourceLink>,
    held: BTreeMap<String, f64>,
    out: UrdfReplacement,
}

/// The text of a URDF with a model in it, `whole` being what it says; `notes` stand at its head. Joints are matched by name, and each joint's frame must be that of the model.
///
/// # Errors
/// [`ExportError::OtherSource`] for a joint that is not there or sits elsewhere.
pub fn written(
    arm: &Arm,
    source: &SourceText,
    whole: &WholeUrdf,
    notes: &[String],
) -> Result<WrittenSource, ExportError> {
    let mut writing = UrdfWriting {
        source,
        whole,
        found: Vec::new(),
        stand: Vec::new(),
        held: BTreeMap::new(),
        out: UrdfReplacement::default(),
    };
    for link in &arm.links {
        writing.find(link)?;
    }
    for (i, link) in arm.links.iter().enumerate() {
        writing.replace(i, link);
    }
    let own = writing.out.notes.clone();
    writing.out.notes = notes.iter().chain(&own).cloned().collect();
    let text = replaced_in_urdf(source.file, source.text, &writing.out)?;
    let joints = arm
        .joints()
        .into_iter()
        .map(|joint| writing.called(&joint.name));
    Ok(WrittenSource {
        joints: joints.collect(),
        text: match source.folder {
            None => text,
            Some(folder) => with_meshes_of(&text, folder),
        },
        held: writing.held,
        links: writing.stand.into_iter().map(Some).collect(),
        notes: own,
    })
}

/// Link of the URDF that ends a chain with the joints of a model, in the same order; none where no link does. The outer
/// `None` is the whole URDF.
pub fn tip_of(arm: &Arm, written: &str) -> Option<Option<String>> {
    use cft_ident_files::config::UrdfChain;
    let own: Vec<&str> = arm.joints().iter().map(|j| j.name.as_str()).collect();
    let same = |tip: Option<&str>| {
        let chain = UrdfChain::parse("", written, tip).ok()?;
        let joints = chain.links.iter().filter_map(|link| link.joint.as_deref());
        (chain.links.len() == arm.links.len() && joints.eq(own.iter().copied())).then_some(())
    };
    if same(None).is_some() {
        return Some(None);
    }
    let last = arm.links.last().map(|link| link.name.clone())?;
    same(Some(&last)).map(|()| Some(last))
}

impl UrdfWriting<'_> {
    /// What a joint of the model is called there.
    fn called(&self, joint: &str) -> String {
        let there = self.whole.joints.iter().map(String::as_str);
        self.source.called(joint, there)
    }

    fn moved_by(&self, name: &str) -> Option<usize> {
        self.whole
            .links
            .iter()
            .position(|link| match &link.coordinate {
                Coordinate::Joint(j) => self.whole.joints[*j] == name,
                Coordinate::Follows(_) => false,
            })
    }

    /// Finds the next link of the model, which must stand where the model has it.
    fn find(&mut self, link: &ArmLink) -> Result<(), ExportError> {
        let index = match &link.joint {
            ArmJoint::Own(joint) => {
                let called = self.called(&joint.name);
                let index = self.moved_by(&called);
                let has = self.whole.joints.join(", ");
                let remedy = "give the URDF of this robot, or name its joints by `name` in [log.joint] of the robot file";
                index.ok_or_else(|| {
                    self.source
                        .refused(format!("has no joint `{called}`; it has {has}"), remedy)
                })?
            }
            _ => {
                let index = self.whole.links.iter().position(|l| l.name == link.name);
                let problem = || format!("has no link `{}`, which follows a joint", link.name);
                index.ok_or_else(|| {
                    self.source
                        .refused(problem(), "give the URDF of this robot")
                })?
            }
        };
        let (parent, pose) = self.carried_by(&self.whole.links, index);
        let there = &self.whole.links[index];
        let joint = match &there.coordinate {
            Coordinate::Joint(j) => Some(self.whole.joints[*j].clone()),
            Coordinate::Follows(_) => None,
        };
        let there = SourceLink {
            name: there.name.clone(),
            parent,
            kind: there.kind,
            rotation: pose.0,
            origin: pose.1,
            axis: there.axis,
            point: [0.0; 3],
            joint,
        };
        if let Some(differs) = difference(link, &there) {
            return Err(self.source.refused(
                format!("link `{}` is not where the model has `{}`: {differs}", there.name, link.name),
                "identify with a robot file of this URDF (`cft-ident new NAME --urdf FILE`), so that frames are one",
            ));
        }
        if let (ArmJoint::Fixed, Some(joint)) = (&link.joint, &there.joint) {
            self.held.insert(joint.clone(), rest(link, &there));
        }
        let (rotation, origin) = self.carried_by(&self.whole.as_written, index).1;
        self.found.push(index);
        self.stand.push(SourceLink {
            rotation,
            origin,
            axis: self.whole.as_written[index].axis,
            ..there
        });
        Ok(())
    }

    /// The model's link before one of the source, and the pose in it, joints between them at 0.
    fn carried_by(&self, links: &[Link], index: usize) -> (Option<usize>, Pose) {
        let pose_of = |k: usize| (links[k].rotation, links[k].origin);
        let mut pose = pose_of(index);
        let mut next = links[index].parent;
        while let Some(k) = next {
            if let Some(link) = self.found.iter().position(|found| *found == k) {
                return (Some(link), pose);
            }
            pose = composed(&behind(pose_of(k), &links[k]), &pose);
            next = links[k].parent;
        }
        (None, pose)
    }

    /// Inertial and friction of one link, and what hangs on it beside the model.
    fn replace(&mut self, i: usize, link: &ArmLink) {
        let there = self.stand[i].clone();
        let hung: Vec<usize> = (0..self.whole.links.len())
            .filter(|k| {
                !self.found.contains(k) && self.carried_by(&self.whole.links, *k).0 == Some(i)
            })
            .collect();
        let body = self.body_beside(link, &hung);
        self.out
            .inertials
            .insert(there.name.clone(), inertial(&body));
        self.bare(&there.name);
        match (&link.joint, &there.joint) {
            (ArmJoint::Own(joint), Some(name)) => {
                let dynamics = dynamics([joint.damping, joint.friction]);
                self.out.dynamics.insert(name.clone(), dynamics);
            }
            (ArmJoint::Mimic { .. }, _) => {
                self.out.following.insert(there.name);
            }
            _ => {}
        }
    }

    /// What is fixed to a link weighs nothing beside it.
    fn bare(&mut self, link: &str) {
        let links: BTreeSet<&str> = self
            .whole
            .links
            .iter()
            .map(|link| link.name.as_str())
            .collect();
        let frames = self.whole.frames.iter();
        let fixed =
            frames.filter(|frame| frame.link == link && !links.contains(frame.name.as_str()));
        self.out.bare.extend(fixed.map(|frame| frame.name.clone()));
    }

    /// What is left for a link, where others hang on it whose mass is in its own: they keep theirs where the rest is a body.
    fn body_beside(&mut self, link: &ArmLink, hung: &[usize]) -> Body {
        let weight = |k: &usize| {
            let given = self.whole.inertials[*k].as_ref()?;
            let pose = behind(
                self.carried_by(&self.whole.links, *k).1,
                &self.whole.links[*k],
            );
            Some(seen_from(&given.body(), &pose))
        };
        let bodies: Vec<Body> = hung.iter().filter_map(weight).collect();
        if bodies.is_empty() {
            return link.body;
        }
        let rest = without(&link.body, &bodies);
        let names = hung.iter().map(|k| self.whole.links[*k].name.as_str());
        let (names, on) = (names.collect::<Vec<&str>>().join(", "), &link.name);
        self.out
            .notes
            .push(hung_in_words(on, &names, rest.is_some()));
        if rest.is_none() {
            for k in hung {
                let name = self.whole.links[*k].name.clone();
                self.bare(&name);
                self.out.inertials.insert(name, inertial(&NEGLIGIBLE));
            }
        }
        rest.unwrap_or(link.body)
    }
}

/// A frame behind the joint of a link that stands at 0, or at its offset where it follows one that does.
fn behind(frame: Pose, link: &Link) -> Pose {
    let at = match &link.coordinate {
        Coordinate::Joint(_) => 0.0,
        Coordinate::Follows(follows) => follows.offset,
    };
    displaced(&frame, link.kind, &link.axis, at)
}

/// What became of the bodies that hang on a link beside the model.
pub(super) fn hung_in_words(on: &str, names: &str, keeps: bool) -> String {
    let is = format!("The mass of {names} is in the identified one of {on}, their joints at 0:");
    match keeps {
        true => format!("{is} they keep theirs, and {on} holds the rest."),
        false => {
            let little = NEGLIGIBLE.mass;
            format!("{is} they weigh {little:e} kg here, for the rest would be no body.")
        }
    }
}

/// The text of a URDF whose relative files are those of another folder.
fn with_meshes_of(text: &str, folder: &str) -> String {
    let plain = without_comments(text);
    let Ok(tree) = XmlTree::parse(&plain) else {
        return text.to_owned();
    };
    let mut edits = TextEdits::of(&plain);
    for element in tree.root().descendants() {
        let key = match element.name() {
            "mesh" | "texture" => "filename",
            "compiler" => "meshdir",
            _ => continue,
        };
        let relative =
            |file: &&str| !file.starts_with('/') && !file.contains("://") && !file.is_empty();
        if let Some(file) = element.attribute(key).filter(relative) {
            edits.set(&element, key, format!("{folder}/{file}"));
        }
    }
    edits.made(text)
}
