//! Exported code, compiled and run along motions that are handed over as a file of numbers.

use cft_ident::effect::{self, AugmentedModel, ModelEffect};
use cft_ident::export::{self, Note, Program};
use cft_ident::motion::Stretch;
use cft_ident::robot::Robot;
use cft_ident::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::robot::standard::Body;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// A model, the motion it is tried along, and a name for both.
pub struct Case {
    pub name: String,
    pub model: AugmentedModel,
    pub along: Stretch,
}

/// Joints that swing at frequencies of their own and come to rest now and then: 600 samples.
pub fn swing(n: usize) -> Stretch {
    let (samples, dt) = (600, 0.005);
    let mut out = Stretch {
        dt,
        began: 0.4,
        t: (0..samples).map(|k| 3.0 + dt * f64::from(k)).collect(),
        ..Stretch::default()
    };
    for j in 0..n {
        let (w, size) = (2.0 + 0.7 * j as f64, 0.6 - 0.05 * j as f64);
        let at = |k: usize| 0.4 + dt * k as f64;
        let each = |f: &dyn Fn(f64) -> f64| (0..samples as usize).map(|k| f(at(k))).collect();
        out.q.push(each(&|t| 0.4 + size * (w * t).sin()));
        let mut v: Vec<f64> = each(&|t| size * w * (w * t).cos());
        for v in &mut v[200..220] {
            *v = 0.0;
        }
        out.v.push(v);
        out.a.push(each(&|t| -size * w * w * (w * t).sin()));
        out.tau.push(vec![0.0; samples as usize]);
    }
    out
}

/// A model of bodies that can be, with friction of both laws in turn.
pub fn model(robot: Robot) -> Model {
    let n = robot.joints();
    let mut standard = Vec::new();
    for i in 0..robot.tree().links().len() {
        let x = i as f64;
        let body = Body {
            mass: 2.0 + 0.3 * x,
            centre: [0.05 * x, -0.03, 0.1 - 0.02 * x],
            inertia: [0.03, 0.001, -0.002, 0.04 + 0.01 * x, 0.0, 0.05],
        };
        standard.extend(body.standard());
    }
    let drives = standard.len()..robot.standard_parameters();
    standard.extend(drives.map(|i| 0.1 + 0.01 * (i % 7) as f64));
    let mut theta = robot.base_of(&standard);
    theta.extend((theta.len()..robot.parameters().len()).map(|i| 0.1 + 0.02 * (i % 5) as f64));
    let friction = (0..n).map(|j| match j % 2 {
        0 => JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 2.0,
            coulomb: 3.0 + 0.2 * j as f64,
        }),
        _ => JointFriction::DoubleTanh(DoubleTanh {
            viscous: 1.5,
            coulomb_1: 2.0,
            coulomb_2: -0.4,
            slope_1: 80.0,
            slope_2: 9.0,
        }),
    });
    Model {
        theta,
        friction: friction.collect(),
        offset: (0..n).map(|j| 0.1 * j as f64 - 0.2).collect(),
        robot,
    }
}

/// An effect with the numbers given, as a model file has it.
pub fn named(
    robot: &Robot,
    name: &str,
    joint: Option<&str>,
    numbers: &[(&str, f64)],
) -> ModelEffect {
    let given: BTreeMap<String, f64> = numbers
        .iter()
        .map(|(key, value)| ((*key).to_owned(), *value))
        .collect();
    effect::read(robot, name, joint, &given).unwrap()
}

/// Whether a compiler is there; says so where it is not.
pub fn there(compiler: &str) -> bool {
    let found = Command::new(compiler).arg("--version").output();
    let found = found.is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("skipped: there is no `{compiler}` here");
    }
    found
}

/// What a command writes; it must end well and say nothing else.
pub fn run(command: &mut Command) -> Vec<u8> {
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert!(errors.is_empty(), "{errors}");
    output.stdout
}

pub fn note(model: &Model) -> Note {
    let units = 0..model.robot.joints();
    Note {
        lines: vec!["of a test".to_owned()],
        torque_units: units
            .map(|j| model.robot.joint_unit(j).to_owned())
            .collect(),
    }
}

/// q, v and a, and temperatures where there are some, sample by sample, as bytes.
fn motion(s: &Stretch) -> Vec<u8> {
    let rows = (0..s.len()).flat_map(|k| {
        let channels = [&s.q, &s.v, &s.a, &s.temperature].into_iter().flatten();
        channels.map(move |channel| channel[k])
    });
    rows.flat_map(f64::to_ne_bytes).collect()
}

/// Channels of each joint in it, and whether temperatures are among them.
fn channels(s: &Stretch) -> (usize, bool) {
    let warm = !s.temperature.is_empty();
    (3 + usize::from(warm), warm)
}

