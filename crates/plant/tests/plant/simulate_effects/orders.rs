//! Effects as they are ordered: by name on the command line and in model files, with refusals and truth.

use std::collections::BTreeMap;
use std::path::Path;

use cft_ident_core::effect::{PlaceRule, Unit};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::LaboratorySetup;
use cft_ident_files::config::model_file::{EffectParameter, EffectSection, Parameter};
use cft_ident_files::config::{ModelFile, RobotFile};
use cft_ident_plant::simulate::cft::effects;
use cft_ident_plant::simulate::effects::LAWS;
use cft_ident_plant::simulate::{
    CftTruth, EffectSpec, Experiment, Order, SimulateError, SimulatedLog, TruthFile, simulate,
};

use super::missing::{axis, pushed, specs, table_3};

/// The unit at a joint that turns or slides; `from` is whether the joint of the key `from` turns.
fn unit(unit: Unit, turns: bool, from: bool) -> String {
    let kind = |turns| match turns {
        true => JointKind::Revolute,
        false => JointKind::Prismatic,
    };
    unit.text(kind(turns), kind(from), if turns { "Nm" } else { "N" })
}

fn robot() -> RobotFile {
    RobotFile::load(Path::new("configs/cft.toml")).expect("embedded")
}

fn ordered(robot: &RobotFile, texts: &[&str], seed: u64) -> SimulatedLog {
    let order = Order {
        robot,
        model: None,
        experiment: Experiment::Usual,
        seconds: Some(1.5),
        effects: specs(texts),
        seed,
    };
    simulate(&order).expect("runs")
}

#[test]
fn every_effect_changes_the_log_of_the_cft_robot_at_its_defaults() {
    let robot = robot();
    let sound = ordered(&robot, &[], 1);
    for kind in LAWS.iter().map(|law| law.entry) {
        let expected = match kind.places {
            PlaceRule::Joints | PlaceRule::JointsOrAll | PlaceRule::Pairs | PlaceRule::Others => {
                vec![Some("q4")]
            }
            PlaceRule::Actuators | PlaceRule::JointsAndActuators => vec![Some("x_r"), Some("y_r")],
            PlaceRule::Whole => vec![None],
        };
        let text = match (expected[0], kind.name) {
            (Some("q4"), "disturbance") => "disturbance:q4:at=0.5".to_owned(),
            (Some("q4"), "stuck-channel") => "stuck-channel:q4:at=0.5".to_owned(),
            (Some("q4"), name) => format!("{name}:q4"),
            (_, name) => name.to_owned(),
        };
        let log = ordered(&robot, &[&text], 1);
        assert_eq!(log.rows().len(), sound.rows().len(), "{text}");
        assert!(log.values.iter().all(|x| x.is_finite()), "{text}");
        assert_ne!(log.values, sound.values, "{text}");
        let effects = &log.truth.effects;
        let joints: Vec<Option<&str>> = effects.iter().map(|e| e.joint.as_deref()).collect();
        assert_eq!(joints, expected, "{text}");
        let own = &effects[0];
        assert_eq!(
            (own.effect.as_str(), own.family.as_str()),
            (kind.name, kind.family().name())
        );
        assert_eq!(own.parameters.len(), kind.keys.len());
        for key in kind.keys {
            let written = &own.parameters[key.name];
            let place = matches!(expected[0], Some("q4"));
            assert_eq!(
                written.unit,
                unit(key.unit, place, true),
                "{text}, {}",
                key.name
            );
        }
        // What the truth says, ordered in full, is the same effect.
        let back = TruthFile::parse(&log.truth.to_toml().expect("written")).expect("read back");
        assert_eq!(back, log.truth, "{text}");
        let again: Vec<String> = back
            .effects
            .iter()
            .map(|e| {
                let joint = e.joint.iter().map(|j| format!(":{j}")).collect::<String>();
                let keys: Vec<String> = e
                    .parameters
                    .iter()
                    .map(|(k, p)| format!("{k}={:?}", p.value))
                    .collect();
                format!("{}{joint}:{}", e.effect, keys.join(","))
            })
            .collect();
        let again: Vec<&str> = again.iter().map(String::as_str).collect();
        assert_eq!(ordered(&robot, &again, 1).values, log.values, "{again:?}");
    }
}

#[test]
fn seeds_reproduce_every_byte_and_other_seeds_do_not() {
    let robot = robot();
    let texts = [
        "drift:q1:walk=1",
        "presliding:q4",
        "delay:d=0.0015",
        "elasticity:q5",
    ];
    let first = ordered(&robot, &texts, 9);
    assert_eq!(first, ordered(&robot, &texts, 9));
    assert_ne!(first.values, ordered(&robot, &texts, 10).values);
}

