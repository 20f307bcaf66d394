//! Text logs as they lie on the disk: header, then records one by one.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::listed::ListedJoints;
use super::records::{BUFFER, LONGEST_ROW, TextRecord, TextRecords};
use super::table::{TextTable, is_datum};
use super::{head, number};
use crate::log::content::FileContent;
use crate::log::layout::Layout;
use crate::log::rows::{RowStrictness, counted};
use crate::log::stream::HashedReader;
use crate::log::time::Instant;
use crate::log::{LogError, escape, source};
use cft_ident_core::number::beyond;

pub(super) struct TextFile {
    pub(super) path: PathBuf,
    reader: TextRecords,
    record: TextRecord,
    previous: TextRecord,
    /// Names of the columns, trimmed, and the line on which they stand.
    pub(super) header: Vec<String>,
    pub(super) header_line: u64,
    /// Columns are parted by runs of spaces: where the fields that are not empty stand.
    runs: Option<Vec<usize>>,
    decimal_comma: bool,
    /// Numbers have commas for points.
    commas: bool,
    /// Columns of text that list joints, and where the numbers of a row stand that lists them in another order.
    listed: Option<ListedJoints>,
    places: Option<Vec<usize>>,
    /// Columns of times that must be alike.
    clocks: Vec<usize>,
    /// The record is a row that was not handed out yet.
    ahead: bool,
    strictness: RowStrictness,
    /// Rows that were passed over because of their width.
    pub(super) malformed: u64,
    blank: u64,
    /// Bytes and lines before the table.
    before: (u64, u64),
    notes: Vec<String>,
    /// The rows are those of a table without lines.
    table: bool,
    watch: Option<HashedReader>,
}

impl TextFile {
    pub(super) fn open(
        path: &Path,
        content: FileContent,
        layout: &Layout,
        strictness: RowStrictness,
    ) -> Result<Self, LogError> {
        let begin = content.head();
        head::refuse_other_formats(path, begin)?;
        let found = head::look_at(path, begin, layout)?;
        let TextTable { parting, units, .. } = found.table;
        let watch = content.watch.clone();
        let (table, notes) = (content.table, content.notes.clone());
        let mut inner = content.into_bytes();
        let (before, _) = found.before;
        let passed = io::copy(&mut (&mut inner).take(before), &mut io::sink());
        passed.map_err(|error| source::failed(path, error))?;
        let mut rows = Self {
            path: path.to_owned(),
            reader: TextRecords::new(inner, parting.sign, found.comment),
            record: TextRecord::default(),
            previous: TextRecord::default(),
            header: Vec::new(),
            header_line: found.header_line,
            runs: parting.runs.then(Vec::new),
            decimal_comma: parting.sign != b',',
            commas: found.commas,
            listed: None,
            places: None,
            clocks: found.clocks,
            ahead: found.headerless,
            strictness,
            malformed: 0,
            blank: 0,
            before: found.before,
            notes: [notes, found.table.notes].concat(),
            table,
            watch,
        };
        if let Some(names) = found.names {
            rows.header = names;
            rows.complete(&found.first_row, &units);
            return Ok(rows);
        }
        while rows.advance()? && rows.is_blank() {}
        let names = (0..rows.fields()).map(|index| {
            if found.headerless {
                return format!("#{}", index + 1);
            }
            let name = String::from_utf8_lossy(rows.field(index).unwrap_or_default());
            name.trim().to_owned()
        });
        rows.header = names.collect();
        // A delimiter at the end of the line names no column.
        if rows.header.last().is_some_and(String::is_empty) {
            rows.header.pop();
        }
        if found.table.second_row {
            while rows.advance()? && rows.is_blank() {}
        }
        rows.complete(&found.first_row, &units);
        Ok(rows)
    }

