//! Small functions that generated statements call, in both languages.

use std::fmt::Write;

/// One of them: its name in statements, and its text.
struct Function {
    name: &'static str,
    c: &'static str,
    rust: &'static str,
}

/// What C has in `math.h` and Rust as methods: name of the function, its arguments and its text in Rust.
const METHODS: [(&str, &str, &str); 30] = [
    ("sin", "x: f64", "x.sin()"),
    ("cos", "x: f64", "x.cos()"),
    ("exp", "x: f64", "x.exp()"),
    ("expm1", "x: f64", "x.exp_m1()"),
    ("tanh", "x: f64", "x.tanh()"),
    ("fabs", "x: f64", "x.abs()"),
    ("pow", "x: f64, p: f64", "x.powf(p)"),
    // what formulas of users may call beside these
    ("tan", "x: f64", "x.tan()"),
    ("asin", "x: f64", "x.asin()"),
    ("acos", "x: f64", "x.acos()"),
    ("atan", "x: f64", "x.atan()"),
    ("sinh", "x: f64", "x.sinh()"),
    ("cosh", "x: f64", "x.cosh()"),
    ("asinh", "x: f64", "x.asinh()"),
    ("acosh", "x: f64", "x.acosh()"),
    ("atanh", "x: f64", "x.atanh()"),
    ("floor", "x: f64", "x.floor()"),
    ("round", "x: f64", "x.round()"),
    ("ceil", "x: f64", "x.ceil()"),
    ("trunc", "x: f64", "x.trunc()"),
    ("sqrt", "x: f64", "x.sqrt()"),
    ("cbrt", "x: f64", "x.cbrt()"),
    ("log", "x: f64", "x.ln()"),
    ("log2", "x: f64", "x.log2()"),
    ("log10", "x: f64", "x.log10()"),
    ("atan2", "x: f64, y: f64", "x.atan2(y)"),
    ("fmin", "x: f64, y: f64", "x.min(y)"),
    ("fmax", "x: f64, y: f64", "x.max(y)"),
    ("copysign", "x: f64, y: f64", "x.copysign(y)"),
    ("fmod", "x: f64, y: f64", "x % y"),
];

