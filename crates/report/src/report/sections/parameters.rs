//! Parameters with their standard deviations and what the data say of them.

use super::first_of;
use crate::report::Writer;
use cft_ident_core::number;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;

/// How many parameters have which verdict, in words, and whether all are identified or negligible.
pub fn tally(model: &ModelFile) -> (String, bool) {
    let rated = || model.parameters.iter().filter(|p| p.verdict.is_some());
    let negligible = rated().filter(|p| p.is_negligible()).count();
    let count = |wanted| rated().filter(|p| p.verdict == Some(wanted)).count();
    let mut words = vec![format!(
        "{} of {} parameters are identified",
        count(Verdict::Identified) - negligible,
        rated().count()
    )];
    let others = [
        (Verdict::Weak, "weak"),
        (Verdict::LowerBound, "known to one side only"),
        (Verdict::NotIdentifiable, "not determined by these data"),
    ];
    for (verdict, word) in others {
        match count(verdict) {
            0 => {}
            n => words.push(format!("{n} {word}")),
        }
    }
    let known = |p: &&Parameter| p.verdict != Some(Verdict::NotIdentifiable);
    let negative: Vec<String> = (rated().filter(known))
        .filter(|p| p.is_below_zero())
        .map(|p| match &p.joint {
            Some(joint) => format!("{} of {joint}", p.name),
            None => p.name.clone(),
        })
        .collect();
    if !negative.is_empty() {
        words[0] += &format!(
            " ({} of the known negative, which no machine has: {})",
            negative.len(),
            first_of(&negative)
        );
    }
    let good = words.len() == 1 && negative.is_empty();
    if negligible > 0 {
        words.insert(1, format!("{negligible} negligible"));
    }
    (words.join(", "), good)
}

/// The section; `truth` gives the true value of a parameter where it is known.
pub fn section(page: &mut Writer, model: &ModelFile, truth: &dyn Fn(&Parameter) -> Option<f64>) {
    page.heading("Parameters");
    let truths = model.parameters.iter().any(|p| truth(p).is_some());
    // theta_1 needs no column that says 1
    let named = |p: &Parameter| {
        p.theta
            .is_none_or(|theta| p.name == format!("theta_{theta}"))
    };
    let thetas = !model.parameters.iter().all(named);
    let mut head = vec!["parameter", "joint"];
    if thetas {
        head.push("theta");
    }
    head.extend(["value", "std", "relative std"]);
    if truths {
        head.extend(["truth", "off by"]);
    }
    head.extend(["unit", "verdict", "meaning"]);
    let rows: Vec<Vec<String>> = model
        .parameters
        .iter()
        .map(|p| {
            let unknown = p.verdict == Some(Verdict::NotIdentifiable);
            let std = p.std.unwrap_or(f64::NAN);
            let (value, deviation) = match unknown {
                true => number::value_and_std(f64::NAN, f64::NAN),
                false => number::value_and_std(p.value, std),
            };
            let relative = match unknown {
                true => number::ABSENT.to_owned(),
                false => number::percent(std / p.value.abs()),
            };
            let mut row = vec![p.name.clone(), p.joint.clone().unwrap_or_default()];
            if thetas {
                row.push(p.theta.map_or(String::new(), |theta| theta.to_string()));
            }
            row.extend([value, deviation, relative]);
            if truths {
                let truth = truth(p).unwrap_or(f64::NAN);
                row.push(number::value_and_std(truth, std).0);
                let off = (p.value - truth) / std;
                row.push(match off.is_finite() {
                    true => format!("{off:+.1} std"),
                    false => number::ABSENT.to_owned(),
                });
            }
            let verdict = match p.is_below_zero() && !unknown {
                true => format!("{}, below zero", p.verdict_word()),
                false => p.verdict_word().to_owned(),
            };
            row.extend([p.unit.clone(), verdict, p.meaning.clone()]);
            row
        })
        .collect();
    page.rows(
        "value and standard deviation (std) in the unit named",
        &head,
        rows,
    );
    let known = |p: &&Parameter| p.verdict != Some(Verdict::NotIdentifiable);
    if model
        .parameters
        .iter()
        .filter(known)
        .any(Parameter::is_below_zero)
    {
        page.paragraph(
            "Below zero: friction and inertia are positive in every machine. The cause may be a torque that \
             the model lacks, or a motion that does not separate these parameters from others. Torques are \
             computed with the nearest numbers that can exist, where the model holds them.",
        );
    }
    effects(page, model);
}

/// Effects that the model has beyond the declared structure.
fn effects(page: &mut Writer, model: &ModelFile) {
    let rows: Vec<Vec<String>> = model
        .effects
        .iter()
        .flat_map(|effect| {
            effect.parameters.iter().map(|(key, p)| {
                let (value, std) = number::value_and_std(p.value, p.std.unwrap_or(f64::NAN));
                vec![
                    effect.name.clone(),
                    effect.joint.clone().unwrap_or_default(),
                    key.clone(),
                    value,
                    std,
                    p.unit.clone(),
                ]
            })
        })
        .collect();
    if !rows.is_empty() {
        let head = ["effect", "joint", "parameter", "value", "std", "unit"];
        page.rows("effects that were added to the declared model", &head, rows);
    }
}
