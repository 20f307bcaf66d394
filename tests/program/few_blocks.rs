//! An effect that acts in one short passage of a log.

use std::fmt::Write;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

const ROBOT: &str = r#"
[robot]
model = "single-joint"
joint = "q1"
kind = "revolute"

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true

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

/// 20 s at 200 Hz of an inertia with viscous, Coulomb and Stribeck friction, 66 times slower in these spans of time.
fn log(seed: u64, waves: Waves, slow: &[[f64; 2]], stribeck: f64) -> String {
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
        let near_rest = stribeck * v.signum() * (-(v / 0.08).powi(2)).exp();
        let torque = 0.03 * a + 0.25 * v + 0.5 * v.signum() + near_rest + noise();
        writeln!(text, "{t:.3},{q:.6},{torque:.6}").unwrap();
        s += 0.5 * dt * (ds + rate_of_phase(t + dt));
    }
    text
}

fn run(folder: &Path, line: &str) -> Value {
    let output = assert_cmd::Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(line.split_whitespace())
        .args(["--json", "-"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{line}: {said}"))
}

/// What `diagnose` writes of such a log, and the error on another motion before and after.
fn diagnosed(seed: u64, stribeck: f64) -> (Vec<Value>, [f64; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("robot.toml", ROBOT);
    write("fitted.csv", &log(seed, FAST, &[[8.0, 9.0]], stribeck));
    let slow = [[4.0, 5.0], [14.0, 15.0]];
    write("unseen.csv", &log(seed + 50, OTHER, &slow, stribeck));
    run(folder.path(), "lsq fitted.csv -r robot.toml -o before.toml");
    let found = run(
        folder.path(),
        "diagnose fitted.csv -m before.toml -o after.toml",
    );
    let steps = found["steps"].as_array().unwrap().iter();
    let written = steps.filter(|step| step["written"] == true).cloned();
    let error = |model: &str| {
        let document = run(folder.path(), &format!("validate unseen.csv -m {model}"));
        document["joints"][0]["relative_error_moving"]
            .as_f64()
            .unwrap()
    };
    (written.collect(), ["before.toml", "after.toml"].map(error))
}

#[test]
fn a_fall_of_friction_that_one_slow_second_shows_is_named_and_lowers_the_error_of_another_motion() {
    for seed in 0..3 {
        let (written, [before, after]) = diagnosed(seed, 0.35);
        let names: Vec<&Value> = written.iter().map(|step| &step["effect"]).collect();
        assert_eq!(names, ["stribeck"], "{seed}");
        let c = written[0]["parameters"]["c"]["value"].as_f64().unwrap();
        assert!((c - 0.35).abs() < 0.04, "{seed}: {c}");
        assert!(
            before > 0.03 && after < 0.75 * before,
            "{seed}: {before} {after}"
        );
    }
}

#[test]
fn a_slow_second_without_one_names_nothing() {
    for seed in 0..3 {
        let (written, [before, after]) = diagnosed(seed, 0.0);
        assert!(written.is_empty(), "{seed}: {written:?}");
        assert!((after - before).abs() < 1e-9);
    }
}
