//! The members of a zip archive, as `numpy.savez` writes it.

use std::io::{self, BufReader, Read};

use super::super::open_file::OpenFile;
use super::lines::{damaged, unusable};

/// Largest comment behind the directory, and the directory's own end [bytes].
const END: u64 = 65_557;
/// Largest directory that is read [bytes].
const DIRECTORY: u64 = 1 << 24;

/// A file in a zip archive.
#[derive(Debug, Clone)]
pub(super) struct ZipMember {
    pub(super) name: String,
    packed: bool,
    /// Where its local header begins, and how many bytes it takes.
    header: u64,
    size: u64,
}

/// The number of so many bytes at a place, the least byte first.
fn number<const BYTES: usize>(bytes: &[u8], at: usize) -> io::Result<u64> {
    let found = bytes.get(at..at + BYTES).ok_or_else(cut)?;
    Ok((found.iter().rev()).fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
}

fn cut() -> io::Error {
    damaged("the archive is cut off")
}

/// Bytes of a file from a place on.
fn piece(file: &OpenFile, at: u64, count: u64) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    file.from(at).take(count).read_to_end(&mut out)?;
    match out.len() as u64 == count {
        true => Ok(out),
        false => Err(cut()),
    }
}

/// The members, as the directory at the end of the archive lists them.
pub(super) fn members(file: &OpenFile) -> io::Result<Vec<ZipMember>> {
    let length = file.metadata()?.len();
    let tail = piece(file, length - length.min(END), length.min(END))?;
    let end = tail
        .windows(4)
        .rposition(|four| four == b"PK\x05\x06")
        .ok_or_else(cut)?;
    let (mut size, mut begin) = (number::<4>(&tail, end + 12)?, number::<4>(&tail, end + 16)?);
    let large = end.checked_sub(20);
    let large = large.filter(|at| tail[*at..].starts_with(b"PK\x06\x07"));
    if let Some(at) = large {
        let end = piece(file, number::<8>(&tail, at + 8)?, 56)?;
        (size, begin) = (number::<8>(&end, 40)?, number::<8>(&end, 48)?);
    }
    if size > DIRECTORY {
        return Err(unusable("the archive holds too many files".to_owned()));
    }
    let directory = piece(file, begin, size)?;
    let mut out = Vec::new();
    let mut at = 0;
    while directory[at..].starts_with(b"PK\x01\x02") {
        let [name, extra, comment] = [28, 30, 32].map(|k| number::<2>(&directory, at + k));
        let (name, extra, comment) = (name? as usize, extra? as usize, comment? as usize);
        let next = at + 46 + name + extra + comment;
        if next > directory.len() {
            return Err(cut());
        }
        let text = |from: usize, count| &directory[at + from..at + from + count];
        let [size, header] = sizes(&directory[at..], text(46 + name, extra))?;
        let encrypted = number::<2>(&directory, at + 8)? & 1 == 1;
        let packed = match number::<2>(&directory, at + 10)? {
            _ if encrypted => return Err(unusable("the archive asks for a password".to_owned())),
            0 => false,
            8 => true,
            other => {
                return Err(unusable(format!(
                    "the archive is packed by method {other}, which is not read"
                )));
            }
        };
        out.push(ZipMember {
            name: String::from_utf8_lossy(text(46, name)).into_owned(),
            packed,
            header,
            size,
        });
        at = next;
    }
    Ok(out)
}

/// Packed bytes of a member and the place of its local header; large ones stand in the extra field.
fn sizes(entry: &[u8], mut extra: &[u8]) -> io::Result<[u64; 2]> {
    const IN_EXTRA_FIELD: u64 = u32::MAX as u64;
    let mut all = [
        number::<4>(entry, 24)?,
        number::<4>(entry, 20)?,
        number::<4>(entry, 42)?,
    ];
    while extra.len() >= 4 {
        let (kind, count) = (number::<2>(extra, 0)?, number::<2>(extra, 2)? as usize);
        let body = extra.get(4..4 + count).ok_or_else(cut)?;
        if kind == 1 {
            let mut from = 0;
            for value in all.iter_mut().filter(|value| **value == IN_EXTRA_FIELD) {
                *value = number::<8>(body, from)?;
                from += 8;
            }
        }
        extra = &extra[4 + count..];
    }
    Ok([all[1], all[2]])
}

/// The bytes of a member, from one on.
pub(super) fn reader(
    file: &OpenFile,
    member: &ZipMember,
    from: u64,
) -> io::Result<Box<dyn Read + Send>> {
    let local = piece(file, member.header, 30)?;
    if !local.starts_with(b"PK\x03\x04") {
        return Err(damaged(
            "the archive's directory names a place without a file",
        ));
    }
    let begin = member.header + 30 + number::<2>(&local, 26)? + number::<2>(&local, 28)?;
    if !member.packed {
        let place = begin.checked_add(from).ok_or_else(cut)?;
        let rest = file.from(place).take(member.size.saturating_sub(from));
        return Ok(Box::new(BufReader::new(rest)));
    }
    let packed = BufReader::new(file.from(begin).take(member.size));
    let mut plain = BufReader::new(flate2::bufread::DeflateDecoder::new(packed));
    let passed = io::copy(&mut Read::by_ref(&mut plain).take(from), &mut io::sink())?;
    match passed == from {
        true => Ok(Box::new(plain)),
        false => Err(cut()),
    }
}
