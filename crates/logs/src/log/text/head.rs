//! What the first bytes of a file tell: its format, comment sign, delimiter and header.

use std::path::Path;

use super::number;
use crate::log::content::HEAD;
use crate::log::section::Delimiter;
use crate::log::time::Instant;
use crate::log::{LogError, source};

/// What the head of a file tells.
pub(super) struct Head {
    pub(super) comment: u8,
    pub(super) delimiter: u8,
    pub(super) spaces: bool,
    /// Column names that stand in a comment line, as numpy writes them.
    pub(super) header_in_comment: Option<(String, u64)>,
    pub(super) header_line: u64,
    /// The first line holds numbers, and columns are given by number.
    pub(super) headerless: bool,
}

/// Names a file that is no plain text, by its first bytes.
pub(super) fn refuse_other_formats(path: &Path, head: &[u8]) -> Result<(), LogError> {
    let (kind, remedy) = if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
        ("UTF-16 text", "save it as UTF-8")
    } else if head.iter().take(4096).any(|byte| *byte == 0) {
        (
            "binary, and neither an MCAP recording nor a rosbag2 database",
            "give a text log with a header line, a .mcap or a .db3 file",
        )
    } else {
        return Ok(());
    };
    Err(LogError::Format {
        file: source::shown(path),
        kind,
        remedy,
    })
}

/// Finds comment sign, delimiter and header; a log may lack one where columns are given `by_number`.
pub(super) fn look_at(
    path: &Path,
    head: &[u8],
    wanted: Delimiter,
    by_number: bool,
) -> Result<Head, LogError> {
    let file = || source::shown(path);
    let bytes = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let text = String::from_utf8_lossy(bytes);
    let mut comment = None;
    let mut last_comment: Option<(&str, u64)> = None;
    let mut first: Option<(&str, u64)> = None;
    let end = if text.contains('\n') { '\n' } else { '\r' };
    for (index, line) in text.split(end).enumerate() {
        let line = line.trim_end_matches('\r');
        let number = index as u64 + 1;
        match line.bytes().next() {
            Some(sign @ (b'#' | b'%')) if comment.is_none_or(|known| known == sign) => {
                comment = Some(sign);
                last_comment = Some((&line[1..], number));
            }
            _ if line.trim().is_empty() => {}
            _ => {
                first = Some((line, number));
                break;
            }
        }
    }
    let Some((line, number)) = first else {
        return Err(match last_comment {
            Some(_) => LogError::TooFewRows {
                file: file(),
                rows: 0,
            },
            None if head.len() == HEAD => LogError::LongLine {
                file: file(),
                line: 1,
                limit: HEAD,
            },
            None => LogError::Empty { file: file() },
        });
    };
    let (delimiter, spaces) = delimiter_of(line, wanted);
    let fields = split(line, delimiter, spaces);
    let mut header_in_comment = None;
    let mut header_line = number;
    let mut headerless = false;
    if fields.iter().all(|field| is_datum(field)) {
        // numpy.savetxt puts the names into a comment.
        let named =
            last_comment.filter(|(names, _)| split(names, delimiter, spaces).len() == fields.len());
        match named {
            Some((names, at)) => {
                header_in_comment = Some((names.to_owned(), at));
                header_line = at;
            }
            None if by_number => headerless = true,
            None => {
                return Err(LogError::NoHeader {
                    file: file(),
                    line: number,
                });
            }
        }
    }
    Ok(Head {
        comment: comment.unwrap_or(b'#'),
        delimiter,
        spaces,
        header_in_comment,
        header_line,
        headerless,
    })
}

/// Whether a field is a number or a date, and so no name of a column.
fn is_datum(field: &str) -> bool {
    number::parse(field.as_bytes()).is_some() || Instant::parse_iso(field.as_bytes()).is_some()
}

/// The delimiter byte, and whether runs of it count as one.
fn delimiter_of(line: &str, wanted: Delimiter) -> (u8, bool) {
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
