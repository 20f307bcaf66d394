//! The one pass over all rows: columns of the declared unknowns and of candidates, with the measured torque and the
//! residual, weighed where a joint stands or turns, through the parallel filter, folded into sums per block and joint.
//!
//! Long stretches are walked in windows, so that memory does not grow with them. A window begins a lead early, in which
//! what remembers finds its state. Of very long logs every m-th row is summed: neighbours in the kept band repeat
//! each other.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::constant_columns::{ConstantColumns, ConstantRows};
use super::data_split::DataSplit;
use super::unknowns::{DiagnosisUnknowns, Unknown};
use crate::effect::{AugmentedModel, EffectScene, ModelEffect, StretchTorques, shifted};
use crate::judge::{BlockSums, Bound, Term, TimeBlock};
use crate::motion::{FilterDesign, MotionError, ParallelFilters, Stretch};
use crate::robot::Robot;
use crate::robot::model::JointFriction;

/// Channels that are filtered side by side.
pub const LANES: usize = 8;
/// Samples of a window besides its lead.
const WINDOW: usize = 16_384;
/// Samples before a window from which memory runs, and behind it.
const LEAD: usize = 2048;
/// Windows whose sums are held at a time.
const TOGETHER: usize = 4;
/// Rows that are summed of all logs, about.
const MOST_ROWS: usize = 40_000;

/// Rows and what each of them counts.
#[derive(Clone, Copy)]
pub struct WeightedRows<'a> {
    pub stretches: &'a [Stretch],
    pub filters: &'a ParallelFilters,
    pub split: &'a DataSplit,
    /// Speed up to which each joint rests [m/s or rad/s].
    pub rest_speed: &'a [f64],
    /// Columns that no model changes, of these very stretches.
    pub constant: Option<&'a ConstantColumns>,
}

/// An effect at a place in one shape, with bounds of its coefficients; without any it has no columns.
#[derive(Debug, Clone)]
pub struct EffectCandidate {
    pub effect: ModelEffect,
    pub bounds: Vec<Bound>,
    /// Shape parameters whose slopes of its torque are columns too, with bounds of a step.
    pub slopes: Vec<(usize, Bound)>,
}

impl EffectCandidate {
    /// Takes its columns away.
    pub fn clear_columns(&mut self) {
        self.bounds.clear();
        self.slopes.clear();
    }

    /// Bounds of its coefficients, then of its slopes: of each of its columns in the rows of a joint.
    fn bounds(&self) -> impl Iterator<Item = Bound> {
        let slopes = self.slopes.iter().map(|(_, bound)| *bound);
        self.bounds.iter().copied().chain(slopes)
    }

    /// Whether it has columns in the rows of a joint.
    fn has_columns(&self, joint: usize) -> bool {
        self.effect.place.touches(joint) && self.bounds().next().is_some()
    }

    /// Columns in the rows of a joint: of its coefficients, then slopes.
    fn columns(&self, scene: &EffectScene, joint: usize) -> Vec<Vec<f64>> {
        let mut out = self.effect.columns(scene, joint);
        out.truncate(self.bounds.len());
        for (k, _) in &self.slopes {
            let little = self.effect.law.slope_step;
            let by = match self.effect.shape[*k] {
                0.0 => little,
                p => little * p.abs(),
            };
            let at = |by: f64| {
                let mut moved = self.effect.clone();
                moved.shape[*k] += by;
                let mut torque = vec![0.0; scene.len()];
                moved.torque(scene, joint, &mut torque);
                torque
            };
            let sides = at(by).into_iter().zip(at(-by));
            out.push(sides.map(|(a, b)| (a - b) / (2.0 * by)).collect());
        }
        out
    }
}

/// Where the columns of unknowns and candidates stand in the rows of each joint.
#[derive(Clone)]
pub struct ColumnLayout {
    pub declared: Vec<Term>,
    /// Terms of what is held.
    pub held: Vec<Term>,
    /// Terms of each candidate, as many as it has coefficients.
    pub candidates: Vec<Vec<Term>>,
    /// Terms of each candidate's slopes.
    pub slopes: Vec<Vec<Term>>,
    /// Column of each joint's measured torque, behind unknowns and candidates; the residual stands last.
    pub torques: Vec<usize>,
}

