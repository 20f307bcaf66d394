//! The masses of the robot file as a yardstick of its torques: how many times their weight the torques show.

use nalgebra::{DMatrix, DVector};

use super::LIMITS;
use super::channels::Carried;
use super::correction::Correction;
use super::problem::Problem;

/// Standard deviations to the ends of a 95 % interval.
const TWO_SIDED: f64 = 1.96;
/// Weight, what moves the masses, friction of two kinds, a constant, and the torque.
const WIDTH: usize = 6;

/// The measured weight over that of the file's masses.
#[derive(Debug, Clone, PartialEq)]
pub struct Weight {
    pub joint: usize,
    pub gain: f64,
    pub interval_95: [f64; 2],
    /// What changes of the weight by the file's masses, over the torque by them.
    pub share: f64,
}

/// The weight that each joint shows, beside friction and a constant; joints that hold next to none are left out.
pub(super) fn weights(problem: &Problem, rows: &[usize]) -> Vec<Weight> {
    let Some(theta) = &problem.known.inertial else {
        return Vec::new();
    };
    let (robot, n) = (problem.robot, problem.robot.joints());
    let by = Correction::none(n);
    let mix = problem.channels.mix(&by);
    let (mut carried, still) = (Carried::new(n), vec![0.0; n]);
    let (mut whole, mut weight) = (vec![0.0; n], vec![0.0; n]);
    let mut grams = vec![vec![DMatrix::<f64>::zeros(WIDTH, WIDTH); n]; LIMITS.blocks];
    for (i, &k) in rows.iter().enumerate() {
        if !problem
            .channels
            .carry(robot, problem.sample.row(k), &by, &mut carried)
        {
            continue;
        }
        robot.torque(theta, &carried.q, &still, &still, &mut weight);
        robot.torque(theta, &carried.q, &carried.v, &carried.a, &mut whole);
        for j in 0..n {
            let tau: f64 = (0..n).map(|c| carried.tau[j * n + c] * mix[j][c]).sum();
            let moves = whole[j] - weight[j];
            let own = [weight[j], moves, carried.v[j], carried.sign[j], 1.0, tau];
            let x = DVector::from_row_slice(&own);
            grams[i * LIMITS.blocks / rows.len()][j] += &x * x.transpose();
        }
    }
    let of = |j: usize| -> Option<Weight> {
        let total = grams
            .iter()
            .fold(DMatrix::zeros(WIDTH, WIDTH), |sum, block| sum + &block[j]);
        let varies = total[(0, 0)] - total[(0, 4)].powi(2) / total[(4, 4)];
        let by_masses = total[(0, 0)] + total[(1, 1)] + 2.0 * total[(0, 1)];
        let share = (varies.max(0.0) / by_masses).sqrt();
        let gain = gain(&total)?;
        let without: Vec<f64> = (grams.iter())
            .filter_map(|block| self::gain(&(&total - &block[j])))
            .collect();
        let count = without.len() as f64;
        let mean = without.iter().sum::<f64>() / count;
        let scatter: f64 = without.iter().map(|x| (x - mean).powi(2)).sum();
        let std = (scatter * (count - 1.0) / count).sqrt();
        let told = problem.moving()[j] && std.is_finite() && share.is_finite();
        told.then_some(Weight {
            joint: j,
            gain,
            interval_95: [gain - TWO_SIDED * std, gain + TWO_SIDED * std],
            share,
        })
    };
    (0..n).filter_map(of).collect()
}

/// The gain of the first column beside the others.
fn gain(gram: &DMatrix<f64>) -> Option<f64> {
    let c = WIDTH - 1;
    let mut normal = gram.view((0, 0), (c, c)).into_owned();
    for i in 0..c {
        normal[(i, i)] = normal[(i, i)] * (1.0 + 1e-9) + f64::MIN_POSITIVE.sqrt();
    }
    let right = gram.view((0, c), (c, 1)).into_owned();
    Some(normal.cholesky()?.solve(&right)[0])
}
