//! Gains of the torque channels from logs without and with a known payload.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::gain_error::GainError;
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::input::lsq_rows::{LsqRows, PositionReading};
use crate::input::robot_setup::RobotSetup;
use crate::input::setup_file::differences;
use crate::input::unknowns::columns;
use crate::note::{FitNote, StageNote};
use crate::setup::{ChannelKind, Finding, FindingKind, Setting};
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::gains::{self, GainFit, GainRows, PayloadColumns};
use cft_ident_core::number;
use cft_ident_core::verdict::{Verdict, verdict_of};
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::correction::KeyEdit;
use cft_ident_logs::log::{Provenance, TorqueUnit};

/// The command of a model whose gains were fitted by a known load.
pub(crate) const LSQ_WITH_GAINS: &str = "lsq --fit-gains";

/// A log in which the last link carries a payload.
#[derive(Debug, Clone)]
pub struct PayloadLog {
    pub log: Log,
    /// Its mass \[kg\].
    pub mass: f64,
    /// Standard deviation of that \[kg\]; 0 where it is taken as exact.
    pub std: f64,
}

/// Gain of one joint's torque channel.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Gain {
    pub joint: String,
    /// Torque at the joint per unit of the channel \[unit\]; without a payload its ratio to that of
    /// another joint.
    pub value: f64,
    /// Its standard deviation \[unit\].
    pub std: f64,
    /// "Nm/A" and the like; "1" for a ratio.
    pub unit: String,
    pub verdict: Verdict,
}

/// The gains of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct CurrentGains {
    pub joints: Vec<Gain>,
    /// Joint whose gain is 1 where only ratios could be reported.
    pub reference: Option<String>,
    /// Covariance of the logarithms of the gains, n x n.
    pub(crate) covariance: DMatrix<f64>,
    /// The log with the payload.
    pub inputs: Vec<Provenance>,
    pub notes: Vec<StageNote>,
}

/// The gains, and the robot with them.
#[derive(Debug, Clone)]
pub struct FittedGains {
    pub gains: CurrentGains,
    /// The robot, its file with the gains as `torque_scale`.
    pub setup: RobotSetup,
    /// What differs in its file.
    pub edits: Vec<KeyEdit>,
    /// Factors by which the channels were multiplied.
    factors: Vec<f64>,
}

impl FittedGains {
    /// The data as the robot with the gains reads them: what is in memory is multiplied by them, a file is read by them.
    ///
    /// # Errors
    /// Arrays of another robot, and logs that cannot be read by them.
    pub fn data(&self, data: &Dataset, control: &Control) -> Result<Dataset, IdentifyError> {
        let scaled = |logs: &[LogData]| -> Result<Vec<LogData>, IdentifyError> {
            let logs = logs
                .iter()
                .map(|log| log.source.with_torques_times(&self.factors));
            let logs = logs.collect::<Result<Vec<Log>, _>>()?;
            LogData::read_all(&self.setup, &logs, &[], control)
        };
        Ok(Dataset {
            setup: self.setup.clone(),
            logs: scaled(&data.logs)?,
            one_joint: scaled(&data.one_joint)?,
            held_out: scaled(&data.held_out)?,
            reduced: Vec::new(),
        })
    }
}

/// Fits the gains of all joints: from `logs` without a payload and one with a known one; without that
/// their ratios.
///
/// # Errors
/// [`GainError`] where the data do not fix them, and logs that cannot be used.
pub fn fit_gains(
    data: &Dataset,
    payload: Option<&PayloadLog>,
    control: &Control,
) -> Result<FittedGains, IdentifyError> {
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    data.check_rows()?;
    usable(setup, payload)?;
    let shape = payload
        .map(|_| PayloadColumns::of(&setup.robot))
        .transpose()?;
    if shape.as_ref().is_some_and(|shape| !shape.shows_mass()) {
        return Err(GainError::MassHidden.into());
    }
    let loaded: Vec<Log> = payload.iter().map(|p| p.log.clone()).collect();
    let loaded = LogData::read_all(setup, &loaded, &[logs], control)?;
    let mut columns = columns(setup, None);
    columns.rest_at(setup.rest_speeds(&[logs, &loaded].concat())?);
    let mut reading = LoadReadings {
        unloaded: LsqRows::as_declared(setup, logs, control),
        loaded: LsqRows::as_declared(setup, &loaded, control),
        columns,
        payload: shape,
    };
    let fit = reading.fit(PositionReading::Declared)?;
    let narrow = reading.fit(PositionReading::Narrower)?;
    let relative = covariance(&fit, &narrow, payload);
    judged(setup, &fit, &relative, payload)?;
    let n = setup.robot.joints();
    let factors: Vec<f64> = (0..n).map(|j| factor(setup, &fit, payload, j)).collect();
    let scaled = with_gains(setup, &factors, payload.is_none());
    let joints = setup.robot.joint_names().iter().enumerate();
    let gain = |(j, joint): (usize, &String)| {
        let value = factors[j] * declared(setup, j);
        let std = value.abs() * relative[(j, j)].sqrt();
        Gain {
            joint: joint.clone(),
            value,
            std,
            unit: unit(setup, j, payload.is_none()),
            verdict: verdict_of(value, std),
        }
    };
    let reference = fit.reference.map(|j| setup.robot.joint_names()[j].clone());
    Ok(FittedGains {
        gains: CurrentGains {
            joints: joints.map(gain).collect(),
            notes: notes(&fit, reference.as_deref(), reading.loaded.notes()),
            reference,
            covariance: relative,
            inputs: reading.loaded.inputs(),
        },
        edits: edits(&scaled.file, &setup.file),
        setup: scaled,
        factors,
    })
}

