//! Friction laws F(v) of one joint, with their derivatives.
//!
//! The sign is that of eq. (60): tau = Y theta + F(v), so that friction takes torque from the
//! motor (the report's (4), (10), (11) have it the other way round).

use crate::math::hyperbolic::tanh;
use serde::{Deserialize, Serialize};

/// Viscous friction and two saturating parts, law (18) of the report:
/// F(v) = Bv v + Bf1 tanh(w1 v) + Bf2 tanh(w2 v), for 1 - 2/(1 + exp(2 w v)) = tanh(w v).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DoubleTanh {
    /// Bv: N s/m or N m s/rad (theta_13..16).
    pub viscous: f64,
    /// Bf1: N or N m (theta_17..20).
    pub coulomb_1: f64,
    /// Bf2: N or N m (theta_21..24); negative for a Stribeck dip.
    pub coulomb_2: f64,
    /// w1: s/m or s/rad (theta_25..28).
    pub slope_1: f64,
    /// w2: s/m or s/rad (theta_29..32).
    pub slope_2: f64,
}

impl DoubleTanh {
    /// Names of the five parameters, in the order of [`Self::parameters`] and [`Self::gradient`].
    pub const NAMES: [&'static str; 5] =
        ["viscous", "coulomb_1", "coulomb_2", "slope_1", "slope_2"];

    /// F(v) in N or N m.
    #[inline]
    pub fn torque(&self, v: f64) -> f64 {
        self.viscous * v
            + self.coulomb_1 * tanh(self.slope_1 * v)
            + self.coulomb_2 * tanh(self.slope_2 * v)
    }

    /// dF/dv in N s/m or N m s/rad.
    #[inline]
    pub fn slope(&self, v: f64) -> f64 {
        let (t1, t2) = (tanh(self.slope_1 * v), tanh(self.slope_2 * v));
        self.viscous
            + self.coulomb_1 * self.slope_1 * (1.0 - t1 * t1)
            + self.coulomb_2 * self.slope_2 * (1.0 - t2 * t2)
    }

    /// dF/d(viscous, coulomb_1, coulomb_2, slope_1, slope_2) at v.
    #[inline]
    pub fn gradient(&self, v: f64) -> [f64; 5] {
        let (t1, t2) = (tanh(self.slope_1 * v), tanh(self.slope_2 * v));
        [
            v,
            t1,
            t2,
            self.coulomb_1 * v * (1.0 - t1 * t1),
            self.coulomb_2 * v * (1.0 - t2 * t2),
        ]
    }

    /// (viscous, coulomb_1, coulomb_2, slope_1, slope_2).
    pub fn parameters(&self) -> [f64; 5] {
        [
            self.viscous,
            self.coulomb_1,
            self.coulomb_2,
            self.slope_1,
            self.slope_2,
        ]
    }

    /// The inverse of [`Self::parameters`].
    pub fn from_parameters([viscous, coulomb_1, coulomb_2, slope_1, slope_2]: [f64; 5]) -> Self {
        Self {
            viscous,
            coulomb_1,
            coulomb_2,
            slope_1,
            slope_2,
        }
    }

    /// The four laws of the CFT robot, joints q1, q2, q4, q5, from theta_13..theta_32: Bv, Bf1,
    /// Bf2, w1, w2, each for the four joints.
    pub fn cft_joints(theta: &[f64; 20]) -> [Self; 4] {
        std::array::from_fn(|i| {
            Self::from_parameters([
                theta[i],
                theta[4 + i],
                theta[8 + i],
                theta[12 + i],
                theta[16 + i],
            ])
        })
    }
}

/// Viscous and Coulomb friction with a jump at rest: F(v) = Fv v + Fc sign(v), F(0) = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViscousCoulomb {
    /// Fv: N s/m or N m s/rad.
    pub viscous: f64,
    /// Fc: N or N m.
    pub coulomb: f64,
}

impl ViscousCoulomb {
    /// Names of the two parameters, in the order of [`Self::gradient`].
    pub const NAMES: [&'static str; 2] = ["viscous", "coulomb"];

    /// F(v) in N or N m.
    #[inline]
    pub fn torque(&self, v: f64) -> f64 {
        self.viscous * v + self.coulomb * sign(v)
    }

    /// dF/dv away from v = 0, in N s/m or N m s/rad.
    #[inline]
    pub fn slope(&self, _v: f64) -> f64 {
        self.viscous
    }

    /// dF/d(viscous, coulomb) at v.
    #[inline]
    pub fn gradient(&self, v: f64) -> [f64; 2] {
        [v, sign(v)]
    }
}

/// Sign with sign(0) = 0, unlike `f64::signum`.
#[inline]
pub fn sign(v: f64) -> f64 {
    f64::from(i8::from(v > 0.0) - i8::from(v < 0.0))
}
