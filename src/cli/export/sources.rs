//! What an export reads beside the model, what it does not write over, and files that are read back before they are written.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use crate::cli::files::ReadFile;
use crate::cli::{CliError, file_name};
use cft_ident_export::export::left_out::LeftOut;
use cft_ident_export::export::source_text::SourceText;
use cft_ident_export::export::{self, ExportError};
use cft_ident_files::config::{self, WholeUrdf, mjcf_text};
use cft_ident_logs::log::{Provenance, escape};

/// A file that a model is written into.
pub(super) struct SourceFile {
    pub shown: String,
    pub text: String,
    /// Its folder from that of the output; none where it is the same.
    pub folder: Option<String>,
}

impl SourceFile {
    /// An MJCF, with what it includes.
    pub(super) fn mjcf(path: &Path, output: &Path) -> Result<Self, CliError> {
        Ok(Self {
            shown: escape(&path.to_string_lossy()),
            text: mjcf_text(path)?.text,
            folder: folder_from(output, path),
        })
    }

    pub(super) fn to_write<'a>(&'a self, names: &'a BTreeMap<String, String>) -> SourceText<'a> {
        SourceText {
            file: &self.shown,
            text: &self.text,
            names,
            folder: self.folder.as_deref(),
        }
    }
}

/// The folder of `to` as seen from that of `from`; none where they are one.
pub(super) fn folder_from(from: &Path, to: &Path) -> Option<String> {
    let folder = |path: &Path| {
        let folder = path.parent().filter(|folder| *folder != Path::new(""));
        folder.unwrap_or(Path::new(".")).canonicalize().ok()
    };
    let (from, to) = (folder(from)?, folder(to)?);
    if from == to {
        return None;
    }
    let [up, down] = [&from, &to].map(|path| path.components().collect::<Vec<Component>>());
    let shared = up.iter().zip(&down).take_while(|(a, b)| a == b).count();
    let out: PathBuf = match shared {
        0 | 1 => to,
        _ => {
            let back = up[shared..].iter().map(|_| Component::ParentDir);
            back.chain(down[shared..].iter().copied()).collect()
        }
    };
    Some(out.to_string_lossy().into_owned())
}

/// A text with the table of what it cannot say at its head. What `check` finds when it is read back stands there too.
pub(super) fn with_table<T>(
    mut found: Vec<LeftOut>,
    write: impl Fn(&[LeftOut]) -> Result<T, ExportError>,
    check: impl Fn(&T) -> Result<Vec<LeftOut>, ExportError>,
) -> Result<(T, Vec<LeftOut>), ExportError> {
    let written = write(&found)?;
    let more = check(&written)?;
    if more.is_empty() {
        return Ok((written, found));
    }
    found.extend(more);
    Ok((write(&found)?, found))
}
/// A URDF that a model is written into, and what it says.
pub(super) fn source(path: &Path) -> Result<ReadFile<(String, WholeUrdf)>, CliError> {
    let shown = escape(&path.to_string_lossy());
    let (file, text) = (file_name(path), config::text(path)?);
    let whole = WholeUrdf::parse(&shown, &text)?;
    Ok(ReadFile {
        provenance: Provenance::of_text(&file, &text),
        value: (text, whole),
        name: shown,
    })
}

/// Refuses a file beside a URDF that no export has written: a robot file of the same stem, say.
pub(super) fn not_of_others(urdf: &Path, side: &Path) -> Result<(), CliError> {
    let other = std::fs::read(side).is_ok_and(|bytes| {
        let text = String::from_utf8_lossy(&bytes);
        !text
            .lines()
            .any(|line| line.starts_with(export::urdf::SIDE))
    });
    if !other {
        return Ok(());
    }
    let [urdf, side] = [urdf, side].map(|path| path.display());
    let text =
        format!("{side} is there already, and it is no file that belongs to an exported URDF");
    Err(CliError::output(text).hint(format!(
        "the export writes it beside {urdf}: give the URDF another name, or move {side}"
    )))
}
