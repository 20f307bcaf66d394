//! What a robot does: the motion that it is asked for, as a reference that its controller follows.

use std::f64::consts::TAU;

use super::SimulateError;
use super::controller::ControllerSettings;
use super::mechanism::Mechanism;
use super::one_joint::{MovedAxis, OneJointMove};
use super::plant::Plant;
use super::reference::{FourierReference, Path, Reference, ReferenceFrame, SplineReference};
use cft_ident_files::config::trajectory::{self, Trajectory, TrajectoryCoordinates};

/// Duration of a motion that sets none \[s\].
pub const SECONDS: f64 = 20.0;

/// The usual motion of several joints: fundamental \[Hz\], harmonics, share of a half travel that amplitudes sum to.
const FUNDAMENTAL_HZ: f64 = 0.1;
const HARMONICS: usize = 4;
const SHARE: f64 = 0.8;

/// What the robot is to do.
#[derive(Debug, Clone, Copy)]
pub enum Experiment<'a> {
    /// Table 3 on the CFT robot, a ladder on a single joint, all joints at once on other robots.
    Usual,
    /// A trajectory file.
    Trajectory(&'a Trajectory),
    /// One joint (or motor's coordinate) runs a ladder of speeds, within a part of its range about the middle.
    OneJoint { joint: &'a str, part: f64 },
    /// Volts of a log: times \[s\], and volts row by row.
    Volts { times: &'a [f64], volts: &'a [f64] },
}

impl<'a> Experiment<'a> {
    /// One joint over all of its range.
    pub fn of_joint(joint: &'a str) -> Self {
        Self::OneJoint { joint, part: 1.0 }
    }

    /// The reference; `None` where volts are played back.
    ///
    /// # Errors
    /// [`SimulateError`] where the experiment names what the robot does not have, or does not fit.
    pub fn reference<const J: usize>(
        &self,
        mechanism: &Mechanism<J>,
        seconds: Option<f64>,
        seed: u64,
    ) -> Result<Option<Reference<J>>, SimulateError> {
        let mut ladder = OneJointMove::new(0, seconds.unwrap_or(SECONDS), Some(seed));
        Ok(match *self {
            Self::Usual => Some(usual(mechanism, &ladder)?),
            Self::OneJoint { joint, part } => {
                ladder.mover = MovedAxis::named(&mechanism.robot, joint)?;
                ladder.part = part;
                Some(ladder.reference(mechanism)?)
            }
            Self::Trajectory(file) => Some(of_file(mechanism, file, seconds, seed)?),
            Self::Volts { .. } => None,
        })
    }
}

/// Reference of a trajectory file; what a Fourier file leaves out stays in the middle of its travel.
pub(crate) fn of_file<const J: usize>(
    mechanism: &Mechanism<J>,
    file: &Trajectory,
    seconds: Option<f64>,
    seed: u64,
) -> Result<Reference<J>, SimulateError> {
    let frame = |coordinates| match coordinates {
        TrajectoryCoordinates::Cartesian if !mechanism.motors_at_joints() => ReferenceFrame::Motors,
        _ => ReferenceFrame::Joints,
    };
    match file {
        Trajectory::Fourier(file) => fourier(mechanism, file, frame(file.coordinates)),
        Trajectory::Points(file) => points(mechanism, file, frame(file.coordinates)),
        Trajectory::SingleJoint(file) => {
            let seconds = seconds.unwrap_or(SECONDS);
            OneJointMove::of(file, &mechanism.robot, seconds, seed)?.reference(mechanism)
        }
    }
}

fn fourier<const J: usize>(
    mechanism: &Mechanism<J>,
    file: &trajectory::FourierSection,
    frame: ReferenceFrame,
) -> Result<Reference<J>, SimulateError> {
    let middle = mechanism.middle();
    let robot = &mechanism.robot;
    let (names, rest) = match frame {
        ReferenceFrame::Motors => (robot.coordinate_names(), middle),
        ReferenceFrame::Joints => (robot.joint_names().to_vec(), mechanism.pose(&middle)?),
    };
    let terms = file.series.iter().map(|series| series.a.len());
    let terms = terms.max().unwrap_or(0);
    let mut series = FourierReference {
        offset: rest,
        a: vec![[0.0; J]; terms],
        b: vec![[0.0; J]; terms],
        fundamental: TAU * file.fundamental_hz,
        start: file.start_s.unwrap_or(0.0),
        blend: file.blend_s.unwrap_or(FourierReference::<J>::BLEND),
        periods: file.periods,
    };
    for coordinate in &file.series {
        let i = SimulateError::place_of(&names, &coordinate.name)?;
        series.offset[i] = coordinate.offset;
        for (l, (a, b)) in coordinate.a.iter().zip(&coordinate.b).enumerate() {
            series.a[l][i] = *a;
            series.b[l][i] = *b;
        }
    }
    let path = Path::Fourier(series);
    Ok(Reference { frame, path })
}

fn points<const J: usize>(
    mechanism: &Mechanism<J>,
    file: &trajectory::PointsSection,
    frame: ReferenceFrame,
) -> Result<Reference<J>, SimulateError> {
    let mut list = Vec::with_capacity(file.points.len());
    let first = file.points.first().map_or(0.0, |point| point.t);
    for (k, point) in (1..).zip(&file.points) {
        let Some(pose) = mechanism.widened(&point.position, 0.0) else {
            let (given, n) = (point.position.len(), mechanism.joints());
            let what = format!("point {k} has {given} coordinates and the robot has {n}");
            return Err(SimulateError::reference(what));
        };
        list.push((point.t - first, pose));
    }
    let path = Path::Points(SplineReference::new(&list)?);
    Ok(Reference { frame, path })
}

/// What the robot does where nothing is asked for.
fn usual<const J: usize>(
    mechanism: &Mechanism<J>,
    ladder: &OneJointMove,
) -> Result<Reference<J>, SimulateError> {
    let (frame, series) = match &mechanism.practice {
        Some(practice) => (
            ReferenceFrame::Motors,
            FourierReference::of(&practice.excitation),
        ),
        None if mechanism.joints() == 1 => return ladder.reference(mechanism),
        None => (ReferenceFrame::Joints, all_joints(mechanism)),
    };
    let path = Path::Fourier(series);
    Ok(Reference { frame, path })
}

/// All joints over most of their travel, each with phases of its own.
fn all_joints<const J: usize>(mechanism: &Mechanism<J>) -> FourierReference<J> {
    let (mut a, mut b) = (vec![[0.0; J]; HARMONICS], vec![[0.0; J]; HARMONICS]);
    let sum: f64 = (1..=HARMONICS).map(|k| 1.0 / k as f64).sum();
    for k in 0..HARMONICS {
        for j in 0..mechanism.joints() {
            let (low, high) = mechanism.travel(j);
            let amplitude = SHARE * 0.5 * (high - low) / (sum * (k + 1) as f64);
            let phase = TAU * ((3 * k + 1) as f64 * (j as f64 + 0.7).sqrt()).fract();
            a[k][j] = amplitude * phase.cos();
            b[k][j] = amplitude * phase.sin();
        }
    }
    FourierReference {
        offset: mechanism.middle(),
        a,
        b,
        fundamental: TAU * FUNDAMENTAL_HZ,
        start: 0.0,
        blend: FourierReference::<J>::BLEND,
        periods: None,
    }
}

/// Own frequency \[rad/s\], damping and corner frequency \[Hz\] under the usual gains, of one joint alone and of several.
const USUAL_GAINS_ALONE: [f64; 3] = [45.0, 0.6, 50.0];
const SEVERAL: [f64; 3] = [30.0, 0.8, 100.0];
/// Corner frequency \[Hz\] with gains that are known.
const CORNER: f64 = 50.0;

impl<const J: usize> Plant<J> {
    /// Gains that hold and track well at 1 kHz: those of the laboratory, or by the inertia of each joint in
    /// the middle of its travel.
    pub fn control(&self) -> ControllerSettings<J> {
        let m = &self.mechanism;
        if let Some(practice) = &m.practice {
            let [proportional, derivative] = &practice.control;
            return ControllerSettings {
                proportional: m.widened(proportional, 1.0).unwrap_or([1.0; J]),
                derivative: m.widened(derivative, 0.0).unwrap_or([0.0; J]),
                filter_hz: CORNER,
            };
        }
        let [frequency, damping, filter_hz] = match m.joints() {
            1 => USUAL_GAINS_ALONE,
            _ => SEVERAL,
        };
        let stiffness = |j: usize| self.inertia[j] * frequency * frequency / m.gain[j];
        let n = m.joints();
        ControllerSettings {
            proportional: std::array::from_fn(|j| if j < n { stiffness(j) } else { 1.0 }),
            derivative: m.filled(|j| 2.0 * damping / frequency * stiffness(j)),
            filter_hz,
        }
    }
}
