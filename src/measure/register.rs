//! The pose of the mesh when the cloud was measured (paper, Sec. V-B and Fig. 8).
//!
//! First the paper's loop: the mesh is scanned with the measurement's own pattern, and its virtual
//! cloud is aligned to the measured one by nearest neighbours, until the pose stops changing. Nearest
//! neighbours are biased where the two clouds end at different places. A radar knows more: each point
//! lies on a known ray, and only its range is noisy. So by default a second loop closes the gaps along
//! the measured rays themselves, all points at once; at the true pose its expected gaps are zero.

use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use super::cloud::Cloud;
use super::coarse::{self, Alignment};
use super::error::RegistrationError;
use super::freedom::{Freedom, Untold};
use super::icp::{Gap, Motion, NormalEquations, bulk_sd_m, rigid};
use super::point_rays::PointRays;
use super::ray_gap::RayGap;
use super::settings::{Metric, Registration, Start};
use super::spots::SpotRays;
use super::start;
use super::uncertainty::uncertainty;
use super::view::View;
use crate::frames::{Global, Point, Pose};
use crate::geometry::Mesh;
use crate::radar::{Chirps, Radar};

/// Widest gap along a ray after the coarse loop, m.
const RAY_REACH_M: f64 = 0.05;
/// Points with wider gaps, in standard deviations, are not on the surface.
const OUTLIER_SD: f64 = 4.0;
/// The coarse loop hands over when a virtual scan moves the target by less, m.
const HAND_OVER_M: f64 = 1e-3;
/// Far below any range noise: a perfect fit must not divide by zero, m.
const LEAST_SD_M: f64 = 1e-9;
/// Directions with less than this share of the best one's information are not moved along, where nothing else is known.
const WEAKEST_SHARE: f64 = 1e-7;
/// By how much steps are shortened whenever one goes back.
const LESS: f64 = 0.7;
/// Errors wider than a range cell of 27 GHz, c/2B, are of the fit and not of the radar, m.
const RANGE_CELL_M: f64 = 5.55e-3;

/// Why a registration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The pose stopped changing.
    Still,
    /// It still changed after the most steps allowed.
    Limit,
}

/// A registered mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct RegistrationResult {
    /// Moves the mesh, as the scene places it, to where the cloud says it was: a vertex v of the
    /// scene's mesh belongs at pose·v of the global frame.
    pub pose: Pose<Global, Global>,
    /// Covariance of the pose: the true one is x ↦ c + t + R(ω)(x − c) after `pose`, with c the
    /// `pivot`, in the order t_x, t_y, t_z (m), ω_x, ω_y, ω_z (rad). From the gaps along the rays
    /// under errors of range that neighbours within 5 cm may share; for the other metrics, which
    /// use the points less well, a lower bound. Along a motion of `free` the standard deviation is
    /// the target's size.
    pub covariance: [[f64; 6]; 6],
    /// The same without the motions of `free`: they leave the surface in itself, and with it what the radar sees.
    pub told_covariance: [[f64; 6]; 6],
    /// Motions that the points do not tell. [`Metric::AlongRay`] holds the rough pose in them, the other metrics may move along.
    pub free: Vec<Freedom>,
    /// Median of the measured points by axis.
    pub pivot: Point<Global>,
    /// Root mean square of the range errors of the inliers, m.
    pub rms_m: f64,
    /// Factor on the variance because neighbouring points share errors, 1 or more.
    pub widened: f64,
    /// Whether the given pose was kept, because it is within chance of the found one.
    pub kept: bool,
    /// Points on the surface, within four standard deviations.
    pub inliers: usize,
    /// All points.
    pub points: usize,
    /// Virtual scans made.
    pub scans: usize,
    /// Alignment steps in all.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
    /// Whether the pose stopped changing.
    pub converged: bool,
    /// Notices for the user.
    pub verdicts: Vec<String>,
}

