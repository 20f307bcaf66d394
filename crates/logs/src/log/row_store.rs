//! The rows of a log, parsed once and to the end: whoever reads the log goes along them.
//!
//! They are kept in memory up to [`IN_MEMORY`] bytes, beyond that in one temporary file, of which a reader holds a
//! chunk at a time.

mod chunk;

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::SystemTime;

use self::chunk::{NUMBERS, ROW_BYTES, ROWS, RowChunk};
use super::columns::position_of;
use super::layout::Layout;
use super::open::{OpenedRows, open};
use super::open_file::OpenFile;
use super::rows::{LogRows, RowStrictness};
use super::section::TimeUnit;
use super::source;
use super::stream::HashedReader;
use super::time::RowTime;
use super::time_unit::{first_numbers, unstated};
use super::{Block, LogError};

/// Bytes of a log that are kept in memory.
const IN_MEMORY: usize = 1 << 20;

/// Length and last change of each file, by which one that was written anew is known.
type FileStates = Vec<Option<(u64, SystemTime)>>;

fn states(files: &[PathBuf]) -> FileStates {
    let state = |file: &PathBuf| {
        let about = file.metadata().ok()?;
        Some((about.len(), about.modified().ok()?))
    };
    files.iter().map(state).collect()
}

/// The rows of a log by one layout, as they stand in its files: parsed to the end, or to the error that ends it.
pub(crate) struct RowStore {
    files: Vec<PathBuf>,
    layout: Layout,
    state: FileStates,
    /// The layout that the log turned out to have.
    found: Layout,
    names: Vec<String>,
    /// Numbers of positions, torques and velocities in a row.
    widths: [usize; 3],
    /// Column of the time and seconds per unit of it, where its numbers say the unit.
    pub(super) time: Option<(usize, f64)>,
    /// That unit and the name of the column, where it is not the second.
    pub(super) recognised: Option<(TimeUnit, String)>,
    chunks: Vec<ChunkPlace>,
    spilled: Option<Arc<File>>,
    /// What ends the log, for a reader that comes to it: a span may end before.
    error: Option<LogError>,
    is_recording: bool,
    begins: Option<f64>,
    clock_remedy: Option<String>,
    warnings: Vec<String>,
    seams: Vec<RowTime>,
    sha256: OnceLock<String>,
}

/// Where a chunk of rows is kept.
enum ChunkPlace {
    Memory(Arc<RowChunk>),
    /// At this byte of the temporary file, with so many rows.
    File(u64, usize),
}

