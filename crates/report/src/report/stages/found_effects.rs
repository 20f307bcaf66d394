//! The effects that a diagnosis added, on a page: a table of their numbers, and a card for each.

use super::step_words::{chance, in_words, tentative, worsened};
use crate::report::Writer;
use crate::report::sections::effects;
use cft_ident_core::diagnose::AcceptedEffect;
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, LoggedRobot};
use cft_ident_stages::replay::ReplayedDiagnosis;

/// The table and the cards.
pub(super) fn show(
    page: &mut Writer,
    machine: &LoggedRobot,
    found: &Diagnosed,
    replayed: &ReplayedDiagnosis,
) {
    let d = &found.diagnosis;
    let data = match replayed.held_out {
        true => "held-out data",
        false => "the fitted data",
    };
    for (step, rows) in d.steps.iter().zip(&replayed.effects) {
        let said = words(machine, found, step);
        effects::card(page, (machine, &d.model), rows, said, data);
    }
    if !d.steps.is_empty() {
        table(page, machine, found);
    }
}

/// What is said of one effect besides its picture.
fn words(machine: &LoggedRobot, found: &Diagnosed, step: &AcceptedEffect) -> Vec<String> {
    let d = &found.diagnosis;
    let effect = &d.model.effects[step.effect];
    let mut words = Vec::new();
    if let Some([before, after]) = step.holdout {
        words.push(format!(
            "Held-out error, as the rms over the joints, parameters refitted: {} without it, {} with it{}.",
            number::percent(before),
            number::percent(after),
            worsened(step)
        ));
    }
    if let Some(why) = tentative(d, step) {
        words.push(format!("Its name is tentative: {why}."));
    }
    if !step.alternatives.is_empty() {
        let names = step.alternatives.iter();
        let names: Vec<String> = names.map(|c| c.effect.title(&machine.robot)).collect();
        words.push(format!(
            "These data do not separate it from {}. To tell them apart, {}.",
            names.join(", "),
            effect.law.entry.separate_by
        ));
    }
    words
}

fn table(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    let row = |step: &AcceptedEffect| {
        let effect = &d.model.effects[step.effect];
        let score = step.candidate.score.as_ref();
        vec![
            effect.title(&machine.robot),
            in_words(machine, found, step.effect),
            score.map_or("-".to_owned(), |s| number::percent(s.cv_gain)),
            (step.candidate.placebo_p_value).map_or("-".to_owned(), chance),
        ]
    };
    page.rows(
        "numbers of the last fit, in the order in which the effects were added",
        &[
            "effect",
            "parameters",
            "cross-validated gain",
            "corrected for all candidates",
        ],
        d.steps.iter().map(row).collect(),
    );
}
