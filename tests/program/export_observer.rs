//! The observer in exported C and Rust gives the lines of `watch` along a measured log.

#[allow(dead_code)] // each test uses its share
use crate::export_support;

use assert_cmd::Command as Tool;
use cft_ident::config::model_file::{EffectParameter, EffectSection};
use cft_ident::export::{self, Program};
use cft_ident::identify::{
    Control, Dataset, GivenModel, Log, LsqSettings, RobotSetup, RowSource, WatchSettings, lsq,
    watch, watch_recipe,
};
use export_support::{note, run, there};
use std::path::Path;
use std::process::Command;

const STEP: f64 = 0.008;
const PER_HOUR: f64 = 60.0;
const N: usize = 6;

/// Positions and torques of the measured UR10, row by row.
fn measured(folder: &Path) -> Vec<[[f64; N]; 2]> {
    let mut tool = Tool::cargo_bin("cft-ident").unwrap();
    let line = ["example", "ur10"];
    tool.current_dir(folder).args(line).assert().success();
    let text = std::fs::read_to_string(folder.join("ur10/ur10.csv")).unwrap();
    let row = |line: &str| {
        let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        [1, 13].map(|first| std::array::from_fn(|j| x[first + j]))
    };
    text.lines().skip(1).map(row).collect()
}

fn log(name: &str, rows: &[[[f64; N]; 2]]) -> Log {
    let t: Vec<f64> = (0..rows.len()).map(|k| STEP * k as f64).collect();
    let flat = |part: usize| -> Vec<f64> { rows.iter().flat_map(|row| row[part]).collect() };
    Log::of_rows(name, &t, &flat(0), &flat(1)).unwrap()
}

/// Of each row: time, external torques, deviations.
type Lines = Vec<(f64, [f64; N], [f64; N])>;

struct Case {
    program: Program,
    units: export::Note,
    lines: Lines,
}

/// An effect as a model file holds it.
fn effect(name: &str, joint: &str, numbers: &[(&str, f64)]) -> EffectSection {
    let number = |value| EffectParameter {
        value,
        std: None,
        unit: String::new(),
        bound: false,
    };
    EffectSection {
        name: name.to_owned(),
        joint: Some(joint.to_owned()),
        shrinkage: None,
        prediction_only: false,
        accepted_by_user: false,
        parameters: (numbers.iter())
            .map(|(key, value)| ((*key).to_owned(), number(*value)))
            .collect(),
    }
}

fn case(given: &GivenModel, unseen: &[[[f64; N]; 2]]) -> Case {
    let control = Control::default();
    let settings = WatchSettings {
        per_hour: PER_HOUR,
        unloaded: &[],
    };
    let mut lines = Lines::new();
    let mut take = |line: &cft_ident::identify::WatchLine| {
        let of = |x: &[f64]| -> [f64; N] { x.try_into().unwrap() };
        lines.push((line.t, of(line.external), of(line.std)));
        true
    };
    let input = RowSource::Log(log("unseen", unseen));
    let found = watch(given, input, &settings, &control, &mut take).unwrap();
    let recipe = watch_recipe(given, STEP, PER_HOUR).unwrap();
    assert!((found.delay_s.unwrap() - recipe.delay_s).abs() < 1e-9);
    for (joint, own) in found.joints.iter().zip(&recipe.joints) {
        let most = own.std.iter().fold(0.0f64, |m, std| m.max(*std)) * own.limit;
        assert!((joint.threshold[1] - most).abs() <= 1e-12 * most);
    }
    let model = given.numbers().unwrap();
    let mut program = Program::with_effects(&model).unwrap();
    program.observer = Some(recipe);
    Case {
        program,
        units: note(&model.model),
        lines,
    }
}

/// Of each row: external torques, deviations, bands and limits, and whether there are some.
fn compare(language: &str, case: &Case, bytes: &[u8], rows: usize) {
    let numbers: Vec<f64> = (bytes.chunks_exact(8))
        .map(|x| f64::from_ne_bytes(x.try_into().unwrap()))
        .collect();
    let width = 4 * N + 1;
    assert_eq!(numbers.len(), width * rows);
    let found: Vec<&[f64]> = numbers.chunks_exact(width).collect();
    let shown = found.iter().filter(|row| row[4 * N] > 0.0).count();
    assert_eq!(shown, case.lines.len(), "{language}");
    assert!(shown > rows / 2);
    let of_joints = &case.program.observer.as_ref().unwrap().joints;
    let mut worst = 0.0f64;
    for (t, external, std) in &case.lines {
        let row = found[(t / STEP).round() as usize];
        let mut beyond = false;
        for j in 0..N {
            worst = worst.max((row[j] - external[j]).abs());
            let same = |x: f64, y: f64| (x - y).abs() <= 1e-11 * y;
            assert!(same(row[N + j], std[j]), "{language}");
            assert_eq!(row[2 * N + j], row[N + j] * of_joints[j].band);
            assert_eq!(row[3 * N + j], row[N + j] * of_joints[j].limit);
            beyond |= external[j].abs() > row[3 * N + j];
        }
        assert_eq!(
            row[4 * N],
            if beyond { 2.0 } else { 1.0 },
            "{language} at {t}"
        );
    }
    eprintln!("{language}: {worst:.1e} Nm");
    assert!(worst < 1e-9, "{language}: {worst:e}");
}

