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

/// A hypothesis as it was fitted to all blocks.
#[derive(Clone)]
pub(super) struct SetupFit {
    pub change: Option<Change>,
    pub by: Correction,
    pub robot: Robot,
    pub rows: Arc<Rows>,
    /// Each joint's torque counts by its own squares; 0 where it does not count.
    pub terms: Terms,
    sums: BlockSums,
    /// Sums over all blocks.
    pub total: Vec<DMatrix<f64>>,
    /// The unknowns by all blocks.
    pub theta: DVector<f64>,
}

/// The same with what it leaves of blocks that are left out.
#[derive(Clone)]
pub(super) struct Trial {
    pub fit: SetupFit,
    /// The unknowns without each block.
    pub without: Vec<DVector<f64>>,
    /// Squared errors of blocks that were left out, over the joint's squared torque, `[block][joint]`.
    left_out: Vec<Vec<f64>>,
}

impl SetupFit {
    /// Fits a change upon `base` to every so many rows. `same` is a fit to these rows at `base`, whose columns serve
    /// where only torques change. None where most rows belong to no pose.
    pub fn new(
        problem: &Problem,
        (base, change): (&Correction, Option<&Change>),
        every: usize,
        same: Option<&SetupFit>,
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
        let theta = terms.fit(&total, &[]).values;
        Some(Self {
            change: change.cloned(),
            by,
            robot,
            rows,
            terms,
            sums,
            total,
            theta,
        })
    }

    fn shares(&self, squares: Vec<f64>) -> Vec<f64> {
        let each = squares.iter().zip(&self.terms.weights);
        each.map(|(s, w)| s * w).collect()
    }

    /// Squared error of each block over all joints, each over its squared torque.
    pub fn of_blocks(&self) -> Vec<f64> {
        let blocks = self.sums.blocks.iter();
        let of = |block| self.shares(self.terms.squares(block, &self.theta));
        blocks.map(|block| of(block).iter().sum()).collect()
    }

    /// The least that [`Trial::whole`] can be: a block that is left out of a fit is never nearer to it.
    pub fn least(&self) -> f64 {
        self.shares(self.terms.squares(&self.total, &self.theta))
            .iter()
            .sum()
    }

    /// Leaves out each block.
    pub fn judged(self) -> Option<Trial> {
        let left_out = BlocksLeftOut::new(&self.sums, 0, &self.terms)?;
        let errors = left_out.errors().into_iter();
        let errors: Vec<Vec<f64>> = errors.map(|squares| self.shares(squares)).collect();
        let without = left_out.values().cloned().collect();
        let finite = errors.iter().flatten().all(|x| x.is_finite());
        finite.then_some(Trial {
            without,
            left_out: errors,
            fit: self,
        })
    }
}

impl Trial {
    /// A [`SetupFit`] with each block left out.
    pub fn new(
        problem: &Problem,
        changed: (&Correction, Option<&Change>),
        every: usize,
        same: Option<&Trial>,
    ) -> Option<Self> {
        SetupFit::new(problem, changed, every, same.map(|same| &same.fit))?.judged()
    }

    /// Error of each joint in blocks left out, a share of its torque.
    pub fn errors(&self) -> Vec<f64> {
        let joints = 0..self.fit.terms.weights.len();
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
        let all = 0..self.fit.terms.weights.len();
        all.map(|j| f64::from(u8::from(joints.contains(&j))))
            .collect()
    }
}

/// Places and errors on blocks left out of the `count` trials of a list that leave least, least first and of equal ones
/// the first; a fit that leaves more even of the blocks it was made of is not among them, and no block is left out of it.
pub(super) fn smallest(
    places: impl IntoIterator<Item = usize>,
    count: usize,
    fit: impl Fn(usize) -> Option<SetupFit>,
) -> Vec<(f64, usize)> {
    let mut found: Vec<(f64, usize)> = Vec::new();
    for place in places {
        let most = found.get(count - 1).map_or(f64::INFINITY, |of| of.0);
        // the least is rounded
        let near = |fit: &SetupFit| fit.least() * (1.0 - 1e-6) <= most;
        let trial = fit(place).filter(near).and_then(SetupFit::judged);
        if let Some(trial) = trial {
            found.push((trial.whole(), place));
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            found.truncate(count);
        }
    }
    found
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
        let everyone: Vec<usize> = (0..before.fit.terms.weights.len()).collect();
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
