//! What the next motion is for: weak parameters of a model, or an effect that the logs do not distinguish from its like.

use std::collections::BTreeMap;

use super::{ExciteRun, FUNDAMENTAL_HZ};
use crate::cli::error::CliError;
use cft_ident_core::effect::entry;
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_logs::log::escape;
use cft_ident_plant::excite::information::InformationFactors;
use cft_ident_plant::excite::limits::Quantity;
use cft_ident_plant::excite::machine::{ForeseenRobot, NoiseSource};
use cft_ident_plant::excite::strokes::FrictionMemory;
use cft_ident_plant::excite::{Criterion, ExciteError, InformationBefore, usual_motion};
use cft_ident_stages::identify::RobotSetup;

/// Samples of a period of the motion that stands for a usual one.
const SAMPLES_PER_PERIOD: usize = 100;

#[derive(Debug, Clone, PartialEq)]
pub(super) enum ExciteAim {
    /// The parameters that are not identified.
    Weak,
    /// An effect of a joint with a memory, which strokes at several amplitudes separate.
    Strokes {
        joint: String,
        effect: FrictionMemory,
        width: f64,
        torque: f64,
    },
    /// An effect of a joint, which a ladder of speeds of that joint alone separates.
    Ladder {
        joint: String,
        seconds: f64,
        /// Middle part of the travel.
        part: f64,
    },
}

impl ExciteAim {
    /// `weak`, or `EFFECT:JOINT`.
    pub fn of(text: &str, file: &RobotFile, model: Option<&ModelFile>) -> Result<Self, CliError> {
        let Some((name, rest)) = text.split_once(':') else {
            let wrong = format!(
                "--for takes `weak` or EFFECT:JOINT, and not `{}`",
                escape(text)
            );
            return match text {
                "weak" => Ok(Self::Weak),
                _ => Err(CliError::usage(wrong)),
            };
        };
        let (joint, numbers) = rest.split_once(':').unwrap_or((rest, ""));
        let effect = entry(name).ok_or_else(|| {
            CliError::usage(format!("no effect is called `{}`", escape(name)))
                .hint("`diagnose` names the effects that it finds")
        })?;
        let joints = file.robot().joint_names().to_vec();
        if !joints.iter().any(|known| known == joint) {
            return Err(
                CliError::usage(format!("the robot has no joint `{}`", escape(joint)))
                    .hint(format!("its joints are {}", escape(&joints.join(", ")))),
            );
        }
        if let Some(strokes) = strokes((name, joint), numbers, model)? {
            return Ok(strokes);
        }
        match effect.ladder {
            Some(ladder) => Ok(Self::Ladder {
                joint: joint.to_owned(),
                seconds: f64::from(ladder.seconds),
                part: ladder.travel.unwrap_or(1.0),
            }),
            None => Err(CliError::input(format!(
                "no motion of {} alone separates {name} from its like",
                escape(joint)
            ))
            .hint(format!("what does: {}", effect.separate_by))),
        }
    }
}

/// The strokes for an effect with a memory: its numbers are those that are given, or those of the model.
fn strokes(
    (name, joint): (&str, &str),
    given: &str,
    model: Option<&ModelFile>,
) -> Result<Option<ExciteAim>, CliError> {
    let effect = match name {
        "backlash" => FrictionMemory::Gap,
        "presliding" => FrictionMemory::Bristle,
        _ => return Ok(None),
    };
    let mut numbers: BTreeMap<String, f64> = BTreeMap::new();
    let held = model.into_iter().flat_map(|model| &model.effects);
    let held = held.filter(|of| of.name == name && of.joint.as_deref() == Some(joint));
    for section in held {
        let values = section.parameters.iter();
        numbers.extend(values.map(|(key, p)| (key.clone(), p.value)));
    }
    for pair in given.split(',').filter(|pair| !pair.is_empty()) {
        let number = pair.split_once('=');
        let number = number.and_then(|(key, value)| Some((key, value.parse().ok()?)));
        let (key, value) = number.ok_or_else(|| {
            CliError::usage(format!("`{}` is not KEY=VALUE", escape(pair)))
                .hint("write --for backlash:JOINT:gap=0.02,c=1.5")
        })?;
        numbers.insert(key.to_owned(), value);
    }
    let number = |key: &str| numbers.get(key).copied().filter(|x| x.is_finite());
    let of = match effect {
        FrictionMemory::Gap => number("gap").zip(number("c")),
        FrictionMemory::Bristle => {
            let both = number("fc").zip(number("sigma0"));
            both.map(|(fc, sigma0)| (fc / sigma0, fc))
        }
    };
    // without its size the usual speeds of the joint alone are the best guess
    Ok(of
        .filter(|(width, torque)| *width > 0.0 && *torque != 0.0)
        .map(|(width, torque)| ExciteAim::Strokes {
            joint: joint.to_owned(),
            effect,
            width,
            torque: torque.abs(),
        }))
}

