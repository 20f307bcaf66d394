//! Plain-text tables that fit a terminal: of 80 columns, or of as many as the format's width says (`{table:100}`).
//!
//! Numbers line up at the decimal point; a column of words is wrapped when the table would be too
//! wide. No colour: the text is the same in a file, a pipe and a terminal.

use std::fmt;

use super::words;
use cft_ident_core::number;
use cft_ident_logs::log::escape_whole;

/// Columns of a table or a text that is not for a window: it keeps to them where it can.
pub const WIDTH: usize = 80;
/// A column of words is not wrapped below this.
const NARROWEST: usize = 10;
/// Room between two columns: the most, and the least where the table would be too wide.
const GAPS: [usize; 2] = [2, 1];

/// Where the cells of a column line up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellAlignment {
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
    /// Empty for none.
    caption: String,
    columns: Vec<(String, CellAlignment)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these headers.
    pub fn new(columns: &[(&str, CellAlignment)]) -> Self {
        let columns = columns.iter();
        Table {
            caption: String::new(),
            columns: columns
                .map(|(name, align)| (escape_whole(name), *align))
                .collect(),
            rows: Vec::new(),
        }
    }

    /// A line above the headers.
    pub fn caption(mut self, text: &str) -> Self {
        self.caption = escape_whole(text);
        self
    }

    /// Adds a row; missing cells are empty, surplus cells are dropped.
    pub fn row<S: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = S>) {
        let cells = cells.into_iter().take(self.columns.len());
        let mut row: Vec<String> = cells.map(|cell| escape_whole(cell.as_ref())).collect();
        row.resize(self.columns.len(), String::new());
        self.rows.push(row);
    }

    /// Caption, names of the columns and rows, for another way to show them.
    pub(super) fn parts(&self) -> (&str, Vec<&str>, &[Vec<String>]) {
        let names = self.columns.iter().map(|(name, _)| name.as_str());
        (&self.caption, names.collect(), &self.rows)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Widths of the columns and the gap between them, after words were narrowed to fit [`WIDTH`].
    fn widths(&self, rows: &[Vec<String>], room: usize) -> (Vec<usize>, usize) {
        let natural = |(j, (name, _)): (usize, &(String, CellAlignment))| {
            let cells = rows.iter().map(|row| length(&row[j]));
            cells.fold(length(name), usize::max)
        };
        let natural: Vec<usize> = self.columns.iter().enumerate().map(natural).collect();
        let [wide, narrow] = GAPS.map(|gap| (self.narrowed(natural.clone(), gap, room), gap));
        if fits(&wide.0, wide.1, room) {
            wide
        } else {
            narrow
        }
    }

    /// Columns of words, narrowed until all fit or none can give more.
    fn narrowed(&self, mut widths: Vec<usize>, gap: usize, room: usize) -> Vec<usize> {
        while !fits(&widths, gap, room) {
            // The widest column of words gives first, down to the longest of them.
            let widest = (0..widths.len())
                .filter(|&j| self.columns[j].1 == CellAlignment::Left)
                .filter(|&j| widths[j] > NARROWEST.max(length(&self.columns[j].0)))
                .max_by_key(|&j| widths[j]);
            let Some(widest) = widest else { break };
            widths[widest] -= 1;
        }
        widths
    }

    fn write_line(
        &self,
        f: &mut fmt::Formatter<'_>,
        cells: &[String],
        (widths, gap): (&[usize], usize),
    ) -> fmt::Result {
        let mut line = String::new();
        for (j, cell) in cells.iter().enumerate() {
            if j > 0 {
                line.push_str(&" ".repeat(gap));
            }
            let padding = " ".repeat(widths[j].saturating_sub(length(cell)));
            match self.columns[j].1 {
                CellAlignment::Left => line.extend([cell.as_str(), &padding]),
                CellAlignment::Right | CellAlignment::Decimal => {
                    line.extend([padding.as_str(), cell])
                }
            }
        }
        writeln!(f, "{}", line.trim_end())
    }
}

