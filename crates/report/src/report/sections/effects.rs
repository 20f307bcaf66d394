//! One card per effect that was added: the residual without it over the signal on which it depends with the torque that
//! it adds, the residual with it, and the remedy.

use crate::report::Writer;
use crate::report::figure::EffectFigure;
use crate::report::words::{scaled, torque_or_force};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::number;
use cft_ident_stages::identify::RobotSetup;
use cft_ident_stages::replay::EffectRows;

/// Part of the residual's rms that an effect takes away at least, where its card is not folded.
const GAIN: f64 = 0.01;

/// The card of an effect with its sentences; folded away where `no_gain` says why, or where `data` gain little by it.
pub fn card(
    page: &mut Writer,
    (setup, model): (&RobotSetup, &AugmentedModel),
    of: &EffectRows,
    (title, said, no_gain): (String, Vec<String>, Option<String>),
    data: &str,
) {
    let effect = &model.effects[of.effect];
    let joint = &setup.robot.joint_names()[of.joint];
    let unit = setup.file.torque_unit(of.joint);
    let [rms_without, rms_with] = of.rms;
    let shown = |rms| format!("{} {unit}", number::significant(rms, 3));
    let [without, with] = of.rms.map(shown);
    let torque = torque_or_force(unit);
    let description = format!(
        "The residual of {joint} on {data} is {without} rms with this {torque} left out and the rest as it is, and {with} with it."
    );
    let (name, over_unit) = &of.over;
    let (scale, over_unit) = scaled(over_unit, of.rows.iter().map(|row| row[0]));
    let along = match of.along_motion {
        true => ", along the motion",
        false => "",
    };
    let figure = EffectFigure {
        title: title.clone(),
        description: description.clone(),
        over: (name.clone(), over_unit.to_owned()),
        of: (format!("{torque}{along}"), unit.to_owned()),
        rows: (of.rows.iter())
            .map(|[x, without, added]| [scale * x, *without, *added])
            .collect(),
    };
    let remedy = format!("What to do: {}.", effect.law.entry.remedy);
    let words = [description, remedy].into_iter().chain(said).collect();
    let cells = figure.cells(words);
    let gained = match rms_with < rms_without {
        true => "little",
        false => "nothing",
    };
    let little = format!("{gained} gained on {data} ({without} without it, {with} with it)");
    let little = (rms_with > (1.0 - GAIN) * rms_without).then_some(little);
    match no_gain.or(little) {
        Some(why) => page.folded(format!("{title}: {why}"), cells),
        None => page.figures(cells),
    }
}
