//! The declared numbers beside effects, fitted as the given model was: by `lsq` on the same logs, with the torques of
//! the effects taken off. With no effect it gives back the given model.

use super::consistent::project_by;
use super::lsq::lsq_parameters;
use super::lsq_problem::LsqSettings;
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::log_data::LogData;
use crate::input::robot_setup::RobotSetup;
use crate::input::unknown_key::key_of;
use cft_ident_core::diagnose::{ModelProposal, Unknown, value_of};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::robot_file::FrictionLawKind;
use cft_ident_logs::log::Provenance;
use cft_ident_logs::recording::TorqueCourse;

/// How the declared numbers of a proposal are fitted.
pub(crate) struct OwnRefit<'a> {
    pub setup: &'a RobotSetup,
    pub given: &'a GivenModel,
    /// The logs that are fitted.
    pub logs: &'a [LogData],
    pub stretches: &'a [Stretch],
    pub unknowns: &'a [Unknown],
    /// The friction of the given model stays as it is.
    pub hold_friction: bool,
    /// The fit that made the given model; none where other logs made it, or another way.
    pub own: Option<OwnFit>,
    pub control: Control,
}

/// A fit by `lsq` that made a model.
pub(crate) struct OwnFit {
    /// The model with the friction as it was known before, where it was.
    friction: Option<GivenModel>,
    hold_friction: bool,
}

impl OwnFit {
    /// The fit of the logs `inputs` that made the given model, where one did: its friction, joint by joint `laws`, is
    /// then of the law that was fitted. `before` is the model with the friction that is known without them.
    pub fn of(
        (given, before): (&GivenModel, &ModelFile),
        laws: &[JointFriction],
        inputs: &[Provenance],
        (keep, hold_friction): (bool, bool),
    ) -> Option<Self> {
        let made = &given.file.provenance;
        let same = |a: &Provenance, b: &Provenance| {
            (&a.sha256, &a.span, a.samples) == (&b.sha256, &b.span, b.samples)
        };
        let fitted: Vec<&Provenance> = made.inputs.iter().filter(|input| input.made()).collect();
        let by_these = fitted.len() == inputs.len()
            && inputs.iter().all(|b| fitted.iter().any(|a| same(a, b)));
        let known = !given.file.friction_prior.is_empty();
        // friction that was not known before is of the law that the robot file names
        let fitted_law = match known {
            true => FrictionLawKind::DoubleTanh,
            false => given.file.robot.friction_law(),
        };
        let of_law = |law: &JointFriction| match law {
            JointFriction::None => true,
            JointFriction::DoubleTanh(_) => fitted_law == FrictionLawKind::DoubleTanh,
            JointFriction::ViscousCoulomb(_) => fitted_law == FrictionLawKind::ViscousCoulomb,
        };
        let by_lsq = made.command == "lsq" && made.estimator.is_none() && laws.iter().all(of_law);
        (by_these && by_lsq && !keep).then(|| OwnFit {
            friction: known.then(|| GivenModel {
                file: before.clone(),
                ..given.clone()
            }),
            hold_friction,
        })
    }
}

impl OwnRefit<'_> {
    /// The model file of a proposal, without its effects.
    pub fn file(&self, proposal: &ModelProposal) -> Result<ModelFile, IdentifyError> {
        match &self.own {
            Some(own) => self.by_lsq(own, proposal.model),
            None => Ok(self.by_sums(proposal)),
        }
    }

    /// `lsq` on the logs less the torques of the effects.
    fn by_lsq(&self, own: &OwnFit, model: &AugmentedModel) -> Result<ModelFile, IdentifyError> {
        let settings = LsqSettings {
            consistent: self.given.file.is_consistent(),
            consistent_whatever: true,
            friction: own.friction.as_ref(),
            hold_friction: own.hold_friction,
            ..LsqSettings::default()
        };
        let data = Dataset::new(self.setup, &self.logs_without(model));
        let found = lsq_parameters(&data, &settings, &self.control.quiet())?;
        Ok(found.model(self.setup, own.friction.as_ref().map(|given| &given.file)))
    }

    /// The logs less the torques of a model's effects.
    fn logs_without(&self, model: &AugmentedModel) -> Vec<LogData> {
        let plain = AugmentedModel::plain(model.model.clone());
        let mut courses = vec![TorqueCourse::default(); self.logs.len()];
        for stretch in self.stretches {
            let Some(course) = courses.get_mut(stretch.log) else {
                continue;
            };
            let (mut torque, alone) = (model.reconstruct(stretch), plain.reconstruct(stretch));
            for (torque, alone) in torque.iter_mut().zip(&alone) {
                torque.iter_mut().zip(alone).for_each(|(x, y)| *x -= y);
            }
            course.push(stretch, torque);
        }
        let pairs = self.logs.iter().zip(courses);
        pairs
            .map(|(log, course)| log.minus_torque(course))
            .collect()
    }

    /// A file moved as much as a model is off that which it was made of.
    pub fn moved(
        &self,
        (from, file): (&AugmentedModel, &ModelFile),
        to: &AugmentedModel,
    ) -> ModelFile {
        let mut file = file.clone();
        let held = |u: &&Unknown| self.hold_friction && matches!(u, Unknown::Friction { .. });
        for unknown in self.unknowns.iter().filter(|u| !held(u)) {
            let (name, joint) = key_of(to, *unknown);
            let by = value_of(to, *unknown) - value_of(from, *unknown);
            let own = file.parameters.iter_mut();
            for p in own.filter(|p| p.name == name && p.joint == joint) {
                p.value += by;
                p.consistent = p.consistent.map(|x| x + by);
            }
        }
        file
    }

    /// The given model with the declared numbers by the judge's sums, consistent ones nearest to them in their metric.
    fn by_sums(&self, proposal: &ModelProposal) -> ModelFile {
        let mut file = self.given.file.clone();
        let held = |u: &&Unknown| self.hold_friction && matches!(u, Unknown::Friction { .. });
        for unknown in self.unknowns.iter().filter(|u| !held(u)) {
            let (name, joint) = key_of(proposal.model, *unknown);
            let own = file.parameters.iter_mut();
            for p in own.filter(|p| p.name == name && p.joint == joint) {
                let moved = value_of(proposal.model, *unknown) - p.value;
                p.value += moved;
                // beside inertial parameters that are kept both fits move alike
                p.consistent = p.consistent.map(|x| x + moved);
            }
        }
        // inertial parameters that are kept are as consistent as they were
        let kept = !self.unknowns.iter().any(|u| matches!(u, Unknown::Theta(_)));
        if !kept && file.is_consistent() {
            let key = |unknown: &Unknown| match key_of(proposal.model, *unknown) {
                (name, Some(joint)) => format!("{name}:{joint}"),
                (name, None) => name,
            };
            let keys: Vec<String> = self.unknowns.iter().map(key).collect();
            if project_by(&mut file, &keys, proposal.information).is_err() {
                file.forget_consistent();
            }
        }
        file
    }
}
