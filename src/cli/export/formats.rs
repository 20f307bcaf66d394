//! Formats of simulators that are asked for.

use std::path::{Path, PathBuf};

use super::Args;
use cft_ident_export::export::arm::{Arm, FormatSupport};

/// A format of a simulator that is asked for.
pub(super) struct Format<'a> {
    pub path: &'a Path,
    pub what: &'static str,
    /// The list beside it.
    pub side: PathBuf,
    pub says: FormatSupport,
    pub text: FormatWriter,
}

/// The text of a format, of an arm and the lines at its head.
pub(super) type FormatWriter = fn(&Arm, &[String]) -> String;

pub(super) fn formats(args: &Args) -> Vec<Format<'_>> {
    use cft_ident_export::export::{mjcf, sdf, usd};
    let all: [(&Option<PathBuf>, &'static str, FormatSupport, FormatWriter); 3] = [
        (&args.mjcf, "MJCF", mjcf::SAYS, mjcf::mjcf),
        (&args.sdf, "SDF", sdf::SAYS, sdf::sdf),
        (&args.usd, "USD", usd::SAYS, usd::usd),
    ];
    let asked = all.into_iter().filter_map(|(path, what, says, text)| {
        let path = path.as_deref()?;
        let mut side = path.as_os_str().to_owned();
        side.push(".left-out.toml");
        Some(Format {
            path,
            what,
            side: side.into(),
            says,
            text,
        })
    });
    asked.collect()
}
