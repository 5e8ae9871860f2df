//! A registered cloud and its curve: `pose.json` and a plot.

use std::path::Path;

use serde_json::{Value, json};

use crate::formats::figure::{Plot, Series, Style};
use crate::measure::{Curve, ReductionResult, RegistrationResult};
use crate::units::db_from_ratio;

/// What `pose.json` holds: pose with covariance, how the registration ended, and what became of the points.
pub fn pose_record(
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
        "verdicts": registered.verdicts,
        "curve": {
            "detected": detected,
            "censored": reduced.curve.observations.len() - detected,
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
pub fn measured_curve_plot<'a>(title: &'a str, curve: &Curve) -> Plot<'a> {
    let (mut detected, mut silent) = (Vec::new(), Vec::new());
    for row in &curve.observations {
        let Some(sigma0) = row.level_sigma0() else { continue };
        let points = if row.is_censored() { &mut silent } else { &mut detected };
        points.push((row.theta_i_rad.to_degrees(), db_from_ratio(sigma0)));
    }
    let series = [("not detected, below", silent), ("detected", detected)];
    Plot {
        title,
        subtitle: "measured cloud, reduced by equation (8)",
        x_label: "incidence, °",
        y_label: "σ⁰, dB",
        x_range: Some((0.0, 90.0)),
        y_range: None,
        equal: false,
        series: series
            .map(|(name, points)| Series { name: name.to_owned(), style: Style::Points, points })
            .into(),
    }
}
