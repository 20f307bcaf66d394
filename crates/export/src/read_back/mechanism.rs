//! A mechanism as a file describes it, and the torques that it needs: forces and moments on every body, seen along the
//! axes of the joints before it. Bodies, axes and points are followed in the frame that stands still.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, SymmetricEigen, Translation3, UnitQuaternion, Vector3};

use super::ReadError;

/// A tree of rigid bodies, each after the one that carries it.
#[derive(Debug, Clone, Default)]
pub struct ReadMechanism {
    pub bodies: Vec<ReadBody>,
    /// Acceleration of free fall \[m/s^2\].
    pub gravity: Vector3<f64>,
    /// Sums of joints that have springs, dampers and inertias of their own.
    pub tendons: Vec<ReadTendon>,
    /// Density \[kg/m^3\] and viscosity \[Pa s\] of what it moves in.
    pub fluid: [f64; 2],
    /// What adds a torque that is not computed, in words.
    pub beyond: Vec<String>,
    /// What is not read of a body and would change it, in words.
    pub unread: Vec<(usize, String)>,
}

/// A rigid body and the joints that move it.
#[derive(Debug, Clone)]
pub struct ReadBody {
    pub name: String,
    pub parent: Option<usize>,
    /// Its frame in that of the body before, its joints at 0.
    pub place: Isometry3<f64>,
    /// From the outermost to the innermost.
    pub joints: Vec<ReadJoint>,
    /// \[kg\]
    pub mass: f64,
    /// Centre of mass in its frame \[m\].
    pub centre: Vector3<f64>,
    /// About the centre, along the axes of its frame \[kg m^2\].
    pub inertia: Matrix3<f64>,
    /// Share of its weight that something else carries.
    pub weightless: f64,
}

/// A hinge or a slide.
#[derive(Debug, Clone)]
pub struct ReadJoint {
    pub name: String,
    pub slides: bool,
    /// In the frame of the body \[1\].
    pub axis: Vector3<f64>,
    /// A point of the axis in the frame of the body \[m\].
    pub point: Vector3<f64>,
    /// Position at which the body stands where `place` says [rad or m].
    pub reference: f64,
    pub armature: f64,
    /// Torque at the speed v: d0 v + d1 v |v| + d2 v^3.
    pub damping: [f64; 3],
    pub friction: f64,
    /// Spring: its torque at x from `rest`, as that of the damping at a speed.
    pub stiffness: [f64; 3],
    pub rest: f64,
    /// The joint that it follows, by a polynomial of rising powers.
    pub follows: Option<(String, [f64; 5])>,
}

/// A weighted sum of joints.
#[derive(Debug, Clone)]
pub struct ReadTendon {
    pub name: String,
    pub joints: Vec<(String, f64)>,
    pub armature: f64,
    pub damping: f64,
    pub friction: f64,
    pub stiffness: f64,
    /// Sum at which its spring is at rest, from where to where.
    pub rest: [f64; 2],
}

/// Where a joint's position comes from.
#[derive(Debug, Clone, Copy)]
enum PositionSource {
    /// This place in vectors.
    Given(usize),
    /// It stands still.
    Held(f64),
    /// A polynomial of this place in vectors.
    Follows(usize, [f64; 5]),
}

/// What a torque is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorquePart {
    /// Bodies, armatures, damping and friction of joints.
    Bodies,
    /// Springs of one joint, by its place among all.
    Spring(usize),
    /// Weight that something else carries.
    Weightless,
    /// The medium around.
    Fluid,
    /// The tendon of this place.
    Tendon(usize),
}

/// A mechanism whose joints are those of a model, and others that stand still or follow.
#[derive(Debug)]
pub struct DrivenMechanism<'a> {
    pub mechanism: &'a ReadMechanism,
    sources: Vec<Vec<PositionSource>>,
    joints: usize,
}

/// A joint in the frame that stands still.
struct JointAxis {
    axis: Vector3<f64>,
    point: Vector3<f64>,
    slides: bool,
    /// Position, speed and acceleration.
    state: [f64; 3],
    /// Place in vectors, and the change of its position with that of the joint there.
    acts_on: Option<(usize, f64)>,
}

/// A body in the frame that stands still.
struct MovingBody {
    frame: Isometry3<f64>,
    /// Of its frame's origin and of its rotation.
    speed: [Vector3<f64>; 2],
    acceleration: [Vector3<f64>; 2],
}

impl ReadMechanism {
    /// The joint of this name.
    pub fn joint(&self, name: &str) -> Option<&ReadJoint> {
        let mut all = self.bodies.iter().flat_map(|body| &body.joints);
        all.find(|joint| joint.name == name)
    }

