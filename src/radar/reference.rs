//! What a smooth plate, sphere or corner of metal returns to a Gaussian beam: closed forms for calibration.
//!
//! All are shares of P·R, the power in the beam times what the metal reflects. The antenna receives by the beam that
//! it sends, so that each is an overlap of the beam with its own reflection, |∫E·E′ dA|² over (∫|E|² dA)², where
//! E = exp(−α·r²) and α = 1/w² + ik/(2R_c).
//!
//! - A plate, tilted by θ about the foot of the axis: exp(−tan²θ/δ₀²)/(1 + ζ²). The mirrored beam is the beam itself,
//!   turned by 2θ.
//! - A sphere of radius a, with its centre aside by d: E′ has the phase of the sphere's depth |r − d|²/(2a) besides,
//!   and with c = 1/a + 1/R_c the share is exp(−(d/a)²/(δ_w² + w²c²/4))/(1 + (kw²c/2)²).
//! - A corner of three plates at right angles turns every ray around and inverts its place through the apex:
//!   E′(s + y) = E(s − y), for an apex aside by s. E·E′ = exp(−2α·s² − 2α·y²), so that the share is exp(−4s²/w²) times
//!   |2/(πw²)·∫ exp(−2α·y²) dA|². A ray returns if both y and −y lie in the mouth as the radar sees it, and the integral
//!   is over the overlap of the mouth with its inversion, a regular hexagon from straight ahead. For a corner much
//!   larger than the beam it gives 1/(1 + ζ²), as for a plate that faces the radar, and tilts do nothing.
//!   `tests/fixtures/trihedral.py` integrates physical optics over the three plates; both agree within 0.07 dB for legs
//!   of 20 mm and within 0.001 dB for legs of 80 mm and more.

use std::f64::consts::PI;

use glam::DVec2;
use num_complex::Complex;

use super::beam::{GaussianBeam, Section};

/// Share that a plate returns at a distance along the beam, m, with its normal turned away from the axis, rad.
pub fn plate_return(beam: &GaussianBeam, range_m: f64, tilt_rad: f64) -> f64 {
    let zeta = (range_m - beam.focus_m) / beam.rayleigh_m();
    (-(tilt_rad.tan() / beam.divergence_rad()).powi(2)).exp() / (1.0 + zeta * zeta)
}

/// Share that a sphere returns of which the nearest point lies at this section of the beam, by its radius and the
/// distance of its centre from the axis, m.
pub fn sphere_return(section: &Section, radius_m: f64, aside_m: f64) -> f64 {
    let w2 = section.radius_m * section.radius_m;
    let bend_per_m = 1.0 / radius_m + section.curvature_per_m;
    let turns = PI / section.wavelength_m * w2 * bend_per_m;
    let slope2 = section.divergence_rad().powi(2) + 0.25 * w2 * bend_per_m * bend_per_m;
    (-(aside_m / radius_m).powi(2) / slope2).exp() / (1.0 + turns * turns)
}

