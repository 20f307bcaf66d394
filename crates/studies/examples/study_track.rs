//! A fleet over its logs: false alarms, and how soon changes are found.
//!
//! `cargo run --release -p cft-ident-studies --example study_track -- [ROBOTS] [FOLDER]` writes one line per robot to
//! target/study_track.jsonl as it goes and, at the end, FOLDER/study_track.json, from which
//! docs/results/studies.md has its table and its figure. Of every ten robots one changes: the friction of one joint, or its
//! Coulomb friction alone, grows by 10 to 50 % from one log to the next or log by log. Estimates of 54 parameters are
//! drawn with their covariance, for 50 logs a robot; temperature scales the friction of all joints, and one log in ten
//! carries a payload. Each robot is followed as its logs come in, and an alarm counts when it is first told. One part of
//! each robot is simulated the whole way (motion, noise, `reduce`), to show that estimates scatter by their covariance.
//! Limits were set on robots of the seeds 5000 to 5199 and 6000 to 6099.

#[allow(dead_code)] // it uses its share
#[path = "study/mod.rs"]
mod study;

use std::ops::Range;

use cft_ident::config::RobotFile;
use cft_ident::identify::{Control, Dataset, Log, LsqSettings, RobotSetup, lsq, reduce};
use cft_ident::track::{LogEstimate, follow_together};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use study::{percent, quantile, study, write_summary};

/// Joints, and parameters of the links.
const JOINTS: usize = 6;
const LINKS: usize = 36;
const PARAMETERS: usize = LINKS + 3 * JOINTS;
const LOGS: usize = 50;
/// Probability of an alarm over all parameters of a robot, as `cft-ident track` has it.
const ALARMS: f64 = 0.0002;
/// Least number of logs at which one looks.
const FIRST: usize = 8;
/// Changes of one robot in ten, as parts of the friction.
const SIZES: [f64; 4] = [0.1, 0.2, 0.3, 0.5];
/// A change is to be found within so many logs.
const SOON: usize = 10;
/// Logs since a change over which curves go.
const CURVE: usize = 20;
/// What grows, and whether viscous friction does with the Coulomb friction.
const WHAT: [(&str, bool); 2] = [("friction", true), ("Coulomb friction alone", false)];
/// Correlation of the errors of viscous and Coulomb friction of a joint in one log, as a fit knows it.
const CORRELATION: [f64; 4] = [1.0, 0.36, 0.36, 1.0];

fn main() {
    let (rows, folder) = study("study_track", 200, robot);
    let robots = rows.len();
    let steady: Vec<&Value> = rows.iter().filter(|r| r["changed"].is_null()).collect();
    let alarms = steady.iter().filter(|r| r["alarms"].as_u64() > Some(0));
    let mut summary = vec![json!({
        "case": "no change",
        "robots": steady.len(),
        "with an alarm over 50 logs": alarms.count(),
        "found within 5 logs": "-",
        "found within 10 logs": "-",
        "found within 20 logs": "-",
        "median delay [logs]": "-",
        "size found": "-",
    })];
    let mut curves = Vec::new();
    let kinds = WHAT
        .iter()
        .flat_map(|(what, _)| [("step", what), ("ramp", what)]);
    for (kind, what) in kinds {
        for size in SIZES {
            let of = |r: &&Value| {
                r["kind"] == kind && r["what"] == **what && r["size"].as_f64() == Some(size)
            };
            let changed: Vec<&Value> = rows
                .iter()
                .filter_map(|r| r["changed"].as_array())
                .flatten()
                .filter(of)
                .collect();
            let delays: Vec<f64> = changed.iter().filter_map(|r| r["delay"].as_f64()).collect();
            let within = |logs: f64| {
                let found = delays.iter().filter(|d| **d <= logs).count();
                format!("{found} of {}", changed.len())
            };
            let sizes: Vec<f64> = changed.iter().filter_map(|r| r["found"].as_f64()).collect();
            summary.push(json!({
                "case": format!("{kind} of {:.0} %, {what}", 100.0 * size),
                "robots": changed.len(),
                "with an alarm over 50 logs": delays.len(),
                "found within 5 logs": within(5.0),
                "found within 10 logs": within(SOON as f64),
                "found within 20 logs": within(20.0),
                "median delay [logs]": match delays.is_empty() {
                    true => "-".to_owned(),
                    false => format!("{}", quantile(delays.clone(), 0.5)),
                },
                "size found": match sizes.is_empty() {
                    true => "-".to_owned(),
                    false => percent(quantile(sizes, 0.5)),
                },
            }));
            let share = |logs: usize| {
                let found = delays.iter().filter(|d| **d <= logs as f64).count();
                found as f64 / changed.len().max(1) as f64
            };
            curves.push(json!({
                "panel": format!("{kind}, {what}"),
                "line": format!("{:.0} %", 100.0 * size),
                "found": (0..=CURVE).map(share).collect::<Vec<f64>>(),
            }));
        }
    }
    let off: Vec<f64> = (rows.iter().filter_map(|r| r["off"].as_array()).flatten())
        .filter_map(Value::as_f64)
        .collect();
    let inside = off.iter().filter(|z| z.abs() < 1.96).count();
    summary.push(json!({
        "case": format!("{} parts the whole way: {} of {} parameters within 1.96 deviations", rows.len(), inside, off.len()),
        "robots": "-",
        "with an alarm over 50 logs": "-",
        "found within 5 logs": "-",
        "found within 10 logs": "-",
        "found within 20 logs": "-",
        "median delay [logs]": "-",
        "size found": "-",
    }));
    write_summary(
        &folder,
        "study_track",
        "robots followed over 50 logs each",
        "study_track",
        robots,
        summary,
    );
    // the curves stand beside the rows of the table
    let path = folder.join("study_track.json");
    let text = std::fs::read_to_string(&path).expect("the summary is there");
    let mut summary: Value = serde_json::from_str(&text).expect("the summary is JSON");
    summary["curves"] = json!(curves);
    std::fs::write(&path, format!("{summary:#}\n")).expect("the summary is written");
}

