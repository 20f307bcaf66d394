//! A machine in motion: rigid bodies, stiff or elastic drives, friction with an ideal stick.
//!
//! Steps are those of the midpoint rule. Where a joint that can stick comes to rest inside a step, the step ends
//! there; it then holds as long as what holds it stays below the level of its friction (Karnopp 1985), which is asked
//! again at each step. No speed is called zero because it is small.

use crate::added::{Added, Share};
use crate::cft::Cft;
use crate::chain::{Chain, JOINTS, Joints, Square};
use crate::friction::Friction;
use crate::uncatalogued::{Memory, Seen};

/// What moves.
#[derive(Debug, Clone)]
pub enum Bodies {
    /// One inertia, with a torque of gravity `weight cos(q + phase)`.
    Single {
        inertia: f64,
        weight: f64,
        phase: f64,
    },
    Chain(Chain),
    Cft(Cft),
}

/// Between motor and link; positions and torques are reckoned at the joint.
#[derive(Debug, Clone, Copy)]
pub struct Elastic {
    /// [Nm/rad or N/m]
    pub stiffness: f64,
    pub damping: f64,
    /// Whole width of the play.
    pub gap: f64,
    /// Inertia of the motor.
    pub motor: f64,
    /// Periodic error of the gear: size and how many times a radian.
    pub error: f64,
    pub order: f64,
}

#[derive(Debug, Clone)]
pub struct Plant {
    pub bodies: Bodies,
    pub joints: usize,
    pub drives: [Option<Elastic>; JOINTS],
    pub friction: Vec<Friction>,
    /// A constant torque against positive motion.
    pub offset: Joints,
    pub added: Vec<Added>,
}

/// Whether a joint holds, or which way it slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contact {
    Holds,
    Slides(f64),
}

/// Positions and speeds where encoder and friction are: at the motor of an elastic drive.
#[derive(Debug, Clone)]
pub struct State {
    pub t: f64,
    pub q: Joints,
    pub v: Joints,
    pub link_q: Joints,
    pub link_v: Joints,
    pub bristle: Joints,
    pub contact: [Contact; JOINTS],
    /// Torque of the bodies and acceleration a step before.
    load: Joints,
    a: Joints,
    memory: [Memory; JOINTS],
    /// Torques of the drives as they are told.
    told: Joints,
}

struct Rates {
    v: Joints,
    link_v: Joints,
    bristle: Joints,
    /// What holds a joint that stands, or its friction.
    friction: Joints,
    load: Joints,
}

impl Plant {
    pub fn at_rest(&self, q: Joints) -> State {
        State {
            t: 0.0,
            q,
            v: [0.0; JOINTS],
            link_q: q,
            link_v: [0.0; JOINTS],
            bristle: [0.0; JOINTS],
            contact: [Contact::Holds; JOINTS],
            load: [0.0; JOINTS],
            a: [0.0; JOINTS],
            memory: q.map(Memory::at),
            told: [0.0; JOINTS],
        }
    }

    /// A step of `h` seconds under torques of the drives.
    pub fn step(&self, s: &mut State, u: &Joints, h: f64) {
        let from = s.q;
        s.told = *u;
        self.go(s, u, h);
        if !self.added.is_empty() {
            for (i, memory) in s.memory.iter_mut().enumerate().take(self.joints) {
                memory.goes(from[i], s.q[i], h);
            }
        }
    }

    fn go(&self, s: &mut State, u: &Joints, h: f64) {
        let mut left = h;
        for stops_left in (0..8).rev() {
            let first = self.settled(s, u);
            (s.load, s.a) = (first.load, first.v);
            let middle = self.moved(s, &first, 0.5 * left, None);
            let second = self.rates(&middle, u);
            let end = self.moved(s, &second, left, Some(&middle));
            let Some((joint, part)) = self.first_stop(s, &end) else {
                *s = end;
                return;
            };
            if stops_left == 0 {
                // One that turns again and again holds to the end of the step; the others go on.
                let turned: Vec<usize> = (0..self.joints)
                    .filter(|&i| self.stop(s, &end, i).is_some())
                    .collect();
                *s = end;
                for joint in turned {
                    s.v[joint] = 0.0;
                    s.contact[joint] = Contact::Holds;
                }
                return;
            }
            if part > 0.0 {
                let middle = self.moved(s, &first, 0.5 * part * left, None);
                let second = self.rates(&middle, u);
                *s = self.moved(s, &second, part * left, Some(&middle));
            }
            s.v[joint] = 0.0;
            s.contact[joint] = Contact::Holds;
            left *= 1.0 - part;
            if left <= 0.0 {
                return;
            }
        }
    }

    /// Torque of additions against the motion, with what they change of the friction.
    pub fn planted(&self, s: &State) -> Joints {
        let mut out = [0.0; JOINTS];
        for (i, value) in out.iter_mut().enumerate().take(self.joints) {
            let share = self.share(s, i);
            let with = self.friction[i].level(s.v[i], share.level);
            let without = self.friction[i].level(s.v[i], 0.0);
            *value = share.torque + s.v[i].signum() * (with - without);
        }
        out
    }

