//! MAT-files of MATLAB 5 to 7.2: arrays of numbers, and structs of them. The format is MathWorks' "MAT-File Format",
//! level 5.

use std::io::{self, Read};

use super::columns::{HeldArray, table};
use super::lines::{TableText, damaged, unusable};
use crate::log::open_file::OpenFile;

/// Largest file, unpacked, whose arrays are held.
const LARGEST: u64 = 1 << 28;
/// Structs within structs.
const DEPTH: usize = 8;
/// Elements of an array of structs that are read.
const MOST_STRUCTS: usize = 256;

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

pub(super) fn is_mat(head: &[u8]) -> bool {
    head.starts_with(b"MATLAB 5.0 MAT-file") && matches!(head.get(126..128), Some(b"IM" | b"MI"))
}

/// MatBytes that are taken one after the other, with the order of those of a number.
#[derive(Clone, Copy)]
struct MatBytes<'b> {
    rest: &'b [u8],
    big: bool,
}

/// What a matrix holds.
enum MatValue {
    Numbers(Vec<usize>, Vec<f64>),
    Text(String),
    /// Fields of each element.
    Struct(Vec<Vec<(String, MatValue)>>),
    /// Objects, functions, sparse arrays and cells, by what they are.
    Other(&'static str),
}

fn cut() -> io::Error {
    damaged("the MAT-file is cut off")
}

impl<'b> MatBytes<'b> {
    fn take(&mut self, count: usize) -> io::Result<&'b [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(cut)?;
        self.rest = rest;
        Ok(taken)
    }

    fn word(&mut self) -> io::Result<u32> {
        let four: [u8; 4] = self.take(4)?.try_into().map_err(|_| cut())?;
        Ok(if self.big {
            u32::from_be_bytes(four)
        } else {
            u32::from_le_bytes(four)
        })
    }

    /// The next element: its type and its bytes.
    fn element(&mut self) -> io::Result<(u32, Self)> {
        let big = self.big;
        let first = self.word()?;
        // up to four bytes stand beside a short tag
        if first >> 16 != 0 {
            let count = (first >> 16) as usize;
            let four = self.take(4)?;
            let rest = four.get(..count).ok_or_else(cut)?;
            return Ok((first & 0xffff, Self { rest, big }));
        }
        let count = self.word()? as usize;
        let rest = self.take(count)?;
        if first != COMPRESSED {
            let padding = (8 - count % 8) % 8;
            self.take(padding.min(self.rest.len()))?;
        }
        Ok((first, Self { rest, big }))
    }

    /// The numbers of an element of some type.
    fn numbers(self, kind: u32) -> io::Result<Vec<f64>> {
        macro_rules! of {
            ($number:ty) => {
                (self.rest.chunks_exact(size_of::<$number>()))
                    .filter_map(|bytes| {
                        let bytes = bytes.try_into().ok()?;
                        Some(match self.big {
                            true => <$number>::from_be_bytes(bytes),
                            false => <$number>::from_le_bytes(bytes),
                        } as f64)
                    })
                    .collect()
            };
        }
        Ok(match kind {
            1 => of!(i8),
            2 => of!(u8),
            3 => of!(i16),
            4 => of!(u16),
            5 => of!(i32),
            6 => of!(u32),
            7 => of!(f32),
            9 => of!(f64),
            12 => of!(i64),
            13 => of!(u64),
            other => return Err(damaged(&format!("numbers of the unknown type {other}"))),
        })
    }

    fn text(self) -> String {
        let text = String::from_utf8_lossy(self.rest);
        text.trim_matches(['\0', ' ']).to_owned()
    }
}

/// Reads a matrix; its name is empty inside of others.
fn matrix(mut of: MatBytes<'_>, depth: usize) -> io::Result<(String, MatValue)> {
    if of.rest.is_empty() {
        // MATLAB writes an empty array so
        return Ok((String::new(), MatValue::Numbers(vec![0], Vec::new())));
    }
    let (_, mut flags) = of.element()?;
    let flags = flags.word()?;
    let class = flags & 0xff;
    let (kind, dimensions) = of.element()?;
    if class == 17 {
        return Ok((
            dimensions.text(),
            MatValue::Other("object (a timeseries or a table)"),
        ));
    }
    let axes: Vec<usize> = dimensions
        .numbers(kind)?
        .iter()
        .map(|n| *n as usize)
        .collect();
    let (_, name) = of.element()?;
    let name = name.text();
    let all = axes
        .iter()
        .try_fold(1_usize, |all, n| all.checked_mul(*n))
        .ok_or_else(cut)?;
    let found = match class {
        6..=15 => {
            let (kind, numbers) = of.element()?;
            let numbers = numbers.numbers(kind)?;
            if numbers.len() != all {
                return Err(cut());
            }
            MatValue::Numbers(axes, numbers)
        }
        4 => {
            let (kind, letters) = of.element()?;
            let letters = match kind {
                16 => letters.text(),
                kind => {
                    let codes = letters.numbers(kind)?.into_iter();
                    codes
                        .filter_map(|code| char::from_u32(code as u32))
                        .collect()
                }
            };
            MatValue::Text(letters)
        }
        2 if depth > 0 => {
            let (kind, length) = of.element()?;
            let length = length.numbers(kind)?.first().copied().unwrap_or(0.0) as usize;
            let (_, names) = of.element()?;
            if length == 0 {
                return Err(cut());
            }
            let fields: Vec<String> = names
                .rest
                .chunks(length)
                .map(|name| {
                    let end = name
                        .iter()
                        .position(|byte| *byte == 0)
                        .unwrap_or(name.len());
                    String::from_utf8_lossy(&name[..end]).into_owned()
                })
                .collect();
            let mut elements = Vec::new();
            for _ in 0..all.min(MOST_STRUCTS) {
                let mut own = Vec::new();
                for field in &fields {
                    let (kind, inner) = of.element()?;
                    if kind != MATRIX {
                        return Err(damaged("a field of a struct is no matrix"));
                    }
                    own.push((field.clone(), matrix(inner, depth - 1)?.1));
                }
                elements.push(own);
            }
            MatValue::Struct(elements)
        }
        1 => MatValue::Other("cell array"),
        3 => MatValue::Other("object"),
        5 => MatValue::Other("sparse array"),
        _ => MatValue::Other("value of another class"),
    };
    Ok((name, found))
}

