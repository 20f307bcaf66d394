//! When a load is carried: the part of the logs in which the body on the last link acts.
//!
//! Time is cut into units, gaps of the clock first. A body that acts in a run of units leaves least there; runs are added
//! as long as units bear them out. Friction and offset of the joints are the same throughout.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::payload_result::CarriedSpan;
use super::payload_rows::{LEFT, OWN, PayloadRow, Rows, places};
use cft_ident_core::robot::standard::STANDARD;

/// The numbers that decide whether a load comes or goes within the logs.
struct CarriedNumbers {
    /// Most units. Half: a load of a thirtieth of the log is averaged with what is beside it; twice: four times the work.
    units: usize,
    /// Part of the squared error that may be left of that with a body throughout, and of that with a run less. Half: a
    /// light load is averaged; twice: any run gains as much of what the model lacks.
    left: f64,
    /// Most runs.
    runs: usize,
    /// Part of a column's square that is added to its diagonal: directions that no motion excites stay 0.
    ridge: f64,
}

const NUMBERS: CarriedNumbers = CarriedNumbers {
    units: 96,
    left: 0.5,
    runs: 6,
    ridge: 1e-9,
};

/// A run of rows that is not parted.
pub(super) struct Unit {
    pub log: usize,
    /// Blocks of the rows.
    blocks: [usize; 2],
    pub begin: f64,
    pub end: f64,
}

/// The units of some rows, and the unit of each block.
pub(super) struct DividedRows {
    pub units: Vec<Unit>,
    pub of_block: Vec<usize>,
}

struct CarriedSearch<'a> {
    rows: &'a Rows,
    n: usize,
    weights: Vec<f64>,
    units: Vec<Unit>,
    /// Sums of each unit: body, friction and offset of each joint, and what is left.
    products: Vec<DMatrix<f64>>,
}

/// Units in which a body acts, what it and the joints' friction are, and the squares that are left of each unit.
struct CarriedFit {
    inside: Vec<bool>,
    theta: DVector<f64>,
    left: Vec<f64>,
}

impl CarriedFit {
    fn cost(&self) -> f64 {
        self.left.iter().sum()
    }

    /// Whether it leaves so little of what another leaves that chance and a model's errors do not reach it.
    fn is_better_than(&self, other: &Self) -> bool {
        self.cost() < NUMBERS.left * other.cost()
    }
}

/// The parts of the logs in which a body acts; nothing where one that acts throughout leaves as little.
pub(super) fn carried_spans(rows: &Rows, names: &[String]) -> Vec<CarriedSpan> {
    let n = rows.joints.len();
    let own = |of: &Vec<PayloadRow>| {
        let square: f64 = of.iter().map(|row| row.numbers[LEFT].powi(2)).sum();
        (of.len().max(1) as f64 / square.max(f64::MIN_POSITIVE)).sqrt()
    };
    let mut weights: Vec<f64> = rows.joints.iter().map(own).collect();
    let mut found = None;
    // a second time with weights by what the first leaves
    for _ in 0..2 {
        let search = CarriedSearch::new(rows, n, weights.clone());
        let Some((whole, best)) = search.best() else {
            return Vec::new();
        };
        weights = (0..n).map(|j| search.weight_by(&best, j)).collect();
        let parts = best.is_better_than(&whole);
        found = parts.then(|| search.spans(&best, names));
    }
    found.unwrap_or_default()
}

impl DividedRows {
    /// Cuts time into units, gaps of the clock first.
    pub fn new(rows: &Rows) -> Self {
        let most = rows.blocks.len().div_ceil(NUMBERS.units).max(1);
        let mut units: Vec<Unit> = Vec::new();
        let mut of_block = Vec::with_capacity(rows.blocks.len());
        let mut has_rows = vec![false; rows.blocks.len()];
        for row in rows.joints.iter().flatten() {
            has_rows[row.block] = true;
        }
        for (block, of) in rows.blocks.iter().enumerate() {
            // a block without rows says nothing of what ends before it
            if !has_rows[block] {
                of_block.push(units.len().saturating_sub(1));
                continue;
            }
            let goes_on = units.last().is_some_and(|unit| {
                block - unit.blocks[0] < most && rows.blocks[unit.blocks[0]].stretch == of.stretch
            });
            if !goes_on {
                units.push(Unit {
                    log: of.log,
                    blocks: [block; 2],
                    begin: of.begin,
                    end: of.end,
                });
            }
            if let Some(unit) = units.last_mut() {
                (unit.blocks[1], unit.end) = (block, of.end);
            }
            of_block.push(units.len() - 1);
        }
        Self { units, of_block }
    }
}

