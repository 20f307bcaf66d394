//! A C99 header: feed-forward torque and gravity compensation, `static inline`; what remembers has a state
//! that the caller keeps.

use std::fmt::Write;

use super::Program;
use super::code::{self, C, carried, fall, sines, without_memory};
use super::functions;
use super::note::Note;
use cft_ident_core::effect::as_code::{EffectsCode, INERTIA};
use cft_ident_core::effect::law_text::exact;
use cft_ident_core::robot::model::JointFriction;

const TEMPLATE: &str = include_str!("header.h.in");

const SINES: &str = "\
        for (j = 0; j < S; j++) {
            double x = PHASE[j], dx = 0.0, s, c;
            if (SINE_OF[j] != i) continue;
            for (k = 0; k < N; k++) {
                x += SINE_K[j][k] * q[k];
                dx += SINE_K[j][k] * v[k];
            }
            s = sin(x);
            c = cos(x);
            u += AMPLITUDE[j] * s;
            ddu -= AMPLITUDE[j] * s * dx * dx;
            for (k = 0; k < N; k++) slope[i][k] += AMPLITUDE[j] * c * SINE_K[j][k];
        }";

/// The text of a header whose functions begin with `name`, a C identifier ([`identifier`]).
pub fn header(program: &Program, name: &str, note: &Note) -> String {
    let effects = &program.effects;
    let n = program.joints.len();
    let (constant, loops) = match sines(program).len() {
        0 => (String::new(), "        (void)0;"),
        s => (format!(", S = {s}"), SINES),
    };
    let [friction, drives, added] = [code::friction, code::drives, code::added].map(|f| f(program));
    let called = [&friction[..], &drives, &added, &effects.steps];
    let tables = C.tables(program);
    let mut fields = String::new();
    let mut init = Vec::new();
    for memory in &effects.memory {
        let (field, what) = (&memory.name, memory.what.replace("*/", "* /"));
        let size = memory.size.map_or(String::new(), |n| format!("[{n}]"));
        let _ = writeln!(fields, "    double {field}{size}; /* {what} */");
        let places: Vec<String> = match memory.size {
            None => vec![String::new()],
            Some(n) => (0..n).map(|i| format!("[{i}]")).collect(),
        };
        let each = places.iter();
        init.extend(each.map(|place| format!("state.{field}{place} = {};", memory.first)));
    }
    let about = about(effects);
    if !about.is_empty() {
        init.push("$about(state, q);".to_owned());
    }
    let unused = |used: bool, text: &str| match used {
        true => String::new(),
        false => format!("    {text}\n"),
    };
    let moves = program.friction.iter().any(|f| *f != JointFriction::None);
    let friction =
        unused(moves || !effects.friction.is_empty(), "(void)v;") + &C.statements(&friction);
    let timed = effects.steps.iter().any(|s| s.contains("dt"));
    let steps = unused(timed, "(void)load;") + &C.statements(&effects.steps);
    let begin = unused(init.iter().any(|s| s.contains('q')), "(void)q;") + &C.statements(&init);
    let beside = beside(program);
    let (besides, weight) = match beside.is_empty() {
        true => ("", ""),
        false => (
            "    @name@_beside(q, v, a, tau);\n",
            "    @name@_beside(q, none, none, tau);",
        ),
    };
    let observer = program.observer.as_ref();
    let observer = observer.map_or(String::new(), |recipe| recipe.in_c(program));
    let text = TEMPLATE.replace("@OBSERVER@\n", &observer);
    C.with_inputs(&text, effects)
        .replace("@TABLES@", tables.trim_end())
        .replace("@BODY@", C.bodies("BODY", &program.bodies).trim_end())
        .replace("@FALL@", C.vector("FALL", &fall(program)).trim_end())
        .replace("@BESIDE@", &beside)
        .replace("@WEIGHT@\n", &format!("{weight}\n"))
        .replace("@CARRIED@", carried(program))
        .replace("@SINES_CONST@", &constant)
        .replace("@SINES@", loops)
        .replace("@HELPERS@", &functions::in_c(&called))
        .replace("@FRICTION@", &friction)
        .replace("@DRIVES@", &C.statements(&drives))
        .replace("@ADDED@", &format!("{besides}{}", C.statements(&added)))
        .replace("@REST@", &C.list(&program.rest))
        .replace("@WITHOUT_MEMORY@", without_memory(effects))
        .replace("@FIELDS@", fields.trim_end())
        .replace("@ABOUT@", &about)
        .replace("@INIT@", &begin)
        .replace("@MEMORY@", &steps)
        .replace("@LEAD@", &lead(program))
        .replace("@N@", &n.to_string())
        .replace("@L@", &program.tree.links().len().to_string())
        .replace("@name@", name)
        .replace("@GUARD@", &name.to_uppercase())
        // last, so that no name in it is taken for a mark
        .replace("@HEADER@", &C.header(program, note))
}

