//! What a rendering says when it is done.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::stages::Stages;
use crate::cli::console::Console;
use crate::cli::summary::{grouped, table};
use crate::error::Error;
use crate::formats::words::listed;
use crate::report::{Counts, ReceiverRecord, RenderFiles, ScanRecord};

/// Prints the summary of a rendering that was written to `folder`, which ends the last stage.
pub(super) fn print(
    folder: &Path,
    rendered: &RenderFiles,
    stages: Stages,
    console: &Console,
) -> Result<(), Error> {
    let (stages_ms, total_s) = stages.end();
    let (record, files) = (&rendered.record, words(rendered));
    record.notices().iter().for_each(|notice| console.notice(notice));
    console.result(&text(folder, record, &files, total_s), &value(folder, record, stages_ms))
}

/// The files of the radar's own view, in words.
fn words(rendered: &RenderFiles) -> String {
    let mut names = vec!["power.exr", "power.png", "cloud.ply"];
    let more = ["view.html", "cloud.glb"].into_iter();
    names.extend(more.filter(|more| rendered.files.iter().any(|(name, _)| name == more)));
    names.push("scan.json");
    listed(&names)
}

fn text(folder: &Path, record: &ScanRecord, files: &str, total_s: f64) -> String {
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
    let receivers: String = record.receivers().iter().map(receiver).collect();
    let crossed = record.cross_polar_detections().map_or(String::new(), |count| {
        format!(
            "cross-polar: {} detections, in files whose names start with cross-\n",
            grouped(count)
        )
    });
    let more = match record.receivers() {
        [] => "",
        _ => ", and the same of each receiver,",
    };
    format!(
        "{regions}{} chirps, {}\n{receivers}{crossed}wrote {files}{more} to {} in \
         {total_s:.2} s\n",
        grouped(record.counts().chirps),
        counted(record.counts()),
        folder.display(),
    )
}

fn receiver(receiver: &ReceiverRecord) -> String {
    format!("receiver {}: {}\n", receiver.name, counted(receiver.counts))
}

fn counted(counts: Counts) -> String {
    let false_alarms = match counts.false_alarms {
        0 => String::new(),
        count => format!(" ({} false alarms)", grouped(count)),
    };
    format!(
        "{} hits, {} detections{false_alarms}, {} below the threshold",
        grouped(counts.hits),
        grouped(counts.detections),
        grouped(counts.below_threshold),
    )
}

fn value(folder: &Path, record: &ScanRecord, stages_ms: Vec<(&str, f64)>) -> Value {
    let timings: Map<String, Value> =
        stages_ms.into_iter().map(|(stage, ms)| (stage.to_owned(), json!(ms))).collect();
    json!({
        "output": folder.to_string_lossy(),
        "counts": record.counts(),
        "power_dbm": record.power_dbm(),
        "regions": record.regions(),
        "receivers": record.receivers(),
        "notices": record.notices(),
        "timings_ms": timings,
    })
}
