//! A plant with its effects in motion: the differential equation that is integrated.
//!
//! Its state is (q, v, z): z are the states of the effects.

use super::effects::{Effect, PlantEffects, PlantState};
use super::integrate::OdeSystem;
use super::plant::{Plant, gather, spread};

/// A plant with its effects, its volts those of the last control sample (zero-order hold).
///
/// N is at least 2 J plus the number of the effects' states.
#[derive(Debug)]
pub struct MovingPlant<'a, const J: usize> {
    pub plant: &'a Plant<J>,
    pub effects: PlantEffects,
    pub volts: [f64; J],
}

/// The motor's side of the joints and what the balance of torques came to.
struct TorqueBalance<const J: usize> {
    q: [f64; J],
    v: [f64; J],
    friction: [f64; J],
    /// Motor torque that acts, less friction and added torques.
    net: [f64; J],
    acceleration: [f64; J],
}

impl<const J: usize> MovingPlant<'_, J> {
    /// Positions and speeds of the motors and their encoders: beyond the links by the deflections of elastic joints.
    pub(super) fn motor_side(&self, q: &[f64; J], v: &[f64; J], z: &[f64]) -> ([f64; J], [f64; J]) {
        let (mut q, mut v) = (*q, *v);
        for twist in self.effects.twists(z) {
            q[twist.joint] += twist.deflection;
            v[twist.joint] += twist.rate;
        }
        (q, v)
    }

    /// Acceleration of the joints at the state y under the volts; NaN where M is not invertible.
    #[inline]
    pub fn acceleration<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; J] {
        let (q, v) = (part::<J, N>(y, 0), part::<J, N>(y, J));
        if self.effects.is_empty() {
            let torque = self.plant.mechanism.torque(&q, &self.volts);
            let (mass, bias) = self.plant.dynamics(&q, &v);
            let load = std::array::from_fn(|i| torque[i] - bias[i]);
            return self.plant.solve(&mass, &load).unwrap_or([f64::NAN; J]);
        }
        self.balance(t, &q, &v, &y[2 * J..]).acceleration
    }

    /// The balance with effects; where a joint is elastic the load tau_l is what the spring passes on.
    fn balance(&self, t: f64, link: &[f64; J], speed: &[f64; J], z: &[f64]) -> TorqueBalance<J> {
        let (q, v) = self.motor_side(link, speed, z);
        let (n, friction) = (self.plant.joints(), self.plant.friction(&v));
        let motion = PlantState {
            friction: &friction[..n],
            ..seen(n, t, [&q, &v], z)
        };
        let torque = self.plant.mechanism.torque(&q, &self.volts);
        let (mut added, mut acting, mut share) = (self.plant.offset, [1.0; J], [[0.0; 2]; J]);
        self.effects.each(&motion, |effect, m| {
            effect.drive(m, &torque, &mut acting);
            effect.torque(m, &mut added);
            effect.load(m, &mut share);
        });
        let (mass, bias) = self.body(t, link, speed, z);
        let symmetric = (1..J).all(|i| (0..i).all(|j| mass[i][j] == mass[j][i]));
        // net torque, load and acceleration, when more torque is taken
        let respond = |taken: &[f64; J]| {
            let mut net: [f64; J] =
                std::array::from_fn(|i| acting[i] * torque[i] - friction[i] - added[i] - taken[i]);
            // tau_l (1 + share) = net is linear on each side of zero.
            let mut load: [f64; J] =
                std::array::from_fn(|i| net[i] / (1.0 + side(share[i], net[i])));
            for twist in self.effects.twists(z) {
                load[twist.joint] = twist.torque;
                net[twist.joint] -= twist.torque * side(share[twist.joint], twist.torque);
            }
            let driven: [f64; J] = std::array::from_fn(|i| load[i] - bias[i]);
            let solved = match symmetric {
                true => self.plant.solve(&mass, &driven),
                false => eliminate(mass, driven),
            };
            (net, load, solved.unwrap_or([f64::NAN; J]))
        };
        let taken = self.implicit(&respond, &motion);
        let (net, _, acceleration) = respond(&taken);
        TorqueBalance {
            q,
            v,
            friction,
            net,
            acceleration,
        }
    }

    /// The torque that effects take by the accelerations and loads it leaves, by Newton's method; NaN where it finds none.
    fn implicit(
        &self,
        respond: &impl Fn(&[f64; J]) -> ([f64; J], [f64; J], [f64; J]),
        motion: &PlantState,
    ) -> [f64; J] {
        const MOST_STEPS: usize = 30;
        let mut joints: Vec<usize> = self.effects.implicit_joints().collect();
        joints.sort_unstable();
        joints.dedup();
        let mut taken = [0.0; J];
        if joints.is_empty() {
            return taken;
        }
        let n = self.plant.joints();
        let left = |taken: &[f64; J]| -> ([f64; J], [f64; J]) {
            let (net, load, a) = respond(taken);
            let motion = PlantState {
                a: &a[..n],
                load: &load[..n],
                ..*motion
            };
            let mut wanted = [0.0; J];
            let each = |effect: &dyn Effect, m: &PlantState| effect.implicit(m, &mut wanted);
            self.effects.each(&motion, each);
            (std::array::from_fn(|i| wanted[i] - taken[i]), net)
        };
        for _ in 0..MOST_STEPS {
            let (rest, net) = left(&taken);
            let scale = |j: usize| 1.0 + net[j].abs() + taken[j].abs();
            if joints.iter().all(|&j| rest[j].abs() <= 1e-11 * scale(j)) {
                return taken;
            }
            let mut slopes = [[0.0; J]; J];
            for (i, row) in slopes.iter_mut().enumerate() {
                row[i] = 1.0;
            }
            for &j in &joints {
                let step = 1e-4 * scale(j);
                let mut tried = taken;
                tried[j] += step;
                let (moved, _) = left(&tried);
                for &i in &joints {
                    slopes[i][j] = (rest[i] - moved[i]) / step;
                }
            }
            let Some(step) = eliminate(slopes, rest) else {
                break;
            };
            for &j in &joints {
                taken[j] += step[j];
            }
        }
        [f64::NAN; J]
    }

    /// Rigid-body torque C v + G with what effects add to it, at no acceleration.
    pub fn load(&self, t: f64, q: &[f64; J], v: &[f64; J], z: &[f64]) -> [f64; J] {
        self.body(t, q, v, z).1
    }

    /// Inertia matrix and C v + G of the links, with what effects add to them.
    fn body(&self, t: f64, q: &[f64; J], v: &[f64; J], z: &[f64]) -> ([[f64; J]; J], [f64; J]) {
        let n = self.plant.joints();
        let (mut mass, mut bias) = self.plant.rigid(q, v);
        gather(&mut mass, n);
        let flat = &mut mass.as_flattened_mut()[..n * n];
        let motion = seen(n, t, [q, v], z);
        let each = |effect: &dyn Effect, m: &PlantState| effect.inertia(m, flat, &mut bias[..n]);
        self.effects.each(&motion, each);
        spread(&mut mass, n);
        (mass, bias)
    }

    /// Logged joint torque that keeps the state without acceleration: C v + G + F + E.
    pub fn holding_torque(&self, t: f64, q: &[f64; J], v: &[f64; J], z: &[f64]) -> [f64; J] {
        let load = self.load(t, q, v, z);
        let n = self.plant.joints();
        let friction = self.plant.friction(v);
        let motion = PlantState {
            friction: &friction[..n],
            ..seen(n, t, [q, v], z)
        };
        let (mut torque, mut share) = (self.plant.offset, [[0.0; 2]; J]);
        self.effects.each(&motion, |effect, m| {
            effect.torque(m, &mut torque);
            effect.load(m, &mut share);
        });
        let still = [0.0; J];
        let at_rest = PlantState {
            a: &still[..n],
            load: &load[..n],
            ..motion
        };
        let each = |effect: &dyn Effect, m: &PlantState| effect.implicit(m, &mut torque);
        self.effects.each(&at_rest, each);
        let needed: [f64; J] = std::array::from_fn(|i| {
            let beside = load[i] * side(share[i], load[i]);
            load[i] + beside + friction[i] + torque[i]
        });
        // what acts may hang on what is logged: each turn leaves a small part of the change before it
        const TURNS: usize = 40;
        let mut logged = needed;
        for _ in 0..TURNS {
            let mut acting = [1.0; J];
            let each = |effect: &dyn Effect, m: &PlantState| effect.drive(m, &logged, &mut acting);
            self.effects.each(&motion, each);
            let next = std::array::from_fn(|i| needed[i] / acting[i]);
            if next == logged {
                break;
            }
            logged = next;
        }
        logged
    }
}

