//! The chain: links behind joints, where each joint sits, and which coordinate drives it.
//!
//! A joint's frame is given in the frame of the link before it; the link turns about (or slides
//! along) the joint's axis, and its own frame is the joint's frame after that motion. A modified
//! Denavit-Hartenberg row (Craig 1986) and a URDF joint are both of this form.

use super::space::{Rotation, Vector, about, of_roll_pitch_yaw, product};
use crate::robot::JointKind;

/// Most independent joints: what the recursion keeps on the stack.
pub const MOST_JOINTS: usize = 8;
/// Most moving links.
pub const MOST_LINKS: usize = 16;

/// A term A sin(phase + sum k_j q_j) of a dependent coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct Sine {
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
pub struct Dependence {
    /// Constant part [m or rad].
    pub offset: f64,
    /// c_j by independent joint.
    pub linear: Vec<(usize, f64)>,
    /// Sines of combinations of the independent joints.
    pub sines: Vec<Sine>,
}

/// What moves a link against the one before it.
#[derive(Debug, Clone, PartialEq)]
pub enum Coordinate {
    /// The independent joint of this index.
    Joint(usize),
    /// A function of the independent joints.
    Follows(Dependence),
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
    /// Turns or slides.
    pub kind: JointKind,
    /// What moves it.
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

    /// Placement of a URDF origin: position [m], roll, pitch and yaw [rad].
    pub fn of_origin(xyz: Vector, rpy: Vector) -> (Rotation, Vector) {
        (of_roll_pitch_yaw(&rpy), xyz)
    }
}

/// Why a chain cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChainError {
    #[error("the chain has no moving link; give at least one revolute or prismatic joint")]
    Empty,
    #[error("the chain has {links} moving links; at most {MOST_LINKS} are supported")]
    TooManyLinks { links: usize },
    #[error("the chain has {joints} independent joints; 1 to {MOST_JOINTS} are supported")]
    TooManyJoints { joints: usize },
    #[error(
        "link `{link}` comes before the link that it hangs on; list links from the base outward"
    )]
    Order { link: String },
    #[error("the axis of link `{link}` is {axis:?}, whose length is not 1")]
    Axis { link: String, axis: Vector },
    #[error("link `{link}` is driven by independent joint {joint}, of which there are {joints}")]
    Joint {
        link: String,
        joint: usize,
        joints: usize,
    },
    #[error("independent joint {joint} drives no link; leave it out")]
    Idle { joint: usize },
    #[error("link `{link}` holds a number that is not finite")]
    NotFinite { link: String },
    #[error(
        "the regressor of {joints} joints and {parameters} base parameters has {entries} entries; \
         at most {most} are supported"
    )]
    TooWide {
        joints: usize,
        parameters: usize,
        entries: usize,
        most: usize,
    },
}

/// Moving links from the base outward, and gravity.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    links: Vec<Link>,
    joints: usize,
    /// Acceleration of free fall in the base frame [m/s^2].
    gravity: Vector,
    /// Per link, which independent joints move it, one bit each.
    moved_by: Vec<u8>,
}

impl Chain {
    /// A chain of links whose parents stand before them.
    ///
    /// # Errors
    /// [`ChainError`] names the link and what is wrong with it.
    pub fn new(links: Vec<Link>, joints: usize, gravity: Vector) -> Result<Self, ChainError> {
        if links.is_empty() || joints == 0 {
            return Err(ChainError::Empty);
        }
        if links.len() > MOST_LINKS {
            return Err(ChainError::TooManyLinks { links: links.len() });
        }
        if joints > MOST_JOINTS {
            return Err(ChainError::TooManyJoints { joints });
        }
        let mut moved_by: Vec<u8> = Vec::with_capacity(links.len());
        for (i, link) in links.iter().enumerate() {
            let name = || link.name.clone();
            let finite = |x: &[f64]| x.iter().all(|x| x.is_finite());
            let placed = link.rotation.iter().all(|r| finite(r)) && finite(&link.origin);
            if !placed || !finite(&gravity) || !link.coordinate.is_finite() {
                return Err(ChainError::NotFinite { link: name() });
            }
            let length = link.axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-9 || length.is_nan() {
                return Err(ChainError::Axis {
                    link: name(),
                    axis: link.axis,
                });
            }
            let before = match link.parent {
                None => 0,
                Some(parent) => *moved_by
                    .get(parent)
                    .ok_or_else(|| ChainError::Order { link: name() })?,
            };
            debug_assert!(moved_by.len() == i);
            let mut own = 0;
            for joint in link.coordinate.drivers() {
                if joint >= joints {
                    return Err(ChainError::Joint {
                        link: name(),
                        joint,
                        joints,
                    });
                }
                own |= 1 << joint;
            }
            moved_by.push(before | own);
        }
        let all = moved_by.iter().fold(0, |all, m| all | m);
        if let Some(joint) = (0..joints).find(|j| all & (1 << j) == 0) {
            return Err(ChainError::Idle { joint });
        }
        Ok(Self {
            links,
            joints,
            gravity,
            moved_by,
        })
    }

    /// Moving links, from the base outward.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Number n of independent joints.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Acceleration of free fall in the base frame [m/s^2].
    pub fn gravity(&self) -> Vector {
        self.gravity
    }

    /// Whether independent joint j moves link i.
    #[inline(always)]
    pub(super) fn moves(&self, j: usize, i: usize) -> bool {
        self.moved_by[i] & (1 << j) != 0
    }
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

    /// Position, velocity and acceleration of the coordinate, and its derivative by each
    /// independent joint.
    #[inline]
    pub(super) fn motion(
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
