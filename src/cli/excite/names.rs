//! Files that are written of a motion.

use std::path::{Path, PathBuf};

use super::Args;

/// Files that the design is written to.
pub(super) struct OutputNames {
    pub trajectory: Option<PathBuf>,
    pub samples: Option<PathBuf>,
    pub urscript: Option<PathBuf>,
    pub plot: Option<PathBuf>,
    pub report: Option<PathBuf>,
}

impl OutputNames {
    /// One set for each motion; several are numbered.
    pub fn of(args: &Args) -> Vec<Self> {
        let numbered = |path: &Option<PathBuf>, k: u16| match args.trajectories {
            1 => path.clone(),
            _ => path.as_ref().map(|path| with_number(path, k)),
        };
        let names = |k: u16| Self {
            trajectory: numbered(&args.output, k),
            samples: numbered(&args.samples, k),
            urscript: numbered(&args.urscript, k),
            plot: numbered(&args.plot, k),
            report: numbered(&args.report, k),
        };
        (1..=args.trajectories).map(names).collect()
    }

    /// The trajectory as it is reported.
    pub fn shown(&self) -> String {
        let path = self.trajectory.as_deref().unwrap_or(Path::new(""));
        path.display().to_string()
    }

    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let all = [
            &self.trajectory,
            &self.samples,
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
