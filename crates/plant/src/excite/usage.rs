//! How near a motion comes to each limit, between samples too.

use super::ExciteError;
use super::blend::TimeScaling;
use super::limits::BoundedQuantity;
use super::machine::{BoundQuantities, ForeseenRobot, State};
use super::peak::{FunctionPeak, highest};
use super::series::{Kinematics, Series};

/// First parts of a period for what is not a trigonometric polynomial: friction turns round within milliseconds.
const PARTS: usize = 1024;
/// How far a highest share may be off the one found.
const TOLERANCE: f64 = 1e-7;

/// How exactly a period is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScanEffort {
    /// To a thousandth, for a start of a search.
    Rough,
    /// As what is written must keep its limits.
    Thorough,
}

/// A channel along a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelUse {
    pub channel: BoundedQuantity,
    /// Least and most of the quantity, of a torque with its 95 % band.
    pub range: [f64; 2],
    /// Share of the limit: 1 at it, above 1 beyond it; infinite where the machine cannot follow.
    pub share: f64,
    /// Time at which it comes nearest \[s\], on the clock of what was looked along.
    pub t: f64,
}

/// Channels along the whole period of a series: those that are trigonometric polynomials with a
/// certain bound, the others with one from their measured curvature.
pub fn along_period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
) -> Vec<ChannelUse> {
    period(machine, channels, series, PARTS, TOLERANCE)
}

/// [`along_period`] with bounds that lie a little higher, for searches.
pub(super) fn about_period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    care: ScanEffort,
) -> Vec<ChannelUse> {
    match care {
        ScanEffort::Thorough => period(machine, channels, series, PARTS, 1e-5),
        ScanEffort::Rough => period(machine, channels, series, 96, 1e-3),
    }
}

fn period(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    parts: usize,
    tolerance: f64,
) -> Vec<ChannelUse> {
    let (at, span) = (|t| series.at(t), [0.0, series.period()]);
    let curved = channels.iter().filter(|c| !c.quantity.is_linear());
    let curved: Vec<&BoundedQuantity> = curved.collect();
    let mut curved = of_path(machine, &curved, &at, span, parts, tolerance).into_iter();
    let of = |c: &BoundedQuantity| match c.quantity.derivative() {
        Some(order) => Some(of_polynomial(c, order, series)),
        None => curved.next(),
    };
    channels.iter().filter_map(of).collect()
}

/// Channels along any path from one time to another \[s\], in that many parts to begin with.
pub(super) fn along(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    at: &dyn Fn(f64) -> Kinematics,
    span: [f64; 2],
    parts: usize,
) -> Vec<ChannelUse> {
    let channels: Vec<&BoundedQuantity> = channels.iter().collect();
    of_path(machine, &channels, at, span, parts, TOLERANCE)
}

/// Channels along the motion from rest to rest, outside the whole periods.
pub fn along_blend(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    blend: &TimeScaling,
) -> Vec<ChannelUse> {
    let at = |t| blend.at(series, t);
    let parts = (PARTS as f64 * (blend.seconds / series.period()).max(0.25)).ceil() as usize;
    let over = |span| along(machine, channels, &at, span, parts);
    let into = over([0.0, blend.seconds]);
    if blend.periods.is_none() {
        return into;
    }
    let end = blend.duration(series.period());
    let out = over([end - blend.seconds, end]);
    joined(into, out)
}

/// Parts of a straight way to begin with.
const WAY_PARTS: usize = 512;

/// Channels along the straight way between two poses, slowly, on the clock that is 0 at the first and 1 at the other.
pub(super) fn along_way(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    from: &[f64],
    to: &Kinematics,
) -> Vec<ChannelUse> {
    let at = |share: f64| {
        let mut k = Kinematics::REST;
        for ((x, from), to) in k.x.iter_mut().zip(from).zip(to.x) {
            *x = from + share * (to - from);
        }
        k
    };
    along(machine, channels, &at, [0.0, 1.0], WAY_PARTS)
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
pub(super) fn most_broken(uses: Vec<ChannelUse>) -> Option<ChannelUse> {
    let worst = uses.into_iter().max_by(|a, b| a.share.total_cmp(&b.share));
    worst.filter(|found| found.share > 1.0)
}

/// Durations that are tried, in periods.
const DURATIONS: [f64; 10] = [0.4, 0.5, 0.64, 0.8, 1.0, 1.2, 1.6, 2.0, 3.2, 6.4];
/// Points of the period at which the motion may begin.
const STARTS: u32 = 16;

impl TimeScaling {
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
        // of the longest: the limit that the best blend breaks, and the one on the way to a blend that breaks none
        let mut last = (None, None);
        for duration in DURATIONS {
            let tried = (0..STARTS).map(|k| {
                let blend = Self {
                    start: period * f64::from(k) / f64::from(STARTS),
                    seconds: duration * period,
                    periods: Some(periods),
                };
                (along_blend(machine, channels, series, &blend), blend)
            });
            let mut tried: Vec<(Vec<ChannelUse>, Self)> = tried.collect();
            tried.sort_by(|a, b| worst(&a.0).total_cmp(&worst(&b.0)));
            last = (most_broken(tried[0].0.clone()), None);
            for (_, blend) in tried.into_iter().filter(|(uses, _)| worst(uses) <= 1.0) {
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
            (broken, None) => ExciteError::NoBlend {
                seconds: DURATIONS[DURATIONS.len() - 1] * period,
                what: broken.as_ref().map_or_else(String::new, ChannelUse::what),
                share: broken.map_or(f64::INFINITY, |broken| broken.share),
            },
        })
    }
}

