//! Logs reduced to what a linear fit needs of them.

use std::path::Path;
use std::sync::Arc;

use crate::fit::known_friction::FrictionBefore;
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::input::passes::{LogPasses, PositionFilter};
use crate::input::reduced::{MadeWith, ReducedLog, ReducedLogs, ReducedRows};
use crate::input::repeated::each_row_once;
use crate::input::unknowns::columns;
use crate::note::StageNote;
use cft_ident_core::robot::model::JointFriction;
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
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    let friction = friction.map(|given| (given.name.as_str(), &given.file));
    setup.check_gains()?;
    each_row_once(setup, &[("reduce", logs)])?;
    if friction.is_none() && setup.file.friction_law() == FrictionLawKind::DoubleTanh {
        return Err(IdentifyError::LawIsNotLinear {
            estimator: "reduce",
        });
    }
    let before = friction
        .map(|given| FrictionBefore::of(setup, given, logs, (EstimatorKind::Wls, true), control));
    let known = before.transpose()?.map(|before| before.known);
    let made_with = MadeWith::of(&setup.file, friction.map(|f| f.0).zip(known.as_deref()));
    let made_with = Arc::new(made_with);
    let linear = columns(setup, known.as_deref());
    let laws: Vec<Option<JointFriction>> = (linear.known.iter())
        .map(|known| Some(JointFriction::DoubleTanh(known.as_ref()?.law)))
        .collect();
    let mut sets = Vec::new();
    for log in logs {
        if let LogData::Reduced(log) = log {
            log.belongs_to(&made_with)?;
            let logs = vec![log.clone()];
            sets.push(ReducedLogs::of(logs));
            continue;
        }
        let one = std::slice::from_ref(log);
        let own = setup.own_settings(one, &laws, control)?;
        let fastest = setup.fastest(one)?;
        let mut passes = LogPasses::new(setup, one, control).each_by_itself(own.clone());
        let declared = passes.read_condensed(&linear)?;
        let narrower = passes.read(PositionFilter::Narrower, &linear.with_torque_rates(), None)?;
        let mut shifted = Vec::new();
        for grid in 0..passes.readings_again() {
            shifted.extend(passes.read_shifted(&linear, grid, None)?);
        }
        let bounds_s = log.bounds()?;
        let (Some(own), Some(summary), Some(provenance)) =
            (own.into_iter().next(), passes.summary, passes.inputs.pop())
        else {
            return Err(IdentifyError::NoLog);
        };
        let reduced = ReducedLog {
            made_with: made_with.clone(),
            bounds_s,
            // as it is read back
            notes: (passes.notes.iter())
                .map(|note| StageNote::OfReducedLog(note.to_string()))
                .collect(),
            summary,
            own,
            fastest,
            readings: ReducedRows::of(declared, narrower, shifted),
            provenance,
        };
        let logs = vec![Arc::new(reduced)];
        sets.push(ReducedLogs::of(logs));
    }
    Ok(ReducedLogs::merge(sets)?)
}
