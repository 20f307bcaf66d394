//! Faults of a set-up are named, mended and, where the user says so, kept; a right one says nothing.

mod motors;

use crate::measured_support;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use measured_support::{run, shared};
use serde_json::Value;

/// A log of columns, altered and written.
struct Log {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Log {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let split = |line: &str| -> Vec<String> {
            line.split(',').map(|cell| cell.trim().to_owned()).collect()
        };
        Self {
            names: split(lines.next().unwrap()),
            rows: lines
                .map(|line| {
                    line.split(',')
                        .map(|cell| cell.trim().parse().unwrap())
                        .collect()
                })
                .collect(),
        }
    }

    fn column(&self, name: &str) -> usize {
        self.names
            .iter()
            .position(|known| known == name)
            .expect(name)
    }

    fn map(&mut self, name: &str, f: impl Fn(f64) -> f64) -> &mut Self {
        let j = self.column(name);
        self.rows.iter_mut().for_each(|row| row[j] = f(row[j]));
        self
    }

    fn swap(&mut self, a: &str, b: &str) -> &mut Self {
        let (a, b) = (self.column(a), self.column(b));
        self.rows.iter_mut().for_each(|row| row.swap(a, b));
        self
    }

    fn write(&self, path: &Path) {
        let mut text = self.names.join(",") + "\n";
        for row in &self.rows {
            let row: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
            text += &(row.join(",") + "\n");
        }
        std::fs::write(path, text).unwrap();
    }
}

/// A folder with an altered log in it.
struct Altered {
    folder: tempfile::TempDir,
    robot: PathBuf,
}

impl Altered {
    fn new(log: &Path, robot: &str, alter: impl Fn(&mut Log)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut altered = Log::read(log);
        alter(&mut altered);
        altered.write(&folder.path().join("log.csv"));
        let robot = Path::new(cft_ident_support::ROOT).join(robot);
        Self { folder, robot }
    }

    fn words<'a>(&'a self, command: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        let mut words = vec![command, "log.csv", "-r", self.robot.to_str().unwrap()];
        if command != "inspect" {
            words.extend(["-o", "m.toml"]);
        }
        words.extend(more);
        words
    }

    /// The entries of the key `setup`, by none of which the error of a joint rises.
    fn findings(&self) -> Vec<Value> {
        let found = run(self.folder.path(), &self.words("inspect", &[]));
        let findings = found["setup"].as_array().unwrap().clone();
        for entry in &findings {
            for joint in entry["joints"].as_array().unwrap() {
                let [before, after] = ["before", "after"].map(|key| joint[key].as_f64());
                assert!(before.is_none() || after <= before, "{entry}");
            }
        }
        findings
    }

    /// Standard error of a fit that is refused, which writes nothing.
    fn refused(&self) -> String {
        let output = Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(self.folder.path())
            .args(self.words("lsq", &["-q"]))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(3));
        assert!(!self.folder.path().join("m.toml").exists());
        String::from_utf8_lossy(&output.stderr).into_owned()
    }

    fn mended(&self) -> Value {
        run(
            self.folder.path(),
            &self.words("lsq", &["--fix-setup", "new.toml"]),
        )
    }
}

fn short(finding: &Value) -> (&str, &str, &str, bool) {
    let text = |key: &str| finding[key].as_str().unwrap_or("");
    (
        text("kind"),
        text("channel"),
        text("joint"),
        finding["sure"].as_bool().unwrap(),
    )
}

