//! What the user wants, after the fit: it is there and the fit came out, or it is refused.

use super::error::DiagnoseError;
use super::outcome::JudgedEffects;
use super::prepared::PreparedCase;
use super::problem::case::AcceptedEffect;
use super::problem::data_split::LogRole;
use crate::effect::ModelEffect;
use crate::explain::ErrorText;
use crate::number;

/// Refuses effects that the user wants where nothing comes of them: no size beside the others, numbers that no file may
/// hold, or a model that leaves more of the rows that it was fitted to than the given one.
pub fn refuse_failed(prepared: &PreparedCase, judged: &JudgedEffects) -> Result<(), DiagnoseError> {
    let wanted = judged.steps.iter().filter(|step| step.accepted_by_user);
    let wanted: Vec<&ModelEffect> = wanted.map(|step| &step.estimate).collect();
    if wanted.is_empty() {
        return Ok(());
    }
    let case = prepared.case;
    let name = |e: &ModelEffect| AcceptedEffect::of(e, &case.given.model.robot).to_string();
    let refused = |name: String, why: String| DiagnoseError::Accept {
        name,
        why: ErrorText::new(why).remedy("log a motion in which it differs from all else"),
    };
    let nothing = |e: &&&ModelEffect| e.linear.iter().all(|x| *x == 0.0) || !e.can_be();
    if let Some(effect) = wanted.iter().find(nothing) {
        let why = "these data do not show it: beside all else its size is 0";
        return Err(refused(name(effect), why.to_owned()));
    }
    let rows = prepared.held_out(LogRole::Train);
    let Some(change) = rows.change([&case.in_use, &judged.written])? else {
        return Ok(());
    };
    let [before, after] = change.mean;
    // a model that holds the given one and more fits worse only where its fit failed
    if after <= (1.0 + case.numbers.noticeable) * before {
        return Ok(());
    }
    let names: Vec<String> = wanted.iter().map(|e| name(e)).collect();
    let [before, after] = [before, after].map(number::percent);
    let why = format!(
        "the fit with it failed: it leaves {after} of the torque of the fitted rows, and the given model {before}"
    );
    Err(refused(names.join(" and "), why))
}
