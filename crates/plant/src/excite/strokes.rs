//! Strokes of one joint at several amplitudes around a width: a gap keeps its width at every amplitude, friction that bends
//! before it slips makes a loop that shrinks with the amplitude, and friction over speed knows neither. How far a motion
//! tells them apart is the torque of the one that the others cannot take over, in standard errors.

use cft_ident_core::effect::{backlash, presliding, smooth_coulomb};
use schemars::JsonSchema;
use serde::Serialize;

use cft_ident_files::config::trajectory::{
    Point, PointsSection, Trajectory, TrajectoryCoordinates,
};

use super::ExciteError;
use super::from_files::place_of;
use super::limits::{BoundedQuantity, Quantity};
use super::machine::ForeseenRobot;
use super::motion::Motion;

/// Strokes from end to end, as parts of the width: two stay inside of it. Without those a gap looks like friction that
/// begins later; without the last ones the width does not show beside the stroke.
const STROKES: [f64; 7] = [0.5, 0.8, 1.3, 2.0, 4.0, 8.0, 16.0];
/// Least strokes that are of use: one inside the width and two beyond.
const LEAST: usize = 4;
/// Times to and fro at each amplitude and pace; half of it leaves no part of the data to compare.
const CYCLES: usize = 4;
/// Paces: the second as fast as the first is slow, for friction over speed is told by speed alone.
const PACES: [f64; 2] = [1.0, 2.5];
/// Least time of one stroke to and fro, in periods of the cut-off: what is faster the filter takes away.
const PERIODS: f64 = 6.0;
/// Points of one stroke to and fro.
const POINTS: usize = 16;
/// Samples for each row of the foreseen log.
const SAMPLES_PER_ROW: usize = 8;
/// Widths, and speeds, that the others may take, as parts of their own.
const OTHERS: [f64; 9] = [0.1, 0.2, 0.35, 0.6, 1.0, 1.6, 2.5, 4.0, 8.0];
/// A column that the columns before it leave less of than this share holds nothing of its own.
const NOTHING: f64 = 1e-9;

/// The effect that is in question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrictionMemory {
    /// A play: the torque is missing over a fixed way after a reversal.
    Gap,
    /// A bristle: the torque builds up over a way after a reversal.
    Bristle,
}

/// What is to be designed.
#[derive(Debug, Clone)]
pub struct StrokesTask {
    pub joint: String,
    pub effect: FrictionMemory,
    /// Gap, or way over which friction builds up \[m or rad\].
    pub width: f64,
    /// Size of its torque \[N or Nm\].
    pub torque: f64,
    /// Cut-off of the parallel filter \[Hz\].
    pub cutoff_hz: f64,
    /// Rate of the log \[Hz\].
    pub rate_hz: f64,
    /// Share of every limit that is left free.
    pub reserve: f64,
}

/// How far a motion tells an effect from its like.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Separation")]
pub struct EffectSeparation {
    pub joint: String,
    /// Gap, or way over which friction builds up \[m or rad\].
    pub width: f64,
    /// Half strokes \[m or rad\].
    pub amplitudes: Vec<f64>,
    /// The like that comes nearest.
    pub from: &'static str,
    /// Torque that the like cannot take over, in standard errors of the log's noise.
    pub deviations: f64,
}

/// Strokes, and how far they separate.
#[derive(Debug, Clone)]
pub struct DesignedStrokes {
    pub file: PointsSection,
    pub separation: EffectSeparation,
}

