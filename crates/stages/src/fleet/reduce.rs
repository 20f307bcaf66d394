//! Logs reduced to what a linear fit needs of them.

use std::path::Path;
use std::sync::Arc;

use crate::fit::known_friction::FrictionBefore;
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::log::Log;
use crate::input::lsq_rows::{LsqRows, PositionReading};
use crate::input::position_cutoff::choose_smoothing;
use crate::input::reduced::{MadeWith, ReducedLog, ReducedLogs, ReducedRows};
use crate::input::repeated::{each_row_once, fitted_identities};
use crate::input::unknowns::columns;
use crate::note::StageNote;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::robot_file::FrictionLawKind;

impl ReducedLogs {
    /// Reads a file.
    pub fn load(path: &Path) -> Result<Self, IdentifyError> {
        let bytes = cft_ident_logs::log::bytes(path)?;
        Ok(Self::from_bytes(&path.to_string_lossy(), &bytes)?)
    }

    /// The same as logs of a stage.
    pub fn as_logs(&self) -> Vec<Log> {
        let logs = self.logs().iter();
        logs.map(|log| Log::Reduced(log.clone())).collect()
    }
}

/// Reduces logs. With `friction`, the friction of that model is known to a fit and held.
///
/// # Errors
/// Logs that cannot be used, a friction law that is not linear and that no model gives, and rows that are
/// given twice.
pub fn reduce(
    data: &Dataset,
    friction: Option<&GivenModel>,
    control: &Control,
) -> Result<ReducedLogs, IdentifyError> {
    let setup = &data.setup;
    let friction = friction.map(|given| (given.name.as_str(), &given.file));
    setup.check_gains()?;
    each_row_once(&[("reduce", fitted_identities(data))])?;
    if friction.is_none() && setup.file.friction_law() == FrictionLawKind::DoubleTanh {
        return Err(IdentifyError::LawIsNotLinear {
            estimator: "reduce",
        });
    }
    let before = friction.map(|given| FrictionBefore::of(data, given, (EstimatorKind::Wls, true)));
    let known = before.transpose()?.map(|before| before.known);
    let made_with = MadeWith::of(&setup.file, friction.map(|f| f.0).zip(known.as_deref()));
    let made_with = Arc::new(made_with);
    let linear = columns(setup, known.as_deref());
    for part in &data.reduced {
        part.belongs_to(&made_with)?;
    }
    let mut sets = vec![ReducedLogs::of(data.reduced.clone())];
    for log in &data.logs {
        let one = Dataset::new(setup, std::slice::from_ref(log));
        let reduced = reduce_log(&one, &linear, &made_with, control)?;
        sets.push(ReducedLogs::of(vec![Arc::new(reduced)]));
    }
    Ok(ReducedLogs::merge(sets)?)
}

/// Reduces the one log of a dataset, with the columns of `linear`.
fn reduce_log(
    data: &Dataset,
    linear: &RegressorColumns,
    made_with: &Arc<MadeWith>,
    control: &Control,
) -> Result<ReducedLog, IdentifyError> {
    let [log] = data.logs.as_slice() else {
        return Err(IdentifyError::NoLog);
    };
    let smoothing = choose_smoothing(data, &linear.known_laws(), control)?;
    let mut rows = LsqRows::new(data, smoothing.clone(), control);
    let declared = rows.fold(PositionReading::Declared, linear, None)?;
    let rates = linear.with_torque_rates();
    let narrower = rows.fold(PositionReading::Narrower, &rates, None)?;
    let mut shifted = Vec::new();
    for reading in 0..rows.readings_again() {
        shifted.extend(rows.fold_again(reading, linear, None)?);
    }
    let (Some(smoothing), Some(summary), Some(provenance)) = (
        smoothing.into_iter().next(),
        rows.summary().cloned(),
        rows.inputs().pop(),
    ) else {
        return Err(IdentifyError::NoLog);
    };
    // the declared reading keeps as many blocks as the others leave room for
    let others = 1 + u64::from(rows.readings_again());
    let declared = declared.condensed(provenance.samples, others);
    Ok(ReducedLog {
        made_with: made_with.clone(),
        bounds_s: log.bounds(),
        // as it is read back
        notes: (rows.notes().iter())
            .map(|note| StageNote::OfReducedLog(note.to_string()))
            .collect(),
        summary,
        smoothing,
        fastest: data.top_speeds()?,
        readings: ReducedRows::of(declared, narrower, shifted),
        provenance,
    })
}
