//! On which signals a residual depends that no effect explains: how much of its square the means over bins of a
//! signal, or over cells of two, take up, beside what they take up of the same residual with random signs from block
//! to block.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::map::ResidualMap;
use super::signal::{Signal, values};
use crate::diagnose::problem::data_split::{LogRole, Piece};
use crate::diagnose::problem::pass::WeightedRows;
use crate::effect::StretchTorques;

/// A dependence of one joint's residual.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalDependence {
    pub joint: usize,
    /// One signal, or two together.
    pub signals: Vec<Signal>,
    /// Share of the residual's square that it takes up, beyond what it takes up of random signs.
    pub share: f64,
    /// Chance of a dependence as large among all signals where the residual depends on none.
    pub p_value: f64,
    /// Of the strongest of each joint: the residual over the two signals on which it depends most.
    pub map: Option<ResidualMap>,
}

/// Bins of one signal, and of each of two.
const BINS: [usize; 2] = [16, 6];
/// Signals that are tried in pairs, the strongest.
const PAIRED: usize = 6;
/// Share of a residual's square below which a dependence is not worth reporting.
const LEAST_SHARE: f64 = 0.02;
/// Chance above which a dependence is not reported.
const MAX_CHANCE: f64 = 0.01;
/// Dependences reported of one joint.
const REPORTED: usize = 4;
/// Part by which two signals must take up more than the better of them alone.
const TOGETHER: f64 = 1.2;

struct Rows {
    residual: Vec<f64>,
    block: Vec<usize>,
    /// Stretch and sample of each.
    at: Vec<(usize, usize)>,
}

/// What a model leaves of stretches, and what it makes of them.
pub struct ModelResiduals<'a> {
    pub data: &'a WeightedRows<'a>,
    /// Filtered residual, `[stretch][joint][row]`.
    pub residual: &'a [Vec<Vec<f64>>],
    pub torques: &'a [StretchTorques],
}

const DRAWS: usize = 199;
const SEED: u64 = 19_931_983;

/// Blocks of fitted rows, and the signs that each draw gives them.
struct BlockSigns {
    /// Block of each piece; none where it is not fitted.
    of_piece: Vec<Option<usize>>,
    blocks: usize,
    /// `[draw][block]`.
    of_draws: Vec<Vec<f64>>,
}

impl BlockSigns {
    /// `together` neighbouring pieces are a block.
    fn of(pieces: &[Piece], together: usize) -> Self {
        let mut fitted = 0..;
        let mut block = |p: &Piece| {
            let train = p.role == LogRole::Train;
            train.then(|| fitted.next().unwrap_or(0) / together.max(1))
        };
        let of_piece: Vec<Option<usize>> = pieces.iter().map(&mut block).collect();
        let blocks = of_piece.iter().flatten().max().map_or(0, |last| last + 1);
        let mut chance = ChaCha8Rng::seed_from_u64(SEED);
        let mut sign = || if chance.random::<bool>() { 1.0 } else { -1.0 };
        let mut draw = |_| (0..blocks).map(|_| sign()).collect();
        BlockSigns {
            of_piece,
            blocks,
            of_draws: (0..DRAWS).map(&mut draw).collect(),
        }
    }
}

/// Dependences of the residuals of `joints`, the strongest of each first; `together` pieces share the residual's memory.
pub fn dependences(
    left: &ModelResiduals,
    joints: &[usize],
    together: usize,
) -> Vec<SignalDependence> {
    let signs = BlockSigns::of(&left.data.split.pieces, together);
    let of_joint = |j: &usize| of_joint(left, &signs, *j);
    let found: Vec<Vec<SignalDependence>> = joints.par_iter().map(of_joint).collect();
    found.into_iter().flatten().collect()
}

