//! Plate, sphere and cylinder of facets against closed forms, through the whole renderer.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use matdb::brdf::{Lambert, Scattering};
use matdb::geometry::Mesh;
use matdb::radar::scan::Raster;
use matdb::radar::{Chirps, Pattern, Radar};
use matdb::render::{Echo, Observer};
use matdb::scene::solids::{icosphere, plate};

use crate::support::echoes_at;

use super::page::{Row, Section, Table, Tolerance::Below, Tolerance::Within};
use super::quadrature::integral;

/// Flat facets are exact: what is left is rounding.
const FLAT: f64 = 1e-9;

/// The facet's normal instead of the surface's: half a facet's turn at the edges, a quarter in the
/// mean where the raster meets all of a facet alike, which it nearly does.
const MEAN_TURN: f64 = 0.3;

/// Second order for sums and first for normals, within the scatter of a finite raster.
const ORDER_SCATTER: f64 = 0.25;

/// Distance from the radar to the bodies' centre, m.
pub const STAND_OFF_M: f64 = 8.0;
const RADIUS_M: f64 = 0.2;
const CHALK: Lambert = Lambert { albedo: 0.5 };

/// Every echo of a scan of one mesh about the origin: the only place that calls the renderer.
pub fn echoes(radar: &Radar, mut mesh: Mesh, rays: usize, surface: &dyn Scattering) -> Vec<Echo> {
    // The default radar looks along −z from (0, 1.1, 8).
    mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
    let chirps = Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap();
    echoes_at(radar, &chirps, &mesh, surface, rays, None, Observer::Radar)
}

/// The default radar with a raster of chirps, a loss of 15 dB and an antenna of 0.196 m², which makes the power
/// a matter of geometry alone.
pub fn raster(scan: Raster) -> Radar {
    let (aperture_m2, system_loss_db) = (Some(0.196), 15.0);
    Radar { scan: Pattern::Raster(scan), aperture_m2, system_loss_db, ..Radar::default() }
}

/// Equation (11) with 7 dBm, −15 dB and 0.196 m², W.
pub fn by_hand_w(range_m: f64, cos_theta: f64, f_per_sr: f64) -> f64 {
    10f64.powf(-0.8) * 1e-3 * 0.196 / (range_m * range_m) * f_per_sr * cos_theta * cos_theta
}

/// Range and cosine of incidence on a circle of a radius about the origin, for a ray that is
/// `offset_m` from its axis after 8 m, by the law of sines; `None` beside the circle.
fn on_a_circle(offset_m: f64, radius_m: f64) -> Option<(f64, f64)> {
    let sin = offset_m / radius_m;
    let cos = (1.0 - sin * sin).max(0.0).sqrt();
    let range_m = (STAND_OFF_M * STAND_OFF_M - offset_m * offset_m).sqrt() - radius_m * cos;
    (sin.abs() <= 1.0).then_some((range_m, cos))
}

/// Worst difference of a tilted plate, dB.
fn plate_error_db(tilt_rad: f64) -> f64 {
    let mut mesh = plate(4.0, 4.0);
    let turn = DMat3::from_rotation_y(tilt_rad);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
    let normal = turn * DVec3::Z;
    let radar = raster(Raster { lines: 40, chirps_per_line: 40, width_m: 0.8, height_m: 0.8 });
    let echoes = echoes(&radar, mesh, 1, &CHALK);
    assert_eq!(echoes.len(), 1600);
    let error = |echo: &Echo| {
        let ray = (echo.point.xyz - DVec3::new(0.0, 1.1, STAND_OFF_M)).normalize();
        let cos = -ray.dot(normal);
        let expected_w = by_hand_w(STAND_OFF_M * normal.z / cos, cos, 0.5 / PI);
        10.0 * (echo.power_w / expected_w).log10()
    };
    echoes.iter().map(|echo| error(echo).abs()).fold(0.0, f64::max)
}

