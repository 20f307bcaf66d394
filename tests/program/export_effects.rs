//! Exported code holds every effect: compiled C and Rust give the tool's torques along motions.

mod formulas;

use crate::export_support;

use cft_ident::config::RobotFile;
use cft_ident::effect::as_code::no_torque;
use cft_ident::effect::formula::{FormulaDefinition, FormulaShape};
use cft_ident::effect::own;
use cft_ident::effect::{self, AugmentedModel, EffectPlace, FAULTS, LAWS, Law, ModelEffect};
use cft_ident::export::{self, Program};
use cft_ident::identify::{Control, Log, LogData, RobotSetup, read_whole};
use cft_ident::robot::Robot;
use cft_ident::robot::friction::ViscousCoulomb;
use cft_ident::robot::model::JointFriction;
use export_support::{Case, by_c, by_rust, compare, model, named, note, run, swing, there};
use std::path::{Path, PathBuf};
use std::process::Command;

fn parsed(text: &str) -> Robot {
    RobotFile::parse("robot.toml", text).unwrap().robot()
}

/// Robots on which some effect or other can sit.
fn robots() -> [Robot; 4] {
    [
        parsed("[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\nparameters = 12\n"),
        parsed(include_str!("../../configs/ur10.toml")),
        parsed("[robot]\nmodel = \"single-joint\"\njoint = \"x\"\nkind = \"prismatic\"\n"),
        parsed(include_str!("../../configs/tx40.toml")),
    ]
}

/// A number for a parameter that shapes columns.
fn shape(key: &str, i: usize) -> f64 {
    match key {
        "rate" | "slope" => 150.0,
        "w" => 30.0,
        "vs" => 0.12,
        "gap" => 0.02,
        "frequency" => 11.0,
        "damping" => 0.07,
        "from" => -0.3,
        "to" => 0.8,
        "r" => -0.8,
        "order" => 3.0,
        "scale" | "T" => 0.9,
        "signal" => 1.0 + (i % 2) as f64,
        _ => 0.3 + 0.17 * i as f64,
    }
}

/// Curves over every signal at one joint.
fn curves(robot: &Robot) -> Vec<ModelEffect> {
    let law = effect::law(robot, "empirical").unwrap();
    let of = |signal: u8| {
        let mut curve = some(law, EffectPlace::Joint(1));
        curve.shape[0] = f64::from(signal);
        curve
    };
    (1..=5).map(of).collect()
}

/// An effect of the catalogue with numbers of its own.
fn some(law: &'static Law, place: EffectPlace) -> ModelEffect {
    let keys = law.shape.iter().enumerate();
    let shape = keys.map(|(i, key)| shape(key, i)).collect();
    let linear = (0..law.linear.len()).map(|i| 0.7 + 0.31 * i as f64);
    ModelEffect::new(law, place, shape, linear.collect())
}

/// One of each kind of place.
fn kinds(places: Vec<EffectPlace>) -> Vec<EffectPlace> {
    let mut out: Vec<EffectPlace> = Vec::new();
    for place in places.into_iter().rev() {
        let alike = |p: &EffectPlace| std::mem::discriminant(p) == std::mem::discriminant(&place);
        if !out.iter().any(alike) || matches!(place, EffectPlace::Actuator(_)) {
            out.push(place);
        }
    }
    out
}

