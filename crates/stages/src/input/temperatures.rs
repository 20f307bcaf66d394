//! Temperatures of logs: read where the robot file names their columns, and asked for where a formula takes them.

use super::error::IdentifyError;
use super::log::Log;
use super::log_data::LogData;
use super::robot_setup::RobotSetup;
use crate::note::{LogNote, StageNote};
use cft_ident_core::effect::{AugmentedModel, Law};
use cft_ident_core::explain::{ErrorText, Explain};
use cft_ident_core::motion::Stretch;
use cft_ident_logs::log::{Instant, JointTemperatures, LogError};

/// A temperature that an effect takes.
pub(crate) struct EffectTemperature {
    effect: String,
    joint: usize,
}

/// Those that the effects of a model take.
pub(crate) fn of_model(model: &AugmentedModel) -> Vec<EffectTemperature> {
    let effects = model.effects.iter().flat_map(|effect| {
        let title = effect.title(&model.model.robot);
        let joints = effect.temperatures().into_iter();
        joints.map(move |joint| EffectTemperature {
            effect: title.clone(),
            joint,
        })
    });
    effects.collect()
}

/// Those that effects of the user's own take at any joint where they are tried.
pub(crate) fn of_laws(laws: &[&Law]) -> Vec<EffectTemperature> {
    let all = laws.iter().filter_map(|law| Some((law, law.formula?)));
    let taken = all.flat_map(|(law, formula)| {
        let joints = formula.joints().iter();
        joints.flat_map(|j| {
            let taken = formula.temperatures(*j).into_iter();
            taken.map(|joint| EffectTemperature {
                effect: law.entry.name.to_owned(),
                joint,
            })
        })
    });
    taken.collect()
}

/// Why rows of a stream are refused for a model that takes temperatures.
pub(crate) fn none_on(stream: &str, model: &AugmentedModel) -> IdentifyError {
    let first = of_model(model).into_iter().next();
    let (effect, joint) = first.map_or((String::new(), 0), |t| (t.effect, t.joint));
    IdentifyError::NoTemperature {
        log: stream.to_owned(),
        effect,
        joint: model.model.robot.joint_names()[joint].clone(),
        why: Box::new(
            ErrorText::new("rows that arrive on a stream carry none")
                .remedy("watch the log as a file"),
        ),
    }
}

impl RobotSetup {
    /// Puts the temperatures of a log beside its stretches; a column that it lacks is noted.
    pub(crate) fn put_temperatures(
        &self,
        log: &LogData,
        stretches: &mut [Stretch],
    ) -> Result<Option<StageNote>, LogError> {
        match log.recording().temperatures() {
            Ok(found) => {
                for stretch in stretches {
                    stretch.temperature = found.along(&stretch.t, self.robot.joints());
                }
                Ok(None)
            }
            Err(error @ (LogError::MissingColumn { .. } | LogError::Topic { .. })) => {
                let why = error.to_string();
                Ok(Some(StageNote::Log(LogNote::NoTemperature { why })))
            }
            Err(error) => Err(error),
        }
    }

    /// Refuses logs, read as these stretches, without the temperatures that the effects of a model take.
    pub fn check_temperatures(
        &self,
        model: &AugmentedModel,
        logs: &[LogData],
        stretches: &[Stretch],
    ) -> Result<(), IdentifyError> {
        self.check_taken(&of_model(model), logs, stretches)
    }

    /// The same of effects in any place.
    pub(crate) fn check_taken(
        &self,
        taken: &[EffectTemperature],
        logs: &[LogData],
        stretches: &[Stretch],
    ) -> Result<(), IdentifyError> {
        for EffectTemperature { effect, joint } in taken {
            let lacking = stretches.iter().find(|s| !s.has_temperature(*joint));
            if let Some(log) = lacking.and_then(|s| logs.get(s.log)) {
                let error = log.recording().temperatures().err();
                return Err(self.no_temperature(&log.source, error, (effect, *joint)));
            }
        }
        Ok(())
    }

    /// The temperatures of a log for a model that takes some, without its rows.
    pub(crate) fn temperatures_for(
        &self,
        model: &AugmentedModel,
        log: &LogData,
    ) -> Result<JointTemperatures, IdentifyError> {
        let found = log.recording().temperatures().cloned();
        self.temperatures_among(model, &log.source, found)
    }

    /// The same of a log that is read as its rows come, whose times count from `origin`.
    pub(crate) fn temperatures_along(
        &self,
        model: &AugmentedModel,
        log: &Log,
        origin: Instant,
    ) -> Result<JointTemperatures, IdentifyError> {
        let found = match (log, self.file.temperature_layout()) {
            (Log::File(spec), Some((joints, layout))) => {
                JointTemperatures::read(spec, (&joints, &layout), origin)
            }
            (Log::Arrays(arrays), _) => Ok(arrays.temperatures()),
            _ => Ok(JointTemperatures::default()),
        };
        self.temperatures_among(model, log, found)
    }

    fn temperatures_among(
        &self,
        model: &AugmentedModel,
        log: &Log,
        found: Result<JointTemperatures, LogError>,
    ) -> Result<JointTemperatures, IdentifyError> {
        let taken = of_model(model);
        if taken.is_empty() {
            return Ok(JointTemperatures::default());
        }
        let at = |t: &EffectTemperature| found.as_ref().ok()?.at(t.joint, 0.0);
        match taken.iter().find(|t| at(t).is_none()) {
            Some(EffectTemperature { effect, joint }) => {
                Err(self.no_temperature(log, found.err(), (effect, *joint)))
            }
            None => Ok(found.unwrap_or_default()),
        }
    }

    fn no_temperature(
        &self,
        log: &Log,
        error: Option<LogError>,
        (effect, joint): (&str, usize),
    ) -> IdentifyError {
        let name = &self.robot.joint_names()[joint];
        let why = match (error, log) {
            (Some(error), _) => error.explanation(),
            (None, Log::Arrays(_)) => "give it with the log's other arrays".into(),
            (None, _) => format!(
                "name its column, `[log.joint.{name}] temperature = \"COLUMN\"` in the robot or model file, or leave {name} \
                 out of the formula and of the `joints` of its [[candidate]] table"
            )
            .into(),
        };
        IdentifyError::NoTemperature {
            log: log.name(),
            effect: effect.to_owned(),
            joint: name.clone(),
            why: Box::new(why),
        }
    }
}
