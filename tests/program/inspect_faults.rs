//! Faults put into simulated logs are found, where they are, and nothing else is.

mod by_model;

use crate::altered_log;

use std::sync::OnceLock;

use altered_log::{Log, assert_faults, faults};
use cft_ident::simulate::Experiment;

const CFT: Option<&str> = Some("configs/cft.toml");

/// All joints move (Table 3 of the report), 20 s at 1 kHz.
fn all_move() -> Log {
    static LOG: OnceLock<Log> = OnceLock::new();
    LOG.get_or_init(|| Log::simulated(Experiment::Usual, 20.0))
        .clone()
}

/// q4 moves at several speeds, with rests; the others are held.
fn one_moves() -> Log {
    static LOG: OnceLock<Log> = OnceLock::new();
    LOG.get_or_init(|| Log::simulated(Experiment::of_joint("q4"), 20.0))
        .clone()
}

fn both() -> [Log; 2] {
    [all_move(), one_moves()]
}

/// Asserts that `alter` makes exactly one fault of both logs.
fn one_fault(alter: impl Fn(&mut Log), fault: (&str, &str, &str, f64, f64)) {
    for mut log in both() {
        alter(&mut log);
        assert_faults(&log.inspected(CFT), &[fault]);
    }
}

fn deviation(column: &[f64]) -> f64 {
    let n = column.len() as f64;
    let mean = column.iter().sum::<f64>() / n;
    (column.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt()
}

#[test]
fn clean_logs_have_no_fault_and_their_channels_rate_and_motion_are_reported() {
    for (log, moving) in both().iter().zip([&["q1", "q2", "q4", "q5"][..], &["q4"]]) {
        let found = log.inspected(CFT);
        assert_faults(&found, &[]);
        assert!((found["rate_hz"].as_f64().unwrap() - 1000.0).abs() < 1e-6);
        assert!(found["jitter"].as_f64().unwrap() < 1e-6);
        assert_eq!(found["gaps"].as_array().unwrap().len(), 0);
        let channels = found["channels"].as_array().unwrap();
        let units: Vec<&str> = channels
            .iter()
            .map(|c| c["unit"].as_str().unwrap())
            .collect();
        assert_eq!(units, ["m", "rad", "rad", "rad", "N", "Nm", "Nm", "Nm"]);
        for (channel, column) in channels.iter().zip(&log.columns[1..]) {
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!(channel["min"].as_f64().unwrap(), low);
            assert!((channel["rate_hz"].as_f64().unwrap() - 1000.0).abs() < 1e-6);
        }
        let joints = found["joints"].as_array().unwrap();
        let moves = joints.iter().filter(|joint| joint["moves"] == true);
        assert_eq!(
            moves
                .map(|joint| joint["joint"].as_str().unwrap())
                .collect::<Vec<_>>(),
            moving
        );
    }
}

#[test]
fn quantisation_is_judged_within_the_cut_off_of_the_robot_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "t,q_slide,tau_slide\n".to_owned();
    for k in 0..8000 {
        let t = 0.001 * f64::from(k);
        // 0.1 m at 1 Hz, by an encoder of 3 mm: 40 % noise on the acceleration below 20 Hz, 1 % below 5 Hz
        let q = (0.1 * (std::f64::consts::TAU * t).sin() / 0.003).round() * 0.003;
        let tau = (7.1 * t).sin() + 0.3 * (23.0 * t).cos();
        text += &format!("{t:.3},{q:.3},{tau:.6}\n");
    }
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let severity = |cutoff_hz: f64| {
        let robot = format!(
            "[robot]\nmodel = \"single-joint\"\njoint = \"slide\"\nkind = \"prismatic\"\n\
             [friction]\nlaw = \"viscous-coulomb\"\nfitted_with_inertias = true\n\
             [filter]\ncutoff_hz = {cutoff_hz:?}\n"
        );
        std::fs::write(folder.path().join("slide.toml"), robot).unwrap();
        let done = assert_cmd::Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(folder.path())
            .args(["inspect", "log.csv", "-r", "slide.toml", "--json", "-"])
            .assert()
            .code(0);
        let found: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
        let mut faults = found["faults"].as_array().unwrap().iter();
        let coarse = faults.find(|f| f["kind"] == "quantisation" && f["channel"] == "q_slide");
        coarse.unwrap()["severity"].as_str().unwrap().to_owned()
    };
    assert_eq!(severity(20.0), "warning");
    assert_eq!(severity(5.0), "info");
}

