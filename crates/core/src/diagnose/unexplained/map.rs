//! The residual of a joint over the two signals on which it depends most, as means over cells, and over the first of
//! them as a curve.

use super::signal::Signal;

/// Means of one joint's residual.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualMap {
    /// The strongest first.
    pub signals: [Signal; 2],
    /// Ends of both signals, between which the cells are of equal size.
    pub ends: [[f64; 2]; 2],
    /// Mean residual [N or Nm], `[second][first]`; none where too few rows are.
    pub cells: Vec<Vec<Option<f64>>>,
    /// Over the first signal: `[signal, mean, standard error]` [.., N or Nm, N or Nm], in bins of equally many rows.
    pub curve: Vec<[f64; 3]>,
}

/// Cells along each signal.
const CELLS: usize = 20;
const BINS: usize = 24;
/// Part of the rows beyond each end.
const BEYOND: f64 = 0.005;
/// Least rows of a cell.
const MIN_ROWS_PER_CELL: f64 = 3.0;

impl ResidualMap {
    /// Of a residual and two signals at the same rows; standard errors are those of blocks, whose rows are not independent.
    pub(super) fn of(
        signals: [Signal; 2],
        values: [&[f64]; 2],
        residual: &[f64],
        block: &[usize],
    ) -> Self {
        let ends = values.map(ends);
        let cell = |i: usize| -> Option<[usize; 2]> {
            let along = |s: usize| {
                let [from, to] = ends[s];
                let share = (values[s][i] - from) / (to - from);
                let cell = ((share * CELLS as f64) as usize).min(CELLS - 1);
                (0.0..=1.0).contains(&share).then_some(cell)
            };
            Some([along(0)?, along(1)?])
        };
        let mut sums = vec![vec![[0.0; 2]; CELLS]; CELLS];
        for (i, e) in residual.iter().enumerate() {
            if let Some([x, y]) = cell(i) {
                let [sum, rows] = &mut sums[y][x];
                *sum += e;
                *rows += 1.0;
            }
        }
        let mean = |[sum, rows]: &[f64; 2]| (*rows >= MIN_ROWS_PER_CELL).then(|| sum / rows);
        let line = |line: &Vec<[f64; 2]>| line.iter().map(mean).collect();
        ResidualMap {
            signals,
            ends,
            cells: sums.iter().map(line).collect(),
            curve: curve(values[0], residual, block),
        }
    }
}

/// Where nearly all of a signal lies.
fn ends(x: &[f64]) -> [f64; 2] {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let at = |share: f64| sorted.get((share * last as f64).round() as usize).copied();
    let [from, to] = [BEYOND, 1.0 - BEYOND].map(|share| at(share).unwrap_or_default());
    match to > from {
        true => [from, to],
        false => [from - 1.0, from + 1.0],
    }
}

fn curve(x: &[f64], residual: &[f64], block: &[usize]) -> Vec<[f64; 3]> {
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
    let rows = order.len().div_ceil(BINS).max(1);
    let of_bin = |rows: &[usize]| {
        let n = rows.len() as f64;
        let mean = |of: &[f64]| rows.iter().map(|i| of[*i]).sum::<f64>() / n;
        let (at, level) = (mean(x), mean(residual));
        let mut blocks = std::collections::BTreeMap::<usize, f64>::new();
        for i in rows {
            *blocks.entry(block[*i]).or_default() += residual[*i] - level;
        }
        // sums over blocks are independent
        let count = blocks.len() as f64;
        let square: f64 = blocks.values().map(|sum| sum * sum).sum();
        let std = match count > 1.0 {
            true => (square * count / (count - 1.0)).sqrt() / n,
            false => 0.0,
        };
        [at, level, std]
    };
    order.chunks(rows).map(of_bin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_and_curve_are_the_means_of_their_rows() {
        let n = 40_000;
        let x: Vec<f64> = (0..n).map(|k| (0.37 * k as f64).sin()).collect();
        let y: Vec<f64> = (0..n).map(|k| (0.0113 * k as f64).cos()).collect();
        let residual: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 2.0 * x + x * y).collect();
        let block: Vec<usize> = (0..n).map(|k| k / 400).collect();
        let signals = [Signal::Load, Signal::Time];
        let map = ResidualMap::of(signals, [&x, &y], &residual, &block);
        let middle = |s: usize, k: usize| {
            let [from, to] = map.ends[s];
            from + (to - from) * (k as f64 + 0.5) / CELLS as f64
        };
        let mut filled = 0;
        for (b, line) in map.cells.iter().enumerate() {
            for (a, mean) in line.iter().enumerate() {
                let Some(mean) = mean else { continue };
                let (x, y) = (middle(0, a), middle(1, b));
                assert!((mean - (2.0 * x + x * y)).abs() < 0.15, "{x} {y}: {mean}");
                filled += 1;
            }
        }
        assert!(filled > 390, "{filled}");
        for [x, mean, std] in &map.curve {
            let off = (mean - 2.0 * x).abs();
            assert!(off < 0.05 + 4.0 * std && *std < 0.1, "{x}: {mean} {std}");
        }
        let still = ResidualMap::of(signals, [&x, &vec![1.0; n]], &residual, &block);
        assert_eq!(still.ends[1], [0.0, 2.0]);
    }
}