impl Registration {
    /// Registers `mesh`, in the global frame as the scene places it, to a cloud measured by `radar`
    /// with the rays of `chirps`.
    ///
    /// # Errors
    /// When the points give no usable pose.
    pub fn run(
        &self,
        mesh: &Mesh,
        radar: &Radar,
        chirps: &Chirps,
        cloud: &Cloud,
    ) -> Result<RegistrationResult, RegistrationError> {
        let count = cloud.points().len();
        if count < self.least_points {
            return Err(RegistrationError::TooFew { points: count, least: self.least_points });
        }
        let point_rays = PointRays::of(cloud, radar, chirps)?;
        let spot_rays = self.of_spots.then(|| SpotRays::new(radar, &point_rays.rays, cloud));
        let view = View::new(mesh, &chirps.rays, cloud, &point_rays.rays, spot_rays.as_ref());
        let along_ray = self.metric == Metric::AlongRay;
        if let Start::Given(given) = &self.start
            && self.keep
        {
            let aligned = Alignment { pose: *given, scans: 0, steps: 0, still: true };
            return self
                .judge(&view, &aligned, true)
                .map(|found| RegistrationResult { kept: true, ..found });
        }
        if let Start::Given(given) = &self.start
            && self.keep_given
            && along_ray
            && let Some(kept) = self.kept(&view, given)
        {
            return Ok(kept);
        }
        let rough = start::rough_pose(&view, self)?;
        let still_m = if along_ray { HAND_OVER_M } else { self.still_m };
        let mut aligned = coarse::align(&view, self, rough, still_m)?;
        self.check_near(&view, &rough, &aligned.pose)?;
        if along_ray {
            self.settle(&view, &rough, &mut aligned);
            self.check_near(&view, &rough, &aligned.pose)?;
        }
        let found = self.judge(&view, &aligned, true)?;
        match self.start {
            Start::Given(given) if self.keep_given && found.converged => Ok(found.or_given(&given)),
            _ => Ok(found),
        }
    }

    /// The given pose, if the points agree with it: a few steps from there do not leave it by more than chance. Where the target
    /// hardly determines a direction, many steps may run away along it from the true pose.
    fn kept(&self, view: &View, given: &Pose<Global, Global>) -> Option<RegistrationResult> {
        const FEW: usize = 3;
        let mut aligned = Alignment { pose: *given, scans: 0, steps: 0, still: false };
        self.close_along_rays(view, &mut aligned, FEW, &Untold::default());
        aligned.still = true;
        // Far from the truth gaps look like errors that neighbours share, with which any pose would agree.
        if !self.judge(view, &aligned, false).ok()?.or_given(given).kept {
            return None;
        }
        let kept = self.judge(view, &aligned, true).ok()?.or_given(given);
        kept.kept.then_some(kept)
    }

    /// Closes the gaps along the rays, and takes back what the points do not tell. Gaps that are still wide look like errors that
    /// neighbours share, which count only at the end.
    fn settle(&self, view: &View, rough: &Pose<Global, Global>, aligned: &mut Alignment) {
        for are_shared in [false, false, true] {
            let untold = untold_at(view, &aligned.pose, are_shared);
            let moved = Motion::of(&(aligned.pose * rough.inverse()), view.pivot);
            let least = least(view, &untold, &moved);
            aligned.pose = rigid(&(least.about(view.pivot) * *rough));
            self.close_along_rays(view, aligned, self.max_steps, &untold);
        }
    }

    /// The second loop: Gauss and Newton on the gaps along the measured rays, without untold twists.
    fn close_along_rays(
        &self,
        view: &View,
        aligned: &mut Alignment,
        most_steps: usize,
        untold: &Untold,
    ) {
        aligned.still = false;
        let (mut share, mut before) = (1.0, Vector6::zeros());
        for _ in 0..most_steps {
            let gaps: Vec<Gap> =
                view.ray_gaps(&aligned.pose, RAY_REACH_M).iter().flatten().map(|g| g.gap).collect();
            let sd_m = bulk_sd_m(gaps.iter().map(|gap| gap.size_m)).max(LEAST_SD_M);
            let weighted = gaps.iter().map(|gap| (*gap, self.kernel.weight(gap.size_m / sd_m)));
            let equations = NormalEquations::new(weighted, view.pivot, view.length_m);
            let motion = least(view, untold, &equations.without(untold).solve(WEAKEST_SHARE));
            // To and fro between facets, ever less.
            let step = motion.scaled(view.length_m);
            share = if step.dot(&before) < 0.0 { LESS * share } else { share };
            before = step;
            let motion = Motion::from_scaled(&(share * step), view.length_m);
            let moved = motion.about(view.pivot);
            aligned.pose = rigid(&(moved * aligned.pose));
            aligned.steps += 1;
            if coarse::change_m(view, &moved) < self.still_m {
                aligned.still = true;
                return;
            }
        }
    }

