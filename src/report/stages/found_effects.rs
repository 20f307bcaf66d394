//! The effects that a diagnosis added, on a page: a table of their numbers, and a card for each.

use super::step_words::{in_words, tentative, worsened};
use crate::diagnose::AcceptedEffect;
use crate::identify::{Diagnosed, LoggedRobot};
use crate::motion::MotionError;
use crate::number;
use crate::report::Writer;
use crate::report::sections::{Look, effects};

/// The table and the cards, over the logs `shown`, which are called `data`.
///
/// # Errors
/// Stretches that are too short for the filter.
pub(super) fn show(
    page: &mut Writer,
    (machine, found): (&LoggedRobot, &Diagnosed),
    look: &Look,
    (shown, data): (&[usize], &str),
) -> Result<(), MotionError> {
    let d = &found.diagnosis;
    let added = d.steps.iter();
    let added = added.map(|step| (step.effect, words(machine, found, step)));
    effects::cards(page, look, &d.model, added, (shown, data))?;
    if !d.steps.is_empty() {
        table(page, machine, found);
    }
    Ok(())
}

/// What is said of one effect besides its picture.
fn words(machine: &LoggedRobot, found: &Diagnosed, step: &AcceptedEffect) -> Vec<String> {
    let d = &found.diagnosis;
    let effect = &d.model.effects[step.effect];
    let mut words = Vec::new();
    if let Some([before, after]) = step.holdout {
        words.push(format!(
            "Held-out error, as the rms over the joints: {} before it was added, {} after{}.",
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
            (step.candidate.placebo_p_value).map_or("-".to_owned(), |p| format!("{p:.3}")),
        ]
    };
    page.rows(
        "numbers of the last fit, in the order in which the effects were added",
        &[
            "effect",
            "parameters",
            "cross-validated gain",
            "corrected p",
        ],
        d.steps.iter().map(row).collect(),
    );
}
