//! From what the detectors gathered to faults: all thresholds stand here and in [`super::shape`].

use super::detectors::clock::ClockFacts;
use super::detectors::excitation::JointMotion;
use super::detectors::grain;
use super::draft::{FaultList, rows_text, seconds};
use super::fault::Severity::{Error, Info, Warning};
use super::fault::{Episodes, FaultKind};
use super::findings::{ChannelFacts, Findings, Gap, RowCost, RowFate, joined};
use super::judge::{Depth, LogJudge, Track};
use super::words::ChannelRole;
use super::{shape, together};
use crate::log::round_within;

/// Steps off the median by more than a tenth, as a share of all, from which a clock is irregular.
const UNEVEN_STEPS_SHARE: f64 = 0.05;
/// Jitter from which it is worth knowing.
const JITTER_SHARE: f64 = 0.02;

impl LogJudge {
    /// What there is to say about the log.
    pub fn finish(mut self) -> Findings {
        for track in &mut self.tracks {
            track.part();
        }
        self.repeats.part();
        self.replays.part();
        conclude(&self)
    }
}

/// Everything there is to say.
fn conclude(judge: &LogJudge) -> Findings {
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
    let costs = costs(&draft, &clock);
    let FaultList {
        mut faults,
        cuts,
        mut bridges,
        failed,
        wraps,
        off,
        held,
        ..
    } = draft;
    bridges.sort_by(|a, b| a.0.total_cmp(&b.0));
    faults.sort_by(|a, b| {
        let severity = b.severity.cmp(&a.severity);
        severity
            .then(a.from_s.total_cmp(&b.from_s))
            .then(a.kind.cmp(&b.kind))
    });
    let rate = (clock.dt > 0.0).then(|| 1.0 / clock.dt);
    let mut found = Findings {
        rows: judge.clock.rows,
        begins_s: first,
        duration_s: judge.clock.duration(),
        rate_hz: rate,
        jitter: rate.map(|_| clock.jitter),
        even_rate_hz: even_rate(judge, &clock),
        gaps: clock
            .gaps
            .iter()
            .map(|[from, to]| Gap {
                from_s: from - first,
                to_s: to - first,
            })
            .collect(),
        channels: judge
            .tracks
            .iter()
            .enumerate()
            .map(|(index, track)| channel_facts(judge, index, track, rate))
            .collect(),
        joints: joints(judge),
        faults,
        costs,
        cuts: joined(cuts.into_iter().map(|(span, _)| span).collect()),
        bridges,
        failed,
        wraps,
        off,
        held,
    };
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
        RowCost {
            kind,
            rows: spans.iter().map(|span| rows(span) + 1).sum(),
            fate: RowFate::LeftOut,
        }
    };
    let mut costs: Vec<RowCost> = causes.into_iter().map(left_out).collect();
    if !draft.bridges.is_empty() {
        let mut times: Vec<f64> = draft.bridges.iter().map(|(t, ..)| *t).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        costs.push(RowCost {
            kind: FaultKind::Spike,
            rows: times.len() as u64,
            fate: RowFate::Bridged,
        });
    }
    if !draft.failed.is_empty() {
        costs.push(RowCost {
            kind: FaultKind::FailedRead,
            rows: draft.failed.len() as u64,
            fate: RowFate::LeftOut,
        });
    }
    let held = draft
        .faults
        .iter()
        .find(|fault| fault.kind == FaultKind::SampleAndHold);
    costs.extend(held.filter(|fault| fault.cut).map(|fault| RowCost {
        kind: fault.kind,
        rows: fault.rows,
        fate: RowFate::LeftOut,
    }));
    costs.sort_by(|a, b| b.rows.cmp(&a.rows).then(a.kind.cmp(&b.kind)));
    costs
}

/// Rows in which every channel reads one number.
fn failed_reads(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    let (times, value) = (judge.failed.times(), judge.failed.value());
    let mut episodes = Episodes::default();
    for t in times {
        episodes.add(*t, *t, 1, 1.5 * clock.dt);
    }
    let effect = |rows: u64, times: usize| {
        format!(
            "{} in which every channel reads {value} while the robot is elsewhere: nothing was read, and a fit leaves them out",
            rows_text(rows, times)
        )
    };
    let remedy = "look for lost messages of the bus; log rows that were read, and no others";
    let kind = FaultKind::FailedRead;
    draft.stretches(kind, Warning, None, &episodes, &effect, remedy);
    if !times.is_empty() && draft.acts(kind, None) {
        draft.failed = times.to_vec();
    }
}

