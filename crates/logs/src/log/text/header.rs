//! Names that stand in several lines above the numbers, as pandas, Simulink, LabVIEW and TwinCAT write them.

use super::line::{FieldParting, Line};
use super::number;
use super::table::{are_units, is_datum};
use crate::log::section::ColumnDelimiter;

/// What the lines above the numbers say of the columns.
#[derive(Debug, Default, PartialEq)]
pub(super) struct HeaderLines {
    pub(super) names: Vec<String>,
    pub(super) units: Vec<String>,
    /// Index of the first line of numbers, and of the line that names the columns.
    pub(super) data: usize,
    pub(super) line: usize,
    /// Columns of times, one for each channel.
    pub(super) clocks: Vec<usize>,
    pub(super) note: String,
}

/// Fewest rows of numbers that show where they begin.
const MIN_ROWS: usize = 3;
/// Lines above the numbers that are looked at.
const MAX_LINES: usize = 32;

/// Whether a field is a number, with a decimal comma where those part no fields.
fn is_number(field: &str, parting: FieldParting) -> bool {
    let point = field.replace(',', ".");
    is_datum(field) || (parting.sign != b',' && number::parse(point.as_bytes()).is_some())
}

fn filled(fields: &[&str]) -> usize {
    fields.iter().filter(|field| !field.is_empty()).count()
}

/// Fields of a row without the empty ones behind delimiters at its end.
fn width(fields: &[&str]) -> usize {
    let last = fields.iter().rposition(|field| !field.is_empty());
    last.map_or(0, |last| last + 1)
}

fn is_key(field: &str) -> bool {
    let word = field.trim_matches(['"', ' ', ':']).to_lowercase();
    let known = "type unit units interp interpolation datatype data-type class description blockpath sampletime";
    known.split(' ').any(|one| one == word)
}

fn is_unit_key(field: &str) -> bool {
    let word = field.trim_matches(['"', ' ', ':']).to_lowercase();
    matches!(&*word, "unit" | "units" | "y_unit_label")
}

/// Whether fields are a word and its value, over and over: `Unit, deg, Unit, deg`.
fn pairs<'f>(fields: &[&'f str]) -> Option<(&'f str, Vec<&'f str>)> {
    let key = *fields.first().filter(|key| !key.is_empty())?;
    let even = fields.len() - fields.len() % 2;
    let alike = fields[..even].chunks(2).all(|pair| pair[0] == key);
    let values = || fields[..even].chunks(2).map(|pair| pair[1]);
    (even >= 4 && alike && !is_datum(key)).then(|| (key, values().collect()))
}

