//! The verdict of a diagnosis: the error before and after beside what is usual, the effects that were found, and where
//! most is left.

use super::step_words::titled;
use crate::report::usual;
use crate::report::words::listed;
use crate::report::{FigureTone, FoundLine, VerdictFigure, VerdictHeadline, Writer};
use cft_ident_core::diagnose::{
    ChangedTorque, Diagnosis, FoundEffect, SplitErrors, StepStatus, TorqueChange, UseErrors,
};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, DiagnosisVerdict, RobotSetup, signal_words};
use cft_ident_stages::open_loop::JointFreeRun;

/// Effects that the verdict names; it counts the others.
const NAMED: usize = 3;

/// The verdict on a diagnosis: its figures and what was found.
pub(super) struct DiagnosisWords {
    pub headline: VerdictHeadline,
    pub found: Vec<FoundLine>,
}

impl DiagnosisWords {
    pub fn write(self, writer: &mut Writer) {
        writer.headline(self.headline);
        writer.found(self.found);
    }
}

/// The verdict in figures and words.
pub(super) fn words(setup: &RobotSetup, found: &Diagnosed) -> DiagnosisWords {
    let d = &found.diagnosis;
    let lacking = found.verdict();
    let mut all = added(setup, d);
    let said = |grade, text: String| FoundLine { grade, text };
    match lacking {
        DiagnosisVerdict::EffectsFound => {}
        _ if !d.determined => {
            let text = "these data determine nothing: the noise is as large as the torque that the model explains";
            all = vec![said("not usable", text.to_owned())];
        }
        _ if !d.long_enough() => all.push(said(
            "too short",
            format!(
                "{} blocks of {} s do not show an effect; {} are needed",
                d.blocks,
                number::significant(d.block_s, 2),
                d.least_blocks
            ),
        )),
        DiagnosisVerdict::NothingMissing => {
            all.push(said(
                "nothing",
                "the remaining residual is noise".to_owned(),
            ));
        }
        _ => all.push(said(
            "unknown",
            "the residual is more than noise, and no known effect is sure enough to be written"
                .to_owned(),
        )),
    }
    all.extend(steps_of_zero(setup, found));
    all.extend(for_prediction(d));
    all.extend(too_few_stretches(d));
    all.extend(taken_out(setup, d));
    all.extend(most_is_left(setup, d).map(|text| said("remaining", text)));
    let worse = runs_worse(found);
    if !worse.is_empty() {
        let text = format!(
            "simulated from the measured torques, the new model moves worse than the given one at {worse}: use it \
             for feed-forward, not to simulate"
        );
        all.push(said("worse", text));
    }
    DiagnosisWords {
        headline: headline(setup, d),
        found: all,
    }
}

/// Torque channels whose zero moves within a log.
fn steps_of_zero(setup: &RobotSetup, found: &Diagnosed) -> Vec<FoundLine> {
    let changes = found.diagnosis.changes.iter();
    let steps = changes.filter(|change| change.of == ChangedTorque::Offset);
    let line = |step: &TorqueChange| FoundLine {
        grade: "step",
        text: format!(
            "the zero of the torque channel of {} moves by {} {} at about {:.1} s of {}",
            setup.robot.joint_names()[step.joint],
            number::significant(step.by, 2),
            setup.file.torque_unit(step.joint),
            step.at_s,
            found.logs[step.log],
        ),
    };
    steps.map(line).collect()
}

/// Error before, error after and what is usual.
fn headline(setup: &RobotSetup, d: &Diagnosis) -> VerdictHeadline {
    let ((data, before), (_, after)) = (errors(&d.before), errors(&d.after));
    let mean = |e: &UseErrors| e.overall.mean_relative_error_moving;
    let [from, to] = [before, after].map(|e| number::percent(mean(e)));
    let changed = d.changes_model();
    let torque_is = setup.file.log.torque_is;
    let unusual = mean(after) > usual::band(torque_is)[1];
    let tone = match changed {
        true if mean(after) > mean(before) && from != to => FigureTone::Worse,
        _ if unusual => FigureTone::High,
        true if from != to => FigureTone::Better,
        _ => FigureTone::Plain,
    };
    let figure = |label, value, tone| VerdictFigure { label, value, tone };
    let figures = vec![
        figure("before", from, FigureTone::Plain),
        figure("after", to, tone),
        figure("usual", usual::figure(torque_is), FigureTone::Plain),
    ];
    let joints = match after.joints.len() {
        1 => String::new(),
        n => format!(", rms over {n} joints"),
    };
    let optimistic = d.holdout_had_a_say() && changed;
    let chosen = if optimistic {
        "; optimistic, since these data chose the effects"
    } else {
        ""
    };
    VerdictHeadline {
        figures,
        of: format!("relative torque error in motion, on {data}{joints}{chosen}"),
    }
}

