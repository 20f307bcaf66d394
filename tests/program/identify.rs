//! The library below the command line: arrays in memory give what a file gives, a callback stops a
//! stage and hears of its progress, and errors say what they are about.

use std::fmt::Write as _;
use std::sync::{Arc, Mutex};

use cft_ident::config::RobotFile;
use cft_ident::identify::{
    Control, Dataset, ErrorKind, GivenModel, IdentifiedDynamics, IdentifyError, Log, LsqSettings,
    Progress, RobotSetup, ValidateSettings, lsq, validate,
};
use cft_ident::log::LogSpec;
use cft_ident::validate::TorqueErrors;
use nalgebra::DMatrix;

/// A carriage on a screw: 3 kg, viscous 5 N s/m, Coulomb 2 N.
const ROBOT: &str = r#"
    robot = { model = "single-joint", joint = "q1", kind = "prismatic" }
    friction = { law = "viscous-coulomb", fitted_with_inertias = true }
"#;

fn robot() -> RobotSetup {
    RobotSetup::new("screw.toml", RobotFile::parse("screw.toml", ROBOT).unwrap())
}

/// Time, position and force, 8 s at 500 Hz.
fn motion() -> [Vec<f64>; 3] {
    let t: Vec<f64> = (0..4000).map(|k| 0.002 * f64::from(k)).collect();
    let waves = [(0.1, 2.1), (0.02, 7.3)];
    let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> Vec<f64> {
        t.iter()
            .map(|t| waves.iter().map(|(a, w)| of(*a, *w, *t)).sum())
            .collect()
    };
    let q = sum(&|a, w, t| a * (w * t).sin());
    let v = sum(&|a, w, t| a * w * (w * t).cos());
    let a = sum(&|a, w, t| -a * w * w * (w * t).sin());
    let force = v
        .iter()
        .zip(&a)
        .map(|(v, a)| 3.0 * a + 5.0 * v + 2.0 * v.signum());
    let force = force.collect();
    [t, q, force]
}

fn fitted(log: Log) -> Result<IdentifiedDynamics, Box<IdentifyError>> {
    let control = Control::default();
    let data = Dataset::read(&robot(), &[log], &control).map_err(Box::new)?;
    lsq(&data, &LsqSettings::default(), &control).map_err(Box::new)
}

#[test]
fn arrays_in_memory_give_what_a_file_of_them_gives() {
    let [t, q, tau] = motion();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("screw.csv");
    let mut text = "t,q_q1,tau_q1\n".to_owned();
    for ((t, q), tau) in t.iter().zip(&q).zip(&tau) {
        writeln!(text, "{t:?},{q:?},{tau:?}").unwrap();
    }
    std::fs::write(&path, text).unwrap();
    let of_file = fitted(LogSpec::whole(&path).into()).unwrap();
    let of_rows = fitted(Log::of_rows("screw", &t, &q, &tau).unwrap()).unwrap();
    let column = |x: &[f64]| DMatrix::from_column_slice(x.len(), 1, x);
    let of_matrices = Log::of_matrices("screw", &t, &column(&q), &column(&tau)).unwrap();
    let of_matrices = fitted(of_matrices).unwrap();
    assert_eq!(of_file.unknowns, of_rows.unknowns);
    assert_eq!(of_file.unknowns, of_matrices.unknowns);
    let mass = of_file.unknowns[0].fitted;
    assert!((mass - 3.0).abs() < 0.01, "{mass}");
    let [input] = of_rows.inputs.as_slice() else {
        panic!("one log, one input")
    };
    assert_eq!((input.name.as_str(), input.samples), ("screw", 4000));
    assert_eq!(input.sha256.len(), 64);
}

