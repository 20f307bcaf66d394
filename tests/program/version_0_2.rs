//! Files that version 0.2 wrote (`fixtures/version_0_2`) are read as then: an arm of two joints, its model, a refined
//! one with a ripple, a reduced log; `expected.json` has what its `validate` said of `log.csv`.

use crate::measured_support;

use std::path::Path;

use measured_support::run;
use serde_json::Value;

const FOLDER: &str = "fixtures/version_0_2";

fn at(name: &str) -> String {
    let path = Path::new(cft_ident_support::ROOT).join(FOLDER).join(name);
    path.to_string_lossy().into_owned()
}

#[test]
fn models_of_0_2_are_validated_as_then_shown_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(at("expected.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    for (model, errors) in expected.as_object().unwrap() {
        let (model, log) = (at(model), at("log.csv"));
        let found = run(folder.path(), &["validate", &log, "-m", &model]);
        for (joint, error) in found["joints"]
            .as_array()
            .unwrap()
            .iter()
            .zip(errors.as_array().unwrap())
        {
            let [found, then] = [&joint["relative_error"], error].map(|x| x.as_f64().unwrap());
            assert!((found / then - 1.0).abs() < 1e-9, "{model}: {found} {then}");
        }
        run(folder.path(), &["show", &model]);
        let c = folder.path().join("model.h");
        run(
            folder.path(),
            &["export", "-m", &model, "--c", c.to_str().unwrap()],
        );
        let header = std::fs::read_to_string(&c).unwrap();
        let ripple = header.contains("ripple");
        assert_eq!(ripple, model.ends_with("refined.toml"), "{header}");
    }
}

#[test]
fn a_reduced_log_of_0_2_gives_the_parameters_of_its_model() {
    let folder = tempfile::tempdir().unwrap();
    let (part, robot) = (at("part.cfi"), at("robot.toml"));
    let found = run(folder.path(), &["lsq", &part, "-r", &robot, "-o", "m.toml"]);
    let text = std::fs::read_to_string(at("model.toml")).unwrap();
    let then: toml::Table = text.parse().unwrap();
    let then = then["parameter"].as_array().unwrap();
    let mut compared = 0;
    for parameter in found["parameters"].as_array().unwrap() {
        let same = |p: &&toml::Value| {
            let joint = p.get("joint").and_then(toml::Value::as_str);
            p["name"].as_str() == parameter["name"].as_str() && joint == parameter["joint"].as_str()
        };
        let Some(before) = then.iter().find(same) else {
            continue;
        };
        let (value, std) = (
            before["value"].as_float().unwrap(),
            before["std"].as_float().unwrap(),
        );
        let off = (parameter["value"].as_f64().unwrap() - value).abs();
        assert!(
            off <= std,
            "{}: {value} +- {std}, {off} off",
            parameter["name"]
        );
        compared += 1;
    }
    assert!(compared > 8, "{compared}");
}