impl<const J: usize, const N: usize> OdeSystem<N> for MovingPlant<'_, J> {
    #[inline]
    fn rates(&self, t: f64, y: &[f64; N], dydt: &mut [f64; N]) {
        dydt[..J].copy_from_slice(&y[J..2 * J]);
        if N == 2 * J {
            dydt[J..2 * J].copy_from_slice(&self.acceleration(t, y));
            return;
        }
        let z = &y[2 * J..];
        let balance = self.balance(t, &part::<J, N>(y, 0), &part::<J, N>(y, J), z);
        dydt[J..2 * J].copy_from_slice(&balance.acceleration);
        dydt[2 * J..].fill(0.0);
        let n = self.plant.joints();
        let motion = PlantState {
            friction: &balance.friction[..n],
            a: &balance.acceleration[..n],
            net: &balance.net[..n],
            ..seen(n, t, [&balance.q, &balance.v], z)
        };
        self.effects.rates(&motion, &mut dydt[2 * J..]);
    }

    fn accepted(&mut self, t: f64, y: &[f64; N]) -> bool {
        if self.effects.is_empty() {
            return false;
        }
        let z = &y[2 * J..];
        let (q, v) = self.motor_side(&part::<J, N>(y, 0), &part::<J, N>(y, J), z);
        let n = self.plant.joints();
        self.effects.moved(&seen(n, t, [&q, &v], z))
    }
}

