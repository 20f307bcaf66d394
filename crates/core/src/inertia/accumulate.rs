//! Block factors that replace the stacked matrix (42): one R factor per joint and block of time.
//!
//! Blocks keep what a covariance under correlated residuals needs, the score of any parameter
//! vector over a stretch of time, without a second reading. Their number is bounded: when there
//! are too many, neighbours merge and the block length doubles. What is kept of a log for a linear fit is
//! smaller (`condense`).

use nalgebra::{DMatrix, DMatrixView, DVector, DVectorView};
use serde::{Deserialize, Serialize};

use super::by_speed::BySpeed;
use super::columns::{GRADIENT, RegressorColumns};
use super::scores::BlockScores;
use crate::math::rfactor::RFactor;

/// Most blocks that are kept per joint.
const MOST_BLOCKS: usize = 512;

/// One block of time: the R factor of each joint's rows.
#[derive(Debug, Clone, Default)]
pub struct BlockFactor {
    /// Of the logs that were merged.
    pub log: usize,
    /// Uninterrupted stretch that the block belongs to; correlation ends at its borders.
    pub stretch: usize,
    /// Times of the first and the last row [s]; equal where they are not known.
    pub span: [f64; 2],
    /// Instants.
    pub rows: u64,
    /// Upper triangle per joint, or its rows where they are fewer than the columns, which are those of
    /// [`RegressorColumns::row_width`].
    pub r: Vec<DMatrix<f64>>,
    /// Where this is a whole log, the scores of its parts in time.
    pub scores: Option<BlockScores>,
}

/// Accumulates filtered, decimated rows.
#[derive(Debug, Clone)]
pub struct RowAccumulator {
    columns: RegressorColumns,
    open: Vec<RFactor>,
    open_rows: u64,
    /// Times of the open block, and that of the row to come [s].
    open_span: [f64; 2],
    now: f64,
    stretch: usize,
    /// Length of a block [s], and in rows once the first is there.
    block_seconds: f64,
    block_rows: Option<u64>,
    blocks: Vec<BlockFactor>,
    /// Rows in which each joint moves, in a block or in the open one.
    moving: Vec<JointRows>,
    /// Those in which it rests.
    resting: Vec<(JointRows, RFactor)>,
    by_speed: Vec<BySpeed>,
    rows: u64,
}

/// How many rows of a joint there are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointRows {
    pub count: u64,
    /// Squared norm of the filtered torque.
    pub torque_square: f64,
}

impl JointRows {
    fn add(&mut self, torque: f64) {
        self.count += 1;
        self.torque_square += torque * torque;
    }

    fn merge(&mut self, other: JointRows) {
        self.count += other.count;
        self.torque_square += other.torque_square;
    }

    /// Root mean square of the torque.
    pub(super) fn torque_rms(&self) -> f64 {
        (self.torque_square / self.count.max(1) as f64).sqrt()
    }
}

impl RowAccumulator {
    /// `block_seconds` is the length of a block to begin with [s].
    pub fn new(columns: RegressorColumns, block_seconds: f64) -> Self {
        let none = || (0..columns.joints).map(|j| RFactor::new(columns.row_width(j)));
        RowAccumulator {
            moving: vec![JointRows::default(); columns.joints],
            resting: none().map(|r| (JointRows::default(), r)).collect(),
            by_speed: vec![BySpeed::default(); columns.joints],
            open: none().collect(),
            columns,
            open_rows: 0,
            open_span: [0.0; 2],
            now: 0.0,
            stretch: 0,
            block_seconds,
            block_rows: None,
            blocks: Vec::new(),
            rows: 0,
        }
    }

    /// Says at which time the row to come is [s].
    pub fn at(&mut self, t: f64) {
        self.now = t;
    }

