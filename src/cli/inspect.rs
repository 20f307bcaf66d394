//! `cft-ident inspect`: what logs hold and what is wrong with them.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::machine::{Machine, run_error};
use super::{CliError, Context, Exit, Outcome, columns};
use crate::config::ModelFile;
use crate::inspect::{Comparison, Fault, Findings, Kind, Severity, look};
use crate::log::{LogSpec, Provenance, RawReader, escape};
use crate::motion;
use crate::number;
use crate::report::json::Document;
use crate::report::table;
use crate::report::table::Align;
use crate::robot::model::Model;

const EXAMPLE: &str = "\
Example:
  cft-ident inspect unseen.csv
  cft-ident inspect unseen.csv@0..70% -r configs/cft.toml --json -";

/// Say what logs hold and what is wrong with them.
///
/// Rate, gaps, range and grain of every channel, what each joint does, and the faults: what, where,
/// what it does to a fit, and what to do about it. Without a robot file channels are known by their
/// names (q_elbow, dq1, tau_2, Position ...). Ends with status 0 whatever it finds.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/cft.toml: maps columns, knows units and limits
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: Option<String>,
    /// Model file, which carries its robot: finds joints that are swapped or have the other sign
    #[arg(short, long, value_name = "MODEL.toml", conflicts_with = "robot")]
    pub model: Option<PathBuf>,
}

/// A robot as it was identified.
struct Known {
    machine: Machine,
    model: Option<Model>,
}

impl Known {
    fn load(args: &Args) -> Result<Option<Self>, CliError> {
        if let Some(path) = &args.model {
            let name = path.display().to_string();
            let file = ModelFile::load(path)?;
            let model = Some(file.model(&name)?);
            let machine = Machine::new(&name, file.robot.clone());
            return Ok(Some(Self { machine, model }));
        }
        let load = |robot: &str| {
            Ok(Self {
                machine: Machine::load(robot)?,
                model: None,
            })
        };
        args.robot.as_deref().map(load).transpose()
    }
}

/// One log as it was found.
struct Inspected {
    name: String,
    findings: Findings,
}

/// Looks at one log.
fn inspect(
    spec: &LogSpec,
    known: Option<&Known>,
    context: &Context,
    warnings: &mut Vec<String>,
) -> Result<(Inspected, Provenance), CliError> {
    let machine = known.map(|known| &known.machine);
    let layout = machine.map(|machine| machine.file.layout());
    let mut log = RawReader::open(spec, layout.as_ref())?;
    let (plan, refused) = match machine {
        Some(machine) => columns::of_robot(&log, machine),
        None => columns::guessed(&log)?,
    };
    let found = look(&mut log, &plan, &|| context.interrupted())?;
    let mut findings = found.ok_or_else(CliError::interrupted)?;
    findings.faults.splice(0..0, refused);
    warnings.extend(
        log.warnings()
            .iter()
            .map(|text| format!("{}: {text}", escape(&spec.name()))),
    );
    if let Some(Known {
        machine,
        model: Some(model),
    }) = known
    {
        match compare(machine, model, spec, context) {
            Ok(None) => {}
            // A delay by the model is surer than one without it.
            Ok(Some(found)) => {
                findings.faults.retain(|fault| fault.kind != Kind::Delay);
                findings.faults.push(found);
                findings.sort();
            }
            Err(error) if error.exit() == Exit::Interrupted => return Err(error),
            Err(error) => warnings.push(format!(
                "{}: not compared with the model: {}",
                escape(&spec.name()),
                error.message()
            )),
        }
    }
    let name = spec.name();
    Ok((Inspected { name, findings }, log.provenance()?))
}

/// What one log holds and what is wrong with it, by the robot file.
///
/// # Errors
/// A log that cannot be read at all, and interruption.
pub(super) fn findings(
    spec: &LogSpec,
    machine: &Machine,
    context: &Context,
) -> Result<Findings, CliError> {
    let mut log = RawReader::open(spec, Some(&machine.file.layout()))?;
    let (plan, refused) = columns::of_robot(&log, machine);
    let found = look(&mut log, &plan, &|| context.interrupted())?;
    let mut findings = found.ok_or_else(CliError::interrupted)?;
    findings.faults.splice(0..0, refused);
    Ok(findings)
}

