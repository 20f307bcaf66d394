//! `--open`: the report that was written, shown in a browser.

use std::path::Path;
use std::process::{Command, Stdio};

use super::CliError;

/// Opens a page with the program that $BROWSER names, else with the system's own; does not wait for it.
pub(super) fn open(page: &Path) -> Result<(), CliError> {
    let mut command = match std::env::var_os("BROWSER").filter(|name| !name.is_empty()) {
        Some(name) => Command::new(name),
        None if cfg!(target_os = "macos") => Command::new("open"),
        None if cfg!(target_os = "windows") => Command::new("explorer"),
        None => Command::new("xdg-open"),
    };
    command.arg(page).stdin(Stdio::null());
    let begun = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    begun.map(drop).map_err(|error| {
        let page = page.display();
        CliError::output(format!("cannot open {page} in a browser: {error}"))
            .hint("open it by hand, or name a browser in the environment variable BROWSER")
    })
}
