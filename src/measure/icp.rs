//! One alignment step of the iterative closest point method (Besl and McKay 1992,
//! DOI 10.1109/34.121791).
//!
//! Every step asks for the rigid motion of the model that best closes the gaps between it and the
//! measurement. Point to point has a closed solution by singular value decomposition (Arun et al.
//! 1987, DOI 10.1109/TPAMI.1987.4767965). Otherwise a gap is one number e_i that a small motion,
//! x ↦ x + t + ω × (x − c), changes by −g_i·(t + ω × (x_i − c)): for point to plane (Chen and Medioni
//! 1992, DOI 10.1016/0262-8856(92)90066-C) g is the normal n; for gaps along known rays d it is
//! n/(n·d). The step is then weighted least squares in six unknowns.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector6};

use super::freedom::Untold;
use crate::frames::{Global, Pose};

/// From the median of |x| to the standard deviation of a Gaussian.
const SD_PER_MEDIAN: f64 = 1.4826;

/// How much a gap counts, by its size in standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Kernel {
    /// All alike, the paper's.
    Square,
    /// Huber 1964 at 1.345: large gaps pull with a bounded force.
    Huber,
    /// Tukey's biweight at 6: gaps beyond six standard deviations do not pull at all.
    #[default]
    Tukey,
}

/// One gap between model and measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Where on the model, m.
    pub at: DVec3,
    /// How the gap shrinks when `at` moves, a pure number per metre of motion.
    pub gradient: DVec3,
    /// Measured minus model, m.
    pub size_m: f64,
}

/// A small rigid motion about a pivot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Where the pivot goes, m.
    pub shift_m: DVec3,
    /// Turn about the pivot: axis times angle, rad.
    pub turn_rad: DVec3,
}

/// Weighted normal equations about a pivot, turns scaled by a length so that all six unknowns are
/// metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalEquations {
    /// JᵀWJ; shifts x, y, z, then turns about x, y, z times `length_m`.
    pub information: Matrix6<f64>,
    /// JᵀWe, m.
    pub pull_m: Vector6<f64>,
    /// What a turn is multiplied by, m.
    pub length_m: f64,
}

impl Kernel {
    /// Weight of a gap of `size` standard deviations, 0 to 1.
    pub fn weight(self, size: f64) -> f64 {
        const HUBER: f64 = 1.345;
        const TUKEY: f64 = 6.0;
        match self {
            Kernel::Square => 1.0,
            Kernel::Huber => (HUBER / size.abs()).min(1.0),
            Kernel::Tukey => (1.0 - (size / TUKEY).powi(2)).max(0.0).powi(2),
        }
    }
}

/// Standard deviation of the bulk of some gaps by the median of their sizes, m; 0 for none.
pub fn bulk_sd_m(sizes_m: impl Iterator<Item = f64>) -> f64 {
    SD_PER_MEDIAN * median(sizes_m.map(f64::abs))
}

/// The median; 0 of none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

impl Motion {
    /// The motion as a map.
    pub fn about(&self, pivot: DVec3) -> Pose<Global, Global> {
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(self.turn_rad));
        Pose::new(rotation, pivot + self.shift_m - rotation * pivot)
    }

    /// Shift and turn from a vector of both, m, in which the turn is multiplied by a length, m.
    pub fn from_scaled(scaled: &Vector6<f64>, length_m: f64) -> Motion {
        let [x, y, z, turn_x, turn_y, turn_z] = (*scaled).into();
        let turn_rad = DVec3::new(turn_x, turn_y, turn_z) / length_m;
        Motion { shift_m: DVec3::new(x, y, z), turn_rad }
    }

    /// The vector of [`Motion::from_scaled`].
    pub fn scaled(&self, length_m: f64) -> Vector6<f64> {
        let parts =
            self.shift_m.to_array().into_iter().chain((self.turn_rad * length_m).to_array());
        Vector6::from_iterator(parts)
    }

    /// The motion that a map is about a pivot.
    pub fn of(pose: &Pose<Global, Global>, pivot: DVec3) -> Motion {
        let moved = (*pose * crate::frames::Point::from(pivot)).xyz;
        let turn_rad = DQuat::from_mat3(&pose.rotation()).normalize().to_scaled_axis();
        Motion { shift_m: moved - pivot, turn_rad }
    }
}

