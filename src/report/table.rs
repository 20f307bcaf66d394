//! Plain-text tables that fit a terminal of 80 columns.
//!
//! Numbers line up at the decimal point; a column of words is wrapped when the table would be too
//! wide. No colour: the text is the same in a file, a pipe and a terminal.

use std::fmt;

/// Columns of a terminal that a table keeps to where it can.
pub const WIDTH: usize = 80;
/// A column of words is not wrapped below this.
const NARROWEST: usize = 10;
const GAP: &str = "  ";

/// Where the cells of a column line up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// Words: at the left, wrapped at spaces when the table is too wide.
    Left,
    /// Whole numbers and short marks: at the right.
    Right,
    /// Numbers: at the decimal point.
    Decimal,
}

/// A table under construction; `Display` renders it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    caption: Option<String>,
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these headers.
    pub fn new(columns: &[(&str, Align)]) -> Self {
        Table {
            caption: None,
            columns: columns
                .iter()
                .map(|(name, align)| (printable(name), *align))
                .collect(),
            rows: Vec::new(),
        }
    }

    /// A line above the headers.
    pub fn caption(mut self, text: &str) -> Self {
        self.caption = Some(printable(text));
        self
    }

    /// Adds a row; missing cells are empty, surplus cells are dropped.
    pub fn row<S: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = S>) {
        let mut row: Vec<String> = cells
            .into_iter()
            .take(self.columns.len())
            .map(|cell| printable(cell.as_ref()))
            .collect();
        row.resize(self.columns.len(), String::new());
        self.rows.push(row);
    }

    /// Caption, names of the columns and rows, for another way to show them.
    pub(super) fn parts(&self) -> (&str, Vec<&str>, &[Vec<String>]) {
        let names = self.columns.iter().map(|(name, _)| name.as_str());
        (
            self.caption.as_deref().unwrap_or(""),
            names.collect(),
            &self.rows,
        )
    }

    /// Whether no row was added.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Widths of the columns, after words were narrowed to fit [`WIDTH`].
    fn widths(&self, cells: &[Vec<String>]) -> Vec<usize> {
        let mut widths: Vec<usize> = (0..self.columns.len())
            .map(|j| {
                let header = length(&self.columns[j].0);
                cells
                    .iter()
                    .map(|row| length(&row[j]))
                    .fold(header, usize::max)
            })
            .collect();
        let total = |widths: &[usize]| {
            widths.iter().sum::<usize>() + GAP.len() * widths.len().saturating_sub(1)
        };
        while total(&widths) > WIDTH {
            // The widest column of words gives first, down to the longest of them.
            let widest = (0..widths.len())
                .filter(|&j| self.columns[j].1 == Align::Left)
                .filter(|&j| widths[j] > NARROWEST.max(length(&self.columns[j].0)))
                .max_by_key(|&j| widths[j]);
            match widest {
                Some(j) => widths[j] -= 1,
                None => break,
            }
        }
        widths
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = self.rows.clone();
        for (j, (_, align)) in self.columns.iter().enumerate() {
            if *align == Align::Decimal {
                line_up(&mut rows, j);
            }
        }
        let widths = self.widths(&rows);
        if let Some(caption) = &self.caption {
            for line in wrapped(caption, WIDTH) {
                writeln!(f, "{line}")?;
            }
        }
        let headers: Vec<String> = self.columns.iter().map(|(name, _)| name.clone()).collect();
        self.write_line(f, &headers, &widths)?;
        let rules: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        self.write_line(f, &rules, &widths)?;
        for row in &rows {
            let parts: Vec<Vec<String>> = row
                .iter()
                .zip(&widths)
                .zip(&self.columns)
                .map(|((cell, &width), (_, align))| match align {
                    Align::Left => wrapped(cell, width),
                    _ => vec![cell.clone()],
                })
                .collect();
            let height = parts.iter().map(Vec::len).max().unwrap_or(0);
            for line in 0..height {
                let cells: Vec<String> = parts
                    .iter()
                    .map(|part| part.get(line).cloned().unwrap_or_default())
                    .collect();
                self.write_line(f, &cells, &widths)?;
            }
        }
        Ok(())
    }
}

