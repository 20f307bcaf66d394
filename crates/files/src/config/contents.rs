//! What a model file must hold: a list at its head, by which a part that was lost is noticed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::document::TomlDocument;
use super::model_file::{Covariance, EffectSection, ModelFile, Parameter};
use cft_ident_logs::log::escape;

/// The parts of a model file. Values may be edited; a table that is taken out is taken out here as well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Contents")]
pub struct ModelContents {
    /// Keys of the parameters ([`Parameter::key`]).
    parameters: Vec<String>,
    /// Effects as `name`, `name:joint` and the keys of their parameters: `ripple:q4:cos,order,sin`.
    effects: Vec<String>,
    /// Rows of the covariance; 0 where there is none.
    covariance: usize,
    /// Rows of the covariance of the estimates; 0 where there is none.
    #[serde(default, skip_serializing_if = "is_none")]
    estimate_covariance: usize,
    /// Joints whose residual is known.
    residual_std: Vec<String>,
    /// Joints of which it keeps the friction from one-joint logs.
    #[serde(default)]
    friction_prior: Vec<String>,
    /// Joints of which it keeps what was left of torques that were set aside.
    #[serde(default)]
    held_out: Vec<String>,
    /// Number of physically consistent links.
    links: usize,
    /// Joints whose drive's inertia is given beside them.
    drive_inertia: Vec<String>,
    /// Number of inputs in the provenance.
    inputs: usize,
}

fn is_none(rows: &usize) -> bool {
    *rows == 0
}

/// An effect with its place and the keys of its parameters.
fn effect_key(effect: &EffectSection) -> String {
    let keys: Vec<&str> = effect.parameters.keys().map(String::as_str).collect();
    let place = effect.joint.as_ref().map(|joint| format!(":{joint}"));
    let name = format!("{}{}", effect.name, place.unwrap_or_default());
    match keys.is_empty() {
        true => name,
        false => format!("{name}:{}", keys.join(",")),
    }
}

impl ModelContents {
    pub(super) fn of(model: &ModelFile) -> Self {
        let priors = model.friction_prior.iter();
        let rows = |of: &Option<Covariance>| of.as_ref().map_or(0, |c| c.names.len());
        Self {
            parameters: model.parameters.iter().map(Parameter::key).collect(),
            effects: model.effects.iter().map(effect_key).collect(),
            covariance: rows(&model.covariance),
            estimate_covariance: rows(&model.estimate_covariance),
            residual_std: model.residual_std.keys().cloned().collect(),
            friction_prior: priors.map(|p| p.joint.clone()).collect(),
            held_out: model.held_out.iter().map(|h| h.joint.clone()).collect(),
            links: model.links.len(),
            drive_inertia: model.drive_inertia.keys().cloned().collect(),
            inputs: model.provenance.inputs.len(),
        }
    }

    /// Refuses a model that lacks something of the list; `written` are the keys of the file, without those of a URDF.
    pub(super) fn check(
        &self,
        model: &ModelFile,
        written: Vec<String>,
        document: &TomlDocument,
    ) -> Result<(), ConfigError> {
        let found = Self::of(model);
        let names = [
            ("parameters", &self.parameters, written),
            ("effects", &self.effects, found.effects),
            ("residual_std", &self.residual_std, found.residual_std),
            ("drive_inertia", &self.drive_inertia, found.drive_inertia),
            ("friction_prior", &self.friction_prior, found.friction_prior),
            ("held_out", &self.held_out, found.held_out),
        ];
        for (list, wanted, mut found) in names {
            for name in wanted {
                // each stands for one: two effects may have one name
                let Some(at) = found.iter().position(|known| known == name) else {
                    let mut problem = format!("names `{}`, which the file lacks", escape(name));
                    // a name that was misspelt, not lost
                    if let Some(other) = found.iter().find(|known| !wanted.contains(known)) {
                        let kind = name.split(':').next().unwrap_or(name);
                        problem += &format!(
                            "; it holds `{}`, which the list does not name: did you mean `{}`?",
                            escape(other),
                            escape(kind)
                        );
                    }
                    return Err(lost(document, list, &problem));
                };
                found.swap_remove(at);
            }
        }
        let counts = [
            ("covariance", self.covariance, found.covariance, "rows"),
            (
                "estimate_covariance",
                self.estimate_covariance,
                found.estimate_covariance,
                "rows",
            ),
            ("links", self.links, found.links, "[[link]] tables"),
            (
                "inputs",
                self.inputs,
                found.inputs,
                "[[provenance.inputs]] tables",
            ),
        ];
        for (count, wanted, found, what) in counts {
            if found < wanted {
                let problem = format!("is {wanted}, but the file has {found} {what}");
                return Err(lost(document, count, &problem));
            }
        }
        Ok(())
    }
}

fn lost(document: &TomlDocument, list: &str, problem: &str) -> ConfigError {
    let remedy = "a part of the file was lost: copy it again whole; if the part was taken out on purpose, take it out of [contents] too";
    document.value(&["contents", list], problem, remedy)
}

/// Refuses a file without a list that lacks what its robot asks for, as far as that can be known.
pub(super) fn check_by_robot(model: &ModelFile, file: &str) -> Result<(), ConfigError> {
    let robot = model.robot.robot();
    let names = model.robot.friction_law().names();
    let mut inertial = robot.parameters().iter();
    let has_inertial = inertial.any(|p| model.find(&p.name, None).is_some());
    if has_inertial {
        model.inertial(file)?;
    }
    let friction = &model.robot.friction;
    let all = has_inertial && (friction.fitted_with_inertias || model.robot.needs_friction_first());
    for joint in robot.joint_names() {
        let has = |name: &&str| model.find(name, Some(joint)).is_some();
        if all || names.iter().any(has) {
            for name in names {
                model.parameter(file, name, Some(joint))?;
            }
        }
        if all && friction.offset {
            model.parameter(file, "offset", Some(joint))?;
        }
    }
    Ok(())
}

/// The word about a file without a list.
pub(super) fn without_list(file: &str) -> String {
    format!(
        "{file}: has no [contents], as version 0.1 wrote it: its parameters are checked against its robot, \
         but an effect or a covariance that was lost is not noticed; write it again to be sure"
    )
}
