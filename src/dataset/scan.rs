//! One scan of a data set, from its target to rows and images.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::images::{self, ImageRecord, Members};
use super::labels::Labels;
use super::place::Put;
use super::points::{self, Counts};
use super::recipe::{Recipe, Target};
use super::table::Values;
use crate::error::Error;
use crate::geometry::Raster;

/// A scan that was made.
pub(super) struct MadeScan {
    /// Rows of its points, by columns.
    pub points: Vec<Values>,
    /// Its images; none where the data set has none.
    pub images: Members,
    /// For each mesh of the scene the chirps whose axis hits it.
    pub chirps_of_instance: Vec<u32>,
    pub record: ScanRow,
}

/// What is known of a scan as a whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ScanRow {
    /// Name, unique in the data set.
    pub key: String,
    pub split: String,
    /// Number among all.
    pub scan: u32,
    /// Number of its target: the same for its repeats.
    pub target: u32,
    pub seed: u64,
    pub noise_seed: u64,
    pub options: BTreeMap<String, String>,
    pub numbers: BTreeMap<String, f64>,
    pub texts: BTreeMap<String, String>,
    pub chirps: u32,
    pub hits: u32,
    pub detections: u32,
    pub threat_chirps: u32,
    /// BLAKE3 of the placed meshes: two scans with the same look at the same shapes.
    pub shapes: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<ImageRecord>,
}

impl Recipe {
    /// Makes a scan, by its number among all.
    ///
    /// # Errors
    /// A scene that cannot be, or cannot be rendered, by the scan's name.
    pub fn make(&self, number: u32) -> Result<MadeScan, Error> {
        self.first_that(number, |target| self.made(number, target))
    }

    fn made(&self, number: u32, target: Target) -> Result<MadeScan, Error> {
        let Target { ready, drawn, placed } = target;
        let assembly = ready.assemble();
        let setup = assembly.setup();
        let footprints = assembly.trace(&setup, &|_| ())?;
        let mut views = assembly.views(&setup, &footprints, &|_| ())?;
        views.extend(assembly.cross_polar_views(&setup, &footprints, &|_| ())?);

        let split = self.split_of_scan(number);
        let of_regions = ready.material_of_region.iter();
        let materials = of_regions.map(|&place| ready.materials[usize::from(place)].name.as_str());
        let target = &ready.scene.target;
        let labels = Labels::new(&self.classes, &target.meshes, materials);
        let (sights, object_shares) = labels.sights(&setup, &footprints);
        let mut chirps_of_instance = vec![0; target.meshes.len()];
        for sight in sights.iter().flatten() {
            chirps_of_instance[usize::from(sight.instance) - 1] += 1;
        }
        let (points, counts) =
            points::rows(&ready, number, &views, (&sights, &object_shares), &labels);

        let (mut images, mut image) = (Vec::new(), None);
        if self.spec.images {
            let measured: Vec<(String, Raster)> = views
                .iter()
                .map(|view| {
                    let name = view.file_name("", "");
                    let ending = name.trim_end_matches('.').trim_start_matches("cross-");
                    let crossed = if name.starts_with("cross-") { ".cross" } else { "" };
                    (format!("{crossed}{}", ending.replacen('-', ".", 1)), ready.image(&view.scan))
                })
                .collect();
            let (members, record) = images::members(&ready, &measured, &sights, &labels)?;
            (images, image) = (members, Some(record));
        }
        let mut shapes = blake3::Hasher::new();
        target.meshes.iter().for_each(|mesh| _ = shapes.update(mesh.placed_blake3.as_bytes()));
        let Counts { chirps, hits, detections, threat_chirps } = counts;
        let mut numbers = drawn.numbers;
        for (mesh, Put { rotation_deg, translation_m }) in placed {
            for (key, values) in [("rotation_deg", rotation_deg), ("translation_m", translation_m)]
            {
                for (axis, value) in values.into_iter().enumerate() {
                    numbers.insert(format!("mesh.{mesh}.{key}.{axis}"), value);
                }
            }
        }
        let file = &ready.scene.file;
        let record = ScanRow {
            key: self.key(number),
            split: split.name.clone(),
            scan: number,
            target: number / self.spec.repeats,
            seed: file.seed,
            noise_seed: file.noise_seed.unwrap_or(file.seed),
            options: drawn.options,
            numbers,
            texts: drawn.texts,
            chirps,
            hits,
            detections,
            threat_chirps,
            shapes: shapes.finalize().to_hex().to_string(),
            image,
        };
        Ok(MadeScan { points, images, chirps_of_instance, record })
    }
}