    /// Adds one row of every joint, `step` \[s\] after the one before; `channels` as [`RegressorColumns::fill`]
    /// writes them. A new `stretch` closes the open block. Blocks are counted in rows: times are rounded, and
    /// otherwise where the clock's zero lies.
    pub fn add(&mut self, stretch: usize, step: f64, channels: &[f64]) {
        let block_rows = *self.block_rows.get_or_insert_with(|| {
            // a step that is rounded must not cost a row
            let rows = (self.block_seconds / step - 1e-3).ceil().max(1.0);
            self.block_seconds = rows * step;
            rows as u64
        });
        if stretch != self.stretch {
            self.close();
            self.stretch = stretch;
        }
        if self.open_rows >= block_rows {
            self.close();
        }
        let torques = self.columns.offset(self.columns.joints);
        let mut at = 0;
        for (j, open) in self.open.iter_mut().enumerate() {
            let c = self.columns.row_width(j);
            if self.columns.rests(channels, j) {
                let plain = &channels[self.columns.unweighted()..];
                let (rows, factor) = &mut self.resting[j];
                factor.fold(&plain[at..at + c]);
                rows.add(plain[torques + j]);
            } else {
                open.fold(&channels[at..at + c]);
                self.by_speed[j].add(&self.columns, j, &channels[at..at + c]);
                self.moving[j].add(channels[torques + j]);
            }
            at += c;
        }
        if self.open_rows == 0 {
            self.open_span[0] = self.now;
        }
        self.open_span[1] = self.now;
        self.open_rows += 1;
        self.rows += 1;
    }

    fn close(&mut self) {
        if self.open_rows == 0 {
            return;
        }
        let r = self.open.iter().map(RFactor::short).collect();
        self.open.iter_mut().for_each(RFactor::clear);
        self.blocks.push(BlockFactor {
            stretch: self.stretch,
            span: self.open_span,
            rows: self.open_rows,
            r,
            ..BlockFactor::default()
        });
        self.open_rows = 0;
        if self.blocks.len() > MOST_BLOCKS {
            self.halve();
        }
    }

    /// Merges neighbours of one stretch two by two.
    fn halve(&mut self) {
        self.block_rows = self.block_rows.map(|rows| 2 * rows);
        self.block_seconds *= 2.0;
        let mut old = std::mem::take(&mut self.blocks).into_iter().peekable();
        while let Some(mut first) = old.next() {
            if let Some(second) = old.next_if(|b| b.stretch == first.stretch) {
                for (j, (a, b)) in first.r.iter_mut().zip(&second.r).enumerate() {
                    *a = stacked([&*a, b], self.columns.row_width(j)).short();
                }
                first.rows += second.rows;
                first.span[1] = second.span[1];
            }
            self.blocks.push(first);
        }
    }

    /// Closes the last block and hands everything over.
    pub fn finish(mut self) -> BlockFactors {
        self.close();
        let (resting, at_rest): (Vec<JointRows>, Vec<RFactor>) = self.resting.into_iter().unzip();
        BlockFactors {
            columns: self.columns,
            blocks: self.blocks,
            block_seconds: self.block_seconds,
            moving: self.moving,
            resting,
            at_rest: at_rest.iter().map(RFactor::r).collect(),
            by_speed: self.by_speed,
            rows: self.rows,
        }
    }
}

/// Several triangles, one under the other.
pub(super) fn stacked<'a>(
    parts: impl IntoIterator<Item = &'a DMatrix<f64>>,
    columns: usize,
) -> RFactor {
    let mut factor = RFactor::new(columns);
    for part in parts {
        factor.fold(part.transpose().as_slice());
    }
    factor
}

/// A joint's residual: its norm over that of the filtered torque, fractions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RelativeResidual {
    /// Over all rows.
    pub all: f64,
    /// Over those in which the joint moves; none where it never does.
    pub moving: Option<f64>,
    /// Over those in which it rests; none where it never does.
    pub rest: Option<f64>,
    /// Root mean square of the residual itself, over all rows [N or Nm].
    pub rms: f64,
}

impl RelativeResidual {
    /// The same of a residual that is `factor` times as large.
    pub fn grow(&mut self, factor: f64) {
        self.all *= factor;
        self.rms *= factor;
        for x in [&mut self.moving, &mut self.rest].into_iter().flatten() {
            *x *= factor;
        }
    }
}

/// All rows of all logs, reduced.
#[derive(Debug, Clone)]
pub struct BlockFactors {
    pub columns: RegressorColumns,
    pub blocks: Vec<BlockFactor>,
    /// Length of the shortest whole block [s].
    pub block_seconds: f64,
    /// Rows of each joint in the blocks: those in which it moves.
    pub moving: Vec<JointRows>,
    /// Those in which it rests; they are in no block.
    pub resting: Vec<JointRows>,
    /// Upper triangle of the rows in which each joint rests.
    pub at_rest: Vec<DMatrix<f64>>,
    /// Mean rows of each joint by its speed; none of reduced logs.
    pub by_speed: Vec<BySpeed>,
    /// Instants.
    pub rows: u64,
}

