//! How certain the parameters are together: condition, and directions that the data hardly distinguish.

use crate::report::figure::HeatFigure;
use crate::report::table::Columns;
use crate::report::{Writer, words};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Covariance;
use cft_ident_stages::identify::IdentifiedDynamics;

/// Correlation of two errors from which on a pair is reported.
const MIN_CORRELATION: f64 = 0.9;
/// Pairs and parts of a direction that are reported.
const MAX_SHOWN: usize = 8;

/// The section of a fit.
pub fn section(page: &mut Writer, found: &IdentifiedDynamics, model: &ModelFile) {
    page.heading("Condition and least certain combination");
    let fit = &found.fit;
    let values = [
        (
            "condition as it stands",
            words::condition(fit.condition.raw),
        ),
        (
            "condition, columns scaled to norm 1",
            words::condition(fit.condition.normalised),
        ),
        ("rank", format!("{} of {}", fit.rank, found.unknowns.len())),
        ("rows per joint", fit.rows.to_string()),
        (
            "effective sample size",
            number::significant(fit.effective_rows, 3),
        ),
    ];
    let columns = Columns::new("the stacked regressor of the fit", &values)
        .words("what", |(what, _)| what)
        .words("value", |(_, value)| value);
    page.table(columns);
    let weakest = found.weakest_direction.iter().take(MAX_SHOWN);
    let caption = "least certain combination of the columns, scaled to norm 1";
    let columns = Columns::new(caption, weakest)
        .words("parameter", |part| &part.parameter)
        .words("joint", |part| part.joint.as_deref().unwrap_or(""))
        .words("part", |part| format!("{:+.2}", part.part));
    page.table_if_any(columns);
    pairs(page, model);
}

/// Parameters that a map of correlations has room for.
const MAX_IN_MAP: usize = 80;

/// All correlations as a map.
fn heat(page: &mut Writer, covariance: &Covariance) {
    let n = covariance.names.len();
    if !(2..=MAX_IN_MAP).contains(&n) {
        return;
    }
    let at = |i: usize, j: usize| {
        let row = covariance.matrix.get(i);
        row.and_then(|row| row.get(j)).copied().unwrap_or(f64::NAN)
    };
    let correlation = |i: usize, j: usize| {
        let value = at(i, j) / (at(i, i) * at(j, j)).sqrt();
        if value.is_finite() { value } else { 0.0 }
    };
    let row = |i: usize| (0..n).map(|j| correlation(i, j)).collect();
    let name = |key: &String| match key.split_once(':') {
        Some((name, joint)) => words::of_joint(name, Some(joint)),
        // of a combination the first of its parts
        None => words::of_joint(key.split(' ').next().unwrap_or(key), None),
    };
    let figure = HeatFigure {
        title: "correlation of the estimates".to_owned(),
        names: covariance.names.iter().map(name).collect(),
        values: (0..n).map(row).collect(),
    };
    page.figure(figure.svg());
}

/// Parameters of a model whose estimates are correlated; of one that holds a part of an effect those of its estimates.
pub fn pairs(page: &mut Writer, model: &ModelFile) {
    let estimates = || model.estimate_covariance.as_ref();
    let Some(covariance) = model.covariance.as_ref().or_else(estimates) else {
        return;
    };
    heat(page, covariance);
    let found = covariance.correlated(MIN_CORRELATION);
    if found.is_empty() {
        page.paragraph(&format!(
            "No two estimates are correlated by {MIN_CORRELATION} or more."
        ));
        return;
    }
    let shown = &found[..found.len().min(MAX_SHOWN)];
    let caption = format!(
        "most correlated estimates, {} of {} pairs beyond {MIN_CORRELATION}",
        shown.len(),
        found.len()
    );
    let columns = Columns::new(&caption, shown)
        .words("parameter", |([a, _], _)| *a)
        .words("and", |([_, b], _)| *b)
        .words("correlation", |(_, correlation)| {
            format!("{correlation:+.3}")
        });
    page.table(columns);
}
