//! The sentences of notes: of logs, set-ups, friction and robots over time here, of fits and models in the folder.

mod fit;
mod model;

use std::fmt::{Display, Formatter, Result};

use super::{FrictionNote, LogNote, NumberWithStd, RowLoss, SetupNote, StageNote, TrackNote};
use crate::setup::{FoundTorqueLimit, FrictionPower};
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::number::{clock, percent, significant};

/// Plateaus that a sentence names.
const NAMED_PLATEAUS: usize = 4;
/// Skipped stretches that a sentence names.
const NAMED_STRETCHES: usize = 3;

/// What `of` says of each, with commas between.
fn listed<T>(each: &[T], of: impl Fn(&T) -> String) -> String {
    each.iter().map(of).collect::<Vec<_>>().join(", ")
}

impl Display for StageNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::OfReader(text) | Self::OfRobotFile(text) | Self::OfReducedLog(text) => {
                f.write_str(text)
            }
            Self::Log(note) => note.fmt(f),
            Self::Setup(note) => note.fmt(f),
            Self::Friction { joint, note } => write!(f, "{joint}: {note}"),
            Self::Fit(note) => note.fmt(f),
            Self::Model(note) => note.fmt(f),
            Self::Track { robot, note } => write!(f, "{robot}: {note}"),
        }
    }
}

impl Display for LogNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::Marked { log, sentence } => write!(f, "{log}: {sentence}"),
            Self::RowsLost {
                log,
                rows,
                left_out,
                losses,
            } => {
                let causes = listed(losses, RowLoss::to_string);
                let shown = match left_out {
                    0 => format!("none of {rows} rows is left out in all"),
                    removed => format!(
                        "{removed} of {rows} rows are left out in all, those next to bad ones included"
                    ),
                };
                write!(f, "{log}: {shown}: {causes}; see `cft-ident inspect`")
            }
            Self::VelocityScale { log, joints, alike } => {
                let each = listed(joints, |(j, x)| format!("{j} {}", significant(*x, 3)));
                let cause = match (alike, joints.first()) {
                    (true, Some((_, factor))) => format!(
                        "all by one factor: the clock of the log runs at {} of its rate (`time_unit` in [log], or the rate), or the unit of the velocities is another",
                        significant(factor.recip(), 3)
                    ),
                    _ => "its unit, sign or gear, or its joint, is another; give it in [log.joint.NAME]"
                        .to_owned(),
                };
                write!(
                    f,
                    "{log}: velocity columns are so many times the derivative of the positions: {each}; {cause}"
                )
            }
            Self::TooShort {
                log,
                stretches,
                samples,
                spans,
            } => {
                let named = &spans[..spans.len().min(NAMED_STRETCHES)];
                let spans = listed(named, |[a, b]| format!("{}..{} s", clock(*a), clock(*b)));
                let stretches = match stretches {
                    1 => "1 stretch".to_owned(),
                    many => format!("{many} stretches"),
                };
                write!(
                    f,
                    "{log}: {stretches} between gaps, too short to filter, left out ({samples} samples; {spans})"
                )
            }
            Self::Gaps { log, stretches } => write!(
                f,
                "{log}: gaps part it into {stretches} stretches; nothing is differentiated across them"
            ),
            Self::UnevenClock {
                log,
                samples,
                interpolated,
            } => write!(
                f,
                "{log}: the clock is uneven; its {samples} samples were resampled to an even one, with {interpolated} points interpolated"
            ),
            Self::NoTemperature { why } => {
                write!(f, "{why}; no temperature of this log is used")
            }
            Self::Repeated { first, second } => write!(
                f,
                "{second} holds rows that {first} holds: they count twice"
            ),
        }
    }
}

impl Display for RowLoss {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::Marked(cost) => f.write_str(&cost.text()),
            Self::Dropped(rows, kind) => write!(f, "{rows} {kind}"),
            Self::TooShort(rows) => write!(f, "{rows} in stretches too short to filter"),
        }
    }
}

impl Display for SetupNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::Likely(finding) => write!(
                f,
                "the set-up may be wrong: {}; the set-up as declared is possible too, and the fit goes on with it",
                finding.in_words()
            ),
            Self::PutRight { file, finding } => {
                write!(f, "put right in {file}: {}", finding.in_words())
            }
            Self::FrictionPower(of) => of.fmt(f),
            Self::TorqueLimit(of) => of.fmt(f),
        }
    }
}

