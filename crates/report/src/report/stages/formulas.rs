//! Formulas of the residual that is left, for a terminal and a page.

use super::what_is_left::axis_of;
use crate::report::Writer;
use crate::report::figure::{EffectFigure, PictureGroup};
use crate::report::words::listed;
use cft_ident_core::diagnose::{FormulaEnd, FormulaPicture};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, FormulaResult, RobotSetup, formula_result};

const NONE: &str = "No formula of few terms explains what is left of a joint: the signals on which it depends stand with it.";

/// The result of a search for a screen: each formula that is confirmed, and why the others are not.
pub(super) fn in_short(usual: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    if !found.searched {
        return;
    }
    let formulas = found.diagnosis.formulas.iter();
    let results: Vec<FormulaResult> = formulas.map(|f| formula_result(setup, f)).collect();
    if results.is_empty() {
        usual.paragraph(NONE);
    }
    let (confirmed, others): (Vec<_>, Vec<_>) =
        results.iter().partition(|f| f.end == FormulaEnd::Found);
    for FormulaResult {
        joint, text, share, ..
    } in confirmed
    {
        let share = number::percent(*share);
        usual.paragraph(&format!(
            "Formula of {joint}: {text}, {share} of what is left; `--accept formula:{joint}` writes it."
        ));
    }
    let others = others.iter();
    let others = listed(others.map(|of| format!("{} ({})", of.joint, why_not(of))));
    if !others.is_empty() {
        usual.paragraph(&format!("No formula confirmed: {others}."));
    }
}

/// The formulas as a file for `--candidates`.
pub(super) fn candidates(detail: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    let formulas = found.diagnosis.formulas.iter();
    for formula in formulas.filter(|formula| formula.end == FormulaEnd::Found) {
        let result = formula_result(setup, formula);
        result.candidate.lines().for_each(|line| detail.line(line));
    }
}

/// The result of a search, joint by joint.
pub(super) fn write(writer: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    if !found.searched {
        return;
    }
    writer.heading("Formulas of what is left");
    let formulas = &found.diagnosis.formulas;
    if formulas.is_empty() {
        writer.paragraph(NONE);
    }
    for formula in formulas {
        let result = formula_result(setup, formula);
        writer.paragraph(&sentence(setup, &result));
        if result.end == FormulaEnd::Found {
            writer.list(numbers(&result));
            writer.details("as a table for --candidates", result.candidate.trim());
            if let Some(picture) = &formula.picture {
                writer.figures(figure(setup, &result, picture));
            }
        }
    }
}

fn why_not(of: &FormulaResult) -> String {
    match of.end {
        FormulaEnd::Found => String::new(),
        FormulaEnd::Chance => format!(
            "chance makes as much in {} of searches",
            number::percent(of.p_value)
        ),
        FormulaEnd::Unsure => "its amplitude is too uncertain".to_owned(),
        FormulaEnd::Worse => "a joint gets worse on data set aside".to_owned(),
    }
}

fn joint_of(setup: &RobotSetup, of: &FormulaResult) -> usize {
    let mut names = setup.robot.joint_names().iter();
    names.position(|name| *name == of.joint).unwrap_or(0)
}

fn sentence(setup: &RobotSetup, of: &FormulaResult) -> String {
    let mut end = match of.end {
        FormulaEnd::Found => format!(
            "It gains on blocks left out, all parts agree (s = {}), and chance makes as much in {} of searches; \
             `--accept formula:{}` writes it.",
            number::significant(of.shrinkage, 2),
            number::percent(of.p_value),
            of.joint
        ),
        _ => format!("Not confirmed: {}.", why_not(of)),
    };
    if let Some(rms) = of.at_reversals {
        let [without, with] = rms.map(|rms| number::significant(rms, 3));
        let unit = setup.file.torque_unit(joint_of(setup, of));
        end += &format!(
            " Within 0.1 s of a reversal, on data set aside, the residual is {without} without it and {with} {unit} with it (rms)."
        );
    }
    let place = match of.in_place_of.is_empty() {
        true => String::new(),
        false => format!(", in place of {}", of.in_place_of.join(", ")),
    };
    format!(
        "{}: {} explains {} of what is left{place}. By its symmetry it is {}. {end}",
        of.joint,
        of.text,
        number::percent(of.share),
        of.kind
    )
}

fn figure(setup: &RobotSetup, of: &FormulaResult, picture: &FormulaPicture) -> PictureGroup {
    let joint = joint_of(setup, of);
    let unit = setup.file.torque_unit(joint).to_owned();
    let figure = EffectFigure {
        title: format!("formula of {}, on data set aside", of.joint),
        description: of.text.clone(),
        over: axis_of(setup, joint, picture.over),
        of: ("torque".to_owned(), unit),
        rows: picture.rows.clone(),
    };
    figure.cells(Vec::new())
}

/// Numbers with units and intervals.
fn numbers(of: &FormulaResult) -> Vec<String> {
    let shown = |x: f64| number::significant(x, 3);
    let numbers = of.parameters.iter().map(|(key, n)| {
        let interval = n.std.map_or(String::new(), |std| {
            let [low, high] = [n.value - 1.96 * std, n.value + 1.96 * std].map(shown);
            format!(" ({low} .. {high})")
        });
        let of_key = of.formulas.get(key);
        let of_key = of_key.map_or(String::new(), |f| format!(" of {f}"));
        format!("{key} = {}{interval} {}{of_key}", shown(n.value), n.unit)
    });
    numbers.collect()
}
