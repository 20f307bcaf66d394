//! A robot as its file describes it: its dynamics, and how its logs are read and processed.

use std::path::Path;
use std::sync::Arc;

use super::error::IdentifyError;
use cft_ident_core::effect::EffectPlace;
use cft_ident_core::friction::estimate::NARROWER;
use cft_ident_core::motion::{DifferenceFormula, FilterSettings, ParallelFilter, TorqueTiming};
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_core::validate::TorqueErrors;
use cft_ident_files::config::robot_file::{DifferencesKind, FilterKind};
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_logs::log::{RowFault, escape};

/// Share of a period of the cut-off for which rows may be missing: interpolation is at the noise there.
const BRIDGED_PERIODS: f64 = 0.125;

/// The same processing with a narrower position filter.
pub fn narrowed(settings: &FilterSettings, rate_hz: f64) -> FilterSettings {
    let each = settings.joint_q_cutoffs_hz.iter();
    FilterSettings {
        q_cutoff_hz: Some(NARROWER * settings.plain_q_cutoff_hz(rate_hz)),
        joint_q_cutoffs_hz: each.map(|hz| NARROWER * hz).collect(),
        ..settings.clone()
    }
}

/// A robot as its file describes it.
#[derive(Debug, Clone)]
pub struct RobotSetup {
    /// Name of the file, for messages.
    pub name: String,
    pub file: RobotFile,
    pub robot: Robot,
    /// Channels that are no torques are taken as they are, one gain for all joints.
    pub(crate) as_declared: bool,
    /// Position cut-offs that were found from logs, in joint order \[Hz\]; empty where none were.
    pub(crate) position_cutoffs_hz: Arc<Vec<f64>>,
}

impl RobotSetup {
    /// Unit of an effect's torque: that of its joint, of the first where it acts on all.
    pub fn torque_unit_at(&self, place: EffectPlace) -> &'static str {
        self.file.torque_unit(place.joint().unwrap_or(0))
    }

    /// Reads a robot file, or one that comes with the tool, such as `configs/cft.toml`.
    ///
    /// # Errors
    /// A file that cannot be read or used.
    pub fn load(path: &str) -> Result<Self, IdentifyError> {
        Ok(Self::new(path, RobotFile::load(Path::new(path))?))
    }

    /// The robot of a file that is read already.
    pub fn new(name: &str, file: RobotFile) -> Self {
        let robot = file.robot();
        RobotSetup {
            name: name.to_owned(),
            file,
            robot,
            position_cutoffs_hz: Arc::default(),
            as_declared: false,
        }
    }

    /// The robot of a model, its set-up kept as it is declared where that of the model was.
    pub fn of_model(name: &str, model: &ModelFile) -> Self {
        RobotSetup {
            as_declared: model.provenance.as_declared,
            ..Self::new(name, model.robot.clone())
        }
    }

    /// The same robot with another file, which its logs are looked at again by.
    pub(crate) fn with_file(&self, file: RobotFile) -> Self {
        RobotSetup {
            as_declared: self.as_declared,
            ..RobotSetup::new(&self.name, file)
        }
    }

    /// The same robot, its file taken at its word: a set-up that contradicts itself or the logs ends no
    /// stage.
    pub fn as_declared(self) -> Self {
        RobotSetup {
            as_declared: true,
            ..self
        }
    }

    /// Whether positions are lengths and angles, and torques of all joints count in units that gains relate to each
    /// other.
    ///
    /// # Errors
    /// [`IdentifyError::WithoutScale`] for positions in counts, and [`IdentifyError::WithoutGains`] for a robot of
    /// several joints whose channels are currents, say.
    pub fn check_gains(&self) -> Result<(), IdentifyError> {
        let counted = self.file.without_scale();
        if !counted.is_empty() {
            return Err(IdentifyError::WithoutScale {
                robot: escape(&self.name),
                joints: counted.join(", "),
            });
        }
        let found = self.file.without_gains();
        let Some((_, unit)) = found.first().filter(|_| !self.as_declared) else {
            return Ok(());
        };
        let names = self.robot.joint_names();
        let joints: Vec<&str> = found.iter().map(|(j, _)| names[*j].as_str()).collect();
        Err(IdentifyError::WithoutGains {
            robot: escape(&self.name),
            joints: joints.join(", "),
            unit,
        })
    }

    /// The same robot whose logs are not mended of a fault.
    pub(crate) fn keeping(&self, fault: RowFault) -> RobotSetup {
        let mut file = self.file.clone();
        file.log.keep.push(fault);
        RobotSetup {
            file,
            ..self.clone()
        }
    }

    /// Names the unit of every joint's torque as its channel has it.
    pub(crate) fn name_units(&self, errors: &mut TorqueErrors) {
        for (j, error) in errors.joints.iter_mut().enumerate() {
            error.unit = self.file.torque_unit(j);
        }
    }

    /// Processing of logs for least squares and validation.
    pub fn settings(&self) -> FilterSettings {
        let f = &self.file.filter;
        let plain = FilterSettings::default();
        let order = f.order.map(|o| o as usize);
        FilterSettings {
            cutoff_hz: f.cutoff_hz.unwrap_or(plain.cutoff_hz),
            filter: match f.kind {
                Some(FilterKind::ChebyshevDecimate) => ParallelFilter::Chebyshev {
                    order: order.unwrap_or(8),
                    ripple_db: f.ripple_db.unwrap_or(0.05),
                },
                Some(FilterKind::Butterworth) | None => ParallelFilter::Butterworth {
                    order: order.unwrap_or(4),
                },
            },
            decimation: f.decimation.map(|d| d as usize),
            q_cutoff_hz: f.position_cutoff_hz,
            joint_q_cutoffs_hz: self.position_cutoffs_hz.to_vec(),
            q_order: f.position_order.map_or(plain.q_order, |o| o as usize),
            differences: match f.differences {
                Some(DifferencesKind::Central) => DifferenceFormula::Central,
                Some(DifferencesKind::HighOrder) | None => DifferenceFormula::HighOrder,
            },
            // torques that hold are brought to their rows' time as the log is read
            torque: TorqueTiming::Sampled,
            gap_factor: f.gap_factor.unwrap_or(plain.gap_factor),
            // a factor that is declared is meant
            bridge_s: match f.gap_factor {
                Some(_) => 0.0,
                None => BRIDGED_PERIODS / f.cutoff_hz.unwrap_or(plain.cutoff_hz),
            },
            q_trim_s: f.position_trim_s,
            trim_s: f.trim_s,
            // each log says when its joints rest
            rest_speed: Vec::new(),
            weighs_rests: true,
            thin: false,
        }
    }

    /// Travel of a joint by its machine, else by the file's limits; a turn, or a metre, where neither has one.
    fn range(&self, j: usize, name: &str) -> f64 {
        if let Some(range) = self.robot.transmission().full_travel(j) {
            return range;
        }
        let limits = self.file.limits.get(name).and_then(|l| l.position);
        match (limits, self.robot.joint_kind(j)) {
            (Some([low, high]), _) => high - low,
            (None, JointKind::Revolute) => std::f64::consts::TAU,
            (None, JointKind::Prismatic) => 1.0,
        }
    }

    /// Full travel of each joint, by which motions of metres and radians are compared.
    pub fn ranges(&self) -> Vec<f64> {
        if self.robot.joints() == 1 {
            return vec![f64::MIN_POSITIVE];
        }
        let names = self.robot.joint_names().iter().enumerate();
        let range = |(j, name): (usize, &String)| self.range(j, name);
        names.map(range).collect()
    }
}
