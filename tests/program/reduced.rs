//! Reduced logs: a fit of them is the fit of the logs, however they are ordered and grouped, and bad ones are refused.

use crate::measured_support;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use cft_ident::config::campaign::EstimatorKind;
use cft_ident::config::model_file::Parameter;
use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::identify::{
    Control, Dataset, GivenModel, IdentifiedDynamics, Log, LsqSettings, ReducedLogs, RobotSetup,
    StageNote, ValidateSettings, Validated, lsq, new_model, reduce, validate,
};
use cft_ident::log::LogSpec;
use cft_ident::robot::friction::DoubleTanh;
use cft_ident::verdict::Verdict;
use measured_support::{run, shared};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const LAW: [f64; 5] = [4.5, 7.0, -2.5, 15.0, 6.0];

fn machine(text: &str) -> RobotSetup {
    RobotSetup::new("slide.toml", RobotFile::parse("slide.toml", text).unwrap())
}

/// A slide whose position cut-off is found from its logs.
fn slide() -> RobotSetup {
    machine(
        r#"
        robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
        friction = { law = "viscous-coulomb", fitted_with_inertias = true, offset = true }
        "#,
    )
}

fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0
}

/// A log of `seconds` at 200 Hz; `friction` gives the force at a speed.
fn log(seed: u64, seconds: f64, friction: &dyn Fn(f64) -> f64) -> Log {
    let mut noise = chance(seed);
    let size = 1.0 + 0.2 * seed as f64;
    let waves = [(0.11 * size, 1.9), (0.05, 4.7), (0.02, 9.1)];
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(200.0 * seconds) as usize {
        let now = k as f64 / 200.0;
        let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
        let phase = seed as f64;
        let v = sum(&|a, w| a * w * (w * now + phase).cos());
        let a = sum(&|a, w| -a * w * w * (w * now + phase).sin());
        t.push(now);
        q.push((sum(&|a, w| a * (w * now + phase).sin()) / 1e-5).round() * 1e-5);
        tau.push(12.0 * a + friction(v) + 0.3 * noise());
    }
    Log::of_rows(&format!("log{seed}.csv"), &t, &q, &tau).unwrap()
}

fn jump(v: f64) -> f64 {
    30.0 * v + 8.0 * v.signum() + 4.0
}

fn fitted(machine: &RobotSetup, logs: &[Log], settings: &LsqSettings) -> IdentifiedDynamics {
    lsq(
        &Dataset::read(machine, logs, &Control::default()).unwrap(),
        settings,
        &Control::default(),
    )
    .unwrap()
}

fn reduced(machine: &RobotSetup, logs: &[Log], friction: Option<&ModelFile>) -> ReducedLogs {
    let friction = friction.map(|model| GivenModel::new("friction.toml", model.clone()));
    let data = Dataset::read(machine, logs, &Control::default()).unwrap();
    reduce(&data, friction.as_ref(), &Control::default()).unwrap()
}

fn errors(machine: &RobotSetup, model: &ModelFile, logs: &[Log]) -> Validated {
    let given = GivenModel::new("model.toml", model.clone());
    let data = Dataset::read(machine, logs, &Control::default()).unwrap();
    let settings = ValidateSettings {
        free_run: true,
        ..ValidateSettings::of(&given)
    };
    validate(&data, &settings, &Control::default(), &mut |_, _| {}).unwrap()
}

/// By how much two fits differ: parameters and deviations in parts of themselves, or of the deviation where that is
/// larger; the residual of the fit's rows in parts of itself. The printed `joints` are those of a validation, which counts
/// every row of a log as it is: a reduced log holds them only as a fit weighs them.
fn apart(a: &IdentifiedDynamics, b: &IdentifiedDynamics) -> [f64; 3] {
    let mut apart = [0.0_f64; 3];
    assert_eq!(a.fit.theta.len(), b.fit.theta.len());
    for i in 0..a.fit.theta.len() {
        let [x, y] = [&a.fit, &b.fit].map(|fit| (fit.theta[i], fit.covariance[(i, i)].sqrt()));
        let size = x.0.abs().max(x.1);
        apart[0] = apart[0].max((x.0 - y.0).abs() / size);
        apart[1] = apart[1].max((x.1 / y.1 - 1.0).abs());
    }
    assert_eq!(a.fit.relative_error.len(), b.fit.relative_error.len());
    for (x, y) in a.fit.relative_error.iter().zip(&b.fit.relative_error) {
        apart[2] = apart[2].max((x.rms / y.rms - 1.0).abs());
    }
    apart
}

/// The same parameters and residuals: a part keeps fewer blocks for the deviations than a log has.
#[track_caller]
fn same_fit(part: &IdentifiedDynamics, log: &IdentifiedDynamics) {
    let [parameters, deviations, rms] = apart(part, log);
    assert!(parameters < 1e-9 && rms < 1e-12, "{parameters} {rms}");
    assert!(deviations < 1.5, "{deviations}");
}