/// Normal numbers.
fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0
}

/// Estimates of all parameters over all logs, `[parameter][log]`, with the Coulomb friction of joint `joint` changed by
/// `change`, and its viscous friction with it where `both` do.
fn simulated(
    seed: u64,
    (joint, both): (usize, bool),
    change: &dyn Fn(usize) -> f64,
) -> Vec<Vec<LogEstimate>> {
    let mut draw = chance(seed);
    // relative deviation of each parameter in one log, and what the robot's own are
    let friction = |p: usize| p >= LINKS && (p - LINKS) % 3 < 2;
    let relative: Vec<f64> = (0..PARAMETERS)
        .map(|p| match friction(p) {
            true => 0.03 * (0.3 * draw()).exp(),
            false => 0.06 * (0.5 * draw()).exp(),
        })
        .collect();
    let truth: Vec<f64> = (0..PARAMETERS)
        .map(|_| 5.0 * (0.5 * draw()).exp())
        .collect();
    let mut warm = 0.0;
    let mut out: Vec<Vec<_>> = (0..PARAMETERS).map(|_| Vec::with_capacity(LOGS)).collect();
    for log in 0..LOGS {
        // the temperature of a day is partly that of the day before; a degree is 1 %
        warm = 0.7 * warm + 0.7 * draw();
        let loaded = draw() > 1.28;
        // errors of the parameters of one joint are correlated
        let common: Vec<f64> = (0..JOINTS + 1).map(|_| draw()).collect();
        for p in 0..PARAMETERS {
            let of_joint = match p < LINKS {
                true => JOINTS,
                false => (p - LINKS) / 3,
            };
            let changes = p >= LINKS
                && match (p - LINKS) % 3 {
                    0 => both,
                    1 => true,
                    _ => false,
                };
            let mut value = truth[p];
            if friction(p) {
                value *= 1.0 - 0.01 * warm;
            }
            if changes && of_joint == joint {
                value *= 1.0 + change(log);
            }
            if loaded && (LINKS - 4..LINKS).contains(&p) {
                value += 0.8 * truth[p];
            }
            let std = relative[p] * truth[p];
            let error = 0.6 * common[of_joint] + 0.8 * draw();
            out[p].push(LogEstimate {
                time: 86_400.0 * log as f64,
                value: value + std * error,
                variance: std * std,
            });
        }
    }
    out
}

/// Viscous and Coulomb friction of a joint.
fn friction_of(joint: usize) -> Range<usize> {
    LINKS + 3 * joint..LINKS + 3 * joint + 2
}

/// Parameters that are followed together, as `cft-ident track` does.
fn groups() -> Vec<Range<usize>> {
    let offset = |joint: usize| friction_of(joint).end..friction_of(joint).end + 1;
    let links = (0..LINKS).map(|p| p..p + 1);
    let joints = (0..JOINTS).flat_map(|joint| [friction_of(joint), offset(joint)]);
    links.chain(joints).collect()
}