/// A tube of flat strips about the y axis, inscribed in the cylinder.
fn cylinder(strips: u32) -> Mesh {
    let corner = |n: u32, y: f64| {
        let (sin, cos) = (2.0 * PI * f64::from(n) / f64::from(strips)).sin_cos();
        DVec3::new(RADIUS_M * sin, y, RADIUS_M * cos)
    };
    let vertices = (0..strips).flat_map(|n| [corner(n, -0.5), corner(n, 0.5)]).collect();
    let strip = |n: u32| {
        let [a, b, c, d] = [2 * n, 2 * ((n + 1) % strips), 2 * ((n + 1) % strips) + 1, 2 * n + 1];
        [[a, b, c], [a, c, d]]
    };
    Mesh { vertices, facets: (0..strips).flat_map(strip).collect(), labels: Vec::new() }
}

/// How far a body of facets is from the smooth one.
struct Errors {
    /// Of the sum of all powers, relative.
    power: f64,
    /// Of the incidence up to 60°, the mean over the raster, rad.
    incidence_rad: f64,
}

/// `exact` gives range and cosine of incidence of a ray by where it is after 8 m.
fn errors(
    mesh: Mesh,
    scan: Raster,
    integral_w_m2: f64,
    exact: impl Fn(f64, f64) -> Option<(f64, f64)>,
) -> Errors {
    let cell_m2 = scan.width_m / scan.chirps_per_line as f64 * scan.height_m / scan.lines as f64;
    let echoes = echoes(&raster(scan), mesh, 1, &CHALK);
    let sum_w: f64 = echoes.iter().map(|echo| echo.power_w).sum();
    let incidence: Vec<f64> = echoes
        .iter()
        .filter_map(|echo| {
            let ray = (echo.point.xyz - DVec3::new(0.0, 1.1, STAND_OFF_M)).normalize();
            let (_, cos) = exact(STAND_OFF_M * ray.x, STAND_OFF_M * ray.y)?;
            (cos > 0.5).then(|| (echo.truth.unwrap().hit.theta_rad() - cos.acos()).abs())
        })
        .collect();
    Errors {
        power: (sum_w * cell_m2 / integral_w_m2 - 1.0).abs(),
        incidence_rad: incidence.iter().sum::<f64>() / incidence.len() as f64,
    }
}

fn sphere_errors(subdivisions: u32) -> Errors {
    let exact = |x: f64, y: f64| on_a_circle(x.hypot(y), RADIUS_M);
    let around = |r: f64| {
        let (range_m, cos) = exact(r, 0.0).unwrap_or((STAND_OFF_M, 0.0));
        2.0 * PI * r * by_hand_w(range_m, cos, 0.5 / PI)
    };
    let integral_w_m2 = integral(64, 0.0, RADIUS_M, around);
    let scan = Raster { lines: 300, chirps_per_line: 300, width_m: 0.42, height_m: 0.42 };
    errors(icosphere(RADIUS_M, subdivisions), scan, integral_w_m2, exact)
}

fn cylinder_errors(strips: u32) -> Errors {
    const HEIGHT_M: f64 = 0.3;
    // Across the axis it is the circle; along it, the ray is longer and meets the wall more obliquely.
    let rise = |y: f64| (1.0 - (y / STAND_OFF_M).powi(2)).sqrt();
    let exact = |x: f64, y: f64| {
        let (range_m, cos) = on_a_circle(x / rise(y), RADIUS_M)?;
        Some((range_m / rise(y), cos * rise(y)))
    };
    let power_w = |x: f64, y: f64| {
        exact(x, y).map_or(0.0, |(range_m, cos)| by_hand_w(range_m, cos, 0.5 / PI))
    };
    let line = |y: f64| integral(64, 0.0, RADIUS_M * rise(y), |x| power_w(x, y));
    let integral_w_m2 = 2.0 * integral(8, -0.5 * HEIGHT_M, 0.5 * HEIGHT_M, line);
    let scan = Raster { lines: 10, chirps_per_line: 20_000, width_m: 0.42, height_m: HEIGHT_M };
    errors(cylinder(strips), scan, integral_w_m2, exact)
}

