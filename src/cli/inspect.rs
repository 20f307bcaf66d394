//! `cft-ident inspect`: what logs hold and what is wrong with them.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::{CliError, Context, Exit, Outcome, columns, logs_of, paths_of, setup};
use cft_ident_core::robot::model::Model;
use cft_ident_core::{motion, number};
use cft_ident_files::config::ModelFile;
use cft_ident_logs::inspect::{
    FaultKind, Inspection, LogFault, LogFindings, OrderComparison, look, look_again,
};
use cft_ident_logs::log::{
    LogSection, LogSpec, Provenance, RawReader, TopicFacts, escape, listing,
};
use cft_ident_report::report::ReportDetail;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{Dataset, IdentifyError, LogData, RobotSetup, repeated_files};
use cft_ident_stages::setup::{Finding, SetupReport};

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

/// What logs hold, and what they say of the robot file.
#[derive(Debug, Serialize, JsonSchema)]
pub struct InspectionResult {
    #[serde(flatten)]
    inspection: Inspection,
    /// What the torques say against the set-up that the robot file declares.
    setup: Vec<Finding>,
    /// Topics of the recordings, in the order of the logs; null where no log is a recording.
    topics: Option<Vec<TopicFacts>>,
}

/// A robot as it was identified.
struct KnownRobot {
    setup: RobotSetup,
    model: Option<Model>,
}

impl KnownRobot {
    fn load(args: &Args) -> Result<Option<Self>, CliError> {
        if let Some(path) = &args.model {
            let name = path.display().to_string();
            let file = ModelFile::load(path)?;
            let model = Some(file.model(&name)?);
            let setup = RobotSetup::new(&name, file.robot);
            return Ok(Some(Self { setup, model }));
        }
        let setup = args.robot.as_deref().map(RobotSetup::load).transpose()?;
        let model = None;
        Ok(setup.map(|setup| Self { setup, model }))
    }
}

/// What one log holds and what is wrong with it, by the robot file where there is one, and the log as it was read.
fn looked_at(
    spec: &LogSpec,
    topic: Option<String>,
    setup: Option<&RobotSetup>,
    context: &Context,
) -> Result<(LogFindings, RawReader), CliError> {
    let section = LogSection {
        topic,
        ..LogSection::default()
    };
    let open = || match setup {
        Some(setup) => RawReader::open(spec, Some(&setup.file.layout())),
        None => RawReader::open_plain(spec, &section),
    };
    let mut log = open()?;
    let (mut plan, refused) = match setup {
        Some(setup) => columns::of_robot(&log, setup),
        None => columns::guessed(&mut log)?,
    };
    let stop = || context.interrupted();
    let found = look(&mut log, &plan, &stop)?;
    let mut findings = found.ok_or_else(CliError::interrupted)?;
    while plan.hides(&findings) {
        let found = look_again(&mut open()?, &mut plan, &findings, &stop)?;
        findings = found.ok_or_else(CliError::interrupted)?;
    }
    plan.ease_unused(&mut findings);
    findings.faults.splice(0..0, refused);
    findings.place();
    Ok((findings, log))
}

/// The same by the robot file.
pub(super) fn findings(
    spec: &LogSpec,
    setup: &RobotSetup,
    context: &Context,
) -> Result<LogFindings, CliError> {
    Ok(looked_at(spec, None, Some(setup), context)?.0)
}

/// Looks at one log, and compares it with the model where there is one.
fn inspect(
    spec: &LogSpec,
    topic: Option<String>,
    known: Option<&KnownRobot>,
    context: &Context,
    warnings: &mut Vec<String>,
) -> Result<(LogFindings, Provenance), CliError> {
    let setup = known.map(|known| &known.setup);
    let (mut findings, log) = looked_at(spec, topic, setup, context)?;
    let name = escape(&spec.name());
    warnings.extend(log.warnings().iter().map(|text| format!("{name}: {text}")));
    if let Some(KnownRobot {
        setup,
        model: Some(model),
    }) = known
    {
        match compare(setup, model, spec, context) {
            Ok(None) => {}
            // A delay by the model is surer than one without it.
            Ok(Some(found)) => {
                findings.faults.retain(|f| f.kind != FaultKind::Delay);
                findings.faults.push(found);
                findings.place();
                findings.sort();
            }
            Err(error) if error.exit() == Exit::Interrupted => return Err(error),
            Err(error) => {
                let text = error.message();
                warnings.push(format!("{name}: not compared with the model: {text}"));
            }
        }
    }
    Ok((findings, log.provenance()?))
}

