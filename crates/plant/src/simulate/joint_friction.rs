//! Friction of a simulated joint: laws without a jump.

use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};

/// Rate at which a viscous-Coulomb joint comes to rest within its steep part: half a sample at 1 kHz \[1/s\].
const REST_RATE: f64 = 2000.0;

/// Friction law of a simulated joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SmoothFriction {
    /// Law (18).
    DoubleTanh(DoubleTanh),
    /// Fv v + Fc sgn(v), with tanh(w v) in the place of the sign, w = `steepness` in s/m or s/rad: a
    /// differential equation with a jump has no solution at rest.
    ViscousCoulomb { law: ViscousCoulomb, steepness: f64 },
}

impl SmoothFriction {
    /// Viscous and Coulomb friction, as steep at rest as a 1 kHz log of that inertia can resolve.
    pub fn viscous_coulomb(law: ViscousCoulomb, inertia: f64) -> Self {
        let steepness = if law.coulomb > 0.0 {
            REST_RATE * inertia / law.coulomb
        } else {
            1.0
        };
        Self::ViscousCoulomb { law, steepness }
    }

    /// F(v) in N or N m.
    #[inline]
    pub fn torque(&self, v: f64) -> f64 {
        match self {
            Self::DoubleTanh(law) => law.torque(v),
            Self::ViscousCoulomb { law, steepness } => {
                law.viscous * v + law.coulomb * (steepness * v).tanh()
            }
        }
    }

    /// Coulomb level at speed \[N or N m\], and viscous coefficient \[N s/m or N m s/rad\].
    pub fn levels(&self) -> [f64; 2] {
        match self {
            Self::DoubleTanh(law) => [law.coulomb_1 + law.coulomb_2, law.viscous],
            Self::ViscousCoulomb { law, .. } => [law.coulomb, law.viscous],
        }
    }

    /// Whether all its numbers are such.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::DoubleTanh(law) => law.parameters().iter().all(|x| x.is_finite()),
            Self::ViscousCoulomb { law, steepness } => {
                let steep = *steepness > 0.0 && steepness.is_finite();
                law.viscous.is_finite() && law.coulomb.is_finite() && steep
            }
        }
    }
}
