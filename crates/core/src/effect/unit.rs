//! Units of an effect's numbers, known once it is known where the effect sits.

use crate::robot::JointKind;

/// Unit of a key; most follow the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// A number without one.
    One,
    /// The same at every place.
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
    /// Waves per metre or per revolution.
    Order,
    /// Waves per metre or per revolution of the joint `from`.
    OtherOrder,
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
    /// That of the signal that the key `signal` numbers.
    Signal,
}

impl Unit {
    /// The unit at a coordinate of one kind whose torque is in `torque`, with a joint `from` of another kind.
    pub fn text(self, kind: JointKind, from: JointKind, torque: &str) -> String {
        use JointKind::{Prismatic, Revolute};
        let (position, other) = (kind.position_unit(), from.position_unit());
        match self {
            Self::One => "1".to_owned(),
            // a body's numbers count in the unit of the torques that show it
            Self::Fixed(text) => kind.inertial_unit(text, torque),
            Self::Torque => torque.to_owned(),
            Self::TorqueRate => format!("{torque}/s"),
            Self::TorqueWalk => format!("{torque}/s^0.5"),
            Self::Position => position.to_owned(),
            Self::Speed => format!("{position}/s"),
            Self::Order if kind == Revolute => "1/rev".to_owned(),
            Self::Order => "1/m".to_owned(),
            Self::OtherOrder => Self::Order.text(from, from, torque),
            Self::Viscous => format!("{torque} s/{position}"),
            Self::Power => format!("{torque} (s/{position})^p"),
            Self::Slope => format!("s/{position}"),
            Self::Stiffness => format!("{torque}/{position}"),
            Self::Cubic => format!("{torque}/{position}^3"),
            Self::Inertia => Self::CoupledInertia.text(kind, kind, torque),
            Self::CoupledViscous => format!("{torque} s/{other}"),
            Self::CoupledInertia if !matches!(torque, "N" | "Nm") => {
                format!("{torque} s^2/{other}")
            }
            Self::CoupledInertia => match (kind, from) {
                (Prismatic, Prismatic) => "kg".to_owned(),
                (Revolute, Revolute) => "kg m^2".to_owned(),
                _ => "kg m".to_owned(),
            },
            Self::CoupledRatio if kind == from => "1".to_owned(),
            Self::CoupledRatio => format!("{position}/{other}"),
            Self::Signal => "of the signal".to_owned(),
        }
    }

    /// The same in model files and results, which leave a 1 out and say slopes and powers in words.
    pub(crate) fn in_files(self, kind: JointKind, from: JointKind, torque: &str) -> String {
        match self {
            Self::Slope => "1/speed".to_owned(),
            Self::Power => "torque per speed^p".to_owned(),
            _ => match self.text(kind, from, torque).as_str() {
                "1" => String::new(),
                text => text.to_owned(),
            },
        }
    }
}
