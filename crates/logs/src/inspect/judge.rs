//! Runs every detector over the rows of a log, and gathers what they know at the end.

use super::channel::InspectedChannel;
use super::detectors::clock::{LogClock, RowStep, mean_step, typical_step};
use super::detectors::copies::CopyDetector;
use super::detectors::dips::ZeroDips;
use super::detectors::excitation::Excitation;
use super::detectors::failed::FailedReads;
use super::detectors::flat::FlatDetector;
use super::detectors::repeats::RepeatDetector;
use super::detectors::replays::ReplayDetector;
use super::detectors::sampling::SamplingTimes;
use super::detectors::spike::SpikeDetector;
use super::detectors::step::{FreshRows, LeapDetector, RowFreshness};
use super::detectors::turn::TurnDetector;
use super::detectors::windows::WindowSampler;
use super::detectors::word_leaps::WordLeaps;
use super::fault::{FaultEpisodes, FaultKind};
use super::words::ChannelRole;
use crate::log::RowFault;

/// A joint moves where it travels further than this share of what the farthest joint does.
const MIN_TRAVEL_SHARE: f64 = 0.02;

/// Band in which noise is counted where none is declared \[Hz\].
const NOISE_BAND_HZ: f64 = 20.0;
/// Channels whose shape is looked at; of more only the numbers are.
const SHAPED: usize = 512;
const COMPARED: usize = 64;

/// What no drive warms up by within so short a time: 5 degC, 1 s.
const TEMPERATURE_LEAP_DEGC: f64 = 5.0;
const TEMPERATURE_LEAP_S: f64 = 1.0;

/// How much is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InspectionDepth {
    /// What a fit must know before it begins: errors, and rows to leave out.
    Gate,
    /// Everything.
    Whole,
}

/// One channel's detectors.
#[derive(Debug, Clone)]
pub(super) struct ChannelTrack {
    pub(super) channel: InspectedChannel,
    /// Rows with a number.
    pub(super) rows: u64,
    pub(super) low: f64,
    pub(super) high: f64,
    mean: f64,
    scatter: f64,
    pub(super) missing: FaultEpisodes,
    pub(super) beyond: FaultEpisodes,
    pub(super) at_limit: FaultEpisodes,
    /// Rows of a torque that the drive does not deliver.
    pub(super) undelivered: FaultEpisodes,
    pub(super) flat: FlatDetector,
    pub(super) spikes: SpikeDetector,
    pub(super) leaps: LeapDetector,
    pub(super) turns: TurnDetector,
    pub(super) dips: ZeroDips,
    pub(super) leaps_of_words: WordLeaps,
    pub(super) excitation: Option<Excitation>,
    /// The channel with the position of the same joint.
    pub(super) position: Option<usize>,
    /// Its number in the row before, and where it is a temperature the time of that row.
    latest: f64,
    before: f64,
    /// Leaps of a temperature, and the highest of them.
    pub(super) leaps_of_heat: FaultEpisodes,
    pub(super) highest: f64,
    /// Whether its shape is looked at, or only its numbers.
    shaped: bool,
}

impl ChannelTrack {
    fn new(channel: InspectedChannel, position: Option<usize>) -> Self {
        Self {
            shaped: channel.role.has_shape(),
            channel,
            rows: 0,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            mean: 0.0,
            scatter: 0.0,
            missing: FaultEpisodes::default(),
            beyond: FaultEpisodes::default(),
            at_limit: FaultEpisodes::default(),
            undelivered: FaultEpisodes::default(),
            flat: FlatDetector::default(),
            spikes: SpikeDetector::default(),
            leaps: LeapDetector::default(),
            turns: TurnDetector::default(),
            dips: ZeroDips::default(),
            leaps_of_words: WordLeaps::default(),
            excitation: None,
            position,
            latest: f64::NAN,
            before: f64::NAN,
            leaps_of_heat: FaultEpisodes::default(),
            highest: 0.0,
        }
    }

    /// Largest less smallest number; 0 where there is none.
    pub(super) fn travel(&self) -> f64 {
        (self.high - self.low).max(0.0)
    }

    /// Standard deviation of its numbers.
    pub(super) fn deviation(&self) -> f64 {
        (self.scatter / self.rows.max(1) as f64).sqrt()
    }

    pub(super) fn part(&mut self) {
        self.flat.part();
        self.spikes.part();
        self.leaps.part();
        self.turns.part();
        if let Some(excitation) = &mut self.excitation {
            excitation.part();
        }
    }

