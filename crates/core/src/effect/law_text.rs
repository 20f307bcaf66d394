//! Friction laws and numbers as text of a generated file.

use crate::robot::model::JointFriction;

/// A number that reads back bit for bit.
pub fn exact(x: f64) -> String {
    format!("{x:?}")
}

/// The declared friction law of a joint at the speed `v`.
pub fn law(law: &JointFriction, v: &str) -> String {
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

/// What a law's torque changes with each of its parameters, in their order.
pub fn slopes(law: &JointFriction, v: &str) -> Vec<String> {
    match law {
        JointFriction::None => Vec::new(),
        JointFriction::ViscousCoulomb(_) => vec![v.to_owned(), format!("$sign({v})")],
        JointFriction::DoubleTanh(law) => {
            let tanh = |slope: f64| format!("tanh({} * {v})", exact(slope));
            let [t1, t2] = [law.slope_1, law.slope_2].map(tanh);
            let by_slope =
                |coulomb: f64, t: &str| format!("{} * {v} * (1.0 - {t} * {t})", exact(coulomb));
            let [s1, s2] = [by_slope(law.coulomb_1, &t1), by_slope(law.coulomb_2, &t2)];
            vec![v.to_owned(), t1, t2, s1, s2]
        }
    }
}
