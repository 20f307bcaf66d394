//! An MJCF as a mechanism: what MuJoCo compiles of bodies, joints, tendons, equalities and options.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::classes::{ACTUATORS, ClassTable};
use super::mechanism::{ReadBody, ReadJoint, ReadMechanism, ReadTendon};
use super::{ReadError, filled, named, numbers, tensor, unit};
use cft_ident_files::config::xml::{Element, XmlTree, without_comments};

/// What holds of a whole file.
struct FileReading<'a> {
    classes: ClassTable<'a>,
    /// Radians of its unit of angles.
    angle: f64,
    euler: &'a str,
    weighs_geoms: bool,
    out: ReadMechanism,
}

/// Where an element stands.
#[derive(Clone, Copy)]
struct ElementPlace<'a> {
    body: Option<usize>,
    /// Of the frames around it, in that of the body.
    frame: Isometry3<f64>,
    class: Option<&'a str>,
}

/// Reads the text of an MJCF that includes no other file.
///
/// # Errors
/// What is not understood, and what changes bodies while MuJoCo compiles them.
pub fn read(text: &str) -> Result<ReadMechanism, ReadError> {
    let plain = without_comments(text);
    let tree = XmlTree::parse(&plain).map_err(|wrong| ReadError::new(wrong.problem.to_string()))?;
    let root = tree.root();
    let all = |name: &'static str| root.children().filter(move |e| e.name() == name);
    let mut reading = FileReading {
        classes: ClassTable::default(),
        angle: std::f64::consts::PI / 180.0,
        euler: "xyz",
        weighs_geoms: true,
        out: ReadMechanism {
            gravity: Vector3::new(0.0, 0.0, -9.81),
            ..ReadMechanism::default()
        },
    };
    all("compiler").try_for_each(|compiler| reading.compiler(compiler))?;
    all("option").try_for_each(|option| reading.option(option))?;
    all("default").for_each(|default| reading.classes.add(default));
    let world = ElementPlace {
        body: None,
        frame: Isometry3::identity(),
        class: None,
    };
    all("worldbody").try_for_each(|body| reading.inside(body, world))?;
    all("equality").try_for_each(|equality| reading.equality(equality))?;
    all("tendon").try_for_each(|tendon| reading.tendons(tendon))?;
    all("actuator").try_for_each(|actuator| reading.actuators(actuator))?;
    Ok(reading.out)
}

impl<'a> FileReading<'a> {
    fn compiler(&mut self, of: Element<'a, '_>) -> Result<(), ReadError> {
        match of.attribute("angle") {
            Some("radian") => self.angle = 1.0,
            Some("degree") => self.angle = std::f64::consts::PI / 180.0,
            _ => {}
        }
        self.euler = of.attribute("eulerseq").unwrap_or(self.euler);
        match of.attribute("inertiafromgeom") {
            Some("true") => {
                return Err(ReadError::new(
                    "inertiafromgeom weighs bodies by their geoms",
                ));
            }
            Some(word) => self.weighs_geoms = word != "false",
            None => {}
        }
        let absent = [
            ("settotalmass", -1.0),
            ("boundmass", 0.0),
            ("boundinertia", 0.0),
        ];
        for (key, absent) in absent {
            if filled(of.attribute(key), [absent])?[0] > 0.0 {
                return Err(ReadError::new(format!("{key} changes bodies")));
            }
        }
        match of.attribute("balanceinertia") {
            Some("true") => Err(ReadError::new("balanceinertia changes bodies")),
            _ => Ok(()),
        }
    }

    fn option(&mut self, of: Element<'a, '_>) -> Result<(), ReadError> {
        let out = &mut self.out;
        out.gravity = Vector3::from(filled(of.attribute("gravity"), out.gravity.into())?);
        let [density, viscosity] = out.fluid;
        out.fluid = [
            filled(of.attribute("density"), [density])?[0],
            filled(of.attribute("viscosity"), [viscosity])?[0],
        ];
        if filled(of.attribute("wind"), [0.0; 3])? != [0.0; 3] {
            out.beyond.push("wind".to_owned());
        }
        for flag in of.children().filter(|e| e.name() == "flag") {
            for key in [
                "gravity",
                "damper",
                "frictionloss",
                "constraint",
                "passive",
                "equality",
            ] {
                if flag.attribute(key) == Some("disable") {
                    return Err(ReadError::new(format!("the flag `{key}` is off")));
                }
            }
        }
        Ok(())
    }

