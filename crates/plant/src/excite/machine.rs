//! A machine as a design sees it: designed coordinates to joints, torques and volts, and what a fit
//! would estimate from them.

use std::cell::OnceCell;

use schemars::JsonSchema;
use serde::Serialize;

use crate::simulate::Mechanism;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::robot::RobotError;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::tree::pose::{Frame, frames};
use cft_ident_files::config::trajectory::TrajectoryCoordinates;

use super::foreseen::TorqueSource;
use super::limits::{BoundedQuantity, Quantity};
use super::series::{Kinematics, MAX_COORDINATES};
use super::space::DesignSpace;

/// A robot with the numbers that its torques are foreseen with, and its limits.
#[derive(Debug, Clone)]
pub struct ForeseenRobot {
    pub model: Model,
    /// Where the model's numbers come from, and how far its torques may be off.
    pub source: TorqueSource,
    /// What a fit would estimate: inertial parameters, and linear friction where it is fitted too.
    pub columns: RegressorColumns,
    /// Motors and limits, as the simulator knows them.
    pub mechanism: Mechanism<MAX_COORDINATES>,
    /// Points and links that some of the limits speak of.
    pub space: DesignSpace,
    /// Limits that a motion must keep.
    pub channels: Vec<BoundedQuantity>,
    /// Standard deviation of the noise on each joint's torque \[N or N m\], sample by sample.
    pub noise: Vec<f64>,
    /// Where that noise is from.
    pub noise_source: NoiseSource,
    /// Speeds above which the sign in a Coulomb column counts as whole, per joint \[m/s or rad/s\].
    pub coulomb_speed: Vec<f64>,
}

/// Where the noise of the torques is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// What the fit of the model left of its logs.
    Model,
    /// `[noise]` of the robot file.
    RobotFile,
    /// A share of each joint's usual torque, where the robot file gives none.
    Share,
    /// 1 N or N m in every sample: no torque is foreseen.
    One,
}

impl NoiseSource {
    /// What it is, behind "the noise is".
    pub fn words(self) -> &'static str {
        match self {
            NoiseSource::Model => "what the fit of the model left of its logs",
            NoiseSource::RobotFile => "that of the robot file",
            NoiseSource::Share => {
                "1 % of each joint's usual torque, where the robot file gives none"
            }
            NoiseSource::One => "1 N or N m in every sample, where the robot file gives none",
        }
    }
}

/// Everything at one instant.
#[derive(Debug, Clone, Copy)]
pub struct State {
    /// Designed coordinates.
    pub k: Kinematics,
    /// Joint positions, velocities, accelerations.
    pub q: [f64; MAX_COORDINATES],
    pub v: [f64; MAX_COORDINATES],
    pub a: [f64; MAX_COORDINATES],
    /// Joint torques \[N or N m\].
    pub tau: [f64; MAX_COORDINATES],
    /// Volts (or torques where the motors are at the joints) in the order of the coordinates.
    pub drive: [f64; MAX_COORDINATES],
}

impl State {
    pub(super) const EMPTY: Self = Self {
        k: Kinematics::REST,
        q: [0.0; MAX_COORDINATES],
        v: [0.0; MAX_COORDINATES],
        a: [0.0; MAX_COORDINATES],
        tau: [0.0; MAX_COORDINATES],
        drive: [0.0; MAX_COORDINATES],
    };
}

/// Friction and signs of one instant as straight lines in the velocities, so that differences do not meet their bends.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearisedFriction {
    friction: [(f64, f64); MAX_COORDINATES],
    sign: [(f64, f64); MAX_COORDINATES],
    v: [f64; MAX_COORDINATES],
}

impl ForeseenRobot {
    /// Number of designed coordinates, and of joints.
    pub fn coordinates(&self) -> usize {
        self.model.friction.len()
    }

    /// Number of unknowns p of the fit.
    pub fn unknowns(&self) -> usize {
        self.columns.unknowns()
    }

    /// Names of the designed coordinates: those of the motors.
    pub fn coordinate_names(&self) -> Vec<String> {
        self.model.robot.coordinate_names()
    }

    /// The coordinates in which motions of this machine are designed.
    pub fn designed(&self) -> TrajectoryCoordinates {
        match self.mechanism.motors_at_joints() {
            true => TrajectoryCoordinates::Joint,
            false => TrajectoryCoordinates::Cartesian,
        }
    }

