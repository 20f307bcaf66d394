//! Where a log is: in a file, or in memory.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::control::Control;
use super::reduced::reduced_log::ReducedLog;
use cft_ident_logs::log::{Layout, LogArrays, LogError, LogSpec, Reader};

/// Where a log is.
#[derive(Debug, Clone)]
pub enum Log {
    /// A file or a part of it, its channels mapped as the robot file says.
    File(LogSpec),
    /// Arrays of joint positions and torques, in SI units.
    Arrays(Arc<LogArrays>),
    /// What a linear fit needs of a log: `lsq` and `validate` take it.
    Reduced(Arc<ReducedLog>),
}

impl Log {
    /// A log in memory: times [s], then positions [m or rad] and torques [N or Nm] of the joints, row
    /// after row. `name` stands for it in messages and results. Torques may be left out (empty) where
    /// a stage asks for positions alone.
    ///
    /// # Errors
    /// Arrays whose sizes do not belong together.
    pub fn of_rows(name: &str, t: &[f64], q: &[f64], tau: &[f64]) -> Result<Self, LogError> {
        let arrays = LogArrays::new(name, t.to_vec(), q.to_vec(), tau.to_vec())?;
        Ok(Self::Arrays(Arc::new(arrays)))
    }

    /// The same from matrices with one row per sample and one column per joint.
    ///
    /// # Errors
    /// Matrices whose sizes do not belong together.
    pub fn of_matrices(
        name: &str,
        t: &[f64],
        q: &DMatrix<f64>,
        tau: &DMatrix<f64>,
    ) -> Result<Self, LogError> {
        // nalgebra keeps columns together, a block rows
        let rows = |x: &DMatrix<f64>| x.transpose().as_slice().to_vec();
        let arrays = LogArrays::new(name, t.to_vec(), rows(q), rows(tau))?;
        Ok(Self::Arrays(Arc::new(arrays)))
    }

    /// The same log with the positions that the controller was asked for, row after row: instruments
    /// are simulated along them. A file names its channels of them in the robot file instead.
    ///
    /// # Errors
    /// Another number of values than there are positions.
    pub fn with_references(self, references: &[f64]) -> Result<Self, LogError> {
        match self {
            Self::Arrays(arrays) => Ok(Self::Arrays(Arc::new(
                LogArrays::clone(&arrays).with_references(references.to_vec())?,
            ))),
            other => Ok(other),
        }
    }

    /// The same log with the temperature of the drive of joint `joint` [degC], one value per row. A file names its
    /// column in the robot file instead.
    ///
    /// # Errors
    /// Another number of values than there are rows, and one that is no number.
    pub fn with_temperature(self, joint: usize, temperatures: &[f64]) -> Result<Self, LogError> {
        match self {
            Self::Arrays(arrays) => Ok(Self::Arrays(Arc::new(
                LogArrays::clone(&arrays).with_temperature(joint, temperatures.to_vec())?,
            ))),
            other => Ok(other),
        }
    }

    /// Name of the log in messages and results, without folders.
    pub fn name(&self) -> String {
        match self {
            Self::File(spec) => spec.name(),
            Self::Arrays(arrays) => arrays.name().to_owned(),
            Self::Reduced(part) => part.name().to_owned(),
        }
    }

    /// The same log with the torques of each joint times a factor of its own, where it is in memory.
    pub(crate) fn with_torques_times(&self, factors: &[f64]) -> Result<Self, LogError> {
        Ok(match self {
            Self::Arrays(arrays) => Self::Arrays(Arc::new(arrays.with_torques_times(factors)?)),
            other => other.clone(),
        })
    }

    /// Goes along its rows as they come, neither looked at nor mended.
    pub(crate) fn reader(
        &self,
        layout: &Layout,
        joints: &[String],
        control: &Control,
    ) -> Result<Reader, LogError> {
        match self {
            Self::File(spec) => Reader::open_until(spec, layout, &|| control.stopped()),
            Self::Reduced(part) => Err(part.without_rows()),
            Self::Arrays(arrays) => Reader::of_arrays(arrays, arrays_layout(layout, joints)),
        }
    }
}

/// The layout of arrays, which are joint-side already: of `layout` they take only whether torques are read.
pub(crate) fn arrays_layout(layout: &Layout, joints: &[String]) -> Layout {
    let plain = Layout::joint_columns(joints);
    match layout.torques.is_empty() {
        true => plain.without_torques(),
        false => plain,
    }
}

impl From<LogSpec> for Log {
    fn from(spec: LogSpec) -> Self {
        Self::File(spec)
    }
}

impl From<&LogSpec> for Log {
    fn from(spec: &LogSpec) -> Self {
        Self::File(spec.clone())
    }
}
