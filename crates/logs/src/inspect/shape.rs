//! Faults in the shape of one channel: flat where it should change, off where it should be smooth,
//! coarse.

use super::detectors::clock::ClockFacts;
use super::detectors::flat::FlatRun;
use super::detectors::grain;
use super::detectors::repeats::{ABRUPT_BENDS, MIN_STEPS_IN_MOTION};
use super::detectors::spike::{SPIKE, SPIKE_SHARE};
use super::draft::FaultList;
use super::fault::Severity::{Error, Info, Warning};
use super::fault::{FaultEpisodes, FaultKind};
use super::judge::{ChannelTrack, InspectionDepth, LogJudge};
use super::position;
use super::words::ChannelRole;
use crate::log::BridgedSample;

/// The numbers that decide on the shape of a channel. Grains and usual lengths are of the channel itself, so that none
/// depends on its unit.
#[derive(Debug, Clone, Copy)]
struct ShapeLimits {
    /// Rows of one value from which a channel may be stuck: fewer are a torque in counts, or a reading that came late.
    stuck_rows: u64,
    /// Such a stretch lasts so many times longer than stretches of one value usually do (their 99th percentile): a coarse
    /// or slowly read channel repeats itself too.
    stuck_lengths: f64,
    /// Rows from which the largest or smallest value of a channel may be a limit: a peak holds its value for less.
    top_rows: u64,
    /// The same for a driven joint as `stuck_lengths`, less of it: that the value is never exceeded is evidence of its own.
    top_lengths: f64,
    /// A flat stretch begins or ends abruptly where the channel steps by so many of its grains, too.
    abrupt_steps: f64,
    /// A joint has moved where it travelled so many grains of its position ..
    moved_grains: f64,
    /// .. and this share of its travel in the log.
    moved_share: f64,
    /// Grains of its whole travel from which a joint moves at all.
    moving_grains: f64,
    /// Rows about a fault that is reported already in which no other is looked for: those that filters and differences
    /// smear it over.
    reach_rows: f64,
    /// Spikes so many rows apart are one episode.
    spike_rows: f64,
    /// Flat stretches apart by so many times their length are one episode: noise about a limit breaks a flat top into many.
    apart_lengths: f64,
    /// Levels over its range from which a channel's grain is not worth a word.
    fine_levels: f64,
    /// Acceleration noise by the grain of a position, over the acceleration, that spoils a fit.
    coarse_acceleration_share: f64,
    /// Grain of a torque over its deviation that spoils a fit.
    coarse_torque_share: f64,
}

const LIMITS: ShapeLimits = ShapeLimits {
    stuck_rows: 10,
    stuck_lengths: 5.0,
    top_rows: 5,
    top_lengths: 3.0,
    abrupt_steps: 4.0,
    moved_grains: 10.0,
    moved_share: 0.002,
    moving_grains: 30.0,
    reach_rows: 5.5,
    spike_rows: 3.5,
    apart_lengths: 3.0,
    fine_levels: 4096.0,
    coarse_acceleration_share: 0.1,
    coarse_torque_share: 0.1,
};

pub(super) fn faults(judge: &LogJudge, place: usize, clock: &ClockFacts, draft: &mut FaultList) {
    let track = &judge.tracks[place];
    if track.channel.role == ChannelRole::Temperature {
        return heat(track, draft);
    }
    if track.rows == 0 || !track.channel.role.has_shape() {
        return;
    }
    if track.travel() == 0.0 {
        return constant(judge, track, draft);
    }
    if position::wrapped(judge, place, draft) {
        // Its shape is seen once it is followed through its turns.
        return;
    }
    let mut flat = ChannelFlatness::of(judge, track, clock);
    flat.tops();
    flat.stuck();
    let stalled =
        |run: &FlatRun| draft.stalled(run.from, clock.dt) && draft.stalled(run.to, clock.dt);
    flat.tops.retain(|run| !stalled(run));
    flat.stuck.retain(|run| !stalled(run));
    flat.off(place, draft);
    flat.report(draft);
    // Where a channel leaps out of a flat stretch it is reported already.
    let reach = LIMITS.reach_rows * clock.dt;
    let runs = flat.tops.iter().chain(&flat.stuck);
    let runs = runs.map(|run| [run.from, run.to]);
    let known = runs.chain(draft.stalls.iter().copied());
    let mut shown: Vec<[f64; 2]> = known.map(|[from, to]| [from - reach, to + reach]).collect();
    if track.channel.role == ChannelRole::Position {
        position::leaps(judge, place, (clock, reach, &mut shown), draft);
        position::erratic(judge, track, draft);
    }
    spikes(judge, place, (clock, &shown), draft);
    if judge.depth == InspectionDepth::Whole {
        coarse(judge, place, clock, draft);
    }
}

