//! Reduced logs as data, and what they were made with.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::ReducedError;
use super::factors::ReducedFactors;
use crate::input::log_smoothing::LogSmoothing;
use crate::note::StageNote;
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::columns::{GRADIENT, KnownFriction, RegressorColumns};
use cft_ident_core::inertia::late;
use cft_ident_core::motion::Summary;
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{LogError, Provenance, escape};

/// What reduced logs were made with: those of one fit agree in all of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MadeWith {
    /// Version of the program.
    pub version: String,
    /// SHA-256 of each section of the robot file that a fit depends on.
    pub robot: BTreeMap<String, String>,
    /// The robot file as TOML.
    pub robot_file: String,
    /// Joints of the robot.
    pub joints: Vec<String>,
    /// The friction that was known, where a model gave it.
    pub friction: Option<FrictionGiven>,
}

/// The friction that logs were reduced with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionGiven {
    /// Name of the model file.
    pub model: String,
    /// SHA-256 of its values and covariances.
    pub sha256: String,
    /// Parameters of law (18) of each joint, and their covariance.
    pub laws: Vec<[f64; GRADIENT]>,
    pub covariances: Vec<[[f64; GRADIENT]; GRADIENT]>,
}

/// Sections of a robot file by which rows differ.
fn sections(file: &RobotFile) -> BTreeMap<String, String> {
    let shown = |name: &str, text: serde_json::Result<String>| {
        let text = text.unwrap_or_default();
        (name.to_owned(), Provenance::of_text(name, &text).sha256)
    };
    BTreeMap::from([
        shown("robot", serde_json::to_string(&file.robot)),
        shown("friction", serde_json::to_string(&file.friction)),
        shown("log", serde_json::to_string(&file.log)),
        shown("filter", serde_json::to_string(&file.filter)),
        shown("noise", serde_json::to_string(&file.noise)),
    ])
}

impl MadeWith {
    /// What a robot file and the friction that a model gives make.
    pub(crate) fn of(file: &RobotFile, friction: Option<(&str, &[KnownFriction])>) -> Self {
        let given = friction.map(|(model, known)| {
            let values: Vec<_> = known
                .iter()
                .map(|known| (known.law.parameters(), known.covariance))
                .collect();
            FrictionGiven {
                model: model.rsplit(['/', '\\']).next().unwrap_or(model).to_owned(),
                sha256: Provenance::of_text(model, &format!("{values:?}")).sha256,
                laws: known.iter().map(|k| k.law.parameters()).collect(),
                covariances: known.iter().map(|k| k.covariance).collect(),
            }
        });
        // a limit that a log's torques showed is that log's own
        let mut file = file.clone();
        for own in file.log.joint.values_mut() {
            own.torque_limit = None;
        }
        let file = &file;
        MadeWith {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            robot: sections(file),
            robot_file: toml::to_string(file).unwrap_or_default(),
            joints: file.joint_names(),
            friction: given,
        }
    }

    /// What differs between this and `wanted`, in words; none where a fit may take both.
    pub(crate) fn difference(&self, wanted: &MadeWith) -> Option<String> {
        if self.version != wanted.version {
            return Some(format!(
                "was made by version {}, and this is version {}",
                self.version, wanted.version
            ));
        }
        if self.joints != wanted.joints {
            return Some(format!(
                "is of a robot with the joints {}, where {} are wanted",
                self.joints.join(", "),
                wanted.joints.join(", ")
            ));
        }
        let differ = wanted.robot.iter();
        let differ = differ.filter(|(name, sha)| self.robot.get(*name) != Some(sha));
        let names: Vec<String> = differ.map(|(name, _)| format!("[{name}]")).collect();
        if !names.is_empty() {
            return Some(format!(
                "was made with a robot file whose {} differs",
                names.join(" and ")
            ));
        }
        let sha = |made: &MadeWith| made.friction.as_ref().map(|f| f.sha256.clone());
        match (&self.friction, &wanted.friction) {
            _ if sha(self) == sha(wanted) => None,
            (Some(ours), None) => Some(format!(
                "was made with the friction of {}, and none is given",
                ours.model
            )),
            (None, Some(theirs)) => Some(format!(
                "was made without a friction model, and {} is given",
                theirs.model
            )),
            (Some(ours), _) => Some(format!(
                "was made with the friction of {}, which has other values than the one given",
                ours.model
            )),
            (None, None) => None,
        }
    }
}

/// One log, reduced.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedLog {
    pub made_with: Arc<MadeWith>,
    pub provenance: Provenance,
    /// First and last time of its rows, by the log's own clock [s].
    pub bounds_s: [f64; 2],
    /// What was left out of it or mended, and what else was noticed of it, as a file keeps it.
    pub notes: Vec<StageNote>,
    pub summary: Summary,
    pub(crate) smoothing: LogSmoothing,
    /// Greatest speed of each joint [m/s or rad/s].
    pub(crate) fastest: Vec<f64>,
    pub(crate) readings: ReducedRows,
}

/// What the readings of a log left.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReducedRows {
    pub(super) declared: ReducedFactors,
    pub(super) narrower: ReducedFactors,
    pub(super) shifted: Vec<ReducedFactors>,
}

impl ReducedRows {
    /// Rows by the declared position filter, by a narrower one, and on shifted grids of the encoders.
    pub(crate) fn of(
        declared: BlockFactors,
        narrower: BlockFactors,
        shifted: Vec<BlockFactors>,
    ) -> Self {
        let without_rest = |factors| ReducedFactors::of(factors, false);
        ReducedRows {
            declared: ReducedFactors::of(declared, true),
            narrower: without_rest(narrower),
            shifted: shifted.into_iter().map(without_rest).collect(),
        }
    }
}