/// Every law at every kind of place of every robot, and all of a robot's laws together.
fn catalogue() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut tried = vec![false; LAWS.len()];
    for (r, robot) in robots().into_iter().enumerate() {
        let plain = vec![JointFriction::None; robot.joints()];
        let along = swing(robot.joints());
        let mut all = Vec::new();
        for (law, tried) in LAWS.iter().zip(&mut tried) {
            for place in kinds(law.places(&robot, &plain)) {
                let effect = some(law, place);
                all.push(effect.clone());
                // once is enough for what sits at a joint of any robot
                if *tried && matches!(place, EffectPlace::Joint(_)) {
                    continue;
                }
                cases.push(Case {
                    name: format!("{} on robot {r}", effect.title(&robot)),
                    model: AugmentedModel {
                        model: model(robot.clone()),
                        effects: vec![effect],
                    },
                    along: along.clone(),
                });
            }
            *tried |= !law.places(&robot, &plain).is_empty();
        }
        if r == 1 {
            all.extend(curves(&robot));
        }
        cases.push(Case {
            name: format!("all of robot {r}"),
            model: AugmentedModel {
                model: model(robot),
                effects: all,
            },
            along,
        });
    }
    for (law, tried) in LAWS.iter().zip(tried) {
        assert!(tried, "{law:?} sits on none of these robots");
    }
    cases
}

#[test]
fn every_effect_of_the_catalogue_is_the_tools_own_in_c() {
    if there("cc") {
        let folder = tempfile::tempdir().unwrap();
        let cases = catalogue();
        compare("C", &cases, &by_c(folder.path(), &cases));
    }
}

#[test]
fn every_effect_of_the_catalogue_is_the_tools_own_in_rust() {
    if there("rustc") {
        let folder = tempfile::tempdir().unwrap();
        let cases = catalogue();
        compare("Rust", &cases, &by_rust(folder.path(), &cases));
    }
}

/// Laws that drive: below zero at rest or at speed, or by an effect.
fn driving() -> Vec<Case> {
    let robot = parsed("[robot]\nmodel = \"single-joint\"\njoint = \"x\"\nkind = \"prismatic\"\n");
    let of = |viscous, coulomb, effects: Vec<ModelEffect>| {
        let mut model = model(robot.clone());
        model.friction = vec![JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous,
            coulomb,
        })];
        model.theta = vec![0.0];
        model.offset = vec![0.0];
        Case {
            name: format!("{viscous} {coulomb}"),
            model: AugmentedModel { model, effects },
            along: swing(1),
        }
    };
    let stribeck = named(&robot, "stribeck", Some("x"), &[("c", -2.0), ("vs", 0.3)]);
    vec![
        of(3.0, -1.65, Vec::new()),
        of(-2.0, 1.0, Vec::new()),
        of(1.0, 1.0, vec![stribeck]),
    ]
}