impl RowStore {
    /// Parses a log to its end, channels as logged. The unit of its times is known before the first row is kept.
    pub(crate) fn read(
        files: &[PathBuf],
        layout: &Layout,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, LogError> {
        let (layout, state) = (&layout.clone().as_logged(), states(files));
        let opened = open(files, layout, RowStrictness::Refuse)?;
        let column = unstated(&*opened.rows, &opened.layout);
        let mut writer = StoreWriter::new(opened);
        let (mut time, mut recognised) = (None, None);
        if let Some(column) = column {
            let no_room = |error| no_room(files, error);
            let times = writer.first_times(column).map_err(no_room)?;
            let times = match times {
                Some(times) => Some(times),
                None => first_numbers(files, &writer.found, column)?,
            };
            if let Some(times) = times {
                let unit = TimeUnit::of_numbers(&times);
                let seconds = unit.in_seconds().1;
                time = Some((column, seconds));
                if seconds != 1.0 || writer.time_column != Some(column) {
                    if writer.begun() {
                        writer = StoreWriter::new(open(files, layout, RowStrictness::Refuse)?);
                    }
                    writer.source.set_time(column, seconds);
                }
                recognised = (unit != TimeUnit::Second)
                    .then(|| (unit, super::escape(&writer.source.names()[column])));
            }
        }
        while !writer.ended {
            if stop() {
                return Err(LogError::Interrupted);
            }
            writer.keep_more().map_err(|error| no_room(files, error))?;
        }
        let StoreWriter { source, bytes, .. } = writer;
        let sha256 = bytes.and_then(|bytes| bytes.sha256().ok());
        Ok(Self {
            files: files.to_vec(),
            layout: layout.clone(),
            state,
            found: writer.found,
            names: source.names().to_vec(),
            widths: writer.widths,
            time,
            recognised,
            chunks: writer.chunks,
            spilled: writer.spilled,
            error: writer.error,
            is_recording: source.is_recording(),
            begins: writer.begins,
            clock_remedy: source.clock_remedy(),
            warnings: source.warnings(),
            seams: source.seams(),
            sha256: sha256.map_or_else(OnceLock::new, OnceLock::from),
        })
    }

    /// The layout that the log turned out to have.
    pub(crate) fn found(&self) -> &Layout {
        &self.found
    }

    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    pub(crate) fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Whether these are the rows of these files by this layout.
    pub(crate) fn holds(&self, files: &[PathBuf], layout: &Layout) -> bool {
        self.files == files
            && self.layout == layout.clone().as_logged()
            && self.state == states(files)
    }

    /// The chunk of this number; `None` behind the last one.
    fn chunk(&self, index: usize) -> Result<Option<Arc<RowChunk>>, LogError> {
        match (self.chunks.get(index), &self.error) {
            (Some(ChunkPlace::Memory(chunk)), _) => Ok(Some(Arc::clone(chunk))),
            (Some(ChunkPlace::File(at, rows)), _) => {
                let read = self.restored(*at, *rows);
                Ok(Some(Arc::new(
                    read.map_err(|error| no_room(&self.files, error))?,
                )))
            }
            (None, Some(error)) => Err(error.clone()),
            (None, None) => Ok(None),
        }
    }

    fn restored(&self, at: u64, rows: usize) -> io::Result<RowChunk> {
        let Some(file) = &self.spilled else {
            return Err(io::ErrorKind::NotFound.into());
        };
        let width = self.widths.iter().sum();
        let mut bytes = vec![0; rows * (ROW_BYTES + 8 * width)];
        OpenFile::at(Arc::clone(file), at).read_exact(&mut bytes)?;
        Ok(RowChunk::of(&bytes, width))
    }

    /// The rows anew from the files, the first `rows` of them passed: for the text of a cell, which is not kept.
    fn fresh_at(&self, rows: usize) -> Result<Box<dyn LogRows>, LogError> {
        let OpenedRows { rows: mut anew, .. } =
            open(&self.files, &self.layout, RowStrictness::Refuse)?;
        if let Some((column, seconds)) = self.time {
            anew.set_time(column, seconds);
        }
        for _ in 0..rows {
            anew.next()?;
        }
        Ok(anew)
    }

    fn checksum(&self) -> Option<&str> {
        if self.sha256.get().is_none() {
            let _ = self.sha256.set(source::sha256_of(&self.files).ok()?);
        }
        self.sha256.get().map(String::as_str)
    }
}

fn no_room(files: &[PathBuf], error: io::Error) -> LogError {
    LogError::Read {
        file: source::shown_all(files),
        remedy: "its rows are kept in a temporary file: free some room on the disk, or name a folder with room in TMPDIR".to_owned(),
        source: Arc::new(error),
    }
}

/// A log that is being parsed.
struct StoreWriter {
    source: Box<dyn LogRows>,
    found: Layout,
    bytes: Option<HashedReader>,
    widths: [usize; 3],
    /// The column of times, where its numbers are taken as seconds.
    time_column: Option<usize>,
    chunks: Vec<ChunkPlace>,
    /// Bytes of the chunks that are in memory, and of those in the temporary file.
    size: usize,
    written: u64,
    spilled: Option<Arc<File>>,
    begins: Option<f64>,
    ended: bool,
    error: Option<LogError>,
}

impl StoreWriter {
    fn new(opened: OpenedRows) -> Self {
        let (source, found) = (opened.rows, opened.layout);
        let plain = found.time.factor == 1.0 && found.section.rate_hz.is_none();
        let time = || position_of(source.names(), &found.time);
        let dq = usize::from(source.has_velocities()) * found.velocities.len();
        Self {
            widths: [found.positions.len(), found.torques.len(), dq],
            time_column: plain.then(time).flatten(),
            source,
            found,
            bytes: opened.bytes,
            chunks: Vec::new(),
            size: 0,
            written: 0,
            spilled: None,
            begins: None,
            ended: false,
            error: None,
        }
    }

    fn begun(&self) -> bool {
        self.ended || !self.chunks.is_empty()
    }

