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
use crate::effect::AugmentedModel;
use crate::log::{Instant, Provenance};
use crate::validate::{Reconstructed, Reconstruction, Validation};

/// What `validate` found.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Validated {
    #[serde(flatten)]
    pub validation: Validation,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub warnings: Vec<String>,
}

/// Reconstructs the torque of logs; `row` gets every raw sample, and the instant from which its time
/// is counted.
///
/// # Errors
/// Logs that cannot be used.
pub fn validate(
    machine: &LoggedRobot,
    refined: &AugmentedModel,
    logs: &[Log],
    control: &Control,
    row: &mut dyn FnMut(&Reconstructed, Instant),
) -> Result<Validated, IdentifyError> {
    let machine = &machine.with_position_cutoffs(logs, &known(&refined.model), control)?;
    let work = control.begin("reconstruction", Some(logs.len() as u64));
    let mut all = Reconstruction::new(&refined.model, &machine.rest_speeds(logs, control)?);
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
        validation,
        inputs,
        warnings,
    })
}
