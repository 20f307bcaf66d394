//! Logs in the form that the file's name asks for, compressed where it says so.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use super::mcap::{McapLog, plain};
#[cfg(feature = "parquet")]
use super::parquet::ParquetLog;
use super::{AtomicFile, OutputError, text};
use crate::log::Instant;

/// What a log file is, by the end of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogForm {
    kind: LogEncoding,
    packing: PackingKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LogEncoding {
    Text,
    Messages,
    #[cfg(feature = "parquet")]
    Parquet,
}

/// How a log that is written is compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PackingKind {
    None,
    Gzip,
    Zstd,
}

impl LogForm {
    /// Endings that a log to be written may have.
    #[cfg(feature = "parquet")]
    pub const ENDINGS: &str = ".csv or .mcap, and .gz or .zst after it, or in .parquet";
    /// Endings that a log to be written may have.
    #[cfg(not(feature = "parquet"))]
    pub const ENDINGS: &str = ".csv or .mcap, and .gz or .zst after it";

    /// Whether it is a recording of messages.
    pub fn is_recording(self) -> bool {
        self.kind == LogEncoding::Messages
    }

    /// By the name of the file; `None` for any other ending.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let packed = [(".gz", PackingKind::Gzip), (".zst", PackingKind::Zstd)];
        let mut packed = packed.into_iter();
        let found = packed.find_map(|(end, packing)| Some((name.strip_suffix(end)?, packing)));
        let (name, packing) = found.unwrap_or((&name, PackingKind::None));
        let kind = match Path::new(name).extension()?.to_str()? {
            "csv" => LogEncoding::Text,
            "mcap" => LogEncoding::Messages,
            #[cfg(feature = "parquet")]
            "parquet" if packing == PackingKind::None => LogEncoding::Parquet,
            _ => return None,
        };
        Some(Self { kind, packing })
    }
}

/// A file that is written, compressed as it was asked for.
pub(super) enum PackedFile {
    Plain(AtomicFile),
    Gzip(flate2::write::GzEncoder<AtomicFile>),
    Zstd(zstd::stream::write::Encoder<'static, AtomicFile>),
}

impl PackedFile {
    fn new(file: AtomicFile, packing: PackingKind) -> io::Result<Self> {
        Ok(match packing {
            PackingKind::None => Self::Plain(file),
            // No clock time and no name of the file in its header.
            PackingKind::Gzip => {
                let level = flate2::Compression::default();
                Self::Gzip(flate2::write::GzEncoder::new(file, level))
            }
            PackingKind::Zstd => {
                let mut encoder = zstd::stream::write::Encoder::new(file, 0)?;
                encoder.include_checksum(true)?;
                Self::Zstd(encoder)
            }
        })
    }

    fn writer(&mut self) -> &mut dyn Write {
        match self {
            Self::Plain(file) => file,
            Self::Gzip(encoder) => encoder,
            Self::Zstd(encoder) => encoder,
        }
    }

    fn finish(self) -> io::Result<AtomicFile> {
        match self {
            Self::Plain(file) => Ok(file),
            Self::Gzip(encoder) => encoder.finish(),
            Self::Zstd(encoder) => encoder.finish(),
        }
    }
}

impl Write for PackedFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.writer().write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer().flush()
    }
}

/// What the rows of a log are written to.
enum LogSink {
    Text(Box<io::BufWriter<PackedFile>>),
    Messages(Box<McapLog<PackedFile>>),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetLog<PackedFile>>),
}

/// Writes a log row by row: whole or not at all.
///
/// As CSV: a header line, then rows of the shortest numbers that are read back bit for bit. As MCAP:
/// see [`super::mcap`]. As Parquet: a column of doubles for each channel. The bytes depend on the rows alone.
pub struct LogWriter {
    path: std::path::PathBuf,
    sink: LogSink,
    columns: usize,
    origin: Instant,
    row: Vec<f64>,
}

impl fmt::Debug for LogWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("LogWriter");
        shown.field("path", &self.path).finish_non_exhaustive()
    }
}

