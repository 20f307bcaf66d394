//! Where an effect writes itself into generated code: its numbers as text, and the lists that take its statements.

use super::EffectPlace;
use super::law_text::{exact, law};
use crate::robot::cft::geometry::L4;
use crate::robot::model::{JointFriction, Model};
use crate::robot::standard::{Body, STANDARD};

/// What a model remembers from sample to sample.
#[derive(Debug, Clone, PartialEq)]
pub struct StateVariable {
    /// Name of the field.
    pub name: String,
    /// Numbers in it; one that is not in a list for `None`.
    pub size: Option<usize>,
    /// What it is at the begin, by the pose q.
    pub first: String,
    pub what: String,
}

/// Statements and numbers of all effects of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EffectsCode {
    /// After friction: what depends on a joint's own speed alone.
    pub friction: Vec<String>,
    /// The effects that it is of, by their place in the model.
    pub of_friction: Vec<usize>,
    /// After load and friction: other functions of q, v, a and load.
    pub added: Vec<String>,
    pub memory: Vec<StateVariable>,
    /// In a step, after all that remembers nothing.
    pub steps: Vec<String>,
    /// Joints whose memory takes its inertia from a pose, with the field.
    pub elastic: Vec<(usize, String)>,
    /// Standard parameters of bodies beside those of the model.
    pub extra: Option<Vec<[f64; STANDARD]>>,
    /// Gravity along the base's x and y that the model does not know, by the links \[m/s^2\].
    pub tilt: Option<[f64; 2]>,
    /// Gravity along x and y as statements for the pose alone, where it is no recursion's.
    pub askew: Vec<String>,
    /// Time by which the logged torque of each joint is late \[s\].
    pub lead_s: Vec<f64>,
    /// What is in the file, one line each.
    pub titles: Vec<String>,
}

/// An effect that is a property of links, drives or the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobotProperty {
    /// Inertia of the drive of a joint \[kg or kg m^2\].
    Drive { joint: usize, inertia: f64 },
    /// Gravity along the base's x and y \[m/s^2\].
    Gravity([f64; 2]),
    /// A body on the last link, in its frame.
    Body(Body),
}

/// An effect of a model as it writes itself into code: its numbers as text, and where its statements go.
pub(super) struct CodeSite<'a> {
    pub(super) out: &'a mut EffectsCode,
    /// The place of the effect among those of the model: its own names end with it.
    pub(super) number: usize,
    pub(super) place: EffectPlace,
    pub(super) shape: &'a [f64],
    pub(super) linear: &'a [f64],
    /// Name and place.
    pub(super) title: &'a str,
    pub(super) model: &'a Model,
    /// Direction of the friction of each joint, as text.
    pub(super) directions: &'a [String],
}