/// The two sets of logs, read once for each processing.
struct LoadReadings<'a> {
    unloaded: LsqRows<'a>,
    loaded: LsqRows<'a>,
    columns: RegressorColumns,
    payload: Option<PayloadColumns>,
}

impl LoadReadings<'_> {
    fn fit(&mut self, reading: PositionReading) -> Result<GainFit, IdentifyError> {
        let unloaded = self.unloaded.fold(reading, &self.columns, None)?;
        let loaded = match &self.payload {
            Some(payload) => Some((self.loaded.fold(reading, &self.columns, None)?, payload)),
            None => None,
        };
        Ok(gains::fit_gains(&GainRows {
            unloaded: &unloaded,
            loaded: loaded
                .as_ref()
                .map(|(factors, payload)| (factors, *payload)),
        })?)
    }
}

/// Whether gains can be fitted for this robot and payload at all.
fn usable(setup: &RobotSetup, payload: Option<&PayloadLog>) -> Result<(), GainError> {
    let not_by_joint = |why| {
        Err(GainError::NotByJoint {
            robot: cft_ident_logs::log::escape(&setup.name),
            why,
        })
    };
    if setup.robot.transmission().coordinates().is_some() {
        return not_by_joint(
            "the motors of this robot move no single joint, and their gains are known",
        );
    }
    if !setup.file.log.gears.is_empty() {
        return not_by_joint("`gears` makes each joint's torque of several motors");
    }
    match payload {
        Some(PayloadLog { mass, std, .. })
            if !(*mass > 0.0 && mass.is_finite() && *std >= 0.0 && std.is_finite()) =>
        {
            Err(GainError::Mass {
                mass: *mass,
                std: *std,
            })
        }
        _ => Ok(()),
    }
}

/// Covariance of the gains' logarithms: noise, what a narrower position filter moves, and the mass in common.
fn covariance(fit: &GainFit, narrow: &GainFit, payload: Option<&PayloadLog>) -> DMatrix<f64> {
    let of = |fit: &GainFit, j: usize| match fit.reference {
        Some(reference) => (fit.channel[j] / fit.channel[reference]).abs().ln(),
        None => fit.channel[j].abs().ln(),
    };
    let n = fit.channel.len();
    let narrow = GainFit {
        reference: fit.reference,
        ..narrow.clone()
    };
    let moved: Vec<f64> = (0..n).map(|j| of(&narrow, j) - of(fit, j)).collect();
    let mass = payload.map_or(0.0, |p| p.std / p.mass);
    DMatrix::from_fn(n, n, |a, b| {
        let moved = moved[a] * moved[b];
        fit.covariance[(a, b)] + mass * mass + if moved.is_finite() { moved } else { 0.0 }
    })
}

/// Factor that the channel of joint j lacks: to a torque, or to the unit of the reference's channel.
fn factor(setup: &RobotSetup, fit: &GainFit, payload: Option<&PayloadLog>, j: usize) -> f64 {
    match (payload, fit.reference) {
        (Some(payload), _) => payload.mass / fit.channel[j],
        (None, Some(reference)) => {
            fit.channel[reference] / fit.channel[j] / declared(setup, reference)
        }
        (None, None) => 1.0,
    }
}

/// Two deviations: what lies within them of zero shows nothing.
const MAX_RELATIVE_STD: f64 = 0.5;