/// The pose with its rotation orthonormalised, since rounding accumulates over a hundred products.
pub fn rigid(pose: &Pose<Global, Global>) -> Pose<Global, Global> {
    let rotation = DQuat::from_mat3(&pose.rotation()).normalize();
    Pose::new(DMat3::from_quat(rotation), pose.translation_m())
}

impl NormalEquations {
    /// Sums over gaps and their weights; `length_m` > 0.
    pub fn new(
        gaps: impl Iterator<Item = (Gap, f64)>,
        pivot: DVec3,
        length_m: f64,
    ) -> NormalEquations {
        let mut information = Matrix6::zeros();
        let mut pull_m = Vector6::zeros();
        for (gap, weight) in gaps {
            let row = jacobian(&gap, pivot, length_m);
            information.syger(weight, &row, &row, 1.0);
            pull_m.axpy(weight * gap.size_m, &row, 1.0);
        }
        information.fill_upper_triangle_with_lower_triangle();
        NormalEquations { information, pull_m, length_m }
    }

    /// The equations of the told part of a motion alone.
    pub(super) fn without(&self, untold: &Untold) -> NormalEquations {
        let along = |twist: &Vector6<f64>| twist * twist.transpose();
        let others = Matrix6::identity() - untold.twists.iter().map(along).sum::<Matrix6<f64>>();
        let information = others * self.information * others;
        NormalEquations { information, pull_m: others * self.pull_m, ..*self }
    }

    /// The motion that closes the gaps best, without any along directions with less than this share of the best one's
    /// information.
    pub fn solve(&self, weakest_share: f64) -> Motion {
        // The decomposition would not end.
        if !self.information.iter().chain(self.pull_m.iter()).all(|sum| sum.is_finite()) {
            return Motion::default();
        }
        let eigen = SymmetricEigen::new(self.information);
        let best = eigen.eigenvalues.max();
        let mut step = Vector6::zeros();
        for (value, axis) in
            std::iter::zip(eigen.eigenvalues.iter(), eigen.eigenvectors.column_iter())
        {
            if *value > weakest_share * best {
                step += axis * (axis.dot(&self.pull_m) / value);
            }
        }
        Motion::from_scaled(&step, self.length_m)
    }
}

/// Derivative of a gap's closing by the six unknowns, pure numbers.
pub(super) fn jacobian(gap: &Gap, pivot: DVec3, length_m: f64) -> Vector6<f64> {
    let turn = (gap.at - pivot).cross(gap.gradient) / length_m;
    let g = gap.gradient;
    Vector6::new(g.x, g.y, g.z, turn.x, turn.y, turn.z)
}

