//! What standard deviations must not depend on: where the clock's zero lies, and how a log is cut into files.
//! Skipped aloud where ../shared/data is not there.

use crate::measured_support;

use std::path::{Path, PathBuf};

use measured_support::{run, shared};
use serde_json::Value;

/// Value and standard deviation of every parameter that the logs determine.
fn fitted(robot: &str, logs: &[String]) -> Vec<[f64; 2]> {
    let folder = tempfile::tempdir().unwrap();
    let mut words = vec!["lsq", "-r", robot, "-o", "model.toml"];
    words.extend(logs.iter().map(String::as_str));
    let found = run(folder.path(), &words);
    let number = |p: &Value, key: &str| p[key].as_f64().unwrap_or(f64::NAN);
    let parameters = found["parameters"].as_array().unwrap().iter();
    parameters
        .map(|p| [number(p, "value"), number(p, "std")])
        .collect()
}

/// A log whose clock shows `offset` more, digit by digit.
fn later(log: &Path, offset: u64, folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(log).unwrap();
    let mut lines = text.lines();
    let mut out = format!("{}\n", lines.next().unwrap());
    for line in lines {
        let (t, rest) = line.split_once(',').unwrap();
        let (whole, fraction) = t.split_once('.').unwrap_or((t, "0"));
        let whole = whole.parse::<u64>().unwrap() + offset;
        out.push_str(&format!("{whole}.{fraction},{rest}\n"));
    }
    let path = folder.join(format!("later_{offset}.csv"));
    std::fs::write(&path, out).unwrap();
    path
}

/// Largest change of a deviation over itself, and of a value in deviations.
fn largest(before: &[[f64; 2]], after: &[[f64; 2]]) -> [f64; 2] {
    let mut most = [0.0_f64; 2];
    for ([value, std], [other, other_std]) in before.iter().zip(after) {
        // a parameter may be determined by one of the two alone
        if std.is_finite() && other_std.is_finite() {
            most[0] = most[0].max((other_std / std - 1.0).abs());
            most[1] = most[1].max((other - value).abs() / std);
        }
    }
    most
}

/// Middle change of a deviation over itself.
fn middle(before: &[[f64; 2]], after: &[[f64; 2]]) -> f64 {
    let both = before.iter().zip(after);
    let change = both.map(|([_, a], [_, b])| (b / a - 1.0).abs());
    let mut changes: Vec<f64> = change.filter(|c| c.is_finite()).collect();
    changes.sort_by(f64::total_cmp);
    changes[changes.len() / 2]
}

#[test]
fn deviations_do_not_depend_on_where_the_clock_s_zero_lies() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let name = |path: &Path| vec![path.to_str().unwrap().to_owned()];
    let before = fitted("configs/emps.toml", &name(&log));
    for offset in [5, 1_600_000_000] {
        let after = fitted(
            "configs/emps.toml",
            &name(&later(&log, offset, folder.path())),
        );
        let [std, value] = largest(&before, &after);
        assert!(std < 1e-6, "{offset}: {std}");
        assert!(value < 1e-6, "{offset}: {value}");
    }
}

#[test]
fn a_deviation_hardly_changes_where_a_log_begins_a_little_later() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let span = |from: &str| vec![format!("{}@{from}..30s", log.display())];
    let before = fitted("configs/emps.toml", &span("0"));
    for from in ["0.05", "0.1", "0.15", "0.2"] {
        let [std, _] = largest(&before, &fitted("configs/emps.toml", &span(from)));
        // where blocks began decided a fifth of the deviation
        assert!(std < 0.05, "{from} s later: {std}");
    }
}

#[test]
fn deviations_do_not_depend_on_how_a_log_is_cut_into_files() {
    // the halves lose what filters need at their ends: 0.8 % of the rows of EMPS, 3 % of the other two
    for (robot, log, most) in [
        ("emps", "emps/emps_id.csv", 0.1),
        ("ur10", "ur10/ur10_exciting.csv", f64::INFINITY),
        ("tx40", "tx40/tx40_joint.csv", f64::INFINITY),
    ] {
        let Some(log) = shared(log) else { continue };
        let robot = format!("configs/{robot}.toml");
        let log = log.display();
        let whole = fitted(&robot, &[log.to_string()]);
        for cut in [37, 50] {
            let parts = [format!("{log}@0..{cut}%"), format!("{log}@{cut}..100%")];
            let found = fitted(&robot, &parts);
            let ([std, value], usual) = (largest(&whole, &found), middle(&whole, &found));
            assert!(std < most, "{robot} at {cut} %: {std}");
            assert!(value < 1.1, "{robot} at {cut} %: {value}");
            assert!(usual < 0.1, "{robot} at {cut} %: {usual}");
        }
    }
}