/// Parameters of two fits, each within a deviation of the other.
fn assert_alike(a: &Value, b: &Value) {
    for (a, b) in a["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .zip(b["parameters"].as_array().unwrap())
    {
        let (Some(x), Some(y), Some(std)) =
            (a["value"].as_f64(), b["value"].as_f64(), b["std"].as_f64())
        else {
            continue;
        };
        assert!((x - y).abs() <= std, "{} {x} {y} +- {std}", a["name"]);
    }
}

#[test]
#[ignore = "measured logs, up to a minute; `cargo test -- --ignored`"]
fn right_set_ups_of_measured_machines_say_nothing() {
    for (log, robot) in [
        ("ur10/ur10_exciting.csv", "configs/ur10.toml"),
        ("ur10/ur10_exciting.csv@0..50%", "configs/ur10.toml"),
        ("panda/panda_exciting.csv", "configs/panda.toml"),
        ("tx40/tx40_joint.csv", "configs/tx40.toml"),
        ("emps/emps_id.csv", "configs/emps.toml"),
        ("emps/emps_pulses_val.csv", "configs/emps.toml"),
        ("bldc-cogging/speed_test1.txt", "configs/bldc.toml"),
        ("bldc-cogging/speed_test1.txt@0..50%", "configs/bldc.toml"),
        ("kr300/A.csv", "configs/kr300.toml"),
        ("kr300/C.csv", "configs/kr300.toml"),
        ("pendulum/061157.csv", "configs/pendulum.toml"),
    ] {
        let Some(log) = shared(log) else { continue };
        let folder = tempfile::tempdir().unwrap();
        let found = run(
            folder.path(),
            &["inspect", log.to_str().unwrap(), "-r", robot],
        );
        let findings = found["setup"].as_array().unwrap();
        // the wrist of the TX40 is coupled, which is no mistake of the list: these data cannot tell, and say so
        let open = |t: &Value| t["kind"] == "undecided" && t["severity"] == "hint";
        let coupled = robot.contains("tx40");
        assert!(
            findings.iter().all(|t| coupled && open(t)),
            "{log:?} {findings:?}"
        );
        assert!(!coupled || !findings.is_empty(), "{log:?}");
    }
}

#[test]
fn a_turned_torque_is_refused_mended_and_kept_where_the_user_says_so() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let turned = Altered::new(&log, "configs/ur10.toml", |log| {
        log.map("tau3", |x| -x);
    });
    let message = turned.refused();
    assert!(message.contains("torque_sign = -1.0"), "{message}");
    assert!(
        message.contains("--fix-setup") && message.contains("--as-declared"),
        "{message}"
    );
    let mended = turned.mended();
    let right = Altered::new(&log, "configs/ur10.toml", |_| {});
    let unchanged = run(right.folder.path(), &right.words("lsq", &[]));
    assert_eq!(unchanged["setup"], Value::Array(Vec::new()));
    assert_eq!(short(&mended["setup"][0]), ("sign", "torque", "q3", true));
    assert_alike(&mended, &unchanged);
    // the user's own text with one key more
    let text = std::fs::read_to_string(turned.folder.path().join("new.toml")).unwrap();
    assert!(
        text.starts_with("# UR10") && text.contains("q3 = { torque_sign = -1.0,"),
        "{text}"
    );
    let kept = run(
        turned.folder.path(),
        &turned.words("lsq", &["--as-declared"]),
    );
    // the torques are not asked, and the model remembers it
    assert_eq!(kept["setup"], Value::Array(Vec::new()));
    let model = std::fs::read_to_string(turned.folder.path().join("m.toml")).unwrap();
    assert!(model.contains("as_declared = true"), "{model}");
    assert!(
        kept["joints"][2]["relative_error"].as_f64()
            > unchanged["joints"][2]["relative_error"].as_f64()
    );
}

#[test]
fn one_axis_with_a_turned_torque_is_shown_by_physics_with_both_readings() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let turned = Altered::new(&log, "configs/emps.toml", |log| {
        log.map("tau1", |x| -x);
    });
    let findings = turned.findings();
    assert_eq!(short(&findings[0]), ("sign", "torque", "q1", true));
    assert_eq!(findings[0]["tied_with"][0]["channel"], "position");
    assert_eq!(
        findings[0]["error_before"].as_f64(),
        findings[0]["error_after"].as_f64()
    );
    let mended = turned.mended();
    assert!(mended["parameters"][0]["value"].as_f64().unwrap() > 90.0);
}

#[test]
fn all_torques_turned_leave_the_same_residual_and_are_shown_by_physics() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let turned = Altered::new(&log, "configs/ur10.toml", |log| {
        for j in 1..=6 {
            log.map(&format!("tau{j}"), |x| -x);
        }
    });
    let findings = turned.findings();
    assert_eq!(findings.len(), 6, "{findings:?}");
    assert!(
        findings
            .iter()
            .all(|t| (short(t).0, short(t).1) == ("sign", "torque"))
    );
}

#[test]
fn exchanged_channels_and_wrong_units_are_named_with_their_joint() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let findings =
        |alter: &dyn Fn(&mut Log)| Altered::new(&log, "configs/ur10.toml", alter).findings();
    let exchanged = findings(&|log| {
        log.swap("tau1", "tau2");
    });
    assert_eq!(short(&exchanged[0]), ("order", "torque", "q1", true));
    assert_eq!(exchanged[0]["with"], "q2");
    let degrees = findings(&|log| {
        log.map("q2", f64::to_degrees);
    });
    assert_eq!(short(&degrees[0]), ("scale", "position", "q2", true));
    assert!(
        degrees[0]["remedy"]
            .as_str()
            .unwrap()
            .contains("position_unit = \"deg\"")
    );
}

