//! What moves: a plant maps volts to joint torques and joint torques to accelerations.
//!
//! Per joint the balance is tau = M a + C v + G + F(v) + E, eq. (60) with the effects E that a declared
//! model may lack. A [`Moving`] plant is that balance as a differential equation with the state
//! (q, v, z): z are the states of the effects.

use super::SimulateError;
use super::effects::{Effects, Motion};
use super::integrate::System;

/// A mechanism of J joints that J motors drive.
pub trait Plant<const J: usize> {
    /// Names of the joints, in the order of all joint vectors.
    fn joint_names(&self) -> [String; J];

    /// Names of the motor coordinates, in the order of volts and encoders.
    fn coordinate_names(&self) -> [String; J];

    /// Motor coordinates of the joints q.
    fn coordinates(&self, q: &[f64; J]) -> [f64; J];

    /// Speeds of the motor coordinates.
    fn coordinate_speeds(&self, q: &[f64; J], v: &[f64; J]) -> [f64; J];

    /// Joints of the motor coordinates x.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where no pose belongs to them.
    fn joints(&self, x: &[f64; J]) -> Result<[f64; J], SimulateError>;

    /// Joint speeds at the pose q of the motor speeds.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the pose is singular.
    fn joint_speeds(&self, q: &[f64; J], xd: &[f64; J]) -> Result<[f64; J], SimulateError>;

    /// Joint torques of the volts at the pose q, eq. (66).
    fn torque(&self, q: &[f64; J], volts: &[f64; J]) -> [f64; J];

    /// Volts that give the joint torques at the pose q, eq. (65).
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the pose is singular.
    fn volts(&self, q: &[f64; J], torque: &[f64; J]) -> Result<[f64; J], SimulateError>;

    /// Inertia matrix M(q), and C(q, v) v + G(q).
    fn rigid(&self, q: &[f64; J], v: &[f64; J]) -> ([[f64; J]; J], [f64; J]);

    /// Friction F(v) of each joint.
    fn friction(&self, v: &[f64; J]) -> [f64; J];

    /// Constant torque that the motors supply beside load and friction.
    #[inline]
    fn offset(&self) -> [f64; J] {
        [0.0; J]
    }

    /// Inertia matrix M(q), and C(q, v) v + G(q) + F(v) with the offset.
    #[inline]
    fn dynamics(&self, q: &[f64; J], v: &[f64; J]) -> ([[f64; J]; J], [f64; J]) {
        let (mass, mut bias) = self.rigid(q, v);
        let (friction, offset) = (self.friction(v), self.offset());
        for i in 0..J {
            bias[i] += friction[i] + offset[i];
        }
        (mass, bias)
    }

    /// x with M x = b; `None` where M is not positive definite.
    fn solve(&self, mass: &[[f64; J]; J], b: &[f64; J]) -> Option<[f64; J]>;

    /// Lower and upper limit of the motor coordinates.
    fn limits(&self) -> ([f64; J], [f64; J]);

    /// One encoder count of each motor coordinate, m or rad; 0 for a perfect encoder.
    fn resolution(&self) -> [f64; J];
}

/// A plant with its effects under a held drive: the differential equation that is integrated.
///
/// N is at least 2 J plus the number of the effects' states.
#[derive(Debug)]
pub struct Moving<'a, P, const J: usize> {
    pub plant: &'a P,
    pub effects: Effects,
    /// Volts, held.
    pub volts: [f64; J],
}

/// The motor's side of the joints and what the balance of torques came to.
struct Balance<const J: usize> {
    q: [f64; J],
    v: [f64; J],
    friction: [f64; J],
    /// Motor torque that acts, less friction and added torques.
    net: [f64; J],
    acceleration: [f64; J],
}

