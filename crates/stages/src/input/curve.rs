//! Friction over speed by a model file.

use cft_ident_core::friction::estimate::FrictionCurvePoint;
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::ModelFile;

/// The curve of a joint's law at these speeds; a law that jumps has a point that is not finite at 0.
pub fn friction_curve(
    file: &ModelFile,
    law: &JointFriction,
    joint: &str,
    speeds: impl Iterator<Item = f64>,
) -> Vec<FrictionCurvePoint> {
    let names: &[&str] = match law {
        JointFriction::None => return Vec::new(),
        JointFriction::DoubleTanh(_) => &DoubleTanh::NAMES,
        JointFriction::ViscousCoulomb(_) => &ViscousCoulomb::NAMES,
    };
    let keys: Vec<String> = names.iter().map(|n| format!("{n}:{joint}")).collect();
    let covariance = file.covariance_of(&keys);
    let jumps = matches!(law, JointFriction::ViscousCoulomb(_));
    speeds
        .map(|v| match v == 0.0 && jumps {
            true => FrictionCurvePoint {
                v: f64::NAN,
                torque: f64::NAN,
                std: f64::NAN,
            },
            false => FrictionCurvePoint {
                v,
                torque: law.torque(v),
                std: deviation(law, &covariance, v),
            },
        })
        .collect()
}

/// Standard deviation of F(v): the gradient through the covariance of the law's parameters.
fn deviation(law: &JointFriction, covariance: &[f64], v: f64) -> f64 {
    let n = law.parameters();
    let mut gradient = [0.0; 8];
    law.gradient(v, &mut gradient[..n]);
    let mut variance = 0.0;
    for i in 0..n {
        for j in 0..n {
            let entry = covariance.get(i * n + j).copied().unwrap_or(0.0);
            variance += gradient[i] * entry * gradient[j];
        }
    }
    variance.max(0.0).sqrt()
}