/// Compares the torques of a log with those that a model gives, joints turned and exchanged.
fn compare(
    setup: &RobotSetup,
    model: &Model,
    spec: &LogSpec,
    context: &Context,
) -> Result<Option<LogFault>, CliError> {
    let joints = setup.robot.joint_names();
    let n = joints.len();
    let mut comparison = OrderComparison::new(n);
    let changes = comparison.changes().to_vec();
    let log = LogData::read(setup, &spec.into(), &context.control)?;
    let mut blocks = log.blocks(&context.control)?;
    let summary = motion::run(
        &mut |block| blocks.read(block),
        n,
        &setup.settings(),
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
    .map_err(|error| IdentifyError::of_run(&spec.name(), error))?;
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

/// Part of the time in which the joints of a log of held poses move at most.
const MOVING_SHARE: f64 = 0.2;
/// Reversals of all joints from which it holds many.
const REVERSALS: u64 = 6;
/// Rate below which rows are poses, where most of them turn a joint \[Hz\].
const ROWS_HZ: f64 = 5.0;

/// That a log holds poses, and the way for it.
fn held_poses(name: &str, found: &LogFindings) -> Option<String> {
    let moving = || found.joints.iter().filter(|joint| joint.moves);
    let reversals = moving().map(|joint| joint.reversals).max()?;
    let slow = moving().all(|joint| joint.moving_share < MOVING_SHARE) && reversals >= REVERSALS;
    let rows = found.rate_hz.is_some_and(|hz| hz < ROWS_HZ) && 4 * reversals > found.rows;
    (slow || rows).then(|| {
        let what = match rows {
            true => "each row is a pose",
            false => "poses are held most of the time",
        };
        format!("{name}: {what}: gravity is fitted to them by `cft-ident lsq --static`")
    })
}

/// Fields of a topic that a terminal shows.
const SHOWN: usize = 12;

fn topics_text(topics: &[TopicFacts]) -> String {
    let mut out = String::new();
    for topic in topics {
        let rate = topic
            .rate_hz
            .map(|hz| format!(", {} Hz", number::significant(hz, 4)));
        let publishers = match topic.publishers {
            1 => String::new(),
            more => format!(", {more} publishers"),
        };
        let [name, kind] = [&topic.name, &topic.kind].map(|text| escape(text));
        let (messages, rate) = (topic.messages, rate.unwrap_or_default());
        out += &format!("topic {name} ({kind}): {messages} messages{rate}{publishers}\n");
        if let Some(reason) = &topic.unreadable {
            out += &format!("  not read: {reason}\n");
        }
        for path in topic.fields.iter().take(SHOWN) {
            out += &format!("  {}\n", escape(path));
        }
        if topic.fields.len() > SHOWN {
            out += &format!("  and {} more\n", topic.fields.len() - SHOWN);
        }
    }
    out
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    context.check_outputs(paths_of(&args.logs), [])?;
    let known = KnownRobot::load(args)?;
    let bar = context.progress("looking at logs", Some(args.logs.len() as u64));
    let (mut logs, mut provenance) = (Vec::new(), Vec::new());
    let mut all_topics = Vec::new();
    let file = known.as_ref().map(|known| &known.setup.file);
    let mut warnings = file.map_or(Vec::new(), |file| file.notes.0.clone());
    let layout = file.map(|file| file.layout());
    let repeated = repeated_files(&args.logs, layout.as_ref());
    warnings.extend(repeated.iter().map(ToString::to_string));
    for spec in &args.logs {
        // What several machines recorded is no one log: each is looked at on its own.
        let machines = match &known {
            Some(_) => Vec::new(),
            None => cft_ident_logs::log::topics(spec)?,
        };
        let topics: Vec<Option<String>> = match machines.len() {
            0 | 1 => vec![None],
            _ => machines.into_iter().map(|of| Some(of.topic)).collect(),
        };
        let listed = listing(spec)?;
        // a recording of no joint states that is known is listed
        let unknown = known.is_none() && topics == [None] && !listed.is_empty();
        if unknown && let Err(error) = RawReader::open(spec, None) {
            warnings.push(format!("{}: {error}", escape(&spec.name())));
            provenance.push(Provenance::of_file(&spec.path)?);
            logs.push((spec.name(), LogFindings::default()));
            all_topics.extend(listed);
            bar.advance(1);
            continue;
        }
        all_topics.extend(listed);
        for topic in topics {
            let name = match &topic {
                None => spec.name(),
                Some(topic) => format!("{} {topic}", spec.name()),
            };
            let (findings, input) = inspect(spec, topic, known.as_ref(), context, &mut warnings)?;
            warnings.extend(held_poses(&escape(&name), &findings));
            logs.push((name, findings));
            provenance.push(input);
        }
        bar.advance(1);
    }
    drop(bar);
    context.check()?;
    let mut report = SetupReport::default();
    if let Some(KnownRobot { setup, model: None }) = &known {
        // of logs that cannot be read the findings say why
        report = match Dataset::read(setup, &logs_of(&args.logs), &context.control) {
            Ok(data) => setup::report(&data, context)?,
            Err(_) => SetupReport::default(),
        };
        context.check()?;
    }
    let mut text = stages::inspect::inspect(&logs, &report.findings);
    stages::setup::section(&mut text.everywhere(), &report);
    for finding in &report.findings {
        text.brief().verdict(&finding.meaning, false);
    }
    let result = InspectionResult {
        inspection: Inspection::of(&logs),
        setup: report.findings,
        topics: (!all_topics.is_empty()).then_some(all_topics),
    };
    let shown = match known.is_some() || context.screen.detail == ReportDetail::Brief {
        true => String::new(),
        false => topics_text(result.topics.as_deref().unwrap_or_default()),
    };
    Ok(Outcome::new(
        text.text_for(context.screen) + &shown,
        JsonDocument::new("inspect", &provenance, &warnings, &result)?,
    ))
}
