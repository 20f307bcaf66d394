//! Bytes that arrive while they are read, as on standard input: counted and hashed on the way, so that
//! the end of the last line is known and the input has a checksum like a file.

use std::io::{self, Read};
use std::sync::{Arc, Mutex, PoisonError};

use super::source::Checksum;

/// What has arrived so far.
#[derive(Default)]
pub(super) struct Arrived {
    checksum: Checksum,
    bytes: u64,
    last: Option<u8>,
    ended: bool,
}

/// A look at what has arrived, from beside the reader that takes it.
#[derive(Clone, Default)]
pub(super) struct Watch(Arc<Mutex<Arrived>>);

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Watch")
    }
}

impl Watch {
    fn with<T>(&self, look: impl FnOnce(&mut Arrived) -> T) -> T {
        look(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether the input has ended at byte `at` without the end of a line.
    pub(super) fn is_cut_at(&self, at: u64) -> bool {
        self.with(|arrived| {
            let open = !matches!(arrived.last, None | Some(b'\n' | b'\r'));
            arrived.ended && open && at >= arrived.bytes
        })
    }

    /// SHA-256 of what has arrived, hexadecimal.
    pub(super) fn sha256(&self) -> String {
        self.with(|arrived| arrived.checksum.clone().hexadecimal())
    }
}

/// Reads a stream and counts.
pub(super) struct Stream {
    inner: Box<dyn Read + Send>,
    watch: Watch,
}

impl Stream {
    pub(super) fn new(inner: Box<dyn Read + Send>, watch: Watch) -> Self {
        Self { inner, watch }
    }
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = loop {
            match self.inner.read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        self.watch.with(|arrived| {
            arrived.checksum.update(&buffer[..count]);
            arrived.bytes += count as u64;
            arrived.last = buffer[..count].last().copied().or(arrived.last);
            arrived.ended |= count == 0 && !buffer.is_empty();
        });
        Ok(count)
    }
}
