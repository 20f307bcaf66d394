//! A folder with good files, and the tool run in it within bounded memory.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Address space that a run may take [kB]: what the tool's threads and a log of some MB need, several times.
pub const MEMORY_KB: u64 = 2 << 20;

/// How a run ended.
#[derive(Debug)]
pub struct Ended {
    pub status: Option<i32>,
    pub stdout: Vec<u8>,
    pub stderr: String,
}

pub struct Bench(tempfile::TempDir);

pub const SLIDE: &str = concat!(
    include_str!("../../fixtures/robots/slide.toml"),
    "\n[limits.slide]\nposition = [-0.5, 0.5]\nspeed = 2.0\n"
);

/// What a slide of 10 kg logs in 4 s at 500 Hz: position and torque of each row.
pub fn slide_row(k: u32) -> (f64, f64, f64) {
    let t = f64::from(k) / 500.0;
    let (q, v, a) = motion(t);
    // a little noise, the same in every run
    let noise = (f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5) * 0.2;
    (t, q, 10.0 * a + 5.0 * v + 3.0 * v.signum() + 2.0 + noise)
}

fn motion(t: f64) -> (f64, f64, f64) {
    let mut sum = (0.0, 0.0, 0.0);
    for (w, size) in [(6.0, 0.1), (10.7, 0.03), (2.3, 0.05)] {
        let (s, c) = f64::sin_cos(w * t);
        sum.0 += size * s;
        sum.1 += size * w * c;
        sum.2 -= size * w * w * s;
    }
    sum
}

/// A log of the slide, its numbers changed by `edit`.
pub fn slide_log(rows: u32, edit: impl Fn(u32, &mut f64, &mut f64)) -> String {
    let mut text = "t,q_slide,tau_slide\n".to_owned();
    for k in 0..rows {
        let (t, mut q, mut tau) = slide_row(k);
        edit(k, &mut q, &mut tau);
        let _ = writeln!(text, "{t:.3},{q:.9e},{tau:.6e}");
    }
    text
}

impl Bench {
    /// A folder with `slide.toml`, `good.csv`, `other.csv` and the `model.toml` that was fitted to the first.
    pub fn new() -> Self {
        let bench = Bench(tempfile::tempdir().unwrap());
        bench.file("slide.toml", SLIDE);
        bench.file("good.csv", slide_log(2000, |_, _, _| {}));
        bench.file("other.csv", slide_log(1500, |_, _, _| {}));
        let fitted = bench.run("lsq good.csv -r slide.toml -o model.toml -q");
        assert_eq!(fitted.status, Some(0), "{}", fitted.stderr);
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn folder(&self) -> &Path {
        self.0.path()
    }

    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Runs a line whose words stand between spaces, in [`MEMORY_KB`].
    pub fn run(&self, line: &str) -> Ended {
        let words: Vec<&str> = line.split_whitespace().collect();
        self.run_words(&words)
    }

    pub fn run_words(&self, words: &[&str]) -> Ended {
        let output = Command::new("sh")
            .arg("-c")
            .arg(format!("ulimit -v {MEMORY_KB}; exec \"$0\" \"$@\""))
            .arg(env!("CARGO_BIN_EXE_cft-ident"))
            .args(words)
            .current_dir(self.folder())
            .output()
            .unwrap();
        Ended {
            status: output.status.code(),
            stdout: output.stdout,
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Names and contents; of what is large, or no regular file, the length alone.
    pub fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(self.folder()).unwrap().map(Result::unwrap);
        entries
            .map(|entry| {
                let about = fs::symlink_metadata(entry.path()).unwrap();
                let content = match about.is_file() && about.len() < 1 << 22 {
                    true => fs::read(entry.path()).unwrap(),
                    false => about.len().to_le_bytes().to_vec(),
                };
                (entry.file_name().to_string_lossy().into_owned(), content)
            })
            .collect()
    }

    /// Runs a line that must end with `status`, say every one of `words` and a way out, and leave every file
    /// as it was.
    #[track_caller]
    pub fn refuses(&self, line: &str, status: i32, words: &[&str]) {
        let before = self.files();
        let ended = self.run(line);
        let message = &ended.stderr;
        assert_eq!(ended.status, Some(status), "{line}: {message}");
        for word in words.iter().chain(&["error: ", "\nhint: "]) {
            assert!(message.contains(word), "{line}: no `{word}` in: {message}");
        }
        assert!(!message.contains("panicked"), "{line}: {message}");
        assert!(self.files() == before, "{line} changed a file");
    }
}
