//! Blocks of the fitted rows, and the signs that each draw gives them.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::diagnose::problem::data_split::{DataSplit, Piece};
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::normal_equations::NormalEquations;

/// Draws of the placebo: two of them may be as good as what is told from chance at 1 %.
pub const DRAWS: usize = 199;
/// Blocks, about, of long logs. Fewer tell less of their scatter, more cost more.
const MOST: usize = 96;
/// Seed of the signs.
const SEED: u64 = 19_931_983;

/// Which pieces go together, and the sign of each block in each draw.
pub struct Signs {
    /// Block of each piece; none where it is not fitted.
    pub of_piece: Vec<Option<usize>>,
    /// Number of blocks.
    pub blocks: usize,
    /// `[draw][block]`.
    pub of_draws: Vec<Vec<f64>>,
}

impl Signs {
    /// Of the pieces of a data split.
    pub fn of(pieces: &[Piece]) -> Self {
        let of_piece = divided(pieces);
        let blocks = of_piece.iter().flatten().max().map_or(0, |last| last + 1);
        let mut chance = ChaCha8Rng::seed_from_u64(SEED);
        let mut sign = || if chance.random::<bool>() { 1.0 } else { -1.0 };
        let mut draw = |_| (0..blocks).map(|_| sign()).collect();
        let of_draws: Vec<Vec<f64>> = (0..DRAWS).map(&mut draw).collect();
        Signs {
            of_piece,
            blocks,
            of_draws,
        }
    }
}

/// Blocks of the fitted rows.
pub struct Blocks {
    pub signs: Signs,
    /// Weighted sums of each block over the unknowns.
    pub sums: Vec<NormalEquations>,
    /// What data and prior of each draw pull the unknowns by, one column a draw.
    pub pulls: DMatrix<f64>,
    /// Covariance of the prior's pull.
    pub prior: DMatrix<f64>,
}

impl Blocks {
    /// Blocks of neighbouring pieces of one stretch, and their draws. `rows_per_independent` says how many rows the
    /// prior counts as one.
    pub fn of(at: &FittedModel, split: &DataSplit, rows_per_independent: f64) -> Self {
        let signs = Signs::of(&split.pieces);
        let u = at.base.unknowns.len();
        let none = |_| NormalEquations::none(u);
        let mut sums: Vec<NormalEquations> = (0..signs.blocks).map(none).collect();
        for (block, of_joints) in signs.of_piece.iter().zip(&at.base.sums) {
            if let Some(block) = block {
                at.base.add(of_joints, &at.weights, &mut sums[*block]);
            }
        }
        let prior = &at.information * rows_per_independent;
        let mut pulls = prior_draws(&prior, &mut ChaCha8Rng::seed_from_u64(SEED + 1));
        for (signs, mut pull) in signs.of_draws.iter().zip(pulls.column_iter_mut()) {
            for (sign, sums) in signs.iter().zip(&sums) {
                pull.axpy(*sign, &sums.score, 1.0);
            }
        }
        Blocks {
            signs,
            sums,
            pulls,
            prior,
        }
    }
}

/// Block of each piece. Blocks hold equally many pieces and end with their stretch, or where pieces that are not
/// fitted part it.
fn divided(pieces: &[Piece]) -> Vec<Option<usize>> {
    let fitted = pieces.iter().filter(|p| p.role.fitted());
    let rows: usize = fitted.clone().map(|p| p.rows.len()).sum();
    let longest = fitted.map(|p| p.rows.len()).max().unwrap_or(1);
    // a piece is some correlation times long, and so is a block; the short ones at the ends of folds join others
    let least = (rows / MOST).max(longest * 3 / 5).max(1);
    let mut found = Vec::with_capacity(pieces.len());
    let (mut block, mut filled): (Option<usize>, usize) = (None, 0);
    let mut before: Option<&Piece> = None;
    for piece in pieces {
        if !piece.role.fitted() {
            found.push(None);
            continue;
        }
        let follows =
            before.is_some_and(|b| b.stretch == piece.stretch && b.rows.end == piece.rows.start);
        // what is left of a stretch, too short for a block of its own, stays with the one before
        if block.is_none() || filled >= least || !follows {
            block = Some(block.map_or(0, |b| b + 1));
            filled = 0;
        }
        filled += piece.rows.len();
        before = Some(piece);
        found.push(block);
    }
    found
}

/// Normal draws with a covariance, one column each; zeros where it has no Cholesky factor.
fn prior_draws(covariance: &DMatrix<f64>, chance: &mut ChaCha8Rng) -> DMatrix<f64> {
    let u = covariance.nrows();
    let known: Vec<usize> = (0..u).filter(|i| covariance[(*i, *i)] > 0.0).collect();
    let mut draws = DMatrix::zeros(u, DRAWS);
    let root = |i: usize| covariance[(known[i], known[i])].sqrt();
    let n = known.len();
    // the unknowns that share no information have rows of zeros; a little more of the diagonal keeps the factor
    let scaled = DMatrix::from_fn(n, n, |a, b| {
        let x = covariance[(known[a], known[b])] / (root(a) * root(b));
        if a == b { x + 1e-9 } else { x }
    });
    let Some(factor) = Cholesky::new(scaled) else {
        return draws;
    };
    let lower = factor.l();
    for mut column in draws.column_iter_mut() {
        let normal: Vec<f64> = (0..n)
            .map(|_| chance.sample(rand_distr::StandardNormal))
            .collect();
        let drawn = &lower * DVector::from_vec(normal);
        for (i, x) in known
            .iter()
            .zip(&drawn)
            .enumerate()
            .map(|(a, (i, x))| (*i, root(a) * x))
        {
            column[i] = x;
        }
    }
    draws
}