impl ColumnLayout {
    pub fn of(unknowns: &DiagnosisUnknowns, candidates: &[EffectCandidate]) -> Self {
        let joints = unknowns.columns.len();
        let term = |bound| Term {
            columns: Vec::new(),
            bound,
        };
        let mut declared = vec![term(Bound::NONE); unknowns.len() + unknowns.held.len()];
        for (j, own) in unknowns.columns.iter().enumerate() {
            for (column, i) in own.iter().enumerate() {
                declared[*i].columns.push((j, column));
            }
        }
        let mut torques: Vec<usize> = unknowns.columns.iter().map(Vec::len).collect();
        let terms = candidates.iter().map(|c| {
            let mut terms: Vec<Term> = c.bounds().map(term).collect();
            for j in (0..joints).filter(|j| c.has_columns(*j)) {
                for term in &mut terms {
                    term.columns.push((j, torques[j]));
                    torques[j] += 1;
                }
            }
            let slopes = terms.split_off(c.bounds.len());
            (terms, slopes)
        });
        let (candidates, slopes) = terms.unzip();
        ColumnLayout {
            held: declared.split_off(unknowns.len()),
            declared,
            candidates,
            slopes,
            torques,
        }
    }
}

/// Sums over blocks of the columns of a model's unknowns and of candidates beside it.
pub fn pass(
    model: &AugmentedModel,
    (unknowns, candidates): (&DiagnosisUnknowns, &[EffectCandidate]),
    layout: &ColumnLayout,
    data: &WeightedRows,
    blocks: &[TimeBlock],
) -> Result<BlockSums, MotionError> {
    let columns: Vec<usize> = layout.torques.iter().map(|torque| torque + 1).collect();
    let mut sums = BlockSums::zeros(blocks.len(), &columns);
    let pieces = blocks.iter().flat_map(|b| &b.pieces);
    let rows: usize = pieces.map(|(_, rows)| rows.len()).sum();
    let every = rows.div_ceil(MOST_ROWS).max(1);
    let windows = windows(data, blocks);
    for some in windows.chunks(TOGETHER) {
        let found: Vec<Vec<DMatrix<f64>>> = some
            .par_iter()
            .map(|(stretch, rows)| {
                let window = Window::of(model, data, *stretch, rows);
                window.rows(unknowns, candidates, layout)
            })
            .collect::<Result<_, _>>()?;
        for ((stretch, range), rows) in some.iter().zip(found) {
            fold(&mut sums, blocks, (*stretch, range), (&rows, every));
        }
    }
    Ok(sums)
}

/// Windows over the rows that blocks need.
pub fn windows(data: &WeightedRows, blocks: &[TimeBlock]) -> Vec<(usize, Range<usize>)> {
    let mut out = Vec::new();
    for (index, stretch) in data.stretches.iter().enumerate() {
        let pieces = blocks.iter().flat_map(|b| &b.pieces);
        let own = || pieces.clone().filter(|(s, _)| *s == index).map(|(_, r)| r);
        let first = own().map(|r| r.start).min().unwrap_or(0);
        let last = own().map(|r| r.end).max().unwrap_or(0);
        let step = (WINDOW / data.filters.of(stretch).decimation).max(1);
        let begins = (first..last).step_by(step);
        out.extend(begins.map(|begin| (index, begin..(begin + step).min(last))));
    }
    out
}

/// Rows of a block in a window, from the window's begin on; the first is one of every `every`-th of the stretch.
pub fn in_window<'a>(
    block: &'a TimeBlock,
    (stretch, window): (usize, &'a Range<usize>),
    every: usize,
) -> impl Iterator<Item = Range<usize>> + 'a {
    let own = block.pieces.iter().filter(move |(s, _)| *s == stretch);
    own.filter_map(move |(_, piece)| {
        let first = piece.start.max(window.start).next_multiple_of(every);
        let end = piece.end.min(window.end);
        (first < end).then(|| first - window.start..end - window.start)
    })
}

/// Adds the rows of a window to the blocks that they lie in.
fn fold(
    sums: &mut BlockSums,
    blocks: &[TimeBlock],
    window: (usize, &Range<usize>),
    (rows, every): (&[DMatrix<f64>], usize),
) {
    for (b, block) in blocks.iter().enumerate() {
        for range in in_window(block, window, every) {
            let kept = range.len().div_ceil(every);
            let joints = rows.iter().zip(&mut sums.blocks[b]).zip(&mut sums.rows[b]);
            for ((rows, total), count) in joints.filter(|((rows, _), _)| rows.nrows() > 0) {
                let part = rows.rows_with_step(range.start, kept, every - 1);
                let part = part.into_owned();
                total.gemm(1.0, &part.transpose(), &part, 1.0);
                *count += kept as f64;
            }
        }
    }
}

