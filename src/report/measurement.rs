//! A measured cloud that is registered to its scene and reduced to a curve: `pose.json`, the curve and a plot.

use std::path::Path;

use serde_json::{Value, json};

use super::json::json_file;
use crate::effects::{Setting, find};
use crate::error::Error;
use crate::formats::figure::{Ink, Plot, Series, Style};
use crate::measure::freedom::Freedom;
use crate::measure::{Cloud, Curve, Reduction, ReductionResult, Registration, RegistrationResult};
use crate::scene::Scene;
use crate::units::db_from_ratio;

/// A measured cloud, the scene that was measured, and what is wanted of them.
#[derive(Clone, Copy)]
pub struct MeasurementRequest<'a> {
    /// The cloud's file, for the record.
    pub cloud_file: &'a Path,
    /// The measured cloud.
    pub cloud: &'a Cloud,
    /// The scene's file, for the record.
    pub scene_file: &'a Path,
    /// The scene that was measured.
    pub scene: &'a Scene,
    /// How the cloud is registered to the scene.
    pub registration: Registration,
    /// Only the region of this name; all of the scene for `None`.
    pub region: Option<&'a str>,
    /// How the registered cloud becomes a curve; its region is that of the name, and whether echoes are of whole spots is
    /// the scene's.
    pub reduction: Reduction,
}

