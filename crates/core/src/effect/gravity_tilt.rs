//! `gravity-tilt`: gravity has components gx and gy along the base's x and y, which the model does not
//! know: a base that stands askew. Two numbers explain it on all joints; the columns are those of
//! [`Tilt`](crate::robot::undeclared::Tilt).

use super::entry::{Entry, Family, Key};
use super::law::Law;
use super::law_text::exact;
use super::place::{Place, Places};
use super::scene::Scene;
use super::site::CodeSite;
use super::site::Property;
use super::unit::Unit;
use crate::number;
use crate::robot::tree::MOST_JOINTS;

pub static ENTRY: Entry = Entry {
    name: "gravity-tilt",
    families: &[Family::Offset],
    keys: &[
        Key::size("gx", Unit::Fixed("m/s^2")),
        Key::size("gy", Unit::Fixed("m/s^2")),
    ],
    places: Places::Whole,
    separate_by: "log the same motion with the arm turned by a quarter and by half a turn about q2",
    formula: "slope of -sum m_i (gx p_x + gy p_y) over the chain; a sliding axis along x: \
                -inertia gx",
    source: "a base that stands askew",
    at_rest: true,
    said: |f| {
        let lean = f.value("gx").hypot(f.value("gy")).atan2(9.81).to_degrees();
        format!("base that leans by {} deg", number::significant(lean, 2))
    },
    remedy: "level the base, or give `gravity` in the robot file as it is in the frame of the base",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    fits: |robot, _, _| robot.knows_links(),
    code: Some(|to| to.tilted()),
    property: |_, _, linear| Some(Property::Gravity([linear[0], linear[1]])),
    ..Law::linear(&ENTRY, &["gx", "gy"], columns)
};

fn columns(scene: &Scene, _: Place, _: &[f64], joint: usize, out: &mut [Vec<f64>]) {
    if let Some(known) = scene.tilt {
        let known = known.get_or_init(|| all_joints(scene));
        for (out, known) in out.iter_mut().zip(known) {
            out.copy_from_slice(&known[joint]);
        }
        return;
    }
    along(scene, |k, torques| {
        for (out, x) in out.iter_mut().zip(torques[joint]) {
            out[k] = x;
        }
    });
}

/// Torques on all joints, `[direction][joint][sample]`: a walk over the links gives them together.
fn all_joints(scene: &Scene) -> [Vec<Vec<f64>>; 2] {
    let none = || vec![vec![0.0; scene.len()]; scene.robot.joints()];
    let mut out = [none(), none()];
    along(scene, |k, torques| {
        for (direction, out) in out.iter_mut().enumerate() {
            for (out, torque) in out.iter_mut().zip(torques) {
                out[k] = torque[direction];
            }
        }
    });
    out
}

/// Calls `take` with every sample and its torques, those of a joint by gravity along x and along y.
fn along(scene: &Scene, mut take: impl FnMut(usize, &[[f64; 2]])) {
    let (n, tilt) = (scene.robot.joints(), scene.robot.tilt(scene.theta));
    let mut state = [[0.0; MOST_JOINTS]; 3];
    let mut torques = [[0.0; 2]; MOST_JOINTS];
    for k in 0..scene.len() {
        let [q, v, a] = &mut state;
        scene.stretch.at(k, &mut q[..n], &mut v[..n], &mut a[..n]);
        tilt.torques(&q[..n], &mut torques[..n]);
        take(k, &torques[..n]);
    }
}

impl CodeSite<'_> {
    /// A base that stands askew: the recursion in another gravity, or the first moments of the closed form.
    fn tilted(&mut self) {
        let &[gx, gy] = self.linear() else { return };
        let Some(chain) = self.robot().coefficients(self.theta()) else {
            self.in_gravity([gx, gy]);
            return;
        };
        let [a, b, c, e] = chain.h.map(exact);
        let (side, h0) = (exact(chain.o), exact(chain.h0));
        let [gx, gy, mass] = [gx, gy, -(chain.t1 + chain.mr)].map(exact);
        let along = format!("({gx} * sin(q[1]) - {gy} * cos(q[1]))");
        let across = format!("({gx} * cos(q[1]) + {gy} * sin(q[1]))");
        let by_psi = format!("({b} * cos(q[2] + q[3]) - {e} * sin(q[2] + q[3]))");
        self.at_rest([
            format!("tau[0] += {mass} * {gy};"),
            format!(
                "tau[1] += {side} * {along} + ({h0} + {a} * sin(q[2]) + {b} * sin(q[2] + q[3]) + \
                 {c} * cos(q[2]) + {e} * cos(q[2] + q[3])) * {across};"
            ),
            format!("tau[2] += ({a} * cos(q[2]) - {c} * sin(q[2]) + {by_psi}) * {along};"),
            format!("tau[3] += {by_psi} * {along};"),
        ]);
    }
}
