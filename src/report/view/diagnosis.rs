//! `view.html` of a diagnosis: every detection with its residuals, and where the effects act that were found.

use glam::DVec3;

use super::around::{in_plane, instrument, plane_image};
use super::page::{Curve, Numbers, Outlines, PlaneImage, Points, Surface, Values, ViewPage};
use crate::diagnose::{FoundEffect, Report, Row};
use crate::error::Error;
use crate::formats::figure::Scale;
use crate::formats::words::digits;
use crate::geometry::Mesh;
use crate::measure::nearest::Nearest;
use crate::radar::RadarFrames;
use crate::report::cloud::{CHANNEL, Outline, map_after};
use crate::scene::Scene;
use crate::units::{db_from_ratio, dbm_from_watts};

/// A detection: what is known of its chirp, its power, and where the cloud has it.
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
    let rows = of_first_cloud(&report.rows);
    let detections = detections(&rows);
    let mesh = &scene.target.mesh;
    let effects: Vec<&FoundEffect> = report.effects.iter().filter(|one| acts_here(one)).collect();
    let page = ViewPage {
        title: &scene.file.name,
        kind: "Diagnosed cloud",
        notes: [first_of(report.clouds.len()), Surface::left_out(mesh), moved_by(&effects, mesh)]
            .into_iter()
            .flatten()
            .collect(),
        points: Points {
            count: detections.len(),
            position_m: Numbers::places(detections.iter().map(|one| one.point)),
            columns: columns(scene, &detections),
        },
        mesh: Surface::of(mesh),
        radar: instrument(scene.radar(), &scene.chirps),
        image: residual_image(scene, &rows)?,
        shapes: outlines(scene, &rows, &effects).into_iter().chain(moved(mesh, &effects)).collect(),
        curve: Curve { x: "incidence_deg", y: "residual_after_db" },
        balls: None,
    };
    page.bytes()
}

/// The rows of the cloud that the page shows. Those of other clouds have other ranges.
fn of_first_cloud(rows: &[Row]) -> Vec<Row> {
    rows.iter().filter(|row| row.scan == 0).copied().collect()
}

fn detections(rows: &[Row]) -> Vec<Detection<'_>> {
    let detected = rows
        .iter()
        .filter_map(|row| Some(Detection { row, power_w: row.observed_w?, point: row.point?.xyz }));
    detected.collect()
}

/// A sentence on the clouds of a joint diagnosis; none for one cloud.
fn first_of(clouds: usize) -> Option<String> {
    (clouds > 1).then(|| format!("This page shows the first of {clouds} clouds."))
}

/// Whether an effect acts on the cloud that the page shows.
fn acts_here(effect: &FoundEffect) -> bool {
    effect.scans.is_empty() || effect.scans.contains(&0)
}

/// A sentence on an effect that moves the target from where the scene has it.
fn moved_by(effects: &[&FoundEffect], mesh: &Mesh) -> Option<String> {
    let name = effects.iter().find(|one| !one.motions.is_empty())?.name;
    let drawn = Surface::of(mesh).map_or("", |_| {
        " Its mesh is drawn in grey where the scene has it, and in colour where the effect places it."
    });
    Some(format!("The effect {name} moves the target.{drawn}"))
}

fn columns(scene: &Scene, detections: &[Detection]) -> Vec<Values> {
    let number = |name: &str, value: &dyn Fn(&Detection) -> f64| {
        Values::numbers(name, detections.iter().map(value))
    };
    let regions: Vec<&str> = scene.target.regions.iter().map(|one| one.name.as_str()).collect();
    let region_of = detections.iter().map(|one| Some(usize::from(one.row.region)));
    let of_region: Vec<&str> =
        scene.target.regions.iter().map(|one| one.material.as_str()).collect();
    let mut materials = of_region.clone();
    materials.sort_unstable();
    materials.dedup();
    let material_of = detections.iter().map(|one| {
        let material = of_region.get(usize::from(one.row.region))?;
        materials.binary_search(material).ok()
    });
    let mut columns = vec![
        number("residual_after_db", &|one| db_from_ratio(one.power_w / one.row.after_w)),
        number("residual_before_db", &|one| db_from_ratio(one.power_w / one.row.before_w)),
        number("power_dbm", &|one| dbm_from_watts(one.power_w)),
        number("before_dbm", &|one| dbm_from_watts(one.row.before_w)),
        number("after_dbm", &|one| dbm_from_watts(one.row.after_w)),
        number("unknown_db", &|one| one.row.unknown_db),
        number("incidence_deg", &|one| one.row.theta_rad.to_degrees()),
        number("azimuth_deg", &|one| one.row.azimuth_rad.to_degrees()),
        number("range_m", &|one| one.row.measured_range_m.unwrap_or(f64::NAN)),
        number("range_residual_m", &|one| one.row.range_residual_m.unwrap_or(f64::NAN)),
        number("xt_m", &|one| one.row.xt_m),
        number("yt_m", &|one| one.row.yt_m),
        number("edge_m", &|one| one.row.edge_m),
        number("time_s", &|one| one.row.time_s),
        number("chirp", &|one| one.row.chirp.into()),
        Values::named("region", &regions, "no region", region_of),
        Values::named("material", &materials, "no material", material_of),
    ];
    let ranks = detections.iter().map(|one| one.row.rank);
    if ranks.clone().flatten().next().is_some() {
        columns.push(Values::ranks(ranks));
    }
    columns
}

