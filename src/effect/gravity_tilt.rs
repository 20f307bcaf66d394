//! `gravity-tilt`: gravity has components gx and gy along the base's x and y, which the model does not
//! know: a base that stands askew. Two numbers explain it on all joints. Masses m_i at p_i have the
//! potential -sum m_i (gx p_x + gy p_y); the first moments of the CFT robot's chain are those of its
//! kinetic energy (eq. (60)), as the declared parameters have them. A serial robot's are those of its base
//! parameters; first moments that are no parameter, as those about a vertical first axis, count as none.

use super::{Family, Key, Kind, Place, Role, Scene, Unit, no_limits, no_shape};
use crate::robot::Robot;
use crate::robot::cft::dynamics::Coefficients;
use crate::robot::serial::chain::MOST_JOINTS;
use crate::robot::serial::newton_euler::walk;
use crate::robot::serial::{Chain, SerialRobot};
use crate::robot::standard::STANDARD;

pub const KIND: Kind = Kind {
    name: "gravity-tilt",
    family: Family::Offset,
    role: Role::Columns,
    shape: &[],
    linear: &[
        Key::new("gx", Unit::Text("m/s^2")),
        Key::new("gy", Unit::Text("m/s^2")),
    ],
    places: |robot, _| match robot {
        Robot::Cft(_) | Robot::Serial(_) => vec![Place::All],
        Robot::SingleJoint(_) => Vec::new(),
    },
    starts: no_shape,
    limits: no_limits,
    columns,
    separate_by: "the same motion with the arm turned by a quarter and by half a turn about q2",
};

fn columns(scene: &Scene, _: Place, _: &[f64], joint: usize, out: &mut [Vec<f64>]) {
    if let Robot::Serial(robot) = scene.robot {
        for (axis, column) in out.iter_mut().enumerate() {
            pulled(robot, scene, axis, joint, column);
        }
        return;
    }
    let [gx, gy] = out else { return };
    let Some(chain) = chain(scene.theta) else {
        return;
    };
    let s = scene.stretch;
    let [a, b, cc, e] = chain.h;
    let (mut q, mut v, mut acceleration) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    for (k, (gx, gy)) in gx.iter_mut().zip(gy).enumerate() {
        s.at(k, &mut q, &mut v, &mut acceleration);
        let (s2, c2) = q[1].sin_cos();
        let (s4, c4) = q[2].sin_cos();
        let (sum_s, sum_c) = (q[2] + q[3]).sin_cos();
        // slopes of the radial first moment
        let by_psi = b * sum_c - e * sum_s;
        let by_q4 = a * c4 - cc * s4 + by_psi;
        let radial = chain.h0 + a * s4 + b * sum_s + cc * c4 + e * sum_c;
        [*gx, *gy] = match joint {
            0 => [0.0, -(chain.t1 + chain.mr)],
            1 => [chain.o * s2 + radial * c2, radial * s2 - chain.o * c2],
            2 => [by_q4 * s2, -by_q4 * c2],
            _ => [by_psi * s2, -by_psi * c2],
        };
    }
}

/// Coefficients of the closed form from the declared parameters.
fn chain(theta: &[f64]) -> Option<Coefficients> {
    if let Ok(theta) = <&[f64; 22]>::try_from(theta) {
        return Some(Coefficients::from_theta22(theta));
    }
    let theta = <&[f64; 12]>::try_from(theta).ok()?;
    Some(Coefficients::from_theta12(theta))
}

/// Torque of joint `joint` of a serial robot at rest in a gravity of one along the base's `axis`.
fn pulled(robot: &SerialRobot, scene: &Scene, axis: usize, joint: usize, column: &mut [f64]) {
    let links = robot.chain().links();
    let mut gravity = [0.0; 3];
    gravity[axis] = 1.0;
    let Ok(chain) = Chain::new(links.to_vec(), robot.chain().joints(), gravity) else {
        return;
    };
    let mut standard = vec![[0.0; STANDARD]; links.len()];
    for (grouping, value) in robot.groupings().iter().zip(scene.theta) {
        if let Some(link) = standard.get_mut(grouping.kept / STANDARD) {
            link[grouping.kept % STANDARD] = *value;
        }
    }
    let (n, still) = (chain.joints(), [0.0; MOST_JOINTS]);
    let mut state = [[0.0; MOST_JOINTS]; 3];
    for (k, column) in column.iter_mut().enumerate() {
        let [q, v, a] = &mut state;
        scene.stretch.at(k, &mut q[..n], &mut v[..n], &mut a[..n]);
        walk(&chain, &*q, &still, &still, |link, on, row| {
            if on == joint {
                let own = row.iter().zip(&standard[link]);
                *column += own.map(|(y, x)| y * x).sum::<f64>();
            }
        });
    }
}
