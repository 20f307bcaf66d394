//! Delay between positions and torques, from the motion itself.

use super::detectors::clock::ClockFacts;
use super::detectors::windows::Window;
use super::draft::{FaultList, seconds};
use super::fault::FaultKind;
use super::fault::Severity::Warning;
use super::judge::LogJudge;
use super::words::ChannelRole;
use crate::log::DelayEstimator;

/// Stretches of the log that are looked at.
const STRETCHES: usize = 8;
/// Of them those that must tell a delay.
const LEAST: usize = 3;
/// A delay of fewer rows is none: the time of a torque is not known better than its row.
const ROWS: f64 = 2.0;
/// A shorter one is not reported without a model: what other joints do to a joint looks like one [s].
const SHORTEST: f64 = 0.01;
/// Deviations from 0 at which a delay is believed.
const SURE: f64 = 6.0;

/// What to do about a delay.
pub(super) const REMEDY: &str = "take both from one message or one cycle of the controller; in recordings of two topics `torque_delay_s` in [log] of the robot file takes a delay off";

/// Tells a delay where the stretches of the log agree in one.
pub(super) fn faults(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    // Joints that have both channels.
    let pairs: Vec<(usize, usize)> = judge
        .tracks
        .iter()
        .enumerate()
        .filter(|(_, track)| track.channel.role == ChannelRole::Torque)
        .filter_map(|(torque, track)| Some((track.position?, torque)))
        .filter(|(position, _)| judge.moves(&judge.tracks[*position]))
        .collect();
    if pairs.is_empty() {
        return;
    }
    let mut found: Vec<f64> = judge
        .windows
        .spread(STRETCHES)
        .filter_map(|window| delay(window, &pairs))
        .collect();
    if found.len() < LEAST {
        return;
    }
    found.sort_by(f64::total_cmp);
    let median = found[found.len() / 2];
    let mut off: Vec<f64> = found.iter().map(|d| (d - median).abs()).collect();
    off.sort_by(f64::total_cmp);
    // Deviation of the median of so many, by the median of their distances from it.
    let std = 1.4826 * 1.2533 * off[off.len() / 2] / (found.len() as f64).sqrt();
    if median.abs() < (ROWS * clock.dt).max(SURE * std).max(SHORTEST) {
        return;
    }
    let side = if median > 0.0 { "behind" } else { "ahead of" };
    let effect = format!(
        "torques are about {} {side} the positions, all stretches within {}: inertia and viscous friction are mixed up, the more the faster the motion",
        seconds(median.abs()),
        seconds(2.0 * std.max(0.1 * clock.dt))
    );
    draft.of_log(Warning, FaultKind::Delay, judge.clock.rows, effect, REMEDY);
}

/// The delay in one stretch [s].
fn delay(window: &Window, pairs: &[(usize, usize)]) -> Option<f64> {
    let mut delay = DelayEstimator::default();
    let (mut q, mut tau) = (Vec::new(), Vec::new());
    for (row, t) in window.t.iter().enumerate() {
        q.clear();
        tau.clear();
        for (position, torque) in pairs {
            q.push(window.columns[*position][row]);
            tau.push(window.columns[*torque][row]);
        }
        delay.add(*t, &q, &tau);
    }
    let found = delay.estimate()?;
    Some(found.delay_s)
}
