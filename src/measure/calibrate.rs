//! From the cloud of a calibration target to the radar's loss and the width of its beam.
//!
//! The return of the target is known but for four numbers: the loss, the waist of the beam, and two numbers of where
//! exactly the target stands, which are the tilts of a plate or the shifts of a sphere or a corner across the beam.
//! Least squares in decibels find them from the points near the peak. Points are chosen by what the fitted model
//! returns there, not by their own power, which would prefer those that noise made strong.
//!
//! # Uncertainty
//!
//! Of the covariance H⁻¹·(Σᵢⱼ kᵢⱼ·gᵢgⱼᵀ)·H⁻¹, with gᵢ = Jᵢ·eᵢ/(1 − hᵢ) of row i of the Jacobian, its residual and its
//! leverage, two forms are made, and each number gets the larger of its variances:
//!
//! - kᵢⱼ = 1 for i = j and else 0: errors of any size, independent from chirp to chirp (HC3: MacKinnon and White 1985,
//!   DOI 10.1016/0304-4076(85)90158-7);
//! - kᵢⱼ falls linearly to 0 at two spot diameters: errors that neighbouring chirps share (Conley 1999,
//!   DOI 10.1016/S0304-4076(98)00084-0), such as a plate that is not flat.
//!
//! An interval is Student's, with as many degrees of freedom as there are points beyond four. An error that all chirps
//! share is not seen by one cloud: the reflectance of the metal, a wrong radius, a receiver that saturates.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix4, Vector4};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::cloud::Cloud;
use super::error::{CalibrationError, ReductionError};
use super::point_rays::PointRays;
use super::reduce::check_threshold;
use crate::frames::{Global, Ray};
use crate::radar::reference::{corner_return, plate_return, sphere_return};
use crate::radar::{Beam, Chirps, GaussianBeam, Link, Radar};
use crate::scene::ReferenceShape;
use crate::units::{db_from_ratio, dbm_from_watts};

/// How a calibration is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Points are used whose model is this far below the peak at most, dB, above 0.
    pub within_db: f64,
}

impl Default for Calibration {
    fn default() -> Self {
        Calibration { within_db: 20.0 }
    }
}

/// A number with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Its 95 % interval.
    pub interval_95: [f64; 2],
}

/// What a cloud says of its radar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationResult {
    /// The radar's loss, dB.
    pub system_loss_db: Estimate,
    /// Waist of the beam over that of the radar that was given.
    pub waist_ratio: Estimate,
    /// Where the target stands beside its place in the scene: tilts of a plate, rad, or shifts across the beam, m.
    pub off: [f64; 2],
    /// Range of the strongest point, m.
    pub range_m: f64,
    /// How far below the peak points were used, dB.
    pub within_db: f64,
    /// Points that were used.
    pub used: usize,
    /// Root mean square of their residuals, dB.
    pub rms_db: f64,
}

/// Points above the threshold by less than this are left out: of their weaker neighbours only those that noise made
/// strong were detected, dB.
const ABOVE_THRESHOLD_DB: f64 = 10.0;
/// Fewer points do not give a degree of freedom to every unknown.
const LEAST_POINTS: usize = 8;
/// Points near the peak must span at least this, dB.
const LEAST_SPAN_DB: f64 = 6.0;
/// The strongest point may lie so far from where the scene has the target, m.
const FARTHEST_M: f64 = 0.1;
/// Standard deviation of a loss, dB, above which it is not determined.
const MOST_LOSS_SD_DB: f64 = 3.0;
/// Standard deviation of a waist over the waist above which it is not determined.
const MOST_WAIST_SD: f64 = 0.5;
/// A return that scatters more than this about its closed form is not that target's, dB.
const MOST_RMS_DB: f64 = 3.0;
/// Nor is one whose beam is this many times wider or narrower than the scene's.
const MOST_WAIST_RATIO: f64 = 3.0;
/// Share of the chirps near the peak that must have a detection.
const LEAST_DETECTED: f64 = 0.8;
/// The beam must pass the edge of a plate by this many of its radii.
const EDGE_RADII: f64 = 2.0;

/// Numbers of the model: loss (dB), the two of the place, and ln of the waist's ratio.
type Unknowns = Vector4<f64>;

