//! `datapackage.json`: a Frictionless Data Package, version 2. Its fields know no units, so each numeric
//! field has `unit`, a UCUM code, as a property of our own.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use super::citation::{doi_url, insert};
use super::context::Context;
use crate::catalogue::about::About;
use crate::catalogue::api::Index;
use crate::catalogue::folder::Checksum;
use crate::catalogue::layout::{csv_path, listed_media_type};
use crate::catalogue::tables::WrittenTable;
use crate::catalogue::units::unit;
use crate::material::form::{is_licence, licence_names};
use crate::store::{Column, ColumnKind, Reference, Table};

pub(super) fn package(
    context: &Context,
    index: &Index,
    tables: &[WrittenTable],
    sums: &BTreeMap<String, Checksum>,
) -> Value {
    let about = context.about;
    let schemas: BTreeMap<String, &WrittenTable> =
        tables.iter().map(|written| (csv_path(&written.table.name), written)).collect();
    let mut resources = Vec::new();
    for (path, sum) in sums {
        if let Some(media_type) = listed_media_type(path) {
            resources.push(resource(path, sum, media_type, schemas.get(path).copied()));
        }
    }
    let mut package = json!({
        "$schema": "https://datapackage.org/profiles/2.0/datapackage.json",
        "name": name(&about.title),
        "title": about.title,
        "description": about.description,
        "contributors": contributors(context),
        "sources": [{ "title": "The tables source and fit_parameter name the source of every number",
            "path": "tables/source.csv" }],
        "resources": resources,
    });
    let licences = licences(context, index);
    if !licences.is_empty() {
        // The format forbids an empty list.
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
    let title = title.to_ascii_lowercase();
    let words = title.split(|c: char| !c.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    if words.is_empty() { "catalogue".to_owned() } else { words.join("-") }
}

/// The names in the catalogue's licence, then those in the materials' licences, each once.
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
    let mut contributors = Vec::new();
    for person in people {
        let mut entry = json!({
            "title": format!("{} {}", person.given, person.family),
            "givenName": person.given,
            "familyName": person.family,
            "roles": ["creator"],
        });
        insert(&mut entry, "organization", person.affiliation.as_deref());
        contributors.push(entry);
    }
    for institute in institutes {
        let mut entry = json!({ "title": institute.name, "roles": ["creator"] });
        insert(&mut entry, "path", institute.url.as_deref());
        contributors.push(entry);
    }
    contributors
}

fn resource(path: &str, sum: &Checksum, media_type: &str, written: Option<&WrittenTable>) -> Value {
    let mut resource = json!({
        "name": name(path),
        "path": path,
        "format": path.rsplit('.').next(),
        "mediatype": media_type,
        "bytes": sum.bytes,
        "hash": format!("sha256:{}", sum.sha256),
    });
    match written {
        Some(WrittenTable { table, rows }) => {
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
    // In SQL a reference with a missing value refers to nothing; a data package calls it dangling.
    let nullable = table.columns.iter().filter(|column| !column.required);
    let nullable: BTreeSet<&String> = nullable.map(|column| &column.name).collect();
    let mut foreign_keys = Vec::new();
    for Reference { columns, table, keys } in &table.references {
        if !columns.iter().any(|column| nullable.contains(column)) {
            let reference = json!({ "resource": table, "fields": keys });
            foreign_keys.push(json!({ "fields": columns, "reference": reference }));
        }
    }
    let fields: Vec<Value> = table.columns.iter().map(|column| field(table, column)).collect();
    let mut schema =
        json!({ "fields": fields, "missingValues": [""], "foreignKeys": foreign_keys });
    if !table.key.is_empty() {
        schema["primaryKey"] = table.key.clone().into();
    }
    schema
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
        // Not for texts: a reader of CSV takes an empty text for a missing one.
        field["constraints"] = json!({ "required": true });
    }
    field
}
