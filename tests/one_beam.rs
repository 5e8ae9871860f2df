//! Promise: spot, aperture, wavefront and the lobe of a mirror are of one Gaussian beam, so that levels at
//! the focus and away from it have their closed forms, and nothing returns more than was sent.

use std::f64::consts::{LN_2, PI};

use crate::support;
use glam::{DMat3, DVec3};
use matdb::brdf::{
    BlinnPhong, Brdf, CookTorrance, Correlation, Directive, Distribution, Fresnel, Kirchhoff,
    KirchhoffGo, Lambert, Layered, Scattering, Shadowing, VIEWING_RAD,
};
use matdb::geometry::Mesh;
use matdb::radar::scan::Raster;
use matdb::radar::{Chirps, Footprint, Pattern, Radar};
use matdb::render::{Bounce, Observer};
use matdb::scene::solids;

/// Distances from the focus, m.
const OFF_FOCUS_M: [f64; 5] = [-0.5, -0.2, 0.0, 0.2, 0.5];

/// Rays of a spot where its mean is judged.
const RAYS: usize = 4000;

/// The mean over the rays: their tail beyond the outermost is left out.
const MEAN_DB: f64 = 0.05;

/// The mean over a highlight that only a sixteenth of the rays see, on facets that turn by 2 mrad.
const HIGHLIGHT_DB: f64 = 0.15;

/// cos θ and G1 within a lobe of the beam's width.
const LOBE_DB: f64 = 0.01;

/// A metal without loss.
const MIRROR: Fresnel = Fresnel { eps_real: 1.0, eps_imag: 1e9, lobe_rad: None };

/// The default radar's beam, by hand from 16 mm and 300 GHz.
struct Waist {
    wavelength_m: f64,
    waist_m: f64,
}

impl Waist {
    fn new() -> Waist {
        Waist { wavelength_m: 299_792_458.0 / 300e9, waist_m: 0.016 / (2.0 * LN_2).sqrt() }
    }

    /// ζ = z/z_R.
    fn zeta(&self, z_m: f64) -> f64 {
        z_m * self.wavelength_m / (PI * self.waist_m * self.waist_m)
    }

    /// w², m².
    fn radius_m2(&self, z_m: f64) -> f64 {
        self.waist_m * self.waist_m * (1.0 + self.zeta(z_m).powi(2))
    }

