//! A motion that breaks limits, moved and scaled down until it keeps all of them.

use super::limits::{BoundedQuantity, Quantity};
use super::machine::ForeseenRobot;
use super::series::Series;
use super::usage::{along_period, closely_along_period, roughly_along_period, worst};

/// Steps towards the common factor, and how near to it they end.
const MAX_STEPS: usize = 40;
const FACTOR_TOLERANCE: f64 = 2e-5;
/// How near a rough look brings a thorough one to it.
const ROUGH_TOLERANCE: f64 = 2e-3;
/// What is left to rounding.
const ROUNDING: f64 = 1e-12;

/// How exactly torques and volts are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Care {
    /// To a thousandth, for a start of a search.
    Rough,
    /// As what is written must keep them.
    Thorough,
}

/// The series brought inside the channels: each coordinate is scaled about its offset as far as
/// its own limits ask for, its offset is moved where it may be (`fixed` is none) and that saves
/// amplitude, and at last all coordinates together are scaled until torques and volts fit. Where
/// they do not fit even at rest, the offsets are moved to the middle of their limits first.
///
/// `None` where standing still breaks a limit there too.
pub(super) fn repaired(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    fixed: &[Option<f64>],
    care: Care,
) -> Option<Series> {
    fitted(machine, channels, series, fixed, care).or_else(|| {
        let mut centred = series.clone();
        for channel in channels.iter().filter(|c| c.quantity == Quantity::Position) {
            if fixed[channel.index].is_none() {
                centred.offset[channel.index] = 0.5 * (channel.lower + channel.upper);
            }
        }
        let fixed: Vec<Option<f64>> = centred.offset.iter().copied().map(Some).collect();
        fitted(machine, channels, &centred, &fixed, care)
    })
}

fn fitted(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    series: &Series,
    fixed: &[Option<f64>],
    care: Care,
) -> Option<Series> {
    let mut series = series.clone();
    let (linear, curved): (Vec<BoundedQuantity>, Vec<BoundedQuantity>) = channels
        .iter()
        .cloned()
        .partition(|c| c.quantity.is_linear());
    for channel in linear.iter().filter(|c| c.quantity == Quantity::Position) {
        into_span(machine, channel, &mut series, fixed)?;
    }
    for channel in linear.iter().filter(|c| c.quantity != Quantity::Position) {
        let share = along_period(machine, std::slice::from_ref(channel), &series)[0].share;
        if share > 1.0 {
            series.scale(channel.index, (1.0 - ROUNDING) / share);
        }
    }
    let share = |care: Care, factor: f64| {
        let scaled = series.scaled(factor);
        worst(&match care {
            Care::Thorough => closely_along_period(machine, &curved, &scaled),
            Care::Rough => roughly_along_period(machine, &curved, &scaled),
        })
    };
    let mut broken = (1.0, share(care, 1.0));
    if broken.1 <= 1.0 {
        return Some(series);
    }
    let mut kept = (0.0, share(care, 0.0));
    if kept.1 > 1.0 {
        return None;
    }
    if care == Care::Thorough {
        let roughly = |factor| share(Care::Rough, factor);
        let about = narrowed(&roughly, kept, broken, ROUGH_TOLERANCE).0;
        for tried in [
            about * (1.0 - ROUGH_TOLERANCE),
            about * (1.0 + ROUGH_TOLERANCE),
        ] {
            if kept.0 < tried && tried < broken.0 {
                let at = (tried, share(care, tried));
                *(if at.1 <= 1.0 { &mut kept } else { &mut broken }) = at;
            }
        }
    }
    let kept = narrowed(
        &|factor| share(care, factor),
        kept,
        broken,
        FACTOR_TOLERANCE,
    );
    Some(series.scaled(kept.0))
}

/// The largest factor whose share is 1 at most, but for `near`, between two of which the first keeps
/// that and the second does not; each with its share.
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
        *(if found.1 <= 1.0 {
            &mut kept
        } else {
            &mut broken
        }) = found;
    }
    kept
}

fn into_span(
    machine: &ForeseenRobot,
    channel: &BoundedQuantity,
    series: &mut Series,
    fixed: &[Option<f64>],
) -> Option<()> {
    let i = channel.index;
    let range = |series: &Series| {
        let found = along_period(machine, std::slice::from_ref(channel), series);
        let half = 0.5 * (channel.upper - channel.lower);
        let [low, high] = found[0].range;
        // the search stops within a tolerance of the true extremes
        [low - 2e-7 * half, high + 2e-7 * half]
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
    series.offset[i] = if least <= most {
        offset.clamp(least, most)
    } else {
        0.5 * (least + most)
    };
    Some(())
}
