//! Faults that show between channels: copies, rows that repeat, velocities that lag.

use super::detectors::clock::ClockFacts;
use super::detectors::flat::FlatDetector;
use super::detectors::grain;
use super::detectors::velocity;
use super::draft::{FaultList, seconds};
use super::fault::Severity::{Error, Info, Warning};
use super::fault::{FaultEpisodes, FaultKind, LogFault};
use super::judge::{ChannelTrack, InspectionDepth, LogJudge};
use super::lag;
use super::words::ChannelRole;
use crate::log::escape;
use cft_ident_core::number;
use std::f64::consts::{PI, TAU};

/// A velocity that lags by more rows is filtered.
const LAG_ROWS: f64 = 1.5;
/// What the lag must explain: the part of the velocity left over without it, over that with it.
const MIN_IMPROVEMENT_BY_LAG: f64 = 1.3;
/// Correlation from which on a velocity follows a position, and the share by which it may be off as filters make it.
const MIN_CORRELATION: f64 = 0.95;
const SCALE_TOLERANCE: f64 = 0.1;
/// Noise over range below which a position is no measurement.
const NOISELESS_SHARE_OF_RANGE: f64 = 1e-8;

pub(super) fn faults(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    copies(judge, draft);
    repeated_parts(judge, draft);
    if judge.depth == InspectionDepth::Whole {
        // At the gate the reader has left them out already.
        repeated_rows(judge, clock, draft);
        velocities(judge, clock, draft);
        lag::faults(judge, clock, draft);
        noiseless(judge, draft);
    }
}

/// The positions' own steps.
fn flats(judge: &LogJudge) -> Vec<&FlatDetector> {
    let positions = judge.positions.iter();
    positions.map(|index| &judge.tracks[*index].flat).collect()
}

/// Stretches in which everything is frozen.
pub(super) fn stalls(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    let mut episodes = FaultEpisodes::default();
    for stall in &judge.repeats.stalls(&flats(judge)).list {
        // The robot leaps on from the last frozen row to the next.
        episodes.add(stall.from, stall.to + clock.dt, stall.rows, 0.0);
    }
    let effect = "in which positions, torques and velocities keep their last digit while the robot moves: controller or recorder froze, and these rows are left out of a fit";
    let remedy = "look for what held the controller up: a full disk, a blocked bus, another program; record again if much is lost";
    let fault = (Warning, FaultKind::Stall, None);
    draft.rows(fault, &episodes, effect, remedy);
    draft.stalls = episodes.list.iter().map(|e| [e.from, e.to]).collect();
    draft.cut(fault, &episodes);
}

fn repeated_rows(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    let stale = judge.repeats.judge(&flats(judge));
    if stale.moving == 0 {
        return;
    }
    let episodes = stale.episodes.merged();
    let (Some((begin, _)), Some((end, _))) = (episodes.first(), episodes.last()) else {
        return;
    };
    let (from, to) = (begin.from, end.to);
    let first = judge.clock.first.unwrap_or(0.0);
    let remedy = "log each sample of the robot once, by the robot's own clock";
    if let Some((rows, longest)) = judge.repeats.hold(stale.moving) {
        let repeated = judge.repeats.repeated();
        let effect = format!(
            "{:.0} % of the rows repeat positions and torques of the row before: samples are held for about {rows} rows, so that there is one every {}; only fresh rows are used",
            100.0 * repeated as f64 / judge.clock.rows.max(1) as f64,
            seconds(rows as f64 * clock.dt)
        );
        let (kind, to_s) = (FaultKind::SampleAndHold, judge.clock.duration());
        draft.found.faults.push(LogFault {
            rows: repeated,
            ..LogFault::whole(Warning, kind, to_s, effect, remedy)
        });
        if draft.acts((Warning, kind, None)) {
            draft.found.held = Some(longest);
        }
        return;
    }
    let effect = format!(
        "{} the positions of the row before while the robot moves, so that it seems to stop and to leap: they are left out of a fit, and the log is interpolated over single ones",
        match stale.rows {
            1 => "1 row repeats".to_owned(),
            rows => format!("{rows} rows repeat"),
        }
    );
    let kind = FaultKind::RepeatedRows;
    draft.found.faults.push(LogFault {
        from_s: from - first,
        rows: stale.rows,
        ..LogFault::whole(Warning, kind, to - first, effect, remedy)
    });
    if draft.acts((Warning, kind, None)) {
        let cuts = stale.cuts.into_iter();
        draft.cuts.extend(cuts.map(|span| (span, kind)));
    }
}

