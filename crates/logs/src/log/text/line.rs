//! The first lines of a text, and how a line is parted into fields.

use std::borrow::Cow;

use crate::log::content::HEAD;
use crate::log::section::Delimiter;

pub(super) struct Wanted {
    pub(super) delimiter: Delimiter,
    /// Line of the header, from 1.
    pub(super) header_line: Option<u64>,
    /// Columns are given by number, so that no header is needed.
    pub(super) by_number: bool,
}

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

/// The delimiter byte, and whether runs of it count as one.
pub(super) fn delimiter_of(line: &str, wanted: Delimiter) -> (u8, bool) {
    match wanted {
        Delimiter::Comma => (b',', false),
        Delimiter::Semicolon => (b';', false),
        Delimiter::Tab => (b'\t', false),
        Delimiter::Space => (b' ', true),
        Delimiter::Auto => {
            let count = |sign: u8| {
                let mut quoted = false;
                let outside = line.bytes().filter(|byte| {
                    quoted ^= *byte == b'"';
                    !quoted && *byte == sign
                });
                outside.count()
            };
            let mut best = (b',', count(b','));
            for sign in [b';', b'\t'] {
                if count(sign) > best.1 {
                    best = (sign, count(sign));
                }
            }
            if best.1 == 0 && line.trim().contains(' ') {
                (b' ', true)
            } else {
                (best.0, false)
            }
        }
    }
}

/// Fields of one line without quotes, trimmed.
pub(super) fn split(line: &str, delimiter: u8, spaces: bool) -> Vec<&str> {
    let fields = line.split(char::from(delimiter)).map(str::trim);
    if spaces {
        fields.filter(|field| !field.is_empty()).collect()
    } else {
        fields.collect()
    }
}
