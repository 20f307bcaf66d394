//! The fit of one hypothesis, and the errors of every joint in blocks that were left out of it.

use std::cmp::Ordering;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::LIMITS;
use super::channels::Drive;
use super::correction::{Change, Correction};
use super::problem::Problem;
use super::rows::{RowSums, Rows};
use cft_ident_core::inertia::columns::JointTerm;
use cft_ident_core::judge::{
    ErrorGain, FitToAll, NUMBERS, Term, Terms, agreement_on_share, compare,
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
}

/// Rows as a hypothesis has them, and the terms that are fitted to them.
struct Mixed {
    by: Correction,
    robot: Robot,
    rows: Arc<Rows>,
    mix: Vec<DVector<f64>>,
    terms: Terms,
}

impl Mixed {
    /// None where most rows belong to no pose, or the whole error is surely above `most` by a part of them already.
    fn new(
        problem: &Problem,
        (base, change): (&Correction, Option<&Change>),
        (every, most): (usize, f64),
        same: &[&Trial],
    ) -> Option<Self> {
        let by = change.map_or_else(|| base.clone(), |change| base.with(change));
        let joints = problem.channels.drive == Drive::Joints;
        let serves = |same: &&&Trial| joints && same.by.moves_as(&by);
        let mix = problem.channels.mix(&by);
        let (robot, rows) = match same.iter().find(serves) {
            Some(same) => (same.robot.clone(), Arc::clone(&same.rows)),
            None => {
                let robot = problem.robot_under(&by)?;
                // torques of joints are the same whatever their positions are
                let first = same.first().filter(|_| joints && most.is_finite());
                let weights = first.map(|same| weights(problem, &same.rows.total, &mix));
                let mut expected = 0.0;
                let mut is_hopeless = |part: &RowSums| {
                    let Some(weights) = &weights else {
                        return false;
                    };
                    // what is far from hopeless is not looked at again
                    if expected > 0.0 && 2.0 * expected < most {
                        return false;
                    }
                    let terms = terms(&part.terms, weights.clone());
                    let fit = FitToAll::new(&part.sums, &mix, &terms);
                    expected = fit.least().unwrap_or(0.0);
                    fit.is_above(expected, most)
                };
                let order = hardest_first(problem.blocks.list.len(), same);
                let rows = problem.rows(&robot, &by, (every, &order), &mut is_hopeless)?;
                (robot, Arc::new(rows))
            }
        };
        let terms = terms(&rows.terms, weights(problem, &rows.total, &mix));
        Some(Self {
            by,
            robot,
            rows,
            mix,
            terms,
        })
    }

    fn fit(&self) -> FitToAll<'_> {
        FitToAll::new(&self.rows.total, &self.mix, &self.terms)
    }
}

/// By which each joint's squares count: those of its own torque, or of what varies of it where that is the smaller
/// part; 0 where it does not move.
fn weights(problem: &Problem, total: &[DMatrix<f64>], mix: &[DVector<f64>]) -> Vec<f64> {
    let weight = |(j, (sums, mix)): (usize, (&DMatrix<f64>, &DVector<f64>))| {
        let torques = sums.nrows() - mix.len();
        let of_torques = sums.view((torques, torques), (mix.len(), mix.len()));
        let power = mix.dot(&(of_torques * mix));
        let power = what_varies(problem, j, power, sums, mix).unwrap_or(power);
        let counts = problem.moving[j] && power > 0.0;
        if counts { power.recip() } else { 0.0 }
    };
    total.iter().zip(mix).enumerate().map(weight).collect()
}

/// The squares of a joint's torque without its mean, which an offset explains whatever else is wrong; none where the mean
/// is the smaller part.
fn what_varies(
    problem: &Problem,
    j: usize,
    power: f64,
    sums: &DMatrix<f64>,
    mix: &DVector<f64>,
) -> Option<f64> {
    let own = &problem.columns.own[j];
    let place = own.iter().position(|term| *term == JointTerm::Offset)?;
    let torques = sums.nrows() - mix.len();
    let column = (torques - own.len()) + place;
    let rows = sums[(column, column)];
    let sum = (sums.view((column, torques), (1, mix.len())) * mix)[0];
    let varies = power - sum * sum / rows;
    (rows > 0.0 && varies > 0.0 && varies < LIMITS.varies * power).then_some(varies)
}

fn terms(list: &[Term], weights: Vec<f64>) -> Terms {
    Terms {
        list: list.to_vec(),
        weights,
        prior: (DMatrix::zeros(0, 0), DVector::zeros(0)),
        ridge: NUMBERS.ridge,
    }
}