fn heat(track: &ChannelTrack, draft: &mut FaultList) {
    if track.rows > 0 && track.travel() == 0.0 {
        let effect = format!(
            "{} in all {} rows: nothing can be seen to depend on it",
            track.low, track.rows
        );
        let remedy = "check the sensor; log from a cold start on, or over a pause";
        draft.whole(Warning, FaultKind::StuckChannel, track, effect, remedy);
    }
    let highest = track.highest;
    let effect = |_: u64, times: usize| {
        let times = if times > 1 { "leaps" } else { "leap" };
        format!("{times} of up to {highest:.1} degC from row to row: no drive warms up so fast")
    };
    let remedy = "check the sensor and its wiring, and whether logs were joined there";
    let fault = (Warning, FaultKind::TemperatureStep, Some(track));
    draft.stretches(fault, &track.leaps_of_heat, &effect, remedy);
}

fn constant(judge: &LogJudge, track: &ChannelTrack, draft: &mut FaultList) {
    let joint_moves = track.position.is_some_and(|index| {
        let position = &judge.tracks[index];
        let step = position.flat.steps.quantile_not_zero(0.05);
        position.travel() > LIMITS.moving_grains * step && position.travel() > 0.0
    });
    let mut positions = judge.positions.iter();
    let all_rest = positions.all(|index| judge.tracks[*index].travel() == 0.0);
    let (severity, then, remedy) = match track.channel.role {
        role @ (ChannelRole::Torque | ChannelRole::Velocity) if joint_moves => (
            if role == ChannelRole::Torque {
                Error
            } else {
                Warning
            },
            " although the joint moves: nothing can be fitted to it",
            "check the sensor and the recorder, or name the right column in the [log] section of the robot file",
        ),
        ChannelRole::Position if all_rest => (
            Warning,
            ", and no other joint moves: a log at rest determines nothing",
            "check the encoder and the recorder; log a motion",
        ),
        ChannelRole::Position => (
            Info,
            ": either the joint is held, or its channel is dead",
            "nothing, if this joint is not to move in this log",
        ),
        _ => return,
    };
    let effect = format!("{} in all {} rows{then}", track.low, track.rows);
    draft.whole(severity, FaultKind::StuckChannel, track, effect, remedy);
}

/// What is flat in a channel.
struct ChannelFlatness<'a> {
    track: &'a ChannelTrack,
    /// An edge with a larger step is abrupt.
    abrupt: f64,
    /// A joint moves where its steps are larger.
    slow: f64,
    /// Leaps of a position that stay: times before and at them [s].
    leaps: Vec<[f64; 2]>,
    /// Rows of one value that are usual.
    usual: f64,
    /// A joint has moved where it travelled further.
    moved: f64,
    tops: Vec<FlatRun>,
    stuck: Vec<FlatRun>,
}

impl<'a> ChannelFlatness<'a> {
    fn of(judge: &LogJudge, track: &'a ChannelTrack, clock: &ClockFacts) -> Self {
        let flat = &track.flat;
        let bends = flat.bends.quantile_not_zero(0.99);
        let grain = flat.steps.quantile_not_zero(0.05);
        let moved = track.position.map_or(f64::INFINITY, |index| {
            let position = &judge.tracks[index];
            let grain = position.flat.steps.quantile_not_zero(0.05);
            (LIMITS.moved_grains * grain).max(LIMITS.moved_share * position.travel())
        });
        Self {
            track,
            abrupt: (ABRUPT_BENDS * bends).max(LIMITS.abrupt_steps * grain),
            slow: MIN_STEPS_IN_MOTION * grain,
            leaps: match track.channel.role {
                ChannelRole::Position => position::places(track, clock),
                _ => Vec::new(),
            },
            usual: flat.lengths.quantile(0.99),
            moved,
            tops: Vec::new(),
            stuck: Vec::new(),
        }
    }

    fn is_abrupt(&self, run: &FlatRun) -> bool {
        // A joint at rest whose encoder slips leaps, and is not stuck: it is where it moves on the other side.
        let leaps = |edge: &dyn Fn(&[f64; 2]) -> bool| self.leaps.iter().any(edge);
        let entered = !leaps(&|[_, at]| *at == run.from) || run.exit.abs() > self.slow;
        let left = !leaps(&|[before, _]| *before == run.to) || run.entry.abs() > self.slow;
        (run.entry.abs() > self.abrupt && entered) || (run.exit.abs() > self.abrupt && left)
    }