/// Whether the logs fix the gains, with the sign that is declared.
fn judged(
    setup: &RobotSetup,
    fit: &GainFit,
    relative: &DMatrix<f64>,
    payload: Option<&PayloadLog>,
) -> Result<(), GainError> {
    let names = setup.robot.joint_names();
    let n = names.len();
    let spread = |j: usize| relative[(j, j)].sqrt();
    let open: Vec<usize> = (0..n)
        .filter(|&j| !(fit.determined[j] && spread(j) <= MAX_RELATIVE_STD))
        .collect();
    let listed = |joints: &[usize]| {
        let names: Vec<&str> = joints.iter().map(|j| names[*j].as_str()).collect();
        names.join(", ")
    };
    let shown = |joints: &[usize], of: &dyn Fn(usize) -> f64| {
        let each = joints.iter().filter(|j| fit.determined[**j]).map(|&j| {
            let (value, std) = number::value_and_std(of(j), of(j).abs() * spread(j));
            format!("{} {value} +- {std}", names[j])
        });
        each.collect::<Vec<_>>().join(", ")
    };
    let in_brackets = |text: String| match text.is_empty() {
        true => text,
        false => format!(" ({text})"),
    };
    let Some(payload) = payload else {
        let reference = fit.reference.unwrap_or(0);
        let ratio = |j: usize| factor(setup, fit, None, j) * declared(setup, j);
        if !open.is_empty() || n < 2 {
            let joints = if open.is_empty() { vec![0] } else { open };
            return Err(GainError::RatioUndetermined {
                found: in_brackets(shown(&joints, &ratio)),
                joints: listed(&joints),
                reference: names[reference].clone(),
            });
        }
        let negative: Vec<usize> = (0..n).filter(|&j| ratio(j) < 0.0).collect();
        return match negative.is_empty() {
            true => Ok(()),
            false => Err(GainError::Negative {
                found: shown(&negative, &ratio),
                joints: listed(&negative),
            }),
        };
    };
    let log = cft_ident_logs::log::escape(&payload.log.name());
    if open.len() == n && fit.determined.iter().any(|d| *d) {
        let all: Vec<usize> = (0..n).collect();
        return Err(GainError::NoLoad {
            log,
            joints: shown(&all, &|j| fit.channel[j]),
        });
    }
    let gain = |j: usize| factor(setup, fit, Some(payload), j) * declared(setup, j);
    if !open.is_empty() {
        return Err(GainError::Undetermined {
            found: in_brackets(shown(&open, &gain)),
            joints: listed(&open),
        });
    }
    let negative: Vec<usize> = (0..n).filter(|&j| fit.channel[j] < 0.0).collect();
    if negative.len() == n {
        return Err(GainError::Exchanged { log });
    }
    match negative.is_empty() {
        true => Ok(()),
        false => Err(GainError::Negative {
            found: shown(&negative, &gain),
            joints: listed(&negative),
        }),
    }
}

/// Torque per unit of the channel that the robot file gives already; 1 where it gives none.
fn declared(setup: &RobotSetup, j: usize) -> f64 {
    let name = &setup.robot.joint_names()[j];
    let channels = setup.file.log.joint.get(name);
    channels.and_then(|c| c.torque_scale).unwrap_or(1.0)
}

/// Unit of a gain.
fn unit(setup: &RobotSetup, j: usize, ratio: bool) -> String {
    if ratio {
        return "1".to_owned();
    }
    let torque = setup.robot.joint_unit(j);
    let name = &setup.robot.joint_names()[j];
    let channels = setup.file.log.joint.get(name);
    match channels
        .and_then(|c| c.torque_unit)
        .map(TorqueUnit::kept_label)
    {
        Some(channel) if channel != torque => format!("{torque}/{channel}"),
        _ => "1".to_owned(),
    }
}

/// The robot with the gains in its file.
fn with_gains(setup: &RobotSetup, factors: &[f64], relative: bool) -> RobotSetup {
    let mut file = setup.file.clone();
    for (j, name) in setup.robot.joint_names().iter().enumerate() {
        let channels = file.log.joint.entry(name.clone()).or_default();
        channels.torque_scale = Some(factors[j] * channels.torque_scale.unwrap_or(1.0));
        // it is added in the unit that the scale leads to
        channels.torque_offset = channels.torque_offset.map(|offset| offset * factors[j]);
    }
    file.log.relative_gains = relative;
    setup.with_file(file)
}

/// The lines of a robot file that its gains are.
fn edits(new: &RobotFile, old: &RobotFile) -> Vec<KeyEdit> {
    let mut out = Vec::new();
    if new.log.relative_gains != old.log.relative_gains {
        out.push(KeyEdit::new(
            &["log", "relative_gains"],
            new.log.relative_gains,
        ));
    }
    differences("joint", &new.log.joint, &old.log.joint, &mut out);
    out
}

/// Channels that are no torques and have no gains, as entries of the key `setup`.
pub(crate) fn findings(setup: &RobotSetup) -> Vec<Finding> {
    let found = setup.file.without_gains();
    let finding = |(j, unit): &(usize, &str)| {
        let joint = &setup.robot.joint_names()[*j];
        let torque = setup.robot.joint_unit(*j);
        Finding {
            channel: Some(ChannelKind::Torque),
            ..Finding::new(
                FindingKind::Gains,
                Some(joint.clone()),
                [unit, torque].map(|unit| Setting::Names(vec![unit.to_owned()])),
                format!(
                    "the torque of {joint} is logged in {unit}, and nothing says what torque that is at the joint"
                ),
                format!(
                    "`torque_scale = ...` in [log.joint.{joint}], {torque} per {unit}: torque constant times gear ratio; or let `lsq --fit-gains LOG:mass=KG` find it"
                ),
                true,
            )
        }
    };
    found.iter().map(finding).collect()
}

fn notes(fit: &GainFit, reference: Option<&str>, mut of_logs: Vec<StageNote>) -> Vec<StageNote> {
    let ratios = reference.map(|reference| FitNote::GainRatios {
        reference: reference.to_owned(),
    });
    let ended = fit.ending != cft_ident_core::math::descent::IterationEnding::Converged;
    let ended = ended.then_some(FitNote::GainsNotSettled {
        steps: fit.iterations,
    });
    of_logs.extend(ratios.into_iter().chain(ended).map(StageNote::Fit));
    of_logs
}
