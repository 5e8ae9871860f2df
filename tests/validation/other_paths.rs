//! Receivers that stand elsewhere and paths over two surfaces, against closed forms.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DMat3, DVec3};
use matdb::brdf::{BlinnPhong, CookTorrance, Distribution, Lambert, Scattering, Shadowing};
use matdb::frames::Point;
use matdb::geometry::Mesh;
use matdb::radar::scan::Raster;
use matdb::radar::{Chirps, Footprint, Radar};
use matdb::render::{Bounce, Echo, Observer};
use matdb::scene::solids::{icosphere, plate};

use super::page::{Row, Section, Table, Tolerance::Below, Tolerance::Within};
use super::quadrature::integral;
use super::solids::{STAND_OFF_M, raster};
use crate::support::echoes_at;

/// Flat facets are exact: what is left is rounding.
const FLAT: f64 = 1e-9;

/// The closed form is for antennas far away; a radius of 0.05 m at 8 m leaves this.
const FAR: f64 = 0.01;

/// 10 000 directions from each point, of which half are drawn for narrow lobes.
const SAMPLED: f64 = 0.02;

/// A lobe of m = 0.02 turns a path by some 0.04 rad, over a wing of 0.2 m.
const MIRROR_MM: f64 = 8.0;

/// A lobe so wide that the beam, 100 times narrower, leaves it as it is.
const ALPHA: f64 = 1.4;

const APERTURE_M2: f64 = 0.05;
const CENTRE: DVec3 = DVec3::new(0.0, 1.1, 0.0);

fn receiver(place: DVec3) -> Observer {
    let position = Point::from(place);
    Observer::Receiver { number: 1, position, aperture_m2: Some(APERTURE_M2) }
}

fn scan(
    radar: &Radar,
    mut mesh: Mesh,
    surface: &dyn Scattering,
    rays: usize,
    bounce: Option<Bounce>,
    observer: Observer,
) -> Vec<Echo> {
    mesh.vertices.iter_mut().for_each(|vertex| *vertex += CENTRE);
    let chirps = Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap();
    echoes_at(radar, &chirps, &mesh, surface, rays, bounce, observer)
}

/// 7 dBm − 15 dB on a surface, W.
const FLUX_W: f64 = 1.584_893_192_461_113_5e-4;

/// Worst difference of a tilted plate seen from a receiver, dB.
fn plate_error_db(tilt_rad: f64, place: DVec3) -> f64 {
    let gloss = BlinnPhong { r_s: 0.3, alpha: ALPHA };
    let turn = DMat3::from_rotation_y(tilt_rad);
    let mut mesh = plate(4.0, 4.0);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
    let normal = turn * DVec3::Z;
    let radar = raster(Raster { lines: 20, chirps_per_line: 20, width_m: 0.8, height_m: 0.8 });
    let echoes = scan(&radar, mesh, &gloss, 1, None, receiver(place));
    assert_eq!(echoes.len(), 400);
    let error_db = |echo: &Echo| {
        let at = echo.point.xyz;
        let i = (CENTRE + STAND_OFF_M * DVec3::Z - at).normalize();
        let (o, distance_m) = ((place - at).normalize(), place.distance(at));
        let f = 0.3 * (ALPHA + 2.0) / (2.0 * PI) * normal.dot((i + o).normalize()).powf(ALPHA);
        let expected_w =
            FLUX_W * APERTURE_M2 / distance_m.powi(2) * f * normal.dot(i) * normal.dot(o);
        10.0 * (echo.power_w / expected_w).log10()
    };
    echoes.iter().map(|echo| error_db(echo).abs()).fold(0.0, f64::max)
}

/// Power of a raster over a Lambert sphere, over ⅔·r²·(sin α + (π − α)·cos α) as it should be.
fn sphere_ratio(alpha_rad: f64) -> f64 {
    const RADIUS_M: f64 = 0.05;
    const RASTER: Raster =
        Raster { lines: 200, chirps_per_line: 200, width_m: 0.11, height_m: 0.11 };
    let place = CENTRE + STAND_OFF_M * DVec3::new(alpha_rad.sin(), 0.0, alpha_rad.cos());
    let radar = Radar { footprint: Footprint::Projected, ..raster(RASTER) };
    let chalk = Lambert { albedo: 0.5 };
    let echoes = scan(&radar, icosphere(RADIUS_M, 5), &chalk, 1, None, receiver(place));
    let sum_w: f64 = echoes.iter().map(|echo| echo.power_w).sum();
    let cell_m2 = (0.11f64 / 200.0).powi(2);
    let lit_m2 =
        2.0 / 3.0 * RADIUS_M.powi(2) * (alpha_rad.sin() + (PI - alpha_rad) * alpha_rad.cos());
    let expected_w_m2 = FLUX_W * APERTURE_M2 / STAND_OFF_M.powi(2) * 0.5 / PI * lit_m2;
    sum_w * cell_m2 / expected_w_m2
}

