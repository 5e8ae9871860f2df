//! `scan.json`: every resolved value of a rendering, so that anyone can recompute any point.

use serde::Serialize;
use serde_json::{Value, json};

use super::views::View;
use crate::cli::materials::Found;
use crate::cli::staging::{self, Used};
use crate::effects::{Level, Model, entry};
use crate::formats::EffectEntry;
use crate::geometry::Raster;
use crate::material::Status;
use crate::radar::Radar;
use crate::render::{Scan, Truth};
use crate::scene::{MeshReport, Scene};
use crate::units::{dbm_from_watts, range, rounded};

/// Version of the layout of `scan.json`; it grows with every change that a reader could trip over.
const SCHEMA: u32 = 2;

/// How to get from the record to a power, for a reader without the program.
const EQUATION: &str = "power_w = transmit_power_w * 10^(-system_loss_db/10) * aperture_m2 / range_m^2 \
    * f_per_sr(incidence) * cos(incidence)^n, n = 2 for footprint \"paper\", 1 for \"projected\"; \
    f_per_sr is the scattering model of the point's material in backscatter; with scene.spot.rays > 1 the power is the \
    mean of this over the rays of the spot, and range and incidence are no longer those of one ray; docs/model.md has receivers elsewhere, \
    second surfaces, speckle and noise";

/// A rendering, as `scan.json` holds it.
#[derive(Serialize)]
pub(super) struct Record<'a> {
    schema: u32,
    program: &'static str,
    version: &'static str,
    equation: &'static str,
    scene: Value,
    radar: &'a Radar,
    frames: Value,
    /// What `cloud.ply` holds.
    cloud: &'static str,
    meshes: &'a [MeshReport],
    regions: Vec<RegionRecord<'a>>,
    materials: Vec<MaterialRecord<'a>>,
    /// Effects of the scene and of the radar, in the order in which they act.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    effects: Vec<EffectRecord>,
    threshold_dbm: f64,
    noise_dbm: Option<f64>,
    counts: Counts,
    power_dbm: Option<PowerRange>,
    image: Value,
    receivers: Vec<ReceiverRecord<'a>>,
    #[serde(skip)]
    scan_notices: &'a [String],
    #[serde(skip)]
    used: &'a [Used],
}

#[derive(Serialize)]
pub(super) struct RegionRecord<'a> {
    pub name: &'a str,
    /// Index into `materials`.
    pub material: u16,
    pub facets: usize,
    pub hits: usize,
    pub detections: usize,
    pub strongest_dbm: Option<f64>,
}

/// What a receiver beside the radar got.
#[derive(Serialize)]
pub(super) struct ReceiverRecord<'a> {
    pub name: &'a str,
    position_m: [f64; 3],
    aperture_m2: f64,
    threshold_dbm: f64,
    noise_dbm: Option<f64>,
    pub counts: Counts,
    power_dbm: Option<PowerRange>,
}

#[derive(Serialize)]
struct MaterialRecord<'a> {
    name: &'a str,
    revision: Option<u32>,
    origin: &'static str,
    kind: Option<&'static str>,
    /// Whether it may still be used.
    #[serde(skip_serializing_if = "Status::is_active")]
    status: &'a Status,
    content_blake3: String,
    frequency_ghz: [f64; 2],
    /// How far the radar's centre frequency lies outside of these, 0 within.
    frequency_outside_ghz: f64,
    theta_deg: [f64; 2],
    /// Detections at an incidence for which the material makes no claim.
    detections_outside_theta: usize,
    /// How far the farthest of them lies outside.
    theta_outside_deg: f64,
    scattering: &'a crate::brdf::Brdf,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    effects: Vec<EffectEntry>,
}