    fn take(
        &mut self,
        times: &[f64],
        (steps, fresh): (&[RowStep], &[RowFreshness]),
        values: &[f64],
        positions: Option<&[f64]>,
        join: f64,
    ) {
        self.spikes.settle();
        self.leaps.settle();
        for (k, ((&t, step), &value)) in times.iter().zip(steps).zip(values).enumerate() {
            if *step == RowStep::Unread {
                continue;
            }
            if !value.is_finite() {
                self.missing.add(t, t, 1, join);
                self.part();
                continue;
            }
            self.number(t, value, join);
            if self.channel.role == ChannelRole::Temperature {
                self.heat(t, value, join);
            }
            if !step.is_usable() || !self.shaped {
                continue;
            }
            if *step == RowStep::Apart {
                self.part();
            }
            let position = positions.map_or(f64::NAN, |positions| positions[k]);
            self.flat.take(t, value, position);
            self.spikes.take(t, value, position);
            if self.channel.role == ChannelRole::Position {
                self.turns.take(t, value);
                match fresh[k] {
                    RowFreshness::Repeats => {}
                    RowFreshness::Fresh => self.leaps.take(t, value),
                    RowFreshness::AfterRest(rested) => {
                        self.leaps.take(rested, self.latest);
                        self.leaps.take(t, value);
                    }
                }
                self.latest = value;
            }
            if let Some(excitation) = &mut self.excitation {
                excitation.take(t, value);
            }
        }
    }

    /// Looks for a leap between two rows of a temperature.
    fn heat(&mut self, t: f64, value: f64, join: f64) {
        let height = (value - self.latest).abs();
        if height > TEMPERATURE_LEAP_DEGC && t - self.before < TEMPERATURE_LEAP_S {
            self.leaps_of_heat.add(self.before, t, 1, join);
            self.highest = self.highest.max(height);
        }
        (self.before, self.latest) = (t, value);
    }

    #[inline]
    fn number(&mut self, t: f64, value: f64, join: f64) {
        self.rows += 1;
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        if self.channel.role == ChannelRole::Torque {
            self.dips.take(value);
            let counts = (value - self.channel.zero) / self.channel.factor;
            self.leaps_of_words.take(counts);
        }
        if self.channel.delivers.is_some_and(|most| value.abs() > most) {
            self.undelivered.add(t, t, 1, join);
        }
        // Welford 1962
        let d = value - self.mean;
        self.mean += d / self.rows as f64;
        self.scatter += d * (value - self.mean);
        if let Some([low, high]) = self.channel.limits {
            let slack = 1e-9 * (high - low);
            if value < low - slack || value > high + slack {
                self.beyond.add(t, t, 1, join);
            } else if self.channel.saturates && (value <= low + slack || value >= high - slack) {
                self.at_limit.add(t, t, 1, join);
            }
        }
    }
}

/// Looks at the rows of one log.
#[derive(Debug, Clone)]
pub struct LogJudge {
    pub(super) depth: InspectionDepth,
    pub(super) clock: LogClock,
    pub(super) sampling: SamplingTimes,
    /// Mean step of the first rows [s].
    first_step: f64,
    pub(super) tracks: Vec<ChannelTrack>,
    pub(super) failed: FailedReads,
    pub(super) repeats: RepeatDetector,
    pub(super) replays: ReplayDetector,
    pub(super) copies: CopyDetector,
    /// Channels whose copies are looked for.
    pub(super) compared: Vec<usize>,
    pub(super) positions: Vec<usize>,
    pub(super) windows: WindowSampler,
    /// Kinds of findings that are not acted upon.
    pub(super) keep: Vec<RowFault>,
    /// Band in which noise is counted \[Hz\].
    pub(super) band_hz: f64,
    /// Rows are messages, of which those without a number are left out.
    pub(super) messages: bool,
    fresh_rows: FreshRows,
    /// Channels with torques and velocities.
    others: Vec<usize>,
    row: [Vec<f64>; 2],
}

impl LogJudge {
    /// For a log of these channels, time aside.
    pub fn new(mut channels: Vec<InspectedChannel>, depth: InspectionDepth) -> Self {
        let all = channels.iter_mut();
        let shaped = all.filter(|channel| channel.role.has_shape());
        for channel in shaped.skip(SHAPED) {
            channel.role = ChannelRole::Other;
        }
        let of_role = |role: ChannelRole| -> Vec<usize> {
            let all = 0..channels.len();
            all.filter(|index| channels[*index].role == role).collect()
        };
        let positions = of_role(ChannelRole::Position);
        let only_torque = of_role(ChannelRole::Torque).len() == 1;
        let position_of = |channel: &InspectedChannel| {
            let joint = channel.joint.as_deref()?;
            let of_joint = |index: &&usize| channels[**index].joint.as_deref() == Some(joint);
            // A name without a joint means the only one there is, and so does the only torque whatever its name says.
            let alone = positions.len() == 1 && (joint.is_empty() || only_torque);
            let only = positions.first().filter(|_| alone);
            let found = positions.iter().find(of_joint).or(only).copied();
            found.filter(|_| channel.role != ChannelRole::Position)
        };
        let tracks = (channels.iter())
            .map(|channel| ChannelTrack::new(channel.clone(), position_of(channel)))
            .collect();
        let is_compared = |index: &usize| match (depth, channels[*index].role) {
            (InspectionDepth::Gate, role) => role.is_fitted(),
            (InspectionDepth::Whole, role) => role.has_shape() || role == ChannelRole::Command,
        };
        let mut compared: Vec<usize> = (0..channels.len()).filter(is_compared).collect();
        compared.truncate(COMPARED);
        let mut others = of_role(ChannelRole::Torque);
        others.extend(of_role(ChannelRole::Velocity));
        Self {
            depth,
            clock: LogClock::default(),
            sampling: SamplingTimes::default(),
            first_step: 0.0,
            fresh_rows: FreshRows::new(positions.len()),
            keep: Vec::new(),
            band_hz: NOISE_BAND_HZ,
            messages: false,
            failed: FailedReads::new(positions.len()),
            repeats: RepeatDetector::new(positions.len(), others.len()),
            replays: ReplayDetector::default(),
            copies: CopyDetector::new(compared.len()),
            compared,
            row: [vec![0.0; positions.len()], vec![0.0; others.len()]],
            others,
            positions,
            tracks,
            windows: WindowSampler::default(),
        }
    }

