//! The regressor by recursive Newton-Euler: forces of links with unit parameters, in one pass.
//!
//! Link i with the ten standard parameters (its inertia about the origin of its own frame, first
//! moments m c and mass m) needs at that origin the force and the moment
//!
//! ```text
//! f = m a + dw x (m c) + w x (w x (m c))        n = I dw + w x (I w) + (m c) x a
//! ```
//!
//! (w, dw its angular velocity and acceleration, a the acceleration of its origin less that of free
//! fall). Both are linear in the parameters. What they ask of independent joint k is l_k . f +
//! w_k . n, where (w_k, l_k) is the motion that a unit speed of joint k gives to the link: its
//! column of the link's Jacobian, carried outward with the recursion, so that no wrench has to be
//! carried back (Atkeson, An and Hollerbach 1986 in the frames of the links).

use super::links::{Coordinate, MOST_JOINTS, MOST_LINKS, Tree};
use super::space::{Vector, about, add, cross, dot, product, times, turn, turn_back};
use crate::robot::joint::JointKind;
use crate::robot::standard::STANDARD;

/// Motion of a link, in its own frame, of whose joints up to DEPTH move it.
#[derive(Clone, Copy)]
struct State<const DEPTH: usize> {
    /// Angular velocity [rad/s].
    w: Vector,
    /// Angular acceleration [rad/s^2].
    dw: Vector,
    /// Acceleration of the origin less that of free fall [m/s^2].
    a: Vector,
    /// Per joint that moves the link, angular and linear velocity of the frame at unit speed.
    jacobian: [[Vector; 2]; DEPTH],
}

impl<const DEPTH: usize> State<DEPTH> {
    const AT_REST: Self = Self {
        w: [0.0; 3],
        dw: [0.0; 3],
        a: [0.0; 3],
        jacobian: [[[0.0; 3]; 2]; DEPTH],
    };
}

/// Calls `visit(link, joint, row)` for every link and every independent joint that moves it, with
/// the derivatives of that joint's torque by the link's ten standard parameters. Those of the other
/// joints are zero.
///
/// # Panics
/// Where q, v or a holds fewer than n numbers: a mistake of the caller's code.
#[inline]
pub fn walk(
    tree: &Tree,
    q: &[f64],
    v: &[f64],
    a: &[f64],
    visit: impl FnMut(usize, usize, &[f64; STANDARD]),
) {
    walk_with(tree, [q, v, a], Rows(visit));
}

/// Adds to `tau` what links of these standard parameters ask of every independent joint, by forces once a link.
#[inline]
pub(crate) fn torques(
    tree: &Tree,
    state: [&[f64]; 3],
    body: impl Fn(usize) -> [f64; STANDARD],
    tau: &mut [f64],
) {
    let [force, moment] = [[0.0; 3]; 2];
    walk_with(
        tree,
        state,
        TorqueVisitor {
            body,
            tau,
            force,
            moment,
        },
    );
}

/// What is done with the motion of links, one after the other outward.
trait LinkVisitor {
    /// Link i has this motion.
    fn link<const DEPTH: usize>(&mut self, i: usize, state: &State<DEPTH>);
    /// Joint k moves it by w_k and l_k.
    fn joint<const DEPTH: usize>(
        &mut self,
        i: usize,
        k: usize,
        state: &State<DEPTH>,
        slopes: [&Vector; 2],
    );
}

/// Hands on the derivatives by the standard parameters.
struct Rows<F>(F);

impl<F: FnMut(usize, usize, &[f64; STANDARD])> LinkVisitor for Rows<F> {
    #[inline(always)]
    fn link<const DEPTH: usize>(&mut self, _: usize, _: &State<DEPTH>) {}

    #[inline(always)]
    fn joint<const DEPTH: usize>(
        &mut self,
        i: usize,
        k: usize,
        state: &State<DEPTH>,
        [wk, lk]: [&Vector; 2],
    ) {
        (self.0)(i, k, &row(state, wk, lk));
    }
}

/// Sums the torques of links with known parameters.
struct TorqueVisitor<'a, F> {
    body: F,
    tau: &'a mut [f64],
    /// Of the link that is visited.
    force: Vector,
    moment: Vector,
}

impl<F: Fn(usize) -> [f64; STANDARD]> LinkVisitor for TorqueVisitor<'_, F> {
    #[inline(always)]
    fn link<const DEPTH: usize>(&mut self, i: usize, state: &State<DEPTH>) {
        let State { w, dw, a, .. } = state;
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = (self.body)(i);
        let inertia = |x: &Vector| {
            [
                xx * x[0] + xy * x[1] + xz * x[2],
                xy * x[0] + yy * x[1] + yz * x[2],
                xz * x[0] + yz * x[1] + zz * x[2],
            ]
        };
        let first = [mx, my, mz];
        let swept = add(&cross(dw, &first), &cross(w, &cross(w, &first)));
        self.force = add(&times(m, a), &swept);
        let turned = add(&inertia(dw), &cross(w, &inertia(w)));
        self.moment = add(&turned, &cross(&first, a));
    }

    #[inline(always)]
    fn joint<const DEPTH: usize>(
        &mut self,
        _: usize,
        k: usize,
        _: &State<DEPTH>,
        [wk, lk]: [&Vector; 2],
    ) {
        self.tau[k] += dot(lk, &self.force) + dot(wk, &self.moment);
    }
}

