//! What generated C and Rust have in common: tables of numbers and the lines made of them.

use std::fmt::Write;

use super::Program;
use super::note::Note;
use cft_ident_core::effect::as_code::EffectsCode;
use cft_ident_core::effect::law_text::{exact, law};
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_core::robot::tree::{Coordinate, JointCoupling};

pub(super) struct CodeLanguage {
    /// A table: type, name with its sizes, values; `$` stands for each.
    table: fn(kind: &str, name: &str, sizes: &[usize], values: &str) -> String,
    open: char,
    close: char,
    comment: &'static str,
    /// What stands for the marks of statements: `$f(`, `state.`, `let `, `&state.`.
    marks: [&'static str; 4],
    /// The input of the temperatures.
    temperature: &'static str,
}

pub(super) const C: CodeLanguage = CodeLanguage {
    table: |kind, name, sizes, values| {
        let kind = if kind == "f64" { "double" } else { "int" };
        let sizes: String = sizes.iter().map(|n| format!("[{n}]")).collect();
        format!("    static const {kind} {name}{sizes} = {values};\n")
    },
    open: '{',
    close: '}',
    comment: " * ",
    marks: ["@name@_", "state->", "const double ", "state->"],
    temperature: ", const double temperature[@N@]",
};

pub(super) const RUST: CodeLanguage = CodeLanguage {
    table: |kind, name, sizes, values| {
        let sizes = sizes.iter().rev();
        let kind = sizes.fold(kind.to_owned(), |kind, n| format!("[{kind}; {n}]"));
        format!("#[allow(clippy::approx_constant)]\nconst {name}: {kind} = {values};\n")
    },
    open: '[',
    close: ']',
    comment: "//! ",
    marks: ["", "state.", "let ", "&mut state."],
    temperature: ", temperature: &[f64; JOINTS]",
};

impl CodeLanguage {
    /// Nested values, one row of the innermost to a line.
    fn nested(&self, values: &[String], sizes: &[usize]) -> String {
        let Some((size, inner)) = sizes.split_first() else {
            return values.first().cloned().unwrap_or_default();
        };
        let chunk = (values.len() / (*size).max(1)).max(1);
        let parts = values.chunks(chunk).map(|v| self.nested(v, inner));
        let parts: Vec<String> = parts.collect();
        let between = if inner.is_empty() { ", " } else { ",\n     " };
        format!("{}{}{}", self.open, parts.join(between), self.close)
    }

    pub(super) fn is_c(&self) -> bool {
        self.open == '{'
    }

    pub(super) fn numbers(
        &self,
        name: &str,
        sizes: &[usize],
        values: impl Iterator<Item = f64>,
    ) -> String {
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
        let is_c = self.is_c();
        let parents = links.iter().map(|link| match link.parent {
            None => if is_c { "-1" } else { "None" }.to_owned(),
            Some(parent) if is_c => parent.to_string(),
            Some(parent) => format!("Some({parent})"),
        });
        let slides = links.iter().map(|link| link.kind == JointKind::Prismatic);
        let slides = slides.map(|slides| match is_c {
            true => u8::from(slides).to_string(),
            false => slides.to_string(),
        });
        out += &self.words("PARENT", "Option<usize>", parents);
        out += &self.words("SLIDES", "bool", slides);
        let rotations = links.iter().flat_map(|link| link.rotation).flatten();
        out += &self.numbers("ROTATION", &[l, 3, 3], rotations);
        out += &self.numbers("ORIGIN", &[l, 3], links.iter().flat_map(|link| link.origin));
        out += &self.numbers("AXIS", &[l, 3], links.iter().flat_map(|link| link.axis));
        out += &self.numbers("SHIFT", &[l], shift);
        out += &self.numbers("LINEAR", &[l, n], linear.into_iter());
        let sines = sines(program);
        if !sines.is_empty() {
            let s = sines.len();
            out += &self.words("SINE_OF", "usize", sines.iter().map(|(i, _)| i.to_string()));
            out += &self.numbers("AMPLITUDE", &[s], sines.iter().map(|(_, x)| x[0]));
            out += &self.numbers("PHASE", &[s], sines.iter().map(|(_, x)| x[1]));
            let factors = sines.iter().flat_map(|(_, x)| x[2..].to_vec());
            out += &self.numbers("SINE_K", &[s, n], factors);
        }
        out
    }

    /// A list of what are no numbers with a point.
    pub(super) fn words(
        &self,
        name: &str,
        kind: &str,
        values: impl Iterator<Item = String>,
    ) -> String {
        let values: Vec<String> = values.collect();
        let sizes = [values.len()];
        (self.table)(kind, name, &sizes, &self.nested(&values, &sizes))
    }

    pub(super) fn bodies(&self, name: &str, bodies: &[[f64; STANDARD]]) -> String {
        let sizes = [bodies.len(), STANDARD];
        self.numbers(name, &sizes, bodies.iter().flatten().copied())
    }

    pub(super) fn vector(&self, name: &str, x: &[f64]) -> String {
        self.numbers(name, &[x.len()], x.iter().copied())
    }

    pub(super) fn list(&self, x: &[f64]) -> String {
        let all: Vec<String> = x.iter().copied().map(exact).collect();
        self.nested(&all, &[x.len()])
    }