impl HeaderLines {
    /// The names above the last rows of numbers, where they stand in a form that takes several lines; `plain` is the
    /// line that was taken for them as the first one that rows of numbers follow.
    pub(super) fn find(
        lines: &[Line<'_>],
        rows: &[usize],
        plain: usize,
        asked: ColumnDelimiter,
    ) -> Option<Self> {
        let last = &lines[*rows.last()?].text;
        let parting = FieldParting::of(last, asked);
        let fields = |row: usize| parting.split(&lines[rows[row]].text);
        let of_numbers = |row: usize| {
            let fields = fields(row);
            let numbers = fields
                .iter()
                .filter(|field| is_number(field, parting))
                .count();
            numbers > 0 && 2 * numbers >= filled(&fields) && pairs(&fields).is_none()
        };
        let mut data = rows.len();
        while data > 0 && of_numbers(data - 1) {
            data -= 1;
        }
        if data == 0 || rows.len() - data < MIN_ROWS {
            return None;
        }
        let first = fields(data);
        let wide = (data..rows.len().min(data + MIN_ROWS)).map(|row| width(&fields(row)));
        let wide = wide.max().unwrap_or(0);
        // an empty field at the end of a row of names is no column; LabVIEW names one for remarks
        let above = |row: &usize| {
            let own = fields(*row);
            (wide..=wide + 1).contains(&own.len()) || (wide..=wide + 1).contains(&width(&own))
        };
        let from = data.saturating_sub(MAX_LINES);
        let block: Vec<usize> = (from..data).rev().take_while(above).collect();
        let mut out = Self {
            data: rows[data],
            ..Self::default()
        };
        let found = out.of_pairs(&block, &fields)
            || out.of_keys(&block, &fields, parting)
            || out.of_levels(&block, &fields, parting, &first)
            || out.behind_a_preamble(&block, &fields, parting, rows, plain);
        if !found {
            return None;
        }
        out.line = rows[block[0]];
        out.names.truncate(wide);
        out.note = match out.note.is_empty() {
            true => format!(
                "the numbers begin at line {}, below {} lines of names",
                lines[out.data].number,
                block.len()
            ),
            false => out.note,
        };
        Some(out)
    }

    /// TwinCAT: a word and its value for each channel, and a column of times beside each.
    fn of_pairs<'f>(&mut self, block: &[usize], fields: &dyn Fn(usize) -> Vec<&'f str>) -> bool {
        let rows: Vec<(&str, Vec<&str>)> = block
            .iter()
            .filter_map(|row| pairs(&fields(*row)))
            .collect();
        let value = |keys: &[&str]| {
            keys.iter().find_map(|known| {
                let is = |key: &str| known.eq_ignore_ascii_case(key);
                let found = rows
                    .iter()
                    .find(|(key, of)| is(key) && of.iter().all(|v| !v.is_empty()));
                found.map(|(_, values)| values.clone())
            })
        };
        let Some(names) = value(&["Name", "SymbolName", "Channel"]).filter(|_| rows.len() > 1)
        else {
            return false;
        };
        let units = value(&["Unit", "Units"]);
        for (k, name) in names.iter().enumerate() {
            let unit = units
                .as_ref()
                .and_then(|units| units.get(k))
                .copied()
                .unwrap_or_default();
            self.clocks.push(self.names.len());
            let clock = if k == 0 {
                "time".to_owned()
            } else {
                format!("clock_{}", k + 1)
            };
            self.names.extend([clock, (*name).to_owned()]);
            self.units.extend([String::new(), unit.to_owned()]);
        }
        // TwinCAT counts milliseconds
        let sampled = value(&["SampleTime[ms]"]);
        if sampled.is_some() {
            self.units[0] = "ms".to_owned();
        }
        true
    }

