//! A scattering model in two tables: `fit.model` has its structure, `fit_parameter` the values of its parameters.

use rusqlite::types::Type;
use rusqlite::{Connection, Error, Result, Transaction, params};
use serde_json::Value;

use super::rows::{parsed, rows};
use crate::brdf::Brdf;

/// Stands for a value that the structure does not have. No parameter has a range that includes it.
const ABSENT: f64 = f64::MAX;

/// The structure of a model as JSON: null in the place of every parameter.
pub(super) fn structure(model: &Brdf) -> Result<String> {
    let mut structure = model.clone();
    for parameter in model.parameters() {
        // JSON has null for what is not a number.
        structure.set_parameter(&parameter.path, f64::NAN);
    }
    text(&structure)
}

/// A model as JSON with the values of its parameters.
pub(super) fn text(model: &Brdf) -> Result<String> {
    serde_json::to_string(model).map_err(|error| Error::ToSqlConversionFailure(error.into()))
}

/// Reads the model of a fit from its structure and its rows of `fit_parameter`. Also returns the parameters that
/// have a source of their own, sorted by path.
///
/// A database from before migration 11 may have a value in the structure, too, where the two disagree. The row
/// counts, and the content hash tells whether it is right.
pub(super) fn read(
    conn: &Connection,
    revision_id: i64,
    fit: &str,
    structure: &str,
) -> Result<(Brdf, Vec<(String, String)>)> {
    let mut json: Value = parsed(structure, 0)?;
    replace_nulls(&mut json);
    let mut model: Brdf = serde_json::from_value(json).map_err(unreadable)?;
    let sql = "SELECT path, value, source FROM fit_parameter
               WHERE revision_id = ?1 AND fit = ?2 ORDER BY path";
    let sources = rows(conn, sql, params![revision_id, fit], |row| {
        let path: String = row.get(0)?;
        if !model.set_parameter(&path, row.get(1)?) {
            return Err(unreadable(format!("the model of fit `{fit}` has no parameter `{path}`")));
        }
        let source: Option<String> = row.get(2)?;
        Ok(source.map(|source| (path, source)))
    })?;
    match model.parameters().iter().find(|parameter| parameter.value == ABSENT) {
        Some(lost) => Err(unreadable(format!(
            "fit `{fit}` has lost the value of its parameter `{}`",
            lost.path
        ))),
        None => Ok((model, sources.into_iter().flatten().collect())),
    }
}

/// The models of a revision's fits by the values that migration 11 has left in `fit.model`, each with the name of
/// its fit.
pub(super) fn left_in_structure(
    conn: &Connection,
    revision_id: i64,
) -> Result<Vec<(String, Brdf)>> {
    let sql = "SELECT name, model FROM fit WHERE revision_id = ?1";
    let texts: Vec<(String, String)> =
        rows(conn, sql, [revision_id], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let mut models = Vec::new();
    for (name, text) in texts {
        // Null is not a number: this reads only a model with all its values.
        models.extend(serde_json::from_str(&text).ok().map(|model| (name, model)));
    }
    Ok(models)
}

/// Takes the values out of every `fit.model` of a revision of which `fit_parameter` has the same ones.
pub(super) fn remove_copies(tx: &Transaction, revision_id: i64) -> Result<()> {
    for (fit, model) in left_in_structure(tx, revision_id)? {
        if values_in_rows(tx, revision_id, &fit)? == values(&model) {
            let sql = "UPDATE fit SET model = ?1 WHERE revision_id = ?2 AND name = ?3";
            tx.prepare_cached(sql)?.execute(params![structure(&model)?, revision_id, fit])?;
        }
    }
    Ok(())
}

/// Paths and values of a fit's parameters, by its rows.
fn values_in_rows(conn: &Connection, revision_id: i64, fit: &str) -> Result<Vec<(String, f64)>> {
    let sql = "SELECT path, value FROM fit_parameter WHERE revision_id = ?1 AND fit = ?2
               ORDER BY position";
    rows(conn, sql, params![revision_id, fit], |row| Ok((row.get(0)?, row.get(1)?)))
}

/// Paths and values of a model's parameters.
fn values(model: &Brdf) -> Vec<(String, f64)> {
    model.parameters().into_iter().map(|parameter| (parameter.path, parameter.value)).collect()
}

fn replace_nulls(json: &mut Value) {
    match json {
        Value::Null => *json = ABSENT.into(),
        Value::Array(items) => items.iter_mut().for_each(replace_nulls),
        Value::Object(entries) => entries.values_mut().for_each(replace_nulls),
        Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// The error for rows that do not make a model.
fn unreadable(problem: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
    Error::FromSqlConversionFailure(0, Type::Text, problem.into())
}
