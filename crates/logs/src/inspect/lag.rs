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
/// Deviations from 0 at which a delay is believed.
const MIN_DEVIATIONS: f64 = 6.0;

/// What to do about a delay.
pub(super) const REMEDY: &str = "take both from one message or one cycle of the controller; in recordings of two topics `torque_delay_s` in [log] of the robot file takes a delay off";

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
    let Some(DelayEstimate { delay_s, std_s }) = delay(judge, &pairs) else {
        return;
    };
    let least = (MIN_DELAY_ROWS * clock.dt).max(MIN_DEVIATIONS * std_s);
    if delay_s.abs() < least.max(MIN_DELAY_S) {
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

fn delay(judge: &LogJudge, pairs: &[(usize, usize)]) -> Option<DelayEstimate> {
    let mut delay = DelayEstimator::default();
    let (mut q, mut tau) = (Vec::new(), Vec::new());
    for window in judge.windows.spread(MAX_STRETCHES) {
        delay.begin_stretch();
        for (row, t) in window.t.iter().enumerate() {
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
