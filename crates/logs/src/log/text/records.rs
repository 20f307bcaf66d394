//! Records of a text, one by one: lines of plain fields are cut where they lie, all others by csv-core.

use std::io::{self, Read};

use csv_core::ReadRecordResult;
use memchr::{memchr_iter, memchr3};

use crate::log::content::ContentBytes;

/// Bytes that one record may take.
pub(super) const LONGEST_ROW: usize = 1 << 20;
pub(super) const BUFFER: usize = 1 << 17;
/// Fields for which there is room at first.
const FIELDS: usize = 64;

/// A record: its bytes, and where its fields lie in them.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct TextRecord {
    bytes: Vec<u8>,
    fields: Vec<(usize, usize)>,
}

impl TextRecord {
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.fields.len()
    }

    #[inline]
    pub(super) fn get(&self, index: usize) -> Option<&[u8]> {
        let (begin, end) = *self.fields.get(index)?;
        self.bytes.get(begin..end)
    }

    #[inline]
    fn take_line(&mut self, line: &[u8], delimiter: u8) {
        self.bytes.clear();
        self.bytes.extend_from_slice(line);
        self.fields.clear();
        let mut begin = 0;
        for end in memchr_iter(delimiter, line) {
            self.fields.push((begin, end));
            begin = end + 1;
        }
        self.fields.push((begin, line.len()));
    }
}

/// A text as its records, comments and blank lines left out.
pub(super) struct TextRecords {
    inner: ContentBytes,
    core: csv_core::Reader,
    delimiter: u8,
    comment: u8,
    buffer: Vec<u8>,
    /// What of the buffer is not read yet.
    at: usize,
    filled: usize,
    ended: bool,
    /// Bytes and line ends that were read.
    bytes: u64,
    line: u64,
    end: u64,
    begins: u64,
    last: u8,
    ends: Vec<usize>,
    /// Nothing was read yet: there may be a byte order mark.
    first: bool,
}

impl TextRecords {
    pub(super) fn new(inner: ContentBytes, delimiter: u8, comment: u8) -> Self {
        let core = csv_core::ReaderBuilder::new()
            .delimiter(delimiter)
            .comment(Some(comment))
            .build();
        Self {
            inner,
            core,
            delimiter,
            comment,
            buffer: vec![0; BUFFER],
            at: 0,
            filled: 0,
            ended: false,
            bytes: 0,
            line: 1,
            end: 0,
            begins: 1,
            last: b'\n',
            ends: vec![0; FIELDS],
            first: true,
        }
    }

    /// Bytes up to the end of the record, the first byte that ends its line included.
    pub(super) fn byte(&self) -> u64 {
        self.end
    }

    /// Line at which what follows the record begins, from 1.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// Line at which the record begins, or what is left out before it.
    pub(super) fn begins(&self) -> u64 {
        self.begins
    }

    /// Whether what was read so far ends with the end of a line.
    pub(super) fn ends_a_line(&self) -> bool {
        self.last == b'\n'
    }

    pub(super) fn read(&mut self, record: &mut TextRecord) -> io::Result<bool> {
        self.begins = self.line;
        if !self.first && self.read_line(record)? {
            return Ok(true);
        }
        self.first = false;
        self.read_quoted(record)
    }

    /// Takes the next line where it is one of plain fields.
    #[inline]
    fn read_line(&mut self, record: &mut TextRecord) -> io::Result<bool> {
        let mut looked = 0;
        loop {
            let rest = &self.buffer[self.at..self.filled];
            let found = memchr3(b'\n', b'\r', b'"', &rest[looked..]).map(|at| looked + at);
            let Some(end) = found else {
                looked = rest.len();
                match self.make_room() {
                    true if self.fill()? > 0 => continue,
                    // a line without an end, or one that fills the buffer
                    _ => return Ok(false),
                }
            };
            let ends = match (rest[end], rest.get(end + 1)) {
                (b'\n', _) => 1,
                (b'\r', Some(b'\n')) => 2,
                _ => return Ok(false),
            };
            if end == 0 || rest[0] == self.comment {
                return Ok(false);
            }
            record.take_line(&rest[..end], self.delimiter);
            self.end = self.bytes + end as u64 + 1;
            self.pass(end + ends);
            self.line += 1;
            return Ok(true);
        }
    }

