//! Two models of one robot beside each other, and on the same logs.

use schemars::JsonSchema;
use serde::Serialize;

use crate::compare::{self, Difference, ErrorDifferences, ParameterPair, SideBySide};
use crate::input::control::Control;
use crate::input::curve::friction_curve;
use crate::input::dataset::GivenModel;
use crate::input::error::IdentifyError;
use crate::input::in_memory::{InMemory, read_whole};
use crate::input::log::Log;
use crate::input::log_data::LogData;
use crate::input::model::refined_or_friction;
use crate::input::position_cutoff::known;
use crate::input::repeated::{identities, repeated_rows};
use crate::input::robot_setup::RobotSetup;
use crate::note::{ModelNote, StageNote};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::friction::estimate::FrictionCurvePoint;
use cft_ident_core::motion::ParallelFilters;
use cft_ident_core::motion::Summary;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_core::validate::{
    JointError, OverallTorqueErrors, TorqueReconstruction, TorqueValidation,
};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::{Provenance, escape};

/// Deviation from which on two estimates are called different: 95 % of a normal distribution.
pub const DIFFERENT: f64 = 1.96;

/// A model file with what it stands for.
pub struct ComparedFile {
    pub given: GivenModel,
    pub model: AugmentedModel,
}

/// Both models on the same logs.
pub struct TriedOnLogs {
    pub in_memory: InMemory,
    pub validations: [TorqueValidation; 2],
    pub differences: ErrorDifferences,
}

/// Result of the comparison.
pub struct Compared {
    pub setup: RobotSetup,
    pub sides: [ComparedFile; 2],
    pub table: SideBySide,
    pub curves: Vec<FrictionCurves>,
    /// None where no log is given.
    pub tried: Option<TriedOnLogs>,
    pub notes: Vec<StageNote>,
}

/// Friction of one joint by both models.
pub struct FrictionCurves {
    pub joint: String,
    pub speed_unit: String,
    pub torque_unit: String,
    /// Largest speed of the curves, and where it is from.
    pub most: f64,
    pub speeds_from: &'static str,
    pub laws: [Option<JointFriction>; 2],
}

/// A comparison as a document holds it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ComparisonResult {
    /// A and B.
    pub models: Vec<ComparedModel>,
    #[serde(flatten)]
    pub table: SideBySide,
    /// Joints where a model has friction.
    pub friction: Vec<ComparedFriction>,
    /// Null where no log is given.
    pub logs: Option<ComparedOnLogs>,
}

/// Where a model comes from.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ComparedModel {
    /// Name of its file.
    pub name: String,
    /// Version of the tool that wrote it.
    pub version: String,
    /// Command that wrote it.
    pub command: String,
    /// What it was made from.
    pub inputs: Vec<Provenance>,
}

/// Friction of one joint by both models.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ComparedFriction {
    pub joint: String,
    pub speed_unit: String,
    pub torque_unit: String,
    /// What the largest speed is from.
    #[schemars(extend("enum" = ["logs", "limits", "assumed"]))]
    pub speeds_from: &'static str,
    pub curve: Vec<BothAt>,
}

/// Friction at one speed; null where a model has none.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BothAt {
    /// Velocity \[speed_unit\].
    pub v: Option<f64>,
    /// Torque \[torque_unit\], and its standard deviation.
    pub a: Option<f64>,
    pub a_std: Option<f64>,
    pub b: Option<f64>,
    pub b_std: Option<f64>,
}

/// Both models on the same logs.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ComparedOnLogs {
    pub joints: Vec<ComparedErrors<JointError>>,
    pub overall: ComparedErrors<OverallTorqueErrors>,
    pub processing: Summary,
}

/// Errors of both.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ComparedErrors<T> {
    /// The joint; absent over all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Unit of its torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    pub a: T,
    pub b: T,
    #[serde(flatten)]
    pub difference: Difference,
}

impl TriedOnLogs {
    fn result(&self) -> ComparedOnLogs {
        let [a, b] = self.validations.each_ref().map(|v| &v.errors);
        let joints = a.joints.iter().zip(&b.joints);
        let joint =
            |((a, b), difference): ((&JointError, &JointError), &Difference)| ComparedErrors {
                joint: Some(a.joint.clone()),
                unit: Some(a.unit),
                a: a.clone(),
                b: b.clone(),
                difference: *difference,
            };
        ComparedOnLogs {
            joints: joints.zip(&self.differences.joints).map(joint).collect(),
            overall: ComparedErrors {
                joint: None,
                unit: None,
                a: a.overall,
                b: b.overall,
                difference: self.differences.overall,
            },
            processing: self.in_memory.summary.clone(),
        }
    }
}

