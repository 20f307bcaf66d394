//! Friction laws and numbers as text of a generated file.

use crate::robot::model::JointFriction;

/// A number that reads back bit for bit.
pub(crate) fn exact(x: f64) -> String {
    format!("{x:?}")
}

/// The declared friction law of a joint at the speed `v`.
pub(crate) fn law(law: &JointFriction, v: &str) -> String {
    match law {
        JointFriction::None => "0.0".to_owned(),
        JointFriction::ViscousCoulomb(law) => format!(
            "{} * {v} + {} * $sign({v})",
            exact(law.viscous),
            exact(law.coulomb)
        ),
        JointFriction::DoubleTanh(law) => format!(
            "{} * {v} + {} * tanh({} * {v}) + {} * tanh({} * {v})",
            exact(law.viscous),
            exact(law.coulomb_1),
            exact(law.slope_1),
            exact(law.coulomb_2),
            exact(law.slope_2)
        ),
    }
}
