//! Formulas of what is left, for a terminal and a page.

use super::what_is_left::axis_of;
use crate::report::Writer;
use crate::report::figure::{Cells, EffectFigure};
use cft_ident_core::diagnose::{FormulaEnd, FormulaPicture};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, FormulaResult, LoggedRobot, formula_result};

const NONE: &str = "No formula of few terms explains what is left of a joint: the signals on which it depends stand with it.";

/// What a search came to, for a screen: each formula that is confirmed, and why the others are not.
pub fn in_short(usual: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    if !found.searched {
        return;
    }
    let formulas = found.diagnosis.formulas.iter();
    let results: Vec<FormulaResult> = formulas.map(|f| formula_result(machine, f)).collect();
    if results.is_empty() {
        usual.paragraph(NONE);
    }
    let (confirmed, others): (Vec<_>, Vec<_>) =
        results.iter().partition(|f| f.end == FormulaEnd::Found);
    for of in confirmed {
        usual.paragraph(&format!(
            "Formula of {}: {}, {} of what is left; `--accept formula:{}` writes it.",
            of.joint,
            of.text,
            number::percent(of.share),
            of.joint
        ));
    }
    let others: Vec<String> = others
        .iter()
        .map(|of| format!("{} ({})", of.joint, why_not(of)))
        .collect();
    if !others.is_empty() {
        usual.paragraph(&format!("No formula confirmed: {}.", others.join(", ")));
    }
}

/// The formulas as a file for `--candidates`.
pub fn candidates(detail: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    for formula in &found.diagnosis.formulas {
        if formula.end == FormulaEnd::Found {
            let result = formula_result(machine, formula);
            result.candidate.lines().for_each(|line| detail.line(line));
        }
    }
}

/// What a search came to, joint by joint.
pub fn write(writer: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    if !found.searched {
        return;
    }
    writer.heading("Formulas of what is left");
    let formulas = &found.diagnosis.formulas;
    if formulas.is_empty() {
        writer.paragraph(NONE);
    }
    for formula in formulas {
        let result = formula_result(machine, formula);
        writer.paragraph(&sentence(machine, &result));
        if result.end == FormulaEnd::Found {
            writer.list(numbers(&result));
            writer.details("as a table for --candidates", result.candidate.trim());
            if let Some(picture) = &formula.picture {
                writer.figures(&figure(machine, &result, picture));
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
        FormulaEnd::Parts => "the parts of the data do not agree".to_owned(),
        FormulaEnd::Worse => "a joint gets worse on data set aside".to_owned(),
    }
}

fn sentence(machine: &LoggedRobot, of: &FormulaResult) -> String {
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
    if let Some([without, with]) = of.at_reversals {
        let joint = machine
            .robot
            .joint_names()
            .iter()
            .position(|n| *n == of.joint);
        end += &format!(
            " Within 0.1 s of a reversal, on data set aside, the residual is {} without it and {} {} with it (rms).",
            number::significant(without, 3),
            number::significant(with, 3),
            machine.file.torque_unit(joint.unwrap_or(0))
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

fn figure(machine: &LoggedRobot, of: &FormulaResult, picture: &FormulaPicture) -> Cells {
    let names = machine.robot.joint_names();
    let joint = names.iter().position(|n| *n == of.joint).unwrap_or(0);
    let figure = EffectFigure {
        title: format!("formula of {}, on data set aside", of.joint),
        description: of.text.clone(),
        over: axis_of(machine, joint, picture.over),
        of: (
            "torque".to_owned(),
            machine.file.torque_unit(joint).to_owned(),
        ),
        rows: picture.rows.clone(),
    };
    figure.cells(Vec::new())
}

/// Numbers with units and intervals.
fn numbers(of: &FormulaResult) -> Vec<String> {
    let numbers = of.parameters.iter().map(|(key, n)| {
        let interval = match n.std {
            Some(std) => format!(
                " ({} .. {})",
                number::significant(n.value - 1.96 * std, 3),
                number::significant(n.value + 1.96 * std, 3)
            ),
            None => String::new(),
        };
        let of_key = of
            .formulas
            .get(key)
            .map_or(String::new(), |f| format!(" of {f}"));
        format!(
            "{key} = {}{interval} {}{of_key}",
            number::significant(n.value, 3),
            n.unit
        )
    });
    numbers.collect()
}
