//! An identified model: a robot with numbers, tau = Y(q, v, a) theta + F(v) + offset.

use super::Robot;
use super::friction::{DoubleTanh, ViscousCoulomb, sign};

/// Friction of one joint in a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointFriction {
    None,
    /// Law (18).
    DoubleTanh(DoubleTanh),
    /// Viscous and Coulomb friction with a jump at rest.
    ViscousCoulomb(ViscousCoulomb),
}

impl JointFriction {
    /// F(v) in N or N m.
    #[inline]
    pub fn torque(&self, v: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::DoubleTanh(law) => law.torque(v),
            Self::ViscousCoulomb(law) => law.torque(v),
        }
    }

    /// Level of its saturating part at speed, N or N m; none without such a part.
    pub fn coulomb(&self) -> Option<f64> {
        match self {
            Self::None => None,
            Self::DoubleTanh(law) => Some(law.coulomb_1 + law.coulomb_2),
            Self::ViscousCoulomb(law) => Some(law.coulomb),
        }
    }

    /// Its saturating part over its level at speed: -1 and 1 at speed in either direction, between them as smooth
    /// as the law.
    #[inline]
    pub fn direction(&self, v: f64) -> f64 {
        match self {
            Self::DoubleTanh(law) => {
                let level = law.coulomb_1 + law.coulomb_2;
                match level.abs() > 1e-12 {
                    true => (law.torque(v) - law.viscous * v) / level,
                    false => sign(v),
                }
            }
            Self::None | Self::ViscousCoulomb(_) => sign(v),
        }
    }

    /// Whether it jumps at rest, where friction is any torque up to its limit.
    pub fn jumps(&self) -> bool {
        matches!(self, Self::ViscousCoulomb(_))
    }

    /// Number of its parameters.
    pub fn parameters(&self) -> usize {
        match self {
            Self::None => 0,
            Self::DoubleTanh(_) => 5,
            Self::ViscousCoulomb(_) => 2,
        }
    }

    /// dF/d(parameters) into the first entries of `out`, in the order of the law's `NAMES`.
    #[inline]
    pub fn gradient(&self, v: f64, out: &mut [f64]) {
        match self {
            Self::None => {}
            Self::DoubleTanh(law) => out[..5].copy_from_slice(&law.gradient(v)),
            Self::ViscousCoulomb(law) => out[..2].copy_from_slice(&law.gradient(v)),
        }
    }
}

/// A robot with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    pub robot: Robot,
    /// Inertial parameters, in the order of the regressor's columns.
    pub theta: Vec<f64>,
    pub friction: Vec<JointFriction>,
    /// Constant torque per joint [N or N m].
    pub offset: Vec<f64>,
}

impl Model {
    /// Inverse dynamics: the torque of every joint [N or N m] at q, v, a (n numbers each).
    ///
    /// # Panics
    /// Where a slice does not hold n numbers: a mistake of the caller's code.
    #[inline]
    pub fn torque(&self, q: &[f64], v: &[f64], a: &[f64], tau: &mut [f64]) {
        let n = self.friction.len();
        self.robot.torque(&self.theta, q, v, a, &mut tau[..n]);
        for (j, tau) in tau.iter_mut().enumerate().take(n) {
            *tau = *tau + self.friction[j].torque(v[j]) + self.offset[j];
        }
    }

    /// Number of parameters in the order theta, friction of each joint, offset of each joint.
    pub fn parameters(&self) -> usize {
        let friction: usize = self.friction.iter().map(JointFriction::parameters).sum();
        self.theta.len() + friction + self.offset.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_one_at_speed_and_smooth_between() {
        let law = JointFriction::DoubleTanh(DoubleTanh {
            viscous: 2.0,
            coulomb_1: 1.5,
            coulomb_2: -0.5,
            slope_1: 50.0,
            slope_2: 20.0,
        });
        assert!((law.direction(10.0) - 1.0).abs() < 1e-9);
        assert!((law.direction(-10.0) + 1.0).abs() < 1e-9);
        assert!(law.direction(1e-3) > 0.0 && law.direction(1e-3) < 0.1);
        assert_eq!(JointFriction::None.direction(-1e-3), -1.0);
    }
}
