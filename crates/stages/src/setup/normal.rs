//! Normal equations of a sample under a correction, by joint and by block of time.

use nalgebra::{DMatrix, DVector};

use super::channels::{Carried, Channels, Drive};
use super::correction::Correction;
use super::sample::Sample;
use cft_ident_core::inertia::columns::{Own, RegressorColumns};
use cft_ident_core::robot::{JointKind, Robot};

/// A joint that travels less than this stands still where others are moved: its torque tells nothing of signs
/// and zeros \[rad, m\].
const STILL: [f64; 2] = [0.01, 0.003];

/// Columns beside those of the declared model.
pub(super) struct Added<'a> {
    pub count: usize,
    /// Writes those of a row of the sample, joint after joint.
    pub fill: &'a dyn Fn(usize, &Carried, &mut [f64]),
}

/// A robot file and a sample of its logs.
pub struct Problem<'a> {
    pub robot: &'a Robot,
    /// The same robot in another gravity \[m/s^2\]; none where gravity is not declared by the file.
    pub in_gravity: Option<&'a (dyn Fn([f64; 3]) -> Option<Robot> + Sync)>,
    pub channels: Channels,
    /// Friction terms of each joint, fitted or known.
    pub columns: &'a RegressorColumns,
    pub sample: Sample,
    /// Of motors behind a linkage, the rows as the joints move by the set-up as it is declared.
    as_joints: Option<Sample>,
    /// Joints that move, and whose torques are not all zero.
    moving: Vec<bool>,
    /// Of each joint, the unknowns of the declared robot that its rows are about.
    places: Vec<Vec<usize>>,
}

/// Sums of products by block and joint. Of joint j the columns are its shared parameters, its own terms, the
/// torque of each channel, and its known friction.
pub(super) struct Normal {
    /// By block, then by joint.
    pub blocks: Vec<Vec<DMatrix<f64>>>,
    /// By joint.
    pub total: Vec<DMatrix<f64>>,
    /// Of each joint, the unknowns that its columns are of.
    pub places: Vec<Vec<usize>>,
    pub unknowns: usize,
    pub joints: usize,
    /// Rows per joint.
    pub rows: usize,
}

impl<'a> Problem<'a> {
    /// A robot, the channels of its logs, its friction terms and a sample. `in_gravity` is the same robot in
    /// another gravity \[m/s^2\]; none where gravity is not declared by the file.
    pub fn new(
        robot: &'a Robot,
        in_gravity: Option<&'a (dyn Fn([f64; 3]) -> Option<Robot> + Sync)>,
        channels: Channels,
        columns: &'a RegressorColumns,
        sample: Sample,
    ) -> Self {
        let mut out = Self {
            robot,
            in_gravity,
            channels,
            columns,
            sample,
            as_joints: None,
            moving: Vec::new(),
            places: Vec::new(),
        };
        out.as_joints = out.through_linkage();
        out.moving = out.joints_that_move();
        out.places = out.places_of(robot);
        out
    }

    /// Joints that move, and whose torques are not all zero.
    pub(super) fn moving(&self) -> &[bool] {
        &self.moving
    }

    /// In a log that moves one joint the others stand still; where several move, one that seems not to may be in
    /// thousandths of its unit.
    fn joints_that_move(&self) -> Vec<bool> {
        let n = self.sample.joints;
        let joints = self.of_joints();
        let travels = |j: usize| {
            let least = match self.robot.joint_kind(j) {
                JointKind::Revolute => STILL[0],
                JointKind::Prismatic => STILL[1],
            };
            joints.travel(j) > least
        };
        let moved: Vec<bool> = (0..n).map(travels).collect();
        let alone = n > 1 && moved.iter().filter(|m| **m).count() == 1;
        let torques = joints.rms(&joints.tau);
        let speeds = joints.rms(&joints.v);
        let moving = |j: usize| torques[j] > 0.0 && speeds[j] > 0.0 && (moved[j] || !alone);
        (0..n).map(moving).collect()
    }

    /// The rows as the joints move by the set-up as it is declared; those of the channels where hardly any is a pose of
    /// the robot.
    pub(super) fn of_joints(&self) -> &Sample {
        self.as_joints.as_ref().unwrap_or(&self.sample)
    }

    fn through_linkage(&self) -> Option<Sample> {
        if self.channels.drive != Drive::Motors {
            return None;
        }
        let n = self.sample.joints;
        let none = Correction::none(n);
        let mut out = Sample {
            joints: n,
            ..Sample::default()
        };
        let mut carried = Carried::new(n);
        for k in 0..self.sample.len() {
            let row = self.sample.row(k);
            if !self.channels.carry(self.robot, row, &none, &mut carried) {
                continue;
            }
            out.q.extend_from_slice(&carried.q);
            out.v.extend_from_slice(&carried.v);
            let torques = carried.tau.chunks_exact(n.max(1));
            out.tau.extend(torques.map(|of| of.iter().sum::<f64>()));
            out.log.push(self.sample.log[k]);
        }
        (2 * out.len() >= self.sample.len()).then_some(out)
    }

