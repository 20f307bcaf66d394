//! The model that a diagnosis comes to, as a file.

use super::diagnose::Diagnosed;
use super::formulas::{numbers_of, written_sections};
use crate::held_out::open_loop::{is_in_si, whole};
use crate::input::error::IdentifyError;
use crate::input::model::{in_file, new_model, refined};
use crate::input::robot_setup::RobotSetup;
use crate::input::unknown_key::key_of;
use crate::open_loop::{FreeRun, RunSpan, free_run};
use cft_ident_core::diagnose::{Unknown, value_of};
use cft_ident_core::motion::Stretch;
use cft_ident_core::verdict::{Verdict, verdict_of};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::candidates::CandidateSection;
use cft_ident_files::config::model_file::{Covariance, EffectSection, Estimate, Parameter};
use cft_ident_logs::log::DataRole;

impl Diagnosed {
    /// The free run of the model given and of the one that is written, with the parameters in use.
    pub(crate) fn run_freely(
        &self,
        setup: &RobotSetup,
        (name, given): (&str, &ModelFile),
    ) -> Result<Option<FreeRun>, IdentifyError> {
        if !is_in_si(setup) {
            return Ok(None);
        }
        let before = refined(given, name)?;
        let added = self.diagnosis.changes_model();
        let after = added.then_some(&self.diagnosis.in_use);
        let stretches = &self.in_memory.stretches;
        let spans = self.held_out_spans();
        Ok(free_run(&before, after, stretches, &spans))
    }

    /// Held-out spans of the stretches; all of them where nothing is held out.
    fn held_out_spans(&self) -> Vec<RunSpan> {
        let (inputs, stretches) = (&self.in_memory.inputs, &self.in_memory.stretches);
        let of_log = |s: &Stretch| inputs[s.log].role == Some(DataRole::HeldOut);
        let aside = |s: &Stretch, t: f64| {
            let mut blocks = self.diagnosis.set_aside.iter();
            blocks.any(|a| a.log == s.log && (a.from_s..=a.to_s).contains(&t))
        };
        let mut spans = Vec::new();
        for (number, s) in stretches.iter().enumerate() {
            let held = |k: &usize| of_log(s) || aside(s, s.own_time(*k));
            let mut from = (0..s.len()).find(held);
            while let Some(begin) = from {
                let until = (begin..s.len()).find(|k| !held(k)).unwrap_or(s.len());
                spans.push((number, begin, until));
                from = (until..s.len()).find(held);
            }
        }
        match spans.is_empty() {
            true => whole(stretches),
            false => spans,
        }
    }

    /// The refined model, where `file` is the one that was given: that file itself where nothing was added.
    pub fn model(&self, setup: &RobotSetup, file: &ModelFile) -> ModelFile {
        let Some(fitted) = &self.fitted else {
            return file.clone();
        };
        let mut model = new_model(setup, "diagnose", &self.in_memory.inputs);
        model.parameters.clone_from(&fitted.parameters);
        model.covariance.clone_from(&fitted.covariance);
        model.residual_std.clone_from(&fitted.residual_std);
        model.links.clone_from(&fitted.links);
        model.drive_inertia.clone_from(&fitted.drive_inertia);
        model.friction_prior.clone_from(&self.friction_prior);
        match self.by_lsq {
            true => self.put_deviations_of_lsq(file, &mut model),
            false => self.put_deviations(setup, file, &mut model),
        }
        self.put_effects(setup, file, &mut model);
        let of_model = |c: &&CandidateSection| model.effects.iter().any(|e| e.name == c.name);
        let formulas = written_sections(self);
        let known = file.candidates.iter().chain(&self.candidates);
        let known = known.chain(&formulas);
        for candidate in known.filter(of_model) {
            if !model.candidates.contains(candidate) {
                model.candidates.push(candidate.clone());
            }
        }
        self.held.write_into(&mut model);
        model
    }

    /// Deviations of numbers that `lsq` fitted beside the effects: its own and what the effects' amplitudes add.
    fn put_deviations_of_lsq(&self, file: &ModelFile, model: &mut ModelFile) {
        let d = &self.diagnosis;
        let place = |key: &String| {
            let mut keys = d.unknowns.iter().map(|u| key_of(&d.model, *u));
            keys.position(|(name, joint)| match joint {
                Some(joint) => *key == format!("{name}:{joint}"),
                None => *key == name,
            })
        };
        if let Some(covariance) = &mut model.covariance {
            let places: Vec<Option<usize>> = covariance.names.iter().map(place).collect();
            for (row, a) in covariance.matrix.iter_mut().zip(&places) {
                for (x, b) in row.iter_mut().zip(&places) {
                    if let (Some(a), Some(b)) = (*a, *b) {
                        *x += d.by_effects[(a, b)];
                    }
                }
            }
        }
        let whole = self.is_whole();
        for p in &mut model.parameters {
            let Some(i) = place(&p.key()) else { continue };
            let std = p
                .std
                .map(|std| std.hypot(d.by_effects[(i, i)].max(0.0).sqrt()));
            if whole {
                p.std = std;
                if let Some(std) = std.filter(|_| !p.is_negligible()) {
                    p.verdict = Some(verdict_of(p.value, std));
                }
                continue;
            }
            // beside a part of an effect the declared numbers take up the rest, and are no estimates
            model.estimates.push(Estimate {
                name: p.name.clone(),
                joint: p.joint.clone(),
                value: p.value + d.to_estimate[i],
                std,
                unit: p.unit.clone(),
            });
            p.std = None;
        }
        if !whole {
            model.estimate_covariance = model.covariance.take();
        } else {
            model
                .estimate_covariance
                .clone_from(&file.estimate_covariance);
        }
    }

