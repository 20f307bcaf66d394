//! What every command is given beside its own arguments: where messages go, whether the user has
//! asked to stop, and the progress bar.

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use indicatif::{
    HumanDuration, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle,
};

use super::error::{CliError, indented, to_stderr};
use super::{outputs, typed};
use cft_ident_logs::output::FileBatch;
use cft_ident_report::report::{ReportDetail, TerminalScreen};
use cft_ident_stages::identify::{self, Control};

#[derive(Debug)]
pub struct Context {
    quiet: bool,
    json: Option<PathBuf>,
    bars: bool,
    interrupted: Arc<AtomicBool>,
    said: Mutex<CommandRemarks>,
    /// The command as it was typed, without folders from the root on and without what does not change a result.
    pub(super) command: String,
    /// How much of a result is shown, and how wide.
    pub(super) screen: TerminalScreen,
    /// The document goes to standard output, and nothing else.
    pub(super) prints_document: bool,
    /// [`Context::interrupted`] and the progress bars, for a stage of [`identify`].
    pub(super) control: Control,
    /// The outputs, which get their names together when the command has ended well.
    pub(super) files: FileBatch,
}

/// What a command leaves beside its result.
#[derive(Debug, Default)]
struct CommandRemarks {
    page: Option<PathBuf>,
    /// The error that ends the command once its results are written.
    ending: Option<CliError>,
    /// Warnings that stand before those of the command's own result.
    warnings: Vec<String>,
    /// Those of all warnings that a terminal shows only where everything is asked for.
    asides: Vec<String>,
}

impl Context {
    /// Bars are drawn on a terminal; `json` is the file of the document, `interrupted` is set from outside.
    pub fn new(
        quiet: bool,
        json: Option<&Path>,
        interrupted: Arc<AtomicBool>,
        arguments: &[OsString],
    ) -> Self {
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        let bars = !quiet && std::io::stderr().is_terminal() && !dumb;
        let flag = Arc::clone(&interrupted);
        let running = Mutex::new(Vec::new());
        let control = Control::default()
            .stopped_by(move || flag.load(Ordering::Relaxed))
            .reporting_to(move |progress| {
                let mut running = running.lock().unwrap_or_else(PoisonError::into_inner);
                show(progress, &mut running, bars, quiet);
            });
        Context {
            quiet,
            json: json.map(Path::to_path_buf),
            bars,
            interrupted,
            said: Mutex::default(),
            command: typed::line(arguments),
            screen: TerminalScreen::of(ReportDetail::Usual),
            prints_document: false,
            control,
            files: FileBatch::default(),
        }
    }

    fn said(&self) -> MutexGuard<'_, CommandRemarks> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is shown of a result that is no report: all of it, or `brief` where little is asked for.
    pub(super) fn text(&self, all: String, brief: &str) -> String {
        match self.screen.detail {
            ReportDetail::Brief => format!("{brief}\n"),
            ReportDetail::Usual | ReportDetail::Full => all,
        }
    }

    /// Ends the command with an error after its results are written.
    pub(super) fn end_with(&self, error: CliError) {
        self.said().ending = Some(error);
    }

    /// That error.
    pub(super) fn ending(&self) -> Option<CliError> {
        self.said().ending.take()
    }

    /// Whether the user has asked to stop; long loops look at it between blocks.
    pub fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    /// The flag behind [`Context::interrupted`], for a room that takes one.
    pub(super) fn stop_flag(&self) -> &AtomicBool {
        &self.interrupted
    }

    /// [`Context::interrupted`] as an error, to be left with `?` before anything is written.
    pub fn check(&self) -> Result<(), CliError> {
        match self.interrupted() {
            true => Err(CliError::interrupted()),
            false => Ok(()),
        }
    }

    /// Looks at the outputs before the long run; a file that is renewed in place is not given in `inputs`.
    pub(super) fn check_outputs<'a>(
        &'a self,
        inputs: impl IntoIterator<Item = &'a Path>,
        outputs: impl IntoIterator<Item = &'a Path>,
    ) -> Result<(), CliError> {
        let outputs = outputs.into_iter().chain(self.json.as_deref());
        outputs::check(inputs, outputs)
    }

    /// Writes a text that gets its name with the other outputs.
    pub(super) fn write_text(&self, path: &Path, text: &str) -> Result<(), CliError> {
        if path.extension().is_some_and(|end| end == "html") {
            self.said().page = Some(path.to_owned());
        }
        Ok(self.files.write(path, text.as_bytes())?)
    }

    pub(super) fn page(&self) -> Option<PathBuf> {
        self.said().page.clone()
    }

    /// A warning about what was given, for the document and for standard error; once, however often it is found.
    pub(super) fn warn(&self, text: &str) {
        let mut said = self.said();
        if !said.warnings.iter().any(|known| known == text) {
            said.warnings.push(text.to_owned());
        }
    }

    /// Says of a warning that it does not touch the result that was asked for.
    pub(super) fn aside(&self, text: &str) {
        self.said().asides.push(text.to_owned());
    }

    pub(super) fn asides(&self) -> Vec<String> {
        self.said().asides.clone()
    }

    pub(super) fn warnings(&self) -> Vec<String> {
        self.said().warnings.clone()
    }

    /// A line on standard error for the person who waits; `-q` silences it.
    pub fn note(&self, text: &str) {
        note(text, self.quiet);
    }

    /// The bar of a command of several stages, above those of the work in each.
    pub(super) fn stages(&self, names: &'static [&'static str]) -> StageBar {
        StageBar::new(names, self.bars)
    }

    /// A progress bar over `total` steps (a spinner for `None`), removed when it is dropped.
    pub fn progress(&self, label: &str, total: Option<u64>) -> RunningBar {
        RunningBar::new(label, total, self.bars)
    }
}

