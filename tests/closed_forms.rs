//! Promise: plates and spheres of known scattering return the power that equation (11) gives by hand.

use std::f64::consts::{LN_2, PI};

use crate::support;
use glam::DVec3;
use matdb::brdf::{CookTorrance, Distribution, Lambert, Scattering, Shadowing};
use matdb::geometry::Mesh;
use matdb::radar::{BeamEntry, Chirps, Radar};
use matdb::render::Echo;
use matdb::scene::solids;
use matdb::units::dbm_from_watts;

/// Flat facets are exact: what is left is rounding.
const FLAT_DB: f64 = 1e-9;

const LAMBERT: Lambert = Lambert { albedo: 0.5 };
const ROUGH: CookTorrance = CookTorrance {
    f_lambda: 0.2,
    m: 0.3,
    m_across: None,
    distribution: Distribution::Beckmann,
    shadowing: Shadowing::Separable,
};

/// 7 dBm − 15 dB + 10·lg(0.196 m²): the radar at 1 m, f = 1/sr and normal incidence.
fn level_at_one_metre_dbm() -> f64 {
    7.0 - 15.0 + 10.0 * 0.196f64.log10()
}

fn expected_dbm(range_m: f64, theta_rad: f64, f_per_sr: f64) -> f64 {
    level_at_one_metre_dbm() - 20.0 * range_m.log10()
        + 10.0 * f_per_sr.log10()
        + 20.0 * theta_rad.cos().log10()
}

/// Equations (13) and (14) with Beckmann's D, written out for i = o; G1 is 1 below 64° for m = 0.3. The beam of 16 mm at
/// half its intensity, w₀ = 16 mm/√(2·ln 2), adds δ² = (λ/(2π·w₀))² to m².
fn rough_by_hand_per_sr(theta_rad: f64) -> f64 {
    let wavelength_m = 299_792_458.0 / 300e9;
    let delta_rad = wavelength_m * (2.0 * LN_2).sqrt() / (2.0 * PI * 0.016);
    let seen2 = 0.09 + delta_rad * delta_rad;
    let (tan2, cos2) = (theta_rad.tan().powi(2), theta_rad.cos().powi(2));
    let d = (-tan2 / seen2).exp() / (PI * seen2 * cos2 * cos2);
    0.2 * d / (4.0 * cos2)
}

fn echoes(mut mesh: Mesh, turn_rad: f64, surface: &dyn Scattering) -> Vec<Echo> {
    let turn = glam::DMat3::from_rotation_y(turn_rad);
    for vertex in &mut mesh.vertices {
        *vertex = turn * *vertex + DVec3::new(0.0, 1.1, 0.0);
    }
    let (aperture_m2, system_loss_db) = (Some(0.196), 15.0);
    // The same beam all over the field of view.
    let beam = BeamEntry { edge_growth: 1.0, ..Radar::default().beam };
    let radar = Radar { aperture_m2, system_loss_db, beam, ..Radar::default() };
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    support::echoes(&radar, &chirps, &mesh, surface)
}

#[test]
fn a_tilted_plate_returns_the_power_computed_by_hand() {
    for tilt_deg in [0.0, 3.0, 20.0, 40.0] {
        let tilt_rad = f64::to_radians(tilt_deg);
        let normal = DVec3::new(tilt_rad.sin(), 0.0, tilt_rad.cos());
        for (surface, f) in [
            (&LAMBERT as &dyn Scattering, (|_| 0.5 / PI) as fn(f64) -> f64),
            (&ROUGH, rough_by_hand_per_sr),
        ] {
            let echoes = echoes(solids::plate(2.0, 2.0), tilt_rad, surface);
            assert_eq!(echoes.len(), 18_529);
            for echo in echoes {
                // The radar stands at (0, 1.1, 8), the plate's plane passes through (0, 1.1, 0).
                let ray = (echo.point.xyz - DVec3::new(0.0, 1.1, 8.0)).normalize();
                let range_m = -8.0 * normal.z / ray.dot(normal);
                let theta_rad = (-ray.dot(normal)).acos();
                let expected = expected_dbm(range_m, theta_rad, f(theta_rad));
                assert!(
                    (dbm_from_watts(echo.power_w) - expected).abs() < FLAT_DB,
                    "{tilt_deg}° {echo:?}"
                );
            }
        }
    }
}

/// Mean of the difference to the exact sphere, dB, over incidences up to 45°.
fn sphere_error_db(subdivisions: u32, surface: &dyn Scattering, f: fn(f64) -> f64) -> f64 {
    const RADIUS_M: f64 = 0.2;
    let errors: Vec<f64> = echoes(solids::icosphere(RADIUS_M, subdivisions), 0.0, surface)
        .into_iter()
        .filter_map(|echo| {
            // Law of sines in the triangle reflector – centre – hit.
            let ray = (echo.point.xyz - DVec3::new(0.0, 1.1, 8.0)).normalize();
            let off_axis_rad = (-ray.z).acos();
            let theta_rad = (8.0 / RADIUS_M * off_axis_rad.sin()).asin();
            let range_m = 8.0 * off_axis_rad.cos() - RADIUS_M * theta_rad.cos();
            (theta_rad < 45f64.to_radians()).then(|| {
                (dbm_from_watts(echo.power_w) - expected_dbm(range_m, theta_rad, f(theta_rad)))
                    .abs()
            })
        })
        .collect();
    assert!(errors.len() > 1000);
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn a_sphere_converges_to_the_power_computed_by_hand() {
    for (surface, f) in [
        (&LAMBERT as &dyn Scattering, (|_| 0.5 / PI) as fn(f64) -> f64),
        (&ROUGH, rough_by_hand_per_sr),
    ] {
        let [coarse, fine, finest] = [4, 5, 6].map(|n| sphere_error_db(n, surface, f));
        // Facet normals err in proportion to the facets' size, which halves at each step.
        assert!(fine < 0.6 * coarse && finest < 0.6 * fine, "{coarse} {fine} {finest}");
        assert!(finest < 0.3, "{finest}");
    }
}
