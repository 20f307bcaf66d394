//! From what the detectors gathered to faults: all thresholds stand here and in [`super::shape`].

use super::detectors::clock::{ClockFacts, GAP};
use super::detectors::excitation::JointMotion;
use super::detectors::grain;
use super::detectors::sampling::EvenRows;
use super::draft::{FaultList, rows_text, seconds};
use super::fault::Severity::{Error, Info, Warning};
use super::fault::{FaultEpisodes, FaultKind};
use super::findings::{ChannelFacts, Gap, LogFindings, RowCost, RowFate, joined};
use super::judge::{ChannelTrack, InspectionDepth, LogJudge};
use super::words::ChannelRole;
use super::{shape, together, unsigned};
use crate::log::round_within;

/// Steps off the median by more than a tenth, as a share of all, from which a clock is irregular.
const UNEVEN_STEPS_SHARE: f64 = 0.05;
/// Jitter from which it is worth knowing.
const JITTER_SHARE: f64 = 0.02;
/// Jitter up to which a lost row can be told from a late one [steps, rms].
const MAX_JITTER_STEPS: f64 = 0.2;
/// The same where no stamp is so late that a row may be lost before it.
const MAX_WHOLE_JITTER_STEPS: f64 = 0.3;

impl LogJudge {
    /// What there is to say about the log.
    pub fn finish(mut self) -> LogFindings {
        for track in &mut self.tracks {
            track.part();
        }
        self.repeats.part();
        self.replays.part();
        conclude(&self)
    }
}

fn conclude(judge: &LogJudge) -> LogFindings {
    let clock = judge.clock.facts();
    let first = judge.clock.first.unwrap_or(0.0);
    let mut draft = FaultList::new(first, first + judge.clock.duration().max(0.0), &judge.keep);
    time_faults(judge, &clock, &mut draft);
    failed_reads(judge, &clock, &mut draft);
    together::stalls(judge, &clock, &mut draft);
    for (place, track) in judge.tracks.iter().enumerate() {
        number_faults(track, judge.messages, &mut draft);
        speed_faults(judge, place, &mut draft);
        shape::faults(judge, place, &clock, &mut draft);
    }
    together::faults(judge, &clock, &mut draft);
    unsigned::faults(judge, &mut draft);
    let costs = costs(&draft, &clock);
    let rate = (clock.mean > 0.0).then(|| 1.0 / clock.mean);
    let gap = |[from, to]: &[f64; 2]| Gap {
        from_s: from - first,
        to_s: to - first,
    };
    let places = 0..judge.tracks.len();
    let mut found = LogFindings {
        rows: judge.clock.rows,
        begins_s: first,
        duration_s: judge.clock.duration(),
        rate_hz: rate,
        jitter: rate.map(|_| clock.jitter),
        even_rate_hz: draft.found.even_rate_hz.or(even_rate(judge, &clock)),
        gaps: clock.gaps.iter().map(gap).collect(),
        channels: places
            .map(|place| channel_facts(judge, place, rate))
            .collect(),
        joints: joints(judge),
        costs,
        cuts: joined(draft.cuts.into_iter().map(|(span, _)| span).collect()),
        ..draft.found
    };
    found.bridges.sort_by(|a, b| a.t.total_cmp(&b.t));
    found.sort();
    found.place();
    found
}

/// How many rows each cause costs, the most first.
fn costs(draft: &FaultList, clock: &ClockFacts) -> Vec<RowCost> {
    let mut causes: Vec<FaultKind> = draft.cuts.iter().map(|(_, kind)| *kind).collect();
    causes.sort_unstable();
    causes.dedup();
    let left_out = |kind: FaultKind| {
        let spans = draft.cuts.iter().filter(|(_, of)| *of == kind);
        let spans = joined(spans.map(|(span, _)| *span).collect());
        let rows = |[from, to]: &[f64; 2]| ((to - from) / clock.dt).round().clamp(0.0, 1e15) as u64;
        let rows = spans.iter().map(|span| rows(span) + 1).sum();
        (kind, rows, RowFate::LeftOut)
    };
    let found = &draft.found;
    let mut bridged: Vec<f64> = found.bridges.iter().map(|bridge| bridge.t).collect();
    bridged.sort_by(f64::total_cmp);
    bridged.dedup();
    let mut faults = found.faults.iter();
    let held = faults.find(|fault| fault.kind == FaultKind::SampleAndHold);
    let held = held.filter(|fault| fault.cut).map_or(0, |fault| fault.rows);
    let others = [
        (FaultKind::Spike, bridged.len() as u64, RowFate::Bridged),
        (
            FaultKind::FailedRead,
            found.failed.len() as u64,
            RowFate::LeftOut,
        ),
        (FaultKind::SampleAndHold, held, RowFate::LeftOut),
    ];
    let others = others.into_iter().filter(|(_, rows, _)| *rows > 0);
    let all = causes.into_iter().map(left_out).chain(others);
    let mut costs: Vec<RowCost> = all
        .map(|(kind, rows, fate)| RowCost { kind, rows, fate })
        .collect();
    RowCost::sort(&mut costs);
    costs
}

