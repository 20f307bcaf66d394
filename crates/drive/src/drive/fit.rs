//! Output error: the numbers of a law whose roll-outs lie nearest to the measured positions.
//!
//! Gauss-Newton with bounds and Levenberg's damping on a robust loss. Each log weighs by its information: by the scale of
//! its own residual. What a linearisation leaves are sums per piece of a log, of which everything after is made.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::chain::RobotChains;
use super::roll_out::roll_axis;
use super::track::{DriveLoad, DriveLog, median};
use super::unknown::{DriveUnknown, JointSizes, UnknownFrame};

/// The numbers that decide in a fit.
#[derive(Debug, Clone, Copy)]
pub struct FitNumbers {
    /// From so many scales on a residual counts by its size and not by its square. Half: a sum of sizes; twice: one
    /// fall without a drive moves all numbers.
    pub huber: f64,
    /// Step of differences, in sizes. Half, twice: the same to three digits.
    pub difference: f64,
    /// A fit ends where a step gains less than this part. Half, twice: one step more or less.
    pub enough: f64,
    /// Most steps.
    pub steps: usize,
}

pub const NUMBERS: FitNumbers = FitNumbers {
    huber: 1.345,
    difference: 1e-3,
    enough: 1e-5,
    steps: 25,
};

/// A part of a log, and the block of the jackknife that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogPiece {
    pub log: usize,
    pub from: usize,
    pub to: usize,
    pub block: usize,
}

/// Logs, the frame of the machine, and how the logs are cut.
#[derive(Debug, Clone)]
pub struct DriveProblem<'a> {
    pub logs: &'a [&'a DriveLog],
    pub frame: UnknownFrame,
    pub sizes: Vec<JointSizes>,
    pub pieces: Vec<LogPiece>,
    pub blocks: usize,
    pub chains: Option<&'a RobotChains>,
}

/// Sums over a piece: H = sum w J J', g = sum w J r, and the loss.
#[derive(Debug, Clone)]
pub struct PieceSums {
    pub h: DMatrix<f64>,
    pub g: DVector<f64>,
    pub loss: f64,
}

impl PieceSums {
    pub fn zero(p: usize) -> Self {
        PieceSums {
            h: DMatrix::zeros(p, p),
            g: DVector::zeros(p),
            loss: 0.0,
        }
    }

    pub fn add(&mut self, other: &PieceSums) {
        self.h += &other.h;
        self.g += &other.g;
        self.loss += other.loss;
    }

    /// The loss after a small change of the unknowns.
    pub fn loss_at(&self, change: &DVector<f64>) -> f64 {
        self.loss + 2.0 * self.g.dot(change) + (&self.h * change).dot(change)
    }
}

/// Scales of the residuals, by log and joint [rad].
pub type ResidualScales = Vec<Vec<f64>>;

/// Where a fit ended.
#[derive(Debug, Clone)]
pub struct FittedDrive {
    pub unknowns: Vec<DriveUnknown>,
    pub values: Vec<f64>,
    pub loss: f64,
    pub converged: bool,
}

/// Loss of a residual in scales, and the weight of its square.
#[inline]
fn robust(u: f64) -> (f64, f64) {
    let c = NUMBERS.huber;
    let root = (1.0 + (u / c) * (u / c)).sqrt();
    (2.0 * c * c * (root - 1.0), 1.0 / root)
}

