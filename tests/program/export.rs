//! Exported models give the torques of the model: the C header as cc compiles it, the Rust module as
//! rustc does, the URDF as it is read back.

mod sources;
mod sources_kept;
mod urdf;
mod world;

use cft_ident::config::model_file::{LinkBody, ModelProvenance, Parameter};
use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::export::{self, Note, Program};
use cft_ident::robot::Robot;
use cft_ident::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::robot::standard::Body;
use predicates::prelude::PredicateBooleanExt;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use urdf::feasible;

const GANTRY: &str = "[robot]\nmodel = \"serial\"\nurdf = \"gantry.urdf\"\n\
    coupling = [{ motor = \"elbow\", other = \"shoulder\", ratio = -0.8 }]\n";

fn fixtures(folder: &str) -> std::path::PathBuf {
    Path::new(cft_ident_support::ROOT)
        .join("fixtures")
        .join(folder)
}

fn gantry() -> RobotFile {
    RobotFile::parse_in("gantry.toml", GANTRY, Some(&fixtures("urdf"))).unwrap()
}

fn parsed(text: &str) -> Robot {
    RobotFile::parse("robot.toml", text).unwrap().robot()
}

struct Draw(ChaCha8Rng);

impl Draw {
    fn one(&mut self, size: f64) -> f64 {
        size * (2.0 * self.0.random::<f64>() - 1.0)
    }

    fn many(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.one(size)).collect()
    }
}

/// A model with random numbers; friction that takes power at every speed, double-tanh or viscous and Coulomb.
fn model(robot: Robot, smooth: bool, seed: u64) -> Model {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
    let n = robot.joints();
    let friction = (0..n).map(|_| match smooth {
        true => JointFriction::DoubleTanh(DoubleTanh {
            viscous: 5.0 + draw.one(5.0),
            coulomb_1: 3.0 + draw.one(3.0),
            coulomb_2: 2.0 + draw.one(2.0),
            slope_1: 50.0 + draw.one(20.0),
            slope_2: 5.0 + draw.one(2.0),
        }),
        false => JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 5.0 + draw.one(5.0),
            coulomb: 3.0 + draw.one(3.0),
        }),
    });
    let friction = friction.collect();
    Model {
        theta: draw.many(robot.parameters().len(), 4.0),
        friction,
        offset: draw.many(n, 1.0),
        robot,
    }
}

/// The models that are exported, with a name each.
fn models() -> Vec<(&'static str, Model)> {
    let cft = |parameters| {
        parsed(&format!(
            "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\nparameters = {parameters}\n"
        ))
    };
    let chain = include_str!("../../fixtures/robots/cft-chain.toml");
    let mut bare = model(gantry().robot(), false, 5);
    bare.friction.fill(JointFriction::None);
    bare.offset.fill(0.0);
    vec![
        ("cft_12", model(cft(12), true, 1)),
        ("cft_22", model(cft(22), true, 2)),
        ("gantry", model(gantry().robot(), false, 3)),
        ("chain", model(parsed(chain), true, 4)),
        ("bare", bare),
        (
            "slide",
            model(
                parsed("[robot]\nmodel = \"single-joint\"\njoint = \"x\"\nkind = \"prismatic\"\n"),
                false,
                6,
            ),
        ),
    ]
}

type State = [Vec<f64>; 3];

fn states(n: usize, seed: u64) -> Vec<State> {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
    let mut out: Vec<State> = (0..40)
        .map(|_| [draw.many(n, 2.0), draw.many(n, 2.0), draw.many(n, 8.0)])
        .collect();
    // at rest the sign of the velocity is 0
    out[0][1].fill(0.0);
    out
}

