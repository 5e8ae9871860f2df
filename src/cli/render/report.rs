//! What a rendering says when it is done.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::files::NAMES;
use super::record::Record;
use super::stages::Stages;
use crate::cli::console::Console;
use crate::cli::summary::{grouped, table};
use crate::error::Error;

/// Prints the summary of a rendering that was written to `folder`.
pub(super) fn print(
    folder: &Path,
    record: &Record,
    stages: &Stages,
    console: &Console,
) -> Result<(), Error> {
    record.notices().iter().for_each(|notice| console.notice(notice));
    console.result(&text(folder, record, stages), &value(folder, record, stages))
}

fn text(folder: &Path, record: &Record, stages: &Stages) -> String {
    let materials = record.material_origins();
    let regions = table(
        &["region", "material", "facets", "hits", "detections", "strongest dBm"],
        record.regions().iter().map(|region| {
            [
                region.name.to_owned(),
                materials[usize::from(region.material)].clone(),
                grouped(region.facets),
                grouped(region.hits),
                grouped(region.detections),
                region.strongest_dbm.map_or("–".to_owned(), |p| format!("{p:.1}")),
            ]
        }),
    );
    let counts = record.counts();
    format!(
        "{regions}{} chirps, {} hits, {} detections, {} below the threshold\n\
         wrote {NAMES} to {} in {:.2} s\n",
        grouped(counts.chirps),
        grouped(counts.hits),
        grouped(counts.detections),
        grouped(counts.below_threshold),
        folder.display(),
        stages.total_s()
    )
}

fn value(folder: &Path, record: &Record, stages: &Stages) -> Value {
    let timings: Map<String, Value> =
        stages.ended().map(|(stage, ms)| (stage.to_owned(), json!(ms))).collect();
    json!({
        "output": folder.to_string_lossy(),
        "counts": record.counts(),
        "power_dbm": record.power_dbm(),
        "regions": record.regions(),
        "notices": record.notices(),
        "timings_ms": timings,
    })
}