    /// Unit of coordinate i: "m" or "rad".
    pub fn coordinate_unit(&self, i: usize) -> &'static str {
        self.model.robot.coordinate_kind(i).position_unit()
    }

    /// Unit of what drives coordinate i: "V", or that of the joint's torque.
    pub fn drive_unit(&self, i: usize) -> &'static str {
        match self.mechanism.motors_at_joints() {
            true => self.model.robot.joint_unit(i),
            false => "V",
        }
    }

    /// Names of the unknowns, in the order of the columns.
    pub fn unknown_names(&self) -> Vec<String> {
        let robot = &self.model.robot;
        let inertial = robot.parameters().iter().map(|p| p.name.to_string());
        let mut names: Vec<String> = inertial.collect();
        for (joint, own) in robot.joint_names().iter().zip(&self.columns.own) {
            names.extend(own.iter().map(|own| format!("{}:{joint}", own.name())));
        }
        names
    }

    /// Values of the unknowns in the model.
    pub fn unknown_values(&self) -> Vec<f64> {
        let mut values = self.model.theta.clone();
        for (j, own) in self.columns.own.iter().enumerate() {
            values.extend(own.iter().map(|own| match (own, &self.model.friction[j]) {
                (JointTerm::Offset, _) => self.model.offset[j],
                (JointTerm::Viscous, JointFriction::ViscousCoulomb(law)) => law.viscous,
                (JointTerm::Coulomb, JointFriction::ViscousCoulomb(law)) => law.coulomb,
                _ => 0.0,
            }));
        }
        values
    }

    /// One over the noise of each joint: what its rows count by.
    pub(super) fn weights(&self) -> Vec<f64> {
        self.noise.iter().map(|s| 1.0 / s).collect()
    }

    /// Whether nothing but the position of coordinate i itself depends on it.
    pub(super) fn is_uniform(&self, i: usize) -> bool {
        let practice = self.mechanism.practice.as_ref();
        practice.is_some_and(|practice| practice.uniform == i)
    }

    /// Joint positions, velocities and accelerations of the coordinates.
    ///
    /// # Errors
    /// [`RobotError`] where the machine cannot reach the position or is singular in it.
    #[inline]
    pub fn joints(&self, k: &Kinematics) -> Result<State, RobotError> {
        let mut state = State::EMPTY;
        self.follow(k, &mut state)?;
        Ok(state)
    }

    /// [`Self::joints`] into a state whose torques and drives stay.
    #[inline]
    pub(super) fn follow(&self, k: &Kinematics, state: &mut State) -> Result<(), RobotError> {
        let (n, transmission) = (self.coordinates(), self.model.robot.transmission());
        state.k.x[..n].copy_from_slice(&k.x[..n]);
        state.k.xd[..n].copy_from_slice(&k.xd[..n]);
        state.k.xdd[..n].copy_from_slice(&k.xdd[..n]);
        let State { q, v, a, .. } = state;
        transmission.joints(&k.x[..n], &mut q[..n])?;
        transmission.joint_velocities(&q[..n], &k.xd[..n], &mut v[..n])?;
        transmission.joint_accelerations(&q[..n], &v[..n], &k.xdd[..n], &mut a[..n])
    }

    /// Everything at one instant.
    pub fn state(&self, k: &Kinematics) -> Result<State, RobotError> {
        let mut state = State::EMPTY;
        self.fill(k, &mut state)?;
        Ok(state)
    }

    /// [`Self::state`] into a state that is there.
    pub(super) fn fill(&self, k: &Kinematics, state: &mut State) -> Result<(), RobotError> {
        self.follow(k, state)?;
        let (n, State { q, v, a, tau, .. }) = (self.coordinates(), &mut *state);
        self.model.torque(&q[..n], &v[..n], &a[..n], &mut tau[..n]);
        self.drive(state)
    }

    /// What drives the coordinates where the joints need the torques `tau` at the pose `q`.
    pub fn drives(&self, q: &[f64], tau: &[f64]) -> Result<[f64; MAX_COORDINATES], RobotError> {
        let mut state = State::EMPTY;
        state.q[..q.len()].copy_from_slice(q);
        state.tau[..tau.len()].copy_from_slice(tau);
        self.drive(&mut state)?;
        Ok(state.drive)
    }

    /// Fills in the volts of the torques.
    #[inline]
    fn drive(&self, state: &mut State) -> Result<(), RobotError> {
        let (n, State { q, tau, drive, .. }) = (self.coordinates(), state);
        let transmission = self.model.robot.transmission();
        transmission.volts(&q[..n], &tau[..n], &mut drive[..n])
    }

    /// Friction and signs at the velocities of a state.
    pub(super) fn linearised(&self, state: &State) -> LinearisedFriction {
        let mut out = LinearisedFriction {
            friction: [(0.0, 0.0); MAX_COORDINATES],
            sign: [(0.0, 0.0); MAX_COORDINATES],
            v: state.v,
        };
        for (j, law) in self.model.friction.iter().enumerate() {
            let v = state.v[j];
            let slope = match law {
                JointFriction::None => 0.0,
                JointFriction::DoubleTanh(law) => law.slope(v),
                JointFriction::ViscousCoulomb(law) => law.slope(v),
            };
            out.friction[j] = (law.torque(v), slope);
            let t = (v / self.coulomb_speed[j]).tanh();
            out.sign[j] = (t, (1.0 - t * t) / self.coulomb_speed[j]);
        }
        out
    }

    /// [`Self::exact_rows`] with signs and friction by their straight lines, and torques and volts where they are asked for.
    pub(super) fn rows(
        &self,
        state: &mut State,
        line: &LinearisedFriction,
        torques: bool,
        y: &mut [f64],
    ) -> Result<(), RobotError> {
        let v = state.v;
        let beyond = |j: usize, (at, slope): (f64, f64)| at + slope * (v[j] - line.v[j]);
        self.inertial_rows(state, y);
        if torques {
            let shared = self.columns.shared;
            for j in 0..self.coordinates() {
                let inertial = self.inertial(&y[j * shared..(j + 1) * shared]);
                let friction = beyond(j, line.friction[j]);
                state.tau[j] = inertial + friction + self.model.offset[j];
            }
            self.drive(state)?;
        }
        self.own_columns(y, |j, own| match own {
            JointTerm::Coulomb => beyond(j, line.sign[j]),
            own => own.column(v[j]),
        });
        Ok(())
    }

    /// The rows of the fit as they are, n x p row-major.
    pub(super) fn exact_rows(&self, state: &State, y: &mut [f64]) {
        self.inertial_rows(state, y);
        self.own_columns(y, |j, own| own.column(state.v[j]));
    }

    /// Rows of the inertial parameters alone, one joint right behind the other.
    fn inertial_rows(&self, state: &State, y: &mut [f64]) {
        let (n, shared) = (self.coordinates(), self.columns.shared);
        let [q, v, a] = [&state.q, &state.v, &state.a].map(|x| &x[..n]);
        self.model.robot.regressor(q, v, a, &mut y[..n * shared]);
    }

    /// The inertial part of a joint's torque by its row.
    pub(super) fn inertial(&self, row: &[f64]) -> f64 {
        let terms = row.iter().zip(&self.model.theta);
        terms.map(|(y, theta)| y * theta).sum()
    }

    /// Spreads inertial rows to whole ones, with the joints' own columns.
    fn own_columns(&self, y: &mut [f64], column: impl Fn(usize, &JointTerm) -> f64) {
        let (p, shared) = (self.unknowns(), self.columns.shared);
        // from the last to the first: they only move up
        for j in (0..self.coordinates()).rev() {
            y.copy_within(j * shared..(j + 1) * shared, j * p);
            y[j * p + shared..(j + 1) * p].fill(0.0);
            let first = self.columns.first_own(j);
            for (c, own) in self.columns.own[j].iter().enumerate() {
                y[j * p + first + c] = column(j, own);
            }
        }
    }

    /// What channels bound at a state.
    #[inline]
    pub fn quantities<'a>(&'a self, state: &'a State) -> BoundQuantities<'a> {
        BoundQuantities {
            machine: self,
            state,
            frames: OnceCell::new(),
            half_widths: OnceCell::new(),
        }
    }
}

