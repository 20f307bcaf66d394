//! The command line: arguments in, exit status out. One file per command, each with its `Args` and
//! a `run` that returns an [`Outcome`]; only this room prints, draws bars and chooses the status.
//!
//! A command whose `run` is not written yet is not in [`Command`], and so not on offer.

mod arguments;
mod beside_truth;
mod browser;
mod campaign;
mod colour;
mod columns;
mod compare;
mod context;
mod controller;
mod convert;
mod diagnose;
mod drive;
mod error;
mod example;
mod excite;
mod exit;
mod export;
mod files;
mod friction;
pub mod generate;
mod held;
mod held_out;
mod identify;
mod inspect;
mod known_payload;
mod lsq;
mod named;
mod new;
mod outcome;
mod outputs;
mod payload;
mod pictures;
mod reduce;
mod removed;
mod setup;
mod show;
mod simulate;
mod stage_folder;
mod tool;
mod torque;
mod track;
mod typed;
mod validate;
mod watch;
mod window;

use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::{Parser, Subcommand};

use cft_ident_logs::log::LogSpec;
use cft_ident_logs::output;
use cft_ident_report::report::table::folded;
use cft_ident_report::report::{Report, ReportDetail, TerminalScreen};
use cft_ident_stages::identify::{self as stages, Log, ReducedLogs, is_reduced};

use arguments::DocumentDestination;
use context::Context;
pub use error::CliError;
pub use exit::Exit;
pub use outcome::Outcome;

