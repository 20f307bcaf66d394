//! The report of `diff`: two runs beside each other.

use super::compare::{LETTERS, apart_tables, key, parameter_table};
use crate::report::Report;
use crate::report::table::{Align, Table};
use cft_ident_core::number;
use cft_ident_logs::log::escape;
use cft_ident_stages::compare::{ErrorChange, InputChange, RunDifference, VerdictChange};
use cft_ident_stages::identify::DIFFERENT;

/// What differs between the documents `names`, A and B.
pub fn diff(of: &RunDifference, names: &[String; 2]) -> Report {
    let mut report = Report::new(&format!("{} and {}", names[0], names[1]));
    let differ = of.table.parameters.iter();
    let differ = differ.filter(|p| p.deviation.is_some_and(|d| d.abs() > DIFFERENT));
    let mut all = report.everywhere();
    all.verdict(&words(of, differ.clone().count()), of.verdicts.is_empty());
    let mut tables = Vec::new();
    if !of.changed_inputs.is_empty() {
        tables.push(input_table(&of.changed_inputs));
    }
    if !of.errors.is_empty() {
        tables.push(error_table(&of.errors));
    }
    if !of.verdicts.is_empty() {
        tables.push(verdict_table(&of.verdicts));
    }
    if differ.clone().next().is_some() {
        let legend = format!("A is {}, B is {}; ", names[0], names[1]);
        let letters = LETTERS.map(str::to_owned);
        tables.push(parameter_table(differ, &letters, &legend));
    }
    tables.extend(apart_tables(&of.table, names));
    for table in tables {
        all.line("");
        all.table(table);
    }
    report
}

fn words(of: &RunDifference, differ: usize) -> String {
    let rated = of.table.parameters.iter().filter(|p| p.deviation.is_some());
    let mut text = format!(
        "{differ} of {} parameters with known uncertainty differ by more than {DIFFERENT} standard \
         deviations; {} changed.",
        rated.count(),
        match of.verdicts.len() {
            0 => "no verdict".to_owned(),
            1 => "one verdict".to_owned(),
            n => format!("{n} verdicts"),
        }
    );
    if of.changed_inputs.is_empty() {
        text += " Both runs read the same inputs, so their errors are not independent.";
    }
    if let [a, b] = of.versions.as_slice()
        && a != b
    {
        text += &format!(" Version {} wrote A, {} wrote B.", escape(a), escape(b));
    }
    text
}

fn input_table(inputs: &[InputChange]) -> Table {
    let mut table = Table::new(&[
        ("input", Align::Left),
        ("span", Align::Left),
        ("SHA-256", Align::Left),
        ("only in", Align::Left),
    ])
    .caption("inputs that are not the same");
    for input in inputs {
        let sum: String = input.sha256.chars().take(12).collect();
        let span = input.span.as_deref().unwrap_or("");
        let side = input.only_in.to_uppercase();
        table.row([&escape(&input.name), &escape(span), &escape(&sum), &side]);
    }
    table
}

fn error_table(errors: &[ErrorChange]) -> Table {
    let interval = |interval: Option<[f64; 2]>| {
        let shown = |[low, high]: [f64; 2]| {
            format!("{}..{}", number::hundredths(low), number::hundredths(high))
        };
        interval.map_or(String::new(), shown)
    };
    let has_intervals = errors
        .iter()
        .any(|e| e.a_interval_95.or(e.b_interval_95).is_some());
    let mut columns = vec![
        ("error", Align::Left),
        ("joint", Align::Left),
        ("A", Align::Decimal),
        ("B", Align::Decimal),
    ];
    if has_intervals {
        columns.insert(3, ("95 % CI", Align::Right));
        columns.push(("95 % CI", Align::Right));
    }
    let mut table = Table::new(&columns).caption("relative torque error [%]");
    let cell = |value: Option<f64>| value.map_or(number::ABSENT.to_owned(), number::hundredths);
    for error in errors {
        let joint = escape(error.joint.as_deref().unwrap_or("all"));
        let mut row = vec![escape(&error.of), joint, cell(error.a)];
        if has_intervals {
            row.push(interval(error.a_interval_95));
        }
        row.push(cell(error.b));
        if has_intervals {
            row.push(interval(error.b_interval_95));
        }
        table.row(row);
    }
    table
}

fn verdict_table(verdicts: &[VerdictChange]) -> Table {
    let mut table = Table::new(&[
        ("verdict on", Align::Left),
        ("A", Align::Left),
        ("B", Align::Left),
    ])
    .caption("verdicts that changed");
    let cell = |verdict: &Option<String>| escape(verdict.as_deref().unwrap_or(number::ABSENT));
    for change in verdicts {
        let of = key(&change.of, change.joint.as_deref());
        table.row([of, cell(&change.a), cell(&change.b)]);
    }
    table
}
