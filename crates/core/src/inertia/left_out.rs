//! The plain fit and the physically consistent one on blocks that neither has seen.

use nalgebra::DVector;

use super::accumulate::{self, BlockFactor, BlockFactors};
use super::columns::JointTerm;
use super::feasible::{ConsistencyProblem, FeasibleParameters, feasible};
use super::solution::{FitError, joints, solve, stacked};
use crate::judge::{NUMBERS, compare};

/// The numbers that decide between the two fits.
struct LeftOutNumbers {
    /// Blocks of neighbours in time that are left out one after the other. Half: one block decides; twice: twice the time.
    in_time: usize,
    /// Fewest blocks whose scatter says something. Half: two blocks judge; twice: logs of half a minute are not judged.
    fewest: usize,
    /// Blocks of like speed, of which the faster third is predicted by a fit to the slower ones. Half: four squares give a
    /// scatter; twice: a block holds a second of a short log.
    by_speed: usize,
    /// Errors of the difference by which the plain fit must not be worse on the faster ones. None: chance takes it; twice:
    /// a fit that misses faster motions by half is in use.
    faster: f64,
    /// Part of a joint's torque from which on a fit that leaves it is no model of the joint. Half: a joint of rough friction
    /// counts; twice: none does.
    no_model: f64,
}

const LEFT_OUT: LeftOutNumbers = LeftOutNumbers {
    in_time: 10,
    fewest: 4,
    by_speed: 24,
    faster: 1.0,
    no_model: 0.5,
};

/// What both leave of a joint's torque on blocks left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialLeftOut {
    /// Residual over torque, fractions.
    pub plain: f64,
    pub consistent: f64,
    /// Whether the consistent fit leaves more by more than chance, and by what one would notice.
    pub costs: bool,
}

/// What both leave on blocks of these logs.
#[derive(Debug, Clone, PartialEq)]
pub struct FitsOnLeftOut {
    pub joints: Vec<TrialLeftOut>,
    /// Whether the plain fit leaves less of all joints, each in units of its noise, by more than chance.
    pub plain_wins: bool,
    /// Whether it leaves more of the fastest third of the blocks where both are fitted to the others; none where these
    /// do not determine them.
    pub plain_loses_faster: Option<bool>,
}

impl FitsOnLeftOut {
    /// Whether the plain fit is the better one: on blocks left out and not worse on faster ones, or of a joint that the
    /// consistent one is no model of.
    pub fn plain_is_better(&self) -> bool {
        self.plain_wins && self.plain_loses_faster == Some(false)
            || self.joints.iter().any(TrialLeftOut::is_no_model)
    }
}

impl TrialLeftOut {
    /// Whether the consistent fit leaves most of the joint's torque where the plain one does not.
    fn is_no_model(&self) -> bool {
        self.consistent > LEFT_OUT.no_model && self.plain < LEFT_OUT.no_model
    }
}

/// The rows of a fit in parts that can be left out.
#[derive(Debug, Clone, Default)]
pub struct FitParts {
    /// Each of neighbouring blocks of one log.
    pub in_time: Vec<BlockFactor>,
    /// Each of blocks of like speed, the slowest first.
    pub by_speed: Vec<BlockFactor>,
}

impl BlockFactors {
    /// The same rows in one block a log.
    pub fn in_logs(&self) -> BlockFactors {
        let blocks: Vec<&BlockFactor> = self.blocks.iter().collect();
        BlockFactors {
            blocks: self.joined(&blocks, 1, &|a, b| a.log == b.log),
            ..self.without_blocks()
        }
    }

    /// The same rows in parts that can be left out.
    pub fn in_parts(&self) -> FitParts {
        let logs = self.blocks.last().map_or(1, |block| block.log + 1);
        let in_time: Vec<&BlockFactor> = self.blocks.iter().collect();
        let mut by_speed: Vec<(f64, &BlockFactor)> =
            self.speeds().into_iter().zip(&self.blocks).collect();
        by_speed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let by_speed: Vec<&BlockFactor> = by_speed.into_iter().map(|(_, block)| block).collect();
        let one_log = |a: &BlockFactor, b: &BlockFactor| a.log == b.log;
        FitParts {
            in_time: self.joined(&in_time, LEFT_OUT.in_time.max(logs), &one_log),
            by_speed: self.joined(&by_speed, LEFT_OUT.by_speed, &|_, _| true),
        }
    }