impl ChannelUse {
    /// What is bounded, and of what.
    fn what(&self) -> String {
        let ChannelUse { channel, .. } = self;
        format!(
            "{} of {}",
            channel.quantity.called(&channel.unit),
            channel.name
        )
    }

    /// The same channel along two motions.
    fn joined(self, other: Self) -> Self {
        let ([a, b], [low, high]) = (self.range, other.range);
        let range = [a.min(low), b.max(high)];
        match other.share > self.share {
            true => Self { range, ..other },
            false => Self { range, ..self },
        }
    }
}

/// The same channels along two motions.
pub(super) fn joined(one: Vec<ChannelUse>, other: Vec<ChannelUse>) -> Vec<ChannelUse> {
    let pairs = one.into_iter().zip(other);
    pairs.map(|(a, b)| a.joined(b)).collect()
}

/// The largest share of several channels, 0 where there are none.
pub fn worst(uses: &[ChannelUse]) -> f64 {
    uses.iter().fold(0.0, |most, u| most.max(u.share))
}

fn gathered(channel: &BoundedQuantity, most: FunctionPeak, least: FunctionPeak) -> ChannelUse {
    // least is the peak of the negative
    let upper = channel.used(most.bound);
    let lower = channel.used(-least.bound);
    let (share, t) = if most.value == f64::INFINITY {
        (f64::INFINITY, most.t)
    } else if least.value == f64::INFINITY {
        (f64::INFINITY, least.t)
    } else if upper > lower && channel.upper.is_finite() {
        (upper, most.t)
    } else {
        (lower, least.t)
    };
    ChannelUse {
        channel: channel.clone(),
        range: [-least.value, most.value],
        share,
        t,
    }
}

fn of_polynomial(channel: &BoundedQuantity, order: usize, series: &Series) -> ChannelUse {
    let i = channel.index;
    let curvature = Some(series.derivative_bound(i, order as i32 + 2));
    let (period, parts) = (series.period(), 8 * series.harmonics().max(1));
    let tolerance = TOLERANCE * channel.room();
    let peak = |sign: f64| {
        let mut f = |t| sign * series.one(i, t)[order];
        let at = |k: usize| period * k as f64 / parts as f64;
        let samples: Vec<f64> = (0..=parts).map(|k| f(at(k))).collect();
        highest(&mut f, [0.0, period], &samples, curvature, tolerance)
    };
    gathered(channel, peak(1.0), peak(-1.0))
}

fn of_path(
    machine: &ForeseenRobot,
    channels: &[&BoundedQuantity],
    at: &dyn Fn(f64) -> Kinematics,
    [from, to]: [f64; 2],
    parts: usize,
    tolerance: f64,
) -> Vec<ChannelUse> {
    let mut state = State::EMPTY;
    let mut grid = vec![Vec::with_capacity(parts + 1); channels.len()];
    for m in 0..=parts {
        let k = at(from + (to - from) * m as f64 / parts as f64);
        let reached = machine.fill(&k, &mut state).is_ok();
        let quantities = machine.quantities(&state);
        for (channel, values) in channels.iter().zip(&mut grid) {
            values.push(with_band(channel, &k, reached, &quantities));
        }
    }
    let mut value = |channel: &BoundedQuantity, t: f64| {
        let k = at(t);
        let reached = channel.quantity.is_linear() || machine.fill(&k, &mut state).is_ok();
        with_band(channel, &k, reached, &machine.quantities(&state))
    };
    let of = |(channel, values): (&&BoundedQuantity, Vec<(f64, f64)>)| {
        let mut peak = |sign: f64| {
            let beyond = |(value, half): (f64, f64)| sign * value + half;
            let samples: Vec<f64> = values.iter().copied().map(beyond).collect();
            let mut f = |t| beyond(value(channel, t));
            let tolerance = tolerance * channel.room();
            highest(&mut f, [from, to], &samples, None, tolerance)
        };
        gathered(channel, peak(1.0), peak(-1.0))
    };
    channels.iter().zip(grid).map(of).collect()
}

/// A channel's value and how far it may be off; not a number where the machine cannot follow.
fn with_band(
    channel: &BoundedQuantity,
    k: &Kinematics,
    reached: bool,
    quantities: &BoundQuantities,
) -> (f64, f64) {
    match channel.quantity.derivative() {
        Some(order) => ([k.x, k.xd, k.xdd][order][channel.index], 0.0),
        None if reached => (quantities.of(channel), quantities.half_width(channel)),
        None => (f64::NAN, 0.0),
    }
}