/// A pose and a curve, and the files that hold them.
#[derive(Clone, Debug)]
pub struct MeasurementReport {
    /// The pose of the target.
    pub registered: RegistrationResult,
    /// The curve and what was left out of it.
    pub reduced: ReductionResult,
    /// What `pose.json` holds: pose with covariance, how the registration ended, and what became of the points.
    pub record: Value,
    /// Names and bytes: `pose.json`, `curve.csv` and `curve.svg`.
    pub files: [(&'static str, Vec<u8>); 3],
    /// What a person should not overlook.
    pub notices: Vec<String>,
}

impl MeasurementRequest<'_> {
    /// Registers the cloud, reduces it to a curve and encodes the files.
    ///
    /// # Errors
    /// A region that transmits, or that the scene does not have; what the registration or the reduction refuses.
    pub fn run(&self) -> Result<MeasurementReport, Error> {
        let (scene, cloud) = (self.scene, self.cloud);
        let (target, radar, chirps) = (&scene.target, scene.radar(), &scene.chirps);
        if target.transmits() {
            let problem = format!(
                "{}: a region transmits, and a measurement sees only what lies in front",
                self.scene_file.display()
            );
            let way_out =
                "measure with a scene without that region, or without its thickness_m or transmits";
            return Err(Error::usage(problem, way_out));
        }
        let region = self.region.map(|name| region_of_name(name, scene)).transpose()?;
        let of_spots = sees_spots(scene);
        let registration = Registration { of_spots, ..self.registration };
        let registered = registration.run(&target.mesh, radar, chirps, cloud)?;
        let reduction = Reduction { region, of_spots, ..self.reduction };
        let reduced = reduction.run(target, radar, chirps, cloud, &registered)?;
        let record = pose_record(self.cloud_file, self.scene_file, &registered, &reduced);
        let svg = measured_curve_plot(&scene.file.name, &reduced.curve).svg()?.into_bytes();
        let files = [
            ("pose.json", json_file(&record)?),
            ("curve.csv", reduced.curve.write()),
            ("curve.svg", svg),
        ];
        let mut notices = Vec::from_iter(self.mixed_regions());
        notices.extend([&cloud.notices[..], &registered.verdicts, &reduced.notices].concat());
        Ok(MeasurementReport { registered, reduced, record, files, notices })
    }

    /// A sentence when the curve mixes what the scene tells apart.
    fn mixed_regions(&self) -> Option<String> {
        let regions = &self.scene.target.regions;
        let first = regions.first()?;
        let is_mixed = regions.iter().any(|region| region.material != first.material);
        (self.region.is_none() && is_mixed).then(|| {
            format!(
                "the curve mixes the materials of the scene's regions; choose one with --region: {}",
                region_names(self.scene).join(", ")
            )
        })
    }
}

/// Whether a rendering of a scene sees whole spots: by several rays, or by an effect that stands for them.
fn sees_spots(scene: &Scene) -> bool {
    let entries = scene.file.radar.effect.iter();
    let mut effects = entries.filter_map(|entry| find(&entry.name));
    scene.file.spot.rays > 1
        || effects.any(|effect| {
            effect.about().conflicts.iter().any(|conflict| conflict.with == Setting::SeveralRays)
        })
}

fn region_names(scene: &Scene) -> Vec<&str> {
    scene.target.regions.iter().map(|region| region.name.as_str()).collect()
}

fn region_of_name(name: &str, scene: &Scene) -> Result<u16, Error> {
    let names = region_names(scene);
    let found = names.iter().position(|region| *region == name);
    found.map(|number| number as u16).ok_or_else(|| {
        Error::usage(
            format!("the scene has no region `{name}`"),
            format!("its regions are: {}", names.join(", ")),
        )
    })
}

fn pose_record(
    cloud: &Path,
    scene: &Path,
    registered: &RegistrationResult,
    reduced: &ReductionResult,
) -> Value {
    let pose = &registered.pose;
    let rows: Vec<[f64; 3]> = (0..3).map(|row| pose.rotation().row(row).to_array()).collect();
    let left_out = reduced.left_out;
    let detected = reduced.curve.detected().count();
    json!({
        "schema": 1,
        "cloud": cloud.display().to_string(),
        "scene": scene.display().to_string(),
        "meaning": "a vertex v of the scene's mesh was at rotation*v + translation, global frame, m",
        "pose": { "rotation_rows": rows, "translation_m": pose.translation_m().to_array() },
        "covariance": {
            "order": ["tx_m", "ty_m", "tz_m", "wx_rad", "wy_rad", "wz_rad"],
            "about_m": registered.pivot.xyz.to_array(),
            "matrix": registered.covariance,
            "widened_for_shared_errors": registered.widened,
        },
        "rms_m": registered.rms_m,
        "points": registered.points,
        "inliers": registered.inliers,
        "virtual_scans": registered.scans,
        "iterations": registered.iterations,
        "given_pose_kept": registered.kept,
        "converged": registered.converged,
        "stop": format!("{:?}", registered.stop).to_lowercase(),
        "free": registered.free.iter().map(Freedom::to_string).collect::<Vec<_>>(),
        "verdicts": registered.verdicts,
        "curve": {
            "detected": detected,
            "censored": reduced.curve.observations.len() - detected,
            "footprint": reduced.curve.illumination.footprint,
            "beam_rad": reduced.curve.illumination.beam_rad,
            "left_out": {
                "missed": left_out.missed,
                "off_surface": left_out.off_surface,
                "other_region": left_out.other_region,
                "near_edge": left_out.near_edge,
                "silent_near_edge": left_out.silent_near_edge,
                "unsure_of_facet": left_out.unsure_of_facet,
            },
        },
    })
}

/// The curve as points: detections, and thresholds of what was not detected.
fn measured_curve_plot<'a>(title: &'a str, curve: &Curve) -> Plot<'a> {
    let (mut detected, mut silent) = (Vec::new(), Vec::new());
    for row in &curve.observations {
        let Some(sigma0) = row.level_sigma0() else { continue };
        let points = if row.is_censored() { &mut silent } else { &mut detected };
        points.push((row.theta_i_rad.to_degrees(), db_from_ratio(sigma0)));
    }
    let series =
        [("not detected, below", Style::Below, silent), ("detected", Style::Points, detected)];
    Plot {
        title,
        subtitle: "measured cloud, reduced by equation (8)",
        x_label: "incidence, °",
        y_label: "σ⁰, dB",
        series: series
            .map(|(name, style, points)| Series {
                name: name.to_owned(),
                style,
                ink: Ink::Detections,
                points,
            })
            .into(),
        ..Plot::default()
    }
}
