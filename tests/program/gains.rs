//! Currents of an arm: gains from a known payload, and what is said where there are none.

use crate::currents_arm;
use crate::serial_arm;

use std::fs;
use std::path::Path;

use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::identify::{
    Control, Dataset, ErrorKind, GainError, IdentifyError, Log, LsqSettings, PayloadLog,
    RobotSetup, fit_gains, lsq,
};
use cft_ident::log::LogSpec;
use currents_arm::{Chance, DECLARED, JOINTS, Payload, log, log_section, plant, robot_file};
use serial_arm::run;

const SECONDS: f64 = 15.0;

/// Gains of one run, up to 30 % off what is declared.
fn drawn(chance: &mut Chance) -> [f64; 4] {
    DECLARED.map(|g| g * (0.7 + 0.6 * chance.uniform()))
}

/// A log of the arm without a payload and one with it, in a folder.
fn logs(folder: &Path, seed: u64, noise: f64) -> ([f64; 4], Payload) {
    let mut chance = Chance::new(seed);
    let gains = drawn(&mut chance);
    let payload = Payload::drawn(&mut chance);
    let model = ModelFile::parse("plant.toml", &plant(noise).0).unwrap();
    for (name, with) in [("empty.csv", None), ("loaded.csv", Some(payload))] {
        let of = (&mut chance, SECONDS, 2 * seed + u64::from(with.is_some()));
        log(&folder.join(name), &model, (&gains, with), of);
    }
    (gains, payload)
}

fn machine(scales: Option<[f64; 4]>) -> RobotSetup {
    let text = robot_file(&log_section(scales));
    RobotSetup::new("arm.toml", RobotFile::parse("arm.toml", &text).unwrap())
}

fn of(folder: &Path, name: &str) -> Log {
    Log::from(LogSpec::whole(folder.join(name)))
}

fn gain_error(error: IdentifyError) -> GainError {
    match error {
        IdentifyError::Gains(error) => error,
        error => panic!("{error}"),
    }
}

#[test]
fn the_deviation_of_the_mass_is_that_of_all_gains() {
    let folder = tempfile::tempdir().unwrap();
    let (_, payload) = logs(folder.path(), 5, 0.02);
    let empty = [of(folder.path(), "empty.csv")];
    let fitted = |std: f64| {
        let known = PayloadLog {
            log: of(folder.path(), "loaded.csv"),
            mass: payload.mass,
            std: std * payload.mass,
        };
        fit_gains(
            &Dataset::read(&machine(None), &empty, &Control::default()).unwrap(),
            Some(&known),
            &Control::default(),
        )
        .unwrap()
    };
    let (exact, vague) = (fitted(0.0), fitted(0.1));
    for (a, b) in exact.gains.joints.iter().zip(&vague.gains.joints) {
        assert_eq!(a.value, b.value);
        let both = (a.std / a.value).hypot(0.1);
        assert!((b.std / b.value - both).abs() < 1e-12, "{a:?} {b:?}");
    }
}

#[test]
fn ratios_of_gains_show_without_a_payload_and_leave_the_model_in_amperes() {
    let folder = tempfile::tempdir().unwrap();
    let (gains, _) = logs(folder.path(), 7, 0.002);
    let empty = [of(folder.path(), "empty.csv")];
    let found = fit_gains(
        &Dataset::read(&machine(None), &empty, &Control::default()).unwrap(),
        None,
        &Control::default(),
    )
    .unwrap();
    let reference = found.gains.reference.clone().unwrap();
    let base = JOINTS.iter().position(|j| *j == reference).unwrap();
    for (gain, truth) in found.gains.joints.iter().zip(gains) {
        assert_eq!(gain.unit, "1");
        let off = gain.value - truth / gains[base];
        assert!(off.abs() <= 3.5 * gain.std, "{gain:?} {truth}");
    }
    let settings = LsqSettings {
        gains: Some(&found.gains),
        ..LsqSettings::default()
    };
    let fit = lsq(
        &Dataset::read(&found.setup, &empty, &Control::default()).unwrap(),
        &settings,
        &Control::default(),
    )
    .unwrap();
    let units: Vec<&str> = fit.unknowns.iter().map(|u| u.unit.as_str()).collect();
    assert!(
        units
            .iter()
            .all(|u| u.starts_with('A') && !u.contains("kg")),
        "{units:?}"
    );
}

