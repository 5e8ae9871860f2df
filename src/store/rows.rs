//! Reads rows and columns as plain values.

use rusqlite::types::{FromSql, FromSqlError, FromSqlResult, Type, ValueRef};
use rusqlite::{Connection, Error, Params, Result, Row, Transaction, TransactionBehavior};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde::de::value::{Error as WordError, StrDeserializer};

use crate::material::{Censor, FindingVerdict, Geometry, Lobes, Making, Scale, Slug, SourceKind};
use crate::radar::Footprint;

/// All rows of a query.
pub(super) fn rows<T>(
    conn: &Connection,
    sql: &str,
    values: impl Params,
    read: impl FnMut(&Row) -> Result<T>,
) -> Result<Vec<T>> {
    conn.prepare_cached(sql)?.query_map(values, read)?.collect()
}

/// A time in which reads see no writes of other programs. One may lie within another.
pub(super) struct Moment<'a> {
    /// The transaction, of the outermost one.
    _tx: Option<Transaction<'a>>,
}

pub(super) fn moment(conn: &Connection) -> Result<Moment<'_>> {
    if !conn.is_autocommit() {
        return Ok(Moment { _tx: None });
    }
    let tx = Transaction::new_unchecked(conn, TransactionBehavior::Deferred)?;
    Ok(Moment { _tx: Some(tx) })
}

/// A column of JSON.
pub(super) fn json<T: DeserializeOwned>(row: &Row, column: usize) -> Result<T> {
    parsed(&row.get::<_, String>(column)?, column)
}

/// A column of JSON or NULL.
pub(super) fn optional_json<T: DeserializeOwned>(row: &Row, column: usize) -> Result<Option<T>> {
    let text: Option<String> = row.get(column)?;
    text.map(|text| parsed(&text, column)).transpose()
}

/// A value of JSON that stands in a column.
pub(super) fn parsed<T: DeserializeOwned>(text: &str, column: usize) -> Result<T> {
    serde_json::from_str(text)
        .map_err(|error| Error::FromSqlConversionFailure(column, Type::Text, error.into()))
}

/// Reads a value that files and the database write as one word.
fn word<'de, T: Deserialize<'de>>(value: ValueRef<'de>) -> FromSqlResult<T> {
    T::deserialize(StrDeserializer::<WordError>::new(value.as_str()?)).map_err(FromSqlError::other)
}

/// Words of files that the database keeps as they are.
macro_rules! words {
    ($($type:ty),+ $(,)?) => {
        $(impl FromSql for $type {
            fn column_result(value: ValueRef) -> FromSqlResult<$type> {
                word(value)
            }
        })+
    };
}

words!(Censor, FindingVerdict, Footprint, Geometry, Lobes, Making, Scale, Slug, SourceKind);
