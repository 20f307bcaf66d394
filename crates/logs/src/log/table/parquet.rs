//! Parquet files: columns of numbers and of lists of numbers, and the datasets of LeRobot, whose description names
//! what the lists hold.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Write};
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical};
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::record::reader::RowIter;
use parquet::record::{Field, Row};
use parquet::schema::types::Type;

use super::described;
use super::lines::{COLUMNS, Table, TableText, damaged, number, unusable};

/// A column of the file.
struct Column {
    name: String,
    /// What the first row that is whole has in it: a row of it has as many numbers, and where it has none, none.
    like: Field,
    /// How many numbers that are.
    width: usize,
}

struct ParquetTable {
    columns: Vec<Column>,
    rows: RowIter<'static>,
    waiting: VecDeque<PathBuf>,
    number: u64,
    clock: Option<EpisodeClock>,
}

/// Times of the frames of a dataset, from the beginning of each episode.
struct EpisodeClock {
    fps: f64,
    /// Place of `frame_index` among the columns.
    frame: usize,
}

pub(super) fn open(path: &Path, more: &[PathBuf]) -> io::Result<TableText> {
    let mut notes = Vec::new();
    let (rows, nanoseconds) = whole(|| rows_of(path, &mut notes))?;
    let fields = whole_fields(path)?;
    let described = described(path);
    let mut columns = Vec::new();
    let mut names = Vec::new();
    for ((name, like), nanoseconds) in fields.into_iter().zip(nanoseconds) {
        let mut own = Vec::new();
        match nanoseconds {
            true => own.push(" [ns]".to_owned()),
            false => leaves(&like, String::new(), &mut own),
        }
        let listed = described.as_ref().and_then(|all| list_of(all, &name));
        let listed = listed.filter(|listed| listed.len() == own.len() && own.len() > 1);
        match listed {
            Some(listed) => names.extend(listed.iter().map(|of| format!("{name}.{of}"))),
            None => {
                // instants in the index of pandas, where it has no name of its own
                let dated =
                    name.starts_with("__index_level_") && own.iter().all(|of| of.ends_with(']'));
                let name = if dated { "time" } else { &name };
                names.extend(own.iter().map(|of| format!("{name}{of}")));
            }
        }
        columns.push(Column {
            name,
            like,
            width: own.len(),
        });
        if names.len() > COLUMNS {
            return Err(unusable(format!("more than {COLUMNS} columns")));
        }
    }
    let clock = described
        .as_ref()
        .and_then(|all| EpisodeClock::of(all, &columns));
    if clock.is_some() {
        names.insert(0, "time [s]".to_owned());
        notes.push("times are frame_index over fps".to_owned());
    }
    let table = ParquetTable {
        columns,
        rows,
        waiting: more.iter().cloned().collect(),
        number: 0,
        clock,
    };
    Ok(TableText::new(&names, table, notes))
}

fn broken(error: parquet::errors::ParquetError) -> io::Error {
    damaged(&format!("the Parquet file is cut off or damaged ({error})"))
}

/// What a call into the crate gives: a damaged file must not end the program, whatever the crate makes of it.
fn whole<T>(call: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    let ended = std::panic::catch_unwind(AssertUnwindSafe(call));
    ended.unwrap_or_else(|_| Err(damaged("the Parquet file is damaged")))
}

/// The rows of the columns of a file that hold numbers, and which of them are nanoseconds.
fn rows_of(path: &Path, notes: &mut Vec<String>) -> io::Result<(RowIter<'static>, Vec<bool>)> {
    let reader = SerializedFileReader::new(File::open(path)?).map_err(broken)?;
    let about = reader.metadata().file_metadata();
    let root = about.schema_descr().root_schema();
    let (kept, left): (Vec<_>, Vec<_>) = (root.get_fields().iter().cloned()).partition(is_numeric);
    if kept.is_empty() {
        return Err(unusable(
            "no column of the Parquet file holds numbers".to_owned(),
        ));
    }
    if !left.is_empty() {
        let names: Vec<&str> = left.iter().map(|field| field.name()).collect();
        notes.push(format!(
            "columns without numbers are left out: {}",
            names.join(", ")
        ));
    }
    let nanoseconds = kept.iter().map(is_nanoseconds).collect();
    let wanted = Type::group_type_builder(root.name())
        .with_fields(kept)
        .build()
        .map_err(broken)?;
    let rows = RowIter::from_file_into(Box::new(reader)).project(Some(wanted));
    Ok((rows.map_err(broken)?, nanoseconds))
}