impl Calibration {
    /// Finds loss and waist from the cloud of a target that reflects this share of the power, 0 to 1.
    ///
    /// # Errors
    /// A cloud that does not show the target, or that the scene's radar could not have measured.
    pub fn run(
        &self,
        shape: &ReferenceShape,
        reflectance: f64,
        radar: &Radar,
        chirps: &Chirps,
        cloud: &Cloud,
    ) -> Result<CalibrationResult, CalibrationError> {
        let PointRays { rays, .. } =
            PointRays::of(cloud, radar, chirps).map_err(ReductionError::from)?;
        check_threshold(radar, cloud)?;
        let beams = Beam::new(radar);
        let shots: Vec<Shot> = std::iter::zip(cloud.points(), &rays)
            .map(|(point, ray)| Shot {
                ray: *ray,
                range_m: ray.origin.distance_m(point.point),
                beam: beams.along(ray),
                power_dbm: dbm_from_watts(point.power_w),
            })
            .collect();
        let strongest = shots.iter().copied().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm));
        let strongest = strongest.ok_or(CalibrationError::Nothing)?;
        let span_db = strongest.power_dbm - radar.threshold_dbm - ABOVE_THRESHOLD_DB;
        let within_db = self.within_db.min(span_db);
        if within_db < LEAST_SPAN_DB {
            return Err(CalibrationError::Weak {
                peak_dbm: strongest.power_dbm,
                threshold_dbm: radar.threshold_dbm,
                least_dbm: radar.threshold_dbm + ABOVE_THRESHOLD_DB + LEAST_SPAN_DB,
            });
        }
        let view = View::new(*shape, &strongest)?;
        // A stated aperture takes the place of the beam's own.
        let link = Link::new(radar);
        let section = strongest.beam.section(strongest.range_m);
        let aperture =
            link.solid_angle_sr(&strongest.beam, strongest.range_m) / section.solid_angle_sr();
        let lossless_dbm = radar.transmit_power_dbm + db_from_ratio(reflectance * aperture);
        let fit = Fit { view, shots: &shots, link, lossless_dbm, within_db };
        let fitted = fit.run(&strongest)?;
        fit.check(&fitted, beams, chirps, cloud)?;
        let result = fit.result(&fitted, &strongest, 2.0 * radar.spot_fwhm_m());
        let (loss_sd_db, waist) = (result.system_loss_db.sd, result.waist_ratio);
        let is_determined =
            loss_sd_db <= MOST_LOSS_SD_DB && waist.sd <= MOST_WAIST_SD * waist.value;
        let target = shape.name();
        is_determined.then_some(result).ok_or(CalibrationError::Undetermined { target })
    }
}

/// A detection.
#[derive(Clone, Copy)]
struct Shot {
    ray: Ray<Global>,
    range_m: f64,
    beam: GaussianBeam,
    power_dbm: f64,
}

/// The target as it is seen along the ray of the strongest point.
struct View {
    shape: ReferenceShape,
    /// Normal of a plate, on the radar's side; for other targets the direction to the radar.
    facing: DVec3,
    /// Directions of the two numbers of the place: across the normal of a plate, or across the beam.
    across: [DVec3; 2],
    /// The place at which the strongest point would be at the peak.
    start: [f64; 2],
}

impl View {
    fn new(shape: ReferenceShape, strongest: &Shot) -> Result<View, CalibrationError> {
        let forward = strongest.ray.direction.xyz();
        let refuse = |off_m: f64| CalibrationError::Elsewhere {
            target: shape.name(),
            range_m: strongest.range_m,
            off_m,
        };
        let expected_m = shape.range_m(&strongest.ray).ok_or(refuse(f64::INFINITY))?;
        let off_m = strongest.range_m - expected_m;
        if off_m.abs() > FARTHEST_M {
            return Err(refuse(off_m));
        }
        let facing = match shape {
            ReferenceShape::Plate { half_sides: [a, b], .. } => {
                let normal = a.cross(b).normalize();
                normal * -normal.dot(forward).signum()
            }
            _ => -forward,
        };
        if let ReferenceShape::Corner { legs, .. } = shape {
            let mouth = across_ray(&strongest.ray, legs);
            let is_open = legs.iter().map(|leg| leg.dot(facing)).sum::<f64>() > 0.0;
            let section = strongest.beam.section(strongest.range_m);
            if !is_open || corner_return(&section, &mouth, 0.0) == 0.0 {
                return Err(CalibrationError::TurnedAway);
            }
        }
        let across = <[DVec3; 2]>::from(facing.any_orthonormal_pair());
        let start = match shape {
            // The strongest ray falls on the plate along its normal.
            ReferenceShape::Plate { .. } => across.map(|across| {
                let towards = -forward;
                towards.dot(across) / towards.dot(facing)
            }),
            ReferenceShape::Sphere { centre: middle, .. }
            | ReferenceShape::Corner { apex: middle, .. } => {
                across.map(|across| -aside(&strongest.ray, middle).dot(across))
            }
        };
        Ok(View { shape, facing, across, start })
    }