fn repeated_parts(judge: &LogJudge, draft: &mut FaultList) {
    let effect = "that stand in the log before, number for number: a file was appended to itself, or a buffer written twice. Counted twice, they make intervals too narrow";
    let remedy = "leave them out of a fit: `--leave-out FROM..TOs`; a simulation without noise repeats itself rightly";
    let fault = (Warning, FaultKind::RepeatedPart, None);
    draft.rows(fault, &judge.replays.found(), effect, remedy);
}

fn copies(judge: &LogJudge, draft: &mut FaultList) {
    for copy in judge.copies.found() {
        let track = |index: usize| &judge.tracks[judge.compared[index]];
        let (first, second) = (track(copy.first), track(copy.second));
        let (a, b) = (first.channel.role, second.channel.role);
        let sign = match copy.opposite {
            true => ", with the other sign,",
            false => "",
        };
        let equals = |other: &ChannelTrack| {
            let name = escape(&other.channel.name);
            format!("equals `{name}`{sign} in every row")
        };
        let copied = FaultKind::CopiedChannel;
        use ChannelRole::{Command, Position, Torque, Velocity};
        let with_mimic;
        let (severity, kind, of, effect, remedy) = match (a, b) {
            (Command, Command) => continue,
            (Command, _) | (_, Command) => {
                let (command, measured) = match a {
                    Command => (first, second),
                    _ => (second, first),
                };
                let effect = equals(command)
                    + ": it is the command and no measurement, and a fit takes tracking errors for forces";
                let remedy = "log the measured value, or name the measured column in the [log] section of the robot file";
                let kind = FaultKind::CommandAsMeasurement;
                (Warning, kind, measured, effect, remedy)
            }
            (Position, Position) | (Torque, Torque) => {
                let effect = equals(first)
                    + ": one of the two is not what it says, and the data of a joint are missing";
                let mut remedy = "check the columns of the recorder; name the right ones in the [log] section of the robot file";
                let joints =
                    [first, second].map(|track| track.channel.joint.as_deref().map(escape));
                if let (Position, [Some(leads), Some(follows)]) = (a, joints) {
                    let times = if copy.opposite { -1 } else { 1 };
                    with_mimic = format!(
                        "{remedy}; where one drive moves both, `<mimic joint=\"{leads}\" multiplier=\"{times}\"/>` in joint {follows} of the URDF, and the robot file by `cft-ident new` again"
                    );
                    remedy = &with_mimic;
                }
                (Error, copied, second, effect, remedy)
            }
            (Position, Velocity) | (Velocity, Position) => {
                let effect = equals(first)
                    + ": one of the two is not what it says, and a fit to it means nothing";
                let remedy =
                    "name the column of the position in the [log] section of the robot file";
                (Error, copied, second, effect, remedy)
            }
            _ => {
                let remedy = "check the columns of the recorder";
                (Warning, copied, second, equals(first), remedy)
            }
        };
        draft.of_log((severity, kind, Some(of)), copy.rows, effect, remedy);
    }
}

