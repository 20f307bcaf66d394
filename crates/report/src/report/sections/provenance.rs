//! Where a page came from, so that the run can be repeated.

use crate::report::Writer;
use cft_ident_core::motion::Summary;
use cft_ident_core::number;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{DataRole, Provenance, escape};

/// Files by name, span and checksum.
fn files(page: &mut Writer, caption: &str, inputs: &[Provenance]) {
    let rows: Vec<Vec<String>> = inputs
        .iter()
        .map(|i| {
            let log = i.samples > 0;
            let only = |text: String| if log { text } else { String::new() };
            vec![
                escape(&i.name),
                only(i.span.clone().unwrap_or_else(|| "whole".to_owned())),
                only(i.samples.to_string()),
                only(number::significant(i.duration_s, 5)),
                only(i.role.map_or("", DataRole::word).to_owned()),
                i.sha256.clone(),
            ]
        })
        .collect();
    if !rows.is_empty() {
        let head = [
            "file",
            "span",
            "samples",
            "duration [s]",
            "used as",
            "SHA-256",
        ];
        page.rows(caption, &head, rows);
    }
}

/// Files that the run was given.
pub fn inputs(page: &mut Writer, inputs: &[Provenance]) {
    files(page, "inputs of this run", inputs);
}

/// Version and command.
pub fn called(page: &mut Writer, command: &str) {
    page.paragraph(&format!(
        "cft-ident {}, called as:",
        env!("CARGO_PKG_VERSION")
    ));
    page.code(command);
}

/// The section: inputs, what the model was made from, processing, command and configuration.
pub fn section(
    page: &mut Writer,
    robot: &RobotFile,
    inputs: &[Provenance],
    model_inputs: &[Provenance],
    summary: Option<&Summary>,
    command: &str,
) {
    page.heading("Where it came from");
    self::inputs(page, inputs);
    files(page, "what the model was made from", model_inputs);
    if let Some(s) = summary {
        page.paragraph(&format!(
            "Parallel filter {} Hz, {}; position filter {}.",
            number::significant(s.cutoff_hz, 4),
            match s.decimation {
                1 => "every sample".to_owned(),
                many => format!("one in {many} samples"),
            },
            s.q_cutoff_hz.map_or("none".to_owned(), |f| format!(
                "{} Hz",
                number::significant(f, 4)
            )),
        ));
    }
    called(page, command);
    if let Ok(text) = toml::to_string(robot) {
        page.details("robot file, with every setting of this run", &text);
    }
}