    /// Speed of each block: the mean over the joints of its root mean square over that of the joint's fastest block.
    fn speeds(&self) -> Vec<f64> {
        let viscous = |j: usize| {
            let own = self.columns.own[j].iter();
            let mut own = own.enumerate().filter(|(_, t)| **t == JointTerm::Viscous);
            let own = own.next().map(|(k, _)| self.columns.shared + k);
            // the first of a known law is its viscous part
            let known = || {
                self.columns.known[j]
                    .as_ref()
                    .map(|_| self.columns.unknowns_of(j))
            };
            own.or_else(known)
        };
        let mut speeds = vec![0.0; self.blocks.len()];
        for (j, column) in (0..self.columns.joints).filter_map(|j| Some((j, viscous(j)?))) {
            let of_block = |b: &BlockFactor| b.r[j].column(column).norm() / (b.rows as f64).sqrt();
            let each: Vec<f64> = self.blocks.iter().map(of_block).collect();
            let fastest = each.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            for (speed, own) in speeds.iter_mut().zip(each) {
                *speed += own / fastest;
            }
        }
        speeds
    }

    /// Blocks in about so many parts of neighbours that may be joined.
    fn joined(
        &self,
        blocks: &[&BlockFactor],
        count: usize,
        may_join: &dyn Fn(&BlockFactor, &BlockFactor) -> bool,
    ) -> Vec<BlockFactor> {
        let rows: u64 = blocks.iter().map(|block| block.rows).sum();
        let each = (rows / count as u64).max(1);
        let mut parts: Vec<Vec<&BlockFactor>> = Vec::new();
        for &block in blocks {
            let open = parts.last_mut().filter(|part| {
                may_join(part[0], block) && part.iter().map(|b| b.rows).sum::<u64>() < each
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

/// Both fits by the blocks that are kept; nothing where those determine none.
fn both(
    factors: &BlockFactors,
    kept: Vec<BlockFactor>,
    weights: &[f64],
    task: &ConsistencyProblem,
) -> Result<[DVector<f64>; 2], FitError> {
    let kept = BlockFactors {
        blocks: kept,
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
    parts: &FitParts,
    weights: &[f64],
    task: &ConsistencyProblem,
) -> Result<Option<FitsOnLeftOut>, FitError> {
    let FitParts { in_time, by_speed } = parts;
    if in_time.len() < LEFT_OUT.fewest {
        return Ok(None);
    }
    let joints = 0..factors.columns.joints;
    let squares_in = |part: &BlockFactor, theta: &DVector<f64>| -> Vec<f64> {
        let square = |j: usize| {
            let own = factors.own_unknowns(theta, j);
            factors.parts(&part.r[j], j).residual_square(&own)
        };
        joints.clone().map(square).collect()
    };
    let inverse: Vec<f64> = weights.iter().map(|w| w * w).collect();
    let gain = |[plain, consistent]: &[Vec<Vec<f64>>; 2]| compare(consistent, plain, &inverse);
    // squares by both fits, [fit][part][joint]
    let mut squares = [Vec::new(), Vec::new()];
    for (k, part) in in_time.iter().enumerate() {
        let others = in_time.iter().enumerate().filter(|(at, _)| *at != k);
        let others = others.map(|(_, other)| other.clone()).collect();
        let fits = both(factors, others, weights, task)?;
        for (squares, theta) in squares.iter_mut().zip(&fits) {
            squares.push(squares_in(part, theta));
        }
    }
    let of_blocks = gain(&squares);
    let (slower, faster) = by_speed.split_at(by_speed.len() - by_speed.len() / 3);
    // what slow motion alone does not determine is not tried
    let by_slower = (faster.len() >= LEFT_OUT.fewest)
        .then(|| both(factors, slower.to_vec(), weights, task).ok());
    let loses = |fits: [DVector<f64>; 2]| {
        let squares =
            fits.map(|theta| faster.iter().map(|part| squares_in(part, &theta)).collect());
        let gain = gain(&squares);
        gain.value < -LEFT_OUT.faster * gain.se
    };
    let of_joint = |j: usize| {
        let torque = factors.moving[j].torque_square.max(f64::MIN_POSITIVE);
        let left = |which: usize| squares[which].iter().map(|part| part[j]).sum::<f64>();
        let [value, se] = of_blocks.joints[j];
        TrialLeftOut {
            plain: (left(0) / torque).sqrt(),
            consistent: (left(1) / torque).sqrt(),
            costs: value > NUMBERS.screen * se
                && left(1).sqrt() > (1.0 + NUMBERS.noticeable) * left(0).sqrt(),
        }
    };
    Ok(Some(FitsOnLeftOut {
        joints: joints.clone().map(of_joint).collect(),
        plain_wins: of_blocks.is_beyond(NUMBERS.screen, None),
        plain_loses_faster: by_slower.flatten().map(loses),
    }))
}