#[test]
fn a_log_that_carries_no_load_and_exchanged_logs_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (_, payload) = logs(folder.path(), 9, 0.02);
    let tried = |empty: &str, loaded: &str| {
        let known = PayloadLog {
            log: of(folder.path(), loaded),
            mass: payload.mass,
            std: 0.0,
        };
        let empty = [of(folder.path(), empty)];
        gain_error(
            fit_gains(
                &Dataset::read(&machine(None), &empty, &Control::default()).unwrap(),
                Some(&known),
                &Control::default(),
            )
            .unwrap_err(),
        )
    };
    let same = tried("empty.csv", "empty.csv");
    assert!(matches!(same, GainError::NoLoad { .. }), "{same}");
    assert_eq!(same.kind(), ErrorKind::Undetermined);
    let exchanged = tried("loaded.csv", "empty.csv");
    assert!(
        matches!(exchanged, GainError::Exchanged { .. }),
        "{exchanged}"
    );
    assert_eq!(exchanged.kind(), ErrorKind::Input);
}

#[test]
fn a_joint_whose_channel_has_the_other_sign_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (_, payload) = logs(folder.path(), 11, 0.02);
    let section = log_section(None).replace(
        "torque = \"i_elbow\"",
        "torque = \"i_elbow\", torque_sign = -1.0",
    );
    let file = RobotFile::parse("arm.toml", &robot_file(&section)).unwrap();
    let known = PayloadLog {
        log: of(folder.path(), "loaded.csv"),
        mass: payload.mass,
        std: 0.0,
    };
    let empty = [of(folder.path(), "empty.csv")];
    let turned = RobotSetup::new("arm.toml", file);
    let error = fit_gains(
        &Dataset::read(&turned, &empty, &Control::default()).unwrap(),
        Some(&known),
        &Control::default(),
    )
    .unwrap_err();
    match gain_error(error) {
        GainError::Negative { joints, .. } => assert_eq!(joints, "elbow"),
        error => panic!("{error}"),
    }
}

/// Joints that share no parameter: a slide, and a turn about a vertical axis on it with all drives.
const APART: &str = r#"
[robot]
model = "serial"

[[robot.link]]
joint = "x"
kind = "prismatic"
axis = [1.0, 0.0, 0.0]
xyz = [0.0, 0.0, 0.0]

[[robot.link]]
joint = "y"
kind = "prismatic"
axis = [0.0, 1.0, 0.0]
xyz = [0.0, 0.0, 0.0]

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true

[log]
torque_is = "current"

[log.joint]
x = { torque_unit = "A" }
y = { torque_unit = "A" }

[filter]
cutoff_hz = 10.0
"#;

/// Currents of two slides at right angles, with loads of 0 and 5 kg: gains 4 and 9 N/A.
fn of_slides(folder: &Path) {
    for (name, load) in [("empty.csv", 0.0), ("loaded.csv", 5.0)] {
        let mut text = String::from("t,q_x,q_y,tau_x,tau_y\n");
        let mut chance = Chance::new(3);
        for k in 0..3000 {
            let t = f64::from(k) * 0.005;
            let slide = |w: f64, mass: f64, gain: f64, noise: f64| {
                let (q, v, a) = (
                    0.3 * (w * t).sin() + 0.1 * (2.7 * w * t).sin(),
                    0.3 * w * (w * t).cos() + 0.27 * w * (2.7 * w * t).cos(),
                    -0.3 * w * w * (w * t).sin() - 0.729 * w * w * (2.7 * w * t).sin(),
                );
                (
                    q,
                    (mass * a + 20.0 * v + 5.0 * v.signum()) / gain + 0.01 * noise,
                )
            };
            let (qx, ix) = slide(2.0, 30.0 + load, 4.0, chance.normal());
            let (qy, iy) = slide(2.6, 12.0 + load, 9.0, chance.normal());
            text += &format!("{t},{qx},{qy},{ix},{iy}\n");
        }
        fs::write(folder.join(name), text).unwrap();
    }
    fs::write(folder.join("arm.toml"), APART).unwrap();
}