/// Rows in which every channel reads one number.
fn failed_reads(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    let (times, value) = (&judge.failed.times, judge.failed.value);
    let mut episodes = FaultEpisodes::default();
    for t in times {
        episodes.add(*t, *t, 1, 1.5 * clock.dt);
    }
    let effect = format!(
        "in which every channel reads {value} while the robot is elsewhere: nothing was read, and a fit leaves them out"
    );
    let remedy = "look for lost messages of the bus; log rows that were read, and no others";
    let fault = (Warning, FaultKind::FailedRead, None);
    draft.rows(fault, &episodes, &effect, remedy);
    if !times.is_empty() && draft.acts(fault) {
        draft.found.failed = times.to_vec();
    }
}

fn channel_facts(judge: &LogJudge, place: usize, rate: Option<f64>) -> ChannelFacts {
    let track = &judge.tracks[place];
    let number = |x: f64| x.is_finite().then_some(x);
    let share = track.rows as f64 / judge.clock.rows.max(1) as f64;
    let step = match judge.depth {
        InspectionDepth::Gate => None,
        InspectionDepth::Whole => grain::step(&judge.windows.kept, place),
    };
    ChannelFacts {
        name: track.channel.name.clone(),
        role: track.channel.role,
        unit: track.channel.unit.clone(),
        min: number(track.low),
        max: number(track.high),
        rate_hz: rate.map(|rate| rate * share),
        step,
        limits: track.channel.limits,
    }
}

fn joints(judge: &LogJudge) -> Vec<JointMotion> {
    let tracks = judge.positions.iter().map(|index| &judge.tracks[*index]);
    let facts = tracks.filter_map(|track| {
        let name = match track.channel.joint.as_deref() {
            None | Some("") => &track.channel.name,
            Some(joint) => joint,
        };
        let excitation = track.excitation.as_ref()?;
        let moves = judge.moves(track);
        Some(JointMotion {
            unit: track.channel.unit.clone(),
            ..excitation.facts(name, &track.channel.name, track.travel(), moves)
        })
    });
    facts.collect()
}

/// The rate of the rows where the clock is too coarse for them.
fn even_rate(judge: &LogJudge, clock: &ClockFacts) -> Option<f64> {
    let seen = &judge.clock;
    let rate = (seen.rows.saturating_sub(1)) as f64 / seen.duration();
    // a clock that stands still now and then is another fault
    let coarse = 4 * seen.repeated.rows() > seen.rows && seen.duration() > 10.0 * clock.dt;
    coarse.then(|| round_within(rate, rate * 2.0 * clock.dt / seen.duration()))
}

fn time_faults(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    let seen = &judge.clock;
    if seen.without_time > 0 {
        let effect = format!(
            "{} without a time: no reader takes them",
            rows_text(seen.without_time, 1)
        );
        let remedy = "delete these rows, or name the right time column in the [log] section of the robot file";
        let fault = (Error, FaultKind::Nan, None);
        draft.of_log(fault, seen.without_time, effect, remedy);
    }
    let effect = |rows: u64, times: usize| {
        format!(
            "{}{} at the time of the row before: no velocity can be formed, and the log is refused",
            often(times, "times, "),
            rows_text(rows, 1)
        )
    };
    let remedy = &match even_rate(judge, clock) {
        Some(rate) => format!(
            "the clock moves in steps of {}, too coarse for rows at {rate} Hz: where rows lie evenly, `rate_hz = {rate}` in [log] of the robot file, in place of `time`",
            seconds(clock.dt),
        ),
        None => "delete duplicate rows; where rows lie evenly, `rate_hz = ..` in [log] of the robot file, in place of `time`".to_owned(),
    };
    let fault = (Error, FaultKind::RepeatedTime, None);
    draft.stretches(fault, &seen.repeated, &effect, remedy);
    let effect = |_: u64, times: usize| {
        format!(
            "time runs {}backwards: derivatives across it are wrong, and the log is refused",
            often(times, "times ")
        )
    };
    let remedy = "sort the rows by time, or split the file where a second recording begins";
    let fault = (Error, FaultKind::BackwardTime, None);
    draft.stretches(fault, &seen.backward, &effect, remedy);
    let jitters = |rows: &EvenRows| {
        clock.jitter > JITTER_SHARE || rows.off_s > JITTER_SHARE * rows.even.step_s
    };
    if let Some(rows) = judge.sampling.even().filter(jitters) {
        jitter(judge, clock, rows, draft);
        return;
    }
    gap_faults(clock, draft);
    if clock.uneven > UNEVEN_STEPS_SHARE || clock.jitter > JITTER_SHARE {
        let severity = match clock.uneven > UNEVEN_STEPS_SHARE {
            true => Warning,
            false => Info,
        };
        let effect = format!(
            "steps from {} to {}, median {}, {:.1} % of them off it by more than a tenth: samples are interpolated onto an even clock, which is right as far as the times are those of the measurements",
            seconds(clock.least),
            seconds(clock.largest),
            seconds(clock.dt),
            100.0 * clock.uneven
        );
        let remedy = "log the time at which a sample was taken, not at which it was written";
        let fault = (severity, FaultKind::IrregularClock, None);
        draft.of_log(fault, seen.rows, effect, remedy);
    }
}

