//! The report of `show`: a model file as a person wants to know it.

use crate::report::sections::parameters;
use crate::report::table::{Align, Table};
use crate::report::{Report, Writer};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::number;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::escape;
use cft_ident_stages::identify::{BANDWIDTH_HZ, JointInUse, LoggedRobot};

/// What the report is made from.
pub struct Show<'a> {
    pub machine: &'a LoggedRobot,
    pub file: &'a ModelFile,
    pub model: &'a AugmentedModel,
    /// What the errors mean in use, and the point that forces are reported at.
    pub in_use: Option<&'a (Vec<JointInUse>, String)>,
}

/// The model, first what its error means.
pub fn show(of: &Show) -> Report {
    let name = escape(&of.machine.name);
    let mut report = Report::new(&format!("Model {name}"));
    let (text, good) = verdict(of);
    report.everywhere().verdict(&text, good);
    report.terminal().line("");
    let mut all = report.everywhere();
    if let Some((joints, point)) = of.in_use {
        all.table(uses(joints, point));
        all.table(range(joints));
    }
    parameters_table(&mut report.terminal(), of.file);
    parameters::section(&mut report.page(), of.file, &|_| None);
    let mut all = report.everywhere();
    friction(&mut all, of);
    effects(&mut report.terminal(), of);
    made_from(&mut report.everywhere(), of.file);
    report
}

fn verdict(of: &Show) -> (String, bool) {
    let joints = of.machine.robot.joint_names();
    let (tally, good) = parameters::tally(of.file);
    let kind = of.file.robot.robot.model.name();
    let mut text = format!(
        "{kind} robot, {} joint{}: {}. ",
        joints.len(),
        if joints.len() == 1 { "" } else { "s" },
        escape(&joints.join(", "))
    );
    text += &format!("{tally}.");
    text += match of.file.is_consistent() {
        true => " Torques are computed with physically consistent parameters beside the plain fit.",
        false => " It holds the plain fit alone.",
    };
    let hidden = of.in_use.and_then(|(joints, point)| {
        let forces = joints
            .iter()
            .filter_map(|j| Some((j.hidden_force_n?, &j.joint)));
        let (force, joint) = forces.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!(
            " The smallest force at the {} that it can show is {} N, by {joint}.",
            escape(point),
            number::significant(force, 2)
        ))
    });
    text += hidden.as_deref().unwrap_or(
        " How far its torques are off is not known: the file holds no [[held_out]]; fit it again.",
    );
    (text, good && of.in_use.is_some())
}

/// What the error means in use.
fn uses(joints: &[JointInUse], point: &str) -> Table {
    let caption = format!(
        "what the error means: 95 % band of the torque, the force at the {} that it hides, and the lag that \
         feed-forward leaves to a position loop of {BANDWIDTH_HZ} Hz",
        escape(point)
    );
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("band +-", Align::Decimal),
        ("of torque", Align::Decimal),
        ("unit", Align::Left),
        ("hides [N]", Align::Decimal),
        ("lag", Align::Decimal),
        ("of", Align::Left),
    ])
    .caption(&caption);
    let shown = |x: Option<f64>, digits| {
        x.map_or(number::ABSENT.to_owned(), |x| {
            number::significant(x, digits)
        })
    };
    for j in joints {
        table.row([
            j.joint.as_str(),
            &number::significant(j.half_width_95, 3),
            &number::percent(j.half_width_95 / j.torque_seen),
            &j.unit,
            &shown(j.hidden_force_n, 2),
            &shown(j.lag.map(|lag| 1e3 * lag), 2),
            if j.position_unit == "m" { "mm" } else { "mrad" },
        ]);
    }
    table
}

/// For what motion it holds.
fn range(joints: &[JointInUse]) -> Table {
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("from", Align::Decimal),
        ("to", Align::Decimal),
        ("unit", Align::Left),
        ("speed up to", Align::Decimal),
        ("torque up to", Align::Decimal),
    ])
    .caption("holds for motions like those of its logs: beyond these ranges its band is a guess");
    for j in joints {
        let [low, high] = j.positions_seen;
        table.row([
            j.joint.as_str(),
            &number::significant(low, 3),
            &number::significant(high, 3),
            &j.position_unit,
            &number::significant(j.speed_seen, 3),
            &format!("{} {}", number::significant(j.torque_seen, 3), j.unit),
        ]);
    }
    table
}

