//! A reduced log or a model that parameters are followed in.

use std::slice::from_ref;
use std::sync::Arc;

use crate::input::reduced::reduced_log::ReducedLog;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::Provenance;

/// What a robot's parameters are taken from.
#[derive(Debug, Clone)]
pub enum TrackSource {
    /// A reduced log; `file` counts the files in the order in which they are given.
    Part { log: Arc<ReducedLog>, file: usize },
    /// A model that was identified.
    Model {
        name: String,
        file: Box<ModelFile>,
        provenance: Provenance,
    },
}

impl TrackSource {
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Part { log, .. } => log.name(),
            Self::Model { name, .. } => name,
        }
    }

    pub(crate) fn provenance(&self) -> &Provenance {
        match self {
            Self::Part { log, .. } => &log.provenance,
            Self::Model { provenance, .. } => provenance,
        }
    }

    /// Its name with the span of a log.
    pub(crate) fn shown(&self) -> String {
        match (self, &self.provenance().span) {
            (Self::Part { .. }, Some(span)) => format!("{}@{span}", self.name()),
            _ => self.name().to_owned(),
        }
    }

    /// The logs that it is from; the model file itself where it names none.
    pub(crate) fn rows(&self) -> &[Provenance] {
        match self {
            Self::Model { file, .. } if !file.provenance.inputs.is_empty() => {
                &file.provenance.inputs
            }
            _ => from_ref(self.provenance()),
        }
    }

    /// Whether both are from the same rows: parts of any, models of all.
    pub(crate) fn same_rows(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Part { log: a, .. }, Self::Part { log: b, .. }) => a.shares_rows(b),
            _ => {
                let (a, b) = (self.rows(), other.rows());
                let same =
                    |(a, b): (&Provenance, &Provenance)| a.sha256 == b.sha256 && a.span == b.span;
                a.len() == b.len() && a.iter().zip(b).all(same)
            }
        }
    }

    /// First and last time, where it is known.
    pub(crate) fn bounds(&self) -> Option<[f64; 2]> {
        match self {
            Self::Part { log, .. } => Some(log.bounds_s),
            Self::Model { .. } => None,
        }
    }
}