/// Designs the strokes of one joint about the middle of the positions that its limits allow.
///
/// # Errors
/// [`ExciteError::Narrow`] where the joint has no room for strokes beyond the width, others where there is no such joint.
pub fn design_strokes(
    machine: &ForeseenRobot,
    task: &StrokesTask,
) -> Result<DesignedStrokes, ExciteError> {
    let joint = place_of(machine.model.robot.joint_names(), &task.joint)?;
    let of = |quantity, index| BoundedQuantity::find(&machine.channels, quantity, index);
    let free = 1.0 - task.reserve;
    let pose: Vec<f64> = (0..machine.coordinates())
        .map(|i| of(Quantity::Position, i).map_or(0.0, BoundedQuantity::middle))
        .map(|x| if x.is_finite() { x } else { 0.0 })
        .collect();
    let room = of(Quantity::Position, joint).map_or(f64::INFINITY, BoundedQuantity::room);
    let amplitudes: Vec<f64> = STROKES
        .map(|part| 0.5 * part * task.width)
        .into_iter()
        .filter(|amplitude| *amplitude <= free * room)
        .collect();
    if amplitudes.len() < LEAST {
        return Err(ExciteError::Narrow {
            joint: task.joint.clone(),
            width: task.width,
            room: 2.0 * room,
        });
    }
    let most = |quantity| of(quantity, joint).map_or(f64::INFINITY, |c| free * c.upper);
    let [speed, acceleration] = [Quantity::Speed, Quantity::Acceleration].map(most);
    let turn = std::f64::consts::TAU;
    let period = |amplitude: f64| {
        let by_speed = turn * amplitude / speed;
        let by_acceleration = turn * (amplitude / acceleration).sqrt();
        by_speed.max(by_acceleration).max(PERIODS / task.cutoff_hz)
    };
    let file_of = |path: &StrokePath| {
        let points = path.points.iter().map(|[t, x]| {
            let mut position = pose.clone();
            position[joint] += x;
            Point { t: *t, position }
        });
        PointsSection {
            coordinates: TrajectoryCoordinates::Joint,
            points: points.collect(),
        }
    };
    let mut path = StrokePath::of(&amplitudes, &period);
    let mut file = file_of(&path);
    // where one stroke goes over into the next a curve through the points is faster than either
    let slower = slower_by(machine, joint, &file, free)?;
    if slower > 1.0 {
        path = StrokePath::of(&amplitudes, &|amplitude| slower * period(amplitude));
        file = file_of(&path);
    }
    let rows = 2.0 * task.cutoff_hz;
    // the noise of a row that is the mean of its samples
    let noise = machine.noise[joint] * (rows / task.rate_hz).min(1.0).sqrt();
    let (from, deviations) = separation(&path, task, noise);
    Ok(DesignedStrokes {
        file,
        separation: EffectSeparation {
            joint: task.joint.clone(),
            width: task.width,
            amplitudes,
            from,
            deviations,
        },
    })
}

/// How many times slower a motion must be to leave this share of a joint's limits of speed and acceleration.
fn slower_by(
    machine: &ForeseenRobot,
    joint: usize,
    file: &PointsSection,
    free: f64,
) -> Result<f64, ExciteError> {
    let seconds = file.points.last().map_or(0.0, |last| last.t);
    let motion = Motion::of_file(machine, &Trajectory::Points(file.clone()), seconds, 0)?;
    let of = |quantity| BoundedQuantity::find(&machine.channels, quantity, joint).cloned();
    let channels: Vec<BoundedQuantity> = [Quantity::Speed, Quantity::Acceleration]
        .into_iter()
        .filter_map(of)
        .collect();
    let uses = motion.usage(machine, &channels).into_iter();
    let slower = uses.map(|of| {
        let over = of.share / free;
        match of.channel.quantity {
            Quantity::Acceleration => over.sqrt(),
            _ => over,
        }
    });
    Ok(slower.fold(0.0, f64::max))
}

/// A way to and fro: times and positions, and its parts as amplitude, period and begin.
struct StrokePath {
    points: Vec<[f64; 2]>,
    parts: Vec<StrokePart>,
    seconds: f64,
}

/// A piece of a cosine from `from` to `to` and back, or from one end to the next.
struct StrokePart {
    begin: f64,
    seconds: f64,
    /// Position at its begin and half a period later.
    ends: [f64; 2],
    period: f64,
}

impl StrokePart {
    /// Position, speed and acceleration.
    fn at(&self, t: f64) -> [f64; 3] {
        let (middle, half) = (
            0.5 * (self.ends[0] + self.ends[1]),
            0.5 * (self.ends[0] - self.ends[1]),
        );
        let w = std::f64::consts::TAU / self.period;
        let (sin, cos) = (w * (t - self.begin)).sin_cos();
        [middle + half * cos, -half * w * sin, -half * w * w * cos]
    }
}