    /// Gives columns that have no name their number, those of joints that the rows list their names, and units.
    fn complete(&mut self, first_row: &[String], units: &[String]) {
        for (index, name) in self.header.iter_mut().enumerate() {
            if name.is_empty() {
                *name = format!("#{}", index + 1);
            }
        }
        let row: Vec<&str> = first_row.iter().map(String::as_str).collect();
        if let Some((listed, header)) = ListedJoints::find(&self.header, &row) {
            let text = &self.header[listed.columns[0]];
            self.notes.push(format!(
                "columns are named after the joints that `{}`, .. list",
                escape(text)
            ));
            self.header = header;
            self.listed = Some(listed);
        }
        if self.commas {
            self.notes.push("numbers have decimal commas".to_owned());
        }
        self.add_units(units);
    }

    /// Finds the joints of the current row, where the rows list them, and sees that its times are alike.
    #[cold]
    fn place_joints(&mut self) -> Result<(), LogError> {
        self.places = None;
        if let Some(listed) = &self.listed {
            let text = |index: usize| self.field(index).map(String::from_utf8_lossy);
            let row: Vec<_> = (0..self.fields())
                .map(|index| text(index).unwrap_or_default())
                .collect();
            let row: Vec<&str> = row.iter().map(|field| &**field).collect();
            let places = listed.places(self.header.len(), &row);
            let Some(places) = places else {
                return Err(LogError::OtherNames {
                    at: self.place(),
                    names: crate::log::list(listed.names.iter().map(String::as_str)),
                });
            };
            let moved = places.iter().enumerate().any(|(at, place)| at != *place);
            self.places = moved.then_some(places);
        }
        let first = self.clocks.first().and_then(|at| self.field(*at));
        let other = self.clocks.iter().find(|at| self.field(**at) != first);
        match other {
            Some(other) => Err(LogError::Clocks {
                at: self.place(),
                column: escape(&self.header[*other]),
            }),
            None => Ok(()),
        }
    }

    /// Puts the units of a row of their own behind the names that state none.
    fn add_units(&mut self, units: &[String]) {
        for (name, unit) in self.header.iter_mut().zip(units) {
            let unit = unit.trim_matches(['"', ' ', '[', ']', '(', ')', '<', '>']);
            if !matches!(unit, "" | "-" | "1") && !name.ends_with([']', ')']) {
                *name = format!("{name} [{unit}]");
            }
        }
    }

    /// What was taken for what, and what was passed over, one sentence each.
    pub(super) fn in_words(&self) -> Vec<String> {
        let notes = (!self.notes.is_empty()).then(|| self.notes.join("; "));
        let blank = counted(self.blank, "rows without any value are passed over");
        notes.into_iter().chain(blank).collect()
    }

    /// Goes on to the next row; false at the end of the file.
    pub(super) fn next(&mut self) -> Result<bool, LogError> {
        loop {
            if std::mem::take(&mut self.ahead) {
                if self.fields() == 0 {
                    return Ok(false);
                }
            } else {
                std::mem::swap(&mut self.record, &mut self.previous);
                if !self.advance()? {
                    return Ok(false);
                }
            }
            if let Some(watch) = &self.watch
                && watch.is_cut_at(self.end())
            {
                return Err(LogError::CutLine { at: self.place() });
            }
            if (self.fields() == self.header.len() && !self.is_without_values()) || self.is_row() {
                if self.listed.is_some() || !self.clocks.is_empty() {
                    self.place_joints()?;
                }
                return Ok(true);
            }
            if self.is_blank() {
                self.blank += u64::from(self.fields() > 1);
                continue;
            }
            let (found, end) = (self.fields(), self.end());
            let narrow = found < self.header.len();
            let remark = narrow && (0..found).all(|index| self.number(index).is_none());
            if narrow && !self.goes_on()? && (remark || !self.reader.ends_a_line()) {
                self.notes.push(format!(
                    "line {}, the last one, is cut off or a remark, and is passed over",
                    self.line_at(end)
                ));
                return Ok(false);
            }
            match self.strictness {
                RowStrictness::Record => self.malformed += 1,
                RowStrictness::Refuse => return Err(self.wrong_width(found, end)),
            }
        }
    }

    /// Whether a row follows, which is the current one then and not handed out yet.
    #[cold]
    fn goes_on(&mut self) -> Result<bool, LogError> {
        let mut more = self.watch.is_some() || self.advance()?;
        while more && self.watch.is_none() && self.is_blank() {
            more = self.advance()?;
        }
        self.ahead = more && self.watch.is_none();
        Ok(more)
    }

