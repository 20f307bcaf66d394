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
use crate::log::signed;

/// Turns of a joint after which both directions are known.
const REVERSALS: u64 = 2;
/// Bits of numbers that begin anew.
const WIDTHS: [i32; 3] = [8, 16, 32];
/// Bits that drives say a sign with.
const SIGN_BITS: [i32; 4] = [10, 11, 12, 15];
/// Part of a power of two within which a leap is one of it.
const NEAR: f64 = 0.125;

/// Leaps of whole numbers, row after row.
#[derive(Debug, Clone, Default)]
pub(crate) struct WordLeaps {
    last: Option<f64>,
    fractions: bool,
    /// For each of [`WIDTHS`]: leaps that are none between signed numbers, others of that size, and numbers in the
    /// middle, where a signed one is large.
    anew: [[u64; 3]; WIDTHS.len()],
    /// For each of [`SIGN_BITS`]: leaps by the bit, and leaps of that size at all.
    by_bit: [[u64; 2]; SIGN_BITS.len()],
    most: f64,
}

impl WordLeaps {
    /// Takes the number of a row, as its column has it.
    #[inline]
    pub(crate) fn take(&mut self, number: f64) {
        let count = number.round();
        self.fractions |= (number - count).abs() > 1e-6 * count.abs().max(1.0);
        if self.fractions {
            return;
        }
        self.most = self.most.max(count);
        let leap = self.last.replace(count).map_or(0.0, |last| count - last);
        for (bits, [anew, large, middle]) in WIDTHS.iter().zip(&mut self.anew) {
            let range = 2.0_f64.powi(*bits);
            *middle += u64::from(signed(count, range).abs() > 0.375 * range);
            if leap.abs() > range / 2.0 {
                let small = signed(leap, range).abs() < range / 4.0;
                *(if small { anew } else { large }) += 1;
            }
        }
        let low = count.min(count - leap);
        for (bits, [exact, large]) in SIGN_BITS.iter().zip(&mut self.by_bit) {
            let bit = 2.0_f64.powi(*bits);
            if leap.abs() > bit / 2.0 {
                let near = |x: f64| (0.0..=NEAR * bit).contains(&x);
                *large += 1;
                *exact += u64::from(near(low) && near(low + leap.abs() - bit));
            }
        }
    }

    /// The range after which the numbers begin anew, where they are signed ones of fewer bits than they are logged with.
    pub(crate) fn range(&self) -> Option<f64> {
        let of_width = |[anew, large, middle]: &[u64; 3]| *anew > 0 && *large == 0 && *middle == 0;
        let found = self
            .anew
            .iter()
            .position(of_width)
            .filter(|_| !self.fractions)?;
        Some(2.0_f64.powi(WIDTHS[found]))
    }

    /// The bit that says the sign of what the others are the size of.
    fn sign_bit(&self) -> Option<f64> {
        let is = |(bits, [exact, large]): (&i32, &[u64; 2])| {
            let bit = 2.0_f64.powi(*bits);
            (self.most >= bit && self.most < 2.0 * bit && *exact > 0 && 10 * exact >= 9 * large)
                .then_some(bit)
        };
        let mut all = SIGN_BITS.iter().zip(&self.by_bit);
        all.find_map(is).filter(|_| !self.fractions)
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn leaps(of: impl Fn(f64) -> f64) -> WordLeaps {
        let mut leaps = WordLeaps::default();
        (0..2000).for_each(|k| leaps.take(of((150.0 * (0.01 * f64::from(k)).sin()).round())));
        leaps
    }

    #[test]
    fn signed_numbers_of_sixteen_bits_are_found_whatever_stands_above_them() {
        let neighbour = |x: f64| 655_360.0 + x.rem_euclid(65_536.0);
        for of in [|x: f64| x.rem_euclid(65_536.0), neighbour] {
            assert_eq!(leaps(of).range(), Some(65_536.0));
        }
        assert_eq!(leaps(|x| x).range(), None);
        assert_eq!(leaps(|x| 0.1 * x.rem_euclid(65_536.0)).range(), None);
        let by_bit = leaps(|x| if x < 0.0 { 1024.0 - x } else { x });
        assert_eq!((by_bit.range(), by_bit.sign_bit()), (None, Some(1024.0)));
        assert_eq!(signed(720_890.0, 65_536.0), -6.0);
    }
}
