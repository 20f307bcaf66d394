//! The effects that a diagnosis found, on a page: a table of their numbers, and a card for each that is written.

use super::step_words::{alternatives, certainty, grade, in_words, titled, torque, worsened};
use crate::report::Writer;
use crate::report::sections::effects;
use crate::report::table::Columns;
use cft_ident_core::diagnose::{Diagnosis, FoundEffect};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, RobotSetup};
use cft_ident_stages::replay::ReplayedDiagnosis;

/// The table and the cards.
pub(super) fn show(
    page: &mut Writer,
    setup: &RobotSetup,
    found: &Diagnosed,
    replayed: &ReplayedDiagnosis,
) {
    let d = &found.diagnosis;
    let data = match replayed.held_out {
        true => "held-out data",
        false => "the fitted data",
    };
    for (step, rows) in d.written().zip(&replayed.effects) {
        let title = titled(setup, &step.estimate);
        let said = (title, words(setup, step), no_gain(step));
        effects::card(page, (setup, &d.model), rows, said, data);
    }
    let caption = "estimates, in the order in which the effects were found";
    let columns = Columns::new(caption, &d.steps)
        .words("effect", |step| step.estimate.title(&setup.robot))
        .words("parameters", |step| in_words(setup, step))
        .percent("gain on blocks left out", |step| step.share)
        .words("grade", grade)
        .words("torque (rms, 95 % CI)", |step| {
            torque(setup, &step.estimate, step.torque)
        })
        .words("certainty", certainty);
    page.table_if_any(columns);
    prediction_only(page, setup, d);
}

/// What is written for prediction alone, term by term.
pub(super) fn prediction_only(writer: &mut Writer, setup: &RobotSetup, d: &Diagnosis) {
    let caption = "written for prediction only, none of them sure by itself: the part of the fitted torque that is written, \
                   and the torque error of the joint on held-out data without and with the term";
    let columns = Columns::new(caption, &d.predicting)
        .words("term", |term| term.estimate.title(&setup.robot))
        .percent("written", |term| term.shrinkage)
        .words("torque (rms, 95 % CI)", |term| {
            torque(setup, &term.estimate, term.torque)
        })
        .words("held-out error", |term| match term.held_out {
            Some(errors) => {
                let [without, with] = errors.map(|e| number::significant(e, 3));
                let unit = setup.torque_unit_at(term.estimate.place);
                format!("{without} to {with} {unit}")
            }
            None => number::ABSENT.to_owned(),
        });
    writer.table_if_any(columns);
}

/// That the held-out error does not fall with an effect, in words.
fn no_gain(step: &FoundEffect) -> Option<String> {
    let [before, after] = step.holdout.filter(|[before, after]| after >= before)?;
    let [before, after] = [before, after].map(number::percent);
    Some(format!(
        "the held-out error does not fall by it ({before} without it, {after} with it)"
    ))
}

/// The sentences on one effect beside its picture.
fn words(setup: &RobotSetup, step: &FoundEffect) -> Vec<String> {
    let mut words = vec![format!("Grade: {}.", grade(step))];
    if let Some([before, after]) = step.holdout {
        words.push(format!(
            "Held-out error, as the rms over the joints, the others kept and refitted: {} without it, {} with it{}.",
            number::percent(before),
            number::percent(after),
            worsened(step)
        ));
    }
    words.extend(alternatives(setup, step));
    words
}
