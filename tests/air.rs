//! Promise: the loss of the air acts on every path by its whole length, from the radar by way of all surfaces to the
//! antenna, and on nothing else; `measure` takes it off again.

use std::path::Path;

use crate::support::{echoes, echoes_at, matdb, read_cloud, refused, scene};
use glam::DVec3;
use matdb::brdf::{CookTorrance, Distribution, Lambert, Shadowing};
use matdb::frames::{Point, Ray};
use matdb::geometry::Mesh;
use matdb::radar::{Chirps, Pattern, Radar, scan::Raster};
use matdb::render::{Bounce, Echo, Observer};
use matdb::scene::solids;
use matdb::units::db_from_ratio;

const LOSS_DB_PER_M: f64 = 0.5;
/// Rounding alone.
const POWER_DB: f64 = 1e-9;

fn radar(air_loss_db_per_m: f64) -> Radar {
    let scan = Raster { lines: 9, chirps_per_line: 11, width_m: 0.5, height_m: 0.5 };
    let scan = Pattern::Raster(scan);
    Radar { air_loss_db_per_m, scan, threshold_dbm: -300.0, ..Radar::default() }
}

fn chirps(radar: &Radar) -> Chirps {
    Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap()
}

/// A plate across the line of sight.
fn plate(z_m: f64) -> Mesh {
    let mut mesh = solids::plate(1.0, 1.0);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::new(0.0, 1.1, z_m));
    mesh
}

/// Echoes without and with the loss, from a function that renders for a radar.
fn both(render: impl Fn(&Radar) -> Vec<Echo>) -> Vec<(Echo, f64)> {
    let (bare, lossy) = (render(&radar(0.0)), render(&radar(LOSS_DB_PER_M)));
    assert!(!bare.is_empty() && bare.len() == lossy.len());
    let pairs = std::iter::zip(bare, lossy);
    pairs.map(|(bare, lossy)| (bare, db_from_ratio(lossy.power_w / bare.power_w))).collect()
}

#[test]
fn a_plate_loses_by_twice_its_range() {
    let lambert = Lambert { albedo: 0.5 };
    for z_m in [0.0, 1.5] {
        let pairs = both(|radar| echoes(radar, &chirps(radar), &plate(z_m), &lambert));
        assert_eq!(pairs.len(), 99);
        for (echo, found_db) in pairs {
            let range_m = (8.0 - z_m) / echo.truth.unwrap().hit.cos_theta;
            assert!((found_db + LOSS_DB_PER_M * 2.0 * range_m).abs() < POWER_DB, "{echo:?}");
        }
    }
}

#[test]
fn an_antenna_apart_loses_by_both_ways_and_the_same_in_its_place() {
    let lambert = Lambert { albedo: 0.5 };
    let (origin, apart) = (Point::new(0.0, 1.1, 8.0), Point::new(-2.0, 1.6, 5.0));
    let at = |position, aperture_m2| Observer::Receiver { number: 1, position, aperture_m2 };
    for aperture_m2 in [None, Some(0.05)] {
        let render = |radar: &Radar, chirps: &Chirps, antenna| {
            let observer = at(antenna, aperture_m2);
            echoes_at(radar, chirps, &plate(0.0), &lambert, 1, None, observer)
        };
        for (echo, found_db) in both(|radar| render(radar, &chirps(radar), apart)) {
            let point = echo.truth.unwrap().hit.point;
            let path_m = origin.distance_m(point) + point.distance_m(apart);
            assert!((found_db + LOSS_DB_PER_M * path_m).abs() < POWER_DB, "{echo:?}");
            // The radar stands where the antenna was.
            let direction = apart.towards(point).unwrap();
            let rays = vec![Ray { origin: apart, direction }];
            let swapped = Chirps { rays, number: vec![0], time_s: vec![0.0], ..Chirps::default() };
            let back = both(|radar| {
                let (position_m, look_at_m) = (Some(apart.xyz.into()), Some([0.0, 1.1, 0.0]));
                render(&Radar { position_m, look_at_m, ..radar.clone() }, &swapped, origin)
            });
            assert!((back[0].1 - found_db).abs() < POWER_DB);
        }
    }
}

#[test]
fn a_second_order_path_loses_by_all_of_its_length() {
    // Two walls at a right angle, open towards the radar, whose mirrors send nothing straight back.
    let edge = DVec3::new(0.0, 1.1, -0.2);
    let walls = [DVec3::new(-0.4, 0.0, 0.4), DVec3::new(0.4, 0.0, 0.4)];
    let mut mesh = Mesh::default();
    for (number, wall) in (0u32..).zip(walls) {
        let up = 0.4 * DVec3::Y;
        mesh.vertices.extend([edge - up, edge + up, edge + wall + up, edge + wall - up]);
        let corners = [[0, 1, 2], [0, 2, 3]].map(|facet| facet.map(|corner| corner + 4 * number));
        mesh.facets.extend(corners);
    }
    let mirror = CookTorrance {
        f_lambda: 0.9,
        m: 1e-3,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    };
    let bounce = Some(Bounce { rays: 16, outside_spot: 1.0, in_phase: false });
    let pairs =
        both(|radar| echoes_at(radar, &chirps(radar), &mesh, &mirror, 1, bounce, Observer::Radar));
    let origin = DVec3::new(0.0, 1.1, 8.0);
    let mut second = 0;
    for (echo, found_db) in pairs {
        let truth = echo.truth.unwrap();
        if truth.surfaces != 2 {
            continue;
        }
        let first = truth.hit.point.xyz;
        let [own, other] = if first.x < 0.0 { walls } else { [walls[1], walls[0]] };
        let (onto, normal) = (other.normalize(), own.normalize());
        // The normal of one wall lies along the other.
        let way = (first - origin).normalize();
        let onward = way - 2.0 * way.dot(onto) * onto;
        let to_other_m = (edge - first).dot(normal) / onward.dot(normal);
        let last = first + to_other_m * onward;
        let path_m = (first - origin).length() + to_other_m + (origin - last).length();
        assert!((found_db + LOSS_DB_PER_M * path_m).abs() < 1e-6, "{found_db} {path_m} {echo:?}");
        second += 1;
    }
    assert!(second > 10, "{second}");
}