/// The same, and the same deviations and printed errors.
#[track_caller]
fn alike(a: &IdentifiedDynamics, b: &IdentifiedDynamics) {
    let [parameters, deviations, rms] = apart(a, b);
    assert!(
        parameters < 1e-9 && deviations < 1e-9 && rms < 1e-12,
        "{parameters} {deviations} {rms}"
    );
    for (x, y) in a.joints.iter().zip(&b.joints) {
        let rmse = (x.rmse / y.rmse - 1.0).abs();
        assert!(rmse < 1e-12, "{rmse}");
    }
}

#[test]
fn any_order_and_any_grouping_of_reduced_logs_is_fitted_as_the_logs_are() {
    let machine = slide();
    let logs: Vec<Log> = (1..=3).map(|seed| log(seed, 40.0, &jump)).collect();
    {
        let estimator = EstimatorKind::Wls;
        let settings = LsqSettings {
            estimator,
            consistent: estimator == EstimatorKind::Wls,
            ..LsqSettings::default()
        };
        let whole = fitted(&machine, &logs, &settings);
        let backwards: Vec<Log> = logs.iter().rev().cloned().collect();
        alike(&fitted(&machine, &backwards, &settings), &whole);
        let together = reduced(&machine, &logs, None).as_logs();
        let of_parts = fitted(&machine, &together, &settings);
        same_fit(&of_parts, &whole);
        let one = reduced(&machine, &logs[1..2], None).as_logs();
        let others = reduced(&machine, &[logs[2].clone(), logs[0].clone()], None).as_logs();
        alike(
            &fitted(&machine, &[one.clone(), others].concat(), &settings),
            &of_parts,
        );
        let mixed = [vec![logs[2].clone()], one, vec![logs[0].clone()]].concat();
        same_fit(&fitted(&machine, &mixed, &settings), &whole);
    }
}

#[test]
fn the_number_of_threads_changes_no_byte_and_merging_is_associative() {
    let machine = slide();
    let logs: Vec<Log> = (1..=3).map(|seed| log(seed, 20.0, &jump)).collect();
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| reduced(&machine, &logs, None).to_bytes().unwrap())
    };
    let bytes = by(1);
    assert_eq!(by(3), bytes);
    let [a, b, c] = [0, 1, 2].map(|k| reduced(&machine, &logs[k..=k], None));
    let left = ReducedLogs::merge([a.clone(), b.clone()]).unwrap();
    let left = ReducedLogs::merge([left, c.clone()]).unwrap();
    let right = ReducedLogs::merge([c, b]).unwrap();
    let right = ReducedLogs::merge([right, a]).unwrap();
    assert_eq!(left.to_bytes().unwrap(), bytes);
    assert_eq!(right.to_bytes().unwrap(), bytes);
    let twice = ReducedLogs::merge([left.clone(), right.clone()]).unwrap_err();
    assert!(twice.to_string().contains("given twice"), "{twice}");
    let read = ReducedLogs::from_bytes("part.cfi", &bytes).unwrap();
    assert_eq!(read.to_bytes().unwrap(), bytes);
}

