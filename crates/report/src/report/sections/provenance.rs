//! Where a page came from, so that the run can be repeated.

use crate::report::Writer;
use crate::report::table::Columns;
use cft_ident_core::motion::Summary;
use cft_ident_core::number;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{DataRole, Provenance, escape};

/// Files by name, span and checksum.
fn files(page: &mut Writer, caption: &str, inputs: &[Provenance]) {
    let of_log = |i: &Provenance, text: String| if i.samples > 0 { text } else { String::new() };
    let span = |i: &Provenance| i.span.clone().unwrap_or_else(|| "whole".to_owned());
    let columns = Columns::new(caption, inputs)
        .words("file", |i| escape(&i.name))
        .words("span", |i| of_log(i, span(i)))
        .words("samples", |i| of_log(i, i.samples.to_string()))
        .words("duration [s]", |i| {
            of_log(i, number::significant(i.duration_s, 5))
        })
        .words("used as", |i| {
            of_log(i, i.role.map_or("", DataRole::word).to_owned())
        })
        .words("SHA-256", |i| &i.sha256);
    page.table_if_any(columns);
}

/// Files that the run was given.
pub(crate) fn inputs(page: &mut Writer, inputs: &[Provenance]) {
    files(page, "inputs of this run", inputs);
}

/// Version and command.
pub(crate) fn called(page: &mut Writer, command: &str) {
    let version = env!("CARGO_PKG_VERSION");
    page.paragraph(&format!("cft-ident {version}, called as:"));
    page.code(command);
}

/// The section: inputs, files that the model was made from, processing, command and configuration.
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
        let hertz = |f: f64| format!("{} Hz", number::significant(f, 4));
        page.paragraph(&format!(
            "Parallel filter {}, {}; position filter {}.",
            hertz(s.cutoff_hz),
            match s.decimation {
                1 => "every sample".to_owned(),
                many => format!("one in {many} samples"),
            },
            s.q_cutoff_hz.map_or("none".to_owned(), hertz),
        ));
    }
    called(page, command);
    if let Ok(text) = toml::to_string(robot) {
        page.details("robot file, with every setting of this run", &text);
    }
}
