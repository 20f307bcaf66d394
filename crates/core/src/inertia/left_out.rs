//! The plain fit and the physically consistent one on blocks that neither has seen.

use nalgebra::DVector;

use super::accumulate::{self, BlockFactor, BlockFactors};
use super::feasible::{ConsistencyProblem, FeasibleParameters, feasible};
use super::solution::{FitError, joints, solve, stacked};
use crate::judge::{NUMBERS, compare};

/// Blocks that are left out one after the other.
const BLOCKS: usize = 10;
/// Fewest blocks whose scatter says something.
const FEWEST: usize = 4;

/// What both leave of a joint's torque on blocks left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialLeftOut {
    /// Residual over torque, fractions.
    pub plain: f64,
    pub consistent: f64,
    /// Whether the consistent fit leaves more by more than chance.
    pub costs: bool,
}

/// What both leave on blocks of these logs.
#[derive(Debug, Clone, PartialEq)]
pub struct FitsOnLeftOut {
    pub joints: Vec<TrialLeftOut>,
    /// Whether the plain fit leaves less of all joints, each in units of its noise, by more than chance.
    pub plain_wins: bool,
    /// The same where whole logs are left out, each of another motion; none of a single log.
    pub plain_wins_on_other_logs: Option<bool>,
}

impl FitsOnLeftOut {
    /// Whether the plain fit is the better one on blocks left out and on other logs too.
    pub fn plain_is_better(&self) -> bool {
        self.plain_wins && self.plain_wins_on_other_logs == Some(true)
    }
}

impl BlockFactors {
    /// The same rows in about [`BLOCKS`] parts, each of neighbouring blocks of one log.
    pub fn in_parts(&self) -> Vec<BlockFactor> {
        let logs = self.blocks.last().map_or(1, |block| block.log + 1);
        let rows: u64 = self.blocks.iter().map(|block| block.rows).sum();
        let each = (rows / BLOCKS.max(logs) as u64).max(1);
        let mut parts: Vec<Vec<&BlockFactor>> = Vec::new();
        for block in &self.blocks {
            let open = parts.last_mut().filter(|part| {
                part[0].log == block.log && part.iter().map(|b| b.rows).sum::<u64>() < each
            });
            match open {
                Some(part) => part.push(block),
                None => parts.push(vec![block]),
            }
        }
        let joined = |blocks: &Vec<&BlockFactor>| {
            let of_joint = |j: usize| {
                let parts = blocks.iter().map(|b| &b.r[j]);
                accumulate::stacked(parts, self.columns.row_width(j)).short()
            };
            BlockFactor {
                log: blocks[0].log,
                stretch: blocks[0].stretch,
                rows: blocks.iter().map(|b| b.rows).sum(),
                r: (0..self.columns.joints).map(of_joint).collect(),
                ..BlockFactor::default()
            }
        };
        parts.iter().map(joined).collect()
    }
}

/// Both fits by the blocks that `keep` names; nothing where those determine none.
fn both(
    factors: &BlockFactors,
    parts: &[BlockFactor],
    keep: &dyn Fn(&BlockFactor, usize) -> bool,
    weights: &[f64],
    task: &ConsistencyProblem,
) -> Result<[DVector<f64>; 2], FitError> {
    let blocks = parts.iter().enumerate();
    let blocks = blocks.filter(|(k, part)| keep(part, *k));
    let kept = BlockFactors {
        blocks: blocks.map(|(_, part)| part.clone()).collect(),
        ..factors.without_blocks()
    };
    let joints = joints(&kept)?;
    let plain = solve(&kept, &joints, weights, None)?.theta;
    let mut rows = stacked(&kept, &joints, weights, None);
    let u = plain.len();
    let towards = rows.columns(0, u) * &plain;
    rows.set_column(u, &towards);
    let FeasibleParameters { theta, .. } = feasible(&ConsistencyProblem {
        factor: &rows,
        ..*task
    })?;
    Ok([plain, theta])
}

/// Tries both fits on parts of the rows left out ([`BlockFactors::in_parts`]), with the weights and what is known of
/// bodies of the fit itself. Nothing where the parts are too few.
///
/// # Errors
/// [`FitError`].
pub fn left_out(
    factors: &BlockFactors,
    parts: &[BlockFactor],
    weights: &[f64],
    task: &ConsistencyProblem,
) -> Result<Option<FitsOnLeftOut>, FitError> {
    if parts.len() < FEWEST {
        return Ok(None);
    }
    // squares by both fits, [fit][part][joint]
    let tried = |by_log: bool| -> Result<[Vec<Vec<f64>>; 2], FitError> {
        let mut squares = [Vec::new(), Vec::new()];
        let mut of_log: Option<(usize, [DVector<f64>; 2])> = None;
        for (k, part) in parts.iter().enumerate() {
            let fits = match of_log.take().filter(|(log, _)| by_log && *log == part.log) {
                Some((_, fits)) => fits,
                None => {
                    let keep = |other: &BlockFactor, at: usize| match by_log {
                        true => other.log != part.log,
                        false => at != k,
                    };
                    both(factors, parts, &keep, weights, task)?
                }
            };
            for (squares, theta) in squares.iter_mut().zip(&fits) {
                let square = |j: usize| {
                    let own = factors.own_unknowns(theta, j);
                    factors.parts(&part.r[j], j).residual_square(&own)
                };
                squares.push((0..factors.columns.joints).map(square).collect());
            }
            of_log = Some((part.log, fits));
        }
        Ok(squares)
    };
    let inverse: Vec<f64> = weights.iter().map(|w| w * w).collect();
    let gain = |[plain, consistent]: &[Vec<Vec<f64>>; 2]| compare(consistent, plain, &inverse);
    let squares = tried(false)?;
    let of_blocks = gain(&squares);
    let of_joint = |j: usize| {
        let torque = factors.moving[j].torque_square.max(f64::MIN_POSITIVE);
        let left = |which: usize| squares[which].iter().map(|part| part[j]).sum::<f64>();
        let [value, se] = of_blocks.joints[j];
        TrialLeftOut {
            plain: (left(0) / torque).sqrt(),
            consistent: (left(1) / torque).sqrt(),
            costs: value > NUMBERS.screen * se,
        }
    };
    let several = parts.iter().any(|part| part.log != parts[0].log);
    // what one log alone does not determine is not tried
    let others = several.then(|| tried(true).ok()).flatten();
    let beyond = |squares: &[Vec<Vec<f64>>; 2]| gain(squares).is_beyond(NUMBERS.screen, None);
    Ok(Some(FitsOnLeftOut {
        joints: (0..factors.columns.joints).map(of_joint).collect(),
        plain_wins: beyond(&squares),
        plain_wins_on_other_logs: others.as_ref().map(beyond),
    }))
}
