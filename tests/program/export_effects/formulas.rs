//! Formulas of a user in exported code.

use super::*;

/// Formulas that call everything that formulas may.
const FORMULAS: [[&str; 3]; 6] = [
    [
        "c1",
        "Nm",
        "cos(q_q2 + q) * tanh(w * v) - 2^q / (1 + a^2) + -q^3 * PI",
    ],
    [
        "c2",
        "Nm",
        "load * signum(v) + abs(load_q3) * fract(3.7 * q) + direction_q1 * sqrt(abs(q))",
    ],
    [
        "c3",
        "Nm",
        "atan2(v, 1 + a) + min(max(v, a), q) + asin(0.5 * sin(q)) * acos(0.3 * cos(v)) + atan(a)",
    ],
    [
        "c4",
        "Nm",
        "sinh(q) + cosh(v) - asinh(a) * acosh(1.5 + q^2) + atanh(0.4 * sin(a)) + tan(0.3 * q)",
    ],
    [
        "c5",
        "Nm",
        "floor(5 * q) - round(3 * v) + ceil(a) * trunc(7 * q) + cbrt(v) + log2(9 + q) * log10(3 + v^2)",
    ],
    [
        "c6",
        "Nm",
        "exp(-t / 9) * direction + ln(2 + sin(q)) - log(1.5 + cos(q_q4)) + 1e-3 * E * t",
    ],
];

fn own_formulas(robot: &Robot) -> Vec<ModelEffect> {
    let definition = FormulaDefinition {
        name: "all-functions".to_owned(),
        coefficients: FORMULAS.iter().map(|c| c.map(str::to_owned)).collect(),
        shapes: vec![FormulaShape {
            name: "w".to_owned(),
            unit: "s/rad".to_owned(),
            range: [1.0, 90.0],
        }],
        ..FormulaDefinition::default()
    };
    let law = own::law(&definition, robot).unwrap();
    let at = |j: usize, w: f64| {
        let linear = (0..law.linear.len()).map(|i| 0.9 - 0.27 * i as f64);
        ModelEffect::new(law, EffectPlace::Joint(j), vec![w], linear.collect())
    };
    vec![at(0, 12.0), at(3, 70.0)]
}

/// A model with one formula at its second joint, along a motion in which every drive warms up.
fn warm(robot: &Robot, name: &str, formula: &str) -> Case {
    let definition = FormulaDefinition {
        name: name.to_owned(),
        coefficients: vec![["c".to_owned(), "Nm".to_owned(), formula.to_owned()]],
        ..FormulaDefinition::default()
    };
    let law = own::law(&definition, robot).unwrap();
    let mut along = swing(robot.joints());
    let of = |j: usize| move |t: &f64| 21.5 + 3.0 * j as f64 + 2.0 * t;
    let temperature = (0..robot.joints()).map(|j| along.t.iter().map(of(j)).collect());
    along.temperature = temperature.collect();
    Case {
        name: name.to_owned(),
        model: AugmentedModel {
            effects: vec![ModelEffect::new(
                law,
                EffectPlace::Joint(1),
                Vec::new(),
                vec![0.7],
            )],
            model: model(robot.clone()),
        },
        along,
    }
}

#[test]
fn formulas_of_temperatures_have_an_input_for_them_in_c_and_rust_and_other_models_have_none() {
    let robot = parsed(include_str!("../../../configs/ur10.toml"));
    let grease = "exp(-0.04 * (temperature - 20)) * v + 0.1 * temperature_q4";
    let cases = [
        warm(&robot, "grease", grease),
        warm(&robot, "grease-over-time", &format!("t * ({grease})")),
    ];
    let texts = |case: &Case| {
        let program = Program::with_effects(&case.model).unwrap();
        let note = note(&case.model.model);
        [
            export::header::header(&program, "arm", &note),
            export::module::module(&program, &note),
        ]
    };
    for text in texts(&cases[0]) {
        assert!(text.contains("of the drive of each joint [degC]"));
    }
    let plain = Case {
        model: AugmentedModel::plain(model(robot.clone())),
        name: "plain".to_owned(),
        along: swing(robot.joints()),
    };
    for text in texts(&plain) {
        assert!(!text.contains("temperature") && !text.contains("WARM") && !text.contains("@TO_"));
    }
    let folder = tempfile::tempdir().unwrap();
    if there("cc") {
        compare("C", &cases, &by_c(folder.path(), &cases));
    }
    if there("rustc") {
        compare("Rust", &cases, &by_rust(folder.path(), &cases));
    }
}

#[test]
fn formulas_of_a_user_are_the_tools_own_in_c_and_rust() {
    let config = include_str!("../../../configs/ur10.toml");
    let robot = parsed(config);
    let mut cases = vec![Case {
        name: "formulas".to_owned(),
        model: AugmentedModel {
            effects: own_formulas(&robot),
            model: model(robot.clone()),
        },
        along: swing(robot.joints()),
    }];
    cases.extend(measured(config, "ur10/ur10_exciting.csv", &own_formulas));
    let folder = tempfile::tempdir().unwrap();
    if there("cc") {
        compare("C", &cases, &by_c(folder.path(), &cases));
    }
    if there("rustc") {
        compare("Rust", &cases, &by_rust(folder.path(), &cases));
    }
}