impl StrokePath {
    fn of(amplitudes: &[f64], period: &dyn Fn(f64) -> f64) -> Self {
        let mut parts: Vec<StrokePart> = Vec::new();
        let mut begin = 0.0;
        let mut add = |ends: [f64; 2], period: f64, cycles: f64| {
            let seconds = cycles * period;
            parts.push(StrokePart {
                begin,
                seconds,
                ends,
                period,
            });
            begin += seconds;
        };
        let mut before: Option<f64> = None;
        for pace in PACES {
            for amplitude in amplitudes {
                if let Some(last) = before.filter(|last| last != amplitude) {
                    let slower = period(last).max(period(*amplitude));
                    add([-last, -amplitude], pace * slower, 0.5);
                }
                add(
                    [-amplitude, *amplitude],
                    pace * period(*amplitude),
                    CYCLES as f64,
                );
                before = Some(*amplitude);
            }
        }
        let points = parts.iter().flat_map(|part| {
            let count = (POINTS as f64 * part.seconds / part.period).round() as usize;
            (0..count).map(move |k| {
                let t = part.begin + part.seconds * k as f64 / count as f64;
                [t, part.at(t)[0]]
            })
        });
        let mut points: Vec<[f64; 2]> = points.collect();
        if let Some(last) = parts.last() {
            points.push([begin, last.at(begin)[0]]);
        }
        StrokePath {
            points,
            parts,
            seconds: begin,
        }
    }

    /// Position, speed and acceleration at a time.
    fn at(&self, t: f64) -> [f64; 3] {
        let part = self.parts.iter().rev().find(|part| part.begin <= t);
        part.or(self.parts.first()).map_or([0.0; 3], |p| p.at(t))
    }
}

/// A torque of size 1 with a memory or over speed, sample after sample.
#[derive(Clone, Copy)]
enum Torque {
    /// -sgn(v) inside a gap of this width.
    Gap(f64),
    /// h - sgn(v), where h goes to the other side over this way.
    Bristle(f64),
    /// tanh(v/vs) - sgn(v).
    OverSpeed(f64),
}

impl Torque {
    fn along(self, samples: &[[f64; 3]], step: f64) -> Vec<f64> {
        let first = samples.first().map_or(0.0, |s| s[0]);
        let (mut far, mut h) = (first, 0.0_f64);
        let one = |[q, v, _]: &[f64; 3]| {
            let sign = if *v == 0.0 { 0.0 } else { v.signum() };
            match self {
                Torque::Gap(width) => {
                    let before = far;
                    far = before.clamp(q - 0.5 * width, q + 0.5 * width);
                    if far == before { -sign } else { 0.0 }
                }
                Torque::Bristle(way) => {
                    // exact over a step of constant speed
                    h = sign + (h - sign) * (-v.abs() * step / way).exp();
                    h - sign
                }
                Torque::OverSpeed(vs) => (v / vs).tanh() - sign,
            }
        };
        samples.iter().map(one).collect()
    }
}

/// The like that comes nearest to the effect, and the torque that it leaves in standard errors.
fn separation(path: &StrokePath, task: &StrokesTask, noise: f64) -> (&'static str, f64) {
    let rate = 2.0 * task.cutoff_hz * SAMPLES_PER_ROW as f64;
    let count = (path.seconds * rate) as usize;
    let samples: Vec<[f64; 3]> = (0..count).map(|k| path.at(k as f64 / rate)).collect();
    let rows = |values: Vec<f64>| -> Vec<f64> {
        let means = values.chunks_exact(SAMPLES_PER_ROW);
        means
            .map(|of| of.iter().sum::<f64>() / SAMPLES_PER_ROW as f64)
            .collect()
    };
    let along = |torque: Torque| rows(torque.along(&samples, 1.0 / rate));
    // what a fit has anyway: offset, weight or spring, viscous and Coulomb friction, inertia
    let column = |of: &dyn Fn(&[f64; 3]) -> f64| rows(samples.iter().map(of).collect());
    let known = [
        column(&|_| 1.0),
        column(&|s| s[0]),
        column(&|s| s[1]),
        column(&|s| s[2]),
        column(&|s| s[1].signum()),
    ];
    let own = match task.effect {
        FrictionMemory::Gap => Torque::Gap(task.width),
        FrictionMemory::Bristle => Torque::Bristle(task.width),
    };
    let own: Vec<f64> = along(own).iter().map(|x| task.torque * x).collect();
    let fastest = samples
        .iter()
        .fold(0.0, |most: f64, s| most.max(s[1].abs()));
    let likes = OTHERS.iter().flat_map(|part| {
        let memory = match task.effect {
            FrictionMemory::Gap => (presliding::ENTRY.name, Torque::Bristle(part * task.width)),
            FrictionMemory::Bristle => (backlash::ENTRY.name, Torque::Gap(part * task.width)),
        };
        let slow = Torque::OverSpeed(part / 8.0 * fastest);
        [memory, (smooth_coulomb::ENTRY.name, slow)]
    });
    let left = likes.map(|(name, like)| {
        let basis = known.iter().cloned().chain([along(like)]);
        (
            name,
            beside(basis, own.clone()) / noise.max(f64::MIN_POSITIVE),
        )
    });
    left.min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or(("nothing", 0.0))
}