#[test]
fn a_model_that_was_fitted_is_validated_without_a_file() {
    let [t, q, tau] = motion();
    let robot = robot();
    let log = [Log::of_rows("screw", &t, &q, &tau).unwrap()];
    let control = Control::default();
    let found = lsq(
        &Dataset::read(&robot, &log, &Control::default()).unwrap(),
        &LsqSettings::default(),
        &control,
    )
    .unwrap();
    let model = GivenModel::new("model", found.model(&robot, None));
    let mut rows = 0;
    let data = Dataset::read(&robot, &log, &Control::default()).unwrap();
    let settings = ValidateSettings::of(&model);
    let validated = validate(&data, &settings, &control, &mut |_, _| rows += 1).unwrap();
    assert!(validated.validation.errors.joints[0].relative_error < 0.01);
    assert!(rows > 3000, "{rows}");
}

#[test]
fn fitted_logs_do_not_lend_their_error_to_unseen_ones() {
    let [t, q, tau] = motion();
    // the unseen log has a load that the model does not know
    let loaded: Vec<f64> = tau.iter().map(|tau| tau + 0.5).collect();
    let seen = Log::of_rows("seen", &t, &q, &tau).unwrap();
    let unseen = Log::of_rows("unseen", &t, &q, &loaded).unwrap();
    let (robot, control) = (robot(), Control::default());
    let settings = LsqSettings::default();
    let found = lsq(
        &Dataset::read(&robot, std::slice::from_ref(&seen), &Control::default()).unwrap(),
        &settings,
        &control,
    )
    .unwrap();
    let model = GivenModel::new("model", found.model(&robot, None));
    let on = |logs: &[Log]| {
        let (data, settings) = (
            Dataset::read(&robot, logs, &Control::default()).unwrap(),
            ValidateSettings::of(&model),
        );
        validate(&data, &settings, &control, &mut |_, _| {}).unwrap()
    };
    let alone = [
        on(std::slice::from_ref(&seen)),
        on(std::slice::from_ref(&unseen)),
    ];
    assert!(alone.iter().all(|found| found.by_use.is_none()));
    let error = |of: &TorqueErrors| of.joints[0].relative_error;
    let [on_seen, on_unseen] = alone.each_ref().map(|found| error(found.judged()));
    assert!(on_unseen > 3.0 * on_seen, "{on_unseen} {on_seen}");
    for logs in [[seen.clone(), unseen.clone()], [unseen, seen]] {
        let both = on(&logs);
        let by_use = both.by_use.as_ref().unwrap();
        assert_eq!(by_use.unseen.logs, ["unseen"]);
        assert_eq!(by_use.used.logs, ["seen"]);
        assert_eq!(error(both.judged()), on_unseen);
        assert_eq!(error(&by_use.used.errors), on_seen);
        let joints = [&by_use.used.errors, &both.validation.errors].map(|of| of.joints[0].clone());
        let alone = alone[0].judged().joints[0].clone();
        assert_eq!(joints[0].r2, alone.r2);
        // all rows together lie between
        assert_eq!(joints[1].samples, 2 * alone.samples);
        assert!(joints[1].relative_error > on_seen && joints[1].relative_error < on_unseen);
    }
}

#[test]
fn a_callback_stops_a_stage_and_hears_of_its_progress() {
    let [t, q, tau] = motion();
    let log = [Log::of_rows("screw", &t, &q, &tau).unwrap()];
    let said = Arc::new(Mutex::new(Vec::new()));
    let heard = Arc::clone(&said);
    let control = Control::default().reporting_to(move |progress| {
        if let Progress::Begin(work, _) = progress {
            heard.lock().unwrap().push(work.to_owned());
        }
    });
    lsq(
        &Dataset::read(&robot(), &log, &Control::default()).unwrap(),
        &LsqSettings::default(),
        &control,
    )
    .unwrap();
    assert_eq!(
        *said.lock().unwrap(),
        ["least squares", "reconstruction", "held-out data"]
    );
    let stopped = Control::default().stopped_by(|| true);
    let error = lsq(
        &Dataset::read(&robot(), &log, &Control::default()).unwrap(),
        &LsqSettings::default(),
        &stopped,
    )
    .err()
    .unwrap();
    assert_eq!(error.kind(), ErrorKind::Interrupted);
}

