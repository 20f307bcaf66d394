//! The observer of external torques in generated code: filters of one sampling step, deviations and limits as tables.

use super::Program;
use super::code::{C, CodeLanguage, RUST, fall, train};
use super::recipe::{DelayRecipe, ObserverRecipe};
use cft_ident_core::effect::law_text::{exact, slopes};
use cft_ident_core::number;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_core::robot::standard::STANDARD;

const IN_C: &str = include_str!("observer.h.in");
const IN_RUST: &str = include_str!("observer.rs.in");

/// Beyond every speed.
const NEVER: f64 = 1e300;

impl DelayRecipe {
    /// Of each joint: how many samples ago the oldest of four nodes lies, and their weights (cubic interpolation).
    fn nodes(&self) -> (Vec<f64>, Vec<f64>) {
        let (mut oldest, mut weights) = (Vec::new(), Vec::new());
        for by in &self.by {
            // `back` samples before the newest, of which `p` lies between the second and the third node
            let back = self.lead as f64 + by;
            let p = 1.0 - (back - back.floor());
            oldest.push(back.floor() + 2.0);
            weights.extend([
                -p * (p - 1.0) * (p - 2.0) / 6.0,
                (p + 1.0) * (p - 1.0) * (p - 2.0) / 2.0,
                -(p + 1.0) * p * (p - 2.0) / 2.0,
                (p + 1.0) * p * (p - 1.0) / 6.0,
            ]);
        }
        (oldest, weights)
    }
}

const LATE_IN_C: &str = "\
    o->late = (o->late + 1) % @D@;
    for (j = 0; j < N; j++) {
        o->measured[o->late][j] = r[2][N + j];
        o->modelled[o->late][j] = model[j];
    }
    if (o->samples < FIRST) return 0;
    for (j = 0; j < N; j++) {
        y[j] = o->measured[(o->late + @D@ - @LEAD@) % @D@][j];
        for (k = 0; k < 4; k++)
            y[j] -= WEIGHTS[j][k] * o->modelled[(o->late + @D@ - OLDEST[j] + k) % @D@][j];
    }";
const LATE_IN_RUST: &str = "\
        self.late = (self.late + 1) % @D@;
        self.measured[self.late] = std::array::from_fn(|j| r[2][JOINTS + j]);
        self.modelled[self.late] = model;
        if self.samples < FIRST {
            return None;
        }
        for j in 0..JOINTS {
            y[j] = self.measured[(self.late + @D@ - @LEAD@) % @D@][j];
            for k in 0..4 {
                y[j] -= WEIGHTS[j][k] * self.modelled[(self.late + @D@ - OLDEST[j] + k) % @D@][j];
            }
        }";

impl ObserverRecipe {
    pub(super) fn in_c(&self, program: &Program) -> String {
        let plain = "    for (j = 0; j < N; j++) y[j] = r[2][N + j] - model[j];";
        let fields = "    double measured[@D@][@N@], modelled[@D@][@N@];\n    int late;\n";
        let of_late = [fields, "", "o->late = "];
        self.text(program, (IN_C, &C), (plain, LATE_IN_C), of_late)
    }

    pub(super) fn in_rust(&self, program: &Program) -> String {
        let plain = "        for j in 0..JOINTS {\n            y[j] = r[2][JOINTS + j] - model[j];\n        }";
        let fields = "    measured: [[f64; JOINTS]; @D@],\n    modelled: [[f64; JOINTS]; @D@],\n    late: usize,\n";
        let first = "            measured: [[0.0; JOINTS]; @D@],\n            modelled: [[0.0; JOINTS]; @D@],\n            \
                     late: 0,\n";
        let of_late = [fields, first, ""];
        self.text(program, (IN_RUST, &RUST), (plain, LATE_IN_RUST), of_late)
    }

    /// The template with its marks filled in, by statements without and with a delay, and those of a delay alone.
    fn text(
        &self,
        program: &Program,
        (template, language): (&str, &CodeLanguage),
        (plain, late): (&str, &str),
        of_late: [&str; 3],
    ) -> String {
        let (residual, of_late, size, lead) = match &self.late {
            None => (plain, [""; 3], 0, 0),
            Some(of) => (late, of_late, of.size, of.lead),
        };
        let each = self.joints.iter().map(|joint| joint.speed_edges.len());
        let edges = each.max().unwrap_or(0).max(1);
        template
            .replace("@TABLES@\n", &self.tables(language, edges))
            .replace("@UNCERTAIN@\n", &self.of_parameters(language, program))
            .replace("@BESIDE@\n", &self.beside_links(language, program))
            .replace("@U@", &self.uncertain.len().to_string())
            .replace("@RESIDUAL@", residual)
            .replace("@LATE_FIELDS@\n", of_late[0])
            .replace("@LATE_INIT@\n", of_late[1])
            .replace("@LATE_BEGIN@", of_late[2])
            .replace("@D@", &size.to_string())
            .replace("@LEAD@", &lead.to_string())
            .replace("@P@", &self.position.sections.len().to_string())
            .replace("@S@", &self.smooth.sections.len().to_string())
            .replace("@E@", &edges.to_string())
            .replace("@SETTLE@", &self.position.settle.to_string())
            .replace("@WAIT@", &(self.smooth.settle + size).to_string())
            .replace("@FIRST@", &size.max(1).to_string())
            .replace("@STEP@", &exact(self.step_s))
            .replace("@REACH@", &exact(self.reach_s))
            .replace("@TINY@", &exact(f64::MIN_POSITIVE))
            .replace("@DELAY_S@", &number::significant(self.delay_s, 4))
            .replace("@RATE@", &number::significant(self.per_hour, 4))
    }

