//! What must not change a fit does not change it: measured logs written otherwise give the same parameters.
//!
//! | change | tolerance |
//! |---|---|
//! | columns in another order, compressed, threads, cut and joined again | none: bit for bit |
//! | positions in a unit that is a power of two, axis mirrored and declared so | none |
//! | times counted from another instant, a recording of messages | 1e-6 of a standard deviation (the times themselves are rounded); 0.02 on an uneven clock |
//! | two halves as two logs | one standard deviation: rows at the cut are left to the filters |

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::bench::Bench;
use crate::measured_support::shared;

/// Measured sets: the log, its robot file, and what another zero of the clock may change [standard deviations].
const SETS: [(&str, &str, f64); 2] = [
    ("emps/emps_id.csv", "configs/emps.toml", 1e-6),
    // rows of an uneven clock are interpolated onto an even one
    ("panda/panda_exciting.csv", "configs/panda.toml", 0.02),
];

/// A log as cells of text.
#[derive(Clone)]
struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let rows = text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect());
        Self {
            rows: rows.collect(),
        }
    }

    fn text(&self) -> String {
        let lines: Vec<String> = self.rows.iter().map(|row| row.join(",")).collect();
        lines.join("\n") + "\n"
    }

    /// The rows from one to the other, counted behind the header.
    fn part(&self, rows: std::ops::Range<usize>) -> Self {
        let kept = self.rows[1..][rows].iter();
        Self {
            rows: self.rows[..1].iter().chain(kept).cloned().collect(),
        }
    }

    /// Numbers of the columns of these names changed.
    fn changed(&self, names: &[&str], change: impl Fn(f64) -> f64) -> Self {
        let mut out = self.clone();
        for name in names {
            let at = self.rows[0].iter().position(|cell| cell == name).unwrap();
            for row in &mut out.rows[1..] {
                row[at] = format!("{:?}", change(row[at].parse().unwrap()));
            }
        }
        out
    }
}

/// Key, value and standard deviation of every parameter that a fit finds.
fn fitted(bench: &Bench, logs: &str, robot: &str, further: &str) -> Vec<(String, f64, f64)> {
    let line = format!("lsq {logs} -r {robot} -o out.toml --as-declared --json - -q {further}");
    let ended = bench.run(&line);
    assert_eq!(ended.status, Some(0), "{line}: {}", ended.stderr);
    let document: Value = serde_json::from_slice(&ended.stdout).unwrap();
    let all = document["parameters"].as_array().unwrap().iter();
    let known = all.filter_map(|p| Some((p, p["value"].as_f64()?, p["std"].as_f64()?)));
    known
        .map(|(p, value, std)| (format!("{} {}", p["name"], p["joint"]), value, std))
        .collect()
}

/// Asserts that two fits are the same but for some part of their standard deviations.
#[track_caller]
fn same(what: &str, of: &[(String, f64, f64)], as_before: &[(String, f64, f64)], tolerance: f64) {
    // a log in two parts loses rows between them, so that a parameter may become one that nothing
    // determines; what both tell is compared
    let same_names = tolerance > 0.1 || of.len() == as_before.len();
    assert!(same_names && 10 * of.len() > 9 * as_before.len(), "{what}");
    for (name, value, std) in of {
        let before = as_before.iter().find(|(as_name, _, _)| name == as_name);
        let Some((_, as_value, as_std)) = before else {
            assert!(tolerance > 0.1, "{what}: {name} is new");
            continue;
        };
        let off = (value - as_value).abs();
        assert!(
            off <= tolerance * as_std,
            "{what}: {name} {value} was {as_value} +- {as_std}"
        );
        assert!(
            tolerance > 0.1 || (std - as_std).abs() <= tolerance * as_std,
            "{what}: {name}"
        );
    }
}