    /// Takes consecutive rows: times [s], and one column per channel.
    pub fn take(&mut self, times: &[f64], columns: &[&[f64]]) {
        if times.is_empty() {
            return;
        }
        if self.clock.rows == 0 {
            let dt = typical_step(times);
            self.first_step = mean_step(times);
            for &index in &self.positions {
                let track = &mut self.tracks[index];
                track.excitation = Some(Excitation::new(dt, track.channel.speed));
            }
        }
        let mut steps = self.clock.take(times);
        self.leave_out_failed(times, &mut steps, columns);
        // What happens again within a few rows is one event.
        let join = 10.5 * self.clock.step_so_far();
        let fresh = self.look_for_fresh(times, columns);
        for (track, values) in self.tracks.iter_mut().zip(columns) {
            let positions = track.position.map(|index| columns[index]);
            track.take(times, (&steps, &fresh), values, positions, join);
        }
        let compared: Vec<&[f64]> = self.compared.iter().map(|index| columns[*index]).collect();
        for (k, step) in steps.iter().enumerate() {
            if step.is_usable() {
                self.copies.take(&compared, k);
            }
        }
        self.watch_repeats(times, &steps, columns);
        let whole = steps.iter().skip(1).all(|step| *step == RowStep::Next);
        let finite = || {
            let mut pairs = columns.iter().zip(&self.tracks);
            pairs.all(|(column, track)| !track.shaped || column.iter().all(|x| x.is_finite()))
        };
        if self.depth == InspectionDepth::Whole && whole && finite() {
            self.windows.offer(times, columns);
        }
    }

    /// Says of each row whether it repeats the positions of the row before.
    fn look_for_fresh(&mut self, times: &[f64], columns: &[&[f64]]) -> Vec<RowFreshness> {
        let row = &mut self.row[0];
        let each = times.iter().enumerate().map(|(k, t)| {
            gather(row, columns, &self.positions, k);
            self.sampling.take(*t, self.first_step, row);
            self.fresh_rows.look(*t, row)
        });
        each.collect()
    }

    /// Marks rows that were not read.
    fn leave_out_failed(&mut self, times: &[f64], steps: &mut [RowStep], columns: &[&[f64]]) {
        let kept = FaultKind::FailedRead.kept(&self.keep);
        for (k, (&t, step)) in times.iter().zip(steps).enumerate() {
            let [positions, others] = &mut self.row;
            let logged = |index: &usize| {
                let channel = &self.tracks[*index].channel;
                (columns[*index][k] - channel.zero) / channel.factor
            };
            for (row, indices) in [(positions, &self.positions), (others, &self.others)] {
                row.clear();
                row.extend(indices.iter().map(logged));
            }
            if self.failed.take(t, &self.row[0], &self.row[1]) && !kept {
                *step = RowStep::Unread;
            }
        }
    }

    fn watch_repeats(&mut self, times: &[f64], steps: &[RowStep], columns: &[&[f64]]) {
        if self.positions.is_empty() {
            return;
        }
        for (k, (&t, step)) in times.iter().zip(steps).enumerate() {
            if !step.is_usable() {
                continue;
            }
            let [positions, others] = &mut self.row;
            gather(positions, columns, &self.positions, k);
            gather(others, columns, &self.others, k);
            if *step == RowStep::Apart || positions.iter().any(|x| !x.is_finite()) {
                self.repeats.part();
            }
            self.repeats.take(t, positions, others);
            self.replays.take(t, positions, others);
        }
    }

    /// Whether a position channel moves: further than its grain, and not far less than the others.
    pub(super) fn moves(&self, track: &ChannelTrack) -> bool {
        let positions = self.positions.iter();
        let travels = positions.map(|index| self.tracks[*index].travel());
        let farthest = travels.fold(0.0, f64::max);
        let step = track.flat.steps.quantile_not_zero(0.05);
        track.travel() > (30.0 * step).max(MIN_TRAVEL_SHARE * farthest)
    }
}

/// Row `k` of some columns.
fn gather(row: &mut [f64], columns: &[&[f64]], indices: &[usize], k: usize) {
    for (value, index) in row.iter_mut().zip(indices) {
        *value = columns[*index][k];
    }
}
