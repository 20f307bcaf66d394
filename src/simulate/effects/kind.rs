//! What a kind of effect declares: its name, where it may sit, its keys with units and defaults.

use super::{Effect, Fault, Machine, Site};
use crate::simulate::SimulateError;

/// A kind of effect: its name, its keys, and how it is built from one value per key.
pub struct Kind {
    pub name: &'static str,
    pub family: &'static str,
    pub places: Places,
    pub keys: &'static [Key],
    pub build: fn(&Site, &Machine, &[f64]) -> Result<Built, SimulateError>,
}

/// Where a kind of effect may sit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Places {
    /// At a joint; at every joint where none is named.
    Joints,
    /// At the screws x_r and y_r of the CFT robot; at both where none is named.
    Screws,
    /// At a joint or a screw; where none is named at both screws, and without screws at every joint.
    JointsAndScrews,
    /// At the robot as a whole.
    Whole,
}

/// What a kind is built into.
pub enum Built {
    /// A part of the plant.
    Plant(Box<dyn Effect>),
    /// A fault of the log.
    Log(Box<dyn Fault>),
}

impl Built {
    /// An effect of the plant.
    pub(super) fn plant(effect: impl Effect + 'static) -> Result<Self, SimulateError> {
        Ok(Self::Plant(Box::new(effect)))
    }

    /// A fault of the log.
    pub(super) fn log(fault: impl Fault + 'static) -> Result<Self, SimulateError> {
        Ok(Self::Log(Box::new(fault)))
    }
}

/// One value of an effect's definition.
pub struct Key {
    pub name: &'static str,
    pub unit: Unit,
    /// Whether the key is a size of the effect. Where one size is given the other sizes are zero, and
    /// where none is they take their defaults; every other key takes its own default.
    pub size: bool,
    pub default: fn(&Site) -> f64,
}

impl Key {
    /// A size of the effect.
    pub(super) const fn size(name: &'static str, unit: Unit, default: fn(&Site) -> f64) -> Self {
        Self {
            name,
            unit,
            size: true,
            default,
        }
    }

    /// A number that shapes the effect.
    pub(super) const fn shape(name: &'static str, unit: Unit, default: fn(&Site) -> f64) -> Self {
        Self {
            name,
            unit,
            size: false,
            default,
        }
    }
}

/// Unit of a key; most follow the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// The same at every joint.
    Fixed(&'static str),
    /// N or Nm.
    Torque,
    /// N/s or Nm/s.
    TorqueRate,
    /// N or Nm, per root of a second.
    TorqueWalk,
    /// m or rad.
    Position,
    /// m/s or rad/s.
    Speed,
    /// 1/m or 1/rev.
    Order,
    /// N s/m or Nm s/rad.
    Viscous,
    /// Torque per speed to the power of the key `p`.
    Power,
    /// s/m or s/rad.
    Slope,
    /// N/m or Nm/rad.
    Stiffness,
    /// N/m^3 or Nm/rad^3.
    Cubic,
    /// kg or kg m^2.
    Inertia,
    /// Torque of this joint per speed of the joint `from`.
    CoupledViscous,
    /// Torque of this joint per acceleration of the joint `from`.
    CoupledInertia,
    /// Speed of this joint per speed of the joint `from`.
    CoupledRatio,
}

impl Unit {
    /// The unit at a site that turns or slides; `from` is whether the joint of the key `from` turns.
    pub fn text(self, turns: bool, from: bool) -> &'static str {
        let by = |slides, turned| if turns { turned } else { slides };
        match self {
            Self::Fixed(text) => text,
            Self::Torque => by("N", "Nm"),
            Self::TorqueRate => by("N/s", "Nm/s"),
            Self::TorqueWalk => by("N/s^0.5", "Nm/s^0.5"),
            Self::Position => by("m", "rad"),
            Self::Speed => by("m/s", "rad/s"),
            Self::Order => by("1/m", "1/rev"),
            Self::Viscous => by("N s/m", "Nm s/rad"),
            Self::Power => by("N (s/m)^p", "Nm (s/rad)^p"),
            Self::Slope => by("s/m", "s/rad"),
            Self::Stiffness => by("N/m", "Nm/rad"),
            Self::Cubic => by("N/m^3", "Nm/rad^3"),
            Self::Inertia => by("kg", "kg m^2"),
            Self::CoupledViscous => match (turns, from) {
                (false, false) => "N s/m",
                (false, true) => "N s/rad",
                (true, false) => "Nm s/m",
                (true, true) => "Nm s/rad",
            },
            Self::CoupledInertia => match (turns, from) {
                (false, false) => "kg",
                (true, true) => "kg m^2",
                _ => "kg m",
            },
            Self::CoupledRatio => match (turns, from) {
                (false, true) => "m/rad",
                (true, false) => "rad/m",
                _ => "1",
            },
        }
    }
}
