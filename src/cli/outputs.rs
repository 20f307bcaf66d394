//! Outputs are looked at before the long run: an unwritable folder, or a name used twice, is reported
//! at once and not after the work.

use std::path::{Path, PathBuf};

use super::error::CliError;

/// Checks the files that a command is going to write: see [`super::Context::check_outputs`].
pub(super) fn check<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), CliError> {
    let inputs: Vec<PathBuf> = inputs.into_iter().map(resolved).collect();
    let mut seen: Vec<PathBuf> = Vec::new();
    for output in outputs {
        let full = resolved(output);
        if seen.contains(&full) {
            let text = format!("two outputs are the same file {}", output.display());
            return Err(CliError::usage(text).hint("give each output a name of its own"));
        }
        if inputs.contains(&full) {
            let text = format!("the output {} would overwrite an input", output.display());
            return Err(CliError::usage(text).hint("give the output a name of its own"));
        }
        writable(output)?;
        seen.push(full);
    }
    Ok(())
}

/// The files that a command writes, where they are asked for.
pub(super) fn listed<'a>(
    output: Option<&'a Path>,
    plot: &'a [PathBuf],
    report: Option<&'a Path>,
) -> impl Iterator<Item = &'a Path> {
    let plot = plot.iter().map(PathBuf::as_path);
    output.into_iter().chain(plot).chain(report)
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The path with its folder resolved, so that `a.csv` and `./a.csv` are one; a link that is there is followed.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(full) = path.canonicalize() {
        return full;
    }
    match (folder(path).canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}

fn writable(path: &Path) -> Result<(), CliError> {
    let failed =
        |reason: &str| CliError::output(format!("cannot write {}: {reason}", path.display()));
    if path.is_dir() {
        return Err(failed("it is a folder").hint("name a file inside it"));
    }
    let folder = folder(path);
    if !folder.is_dir() {
        return Err(failed("its folder does not exist")
            .hint(format!("make it first: mkdir -p {}", folder.display())));
    }
    if path.exists() && !path.is_file() {
        // A device or a pipe is written directly, not replaced.
        return Ok(());
    }
    // An unnamed file shows that one can be written here, and leaves nothing behind.
    tempfile::tempfile_in(folder)
        .map(|_| ())
        .map_err(|error| failed(&error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::exit::Exit;

    #[test]
    fn outputs_that_collide_are_a_usage_error() {
        let folder = tempfile::tempdir().unwrap();
        let [log, model, same] = ["a.csv", "m.toml", "./m.toml"].map(|f| folder.path().join(f));
        std::fs::write(&log, "t\n").unwrap();
        for other in [&same, &log] {
            let error = check([&*log], [&*model, other]).unwrap_err();
            assert_eq!(error.exit(), Exit::Usage);
        }
        assert!(check([&*log], [&*model]).is_ok());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_and_a_folder_as_file_are_output_errors() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no").join("m.toml");
        let error = check([], [&*missing]).unwrap_err();
        assert_eq!(error.exit(), Exit::OutputFailed);
        assert!(error.to_string().contains("mkdir -p"));
        let error = check([], [folder.path()]).unwrap_err();
        assert_eq!(error.exit(), Exit::OutputFailed);
    }
}
