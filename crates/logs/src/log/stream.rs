//! Bytes that are counted and hashed as they are read: a file has a checksum without being read again, and of what
//! arrives on standard input the end of the last line is known.

use std::io::{self, Read};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::source::SourceChecksum;

/// A value behind a lock, whatever became of who held it before.
fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A reader; its copies go on where another one has come to.
#[derive(Clone)]
pub(super) struct HashedReader(Arc<Mutex<StreamState>>);

/// The bytes of a stream, with their checksum.
struct StreamState {
    from: Box<dyn Read + Send>,
    checksum: SourceChecksum,
    bytes: u64,
    last: Option<u8>,
    ended: bool,
}

impl HashedReader {
    pub(super) fn new(from: impl Read + Send + 'static) -> Self {
        Self(Arc::new(Mutex::new(StreamState {
            from: Box::new(from),
            checksum: SourceChecksum::default(),
            bytes: 0,
            last: None,
            ended: false,
        })))
    }

    /// Whether the input has ended at byte `at` without the end of a line.
    pub(super) fn is_cut_at(&self, at: u64) -> bool {
        let inner = lock(&self.0);
        let open = !matches!(inner.last, None | Some(b'\n' | b'\r'));
        inner.ended && open && at >= inner.bytes
    }

    /// SHA-256 of what was read so far, hexadecimal.
    pub(super) fn sha256_so_far(&self) -> String {
        lock(&self.0).checksum.clone().hexadecimal()
    }

    /// SHA-256 of all bytes, hexadecimal; what was not read yet is read.
    pub(super) fn sha256(&self) -> io::Result<String> {
        io::copy(&mut self.clone(), &mut io::sink())?;
        Ok(self.sha256_so_far())
    }
}

impl Read for HashedReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let inner = &mut *lock(&self.0);
        let count = loop {
            match inner.from.read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        inner.checksum.update(&buffer[..count]);
        inner.bytes += count as u64;
        inner.last = buffer[..count].last().copied().or(inner.last);
        inner.ended |= count == 0 && !buffer.is_empty();
        Ok(count)
    }
}
