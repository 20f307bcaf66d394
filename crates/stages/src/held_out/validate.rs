//! The torque of logs that were not used, reconstructed by a model.

use schemars::JsonSchema;
use serde::Serialize;

use super::open_loop::{free_run, open_loop};
use crate::band::{Band, Reach};
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::in_memory::read_whole;
use crate::input::model::refined;
use crate::input::of_robot::{JointRanges, TorquePeaks};
use crate::input::position_cutoff::known;
use crate::input::repeated::{fitted_identities, repeated_rows, used_for};
use crate::input::summed_errors::check_smoothed_alike;
use crate::note::{ModelNote, StageNote};
use crate::open_loop::{FreeRun, OpenLoop};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::validate::{
    HalfWidths, JointError, ReconstructedRow, TorqueErrors, TorqueReconstruction, TorqueValidation,
};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Instant, Provenance};

/// What `validate` found.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Validated {
    #[serde(flatten)]
    pub validation: TorqueValidation,
    /// The same errors apart, where the model was made from some of the logs and not from others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_use: Option<ErrorsByUse>,
    /// Positions that the model makes of the measured torques, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open_loop: Option<OpenLoop>,
    /// The motion that the model makes of the measured torques in windows; null where the logs do not allow it.
    pub free_run: Option<FreeRun>,
    /// Errors of each log, in their order.
    #[serde(skip)]
    pub by_log: Vec<TorqueErrors>,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub notes: Vec<StageNote>,
}

/// Errors on logs that had no part in the model, and on those that it was made from.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ErrorsByUse {
    pub unseen: ErrorsOfLogs,
    /// Fitted, or a judge of what was added.
    pub used: ErrorsOfLogs,
}

/// Errors over some logs.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ErrorsOfLogs {
    /// Their names, with their spans.
    pub logs: Vec<String>,
    #[serde(flatten)]
    pub errors: TorqueErrors,
}

impl Validated {
    /// The errors that judge the model: of unseen logs where there are any, else of all.
    pub fn judged(&self) -> &TorqueErrors {
        match &self.by_use {
            Some(by_use) => &by_use.unseen.errors,
            None => &self.validation.errors,
        }
    }

    /// All errors, and those of parts of the logs.
    fn every(&mut self) -> impl Iterator<Item = &mut TorqueErrors> {
        let parts = self.by_use.iter_mut();
        let parts = parts.flat_map(|by| [&mut by.unseen.errors, &mut by.used.errors]);
        std::iter::once(&mut self.validation.errors).chain(parts)
    }
}

/// What a model is tried by.
#[derive(Debug, Clone, Copy)]
pub struct ValidateSettings<'a> {
    pub model: &'a GivenModel,
    /// Simulate the motion from the measured torques in short windows too.
    pub free_run: bool,
    /// Simulate the motion in windows of so many seconds that begin at measured states; without a length single axes
    /// run from begin to end, and other robots in windows of 0.25 s.
    pub open_loop: Option<Option<f64>>,
}

impl<'a> ValidateSettings<'a> {
    /// The errors of torques alone.
    pub fn of(model: &'a GivenModel) -> Self {
        ValidateSettings {
            model,
            free_run: false,
            open_loop: None,
        }
    }
}

/// Reconstructs the torque of logs, with a band where the model file holds what it takes; `row` gets every raw
/// sample, and the instant from which its time is counted.
///
/// Band and rows are of positions that came through the filter by which the band was found: where these logs call for
/// another, they are read again.
///
/// # Errors
/// Logs or a model that cannot be used, and positions where a joint of this robot cannot stand.
pub fn validate(
    data: &Dataset,
    settings: &ValidateSettings,
    control: &Control,
    row: &mut dyn FnMut(&ReconstructedRow, Instant),
) -> Result<Validated, IdentifyError> {
    let logs = data.logs.as_slice();
    let refined = &settings.model.numbers()?;
    let mut found = errors_of(data, (refined, &settings.model.file), control, row)?;
    // a motion begins in a row
    if settings.free_run && data.reduced.is_empty() {
        found.free_run = free_run(&data.setup, refined, (logs, &found.inputs), control)?;
    }
    if let Some(window) = settings.open_loop {
        data.check_rows()?;
        let simulated = open_loop(&data.setup, refined, logs, window, control)?;
        if simulated.astray > 0 {
            found.notes.push(StageNote::Model(ModelNote::Astray {
                astray: simulated.astray,
                windows: simulated.windows,
            }));
        }
        found.open_loop = Some(simulated);
    }
    Ok(found)
}

