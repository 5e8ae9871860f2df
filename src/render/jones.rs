//! The polarisation of a wave along its path: which share of a specular echo each channel of an antenna receives.
//!
//! At a facet with the unit normal n the field splits into its part along s = d × n/|d × n| and the one in the plane of
//! incidence, along s × d. Each is reflected with its own amplitude, r_s and r_p. A law's f is that of an
//! unpolarised wave, so that the amplitudes are divided by √((|r_s|² + |r_p|²)/2). At normal incidence r_s = r_p.

use glam::DVec3;
use num_complex::Complex;

/// The complex electric field of a wave, of unit power where it was sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    real: DVec3,
    imaginary: DVec3,
}

impl Field {
    /// A linear field along a unit vector.
    pub fn linear(along: DVec3) -> Field {
        Field { real: along, imaginary: DVec3::ZERO }
    }

    /// The field after a reflection from the direction `from` into the direction `to`, unit vectors, by a facet with
    /// the amplitudes r_s and r_p.
    pub fn reflected(self, from: DVec3, to: DVec3, [r_s, r_p]: [Complex<f64>; 2]) -> Field {
        let mean = (0.5 * (r_s.norm_sqr() + r_p.norm_sqr())).sqrt();
        if mean == 0.0 {
            return Field { real: DVec3::ZERO, imaginary: DVec3::ZERO };
        }
        // Back along the same line every s is as good as any other.
        let across = from.cross(to).try_normalize().unwrap_or(from.any_orthonormal_vector());
        // At normal incidence s × d turns round with d, and the field along it keeps the sign of r_p = r_s.
        let s = r_s / mean * self.along(across);
        let p = -r_p / mean * self.along(across.cross(from));
        let plane = across.cross(to);
        Field { real: s.re * across + p.re * plane, imaginary: s.im * across + p.im * plane }
    }

    /// The field's component along a unit vector.
    fn along(self, unit: DVec3) -> Complex<f64> {
        Complex::new(self.real.dot(unit), self.imaginary.dot(unit))
    }

    /// The power that an antenna receives of it whose field is along a unit vector.
    pub fn power_along(self, unit: DVec3) -> f64 {
        self.along(unit).norm_sqr()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONDUCTOR: [Complex<f64>; 2] = [Complex::new(-1.0, 0.0), Complex::new(-1.0, 0.0)];

    /// The field that a corner of two conductors with a vertical edge, turned about the line of sight, sends back.
    fn dihedral(field: DVec3, turn_rad: f64) -> Field {
        let (sin, cos) = turn_rad.sin_cos();
        let sideways = DVec3::new(cos, sin, 0.0);
        let (ahead, back) = (DVec3::NEG_Z, DVec3::Z);
        Field::linear(field)
            .reflected(ahead, sideways, CONDUCTOR)
            .reflected(sideways, back, CONDUCTOR)
    }

    #[test]
    fn a_corner_turns_one_of_two_fields_round() {
        let (up, aside) = (DVec3::Y, DVec3::X);
        let [vertical, horizontal] = [up, aside].map(|field| dihedral(field, 0.0).along(field).re);
        assert!((vertical + horizontal).abs() < 1e-15 && vertical.abs() > 1.0 - 1e-15);
    }

    #[test]
    fn a_corner_turned_by_45_degrees_crosses_the_field() {
        let turned = dihedral(DVec3::Y, std::f64::consts::FRAC_PI_4);
        assert!(turned.power_along(DVec3::Y) < 1e-30);
        assert!((turned.power_along(DVec3::X) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_conductor_keeps_the_power_and_a_plate_keeps_the_field() {
        let from = DVec3::new(0.2, -0.3, -0.9).normalize();
        let field = from.any_orthonormal_vector();
        let to = DVec3::new(-0.5, 0.1, 0.4).normalize();
        let after = Field::linear(field).reflected(from, to, CONDUCTOR);
        let [a, b] = [to.any_orthonormal_vector(), to.cross(to.any_orthonormal_vector())];
        assert!((after.power_along(a) + after.power_along(b) - 1.0).abs() < 1e-12);
        let back = Field::linear(field).reflected(from, -from, CONDUCTOR);
        assert!((back.along(field) + 1.0).norm() < 1e-12);
    }

    #[test]
    fn half_of_an_unpolarised_wave_is_what_the_amplitudes_say() {
        let amplitudes = [Complex::new(-0.6, 0.1), Complex::new(0.1, -0.2)];
        let (from, to) = (DVec3::NEG_Z, DVec3::new(0.8, 0.0, -0.6));
        let total: f64 = [DVec3::X, DVec3::Y]
            .map(|field| Field::linear(field).reflected(from, to, amplitudes))
            .map(|after| after.real.length_squared() + after.imaginary.length_squared())
            .iter()
            .sum();
        assert!((total / 2.0 - 1.0).abs() < 1e-12);
    }
}