fn fits(widths: &[usize], gap: usize, room: usize) -> bool {
    widths.iter().sum::<usize>() + gap * widths.len().saturating_sub(1) <= room
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = self.rows.clone();
        for (j, (_, align)) in self.columns.iter().enumerate() {
            if *align == CellAlignment::Decimal {
                line_up(&mut rows, j);
            }
        }
        let window = f.width().unwrap_or(WIDTH);
        let (widths, gap) = self.widths(&rows, window);
        let room = (widths.as_slice(), gap);
        if !self.caption.is_empty() {
            for line in flowed(&self.caption, window) {
                writeln!(f, "{line}")?;
            }
        }
        let headers: Vec<String> = self.columns.iter().map(|(name, _)| name.clone()).collect();
        self.write_line(f, &headers, room)?;
        let rules: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        self.write_line(f, &rules, room)?;
        for row in &rows {
            let cells = row.iter().zip(&widths).zip(&self.columns);
            let lines = cells.map(|((cell, &width), (_, align))| match align {
                CellAlignment::Left => wrapped(cell, width),
                _ => vec![cell.clone()],
            });
            let lines: Vec<Vec<String>> = lines.collect();
            for k in 0..lines.iter().map(Vec::len).max().unwrap_or(0) {
                let cell = |lines: &Vec<String>| lines.get(k).cloned().unwrap_or_default();
                self.write_line(f, &lines.iter().map(cell).collect::<Vec<_>>(), room)?;
            }
        }
        Ok(())
    }
}

/// A table that is made column by column, with a row for each item.
pub(super) struct Columns<R> {
    items: Vec<R>,
    table: Table,
}

impl<R: Copy> Columns<R> {
    pub fn new(caption: &str, items: impl IntoIterator<Item = R>) -> Self {
        let items: Vec<R> = items.into_iter().collect();
        let mut table = Table::new(&[]).caption(caption);
        table.rows.resize(items.len(), Vec::new());
        Columns { items, table }
    }

    pub fn column<S: AsRef<str>>(
        mut self,
        align: CellAlignment,
        name: &str,
        cell: impl Fn(R) -> S,
    ) -> Self {
        self.table.columns.push((escape_whole(name), align));
        for (row, item) in self.table.rows.iter_mut().zip(&self.items) {
            row.push(escape_whole(cell(*item).as_ref()));
        }
        self
    }

    pub fn words<S: AsRef<str>>(self, name: &str, cell: impl Fn(R) -> S) -> Self {
        self.column(CellAlignment::Left, name, cell)
    }

    pub fn numbers<S: AsRef<str>>(self, name: &str, cell: impl Fn(R) -> S) -> Self {
        self.column(CellAlignment::Decimal, name, cell)
    }

    /// Two columns of numbers whose cells are made together.
    pub fn pair(self, [first, second]: [&str; 2], cells: impl Fn(R) -> (String, String)) -> Self {
        let column = self.numbers(first, |item| cells(item).0);
        column.numbers(second, |item| cells(item).1)
    }

    /// A value and its standard deviation where they are known.
    pub fn estimates<V: Into<Option<f64>>, D: Into<Option<f64>>>(
        self,
        names: [&str; 2],
        estimate: impl Fn(R) -> (V, D),
    ) -> Self {
        self.pair(names, |item| {
            let (value, std) = estimate(item);
            let known = |x: Option<f64>| x.unwrap_or(f64::NAN);
            number::value_and_std(known(value.into()), known(std.into()))
        })
    }

    /// Numbers with so many digits, where they are known.
    pub fn digits<V>(self, name: &str, digits: usize, value: impl Fn(R) -> V) -> Self
    where
        V: Into<Option<f64>>,
    {
        self.numbers(name, |item| words::significant(value(item).into(), digits))
    }

    /// Fractions as percent, where they are known.
    pub fn percent<V: Into<Option<f64>>>(self, name: &str, fraction: impl Fn(R) -> V) -> Self {
        self.numbers(name, |item| words::percent(fraction(item).into()))
    }

    /// Columns that stand there where they are wanted.
    pub fn when(self, wanted: bool, add: impl FnOnce(Self) -> Self) -> Self {
        if wanted { add(self) } else { self }
    }
}

impl<R> From<Columns<R>> for Table {
    fn from(columns: Columns<R>) -> Self {
        columns.table
    }
}

