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

    /// Inertia matrix M(q), and C(q, v) v + G(q) + F(v).
    fn dynamics(&self, q: &[f64; J], v: &[f64; J]) -> ([[f64; J]; J], [f64; J]);

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

impl<P: Plant<J>, const J: usize> Moving<'_, P, J> {
    /// Acceleration at the state y for the given joint torque; NaN where M is not positive definite.
    #[inline]
    pub fn acceleration<const N: usize>(
        &self,
        t: f64,
        y: &[f64; N],
        torque: &[f64; J],
    ) -> [f64; J] {
        let (q, v) = (part::<J, N>(y, 0), part::<J, N>(y, J));
        let (mut mass, mut bias) = self.plant.dynamics(&q, &v);
        if !self.effects.is_empty() {
            let motion = Motion {
                t,
                q: &q,
                v: &v,
                z: &y[2 * J..],
            };
            self.effects.torque(&motion, &mut bias);
            self.effects
                .inertia(&motion, mass.as_flattened_mut(), &mut bias);
        }
        let mut load = *torque;
        for i in 0..J {
            load[i] -= bias[i];
        }
        self.plant.solve(&mass, &load).unwrap_or([f64::NAN; J])
    }

    /// Joint torque that keeps the state y without acceleration: C v + G + F + E.
    pub fn holding_torque(&self, t: f64, q: &[f64; J], v: &[f64; J], z: &[f64]) -> [f64; J] {
        let (mut mass, mut bias) = self.plant.dynamics(q, v);
        let motion = Motion { t, q, v, z };
        self.effects.torque(&motion, &mut bias);
        self.effects
            .inertia(&motion, mass.as_flattened_mut(), &mut bias);
        bias
    }
}

impl<P: Plant<J>, const J: usize, const N: usize> System<N> for Moving<'_, P, J> {
    #[inline]
    fn rates(&self, t: f64, y: &[f64; N], dydt: &mut [f64; N]) {
        let q = part::<J, N>(y, 0);
        let a = self.acceleration(t, y, &self.plant.torque(&q, &self.volts));
        dydt[..J].copy_from_slice(&y[J..2 * J]);
        dydt[J..2 * J].copy_from_slice(&a);
        if N > 2 * J {
            dydt[2 * J..].fill(0.0);
            let (q, v, z) = (&y[..J], &y[J..2 * J], &y[2 * J..]);
            self.effects
                .rates(&Motion { t, q, v, z }, &mut dydt[2 * J..]);
        }
    }

    fn accepted(&mut self, t: f64, y: &[f64; N]) -> bool {
        let (q, v, z) = (&y[..J], &y[J..2 * J], &y[2 * J..]);
        self.effects.moved(&Motion { t, q, v, z })
    }
}

/// J numbers of the state from index `first` on.
#[inline]
pub(super) fn part<const J: usize, const N: usize>(y: &[f64; N], first: usize) -> [f64; J] {
    std::array::from_fn(|i| y[first + i])
}