/// An effect with all of its parameters.
#[derive(Serialize)]
struct EffectRecord {
    level: Level,
    #[serde(flatten)]
    effect: EffectEntry,
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct Counts {
    pub chirps: usize,
    /// Chirps that met the target.
    pub hits: usize,
    /// Echoes and false alarms at or above the threshold.
    pub detections: usize,
    /// Detections that no surface caused.
    pub false_alarms: usize,
    pub below_threshold: usize,
    pub misses: usize,
    /// Detections beside the image's grid.
    pub outside_image: usize,
    pub degenerate_facets: usize,
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct PowerRange {
    pub weakest: f64,
    pub median: f64,
    pub strongest: f64,
}

impl<'a> Record<'a> {
    pub fn new(
        scene: &'a Scene,
        used: &'a [Used],
        model: Option<&Model>,
        material_of_region: &'a [u16],
        views: &[View<'a>],
        images: &[Raster],
        all_hits: bool,
    ) -> Record<'a> {
        let file = &scene.file;
        let (scan, image) = (&views[0].scan, &images[0]);
        let regions = regions(scene, material_of_region, scan);
        let outside = |material: usize| {
            let of_material = |truth: &&Truth| {
                usize::from(material_of_region[usize::from(truth.region)]) == material
            };
            let reach = used[material].found.material.reach();
            let beyond_rad = |truth: &Truth| reach.outside_rad(truth.hit.theta_rad());
            let known = scan.detections().filter_map(|echo| echo.truth.as_ref());
            let strange = known.filter(of_material).map(beyond_rad).filter(|rad| *rad > 0.0);
            strange.fold((0, 0.0), |(count, most), rad| (count + 1, rad.max(most)))
        };
        Record {
            schema: SCHEMA,
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            equation: EQUATION,
            scene: json!({
                "name": file.name,
                "seed": file.seed,
                "spot": file.spot,
                "bounce": file.bounce,
                "mesh": file.mesh,
                "region": file.region,
            }),
            radar: scene.radar(),
            frames: frames(scene),
            cloud: if all_hits { "every hit" } else { "detections" },
            meshes: &scene.target.meshes,
            threshold_dbm: dbm_from_watts(scan.threshold_w),
            noise_dbm: scan.noise_w.map(dbm_from_watts),
            counts: Counts::new(scene, scan, image),
            power_dbm: PowerRange::new(scan),
            image: json!({
                "width": image.width, "height": image.height, "pixel_m": image.pixel_m,
                "x_min_m": image.x_min_m, "y_min_m": image.y_min_m,
            }),
            materials: (0..used.len())
                .map(|number| MaterialRecord::new(&used[number], scene.radar(), outside(number)))
                .collect(),
            effects: effects(model),
            regions,
            receivers: std::iter::zip(views, images)
                .filter_map(|(view, image)| ReceiverRecord::new(scene, view, image))
                .collect(),
            scan_notices: &scene.chirps.notices,
            used,
        }
    }

    pub fn receivers(&self) -> &[ReceiverRecord<'a>] {
        &self.receivers
    }

    /// Sentences about what a person should not overlook.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = self.scan_notices.to_vec();
        let strange = |(material, _): &(&MaterialRecord, _)| material.detections_outside_theta > 0;
        for (material, used) in std::iter::zip(&self.materials, self.used).filter(strange) {
            let MaterialRecord { name, theta_outside_deg, .. } = material;
            let span_rad = used.found.material.reach().span_rad();
            notices.push(format!(
                "{} detections on `{name}` lie outside the {}° for which it is described, by up to {theta_outside_deg:.1}°",
                material.detections_outside_theta,
                range(span_rad.map(|rad| rounded(rad.to_degrees())))
            ));
        }
        for mesh in self.meshes.iter().filter(|mesh| mesh.degenerate_facets > 0) {
            let MeshReport { name, degenerate_facets, .. } = mesh;
            notices.push(format!(
                "facets of mesh `{name}` without an area, skipped: {degenerate_facets}"
            ));
        }
        let Counts { detections, outside_image, .. } = self.counts;
        let silent = |detections: usize, threshold_dbm: f64, antenna: &str| {
            let gate = self.radar.receiver.and_then(|receiver| receiver.gate_m);
            let gate = gate.map_or(String::new(), |[near_m, far_m]| {
                format!(" within the gate of {near_m} to {far_m} m")
            });
            (detections == 0).then(|| {
                format!("nothing{antenna} reaches the threshold of {threshold_dbm:.1} dBm{gate}")
            })
        };
        notices.extend(silent(detections, self.threshold_dbm, ""));
        for ReceiverRecord { name, counts, threshold_dbm, .. } in &self.receivers {
            let antenna = format!(" at receiver `{name}`");
            notices.extend(silent(counts.detections, *threshold_dbm, &antenna));
        }
        for region in self.regions.iter().filter(|region| region.facets == 0) {
            notices.push(format!("later regions took all facets of region `{}`", region.name));
        }
        if outside_image > 0 {
            notices.push(format!(
                "{outside_image} of {detections} detections lie beside the image, which covers what \
                 the scan sees at 8 m"
            ));
        }
        if let Some(PowerRange { strongest, .. }) = self.power_dbm
            && strongest > self.radar.transmit_power_dbm
        {
            notices.push(format!(
                "the strongest detection, {strongest:.1} dBm, exceeds the transmitted power; the \
                 target is too near or too bright for the power balance to hold"
            ));
        }
        notices.extend(staging::notices(self.used, self.radar));
        notices
    }

    pub fn regions(&self) -> &[RegionRecord<'a>] {
        &self.regions
    }

    /// The materials' names, with their revisions where two of one name are in the scene.
    pub fn material_names(&self) -> Vec<String> {
        let twice = |name: &str| self.materials.iter().filter(|m| m.name == name).count() > 1;
        let name = |material: &MaterialRecord| match material.revision {
            Some(revision) if twice(material.name) => format!("{}@{revision}", material.name),
            _ => material.name.to_owned(),
        };
        self.materials.iter().map(name).collect()
    }

    /// The materials' names with where they come from, for a person.
    pub fn material_origins(&self) -> Vec<String> {
        let origin = |material: &MaterialRecord| match material.revision {
            Some(revision) => format!("{}@{revision}", material.name),
            None => format!("{}, built in", material.name),
        };
        self.materials.iter().map(origin).collect()
    }

    pub fn counts(&self) -> Counts {
        self.counts
    }

    pub fn power_dbm(&self) -> Option<PowerRange> {
        self.power_dbm
    }
}

impl<'a> ReceiverRecord<'a> {
    fn new(scene: &Scene, view: &View<'a>, image: &Raster) -> Option<ReceiverRecord<'a>> {
        let receiver = view.receiver?;
        Some(ReceiverRecord {
            name: &receiver.name,
            position_m: receiver.position_m,
            aperture_m2: receiver.aperture_m2.unwrap_or(scene.radar().aperture_m2),
            threshold_dbm: dbm_from_watts(view.scan.threshold_w),
            noise_dbm: view.scan.noise_w.map(dbm_from_watts),
            counts: Counts::new(scene, &view.scan, image),
            power_dbm: PowerRange::new(&view.scan),
        })
    }
}

impl<'a> MaterialRecord<'a> {
    fn new(
        used: &'a Used,
        radar: &Radar,
        (detections_outside_theta, theta_outside_rad): (usize, f64),
    ) -> MaterialRecord<'a> {
        let Found { material, revision } = &used.found;
        let outside_hz = material.frequency_outside_hz(radar.centre_frequency_ghz * 1e9);
        let effects = used.effects.iter().map(|(effect, values)| entry(*effect, values));
        MaterialRecord {
            name: material.slug.as_str(),
            revision: *revision,
            origin: if revision.is_some() { "database" } else { "built-in" },
            kind: material.render_kind().map(|kind| kind.as_str()),
            status: &material.status,
            content_blake3: material.content_hash(),
            frequency_ghz: material.frequency_hz.map(|f| f / 1e9),
            frequency_outside_ghz: outside_hz / 1e9,
            theta_deg: material.theta_rad.map(f64::to_degrees),
            detections_outside_theta,
            theta_outside_deg: theta_outside_rad.to_degrees(),
            scattering: &used.scattering,
            effects: effects.collect(),
        }
    }
}

impl Counts {
    fn new(scene: &Scene, scan: &Scan, image: &Raster) -> Counts {
        let Scan { chirps, hits, .. } = *scan;
        let detections = scan.detections().count();
        let false_alarms = scan.detections().filter(|echo| echo.truth.is_none()).count();
        Counts {
            chirps,
            hits,
            detections,
            false_alarms,
            below_threshold: scan.echoes.len() - detections,
            misses: chirps - hits,
            outside_image: scan.detections().filter(|e| !image.contains(e.xt_m, e.yt_m)).count(),
            degenerate_facets: scene.target.meshes.iter().map(|m| m.degenerate_facets).sum(),
        }
    }
}

impl PowerRange {
    fn new(scan: &Scan) -> Option<PowerRange> {
        let mut powers: Vec<f64> =
            scan.detections().map(|echo| dbm_from_watts(echo.power_w)).collect();
        powers.sort_by(f64::total_cmp);
        let (weakest, strongest) = (*powers.first()?, *powers.last()?);
        Some(PowerRange { weakest, median: powers[powers.len() / 2], strongest })
    }
}

fn regions<'a>(scene: &'a Scene, material_of_region: &[u16], scan: &Scan) -> Vec<RegionRecord<'a>> {
    let mut regions: Vec<RegionRecord> = std::iter::zip(&scene.target.regions, material_of_region)
        .map(|(region, &material)| RegionRecord {
            name: &region.name,
            material,
            facets: region.facets,
            hits: 0,
            detections: 0,
            strongest_dbm: None,
        })
        .collect();
    for truth in scan.echoes.iter().filter_map(|echo| echo.truth) {
        regions[usize::from(truth.region)].hits += 1;
    }
    for echo in scan.detections() {
        let Some(truth) = echo.truth else { continue };
        let region = &mut regions[usize::from(truth.region)];
        region.detections += 1;
        let power_dbm = dbm_from_watts(echo.power_w);
        region.strongest_dbm = Some(region.strongest_dbm.map_or(power_dbm, |p| p.max(power_dbm)));
    }
    regions
}

/// Those of materials stand with their materials.
fn effects(model: Option<&Model>) -> Vec<EffectRecord> {
    let all = model.into_iter().flat_map(|model| &model.effects);
    let others = all.filter(|(effect, _)| effect.level() != Level::Material);
    others
        .map(|(effect, values)| EffectRecord {
            level: effect.level(),
            effect: entry(*effect, values),
        })
        .collect()
}

fn frames(scene: &Scene) -> Value {
    let frames = scene.radar().frames();
    let pose = frames.global_from_target;
    let rows: Vec<[f64; 3]> = (0..3).map(|row| pose.rotation().row(row).to_array()).collect();
    json!({
        "origin_global_m": frames.origin().xyz.to_array(),
        "global_from_target": {
            "rotation_rows": rows,
            "translation_m": pose.translation_m().to_array(),
        },
    })
}