    /// Lets the joints `names` be moved, `held` stand at positions other than 0.
    ///
    /// # Errors
    /// A joint that is not there, or one that follows itself.
    pub fn driven(
        &self,
        names: &[String],
        held: &BTreeMap<String, f64>,
    ) -> Result<DrivenMechanism<'_>, ReadError> {
        if let Some(lost) = names.iter().find(|name| self.joint(name).is_none()) {
            return Err(ReadError::new(format!("has no joint `{lost}`")));
        }
        let source = |joint: &ReadJoint| self.source(joint, names, held, 0);
        let each = self.bodies.iter();
        let sources = each.map(|body| body.joints.iter().map(source).collect());
        Ok(DrivenMechanism {
            mechanism: self,
            sources: sources.collect::<Result<_, _>>()?,
            joints: names.len(),
        })
    }

    fn source(
        &self,
        joint: &ReadJoint,
        names: &[String],
        held: &BTreeMap<String, f64>,
        depth: usize,
    ) -> Result<PositionSource, ReadError> {
        if let Some(place) = names.iter().position(|name| *name == joint.name) {
            return Ok(PositionSource::Given(place));
        }
        let stands = || PositionSource::Held(held.get(&joint.name).copied().unwrap_or(0.0));
        let Some((master, law)) = &joint.follows else {
            return Ok(stands());
        };
        if depth > self.bodies.len() {
            return Err(ReadError::new(format!(
                "joint `{}` follows itself",
                joint.name
            )));
        }
        let Some(master) = self.joint(master) else {
            return Ok(stands());
        };
        Ok(match self.source(master, names, held, depth + 1)? {
            PositionSource::Given(place) => {
                let mut law = *law;
                // the law is of ways from the reference
                if master.reference != 0.0 {
                    law = shifted(&law, master.reference);
                }
                law[0] += joint.reference;
                PositionSource::Follows(place, law)
            }
            PositionSource::Held(at) => {
                let way = at - master.reference;
                let value = law.iter().rev().fold(0.0, |sum, c| sum * way + c);
                PositionSource::Held(joint.reference + value)
            }
            PositionSource::Follows(place, of_master) => {
                let [c0, c1, rest @ ..] = *law;
                if rest.iter().any(|c| *c != 0.0) {
                    let text = format!("joint `{}` follows one that follows", joint.name);
                    return Err(ReadError::new(text));
                }
                let mut law = of_master.map(|c| c1 * c);
                law[0] += c0 + joint.reference - c1 * master.reference;
                PositionSource::Follows(place, law)
            }
        })
    }
}

/// A polynomial of x - by as one of x.
fn shifted(law: &[f64; 5], by: f64) -> [f64; 5] {
    let mut out = [0.0; 5];
    for c in law.iter().rev() {
        // out * (x - by) + c
        let mut next = [0.0; 5];
        for k in 0..5 {
            next[k] = -by * out[k] + if k > 0 { out[k - 1] } else { 0.0 };
        }
        next[0] += c;
        out = next;
    }
    out
}