#[test]
fn effects_without_a_place_are_refused_with_the_reason() {
    let on_axis = |text: &str| pushed(&axis(), &[text]).expect_err(text).to_string();
    assert!(on_axis("actuator-friction").contains("the screws of the CFT robot"));
    assert!(on_axis("rigid-body-terms").contains("one inertia"));
    assert!(on_axis("coupling").contains("no other joint"));
    assert!(on_axis("counterbalance:q1").contains("use `spring`"));
    assert!(on_axis("ripple:q2").contains("its joints are q1"));
    let mut turning = axis();
    turning.kind = cft_ident_core::robot::JointKind::Revolute;
    let text = pushed(&turning, &["gravity-tilt"])
        .expect_err("refused")
        .to_string();
    assert!(text.contains("no centre of gravity"), "{text}");
    assert!(pushed(&turning, &["counterbalance", "payload"]).is_ok());

    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let refused = |text: &str| {
        let outcome = effects(&truth, &specs(&[text]));
        outcome.expect_err(text).to_string()
    };
    assert!(refused("payload:q4").contains("leave the joint out"));
    assert!(refused("actuator-friction:q4").contains("its joints are x_r, y_r"));
    assert!(refused("rotor-inertia:x_c1").contains("q1, q2, q4, q5, x_r, y_r"));
    assert!(refused("counterbalance").contains("this joint slides"));
    let mut smooth = truth;
    (smooth.friction[2].coulomb_1, smooth.friction[2].coulomb_2) = (0.0, 0.0);
    let text = effects(&smooth, &specs(&["presliding:q4"]))
        .expect_err("none")
        .to_string();
    assert!(text.contains("has none at speed"), "{text}");
    assert!(effects(&smooth, &specs(&["presliding:q4:sigma0=2e3,fc=4"])).is_ok());
    assert!(effects(&truth, &specs(&["counterbalance:q1:m_1=1,m_3=2"])).is_ok());
}

#[test]
fn numbers_that_an_effect_cannot_have_name_the_key() {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    for (text, key) in [
        ("stribeck:q4:vs=0", "vs is 0"),
        ("nonlinear-viscous:q4:p=9", "p is 9"),
        ("load-friction:q4:mu_c=1.2", "mu_c + mu_v |v| is 1.2"),
        ("drive-efficiency:q4:k=-2", "k is -2"),
        ("gain:q4:k=-1", "k is -1"),
        ("counterbalance:q4:a=0.1,b=0.1", "a - b is 0"),
        ("counterbalance:q4:from=1,to=0", "to - from is -1"),
        ("backlash:q4:gap=0", "gap is 0"),
        ("presliding:q4:sigma0=-1", "sigma0 is -1"),
        ("elasticity:q4:stiffness=0", "stiffness is 0"),
        ("payload:mx=1", "mass is 0"),
        ("coupling:q4:from=3", "from is 3"),
        ("coupling:q4:from=1.5", "from is 1.5"),
        ("warm-up:q4:T=0", "T is 0"),
        ("disturbance:q4:seconds=-1", "seconds is -1"),
        ("saturation:q4:limit=-1", "limit is -1"),
        ("quantisation:q4:step=0", "step is 0"),
        ("wrong-sign-or-order:q4:swap=7", "swap is 7"),
        ("filter:q4:cutoff=0", "cutoff is 0"),
    ] {
        let error = effects(&truth, &specs(&[text])).expect_err(text);
        assert!(
            matches!(error, SimulateError::EffectNumber { .. }),
            "{text}: {error:?}"
        );
        assert!(error.to_string().contains(key), "{error}");
    }
}

#[test]
fn one_size_that_is_given_silences_the_other_sizes() {
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let values = |text: &str| {
        let (_, values) = effects(&truth, &specs(&[text])).expect("known");
        values[0]
            .parameters
            .iter()
            .map(|(key, p)| (key.clone(), p.value))
            .collect()
    };
    let given: BTreeMap<String, f64> = values("asymmetric-friction:q4:coulomb=1");
    assert_eq!((given["coulomb"], given["viscous"]), (1.0, 0.0));
    let none: BTreeMap<String, f64> = values("asymmetric-friction:q4");
    assert!(none["coulomb"] > 0.0 && none["viscous"] > 0.0);
    let swapped: BTreeMap<String, f64> = values("wrong-sign-or-order:q4:swap=1");
    assert_eq!((swapped["sign"], swapped["swap"]), (0.0, 1.0));
}

