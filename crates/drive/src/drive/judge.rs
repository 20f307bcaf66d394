//! Deviations by the jackknife over blocks of motions and gains, and what a step must be sure of.
//!
//! A block left out is one Newton step on the sums of the others. F = a^2 / V, and a step needs F above c, which chance
//! exceeds as rarely as F(1, 23) exceeds 25 (Hotelling): s = max(0, 1 - c / F).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::fit::{PieceSums, solve_free};
use super::unknown::DriveUnknown;

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct JudgeNumbers {
    /// Deviations of one number in 24 blocks that a step needs; other numbers of blocks as unlikely by chance. Half: noise
    /// is written; twice: effects of a third of the error are passed over.
    pub deviations: f64,
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
    deviations: 5.0,
    confirmed: 0.8,
    blocks: 8,
    screen: 1.0,
    noticeable: 0.02,
    steps: 6,
};

/// c of k numbers in n blocks; infinite where n blocks do not suffice.
pub fn floor(k: usize, n: f64) -> f64 {
    let usual = FisherSnedecor::new(1.0, 23.0);
    let squared = NUMBERS.deviations * NUMBERS.deviations;
    let level = usual.map_or(0.0, |law| law.sf(squared));
    let k = k as f64;
    match FisherSnedecor::new(k, n - k) {
        Ok(law) if n > k + 1.0 => (n - 1.0) / (n - k) * law.inverse_cdf(1.0 - level),
        _ => f64::INFINITY,
    }
}

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
        let n = blocks.len() as f64;
        let mut changes = Vec::with_capacity(blocks.len());
        let mut covariance = DMatrix::zeros(p, p);
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
            covariance += (n - 1.0) / n * &change * change.transpose();
            changes.push(change);
        }
        BlockJackknife {
            changes,
            covariance,
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
        let freedom = self.changes.len() as f64 - 1.0;
        StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |law| law.inverse_cdf(0.975))
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
    pub fn new(amplitude: &DVector<f64>, v: DMatrix<f64>, blocks: usize) -> Self {
        let k = amplitude.len();
        let floor = match blocks >= NUMBERS.blocks && k > 0 {
            true => floor(k, blocks as f64),
            false => f64::INFINITY,
        };
        let sizes: Vec<f64> = (0..k).map(|i| v[(i, i)].sqrt()).collect();
        let unit = DMatrix::from_fn(k, k, |a, b| v[(a, b)] / (sizes[a] * sizes[b]));
        let scaled = DVector::from_fn(k, |a, _| amplitude[a] / sizes[a]);
        let f = match unit.cholesky() {
            Some(root) => scaled.dot(&root.solve(&scaled)) / k.max(1) as f64,
            None => 0.0,
        };
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

/// Losses are not smaller, for logarithms.
const TINY: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_twenty_five_for_one_number_in_24_blocks_and_more_in_fewer() {
        assert!((floor(1, 24.0) - 25.0).abs() < 1e-6);
        for (k, n, expected) in [
            (2, 24.0, 17.0),
            (4, 24.0, 13.0),
            (1, 12.0, 42.0),
            (2, 12.0, 35.0),
        ] {
            let c = floor(k, n);
            assert!((c - expected).abs() < 1.0, "{k} {n}: {c}");
        }
        assert!(floor(3, 3.0).is_infinite());
    }
}
