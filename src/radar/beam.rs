//! The antenna's beam: one Gaussian mode, from which the spot, the antenna's aperture, the lobe of a
//! mirror and the weight of every ray follow.
//!
//! A beam of the wavelength λ has its waist w₀ at the focus, where the field falls to 1/e on a circle
//! of that radius. At the distance z from it along the axis, with z_R = π·w₀²/λ and ζ = z/z_R,
//!
//! - the radius is w = w₀·√(1 + ζ²),
//! - the wavefront's radius of curvature is R_c = z + z_R²/z, flat at the focus,
//! - a unit of power has the irradiance u(r) = 2/(π·w²)·exp(−2r²/w²),
//! - the same antenna receives a radiance with λ²·u(r): what it sees is what it lights.
//!
//! An extended diffuse target hence returns P·f·cos θ·λ²·∫u² dA = P·f·cos θ·λ²/(π·w²), and the
//! antenna's equivalent area is A_eq = λ²·R²/(π·w²). Sources: Goldsmith, *Quasioptical Systems* (1998),
//! ch. 2, for the mode; the antenna theorem A·Ω = λ² for its receiving side.
//!
//! Off the centre of the field of view the paper says that the spot grows, but not how (Sec. II-B). We
//! let the waist grow with the square of the distance.

use std::f64::consts::{LN_2, PI, SQRT_2};

use glam::DVec3;

use super::settings::{BeamEntry, Radar, SpotDiameter};
use crate::frames::{Direction, Global, Point, Pose, Ray, Target};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

impl Radar {
    /// Wavelength λ at the centre frequency, m.
    pub fn wavelength_m(&self) -> f64 {
        SPEED_OF_LIGHT_M_PER_S / (self.centre_frequency_ghz * 1e9)
    }

    /// Waist radius w₀ of the beam at the centre of the field of view, m.
    pub fn waist_m(&self) -> f64 {
        self.spot_diameter_m * self.spot_diameter_is.waist_per_diameter()
    }

    /// Full width at half maximum of the irradiance at the focus and the centre of the field of view, m:
    /// the spot's diameter by one convention, whichever the radar states.
    pub fn spot_fwhm_m(&self) -> f64 {
        match self.spot_diameter_is {
            SpotDiameter::OneWayFwhm => self.spot_diameter_m,
            SpotDiameter::TwoWayFwhm => SQRT_2 * self.spot_diameter_m,
            SpotDiameter::InverseE2 => (LN_2 / 2.0).sqrt() * self.spot_diameter_m,
        }
    }
}

/// The beams of a radar: one for each place of the target plane that it can look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    entry: BeamEntry,
    /// The beam towards the centre of the field of view.
    central: GaussianBeam,
    target_from_global: Pose<Target, Global>,
    /// Range of the target plane, m.
    pattern_range_m: f64,
}

impl Beam {
    /// The beams of a radar.
    pub fn new(radar: &Radar) -> Beam {
        Beam {
            entry: radar.beam,
            central: GaussianBeam {
                wavelength_m: radar.wavelength_m(),
                waist_m: radar.waist_m(),
                focus_m: radar.beam.focus_m,
            },
            target_from_global: radar.frames().global_from_target.inverse(),
            pattern_range_m: radar.frames().pattern_range_m,
        }
    }

    /// The beam that looks at (x_t, y_t) of the target plane, m; its waist is never below the wavelength.
    pub fn towards(&self, xt_m: f64, yt_m: f64) -> GaussianBeam {
        let BeamEntry { edge_growth, edge_m, .. } = self.entry;
        let off_centre = (xt_m * xt_m + yt_m * yt_m) / (edge_m * edge_m);
        let waist_m = self.central.waist_m * (1.0 + (edge_growth - 1.0) * off_centre);
        // A spot that shrinks away from the centre does so down to the wavelength.
        GaussianBeam { waist_m: waist_m.max(self.central.wavelength_m), ..self.central }
    }