fn velocities(judge: &LogJudge, clock: &ClockFacts, draft: &mut FaultList) {
    for (index, track) in judge.tracks.iter().enumerate() {
        let (ChannelRole::Velocity, Some(position)) = (track.channel.role, track.position) else {
            continue;
        };
        let Some(found) = velocity::follows(&judge.windows.kept, position, index) else {
            continue;
        };
        let of = escape(&judge.tracks[position].channel.name);
        if found.best < -0.7 {
            let effect = format!(
                "runs against the derivative of `{of}` (correlation {:.3}): one of the two has the wrong sign",
                found.best
            );
            let remedy = "turn the sign of one of them in the [log] section of the robot file";
            draft.whole(Error, FaultKind::WrongSignOrOrder, track, effect, remedy);
            continue;
        }
        if found.best < 0.7 {
            other_joint(judge, (index, position), draft);
            continue;
        }
        if found.best > MIN_CORRELATION && (found.times - 1.0).abs() > SCALE_TOLERANCE {
            let cause = match named_ratio(found.times) {
                Some(units) => format!("{units}, or the clock of the log"),
                None => "its unit or gear is another, or the clock of the log".to_owned(),
            };
            let effect = format!(
                "is {} times the derivative of `{of}`: {cause} runs at {} of its rate",
                number::significant(found.times, 3),
                number::significant(found.times.recip(), 3)
            );
            let remedy = "nothing where the columns are of different units; else give units, gears and `time_unit` in the [log] section of the robot file";
            draft.whole(Warning, FaultKind::WrongSignOrOrder, track, effect, remedy);
        }
        let left = |correlation: f64| 1.0 - correlation * correlation;
        if found.rows.abs() > LAG_ROWS
            && left(found.now) > MIN_IMPROVEMENT_BY_LAG * left(found.best)
        {
            let side = if found.rows > 0.0 {
                "behind"
            } else {
                "ahead of"
            };
            let effect = format!(
                "{} {side} the derivative of `{of}`: it is filtered; friction fitted on it would open a loop at every reversal",
                seconds(found.rows.abs() * clock.dt)
            );
            let remedy = "nothing here: velocities are formed from the positions; do not use this channel elsewhere";
            draft.whole(Warning, FaultKind::Filter, track, effect, remedy);
        }
    }
}

/// The units of position and velocity that give this ratio.
fn named_ratio(times: f64) -> Option<&'static str> {
    const RATIOS: [(f64, &str); 6] = [
        (1.0 / TAU, "a velocity in turns/s beside a position in rad"),
        (TAU, "a velocity in rad/s beside a position in turns"),
        (PI / 180.0, "a velocity in rad/s beside a position in deg"),
        (180.0 / PI, "a velocity in deg/s beside a position in rad"),
        (60.0 / TAU, "a velocity in rpm beside a position in rad"),
        (60.0, "a velocity in rpm beside a position in turns"),
    ];
    let off = |(ratio, _): &(f64, &str)| (times / ratio).ln().abs();
    let nearest = RATIOS.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    (off(nearest) < SCALE_TOLERANCE).then_some(nearest.1)
}

/// Names the joint whose velocity a channel really is.
fn other_joint(judge: &LogJudge, (index, own): (usize, usize), draft: &mut FaultList) {
    let follows = |position: &&usize| {
        let found = velocity::follows(&judge.windows.kept, **position, index);
        **position != own && found.is_some_and(|found| found.best.abs() > MIN_CORRELATION)
    };
    let Some(other) = judge.positions.iter().find(follows) else {
        return;
    };
    let name = |place: usize| escape(&judge.tracks[place].channel.name);
    let effect = format!(
        "is no derivative of `{}` but that of `{}`: velocities or positions are exchanged",
        name(own),
        name(*other)
    );
    let remedy = "name the right columns in the [log] section of the robot file";
    let track = &judge.tracks[index];
    draft.whole(Error, FaultKind::WrongSignOrOrder, track, effect, remedy);
}

/// Positions without any noise or grain are no measurement.
fn noiseless(judge: &LogJudge, draft: &mut FaultList) {
    for &index in &judge.positions {
        let track = &judge.tracks[index];
        let noise = match grain::step(&judge.windows.kept, index) {
            Some(_) => continue,
            None => grain::noise(&judge.windows.kept, index),
        };
        let shown = draft.found.faults.iter().any(|fault| {
            fault.kind == FaultKind::CommandAsMeasurement
                && fault.channel.as_ref() == Some(&track.channel.name)
        });
        if shown || noise.is_none_or(|noise| noise > NOISELESS_SHARE_OF_RANGE * track.travel()) {
            continue;
        }
        let effect = "has neither noise nor the step of an encoder: it was filtered or computed, or it is a command, in which case a fit takes tracking errors for forces".to_owned();
        let remedy = "make sure that it is the measured position";
        draft.whole(Info, FaultKind::CommandAsMeasurement, track, effect, remedy);
    }
}