/// Blocks in order of their error by the first trial: what is hardest to foresee as declared shows first that a
/// hypothesis is no better.
fn hardest_first(blocks: usize, same: &[&Trial]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..blocks).collect();
    if let Some(same) = same.first() {
        let error = |b: &usize| same.left_out[*b].iter().sum::<f64>();
        order.sort_by(|a, b| error(b).total_cmp(&error(a)));
    }
    order
}

impl Trial {
    /// Fits a change upon `base` to every so many rows. `same` are trials of these rows, whose columns serve where only
    /// torques differ. None where most rows belong to no pose, or the whole error is surely above `most`.
    pub fn new(
        problem: &Problem,
        change: (&Correction, Option<&Change>),
        (every, most): (usize, f64),
        same: &[&Trial],
    ) -> Option<Self> {
        let of = Mixed::new(problem, change, (every, most), same)?;
        let order = hardest_first(of.rows.blocks(), same);
        let left_out = of.fit().blocks((&order, |b| of.rows.block(b)), most)?;
        let mut errors = left_out.errors;
        for squares in &mut errors {
            let pairs = squares.iter_mut().zip(&of.terms.weights);
            pairs.for_each(|(s, w)| *s *= w);
        }
        let finite = errors.iter().flatten().all(|x| x.is_finite());
        finite.then(|| Self {
            change: change.1.cloned(),
            by: of.by,
            robot: of.robot,
            total: mixed(&of.rows.total, &of.mix),
            rows: of.rows,
            terms: of.terms,
            theta: left_out.values,
            without: left_out.without,
            left_out: errors,
        })
    }

    /// The whole error that a fit of a correction leaves of all rows of these sums; none where it finds nothing.
    pub fn least(problem: &Problem, by: &Correction, rows: &RowSums) -> Option<f64> {
        let mix = problem.channels.mix(by);
        let terms = terms(&rows.terms, weights(problem, &rows.sums, &mix));
        FitToAll::new(&rows.sums, &mix, &terms).least()
    }

    /// Errors of each block by the fit of a change to all rows, all joints together.
    pub fn fitted(
        problem: &Problem,
        change: (&Correction, Option<&Change>),
        same: &Trial,
    ) -> Option<Vec<f64>> {
        let all = Mixed::new(problem, change, (1, f64::INFINITY), &[same])?;
        let fit = all.fit();
        let blocks = 0..all.rows.blocks();
        Some(blocks.map(|b| fit.error_of(all.rows.block(b))).collect())
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

    /// The order of trials by that error.
    pub fn order(&self, other: &Trial) -> Ordering {
        self.whole().total_cmp(&other.whole())
    }

    /// What another trial takes off the errors of some joints.
    pub fn gain(&self, other: &Trial, joints: &[usize]) -> ErrorGain {
        compare(&self.left_out, &other.left_out, &self.only(joints))
    }

    fn only(&self, joints: &[usize]) -> Vec<f64> {
        let of = |j: usize| f64::from(u8::from(joints.contains(&j)));
        (0..self.terms.weights.len()).map(of).collect()
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
        let mut better = everyone.clone();
        better.retain(|j| changed(j, 1.0));
        let only = before.only(&better);
        let errors = (&before.left_out[..], &after.left_out[..]);
        let parts = agreement_on_share(errors, &only, &problem.blocks);
        let floor = after.square(&better) <= LIMITS.floor * before.square(&better);
        let beyond = before.gain(after, &better).is_beyond(NUMBERS.screen, None);
        Self {
            harms: everyone.iter().any(|j| changed(j, -1.0)),
            agreed: if floor && beyond { parts } else { 0.0 },
            better,
        }
    }
}

/// Sums of products of each joint with the torque of its channels in one column.
fn mixed(grams: &[DMatrix<f64>], mix: &[DVector<f64>]) -> Vec<DMatrix<f64>> {
    let of_joint = |(gram, mix): (&DMatrix<f64>, &DVector<f64>)| {
        let c = gram.nrows() - mix.len();
        let mut out = DMatrix::zeros(c + 1, c + 1);
        out.view_mut((0, 0), (c, c))
            .copy_from(&gram.view((0, 0), (c, c)));
        let across = gram.view((0, c), (c, mix.len())) * mix;
        out.view_mut((0, c), (c, 1)).copy_from(&across);
        out.view_mut((c, 0), (1, c)).copy_from(&across.transpose());
        out[(c, c)] = mix.dot(&(gram.view((c, c), (mix.len(), mix.len())) * mix));
        out
    };
    grams.iter().zip(mix).map(of_joint).collect()
}