    /// The beam along a ray from the radar.
    pub fn along(&self, axis: &Ray<Global>) -> GaussianBeam {
        let looks_at = Point::from(axis.origin.xyz + self.pattern_range_m * axis.direction.xyz());
        let aim = (self.target_from_global * looks_at).xyz;
        self.towards(aim.x, aim.y)
    }
}

/// One Gaussian beam along its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianBeam {
    /// Wavelength λ, m.
    pub wavelength_m: f64,
    /// Waist radius w₀, m: there the field has fallen to 1/e.
    pub waist_m: f64,
    /// Distance of the waist from the reflector along the axis, m.
    pub focus_m: f64,
}

impl GaussianBeam {
    /// Rayleigh length z_R = π·w₀²/λ, m: that far from the focus the spot's area has doubled.
    pub fn rayleigh_m(&self) -> f64 {
        PI * self.waist_m * self.waist_m / self.wavelength_m
    }

    /// δ₀ = λ/(2π·w₀), rad: the tilt at which a flat mirror returns 1/e, wherever along the beam.
    pub fn divergence_rad(&self) -> f64 {
        self.wavelength_m / (2.0 * PI * self.waist_m)
    }

    /// The beam at a distance along its axis from the reflector, m.
    pub fn section(&self, range_m: f64) -> Section {
        let (z_m, rayleigh_m) = (range_m - self.focus_m, self.rayleigh_m());
        let zeta = z_m / rayleigh_m;
        Section {
            wavelength_m: self.wavelength_m,
            range_m,
            radius_m: self.waist_m * (1.0 + zeta * zeta).sqrt(),
            curvature_per_m: z_m / (z_m * z_m + rayleigh_m * rayleigh_m),
        }
    }

    /// How well the antenna sees a place, over how equation (11) sees the spot of the beam along `axis`.
    ///
    /// The antenna receives a radiance as it sends, with λ²·u = λ²/(πw²)·2g, where g = exp(−2r²/w²). A single ray stands
    /// for the whole spot: then a place at the distance d from what the ray hit is seen as the mean of 2g over
    /// all that is lit, which is exp(−d²/w²) = √g(d).
    pub fn pattern(&self, axis: &Ray<Global>, rays: usize, place: Point<Global>) -> f64 {
        let to_place = place.xyz - axis.origin.xyz;
        let range_m = to_place.dot(axis.direction.xyz());
        if range_m <= 0.0 {
            return 0.0;
        }
        let beside_m = to_place.cross(axis.direction.xyz()).length();
        let seen = self.section(range_m).irradiance_ratio(beside_m);
        if rays == 1 { seen.sqrt() } else { 2.0 * seen }
    }

    /// The direction in which the wave of the beam along `axis` passes a point near it: at right angles
    /// to the wavefront there.
    pub fn direction_at(&self, axis: &Ray<Global>, point: Point<Global>) -> Direction<Global> {
        let (from_origin, forward) = (point.xyz - axis.origin.xyz, axis.direction.xyz());
        let range_m = from_origin.dot(forward);
        let aside_m = from_origin - range_m * forward;
        let curvature_per_m = self.section(range_m).curvature_per_m;
        Direction::new(forward + curvature_per_m * aside_m).unwrap_or(axis.direction)
    }
}

/// A beam at one place of its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Wavelength λ, m.
    pub wavelength_m: f64,
    /// Distance from the reflector along the axis R, m.
    pub range_m: f64,
    /// Radius w on which the field has fallen to 1/e, m.
    pub radius_m: f64,
    /// Curvature of the wavefront 1/R_c, 1/m: above 0 behind the focus, where the beam spreads.
    pub curvature_per_m: f64,
}

impl Section {
    /// δ_w = λ/(2π·w), rad: the part of the beam's divergence that is not in the curvature of its wavefront,
    /// δ₀² = δ_w² + w²/(4R_c²).
    pub fn divergence_rad(&self) -> f64 {
        self.wavelength_m / (2.0 * PI * self.radius_m)
    }

