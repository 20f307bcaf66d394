//! Torques and currents that have lost their sign: never below zero while their joint turns both ways.
//!
//! Three ways lead there: the size alone is logged; a negative number is read as one that begins anew (65535 for -1),
//! alone or with another word above it; a bit of its own says the sign. The last two leap by a power of two where the
//! torque changes its sign, wherever the numbers lie.

use super::draft::FaultList;
use super::fault::FaultKind;
use super::fault::Severity::Error;
use super::judge::{ChannelTrack, LogJudge};
use super::words::ChannelRole;

/// Turns of a joint after which both directions are known.
const REVERSALS: u64 = 2;
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
    let torques = || judge.tracks.iter().filter(torque);
    let mut add = |track: &ChannelTrack, cause: &SignLoss| {
        let (effect, remedy) = words(cause, track);
        draft.whole(Error, FaultKind::UnsignedTorque, track, effect, &remedy);
    };
    let anew = |track: &ChannelTrack| track.leaps_of_words.range();
    for track in torques() {
        if let Some(counts) = anew(track) {
            add(track, &SignLoss::BeginsAnew { counts });
        }
    }
    let turned: Vec<&ChannelTrack> = torques().filter(is_turned).collect();
    // one joint that carries all the time is no fault; all of them without one change of sign are
    if !turned.iter().all(|track| one_sided(track)) {
        return;
    }
    for track in turned.into_iter().filter(|track| anew(track).is_none()) {
        let bit = track.leaps_of_words.sign_bit();
        let bit = bit.map(|counts| SignLoss::SignBit { counts });
        let size = track.dips.lost_their_sign().then_some(SignLoss::Size);
        if let Some(cause) = bit.or(size) {
            add(track, &cause);
        }
    }
}

fn one_sided(track: &ChannelTrack) -> bool {
    track.low >= 0.0 || track.high <= 0.0
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
        SignLoss::BeginsAnew { counts } => {
            let alone = track.leaps_of_words.most < *counts;
            let what = match alone {
                true => format!("negative numbers read as {counts:.0} more"),
                false => format!(
                    "numbers of {:.0} bits with another word above them, as where a PDO maps more bits than the entry has",
                    counts.log2()
                ),
            };
            (
                format!("leaps by {counts:.0} where the torque changes its sign: {what}"),
                format!(
                    "`torque_wrap = {counts:.0}` in [log.joint] of the robot file reads it as signed numbers"
                ),
            )
        }
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
