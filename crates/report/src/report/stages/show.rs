//! The report of `show`: a model file as a person wants to know it.

use super::diagnose_words::DiagnosisWords;
use crate::report::sections::parameters;
use crate::report::table::Columns;
use crate::report::words::listed;
use crate::report::{FigureTone, FoundLine, Report, VerdictFigure, VerdictHeadline, Writer};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::number;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;
use cft_ident_logs::log::escape;
use cft_ident_stages::identify::{JointInUse, RobotSetup};

/// The parts of the report.
pub struct ShowReport<'a> {
    pub setup: &'a RobotSetup,
    pub file: &'a ModelFile,
    pub model: &'a AugmentedModel,
    /// The errors in use, and the point at which forces are reported.
    pub in_use: Option<&'a (Vec<JointInUse>, String)>,
}

/// The model, first its error in use.
pub fn show(of: &ShowReport) -> Report {
    let name = escape(&of.setup.name);
    let mut report = Report::new(&format!("Model {name}"));
    verdict(of).write(&mut report.everywhere());
    report.terminal().line("");
    let mut all = report.everywhere();
    if let Some((joints, point)) = of.in_use {
        uses(&mut all, joints, point);
        range(&mut all, joints);
    }
    parameters_table(&mut report.terminal(), of.file);
    parameters::section(&mut report.page(), of.file, &|_| None);
    let mut all = report.everywhere();
    friction(&mut all, of);
    effects(&mut report.terminal(), of);
    made_from(&mut report.everywhere(), of.file);
    report
}

/// Error in use and parameters as figures.
fn verdict(of: &ShowReport) -> DiagnosisWords {
    let joints = of.setup.robot.joint_names();
    let figure = |label, value| VerdictFigure {
        label,
        value,
        tone: FigureTone::Plain,
    };
    let mut figures = Vec::new();
    let mut found = Vec::new();
    match of.in_use {
        Some((used, point)) => {
            let part = |j: &JointInUse| j.half_width_95 / j.torque_seen;
            let parts: Vec<f64> = used.iter().map(part).filter(|x| x.is_finite()).collect();
            let square: f64 = parts.iter().map(|x| x * x).sum();
            let rms = (square / parts.len().max(1) as f64).sqrt();
            figures.push(figure(
                "95 % band",
                format!("\u{b1} {} of the torque", number::percent(rms)),
            ));
            let forces = used.iter();
            let forces = forces.filter_map(|j| Some((j.hidden_force_n?, &j.joint)));
            if let Some((force, joint)) = forces.min_by(|a, b| a.0.total_cmp(&b.0)) {
                let force = number::significant(force, 2);
                figures.push(figure("smallest force", format!("{force} N ({joint})")));
                found.push(FoundLine {
                    grade: "force",
                    text: format!("smallest detectable force at the {}", escape(point)),
                });
            }
        }
        None => found.push(FoundLine {
            grade: "not known",
            text: "how far its torques are off: the file holds no [[held_out]]; fit it again"
                .to_owned(),
        }),
    }
    let (tally, all) = parameters::tally(of.file);
    found.push(FoundLine {
        grade: if all { "known" } else { "partly known" },
        text: tally,
    });
    found.push(FoundLine {
        grade: "torques by",
        text: match of.file.is_consistent() {
            true => "physically consistent parameters",
            false => "the plain fit",
        }
        .to_owned(),
    });
    figures.push(figure("joints", joints.len().to_string()));
    DiagnosisWords {
        headline: VerdictHeadline {
            figures,
            of: format!(
                "{} robot: {}",
                of.file.robot.robot.model.name(),
                escape(&joints.join(", "))
            ),
        },
        found,
    }
}

/// The error in use.
fn uses(to: &mut Writer, joints: &[JointInUse], point: &str) {
    let caption = format!(
        "what the error means: 95 % band of the torque where it is widest, mostly in reversals, and the smallest force at the {} of which `watch` gives an alarm at one false alarm an hour",
        escape(point)
    );
    let columns = Columns::new(&caption, joints)
        .words("joint", |j| &j.joint)
        .digits("band +-", 3, |j| j.half_width_95)
        .percent("of torque", |j| j.half_width_95 / j.torque_seen)
        .words("unit", |j| &j.unit)
        .digits("force [N]", 2, |j| j.hidden_force_n);
    to.table(columns);
}