    /// Tables of the parameters' deviations.
    fn of_parameters(&self, language: &CodeLanguage, program: &Program) -> String {
        let (u, n) = (self.uncertain.len(), program.joints.len());
        let (links, trains) = (program.tree.links().len(), program.couplings.len());
        // a module of Rust has it already
        let mut out = match language.is_c() {
            true => language.vector("FALL", &fall(program)),
            false => String::new(),
        };
        let each = || self.uncertain.iter();
        let bodies = each().flat_map(|of| of.bodies.iter().flatten().copied());
        out += &language.numbers("UNCERTAIN", &[u, links, STANDARD], bodies);
        let drives = each().flat_map(|of| of.drives.iter().copied());
        out += &language.numbers("UNCERTAIN_DRIVE", &[u, n], drives);
        let offsets = each().flat_map(|of| of.offset.iter().copied());
        out += &language.numbers("UNCERTAIN_OFFSET", &[u, n], offsets);
        let friction = each().flat_map(|of| of.friction.iter().copied());
        let count = program.friction.iter().map(JointFriction::parameters).sum();
        if count > 0 {
            out += &language.numbers("UNCERTAIN_FRICTION", &[u, count], friction);
        }
        if trains > 0 {
            let numbers = each().flat_map(|of| of.couplings.iter().flatten().copied());
            out += &language.numbers("UNCERTAIN_TRAIN", &[u, trains, 3], numbers);
        }
        out
    }

    /// Statements for what friction and coupled gear trains add to a deviation.
    fn beside_links(&self, language: &CodeLanguage, program: &Program) -> String {
        let mut lines = Vec::new();
        for (k, (coupling, _)) in program.couplings.iter().enumerate() {
            let numbers = [0, 1, 2].map(|i| format!("UNCERTAIN_TRAIN[k][{k}][{i}]"));
            lines.extend(train(k, coupling, numbers));
        }
        let mut at = 0;
        for (j, law) in program.friction.iter().enumerate() {
            for slope in slopes(law, &format!("v[{j}]")) {
                let line = format!("tau[{j}] += UNCERTAIN_FRICTION[k][{at}] * ({slope});");
                lines.push(line);
                at += 1;
            }
        }
        let text = language.statements(&lines);
        if text.is_empty() { text } else { text + "\n" }
    }

    fn tables(&self, language: &CodeLanguage, edges: usize) -> String {
        let n = self.joints.len();
        let mut out = String::new();
        for (name, cascade) in [("POSITION", &self.position), ("SMOOTH", &self.smooth)] {
            let count = cascade.sections.len();
            let sections = cascade.sections.iter().flatten().copied();
            out += &language.numbers(name, &[count, 5], sections);
            let steady = cascade.steady.iter().flatten().copied();
            out += &language.numbers(&format!("{name}_STEADY"), &[count, 2], steady);
        }
        let padded = |x: &[f64], size: usize, with: f64| {
            let mut x = x.to_vec();
            x.resize(size, with);
            x
        };
        let of = || self.joints.iter();
        let limits = of().flat_map(|j| padded(&j.speed_edges, edges, NEVER));
        out += &language.numbers("EDGES", &[n, edges], limits);
        let std = of().flat_map(|j| padded(&j.std, edges + 1, 0.0));
        out += &language.numbers("STD", &[n, edges + 1], std);
        out += &language.numbers("STANDSTILL", &[n], of().map(|j| j.standstill));
        out += &language.numbers("BAND", &[n], of().map(|j| j.band));
        out += &language.numbers("LIMIT", &[n], of().map(|j| j.limit));
        if let Some(late) = &self.late {
            let (oldest, weights) = late.nodes();
            let oldest = oldest.into_iter().map(|k| k.to_string());
            out += &language.words("OLDEST", "usize", oldest);
            out += &language.numbers("WEIGHTS", &[n, 4], weights.into_iter());
        }
        out
    }
}
