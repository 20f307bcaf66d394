//! What generated C and Rust have in common: tables of numbers and the lines made of them.

use std::fmt::Write;

use super::Program;
use super::note::Note;
use crate::robot::JointKind;
use crate::robot::model::JointFriction;
use crate::robot::tree::{Coordinate, Dependence};

/// The words of a language.
pub(super) struct Language {
    /// A table: type, name with its sizes, values; `$` stands for each.
    table: fn(kind: &str, name: &str, sizes: &[usize], values: &str) -> String,
    open: char,
    close: char,
    comment: &'static str,
    /// Indentation of the lines of a function.
    pub indent: &'static str,
    pub tanh: fn(&str) -> String,
    pub sign: fn(&str) -> String,
    /// Statement that begins a variable.
    pub variable: &'static str,
}

pub(super) const C: Language = Language {
    table: |kind, name, sizes, values| {
        let kind = if kind == "f64" { "double" } else { "int" };
        let sizes: String = sizes.iter().map(|n| format!("[{n}]")).collect();
        format!("    static const {kind} {name}{sizes} = {values};\n")
    },
    open: '{',
    close: '}',
    comment: " * ",
    indent: "    ",
    tanh: |x| format!("tanh({x})"),
    sign: |x| format!("@name@_sign({x})"),
    variable: "const double",
};

pub(super) const RUST: Language = Language {
    table: |kind, name, sizes, values| {
        let kind = sizes
            .iter()
            .rev()
            .fold(kind.to_owned(), |kind, n| format!("[{kind}; {n}]"));
        format!("#[allow(clippy::approx_constant)]\nconst {name}: {kind} = {values};\n")
    },
    open: '[',
    close: ']',
    comment: "//! ",
    indent: "    ",
    tanh: |x| format!("({x}).tanh()"),
    sign: |x| format!("sign({x})"),
    variable: "let",
};

/// A number that reads back bit for bit.
fn exact(x: f64) -> String {
    format!("{x:?}")
}

impl Language {
    /// Nested values, one row of the innermost to a line.
    fn nested(&self, values: &[String], sizes: &[usize]) -> String {
        let Some((size, inner)) = sizes.split_first() else {
            return values.first().cloned().unwrap_or_default();
        };
        let chunk = (values.len() / (*size).max(1)).max(1);
        let parts: Vec<String> = values
            .chunks(chunk)
            .map(|v| self.nested(v, inner))
            .collect();
        let between = if inner.is_empty() { ", " } else { ",\n     " };
        format!("{}{}{}", self.open, parts.join(between), self.close)
    }

    fn numbers(&self, name: &str, sizes: &[usize], values: impl Iterator<Item = f64>) -> String {
        let values: Vec<String> = values.map(exact).collect();
        (self.table)("f64", name, sizes, &self.nested(&values, sizes))
    }

    /// The tables of the chain; `parents` and `slides` as the language writes them.
    pub(super) fn tables(&self, program: &Program) -> String {
        let links = program.tree.links();
        let (n, l) = (program.joints.len(), links.len());
        let shift = links.iter().map(|link| match &link.coordinate {
            Coordinate::Joint(_) => 0.0,
            Coordinate::Follows(d) => d.offset,
        });
        let mut linear = vec![0.0; l * n];
        for (i, link) in links.iter().enumerate() {
            match &link.coordinate {
                Coordinate::Joint(j) => linear[i * n + j] = 1.0,
                Coordinate::Follows(d) => {
                    for (j, c) in &d.linear {
                        linear[i * n + j] += c;
                    }
                }
            }
        }
        let mut out = String::new();
        let is_c = self.open == '{';
        let parents: Vec<String> = links
            .iter()
            .map(|link| match (link.parent, is_c) {
                (Some(parent), true) => parent.to_string(),
                (None, true) => "-1".to_owned(),
                (Some(parent), false) => format!("Some({parent})"),
                (None, false) => "None".to_owned(),
            })
            .collect();
        let slides: Vec<String> = links
            .iter()
            .map(|link| match (link.kind == JointKind::Prismatic, is_c) {
                (slides, true) => u8::from(slides).to_string(),
                (slides, false) => slides.to_string(),
            })
            .collect();
        let words = |name: &str, kind: &str, values: &[String]| {
            (self.table)(kind, name, &[l], &self.nested(values, &[l]))
        };
        out += &words("PARENT", "Option<usize>", &parents);
        out += &words("SLIDES", "bool", &slides);
        let rotations = links.iter().flat_map(|link| link.rotation).flatten();
        out += &self.numbers("ROTATION", &[l, 3, 3], rotations);
        out += &self.numbers("ORIGIN", &[l, 3], links.iter().flat_map(|link| link.origin));
        out += &self.numbers("AXIS", &[l, 3], links.iter().flat_map(|link| link.axis));
        out += &self.numbers("SHIFT", &[l], shift);
        out += &self.numbers("LINEAR", &[l, n], linear.into_iter());
        let sines = sines(program);
        if !sines.is_empty() {
            let s = sines.len();
            let of: Vec<String> = sines.iter().map(|(i, _)| i.to_string()).collect();
            out += &(self.table)("usize", "SINE_OF", &[s], &self.nested(&of, &[s]));
            let amplitudes = sines.iter().map(|(_, x)| x[0]);
            out += &self.numbers("AMPLITUDE", &[s], amplitudes);
            out += &self.numbers("PHASE", &[s], sines.iter().map(|(_, x)| x[1]));
            let factors = sines.iter().flat_map(|(_, x)| x[2..].to_vec());
            out += &self.numbers("SINE_K", &[s, n], factors);
        }
        out += &self.numbers("BODY", &[l, 10], program.bodies.iter().flatten().copied());
        // what is at rest seems to be pushed up
        out += &self.numbers("FALL", &[3], program.tree.gravity().map(|g| -g).into_iter());
        out
    }