    /// δ₀ = λ/(2π·w₀), rad.
    fn divergence_rad(&self) -> f64 {
        self.wavelength_m / (2.0 * PI * self.waist_m)
    }
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Power received from a mesh about the origin over that sent, for a chirp along the axis of the field of view; the
/// mesh is turned about y and moved away from the focus.
fn returned(mesh: Mesh, tilt_rad: f64, z_m: f64, rays: usize, law: &dyn Scattering) -> f64 {
    returned_by(mesh, tilt_rad, z_m, rays, law, None, Observer::Radar)
}

/// As [`returned`], with second-order paths.
fn returned_by(
    mut mesh: Mesh,
    tilt_rad: f64,
    z_m: f64,
    rays: usize,
    law: &dyn Scattering,
    bounce: Option<Bounce>,
    observer: Observer,
) -> f64 {
    let turn = DMat3::from_rotation_y(tilt_rad);
    for vertex in &mut mesh.vertices {
        // The default radar looks along −z from (0, 1.1, 8).
        *vertex = turn * *vertex + DVec3::new(0.0, 1.1, -z_m);
    }
    let scan = Raster { lines: 1, chirps_per_line: 1, width_m: 1e-6, height_m: 1e-6 };
    let radar = Radar {
        transmit_power_dbm: 30.0,
        system_loss_db: 0.0,
        threshold_dbm: -300.0,
        footprint: Footprint::Projected,
        scan: Pattern::Raster(scan),
        ..Radar::default()
    };
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    let echoes = support::echoes_at(&radar, &chirps, &mesh, law, rays, bounce, observer);
    echoes.first().map_or(0.0, |echo| echo.power_w)
}

fn plate() -> Mesh {
    solids::plate(2.0, 2.0)
}

/// A cap of a sphere that touches the origin from behind, in facets of 0.3 mm; with a radius below 0 from in front, so
/// that it is a bowl.
fn cap(radius_m: f64) -> Mesh {
    cap_of(radius_m, 267)
}

/// As [`cap`], of so many vertices along its side of 80 mm.
fn cap_of(radius_m: f64, side: u32) -> Mesh {
    const SIDE_M: f64 = 0.08;
    let place = |step: u32| (f64::from(step) / f64::from(side - 1) - 0.5) * SIDE_M;
    let vertex = |number: u32| {
        let (x, y) = (place(number % side), place(number / side));
        let depth_m = radius_m.abs() - (radius_m * radius_m - x * x - y * y).sqrt();
        DVec3::new(x, y, -depth_m.copysign(radius_m))
    };
    let cells = (0..side - 1).flat_map(|row| (0..side - 1).map(move |column| row * side + column));
    let facets = cells.flat_map(|a| [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]);
    Mesh {
        vertices: (0..side * side).map(vertex).collect(),
        facets: facets.collect(),
        labels: Vec::new(),
    }
}

#[test]
fn an_extended_diffuse_target_returns_what_the_beam_collects() {
    let (waist, chalk) = (Waist::new(), Lambert { albedo: 0.5 });
    for z_m in OFF_FOCUS_M {
        // P·f·λ²/(π·w²).
        let solid_angle_sr = waist.wavelength_m.powi(2) / (PI * waist.radius_m2(z_m));
        let expected_db = db(0.5 / PI * solid_angle_sr);
        for rays in [1, 64] {
            let found_db = db(returned(plate(), 0.0, z_m, rays, &chalk));
            assert!((found_db - expected_db).abs() < LOBE_DB, "{z_m} {rays}: {found_db}");
        }
    }
    let rayleigh_m = PI * waist.waist_m.powi(2) / waist.wavelength_m;
    let at = |z_m: f64| returned(plate(), 0.0, z_m, 1, &chalk);
    for side in [-1.0, 1.0] {
        let fallen_db = db(at(0.0) / at(side * rayleigh_m));
        assert!((fallen_db - 3.0103).abs() < 1e-3, "{fallen_db}");
    }
}

#[test]
fn a_flat_mirror_returns_all_of_the_beam_that_meets_itself() {
    let waist = Waist::new();
    for z_m in OFF_FOCUS_M {
        for tilt in [0.0, 0.5, 1.0, 1.5] {
            let tilt_rad: f64 = tilt * waist.divergence_rad();
            // P·R·exp(−tan²θ/δ₀²)/(1 + ζ²).
            let share = (-(tilt_rad.tan() / waist.divergence_rad()).powi(2)).exp();
            let expected_db = db(share / (1.0 + waist.zeta(z_m).powi(2)));
            for (rays, tolerance_db) in [(1, LOBE_DB), (RAYS, MEAN_DB)] {
                let found_db = db(returned(plate(), tilt_rad, z_m, rays, &MIRROR));
                assert!(
                    (found_db - expected_db).abs() < tolerance_db,
                    "{z_m} m, {tilt} δ₀, {rays} rays: {found_db} dB is not {expected_db} dB"
                );
            }
        }
    }
}

/// Upright strips of a mirror, cut across at heights of their own, so that no corner of one is a corner of its neighbour.
fn strips() -> Mesh {
    const WIDTH_M: f64 = 0.005;
    const HALF_M: f64 = 0.4;
    let mut mesh = Mesh { vertices: Vec::new(), facets: Vec::new(), labels: Vec::new() };
    for strip in -20i32..20 {
        let sides = [strip, strip + 1].map(|side| WIDTH_M * f64::from(side));
        let cut = 0.01 * f64::from(strip.rem_euclid(7)) + 0.003;
        for [low, high] in [[-HALF_M, cut], [cut, HALF_M]] {
            let corners = [(sides[0], low), (sides[1], low), (sides[1], high), (sides[0], high)];
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners.map(|(x, y)| DVec3::new(x, y, 0.0)));
            mesh.facets.extend([[0, 1, 2], [0, 2, 3]].map(|facet| facet.map(|i| first + i)));
        }
    }
    mesh
}