/// Pads the cells of column `j` at their ends, so that right alignment puts the points in one place.
fn line_up(rows: &mut [Vec<String>], j: usize) {
    let tail = |cell: &str| -> usize {
        let whole = cell.find(['.', 'e', ' ']).unwrap_or(cell.len());
        length(&cell[whole..])
    };
    let numeric = |cell: &str| cell.contains(|c: char| c.is_ascii_digit());
    let mut cells: Vec<&mut String> = rows.iter_mut().map(|row| &mut row[j]).collect();
    cells.retain(|cell| numeric(cell));
    let longest = cells.iter().map(|cell| tail(cell)).max().unwrap_or(0);
    for cell in cells {
        let missing = longest - tail(cell);
        cell.push_str(&" ".repeat(missing));
    }
}

/// `head` and `text` as lines that fit [`WIDTH`], those after the first indented by `indent` columns,
/// each with its line end.
pub fn hanging(head: &str, text: &str, indent: usize) -> String {
    hanging_in(WIDTH, head, text, indent)
}

/// The same in `width` columns.
pub(super) fn hanging_in(width: usize, head: &str, text: &str, indent: usize) -> String {
    let room = width.saturating_sub(indent.max(length(head)));
    let lines = flowed(&escape_whole(text), room);
    head.to_owned() + &lines.join(&format!("\n{}", " ".repeat(indent))) + "\n"
}

/// `text` for a window: a line that is too long goes on below, further in.
pub fn folded(text: &str, width: usize) -> String {
    let fold = |line: &str| {
        if length(line) <= width {
            return format!("{line}\n");
        }
        let words = line.trim_start();
        let margin = length(line) - length(words);
        hanging_in(width, &" ".repeat(margin), words, margin + 2)
    };
    text.lines().map(fold).collect()
}

/// A space at which no line ends; it is shown as a common one.
const UNBROKEN: char = '\u{a0}';

/// `text` as one word, which the end of a line does not part.
pub(crate) fn unbroken(text: &str) -> String {
    text.replace(' ', UNBROKEN.encode_utf8(&mut [0; 2]))
}

/// Whether no line ends between these words: a number and its unit, or the sides of a sign between numbers.
fn belong_together(before: &str, after: &str) -> bool {
    const UNITS: [&str; 16] = [
        "%", "N", "Nm", "kg", "m", "s", "ms", "rad", "deg", "V", "A", "Hz", "kHz", "1", "2",
        "speed",
    ];
    let ended = |word: &str| word.ends_with([',', ';', ':', ')']);
    let is_unit = |word: &str| {
        let word = word.trim_end_matches([',', ';', ':', '.', ')']);
        let named = !word.starts_with(|c: char| c.is_ascii_digit()) || word.starts_with("1/");
        named && word.split(['/', '^']).all(|part| UNITS.contains(&part))
    };
    let is_number = |word: &str| {
        let word = word.trim_start_matches(['(', '-', '+']);
        word.starts_with(|c: char| c.is_ascii_digit()) && !ended(word)
    };
    let is_sign = |word: &str| matches!(word, "±" | "=");
    is_sign(before)
        || is_sign(after)
        || is_unit(after) && (is_number(before) || is_unit(before) && !ended(before))
}

/// Words one after the other, with a space between those that `may` be joined.
pub(super) fn joined(
    words: impl IntoIterator<Item = String>,
    may: impl Fn(&str, &str) -> bool,
) -> Vec<String> {
    let mut joined: Vec<String> = Vec::new();
    for word in words {
        match joined.last_mut() {
            Some(before) if may(before, &word) => *before += &format!(" {word}"),
            _ => joined.push(word),
        }
    }
    joined
}

/// `text` in lines of at most `width` characters; a word that alone is longer stays whole, for it may be a path.
fn flowed(text: &str, width: usize) -> Vec<String> {
    let fits = |line: &str, word: &str| length(line) + 1 + length(word) <= width;
    let words = text.split(' ').filter(|word| !word.is_empty());
    let groups = joined(words.map(str::to_owned), |group, word| {
        let last = group.rsplit(' ').next().unwrap_or(group);
        belong_together(last, word) && fits(group, word)
    });
    let mut lines = joined(groups, fits);
    if lines.is_empty() {
        lines.push(String::new());
    }
    let lines = lines.iter();
    lines.map(|line| line.replace(UNBROKEN, " ")).collect()
}

