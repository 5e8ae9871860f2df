//! The polarisation of a wave along its path: which share of a specular echo each channel of an antenna receives.
//!
//! At a facet with the unit normal n the field splits into its part along s = d × n/|d × n| and the one in the plane of
//! incidence, along s × d. Each is reflected with its own amplitude, r_s and r_p. A law's f is that of an
//! unpolarised wave, so that the amplitudes are divided by √((|r_s|² + |r_p|²)/2). At normal incidence r_s = r_p.
//!
//! A sheet lets the same two parts pass with t_s and t_p. By reciprocity the way back does what the transposed matrix
//! says.

use glam::{DMat3, DVec3};
use num_complex::Complex;

/// The complex electric field of a wave, of unit power where it was sent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
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

    /// The field behind sheets.
    pub fn through(self, sheets: Filter) -> Field {
        let Filter { real, imaginary } = sheets;
        Field {
            real: real * self.real - imaginary * self.imaginary,
            imaginary: real * self.imaginary + imaginary * self.real,
        }
    }

    /// Its whole power.
    pub fn power(self) -> f64 {
        self.real.length_squared() + self.imaginary.length_squared()
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

/// What sheets on a straight way do to a field: a complex matrix over the axes of the global frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Filter {
    real: DMat3,
    imaginary: DMat3,
}

impl Filter {
    /// A sheet with a unit normal, met along a unit vector, that lets the amplitudes t_s and t_p pass.
    pub fn of_sheet(along: DVec3, normal: DVec3, [t_s, t_p]: [Complex<f64>; 2]) -> Filter {
        // Straight through every s is as good as any other.
        let s = along.cross(normal).try_normalize().unwrap_or(along.any_orthonormal_vector());
        let p = s.cross(along);
        let (s_dyad, p_dyad) = (dyad(s), dyad(p));
        Filter {
            real: t_s.re * s_dyad + t_p.re * p_dyad,
            imaginary: t_s.im * s_dyad + t_p.im * p_dyad,
        }
    }

    /// These sheets and then others.
    pub fn then(self, onward: Filter) -> Filter {
        Filter {
            real: onward.real * self.real - onward.imaginary * self.imaginary,
            imaginary: onward.real * self.imaginary + onward.imaginary * self.real,
        }
    }

    /// The same sheets on the way back.
    pub fn reversed(self) -> Filter {
        Filter { real: self.real.transpose(), imaginary: self.imaginary.transpose() }
    }

    /// Share of unpolarised power that passes.
    pub fn power_ratio(self) -> f64 {
        let columns = |of: DMat3| {
            of.x_axis.length_squared() + of.y_axis.length_squared() + of.z_axis.length_squared()
        };
        0.5 * (columns(self.real) + columns(self.imaginary))
    }
}

/// The matrix that keeps a field's part along a unit vector.
fn dyad(unit: DVec3) -> DMat3 {
    DMat3::from_cols(unit.x * unit, unit.y * unit, unit.z * unit)
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
            .map(Field::power)
            .iter()
            .sum();
        assert!((total / 2.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_sheet_passes_each_part_and_turns_what_lies_between_them() {
        let (t_s, t_p) = (Complex::new(0.3, 0.0), Complex::new(0.5, 0.6));
        let (along, normal) = (DVec3::NEG_Z, DVec3::new(0.0, 0.6, 0.8));
        let sheet = Filter::of_sheet(along, normal, [t_s, t_p]);
        let passed = |field: DVec3| Field::linear(field).through(sheet);
        assert!((passed(DVec3::X).power() - t_s.norm_sqr()).abs() < 1e-15);
        assert!((passed(DVec3::Y).power() - t_p.norm_sqr()).abs() < 1e-15);
        let mean = 0.5 * (t_s.norm_sqr() + t_p.norm_sqr());
        assert!((sheet.power_ratio() - mean).abs() < 1e-15);
        // There and back in between: (t_s² ± t_p²)/2.
        let [aside, up] = [DVec3::X, DVec3::Y];
        let [field, across] = [1.0, -1.0].map(|side| (up + side * aside).normalize());
        let back = Field::linear(field).through(sheet).through(sheet.reversed());
        let [co, cross] = [1.0, -1.0].map(|side| (0.5 * (t_p * t_p + side * t_s * t_s)).norm_sqr());
        assert!((back.power_along(field) - co).abs() < 1e-15);
        assert!((back.power_along(across) - cross).abs() < 1e-15);
    }

    #[test]
    fn two_sheets_pass_a_field_in_their_order() {
        let amplitudes = [Complex::new(0.9, 0.1), Complex::new(0.2, -0.4)];
        let first = Filter::of_sheet(DVec3::NEG_Z, DVec3::new(0.6, 0.0, 0.8), amplitudes);
        let second = Filter::of_sheet(DVec3::NEG_Z, DVec3::new(0.5, 0.5, 0.7), amplitudes);
        let field = Field::linear(DVec3::new(0.8, 0.6, 0.0));
        let [one_by_one, together] =
            [field.through(first).through(second), field.through(first.then(second))];
        assert!((one_by_one.real - together.real).length() < 1e-15);
        assert!((one_by_one.imaginary - together.imaginary).length() < 1e-15);
        let way_back = first.then(second).reversed();
        let expected = second.reversed().then(first.reversed());
        let [found, expected] = [way_back, expected].map(|way| field.through(way));
        assert!((found.real - expected.real).length() < 1e-15);
        assert!((found.imaginary - expected.imaginary).length() < 1e-15);
    }
}