/// Constants of the time by which each torque is late.
fn lead(program: &Program) -> String {
    let late = &program.effects.lead_s;
    if late.iter().all(|d| *d == 0.0) {
        return String::new();
    }
    let mut out = "\n/* Seconds by which the torque in the logs came late, joint by joint: these functions give the torque\n \
                   * without it. Send it that much earlier; LEAD_SAMPLES are the same in samples dt apart. */\n"
        .to_owned();
    for (j, d) in late.iter().enumerate() {
        let d = exact(*d);
        let _ = write!(
            out,
            "#define @GUARD@_LEAD_S_{j} ({d})\n#define @GUARD@_LEAD_SAMPLES_{j}(dt) (@GUARD@_LEAD_S_{j} / (dt))\n"
        );
    }
    out
}

/// The function that takes the inertias of elastic joints from a pose.
fn about(effects: &EffectsCode) -> String {
    if effects.elastic.is_empty() {
        return String::new();
    }
    let mut lines = vec![
        "double none[@N@] = {0.0}, still[@N@], pushed[@N@];".to_owned(),
        "$load(q, none, none, still);".to_owned(),
    ];
    for (j, field) in &effects.elastic {
        lines.extend([
            "{".to_owned(),
            "    double unit[@N@] = {0.0};".to_owned(),
            format!("    unit[{j}] = 1.0;"),
            "    $load(q, none, unit, pushed);".to_owned(),
            format!("    state.{field}[{INERTIA}] = pushed[{j}] - still[{j}];"),
            "}".to_owned(),
        ]);
    }
    format!(
        "\n/* Elastic joints carry the inertia that they have in the pose q: that in the middle of the motion. */\n\
         static inline void @name@_about(@name@_state *state, const double q[@N@])\n{{\n{}\n}}\n",
        C.statements(&lines)
    )
}

/// The function that adds the torque of bodies and of gravity that the model of the links does not know.
fn beside(program: &Program) -> String {
    let effects = &program.effects;
    if carried(program).is_empty() {
        return String::new();
    }
    let mut out = "\n/* Adds what bodies ask for that the links do not hold, and gravity that is not upright. */\n\
                   static inline void @name@_beside(const double q[@N@], const double v[@N@], const double a[@N@],\n\
                   \x20                                double tau[@N@])\n{\n"
        .to_owned();
    if let Some(extra) = &effects.extra {
        out += &C.bodies("BESIDE", extra);
        out += &C.vector("FALL", &fall(program));
    }
    if let Some([x, y]) = effects.tilt {
        out += &C.vector("ASKEW", &[-x, -y, 0.0]);
    }
    if effects.extra.is_some() || effects.tilt.is_some() {
        out += "    double own[@N@];\n    int k;\n";
    }
    if effects.tilt.is_some() {
        out += "    const double none[@N@] = {0.0};\n    @name@_falling(ASKEW, q, none, none, own);\n    \
                for (k = 0; k < @N@; k++) tau[k] += own[k];\n";
    }
    match effects.extra {
        Some(_) => {
            out += "    @name@_recursion(BESIDE, FALL, q, v, a, own);\n    \
                    for (k = 0; k < @N@; k++) tau[k] += own[k];\n";
        }
        None => out += "    (void)v;\n    (void)a;\n",
    }
    out += &C.statements(&effects.askew);
    out.trim_end().to_owned() + "\n}\n"
}

/// A C identifier like this name: what is no ASCII letter or digit becomes `_`.
pub fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let text: String = name.chars().map(plain).collect();
    match text.chars().next() {
        Some(c) if c.is_ascii_alphabetic() => text.to_ascii_lowercase(),
        _ => format!("model_{}", text.to_ascii_lowercase()),
    }
}

#[cfg(test)]
mod tests {
    use super::identifier;

    #[test]
    fn any_file_name_becomes_an_identifier() {
        assert_eq!(identifier("UR10-arm.v2"), "ur10_arm_v2");
        assert_eq!(identifier("7axis"), "model_7axis");
        assert_eq!(identifier("ärm"), "model__rm");
        assert_eq!(identifier(""), "model_");
    }
}
