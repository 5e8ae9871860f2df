//! `view.html` of a diagnosis: every detection with its residuals, and where the effects act that were found.

use std::collections::HashMap;

use glam::DVec3;

use super::around::{in_plane, instrument};
use super::page::{Curve, Kind, Numbers, Outlines, Points, Surface, Values, ViewPage};
use crate::diagnose::{Report, Row};
use crate::error::Error;
use crate::frames::{Global, Ray};
use crate::measure::nearest::Nearest;
use crate::report::cloud::Outline;
use crate::scene::Scene;
use crate::units::{db_from_ratio, dbm_from_watts};

/// A detection: what is known of its chirp, its power, and where it lies.
struct Detection<'a> {
    row: &'a Row,
    power_w: f64,
    point: DVec3,
}

/// A page of a diagnosis. Of several clouds it shows the first, which is that of the scene.
///
/// # Errors
/// A number that JSON does not have.
pub(in crate::report) fn diagnosis_page(scene: &Scene, report: &Report) -> Result<Vec<u8>, Error> {
    let ray_of: HashMap<u32, &Ray<Global>> =
        scene.chirps.number.iter().copied().zip(&scene.chirps.rays).collect();
    let detections: Vec<Detection> = report
        .rows
        .iter()
        .filter(|row| row.scan == 0)
        .filter_map(|row| {
            let (power_w, ray) = (row.observed_w?, ray_of.get(&row.chirp)?);
            let range_m = row.range_m + row.range_residual_m.unwrap_or(0.0);
            let point = ray.origin.xyz + range_m * ray.direction.xyz();
            Some(Detection { row, power_w, point })
        })
        .collect();
    let page = ViewPage {
        title: &scene.file.name,
        made_by: concat!("matdb ", env!("CARGO_PKG_VERSION")),
        kind: Kind::Diagnosis,
        points: Points {
            count: detections.len(),
            position_m: Numbers::places(detections.iter().map(|one| one.point)),
            columns: columns(scene, &detections),
        },
        mesh: Surface::of(&scene.target.mesh),
        radar: Some(instrument(scene)),
        image: None,
        shapes: outlines(scene, report),
        curve: Some(Curve { x: "incidence_deg", y: "residual_after_db" }),
    };
    page.bytes()
}

fn columns(scene: &Scene, detections: &[Detection]) -> Vec<Values> {
    let number = |name: &str, value: &dyn Fn(&Detection) -> f64| {
        Values::numbers(name, detections.iter().map(value))
    };
    let regions: Vec<&str> = scene.target.regions.iter().map(|one| one.name.as_str()).collect();
    let region_of = detections.iter().map(|one| Some(usize::from(one.row.region)));
    vec![
        number("residual_after_db", &|one| db_from_ratio(one.power_w / one.row.after_w)),
        number("residual_before_db", &|one| db_from_ratio(one.power_w / one.row.before_w)),
        number("power_dbm", &|one| dbm_from_watts(one.power_w)),
        number("before_dbm", &|one| dbm_from_watts(one.row.before_w)),
        number("after_dbm", &|one| dbm_from_watts(one.row.after_w)),
        number("unknown_db", &|one| one.row.unknown_db),
        number("incidence_deg", &|one| one.row.theta_rad.to_degrees()),
        number("azimuth_deg", &|one| one.row.azimuth_rad.to_degrees()),
        number("range_m", &|one| one.row.range_m),
        number("range_residual_m", &|one| one.row.range_residual_m.unwrap_or(f64::NAN)),
        number("xt_m", &|one| one.row.xt_m),
        number("yt_m", &|one| one.row.yt_m),
        number("edge_m", &|one| one.row.edge_m),
        number("time_s", &|one| one.row.time_s),
        number("chirp", &|one| one.row.chirp.into()),
        Values::named("region", &regions, "no region", region_of),
    ]
}

/// Where effects act in one part of the target: their outlines, moved from the target plane along the beam to the range of
/// the nearest chirp that meets the target.
fn outlines(scene: &Scene, report: &Report) -> Vec<Outlines> {
    /// An outline ends where no chirp meets the target within this.
    const NEAR_M: f64 = 0.05;
    let frames = scene.radar().frames();
    let origin = frames.origin().xyz;
    let aims: Vec<DVec3> =
        report.rows.iter().map(|row| DVec3::new(row.xt_m, row.yt_m, 0.0)).collect();
    let Some(aims) = Nearest::new(&aims) else { return Vec::new() };
    let mut found = Vec::new();
    for effect in &report.effects {
        let outline = Outline::new(effect, &report.rows, frames.pattern_range_m);
        let Some(outline) = outline else { continue };
        let places = outline.points_m().into_iter().filter_map(|[x_m, y_m]| {
            let (row, away_m) = aims.find(DVec3::new(x_m, y_m, 0.0));
            let towards = in_plane(&frames.global_from_target, x_m, y_m) - origin;
            (away_m < NEAR_M).then(|| origin + report.rows[row].range_m * towards.normalize())
        });
        let places: Vec<DVec3> = places.collect();
        if places.len() > 1 {
            found.push(Outlines {
                label: format!("{}: {}", effect.name, outline.name()),
                lines_m: Numbers::places(places.into_iter()),
            });
        }
    }
    found
}