impl ReducedLog {
    /// Name of the log.
    pub fn name(&self) -> &str {
        &self.provenance.name
    }

    /// Refuses to read its rows.
    pub(crate) fn without_rows(&self) -> LogError {
        LogError::Format {
            file: escape(self.name()),
            kind: "a reduced log",
            remedy: "its rows are not there any more: give the log itself",
        }
    }

    /// Refuses it for `what`, which needs its rows.
    pub(crate) fn needs_log(&self, what: &str, remedy: &'static str) -> ReducedError {
        ReducedError::NeedsLog {
            log: self.name().to_owned(),
            what: what.to_owned(),
            remedy,
        }
    }

    /// Blocks of time whose factors are kept.
    pub fn blocks(&self) -> usize {
        self.readings.declared.blocks()
    }

    /// Its rows.
    pub(crate) fn rows(&self, columns: RegressorColumns) -> Result<BlockFactors, ReducedError> {
        self.readings.declared.rows(self.name(), columns)
    }

    /// Its rows by a narrower position filter.
    pub(crate) fn narrower_rows(
        &self,
        columns: RegressorColumns,
    ) -> Result<BlockFactors, ReducedError> {
        let narrower = &self.readings.narrower;
        if self.holds_torque_rates() && !columns.have_torque_rates() {
            let rows = narrower.rows(self.name(), columns.with_torque_rates())?;
            return Ok(late::without_rates(&rows));
        }
        narrower.rows(self.name(), columns)
    }

    /// Whether its rows by the narrower filter hold the rates and bends of torques; those of before 0.4 do not.
    pub(crate) fn holds_torque_rates(&self) -> bool {
        self.readings.narrower.width() == self.readings.declared.width() + 2
    }

    /// Its rows with positions rounded anew on a shifted grid; none of a robot whose encoders are not known.
    pub(crate) fn shifted_rows(
        &self,
        grid: u32,
        columns: RegressorColumns,
    ) -> Result<Option<BlockFactors>, ReducedError> {
        let shifted = self.readings.shifted.get(grid as usize);
        shifted.map(|f| f.rows(self.name(), columns)).transpose()
    }

    /// Refuses a log that was reduced with something else than `wanted`.
    pub(crate) fn belongs_to(&self, wanted: &MadeWith) -> Result<(), ReducedError> {
        match self.made_with.difference(wanted) {
            None => Ok(()),
            Some(difference) => Err(ReducedError::Other {
                log: self.name().to_owned(),
                difference,
            }),
        }
    }

    /// Refuses a log of another robot, settings or version, whatever friction it was reduced with.
    pub(crate) fn belongs_to_robot(&self, file: &RobotFile) -> Result<(), ReducedError> {
        let friction = self.made_with.friction.clone();
        self.belongs_to(&MadeWith {
            friction,
            ..MadeWith::of(file, None)
        })
    }

    /// The friction that its columns were made with; a fit holds it.
    pub(crate) fn known_friction(&self) -> Option<Vec<KnownFriction>> {
        let given = self.made_with.friction.as_ref()?;
        let known = given.laws.iter().zip(&given.covariances);
        let known = known.map(|(law, covariance)| KnownFriction {
            law: DoubleTanh::from_parameters(*law),
            covariance: *covariance,
            held: [true; GRADIENT],
        });
        Some(known.collect())
    }

    /// Whether it holds rows that another holds.
    pub(crate) fn shares_rows(&self, other: &ReducedLog) -> bool {
        let [a, b] = [self.bounds_s, other.bounds_s];
        self.provenance.shares_rows(&other.provenance) && a[0] < b[1] && b[0] < a[1]
    }

    /// What orders reduced logs: the log's checksum, its span, and what it was made with.
    fn key(&self) -> (&str, Option<&str>) {
        let p = &self.provenance;
        (&p.sha256, p.span.as_deref())
    }
}

/// Reduced logs of one robot, in the order of their checksums.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedLogs {
    pub(super) logs: Vec<Arc<ReducedLog>>,
}

impl ReducedLogs {
    /// Logs that are in order already, or a single one.
    pub(crate) fn of(logs: Vec<Arc<ReducedLog>>) -> Self {
        ReducedLogs { logs }
    }

    /// Joins sets of reduced logs.
    ///
    /// # Errors
    /// Sets that were made with different robots, settings, versions or friction, and one log twice.
    pub fn merge(sets: impl IntoIterator<Item = ReducedLogs>) -> Result<Self, ReducedError> {
        let mut logs: Vec<Arc<ReducedLog>> = sets.into_iter().flat_map(|s| s.logs).collect();
        logs.sort_by(|a, b| a.key().cmp(&b.key()));
        let Some(first) = logs.first() else {
            return Err(ReducedError::Empty);
        };
        for log in &logs {
            log.belongs_to(&first.made_with)?;
        }
        for (k, log) in logs.iter().enumerate() {
            // those of one checksum stand together
            let mut spans = logs[k + 1..]
                .iter()
                .take_while(|other| other.key().0 == log.key().0);
            if let Some(other) = spans.find(|other| other.shares_rows(log)) {
                return Err(ReducedError::Twice {
                    first: log.name().to_owned(),
                    second: other.name().to_owned(),
                });
            }
        }
        Ok(ReducedLogs { logs })
    }

    /// The logs.
    pub fn logs(&self) -> &[Arc<ReducedLog>] {
        &self.logs
    }

    /// What they were made with.
    pub fn made_with(&self) -> Option<&MadeWith> {
        self.logs.first().map(|log| &*log.made_with)
    }
}
