//! The report of `inspect`: what logs hold and what is wrong with them.

use crate::report::table::{Align, Table};
use crate::report::{Report, Writer};
use cft_ident_core::number;
use cft_ident_logs::inspect::{Findings, LogFault, RowCost, Severity};
use cft_ident_logs::log::escape;
use cft_ident_stages::setup::{Finding, FindingSeverity};

/// The findings of logs, by their names, and of the set-up of the robot file that reads them.
pub fn inspect(logs: &[(String, Findings)], setup: &[Finding]) -> Report {
    let mut report = Report::new("Logs");
    for (name, found) in logs {
        let mut out = report.everywhere();
        out.verdict(
            &head(name, found, setup),
            found.faults.is_empty() && setup.is_empty(),
        );
        out.line("");
        if !found.faults.is_empty() {
            faults(&mut out, found);
            out.line("");
        }
        out.table(channels(found));
        if !found.joints.is_empty() {
            out.line("");
            out.table(joints(found));
        }
        out.line("");
    }
    report
}

fn head(name: &str, found: &Findings, setup: &[Finding]) -> String {
    let of_setup = |severity: Severity| {
        let alike = |finding: &&Finding| match finding.severity {
            FindingSeverity::Error => severity == Severity::Error,
            FindingSeverity::Warning => severity == Severity::Warning,
            FindingSeverity::Hint => severity == Severity::Info,
        };
        setup.iter().filter(alike).count()
    };
    let count = |severity, one: &str| match found.of(severity).count() + of_setup(severity) {
        0 => format!("no {one}s"),
        1 => format!("1 {one}"),
        many => format!("{many} {one}s"),
    };
    let faults = [
        count(Severity::Error, "error"),
        count(Severity::Warning, "warning"),
        count(Severity::Info, "note"),
    ];
    let mut head = format!(
        "{}: {}. {} rows in {} s",
        escape(name),
        match found.faults.is_empty() && setup.is_empty() {
            true => "no faults found".to_owned(),
            false => faults.join(", "),
        },
        found.rows,
        number::significant(found.duration_s, 5)
    );
    if let (Some(rate), Some(jitter)) = (found.rate_hz, found.jitter) {
        head += &format!(
            ", {} Hz, jitter {}, {}",
            number::significant(rate, 5),
            number::percent(jitter),
            match found.gaps.len() {
                0 => "no gaps".to_owned(),
                1 => "1 gap".to_owned(),
                many => format!("{many} gaps"),
            }
        );
    }
    head
}

fn channels(found: &Findings) -> Table {
    let mut table = Table::new(&[
        ("channel", Align::Left),
        ("from", Align::Decimal),
        ("to", Align::Decimal),
        ("unit", Align::Left),
        ("step", Align::Decimal),
        ("limits", Align::Left),
    ]);
    for channel in &found.channels {
        let limits = channel.limits.map(|[low, high]| {
            format!(
                "{}..{}",
                number::significant(low, 4),
                number::significant(high, 4)
            )
        });
        let absent = f64::NAN;
        table.row([
            escape(&channel.name),
            number::significant(channel.min.unwrap_or(absent), 5),
            number::significant(channel.max.unwrap_or(absent), 5),
            channel.unit.clone().unwrap_or_default(),
            channel
                .step
                .map(|step| number::significant(step, 3))
                .unwrap_or_default(),
            limits.unwrap_or_default(),
        ]);
    }
    table
}

fn joints(found: &Findings) -> Table {
    let mut columns = vec![
        ("joint", Align::Left),
        ("moves", Align::Left),
        ("travel", Align::Decimal),
        ("speed", Align::Decimal),
        ("acc.", Align::Decimal),
        ("reversals", Align::Right),
        ("moving", Align::Decimal),
        ("condition", Align::Decimal),
    ];
    let known = found.joints.iter().any(|joint| joint.unit.is_some());
    if known {
        columns.push(("unit", Align::Left));
    }
    let unit = match known {
        true => "unit",
        false => "unit of the log",
    };
    let mut table = Table::new(&columns).caption(&format!(
        "motion: travel [{unit}], greatest speed [{unit}/s] and acceleration [{unit}/s^2]"
    ));
    for joint in &found.joints {
        table.row([
            escape(&joint.joint),
            if joint.moves { "yes" } else { "no" }.to_owned(),
            number::significant(joint.travel, 3),
            number::significant(joint.speed_max, 3),
            number::significant(joint.acceleration_max, 3),
            joint.reversals.to_string(),
            number::percent(joint.moving_share),
            joint
                .condition
                .map(|condition| number::significant(condition, 3))
                .unwrap_or_default(),
            // Left off where there is no column for it.
            joint.unit.clone().unwrap_or_default(),
        ]);
    }
    table
}

fn faults(out: &mut Writer, found: &Findings) {
    if !found.costs.is_empty() {
        let causes: Vec<String> = found.costs.iter().map(RowCost::text).collect();
        out.note(
            "",
            &format!(
                "rows that a fit leaves out or bridges: {}",
                causes.join(", ")
            ),
            2,
        );
    }
    // One channel at several times, or several channels with the same words; notes of one kind.
    let alike = |a: &LogFault, b: &LogFault| {
        let notes = a.severity == Severity::Info && a.kind == b.kind;
        (a.kind, a.severity) == (b.kind, b.severity)
            && (notes
                || a.remedy == b.remedy
                    && (a.channel == b.channel || (&a.effect, a.span()) == (&b.effect, b.span())))
    };
    let cost = |fault: &LogFault| {
        let of_kind = found.costs.iter().find(|cost| cost.kind == fault.kind);
        of_kind.map_or(0, |cost| cost.rows)
    };
    let mut in_order: Vec<&LogFault> = found.faults.iter().collect();
    in_order.sort_by(|a, b| {
        let severity = b.severity.cmp(&a.severity);
        severity.then(cost(b).cmp(&cost(a)))
    });
    let mut shown: Vec<&LogFault> = Vec::new();
    for fault in in_order {
        if shown.iter().any(|earlier| alike(earlier, fault)) {
            continue;
        }
        let all: Vec<&LogFault> = found.faults.iter().filter(|f| alike(f, fault)).collect();
        shown.push(fault);
        let channels = all.iter().filter_map(|fault| fault.channel.as_deref());
        let channels = distinct(channels.map(escape).collect());
        let spans = distinct(all.iter().map(|fault| fault.span()).collect());
        let head = [fault.severity.word(), fault.kind.word(), &channels].join(" ");
        if shown.len() > 1 || !found.costs.is_empty() {
            out.line("");
        }
        out.note("", &format!("{}: {spans} s", head.trim_end()), 0);
        out.note("    ", &fault.effect, 4);
        out.note("    ", &format!("-> {}", fault.remedy), 4);
    }
}

/// Each text once, in a line.
fn distinct(texts: Vec<String>) -> String {
    let mut out: Vec<String> = Vec::new();
    for text in texts {
        if !out.contains(&text) {
            out.push(text);
        }
    }
    out.join(", ")
}