impl<'a> CarriedSearch<'a> {
    fn new(rows: &'a Rows, n: usize, weights: Vec<f64>) -> Self {
        let u = STANDARD + 3 * n;
        let DividedRows { units, of_block } = DividedRows::new(rows);
        let mut products = vec![DMatrix::zeros(u + 1, u + 1); units.len()];
        for (j, of) in rows.joints.iter().enumerate() {
            let mut at = places(j, n, false);
            at.push(u);
            let square = weights[j] * weights[j];
            for row in of {
                let x = |c: usize| row.numbers[if c < OWN { c } else { LEFT }];
                let sums = &mut products[of_block[row.block]];
                for (a, to) in at.iter().enumerate() {
                    for (b, beside) in at.iter().enumerate().take(a + 1) {
                        let product = square * x(a) * x(b);
                        sums[(*to, *beside)] += product;
                        if to != beside {
                            sums[(*beside, *to)] += product;
                        }
                    }
                }
            }
        }
        Self {
            rows,
            n,
            weights,
            units,
            products,
        }
    }

    /// Fits the body to the units inside, friction to all; `sums` are those of the units inside, `total` of all.
    fn solved(&self, sums: &DMatrix<f64>, total: &DMatrix<f64>) -> Option<(DVector<f64>, f64)> {
        let u = STANDARD + 3 * self.n;
        let of = |i: usize, k: usize| match i < STANDARD || k < STANDARD {
            true => sums[(i, k)],
            false => total[(i, k)],
        };
        let mut normal = DMatrix::from_fn(u, u, of);
        for i in 0..u {
            let own = total[(i, i)].max(f64::MIN_POSITIVE);
            normal[(i, i)] += NUMBERS.ridge * own;
        }
        let right = DVector::from_fn(u, |i, _| of(i, u));
        let theta = Cholesky::new(normal)?.solve(&right);
        let cost = total[(u, u)] - right.dot(&theta);
        Some((theta, cost))
    }

    fn sums(&self, inside: &[bool]) -> DMatrix<f64> {
        let size = STANDARD + 3 * self.n + 1;
        let units = self.products.iter().zip(inside);
        units
            .filter(|(_, inside)| **inside)
            .fold(DMatrix::zeros(size, size), |sum, (unit, _)| sum + unit)
    }

    fn fitted(&self, inside: Vec<bool>) -> Option<CarriedFit> {
        let total = self.sums(&vec![true; self.units.len()]);
        let (theta, _) = self.solved(&self.sums(&inside), &total)?;
        let left = self.products.iter().zip(&inside).map(|(unit, inside)| {
            let mut x = theta.clone().push(-1.0);
            if !inside {
                x.rows_mut(0, STANDARD).fill(0.0);
            }
            (x.transpose() * unit * &x)[(0, 0)].max(0.0)
        });
        Some(CarriedFit {
            left: left.collect(),
            inside,
            theta,
        })
    }