    fn check_near(
        &self,
        view: &View,
        rough: &Pose<Global, Global>,
        pose: &Pose<Global, Global>,
    ) -> Result<(), RegistrationError> {
        let Motion { shift_m, turn_rad } = Motion::of(&(*pose * rough.inverse()), view.pivot);
        let (shift_m, turn_rad) = (shift_m.length(), turn_rad.length());
        // Written so that a NaN is far, too.
        if shift_m <= self.farthest_m && turn_rad <= self.farthest_rad {
            Ok(())
        } else {
            Err(RegistrationError::Diverged { shift_m, turn_rad })
        }
    }

    /// The result at a pose, with errors that neighbours share or without.
    fn judge(
        &self,
        view: &View,
        aligned: &Alignment,
        are_shared: bool,
    ) -> Result<RegistrationResult, RegistrationError> {
        let inliers = inliers(view, &aligned.pose);
        let points = view.points.len();
        if (inliers.len() as f64) < self.least_inliers * points as f64 || inliers.len() < 6 {
            return Err(RegistrationError::NoFit { inliers: inliers.len(), points });
        }
        let squares_m2: f64 = inliers.iter().map(|gap| gap.range_error_m.powi(2)).sum();
        let rms_m = (squares_m2 / inliers.len() as f64).sqrt();
        let used: Vec<Gap> = inliers.iter().map(|gap| gap.gap).collect();
        let known = uncertainty(&used, view.pivot, view.length_m, are_shared);
        Ok(RegistrationResult {
            pose: aligned.pose,
            covariance: known.covariance,
            told_covariance: known.told,
            free: known.untold.named(view.pivot, view.length_m),
            pivot: view.pivot.into(),
            rms_m,
            kept: false,
            widened: known.widened,
            inliers: inliers.len(),
            points,
            scans: aligned.scans,
            iterations: aligned.steps,
            stop: if aligned.still { Stop::Still } else { Stop::Limit },
            converged: aligned.still,
            verdicts: verdicts(aligned, rms_m),
        })
    }
}

/// The gaps at a pose of the points on the surface.
fn inliers(view: &View, pose: &Pose<Global, Global>) -> Vec<RayGap> {
    let mut gaps: Vec<RayGap> = view.ray_gaps(pose, RAY_REACH_M).into_iter().flatten().collect();
    let sd_m = bulk_sd_m(gaps.iter().map(|g| g.gap.size_m)).max(LEAST_SD_M);
    gaps.retain(|gap| gap.gap.size_m.abs() <= OUTLIER_SD * sd_m);
    gaps
}

/// A motion with the least turn and shift that the points do not tell.
fn least(view: &View, untold: &Untold, motion: &Motion) -> Motion {
    Motion::from_scaled(&untold.least(&motion.scaled(view.length_m)), view.length_m)
}

/// The twists that the points do not tell at a pose, under errors that neighbours share or not.
fn untold_at(view: &View, pose: &Pose<Global, Global>, are_shared: bool) -> Untold {
    let used: Vec<Gap> = inliers(view, pose).iter().map(|gap| gap.gap).collect();
    uncertainty(&used, view.pivot, view.length_m, are_shared).untold
}

fn verdicts(aligned: &Alignment, rms_m: f64) -> Vec<String> {
    let mut verdicts = Vec::new();
    if !aligned.still {
        verdicts.push("the pose still changed at the last step; give a nearer --pose, or --keep-pose where it is known".to_owned());
    }
    if rms_m > RANGE_CELL_M {
        verdicts.push(format!(
            "the points lie {:.1} mm off the surface, more than a range cell; is the mesh exact, and \
             did the target stand still?",
            1e3 * rms_m
        ));
    }
    verdicts
}

