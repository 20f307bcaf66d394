//! Names, units and meanings of what was identified.

use cft_ident_core::number::significant;
use cft_ident_core::verdict::{Verdict, verdict_of};

use super::identify::IdentifiedDrives;
use super::outcome::{
    DeclaredDrive, DriveParameter, DriveStep, DriveStepStatus, GainSe, GivenParameter,
    StepAmplitude,
};
use super::search::{Step, StepCertainty};
use super::unknown::{DriveQuantity, DriveUnknown};

/// Name, unit and meaning of a quantity, and the value that is shown of it with its slope.
struct ShownQuantity {
    name: &'static str,
    unit: &'static str,
    over_inertia: &'static str,
    meaning: &'static str,
}

fn shown(quantity: DriveQuantity, volts: bool) -> ShownQuantity {
    let (name, unit, over_inertia, meaning) = match quantity {
        DriveQuantity::Stiffness => (
            "stiffness",
            "N m/rad",
            "1/s^2",
            "torque per radian and unit of kp at the supply, kt V k/R",
        ),
        DriveQuantity::Damping if volts => (
            "damping",
            "N m s/rad",
            "1/s",
            "back-EMF and viscous friction, kt^2/R + Fv",
        ),
        DriveQuantity::Damping => ("viscous", "N m s/rad", "1/s", "viscous friction, Fv"),
        DriveQuantity::BackEmf => ("back_emf", "N m s/rad", "1/s", "back-EMF, kt^2/R"),
        DriveQuantity::Viscous => ("viscous", "N m s/rad", "1/s", "viscous friction, Fv"),
        DriveQuantity::Coulomb => ("coulomb", "N m", "rad/s^2", "dry friction, Fc"),
        DriveQuantity::Armature => ("armature", "kg m^2", "1", "inertia of the drive, Ja"),
        DriveQuantity::CommandDelay => ("command_delay", "s", "s", "the command comes so late, Td"),
        DriveQuantity::LoopDelay => (
            "loop_delay",
            "s",
            "s",
            "the controller acts on positions so old",
        ),
        DriveQuantity::Slowness => (
            "speed_limit",
            "rad/s",
            "rad/s",
            "largest speed of the set point",
        ),
        DriveQuantity::TorqueLimit => (
            "torque_limit",
            "N m",
            "rad/s^2",
            "largest torque of the drive",
        ),
        DriveQuantity::LoadFriction => (
            "load_friction",
            "1",
            "1",
            "dry friction per torque of the drive",
        ),
        DriveQuantity::Stribeck => ("stribeck", "N m", "rad/s^2", "dry friction more near rest"),
        DriveQuantity::Bias => (
            "encoder_bias",
            "rad",
            "rad",
            "the encoder reads the angle less this",
        ),
        DriveQuantity::Offset => ("torque_offset", "N m", "rad/s^2", "constant torque"),
    };
    ShownQuantity {
        name,
        unit,
        over_inertia,
        meaning,
    }
}

/// Whether a quantity is kept as one over what is shown.
fn inverse(quantity: DriveQuantity) -> bool {
    matches!(
        quantity,
        DriveQuantity::Slowness | DriveQuantity::TorqueLimit
    )
}

/// A number as it is shown; a limit that there is not is none.
pub(super) fn in_figures(quantity: DriveQuantity, value: f64) -> String {
    match (inverse(quantity), value > 0.0) {
        (true, true) => significant(value.recip(), 4),
        (true, false) => "none".to_owned(),
        (false, _) => significant(value, 4),
    }
}

/// ln(before / after) as the part that goes.
pub(super) fn part([gain, se]: [f64; 2]) -> GainSe {
    GainSe {
        value: 1.0 - (-gain).exp(),
        se: (-gain).exp() * se,
    }
}

pub(super) fn parameter(
    of: &IdentifiedDrives,
    volts: bool,
    unknown: DriveUnknown,
    value: f64,
    std: Option<f64>,
    reach: f64,
) -> Option<DriveParameter> {
    let shown = shown(unknown.quantity, volts);
    let mut interval = std.map(|std| [value - reach * std, value + reach * std]);
    let (mut value, mut std) = (value, std);
    let mut verdict = match std {
        Some(std) => verdict_of(value, std),
        None => Verdict::NotIdentifiable,
    };
    if inverse(unknown.quantity) {
        if value <= 0.0 {
            return None;
        }
        interval = interval.map(|[low, high]| {
            let most = if low > 0.0 { 1.0 / low } else { f64::INFINITY };
            [1.0 / high, most]
        });
        std = std.map(|std| std / (value * value));
        value = 1.0 / value;
    } else if unknown.bounds()[0] == 0.0 {
        interval = interval.map(|[low, high]| [low.max(0.0), high]);
        if value == 0.0 {
            verdict = Verdict::NotIdentifiable;
        }
    }
    Some(DriveParameter {
        name: shown.name.to_owned(),
        joint: unknown.joint.map(|j| of.joints[j].clone()),
        value,
        relative_std: std.map(|std| std / value.abs()).filter(|x| x.is_finite()),
        std,
        interval_95: interval.filter(|i| i.iter().all(|x| x.is_finite())),
        unit: if of.ratios {
            shown.over_inertia
        } else {
            shown.unit
        }
        .to_owned(),
        meaning: match of.ratios && shown.unit != shown.over_inertia {
            true => format!("{} over the inertia", shown.meaning),
            false => shown.meaning.to_owned(),
        },
        verdict,
    })
}