/// A piece of one stretch with what a model makes of it.
pub struct Window<'a> {
    model: &'a AugmentedModel,
    data: &'a WeightedRows<'a>,
    parallel: &'a FilterDesign,
    stretch: usize,
    /// Samples, from the begin of the lead on.
    pub part: Stretch,
    torques: StretchTorques,
    regressor: OnceLock<Vec<Vec<Vec<f64>>>>,
    /// Rows of the stretch that are wanted, and the row that the part begins with.
    range: Range<usize>,
    begin: usize,
}

impl<'a> Window<'a> {
    pub fn of(
        model: &'a AugmentedModel,
        data: &'a WeightedRows,
        index: usize,
        range: &Range<usize>,
    ) -> Self {
        let stretch = &data.stretches[index];
        let parallel = data.filters.of(stretch);
        let begin = range.start.saturating_sub(LEAD / parallel.decimation);
        let last = parallel.sample_of(range.end - 1);
        let end = (last + parallel.trim + 1 + LEAD).min(stretch.len());
        let part = stretch.part(begin * parallel.decimation, end);
        Window {
            torques: model.torques(&part),
            regressor: OnceLock::new(),
            model,
            data,
            parallel,
            stretch: index,
            part,
            range: range.clone(),
            begin,
        }
    }

    pub fn scene(&self) -> EffectScene<'_> {
        EffectScene {
            robot: &self.model.model.robot,
            theta: &self.model.model.theta,
            laws: &self.model.model.friction,
            stretch: &self.part,
            hat: &self.torques.hat,
            load: &self.torques.load,
            direction: &self.torques.direction,
            tilt: Some(&self.torques.tilt),
        }
    }

    /// Rows of every joint, one column each; none of joints that are stationary.
    fn rows(
        &self,
        unknowns: &DiagnosisUnknowns,
        candidates: &[EffectCandidate],
        layout: &ColumnLayout,
    ) -> Result<Vec<DMatrix<f64>>, MotionError> {
        let of_joint = |j: usize| match self.data.split.is_stationary(self.stretch, j) {
            true => Ok(DMatrix::zeros(0, layout.torques[j] + 2)),
            false => self.rows_of(j, unknowns, candidates),
        };
        (0..layout.torques.len()).map(of_joint).collect()
    }

    /// Rows of one joint: columns of the unknowns, of candidates, the torque and the residual.
    pub fn rows_of(
        &self,
        j: usize,
        unknowns: &DiagnosisUnknowns,
        candidates: &[EffectCandidate],
    ) -> Result<DMatrix<f64>, MotionError> {
        let (model, part) = (self.model, &self.part);
        let scene = self.scene();
        let own: Vec<Unknown> = (unknowns.columns[j].iter())
            .map(|i| unknowns.of_column(*i))
            .collect();
        let constant = self.constant_rows(j, &own)?;
        let mut friction = friction_columns(&model.model.friction[j], &part.v[j]);
        let mut raw: Vec<Vec<f64>> = (own.iter())
            .filter_map(|unknown| match unknown {
                Unknown::Friction { k, .. } => Some(std::mem::take(&mut friction[*k])),
                _ => None,
            })
            .collect();
        let constants = own.len() - raw.len();
        for candidate in candidates.iter().filter(|c| c.has_columns(j)) {
            raw.extend(candidate.columns(&scene, j));
        }
        let mut hat = self.torques.hat[j].clone();
        let late = self.late(j);
        raw.iter_mut().for_each(|column| shifted(column, late));
        shifted(&mut hat, late);
        let tau = &part.tau[j];
        raw.push(tau.clone());
        raw.push(tau.iter().zip(&hat).map(|(tau, hat)| tau - hat).collect());
        let width = constants + raw.len();
        let changing = self.filtered(raw, &self.weights(j))?;
        let mut changing = changing.iter();
        let mut out = DMatrix::zeros(self.range.len(), width);
        for (c, mut column) in out.column_iter_mut().enumerate() {
            let same = own.get(c).and_then(|unknown| find(&constant, unknown));
            if let Some(rows) = same.or_else(|| changing.next()) {
                column.copy_from_slice(rows);
            }
        }
        Ok(out)
    }

    /// Rows of a joint's unknowns that no model changes; made once where the model shifts no torque in time.
    fn constant_rows(
        &self,
        j: usize,
        unknowns: &[Unknown],
    ) -> Result<Arc<ConstantRows>, MotionError> {
        let changes = |u: &&Unknown| matches!(u, Unknown::Friction { .. });
        let wanted: Vec<Unknown> = unknowns.iter().filter(|u| !changes(u)).copied().collect();
        let late = self.late(j);
        let stored = self.data.constant.filter(|_| late == 0.0);
        let window = (self.stretch, self.range.clone(), j);
        if let Some(rows) = stored.and_then(|stored| stored.get(&window, &wanted)) {
            return Ok(rows);
        }
        let column = |unknown: &Unknown| {
            let mut column = match unknown {
                Unknown::Theta(c) => self.regressor()[j][*c].clone(),
                _ => vec![1.0; self.part.len()],
            };
            shifted(&mut column, late);
            column
        };
        let raw = wanted.iter().map(column).collect();
        let rows = self.filtered(raw, &self.weights(j))?;
        let rows = Arc::new(wanted.into_iter().zip(rows).collect());
        if let Some(stored) = stored {
            stored.put(window, &rows);
        }
        Ok(rows)
    }

    /// Regressor of the inertial parameters, `[joint][parameter][sample]`.
    fn regressor(&self) -> &[Vec<Vec<f64>>] {
        let made = || regressor(&self.model.model.robot, &self.part);
        self.regressor.get_or_init(made)
    }

    /// Samples by which the torque of a joint is late.
    pub fn late(&self, j: usize) -> f64 {
        self.model.shift(j) / self.part.dt
    }

    /// Weights of the samples of a joint; none where all weigh the same.
    pub fn weights(&self, j: usize) -> Vec<f64> {
        match self.model.model.friction[j] {
            JointFriction::None => Vec::new(),
            // both sides of the model, where the joint stands or turns, weigh nothing before any filter
            _ => (self.parallel).weights(&self.part, j, self.data.rest_speed[j]),
        }
    }

    /// The rows that are wanted of any number of channels of weighed samples.
    fn filtered(
        &self,
        mut raw: Vec<Vec<f64>>,
        weights: &[f64],
    ) -> Result<Vec<Vec<f64>>, MotionError> {
        let mut rows = Vec::with_capacity(raw.len());
        for group in raw.chunks_mut(LANES) {
            rows.extend(self.kept(group, weights)?);
        }
        Ok(rows)
    }

    /// The rows that are wanted of some channels of weighed samples.
    pub fn kept(
        &self,
        raw: &mut [Vec<f64>],
        weights: &[f64],
    ) -> Result<Vec<Vec<f64>>, MotionError> {
        for column in raw.iter_mut() {
            column.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
        }
        let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
        let (skip, count) = (self.range.start - self.begin, self.range.len());
        let own = |rows: Vec<f64>| {
            let mut kept: Vec<f64> = rows.into_iter().skip(skip).take(count).collect();
            kept.resize(count, 0.0);
            kept
        };
        let rows = self.parallel.run(&channels)?;
        Ok(rows.into_iter().map(own).collect())
    }
}

