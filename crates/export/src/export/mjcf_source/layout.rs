//! The bodies of an MJCF where they stand: classes, frames and all ways of writing an orientation resolved.

use std::collections::BTreeMap;

use super::super::source_link::{HERE, Pose, composed, seen_from};
use cft_ident_core::robot::standard::Body;
use cft_ident_core::robot::tree::space::{
    Rotation, UNTURNED, Vector, about, cross, dot, product, times, turn,
};
use cft_ident_files::config::xml::Element;

/// A body of the source.
pub(super) struct SourceBody<'a, 't> {
    pub element: Element<'a, 't>,
    pub name: &'a str,
    pub parent: Option<usize>,
    /// In the frame of the body before, joints at the positions at which it is drawn.
    pub pose: Pose,
    pub joints: Vec<SourceJoint<'a, 't>>,
    pub inertial: Option<Body>,
    pub geoms: Vec<Element<'a, 't>>,
    /// `<frame>`s around it in the body before, the outermost first.
    pub frames: Vec<Element<'a, 't>>,
    /// Elements whose bodies or weights are not read, by name and line.
    pub unread: Option<(&'a str, usize)>,
}

/// A joint of the source.
pub(super) struct SourceJoint<'a, 't> {
    pub element: Element<'a, 't>,
    pub name: &'a str,
    /// `hinge`, `slide`, `ball` or `free`.
    pub kind: &'a str,
    /// In the frame of the body.
    pub axis: Vector,
    pub point: Vector,
    /// Position at which it is drawn [rad or m].
    pub reference: f64,
    /// Class of what it stands in.
    pub class: &'a str,
    /// `<frame>`s around it in the body.
    pub frames: Vec<Element<'a, 't>>,
}

/// A joint that follows another one: `to` = law of the way of `of`.
pub(super) struct SourceTie<'a> {
    pub follower: &'a str,
    pub of: &'a str,
    pub law: [f64; 5],
}

/// What an MJCF says of its bodies.
pub(super) struct SourceLayout<'a, 't> {
    pub bodies: Vec<SourceBody<'a, 't>>,
    pub ties: Vec<SourceTie<'a>>,
    /// Whether bodies weigh by their geoms: `true`, `false`, or `auto` where they have no inertial.
    pub inertia_from_geoms: &'a str,
    classes: BTreeMap<&'a str, Vec<Element<'a, 't>>>,
    /// `<frame>`s around what is read next.
    around: Vec<Element<'a, 't>>,
    units: AngleUnits<'a>,
    /// Values that are no numbers, in words.
    pub wrong: Vec<String>,
}

/// How the file writes angles.
struct AngleUnits<'a> {
    /// Radians of one.
    angle: f64,
    sequence: &'a str,
}

/// Words that name an actuator in a file; in a class they are one.
pub(super) const ACTUATORS: [&str; 11] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "pid",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
];

impl<'a, 't> SourceLayout<'a, 't> {
    pub(super) fn read(root: Element<'a, 't>) -> Self {
        let mut out = Self {
            bodies: Vec::new(),
            ties: Vec::new(),
            inertia_from_geoms: "auto",
            classes: BTreeMap::new(),
            around: Vec::new(),
            units: AngleUnits {
                angle: 1f64.to_radians(),
                sequence: "xyz",
            },
            wrong: Vec::new(),
        };
        for compiler in root.children().filter(|e| e.name() == "compiler") {
            if let Some(unit) = compiler.attribute("angle") {
                out.units.angle = if unit == "radian" {
                    1.0
                } else {
                    1f64.to_radians()
                };
            }
            if let Some(sequence) = compiler.attribute("eulerseq") {
                out.units.sequence = sequence;
            }
            if let Some(word) = compiler.attribute("inertiafromgeom") {
                out.inertia_from_geoms = word;
            }
        }
        for default in root.children().filter(|e| e.name() == "default") {
            out.add_class(default, &[], "main");
        }
        for world in root.children().filter(|e| e.name() == "worldbody") {
            out.walk(world, None, HERE, "main");
        }
        for equality in root.children().filter(|e| e.name() == "equality") {
            for tie in equality.children().filter(|e| e.name() == "joint") {
                let (Some(follower), Some(of)) = (tie.attribute("joint1"), tie.attribute("joint2"))
                else {
                    continue;
                };
                let law = out.value(&tie, "polycoef", "main").unwrap_or("0 1 0 0 0");
                let law = out.numbers(law, [0.0, 1.0, 0.0, 0.0, 0.0], &tie);
                out.ties.push(SourceTie { follower, of, law });
            }
        }
        out
    }