    /// Share of the power that a shot returns, dB, by the place of the target and the ratio of the waist.
    fn return_db(
        &self,
        ray: &Ray<Global>,
        range_m: f64,
        beam: GaussianBeam,
        unknowns: &Unknowns,
    ) -> f64 {
        let moved = unknowns[1] * self.across[0] + unknowns[2] * self.across[1];
        let beam = GaussianBeam { waist_m: beam.waist_m * unknowns[3].exp(), ..beam };
        let section = beam.section(range_m);
        let share = match self.shape {
            ReferenceShape::Plate { .. } => {
                let normal = self.facing + moved;
                plate_return(&beam, range_m, normal.angle_between(-ray.direction.xyz()))
            }
            ReferenceShape::Sphere { centre, radius_m } => {
                sphere_return(&section, radius_m, aside(ray, centre + moved).length())
            }
            ReferenceShape::Corner { apex, legs } => {
                let mouth = across_ray(ray, legs);
                corner_return(&section, &mouth, aside(ray, apex + moved).length())
            }
        };
        db_from_ratio(share)
    }
}

impl ReferenceShape {
    /// Range at which a ray meets the target, m; `None` where it passes.
    fn range_m(&self, ray: &Ray<Global>) -> Option<f64> {
        let (origin, forward) = (ray.origin.xyz, ray.direction.xyz());
        match *self {
            ReferenceShape::Plate { middle, half_sides } => {
                let normal = half_sides[0].cross(half_sides[1]);
                let range_m = (middle - origin).dot(normal) / forward.dot(normal);
                let place = origin + range_m * forward - middle;
                let is_on = half_sides.iter().all(|side| place.dot(*side).abs() <= side.dot(*side));
                (is_on && range_m > 0.0).then_some(range_m)
            }
            ReferenceShape::Sphere { centre, radius_m } => {
                let depth2 = radius_m * radius_m - aside(ray, centre).length_squared();
                (depth2 >= 0.0).then(|| (centre - origin).dot(forward) - depth2.sqrt())
            }
            ReferenceShape::Corner { apex, legs } => {
                let is_near = aside(ray, apex).length() <= legs[0].length();
                is_near.then(|| (apex - origin).dot(forward))
            }
        }
    }

    /// Whether a beam of this radius passes all edges of a plate.
    fn holds(&self, ray: &Ray<Global>, radius_m: f64) -> bool {
        let ReferenceShape::Plate { middle, half_sides } = *self else { return true };
        let Some(range_m) = self.range_m(ray) else { return false };
        let place = ray.origin.xyz + range_m * ray.direction.xyz() - middle;
        half_sides
            .iter()
            .all(|side| place.dot(side.normalize()).abs() + EDGE_RADII * radius_m <= side.length())
    }
}

/// Vectors as seen along a ray, m.
fn across_ray(ray: &Ray<Global>, legs: [DVec3; 3]) -> [DVec2; 3] {
    let (right, up) = ray.direction.xyz().any_orthonormal_pair();
    legs.map(|leg| DVec2::new(leg.dot(right), leg.dot(up)))
}

/// From the axis of a ray to a point, across the axis, m.
fn aside(ray: &Ray<Global>, point: DVec3) -> DVec3 {
    (point - ray.origin.xyz).reject_from_normalized(ray.direction.xyz())
}

/// A least-squares problem.
struct Fit<'a> {
    view: View,
    shots: &'a [Shot],
    link: Link,
    /// Power that would return without loss and diffraction, dBm.
    lossless_dbm: f64,
    within_db: f64,
}