#[test]
fn friction_that_a_model_gave_is_held_and_its_uncertainty_stays_in_the_deviations() {
    let machine = machine(
        r#"
        robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
        friction = { law = "double-tanh" }
        "#,
    );
    let law = DoubleTanh::from_parameters(LAW);
    let logs: Vec<Log> = (1..=2)
        .map(|seed| log(seed, 30.0, &|v| law.torque(v)))
        .collect();
    let friction = |values: [f64; 5]| {
        let mut model = new_model(&machine, "friction", &[]);
        model.parameters = (0..5)
            .map(|k| Parameter {
                name: DoubleTanh::NAMES[k].to_owned(),
                theta: None,
                joint: Some("slide".to_owned()),
                value: values[k],
                consistent: None,
                std: Some(0.05 * values[k].abs()),
                unit: "1".to_owned(),
                meaning: String::new(),
                verdict: Some(Verdict::Identified),
            })
            .collect();
        let keys = DoubleTanh::NAMES.map(|name| format!("{name}:slide"));
        let variance = |a: usize, b: usize| match a == b {
            true => (0.05 * values[a]).powi(2),
            false => 0.0,
        };
        model.replace_covariance(&keys, &variance);
        model
    };
    let model = friction(LAW);
    let given = GivenModel::new("friction.toml", model.clone());
    let settings = |hold_friction| LsqSettings {
        friction: Some(&given),
        hold_friction,
        ..LsqSettings::default()
    };
    let whole = fitted(&machine, &logs, &settings(true));
    let parts = reduced(&machine, &logs, Some(&model)).as_logs();
    let of_parts = fitted(&machine, &parts, &settings(false));
    same_fit(&of_parts, &whole);
    let shown = |note: &StageNote| note.to_string().contains("--hold-friction");
    assert!(of_parts.notes.iter().any(shown), "{:?}", of_parts.notes);
    let std = whole.fit.covariance[(0, 0)].sqrt();
    assert!(std > 2.0 * whole.fit.textbook[(0, 0)].sqrt(), "{std}");
    // validation of the model that was fitted, by the parts and by the logs
    let model = of_parts.model(&machine, Some(&model));
    let errors = |logs: &[Log]| errors(&machine, &model, logs);
    let (a, b) = (errors(&parts), errors(&logs));
    // no motion begins where there are no rows
    assert!(a.free_run.is_none());
    let [a, b] = [&a, &b].map(|v| &v.validation.errors.joints[0]);
    assert!(a.max_abs.is_nan() && a.r2.is_nan() && a.relative_error_raw.is_nan());
    assert_eq!(a.samples, b.samples);
    let [a, b] = [a, b].map(|e| e.relative_error_moving.unwrap());
    assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    // other friction, and none
    let other = friction(LAW.map(|x| 1.01 * x));
    for (friction, word) in [(Some(&other), "other values"), (None, "")] {
        let given = friction.map(|f| GivenModel::new("other.toml", f.clone()));
        let settings = LsqSettings {
            friction: given.as_ref(),
            ..LsqSettings::default()
        };
        let error = lsq(
            &Dataset::read(&machine, &parts, &Control::default()).unwrap(),
            &settings,
            &Control::default(),
        )
        .unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn intervals_of_several_reduced_logs_cover() {
    let machine = slide();
    let truth = [12.0, 30.0, 8.0, 4.0];
    let (runs, mut covered) = (60, [0; 4]);
    for run in 0..runs {
        let logs: Vec<Log> = (0..3).map(|k| log(10 + 3 * run + k, 12.0, &jump)).collect();
        let found = fitted(
            &machine,
            &reduced(&machine, &logs, None).as_logs(),
            &LsqSettings::default(),
        );
        for (i, truth) in truth.into_iter().enumerate() {
            let std = found.fit.covariance[(i, i)].sqrt();
            covered[i] += u32::from((found.fit.theta[i] - truth).abs() < 1.96 * std);
        }
    }
    // of 60 draws of 0.95 fewer than 51 come in 0.2 % of all tests
    assert!(covered.iter().all(|c| *c >= 51), "{covered:?}");
}

fn tool(folder: &Path, line: &[&str], status: i32) -> String {
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(line)
        .arg("-q")
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(status), "{line:?}: {message}");
    message
}

#[test]
fn files_that_are_damaged_or_belong_elsewhere_are_refused_with_the_reason() {
    let Some(emps) = shared("emps/emps_id.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let emps = emps.to_string_lossy().into_owned();
    let robot = "configs/emps.toml";
    let half = format!("{emps}@0..50%");
    tool(at, &["reduce", &half, "-r", robot, "-o", "a.cfi"], 0);
    let bytes = std::fs::read(at.join("a.cfi")).unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(at.join(name), bytes).unwrap();
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    put("damaged.cfi", &damaged);
    put("short.cfi", &bytes[..bytes.len() - 100]);
    let mut format = bytes.clone();
    format[18] = 9;
    put("format.cfi", &format);
    let text = std::fs::read_to_string(Path::new(cft_ident_support::ROOT).join(robot)).unwrap();
    let text = text.replace("[robot]", "[limits]\nq1 = { torque = 900.0 }\n\n[robot]");
    put("limits.toml", text.as_bytes());
    put(
        "filter.toml",
        format!("{text}\n[noise]\ntorque_std = 1.0\n").as_bytes(),
    );
    for (line, status, words) in [
        ("lsq damaged.cfi -r ROBOT -o m.toml", 3, "damaged"),
        ("lsq short.cfi -r ROBOT -o m.toml", 3, "cut off"),
        ("lsq format.cfi -r ROBOT -o m.toml", 3, "format 9"),
        ("lsq a.cfi a.cfi -r ROBOT -o m.toml", 3, "holds rows that"),
        ("reduce a.cfi a.cfi -r ROBOT -o b.cfi", 3, "holds rows that"),
        ("lsq a.cfi HALF -r ROBOT -o m.toml", 3, "holds rows that"),
        ("lsq a.cfi -r configs/tx40.toml -o m.toml", 3, "joints"),
        (
            "lsq a.cfi -r configs/emps-symmetric.toml -o m.toml",
            3,
            "[friction] differs",
        ),
        ("lsq a.cfi@0..50% -r ROBOT -o m.toml", 2, "no spans"),
        ("lsq a.cfi -r ROBOT -o m.toml --estimator irls", 3, "irls"),
        ("lsq a.cfi -r ROBOT -o m.toml --estimator oe", 3, "oe"),
        ("inspect a.cfi", 3, "reduced logs"),
        ("friction a.cfi -r ROBOT -o m.toml", 3, "reduced logs"),
        ("lsq a.cfi -r limits.toml -o m.toml", 0, ""),
    ] {
        let words_of = line.replace("ROBOT", robot).replace("HALF", &half);
        let line: Vec<&str> = words_of.split(' ').collect();
        let message = tool(at, &line, status);
        let shown = message.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(shown.contains(words), "{line:?}: {shown}");
        assert_eq!(at.join("m.toml").exists(), status == 0, "{line:?}");
    }
    let message = tool(
        at,
        &["validate", "a.cfi", "-m", "m.toml", "--plot", "a.svg"],
        3,
    );
    assert!(message.contains("no rows of it"), "{message}");
    tool(at, &["validate", "a.cfi", "-m", "m.toml"], 0);
}

#[test]
fn measured_logs_keep_the_limits_of_size_and_give_the_same_numbers() {
    for (log, robot) in [
        ("emps/emps_id.csv", "configs/emps.toml"),
        ("ur10/ur10_exciting.csv", "configs/ur10.toml"),
        ("ur10/ur10_exciting.csv@0..15%", "configs/ur10.toml"),
    ] {
        let Some(path) = shared(log) else { continue };
        let machine = RobotSetup::load(robot).unwrap();
        let spec: LogSpec = path.to_string_lossy().parse().unwrap();
        let file = PathBuf::from(&spec.path);
        let logs = [Log::from(spec.clone())];
        let parts = reduced(&machine, &logs, None);
        let bytes = parts.to_bytes().unwrap().len() as u64;
        let whole = std::fs::metadata(file).unwrap().len();
        let share = if log.contains('@') { 0.15 } else { 1.0 };
        assert!(bytes < 3_000_000, "{log}: {bytes}");
        assert!(
            (bytes as f64) < 0.5 * share * whole as f64,
            "{log}: {bytes} of {whole}"
        );
        let [of_log, of_part] =
            [&logs[..], &parts.as_logs()].map(|l| fitted(&machine, l, &LsqSettings::default()));
        same_fit(&of_part, &of_log);
        // the model of a part judged by the part, and by the log
        let model = of_part.model(&machine, None);
        let errors = |logs: &[Log]| errors(&machine, &model, logs);
        let (a, b) = (errors(&parts.as_logs()), errors(&logs));
        for (a, b) in a
            .validation
            .errors
            .joints
            .iter()
            .zip(&b.validation.errors.joints)
        {
            // the rows as a fit weighs them: of the others a reduced log keeps nothing
            let [a, b] = [a, b].map(|e| e.relative_error_moving.unwrap());
            assert!((a / b - 1.0).abs() < 1e-9, "{log}");
        }
    }
}

#[test]
fn the_document_of_a_part_is_that_of_its_log() {
    let Some(emps) = shared("emps/emps_id.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let emps = emps.to_string_lossy().into_owned();
    let robot = "configs/emps.toml";
    let made = run(
        folder.path(),
        &["reduce", &emps, "-r", robot, "-o", "emps.cfi"],
    );
    assert_eq!(made["logs"][0]["name"], "emps_id.csv");
    let blocks = made["logs"][0]["blocks"].as_u64().unwrap();
    assert!((100..=512).contains(&blocks), "{blocks}");
    let of_log = run(folder.path(), &["lsq", &emps, "-r", robot, "-o", "a.toml"]);
    let of_part = run(
        folder.path(),
        &["lsq", "emps.cfi", "-r", robot, "-o", "b.toml"],
    );
    for key in ["rank", "position_cutoffs", "inputs"] {
        assert_eq!(of_part[key], of_log[key], "{key}");
    }
    // of a log's rows at rest a part keeps nothing; those that move are summed in another order
    let [part, log] = [&of_part, &of_log].map(|of| &of["joints"][0]);
    for key in ["joint", "unit"] {
        assert_eq!(part[key], log[key], "{key}");
    }
    let [part, log] = [part, log].map(|of| of["relative_error_moving"].as_f64().unwrap());
    assert!((part / log - 1.0).abs() < 1e-12, "{part} {log}");
    for kind in ["raw", "normalised"] {
        let of = |document: &serde_json::Value| document["condition"][kind].as_f64().unwrap();
        let ratio = of(&of_part) / of(&of_log);
        assert!((ratio - 1.0).abs() < 1e-12, "{kind}: {ratio}");
    }
}
