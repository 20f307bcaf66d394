//! Parameters of the `joint_trajectory_controller` of ros2_control for joints that take efforts: gains that give each
//! joint the same bandwidth by its own inertia, and viscous friction fed forward.
//!
//! The controller sends p (q_d - q) + d (v_d - v) + ff v_d. With p = M w^2 and d + Bv = 2 M w a joint of inertia M and
//! viscous friction Bv follows without overshoot, w = 2 pi times the bandwidth. Gravity and Coulomb friction it does
//! not know.

use std::f64::consts::TAU;
use std::fmt::Write;

use super::ExportError;
use super::dissipative::damping_and_friction;
use cft_ident_core::robot::model::Model;

/// A joint as the controller knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlledJoint {
    /// Name on the controller's side.
    pub name: String,
    /// Position that the gains are for \[m or rad\].
    pub position: f64,
    /// Greatest effort, where the robot file limits it \[N or Nm\].
    pub effort: Option<f64>,
}

/// The parameter file, `head` as comments at its begin.
///
/// # Errors
/// [`ExportError::NoInertia`] where the model gives a joint none that a machine has.
pub fn parameters(
    model: &Model,
    joints: &[ControlledJoint],
    bandwidth_hz: f64,
    head: &[String],
) -> Result<String, ExportError> {
    let n = joints.len();
    let q: Vec<f64> = joints.iter().map(|joint| joint.position).collect();
    let still = vec![0.0; n];
    let (mut weight, mut tau) = (still.clone(), still.clone());
    let of = &model.robot;
    of.torque(&model.theta, &q, &still, &still, &mut weight);
    let w = TAU * bandwidth_hz;
    let names: Vec<String> = joints.iter().map(|joint| quoted(&joint.name)).collect();
    let mut text = String::new();
    for line in head {
        let _ = writeln!(text, "# {line}");
    }
    let _ = write!(
        text,
        "joint_trajectory_controller:\n  ros__parameters:\n    joints: [{}]\n    command_interfaces: [effort]\n    \
         state_interfaces: [position, velocity]\n    gains:\n",
        names.join(", ")
    );
    for (j, joint) in joints.iter().enumerate() {
        let mut a = still.clone();
        a[j] = 1.0;
        of.torque(&model.theta, &q, &still, &a, &mut tau);
        let inertia = tau[j] - weight[j];
        if !(inertia > 0.0 && inertia.is_finite()) {
            return Err(ExportError::NoInertia {
                joint: of.joint_names()[j].clone(),
                inertia,
            });
        }
        let [viscous, _] = damping_and_friction(&model.friction[j]).map(|x| x.max(0.0));
        let gains = [
            ("p", inertia * w * w),
            ("i", 0.0),
            ("d", (2.0 * inertia * w - viscous).max(0.0)),
            ("ff_velocity_scale", viscous),
        ];
        let _ = writeln!(text, "      {}:", names[j]);
        for (key, value) in gains {
            let _ = writeln!(text, "        {key}: {}", decimal(value));
        }
        if let Some(effort) = joint.effort {
            let (most, least) = (decimal(effort), decimal(-effort));
            let _ = writeln!(
                text,
                "        u_clamp_max: {most}\n        u_clamp_min: {least}"
            );
        }
    }
    Ok(text)
}

/// Six significant digits with a point and without an exponent, which every reader of YAML takes for a double.
fn decimal(x: f64) -> String {
    if x == 0.0 {
        return "0.0".to_owned();
    }
    let whole = x.abs().max(f64::MIN_POSITIVE).log10().floor();
    let places = (5.0 - whole).clamp(1.0, 12.0) as usize;
    format!("{x:.places$}")
}

fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    match name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(plain) {
        true => name.to_owned(),
        false => format!("{name:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_doubles_to_every_reader() {
        let shown = [0.0, 12.0, 0.000_123_456_7, 123_456.7, -1.5].map(decimal);
        let doubles = ["0.0", "12.0000", "0.000123457", "123456.7", "-1.50000"];
        assert_eq!(shown, doubles);
    }
}