/// The errors of a model on the logs that it was fitted to, as [`validate`] gives them: of all, and log by log.
pub(crate) fn errors_on_fitted(
    data: &Dataset,
    file: &ModelFile,
    control: &Control,
) -> Result<(TorqueErrors, Vec<ErrorsOfLogs>), IdentifyError> {
    let model = refined(file, &data.setup.name)?;
    let smoothed = &smoothed(data, &model, control)?;
    let found = reconstruct(smoothed, (&model, file), None, control, &mut |_, _| {})?;
    let named = found.inputs.iter().zip(found.by_log);
    let by_log = named.map(|(input, errors)| ErrorsOfLogs {
        logs: vec![input.name.clone()],
        errors,
    });
    Ok((found.validation.errors, by_log.collect()))
}

fn errors_of(
    data: &Dataset,
    (refined, file): (&AugmentedModel, &ModelFile),
    control: &Control,
    row: &mut dyn FnMut(&ReconstructedRow, Instant),
) -> Result<Validated, IdentifyError> {
    let data = &smoothed(data, refined, control)?;
    let setup = &data.setup;
    check_smoothed_alike(data)?;
    let of_model = (refined, file);
    // a band is of single rows, which a reduced log has not
    let rows = data.reduced.is_empty();
    let band = Band::new(file, &refined.model).filter(|_| rows);
    let as_held = band.as_ref().and_then(|band| setup.as_held(band.held()));
    let mut reach = band.as_ref().map(|band| Reach::new(band.held()));
    let mut places = JointRanges::new(setup);
    let mut beyond = TorquePeaks::new(setup.robot.joints());
    let mut seen = |r: &ReconstructedRow, origin: Instant| {
        places.take(r.q);
        beyond.take(r, origin);
        if let Some(reach) = &mut reach {
            reach.take(r.q, r.v, r.reconstructed);
        }
        row(r, origin);
    };
    let mut found = match &as_held {
        None => reconstruct(data, of_model, band.as_ref(), control, &mut seen)?,
        Some(as_held) => {
            let mut found = reconstruct(data, of_model, None, control, &mut |_, _| {})?;
            let as_held = Dataset {
                setup: as_held.clone(),
                ..data.clone()
            };
            let mut second = reconstruct(&as_held, of_model, band.as_ref(), control, &mut seen)?;
            for (errors, by_band) in found.every().zip(second.every()) {
                for (joint, by_band) in errors.joints.iter_mut().zip(&by_band.joints) {
                    joint.coverage_95 = by_band.coverage_95;
                    joint.half_width = by_band.half_width;
                }
            }
            found
        }
    };
    if let Some(other) = places.refused(setup) {
        return Err(other);
    }
    if let Some(error) = beyond.impossible(found.judged(), data) {
        let error = error.to_string();
        let note = StageNote::Model(ModelNote::ImpossibleTorque { error });
        found.notes.insert(0, note);
    }
    if let Some(note) = not_a_validation(found.judged()) {
        found.notes.insert(0, note);
    }
    if rows {
        found.notes.extend(StageNote::of_reach(reach.as_ref()));
    }
    Ok(found)
}

/// The note about errors as large as the torque, where a joint moves.
pub fn not_a_validation(errors: &TorqueErrors) -> Option<StageNote> {
    let moving = |e: &&JointError| e.relative_error_moving.is_some_and(|error| error > 1.0);
    let worst = errors.joints.iter().filter(moving);
    let worst = worst.max_by(|a, b| a.headline().total_cmp(&b.headline()))?;
    Some(StageNote::Model(ModelNote::NoValidation {
        joint: worst.joint.clone(),
        error: worst.headline(),
    }))
}