impl DrivenMechanism<'_> {
    /// What is not read of the bodies that the model's joints move.
    pub fn unread(&self) -> Option<&str> {
        let moves = |mut body: usize| loop {
            let still = |source: &PositionSource| matches!(source, PositionSource::Held(_));
            if !self.sources[body].iter().all(still) {
                return true;
            }
            match self.mechanism.bodies[body].parent {
                Some(parent) => body = parent,
                None => return false,
            }
        };
        let all = self.mechanism.unread.iter();
        all.filter(|(body, _)| moves(*body))
            .map(|(_, what)| what.as_str())
            .next()
    }

    /// Torque that one part needs at each joint of the model, at positions, speeds and accelerations of these.
    pub fn torque(&self, part: TorquePart, q: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.joints];
        let axes = self.axes(q, v, a);
        match part {
            TorquePart::Spring(place) => self.spring(place, &axes, &mut out),
            TorquePart::Tendon(place) => self.tendon(place, &axes, &mut out),
            TorquePart::Bodies => {
                self.along_joints(&axes, &mut out);
                self.on_bodies(axes, &mut out, |body, moving| {
                    self.mechanism.inertial(body, moving)
                });
            }
            TorquePart::Weightless => {
                let g = self.mechanism.gravity;
                self.on_bodies(axes, &mut out, |body, _| {
                    [g * (body.mass * body.weightless), Vector3::zeros()]
                });
            }
            TorquePart::Fluid => {
                let fluid = self.mechanism.fluid;
                self.on_bodies(axes, &mut out, |body, moving| drag(fluid, body, moving));
            }
        }
        out
    }

    /// States of all joints, their axes still in the frames of their bodies.
    fn axes(&self, q: &[f64], v: &[f64], a: &[f64]) -> Vec<Vec<JointAxis>> {
        let bodies = self.mechanism.bodies.iter().zip(&self.sources);
        let each = bodies.map(|(body, sources)| {
            let joints = body.joints.iter().zip(sources);
            let joints = joints.map(|(joint, source)| {
                let (state, acts_on) = match source {
                    PositionSource::Given(i) => ([q[*i], v[*i], a[*i]], Some((*i, 1.0))),
                    PositionSource::Held(position) => ([*position, 0.0, 0.0], None),
                    PositionSource::Follows(i, c) => {
                        let x = q[*i];
                        let value = c.iter().rev().fold(0.0, |sum, c| sum * x + c);
                        let slope = c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * 4.0 * c[4]));
                        let bend = 2.0 * c[2] + x * (6.0 * c[3] + x * 12.0 * c[4]);
                        let state = [value, slope * v[*i], slope * a[*i] + bend * v[*i] * v[*i]];
                        (state, Some((*i, slope)))
                    }
                };
                JointAxis {
                    axis: joint.axis,
                    point: joint.point,
                    slides: joint.slides,
                    state: [state[0] - joint.reference, state[1], state[2]],
                    acts_on,
                }
            });
            joints.collect()
        });
        each.collect()
    }

    /// Armature, damping and friction of every joint.
    fn along_joints(&self, axes: &[Vec<JointAxis>], out: &mut [f64]) {
        let bodies = self.mechanism.bodies.iter().zip(axes);
        for (joint, axis) in bodies.flat_map(|(body, axes)| body.joints.iter().zip(axes)) {
            if let Some((place, slope)) = axis.acts_on {
                let [_, v, a] = axis.state;
                let loss = odd(&joint.damping, v) + joint.friction * direction(v);
                out[place] += slope * (joint.armature * a + loss);
            }
        }
    }

    fn spring(&self, place: usize, axes: &[Vec<JointAxis>], out: &mut [f64]) {
        let bodies = self.mechanism.bodies.iter().zip(axes);
        let mut all = bodies.flat_map(|(body, axes)| body.joints.iter().zip(axes));
        let Some((joint, axis)) = all.nth(place) else {
            return;
        };
        if let Some((place, slope)) = axis.acts_on {
            let x = axis.state[0] + joint.reference - joint.rest;
            out[place] += slope * odd(&joint.stiffness, x);
        }
    }

    fn tendon(&self, place: usize, axes: &[Vec<JointAxis>], out: &mut [f64]) {
        let tendon = &self.mechanism.tendons[place];
        let find = |name: &str| {
            let bodies = self.mechanism.bodies.iter().zip(axes);
            let mut all = bodies.flat_map(|(body, axes)| body.joints.iter().zip(axes));
            all.find(|(joint, _)| joint.name == name)
        };
        let terms = tendon.joints.iter();
        let terms = terms.filter_map(|(name, factor)| Some((find(name)?, *factor)));
        let terms: Vec<((&ReadJoint, &JointAxis), f64)> = terms.collect();
        let sum = |k: usize| -> f64 {
            let each = terms.iter().map(|((joint, axis), factor)| {
                let reference = if k == 0 { joint.reference } else { 0.0 };
                factor * (axis.state[k] + reference)
            });
            each.sum()
        };
        let (x, v, a) = (sum(0), sum(1), sum(2));
        let stretched = (x - tendon.rest[1]).max(0.0) + (x - tendon.rest[0]).min(0.0);
        let pull = tendon.stiffness * stretched
            + tendon.damping * v
            + tendon.friction * direction(v)
            + tendon.armature * a;
        for ((_, axis), factor) in &terms {
            if let Some((place, slope)) = axis.acts_on {
                out[place] += slope * factor * pull;
            }
        }
    }

    /// Adds what a force at the centre of each body and a moment need at the joints before it.
    fn on_bodies(
        &self,
        mut axes: Vec<Vec<JointAxis>>,
        out: &mut [f64],
        load: impl Fn(&ReadBody, &MovingBody) -> [Vector3<f64>; 2],
    ) {
        let bodies = &self.mechanism.bodies;
        let mut moving: Vec<MovingBody> = Vec::with_capacity(bodies.len());
        for (body, joints) in bodies.iter().zip(&mut axes) {
            let carrier = body.parent.map(|parent| &moving[parent]);
            moving.push(moved(body, carrier, joints));
        }
        for (i, (body, state)) in bodies.iter().zip(&moving).enumerate() {
            let [force, moment] = load(body, state);
            let centre = (state.frame * nalgebra::Point3::from(body.centre)).coords;
            let mut next = Some(i);
            while let Some(k) = next {
                for joint in &axes[k] {
                    if let Some((place, slope)) = joint.acts_on {
                        let along = match joint.slides {
                            true => force,
                            false => moment + (centre - joint.point).cross(&force),
                        };
                        out[place] += slope * joint.axis.dot(&along);
                    }
                }
                next = bodies[k].parent;
            }
        }
    }
}

