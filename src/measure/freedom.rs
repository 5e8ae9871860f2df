//! Motions of a target that its points do not tell: the turns of a sphere, a plate within its plane.
//!
//! A small motion is a twist: a shift t of a pivot and a turn ω about it. Where a twist changes the gaps along the rays by less
//! than their errors explain, no registration follows it, and the target keeps the pose that it was given in that direction.
//! The untold twists span a space, which is named by the shifts in it and by turns about axes or about a point.

use glam::DVec3;
use nalgebra::{DMatrix, DVector, Matrix6, SymmetricEigen, Vector6};

use crate::frames::{Global, Point};

/// A twist is told by points that determine the shift, m, and the turn, rad, in it this well, as standard deviations.
const TOLD_M: f64 = 1e-3;
const TOLD_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// Points with less information about a twist tell nothing of it: a thousandth of one point's, far above the rounding of a
/// plane's zero.
const LEAST_INFORMATION: f64 = 1e-3;
/// How much more a turn counts than a shift that moves the target as far, where the points tell neither.
const TURNS_COUNT: f64 = 30.0;
/// Turns below this share of a unit twist belong to a shift.
const NO_TURN: f64 = 0.1;
/// Turns are about one point when it moves by less than this share of how far they move the target.
const ONE_POINT: f64 = 0.2;

/// A motion that the points do not tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom {
    /// A shift along a unit vector.
    Shift(DVec3),
    /// A turn about the axis along a unit vector through a point.
    Turn(DVec3, Point<Global>),
    /// Every turn about a point.
    Turns(Point<Global>),
}

/// The untold twists, in shifts of a pivot, m, and turns about it times a length, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Untold {
    /// Orthonormal.
    pub twists: Vec<Vector6<f64>>,
}

impl Untold {
    /// The untold twists of points with this information, whose gaps have this standard deviation, m.
    pub fn of(information: &Matrix6<f64>, sd_m: f64, length_m: f64) -> Untold {
        let eigen = SymmetricEigen::new(*information);
        let pairs = std::iter::zip(eigen.eigenvalues.iter(), eigen.eigenvectors.column_iter());
        let untold = pairs.filter(|(value, twist)| {
            let sd_m = sd_m / value.max(LEAST_INFORMATION).sqrt();
            let [shift, turn] = [twist.fixed_rows::<3>(0).norm(), twist.fixed_rows::<3>(3).norm()];
            **value < LEAST_INFORMATION
                || sd_m * shift > TOLD_M
                || sd_m * turn / length_m > TOLD_RAD
        });
        Untold { twists: untold.map(|(_, twist)| twist.into_owned()).collect() }
    }

    /// The motion that differs from another by untold twists and turns least, and of these shifts least: a sphere is shifted
    /// and not rolled to where it is.
    pub fn least(&self, motion: &Vector6<f64>) -> Vector6<f64> {
        if self.twists.is_empty() {
            return *motion;
        }
        let weights = Vector6::new(1.0, 1.0, 1.0, TURNS_COUNT, TURNS_COUNT, TURNS_COUNT);
        let count = self.twists.len();
        let twists =
            DMatrix::from_fn(6, count, |row, twist| weights[row] * self.twists[twist][row]);
        let weighted = DVector::from_fn(6, |row, _| weights[row] * motion[row]);
        let Ok(shares) = twists.svd(true, true).solve(&weighted, f64::EPSILON) else {
            return *motion;
        };
        std::iter::zip(&self.twists, shares.iter())
            .fold(*motion, |rest, (twist, share)| rest - twist * *share)
    }

    /// Whether the points tell most of a unit twist.
    pub fn tells(&self, twist: &Vector6<f64>) -> bool {
        self.twists.iter().map(|untold| untold.dot(twist).powi(2)).sum::<f64>() < 0.5
    }

    /// Their names. `pivot` and `length_m` are those of the twists.
    pub fn named(&self, pivot: DVec3, length_m: f64) -> Vec<Freedom> {
        let count = self.twists.len();
        if count == 0 {
            return Vec::new();
        }
        // Combinations of the twists by how much they turn, most first.
        let turns = DMatrix::from_fn(3, count, |row, twist| self.twists[twist][3 + row]);
        let svd = turns.svd(false, true);
        let Some(combinations) = svd.v_t else { return Vec::new() };
        let mut turning: Vec<(DVec3, DVec3)> = Vec::new();
        let mut shifts: Vec<DVec3> = Vec::new();
        for (row, combination) in combinations.row_iter().enumerate() {
            let parts = std::iter::zip(combination.iter(), &self.twists);
            let twist = parts.fold(Vector6::zeros(), |sum, (part, twist)| sum + twist * *part);
            let [x, y, z, turn_x, turn_y, turn_z] = twist.into();
            let shift = DVec3::new(x, y, z);
            if svd.singular_values.get(row).is_some_and(|turn| *turn > NO_TURN) {
                turning.push((shift, DVec3::new(turn_x, turn_y, turn_z) / length_m));
            } else {
                shifts.push(shift.normalize_or_zero());
            }
        }
        let mut named: Vec<Freedom> = shifts.iter().map(|along| Freedom::Shift(*along)).collect();
        // A free shift changes no turn.
        for (shift, _) in &mut turning {
            *shift = shifts.iter().fold(*shift, |rest, along| rest.reject_from_normalized(*along));
        }
        let place = (turning.len() == 3).then(|| common_point(&turning, pivot, length_m)).flatten();
        if let Some(place) = place {
            named.push(Freedom::Turns(place));
            return named;
        }
        named.extend(turning.iter().map(|(shift, turn)| {
            let axis = turn.normalize_or_zero();
            let place = pivot + turn.cross(*shift) / turn.length_squared();
            Freedom::Turn(axis, Point::from(place))
        }));
        named
    }
}

