//! Model files as text: read with checks, written to be read by people.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::candidates::{self, CandidateSection};
use super::contents::{self, ModelContents};
use super::document::TomlDocument;
use super::embedded::other_kind;
use super::held_out::{HeldOut, TorqueExcesses};
use super::limits::Limits;
use super::model_file::{
    Covariance, EffectSection, Estimate, FrictionPrior, LinkBody, ModelFile, ModelProvenance,
    Parameter,
};
use super::robot_file::{
    ControlSection, FilterSection, FrictionSection, NoiseSection, RobotFile, RobotSection,
    SensorsSection,
};
use super::robot_file::{ModelKind, ReadingNotes};
use super::{ConfigError, check, urdf};
use cft_ident_core::robot::drive::JointDrive;
use cft_ident_logs::log::{LogSection, escape};

/// The file as it is written: the sections of a robot file, and what was identified.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelToml {
    contents: Option<ModelContents>,
    robot: RobotSection,
    #[serde(default)]
    friction: FrictionSection,
    #[serde(default)]
    log: LogSection,
    #[serde(default)]
    filter: FilterSection,
    #[serde(default)]
    noise: NoiseSection,
    #[serde(default)]
    limits: Limits,
    #[serde(default)]
    drive: BTreeMap<String, JointDrive>,
    #[serde(default)]
    control: ControlSection,
    #[serde(default)]
    sensors: SensorsSection,
    #[serde(default)]
    parameter: Vec<Parameter>,
    covariance: Option<Covariance>,
    #[serde(default)]
    residual_std: BTreeMap<String, f64>,
    #[serde(default)]
    friction_prior: Vec<FrictionPrior>,
    #[serde(default)]
    held_out: Vec<HeldOut>,
    excesses: Option<TorqueExcesses>,
    #[serde(default)]
    candidate: Vec<CandidateSection>,
    #[serde(default)]
    effect: Vec<EffectSection>,
    #[serde(default)]
    estimate: Vec<Estimate>,
    estimate_covariance: Option<Covariance>,
    #[serde(default)]
    link: Vec<LinkBody>,
    #[serde(default)]
    drive_inertia: BTreeMap<String, f64>,
    provenance: Option<ModelProvenance>,
}

/// Appends what was written of a part of the file.
fn put(
    text: &mut String,
    head: &str,
    written: Result<String, toml::ser::Error>,
) -> Result<(), ConfigError> {
    text.push_str(head);
    text.push_str(&written.map_err(|error| ConfigError::Syntax {
        file: "model".to_owned(),
        line: 1,
        problem: format!("cannot be written: {error}").into(),
    })?);
    Ok(())
}

/// Appends a table, or several of one name.
fn put_table(
    text: &mut String,
    head: &str,
    key: &str,
    value: &impl Serialize,
) -> Result<(), ConfigError> {
    put(text, head, toml::to_string(&BTreeMap::from([(key, value)])))
}

impl Covariance {
    /// Names and rows, as keys of a table whose head is written.
    fn write(&self, text: &mut String) {
        text.push_str("names = [\n");
        for name in &self.names {
            let _ = writeln!(text, "  {},", toml::Value::from(name.as_str()));
        }
        text.push_str("]\nmatrix = [\n");
        for row in &self.matrix {
            let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
            let _ = writeln!(text, "  [{}],", row.join(", "));
        }
        text.push_str("]\n");
    }
}

impl RobotFile {
    /// The robot file as TOML text that stands alone: the links and limits of its URDF are in it.
    ///
    /// # Errors
    /// A content that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String, ConfigError> {
        let mut text = String::new();
        put(&mut text, "", toml::to_string(self))?;
        Ok(text)
    }
}

