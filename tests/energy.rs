//! Promise: what a surface reflects in all directions is at most what it receives, or the model's
//! documentation says where it is more; and every parameter acts as the paper's figures 16–19 show.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use matdb::brdf::{
    BlinnPhong, Brdf, CookTorrance, Correlation, Directive, Distribution, Fresnel, Kirchhoff,
    KirchhoffGo, Lambert, Layer, Layered, Scattering, Shadowing, Sum,
};
use matdb::frames::Direction;

/// ∫ f cos θ_o dω_o over the hemisphere by the midpoint rule.
fn albedo(model: &dyn Scattering, theta_i_deg: f64) -> f64 {
    albedo_on(model, theta_i_deg, (1500, 360))
}

/// The same on a grid of so many angles from the normal and azimuths: fewer do for a broad lobe.
fn albedo_on(model: &dyn Scattering, theta_i_deg: f64, (thetas, azimuths): (i32, i32)) -> f64 {
    let (d_theta, d_azimuth) = (FRAC_PI_2 / f64::from(thetas), TAU / f64::from(azimuths));
    let i = Direction::from_angles(theta_i_deg.to_radians(), 0.0);
    let mut sum = 0.0;
    for t in 0..thetas {
        let theta = (f64::from(t) + 0.5) * d_theta;
        for a in 0..azimuths {
            let o = Direction::from_angles(theta, (f64::from(a) + 0.5) * d_azimuth);
            sum += model.f_per_sr(i, o) * theta.cos() * theta.sin();
        }
    }
    sum * d_theta * d_azimuth
}

fn mirror(m: f64, distribution: Distribution, shadowing: Shadowing) -> CookTorrance {
    CookTorrance { f_lambda: 1.0, m, m_across: None, distribution, shadowing }
}

/// Broad lobes need no more.
const BROAD: (i32, i32) = (400, 120);

/// A metal that keeps less than 1e-4.
const METAL: (f64, f64) = (1.0, 1e9);

#[test]
fn lambert_reflects_its_albedo() {
    for theta_deg in [0.0, 45.0, 85.0] {
        assert!((albedo(&Lambert { albedo: 0.7 }, theta_deg) - 0.7).abs() < 1e-5);
    }
}

#[test]
fn cook_torrance_keeps_energy_and_loses_it_with_roughness() {
    /// Quadrature and the approximation of Beckmann's G1.
    const SLACK: f64 = 0.01;
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for shadowing in [Shadowing::Separable, Shadowing::Correlated] {
            for m in [0.1, 0.3, 0.6, 1.0] {
                for theta_deg in [0.0, 30.0, 60.0, 75.0] {
                    let albedo = albedo(&mirror(m, distribution, shadowing), theta_deg);
                    assert!(albedo <= 1.0 + SLACK, "{distribution:?} {m} {theta_deg}°: {albedo}");
                }
            }
        }
        let smooth = albedo(&mirror(0.05, distribution, Shadowing::Separable), 0.0);
        assert!((smooth - 1.0).abs() < SLACK, "{distribution:?}: {smooth}");
    }
    // The documented losses at normal incidence.
    let loss = |m, distribution| 1.0 - albedo(&mirror(m, distribution, Shadowing::Separable), 0.0);
    assert!((0.1..0.2).contains(&loss(0.6, Distribution::Beckmann)));
    assert!((0.1..0.2).contains(&loss(0.3, Distribution::Ggx)));
}

#[test]
fn cook_torrance_with_a_grain_keeps_energy() {
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for m_across in [0.1, 0.6, 1.0] {
            let isotropic = mirror(0.3, distribution, Shadowing::Separable);
            let grain = CookTorrance { m_across: Some(m_across), ..isotropic };
            for theta_deg in [0.0, 30.0, 60.0, 75.0] {
                let found = albedo_on(&grain, theta_deg, BROAD);
                assert!((0.3..1.01).contains(&found), "{distribution:?} {theta_deg}°: {found}");
            }
        }
    }
}

