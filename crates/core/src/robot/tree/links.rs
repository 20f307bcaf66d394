//! The tree: links behind joints, where each joint sits, and which coordinate drives it. A chain is
//! a tree without branches.
//!
//! A joint's frame is given in the frame of the link before it; the link turns about (or slides
//! along) the joint's axis, and its own frame is the joint's frame after that motion. A modified
//! Denavit-Hartenberg row (Craig 1986) and a URDF joint are both of this form.

use super::space::{Rotation, Vector, about, product};
use crate::explain::Explain;
use crate::robot::joint::JointKind;

/// Most independent joints: what a state keeps on the stack.
pub const MOST_JOINTS: usize = 32;
/// Most moving links.
pub const MOST_LINKS: usize = 64;

/// A term A sin(phase + sum k_j q_j) of a dependent coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct SineTerm {
    /// A [m or rad].
    pub amplitude: f64,
    /// Phase [rad].
    pub phase: f64,
    /// k_j by independent joint.
    pub of: Vec<(usize, f64)>,
}

/// A coordinate that follows the independent joints:
/// u = offset + sum c_j q_j + sum A sin(phase + sum k_j q_j).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DependentCoordinate {
    /// Constant part [m or rad].
    pub offset: f64,
    /// c_j by independent joint.
    pub linear: Vec<(usize, f64)>,
    /// Sines of combinations of the independent joints.
    pub sines: Vec<SineTerm>,
}

/// What moves a link against the one before it.
#[derive(Debug, Clone, PartialEq)]
pub enum Coordinate {
    /// The independent joint of this index.
    Joint(usize),
    /// A function of the independent joints.
    Follows(DependentCoordinate),
}

/// One moving link and the joint before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Name of the link, for exports and messages.
    pub name: String,
    /// Index of the link before it; `None` where that is the base.
    pub parent: Option<usize>,
    /// Orientation of the joint's frame in the parent's.
    pub rotation: Rotation,
    /// Origin of the joint's frame in the parent's [m].
    pub origin: Vector,
    /// The joint's axis in its own frame, a unit vector.
    pub axis: Vector,
    pub kind: JointKind,
    pub coordinate: Coordinate,
}

impl Link {
    /// Placement of a modified Denavit-Hartenberg row: Rot(x, alpha) Trans(x, a) Rot(z, theta)
    /// Trans(z, d); alpha and theta in rad, a and d in m, the joint's own motion about or along z.
    pub fn of_row(a: f64, alpha: f64, d: f64, theta: f64) -> (Rotation, Vector) {
        let tilt = about(&[1.0, 0.0, 0.0], alpha);
        let rotation = product(&tilt, &about(&[0.0, 0.0, 1.0], theta));
        (rotation, [a, -d * alpha.sin(), d * alpha.cos()])
    }
}

/// Why links make no tree that can be used.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum TreeError {
    #[explain(
        "the chain has no moving link",
        "give at least one revolute or prismatic joint"
    )]
    Empty,
    #[explain(
        "the chain has {links} moving links",
        "at most {MOST_LINKS} are supported"
    )]
    TooManyLinks { links: usize },
    #[explain(
        "the chain has {joints} independent joints",
        "1 to {MOST_JOINTS} are supported"
    )]
    TooManyJoints { joints: usize },
    #[explain(
        "link `{link}` comes before the link that it hangs on",
        "list links from the base outward"
    )]
    Order { link: String },
    #[explain("the axis of link `{link}` is {axis:?}, whose length is not 1")]
    Axis { link: String, axis: Vector },
    #[explain("link `{link}` is driven by independent joint {joint}, of which there are {joints}")]
    Joint {
        link: String,
        joint: usize,
        joints: usize,
    },
    #[explain("independent joint {joint} drives no link", "leave it out")]
    Idle { joint: usize },
    #[explain("link `{link}` holds a number that is not finite")]
    NotFinite { link: String },
}