impl ModelFile {
    /// Reads a model from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Everything that a robot file can have wrong; a parameter twice, or not finite; a covariance
    /// that is not square or names what is no parameter.
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        Self::parse_in(file, text, None)
    }

    /// The same for the text of a file in `folder`, from where the URDF is read that it may name:
    /// base parameters that the file does not give are then those of the URDF's inertials.
    pub fn parse_in(file: &str, text: &str, folder: Option<&Path>) -> Result<Self, ConfigError> {
        if let Some(kind) = other_kind(Path::new(file), text) {
            return Err(kind);
        }
        let document = TomlDocument::new(file, text);
        let mut raw: ModelToml = document.read()?;
        if raw.parameter.is_empty() && raw.provenance.is_none() {
            return Err(ConfigError::Kind {
                file: file.to_owned(),
                found: "a robot file",
                wanted: "a model file",
                remedy: format!(
                    "fit a model first: cft-ident lsq LOG -r {file} -o model.toml; then give model.toml"
                ),
            });
        }
        if raw.held_out.iter().any(HeldOut::is_of_0_2) {
            let problem = "is as version 0.2 wrote it, whose model files are no longer read";
            let remedy = "fit again: `cft-ident lsq LOG.. -r ROBOT.toml -o MODEL.toml`";
            return Err(document.value(&["held_out"], problem, remedy));
        }
        let mut robot = RobotFile {
            robot: raw.robot,
            friction: raw.friction,
            log: raw.log,
            filter: raw.filter,
            noise: raw.noise,
            limits: raw.limits,
            drive: raw.drive,
            control: raw.control,
            sensors: raw.sensors,
            notes: ReadingNotes::default(),
        };
        let beside = robot.robot.urdf.is_some();
        let written: Vec<String> = raw.parameter.iter().map(Parameter::key).collect();
        urdf::resolve(&mut robot, &document, folder)?;
        check::check(&robot, &document)?;
        if beside {
            urdf::beside::base_parameters(&robot, &mut raw.parameter, &document)?;
        }
        if raw.parameter.is_empty() {
            return Err(document.missing(
                &["parameter"],
                "[[parameter]] tables, or fit the model again",
            ));
        }
        let mut model = Self {
            robot,
            parameters: raw.parameter,
            covariance: raw.covariance,
            residual_std: raw.residual_std,
            friction_prior: raw.friction_prior,
            held_out: raw.held_out,
            excesses: raw.excesses,
            candidates: raw.candidate,
            effects: raw.effect,
            estimates: raw.estimate,
            estimate_covariance: raw.estimate_covariance,
            links: raw.link,
            drive_inertia: raw.drive_inertia,
            provenance: raw.provenance.unwrap_or_default(),
        };
        model.check_parameters(&document)?;
        match &raw.contents {
            Some(contents) => contents.check(&model, written, &document)?,
            None => {
                contents::check_by_robot(&model, file)?;
                model.robot.notes.0.push(contents::without_list(file));
            }
        }
        model.check_covariance("covariance", model.covariance.as_ref(), &document)?;
        let estimated = model.estimate_covariance.as_ref();
        model.check_covariance("estimate_covariance", estimated, &document)?;
        candidates::check(&model.candidates, &document)?;
        model.check_rest(&document)?;
        Ok(model)
    }

    /// The model as TOML text. Numbers are written shortest, so that they are read back bit for bit.
    ///
    /// # Errors
    /// A number that is not finite, or any other content that could not be read back.
    pub fn to_toml(&self) -> Result<String, ConfigError> {
        let mut text = String::from(
            "# A dynamic model identified by cft-ident. SI units and radians. It may be edited by hand.\n\n",
        );
        text.push_str(&self.sections()?);
        // What cannot be read back must not be written.
        Self::parse("model", &text)?;
        Ok(text)
    }

    /// The sections of [`Self::to_toml`], without its head.
    ///
    /// # Errors
    /// A content that TOML cannot hold.
    pub fn sections(&self) -> Result<String, ConfigError> {
        let mut text = String::new();
        put(
            &mut text,
            "# What this file must hold, so that a part that is lost is noticed. Values may be edited.\n",
            toml::to_string_pretty(&BTreeMap::from([("contents", ModelContents::of(self))])),
        )?;
        put(&mut text, "\n", toml::to_string(&self.robot))?;
        text.push_str("\n# Parameters: value and standard deviation of the fit in `unit`, theta as in the report's Table 4. Torques are computed\n# with `consistent` where it stands: the nearest numbers of links, drives and friction that can exist.\n");
        for parameter in &self.parameters {
            put(&mut text, "\n[[parameter]]\n", toml::to_string(parameter))?;
        }
        if let Some(covariance) = &self.covariance {
            text.push_str(
                "\n# Covariance of the parameters: row and column i belong to names[i].\n[covariance]\n",
            );
            covariance.write(&mut text);
        }
        if !self.residual_std.is_empty() {
            put_table(
                &mut text,
                "\n# Standard deviation of the torque residual by joint.\n",
                "residual_std",
                &self.residual_std,
            )?;
        }
        if !self.friction_prior.is_empty() {
            put_table(
                &mut text,
                "\n# Friction by one-joint logs: the speeds and logs, and where other logs refined it the values and\n# the covariance of before. A fit of the same logs begins there, so that none counts twice.\n",
                "friction_prior",
                &self.friction_prior,
            )?;
        }
        if !self.held_out.is_empty() {
            put_table(
                &mut text,
                "\n# What the model leaves of torques that it did not see, blocks of its logs set aside one after the other:\n# for prediction bands and alarms.\n",
                "held_out",
                &self.held_out,
            )?;
        }
        if let Some(excesses) = &self.excesses {
            put_table(&mut text, "\n", "excesses", excesses)?;
        }
        if !self.candidates.is_empty() {
            put_table(
                &mut text,
                "\n# Formulas of effects that are the user's own.\n",
                "candidate",
                &self.candidates,
            )?;
        }
        if !self.effects.is_empty() {
            let head = "\n# Effects added to the declared model.\n";
            put_table(&mut text, head, "effect", &self.effects)?;
        }
        if !self.estimates.is_empty() {
            put_table(
                &mut text,
                "\n# Estimates: the physical numbers. The parameters and effects above predict with a part of some effects, and are none.\n",
                "estimate",
                &self.estimates,
            )?;
        }
        if let Some(covariance) = &self.estimate_covariance {
            text.push_str(
                "\n# Covariance of the estimates that are parameters.\n[estimate_covariance]\n",
            );
            covariance.write(&mut text);
        }
        if !self.links.is_empty() {
            text.push_str("\n# Links that can exist and give the consistent parameters above: kg, centre of gravity in the link's frame in m,\n# Ixx, Ixy, Ixz, Iyy, Iyz, Izz about it in kg m^2.\n");
        }
        for link in &self.links {
            put(&mut text, "\n[[link]]\n", toml::to_string(link))?;
        }
        if !self.drive_inertia.is_empty() {
            put_table(
                &mut text,
                "\n# Inertias of the drives beside them.\n",
                "drive_inertia",
                &self.drive_inertia,
            )?;
        }
        put_table(&mut text, "\n", "provenance", &self.provenance)?;
        Ok(text)
    }

    fn check_parameters(&self, document: &TomlDocument) -> Result<(), ConfigError> {
        let joints = self.robot.joint_names();
        let mut seen = BTreeSet::new();
        for (index, parameter) in self.parameters.iter().enumerate() {
            let index_text = index.to_string();
            let at = |key| ["parameter", index_text.as_str(), key];
            document.not_negative(&at("std"), parameter.std)?;
            if let Some(joint) = &parameter.joint {
                document.known_joint(&at("joint"), joint, &joints)?;
            }
            if !seen.insert(parameter.key()) {
                let remedy = "keep one table for each parameter";
                return Err(document.value(&at("name"), "is there twice", remedy));
            }
        }
        Ok(())
    }

    fn check_covariance(
        &self,
        table: &str,
        covariance: Option<&Covariance>,
        document: &TomlDocument,
    ) -> Result<(), ConfigError> {
        let Some(covariance) = covariance else {
            return Ok(());
        };
        let size = covariance.names.len();
        let known: Vec<String> = self.parameters.iter().map(Parameter::key).collect();
        for (index, name) in covariance.names.iter().enumerate() {
            if !known.contains(name) || covariance.names[..index].contains(name) {
                let name = escape(name);
                let problem = format!("names `{name}`, which is no parameter or there twice");
                let remedy = "use each parameter once, as `name` or `name:joint`";
                return Err(document.value(&[table, "names"], &problem, remedy));
            }
        }
        let square = covariance.matrix.len() == size
            && covariance.matrix.iter().all(|row| row.len() == size);
        if !square {
            let remedy = format!("give {size} rows of {size} numbers, or delete [{table}]");
            let problem = "does not have the size of `names`";
            return Err(document.value(&[table, "matrix"], problem, &remedy));
        }
        Ok(())
    }

    fn check_held_out(&self, document: &TomlDocument) -> Result<(), ConfigError> {
        let joints = self.robot.joint_names();
        let refit = "fit the model again; what stands here is no number to choose";
        let mut there = self.held_out.iter().map(|held| &held.joint);
        if !self.held_out.is_empty() && !joints.iter().all(|joint| there.next() == Some(joint)) {
            let joints = joints.join(", ");
            let remedy = format!("give one table for each of {joints}, in this order, or none");
            let at = ["held_out", "0", "joint"];
            return Err(document.value(&at, "is not in its place", &remedy));
        }
        for (index, held) in self.held_out.iter().enumerate() {
            if let Some((key, problem)) = held.fault() {
                let at = ["held_out", &index.to_string(), key];
                return Err(document.value(&at, problem, refit));
            }
        }
        match &self.excesses {
            Some(excesses) if !excesses.is_possible() => {
                let problem = "has numbers that no excesses have";
                Err(document.value(&["excesses", "scale"], problem, refit))
            }
            _ => Ok(()),
        }
    }

    fn check_rest(&self, document: &TomlDocument) -> Result<(), ConfigError> {
        let joints = self.robot.joint_names();
        for (joint, std) in &self.residual_std {
            document.known_joint(&["residual_std", joint], joint, &joints)?;
            document.not_negative(&["residual_std", joint], Some(*std))?;
        }
        for (index, prior) in self.friction_prior.iter().enumerate() {
            let at = ["friction_prior", &index.to_string(), "joint"];
            document.known_joint(&at, &prior.joint, &joints)?;
        }
        self.check_held_out(document)?;
        for (joint, inertia) in &self.drive_inertia {
            document.not_negative(&["drive_inertia", joint], Some(*inertia))?;
        }
        for (index, effect) in self.effects.iter().enumerate() {
            let index_text = index.to_string();
            // the pantograph's references, where the CFT robot's screws are
            let of_screw = |joint: &String| {
                self.robot.robot.model == ModelKind::Cft && matches!(joint.as_str(), "x_r" | "y_r")
            };
            if let Some(joint) = &effect.joint
                && !self.robot.coordinate_names().contains(joint)
                && !of_screw(joint)
            {
                document.known_joint(&["effect", &index_text, "joint"], joint, &joints)?;
            }
            for (key, parameter) in &effect.parameters {
                let at = ["effect", &index_text, "parameters", key, "std"];
                document.not_negative(&at, parameter.std)?;
            }
        }
        Ok(())
    }
}