#[test]
fn a_sum_reflects_what_its_parts_do() {
    let part = |albedo| Brdf::Lambert(Lambert { albedo });
    let sum = Sum { parts: vec![part(0.2), part(0.5)] };
    assert!((albedo_on(&sum, 30.0, BROAD) - 0.7).abs() < 1e-5);
}

#[test]
fn smooth_surfaces_reflect_their_reflectance_in_all() {
    /// What the finite lobe and the quadrature change, as a share of the incident power.
    const SLACK: f64 = 0.002;
    let (lobe_rad, frequency_hz) = (Some(0.05), 300e9);
    for (eps_real, eps_imag) in [(2.07, 0.0011), (4.67, 5.0), METAL] {
        let layers = vec![Layer { thickness_m: 2e-4, eps_real: 2.6, eps_imag: 0.1 }];
        let bare = Fresnel { eps_real, eps_imag, lobe_rad };
        let coated = Layered { layers, eps_real, eps_imag, frequency_hz, lobe_rad };
        for theta_deg in [0.0f64, 30.0, 60.0, 75.0] {
            let theta_rad = theta_deg.to_radians();
            let found = albedo(&bare, theta_deg) - bare.reflectance(theta_rad);
            assert!(found.abs() < SLACK, "ε = {eps_real}, {theta_deg}°: {found}");
            let found = albedo(&coated, theta_deg) - coated.reflectance(theta_rad);
            assert!(found.abs() < SLACK, "coated ε = {eps_real}, {theta_deg}°: {found}");
        }
    }
}

#[test]
fn kirchhoff_without_shadowing_keeps_energy_up_to_60_degrees_and_breaks_it_beyond() {
    /// The largest excess below 60° is that of the lobe's overlap with the diffuse part.
    const SLACK: f64 = 0.01;
    let (eps_real, eps_imag) = METAL;
    let rays = |rms_slope| KirchhoffGo { rms_slope, eps_real, eps_imag };
    let waves = |correlation, (rms_height_m, correlation_length_m)| Kirchhoff {
        rms_height_m,
        correlation_length_m,
        correlation,
        eps_real,
        eps_imag,
        frequency_hz: 300e9,
        lobe_rad: Some(0.05),
    };
    for theta_deg in [0.0, 30.0, 60.0] {
        for rms_slope in [0.1, 0.2, 0.4] {
            let found = albedo_on(&rays(rms_slope), theta_deg, BROAD);
            assert!((0.9..1.0).contains(&found), "slope {rms_slope}, {theta_deg}°: {found}");
        }
        for surface in [(5e-5, 1e-3), (1e-4, 1e-3), (3e-4, 2e-3)] {
            let found = albedo_on(&waves(Correlation::Gaussian, surface), theta_deg, BROAD);
            assert!((0.94..1.0 + SLACK).contains(&found), "{surface:?}, {theta_deg}°: {found}");
            let found = albedo_on(&waves(Correlation::Exponential, surface), theta_deg, BROAD);
            assert!((0.5..1.0 + SLACK).contains(&found), "{surface:?}, {theta_deg}°: {found}");
        }
    }
    // The documented excess at 75°.
    assert!((albedo_on(&rays(0.4), 75.0, BROAD) - 1.18).abs() < 0.01);
    let gaussian = waves(Correlation::Gaussian, (3e-4, 2e-3));
    assert!((albedo_on(&gaussian, 75.0, BROAD) - 1.04).abs() < 0.01);
    let exponential = waves(Correlation::Exponential, (3e-4, 2e-3));
    assert!((albedo_on(&exponential, 75.0, BROAD) - 1.40).abs() < 0.01);
}

