//! How likely the sizes are that a set-up gives to motions and torques: what is logged in another unit turns a joint
//! hundreds of times in a log, or by nothing, or needs a thousand times the torque of its neighbours.

use super::channels::Drive;
use super::correction::Correction;
use super::normal::Problem;
use cft_ident_core::robot::JointKind;

/// Travel of a joint in a log that excites it \[rad\]: within these every one is as likely.
const TRAVEL: [f64; 2] = [0.2, 8.0];
/// Logarithm of the ratio of a joint's torque to the middle one's: within this every one is as likely.
const TORQUE: f64 = 3.4;
/// Most that one size says ..
const MOST: f64 = 7.0;
/// .. but for a joint that turns hundreds of times.
const MANY_TURNS: f64 = 12.0;

/// Log-probability of the sizes under a correction, 0 where all are usual: e^(-x^2 / 2) at e^x times a usual one.
pub(super) fn sizes(problem: &Problem, by: &Correction) -> f64 {
    if problem.channels.drive != Drive::Joints {
        return 0.0;
    }
    let (sample, n) = (&problem.sample, problem.sample.joints);
    let turns =
        |j: &usize| problem.moving()[*j] && problem.robot.joint_kind(*j) == JointKind::Revolute;
    let joints: Vec<usize> = (0..n).filter(turns).collect();
    if joints.len() < 2 {
        return 0.0;
    }
    let travel = |j: usize| {
        let factor = problem.channels.position_factor(by, j).abs();
        factor * sample.travel(by.position_from[j])
    };
    let rms = sample.rms(&sample.tau);
    let mix = problem.channels.mix(by);
    let torque = |j: usize| {
        let parts = mix[j].iter().zip(&rms);
        parts.map(|(m, x)| (m * x).powi(2)).sum::<f64>().sqrt()
    };
    let mut torques: Vec<f64> = joints.iter().map(|j| torque(*j).max(1e-300).ln()).collect();
    torques.sort_by(f64::total_cmp);
    let middle = torques[torques.len() / 2];
    let of_torques = match joints.len() > 2 {
        true => (torques.iter())
            .map(|x| beyond((x - middle).abs() - TORQUE).max(-MOST))
            .sum::<f64>(),
        // of two nobody knows which is right
        false => 0.0,
    };
    let of_travel = |j: &usize| {
        let travel = travel(*j).max(1e-300);
        let (many, little) = ((travel / TRAVEL[1]).ln(), (TRAVEL[0] / travel).ln());
        beyond(many).max(-MANY_TURNS) + beyond(little).max(-MOST)
    };
    of_torques + joints.iter().map(of_travel).sum::<f64>()
}

fn beyond(x: f64) -> f64 {
    -0.5 * x.max(0.0).powi(2)
}
