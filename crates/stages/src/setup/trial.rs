//! The fit of one hypothesis, and the errors of every joint in blocks that were left out of it.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::LIMITS;
use super::channels::Drive;
use super::correction::{Change, Correction};
use super::problem::{Problem, Rows};
use cft_ident_core::robot::Robot;

/// Part of a column's own square that is added to the diagonal: what the data determine less stays small.
const RIDGE: f64 = 1e-6;

/// A hypothesis as it was fitted.
#[derive(Clone)]
pub(super) struct Trial {
    pub change: Option<Change>,
    pub by: Correction,
    pub robot: Robot,
    rows: Arc<Rows>,
    /// Of each joint, its columns' products, the torque last, `[block][joint]`.
    pub sums: Vec<Vec<DMatrix<f64>>>,
    /// Sum of squares of each joint's torque; 0 where it does not count.
    pub power: Vec<f64>,
    pub theta: DVector<f64>,
    /// The unknowns by all blocks but one.
    pub without: Vec<DVector<f64>>,
    /// Squared errors of blocks that were left out, over the joint's power, `[block][joint]`.
    pub left_out: Vec<Vec<f64>>,
}

impl Trial {
    /// Fits a change upon `base` to these rows. `same` is a trial of these rows at `base`, whose columns serve where
    /// only torques change. None where most rows belong to no pose.
    pub fn new(
        problem: &Problem,
        (base, change): (&Correction, Option<&Change>),
        (rows, blocks): (&[usize], usize),
        same: Option<&Trial>,
    ) -> Option<Self> {
        let by = change.map_or_else(|| base.clone(), |change| base.with(change));
        let torques = change.is_none_or(Change::is_of_torques);
        let serves = torques && problem.channels.drive == Drive::Joints;
        let (robot, rows) = match same.filter(|_| serves) {
            Some(same) => (same.robot.clone(), Arc::clone(&same.rows)),
            None => {
                let robot = problem.robot_under(&by)?;
                let rows = problem.rows(&robot, &by, rows, blocks)?;
                (robot, Arc::new(rows))
            }
        };
        let mix = problem.channels.mix(&by);
        let of_joint = |(j, gram): (usize, &DMatrix<f64>)| mixed(gram, &mix[j]);
        let sums: Vec<Vec<DMatrix<f64>>> = (rows.blocks.iter())
            .map(|block| block.iter().enumerate().map(of_joint).collect())
            .collect();
        let total = total(&sums);
        let power = |(j, m): (usize, &DMatrix<f64>)| match problem.moving()[j] {
            true => m[(m.nrows() - 1, m.nrows() - 1)],
            false => 0.0,
        };
        let mut out = Self {
            change: change.cloned(),
            by,
            robot,
            power: total.iter().enumerate().map(power).collect(),
            rows,
            sums,
            theta: DVector::zeros(0),
            without: Vec::new(),
            left_out: Vec::new(),
        };
        out.fit(&total)?;
        Some(out)
    }

    fn fit(&mut self, total: &[DMatrix<f64>]) -> Option<()> {
        let (normal, right) = self.system(total);
        let ridge: Vec<f64> = normal.diagonal().iter().map(|x| RIDGE * x).collect();
        let solve = |mut a: DMatrix<f64>, b: &DVector<f64>| {
            for (i, ridge) in ridge.iter().enumerate() {
                a[(i, i)] += if *ridge > 0.0 { *ridge } else { 1.0 };
            }
            Some(a.cholesky()?.solve(b))
        };
        self.theta = solve(normal.clone(), &right)?;
        for block in &self.sums {
            let (own, side) = self.system(block);
            let theta = solve(&normal - own, &(&right - side))?;
            self.left_out.push(self.squares(block, &theta));
            self.without.push(theta);
        }
        let finite = self.left_out.iter().flatten().all(|x| x.is_finite());
        finite.then_some(())
    }