#[test]
fn the_directive_lobes_reflect_at_most_their_share_and_over_three_fifths_of_it() {
    for (alpha_r, lambda) in [(1.0, 1.0), (4.0, 1.0), (50.0, 1.0), (10.0, 0.5)] {
        let model = Directive { s: 0.6, alpha_r, lambda, alpha_i: 3.0 };
        for theta_deg in [0.0, 30.0, 60.0, 80.0] {
            let found = albedo_on(&model, theta_deg, (200, 60)) / 0.36;
            assert!((0.6..=1.0).contains(&found), "α = {alpha_r}, {theta_deg}°: {found}");
        }
    }
}

#[test]
fn blinn_phong_breaks_energy_as_documented() {
    for (alpha, expected) in [(0.0, 1.0), (3.0, 1.92), (10.0, 2.87), (1000.0, 3.99)] {
        let found = albedo(&BlinnPhong { r_s: 1.0, alpha }, 0.0);
        assert!((found - expected).abs() < 0.01, "α = {alpha}: {found}");
        assert!(albedo(&BlinnPhong { r_s: 0.25, alpha }, 0.0) <= 1.0);
        assert!(albedo(&BlinnPhong { r_s: 1.0, alpha }, 85.0) <= found);
    }
}

/// σ⁰ in dB at an angle.
fn level_db(model: &dyn Scattering, theta_deg: f64) -> f64 {
    10.0 * model.sigma0(theta_deg.to_radians()).log10()
}

#[test]
fn more_f_lambda_raises_the_lobe_evenly() {
    let lobe = |f_lambda| CookTorrance {
        f_lambda,
        ..mirror(0.1, Distribution::Beckmann, Shadowing::Separable)
    };
    for theta_deg in [0.0, 5.0, 15.0] {
        let raised = level_db(&lobe(0.2), theta_deg) - level_db(&lobe(0.02), theta_deg);
        assert!((raised - 10.0).abs() < 1e-9);
    }
}

#[test]
fn more_m_widens_and_lowers_the_lobe() {
    let lobe = |m| mirror(m, Distribution::Beckmann, Shadowing::Separable);
    let half_width_deg = |m: f64| {
        let peak = level_db(&lobe(m), 0.0);
        (1..9000)
            .map(|i| f64::from(i) / 100.0)
            .find(|&t| level_db(&lobe(m), t) < peak - 3.01)
            .unwrap()
    };
    let peaks = [0.01, 0.05, 0.1].map(|m| level_db(&lobe(m), 0.0));
    assert!(peaks.is_sorted_by(|a, b| a > b));
    assert!([0.01, 0.05, 0.1].map(half_width_deg).is_sorted());
    // Width against height: the peak falls as m².
    assert!((peaks[1] - peaks[2] - 20.0 * 2f64.log10()).abs() < 1e-9);
    assert!((half_width_deg(0.1) - 4.8).abs() < 0.2);
}

#[test]
fn more_r_s_raises_the_skirt_evenly_and_more_alpha_narrows_and_heightens_it() {
    let skirt = |r_s, alpha| BlinnPhong { r_s, alpha };
    for theta_deg in [0.0, 40.0, 80.0] {
        let raised = level_db(&skirt(0.1, 3.0), theta_deg) - level_db(&skirt(0.01, 3.0), theta_deg);
        assert!((raised - 10.0).abs() < 1e-9);
    }
    assert!(level_db(&skirt(0.1, 9.0), 0.0) > level_db(&skirt(0.1, 3.0), 0.0));
    assert!(level_db(&skirt(0.1, 9.0), 70.0) < level_db(&skirt(0.1, 3.0), 70.0));
    // α = 0 is Lambert with the albedo r_s.
    assert!((skirt(0.3, 0.0).retro_per_sr(1.0) - 0.3 / PI).abs() < 1e-15);
}

#[test]
fn a_vanishing_roughness_leaves_nothing_beside_the_normal() {
    let nearly_flat = mirror(0.001, Distribution::Beckmann, Shadowing::Separable);
    assert!(nearly_flat.retro_per_sr(0.0) > 1e4);
    assert!(nearly_flat.retro_per_sr(0.02) < 1e-100);
}