impl CodeSite<'_> {
    /// Its joint.
    pub fn joint(&self) -> usize {
        self.place.joint().unwrap_or_default()
    }

    /// Coefficient k.
    pub fn x(&self, k: usize) -> String {
        self.linear.get(k).copied().map(exact).unwrap_or_default()
    }

    /// Parameter k of the shape.
    pub fn s(&self, k: usize) -> String {
        self.shape.get(k).copied().map(exact).unwrap_or_default()
    }

    pub fn q(&self) -> String {
        format!("q[{}]", self.joint())
    }

    pub fn v(&self) -> String {
        format!("v[{}]", self.joint())
    }

    pub fn a(&self) -> String {
        format!("a[{}]", self.joint())
    }

    /// Torque of links and drives.
    pub fn load(&self) -> String {
        format!("load[{}]", self.joint())
    }

    /// The declared friction of its joint.
    pub fn law(&self) -> String {
        law(&self.model.friction[self.joint()], &self.v())
    }

    /// The constant torque of its joint.
    pub fn offset(&self) -> String {
        exact(self.model.offset[self.joint()])
    }

    /// Direction of its joint's friction, -1..1.
    pub fn direction(&self) -> String {
        self.directions[self.joint()].clone()
    }

    /// Saturating part of its joint's law over its height, -1..1.
    pub fn saturating(&self) -> String {
        saturating(self.model, self.joint())
    }

    fn to(&self, torque: &str) -> String {
        format!("tau[{}] += {torque};", self.joint())
    }

    /// A torque that depends on the joint's own speed alone.
    pub fn friction(&mut self, torque: String) {
        let line = self.to(&torque);
        self.out.friction.push(line);
        self.out.of_friction.push(self.number);
    }

    /// A torque by q, v, a and load.
    pub fn added(&mut self, torque: String) {
        let line = self.to(&torque);
        self.out.added.push(line);
    }

    /// A statement among those of torques by q, v, a and load.
    pub fn now(&mut self, statement: String) {
        self.out.added.push(statement);
    }

    /// A torque by what is remembered too.
    pub fn step(&mut self, torque: String) {
        let line = self.to(&torque);
        self.out.steps.push(line);
    }

    /// A statement among those.
    pub fn line(&mut self, statement: String) {
        self.out.steps.push(statement);
    }

    /// A memory that begins as `first`, so many numbers long or a single one: its text in statements.
    pub fn remember(&mut self, name: &str, size: Option<usize>, first: &str, by: &str) -> String {
        let name = format!("{name}_{}", self.number);
        let own = format!("state.{name}");
        self.out.memory.push(StateVariable {
            name,
            size,
            first: first.to_owned(),
            what: format!("{}, by {by}", self.title),
        });
        own
    }

    /// The memory last made takes its inertia from the first pose.
    pub fn elastic(&mut self) {
        if let Some(memory) = self.out.memory.last() {
            let of = (self.joint(), memory.name.clone());
            self.out.elastic.push(of);
        }
    }

    /// Every torque is late.
    pub fn late(&mut self) {
        let shift = self.linear.first().copied().unwrap_or_default();
        for (j, lead) in self.out.lead_s.iter_mut().enumerate() {
            if self.place.touches(j) {
                *lead += shift;
            }
        }
    }

    /// Bodies beside those of the model.
    pub fn bodies(&mut self, bodies: Vec<[f64; STANDARD]>) {
        let Some(all) = &mut self.out.extra else {
            self.out.extra = Some(bodies);
            return;
        };
        for (sum, x) in all.iter_mut().flatten().zip(bodies.iter().flatten()) {
            *sum += x;
        }
    }

    /// Statements of a force in the screws of its place on the CFT robot's pantograph, by speed and acceleration.
    pub fn of_screws(&mut self, force: impl Fn(&str, &str) -> String) {
        for row in self.place.rows() {
            self.of_screw(row, &force);
        }
    }

    /// Those of one screw: its row of d(x_r, y_r)/d(q4, q5) carries the force to the joints.
    fn of_screw(&mut self, row: usize, force: &impl Fn(&str, &str) -> String) {
        let l = exact(L4);
        let [near, far, speed, pull, name] = ["near", "far", "speed", "pull", "force"]
            .map(|name| format!("{name}_{}_{row}", self.number));
        let w = "(v[2] + v[3])";
        let [of, rate, sign] = match row {
            0 => ["cos", "sin", ""],
            _ => ["sin", "cos", "-"],
        };
        let turned = format!("{sign}{l} * {rate}(q[2] + q[3]) * {w}");
        let text = force(&speed, &pull);
        let added = &mut self.out.added;
        added.push(format!("let {far} = -{l} * {of}(q[2] + q[3]);"));
        added.push(format!("let {near} = {far} - {l} * {of}(q[2]);"));
        if text.contains(&speed) {
            added.push(format!("let {speed} = {near} * v[2] + {far} * v[3];"));
        }
        if text.contains(&pull) {
            added.push(format!(
                "let {pull} = {near} * a[2] + {far} * a[3] + ({turned} + {sign}{l} * {rate}(q[2]) * v[2]) * v[2] \
                 + {turned} * v[3];"
            ));
        }
        added.push(format!("let {name} = {text};"));
        added.push(format!("tau[2] += {near} * {name};"));
        added.push(format!("tau[3] += {far} * {name};"));
    }
}

/// Saturating part of a joint's law over its height, -1..1.
pub(super) fn saturating(model: &Model, j: usize) -> String {
    let v = format!("v[{j}]");
    match &model.friction[j] {
        JointFriction::None => "0.0".to_owned(),
        JointFriction::DoubleTanh(own) if (own.coulomb_1 + own.coulomb_2).abs() > 1e-12 => {
            let height = exact(own.coulomb_1 + own.coulomb_2);
            let all = law(&model.friction[j], &v);
            format!("({all} - {} * {v}) / {height}", exact(own.viscous))
        }
        JointFriction::ViscousCoulomb(_) | JointFriction::DoubleTanh(_) => format!("$sign({v})"),
    }
}