fn walk_with(tree: &Tree, [q, v, a]: [&[f64]; 3], visit: impl LinkVisitor) {
    let n = tree.joints();
    assert!(
        q.len() >= n && v.len() >= n && a.len() >= n,
        "{n} joints each"
    );
    // clearing the states takes time: those of an arm or of two are few and short
    match tree.size() {
        (..=FEW_STATES, ..=FEW_JOINTS) => {
            walk_within::<FEW_STATES, FEW_JOINTS>(tree, q, v, a, visit);
        }
        (..=FEW_STATES, _) => walk_within::<FEW_STATES, MOST_JOINTS>(tree, q, v, a, visit),
        _ => walk_within::<MOST_LINKS, MOST_JOINTS>(tree, q, v, a, visit),
    }
}

/// States and joints up to which a smaller memory serves.
const FEW_STATES: usize = 4;
const FEW_JOINTS: usize = 8;

// a frame of its own: the stack that the largest tree needs is not asked for by the smaller ones
#[inline(never)]
fn walk_within<const STATES: usize, const DEPTH: usize>(
    tree: &Tree,
    q: &[f64],
    v: &[f64],
    a: &[f64],
    mut visit: impl LinkVisitor,
) {
    let mut states = [State::<DEPTH>::AT_REST; STATES];
    let base = State {
        a: times(-1.0, &tree.gravity()),
        ..State::AT_REST
    };
    for (i, link) in tree.links().iter().enumerate() {
        let step = tree.step(i);
        let (state, before) = match step.parent_slot {
            None => (&mut states[step.slot], &base),
            Some(parent) => {
                let both = states.get_disjoint_mut([step.slot, parent]);
                let [state, before] = both.expect("a link is kept apart from the one before it");
                (state, &*before)
            }
        };
        let mut slope = [0.0; MOST_JOINTS];
        let [u, du, ddu] = match &link.coordinate {
            Coordinate::Joint(j) => [q[*j], v[*j], a[*j]],
            follows => follows.motion(q, v, a, &mut slope),
        };
        let (rotation, origin) = match link.kind {
            JointKind::Revolute => (product(&link.rotation, &about(&link.axis, u)), link.origin),
            JointKind::Prismatic => {
                let moved = turn(&link.rotation, &times(u, &link.axis));
                (link.rotation, add(&link.origin, &moved))
            }
        };
        let swept = cross(&before.w, &origin);
        let carried = add(
            &before.a,
            &add(&cross(&before.dw, &origin), &cross(&before.w, &swept)),
        );
        state.w = turn_back(&rotation, &before.w);
        state.dw = turn_back(&rotation, &before.dw);
        state.a = turn_back(&rotation, &carried);
        let along = times(du, &link.axis);
        let pushed = times(ddu, &link.axis);
        match link.kind {
            JointKind::Revolute => {
                state.dw = add(&state.dw, &add(&pushed, &cross(&state.w, &along)));
                state.w = add(&state.w, &along);
            }
            JointKind::Prismatic => {
                let coriolis = times(2.0, &cross(&state.w, &along));
                state.a = add(&state.a, &add(&pushed, &coriolis));
            }
        }
        visit.link(i, state);
        for (place, &k) in step.upstream.iter().enumerate() {
            // a joint's first link has nothing of it from the link before
            let (mut wk_here, mut lk_here) = ([0.0; 3], [0.0; 3]);
            if place < step.inherited {
                let [wk, lk] = &before.jacobian[place];
                wk_here = turn_back(&rotation, wk);
                lk_here = turn_back(&rotation, &add(lk, &cross(wk, &origin)));
            }
            let slope = match &link.coordinate {
                Coordinate::Joint(_) => f64::from(u8::from(place == step.driver)),
                Coordinate::Follows(_) => slope[k],
            };
            if slope != 0.0 {
                let own = times(slope, &link.axis);
                match link.kind {
                    JointKind::Revolute => wk_here = add(&wk_here, &own),
                    JointKind::Prismatic => lk_here = add(&lk_here, &own),
                }
            }
            state.jacobian[place] = [wk_here, lk_here];
            visit.joint(i, k, state, [&wk_here, &lk_here]);
        }
    }
}

/// l . f + w . n for unit standard parameters.
#[inline(always)]
fn row<const DEPTH: usize>(state: &State<DEPTH>, wk: &Vector, lk: &Vector) -> [f64; STANDARD] {
    let State { w, dw, a, .. } = state;
    // w_k . (w x (I w)) = (w_k x w) . (I w)
    let c = cross(wk, w);
    let moment = add(
        &add(&cross(lk, dw), &cross(&cross(lk, w), w)),
        &cross(a, wk),
    );
    [
        wk[0] * dw[0] + c[0] * w[0],
        wk[0] * dw[1] + wk[1] * dw[0] + c[0] * w[1] + c[1] * w[0],
        wk[0] * dw[2] + wk[2] * dw[0] + c[0] * w[2] + c[2] * w[0],
        wk[1] * dw[1] + c[1] * w[1],
        wk[1] * dw[2] + wk[2] * dw[1] + c[1] * w[2] + c[2] * w[1],
        wk[2] * dw[2] + c[2] * w[2],
        moment[0],
        moment[1],
        moment[2],
        dot(lk, a),
    ]
}