impl LogWriter {
    /// Begins a log with these columns, of which the first is the time [s]. A name that ends like no
    /// log becomes CSV.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub fn create(path: &Path, columns: &[impl AsRef<str>]) -> Result<Self, OutputError> {
        Self::with_notes(path, columns, &[])
    }

    /// The same with lines that a reader should know: comments over the header, or metadata of a recording.
    ///
    /// # Errors
    /// A place that cannot be written.
    pub fn with_notes(
        path: &Path,
        columns: &[impl AsRef<str>],
        notes: &[String],
    ) -> Result<Self, OutputError> {
        let columns: Vec<String> = columns.iter().map(|c| c.as_ref().to_owned()).collect();
        let form = LogForm::of(path).unwrap_or(LogForm {
            kind: LogEncoding::Text,
            packing: PackingKind::None,
        });
        let file = AtomicFile::create(path)?;
        let begun = PackedFile::new(file, form.packing).and_then(|packed| {
            Ok(match form.kind {
                LogEncoding::Text => {
                    let mut buffered = io::BufWriter::with_capacity(1 << 16, packed);
                    text::begin(&mut buffered, &columns, notes)?;
                    LogSink::Text(Box::new(buffered))
                }
                LogEncoding::Messages => {
                    let recording = McapLog::new(packed, &columns, notes).map_err(plain)?;
                    LogSink::Messages(Box::new(recording))
                }
                #[cfg(feature = "parquet")]
                LogEncoding::Parquet => {
                    LogSink::Parquet(Box::new(ParquetLog::new(packed, &columns, notes)))
                }
            })
        });
        Ok(Self {
            sink: begun.map_err(|error| OutputError::new(path, error))?,
            path: path.to_owned(),
            columns: columns.len(),
            origin: Instant::default(),
            row: Vec::with_capacity(columns.len()),
        })
    }

    /// Says from which instant the times of all rows are counted, where that is not zero.
    pub fn set_origin(&mut self, origin: Instant) {
        self.origin = origin;
    }

    /// Appends a row: as many numbers as there are columns. NaN stands for no number.
    ///
    /// # Errors
    /// A full disk, or another number of values than columns.
    pub fn row(&mut self, values: impl IntoIterator<Item = f64>) -> Result<(), OutputError> {
        self.row.clear();
        self.row.extend(values);
        let count = self.row.len();
        let written = if count != self.columns {
            let problem = format!("a row of {count} numbers under {} names", self.columns);
            Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
        } else {
            match &mut self.sink {
                LogSink::Text(text) => text::row(text, self.origin, &self.row),
                LogSink::Messages(recording) => {
                    let written = recording.row(self.origin, &self.row);
                    written.map_err(plain)
                }
                #[cfg(feature = "parquet")]
                LogSink::Parquet(file) => file.row(self.origin, &self.row),
            }
        };
        written.map_err(|error| OutputError::new(&self.path, error))
    }

    /// Gives the log its name.
    ///
    /// # Errors
    /// A full disk, a lost connection; then there is no file.
    pub fn commit(self) -> Result<(), OutputError> {
        self.finish()?.commit()
    }

    /// The file with all rows in it, which lacks its name.
    pub(super) fn finish(self) -> Result<AtomicFile, OutputError> {
        let packed = match self.sink {
            LogSink::Text(text) => text.into_inner().map_err(io::IntoInnerError::into_error),
            LogSink::Messages(recording) => recording.finish().map_err(plain),
            #[cfg(feature = "parquet")]
            LogSink::Parquet(file) => file.finish(),
        };
        let file = packed.and_then(PackedFile::finish);
        file.map_err(|error| OutputError::new(&self.path, error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_says_the_form_and_anything_else_is_none() {
        let of = |name: &str| LogForm::of(Path::new(name));
        let form = |kind, packing| Some(LogForm { kind, packing });
        assert_eq!(of("a/b.csv"), form(LogEncoding::Text, PackingKind::None));
        assert_eq!(of("a.CSV.gz"), form(LogEncoding::Text, PackingKind::Gzip));
        assert_eq!(of("a.mcap"), form(LogEncoding::Messages, PackingKind::None));
        assert_eq!(
            of("a.mcap.zst"),
            form(LogEncoding::Messages, PackingKind::Zstd)
        );
        for name in ["a.txt", "a.parquet.gz", "a.gz", "csv", "a.db3", ""] {
            assert_eq!(of(name), None, "{name}");
        }
    }

    #[test]
    fn a_row_of_the_wrong_width_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.csv", "a.mcap"] {
            let mut log = LogWriter::create(&folder.path().join(name), &["t", "q_q1"]).unwrap();
            log.row([0.0, 1.0]).unwrap();
            let error = log.row([0.1]).unwrap_err().to_string();
            assert!(error.contains("1 numbers under 2 names"), "{error}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn times_far_from_zero_keep_their_nanoseconds() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let mut log = LogWriter::create(&path, &["t", "q_q1"]).unwrap();
        log.set_origin(Instant::from_ns(1_714_566_896_123_456_789_i64));
        log.row([0.0, 1.0]).unwrap();
        log.row([0.001, f64::NAN]).unwrap();
        log.commit().unwrap();
        let expected = "t,q_q1\n1714566896.123456789,1.0\n1714566896.124456789,\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
    }
}
