//! Model files: what is written is read back bit for bit, and a model that does not fit is refused.

use std::collections::BTreeMap;

use cft_ident_files::config::held_out::{HeldOut, TorqueExcesses};
use cft_ident_files::config::model_file::{
    Covariance, EffectParameter, EffectSection, Estimate, FrictionPrior, ModelFile,
    ModelProvenance, Parameter, Verdict,
};
use cft_ident_files::config::{ConfigError, RobotFile};
use cft_ident_logs::log::Provenance;
use proptest::prelude::*;

fn parameter(
    name: &str,
    theta: Option<u32>,
    joint: Option<&str>,
    value: f64,
    std: Option<f64>,
) -> Parameter {
    Parameter {
        name: name.to_owned(),
        theta,
        joint: joint.map(str::to_owned),
        value,
        consistent: None,
        std,
        unit: "kg m^2".to_owned(),
        meaning: "a \"quoted\" meaning\\ with m1 + m2".to_owned(),
        verdict: Some(Verdict::Identified),
    }
}

fn model(values: &[f64]) -> ModelFile {
    let robot = RobotFile::load("configs/cft.toml".as_ref()).unwrap();
    let at = |index: usize| values[index % values.len()];
    let mut parameters: Vec<Parameter> = (1..=12)
        .map(|theta| {
            parameter(
                &format!("theta_{theta}"),
                Some(theta),
                None,
                at(theta as usize),
                Some(at(3).abs()),
            )
        })
        .collect();
    for (joint, name) in ["q1", "q2", "q4", "q5"].iter().enumerate() {
        for (index, key) in ["viscous", "coulomb_1", "coulomb_2", "slope_1", "slope_2"]
            .iter()
            .enumerate()
        {
            let theta = 13 + 4 * index as u32 + joint as u32;
            parameters.push(parameter(
                key,
                Some(theta),
                Some(name),
                at(joint + index),
                None,
            ));
        }
    }
    let names = vec!["theta_1".to_owned(), "viscous:q4".to_owned()];
    ModelFile {
        robot: robot.clone(),
        estimates: Vec::new(),
        estimate_covariance: None,
        links: Vec::new(),
        drive_inertia: BTreeMap::new(),
        candidates: Vec::new(),
        parameters,
        covariance: Some(Covariance {
            names,
            matrix: vec![vec![at(0), at(1)], vec![at(1), at(2)]],
        }),
        residual_std: BTreeMap::from([("q1".to_owned(), at(4).abs())]),
        friction_prior: vec![FrictionPrior {
            joint: "q4".to_owned(),
            speeds_covered: Some([at(7).abs(), at(8).abs()]),
            values: Some(std::array::from_fn(at)),
            covariance: Some(std::array::from_fn(|a| std::array::from_fn(|b| at(a * b)))),
            logs: Vec::new(),
            refined_by: Vec::new(),
        }],
        held_out: robot
            .joint_names()
            .iter()
            .map(|joint| HeldOut {
                joint: joint.clone(),
                samples: 100,
                effective_samples: 7.5,
                position_cutoff_hz: 56.5,
                speed_edges: vec![0.1],
                torque_edges: Vec::new(),
                half_width_95: vec![vec![at(9).abs()], vec![0.5]],
                positions_seen: [-1.0, at(10).abs()],
                speed_seen: 1.0,
                acceleration_seen: at(11).abs(),
                torque_seen: 2.0,
                external_std: vec![0.25, 0.125],
                external_99: 2.75,
            })
            .collect(),
        excesses: Some(TorqueExcesses {
            observed_s: 60.0,
            position_cutoff_hz: 80.0,
            level: 0.875,
            clusters: 12,
            scale: 0.0625,
            shape: -0.125,
            largest: vec![1.7, 1.3],
        }),
        effects: vec![EffectSection {
            shrinkage: None,
            accepted_by_user: false,
            prediction_only: false,
            name: "ripple".to_owned(),
            joint: Some("q4".to_owned()),
            parameters: BTreeMap::from([
                (
                    "order".to_owned(),
                    EffectParameter {
                        value: at(5),
                        std: Some(0.5),
                        unit: "1/rev".to_owned(),
                        bound: false,
                    },
                ),
                (
                    "sin".to_owned(),
                    EffectParameter {
                        value: at(6),
                        std: None,
                        unit: "Nm".to_owned(),
                        bound: false,
                    },
                ),
            ]),
        }],
        provenance: ModelProvenance {
            version: "0.1.0".to_owned(),
            command: "lsq".to_owned(),
            estimator: None,
            as_declared: false,
            seed: Some(7),
            inputs: vec![
                Provenance {
                    role: None,
                    name: "a.csv".to_owned(),
                    span: Some("0..70%".to_owned()),
                    sha256: "00".repeat(32),
                    samples: 20_000,
                    duration_s: 19.999,
                },
                Provenance {
                    role: None,
                    name: "b.csv".to_owned(),
                    span: None,
                    sha256: "ff".repeat(32),
                    samples: 2,
                    duration_s: at(7).abs(),
                },
            ],
        },
    }
}