    /// Whether the motion of a joint tells its friction from a constant torque: it goes both ways.
    pub fn tells_friction(&self, joint: usize) -> bool {
        self.of_joints().tells_friction(joint)
    }

    /// Channels whose motion or torque the joints that move feel.
    pub(super) fn channels_that_move(&self) -> Vec<usize> {
        let moving = self.moving();
        let drive = self.robot.transmission();
        let felt = |c: &usize| match (&self.channels.drive, drive.joint_of(*c)) {
            (Drive::Motors, Some((joint, _))) => moving[joint],
            // behind the linkage
            (Drive::Motors, None) => {
                let direct: Vec<usize> = (0..moving.len())
                    .filter_map(|c| drive.joint_of(c).map(|(joint, _)| joint))
                    .collect();
                (0..moving.len()).any(|j| moving[j] && !direct.contains(&j))
            }
            _ => moving[*c],
        };
        (0..moving.len()).filter(felt).collect()
    }

    /// The robot in the gravity of a correction.
    pub(super) fn robot_under(&self, by: &Correction) -> Option<Robot> {
        match by.gravity {
            None => Some(self.robot.clone()),
            Some(gravity) => self.in_gravity.and_then(|robot| robot(gravity)),
        }
    }

    /// Unknowns: shared parameters of this robot, then each joint's own.
    pub(super) fn first_own(&self, robot: &Robot, j: usize) -> usize {
        robot.parameters().len() + self.columns.own[..j].iter().map(Vec::len).sum::<usize>()
    }

    /// Known friction of a joint in a row [N or N m]: as the row has it, else the law at the row's speed.
    pub(super) fn known_friction(&self, row: &Carried, j: usize) -> Option<f64> {
        let known = self.columns.known[j].as_ref()?;
        Some(match row.friction[j] {
            friction if friction.is_finite() => friction,
            _ => known.law.torque(row.v[j]),
        })
    }

    fn places_of(&self, robot: &Robot) -> Vec<Vec<usize>> {
        let all = robot.parameters_by_joint().into_iter().enumerate();
        let of = |(j, shared): (usize, Vec<usize>)| -> Vec<usize> {
            if !self.moving[j] {
                return Vec::new();
            }
            let first = self.first_own(robot, j);
            let own = first..first + self.columns.own[j].len();
            shared.into_iter().chain(own).collect()
        };
        all.map(of).collect()
    }

    /// Sums over the rows of these numbers, in `blocks` blocks; none where most of the rows are no pose of
    /// the robot.
    pub(super) fn normal(
        &self,
        robot: &Robot,
        by: &Correction,
        rows: &[usize],
        blocks: usize,
    ) -> Option<Normal> {
        let none = Added {
            count: 0,
            fill: &|_, _, _| {},
        };
        self.normal_with(robot, by, rows, blocks, &none)
    }

