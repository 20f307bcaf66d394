//! How near a motion comes to each limit, between samples too.

use std::f64::consts::TAU;

use super::ExciteError;
use super::blend::Blend;
use super::limits::{BoundedQuantity, Quantity};
use super::machine::{ForeseenRobot, State};
use super::peak::{Peak, highest, highest_from};
use super::series::{Kinematics, Series};

/// How far a highest share may be off the one found.
const TOLERANCE: f64 = 1e-7;
/// First parts of a period for what is not a trigonometric polynomial: friction turns round within milliseconds.
const PARTS: usize = 1024;
/// The same where a motion is only prepared.
const ROUGH_PARTS: usize = 96;
/// The same as [`TOLERANCE`] in a search.
const SEARCH_TOLERANCE: f64 = 1e-5;
const ROUGH: f64 = 1e-3;

/// A channel along a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Use {
    pub channel: BoundedQuantity,
    /// Least and most of the quantity, of a torque with its 95 % band.
    pub range: [f64; 2],
    /// Share of the limit: 1 at it, above 1 beyond it; infinite where the machine cannot follow.
    pub share: f64,
    /// Time at which it comes nearest \[s\], on the clock of what was looked along.
    pub t: f64,
}

/// All coordinates as a function of time, over an interval.
pub struct Interval<'a> {
    pub at: &'a (dyn Fn(f64) -> Kinematics + Sync),
    /// From and to \[s\].
    pub span: [f64; 2],
    /// Equal parts to begin with.
    pub parts: usize,
}

/// Channels along the whole period of a series: those that are trigonometric polynomials with a
/// certain bound, the others with one from their measured curvature.
pub fn along_period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
) -> Vec<Use> {
    period(machine, channels, series, PARTS, TOLERANCE)
}

/// [`along_period`] with bounds that lie a little higher, for searches.
pub(super) fn closely_along_period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
) -> Vec<Use> {
    period(machine, channels, series, PARTS, SEARCH_TOLERANCE)
}

/// [`along_period`], to a thousandth.
pub(super) fn roughly_along_period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
) -> Vec<Use> {
    period(machine, channels, series, ROUGH_PARTS, ROUGH)
}

fn period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    parts: usize,
    tolerance: f64,
) -> Vec<Use> {
    let path = Interval {
        at: &|t| series.at(t),
        span: [0.0, series.period()],
        parts,
    };
    let (linear, curved): (Vec<&BoundedQuantity>, Vec<&BoundedQuantity>) =
        channels.iter().partition(|c| c.quantity.is_linear());
    let mut curved = of_path(machine, &curved, &path, tolerance).into_iter();
    let mut linear = linear.into_iter().map(|c| of_polynomial(c, series));
    channels
        .iter()
        .filter_map(|c| match c.quantity.is_linear() {
            true => linear.next(),
            false => curved.next(),
        })
        .collect()
}

/// Channels along any path.
pub fn along(machine: &ForeseenRobot, channels: &[BoundedQuantity], path: &Interval) -> Vec<Use> {
    let channels: Vec<&BoundedQuantity> = channels.iter().collect();
    of_path(machine, &channels, path, TOLERANCE)
}

/// Channels along the motion from rest to rest, outside the whole periods.
pub fn along_blend(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    blend: &Blend,
) -> Vec<Use> {
    let at = |t| blend.at(series, t);
    let parts = (PARTS as f64 * (blend.seconds / series.period()).max(0.25)).ceil() as usize;
    let over = |interval| {
        let path = Interval {
            at: &at,
            span: interval,
            parts,
        };
        along(machine, channels, &path)
    };
    let into = over([0.0, blend.seconds]);
    if blend.periods.is_none() {
        return into;
    }
    let end = blend.duration(series.period());
    let out = over([end - blend.seconds, end]);
    into.into_iter()
        .zip(out)
        .map(|(a, b)| a.joined(b))
        .collect()
}

/// Parts of a straight way to begin with.
const WAY_PARTS: usize = 512;

