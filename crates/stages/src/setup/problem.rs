//! Sums of products of a sample under a correction, by block of time and joint.

use std::ops::Range;

use nalgebra::DMatrix;

use super::LIMITS;
use super::channels::{Carried, Channels, Drive};
use super::correction::Correction;
use super::sample::Sample;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::judge::{Blocks, Bound, PARTS, Term, divide};
use cft_ident_core::math::gram::{gram, stride};
use cft_ident_core::robot::Robot;

/// What the robot file knows beside its channels.
#[derive(Debug, Clone, Default)]
pub struct KnownBeforehand {
    /// Largest torque of each joint \[N or N m\].
    pub torque: Vec<Option<f64>>,
    /// Least and greatest position of each joint \[m or rad\].
    pub position: Vec<Option<[f64; 2]>>,
    /// Gear ratios and factors that stand in the file.
    pub ratios: Vec<f64>,
    /// Inertial parameters by the file's own masses.
    pub inertial: Option<Vec<f64>>,
}

/// A robot file and a sample of its logs.
pub struct Problem<'a> {
    pub robot: &'a Robot,
    /// The same robot in another gravity \[m/s^2\]; none where the file declares no gravity.
    pub in_gravity: Option<&'a (dyn Fn([f64; 3]) -> Option<Robot> + Sync)>,
    pub channels: Channels,
    /// Friction terms of each joint.
    pub columns: &'a RegressorColumns,
    pub sample: Sample,
    pub known: KnownBeforehand,
    pub(super) blocks: Blocks,
    /// Joints that move, and whose torques are not all zero.
    pub(super) moving: Vec<bool>,
}

/// Rows of each joint, and their sums of products: the joint's inertial parameters, its own terms, the torque of each channel.
pub(super) struct Rows {
    pub terms: Vec<Term>,
    /// Rows that are poses of the robot.
    pub count: usize,
    /// Over all rows.
    pub total: Vec<DMatrix<f64>>,
    joints: Vec<JointRows>,
    /// Of each block, by joint.
    blocks: Vec<Vec<DMatrix<f64>>>,
}

/// Shares of all rows after which it is looked whether the others need to be made.
const LOOKS: [f64; 2] = [0.25, 0.5];

/// The sums of products of the rows that are made so far, by joint.
pub(super) struct RowsSoFar {
    pub terms: Vec<Term>,
    pub sums: Vec<DMatrix<f64>>,
}

impl RowsSoFar {
    fn none(terms: &[Term], joints: &[JointRows]) -> Self {
        let zeros = |rows: &JointRows| DMatrix::zeros(rows.columns, rows.columns);
        Self {
            terms: terms.to_vec(),
            sums: joints.iter().map(zeros).collect(),
        }
    }

    fn add(&mut self, block: &[DMatrix<f64>]) {
        for (sums, of_joint) in self.sums.iter_mut().zip(block) {
            *sums += of_joint;
        }
    }
}

/// Rows of so many columns, one behind the other.
struct JointRows {
    columns: usize,
    data: Vec<f64>,
}

impl JointRows {
    fn products(&self, rows: Range<usize>) -> DMatrix<f64> {
        let within = |k: usize| (k * stride(self.columns)).min(self.data.len());
        let data = &self.data[within(rows.start)..within(rows.end)];
        gram(data, self.columns)
    }
}

/// Least mean sign of the speed about a row in which a joint moves.
const MOVING: f64 = 0.95;

/// Rows of one joint: its columns, and its torque.
pub(super) struct JointTable {
    pub columns: usize,
    data: Vec<f64>,
}

impl JointTable {
    pub fn new(columns: usize) -> Self {
        Self {
            columns,
            data: Vec::new(),
        }
    }

    pub fn push(&mut self, columns: &[f64], torque: f64) {
        self.data.extend_from_slice(columns);
        self.data.push(torque);
    }

    pub fn rows(&self) -> usize {
        self.data.len() / (self.columns + 1)
    }

    pub fn row(&self, k: usize) -> &[f64] {
        let at = k * (self.columns + 1);
        &self.data[at..at + self.columns]
    }

    pub fn torque(&self, k: usize) -> f64 {
        self.data[k * (self.columns + 1) + self.columns]
    }
}