/// What effects see of a motion of n joints.
fn seen<'a, const J: usize>(
    n: usize,
    t: f64,
    [q, v]: [&'a [f64; J]; 2],
    z: &'a [f64],
) -> PlantState<'a> {
    PlantState {
        t,
        q: &q[..n],
        v: &v[..n],
        z,
        ..PlantState::default()
    }
}

/// The share of a load on its side of zero.
fn side([positive, negative]: [f64; 2], load: f64) -> f64 {
    if load > 0.0 { positive } else { negative }
}

/// x with M x = b for any invertible M, by elimination with row exchange; `None` where M is not invertible.
fn eliminate<const J: usize>(mut m: [[f64; J]; J], mut b: [f64; J]) -> Option<[f64; J]> {
    for k in 0..J {
        let largest = (k..J).max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs()))?;
        m.swap(k, largest);
        b.swap(k, largest);
        let pivot = m[k];
        if pivot[k] == 0.0 || !pivot[k].is_finite() {
            return None;
        }
        for i in k + 1..J {
            let share = m[i][k] / pivot[k];
            for (own, from) in m[i].iter_mut().zip(pivot).skip(k) {
                *own -= share * from;
            }
            b[i] -= share * b[k];
        }
    }
    for k in (0..J).rev() {
        let known: f64 = (k + 1..J).map(|j| m[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / m[k][k];
    }
    Some(b)
}

/// J numbers of the state from index `first` on.
#[inline]
pub(super) fn part<const J: usize, const N: usize>(y: &[f64; N], first: usize) -> [f64; J] {
    std::array::from_fn(|i| y[first + i])
}
