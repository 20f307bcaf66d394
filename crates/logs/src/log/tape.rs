//! The rows of a log as they were read once: whoever reads the log again goes along them.
//!
//! Rows are taken from the file when the first reader asks for them, and kept: in memory up to
//! [`IN_MEMORY`], beyond that in one temporary file, of which a reader holds a chunk at a time.

mod chunk;

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, Weak};
use std::time::SystemTime;

use self::chunk::{NUMBERS, ROW_BYTES, ROWS, RowChunk};
use super::columns::position_of;
use super::held_files::{HeldFiles, lock};
use super::layout::Layout;
use super::open::{OpenedRows, open};
use super::rows::{LogRows, RowStrictness};
use super::source;
use super::stream::HashedReader;
use super::time::RowTime;
use super::{Block, LogError};

/// Bytes of a log that are kept in memory.
const IN_MEMORY: usize = 1 << 20;

/// What is kept of a log while somebody holds its [`super::LogSpec`].
pub(super) struct KeptTapes {
    path: PathBuf,
    /// Held, so that its files stay open.
    _files: Arc<HeldFiles>,
    tapes: Mutex<Vec<(Layout, Arc<RowTape>)>>,
}

impl fmt::Debug for KeptTapes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Kept")
    }
}

/// What is kept of logs that somebody holds now.
static HELD: Mutex<Vec<Weak<KeptTapes>>> = Mutex::new(Vec::new());

impl KeptTapes {
    /// What is kept of the log of this path: all who hold it share its rows, whatever their spans.
    pub(super) fn of(path: &Path) -> Arc<Self> {
        let mut held = lock(&HELD);
        held.retain(|kept| kept.strong_count() > 0);
        let mut alive = held.iter().filter_map(Weak::upgrade);
        if let Some(kept) = alive.find(|kept| kept.path == path) {
            return kept;
        }
        let kept = Arc::new(Self {
            path: path.to_owned(),
            _files: HeldFiles::of(path),
            tapes: Mutex::default(),
        });
        held.push(Arc::downgrade(&kept));
        kept
    }

    /// The tape of these files by this layout, its conversion aside; what the log turned out to be.
    pub(super) fn tape(
        &self,
        files: &[PathBuf],
        layout: &Layout,
    ) -> Result<Arc<RowTape>, LogError> {
        let layout = layout.clone().as_logged();
        let state = states(files);
        let mut tapes = lock(&self.tapes);
        tapes.retain(|(_, tape)| tape.state == state);
        if let Some((_, tape)) = tapes.iter().find(|(of, _)| *of == layout) {
            return Ok(Arc::clone(tape));
        }
        let tape = Arc::new(RowTape::open(files, &layout, state)?);
        tapes.push((layout, Arc::clone(&tape)));
        Ok(tape)
    }
}

/// Length and last change of each file: a file that was written anew is read anew.
type FileStates = Vec<Option<(u64, SystemTime)>>;

fn states(files: &[PathBuf]) -> FileStates {
    let state = |file: &PathBuf| {
        let about = file.metadata().ok()?;
        Some((about.len(), about.modified().ok()?))
    };
    files.iter().map(state).collect()
}

/// Rows that are kept, whose source hands out more.
pub(super) struct RowTape {
    files: Vec<PathBuf>,
    layout: Layout,
    state: FileStates,
    /// The layout that the log turned out to have.
    pub(super) found: Layout,
    names: Vec<String>,
    /// Numbers of positions, torques and velocities in a row.
    widths: [usize; 3],
    /// The column of times, where its numbers are taken as seconds.
    time_column: Option<usize>,
    inner: Mutex<TapeState>,
    /// The first times, as they were read before their unit was known.
    first: OnceLock<Option<Vec<f64>>>,
    sha256: OnceLock<String>,
}

struct TapeState {
    source: Box<dyn LogRows>,
    bytes: Option<HashedReader>,
    time: Option<(usize, f64)>,
    chunks: Vec<ChunkPlace>,
    /// Bytes of the chunks that are in memory.
    size: usize,
    spilled: Option<File>,
    ended: bool,
    /// An error ended the log; the error itself until it is handed out.
    failed: bool,
    error: Option<LogError>,
}

/// Where a chunk of rows is kept.
enum ChunkPlace {
    Memory(Arc<RowChunk>),
    /// At this byte of the temporary file, with so many rows.
    File(u64, usize),
}

impl RowTape {
    fn open(files: &[PathBuf], layout: &Layout, state: FileStates) -> Result<Self, LogError> {
        let OpenedRows {
            rows,
            layout: found,
            bytes,
            ..
        } = open(files, layout, RowStrictness::Refuse)?;
        let plain = found.time.factor == 1.0 && found.section.rate_hz.is_none();
        let time = || position_of(rows.names(), &found.time);
        let dq = usize::from(rows.has_velocities()) * found.velocities.len();
        Ok(Self {
            files: files.to_vec(),
            layout: layout.clone(),
            state,
            names: rows.names().to_vec(),
            widths: [found.positions.len(), found.torques.len(), dq],
            time_column: plain.then(time).flatten(),
            found,
            first: OnceLock::new(),
            sha256: OnceLock::new(),
            inner: Mutex::new(TapeState::new(rows, bytes)),
        })
    }

