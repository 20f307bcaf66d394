//! A motion that breaks limits, moved and scaled down until it keeps all of them.

use super::limits::{BoundedQuantity, Quantity};
use super::machine::ForeseenRobot;
use super::series::Series;
use super::usage::{ScanEffort, about_period, along_period, worst};

/// Steps towards the common factor, and how near to it they end.
const MAX_STEPS: usize = 40;
const FACTOR_TOLERANCE: f64 = 2e-5;
/// How near a rough look brings a thorough one to it.
const ROUGH_TOLERANCE: f64 = 2e-3;
/// What is left to rounding.
const ROUNDING: f64 = 1e-12;

/// The series brought inside the channels, by way of the middle of the limits where it cannot even rest at its offsets.
pub(super) fn repaired(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    fixed: &[Option<f64>],
    care: ScanEffort,
) -> Option<Series> {
    fitted(machine, channels, series, fixed, care).or_else(|| {
        let mut centred = series.clone();
        for channel in channels.iter().filter(|c| c.quantity == Quantity::Position) {
            if fixed[channel.index].is_none() {
                centred.offset[channel.index] = channel.middle();
            }
        }
        let fixed: Vec<Option<f64>> = centred.offset.iter().copied().map(Some).collect();
        fitted(machine, channels, &centred, &fixed, care)
    })
}

/// Each coordinate scaled and moved to its own limits, then all to torques and volts; `None` where rest breaks a limit.
fn fitted(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    fixed: &[Option<f64>],
    care: ScanEffort,
) -> Option<Series> {
    let mut series = series.clone();
    let (linear, curved): (Vec<_>, Vec<_>) =
        (channels.iter().cloned()).partition(|c| c.quantity.is_linear());
    let (positions, others): (Vec<_>, Vec<_>) =
        (linear.iter()).partition(|c| c.quantity == Quantity::Position);
    for channel in positions {
        into_span(machine, channel, &mut series, fixed)?;
    }
    for channel in others {
        let share = along_period(machine, std::slice::from_ref(channel), &series)[0].share;
        if share > 1.0 {
            series.scale(channel.index, (1.0 - ROUNDING) / share);
        }
    }
    let share = |care: ScanEffort, factor: f64| {
        let scaled = series.scaled(factor);
        worst(&about_period(machine, &curved, &scaled, care))
    };
    let mut broken = (1.0, share(care, 1.0));
    if broken.1 <= 1.0 {
        return Some(series);
    }
    let mut kept = (0.0, share(care, 0.0));
    if kept.1 > 1.0 {
        return None;
    }
    if care == ScanEffort::Thorough {
        let roughly = |factor| share(ScanEffort::Rough, factor);
        let about = narrowed(&roughly, kept, broken, ROUGH_TOLERANCE).0;
        for tried in [1.0 - ROUGH_TOLERANCE, 1.0 + ROUGH_TOLERANCE].map(|x| about * x) {
            if kept.0 < tried && tried < broken.0 {
                let at = (tried, share(care, tried));
                let end = if at.1 <= 1.0 { &mut kept } else { &mut broken };
                *end = at;
            }
        }
    }
    let closely = |factor| share(care, factor);
    let kept = narrowed(&closely, kept, broken, FACTOR_TOLERANCE);
    Some(series.scaled(kept.0))
}

/// The largest factor whose share is 1 at most, but for `near`, between one that keeps that and one that does not.
fn narrowed(
    share: &dyn Fn(f64) -> f64,
    mut kept: (f64, f64),
    mut broken: (f64, f64),
    near: f64,
) -> (f64, f64) {
    for step in 0..MAX_STEPS {
        if broken.0 - kept.0 < near || kept.1 > 1.0 - near {
            break;
        }
        // shares grow about linearly; a step that would hardly move either end halves instead
        let room = broken.0 - kept.0;
        let tried = match broken.1.is_finite() && step % 3 != 2 {
            true => kept.0 + room * (1.0 - kept.1) / (broken.1 - kept.1) - 0.5 * near,
            false => kept.0 + 0.5 * room,
        };
        let tried = tried.clamp(kept.0 + 0.1 * near, broken.0 - 0.1 * near);
        let found = (tried, share(tried));
        let end = if found.1 <= 1.0 {
            &mut kept
        } else {
            &mut broken
        };
        *end = found;
    }
    kept
}

/// One coordinate scaled and moved into its positions.
fn into_span(
    machine: &ForeseenRobot,
    channel: &BoundedQuantity,
    series: &mut Series,
    fixed: &[Option<f64>],
) -> Option<()> {
    let i = channel.index;
    let range = |series: &Series| {
        let found = along_period(machine, std::slice::from_ref(channel), series);
        let [low, high] = found[0].range;
        // the search stops within a tolerance of the true extremes
        let beyond = 2e-7 * channel.room();
        [low - beyond, high + beyond]
    };
    let offset = series.offset[i];
    let [low, high] = range(series);
    if fixed[i].is_some() {
        if !(channel.lower..=channel.upper).contains(&offset) {
            return None;
        }
        let above = (channel.upper - offset) / (high - offset).max(f64::MIN_POSITIVE);
        let below = (offset - channel.lower) / (offset - low).max(f64::MIN_POSITIVE);
        let factor = above.min(below);
        if factor < 1.0 {
            series.scale(i, factor * (1.0 - ROUNDING));
        }
        return Some(());
    }
    let factor = (channel.upper - channel.lower) / (high - low);
    let mut reach = [low - offset, high - offset];
    if factor < 1.0 {
        let factor = factor * (1.0 - ROUNDING);
        series.scale(i, factor);
        reach = reach.map(|r| factor * r);
    }
    let least = channel.lower - reach[0];
    let most = channel.upper - reach[1];
    series.offset[i] = match least <= most {
        true => offset.clamp(least, most),
        false => 0.5 * (least + most),
    };
    Some(())
}