/// For which motion it holds.
fn range(to: &mut Writer, joints: &[JointInUse]) {
    let shown = |x: f64| number::significant(x, 3);
    let caption =
        "holds for motions like those of its logs: beyond these ranges its band is a guess";
    let columns = Columns::new(caption, joints)
        .words("joint", |j| &j.joint)
        .numbers("from", |j| shown(j.positions_seen[0]))
        .numbers("to", |j| shown(j.positions_seen[1]))
        .words("unit", |j| &j.position_unit)
        .numbers("speed up to", |j| shown(j.speed_seen))
        .numbers("torque up to", |j| {
            format!("{} {}", shown(j.torque_seen), j.unit)
        });
    to.table(columns);
}

/// Every parameter with its deviation and its value in use.
fn parameters_table(terminal: &mut Writer, file: &ModelFile) {
    let estimated = file.estimated_parameters();
    let columns = Columns::new("parameters", &estimated)
        .words("parameter", |p| escape(&p.key()))
        .estimates(["value", "std"], |p| (p.value, p.std))
        .when(parameters::differs_in_use(&estimated), |t| {
            let std = |p: &Parameter| p.std.unwrap_or(f64::NAN);
            t.numbers("in use", |p| number::value_and_std(p.in_use(), std(p)).0)
        })
        .words("unit", |p| &p.unit)
        .words("verdict", |p| p.verdict_word());
    terminal.table_apart(columns);
}

/// Characters of a curve, from low to high.
const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// Characters of a curve in each direction.
const STEPS: i32 = 12;

/// The declared friction of each joint over the speeds seen, as a row of characters.
fn friction(to: &mut Writer, of: &ShowReport) {
    let Some((joints, _)) = of.in_use else { return };
    let laws = joints.iter().zip(&of.model.model.friction);
    let laws = laws.filter(|(_, law)| **law != JointFriction::None);
    let rows = laws.map(|(joint, law)| {
        let speeds = (-STEPS..=STEPS).map(|k| joint.speed_seen * f64::from(k) / f64::from(STEPS));
        let values: Vec<f64> = speeds.map(|v| law.torque(v)).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let room = (high - low).max(f64::MIN_POSITIVE);
        let height = |x: &f64| HEIGHTS[((x - low) / room * 7.0).round().clamp(0.0, 7.0) as usize];
        let ends = [values.first(), values.last()];
        let ends = ends.map(|x| number::significant(x.copied().unwrap_or(0.0), 3));
        (joint, values.iter().map(height).collect::<String>(), ends)
    });
    let rows: Vec<_> = rows.collect();
    let caption = "friction from the greatest speed backwards to the greatest forwards";
    let columns = Columns::new(caption, &rows)
        .words("joint", |(joint, ..)| &joint.joint)
        .words("friction over speed", |(_, curve, _)| curve)
        .numbers("at -", |(.., ends)| &ends[0])
        .numbers("at +", |(.., ends)| &ends[1])
        .words("unit", |(joint, ..)| &joint.unit);
    to.table_if_any(columns);
}

fn effects(terminal: &mut Writer, of: &ShowReport) {
    let robot = &of.setup.robot;
    let said =
        of.model.effects.iter().map(|effect| {
            escape(&effect.said_and_named(robot, of.setup.torque_unit_at(effect.place)))
        });
    let said: Vec<String> = said.collect();
    if !said.is_empty() {
        terminal.line("");
        terminal.paragraph(&format!("Effects: {}.", said.join("; ")));
        terminal.table_apart(parameters::effects_table(of.file));
    }
}

/// The logs on which it was fitted.
fn made_from(to: &mut Writer, file: &ModelFile) {
    let made = &file.provenance;
    let inputs = made.inputs.iter().map(|input| {
        let span = input.span.as_ref().map(|span| format!("@{span}"));
        format!("{}{}", escape(&input.name), span.unwrap_or_default())
    });
    let inputs = match made.inputs.is_empty() {
        true => "no log".to_owned(),
        false => listed(inputs),
    };
    let command = match made.command.as_str() {
        "" => "by hand".to_owned(),
        command => format!(
            "by `{}` of cft-ident {}",
            escape(command),
            escape(&made.version)
        ),
    };
    to.paragraph(&format!("Made {command} from {inputs}."));
}
