//! The cut-off of the filter by which positions are differentiated: found from the logs, joint by joint, where the
//! robot file declares none, and judged where it does.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;

use super::control::Control;
use super::dataset::Dataset;
use super::error::IdentifyError;
use super::log_data::LogData;
use super::log_smoothing::{CutoffCosts, JointCost, LogSmoothing};
use super::robot_setup::RobotSetup;
use crate::note::{FitNote, StageNote};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::motion::position_cutoff::{
    CutoffCost, CutoffTrial, ReversalFriction, candidates, least,
};
use cft_ident_core::motion::{FilterSettings, RunError, Stretch, stretches};
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_files::config::held_out::HeldOut;
use cft_ident_logs::log::Block;

/// Rows from which a cut-off is found, of all logs together, and of one at least.
const MOST_ROWS: usize = 120_000;
const LEAST_ROWS: usize = 20_000;
/// A declared cut-off is reported as wrong where it costs more than this many times the best one ..
const WRONG_CUTOFF_COST_RATIO: f64 = 1.3;
/// .. and more than this part of the residual.
const MIN_COST_SHARE_OF_RESIDUAL: f64 = 0.5;

/// Position cut-off of one joint, and what its friction loses by it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PositionCutoff {
    pub joint: String,
    /// Cut-off of the filter that positions come through before they are differentiated \[Hz\].
    pub cutoff_hz: f64,
    /// The robot file declares it; found from the logs otherwise.
    pub declared: bool,
    /// The cut-off that costs least \[Hz\].
    pub best_hz: f64,
    /// Root mean square, over the filtered rows in which the joint moves, of what smoothing changes in its friction
    /// at reversals \[unit\].
    pub smear: f64,
    /// The same of what the noise of the positions changes \[unit\].
    pub noise: f64,
    pub unit: String,
}