#[test]
fn friction_in_code_takes_power_at_every_speed_and_is_the_models_own_where_that_does() {
    if !there("cc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let cases = driving();
    for (case, found) in cases.iter().zip(by_c(folder.path(), &cases)) {
        let wanted = case.model.torques(&case.along).hat;
        let mut cut = 0;
        for ((x, wanted), v) in found[0].iter().zip(&wanted[0]).zip(&case.along.v[0]) {
            assert!(x * v >= 0.0, "{}: {x} at {v}", case.name);
            if wanted * v > 0.0 {
                assert!((x - wanted).abs() < 1e-12, "{}: {x} {wanted}", case.name);
            }
            cut += usize::from(wanted * v < 0.0);
        }
        assert!(cut > 20, "{}: the model drives in {cut} samples", case.name);
        let program = Program::with_effects(&case.model).unwrap();
        assert!(program.drives_at[0].is_some(), "{}", case.name);
    }
    let sound = Program::with_effects(&AugmentedModel::plain(model(
        cases[0].model.model.robot.clone(),
    )));
    assert_eq!(sound.unwrap().drives_at, [None]);
}

#[test]
fn faults_of_a_log_are_refused_with_the_reason_and_laws_are_not() {
    for entry in FAULTS {
        let reason = no_torque(entry.name).unwrap();
        assert!(reason.starts_with("it is "), "{}: {reason}", entry.name);
    }
    for name in effect::names() {
        assert_eq!(no_torque(name), None, "{name}");
    }
}

fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(cft_ident_support::ROOT).join("../shared/data");
    let path = path.join(file);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

/// The motion of a measured log, smoothed as the robot file says, with effects by hand.
fn measured(config: &str, log: &str, effects: &dyn Fn(&Robot) -> Vec<ModelEffect>) -> Vec<Case> {
    let Some(path) = shared(log) else {
        return Vec::new();
    };
    let file = RobotFile::parse("robot.toml", config).unwrap();
    let machine = RobotSetup::new("robot.toml", file);
    let log = Log::from(
        path.to_string_lossy()
            .parse::<cft_ident::log::LogSpec>()
            .unwrap(),
    );
    let control = Control::default();
    let log = LogData::read(&machine, &log, &control).unwrap();
    let whole = read_whole(&machine, &[log], &control).unwrap();
    let each = whole.stretches.into_iter().map(|along| Case {
        name: path.display().to_string(),
        model: AugmentedModel {
            model: model(machine.robot.clone()),
            effects: effects(&machine.robot),
        },
        along,
    });
    each.collect()
}

/// Effects of the size that the diagnosis of the UR10 finds, with friction that takes power at every speed, and a delay,
/// which the code leaves to the caller.
fn of_ur10(robot: &Robot) -> Vec<ModelEffect> {
    let of = |name, joint, numbers: &[(&str, f64)]| named(robot, name, Some(joint), numbers);
    vec![
        of("delay", "q3", &[("d", 0.004)]),
        of("stribeck", "q1", &[("vs", 0.113), ("c", 14.27)]),
        of("stribeck", "q4", &[("vs", 0.055), ("c", 2.61)]),
        of(
            "load-friction",
            "q2",
            &[("w", 108.0), ("mu_c", 0.053), ("mu_v", -0.018)],
        ),
        of(
            "load-friction",
            "q3",
            &[("w", 2.0), ("mu_c", 0.16), ("mu_v", -0.12)],
        ),
        of(
            "presliding",
            "q2",
            &[("sigma0", 1047.0), ("sigma1", 6.2), ("fc", 2.6)],
        ),
        of(
            "presliding",
            "q3",
            &[("sigma0", 598.0), ("sigma1", 5.5), ("fc", 1.8)],
        ),
        of("backlash", "q5", &[("gap", 0.002), ("c", 0.8)]),
        of(
            "elasticity",
            "q1",
            &[("stiffness", 9000.0), ("inertia", 1.1), ("damping", 0.06)],
        ),
        of("warm-up", "q6", &[("k", -0.2), ("T", 40.0)]),
    ]
}

fn of_emps(robot: &Robot) -> Vec<ModelEffect> {
    let joint = robot.joint_names()[0].clone();
    let of = |name, numbers: &[(&str, f64)]| named(robot, name, Some(&joint), numbers);
    vec![
        of(
            "presliding",
            &[("sigma0", 4e4), ("sigma1", 30.0), ("fc", 19.0)],
        ),
        of("ripple", &[("order", 40.0), ("sin", 0.6), ("cos", -0.4)]),
        of("drift", &[("c", 0.02)]),
        of("backlash", &[("gap", 4e-4), ("c", 2.0)]),
    ]
}

#[test]
fn along_measured_logs_c_and_rust_give_the_tools_torques() {
    let folder = tempfile::tempdir().unwrap();
    let mut cases = measured(
        include_str!("../../configs/ur10.toml"),
        "ur10/ur10_exciting.csv",
        &of_ur10,
    );
    for log in ["emps/emps_id.csv", "emps/emps_pulses_val.csv"] {
        cases.extend(measured(
            include_str!("../../configs/emps.toml"),
            log,
            &of_emps,
        ));
    }
    if cases.is_empty() {
        return;
    }
    if there("cc") {
        compare("C", &cases, &by_c(folder.path(), &cases));
    }
    if there("rustc") {
        compare("Rust", &cases, &by_rust(folder.path(), &cases));
    }
}

#[test]
fn the_lead_of_a_delay_is_reported_and_not_applied() {
    let robot = robots()[1].clone();
    let effects = vec![named(&robot, "delay", Some("q3"), &[("d", 0.004)])];
    let refined = AugmentedModel {
        model: model(robot),
        effects,
    };
    let program = Program::with_effects(&refined).unwrap();
    assert_eq!(program.effects.lead_s, [0.0, 0.0, 0.004, 0.0, 0.0, 0.0]);
    let header = export::header::header(&program, "arm", &note(&refined.model));
    assert!(header.contains("#define ARM_LEAD_S_2 (0.004)"));
    assert!(header.contains("#define ARM_LEAD_SAMPLES_2(dt) (ARM_LEAD_S_2 / (dt))"));
    let module = export::module::module(&program, &note(&refined.model));
    assert!(module.contains("LEAD_S: [f64; JOINTS] = [0.0, 0.0, 0.004, 0.0, 0.0, 0.0];"));
}

#[test]
fn friction_compensation_is_silent_at_rest_continuous_and_friction_at_speed() {
    if !there("cc") {
        return;
    }
    let robot = robots()[2].clone();
    let effects = vec![named(
        &robot,
        "stribeck",
        Some("x"),
        &[("vs", 0.05), ("c", 4.0)],
    )];
    let refined = AugmentedModel {
        model: model(robot),
        effects,
    };
    let program = Program::with_effects(&refined).unwrap();
    let rest = program.rest[0];
    let folder = tempfile::tempdir().unwrap();
    let header = export::header::header(&program, "slide", &note(&refined.model));
    std::fs::write(folder.path().join("slide.h"), header).unwrap();
    // noise at rest; desired speeds through 0; measured speeds through 0 at rest; both at speed
    let driver = format!(
        "#include <stdio.h>\n#include \"slide.h\"\nint main(void)\n{{\n  \
         double r = {rest:?}, none[1] = {{0.0}}, worst = 0.0, jump = 0.0, last[2], off = 0.0;\n  int k;\n  \
         for (k = -1000; k <= 1000; k++) {{\n    double v[1], t[2][1], f[1], big[1];\n    \
         v[0] = 0.999e-3 * k * r;\n    slide_friction_compensation(v, none, t[0]);\n    \
         if (fabs(t[0][0]) > worst) worst = fabs(t[0][0]);\n    v[0] = 4e-3 * k * r;\n    \
         slide_friction_compensation(none, v, t[0]);\n    slide_friction_compensation(v, none, t[1]);\n    \
         if (k > -1000 && fabs(t[0][0] - last[0]) > jump) jump = fabs(t[0][0] - last[0]);\n    \
         if (k > -1000 && fabs(t[1][0] - last[1]) > jump) jump = fabs(t[1][0] - last[1]);\n    \
         last[0] = t[0][0];\n    last[1] = t[1][0];\n    big[0] = (k < 0 ? -2.0 : 2.0) * r + 1e-2 * k * r;\n    \
         slide_friction_compensation(big, big, t[0]);\n    slide_friction(big, f);\n    \
         if (fabs(t[0][0] - f[0]) > off) off = fabs(t[0][0] - f[0]);\n  }}\n  \
         printf(\"%.17g %.17g %.17g\", worst, jump, off);\n  return 0;\n}}\n"
    );
    std::fs::write(folder.path().join("driver.c"), driver).unwrap();
    run(Command::new("cc").current_dir(folder.path()).args([
        "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", "driver", "driver.c", "-lm",
    ]));
    let text = String::from_utf8(run(&mut Command::new(folder.path().join("driver")))).unwrap();
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|x| x.parse().unwrap())
        .collect();
    let [worst, jump, off] = numbers[..] else {
        panic!("{text}")
    };
    assert_eq!(worst, 0.0, "noise below the speed of rest switches nothing");
    // 3 + 4 N over one speed of rest, of which a step is 1/250
    assert!(jump < 0.06, "{jump}");
    assert_eq!(off, 0.0);
}
