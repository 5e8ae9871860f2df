//! `datapackage.json`: a Frictionless Data Package, version 2. Its fields know no units, so each numeric
//! field has `unit`, a UCUM code, as a property of our own.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use super::citation::{doi_url, insert};
use super::context::Context;
use crate::catalogue::about::About;
use crate::catalogue::api::Index;
use crate::catalogue::folder::Sum;
use crate::catalogue::layout::{csv_path, listed_media_type};
use crate::catalogue::tables::Written;
use crate::catalogue::units::unit;
use crate::material::form::{is_licence, licence_names};
use crate::store::{Column, ColumnKind, Reference, Table};

pub(super) fn package(
    context: &Context,
    index: &Index,
    tables: &[Written],
    sums: &BTreeMap<String, Sum>,
) -> Value {
    let about = context.about;
    let schemas: BTreeMap<String, &Written> =
        tables.iter().map(|written| (csv_path(&written.table.name), written)).collect();
    let resource = |(path, sum): (&String, &Sum)| {
        let media_type = listed_media_type(path)?;
        Some(resource(path, sum, media_type, schemas.get(path).copied()))
    };
    let mut package = json!({
        "$schema": "https://datapackage.org/profiles/2.0/datapackage.json",
        "name": name(&about.title),
        "title": about.title,
        "description": about.description,
        "contributors": contributors(context),
        "sources": [{ "title": "The tables source and fit_parameter name the source of every number",
            "path": "tables/source.csv" }],
        "resources": sums.iter().filter_map(resource).collect::<Vec<_>>(),
    });
    let licences = licences(context, index);
    if !licences.is_empty() {
        // A list must hold something.
        package["licenses"] = licences.into();
    }
    insert(&mut package, "version", about.version.as_deref());
    insert(&mut package, "created", context.date);
    insert(&mut package, "homepage", about.url.as_deref());
    insert(&mut package, "id", about.doi.as_deref().map(doi_url).as_deref());
    package
}

/// Letters, digits and hyphens of a title.
fn name(title: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let dashed: String = title.chars().map(plain).collect();
    let words: Vec<&str> = dashed.split('-').filter(|word| !word.is_empty()).collect();
    if words.is_empty() { "catalogue".to_owned() } else { words.join("-") }
}

/// The catalogue's licence first, then those that materials say of themselves: one name each, of an expression
/// those in it.
fn licences(context: &Context, index: &Index) -> Vec<Value> {
    let own: BTreeSet<&str> = index.materials.iter().map(|entry| entry.licence.as_str()).collect();
    let all = context.about.licence.as_deref().into_iter().chain(own);
    let mut names: Vec<&str> = Vec::new();
    for name in all.filter(|licence| is_licence(licence)).flat_map(licence_names) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.into_iter().map(|name| json!({ "name": name })).collect()
}

fn contributors(context: &Context) -> Vec<Value> {
    let About { people, institutes, .. } = context.about;
    if !context.about.has_authors() {
        return vec![json!({ "title": context.anonymous_author() })];
    }
    let person = people.iter().map(|person| {
        let mut entry = json!({
            "title": format!("{} {}", person.given, person.family),
            "givenName": person.given,
            "familyName": person.family,
            "roles": ["creator"],
        });
        insert(&mut entry, "organization", person.affiliation.as_deref());
        entry
    });
    let institute = institutes.iter().map(|institute| {
        let mut entry = json!({ "title": institute.name, "roles": ["creator"] });
        insert(&mut entry, "path", institute.url.as_deref());
        entry
    });
    person.chain(institute).collect()
}

fn resource(path: &str, sum: &Sum, media_type: &str, written: Option<&Written>) -> Value {
    let mut resource = json!({
        "name": name(path),
        "path": path,
        "format": path.rsplit('.').next(),
        "mediatype": media_type,
        "bytes": sum.bytes,
        "hash": format!("sha256:{}", sum.sha256),
    });
    match written {
        Some(Written { table, rows }) => {
            resource["type"] = "table".into();
            resource["encoding"] = "utf-8".into();
            resource["name"] = table.name.clone().into();
            resource["rows"] = (*rows).into();
            resource["schema"] = schema(table);
        }
        None if media_type == "application/json" => resource["type"] = "json".into(),
        None => {}
    }
    resource
}

fn schema(table: &Table) -> Value {
    // To SQL a reference that lacks one of its values refers to nothing; to a data package it dangles.
    let is_nullable = |name: &String| table.columns.iter().any(|c| c.name == *name && !c.required);
    let is_whole = |r: &&Reference| !r.columns.iter().any(is_nullable);
    let fields: Vec<Value> = table.columns.iter().map(|column| field(table, column)).collect();
    let mut schema = json!({
        "fields": fields,
        "missingValues": [""],
        "foreignKeys": table.references.iter().filter(is_whole).map(foreign_key).collect::<Vec<_>>(),
    });
    if !table.key.is_empty() {
        schema["primaryKey"] = table.key.clone().into();
    }
    schema
}

fn foreign_key(r: &Reference) -> Value {
    json!({ "fields": r.columns, "reference": { "resource": r.table, "fields": r.keys } })
}

fn field(table: &Table, column: &Column) -> Value {
    let kind = match column.kind {
        ColumnKind::Integer => "integer",
        ColumnKind::Real => "number",
        ColumnKind::Text => "string",
    };
    let mut field = json!({ "name": column.name, "type": kind });
    if column.kind == ColumnKind::Text {
        return field;
    }
    match unit(&table.name, &column.name) {
        Ok(code) => field["unit"] = code.into(),
        Err(place) => field["description"] = format!("the unit is in {place}").into(),
    }
    if column.required {
        // Not of texts: an empty one is a text, but missing to a reader of CSV.
        field["constraints"] = json!({ "required": true });
    }
    field
}
