//! `watch`: a log and a stream give the same lines, pushes are found with their size, begin and end, and bad input
//! ends with what was seen.

use assert_cmd::Command;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

const ROBOT: &str = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"revolute\"\n\n\
    [friction]\nlaw = \"viscous-coulomb\"\nfitted_with_inertias = true\noffset = true\n\n\
    [filter]\nposition_cutoff_hz = 60.0\ncutoff_hz = 10.0\n";

/// A number in 0..1 that looks like chance.
fn chance(k: u64) -> f64 {
    let mut x = k.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D;
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Rows of a joint of 0.5 kg m^2 that `push` acts on, by time, position, velocity and acceleration.
fn rows(seed: u64, seconds: u64, push: &dyn Fn(f64, f64, f64, f64) -> f64) -> Vec<[f64; 3]> {
    let row = |k: u64| {
        let t = k as f64 * 1e-3;
        let waves = [(0.6, 2.1, 0.3), (0.25, 5.3, 1.1), (0.1, 9.7, 2.0)];
        let (mut q, mut v, mut a) = (0.0, 0.0, 0.0);
        for (size, w, phase) in waves {
            let x: f64 = w * t + phase + seed as f64;
            q += size * x.sin();
            v += size * w * x.cos();
            a -= size * w * w * x.sin();
        }
        // twelve equal chances make a normal one
        let noise = |of: u64| -> f64 {
            let at = (k * 40 + of * 12) ^ (seed << 40);
            (0..12).map(|i| chance(at + i)).sum::<f64>() - 6.0
        };
        let tau = 0.5 * a + 0.8 * v + 1.5 * (v > 0.0) as u8 as f64 - 1.5 * (v < 0.0) as u8 as f64;
        let tau = tau + 0.2 + 0.3 * noise(0) + push(t, q, v, a);
        [t, q + 1e-6 * noise(1), tau]
    };
    (0..seconds * 1000).map(row).collect()
}

fn csv(rows: &[[f64; 3]]) -> String {
    let mut text = "t,q_q1,tau_q1\n".to_owned();
    for [t, q, tau] in rows {
        writeln!(text, "{t},{q},{tau}").unwrap();
    }
    text
}

/// A folder with a model that was fitted to 40 s without a push.
fn fitted() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.toml"), ROBOT).unwrap();
    let log = csv(&rows(1, 40, &|_, _, _, _| 0.0));
    std::fs::write(folder.path().join("fit.csv"), log).unwrap();
    let lsq = ["lsq", "fit.csv", "-r", "robot.toml", "-o", "model.toml"];
    let (status, _, err) = run(folder.path(), &lsq, None);
    assert_eq!(status, 0, "{err}");
    folder
}

