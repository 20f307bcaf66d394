//! A single joint as a chain of one link, so that a URDF can hold it.
//!
//! The joint stands where gravity does nothing to it, which its model does not know either: it turns about
//! the vertical axis, or slides along a level one.

use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::model::Model;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::LinkBody;
use cft_ident_files::config::robot_file::ModelKind;
use cft_ident_files::config::serial_section::LinkSection;

const LINK: &str = "link";
/// Mass of a link that turns, of which nothing says \[kg\].
const TURNING_MASS: f64 = 1.0;
/// Square of the radius of gyration of a link that slides, likewise \[m^2\].
const SLIDING_SIZE: f64 = 1e-3;

/// The same model as a serial robot of one link: a ball of the inertia that was identified.
pub(super) fn chain(file: &ModelFile, model: &Model) -> (ModelFile, Model) {
    let kind = model.robot.joint_kind(0);
    let inertia = model.theta.first().copied().unwrap_or_default();
    let mut file = file.clone();
    let joint = file.robot.robot.joint.take();
    let (axis, mass, ball) = match kind {
        JointKind::Revolute => (None, TURNING_MASS, inertia),
        JointKind::Prismatic => (Some([1.0, 0.0, 0.0]), inertia, SLIDING_SIZE * inertia),
    };
    let section = &mut file.robot.robot;
    section.model = ModelKind::Serial;
    section.kind = None;
    section.drive_inertia = Some(false);
    section.link = vec![LinkSection {
        name: Some(LINK.to_owned()),
        joint,
        kind: (kind == JointKind::Prismatic).then_some(kind),
        xyz: Some([0.0; 3]),
        axis,
        ..LinkSection::default()
    }];
    file.links = vec![LinkBody {
        name: LINK.to_owned(),
        mass,
        centre: [0.0; 3],
        inertia: [ball, 0.0, 0.0, ball, 0.0, ball],
    }];
    file.drive_inertia.clear();
    file.parameters.retain(|p| p.joint.is_some());
    let model = Model {
        robot: file.robot.robot(),
        ..model.clone()
    };
    (file, model)
}