    /// The chunk of this number; `None` behind the last one.
    fn chunk(&self, index: usize) -> Result<Option<Arc<RowChunk>>, LogError> {
        let mut inner = lock(&self.inner);
        while index >= inner.chunks.len() && !inner.ended {
            let chunk = inner.produce(self.widths);
            inner.keep(chunk).map_err(|error| self.no_room(error))?;
        }
        match inner.chunks.get(index) {
            Some(ChunkPlace::Memory(chunk)) => Ok(Some(Arc::clone(chunk))),
            Some(ChunkPlace::File(at, rows)) => {
                let (at, rows) = (*at, *rows);
                let width = self.widths.iter().sum();
                let read = inner.restored(at, rows, width);
                Ok(Some(Arc::new(read.map_err(|error| self.no_room(error))?)))
            }
            None if inner.failed => match inner.error.take() {
                Some(error) => Err(error),
                None => {
                    let rows = inner.rows();
                    drop(inner);
                    self.fresh_at(rows + 1).map(|_| None)
                }
            },
            None => Ok(None),
        }
    }

    /// Goes to the end of the log, or to what ends it.
    fn to_the_end(&self) -> MutexGuard<'_, TapeState> {
        loop {
            let mut inner = lock(&self.inner);
            if inner.ended {
                return inner;
            }
            let chunk = inner.produce(self.widths);
            if inner.keep(chunk).is_err() {
                return inner;
            }
        }
    }

    /// The rows anew from the files, the first `rows` of them passed: for what a tape does not keep.
    fn fresh_at(&self, rows: usize) -> Result<Box<dyn LogRows>, LogError> {
        let OpenedRows { rows: mut anew, .. } =
            open(&self.files, &self.layout, RowStrictness::Refuse)?;
        if let Some((column, seconds)) = lock(&self.inner).time {
            anew.set_time(column, seconds);
        }
        for _ in 0..rows {
            anew.next()?;
        }
        Ok(anew)
    }

    fn no_room(&self, error: io::Error) -> LogError {
        LogError::Read {
            file: source::shown_all(&self.files),
            remedy: "its rows are kept in a temporary file: free some room on the disk, or name a folder with room in TMPDIR".to_owned(),
            source: error,
        }
    }

    /// The first numbers of the column of times, where all of them were read as plain seconds.
    pub(super) fn first_times(&self, column: usize, most: usize) -> Option<Vec<f64>> {
        if self.time_column != Some(column) {
            return None;
        }
        let first = || {
            let chunk = self.chunk(0).ok()??;
            let number = |stamp: &RowTime| match stamp {
                RowTime::Seconds(t) if !t.is_nan() => Some(*t),
                _ => None,
            };
            let whole = chunk.stamps.len() >= most.min(ROWS) || !lock(&self.inner).failed;
            let times = chunk.stamps.iter().take(most).map(number).collect();
            whole.then_some(times).flatten()
        };
        self.first.get_or_init(first).clone()
    }

    /// Says how many seconds the unit of a column of times has: the first reader of a log does, before its rows.
    fn set_time(&self, column: usize, seconds: f64) {
        let mut inner = lock(&self.inner);
        let as_opened = self.time_column == Some(column) && seconds == 1.0;
        let before = inner.time.replace((column, seconds));
        if before == Some((column, seconds)) || (before.is_none() && as_opened) {
            return;
        }
        if !inner.chunks.is_empty() || inner.ended {
            match open(&self.files, &self.layout, RowStrictness::Refuse) {
                Ok(opened) => {
                    *inner = TapeState {
                        time: inner.time,
                        spilled: inner.spilled.take(),
                        ..TapeState::new(opened.rows, opened.bytes)
                    };
                }
                Err(error) => {
                    inner.chunks.clear();
                    inner.end(error);
                    return;
                }
            }
        }
        inner.source.set_time(column, seconds);
    }

    fn checksum(&self) -> Option<&str> {
        if self.sha256.get().is_none() {
            let bytes = self.to_the_end().bytes.clone();
            let sum = match bytes {
                Some(bytes) => bytes.sha256().ok(),
                None => source::sha256_of(&self.files).ok(),
            };
            let _ = self.sha256.set(sum?);
        }
        self.sha256.get().map(String::as_str)
    }
}

impl TapeState {
    fn new(source: Box<dyn LogRows>, bytes: Option<HashedReader>) -> Self {
        Self {
            source,
            bytes,
            time: None,
            chunks: Vec::new(),
            size: 0,
            spilled: None,
            ended: false,
            failed: false,
            error: None,
        }
    }

    fn end(&mut self, error: LogError) {
        (self.ended, self.failed, self.error) = (true, true, Some(error));
    }

    fn rows(&self) -> usize {
        let rows = |place: &ChunkPlace| match place {
            ChunkPlace::Memory(chunk) => chunk.stamps.len(),
            ChunkPlace::File(_, rows) => *rows,
        };
        self.chunks.iter().map(rows).sum()
    }

