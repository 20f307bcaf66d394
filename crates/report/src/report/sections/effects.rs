//! One card per effect that was added: what it is, the residual without it over the signal on which it depends with
//! the torque that it adds, what is left with it, and what to do about it.

use crate::report::Writer;
use crate::report::figure::EffectFigure;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::number::{self, MILLIMETRES};
use cft_ident_stages::identify::LoggedRobot;
use cft_ident_stages::replay::EffectRows;

/// What a card says besides its picture.
pub struct Said {
    pub title: String,
    pub words: Vec<String>,
    /// Why nothing is gained by the effect, where that is so.
    pub no_gain: Option<String>,
}

/// Part of the residual's rms that an effect takes away at least, where its card is not folded.
const GAIN: f64 = 0.01;

/// The card of an effect of `model`, over logs that are called `data`; folded away where these logs gain little by it.
pub fn card(
    page: &mut Writer,
    (machine, model): (&LoggedRobot, &AugmentedModel),
    of: &EffectRows,
    Said {
        title,
        words: said,
        no_gain,
    }: Said,
    data: &str,
) {
    let effect = &model.effects[of.effect];
    let robot = &machine.robot;
    let joint = &robot.joint_names()[of.joint];
    let unit = machine.file.torque_unit(of.joint);
    let [rms_without, rms_with] = of.rms;
    let [without, with] = of
        .rms
        .map(|rms| format!("{} {unit}", number::significant(rms, 3)));
    let torque = if unit == "N" { "force" } else { "torque" };
    let description = format!(
        "The residual of {joint} on {data} is {without} rms with this {torque} left out and the rest as it is, and {with} with it."
    );
    let small = of.over.1 == "m" && of.rows.iter().all(|row| row[0].abs() < MILLIMETRES);
    let (scale, over) = match small {
        true => (1e3, (of.over.0.clone(), "mm".to_owned())),
        false => (1.0, of.over.clone()),
    };
    let along = match of.along_motion {
        true => ", along the motion",
        false => "",
    };
    let figure = EffectFigure {
        title: title.clone(),
        description: description.clone(),
        over,
        of: (format!("{torque}{along}"), unit.to_owned()),
        rows: (of.rows.iter())
            .map(|[x, without, added]| [scale * x, *without, *added])
            .collect(),
    };
    let mut words = vec![description];
    words.push(format!("What to do: {}.", effect.law.entry.remedy));
    words.extend(said);
    let cells = figure.cells(words);
    let little = match rms_with < rms_without {
        true => format!("little gained on {data} ({without} without it, {with} with it)"),
        false => format!("nothing gained on {data} ({without} without it, {with} with it)"),
    };
    let little = (rms_with > (1.0 - GAIN) * rms_without).then_some(little);
    match no_gain.or(little) {
        Some(why) => page.folded(&format!("{title}: {why}"), &cells),
        None => page.figures(&cells),
    }
}
