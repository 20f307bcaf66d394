//! Motor forces by a zero-order hold, brought to the time and pose of each row.
//!
//! Amplifiers hold their voltage until the next sample. Where motors act on the joints through a
//! linkage, a constant force is no constant joint torque: the joint torque that is logged at one pose
//! turns into another as the arm moves. At 2 rad/s and 1 kHz the difference is a thousandth of the
//! torque, which biases small parameters by many standard deviations.

use crate::block::Block;
use crate::robot::Robot;

/// Forms, row by row, the torque at the row's pose of the mean of the forces before and after its
/// instant.
#[derive(Debug, Clone)]
pub struct ZeroOrderHold {
    /// Pose and torque of the row before, as logged; empty before the first.
    pose: Vec<f64>,
    torque: Vec<f64>,
    carried: Vec<f64>,
}

impl ZeroOrderHold {
    /// For a robot of `joints` joints.
    pub fn new(joints: usize) -> Self {
        ZeroOrderHold {
            pose: Vec::with_capacity(joints),
            torque: Vec::with_capacity(joints),
            carried: vec![0.0; joints],
        }
    }

    /// Changes the torques of a block. The first row of a log keeps its own; the first after a gap
    /// is off by the force before it, and lies in the stretch's end that the filters leave off.
    pub fn centre(&mut self, robot: &Robot, block: &mut Block) {
        let n = self.carried.len();
        for (q, tau) in block.q.chunks_exact(n).zip(block.tau.chunks_exact_mut(n)) {
            if self.pose.is_empty() {
                self.pose.resize(n, 0.0);
                self.torque.extend_from_slice(tau);
                self.pose.copy_from_slice(q);
            }
            let transmission = robot.transmission();
            transmission.carry_torque(&self.pose, q, &self.torque, &mut self.carried);
            self.pose.copy_from_slice(q);
            self.torque.copy_from_slice(tau);
            for (t, before) in tau.iter_mut().zip(&self.carried) {
                *t = 0.5 * (*t + before);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::JointKind;
    use crate::robot::cft::actuation::forces_to_torques;
    use crate::robot::cft::{LaboratorySetup, ParameterStructure};

    #[test]
    fn constant_forces_are_the_torque_of_the_row_s_own_pose() {
        let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
        let force = [-250.0, 60.0, 3.0, 40.0];
        let mut block = Block::default();
        for k in 0..5 {
            let q = [
                0.3,
                0.1,
                0.4 + 0.01 * f64::from(k),
                1.5 - 0.02 * f64::from(k),
            ];
            block.t.push(f64::from(k) * 1e-3);
            block.q.extend(q);
            block.tau.extend(forces_to_torques(&q, &force));
        }
        let logged = block.tau.clone();
        ZeroOrderHold::new(4).centre(&robot, &mut block);
        for (a, b) in block.tau.iter().zip(&logged) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn on_a_joint_of_its_own_it_is_the_mean_of_neighbours_across_blocks() {
        let robot = Robot::single_joint("q1", JointKind::Prismatic);
        let mut hold = ZeroOrderHold::new(1);
        let mut block = |tau: &[f64]| {
            let mut b = Block {
                t: vec![0.0; tau.len()],
                q: vec![0.0; tau.len()],
                tau: tau.to_vec(),
                ..Block::default()
            };
            hold.centre(&robot, &mut b);
            b.tau
        };
        assert_eq!(block(&[1.0, 3.0]), [1.0, 2.0]);
        assert_eq!(block(&[5.0, 5.0]), [4.0, 5.0]);
    }
}
