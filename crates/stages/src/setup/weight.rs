//! The masses of the robot file as a yardstick of its torques: how many times their weight the torques show.

use nalgebra::{DMatrix, DVector};

use super::LIMITS;
use super::channels::Carried;
use super::correction::Correction;
use super::physics::jackknife;
use super::problem::Problem;
use cft_ident_core::judge::{BlockSums, BlocksLeftOut, Bound, NUMBERS, Term, Terms};

/// Standard deviations to the ends of a 95 % interval.
pub(super) const TWO_SIDED: f64 = 1.96;
/// Weight, what moves the masses, friction of two kinds.
const COLUMNS: usize = 4;

/// A measured part of a torque over that of the file's masses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightGain {
    pub value: f64,
    pub interval_95: [f64; 2],
}

/// The measured weight over that of the file's masses, and what moves them likewise.
#[derive(Debug, Clone, PartialEq)]
pub struct Weight {
    pub joint: usize,
    pub weight: WeightGain,
    pub motion: WeightGain,
}

impl WeightGain {
    /// Whether it is another one than by the masses, too small (-1) or too large (1).
    pub fn is_off(&self, way: f64) -> bool {
        let [low, high] = self.interval_95;
        match way < 0.0 {
            true => low.abs().max(high) * LIMITS.yardstick < 1.0,
            false => low > LIMITS.yardstick,
        }
    }

    /// Whether it is surely not so small (-1) or so large (1).
    pub fn is_not_off(&self, way: f64) -> bool {
        let [low, high] = self.interval_95;
        match way < 0.0 {
            true => low * LIMITS.yardstick > 1.0,
            false => high < LIMITS.yardstick,
        }
    }
}

/// The weight that each joint shows beside friction; joints that hold next to none of it by the masses are left out.
pub(super) fn weights(problem: &Problem) -> Vec<Weight> {
    let Some(theta) = &problem.known.inertial else {
        return Vec::new();
    };
    let (robot, n) = (problem.robot, problem.robot.joints());
    let by = Correction::none(n);
    let mix = problem.channels.mix(&by);
    let (mut carried, still) = (Carried::new(n), vec![0.0; n]);
    let (mut whole, mut weight) = (vec![0.0; n], vec![0.0; n]);
    let mut sums = BlockSums::zeros(problem.blocks.list.len(), &vec![COLUMNS; n]);
    for (grams, block) in sums.blocks.iter_mut().zip(&problem.blocks.list) {
        for k in block.pieces.iter().flat_map(|(_, rows)| rows.clone()) {
            if !(problem.channels).carry(robot, problem.sample.row(k), &by, &mut carried) {
                continue;
            }
            robot.torque(theta, &carried.q, &still, &still, &mut weight);
            robot.torque(theta, &carried.q, &carried.v, &carried.a, &mut whole);
            for j in 0..n {
                let tau: f64 = (0..n).map(|c| carried.tau[j * n + c] * mix[j][c]).sum();
                let moves = whole[j] - weight[j];
                let own = [weight[j], moves, carried.v[j], carried.sign[j], tau];
                let x = DVector::from_row_slice(&own);
                grams[j] += &x * x.transpose();
            }
        }
    }
    let term = |at: usize| Term {
        columns: vec![(at / COLUMNS, at % COLUMNS)],
        bound: Bound::NONE,
    };
    let terms = Terms {
        list: (0..n * COLUMNS).map(term).collect(),
        weights: vec![1.0; n],
        prior: (DMatrix::zeros(0, 0), DVector::zeros(0)),
        ridge: NUMBERS.ridge,
    };
    let Some(left_out) = BlocksLeftOut::new(&sums, 0, &terms) else {
        return Vec::new();
    };
    let total = sums.over(0..sums.blocks.len());
    let gain = |at: usize| {
        let values: Vec<f64> = left_out.values().map(|x| x[at]).collect();
        let (value, std) = jackknife(&values);
        WeightGain {
            value,
            interval_95: [-TWO_SIDED, TWO_SIDED].map(|k| value + k * std),
        }
    };
    let of = |joint: usize| {
        let sums = &total[joint];
        let by_masses = sums[(0, 0)] + sums[(1, 1)] + 2.0 * sums[(0, 1)];
        let holds = sums[(0, 0)] > LIMITS.same * by_masses && problem.moving[joint];
        holds.then(|| Weight {
            joint,
            weight: gain(joint * COLUMNS),
            motion: gain(joint * COLUMNS + 1),
        })
    };
    (0..n).filter_map(of).collect()
}