impl RegistrationResult {
    /// The given pose in place of the found one, when it is within chance of it.
    fn or_given(mut self, given: &Pose<Global, Global>) -> RegistrationResult {
        // χ² with six degrees of freedom is above this in 5 %.
        const CHANCE: f64 = 12.592;
        let Motion { shift_m, turn_rad } =
            Motion::of(&(*given * self.pose.inverse()), self.pivot.xyz);
        let apart =
            Vector6::from_iterator(shift_m.to_array().into_iter().chain(turn_rad.to_array()));
        let covariance = Matrix6::from_fn(|row, column| self.covariance[row][column]);
        let distance2 = covariance.try_inverse().map(|inverse| apart.dot(&(inverse * apart)));
        if distance2.is_some_and(|distance2| distance2 <= CHANCE) {
            self.pose = *given;
            self.kept = true;
            // The given pose may be as far off as the found one says.
            for covariance in [&mut self.covariance, &mut self.told_covariance] {
                for (row, of_row) in covariance.iter_mut().enumerate() {
                    let products = apart.iter().map(|part| apart[row] * part);
                    of_row.iter_mut().zip(products).for_each(|(entry, product)| *entry += product);
                }
            }
        }
        self
    }

    /// Standard deviation of the position of a point of the surface under the pose, over all directions together and
    /// without the motions of `free`, m.
    pub fn shift_sd_m(&self, point: Point<Global>) -> f64 {
        let arm_m = point.distance_m(self.pivot);
        let [x, y, z, turn_x, turn_y, turn_z] = std::array::from_fn(|i| self.told_covariance[i][i]);
        let (shift_m2, turn_rad2): (f64, f64) = (x + y + z, turn_x + turn_y + turn_z);
        (shift_m2 + arm_m * arm_m * turn_rad2).sqrt()
    }

