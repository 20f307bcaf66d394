//! Formulas of what is left, for a terminal and a page.

use super::what_is_left::axis_of;
use crate::report::Writer;
use crate::report::figure::{Cells, EffectFigure};
use cft_ident_core::diagnose::{FormulaEnd, FormulaPicture};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, FormulaResult, LoggedRobot, formula_result};

/// What a search came to, joint by joint.
pub fn told(writer: &mut Writer, machine: &LoggedRobot, found: &Diagnosed) {
    if !found.searched {
        return;
    }
    writer.heading("Formulas of what is left");
    let formulas = &found.diagnosis.formulas;
    if formulas.is_empty() {
        writer.paragraph(
            "No formula of few terms explains what is left of a joint: the signals on which it depends are told with it.",
        );
    }
    for formula in formulas {
        let result = formula_result(machine, formula);
        writer.paragraph(&sentence(&result));
        if result.end == FormulaEnd::Found {
            writer.list(numbers(&result));
            writer.code(result.candidate.trim());
            if let Some(picture) = &formula.picture {
                writer.figures(&figure(machine, &result, picture));
            }
        }
    }
}

fn sentence(of: &FormulaResult) -> String {
    let end = match of.end {
        FormulaEnd::Found => format!(
            "It gains on blocks left out, all parts agree (s = {}), and chance makes as much in {} of searches; \
             `--accept formula:{}` writes it.",
            number::significant(of.shrinkage, 2),
            number::percent(of.p_value),
            of.joint
        ),
        FormulaEnd::Chance => format!(
            "Not told from chance: {} of searches with other signs find as much.",
            number::percent(of.p_value)
        ),
        FormulaEnd::Parts => "Not confirmed: the parts of the data do not agree on it.".to_owned(),
        FormulaEnd::Worse => {
            "Not confirmed: a joint gets worse by it on data set aside.".to_owned()
        }
    };
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
        told: of.text.clone(),
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
    let told = of.parameters.iter().map(|(key, n)| {
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
    told.collect()
}