impl ReadMechanism {
    /// Force and moment that move a body, its weight included.
    fn inertial(&self, body: &ReadBody, moving: &MovingBody) -> [Vector3<f64>; 2] {
        let turn = moving.frame.rotation.to_rotation_matrix();
        let arm = turn * body.centre;
        let ([_, w], [linear, angular]) = (moving.speed, moving.acceleration);
        let at_centre = linear + angular.cross(&arm) + w.cross(&w.cross(&arm));
        let inertia = turn.matrix() * body.inertia * turn.matrix().transpose();
        let moment = inertia * angular + w.cross(&(inertia * w));
        [(at_centre - self.gravity) * body.mass, moment]
    }
}

/// c0 x + c1 x |x| + c2 x^3.
fn odd([c0, c1, c2]: &[f64; 3], x: f64) -> f64 {
    x * (c0 + x.abs() * (c1 + x.abs() * c2))
}

/// Sign of a speed, 0 at rest.
fn direction(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

/// A body behind its joints; these are put into the frame that stands still.
fn moved(body: &ReadBody, carrier: Option<&MovingBody>, joints: &mut [JointAxis]) -> MovingBody {
    let zero = Vector3::zeros();
    let (around, speed, acceleration) = match carrier {
        None => (Isometry3::identity(), [zero; 2], [zero; 2]),
        Some(of) => (of.frame, of.speed, of.acceleration),
    };
    let mut frame = around * body.place;
    // of the point of the carrier that is at the frame's origin
    let arm = frame.translation.vector - around.translation.vector;
    let ([mut v, mut w], [mut a, mut alpha]) = (speed, acceleration);
    a += alpha.cross(&arm) + w.cross(&w.cross(&arm));
    v += w.cross(&arm);
    for joint in joints {
        let axis = frame.rotation * joint.axis;
        let point = (frame * nalgebra::Point3::from(joint.point)).coords;
        let [x, dx, ddx] = joint.state;
        (joint.axis, joint.point) = (axis, point);
        if joint.slides {
            let way = axis * x;
            a += axis * ddx
                + 2.0 * w.cross(&(axis * dx))
                + alpha.cross(&way)
                + w.cross(&w.cross(&way));
            v += axis * dx + w.cross(&way);
            frame = Translation3::from(way) * frame;
            continue;
        }
        // at the point on the axis, which the joint leaves where it is, then back to the origin of the turned frame
        let to_point = point - frame.translation.vector;
        a += alpha.cross(&to_point) + w.cross(&w.cross(&to_point));
        v += w.cross(&to_point);
        alpha += axis * ddx + w.cross(&(axis * dx));
        w += axis * dx;
        let turn = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), x);
        let to_origin = -(turn * to_point);
        a += alpha.cross(&to_origin) + w.cross(&w.cross(&to_origin));
        v += w.cross(&to_origin);
        frame = Isometry3::from_parts(Translation3::from(point + to_origin), turn * frame.rotation);
    }
    MovingBody {
        frame,
        speed: [v, w],
        acceleration: [a, alpha],
    }
}

/// Force and moment against what a medium does to the box that has a body's inertia (MuJoCo's documentation, "Inertia
/// model" of fluid forces).
fn drag([density, viscosity]: [f64; 2], body: &ReadBody, moving: &MovingBody) -> [Vector3<f64>; 2] {
    use std::f64::consts::PI;
    let eigen = SymmetricEigen::new(body.inertia);
    let moments = eigen.eigenvalues;
    let half = |k: usize| {
        let twice = moments.sum() - 2.0 * moments[k];
        (1.5 * twice / body.mass).max(0.0).sqrt()
    };
    let axes = moving.frame.rotation.to_rotation_matrix().matrix() * eigen.eigenvectors;
    let arm = moving.frame.rotation * body.centre;
    let [v, w] = moving.speed;
    let v = axes.transpose() * (v + w.cross(&arm));
    let w = axes.transpose() * w;
    if body.mass <= 0.0 {
        return [Vector3::zeros(); 2];
    }
    let r = Vector3::new(half(0), half(1), half(2));
    let mean = r.sum() / 3.0;
    let force = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        2.0 * density * r[i] * r[j] * v[k].abs() * v[k] + 6.0 * viscosity * PI * mean * v[k]
    };
    let moment = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let quick = 0.5 * density * r[k] * (r[i].powi(4) + r[j].powi(4)) * w[k].abs() * w[k];
        quick + 8.0 * viscosity * PI * mean.powi(3) * w[k]
    };
    let force = Vector3::new(force(0), force(1), force(2));
    let moment = Vector3::new(moment(0), moment(1), moment(2));
    [axes * force, axes * moment]
}