/// Every parameter with its interval and what is in use of it.
fn parameters_table(terminal: &mut Writer, file: &ModelFile) {
    let consistent = file.is_consistent();
    let mut columns = vec![
        ("parameter", Align::Left),
        ("value", Align::Decimal),
        ("std", Align::Decimal),
    ];
    if consistent {
        columns.push(("in use", Align::Decimal));
    }
    columns.extend([("unit", Align::Left), ("verdict", Align::Left)]);
    let mut table = Table::new(&columns).caption("parameters");
    for p in &file.parameters {
        let (value, std) = number::value_and_std(p.value, p.std.unwrap_or(f64::NAN));
        let mut row = vec![escape(&p.key()), value, std];
        if consistent {
            row.push(number::value_and_std(p.in_use(), p.std.unwrap_or(f64::NAN)).0);
        }
        row.extend([p.unit.clone(), p.verdict_word().to_owned()]);
        table.row(row);
    }
    terminal.line("");
    terminal.table(table);
}

/// Characters of a curve, from low to high.
const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// Characters of a curve in each direction.
const STEPS: i32 = 12;

/// The declared friction of each joint over the speeds seen, as a row of characters.
fn friction(to: &mut Writer, of: &Show) {
    let Some((joints, _)) = of.in_use else { return };
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("friction over speed", Align::Left),
        ("at -", Align::Decimal),
        ("at +", Align::Decimal),
        ("unit", Align::Left),
    ])
    .caption("friction from the greatest speed backwards to the greatest forwards");
    let mut any = false;
    for (joint, law) in joints.iter().zip(&of.model.model.friction) {
        if *law == JointFriction::None {
            continue;
        }
        any = true;
        let speeds = (-STEPS..=STEPS).map(|k| joint.speed_seen * f64::from(k) / f64::from(STEPS));
        let values: Vec<f64> = speeds.map(|v| law.torque(v)).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let room = (high - low).max(f64::MIN_POSITIVE);
        let curve: String = values
            .iter()
            .map(|x| HEIGHTS[((x - low) / room * 7.0).round().clamp(0.0, 7.0) as usize])
            .collect();
        let ends = [values.first(), values.last()];
        let [first, last] = ends.map(|x| number::significant(x.copied().unwrap_or(0.0), 3));
        table.row([joint.joint.as_str(), &curve, &first, &last, &joint.unit]);
    }
    if any {
        to.table(table);
    }
}

fn effects(terminal: &mut Writer, of: &Show) {
    let robot = &of.machine.robot;
    let said = of.model.effects.iter().map(|effect| {
        let joint = effect.place.joint().unwrap_or(0);
        escape(&effect.said_and_named(robot, of.machine.file.torque_unit(joint)))
    });
    let said: Vec<String> = said.collect();
    if !said.is_empty() {
        terminal.line("");
        terminal.paragraph(&format!("Effects: {}.", said.join("; ")));
    }
}

/// What it was fitted on.
fn made_from(to: &mut Writer, file: &ModelFile) {
    let made = &file.provenance;
    let inputs = made.inputs.iter().map(|input| {
        let span = input.span.as_ref().map(|span| format!("@{span}"));
        format!("{}{}", escape(&input.name), span.unwrap_or_default())
    });
    let inputs: Vec<String> = inputs.collect();
    let command = match made.command.as_str() {
        "" => "by hand".to_owned(),
        command => format!(
            "by `{}` of cft-ident {}",
            escape(command),
            escape(&made.version)
        ),
    };
    to.paragraph(&format!(
        "Made {command} from {}.",
        match inputs.is_empty() {
            true => "no log".to_owned(),
            false => inputs.join(", "),
        }
    ));
}
