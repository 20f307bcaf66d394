//! Poses as every reader takes them: MuJoCo's `<frame>` and some of its notations are read by MuJoCo alone.

use super::SourceWriting;
use super::layout::is_dissolved;
use crate::export::arm::quaternion;
use crate::export::prepared::words;
use crate::export::source_link::Pose;
use cft_ident_files::config::xml::Element;

/// Notations of an orientation beside `quat`.
const NOTATIONS: [&str; 4] = ["euler", "axisangle", "xyaxes", "zaxis"];

impl<'p, 't> SourceWriting<'_, 't, 'p> {
    /// Dissolves frames around bodies and joints, and writes quaternions where angles are misread.
    pub(super) fn poses(&mut self) {
        let (mut dissolved, mut kept) = (Vec::new(), Vec::new());
        for index in 0..self.layout.bodies.len() {
            let body = &self.layout.bodies[index];
            let (element, pose, is_bare) = (body.element, body.pose, body.frames.is_empty());
            let around: Vec<Vec<Element>> = [&body.frames]
                .into_iter()
                .chain(body.joints.iter().map(|joint| &joint.frames))
                .cloned()
                .collect();
            for (k, frames) in around.iter().enumerate() {
                let Some(outermost) = frames.first() else {
                    continue;
                };
                if !is_dissolved(outermost) {
                    kept.push(outermost.line());
                    continue;
                }
                for frame in frames {
                    if !dissolved.contains(&frame.range().start) {
                        dissolved.push(frame.range().start);
                        self.edits.unwrap(frame);
                    }
                }
                let class = frames.iter().rev().find_map(|f| f.attribute("childclass"));
                match k {
                    0 => self.place(&element, &pose, class),
                    _ => self.align(index, k - 1, class),
                }
            }
            if is_bare && self.layout.is_misread(&element) {
                self.place(&element, &pose, None);
            }
            let inertial = element.child("inertial");
            let inertial = inertial.filter(|_| !self.given.contains(&index));
            if let Some(inertial) = inertial.filter(|of| self.layout.is_misread(of)) {
                let pose = self.layout.pose(&inertial);
                self.place(&inertial, &pose, None);
            }
        }
        kept.dedup();
        for line in kept {
            self.notes.push(format!(
                "<frame> of line {line} holds more than bodies and joints: MuJoCo alone reads it, other readers skip it."
            ));
        }
    }

    fn place(&mut self, element: &Element<'p, 't>, (rotation, origin): &Pose, class: Option<&str>) {
        for notation in NOTATIONS {
            if element.attribute(notation).is_some() {
                self.edits.remove_attribute(element, notation);
            }
        }
        self.edits.set(element, "pos", words(origin));
        self.edits
            .set(element, "quat", words(&quaternion(rotation)));
        if let Some(class) = class.filter(|_| element.attribute("childclass").is_none()) {
            self.edits.set(element, "childclass", class);
        }
    }

    /// Writes axis and point of a joint in the frame of its body.
    fn align(&mut self, body: usize, joint: usize, class: Option<&str>) {
        let joint = &self.layout.bodies[body].joints[joint];
        self.edits.set(&joint.element, "axis", words(&joint.axis));
        self.edits.set(&joint.element, "pos", words(&joint.point));
        if let Some(class) = class.filter(|_| joint.element.attribute("class").is_none()) {
            self.edits.set(&joint.element, "class", class);
        }
    }
}