/// Compares the torques of a log with those that a model gives, joints turned and exchanged.
fn compare(
    machine: &Machine,
    model: &Model,
    spec: &LogSpec,
    context: &Context,
) -> Result<Option<Fault>, CliError> {
    let joints = machine.robot.joint_names();
    let n = joints.len();
    let mut comparison = Comparison::new(n);
    let changes = comparison.changes().to_vec();
    let mut log = machine.open(spec, context)?;
    let summary = motion::run(
        &mut |block| log.read(block),
        n,
        &machine.settings(),
        None,
        comparison.channels(),
        &|s, out| {
            let (modelled, logged) = out.split_at_mut(n * changes.len());
            logged.copy_from_slice(s.tau);
            CHANGED.with_borrow_mut(|changed| {
                for (change, torque) in changes.iter().zip(modelled.chunks_exact_mut(n)) {
                    for (to, x) in changed.iter_mut().zip([s.q, s.v, s.a]) {
                        to.clear();
                        to.extend_from_slice(x);
                        change.apply(to);
                    }
                    let [q, v, a] = &*changed;
                    model.torque(q, v, a, torque);
                    // A pose that the robot cannot have explains nothing.
                    if torque.iter().any(|x| !x.is_finite()) {
                        torque.fill(0.0);
                    }
                }
            });
        },
        &mut |row| comparison.add(row.segment, row.t, row.filtered),
    )
    .map_err(|error| run_error(spec, error))?;
    let (rows, duration_s) = (summary.samples, summary.duration_s);
    let order = comparison.fault(joints, rows, duration_s);
    // With joints in the wrong order there is no delay to speak of.
    let delay = || comparison.delay(summary.dt, rows, duration_s);
    Ok(order.or_else(delay))
}