/// Moving links from the base outward, and gravity.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    links: Vec<Link>,
    /// Kind of each independent joint.
    kinds: Vec<JointKind>,
    /// Acceleration of free fall in the base frame [m/s^2].
    gravity: Vector,
    /// How the recursion passes each link.
    steps: Vec<Step>,
    /// States that must be kept at a time, and the most joints that move one link.
    size: (usize, usize),
}

/// One link in the recursion.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// Independent joints that move the link: those of the link before it, in its order, then its own.
    pub upstream: Vec<usize>,
    /// How many of them move the link before it too.
    pub inherited: usize,
    /// Place of the joint that drives the link itself in `upstream`; 0 where it follows.
    pub driver: usize,
    /// Where the link's state is kept while links behind it are to come.
    pub slot: usize,
    /// Where that of the link before it is.
    pub parent_slot: Option<usize>,
}

impl Tree {
    /// A tree of links whose parents stand before them, of `joints` independent joints.
    ///
    /// # Errors
    /// [`TreeError`] names the link and what is wrong with it.
    pub fn new(links: Vec<Link>, joints: usize, gravity: Vector) -> Result<Self, TreeError> {
        if links.is_empty() || joints == 0 {
            return Err(TreeError::Empty);
        }
        if links.len() > MOST_LINKS {
            return Err(TreeError::TooManyLinks { links: links.len() });
        }
        if joints > MOST_JOINTS {
            return Err(TreeError::TooManyJoints { joints });
        }
        let mut steps: Vec<Step> = Vec::with_capacity(links.len());
        let slots = slots(&links);
        for (i, link) in links.iter().enumerate() {
            check(link, i, joints, &gravity)?;
            let mut upstream = match link.parent {
                None => Vec::new(),
                Some(parent) => steps[parent].upstream.clone(),
            };
            let inherited = upstream.len();
            for joint in link.coordinate.drivers() {
                if !upstream.contains(&joint) {
                    upstream.push(joint);
                }
            }
            let driver = match &link.coordinate {
                Coordinate::Joint(j) => upstream.iter().position(|k| k == j).unwrap_or_default(),
                Coordinate::Follows(_) => 0,
            };
            steps.push(Step {
                upstream,
                inherited,
                driver,
                slot: slots[i],
                parent_slot: link.parent.map(|parent| slots[parent]),
            });
        }
        let moves = |joint| steps.iter().any(|step| step.upstream.contains(&joint));
        if let Some(joint) = (0..joints).find(|joint| !moves(*joint)) {
            return Err(TreeError::Idle { joint });
        }
        let kind = |joint| {
            let own = links
                .iter()
                .find(|l| l.coordinate == Coordinate::Joint(joint));
            own.map_or(JointKind::Revolute, |link| link.kind)
        };
        let most = |of: fn(&Step) -> usize| steps.iter().map(of).max().unwrap_or_default();
        Ok(Self {
            size: (most(|s| s.slot) + 1, most(|s| s.upstream.len())),
            kinds: (0..joints).map(kind).collect(),
            links,
            gravity,
            steps,
        })
    }

    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Number n of independent joints.
    pub fn joints(&self) -> usize {
        self.kinds.len()
    }

    /// Kind of independent joint j: that of the link that it drives itself.
    pub fn joint_kind(&self, j: usize) -> JointKind {
        self.kinds[j]
    }

    /// Acceleration of free fall in the base frame [m/s^2].
    pub fn gravity(&self) -> Vector {
        self.gravity
    }

    /// The same links where free fall is another \[m/s^2\].
    pub(crate) fn in_gravity(&self, gravity: Vector) -> Self {
        Self {
            gravity,
            ..self.clone()
        }
    }

    /// Independent joints that move link i.
    pub fn upstream(&self, i: usize) -> &[usize] {
        &self.steps[i].upstream
    }

    /// How the recursion passes link i.
    #[inline(always)]
    pub(super) fn step(&self, i: usize) -> &Step {
        &self.steps[i]
    }

