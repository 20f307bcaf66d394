//! The robot along its motion, with its joints coloured by error.

use crate::report::Writer;
use crate::report::figure::{PoseSketch, SketchJoint};
use crate::report::words::first_of;
use cft_ident_stages::identify::RobotSetup;
use cft_ident_stages::replay::TreePoses;

/// The section, with relative errors by joint; nothing without poses.
pub fn section(
    page: &mut Writer,
    setup: &RobotSetup,
    of: Option<&TreePoses>,
    errors: impl Iterator<Item = f64>,
) {
    let Some(of) = of else { return };
    let joints = setup.robot.joint_names().iter().zip(&of.driven);
    let errors = errors.chain(std::iter::repeat(f64::NAN));
    let sketch = PoseSketch {
        title: format!("Joints by their error along {}", first_of(&of.logs)),
        joints: (joints.zip(errors))
            .map(|((name, point), error)| SketchJoint {
                name: name.clone(),
                error,
                point: *point,
            })
            .collect(),
        parents: of.parents.clone(),
        poses: of.poses.clone(),
        way: of.way.clone(),
    };
    page.heading("The robot in motion");
    page.figures(sketch.cells());
}