fn names_of(specs: &[LogSpec]) -> Vec<String> {
    specs.iter().map(LogSpec::name).collect()
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Files of logs.
fn paths_of(specs: &[LogSpec]) -> impl Iterator<Item = &Path> {
    specs.iter().map(|log| log.path.as_path())
}

/// Columns of a log to be written: the time, then one of each kind and joint.
fn columns_of(kinds: &[&str], joints: &[String]) -> Vec<String> {
    let mut columns = vec!["t".to_owned()];
    for kind in kinds {
        columns.extend(joints.iter().map(|joint| format!("{kind}_{joint}")));
    }
    columns
}

/// Says in a report for a terminal that a file was written.
fn written(report: &mut Report, path: &Path) {
    let line = format!("written: {}", path.display());
    report.terminal().line(&line);
}

/// Files as logs of the library.
fn logs_of(specs: &[LogSpec]) -> Vec<Log> {
    specs.iter().map(Log::from).collect()
}

/// Refuses logs with the same rows, the fitted ones and those that are held out.
fn each_log_once(fitted: &[LogSpec], held_out: &[LogSpec]) -> Result<(), CliError> {
    let roles = [("fit", logs_of(fitted)), ("holdout", logs_of(held_out))];
    Ok(stages::each_log_once(&roles, None)?)
}

/// The same where files of reduced logs may stand for those that they were made from.
fn logs(specs: &[LogSpec]) -> Result<Vec<Log>, CliError> {
    let mut all = Vec::new();
    for spec in specs {
        if !is_reduced(&spec.path) {
            all.push(Log::from(spec));
            continue;
        }
        if let Some(span) = spec.span.label() {
            let text = format!(
                "{}@{span}: a file of reduced logs has no spans",
                spec.name()
            );
            return Err(CliError::usage(text)
                .hint("choose the span as the log is reduced: `cft-ident reduce LOG@0..70% ..`"));
        }
        if !spec.leave_out.is_empty() {
            let text = format!(
                "--leave-out: {} holds reduced logs, of which no stretch can be left out",
                spec.name()
            );
            return Err(CliError::usage(text)
                .hint("reduce spans without it: `cft-ident reduce LOG@0..8s LOG@10..s ..`"));
        }
        all.extend(ReducedLogs::load(&spec.path)?.as_logs());
    }
    Ok(all)
}

const EXAMPLES: &str = "\
Begin with a real arm:    cft-ident example ur10
Shell and manual pages:   cft-ident generate completions bash
                          cft-ident generate man DIR

The help of each command ends with examples; --help-all has every option. Their files are those that
`cft-ident identify` leaves in cft-ident-run/.";

/// Identification of robot dynamics from logged joint positions and torques.
#[derive(Debug, Parser)]
#[command(name = "cft-ident", version, term_width = window::columns(window::Stream::Output).min(100), after_help = EXAMPLES, disable_help_flag = true)]
pub struct CommandLine {
    #[command(flatten)]
    common: CommonOptions,
    #[command(subcommand)]
    command: Command,
}

/// Options that every command takes.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options of every command")]
struct CommonOptions {
    /// Write the result as one JSON document to FILE (`-`: to standard output, and nothing else
    /// there)
    #[arg(long, value_name = "FILE", global = true)]
    json: Option<DocumentDestination>,
    /// No progress, no notes, and of the result its verdict alone; warnings and errors stay
    #[arg(short, long, global = true)]
    quiet: bool,
    /// All tables, where a screen shows the verdict, the errors and what to do next
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    verbose: bool,
    /// Open the report in a browser when it is written
    #[arg(long, global = true, hide_short_help = true)]
    open: bool,
    /// Number of threads; the result does not depend on it [default: all]
    #[arg(hide_short_help = true, long, value_name = "N", global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print the help that fits a screen
    #[arg(short, long, global = true, action = clap::ArgAction::HelpShort)]
    help: Option<bool>,
    /// Print the help with every option
    #[arg(long, global = true, action = clap::ArgAction::HelpLong)]
    help_all: Option<bool>,
}

/// Makes the enum of the commands: of each its name and the module with its `Args` and its `run`.
macro_rules! commands {
    ($($name:ident: $module:ident,)+) => {
        /// The commands, in the order of the help.
        #[derive(Debug, Subcommand)]
        enum Command {
            $($name($module::Args),)+
        }

        impl Command {
            fn run(&self, context: &Context) -> Result<Outcome, CliError> {
                match self {
                    $(Self::$name(args) => $module::run(args, context),)+
                }
            }
        }
    };
}

commands! {
    Identify: identify,
    Inspect: inspect,
    Convert: convert,
    Friction: friction,
    Lsq: lsq,
    Validate: validate,
    Reduce: reduce,
    Diagnose: diagnose,
    Drive: drive,
    Track: track,
    Compare: compare,
    Payload: payload,
    Tool: tool,
    Show: show,
    Torque: torque,
    Watch: watch,
    Simulate: simulate,
    Excite: excite,
    Export: export,
    New: new,
    Example: example,
    Generate: generate,
}

/// The process: reads its arguments, runs, and returns the status for the shell.
pub fn main() -> ExitCode {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            stop();
        }
        context::above_bars("stopping; press again to stop at once");
        std::thread::spawn(|| {
            std::thread::sleep(match KEEPS.load(Ordering::Relaxed) {
                true => KEEPING,
                false => GRACE,
            });
            stop();
        });
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        // Without the handler Ctrl-C ends the process as it does by default.
        let _ = writeln!(std::io::stderr(), "warning: no graceful Ctrl-C: {error}");
    }
    run(std::env::args_os(), interrupted).code().into()
}

/// Time that a command has to end by itself after Ctrl-C; some loops do not look up that often.
const GRACE: Duration = Duration::from_secs(1);

/// The same for a command that first writes the best that it has.
const KEEPING: Duration = Duration::from_secs(30);

/// Whether the command that runs is such a one.
static KEEPS: AtomicBool = AtomicBool::new(false);

/// From now on the command writes after Ctrl-C what it has, and is given the time for it.
fn keep_what_there_is() {
    KEEPS.store(true, Ordering::Relaxed);
}

/// Ends the process at once, without an unfinished file.
fn stop() -> ! {
    output::remove_unfinished();
    std::process::exit(Exit::Interrupted.code().into());
}