/// The point about which all of some twists turn: t = ω × (pivot − point) for each; `None` if there is none.
fn common_point(twists: &[(DVec3, DVec3)], pivot: DVec3, length_m: f64) -> Option<Point<Global>> {
    // Least squares: t = −ω × a for the arm a from the pivot.
    let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for (shift, turn) in twists {
        let cross = nalgebra::Vector3::from(turn.to_array()).cross_matrix();
        let shift = nalgebra::Vector3::from(shift.to_array());
        normal += cross.transpose() * cross;
        right -= cross.transpose() * shift;
    }
    let arm: [f64; 3] = (normal.try_inverse()? * right).into();
    let arm = DVec3::from_array(arm);
    let left: f64 = twists.iter().map(|(t, turn)| (*t + turn.cross(arm)).length_squared()).sum();
    let moved: f64 = twists
        .iter()
        .map(|(shift, turn)| shift.length_squared() + (turn.length() * length_m).powi(2))
        .sum();
    (left < ONE_POINT * ONE_POINT * moved).then(|| Point::from(pivot + arm))
}

/// In words: `a shift along (0, 1, 0)`.
impl std::fmt::Display for Freedom {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let vector = |v: &DVec3, digits: usize| {
            let [x, y, z] = v.to_array().map(|part| {
                let scale = 10f64.powi(digits as i32);
                // Without a sign of zero.
                (part * scale).round() / scale + 0.0
            });
            format!("({x:.digits$}, {y:.digits$}, {z:.digits$})")
        };
        match self {
            Freedom::Shift(along) => write!(f, "a shift along {}", vector(along, 2)),
            Freedom::Turn(axis, place) => {
                let (axis, place) = (vector(axis, 2), vector(&place.xyz, 2));
                write!(f, "a turn about the axis along {axis} through {place} m")
            }
            Freedom::Turns(place) => write!(f, "any turn about {} m", vector(&place.xyz, 2)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::icp::{Gap, NormalEquations};
    use crate::radar::random::{Draws, Key, Purpose};

    const PIVOT: DVec3 = DVec3::new(0.1, 1.2, 0.3);
    const LENGTH_M: f64 = 0.2;

    fn draws() -> Draws {
        Key { seed: 3, chirp: 0, sub_ray: 0, purpose: Purpose::Noise }.draws()
    }

    /// The names for a surface whose points and unit normals these are.
    fn named(surface: impl Fn(&mut Draws) -> (DVec3, DVec3)) -> Vec<Freedom> {
        let mut draws = draws();
        let gaps = (0..2000).map(|_| {
            let (at, gradient) = surface(&mut draws);
            (Gap { at, gradient, size_m: 0.0 }, 1.0)
        });
        let equations = NormalEquations::new(gaps, PIVOT, LENGTH_M);
        Untold::of(&equations.information, 2e-3, LENGTH_M).named(PIVOT, LENGTH_M)
    }

    fn direction(draws: &mut Draws) -> DVec3 {
        let mut part = || draws.complex_gaussian().re;
        DVec3::new(part(), part(), part().abs()).normalize()
    }

    #[test]
    fn a_sphere_turns_about_its_centre() {
        let centre = DVec3::new(0.0, 1.1, 0.1);
        let [Freedom::Turns(about)] = named(|draws| {
            let normal = direction(draws);
            (centre + 0.25 * normal, normal)
        })[..] else {
            panic!()
        };
        assert!(about.xyz.distance(centre) < 1e-9);
    }

    #[test]
    fn a_cylinder_turns_about_its_axis_and_slides_along_it() {
        let foot = DVec3::new(0.05, 0.0, 0.1);
        let names = named(|draws| {
            let normal = direction(draws).reject_from_normalized(DVec3::Y).normalize();
            (foot + draws.uniform() * DVec3::Y + 0.2 * normal, normal)
        });
        let [Freedom::Shift(along), Freedom::Turn(axis, place)] = names[..] else {
            panic!("{names:?}")
        };
        assert!(along.y.abs() > 1.0 - 1e-9 && axis.y.abs() > 1.0 - 1e-9);
        assert!((place.xyz - foot).reject_from_normalized(DVec3::Y).length() < 1e-9);
    }

    #[test]
    fn a_plate_slides_in_its_plane() {
        let names = named(|draws| {
            (DVec3::new(draws.uniform() - 0.5, draws.uniform() - 0.5, 0.0), DVec3::Z)
        });
        let [Freedom::Shift(one), Freedom::Shift(other), Freedom::Turn(axis, _)] = names[..] else {
            panic!("{names:?}")
        };
        assert!(one.z.abs() < 1e-9 && other.z.abs() < 1e-9 && axis.z.abs() > 1.0 - 1e-9);
        assert!(one.dot(other).abs() < 1e-9);
    }

    #[test]
    fn a_rough_surface_has_none() {
        let names = named(|draws| {
            let place = DVec3::new(draws.uniform(), draws.uniform(), draws.uniform());
            (place, direction(draws))
        });
        assert!(names.is_empty(), "{names:?}");
    }

    #[test]
    fn names_read_well() {
        let turn = Freedom::Turn(DVec3::Y, Point::new(0.0, -1e-9, 0.25));
        let words = "a turn about the axis along (0.00, 1.00, 0.00) through (0.00, 0.00, 0.25) m";
        assert_eq!(turn.to_string(), words);
        assert_eq!(Freedom::Shift(-DVec3::X).to_string(), "a shift along (-1.00, 0.00, 0.00)");
    }
}
