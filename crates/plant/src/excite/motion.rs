//! A motion that is to be judged before the robot moves: a series with its blends, or any other
//! reference that the simulator can follow.

use std::f64::consts::TAU;

use crate::simulate::{Reference, ReferenceFrame, experiment};
use cft_ident_core::robot::Robot;
use cft_ident_files::config::trajectory::{FourierSection, Trajectory};

use super::ExciteError;
use super::blend::TimeScaling;
use super::from_files::series_of;
use super::limits::BoundedQuantity;
use super::machine::ForeseenRobot;
use super::series::{Kinematics, MAX_COORDINATES, Series};
use super::usage::{ChannelUse, along, along_blend, along_period, joined};

/// Step of the differences that give the acceleration of a reference \[s\].
const STEP: f64 = 1e-4;
/// First parts per second of a reference, looked through for its nearest approach to a limit.
const PARTS: f64 = 400.0;
/// Blend of a series whose file names none, which is the simulator's \[s\].
const BLEND: f64 = 2.0;

/// Most periods that a blend may last: each is looked through in parts.
const MOST_PERIODS: f64 = 1000.0;
/// Longest motion that is looked through \[s\]: some hours.
const MAX_DURATION_S: f64 = 1e5;

/// Coordinates over time.
type KinematicsFunction = Box<dyn Fn(f64) -> Kinematics + Send + Sync>;

/// A motion from rest to rest, or one that repeats itself.
pub enum Motion {
    /// A Fourier series in the designed coordinates.
    Periodic { series: Series, blend: TimeScaling },
    /// Any other reference, over its duration \[s\].
    Path {
        at: KinematicsFunction,
        seconds: f64,
    },
}

impl Motion {
    /// The motion of a trajectory file. `seconds` and `seed` are those of a one-joint ladder.
    ///
    /// # Errors
    /// [`ExciteError`] where the trajectory names what the machine does not have, or does not fit.
    pub fn of_file(
        machine: &ForeseenRobot,
        file: &Trajectory,
        seconds: f64,
        seed: u64,
    ) -> Result<Self, ExciteError> {
        if let Trajectory::Fourier(fourier) = file
            && fourier.coordinates == machine.designed()
        {
            let blend = blend_of(fourier);
            let periods = blend.seconds * fourier.fundamental_hz;
            if periods > MOST_PERIODS {
                return Err(ExciteError::LongBlend {
                    blend_s: blend.seconds,
                    fundamental_hz: fourier.fundamental_hz,
                    periods,
                    most: MOST_PERIODS,
                });
            }
            let series = series_of(machine, fourier)?;
            return Ok(Self::Periodic { series, blend });
        }
        // before a ladder of that length is built
        short_enough(seconds)?;
        let reference = experiment::of_file(&machine.mechanism, file, Some(seconds), seed)?;
        reference.path.check()?;
        let seconds = match (reference.path.seconds(), file) {
            (Some(own), _) => own,
            // a period that repeats itself
            (None, Trajectory::Fourier(fourier)) => 1.0 / fourier.fundamental_hz,
            (None, _) => seconds,
        };
        short_enough(seconds)?;
        let robot = machine.model.robot.clone();
        Ok(Self::Path {
            at: Box::new(move |t| kinematics(&reference, &robot, t)),
            seconds,
        })
    }

    /// All coordinates at the time t of the motion \[s\].
    pub fn at(&self, t: f64) -> Kinematics {
        match self {
            Self::Periodic { series, blend } => blend.at(series, t),
            Self::Path { at, .. } => at(t),
        }
    }

    /// Duration of the motion \[s\].
    pub fn seconds(&self) -> f64 {
        match self {
            Self::Periodic { series, blend } => blend.duration(series.period()),
            Self::Path { seconds, .. } => *seconds,
        }
    }

