//! What the Monte Carlo studies share: seeds that are done once, logs of the simulated robot, and
//! their processing.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use cft_ident::config::Trajectory;
use cft_ident::friction::estimate::{FrictionOptions, JointEstimate, estimate};
use cft_ident::friction::inputs::FrictionInputs;
use cft_ident::friction::motions::motions;
use cft_ident::friction::prepare::{PreparedProblem, SensorModel as Read, prepare};
use cft_ident::identify::narrowed;
use cft_ident::log::Block;
use cft_ident::motion::FilterSettings as Processing;
use cft_ident::robot::Robot;
use cft_ident::simulate::reference::FourierReference;
use cft_ident::simulate::{
    Noise, Path as Motion, Reference, ReferenceFrame, Settings, SimulatedRun,
};
use rayon::prelude::*;
use serde_json::{Value, json};
use statrs::distribution::{Beta, ContinuousCDF};

pub const JOINTS: [&str; 4] = ["q1", "q2", "q4", "q5"];

/// Runs `one` for every seed that is not yet in target/NAME.jsonl, where each leaves its line as
/// soon as it is done: a stopped study goes on where it was. Arguments are SEEDS and FOLDER, which
/// comes back with all lines in the order of their seeds.
#[allow(dead_code)] // each study uses its share
pub fn study(name: &str, usual: u64, one: fn(u64) -> Value) -> (Vec<Value>, PathBuf) {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments
        .next()
        .and_then(|s| s.parse().ok())
        .unwrap_or(usual);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/results".into()));
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    let log = Path::new("target").join(format!("{name}.jsonl"));
    let mut rows = finished(&log);
    let done: Vec<u64> = rows.iter().filter_map(|r| r["seed"].as_u64()).collect();
    let file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&log)
        .expect("the log opens");
    let file = Mutex::new(file);
    let fresh: Vec<Value> = (0..seeds)
        .into_par_iter()
        .filter(|seed| !done.contains(seed))
        .map(|seed| {
            let row = one(seed);
            let mut file = file.lock().expect("no thread panics");
            writeln!(file, "{row}").expect("the log is written");
            eprintln!("seed {seed} done");
            row
        })
        .collect();
    rows.extend(fresh);
    rows.retain(|r| r["seed"].as_u64().is_some_and(|s| s < seeds));
    rows.sort_by_key(|r| r["seed"].as_u64());
    (rows, folder)
}

pub fn finished(log: &Path) -> Vec<Value> {
    let Ok(file) = File::open(log) else {
        return Vec::new();
    };
    let lines = BufReader::new(file).lines().map_while(Result::ok);
    lines
        .filter_map(|l| serde_json::from_str(&l).ok())
        .collect()
}

/// Writes FOLDER/NAME.json, from which the documents have their table, and shows it.
#[allow(dead_code)] // each study uses its share
pub fn write_summary(
    folder: &Path,
    name: &str,
    title: &str,
    command: &str,
    seeds: usize,
    rows: Vec<Value>,
) {
    let document = json!({
        "study": title,
        "command": format!("cargo run --release -p cft-ident-studies --example {command} -- {seeds}"),
        "seeds": seeds,
        "rows": rows,
    });
    let path = folder.join(format!("{name}.json"));
    std::fs::write(&path, format!("{document:#}\n")).expect("the summary is written");
    println!("{document:#}");
}

pub fn processing() -> Processing {
    Processing {
        q_cutoff_hz: Some(100.0),
        ..Processing::default()
    }
}

pub fn block(recording: &SimulatedRun<4>) -> Block {
    Block {
        t: recording.t.clone(),
        q: recording.q.concat(),
        tau: recording.torque.concat(),
        ..Block::default()
    }
}

/// A source of one block.
pub fn source(
    block: &Block,
) -> impl FnMut(&mut Block) -> Result<bool, std::convert::Infallible> + '_ {
    move |out| {
        out.t.extend_from_slice(&block.t);
        out.q.extend_from_slice(&block.q);
        out.tau.extend_from_slice(&block.tau);
        Ok(false)
    }
}