/// Runs one command line, the program's name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>, interrupted: Arc<AtomicBool>) -> Exit {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match CommandLine::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(answer) => {
            if let Some(error) = removed::named(&answer, &arguments) {
                error::to_stderr(&mut std::io::stderr(), &error.to_string());
                return error.exit();
            }
            // Help and version are answers on standard output, the rest are errors.
            let text = answer.render().to_string();
            let width = window::columns(window::Stream::Error);
            let long = |line: &str| line.chars().count() > width;
            match answer.use_stderr() && text.lines().any(long) {
                // a long list of values, which the parser leaves in one line
                true => error::to_stderr(&mut std::io::stderr(), folded(&text, width).trim_end()),
                false => drop(answer.print()),
            }
            return match answer.use_stderr() {
                true => Exit::Usage,
                false => Exit::Success,
            };
        }
    };
    match execute(&cli, &arguments, interrupted) {
        Ok(exit) => exit,
        Err(error) => {
            error::to_stderr(&mut std::io::stderr(), &error.to_string());
            error.exit()
        }
    }
}

/// Runs one command line, the program's name first, and gives its result instead of showing it; the files that it
/// writes get their names.
pub fn perform(arguments: &[OsString], interrupted: Arc<AtomicBool>) -> Result<Outcome, CliError> {
    let cli = CommandLine::try_parse_from(arguments)
        .map_err(|answer| CliError::usage(answer.render().to_string().trim_end()))?;
    let context = Context::new(true, None, interrupted, arguments);
    let mut outcome = cli.command.run(&context)?;
    outcome.document.warn_first(context.warnings());
    context.files.commit()?;
    Ok(outcome)
}

fn execute(
    cli: &CommandLine,
    arguments: &[OsString],
    interrupted: Arc<AtomicBool>,
) -> Result<Exit, CliError> {
    if let Some(threads) = cli.common.threads {
        // A pool that is there already (a second run in one process) keeps its size: the result
        // does not depend on it.
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build_global();
    }
    let json = cli.common.json.as_ref();
    let quiet = cli.common.quiet;
    let document = json.and_then(DocumentDestination::file);
    let mut context = Context::new(quiet, document, interrupted, arguments);
    context.screen = TerminalScreen {
        detail: match (quiet, cli.common.verbose) {
            (true, _) => ReportDetail::Brief,
            (_, true) => ReportDetail::Full,
            _ => ReportDetail::Usual,
        },
        width: window::columns(window::Stream::Output),
    };
    context.prints_document = matches!(json, Some(DocumentDestination::Stdout));
    // Said before the long run, also by a command that has no other output.
    context.check_outputs([], [])?;
    let mut outcome = cli.command.run(&context)?;
    outcome.document.warn_first(context.warnings());
    if let Some(page) = context.page() {
        outcome.says_where(&page, context.screen.detail);
    }
    outcome.asides = context.asides();
    let exit = outcome::show(
        &outcome,
        json,
        (&context.files, context.screen.detail),
        &mut std::io::stdout().lock(),
        &mut std::io::stderr().lock(),
    )?;
    if cli.common.open {
        match context.page() {
            Some(page) => browser::open(&page)?,
            None => context.note("no report to open: --report FILE.html writes one"),
        }
    }
    context.ending().map_or(Ok(exit), Err)
}

#[cfg(test)]
mod tests {
    use cft_ident_files::config::campaign::EstimatorKind;
    use clap::{CommandFactory, Parser};

    /// One command's arguments on a parser of their own.
    #[derive(Debug, Parser)]
    struct Alone<T: clap::Args> {
        #[command(flatten)]
        args: T,
    }

    fn parse<T: clap::Args>(line: &str) -> Result<T, clap::error::ErrorKind> {
        let words = std::iter::once("command").chain(line.split_whitespace());
        Alone::<T>::try_parse_from(words)
            .map(|alone| alone.args)
            .map_err(|error| error.kind())
    }