#[test]
fn an_arm_whose_gravity_is_declared_along_the_wrong_axis_gets_the_right_one() {
    let Some(log) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string("configs/panda.toml").unwrap();
    let wrong = text.replace(
        "drive_inertia",
        "gravity = [9.81, 0.0, 0.0] # on a wall\ndrive_inertia",
    );
    std::fs::write(folder.path().join("wall.toml"), wrong).unwrap();
    let words = ["inspect", log.to_str().unwrap(), "-r", "wall.toml"];
    let findings = run(folder.path(), &words)["setup"][0].clone();
    assert_eq!(short(&findings), ("gravity", "", "", true));
    let found: Vec<f64> = findings["found"]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect();
    assert!(found[2] < -9.7, "{found:?}");
}

#[test]
fn a_diagnosis_of_a_log_with_a_turned_torque_is_refused_with_the_line() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let right = Altered::new(&log, "configs/ur10.toml", |_| {});
    run(right.folder.path(), &right.words("lsq", &[]));
    let turned = Altered::new(&log, "configs/ur10.toml", |log| {
        log.map("tau2", |x| -x);
    });
    let model = right.folder.path().join("m.toml");
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(turned.folder.path())
        .args(["diagnose", "log.csv", "-m", model.to_str().unwrap()])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("`torque_sign = -1.0` in [log.joint.q2]"),
        "{message}"
    );
}

/// Adds to each torque what changes every 25 rows and is half of that torque, by its root mean square.
fn disturb(log: &mut Log) {
    let mut seed = 7_u64;
    for joint in 1..=6 {
        let j = log.column(&format!("tau{joint}"));
        let square: f64 = log.rows.iter().map(|row| row[j] * row[j]).sum();
        let rms = (square / log.rows.len() as f64).sqrt();
        let mut added = 0.0;
        for (k, row) in log.rows.iter_mut().enumerate() {
            if k % 25 == 0 {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let chance = (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                added = 0.5 * rms * 12.0_f64.sqrt() * chance;
            }
            row[j] += added;
        }
    }
}

#[test]
fn what_leaves_more_than_sound_machines_do_is_a_warning_with_both_readings_and_the_fit_goes_on() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let turned = Altered::new(&log, "configs/ur10.toml", |log| {
        log.map("tau2", |x| -x);
        disturb(log);
    });
    // status 0, and no robot file that is right by the torques
    let fit = turned.mended();
    let findings = &fit["setup"];
    assert_eq!(findings.as_array().map(Vec::len), Some(1), "{findings}");
    assert_eq!(short(&findings[0]), ("sign", "torque", "q2", false));
    assert_eq!(findings[0]["severity"], "warning");
    assert!(
        findings[0]["error_after"].as_f64() > Some(0.33),
        "{findings}"
    );
    assert!(!turned.folder.path().join("new.toml").exists());
    let warnings = fit["warnings"].to_string();
    for reading in [
        "torque_sign = -1.0",
        "the set-up as declared is possible too",
    ] {
        assert!(warnings.contains(reading), "{warnings}");
    }
}

#[test]
fn a_zero_that_no_torque_shows_is_named_by_the_limits_of_the_file() {
    let Some(log) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let turned = |by: f64| {
        Altered::new(&log, "configs/panda.toml", |log| {
            log.map("q7", |q| q + by);
        })
    };
    // links of a last joint that turn with its zero fit as well
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut log = turned(-quarter);
    assert!(log.findings().is_empty());
    let limits = "\n[limits.q7]\nposition = [-2.8973, 2.8973]\n";
    let with_limits = |log: &mut Altered| {
        let robot = log.folder.path().join("robot.toml");
        let text = std::fs::read_to_string(&log.robot).unwrap() + limits;
        std::fs::write(&robot, text).unwrap();
        log.robot = robot;
    };
    with_limits(&mut log);
    let findings = &log.findings()[0];
    assert_eq!(short(findings), ("zero", "position", "q7", false));
    let readings = findings["tied_with"].to_string() + &findings["remedy"].to_string();
    assert!(readings.contains("position_offset = 1.57079"), "{findings}");
    let mut right = turned(0.0);
    with_limits(&mut right);
    assert!(right.findings().is_empty());
}

#[test]
fn a_factor_that_is_no_ratio_is_an_estimate_and_a_ratio_is_written() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let findings = |factor: f64| {
        Altered::new(&log, "configs/ur10.toml", |log| {
            log.map("tau2", |x| x / factor);
        })
        .findings()
    };
    let estimate = &findings(7.23)[0];
    assert_eq!(short(estimate), ("scale", "torque", "q2", false));
    assert_eq!(
        (&estimate["severity"], &estimate["remedy"]),
        (&"hint".into(), &"".into())
    );
    let [found, std] = ["found", "found_std"].map(|key| estimate[key].as_f64().unwrap());
    assert!(
        (found - 7.23).abs() < 3.0 * std.max(0.02 * found),
        "{estimate}"
    );
    let thousand = &findings(1e3)[0];
    assert_eq!(short(thousand), ("scale", "torque", "q2", true));
    assert!(
        thousand["remedy"]
            .as_str()
            .unwrap()
            .contains("torque_scale = 1000.0"),
        "{thousand}"
    );
}