pub fn noisy(seconds: f64, seed: u64) -> Settings<4> {
    let mut settings = Settings::new(seconds);
    settings.seed = seed;
    settings.sensors.torque_noise = Noise::Relative(0.01);
    settings
}

/// A Fourier series that comes with the tool.
pub fn series(file: &str) -> FourierReference<4> {
    let Ok(Trajectory::Fourier(file)) = Trajectory::load(Path::new(file)) else {
        panic!("{file} comes with the tool");
    };
    let column = |pick: &dyn Fn(usize) -> Vec<f64>| -> Vec<[f64; 4]> {
        let columns: Vec<Vec<f64>> = (0..4).map(pick).collect();
        (0..columns[0].len())
            .map(|l| std::array::from_fn(|i| columns[i][l]))
            .collect()
    };
    let usual = FourierReference::table_3();
    FourierReference {
        offset: std::array::from_fn(|i| file.series[i].offset),
        a: column(&|i| file.series[i].a.clone()),
        b: column(&|i| file.series[i].b.clone()),
        fundamental: std::f64::consts::TAU * file.fundamental_hz,
        start: file.start_s.unwrap_or(usual.start),
        blend: file.blend_s.unwrap_or(usual.blend),
        periods: file.periods,
    }
}

/// A series in motor coordinates as a reference.
pub fn along(series: FourierReference<4>) -> Reference<4> {
    Reference {
        frame: ReferenceFrame::Motors,
        path: Motion::Fourier(series),
    }
}

/// The one-joint problem of a log and its estimate, as the tool makes it; with `smoothing` the other
/// joints' motion is smoothed as narrowly as the innovations want, which takes most of the time.
pub fn estimated(
    robot: &Robot,
    joint: usize,
    names: &[String],
    log: &Block,
    smoothing: bool,
) -> (PreparedProblem, JointEstimate) {
    let found = |settings: &Processing| {
        motions(&log.t, &log.q, &log.tau, 4, settings).expect("a whole log")
    };
    let variance = |q: &[f64]| {
        robot
            .transmission()
            .encoder_variance(joint, q)
            .unwrap_or(f64::NAN)
    };
    let sensors = Read {
        variance: &variance,
        zero_order_hold: true,
    };
    let wide = found(&processing());
    let narrower = found(&narrowed(&processing(), 1000.0));
    let prepared = prepare(robot, joint, &wide, &sensors).expect("the joint moves");
    let inputs = FrictionInputs {
        robot,
        joint,
        motions: &wide,
        narrower: &narrower,
        sensors: &sensors,
    };
    let options = FrictionOptions::default();
    let inputs = smoothing.then_some(&inputs);
    let e = estimate(JOINTS[joint], names, &prepared, inputs, &options).expect("an estimate");
    (prepared, e)
}

pub fn quantile(mut x: Vec<f64>, share: f64) -> f64 {
    x.sort_by(f64::total_cmp);
    x[((x.len() - 1) as f64 * share).round() as usize]
}

/// The 95 % interval of a share, of which so many of a total were hits (Clopper and Pearson 1934).
#[allow(dead_code)] // each study uses its share
pub fn interval(hits: usize, total: usize) -> String {
    let bound = |a: f64, b: f64, p: f64, end: f64| match Beta::new(a, b) {
        Ok(beta) => beta.inverse_cdf(p),
        Err(_) => end,
    };
    let (k, n) = (hits as f64, total as f64);
    let low = bound(k, n - k + 1.0, 0.025, 0.0);
    let high = bound(k + 1.0, n - k, 0.975, 1.0);
    format!("{:.1} % to {:.1} %", 100.0 * low, 100.0 * high)
}

pub fn percent(x: f64) -> String {
    format!("{:.3} %", 100.0 * x)
}