#[test]
fn nan_is_an_error_at_its_row() {
    one_fault(
        |log| log.column("q_q4")[5000] = f64::NAN,
        ("error", "nan", "q_q4", 5.0, 5.0),
    );
    one_fault(
        |log| log.column("tau_q1")[5000..5100].fill(f64::INFINITY),
        ("error", "nan", "tau_q1", 5.0, 5.099),
    );
}

#[test]
fn time_that_stands_still_or_runs_back_is_an_error_at_its_row() {
    one_fault(
        |log| {
            let t = log.column("t");
            t[7000] = t[6999];
        },
        ("error", "repeated-time", "", 6.999, 6.999),
    );
    one_fault(
        |log| log.column("t")[7000..].iter_mut().for_each(|t| *t -= 0.5),
        ("error", "backward-time", "", 6.5, 6.999),
    );
}

#[test]
fn a_channel_without_any_number_and_a_log_without_rows_are_errors() {
    one_fault(
        |log| log.column("tau_q4").fill(f64::NAN),
        ("error", "nan", "tau_q4", 0.0, 19.999),
    );
    let mut log = all_move();
    log.drain(1..20_000);
    let found = faults(&log.inspected(CFT));
    assert!(
        found
            .iter()
            .any(|f| f.0 == "error" && f.1 == "incomplete-file"),
        "{found:?}"
    );
}

#[test]
fn raw_channels_are_held_against_the_limits_of_the_set_up() {
    let mut log = Log::simulated_raw(2.0);
    let found = log.inspected(CFT);
    assert_faults(&found, &[]);
    let channels = found["channels"].as_array().unwrap();
    let slide = channels.iter().find(|c| c["name"] == "x_c4").unwrap();
    assert_eq!(slide["limits"], serde_json::json!([-0.0606, 0.5344]));
    log.column("x_c4")[700..710].fill(0.6);
    let found = faults(&log.inspected(CFT));
    assert!(
        found
            .iter()
            .any(|f| f.1 == "beyond-limits" && f.2 == "x_c4" && (f.3 - 0.7).abs() < 2e-3),
        "{found:?}"
    );
}

#[test]
fn lost_rows_are_a_gap() {
    for mut log in both() {
        log.drain(8000..8200);
        let found = log.inspected(CFT);
        assert_faults(&found, &[("warning", "dropout", "", 7.999, 8.2)]);
        let gaps = found["gaps"].as_array().unwrap();
        assert_eq!(gaps.len(), 1);
        assert!((gaps[0]["from_s"].as_f64().unwrap() - 7.999).abs() < 1e-9);
        assert!((gaps[0]["to_s"].as_f64().unwrap() - 8.2).abs() < 1e-9);
    }
}

#[test]
fn a_clock_with_jitter_is_a_warning_and_its_jitter_is_reported() {
    let mut log = all_move();
    for (k, t) in log.column("t").iter_mut().enumerate() {
        *t += [0.0, 0.2e-3, -0.1e-3, 0.3e-3, -0.2e-3][k * 7 % 5];
    }
    let found = log.inspected(CFT);
    assert_faults(&found, &[("warning", "irregular-clock", "", 0.0, 19.9988)]);
    let jitter = found["jitter"].as_f64().unwrap();
    assert!((0.1..0.6).contains(&jitter), "{jitter}");
}

#[test]
fn a_channel_that_sticks_is_found_from_the_row_where_it_does_to_the_last() {
    for name in ["q_q4", "tau_q4"] {
        one_fault(
            |log| {
                let column = log.column(name);
                let value = column[5000];
                column[5000..5400].fill(value);
            },
            ("warning", "stuck-channel", name, 5.0, 5.399),
        );
    }
    one_fault(
        |log| {
            let column = log.column("q_q4");
            let value = column[5000];
            column[5000..].fill(value);
        },
        ("warning", "stuck-channel", "q_q4", 5.0, 19.999),
    );
    one_fault(
        |log| log.column("tau_q4").fill(0.25),
        ("error", "stuck-channel", "tau_q4", 0.0, 19.999),
    );
}