#[test]
fn units_follow_the_joint() {
    for (of, slides, turns) in [
        (Unit::Torque, "N", "Nm"),
        (Unit::Order, "1/m", "1/rev"),
        (Unit::OtherOrder, "1/rev", "1/rev"),
        (Unit::Viscous, "N s/m", "Nm s/rad"),
        (Unit::Inertia, "kg", "kg m^2"),
        (Unit::Fixed("Hz"), "Hz", "Hz"),
    ] {
        let shown = [unit(of, false, true), unit(of, true, true)];
        assert_eq!(shown, [slides, turns]);
    }
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let (_, values) = effects(&truth, &specs(&["coupling:q2:from=1"])).expect("known");
    assert_eq!(values[0].parameters["viscous"].unit, "Nm s/m");
    assert_eq!(values[0].parameters["inertia"].unit, "kg m");
}

/// A model file without what only a fit knows.
pub fn model(
    robot: &RobotFile,
    parameters: Vec<Parameter>,
    effects: Vec<EffectSection>,
) -> ModelFile {
    ModelFile {
        estimates: Vec::new(),
        estimate_covariance: None,
        friction_prior: Vec::new(),
        held_out: Vec::new(),
        excesses: None,
        robot: robot.clone(),
        parameters,
        covariance: None,
        residual_std: BTreeMap::new(),
        effects,
        links: Vec::new(),
        drive_inertia: BTreeMap::new(),
        candidates: Vec::new(),
        provenance: Default::default(),
    }
}

fn effect(name: &str, joint: Option<&str>, numbers: &[(&str, f64)]) -> EffectSection {
    let number = |(key, value): &(&str, f64)| {
        let parameter = EffectParameter {
            value: *value,
            std: None,
            unit: String::new(),
            bound: false,
        };
        ((*key).to_owned(), parameter)
    };
    EffectSection {
        shrinkage: None,
        accepted_by_user: false,
        prediction_only: false,
        name: name.to_owned(),
        joint: joint.map(str::to_owned),
        parameters: numbers.iter().map(number).collect(),
    }
}

#[test]
fn effects_of_a_model_run_as_those_of_the_command_line_do() {
    let robot = robot();
    let run = |effects: Vec<EffectSection>, texts: &[&str]| {
        let plant = CftTruth::synthetic(LaboratorySetup::Tuedacs).plant();
        let model = model(&robot, plant.expect("a pose").parameters(), effects);
        let order = Order {
            robot: &robot,
            model: Some(("m.toml", &model)),
            experiment: Experiment::Usual,
            seconds: Some(1.0),
            effects: specs(texts),
            seed: 2,
        };
        simulate(&order)
    };
    let in_model = vec![
        effect("stribeck", Some("q4"), &[("c", 0.7), ("vs", 0.1)]),
        effect("payload", None, &[("mass", 1.0), ("mx", 0.3)]),
    ];
    let from_model = run(in_model.clone(), &["gain:q1:k=0.05"]).expect("runs");
    let from_line = run(
        Vec::new(),
        &[
            "stribeck:q4:c=0.7,vs=0.1",
            "payload:mass=1,mx=0.3",
            "gain:q1:k=0.05",
        ],
    )
    .expect("runs");
    assert_eq!(from_model, from_line);

    let refused = |effects: Vec<EffectSection>| run(effects, &[]).expect_err("refused").to_string();
    let mut unknown = in_model.clone();
    unknown.push(effect("stiction", Some("q4"), &[]));
    let text = refused(unknown);
    for part in [
        "m.toml, [[effect]] 3 (`stiction`)",
        "it has torque-offset",
        "leave it out",
    ] {
        assert!(text.contains(part), "{text}");
    }
    let text = refused(vec![effect("ripple", Some("q4"), &[("phase", 1.0)])]);
    assert!(
        text.contains("[[effect]] 1") && text.contains("has no key `phase`"),
        "{text}"
    );
    let text = refused(vec![effect("ripple", Some("q9"), &[])]);
    assert!(text.contains("no joint `q9`"), "{text}");
}