/// The data with the position cut-offs that the logs call for, by the friction of a model.
fn smoothed(
    data: &Dataset,
    model: &AugmentedModel,
    control: &Control,
) -> Result<Dataset, IdentifyError> {
    let setup = match data.logs.as_slice() {
        [] => data.setup.clone(),
        logs => (data.setup).with_position_cutoffs(logs, &known(&model.model), control)?,
    };
    Ok(Dataset {
        setup,
        ..data.clone()
    })
}

fn reconstruct(
    data: &Dataset,
    (refined, file): (&AugmentedModel, &ModelFile),
    band: Option<&Band>,
    control: &Control,
    row: &mut dyn FnMut(&ReconstructedRow, Instant),
) -> Result<Validated, IdentifyError> {
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    let steps = data.reduced.len() + logs.len();
    let work = control.begin("reconstruction", Some(steps as u64));
    let widths = band.map(|band| {
        |motion: [&[f64]; 3], tau: &[f64], out: &mut [f64]| band.half_widths(motion, tau, out)
    });
    let widths: Option<HalfWidths> = widths.as_ref().map(|widths| widths as HalfWidths);
    let speeds = setup.rest_speeds(logs)?;
    let mut all = TorqueReconstruction::new(&refined.model, &speeds, widths);
    let (mut inputs, mut last) = (Vec::new(), None);
    let mut notes = repeated_rows(&fitted_identities(data));
    let settings = setup.settings();
    let mut segments = 0;
    for part in &data.reduced {
        part.add_errors(&mut all, setup, refined)?;
        notes.extend(part.notes.iter().cloned());
        inputs.push(part.provenance.clone());
        last = Some(part.summary.clone());
        all.end_log();
        work.advance(1);
    }
    for log in logs {
        if refined.effects.is_empty() {
            let mut blocks = log.blocks(control)?;
            let origin = log.recording().origin();
            all.count_from(origin.seconds());
            let summary = all
                .add(&settings, &mut |block| blocks.read(block), &mut |r| {
                    row(r, origin)
                })
                .map_err(|e| log.to_stage_error(&blocks, e))?;
            notes.extend(log.notes_with(&blocks, &summary));
            inputs.push(blocks.provenance()?);
            last = Some(summary);
        } else {
            // effects remember: they need a stretch from its begin
            let one = std::slice::from_ref(log);
            let whole = read_whole(setup, one, control)?;
            setup.check_temperatures(refined, one, &whole.stretches)?;
            all.count_from(whole.origin.seconds());
            for stretch in &whole.stretches {
                let hat = refined.reconstruct(stretch);
                let mut described = |r: &ReconstructedRow| row(r, whole.origin);
                all.add_stretch(&settings, segments, stretch, &hat, &mut described)
                    .map_err(|e| IdentifyError::motion(&log.name(), e))?;
                segments += 1;
            }
            notes.extend(whole.notes);
            inputs.extend(whole.inputs);
            last = Some(whole.summary);
        }
        all.end_log();
        work.advance(1);
    }
    if let Some(part) = data.reduced.first() {
        notes.push(StageNote::Model(ModelNote::ErrorsOfReduced {
            log: part.name().to_owned(),
        }));
    }
    let summary = last.ok_or(IdentifyError::NoLog)?;
    let used = used_for(file, &inputs);
    let part = |of_use: bool| ErrorsOfLogs {
        logs: (inputs
            .iter()
            .zip(&used)
            .filter(|(_, used)| **used == of_use))
        .map(|(input, _)| input.name.clone())
        .collect(),
        errors: all.errors_of(|log| used.get(log) == Some(&of_use)),
    };
    let apart = used.contains(&true) && used.contains(&false);
    let by_use = apart.then(|| ErrorsByUse {
        unseen: part(false),
        used: part(true),
    });
    let by_log = (0..inputs.len()).map(|own| all.errors_of(|log| log == own));
    let mut found = Validated {
        by_use,
        by_log: by_log.collect(),
        open_loop: None,
        free_run: None,
        validation: all.finish(summary),
        inputs,
        notes,
    };
    found.every().for_each(|errors| setup.name_units(errors));
    Ok(found)
}