impl Display for FrictionPower {
    fn fmt(&self, f: &mut Formatter) -> Result {
        let watts = |x: f64| match x.abs() < 0.01 {
            true => format!("{x:.2e}"),
            false => format!("{x:.3}"),
        };
        write!(
            f,
            "the friction of {} would drive it: its terms together take {} +- {} {} over the speeds of these logs, where friction takes power above zero; {}",
            self.joint,
            watts(self.power),
            watts(self.std),
            self.unit,
            self.cause
        )
    }
}

impl Display for FoundTorqueLimit {
    fn fmt(&self, f: &mut Formatter) -> Result {
        let limit = significant(self.limit, 3);
        let [with, without] = self.errors.map(percent);
        write!(
            f,
            "saturation of {joint}: above {limit} {} it does not move as its torque says ({} of the rows): the drive gives no more, or something holds the joint. These rows are left out (error {with} with them, {without} without; `torque_limit = {limit}` in [log.joint.{joint}]); if that is wrong: --as-declared",
            self.unit,
            percent(self.share),
            joint = self.joint,
        )
    }
}

impl Display for FrictionNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::NotConverged(ending) => {
                let how = match ending {
                    IterationEnding::IterationLimit => "at the limit of iterations",
                    _ => "it diverged",
                };
                write!(
                    f,
                    "the search ended without converging ({how}): none of its parameters is identified"
                )
            }
            Self::Drives { speed } => write!(
                f,
                "at a speed of {} the friction law drives the joint, which no friction does: do not use it there",
                significant(*speed, 2)
            ),
            Self::NisAbove {
                mean,
                bounds: [low, high],
            } => write!(
                f,
                "mean NIS {mean:.2} is above its bounds {low:.2}..{high:.2}: the innovations are alike for many samples, so something acts that the model lacks"
            ),
            Self::NisBelow {
                mean,
                bounds: [low, high],
            } => write!(
                f,
                "mean NIS {mean:.2} is below its bounds {low:.2}..{high:.2}: innovations cancel over many samples, as where positions are finer than the encoder's step^2/12 or were filtered before they were logged"
            ),
            Self::Coloured { factor } => write!(
                f,
                "the innovations are coloured, so the model lacks something; the standard deviations hold a factor {factor:.1} for it"
            ),
            Self::OneCoulombTerm => f.write_str(
                "one Coulomb term does; coulomb_2 and slope_2 are not determined, for a second term makes \
                 these data no likelier",
            ),
            Self::TermsCancel {
                coulomb,
                uncertainty,
            } => {
                let [first, second] = coulomb.map(|x| significant(x, 3));
                write!(
                    f,
                    "coulomb_1 {first} and coulomb_2 {second} cancel, for their slopes are hardly apart: use the friction \
                     curve, which is known to {}, and none of the two by itself",
                    percent(*uncertainty)
                )
            }
            Self::MissedPlateaus(missed) => {
                let named = &missed[..missed.len().min(NAMED_PLATEAUS)];
                let worst = listed(named, |m| {
                    format!(
                        "{} at {} (curve {})",
                        significant(m.torque, 3),
                        significant(m.v, 2),
                        significant(m.curve, 3)
                    )
                });
                let more = match missed.len() - named.len() {
                    0 => String::new(),
                    n => format!(" and {n} more speeds"),
                };
                write!(
                    f,
                    "the friction curve misses the mean torque at constant speed: {worst}{more}; do not use it at these \
                     speeds: the law cannot follow this joint there, its friction depends on more than speed, or it \
                     changed between the logs"
                )
            }
            Self::LowerBound { parameter, above } => write!(
                f,
                "{parameter} is only known to be above {} (95 %): these data do not pass slowly enough through zero speed to bound it from above",
                significant(*above, 3)
            ),
            Self::NotDetermined { parameter } => write!(
                f,
                "these data cannot determine {parameter}; log slower reversals and more speeds"
            ),
            Self::Contradicted { moved } => {
                let number = |n: &NumberWithStd| {
                    format!("{} ± {}", significant(n.value, 4), significant(n.std, 2))
                };
                let moved = listed(moved, |(name, [before, after], unit)| {
                    let unit = format!(" {unit}");
                    let (before, after) = (number(before), number(after));
                    format!("{name} {before} before, {after}{} here", unit.trim_end())
                });
                write!(
                    f,
                    "these logs contradict its friction by more than three deviations: {moved}; they alone tell it in this \
                     fit: log the joint alone at all speeds at which it is used"
                )
            }
            Self::FasterThanLogged {
                speed,
                logged,
                unit,
                uncertain,
            } => {
                let [speed, logged] = [speed, logged].map(|x| significant(*x, 3));
                let described = match uncertain {
                    true => "cannot be told from these logs",
                    // its deviation is that of the law, which nobody has seen there
                    false => "is continued by its law",
                };
                write!(
                    f,
                    "moves at up to {speed} {unit}/s, but its one-joint logs at up to {logged}; its friction beyond {described}: log the joint alone as fast as it is used"
                )
            }
        }
    }
}