/// Channels along the straight way between two poses in the designed coordinates, slowly: on the clock that is 0
/// at the first and 1 at the other.
pub fn along_way(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    from: &[f64],
    to: &Kinematics,
) -> Vec<Use> {
    let at = |share: f64| {
        let mut k = Kinematics::REST;
        for ((x, from), to) in k.x.iter_mut().zip(from).zip(to.x) {
            *x = from + share * (to - from);
        }
        k
    };
    let path = Interval {
        at: &at,
        span: [0.0, 1.0],
        parts: WAY_PARTS,
    };
    along(machine, channels, &path)
}

/// Refuses a pose in the designed coordinates that breaks a limit itself: no way leads out of it.
///
/// # Errors
/// [`ExciteError::BrokenPose`] with the limit that it breaks most.
pub fn check_pose(machine: &ForeseenRobot, from: &[f64]) -> Result<(), ExciteError> {
    let mut here = Kinematics::REST;
    here.x[..from.len()].copy_from_slice(from);
    let uses = along_way(machine, &machine.channels, from, &here);
    match most_broken(uses) {
        None => Ok(()),
        Some(found) => Err(ExciteError::BrokenPose {
            what: found.what(),
            value: found.range[0],
        }),
    }
}

/// The limit that is broken most; none where all hold.
fn most_broken(uses: Vec<Use>) -> Option<Use> {
    let worst = uses.into_iter().max_by(|a, b| a.share.total_cmp(&b.share));
    worst.filter(|found| found.share > 1.0)
}

/// Durations that are tried, in periods.
const DURATIONS: [f64; 10] = [0.4, 0.5, 0.64, 0.8, 1.0, 1.2, 1.6, 2.0, 3.2, 6.4];
/// Points of the period at which the motion may begin.
const STARTS: u32 = 16;

impl Blend {
    /// The shortest blend of those tried along which every channel holds, and on the straight way to its first
    /// point from a pose where one is given, begun where it stays farthest from them.
    ///
    /// # Errors
    /// [`ExciteError::NoBlend`] where even the longest breaks one, [`ExciteError::NoWay`] where all ways to
    /// the points where blends begin do.
    pub fn within(
        machine: &ForeseenRobot,
        channels: &[BoundedQuantity],
        series: &Series,
        periods: u32,
        from: Option<&[f64]>,
    ) -> Result<Self, ExciteError> {
        let period = series.period();
        // of the longest: the least that a blend uses, and the way that leads to it
        let mut last = (f64::INFINITY, None);
        for duration in DURATIONS {
            let tried = (0..STARTS).map(|k| {
                let blend = Self {
                    start: period * f64::from(k) / f64::from(STARTS),
                    seconds: duration * period,
                    periods: Some(periods),
                };
                let share = worst(&along_blend(machine, channels, series, &blend));
                (share, blend)
            });
            let mut tried: Vec<(f64, Self)> = tried.collect();
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
            last = (tried[0].0, None);
            for (_, blend) in tried.into_iter().filter(|(share, _)| *share <= 1.0) {
                let Some(from) = from else { return Ok(blend) };
                let way = along_way(machine, channels, from, &blend.at(series, 0.0));
                match most_broken(way) {
                    Some(broken) => {
                        last.1.get_or_insert(broken);
                    }
                    None => return Ok(blend),
                }
            }
        }
        Err(match last {
            (_, Some(broken)) => ExciteError::NoWay {
                what: broken.what(),
                percent: (100.0 * broken.t).round(),
            },
            (share, None) => ExciteError::NoBlend {
                seconds: DURATIONS[DURATIONS.len() - 1] * period,
                share,
            },
        })
    }
}

impl Use {
    /// What is bounded, and of what.
    fn what(&self) -> String {
        format!("{} of {}", self.channel.quantity.name(), self.channel.name)
    }

    /// The same channel along two motions.
    pub fn joined(self, other: Self) -> Self {
        let range = [
            self.range[0].min(other.range[0]),
            self.range[1].max(other.range[1]),
        ];
        let nearest = if other.share > self.share {
            other
        } else {
            self
        };
        Self { range, ..nearest }
    }
}

