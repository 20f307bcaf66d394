//! A log as CSV: a header line, then rows of the shortest numbers that are read back bit for bit.

use std::io::{self, Write};

use crate::log::Instant;

/// Rows as text.
#[derive(Debug)]
pub(super) struct Text<W> {
    out: W,
}

impl<W: Write> Text<W> {
    /// Writes the notes and the header.
    pub(super) fn new(mut out: W, columns: &[String], notes: &[String]) -> io::Result<Self> {
        for note in notes {
            writeln!(out, "# {note}")?;
        }
        let names: Vec<String> = columns.iter().map(|name| quoted(name)).collect();
        writeln!(out, "{}", names.join(","))?;
        Ok(Self { out })
    }

    /// Writes a row, its time first; what is no number is left empty.
    pub(super) fn row(&mut self, origin: Instant, row: &[f64]) -> io::Result<()> {
        let far = origin != Instant::default();
        for (index, value) in row.iter().enumerate() {
            if index > 0 {
                self.out.write_all(b",")?;
            }
            if index == 0 && far && value.is_finite() {
                // To the nanosecond: seconds since 1970 have no f64 for it.
                write!(self.out, "{}", origin.later(*value))?;
            } else if value.is_nan() {
            } else if value.is_infinite() {
                self.out
                    .write_all(if *value > 0.0 { b"inf" } else { b"-inf" })?;
            } else {
                write!(self.out, "{value:?}")?;
            }
        }
        self.out.write_all(b"\n")
    }

    pub(super) fn finish(self) -> io::Result<W> {
        Ok(self.out)
    }
}

/// A name as a CSV field.
fn quoted(name: &str) -> String {
    let special = |c: char| c.is_control() || ",;\"#%".contains(c);
    if name.is_empty() || name.starts_with(' ') || name.ends_with(' ') || name.chars().any(special)
    {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