/// Its solution, and the shots that were used.
struct Fitted {
    unknowns: Unknowns,
    used: Vec<Shot>,
}

impl Fit<'_> {
    /// Model power of a shot, dBm.
    fn model_dbm(&self, shot: &Shot, unknowns: &Unknowns) -> f64 {
        let Shot { ray, range_m, beam, .. } = shot;
        let return_db = self.view.return_db(ray, *range_m, *beam, unknowns);
        self.lossless_dbm - unknowns[0] + return_db - self.link.air_loss_db(2.0 * range_m)
    }

    /// Chooses points and fits by turns, from the strongest point on.
    fn run(&self, strongest: &Shot) -> Result<Fitted, CalibrationError> {
        const TURNS: usize = 5;
        let [a, b] = self.view.start;
        let mut unknowns = Unknowns::new(0.0, a, b, 0.0);
        let least_dbm = strongest.power_dbm - self.within_db;
        let mut used: Vec<Shot> =
            self.shots.iter().copied().filter(|shot| self.is_whole(shot)).collect();
        // At first there is no model to choose by.
        used.retain(|shot| shot.power_dbm >= least_dbm);
        for turn in 0..TURNS {
            if used.len() < LEAST_POINTS {
                return Err(CalibrationError::Few {
                    target: self.view.shape.name(),
                    points: used.len(),
                    least: LEAST_POINTS,
                    within_db: self.within_db,
                });
            }
            if turn == 0 {
                let mean_db: f64 =
                    used.iter().map(|s| self.model_dbm(s, &unknowns) - s.power_dbm).sum();
                unknowns[0] = mean_db / used.len() as f64;
            }
            unknowns = self.minimise(&used, unknowns);
            if !unknowns.iter().all(|unknown| unknown.is_finite()) {
                break;
            }
            let peak_dbm = self.peak_dbm(&unknowns);
            used = self.shots.iter().copied().filter(|shot| self.is_whole(shot)).collect();
            used.retain(|shot| self.model_dbm(shot, &unknowns) >= peak_dbm - self.within_db);
        }
        Ok(Fitted { unknowns, used })
    }

    /// Whether the beam of a shot lies on the target as a whole.
    fn is_whole(&self, shot: &Shot) -> bool {
        self.view.shape.holds(&shot.ray, shot.beam.section(shot.range_m).radius_m)
    }

    /// The strongest model power of all shots, dBm.
    fn peak_dbm(&self, unknowns: &Unknowns) -> f64 {
        let powers_dbm = self.shots.iter().map(|shot| self.model_dbm(shot, unknowns));
        powers_dbm.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Residuals of shots, dB, and the derivatives of the model.
    fn linear(&self, shots: &[Shot], unknowns: &Unknowns) -> Vec<(f64, Unknowns)> {
        // Steps that change the return by some hundredths of a decibel.
        const STEPS: [f64; 4] = [1e-3, 1e-5, 1e-5, 1e-4];
        let derivatives = |shot: &Shot| {
            Unknowns::from_fn(|row, _| {
                let mut step = Unknowns::zeros();
                step[row] = STEPS[row];
                let [more, less] =
                    [unknowns + step, unknowns - step].map(|at| self.model_dbm(shot, &at));
                (more - less) / (2.0 * STEPS[row])
            })
        };
        let row =
            |shot: &Shot| (shot.power_dbm - self.model_dbm(shot, unknowns), derivatives(shot));
        shots.iter().map(row).collect()
    }

    /// Levenberg's and Marquardt's steps from a start.
    fn minimise(&self, shots: &[Shot], start: Unknowns) -> Unknowns {
        const MOST_STEPS: usize = 60;
        let cost = |at: &Unknowns| -> f64 {
            shots.iter().map(|shot| (shot.power_dbm - self.model_dbm(shot, at)).powi(2)).sum()
        };
        let (mut here, mut damping) = (start, 1e-3);
        let mut least = cost(&here);
        for _ in 0..MOST_STEPS {
            let rows = self.linear(shots, &here);
            let (normal, right) = normal_equations(&rows);
            let damped = normal + Matrix4::from_diagonal(&(normal.diagonal() * damping));
            let Some(step) = damped.lu().solve(&right) else { break };
            let next = cost(&(here + step));
            if next < least {
                let is_still = least - next < 1e-12 * least;
                (here, least, damping) = (here + step, next, damping * 0.1);
                if is_still {
                    break;
                }
            } else if damping > 1e6 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        here
    }

    /// Whether the cloud shows the target.
    fn check(
        &self,
        fitted: &Fitted,
        beams: Beam,
        chirps: &Chirps,
        cloud: &Cloud,
    ) -> Result<(), CalibrationError> {
        let (unknowns, target) = (&fitted.unknowns, self.view.shape.name());
        let rms_db = self.rms_db(fitted);
        if rms_db.is_nan() {
            return Err(CalibrationError::Undetermined { target });
        }
        if rms_db > MOST_RMS_DB {
            return Err(CalibrationError::OtherReturn { target, rms_db });
        }
        let ratio = unknowns[3].exp();
        if !(1.0 / MOST_WAIST_RATIO..=MOST_WAIST_RATIO).contains(&ratio) {
            return Err(CalibrationError::OtherWidth { target, ratio });
        }
        let off_m = unknowns[1].hypot(unknowns[2]);
        if !matches!(self.view.shape, ReferenceShape::Plate { .. }) && off_m > FARTHEST_M {
            let range_m = fitted.used.first().map_or(f64::NAN, |shot| shot.range_m);
            return Err(CalibrationError::Elsewhere { target, range_m, off_m });
        }
        // Chirps near the peak, and those of them that gave a point.
        if cloud.points().iter().any(|point| point.chirp.is_none()) {
            return Ok(());
        }
        let least_dbm = self.peak_dbm(unknowns) - self.within_db;
        let is_expected = |ray: &&Ray<Global>| {
            let Some(range_m) = self.view.shape.range_m(ray) else { return false };
            let shot = Shot { ray: **ray, range_m, beam: beams.along(ray), power_dbm: 0.0 };
            self.is_whole(&shot) && self.model_dbm(&shot, unknowns) >= least_dbm
        };
        let expected = chirps.rays.iter().filter(is_expected).count();
        let detected = fitted.used.len();
        if (detected as f64) < LEAST_DETECTED * expected as f64 {
            return Err(CalibrationError::Holes { target, detected, expected });
        }
        Ok(())
    }

    fn rms_db(&self, fitted: &Fitted) -> f64 {
        let Fitted { unknowns, used } = fitted;
        let squares: f64 =
            used.iter().map(|s| (s.power_dbm - self.model_dbm(s, unknowns)).powi(2)).sum();
        (squares / used.len() as f64).sqrt()
    }

    /// The numbers with their uncertainty, by errors that chirps share up to a distance, m.
    fn result(&self, fitted: &Fitted, strongest: &Shot, shared_m: f64) -> CalibrationResult {
        let Fitted { unknowns, used } = fitted;
        let sd = standard_deviations(&self.linear(used, unknowns), used, shared_m);
        let freedom = (used.len() - unknowns.len()) as f64;
        // The law exists for any degree of freedom above 0.
        let width =
            StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |law| law.inverse_cdf(0.975));
        let estimate = |row: usize| {
            let (value, reach) = (unknowns[row], width * sd[row]);
            Estimate { value, sd: sd[row], interval_95: [value - reach, value + reach] }
        };
        let ln_ratio = estimate(3);
        let value = ln_ratio.value.exp();
        CalibrationResult {
            system_loss_db: estimate(0),
            waist_ratio: Estimate {
                value,
                sd: value * ln_ratio.sd,
                interval_95: ln_ratio.interval_95.map(f64::exp),
            },
            off: [unknowns[1], unknowns[2]],
            range_m: strongest.range_m,
            within_db: self.within_db,
            used: used.len(),
            rms_db: self.rms_db(fitted),
        }
    }
}