thread_local! {
    /// Position, velocity and acceleration of one sample with joints changed.
    static CHANGED: std::cell::RefCell<[Vec<f64>; 3]> = const { std::cell::RefCell::new([const { Vec::new() }; 3]) };
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read at all.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs: Vec<_> = args.logs.iter().map(|log| log.path.as_path()).collect();
    context.check_outputs(&inputs, &[])?;
    let known = Known::load(args)?;
    let bar = context.progress("looking at logs", Some(args.logs.len() as u64));
    let (mut logs, mut provenance, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for spec in &args.logs {
        let (log, input) = inspect(spec, known.as_ref(), context, &mut warnings)?;
        logs.push(log);
        provenance.push(input);
        bar.advance(1);
    }
    drop(bar);
    context.check()?;
    Ok(Outcome {
        text: logs.iter().map(text).collect(),
        document: Document::new("inspect", &provenance, &warnings, &document(&logs))?,
        missed: Vec::new(),
    })
}

/// The fields of one log stand at the top; of several, in `logs`, with the lists together at the
/// top, each entry with its log's name.
fn document(logs: &[Inspected]) -> Value {
    let mut fields = serde_json::Map::new();
    if let [log] = logs {
        if let Value::Object(own) = json!(log.findings) {
            fields = own;
        }
        return Value::Object(fields);
    }
    let mut each = Vec::new();
    let lists = ["channels", "gaps", "joints", "faults"];
    let mut all = lists.map(|_| Vec::new());
    for log in logs {
        let mut own = json!(log.findings);
        own["log"] = log.name.clone().into();
        for (list, all) in lists.iter().zip(&mut all) {
            for entry in own[*list].as_array().into_iter().flatten() {
                let mut entry = entry.clone();
                entry["log"] = log.name.clone().into();
                all.push(entry);
            }
        }
        each.push(own);
    }
    let rates = logs.iter().filter_map(|log| log.findings.rate_hz);
    let jitters = logs.iter().filter_map(|log| log.findings.jitter);
    fields.insert("rate_hz".into(), json!(rates.reduce(f64::min)));
    fields.insert("jitter".into(), json!(jitters.reduce(f64::max)));
    for (list, all) in lists.iter().zip(all) {
        fields.insert((*list).to_owned(), all.into());
    }
    fields.insert("logs".into(), each.into());
    Value::Object(fields)
}

fn text(log: &Inspected) -> String {
    let found = &log.findings;
    let mut out = format!(
        "{}: {} rows in {} s",
        escape(&log.name),
        found.rows,
        number::significant(found.duration_s, 5)
    );
    if let (Some(rate), Some(jitter)) = (found.rate_hz, found.jitter) {
        out += &format!(
            ", {} Hz, jitter {}, {} gap(s)",
            number::significant(rate, 5),
            number::percent(jitter),
            found.gaps.len()
        );
    }
    out = table::hanging("", &out, 2) + "\n";
    out += &channels(found).to_string();
    if !found.joints.is_empty() {
        out += &format!("\n{}", joints(found));
    }
    out += &faults(found);
    out + "\n"
}

fn channels(found: &Findings) -> table::Table {
    let mut table = table::Table::new(&[
        ("channel", Align::Left),
        ("from", Align::Decimal),
        ("to", Align::Decimal),
        ("unit", Align::Left),
        ("step", Align::Decimal),
        ("limits", Align::Left),
    ]);
    for channel in &found.channels {
        let limits = channel.limits.map(|[low, high]| {
            format!(
                "{}..{}",
                number::significant(low, 4),
                number::significant(high, 4)
            )
        });
        let absent = f64::NAN;
        table.row([
            escape(&channel.name),
            number::significant(channel.min.unwrap_or(absent), 5),
            number::significant(channel.max.unwrap_or(absent), 5),
            channel.unit.clone().unwrap_or_default(),
            channel
                .step
                .map(|step| number::significant(step, 3))
                .unwrap_or_default(),
            limits.unwrap_or_default(),
        ]);
    }
    table
}

fn joints(found: &Findings) -> table::Table {
    let mut columns = vec![
        ("joint", Align::Left),
        ("moves", Align::Left),
        ("travel", Align::Decimal),
        ("speed", Align::Decimal),
        ("acc.", Align::Decimal),
        ("reversals", Align::Right),
        ("moving", Align::Decimal),
        ("condition", Align::Decimal),
    ];
    let known = found.joints.iter().any(|joint| joint.unit.is_some());
    if known {
        columns.push(("unit", Align::Left));
    }
    let unit = match known {
        true => "unit",
        false => "unit of the log",
    };
    let mut table = table::Table::new(&columns).caption(&format!(
        "motion: travel [{unit}], greatest speed [{unit}/s] and acceleration [{unit}/s^2]"
    ));
    for joint in &found.joints {
        table.row([
            escape(&joint.joint),
            if joint.moves { "yes" } else { "no" }.to_owned(),
            number::significant(joint.travel, 3),
            number::significant(joint.speed_max, 3),
            number::significant(joint.acceleration_max, 3),
            joint.reversals.to_string(),
            number::percent(joint.moving_share),
            joint
                .condition
                .map(|condition| number::significant(condition, 3))
                .unwrap_or_default(),
            // Left off where there is no column for it.
            joint.unit.clone().unwrap_or_default(),
        ]);
    }
    table
}

fn faults(found: &Findings) -> String {
    if found.faults.is_empty() {
        return "\nno faults found\n".to_owned();
    }
    let count = |severity| found.of(severity).count();
    let mut out = format!(
        "\n{} error(s), {} warning(s), {} note(s)\n",
        count(Severity::Error),
        count(Severity::Warning),
        count(Severity::Info)
    );
    // One channel at several times, or several channels with the same words.
    let alike = |a: &Fault, b: &Fault| {
        (a.kind, a.severity, &a.remedy) == (b.kind, b.severity, &b.remedy)
            && (a.channel == b.channel || (&a.effect, a.span()) == (&b.effect, b.span()))
    };
    let mut told: Vec<&Fault> = Vec::new();
    for fault in &found.faults {
        if told.iter().any(|earlier| alike(earlier, fault)) {
            continue;
        }
        let all: Vec<&Fault> = found.faults.iter().filter(|f| alike(f, fault)).collect();
        told.push(fault);
        let distinct = |texts: Vec<String>| {
            let mut out: Vec<String> = Vec::new();
            for text in texts {
                if !out.contains(&text) {
                    out.push(text);
                }
            }
            out.join(", ")
        };
        let channels = all.iter().filter_map(|fault| fault.channel.as_deref());
        let channels = distinct(channels.map(escape).collect());
        let spans = distinct(all.iter().map(|fault| fault.span()).collect());
        let head = [fault.severity.word(), fault.kind.word(), &channels].join(" ");
        out += &format!(
            "\n{}{}{}",
            table::paragraph(&format!("{}: {spans} s", head.trim_end()), 0),
            table::paragraph(&fault.effect, 4),
            table::paragraph(&format!("-> {}", fault.remedy), 4)
        );
    }
    out
}