fn is_nanoseconds(field: &Arc<Type>) -> bool {
    let kind = field.get_basic_info().logical_type_ref();
    matches!(kind, Some(LogicalType::Timestamp(time)) if matches!(time.unit, TimeUnit::NANOS))
}

/// The columns of a file, each with its field of the first row that lacks nothing in it, or as much as any row has.
fn whole_fields(path: &Path) -> io::Result<Vec<(String, Field)>> {
    let (mut rows, _) = whole(|| rows_of(path, &mut Vec::new()))?;
    let mut found: Vec<(String, Field)> = Vec::new();
    while found.is_empty() || !found.iter().all(|(_, field)| is_whole(field)) {
        let Some(row) = whole(|| rows.next().transpose().map_err(broken))? else {
            break;
        };
        if found.is_empty() {
            found = row.into_columns();
            continue;
        }
        for ((_, found), (_, field)) in found.iter_mut().zip(row.get_column_iter()) {
            let count = |field: &Field| {
                let mut all = Vec::new();
                leaves(field, String::new(), &mut all);
                all.len()
            };
            if !is_whole(found) && (is_whole(field) || count(field) > count(found)) {
                *found = field.clone();
            }
        }
    }
    Ok(found)
}

/// Whether nothing in a field is null, and no list is empty.
fn is_whole(field: &Field) -> bool {
    match field {
        Field::Null => false,
        Field::Group(row) => row.get_column_iter().all(|(_, field)| is_whole(field)),
        Field::ListInternal(list) => {
            !list.elements().is_empty() && list.elements().iter().all(is_whole)
        }
        _ => true,
    }
}

/// Whether all that a column holds are numbers.
fn is_numeric(field: &Arc<Type>) -> bool {
    if !field.is_primitive() {
        return !field.get_fields().is_empty() && field.get_fields().iter().all(is_numeric);
    }
    let plain = match field.get_basic_info().converted_type() {
        ConvertedType::NONE
        | ConvertedType::INT_8
        | ConvertedType::INT_16
        | ConvertedType::INT_32
        | ConvertedType::UINT_8
        | ConvertedType::UINT_16
        | ConvertedType::UINT_32 => true,
        ConvertedType::INT_64
        | ConvertedType::UINT_64
        | ConvertedType::TIMESTAMP_MILLIS
        | ConvertedType::TIMESTAMP_MICROS => field.get_physical_type() == Physical::INT64,
        _ => false,
    };
    let number = matches!(
        field.get_physical_type(),
        Physical::BOOLEAN | Physical::INT32 | Physical::INT64 | Physical::FLOAT | Physical::DOUBLE
    );
    plain && number
}

/// Appends what distinguishes each number of a field from the others.
fn leaves(field: &Field, name: String, out: &mut Vec<String>) {
    match field {
        Field::Group(row) => {
            for (own, field) in row.get_column_iter() {
                leaves(field, format!("{name}.{own}"), out);
            }
        }
        Field::ListInternal(list) => {
            for (k, field) in list.elements().iter().enumerate() {
                leaves(field, format!("{name}_{k}"), out);
            }
        }
        Field::TimestampMillis(_) => out.push(format!("{name} [ms]")),
        Field::TimestampMicros(_) => out.push(format!("{name} [us]")),
        _ => out.push(name),
    }
}

