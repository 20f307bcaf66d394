//! Where the table begins in a text: after a preamble, with a row of units, or right away.

use super::line::{FieldParting, Line};
use super::number;
use crate::log::columns;
use crate::log::section::{ColumnDelimiter, LogSection};
use crate::log::time::Instant;

/// The line that names the columns of a text log, and what it says of them.
pub(super) struct TextTable {
    /// Index of the line that names the columns.
    pub(super) at: usize,
    pub(super) parting: FieldParting,
    /// Whether the row after it holds no numbers.
    pub(super) second_row: bool,
    pub(super) units: Vec<String>,
    pub(super) notes: Vec<String>,
}

/// Whether a field is a number or a date, and so no name of a column.
pub(super) fn is_datum(field: &str) -> bool {
    number::parse(field.as_bytes()).is_some() || Instant::parse_iso(field.as_bytes()).is_some()
}

/// Whether fields are units: each is one, or nothing.
pub(super) fn are_units(fields: &[&str]) -> bool {
    let bare = |field: &&str| field.trim_matches(['"', ' ']).to_owned();
    let fields: Vec<String> = fields.iter().map(bare).collect();
    let nothing = |field: &String| matches!(field.as_str(), "" | "-" | "1" | "[]");
    let bracket = |field: &String| {
        let mut pairs = ["[]", "()", "<>"].into_iter().map(|pair| pair.split_at(1));
        pairs.any(|(open, close)| field.starts_with(open) && field.ends_with(close))
    };
    let unit = |field: &String| nothing(field) || bracket(field) || columns::is_unit(field);
    fields.iter().all(unit) && !fields.iter().all(nothing)
}

/// Finds the line that names the columns: the first one that rows of as many numbers follow, or a row of units and they.
pub(super) fn find(
    lines: &[Line<'_>],
    (first, comment): (usize, u8),
    wanted: &LogSection,
) -> TextTable {
    let sign = char::from(comment);
    let is_row = |line: &Line<'_>| {
        let text = line.text.trim();
        !text.is_empty() && !text.starts_with(sign)
    };
    let rows: Vec<usize> = (first..lines.len())
        .filter(|k| is_row(&lines[*k]))
        .collect();
    let mut notes = Vec::new();
    let mut parting = None;
    let mut from = 0;
    let separator = lines[first].text.trim().trim_matches('"');
    let separator = ["sep=", "SEP="]
        .iter()
        .find_map(|key| separator.strip_prefix(key));
    if let Some(sign) = separator.and_then(|sign| sign.bytes().next())
        && sign.is_ascii()
    {
        let runs = sign == b' ';
        parting = Some(FieldParting { sign, runs });
        from = 1;
    }
    let asked = wanted.header_line;
    let asked = asked.and_then(|number| rows.iter().position(|k| lines[*k].number >= number));
    // a name in quotes that goes on in the next line: its lines are no rows
    let goes_on = |line: usize| lines[line].text.matches('"').count() % 2 == 1;
    let table = |row: usize| Table::at(lines, &rows[row..], parting, wanted.delimiter);
    let plain = |row: usize| {
        let line = rows.get(row).map_or("", |k| &lines[*k].text);
        Table {
            parting: parting.unwrap_or_else(|| FieldParting::of(line, wanted.delimiter)),
            second: None,
        }
    };
    let (row, found) = match asked {
        Some(row) => (row, table(row).unwrap_or_else(|| plain(row))),
        None => {
            let headless = |row: usize| {
                let fields = plain(row).parting.split(&lines[rows[row]].text);
                row == from && fields.iter().all(|field| is_datum(field))
            };
            // a row of a preamble has others of its kind below it, and most rows are of another
            let lasts = |row: usize| {
                let parting = table(row).unwrap_or_else(|| plain(row)).parting;
                let width = |k: &usize| width(&parting.split(&lines[*k].text));
                let below = &rows[row..];
                let alike = below.iter().filter(|k| width(k) == width(&rows[row]));
                2 * alike.count() > below.len()
            };
            let begins = |row: &usize| headless(*row) || table(*row).is_some();
            let fits = |row: &usize| begins(row) && lasts(*row);
            let mut all = from..rows.len();
            let row = match rows.get(from).is_some_and(|k| goes_on(*k)) {
                true => None,
                false => all.clone().find(fits).or_else(|| all.find(begins)),
            };
            let row = row.unwrap_or(from).min(rows.len().saturating_sub(1));
            (row, table(row).unwrap_or_else(|| plain(row)))
        }
    };
    let at = rows.get(row).copied().unwrap_or(first);
    let number = lines[at].number;
    // what a name in quotes goes on with is no row of its own
    let second = found.second.filter(|_| !goes_on(at));
    if row > 0 || asked.is_some() {
        notes.push(format!(
            "the table begins at line {number}: {} passed over (`header_line` in [log] of the robot file says another)",
            match number - 1 {
                1 => "1 line before it is".to_owned(),
                more => format!("{more} lines before it are"),
            }
        ));
    }
    let mut units = Vec::new();
    if let Some(second) = second {
        let below = &lines[rows[row + 1]];
        let (fields, line) = (found.parting.split(&below.text), below.number);
        notes.push(match second {
            SecondRow::Units => format!("units are those of line {line}"),
            SecondRow::Words => format!("line {line} holds words and is passed over"),
        });
        if second == SecondRow::Units {
            units = fields.iter().map(|unit| (*unit).to_owned()).collect();
        }
    }
    TextTable {
        at,
        parting: found.parting,
        second_row: second.is_some(),
        units,
        notes,
    }
}

