//! The fit of one hypothesis, and the errors of every joint in blocks that were left out of it.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::LIMITS;
use super::channels::Drive;
use super::correction::{Change, Correction};
use super::problem::{Problem, Rows};
use cft_ident_core::judge::{
    BlockSums, BlocksLeftOut, ErrorGain, NUMBERS, Terms, agreement_on_share, compare,
};
use cft_ident_core::robot::Robot;

/// A hypothesis as it was fitted.
#[derive(Clone)]
pub(super) struct Trial {
    pub change: Option<Change>,
    pub by: Correction,
    pub robot: Robot,
    pub rows: Arc<Rows>,
    /// Each joint's torque counts by its own squares; 0 where it does not count.
    pub terms: Terms,
    /// Sums over all blocks.
    pub total: Vec<DMatrix<f64>>,
    /// The unknowns by all blocks.
    pub theta: DVector<f64>,
    /// The same without each block.
    pub without: Vec<DVector<f64>>,
    /// Squared errors of blocks that were left out, over the joint's squared torque, `[block][joint]`.
    left_out: Vec<Vec<f64>>,
    /// The same by the fit to all blocks.
    pub fitted: Vec<Vec<f64>>,
}

impl Trial {
    /// Fits a change upon `base` to every so many rows. `same` is a trial of these rows at `base`, whose columns serve
    /// where only torques change. None where most rows belong to no pose.
    pub fn new(
        problem: &Problem,
        (base, change): (&Correction, Option<&Change>),
        every: usize,
        same: Option<&Trial>,
    ) -> Option<Self> {
        let by = change.map_or_else(|| base.clone(), |change| base.with(change));
        let torques = change.is_none_or(Change::is_of_torques);
        let serves = torques && problem.channels.drive == Drive::Joints;
        let (robot, rows) = match same.filter(|_| serves) {
            Some(same) => (same.robot.clone(), Arc::clone(&same.rows)),
            None => {
                let robot = problem.robot_under(&by)?;
                let rows = problem.rows(&robot, &by, every)?;
                (robot, Arc::new(rows))
            }
        };
        let mix = problem.channels.mix(&by);
        let of_joint = |(j, gram): (usize, &DMatrix<f64>)| mixed(gram, &mix[j]);
        let of_block = |block: &Vec<DMatrix<f64>>| block.iter().enumerate().map(of_joint).collect();
        let sums = BlockSums {
            blocks: rows.blocks.iter().map(of_block).collect(),
            rows: Vec::new(),
        };
        let total = sums.over(0..sums.blocks.len());
        let weight = |(j, m): (usize, &DMatrix<f64>)| {
            let power = m[(m.nrows() - 1, m.nrows() - 1)];
            let counts = problem.moving()[j] && power > 0.0;
            if counts { power.recip() } else { 0.0 }
        };
        let terms = Terms {
            list: rows.terms.clone(),
            weights: total.iter().enumerate().map(weight).collect(),
            prior: (DMatrix::zeros(0, 0), DVector::zeros(0)),
            ridge: NUMBERS.ridge,
        };
        let left_out = BlocksLeftOut::new(&sums, 0, &terms)?;
        let shares = |squares: Vec<f64>| -> Vec<f64> {
            squares
                .iter()
                .zip(&terms.weights)
                .map(|(s, w)| s * w)
                .collect()
        };
        let errors: Vec<Vec<f64>> = left_out.errors().into_iter().map(shares).collect();
        let without = left_out.values().cloned().collect();
        let theta = terms.fit(&total, &[]).values;
        let fitted = (sums.blocks.iter()).map(|block| shares(terms.squares(block, &theta)));
        let fitted = fitted.collect();
        errors
            .iter()
            .flatten()
            .all(|x| x.is_finite())
            .then_some(Self {
                change: change.cloned(),
                by,
                robot,
                rows,
                terms,
                total,
                theta,
                without,
                left_out: errors,
                fitted,
            })
    }

    /// Error of each joint in blocks left out, a share of its torque.
    pub fn errors(&self) -> Vec<f64> {
        let joints = 0..self.terms.weights.len();
        joints.map(|j| self.square(&[j]).sqrt()).collect()
    }

    /// Squared error of some joints together.
    pub fn square(&self, joints: &[usize]) -> f64 {
        let of = |block: &Vec<f64>| joints.iter().map(|j| block[*j]).sum::<f64>();
        self.left_out.iter().map(of).sum()
    }

    /// The same of all joints.
    pub fn whole(&self) -> f64 {
        self.left_out.iter().flatten().sum()
    }

    /// What another trial takes off the errors of some joints.
    pub fn gain(&self, other: &Trial, joints: &[usize]) -> ErrorGain {
        compare(&self.left_out, &other.left_out, &self.only(joints))
    }

    fn only(&self, joints: &[usize]) -> Vec<f64> {
        let all = 0..self.terms.weights.len();
        all.map(|j| f64::from(u8::from(joints.contains(&j))))
            .collect()
    }
}

/// A hypothesis against another one.
pub(super) struct Compared {
    /// Joints whose error becomes smaller, beyond chance and by more than a little.
    pub better: Vec<usize>,
    /// Whether that of a joint becomes larger so.
    pub harms: bool,
    /// How far the parts of the logs agree that it takes off what a mistake does, 0..1.
    pub agreed: f64,
}

impl Compared {
    pub fn of(problem: &Problem, before: &Trial, after: &Trial) -> Self {
        let everyone: Vec<usize> = (0..before.terms.weights.len()).collect();
        let gain = before.gain(after, &everyone);
        let (b, a) = (before.errors(), after.errors());
        let changed = |j: &usize, by: f64| {
            let [value, se] = gain.joints[*j];
            value * by > NUMBERS.screen * se && a[*j] * by < b[*j] * (by - LIMITS.same)
        };
        let better: Vec<usize> = everyone
            .iter()
            .copied()
            .filter(|j| changed(j, 1.0))
            .collect();
        let only = before.only(&better);
        let errors = (&before.left_out[..], &after.left_out[..]);
        let parts = agreement_on_share(errors, &only, &problem.blocks, &NUMBERS);
        let floor = after.square(&better) <= LIMITS.floor * before.square(&better);
        let beyond = before.gain(after, &better).is_beyond(NUMBERS.screen, None);
        Self {
            harms: everyone.iter().any(|j| changed(j, -1.0)),
            agreed: if floor && beyond { parts.s } else { 0.0 },
            better,
        }
    }
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
