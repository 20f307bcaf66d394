//! Torques and currents that have lost their sign: never below zero while their joint turns both ways.
//!
//! Three ways lead there: the size alone is logged; a negative number is read as one that begins anew (65535 for -1);
//! a bit of its own says the sign. The last two leap by a power of two where the torque changes its sign.

use super::detectors::grain;
use super::draft::FaultList;
use super::fault::FaultKind;
use super::fault::Severity::Error;
use super::judge::{ChannelTrack, InspectionDepth, LogJudge};
use super::words::ChannelRole;

/// Turns of a joint after which both directions are known.
const REVERSALS: u64 = 2;
/// Bits of numbers that begin anew.
const WIDTHS: [i32; 3] = [8, 16, 32];
/// Bits that drives say a sign with.
const SIGN_BITS: [i32; 4] = [10, 11, 12, 15];
/// Part of a power of two within which a leap is one of it.
const NEAR: f64 = 0.125;

/// What makes numbers unsigned.
enum SignLoss {
    Size,
    BeginsAnew { counts: f64 },
    SignBit { counts: f64 },
}

pub(super) fn faults(judge: &LogJudge, draft: &mut FaultList) {
    let is_turned = |track: &&ChannelTrack| {
        let Some(position) = track.position.map(|index| &judge.tracks[index]) else {
            return false;
        };
        let Some(motion) = &position.excitation else {
            return false;
        };
        judge.moves(position) && motion.reversals() >= REVERSALS
    };
    let torque = |track: &&ChannelTrack| {
        let channel = &track.channel;
        channel.role == ChannelRole::Torque && !channel.commands && track.travel() > 0.0
    };
    let turned: Vec<&ChannelTrack> = judge
        .tracks
        .iter()
        .filter(torque)
        .filter(is_turned)
        .collect();
    // one joint that carries all the time is no fault; all of them without one change of sign are
    if !turned.iter().all(|track| one_sided(track)) {
        return;
    }
    for track in turned {
        let place = judge
            .tracks
            .iter()
            .position(|other| std::ptr::eq(other, track));
        let cause = match (judge.depth, place) {
            (InspectionDepth::Whole, Some(place)) => leaps(judge, place),
            _ => None,
        };
        let size = track.dips.lost_their_sign().then_some(SignLoss::Size);
        let Some(cause) = cause.or(size) else {
            continue;
        };
        let (effect, remedy) = words(&cause, track);
        draft.whole(Error, FaultKind::UnsignedTorque, track, effect, &remedy);
    }
}

fn one_sided(track: &ChannelTrack) -> bool {
    track.low >= 0.0 || track.high <= 0.0
}

/// Least and greatest size.
fn sizes(track: &ChannelTrack) -> (f64, f64) {
    let (a, b) = (track.low.abs(), track.high.abs());
    (a.min(b), a.max(b))
}

/// Whether numbers leap by a power of two where they change their sign.
fn leaps(judge: &LogJudge, place: usize) -> Option<SignLoss> {
    let step = grain::step(&judge.windows.kept, place)?;
    let counts = |x: f64| (x.abs() / step).round();
    let mut sizes = Vec::new();
    let mut far = Vec::new();
    let (_, most) = self::sizes(&judge.tracks[place]);
    for window in &judge.windows.kept {
        let column = &window.columns[place];
        sizes.extend(column.iter().map(|x| counts(*x)));
        for pair in column.windows(2) {
            far.push([counts(pair[0]), counts(pair[1])]);
        }
    }
    let of = |range: f64, near_zero: bool| {
        let leap = |pair: &&[f64; 2]| {
            let apart = (pair[0] - pair[1]).abs();
            let low = pair[0].min(pair[1]);
            apart > range / 2.0 && (!near_zero || low < NEAR * range)
        };
        far.iter().filter(leap).count()
    };
    let most = counts(most);
    for bits in WIDTHS {
        let range = 2.0_f64.powi(bits);
        let middle = |x: &f64| *x > 0.25 * range && *x < 0.75 * range;
        let inside = most < range && most > (1.0 - NEAR) * range;
        if inside && !sizes.iter().any(middle) && of(range, true) > 0 {
            return Some(SignLoss::BeginsAnew { counts: range });
        }
    }
    for bits in SIGN_BITS {
        let bit = 2.0_f64.powi(bits);
        let exact = |pair: &&[f64; 2]| {
            let low = pair[0].min(pair[1]);
            let high = pair[0].max(pair[1]) - bit;
            (0.0..=NEAR * bit).contains(&low) && (0.0..=NEAR * bit).contains(&high)
        };
        let leaps = far.iter().filter(exact).count();
        let large = far
            .iter()
            .filter(|pair| (pair[0] - pair[1]).abs() > bit / 2.0)
            .count();
        if most >= bit && most < 2.0 * bit && leaps > 0 && 10 * leaps >= 9 * large {
            return Some(SignLoss::SignBit { counts: bit });
        }
    }
    None
}

const STATIC: &str = "or hold poses and fit gravity by `cft-ident lsq --static` with `sign = \"hang\"` in [log], which takes the sign from the side on which a joint hangs off its command";

fn words(cause: &SignLoss, track: &ChannelTrack) -> (String, String) {
    let turns = "though the joint turns both ways";
    match cause {
        SignLoss::Size => (
            format!(
                "is never {} zero {turns}: it holds the size of the torque without its sign, and nothing can be fitted to it",
                if track.low >= 0.0 { "below" } else { "above" }
            ),
            format!(
                "log the signed channel of the drive\nor take the position error times the stiffness of the controller, where its gain is known: `torque = {{ pd = [kp, kd], command = \"..\" }}` in [log]\n{STATIC}"
            ),
        ),
        SignLoss::BeginsAnew { counts } => (
            format!("is never below zero {turns}: negative numbers read as {counts:.0} more"),
            format!(
                "read it as signed numbers: take {counts:.0} off those above {:.0}, and log it so\n{STATIC}",
                counts / 2.0 - 1.0
            ),
        ),
        SignLoss::SignBit { counts } => (
            format!(
                "leaps by {counts:.0} at every change of sign: bit {:.0} is the sign, and the rest the size",
                counts.log2()
            ),
            format!(
                "read it as signed numbers: where a number is {counts:.0} or more, it is -(number - {counts:.0}), and log it so\n{STATIC}"
            ),
        ),
    }
}
