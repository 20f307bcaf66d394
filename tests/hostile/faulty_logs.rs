//! Faults of a log in every container that can hold them: a fit is right, or it says what is wrong, or it is refused
//! with its cause. `benches/quality` has the long form, with more faults, commands and containers.

use std::path::Path;

use mcap::WriteOptions;
use serde_json::Value;

use crate::bench::{Bench, Ended, slide_row};
use crate::recording::{JointState, Recording};

/// A parameter is wrong where it is off by more than so many standard deviations and this share of itself.
const STDS: f64 = 5.0;
const SHARE: f64 = 0.05;
/// What the slide is made of.
const TRUTH: [(&str, f64); 4] = [
    ("inertia", 10.0),
    ("viscous", 5.0),
    ("coulomb", 3.0),
    ("offset", 2.0),
];
const SECOND: u64 = 1_000_000_000;

/// Rows of a log: time, position, torque.
type Rows = Vec<[f64; 3]>;

/// A number of a fixed series in 0..1 for each row.
fn chance(k: usize, series: u32) -> f64 {
    let mixed = (k as u32 ^ series.wrapping_mul(0x9e37_79b9)).wrapping_mul(2_654_435_761);
    f64::from((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 8) / f64::from(1 << 24)
}

/// Adds a height of either sign to a share of the numbers of one column.
fn spikes(rows: &mut Rows, column: usize, share: f64, height: f64) {
    for (k, row) in rows.iter_mut().enumerate() {
        if chance(k, 1) < share {
            row[column] += height * (0.5 + chance(k, 2)) * (chance(k, 3) - 0.5).signum();
        }
    }
}

/// A fault: its name, what it does to the rows, and words of which a message about it has one.
type Fault = (String, Box<dyn Fn(&mut Rows)>, &'static [&'static str]);

fn faults() -> Vec<Fault> {
    let mut all: Vec<Fault> = Vec::new();
    let mut add = |name: &str, edit: Box<dyn Fn(&mut Rows)>, words| {
        all.push((name.to_owned(), edit, words));
    };
    add("none", Box::new(|_| {}), &[]);
    for share in [0.001, 0.01, 0.03, 0.1, 0.4] {
        let of = |what: &str| format!("{what}, {} %", 100.0 * share);
        let torque = move |rows: &mut Rows| spikes(rows, 2, share, 300.0);
        add(&of("spikes of torque"), Box::new(torque), &["spike"]);
        let position = move |rows: &mut Rows| spikes(rows, 1, share, 0.3);
        let words = &["spike", "leaps to and fro"];
        add(&of("spikes of position"), Box::new(position), words);
        let failed = move |rows: &mut Rows| {
            let read = |k: &usize| chance(*k, 4) < share;
            let rows = rows.iter_mut().enumerate();
            rows.filter(|(k, _)| read(k))
                .for_each(|(_, row)| row[1..].fill(0.0));
        };
        let words = &["failed-read", "spike", "leaps to and fro"];
        add(&of("reads that failed"), Box::new(failed), words);
        let none = move |rows: &mut Rows| {
            let rows = rows.iter_mut().enumerate();
            rows.filter(|(k, _)| chance(*k, 5) < share)
                .for_each(|(_, row)| row[2] = f64::NAN);
        };
        let words = &["nan", "NaN", "no number", "lack a channel"];
        add(&of("torques that are no numbers"), Box::new(none), words);
    }
    for every in [1, 10] {
        let two = move |rows: &mut Rows| {
            let other = rows.iter().step_by(every);
            let other = other.map(|[t, ..]| [t + 0.7e-3, 0.15, 0.0]);
            let other: Rows = other.collect();
            rows.extend(other);
            rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
        };
        let words = &["publisher", "spike", "leaps to and fro", "turns back"];
        add(
            &format!("a second source, every {every}"),
            Box::new(two),
            words,
        );
    }
    let mut clock = |name: &str, change: fn(usize, f64) -> f64| {
        let edit = move |rows: &mut Rows| {
            let rows = rows.iter_mut().enumerate();
            rows.for_each(|(k, row)| row[0] = change(k, row[0]));
        };
        all.push((
            name.to_owned(),
            Box::new(edit),
            &["time", "clock", "gap", "Hz"],
        ));
    };
    clock("clock jumps ahead", |k, t| {
        t + if k > 900 { 100.0 } else { 0.0 }
    });
    clock("clock jumps back", |k, t| {
        t - if k > 900 { 1.0 } else { 0.0 }
    });
    clock("clock stands for a while", |k, t| {
        if (900..950).contains(&k) { 1.8 } else { t }
    });
    clock("clock stands", |_, _| 1.0);
    clock("clock runs backwards", |_, t| 4.0 - t);
    clock("clock is coarse", |_, t| (t * 100.0).floor() / 100.0);
    clock("times in milliseconds", |_, t| 1000.0 * t);
    clock("clock is set late", |k, t| {
        t + if k > 900 { 3.2e7 } else { 0.0 }
    });
    all
}