/// Runs a command in a folder: status, standard output, standard error.
fn run(folder: &Path, arguments: &[&str], input: Option<&[u8]>) -> (i32, String, String) {
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    command.current_dir(folder).args(arguments);
    if let Some(input) = input {
        command.write_stdin(input);
    }
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

fn document(folder: &Path, arguments: &[&str]) -> Value {
    let (status, out, err) = run(folder, &[arguments, &["--json", "-"]].concat(), None);
    assert_eq!(status, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn a_log_and_its_rows_on_standard_input_give_the_same_lines() {
    let folder = fitted();
    let path = folder.path();
    let rows = rows(2, 6, &|t, _, _, _| {
        if (3.0..3.5).contains(&t) { 4.0 } else { 0.0 }
    });
    let text = csv(&rows);
    std::fs::write(path.join("log.csv"), &text).unwrap();
    let (status, of_file, err) = run(path, &["watch", "log.csv", "-m", "model.toml"], None);
    assert_eq!(status, 0, "{err}");
    let watch = ["watch", "-", "-m", "model.toml"];
    let (status, of_stream, _) = run(path, &watch, Some(text.as_bytes()));
    assert_eq!(status, 0);
    assert!(of_file == of_stream);
    let mut json = String::new();
    for [t, q, tau] in &rows {
        writeln!(
            json,
            "{{\"t\": {t}, \"q\": [{q}], \"more\": {{}}, \"tau\": [{tau}]}}"
        )
        .unwrap();
    }
    let (status, of_json, err) = run(path, &watch, Some(json.as_bytes()));
    assert_eq!(status, 0, "{err}");
    assert!(of_file == of_json);
    let lines: Vec<Value> = of_file
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    assert!(lines.len() > 5500, "{}", lines.len());
    let on = lines.iter().filter(|line| !line["alarm"].is_null()).count();
    assert!((450..900).contains(&on), "{on}");
    let first = &lines[0]["joints"][0];
    assert_eq!(first["joint"], "q1");
    assert!(first["external"].is_number() && first["std"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_push_is_an_alarm_with_its_joint_size_begin_and_end() {
    let folder = fitted();
    let path = folder.path();
    let push = |t: f64, _: f64, _: f64, _: f64| if (10.0..10.6).contains(&t) { -3.0 } else { 0.0 };
    std::fs::write(path.join("log.csv"), csv(&rows(3, 20, &push))).unwrap();
    let found = document(
        path,
        &[
            "watch",
            "log.csv",
            "-m",
            "model.toml",
            "--false-alarms",
            "1",
        ],
    );
    let alarms = found["alarms"].as_array().unwrap();
    assert_eq!(alarms.len(), 1, "{found}");
    let delay = found["delay_s"].as_f64().unwrap();
    assert!((0.02..0.05).contains(&delay), "{delay}");
    let at = |key: &str| alarms[0][key].as_f64().unwrap() - delay;
    assert!((at("from_s") - 10.0).abs() < 0.08, "{}", at("from_s"));
    assert!((at("to_s") - 10.6).abs() < 0.08, "{}", at("to_s"));
    assert_eq!(alarms[0]["joints"][0]["joint"], "q1");
    let size = alarms[0]["joints"][0]["external"].as_f64().unwrap();
    assert!((size + 3.0).abs() < 0.5, "{size}");
}

#[test]
fn a_mass_and_a_change_of_friction_are_distinguished_from_each_other() {
    let folder = fitted();
    let path = folder.path();
    let mass = |t: f64, _: f64, _: f64, a: f64| if t > 5.0 { 0.3 * a } else { 0.0 };
    let friction = |t: f64, _: f64, v: f64, _: f64| if t > 5.0 { 1.5 * v.signum() } else { 0.0 };
    std::fs::write(path.join("mass.csv"), csv(&rows(4, 20, &mass))).unwrap();
    std::fs::write(path.join("friction.csv"), csv(&rows(5, 20, &friction))).unwrap();
    let found = document(path, &["watch", "mass.csv", "-m", "model.toml"]);
    let shown = &found["explanation"];
    assert_eq!(shown["kind"], "payload", "{shown}");
    let change = &shown["changes"][0];
    let [value, std] = ["value", "std"].map(|key| change[key].as_f64().unwrap());
    assert!(
        (value - 0.3).abs() < 0.06 && std > 0.0 && std < 0.05,
        "{change}"
    );
    let found = document(path, &["watch", "friction.csv", "-m", "model.toml"]);
    let shown = &found["explanation"];
    assert_eq!(
        (&shown["kind"], &shown["joint"]),
        (&"friction".into(), &"q1".into()),
        "{shown}"
    );
    let coulomb = shown["changes"][0]["value"].as_f64().unwrap();
    assert!((coulomb - 1.5).abs() < 0.4, "{shown}");
}

#[test]
fn input_that_ends_within_a_line_ends_with_status_3_and_what_was_seen() {
    let folder = fitted();
    let path = folder.path();
    let text = csv(&rows(6, 3, &|_, _, _, _| 0.0));
    let watch = ["watch", "-", "-m", "model.toml"];
    let (status, whole, _) = run(path, &watch, Some(text.as_bytes()));
    assert_eq!(status, 0);
    let line = text.lines().count();
    // within the last number: it would be read as another
    for end in [text.len() - 3, text.len() - 30] {
        let (status, seen, err) = run(path, &watch, Some(&text.as_bytes()[..end]));
        assert_eq!(status, 3, "{err}");
        assert!(err.contains(&format!("-:{line}")), "{err}");
        assert!(whole.starts_with(&seen) && seen.len() > whole.len() / 2);
    }
    // one that goes on in another form ends it where that begins
    let wrong = text.replace("\n1.5", "\n1.5x");
    let (status, seen, err) = run(path, &watch, Some(wrong.as_bytes()));
    assert_eq!(status, 3, "{err}");
    assert!(err.contains("-:1504") && err.contains("1.5x02"), "{err}");
    assert!(whole.starts_with(&seen) && !seen.is_empty());
    let json = "{\"t\": 0.0, \"q\": [0.1], \"tau\": [1.0]}\n{\"t\": 0.001, \"q\": [0.1]}\n";
    let (status, _, err) = run(path, &watch, Some(json.as_bytes()));
    assert_eq!(status, 3, "{err}");
    assert!(err.contains("-:2") && err.contains("tau_q1"), "{err}");
}

#[test]
fn torn_rows_of_a_stream_are_passed_over_and_counted() {
    let folder = fitted();
    let text = csv(&rows(6, 3, &|_, _, _, _| 0.0));
    let watch = ["watch", "-", "-m", "model.toml"];
    let (_, whole, _) = run(folder.path(), &watch, Some(text.as_bytes()));
    let last =
        |lines: &str| -> Value { serde_json::from_str(lines.lines().last().unwrap()).unwrap() };
    let external = |line: &Value| line["joints"][0]["external"].as_f64().unwrap();
    let line = |t: &str| {
        text.lines()
            .find(|line| line.starts_with(t))
            .unwrap()
            .to_owned()
    };
    // a field that is lost, a byte that is another one, a row that an end of line cuts in two
    let row = line("1.5,");
    let cut = row.rfind(',').unwrap();
    let halves = [&row[..cut], "\n", &row[cut + 2..]].concat();
    for (torn, count) in [
        (row[..cut].to_owned(), "1"),
        (row.replacen('5', "x", 1), "1"),
        (halves, "2"),
    ] {
        let text = text.replacen(&row, &torn, 1);
        let (status, seen, err) = run(folder.path(), &watch, Some(text.as_bytes()));
        assert_eq!(status, 0, "{torn}: {err}");
        let words = format!("{count} rows are torn and are passed over");
        assert!(
            err.contains(&words) && err.contains("-:1502"),
            "{torn}: {err}"
        );
        let off = external(&last(&seen)) - external(&last(&whole));
        assert!(off.abs() < 1e-3, "{torn}: {off}");
    }
}

#[test]
fn a_model_without_data_set_aside_says_how_to_get_it_or_takes_an_unloaded_log() {
    let folder = fitted();
    let path = folder.path();
    let text = std::fs::read_to_string(path.join("model.toml")).unwrap();
    let begin = text.find("# What the model leaves").unwrap();
    let end = text.find("[provenance]").unwrap();
    let without = format!("{}{}", &text[..begin], &text[end..]);
    let without = without.replace("held_out = [\"q1\"]\n", "held_out = []\n");
    let without = without.replace("links = 1\n", "links = 0\n");
    std::fs::write(path.join("old.toml"), without).unwrap();
    std::fs::write(path.join("log.csv"), csv(&rows(7, 8, &|_, _, _, _| 0.0))).unwrap();
    let (status, out, err) = run(path, &["watch", "log.csv", "-m", "old.toml"], None);
    assert_eq!((status, out.as_str()), (3, ""), "{err}");
    assert!(
        err.contains("--unloaded LOG") && err.contains("fit it again"),
        "{err}"
    );
    std::fs::write(path.join("free.csv"), csv(&rows(8, 30, &|_, _, _, _| 0.0))).unwrap();
    let watch = [
        "watch",
        "log.csv",
        "-m",
        "old.toml",
        "--unloaded",
        "free.csv",
    ];
    let found = document(path, &watch);
    assert!(found["calibrated_s"].as_f64().unwrap() > 25.0);
    assert_eq!(found["inputs"].as_array().unwrap().len(), 2);
    // no band without data set aside
    let found = document(path, &["validate", "log.csv", "-m", "old.toml"]);
    assert_eq!(found["joints"][0].get("coverage_95"), None);
    assert!(found["warnings"].to_string().contains("no band"), "{found}");
}

#[test]
fn the_band_of_validate_and_torque_holds_what_it_says() {
    let folder = fitted();
    let path = folder.path();
    std::fs::write(path.join("log.csv"), csv(&rows(9, 20, &|_, _, _, _| 0.0))).unwrap();
    let validate = [
        "validate",
        "log.csv",
        "-m",
        "model.toml",
        "-o",
        "residual.csv",
    ];
    let found = document(path, &validate);
    let coverage = found["joints"][0]["coverage_95"].as_f64().unwrap();
    assert!((0.93..0.97).contains(&coverage), "{coverage}");
    let text = std::fs::read_to_string(path.join("residual.csv")).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let wanted = [
        "t",
        "tau_q1",
        "tau_hat_q1",
        "residual_q1",
        "band_lower_q1",
        "band_upper_q1",
    ];
    assert_eq!(header, wanted);
    let (mut inside, mut all) = (0, 0);
    for line in lines {
        let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        inside += usize::from(x[4] <= x[1] && x[1] <= x[5]);
        all += 1;
    }
    assert!((inside as f64 / all as f64 - coverage).abs() < 1e-3);
    let torque = ["torque", "log.csv", "-m", "model.toml", "-o", "torque.csv"];
    document(path, &torque);
    let text = std::fs::read_to_string(path.join("torque.csv")).unwrap();
    assert!(text.starts_with("t,tau_q1,tau_std_q1,band_lower_q1,band_upper_q1\n"));
    // a motion twice as fast leaves what was seen
    let fast: Vec<[f64; 3]> = rows(10, 10, &|_, _, _, _| 0.0);
    let fast: Vec<[f64; 3]> = fast.iter().map(|[t, q, tau]| [t / 2.0, *q, *tau]).collect();
    std::fs::write(path.join("fast.csv"), csv(&fast)).unwrap();
    let found = document(
        path,
        &["torque", "fast.csv", "-m", "model.toml", "-o", "fast.mcap"],
    );
    let shown = found["warnings"].to_string();
    assert!(
        shown.contains("q1 leaves what the model was fitted on"),
        "{shown}"
    );
    assert!(shown.contains("speeds up to"), "{shown}");
}

#[test]
fn open_loop_follows_a_log_from_its_torques() {
    let folder = fitted();
    let path = folder.path();
    std::fs::write(path.join("log.csv"), csv(&rows(11, 10, &|_, _, _, _| 0.0))).unwrap();
    let found = document(
        path,
        &["validate", "log.csv", "-m", "model.toml", "--open-loop=0.5"],
    );
    let open = &found["open_loop"];
    assert_eq!(open["window_s"], 0.5);
    assert!(
        open["windows"].as_u64().unwrap() >= 18 && open["astray"] == 0,
        "{open}"
    );
    assert!(
        open["joints"][0]["relative"].as_f64().unwrap() < 0.05,
        "{open}"
    );
    let found = document(
        path,
        &["validate", "log.csv", "-m", "model.toml", "--open-loop"],
    );
    assert_eq!(found["open_loop"]["windows"], 1);
}