    /// λ²·∫u² dA = λ²/(π·w²), sr: what the antenna receives of an extended target's radiance, over the
    /// power that it sends.
    pub fn solid_angle_sr(&self) -> f64 {
        self.wavelength_m * self.wavelength_m / (PI * self.radius_m * self.radius_m)
    }

    /// Full width at half maximum of the irradiance, m.
    pub fn fwhm_m(&self) -> f64 {
        (2.0 * LN_2).sqrt() * self.radius_m
    }

    /// Full width at half maximum of the two-way weight u², m.
    pub fn two_way_fwhm_m(&self) -> f64 {
        LN_2.sqrt() * self.radius_m
    }

    /// The ray of the beam along `axis` that passes at `aside_m`, a vector across the axis, m. It stands at
    /// right angles on the wavefront, and is as long there as the wave's way, R + r²/(2R_c). `None` where
    /// the wavefront is so curved that no ray passes.
    pub fn ray(&self, axis: &Ray<Global>, aside_m: DVec3) -> Option<Ray<Global>> {
        let forward = axis.direction.xyz();
        let direction = Direction::new(forward + self.curvature_per_m * aside_m)?;
        let way_m = self.range_m + 0.5 * self.curvature_per_m * aside_m.length_squared();
        let place = axis.origin.xyz + self.range_m * forward + aside_m;
        Some(Ray { origin: Point::from(place - way_m * direction.xyz()), direction })
    }