    /// Variance of the tilt of a surface of unit normal `normal`, mean of its two tilts and without the motions of `free`, rad².
    pub fn tilt_variance_rad2(&self, normal: DVec3) -> f64 {
        // Of the turn's covariance C: (tr C − nᵀCn)/2.
        let n = normal.to_array();
        let (mut trace, mut about_normal) = (0.0, 0.0);
        for (i, row) in self.told_covariance[3..].iter().enumerate() {
            trace += row[3 + i];
            for (j, entry) in row[3..].iter().enumerate() {
                about_normal += n[i] * n[j] * entry;
            }
        }
        (0.5 * (trace - about_normal)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::reduce::Reduction;
    use crate::measure::synthetic::{
        SyntheticScan, apart, cylinder, f_per_sr, mannequin, pushed, stretched, turned,
    };
    use crate::scene::{Target, solids};
    use crate::units::db_from_ratio;

    /// The pose is known this well at a range noise of 2 mm.
    const NEAR_M: f64 = 0.5e-3;
    const NEAR_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;

    fn register(settings: Registration, seed: u64) -> (SyntheticScan, RegistrationResult) {
        let measured = mannequin(2e-3, seed);
        let start = Start::Given(pushed(&measured, 0.03, 5f64.to_radians(), seed));
        let found = measured.register(&Registration { start, ..settings }).unwrap();
        (measured, found)
    }

    #[test]
    fn from_30_mm_and_5_degrees_off_the_pose_is_found() {
        for seed in 0..3 {
            let (_, found) = register(Registration::default(), seed);
            let (shift_m, turn_rad) = apart(&found);
            assert!(found.converged, "{found:?}");
            assert!(shift_m < NEAR_M && turn_rad < NEAR_RAD, "{shift_m} {turn_rad} {found:?}");
            // Tukey's and the steepness weights see the noise of 2 mm.
            assert!((1.9e-3..2.1e-3).contains(&found.rms_m), "{}", found.rms_m);
            assert!(found.verdicts.is_empty(), "{:?}", found.verdicts);
        }
    }

    /// A target, places on it with the directions in which they may not be off, and the numbers of shifts and of turns
    /// that its points do not tell; three turns are one about a point.
    struct Case {
        name: &'static str,
        mesh: Mesh,
        marks: Vec<(DVec3, Vec<DVec3>)>,
        free: [usize; 2],
    }

    fn cases() -> [Case; 7] {
        let all = || vec![DVec3::X, DVec3::Y, DVec3::Z];
        let aside = || vec![DVec3::X, DVec3::Z];
        let sphere = || solids::icosphere(0.25, 5);
        let (middle, above) = (DVec3::new(0.0, 1.1, 0.0), DVec3::new(0.0, 1.4, 0.0));
        let plate = turned(solids::plate(2.0, 2.0), DVec3::new(8.0, -6.0, 0.0));
        let normal = plate.area_normal(0).normalize();
        let on_plate = [DVec3::X, DVec3::Y, DVec3::ZERO]
            .map(|to| (middle + 0.3 * to.reject_from_normalized(normal), vec![normal]));
        let block = solids::cuboid(DVec3::new(0.4, 0.5, 0.3), 0.05);
        let rigid = || [middle, above, middle + 0.3 * DVec3::X].map(|mark| (mark, all())).to_vec();
        let case = |name, mesh, marks, free| Case { name, mesh, marks, free };
        [
            case("sphere", sphere(), vec![(middle, all())], [0, 1]),
            case(
                "cylinder",
                cylinder(0.2, 2.0, 120),
                vec![(middle, aside()), (above, aside())],
                [1, 1],
            ),
            case(
                "spheroid",
                stretched(sphere(), DVec3::new(0.8, 1.4, 0.8)),
                vec![(middle, all()), (above, aside())],
                [0, 1],
            ),
            case("plate", plate, on_plate.to_vec(), [2, 1]),
            case("corner", solids::trihedral(0.5), rigid(), [0, 0]),
            case(
                "box",
                turned(turned(block, DVec3::new(0.0, 45.0, 0.0)), DVec3::new(35.0, 0.0, 0.0)),
                rigid(),
                [0, 0],
            ),
            case("torso", crate::scene::mannequin::mannequin(), rigid(), [0, 0]),
        ]
    }

    #[test]
    fn what_the_points_of_a_target_tell_is_found_and_the_rest_is_held() {
        /// 1 mm, and 0.3° about the first mark.
        const NEAR_M: f64 = 1e-3;
        const NEAR_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
        for Case { name, mesh, marks, free } in cases() {
            for seed in 0..20 {
                let measured = SyntheticScan::of(mesh.clone(), 2e-3, seed);
                let given = pushed(&measured, 0.03, 5f64.to_radians(), seed);
                let start = Start::Given(given);
                let found = measured.register(&Registration { start, ..Default::default() });
                let found = found.unwrap_or_else(|error| panic!("{name} {seed}: {error}"));
                assert!(found.converged, "{name} {seed}");
                let shifts =
                    found.free.iter().filter(|one| matches!(one, Freedom::Shift(_))).count();
                assert_eq!(
                    [shifts, found.free.len() - shifts],
                    free,
                    "{name} {seed}: {:?}",
                    found.free
                );
                let about_point = found.free.iter().any(|one| matches!(one, Freedom::Turns(_)));
                assert_eq!(about_point, name == "sphere", "{name} {seed}: {:?}", found.free);
                for (mark, directions) in &marks {
                    let off = (found.pose * Point::from(*mark)).xyz - *mark;
                    let off_m = directions.iter().map(|along| off.dot(*along).abs());
                    let off_m = off_m.fold(0.0, f64::max);
                    let most_m = NEAR_M + NEAR_RAD * mark.distance(marks[0].0);
                    assert!(off_m < most_m, "{name} {seed}: {mark} is {off_m} m off");
                }
                if seed < 3 {
                    let off_db = curve_error_db(&measured, &found);
                    assert!(off_db.abs() < 0.3, "{name} {seed}: the curve is {off_db} dB off");
                }
                // Where a direction is not told, the target keeps what was given in it.
                if name == "sphere" {
                    let turned = (found.pose * given.inverse()).rotation();
                    let turn = glam::DQuat::from_mat3(&turned).to_scaled_axis().length();
                    assert!(turn.to_degrees() < 0.5, "{seed}: {}", turn.to_degrees());
                }
            }
        }
    }

    /// Mean of a curve over the truth at its angles, dB.
    fn curve_error_db(measured: &SyntheticScan, found: &RegistrationResult) -> f64 {
        let target = Target {
            mesh: measured.mesh.clone(),
            meshes: vec![],
            regions: vec![],
            region_of_facet: vec![0; measured.mesh.facets.len()],
        };
        let SyntheticScan { radar, chirps, cloud, .. } = measured;
        let reduced = Reduction::default().run(&target, radar, chirps, cloud, found).unwrap();
        let errors_db = reduced.curve.detected().map(|row| {
            let f_per_sr = f_per_sr(row.theta_i_rad);
            let truth = 4.0 * std::f64::consts::PI * f_per_sr * row.theta_i_rad.cos().powi(2);
            db_from_ratio(row.sigma0.unwrap() / truth)
        });
        errors_db.sum::<f64>() / reduced.curve.detected().count() as f64
    }

    #[test]
    fn the_papers_own_method_comes_near() {
        let (_, found) = register(Registration::paper(), 5);
        let (shift_m, turn_rad) = apart(&found);
        // A spot and the angle it spans over the target's half.
        assert!(shift_m < 5e-3 && turn_rad < 1f64.to_radians(), "{shift_m} {turn_rad}");
    }

    #[test]
    fn the_covariance_is_the_spread_over_seeds() {
        const SEEDS: u64 = 12;
        let mut normalised = 0.0;
        for seed in 0..SEEDS {
            let measured = mannequin(2e-3, 100 + seed);
            let found = measured
                .register(&Registration { keep_given: false, ..Default::default() })
                .unwrap();
            let error = Motion::of(&found.pose.inverse(), found.pivot.xyz);
            let covariance = nalgebra::Matrix6::from_fn(|i, j| found.covariance[i][j]);
            let [t, w] = [error.shift_m, error.turn_rad];
            let error = nalgebra::Vector6::new(t.x, t.y, t.z, w.x, w.y, w.z);
            normalised += error.dot(&(covariance.try_inverse().unwrap() * error));
        }
        // χ² with 6 degrees of freedom a seed has mean 6 and standard deviation √(12/12) over 12
        // seeds; five of them, and the widening, which only makes the covariance larger.
        let mean = normalised / SEEDS as f64;
        assert!((1.5..11.0).contains(&mean), "{mean}");
    }

    #[test]
    fn a_pose_to_be_kept_is_kept_though_it_is_wrong() {
        let measured = mannequin(2e-3, 4);
        let given = pushed(&measured, 5e-3, 0.5f64.to_radians(), 4);
        let settings =
            Registration { start: Start::Given(given), keep: true, ..Default::default() };
        let found = measured.register(&settings).unwrap();
        assert!(found.kept && found.converged && found.pose == given, "{found:?}");
        assert!(found.rms_m > 2.1e-3, "{}", found.rms_m);
    }

    #[test]
    fn a_given_pose_that_is_right_is_kept_and_a_wrong_one_is_not() {
        let measured = mannequin(2e-3, 4);
        let run = |start| {
            let settings = Registration { start, ..Default::default() };
            measured.register(&settings).unwrap()
        };
        let right = run(Start::default());
        assert!(right.kept && apart(&right) == (0.0, 0.0));
        // Five times what the points tell, and far below the range noise.
        let wrong = Pose::from_euler_xyz(DVec3::ZERO, DVec3::new(0.0, 0.0, 5e-4));
        assert!(!run(Start::Given(wrong)).kept);
    }

    /// What faces the radar is round or flat: about the vertical the points determine no turn.
    #[test]
    fn a_given_pose_that_is_right_is_kept_where_a_turn_is_unknown() {
        let mut mesh = solids::icosphere(0.19, 5);
        mesh.vertices.iter_mut().for_each(|v| v.y += 0.22);
        let block = solids::cuboid(DVec3::new(0.32, 0.42, 0.3), 0.02);
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(block.vertices.iter().map(|v| *v - 0.22 * DVec3::Y));
        mesh.facets.extend(block.facets.iter().map(|facet| facet.map(|corner| corner + first)));
        let found = SyntheticScan::of(mesh, 1e-3, 1).register(&Registration::default()).unwrap();
        assert!(found.kept && found.converged, "{found:?}");
    }

    #[test]
    fn a_plane_says_what_it_does_not_tell() {
        let measured = SyntheticScan::of(crate::scene::solids::plate(2.0, 2.0), 2e-3, 1);
        let found = measured.register(&Registration::default()).unwrap();
        let free: Vec<String> = found.free.iter().map(Freedom::to_string).collect();
        assert!(
            free.len() == 3 && free[2].starts_with("a turn about the axis along (0.00, 0.00, "),
            "{free:?}"
        );
        assert!(found.verdicts.is_empty() && found.covariance[0][0] > 0.01);
        // The tilt of the plate is known all the same: 2 mm over thousands of points.
        assert!(found.tilt_variance_rad2(DVec3::Z).sqrt() < 1e-3);
    }

    #[test]
    fn a_tenth_of_false_alarms_changes_nothing() {
        let measured = mannequin(2e-3, 3).with_false_alarms(10, 3);
        let start = Start::Given(pushed(&measured, 0.03, 5f64.to_radians(), 3));
        let found = measured.register(&Registration { start, ..Default::default() }).unwrap();
        let (shift_m, turn_rad) = apart(&found);
        assert!(shift_m < NEAR_M && turn_rad < NEAR_RAD, "{shift_m} {turn_rad}");
    }

    fn refused(measured: &SyntheticScan, settings: Registration) -> RegistrationError {
        measured.register(&settings).unwrap_err()
    }

    #[test]
    fn what_gives_no_pose_gives_a_verdict() {
        let measured = mannequin(2e-3, 4);
        let few = SyntheticScan { cloud: measured.first(20), ..measured.clone() };
        let error = refused(&few, Registration::default());
        assert_eq!(error, RegistrationError::TooFew { points: 20, least: 50 });

        let away = |x_m: f64| Registration {
            start: Start::Given(Pose::from_euler_xyz(DVec3::ZERO, DVec3::new(x_m, 0.0, 0.0))),
            ..Default::default()
        };
        assert_eq!(refused(&measured, away(5.0)), RegistrationError::NothingInView);
        let behind = Pose::from_euler_xyz(DVec3::ZERO, DVec3::new(0.0, 0.0, -2.0));
        let behind = Registration { start: Start::Given(behind), ..Default::default() };
        let error = refused(&measured, behind);
        assert!(matches!(error, RegistrationError::NoOverlap { .. }), "{error}");

        let short = Registration { farthest_m: 1e-3, ..Default::default() };
        let start = Start::Given(pushed(&measured, 0.03, 0.0, 1));
        let error = refused(&measured, Registration { start, ..short });
        assert!(matches!(error, RegistrationError::Diverged { .. }), "{error}");
    }

    #[test]
    fn a_cloud_of_another_frame_or_scan_is_told() {
        let measured = mannequin(2e-3, 4);
        let mut moved = measured.clone();
        moved.radar.primary_focus_m[2] = 7.0;
        moved.chirps = Chirps::draw(&moved.radar, |_| Err("no file".to_owned())).unwrap();
        let error = refused(&moved, Registration::default());
        assert!(matches!(error, RegistrationError::RangesDisagree { .. }), "{error}");
        let mut renumbered = measured.clone();
        renumbered.chirps.number.rotate_left(2000);
        let error = refused(&renumbered, Registration::default());
        assert!(matches!(error, RegistrationError::ChirpsDisagree { .. }), "{error}");
    }

    #[test]
    fn another_shape_does_not_fit() {
        let measured = mannequin(2e-3, 4);
        let mut other = measured.clone();
        other.mesh = crate::scene::solids::icosphere(0.25, 4);
        other.mesh.vertices.iter_mut().for_each(|v| v.y += 1.1);
        let error = refused(&other, Registration::default());
        let told = matches!(
            error,
            RegistrationError::NoFit { .. }
                | RegistrationError::NoOverlap { .. }
                | RegistrationError::Diverged { .. }
        );
        assert!(told, "{error}");
    }

    #[test]
    fn without_a_rough_pose_one_is_found() {
        let measured = mannequin(2e-3, 6);
        let mut turned = measured.clone();
        let away = Pose::<Global, Global>::from_euler_xyz(
            DVec3::new(0.0, 60f64.to_radians(), 0.0),
            DVec3::new(0.4, 0.1, 0.5),
        );
        turned.mesh.vertices.iter_mut().for_each(|v| *v = (away * Point::from(*v)).xyz);
        let found = turned
            .register(&Registration { start: Start::Automatic, ..Default::default() })
            .unwrap();
        let error = Motion::of(&(found.pose * away), found.pivot.xyz);
        let (shift_m, turn_rad) = (error.shift_m.length(), error.turn_rad.length());
        assert!(shift_m < NEAR_M && turn_rad < NEAR_RAD, "{shift_m} {turn_rad}");
    }
}