/// Root of the mean square of numbers that do not depend on their order.
fn root_mean_square(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut squares: Vec<f64> = numbers.map(|x| x * x).collect();
    squares.sort_by(f64::total_cmp);
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

impl CutoffCosts {
    /// The cut-off of every joint's filter where it is found \[Hz\].
    pub(crate) fn found(&self) -> Vec<f64> {
        self.found_or(&[])
    }

    /// The same, with that of `others` for a joint that these logs do not move, where there is one.
    fn found_or(&self, others: &[f64]) -> Vec<f64> {
        let each = self.of_joint.iter().enumerate();
        each.map(|(j, cost)| match cost {
            Some(cost) => cost.at.cutoff_hz,
            None => others.get(j).copied().unwrap_or(self.plain),
        })
        .collect()
    }

    /// Cut-offs of a fit of these logs, of several the lowest with the rms of the costs, and what is wrong with them.
    pub(crate) fn described(
        logs: &[&CutoffCosts],
        setup: &RobotSetup,
        columns: &RegressorColumns,
        fit: &Fit,
    ) -> (Vec<PositionCutoff>, Vec<StageNote>) {
        let (mut list, mut notes) = (Vec::new(), Vec::new());
        for (j, joint) in setup.robot.joint_names().iter().enumerate() {
            let costs = logs.iter().filter_map(|log| log.of_joint[j].as_ref());
            let costs: Vec<&JointCost> = costs.collect();
            let lowest = |of: fn(&JointCost) -> f64| {
                let each = costs.iter().map(|cost| of(cost));
                each.reduce(f64::min)
            };
            let (Some(cutoff_hz), Some(best_hz)) =
                (lowest(|c| c.at.cutoff_hz), lowest(|c| c.best.cutoff_hz))
            else {
                continue;
            };
            let scale = match logs.iter().all(|log| log.known[j]) {
                true => 1.0,
                false => coulomb_level(columns, fit, j),
            };
            let mean = |of: fn(&JointCost) -> f64| {
                scale * root_mean_square(costs.iter().map(|cost| of(cost)))
            };
            let own = PositionCutoff {
                joint: joint.clone(),
                cutoff_hz,
                declared: logs.iter().any(|log| log.declared.is_some()),
                best_hz,
                smear: mean(|c| c.at.smear),
                noise: mean(|c| c.at.noise),
                unit: setup.file.torque_unit(j).to_owned(),
            };
            notes.extend(own.wrong(mean(|c| c.best.total()), fit.residual_std[j]));
            list.push(own);
        }
        (list, notes)
    }
}

impl PositionCutoff {
    /// What is wrong with a declared cut-off where the best one costs `best` and rows leave `residual` \[unit\].
    fn wrong(&self, best: f64, residual: f64) -> Option<StageNote> {
        let total = self.smear.hypot(self.noise);
        if !self.declared
            || total <= MIN_COST_SHARE_OF_RESIDUAL * residual
            || total <= WRONG_CUTOFF_COST_RATIO * best
        {
            return None;
        }
        Some(StageNote::Fit(FitNote::PositionCutoff {
            joint: self.joint.clone(),
            cutoff_hz: self.cutoff_hz,
            best_hz: self.best_hz,
            cost: total,
            residual,
            unit: self.unit.clone(),
        }))
    }
}

/// Coulomb level of a joint in a fit [N or Nm].
fn coulomb_level(columns: &RegressorColumns, fit: &Fit, joint: usize) -> f64 {
    let first = columns.first_own(joint);
    let own = columns.own[joint].iter().enumerate();
    let coulomb = own.filter(|(_, own)| match own {
        JointTerm::Coulomb | JointTerm::Saturating(_) => true,
        JointTerm::Law(k) => (1..3).contains(k),
        JointTerm::Viscous | JointTerm::Offset | JointTerm::TorqueRate | JointTerm::TorqueBend => {
            false
        }
    });
    coulomb
        .map(|(k, _)| fit.theta[first + k])
        .sum::<f64>()
        .abs()
}

/// The friction of every joint of a model, as known.
pub(crate) fn known(model: &Model) -> Vec<Option<JointFriction>> {
    model.friction.iter().map(|law| Some(*law)).collect()
}

/// How each log that is fitted is smoothed by itself, in the order of [`LsqRows`](super::lsq_rows::LsqRows). `laws` is the
/// friction of each joint, none where it is not known.
pub(crate) fn choose_smoothing(
    data: &Dataset,
    laws: &[Option<JointFriction>],
    control: &Control,
) -> Result<Vec<LogSmoothing>, IdentifyError> {
    let reduced = data.reduced.iter().map(|part| Ok(part.smoothing.clone()));
    let smoothing = |log: &LogData| data.setup.smoothing_of(log, laws, control);
    reduced.chain(data.logs.iter().map(smoothing)).collect()
}

impl RobotSetup {
    /// The same robot with the position cut-offs that its logs call for; a law is none where it is not known.
    pub(crate) fn with_position_cutoffs(
        &self,
        logs: &[LogData],
        laws: &[Option<JointFriction>],
        control: &Control,
    ) -> Result<RobotSetup, IdentifyError> {
        let speeds = self.rest_speeds(logs)?;
        self.with_cutoffs_along(logs, laws, &speeds, control)
    }

    /// The processing of each log by its own cut-offs, and by those of `together` for a joint that rests in it.
    pub(crate) fn settings_of_each(
        &self,
        logs: &[LogData],
        laws: &[Option<JointFriction>],
        together: &RobotSetup,
        control: &Control,
    ) -> Result<Vec<FilterSettings>, IdentifyError> {
        if logs.len() == 1 {
            return Ok(vec![together.settings()]);
        }
        let of_log = |log: &LogData| {
            let log = std::slice::from_ref(log);
            let mut setup = self.clone();
            if self.finds_cutoffs() {
                let speeds = self.rest_speeds(log)?;
                let costs = self.cutoff_costs(log, laws, &speeds, control)?;
                setup.position_cutoffs_hz = Arc::new(costs.found_or(&together.position_cutoffs_hz));
            }
            Ok(setup.settings())
        };
        logs.iter().map(of_log).collect()
    }

    /// The same by speeds up to which joints rest; nothing is read where cut-offs are declared.
    pub(crate) fn with_cutoffs_along(
        &self,
        logs: &[LogData],
        laws: &[Option<JointFriction>],
        rest_speed: &[f64],
        control: &Control,
    ) -> Result<RobotSetup, IdentifyError> {
        if !self.finds_cutoffs() {
            return Ok(self.clone());
        }
        Ok(self.with_cutoffs(&self.cutoff_costs(logs, laws, rest_speed, control)?))
    }

    /// What a log calls for by itself.
    fn smoothing_of(
        &self,
        log: &LogData,
        laws: &[Option<JointFriction>],
        control: &Control,
    ) -> Result<LogSmoothing, IdentifyError> {
        let log = std::slice::from_ref(log);
        let rest_speed = self.rest_speeds(log)?;
        let costs = self.cutoff_costs(log, laws, &rest_speed, control)?;
        let cutoffs_hz = match self.finds_cutoffs() {
            true => costs.found(),
            false => Vec::new(),
        };
        Ok(LogSmoothing {
            rest_speed,
            cutoffs_hz,
            costs,
        })
    }

    /// Whether position cut-offs are found from the logs.
    pub(crate) fn finds_cutoffs(&self) -> bool {
        let filter = &self.file.filter;
        filter.position_cutoff_hz.is_none() && filter.position_order != Some(0)
    }

    /// The same robot with the cut-offs that cost least.
    fn with_cutoffs(&self, costs: &CutoffCosts) -> RobotSetup {
        let mut setup = self.clone();
        if self.finds_cutoffs() {
            setup.position_cutoffs_hz = Arc::new(costs.found());
        }
        setup
    }

    /// The same robot with the position cut-offs by which a model is validated on these logs, where none are declared.
    ///
    /// # Errors
    /// Logs that cannot be read.
    pub fn smoothed_for(
        &self,
        logs: &[LogData],
        model: &AugmentedModel,
        control: &Control,
    ) -> Result<RobotSetup, IdentifyError> {
        self.with_position_cutoffs(logs, &known(&model.model), control)
    }

    /// The same robot with the position cut-offs that a fit took, where it found them.
    pub fn smoothed_as(&self, fit: &[PositionCutoff]) -> RobotSetup {
        let mut setup = self.clone();
        // where none was looked for, the plain one is as high as the sampling rate carries
        if self.finds_cutoffs() && !fit.is_empty() {
            let plain = self.settings().plain_q_cutoff_hz(f64::INFINITY);
            let of = |joint: &String| {
                let own = fit.iter().find(|of| of.joint == *joint);
                own.map_or(plain, |of| of.cutoff_hz)
            };
            setup.position_cutoffs_hz = Arc::new(self.robot.joint_names().iter().map(of).collect());
        }
        setup
    }

    /// The same robot with the position cut-offs by which a model's band was found; none where they are its own.
    pub(crate) fn as_held(&self, held: &[HeldOut]) -> Option<RobotSetup> {
        if held.len() != self.position_cutoffs_hz.len() {
            return None;
        }
        let cutoffs: Vec<f64> = held.iter().map(|held| held.position_cutoff_hz).collect();
        (cutoffs != *self.position_cutoffs_hz).then(|| {
            let mut setup = self.clone();
            setup.position_cutoffs_hz = Arc::new(cutoffs);
            setup
        })
    }

    /// The first rows of logs as stretches, positions as logged.
    fn first_stretches(
        &self,
        logs: &[LogData],
        control: &Control,
    ) -> Result<Vec<Stretch>, IdentifyError> {
        let raw = FilterSettings {
            q_order: 0,
            ..self.settings()
        };
        let most = (MOST_ROWS / logs.len().max(1)).max(LEAST_ROWS);
        let mut all: Vec<Stretch> = Vec::new();
        for (index, log) in logs.iter().enumerate() {
            let mut blocks = log.blocks(control)?;
            let mut rows = 0;
            let mut read = |block: &mut Block| {
                let more = blocks.read(block)?;
                rows += block.len();
                Ok(more && rows < most)
            };
            match stretches(index, self.robot.joints(), &raw, &mut read) {
                Ok((found, _)) => all.extend(found),
                // what reads the log whole says what is wrong with it
                Err(RunError::Motion(_)) => {}
                Err(error) => return Err(IdentifyError::of_run(&log.name(), error)),
            }
        }
        Ok(all)
    }

    /// What cut-offs cost the friction of every joint on logs.
    pub(crate) fn cutoff_costs(
        &self,
        logs: &[LogData],
        laws: &[Option<JointFriction>],
        rest_speed: &[f64],
        control: &Control,
    ) -> Result<CutoffCosts, IdentifyError> {
        let settings = self.settings();
        let n = self.robot.joints();
        let all = self.first_stretches(logs, control)?;
        let rate = all.iter().map(|s| 1.0 / s.dt).fold(f64::INFINITY, f64::min);
        let tried = match settings.q_order {
            0 => Vec::new(),
            _ => candidates(&settings, rate),
        };
        // Viscous friction is linear in the velocity and prefers no cut-off: a model finds the cut-offs of its own fit, where
        // the Coulomb level was not known yet.
        let friction = |j: usize| match laws.get(j) {
            Some(Some(JointFriction::ViscousCoulomb(law))) if law.coulomb != 0.0 => {
                ReversalFriction::Jump(law.coulomb)
            }
            Some(Some(JointFriction::DoubleTanh(law))) => ReversalFriction::Smooth(*law),
            _ => ReversalFriction::Jump(1.0),
        };
        let friction = (0..n).map(friction).collect();
        let mut trial = CutoffTrial::new(&settings, tried, friction, rest_speed);
        for stretch in &all {
            trial
                .add(stretch)
                .map_err(|e| IdentifyError::motion(&logs[stretch.log].name(), e))?;
        }
        let of_joint = |costs: &Vec<CutoffCost>| {
            let best = least(costs)?;
            let wanted = settings.q_cutoff_hz.unwrap_or(best.cutoff_hz);
            let at = *costs.iter().find(|cost| cost.cutoff_hz == wanted)?;
            Some(JointCost { at, best })
        };
        Ok(CutoffCosts {
            of_joint: trial.costs().iter().map(of_joint).collect(),
            known: (0..n)
                .map(|j| matches!(laws.get(j), Some(Some(_))))
                .collect(),
            declared: settings.q_cutoff_hz,
            plain: settings.plain_q_cutoff_hz(rate),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn declared(smear: f64, noise: f64, best_hz: f64) -> PositionCutoff {
        PositionCutoff {
            joint: "q4".to_owned(),
            cutoff_hz: 60.0,
            declared: true,
            best_hz,
            smear,
            noise,
            unit: "Nm".to_owned(),
        }
    }

    #[test]
    fn a_declared_cut_off_is_judged_by_what_it_costs_beside_the_best_and_the_residual() {
        let said = |note: Option<StageNote>| note.unwrap().to_string();
        let smeared = said(declared(0.03, 0.001, 160.0).wrong(0.005, 0.04));
        assert!(smeared.starts_with("position_cutoff_hz = 60"), "{smeared}");
        assert!(smeared.contains("smears the reversals of q4"), "{smeared}");
        assert!(smeared.contains("raise it to 160"), "{smeared}");
        let noisy = said(declared(0.001, 0.03, 40.0).wrong(0.005, 0.04));
        assert!(noisy.contains("lower it to 40"), "{noisy}");
        // too little of the residual, and next to the best
        assert_eq!(declared(0.03, 0.0, 160.0).wrong(0.005, 0.4), None);
        assert_eq!(declared(0.03, 0.0, 160.0).wrong(0.028, 0.04), None);
        let found = PositionCutoff {
            declared: false,
            ..declared(0.03, 0.0, 160.0)
        };
        assert_eq!(found.wrong(0.005, 0.04), None);
    }
}
