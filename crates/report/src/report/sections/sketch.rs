//! The robot along its motion, with its joints coloured by error.

use super::first_of;
use crate::report::Writer;
use crate::report::figure::{Sketch, SketchJoint};
use cft_ident_stages::identify::LoggedRobot;
use cft_ident_stages::replay::Poses;

/// The section, with relative errors by joint; nothing without poses.
pub fn section(page: &mut Writer, machine: &LoggedRobot, of: Option<&Poses>, errors: &[f64]) {
    let Some(of) = of else { return };
    let joints = machine.robot.joint_names().iter().zip(&of.driven);
    let sketch = Sketch {
        title: format!("Joints by their error along {}", first_of(&of.logs)),
        joints: joints
            .enumerate()
            .map(|(j, (name, point))| SketchJoint {
                name: name.clone(),
                error: errors.get(j).copied().unwrap_or(f64::NAN),
                point: *point,
            })
            .collect(),
        parents: of.parents.clone(),
        poses: of.poses.clone(),
        way: of.way.clone(),
    };
    page.heading("The robot in motion");
    page.figures(&sketch.cells());
}