/// The largest share of several channels, 0 where there are none.
pub fn worst(uses: &[Use]) -> f64 {
    uses.iter().fold(0.0, |most, u| most.max(u.share))
}

fn gathered(channel: &BoundedQuantity, most: Peak, least: Peak) -> Use {
    // least is the peak of the negative
    let upper = channel.used(most.bound);
    let lower = channel.used(-least.bound);
    let one_sided = channel.upper.is_infinite();
    let broken = most.value == f64::INFINITY || least.value == f64::INFINITY;
    let (share, t) = if broken {
        let t = if most.value == f64::INFINITY {
            most.t
        } else {
            least.t
        };
        (f64::INFINITY, t)
    } else if upper > lower && !one_sided {
        (upper, most.t)
    } else {
        (lower, least.t)
    };
    Use {
        channel: channel.clone(),
        range: [-least.value, most.value],
        share,
        t,
    }
}

/// Size of a channel's room: what a share of 1 stands for.
fn room(channel: &BoundedQuantity) -> f64 {
    if channel.upper.is_finite() {
        0.5 * (channel.upper - channel.lower)
    } else {
        channel.lower
    }
}

fn of_polynomial(channel: &BoundedQuantity, series: &Series) -> Use {
    let i = channel.index;
    let order = match channel.quantity {
        Quantity::Position => 0,
        Quantity::Speed => 1,
        _ => 2,
    };
    let curvature = series.derivative_bound(i, order + 2);
    let interval = [0.0, TAU / series.fundamental];
    let parts = 8 * series.harmonics().max(1);
    let peak = |sign: f64| {
        let mut f = |t| sign * series.one(i, t)[order as usize];
        highest(
            &mut f,
            interval,
            parts,
            Some(curvature),
            TOLERANCE * room(channel),
        )
    };
    gathered(channel, peak(1.0), peak(-1.0))
}

fn of_path(
    machine: &ForeseenRobot,
    channels: &[&BoundedQuantity],
    path: &Interval,
    tolerance: f64,
) -> Vec<Use> {
    let [from, to] = path.span;
    let mut state = State::EMPTY;
    let mut grid = vec![Vec::with_capacity(path.parts + 1); channels.len()];
    for m in 0..=path.parts {
        let k = (path.at)(from + (to - from) * m as f64 / path.parts as f64);
        let reached = machine.fill(&k, &mut state).is_ok();
        let quantities = machine.quantities(&state);
        for (channel, values) in channels.iter().zip(&mut grid) {
            values.push(match (channel.quantity.is_linear(), reached) {
                (true, _) => (of_kinematics(channel, &k), 0.0),
                (false, true) => (quantities.of(channel), quantities.half_width(channel)),
                (false, false) => (f64::NAN, 0.0),
            });
        }
    }
    let mut value = |channel: &BoundedQuantity, t: f64| {
        let k = (path.at)(t);
        if channel.quantity.is_linear() {
            return (of_kinematics(channel, &k), 0.0);
        }
        if machine.fill(&k, &mut state).is_err() {
            return (f64::NAN, 0.0);
        }
        let quantities = machine.quantities(&state);
        (quantities.of(channel), quantities.half_width(channel))
    };
    channels
        .iter()
        .zip(grid)
        .map(|(channel, values)| {
            let mut peak = |sign: f64| {
                let beyond = |(value, half): (f64, f64)| sign * value + half;
                let samples: Vec<f64> = values.iter().copied().map(beyond).collect();
                let mut f = |t| beyond(value(channel, t));
                let tolerance = tolerance * room(channel);
                highest_from(&mut f, path.span, &samples, None, tolerance)
            };
            gathered(channel, peak(1.0), peak(-1.0))
        })
        .collect()
}

/// Position, speed or acceleration that a linear channel bounds.
fn of_kinematics(channel: &BoundedQuantity, k: &Kinematics) -> f64 {
    let i = channel.index;
    match channel.quantity {
        Quantity::Position => k.x[i],
        Quantity::Speed => k.xd[i],
        _ => k.xdd[i],
    }
}