fn normal_equations(rows: &[(f64, Unknowns)]) -> (Matrix4<f64>, Unknowns) {
    let (mut normal, mut right) = (Matrix4::zeros(), Unknowns::zeros());
    for (residual, row) in rows {
        normal += row * row.transpose();
        right += row * *residual;
    }
    (normal, right)
}

/// Standard deviations of the unknowns: the larger of both forms that the module describes.
fn standard_deviations(rows: &[(f64, Unknowns)], shots: &[Shot], shared_m: f64) -> Unknowns {
    let (normal, _) = normal_equations(rows);
    let Some(inverse) = normal.try_inverse() else { return Unknowns::repeat(f64::INFINITY) };
    let scores: Vec<Unknowns> = rows
        .iter()
        .map(|(residual, row)| {
            let leverage = (row.transpose() * inverse * row)[0].min(1.0 - 1e-9);
            row * (residual / (1.0 - leverage))
        })
        .collect();
    let places: Vec<DVec3> =
        shots.iter().map(|s| s.ray.origin.xyz + s.range_m * s.ray.direction.xyz()).collect();
    let (mut alone, mut shared) = (Matrix4::zeros(), Matrix4::zeros());
    for (one, score) in scores.iter().enumerate() {
        alone += score * score.transpose();
        let mut near = Unknowns::zeros();
        for (other, place) in scores.iter().zip(&places) {
            near += other * (1.0 - place.distance(places[one]) / shared_m).max(0.0);
        }
        shared += score * near.transpose();
    }
    let variances = [alone, shared].map(|middle| (inverse * middle * inverse).diagonal());
    variances[0].zip_map(&variances[1], |alone, shared| alone.max(shared).sqrt())
}

