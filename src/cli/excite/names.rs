//! Files that are written of a motion.

use std::path::{Path, PathBuf};

use super::Args;

/// Files of one motion.
pub(super) struct Names {
    pub trajectory: Option<PathBuf>,
    pub samples: Option<PathBuf>,
    pub message: Option<PathBuf>,
    pub urscript: Option<PathBuf>,
    pub plot: Option<PathBuf>,
    pub report: Option<PathBuf>,
}

impl Names {
    /// One set for each motion; several are numbered.
    pub fn of(args: &Args) -> Vec<Self> {
        (1..=args.trajectories)
            .map(|k| {
                let numbered = |path: &Option<PathBuf>| {
                    path.as_ref().map(|path| match args.trajectories {
                        1 => path.clone(),
                        _ => with_number(path, k),
                    })
                };
                Self {
                    trajectory: numbered(&args.output),
                    samples: numbered(&args.samples),
                    message: numbered(&args.trajectory_message),
                    urscript: numbered(&args.urscript),
                    plot: numbered(&args.plot),
                    report: numbered(&args.report),
                }
            })
            .collect()
    }

    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let all = [
            &self.trajectory,
            &self.samples,
            &self.message,
            &self.urscript,
            &self.plot,
            &self.report,
        ];
        all.into_iter().filter_map(|path| path.as_deref())
    }
}

/// `a/b.toml` and 2 make `a/b-2.toml`.
fn with_number(path: &Path, k: u16) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(ending) => format!("{stem}-{k}.{}", ending.to_string_lossy()),
        None => format!("{stem}-{k}"),
    };
    path.with_file_name(name)
}