#[track_caller]
fn refused<T: std::fmt::Debug>(result: Result<T, ConfigError>, words: &[&str]) {
    let message = result.unwrap_err().to_string();
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in: {message}");
    }
}

#[test]
fn a_model_is_written_for_people_and_read_back() {
    let written = model(&[0.1 + 0.2, -1e-7, 5e29, 1.0 / 3.0, 121.3049, 12.0, -0.0, 2.0]);
    let text = written.to_toml().unwrap();
    assert_eq!(ModelFile::parse("m.toml", &text).unwrap(), written);
    for line in [
        "[robot]",
        "model = \"cft\"",
        "[[parameter]]",
        "name = \"theta_1\"",
        "theta = 1",
        "unit = \"kg m^2\"",
        "[covariance]",
        "[[effect]]",
        "[provenance]",
    ] {
        assert!(
            text.lines().any(|l| l == line),
            "{line} is missing in:\n{text}"
        );
    }
    assert_eq!(
        written.to_toml().unwrap(),
        text,
        "the same model gives the same bytes"
    );
}

#[test]
fn a_model_that_version_0_2_wrote_is_to_be_fitted_again() {
    let text = model(&[1.0]).to_toml().unwrap();
    let line = |line: &&str| !line.starts_with("acceleration_seen");
    let old: Vec<&str> = text.lines().filter(line).collect();
    assert!(old.len() < text.lines().count());
    refused(
        ModelFile::parse("old.toml", &old.join("\n")),
        &["old.toml", "version 0.2", "fit again", "cft-ident lsq"],
    );
}