    /// Runs at a value that the channel does not exceed.
    fn tops(&mut self) {
        let flat = &self.track.flat;
        for (levels, sign) in [(&flat.top, 1.0), (&flat.bottom, -1.0)] {
            let value = sign * levels.extreme();
            if !levels.piles_up() {
                continue;
            }
            let runs = flat.runs.iter().filter(|run| run.value == value);
            let runs: Vec<FlatRun> = runs.copied().collect();
            let position = self.track.channel.role == ChannelRole::Position;
            let longest = runs.iter().map(|run| run.rows).max().unwrap_or(0);
            // A torque that meets a limit does so while its joint is driven; positions and
            // velocities also rest where they are largest, but do not get there at once.
            let real = runs.iter().any(|run| {
                let driven = !position && run.travel > self.moved;
                self.is_abrupt(run)
                    || (driven && run.rows as f64 >= LIMITS.top_lengths * self.usual)
            });
            if longest >= LIMITS.top_rows && real {
                self.tops.extend(runs);
            }
        }
    }

    /// Runs at any other value.
    fn stuck(&mut self) {
        let position = self.track.channel.role == ChannelRole::Position;
        for run in &self.track.flat.runs {
            let rows = run.rows as f64;
            let least = LIMITS.stuck_lengths * self.usual.min(LIMITS.stuck_rows as f64);
            let long = run.rows >= LIMITS.stuck_rows && rows >= least;
            if !long || self.tops.iter().any(|top| top.is(run)) {
                continue;
            }
            let meanwhile =
                !position && run.travel > self.moved && rows >= LIMITS.stuck_lengths * self.usual;
            if meanwhile || (self.is_abrupt(run) && (position || run.travel > self.moved)) {
                self.stuck.push(*run);
            }
        }
    }

    /// Takes out the runs in which a torque is exactly 0: a motor is off or a channel dead, which the motion shows.
    fn off(&mut self, place: usize, draft: &mut FaultList) {
        if self.track.channel.role != ChannelRole::Torque {
            return;
        }
        let mut episodes = FaultEpisodes::default();
        let mut runs: Vec<FlatRun> = self.tops.iter().chain(&self.stuck).copied().collect();
        runs.retain(|run| run.value == 0.0 && run.rows >= LIMITS.stuck_rows);
        runs.sort_by(|a, b| a.from.total_cmp(&b.from));
        runs.dedup_by(|a, b| a.is(b));
        for run in &runs {
            episodes.add(run.from, run.to, run.rows, 0.0);
            draft.found.off.push((place, [run.from, run.to]));
        }
        self.tops.retain(|run| !runs.iter().any(|off| off.is(run)));
        self.stuck.retain(|run| !runs.iter().any(|off| off.is(run)));
        let effect = "of exactly 0 while the joint moves: data of a motor that is switched off, if the joint moves as the robot does without it; a fit finds out, and leaves the rows out if not";
        let remedy = "nothing where the motor was off; else check cable, sensor and recorder of this channel";
        let fault = (Info, FaultKind::MotorOff, Some(self.track));
        draft.rows(fault, &episodes, effect, remedy);
    }

    fn report(&self, draft: &mut FaultList) {
        let track = self.track;
        let role = track.channel.role;
        let used = role.is_fitted();
        let severity = if used { Warning } else { Info };
        let gathered = |runs: &[FlatRun]| {
            let mut episodes = FaultEpisodes::default();
            for run in runs {
                // Noise about the limit breaks a flat top into many.
                episodes.add(
                    run.from,
                    run.to,
                    run.rows,
                    LIMITS.apart_lengths * (run.to - run.from),
                );
            }
            episodes
        };
        // What an amplifier gave at its limit is what acted.
        let applied = track.channel.saturates;
        let then = match applied {
            true => {
                "the amplifier gives no more; as what is logged is what was applied, a fit may use it"
            }
            false if used => "the true values are beyond, so that these rows are left out of a fit",
            false => "the true values are beyond; a fit does not read this channel",
        };
        let effect = format!(
            "flat at {} or {}, which is never exceeded: {then}",
            track.low, track.high
        );
        let remedy = match applied {
            true => "choose a slower motion where the robot should follow its reference",
            false => "choose a slower motion or a wider measuring range",
        };
        let kind = match role {
            ChannelRole::Torque => FaultKind::Saturation,
            _ => FaultKind::Clipping,
        };
        let tops = gathered(&self.tops);
        let of_tops = (if applied { Info } else { severity }, kind, Some(track));
        // Reported as reaching the limit of the robot file where that is known.
        if track.at_limit.list.is_empty() {
            draft.rows(of_tops, &tops, &effect, remedy);
        }
        let then = match used {
            true => "these rows are left out of a fit",
            false => "a fit does not read this channel",
        };
        let longest = self.stuck.iter().map(|run| run.rows).max().unwrap_or(0);
        let effect = format!(
            "of one value for up to {longest} rows while the joint moves, usually for {}: {then}",
            self.usual.ceil()
        );
        let remedy =
            "check cable, sensor and recorder of this channel; record again if much is lost";
        let stuck = gathered(&self.stuck);
        let of_stuck = (severity, FaultKind::StuckChannel, Some(track));
        draft.rows(of_stuck, &stuck, &effect, remedy);
        if used {
            if !applied {
                draft.cut(of_tops, &tops);
            }
            draft.cut(of_stuck, &stuck);
        }
    }
}

