//! A log as CSV: a header line, then rows of the shortest numbers that are read back bit for bit.

use std::io::{self, Write};

use crate::log::Instant;

/// Writes the notes and the header.
pub(super) fn begin(out: &mut impl Write, columns: &[String], notes: &[String]) -> io::Result<()> {
    for note in notes {
        writeln!(out, "# {note}")?;
    }
    let names: Vec<String> = columns.iter().map(|name| quoted(name)).collect();
    writeln!(out, "{}", names.join(","))
}

/// Writes a row, its time first; what is no number is left empty.
pub(super) fn row(out: &mut impl Write, origin: Instant, row: &[f64]) -> io::Result<()> {
    let far = origin != Instant::default();
    for (index, value) in row.iter().enumerate() {
        if index > 0 {
            out.write_all(b",")?;
        }
        match value {
            // To the nanosecond: seconds since 1970 have no f64 for it.
            t if index == 0 && far && t.is_finite() => write!(out, "{}", origin.later(*t))?,
            x if x.is_nan() => {}
            // `inf` and `-inf` among them
            x => write!(out, "{x:?}")?,
        }
    }
    out.write_all(b"\n")
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
