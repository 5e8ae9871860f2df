//! Tables of a data set as Apache Parquet: a row group for each scan, floats split into streams of bytes and packed with zstd. What
//! is not there is NaN, or −1 for whole numbers. Units (UCUM) are in the metadata, as JSON under the key `ucum`.

use std::collections::BTreeMap;
use std::sync::Arc;

use parquet::basic::{
    Compression, ConvertedType, Encoding, IntType, LogicalType, Repetition, Type as Physical,
    ZstdLevel,
};
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{WriterProperties, WriterPropertiesPtr};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};

use crate::error::Error;

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub name: String,
    pub kind: Kind,
    /// UCUM code of numbers; empty for numbers of things and for names.
    pub unit: &'static str,
    /// What it is, for a person.
    pub about: String,
}

/// The kind of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Int8,
    Int16,
    Int32,
    Int64,
    Float,
    Double,
    Bool,
    Text,
}

/// The values of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Ints(Vec<i32>),
    Longs(Vec<i64>),
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
    Bools(Vec<bool>),
    Texts(Vec<String>),
}

/// Writes a table of several groups of rows.
///
/// # Errors
/// When a group lacks a column.
pub(super) fn write<'a>(
    name: &str,
    columns: &[Column],
    groups: impl IntoIterator<Item = &'a [Values]>,
) -> Result<Vec<u8>, Error> {
    encoded(name, columns, groups).map_err(|error| {
        Error::usage(format!("a table could not be encoded: {error}"), "report this")
    })
}

fn encoded<'a>(
    name: &str,
    columns: &[Column],
    groups: impl IntoIterator<Item = &'a [Values]>,
) -> Result<Vec<u8>, ParquetError> {
    let fields = columns.iter().map(field).collect::<Result<_, _>>()?;
    let schema = Arc::new(Type::group_type_builder(name).with_fields(fields).build()?);
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties(columns)?)?;
    for values in groups {
        let mut group = writer.next_row_group()?;
        for values in values {
            let Some(mut column) = group.next_column()? else { break };
            match values {
                Values::Ints(values) => {
                    column.typed::<Int32Type>().write_batch(values, None, None)?;
                }
                Values::Longs(values) => {
                    column.typed::<Int64Type>().write_batch(values, None, None)?;
                }
                Values::Floats(values) => {
                    column.typed::<FloatType>().write_batch(values, None, None)?;
                }
                Values::Doubles(values) => {
                    column.typed::<DoubleType>().write_batch(values, None, None)?;
                }
                Values::Bools(values) => {
                    column.typed::<BoolType>().write_batch(values, None, None)?;
                }
                Values::Texts(values) => {
                    let values: Vec<ByteArray> =
                        values.iter().map(|text| text.as_str().into()).collect();
                    column.typed::<ByteArrayType>().write_batch(&values, None, None)?;
                }
            }
            column.close()?;
        }
        group.close()?;
    }
    writer.close()?;
    Ok(bytes)
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match column.kind {
        Kind::Int8 => (Physical::INT32, integer(8)),
        Kind::Int16 => (Physical::INT32, integer(16)),
        Kind::Int32 => (Physical::INT32, None),
        Kind::Int64 => (Physical::INT64, None),
        Kind::Float => (Physical::FLOAT, None),
        Kind::Double => (Physical::DOUBLE, None),
        Kind::Bool => (Physical::BOOLEAN, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(logical)
        .with_converted_type(ConvertedType::NONE)
        .build();
    field.map(Arc::new)
}

fn integer(bit_width: i8) -> Option<LogicalType> {
    Some(LogicalType::Integer(IntType { bit_width, is_signed: true }))
}

fn properties(columns: &[Column]) -> Result<WriterPropertiesPtr, ParquetError> {
    let units: BTreeMap<&str, &str> = columns
        .iter()
        .filter(|column| !column.unit.is_empty())
        .map(|column| (column.name.as_str(), column.unit))
        .collect();
    let units = KeyValue::new("ucum".to_owned(), serde_json::json!(units).to_string());
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("matdb ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_key_value_metadata(Some(vec![units]));
    for column in columns.iter().filter(|one| matches!(one.kind, Kind::Float | Kind::Double)) {
        let path = ColumnPath::from(column.name.as_str());
        properties = properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path, Encoding::BYTE_STREAM_SPLIT);
    }
    Ok(Arc::new(properties.build()))
}