/// Frequency of the middle coordinate's swing over its positions at its speed; that of other designs at most.
pub(super) fn fundamental(machine: &ForeseenRobot) -> f64 {
    let of = |quantity, i| {
        let mut channels = machine.channels.iter();
        channels.find(move |c| c.quantity == quantity && c.index == i)
    };
    let swing = |i: usize| {
        let (position, speed) = (of(Quantity::Position, i)?, of(Quantity::Speed, i)?);
        let reach = 0.5 * (position.upper - position.lower);
        let hz = speed.upper / reach / std::f64::consts::TAU;
        (hz.is_finite() && hz > 0.0).then_some(hz)
    };
    let mut swings: Vec<f64> = (0..machine.coordinates()).filter_map(swing).collect();
    swings.sort_by(f64::total_cmp);
    let middle = swings.get(swings.len() / 2).copied();
    middle.map_or(FUNDAMENTAL_HZ, |hz| hz.min(FUNDAMENTAL_HZ))
}

/// Rate of the logs that a model was fitted to \[Hz\].
pub(super) fn rate_of_logs(model: &ModelFile) -> Option<f64> {
    let made = model.provenance.inputs.iter().filter(|log| log.made());
    let (rows, seconds) = made.fold((0.0, 0.0), |(rows, seconds), log| {
        (rows + log.samples as f64 - 1.0, seconds + log.duration_s)
    });
    let rate = rows / seconds;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// The noise of every joint as the fit of a model left it: its rows are independent at twice the cut-off.
pub(super) fn noise(model: &ModelFile, rate_hz: f64, machine: &mut ForeseenRobot) {
    let logged = RobotSetup::new("", model.robot.clone());
    let rows = (rate_hz / (2.0 * logged.settings().cutoff_hz)).max(1.0);
    let names = machine.model.robot.joint_names();
    for (noise, name) in machine.noise.iter_mut().zip(names) {
        if let Some(std) = model.residual_std.get(name).filter(|std| **std > 0.0) {
            *noise = std * rows.sqrt();
            machine.noise_source = NoiseSource::Model;
        }
    }
}

/// What a model knows, and the criterion that narrows what is weak in it.
pub(super) fn weak(
    bench: &ExciteRun,
    model: &ModelFile,
) -> Result<(InformationBefore, Criterion), CliError> {
    let (args, machine) = (bench.args, &bench.machine);
    let known = InformationBefore::of(machine, model);
    if known.weak.is_empty() {
        return Err(CliError::input(
            "every parameter of the model is identified: no motion is called for".to_owned(),
        )
        .hint("`--for EFFECT:JOINT` separates an effect; without --for a motion is designed for all parameters"));
    }
    let fundamental = std::f64::consts::TAU * bench.frequency_hz;
    let series = usual_motion(machine, fundamental, usize::from(args.harmonics));
    let usual = InformationFactors::of_period(machine, &series, SAMPLES_PER_PERIOD)
        .map_err(ExciteError::Robot)?;
    let rows = bench.rate_hz * series.period() * f64::from(args.periods);
    let factors = known.factors(machine, (&usual, rows))?;
    Ok((known, Criterion::AOptimal(factors)))
}
