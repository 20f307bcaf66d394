//! What a stage works on: a robot and its logs, and a model of it.

use std::path::Path;
use std::sync::Arc;

use super::control::Control;
use super::error::IdentifyError;
use super::log::Log;
use super::log_data::{LogData, raise};
use super::model::refined;
use super::reduced::reduced_log::ReducedLog;
use super::robot_setup::RobotSetup;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::escape;

/// A robot and its logs, by what they are for.
#[derive(Debug, Clone)]
pub struct Dataset {
    pub setup: RobotSetup,
    /// Logs that are fitted; those that are looked at, where a stage fits nothing.
    pub logs: Vec<LogData>,
    /// Logs of one moving joint each, which a campaign gives to the friction filter.
    pub one_joint: Vec<LogData>,
    /// Logs that are never fitted and judge what is added to a model.
    pub held_out: Vec<LogData>,
    /// Logs without rows, which `lsq`, `reduce` and `validate` take before those of `logs`; other stages refuse them.
    pub reduced: Vec<Arc<ReducedLog>>,
}

impl Dataset {
    /// Reads logs of a robot, all of them to be fitted or looked at; reduced ones are kept apart.
    ///
    /// # Errors
    /// Logs that cannot be read.
    pub fn read(
        setup: &RobotSetup,
        logs: &[Log],
        control: &Control,
    ) -> Result<Self, IdentifyError> {
        Self::read_beside(setup, logs, &[], control)
    }

    /// The same; what one of the logs beside holds is not parsed again.
    ///
    /// # Errors
    /// Logs that cannot be read.
    pub fn read_beside(
        setup: &RobotSetup,
        logs: &[Log],
        beside: &[LogData],
        control: &Control,
    ) -> Result<Self, IdentifyError> {
        let (mut with_rows, mut reduced) = (Vec::new(), Vec::new());
        for log in logs {
            match log {
                Log::Reduced(part) => reduced.push(Arc::clone(part)),
                log => with_rows.push(log.clone()),
            }
        }
        let logs = LogData::read_all(setup, &with_rows, &[beside], control)?;
        Ok(Dataset {
            reduced,
            ..Self::new(setup, &logs)
        })
    }

    /// The same with logs that are held out.
    ///
    /// # Errors
    /// Logs that cannot be read.
    pub fn holding_out(self, held_out: &[Log], control: &Control) -> Result<Self, IdentifyError> {
        let held_out = LogData::read_all(&self.setup, held_out, &[&self.logs], control)?;
        Ok(Dataset { held_out, ..self })
    }

    /// The same logs as another robot file reads them.
    ///
    /// # Errors
    /// Logs that cannot be read by it.
    pub fn of_robot(&self, setup: RobotSetup, control: &Control) -> Result<Self, IdentifyError> {
        let again = |logs: &[LogData]| {
            let logs = logs.iter().map(|log| log.read_again(&setup, control));
            logs.collect::<Result<Vec<_>, _>>()
        };
        Ok(Dataset {
            logs: again(&self.logs)?,
            one_joint: again(&self.one_joint)?,
            held_out: again(&self.held_out)?,
            reduced: self.reduced.clone(),
            setup,
        })
    }

    /// Logs that were read, all of them to be fitted or looked at.
    pub fn new(setup: &RobotSetup, logs: &[LogData]) -> Self {
        Dataset {
            setup: setup.clone(),
            logs: logs.to_vec(),
            one_joint: Vec::new(),
            held_out: Vec::new(),
            reduced: Vec::new(),
        }
    }

    /// Refuses logs of held poses, which say nothing of inertia: gravity is fitted to them another way.
    ///
    /// # Errors
    /// [`IdentifyError::Held`] where each log holds pose after pose, and logs that fits refuse.
    pub fn check_moving(&self) -> Result<(), IdentifyError> {
        let mut held = None;
        for log in &self.logs {
            let Some(share) = log.usable()?.held_share else {
                return Ok(());
            };
            held = Some(IdentifyError::Held {
                log: escape(&log.name()),
                share,
            });
        }
        // what was reduced was checked then
        held.filter(|_| self.reduced.is_empty()).map_or(Ok(()), Err)
    }

    /// Refuses reduced logs, whose rows are not there any more.
    ///
    /// # Errors
    /// The first reduced log.
    pub(crate) fn check_rows(&self) -> Result<(), IdentifyError> {
        match self.reduced.first() {
            Some(part) => Err(part.without_rows().into()),
            None => Ok(()),
        }
    }

    /// Refuses reduced logs for `what`, which needs rows; `remedy` says what to do.
    ///
    /// # Errors
    /// The first reduced log.
    pub(crate) fn needs_rows(&self, what: &str, remedy: &'static str) -> Result<(), IdentifyError> {
        match self.reduced.first() {
            Some(part) => Err(part.needs_log(what, remedy).into()),
            None => Ok(()),
        }
    }

    /// Greatest speed of every joint in the logs that are fitted [m/s or rad/s].
    pub(crate) fn top_speeds(&self) -> Result<Vec<f64>, IdentifyError> {
        let mut greatest = self.setup.top_speeds(&self.logs)?;
        for part in &self.reduced {
            raise(&mut greatest, &part.fastest);
        }
        Ok(greatest)
    }

    /// The same with logs that are held out.
    pub fn with_held_out(self, held_out: &[LogData]) -> Self {
        Dataset {
            held_out: held_out.to_vec(),
            ..self
        }
    }
}

/// A model file that a stage is given.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenModel {
    /// The file as the user named it, for messages.
    pub name: String,
    /// Its name without folders, as it is.
    pub file_name: String,
    pub file: ModelFile,
}

impl GivenModel {
    pub fn new(name: &str, file: ModelFile) -> Self {
        let path = Path::new(name).file_name();
        GivenModel {
            name: name.to_owned(),
            file_name: path.map_or(name.to_owned(), |last| last.to_string_lossy().into_owned()),
            file,
        }
    }

    /// The robot of the model, its set-up kept as it is declared where that of the model was.
    pub fn setup(&self) -> RobotSetup {
        RobotSetup::of_model(&self.name, &self.file)
    }

    /// What torques are computed with.
    ///
    /// # Errors
    /// A file that lacks a parameter, or an effect that cannot be.
    pub fn numbers(&self) -> Result<AugmentedModel, IdentifyError> {
        refined(&self.file, &self.name)
    }
}