impl<P: Plant<J>, const J: usize> Moving<'_, P, J> {
    /// Positions and speeds where the motors and their encoders sit: those of the links, and beyond them
    /// the deflections of elastic joints.
    pub fn motor_side(&self, q: &[f64; J], v: &[f64; J], z: &[f64]) -> ([f64; J], [f64; J]) {
        let (mut q, mut v) = (*q, *v);
        for twist in self.effects.twists(z) {
            q[twist.joint] += twist.deflection;
            v[twist.joint] += twist.rate;
        }
        (q, v)
    }

    /// Acceleration of the joints at the state y under the held volts; NaN where M is not invertible.
    #[inline]
    pub fn acceleration<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; J] {
        let (q, v) = (part::<J, N>(y, 0), part::<J, N>(y, J));
        if self.effects.is_empty() {
            let torque = self.plant.torque(&q, &self.volts);
            let (mass, bias) = self.plant.dynamics(&q, &v);
            let load = std::array::from_fn(|i| torque[i] - bias[i]);
            return self.plant.solve(&mass, &load).unwrap_or([f64::NAN; J]);
        }
        self.balance(t, &q, &v, &y[2 * J..]).acceleration
    }

    /// The balance with effects: what the motors give, friction and added torques take; what is left is the
    /// load tau_l with what depends on it, and where a joint is elastic the load is what the spring passes on.
    fn balance(&self, t: f64, link: &[f64; J], speed: &[f64; J], z: &[f64]) -> Balance<J> {
        let (q, v) = self.motor_side(link, speed, z);
        let friction = self.plant.friction(&v);
        let motion = Motion {
            t,
            q: &q,
            v: &v,
            z,
            friction: &friction,
            ..Motion::default()
        };
        let mut acting = [1.0; J];
        self.effects.drive(&mut acting);
        let mut added = self.plant.offset();
        self.effects.torque(&motion, &mut added);
        let mut share = [[0.0; 2]; J];
        self.effects.load(&motion, &mut share);
        let torque = self.plant.torque(&q, &self.volts);
        let mut net: [f64; J] =
            std::array::from_fn(|i| acting[i] * torque[i] - friction[i] - added[i]);
        // tau_l (1 + share) = net is linear on each side of zero.
        let mut load: [f64; J] = std::array::from_fn(|i| {
            let [positive, negative] = share[i];
            net[i] / (1.0 + if net[i] > 0.0 { positive } else { negative })
        });
        for twist in self.effects.twists(z) {
            let [positive, negative] = share[twist.joint];
            load[twist.joint] = twist.torque;
            net[twist.joint] -= twist.torque
                * if twist.torque > 0.0 {
                    positive
                } else {
                    negative
                };
        }
        let (mut mass, mut bias) = self.plant.rigid(link, speed);
        let motion = Motion {
            q: link,
            v: speed,
            ..motion
        };
        self.effects
            .inertia(&motion, mass.as_flattened_mut(), &mut bias);
        for i in 0..J {
            load[i] -= bias[i];
        }
        let symmetric = (1..J).all(|i| (0..i).all(|j| mass[i][j] == mass[j][i]));
        let solved = if symmetric {
            self.plant.solve(&mass, &load)
        } else {
            eliminate(mass, load)
        };
        Balance {
            q,
            v,
            friction,
            net,
            acceleration: solved.unwrap_or([f64::NAN; J]),
        }
    }

    /// Rigid-body torque C v + G with what effects add to it, at no acceleration.
    pub fn load(&self, t: f64, q: &[f64; J], v: &[f64; J], z: &[f64]) -> [f64; J] {
        let (mut mass, mut bias) = self.plant.rigid(q, v);
        let motion = Motion {
            t,
            q,
            v,
            z,
            ..Motion::default()
        };
        self.effects
            .inertia(&motion, mass.as_flattened_mut(), &mut bias);
        bias
    }

    /// Logged joint torque that keeps the state without acceleration: C v + G + F + E.
    pub fn holding_torque(&self, t: f64, q: &[f64; J], v: &[f64; J], z: &[f64]) -> [f64; J] {
        let load = self.load(t, q, v, z);
        let friction = self.plant.friction(v);
        let motion = Motion {
            t,
            q,
            v,
            z,
            friction: &friction,
            ..Motion::default()
        };
        let mut torque = self.plant.offset();
        self.effects.torque(&motion, &mut torque);
        let mut share = [[0.0; 2]; J];
        self.effects.load(&motion, &mut share);
        let mut acting = [1.0; J];
        self.effects.drive(&mut acting);
        std::array::from_fn(|i| {
            let [positive, negative] = share[i];
            let beside = load[i] * if load[i] > 0.0 { positive } else { negative };
            (load[i] + beside + friction[i] + torque[i]) / acting[i]
        })
    }
}

impl<P: Plant<J>, const J: usize, const N: usize> System<N> for Moving<'_, P, J> {
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
        let motion = Motion {
            t,
            q: &balance.q,
            v: &balance.v,
            z,
            friction: &balance.friction,
            a: &balance.acceleration,
            net: &balance.net,
        };
        self.effects.rates(&motion, &mut dydt[2 * J..]);
    }

    fn accepted(&mut self, t: f64, y: &[f64; N]) -> bool {
        if self.effects.is_empty() {
            return false;
        }
        let z = &y[2 * J..];
        let (q, v) = self.motor_side(&part::<J, N>(y, 0), &part::<J, N>(y, J), z);
        self.effects.moved(&Motion {
            t,
            q: &q,
            v: &v,
            z,
            ..Motion::default()
        })
    }
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