#[test]
fn a_ratio_among_several_that_fit_alike_is_a_warning_with_all_of_them() {
    let Some(log) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let geared = Altered::new(&log, "configs/ur10.toml", |log| {
        log.map("q3", |x| x * 50.0);
    });
    let findings = &geared.findings()[0];
    assert_eq!(short(findings), ("scale", "position", "q3", false));
    // the motion tells the ratio to two percent: 49.5 and 50 are both in it
    let readings = findings["tied_with"].to_string() + &findings["remedy"].to_string();
    assert!(readings.contains("position_scale = 0.02`"), "{readings}");
}

/// A log of commanded torques of a joint (0.03 kg m^2, 0.25 Nm s/rad, 0.5 Nm) whose drive gives no more than 1.1 Nm.
fn asked_for_more_than_is_given(folder: &std::path::Path) {
    let (inertia, viscous, coulomb, most) = (0.03, 0.25, 0.5, 1.1);
    let (mut q, mut v, h) = (0.0_f64, 0.0_f64, 1e-4);
    let mut text = "time,position,torque\n".to_owned();
    let target = |t: f64| 0.25 * (1.3 * t).sin() + 0.15 * (4.1 * t).sin();
    for k in 0..30 * 250 {
        let t = f64::from(k) * 0.004;
        // steps that the drive cannot follow, every 5 s
        let step = if t % 5.0 < 0.4 { 0.4 } else { 0.0 };
        let tau = 12.0 * (target(t) + step - q) - 0.1 * v;
        let noise = 1e-3 * f64::from(k * 7919 % 101 - 50) / 50.0;
        text += &format!("{t},{q:.6},{:.4}\n", tau + noise);
        let given = tau.clamp(-most, most);
        for _ in 0..40 {
            if v == 0.0 && given.abs() <= coulomb {
                continue;
            }
            let against = if v == 0.0 { given.signum() } else { v.signum() };
            let next = v + h * (given - viscous * v - coulomb * against) / inertia;
            v = if v != 0.0 && next * v <= 0.0 {
                0.0
            } else {
                next
            };
            q += h * v;
        }
    }
    std::fs::write(folder.join("a.csv"), text).unwrap();
    let robot = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"revolute\"\n\n\
        [friction]\nlaw = \"viscous-coulomb\"\nfitted_with_inertias = true\noffset = true\n\n\
        [log]\ntime = \"time\"\ntorque_is = \"joint\"\n\n\
        [log.joint.q1]\nposition = \"position\"\ntorque = \"torque\"\n\n[filter]\ncutoff_hz = 20\n";
    std::fs::write(folder.join("a.toml"), robot).unwrap();
}

#[test]
fn torques_that_a_drive_does_not_deliver_are_named_with_their_limit_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    asked_for_more_than_is_given(folder.path());
    let lsq = ["lsq", "a.csv", "-r", "a.toml", "-o", "m.toml"];
    let found = measured_support::run(folder.path(), &lsq);
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("saturation of q1"), "{warnings}");
    let of = |name: &str| {
        let all = found["parameters"].as_array().unwrap();
        let own = all.iter().find(|p| p["name"] == name).unwrap();
        own["value"].as_f64().unwrap_or(f64::NAN)
    };
    assert!((of("inertia") - 0.03).abs() < 2e-3, "{found}");
    assert!((of("viscous") - 0.25).abs() < 0.02, "{found}");
    assert!((of("coulomb") - 0.5).abs() < 0.02, "{found}");
    // the model remembers it
    let text = std::fs::read_to_string(folder.path().join("m.toml")).unwrap();
    let model: toml::Value = toml::from_str(&text).unwrap();
    let limit = model["log"]["joint"]["q1"]["torque_limit"].as_float();
    assert!(
        limit.is_some_and(|limit| (0.8..1.3).contains(&limit)),
        "{text}"
    );
    // and without it the rows spoil the fit
    let kept = [&lsq[..], &["--as-declared"]].concat();
    let kept = measured_support::run(folder.path(), &kept);
    assert!(!kept["warnings"].to_string().contains("saturation of q1"));
    assert!(kept["joints"][0]["relative_error_moving"].as_f64().unwrap() > 0.25);
}
