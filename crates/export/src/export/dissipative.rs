//! Friction as simulators take it: coefficients that are not below zero, and what that leaves out.
//!
//! A coefficient of a fitted law may be negative where its terms together take power over the speeds of
//! the logs; damping below zero alone drives a simulated joint away, and formats do not allow it.

use cft_ident_core::number;
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_files::config::ModelFile;

/// Viscous friction and its level while the joint moves fast \[N s/m or Nm s/rad, N or Nm\].
pub(super) fn damping_and_friction(law: &JointFriction) -> [f64; 2] {
    match law {
        JointFriction::None => [0.0; 2],
        JointFriction::ViscousCoulomb(law) => [law.viscous, law.coulomb],
        JointFriction::DoubleTanh(law) => [law.viscous, law.coulomb_1 + law.coulomb_2],
    }
}

/// Damping and friction of joint j, not below zero; `None` where its law is another one.
pub(super) fn dissipative(model: &Model, j: usize) -> Option<[f64; 2]> {
    match model.friction.get(j)? {
        JointFriction::ViscousCoulomb(law) => Some([law.viscous, law.coulomb].map(|x| x.max(0.0))),
        _ => None,
    }
}

/// What a file of links cannot say truly, as sentences: friction and drive inertias below zero.
pub fn below_zero(file: &ModelFile, model: &Model) -> Vec<String> {
    let names = model.robot.joint_names();
    let told = |name: &str, joint: Option<&str>, value: f64| {
        let parameter = file.find(name, joint);
        let std = parameter.and_then(|p| p.std).unwrap_or(f64::NAN);
        let (value, std) = number::value_and_std(value, std);
        let unit = parameter.map_or("", |p| p.unit.as_str());
        format!("{value} +- {std} {unit}")
    };
    let mut out = Vec::new();
    for (joint, law) in names.iter().zip(&model.friction) {
        let JointFriction::ViscousCoulomb(law) = law else {
            continue;
        };
        for (name, value) in ViscousCoulomb::NAMES.iter().zip([law.viscous, law.coulomb]) {
            if value < 0.0 {
                out.push(format!(
                    "the {name} friction of {joint} is {}, which would drive it: the file has 0",
                    told(name, Some(joint), value)
                ));
            }
        }
    }
    for j in model.robot.standard_map().drives {
        let name = format!("Ia{}", j + 1);
        let found = file.find(&name, None).filter(|p| p.value < 0.0);
        if let (Some(p), Some(joint)) = (found, names.get(j)) {
            out.push(format!(
                "the drive inertia of {joint} is {}, and no drive has one below zero: fit with `lsq --feasible`",
                told(&name, None, p.value)
            ));
        }
    }
    out
}
