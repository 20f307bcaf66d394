//! What exported files and the terminal say of what is left out.

use super::FormatOmission;
use cft_ident_core::number;
use cft_ident_export::export::Program;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::escape;
use cft_ident_report::report::table::{CellAlignment, Table};

/// The effects of a model, as a person names them.
pub(super) fn effects(file: &ModelFile) -> Vec<String> {
    let of = |e: &cft_ident_files::config::model_file::EffectSection| match &e.joint {
        Some(joint) => format!("{} of {}", escape(&e.name), escape(joint)),
        None => escape(&e.name),
    };
    file.effects.iter().map(of).collect()
}

pub(super) fn beyond_table(beyond: &[FormatOmission]) -> String {
    if beyond.is_empty() {
        return String::new();
    }
    let mut table = Table::new(&[
        ("file", CellAlignment::Left),
        ("what it cannot say", CellAlignment::Left),
        ("% of torque", CellAlignment::Decimal),
        ("at", CellAlignment::Left),
    ]);
    for part in beyond {
        let percent = part.percent_of_torque;
        table.row([
            part.file.as_str(),
            &part.what,
            &percent.map_or("-".to_owned(), |x| number::significant(x, 3)),
            part.joint.as_deref().unwrap_or("-"),
        ]);
    }
    format!("\n{table}")
}

pub(super) fn about_effects(program: &Program, left_out: &[String]) -> Vec<String> {
    if let Some(line) = not_in_here(left_out) {
        return vec![line];
    }
    let mut lines = vec!["Nothing of the model is left out.".to_owned()];
    let effects = &program.effects;
    if !effects.titles.is_empty() {
        let titles: Vec<String> = effects.titles.iter().map(|name| escape(name)).collect();
        lines.push(format!("Effects: {}.", titles.join(", ")));
    }
    if effects.remember_anything() {
        lines.push("Some remember the motion: init, then step once a sample.".to_owned());
    }
    let late = effects.lead_s.iter().zip(&program.joints);
    for (lead, joint) in late.filter(|(lead, _)| **lead != 0.0) {
        lines.push(format!(
            "The logged torque of {} has a delay of {} s, {} samples at 1 kHz: these functions give the torque \
             without it; send it that much earlier.",
            escape(joint),
            number::significant(*lead, 6),
            number::significant(1000.0 * lead, 4),
        ));
    }
    lines
}

/// Where the friction of the model would drive a joint, which no code of it does.
pub(super) fn never_driving(program: &Program) -> Vec<String> {
    let each = program.joints.iter().zip(&program.kinds);
    let each = each.zip(&program.drives_at);
    let words = each.filter_map(|((joint, kind), speeds)| {
        let [low, high] = (*speeds)?.map(|v| number::significant(v, 2));
        Some(format!(
            "the friction of {} drives it between {low} and {high} {}/s in the model: there it is 0 in the code",
            escape(joint),
            kind.position_unit()
        ))
    });
    words.collect()
}

/// That effects were asked to be left out.
pub(super) fn not_in_here(left_out: &[String]) -> Option<String> {
    let all = left_out.join(", ");
    (!left_out.is_empty()).then(|| format!("NOT in here, though the model has it: {all}."))
}