const FUNCTIONS: [Function; 9] = [
    Function {
        name: "sign(",
        c: "\
static inline double @name@_sign(double x)
{
    return (double)((x > 0.0) - (x < 0.0));
}
",
        rust: "\
fn sign(x: f64) -> f64 {
    f64::from(i8::from(x > 0.0) - i8::from(x < 0.0))
}
",
    },
    Function {
        name: "positive(",
        c: "\
static inline double @name@_positive(double x)
{
    return (double)(x > 0.0);
}
",
        rust: "\
fn positive(x: f64) -> f64 {
    f64::from(u8::from(x > 0.0))
}
",
    },
    Function {
        name: "same(",
        c: "\
static inline double @name@_same(double x, double y)
{
    return (double)(x == y);
}
",
        rust: "\
fn same(x: f64, y: f64) -> f64 {
    f64::from(u8::from(x == y))
}
",
    },
    Function {
        name: "within(",
        c: "\
static inline double @name@_within(double x, double low, double high)
{
    return x < low ? low : x > high ? high : x;
}
",
        rust: "\
fn within(x: f64, low: f64, high: f64) -> f64 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}
",
    },
    Function {
        name: "taking(",
        c: "\
/* The friction x at the speed v, or none where it would drive. */
static inline double @name@_taking(double x, double v)
{
    return x * v > 0.0 ? x : 0.0;
}
",
        rust: "\
/// The friction x at the speed v, or none where it would drive.
fn taking(x: f64, v: f64) -> f64 {
    if x * v > 0.0 { x } else { 0.0 }
}
",
    },
    Function {
        name: "way(",
        c: "\
/* Way since the joint last turned; a way back of `least` is a turn. s: where it began, turned and came
 * farthest, its direction, begun. */
static inline double @name@_way(double q, double least, double *s)
{
    if (s[4] == 0.0) {
        s[0] = s[1] = s[2] = q;
        s[4] = 1.0;
    }
    if (s[3] == 0.0 && fabs(q - s[0]) > least) s[3] = q > s[0] ? 1.0 : -1.0;
    if (s[3] * (q - s[2]) >= 0.0) {
        s[2] = q;
    } else if (fabs(q - s[2]) > least) {
        s[1] = s[2];
        s[2] = q;
        s[3] = -s[3];
    }
    return fabs(q - s[1]);
}
",
        rust: "\
/// Way since the joint last turned; a way back of `least` is a turn. s: where it began, turned and came
/// farthest, its direction, begun.
fn way(q: f64, least: f64, s: &mut [f64; 5]) -> f64 {
    if s[4] == 0.0 {
        *s = [q, q, q, 0.0, 1.0];
    }
    if s[3] == 0.0 && (q - s[0]).abs() > least {
        s[3] = if q > s[0] { 1.0 } else { -1.0 };
    }
    if s[3] * (q - s[2]) >= 0.0 {
        s[2] = q;
    } else if (q - s[2]).abs() > least {
        s[1] = s[2];
        s[2] = q;
        s[3] = -s[3];
    }
    (q - s[1]).abs()
}
",
    },
    Function {
        name: "spline(",
        c: "\
/* Uniform cubic B-spline of six coefficients on three pieces, x from 0 to 1; constant beyond. */
static inline double @name@_spline(double x, double m1, double m2, double m3, double m4, double m5, double m6)
{
    const double m[6] = {m1, m2, m3, m4, m5, m6};
    const double along = x < 0.0 ? 0.0 : x > 1.0 ? 3.0 : 3.0 * x;
    const int piece = along < 1.0 ? 0 : along < 2.0 ? 1 : 2;
    const double u = along - piece, w = 1.0 - u;
    return m[piece] * (w * w * w / 6.0) + m[piece + 1] * ((3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0)
           + m[piece + 2] * ((3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0) + m[piece + 3] * (u * u * u / 6.0);
}
",
        rust: "\
/// Uniform cubic B-spline of six coefficients on three pieces, x from 0 to 1; constant beyond.
fn spline(x: f64, m1: f64, m2: f64, m3: f64, m4: f64, m5: f64, m6: f64) -> f64 {
    let m = [m1, m2, m3, m4, m5, m6];
    let along = 3.0 * within(x, 0.0, 1.0);
    let piece = (along as usize).min(2);
    let u = along - piece as f64;
    let w = 1.0 - u;
    m[piece] * (w * w * w / 6.0)
        + m[piece + 1] * ((3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0)
        + m[piece + 2] * ((3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0)
        + m[piece + 3] * (u * u * u / 6.0)
}
",
    },
    Function {
        name: "loose(",
        c: "\
/* Acceleration over the motor's of a load behind a play of 2 half, with what takes its speed where it lands. s: side on
 * which the motor pushes, position and speed over the motor's, 1 in contact and 2 in flight; s[9] the inertia. */
static inline double @name@_loose(double half, double dt, double load, double *s)
{
    double pull, out = 0.0;
    if (!(s[9] > 0.0)) return 0.0;
    pull = load / s[9];
    if (s[3] == 0.0) {
        s[0] = pull < 0.0 ? -1.0 : 1.0;
        s[1] = -s[0] * half;
        s[3] = 1.0;
    }
    if (s[3] == 1.0 && s[0] * pull < 0.0) {
        s[2] = 0.0;
        s[3] = 2.0;
    }
    if (s[3] == 2.0) {
        s[2] -= pull * dt;
        s[1] += s[2] * dt;
        out = -pull;
        if (fabs(s[1]) >= half) {
            s[0] = s[1] > 0.0 ? -1.0 : 1.0;
            out -= s[2] / dt;
            s[1] = -s[0] * half;
            s[2] = 0.0;
            s[3] = 1.0;
        }
    }
    return out;
}
",
        rust: "\
/// Acceleration over the motor's of a load behind a play of 2 half, with what takes its speed where it lands. s: side on
/// which the motor pushes, position and speed over the motor's, 1 in contact and 2 in flight; s[9] the inertia.
fn loose(half: f64, dt: f64, load: f64, s: &mut [f64; 10]) -> f64 {
    if s[9].is_nan() || s[9] <= 0.0 {
        return 0.0;
    }
    let pull = load / s[9];
    if s[3] == 0.0 {
        s[0] = if pull < 0.0 { -1.0 } else { 1.0 };
        s[1] = -s[0] * half;
        s[3] = 1.0;
    }
    if s[3] == 1.0 && s[0] * pull < 0.0 {
        s[2] = 0.0;
        s[3] = 2.0;
    }
    if s[3] != 2.0 {
        return 0.0;
    }
    s[2] -= pull * dt;
    s[1] += s[2] * dt;
    let mut out = -pull;
    if s[1].abs() >= half {
        s[0] = if s[1] > 0.0 { -1.0 } else { 1.0 };
        out -= s[2] / dt;
        s[1] = -s[0] * half;
        s[2] = 0.0;
        s[3] = 1.0;
    }
    out
}
",
    },
    Function {
        name: "elastic(",
        c: "\
/* Acceleration of the deflection z of z'' + 2 d w z' + w^2 z = load/inertia, less zero, exact for a load that
 * runs straight between samples. s: step, its factors (4 of z and z', 4 of the load before and after),
 * inertia, z, z', the pull before, begun. */
static inline double @name@_elastic(double w, double d, double dt, double load, double *s)
{
    double pull, z, rate;
    int i, j, k, n;
    if (!(s[9] > 0.0)) return 0.0;
    pull = load / s[9];
    if (s[13] == 0.0) {
        s[10] = pull / (w * w);
        s[11] = 0.0;
        s[12] = pull;
        s[13] = 1.0;
        return -(pull - w * w * s[10]);
    }
    if (s[0] != dt) {
        /* the exponential of the rates of z, z', load and its slope: a series at an eighth, squared thrice */
        const double h = dt / 8.0;
        const double small[4][4] = {{0.0, h, 0.0, 0.0}, {-w * w * h, -2.0 * d * w * h, h, 0.0}, {0.0, 0.0, 0.0, h},
                                    {0.0, 0.0, 0.0, 0.0}};
        double term[4][4], sum[4][4], next[4][4];
        for (i = 0; i < 4; i++)
            for (j = 0; j < 4; j++) term[i][j] = sum[i][j] = (double)(i == j);
        for (n = 1; n <= 17; n++) {
            const int squares = n > 14;
            for (i = 0; i < 4; i++)
                for (j = 0; j < 4; j++) {
                    next[i][j] = 0.0;
                    for (k = 0; k < 4; k++)
                        next[i][j] += squares ? sum[i][k] * sum[k][j] : term[i][k] * small[k][j] / n;
                }
            for (i = 0; i < 4; i++)
                for (j = 0; j < 4; j++) {
                    if (squares) {
                        sum[i][j] = next[i][j];
                    } else {
                        term[i][j] = next[i][j];
                        sum[i][j] += next[i][j];
                    }
                }
        }
        for (i = 0; i < 2; i++) {
            for (j = 0; j < 2; j++) s[1 + 2 * i + j] = sum[i][j];
            s[6 + 2 * i] = sum[i][3] / dt;
            s[5 + 2 * i] = sum[i][2] - s[6 + 2 * i];
        }
        s[0] = dt;
    }
    z = s[1] * s[10] + s[2] * s[11] + s[5] * s[12] + s[6] * pull;
    rate = s[3] * s[10] + s[4] * s[11] + s[7] * s[12] + s[8] * pull;
    s[10] = z;
    s[11] = rate;
    s[12] = pull;
    return -(pull - 2.0 * d * w * rate - w * w * z);
}
",
        rust: "\
/// Acceleration of the deflection z of z'' + 2 d w z' + w^2 z = load/inertia, less zero, exact for a load that
/// runs straight between samples. s: step, its factors (4 of z and z', 4 of the load before and after),
/// inertia, z, z', the pull before, begun.
#[allow(clippy::needless_range_loop)]
fn elastic(w: f64, d: f64, dt: f64, load: f64, s: &mut [f64; 14]) -> f64 {
    if s[9].is_nan() || s[9] <= 0.0 {
        return 0.0;
    }
    let pull = load / s[9];
    if s[13] == 0.0 {
        s[10] = pull / (w * w);
        s[11] = 0.0;
        s[12] = pull;
        s[13] = 1.0;
        return -(pull - w * w * s[10]);
    }
    if s[0] != dt {
        // the exponential of the rates of z, z', load and its slope: a series at an eighth, squared thrice
        let h = dt / 8.0;
        let small = [
            [0.0, h, 0.0, 0.0],
            [-w * w * h, -2.0 * d * w * h, h, 0.0],
            [0.0, 0.0, 0.0, h],
            [0.0; 4],
        ];
        let product = |a: &[[f64; 4]; 4], b: &[[f64; 4]; 4]| {
            let mut out = [[0.0; 4]; 4];
            for i in 0..4 {
                for j in 0..4 {
                    for k in 0..4 {
                        out[i][j] += a[i][k] * b[k][j];
                    }
                }
            }
            out
        };
        let mut term = [[0.0; 4]; 4];
        for i in 0..4 {
            term[i][i] = 1.0;
        }
        let mut sum = term;
        for n in 1..=14 {
            term = product(&term, &small);
            for i in 0..4 {
                for j in 0..4 {
                    term[i][j] /= f64::from(n);
                    sum[i][j] += term[i][j];
                }
            }
        }
        for _ in 0..3 {
            sum = product(&sum, &sum);
        }
        for i in 0..2 {
            for j in 0..2 {
                s[1 + 2 * i + j] = sum[i][j];
            }
            s[6 + 2 * i] = sum[i][3] / dt;
            s[5 + 2 * i] = sum[i][2] - s[6 + 2 * i];
        }
        s[0] = dt;
    }
    let z = s[1] * s[10] + s[2] * s[11] + s[5] * s[12] + s[6] * pull;
    let rate = s[3] * s[10] + s[4] * s[11] + s[7] * s[12] + s[8] * pull;
    s[10] = z;
    s[11] = rate;
    s[12] = pull;
    -(pull - 2.0 * d * w * rate - w * w * z)
}
",
    },
];

/// Those that the statements `$f(` call, in C.
pub(super) fn in_c(statements: &[&[String]]) -> String {
    let called = FUNCTIONS.iter().filter(|f| calls(statements, f.name));
    called.map(|function| format!("{}\n", function.c)).collect()
}

/// Those that the statements call, in Rust.
pub(super) fn in_rust(statements: &[&[String]]) -> String {
    let mut out = String::new();
    let within = calls(statements, "spline(");
    for function in &FUNCTIONS {
        if calls(statements, function.name) || (within && function.name == "within(") {
            let _ = write!(out, "\n#[inline]\n{}", function.rust);
        }
    }
    for (name, arguments, text) in METHODS {
        let call = format!("{name}(");
        // not those whose name ends alike
        let any = |line: &String| {
            let found = line.match_indices(&call);
            let before = |at: usize| line[..at].chars().next_back();
            let mut own = found.filter(|(at, _)| !before(*at).is_some_and(char::is_alphanumeric));
            own.any(|(at, _)| before(at) != Some('$'))
        };
        if statements.iter().any(|lines| lines.iter().any(any)) {
            let _ = write!(
                out,
                "\n#[inline]\nfn {name}({arguments}) -> f64 {{\n    {text}\n}}\n"
            );
        }
    }
    out
}

fn calls(statements: &[&[String]], name: &str) -> bool {
    let call = format!("${name}");
    let mut lines = statements.iter().copied().flatten();
    lines.any(|line| line.contains(&call))
}