/// Powers of all hits of a scene, dBm, with what else `column` says of each, by file of the rendering.
fn rendered(folder: &Path, scene: &Path, changes: &[&str], file: &str) -> [Vec<f64>; 2] {
    matdb(folder)
        .args(["render", "-q", "--all", "-o", "out"])
        .arg(scene)
        .args(changes)
        .assert()
        .success();
    let cloud = read_cloud(&folder.join("out").join(file));
    let range = if cloud.contains_key("true_range_m") { "true_range_m" } else { "range_m" };
    [cloud["power_dbm"].clone(), cloud[range].clone()]
}

/// Surfaces within a range cell are one echo; they are some centimetres apart.
const TOGETHER_DB: f64 = 0.05;

#[test]
fn behind_sheets_and_across_the_polarisation_the_way_counts() {
    let few = "radar.scan={pattern=\"elliptical\", chirps=800}";
    let both_ways = [
        "--set",
        few,
        "--set",
        "radar.polarisation.receive=both",
        "--set",
        "region.body.depolarised_share=0.2",
    ];
    for (name, changes, file, least) in [
        ("concealed-object.toml", &["--set", few, "--set", "spot.rays=1"][..], "cloud.ply", 300),
        ("mannequin.toml", &both_ways, "cross-cloud.ply", 100),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let [bare, ranges_m] = rendered(folder.path(), &scene(name), changes, file);
        let lossy = [changes, &["--set", "radar.air_loss_db_per_m=0.2"]].concat();
        let [lossy, _] = rendered(folder.path(), &scene(name), &lossy, file);
        assert_eq!(bare.len(), lossy.len(), "{name}");
        let mut compared = 0;
        for ((bare, lossy), range_m) in bare.iter().zip(&lossy).zip(ranges_m) {
            // A hit without power has none through the air, either.
            assert_eq!(bare.is_finite(), lossy.is_finite());
            if bare.is_finite() {
                let off_db = lossy - bare + 0.2 * 2.0 * range_m;
                assert!(off_db.abs() < TOGETHER_DB, "{name}: {off_db} at {range_m} m");
                compared += 1;
            }
        }
        assert!(compared > least, "{name}: {compared}");
    }
}

/// A ball in air with a loss, which `measure` reduces with and without it.
#[test]
fn a_curve_does_not_depend_on_the_air() {
    let folder = tempfile::tempdir().unwrap();
    let text = |air: f64| {
        format!(
            "[radar]\nair_loss_db_per_m = {air}\nthreshold_dbm = -200\n[radar.scan]\npattern = \"raster\"\nlines = 20\n\
             chirps_per_line = 20\nwidth_m = 0.4\nheight_m = 0.4\n[[mesh]]\nname = \"ball\"\nfile = \"builtin:sphere\"\n\
             size_m = [0.5, 0.5, 0.5]\ntranslation_m = [0, 1.1, 0]\n[[region]]\nname = \"all\"\nmaterial = \"mannequin-paint\"\n"
        )
    };
    let curve = |name: &str, air: f64| {
        let scene = format!("{name}.toml");
        std::fs::write(folder.path().join(&scene), text(air)).unwrap();
        matdb(folder.path()).args(["render", "-q", &scene, "-o", name]).assert().success();
        let cloud = format!("{name}/cloud.ply");
        let measure =
            ["measure", "-q", &cloud, "--scene", &scene, "--keep-pose", "--pose=0,0,0", "-o"];
        matdb(folder.path()).args(measure).arg(format!("{name}-curve")).assert().success();
        let file = folder.path().join(format!("{name}-curve/curve.csv"));
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(file).unwrap();
        let column = reader.headers().unwrap().iter().position(|name| name == "sigma0_db").unwrap();
        let rows = reader.records().map(|row| row.unwrap()[column].parse::<f64>().unwrap());
        rows.collect::<Vec<f64>>()
    };
    let (bare, lossy) = (curve("bare", 0.0), curve("lossy", 1.0));
    assert!(bare.len() > 100 && bare.len() == lossy.len());
    for (bare, lossy) in bare.iter().zip(&lossy) {
        // A curve has three digits of a dB.
        assert!((bare - lossy).abs() < 1.5e-3, "{bare} {lossy}");
    }
}

#[test]
fn a_loss_that_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for value in ["-0.1", "101"] {
        let change = format!("radar.air_loss_db_per_m={value}");
        let file = scene("mannequin.toml");
        let mut command = matdb(folder.path());
        let said = refused(command.args(["render", "-o", "out", "--set", &change]).arg(file));
        assert!(said.contains("air_loss_db_per_m"), "{said}");
    }
}
