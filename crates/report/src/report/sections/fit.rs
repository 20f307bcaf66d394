//! How certain the parameters are together: condition, and what the data hardly distinguish.

use crate::report::Writer;
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_stages::identify::{IdentifiedDynamics, WeakestPart};

/// Correlation of two errors from which on a pair is reported.
const MIN_CORRELATION: f64 = 0.9;
/// Pairs and parts of a direction that are reported.
const MAX_SHOWN: usize = 8;

/// The section of a fit.
pub fn section(page: &mut Writer, found: &IdentifiedDynamics, model: &ModelFile) {
    page.heading("Condition and weakest directions");
    let fit = &found.fit;
    let condition = |c: Option<f64>| c.map_or("infinite".to_owned(), |c| number::significant(c, 4));
    page.rows(
        "the stacked regressor of the fit",
        &["what", "value"],
        vec![
            vec![
                "condition as it stands".into(),
                condition(fit.condition.raw),
            ],
            vec![
                "condition, columns scaled to norm 1".into(),
                condition(fit.condition.normalised),
            ],
            vec![
                "rank".into(),
                format!("{} of {}", fit.rank, found.unknowns.len()),
            ],
            vec!["rows per joint".into(), fit.rows.to_string()],
            vec![
                "effective sample size".into(),
                number::significant(fit.effective_rows, 3),
            ],
        ],
    );
    weakest(page, found);
    pairs(page, model);
}

/// The combination of scaled columns with the largest variance.
fn weakest(page: &mut Writer, found: &IdentifiedDynamics) {
    if found.weakest_direction.is_empty() {
        return;
    }
    let parts = found.weakest_direction.iter().take(MAX_SHOWN);
    let row = |part: &WeakestPart| {
        vec![
            part.parameter.clone(),
            part.joint.clone().unwrap_or_default(),
            format!("{:+.2}", part.part),
        ]
    };
    page.rows(
        "weakest direction: the combination of the columns, scaled to norm 1, that is least certain",
        &["parameter", "joint", "part"],
        parts.map(row).collect(),
    );
}

/// Parameters of a model whose estimates are correlated.
pub fn pairs(page: &mut Writer, model: &ModelFile) {
    let Some(covariance) = &model.covariance else {
        return;
    };
    let found = covariance.correlated(MIN_CORRELATION);
    let count = found.len();
    let rows: Vec<Vec<String>> = found
        .into_iter()
        .take(MAX_SHOWN)
        .map(|([a, b], correlation)| vec![a.to_owned(), b.to_owned(), format!("{correlation:+.3}")])
        .collect();
    if rows.is_empty() {
        page.paragraph(&format!(
            "No two estimates are correlated by {MIN_CORRELATION} or more."
        ));
        return;
    }
    page.rows(
        &format!(
            "most correlated estimates, {} of {count} pairs beyond {MIN_CORRELATION}",
            rows.len()
        ),
        &["parameter", "and", "correlation"],
        rows,
    );
}