/// Stamps that are not when rows were sampled: put on an even clock, or refused where a lost row cannot be told.
fn jitter(judge: &LogJudge, clock: &ClockFacts, rows: EvenRows, draft: &mut FaultList) {
    let seen = &judge.clock;
    let EvenRows { even, off_s, .. } = rows;
    let mean = seen.duration() / seen.rows.saturating_sub(1).max(1) as f64;
    let in_bursts = clock.long > GAP * clock.dt;
    let most = match rows.whole {
        true => MAX_WHOLE_JITTER_STEPS,
        false => MAX_JITTER_STEPS,
    };
    if !in_bursts && off_s < most * even.step_s {
        gap_faults(clock, draft);
        let effect = format!(
            "stamps are off by {} rms, and the positions show that rows were sampled evenly, every {}: they are put on an even clock",
            seconds(off_s),
            seconds(even.step_s)
        );
        let remedy =
            "log the time at which a sample was taken, not at which it was written or received";
        let fault = (Warning, FaultKind::IrregularClock, None);
        draft.of_log(fault, seen.rows, effect, remedy);
        draft.acts(fault);
        draft.found.even = Some(even);
        return;
    }
    let rate = match in_bursts {
        true => rate_of_bursts(
            seen.rows as f64,
            seen.duration(),
            clock.dt,
            clock.gaps.len(),
        ),
        false => 1.0 / even.step_s,
    };
    let rate = round_within(rate, 0.01 * rate);
    let effect = match in_bursts {
        true => format!(
            "rows come in bursts, {} apart in them and {} on average, and the positions show that they were sampled evenly, at about {rate} Hz: by their stamps no velocity can be formed",
            seconds(clock.dt),
            seconds(mean)
        ),
        false => format!(
            "stamps are off by {} rms, {:.0} % of a step, and the positions show that rows were sampled evenly, at about {rate} Hz: by their stamps no velocity can be formed",
            seconds(off_s),
            100.0 * off_s / even.step_s
        ),
    };
    let remedy = format!(
        "`rate_hz = {rate}` in [log] of the robot file puts rows on an even clock; or a counter of samples in the log as `time`"
    );
    let fault = (Error, FaultKind::IrregularClock, None);
    draft.of_log(fault, seen.rows, effect, &remedy);
    draft.found.even_rate_hz = Some(rate);
}

/// The rate of so many rows that come in bursts, `step_s` apart in them: those of a burst over the time from one burst to
/// the next, and of all rows on average where nothing is left between bursts \[Hz\].
fn rate_of_bursts(rows: f64, duration_s: f64, step_s: f64, pauses: usize) -> f64 {
    let pauses = pauses as f64;
    let of_burst = rows / (pauses + 1.0);
    let between = (duration_s - (of_burst - 1.0) * step_s) / pauses;
    // rows lie closer in a burst than they were sampled
    match pauses > 0.0 && between > of_burst * step_s {
        true => of_burst / between,
        false => (rows - 1.0).max(1.0) / duration_s,
    }
}

fn often(times: usize, what: &str) -> String {
    match times {
        0 | 1 => String::new(),
        many => format!("{many} {what}"),
    }
}

/// Steps that are much longer than the others.
fn gap_faults(clock: &ClockFacts, draft: &mut FaultList) {
    let mut gaps = FaultEpisodes::default();
    for [from, to] in &clock.gaps {
        let lost = ((to - from) / clock.dt).round() - 1.0;
        gaps.add(*from, *to, lost.clamp(0.0, 1e15) as u64, -1.0);
    }
    let effect = |rows: u64, times: usize| {
        format!(
            "{}about {} lost: a gap that the filter's band does not see is interpolated, a longer one parts the log and the ends of its stretches are given up",
            often(times, "gaps, "),
            rows_text(rows, 1)
        )
    };
    let remedy = "record with a larger buffer or a lower rate; a few gaps in a long log do no harm";
    let fault = (Warning, FaultKind::Dropout, None);
    draft.stretches(fault, &gaps, &effect, remedy);
}

