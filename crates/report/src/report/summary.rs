//! The table that most commands end with: torque errors by joint, all of them or the largest.

use super::table::{CellAlignment, Columns, Table};
use super::value::Writer;
use super::words;
use cft_ident_core::number;
use cft_ident_core::validate::JointError;

/// Joints that a screen has room for.
const SCREEN: usize = 8;

/// The joints that a screen shows, those of the largest errors, in their order; and a line about the others.
pub(super) fn most_wrong(errors: &[f64]) -> (Vec<usize>, Option<String>) {
    let mut order: Vec<usize> = (0..errors.len()).collect();
    order.sort_by(|a, b| errors[*b].total_cmp(&errors[*a]));
    let others = order.split_off(SCREEN.min(order.len()));
    order.sort_unstable();
    let more = others.first().map(|largest| {
        let largest = number::percent(errors[*largest]);
        format!("{} more joints, each with {largest} or less", others.len())
    });
    (order, more)
}

/// The errors of the joints with the largest ones, for a screen.
pub(super) fn largest_errors(writer: &mut Writer, caption: &str, rows: &[JointError]) {
    let errors: Vec<f64> = rows.iter().map(JointError::headline).collect();
    let (joints, more) = most_wrong(&errors);
    writer.table(torque_errors(caption, joints.iter().map(|j| &rows[*j])));
    if let Some(more) = more {
        writer.line(&more);
    }
}

/// The errors as a table.
pub(super) fn torque_errors<'a>(
    caption: &str,
    joints: impl IntoIterator<Item = &'a JointError>,
) -> Table {
    let joints: Vec<&JointError> = joints.into_iter().collect();
    let rests = joints.iter().any(|e| e.relative_error_rest.is_some());
    Columns::new(caption, &joints)
        .words("joint", |e| &e.joint)
        .percent("in motion", |e| e.relative_error_moving)
        .digits("rms error", 3, |e| e.rmse_moving)
        .words("unit", |e| e.unit)
        .when(rests, |columns| {
            columns.percent("at rest", |e| e.relative_error_rest)
        })
        .percent("all rows", |e| e.relative_error)
        .digits("largest", 3, |e| e.max_abs)
        .numbers("R2", |e| words::r2(e.r2))
        .column(CellAlignment::Right, "samples", |e| e.samples.to_string())
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_errors_carry_their_unit() {
        let row = JointError {
            joint: "q4".into(),
            unit: "Nm",
            relative_error: 0.0052,
            relative_error_moving: Some(0.0052),
            rmse_moving: Some(0.0123),
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
        let text = torque_errors("Validation on unseen.csv", [&row]).to_string();
        let last: Vec<&str> = text.lines().last().unwrap().split_whitespace().collect();
        assert_eq!(
            last.join(" "),
            "q4 0.520 % 0.0123 Nm 0.520 % 0.0900 0.99993 2000"
        );
    }
}
