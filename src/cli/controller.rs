//! What the file of a controller takes from a model and its robot file.

use super::CliError;
use cft_ident_core::explain::Explain;
use cft_ident_core::robot::model::Model;
use cft_ident_export::export::ros2_control::{ControlledJoint, parameters};
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_logs::log::escape;

/// Parameters of ros2_control's joint_trajectory_controller for gains of this bandwidth; `name` is that of the model.
pub(super) fn ros2_control(
    (name, file, model): (&str, &ModelFile, &Model),
    bandwidth_hz: f64,
    head: &[String],
) -> Result<String, CliError> {
    let mut limits = file.robot.limits.clone();
    file.travel_of_seen(&mut limits);
    let joint = |joint: &String| {
        let own = limits.get(joint);
        let Some([low, high]) = own.and_then(|own| own.position) else {
            let joint = escape(joint);
            return Err(CliError::input(format!(
                "{name}: the travel of {joint} is not known, in whose middle gains are computed"
            ))
            .hint(format!(
                "write `[limits.{joint}] position = [low, high]` into the model file"
            )));
        };
        let called = name_in_controller(&file.robot, joint);
        Ok(ControlledJoint {
            name: called.unwrap_or(joint).clone(),
            position: 0.5 * (low + high),
            effort: own.and_then(|own| own.torque),
        })
    };
    let names = model.robot.joint_names().iter();
    let joints = names.map(joint).collect::<Result<Vec<_>, _>>()?;
    let mut head = head.to_vec();
    head.push(format!(
        "Bandwidth {bandwidth_hz} Hz by the inertia in the middle of the travel; ff_velocity_scale is viscous friction."
    ));
    head.push(
        "NOT in here: gravity, Coulomb friction, effects. Add them to the effort of each joint from the C header."
            .to_owned(),
    );
    parameters(model, &joints, bandwidth_hz, &head)
        .map_err(|error| CliError::input(error.explanation().of(name)))
}

/// What the controller calls a joint, where it calls it otherwise.
fn name_in_controller<'a>(robot: &'a RobotFile, joint: &str) -> Option<&'a String> {
    robot.log.joint.get(joint)?.name.as_ref()
}
