//! The sentences of notes of models that are applied.

use std::fmt::{Display, Formatter, Result};

use super::listed;
use crate::band::BeyondSeen;
use crate::note::ModelNote;
use cft_ident_core::number::{percent, significant};

/// What a motion takes up beside what was seen of it.
fn ranges(of: &BeyondSeen) -> String {
    let shown = |x: f64| significant(x, 3);
    let mut parts = Vec::new();
    for (what, beyond) in [("speeds", of.speed), ("torques", of.torque)] {
        parts.extend(
            beyond.map(|[x, seen]| {
                format!("{what} up to {}, where {} was seen", shown(x), shown(seen))
            }),
        );
    }
    parts.extend(of.positions.map(|ranges| {
        let [here, seen] = ranges.map(|ends| ends.map(shown).join(".."));
        format!("positions {here}, where {seen} was seen")
    }));
    parts.join("; ")
}

impl Display for ModelNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            // how to get a band where the model file has none
            Self::NoBand => f.write_str(
                "the model file holds no [[held_out]], so that it is not known how far its torques are off: no band; fit it again with `lsq` or `diagnose` of this version, which set blocks of their logs aside for that",
            ),
            Self::BeyondSeen(of) => write!(
                f,
                "{} leaves what the model was fitted on in {} of the samples, where its band is a guess: {}",
                of.joint,
                percent(of.share),
                ranges(of)
            ),
            Self::NoValidation { joint, error } => write!(
                f,
                "this is no validation of {joint}, whose torque is off by {} of itself: a log of another robot, unit, sign or order of joints, or a joint whose torque the model does not have (`cft-ident inspect` with the robot file looks for the former, `diagnose` for the latter)",
                percent(*error)
            ),
            Self::ImpossibleTorque { error } => f.write_str(error),
            Self::Astray { astray, windows } => write!(
                f,
                "open loop: {astray} of {windows} windows went astray: masses and inertias of a plain fit need not be those of links that can exist, and no motion follows from them; `lsq` finds links that can exist where torques are in N and Nm and --unconstrained is not given"
            ),
            Self::ErrorsOfReduced { log } => write!(
                f,
                "{log} is a reduced log: the errors of single rows (the largest, R2, those before the filter) are not known of it"
            ),
            Self::FreeRunWorse { window_s, joints } => {
                let worse = listed(joints, |(joint, rms, unit)| {
                    let [given, after] = rms.map(|x| significant(x, 3));
                    format!("{joint} from {given} to {after} {unit}")
                });
                write!(
                    f,
                    "free run: driven by the measured torques, the refined model leaves the measured positions faster than the model given (rms in windows of {} s: {worse}); take it for feed-forward and the given one to simulate",
                    significant(*window_s, 2)
                )
            }
            Self::SharedLogs { logs } => write!(
                f,
                "both models are made from {}: their errors are not independent, so differences in \
                 standard deviations are a hint and no test",
                logs.join(", ")
            ),
            Self::OtherSetup => f.write_str(
                "the models are of different set-ups; the logs are read as the first says",
            ),
            Self::OtherMapping => f.write_str(
                "the models map logs differently; the logs are read as the first says",
            ),
            Self::OtherFilter => f.write_str(
                "the models declare different filters; both are judged with that of the first",
            ),
            Self::DeclaredGains { interval } => write!(
                f,
                "the torques are currents times the gains of the robot file: the intervals of the body hold {} for those; `lsq --fit-gains LOG:mass=KG` with a weighed load makes the gains this robot's own",
                percent(*interval)
            ),
            Self::Blind {
                joint,
                threshold,
                torque,
                unit,
            } => {
                let [limit, torque] = [threshold, torque].map(|x| significant(*x, 3));
                write!(
                    f,
                    "cannot watch {joint}: an alarm takes {limit} {unit} from outside, and the greatest torque of the joint along the logs of the fit is {torque} {unit}; a better model (`diagnose`), or more --false-alarms, narrows it"
                )
            }
            Self::Extrapolated {
                per_hour,
                observed_s,
                proven_per_hour,
            } => write!(
                f,
                "{observed_s:.0} s of unloaded motion prove {proven_per_hour:.0} false alarms an hour at most, and {per_hour} is extrapolated: another motion may give more; longer logs for the fit prove more, or `--unloaded LOG`"
            ),
        }
    }
}
