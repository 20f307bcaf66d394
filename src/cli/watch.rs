//! `cft-ident watch`: external torques row by row, with alarms.

use std::io::{self, BufWriter, ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::{CliError, Context, Outcome, RunningBar, arguments, context, files};
use cft_ident_core::number;
use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_logs::output::LogWriter;
use cft_ident_report::report::json::Document;
use cft_ident_report::report::table::{Align, Table};
use cft_ident_stages::identify::{self, Log, STREAM, WatchLine, WatchSettings, Watchable, Watched};

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
    #[arg(long, value_name = "PER_HOUR", default_value_t = 1.0, value_parser = arguments::positive)]
    pub false_alarms: f64,
    /// A log in which nothing touches the robot and which made nothing of the model: thresholds come from
    /// it, and not from the blocks that the fit set aside; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub unloaded: Vec<LogSpec>,
    /// Log to write, in place of lines on standard output
    #[arg(short, long, value_name = "OUT.csv|.mcap", value_parser = arguments::log_file)]
    pub output: Option<PathBuf>,
}

/// Where rows go.
enum Sink {
    Lines(Lines),
    /// A line an alarm, and where the watch stands.
    People(People),
    File(Box<LogWriter>),
    None,
}

/// What a person at a terminal sees.
struct People {
    /// Whether an alarm is on.
    on: bool,
    alarms: u64,
    status: RunningBar,
    units: Vec<(String, &'static str)>,
    rows: u64,
}

/// Rows between two looks at the status line.
const STATUS: u64 = 200;

impl People {
    fn take(&mut self, line: &WatchLine) {
        let t = line.origin.seconds() + line.t;
        self.rows += 1;
        if self.rows % STATUS == 1 {
            let plural = if self.alarms == 1 { "" } else { "s" };
            self.status.label(&format!(
                "watching, {t:.1} s, {} alarm{plural}",
                self.alarms
            ));
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
struct Lines {
    out: BufWriter<io::Stdout>,
    /// Joint names as JSON strings.
    joints: Vec<String>,
    /// Every line is handed on at once.
    at_once: bool,
}

impl Lines {
    fn write(&mut self, line: &WatchLine) -> io::Result<()> {
        let out = &mut self.out;
        write!(
            out,
            "{{\"t\":{},\"joints\":[",
            line.origin.seconds() + line.t
        )?;
        let values = line.external.iter().zip(line.std);
        for (i, (joint, (external, std))) in self.joints.iter().zip(values).enumerate() {
            let comma = if i > 0 { "," } else { "" };
            write!(
                out,
                "{comma}{{\"joint\":{joint},\"external\":{external:.5e},\"std\":{std:.5e}}}"
            )?;
        }
        match line.alarm {
            None => writeln!(out, "],\"alarm\":null}}")?,
            Some(alarm) => {
                let from = line.origin.seconds() + alarm.from_s;
                write!(out, "],\"alarm\":{{\"from_s\":{from},\"joints\":[")?;
                for (i, of) in alarm.joints.iter().enumerate() {
                    let comma = if i > 0 { "," } else { "" };
                    write!(
                        out,
                        "{comma}{{\"joint\":{},\"external\":{:.5e},\"std\":{:.5e}}}",
                        in_json(&of.joint),
                        of.external,
                        of.std
                    )?;
                }
                writeln!(out, "]}}}}")?;
            }
        }
        if self.at_once {
            out.flush()?;
        }
        Ok(())
    }
}

/// A name as a JSON string.
fn in_json(name: &str) -> String {
    serde_json::Value::from(name).to_string()
}

/// Runs the command.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let of_stream = args.log.path == Path::new(STREAM);
    let mut inputs = vec![args.model.as_path()];
    inputs.extend(args.unloaded.iter().map(|log| log.path.as_path()));
    if !of_stream {
        inputs.push(&args.log.path);
    }
    let outputs: Vec<&Path> = args.output.as_deref().into_iter().collect();
    context.check_outputs(&inputs, &outputs)?;
    let given = files::model(&args.model, context)?;
    let machine = given.value.machine();
    let joints = machine.robot.joint_names();
    let mut sink = match &args.output {
        Some(path) => {
            let named = |kind: &'static str| joints.iter().map(move |j| format!("{kind}_{j}"));
            let columns: Vec<String> = std::iter::once("t".to_owned())
                .chain(named("external"))
                .chain(named("external_std"))
                .chain(["alarm".to_owned()])
                .collect();
            Sink::File(Box::new(LogWriter::create(path, &columns)?))
        }
        None if context.prints_document() => Sink::None,
        None if io::stdout().is_terminal() => Sink::People(People {
            on: false,
            alarms: 0,
            rows: 0,
            status: context.progress("watching", None),
            units: (joints.iter().enumerate())
                .map(|(j, joint)| (joint.clone(), machine.file.torque_unit(j)))
                .collect(),
        }),
        None => Sink::Lines(Lines {
            out: BufWriter::new(io::stdout()),
            joints: joints.iter().map(|j| in_json(j)).collect(),
            at_once: of_stream,
        }),
    };
    let input = match of_stream {
        true => Watchable::Stream(Box::new(io::stdin())),
        false => Watchable::Log(Log::from(&args.log)),
    };
    let unloaded: Vec<Log> = args.unloaded.iter().map(Log::from).collect();
    let settings = WatchSettings {
        per_hour: args.false_alarms,
        unloaded: &unloaded,
    };
    let mut failed: Option<CliError> = None;
    let mut found = identify::watch(
        &given.value,
        input,
        &settings,
        context.control(),
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
    let verdict = verdict(&found);
    let text = context.text(text_of(&found, &args.log.name()), &verdict);
    let document = Document::new("watch", &found.inputs, &found.warnings, &found)?;
    if let Some(error) = found.error.take() {
        let error = CliError::from(error).hint("the results before it are printed above");
        context.end_with(error);
    }
    let text = match sink {
        Sink::File(log) => {
            context.files().add_log(*log)?;
            let path = args.output.as_deref().unwrap_or(Path::new(""));
            format!("{text}written: {}\n", path.display())
        }
        Sink::Lines(mut lines) => {
            // a reader that has seen enough is no error
            let _ = lines.out.flush();
            text.trim_end().lines().for_each(|line| context.note(line));
            String::new()
        }
        Sink::None | Sink::People(_) => text,
    };
    Ok(Outcome {
        text,
        document,
        missed: Vec::new(),
    })
}

/// Writes what a row shows; whether anybody reads on.
fn put(sink: &mut Sink, line: &WatchLine) -> Result<bool, CliError> {
    match sink {
        Sink::None => Ok(true),
        Sink::People(people) => {
            people.take(line);
            Ok(true)
        }
        Sink::File(log) => {
            log.set_origin(line.origin);
            let alarm = f64::from(u8::from(line.alarm.is_some()));
            let values = line.external.iter().chain(line.std).copied();
            log.row(std::iter::once(line.t).chain(values).chain([alarm]))?;
            Ok(true)
        }
        Sink::Lines(lines) => match lines.write(line) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
            Err(error) => Err(CliError::output(format!(
                "cannot write to standard output: {error}"
            ))
            .hint("look at where it leads: a full disk, a program that has ended")),
        },
    }
}

/// How much was seen, in a line.
fn verdict(found: &Watched) -> String {
    format!(
        "{} rows, {:.1} s; {} alarm{}, {} of the rows beyond the threshold",
        found.samples,
        found.duration_s,
        found.alarms.len(),
        if found.alarms.len() == 1 { "" } else { "s" },
        number::percent(found.beyond)
    )
}

/// What was seen, for a person.
fn text_of(found: &Watched, log: &str) -> String {
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("threshold", Align::Left),
        ("unit", Align::Left),
        ("force [N]", Align::Decimal),
        ("", Align::Left),
    ])
    .caption(&format!(
        "external torques of {log}: thresholds for {} false alarms an hour, by speed; the least as a force at the {}",
        found.false_alarms_per_hour,
        escape(&found.point)
    ));
    for joint in &found.joints {
        let [low, high] = joint.threshold.map(|x| number::significant(x, 3));
        let both = format!("{low} .. {high}");
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
    let mut text = table.to_string();
    if let Some(delay) = found.delay_s {
        text += &format!("late by {:.1} ms\n", 1e3 * delay);
    }
    text += &verdict(found);
    text.push('\n');
    for alarm in found.alarms.iter().take(20) {
        let joints = alarm.joints.iter().map(|of| {
            let [size, std] = [of.external, of.std].map(|x| number::significant(x, 3));
            format!("{} {size} (std {std})", of.joint)
        });
        let joints: Vec<String> = joints.collect();
        text += &format!(
            "  {:.3} .. {:.3} s: {}\n",
            alarm.from_s,
            alarm.to_s,
            joints.join(", ")
        );
    }
    if found.alarms.len() > 20 {
        text += &format!("  and {} more\n", found.alarms.len() - 20);
    }
    if let Some(found) = &found.explanation {
        let numbers = found.changes.iter().map(|of| {
            let [value, std] = [of.value, of.std].map(|x| number::significant(x, 3));
            format!("{} {value} +- {std} {}", of.name, of.unit)
        });
        let numbers: Vec<String> = numbers.collect();
        let of = found.joint.as_ref().map(|joint| format!(" of {joint}"));
        text += &format!(
            "a change of {}{} takes away {} of the alarms' power: {}\n",
            found.kind,
            of.unwrap_or_default(),
            number::percent(found.share),
            numbers.join(", ")
        );
    }
    text
}