fn channel_facts(judge: &LogJudge, index: usize, track: &Track, rate: Option<f64>) -> ChannelFacts {
    let number = |x: f64| x.is_finite().then_some(x);
    let share = track.rows as f64 / judge.clock.rows.max(1) as f64;
    let step = match judge.depth {
        Depth::Gate => None,
        Depth::Whole => grain::step(judge.windows.iter(), index),
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
    tracks
        .filter_map(|track| {
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
        })
        .collect()
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
        draft.of_log(Error, FaultKind::Nan, seen.without_time, effect, remedy);
    }
    let effect = |rows: u64, times: usize| {
        let which = if times > 1 {
            format!("{times} times, ")
        } else {
            String::new()
        };
        format!(
            "{which}{} at the time of the row before: no velocity can be formed, and the log is refused",
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
    draft.stretches(
        FaultKind::RepeatedTime,
        Error,
        None,
        &seen.repeated,
        &effect,
        remedy,
    );
    let effect = |_: u64, times: usize| {
        let which = if times > 1 {
            format!("{times} times ")
        } else {
            String::new()
        };
        format!(
            "time runs {which}backwards: derivatives across it are wrong, and the log is refused"
        )
    };
    let remedy = "sort the rows by time, or split the file where a second recording begins";
    draft.stretches(
        FaultKind::BackwardTime,
        Error,
        None,
        &seen.backward,
        &effect,
        remedy,
    );
    gap_faults(clock, draft);
    if clock.uneven > UNEVEN_STEPS_SHARE || clock.jitter > JITTER_SHARE {
        let severity = if clock.uneven > UNEVEN_STEPS_SHARE {
            Warning
        } else {
            Info
        };
        let effect = format!(
            "steps from {} to {}, median {}, {:.1} % of them off it by more than a tenth: samples are interpolated onto an even clock, which is right as far as the times are those of the measurements",
            seconds(clock.least),
            seconds(clock.largest),
            seconds(clock.dt),
            100.0 * clock.uneven
        );
        let remedy = "log the time at which a sample was taken, not at which it was written";
        draft.of_log(
            severity,
            FaultKind::IrregularClock,
            seen.rows,
            effect,
            remedy,
        );
    }
}

/// Steps that are much longer than the others.
fn gap_faults(clock: &ClockFacts, draft: &mut FaultList) {
    let mut gaps = Episodes::default();
    for [from, to] in &clock.gaps {
        let lost = ((to - from) / clock.dt).round() - 1.0;
        gaps.add(*from, *to, lost.clamp(0.0, 1e15) as u64, -1.0);
    }
    let effect = |rows: u64, times: usize| {
        let many = if times > 1 {
            format!("{times} gaps, ")
        } else {
            String::new()
        };
        format!(
            "{many}about {} lost: a gap that the filter's band does not see is interpolated, a longer one parts the log and the ends of its stretches are given up",
            rows_text(rows, 1)
        )
    };
    let remedy = "record with a larger buffer or a lower rate; a few gaps in a long log do no harm";
    draft.stretches(FaultKind::Dropout, Warning, None, &gaps, &effect, remedy);
}

/// Positions that move faster than the robot can, where no velocity of the joint was logged that says so itself.
fn speed_faults(judge: &LogJudge, place: usize, draft: &mut FaultList) {
    let track = &judge.tracks[place];
    let (Some(limit), Some(motion)) = (track.channel.speed, &track.excitation) else {
        return;
    };
    let of_joint = |other: &Track| {
        other.channel.role == ChannelRole::Velocity && other.channel.joint == track.channel.joint
    };
    if judge.tracks.iter().any(of_joint) {
        return;
    }
    let unit = track.channel.unit.as_deref().unwrap_or_default();
    let effect = |rows: u64, times: usize| {
        format!(
            "{} in which it moves faster than {limit} {unit}/s, the limit of its joint: unit, encoder or limit is wrong, or the times are",
            rows_text(rows, times)
        )
    };
    let remedy = "check the unit of this channel and of the time in [log], and `speed` in [limits] of the robot file";
    draft.stretches(
        FaultKind::BeyondLimits,
        Warning,
        Some(&track.channel.name),
        &motion.too_fast,
        &effect,
        remedy,
    );
}

fn number_faults(track: &Track, messages: bool, draft: &mut FaultList) {
    let name = Some(track.channel.name.as_str());
    let used = matches!(
        track.channel.role,
        ChannelRole::Position | ChannelRole::Torque
    );
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
    let effect = |rows: u64, times: usize| {
        format!("{} without a finite number: {then}", rows_text(rows, times))
    };
    let remedy = match messages {
        true => {
            "nothing where each message holds some of the joints; else look at what publishes them"
        }
        false => {
            "delete the rows without a measurement: a gap in time is handled, a made-up number is not"
        }
    };
    draft.stretches(
        FaultKind::Nan,
        severity,
        name,
        &track.missing,
        &effect,
        remedy,
    );
    if let Some([low, high]) = track.channel.limits {
        let effect = |rows: u64, times: usize| {
            format!(
                "{} outside [{low}, {high}], reaching {} and {}: unit, sign, offset or limit is wrong, or the machine was driven too far",
                rows_text(rows, times),
                track.low,
                track.high
            )
        };
        let remedy = "check the unit and offset of this channel in [log], and the limit in [limits] of the robot file";
        draft.stretches(
            FaultKind::BeyondLimits,
            Warning,
            name,
            &track.beyond,
            &effect,
            remedy,
        );
        let effect = |rows: u64, times: usize| {
            format!(
                "{} at the limit of [{low}, {high}]: the amplifier gives no more; as what is logged is what was applied, a fit may use it",
                rows_text(rows, times)
            )
        };
        let remedy = "choose a slower motion where the robot should follow its reference";
        draft.stretches(
            FaultKind::Saturation,
            Info,
            name,
            &track.at_limit,
            &effect,
            remedy,
        );
    }
}
