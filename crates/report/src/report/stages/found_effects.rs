//! The effects that a diagnosis found, on a page: a table of their numbers, and a card for each that is written.

use super::step_words::{agreement, alternatives, grade, in_words, titled, worsened};
use crate::report::Writer;
use crate::report::sections::effects::{self, Said};
use cft_ident_core::diagnose::FoundEffect;
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
    for (step, rows) in d.written().zip(&replayed.effects) {
        let said = Said {
            title: titled(machine, &step.estimate),
            words: words(machine, step),
            no_gain: no_gain(step),
        };
        effects::card(page, (machine, &d.model), rows, said, data);
    }
    if !d.steps.is_empty() {
        table(page, machine, found);
    }
}

/// That the held-out error does not fall with an effect, in words.
fn no_gain(step: &FoundEffect) -> Option<String> {
    let [before, after] = step.holdout.filter(|[before, after]| after >= before)?;
    let [before, after] = [before, after].map(number::percent);
    Some(format!(
        "the held-out error does not fall by it ({before} without it, {after} with it)"
    ))
}

/// What is said of one effect besides its picture.
fn words(machine: &LoggedRobot, step: &FoundEffect) -> Vec<String> {
    let mut words = vec![format!("Grade: {}.", grade(step))];
    if let Some([before, after]) = step.holdout {
        words.push(format!(
            "Held-out error, as the rms over the joints, the others kept and refitted: {} without it, {} with it{}.",
            number::percent(before),
            number::percent(after),
            worsened(step)
        ));
    }
    words.extend(alternatives(machine, step));
    words
}

fn table(page: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    let d = &found.diagnosis;
    let row = |step: &FoundEffect| {
        vec![
            step.estimate.title(&machine.robot),
            in_words(machine, step),
            number::percent(step.share),
            grade(step).to_owned(),
            agreement(step),
        ]
    };
    page.rows(
        "estimates, in the order in which the effects were found",
        &[
            "effect",
            "parameters",
            "gain on blocks left out",
            "grade",
            "agreement",
        ],
        d.steps.iter().map(row).collect(),
    );
}