impl Table {
    fn write_line(
        &self,
        f: &mut fmt::Formatter<'_>,
        cells: &[String],
        widths: &[usize],
    ) -> fmt::Result {
        let mut line = String::new();
        for (j, cell) in cells.iter().enumerate() {
            if j > 0 {
                line.push_str(GAP);
            }
            let padding = " ".repeat(widths[j].saturating_sub(length(cell)));
            match self.columns[j].1 {
                Align::Left => line.extend([cell.as_str(), &padding]),
                Align::Right | Align::Decimal => line.extend([padding.as_str(), cell]),
            }
        }
        writeln!(f, "{}", line.trim_end())
    }
}

/// Pads the cells of column `j` at their ends, so that right alignment puts the points in one place.
fn line_up(rows: &mut [Vec<String>], j: usize) {
    let tail = |cell: &str| -> usize {
        let whole = cell.find(['.', 'e', ' ']).unwrap_or(cell.len());
        length(&cell[whole..])
    };
    let numeric = |cell: &str| cell.contains(|c: char| c.is_ascii_digit());
    let longest = rows
        .iter()
        .filter(|row| numeric(&row[j]))
        .map(|row| tail(&row[j]))
        .max()
        .unwrap_or(0);
    for row in rows {
        if numeric(&row[j]) {
            let missing = longest - tail(&row[j]);
            row[j].push_str(&" ".repeat(missing));
        }
    }
}

/// `text` as lines that are indented by `indent` columns and fit [`WIDTH`], each with its line end.
pub fn paragraph(text: &str, indent: usize) -> String {
    let lines = wrapped(&printable(text), WIDTH.saturating_sub(indent));
    let margin = " ".repeat(indent);
    lines
        .iter()
        .map(|line| format!("{margin}{line}\n"))
        .collect()
}

/// `text` in lines of at most `width` characters, broken at spaces, and inside a word only where the
/// word alone is too long.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines = vec![String::new()];
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        let mut rest: Vec<char> = word.chars().collect();
        while let Some(line) = lines.last_mut() {
            let used = length(line);
            let room = if used == 0 {
                width
            } else {
                width.saturating_sub(used + 1)
            };
            if rest.len() <= room {
                if used > 0 {
                    line.push(' ');
                }
                line.extend(&rest);
                break;
            }
            if used == 0 {
                line.extend(rest.drain(..width));
            }
            lines.push(String::new());
        }
    }
    lines
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// Names come from files: control characters are shown, never sent to the terminal.
fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_line_up_at_the_point_and_words_at_the_left() {
        let mut table = Table::new(&[
            ("name", Align::Left),
            ("theta", Align::Right),
            ("value", Align::Decimal),
            ("unit", Align::Left),
        ])
        .caption("Friction of q1");
        table.row(["viscous", "13", "13.521", "N s/m"]);
        table.row(["coulomb_1", "14", "-2.5", "N"]);
        table.row(["slope_1", "15", "1300", "s/m"]);
        table.row(["slope_2", "16", "-"]);
        let expected = "\
Friction of q1
name       theta     value  unit
---------  -----  --------  -----
viscous       13    13.521  N s/m
coulomb_1     14    -2.5    N
slope_1       15  1300      s/m
slope_2       16         -
";
        assert_eq!(table.to_string(), expected);
    }

    #[test]
    fn words_are_wrapped_to_80_columns_and_numbers_are_not() {
        let mut table = Table::new(&[
            ("effect", Align::Left),
            ("reason", Align::Left),
            ("bic", Align::Decimal),
        ]);
        let reason = "the residual repeats with the angle of the motor and not with the joint, and is far above the floor";
        table.row(["cogging", reason, "12345.678"]);
        let text = table.to_string();
        assert!(
            text.lines().all(|line| line.chars().count() <= WIDTH),
            "{text}"
        );
        assert!(text.lines().count() > 3);
        let words: Vec<&str> = text.split_whitespace().collect();
        for word in reason.split(' ').chain(["12345.678"]) {
            assert!(words.contains(&word), "{word} is lost in\n{text}");
        }
    }

    #[test]
    fn a_word_longer_than_its_column_is_cut_and_kept_whole_in_sum() {
        assert_eq!(wrapped("ab cdefgh i", 3), ["ab", "cde", "fgh", "i"]);
        assert_eq!(wrapped("", 3), [""]);
    }

    #[test]
    fn control_characters_in_a_name_are_shown() {
        let mut table = Table::new(&[("channel", Align::Left)]);
        table.row(["q1\u{1b}[2J"]);
        assert!(table.to_string().contains("q1\\u{1b}[2J"));
    }
}
