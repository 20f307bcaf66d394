//! The sentences of notes of fits.

use std::fmt::{Display, Formatter, Result};

use super::listed;
use crate::note::{FitNote, NumberWithStd};
use cft_ident_core::number::{percent, significant, value_and_std};

impl Display for FitNote {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::Disagrees {
                log,
                other,
                joint,
                own,
                others,
            } => {
                let [[all, alone], [all_others, without]] =
                    [own, others].map(|pair| pair.map(percent));
                let who = match other {
                    Some(other) => format!("{log} and {other} disagree"),
                    None => format!("{log} disagrees with the other logs"),
                };
                let rest = match other {
                    Some(other) => format!("that of {other} {all_others} and {without}"),
                    None => format!("that of the others {all_others}, and {without} without it"),
                };
                write!(
                    f,
                    "{who}: one fit misses {all} of the torque of {joint} in {log}, a fit of that log alone {alone}; {rest}. Another load, tool, gain or sign, or friction that changed: fit them apart, and see `compare` of the two models"
                )
            }
            Self::FrictionFitted { law: true } => f.write_str(
                "friction is fitted together with the inertias, for there are no one-joint logs of it: linear columns first, then the law of (18) by refinement",
            ),
            Self::FrictionFitted { law: false } => f.write_str(
                "friction is fitted together with the inertias (viscous and Coulomb terms), for there are no one-joint logs of it",
            ),
            Self::FrictionOfReduced { log } => write!(
                f,
                "the friction stays as it was given to `reduce`, as by --hold-friction: {log} is a reduced log, and its rows hold no other; give logs to refine it"
            ),
            Self::NothingNonlinear => f.write_str(
                "no parameter of this model is nonlinear: oe gives what wls gives",
            ),
            Self::SmoothedReference => f.write_str(
                "iv: no log channel is named as the reference, so the measured position, smoothed to half the cut-off, stands for it; a part of its noise stays in the instruments. Name the channel: `reference = \"COLUMN\"` in [log.joint.NAME]",
            ),
            Self::FailedSteps { share } => write!(
                f,
                "iv: at {} of the simulated steps the motion could not be computed or went astray, and joints were moved by themselves or put back; instruments are poorer for it",
                percent(*share)
            ),
            Self::AskedFor { columns } => write!(
                f,
                "{} stands for the torque, which by its name a controller computed or asked for: friction, load and what the controller's model lacks are not in it; take the column of the measured torque or current, or the whole law of the drive (`torque = {{ pd = .. }}` in [log])",
                columns.join(", ")
            ),
            Self::ReplayedTorque {
                logs: [first, second],
            } => write!(
                f,
                "the torques of {first} and {second} are equal to the last digit, and their motions are not: a program played them, and no drive was measured"
            ),
            Self::MostlyOffset { joint, errors } => {
                let [whole, varying] = errors.map(percent);
                write!(
                    f,
                    "the torque of {joint} is an offset for the most part: the model misses {whole} of it, and {varying} of what varies"
                )
            }
            Self::UnusedCommands { key, columns } => write!(
                f,
                "the law of [log] torque leaves out columns that the log holds, {}: where the drive is asked for them too, `{key} = \"..\"` in it names them ({{joint}} for the name of the joint); what is left out looks like friction and gravity that are not there",
                columns.join(", ")
            ),
            Self::NoDrive { error, friction } => write!(
                f,
                "no joint's torque is missed by more than {}, and friction takes no more than {} of one: no drive was ever measured so. These torques were computed, by a controller or a simulation without noise and friction; of a real robot this is a model of its controller's model",
                percent(*error),
                percent(*friction)
            ),
            Self::NotSettled { estimator, passes } => write!(
                f,
                "{} did not settle in {passes} passes over the logs; its last result stands",
                estimator.name()
            ),
            Self::Contact {
                log,
                joints,
                ratio,
                span: [from, to],
                leave_out: [begin, end],
            } => write!(
                f,
                "{log}: the residual of {} is up to {} times the usual from {from:.2} to {to:.2} s after its first row: contact? `--leave-out {begin:.2}..{end:.2}s` fits without it",
                joints.join(", "),
                significant(*ratio, 2)
            ),
            Self::LoadLeftOut { log, from_s, to_s } => {
                let when = match (from_s, to_s) {
                    (Some(from), Some(to)) => format!("from {from:.2} to {to:.2} s"),
                    (Some(from), None) => format!("from {from:.2} s to the end"),
                    (None, Some(to)) => format!("up to {to:.2} s"),
                    (None, None) => "throughout".to_owned(),
                };
                write!(
                    f,
                    "{log}: the last link carries a load {when} that it does not carry in the rest, and these rows are left out; `cft-ident payload` with the same log and model gives its mass"
                )
            }
            Self::AtRest { joints } => write!(
                f,
                "samples at rest or at a reversal were ignored: {}; friction takes any value up to its Coulomb level there",
                listed(joints, |(joint, share)| format!("{joint} {}", percent(*share)))
            ),
            Self::HangsOnBridged { moved } => {
                let value = |x: NumberWithStd| {
                    format!("{} +- {}", significant(x.value, 4), significant(x.std, 2))
                };
                let moved = listed(moved, |(key, [with, without])| {
                    format!("{key} {} with and {} without", value(*with), value(*without))
                });
                write!(
                    f,
                    "this fit hangs on the rows that are bridged as spikes: {moved} that bridge; where they are peaks of a motion, `keep = [\"spike\"]` in [log] of the robot file leaves them as they are"
                )
            }
            Self::NotExcited { unknowns } => {
                write!(f, "no motion in these data excites {}", unknowns.join(", "))
            }
            Self::Confounded { terms } => {
                let words: Vec<String> = (terms.iter())
                    .map(|(name, x)| format!("{x:+.3} {name}"))
                    .collect();
                write!(
                    f,
                    "these data cannot separate {}: their combination {} (columns scaled to norm 1) changes nothing",
                    listed(terms, |(name, _)| name.clone()),
                    words.join(" ")
                )
            }
            Self::BelowZero { unknowns } => {
                let names = listed(unknowns, |(name, x, unit)| {
                    let (value, std) = value_and_std(x.value, x.std);
                    format!("{name} {value} +- {std} {unit}")
                });
                write!(
                    f,
                    "the fit is unphysical, friction or inertia below zero: {names}; a torque is missing or a gain is wrong (`diagnose` looks for it), or the motion does not separate these parameters"
                )
            }
            Self::Geometry(finding) => write!(
                f,
                "{}; take the plain number unless it was measured so",
                finding.meaning
            ),
            Self::PositionCutoff {
                joint,
                cutoff_hz,
                best_hz,
                cost,
                residual,
                unit,
            } => {
                let (does, change) = match best_hz > cutoff_hz {
                    true => ("smears the reversals of", "raise"),
                    false => (
                        "lets the noise of the positions into the friction of",
                        "lower",
                    ),
                };
                let [cost, residual] = [cost, residual].map(|x| significant(*x, 2));
                write!(
                    f,
                    "position_cutoff_hz = {} {does} {joint}: {cost} {unit} of the residual's {residual} {unit} rms; {change} it to {} Hz, or leave it out of [filter], and each joint gets what its logs call for",
                    significant(*cutoff_hz, 3),
                    significant(*best_hz, 3),
                )
            }
            Self::NotConsistent => f.write_str(
                "the search for physically consistent parameters did not converge: the file holds the plain fit only, and simulators may refuse it",
            ),
            Self::ImpossibleBodies { links } => write!(
                f,
                "the `inertial` of {} in the robot file is that of no body that can exist (a negative mass or moment, a moment above the sum of the other two, or no moments at all): a plain body stands for it where the torques say nothing",
                links.join(", ")
            ),
            Self::DualityGap { gap } => write!(
                f,
                "the search for physically consistent links ended before its optimum: the duality gap is {} of the sum of squares",
                percent(*gap)
            ),
            Self::ConsistentWorse { joints, in_use } => {
                let worse = listed(joints, |(joint, errors)| {
                    let [consistent, plain] = errors.map(percent);
                    format!("{joint} {consistent} (unconstrained {plain})")
                });
                let then = match in_use {
                    true => {
                        "the model computes with the physically consistent parameters; --unconstrained writes the plain fit alone"
                    }
                    false => {
                        "the model computes with the plain fit, which is better on blocks of these logs and no worse on the fastest of them; files of links are exported from the physically consistent parameters"
                    }
                };
                write!(
                    f,
                    "no physically consistent parameters fit these torques as well as unconstrained ones, on blocks left out of both fits: {worse}. The gain of a torque channel is wrong, the robot file lacks a body or a drive, or what is logged is no torque of the joint; {then}"
                )
            }
            Self::GainRatios { reference } => write!(
                f,
                "gains are ratios to that of {reference}: the model is in the unit of its channel, and a known payload (`--fit-gains LOG:mass=KG`) would make it SI"
            ),
            Self::GainsNotSettled { steps } => write!(
                f,
                "the gains did not settle in {steps} steps; their last values stand"
            ),
            Self::MotionNoBetter => f.write_str(
                "fit to the motion: on blocks set aside it runs no better than least squares of torques, which stands in the model",
            ),
            Self::FewWindows {
                windows,
                window_s,
                numbers,
            } => write!(
                f,
                "fit to the motion: the logs hold {windows:.0} windows of {window_s} s behind one another for {numbers} numbers; their standard deviations are rough; give longer logs"
            ),
            Self::MotionNotSettled { steps } => write!(
                f,
                "fit to the motion: did not settle in {steps} steps; its last result stands"
            ),
            Self::NothingSetAside { error } => write!(
                f,
                "no block of these logs could be set aside, so that the model has no prediction band and no alarms: {error}"
            ),
        }
    }
}