    fn produce(&mut self, widths: [usize; 3]) -> RowChunk {
        let width: usize = widths.iter().sum();
        let mut chunk = RowChunk::default();
        let mut row = Block::default();
        while chunk.stamps.len() < ROWS && chunk.values.len() < NUMBERS {
            match self.source.next() {
                Ok(Some(stamp)) => chunk.stamps.push(stamp),
                Ok(None) => {
                    self.ended = true;
                    break;
                }
                Err(error) => {
                    self.end(error);
                    break;
                }
            }
            row.clear();
            let read = self.source.append(&mut row).is_ok();
            let parts = [&row.q, &row.tau, &row.dq];
            let whole = read && parts.iter().zip(widths).all(|(part, n)| part.len() == n);
            match whole {
                true => parts.iter().for_each(|part| chunk.values.extend(*part)),
                false => chunk.values.resize(chunk.values.len() + width, f64::NAN),
            }
            chunk.numbers.push(self.source.number());
            chunk.flags.push((self.source.repeats(), !whole));
        }
        chunk
    }

    fn keep(&mut self, chunk: RowChunk) -> io::Result<()> {
        if chunk.stamps.is_empty() {
            return Ok(());
        }
        let bytes = chunk.bytes();
        if self.spilled.is_none() && self.size + bytes > IN_MEMORY {
            self.spilled = tempfile::tempfile().ok();
        }
        // where there is no folder for temporary files, memory has to do
        let Some(file) = &mut self.spilled else {
            self.size += bytes;
            self.chunks.push(ChunkPlace::Memory(Arc::new(chunk)));
            return Ok(());
        };
        let at = file.seek(SeekFrom::End(0))?;
        file.write_all(&chunk.written())?;
        self.chunks.push(ChunkPlace::File(at, chunk.stamps.len()));
        Ok(())
    }

    fn restored(&mut self, at: u64, rows: usize, width: usize) -> io::Result<RowChunk> {
        let Some(file) = &mut self.spilled else {
            return Err(io::ErrorKind::NotFound.into());
        };
        let mut bytes = vec![0; rows * (ROW_BYTES + 8 * width)];
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut bytes)?;
        Ok(RowChunk::of(&bytes, width))
    }
}

/// One way along a tape.
pub(super) struct TapeRows {
    tape: Arc<RowTape>,
    chunk: Arc<RowChunk>,
    /// Number of the next chunk, rows of this one that were begun, rows before it.
    next: usize,
    begun: usize,
    before: usize,
}

impl TapeRows {
    pub(super) fn new(tape: Arc<RowTape>) -> Self {
        Self {
            tape,
            chunk: Arc::default(),
            next: 0,
            begun: 0,
            before: 0,
        }
    }

    /// The current row in the files: for messages.
    fn anew(&self) -> Result<Box<dyn LogRows>, LogError> {
        self.tape.fresh_at(self.before + self.begun)
    }
}

impl LogRows for TapeRows {
    fn names(&self) -> &[String] {
        &self.tape.names
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        if self.begun == self.chunk.stamps.len() {
            let Some(chunk) = self.tape.chunk(self.next)? else {
                return Ok(None);
            };
            self.before += self.chunk.stamps.len();
            (self.chunk, self.begun) = (chunk, 0);
            self.next += 1;
        }
        self.begun += 1;
        Ok(Some(self.chunk.stamps[self.begun - 1]))
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        let row = self.begun - 1;
        if self.chunk.flags[row].1 {
            return self.anew()?.append(block);
        }
        let [q, tau, dq] = self.tape.widths;
        let values = &self.chunk.values[row * (q + tau + dq)..(row + 1) * (q + tau + dq)];
        block.q.extend_from_slice(&values[..q]);
        block.tau.extend_from_slice(&values[q..q + tau]);
        block.dq.extend_from_slice(&values[q + tau..]);
        Ok(())
    }

    fn has_velocities(&self) -> bool {
        self.tape.widths[2] > 0
    }

    fn set_time(&mut self, column: usize, seconds: f64) {
        self.tape.set_time(column, seconds);
    }

    fn is_recording(&self) -> bool {
        lock(&self.tape.inner).source.is_recording()
    }

    fn repeats(&self) -> bool {
        self.chunk.flags[self.begun - 1].0
    }

    fn number(&self) -> u64 {
        self.chunk.numbers[self.begun - 1]
    }

    fn place(&self) -> String {
        let anew = self.anew();
        anew.map_or_else(|_| source::shown_all(&self.tape.files), |rows| rows.place())
    }

    fn clock_remedy(&self, t: f64) -> Option<String> {
        lock(&self.tape.inner).source.clock_remedy(t)
    }

    fn warnings(&self) -> Vec<String> {
        self.tape.to_the_end().source.warnings()
    }

    fn begins(&self) -> Option<f64> {
        lock(&self.tape.inner).source.begins()
    }

    fn sha256(&self) -> Option<&str> {
        self.tape.checksum()
    }
}
