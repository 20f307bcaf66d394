//! Faults of a position that is no longer what it was: leaps that stay, and encoders that begin anew.

use super::detectors::clock::ClockFacts;
use super::detectors::spike::SPIKE_SHARE;
use super::detectors::step::SampleLeap;
use super::draft::{FaultList, rows_text};
use super::fault::Severity::{Error, Warning};
use super::fault::{FaultEpisodes, FaultKind};
use super::judge::{ChannelTrack, LogJudge};
use super::words::ChannelRole;
use cft_ident_core::number;

/// Steps of an encoder that a leap has at least: rounding four rows makes two at most.
const MIN_LEAP_STEPS: f64 = 4.0;
/// A drive may turn its torque round from one row to the next, and reach twice its average within a row.
const DRIVE_FACTOR: f64 = 4.0;
/// What is off by so many times what nearly all rows are is no acceleration of the motion.
const EVENT_FACTOR: f64 = 3.0;
/// Leaps of several joints at one time are one event: within so many steps.
const SAME_EVENT_STEPS: f64 = 1.5;

/// Leap of a position from one row to the next that its drive could make [unit of the channel].
pub(super) fn drive(track: &ChannelTrack, clock: &ClockFacts) -> f64 {
    DRIVE_FACTOR * acceleration(track) * clock.dt * clock.dt
}

/// The largest acceleration in which no leap and no spike took part.
fn acceleration(track: &ChannelTrack) -> f64 {
    let usual = track.spikes.usual(track.deviation());
    let spikes = track.spikes.found.iter();
    let spikes = spikes.filter(|spike| spike.height.abs() > EVENT_FACTOR * usual);
    let spikes = spikes.map(|spike| spike.t);
    let leaps = track.leaps.found.iter().map(|leap| leap.at);
    let events: Vec<f64> = spikes.chain(leaps).collect();
    let motion = track.excitation.as_ref();
    motion.map_or(0.0, |motion| motion.highest_apart(&events))
}

/// The leaps that noise, encoder and drive do not account for, and the least height of one in a step of the clock.
fn unusual(track: &ChannelTrack, clock: &ClockFacts) -> (Vec<SampleLeap>, f64) {
    let grain = track.flat.steps.quantile_not_zero(0.0);
    let noise = track.leaps.unusual(track.rows).max(MIN_LEAP_STEPS * grain);
    let acceleration = acceleration(track);
    // Rows that were left out leave the drive more time.
    let least = |step: f64| noise.max(DRIVE_FACTOR * acceleration * step * step);
    let high = |leap: &&SampleLeap| leap.height.abs() > least(leap.at - leap.before);
    let found = track.leaps.found.iter().filter(high).copied();
    (found.collect(), least(clock.dt))
}

/// Reports the leaps of a position that are not reported yet, `reach` about each [s], and parts the log there.
pub(super) fn leaps(
    judge: &LogJudge,
    place: usize,
    (clock, reach, shown): (&ClockFacts, f64, &mut Vec<[f64; 2]>),
    draft: &mut FaultList,
) {
    let track = &judge.tracks[place];
    let known = |t: f64| shown.iter().any(|[from, to]| *from <= t && t <= *to);
    let (mut found, least) = unusual(track, clock);
    found.retain(|leap| !known(leap.at));
    let near = |leap: &SampleLeap| [leap.before - reach, leap.at + reach];
    shown.extend(found.iter().map(near));
    let mut episodes = FaultEpisodes::default();
    for leap in &found {
        episodes.add(leap.before, leap.at, 1, -1.0);
    }
    let heights = found.iter().map(|leap| leap.height);
    let Some(largest) = heights.max_by(|a, b| a.abs().total_cmp(&b.abs())) else {
        return;
    };
    let others = with_it(judge, place, found[0].at, clock);
    let cause = match others.as_slice() {
        [] => "the encoder slipped, its reference was set anew, or logs were joined".to_owned(),
        others => format!(
            "with {}: rows are missing there, or logs were joined",
            others.join(", ")
        ),
    };
    let unit = track.channel.unit.as_deref().unwrap_or("");
    let effect = |rows: u64, times: usize| {
        let up_to = if times > 1 { "up to " } else { "" };
        format!(
            "leaps by {up_to}{} {unit} from one row to the next, {}, and stays there; noise and drive account for {} at most: {cause}. The log is parted there; before or after it the position is off",
            number::significant(largest, 3),
            rows_text(rows, times).replace("rows", "times").replace("1 row", "once"),
            number::significant(least, 2)
        )
        .replace("  ", " ")
    };
    let first = judge.clock.first.unwrap_or(0.0);
    let remedy = &format!(
        "where its zero matters (gravity, other joints' inertias), use the part whose zero is right: LOG@0..{at:.3}s or LOG@{at:.3}..s",
        at = (found[0].at - first).max(0.0)
    );
    let fault = (Warning, FaultKind::PositionStep, Some(track));
    for added in draft.stretches(fault, &episodes, &effect, remedy) {
        added.size = Some(largest);
    }
    draft.cut(fault, &episodes);
}