#[test]
fn flat_tops_are_found_from_the_first_to_the_last() {
    for (mut log, share) in both()
        .into_iter()
        .flat_map(|log| [0.5, 0.8, 0.95].map(|share| (log.clone(), share)))
    {
        let torque = log.column("tau_q4");
        let limit = share * torque.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let clipped: Vec<f64> = (0..torque.len())
            .filter(|k| torque[*k].abs() >= limit)
            .map(|k| k as f64 * 1e-3)
            .collect();
        torque.iter_mut().for_each(|x| *x = x.clamp(-limit, limit));
        let faults = altered_log::faults(&log.inspected(CFT));
        assert!(!faults.is_empty());
        assert!(
            faults
                .iter()
                .all(|f| f.1 == "saturation" && f.2 == "tau_q4" && f.0 == "warning"),
            "{faults:?}"
        );
        let covered = |t: &&f64| {
            faults
                .iter()
                .any(|f| f.3 - 0.01 <= **t && **t <= f.4 + 0.01)
        };
        let found = clipped.iter().filter(covered).count() as f64 / clipped.len() as f64;
        // single rows that noise brings to the limit are no tops
        assert!(
            found > if share > 0.9 { 0.6 } else { 0.97 },
            "{share}: {found}"
        );
    }
    let mut log = all_move();
    let q = log.column("q_q4");
    let mut sorted = q.clone();
    sorted.sort_by(f64::total_cmp);
    let limit = sorted[sorted.len() * 9 / 10];
    q.iter_mut().for_each(|x| *x = x.min(limit));
    let faults = altered_log::faults(&log.inspected(CFT));
    assert!(
        faults.len() > 5 && faults.iter().all(|f| f.1 == "clipping" && f.2 == "q_q4"),
        "{faults:?}"
    );
}

#[test]
fn coarse_numbers_are_a_warning_where_they_spoil_a_fit() {
    // within the 10 Hz that the robot file keeps, steps of 1e-3 rad are averaged out
    for mut log in both() {
        let position = log.column("q_q4").iter_mut();
        position.for_each(|q| *q = (*q / 1e-3).round() * 1e-3);
        assert_faults(&log.inspected(CFT), &[]);
    }
    one_fault(
        |log| {
            let torque = log.column("tau_q4");
            let step = 0.25 * deviation(torque);
            torque
                .iter_mut()
                .for_each(|x| *x = (*x / step).round() * step);
        },
        ("warning", "quantisation", "tau_q4", 0.0, 19.999),
    );
    let mut fine = all_move();
    fine.column("q_q4")
        .iter_mut()
        .for_each(|q| *q = (*q / 1e-4).round() * 1e-4);
    let found = fine.inspected(CFT);
    assert_faults(&found, &[]);
    let step = found["channels"][2]["step"].as_f64().unwrap();
    assert!((step - 1e-4).abs() < 1e-9, "{step}");
}

#[test]
fn spikes_are_found_row_by_row() {
    for mut log in both() {
        for k in [3000, 9000, 15_001] {
            log.column("q_q4")[k] += 0.01;
        }
        let at = |t: f64| ("warning", "spike", "q_q4", t, t);
        assert_faults(&log.inspected(CFT), &[at(3.0), at(9.0), at(15.001)]);
    }
    for mut log in both() {
        let torque = log.column("tau_q4");
        let height = 3.0 * deviation(torque);
        torque[3000] += height;
        torque[9000..9003].iter_mut().for_each(|x| *x -= height);
        let found = log.inspected(CFT);
        assert_faults(
            &found,
            &[
                ("warning", "spike", "tau_q4", 3.0, 3.0),
                ("warning", "spike", "tau_q4", 9.0, 9.002),
            ],
        );
    }
}

#[test]
fn a_copy_of_another_channel_is_an_error() {
    for mut log in both() {
        let copy = log.column("tau_q4").clone();
        *log.column("tau_q5") = copy;
        assert_faults(
            &log.inspected(CFT),
            &[("error", "copied-channel", "tau_q5", 0.0, 19.999)],
        );
    }
}

