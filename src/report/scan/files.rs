//! The files of a rendering, as bytes: three for each antenna and polarisation that it receives.

use super::glb::rendering_glb;
use super::record::ScanRecord;
use crate::error::Error;
use crate::formats::exr::{self, Attribute, Packing};
use crate::formats::figure::{Figure, Scale, colours_of};
use crate::formats::ply::{self, Column, Scalar, Table};
use crate::formats::words::grouped;
use crate::geometry::Raster;
use crate::radar::{Channel, Returns};
use crate::render::{COLOURS, Echo, Scan, cloud_table};
use crate::report::view::rendering_page;
use crate::scene::Scene;
use crate::setup::{ReadyScene, View};
use crate::units::dbm_from_watts;

/// What the files of a view hold.
#[derive(Clone, Copy)]
pub(super) struct Content {
    /// Whether the clouds hold hits below the threshold, too.
    pub all_hits: bool,
    /// How the EXR images are packed.
    pub packing: Packing,
    /// Whether there is a page that shows the cloud in three dimensions.
    pub view: bool,
    /// Whether there is a file that other programs show in three dimensions.
    pub glb: bool,
}

impl Content {
    /// Encodes image and cloud of every view.
    pub fn encode(
        self,
        ready: &ReadyScene,
        views: &[View],
        images: &[Raster],
        record: &ScanRecord,
    ) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let scene = &ready.scene;
        let materials = record.material_names();
        let materials: Vec<&str> = materials.iter().map(String::as_str).collect();
        let mut files = Vec::new();
        for (view, image) in std::iter::zip(views, images) {
            let (figure, (exr, (table, cloud))) = rayon::join(
                || power_figure(scene, view, image),
                || {
                    let attributes = exr_attributes(image, &materials);
                    let table = self.cloud(ready, view, &materials);
                    let cloud = ply::write_table(&table);
                    let picture = colours_of(image.channel("power_dbm").unwrap_or_default());
                    let exr = exr::write_packed(image, &attributes, Some(&picture), self.packing);
                    (exr, (table, cloud))
                },
            );
            files.push((view.file_name("power", "exr"), exr?));
            files.push((view.file_name("power", "png"), figure?));
            files.push((view.file_name("cloud", "ply"), cloud?));
            if self.view {
                let page = rendering_page(scene, &table, image, &materials)?;
                files.push((view.file_name("view", "html"), page));
            }
            if self.glb {
                files.push((view.file_name("cloud", "glb"), rendering_glb(scene, &table)?));
            }
        }
        Ok(files)
    }

    /// The cloud of a view, with a colour for each point.
    fn cloud(self, ready: &ReadyScene, view: &View, materials: &[&str]) -> Table {
        let target = &ready.scene.target;
        let regions: Vec<&str> = target.regions.iter().map(|region| region.name.as_str()).collect();
        let several = target.transmits() || ready.scene.radar().returns != Returns::Strongest;
        let echoes: Vec<&Echo> = if self.all_hits {
            view.scan.echoes.iter().collect()
        } else {
            view.scan.detections().collect()
        };
        let mut table =
            cloud_table(&echoes, &ready.material_of_region, &regions, materials, several);
        table.columns.extend(colours(&table));
        table
    }
}

/// Red, green and blue of the points of a cloud, by their power.
fn colours(cloud: &Table) -> Vec<Column> {
    let powers_dbm = cloud.column("power_dbm").unwrap_or_default();
    let powers_dbm: Vec<f32> = powers_dbm.iter().map(|power_dbm| *power_dbm as f32).collect();
    let colours = colours_of(&powers_dbm);
    let columns = COLOURS.into_iter().enumerate().map(|(place, name)| Column {
        name: name.to_owned(),
        scalar: Scalar::UChar,
        values: colours.iter().map(|colour| colour[place].into()).collect(),
    });
    columns.collect()
}

/// Whether a file of this name is one of a rendering, for an antenna or another.
pub(super) fn is_of_a_rendering(name: &str) -> bool {
    let (stem, extension) = name.rsplit_once('.').unwrap_or((name, ""));
    let stem = stem.strip_prefix("cross-").unwrap_or(stem);
    let quantity = stem.split_once('-').map_or(stem, |(quantity, _)| quantity);
    matches!(
        (quantity, extension),
        ("power", "exr" | "png") | ("cloud", "ply" | "glb") | ("beat", "npy") | ("view", "html")
    )
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