/// The mean residual over the target plane; none without a detection.
fn residual_image(scene: &Scene, rows: &[Row]) -> Result<Option<PlaneImage>, Error> {
    if rows.iter().all(|row| row.observed_w.is_none()) {
        return Ok(None);
    }
    let (map, reach_db) = map_after(rows, scene.radar().spot_fwhm_m());
    let [blue, red] = [-reach_db, reach_db].map(digits);
    let label = format!(
        "Observed − predicted power with the effects, from {blue} dB (blue) to {red} dB (red)"
    );
    let colours = (Scale::Diverging, Some((-reach_db, reach_db)));
    plane_image(&map, CHANNEL, colours, label).map(Some)
}

/// Where effects act in one part of the target: their outlines, moved from the target plane along the beam to
/// the range of the nearest chirp that meets the target. An outline has a gap where none does.
fn outlines(scene: &Scene, rows: &[Row], effects: &[&FoundEffect]) -> Vec<Outlines> {
    let Some(target) = SeenTarget::new(scene, rows) else { return Vec::new() };
    let outlines = effects.iter().filter_map(|effect| {
        let outline = Outline::new(effect, rows, target.frames.pattern_range_m)?;
        let label = format!("{}: {}", effect.name, outline.name());
        let places = outline.points_m().into_iter().map(|place_m| target.place(place_m));
        Outlines::new(label, &places.collect::<Vec<_>>())
    });
    outlines.collect()
}

/// The mesh where effects place it; none of one that is not drawn.
fn moved(mesh: &Mesh, effects: &[&FoundEffect]) -> Vec<Outlines> {
    if Surface::of(mesh).is_none() {
        return Vec::new();
    }
    let moved = effects.iter().flat_map(|effect| {
        let times: &[&str] = match effect.motions.len() {
            1 => &["target"],
            _ => &["target as the scan begins", "target as it ends"],
        };
        let motions = times.iter().zip(&effect.motions);
        motions.map(|(when, motion)| Outlines::moved(format!("{}: {when}", effect.name), *motion))
    });
    moved.collect()
}

/// The target as the chirps of one cloud meet it.
struct SeenTarget<'a> {
    frames: RadarFrames,
    rows: &'a [Row],
    /// Where the chirps meet the target plane, m.
    aims: Nearest,
}

