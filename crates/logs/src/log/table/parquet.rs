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

use super::lines::{COLUMNS, Table, TableText, damaged, number, unusable};

/// Time between the last row of an episode and the first of the next [s]: longer than any filter reaches.
const BETWEEN_EPISODES_S: f64 = 10.0;
/// Largest description of a dataset [bytes].
const DESCRIPTION: u64 = 1 << 24;

/// A column of the file, and how many numbers a row of it has.
struct Column {
    name: String,
    width: usize,
}

struct ParquetTable {
    columns: Vec<Column>,
    rows: RowIter<'static>,
    waiting: VecDeque<PathBuf>,
    /// The first row, read for its widths.
    first: Option<Row>,
    number: u64,
    clock: Option<EpisodeClock>,
}

/// Times of the frames of a dataset, episode after episode.
struct EpisodeClock {
    fps: f64,
    /// Places of `frame_index` and `episode_index` among the columns.
    frame: usize,
    episode: usize,
    before: Option<(i64, f64)>,
    begins: f64,
}

pub(super) fn open(path: &Path, more: &[PathBuf]) -> io::Result<TableText> {
    let mut notes = Vec::new();
    let (mut rows, nanoseconds) = whole(|| rows_of(path, &mut notes))?;
    let first = whole(|| rows.next().transpose().map_err(broken))?;
    let described = described(path);
    let mut columns = Vec::new();
    let mut names = Vec::new();
    let fields = first.iter().flat_map(Row::get_column_iter);
    for ((name, field), nanoseconds) in fields.zip(nanoseconds) {
        let mut own = Vec::new();
        match nanoseconds {
            true => own.push(" [ns]".to_owned()),
            false => leaves(field, String::new(), &mut own),
        }
        columns.push(Column {
            name: name.clone(),
            width: own.len(),
        });
        let listed = described.as_ref().and_then(|all| list_of(all, name));
        let listed = listed.filter(|listed| listed.len() == own.len() && own.len() > 1);
        match listed {
            Some(listed) => names.extend(listed.iter().map(|of| format!("{name}.{of}"))),
            None => {
                // the index of pandas where it has no name of its own
                let name = if is_index(name) { "time" } else { name };
                names.extend(own.iter().map(|of| format!("{name}{of}")));
            }
        }
        if names.len() > COLUMNS {
            return Err(unusable(format!("more than {COLUMNS} columns")));
        }
    }
    let clock = described
        .as_ref()
        .and_then(|all| EpisodeClock::of(all, &columns));
    if clock.is_some() {
        names.insert(0, "time [s]".to_owned());
        notes.push(format!(
            "times are frame_index over fps, and episodes follow one another {BETWEEN_EPISODES_S} s apart"
        ));
    }
    let table = ParquetTable {
        columns,
        rows,
        waiting: more.iter().cloned().collect(),
        first,
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
    let (kept, left): (Vec<_>, Vec<_>) = (root.get_fields().iter().cloned())
        .partition(|field| is_numeric(field) && (!is_index(field.name()) || is_instant(field)));
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

/// Whether a column is an index of pandas without a name.
fn is_index(name: &str) -> bool {
    name.starts_with("__index_level_")
}

fn is_nanoseconds(field: &Arc<Type>) -> bool {
    let kind = field.get_basic_info().logical_type_ref();
    matches!(kind, Some(LogicalType::Timestamp(time)) if matches!(time.unit, TimeUnit::NANOS))
}

fn is_instant(field: &Arc<Type>) -> bool {
    let kind = field.get_basic_info().converted_type();
    let instant = matches!(
        kind,
        ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIMESTAMP_MICROS
    );
    field.is_primitive() && (instant || is_nanoseconds(field))
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

/// Appends the numbers of a field, a comma behind each; how many they are.
fn numbers(field: &Field, line: &mut Vec<u8>) -> io::Result<usize> {
    match field {
        Field::Group(row) => {
            let parts = row.get_column_iter().map(|(_, field)| field);
            return parts.map(|field| numbers(field, line)).sum();
        }
        Field::ListInternal(list) => {
            let parts = list.elements().iter();
            return parts.map(|field| numbers(field, line)).sum();
        }
        Field::Null => {}
        Field::Bool(x) => write!(line, "{}", u8::from(*x))?,
        Field::Float(x) => number(line, f64::from(*x))?,
        Field::Double(x) => number(line, *x)?,
        Field::TimestampMillis(x) | Field::TimestampMicros(x) => write!(line, "{x}")?,
        other => write!(line, "{other}")?,
    }
    line.push(b',');
    Ok(1)
}

impl ParquetTable {
    fn next(&mut self) -> io::Result<Option<Row>> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
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
        if let Some(clock) = &mut self.clock {
            number(line, clock.time(&row))?;
            line.push(b',');
        }
        for (column, (name, field)) in self.columns.iter().zip(row.get_column_iter()) {
            let count = match field {
                Field::Null => {
                    line.extend(std::iter::repeat_n(b',', column.width));
                    column.width
                }
                field => numbers(field, line)?,
            };
            if count != column.width || *name != column.name {
                return Err(differs(format!(
                    "`{name}` holds {count} numbers where the first row has {} of `{}`",
                    column.width, column.name
                )));
            }
        }
        // the last comma
        line.pop();
        Ok(true)
    }
}

/// The description of the dataset that a file belongs to.
fn described(path: &Path) -> Option<serde_json::Value> {
    let place = path.ancestors().nth(3)?.join("meta").join("info.json");
    let small = std::fs::metadata(&place).is_ok_and(|about| about.len() <= DESCRIPTION);
    let text = small.then(|| std::fs::read_to_string(&place).ok());
    serde_json::from_str(&text??).ok()
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
            episode: place("episode_index")?,
            before: None,
            begins: 0.0,
        })
    }

    /// The time of a row; NaN where it says none.
    fn time(&mut self, row: &Row) -> f64 {
        let whole = |at: usize| match row.get_column_iter().nth(at)?.1 {
            Field::Long(x) => Some(*x),
            Field::Int(x) => Some(i64::from(*x)),
            _ => None,
        };
        let (Some(frame), Some(episode)) = (whole(self.frame), whole(self.episode)) else {
            return f64::NAN;
        };
        let own = frame as f64 / self.fps;
        if let Some((before, last)) = self.before
            && before != episode
        {
            self.begins = last + BETWEEN_EPISODES_S - own;
        }
        let t = self.begins + own;
        self.before = Some((episode, t));
        t
    }
}
