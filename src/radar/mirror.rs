//! The scanning mirror and the optics behind it, exactly (paper, Sec. II-B and figure 3).
//!
//! A plane wave meets a flat mirror whose normal is a little off its axis of rotation. Turning by φ
//! lets the normal run round a cone, tilting the whole assembly by γ carries that cone up and down,
//! and the law of reflection gives the deflected wave. The reflectors behind multiply its angles
//! and send it from the centre of the main reflector to the target. The image of the cone is an
//! ellipse, as much flatter than wide as the cosine of the incidence on the mirror.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::error::Check;
use crate::frames::{Direction, Point, Ray, Target};

/// The scanning optics, as scene files write them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Optics {
    /// Horizontal axis of the ellipse that the spinning mirror draws at the secondary focus, m.
    /// 0.5: paper.
    pub ellipse_width_m: f64,
    /// Vertical axis of the ellipse, at most the horizontal one, m. 0.4: paper; with it the wave
    /// meets the mirror at arccos(0.4/0.5) = 36.9°.
    pub ellipse_height_m: f64,
    /// Angle of the outgoing wave per angle of the wave leaving the mirror. 0.5: assumed; the
    /// paper's reflectors are not published.
    pub angular_magnification: f64,
    /// Horizontal and vertical direction of the undeflected beam off the line from the main
    /// reflector's centre to the secondary focus, degrees. 0, 0: assumed.
    pub offset_deg: [f64; 2],
}

impl Default for Optics {
    fn default() -> Self {
        Optics {
            ellipse_width_m: 0.5,
            ellipse_height_m: 0.4,
            angular_magnification: 0.5,
            offset_deg: [0.0, 0.0],
        }
    }
}

impl Optics {
    pub(super) fn checks(&self) -> Vec<Check> {
        let [right_deg, up_deg] = self.offset_deg;
        vec![
            ("optics.ellipse_width_m", self.ellipse_width_m, (1e-4, 10.0)),
            ("optics.ellipse_height_m", self.ellipse_height_m, (1e-5, self.ellipse_width_m)),
            ("optics.angular_magnification", self.angular_magnification, (0.01, 100.0)),
            ("optics.offset_deg[0]", right_deg, (-45.0, 45.0)),
            ("optics.offset_deg[1]", up_deg, (-45.0, 45.0)),
        ]
    }
}

/// Angles of the mirror at one chirp, a row of the paper's Ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorAngles {
    /// Tilt of the assembly γ, rad.
    pub gamma_rad: f64,
    /// Rotation of the mirror φ, rad.
    pub phi_rad: f64,
}

/// The mirror of one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    optics: Optics,
    reflector_centre: Point<Target>,
    /// Angle between the incoming wave and the axis of rotation, rad.
    incidence_rad: f64,
    /// Angle between the mirror's normal and the axis of rotation, rad.
    wobble_rad: f64,
}

impl Mirror {
    /// The mirror that draws the ellipse of these optics at the range of the secondary focus.
    pub fn new(optics: Optics, reflector_centre: Point<Target>) -> Mirror {
        let range_m = reflector_centre.xyz.length();
        // The horizontal deflection of a mirror turned by δ in the plane of incidence is exactly 2δ.
        let half_angle_rad = (0.5 * optics.ellipse_width_m / range_m).asin();
        let wobble_rad = 0.5 * (half_angle_rad.tan() / optics.angular_magnification).atan();
        let incidence_rad = (optics.ellipse_height_m / optics.ellipse_width_m).acos();
        Mirror { optics, reflector_centre, incidence_rad, wobble_rad }
    }

    /// The ray that leaves the main reflector at these angles.
    pub fn ray(&self, angles: MirrorAngles) -> Option<Ray<Target>> {
        let [u, v] = self.outgoing(angles);
        let [right, up, forward] = self.chief_axes()?;
        let direction = Direction::new(forward + u * right + v * up)?;
        Some(Ray { origin: self.reflector_centre, direction })
    }

    /// Where the ray is at range R: (x_t, y_t), m. `None` for angles at which it leaves backwards.
    pub fn target_point_m(&self, angles: MirrorAngles, range_m: f64) -> Option<[f64; 2]> {
        let ray = self.ray(angles)?;
        Some((ray.origin.xyz + range_m * ray.direction.xyz()).truncate().to_array())
    }