    #[test]
    fn the_lines_of_the_contract_are_understood() {
        let args: super::friction::Args =
            parse("a.csv b.csv -r cft.toml --joint q4 -m old.toml -o new.toml").unwrap();
        let names: Vec<String> = args.logs.iter().map(|log| log.name()).collect();
        assert_eq!(names, ["a.csv", "b.csv"]);
        assert_eq!(args.joint.as_deref(), Some("q4"));
        let args: super::lsq::Args =
            parse("id.csv@0..70% -r cft.toml -m f.toml --estimator ols -o m.toml").unwrap();
        assert_eq!(args.estimator, EstimatorKind::Ols);
        assert_eq!(args.logs[0].span.label().as_deref(), Some("0..70%"));
        let args: super::validate::Args =
            parse("v.csv -m m.toml --max-relative-error 0.02 -o r.csv --plot a.svg --plot b.svg")
                .unwrap();
        assert_eq!(args.max_relative_error, Some(0.02));
        assert_eq!(args.plot.len(), 2);
        parse::<super::torque::Args>("v.csv -m m.toml -o t.csv").unwrap();
        let args: super::convert::Args = parse("a.csv b.csv out.mcap").unwrap();
        assert_eq!((args.logs.len(), args.output), (2, "out.mcap".into()));
        let args: super::identify::Args = parse("").unwrap();
        assert!(args.files.is_empty());
        let args: super::simulate::Args = parse(
            "-r cft.toml --move q4 --seconds 20 --effect payload:mass=1 --effect ripple:q5 --seed 3 -o q4.csv",
        )
        .unwrap();
        assert_eq!(args.effects[0].values, [("mass".to_owned(), 1.0)]);
        assert_eq!(args.effects[1].joint.as_deref(), Some("q5"));
        assert_eq!((args.seed, args.seconds), (3, Some(20.0)));
    }

    const SCREEN: usize = 45;

    #[test]
    fn every_help_fits_80_columns_and_a_screen_and_has_an_example() {
        let all = super::CommandLine::command();
        for command in all.get_subcommands().filter(|c| !c.is_hide_set()) {
            let mut alone = command.clone().max_term_width(80);
            let text = alone.render_long_help().to_string();
            assert!(text.contains("Example:\n  cft-ident "), "{text}");
            let long = text.lines().find(|line| line.chars().count() > 80);
            assert_eq!(long, None);
            let short = alone.render_help().to_string();
            let lines = short.lines().count();
            assert!(lines <= SCREEN, "{lines} lines:\n{short}");
        }
    }

    fn refused<T: clap::Args + std::fmt::Debug>(line: &str) -> clap::error::ErrorKind {
        parse::<T>(line).unwrap_err()
    }

    #[test]
    fn lines_that_contradict_the_contract_are_refused() {
        use super::{friction, lsq, simulate, validate};
        use clap::error::ErrorKind::*;
        let two = "-r cft.toml --move q4 --reference t.toml -o a.csv";
        assert_eq!(refused::<simulate::Args>(two), ArgumentConflict);
        let ending = "-r cft.toml -o a.xyz";
        assert_eq!(refused::<simulate::Args>(ending), ValueValidation);
        let no_log = "-r cft.toml -o m.toml";
        assert_eq!(refused::<friction::Args>(no_log), MissingRequiredArgument);
        let span = "a.csv@70..0% -r cft.toml -o m.toml";
        assert_eq!(refused::<lsq::Args>(span), ValueValidation);
        let estimator = "a.csv -r cft.toml -o m.toml --estimator magic";
        assert_eq!(refused::<lsq::Args>(estimator), InvalidValue);
        let limit = "a.csv -m m.toml --max-relative-error nan";
        assert_eq!(refused::<validate::Args>(limit), ValueValidation);
    }
}