    /// How near the motion comes to every channel, blends and what lies between samples included.
    pub fn usage(&self, machine: &ForeseenRobot, channels: &[BoundedQuantity]) -> Vec<ChannelUse> {
        match self {
            Self::Periodic { series, blend } => {
                let whole = along_period(machine, channels, series);
                joined(whole, along_blend(machine, channels, series, blend))
            }
            Self::Path { at, seconds } => {
                let parts = (PARTS * seconds).ceil().max(64.0) as usize;
                along(machine, channels, at, [0.0, *seconds], parts)
            }
        }
    }
}

fn short_enough(seconds: f64) -> Result<(), ExciteError> {
    let most = MAX_DURATION_S;
    match seconds > most {
        true => Err(ExciteError::LongMotion { seconds, most }),
        false => Ok(()),
    }
}

/// Start, blend and periods of a file, blended as the simulator does where it does not say.
fn blend_of(file: &FourierSection) -> TimeScaling {
    TimeScaling {
        start: file.start_s.unwrap_or(0.0),
        seconds: file.blend_s.unwrap_or(BLEND),
        periods: file.periods,
    }
}

/// Positions, velocities and accelerations of a reference in its own coordinates.
pub(super) fn differentiated(reference: &Reference<MAX_COORDINATES>, t: f64) -> Kinematics {
    let [before, here, after] = [t - STEP, t, t + STEP].map(|t| reference.path.at(t));
    let (before, after) = (before.velocity, after.velocity);
    Kinematics {
        x: here.position,
        xd: here.velocity,
        xdd: std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * STEP)),
    }
}

/// A reference in the motors' coordinates.
fn kinematics(reference: &Reference<MAX_COORDINATES>, robot: &Robot, t: f64) -> Kinematics {
    let own = differentiated(reference, t);
    if reference.frame == ReferenceFrame::Motors {
        return own;
    }
    let (n, mut k) = (robot.joints(), Kinematics::REST);
    let (q, v, a) = (&own.x[..n], &own.xd[..n], &own.xdd[..n]);
    let transmission = robot.transmission();
    transmission.positions(q, &mut k.x[..n]);
    transmission.velocities(q, v, &mut k.xd[..n]);
    transmission.accelerations(q, v, a, &mut k.xdd[..n]);
    k
}

/// Amplitudes of the speed per harmonic of a series, coordinate after coordinate \[m/s or rad/s\].
pub(super) fn spectrum(series: &Series) -> Vec<Vec<f64>> {
    let of = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a.hypot(*b)).collect();
    series.a.iter().zip(&series.b).map(of).collect()
}

/// Frequency \[Hz\] below which a share of the torque's power lies, per joint, its constant part left out.
pub(super) fn torque_band(
    machine: &ForeseenRobot,
    series: &Series,
    share: f64,
) -> Result<Vec<f64>, ExciteError> {
    const SAMPLES: usize = 1024;
    const LINES: usize = 256;
    let n = machine.coordinates();
    let mut tau = vec![0.0; SAMPLES * n];
    for m in 0..SAMPLES {
        let t = series.period() * m as f64 / SAMPLES as f64;
        let state = machine.state(&series.at(t))?;
        tau[m * n..(m + 1) * n].copy_from_slice(&state.tau[..n]);
    }
    let power = |j: usize, l: usize| {
        let (mut c, mut s) = (0.0, 0.0);
        for m in 0..SAMPLES {
            let (sin, cos) = (TAU * (m * l % SAMPLES) as f64 / SAMPLES as f64).sin_cos();
            c += cos * tau[m * n + j];
            s += sin * tau[m * n + j];
        }
        c * c + s * s
    };
    let band = |j| {
        let lines: Vec<f64> = (1..=LINES).map(|l| power(j, l)).collect();
        let whole: f64 = lines.iter().sum();
        let mut below = 0.0;
        let first = lines.iter().position(|line| {
            below += line;
            below >= share * whole
        });
        (first.unwrap_or(LINES) + 1) as f64 / series.period()
    };
    Ok((0..n).map(band).collect())
}