    /// The first numbers of the column of times, where all of them were read as plain seconds.
    fn first_times(&mut self, column: usize) -> io::Result<Option<Vec<f64>>> {
        if self.time_column != Some(column) {
            return Ok(None);
        }
        self.keep_more()?;
        let Some(ChunkPlace::Memory(chunk)) = self.chunks.first() else {
            return Ok(None);
        };
        let number = |stamp: &RowTime| match stamp {
            RowTime::Seconds(t) if !t.is_nan() => Some(*t),
            _ => None,
        };
        let whole = chunk.stamps.len() >= ROWS || self.error.is_none();
        let times = chunk.stamps.iter().map(number).collect();
        Ok(whole.then_some(times).flatten())
    }

    /// Parses and keeps the next chunk, or finds the end.
    fn keep_more(&mut self) -> io::Result<()> {
        let chunk = self.produce();
        if chunk.stamps.is_empty() {
            return Ok(());
        }
        let bytes = chunk.bytes();
        if self.spilled.is_none() && !self.chunks.is_empty() && self.size + bytes > IN_MEMORY {
            self.spilled = tempfile::tempfile().ok().map(Arc::new);
        }
        // where there is no folder for temporary files, memory has to do
        let Some(file) = &self.spilled else {
            self.size += bytes;
            self.chunks.push(ChunkPlace::Memory(Arc::new(chunk)));
            return Ok(());
        };
        let written = chunk.written();
        (&**file).write_all(&written)?;
        (self.chunks).push(ChunkPlace::File(self.written, chunk.stamps.len()));
        self.written += written.len() as u64;
        Ok(())
    }

    fn produce(&mut self) -> RowChunk {
        let width: usize = self.widths.iter().sum();
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
                    (self.ended, self.error) = (true, Some(error));
                    break;
                }
            }
            if self.chunks.is_empty() && chunk.stamps.len() == 1 {
                self.begins = self.source.begins();
            }
            row.clear();
            let read = self.source.append(&mut row).is_ok();
            let parts = [&row.q, &row.tau, &row.dq];
            let whole = read && (parts.iter().zip(self.widths)).all(|(part, n)| part.len() == n);
            match whole {
                true => parts.iter().for_each(|part| chunk.values.extend(*part)),
                false => chunk.values.resize(chunk.values.len() + width, f64::NAN),
            }
            chunk.numbers.push(self.source.number());
            chunk.flags.push((self.source.repeats(), !whole));
        }
        chunk
    }
}

impl std::fmt::Debug for RowStore {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("RowStore")
    }
}

/// One way along the rows of a store.
pub(super) struct StoredRows {
    store: Arc<RowStore>,
    chunk: Arc<RowChunk>,
    /// Number of the next chunk, rows of this one that were begun, rows before it.
    next: usize,
    begun: usize,
    before: usize,
}

impl StoredRows {
    pub(super) fn new(store: Arc<RowStore>) -> Self {
        Self {
            store,
            chunk: Arc::default(),
            next: 0,
            begun: 0,
            before: 0,
        }
    }

    /// The current row in the files: for messages.
    fn anew(&self) -> Result<Box<dyn LogRows>, LogError> {
        self.store.fresh_at(self.before + self.begun)
    }
}

impl LogRows for StoredRows {
    fn names(&self) -> &[String] {
        &self.store.names
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        if self.begun == self.chunk.stamps.len() {
            let Some(chunk) = self.store.chunk(self.next)? else {
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
        let [q, tau, dq] = self.store.widths;
        let values = &self.chunk.values[row * (q + tau + dq)..(row + 1) * (q + tau + dq)];
        block.q.extend_from_slice(&values[..q]);
        block.tau.extend_from_slice(&values[q..q + tau]);
        block.dq.extend_from_slice(&values[q + tau..]);
        Ok(())
    }

    fn has_velocities(&self) -> bool {
        self.store.widths[2] > 0
    }

    fn is_recording(&self) -> bool {
        self.store.is_recording
    }

    fn repeats(&self) -> bool {
        self.chunk.flags[self.begun - 1].0
    }

    fn number(&self) -> u64 {
        self.chunk.numbers[self.begun - 1]
    }

    fn place(&self) -> String {
        let anew = self.anew();
        anew.map_or_else(
            |_| source::shown_all(&self.store.files),
            |rows| rows.place(),
        )
    }

    fn clock_remedy(&self) -> Option<String> {
        self.store.clock_remedy.clone()
    }

    fn warnings(&self) -> Vec<String> {
        self.store.warnings.clone()
    }

    fn seams(&self) -> Vec<RowTime> {
        self.store.seams.clone()
    }

    fn begins(&self) -> Option<f64> {
        self.store.begins
    }

    fn sha256(&self) -> Option<&str> {
        self.store.checksum()
    }
}