#[test]
fn a_mirror_in_pieces_returns_what_it_does_whole() {
    for z_m in [0.0, 0.2] {
        for rays in [16, 400] {
            let [whole, pieces] =
                [plate(), strips()].map(|mesh| returned(mesh, 0.0, z_m, rays, &MIRROR));
            let error_db = db(pieces / whole);
            assert!(error_db.abs() < LOBE_DB, "{z_m} m, {rays} rays: {error_db} dB");
        }
    }
}

#[test]
fn a_smooth_sphere_returns_its_glint() {
    let (waist, radius_m) = (Waist::new(), 0.15);
    for z_m in [-0.2, 0.0, 0.2] {
        // P·R/(1 + (k·w²/2)²·(1/a + 1/R_c)²), with 1/R_c = z/(z² + z_R²).
        let rayleigh_m = PI * waist.waist_m.powi(2) / waist.wavelength_m;
        let curvature_per_m = 1.0 / radius_m + z_m / (z_m * z_m + rayleigh_m * rayleigh_m);
        let half_kw2 = PI / waist.wavelength_m * waist.radius_m2(z_m);
        let expected_db = -db(1.0 + (half_kw2 * curvature_per_m).powi(2));
        let found_db = db(returned(cap(radius_m), 0.0, z_m, RAYS, &MIRROR));
        assert!(
            (found_db - expected_db).abs() < HIGHLIGHT_DB,
            "{z_m} m: {found_db} dB is not {expected_db} dB"
        );
    }
}

/// Metal facets of Beckmann's law.
fn facets(m: f64) -> CookTorrance {
    CookTorrance {
        f_lambda: 1.0,
        m,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    }
}

#[test]
fn a_rough_plate_returns_its_lobe_widened_by_the_beam() {
    let waist = Waist::new();
    let delta2 = waist.divergence_rad().powi(2);
    for (m, rays) in [(0.001, 1), (0.005, 1), (0.02, 1), (0.1, 1), (0.005, RAYS), (0.02, RAYS)] {
        for z_m in OFF_FOCUS_M {
            for tilt_rad in [0.0f64, 0.01, 0.02] {
                // P·F·G·δ_w²/m_eff²·exp(−tan²θ/m_eff²)/cos⁵θ with m_eff² = m² + δ₀² for a plate, and G = 1.
                let seen2 = m * m + delta2;
                let share = delta2 / (1.0 + waist.zeta(z_m).powi(2)) / seen2
                    * (-tilt_rad.tan().powi(2) / seen2).exp()
                    / tilt_rad.cos().powi(5);
                let found = returned(plate(), tilt_rad, z_m, rays, &facets(m));
                let error_db = db(found / share);
                assert!(
                    error_db.abs() < if rays == 1 { 1e-3 } else { MEAN_DB },
                    "m = {m}, {z_m} m, {tilt_rad}, {rays} rays: {error_db} dB"
                );
            }
        }
    }
}

#[test]
fn a_rough_sphere_returns_the_sum_of_roughness_beam_and_curvature() {
    let (waist, radius_m) = (Waist::new(), 0.15);
    for (m, z_m) in [(0.02, -0.2), (0.02, 0.0), (0.05, 0.0), (0.05, 0.2)] {
        // P·F·δ_w²/(m² + δ_w² + (w²/4)·(1/a + 1/R_c)²).
        let rayleigh_m = PI * waist.waist_m.powi(2) / waist.wavelength_m;
        let curvature_per_m = 1.0 / radius_m + z_m / (z_m * z_m + rayleigh_m * rayleigh_m);
        let radius2 = waist.radius_m2(z_m);
        let delta2 = (waist.wavelength_m / (2.0 * PI)).powi(2) / radius2;
        let matrix = m * m + delta2 + 0.25 * radius2 * curvature_per_m.powi(2);
        let found_db = db(returned(cap(radius_m), 0.0, z_m, RAYS, &facets(m)) * matrix / delta2);
        assert!(found_db.abs() < HIGHLIGHT_DB, "m = {m}, {z_m} m: {found_db} dB");
    }
}