/// The bars that are drawn now; what else is written to the terminal stands above them.
static BARS: LazyLock<MultiProgress> =
    LazyLock::new(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10)));

/// A line on standard error, above the bars.
pub(super) fn above_bars(text: &str) {
    BARS.suspend(|| to_stderr(&mut std::io::stderr(), text));
}

/// A line on standard error, unless that is to be quiet.
fn note(text: &str, quiet: bool) {
    if !quiet {
        above_bars(&indented(text));
    }
}

/// Shows the progress of a stage; the bar that began last is the one that moves.
fn show(progress: identify::Progress, running: &mut Vec<RunningBar>, bars: bool, quiet: bool) {
    match progress {
        identify::Progress::Begin(work, steps) => running.push(RunningBar::new(work, steps, bars)),
        identify::Progress::End => drop(running.pop()),
        identify::Progress::Note(text) => note(text, quiet),
        identify::Progress::Advance(steps) => {
            if let Some(bar) = running.last() {
                bar.advance(steps);
            }
        }
        identify::Progress::Doing(what) => {
            if let Some(bar) = running.last() {
                bar.label(what);
            }
        }
    }
}

/// Time between two looks at the clock of a bar.
const TICK: Duration = Duration::from_millis(250);

/// A running bar; its methods may be called from any thread.
#[derive(Debug)]
pub struct RunningBar {
    bar: ProgressBar,
}

impl RunningBar {
    fn new(label: &str, total: Option<u64>, drawn: bool) -> Self {
        let bar = match total {
            Some(total) => ProgressBar::new(total),
            None => ProgressBar::new_spinner(),
        };
        let bar = match drawn {
            true => BARS.add(bar),
            false => {
                bar.set_draw_target(ProgressDrawTarget::hidden());
                bar
            }
        };
        let template = match total {
            Some(_) => "{msg:<24} [{bar:32}] {percent:>3} %  {left}",
            None => "{msg:<24} {spinner} {elapsed}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.with_key("left", left).progress_chars("=> "));
        }
        bar.set_message(label.to_owned());
        if drawn {
            // a step may take long: the clock runs on meanwhile
            bar.enable_steady_tick(TICK);
        }
        RunningBar { bar }
    }

    pub fn advance(&self, steps: u64) {
        self.bar.inc(steps);
    }

    pub fn label(&self, label: &str) {
        self.bar.set_message(label.to_owned());
    }
}

/// Which stage of a command runs, of how many.
#[derive(Debug)]
pub(super) struct StageBar {
    bar: ProgressBar,
    names: &'static [&'static str],
}

impl StageBar {
    fn new(names: &'static [&'static str], drawn: bool) -> Self {
        let bar = ProgressBar::new(names.len() as u64);
        let bar = match drawn {
            true => BARS.insert(0, bar),
            false => {
                bar.set_draw_target(ProgressDrawTarget::hidden());
                bar
            }
        };
        if let Ok(style) = ProgressStyle::with_template("{msg:<24} [{bar:32}] {pos} of {len}") {
            bar.set_style(style.progress_chars("=> "));
        }
        StageBar { bar, names }
    }

    /// A stage begins; those before it have ended.
    pub fn begin(&self, name: &'static str) {
        if let Some(k) = self.names.iter().position(|known| *known == name) {
            self.bar.set_message(name);
            self.bar.set_position(k as u64 + 1);
        }
    }
}

impl Drop for StageBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The time that is left, where a step has been done from which to estimate it.
fn left(state: &ProgressState, out: &mut dyn std::fmt::Write) {
    if state.pos() > 0 {
        // what cannot be written is not missed
        let _ = write!(out, "{:#} left", HumanDuration(state.eta()));
    }
}

impl Drop for RunningBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_flag_ends_the_command_with_130() {
        let flag = Arc::new(AtomicBool::new(false));
        let context = Context::new(true, None, Arc::clone(&flag), &[]);
        assert!(context.check().is_ok());
        flag.store(true, Ordering::Relaxed);
        let error = context.check().unwrap_err();
        assert_eq!(error.exit().code(), 130);
    }
}