impl SeenTarget<'_> {
    /// None where no chirp meets the target.
    fn new<'a>(scene: &Scene, rows: &'a [Row]) -> Option<SeenTarget<'a>> {
        let aims: Vec<DVec3> = rows.iter().map(|row| DVec3::new(row.xt_m, row.yt_m, 0.0)).collect();
        Some(SeenTarget { frames: scene.radar().frames(), rows, aims: Nearest::new(&aims)? })
    }

    /// A place of the target plane, moved along the beam to the range of the nearest chirp; none where no chirp is near.
    fn place(&self, [x_m, y_m]: [f64; 2]) -> Option<DVec3> {
        /// In the target plane, m.
        const NEAR_M: f64 = 0.05;
        let (row, away_m) = self.aims.find(DVec3::new(x_m, y_m, 0.0));
        let origin = self.frames.origin().xyz;
        let towards = in_plane(&self.frames.global_from_target, x_m, y_m) - origin;
        (away_m < NEAR_M).then(|| origin + self.rows[row].range_m * towards.normalize())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DMat3;
    use serde_json::Value;

    use super::*;
    use crate::diagnose::{Evidence, Parameters};
    use crate::effects::{Level, Place};
    use crate::frames::{Point, Pose};
    use crate::report::cloud::testing::{row, square};

    fn scene() -> Scene {
        Scene::load(Path::new("builtin:calibration-plate")).unwrap()
    }

    /// An effect in these scans, within 0.1 m of the middle of `square`.
    fn found(name: &'static str, scans: Vec<u16>) -> FoundEffect {
        FoundEffect {
            name,
            level: Level::Scene,
            scans,
            class: Vec::new(),
            parameters: Parameters::default(),
            place: Some(Place::Round { x_m: 0.2, y_m: 0.2, radius_m: 0.1 }),
            motions: Vec::new(),
            evidence: Evidence {
                gain: 0.0,
                placebo_gain: 0.0,
                held_out_gain: 0.0,
                held_out_se: 0.0,
                size_db: 0.0,
                by_cloud: Vec::new(),
            },
        }
    }

    #[test]
    fn a_detection_is_drawn_where_it_was_measured_although_a_pose_explains_it() {
        // The target stands 30 mm behind its mesh, and the model with its pose leaves no residual.
        let point = Point::new(0.0, 1.1, -0.03);
        let moved = Row {
            measured_range_m: Some(8.03),
            point: Some(point),
            range_residual_m: Some(0.0),
            ..row()
        };
        let silent = Row { observed_w: None, point: None, ..row() };
        let rows = [moved, silent];
        let [one] = &detections(&rows)[..] else { panic!() };
        assert_eq!(one.point, point.xyz);
        let columns = serde_json::to_value(columns(&scene(), &detections(&rows))).unwrap();
        let columns = columns.as_array().unwrap();
        let column = |name: &str| columns.iter().find(|one| one["name"] == name).unwrap();
        for one in columns {
            let is_plain = one["name"] == "region" || one["name"] == "material";
            assert!(is_plain || one["label"] != one["name"], "{}", one["name"]);
        }
        let range = column("range_m");
        assert_eq!(
            range["values"],
            serde_json::to_value(Numbers::floats([8.03].into_iter())).unwrap()
        );
        assert_eq!([&range["label"], &range["unit"]], ["range", "m"]);
        assert_eq!(column("material")["names"], serde_json::json!(["steel"]));
    }

    #[test]
    fn returns_have_entries_where_chirps_have_several() {
        let column = |ranks: [Option<u32>; 2]| {
            let rows = ranks.map(|rank| Row { rank, ..row() });
            let columns = serde_json::to_value(columns(&scene(), &detections(&rows))).unwrap();
            columns.as_array().unwrap().iter().find(|one| one["name"] == "rank").cloned()
        };
        assert_eq!(column([None, None]), None);
        let ranks = column([Some(1), Some(3)]).unwrap();
        assert_eq!(ranks["names"], serde_json::json!(["1", "2", "3"]));
        assert_eq!(ranks["label"], "return number in the chirp, 1 the strongest");
        assert_eq!(ranks["values"], serde_json::json!({ "u16": "AAACAA==" }));
    }

    #[test]
    fn outlines_lie_on_the_cloud_that_is_shown_and_do_not_bridge_gaps() {
        let scene = scene();
        let mut rows = square(|_, _| 0.0);
        // Another cloud, of the same places at another range.
        rows.extend(square(|_, _| 0.0).into_iter().map(|row| Row { scan: 1, range_m: 9.0, ..row }));
        let rows = of_first_cloud(&rows);
        let (seen, patch) =
            (SeenTarget::new(&scene, &rows).unwrap(), found("foreign-patch", vec![]));
        let ring = Outline::new(&patch, &rows, seen.frames.pattern_range_m).unwrap().points_m();
        let far = |place: DVec3| place.distance(seen.frames.origin().xyz);
        assert!(ring.iter().all(|at_m| (far(seen.place(*at_m).unwrap()) - 8.0).abs() < 1e-9));
        // Without the left side of the target the ring is open there: two pieces.
        let right: Vec<Row> = rows.iter().copied().filter(|row| row.xt_m > 0.2).collect();
        let open = serde_json::to_value(outlines(&scene, &right, &[&patch])).unwrap();
        assert_eq!(open[0]["ends"].as_array().unwrap().len(), 2);
        assert_eq!(open[0]["label"], "foreign-patch: outline");
        assert!(outlines(&scene, &[], &[&patch]).is_empty());
    }

    #[test]
    fn a_page_says_what_it_does_not_show() {
        assert_eq!(first_of(0), None);
        assert!(first_of(3).unwrap().contains("the first of 3 clouds"));
        let mesh = scene().target.mesh;
        let [patch, mut pose] = ["foreign-patch", "pose"].map(|name| found(name, vec![]));
        pose.motions = vec![Pose::new(DMat3::IDENTITY, DVec3::new(0.0, 0.0, 0.03))];
        assert_eq!(moved_by(&[&patch], &mesh), None);
        assert!(moved_by(&[&patch, &pose], &mesh).unwrap().contains("pose moves the target. Its"));
        let shapes = serde_json::to_value(moved(&mesh, &[&patch, &pose])).unwrap();
        assert_eq!((&shapes[0]["label"], &shapes[1]), (&"pose: target".into(), &Value::Null));
        assert_eq!(shapes[0]["motion"][14], 0.03);
        assert!(moved(&Mesh::default(), &[&pose]).is_empty());
        let here = [vec![], vec![0, 2], vec![1]].map(|scans| acts_here(&found("pose", scans)));
        assert_eq!(here, [true, true, false]);
    }

    #[test]
    fn an_image_shows_the_residual_of_what_was_detected() {
        let rows = square(|_, _| 0.0);
        let image = residual_image(&scene(), &rows).unwrap().unwrap();
        assert!(image.label.contains("from −0.5 dB (blue) to 0.5 dB (red)"), "{}", image.label);
        let silent: Vec<Row> =
            rows.into_iter().map(|row| Row { observed_w: None, ..row }).collect();
        assert!(residual_image(&scene(), &silent).unwrap().is_none());
    }
}
