//! The torque of logs that were not used, reconstructed by a model.

use schemars::JsonSchema;
use serde::Serialize;

use super::control::Control;
use super::error::IdentifyError;
use super::in_memory::read_whole;
use super::log::Log;
use super::logged_robot::LoggedRobot;
use super::position_cutoff::known;
use super::repeated::repeated_rows;
use crate::band::{Band, NO_BAND, Reach};
use crate::config::ModelFile;
use crate::effect::AugmentedModel;
use crate::log::{Instant, Provenance};
use crate::open_loop::OpenLoop;
use crate::validate::{HalfWidths, Reconstructed, Reconstruction, Validation};

/// What `validate` found.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Validated {
    #[serde(flatten)]
    pub validation: Validation,
    /// Positions that the model makes of the measured torques, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open_loop: Option<OpenLoop>,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub warnings: Vec<String>,
}

/// Reconstructs the torque of logs, with a band where the model's `file` holds what it takes; `row` gets every raw
/// sample, and the instant from which its time is counted.
///
/// Band and rows are of positions that came through a filter no wider than that by which the band was found: where
/// these logs call for a wider one, they are gone through once more.
///
/// # Errors
/// Logs that cannot be used.
pub fn validate(
    machine: &LoggedRobot,
    (refined, file): (&AugmentedModel, Option<&ModelFile>),
    logs: &[Log],
    control: &Control,
    row: &mut dyn FnMut(&Reconstructed, Instant),
) -> Result<Validated, IdentifyError> {
    let machine = machine.with_position_cutoffs(logs, &known(&refined.model), control)?;
    let band = file.and_then(|file| Band::new(file, &refined.model));
    let as_held = band.as_ref().and_then(|band| machine.as_held(band.held()));
    let mut reach = band.as_ref().map(|band| Reach::new(band.held()));
    let mut seen = |r: &Reconstructed, origin: Instant| {
        if let Some(reach) = &mut reach {
            reach.take(r.q, r.v, r.reconstructed);
        }
        row(r, origin);
    };
    let mut found = match &as_held {
        None => reconstruct(&machine, refined, band.as_ref(), logs, control, &mut seen)?,
        Some(as_held) => {
            let mut found = reconstruct(&machine, refined, None, logs, control, &mut |_, _| {})?;
            let second = reconstruct(as_held, refined, band.as_ref(), logs, control, &mut seen)?;
            let joints = found.validation.joints.iter_mut();
            for (joint, by_band) in joints.zip(second.validation.joints) {
                joint.coverage_95 = by_band.coverage_95;
                joint.half_width = by_band.half_width;
            }
            found
        }
    };
    match &reach {
        Some(reach) => found.warnings.extend(reach.told()),
        None if file.is_some() => found.warnings.push(NO_BAND.to_owned()),
        None => {}
    }
    Ok(found)
}

fn reconstruct(
    machine: &LoggedRobot,
    refined: &AugmentedModel,
    band: Option<&Band>,
    logs: &[Log],
    control: &Control,
    row: &mut dyn FnMut(&Reconstructed, Instant),
) -> Result<Validated, IdentifyError> {
    let work = control.begin("reconstruction", Some(logs.len() as u64));
    let widths = band.map(|band| {
        |motion: [&[f64]; 3], tau: &[f64], out: &mut [f64]| band.half_widths(motion, tau, out)
    });
    let widths: Option<HalfWidths> = widths.as_ref().map(|widths| widths as HalfWidths);
    let speeds = machine.rest_speeds(logs, control)?;
    let mut all = Reconstruction::new(&refined.model, &speeds, widths);
    let (mut inputs, mut last) = (Vec::new(), None);
    let mut warnings = repeated_rows(logs, Some(&machine.file.layout()));
    let settings = machine.settings();
    let mut segments = 0;
    for log in logs {
        if refined.effects.is_empty() {
            let mut open = machine.open(log, control)?;
            let origin = open.origin();
            all.count_from(origin.seconds());
            let summary = all
                .add(&settings, &mut |block| open.read(block), &mut |r| {
                    row(r, origin)
                })
                .map_err(|e| IdentifyError::of_run(&log.name(), e))?;
            warnings.extend(open.told(&summary));
            inputs.push(open.provenance()?);
            last = Some(summary);
        } else {
            // effects remember: they need a stretch from its begin
            let whole = read_whole(machine, std::slice::from_ref(log), control)?;
            all.count_from(whole.origin.seconds());
            for stretch in &whole.stretches {
                let hat = refined.reconstruct(stretch);
                let mut told = |r: &Reconstructed| row(r, whole.origin);
                all.add_stretch(&settings, segments, stretch, &hat, &mut told)
                    .map_err(|e| IdentifyError::motion(&log.name(), e))?;
                segments += 1;
            }
            warnings.extend(whole.warnings);
            inputs.extend(whole.inputs);
            last = Some(whole.summary);
        }
        work.advance(1);
    }
    let summary = last.ok_or(IdentifyError::NoLog)?;
    let mut validation = all.finish(summary);
    machine.name_units(&mut validation);
    Ok(Validated {
        open_loop: None,
        validation,
        inputs,
        warnings,
    })
}
