//! `scan.json`: every resolved value of a rendering, so that anyone can recompute any point.

use serde::Serialize;
use serde_json::{Value, json};

use super::counts::{Counts, PowerRange, RegionRecord, regions};
use crate::brdf::Brdf;
use crate::effects::{Level, Model, entry};
use crate::formats::EffectEntry;
use crate::geometry::Raster;
use crate::material::{Lobes, Status};
use crate::radar::{Beam, Radar, SpeckleForm};
use crate::render::Scan;
use crate::scene::{MeshReport, Scene};
use crate::setup::{MaterialRevision, ReadyScene, SceneMaterial, ValidityWarning, View};
use crate::units::dbm_from_watts;

/// Version of the layout of `scan.json`; it grows with every change that a reader could trip over.
const SCHEMA: u32 = 3;

/// How to get from the record to a power, for a reader without the program.
const EQUATION: &str = "power_w = transmit_power_w * 10^(-system_loss_db/10) * solid_angle_sr \
    * f_per_sr(incidence) * cos(incidence)^n, n = 2 for footprint \"paper\", 1 for \"projected\"; \
    solid_angle_sr = wavelength_m^2 / (pi * w^2), or aperture_m2 / range_m^2 where the radar states an aperture; \
    w^2 = w0^2 + (wavelength_m * (range_m - focus_m) / (pi * w0))^2; \
    w0 = beam.waist_m * (1 + (edge_growth - 1) * r^2 / edge_m^2), r from the middle of the target plane to where \
    the beam's axis is after 8 m; \
    f_per_sr is the scattering model of the point's material in backscatter, its lobe convolved with the beam's slopes \
    exp(-s^2 / delta^2), delta = wavelength_m / (2 pi w0): m^2 + delta^2 in place of m^2 in D of beckmann, and delta in \
    place of a lobe_rad that is smaller or missing; a material whose lobes are \"radar-and-surface\" is seen as it is where \
    its narrowest lobe is at least delta wide, and widened to delta where it is not; with several returns passed_db of \
    the cloud adds to the level; with scene.spot.rays > 1 the power is the \
    mean of this over the rays of the spot, and range and incidence are no longer those of one ray; docs/model.md has receivers elsewhere, \
    second surfaces, speckle and noise";

/// What the equation has in addition where the air has a loss.
const AIR: &str = "; power_w has the factor 10^(-air_loss_db_per_m * path_m / 10), too, path_m = 2 * range_m, or the whole \
    length from the radar by way of all surfaces to the antenna";

/// A rendering, as `scan.json` holds it.
#[derive(Serialize)]
pub struct ScanRecord<'a> {
    schema: u32,
    program: &'static str,
    version: &'static str,
    equation: String,
    scene: Value,
    pub(super) radar: &'a Radar,
    /// The beam towards the middle of the target plane.
    beam: Value,
    /// How the speckle was made; nothing without speckle.
    #[serde(skip_serializing_if = "Option::is_none")]
    speckle_form: Option<SpeckleForm>,
    frames: Value,
    /// What `cloud.ply` holds.
    cloud: &'static str,
    pub(super) meshes: &'a [MeshReport],
    pub(super) regions: Vec<RegionRecord<'a>>,
    pub(super) materials: Vec<MaterialRecord<'a>>,
    /// Effects of the scene and of the radar, in the order in which they act.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    effects: Vec<EffectRecord>,
    pub(super) threshold_dbm: f64,
    noise_dbm: Option<f64>,
    pub(super) counts: Counts,
    pub(super) power_dbm: Option<PowerRange>,
    image: Value,
    /// Where a model is used outside of what its derivation allows.
    pub(super) validity: Vec<ValidityWarning>,
    pub(super) receivers: Vec<ReceiverRecord<'a>>,
    /// What the antennas received across the polarisation that was sent; empty if they do not.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cross_polar: Vec<CrossPolarRecord<'a>>,
    /// Rays that end at a sheet, because they have passed as many as they may.
    #[serde(skip)]
    pub(super) rays_ended: usize,
    #[serde(skip)]
    pub(super) ready: &'a ReadyScene,
}

/// What a receiver apart from the radar received.
#[derive(Serialize)]
pub struct ReceiverRecord<'a> {
    /// Its name.
    pub name: &'a str,
    position_m: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    aperture_m2: Option<f64>,
    pub(super) threshold_dbm: f64,
    noise_dbm: Option<f64>,
    /// What became of the chirps there.
    pub counts: Counts,
    power_dbm: Option<PowerRange>,
}

/// What an antenna received across the polarisation that was sent.
#[derive(Serialize)]
struct CrossPolarRecord<'a> {
    /// The receiver; `null` for the radar.
    receiver: Option<&'a str>,
    /// Detections at or above the antenna's threshold.
    detections: usize,
    power_dbm: Option<PowerRange>,
}

/// A material of the scene.
#[derive(Serialize)]
pub(super) struct MaterialRecord<'a> {
    pub name: &'a str,
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
    pub detections_outside_theta: usize,
    /// How far the farthest of them lies outside.
    pub theta_outside_deg: f64,
    scattering: &'a Brdf,
    /// Whose lobes the model has, as they are rendered.
    lobes: Lobes,
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

/// Detections at an incidence for which a material makes no claim.
struct OutsideTheta {
    detections: usize,
    /// How far the farthest of them lies outside.
    most_rad: f64,
}