/// A model; without logs one of friction alone will do.
fn side(given: GivenModel, logs: bool) -> Result<ComparedFile, IdentifyError> {
    let model = match logs {
        true => given.numbers()?,
        false => refined_or_friction(&given.file, &given.name)?,
    };
    Ok(ComparedFile { given, model })
}

/// Refuses two models whose parameters and torques are not of one robot.
fn one_robot([a, b]: [&ComparedFile; 2]) -> Result<(), IdentifyError> {
    let describe = |side: &ComparedFile| {
        let (robot, file) = (&side.model.model.robot, &side.given.file.robot);
        let joints = robot.joint_names().iter().enumerate();
        let words = joints.map(|(j, name)| {
            let position = robot.joint_kind(j).position_unit();
            format!("{} ({position}, {})", escape(name), file.torque_unit(j))
        });
        words.collect::<Vec<_>>().join(", ")
    };
    let (ours, theirs) = (describe(a), describe(b));
    if ours == theirs {
        return Ok(());
    }
    Err(IdentifyError::OtherRobot {
        first: a.given.name.clone(),
        second: b.given.name.clone(),
        ours,
        theirs,
    })
}

/// What a reader has to know before believing a difference.
fn cautions([a, b]: [&ComparedFile; 2], logs: bool) -> Vec<ModelNote> {
    let mut out = Vec::new();
    let (first, second) = (&a.given.file, &b.given.file);
    let made = |file: &ModelFile| file.provenance.inputs.clone();
    let shared: Vec<String> = made(first)
        .iter()
        .filter(|i| i.made())
        .filter(|i| made(second).iter().any(|o| o.made() && o.shares_rows(i)))
        .map(|i| escape(&i.name))
        .collect();
    if !shared.is_empty() {
        out.push(ModelNote::SharedLogs { logs: shared });
    }
    if logs && first.robot.robot.setup != second.robot.robot.setup {
        out.push(ModelNote::OtherSetup);
    }
    if logs && first.robot.log != second.robot.log {
        out.push(ModelNote::OtherMapping);
    }
    if logs && first.robot.filter != second.robot.filter {
        out.push(ModelNote::OtherFilter);
    }
    out
}

/// Compares two models, and both on the same logs where there are some.
///
/// # Errors
/// Models and logs that cannot be used, and models of different robots.
pub fn compare(
    [a, b]: [GivenModel; 2],
    logs: &[Log],
    control: &Control,
) -> Result<Compared, IdentifyError> {
    let sides = [side(a, !logs.is_empty())?, side(b, !logs.is_empty())?];
    one_robot(sides.each_ref())?;
    let first = &sides[0].given;
    let setup = first.setup();
    let cautions = cautions(sides.each_ref(), !logs.is_empty()).into_iter();
    let mut notes: Vec<StageNote> = cautions.map(StageNote::Model).collect();
    let logs = LogData::read_all(&setup, logs, &[], control)?;
    notes.extend(repeated_rows(&identities(&logs)));
    let tried = match logs.as_slice() {
        [] => None,
        logs => Some(on_logs(&setup, &sides, logs, control)?),
    };
    if let Some(tried) = &tried {
        notes.extend(tried.in_memory.notes.iter().cloned());
    }
    Ok(Compared {
        table: compare::side_by_side(&sides[0].given.file, &sides[1].given.file),
        curves: curves(&setup, &sides, tried.as_ref()),
        setup,
        sides,
        tried,
        notes,
    })
}

fn on_logs(
    setup: &RobotSetup,
    sides: &[ComparedFile; 2],
    logs: &[LogData],
    control: &Control,
) -> Result<TriedOnLogs, IdentifyError> {
    // one motion for both models: that of the first
    let laws = known(&sides[0].model.model);
    let setup = &setup.with_position_cutoffs(logs, &laws, control)?;
    let in_memory = read_whole(setup, logs, control)?;
    for side in sides {
        setup.check_temperatures(&side.model, logs, &in_memory.stretches)?;
    }
    let settings = setup.settings();
    let named = |error| IdentifyError::motion(&setup.name, error);
    let validation = |side: &ComparedFile| {
        let mut all = TorqueReconstruction::new(&side.model.model, &in_memory.rest_speed, None);
        for (segment, stretch) in in_memory.stretches.iter().enumerate() {
            let hat = side.model.reconstruct(stretch);
            all.add_stretch(&settings, segment, stretch, &hat, &mut |_| {})
                .map_err(named)?;
        }
        let mut validation = all.finish(in_memory.summary.clone());
        setup.name_units(&mut validation.errors);
        Ok::<_, IdentifyError>(validation)
    };
    let validations = [validation(&sides[0])?, validation(&sides[1])?];
    control.check()?;
    let filters = ParallelFilters::design(&settings, &in_memory.stretches).map_err(named)?;
    let models = sides.each_ref().map(|side| &side.model);
    let differences =
        compare::differences(models, &in_memory.stretches, &filters).map_err(named)?;
    Ok(TriedOnLogs {
        in_memory,
        validations,
        differences,
    })
}

