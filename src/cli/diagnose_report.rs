//! Pictures and page of a diagnosis.

use super::CliError;
use super::diagnose::{Diagnosed, in_words, verdict};
use super::machine::Machine;
use crate::diagnose::{Errors, JointEvidence, Pair, evidence};
use crate::motion::Stretch;
use crate::report::figure::{ResidualFigure, ResidualPanel, When};
use crate::report::number;
use crate::report::page::Page;

/// The residual before and after, over the logs that were fitted.
pub fn figure(machine: &Machine, found: &Diagnosed) -> Result<ResidualFigure, CliError> {
    let last = found.diagnosis.fitted_logs;
    let stretches: Vec<&Stretch> = found
        .held
        .stretches
        .iter()
        .filter(|s| s.log < last)
        .collect();
    let of = |model| {
        evidence(model, &stretches, &found.parallel, found.cutoff_hz).map_err(CliError::input)
    };
    let (before, after) = (of(&found.given)?, of(&found.diagnosis.model)?);
    let joints = machine.robot.joint_names().iter().enumerate();
    let joints = joints
        .map(|(j, name)| (name.clone(), panels(machine, j, &before[j], &after[j])))
        .collect();
    Ok(ResidualFigure {
        title: format!(
            "Residual before and after: {}",
            found.logs[..last].join(", ")
        ),
        joints,
    })
}

fn panels(
    machine: &Machine,
    j: usize,
    before: &JointEvidence,
    after: &JointEvidence,
) -> Vec<ResidualPanel> {
    let torque = machine.file.torque_unit(j).to_owned();
    let position = machine.robot.joint_kind(j).position_unit();
    let wave = if position == "m" { "1/m" } else { "1/rev" };
    let panel = |over: &str, unit: &str, of: &str, lines| ResidualPanel {
        over: (over.into(), unit.into()),
        of: (of.into(), torque.clone()),
        lines,
    };
    let one = |get: fn(&JointEvidence) -> &Vec<[f64; 2]>| {
        vec![
            (When::Before, get(before).clone()),
            (When::After, get(after).clone()),
        ]
    };
    let two = |get: fn(&JointEvidence) -> &[Vec<[f64; 2]>; 2]| {
        let ([a, b], [c, d]) = (get(before).clone(), get(after).clone());
        vec![
            (When::Before, a),
            (When::BeforeBackward, b),
            (When::After, c),
            (When::AfterBackward, d),
        ]
    };
    vec![
        panel("position", position, "mean residual", two(|e| &e.position)),
        panel(
            "velocity",
            &format!("{position}/s"),
            "mean residual",
            one(|e| &e.velocity),
        ),
        panel("load torque", &torque, "mean residual", two(|e| &e.load)),
        panel("time", "s", "residual", one(|e| &e.time)),
        panel("order", wave, "amplitude", one(|e| &e.order)),
        panel("frequency", "Hz", "amplitude", one(|e| &e.frequency)),
    ]
}

/// The report as one page.
pub fn page(machine: &Machine, found: &Diagnosed, name: &str, figure: &str) -> String {
    let d = &found.diagnosis;
    let robot = &machine.robot;
    let mut page = Page::new(&format!("Diagnosis of {name}"));
    let titles: Vec<String> = d
        .steps
        .iter()
        .map(|s| d.model.effects[s.effect].title(robot))
        .collect();
    page.verdict(&match verdict(d) {
        "effects-found" => format!("The model lacks: {}.", titles.join("; ")),
        "nothing-missing" => "Nothing is missing: what is left of the torque is noise.".to_owned(),
        _ => "A residual above the noise is left that no known effect explains.".to_owned(),
    });
    errors(&mut page, machine, found);
    if !d.steps.is_empty() {
        page.heading("What was added");
        steps(&mut page, machine, found);
    }
    page.heading("The residual, before and after");
    page.paragraph(
        "Means over bins of the filtered residual, forward and backward apart; amplitudes of its \
         waves over position and over time. What depends on nothing is noise.",
    );
    page.figure(figure);
    page.heading("Candidates that were not added");
    let mut rest: Vec<_> = d.candidates.iter().filter(|c| c.score.is_some()).collect();
    let gain = |c: &crate::diagnose::Candidate| c.score.as_ref().map_or(0.0, |s| s.cv_gain);
    rest.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let rows: Vec<Vec<String>> = rest
        .iter()
        .take(20)
        .map(|c| {
            vec![
                c.effect.title(robot),
                c.effect.family().name().to_owned(),
                number::percent(gain(c)),
                number::percent(c.score.as_ref().map_or(0.0, |s| s.unique_share)),
                c.reason.clone(),
            ]
        })
        .collect();
    page.table(
        "the best of them, of the last round",
        &[
            "effect",
            "family",
            "cross-validated gain",
            "own share",
            "why not",
        ],
        &rows,
    );
    provenance(&mut page, found);
    page.html()
}