impl Display for TrackNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        let numbered = "they are taken in the order in which they are given, and their numbers stand for times";
        match self {
            Self::OneLog { log } => write!(f, "one log, {log}: there is no course to follow"),
            Self::NoTimes => write!(f, "models have no time of their own: {numbered}"),
            Self::ClocksOverlap => write!(f, "the clocks of these logs overlap: {numbered}"),
            Self::OutOfOrder => f.write_str(
                "the logs are given out of order; they are followed in order of their clocks",
            ),
            Self::ClockJump {
                by_s,
                between: [before, after],
                steps,
            } => write!(
                f,
                "the clock jumps by {by_s:.0} s between {before} and {after}, {steps} times the usual time between logs or more; if it was set there, give numbers of seconds that run on"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::note::{FitNote, ModelNote};
    use cft_ident_core::friction::plateau::MissedPlateau;

    #[test]
    fn a_note_is_a_sentence_without_a_full_stop_that_names_its_numbers() {
        let [log, joint] = ["day.csv", "q4"].map(str::to_owned);
        let number = |value, std| NumberWithStd { value, std };
        let of_joint = |note| StageNote::Friction {
            joint: joint.clone(),
            note,
        };
        let missed = |v| MissedPlateau {
            v,
            torque: 2.5,
            curve: 2.0,
        };
        let spans = vec![[0.0, 0.125]; 5];
        let cases = [
            (
                StageNote::Log(LogNote::RowsLost {
                    log: log.clone(),
                    rows: 900,
                    left_out: 0,
                    losses: vec![RowLoss::Dropped(7, "sample-and-hold"), RowLoss::TooShort(3)],
                }),
                "day.csv: none of 900 rows is left out in all: 7 sample-and-hold, 3 in stretches too short to filter; see `cft-ident inspect`",
            ),
            (
                StageNote::Log(LogNote::TooShort {
                    log: log.clone(),
                    stretches: 5,
                    samples: 600,
                    spans,
                }),
                "day.csv: 5 stretches between gaps, too short to filter, left out (600 samples; 0.000..0.125 s, 0.000..0.125 s, 0.000..0.125 s)",
            ),
            (
                of_joint(FrictionNote::MissedPlateaus(
                    (1..7).map(|v| missed(f64::from(v))).collect(),
                )),
                "q4: the friction curve misses the mean torque at constant speed: 2.50 at 1.0 (curve 2.00), 2.50 at 2.0 (curve 2.00), \
                 2.50 at 3.0 (curve 2.00), 2.50 at 4.0 (curve 2.00) and 2 more speeds; do not use it at these speeds: the law cannot \
                 follow this joint there, its friction depends on more than speed, or it changed between the logs",
            ),
            (
                StageNote::Fit(FitNote::BelowZero {
                    unknowns: vec![("coulomb:q4".to_owned(), number(-0.5, 0.1), "Nm".to_owned())],
                }),
                "the fit is unphysical, friction or inertia below zero: coulomb:q4 -0.50 +- 0.10 Nm; a torque is missing or a gain is wrong (`diagnose` looks for it), or the motion does not separate these parameters",
            ),
            (
                StageNote::Model(ModelNote::ErrorsOfReduced { log }),
                "day.csv is a reduced log: the errors of single rows (the largest, R2, those before the filter) are not known of it",
            ),
        ];
        for (note, sentence) in cases {
            let text = note.to_string();
            assert_eq!(text, sentence);
            assert!(!text.ends_with('.'), "{text}");
        }
    }
}
