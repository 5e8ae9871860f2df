//! Coordinate frames as types, and the paper's maps between them: equations (2), (3) and (4).
//!
//! A [`Point<Target>`] cannot be mistaken for a [`Point<Global>`]; a [`Pose<To, From>`] turns one
//! into the other and is named by both ends, `global_from_target`. All lengths are metres, all
//! angles radians.
//!
//! ```
//! use matdb::frames::{Global, Point, Pose, Target, antenna_from_target, global_from_antenna};
//! let target = Point::<Target>::new(0.1, 0.2, 0.0);
//! let global_from_target: Pose<Global, Target> =
//!     global_from_antenna(0.3, Point::new(0.0, 1.1, 8.0))
//!         * antenna_from_target(0.1, Point::new(0.0, 0.0, -8.0));
//! let back = global_from_target.inverse() * (global_from_target * target);
//! assert!((back.xyz - target.xyz).length() < 1e-12);
//! ```

use std::marker::PhantomData;
use std::ops::Mul;

use glam::{DMat3, DQuat, DVec2, DVec3};

/// `St`: origin at the secondary focus; x and y span the target plane, z is normal to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target;

/// `Sa`: origin at the primary focus; x and y lie in the focal plane, z is normal to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Antenna;

/// `Sg`: fixed to the radar table, y up; meshes and clouds are written in this frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Global;

/// A mesh's own frame, as its file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model;

/// A facet's frame: z along the surface normal, x and y along the surface. Scattering lives here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface;

/// A position in frame `F`, m.
#[derive(Debug, PartialEq)]
pub struct Point<F> {
    /// Coordinates, m.
    pub xyz: DVec3,
    frame: PhantomData<F>,
}

/// A unit vector in frame `F`.
#[derive(Debug, PartialEq)]
pub struct Direction<F> {
    xyz: DVec3,
    frame: PhantomData<F>,
}

/// A rigid map from frame `From` to frame `To`.
#[derive(Debug, PartialEq)]
pub struct Pose<To, From> {
    rotation: DMat3,
    translation_m: DVec3,
    frames: PhantomData<(To, From)>,
}

