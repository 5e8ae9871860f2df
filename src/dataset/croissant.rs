//! A description of a data set in the vocabulary Croissant 1.1 of MLCommons, which loaders read
//! (<https://docs.mlcommons.org/croissant/docs/croissant-spec-1.1.html>).

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::layout::SCANS;
use super::plan::Dataset;
use super::points;
use super::table::{Column, Kind};

/// The context that all documents of this vocabulary have.
const CONTEXT: &str = include_str!("croissant-context.json");
/// What its readers know Parquet as.
const PARQUET: &str = "application/x-parquet";

/// The document. `scans` are the bytes and the columns of the table of all scans.
pub(super) fn document(dataset: &Dataset, scans: &[u8], columns: &[Column]) -> Value {
    let (spec, plan) = (&dataset.recipe.spec, &dataset.plan);
    let title = if spec.title.is_empty() { &spec.name } else { &spec.title };
    let creators =
        spec.creators.iter().map(|name| json!({"@type": "sc:Organization", "name": name}));
    let mut distribution = vec![
        json!({
            "@type": "cr:FileObject",
            "@id": "scans-table",
            "name": "scans-table",
            "description": "A row for each scan.",
            "contentUrl": SCANS,
            "encodingFormat": PARQUET,
            "sha256": Sha256::digest(scans).iter().map(|byte| format!("{byte:02x}")).collect::<String>(),
        }),
        json!({
            "@type": "cr:FileSet",
            "@id": "points-tables",
            "name": "points-tables",
            "description": "A row for each return of each chirp, and for each chirp without one.",
            "encodingFormat": PARQUET,
            "includes": "points/*.parquet",
        }),
    ];
    if spec.images {
        distribution.push(json!({
            "@type": "cr:FileSet",
            "@id": "image-archives",
            "name": "image-archives",
            "description": "Images of each scan as WebDataset.",
            "encodingFormat": "application/x-tar",
            "includes": "images/*.tar",
        }));
    }
    let splits = plan.split.iter().map(|split| json!({"split_names/name": split.name}));
    let records = vec![
        json!({
            "@type": "cr:RecordSet",
            "@id": "split_names",
            "name": "split_names",
            "key": {"@id": "split_names/name"},
            "dataType": "cr:Split",
            "field": [{"@type": "cr:Field", "@id": "split_names/name", "name": "name", "dataType": "sc:Text"}],
            "data": splits.collect::<Vec<_>>(),
        }),
        json!({
            "@type": "cr:RecordSet",
            "@id": "scans",
            "name": "scans",
            "key": {"@id": "scans/key"},
            "field": fields("scans", columns, json!({"fileObject": {"@id": "scans-table"}})),
        }),
        json!({
            "@type": "cr:RecordSet",
            "@id": "points",
            "name": "points",
            "field": fields("points", &points::columns(), json!({"fileSet": {"@id": "points-tables"}})),
        }),
    ];
    let mut document = json!({
        "@context": serde_json::from_str::<Value>(CONTEXT).unwrap_or_default(),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "name": spec.name,
        "alternateName": title,
        "description": spec.description,
        "creator": creators.collect::<Vec<_>>(),
        "version": "1.0.0",
        "isLiveDataset": false,
        "citeAs": format!("{title}, made by {}, plan {}", plan.program, plan.id),
        "distribution": distribution,
        "recordSet": records,
    });
    if !spec.licence.is_empty() {
        document["license"] = json!(format!("https://spdx.org/licenses/{}", spec.licence));
    }
    document
}

/// The columns of a table as fields.
fn fields(table: &str, columns: &[Column], source: Value) -> Vec<Value> {
    let fields = columns.iter().map(|Column { name, kind, unit, about }| {
        let kind = match kind {
            Kind::Text => "sc:Text",
            Kind::Bool => "sc:Boolean",
            Kind::Float | Kind::Double => "sc:Float",
            Kind::Int8 | Kind::Int16 | Kind::Int32 | Kind::Int64 => "sc:Integer",
        };
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        let mut source = source.clone();
        source["extract"] = json!({"column": name});
        json!({
            "@type": "cr:Field",
            "@id": format!("{table}/{name}"),
            "name": name,
            "description": format!("{about}{unit}"),
            "dataType": kind,
            "source": source,
        })
    });
    fields.collect()
}