/// Times of messages: those of the rows behind a date.
fn stamp(t: f64) -> u64 {
    1_700_000_000 * SECOND + (t * 1e9).round() as u64
}

fn state(row: &[f64; 3]) -> JointState {
    JointState {
        stamp_ns: stamp(row[0]),
        names: vec!["slide".to_owned()],
        q: vec![row[1]],
        tau: vec![row[2]],
        ..JointState::default()
    }
}

fn write(path: &Path, form: &str, rows: &Rows) {
    let arrival = |k: usize| 1_700_000_000 * SECOND + 2_000_000 * k as u64;
    match form {
        "csv" => {
            let lines = rows.iter().map(|[t, q, tau]| format!("{t},{q},{tau}\n"));
            let text: String = lines.collect();
            std::fs::write(path, format!("t,q_slide,tau_slide\n{text}")).unwrap();
        }
        "db3" => {
            let base = rusqlite::Connection::open(path).unwrap();
            base.execute_batch(
                "CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT);
                 CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB);
                 INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr'); BEGIN;",
            )
            .unwrap();
            for (k, row) in rows.iter().enumerate() {
                let message = (k as i64, arrival(k) as i64, state(row).cdr());
                base.execute("INSERT INTO messages VALUES(?1, 1, ?2, ?3)", message)
                    .unwrap();
            }
            base.execute_batch("COMMIT;").unwrap();
        }
        form => {
            let mut out = Recording::create(path, WriteOptions::default());
            for (k, row) in rows.iter().enumerate() {
                if form == "cdr.mcap" {
                    out.joint_state("/joint_states", arrival(k), &state(row));
                    continue;
                }
                let at = stamp(row[0]);
                let (sec, nanosec) = (at / SECOND, at % SECOND);
                let text = format!(
                    r#"{{"header":{{"stamp":{{"sec":{sec},"nanosec":{nanosec}}}}},"name":["slide"],"position":[{}],"velocity":[],"effort":[{}]}}"#,
                    row[1], row[2]
                );
                out.json("/joint_states", arrival(k), &text);
            }
            out.finish();
        }
    }
}

/// A parameter that a fit states and that is wrong.
fn wrong(ended: &Ended) -> Option<String> {
    let document: Value = serde_json::from_slice(&ended.stdout).unwrap();
    TRUTH.iter().find_map(|(name, truth)| {
        let all = document["parameters"].as_array().unwrap();
        let found = all.iter().find(|p| p["name"] == *name)?;
        let known = found["verdict"] == "identified" && found["negligible"] == false;
        let (value, std) = (found["value"].as_f64()?, found["std"].as_f64()?);
        let off = (value - truth).abs();
        (known && off > STDS * std && off > SHARE * truth.abs())
            .then(|| format!("{name} is {value} +- {std}, truly {truth}"))
    })
}

/// What is wrong with how a fit of a faulty log ended.
fn complaint(file: &str, ended: &Ended, words: &[&str]) -> Option<String> {
    let said = &ended.stderr;
    let named = words.is_empty() || words.iter().any(|word| said.contains(word));
    match ended.status {
        _ if said.contains("panicked") => Some("a panic".to_owned()),
        Some(0) => wrong(ended).filter(|_| !named || words.is_empty()),
        // whatever the cause: noise beyond the torque
        Some(4) if said.contains("these data determine nothing") => None,
        Some(3) if !said.contains(file) => Some("the log is not named".to_owned()),
        Some(3) if !said.contains("hint: ") => Some("no way out is shown".to_owned()),
        Some(3) => (!named).then(|| "another cause is named".to_owned()),
        other => Some(format!("status {other:?}")),
    }
}

#[test]
fn a_fit_of_a_faulty_log_is_right_or_says_so_whatever_holds_the_log() {
    let bench = Bench::new();
    let robot = bench.text("slide.toml");
    bench.file(
        "mapped.toml",
        format!("{robot}\n[log]\ntorque_is = \"joint\"\n"),
    );
    let (mut cases, mut bad) = (0, Vec::new());
    for (name, edit, words) in faults() {
        let mut rows: Rows = (0..2000)
            .map(slide_row)
            .map(|(t, q, tau)| [t, q, tau])
            .collect();
        edit(&mut rows);
        for form in ["csv", "json.mcap", "cdr.mcap", "db3"] {
            let file = format!("log.{form}");
            write(&bench.path(&file), form, &rows);
            let line = format!("lsq {file} -r mapped.toml -o out.toml --json - --verbose");
            let ended = bench.run(&line);
            cases += 1;
            if let Some(complaint) = complaint(&file, &ended, words) {
                bad.push(format!("{name}, {form}: {complaint}: {}", ended.stderr));
            }
            std::fs::remove_file(bench.path(&file)).unwrap();
        }
    }
    assert!(
        bad.is_empty(),
        "{} of {cases}:\n{}",
        bad.len(),
        bad.join("\n")
    );
    assert!(cases >= 100, "{cases}");
}