    /// A body throughout, and one in the runs of units in which it leaves least.
    fn best(&self) -> Option<(CarriedFit, CarriedFit)> {
        let count = self.units.len();
        let total = self.sums(&vec![true; count]);
        let whole = self.fitted(vec![true; count])?;
        let mut best = self.fitted(vec![false; count])?;
        for run in 0..NUMBERS.runs {
            let mut least: Option<(f64, [usize; 2])> = None;
            for from in (0..count).filter(|k| !best.inside[*k]) {
                let mut sums = self.sums(&best.inside);
                for to in (from..count).take_while(|k| !best.inside[*k]) {
                    sums += &self.products[to];
                    let Some((_, cost)) = self.solved(&sums, &total) else {
                        continue;
                    };
                    if least.is_none_or(|(known, _)| cost < known) {
                        least = Some((cost, [from, to]));
                    }
                }
            }
            let Some((_, [from, to])) = least else { break };
            let mut inside = best.inside.clone();
            inside[from..=to].fill(true);
            let next = self.fitted(inside)?;
            if run > 0 && !next.is_better_than(&best) {
                break;
            }
            best = next;
        }
        Some((whole, best))
    }

    /// One over the deviation that a fit leaves of a joint.
    fn weight_by(&self, fitted: &CarriedFit, j: usize) -> f64 {
        let rows = &self.rows.joints[j];
        let mut square = 0.0;
        let mut unit = 0;
        for row in rows {
            while self.units[unit].blocks[1] < row.block {
                unit += 1;
            }
            square += self.error(fitted, j, row, fitted.inside[unit]).powi(2);
        }
        (rows.len().max(1) as f64 / square.max(f64::MIN_POSITIVE)).sqrt()
    }

    fn error(&self, fitted: &CarriedFit, j: usize, row: &PayloadRow, inside: bool) -> f64 {
        let each = places(j, self.n, false)
            .into_iter()
            .zip(&row.numbers[..OWN]);
        let each = each.filter(|(at, _)| inside || *at >= STANDARD);
        row.numbers[LEFT] - each.map(|(at, x)| fitted.theta[at] * x).sum::<f64>()
    }

    /// The runs as times, each end to the row.
    fn spans(&self, fitted: &CarriedFit, names: &[String]) -> Vec<CarriedSpan> {
        let mut out: Vec<CarriedSpan> = Vec::new();
        let units = &self.units;
        let same_log = |a: usize, b: usize| units[a].log == units[b].log;
        let mut k = 0;
        while k < units.len() {
            if !fitted.inside[k] {
                k += 1;
                continue;
            }
            let mut end = k;
            while end + 1 < units.len() && fitted.inside[end + 1] && same_log(k, end + 1) {
                end += 1;
            }
            let begins = k.checked_sub(1).filter(|before| same_log(*before, k));
            let ends = Some(end + 1).filter(|after| *after < units.len() && same_log(end, *after));
            out.push(CarriedSpan {
                log: names.get(units[k].log).cloned().unwrap_or_default(),
                from_s: begins.map(|before| self.edge(fitted, before, k)),
                to_s: ends.map(|after| self.edge(fitted, end, after)),
                place: units[k].log,
            });
            k = end + 1;
        }
        out
    }

    /// When the body comes or goes between two neighbouring units, by the rows of both \[s\].
    fn edge(&self, fitted: &CarriedFit, first: usize, second: usize) -> f64 {
        let units = &self.units;
        let apart = self.rows.blocks[units[first].blocks[0]].stretch
            != self.rows.blocks[units[second].blocks[0]].stretch;
        if apart {
            // a gap of the clock is where it was taken or put down
            return units[second].begin;
        }
        // a run may end anywhere in the unit before or behind
        let blocks = units[first].blocks[0]..=units[second].blocks[1];
        let mut gains: Vec<(f64, f64)> = Vec::new();
        for (j, rows) in self.rows.joints.iter().enumerate() {
            let square = self.weights[j] * self.weights[j];
            let within = rows.iter().filter(|row| blocks.contains(&row.block));
            gains.extend(within.map(|row| {
                let [a, b] = [first, second]
                    .map(|unit| self.error(fitted, j, row, fitted.inside[unit]).powi(2));
                (row.t, square * (a - b))
            }));
        }
        gains.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut sum, mut least, mut at) = (0.0, 0.0, units[first].begin);
        for (k, (_, gain)) in gains.iter().enumerate() {
            sum += gain;
            if sum < least {
                (least, at) = (
                    sum,
                    gains.get(k + 1).map_or(units[second].end, |next| next.0),
                );
            }
        }
        at
    }
}
