//! What is wrong with a log before anything is fitted.

use super::error::DriveError;
use super::track::{DriveLog, JointTrack};

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
struct CheckNumbers {
    /// A command or a joint that moves less than this stands still [rad]. Half: the last bit of an encoder is a motion;
    /// twice: slow motions of a hobby servo are none.
    still: f64,
    /// No joint turns further in a log [rad]. Half: a wheel is refused; twice: small motions in degrees pass.
    turns: f64,
    /// The ratio of ways of command and position from which on units differ. Half: a weak drive is refused; twice: a
    /// command in degrees of a joint that hardly follows passes.
    ratio: f64,
    /// A joint is at a stop where it stands at its end while the command goes on by this part of its way. Half: dry
    /// friction is a stop; twice: a stop is none.
    stop: f64,
}

const NUMBERS: CheckNumbers = CheckNumbers {
    still: 2e-3,
    turns: 40.0,
    ratio: 8.0,
    stop: 0.15,
};

const TO_RADIANS: &str = "multiply positions and commands by pi/180";
const FROM_TICKS: &str =
    "convert both: (ticks - zero) * 2 pi / ticks of a turn, 4096 for most serial bus servos";
const FROM_PERCENT: &str = "convert both to radians by the calibration of the arm: -100..100 is the calibrated range of the joint";

fn range(x: &[f64]) -> [f64; 2] {
    let low = x.iter().copied().fold(f64::INFINITY, f64::min);
    [low, x.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

/// Refuses what no drive can be read from, and adds what a person should know to the log's findings. A joint that rests
/// beside others that move is marked.
pub fn check(log: &mut DriveLog) -> Result<(), DriveError> {
    let mut findings = Vec::new();
    let mut resting = None;
    for track in &mut log.joints {
        match one(&log.name, track) {
            Err(rests @ (DriveError::CommandAtRest { .. } | DriveError::PositionAtRest { .. })) => {
                track.rests = true;
                resting.get_or_insert(rests);
            }
            found => findings.extend(found?),
        }
    }
    match resting {
        Some(rests) if log.joints.iter().all(|track| track.rests) => return Err(rests),
        _ => {}
    }
    let still = log.joints.iter().filter(|track| track.rests);
    findings.extend(still.map(|track| {
        format!(
            "{}: stands still, so this log says nothing of its drive",
            track.joint
        )
    }));
    log.findings.extend(findings);
    Ok(())
}

fn one(file: &str, track: &JointTrack) -> Result<Vec<String>, DriveError> {
    let (file, joint) = (file.to_owned(), track.joint.clone());
    let ([q0, q1], [c0, c1]) = (range(&track.position), range(&track.command));
    let (moved, asked) = (q1 - q0, c1 - c0);
    let largest = q0.abs().max(q1.abs());
    if moved > 2.0 * NUMBERS.turns || largest > NUMBERS.turns {
        let whole = track.position.iter().all(|q| q.fract() == 0.0);
        let seen = format!("from {q0} to {q1}");
        let (unit, remedy) = match whole {
            true => ("ticks of an encoder", FROM_TICKS),
            false if largest <= 100.0 => ("degrees, or -100..100", FROM_PERCENT),
            false => ("degrees", TO_RADIANS),
        };
        return Err(DriveError::Unit {
            file,
            joint,
            seen,
            unit,
            remedy,
        });
    }
    if asked < NUMBERS.still {
        return Err(DriveError::CommandAtRest { file, joint });
    }
    if moved < NUMBERS.still {
        return Err(DriveError::PositionAtRest { file, joint });
    }
    let ratio = asked / moved;
    if !(1.0 / NUMBERS.ratio..=NUMBERS.ratio).contains(&ratio) {
        let ratio = format!("{ratio:.3}");
        return Err(DriveError::OtherUnit { file, joint, ratio });
    }
    Ok(stops(track, [q0, q1]))
}

/// Ends at which the joint stands while the command goes on.
fn stops(track: &JointTrack, ends: [f64; 2]) -> Vec<String> {
    let moved = ends[1] - ends[0];
    let mut out = Vec::new();
    for (end, side) in ends.into_iter().zip([-1.0, 1.0]) {
        let there = |k: &usize| {
            let on = track.on.get(*k).copied().unwrap_or(true);
            on && (track.position[*k] - end).abs() < 1e-3 * moved
        };
        let rows: Vec<usize> = (0..track.position.len()).filter(there).collect();
        let beyond = rows.iter().map(|k| side * (track.command[*k] - end));
        let [low, high] = range(&beyond.collect::<Vec<f64>>());
        if rows.len() > 5 && low > 0.0 && high - low > NUMBERS.stop * moved {
            out.push(format!(
                "{}: stands at {end:.4} rad in {} rows while the command goes on by {:.3} rad: a stop? Log a motion that keeps away from it",
                track.joint,
                rows.len(),
                high - low
            ));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::track::{CommandIs, DriveLoad};

    fn log(position: impl Fn(f64) -> f64, command: impl Fn(f64) -> f64) -> DriveLog {
        let t: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        DriveLog {
            number: 0,
            name: "a.json".to_owned(),
            motion: "m".to_owned(),
            facts: Vec::new(),
            command_is: CommandIs::Held,
            joints: vec![JointTrack {
                joint: "servo".to_owned(),
                command: t.iter().map(|t| command(*t)).collect(),
                position: t.iter().map(|t| position(*t)).collect(),
                kp: 16.0,
                ..JointTrack::default()
            }],
            t,
            load: DriveLoad::Unknown,
            findings: Vec::new(),
        }
    }

    #[test]
    fn each_thing_that_is_wrong_has_a_message_of_its_own() {
        let sine = |t: f64| (3.0 * t).sin();
        for (mut log, expected) in [
            (log(sine, |_| 0.3), "the command never moves"),
            (log(|_| 0.3, sine), "the position never moves"),
            (log(|t| (2048.0 + 900.0 * sine(t)).round(), sine), "ticks"),
            (log(|t| 130.5 * sine(t), |t| 131.0 * sine(t)), "degrees"),
            (log(|t| 92.5 * sine(t), |t| 93.0 * sine(t)), "-100..100"),
            (log(sine, |t| 57.3 * sine(t)), "another unit"),
        ] {
            let error = check(&mut log).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert_eq!(check(&mut log(sine, sine)), Ok(()));
    }

    #[test]
    fn a_stop_is_told_and_a_lag_is_not() {
        let sine = |t: f64| (3.0 * t).sin();
        let mut at_stop = log(|t| sine(t).min(0.5), sine);
        check(&mut at_stop).unwrap();
        assert!(
            at_stop.findings[0].contains("a stop?"),
            "{:?}",
            at_stop.findings
        );
        let mut late = log(|t| 0.9 * sine(t - 0.05), sine);
        check(&mut late).unwrap();
        assert!(late.findings.is_empty(), "{:?}", late.findings);
    }

    #[test]
    fn a_joint_that_rests_beside_one_that_moves_is_marked_and_refuses_nothing() {
        let sine = |t: f64| (2.0 * t).sin();
        let mut two = log(sine, sine);
        let still = log(|_| 0.3, |_| 0.3).joints.remove(0);
        two.joints.push(JointTrack {
            joint: "wrist".to_owned(),
            ..still
        });
        check(&mut two).unwrap();
        let rests: Vec<bool> = two.joints.iter().map(|track| track.rests).collect();
        assert_eq!(rests, [false, true]);
        assert!(
            two.findings
                .iter()
                .any(|f| f.starts_with("wrist: stands still"))
        );
    }
}