#[test]
fn a_log_that_is_written_otherwise_gives_the_same_parameters() {
    for (log, robot, of_clock) in SETS {
        let Some(path) = shared(log) else { continue };
        let bench = Bench::new();
        bench.file(
            "robot.toml",
            cft_ident::config::embedded(robot.as_ref()).unwrap(),
        );
        let table = Table::read(&path);
        bench.file("log.csv", table.text());
        let plain = fitted(&bench, "log.csv", "robot.toml", "--threads 2");
        assert!(plain.len() >= 3, "{log}");

        let mut turned = table.clone();
        turned.rows.iter_mut().for_each(|row| row.reverse());
        bench.file("turned.csv", turned.text());
        for out in ["log.csv.gz", "log.csv.zst"] {
            let ended = bench.run(&format!("convert log.csv {out} -q"));
            assert_eq!(ended.status, Some(0), "{log} {out}: {}", ended.stderr);
        }
        let rows = table.rows.len() - 1;
        let half = rows / 2;
        bench.file("first.csv", table.part(0..half).text());
        bench.file("second.csv", table.part(half..rows).text());
        let joined = bench.run("convert first.csv second.csv joined.csv -q");
        assert_eq!(joined.status, Some(0), "{log}: {}", joined.stderr);
        bench.file("later.csv", table.changed(&["t"], |t| t + 1000.0).text());
        for (logs, further, tolerance) in [
            ("log.csv", "--threads 1", 0.0),
            ("log.csv", "--threads 7", 0.0),
            ("turned.csv", "", 0.0),
            ("log.csv.gz", "", 0.0),
            ("log.csv.zst", "", 0.0),
            ("joined.csv", "", 0.0),
            ("later.csv", "", of_clock),
            ("first.csv second.csv", "", 1.0),
        ] {
            let found = fitted(&bench, logs, "robot.toml", further);
            same(
                &format!("{log} as {logs} {further}"),
                &found,
                &plain,
                tolerance,
            );
        }
        // rows twice are no data: they are refused, and so is the log twice
        let mut twice = table.part(0..1000);
        twice.rows.insert(500, twice.rows[500].clone());
        bench.file("twice.csv", twice.text());
        bench.refuses(
            "lsq twice.csv -r robot.toml -o out2.toml",
            3,
            &["twice.csv:", "delete duplicate rows"],
        );
        bench.refuses(
            "lsq log.csv turned.csv log.csv -r robot.toml -o out2.toml",
            3,
            &["give each row once"],
        );
    }
}

#[test]
fn another_unit_a_mirrored_axis_and_another_container_give_the_same_parameters() {
    let Some(path) = shared("emps/emps_id.csv") else {
        return;
    };
    let bench = Bench::new();
    let robot = cft_ident::config::embedded("configs/emps.toml".as_ref())
        .unwrap()
        .to_owned();
    bench.file("robot.toml", &robot);
    let table = Table::read(&path);
    bench.file("log.csv", table.text());
    let plain = fitted(&bench, "log.csv", "robot.toml", "");
    let declared = |keys: &str| {
        let text = robot.replace("[log.joint.q1]\n", &format!("[log.joint.q1]\n{keys}\n"));
        assert!(text.contains(keys));
        text
    };
    bench.file("scaled.csv", table.changed(&["q1"], |q| 1024.0 * q).text());
    bench.file("scaled.toml", declared("position_scale = 0.0009765625"));
    same(
        "unit",
        &fitted(&bench, "scaled.csv", "scaled.toml", ""),
        &plain,
        0.0,
    );
    bench.file(
        "mirrored.csv",
        table.changed(&["q1", "tau1"], |x| -x).text(),
    );
    bench.file(
        "mirrored.toml",
        declared("position_sign = -1\ntorque_sign = -1"),
    );
    same(
        "mirrored",
        &fitted(&bench, "mirrored.csv", "mirrored.toml", ""),
        &plain,
        0.0,
    );
    // a recording has joints by their names, and times in whole nanoseconds
    let converted = bench.run("convert log.csv log.mcap -r robot.toml -q");
    assert_eq!(converted.status, Some(0), "{}", converted.stderr);
    let (begin, end) = (robot.find("[log.joint.q1]"), robot.find("[filter]"));
    bench.file(
        "plain.toml",
        format!("{}{}", &robot[..begin.unwrap()], &robot[end.unwrap()..]),
    );
    same(
        "recording",
        &fitted(&bench, "log.mcap", "plain.toml", ""),
        &plain,
        1e-6,
    );
    // not declared, it is the same machine seen from the other side: the offset alone turns
    let turned = fitted(&bench, "mirrored.csv", "robot.toml", "");
    let expected: Vec<(String, f64, f64)> = plain
        .iter()
        .map(|(name, value, std)| match name.contains("offset") {
            true => (name.clone(), -value, *std),
            false => (name.clone(), *value, *std),
        })
        .collect();
    same("seen from the other side", &turned, &expected, 1e-6);
}
