//! The report of `diff`: two runs beside each other.

use super::compare::{LETTERS, apart_tables, parameter_table};
use crate::report::Report;
use crate::report::table::{Align, Columns, Table};
use crate::report::words::of_joint;
use cft_ident_core::number;
use cft_ident_logs::log::escape;
use cft_ident_stages::compare::{ErrorChange, InputChange, RunDifference, VerdictChange};
use cft_ident_stages::identify::DIFFERENT;

/// The differences between the documents `names`, A and B.
pub fn diff(of: &RunDifference, names: &[String; 2]) -> Report {
    let mut report = Report::new(&format!("{} and {}", names[0], names[1]));
    let differ = of.table.parameters.iter();
    let differ = differ.filter(|p| p.deviation.is_some_and(|d| d.abs() > DIFFERENT));
    let differ: Vec<_> = differ.collect();
    let mut all = report.everywhere();
    all.verdict(&verdict(of, differ.len()), of.verdicts.is_empty());
    let legend = format!("A is {}, B is {}; ", names[0], names[1]);
    let tables = [
        input_table(&of.changed_inputs),
        error_table(&of.errors),
        verdict_table(&of.verdicts),
        parameter_table(&differ, &LETTERS.map(str::to_owned), &legend),
    ];
    let tables = tables.into_iter().chain(apart_tables(&of.table, names));
    for table in tables.filter(|table| !table.is_empty()) {
        all.table_apart(table);
    }
    report
}

fn verdict(of: &RunDifference, differ: usize) -> String {
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
    Columns::new("inputs that are not the same", inputs)
        .words("input", |input| escape(&input.name))
        .words("span", |input| escape(input.span.as_deref().unwrap_or("")))
        .words("SHA-256", |input| {
            escape(&input.sha256.chars().take(12).collect::<String>())
        })
        .words("only in", |input| input.only_in.to_uppercase())
        .into()
}

fn error_table(errors: &[ErrorChange]) -> Table {
    let interval = |interval: Option<[f64; 2]>| match interval {
        Some(ends) => ends.map(number::hundredths).join(".."),
        None => String::new(),
    };
    let mut intervals = errors.iter().map(|e| e.a_interval_95.or(e.b_interval_95));
    let known = intervals.any(|interval| interval.is_some());
    let percent = |error: Option<f64>| number::hundredths(error.unwrap_or(f64::NAN));
    Columns::new("relative torque error [%]", errors)
        .words("error", |e| escape(&e.of))
        .words("joint", |e| escape(e.joint.as_deref().unwrap_or("all")))
        .numbers("A", |e| percent(e.a))
        .when(known, |t| {
            t.column(Align::Right, "95 % CI", |e| interval(e.a_interval_95))
        })
        .numbers("B", |e| percent(e.b))
        .when(known, |t| {
            t.column(Align::Right, "95 % CI", |e| interval(e.b_interval_95))
        })
        .into()
}

fn verdict_table(verdicts: &[VerdictChange]) -> Table {
    let cell = |verdict: &Option<String>| escape(verdict.as_deref().unwrap_or(number::ABSENT));
    Columns::new("verdicts that changed", verdicts)
        .words("verdict on", |change| {
            of_joint(&change.of, change.joint.as_deref())
        })
        .words("A", |change| cell(&change.a))
        .words("B", |change| cell(&change.b))
        .into()
}