    /// Irradiance beside the axis over that on it, exp(−2r²/w²), at the distance r, m.
    pub fn irradiance_ratio(&self, beside_m: f64) -> f64 {
        (-2.0 * (beside_m / self.radius_m).powi(2)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::db_from_ratio;

    /// The beam at the centre of the default radar's field of view.
    fn central() -> GaussianBeam {
        Beam::new(&Radar::default()).towards(0.0, 0.0)
    }

    #[test]
    fn the_spot_is_the_papers_at_the_centre_and_grows_from_there() {
        let beam = Beam::new(&Radar::default());
        assert!((beam.towards(0.0, 0.0).section(8.0).fwhm_m() - 0.016).abs() < 1e-15);
        assert!((beam.towards(0.3, 0.4).section(8.0).fwhm_m() - 0.024).abs() < 1e-15);
        assert!(beam.towards(0.0, 0.0).section(7.8).fwhm_m() > 0.016);
        // A waist that is g times as wide is g² times as deep in focus.
        let deeper = beam.towards(0.3, 0.4).rayleigh_m() / beam.towards(0.0, 0.0).rayleigh_m();
        assert!((deeper - 2.25).abs() < 1e-12);
    }

    #[test]
    fn out_of_focus_the_beam_spreads_and_the_echo_halves_at_the_rayleigh_length() {
        let beam = central();
        // By hand: w₀ = 16 mm/1.17741 = 13.589 mm, z_R = π·w₀²/0.99931 mm = 0.58055 m.
        assert!((beam.waist_m - 13.589e-3).abs() < 1e-6);
        assert!((beam.rayleigh_m() - 0.58055).abs() < 1e-4, "{}", beam.rayleigh_m());
        let focus = beam.section(8.0);
        for side in [-1.0, 1.0] {
            let there = beam.section(8.0 + side * beam.rayleigh_m());
            assert!((there.radius_m / focus.radius_m - 2f64.sqrt()).abs() < 1e-12);
            let fallen_db = db_from_ratio(there.solid_angle_sr() / focus.solid_angle_sr());
            assert!((fallen_db + 3.0103).abs() < 1e-4, "{fallen_db}");
            // The wavefront is most curved there: 1/R_c = 1/(2·z_R).
            let curvature = there.curvature_per_m * beam.rayleigh_m();
            assert!((curvature - 0.5 * side).abs() < 1e-12);
        }
        // Far out of focus the half angle is λ/(π·w₀), and the wave comes from the focus.
        let far = beam.section(1008.0);
        let half_angle = beam.wavelength_m / (PI * beam.waist_m);
        assert!((far.radius_m / 1000.0 / half_angle - 1.0).abs() < 1e-5);
        assert!((far.curvature_per_m * 1000.0 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn at_the_focus_the_beam_has_the_levels_that_follow_from_its_waist() {
        let focus = central().section(8.0);
        assert_eq!(focus.curvature_per_m, 0.0);
        assert!((focus.divergence_rad() - 0.0117).abs() < 1e-4);
        assert!((db_from_ratio(focus.solid_angle_sr()) + 27.64).abs() < 0.01);
        // λ²/(π·w²) = 4π·δ_w².
        let by_divergence = 4.0 * PI * focus.divergence_rad().powi(2);
        assert!((focus.solid_angle_sr() / by_divergence - 1.0).abs() < 1e-12);
    }

    #[test]
    fn receiving_as_it_lights_gives_the_solid_angle() {
        // λ²·∫u²·2πr dr by midpoints.
        let section = central().section(8.3);
        let (steps, step_m) = (4000, 5.0 * section.radius_m / 4000.0);
        let u = |r: f64| 2.0 / (PI * section.radius_m.powi(2)) * section.irradiance_ratio(r);
        let rings = (0..steps).map(|i| (f64::from(i) + 0.5) * step_m);
        let sum: f64 = rings.map(|r| u(r).powi(2) * 2.0 * PI * r * step_m).sum();
        let expected = section.solid_angle_sr();
        let found = section.wavelength_m.powi(2) * sum;
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} is not {expected}");
    }

    #[test]
    fn rays_follow_the_beam_s_radius_and_its_phase() {
        let beam = central();
        let axis =
            Ray { origin: Point::new(0.0, 0.0, 0.0), direction: Direction::new(DVec3::Z).unwrap() };
        for range_m in [7.0, 8.0, 8.4] {
            let section = beam.section(range_m);
            let aside_m = DVec3::new(0.6, -0.3, 0.0) * section.radius_m;
            let ray = section.ray(&axis, aside_m).unwrap();
            // dw/dz = w/R_c: to first order a ray stays at its share of the radius.
            let (step_m, near) = (1e-4, beam.section(range_m + 1e-4));
            let along = |way_m: f64| ray.origin.xyz + way_m * ray.direction.xyz();
            let way_m = range_m + 0.5 * section.curvature_per_m * aside_m.length_squared();
            assert!((along(way_m) - (range_m * DVec3::Z + aside_m)).length() < 1e-12);
            let moved = along(way_m + step_m).truncate().length() / near.radius_m;
            assert!((moved - aside_m.length() / section.radius_m).abs() < 1e-7, "{range_m}");
            let found = beam.direction_at(&axis, Point::from(along(way_m)));
            assert!((found.xyz() - ray.direction.xyz()).length() < 1e-12);
        }
    }

    #[test]
    fn one_beam_has_three_diameters() {
        let stated = |spot_diameter_m, spot_diameter_is| Radar {
            spot_diameter_m,
            spot_diameter_is,
            ..Radar::default()
        };
        for (spot_diameter_is, waist_mm) in [
            (SpotDiameter::OneWayFwhm, 13.589),
            (SpotDiameter::TwoWayFwhm, 19.218),
            (SpotDiameter::InverseE2, 8.0),
        ] {
            let radar = stated(0.016, spot_diameter_is);
            assert!((1e3 * radar.waist_m() - waist_mm).abs() < 1e-3, "{spot_diameter_is:?}");
            let section = Beam::new(&radar).towards(0.0, 0.0).section(8.0);
            assert!((section.fwhm_m() - radar.spot_fwhm_m()).abs() < 1e-15);
            // At half of each diameter the irradiance is what the diameter says.
            let expected = match spot_diameter_is {
                SpotDiameter::OneWayFwhm => 0.5,
                SpotDiameter::TwoWayFwhm => 0.5f64.sqrt(),
                SpotDiameter::InverseE2 => (-2f64).exp(),
            };
            assert!((section.irradiance_ratio(0.008) - expected).abs() < 1e-12);
        }
    }
}
