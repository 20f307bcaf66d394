//! A C function that takes bias and weight off a wrench.

use super::tool_file::ToolFile;
use super::wrench_log::WrenchFrame;

fn array(numbers: &[f64]) -> String {
    let all: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
    all.join(", ")
}

/// The header; `prefix` begins the names. None where the poses did not determine mass and centre.
pub fn c_function(file: &ToolFile, prefix: &str, lines: &[String]) -> Option<String> {
    let (mass, centre) = file.body()?;
    let guard = format!("{}_H", prefix.to_uppercase());
    let head: String = lines.iter().map(|line| format!(" * {line}\n")).collect();
    let sign = if file.tool.reaction { -1.0 } else { 1.0 };
    let (into, back) = match file.tool.frame {
        WrenchFrame::Sensor => ("", ""),
        WrenchFrame::Base => (
            "    /* logged along the axes of the base */\n    for (i = 0; i < 3; ++i) {\n        f[i] = R[0][i] * wrench[0] + R[1][i] * wrench[1] + R[2][i] * wrench[2];\n        t[i] = R[0][i] * wrench[3] + R[1][i] * wrench[4] + R[2][i] * wrench[5];\n    }\n",
            "    for (i = 0; i < 3; ++i) {\n        wrench[i] = R[i][0] * f[0] + R[i][1] * f[1] + R[i][2] * f[2];\n        wrench[3 + i] = R[i][0] * t[0] + R[i][1] * t[1] + R[i][2] * t[2];\n    }\n",
        ),
    };
    let into = match into {
        "" => {
            "    for (i = 0; i < 3; ++i) {\n        f[i] = wrench[i];\n        t[i] = wrench[3 + i];\n    }\n"
        }
        some => some,
    };
    let back = match back {
        "" => {
            "    for (i = 0; i < 3; ++i) {\n        wrench[i] = f[i];\n        wrench[3 + i] = t[i];\n    }\n"
        }
        some => some,
    };
    Some(format!(
        "/*\n{head} */\n#ifndef {guard}\n#define {guard}\n\n/* Takes bias and weight off a wrench (force [N], moment [Nm] about the sensor's origin) as it is logged.\n * R: axes of the sensor in the base frame, as columns, R[row][column]; poses that are held. */\nstatic inline void {prefix}_compensate(const double R[3][3], double wrench[6])\n{{\n    static const double bias[6] = {{{bias}}};\n    static const double centre[3] = {{{centre}}};\n    const double mass = {mass:?}, gravity = {gravity:?}, sign = {sign:?};\n    double f[3], t[3], w[3];\n    int i;\n{into}    for (i = 0; i < 3; ++i)\n        w[i] = -mass * gravity * R[2][i];\n    for (i = 0; i < 3; ++i) {{\n        const int j = (i + 1) % 3, k = (i + 2) % 3;\n        f[i] -= sign * (w[i] + bias[i]);\n        t[i] -= sign * (centre[j] * w[k] - centre[k] * w[j] + bias[3 + i]);\n    }}\n{back}}}\n\n#endif\n",
        bias = array(&file.last_bias),
        centre = array(&centre),
        gravity = file.tool.gravity,
    ))
}