#[test]
fn arms_in_amperes_are_refused_until_gains_are_given_or_fitted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    of_slides(path);
    let plain = ["lsq", "empty.csv", "-r", "arm.toml", "-o", "m.toml"];
    let with = |more: &[&str]| run(path, &[&plain[..], more].concat());

    let (status, message, _) = with(&[]);
    assert_eq!(status, 3, "{message}");
    for word in ["torque_scale", "--fit-gains", "--as-declared", "x, y"] {
        assert!(message.contains(word), "{word}: {message}");
    }
    assert!(!path.join("m.toml").exists());
    let (status, _, document) = run(path, &["inspect", "empty.csv", "-r", "arm.toml"]);
    assert_eq!(status, 0);
    assert_eq!(document["setup"][1]["kind"], "gains");
    assert_eq!(document["setup"][1]["joint"], "y");

    let (status, message, document) = with(&["--as-declared"]);
    assert_eq!(status, 0, "{message}");
    for parameter in document["parameters"].as_array().unwrap() {
        assert!(
            parameter["unit"].as_str().unwrap().starts_with('A'),
            "{parameter}"
        );
    }

    // nothing ties the slides to each other, but the load hangs on both: no gravity is needed
    let (status, message, _) = with(&["--fit-gains"]);
    assert_eq!(status, 4, "{message}");
    assert!(message.contains("ratios"), "{message}");
    let loaded = [
        "--fit-gains",
        "loaded.csv:mass=5+-0.05",
        "--fix-setup",
        "new.toml",
    ];
    let (status, message, document) = with(&loaded);
    assert_eq!(status, 0, "{message}");
    for (gain, truth) in document["gains"].as_array().unwrap().iter().zip([4.0, 9.0]) {
        let (value, std) = (
            gain["value"].as_f64().unwrap(),
            gain["std"].as_f64().unwrap(),
        );
        assert!(
            (value - truth).abs() < 3.5 * std && std < 0.03 * truth,
            "{gain}"
        );
        assert_eq!(gain["unit"], "N/A");
        assert_eq!(gain["verdict"], "identified");
    }
    let fixed = fs::read_to_string(path.join("new.toml")).unwrap();
    assert_eq!(fixed.matches("torque_scale = ").count(), 2, "{fixed}");
    let model = fs::read_to_string(path.join("m.toml")).unwrap();
    assert!(model.contains("unit = \"kg\""), "{model}");
    // the new file gives the same masses
    let again = ["lsq", "empty.csv", "-r", "new.toml", "-o", "again.toml"];
    let (status, message, same) = run(path, &again);
    assert_eq!(status, 0, "{message}");
    assert_eq!(
        same["parameters"][0]["value"],
        document["parameters"][0]["value"]
    );

    for (words, code) in [
        (&["--fit-gains", "loaded.csv:mass=0"][..], 2),
        (&["--fit-gains", "loaded.csv"], 2),
        (&["--fit-gains", "absent.csv:mass=1"], 3),
    ] {
        let (status, message, _) = with(words);
        assert_eq!(status, code, "{words:?}: {message}");
    }
}

#[test]
fn a_turn_about_the_vertical_shows_no_mass() {
    let folder = tempfile::tempdir().unwrap();
    of_slides(folder.path());
    let text = APART
        .replace("kind = \"prismatic\"\naxis = [1.0, 0.0, 0.0]", "axis = [0.0, 0.0, 1.0]")
        .replace("[[robot.link]]\njoint = \"y\"\nkind = \"prismatic\"\naxis = [0.0, 1.0, 0.0]\nxyz = [0.0, 0.0, 0.0]\n", "")
        .replace("y = { torque_unit = \"A\" }\n", "");
    let file = RobotFile::parse("turn.toml", &text).unwrap();
    let known = PayloadLog {
        log: of(folder.path(), "loaded.csv"),
        mass: 5.0,
        std: 0.0,
    };
    let empty = [of(folder.path(), "empty.csv")];
    let turn = RobotSetup::new("turn.toml", file);
    let error = fit_gains(
        &Dataset::read(&turn, &empty, &Control::default()).unwrap(),
        Some(&known),
        &Control::default(),
    )
    .unwrap_err();
    assert_eq!(gain_error(error), GainError::MassHidden);
}
