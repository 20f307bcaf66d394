//! Errors of a torque that is off by known amounts.

use super::*;
use crate::robot::Robot;
use crate::robot::cft::{LaboratorySetup, ParameterStructure};

const STEP: f64 = 1e-3;

fn model() -> Model {
    let robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::Printed12);
    Model {
        theta: vec![0.0; robot.parameters().len()],
        friction: vec![JointFriction::None; 4],
        offset: vec![0.0; 4],
        robot,
    }
}

/// Four joints that turn slowly, whose torques the model calls 0: joint j measures j + 1 all along.
fn log() -> Block {
    let mut block = Block::default();
    for k in 0..4000 {
        let t = f64::from(k) * STEP;
        block.t.push(t);
        for (j, at) in [0.35, 0.2, 0.9, 0.8].into_iter().enumerate() {
            block.q.push(at + 0.05 * (3.0 * t).sin());
            block.tau.push(j as f64 + 1.0);
        }
    }
    block
}

#[test]
fn each_joint_has_its_own_band_and_error_and_rows_are_counted_once_decimated() {
    let settings = FilterSettings {
        decimation: Some(10),
        ..FilterSettings::default()
    };
    let model = model();
    // the bands of joints 2 and 4 hold their torque of 2 and 4
    let band = |_: [&[f64]; 3], _: &[f64], out: &mut [f64]| {
        out.copy_from_slice(&[0.5, 2.5, 2.5, 4.5]);
    };
    let mut all = TorqueReconstruction::new(&model, &[-1.0; 4], Some(&band));
    let mut given = Some(log());
    let mut next = |block: &mut Block| -> Result<bool, std::convert::Infallible> {
        *block = given.take().unwrap_or_default();
        Ok(false)
    };
    let mut widths = Vec::new();
    let mut row = |r: &ReconstructedRow| widths = r.half_width.to_vec();
    let summary = all.add(&settings, &mut next, &mut row).unwrap();
    assert_eq!(summary.decimation, 10);
    assert_eq!(widths, [0.5, 2.5, 2.5, 4.5]);
    let found = all.finish(summary);
    for (j, joint) in found.errors.joints.iter().enumerate() {
        assert!((300..=400).contains(&joint.samples), "{joint:?}");
        assert!((joint.rmse - (j as f64 + 1.0)).abs() < 1e-6, "{joint:?}");
        let covered = [0.0, 1.0][j % 2];
        assert_eq!(joint.coverage_95, Some(covered), "{joint:?}");
    }
}
