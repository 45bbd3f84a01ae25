//! A recording as Parquet: a column of doubles for each number of CSV, with the same names; `contacts` are integers. And any
//! table of cells, for rollouts.
//!
//! What a reader needs to know of a file stands at its end, so it is complete or none: rows wait in memory, some millions
//! of numbers at a time.

use std::io::{Error, Result, Write};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Quantity, Sample, columns};
use penny::forward::Method;
use penny::model::Model;
use penny::state::State;

/// Numbers that wait before they are written.
const WAITING: usize = 1 << 22;

/// Writes rows; the file is complete after [`finish`](Parquet::finish).
pub struct Parquet {
    out: SerializedFileWriter<Box<dyn Write + Send>>,
    /// Column by column but for the contacts, what waits.
    doubles: Vec<Vec<f64>>,
    contacts: Vec<i64>,
    /// Columns before that of the contacts.
    before: usize,
}

impl Parquet {
    pub fn new(out: Box<dyn Write + Send>, model: &Model, method: &Method, quantities: &[Quantity]) -> Result<Parquet> {
        let names = columns(model, quantities);
        let before = names.len() - quantities.len() - 1;
        let column = |(i, name): (usize, &String)| {
            let kind = if i == before { Physical::INT64 } else { Physical::DOUBLE };
            let column = Type::primitive_type_builder(name, kind).with_repetition(Repetition::REQUIRED);
            column.build().map(Arc::new)
        };
        let fields = names.iter().enumerate().map(column).collect::<std::result::Result<_, _>>().map_err(plain)?;
        let schema = Type::group_type_builder("run").with_fields(fields).build().map_err(plain)?;
        let told = [
            ("model", model.name.clone()),
            ("contact", method.contact.name.to_owned()),
            ("integrator", method.integrator.name.to_owned()),
            ("timestep", method.timestep.to_string()),
        ];
        let told = told.into_iter().map(|(key, value)| KeyValue::new(key.to_owned(), value));
        let units = quantities.iter().map(|q| KeyValue::new(format!("unit of {}", q.name), q.unit.to_owned()));
        // No two numbers are alike: a dictionary of them would only be larger.
        let properties = WriterProperties::builder().set_dictionary_enabled(false);
        let properties = properties.set_key_value_metadata(Some(told.chain(units).collect())).build();
        Ok(Parquet {
            out: SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties)).map_err(plain)?,
            doubles: vec![Vec::new(); names.len() - 1],
            contacts: Vec::new(),
            before,
        })
    }

    pub fn write(&mut self, state: &State, sample: &Sample, values: &[f64]) -> Result<()> {
        let state = [state.time].into_iter().chain(state.qpos.iter().chain(&state.qvel).copied());
        let row = state.chain([sample.energy, sample.penetration]).chain(values.iter().copied());
        self.doubles.iter_mut().zip(row).for_each(|(column, x)| column.push(x));
        self.contacts.push(sample.contacts as i64);
        if self.contacts.len() * self.doubles.len() < WAITING { Ok(()) } else { self.flush() }
    }

    fn flush(&mut self) -> Result<()> {
        if self.contacts.is_empty() { Ok(()) } else { self.group().map_err(plain) }
    }

    fn group(&mut self) -> std::result::Result<(), ParquetError> {
        let mut group = self.out.next_row_group()?;
        let mut doubles = self.doubles.iter_mut();
        let mut i = 0;
        while let Some(mut column) = group.next_column()? {
            if i == self.before {
                column.typed::<Int64Type>().write_batch(&self.contacts, None, None)?;
            } else if let Some(values) = doubles.next() {
                column.typed::<DoubleType>().write_batch(values, None, None)?;
                values.clear();
            }
            column.close()?;
            i += 1;
        }
        group.close()?;
        self.contacts.clear();
        Ok(())
    }

    /// Writes what waits and the end.
    pub fn finish(mut self) -> Result<()> {
        self.flush()?;
        self.out.close().map(drop).map_err(plain)
    }
}

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cells {
    /// A column of doubles; an empty cell is a null.
    Numbers,
    /// Integers of 64 bits; an empty cell is a null.
    Integers,
    /// Text in UTF-8.
    Text,
}

/// Writes a table of cells, column by column, a group of rows at a time.
///
/// Errors: `out` cannot be written; a cell is not what its column says.
pub fn write_table(
    out: Box<dyn Write + Send>,
    columns: &[(String, Cells)],
    rows: impl Iterator<Item = Result<Vec<String>>>,
) -> Result<()> {
    let field = |(name, cells): &(String, Cells)| {
        let (kind, text) = match cells {
            Cells::Numbers => (Physical::DOUBLE, None),
            Cells::Integers => (Physical::INT64, None),
            Cells::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let column = Type::primitive_type_builder(name, kind).with_logical_type(text);
        column.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<std::result::Result<_, _>>().map_err(plain)?;
    let schema = Type::group_type_builder("rollout").with_fields(fields).build().map_err(plain)?;
    let mut out = SerializedFileWriter::new(out, Arc::new(schema), Default::default()).map_err(plain)?;
    let mut rows = rows.peekable();
    while rows.peek().is_some() {
        let waiting: Vec<_> = rows.by_ref().take(WAITING / columns.len().max(1) + 1).collect::<Result<_>>()?;
        let mut group = out.next_row_group().map_err(plain)?;
        for (i, (name, cells)) in columns.iter().enumerate() {
            let wrong = |cell: &str| Error::other(format!("column {name}: `{cell}` is not what it should be"));
            let there: Vec<&str> = waiting.iter().map(|row| row[i].as_str()).filter(|cell| !cell.is_empty()).collect();
            let levels: Vec<i16> = waiting.iter().map(|row| i16::from(!row[i].is_empty())).collect();
            let Some(mut column) = group.next_column().map_err(plain)? else { break };
            let written = match cells {
                Cells::Numbers => {
                    let numbers =
                        there.iter().map(|c| c.parse().map_err(|_| wrong(c))).collect::<Result<Vec<f64>>>()?;
                    column.typed::<DoubleType>().write_batch(&numbers, Some(&levels), None)
                }
                Cells::Integers => {
                    let numbers =
                        there.iter().map(|c| c.parse().map_err(|_| wrong(c))).collect::<Result<Vec<i64>>>()?;
                    column.typed::<Int64Type>().write_batch(&numbers, Some(&levels), None)
                }
                Cells::Text => {
                    let texts: Vec<ByteArray> = there.into_iter().map(ByteArray::from).collect();
                    column.typed::<ByteArrayType>().write_batch(&texts, Some(&levels), None)
                }
            };
            written.map_err(plain)?;
            column.close().map_err(plain)?;
        }
        group.close().map_err(plain)?;
    }
    out.close().map(drop).map_err(plain)
}

/// The system's error where that is the cause.
fn plain(error: ParquetError) -> Error {
    match error {
        ParquetError::External(cause) => cause.downcast::<Error>().map_or_else(Error::other, |error| *error),
        other => Error::other(other),
    }
}
