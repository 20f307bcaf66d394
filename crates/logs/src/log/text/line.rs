//! The first lines of a text, and how a line is parted into fields.

use std::borrow::Cow;

use crate::log::content::HEAD;
use crate::log::section::ColumnDelimiter;

pub(super) struct Line<'h> {
    pub(super) text: Cow<'h, str>,
    /// Its number, from 1, and the byte of the file at which it begins.
    pub(super) number: u64,
    pub(super) begins: u64,
}

/// The lines of the head; its last one where it is all of the file.
pub(super) fn lines_of(head: &[u8]) -> Vec<Line<'_>> {
    const MARK: &[u8] = b"\xef\xbb\xbf";
    let bytes = head.strip_prefix(MARK).unwrap_or(head);
    let mut begins = (head.len() - bytes.len()) as u64;
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let mut out = Vec::new();
    for (index, line) in bytes.split(|byte| *byte == end).enumerate() {
        let text = line.strip_suffix(b"\r").unwrap_or(line);
        out.push(Line {
            text: String::from_utf8_lossy(text),
            number: index as u64 + 1,
            begins,
        });
        begins += line.len() as u64 + 1;
    }
    if head.len() == HEAD && out.len() > 1 {
        out.pop();
    }
    out
}

/// How the fields of a line are parted.
#[derive(Clone, Copy)]
pub(super) struct FieldParting {
    pub(super) sign: u8,
    /// Runs of it count as one.
    pub(super) runs: bool,
}

impl FieldParting {
    /// As it is asked for, else by the signs in the line that names the columns.
    pub(super) fn of(line: &str, asked: ColumnDelimiter) -> Self {
        let count = |sign: u8| {
            let mut quoted = false;
            let outside = line.bytes().filter(|byte| {
                quoted ^= *byte == b'"';
                !quoted && *byte == sign
            });
            outside.count()
        };
        let sign = match asked {
            ColumnDelimiter::Comma => b',',
            ColumnDelimiter::Semicolon => b';',
            ColumnDelimiter::Tab => b'\t',
            ColumnDelimiter::Space => b' ',
            ColumnDelimiter::Auto => {
                // of signs that stand there as often the first one
                let most = [b'\t', b';', b',']
                    .into_iter()
                    .max_by_key(|sign| count(*sign));
                let most = most.filter(|sign| count(*sign) > 0);
                let other = if line.trim().contains(' ') {
                    b' '
                } else {
                    b','
                };
                most.unwrap_or(other)
            }
        };
        Self {
            sign,
            runs: sign == b' ',
        }
    }

    /// Fields of one line without quotes, trimmed.
    pub(super) fn split(self, line: &str) -> Vec<&str> {
        let fields = line.split(char::from(self.sign)).map(str::trim);
        fields
            .filter(|field| !self.runs || !field.is_empty())
            .collect()
    }
}