const IN_C: &str = "#include <stdio.h>\n#include \"arm.h\"\nint main(void)\n{\n  double x[12], code;\n  \
    arm_observer o;\n  arm_observed out = {{0.0}, {0.0}, {0.0}, {0.0}};\n  FILE *f = fopen(\"rows.bin\", \"rb\");\n  \
    if (!f) return 1;\n  arm_observer_init(&o);\n  while (fread(x, sizeof(double), 12, f) == 12) {\n    \
    code = arm_observe(&o, x, x + 6, &out);\n    fwrite(&out, sizeof(double), 24, stdout);\n    \
    fwrite(&code, sizeof(double), 1, stdout);\n  }\n  return fclose(f);\n}\n";
const IN_RUST: &str = "use std::io::Write;\n#[allow(dead_code)]\nmod arm;\nfn main() {\n  \
    let x = std::fs::read(\"rows.bin\").unwrap();\n  let mut out = std::io::BufWriter::new(std::io::stdout());\n  \
    let mut o = arm::Observer::default();\n  for row in x.chunks_exact(96) {\n    \
    let at = |part: usize| -> [f64; 6] {\n      std::array::from_fn(|j| {\n        let at = 8 * (6 * part + j);\n        \
    f64::from_ne_bytes(row[at..at + 8].try_into().unwrap())\n      })\n    };\n    let mut y = [0.0; 25];\n    \
    if let Some(seen) = o.take(&at(0), &at(1)) {\n      \
    for (k, x) in [seen.external, seen.std, seen.band, seen.limit].iter().enumerate() {\n        \
    y[6 * k..6 * k + 6].copy_from_slice(x);\n      }\n      y[24] = if seen.beyond { 2.0 } else { 1.0 };\n    }\n    \
    for x in y {\n      out.write_all(&x.to_ne_bytes()).unwrap();\n    }\n  }\n}\n";

#[test]
fn compiled_observers_give_the_lines_of_watch_and_models_without_held_out_data_give_none() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let rows = measured(path);
    let (fitted, unseen) = rows.split_at(rows.len() * 7 / 10);
    let machine = RobotSetup::load("configs/ur10.toml").unwrap();
    let logs = [log("fitted", fitted)];
    let found = lsq(
        &Dataset::read(&machine, &logs, &Control::default()).unwrap(),
        &LsqSettings::default(),
        &Control::default(),
    )
    .unwrap();
    let plain = GivenModel::new("model.toml", found.model(&machine, None));
    // torques that come late and early, and one that remembers the motion
    let mut late = plain.clone();
    late.file.effects.extend([
        effect("delay", "q1", &[("d", 0.0113)]),
        effect("delay", "q3", &[("d", -0.0051)]),
        effect("backlash", "q2", &[("c", 3.0), ("gap", 0.004)]),
    ]);
    let bytes = unseen.iter().flatten().flatten().copied();
    let bytes: Vec<u8> = bytes.flat_map(f64::to_ne_bytes).collect();
    std::fs::write(path.join("rows.bin"), bytes).unwrap();
    std::fs::write(path.join("driver.c"), IN_C).unwrap();
    std::fs::write(path.join("driver.rs"), IN_RUST).unwrap();
    for given in [&plain, &late] {
        let case = case(given, unseen);
        let header = export::header::header(&case.program, "arm", &case.units);
        let module = export::module::module(&case.program, &case.units);
        for forbidden in ["alloc(", "Vec<", "vec!", "Box"] {
            assert!(!header.contains(forbidden) && !module.contains(forbidden));
        }
        std::fs::write(path.join("arm.h"), header).unwrap();
        std::fs::write(path.join("arm.rs"), module).unwrap();
        let by = |program: &str| run(Command::new(path.join(program)).current_dir(path));
        if there("cc") {
            let flags = "-std=c99 -pedantic -Wall -Wextra -Werror -ffp-contract=off -O1 -o by_c driver.c -lm";
            run(Command::new("cc").current_dir(path).args(flags.split(' ')));
            compare("C", &case, &by("by_c"), unseen.len());
        }
        if there("rustc") {
            let flags = "--edition 2021 -D warnings -o by_rust driver.rs";
            run(Command::new("rustc")
                .current_dir(path)
                .args(flags.split(' ')));
            compare("Rust", &case, &by("by_rust"), unseen.len());
        }
    }
    let mut old = GivenModel::new("old.toml", plain.file);
    old.file.held_out.clear();
    let shown = watch_recipe(&old, STEP, PER_HOUR);
    let shown = shown.unwrap_err().to_string();
    assert!(
        shown.contains("old.toml") && shown.contains("fit it again"),
        "{shown}"
    );
}