    /// A class is the elements of its own, then those of the classes around it.
    fn add_class(&mut self, default: Element<'a, 't>, around: &[Element<'a, 't>], name: &'a str) {
        let own = default.children().filter(|e| e.name() != "default");
        let mut elements: Vec<Element> = own.collect();
        elements.extend(around.iter().copied());
        for inner in default.children().filter(|e| e.name() == "default") {
            let class = inner.attribute("class").unwrap_or_default();
            self.add_class(inner, &elements, class);
        }
        self.classes.entry(name).or_default().extend(elements);
    }

    /// An attribute of an element or of its class.
    pub(super) fn value(
        &self,
        element: &Element<'a, 't>,
        key: &str,
        around: &str,
    ) -> Option<&'a str> {
        let class = element.attribute("class").unwrap_or(around);
        let alike = |other: &str| {
            let both = [element.name(), other];
            both[0] == both[1] || both.iter().all(|name| ACTUATORS.contains(name))
        };
        let said = |e: &&Element<'a, 't>| alike(e.name()) && e.attribute(key).is_some();
        let of_class = || self.classes.get(class)?.iter().find(said)?.attribute(key);
        element.attribute(key).or_else(of_class)
    }

    /// The numbers of a value, as many as are wanted at most.
    fn numbers<const N: usize>(&mut self, text: &str, absent: [f64; N], of: &Element) -> [f64; N] {
        let mut out = absent;
        for (x, word) in out.iter_mut().zip(text.split_whitespace()) {
            match word.parse::<f64>().ok().filter(|x| x.is_finite()) {
                Some(number) => *x = number,
                None => {
                    let (name, line) = (of.name(), of.line());
                    self.wrong
                        .push(format!("`{word}` in <{name}> of line {line} is no number"));
                }
            }
        }
        out
    }

    fn walk(&mut self, of: Element<'a, 't>, body: Option<usize>, frame: Pose, class: &'a str) {
        let class = of.attribute("childclass").unwrap_or(class);
        for child in of.children() {
            match (child.name(), body) {
                ("body", _) => self.add_body(child, body, &frame, class),
                ("frame", _) => {
                    let inner = composed(&frame, &self.pose(&child));
                    self.around.push(child);
                    self.walk(child, body, inner, class);
                    self.around.pop();
                }
                ("joint" | "freejoint", Some(body)) => self.add_joint(child, body, &frame, class),
                ("geom", Some(body)) => self.bodies[body].geoms.push(child),
                ("attach" | "replicate" | "composite" | "flexcomp", Some(body)) => {
                    self.bodies[body].unread = Some((child.name(), child.line()));
                }
                _ => {}
            }
        }
    }

    fn add_body(
        &mut self,
        of: Element<'a, 't>,
        parent: Option<usize>,
        frame: &Pose,
        class: &'a str,
    ) {
        let pose = composed(frame, &self.pose(&of));
        let inertial = of
            .child("inertial")
            .map(|inertial| self.inertial(&inertial));
        self.bodies.push(SourceBody {
            element: of,
            name: of.attribute("name").unwrap_or_default(),
            parent,
            pose,
            joints: Vec::new(),
            inertial,
            geoms: Vec::new(),
            frames: std::mem::take(&mut self.around),
            unread: None,
        });
        let index = self.bodies.len() - 1;
        self.walk(of, Some(index), HERE, class);
        self.around.clone_from(&self.bodies[index].frames);
    }

    fn inertial(&mut self, of: &Element<'a, 't>) -> Body {
        let mut read = |key, absent: [f64; 6]| match of.attribute(key) {
            Some(text) => self.numbers(text, absent, of),
            None => absent,
        };
        let [mass, ..] = read("mass", [0.0; 6]);
        let [xx, yy, zz, ..] = read("diaginertia", [0.0; 6]);
        let [xx, yy, zz, xy, xz, yz] = read("fullinertia", [xx, yy, zz, 0.0, 0.0, 0.0]);
        let along_axes = Body {
            mass,
            centre: [0.0; 3],
            inertia: [xx, xy, xz, yy, yz, zz],
        };
        seen_from(&along_axes, &self.pose(of))
    }

    fn add_joint(&mut self, of: Element<'a, 't>, body: usize, frame: &Pose, class: &'a str) {
        let kind = match of.name() {
            "freejoint" => "free",
            _ => self.value(&of, "type", class).unwrap_or("hinge"),
        };
        let text = |layout: &Self, key| layout.value(&of, key, class).unwrap_or_default();
        let (axis, point, reference) = (text(self, "axis"), text(self, "pos"), text(self, "ref"));
        let axis = direction(&self.numbers(axis, [0.0, 0.0, 1.0], &of));
        let point = self.numbers(point, [0.0; 3], &of);
        let [reference] = self.numbers(reference, [0.0], &of);
        let unit = if kind == "slide" {
            1.0
        } else {
            self.units.angle
        };
        self.bodies[body].joints.push(SourceJoint {
            element: of,
            name: of.attribute("name").unwrap_or_default(),
            kind,
            axis: turn(&frame.0, &axis),
            point: composed(frame, &(UNTURNED, point)).1,
            reference: unit * reference,
            class,
            frames: self.around.clone(),
        });
    }

    /// Whether Pinocchio reads the orientation of an element otherwise than MuJoCo: angles about axes that stand still, and an
    /// axis whose length is not 1.
    pub(super) fn is_misread(&self, of: &Element) -> bool {
        let still = self
            .units
            .sequence
            .contains(|c: char| c.is_ascii_uppercase());
        of.attribute("euler").is_some() && still || of.attribute("axisangle").is_some()
    }

    /// Position and orientation of an element.
    pub(super) fn pose(&mut self, of: &Element<'a, 't>) -> Pose {
        let text = of.attribute("pos").unwrap_or_default();
        let origin = self.numbers(text, [0.0; 3], of);
        (self.rotation(of), origin)
    }

    fn rotation(&mut self, of: &Element<'a, 't>) -> Rotation {
        let unit = self.units.angle;
        if let Some(text) = of.attribute("quat") {
            let q = self.numbers(text, [1.0, 0.0, 0.0, 0.0], of);
            return of_quaternion(&q);
        }
        if let Some(text) = of.attribute("axisangle") {
            let [x, y, z, angle] = self.numbers(text, [0.0, 0.0, 1.0, 0.0], of);
            return about(&direction(&[x, y, z]), unit * angle);
        }
        if let Some(text) = of.attribute("euler") {
            let angles = self.numbers(text, [0.0; 3], of);
            let mut out = UNTURNED;
            for (letter, angle) in self.units.sequence.chars().zip(angles) {
                let mut axis = [0.0; 3];
                let place = "xyz".find(letter.to_ascii_lowercase()).unwrap_or(0);
                axis[place] = 1.0;
                let one = about(&axis, unit * angle);
                // capitals turn about axes that stand still
                out = match letter.is_ascii_uppercase() {
                    true => product(&one, &out),
                    false => product(&out, &one),
                };
            }
            return out;
        }
        if let Some(text) = of.attribute("xyaxes") {
            let [a, b, c, d, e, f] = self.numbers(text, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0], of);
            let x = direction(&[a, b, c]);
            let along = dot(&x, &[d, e, f]);
            let y = direction(&[d - along * x[0], e - along * x[1], f - along * x[2]]);
            let z = cross(&x, &y);
            return std::array::from_fn(|i| [x[i], y[i], z[i]]);
        }
        if let Some(text) = of.attribute("zaxis") {
            let z = direction(&self.numbers(text, [0.0, 0.0, 1.0], of));
            let across = cross(&[0.0, 0.0, 1.0], &z);
            let sine = dot(&across, &across).sqrt();
            return match sine > 1e-10 {
                true => about(&times(1.0 / sine, &across), sine.atan2(z[2])),
                false if z[2] > 0.0 => UNTURNED,
                false => about(&[1.0, 0.0, 0.0], std::f64::consts::PI),
            };
        }
        UNTURNED
    }
}

/// Whether a `<frame>` can be taken away: it holds bodies and joints alone, whose own poses can be written.
pub(super) fn is_dissolved(frame: &Element) -> bool {
    frame.children().all(|child| match child.name() {
        "body" | "joint" => true,
        "frame" => is_dissolved(&child),
        _ => false,
    })
}

/// A vector of length 1.
fn direction(v: &Vector) -> Vector {
    let size = dot(v, v).sqrt();
    match size > 0.0 {
        true => times(1.0 / size, v),
        false => [0.0, 0.0, 1.0],
    }
}

/// The rotation of a quaternion w, x, y, z of any length.
fn of_quaternion(q: &[f64; 4]) -> Rotation {
    let size = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if size == 0.0 {
        return UNTURNED;
    }
    let [w, x, y, z] = q.map(|x| x / size);
    let sine = (x * x + y * y + z * z).sqrt();
    about(&direction(&[x, y, z]), 2.0 * sine.atan2(w))
}