/// Torques of the model, and the size of the terms that the largest of them is the sum of.
fn torque(model: &Model, [q, v, a]: &State) -> (Vec<f64>, f64) {
    let (n, p) = (model.friction.len(), model.theta.len());
    let mut tau = vec![0.0; n];
    model.torque(q, v, a, &mut tau);
    let mut y = vec![0.0; n * p];
    model.robot.regressor(q, v, a, &mut y);
    let load = (0..n).map(|j| {
        let row = y[j * p..(j + 1) * p].iter().zip(&model.theta);
        row.map(|(y, t)| (y * t).abs()).sum::<f64>() + model.friction[j].torque(v[j]).abs()
    });
    // what is 0 by cancellation is 0 to the rounding of the others
    (tau, load.fold(1e-3, f64::max))
}

/// Compares lines of numbers, n of the torque and n of gravity alone, with the model.
fn compare(name: &str, model: &Model, states: &[State], text: &str) {
    let n = model.friction.len();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), states.len(), "{name}");
    let mut still = model.clone();
    still.friction.fill(JointFriction::None);
    still.offset.fill(0.0);
    let mut worst: f64 = 0.0;
    for (line, state) in lines.iter().zip(states) {
        let got: Vec<f64> = line
            .split_whitespace()
            .map(|x| x.parse().unwrap())
            .collect();
        let rest = [state[0].clone(), vec![0.0; n], vec![0.0; n]];
        let (tau, load) = torque(model, state);
        let (gravity, gravity_load) = torque(&still, &rest);
        for j in 0..n {
            worst = worst.max((got[j] - tau[j]).abs() / load);
            worst = worst.max((got[n + j] - gravity[j]).abs() / gravity_load);
        }
    }
    eprintln!("{name}: {worst:.1e} of the terms");
    assert!(worst < 1e-12, "{name}: {worst:e}");
}

/// Whether a compiler is there; says so where it is not.
fn there(compiler: &str) -> bool {
    let found = Command::new(compiler).arg("--version").output();
    let found = found.is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("skipped: there is no `{compiler}` here");
    }
    found
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert!(errors.is_empty(), "{errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// Numbers of C or Rust between the brackets given.
fn listed(values: &[f64], open: char, close: char) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    format!("{open}{}{close}", all.join(", "))
}

fn note(model: &Model) -> Note {
    Note {
        lines: vec!["of a test; nothing ends this */ comment".to_owned()],
        torque_units: (0..model.friction.len())
            .map(|j| model.robot.joint_unit(j).to_owned())
            .collect(),
    }
}

#[test]
fn the_c_header_gives_the_torques_of_the_model() {
    if !there("cc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, model) in models() {
        let n = model.friction.len();
        let states = states(n, 11);
        let header = export::header::header(&Program::of(&model), name, &note(&model));
        std::fs::write(folder.path().join(format!("{name}.h")), header).unwrap();
        let rows: Vec<String> = states
            .iter()
            .map(|s| {
                format!(
                    "{{{}}}",
                    s.each_ref().map(|x| listed(x, '{', '}')).join(", ")
                )
            })
            .collect();
        let driver = format!(
            "#include <stdio.h>\n#include \"{name}.h\"\n\
             static const double S[][3][{n}] = {{{}}};\n\
             int main(void) {{\n  size_t i; int j; double t[{n}], g[{n}];\n  \
             for (i = 0; i < sizeof S / sizeof S[0]; i++) {{\n    \
             {name}_tau(S[i][0], S[i][1], S[i][2], t);\n    {name}_gravity(S[i][0], g);\n    \
             for (j = 0; j < {n}; j++) printf(\"%.17g \", t[j]);\n    \
             for (j = 0; j < {n}; j++) printf(\"%.17g \", g[j]);\n    printf(\"\\n\");\n  }}\n  return 0;\n}}\n",
            rows.join(",\n")
        );
        let source = folder.path().join("driver.c");
        std::fs::write(&source, driver).unwrap();
        let program = folder.path().join(name);
        run(Command::new("cc")
            .args([
                "-std=c99",
                "-pedantic",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-ffp-contract=off",
            ])
            .args(["-O1", "-o"])
            .arg(&program)
            .arg(&source)
            .arg("-lm"));
        compare(name, &model, &states, &run(&mut Command::new(&program)));
    }
}