impl BlockFactors {
    /// Joins the block factors of another set of logs with the same columns; stretches stay apart.
    pub fn merge(&mut self, other: BlockFactors) {
        let shift = self.blocks.last().map_or(0, |b| b.stretch + 1);
        let logs = self.blocks.last().map_or(0, |b| b.log + 1);
        self.blocks.extend(other.blocks.into_iter().map(|mut b| {
            b.stretch += shift;
            b.log += logs;
            for part in b.scores.iter_mut().flat_map(|s| &mut s.blocks) {
                part.stretch += shift;
            }
            b
        }));
        for (own, other) in self.by_speed.iter_mut().zip(&other.by_speed) {
            own.merge(other);
        }
        for (j, r) in other.at_rest.iter().enumerate() {
            self.moving[j].merge(other.moving[j]);
            if other.resting[j].count > 0 {
                self.resting[j].merge(other.resting[j]);
                self.at_rest[j] = stacked([&self.at_rest[j], r], self.columns.row_width(j)).r();
            }
        }
        self.block_seconds = self.block_seconds.min(other.block_seconds);
        self.rows += other.rows;
    }

    /// The same rows with the parameters of the known friction among the unknowns, but for those that are held.
    pub fn with_free_friction(mut self) -> BlockFactors {
        for (j, known) in self.columns.known.iter().enumerate() {
            let Some(known) = known.as_ref().filter(|k| k.held.contains(&true)) else {
                continue;
            };
            let first = self.columns.unknowns_of(j);
            let free = (0..GRADIENT).filter(|k| !known.held[*k]).map(|k| first + k);
            let places: Vec<usize> = (0..first).chain(free).chain([first + GRADIENT]).collect();
            self.at_rest[j] = self.at_rest[j].select_columns(&places);
            for block in &mut self.blocks {
                block.r[j] = block.r[j].select_columns(&places);
                // they are of other unknowns
                block.scores = None;
            }
        }
        self.columns = self.columns.with_free_friction();
        self
    }

    /// The same rows with those of each joint's own terms alone that `keep` names by their place.
    pub(super) fn with_own(&self, keep: &[Vec<usize>]) -> BlockFactors {
        let p = self.columns.shared;
        let mut columns = self.columns.clone();
        for (own, keep) in columns.own.iter_mut().zip(keep) {
            *own = keep.iter().map(|k| own[*k]).collect();
        }
        let places = |j: usize| -> Vec<usize> {
            let rest = self.columns.unknowns_of(j)..self.columns.row_width(j);
            (0..p)
                .chain(keep[j].iter().map(|k| p + k))
                .chain(rest)
                .collect()
        };
        let places: Vec<Vec<usize>> = (0..columns.joints).map(places).collect();
        let chosen = |of: &[DMatrix<f64>]| -> Vec<DMatrix<f64>> {
            let each = of.iter().zip(&places);
            each.map(|(r, places)| r.select_columns(places)).collect()
        };
        let blocks = self.blocks.iter().map(|b| BlockFactor {
            log: b.log,
            stretch: b.stretch,
            span: b.span,
            rows: b.rows,
            r: chosen(&b.r),
            scores: None,
        });
        BlockFactors {
            blocks: blocks.collect(),
            at_rest: chosen(&self.at_rest),
            columns,
            by_speed: Vec::new(),
            ..self.without_blocks()
        }
    }

    /// The same without its blocks, for a part of them.
    pub(super) fn without_blocks(&self) -> BlockFactors {
        BlockFactors {
            columns: self.columns.clone(),
            blocks: Vec::new(),
            block_seconds: self.block_seconds,
            moving: self.moving.clone(),
            resting: self.resting.clone(),
            at_rest: self.at_rest.clone(),
            by_speed: self.by_speed.clone(),
            rows: self.rows,
        }
    }

    /// The same rows in one block: enough for a fit, too little for its covariance.
    pub fn in_one_block(&self) -> BlockFactors {
        let r = (0..self.columns.joints).map(|j| self.joint(j)).collect();
        BlockFactors {
            blocks: vec![BlockFactor {
                rows: self.rows,
                r,
                ..BlockFactor::default()
            }],
            ..self.without_blocks()
        }
    }

    /// |b - X theta|^2 of every joint, over the rows in which it moves and those in which it rests.
    pub fn squares(&self, theta: &DVector<f64>) -> Vec<[f64; 2]> {
        let of = |j| {
            let own = self.own_unknowns(theta, j);
            let moving = self.parts(&self.joint(j), j).residual_square(&own);
            [moving, self.square_at_rest(theta, j)]
        };
        (0..self.columns.joints).map(of).collect()
    }