/// Rows of an unknown among those that no model changes.
fn find<'a>(rows: &'a ConstantRows, unknown: &Unknown) -> Option<&'a Vec<f64>> {
    let own = rows.iter().find(|(own, _)| own == unknown);
    own.map(|(_, rows)| rows)
}

/// Regressor of the inertial parameters along a stretch, `[joint][parameter][sample]`.
fn regressor(robot: &Robot, stretch: &Stretch) -> Vec<Vec<Vec<f64>>> {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let samples = stretch.len();
    let mut out = vec![vec![vec![0.0; samples]; p]; n];
    let mut y = vec![0.0; n * p];
    let [mut q, mut v, mut a] = [(); 3].map(|()| vec![0.0; n]);
    for k in 0..samples {
        stretch.at(k, &mut q, &mut v, &mut a);
        robot.regressor(&q, &v, &a, &mut y);
        for (columns, row) in out.iter_mut().zip(y.chunks_exact(p)) {
            for (column, y) in columns.iter_mut().zip(row) {
                column[k] = *y;
            }
        }
    }
    out
}

/// Gradient of a friction law along a motion, `[parameter][sample]`.
fn friction_columns(law: &JointFriction, v: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![0.0; v.len()]; law.parameters()];
    let mut gradient = [0.0; 5];
    for (i, v) in v.iter().enumerate() {
        law.gradient(*v, &mut gradient);
        for (column, g) in columns.iter_mut().zip(&gradient) {
            column[i] = *g;
        }
    }
    columns
}