fn of_joint(left: &ModelResiduals, signs: &BlockSigns, j: usize) -> Vec<SignalDependence> {
    let (stretches, torques) = (left.data.stretches, left.torques);
    let rows = rows(left, signs, j);
    let square: f64 = rows.residual.iter().map(|e| e * e).sum();
    if rows.residual.is_empty() || square <= 0.0 {
        return Vec::new();
    }
    let joints = left.residual.first().map_or(0, Vec::len);
    let stationary = &left.data.split.stationary;
    let moving = |i: &usize| stationary.iter().any(|still| !still[*i]);
    let warm = |i: &usize| stretches.iter().all(|s| s.has_temperature(*i));
    use Signal::{Acceleration, Direction, Load, SinceReversal};
    let mut signals = vec![Acceleration, Load, Direction, SinceReversal];
    // before the time: what warms up steadily says the same
    signals.extend((0..joints).filter(warm).map(Signal::Temperature));
    signals.push(Signal::Time);
    for i in (0..joints).filter(moving) {
        signals.extend([Signal::Position(i), Signal::Speed(i)]);
    }
    let values = signals
        .iter()
        .map(|s| values(*s, j, &rows.at, stretches, torques));
    let values: Vec<Vec<f64>> = values.collect();
    let taken = |cells: &[usize], count| ExplainedShare::of(&rows, signs, cells, count);
    let alone = values.iter().enumerate();
    let alone = alone.map(|(i, x)| (vec![i], taken(&bins(x, BINS[0]), BINS[0])));
    let mut tried: Vec<(Vec<usize>, ExplainedShare)> = alone.collect();
    let strongest_first = |tried: &[(Vec<usize>, ExplainedShare)]| {
        let mut order: Vec<usize> = (0..signals.len()).collect();
        order.sort_by(|a, b| tried[*b].1.surely().total_cmp(&tried[*a].1.surely()));
        order
    };
    let mut strongest = strongest_first(&tried);
    strongest.truncate(PAIRED);
    strongest.sort_unstable();
    let coarse: Vec<Vec<usize>> = values.iter().map(|x| bins(x, BINS[1])).collect();
    for (k, a) in strongest.iter().enumerate() {
        for b in &strongest[k + 1..] {
            let pairs = coarse[*a].iter().zip(&coarse[*b]);
            let cells: Vec<usize> = pairs.map(|(a, b)| a * BINS[1] + b).collect();
            tried.push((vec![*a, *b], taken(&cells, BINS[1] * BINS[1])));
        }
    }
    // the best of each draw over all signals
    let best = |d: usize| {
        let places = tried.iter().map(|(_, t)| t.place(t.draws[d]));
        places.fold(f64::MIN, f64::max)
    };
    let best: Vec<f64> = (0..DRAWS).map(best).collect();
    let mut found: Vec<SignalDependence> = Vec::new();
    for (of, taken) in &tried {
        let own = taken.surely();
        let as_good = best.iter().filter(|b| **b >= own).count();
        let p_value = (1 + as_good) as f64 / (1 + DRAWS) as f64;
        let share = (taken.real - taken.mean) / square;
        if p_value > MAX_CHANCE || share < LEAST_SHARE {
            continue;
        }
        let mut of = of.clone();
        // the one that takes up more by itself comes first
        let alone = |i: &usize| tried[*i].1.real - tried[*i].1.mean;
        of.sort_by(|a, b| alone(b).total_cmp(&alone(a)));
        let better = alone(&of[0]) / square;
        if of.len() == 2 && share < TOGETHER * better {
            continue;
        }
        found.push(SignalDependence {
            joint: j,
            signals: of.iter().map(|i| signals[*i]).collect(),
            share,
            p_value,
            map: None,
        });
    }
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    found.truncate(REPORTED);
    if let Some(strongest) = found.first_mut() {
        let place = |of: &Signal| signals.iter().position(|s| s == of);
        let shown: Vec<usize> = strongest.signals.iter().filter_map(place).collect();
        // beside one alone stands the next strongest by itself
        let mut others = strongest_first(&tried);
        others.retain(|i| !shown.contains(i));
        let drawn: Vec<usize> = shown.into_iter().chain(others).take(2).collect();
        if let &[a, b] = drawn.as_slice() {
            let of = [&values[a], &values[b]].map(Vec::as_slice);
            let map = ResidualMap::of([signals[a], signals[b]], of, &rows.residual, &rows.block);
            strongest.map = Some(map);
        }
    }
    found
}

