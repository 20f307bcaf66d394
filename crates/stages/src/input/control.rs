//! How a long stage reports what it does, and is asked to stop.

use std::fmt;
use std::sync::Arc;

use super::error::IdentifyError;
use cft_ident_logs::recording::StopCheck;

/// What a stage says while it works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress<'a> {
    /// Work begins, of so many steps where that is known.
    Begin(&'a str, Option<u64>),
    /// So many more of its steps are done.
    Advance(u64),
    /// What of it is being done now.
    Doing(&'a str),
    /// The work that began last ends.
    End,
    /// A remark for the person who waits.
    Note(&'a str),
}

/// Is told of the progress of work.
type ProgressListener = dyn Fn(Progress) + Send + Sync;

/// Cancellation and progress as callbacks, called from any thread; by default nothing stops a stage
/// and nobody is informed.
#[derive(Clone, Default)]
pub struct Control {
    stop: Option<Arc<StopCheck>>,
    listener: Option<Arc<ProgressListener>>,
}

impl Control {
    /// The same, stopped where `stop` says so; it is asked between blocks of a log.
    pub fn stopped_by(mut self, stop: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        self.stop = Some(Arc::new(stop));
        self
    }

    /// The same, with its progress reported to `listener`.
    pub fn reporting_to(mut self, listener: impl Fn(Progress) + Send + Sync + 'static) -> Self {
        self.listener = Some(Arc::new(listener));
        self
    }

    /// What says whether the stage is to end.
    pub(crate) fn stop_check(&self) -> Option<Arc<StopCheck>> {
        self.stop.clone()
    }

    /// Whether the stage is to end.
    pub fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop())
    }

    /// [`Control::stopped`] as an error.
    pub fn check(&self) -> Result<(), IdentifyError> {
        match self.stopped() {
            true => Err(IdentifyError::Interrupted),
            false => Ok(()),
        }
    }

    /// The same with nobody informed: work within other work.
    pub(crate) fn quiet(&self) -> Self {
        Control {
            stop: self.stop.clone(),
            listener: None,
        }
    }

    /// Begins work; it ends when the guard is dropped.
    pub(crate) fn begin(&self, work: &str, steps: Option<u64>) -> ControlledWork {
        self.report(Progress::Begin(work, steps));
        ControlledWork {
            control: self.clone(),
        }
    }
    pub(crate) fn note(&self, text: &str) {
        self.report(Progress::Note(text));
    }

    pub(crate) fn report(&self, progress: Progress) {
        if let Some(listener) = &self.listener {
            listener(progress);
        }
    }
}

impl fmt::Debug for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Control")
    }
}

/// Work that is under way.
pub(crate) struct ControlledWork {
    control: Control,
}

impl ControlledWork {
    pub(crate) fn advance(&self, steps: u64) {
        self.control.report(Progress::Advance(steps));
    }

    pub(crate) fn doing(&self, what: &str) {
        self.control.report(Progress::Doing(what));
    }
}

impl Drop for ControlledWork {
    fn drop(&mut self) {
        self.control.report(Progress::End);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn work_is_reported_from_its_begin_to_its_end() {
        let said = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&said);
        let control =
            Control::default().reporting_to(move |p| heard.lock().unwrap().push(format!("{p:?}")));
        let work = control.begin("reading", Some(2));
        work.advance(2);
        drop(work);
        let expected = ["Begin(\"reading\", Some(2))", "Advance(2)", "End"];
        assert_eq!(*said.lock().unwrap(), expected);
    }

    #[test]
    fn a_stage_that_is_stopped_ends_with_interrupted() {
        assert!(Control::default().check().is_ok());
        let control = Control::default().stopped_by(|| true);
        assert!(matches!(control.check(), Err(IdentifyError::Interrupted)));
    }
}