    /// Simulink: rows that begin with what they are, `Type:`, `Unit:`.
    fn of_keys<'f>(
        &mut self,
        block: &[usize],
        fields: &dyn Fn(usize) -> Vec<&'f str>,
        parting: FieldParting,
    ) -> bool {
        let keyed = block
            .iter()
            .take_while(|row| is_key(fields(**row).first().unwrap_or(&"")))
            .count();
        let Some(names) = block
            .get(keyed)
            .filter(|_| keyed > 0)
            .map(|row| fields(*row))
        else {
            return false;
        };
        if names.iter().any(|name| is_number(name, parting)) {
            return false;
        }
        self.names = names.iter().map(|name| (*name).to_owned()).collect();
        for row in &block[..keyed] {
            let own = fields(*row);
            if is_unit_key(own[0]) {
                let units = own.iter().skip(1).map(|unit| (*unit).to_owned());
                self.units = std::iter::once(String::new()).chain(units).collect();
            }
        }
        true
    }

    /// pandas: levels of names above each other, and the name of the index in a row of its own.
    fn of_levels<'f>(
        &mut self,
        block: &[usize],
        fields: &dyn Fn(usize) -> Vec<&'f str>,
        parting: FieldParting,
        first: &[&str],
    ) -> bool {
        let mut levels: Vec<Vec<&str>> = block.iter().map(|row| fields(*row)).collect();
        levels.reverse();
        let named = |level: &Vec<&str>| !level.iter().any(|name| is_number(name, parting));
        let index = match levels.last() {
            Some(last) if filled(last) == 1 && !last[0].is_empty() && levels.len() > 1 => {
                levels.pop()
            }
            _ => None,
        };
        let unit_row = levels.pop_if(|last| are_units(last) && index.is_none());
        // the lines right above the numbers that are as wide and hold words alone
        let from = levels
            .iter()
            .rposition(|level| !named(level) || filled(level) < 2);
        let levels = &levels[from.map_or(0, |from| from + 1)..];
        let twice = |level: &Vec<&str>| {
            let mut all: Vec<&str> = level
                .iter()
                .copied()
                .filter(|name| !name.is_empty())
                .collect();
            let count = all.len();
            all.sort_unstable();
            all.dedup();
            all.len() < count
        };
        let grouped = levels.len() > 1 && levels[..levels.len() - 1].iter().any(twice);
        let several = levels.len() > 1 && levels.last().is_some_and(twice);
        if levels.is_empty() || !(index.is_some() || (grouped && several)) {
            return false;
        }
        let name = |at: usize| {
            let parts = levels.iter().filter_map(|level| level.get(at));
            let parts: Vec<&str> = parts
                .copied()
                .filter(|part| !part.is_empty() && !part.starts_with("Unnamed:"))
                .collect();
            parts.join("_")
        };
        self.names = (0..first.len()).map(name).collect();
        if let (Some(index), Some(first)) = (index, self.names.first_mut()) {
            *first = index[0].to_owned();
        }
        if let Some(units) = unit_row {
            self.units = units.iter().map(|unit| (*unit).to_owned()).collect();
        }
        true
    }

    /// LabVIEW: tables of remarks before the one of numbers, whose names stand right above it.
    fn behind_a_preamble<'f>(
        &mut self,
        block: &[usize],
        fields: &dyn Fn(usize) -> Vec<&'f str>,
        parting: FieldParting,
        rows: &[usize],
        plain: usize,
    ) -> bool {
        let Some((names, rest)) = block.split_first() else {
            return false;
        };
        // the plain way found another line, above remarks that are no rows of numbers
        let found = rows.iter().position(|row| *row == plain).unwrap_or(0);
        let mut header = *names;
        let unit_row = are_units(&fields(header)) && !rest.is_empty();
        if unit_row {
            header = rest[0];
        }
        if found >= header {
            return false;
        }
        let own = fields(header);
        let words =
            own.iter().all(|name| !is_number(name, parting)) && filled(&own) + 1 >= own.len();
        if !words || filled(&own) < 2 {
            return false;
        }
        self.names = own.iter().map(|name| (*name).to_owned()).collect();
        if unit_row {
            self.units = fields(*names)
                .iter()
                .map(|unit| (*unit).to_owned())
                .collect();
        }
        for row in rest {
            let own = fields(*row);
            if own.first().is_some_and(|key| is_unit_key(key)) {
                self.units = own.iter().map(|unit| (*unit).to_owned()).collect();
                self.units[0].clear();
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::line::lines_of;
    use super::*;

    fn found(text: &str, plain: usize) -> Option<HeaderLines> {
        let lines = lines_of(text.as_bytes());
        let rows: Vec<usize> = (0..lines.len())
            .filter(|k| !lines[*k].text.trim().is_empty())
            .collect();
        HeaderLines::find(&lines, &rows, plain, ColumnDelimiter::Auto)
    }

    const ROWS: &str = "0,1.5,2.5\n0.1,1.6,2.6\n0.2,1.7,2.7\n";

    #[test]
    fn names_in_several_lines_are_put_together() {
        for (header, names, units) in [
            (",q,tau\n,a,a\nt,,\n", "t q_a tau_a", ""),
            (",q,q\n,a,b\nt,,\n", "t q_a q_b", ""),
            (
                "time,q:1,tau:1\nType:,double,double\nUnit:,rad,N*m\n",
                "time q:1 tau:1",
                " rad N*m",
            ),
        ] {
            let headers = found(&format!("{header}{ROWS}"), 0).unwrap();
            assert_eq!(headers.names.join(" "), names);
            assert_eq!(headers.units.join(" "), units);
        }
        assert_eq!(found(&format!("t,q,tau\n{ROWS}"), 0), None);
        assert_eq!(found(&format!("t,q,tau\ns,rad,Nm\n{ROWS}"), 0), None);
    }

    #[test]
    fn a_word_and_its_value_for_each_channel_give_names_units_and_clocks() {
        let text = "File\tx\n\nName\tp1\tName\tt1\nUnit\tdeg\tUnit\tNm\nSampleTime[ms]\t10\tSampleTime[ms]\t10\n\n\
                    0\t1,5\t0\t2,5\n10\t1,6\t10\t2,6\n20\t1,7\t20\t2,7\n";
        let headers = found(text, 0).unwrap();
        assert_eq!(headers.names, ["time", "p1", "clock_2", "t1"]);
        assert_eq!(headers.units, ["ms", "deg", "", "Nm"]);
        assert_eq!(headers.clocks, [0, 2]);
    }
}