/// Norm of what is left of `own` beside all combinations of the basis.
fn beside(basis: impl Iterator<Item = Vec<f64>>, mut own: Vec<f64>) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let take = |from: &mut [f64], unit: &[f64]| {
        let part = dot(from, unit);
        from.iter_mut().zip(unit).for_each(|(x, u)| *x -= part * u);
    };
    let mut units: Vec<Vec<f64>> = Vec::new();
    for mut column in basis {
        let whole = dot(&column, &column).sqrt();
        // twice, for the first time leaves what rounding makes
        for _ in 0..2 {
            units.iter().for_each(|unit| take(&mut column, unit));
        }
        let left = dot(&column, &column).sqrt();
        if left > NOTHING * whole {
            column.iter_mut().for_each(|x| *x /= left);
            take(&mut own, &column);
            units.push(column);
        }
    }
    dot(&own, &own).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(effect: FrictionMemory, torque: f64) -> StrokesTask {
        StrokesTask {
            joint: "q1".into(),
            effect,
            width: 0.02,
            torque,
            cutoff_hz: 10.0,
            rate_hz: 125.0,
            reserve: 0.05,
        }
    }

    fn path(amplitudes: &[f64]) -> StrokePath {
        StrokePath::of(amplitudes, &|_| 0.6)
    }

    const AROUND: [f64; 5] = [0.005, 0.008, 0.013, 0.04, 0.08];

    #[test]
    fn strokes_join_at_rest_and_their_speed_is_that_of_their_positions() {
        let path = path(&AROUND);
        let h = 1e-6;
        for k in 1..2000 {
            let t = path.seconds * f64::from(k) / 2000.0;
            let [_, v, _] = path.at(t);
            let slope = (path.at(t + h)[0] - path.at(t - h)[0]) / (2.0 * h);
            assert!((v - slope).abs() < 1e-4, "{v} {slope} at {t}");
        }
        assert!(path.points.windows(2).all(|p| p[0][0] < p[1][0]));
        let ends = [path.points.first(), path.points.last()];
        let rest = ends.map(|end| path.at(end.unwrap()[0])[1].abs() < 1e-9);
        assert_eq!(rest, [true, true]);
    }

    #[test]
    fn strokes_around_a_gap_tell_it_from_its_like_and_strokes_inside_of_it_do_not() {
        for effect in [FrictionMemory::Gap, FrictionMemory::Bristle] {
            let of = |amplitudes: &[f64]| separation(&path(amplitudes), &task(effect, 2.0), 0.1).1;
            let (around, inside) = (of(&AROUND), of(&[0.0002; 5]));
            assert!(around > 5.0, "{around}");
            assert!(inside < 0.1 * around, "{inside} {around}");
        }
    }

    #[test]
    fn the_separation_grows_with_the_torque_and_falls_with_the_noise() {
        let of =
            |torque, noise| separation(&path(&AROUND), &task(FrictionMemory::Gap, torque), noise).1;
        let one = of(1.0, 0.1);
        assert!((of(2.0, 0.1) / one - 2.0).abs() < 1e-9);
        assert!((of(1.0, 0.2) / one - 0.5).abs() < 1e-9);
    }
}