    /// Deviations of numbers by the judge's sums: those of the joint fit.
    fn put_deviations(&self, setup: &RobotSetup, file: &ModelFile, model: &mut ModelFile) {
        let diagnosis = &self.diagnosis;
        // beside a part of an effect the declared numbers take up the rest, and are no estimates
        let whole = self.is_whole();
        let (mut keys, mut places, mut widened) = (Vec::new(), Vec::new(), Vec::new());
        let (mut undetermined, mut estimated) = (Vec::new(), Vec::new());
        for (i, unknown) in diagnosis.unknowns.iter().enumerate() {
            if self.hold_friction && matches!(unknown, Unknown::Friction { .. }) {
                continue;
            }
            let (name, joint) = key_of(&diagnosis.model, *unknown);
            let value = value_of(&diagnosis.model, *unknown);
            let there = |p: &&mut Parameter| p.name == name && p.joint == joint;
            let Some(p) = model.parameters.iter_mut().find(there) else {
                continue;
            };
            let found = diagnosis.covariance[(i, i)].max(0.0).sqrt();
            if !whole {
                model.estimates.push(Estimate {
                    name,
                    joint,
                    value: value_of(&diagnosis.estimates, *unknown),
                    std: Some(found),
                    unit: p.unit.clone(),
                });
                (p.value, p.std) = (value, None);
                undetermined.push(p.key());
                if found.is_finite() {
                    estimated.push((p.key(), i));
                }
                continue;
            }
            match put(p, value, found) {
                Some(factor) => {
                    widened.push(factor);
                    keys.push(p.key());
                    places.push(i);
                }
                None => undetermined.push(p.key()),
            }
        }
        model.forget_covariance(&undetermined);
        model.estimate_covariance = match estimated.is_empty() {
            true => file.estimate_covariance.clone(),
            false => Some(self.covariance_between(&estimated)),
        };
        model.replace_covariance(&keys, &|a, b| {
            widened[a] * widened[b] * diagnosis.covariance[(places[a], places[b])]
        });
        let joints = setup.robot.joint_names().iter();
        for (joint, std) in joints.zip(&diagnosis.residual_std) {
            model.residual_std.insert(joint.clone(), *std);
        }
    }

    /// Covariance of unknowns, by key and place.
    fn covariance_between(&self, unknowns: &[(String, usize)]) -> Covariance {
        let all = &self.diagnosis.covariance;
        let row = |(_, i): &(String, usize)| unknowns.iter().map(|(_, j)| all[(*i, *j)]).collect();
        Covariance {
            names: unknowns.iter().map(|(key, _)| key.clone()).collect(),
            matrix: unknowns.iter().map(row).collect(),
        }
    }

    /// Whether every effect is written as it was estimated.
    fn is_whole(&self) -> bool {
        let model = &self.diagnosis.model;
        let mut written = self.diagnosis.written();
        self.diagnosis.predicting.is_empty()
            && written.all(|s| {
                s.written
                    .is_some_and(|at| model.effects[at].linear == s.estimate.linear)
            })
    }

    /// Effects that the given model had, and those that were found.
    fn put_effects(&self, setup: &RobotSetup, file: &ModelFile, model: &mut ModelFile) {
        model.effects.clone_from(&file.effects);
        model.estimates.extend(file.estimates.iter().cloned());
        for step in self.diagnosis.written() {
            let Some(effect) = step
                .written
                .and_then(|at| self.diagnosis.model.effects.get(at))
            else {
                continue;
            };
            let estimated = numbers_of(setup, step);
            let whole = effect.linear == step.estimate.linear;
            let unit = setup.torque_unit_at(effect.place);
            let numbers = match whole {
                true => estimated.clone(),
                false => effect.numbers(&setup.robot, unit, None),
            };
            let mut section = in_file(effect, setup, &numbers);
            section.accepted_by_user = step.accepted_by_user;
            if !whole {
                section.shrinkage = Some(step.shrinkage);
                let own = estimated.into_iter().filter(|n| n.std.is_some());
                model.estimates.extend(own.map(|n| Estimate {
                    name: format!("{} {}", section.name, n.key),
                    joint: section.joint.clone(),
                    value: n.value,
                    std: n.std,
                    unit: n.unit,
                }));
            }
            model.effects.push(section);
        }
        for term in &self.diagnosis.predicting {
            let effect = &self.diagnosis.model.effects[term.written];
            let unit = setup.torque_unit_at(effect.place);
            let numbers = effect.numbers(&setup.robot, unit, None);
            model.effects.push(EffectSection {
                shrinkage: Some(term.shrinkage),
                prediction_only: true,
                ..in_file(effect, setup, &numbers)
            });
        }
    }
}

/// Gives a parameter what was found; how much wider its deviation is, where nothing else explains the same torque.
fn put(p: &mut Parameter, value: f64, found: f64) -> Option<f64> {
    if !found.is_finite() {
        p.value = value;
        p.std = None;
        p.verdict = Some(Verdict::NotIdentifiable);
        return None;
    }
    // what smoothing and the encoders' steps did to the given model, they do to this one
    let std = found.max(p.std.unwrap_or(0.0));
    // a parameter without a torque worth mentioning is known well enough as it is
    let negligible = p.is_negligible();
    p.value = value;
    p.std = Some(std);
    if !negligible {
        p.verdict = Some(verdict_of(value, std));
    }
    Some(if found > 0.0 { std / found } else { 1.0 })
}
