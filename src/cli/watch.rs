//! `cft-ident watch`: external torques row by row, with alarms.

use std::io::{self, BufWriter, ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::context::{self, RunningBar};
use super::outcome::no_standard_output;
use super::{CliError, Context, Outcome, arguments, columns_of, files, logs_of, paths_of, written};
use cft_ident_core::number;
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_logs::output::LogWriter;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::sections::provenance;
use cft_ident_report::report::table::{CellAlignment, Table};
use cft_ident_report::report::{FigureTone, Report, VerdictFigure, VerdictHeadline};
use cft_ident_stages::identify::{self, Log, RowSource, STREAM, WatchLine, WatchSettings, Watched};

const EXAMPLE: &str = "\
Example:
  cft-ident watch unseen.csv -m model.toml --false-alarms 10 -o external.csv";

/// External torque of every joint row by row, with alarms, from a log or from rows as they come.
///
/// On a terminal a line for each alarm as it begins; piped, one JSON object a row: {"t", "joints":
/// [{"joint", "external", "std"}], "alarm"}; with -o or `--json -` none. External torque is what was measured less the model's, both behind the same causal
/// filters: the summary says by how much it is late. Rows on standard input are CSV with a header line,
/// or JSON lines: {"t": 0.1, "q": [..], "tau": [..]}, or columns by their names.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident watch [OPTIONS] -m MODEL.toml LOG|-")]
pub struct Args {
    /// Log, of which a span is chosen by LOG@15.2..23s; `-` reads standard input
    #[arg(value_name = "LOG|-")]
    pub log: LogSpec,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// False alarms an hour that the threshold is for
    #[arg(long, value_name = "PER_HOUR", default_value_t = identify::FALSE_ALARMS_PER_HOUR, value_parser = arguments::positive)]
    pub false_alarms: f64,
    /// A log in which nothing touches the robot and which made nothing of the model: thresholds come from
    /// it, and not from the blocks that the fit set aside; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub unloaded: Vec<LogSpec>,
    /// Log to write, in place of lines on standard output
    #[arg(short, long, value_name = "OUT.csv|.mcap", value_parser = arguments::log_file)]
    pub output: Option<PathBuf>,
    /// Write the thresholds and the alarms as a page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
}

/// Where rows that were watched are written.
enum WatchSink {
    Lines(JsonLines),
    /// A line an alarm, and where the watch stands.
    People(TerminalLines),
    File(Box<LogWriter>),
    None,
}

/// Lines for a person at a terminal, as alarms come.
struct TerminalLines {
    /// Whether an alarm is on.
    on: bool,
    alarms: u64,
    status: RunningBar,
    units: Vec<(String, &'static str)>,
    rows: u64,
}

/// Rows between two looks at the status line.
const STATUS: u64 = 200;

impl TerminalLines {
    fn take(&mut self, line: &WatchLine) {
        let t = line.origin.seconds() + line.t;
        self.rows += 1;
        if self.rows % STATUS == 1 {
            let plural = if self.alarms == 1 { "" } else { "s" };
            let text = format!("watching, {t:.1} s, {} alarm{plural}", self.alarms);
            self.status.label(&text);
        }
        match line.alarm {
            Some(alarm) if !self.on => {
                (self.on, self.alarms) = (true, self.alarms + 1);
                let joints = alarm.joints.iter().map(|of| {
                    let unit = self.units.iter().find(|(joint, _)| *joint == of.joint);
                    let size = number::significant(of.external, 3);
                    format!("{} {size} {}", of.joint, unit.map_or("", |(_, unit)| unit))
                });
                let joints: Vec<String> = joints.collect();
                let text = format!("{t:.3} s: ALARM {}", joints.join(", "));
                context::above_bars(&text);
            }
            None => self.on = false,
            Some(_) => {}
        }
    }
}

/// JSON lines on standard output.
struct JsonLines {
    out: BufWriter<io::Stdout>,
    /// Joint names as JSON strings.
    joints: Vec<String>,
    /// Every line is handed on at once.
    at_once: bool,
}

impl JsonLines {
    fn write(&mut self, line: &WatchLine) -> io::Result<()> {
        let origin = line.origin.seconds();
        let torques = line.external.iter().zip(line.std);
        let torques = self.joints.iter().zip(torques);
        let of = |(name, (external, std)): (&String, (&f64, &f64))| torque(name, *external, *std);
        let joints: Vec<String> = torques.map(of).collect();
        let alarm = line.alarm.map_or("null".to_owned(), |alarm| {
            let of = alarm.joints.iter();
            let joints = of.map(|of| torque(&in_json(&of.joint), of.external, of.std));
            let (from, joints) = (origin + alarm.from_s, joints.collect::<Vec<_>>().join(","));
            format!("{{\"from_s\":{from},\"joints\":[{joints}]}}")
        });
        let (t, joints) = (origin + line.t, joints.join(","));
        writeln!(
            self.out,
            "{{\"t\":{t},\"joints\":[{joints}],\"alarm\":{alarm}}}"
        )?;
        if self.at_once {
            self.out.flush()?;
        }
        Ok(())
    }
}

/// External torque of a joint, whose name is a JSON string, as JSON.
fn torque(joint: &str, external: f64, std: f64) -> String {
    format!("{{\"joint\":{joint},\"external\":{external:.5e},\"std\":{std:.5e}}}")
}

fn in_json(name: &str) -> String {
    serde_json::Value::from(name).to_string()
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let of_stream = args.log.path == Path::new(STREAM);
    let log = (!of_stream).then_some(&*args.log.path);
    let inputs = paths_of(&args.unloaded).chain([&*args.model]).chain(log);
    let outputs = args.output.iter().chain(&args.report).map(|path| &**path);
    context.check_outputs(inputs, outputs)?;
    let given = files::model(&args.model, context)?;
    let robot = &given.value.file.robot;
    let joints = robot.joint_names();
    let mut sink = match &args.output {
        Some(path) => {
            let mut columns = columns_of(&["external", "external_std"], &joints);
            columns.push("alarm".to_owned());
            WatchSink::File(Box::new(LogWriter::create(path, &columns)?))
        }
        None if context.prints_document => WatchSink::None,
        None if io::stdout().is_terminal() => WatchSink::People(TerminalLines {
            on: false,
            alarms: 0,
            rows: 0,
            status: context.progress("watching", None),
            units: (joints.iter().enumerate())
                .map(|(j, joint)| (joint.clone(), robot.torque_unit(j)))
                .collect(),
        }),
        None => WatchSink::Lines(JsonLines {
            out: BufWriter::new(io::stdout()),
            joints: joints.iter().map(|j| in_json(j)).collect(),
            at_once: of_stream,
        }),
    };
    let input = match of_stream {
        true => RowSource::Stream(Box::new(io::stdin())),
        false => RowSource::Log(Log::from(&args.log)),
    };
    let unloaded = logs_of(&args.unloaded);
    let settings = WatchSettings {
        per_hour: args.false_alarms,
        unloaded: &unloaded,
    };
    let mut failed: Option<CliError> = None;
    let mut found = identify::watch(
        &given.value,
        input,
        &settings,
        &context.control,
        &mut |line| match put(&mut sink, line) {
            Ok(goes_on) => goes_on,
            Err(error) => {
                failed = Some(error);
                false
            }
        },
    )?;
    if let Some(error) = failed {
        return Err(error);
    }
    context.check()?;
    let mut report = report(&found, &args.log.name());
    if let Some(path) = &args.report {
        let page = &mut report.page();
        provenance::section(page, robot, &found.inputs, &[], None, &context.command);
        context.write_text(path, &report.html())?;
        written(&mut report, path);
    }
    let text = report.text_for(context.screen);
    let document = JsonDocument::new("watch", &found.inputs, &found.notes, &found)?;
    if let Some(error) = found.error.take() {
        let error = CliError::from(error).hint("the results before it are printed above");
        context.end_with(error);
    }
    let text = match sink {
        WatchSink::File(log) => {
            context.files.add_log(*log)?;
            let path = args.output.as_deref().unwrap_or(Path::new(""));
            format!("{text}written: {}\n", path.display())
        }
        WatchSink::Lines(mut lines) => {
            // a reader that has seen enough is no error
            let _ = lines.out.flush();
            text.trim_end().lines().for_each(|line| context.note(line));
            String::new()
        }
        WatchSink::None | WatchSink::People(_) => text,
    };
    Ok(Outcome::new(text, document))
}

/// Writes what a row shows; whether anybody reads on.
fn put(sink: &mut WatchSink, line: &WatchLine) -> Result<bool, CliError> {
    match sink {
        WatchSink::None => {}
        WatchSink::People(people) => people.take(line),
        WatchSink::File(log) => {
            log.set_origin(line.origin);
            let alarm = f64::from(u8::from(line.alarm.is_some()));
            let values = line.external.iter().chain(line.std).copied();
            log.row(std::iter::once(line.t).chain(values).chain([alarm]))?;
        }
        WatchSink::Lines(lines) => match lines.write(line) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(false),
            written => written.map_err(|error| no_standard_output(&error))?,
        },
    }
    Ok(true)
}

/// Alarms that are listed.
const MAX_ALARMS: usize = 20;

/// The alarms, the thresholds, and what explains the alarms.
fn report(found: &Watched, log: &str) -> Report {
    let mut report = Report::new(&format!("External torques of {}", escape(log)));
    let mut all = report.everywhere();
    let figure = |label, value| VerdictFigure {
        label,
        value,
        tone: FigureTone::Plain,
    };
    let mut figures = vec![
        figure("alarms", found.alarms.len().to_string()),
        figure("above the threshold", number::percent(found.beyond)),
    ];
    if let Some(delay) = found.delay_s {
        figures.push(figure("delay", format!("{:.1} ms", 1e3 * delay)));
    }
    all.headline(VerdictHeadline {
        figures,
        of: format!("{} rows, {:.1} s", found.samples, found.duration_s),
    });
    let alarms = found.alarms.iter().take(MAX_ALARMS).map(|alarm| {
        let joints = alarm.joints.iter().map(|of| {
            let size = number::plus_minus(of.external, of.std);
            format!("{} {size}", of.joint)
        });
        let joints: Vec<String> = joints.collect();
        let [from, to] = [alarm.from_s, alarm.to_s];
        format!("{from:.3} to {to:.3} s: {}", joints.join(", "))
    });
    all.list(alarms);
    if found.alarms.len() > MAX_ALARMS {
        let more = found.alarms.len() - MAX_ALARMS;
        all.line(&format!("  and {more} more"));
    }
    if let Some(found) = &found.explanation {
        let numbers = found.changes.iter().map(|of| {
            let value = number::plus_minus(of.value, of.std);
            format!("{} {value} {}", of.name, of.unit)
        });
        let numbers: Vec<String> = numbers.collect();
        let of = found.joint.as_ref().map(|joint| format!(" of {joint}"));
        all.paragraph(&format!(
            "A change of {}{} explains {} of the alarms' power: {}.",
            found.kind,
            of.unwrap_or_default(),
            number::percent(found.share),
            numbers.join(", ")
        ));
    }
    all.line("");
    all.table(thresholds(found));
    report
}

fn thresholds(found: &Watched) -> Table {
    let proven = match found.proven_per_hour > found.false_alarms_per_hour {
        true => format!(
            " ({:.0} s of unloaded motion prove {:.0} at most)",
            found.calibrated_s, found.proven_per_hour
        ),
        false => String::new(),
    };
    let mut table = Table::new(&[
        ("joint", CellAlignment::Left),
        ("threshold", CellAlignment::Left),
        ("unit", CellAlignment::Left),
        ("force [N]", CellAlignment::Decimal),
        ("", CellAlignment::Left),
    ])
    .caption(&format!(
        "thresholds for {} false alarms an hour{proven}, from slow to fast; smallest detectable force at the {}",
        found.false_alarms_per_hour,
        escape(&found.point)
    ));
    for joint in &found.joints {
        let [low, high] = joint.threshold.map(|x| number::significant(x, 3));
        let both = format!("{low} to {high}");
        let force = joint.force_n.map(|force| number::significant(force, 2));
        let blind = if joint.blind { "cannot be watched" } else { "" };
        table.row([
            joint.joint.as_str(),
            &both,
            &joint.unit,
            force.as_deref().unwrap_or(number::ABSENT),
            blind,
        ]);
    }
    table
}