    /// Statements in the words of the language.
    pub(super) fn statements(&self, lines: &[String]) -> String {
        let [call, state, constant, memory] = self.marks;
        let mut out = String::new();
        for line in lines {
            let line = line.replace('$', call).replace("&state.", memory);
            let line = line.replace("state.", state);
            let line = match line.strip_prefix("let ") {
                Some(rest) => format!("{constant}{rest}"),
                None => line,
            };
            let _ = writeln!(out, "    {line}");
        }
        out.trim_end().to_owned()
    }

    /// The text with the input of temperatures where a law takes one, and without it elsewhere.
    pub(super) fn with_inputs(&self, text: &str, effects: &EffectsCode) -> String {
        let [added, steps] = [&effects.added, &effects.steps].map(|lines| warm(lines));
        let of = |there: bool, text: &'static str| if there { text } else { "" };
        text.replace("@WARM_NOW@", of(added, self.temperature))
            .replace("@WARM@", of(added || steps, self.temperature))
            .replace("@TO_NOW@", of(added, ", temperature"))
            .replace("@TO_STEP@", of(added || steps, ", temperature"))
    }

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
        let effects = &program.effects;
        if warm(&effects.added) || warm(&effects.steps) {
            lines.push(
                "temperature: of the drive of each joint [degC], as its column in the logs had it"
                    .to_owned(),
            );
        }
        let shown = lines.iter().map(|line| {
            // nothing in a name may end the comment
            let line = line.replace("*/", "* /");
            format!("{}{line}", self.comment).trim_end().to_owned()
        });
        shown.collect::<Vec<_>>().join("\n")
    }
}

/// Whether statements take a temperature.
fn warm(lines: &[String]) -> bool {
    lines.iter().any(|line| line.contains("temperature["))
}

/// Statements for the friction of each joint.
pub(super) fn friction(program: &Program) -> Vec<String> {
    let each = program.friction.iter().enumerate();
    let each = each.map(|(j, own)| format!("tau[{j}] = {};", law(own, &format!("v[{j}]"))));
    let drives = program.drives_at.iter().enumerate();
    let drives = drives.filter(|(_, speeds)| speeds.is_some());
    each.chain(program.effects.friction.iter().cloned())
        .chain(drives.map(|(j, _)| format!("tau[{j}] = $taking(tau[{j}], v[{j}]);")))
        .collect()
}

/// Statements for drive inertias and couplings.
pub(super) fn drives(program: &Program) -> Vec<String> {
    let mut out = Vec::new();
    for (j, drive) in program.drives.iter().enumerate() {
        if *drive != 0.0 {
            out.push(format!("tau[{j}] += {} * a[{j}];", exact(*drive)));
        }
    }
    for (k, (c, numbers)) in program.couplings.iter().enumerate() {
        out.extend(train(k, c, numbers.map(exact)));
    }
    out
}

/// Statements for a coupled gear train with these texts for inertia, viscous and Coulomb part.
pub(super) fn train(
    k: usize,
    c: &JointCoupling,
    [inertia, viscous, coulomb]: [String; 3],
) -> [String; 3] {
    let (m, o, ratio) = (c.motor, c.other, exact(c.ratio));
    [
        format!("let turning_{k} = {coulomb} * $sign(v[{m}] + {ratio} * v[{o}]);"),
        format!("tau[{m}] += {ratio} * ({inertia} * a[{o}] + {viscous} * v[{o}]) + turning_{k};"),
        format!("tau[{o}] += {ratio} * ({inertia} * a[{m}] + {viscous} * v[{m}] + turning_{k});"),
    ]
}

/// Statements for offsets and for effects without memory.
pub(super) fn added(program: &Program) -> Vec<String> {
    let offsets = program.offset.iter().enumerate();
    let offsets = offsets.filter(|(_, x)| **x != 0.0);
    offsets
        .map(|(j, x)| format!("tau[{j}] += {};", exact(*x)))
        .chain(program.effects.added.iter().cloned())
        .collect()
}

/// What the function of the weight carries beside the links, in words; nothing where there is nothing.
pub(super) fn carried(program: &Program) -> &'static str {
    let effects = &program.effects;
    let askew = effects.tilt.is_some() || !effects.askew.is_empty();
    match (effects.extra.is_some(), askew) {
        (false, false) => "",
        (true, false) => " and the payload",
        (false, true) => ", on a base that stands askew,",
        (true, true) => " and the payload, on a base that stands askew,",
    }
}

/// What at rest seems to push links up.
pub(super) fn fall(program: &Program) -> [f64; 3] {
    program.tree.gravity().map(|g| -g)
}

/// What the function without a state leaves to the one with it.
pub(super) fn without_memory(effects: &EffectsCode) -> &'static str {
    match effects.remember_anything() {
        true => " and the effects\n * that remember nothing: `step` has them all",
        false => " and effects",
    }
}

/// Every sine of a dependent coordinate: its link, then amplitude, phase and a factor per joint.
pub(super) fn sines(program: &Program) -> Vec<(usize, Vec<f64>)> {
    let n = program.joints.len();
    let mut out = Vec::new();
    for (i, link) in program.tree.links().iter().enumerate() {
        let Coordinate::Follows(dependent) = &link.coordinate else {
            continue;
        };
        for sine in &dependent.sines {
            let mut row = vec![sine.amplitude, sine.phase];
            row.resize(2 + n, 0.0);
            for (j, k) in &sine.of {
                row[2 + j] += k;
            }
            out.push((i, row));
        }
    }
    out
}