/// The last change that is told in a group once the first `logs` logs are there, as the relative size of the largest.
fn expected_change(
    estimates: &[Vec<LogEstimate>],
    group: &Range<usize>,
    logs: usize,
) -> Option<f64> {
    let level = ALARMS / groups().len() as f64;
    let own = estimates[group.clone()].iter();
    let own: Vec<&[LogEstimate]> = own.map(|all| &all[..logs]).collect();
    let correlation = (own.len() == 2).then_some(&CORRELATION[..]);
    let courses = follow_together(&own, correlation, level);
    let sizes = courses.iter().filter_map(|course| {
        let change = course.changes.last()?;
        Some(change.size / course.values[change.at.saturating_sub(1)])
    });
    sizes.max_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// One robot: most do not change; of every ten the last does, in all sizes and kinds one after the other.
fn robot(seed: u64) -> Value {
    let off = whole_way(seed);
    if seed % 10 != 9 {
        let estimates = simulated(seed, (0, false), &|_| 0.0);
        let groups = groups();
        let any = |logs: &usize| {
            groups
                .iter()
                .any(|g| expected_change(&estimates, g, *logs).is_some())
        };
        let alarms = (FIRST..=LOGS).find(any);
        return json!({ "seed": seed, "alarms": u64::from(alarms.is_some()), "off": off });
    }
    let mut changed = Vec::new();
    let kinds = WHAT
        .iter()
        .flat_map(|what| [("step", what), ("ramp", what)]);
    for (kind, (what, both)) in kinds {
        for size in SIZES {
            let from = 15 + (7 * seed / 10 % 20) as usize;
            let joint = (seed / 10) as usize % JOINTS;
            let change = |log: usize| match kind {
                _ if log < from => 0.0,
                "step" => size,
                // in ten logs, and from there on
                _ => size * ((log - from + 1) as f64 / 10.0).min(1.0),
            };
            let estimates = simulated(seed, (joint, *both), &change);
            let mut row = json!({ "kind": kind, "what": what, "size": size });
            for logs in from + 1..=LOGS {
                if let Some(relative) = expected_change(&estimates, &friction_of(joint), logs) {
                    row["delay"] = json!(logs - from);
                    row["found"] = json!(relative);
                    break;
                }
            }
            changed.push(row);
        }
    }
    json!({ "seed": seed, "size": "all", "changed": changed, "off": off })
}

/// Errors over deviations of the parameters of a slide in one part that is simulated the whole way.
fn whole_way(seed: u64) -> Vec<f64> {
    let text = r#"
        robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
        friction = { law = "viscous-coulomb", fitted_with_inertias = true, offset = true }
        filter = { cutoff_hz = 20.0, position_cutoff_hz = 80.0 }
    "#;
    let file = RobotFile::parse("slide.toml", text).expect("a robot file");
    let machine = RobotSetup::new("slide.toml", file);
    let truth = [12.0, 30.0, 8.0, 4.0];
    let mut noise = chance(seed + 1_000_000);
    let waves = [(0.11, 1.9), (0.05, 4.7), (0.02, 9.1)];
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    let (mut error, phase) = (0.0, seed as f64);
    for k in 0..6000 {
        let now = 0.005 * f64::from(k);
        let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
        let v = sum(&|a, w| a * w * (w * now + phase).cos());
        let a = sum(&|a, w| -a * w * w * (w * now + phase).sin());
        // correlated over a tenth of a second
        error = 0.95 * error + 0.3 * noise();
        t.push(now);
        q.push(sum(&|a, w| a * (w * now + phase).sin()));
        tau.push(truth[0] * a + truth[1] * v + truth[2] * v.signum() + truth[3] + error);
    }
    let control = Control::default();
    let log = Log::of_rows("part", &t, &q, &tau).expect("a log");
    let part = reduce(
        &Dataset::read(&machine, &[log], &Control::default()).expect("logs that can be read"),
        None,
        &control,
    )
    .expect("a part")
    .as_logs();
    let found = lsq(
        &Dataset::read(&machine, &part, &Control::default()).expect("logs that can be read"),
        &LsqSettings::default(),
        &control,
    )
    .expect("a fit");
    let pairs = truth.iter().enumerate();
    pairs
        .map(|(i, truth)| (found.fit.theta[i] - truth) / found.fit.covariance[(i, i)].sqrt())
        .collect()
}
