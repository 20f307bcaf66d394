//! The findings of the check of a set-up, for every report.

use crate::report::Writer;
use cft_ident_stages::setup::{FindingSeverity, SetupReport};

/// The findings, nothing where there is none.
pub fn section(out: &mut Writer, report: &SetupReport) {
    let power = report.friction_power.iter().map(ToString::to_string);
    let limits = report.torque_limits.iter().map(ToString::to_string);
    let sentences: Vec<String> = power.chain(limits).collect();
    if report.findings.is_empty() && sentences.is_empty() {
        return;
    }
    out.line("set-up of the robot file");
    for finding in &report.findings {
        let severity = finding.severity;
        out.line("");
        let head = format!("{} {}", severity.word(), finding.kind.word());
        out.note("", &head, 0);
        if severity == FindingSeverity::Hint {
            out.note("    ", &finding.in_words(), 4);
            continue;
        }
        out.note("    ", &finding.meaning, 4);
        if !finding.remedy.is_empty() {
            out.note("    ", &format!("-> write {}", finding.remedy), 4);
        }
        let ties = finding.tied_with.iter().map(|tie| &tie.remedy);
        for remedy in ties.filter(|remedy| !remedy.is_empty()) {
            let text = format!("-> or, by these data as well: {remedy}");
            out.note("    ", &text, 4);
        }
    }
    for sentence in &sentences {
        out.line("");
        out.note("", sentence, 0);
    }
    out.line("");
}
