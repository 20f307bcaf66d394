//! Ctrl-C half-way, at the boundary of the process: status 130, a word to the person, no half file.
#![cfg(unix)]

use std::fs;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SLIDE: &str = include_str!("../../fixtures/robots/slide.toml");

/// A log of `rows` milliseconds.
fn write_log(path: &Path, rows: u32) {
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    writeln!(file, "t,q_slide,tau_slide").unwrap();
    for k in 0..rows {
        let t = f64::from(k) / 1000.0;
        let (q, v) = (0.1 * (6.0 * t).sin(), 0.6 * (6.0 * t).cos());
        let tau = -360.0 * q + 5.0 * v + 3.0 * v.signum();
        writeln!(file, "{t:.3},{q:.6},{tau:.4}").unwrap();
    }
    file.flush().unwrap();
}

fn tool(folder: &Path, line: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// The file that is being written under another name, once something stands in it.
fn half_file(folder: &Path) -> Option<PathBuf> {
    let mut entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries.find(|path| {
        path.to_string_lossy().ends_with(".part")
            && fs::metadata(path).is_ok_and(|about| about.len() > 0)
    })
}

/// Waits until `ready`, sends the signal, and expects the end within seconds.
#[track_caller]
fn interrupt(mut run: Child, signal: &str, ready: impl Fn() -> bool) {
    let begun = Instant::now();
    while !ready() {
        assert!(run.try_wait().unwrap().is_none(), "ended before the signal");
        assert!(begun.elapsed() < Duration::from_secs(60), "never got going");
        std::thread::sleep(Duration::from_millis(2));
    }
    let kill = format!("kill -{signal} {}", run.id());
    assert!(
        Command::new("sh")
            .args(["-c", &kill])
            .status()
            .unwrap()
            .success()
    );
    let asked = Instant::now();
    let mut message = String::new();
    run.stderr
        .take()
        .unwrap()
        .read_to_string(&mut message)
        .unwrap();
    let status = run.wait().unwrap();
    assert_eq!(status.code(), Some(130), "{message}");
    assert!(
        asked.elapsed() < Duration::from_secs(10),
        "{:?}",
        asked.elapsed()
    );
    assert!(message.contains("stopping"), "{message}");
}

#[test]
fn a_run_that_reads_a_long_log_ends_at_once_and_leaves_no_half_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("slide.toml"), SLIDE).unwrap();
    write_log(&path.join("short.csv"), 2000);
    write_log(&path.join("long.csv"), 1_500_000);
    let fitted = tool(path, "lsq short.csv -r slide.toml -o model.toml").wait();
    assert!(fitted.unwrap().success());
    fs::write(path.join("residual.csv"), "old").unwrap();
    let before = names(path);

    for signal in ["INT", "TERM"] {
        let line = "validate long.csv -m model.toml -o residual.csv --json out.json";
        interrupt(tool(path, line), signal, || half_file(path).is_some());
        assert_eq!(names(path), before);
        assert_eq!(
            fs::read_to_string(path.join("residual.csv")).unwrap(),
            "old"
        );
    }
}

#[test]
fn a_run_that_computes_for_long_ends_within_seconds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // the simulator has nothing to write until it is done
    let run = tool(
        path,
        "simulate -r configs/cft.toml --seconds 4000 -o out.csv",
    );
    let begun = Instant::now();
    interrupt(run, "INT", || begun.elapsed() > Duration::from_millis(700));
    assert!(names(path).is_empty());
}

#[test]
fn a_design_that_is_interrupted_leaves_the_best_motion_so_far() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let run = tool(path, "excite --harmonics 32 -o best.toml --json out.json");
    // a first best is there within a second or two, all of them within half a minute
    let begun = Instant::now();
    interrupt(run, "INT", || begun.elapsed() > Duration::from_secs(5));
    assert_eq!(names(path), ["best.toml"]);
    let check = tool(path, "excite --check best.toml").wait();
    assert!(check.unwrap().success());
}
