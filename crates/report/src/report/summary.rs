//! The two tables that most commands end with: parameters, and torque errors per joint.

use super::table::{Align, Table};
use super::value::Writer;
use cft_ident_core::number::{self, ABSENT};
use cft_ident_core::validate::JointError;

/// One estimated parameter, as a table shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterRow<'a> {
    /// Joint or group that it belongs to; may be empty.
    pub joint: &'a str,
    /// Name of the parameter.
    pub name: &'a str,
    /// Number in the report's Table 4, where it has one.
    pub theta: Option<u32>,
    /// Estimate [unit].
    pub value: f64,
    /// Standard deviation of the estimate [unit]; not finite where unknown.
    pub std: f64,
    /// Unit of both.
    pub unit: &'a str,
    /// What the data say of it (`identified`, `weak`, `lower-bound`, ...).
    pub verdict: &'a str,
    /// True value [unit], where it is known.
    pub truth: Option<f64>,
}

/// The parameters as a table. Columns without a single entry are left out; next to the truth stands
/// the deviation from it in standard deviations.
pub fn parameters(caption: &str, rows: &[ParameterRow]) -> Table {
    let joints = rows.iter().any(|row| !row.joint.is_empty());
    let thetas = rows.iter().any(|row| row.theta.is_some());
    let truths = rows.iter().any(|row| row.truth.is_some());
    let mut columns = vec![("parameter", Align::Left)];
    if joints {
        columns.insert(0, ("joint", Align::Left));
    }
    if thetas {
        columns.push(("theta", Align::Right));
    }
    columns.extend([("value", Align::Decimal), ("std", Align::Decimal)]);
    if truths {
        columns.extend([("truth", Align::Decimal), ("off [std]", Align::Decimal)]);
    }
    columns.extend([("unit", Align::Left), ("verdict", Align::Left)]);
    let mut table = Table::new(&columns).caption(caption);
    for row in rows {
        let (value, std) = number::value_and_std(row.value, row.std);
        let mut cells = vec![row.name.to_owned()];
        if joints {
            cells.insert(0, row.joint.to_owned());
        }
        if thetas {
            cells.push(row.theta.map_or(ABSENT.into(), |theta| theta.to_string()));
        }
        cells.extend([value, std]);
        if truths {
            let truth = row.truth.unwrap_or(f64::NAN);
            cells.push(number::value_and_std(truth, row.std).0);
            let deviation = (row.value - truth) / row.std;
            cells.push(match deviation.is_finite() {
                true => format!("{deviation:+.1}"),
                false => ABSENT.into(),
            });
        }
        cells.extend([row.unit.to_owned(), row.verdict.to_owned()]);
        table.row(cells);
    }
    table
}

/// Joints that a screen has room for.
pub(crate) const SCREEN: usize = 8;

/// The joints that a screen shows, those of the largest errors, in their order; and a line about the others.
pub(crate) fn most_wrong(errors: &[f64]) -> (Vec<usize>, Option<String>) {
    let mut order: Vec<usize> = (0..errors.len()).collect();
    order.sort_by(|a, b| errors[*b].total_cmp(&errors[*a]));
    let others = order.split_off(SCREEN.min(order.len()));
    order.sort_unstable();
    let more = others.first().map(|largest| {
        format!(
            "{} more joints, each with {} or less",
            others.len(),
            number::percent(errors[*largest])
        )
    });
    (order, more)
}

/// The errors of the joints with the largest ones, for a screen.
pub(crate) fn largest_errors(writer: &mut Writer, caption: &str, rows: &[JointError]) {
    let errors: Vec<f64> = rows.iter().map(|row| row.relative_error).collect();
    let (joints, more) = most_wrong(&errors);
    let shown: Vec<JointError> = joints.into_iter().map(|j| rows[j].clone()).collect();
    writer.table(torque_errors(caption, &shown));
    if let Some(more) = more {
        writer.line(&more);
    }
}

/// The errors as a table.
pub(crate) fn torque_errors(caption: &str, rows: &[JointError]) -> Table {
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("relative error", Align::Decimal),
        ("rms error", Align::Decimal),
        ("largest", Align::Decimal),
        ("unit", Align::Left),
        ("R2", Align::Decimal),
        ("samples", Align::Right),
    ])
    .caption(caption);
    for row in rows {
        let r2 = match row.r2.is_finite() {
            true => format!("{:.5}", row.r2),
            false => ABSENT.into(),
        };
        table.row([
            row.joint.as_str(),
            &number::percent(row.relative_error),
            &number::significant(row.rmse, 3),
            &number::significant(row.max_abs, 3),
            row.unit,
            &r2,
            &row.samples.to_string(),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_stand_beside_their_truth_in_80_columns() {
        let rows = [
            ParameterRow {
                joint: "q1",
                name: "viscous",
                theta: Some(13),
                value: 52.4127,
                std: 0.31,
                unit: "N s/m",
                verdict: "identified",
                truth: Some(52.1),
            },
            ParameterRow {
                joint: "q1",
                name: "slope_1",
                theta: Some(16),
                value: 812.0,
                std: f64::NAN,
                unit: "s/m",
                verdict: "lower-bound",
                truth: None,
            },
        ];
        let expected = "\
Friction
joint  parameter  theta   value   std  truth  off [std]  unit   verdict
-----  ---------  -----  ------  ----  -----  ---------  -----  -----------
q1     viscous       13   52.41  0.31  52.10       +1.0  N s/m  identified
q1     slope_1       16  812.00     -      -          -  s/m    lower-bound
";
        assert_eq!(parameters("Friction", &rows).to_string(), expected);
        let plain = ParameterRow {
            joint: "",
            theta: None,
            truth: None,
            ..rows[0].clone()
        };
        let text = parameters("Fit", &[plain]).to_string();
        assert!(!text.contains("truth") && !text.contains("joint") && !text.contains("theta"));
    }

    #[test]
    fn torque_errors_carry_their_unit() {
        let row = JointError {
            joint: "q4".into(),
            unit: "Nm",
            relative_error: 0.0052,
            relative_error_moving: Some(0.0052),
            relative_error_rest: None,
            relative_error_raw: 0.0052,
            rmse: 0.0123,
            coverage_95: None,
            half_width: None,
            max_abs: 0.09,
            r2: 0.99993,
            samples: 2000,
            resting: 0,
        };
        let text = torque_errors("Validation on unseen.csv", &[row]).to_string();
        let last = text.lines().last().unwrap();
        let words: Vec<&str> = last.split_whitespace().collect();
        assert_eq!(
            words,
            [
                "q4", "0.520", "%", "0.0123", "0.0900", "Nm", "0.99993", "2000"
            ]
        );
    }
}