    /// The same with columns added, whose unknowns are behind all others.
    pub(super) fn normal_with(
        &self,
        robot: &Robot,
        by: &Correction,
        rows: &[usize],
        blocks: usize,
        added: &Added,
    ) -> Option<Normal> {
        let (n, p) = (robot.joints(), robot.parameters().len());
        let moving = self.moving();
        let mut places = match by.gravity {
            None => self.places.clone(),
            Some(_) => self.places_of(robot),
        };
        let declared = self.first_own(robot, n);
        for places in places.iter_mut().filter(|places| !places.is_empty()) {
            places.extend(declared..declared + added.count);
        }
        let mut beside = vec![0.0; n * added.count];
        let widths: Vec<usize> = places.iter().map(|c| c.len() + n + 1).collect();
        let mut carried = Carried::new(n);
        let mut y = vec![0.0; n * p];
        let mut out: Vec<Vec<DMatrix<f64>>> = Vec::with_capacity(blocks);
        let mut data: Vec<Vec<f64>> = vec![Vec::new(); n];
        let mut good = 0;
        for block in 0..blocks {
            let range = block * rows.len() / blocks..(block + 1) * rows.len() / blocks;
            data.iter_mut().for_each(Vec::clear);
            for &k in &rows[range] {
                if !self
                    .channels
                    .carry(robot, self.sample.row(k), by, &mut carried)
                {
                    continue;
                }
                robot.regressor(&carried.q, &carried.v, &carried.a, &mut y);
                if y.iter().any(|x| !x.is_finite()) {
                    continue;
                }
                good += 1;
                (added.fill)(k, &carried, &mut beside);
                for (j, data) in data.iter_mut().enumerate().filter(|(j, _)| moving[*j]) {
                    let shared = places[j].len() - self.columns.own[j].len() - added.count;
                    data.extend(places[j][..shared].iter().map(|c| y[j * p + c]));
                    let own = self.columns.own[j].iter();
                    data.extend(own.map(|own| own_column(*own, &carried, j)));
                    data.extend_from_slice(&beside[j * added.count..(j + 1) * added.count]);
                    data.extend_from_slice(&carried.tau[j * n..(j + 1) * n]);
                    data.push(self.known_friction(&carried, j).unwrap_or(0.0));
                }
            }
            let gram = |(data, width): (&Vec<f64>, &usize)| {
                if data.is_empty() {
                    return DMatrix::zeros(*width, *width);
                }
                // columns of the transposed are rows
                let x = DMatrix::from_column_slice(*width, data.len() / width, data);
                &x * x.transpose()
            };
            out.push(data.iter().zip(&widths).map(gram).collect());
        }
        if 2 * good < rows.len() || good == 0 {
            return None;
        }
        let sum = |j: usize| {
            let zero = DMatrix::zeros(widths[j], widths[j]);
            out.iter().fold(zero, |sum, block| sum + &block[j])
        };
        Some(Normal {
            total: (0..n).map(sum).collect(),
            blocks: out,
            unknowns: declared + added.count,
            places,
            joints: n,
            rows: good,
        })
    }
}

impl Normal {
    /// The sums over all blocks without the joints' own terms, which take what they can of all other columns:
    /// of the unknowns the first `shared` are left.
    pub(super) fn shared(&self, shared: usize) -> Option<Self> {
        let mut places = Vec::with_capacity(self.joints);
        let mut total = Vec::with_capacity(self.joints);
        for (gram, at) in self.total.iter().zip(&self.places) {
            let first = at.iter().take_while(|c| **c < shared).count();
            let own = at.len() - first;
            places.push(at[..first].to_vec());
            let left: Vec<usize> = (0..first).chain(at.len()..gram.nrows()).collect();
            let part = |rows: &[usize], columns: &[usize]| {
                DMatrix::from_fn(rows.len(), columns.len(), |i, k| {
                    gram[(rows[i], columns[k])]
                })
            };
            let of_own: Vec<usize> = (first..at.len()).collect();
            let mut kept = part(&left, &left);
            if own > 0 {
                let cross = part(&of_own, &left);
                let mut h = part(&of_own, &of_own);
                let scale = h.diagonal().max();
                for i in 0..own {
                    h[(i, i)] += f64::EPSILON.sqrt() * scale.max(f64::MIN_POSITIVE);
                }
                kept -= cross.transpose() * h.cholesky()?.solve(&cross);
            }
            total.push(kept);
        }
        Some(Self {
            blocks: Vec::new(),
            total,
            places,
            unknowns: shared,
            joints: self.joints,
            rows: self.rows,
        })
    }

    /// The same without the unknowns from `first` on, but for these.
    pub(super) fn only(&self, first: usize, kept: &[usize]) -> Self {
        let new = |at: usize| match at < first {
            true => Some(at),
            false => kept.iter().position(|k| *k == at).map(|k| first + k),
        };
        let left: Vec<Vec<usize>> = (self.places.iter().zip(&self.total))
            .map(|(places, gram)| {
                let stays = |c: &usize| places.get(*c).is_none_or(|at| new(*at).is_some());
                (0..gram.nrows()).filter(stays).collect()
            })
            .collect();
        let part = |(gram, left): (&DMatrix<f64>, &Vec<usize>)| {
            gram.select_rows(left).select_columns(left)
        };
        let parts = |of: &Vec<DMatrix<f64>>| of.iter().zip(&left).map(part).collect();
        let place = |places: &Vec<usize>| places.iter().filter_map(|at| new(*at)).collect();
        Self {
            blocks: self.blocks.iter().map(parts).collect(),
            total: parts(&self.total),
            places: self.places.iter().map(place).collect(),
            unknowns: first + kept.len(),
            joints: self.joints,
            rows: self.rows,
        }
    }

    /// Weights of the columns behind the unknowns of a joint: torques, then known friction.
    pub(super) fn target(mix: &DVector<f64>, friction: f64) -> DVector<f64> {
        mix.push(-friction)
    }
}

/// The column of a joint's own term in a row.
pub(super) fn own_column(own: Own, carried: &Carried, j: usize) -> f64 {
    match own {
        Own::Coulomb => carried.sign[j],
        own => own.column(carried.v[j]),
    }
}
