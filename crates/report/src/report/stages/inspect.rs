//! The report of `inspect`: the contents of logs and their faults.

use crate::report::table::{CellAlignment, Columns};
use crate::report::words::listed;
use crate::report::{Report, Writer};
use cft_ident_core::number;
use cft_ident_logs::inspect::{LogFault, LogFindings, RowCost, Severity};
use cft_ident_logs::log::escape;
use cft_ident_stages::setup::{Finding, FindingSeverity};

/// The findings of logs, by their names, and of the set-up of the robot file that reads them.
pub fn inspect(logs: &[(String, LogFindings)], setup: &[Finding]) -> Report {
    let mut report = Report::new("Logs");
    for (name, found) in logs {
        let mut out = report.everywhere();
        let good = found.faults.is_empty() && setup.is_empty();
        out.verdict(&head(name, found, setup), good);
        out.line("");
        if !found.faults.is_empty() {
            faults(&mut out, found);
            out.line("");
        }
        channels(&mut out, found);
        joints(&mut out, found);
        out.line("");
    }
    report
}

fn head(name: &str, found: &LogFindings, setup: &[Finding]) -> String {
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

fn channels(out: &mut Writer, found: &LogFindings) {
    let limits = |[low, high]: [f64; 2]| {
        format!(
            "{}..{}",
            number::significant(low, 4),
            number::significant(high, 4)
        )
    };
    let columns = Columns::new("", &found.channels)
        .words("channel", |c| escape(&c.name))
        .digits("from", 5, |c| c.min)
        .digits("to", 5, |c| c.max)
        .words("unit", |c| c.unit.as_deref().unwrap_or(""))
        .numbers("step", |c| {
            c.step
                .map_or(String::new(), |step| number::significant(step, 3))
        })
        .words("limits", |c| c.limits.map_or(String::new(), limits));
    out.table(columns);
}

fn joints(out: &mut Writer, found: &LogFindings) {
    if found.joints.is_empty() {
        return;
    }
    let known = found.joints.iter().any(|joint| joint.unit.is_some());
    let unit = if known { "unit" } else { "unit of the log" };
    let caption =
        format!("motion: travel [{unit}], greatest speed [{unit}/s] and acceleration [{unit}/s^2]");
    let shown = |x: f64| number::significant(x, 3);
    let columns = Columns::new(&caption, &found.joints)
        .words("joint", |joint| escape(&joint.joint))
        .words("moves", |joint| if joint.moves { "yes" } else { "no" })
        .numbers("travel", |joint| shown(joint.travel))
        .numbers("speed", |joint| shown(joint.speed_max))
        .numbers("acc.", |joint| shown(joint.acceleration_max))
        .column(CellAlignment::Right, "reversals", |joint| {
            joint.reversals.to_string()
        })
        .percent("moving", |joint| joint.moving_share)
        .numbers("condition", |joint| {
            joint.condition.map_or(String::new(), shown)
        })
        .when(known, |t| {
            t.words("unit", |joint| joint.unit.as_deref().unwrap_or(""))
        });
    out.table_apart(columns);
}

fn faults(out: &mut Writer, found: &LogFindings) {
    if !found.costs.is_empty() {
        let causes = listed(found.costs.iter().map(RowCost::text));
        let text = format!("rows that a fit leaves out or bridges: {causes}");
        out.note("", &text, 2);
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
        let channels = distinct(channels.map(escape));
        let spans = distinct(all.iter().map(|fault| fault.span()));
        let head = [fault.severity.word(), fault.kind.word(), &channels].join(" ");
        if shown.len() > 1 || !found.costs.is_empty() {
            out.line("");
        }
        out.note("", &format!("{}: {spans} s", head.trim_end()), 0);
        out.note("    ", &fault.effect, 4);
        for remedy in fault.remedy.lines() {
            out.note("    ", &format!("-> {remedy}"), 4);
        }
    }
}

/// Each text once, in a line.
fn distinct(texts: impl Iterator<Item = String>) -> String {
    let mut out: Vec<String> = Vec::new();
    for text in texts {
        if !out.contains(&text) {
            out.push(text);
        }
    }
    out.join(", ")
}