const WING_M: f64 = 0.2;

/// Two wings at right angles, open towards the radar, their edge upright through the centre.
fn dihedral() -> Mesh {
    const HALF_HEIGHT_M: f64 = 20.0;
    let out_m = WING_M * FRAC_1_SQRT_2;
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y * HALF_HEIGHT_M, z);
    let columns = [(-out_m, out_m), (0.0, 0.0), (out_m, out_m)];
    let vertices = columns.iter().flat_map(|&(x, z)| [corner(x, -1.0, z), corner(x, 1.0, z)]);
    Mesh {
        vertices: vertices.collect(),
        facets: vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]],
        labels: Vec::new(),
    }
}

/// A line of chirps across the edge.
fn line() -> Radar {
    raster(Raster { lines: 1, chirps_per_line: 12, width_m: 0.24, height_m: 1e-6 })
}

/// Far wing's share of the power that a chalky near wing sends on and the radar sees, over that of
/// the near wing: ρ·½(1 − a/√(a² + w²)) for a point at the distance a from the edge, here with the
/// ranges and angles of an antenna at 8 m.
fn second_over_first(a_m: f64, albedo: f64) -> f64 {
    let wing = |u: f64| (u * FRAC_1_SQRT_2, u * FRAC_1_SQRT_2);
    // Seen by the antenna: cos θ_o/R², from a point of a wing u from the edge.
    let seen = |u: f64| {
        let (x, z) = wing(u);
        let to = DVec3::new(-x, 0.0, STAND_OFF_M - z);
        to.normalize().dot(DVec3::new(-FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2)) / to.length_squared()
    };
    // Across the edge the density of what arrives is ½·a²/(a² + u²)^1.5, all heights together.
    let density = |u: f64| 0.5 * a_m * u / (a_m * a_m + u * u).powf(1.5);
    albedo * integral(64, 0.0, WING_M, |u| density(u) * seen(u)) / seen(a_m)
}

/// Largest relative difference of what the second wing adds.
fn dihedral_error() -> f64 {
    let chalk = Lambert { albedo: 0.7 };
    let bounce = Some(Bounce { rays: 10_000, outside_spot: 1.0, in_phase: false });
    let [one, both] =
        [None, bounce].map(|bounce| scan(&line(), dihedral(), &chalk, 1, bounce, Observer::Radar));
    assert_eq!((one.len(), both.len()), (12, 12));
    let error = |(one, both): (&Echo, &Echo)| {
        let found = both.power_w / one.power_w - 1.0;
        let a_m = one.point.xyz.x.abs() / FRAC_1_SQRT_2;
        (found / second_over_first(a_m, 0.7) - 1.0).abs()
    };
    std::iter::zip(&one, &both).map(error).fold(0.0, f64::max)
}

fn mirror() -> CookTorrance {
    CookTorrance {
        f_lambda: 1.0,
        m: 0.02,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Correlated,
    }
}

/// Largest difference between the range of a corner of mirrors and that of its edge, mm.
fn corner_range_error_mm() -> f64 {
    let mirror = mirror();
    let bounce = Some(Bounce { rays: 10_000, outside_spot: 1.0, in_phase: false });
    let echoes = scan(&line(), dihedral(), &mirror, 1, bounce, Observer::Radar);
    let edge_m = |echo: &Echo| STAND_OFF_M * (echo.point.xyz.x / STAND_OFF_M).atan().cos();
    let error_mm = |echo: &Echo| 1e3 * (echo.range_m - edge_m(echo)).abs();
    assert!(echoes.iter().all(|echo| echo.truth.unwrap().surfaces == 2));
    echoes.iter().map(error_mm).fold(0.0, f64::max)
}