fn plate_rows() -> Vec<Row> {
    let row = |tilt_deg: f64| {
        let what = format!("plate tilted by {tilt_deg}°: worst difference");
        Row::new(what, plate_error_db(tilt_deg.to_radians()), Below(FLAT)).unit("dB")
    };
    [0.0, 20.0, 40.0, 60.0].map(row).into()
}

/// Rows of a body at three finenesses, the facets of each half as wide as those of the one before;
/// `facet_rad` is how far the finest turn from one to the next.
fn body_rows(name: &str, fineness: [String; 3], found: [Errors; 3], facet_rad: f64) -> Vec<Row> {
    let power = found.each_ref().map(|errors| errors.power);
    let incidence_rad = found.each_ref().map(|errors| errors.incidence_rad);
    // A facet's turn is its width over the radius, twice as much at each step before.
    let allowed = |step: usize| {
        let turn_rad = facet_rad * 2f64.powi(2 - step as i32);
        Below((turn_rad * turn_rad * 1e4).round() / 1e4)
    };
    let order = |errors: [f64; 3]| (errors[0] / errors[2]).log2() / 2.0;
    let near = |order: f64| Within(order - ORDER_SCATTER, order + ORDER_SCATTER);
    let mut rows = Vec::new();
    for (step, fineness) in fineness.iter().enumerate() {
        let what = format!("{name}, {fineness}: power of the raster");
        rows.push(Row::new(what, power[step], allowed(step)));
    }
    rows.push(Row::new(
        format!("{name}: order of the power in the facets' width"),
        order(power),
        near(2.0),
    ));
    let what = format!("{name}, {}: mean difference of incidence", fineness[2]);
    let allowed_deg = (1e3 * (MEAN_TURN * facet_rad).to_degrees()).round() / 1e3;
    rows.push(Row::new(what, incidence_rad[2].to_degrees(), Below(allowed_deg)).unit("°"));
    let what = format!("{name}: order of the incidence in the facets' width");
    rows.push(Row::new(what, order(incidence_rad), near(1.0)));
    rows
}

fn sphere_rows() -> Vec<Row> {
    let fineness = [3, 4, 5].map(|n| format!("{} facets", 20 << (2 * n)));
    // An edge of the icosahedron spans 63.4°, halved five times.
    let facet_rad = 2f64.atan() / 32.0;
    body_rows("sphere", fineness, [3, 4, 5].map(sphere_errors), facet_rad)
}

fn cylinder_rows() -> Vec<Row> {
    let strips = [64, 128, 256];
    let fineness = strips.map(|n| format!("{n} strips"));
    body_rows("cylinder", fineness, strips.map(cylinder_errors), 2.0 * PI / 256.0)
}

pub fn section() -> Section {
    let plate = "A plate with Lambert's law of albedo 0.5, eight metres from the default radar with an antenna of \
                 0.196 m², against equation (11) computed from the ray and the plane. Flat facets are exact, so only rounding is tolerated.";
    let round = "A sphere and an upright cylinder of 0.2 m radius made of flat facets, at 8 m: the sum of the powers of a raster against the integral of equation (11) over the visible disc or \
                 strip (relative difference). The incidence angle, up to 60°, against asin(offset/radius). Inscribed facets of width e have an error of the \
                 order (e/r)² in power, which is tolerated. The \
                 normal of a facet is wrong by at most half the angle between neighbours, by a quarter in the mean; \
                 0.3 is tolerated.";
    let tables = vec![
        Table { text: plate.to_owned(), rows: plate_rows() },
        Table {
            text: round.to_owned(),
            rows: sphere_rows().into_iter().chain(cylinder_rows()).collect(),
        },
    ];
    let title = "Solids against closed forms";
    Section { title, tables, not_covered: vec!["Edges: nothing here diffracts."] }
}
