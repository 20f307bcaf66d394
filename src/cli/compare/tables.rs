//! The tables of `compare`.

use super::LETTERS;
use crate::compare::{Apart, Difference, ParameterEstimate, Reason};
use crate::identify::{Compared, LoggedRobot, Tried};
use crate::number;
use crate::report::table::{Align, Table, paragraph};

/// Parameters that both have.
pub fn parameter_table(of: &Compared) -> Table {
    let joints = of.table.parameters.iter().any(|p| p.joint.is_some());
    let mut columns = vec![("parameter", Align::Left)];
    if joints {
        columns.insert(0, ("joint", Align::Left));
    }
    columns.extend([
        ("A", Align::Decimal),
        ("std", Align::Decimal),
        ("B", Align::Decimal),
        ("std", Align::Decimal),
        ("B - A", Align::Decimal),
        ("unit", Align::Left),
    ]);
    let mut table = Table::new(&columns).caption(&format!(
        "parameters: A is {}, B is {}; B - A in standard deviations of the difference",
        of.name(0),
        of.name(1)
    ));
    for p in &of.table.parameters {
        let cells = |e: &ParameterEstimate| {
            let (value, std) = number::value_and_std(e.value, e.std.unwrap_or(f64::NAN));
            [value, std]
        };
        let mut row = vec![p.name.clone()];
        if joints {
            row.insert(0, p.joint.clone().unwrap_or_default());
        }
        row.extend(cells(&p.a));
        row.extend(cells(&p.b));
        row.push(match p.deviation {
            Some(d) if d.abs() < 1000.0 => format!("{d:+.1}"),
            Some(d) => format!("{d:+.1e}"),
            None => number::ABSENT.into(),
        });
        row.push(p.unit.clone());
        table.row(row);
    }
    table
}

/// Parameters of one model alone; none where there are none.
pub fn apart_table(of: &Compared, side: usize) -> Option<Table> {
    let only: &[Apart] = [&of.table.only_in_a, &of.table.only_in_b][side];
    if only.is_empty() {
        return None;
    }
    let caption = format!("only in {}, {}", LETTERS[side], of.name(side));
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("parameter", Align::Left),
        ("value", Align::Decimal),
        ("std", Align::Decimal),
        ("unit", Align::Left),
        ("in the other", Align::Left),
    ])
    .caption(&caption);
    for p in only {
        let (value, std) = number::value_and_std(p.value, p.std.unwrap_or(f64::NAN));
        let reason = match p.reason {
            Reason::Absent => "absent",
            Reason::OtherUnit => "in another unit",
            Reason::OtherMeaning => "of another meaning",
        };
        let joint = p.joint.as_deref().unwrap_or("");
        table.row([joint, &p.name, &value, &std, &p.unit, reason]);
    }
    Some(table)
}

/// Errors of both on the same logs.
pub fn error_table(tried: &Tried, machine: &LoggedRobot, logs: &str) -> Table {
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("A", Align::Decimal),
        ("B", Align::Decimal),
        ("B - A", Align::Decimal),
        ("its 95 %", Align::Right),
        ("rms A", Align::Decimal),
        ("rms B", Align::Decimal),
        ("unit", Align::Left),
        ("closer", Align::Left),
    ])
    .caption(&format!("relative torque error of {logs} [%], and its rms"));
    let hundred = number::hundredths;
    let cells = |a: f64, b: f64, d: &Difference| {
        let interval = d
            .interval_95
            .map_or(number::ABSENT.to_owned(), |[low, high]| {
                format!("{}..{}", hundred(low), hundred(high))
            });
        [hundred(a), hundred(b), hundred(d.difference), interval]
    };
    let closer = |d: &Difference| match d.sign() {
        -1 => "B",
        1 => "A",
        _ => number::ABSENT,
    };
    let [a, b] = &tried.validations;
    let told = a
        .joints
        .iter()
        .zip(&b.joints)
        .zip(&tried.differences.joints);
    for (j, ((a, b), d)) in told.enumerate() {
        let [ours, theirs, difference, interval] = cells(a.relative_error, b.relative_error, d);
        let rms = [a.rmse, b.rmse].map(|e| number::significant(e, 3));
        let unit = machine.file.torque_unit(j);
        let row = [
            &a.joint,
            &ours,
            &theirs,
            &difference,
            &interval,
            &rms[0],
            &rms[1],
            unit,
            closer(d),
        ];
        table.row(row);
    }
    if a.joints.len() > 1 {
        let d = &tried.differences.overall;
        let [a, b] = [a, b].map(|v| v.overall.mean_relative_error);
        let [ours, theirs, difference, interval] = cells(a, b, d);
        table.row([
            "all",
            &ours,
            &theirs,
            &difference,
            &interval,
            "",
            "",
            "",
            closer(d),
        ]);
    }
    table
}

/// The tables for a person.
pub fn text(of: &Compared, logs: &str) -> String {
    let mut out = paragraph(&of.words(), 0);
    if !of.table.parameters.is_empty() {
        out += &format!("\n{}", parameter_table(of));
    }
    for table in [0, 1].into_iter().filter_map(|side| apart_table(of, side)) {
        out += &format!("\n{table}");
    }
    if let Some(tried) = &of.tried {
        out += &format!("\n{}", error_table(tried, &of.machine, logs));
    }
    out
}