    /// Normal matrix and right side of some sums, each joint by its torque's power.
    fn system(&self, sums: &[DMatrix<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let u = self.rows.unknowns;
        let (mut normal, mut right) = (DMatrix::zeros(u, u), DVector::zeros(u));
        for (j, sums) in sums
            .iter()
            .enumerate()
            .filter(|(j, _)| self.power[*j] > 0.0)
        {
            let (places, w) = (&self.rows.places[j], self.power[j].recip());
            for (k, &at) in places.iter().enumerate() {
                right[at] += w * sums[(k, places.len())];
                for (i, &row) in places.iter().enumerate() {
                    normal[(row, at)] += w * sums[(i, k)];
                }
            }
        }
        (normal, right)
    }

    /// Squared errors of each joint in some rows, over its power.
    fn squares(&self, sums: &[DMatrix<f64>], theta: &DVector<f64>) -> Vec<f64> {
        let of = |(j, sums): (usize, &DMatrix<f64>)| {
            let places = &self.rows.places[j];
            let whole = DVector::from_fn(places.len() + 1, |i, _| match places.get(i) {
                Some(at) => -theta[*at],
                None => 1.0,
            });
            match self.power[j] > 0.0 {
                true => (whole.dot(&(sums * &whole)) / self.power[j]).max(0.0),
                false => 0.0,
            }
        };
        sums.iter().enumerate().map(of).collect()
    }

    /// Squared errors of each block by the fit to all, all joints together.
    pub fn fitted(&self) -> Vec<f64> {
        let of = |block: &Vec<DMatrix<f64>>| self.squares(block, &self.theta).iter().sum();
        self.sums.iter().map(of).collect()
    }

    /// Error of each joint in blocks left out, a share of its torque.
    pub fn errors(&self) -> Vec<f64> {
        let joints = self.power.len();
        let of = |j: usize| {
            self.left_out
                .iter()
                .map(|block| block[j])
                .sum::<f64>()
                .sqrt()
        };
        (0..joints).map(of).collect()
    }

    /// Squared error of some joints together.
    pub fn square(&self, joints: &[usize]) -> f64 {
        let of = |block: &Vec<f64>| joints.iter().map(|j| block[*j]).sum::<f64>();
        self.left_out.iter().map(of).sum()
    }
}

/// What the second hypothesis takes off the squared errors of blocks left out, in standard errors of their sum.
pub(super) fn gain(before: &Trial, after: &Trial, joints: &[usize]) -> f64 {
    let pairs = before.left_out.iter().zip(&after.left_out);
    let of = |(b, a): (&Vec<f64>, &Vec<f64>)| joints.iter().map(|j| b[*j] - a[*j]).sum::<f64>();
    let gains: Vec<f64> = pairs.map(of).collect();
    let count = gains.len() as f64;
    let sum: f64 = gains.iter().sum();
    let scatter: f64 = gains.iter().map(|g| (g - sum / count).powi(2)).sum();
    sum / (scatter / (count - 1.0) * count)
        .sqrt()
        .max(f64::MIN_POSITIVE)
}

/// Joints whose error a change makes smaller, and whether it makes none larger.
pub(super) fn compared(before: &Trial, after: &Trial) -> (Vec<usize>, bool) {
    let (b, a) = (before.errors(), after.errors());
    let better = (0..b.len())
        .filter(|j| a[*j] < b[*j] * (1.0 - LIMITS.same))
        .collect();
    let worse = b.iter().zip(&a).any(|(b, a)| *a > *b * (1.0 + LIMITS.same));
    (better, !worse)
}

fn mixed(gram: &DMatrix<f64>, mix: &DVector<f64>) -> DMatrix<f64> {
    let c = gram.nrows() - mix.len();
    let mut out = DMatrix::zeros(c + 1, c + 1);
    out.view_mut((0, 0), (c, c))
        .copy_from(&gram.view((0, 0), (c, c)));
    let across = gram.view((0, c), (c, mix.len())) * mix;
    out.view_mut((0, c), (c, 1)).copy_from(&across);
    out.view_mut((c, 0), (1, c)).copy_from(&across.transpose());
    out[(c, c)] = mix.dot(&(gram.view((c, c), (mix.len(), mix.len())) * mix));
    out
}

/// The sums over all blocks.
pub(super) fn total(sums: &[Vec<DMatrix<f64>>]) -> Vec<DMatrix<f64>> {
    let mut out = sums.first().cloned().unwrap_or_default();
    for block in sums.iter().skip(1) {
        (out.iter_mut().zip(block)).for_each(|(sum, x)| *sum += x);
    }
    out
}
