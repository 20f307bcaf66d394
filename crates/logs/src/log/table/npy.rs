//! Arrays as numpy writes them: a head that says type and shape, then the numbers.

use std::io::{self, BufReader, Read, Write};

use super::super::open_file::OpenFile;
use super::lines::{damaged, number};
use super::literal::PythonLiteral;
use super::zip::{self, ZipMember};

/// Largest head of an array [bytes].
const HEAD: usize = 1 << 16;

/// The type of an array's numbers: kind, size in bytes and order of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ScalarType {
    kind: ScalarKind,
    bytes: usize,
    big_endian: bool,
}

/// The kinds of numbers of a NumPy array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ScalarKind {
    Float,
    Signed,
    Unsigned,
    Truth,
    /// A time or a duration, counted in a unit.
    Time,
}

/// One number of an element of an array.
#[derive(Debug, Clone)]
pub(super) struct Field {
    /// What its name adds to that of the array.
    pub(super) name: String,
    /// Where it stands in the element [bytes].
    pub(super) at: usize,
    pub(super) scalar: ScalarType,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Element {
    pub(super) fields: Vec<Field>,
    pub(super) size: usize,
    /// Whether its fields have names of their own.
    pub(super) named: bool,
}

/// The file that holds an array: one of its own, or a member of an archive.
enum ArrayPlace {
    File(OpenFile),
    Member(OpenFile, ZipMember),
}

/// An array whose head was read.
pub(super) struct NpyArray {
    /// Its name; none where it is a file of its own.
    pub(super) name: String,
    place: ArrayPlace,
    /// Where its numbers begin.
    begin: u64,
    pub(super) shape: Vec<u64>,
    /// Whether the first axis runs fastest.
    pub(super) by_columns: bool,
    /// `None` where it holds no numbers.
    pub(super) element: Option<Element>,
}

impl NpyArray {
    pub(super) fn of_file(file: &OpenFile) -> io::Result<Self> {
        Self::new(String::new(), ArrayPlace::File(file.from(0)))
    }

    pub(super) fn of_members(file: &OpenFile, members: Vec<ZipMember>) -> io::Result<Vec<Self>> {
        let arrays = members.into_iter().filter_map(|member| {
            let name = member.name.strip_suffix(".npy")?.to_owned();
            Some(Self::new(name, ArrayPlace::Member(file.from(0), member)))
        });
        arrays.collect()
    }

    fn new(name: String, place: ArrayPlace) -> io::Result<Self> {
        let mut file = place.reader(0)?;
        let mut first = [0; 8];
        file.read_exact(&mut first)?;
        if !first.starts_with(b"\x93NUMPY") {
            return Err(damaged("an array does not begin as numpy writes it"));
        }
        let mut length = [0; 4];
        let wide = if first[6] > 1 { 4 } else { 2 };
        file.read_exact(&mut length[..wide])?;
        let count = u32::from_le_bytes(length) as usize;
        if count > HEAD {
            return Err(damaged("the head of an array is longer than any"));
        }
        let mut head = vec![0; count];
        file.read_exact(&mut head)?;
        let text = String::from_utf8_lossy(&head);
        let unread = || damaged("the head of an array cannot be read");
        let head = PythonLiteral::parse(&text).ok_or_else(unread)?;
        let shape = head.get("shape").and_then(PythonLiteral::wholes);
        Ok(Self {
            name,
            begin: (8 + wide + count) as u64,
            place,
            shape: shape.ok_or_else(unread)?,
            by_columns: head.get("fortran_order") == Some(&PythonLiteral::Truth(true)),
            element: head.get("descr").and_then(Element::of),
        })
    }