    fn advance(&mut self) -> Result<bool, LogError> {
        let read = self.reader.read(&mut self.record);
        let more = read.map_err(|error| self.failed(error))?;
        if let Some(runs) = &mut self.runs {
            runs.clear();
            let field = |index: usize| self.record.get(index).unwrap_or_default();
            let full = |index: &usize| !field(*index).is_empty();
            runs.extend((0..self.record.len()).filter(full));
        }
        Ok(more)
    }

    fn failed(&self, error: io::Error) -> LogError {
        match error.kind() {
            io::ErrorKind::FileTooLarge => LogError::LongLine {
                at: format!("{}:{}", self.file(), self.reader.line()),
                limit: LONGEST_ROW,
            },
            _ => source::failed(&self.path, error),
        }
    }

    /// Whether a row that has another width than the header is one: more fields, all of them blank.
    #[cold]
    fn is_row(&self) -> bool {
        let (found, expected) = (self.fields(), self.header.len());
        found > expected
            && !self.is_blank()
            && (expected..found).all(|index| self.is_blank_field(index))
    }

    #[cold]
    fn wrong_width(&self, found: usize, end: u64) -> LogError {
        let expected = self.header.len();
        LogError::Fields {
            at: format!("{}:{}", self.file(), self.line_at(end)),
            found,
            expected,
            remedy: if found > expected {
                "name every column, and write decimal points, not commas"
            } else {
                "the line is cut off or a field is missing: complete or delete it"
            },
        }
    }

    /// Whether all fields are empty; looked at only where the first one is.
    #[inline]
    fn is_without_values(&self) -> bool {
        self.field(0).is_none_or(<[u8]>::is_empty) && self.is_blank()
    }

    fn is_blank(&self) -> bool {
        (0..self.fields()).all(|index| self.is_blank_field(index))
    }

