//! Text logs: header, then rows one by one.

use std::fs::File;
use std::io::{self, Chain, Cursor, Read};
use std::path::{Path, PathBuf};

use csv::ByteRecord;

use super::head::{self, HEAD};
use super::layout::Delimiter;
use super::{LogError, escape, number, source};

/// Bytes that one row may take.
const LONGEST_ROW: usize = 1 << 20;
/// Bytes read at once.
const BUFFER: usize = 1 << 17;

/// Ends the reading of a row that never ends, before it fills the memory.
#[derive(Debug)]
struct Guard {
    inner: Chain<Cursor<Vec<u8>>, File>,
    /// Bytes handed out since the last row was complete.
    pending: usize,
}

impl Read for Guard {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.pending > LONGEST_ROW + BUFFER {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        loop {
            match self.inner.read(buffer) {
                Ok(count) => {
                    self.pending += count;
                    return Ok(count);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

/// The rows of a text log.
#[derive(Debug)]
pub(super) struct Rows {
    path: PathBuf,
    reader: csv::Reader<Guard>,
    record: ByteRecord,
    previous: ByteRecord,
    header: Vec<String>,
    header_line: u64,
    /// Columns are parted by runs of spaces: where the fields that are not empty stand.
    runs: Option<Vec<usize>>,
    decimal_comma: bool,
}

impl Rows {
    /// Opens a text log and reads its header.
    pub(super) fn open(path: &Path, delimiter: Delimiter) -> Result<Self, LogError> {
        let mut file = source::open(path)?;
        let mut begin = Vec::with_capacity(HEAD);
        Read::by_ref(&mut file)
            .take(HEAD as u64)
            .read_to_end(&mut begin)
            .map_err(|error| source::failed(path, error))?;
        head::refuse_other_formats(path, &begin)?;
        let found = head::look_at(path, &begin, delimiter)?;
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(found.comment))
            .delimiter(found.delimiter)
            .buffer_capacity(BUFFER)
            .from_reader(Guard {
                inner: Cursor::new(begin).chain(file),
                pending: 0,
            });
        let mut rows = Self {
            path: path.to_owned(),
            reader,
            record: ByteRecord::new(),
            previous: ByteRecord::new(),
            header: Vec::new(),
            header_line: found.header_line,
            runs: found.spaces.then(Vec::new),
            decimal_comma: found.delimiter != b',',
        };
        match found.header_in_comment {
            Some((names, _)) => {
                let parts = head::split(&names, found.delimiter, found.spaces);
                rows.header = parts.into_iter().map(str::to_owned).collect();
            }
            None => {
                while rows.advance()? && rows.is_blank() {}
                let count = rows.fields();
                let names = (0..count).map(|index| {
                    let name = String::from_utf8_lossy(rows.field(index).unwrap_or_default());
                    name.trim().to_owned()
                });
                rows.header = names.collect();
                // A delimiter at the end of the line names no column.
                if rows.header.last().is_some_and(String::is_empty) {
                    rows.header.pop();
                }
            }
        }
        Ok(rows)
    }

    /// Column names, trimmed.
    pub(super) fn header(&self) -> &[String] {
        &self.header
    }

    /// Line of the header.
    pub(super) fn header_line(&self) -> u64 {
        self.header_line
    }

    /// Goes on to the next row; false at the end of the file.
    pub(super) fn next(&mut self) -> Result<bool, LogError> {
        loop {
            std::mem::swap(&mut self.record, &mut self.previous);
            if !self.advance()? {
                return Ok(false);
            }
            if self.fields() == self.header.len() || self.width_is_right()? {
                return Ok(true);
            }
        }
    }

    /// Reads one record.
    fn advance(&mut self) -> Result<bool, LogError> {
        self.reader.get_mut().pending = 0;
        let more = match self.reader.read_byte_record(&mut self.record) {
            Ok(more) => more,
            Err(error) => return Err(self.failed(error)),
        };
        if let Some(runs) = &mut self.runs {
            runs.clear();
            let full = self.record.iter().enumerate();
            runs.extend(
                full.filter(|(_, field)| !field.is_empty())
                    .map(|(index, _)| index),
            );
        }
        Ok(more)
    }

    fn failed(&self, error: csv::Error) -> LogError {
        let line = self.reader.position().line();
        match error.into_kind() {
            csv::ErrorKind::Io(error) if error.kind() == io::ErrorKind::FileTooLarge => {
                LogError::LongLine {
                    file: self.file(),
                    line,
                    limit: LONGEST_ROW,
                }
            }
            csv::ErrorKind::Io(error) => source::failed(&self.path, error),
            // Byte records of any length have no other error; should one appear, it is a read error.
            other => source::failed(&self.path, io::Error::other(format!("{other:?}"))),
        }
    }

    /// Whether a row that has another width than the header is one; false for a line of blanks.
    #[cold]
    fn width_is_right(&self) -> Result<bool, LogError> {
        if self.is_blank() {
            return Ok(false);
        }
        let (found, expected) = (self.fields(), self.header.len());
        if found > expected && (expected..found).all(|index| self.is_blank_field(index)) {
            return Ok(true);
        }
        Err(LogError::Fields {
            file: self.file(),
            line: self.line(),
            found,
            expected,
            remedy: if found > expected {
                "name every column, and write decimal points, not commas"
            } else {
                "the line is cut off or a field is missing: complete or delete it"
            },
        })
    }

    fn is_blank(&self) -> bool {
        (0..self.fields()).all(|index| self.is_blank_field(index))
    }

    fn is_blank_field(&self, index: usize) -> bool {
        self.field(index)
            .is_some_and(|field| field.trim_ascii().is_empty())
    }

    #[inline]
    fn fields(&self) -> usize {
        match &self.runs {
            None => self.record.len(),
            Some(runs) => runs.len(),
        }
    }

    #[inline]
    fn field(&self, column: usize) -> Option<&[u8]> {
        match &self.runs {
            None => self.record.get(column),
            Some(runs) => self.record.get(*runs.get(column)?),
        }
    }

    /// `factor` x the number in a column of the current row + `offset`, finite.
    #[inline]
    pub(super) fn scaled(&self, column: usize, factor: f64, offset: f64) -> Result<f64, LogError> {
        match self.field(column).and_then(number::parse) {
            Some(value) if (value * factor + offset).is_finite() => Ok(value * factor + offset),
            _ => Err(self.no_number(column)),
        }
    }

    #[cold]
    fn no_number(&self, column: usize) -> LogError {
        let field = self.field(column).unwrap_or_default();
        let text = String::from_utf8_lossy(field);
        let text = text.trim();
        let name = self.header.get(column).map(|name| escape(name));
        let (file, line) = (self.file(), self.line());
        let column = name.unwrap_or_default();
        if number::parse(field).is_some() {
            return LogError::NotFinite {
                file,
                line,
                column,
                text: escape(text),
            };
        }
        let with_point = text.replace(',', ".");
        let remedy = if text.is_empty() {
            "delete the rows without a measurement: a gap in time is handled"
        } else if self.decimal_comma && number::parse(with_point.as_bytes()).is_some() {
            "write decimal points instead of decimal commas, e.g. `sed 's/,/./g'`"
        } else if text.contains(':') {
            "write the time as seconds from the start"
        } else {
            "correct the field or delete the row"
        };
        LogError::NotANumber {
            file,
            line,
            column,
            text: escape(text),
            remedy,
        }
    }

    /// Whether the current row equals the one before it, byte for byte.
    pub(super) fn repeats(&self) -> bool {
        self.record == self.previous
    }

    /// The file for a message.
    pub(super) fn file(&self) -> String {
        source::shown(&self.path)
    }

    /// Line on which the current row ends.
    ///
    /// Counted again from the file's beginning: it is asked for once, on the way to an error, and
    /// costs nothing before.
    #[cold]
    pub(super) fn line(&self) -> u64 {
        let end = self.reader.position().byte().saturating_sub(1);
        count_lines(&self.path, end).unwrap_or_else(|_| self.reader.position().line())
    }

    /// Line of the current row where no comment or blank line stands right before it.
    pub(super) fn line_hint(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }
}

/// 1 + the line ends among the first `end` bytes; `\r\n` and a lone `\r` count as one each.
fn count_lines(path: &Path, end: u64) -> io::Result<u64> {
    let mut file = File::open(path)?.take(end);
    let mut buffer = vec![0; HEAD];
    let (mut lines, mut after_return) = (1, false);
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            return Ok(lines);
        }
        for byte in &buffer[..count] {
            lines += u64::from(*byte == b'\r' || (*byte == b'\n' && !after_return));
            after_return = *byte == b'\r';
        }
    }
}
