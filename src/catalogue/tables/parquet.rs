//! Tables as Apache Parquet: the columns of the CSV, with types, without compression. The units are in
//! the file's metadata, as JSON under the key `ucum`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::catalogue::error::CatalogueError;
use crate::catalogue::folder::Folder;
use crate::catalogue::units::unit;
use crate::files::FilesError;
use crate::store::{Cell, Column, ColumnKind, Store, Table};

/// Number of rows that are kept in memory.
const GROUP: usize = 1 << 16;

/// Writes `tables/<table>.parquet`.
pub(super) fn write(
    folder: &mut Folder,
    store: &Store,
    table: &Table,
) -> Result<(), CatalogueError> {
    let path = format!("tables/{}.parquet", table.name);
    folder.place(&path, |place| rows(store, table, place)).map(|_| ())
}

fn rows(store: &Store, table: &Table, place: &Path) -> Result<(), CatalogueError> {
    let failed = |error: ParquetError| CatalogueError::Encoding {
        path: place.to_owned(),
        problem: error.to_string(),
    };
    let file =
        File::create(place).map_err(|reason| FilesError::unwritable("write", place, reason))?;
    let schema = Arc::new(schema(table).map_err(failed)?);
    let properties = Arc::new(properties(table, None));
    let mut writer = SerializedFileWriter::new(file, schema, properties).map_err(failed)?;
    let mut group = Group::new(table);
    store.rows(table, |cells| {
        group.push(cells);
        if group.rows < GROUP { Ok(()) } else { group.flush(&mut writer).map_err(failed) }
    })?;
    group.flush(&mut writer).map_err(failed)?;
    writer.close().map(|_| ()).map_err(failed)
}

/// A table of a few rows, in memory; `about` goes into its metadata.
pub(crate) fn parquet_of<'a>(
    table: &Table,
    about: &str,
    rows: impl Iterator<Item = Vec<Cell<'a>>>,
) -> Result<Vec<u8>, String> {
    encoded(table, about, rows).map_err(|error| error.to_string())
}

fn encoded<'a>(
    table: &Table,
    about: &str,
    rows: impl Iterator<Item = Vec<Cell<'a>>>,
) -> Result<Vec<u8>, ParquetError> {
    let (schema, properties) = (schema(table)?, properties(table, Some(about)));
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
    let mut group = Group::new(table);
    rows.for_each(|cells| group.push(&cells));
    group.flush(&mut writer)?;
    writer.close()?;
    Ok(bytes)
}

fn schema(table: &Table) -> Result<Type, ParquetError> {
    let fields = table.columns.iter().map(field).collect::<Result<_, _>>()?;
    Type::group_type_builder(&table.name).with_fields(fields).build()
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let physical = match column.kind {
        ColumnKind::Integer => Physical::INT64,
        ColumnKind::Real => Physical::DOUBLE,
        ColumnKind::Text => Physical::BYTE_ARRAY,
    };
    let is_text = column.kind == ColumnKind::Text;
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(is_text.then_some(LogicalType::String))
        .build();
    field.map(Arc::new)
}

fn properties(table: &Table, about: Option<&str>) -> WriterProperties {
    let numeric = table.columns.iter().filter(|column| column.kind != ColumnKind::Text);
    let units: BTreeMap<&str, &str> = numeric
        .filter_map(|column| Some((column.name.as_str(), unit(&table.name, &column.name).ok()?)))
        .collect();
    let mut entries = vec![KeyValue::new("ucum".to_owned(), serde_json::json!(units).to_string())];
    entries.extend(about.map(|about| KeyValue::new("about".to_owned(), about.to_owned())));
    WriterProperties::builder().set_key_value_metadata(Some(entries)).build()
}

/// Values of one column, and for every row 1 where it has one and 0 where not.
struct Values {
    there: Vec<i16>,
    kind: Kind,
}

enum Kind {
    Integers(Vec<i64>),
    Reals(Vec<f64>),
    Texts(Vec<ByteArray>),
}

/// Rows that wait to be written.
struct Group {
    rows: usize,
    columns: Vec<Values>,
}

impl Group {
    fn new(table: &Table) -> Group {
        Group { rows: 0, columns: table.columns.iter().map(Values::new).collect() }
    }

    fn push(&mut self, cells: &[Cell]) {
        self.rows += 1;
        for (values, cell) in self.columns.iter_mut().zip(cells) {
            let there = match (&mut values.kind, cell) {
                (Kind::Integers(list), Cell::Integer(number)) => {
                    list.push(*number);
                    1
                }
                (Kind::Reals(list), Cell::Real(number)) => {
                    list.push(*number);
                    1
                }
                (Kind::Texts(list), Cell::Text(text)) => {
                    list.push(ByteArray::from(*text));
                    1
                }
                // The tables of the database are strict, so that no cell has another kind.
                _ => 0,
            };
            values.there.push(there);
        }
    }

    fn flush<W: Write + Send>(
        &mut self,
        writer: &mut SerializedFileWriter<W>,
    ) -> Result<(), ParquetError> {
        if self.rows == 0 {
            return Ok(());
        }
        let mut group = writer.next_row_group()?;
        let mut columns = self.columns.iter_mut();
        while let (Some(values), Some(mut column)) = (columns.next(), group.next_column()?) {
            let there = Some(values.there.as_slice());
            match &values.kind {
                Kind::Integers(list) => {
                    column.typed::<Int64Type>().write_batch(list, there, None)?;
                }
                Kind::Reals(list) => {
                    column.typed::<DoubleType>().write_batch(list, there, None)?;
                }
                Kind::Texts(list) => {
                    column.typed::<ByteArrayType>().write_batch(list, there, None)?;
                }
            }
            column.close()?;
            values.clear();
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl Values {
    fn new(column: &Column) -> Values {
        let kind = match column.kind {
            ColumnKind::Integer => Kind::Integers(Vec::new()),
            ColumnKind::Real => Kind::Reals(Vec::new()),
            ColumnKind::Text => Kind::Texts(Vec::new()),
        };
        Values { there: Vec::new(), kind }
    }

    fn clear(&mut self) {
        self.there.clear();
        match &mut self.kind {
            Kind::Integers(list) => list.clear(),
            Kind::Reals(list) => list.clear(),
            Kind::Texts(list) => list.clear(),
        }
    }
}