fn rows(left: &ModelResiduals, signs: &BlockSigns, j: usize) -> Rows {
    let mut rows = Rows {
        residual: Vec::new(),
        block: Vec::new(),
        at: Vec::new(),
    };
    let data = left.data;
    for (piece, block) in data.split.pieces.iter().zip(&signs.of_piece) {
        let Some(block) = block else { continue };
        if data.split.is_stationary(piece.stretch, j) {
            continue;
        }
        let parallel = data.filters.of(&data.stretches[piece.stretch]);
        for row in piece.rows.clone() {
            rows.residual.push(left.residual[piece.stretch][j][row]);
            rows.block.push(*block);
            rows.at.push((piece.stretch, parallel.sample_of(row)));
        }
    }
    rows
}

/// Bin of each value, equally many in each; equal values in one.
fn bins(x: &[f64], count: usize) -> Vec<usize> {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let edges = (1..count).map(|k| sorted[k * sorted.len() / count]);
    let edges: Vec<f64> = edges.collect();
    let bin = |x: &f64| edges.partition_point(|e| e <= x);
    x.iter().map(bin).collect()
}

/// What the means over cells take up of the residual's square, and of the draws.
struct ExplainedShare {
    real: f64,
    draws: Vec<f64>,
    mean: f64,
    deviation: f64,
}

impl ExplainedShare {
    fn of(rows: &Rows, signs: &BlockSigns, cells: &[usize], count: usize) -> Self {
        let blocks = signs.blocks;
        let mut sums = vec![0.0; blocks * count];
        let mut numbers = vec![0.0f64; count];
        for ((e, block), cell) in rows.residual.iter().zip(&rows.block).zip(cells) {
            sums[block * count + cell] += e;
            numbers[*cell] += 1.0;
        }
        let taken = |sign: &dyn Fn(usize) -> f64| {
            let mut totals = vec![0.0; count];
            for (block, of_block) in sums.chunks_exact(count).enumerate() {
                let sign = sign(block);
                for (total, sum) in totals.iter_mut().zip(of_block) {
                    *total += sign * sum;
                }
            }
            let squares = totals.iter().zip(&numbers);
            squares.map(|(t, n)| t * t / n.max(1.0)).sum::<f64>()
        };
        let draws: Vec<f64> = signs.of_draws.iter().map(|s| taken(&|b| s[b])).collect();
        let number = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / number;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / number;
        ExplainedShare {
            real: taken(&|_| 1.0),
            draws,
            mean,
            deviation: variance.sqrt().max(f64::MIN_POSITIVE),
        }
    }

    fn place(&self, taken: f64) -> f64 {
        (taken - self.mean) / self.deviation
    }

    fn surely(&self) -> f64 {
        self.place(self.real)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::unexplained::normal;

    #[test]
    fn what_a_residual_depends_on_takes_up_its_share_and_what_it_does_not_takes_up_nothing() {
        let n = 6000;
        let piece = |k: usize| Piece {
            stretch: 0,
            rows: 100 * k..100 * (k + 1),
            role: LogRole::Train,
        };
        let pieces: Vec<Piece> = (0..60).map(piece).collect();
        let signs = BlockSigns::of(&pieces, 1);
        let mut noise = normal(3);
        let signal: Vec<f64> = (0..n).map(|k| (0.0137 * k as f64).sin()).collect();
        let other: Vec<f64> = (0..n).map(|k| (0.0091 * k as f64 + 1.0).sin()).collect();
        let residual = signal.iter().map(|x| noise() + 2.0 * (x * x - 0.5));
        let rows = Rows {
            residual: residual.collect(),
            block: (0..n).map(|k| signs.of_piece[k / 100].unwrap()).collect(),
            at: Vec::new(),
        };
        let square: f64 = rows.residual.iter().map(|e| e * e).sum();
        let of = |x: &[f64]| ExplainedShare::of(&rows, &signs, &bins(x, BINS[0]), BINS[0]);
        let (real, none) = (of(&signal), of(&other));
        // 2 (x^2 - 1/2) has a variance of 1/2 beside the noise's 1
        let share = (real.real - real.mean) / square;
        assert!((share - 1.0 / 3.0).abs() < 0.05, "{share}");
        assert!(real.draws.iter().all(|d| *d < real.real));
        assert!(none.draws.iter().any(|d| *d > none.real));
    }
}