impl DriveProblem<'_> {
    /// The same by roll-outs of other steps [s].
    pub fn by_steps(&self, longest_step: f64) -> Self {
        DriveProblem {
            frame: UnknownFrame {
                longest_step,
                ..self.frame.clone()
            },
            ..self.clone()
        }
    }

    /// Predicted positions of a log, joint after joint.
    pub fn positions(
        &self,
        log: &DriveLog,
        unknowns: &[DriveUnknown],
        values: &[f64],
    ) -> Vec<Vec<f64>> {
        let law = self.frame.law(unknowns, values);
        let frame = (self.frame.kind, self.frame.longest_step);
        if let (DriveLoad::Robot, Some(chains)) = (log.load, self.chains) {
            return chains.roll(log, frame, &law);
        }
        let joints = 0..log.joints.len();
        joints
            .map(|j| {
                let mut out = vec![0.0; log.t.len()];
                roll_axis(log, frame, &law, j, &mut out);
                out
            })
            .collect()
    }

    /// Predicted less measured, log after log.
    pub fn residuals(&self, unknowns: &[DriveUnknown], values: &[f64]) -> Vec<Vec<Vec<f64>>> {
        let of = |log: &&DriveLog| {
            let mut out = self.positions(log, unknowns, values);
            subtract(&mut out, log);
            out
        };
        self.logs.par_iter().map(of).collect()
    }

    /// Scales of residuals: the middle of their size, no smaller than that of all logs together would make it.
    pub fn scales(&self, unknowns: &[DriveUnknown], values: &[f64]) -> ResidualScales {
        let residuals = self.residuals(unknowns, values);
        let own: ResidualScales = residuals
            .iter()
            .map(|log| log.iter().map(|r| NORMAL * median_size(r)).collect())
            .collect();
        let joints = self.frame.joints;
        let usual: Vec<f64> = (0..joints)
            .map(|j| median(own.iter().map(|log| log[j]).collect()).max(LEAST_SCALE))
            .collect();
        let mixed = |log: &Vec<f64>| {
            let both = log.iter().zip(&usual);
            both.map(|(own, usual)| own.hypot(*usual)).collect()
        };
        own.iter().map(mixed).collect()
    }

    /// The loss at values.
    pub fn loss(&self, unknowns: &[DriveUnknown], values: &[f64], scales: &ResidualScales) -> f64 {
        let losses: Vec<f64> = (self.logs.par_iter().zip(scales))
            .map(|(log, scales)| {
                let mut r = self.positions(log, unknowns, values);
                subtract(&mut r, log);
                let joint = |(r, scale): (&Vec<f64>, &f64)| -> f64 {
                    r.iter().map(|r| robust(r / scale).0).sum()
                };
                r.iter().zip(scales).map(joint).sum::<f64>()
            })
            .collect();
        losses.iter().sum()
    }

    /// Mean size of the residual of each joint, for starts that are far off.
    pub fn losses_by_joint(&self, unknowns: &[DriveUnknown], values: &[f64]) -> Vec<f64> {
        let all = self.residuals(unknowns, values);
        let of = |j: usize| {
            let sizes = all
                .iter()
                .flat_map(|log| log[j].iter().map(|r| r.abs().min(MOST)));
            sizes.sum::<f64>()
        };
        (0..self.frame.joints).map(of).collect()
    }

    /// Step of the difference by each unknown.
    fn differences(&self, unknowns: &[DriveUnknown], values: &[f64]) -> Vec<f64> {
        let of = unknowns.iter().zip(values);
        of.map(|(unknown, value)| {
            let sizes = &self.sizes[unknown.joint.unwrap_or(0)];
            NUMBERS.difference * sizes.of(unknown.quantity).max(value.abs())
        })
        .collect()
    }

    /// Sums of every piece at values, in the order of the pieces.
    pub fn linearised(
        &self,
        unknowns: &[DriveUnknown],
        values: &[f64],
        scales: &ResidualScales,
    ) -> Vec<PieceSums> {
        let p = unknowns.len();
        let steps = self.differences(unknowns, values);
        let together = self.together(unknowns);
        let of_log = |(l, log): (usize, &&DriveLog)| -> Vec<PieceSums> {
            let base = self.positions(log, unknowns, values);
            let mut r = base.clone();
            subtract(&mut r, log);
            let mut columns: Vec<Vec<Column>> = vec![Vec::new(); log.joints.len()];
            for batch in &together {
                let mut moved = values.to_vec();
                for i in batch {
                    moved[*i] += steps[*i];
                }
                let there = self.positions(log, unknowns, &moved);
                for i in batch {
                    for j in self.reach(unknowns[*i]) {
                        let pairs = there[j].iter().zip(&base[j]);
                        let slope = pairs.map(|(x, base)| (x - base) / steps[*i]).collect();
                        columns[j].push(Column { unknown: *i, slope });
                    }
                }
            }
            let own = self.pieces.iter().filter(|piece| piece.log == l);
            own.map(|piece| sums(p, piece, &r, &columns, &scales[l]))
                .collect()
        };
        let all: Vec<Vec<PieceSums>> = self.logs.par_iter().enumerate().map(of_log).collect();
        all.into_iter().flatten().collect()
    }

    /// Joints that an unknown moves.
    fn reach(&self, unknown: DriveUnknown) -> Vec<usize> {
        match (unknown.joint, self.chains) {
            (None, _) => (0..self.frame.joints).collect(),
            (Some(j), None) => vec![j],
            (Some(j), Some(chains)) => chains.moved_with(j),
        }
    }

    /// Unknowns in batches that move no joint in common: one roll-out shows all of a batch.
    fn together(&self, unknowns: &[DriveUnknown]) -> Vec<Vec<usize>> {
        let mut out: Vec<(Vec<usize>, Vec<usize>)> = Vec::new();
        for (i, unknown) in unknowns.iter().enumerate() {
            let reach = self.reach(*unknown);
            let free =
                |(_, taken): &(Vec<usize>, Vec<usize>)| !reach.iter().any(|j| taken.contains(j));
            match out.iter().position(free) {
                Some(at) => {
                    out[at].0.push(i);
                    out[at].1.extend(&reach);
                }
                None => out.push((vec![i], reach)),
            }
        }
        out.into_iter().map(|(batch, _)| batch).collect()
    }

    /// Sums by block of the jackknife.
    pub fn by_block(&self, pieces: &[PieceSums]) -> Vec<PieceSums> {
        let p = pieces.first().map_or(0, |sums| sums.g.len());
        let mut out = vec![PieceSums::zero(p); self.blocks];
        for (piece, sums) in self.pieces.iter().zip(pieces) {
            out[piece.block].add(sums);
        }
        out
    }

    /// Fits from a start, at most so many steps.
    pub fn fit(
        &self,
        unknowns: &[DriveUnknown],
        start: &[f64],
        scales: &ResidualScales,
        most: usize,
    ) -> FittedDrive {
        let bounds: Vec<[f64; 2]> = unknowns.iter().map(DriveUnknown::bounds).collect();
        let mut values = start.to_vec();
        let mut loss = self.loss(unknowns, &values, scales);
        let (mut damping, mut converged) = (1e-3, false);
        for _ in 0..most {
            let mut all = PieceSums::zero(unknowns.len());
            for sums in self.linearised(unknowns, &values, scales) {
                all.add(&sums);
            }
            let mut better = None;
            while damping < 1e6 {
                let next = bounded_step(&all, &values, &bounds, damping);
                let at = self.loss(unknowns, &next, scales);
                if at < loss {
                    better = Some((next, at));
                    damping = (damping * 0.1).max(1e-9);
                    break;
                }
                damping *= 10.0;
            }
            let Some((next, at)) = better else {
                converged = true;
                break;
            };
            let gain = (loss - at) / loss;
            (values, loss) = (next, at);
            if gain < NUMBERS.enough {
                converged = true;
                break;
            }
        }
        FittedDrive {
            unknowns: unknowns.to_vec(),
            values,
            loss,
            converged,
        }
    }
}

