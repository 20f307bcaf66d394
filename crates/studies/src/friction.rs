//! Friction of a joint or of its drive: laws of speed, and one with a memory.

use serde::Serialize;

/// What stands beside viscous friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum Law {
    /// Coulomb friction with an ideal stick.
    Coulomb,
    /// fc tanh(v / width): no stick.
    Smooth { width: f64 },
    /// fc + more exp(-(v / vs)^2), with an ideal stick.
    Stribeck { more: f64, vs: f64 },
    /// A bristle of `stiffness` (Canudas de Wit et al. 1995); Dahl's where `damping` is 0.
    Presliding { stiffness: f64, damping: f64 },
}

/// Friction of one joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Friction {
    /// [N s/m or Nm s/rad]
    pub viscous: f64,
    /// Level of Coulomb friction [N or Nm].
    pub coulomb: f64,
    #[serde(flatten)]
    pub law: Law,
}

impl Friction {
    pub fn sticks(&self) -> bool {
        matches!(self.law, Law::Coulomb | Law::Stribeck { .. })
    }

    /// Level that resists at a speed, and at standstill the level that holds; `added` goes on top of Coulomb's.
    pub fn level(&self, speed: f64, added: f64) -> f64 {
        let level = self.coulomb + added;
        match self.law {
            Law::Stribeck { more, vs } => level + more * (-(speed / vs).powi(2)).exp(),
            _ => level,
        }
        .max(0.0)
    }

    /// Torque against a motion in `direction` at a speed with the bristle at `z`, and the bristle's rate.
    #[inline]
    pub fn torque(&self, speed: f64, direction: f64, z: f64, added: f64) -> (f64, f64) {
        let viscous = self.viscous * speed;
        match self.law {
            Law::Coulomb | Law::Stribeck { .. } => {
                (viscous + direction * self.level(speed, added), 0.0)
            }
            Law::Smooth { width } => (
                viscous + self.level(speed, added) * (speed / width).tanh(),
                0.0,
            ),
            Law::Presliding { stiffness, damping } => {
                let level = self.level(speed, added).max(1e-12);
                let rate = speed - stiffness * speed.abs() * z / level;
                (viscous + stiffness * z + damping * rate, rate)
            }
        }
    }

    /// The law at a lasting speed: what a ladder would measure.
    pub fn lasting(&self, speed: f64) -> f64 {
        match self.law {
            Law::Presliding { .. } => self.viscous * speed + speed.signum() * self.coulomb,
            _ => self.torque(speed, speed.signum(), 0.0, 0.0).0,
        }
    }
}
