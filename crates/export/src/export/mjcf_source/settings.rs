//! What holds of a whole MJCF: compiler, options, actuators.

use std::collections::BTreeSet;

use super::SourceWriting;
use super::layout::ACTUATORS;
use crate::export::error::ExportError;
use crate::export::mjcf::{inertial, tendons};
use crate::export::prepared::{UsedNames, words};
use crate::export::source_link::{HERE, NEGLIGIBLE};
use cft_ident_files::config::xml::Element;

/// Attributes of the compiler that change bodies, with what is the same as none.
const UNDOING: [(&str, &str); 5] = [
    ("inertiafromgeom", "false auto"),
    ("settotalmass", "-1"),
    ("boundmass", "0"),
    ("boundinertia", "0"),
    ("balanceinertia", "false"),
];

/// Flags that switch off what was identified.
const FLAGS: [&str; 6] = [
    "gravity",
    "damper",
    "passive",
    "frictionloss",
    "constraint",
    "equality",
];

impl<'p, 't> SourceWriting<'_, 't, 'p> {
    /// Refuses a body that follows joint `master` otherwise than by this offset and factor.
    pub(super) fn check_law(
        &self,
        index: usize,
        master: &str,
        wanted: [f64; 2],
    ) -> Result<(), ExportError> {
        let bodies = &self.layout.bodies;
        let Some(joint) = bodies[index].joints.first() else {
            return Ok(());
        };
        let mut ties = self.layout.ties.iter();
        let tie = ties.find(|tie| tie.follower == joint.name);
        let mut all = bodies.iter().flat_map(|body| &body.joints);
        let law = match (tie, all.find(|other| other.name == master)) {
            (None, _) => "follows nothing there".to_owned(),
            // a follower of a follower is judged by its torques
            (Some(tie), Some(of)) if tie.of == master => {
                let [c0, c1, bends @ ..] = tie.law;
                let law = [joint.reference + c0 - c1 * of.reference, c1];
                let near = |(a, b): (f64, f64)| (a - b).abs() <= 1e-5 * b.abs().max(1.0);
                if bends == [0.0; 3] && law.into_iter().zip(wanted).all(near) {
                    return Ok(());
                }
                format!("follows `{master}` by {} there", words(&tie.law))
            }
            _ => return Ok(()),
        };
        let name = joint.name;
        Err(self.source.refused(
            format!("joint `{name}` {law}, by {} in the model", words(&wanted)),
            "correct the polycoef of its <equality>, or identify with a robot file of this robot",
        ))
    }

    /// Puts what the robot is fixed to the world by into a body without a pose: of the outermost body Pinocchio skips it.
    pub(super) fn bases(&mut self) {
        let bodies = &self.layout.bodies;
        let outermost = |mut k: usize| {
            while let Some(parent) = bodies[k].parent {
                k = parent;
            }
            k
        };
        let bases: BTreeSet<usize> = self.found.iter().flatten().map(|k| outermost(*k)).collect();
        let names = bodies.iter().map(|body| body.name.to_owned());
        let mut names = UsedNames(names.collect());
        for base in bases.into_iter().map(|k| &bodies[k]) {
            if base.joints.is_empty() && base.pose != HERE {
                let around = names.give(format!("{}_fixed", base.name));
                let own = match self.layout.inertia_from_geoms {
                    "false" => inertial(&NEGLIGIBLE),
                    _ => String::new(),
                };
                let begin = format!("<body name=\"{around}\">\n{own}");
                self.edits.put_before(&base.element, begin);
                self.edits.put_behind(&base.element, "\n</body>");
                self.notes.push(format!(
                    "body {} stands in one without a pose, for Pinocchio skips that of the first",
                    base.name
                ));
            }
        }
    }

    /// Takes out what changes bodies while they are compiled; files of meshes stay where they are.
    pub(super) fn compilers(&mut self, root: Element<'p, 't>) {
        let all: Vec<Element> = root.children().filter(|e| e.name() == "compiler").collect();
        let mut bounded = false;
        for compiler in &all {
            for (key, none) in UNDOING {
                let Some(value) = compiler.attribute(key) else {
                    continue;
                };
                let harmless = none.split(' ').any(|word| word == value)
                    || value.trim().parse::<f64>().is_ok_and(|x| x <= 0.0);
                if harmless {
                    continue;
                }
                self.edits.remove_attribute(compiler, key);
                self.notes.push(format!(
                    "Taken out: <compiler {key}=\"{value}\"/>, which changes bodies."
                ));
                bounded |= key.starts_with("bound");
            }
        }
        if bounded {
            self.massless();
        }
        if let Some(folder) = self.source.folder {
            self.folders(root, &all, folder);
        }
    }

    /// Files of meshes and textures are found from the folder of the output.
    fn folders(&mut self, root: Element<'p, 't>, all: &[Element<'p, 't>], folder: &str) {
        let mut anew = Vec::new();
        for key in ["assetdir", "meshdir", "texturedir"] {
            let given = all
                .iter()
                .rev()
                .find(|compiler| compiler.attribute(key).is_some());
            let whole = all
                .iter()
                .any(|compiler| compiler.attribute("assetdir").is_some());
            match given {
                Some(compiler) => {
                    let old = compiler.attribute(key).unwrap_or_default();
                    if !old.starts_with('/') {
                        self.edits.set(compiler, key, format!("{folder}/{old}"));
                    }
                }
                None if key != "assetdir" && !whole => anew.push((key, folder)),
                None => {}
            }
        }
        match all.last() {
            Some(last) => anew
                .iter()
                .for_each(|(key, folder)| self.edits.set(last, key, *folder)),
            None => {
                let words = anew
                    .iter()
                    .map(|(key, folder)| format!(" {key}=\"{folder}\""));
                let text = format!("  <compiler{}/>", words.collect::<String>());
                self.edits.put_into(&root, &text);
            }
        }
    }

    /// Bodies on joints that only a bound of the compiler gave a mass.
    fn massless(&mut self) {
        for index in 0..self.layout.bodies.len() {
            let body = &self.layout.bodies[index];
            let found = self.found.contains(&Some(index)) || body.joints.is_empty();
            if !found && self.carried_by(index).0.is_none() {
                let light = self
                    .weight_of(index)
                    .is_some_and(|body| body.mass < NEGLIGIBLE.mass);
                if light {
                    self.weigh_little(index);
                }
            }
        }
    }

    /// Gravity is the model's, and no flag switches off what was identified.
    pub(super) fn options(&mut self, root: Element<'p, 't>) {
        let all: Vec<Element> = root.children().filter(|e| e.name() == "option").collect();
        let given = all
            .iter()
            .rev()
            .find(|option| option.attribute("gravity").is_some());
        let old = given
            .and_then(|option| option.attribute("gravity"))
            .unwrap_or("0 0 -9.81");
        let number = |word: &str| word.parse::<f64>().ok();
        let there: Vec<f64> = old.split_whitespace().filter_map(number).collect();
        let gravity = self.arm.gravity;
        let same = there.len() == 3 && there.iter().zip(gravity).all(|(a, b)| (a - b).abs() < 1e-9);
        if !same {
            let anew = words(&gravity);
            self.notes.push(format!(
                "Gravity is {anew} m/s^2 as in the model; the source has {old}."
            ));
            match given.or(all.last()) {
                Some(option) => self.edits.set(option, "gravity", anew),
                None => self
                    .edits
                    .put_into(&root, &format!("  <option gravity=\"{anew}\"/>")),
            }
        }
        for flag in all
            .iter()
            .flat_map(|option| option.children())
            .filter(|e| e.name() == "flag")
        {
            for key in FLAGS {
                if flag.attribute(key) == Some("disable") {
                    self.edits.remove_attribute(&flag, key);
                    self.notes
                        .push(format!("Taken out: <flag {key}=\"disable\"/>."));
                }
            }
        }
    }

    /// Armature and damping of motors are in the identified ones of the joints that they move.
    pub(super) fn actuators(&mut self, root: Element<'p, 't>) {
        let found = self.found.iter().flatten();
        let joints = found.flat_map(|index| &self.layout.bodies[*index].joints);
        let moved: BTreeSet<&str> = joints.map(|joint| joint.name).collect();
        let sections = root.children().filter(|e| e.name() == "actuator");
        let all = sections.flat_map(|section| section.children());
        for actuator in all.filter(|e| ACTUATORS.contains(&e.name())) {
            let joint = actuator
                .attribute("joint")
                .or(actuator.attribute("jointinparent"));
            let ours = joint.is_some_and(|joint| moved.contains(joint));
            if !ours && actuator.attribute("tendon").is_none() {
                continue;
            }
            for key in ["armature", "damping"] {
                let old = self.layout.value(&actuator, key, "main");
                let zero = |text: &str| text.split_whitespace().all(|x| x.parse() == Ok(0.0));
                if let Some(old) = old.filter(|old| !zero(old)) {
                    let name = actuator.attribute("name").or(joint).unwrap_or_default();
                    self.notes
                        .push(format!("Taken out: {key}=\"{old}\" of actuator {name}."));
                    self.edits.set(&actuator, key, "0");
                }
            }
        }
    }

    /// Gear trains of two joints, as tendons of the names that they have in a file of the program's own.
    pub(super) fn trains(&mut self, root: Element<'p, 't>) {
        if self.arm.trains().is_some() && !self.arm.couplings.is_empty() {
            let mut text = String::new();
            tendons(&mut text, self.arm, &|joint| self.called(joint));
            self.edits.put_last(&root, &text);
        }
    }
}