fn errors(page: &mut Page, machine: &Machine, found: &Diagnosed) {
    let d = &found.diagnosis;
    let percent = |e: Option<f64>| e.map_or("-".to_owned(), number::percent);
    let rows: Vec<Vec<String>> = machine
        .robot
        .joint_names()
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let relative = |e: &Errors| e.joints[j].relative_error;
            let unseen = |p: &Pair| p.holdout.as_ref().map(relative);
            let interval = d.after.holdout.as_ref().map_or("-".to_owned(), |e| {
                let [low, high] = e.joints[j].interval_95;
                format!("{} to {}", number::percent(low), number::percent(high))
            });
            let rms = d.after.holdout.as_ref().unwrap_or(&d.after.train).joints[j].rmse;
            vec![
                joint.clone(),
                percent(Some(relative(&d.before.train))),
                percent(Some(relative(&d.after.train))),
                percent(unseen(&d.before)),
                percent(unseen(&d.after)),
                interval,
                format!(
                    "{} {}",
                    number::significant(rms, 3),
                    machine.file.torque_unit(j)
                ),
                number::percent(d.left[j].share),
            ]
        })
        .collect();
    page.table(
        "relative torque error",
        &[
            "joint",
            "fitted, before",
            "after",
            "unseen, before",
            "after",
            "95 % of it",
            "rms after",
            "torque power left above noise",
        ],
        &rows,
    );
}

fn steps(page: &mut Page, machine: &Machine, found: &Diagnosed) {
    let d = &found.diagnosis;
    let mut rows = Vec::new();
    for step in &d.steps {
        let effect = &d.model.effects[step.effect];
        let unseen = step.holdout.map_or("-".to_owned(), |[before, after]| {
            format!("{} to {}", number::percent(before), number::percent(after))
        });
        let alike: Vec<String> = step
            .alternatives
            .iter()
            .map(|c| c.effect.title(&machine.robot))
            .collect();
        let score = step.candidate.score.as_ref();
        rows.push(vec![
            effect.title(&machine.robot),
            in_words(machine, d, step.effect),
            score.map_or("-".to_owned(), |s| number::percent(s.cv_gain)),
            unseen,
            if alike.is_empty() {
                "separated from all others".to_owned()
            } else {
                format!("{}: {}", alike.join(", "), effect.kind.separate_by)
            },
        ]);
    }
    page.table(
        "in the order in which they were added; numbers of the last fit",
        &[
            "effect",
            "parameters",
            "cross-validated gain",
            "unseen",
            "not separated from; what would",
        ],
        &rows,
    );
}

fn provenance(page: &mut Page, found: &Diagnosed) {
    page.heading("Where it came from");
    let rows: Vec<Vec<String>> = found
        .held
        .inputs
        .iter()
        .map(|i| {
            let span = i.span.clone().unwrap_or_else(|| "whole".to_owned());
            vec![
                i.name.clone(),
                span,
                i.samples.to_string(),
                i.sha256.clone(),
            ]
        })
        .collect();
    page.table("logs", &["name", "span", "samples", "SHA-256"], &rows);
    let s = &found.held.summary;
    page.paragraph(&format!(
        "cft-ident {}; parallel filter {} Hz, every {} samples; position filter {}.",
        env!("CARGO_PKG_VERSION"),
        s.cutoff_hz,
        s.decimation,
        s.q_cutoff_hz
            .map_or("none".to_owned(), |f| format!("{f} Hz")),
    ));
}