/// Two wings at right angles, open towards the radar, whose edge lies the given distance aside.
fn corner(aside_m: f64) -> Mesh {
    const WING_M: f64 = 0.2;
    let line = |x: f64, z: f64| [-WING_M, WING_M].map(|y| DVec3::new(x + aside_m, y, z));
    let [a, b] = line(0.0, 0.0);
    let [c, d] = line(WING_M, WING_M);
    let [e, f] = line(-WING_M, WING_M);
    let facets = vec![[0, 2, 1], [1, 2, 3], [0, 1, 4], [1, 5, 4]];
    Mesh { vertices: vec![a, b, c, d, e, f], facets, labels: Vec::new() }
}

#[test]
fn a_corner_sends_power_back_and_not_to_a_receiver_elsewhere() {
    use matdb::frames::Point;
    let bounce = Some(Bounce { rays: 400, outside_spot: 0.0, in_phase: false });
    let at = |x_m: f64| {
        let position = Point::new(x_m, 1.1, 8.0);
        let observer = Observer::Receiver { number: 1, position, aperture_m2: None };
        returned_by(corner(0.02), 0.0, 0.0, 1, &facets(0.03), bounce, observer)
    };
    // In the same place it receives as the radar does; 14 deg aside, three widths 2√2·m of what two lobes make, little is left.
    let beside_db = db(at(2.0) / at(0.0));
    assert!(at(0.0) > 0.0 && beside_db < -20.0, "{beside_db} dB");
}

/// How a corner of two mirrors answers a chirp: by no single path, but by two mirrors in turn.
#[test]
fn a_corner_of_two_mirrors_returns_what_a_mirror_does() {
    let waist = Waist::new();
    let bounce = Some(Bounce { rays: 8, outside_spot: 0.0, in_phase: false });
    for (law, m) in [(Brdf::Fresnel(MIRROR), 0.0), (Brdf::CookTorrance(facets(0.004)), 0.004)] {
        for z_m in [0.0, 0.3] {
            for aside in [0.0, 0.25, 0.5] {
                // P·R₁R₂·exp(−4s²/w²)·δ_w²/(m₁² + m₂² + δ₀²) at the edge's distance s aside.
                let radius2 = waist.radius_m2(z_m);
                let aside_m = aside * radius2.sqrt();
                let delta2 = waist.divergence_rad().powi(2);
                // Across the plane of incidence facets turn a ray by 2m·cos 45°, in it by 2m.
                let widths2 = (2.0 * m * m + delta2) * (m * m + delta2);
                let share = (-4.0 * aside * aside).exp() * delta2
                    / (1.0 + waist.zeta(z_m).powi(2))
                    / widths2.sqrt();
                // The first surface's lobe joins the beam's as if it were round, 0.11 dB for this m.
                let round_db = if m > 0.0 { 0.12 } else { 0.0 };
                for (rays, tolerance_db) in [(1, 0.05 + round_db), (RAYS, HIGHLIGHT_DB + round_db)]
                {
                    // A single ray needs the edge beside it.
                    let aside_m = if rays == 1 { aside_m.max(1e-5) } else { aside_m };
                    let found =
                        returned_by(corner(aside_m), 0.0, z_m, rays, &law, bounce, Observer::Radar);
                    let error_db = db(found / share);
                    assert!(
                        error_db.abs() < tolerance_db,
                        "m = {m}, {z_m} m, {aside} w, {rays} rays: {error_db} dB"
                    );
                }
            }
        }
    }
}

#[test]
fn a_smooth_mirror_is_drawn_as_the_default_radar_sees_it() {
    assert!((VIEWING_RAD / Waist::new().divergence_rad() - 1.0).abs() < 1e-3);
    let up = matdb::frames::Direction::from_angles(0.0, 0.0);
    let seen = MIRROR.seen_by(VIEWING_RAD, up, up).f_per_sr;
    assert!((MIRROR.retro_per_sr(0.0) / seen - 1.0).abs() < 1e-12);
}