/// Positions that move faster than the robot can, where no velocity of the joint was logged that says so itself.
fn speed_faults(judge: &LogJudge, place: usize, draft: &mut FaultList) {
    let track = &judge.tracks[place];
    let (Some(limit), Some(motion)) = (track.channel.speed, &track.excitation) else {
        return;
    };
    let of_joint = |other: &ChannelTrack| {
        other.channel.role == ChannelRole::Velocity && other.channel.joint == track.channel.joint
    };
    if judge.tracks.iter().any(of_joint) {
        return;
    }
    let unit = track.channel.unit.as_deref().unwrap_or_default();
    let effect = format!(
        "in which it moves faster than {limit} {unit}/s, the limit of its joint: unit, encoder or limit is wrong, or the times are"
    );
    let remedy = "check the unit of this channel and of the time in [log], and `speed` in [limits] of the robot file";
    let fault = (Warning, FaultKind::BeyondLimits, Some(track));
    draft.rows(fault, &motion.too_fast, &effect, remedy);
}

fn number_faults(track: &ChannelTrack, messages: bool, draft: &mut FaultList) {
    let used = track.channel.role.is_fitted();
    if track.rows == 0 && !used {
        // A column of words is no channel.
        return;
    }
    let (severity, then) = match track.channel.role {
        _ if used && messages && track.rows > 0 => (Warning, "a fit leaves these messages out"),
        _ if used => (Error, "a fit refuses the log"),
        ChannelRole::Temperature => (
            Warning,
            "a fit does not read it, `diagnose` and what takes the temperature refuse the log",
        ),
        _ => (Info, "a fit does not read this channel"),
    };
    let effect = format!("without a finite number: {then}");
    let remedy = match messages {
        true => {
            "nothing where each message holds some of the joints; else look at what publishes them"
        }
        false => {
            "delete the rows without a measurement: a gap in time is handled, a made-up number is not"
        }
    };
    let fault = (severity, FaultKind::Nan, Some(track));
    draft.rows(fault, &track.missing, &effect, remedy);
    if let Some(most) = track.channel.delivers {
        let effect = format!(
            "of more than {most} {}, the `torque_limit` of the robot file: the drive does not deliver it, so that these rows are left out of a fit",
            track.channel.unit.as_deref().unwrap_or("N or Nm")
        );
        let remedy = "move more gently to keep them, or delete `torque_limit` in [log.joint] where the drive gives more";
        let fault = (Warning, FaultKind::Saturation, Some(track));
        draft.rows(fault, &track.undelivered, &effect, remedy);
        draft.cut(fault, &track.undelivered);
    }
    let Some([low, high]) = track.channel.limits else {
        return;
    };
    let effect = format!(
        "outside [{low}, {high}], reaching {} and {}: unit, sign, offset or limit is wrong, or the machine was driven too far",
        track.low, track.high
    );
    let remedy = "check the unit and offset of this channel in [log], and the limit in [limits] of the robot file";
    let fault = (Warning, FaultKind::BeyondLimits, Some(track));
    draft.rows(fault, &track.beyond, &effect, remedy);
    let effect = format!(
        "at the limit of [{low}, {high}]: the amplifier gives no more; as what is logged is what was applied, a fit may use it"
    );
    let remedy = "choose a slower motion where the robot should follow its reference";
    let fault = (Info, FaultKind::Saturation, Some(track));
    draft.rows(fault, &track.at_limit, &effect, remedy);
}

#[cfg(test)]
mod tests {
    use super::rate_of_bursts;

    #[test]
    fn the_rate_of_bursts_is_theirs_and_that_of_all_rows_where_no_time_is_between_them() {
        // ten bursts of five rows 1 ms apart, every 50 ms
        let rate = rate_of_bursts(50.0, 0.454, 0.001, 9);
        assert!((rate - 100.0).abs() < 1e-9, "{rate}");
        // no pause, none that takes time, and rows that overlap
        for (duration, step, pauses) in [(0.5, 0.01, 0), (0.5, 0.5 / 24.0, 1), (0.5, 0.1, 3)] {
            let rate = rate_of_bursts(50.0, duration, step, pauses);
            assert!((rate - 98.0).abs() < 1e-9, "{step} {pauses}: {rate}");
        }
    }
}
