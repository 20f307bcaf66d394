//! Deviations by the jackknife over blocks of motions and gains, and what a step must be sure of.
//!
//! A block left out is one Newton step on the sums of the others. F = a^2 / V, and a step needs F above c, which chance
//! exceeds as rarely as F(1, 23) exceeds 25 (Hotelling): s = max(0, 1 - c / F).

use cft_ident_core::judge::{hotelling, hotelling_floor, jackknife, width_95};
use nalgebra::{DMatrix, DVector};

use super::fit::{PieceSums, solve_free};
use super::unknown::DriveUnknown;

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct JudgeNumbers {
    /// From this s on a step is confirmed. Half: a step of seven deviations is; .9: the delay of a measured servo is not.
    pub confirmed: f64,
    /// Fewest blocks that judge. Half: four logs agree by chance; twice: a servo at three gains has too few.
    pub blocks: usize,
    /// A gain on blocks left out counts above so many standard errors, to be judged then. Half: noise is fitted and judged;
    /// twice: a limit that few blocks reach is passed over.
    pub screen: f64,
    /// A step removes at least this part of the error. Half: steps of no size; twice: a third of a small one is lost.
    pub noticeable: f64,
    /// Most steps. Twice: the last ones fit what is left of the first.
    pub steps: usize,
}

pub const NUMBERS: JudgeNumbers = JudgeNumbers {
    confirmed: 0.8,
    blocks: 8,
    screen: 1.0,
    noticeable: 0.02,
    steps: 6,
};

/// Changes of the unknowns by each block left out.
#[derive(Debug, Clone)]
pub struct BlockJackknife {
    /// Unknown by unknown, block by block.
    pub changes: Vec<DVector<f64>>,
    pub covariance: DMatrix<f64>,
    /// What is free: the others stand at a bound, or are not seen.
    pub free: Vec<bool>,
}

impl BlockJackknife {
    /// At a fitted point.
    pub fn new(unknowns: &[DriveUnknown], values: &[f64], blocks: &[PieceSums]) -> Self {
        let p = unknowns.len();
        let mut total = PieceSums::zero(p);
        for block in blocks {
            total.add(block);
        }
        let bounds: Vec<[f64; 2]> = unknowns.iter().map(DriveUnknown::bounds).collect();
        let free: Vec<bool> = (0..p)
            .map(|i| total.h[(i, i)] > 0.0 && values[i] > bounds[i][0] && values[i] < bounds[i][1])
            .collect();
        let at: Vec<usize> = (0..p).filter(|i| free[*i]).collect();
        let mut changes = Vec::with_capacity(blocks.len());
        for block in blocks {
            let mut rest = total.clone();
            rest.h -= &block.h;
            rest.g -= &block.g;
            let mut change = DVector::zeros(p);
            if let Some(step) = solve_free(&rest, &at, 0.0) {
                for (i, step) in at.iter().zip(step.iter()) {
                    let [low, high] = bounds[*i];
                    change[*i] = (values[*i] + step).clamp(low, high) - values[*i];
                }
            }
            changes.push(change);
        }
        BlockJackknife {
            covariance: jackknife(&DVector::zeros(p), &changes),
            changes,
            free,
        }
    }

    /// Standard deviation of an unknown; none where it is at a bound.
    pub fn std(&self, i: usize) -> Option<f64> {
        let std = self.covariance[(i, i)].sqrt();
        (self.free[i] && std > 0.0 && std.is_finite()).then_some(std)
    }

    /// How far a 95 % interval reaches, in standard deviations.
    pub fn reach(&self) -> f64 {
        width_95(self.changes.len())
    }

    /// Loss of every block by the unknowns of the others.
    pub fn left_out(&self, blocks: &[PieceSums]) -> Vec<f64> {
        let pairs = blocks.iter().zip(&self.changes);
        pairs.map(|(block, change)| block.loss_at(change)).collect()
    }
}

/// What the judge says of the numbers of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgedDriveEffect {
    /// sqrt F: amplitude over its deviation, where it is one number.
    pub deviations: f64,
    /// c: the square of what would do.
    pub floor: f64,
    /// s.
    pub shrinkage: f64,
}

impl JudgedDriveEffect {
    /// Of amplitudes with covariance V in so many blocks: F = a' V^-1 a / k.
    pub fn new(amplitude: &DVector<f64>, v: &DMatrix<f64>, blocks: usize) -> Self {
        let k = amplitude.len();
        let floor = match blocks >= NUMBERS.blocks && k > 0 {
            true => hotelling_floor(k, blocks),
            false => f64::INFINITY,
        };
        let f = hotelling(amplitude, v);
        JudgedDriveEffect {
            deviations: f.sqrt(),
            floor,
            shrinkage: if f > 0.0 {
                (1.0 - floor / f).max(0.0)
            } else {
                0.0
            },
        }
    }
}

/// Gain on blocks left out, and its standard error: the mean of ln(before / after), so that each block counts by its own
/// error and one that falls without a drive does not outweigh all others.
pub fn gain(before: &[f64], after: &[f64]) -> [f64; 2] {
    let n = before.len() as f64;
    let pairs = before.iter().zip(after);
    let gains: Vec<f64> = pairs
        .map(|(b, a)| (b.max(TINY) / a.max(TINY)).ln())
        .collect();
    let mean = gains.iter().sum::<f64>() / n;
    let spread: f64 = gains.iter().map(|g| (g - mean).powi(2)).sum();
    [mean, (spread / (n - 1.0) / n).sqrt()]
}

/// Whether a gain over another law, with its standard error, is none beyond chance: the two stand beside each other.
pub fn is_near([gain, se]: [f64; 2]) -> bool {
    gain < NUMBERS.screen * se
}

/// Losses are not smaller, for logarithms.
const TINY: f64 = 1e-12;