    /// Reads the next record by the rules of quotes.
    fn read_quoted(&mut self, record: &mut TextRecord) -> io::Result<bool> {
        let (mut size, mut count, mut taken) = (0, 0, 0);
        self.core.set_line(self.line);
        loop {
            if self.at == self.filled && !self.ended {
                if taken > LONGEST_ROW + BUFFER {
                    return Err(io::ErrorKind::FileTooLarge.into());
                }
                (self.at, self.filled) = (0, 0);
                self.fill()?;
            }
            let room = record.bytes.len().max(size + FIELDS);
            record.bytes.resize(room, 0);
            let (result, read, written, fields) = self.core.read_record(
                &self.buffer[self.at..self.filled],
                &mut record.bytes[size..],
                &mut self.ends[count..],
            );
            self.pass(read);
            (self.line, self.end) = (self.core.line(), self.bytes);
            (size, count, taken) = (size + written, count + fields, taken + read);
            match result {
                ReadRecordResult::InputEmpty => {}
                ReadRecordResult::OutputFull => {
                    let room = (2 * record.bytes.len()).min(LONGEST_ROW + 2 * BUFFER);
                    if room == record.bytes.len() {
                        return Err(io::ErrorKind::FileTooLarge.into());
                    }
                    record.bytes.reserve_exact(room - record.bytes.len());
                    record.bytes.resize(room, 0);
                }
                ReadRecordResult::OutputEndsFull => self.ends.resize(2 * self.ends.len(), 0),
                ReadRecordResult::Record => break,
                ReadRecordResult::End => {
                    record.bytes.clear();
                    record.fields.clear();
                    return Ok(false);
                }
            }
        }
        record.bytes.truncate(size);
        record.fields.clear();
        let mut begin = 0;
        for end in &self.ends[..count] {
            record.fields.push((begin, *end));
            begin = *end;
        }
        Ok(true)
    }

    fn pass(&mut self, bytes: usize) {
        self.at += bytes;
        self.bytes += bytes as u64;
    }

    /// Moves what is not read yet to the front of the buffer; whether there is room behind it.
    fn make_room(&mut self) -> bool {
        self.buffer.copy_within(self.at..self.filled, 0);
        (self.at, self.filled) = (0, self.filled - self.at);
        self.filled < self.buffer.len()
    }

    /// Takes more bytes behind those that are there; how many they are.
    fn fill(&mut self) -> io::Result<usize> {
        let count = self.inner.read(&mut self.buffer[self.filled..])?;
        self.ended |= count == 0;
        self.filled += count;
        if let Some(last) = self.filled.checked_sub(1).filter(|_| count > 0) {
            self.last = self.buffer[last];
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use proptest::prelude::*;

    /// Fields of every record, and byte, line and first line of each.
    type Found = Vec<(Vec<Vec<u8>>, u64, u64)>;

    fn ours(text: &str, pieces: usize) -> Found {
        struct Pieces(Vec<u8>, usize, usize);
        impl Read for Pieces {
            fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
                let count = (self.0.len() - self.1).min(self.2).min(buffer.len());
                buffer[..count].copy_from_slice(&self.0[self.1..self.1 + count]);
                self.1 += count;
                Ok(count)
            }
        }
        // a byte order mark and what follows it come at once, in the head of a file
        let (head, rest) = text.as_bytes().split_at(text.len().min(4));
        let rest: Box<dyn Read + Send> = Box::new(Pieces(rest.to_vec(), 0, pieces));
        let inner = Cursor::new(head.to_vec()).chain(rest);
        let mut records = TextRecords::new(inner, b',', b'#');
        let (mut record, mut out) = (TextRecord::default(), Vec::new());
        while records.read(&mut record).unwrap() {
            let fields = (0..record.len()).map(|k| record.get(k).unwrap().to_vec());
            out.push((fields.collect(), records.byte(), records.begins()));
        }
        out
    }

    /// The same by the crate that knows every rule.
    fn theirs(text: &str) -> Found {
        let mut reader = ::csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let (mut record, mut out) = (::csv::ByteRecord::new(), Vec::new());
        while reader.read_byte_record(&mut record).unwrap() {
            let fields = record.iter().map(<[u8]>::to_vec).collect();
            let begins = record.position().unwrap().line();
            out.push((fields, reader.position().byte(), begins));
        }
        out
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn records_are_those_of_the_csv_crate(text in "(\u{feff})?[-0-9a,\" #\r\n]{0,60}", pieces in 1_usize..40) {
            let (ours, theirs) = (ours(&text, pieces), theirs(&text));
            let fields = |all: &Found| all.iter().map(|one| one.0.clone()).collect::<Vec<_>>();
            prop_assert_eq!(fields(&ours), fields(&theirs));
            let ends = |all: &Found| all.iter().map(|one| one.1).collect::<Vec<_>>();
            prop_assert_eq!(ends(&ours), ends(&theirs));
            // of two signs that end a line the crate passes the second with the next record
            if !text.contains('\r') {
                prop_assert_eq!(ours, theirs);
            }
        }
    }

    #[test]
    fn a_record_without_an_end_is_an_error_before_it_fills_the_memory() {
        let endless: Box<dyn Read + Send> = Box::new(io::repeat(b'7'));
        let mut records =
            TextRecords::new(Cursor::new(b"t,q\n".to_vec()).chain(endless), b',', b'#');
        let mut record = TextRecord::default();
        assert!(records.read(&mut record).unwrap());
        let error = records.read(&mut record).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
    }
}