/// What channels bound at one state.
#[derive(Debug)]
pub struct BoundQuantities<'a> {
    machine: &'a ForeseenRobot,
    state: &'a State,
    frames: OnceCell<Vec<Frame>>,
    /// How far the torques may be off, and the drives.
    half_widths: OnceCell<[[f64; MAX_COORDINATES]; 2]>,
}

impl BoundQuantities<'_> {
    /// How far the quantity of a channel may be off, 95 % of the time.
    #[inline]
    pub fn half_width(&self, channel: &BoundedQuantity) -> f64 {
        if !channel.quantity.is_of_torque() {
            return 0.0;
        }
        let [torques, drives] = self.half_widths.get_or_init(|| self.widths());
        match channel.quantity {
            Quantity::Torque => torques[channel.index],
            _ => drives[channel.index],
        }
    }

    fn widths(&self) -> [[f64; MAX_COORDINATES]; 2] {
        let (machine, n) = (self.machine, self.machine.coordinates());
        let [q, v, a] = [&self.state.q, &self.state.v, &self.state.a].map(|x| &x[..n]);
        let (mut torques, mut drives) = ([0.0; MAX_COORDINATES], [0.0; MAX_COORDINATES]);
        machine.source.half_widths([q, v, a], &mut torques);
        // a drive carries a share of each torque; as if all were off at once
        for j in (0..n).filter(|j| torques[*j] > 0.0) {
            let mut one = [0.0; MAX_COORDINATES];
            one[j] = torques[j];
            if let Ok(of_one) = machine.drives(q, &one[..n]) {
                for (sum, x) in drives.iter_mut().zip(of_one) {
                    *sum += x.abs();
                }
            }
        }
        [torques, drives]
    }

    /// The quantity of a channel.
    #[inline]
    pub fn of(&self, channel: &BoundedQuantity) -> f64 {
        let (i, machine, state) = (channel.index, self.machine, self.state);
        let robot = &machine.model.robot;
        let q = &state.q[..machine.coordinates()];
        match channel.quantity {
            Quantity::Position => state.k.x[i],
            Quantity::Speed => state.k.xd[i],
            Quantity::Acceleration => state.k.xdd[i],
            Quantity::Drive => state.drive[i],
            Quantity::Torque => state.tau[i],
            Quantity::JointPosition => state.q[i],
            Quantity::JointSpeed => state.v[i],
            Quantity::JointAcceleration => state.a[i],
            Quantity::Clearance => robot.transmission().clearance(q).unwrap_or(1.0),
            place => {
                let frames = self.frames.get_or_init(|| frames(robot.tree(), q));
                machine.space.value(place, i, frames)
            }
        }
    }
}