// Derived `Clone`/`Copy` would ask the frame markers for it; these hold for any frame.
macro_rules! copy_in_any_frame {
    ($($name:ident<$($frame:ident),+>),+) => {$(
        impl<$($frame),+> Clone for $name<$($frame),+> {
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<$($frame),+> Copy for $name<$($frame),+> {}
    )+};
}
copy_in_any_frame!(Point<F>, Direction<F>, Ray<F>, Pose<To, From>);

/// A half-line in frame `F`.
#[derive(Debug, PartialEq)]
pub struct Ray<F> {
    /// Where it starts.
    pub origin: Point<F>,
    /// Where it goes.
    pub direction: Direction<F>,
}

impl<F> Point<F> {
    /// A point from its coordinates, m.
    pub fn new(x_m: f64, y_m: f64, z_m: f64) -> Self {
        DVec3::new(x_m, y_m, z_m).into()
    }

    /// Distance to another point of the same frame, m.
    pub fn distance_m(&self, other: Point<F>) -> f64 {
        self.xyz.distance(other.xyz)
    }

    /// Unit vector towards another point; `None` when the two coincide or are not finite.
    pub fn towards(&self, other: Point<F>) -> Option<Direction<F>> {
        Direction::new(other.xyz - self.xyz)
    }
}

impl<F> From<DVec3> for Point<F> {
    fn from(xyz: DVec3) -> Self {
        Point { xyz, frame: PhantomData }
    }
}

impl<F> Direction<F> {
    /// The unit vector along `vector`; `None` when it is zero or not finite.
    pub fn new(vector: DVec3) -> Option<Self> {
        vector.try_normalize().map(|xyz| Direction { xyz, frame: PhantomData })
    }

    /// Components of the unit vector.
    pub fn xyz(&self) -> DVec3 {
        self.xyz
    }
}

impl Direction<Surface> {
    /// A direction by its angle from the normal and its azimuth about it, rad.
    pub fn from_angles(theta_rad: f64, azimuth_rad: f64) -> Self {
        let (sin, cos) = theta_rad.sin_cos();
        let xyz = DVec3::new(sin * azimuth_rad.cos(), sin * azimuth_rad.sin(), cos);
        Direction { xyz, frame: PhantomData }
    }

    /// The direction of the same azimuth at another angle from the normal, given by its cosine, −1 to 1. On the
    /// normal itself the azimuth is 0.
    pub fn turned(&self, cos_theta: f64) -> Self {
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let aside = self.xyz.truncate().normalize_or(DVec2::X) * sin_theta;
        Direction { xyz: aside.extend(cos_theta), frame: PhantomData }
    }

    /// The direction in which a mirror reflects this one.
    pub fn mirrored(&self) -> Self {
        let DVec3 { x, y, z } = self.xyz;
        Direction { xyz: DVec3::new(-x, -y, z), frame: PhantomData }
    }

    /// Cosine of the angle to the surface normal.
    pub fn cos_theta(&self) -> f64 {
        self.xyz.z
    }
}

impl<F> std::ops::Neg for Direction<F> {
    type Output = Self;
    fn neg(self) -> Self {
        Direction { xyz: -self.xyz, frame: PhantomData }
    }
}

impl<To, From> Pose<To, From> {
    /// Rotation first, then translation (m).
    ///
    /// `rotation` must be proper orthogonal; it is the caller's to guarantee.
    pub fn new(rotation: DMat3, translation_m: DVec3) -> Self {
        Pose { rotation, translation_m, frames: PhantomData }
    }

    /// Neither turned nor shifted.
    pub const NONE: Self =
        Pose { rotation: DMat3::IDENTITY, translation_m: DVec3::ZERO, frames: PhantomData };

    /// Rotation by roll, pitch, yaw about the fixed axes x, then y, then z (rad), then a shift (m).
    pub fn from_euler_xyz(rotation_rad: DVec3, translation_m: DVec3) -> Self {
        let quaternion = DQuat::from_rotation_z(rotation_rad.z)
            * DQuat::from_rotation_y(rotation_rad.y)
            * DQuat::from_rotation_x(rotation_rad.x);
        Pose::new(DMat3::from_quat(quaternion), translation_m)
    }

    /// The rotation matrix.
    pub fn rotation(&self) -> DMat3 {
        self.rotation
    }

    /// Where `From`'s origin lies in `To`, m.
    pub fn translation_m(&self) -> DVec3 {
        self.translation_m
    }

    /// The map back.
    pub fn inverse(&self) -> Pose<From, To> {
        let rotation = self.rotation.transpose();
        Pose::new(rotation, -(rotation * self.translation_m))
    }
}

impl<To, From> Mul<Point<From>> for Pose<To, From> {
    type Output = Point<To>;
    fn mul(self, point: Point<From>) -> Point<To> {
        (self.rotation * point.xyz + self.translation_m).into()
    }
}

impl<To, From> Mul<Direction<From>> for Pose<To, From> {
    type Output = Direction<To>;
    fn mul(self, direction: Direction<From>) -> Direction<To> {
        Direction { xyz: self.rotation * direction.xyz, frame: PhantomData }
    }
}

impl<To, From> Mul<Ray<From>> for Pose<To, From> {
    type Output = Ray<To>;
    fn mul(self, ray: Ray<From>) -> Ray<To> {
        Ray { origin: self * ray.origin, direction: self * ray.direction }
    }
}

impl<To, Mid, From> Mul<Pose<Mid, From>> for Pose<To, Mid> {
    type Output = Pose<To, From>;
    fn mul(self, inner: Pose<Mid, From>) -> Pose<To, From> {
        Pose::new(
            self.rotation * inner.rotation,
            self.rotation * inner.translation_m + self.translation_m,
        )
    }
}

/// Equation (2): z_t of a detection at (x_t, y_t) and range R from the main reflector's centre.
///
/// z_t = z_c + s·√(R² − (x_t − x_c)² − (y_t − y_c)²), with s chosen so that the point lies on the
/// target plane's side of the reflector. `None` when the root is not real: no such detection.
///
/// ```
/// use matdb::frames::{Point, Target, target_z_m};
/// let reflector = Point::<Target>::new(0.0, 0.0, 8.0);
/// assert_eq!(target_z_m(0.0, 0.0, 8.0, reflector), Some(0.0));
/// assert_eq!(target_z_m(3.0, 0.0, 2.0, reflector), None);
/// ```
pub fn target_z_m(
    xt_m: f64,
    yt_m: f64,
    range_m: f64,
    reflector_centre: Point<Target>,
) -> Option<f64> {
    let c = reflector_centre.xyz;
    let squared = range_m.powi(2) - (xt_m - c.x).powi(2) - (yt_m - c.y).powi(2);
    (squared >= 0.0).then(|| c.z - c.z.signum() * squared.sqrt())
}

/// Equation (3): r_a = O_t + Ry(τ)·r_t.
///
/// τ is the rotation of the target plane against the focal plane, rad; `secondary_focus` is O_t.
pub fn antenna_from_target(tau_rad: f64, secondary_focus: Point<Antenna>) -> Pose<Antenna, Target> {
    let (sin, cos) = tau_rad.sin_cos();
    let rows = [[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]];
    Pose::new(DMat3::from_cols_array_2d(&rows).transpose(), secondary_focus.xyz)
}

/// Equation (4): r_g = O_a + M(α)·r_a.
///
/// α is the yaw of the antenna on the table, rad; `primary_focus` is O_a. At α = −π/2 the axes of
/// the two frames are parallel.
pub fn global_from_antenna(alpha_rad: f64, primary_focus: Point<Global>) -> Pose<Global, Antenna> {
    let (sin, cos) = alpha_rad.sin_cos();
    let rows = [[-sin, 0.0, -cos], [0.0, 1.0, 0.0], [cos, 0.0, -sin]];
    Pose::new(DMat3::from_cols_array_2d(&rows).transpose(), primary_focus.xyz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Round trips at distances up to 10 m lose a few units in the last place of 10 m.
    const ROUND_TRIP_M: f64 = 1e-12;

    fn chain(tau_rad: f64, alpha_rad: f64) -> Pose<Global, Target> {
        global_from_antenna(alpha_rad, Point::new(0.4, 1.1, 7.0))
            * antenna_from_target(tau_rad, Point::new(0.3, -0.2, -8.0))
    }

    proptest! {
        #[test]
        fn the_maps_are_rigid_and_invertible(
            tau in -3.0f64..3.0, alpha in -3.0f64..3.0,
            x in -1.0f64..1.0, y in -1.0f64..1.0, z in -1.0f64..1.0,
        ) {
            let pose = chain(tau, alpha);
            prop_assert!((pose.rotation().determinant() - 1.0).abs() < 1e-14);
            let point = Point::<Target>::new(x, y, z);
            let back = pose.inverse() * (pose * point);
            prop_assert!(back.distance_m(point) < ROUND_TRIP_M);
        }

        #[test]
        fn equation_2_inverts_the_range(
            x in -0.5f64..0.5, y in -0.5f64..0.5, z in -1.0f64..1.0,
        ) {
            let centre = Point::<Target>::new(0.1, -0.05, 8.0);
            let range_m = centre.distance_m(Point::new(x, y, z));
            let zt = target_z_m(x, y, range_m, centre).unwrap();
            prop_assert!((zt - z).abs() < ROUND_TRIP_M);
        }
    }

    #[test]
    fn the_matrices_are_the_papers() {
        let r = antenna_from_target(0.1, Point::new(1.0, 2.0, 3.0)) * Point::new(1.0, 0.0, 0.0);
        assert_eq!(r.xyz, DVec3::new(1.0 + 0.1f64.cos(), 2.0, 3.0 + 0.1f64.sin()));
        let r = global_from_antenna(0.2, Point::new(0.0, 0.0, 0.0)) * Point::new(0.0, 0.0, 1.0);
        assert_eq!(r.xyz, DVec3::new(-0.2f64.cos(), 0.0, -0.2f64.sin()));
    }

    #[test]
    fn euler_angles_turn_about_fixed_axes() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let pose: Pose<Global, Model> =
            Pose::from_euler_xyz(DVec3::new(quarter, quarter, 0.0), DVec3::ZERO);
        // x-turn takes y to z, then the y-turn takes z to x.
        let turned = pose * Point::new(0.0, 1.0, 0.0);
        assert!(turned.xyz.distance(DVec3::X) < 1e-15);
    }
}
