//! Measured arms through `lsq` and `validate`, beside what others got from the same logs; and what the
//! committed diagnoses of them say. Skipped aloud where ../shared/data is not there.

use crate::measured_support;

use measured_support::{run, shared};
use serde_json::Value;

/// Fits on one span and judges on another: errors per joint in per cent, and the document.
fn fitted(robot: &str, more: &[&str], log: &str, fit: &str, unseen: &str) -> (Vec<f64>, Value) {
    let folder = tempfile::tempdir().unwrap();
    let (fit, unseen) = (format!("{log}{fit}"), format!("{log}{unseen}"));
    // others fit without asking what bodies can be
    let mut words = vec![
        "lsq",
        &fit,
        "-r",
        robot,
        "-o",
        "model.toml",
        "--unconstrained",
    ];
    words.extend(more);
    run(folder.path(), &words);
    let found = run(folder.path(), &["validate", &unseen, "-m", "model.toml"]);
    (errors(&found, "relative_error"), found)
}

/// One kind of error of every joint in per cent.
fn errors(found: &Value, kind: &str) -> Vec<f64> {
    let joints = found["joints"].as_array().unwrap();
    let error = |j: &Value| 100.0 * j[kind].as_f64().unwrap();
    joints.iter().map(error).collect()
}

/// Each error is at most the limit, both to the limit's one decimal.
#[track_caller]
fn assert_at_most(errors: &[f64], limits: &[f64]) {
    assert_eq!(errors.len(), limits.len());
    for (error, limit) in errors.iter().zip(limits) {
        let shown = (10.0 * error).round() / 10.0;
        assert!(shown <= *limit, "{errors:.2?} against {limits:?}");
    }
}

#[test]
#[ignore = "measured logs, up to a minute; `cargo test -- --ignored`"]
fn the_tx40_is_as_others_have_it_without_and_with_the_coupling_of_its_wrist() {
    let Some(log) = shared("tx40/tx40_joint.csv") else {
        return;
    };
    let log = log.to_str().unwrap();
    // The arm rests for 17 to 19 % of the time. Others fitted those rows too; here they are not fitted, so that
    // the rows that are fitted stand beside the published figures.
    let (_, plain) = fitted("configs/tx40.toml", &[], log, "", "");
    let moving = errors(&plain, "relative_error_moving");
    assert_at_most(&moving, &[5.9, 7.1, 9.4, 11.5, 53.5, 32.2]);

    let text = std::fs::read_to_string("configs/tx40.toml").unwrap();
    let coupling = "[[robot.coupling]]\nmotor = \"q6\"\nother = \"q5\"\nratio = 1.0\n\n[friction]";
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("coupled.toml");
    std::fs::write(&robot, text.replace("[friction]", coupling)).unwrap();
    let (_, coupled) = fitted(robot.to_str().unwrap(), &[], log, "", "");
    let moving = errors(&coupled, "relative_error_moving");
    assert_at_most(&moving, &[5.9, 7.0, 9.6, 11.6, 14.2, 13.9]);
}

#[test]
fn the_panda_is_at_one_and_a_half_per_cent() {
    let Some(log) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let log = log.to_str().unwrap();
    let robot = "configs/panda.toml";
    let (_, found) = fitted(robot, &["--estimator", "ols"], log, "", "");
    let overall = found["overall"]["relative_error"].as_f64().unwrap();
    assert!(overall <= 0.015, "{overall}");
}

#[test]
fn the_ur10_is_as_others_have_it_on_what_was_not_fitted() {
    let Some(log) = shared("ur10/ur10_exciting_trajectory.mcap") else {
        return;
    };
    let log = log.to_str().unwrap();
    // As with the TX40: samples at the reversals are not fitted, so that those in motion stand beside the published
    // figures. Of all samples five joints are below them too, and joint 2 is at 7.2 % where 6.8 % is published.
    let (all, found) = fitted("configs/ur10.toml", &[], log, "@0..70%", "@70..100%");
    let published = [17.0, 6.8, 6.0, 12.6, 13.8, 16.5];
    assert_at_most(&errors(&found, "relative_error_moving"), &published);
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean(&all) < 0.85 * mean(&published), "{all:?}");
}

fn committed(name: &str) -> Value {
    let text = std::fs::read_to_string(format!("docs/results/{name}.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn the_coupling_of_the_tx40_is_the_first_thing_that_its_diagnosis_finds() {
    let diagnosis = committed("tx40_diagnosis");
    let step = &diagnosis["steps"][0];
    assert_eq!(
        (&step["effect"], &step["joint"]),
        (&"coupling".into(), &"q6".into())
    );
    let number = |key: &str, what: &str| step["parameters"][key][what].as_f64().unwrap();
    // the motor of joint 6 turns with the sum of both: sgn(v6 + v5)
    assert_eq!(
        (number("from", "value"), number("both", "value")),
        (5.0, 1.0)
    );
    assert!((number("r", "value") - 1.0).abs() < 1e-3);
    assert!((number("viscous", "value") / 0.616 - 1.0).abs() < 0.15);
    for (key, literature) in [("inertia", 0.00964), ("coulomb", 1.95)] {
        let off = (number(key, "value") - literature).abs();
        assert!(
            off < (1.96 * number(key, "std")).max(0.2 * literature),
            "{key}"
        );
    }
}

#[test]
fn what_the_diagnosis_adds_to_panda_and_ur10_does_not_worsen_what_it_never_saw() {
    for name in ["panda", "ur10"] {
        let mean = |which: &str| {
            let found = committed(&format!("{name}_{which}"));
            found["overall"]["mean_relative_error"].as_f64().unwrap()
        };
        assert!(mean("refined_unseen") <= mean("unseen"), "{name}");
    }
    let overall = |name: &str| {
        let found = committed(name);
        found["overall"]["relative_error"].as_f64().unwrap()
    };
    // amplitudes that parts of the data do not all ask for are shrunk, and what is fitted pays for it
    assert!(overall("panda_closed_all") <= 1.02 * overall("panda_all"));
}

/// A deviation that ran away would be true, and of no use.
#[test]
fn what_the_diagnosis_adds_to_the_ur10_is_known_as_well_as_58_parameters_let_it() {
    let found = committed("ur10_diagnosis");
    let steps = found["steps"].as_array().unwrap();
    let written = |step: &&Value| step["shrinkage"].as_f64().is_some_and(|s| s > 0.0);
    let steps: Vec<&Value> = steps.iter().filter(written).collect();
    assert!(!steps.is_empty());
    for step in steps {
        for (key, number) in step["parameters"].as_object().unwrap() {
            if number["bound"] == true {
                continue;
            }
            // a shape that stands on a grid has no deviation
            let Some(std) = number["std"].as_f64() else {
                continue;
            };
            let over = std / number["value"].as_f64().unwrap().abs();
            assert!(over < 20.0, "{} {key} {number}", step["effect"]);
        }
    }
}