#[test]
fn the_edge_of_a_diffuse_half_plane_takes_half() {
    let mut half = plate();
    half.vertices.iter_mut().for_each(|vertex| vertex.x += 1.0);
    let chalk = Lambert { albedo: 0.5 };
    for z_m in OFF_FOCUS_M {
        let share = returned(half.clone(), 0.0, z_m, RAYS, &chalk)
            / returned(plate(), 0.0, z_m, RAYS, &chalk);
        assert!((db(share) + 3.0103).abs() < MEAN_DB, "{z_m}: {share}");
    }
}

/// Models of facets from smooth to rough.
fn lobes() -> Vec<Brdf> {
    let mut all = vec![Brdf::Fresnel(MIRROR)];
    all.push(Brdf::Layered(Layered {
        layers: Vec::new(),
        eps_real: 1.0,
        eps_imag: 1e9,
        frequency_hz: 300e9,
        lobe_rad: None,
    }));
    // A lobe may be as narrow as the beam wherever it comes from. Blinn and Phong's reflects at most what it receives up
    // to this level.
    let alpha = 1000.0;
    all.push(Brdf::BlinnPhong(BlinnPhong { r_s: (alpha + 4.0) / (4.0 * alpha), alpha }));
    all.push(Brdf::Directive(Directive { s: 1.0, alpha_r: 200.0, lambda: 1.0, alpha_i: 1.0 }));
    for correlation in [Correlation::Gaussian, Correlation::Exponential] {
        for (rms_height_m, lobe_rad) in [(2e-5, None), (8e-5, Some(0.001)), (3e-4, None)] {
            all.push(Brdf::Kirchhoff(Kirchhoff {
                rms_height_m,
                correlation_length_m: 0.1,
                correlation,
                eps_real: 1.0,
                eps_imag: 1e9,
                frequency_hz: 300e9,
                lobe_rad,
            }));
        }
    }
    for m in [0.001, 0.005, 0.02, 0.1, 0.4] {
        let go = KirchhoffGo { rms_slope: m, eps_real: 1.0, eps_imag: 1e9 };
        all.push(Brdf::KirchhoffGo(go));
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for m_across in [None, Some(0.002)] {
                all.push(Brdf::CookTorrance(CookTorrance {
                    f_lambda: 1.0,
                    m,
                    m_across,
                    distribution,
                    shadowing: Shadowing::Correlated,
                }));
            }
        }
    }
    all
}

#[test]
fn nothing_returns_more_than_was_sent() {
    for law in lobes() {
        for z_m in OFF_FOCUS_M {
            for tilt_rad in [0.0, 0.003, 0.02, 0.2, 1.0] {
                for rays in [1, 64] {
                    let share = returned(plate(), tilt_rad, z_m, rays, &law);
                    assert!(share < 1.0 + 1e-3, "{law:?} {z_m} {tilt_rad} {rays}: {share}");
                }
            }
        }
        // A ball, and a bowl that focuses: from far too deep to nearly flat.
        for radius_m in [0.1, -0.1, -0.4, -2.0] {
            for z_m in [-0.5, 0.0, 0.5] {
                for rays in [1, 64] {
                    let share = returned(cap_of(radius_m, 54), 0.0, z_m, rays, &law);
                    assert!(share < 1.0 + 1e-3, "{law:?} {radius_m} {z_m} {rays}: {share}");
                }
            }
        }
    }
}

/// A bowl of the wavefront's own curvature sends every ray back on itself, and returns all of the beam where a plate
/// returns 1/(1 + ζ²) of it.
#[test]
fn a_bowl_that_fits_the_wavefront_returns_all_of_the_beam() {
    let (waist, z_m) = (Waist::new(), 0.5);
    let rayleigh_m = PI * waist.waist_m.powi(2) / waist.wavelength_m;
    let radius_m = -(z_m + rayleigh_m * rayleigh_m / z_m);
    let bowl_db = db(returned(cap(radius_m), 0.0, z_m, RAYS, &MIRROR));
    assert!((-MEAN_DB..1e-3).contains(&bowl_db), "{bowl_db} dB");
    let plate_db = db(returned(plate(), 0.0, z_m, RAYS, &MIRROR));
    assert!((plate_db + db(1.0 + waist.zeta(z_m).powi(2))).abs() < MEAN_DB, "{plate_db} dB");
}
