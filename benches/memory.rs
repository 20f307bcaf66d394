//! Peak memory and speed on a text log of 2 GB and on one of a tenth of that: the reader alone, and a
//! fit. `cargo bench --bench memory [-- GIGABYTES]`; Linux only, in the folder for temporary files.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cft_ident::log::{Block, Channel, Layout, LogSpec, Reader};

/// Rows that are written again and again, on a clock that goes on.
const PATTERN: usize = 50_000;
const JOINTS: [&str; 6] = ["1", "2", "3", "4", "5", "6"];
/// The reader alone, in a process of its own.
const READ: &str = "--read";

/// Writes a log of about so many bytes: t, positions and torques of six joints with all their digits.
fn write_log(path: &Path, bytes: u64) -> std::io::Result<u64> {
    let rows: Vec<String> = (0..PATTERN)
        .map(|k| {
            let phase = std::f64::consts::TAU * k as f64 / PATTERN as f64;
            // About one turn a second, with inertia and friction.
            let cycles = (0..6).map(|j| (50 + 7 * j) as f64);
            let q = cycles.clone().map(|n| 0.1 * (phase * n).sin());
            let tau = cycles.map(|n| {
                let speed = std::f64::consts::TAU * n * 1000.0 / PATTERN as f64;
                let (v, a) = (
                    speed * (phase * n).cos(),
                    -speed * speed * (phase * n).sin(),
                );
                9.5 * a + 20.0 * v + 20.0 * v.signum()
            });
            q.chain(tau).map(|x| format!(",{x}")).collect()
        })
        .collect();
    let mut out = BufWriter::new(File::create(path)?);
    let columns = ["q", "tau"].map(|kind| JOINTS.map(|joint| format!("{kind}{joint}")).join(","));
    writeln!(out, "t,{}", columns.join(","))?;
    let (mut written, mut row) = (0, 0);
    while written < bytes {
        let line = format!("{}{}\n", row as f64 / 1000.0, rows[row % PATTERN]);
        out.write_all(line.as_bytes())?;
        written += line.len() as u64;
        row += 1;
    }
    out.flush()?;
    Ok(row as u64)
}

/// Reads every channel of the log.
fn read(path: &Path) {
    let mut layout = Layout::joint_columns(&JOINTS);
    for (index, joint) in JOINTS.iter().enumerate() {
        layout.positions[index] = Channel::si(format!("q{joint}"), "rad");
        layout.torques[index] = Channel::si(format!("tau{joint}"), "Nm");
    }
    let mut reader = Reader::open(&LogSpec::whole(path), &layout).expect("the log opens");
    let mut block = Block::default();
    while reader.read(&mut block).expect("the log is whole") {}
}

/// Processor time of all threads of a process so far [s], of which Linux counts 100 ticks a second.
fn processor_time(process: &Child) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{}/stat", process.id())).ok()?;
    // The second field is a name in brackets; user and system time are fields 14 and 15.
    let mut fields = status.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / 100.0)
}

/// Most memory that a process held so far [kB].
fn peak(process: &Child) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.id())).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Runs a program and says how long it took and how much memory it held at most.
fn measure(name: &str, bytes: u64, rows: u64, program: &mut Command) {
    let start = Instant::now();
    let mut process = program
        .stdout(Stdio::null())
        .spawn()
        .expect("the program runs");
    let (mut most, mut busy) = (0, 0.0);
    let status = loop {
        busy = processor_time(&process).unwrap_or(busy).max(busy);
        most = most.max(peak(&process).unwrap_or(0));
        match process.try_wait().expect("it can be waited for") {
            Some(status) => break status,
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    assert!(status.success(), "{name}: {status}");
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "  {name}: at most {:.1} MB of memory, {seconds:.1} s; {busy:.2} s on processors: {:.0} MB/s, {:.2} million rows/s",
        most as f64 / 1024.0,
        bytes as f64 / 1e6 / busy,
        rows as f64 / 1e6 / busy,
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [first, path, ..] = &arguments[..]
        && first == READ
    {
        return read(Path::new(path));
    }
    let size = arguments.iter().find_map(|text| text.parse().ok());
    let gigabytes: f64 = size.unwrap_or(2.0);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("log.csv");
    for part in [0.1, 1.0] {
        let rows = write_log(&path, (part * gigabytes * 1e9) as u64).expect("the log is written");
        let bytes = path.metadata().expect("the log is there").len();
        println!("{:.2} GB, {rows} rows of 13 columns", bytes as f64 / 1e9);
        let this = std::env::current_exe().expect("the program knows its file");
        measure(
            "reader",
            bytes,
            rows,
            Command::new(this).arg(READ).arg(&path),
        );
        measure(
            "cft-ident lsq",
            bytes,
            rows,
            Command::new(env!("CARGO_BIN_EXE_cft-ident"))
                .args(["lsq", "log.csv", "-r", "configs/emps.toml"])
                .args(["-o", "model.toml", "-q"])
                .current_dir(folder.path()),
        );
    }
}