    /// Tilt that carries the middle of the ellipse up by `height_m` at the focus, rad.
    pub fn tilt_for_height_rad(&self, height_m: f64) -> f64 {
        let range_m = self.reflector_centre.xyz.length();
        let outgoing = (height_m / range_m).asin().tan() / self.optics.angular_magnification;
        0.5 * outgoing.atan() / self.incidence_rad.cos()
    }

    /// Tangents of the outgoing direction, to the right and upwards, after the reflectors.
    fn outgoing(&self, angles: MirrorAngles) -> [f64; 2] {
        let wave = self.reflected(angles);
        let Optics { angular_magnification, offset_deg, .. } = self.optics;
        let tangents = [wave.x / -wave.z, wave.y / -wave.z];
        [0, 1].map(|axis| {
            tangents[axis] * angular_magnification + offset_deg[axis].to_radians().tan()
        })
    }

    /// The law of reflection. The undeflected wave leaves along −z, x to the right and y up.
    fn reflected(&self, MirrorAngles { gamma_rad, phi_rad }: MirrorAngles) -> DVec3 {
        let (sin, cos) = self.incidence_rad.sin_cos();
        let axis = DVec3::new(sin, 0.0, -cos);
        let across = DVec3::new(cos, 0.0, sin);
        let incoming = -DVec3::Z - 2.0 * (-DVec3::Z).dot(axis) * axis;
        let (wobble_sin, wobble_cos) = self.wobble_rad.sin_cos();
        let round = phi_rad.cos() * across + phi_rad.sin() * DVec3::Y;
        let normal =
            DMat3::from_axis_angle(across, gamma_rad) * (wobble_cos * axis + wobble_sin * round);
        incoming - 2.0 * incoming.dot(normal) * normal
    }

    /// Right, up and forward of the undeflected beam in the target frame.
    fn chief_axes(&self) -> Option<[DVec3; 3]> {
        let forward = (-self.reflector_centre.xyz).try_normalize()?;
        let right = forward.cross(DVec3::Y).try_normalize()?;
        Some([right, right.cross(forward), forward])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn mirror() -> Mirror {
        Mirror::new(Optics::default(), Point::new(0.0, 0.0, 8.0))
    }

    fn point(mirror: &Mirror, gamma_rad: f64, phi_rad: f64) -> [f64; 2] {
        mirror.target_point_m(MirrorAngles { gamma_rad, phi_rad }, 8.0).unwrap()
    }

    #[test]
    fn a_mirror_without_wobble_reflects_along_the_axis() {
        let still = Mirror { wobble_rad: 0.0, ..mirror() };
        let [x, y] = point(&still, 0.0, 1.0);
        assert!(x.abs() < 1e-15 && y.abs() < 1e-15);
    }

    #[test]
    fn reflection_keeps_the_length_and_the_angle_to_the_normal() {
        let wave = mirror().reflected(MirrorAngles { gamma_rad: 0.03, phi_rad: 2.0 });
        assert!((wave.length() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_ellipse_is_as_wide_as_asked_and_flatter_by_the_cosine_of_the_incidence() {
        let [right, _] = point(&mirror(), 0.0, 0.0);
        let [left, _] = point(&mirror(), 0.0, PI);
        assert!((right.abs() - 0.25).abs() < 1e-12 && (left.abs() - 0.25).abs() < 1e-12);
        assert!(right * left < 0.0);
        let [_, top] = point(&mirror(), 0.0, FRAC_PI_2);
        // Second order in the wobble of 3.6°.
        assert!((top.abs() - 0.2).abs() < 1e-3, "{top}");
    }

    #[test]
    fn tilting_carries_the_ellipse_up() {
        let mirror = mirror();
        let still = Mirror { wobble_rad: 0.0, ..mirror };
        for height_m in [-0.25, 0.1, 0.25] {
            let [x, y] = point(&still, mirror.tilt_for_height_rad(height_m), 0.0);
            assert!((y - height_m).abs() < 2e-3, "{y} is not {height_m}");
            assert!(x.abs() < 0.02);
        }
    }
}