/// Lists the arrays of a matrix by their names, and what is left out.
fn list(name: &str, of: MatValue, arrays: &mut Vec<HeldArray>, notes: &mut Vec<String>) {
    match of {
        MatValue::Numbers(axes, numbers) => {
            let mut axes: Vec<usize> = axes.into_iter().filter(|count| *count != 1).collect();
            if axes.is_empty() {
                axes.push(1);
            }
            arrays.push(HeldArray {
                name: name.to_owned(),
                axes,
                numbers,
                labels: Vec::new(),
            });
        }
        MatValue::Struct(elements) => {
            let alone = elements.len() == 1;
            for (k, fields) in elements.into_iter().enumerate() {
                let label = fields.iter().find_map(|(field, of)| match of {
                    MatValue::Text(text) if field == "label" && !text.is_empty() => {
                        Some(text.clone())
                    }
                    _ => None,
                });
                for (field, of) in fields {
                    // Simulink's structure with time: signals(k).values, and what they are called
                    let name = match &label {
                        Some(label) if field == "values" => label.clone(),
                        _ if alone => format!("{name}.{field}"),
                        _ => format!("{name}_{k}.{field}"),
                    };
                    list(&name, of, arrays, notes);
                }
            }
        }
        MatValue::Text(_) => {}
        MatValue::Other(what) => notes.push(format!("`{name}` is left out: it is a {what}")),
    }
}

pub(super) fn open(file: &OpenFile) -> io::Result<TableText> {
    let mut bytes = Vec::new();
    file.from(0).take(LARGEST).read_to_end(&mut bytes)?;
    let big = bytes.get(126..128).ok_or_else(cut)? == b"MI";
    let mut rest = MatBytes {
        rest: bytes.get(128..).ok_or_else(cut)?,
        big,
    };
    let (mut arrays, mut notes, mut unpacked) = (Vec::new(), Vec::new(), 0);
    while rest.rest.len() >= 8 {
        let (kind, element) = rest.element()?;
        let mut plain = Vec::new();
        let (kind, element) = match kind {
            COMPRESSED => {
                let most = LARGEST - unpacked;
                flate2::read::ZlibDecoder::new(element.rest)
                    .take(most)
                    .read_to_end(&mut plain)?;
                unpacked += plain.len() as u64;
                MatBytes { rest: &plain, big }.element()?
            }
            other => (other, element),
        };
        if kind == MATRIX {
            let (name, found) = matrix(element, DEPTH)?;
            list(&name, found, &mut arrays, &mut notes);
        }
    }
    if arrays
        .iter()
        .all(|array: &HeldArray| array.numbers.len() < 2)
        && !notes.is_empty()
    {
        return Err(unusable(format!(
            "{}; in MATLAB write the numbers as a table: `writetable(timetable2table(TT), 'OUT.csv')` for a timetable TT, `writematrix([ts.Time ts.Data], 'OUT.csv')` for a timeseries ts",
            notes.join("; ")
        )));
    }
    table(&arrays, notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn element(kind: u32, data: &[u8]) -> Vec<u8> {
        let mut out = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        out.extend(data);
        out.resize(out.len().div_ceil(8) * 8, 0);
        out
    }

    fn numeric(name: &str, axes: [i32; 2], numbers: &[f64]) -> Vec<u8> {
        let flags = [6_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat();
        let axes: Vec<u8> = axes.iter().flat_map(|n| n.to_le_bytes()).collect();
        let data: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let parts = [
            (6, &flags),
            (5, &axes),
            (1, &name.as_bytes().to_vec()),
            (9, &data),
        ];
        let body: Vec<u8> = parts
            .iter()
            .flat_map(|(kind, data)| element(*kind, data))
            .collect();
        element(MATRIX, &body)
    }

    #[test]
    fn a_matrix_is_read_with_its_name_and_axes_and_any_cut_is_an_error() {
        let whole = numeric("q", [2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let read = |bytes: &[u8]| {
            let (_, element) = MatBytes {
                rest: bytes,
                big: false,
            }
            .element()?;
            matrix(element, DEPTH)
        };
        let (name, found) = read(&whole).unwrap();
        let MatValue::Numbers(axes, numbers) = found else {
            panic!("no numbers");
        };
        assert_eq!((&*name, axes, numbers[5]), ("q", vec![2, 3], 6.0));
        for end in 0..whole.len() - 1 {
            assert!(read(&whole[..end]).is_err(), "{end}");
        }
    }
}
