//! The files of a rendering, as bytes: three for each antenna and polarisation that it receives.

use super::record::ScanRecord;
use crate::error::Error;
use crate::formats::exr::{self, Attribute, Packing};
use crate::formats::figure::{Figure, Scale};
use crate::formats::ply;
use crate::formats::words::grouped;
use crate::geometry::Raster;
use crate::radar::{Channel, Returns};
use crate::render::{Echo, Scan, cloud_table};
use crate::scene::Scene;
use crate::setup::{ReadyScene, View};
use crate::units::dbm_from_watts;

/// Encodes image and cloud of every view; `all` puts hits below the threshold into the clouds, too.
pub(super) fn encode(
    all: bool,
    packing: Packing,
    ready: &ReadyScene,
    views: &[View],
    images: &[Raster],
    record: &ScanRecord,
) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let scene = &ready.scene;
    let regions: Vec<&str> = scene.target.regions.iter().map(|r| r.name.as_str()).collect();
    let materials = record.material_names();
    let materials: Vec<&str> = materials.iter().map(String::as_str).collect();
    let several = scene.target.transmits() || scene.radar().returns != Returns::Strongest;
    let exr = |image| exr::write_packed(image, &exr_attributes(image, &materials), packing);
    let cloud = |view: &View| {
        let echoes: Vec<&Echo> =
            if all { view.scan.echoes.iter().collect() } else { view.scan.detections().collect() };
        let table = cloud_table(&echoes, &ready.material_of_region, &regions, &materials, several);
        ply::write_table(&table)
    };
    let mut files = Vec::new();
    for (view, image) in std::iter::zip(views, images) {
        let (figure, (exr, cloud)) =
            rayon::join(|| power_figure(scene, view, image), || (exr(image), cloud(view)));
        files.push((view.file_name("power", "exr"), exr?));
        files.push((view.file_name("power", "png"), figure?));
        files.push((view.file_name("cloud", "ply"), cloud?));
    }
    Ok(files)
}

/// Whether a file of this name is one of a rendering, for an antenna or another.
pub(super) fn is_of_a_rendering(name: &str) -> bool {
    let (stem, extension) = name.rsplit_once('.').unwrap_or((name, ""));
    let stem = stem.strip_prefix("cross-").unwrap_or(stem);
    let quantity = stem.split_once('-').map_or(stem, |(quantity, _)| quantity);
    matches!((quantity, extension), ("power", "exr" | "png") | ("cloud", "ply") | ("beat", "npy"))
}

/// What a raster does not say by itself: its far edges, and names for the `material` channel.
fn exr_attributes(image: &Raster, materials: &[&str]) -> Vec<(String, Attribute)> {
    let end_m =
        |min_m: f64, pixels: usize| Attribute::Number(min_m + pixels as f64 * image.pixel_m);
    let named = |(number, name): (usize, &&str)| {
        (format!("material{number}"), Attribute::Text((*name).to_owned()))
    };
    [
        ("xMaxM".to_owned(), end_m(image.x_min_m, image.width)),
        ("yMaxM".to_owned(), end_m(image.y_min_m, image.height)),
    ]
    .into_iter()
    .chain(materials.iter().enumerate().map(named))
    .collect()
}

/// Number of chirps with a detection, of which a chirp may have several.
fn detected_chirps(scan: &Scan) -> usize {
    let chirps: Vec<u32> = scan.detections().map(|echo| echo.chirp).collect();
    chirps.chunk_by(|a, b| a == b).count()
}

fn power_figure(scene: &Scene, view: &View, image: &Raster) -> Result<Vec<u8>, Error> {
    let scan = &view.scan;
    let mut antenna = scene.radar().preset.clone();
    if let Some(receiver) = view.receiver {
        antenna.push_str(&format!(", receiver {}", receiver.name));
    }
    if view.channel == Channel::CrossPolar {
        antenna.push_str(", cross-polar");
    }
    let threshold_dbm = (10.0 * dbm_from_watts(scan.threshold_w)).round() / 10.0;
    let subtitle = format!(
        "{antenna}, {} of {} chirps ≥ {} dBm",
        grouped(detected_chirps(scan)),
        grouped(scan.chirps),
        threshold_dbm.to_string().replace('-', "−")
    );
    let figure = Figure {
        raster: image,
        channel: "power_dbm",
        title: &scene.file.name,
        subtitle: &subtitle,
        colour_label: "received power, dBm",
        range: None,
        scale: Scale::Sequential,
        gaps: "no detection",
        x_label: "x in the target plane, m",
        y_label: "y in the target plane, m",
    };
    Ok(figure.png()?)
}
