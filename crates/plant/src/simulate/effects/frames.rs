//! Frames of the links of a serial robot, seen from its base: where they are, how they move, and how each
//! joint moves them.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::tree::{Coordinate, MOST_JOINTS, MOST_LINKS, Tree};

/// The frame of a link, all in the base's axes. Accelerations are those without any of the joints.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// From the link's axes to the base's.
    pub rotation: Matrix3<f64>,
    /// Angular velocity \[rad/s\].
    pub spin: Vector3<f64>,
    /// Angular acceleration \[rad/s^2\].
    pub spin_bias: Vector3<f64>,
    /// Acceleration of the origin \[m/s^2\].
    pub bias: Vector3<f64>,
    /// Angular velocity per speed of each joint, 1 or 1/m.
    pub turns: [Vector3<f64>; MOST_JOINTS],
    /// Velocity of the origin per speed of each joint, m or 1.
    pub slides: [Vector3<f64>; MOST_JOINTS],
}

/// A coordinate's position, speed, acceleration without that of the joints, and slope by each joint.
fn moved(coordinate: &Coordinate, q: &[f64], v: &[f64]) -> ([f64; 3], [f64; MOST_JOINTS]) {
    let mut slopes = [0.0; MOST_JOINTS];
    match coordinate {
        Coordinate::Joint(j) => {
            slopes[*j] = 1.0;
            ([q[*j], v[*j], 0.0], slopes)
        }
        Coordinate::Follows(dependence) => {
            let (mut position, mut bend) = (dependence.offset, 0.0);
            for (j, factor) in &dependence.linear {
                position += factor * q[*j];
                slopes[*j] += factor;
            }
            for sine in &dependence.sines {
                let angle = sine.of.iter().map(|(j, k)| k * q[*j]).sum::<f64>() + sine.phase;
                let rate: f64 = sine.of.iter().map(|(j, k)| k * v[*j]).sum();
                position += sine.amplitude * angle.sin();
                bend -= sine.amplitude * angle.sin() * rate * rate;
                for (j, k) in &sine.of {
                    slopes[*j] += sine.amplitude * angle.cos() * k;
                }
            }
            let speed = slopes.iter().zip(v).map(|(s, v)| s * v).sum();
            ([position, speed, bend], slopes)
        }
    }
}

/// Calls `visit` with every link's frame, from the base outward.
pub(super) fn frames(chain: &Tree, q: &[f64], v: &[f64], mut visit: impl FnMut(usize, &Frame)) {
    let base = Frame {
        rotation: Matrix3::identity(),
        spin: Vector3::zeros(),
        spin_bias: Vector3::zeros(),
        bias: Vector3::zeros(),
        turns: [Vector3::zeros(); MOST_JOINTS],
        slides: [Vector3::zeros(); MOST_JOINTS],
    };
    let mut all = [base; MOST_LINKS];
    for (i, link) in chain.links().iter().enumerate() {
        let before = link.parent.map_or(base, |parent| all[parent]);
        let ([position, speed, bend], slopes) = moved(&link.coordinate, q, v);
        let [x, y, z] = link.rotation;
        let placed = before.rotation * Matrix3::from_rows(&[x.into(), y.into(), z.into()]);
        let axis = Vector3::from(link.axis);
        let along = placed * axis;
        let mut reach = before.rotation * Vector3::from(link.origin);
        let mut frame = before;
        match link.kind {
            JointKind::Revolute => {
                let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), position);
                frame.rotation = placed * turn.matrix();
            }
            JointKind::Prismatic => {
                frame.rotation = placed;
                reach += along * position;
            }
        }
        frame.bias +=
            before.spin_bias.cross(&reach) + before.spin.cross(&before.spin.cross(&reach));
        for (slide, turn) in frame.slides.iter_mut().zip(&before.turns) {
            *slide += turn.cross(&reach);
        }
        let own = match link.kind {
            JointKind::Revolute => {
                frame.spin += along * speed;
                frame.spin_bias += along * bend + before.spin.cross(&along) * speed;
                &mut frame.turns
            }
            JointKind::Prismatic => {
                frame.bias += along * bend + before.spin.cross(&along) * (2.0 * speed);
                &mut frame.slides
            }
        };
        for (own, slope) in own.iter_mut().zip(slopes) {
            *own += along * slope;
        }
        all[i] = frame;
        visit(i, &all[i]);
    }
}
