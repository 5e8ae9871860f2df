//! `view.html` of a diagnosis: every detection with its residuals, and where the effects act that were found.

use std::collections::HashMap;

use glam::DVec3;

use super::around::{in_plane, instrument};
use super::page::{Curve, Kind, Numbers, Outlines, Points, Surface, Values, ViewPage};
use crate::diagnose::{Report, Row};
use crate::error::Error;
use crate::frames::{Global, Ray};
use crate::report::cloud::outline::{Outline, distance_m, nearest};
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
/// Never, for a report of this scene.
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
/// the nearest chirp.
fn outlines(scene: &Scene, report: &Report) -> Vec<Outlines> {
    let frames = scene.radar().frames();
    let origin = frames.origin().xyz;
    let mut found = Vec::new();
    for effect in &report.effects {
        let outline = Outline::new(effect, &report.rows, frames.pattern_range_m);
        let Some(outline) = outline else { continue };
        let places = outline.points_m().into_iter().filter_map(|[x_m, y_m]| {
            let range_m = range_m_at(&report.rows, x_m, y_m)?;
            let towards = in_plane(&frames.global_from_target, x_m, y_m) - origin;
            Some(origin + range_m * towards.normalize())
        });
        let places: Vec<DVec3> = places.collect();
        if places.len() > 1 {
            found.push(Outlines {
                label: format!("{}: {}", effect.name, outline.name()),
                lines_m: Numbers::places(places.into_iter()),
                closed: false,
            });
        }
    }
    found
}

/// Range of the mesh next to a place in the target plane, m; none where no chirp meets it near there.
fn range_m_at(rows: &[Row], x_m: f64, y_m: f64) -> Option<f64> {
    const NEAR_M: f64 = 0.05;
    let nearest = nearest(rows, x_m, y_m)?;
    (distance_m(nearest, x_m, y_m) < NEAR_M).then_some(nearest.range_m)
}
