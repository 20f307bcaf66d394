//! Long work beside the interpreter: its lock is free meanwhile, and Ctrl-C ends the work.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use cft_ident::identify::Control;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// How often the caller's thread looks for signals.
const LOOK: Duration = Duration::from_millis(50);

/// Runs `work` on a thread of its own and waits for it.
///
/// # Errors
/// What `work` returns as one, and an interrupt.
pub fn run<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Control, Arc<AtomicBool>) -> PyResult<T> + Send,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    std::thread::scope(|scope| {
        let (sender, receiver) = channel();
        let flag = Arc::clone(&stop);
        let worker = scope.spawn(move || {
            let asked = Arc::clone(&flag);
            let control = Control::default().stopped_by(move || asked.load(Ordering::Relaxed));
            let found = work(&control, flag);
            // nobody waits any more after an interrupt
            let _ = sender.send(());
            found
        });
        let receiver = std::sync::Mutex::new(receiver);
        let signal = loop {
            let waited = py.detach(|| match receiver.lock() {
                Ok(receiver) => receiver.recv_timeout(LOOK),
                Err(_) => Err(RecvTimeoutError::Disconnected),
            });
            if !matches!(waited, Err(RecvTimeoutError::Timeout)) {
                break Ok(());
            }
            if let Err(signal) = py.check_signals() {
                stop.store(true, Ordering::Relaxed);
                break Err(signal);
            }
        };
        let found = py.detach(|| worker.join());
        signal?;
        found.unwrap_or_else(|_| {
            Err(PyRuntimeError::new_err(
                "the work ended early: a fault of cft-ident; please report it",
            ))
        })
    })
}