/// Torques of every case by its C header: `[case][joint][sample]`.
pub fn by_c(folder: &Path, cases: &[Case]) -> Vec<Vec<Vec<f64>>> {
    let mut driver = String::from("#include <stdio.h>\n");
    let mut calls = String::new();
    for (i, case) in cases.iter().enumerate() {
        let (n, samples) = (case.along.joints(), case.along.len());
        let program = Program::with_effects(&case.model).unwrap();
        let header = export::header::header(&program, &format!("m{i}"), &note(&case.model.model));
        let about = match header.contains("_about(") {
            true => format!("    if (k == 0) m{i}_about(&s, middle);\n"),
            false => String::new(),
        };
        std::fs::write(folder.join(format!("m{i}.h")), header).unwrap();
        std::fs::write(folder.join(format!("m{i}.bin")), motion(&case.along)).unwrap();
        let (parts, warm) = channels(&case.along);
        let (row, middle) = (parts * n, parts * n * (samples / 2));
        let temperature = match warm {
            true => format!(", x + 3 * {n}"),
            false => String::new(),
        };
        let _ = write!(
            driver,
            "#include \"m{i}.h\"\nstatic int run{i}(void)\n{{\n  double x[{row}], t[{n}], middle[{row}];\n  \
             int k;\n  m{i}_state s;\n  FILE *f = fopen(\"m{i}.bin\", \"rb\");\n  \
             if (!f || fseek(f, {middle}L * (long)sizeof(double), SEEK_SET)) return 1;\n  \
             if (fread(middle, sizeof(double), {row}, f) != {row}) return 1;\n  rewind(f);\n  \
             for (k = 0; k < {samples}; k++) {{\n    if (fread(x, sizeof(double), {row}, f) != {row}) return 1;\n    \
             if (k == 0) {{ m{i}_init(&s, x); s.t = {began:?}; }}\n{about}    \
             m{i}_step(&s, {dt:?}, x, x + {n}, x + 2 * {n}{temperature}, t);\n    \
             fwrite(t, sizeof(double), {n}, stdout);\n  }}\n  (void)middle;\n  fclose(f);\n  return 0;\n}}\n",
            began = case.along.began,
            dt = case.along.dt,
        );
        let _ = write!(calls, " || run{i}()");
    }
    let _ = write!(driver, "int main(void)\n{{\n  return 0{calls};\n}}\n");
    std::fs::write(folder.join("driver.c"), driver).unwrap();
    let flags = [
        "-std=c99",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-ffp-contract=off",
        "-O1",
    ];
    let mut cc = Command::new("cc");
    run(cc
        .current_dir(folder)
        .args(flags)
        .args(["-o", "by_c", "driver.c", "-lm"]));
    split(
        cases,
        &run(Command::new(folder.join("by_c")).current_dir(folder)),
    )
}

/// The same by their Rust modules.
pub fn by_rust(folder: &Path, cases: &[Case]) -> Vec<Vec<Vec<f64>>> {
    let mut driver = String::from("use std::io::Write;\n");
    let mut calls = String::new();
    for (i, case) in cases.iter().enumerate() {
        let (n, samples) = (case.along.joints(), case.along.len());
        let program = Program::with_effects(&case.model).unwrap();
        let module = export::module::module(&program, &note(&case.model.model));
        let about = match module.contains("fn about(") {
            true => format!("    m{i}::about(&mut s, &at({}, 0));\n", samples / 2),
            false => String::new(),
        };
        std::fs::write(folder.join(format!("m{i}.rs")), module).unwrap();
        std::fs::write(folder.join(format!("m{i}.bin")), motion(&case.along)).unwrap();
        let _ = writeln!(driver, "#[allow(dead_code)]\nmod m{i};");
        let (parts, warm) = channels(&case.along);
        let temperature = if warm { ", &at(k, 3)" } else { "" };
        let _ = write!(
            calls,
            "  {{\n    let x = std::fs::read(\"m{i}.bin\").unwrap();\n    \
             let at = |k: usize, part: usize| -> [f64; {n}] {{\n      std::array::from_fn(|j| {{\n        \
             let at = 8 * ({parts} * {n} * k + part * {n} + j);\n        \
             f64::from_ne_bytes(x[at..at + 8].try_into().unwrap())\n      }})\n    }};\n    \
             let mut s = m{i}::init(&at(0, 0));\n{about}    s.t = {began:?};\n    \
             for k in 0..{samples} {{\n      for x in m{i}::step(&mut s, {dt:?}, &at(k, 0), &at(k, 1), &at(k, 2){temperature}) {{\n        \
             out.write_all(&x.to_ne_bytes()).unwrap();\n      }}\n    }}\n  }}\n",
            began = case.along.began,
            dt = case.along.dt,
        );
    }
    let _ = write!(
        driver,
        "fn main() {{\n  let mut out = std::io::BufWriter::new(std::io::stdout());\n{calls}}}\n"
    );
    std::fs::write(folder.join("driver.rs"), driver).unwrap();
    let mut rustc = Command::new("rustc");
    run(rustc
        .current_dir(folder)
        .args(["--edition", "2021", "-D", "warnings", "-o", "by_rust"])
        .arg("driver.rs"));
    split(
        cases,
        &run(Command::new(folder.join("by_rust")).current_dir(folder)),
    )
}

fn split(cases: &[Case], bytes: &[u8]) -> Vec<Vec<Vec<f64>>> {
    let numbers = bytes.chunks_exact(8);
    let mut numbers = numbers.map(|x| f64::from_ne_bytes(x.try_into().unwrap()));
    let mut each = |case: &Case| {
        let n = case.along.joints();
        let mut out = vec![Vec::new(); n];
        for _ in 0..case.along.len() {
            for channel in &mut out {
                channel.push(numbers.next().unwrap());
            }
        }
        out
    };
    cases.iter().map(&mut each).collect()
}

/// Holds torques of every case against the tool's, before any shift in time: at most 1e-10 of each
/// joint's rms.
pub fn compare(language: &str, cases: &[Case], found: &[Vec<Vec<f64>>]) {
    for (case, found) in cases.iter().zip(found) {
        let wanted = case.model.torques(&case.along).hat;
        let mut worst: f64 = 0.0;
        for (found, wanted) in found.iter().zip(&wanted) {
            let square = wanted.iter().map(|x| x * x).sum::<f64>() / wanted.len() as f64;
            assert!(square > 0.0, "{}", case.name);
            for (x, y) in found.iter().zip(wanted) {
                worst = worst.max((x - y).abs() / square.sqrt());
            }
        }
        eprintln!("{language}, {}: {worst:.1e} of the rms", case.name);
        assert!(worst < 1e-10, "{language}, {}: {worst:e}", case.name);
    }
}