/// A start is not worse than this anywhere [rad]: of two that are lost none is the better.
const MOST: f64 = 10.0;

/// Smallest scale of a residual [rad]: no encoder shows less.
const LEAST_SCALE: f64 = 1e-5;

/// Standard deviation over median size, of a normal distribution.
const NORMAL: f64 = 1.4826;

fn subtract(predicted: &mut [Vec<f64>], log: &DriveLog) {
    for (out, track) in predicted.iter_mut().zip(&log.joints) {
        for (x, measured) in out.iter_mut().zip(&track.position) {
            *x -= measured;
        }
    }
}

/// Slopes of the positions of a joint with an unknown.
#[derive(Debug, Clone)]
struct Column {
    unknown: usize,
    slope: Vec<f64>,
}

fn sums(
    p: usize,
    piece: &LogPiece,
    r: &[Vec<f64>],
    columns: &[Vec<Column>],
    scales: &[f64],
) -> PieceSums {
    let mut out = PieceSums::zero(p);
    for ((r, scale), columns) in r.iter().zip(scales).zip(columns) {
        for (k, error) in r.iter().enumerate().take(piece.to).skip(piece.from) {
            let (loss, weight) = robust(error / scale);
            let weight = weight / (scale * scale);
            for (at, a) in columns.iter().enumerate() {
                let by = weight * a.slope[k];
                out.g[a.unknown] += by * error;
                for b in &columns[..=at] {
                    out.h[(a.unknown, b.unknown)] += by * b.slope[k];
                }
            }
            out.loss += loss;
        }
    }
    for a in 0..p {
        for b in 0..a {
            let both = out.h[(a, b)] + out.h[(b, a)];
            (out.h[(a, b)], out.h[(b, a)]) = (both, both);
        }
    }
    out
}

