//! Stretches of a log in which several joints leave many times their usual residual: something pushes the robot there.

use super::accumulate::{BlockFactor, BlockFactors};
use super::solution::FitError;
use super::solve::{Weighting, fit};

/// Numbers that decide what a jump is.
struct Limits {
    /// Share of the blocks that are fitted, those with the least residuals: as many others may be spoilt.
    fitted: f64,
    /// Times that the blocks to be fitted are chosen anew; each time their residuals fall.
    rounds: usize,
    /// A residual jumps to so many times the median of its joint. Half of it shows what models of real arms lack;
    /// a push that makes less than twice of it spoils a fit little.
    times: f64,
    /// So long at least \[s\]: a reversal is over sooner.
    seconds: f64,
    /// Of fewer blocks none is told from the others.
    blocks: usize,
}

const LIMITS: Limits = Limits {
    fitted: 0.7,
    rounds: 3,
    times: 8.0,
    seconds: 0.25,
    blocks: 40,
};

/// A stretch in which residuals jump.
#[derive(Debug, Clone, PartialEq)]
pub struct Jump {
    /// First and last time, as its rows have them \[s\].
    pub span: [f64; 2],
    /// Joints, and how many times the usual residual each of them has there.
    pub joints: Vec<(usize, f64)>,
}

/// The stretches of a log in which at least two joints jump; none of a single joint, whose torque has other reasons.
///
/// # Errors
/// [`FitError`].
pub fn jumps(factors: &BlockFactors) -> Result<Vec<Jump>, FitError> {
    let usable = |b: &&BlockFactor| b.span[1] > b.span[0] && b.scores.is_none();
    let blocks: Vec<&BlockFactor> = factors.blocks.iter().filter(usable).collect();
    if factors.columns.joints < 2 || blocks.len() < LIMITS.blocks {
        return Ok(Vec::new());
    }
    let mut kept: Vec<BlockFactor> = blocks.iter().map(|b| BlockFactor::clone(b)).collect();
    let mut ratios = Vec::new();
    for round in 0..=LIMITS.rounds {
        let part = BlockFactors {
            blocks: std::mem::take(&mut kept),
            ..factors.without_blocks()
        };
        let theta = fit(&part, Weighting::Wls)?.theta;
        ratios = over_median(factors, &blocks, &theta);
        if round == LIMITS.rounds {
            break;
        }
        let worst = |of: &Vec<f64>| of.iter().copied().fold(0.0, f64::max);
        let mut order: Vec<usize> = (0..blocks.len()).collect();
        order.sort_by(|a, b| worst(&ratios[*a]).total_cmp(&worst(&ratios[*b])));
        order.truncate((LIMITS.fitted * blocks.len() as f64) as usize);
        order.sort_unstable();
        kept = order.iter().map(|k| blocks[*k].clone()).collect();
    }
    Ok(joined(&blocks, &ratios))
}

/// Root mean square residual of each block and joint over the median of the joint; 0 where it does not move.
fn over_median(
    factors: &BlockFactors,
    blocks: &[&BlockFactor],
    theta: &nalgebra::DVector<f64>,
) -> Vec<Vec<f64>> {
    let n = factors.columns.joints;
    let mut all = vec![vec![0.0; n]; blocks.len()];
    for j in 0..n {
        let own = factors.own_unknowns(theta, j);
        let mut seen = Vec::with_capacity(blocks.len());
        for (block, out) in blocks.iter().zip(&mut all) {
            let r = &block.r[j];
            if r.iter().all(|x| *x == 0.0) {
                continue;
            }
            let square = factors.parts(r, j).residual_square(&own);
            out[j] = (square / block.rows.max(1) as f64).sqrt();
            seen.push(out[j]);
        }
        seen.sort_by(f64::total_cmp);
        let median = seen.get(seen.len() / 2).copied().unwrap_or(0.0);
        for out in &mut all {
            out[j] = if median > 0.0 { out[j] / median } else { 0.0 };
        }
    }
    all
}

/// Blocks that jump, those next to each other as one.
fn joined(blocks: &[&BlockFactor], ratios: &[Vec<f64>]) -> Vec<Jump> {
    let mut found: Vec<Jump> = Vec::new();
    for (block, ratios) in blocks.iter().zip(ratios) {
        let high = ratios
            .iter()
            .enumerate()
            .filter(|(_, r)| **r > LIMITS.times);
        let joints: Vec<(usize, f64)> = high.map(|(j, r)| (j, *r)).collect();
        if joints.len() < 2 {
            continue;
        }
        let length = block.span[1] - block.span[0];
        match found.last_mut() {
            Some(last) if block.span[0] - last.span[1] < 3.0 * length => {
                last.span[1] = block.span[1];
                for (j, ratio) in joints {
                    match last.joints.iter_mut().find(|(known, _)| *known == j) {
                        Some((_, most)) => *most = most.max(ratio),
                        None => last.joints.push((j, ratio)),
                    }
                }
            }
            _ => found.push(Jump {
                span: block.span,
                joints,
            }),
        }
    }
    for jump in &mut found {
        jump.joints.sort_by_key(|(j, _)| *j);
    }
    found.retain(|jump| jump.span[1] - jump.span[0] >= LIMITS.seconds);
    found
}
