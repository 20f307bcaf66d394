//! A Rust module: the same functions as the C header, with nothing but the standard library.

use std::fmt::Write;

use super::Program;
use super::code::{self, RUST, carried, fall, sines, without_memory};
use super::functions;
use super::note::Note;
use cft_ident_core::effect::as_code::{EffectsCode, INERTIA, StateVariable};

const TEMPLATE: &str = include_str!("module.rs.in");

const SINES: &str = "\
        for j in (0..SINES).filter(|j| SINE_OF[*j] == i) {
            let (mut x, mut dx) = (PHASE[j], 0.0);
            for k in 0..JOINTS {
                x += SINE_K[j][k] * q[k];
                dx += SINE_K[j][k] * v[k];
            }
            let (s, c) = x.sin_cos();
            u += AMPLITUDE[j] * s;
            ddu -= AMPLITUDE[j] * s * dx * dx;
            for k in 0..JOINTS {
                slope[i][k] += AMPLITUDE[j] * c * SINE_K[j][k];
            }
        }
";

/// The text of a module with `tau`, `gravity`, `friction`, `rigid`, and `step` for what remembers.
pub fn module(program: &Program, note: &Note) -> String {
    let effects = &program.effects;
    let mutable = "let mut slope = LINEAR;";
    let (constant, loops, slope) = match sines(program).len() {
        0 => (String::new(), "", "let slope = LINEAR;"),
        s => (format!("const SINES: usize = {s};\n"), SINES, mutable),
    };
    let [friction, drives, added] = [code::friction, code::drives, code::added].map(|f| f(program));
    let called = [&friction, &drives, &added, &effects.steps, &effects.askew].map(Vec::as_slice);
    let mut tables = RUST.tables(program);
    tables += &RUST.bodies("BODY", &program.bodies);
    tables += &RUST.vector("FALL", &fall(program));
    let (mut fields, mut init) = (String::new(), String::new());
    for memory in &effects.memory {
        let StateVariable { name, first, .. } = memory;
        let _ = writeln!(fields, "    /// {}", memory.what);
        let (kind, first) = match memory.size {
            None => ("f64".to_owned(), first.clone()),
            Some(n) => (format!("[f64; {n}]"), format!("[{first}; {n}]")),
        };
        let _ = writeln!(fields, "    pub {name}: {kind},");
        let _ = writeln!(init, "        {name}: {first},");
    }
    let about = about(effects);
    let begin = match about.is_empty() {
        true => "",
        false => "    about(&mut state, q);\n",
    };
    let beside = beside(program);
    let (besides, weight) = match beside.is_empty() {
        true => ("", ""),
        false => (
            "    beside(q, v, a, &mut tau);\n",
            "    beside(q, &[0.0; JOINTS], &[0.0; JOINTS], &mut tau);\n",
        ),
    };
    // a mark on a line of its own leaves no empty line
    let line = |text: String| match text.is_empty() {
        true => String::new(),
        false => text + "\n",
    };
    let observer = program.observer.as_ref();
    let observer = observer.map_or(String::new(), |recipe| recipe.in_rust(program));
    let text = TEMPLATE.replace("@OBSERVER@\n", &observer);
    RUST.with_inputs(&text, effects)
        .replace("@TABLES@\n", &tables)
        .replace("@BESIDE@", &beside)
        .replace("@WEIGHT@\n", weight)
        .replace("@CARRIED@", carried(program))
        .replace("@SINES_CONST@\n", &constant)
        .replace(mutable, slope)
        .replace("@SINES@\n", loops)
        .replace("@HELPERS@", &functions::in_rust(&called))
        .replace("@FRICTION@", &RUST.statements(&friction))
        .replace("@DRIVES@\n", &line(RUST.statements(&drives)))
        .replace(
            "@ADDED@\n",
            &(besides.to_owned() + &line(RUST.statements(&added))),
        )
        .replace("@REST@", &RUST.list(&program.rest))
        .replace(
            "@WITHOUT_MEMORY@",
            &without_memory(effects).replace(" * ", "/// "),
        )
        .replace("@FIELDS@\n", &fields)
        .replace("@ABOUT@", &about)
        .replace("@INIT@\n", &init)
        .replace("@BEGIN@\n", begin)
        .replace("@MEMORY@\n", &line(RUST.statements(&effects.steps)))
        .replace("@LEAD@", &lead(program))
        .replace("@N@", &program.joints.len().to_string())
        .replace("@L@", &program.tree.links().len().to_string())
        // last, so that no name in it is taken for a mark
        .replace("@HEADER@", &RUST.header(program, note))
}

fn lead(program: &Program) -> String {
    let late = &program.effects.lead_s;
    if late.iter().all(|d| *d == 0.0) {
        return String::new();
    }
    format!(
        "\n/// Seconds by which the torque in the logs came late, joint by joint: these functions give the torque\n\
         /// without it. Send it that much earlier.\npub const LEAD_S: [f64; JOINTS] = {};\n\n\
         /// The same in samples dt apart.\npub fn lead_samples(dt: f64) -> [f64; JOINTS] {{\n    \
         LEAD_S.map(|lead| lead / dt)\n}}\n",
        RUST.list(late)
    )
}

/// The function that takes the inertias of elastic joints from a pose.
fn about(effects: &EffectsCode) -> String {
    if effects.elastic.is_empty() {
        return String::new();
    }
    let mut out = "\n/// Elastic joints carry the inertia that they have in the pose q: that in the middle of the motion.\n\
                   pub fn about(state: &mut State, q: &[f64; JOINTS]) {\n    let none = [0.0; JOINTS];\n    \
                   let still = load(q, &none, &none);\n"
        .to_owned();
    for (j, field) in &effects.elastic {
        let _ = write!(
            out,
            "    let mut unit = none;\n    unit[{j}] = 1.0;\n    \
             state.{field}[{INERTIA}] = load(q, &none, &unit)[{j}] - still[{j}];\n"
        );
    }
    out + "}\n"
}

/// The function that adds the torque of bodies and of gravity that the model of the links does not know.
fn beside(program: &Program) -> String {
    let effects = &program.effects;
    if carried(program).is_empty() {
        return String::new();
    }
    let mut out = String::from("\n");
    if let Some(extra) = &effects.extra {
        out += &RUST.bodies("BESIDE", extra);
    }
    out += "\n/// Adds what bodies ask for that the links do not hold, and gravity that is not upright.\n\
            #[allow(clippy::needless_range_loop, unused_variables)]\n\
            fn beside(q: &[f64; JOINTS], v: &[f64; JOINTS], a: &[f64; JOINTS], tau: &mut [f64; JOINTS]) {\n";
    if let Some([x, y]) = effects.tilt {
        let _ = writeln!(
            out,
            "    let own = recursion(&BODY, &{}, q, &[0.0; JOINTS], &[0.0; JOINTS]);",
            RUST.list(&[-x, -y, 0.0])
        );
        out += ADD;
    }
    if effects.extra.is_some() {
        out += "    let own = recursion(&BESIDE, &FALL, q, v, a);\n";
        out += ADD;
    }
    out += &RUST.statements(&effects.askew);
    out.trim_end().to_owned() + "\n}\n"
}

const ADD: &str = "    for k in 0..JOINTS {\n        tau[k] += own[k];\n    }\n";
