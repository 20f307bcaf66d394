//! A C99 header: feed-forward torque and gravity compensation, `static inline`, without state.

use super::Program;
use super::code::{C, sines};
use super::note::Note;

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
    let count = sines(program).len();
    let (constant, loops) = match count {
        0 => (String::new(), "        (void)0;"),
        s => (format!(", S = {s}"), SINES),
    };
    let tables = C.tables(program);
    TEMPLATE
        .replace("@TABLES@", tables.trim_end())
        .replace("@SINES_CONST@", &constant)
        .replace("@SINES@", loops)
        .replace("@FRICTION@", &C.friction(program))
        .replace("@DRIVES@", &C.drives(program))
        .replace("@N@", &program.joints.len().to_string())
        .replace("@L@", &program.tree.links().len().to_string())
        .replace("@name@", name)
        .replace("@GUARD@", &name.to_uppercase())
        // last, so that no name in it is taken for a mark
        .replace("@HEADER@", &C.header(program, note))
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