#[test]
fn a_position_that_equals_the_command_or_has_no_noise_is_reported() {
    for mut log in both() {
        let measured = log.column("q_q4").clone();
        log.add("q_ref_q4", measured);
        assert_faults(
            &log.inspected(CFT),
            &[("warning", "command-as-measurement", "q_q4", 0.0, 19.999)],
        );
    }
    let mut log = all_move();
    let smooth = (0..20_000).map(|k| (f64::from(k) * 1e-3).sin()).collect();
    *log.column("q_q2") = smooth;
    let found = log.inspected(CFT);
    let shown = found["faults"].as_array().unwrap();
    assert!(
        shown
            .iter()
            .any(|f| f["kind"] == "command-as-measurement" && f["channel"] == "q_q2"),
        "{shown:?}"
    );
}

#[test]
fn a_velocity_that_is_filtered_is_reported_with_its_lag_and_a_true_one_is_not() {
    for mut log in both() {
        let q = log.column("q_q4").clone();
        let mut speed: Vec<f64> = (0..q.len())
            .map(|k| 500.0 * (q[(k + 1).min(q.len() - 1)] - q[k.saturating_sub(1)]))
            .collect();
        let mut clean = log.clone();
        clean.add("dq_q4", speed.clone());
        assert_faults(&clean.inspected(None), &[]);
        // first order at 20 Hz: late by 8 ms below it
        let pole = (-std::f64::consts::TAU * 20.0 * 1e-3).exp();
        for k in 1..speed.len() {
            speed[k] = pole * speed[k - 1] + (1.0 - pole) * speed[k];
        }
        log.add("dq_q4", speed.clone());
        assert_faults(
            &log.inspected(None),
            &[("warning", "filter", "dq_q4", 0.0, 19.999)],
        );
        speed.iter_mut().for_each(|v| *v = -*v);
        *log.column("dq_q4") = speed;
        assert_faults(
            &log.inspected(None),
            &[("error", "wrong-sign-or-order", "dq_q4", 0.0, 19.999)],
        );
    }
}

#[test]
fn samples_that_are_logged_twice_are_found_and_slow_encoders_are_not_blamed() {
    let mut log = all_move();
    for k in (1000..19_000).step_by(150) {
        for column in &mut log.columns[1..] {
            column[k] = column[k - 1];
        }
    }
    let found = log.inspected(CFT);
    assert_faults(&found, &[("warning", "repeated-rows", "", 0.999, 18.85)]);
    assert_eq!(found["faults"][0]["rows"], 120);
}

#[test]
fn spans_and_several_logs_are_distinguished_and_names_are_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = one_moves();
    log.column("q_q4")[15_000] += 0.01;
    log.add("bad\u{202e}name\u{1b}[31m", vec![0.0; 20_000]);
    let path = folder.path().join("a.csv");
    log.write(&path);
    let half = |span: &str| altered_log::inspect(&format!("{}@{span}", path.display()), CFT);
    assert_faults(&half("0..50%"), &[]);
    assert_faults(&half("10..20s"), &[("warning", "spike", "q_q4", 5.0, 5.0)]);
    let mut command = assert_cmd::Command::cargo_bin("cft-ident").unwrap();
    let run = command
        .arg("inspect")
        .arg(&path)
        .arg(&path)
        .assert()
        .code(0);
    let text = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    assert!(text.contains("bad\\u{202e}name\\u{1b}[31m"), "{text}");
    assert_eq!(text.matches("20000 rows in 19.999 s").count(), 2);
    assert_eq!(text.lines().find(|line| line.chars().count() > 80), None);
}

#[test]
fn a_very_wide_log_is_looked_at_in_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.csv");
    let names: String = (0..3000).map(|k| format!(",q_{k}")).collect();
    let row = |t: u32| format!("{t}{}\n", format!(",{t}").repeat(3000));
    let rows: String = (0..300).map(row).collect();
    std::fs::write(&path, format!("t{names}\n{rows}")).unwrap();
    let found = altered_log::inspect(&path.to_string_lossy(), None);
    assert_eq!(found["channels"].as_array().unwrap().len(), 3000);
    let joints = found["joints"].as_array().unwrap().len();
    assert!((1..=512).contains(&joints), "{joints}");
}