    /// |b - X theta|^2 of joint j over the rows in which it rests.
    pub(super) fn square_at_rest(&self, theta: &DVector<f64>, j: usize) -> f64 {
        let own = self.own_unknowns(theta, j);
        self.parts(&self.at_rest[j], j).residual_square(&own)
    }

    /// The residual of joint j over its torque, by its squares over the rows in which it moves and in which it rests.
    pub(super) fn relative_residual(&self, j: usize, squares: [f64; 2]) -> RelativeResidual {
        let rows = [self.moving[j], self.resting[j]];
        let ratio = |square: f64, torque: f64| match torque > 0.0 {
            true => (square / torque).sqrt(),
            false => f64::NAN,
        };
        let part = |k: usize| (rows[k].count > 0).then(|| ratio(squares[k], rows[k].torque_square));
        let torque = rows[0].torque_square + rows[1].torque_square;
        RelativeResidual {
            all: ratio(squares[0] + squares[1], torque),
            moving: part(0),
            rest: part(1),
            rms: ((squares[0] + squares[1]) / (rows[0].count + rows[1].count).max(1) as f64).sqrt(),
        }
    }

    /// Share of each joint's rows in which it rests.
    pub fn resting_shares(&self) -> Vec<f64> {
        let rows = self.moving.iter().zip(&self.resting);
        rows.map(|(m, r)| r.count as f64 / (m.count + r.count).max(1) as f64)
            .collect()
    }

    /// Rows in which a joint moves, on average over the joints.
    pub(crate) fn rows_per_joint(&self) -> f64 {
        let counts = self.moving.iter().map(|rows| rows.count as f64);
        counts.sum::<f64>() / self.moving.len().max(1) as f64
    }

    /// R factor of the rows of joint j in which it moves.
    pub fn joint(&self, j: usize) -> DMatrix<f64> {
        let parts = self.blocks.iter().map(|b| &b.r[j]);
        stacked(parts, self.columns.row_width(j)).r()
    }

    /// Restriction of the global unknowns to those of joint j.
    pub(super) fn own_unknowns(&self, theta: &DVector<f64>, j: usize) -> DVector<f64> {
        self.columns.own_unknowns(theta, j)
    }

    /// The columns of joint j's triangle `r` by what stands in them.
    pub(super) fn parts<'a>(&self, r: &'a DMatrix<f64>, j: usize) -> JointFactor<'a> {
        let unknowns = self.columns.unknowns_of(j);
        JointFactor {
            x: r.columns(0, unknowns),
            gradient: r.columns(unknowns, self.columns.gradient(j)),
            t: r.column(r.ncols() - 1),
        }
    }
}

/// One joint's triangle by its columns: X, G and t.
pub(super) struct JointFactor<'a> {
    pub x: DMatrixView<'a, f64>,
    gradient: DMatrixView<'a, f64>,
    pub t: DVectorView<'a, f64>,
}

impl JointFactor<'_> {
    /// X' (t - X theta) for the joint's own unknowns.
    pub fn score(&self, theta: &DVector<f64>) -> DVector<f64> {
        self.x.tr_mul(&(self.t - self.x * theta))
    }

    /// |t - X theta|^2.
    pub fn residual_square(&self, theta: &DVector<f64>) -> f64 {
        (self.t - self.x * theta).norm_squared()
    }

    /// X' G.
    pub fn with_gradient(&self) -> DMatrix<f64> {
        self.x.tr_mul(&self.gradient)
    }

    /// X'X and X't.
    pub fn products(&self) -> (DMatrix<f64>, DVector<f64>) {
        (self.x.tr_mul(&self.x), self.x.tr_mul(&self.t))
    }
}

#[cfg(test)]
impl RegressorColumns {
    /// Rows of a sliding joint 0.01 s apart, of which speed, acceleration and force are given, in blocks so long [s].
    pub fn rows_of_one(
        &self,
        block_seconds: f64,
        rows: impl IntoIterator<Item = [f64; 3]>,
    ) -> BlockFactors {
        let robot = crate::robot::Robot::single_joint("q1", crate::robot::JointKind::Prismatic);
        let mut all = RowAccumulator::new(self.clone(), block_seconds);
        let mut channels = vec![0.0; self.channels()];
        for [v, a, tau] in rows {
            self.fill(&robot, &[0.0], &[v], &[a], &[tau], &mut channels);
            all.add(0, 0.01, &channels);
        }
        all.finish()
    }
}