/// kt, R and k where what is declared leaves one value of each.
pub(super) fn given(drive: &DeclaredDrive, parameters: &[DriveParameter]) -> Vec<GivenParameter> {
    let mut out = Vec::new();
    let Some(supply) = drive.supply.filter(|_| !drive.ratios) else {
        return out;
    };
    for joint in &drive.joints {
        let find = |name: &str| {
            let mut all = parameters.iter();
            let found = all.find(|p| p.name == name && p.joint.as_ref() == Some(joint))?;
            (found.value > 0.0).then_some(found.value)
        };
        let Some(stiffness) = find("stiffness") else {
            continue;
        };
        // kt/R by the gain of the firmware, or by the largest duty
        let by_gain = drive
            .firmware_gain
            .map(|k| (stiffness / (k * supply), k, "firmware gain"));
        let by_duty = drive
            .duty_max
            .zip(find("torque_limit"))
            .map(|(duty, most)| {
                let slope = most / (duty * supply);
                (slope, stiffness / (slope * supply), "largest duty")
            });
        let Some((slope, gain, by)) = by_gain.or(by_duty) else {
            continue;
        };
        let given = match by {
            "firmware gain" => format!("{supply:.2} V and firmware gain {gain}"),
            _ => format!(
                "{supply:.2} V and largest duty {}",
                drive.duty_max.unwrap_or(1.0)
            ),
        };
        let mut add = |name: &str, value: f64, unit: &str, given: &str| {
            out.push(GivenParameter {
                name: name.to_owned(),
                joint: joint.clone(),
                value,
                unit: unit.to_owned(),
                given: given.to_owned(),
            });
        };
        if by == "largest duty" {
            add("firmware_gain", gain, "1/rad", &given);
        }
        if let Some(back_emf) = find("back_emf") {
            let kt = back_emf / slope;
            add("kt", kt, "N m/A", &given);
            add("resistance", kt / slope, "ohm", &given);
        } else if let Some(damping) = find("damping") {
            let given = format!("{given}, and no viscous friction");
            let kt = damping / slope;
            add("kt", kt, "N m/A", &given);
            add("resistance", kt / slope, "ohm", &given);
        }
    }
    out
}

pub(super) fn step(of: &IdentifiedDrives, volts: bool, step: &Step) -> DriveStep {
    let shown = shown(step.effect.quantity(), volts);
    let unit = if of.ratios {
        shown.over_inertia
    } else {
        shown.unit
    };
    let one = step.unknowns.len() == 1;
    let written = step.written();
    let parameters = step.unknowns.iter().zip(&step.values).zip(&step.stds);
    let parameters = parameters.filter_map(|((unknown, value), std)| {
        let name = match (one, unknown.joint) {
            (false, Some(j)) => of.joints[j].clone(),
            _ => shown.name.to_owned(),
        };
        // as the parameter of the same name has it
        let shift = if written {
            of.shift_by_others(*unknown)
        } else {
            0.0
        };
        let std = std.map(|std| std.hypot(shift));
        let (value, std) = match inverse(unknown.quantity) {
            true if *value <= 0.0 => return None,
            true => (1.0 / value, std.map(|std| std / (value * value))),
            false => (*value, std),
        };
        let unit = unit.to_owned();
        Some((name, StepAmplitude { value, std, unit }))
    });
    let reason = match step.status {
        StepCertainty::HeldOutWorse => Some("held-out logs get worse by it".to_owned()),
        StepCertainty::Seen if step.judged.floor.is_infinite() => Some(format!(
            "{} blocks are too few to judge: log more motions, or the same at more gains",
            of.blocks
        )),
        StepCertainty::Seen => Some("not sure enough over motions and gains".to_owned()),
        StepCertainty::Indicated if !written => {
            Some("what can be measured is written when it is confirmed".to_owned())
        }
        _ => None,
    };
    DriveStep {
        effect: step.effect,
        joint: match (one, step.unknowns[0].joint) {
            (true, Some(j)) => Some(of.joints[j].clone()),
            _ => None,
        },
        parameters: parameters.collect(),
        status: match step.status {
            StepCertainty::Confirmed => DriveStepStatus::Confirmed,
            StepCertainty::Indicated => DriveStepStatus::Indicated,
            StepCertainty::Seen | StepCertainty::HeldOutWorse => DriveStepStatus::Seen,
        },
        written,
        reason,
        deviations: step.judged.deviations,
        needed: Some(step.judged.floor.sqrt()).filter(|x| x.is_finite()),
        shrinkage: step.judged.shrinkage,
        gain: part(step.gain),
        alternatives: step.alternatives.clone(),
    }
}
