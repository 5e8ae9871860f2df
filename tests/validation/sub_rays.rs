//! Equation (7): the mean of N sub-rays against the integral over the Gaussian spot.

use std::f64::consts::{LN_2, PI};

use glam::DVec3;
use matdb::brdf::Lambert;
use matdb::radar::BeamEntry;
use matdb::radar::Radar;
use matdb::radar::scan::Raster;
use matdb::render::Echo;
use matdb::scene::solids::{icosphere, plate};
use statrs::function::erf::erfc;

use super::page::{Row, Section, Table, Tolerance::Below, Tolerance::Within};
use super::quadrature::integral;
use super::solids::{STAND_OFF_M, by_hand_w, echoes, raster};

/// Each sample on the sphere errs on its own by the normal of its facet, 0.4° in the mean: as
/// random errors do.
const FACETS_ORDER: f64 = 0.5;

/// N points spread evenly miss the area of a smooth figure by about the square root of the points
/// near its outline, √(√N) of N: N^(−3/4).
const ORDER: f64 = 0.75;

/// Between random points (½) and a lattice along the outline (1).
const ORDER_SCATTER: f64 = 0.25;

/// The factor in front: √(outline in units of the points' distance), less than one of a spot.
const FRONT: f64 = 0.5;

const SPOT_M: f64 = 0.016;
const CHIRPS: usize = 200;
const COUNTS: [usize; 4] = [16, 64, 256, 1024];
const CHALK: Lambert = Lambert { albedo: 0.5 };

/// One line of chirps across so many metres, with a spot that is the same everywhere.
fn line(width_m: f64) -> Radar {
    let scan = Raster { lines: 1, chirps_per_line: CHIRPS, width_m, height_m: 1e-6 };
    let beam = BeamEntry { edge_growth: 1.0, ..BeamEntry::default() };
    Radar { beam, ..raster(scan) }
}

/// Received over what a large plate would return, for each chirp.
fn shares(echoes: &[Echo]) -> Vec<f64> {
    let mut shares = vec![0.0; CHIRPS];
    for echo in echoes {
        let full_w = by_hand_w(STAND_OFF_M, 1.0, 0.5 / PI);
        shares[echo.chirp as usize] = echo.power_w / full_w;
    }
    shares
}

fn rms(errors: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = errors.len() as f64;
    (errors.map(|error| error * error).sum::<f64>() / count).sqrt()
}

/// The half plane x > 0 under spots up to 2 cm from its edge, against the error function.
fn edge_error(rays: usize) -> f64 {
    const WIDTH_M: f64 = 0.04;
    let mut mesh = plate(2.0, 2.0);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::X);
    let shares = shares(&echoes(&line(WIDTH_M), mesh, rays, &CHALK));
    let errors = shares.iter().enumerate().map(|(chirp, share)| {
        let x_m = WIDTH_M * ((chirp as f64 + 0.5) / CHIRPS as f64 - 0.5);
        // The two-way weight exp(−4r²/w²) = exp(−8 ln 2·r²/D²), half the irradiance being at half the diameter.
        share - 0.5 * erfc(-(8.0 * LN_2).sqrt() * x_m / SPOT_M)
    });
    rms(errors)
}

/// A sphere as wide as the spot, in its middle, against the integral over its disc.
fn sphere_error(rays: usize) -> f64 {
    const RADIUS_M: f64 = 0.5 * SPOT_M;
    let radar = line(1e-6);
    let shares = shares(&echoes(&radar, icosphere(RADIUS_M, 5), rays, &CHALK));
    let full_w = by_hand_w(STAND_OFF_M, 1.0, 0.5 / PI);
    // 8 mm from its focus the beam's waist of 13.6 mm has grown by 0.01 %, and its rays are parallel.
    let waist_m2 = SPOT_M * SPOT_M / (2.0 * LN_2);
    let exact = integral(64, 0.0, RADIUS_M, |r_m| {
        let cos = (1.0 - (r_m / RADIUS_M).powi(2)).max(0.0).sqrt();
        let range_m = STAND_OFF_M - RADIUS_M * cos;
        let density = 4.0 / (PI * waist_m2) * (-4.0 * r_m * r_m / waist_m2).exp();
        2.0 * PI * r_m * density * by_hand_w(range_m, cos, 0.5 / PI) / full_w
    });
    rms(shares.iter().map(|share| share / exact - 1.0))
}

fn rows(name: &str, expected_order: f64, error: impl Fn(usize) -> f64) -> Vec<Row> {
    let errors = COUNTS.map(error);
    let mut rows: Vec<Row> = std::iter::zip(COUNTS, errors)
        .map(|(count, error)| {
            let allowed = (1e4 * FRONT * (count as f64).powf(-ORDER)).round() / 1e4;
            Row::new(format!("{name}, N = {count}: rms difference"), error, Below(allowed))
        })
        .collect();
    let order = (errors[0] / errors[3]).log2() / 6.0;
    let near = Within(expected_order - ORDER_SCATTER, expected_order + ORDER_SCATTER);
    rows.push(Row::new(format!("{name}: order in 1/N"), order, near));
    rows
}

pub fn section() -> Section {
    let text = "Equation (7) by N rays per chirp against the integral over the two-way weight of a spot of 16 mm. A straight \
    edge under 200 spots up to 2 cm from it: share of the full power, against the error function. A \
    sphere of 8 mm radius in the middle of the spot: relative difference. N evenly spread points miss the area of a figure by \
                about the root of the number of points near its \
                outline, N^(−3/4); half of that is tolerated. On the sphere every ray has an independent error from \
                the normal of its facet (20 480 of them), and the mean of such errors falls as N^(−1/2)."
        .to_owned();
    let mut all = rows("edge", ORDER, edge_error);
    all.extend(rows("sphere", FACETS_ORDER, sphere_error));
    let not_covered =
        vec!["The true pattern of the antenna: the spot is taken as Gaussian, without sidelobes."];
    Section { title: "Sub-rays", tables: vec![Table { text, rows: all }], not_covered }
}