/// Reports a position that leaps to and fro in so many rows that none of them is a spike among others.
pub(super) fn erratic(judge: &LogJudge, track: &ChannelTrack, draft: &mut FaultList) {
    let grain = track.flat.steps.quantile_not_zero(0.0);
    let height = (SPIKE_SHARE * track.deviation()).max(MIN_LEAP_STEPS * grain);
    let hidden = track.spikes.nearly_all() > height && track.spikes.goes_to_and_fro();
    // a joint at rest shows its noise, and no two sources
    if !hidden || !(judge.moves(track) || track.spikes.alternates()) {
        return;
    }
    let share = track.spikes.differences_seen.share_outside(0.0, height);
    let unit = track.channel.unit.as_deref().unwrap_or("");
    let effect = format!(
        "leaps to and fro: {} of the rows are off those about them by more than {} {unit}: no speed can be formed, and which rows are right cannot be seen",
        number::percent(share),
        number::significant(height, 2)
    )
    .replace(" :", ":");
    let remedy = "see whether two sources write this channel, one row each (`inspect` lists the publishers of a recording); else look at its cable and encoder, and log again";
    let fault = (Error, FaultKind::Erratic, Some(track));
    draft.of_log(fault, track.rows, effect, remedy);
    draft.acts(fault);
}

/// Where a position leaps: the times before and at it [s].
pub(super) fn places(track: &ChannelTrack, clock: &ClockFacts) -> Vec<[f64; 2]> {
    let (found, _) = unusual(track, clock);
    found.iter().map(|leap| [leap.before, leap.at]).collect()
}

/// Names of the other positions that leap at the same time.
fn with_it(judge: &LogJudge, place: usize, t: f64, clock: &ClockFacts) -> Vec<String> {
    let others = judge.positions.iter().filter(|other| **other != place);
    let leaps = |track: &ChannelTrack| {
        let (found, _) = unusual(track, clock);
        let mut at = found.iter().map(|leap| leap.at);
        at.any(|at| (at - t).abs() < SAME_EVENT_STEPS * clock.dt)
    };
    others
        .map(|other| &judge.tracks[*other])
        .filter(|track| leaps(track))
        .map(|track| format!("`{}`", crate::log::escape(&track.channel.name)))
        .collect()
}

/// Reports a position that begins anew, and whether it does.
pub(super) fn wrapped(judge: &LogJudge, place: usize, draft: &mut FaultList) -> bool {
    let track = &judge.tracks[place];
    if track.channel.role != ChannelRole::Position {
        return false;
    }
    // Ranges are usual in the unit of the column.
    let size = track.channel.factor.abs();
    let counts = (8..=32).map(|bits| f64::from(bits).exp2());
    let turns = [std::f64::consts::TAU, 360.0].into_iter();
    let in_column: Vec<f64> = turns.chain(counts).collect();
    let usual: Vec<f64> = in_column.iter().map(|range| range * size).collect();
    let step = track.flat.steps.quantile_not_zero(0.5);
    let Some(found) = track.turns.wrapped(&usual, step) else {
        return false;
    };
    let mut episodes = FaultEpisodes::default();
    episodes.add(found.from, found.to, found.times, 0.0);
    let logged = found.range / size;
    let mut ranges = in_column.iter();
    let logged = match ranges.find(|range| (*range / logged - 1.0).abs() < 1e-9) {
        Some(range) => range.to_string(),
        None => number::significant(logged, 7),
    };
    let unit = track.channel.unit.as_deref().unwrap_or("");
    let effect = format!(
        "goes through the end of its range {} time(s), and begins anew there, {} {unit} away: taken as it is, it leaps at an impossible speed. A fit follows it through its turns",
        found.times,
        number::significant(found.range, 7)
    )
    .replace(" :", ":");
    let joint = track.channel.joint.as_deref();
    let joint = joint.filter(|joint| !joint.is_empty());
    let remedy = format!(
        "write `wrap = {logged}` into [log.joint.{}] of the robot file",
        joint.map_or_else(|| "NAME".to_owned(), crate::log::escape)
    );
    let fault = (Warning, FaultKind::WrappedEncoder, Some(track));
    for added in draft.stretches(fault, &episodes, &|_, _| effect.clone(), &remedy) {
        added.size = Some(found.range);
    }
    if !draft.acts(fault) {
        return false;
    }
    draft.found.wraps.push((place, found.range));
    true
}
