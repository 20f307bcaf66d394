//! `gravity-tilt`: gravity has components gx and gy along the base's x and y, which the model does not
//! know: a base that stands askew. Two numbers explain it on all joints; the columns are those of
//! [`BaseTilt`](crate::robot::undeclared::BaseTilt).

use super::{CodeSite, Entry, Family, Instant, Key, Law, PlaceRule, RobotProperty, Unit, exact};
use crate::number;
use crate::robot::tree::MOST_JOINTS;
use crate::robot::undeclared::BaseTilt;

pub static ENTRY: Entry = Entry {
    name: "gravity-tilt",
    families: &[Family::Offset],
    keys: &[
        Key::size("gx", Unit::Fixed("m/s^2")),
        Key::size("gy", Unit::Fixed("m/s^2")),
    ],
    places: PlaceRule::Whole,
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
    property: |_, _, linear| Some(RobotProperty::Gravity([linear[0], linear[1]])),
    ..Law::linear(&ENTRY, &["gx", "gy"], columns)
};

fn columns(at: &Instant, _: &mut [f64], out: &mut [f64]) {
    let torques = |tilt: &BaseTilt, at: Instant| {
        let ([q, ..], n) = (at.state::<MOST_JOINTS>(), at.scene.robot.joints());
        let mut torques = [[0.0; 2]; MOST_JOINTS];
        tilt.torques(&q[..n], &mut torques[..n]);
        torques
    };
    let tilt = || at.scene.robot.tilt(at.scene.theta);
    let Some(known) = at.scene.tilt else {
        out.copy_from_slice(&torques(&tilt(), *at)[at.joint]);
        return;
    };
    // a walk over the links gives those of all joints together
    let known = known.get_or_init(|| {
        let (n, tilt) = (at.scene.robot.joints(), tilt());
        let mut all = [0, 1].map(|_| vec![Vec::with_capacity(at.scene.len()); n]);
        for k in 0..at.scene.len() {
            let torques = torques(&tilt, Instant { k, ..*at });
            for (j, [x, y]) in torques.into_iter().enumerate().take(n) {
                all[0][j].push(x);
                all[1][j].push(y);
            }
        }
        all
    });
    for (out, known) in out.iter_mut().zip(known) {
        *out = known[at.joint][at.k];
    }
}

impl CodeSite<'_> {
    /// A base that stands askew: the recursion in another gravity, or the first moments of the closed form.
    fn tilted(&mut self) {
        let &[gx, gy] = self.linear else { return };
        let Some(chain) = self.model.robot.coefficients(&self.model.theta) else {
            let [x, y] = self.out.tilt.unwrap_or_default();
            self.out.tilt = Some([x + gx, y + gy]);
            return;
        };
        let [a, b, c, e] = chain.h.map(exact);
        let (side, h0) = (exact(chain.o), exact(chain.h0));
        let [gx, gy, mass] = [gx, gy, -(chain.t1 + chain.mr)].map(exact);
        let along = format!("({gx} * sin(q[1]) - {gy} * cos(q[1]))");
        let across = format!("({gx} * cos(q[1]) + {gy} * sin(q[1]))");
        let by_psi = format!("({b} * cos(q[2] + q[3]) - {e} * sin(q[2] + q[3]))");
        self.out.askew.extend([
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
