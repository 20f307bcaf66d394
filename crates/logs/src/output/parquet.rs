//! A log as a Parquet file: a column of doubles for each channel, the time first. Times that are counted from another
//! instant than zero are time stamps in nanoseconds, for which seconds in a double have no room.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use crate::log::Instant;

/// Numbers that are held until they are written.
const MAX_HELD_NUMBERS: usize = 1 << 20;
const MIN_GROUP_ROWS: usize = 1024;

pub(super) struct ParquetLog<W: Write + Send> {
    columns: Vec<String>,
    notes: Vec<String>,
    /// Where the file goes until it is begun: whether times are stamps is not known before the first row.
    out: Option<W>,
    writer: Option<SerializedFileWriter<W>>,
    origin: Instant,
    /// Rows that are not written yet, column by column.
    held: Vec<Vec<f64>>,
}

impl<W: Write + Send> ParquetLog<W> {
    /// Begins a file of these columns, of which the first is the time.
    pub(super) fn new(out: W, columns: &[String], notes: &[String]) -> Self {
        Self {
            columns: columns.to_vec(),
            notes: notes.to_vec(),
            out: Some(out),
            writer: None,
            origin: Instant::default(),
            held: vec![Vec::new(); columns.len()],
        }
    }

    pub(super) fn row(&mut self, origin: Instant, row: &[f64]) -> io::Result<()> {
        self.origin = origin;
        for (column, value) in self.held.iter_mut().zip(row) {
            column.push(*value);
        }
        let rows = self.held.first().map_or(0, Vec::len);
        match rows >= MIN_GROUP_ROWS && rows * self.columns.len() >= MAX_HELD_NUMBERS {
            true => Ok(self.write()?),
            false => Ok(()),
        }
    }

    fn stamped(&self) -> bool {
        self.origin != Instant::default()
    }

    /// The writer, begun where it is not yet.
    fn begin(&mut self) -> Result<(), ParquetError> {
        let Some(out) = self.out.take() else {
            return Ok(());
        };
        let notes = self.notes.iter().enumerate();
        let notes =
            notes.map(|(k, note)| KeyValue::new(format!("note_{:02}", k + 1), note.clone()));
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(Default::default()))
            .set_created_by(concat!("cft-ident ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_dictionary_enabled(false)
            .set_key_value_metadata(Some(notes.collect()))
            .build();
        let schema = schema(&self.columns, self.stamped())?;
        self.writer = Some(SerializedFileWriter::new(
            out,
            schema,
            Arc::new(properties),
        )?);
        Ok(())
    }

    /// Writes the rows that are held, as a group.
    fn write(&mut self) -> Result<(), ParquetError> {
        self.begin()?;
        let (stamped, origin) = (self.stamped(), self.origin);
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        let mut group = writer.next_row_group()?;
        for (index, values) in self.held.iter_mut().enumerate() {
            let Some(mut column) = group.next_column()? else {
                break;
            };
            if stamped && index == 0 {
                let stamp = |t: &f64| i64::try_from(origin.later(*t).nanoseconds());
                let stamps: Result<Vec<i64>, _> = values.iter().map(stamp).collect();
                let beyond = |_| "a time is beyond the range of time stamps".to_owned();
                let stamps = stamps.map_err(beyond).map_err(ParquetError::General)?;
                let column = column.typed::<Int64Type>();
                column.write_batch(&stamps, None, None)?;
            } else {
                let column = column.typed::<DoubleType>();
                column.write_batch(values, None, None)?;
            }
            column.close()?;
            values.clear();
        }
        group.close()?;
        Ok(())
    }

    pub(super) fn finish(mut self) -> io::Result<W> {
        if self.held.iter().any(|column| !column.is_empty()) {
            self.write()?;
        }
        self.begin()?;
        match self.writer {
            Some(writer) => Ok(writer.into_inner()?),
            None => Err(io::ErrorKind::WriteZero.into()),
        }
    }
}

fn schema(columns: &[String], stamped: bool) -> Result<TypePtr, ParquetError> {
    let field = |(index, name): (usize, &String)| {
        let (physical, logical) = match stamped && index == 0 {
            true => {
                let stamp = LogicalType::timestamp(true, TimeUnit::NANOS);
                (Physical::INT64, Some(stamp))
            }
            false => (Physical::DOUBLE, None),
        };
        let built = Type::primitive_type_builder(name, physical).with_logical_type(logical);
        let built = built.with_repetition(Repetition::REQUIRED).build();
        built.map(Arc::new)
    };
    let fields = columns.iter().enumerate().map(field);
    let fields = fields.collect::<Result<Vec<TypePtr>, ParquetError>>()?;
    let root = Type::group_type_builder("log").with_fields(fields);
    root.build().map(Arc::new)
}
