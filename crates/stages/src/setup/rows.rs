//! Rows of a sample under a correction, by joint, and their sums of products.

use std::ops::Range;

use nalgebra::DMatrix;

use super::channels::Carried;
use super::correction::Correction;
use super::problem::Problem;
use cft_ident_core::inertia::columns::JointTerm;
use cft_ident_core::judge::{Bound, Term};
use cft_ident_core::math::gram::{gram, stride};
use cft_ident_core::robot::Robot;

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

/// Sums of products of rows, by joint, and the terms of their columns.
pub(super) struct RowSums {
    pub terms: Vec<Term>,
    pub sums: Vec<DMatrix<f64>>,
}

impl RowSums {
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

/// Shares of all rows after which it is looked whether the others need to be made.
const LOOKS: [f64; 2] = [0.25, 0.5];

impl Problem<'_> {
    /// Columns of each joint's rows: places of its inertial parameters and of its own terms among the unknowns.
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
        is_hopeless: &mut dyn FnMut(&RowSums) -> bool,
    ) -> Option<Rows> {
        let most = self.sample.len() / every + 1;
        let mut maker = RowMaker::new(self, (robot, by), most);
        let mut blocks = vec![Vec::new(); self.blocks.list.len()];
        let mut part = maker.no_sums();
        let mut shares = LOOKS.iter().peekable();
        for &b in order {
            let first = maker.poses;
            maker.add(self.samples_of(b, every));
            blocks[b] = maker.products(first);
            part.add(&blocks[b]);
            let look = shares.next_if(|share| maker.poses as f64 >= *share * most as f64);
            if look.is_some() && is_hopeless(&part) {
                return None;
            }
        }
        maker.rows(part, blocks)
    }

    /// Sums of products of every so many rows; none where most of them are no pose of the robot.
    pub(super) fn sums(&self, by: &Correction, every: usize) -> Option<RowSums> {
        let robot = self.robot_under(by)?;
        let mut maker = RowMaker::new(self, (&robot, by), self.sample.len() / every + 1);
        for b in 0..self.blocks.list.len() {
            maker.add(self.samples_of(b, every));
        }
        maker.are_poses().then(|| RowSums {
            sums: maker.products(0),
            terms: maker.terms(),
        })
    }

    /// Every so many samples of a block.
    fn samples_of(&self, block: usize, every: usize) -> impl Iterator<Item = usize> {
        let pieces = self.blocks.list[block].pieces.iter();
        let rows = pieces.flat_map(|(_, rows)| rows.clone());
        rows.filter(move |k| k % every == 0)
    }
}

/// Makes rows of samples.
struct RowMaker<'a> {
    problem: &'a Problem<'a>,
    robot: &'a Robot,
    by: &'a Correction,
    /// Columns of each joint's rows among the unknowns.
    places: Vec<Vec<usize>>,
    joints: Vec<JointRows>,
    /// Samples that are poses of the robot, and all.
    poses: usize,
    samples: usize,
    carried: Carried,
    y: Vec<f64>,
}

impl<'a> RowMaker<'a> {
    /// With room for `most` rows.
    fn new(
        problem: &'a Problem<'a>,
        (robot, by): (&'a Robot, &'a Correction),
        most: usize,
    ) -> Self {
        let (n, p) = (robot.joints(), robot.parameters().len());
        let places = problem.places_of(robot);
        let no_rows = |(places, moves): (&Vec<usize>, &bool)| {
            let columns = places.len() + n;
            JointRows {
                columns,
                data: Vec::with_capacity(if *moves { most * stride(columns) } else { 0 }),
            }
        };
        Self {
            joints: places.iter().zip(&problem.moving).map(no_rows).collect(),
            problem,
            robot,
            by,
            places,
            poses: 0,
            samples: 0,
            carried: Carried::new(n),
            y: vec![0.0; n * p],
        }
    }

    fn terms(&self) -> Vec<Term> {
        let n = self.joints.len();
        let term = |unknown: usize| {
            let of = |j: usize| Some((j, self.places[j].iter().position(|u| *u == unknown)?));
            Term {
                columns: (0..n).filter_map(of).collect(),
                bound: Bound::NONE,
            }
        };
        let unknowns = self.problem.first_own(self.robot, n);
        (0..unknowns).map(term).collect()
    }

    fn no_sums(&self) -> RowSums {
        let zeros = |rows: &JointRows| DMatrix::zeros(rows.columns, rows.columns);
        RowSums {
            terms: self.terms(),
            sums: self.joints.iter().map(zeros).collect(),
        }
    }

    /// Makes the rows of some samples.
    fn add(&mut self, samples: impl Iterator<Item = usize>) {
        for k in samples {
            self.samples += 1;
            let (problem, carried) = (self.problem, &mut self.carried);
            let row = problem.sample.row(k);
            if !(problem.channels).carry(self.robot, row, self.by, carried) {
                continue;
            }
            (self.robot).regressor(&carried.q, &carried.v, &carried.a, &mut self.y);
            if self.y.iter().all(|x| x.is_finite()) {
                self.poses += 1;
                self.push();
            }
        }
    }

    /// Appends the row that is carried.
    fn push(&mut self) {
        let (n, p) = (self.joints.len(), self.y.len() / self.joints.len());
        for j in (0..n).filter(|j| self.problem.moving[*j]) {
            let own = &self.problem.columns.own[j];
            let JointRows { columns, data } = &mut self.joints[j];
            let first = data.len();
            data.resize(first + stride(*columns), 0.0);
            let places = &self.places[j];
            let (shared, rest) = data[first..].split_at_mut(places.len() - own.len());
            let y = &self.y[j * p..(j + 1) * p];
            for (to, place) in shared.iter_mut().zip(places) {
                *to = y[*place];
            }
            let (of_own, torques) = rest.split_at_mut(own.len());
            for (to, own) in of_own.iter_mut().zip(own) {
                *to = own_column(*own, &self.carried, j);
            }
            torques[..n].copy_from_slice(&self.carried.tau[j * n..(j + 1) * n]);
        }
    }

    /// Sums of products of the rows from this one on, by joint.
    fn products(&self, first: usize) -> Vec<DMatrix<f64>> {
        let of_joint = |rows: &JointRows| rows.products(first..self.poses);
        self.joints.iter().map(of_joint).collect()
    }

    /// Whether most samples are poses of the robot.
    fn are_poses(&self) -> bool {
        self.poses > 0 && 2 * self.poses >= self.samples
    }

    /// All rows, with their sums and those of each block; none where most samples are no pose.
    fn rows(self, sums: RowSums, blocks: Vec<Vec<DMatrix<f64>>>) -> Option<Rows> {
        self.are_poses().then_some(Rows {
            count: self.poses,
            total: sums.sums,
            terms: sums.terms,
            joints: self.joints,
            blocks,
        })
    }
}

/// The column of a joint's own term in a row.
fn own_column(own: JointTerm, carried: &Carried, j: usize) -> f64 {
    match own {
        JointTerm::Coulomb => carried.sign[j],
        own => own.column(carried.v[j]),
    }
}