#[test]
fn errors_know_what_they_are_about() {
    let [t, q, tau] = motion();
    let kind = |log: Log| fitted(log).err().unwrap().kind();
    let mut wrong = q.clone();
    wrong[7] = f64::NAN;
    let log = Log::of_rows("screw", &t, &wrong, &tau).unwrap();
    assert_eq!(kind(log), ErrorKind::Input);
    let none = lsq(
        &Dataset::read(&robot(), &[], &Control::default()).unwrap(),
        &LsqSettings::default(),
        &Control::default(),
    );
    assert_eq!(none.err().unwrap().kind(), ErrorKind::Usage);
    assert!(Log::of_rows("screw", &t, &q, &tau[1..]).is_err());
}

#[test]
fn torques_of_a_controller_give_what_a_column_of_them_gives_and_its_faults_are_named() {
    let [t, q, tau] = motion();
    let [kp, kd] = [400.0, 30.0];
    let waves = [(0.1, 2.1), (0.02, 7.3)];
    let speed = |t: f64| -> f64 { waves.iter().map(|(a, w)| a * w * (w * t).cos()).sum() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("screw.csv");
    let mut text = "t,x,vx,x_goal,force\n".to_owned();
    for ((t, q), tau) in t.iter().zip(&q).zip(&tau) {
        let goal = q + (tau + kd * speed(*t)) / kp;
        writeln!(text, "{t:?},{q:?},{:?},{goal:?},{tau:?}", speed(*t)).unwrap();
    }
    std::fs::write(&path, &text).unwrap();
    let with = |torque: &str, columns: &str| {
        let text =
            format!("{ROBOT}\n[log]\n{torque}\n[log.joint.q1]\nposition = \"x\"\n{columns}\n");
        let file = RobotFile::parse("screw.toml", &text).map_err(|error| error.to_string())?;
        let robot = RobotSetup::new("screw.toml", file);
        let log: Log = LogSpec::whole(&path).into();
        let data = Dataset::read(&robot, &[log], &Control::default()).unwrap();
        lsq(&data, &LsqSettings::default(), &Control::default()).map_err(|error| error.to_string())
    };
    let plain = with(
        "torque_is = \"joint\"",
        "velocity = \"vx\"\ntorque = \"force\"",
    )
    .unwrap();
    let own = "velocity = \"vx\"\nreference = \"x_goal\"";
    for (torque, columns) in [
        (
            "torque = { pd = [400.0, 30.0], command = \"x_goal\" }",
            "velocity = \"vx\"",
        ),
        ("torque = { pd = [[400.0, 30.0]] }", own),
    ] {
        let found = with(torque, columns).unwrap();
        for (a, b) in found.unknowns.iter().zip(&plain.unknowns) {
            assert!(
                (a.fitted - b.fitted).abs() < 1e-6 * b.fitted.abs().max(1.0),
                "{torque}"
            );
        }
    }
    let commanded = |pd: &str| format!("torque = {{ pd = {pd}, command = \"x_goal\" }}");
    for (torque, columns, words) in [
        (commanded("[400.0, 30.0]"), "", "has none"),
        (commanded("[0.0, 30.0]"), own, "kp above 0"),
        (
            commanded("[[1.0, 1.0], [1.0, 1.0]]"),
            own,
            "a list of 1 such",
        ),
        (
            "torque = { pd = [1.0, 0.0] }".to_owned(),
            "",
            "names no command",
        ),
        (
            commanded("[1.0, 0.0]"),
            "torque = \"force\"",
            "keep one of the two",
        ),
        (
            commanded("[1.0, 0.0]"),
            "torque_sign = -1.0",
            "keep one of the two",
        ),
    ] {
        let message = with(&torque, columns).unwrap_err();
        assert!(message.contains(words), "{torque}: {message}");
    }
}
