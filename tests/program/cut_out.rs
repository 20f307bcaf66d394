//! What the first look at a log marks as bad is left out of every fit, and nothing is differentiated
//! across it: the results are those of the good rows, with a warning that says what and how much.

use std::fmt::Write;
use std::fs;

use assert_cmd::Command;
use serde_json::Value;

const SLIDE: &str = include_str!("../../fixtures/robots/slide.toml");

/// Inertia, viscous and Coulomb friction, offset of the slide.
const TRUTH: [f64; 4] = [10.0, 5.0, 3.0, 0.7];
/// Rows a second.
const RATE: f64 = 1000.0;

/// Time, position, torque of a slide, row by row.
fn rows() -> Vec<[f64; 3]> {
    let [m, fv, fc, offset] = TRUTH;
    let row = |k: u32| {
        let t = f64::from(k) / RATE;
        let wave = |w: f64| [(w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin()];
        let (slow, fast) = (wave(2.0), wave(7.3));
        let [q, v, a] = [0, 1, 2].map(|i| 0.2 * slow[i] + 0.05 * fast[i]);
        // the last digits of a sensor
        let grain = |x: f64, step: f64| (x / step).round() * step;
        let tau = m * a + fv * v + fc * v.signum() + offset;
        let noise = 0.02 * ((f64::from(k) * 12.9898).sin() * 43758.5453).fract();
        [t, grain(q, 1e-7), tau + noise]
    };
    (0..10_000).map(row).collect()
}

struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(tempfile::tempdir().unwrap());
        bench.file("slide.toml", SLIDE);
        bench
    }

    fn file(&self, name: &str, text: &str) {
        fs::write(self.0.path().join(name), text).unwrap();
    }

    fn log(&self, name: &str, rows: &[[f64; 3]]) {
        let mut text = "t,q_slide,tau_slide\n".to_owned();
        for [t, q, tau] in rows {
            writeln!(text, "{t:?},{q:?},{tau:?}").unwrap();
        }
        self.file(name, &text);
    }

    fn tool(&self, line: &str) -> Command {
        let mut command = Command::cargo_bin("cft-ident").unwrap();
        command.current_dir(self.0.path());
        command.args(line.split_whitespace());
        command
    }

    fn json(&self, line: &str) -> Value {
        let run = self.tool(&format!("{line} --json -")).assert().code(0);
        serde_json::from_slice(&run.get_output().stdout).unwrap()
    }
}

fn warnings(document: &Value) -> String {
    let all = document["warnings"].as_array().unwrap();
    let lines: Vec<&str> = all.iter().map(|w| w.as_str().unwrap()).collect();
    lines.join("\n")
}

fn estimates(document: &Value) -> Vec<f64> {
    let all = document["parameters"].as_array().unwrap();
    all.iter().map(|p| p["value"].as_f64().unwrap()).collect()
}

/// Alterations that spoil a fit, each with the kind of fault and the channel.
type Alteration = (&'static str, &'static str, fn(&mut Vec<[f64; 3]>));

const ALTERED: [Alteration; 6] = [
    ("stuck-channel", "q_slide", |rows| {
        let held = rows[4200][1];
        rows[4200..4500].iter_mut().for_each(|row| row[1] = held);
    }),
    ("stuck-channel", "tau_slide", |rows| {
        let held = rows[5200][2];
        rows[5200..5600].iter_mut().for_each(|row| row[2] = held);
    }),
    ("spike", "q_slide", |rows| {
        for k in [2000, 6001, 8500] {
            rows[k][1] += 0.02;
        }
    }),
    ("spike", "tau_slide", |rows| {
        for k in [2500, 4700, 8200] {
            rows[k][2] += 2000.0;
        }
    }),
    ("saturation", "tau_slide", |rows| {
        for row in rows {
            row[2] = row[2].clamp(-24.0, 24.0);
        }
    }),
    ("clipping", "q_slide", |rows| {
        for row in rows {
            row[1] = row[1].min(0.2);
        }
    }),
];

#[test]
fn a_fit_leaves_out_what_is_bad_and_says_so() {
    let bench = Bench::new();
    bench.log("good.csv", &rows());
    let good = bench.json("lsq good.csv -r slide.toml -o good.toml");
    assert_eq!(warnings(&good).matches("left out").count(), 0);
    let off = |found: &[f64]| {
        let parts = found.iter().zip(TRUTH);
        parts
            .map(|(x, truth)| (x / truth - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let clean = off(&estimates(&good));
    assert!(clean < 5e-3, "{clean}");
    for (kind, channel, alter) in ALTERED {
        let mut rows = rows();
        alter(&mut rows);
        bench.log("bad.csv", &rows);
        let found = bench.json("lsq bad.csv -r slide.toml -o bad.toml");
        let said = warnings(&found);
        assert!(
            said.contains(&format!("bad.csv: {kind} of `{channel}`")) && said.contains("in all"),
            "{kind} {channel}: {said}"
        );
        let error = off(&estimates(&found));
        assert!(
            error < 1.5e-2,
            "{kind} of {channel}: {error}, clean {clean}"
        );
        let unseen = bench.json("validate bad.csv -m good.toml -o residual.csv");
        let error = unseen["joints"][0]["relative_error_raw"].as_f64().unwrap();
        assert!(error < 5e-3, "{kind} of {channel}: {error}");
        assert!(warnings(&unseen).contains(kind));
        let residual = fs::read_to_string(bench.0.path().join("residual.csv")).unwrap();
        let header = residual.lines().next().unwrap();
        let mut names = header.split(',');
        let place = names.position(|name| name == "residual_slide").unwrap();
        let largest = residual.lines().skip(1).map(|line| {
            let number = line.split(',').nth(place).unwrap();
            number.parse::<f64>().unwrap().abs()
        });
        let largest = largest.fold(0.0, f64::max);
        // Coulomb friction of the model turns at once, that of differences within some rows
        assert!(largest < 7.0, "{kind} of {channel}: {largest}");
    }
}

#[test]
fn a_torque_that_is_constant_while_the_joint_moves_is_refused_with_the_remedy() {
    let bench = Bench::new();
    let mut rows = rows();
    rows.iter_mut().for_each(|row| row[2] = 1.5);
    bench.log("dead.csv", &rows);
    let run = bench
        .tool("lsq dead.csv -r slide.toml -o m.toml")
        .assert()
        .code(3);
    let said = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(said.contains("`tau_slide` 1.5 in all 10000 rows"), "{said}");
    assert!(said.contains("check the sensor"), "{said}");
    assert!(!bench.0.path().join("m.toml").exists());
}

#[test]
fn the_torque_of_a_motion_is_given_for_every_row_a_bridged_one_too() {
    let bench = Bench::new();
    bench.log("good.csv", &rows());
    bench.json("lsq good.csv -r slide.toml -o good.toml");
    let mut rows = rows();
    rows[5000][1] += 0.02;
    bench.log("bad.csv", &rows);
    let found = bench.json("torque bad.csv -m good.toml -o torque.csv");
    assert!(warnings(&found).contains("spike of `q_slide`, 1 row(s) at 5.000 s"));
    let text = fs::read_to_string(bench.0.path().join("torque.csv")).unwrap();
    // a spike of one row is bridged: its row gets a torque like any other
    assert_eq!(text.lines().count(), 1 + 10_000);
}