impl Rows {
    /// The rows of a joint in which it moves, whose torque is that of its own channel; `sign` is the place of the
    /// column with the sign of its speed, by the number of columns. Beside a reversal, where it is not 1, friction
    /// takes any torque.
    pub fn of_joint(&self, j: usize, sign: impl Fn(usize) -> Option<usize>) -> JointTable {
        let of = &self.joints[j];
        let columns = of.columns - self.joints.len();
        let sign = sign(columns);
        let mut table = JointTable::new(columns);
        for row in of.data.chunks_exact(stride(of.columns)) {
            if sign.is_none_or(|place| row[place].abs() > MOVING) {
                table.push(&row[..columns], row[columns + j]);
            }
        }
        table
    }

    /// Sums of products of a block, by joint.
    pub fn block(&self, b: usize) -> &[DMatrix<f64>] {
        &self.blocks[b]
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }
}

impl<'a> Problem<'a> {
    /// A robot, the channels of its logs, its friction terms, a sample and what the file knows.
    pub fn new(
        robot: &'a Robot,
        in_gravity: Option<&'a (dyn Fn([f64; 3]) -> Option<Robot> + Sync)>,
        (channels, columns): (Channels, &'a RegressorColumns),
        sample: Sample,
        known: KnownBeforehand,
    ) -> Self {
        // a motor behind a linkage is no joint
        let linked = channels.drive == Drive::Motors;
        Self {
            blocks: divide(&sample.logs(), 1.0, (PARTS.parts, PARTS.blocks_per_part)),
            moving: joints_that_move(&sample, linked),
            robot,
            in_gravity,
            channels,
            columns,
            sample,
            known,
        }
    }

    /// Every how many rows make few of them.
    pub(super) fn few(&self) -> usize {
        self.sample.len().div_ceil(LIMITS.rows / 5).max(1)
    }

    /// Whether the place of a joint's zero shows.
    pub(super) fn has_zeros(&self) -> bool {
        self.robot.knows_links() && self.channels.drive != Drive::Motors
    }

    /// Channels whose signs and units are asked for.
    pub(super) fn channels_that_move(&self) -> Vec<usize> {
        (0..self.moving.len()).filter(|j| self.moving[*j]).collect()
    }

    /// Joints that are beyond the limits of the robot file under a correction.
    pub(super) fn beyond_limits(&self, by: &Correction) -> Vec<usize> {
        if self.known.position.iter().all(Option::is_none) {
            return Vec::new();
        }
        let n = self.robot.joints();
        let mut carried = Carried::new(n);
        let mut beyond = vec![false; n];
        for k in 0..self.sample.len() {
            if !(self.channels).carry(self.robot, self.sample.row(k), by, &mut carried) {
                continue;
            }
            let limits = self.known.position.iter().zip(&carried.q).enumerate();
            for (j, (limits, q)) in limits {
                let off = limits.map_or(0.0, |[low, high]| (low - q).max(q - high));
                beyond[j] |= off > LIMITS.still;
            }
        }
        (0..n).filter(|j| beyond[*j]).collect()
    }

    /// The robot in the gravity of a correction.
    pub(super) fn robot_under(&self, by: &Correction) -> Option<Robot> {
        match by.gravity {
            None => Some(self.robot.clone()),
            Some(gravity) => self.in_gravity.and_then(|robot| robot(gravity)),
        }
    }

    /// Place of the first own term of a joint among the unknowns.
    pub(super) fn first_own(&self, robot: &Robot, j: usize) -> usize {
        robot.parameters().len() + self.columns.own[..j].iter().map(Vec::len).sum::<usize>()
    }

    fn places_of(&self, robot: &Robot) -> Vec<Vec<usize>> {
        let all = robot.parameters_by_joint().into_iter().enumerate();
        let of = |(j, shared): (usize, Vec<usize>)| -> Vec<usize> {
            let first = self.first_own(robot, j);
            let own = first..first + self.columns.own[j].len();
            match self.moving[j] {
                true => shared.into_iter().chain(own).collect(),
                false => Vec::new(),
            }
        };
        all.map(of).collect()
    }

    /// Every so many rows of each block, the blocks made in this order; none where most of them are no pose of the robot,
    /// or where `is_hopeless` says by the sums of a part of the rows that the others need not be made.
    pub(super) fn rows(
        &self,
        robot: &Robot,
        by: &Correction,
        (every, order): (usize, &[usize]),
        is_hopeless: &mut dyn FnMut(&RowsSoFar) -> bool,
    ) -> Option<Rows> {
        let (n, p) = (robot.joints(), robot.parameters().len());
        let places = self.places_of(robot);
        let term = |unknown: usize| {
            let of = |j: usize| Some((j, places[j].iter().position(|u| *u == unknown)?));
            Term {
                columns: (0..n).filter_map(of).collect(),
                bound: Bound::NONE,
            }
        };
        let terms: Vec<Term> = (0..self.first_own(robot, n)).map(term).collect();
        let most = self.sample.len() / every + 1;
        let no_rows = |(places, moves): (&Vec<usize>, &bool)| {
            let columns = places.len() + n;
            JointRows {
                columns,
                data: Vec::with_capacity(if *moves { most * stride(columns) } else { 0 }),
            }
        };
        let mut joints: Vec<JointRows> = places.iter().zip(&self.moving).map(no_rows).collect();
        let mut carried = Carried::new(n);
        let mut y = vec![0.0; n * p];
        let mut blocks = vec![Vec::new(); self.blocks.list.len()];
        let (mut good, mut all) = (0, 0);
        let mut part = RowsSoFar::none(&terms, &joints);
        let mut shares = LOOKS.iter().peekable();
        for &b in order {
            let first = good;
            let rows = self.blocks.list[b].pieces.iter();
            let rows = rows.flat_map(|(_, rows)| rows.clone());
            for k in rows.filter(|k| k % every == 0) {
                all += 1;
                if !(self.channels).carry(robot, self.sample.row(k), by, &mut carried) {
                    continue;
                }
                robot.regressor(&carried.q, &carried.v, &carried.a, &mut y);
                if y.iter().any(|x| !x.is_finite()) {
                    continue;
                }
                good += 1;
                let all = joints.iter_mut().enumerate();
                for (j, rows) in all.filter(|(j, _)| self.moving[*j]) {
                    let data = &mut rows.data;
                    let at = data.len();
                    data.resize(at + stride(rows.columns), 0.0);
                    let (shared, rest) =
                        data[at..].split_at_mut(places[j].len() - self.columns.own[j].len());
                    let y = &y[j * p..(j + 1) * p];
                    for (to, place) in shared.iter_mut().zip(&places[j]) {
                        *to = y[*place];
                    }
                    let (own, torques) = rest.split_at_mut(self.columns.own[j].len());
                    for (to, own) in own.iter_mut().zip(&self.columns.own[j]) {
                        *to = own_column(*own, &carried, j);
                    }
                    torques[..n].copy_from_slice(&carried.tau[j * n..(j + 1) * n]);
                }
            }
            blocks[b] = joints.iter().map(|of| of.products(first..good)).collect();
            part.add(&blocks[b]);
            let look = shares.next_if(|share| good as f64 >= *share * most as f64);
            if look.is_some() && is_hopeless(&part) {
                return None;
            }
        }
        (good > 0 && 2 * good >= all).then_some(Rows {
            count: good,
            total: part.sums,
            terms,
            joints,
            blocks,
        })
    }
}

/// In a log that moves one joint the others stand still; where several move, one that seems not to may be in thousandths.
fn joints_that_move(sample: &Sample, linked: bool) -> Vec<bool> {
    let n = sample.joints;
    let moved = |j: &usize| sample.travel(*j) > LIMITS.still;
    let alone = n > 1 && (0..n).filter(moved).count() == 1;
    let (torques, speeds) = (sample.rms(|row| row.tau), sample.rms(|row| row.v));
    let moving = |j: usize| linked || torques[j] > 0.0 && speeds[j] > 0.0 && (moved(&j) || !alone);
    (0..n).map(moving).collect()
}

/// The column of a joint's own term in a row.
fn own_column(own: JointTerm, carried: &Carried, j: usize) -> f64 {
    match own {
        JointTerm::Coulomb => carried.sign[j],
        own => own.column(carried.v[j]),
    }
}