    /// States that must be kept at a time, and the most joints that move one link.
    #[inline(always)]
    pub(super) fn size(&self) -> (usize, usize) {
        self.size
    }
}

/// What is wrong with link i.
fn check(link: &Link, i: usize, joints: usize, gravity: &Vector) -> Result<(), TreeError> {
    let name = || link.name.clone();
    let finite = |x: &[f64]| x.iter().all(|x| x.is_finite());
    let placed = link.rotation.iter().all(|r| finite(r)) && finite(&link.origin);
    if !placed || !finite(gravity) || !link.coordinate.is_finite() {
        return Err(TreeError::NotFinite { link: name() });
    }
    let length = link.axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    if (length - 1.0).abs() > 1e-9 || length.is_nan() {
        return Err(TreeError::Axis {
            link: name(),
            axis: link.axis,
        });
    }
    if link.parent.is_some_and(|parent| parent >= i) {
        return Err(TreeError::Order { link: name() });
    }
    match link.coordinate.drivers().into_iter().find(|j| *j >= joints) {
        None => Ok(()),
        Some(joint) => Err(TreeError::Joint {
            link: name(),
            joint,
            joints,
        }),
    }
}

/// Where each link's state is kept: a place is free again behind the last link that hangs on it; a chain needs two.
fn slots(links: &[Link]) -> Vec<usize> {
    let mut last: Vec<usize> = (0..links.len()).collect();
    for (i, link) in links.iter().enumerate() {
        if let Some(last) = link.parent.and_then(|parent| last.get_mut(parent)) {
            *last = i;
        }
    }
    let mut slots: Vec<usize> = Vec::with_capacity(links.len());
    for i in 0..links.len() {
        let taken = |slot: &usize| (0..i).any(|k| slots[k] == *slot && last[k] >= i);
        let free = (0..=i).find(|slot| !taken(slot));
        slots.push(free.unwrap_or(i));
    }
    slots
}

impl Coordinate {
    fn is_finite(&self) -> bool {
        let Self::Follows(d) = self else { return true };
        let all = |terms: &[(usize, f64)]| terms.iter().all(|(_, c)| c.is_finite());
        d.offset.is_finite()
            && all(&d.linear)
            && d.sines
                .iter()
                .all(|s| s.amplitude.is_finite() && s.phase.is_finite() && all(&s.of))
    }

    /// Independent joints that the coordinate follows.
    fn drivers(&self) -> Vec<usize> {
        match self {
            Self::Joint(j) => vec![*j],
            Self::Follows(d) => {
                let sines = d.sines.iter().flat_map(|s| &s.of);
                d.linear.iter().chain(sines).map(|(j, _)| *j).collect()
            }
        }
    }

    /// Position, velocity and acceleration of the coordinate; its derivative by each independent
    /// joint is added to `slope`.
    #[inline]
    pub fn motion(
        &self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        slope: &mut [f64; MOST_JOINTS],
    ) -> [f64; 3] {
        match self {
            Self::Joint(j) => {
                slope[*j] = 1.0;
                [q[*j], v[*j], a[*j]]
            }
            Self::Follows(d) => {
                let mut out = [d.offset, 0.0, 0.0];
                for &(j, c) in &d.linear {
                    slope[j] += c;
                    out[0] += c * q[j];
                }
                for sine in &d.sines {
                    let (mut x, mut dx) = (sine.phase, 0.0);
                    for &(j, k) in &sine.of {
                        x += k * q[j];
                        dx += k * v[j];
                    }
                    let (s, c) = x.sin_cos();
                    out[0] += sine.amplitude * s;
                    out[2] -= sine.amplitude * s * dx * dx;
                    for &(j, k) in &sine.of {
                        slope[j] += sine.amplitude * c * k;
                    }
                }
                for (slope, (v, a)) in slope.iter().zip(v.iter().zip(a)) {
                    out[1] += slope * v;
                    out[2] += slope * a;
                }
                out
            }
        }
    }
}
