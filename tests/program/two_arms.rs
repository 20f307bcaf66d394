//! Two arms on one base from their URDF to a model: 14 joints that share no chain.

use crate::serial_arm;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cft_ident::config::RobotFile;
use serde_json::Value;
use serial_arm::done;

const JOINTS: [&str; 7] = [
    "shoulder_turn",
    "shoulder_lift",
    "upper_turn",
    "elbow",
    "fore_turn",
    "wrist_lift",
    "wrist_turn",
];

fn joints() -> Vec<String> {
    let of = |side: &'static str| JOINTS.map(|joint| format!("{side}_{joint}"));
    [of("left"), of("right")].concat()
}

/// A motion of all joints at once, within their limits; `seed` turns it into another one.
fn motion(seed: f64) -> String {
    let mut out =
        String::from("kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.2\n");
    for (j, joint) in joints().iter().enumerate() {
        let of = |shift: f64| {
            let term = |l: u32| 0.45 * (1.7 * j as f64 + 2.3 * f64::from(l) + shift + seed).sin();
            (1..=4)
                .map(|l| format!("{:.4}", term(l)))
                .collect::<Vec<_>>()
                .join(", ")
        };
        let _ = write!(
            out,
            "\n[[coordinate]]\nname = \"{joint}\"\noffset = 0.0\na = [{}]\nb = [{}]\n",
            of(0.0),
            of(0.9)
        );
    }
    out
}

/// The model whose links are those of the URDF: drive inertias and friction beside it.
fn truth(robot: &str) -> String {
    let mut out = robot.to_owned();
    for (j, joint) in joints().iter().enumerate() {
        let size = 1.0 - 0.1 * (j % 7) as f64;
        for (name, value) in [
            ("drive_inertia", 0.12 * size),
            ("viscous", 1.5 * size),
            // small: the simulator's joints come to rest within 1/2000 s, a fit's law has a jump there
            ("coulomb", 0.1 * size),
            // the robot file has one, and a model file that lacks it has lost it
            ("offset", 0.0),
        ] {
            let _ = write!(
                out,
                "\n[[parameter]]\nname = \"{name}\"\njoint = \"{joint}\"\nvalue = {value:?}\nunit = \"SI\"\n"
            );
        }
    }
    out
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} of {v}"))
}

#[test]
fn a_pair_of_arms_goes_from_its_urdf_to_a_model_that_predicts_unseen_motion() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let urdf = Path::new(cft_ident_support::ROOT).join("fixtures/urdf/two_arms.urdf");
    fs::copy(urdf, path.join("two_arms.urdf")).unwrap();
    let found = done(path, &["new", "robot.toml", "--urdf", "two_arms.urdf"]);
    assert_eq!(found["joints"].as_array().unwrap().len(), 14);
    let mut robot = fs::read_to_string(path.join("robot.toml")).unwrap();
    robot += "\n[sensors]\ntorque_noise_relative = 0.002\n";
    fs::write(path.join("robot.toml"), &robot).unwrap();
    fs::write(path.join("truth.toml"), truth(&robot)).unwrap();
    for (log, seed, seconds) in [("fit", 0.0, "16"), ("unseen", 2.0, "6")] {
        let (reference, log) = (format!("{log}.toml"), format!("{log}.csv"));
        fs::write(path.join(&reference), motion(seed)).unwrap();
        let words = [
            "--reference",
            &reference,
            "--seconds",
            seconds,
            "--seed",
            "1",
        ];
        serial_arm::simulate(path, &log, &words);
    }
    let fit = done(
        path,
        &["lsq", "fit.csv", "-r", "robot.toml", "-o", "m.toml"],
    );
    let base = RobotFile::load(&path.join("robot.toml")).unwrap().robot();
    // base parameters, viscous and Coulomb friction and a constant torque a joint
    let unknowns = fit["parameters"].as_array().unwrap().len();
    assert_eq!(unknowns, base.parameters().len() + 3 * 14);
    let errors = done(path, &["validate", "unseen.csv", "-m", "m.toml"]);
    let error = number(&errors["overall"], "mean_relative_error");
    eprintln!("unseen: {error:.1e}");
    assert!(error < 0.01, "{error}");
}