impl OutsideTheta {
    /// Of the material of this number among those of the scene.
    fn new(ready: &ReadyScene, scan: &Scan, material: u16) -> OutsideTheta {
        let mut outside = OutsideTheta { detections: 0, most_rad: 0.0 };
        let reach = ready.materials[usize::from(material)].found.material.reach();
        for truth in scan.detections().filter_map(|echo| echo.truth.as_ref()) {
            let rad = reach.outside_rad(truth.hit.theta_rad());
            let is_of = ready.material_of_region[usize::from(truth.region)] == material;
            if is_of && rad > 0.0 {
                outside.detections += 1;
                outside.most_rad = rad.max(outside.most_rad);
            }
        }
        outside
    }
}

impl<'a> ScanRecord<'a> {
    /// The record of a rendering. `views` and `images` are those of the radar and then of every receiver,
    /// `crossed` those of the cross-polar channel; `all_hits` says that the clouds hold echoes below the threshold, too.
    ///
    /// # Panics
    /// When `views` or `images` is empty.
    pub(super) fn new(
        ready: &'a ReadyScene,
        model: Option<&Model>,
        views: &[View<'a>],
        crossed: &[View<'a>],
        images: &[Raster],
        validity: Vec<ValidityWarning>,
        all_hits: bool,
    ) -> ScanRecord<'a> {
        let scene = &ready.scene;
        let file = &scene.file;
        let (scan, image) = (&views[0].scan, &images[0]);
        let mut materials = Vec::new();
        for (number, used) in (0u16..).zip(&ready.materials) {
            materials.push(MaterialRecord::new(
                used,
                scene.radar(),
                OutsideTheta::new(ready, scan, number),
            ));
        }
        ScanRecord {
            schema: SCHEMA,
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            equation: equation(scene.radar()),
            scene: json!({
                "name": file.name,
                "seed": file.seed,
                "noise_seed": file.noise_seed.unwrap_or(file.seed),
                "spot": file.spot,
                "bounce": file.bounce,
                "mesh": file.mesh,
                "region": file.region,
            }),
            radar: scene.radar(),
            beam: beam(scene.radar()),
            speckle_form: ready.speckle_form(),
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
            validity,
            materials,
            effects: effects(model),
            regions: regions(ready, scan),
            receivers: std::iter::zip(views, images)
                .filter_map(|(view, image)| ReceiverRecord::new(scene, view, image))
                .collect(),
            cross_polar: crossed.iter().map(CrossPolarRecord::new).collect(),
            rays_ended: 0,
            ready,
        }
    }

    /// What the receivers apart from the radar received.
    pub fn receivers(&self) -> &[ReceiverRecord<'a>] {
        &self.receivers
    }

    /// Number of the radar's detections across the polarisation that was sent; `None` if it does not receive them.
    pub fn cross_polar_detections(&self) -> Option<usize> {
        self.cross_polar.first().map(|crossed| crossed.detections)
    }

    /// What the radar received of every region.
    pub fn regions(&self) -> &[RegionRecord<'a>] {
        &self.regions
    }

    /// The materials' names, with their revisions where two of one name are in the scene.
    pub fn material_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for MaterialRecord { name, revision, .. } in &self.materials {
            let of_name = self.materials.iter().filter(|other| other.name == *name).count();
            names.push(match revision {
                Some(revision) if of_name > 1 => format!("{name}@{revision}"),
                _ => (*name).to_owned(),
            });
        }
        names
    }

    /// The materials' names with where they come from, for a person.
    pub fn material_origins(&self) -> Vec<String> {
        let mut origins = Vec::new();
        for MaterialRecord { name, revision, .. } in &self.materials {
            origins.push(match revision {
                Some(revision) => format!("{name}@{revision}"),
                None => format!("{name}, built in"),
            });
        }
        origins
    }

    /// What became of the chirps at the radar.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Powers of the radar's detections; `None` without any.
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
            aperture_m2: receiver.aperture_m2.or(scene.radar().aperture_m2),
            threshold_dbm: dbm_from_watts(view.scan.threshold_w),
            noise_dbm: view.scan.noise_w.map(dbm_from_watts),
            counts: Counts::new(scene, &view.scan, image),
            power_dbm: PowerRange::new(&view.scan),
        })
    }
}

impl<'a> CrossPolarRecord<'a> {
    fn new(view: &View<'a>) -> CrossPolarRecord<'a> {
        CrossPolarRecord {
            receiver: view.receiver.map(|receiver| receiver.name.as_str()),
            detections: view.scan.detections().count(),
            power_dbm: PowerRange::new(&view.scan),
        }
    }
}

impl<'a> MaterialRecord<'a> {
    fn new(used: &'a SceneMaterial, radar: &Radar, outside: OutsideTheta) -> MaterialRecord<'a> {
        let MaterialRevision { material, revision } = &used.found;
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
            detections_outside_theta: outside.detections,
            theta_outside_deg: outside.most_rad.to_degrees(),
            scattering: &used.scattering,
            lobes: used.rendered_lobes(),
            effects: effects.collect(),
        }
    }
}

/// The effects of the scene and of the radar; those of materials are in the records of their materials.
fn effects(model: Option<&Model>) -> Vec<EffectRecord> {
    let mut records = Vec::new();
    for (effect, values) in model.map_or(&[][..], |model| &model.effects) {
        let level = effect.level();
        if level != Level::Material {
            records.push(EffectRecord { level, effect: entry(*effect, values) });
        }
    }
    records
}

fn equation(radar: &Radar) -> String {
    let air = if radar.air_loss_db_per_m == 0.0 { "" } else { AIR };
    format!("{EQUATION}{air}")
}

/// What the beam is derived from, in m.
fn beam(radar: &Radar) -> Value {
    let beam = Beam::new(radar).towards(0.0, 0.0);
    json!({
        "wavelength_m": beam.wavelength_m,
        "waist_m": beam.waist_m,
        "rayleigh_m": beam.rayleigh_m(),
    })
}

/// The radar's frames: where the global frame has the origin and the target's axes.
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
