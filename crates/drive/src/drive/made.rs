//! What was identified -> [`DriveResult`].

use cft_ident_core::number::{plus_minus, significant};

use super::blocks::BlocksAre;
use super::candidate::DriveEffect;
use super::estimate::LawEstimate;
use super::held_out::{DriveErrorsByUse, DrivePositionErrors};
use super::identify::IdentifiedDrives;
use super::law::DriveLawKind;
use super::numbers::{given, in_figures, parameter, part, step};
use super::outcome::{
    DeclaredDrive, DrivePositionError, DriveResult, DriveStep, DriveVerdict, JointPositionError,
    LogPositionError, PositionErrorsByUse, StepAmplitude, TriedEffect, VerdictKind,
};
use super::unknown::DriveUnknown;

impl DriveResult {
    /// Of what was identified.
    pub fn new(of: &IdentifiedDrives) -> Self {
        let volts = matches!(of.frame.kind, DriveLawKind::Volts(_));
        let firmware = match of.frame.kind {
            DriveLawKind::Volts(firmware) => firmware,
            DriveLawKind::Torque => Default::default(),
        };
        let drive = DeclaredDrive {
            kind: if volts { "volts" } else { "torque" }.to_owned(),
            joints: of.joints.clone(),
            supply: of.frame.supply,
            firmware_gain: firmware.gain,
            duty_max: firmware.duty_max,
            ratios: of.ratios,
            stribeck_speed: of.frame.stribeck_speed.clone(),
        };
        let mut parameters = Vec::new();
        let at = &of.found.refined;
        let reach = at.jackknife.reach();
        for (i, (unknown, value)) in at.unknowns.iter().zip(&at.values).enumerate() {
            let own = at.jackknife.std(i);
            let other = of.furthest_other(*unknown);
            // what another law says is as likely
            let std = own.map(|own| own.hypot(other.map_or(0.0, |other| other.shift)));
            let parameter = parameter(of, volts, *unknown, *value, std, reach);
            parameters.extend(parameter.map(|mut parameter| {
                let outside = |other: &FurthestOther| own.is_some_and(|s| other.shift > reach * s);
                if let Some(other) = other.filter(outside) {
                    parameter.meaning += &other.in_words(*unknown);
                }
                parameter
            }));
        }
        for (unknown, value) in &of.frame.held {
            parameters.extend(parameter(of, volts, *unknown, *value, None, reach));
        }
        let given = given(&drive, &parameters);
        let steps: Vec<DriveStep> = of.found.steps.iter().map(|s| step(of, volts, s)).collect();
        let tried = of.found.tried.iter().map(|tried| TriedEffect {
            effect: tried.effect,
            gain: part(tried.gain),
        });
        let (before, after) = (by_use(of, &of.before), by_use(of, &of.after));
        DriveResult {
            verdict: verdict(&steps, &before, &after),
            drive,
            parameters,
            given,
            steps,
            tried: tried.collect(),
            before,
            after,
            blocks: of.blocks,
            blocks_are: match of.blocks_are {
                BlocksAre::MotionsAndGains => "motions x gains",
                BlocksAre::Time => "equal times of the logs",
            }
            .to_owned(),
        }
    }

    /// Of joints that were identified one by one: what concerns a joint alone has its name.
    pub fn joined(each: &[IdentifiedDrives]) -> Option<Self> {
        let all: Vec<DriveResult> = each.iter().map(DriveResult::new).collect();
        let (first, rest) = all.split_first()?;
        if rest.is_empty() {
            return Some(first.clone());
        }
        let mut out = first.clone();
        let named = |drives: &DriveResult| {
            let joint = drives.drive.joints.first().cloned();
            let mut drives = drives.clone();
            for parameter in &mut drives.parameters {
                parameter.joint = joint.clone();
            }
            for step in &mut drives.steps {
                step.joint = joint.clone();
            }
            drives
        };
        let all: Vec<DriveResult> = all.iter().map(named).collect();
        out.drive.joints = all.iter().flat_map(|d| d.drive.joints.clone()).collect();
        out.drive.stribeck_speed = all
            .iter()
            .flat_map(|d| d.drive.stribeck_speed.clone())
            .collect();
        out.parameters = all.iter().flat_map(|d| d.parameters.clone()).collect();
        out.given = all.iter().flat_map(|d| d.given.clone()).collect();
        out.steps = all.iter().flat_map(|d| d.steps.clone()).collect();
        out.tried = Vec::new();
        out.before = joined_errors(all.iter().map(|d| &d.before).collect());
        out.after = joined_errors(all.iter().map(|d| &d.after).collect());
        out.verdict = verdict(&out.steps, &out.before, &out.after);
        Some(out)
    }
}

/// What the law that differs most says of a number.
#[derive(Clone, Copy)]
struct FurthestOther {
    effect: DriveEffect,
    value: f64,
    /// How far it is from the number that is written, in the unit of the fit.
    shift: f64,
}

impl FurthestOther {
    fn in_words(&self, unknown: DriveUnknown) -> String {
        let value = in_figures(unknown.quantity, self.value);
        format!("; {value} with {} in its place", self.effect.name())
    }
}

impl IdentifiedDrives {
    /// How far a number is from what another law says that is as likely.
    pub(super) fn shift_by_others(&self, unknown: DriveUnknown) -> f64 {
        self.furthest_other(unknown)
            .map_or(0.0, |other| other.shift)
    }

    /// Of a number of the law that is written; none where there is no other law.
    fn furthest_other(&self, unknown: DriveUnknown) -> Option<FurthestOther> {
        // a law without the number has none of it
        let of_law = |law: &LawEstimate| law.value(unknown).unwrap_or(0.0);
        let written = of_law(&self.others.written);
        let of = |(effect, law): &(DriveEffect, LawEstimate)| {
            let value = of_law(law);
            FurthestOther {
                effect: *effect,
                value,
                shift: (value - written).abs(),
            }
        };
        let all = self.others.each.iter().map(of);
        all.max_by(|a, b| a.shift.total_cmp(&b.shift))
    }
}