    fn share(&self, s: &State, joint: usize) -> Share {
        let mut all = Share::default();
        for added in self.added.iter().filter(|a| a.joint == joint) {
            let by_law = self.friction[joint].viscous / self.friction[joint].coulomb.max(1e-12);
            let seen = Seen {
                t: s.t,
                q: &s.q,
                v: &s.v,
                a: s.a[joint],
                load: s.load[joint],
                drive: s.told[joint],
                memory: &s.memory[joint],
            };
            let one = added.share(&seen, by_law);
            all.torque += one.torque;
            all.level += one.level;
        }
        all
    }

    /// The joint whose direction turns first inside a step, and the part of the step until then.
    fn first_stop(&self, from: &State, to: &State) -> Option<(usize, f64)> {
        (0..self.joints)
            .filter_map(|i| Some((i, self.stop(from, to, i)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The part of a step after which one joint turns; none where it does not.
    fn stop(&self, from: &State, to: &State, i: usize) -> Option<f64> {
        match from.contact[i] {
            Contact::Slides(d) if self.friction[i].sticks() && to.v[i] * d < 0.0 => {
                let part = from.v[i] / (from.v[i] - to.v[i]);
                Some(if from.v[i] * d > 0.0 { part } else { 0.0 })
            }
            _ => None,
        }
    }

    /// Rates at a state whose joints hold only where their friction can.
    fn settled(&self, s: &mut State, u: &Joints) -> Rates {
        for i in 0..self.joints {
            if !self.friction[i].sticks() {
                s.contact[i] = Contact::Slides(1.0);
            }
        }
        loop {
            let rates = self.rates(s, u);
            let beyond = |i: usize| match s.contact[i] {
                Contact::Holds => {
                    let level = self.friction[i].level(0.0, self.share(s, i).level);
                    Some(rates.friction[i].abs() - level).filter(|over| *over > 0.0)
                }
                Contact::Slides(_) => None,
            };
            let over = (0..self.joints).filter_map(|i| Some((i, beyond(i)?)));
            let Some((joint, _)) = over.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                return rates;
            };
            s.contact[joint] = Contact::Slides(rates.friction[joint].signum());
        }
    }

    fn rates(&self, s: &State, u: &Joints) -> Rates {
        let n = self.joints;
        let (mut friction, mut bristle) = ([0.0; JOINTS], [0.0; JOINTS]);
        let (mut on_motor, mut on_link, mut held) = (*u, [0.0; JOINTS], [false; JOINTS]);
        for i in 0..n {
            let share = if self.added.is_empty() {
                Share::default()
            } else {
                self.share(s, i)
            };
            on_motor[i] -= self.offset[i] + share.torque;
            if let Some(drive) = &self.drives[i] {
                let pull = drive.pull(s, i);
                on_motor[i] -= pull;
                on_link[i] = pull;
            }
            match s.contact[i] {
                Contact::Holds => held[i] = true,
                Contact::Slides(direction) => {
                    let (torque, rate) =
                        self.friction[i].torque(s.v[i], direction, s.bristle[i], share.level);
                    (friction[i], bristle[i]) = (torque, rate);
                    on_motor[i] -= torque;
                }
            }
        }
        let stiff = self.drives[..n].iter().all(Option::is_none);
        let (mut v, mut link_v) = ([0.0; JOINTS], [0.0; JOINTS]);
        let (q_body, v_body) = if stiff {
            (&s.q, &s.v)
        } else {
            (&s.link_q, &s.link_v)
        };
        let (load, holds);
        if stiff {
            (v, holds, load) = self.bodies.answer(q_body, v_body, &on_motor, &held, n);
        } else {
            (link_v, _, _) = self
                .bodies
                .answer(q_body, v_body, &on_link, &[false; JOINTS], n);
            for i in 0..n {
                let motor = self.drives[i].map_or(f64::INFINITY, |drive| drive.motor);
                v[i] = if held[i] { 0.0 } else { on_motor[i] / motor };
            }
            (load, holds) = (on_link, on_motor);
        }
        for i in (0..n).filter(|&i| held[i]) {
            friction[i] = holds[i];
        }
        Rates {
            v,
            link_v,
            bristle,
            friction,
            load,
        }
    }

    /// The state after `h`; its positions move with the speeds of `middle`, if there is one.
    fn moved(&self, s: &State, rates: &Rates, h: f64, middle: Option<&State>) -> State {
        let through = middle.unwrap_or(s);
        let mut next = s.clone();
        next.t += h;
        for i in 0..self.joints {
            next.q[i] += h * through.v[i];
            next.v[i] += h * rates.v[i];
            next.link_q[i] += h * through.link_v[i];
            next.link_v[i] += h * rates.link_v[i];
            next.bristle[i] += h * rates.bristle[i];
        }
        next
    }
}

impl Elastic {
    /// Torque by which the motor pulls its link.
    fn pull(&self, s: &State, i: usize) -> f64 {
        let swing = self.error * (self.order * s.q[i]).sin();
        let twist = s.q[i] + swing - s.link_q[i];
        let slip =
            s.v[i] * (1.0 + self.error * self.order * (self.order * s.q[i]).cos()) - s.link_v[i];
        let half = 0.5 * self.gap;
        if twist.abs() < half {
            return 0.0;
        }
        let pull = self.stiffness * (twist - half * twist.signum()) + self.damping * slip;
        if self.gap > 0.0 && pull * twist < 0.0 {
            0.0
        } else {
            pull
        }
    }
}

impl Bodies {
    /// Accelerations under torques, what holds the joints that stand, and the torque that the bodies ask for.
    fn answer(
        &self,
        q: &Joints,
        v: &Joints,
        tau: &Joints,
        held: &[bool; JOINTS],
        n: usize,
    ) -> (Joints, Joints, Joints) {
        if let Self::Single { inertia, .. } = self {
            let (mut a, mut free) = ([0.0; JOINTS], *tau);
            free[0] -= self.weight(q[0]);
            a[0] = if held[0] { 0.0 } else { free[0] / inertia };
            let mut load = [0.0; JOINTS];
            load[0] = self.weight(q[0]) + inertia * a[0];
            return (a, free, load);
        }
        let (mass, bias) = self.dynamics(q, v);
        let free: Joints = std::array::from_fn(|i| tau[i] - bias[i]);
        let (a, holds) = accelerations(&mass, &free, held, n);
        (
            a,
            holds,
            std::array::from_fn(|i| bias[i] + dot(&mass[i], &a, n)),
        )
    }

    /// Torque of gravity on one joint.
    fn weight(&self, q: f64) -> f64 {
        match self {
            Self::Single { weight, phase, .. } if *weight != 0.0 => weight * (q + phase).cos(),
            _ => 0.0,
        }
    }

    /// Mass matrix with the drives' inertias, and what remains at no acceleration.
    fn dynamics(&self, q: &Joints, v: &Joints) -> (Square, Joints) {
        match self {
            Self::Single { inertia, .. } => {
                let (mut mass, mut bias) = ([[0.0; JOINTS]; JOINTS], [0.0; JOINTS]);
                (mass[0][0], bias[0]) = (*inertia, self.weight(q[0]));
                (mass, bias)
            }
            Self::Chain(chain) => {
                let mut mass = chain.mass_matrix(q);
                for (i, link) in chain.links.iter().enumerate() {
                    mass[i][i] += link.drive_inertia;
                }
                (mass, chain.torque(q, v, &[0.0; JOINTS]))
            }
            Self::Cft(cft) => (cft.mass_matrix(q), cft.bias(q, v)),
        }
    }

    /// Torque along a motion, with the drives' inertias.
    pub fn inverse(&self, q: &Joints, v: &Joints, a: &Joints) -> Joints {
        match self {
            Self::Single { inertia, .. } => {
                let mut tau = self.dynamics(q, v).1;
                tau[0] += inertia * a[0];
                tau
            }
            Self::Chain(chain) => {
                let mut tau = chain.torque(q, v, a);
                for (i, link) in chain.links.iter().enumerate() {
                    tau[i] += link.drive_inertia * a[i];
                }
                tau
            }
            Self::Cft(cft) => {
                let (mass, bias) = (cft.mass_matrix(q), cft.bias(q, v));
                std::array::from_fn(|i| bias[i] + dot(&mass[i], a, JOINTS))
            }
        }
    }
}

fn dot(a: &Joints, b: &Joints, n: usize) -> f64 {
    (0..n).map(|j| a[j] * b[j]).sum()
}

/// Accelerations of the joints that do not hold (Cholesky), and the torque that holds the others.
fn accelerations(m: &Square, free: &Joints, held: &[bool; JOINTS], n: usize) -> (Joints, Joints) {
    let mut a = [0.0; JOINTS];
    let moving: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
    let mut l = [[0.0; JOINTS]; JOINTS];
    let mut y = [0.0; JOINTS];
    for (r, &i) in moving.iter().enumerate() {
        for (c, &j) in moving.iter().enumerate().take(r + 1) {
            let rest = m[i][j] - dot(&l[r], &l[c], c);
            l[r][c] = if r == c { rest.sqrt() } else { rest / l[c][c] };
        }
        y[r] = (free[i] - dot(&l[r], &y, r)) / l[r][r];
    }
    for r in (0..moving.len()).rev() {
        let above: f64 = (r + 1..moving.len()).map(|k| l[k][r] * a[moving[k]]).sum();
        a[moving[r]] = (y[r] - above) / l[r][r];
    }
    let holds = std::array::from_fn(|i| {
        if i < n {
            free[i] - dot(&m[i], &a, n)
        } else {
            0.0
        }
    });
    (a, holds)
}