#[test]
fn a_model_gives_out_its_parameters_and_names_one_that_is_missing() {
    let mut model = model(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    assert_eq!(model.inertial("m.toml").unwrap().len(), 12);
    let law = model.double_tanh("m.toml", "q4").unwrap();
    assert_eq!((law.viscous, law.coulomb_1, law.slope_2), (3.0, 4.0, 7.0));
    assert_eq!(model.offset("q4"), 0.0);
    let keys = [
        "viscous:q4".to_owned(),
        "theta_2".to_owned(),
        "theta_1".to_owned(),
    ];
    assert_eq!(
        model.covariance_of(&keys),
        [3.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.0]
    );
    model
        .parameters
        .retain(|p| p.name != "theta_7" && p.key() != "slope_1:q5");
    refused(
        model.inertial("m.toml"),
        &["m.toml", "`theta_7` is missing", "cft-ident lsq"],
    );
    refused(
        model.double_tanh("m.toml", "q5"),
        &["`slope_1:q5` is missing", "cft-ident friction"],
    );
}

#[test]
fn a_model_of_another_robot_is_refused_with_the_difference() {
    let model = model(&[1.0]);
    let wanted = RobotFile::load("configs/cft.toml".as_ref()).unwrap();
    model.belongs_to("m.toml", &wanted).unwrap();
    let emps = RobotFile::load("configs/emps.toml".as_ref()).unwrap();
    refused(
        model.belongs_to("m.toml", &emps),
        &["m.toml", "another robot", "cft", "single-joint q1"],
    );
    let dspace = RobotFile::load("configs/cft-dspace.toml".as_ref()).unwrap();
    refused(
        model.belongs_to("m.toml", &dspace),
        &["another robot", "set-up tuedacs", "set-up dspace"],
    );
}

#[test]
fn a_robot_file_given_as_a_model_is_named_so() {
    let text =
        std::fs::read_to_string(format!("{}/configs/cft.toml", cft_ident_support::ROOT)).unwrap();
    refused(
        ModelFile::parse("configs/cft.toml", &text),
        &["not a model file", "robot file", "-r"],
    );
}

#[test]
fn a_model_edited_wrongly_is_refused_with_the_line() {
    let text = model(&[1.0]).to_toml().unwrap();
    let change = |from: &str, to: &str| ModelFile::parse("m.toml", &text.replacen(from, to, 1));
    let line = |key: &str| text.lines().position(|line| line.starts_with(key)).unwrap() + 1;
    refused(
        change("theta = 1\n", "thata = 1\n"),
        &[
            &format!("m.toml:{}", line("theta = 1")),
            "`thata`",
            "`theta`",
        ],
    );
    refused(
        change("value = 1.0", "value = nan"),
        &[&format!("m.toml:{}", line("value = 1.0")), "NaN"],
    );
    refused(
        change("name = \"theta_2\"", "name = \"theta_1\""),
        &["is there twice"],
    );
    refused(
        change("joint = \"q1\"", "joint = \"q3\""),
        &["no joint of this robot", "q1, q2, q4, q5"],
    );
    refused(
        change("\n  \"viscous:q4\"", "\n  \"viscous:q9\""),
        &["viscous:q9", "no parameter"],
    );
    refused(
        change("  [1.0, 1.0],\n", ""),
        &["covariance.matrix", "2 rows"],
    );
}

#[test]
fn a_number_that_is_not_finite_is_not_written() {
    let mut model = model(&[1.0]);
    model.parameters[3].value = f64::NAN;
    refused(model.to_toml(), &["value", "NaN"]);
}

proptest! {
    #[test]
    fn any_model_is_read_back_bit_for_bit(values in prop::collection::vec(any::<u64>().prop_map(f64::from_bits).prop_filter("in range", |v| v.abs() <= 1e30), 8)) {
        let written = model(&values);
        let read = ModelFile::parse("m.toml", &written.to_toml().unwrap()).unwrap();
        for (one, other) in written.parameters.iter().zip(&read.parameters) {
            prop_assert_eq!(one.value.to_bits(), other.value.to_bits());
            prop_assert_eq!(one.std.map(f64::to_bits), other.std.map(f64::to_bits));
        }
        let bits = |model: &ModelFile| -> Vec<u64> {
            let rows = model.covariance.iter().flat_map(|c| c.matrix.iter().flatten());
            rows.map(|value| value.to_bits()).collect()
        };
        prop_assert_eq!(bits(&written), bits(&read));
        prop_assert_eq!(written, read);
    }
}

#[test]
fn a_parameter_is_its_estimate_with_its_deviation_beside_the_value_that_torques_are_computed_with()
{
    let mut model = model(&[1.5]);
    model.estimates = vec![Estimate {
        name: "viscous".to_owned(),
        joint: Some("q4".to_owned()),
        value: 2.0,
        std: Some(0.25),
        unit: "kg m^2".to_owned(),
    }];
    for parameter in model.estimated_parameters() {
        let expected = match parameter.key().as_str() {
            "viscous:q4" => (2.0, Some(0.25), 1.5),
            key => {
                let written = model.parameters.iter().find(|p| p.key() == key).unwrap();
                (written.value, written.std, written.in_use())
            }
        };
        let shown = (parameter.value, parameter.std, parameter.in_use());
        assert_eq!(shown, expected, "{}", parameter.key());
    }
}