fn spikes(
    judge: &LogJudge,
    place: usize,
    (clock, shown): (&ClockFacts, &[[f64; 2]]),
    draft: &mut FaultList,
) {
    let track = &judge.tracks[place];
    // whose joint's motion is known, pulses of a command are no spikes; of other channels nothing distinguishes them
    let known = track.channel.role == ChannelRole::Position || track.position.is_some();
    let usual = match known {
        true => track.spikes.usual(track.deviation()),
        false => track.spikes.nearly_all(),
    };
    let grain = track.flat.steps.quantile_not_zero(0.05);
    let of_motion = match track.channel.role {
        // A row that is off makes twice its height of the second difference.
        ChannelRole::Position => 0.5 * position::drive(track, clock),
        _ => SPIKE_SHARE * track.deviation(),
    };
    let least = (SPIKE * usual)
        .max(LIMITS.abrupt_steps * grain)
        .max(of_motion);
    let shown = |t: f64| shown.iter().any(|[from, to]| *from <= t && t <= *to);
    let mut high: Vec<_> = track.spikes.found.iter().collect();
    high.retain(|spike| spike.height.abs() > least && !shown(spike.t));
    let mut episodes = FaultEpisodes::default();
    let mut highest = 0.0f64;
    for spike in &high {
        episodes.add(spike.t, spike.t, 1, LIMITS.spike_rows * clock.dt);
        highest = highest.max(spike.height.abs());
    }
    if high.is_empty() {
        return;
    }
    let used = track.channel.role.is_fitted();
    let (severity, then) = match used {
        true => (
            Warning,
            "differentiated or squared they outweigh thousands of good rows; a fit bridges them by their neighbours",
        ),
        false => (Info, "a fit does not read this channel"),
    };
    let effect = format!("off the rows about by up to {highest:.3e}: {then}");
    let remedy = "look for a loose cable, a lost bus message or a counter that overflows";
    let fault = (severity, FaultKind::Spike, Some(track));
    draft.rows(fault, &episodes, &effect, remedy);
    if used && draft.acts(fault) {
        let bad = |t: f64| high.iter().any(|spike| spike.t == t);
        for spike in &high {
            match spike.bridge(&bad) {
                Some(value) => draft.found.bridges.push(BridgedSample {
                    t: spike.t,
                    channel: place,
                    value,
                }),
                None => draft.cuts.push(([spike.t; 2], FaultKind::Spike)),
            }
        }
    }
}

fn coarse(judge: &LogJudge, place: usize, clock: &ClockFacts, draft: &mut FaultList) {
    let track = &judge.tracks[place];
    let Some(step) = grain::step(&judge.windows.kept, place) else {
        return;
    };
    let levels = track.travel() / step;
    // A stationary joint shows a few counts, which is no fault.
    if levels < LIMITS.moving_grains && track.channel.role != ChannelRole::Torque {
        return;
    }
    if track.channel.role == ChannelRole::Position && !judge.moves(track) {
        return;
    }
    let remedy =
        "use a finer sensor or more digits; lower the cut-off in [filter] of the robot file";
    let spoils = match (track.channel.role, &track.excitation) {
        (ChannelRole::Position, Some(excitation)) => {
            // White noise of step^2/12, differentiated twice, up to the cut-off.
            let band = judge.band_hz;
            let w = std::f64::consts::TAU * band;
            let noise = step * (clock.dt * band / 30.0).sqrt() * w * w;
            let share = noise / excitation.rms(0);
            (share > LIMITS.coarse_acceleration_share).then(|| {
                format!(
                    "steps of {step:.3e}: below {band} Hz they make {:.0} % noise on the acceleration, which biases inertias towards 0",
                    100.0 * share
                )
            })
        }
        (ChannelRole::Torque, _) if step > LIMITS.coarse_torque_share * track.deviation() => {
            Some(format!(
                "steps of {step:.3e}, {:.0} % of the channel's deviation: small parameters cannot be identified from it",
                100.0 * step / track.deviation()
            ))
        }
        _ => None,
    };
    let (severity, effect) = match spoils {
        Some(effect) => (Warning, effect),
        None if levels >= LIMITS.fine_levels => return,
        None => (
            Info,
            format!(
                "steps of {step:.3e}, {levels:.0} levels over the range: a fit averages them out"
            ),
        ),
    };
    draft.whole(severity, FaultKind::Quantisation, track, effect, remedy);
}