/// Power of a corner of mirrors on the beam's axis when side lobes let nothing through, over that when
/// they let all through.
fn corner_within_the_spot() -> f64 {
    let mirror = mirror();
    let radar = raster(Raster { lines: 1, chirps_per_line: 1, width_m: 1e-6, height_m: 1e-6 });
    let [none, all] = [0.0, 1.0].map(|outside_spot| {
        let bounce = Some(Bounce { rays: 2000, outside_spot, in_phase: false });
        let echoes = scan(&radar, dihedral(), &mirror, 400, bounce, Observer::Radar);
        echoes[0].power_w
    });
    none / all
}

fn bistatic_rows() -> Vec<Row> {
    let place = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        CENTRE + 6.0 * DVec3::new(sin, 0.1, cos)
    };
    let tilted = |(tilt, degrees): (f64, f64)| {
        let what = format!("plate tilted by {tilt}°, receiver at {degrees}°: worst difference");
        Row::new(what, plate_error_db(tilt.to_radians(), place(degrees)), Below(FLAT)).unit("dB")
    };
    let phase = |degrees: f64| {
        let what = format!("Lambert sphere, receiver at {degrees}°: power over the closed form");
        let ratio = sphere_ratio(degrees.to_radians());
        Row::new(what, ratio, Within(1.0 - FAR, 1.0 + FAR)).digits(3)
    };
    let plates = [(0.0, 20.0), (30.0, 60.0), (-20.0, 40.0)].map(tilted);
    let spheres = [0.0, 45.0, 90.0].map(phase);
    plates.into_iter().chain(spheres).collect()
}

fn second_order_rows() -> Vec<Row> {
    // The closed form for an antenna far away judges the integral at 8 m.
    let a_m: f64 = 0.1;
    let far = 0.5 * (1.0 - a_m / a_m.hypot(WING_M));
    let what = "the integral at 8 m over ½(1 − a/√(a² + w²)), a = 0.1 m";
    vec![
        Row::new(what, second_over_first(a_m, 1.0) / far, Within(0.97, 1.03)).digits(3),
        Row::new("Lambert wings: worst relative difference", dihedral_error(), Below(SAMPLED))
            .digits(1),
        Row::new(
            "mirror wings: worst difference from the range of the edge",
            corner_range_error_mm(),
            Below(MIRROR_MM),
        )
        .unit("mm")
        .digits(1),
        Row::new(
            "mirror wings on the axis: power without side lobes over that with full ones",
            corner_within_the_spot(),
            Within(0.77, 0.83),
        ),
    ]
}

pub fn section() -> Section {
    let bistatic = "A plate (`blinn-phong`, α = 1.4: the beam widens narrower lobes) lit by the default radar and seen by a receiver 6 m away, \
    against \
                    P_t·f(i, o)·cos θ_i·cos θ_o·A_eq/R_o² from the plane and the two antennas: flat facets are exact. \
                    A Lambert \
                    sphere of 0.05 m radius with the projected footprint, lit from 0° and seen from α, against \
                    ⅔·r²·(sin α + (π − α)·cos α), which holds for antennas far away; at 8 m it is good to 1 %.";
    let second = "Two wings of 0.2 m at right angles, open towards the radar. Chalky ones (albedo 0.7): the second wing adds to the echo of a point at a distance a from the edge ρ·½(1 − a/√(a² + w²)) of \
                  that echo, for an antenna far away. The integral includes the ranges and angles of 8 m. Mirrors (`cook-torrance`, m \
                  = 0.02): \
                  every path over both wings is as long as one to the edge, within what a lobe of that width spreads. \
                  Directions \
                  are drawn at random, 10 000 from each point, which leaves a scatter of about one per cent. On the axis a corner mirrors every point of the spot to its opposite. With the Gaussian g of the \
                  spot the antenna sees it with weight 2g, or max(2g, 1) with full side lobes. ∫g·2g over ∫g·max(2g, \
                  1) is 1/1.25, to 3 % for 400 rays.";
    Section {
        title: "Other antennas and second surfaces",
        tables: vec![
            Table { text: bistatic.to_owned(), rows: bistatic_rows() },
            Table { text: second.to_owned(), rows: second_order_rows() },
        ],
        not_covered: vec![
            "Paths over three surfaces and more.",
            "Waves that add in phase over two surfaces.",
        ],
    }
}