fn by_use(of: &IdentifiedDrives, errors: &DriveErrorsByUse) -> PositionErrorsByUse {
    let one = |errors: &DrivePositionErrors| DrivePositionError {
        mae: errors.mae(None),
        rmse: errors.rmse(None),
        score: errors.rmse(None).powi(2) * of.joints.len() as f64,
        unit: "rad".to_owned(),
        joints: (of.joints.iter().enumerate())
            .map(|(j, joint)| JointPositionError {
                joint: joint.clone(),
                mae: errors.mae(Some(j)),
                rmse: errors.rmse(Some(j)),
            })
            .collect(),
        logs: (errors.logs.iter())
            .map(|log| LogPositionError {
                name: log.name.clone(),
                number: log.number,
                mae: log.joints.iter().map(|e| e[0]).sum::<f64>() / log.joints.len() as f64,
            })
            .collect(),
    };
    PositionErrorsByUse {
        train: one(&errors.train),
        holdout: errors.holdout.as_ref().map(one),
        holdout_motion_unseen: errors.unseen.as_ref().map(one),
    }
}

/// Errors of joints that were identified one by one.
fn joined_errors(each: Vec<&PositionErrorsByUse>) -> PositionErrorsByUse {
    let joined = |of: Vec<&DrivePositionError>| {
        let first = (*of.first()?).clone();
        let n = of.len() as f64;
        // of a log in which a joint rests the others speak
        let mut by_log: Vec<Vec<&LogPositionError>> = Vec::new();
        for log in of.iter().flat_map(|errors| &errors.logs) {
            match by_log.iter_mut().find(|own| own[0].number == log.number) {
                Some(own) => own.push(log),
                None => by_log.push(vec![log]),
            }
        }
        let logs = by_log.into_iter().map(|own| LogPositionError {
            mae: own.iter().map(|log| log.mae).sum::<f64>() / own.len() as f64,
            ..own[0].clone()
        });
        Some(DrivePositionError {
            mae: of.iter().map(|e| e.mae).sum::<f64>() / n,
            rmse: (of.iter().map(|e| e.rmse * e.rmse).sum::<f64>() / n).sqrt(),
            score: of.iter().map(|e| e.score).sum(),
            joints: of.iter().flat_map(|e| e.joints.clone()).collect(),
            logs: logs.collect(),
            unit: first.unit.clone(),
        })
    };
    let some = |of: fn(&PositionErrorsByUse) -> Option<&DrivePositionError>| {
        joined(each.iter().filter_map(|e| of(e)).collect())
    };
    let train = joined(each.iter().map(|e| &e.train).collect());
    PositionErrorsByUse {
        train: train.unwrap_or_else(|| each[0].train.clone()),
        holdout: some(|e| e.holdout.as_ref()),
        holdout_motion_unseen: some(|e| e.holdout_motion_unseen.as_ref()),
    }
}

fn verdict(
    steps: &[DriveStep],
    before: &PositionErrorsByUse,
    after: &PositionErrorsByUse,
) -> DriveVerdict {
    let milli = |x: f64| format!("{:.1}", 1e3 * x);
    let (on, b, a) = match (&before.holdout, &after.holdout) {
        (Some(before), Some(after)) => ("held-out logs", before.mae, after.mae),
        _ => ("the fitted logs", before.train.mae, after.train.mae),
    };
    let written: Vec<&DriveStep> = steps.iter().filter(|s| s.written).collect();
    if written.is_empty() {
        return DriveVerdict {
            kind: VerdictKind::NothingMissing,
            text: format!(
                "No effect is sure beside gain, damping, dry friction and armature: positions of {on} are missed by {} mrad on average.",
                milli(b)
            ),
        };
    }
    let several = after.train.joints.len() > 1;
    let each = written.iter().map(|s| {
        let size = match (s.parameters.len(), s.parameters.values().next()) {
            (1, Some(amplitude)) => format!(" ({})", worded(s.effect, amplitude)),
            _ => String::new(),
        };
        let joint = s.joint.as_ref().filter(|_| several);
        let at = joint.map_or(String::new(), |joint| format!(" at {joint}"));
        // what these data do not tell apart
        let or: String = (s.alternatives.iter())
            .map(|other| format!(", or {} instead", other.words()))
            .collect();
        format!("{}{at}{size}{or}", s.effect.words())
    });
    let mut text: Vec<String> = each.collect();
    let last = text.pop().unwrap_or_default();
    let list = match text.is_empty() {
        true => last,
        false => format!("{} and {last}", text.join(", ")),
    };
    DriveVerdict {
        kind: VerdictKind::EffectsFound,
        text: format!(
            "Beside gain, damping, dry friction and armature {list}: positions of {on} are missed by {} mrad on average, {} without.",
            milli(a),
            milli(b)
        ),
    }
}

/// An amplitude in the unit that people use.
fn worded(effect: DriveEffect, amplitude: &StepAmplitude) -> String {
    let (factor, unit) = match effect {
        DriveEffect::CommandDelay | DriveEffect::LoopDelay => (1e3, "ms"),
        DriveEffect::EncoderBias => (1e3, "mrad"),
        _ => (1.0, amplitude.unit.as_str()),
    };
    let shown = match amplitude.std {
        Some(std) => plus_minus(factor * amplitude.value, factor * std),
        None => significant(factor * amplitude.value, 3),
    };
    format!("{shown} {unit}").trim_end_matches(" 1").to_owned()
}