impl Estimate {
    /// The estimate of a multiple.
    pub fn times(&self, factor: f64) -> Estimate {
        Estimate {
            value: factor * self.value,
            sd: factor * self.sd,
            interval_95: self.interval_95.map(|end| factor * end),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::frames::Point;
    use crate::measure::CloudPoint;
    use crate::radar::Pattern;
    use crate::radar::random::{Draws, Key, Purpose};
    use crate::radar::scan::Raster;
    use crate::units::watts_from_dbm;

    /// The loss behind every cloud, dB.
    const LOSS_DB: f64 = 14.2;
    /// Waist of the measuring beam over that of the scene's.
    const RATIO: f64 = 1.05;
    /// Share of the power that every target reflects.
    const REFLECTANCE: f64 = 0.98;

    /// The middle of the default field of view.
    const MIDDLE: DVec3 = DVec3::new(0.0, 1.1, 0.0);

    /// A plate that is turned by some milliradians and a sphere and a corner some millimetres off their place.
    fn targets() -> [(ReferenceShape, ReferenceShape); 3] {
        let plate = |turn: f64| ReferenceShape::Plate {
            middle: MIDDLE,
            half_sides: [DVec3::new(0.3, 0.0, 0.3 * turn), DVec3::new(0.0, 0.3, 0.0)],
        };
        let sphere = |off: DVec3| ReferenceShape::Sphere {
            centre: MIDDLE + off - 0.1 * DVec3::Z,
            radius_m: 0.1,
        };
        let legs = crate::scene::solids::trihedral(0.05).vertices;
        let corner = |off: DVec3| ReferenceShape::Corner {
            apex: MIDDLE + off,
            legs: [legs[1], legs[2], legs[3]],
        };
        let off = DVec3::new(0.004, -0.003, 0.0);
        [
            (plate(0.0), plate(0.004)),
            (sphere(DVec3::ZERO), sphere(off)),
            (corner(DVec3::ZERO), corner(off)),
        ]
    }

    /// A radar whose scan is as fine as its target needs.
    fn radar(shape: &ReferenceShape) -> Radar {
        let (side_m, count) = match shape {
            ReferenceShape::Plate { .. } => (0.4, 17),
            _ => (0.06, 13),
        };
        Radar {
            scan: Pattern::Raster(Raster {
                lines: count,
                chirps_per_line: count,
                width_m: side_m,
                height_m: side_m,
            }),
            ..Radar::default()
        }
    }

    fn chirps(radar: &Radar) -> Chirps {
        Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap()
    }

    /// What a radar with the true loss and beam measures, with an error for every chirp and place, dB.
    fn measured(
        shape: &ReferenceShape,
        radar: &Radar,
        chirps: &Chirps,
        error_db: impl Fn(usize, DVec3) -> f64,
    ) -> Cloud {
        let beams = Beam::new(radar);
        let mut points = Vec::new();
        for (number, ray) in chirps.rays.iter().enumerate() {
            let Some(range_m) = shape.range_m(ray) else { continue };
            let mut beam = beams.along(ray);
            beam.waist_m *= RATIO;
            let section = beam.section(range_m);
            let share = match *shape {
                ReferenceShape::Plate { half_sides: [a, b], .. } => {
                    let tilt_rad = a.cross(b).angle_between(-ray.direction.xyz());
                    plate_return(&beam, range_m, tilt_rad)
                }
                ReferenceShape::Sphere { centre, radius_m } => {
                    sphere_return(&section, radius_m, aside(ray, centre).length())
                }
                ReferenceShape::Corner { apex, legs } => {
                    // The scan is a narrow one: every ray sees the same mouth.
                    let mouth = legs.map(|leg| leg.truncate());
                    corner_return(&section, &mouth, aside(ray, apex).length())
                }
            };
            let point = ray.origin.xyz + range_m * ray.direction.xyz();
            let power_dbm =
                radar.transmit_power_dbm - LOSS_DB - radar.air_loss_db_per_m * 2.0 * range_m
                    + db_from_ratio(REFLECTANCE * share)
                    + error_db(number, point);
            if power_dbm >= radar.threshold_dbm {
                points.push(CloudPoint {
                    chirp: Some(chirps.number[number]),
                    point: Point::from(point),
                    range_m: Some(range_m),
                    power_w: watts_from_dbm(power_dbm),
                });
            }
        }
        Cloud::new(points).unwrap()
    }

    fn draws(seed: u64, sub_ray: u64) -> Draws {
        Key { seed, chirp: 0, sub_ray, purpose: Purpose::Noise }.draws()
    }

    fn run(
        shape: &ReferenceShape,
        radar: &Radar,
        chirps: &Chirps,
        cloud: &Cloud,
    ) -> Result<CalibrationResult, CalibrationError> {
        Calibration::default().run(shape, REFLECTANCE, radar, chirps, cloud)
    }

    #[test]
    fn without_errors_loss_and_beam_are_found_as_they_are() {
        let [plate, sphere, corner] = targets();
        for ((given, true_shape), air_loss_db_per_m) in
            [(plate, 0.0), (sphere, 0.0), (corner, 0.0), (plate, 0.5), (sphere, 0.5)]
        {
            let radar = Radar { air_loss_db_per_m, ..radar(&given) };
            let chirps = chirps(&radar);
            let cloud = measured(&true_shape, &radar, &chirps, |_, _| 0.0);
            let found = run(&given, &radar, &chirps, &cloud).unwrap();
            // The mouth of the corner turns by 4 mrad over its scan.
            let [loss_db, ratio] = [found.system_loss_db.value, found.waist_ratio.value];
            assert!((loss_db - LOSS_DB).abs() < 2e-3, "{given:?}: {found:?}");
            assert!((ratio / RATIO - 1.0).abs() < 1e-3, "{given:?}: {found:?}");
            assert!(found.rms_db < 2e-3, "{given:?}: {found:?}");
        }
    }

    /// Shares of the clouds whose intervals hold the loss and the waist.
    fn coverage(seeds: u64, error_db: impl Fn(u64, usize, DVec3) -> f64) -> Vec<[f64; 2]> {
        let mut shares = Vec::new();
        for (given, true_shape) in targets() {
            let radar = radar(&given);
            let chirps = chirps(&radar);
            let mut held = [0.0; 2];
            for seed in 0..seeds {
                let cloud = measured(&true_shape, &radar, &chirps, |n, at| error_db(seed, n, at));
                let found = run(&given, &radar, &chirps, &cloud).unwrap();
                for ((held, estimate), truth) in held
                    .iter_mut()
                    .zip([found.system_loss_db, found.waist_ratio])
                    .zip([LOSS_DB, RATIO])
                {
                    let [low, high] = estimate.interval_95;
                    *held += f64::from(u8::from((low..=high).contains(&truth)));
                }
            }
            shares.push(held.map(|held| held / seeds as f64));
        }
        shares
    }

    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        const SEEDS: u64 = 100;
        let shares = coverage(SEEDS, |seed, number, _| 0.3 * draws(seed, number as u64).gaussian());
        // Three standard deviations of a binomial share. Loss and waist go together, so that all six shares are worth
        // some 300 clouds, and the larger of two variances covers a little more.
        let mean = shares.as_flattened().iter().sum::<f64>() / 6.0;
        assert!((0.95 - 0.038..=0.95 + 0.04).contains(&mean), "{shares:?}");
        assert!(shares.as_flattened().iter().all(|share| *share > 0.95 - 0.066), "{shares:?}");
    }

    #[test]
    fn errors_that_neighbours_share_widen_the_intervals() {
        const SEEDS: u64 = 40;
        // A ripple of a random phase and direction, 80 mm long, besides what every chirp has for itself.
        let shares = coverage(SEEDS, |seed, number, at| {
            let mut draws = draws(seed, 0);
            let along = DVec2::from_angle(6.3 * draws.uniform());
            let phase_rad = 6.3 * draws.uniform();
            let own_db = 0.05 * super::tests::draws(seed, 1 + number as u64).gaussian();
            0.3 * (along.dot(at.truncate()) / 0.08 * 6.3 + phase_rad).sin() + own_db
        });
        // The plate spans several ripples; within the spot of the others they are a gradient, which no scan shows.
        let [loss, waist] = shares[0];
        assert!(loss > 0.85 && waist > 0.8, "{shares:?}");
    }

    #[test]
    fn clouds_that_do_not_show_the_target_are_refused() {
        let [(plate, _), (sphere, _), (corner, _)] = targets();
        let radar = radar(&sphere);
        let chirps = chirps(&radar);
        let cloud = measured(&sphere, &radar, &chirps, |_, _| 0.0);
        let text = |shape: &ReferenceShape, radar: &Radar, cloud: &Cloud| {
            run(shape, radar, &chirps, cloud).unwrap_err().to_string()
        };
        // Powers of something rough.
        let rough = measured(&sphere, &radar, &chirps, |number, _| {
            10.0 * draws(1, number as u64).gaussian() - 10.0
        });
        assert!(text(&sphere, &radar, &rough).contains("scatter by"));
        // A sphere taken for a plate, whose return is spread over decimetres.
        assert!(text(&plate, &radar, &cloud).contains("times as wide"));
        // A target that stands elsewhere, in depth and across.
        let ReferenceShape::Sphere { centre, radius_m } = sphere else { panic!() };
        for (off, part) in [(DVec3::Z, "mm off"), (DVec3::X, "beside")] {
            let elsewhere = ReferenceShape::Sphere { centre: centre + 0.5 * off, radius_m };
            assert!(text(&elsewhere, &radar, &cloud).contains(part));
        }
        // A threshold above the cloud, and one that leaves too little of it.
        let deaf = |threshold_dbm| Radar { threshold_dbm, ..radar.clone() };
        assert!(text(&sphere, &deaf(20.0), &cloud).contains("threshold of 20 dBm"));
        let few = |least_dbm: f64| {
            let points = cloud.points().iter().copied();
            Cloud::new(points.filter(|p| dbm_from_watts(p.power_w) > least_dbm).collect()).unwrap()
        };
        let peak_dbm =
            cloud.points().iter().map(|p| dbm_from_watts(p.power_w)).fold(-300.0, f64::max);
        assert!(
            text(&sphere, &deaf(peak_dbm - 12.0), &few(peak_dbm - 12.0)).contains("dBm or more")
        );
        assert!(text(&sphere, &radar, &few(peak_dbm - 0.5)).contains("a calibration needs 8"));
        // Every second point is missing.
        let points = cloud.points().iter().copied().step_by(2);
        let half = Cloud::new(points.collect()).unwrap();
        assert!(text(&sphere, &radar, &half).contains("chirps near the peak"));
        // One point over and over.
        let one = CloudPoint { chirp: None, ..cloud.points()[cloud.points().len() / 2] };
        let same = Cloud::new(vec![one; 100]).unwrap();
        let undetermined = run(&sphere, &radar, &chirps, &same);
        assert!(
            matches!(undetermined, Err(CalibrationError::Undetermined { .. })),
            "{undetermined:?}"
        );
        // A corner that is turned away.
        let ReferenceShape::Corner { apex, legs } = corner else { panic!() };
        let away = ReferenceShape::Corner { apex, legs: legs.map(|leg| -leg) };
        let aslant = ReferenceShape::Corner {
            apex,
            legs: legs.map(|leg| DMat3::from_rotation_y(1.2) * leg),
        };
        let seen = measured(&corner, &radar, &chirps, |_, _| 0.0);
        for turned in [away, aslant] {
            assert_eq!(run(&turned, &radar, &chirps, &seen), Err(CalibrationError::TurnedAway));
        }
    }
}
