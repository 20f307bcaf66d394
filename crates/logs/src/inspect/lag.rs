//! Delay between positions and torques, from the motion itself.

use super::detectors::clock::ClockFacts;
use super::draft::{FaultList, seconds};
use super::fault::{FaultKind, Severity::Warning};
use super::judge::LogJudge;
use super::words::ChannelRole;
use crate::log::{DelayEstimate, DelayEstimator};

/// Stretches of the log that are looked at.
const MAX_STRETCHES: usize = 8;
/// A delay of fewer rows is none: the time of a torque is not known better than its row.
pub(super) const MIN_DELAY_ROWS: f64 = 2.0;
/// A shorter one is not reported without a model: what other joints do to a joint looks like one [s].
const MIN_DELAY_S: f64 = 0.01;
/// Share of a delay within which another estimate is the same.
const SAME_DELAY_SHARE: f64 = 0.2;
/// The same for one that is not known better than that: so many of its own standard deviations off, up to this share.
const SAME_DELAY_DEVIATIONS: f64 = 2.0;
const MAX_SAME_DELAY_SHARE: f64 = 1.0 / 3.0;
/// Deviations from 0 at which a delay is believed.
const MIN_DEVIATIONS: f64 = 6.0;

/// What to do about a delay.
pub(super) const REMEDY: &str = "take both from one message or one cycle of the controller; `torque_delay_s` in [log] of the robot file takes a delay off";

/// A warning where the stretches of the log agree in a delay.
pub(super) fn faults(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    // Joints that have both channels.
    let pairs: Vec<(usize, usize)> = (judge.tracks.iter().enumerate())
        .filter(|(_, track)| track.channel.role == ChannelRole::Torque)
        .filter_map(|(torque, track)| Some((track.position?, torque)))
        .filter(|(position, _)| judge.moves(&judge.tracks[*position]))
        .collect();
    if pairs.is_empty() {
        return;
    }
    let Some(DelayEstimate { delay_s, std_s }) = delay(judge, &pairs, |_| true) else {
        return;
    };
    let least = (MIN_DELAY_ROWS * clock.dt).max(MIN_DEVIATIONS * std_s);
    if delay_s.abs() < least.max(MIN_DELAY_S) {
        return;
    }
    if !is_borne_out(judge, &pairs, delay_s, clock.dt) {
        return;
    }
    let side = if delay_s > 0.0 { "behind" } else { "ahead of" };
    let effect = format!(
        "torques are about {} {side} the positions, within {} (95 % CI): inertia and viscous friction are mixed up, the more the faster the motion",
        seconds(delay_s.abs()),
        seconds(2.0 * std_s.max(0.1 * clock.dt))
    );
    let fault = (Warning, FaultKind::Delay, None);
    draft.of_log(fault, judge.clock.rows, effect, REMEDY);
}

/// Whether halves of the log, and most joints by themselves, show the same delay: couplings between joints and
/// ripple make others of each.
fn is_borne_out(judge: &LogJudge, pairs: &[(usize, usize)], delay_s: f64, dt: f64) -> bool {
    let same = |found: DelayEstimate| {
        let of_delay = |share: f64| share * delay_s.abs();
        let unsure = (SAME_DELAY_DEVIATIONS * found.std_s).min(of_delay(MAX_SAME_DELAY_SHARE));
        let within = (MIN_DELAY_ROWS * dt).max(of_delay(SAME_DELAY_SHARE));
        (found.delay_s - delay_s).abs() < within.max(unsure)
    };
    let halves = [0, 1].map(|half| delay(judge, pairs, |k| k % 2 == half));
    let joints = pairs
        .iter()
        .filter(|pair| delay(judge, &[**pair], |_| true).is_some_and(same));
    halves.into_iter().all(|found| found.is_some_and(same)) && 2 * joints.count() > pairs.len()
}

fn delay(
    judge: &LogJudge,
    pairs: &[(usize, usize)],
    takes: impl Fn(usize) -> bool,
) -> Option<DelayEstimate> {
    let mut delay = DelayEstimator::default();
    let (mut q, mut tau) = (Vec::new(), Vec::new());
    for (k, window) in judge.windows.spread(MAX_STRETCHES).enumerate() {
        let half = |row: usize| 2 * k + usize::from(2 * row >= window.t.len());
        delay.begin_stretch();
        for (row, t) in window
            .t
            .iter()
            .enumerate()
            .filter(|(row, _)| takes(half(*row)))
        {
            q.clear();
            tau.clear();
            for (position, torque) in pairs {
                q.push(window.columns[*position][row]);
                tau.push(window.columns[*torque][row]);
            }
            delay.add(*t, &q, &tau);
        }
    }
    delay.estimate()
}