    /// What stands in the world, a body or a frame.
    fn inside(&mut self, of: Element<'a, '_>, place: ElementPlace<'a>) -> Result<(), ReadError> {
        let place = ElementPlace {
            class: of.attribute("childclass").or(place.class),
            ..place
        };
        for child in of.children() {
            match child.name() {
                "body" => self.body(child, place)?,
                "frame" => {
                    let frame = place.frame * self.placed(&child, "pos")?;
                    self.inside(child, ElementPlace { frame, ..place })?;
                }
                "joint" => self.joint(child, place)?,
                "geom" => self.geom(child, place),
                "attach" | "replicate" | "composite" | "flexcomp" => {
                    if let Some(body) = place.body {
                        let what = format!("<{}> of line {}", child.name(), child.line());
                        self.out.unread.push((body, what));
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Position and orientation of an element.
    fn placed(&self, of: &Element, pos: &str) -> Result<Isometry3<f64>, ReadError> {
        let [x, y, z] = filled(of.attribute(pos), [0.0; 3])?;
        let turn = self.orientation(of)?;
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn))
    }

    fn orientation(&self, of: &Element) -> Result<UnitQuaternion<f64>, ReadError> {
        if let Some(text) = of.attribute("quat") {
            let [w, i, j, k] = filled(Some(text), [1.0, 0.0, 0.0, 0.0])?;
            return Ok(UnitQuaternion::new_normalize(nalgebra::Quaternion::new(
                w, i, j, k,
            )));
        }
        if let Some(text) = of.attribute("axisangle") {
            let [x, y, z, angle] = filled(Some(text), [0.0, 0.0, 1.0, 0.0])?;
            let axis = Unit::new_normalize(Vector3::new(x, y, z));
            return Ok(UnitQuaternion::from_axis_angle(&axis, angle * self.angle));
        }
        if let Some(text) = of.attribute("euler") {
            let mut turn = UnitQuaternion::identity();
            for (letter, angle) in self.euler.chars().zip(numbers(text)?) {
                let axis = match letter.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    _ => Vector3::z_axis(),
                };
                let one = UnitQuaternion::from_axis_angle(&axis, angle * self.angle);
                // small letters turn about axes that turn too
                turn = if letter.is_ascii_lowercase() {
                    turn * one
                } else {
                    one * turn
                };
            }
            return Ok(turn);
        }
        if let Some(text) = of.attribute("xyaxes") {
            let [a, b, c, d, e, f] = filled(Some(text), [1.0, 0.0, 0.0, 0.0, 1.0, 0.0])?;
            let x = Vector3::new(a, b, c).normalize();
            let y = Vector3::new(d, e, f);
            let y = (y - x * x.dot(&y)).normalize();
            let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            let turn = nalgebra::Rotation3::from_matrix_unchecked(axes);
            return Ok(UnitQuaternion::from_rotation_matrix(&turn));
        }
        if let Some(text) = of.attribute("zaxis") {
            let z = unit(Some(text), [0.0, 0.0, 1.0])?;
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &z);
            let half = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            return Ok(turn.unwrap_or(half));
        }
        Ok(UnitQuaternion::identity())
    }

    fn body(&mut self, of: Element<'a, '_>, place: ElementPlace<'a>) -> Result<(), ReadError> {
        let mut body = ReadBody {
            name: of.attribute("name").unwrap_or_default().to_owned(),
            parent: place.body,
            place: place.frame * self.placed(&of, "pos")?,
            joints: Vec::new(),
            mass: 0.0,
            centre: Vector3::zeros(),
            inertia: Matrix3::zeros(),
            weightless: filled(of.attribute("gravcomp"), [0.0])?[0],
        };
        if let Some(inertial) = of.child("inertial") {
            let at = self.placed(&inertial, "pos")?;
            let [xx, yy, zz] = filled(inertial.attribute("diaginertia"), [0.0; 3])?;
            let moments = [xx, yy, zz, 0.0, 0.0, 0.0];
            let moments = filled(inertial.attribute("fullinertia"), moments)?;
            let turn = at.rotation.to_rotation_matrix();
            body.mass = filled(inertial.attribute("mass"), [0.0])?[0];
            body.centre = at.translation.vector;
            body.inertia = turn.matrix() * tensor(moments) * turn.matrix().transpose();
        } else {
            // until a geom is found that weighs
            body.mass = f64::NAN;
        }
        self.out.bodies.push(body);
        let index = self.out.bodies.len() - 1;
        let place = ElementPlace {
            body: Some(index),
            frame: Isometry3::identity(),
            class: place.class,
        };
        // NaN says that nothing is known of its mass yet
        self.inside(of, place)?;
        let body = &mut self.out.bodies[index];
        if body.mass.is_nan() {
            body.mass = 0.0;
        }
        Ok(())
    }

    /// A geom weighs where its body has no inertial.
    fn geom(&mut self, of: Element<'a, '_>, place: ElementPlace<'a>) {
        let value = |key| self.classes.attribute(&of, key, place.class);
        let no = |text: Option<&str>| text.and_then(|x| x.trim().parse::<f64>().ok()) == Some(0.0);
        let light = no(value("mass")) || (value("mass").is_none() && no(value("density")));
        let shaped = value("fluidshape") == Some("ellipsoid");
        let Some(body) = place.body else { return };
        let line = of.line();
        if self.out.bodies[body].mass.is_nan() && self.weighs_geoms && !light {
            let name = self.out.bodies[body].name.clone();
            let what = format!("the weight of the geom of line {line} in body {name}");
            self.out.unread.push((body, what));
        }
        if shaped && self.out.fluid != [0.0; 2] {
            self.out
                .beyond
                .push(format!("the fluid around the geom of line {line}"));
        }
    }

    fn joint(&mut self, of: Element<'a, '_>, place: ElementPlace<'a>) -> Result<(), ReadError> {
        let value = |key| self.classes.attribute(&of, key, place.class);
        let slides = match value("type") {
            None | Some("hinge") => false,
            Some("slide") => true,
            // what floats or turns as a ball stands still
            Some(_) => return Ok(()),
        };
        let Some(body) = place.body else {
            return Err(ReadError::new(format!(
                "joint of line {} is in no body",
                of.line()
            )));
        };
        if filled(value("springdamper"), [0.0; 2])? != [0.0; 2] {
            let line = of.line();
            return Err(ReadError::new(format!(
                "springdamper of line {line} changes its joint"
            )));
        }
        let angle = if slides { 1.0 } else { self.angle };
        let point = Point3::from(Vector3::from(filled(value("pos"), [0.0; 3])?));
        let axis = unit(value("axis"), [0.0, 0.0, 1.0])?;
        let joint = ReadJoint {
            name: of.attribute("name").unwrap_or_default().to_owned(),
            slides,
            axis: place.frame.rotation * axis,
            point: (place.frame * point).coords,
            reference: angle * filled(value("ref"), [0.0])?[0],
            armature: filled(value("armature"), [0.0])?[0],
            damping: filled(value("damping"), [0.0; 3])?,
            friction: filled(value("frictionloss"), [0.0])?[0],
            stiffness: filled(value("stiffness"), [0.0; 3])?,
            rest: angle * filled(value("springref"), [0.0])?[0],
            follows: None,
        };
        self.out.bodies[body].joints.push(joint);
        Ok(())
    }

    fn equality(&mut self, of: Element<'a, '_>) -> Result<(), ReadError> {
        for tie in of.children().filter(|e| e.name() == "joint") {
            let value = |key| self.classes.attribute(&tie, key, None);
            let (follower, Some(master)) = (named(&tie, "joint1")?, tie.attribute("joint2")) else {
                continue;
            };
            let law = filled(value("polycoef"), [0.0, 1.0, 0.0, 0.0, 0.0])?;
            let joints = self.out.bodies.iter_mut().flat_map(|body| &mut body.joints);
            let mut joints = joints.filter(|joint| joint.name == follower);
            if let Some(joint) = joints.next() {
                joint.follows = Some((master.to_owned(), law));
            }
        }
        Ok(())
    }

    fn tendons(&mut self, of: Element<'a, '_>) -> Result<(), ReadError> {
        for tendon in of.children() {
            let value = |key| self.classes.attribute(&tendon, key, None);
            let number = |key| Ok::<f64, ReadError>(filled(value(key), [0.0])?[0]);
            let name = tendon.attribute("name").unwrap_or("of no name").to_owned();
            let read = ReadTendon {
                armature: number("armature")?,
                damping: number("damping")?,
                friction: number("frictionloss")?,
                stiffness: number("stiffness")?,
                rest: self.rest_of(&tendon)?,
                joints: Vec::new(),
                name,
            };
            let terms = [read.armature, read.damping, read.friction, read.stiffness];
            if terms == [0.0; 4] {
                continue;
            }
            if tendon.name() != "fixed" {
                self.out.beyond.push(format!("the tendon {}", read.name));
                continue;
            }
            let joints = tendon.children().filter(|e| e.name() == "joint");
            let joints = joints.map(|joint| {
                let [factor] = filled(joint.attribute("coef"), [1.0])?;
                Ok((named(&joint, "joint")?.to_owned(), factor))
            });
            let joints = joints.collect::<Result<_, ReadError>>()?;
            self.out.tendons.push(ReadTendon { joints, ..read });
        }
        Ok(())
    }

    /// Lengths of a fixed tendon at which its spring is at rest: where its joints are at their references, if none is given.
    fn rest_of(&self, tendon: &Element<'a, '_>) -> Result<[f64; 2], ReadError> {
        let value = self.classes.attribute(tendon, "springlength", None);
        let given = numbers(value.unwrap_or("-1"))?;
        match given[..] {
            [low, high, ..] => return Ok([low, high]),
            [length] if length >= 0.0 => return Ok([length; 2]),
            _ => {}
        }
        let mut sum = 0.0;
        for joint in tendon.children().filter(|e| e.name() == "joint") {
            let known = joint
                .attribute("joint")
                .and_then(|name| self.out.joint(name));
            let [factor] = filled(joint.attribute("coef"), [1.0])?;
            sum += factor * known.map_or(0.0, |joint| joint.reference);
        }
        Ok([sum; 2])
    }

    /// Inertia and damping of motors, seen from their joints.
    fn actuators(&mut self, of: Element<'a, '_>) -> Result<(), ReadError> {
        let mut added: BTreeMap<String, [f64; 2]> = BTreeMap::new();
        for actuator in of.children().filter(|e| ACTUATORS.contains(&e.name())) {
            let value = |key| self.classes.attribute(&actuator, key, None);
            let [armature] = filled(value("armature"), [0.0])?;
            let damping = filled(value("damping"), [0.0; 3])?;
            if armature == 0.0 && damping == [0.0; 3] {
                continue;
            }
            let [gear] = filled(value("gear"), [1.0])?;
            let joint = actuator
                .attribute("joint")
                .or(actuator.attribute("jointinparent"));
            let name = actuator.attribute("name").unwrap_or("of no name");
            match joint {
                Some(joint) if damping[1..] == [0.0; 2] => {
                    let sum = added.entry(joint.to_owned()).or_default();
                    sum[0] += gear * gear * armature;
                    sum[1] += gear * gear * damping[0];
                }
                _ => self
                    .out
                    .beyond
                    .push(format!("armature and damping of the actuator {name}")),
            }
        }
        let joints = self.out.bodies.iter_mut().flat_map(|body| &mut body.joints);
        for joint in joints {
            if let Some([armature, damping]) = added.get(&joint.name) {
                joint.armature += armature;
                joint.damping[0] += damping;
            }
        }
        Ok(())
    }
}
