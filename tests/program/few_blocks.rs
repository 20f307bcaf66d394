//! What acts in a short passage of a log, from a time on, or over less than a wave of the travel.

use std::fmt::Write;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::log_folder::run_line;

const ROBOT: &str = r#"
[robot]
model = "single-joint"
joint = "q1"
kind = "revolute"

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[filter]
cutoff_hz = 20

[log]
torque_is = "joint"
time = "time"
[log.joint.q1]
position = "position"
torque = "torque"
"#;

/// Amplitudes \[rad\] and rates \[rad/s\] of a motion.
type Waves = [(f64, f64); 2];
/// Whose reversals pass within a sample.
const FAST: Waves = [(0.3, 11.1), (0.06, 23.3)];
const OTHER: Waves = [(0.8, 2.7), (0.3, 8.1)];

/// A torque by time, position and speed.
type Added<'a> = &'a dyn Fn(f64, f64, f64) -> f64;

/// A fall of friction near rest.
fn stribeck(c: f64) -> impl Fn(f64, f64, f64) -> f64 {
    move |_, _, v| c * v.signum() * (-(v / 0.08).powi(2)).exp()
}

/// 20 s at 200 Hz of an inertia with viscous and Coulomb friction, 66 times slower in these spans of time.
fn log(seed: u64, waves: Waves, slow: &[[f64; 2]], added: Added) -> String {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || 0.02 * ((0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0);
    let rate_of_phase = |t: f64| {
        let begun = |at: f64| 1.0 / (1.0 + ((at - t) / 0.05).exp());
        let slowed = slow.iter().map(|[from, to]| begun(*from) - begun(*to));
        1.0 - 0.985 * slowed.sum::<f64>()
    };
    let (mut text, mut s, dt) = ("time,position,torque\n".to_owned(), 0.0, 0.005);
    for k in 0..4000 {
        let t = dt * f64::from(k);
        let ds = rate_of_phase(t);
        let dds = (rate_of_phase(t + 1e-4) - rate_of_phase(t - 1e-4)) / 2e-4;
        let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
        let q = sum(&|a, w| a * (w * s).sin());
        let dq = sum(&|a, w| a * w * (w * s).cos());
        let ddq = sum(&|a, w| -a * w * w * (w * s).sin());
        let (v, a) = (dq * ds, ddq * ds * ds + dq * dds);
        let torque = 0.03 * a + 0.25 * v + 0.5 * v.signum() + added(t, q, v) + noise();
        writeln!(text, "{t:.3},{q:.6},{torque:.6}").unwrap();
        s += 0.5 * dt * (ds + rate_of_phase(t + dt));
    }
    text
}

fn document_of(folder: &Path, line: &str) -> Value {
    let (_, document, said) = run_line(folder, line);
    assert!(document.is_object(), "{line}: {said}");
    document
}

/// What `diagnose` says of a log, what of it is written, and the error on another motion before and after.
struct Tried {
    document: Value,
    written: Vec<Value>,
    errors: [f64; 2],
}

impl Tried {
    fn names(&self) -> Vec<&str> {
        let names = self.written.iter().map(|step| step["effect"].as_str());
        names.map(Option::unwrap).collect()
    }

    fn number(&self, key: &str) -> f64 {
        let number = &self.written[0]["parameters"][key]["value"];
        number.as_f64().unwrap()
    }
}

/// Fitted to a log and diagnosed by it, with another one unseen.
fn diagnosed(fitted: &str, unseen: &str) -> Tried {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("robot.toml", ROBOT);
    write("fitted.csv", fitted);
    write("unseen.csv", unseen);
    document_of(folder.path(), "lsq fitted.csv -r robot.toml -o before.toml");
    let document = document_of(
        folder.path(),
        "diagnose fitted.csv -m before.toml -o after.toml",
    );
    let steps = document["steps"].as_array().unwrap().iter();
    let written = steps.filter(|step| step["written"] == true).cloned();
    let written = written.collect();
    let error = |model: &str| {
        let document = document_of(folder.path(), &format!("validate unseen.csv -m {model}"));
        document["joints"][0]["relative_error_moving"]
            .as_f64()
            .unwrap()
    };
    Tried {
        errors: ["before.toml", "after.toml"].map(error),
        written,
        document,
    }
}

/// A log with one slow second, and another motion with two.
fn with_a_slow_second(seed: u64, added: Added) -> Tried {
    let slow = [[4.0, 5.0], [14.0, 15.0]];
    let unseen = log(seed + 50, OTHER, &slow, added);
    diagnosed(&log(seed, FAST, &[[8.0, 9.0]], added), &unseen)
}

#[test]
fn a_fall_of_friction_that_one_slow_second_shows_is_named_and_lowers_the_error_of_another_motion() {
    for seed in 0..3 {
        let tried = with_a_slow_second(seed, &stribeck(0.35));
        assert_eq!(tried.names(), ["stribeck"], "{seed}");
        let c = tried.number("c");
        assert!((c - 0.35).abs() < 0.04, "{seed}: {c}");
        let [before, after] = tried.errors;
        assert!(
            before > 0.03 && after < 0.75 * before,
            "{seed}: {before} {after}"
        );
    }
}

#[test]
fn a_slow_second_without_one_names_nothing() {
    for seed in 0..3 {
        let tried = with_a_slow_second(seed, &stribeck(0.0));
        assert_eq!(tried.names(), [""; 0], "{seed}");
        assert!((tried.errors[1] - tried.errors[0]).abs() < 1e-9);
    }
}

#[test]
fn a_step_of_the_zero_of_a_channel_is_no_drift_and_is_told_with_its_time_and_size() {
    for seed in 0..3 {
        let step = |t: f64, _, _| if t < 11.3 { 0.0 } else { 0.15 };
        let fitted = log(seed, OTHER, &[], &step);
        let tried = diagnosed(&fitted, &log(seed + 50, OTHER, &[], &stribeck(0.0)));
        assert_eq!(tried.names(), [""; 0], "{seed}");
        let changes = tried.document["changes"].as_array().unwrap();
        assert_eq!((changes.len(), &changes[0]["of"]), (1, &"offset".into()));
        let number = |key: &str| changes[0][key].as_f64().unwrap();
        assert!((number("by") - 0.15).abs() < 0.01, "{changes:?}");
        // by blocks, of which there are 24
        assert!((number("at_s") - 11.3).abs() < 0.9, "{changes:?}");
    }
}

#[test]
fn a_drift_is_no_step() {
    let tried = diagnosed(
        &log(1, OTHER, &[], &|t, _, _| 0.01 * t),
        &log(51, OTHER, &[], &stribeck(0.0)),
    );
    assert_eq!(tried.names(), ["drift"]);
    assert!((tried.number("c") - 0.01).abs() < 1e-3);
    assert_eq!(tried.document["changes"].as_array().unwrap().len(), 0);
}

#[test]
fn friction_that_goes_by_less_than_a_wave_and_a_half_of_the_travel_is_named() {
    // of the waves the travel of 1.56 rad covers 1.4
    let waving = |_, q: f64, v: f64| 0.15 * v.signum() * (5.65 * q + 0.4).sin();
    let motion = |seed| log(seed, OTHER, &[], &waving);
    let tried = diagnosed(&motion(2), &motion(52));
    // the first stands at the least order that the travel tells, and a second may take what that leaves
    let names = tried.names();
    assert!(
        !names.is_empty() && names.iter().all(|name| *name == "position-friction"),
        "{names:?}"
    );
    let [before, after] = tried.errors;
    assert!(before > 0.02 && after < 0.75 * before, "{before} {after}");
}
