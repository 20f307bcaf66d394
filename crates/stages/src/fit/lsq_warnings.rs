//! What a fit warns of.

use super::estimate::EstimatorAccount;
use crate::input::logged_robot::LoggedRobot;
use crate::input::unknowns::FittedUnknown;
use cft_ident_core::inertia::instruments::ReferenceSource;
use cft_ident_core::inertia::solution::ConfoundedUnknowns;
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::number;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::model_file::is_positive;

pub(crate) fn with_friction(law: bool) -> &'static str {
    match law {
        true => {
            "friction is fitted together with the inertias, for there are no one-joint logs of it: linear columns first, then the law of (18) by refinement"
        }
        false => {
            "friction is fitted together with the inertias (viscous and Coulomb terms), for there are no one-joint logs of it"
        }
    }
}

impl EstimatorAccount {
    /// What did not come as it should, as warnings.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        if self.estimator == EstimatorKind::Oe && !self.law_refined {
            out.push("no parameter of this model is nonlinear: oe gives what wls gives".to_owned());
        }
        if let Some(simulated) = &self.simulated {
            if simulated.reference == ReferenceSource::Smoothed {
                out.push("iv: no log channel is named as the reference, so the measured position, smoothed to half the cut-off, stands for it; a part of its noise stays in the instruments. Name the channel: `reference = \"COLUMN\"` in [log.joint.NAME]".to_owned());
            }
            if simulated.failed_steps_share > 0.0 {
                out.push(format!(
                    "iv: at {} of the simulated steps the motion could not be computed or went astray, and joints were moved by themselves or put back; instruments are poorer for it",
                    number::percent(simulated.failed_steps_share)
                ));
            }
        }
        if self.status == IterationEnding::IterationLimit {
            out.push(format!(
                "{} did not settle in {} passes over the logs; its last result stands",
                self.estimator.name(),
                self.iterations
            ));
        }
        out
    }
}

/// Share of a joint's rows at rest from which on they are reported.
const SHOWN_AT_REST: f64 = 0.01;

/// Rows at rest that are not fitted, as a warning.
pub(crate) fn rests(machine: &LoggedRobot, shares: &[f64]) -> Option<String> {
    let joints = machine.robot.joint_names().iter().zip(shares);
    let shown: Vec<String> = joints
        .filter(|(_, share)| **share >= SHOWN_AT_REST)
        .map(|(joint, share)| format!("{joint} {}", number::percent(*share)))
        .collect();
    (!shown.is_empty()).then(|| {
        format!(
            "samples at rest or at a reversal were ignored: {}; friction takes any value up to its Coulomb level there",
            shown.join(", ")
        )
    })
}

/// Friction and inertias that are below zero by more than two deviations, as a warning.
pub(crate) fn negative(unknowns: &[FittedUnknown]) -> Option<String> {
    let positive = |u: &&FittedUnknown| is_positive(&u.key, u.joint.is_some());
    let below = |u: &&FittedUnknown| u.fitted < -2.0 * u.fitted_std;
    let names: Vec<String> = unknowns
        .iter()
        .filter(positive)
        .filter(below)
        .map(|u| {
            let (value, std) = number::value_and_std(u.fitted, u.fitted_std);
            let joint = u
                .joint
                .as_ref()
                .map_or(String::new(), |joint| format!(":{joint}"));
            format!("{}{joint} {value} +- {std} {}", u.key, u.unit)
        })
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "the fit is unphysical, friction or inertia below zero: {}; a torque is missing or a gain is wrong (`diagnose` looks for it), or the motion does not separate these parameters",
            names.join(", ")
        )
    })
}

/// What the data do not separate, as warnings.
pub(crate) fn confounded(fit: &Fit, unknowns: &[FittedUnknown]) -> Vec<String> {
    let name = |i: usize| match &unknowns[i].joint {
        Some(joint) if !unknowns[i].key.contains(joint.as_str()) => {
            format!("{} of {joint}", unknowns[i].key)
        }
        _ => unknowns[i].key.clone(),
    };
    let (silent, mixed): (Vec<&ConfoundedUnknowns>, Vec<&ConfoundedUnknowns>) =
        fit.confounded.iter().partition(|c| c.terms.len() == 1);
    let sentence = |c: &&ConfoundedUnknowns| {
        let most = || c.terms.iter().take(6);
        let names: Vec<String> = most().map(|(i, _)| name(*i)).collect();
        let words: Vec<String> = most()
            .map(|(i, x)| format!("{x:+.3} {}", name(*i)))
            .collect();
        format!(
            "these data cannot separate {}: their combination {} (columns scaled to norm 1) changes nothing",
            names.join(", "),
            words.join(" ")
        )
    };
    let all: Vec<String> = silent.iter().map(|c| name(c.terms[0].0)).collect();
    let silent =
        (!all.is_empty()).then(|| format!("no motion in these data excites {}", all.join(", ")));
    silent
        .into_iter()
        .chain(mixed.iter().map(sentence))
        .collect()
}