/// Joints that move worse, driven by the measured torques, where the model moves worse over all joints.
fn runs_worse(found: &Diagnosed) -> String {
    let Some(run) = &found.free_run else {
        return String::new();
    };
    let grows = |joint: &JointFreeRun| Some((joint.after.as_ref()?.rms / joint.given.rms).ln());
    let change: f64 = run.joints.iter().filter_map(grows).sum();
    let worse = run.worse().filter(|_| change > 0.0);
    listed(worse.map(|joint| joint.joint.as_str()))
}

/// Whether the error is so small that no published figure is of use beside it.
pub(super) fn is_exact(d: &Diagnosis) -> bool {
    let [least, _] = usual::band(None);
    errors(&d.after).1.overall.mean_relative_error_moving < 0.5 * least
}

/// The effects, by how firm they are, and what of them is written.
fn added(setup: &RobotSetup, d: &Diagnosis) -> Vec<FoundLine> {
    let graded = |grade: &'static str, what: &str, steps: Vec<&FoundEffect>| {
        let mut all: Vec<FoundLine> = steps
            .iter()
            .take(NAMED)
            .map(|s| FoundLine {
                grade,
                text: titled(setup, &s.estimate) + what,
            })
            .collect();
        if steps.len() > NAMED {
            all.push(FoundLine {
                grade,
                text: format!("{} more", steps.len() - NAMED),
            });
        }
        all
    };
    let by = |status: StepStatus| {
        let steps = d.written().filter(|s| !s.accepted_by_user);
        steps.filter(|s| s.status == status).collect::<Vec<_>>()
    };
    let wanted = d.written().filter(|s| s.accepted_by_user).collect();
    [
        graded("confirmed", "", by(StepStatus::Confirmed)),
        graded("indicated", ", written in part", by(StepStatus::Indicated)),
        graded("accepted", ", as you asked", wanted),
    ]
    .concat()
}

/// The errors that count, and of which data they are: held-out ones where there are any.
pub(super) fn errors(of: &SplitErrors) -> (&'static str, &UseErrors) {
    match &of.holdout {
        Some(errors) => ("held-out data", errors),
        None => ("the fitted data", &of.train),
    }
}

/// What is written for prediction alone, counted by law, the error with what is named beside it.
fn for_prediction(d: &Diagnosis) -> Option<FoundLine> {
    let mut laws: Vec<(&str, usize)> = Vec::new();
    for term in &d.predicting {
        let name = term.estimate.name();
        match laws.iter_mut().find(|(law, _)| *law == name) {
            Some((_, count)) => *count += 1,
            None => laws.push((name, 1)),
        }
    }
    laws.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let counted = listed(laws.iter().map(|(law, count)| format!("{count} {law}")));
    let named = number::percent(errors(&d.named).1.overall.mean_relative_error_moving);
    let terms = match d.predicting.len() {
        0 => return None,
        1 => "1 term".to_owned(),
        n => format!("{n} terms"),
    };
    Some(FoundLine {
        grade: "prediction",
        text: format!(
            "written for prediction only: {terms} ({counted}), none of them sure by itself; without them the error \
             is {named} (--named-only)"
        ),
    })
}

/// Why nothing is written for prediction alone where one motion repeats, and what to log.
fn too_few_stretches(d: &Diagnosis) -> Option<FoundLine> {
    let count = d.too_few_stretches.filter(|_| d.long_enough())?;
    Some(FoundLine {
        grade: "one motion",
        text: format!(
            "these logs repeat one motion of {count} independent stretches, and nothing is written for prediction \
             only: log a longer motion, or several"
        ),
    })
}

/// The effects that held-out data took out of the model.
fn taken_out(setup: &RobotSetup, d: &Diagnosis) -> Option<FoundLine> {
    let vetoed = d.steps.iter().filter(|s| s.vetoed());
    let names: Vec<String> = vetoed.map(|s| titled(setup, &s.estimate)).collect();
    (!names.is_empty()).then(|| FoundLine {
        grade: "not written",
        text: format!("{}: the held-out error rises with it", names.join("; ")),
    })
}

/// The joint with the largest share of its torque left beyond the noise.
pub(super) fn worst(d: &Diagnosis) -> Option<usize> {
    let share = |j: &usize| d.left.unexplained[*j].share;
    let structured = d
        .structured_joints()
        .filter(|j| d.left.unexplained[*j].matters());
    structured.max_by(|a, b| share(a).total_cmp(&share(b)))
}

/// The joint with the largest share of its torque left beyond the noise, and the signals on which that depends.
fn most_is_left(setup: &RobotSetup, d: &Diagnosis) -> Option<String> {
    let names = setup.robot.joint_names();
    let worst = worst(d)?;
    let error = number::percent(errors(&d.after).1.joints[worst].headline());
    let place = match names.len() {
        1 => format!("a structured residual ({error} of the torque)"),
        _ => format!(
            "most at {} (error {error}), a structured residual",
            names[worst]
        ),
    };
    let dependence = d.left.dependence.iter().find(|of| of.joint == worst);
    let on = dependence.map(|of| {
        let signals = of.signals.iter().map(|s| signal_words(names, worst, *s));
        let signals: Vec<String> = signals.collect();
        format!(" over {}", signals.join(" and "))
    });
    Some(place + &on.unwrap_or_default())
}