#[test]
fn the_rust_module_gives_the_torques_of_the_model() {
    if !there("rustc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut driver = String::new();
    let mut calls = String::new();
    let models = models();
    for (name, model) in &models {
        let n = model.friction.len();
        let text = export::module::module(&Program::of(model), &note(model));
        std::fs::write(folder.path().join(format!("{name}.rs")), text).unwrap();
        let _ = writeln!(driver, "#[allow(dead_code)]\nmod {name};");
        let rows: Vec<String> = states(n, 11)
            .iter()
            .map(|s| format!("[{}]", s.each_ref().map(|x| listed(x, '[', ']')).join(", ")))
            .collect();
        let _ = writeln!(
            calls,
            "  for [q, v, a] in [{}] {{\n    let t = {name}::tau(&q, &v, &a);\n    let g = {name}::gravity(&q);\n    \
             for x in t.iter().chain(&g) {{ print!(\"{{x:?}} \"); }}\n    println!();\n  }}",
            rows.join(",\n")
        );
    }
    let source = folder.path().join("driver.rs");
    std::fs::write(&source, format!("{driver}fn main() {{\n{calls}}}\n")).unwrap();
    let program = folder.path().join("driver");
    run(Command::new("rustc")
        .args(["--edition", "2021", "-D", "warnings", "-o"])
        .arg(&program)
        .arg(&source));
    let text = run(&mut Command::new(&program));
    let lines: Vec<&str> = text.lines().collect();
    for ((name, model), lines) in models.iter().zip(lines.chunks(40)) {
        let states = states(model.friction.len(), 11);
        compare(name, model, &states, &lines.join("\n"));
    }
}

#[test]
fn constants_stand_in_the_files_to_the_last_bit() {
    let model = model(gantry().robot(), false, 3);
    let program = Program::of(&model);
    let header = export::header::header(&program, "gantry", &note(&model));
    let module = export::module::module(&program, &note(&model));
    let own = program.bodies.iter().flatten().copied();
    let numbers = own.chain(
        program
            .tree
            .links()
            .iter()
            .flat_map(|l| l.rotation)
            .flatten(),
    );
    for x in numbers {
        let text = format!("{x:?}");
        assert_eq!(text.parse::<f64>().unwrap().to_bits(), x.to_bits());
        assert!(header.contains(&text) && module.contains(&text), "{text}");
    }
    assert!(header.contains("0  rail: q [m], v [m/s], a [m/s^2], tau [N]"));
    assert_eq!(header.matches("*/ comment").count(), 0);
}

/// The model file of a serial model.
fn file_of(robot: RobotFile, model: &Model) -> ModelFile {
    let parameter = |name: &str, joint: Option<&String>, value: f64| Parameter {
        name: name.to_owned(),
        theta: None,
        joint: joint.cloned(),
        value,
        consistent: None,
        std: Some(0.1),
        unit: String::new(),
        meaning: String::new(),
        verdict: None,
    };
    let mut parameters: Vec<Parameter> = model
        .robot
        .parameters()
        .iter()
        .zip(&model.theta)
        .map(|(info, value)| parameter(&info.name, None, *value))
        .collect();
    for (j, joint) in model.robot.joint_names().iter().enumerate() {
        match &model.friction[j] {
            JointFriction::None => {}
            JointFriction::ViscousCoulomb(law) => {
                parameters.push(parameter("viscous", Some(joint), law.viscous));
                parameters.push(parameter("coulomb", Some(joint), law.coulomb));
            }
            JointFriction::DoubleTanh(law) => {
                for (name, value) in DoubleTanh::NAMES.iter().zip(law.parameters()) {
                    parameters.push(parameter(name, Some(joint), value));
                }
            }
        }
        parameters.push(parameter("offset", Some(joint), model.offset[j]));
    }
    ModelFile {
        estimates: Vec::new(),
        estimate_covariance: None,
        friction_prior: Vec::new(),
        held_out: Vec::new(),
        excesses: None,
        robot,
        parameters,
        covariance: None,
        residual_std: Default::default(),
        effects: Vec::new(),
        links: Vec::new(),
        drive_inertia: Default::default(),
        candidates: Vec::new(),
        provenance: ModelProvenance::default(),
    }
}

#[test]
fn the_command_writes_its_files_with_effects_and_refuses_what_is_no_torque() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = feasible(gantry());
    let path = folder.path().join("model.toml");
    std::fs::write(&path, file.to_toml().unwrap()).unwrap();
    let command = |more: &[&str]| {
        assert_cmd::Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(folder.path())
            .arg("export")
            .args(match more.contains(&"-m") {
                true => &[][..],
                false => &["-m", "model.toml"],
            })
            .args(more)
            .assert()
    };
    command(&[
        "--c", "ff.h", "--rust", "ff.rs", "--urdf", "ff.urdf", "--json", "-",
    ])
    .success()
    .stdout(predicates::str::contains("\"cft-ident/export/1\""));
    for (name, said) in [
        ("ff.h", "Nothing of the model is left out."),
        ("ff.rs", "Nothing of the model is left out."),
        (
            "ff.urdf",
            "Not in the URDF, but in the model file beside it",
        ),
        ("ff.toml", "drive inertia of elbow, which Drake alone reads"),
    ] {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(text.contains("from model.toml (SHA-256 "), "{name}");
        assert!(text.contains(said), "{name}");
    }
    command(&[]).code(2);
    command(&["--c", "ff.txt"]).code(2);
    let mut effect = |name: &str, numbers: &[(&str, f64)]| {
        let number = |value| cft_ident::config::model_file::EffectParameter {
            value,
            std: None,
            unit: String::new(),
            bound: false,
        };
        let numbers = numbers
            .iter()
            .map(|(key, x)| ((*key).to_owned(), number(*x)));
        file.effects = vec![cft_ident::config::model_file::EffectSection {
            shrinkage: None,
            prediction_only: false,
            accepted_by_user: false,
            name: name.to_owned(),
            joint: Some("elbow".to_owned()),
            parameters: numbers.collect(),
        }];
        std::fs::write(&path, file.to_toml().unwrap()).unwrap();
    };
    effect("quantisation", &[]);
    command(&["--c", "refused.h"])
        .code(3)
        .stderr(predicates::str::contains("the grain of a logged channel"))
        .stderr(predicates::str::contains("--without-effects"));
    assert!(!folder.path().join("refused.h").exists());
    effect("ripple", &[("order", 3.0), ("sin", 0.2), ("cos", 0.1)]);
    command(&[
        "--c",
        "ripple.h",
        "--urdf",
        "ripple.urdf",
        "--mjcf",
        "ripple.xml",
    ])
    .success();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(read("ripple.h").contains("Effects: ripple of elbow."));
    assert!(read("ripple.urdf").contains("\n    ripple of elbow\n"));
    assert!(read("ripple.toml").contains("name = \"ripple\""));
    assert!(read("ripple.xml").contains("no log was given"));
    assert!(read("ripple.xml.left-out.toml").contains("what = \"ripple of elbow\""));
    // links that no body can be are for none of these
    let wild = file_of(gantry(), &model(gantry().robot(), false, 3));
    std::fs::write(folder.path().join("wild.toml"), wild.to_toml().unwrap()).unwrap();
    for option in [
        ["--mjcf", "wild.xml"],
        ["--sdf", "wild.sdf"],
        ["--usd", "wild.usda"],
    ] {
        command(&[&["-m", "wild.toml"], &option[..]].concat())
            .code(3)
            .stderr(
                predicates::str::contains("can be no body")
                    .and(predicates::str::contains("--unconstrained")),
            );
    }
    command(&["--c", "model.h", "--without-effects"]).success();
    let text = std::fs::read_to_string(folder.path().join("model.h")).unwrap();
    assert!(text.contains("NOT in here, though the model has it: ripple of elbow."));
}