/// Share that a corner returns whose apex lies at this section of the beam, at a distance from the axis, m.
///
/// `mouth_m` are the ends of its three legs from the apex, across the axis. The share is 0 where the apex is hidden.
pub fn corner_return(section: &Section, mouth_m: &[DVec2; 3], aside_m: f64) -> f64 {
    /// Directions from the apex over half a turn: the rim has corners, and their error falls with the square.
    const DIRECTIONS: u32 = 120;
    let [a, b, c] = *mouth_m;
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| {
        let normal = (to - from).perp();
        (normal, normal.dot(from))
    });
    let is_seen = sides.iter().all(|(_, distance)| distance * sides[0].1 > 0.0);
    if !is_seen {
        return 0.0;
    }
    let w2 = section.radius_m * section.radius_m;
    let wavenumber = 2.0 * PI / section.wavelength_m;
    let decay = Complex::new(2.0 / w2, wavenumber * section.curvature_per_m);
    // ∫ exp(−2α·y²) dA = π/2α·(1 − mean over directions of exp(−2α·ρ²)), ρ the distance of the rim.
    let mut beyond = Complex::ZERO;
    for step in 0..DIRECTIONS {
        let along = DVec2::from_angle(PI * (f64::from(step) + 0.5) / f64::from(DIRECTIONS));
        let rims_m = sides.map(|(normal, distance)| (distance / normal.dot(along)).abs());
        let rim_m = rims_m.into_iter().fold(f64::INFINITY, f64::min);
        beyond += (-decay * rim_m * rim_m).exp() / f64::from(DIRECTIONS);
    }
    let amplitude: Complex<f64> = (1.0 - beyond) * (2.0 / w2) / decay;
    (-4.0 * aside_m * aside_m / w2).exp() * amplitude.norm_sqr()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{Beam, Radar};
    use crate::units::db_from_ratio;

    fn beam() -> GaussianBeam {
        Beam::new(&Radar::default()).towards(0.0, 0.0)
    }

    /// |∫E·E′|² over (∫|E|²)² by midpoints over a square, E′ = E·exp(−2ik·depth).
    fn overlap(section: &Section, depth_m: impl Fn(DVec2) -> f64) -> f64 {
        const SIDE: i32 = 400;
        let step_m = 5.0 * section.radius_m / f64::from(SIDE);
        let k = 2.0 * PI / section.wavelength_m;
        let w2 = section.radius_m * section.radius_m;
        let (mut sum, mut power) = (Complex::ZERO, 0.0);
        for row in 0..SIDE {
            for column in 0..SIDE {
                let place = |at: i32| (f64::from(at) + 0.5 - 0.5 * f64::from(SIDE)) * step_m;
                let r = DVec2::new(place(column), place(row));
                let u = (-2.0 * r.length_squared() / w2).exp();
                let way_m = depth_m(r) + 0.5 * section.curvature_per_m * r.length_squared();
                sum += u * Complex::cis(-2.0 * k * way_m);
                power += u;
            }
        }
        (sum / power).norm_sqr()
    }

    #[test]
    fn plate_and_sphere_are_the_overlap_of_the_beam_with_its_reflection() {
        let beam = beam();
        for range_m in [7.7, 8.0, 8.4] {
            let section = beam.section(range_m);
            for tilt_rad in [0.0f64, 0.008, 0.02] {
                let found = overlap(&section, |r| tilt_rad.tan() * r.x);
                let expected = plate_return(&beam, range_m, tilt_rad);
                assert!((found / expected - 1.0).abs() < 1e-4, "{range_m} {tilt_rad}: {found}");
            }
            for (radius_m, aside_m) in [(0.1, 0.0), (0.1, 0.01), (0.15, 0.006), (2.0, 0.02)] {
                let centre = DVec2::new(aside_m, 0.0);
                let found = overlap(&section, |r| (r - centre).length_squared() / (2.0 * radius_m));
                let expected = sphere_return(&section, radius_m, aside_m);
                assert!((found / expected - 1.0).abs() < 1e-4, "{radius_m} {aside_m}: {found}");
            }
        }
    }

    /// Rows of `tests/fixtures/trihedral.csv`: leg (m), tilt (°), apex aside and behind the focus (m), share.
    fn integrated() -> Vec<[f64; 5]> {
        let text = include_str!("../../tests/fixtures/trihedral.csv");
        let numbers = |line: &str| {
            let mut numbers = line.split(',').map(|number| number.parse().unwrap());
            std::array::from_fn(|_| numbers.next().unwrap())
        };
        text.lines().skip(1).map(numbers).collect()
    }

    /// The mouth of a corner of this leg as seen from its axis of symmetry, tilted upwards.
    fn mouth_m(leg_m: f64, tilt_deg: f64) -> [DVec2; 3] {
        let (across_m, along_m) = (leg_m * (2.0f64 / 3.0).sqrt(), leg_m / 3f64.sqrt());
        let (sin, cos) = tilt_deg.to_radians().sin_cos();
        // As in the script: a turn towards the leg that points up from the axis.
        [90.0f64, 210.0, 330.0].map(|azimuth_deg| {
            let end_m = across_m * DVec2::from_angle(azimuth_deg.to_radians());
            DVec2::new(end_m.x, cos * end_m.y + sin * along_m)
        })
    }

    #[test]
    fn a_corner_returns_what_physical_optics_integrates() {
        let rows = integrated();
        assert!(rows.len() > 15, "{}", rows.len());
        for [leg_m, tilt_deg, aside_m, from_focus_m, expected] in rows {
            let section = beam().section(8.0 + from_focus_m);
            let found = corner_return(&section, &mouth_m(leg_m, tilt_deg), aside_m);
            let error_db = db_from_ratio(found / expected).abs();
            // The edges diffract, and small corners are mostly edge.
            let allowed_db = if leg_m < 0.08 { 0.08 } else { 0.003 };
            assert!(error_db < allowed_db, "{leg_m} {tilt_deg} {aside_m}: {error_db} dB");
        }
    }

    #[test]
    fn corners_have_their_limits() {
        let beam = beam();
        for from_focus_m in [0.0, 0.3] {
            let section = beam.section(8.0 + from_focus_m);
            // Large: a facing plate, whatever the tilt.
            for tilt_deg in [0.0, 20.0] {
                let found = corner_return(&section, &mouth_m(0.5, tilt_deg), 0.0);
                let expected = plate_return(&beam, 8.0 + from_focus_m, 0.0);
                assert!((found / expected - 1.0).abs() < 1e-6, "{found}");
            }
            // Small: the radar equation with σ = 4πL⁴/(3λ²), P·λ²·u²·σ/(4π).
            let leg_m = 1e-3;
            let u_per_m2 = 2.0 / (PI * section.radius_m.powi(2));
            let small = (u_per_m2 * leg_m * leg_m).powi(2) / 3.0;
            let found = corner_return(&section, &mouth_m(leg_m, 0.0), 0.0);
            assert!((found / small - 1.0).abs() < 0.01, "{found} {small}");
        }
        // The radar sees the corner from behind one of its plates.
        assert_eq!(corner_return(&beam.section(8.0), &mouth_m(0.1, 60.0), 0.0), 0.0);
    }
}