    /// Statements for the friction of each joint.
    pub(super) fn friction(&self, program: &Program) -> String {
        let mut out = String::new();
        for (j, friction) in program.friction.iter().enumerate() {
            let sum = match friction {
                JointFriction::None => "0.0".to_owned(),
                JointFriction::ViscousCoulomb(law) => format!(
                    "{} * v[{j}] + {} * {}",
                    exact(law.viscous),
                    exact(law.coulomb),
                    (self.sign)(&format!("v[{j}]"))
                ),
                JointFriction::DoubleTanh(law) => format!(
                    "{} * v[{j}] + {} * {} + {} * {}",
                    exact(law.viscous),
                    exact(law.coulomb_1),
                    (self.tanh)(&format!("{} * v[{j}]", exact(law.slope_1))),
                    exact(law.coulomb_2),
                    (self.tanh)(&format!("{} * v[{j}]", exact(law.slope_2)))
                ),
            };
            let _ = writeln!(out, "{}tau[{j}] = {sum};", self.indent);
        }
        if program.friction.iter().all(|f| *f == JointFriction::None) {
            let unused = if self.open == '{' {
                "(void)v;"
            } else {
                "let _ = v;"
            };
            let _ = writeln!(out, "{}{unused}", self.indent);
        }
        out.trim_end().to_owned()
    }

    /// Statements for drive inertias, couplings and offsets.
    pub(super) fn drives(&self, program: &Program) -> String {
        let mut out = String::new();
        for (j, (drive, offset)) in program.drives.iter().zip(&program.offset).enumerate() {
            let mut terms = Vec::new();
            if *drive != 0.0 {
                terms.push(format!("{} * a[{j}]", exact(*drive)));
            }
            if *offset != 0.0 {
                terms.push(exact(*offset));
            }
            if !terms.is_empty() {
                let _ = writeln!(out, "{}tau[{j}] += {};", self.indent, terms.join(" + "));
            }
        }
        for (k, (c, [inertia, viscous, coulomb])) in program.couplings.iter().enumerate() {
            let (m, o, ratio) = (c.motor, c.other, exact(c.ratio));
            let [inertia, viscous, coulomb] = [inertia, viscous, coulomb].map(|x| exact(*x));
            let sign = (self.sign)(&format!("v[{m}] + {ratio} * v[{o}]"));
            for line in [
                format!("{} turning_{k} = {coulomb} * {sign};", self.variable),
                format!(
                    "tau[{m}] += {ratio} * ({inertia} * a[{o}] + {viscous} * v[{o}]) + turning_{k};"
                ),
                format!(
                    "tau[{o}] += {ratio} * ({inertia} * a[{m}] + {viscous} * v[{m}] + turning_{k});"
                ),
            ] {
                let _ = writeln!(out, "{}{line}", self.indent);
            }
        }
        out.trim_end().to_owned()
    }

    /// What the file is, line by line.
    pub(super) fn header(&self, program: &Program, note: &Note) -> String {
        let mut lines = note.lines.clone();
        lines.push(String::new());
        lines.push("Joints, in the order of q, v, a and tau:".to_owned());
        for (j, name) in program.joints.iter().enumerate() {
            let unit = program.kinds[j].position_unit();
            let torque = note.torque_units.get(j).map_or("", String::as_str);
            lines.push(format!(
                "  {j}  {name}: q [{unit}], v [{unit}/s], a [{unit}/s^2], tau [{torque}]"
            ));
        }
        let shown: Vec<String> = lines
            .iter()
            .map(|line| {
                // nothing in a name may end the comment
                let line = line.replace("*/", "* /");
                format!("{}{line}", self.comment).trim_end().to_owned()
            })
            .collect();
        shown.join("\n")
    }
}

/// Every sine of a dependent coordinate: its link, then amplitude, phase and a factor per joint.
pub(super) fn sines(program: &Program) -> Vec<(usize, Vec<f64>)> {
    let n = program.joints.len();
    let of = |d: &Dependence| -> Vec<Vec<f64>> {
        d.sines
            .iter()
            .map(|sine| {
                let mut row = vec![sine.amplitude, sine.phase];
                row.resize(2 + n, 0.0);
                for (j, k) in &sine.of {
                    row[2 + j] += k;
                }
                row
            })
            .collect()
    };
    let links = program.tree.links().iter().enumerate();
    links
        .flat_map(|(i, link)| {
            let rows = match &link.coordinate {
                Coordinate::Joint(_) => Vec::new(),
                Coordinate::Follows(d) => of(d),
            };
            rows.into_iter().map(move |row| (i, row))
        })
        .collect()
}