/// The same for the cell of a table: a longer word is cut, after a part of it where one ends.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    for line in flowed(text, width) {
        let mut rest = line.as_str();
        while let Some((end, _)) = rest.char_indices().nth(width.max(1)) {
            let part = rest[..end].rfind(['_', '/', '.', '-']).map(|at| at + 1);
            let (line, after) = rest.split_at(part.unwrap_or(end));
            lines.push(line.to_owned());
            rest = after;
        }
        lines.push(rest.to_owned());
    }
    lines
}

fn length(text: &str) -> usize {
    text.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_line_up_at_the_point_and_words_at_the_left() {
        let mut table = Table::new(&[
            ("name", CellAlignment::Left),
            ("theta", CellAlignment::Right),
            ("value", CellAlignment::Decimal),
            ("unit", CellAlignment::Left),
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
        let reason = "the residual repeats with the angle of the motor and not with the joint, and is far above the floor";
        let table = Columns::new("", [()])
            .words("effect", |()| "cogging")
            .words("reason", |()| reason)
            .numbers("bic", |()| "12345.678");
        let text = Table::from(table).to_string();
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
        assert_eq!(wrapped("tau_elbow_joint", 11), ["tau_elbow_", "joint"]);
    }

    #[test]
    fn the_end_of_a_line_parts_no_number_from_its_unit() {
        let text =
            "sin = 1.153 ± 0.023 N, viscous 9.00 ± 0.01 Nm s/rad, q1 13.2 % (2.99 Nm), 39.00 s";
        for width in 30..60 {
            let lines = flowed(text, width);
            assert_eq!(lines.join(" "), text);
            for line in &lines {
                assert!(line.chars().count() <= width);
                let start = line.split(' ').next().unwrap();
                assert!(
                    !["=", "±", "N,", "%", "Nm", "Nm),", "s/rad,", "s"].contains(&start),
                    "{lines:?}"
                );
                assert!(!line.ends_with(['=', '±']), "{lines:?}");
            }
        }
    }

    #[test]
    fn numbers_that_do_not_fit_move_together_before_they_leave_the_terminal() {
        let mut table = Table::new(&[("a", CellAlignment::Right); 8]);
        table.row(["123456789"; 8]);
        let text = table.to_string();
        assert!(text.lines().all(|line| line.len() == 79), "{text}");
    }

    #[test]
    fn what_is_unbroken_stays_in_one_line_with_common_spaces() {
        let list = [unbroken("q1 1.04 %"), unbroken("q2 0.134 %")].join(", ");
        assert_eq!(flowed(&list, 15), ["q1 1.04 %,", "q2 0.134 %"]);
    }

    #[test]
    fn later_lines_of_a_hanging_text_stand_below_it() {
        let described = hanging("  1. ", &"word ".repeat(20), 5);
        let lines: Vec<&str> = described.lines().collect();
        assert_eq!(lines.len(), 2);
        assert!(lines[0].starts_with("  1. word") && lines[1].starts_with("     word"));
        assert!(lines.iter().all(|line| line.len() <= WIDTH));
    }

    #[test]
    fn a_message_is_folded_and_a_path_in_it_stays_whole() {
        let path = format!("/{}/log.csv", "folder".repeat(14));
        let text = format!("error: no data\nhint: {} {path}\n", "look ".repeat(20));
        let described = folded(&text, WIDTH);
        let lines: Vec<&str> = described.lines().collect();
        assert_eq!(lines[0], "error: no data");
        assert!(lines[1].starts_with("hint: look") && lines[1].len() <= WIDTH);
        assert!(lines[2].starts_with("  look"));
        assert_eq!(lines[3].trim_start(), path);
    }

    #[test]
    fn control_characters_in_a_name_are_shown() {
        let mut table = Table::new(&[("channel", CellAlignment::Left)]);
        table.row(["q1\u{1b}[2J"]);
        assert!(table.to_string().contains("q1\\u{1b}[2J"));
    }
}