/// A damped step within bounds: what stands at a bound and is pushed beyond is held there.
fn bounded_step(all: &PieceSums, values: &[f64], bounds: &[[f64; 2]], damping: f64) -> Vec<f64> {
    let p = values.len();
    let mut held: Vec<bool> = (0..p)
        .map(|i| {
            let [low, high] = bounds[i];
            all.h[(i, i)] <= 0.0
                || (values[i] <= low && all.g[i] > 0.0)
                || (values[i] >= high && all.g[i] < 0.0)
        })
        .collect();
    let mut next = values.to_vec();
    for _ in 0..=p {
        let free: Vec<usize> = (0..p).filter(|i| !held[*i]).collect();
        let Some(change) = solve_free(all, &free, damping) else {
            return values.to_vec();
        };
        next.copy_from_slice(values);
        let mut beyond = false;
        for (i, change) in free.iter().zip(change.iter()) {
            let [low, high] = bounds[*i];
            next[*i] = (values[*i] + change).clamp(low, high);
            if values[*i] + change < low || values[*i] + change > high {
                // to the bound first; only what stands there already leaves the free ones
                if values[*i] <= low || values[*i] >= high {
                    held[*i] = true;
                    beyond = true;
                }
            }
        }
        if !beyond {
            break;
        }
    }
    next
}

/// -(H + damping diag H)^-1 g over some unknowns.
pub fn solve_free(all: &PieceSums, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    let n = free.len();
    // scaled to a unit diagonal: units differ by many powers of ten
    let size: Vec<f64> = free.iter().map(|i| all.h[(*i, *i)].sqrt()).collect();
    let h = DMatrix::from_fn(n, n, |a, b| {
        let diagonal = if a == b { 1.0 + damping + RIDGE } else { 1.0 };
        all.h[(free[a], free[b])] / (size[a] * size[b]) * diagonal
    });
    let g = DVector::from_fn(n, |a, _| -all.g[free[a]] / size[a]);
    let mut x = h.cholesky()?.solve(&g);
    for (x, size) in x.iter_mut().zip(&size) {
        *x /= size;
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// Added to a unit diagonal: directions that the data determine less are left where they are.
const RIDGE: f64 = 1e-9;

fn median_size(x: &[f64]) -> f64 {
    median(x.iter().map(|x| x.abs()).collect())
}