/// The rigid map that brings the first points of weighted pairs nearest to the second; `None` when
/// no weight is above 0 or a point is not finite.
pub fn point_to_point(pairs: &[(DVec3, DVec3)], weights: &[f64]) -> Option<Pose<Global, Global>> {
    let total: f64 = weights.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    // Both centres, and the covariance of the pairs about them.
    let (mut from, mut to) = (DVec3::ZERO, DVec3::ZERO);
    for ((a, b), w) in std::iter::zip(pairs, weights) {
        from += *a * *w;
        to += *b * *w;
    }
    let (from, to) = (from / total, to / total);
    let mut covariance = Matrix3::zeros();
    for ((a, b), w) in std::iter::zip(pairs, weights) {
        let [a, b] = [*a - from, *b - to].map(|v| nalgebra::Vector3::new(v.x, v.y, v.z));
        covariance += a * b.transpose() * *w;
    }
    // The decomposition would not end.
    if !covariance.iter().all(|sum| sum.is_finite()) {
        return None;
    }
    let svd = covariance.svd(true, true);
    // The rotation V·diag(1, 1, ±1)·Uᵀ, without a mirror.
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    let mirror = (v * u.transpose()).determinant().signum();
    let proper = v * Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, mirror));
    let rotation = proper * u.transpose();
    let columns: [[f64; 3]; 3] = rotation.into();
    let rotation = DMat3::from_cols_array_2d(&columns);
    Some(Pose::new(rotation, to - rotation * from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::radar::random::{Draws, Key, Purpose};

    fn scatter(draws: &mut Draws) -> DVec3 {
        let mut axis = || draws.uniform() - 0.5;
        DVec3::new(axis(), axis(), axis())
    }

    fn draws(seed: u64) -> Draws {
        Key { seed, chirp: 0, sub_ray: 0, purpose: Purpose::Noise }.draws()
    }

    fn apart(a: &Pose<Global, Global>, b: &Pose<Global, Global>) -> (f64, f64) {
        let motion = Motion::of(&(a.inverse() * *b), DVec3::ZERO);
        (motion.shift_m.length(), motion.turn_rad.length())
    }

    #[test]
    fn point_to_point_finds_a_known_motion_exactly() {
        let truth =
            Motion { shift_m: DVec3::new(0.3, -0.1, 0.2), turn_rad: DVec3::new(0.5, 1.0, -2.0) }
                .about(DVec3::ONE);
        let mut draws = draws(1);
        let pairs: Vec<(DVec3, DVec3)> = (0..50)
            .map(|_| scatter(&mut draws))
            .map(|from| (from, (truth * Point::from(from)).xyz))
            .collect();
        let found = point_to_point(&pairs, &[1.0; 50]).unwrap();
        let (shift_m, turn_rad) = apart(&found, &truth);
        assert!(shift_m < 1e-13 && turn_rad < 1e-13, "{shift_m} {turn_rad}");
        assert!(point_to_point(&pairs, &[0.0; 50]).is_none());
    }

    #[test]
    fn a_flat_set_of_points_is_not_mirrored() {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)];
        let pairs = flat.map(|p| (p, p + DVec3::Z));
        let found = point_to_point(&pairs, &[1.0; 4]).unwrap();
        assert!((found.rotation().determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn gaps_along_normals_give_back_a_small_motion() {
        let truth = Motion { shift_m: DVec3::new(3e-4, -1e-4, 2e-4), turn_rad: DVec3::splat(1e-4) };
        let pivot = DVec3::new(0.1, 0.2, 0.3);
        let pose = truth.about(pivot);
        let mut draws = draws(2);
        let gaps = (0..200).map(|_| {
            let (at, gradient) = (scatter(&mut draws), scatter(&mut draws).normalize());
            let size_m = gradient.dot((pose * Point::from(at)).xyz - at);
            (Gap { at, gradient, size_m }, 1.0)
        });
        let found = NormalEquations::new(gaps, pivot, 0.4).solve(1e-7);
        // The second order of the turn, 1e-8 rad² over half a metre, is not modelled.
        assert!((found.shift_m - truth.shift_m).length() < 2e-8);
        assert!((found.turn_rad - truth.turn_rad).length() < 4e-8);
    }

    #[test]
    fn along_a_plane_nothing_moves() {
        let mut draws = draws(3);
        let gaps = (0..100).map(|_| {
            let at = scatter(&mut draws) * DVec3::new(1.0, 1.0, 0.0);
            (Gap { at, gradient: DVec3::Z, size_m: 0.01 }, 1.0)
        });
        let found = NormalEquations::new(gaps, DVec3::ZERO, 0.4).solve(1e-7);
        assert!((found.shift_m - 0.01 * DVec3::Z).length() < 1e-12);
        assert!(found.turn_rad.length() < 1e-12);
    }

    #[test]
    fn kernels_fall_from_one() {
        for kernel in [Kernel::Square, Kernel::Huber, Kernel::Tukey] {
            assert_eq!(kernel.weight(0.0), 1.0);
        }
        assert_eq!(Kernel::Tukey.weight(6.5), 0.0);
        assert!((Kernel::Huber.weight(-2.69) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_bulk_ignores_a_third_of_outliers() {
        let mut draws = draws(4);
        let sizes: Vec<f64> = (0..3000)
            .map(
                |i| if i % 3 == 0 { 1.0 } else { draws.complex_gaussian().re * 2f64.sqrt() * 1e-3 },
            )
            .collect();
        // A third of outliers takes the median to the three-quarter point: 1.15/0.674 of it.
        let sd_m = bulk_sd_m(sizes.into_iter());
        assert!((1.6e-3..1.85e-3).contains(&sd_m), "{sd_m}");
    }
}