    /// Whether a field of the current row is empty; false where there is none.
    pub(super) fn is_blank_field(&self, index: usize) -> bool {
        // what was not written when the power went is zeros
        let nothing = |byte: &u8| byte.is_ascii_whitespace() || *byte == 0;
        (self.field(index)).is_some_and(|field| field.iter().all(nothing))
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

    /// Whether the rows arrive while they are read.
    pub(super) fn is_stream(&self) -> bool {
        self.watch.is_some()
    }

    /// Whether nothing stands in a column of the current row.
    pub(super) fn is_empty_cell(&self, column: usize) -> bool {
        let column = match &self.places {
            None => Some(column),
            Some(places) => places.get(column).copied(),
        };
        let field = column.and_then(|column| self.field(column));
        field.is_some_and(|field| field.trim_ascii().is_empty())
    }

    /// The number in a column of the current row, NaN and infinities included.
    #[inline]
    pub(super) fn number(&self, column: usize) -> Option<f64> {
        let column = match &self.places {
            None => column,
            Some(places) => *places.get(column)?,
        };
        let field = self.field(column)?;
        number::parse(field).or_else(|| {
            let point = self.commas.then(|| with_point(field))?;
            number::parse(&point)
        })
    }

    /// Whether a field of the current row is no number because of its decimal comma.
    #[cold]
    pub(super) fn has_decimal_comma(&self, column: usize) -> bool {
        let text = String::from_utf8_lossy(self.field(column).unwrap_or_default());
        let text = text.replace(',', ".");
        self.decimal_comma && !self.commas && number::parse(text.as_bytes()).is_some()
    }

    /// Why a column of the current row holds no number that can be used.
    #[cold]
    pub(super) fn no_number(&self, column: usize) -> LogError {
        let field = self.field(column).unwrap_or_default();
        let text = String::from_utf8_lossy(field);
        let text = text.trim();
        let comma = self.has_decimal_comma(column);
        let (at, name) = (self.place(), self.header.get(column));
        let column = name.map_or_else(String::new, |name| escape(name));
        if let Some(value) = number::parse(field) {
            return LogError::NotFinite {
                at,
                column,
                text: escape(text) + beyond(value),
                remedy: "delete the rows without a measurement: a gap in time is handled, a made-up number is not",
            };
        }
        let remedy = if text.is_empty() {
            "delete the rows without a measurement: a gap in time is handled"
        } else if comma {
            "write decimal points instead of decimal commas, e.g. `sed 's/,/./g'`"
        } else if text.contains(':') {
            "write the time as seconds from the start, or with its date: 2024-05-01T12:34:56.789Z"
        } else {
            "correct the field or delete the row"
        };
        LogError::NotANumber {
            at,
            column,
            text: escape(text),
            remedy,
        }
    }

    /// The instant in a column of the current row: a date, or a number in units of 10^`power` s.
    pub(super) fn instant(&self, column: usize, power: i32) -> Option<Instant> {
        let field = self.field(column)?;
        let comma = || Instant::parse_decimal(&self.commas.then(|| with_point(field))?, power);
        Instant::parse_decimal(field, power)
            .or_else(comma)
            .or_else(|| Instant::parse_iso(field))
    }

    /// The first column in which another word stands than in the row before.
    #[cold]
    pub(super) fn other_word(&self) -> Option<&str> {
        let is_word = |field: &[u8]| {
            let text = String::from_utf8_lossy(field);
            !text.trim().is_empty() && !is_datum(text.trim())
        };
        let changes = |column: &usize| {
            let pair = [self.record.get(*column)?, self.previous.get(*column)?];
            Some(pair[0] != pair[1] && pair.into_iter().all(is_word))
        };
        // where runs of spaces part the fields, those of the row before are not known
        let mut columns = 0..self.header.len();
        let column = columns.find(|column| self.runs.is_none() && changes(column) == Some(true));
        column.map(|column| &*self.header[column])
    }

    pub(super) fn is_date(&self, column: usize) -> bool {
        self.field(column)
            .is_some_and(|field| Instant::parse_iso(field).is_some())
    }

    /// Whether a field is a time of day, without a date.
    pub(super) fn is_time_of_day(&self, column: usize) -> bool {
        let field = self.field(column).unwrap_or_default().trim_ascii();
        field.len() < 24
            && field.contains(&b':')
            && !field.iter().any(|byte| b"-/T ".contains(byte))
    }

    /// Whether the current row equals the one before it, byte for byte.
    pub(super) fn repeats(&self) -> bool {
        self.record == self.previous
    }

    pub(super) fn file(&self) -> String {
        source::shown(&self.path)
    }

    #[cold]
    pub(super) fn place(&self) -> String {
        match self.table {
            true => {
                let row = self.line_hint().saturating_sub(1);
                format!("{}, row {row}", self.file())
            }
            false => format!("{}:{}", self.file(), self.line_at(self.end())),
        }
    }

    /// Byte of the file at which the current row ends.
    fn end(&self) -> u64 {
        self.before.0 + self.reader.byte()
    }

    /// Line of the row that ends at a byte, counted anew from the file's beginning: only an error asks for it.
    #[cold]
    fn line_at(&self, end: u64) -> u64 {
        if self.watch.is_some() {
            // a stream cannot be read again
            return self.line_hint();
        }
        count_lines(&self.path, end.saturating_sub(1)).unwrap_or_else(|_| self.reader.line())
    }

    /// Line of the current row where no comment or blank line stands right before it.
    pub(super) fn line_hint(&self) -> u64 {
        self.before.1 + self.reader.begins()
    }
}

/// A number whose comma is a point.
fn with_point(field: &[u8]) -> Vec<u8> {
    let point = |byte: &u8| if *byte == b',' { b'.' } else { *byte };
    field.iter().map(point).collect()
}

/// 1 + the line ends among the first `end` bytes; `\r\n` and a lone `\r` count as one each.
fn count_lines(path: &Path, end: u64) -> io::Result<u64> {
    let content = FileContent::open(path).map_err(io::Error::other)?;
    let mut file = content.into_bytes().take(end);
    let mut buffer = vec![0; BUFFER];
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