#[test]
fn what_is_written_for_prediction_only_need_not_be_possible_on_a_machine() {
    let robot = robot();
    // a load that is heavier than the whole joint leaves nothing to its motor
    let loose = |prediction_only: bool| EffectSection {
        prediction_only,
        ..effect(
            "backlash-impact",
            Some("q4"),
            &[("gap", 0.01), ("inertia", 1e3)],
        )
    };
    let run = |effects: Vec<EffectSection>| {
        let plant = CftTruth::synthetic(LaboratorySetup::Tuedacs).plant();
        let model = model(&robot, plant.expect("a pose").parameters(), effects);
        simulate(&Order {
            robot: &robot,
            model: Some(("m.toml", &model)),
            experiment: Experiment::Usual,
            seconds: Some(0.2),
            effects: Vec::new(),
            seed: 2,
        })
    };
    let ripple = || effect("ripple", Some("q4"), &[]);
    let left = run(vec![loose(true), ripple()]).expect("runs");
    let whole = run(vec![ripple()]).expect("runs");
    assert_eq!(left.values, whole.values);
    assert_eq!(left.left_out.len(), 1);
    assert!(left.left_out[0].contains("backlash-impact"));
    let refused = run(vec![loose(false), ripple()]).expect_err("refused");
    assert!(refused.to_string().contains("[[effect]] 1"));
}

#[test]
fn faults_need_a_log_with_joint_channels() {
    let text = std::fs::read_to_string(format!("{}/configs/cft.toml", cft_ident_support::ROOT))
        .expect("the robot file");
    let text = text.replace("[log]\n", "[log]\nchannels = \"actuator\"\n");
    let Ok(raw) = RobotFile::parse("raw.toml", &text) else {
        panic!("a robot file with the motors' channels alone");
    };
    let order = |texts: &[&str]| {
        simulate(&Order {
            robot: &raw,
            model: None,
            experiment: Experiment::Usual,
            seconds: Some(0.5),
            effects: specs(texts),
            seed: 1,
        })
    };
    let text = order(&["ripple", "delay:q4"])
        .expect_err("refused")
        .to_string();
    assert!(text.contains("`delay` has no place at this log"), "{text}");
    assert!(order(&["ripple"]).is_ok());
}

#[test]
fn the_page_of_effects_says_what_the_simulator_takes() {
    let page = std::fs::read_to_string(format!(
        "{}/docs/developers/effects.md",
        cft_ident_support::ROOT
    ))
    .expect("docs/developers/effects.md");
    let rows: Vec<&str> = page
        .lines()
        .filter(|line| line.starts_with("| `"))
        .collect();
    assert_eq!(rows.len(), LAWS.len());
    for (law, row) in LAWS.iter().zip(rows) {
        let kind = law.entry;
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        assert_eq!(cells[0], format!("`{}`", kind.name));
        assert_eq!(cells[1], kind.family().name());
        assert_eq!(cells[3], kind.formula);
        let keys: Vec<String> = kind
            .keys
            .iter()
            .map(|key| {
                let (slides, turns) = (unit(key.unit, false, true), unit(key.unit, true, true));
                let unit = if slides == turns {
                    slides.to_owned()
                } else {
                    format!("{slides}, {turns}")
                };
                format!("`{}` [{unit}]", key.name)
            })
            .collect();
        assert_eq!(cells[2], keys.join("; "), "{}", kind.name);
        let cft = match kind.places {
            PlaceRule::Joints | PlaceRule::JointsOrAll | PlaceRule::Pairs | PlaceRule::Others => {
                "joints"
            }
            PlaceRule::Actuators => "x_r, y_r",
            PlaceRule::JointsAndActuators => "joints, x_r, y_r",
            PlaceRule::Whole => "whole",
        };
        assert_eq!(cells[4], cft, "{}", kind.name);
        let one = [false, true].map(|turns| {
            let mut truth = axis();
            if turns {
                truth.kind = cft_ident_core::robot::JointKind::Revolute;
            }
            let spec: EffectSpec = kind.name.parse().expect("read");
            cft_ident_plant::simulate::single_joint::effects(&truth, &[spec]).is_ok()
        });
        let single = match one {
            [true, true] => "yes",
            [true, false] => "sliding",
            [false, true] => "turning",
            [false, false] => "no",
        };
        assert_eq!(cells[5], single, "{}", kind.name);
        assert_eq!(cells[6], super::serial::places(kind), "{}", kind.name);
    }
}

#[test]
fn several_effects_with_states_run_together() {
    let all = [
        "presliding",
        "elasticity",
        "backlash:q4",
        "warm-up",
        "rotor-inertia",
        "load-friction",
        "coupling:q2:from=1,inertia=0.2",
    ];
    assert_eq!(table_3(&all).rows(), 5000);
}