/// Appends the numbers of a field, a comma behind each, nothing where it lacks what `like` has; how many they are.
fn numbers(field: &Field, like: &Field, line: &mut Vec<u8>) -> io::Result<usize> {
    match (field, like) {
        (Field::Group(row), Field::Group(like)) => {
            let parts = row.get_column_iter().zip(like.get_column_iter());
            return (parts.map(|((_, field), (_, like))| numbers(field, like, line))).sum();
        }
        (Field::ListInternal(list), Field::ListInternal(like)) if !list.elements().is_empty() => {
            let likes = like
                .elements()
                .iter()
                .chain(std::iter::repeat(&Field::Null));
            let parts = list.elements().iter().zip(likes);
            return parts.map(|(field, like)| numbers(field, like, line)).sum();
        }
        (Field::Null | Field::ListInternal(_), Field::Group(_) | Field::ListInternal(_)) => {
            let mut lacking = Vec::new();
            leaves(like, String::new(), &mut lacking);
            line.extend(std::iter::repeat_n(b',', lacking.len()));
            return Ok(lacking.len());
        }
        (Field::Null, _) => {}
        (Field::Bool(x), _) => write!(line, "{}", u8::from(*x))?,
        (Field::Float(x), _) => number(line, f64::from(*x))?,
        (Field::Double(x), _) => number(line, *x)?,
        (Field::TimestampMillis(x) | Field::TimestampMicros(x), _) => write!(line, "{x}")?,
        (other, _) => write!(line, "{other}")?,
    }
    line.push(b',');
    Ok(1)
}

impl ParquetTable {
    fn next(&mut self) -> io::Result<Option<Row>> {
        loop {
            let rows = &mut self.rows;
            if let Some(row) = whole(|| rows.next().transpose().map_err(broken))? {
                return Ok(Some(row));
            }
            let Some(path) = self.waiting.pop_front() else {
                return Ok(None);
            };
            self.rows = whole(|| rows_of(&path, &mut Vec::new()))?.0;
        }
    }
}

impl Table for ParquetTable {
    fn row(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        let Some(row) = self.next()? else {
            return Ok(false);
        };
        self.number += 1;
        let differs = |problem: String| unusable(format!("row {}: {problem}", self.number));
        if row.len() != self.columns.len() {
            return Err(differs("other columns than in the files before".to_owned()));
        }
        if let Some(clock) = &self.clock {
            number(line, clock.time(&row))?;
            line.push(b',');
        }
        for (column, (name, field)) in self.columns.iter().zip(row.get_column_iter()) {
            let count = numbers(field, &column.like, line)?;
            if count != column.width || *name != column.name {
                return Err(differs(format!(
                    "`{name}` holds {count} numbers where the rows before have {} of `{}`",
                    column.width, column.name
                )));
            }
        }
        // the last comma
        line.pop();
        Ok(true)
    }
}

/// What a list of a dataset holds: `names` is a list, or lists by the kind of what they name.
fn list_of(described: &serde_json::Value, column: &str) -> Option<Vec<String>> {
    let mut names = &described["features"][column]["names"];
    if let Some(kinds) = names.as_object() {
        names = kinds.values().next()?;
    }
    let texts = names.as_array()?.iter();
    texts.map(|name| Some(name.as_str()?.to_owned())).collect()
}

impl EpisodeClock {
    fn of(described: &serde_json::Value, columns: &[Column]) -> Option<Self> {
        let place = |name: &str| columns.iter().position(|column| column.name == name);
        let fps = described["fps"].as_f64().filter(|fps| *fps > 0.0)?;
        Some(Self {
            fps,
            frame: place("frame_index")?,
        })
    }

    /// The time of a row; NaN where it says none.
    fn time(&self, row: &Row) -> f64 {
        match row.get_column_iter().nth(self.frame) {
            Some((_, Field::Long(x))) => *x as f64 / self.fps,
            Some((_, Field::Int(x))) => f64::from(*x) / self.fps,
            _ => f64::NAN,
        }
    }
}