/// Fields of a row, but for an empty one behind a delimiter at its end.
fn width(fields: &[&str]) -> usize {
    fields.len() - usize::from(fields.len() > 1 && fields.last() == Some(&""))
}

/// What the row after the header holds, where it holds no numbers.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SecondRow {
    Units,
    Words,
}

struct Table {
    parting: FieldParting,
    second: Option<SecondRow>,
}

impl Table {
    /// The table whose names stand in the first of these rows; `None` where no rows of numbers follow it.
    fn at(
        lines: &[Line<'_>],
        rows: &[usize],
        parting: Option<FieldParting>,
        asked: ColumnDelimiter,
    ) -> Option<Self> {
        let line = |row: usize| Some(&*lines[*rows.get(row)?].text);
        let parting =
            parting.unwrap_or_else(|| FieldParting::of(line(0).unwrap_or_default(), asked));
        let fields = |row: usize| Some(parting.split(line(row)?));
        let names = fields(0)?;
        let n = width(&names);
        if names.iter().any(|name| is_datum(name)) {
            return None;
        }
        let as_wide = |fields: &[&str]| {
            [fields.len(), width(fields)]
                .iter()
                .any(|w| [n, names.len()].contains(w))
        };
        let is_number = |field: &&str| {
            // a decimal comma is reported later on, with the line
            let point = field.replace(',', ".");
            is_datum(field) || (parting.sign != b',' && number::parse(point.as_bytes()).is_some())
        };
        let data = |row: usize| {
            let Some(fields) = fields(row) else {
                return false;
            };
            let numbers = fields.iter().filter(|field| is_number(field)).count();
            as_wide(&fields) && numbers > 0 && 2 * numbers >= fields.len()
        };
        if data(1) {
            let second = None;
            return Some(Self { parting, second });
        }
        let below = fields(1)?;
        if !data(2) || !as_wide(&below) || below.iter().any(is_number) {
            return None;
        }
        let distinct = |fields: &[&str]| {
            let mut all: Vec<&str> = fields.iter().copied().filter(|f| !f.is_empty()).collect();
            all.sort_unstable();
            all.dedup();
            all.len()
        };
        let second = match are_units(&below) {
            true => SecondRow::Units,
            // names that stand under those of groups are the names
            false if distinct(&below) > distinct(&names) => return None,
            false => SecondRow::Words,
        };
        let second = Some(second);
        Some(Self { parting, second })
    }
}