    /// Its numbers from a byte on.
    pub(super) fn reader(&self, from: u64) -> io::Result<Box<dyn Read + Send>> {
        self.place.reader(self.begin.saturating_add(from))
    }
}

impl ArrayPlace {
    fn reader(&self, from: u64) -> io::Result<Box<dyn Read + Send>> {
        match self {
            Self::File(file) => Ok(Box::new(BufReader::new(file.from(from)))),
            Self::Member(file, member) => zip::reader(file, member, from),
        }
    }
}

impl Element {
    /// The element that numpy describes; `None` where it is, or has, no number.
    fn of(described: &PythonLiteral) -> Option<Self> {
        let fields = match described {
            PythonLiteral::Text(text) => {
                let (scalar, name) = ScalarType::of(text)?;
                let at = 0;
                return Some(Self {
                    fields: vec![Field { name, at, scalar }],
                    size: scalar.bytes,
                    named: false,
                });
            }
            PythonLiteral::List(fields) => fields,
            _ => return None,
        };
        let mut out = Self {
            named: true,
            ..Self::default()
        };
        for field in fields {
            let PythonLiteral::List(parts) = field else {
                return None;
            };
            let [
                PythonLiteral::Text(name),
                PythonLiteral::Text(described),
                shape @ ..,
            ] = &parts[..]
            else {
                return None;
            };
            let count = match shape.first() {
                None => None,
                Some(shape) => Some(shape.wholes()?.into_iter().try_fold(1, u64::checked_mul)?),
            };
            let number = ScalarType::of(described);
            let size = match &number {
                Some((scalar, _)) => scalar.bytes,
                None => text_bytes(described)?,
            };
            for k in 0..count.unwrap_or(1) {
                if let Some((scalar, unit)) = &number {
                    let index = count.map_or(String::new(), |_| format!("_{k}"));
                    out.fields.push(Field {
                        name: format!("{name}{index}{unit}"),
                        at: out.size,
                        scalar: *scalar,
                    });
                }
                out.size = out.size.checked_add(size)?;
                if out.fields.len() > super::lines::COLUMNS || out.size > HEAD {
                    return None;
                }
            }
        }
        (!out.fields.is_empty()).then_some(out)
    }
}

/// Bytes of a text or of bytes without a meaning: `<U8`, `|S8`, `|V4`.
fn text_bytes(described: &str) -> Option<usize> {
    let mut signs = described.trim_start_matches(['<', '>', '|', '=']).chars();
    let each = match signs.next()? {
        'U' => 4,
        'S' | 'V' => 1,
        _ => return None,
    };
    signs.as_str().parse::<usize>().ok()?.checked_mul(each)
}

impl ScalarType {
    /// The number that `<f8` describes, and the unit of a time in brackets.
    fn of(described: &str) -> Option<(Self, String)> {
        let big_endian = described.starts_with('>');
        let mut signs = described.trim_start_matches(['<', '>', '|', '=']).chars();
        let kind = match signs.next()? {
            'f' => ScalarKind::Float,
            'i' => ScalarKind::Signed,
            'u' => ScalarKind::Unsigned,
            'b' => ScalarKind::Truth,
            'M' | 'm' => ScalarKind::Time,
            _ => return None,
        };
        let (bytes, unit) = signs
            .as_str()
            .split_once('[')
            .unwrap_or((signs.as_str(), ""));
        let (bytes, unit) = (bytes.parse().ok()?, unit.trim_end_matches(']'));
        let known = match kind {
            ScalarKind::Float => matches!(bytes, 2 | 4 | 8),
            ScalarKind::Signed | ScalarKind::Unsigned => matches!(bytes, 1 | 2 | 4 | 8),
            ScalarKind::Truth => bytes == 1,
            ScalarKind::Time => bytes == 8 && ["s", "ms", "us", "ns"].contains(&unit),
        };
        let unit = match kind {
            ScalarKind::Time => format!(" [{unit}]"),
            _ => String::new(),
        };
        let scalar = Self {
            kind,
            bytes,
            big_endian,
        };
        known.then_some((scalar, unit))
    }

    pub(super) fn write(self, line: &mut Vec<u8>, bytes: &[u8]) -> io::Result<()> {
        let mut word = [0; 8];
        word[..self.bytes].copy_from_slice(&bytes[..self.bytes]);
        if self.big_endian {
            word[..self.bytes].reverse();
        }
        let plain = u64::from_le_bytes(word);
        let signed = || (plain << (64 - 8 * self.bytes)).cast_signed() >> (64 - 8 * self.bytes);
        match self.kind {
            ScalarKind::Float if self.bytes == 8 => number(line, f64::from_bits(plain)),
            ScalarKind::Float if self.bytes == 4 => {
                number(line, f64::from(f32::from_bits(plain as u32)))
            }
            ScalarKind::Float => number(line, half(plain as u16)),
            ScalarKind::Unsigned | ScalarKind::Truth => write!(line, "{plain}"),
            ScalarKind::Signed => write!(line, "{}", signed()),
            // "not a time"
            ScalarKind::Time if signed() == i64::MIN => Ok(()),
            ScalarKind::Time => write!(line, "{}", signed()),
        }
    }
}

/// A number of two bytes.
fn half(bits: u16) -> f64 {
    let (power, rest) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    let size = match power {
        0 => rest * 2_f64.powi(-14),
        31 if rest > 0.0 => f64::NAN,
        31 => f64::INFINITY,
        _ => (1.0 + rest) * 2_f64.powi(power - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}