/// Friction of the joints where a model has some.
fn curves(
    setup: &RobotSetup,
    sides: &[ComparedFile; 2],
    tried: Option<&TriedOnLogs>,
) -> Vec<FrictionCurves> {
    let robot = &setup.robot;
    let joints = robot.joint_names().iter().enumerate();
    joints
        .filter_map(|(j, joint)| {
            let laws = sides.each_ref().map(|side| {
                let law = side.model.model.friction.get(j).copied();
                law.filter(|law| *law != JointFriction::None)
            });
            laws.iter().flatten().next()?;
            let seen = tried.and_then(|tried| {
                let all = tried.in_memory.stretches.iter().filter_map(|s| s.v.get(j));
                let most = all.flatten().fold(0.0, |most: f64, v| most.max(v.abs()));
                (most > 0.0).then_some(most)
            });
            let limit = |side: &ComparedFile| side.given.file.robot.limits.get(joint)?.speed;
            let limit = || sides.iter().find_map(limit);
            let (most, speeds_from) = match seen {
                Some(most) => (most, "logs"),
                None => limit().map_or((1.0, "assumed"), |most| (most, "limits")),
            };
            Some(FrictionCurves {
                joint: joint.clone(),
                speed_unit: format!("{}/s", robot.joint_kind(j).position_unit()),
                torque_unit: setup.file.torque_unit(j).to_owned(),
                most,
                speeds_from,
                laws,
            })
        })
        .collect()
}

impl Compared {
    /// The comparison as a document holds it.
    pub fn result(&self) -> ComparisonResult {
        let model = |side: &ComparedFile| {
            let from = &side.given.file.provenance;
            ComparedModel {
                name: side.given.file_name.clone(),
                version: from.version.clone(),
                command: from.command.clone(),
                inputs: from.inputs.clone(),
            }
        };
        ComparisonResult {
            models: self.sides.iter().map(model).collect(),
            table: self.table.clone(),
            friction: self.curves.iter().map(|c| self.friction(c)).collect(),
            logs: self.tried.as_ref().map(TriedOnLogs::result),
        }
    }

    fn friction(&self, curves: &FrictionCurves) -> ComparedFriction {
        // 50 equal steps in each direction
        let steps = (-50..=50).filter(|k| *k != 0);
        let [a, b] = self.at(curves, steps.map(|k| f64::from(k) / 50.0 * curves.most));
        let point = |i: usize| {
            let (a, b) = (a.get(i), b.get(i));
            BothAt {
                v: a.or(b).map(|p| p.v),
                a: a.map(|p| p.torque),
                a_std: a.map(|p| p.std),
                b: b.map(|p| p.torque),
                b_std: b.map(|p| p.std),
            }
        };
        ComparedFriction {
            joint: curves.joint.clone(),
            speed_unit: curves.speed_unit.clone(),
            torque_unit: curves.torque_unit.clone(),
            speeds_from: curves.speeds_from,
            curve: (0..a.len().max(b.len())).map(point).collect(),
        }
    }

    /// Both curves of a joint at these speeds; an empty one where a model has no friction there.
    pub fn at(
        &self,
        curves: &FrictionCurves,
        speeds: impl Iterator<Item = f64> + Clone,
    ) -> [Vec<FrictionCurvePoint>; 2] {
        let of = |k: usize| match &curves.laws[k] {
            None => Vec::new(),
            Some(law) => {
                let file = &self.sides[k].given.file;
                friction_curve(file, law, &curves.joint, speeds.clone())
            }
        };
        [of(0), of(1)]
    }

    /// Name of a model's file.
    pub fn name(&self, side: usize) -> String {
        escape(&self.sides[side].given.file_name)
    }

    /// Parameters that differ by more than chance explains, the largest deviation first.
    pub fn different(&self) -> Vec<&ParameterPair> {
        let beyond = |p: &&ParameterPair| p.deviation.is_some_and(|d| d.abs() > DIFFERENT);
        let mut found: Vec<&ParameterPair> = self.table.parameters.iter().filter(beyond).collect();
        let size = |p: &ParameterPair| p.deviation.unwrap_or(0.0).abs();
        found.sort_by(|x, y| size(y).total_cmp(&size(x)));
        found
    }
}
