//! Base parameters: the combinations of standard parameters that torques can determine.
//!
//! The columns of the standard regressor on random states are orthogonalised in a fixed order, from
//! the base outward (the QR factorisation of Gautier 1990, without exchange of columns). A column
//! that adds nothing to those before it belongs to no parameter of its own; its coefficients say
//! into which parameters it is grouped. The order, and with it the grouping, is the same from run to
//! run and is that of Khalil and Dombre: a link's mass goes into the link before it.

use super::links::{MOST_JOINTS, Tree};
use super::newton_euler::walk;
use crate::math::lanes::{LaneWork, Simd, widest};
use crate::math::rfactor::dot;
use crate::robot::joint::JointKind;
use crate::robot::standard::STANDARD;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A column whose new part is below this share of its norm depends on those before it.
const TOLERANCE: f64 = 1e-9;
/// A coefficient below this is rounding.
const ROUNDING: f64 = 1e-9;

/// One base parameter: a kept standard parameter and what is grouped into it.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterGroup {
    /// Index of the kept standard parameter.
    pub kept: usize,
    /// Indices of the parameters grouped into it, with their coefficients.
    pub terms: Vec<(usize, f64)>,
}

/// Number of standard parameters: ten a link, then a drive inertia a joint where they are modelled.
pub fn standard_parameters(tree: &Tree, drive_inertia: bool) -> usize {
    tree.links().len() * STANDARD + if drive_inertia { tree.joints() } else { 0 }
}

/// The base parameters in the order of their kept parameters.
pub fn groupings(tree: &Tree, drive_inertia: bool) -> Vec<ParameterGroup> {
    let n = tree.joints();
    let p = standard_parameters(tree, drive_inertia);
    let states = (3 * p).div_ceil(n) + 8;
    let rows = states * n;
    let mut columns = vec![vec![0.0; rows]; p];
    let mut chance = ChaCha8Rng::seed_from_u64(0x0ba5e);
    let mut draw = |scale: f64| scale * (2.0 * chance.random::<f64>() - 1.0);
    let reach: Vec<f64> = (0..n)
        .map(|j| match tree.joint_kind(j) {
            JointKind::Prismatic => 0.7,
            JointKind::Revolute => 3.0,
        })
        .collect();
    for s in 0..states {
        let mut state = [[0.0; MOST_JOINTS]; 3];
        for (x, reach) in state[0].iter_mut().zip(&reach) {
            *x = draw(*reach);
        }
        for (k, scale) in [(1, 2.0), (2, 8.0)] {
            state[k][..n].fill_with(|| draw(scale));
        }
        walk(tree, &state[0], &state[1], &state[2], |i, k, row| {
            for (c, x) in row.iter().enumerate() {
                columns[i * STANDARD + c][s * n + k] = *x;
            }
        });
        if drive_inertia {
            for (j, a) in state[2].iter().enumerate().take(n) {
                columns[p - n + j][s * n + j] = *a;
            }
        }
    }
    let mut moved_by: Vec<u64> = Vec::with_capacity(p);
    for i in 0..tree.links().len() {
        let joints = tree.upstream(i).iter().fold(0, |all, j| all | 1 << j);
        moved_by.extend([joints; STANDARD]);
    }
    moved_by.extend((moved_by.len()..p).map(|drive| 1 << (drive + n - p)));
    group(&columns, &moved_by)
}

/// Orthogonalises columns in their order; those that no joint moves both (by the bits of `moved_by`) are so already.
fn group(columns: &[Vec<f64>], moved_by: &[u64]) -> Vec<ParameterGroup> {
    let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let largest = columns.iter().map(|c| norm(c)).fold(0.0, f64::max);
    let mut basis: Vec<(Vec<f64>, u64)> = Vec::new();
    // R, column by column: coefficients of the kept columns in the orthonormal basis
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut found: Vec<ParameterGroup> = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        let size = norm(column);
        if size <= TOLERANCE * largest {
            continue;
        }
        let mut rest = column.clone();
        let mut along = vec![0.0; basis.len()];
        // what is taken off has rows of its own
        let mut joints = moved_by[index];
        // twice, so that rounding does not add up
        for _ in 0..2 {
            for ((b, of), total) in basis.iter().zip(&mut along) {
                if of & joints == 0 {
                    continue;
                }
                *total += widest(ColumnProjection {
                    of: &mut rest,
                    along: b,
                });
                joints |= of;
            }
        }
        let left = norm(&rest);
        if left > TOLERANCE * size {
            for x in &mut rest {
                *x /= left;
            }
            basis.push((rest, joints));
            along.push(left);
            triangle.push(along);
            found.push(ParameterGroup {
                kept: index,
                terms: Vec::new(),
            });
            continue;
        }
        // back substitution: the column is this combination of the kept ones
        for i in (0..along.len()).rev() {
            let share = along[i] / triangle[i][i];
            for (x, r) in along.iter_mut().zip(&triangle[i]).take(i) {
                *x -= share * r;
            }
            if share.abs() > ROUNDING {
                found[i].terms.push((index, tidy(share)));
            }
        }
    }
    found
}

/// Takes off what a column has along a unit one: how much that is.
struct ColumnProjection<'a> {
    of: &'a mut [f64],
    along: &'a [f64],
}

impl LaneWork for ColumnProjection<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> f64 {
        let part = dot(self.of, self.along);
        for (x, b) in self.of.iter_mut().zip(self.along) {
            *x -= part * b;
        }
        part
    }
}

/// A number near a round one of nine decimals is that one.
fn tidy(x: f64) -> f64 {
    let round = (x * 1e9).round() / 1e9;
    if (x - round).abs() < 1e-10 { round } else { x }
}
