//! A Rust module: the same functions as the C header, with nothing but the standard library.

use super::Program;
use super::code::{RUST, sines};
use super::note::Note;

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

const SIGN: &str = "
#[inline]
fn sign(x: f64) -> f64 {
    f64::from(i8::from(x > 0.0) - i8::from(x < 0.0))
}
";

/// The text of a module with `tau`, `gravity`, `friction` and `rigid`.
pub fn module(program: &Program, note: &Note) -> String {
    let count = sines(program).len();
    let (constant, loops, slope) = match count {
        0 => (String::new(), "", "let slope = LINEAR;"),
        s => (
            format!("const SINES: usize = {s};\n"),
            SINES,
            "let mut slope = LINEAR;",
        ),
    };
    let (friction, drives) = (RUST.friction(program), RUST.drives(program));
    let signs = friction.contains("sign(") || drives.contains("sign(");
    TEMPLATE
        .replace("@TABLES@\n", &RUST.tables(program))
        .replace("@SINES_CONST@\n", &constant)
        .replace("let mut slope = LINEAR;", slope)
        .replace("@SINES@\n", loops)
        .replace("@SIGN@\n", if signs { SIGN } else { "\n" })
        .replace("@FRICTION@", &friction)
        .replace(
            "@DRIVES@\n",
            &match drives.as_str() {
                "" => String::new(),
                drives => format!("{drives}\n"),
            },
        )
        .replace("@N@", &program.joints.len().to_string())
        .replace("@L@", &program.tree.links().len().to_string())
        // last, so that no name in it is taken for a mark
        .replace("@HEADER@", &RUST.header(program, note))
}
