//! How certain the parameters are together: condition, and what the data hardly tell apart.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::config::ModelFile;
use crate::identify::IdentifiedDynamics;
use crate::number;
use crate::report::Writer;

/// Correlation of two errors from which on a pair is told.
const ALIKE: f64 = 0.9;
/// Pairs and parts of a direction that are told.
const MOST: usize = 8;

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
                "independent rows that they are worth".into(),
                number::significant(fit.effective_rows, 3),
            ],
        ],
    );
    weakest(page, found);
    pairs(page, model);
}

/// The combination of scaled columns with the largest variance.
fn weakest(page: &mut Writer, found: &IdentifiedDynamics) {
    let fit = &found.fit;
    let n = found.unknowns.len();
    let norm = |i: usize| fit.column_rms.column(i).norm();
    let scaled = DMatrix::from_fn(n, n, |a, b| norm(a) * norm(b) * fit.covariance[(a, b)]);
    if n == 0 || scaled.iter().any(|x| !x.is_finite()) {
        return;
    }
    let eigen = SymmetricEigen::new(scaled);
    let Some(last) = (0..n).max_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]))
    else {
        return;
    };
    let direction = eigen.eigenvectors.column(last);
    let mut parts: Vec<(usize, f64)> = direction.iter().copied().enumerate().collect();
    parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
    // an eigenvector has no sign of its own: its largest part is shown with +
    let sign = parts.first().map_or(1.0, |p| p.1.signum());
    let rows: Vec<Vec<String>> = parts
        .iter()
        .take_while(|(_, x)| x.abs() > 0.1)
        .take(MOST)
        .map(|(i, x)| {
            let unknown = &found.unknowns[*i];
            vec![
                unknown.key.clone(),
                unknown.joint.clone().unwrap_or_default(),
                format!("{:+.2}", sign * x),
            ]
        })
        .collect();
    page.rows(
        "weakest direction: the combination of the columns, scaled to norm 1, that is least certain",
        &["parameter", "joint", "part"],
        rows,
    );
}

/// Parameters of a model whose errors are alike.
pub fn pairs(page: &mut Writer, model: &ModelFile) {
    let Some(covariance) = &model.covariance else {
        return;
    };
    let at = |i: usize, j: usize| covariance.matrix.get(i).and_then(|row| row.get(j)).copied();
    let mut found = Vec::new();
    for i in 0..covariance.names.len() {
        for j in 0..i {
            let (Some(a), Some(b), Some(both)) = (at(i, i), at(j, j), at(i, j)) else {
                continue;
            };
            let correlation = both / (a * b).sqrt();
            if correlation.is_finite() && correlation.abs() >= ALIKE {
                found.push((correlation, j, i));
            }
        }
    }
    found.sort_by(|x, y| {
        y.0.abs()
            .total_cmp(&x.0.abs())
            .then((x.1, x.2).cmp(&(y.1, y.2)))
    });
    let count = found.len();
    let rows: Vec<Vec<String>> = found
        .into_iter()
        .take(MOST)
        .map(|(correlation, i, j)| {
            vec![
                covariance.names[i].clone(),
                covariance.names[j].clone(),
                format!("{correlation:+.3}"),
            ]
        })
        .collect();
    if rows.is_empty() {
        page.paragraph(&format!(
            "No two parameters have errors that correlate by {ALIKE} or more."
        ));
        return;
    }
    page.rows(
        &format!(
            "errors most alike, {} of {count} pairs beyond {ALIKE}",
            rows.len()
        ),
        &["parameter", "and", "correlation"],
        rows,
    );
}
