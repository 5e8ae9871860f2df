//! Converts powers to σ⁰: equation (8) solved for the material's share.
//!
//! σ⁰(θ) = P_r · 4πR²/(P_t · A_eq · g), with the system gain g. A curve's σ⁰ is by definition (10),
//! 4π·f·cos²θ. With [`Footprint::Projected`] the instrument's model is P_r = P_t·A_eq·g/R² · f·cos θ,
//! and so the quotient is multiplied by cos θ.
//!
//! A chirp whose ray hits the registered target and that has no detection is a row too: its echo
//! stayed below the threshold. A chirp with a detection elsewhere, such as a false alarm, is not a row.

use std::collections::HashSet;
use std::f64::consts::PI;

use rayon::prelude::*;

use super::cloud::{Cloud, CloudPoint};
use super::curve::Curve;
use super::error::ReductionError;
use super::exclusions::Exclusions;
use super::incidence::{Incidence, Sighting};
use super::point_rays::PointRays;
use super::register::RegistrationResult;
use super::widening::{CurveWidening, Widening};
use crate::formats::words::significant;
use crate::frames::{Global, Point, Pose, Ray, Target as TargetFrame};
use crate::material::{Illumination, Observation, Scale};
use crate::radar::{Chirps, Footprint, Link, Radar};
use crate::scene::Target;
use crate::units::{rounded, watts_from_dbm};

/// Settings of the reduction of a registered cloud to a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reduction {
    /// Only this region of the target; `None` for all.
    pub region: Option<u16>,
    /// Rows nearer to a silhouette, a step or another region, across the beam, are left out, m; 0
    /// for none. `None`: the spot's diameter, by which a straight edge leaves less than 1 % of a
    /// Gaussian beam's power on the other side.
    pub edge_margin_m: Option<f64>,
    /// A further standard deviation of each tilt of the normal, rad.
    pub extra_sd_rad: f64,
    /// The target is the facets of the mesh, as in a simulation, and not a smooth surface that they
    /// approximate: their normals have no error.
    pub exact_mesh: bool,
    /// The echoes are of whole spots, as those of a radar and of a rendering with several rays per spot. The curvature of the
    /// target within the spot then widens its lobes, and is a part of the curve's beam. Otherwise they are of single
    /// rays, to which every target is flat.
    pub of_spots: bool,
}

/// A curve and what was left out of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReductionResult {
    /// Rows of the detections in the cloud's order, then of the silent chirps in the scan's.
    pub curve: Curve,
    /// What did not become a row.
    pub left_out: Exclusions,
    /// Notices for the user.
    pub notices: Vec<String>,
}

/// A hundredth of the points may contradict the scene before the cloud is refused.
const TOLERATED: usize = 100;

/// A row from a detection or a silent chirp, or the reason why there is none.
enum Fate {
    Row(Observation, Widening),
    Missed,
    OffSurface,
    OtherRegion,
    NearEdge,
    Unsure,
}

/// Converts chirps to rows.
struct Reducer<'a> {
    incidence: Incidence<'a>,
    link: Link,
    target_from_global: Pose<TargetFrame, Global>,
    region: Option<u16>,
    margin_m: f64,
    exact_mesh: bool,
    gate_m: f64,
    threshold_w: f64,
    /// Whether a detection needs its threshold: nothing is known of the silent chirps.
    only_detected: bool,
}

/// Equation (8) solved for σ⁰ by definition (10), a pure number: for a power received, W, of the beam
/// along `axis`, from the range, m.
pub fn sigma0(link: &Link, axis: &Ray<Global>, range_m: f64, cos_theta: f64, power_w: f64) -> f64 {
    let solid_angle_sr = link.solid_angle_sr(&link.beam.along(axis), range_m);
    let received_w = link.transmit_power_w * link.system_gain_ratio * solid_angle_sr;
    let received_w = received_w * link.air_share(2.0 * range_m);
    let quotient = power_w * 4.0 * PI / received_w;
    quotient * Footprint::Paper.factor_to(link.footprint, cos_theta)
}

/// A target whose curvature makes lobes wider by this factor is named.
const CURVED: f64 = 1.5;

impl Reduction {
    /// The curve of a cloud that `radar` measured with `chirps`, and that `registered` ties to
    /// `target`.
    ///
    /// # Errors
    /// When the registration has not converged, the region does not exist, the cloud is of another
    /// frame or scan, or no detection is left.
    pub fn run(
        &self,
        target: &Target,
        radar: &Radar,
        chirps: &Chirps,
        cloud: &Cloud,
        registered: &RegistrationResult,
    ) -> Result<ReductionResult, ReductionError> {
        if !registered.converged {
            return Err(ReductionError::NotConverged);
        }
        self.check_region(target)?;
        let relative = cloud.scale == Scale::Relative;
        if !relative {
            check_threshold(radar, cloud)?;
        }
        let point_rays = PointRays::of(cloud, radar, chirps)?;
        let assignment = Assignment::new(&point_rays, chirps.only_detected);
        let only_detected = assignment.only_detected;
        let reducer = Reducer {
            threshold_w: if relative {
                weakest_w(cloud)
            } else {
                watts_from_dbm(radar.threshold_dbm)
            },
            only_detected,
            ..self.reducer(target, radar, registered)
        };
        assignment.check()?;
        let mut left_out = Exclusions::default();
        let mut rows = detected(&reducer, cloud, &point_rays.rays, &assignment, &mut left_out);
        if rows.is_empty() {
            return Err(ReductionError::NoRows(left_out));
        }
        let detections = rows.len();
        rows.extend(silent(&reducer, chirps, &assignment, &mut left_out));
        let mut notices = assignment.notices;
        let silent = rows.len() - detections;
        if silent > detections {
            notices.push(format!(
                "{silent} chirps that hit the target have no detection, {detections} have one: if the cloud \
                 was cropped or thinned out, these chirps are missing and not silent, and a fit will be \
                 wrong; name the part that was kept with a region"
            ));
        }
        let (mut observations, widenings): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
        if relative {
            from_strongest(&mut observations);
        }
        let widening = CurveWidening::of(&widenings);
        notices.extend(widening.and_then(|widening| self.curvature(&widening)));
        let beam_rad = widening.map(|widening| self.beam_rad(&widening));
        let footprint = Some(radar.footprint);
        let illumination = Illumination { footprint, beam_rad, relative, only_detected };
        let curve = Curve { observations, illumination };
        Ok(ReductionResult { curve, left_out, notices })
    }

    /// The divergence of the beam that the lobes of the curve include, rad.
    fn beam_rad(&self, widening: &CurveWidening) -> f64 {
        /// A thousandth of the narrowest beam of a radar, rad.
        const STEP_RAD: f64 = 1e-6;
        let beam_rad = if self.of_spots { widening.curved_rad } else { widening.flat_rad };
        rounded((beam_rad / STEP_RAD).round().max(1.0) * STEP_RAD)
    }

    /// A sentence on a target that is curved within the spot.
    fn curvature(&self, widening: &CurveWidening) -> Option<String> {
        let CurveWidening { flat_rad, curved_rad } = *widening;
        let [flat, curved] = [flat_rad, curved_rad].map(|rad| significant(rad, 3));
        (curved_rad > CURVED * flat_rad).then(|| {
            if self.of_spots {
                format!(
                    "the target is curved within the spot: its beam_rad of {curved} holds that, beside the {flat} rad of \
                     the beam itself"
                )
            } else {
                format!(
                    "the target is curved within the spot: a radar sees its lobes wider by {curved} rad, and not by the \
                     {flat} rad of single rays, which a fit would take for the roughness of the surface; write rays = 16 \
                     under [spot], unless the cloud is a rendering with single rays"
                )
            }
        })
    }

    fn check_region(&self, target: &Target) -> Result<(), ReductionError> {
        let regions = target.region_of_facet.iter().max().map_or(0, |most| usize::from(*most) + 1);
        let regions = regions.max(target.regions.len());
        match self.region {
            Some(region) if usize::from(region) >= regions => {
                Err(ReductionError::UnknownRegion { region, regions })
            }
            _ => Ok(()),
        }
    }

    fn reducer<'a>(
        &self,
        target: &'a Target,
        radar: &Radar,
        registered: &'a RegistrationResult,
    ) -> Reducer<'a> {
        // A perfect fit must not refuse its own points.
        const LEAST_RMS_M: f64 = 1e-3;
        const GATE_SD: f64 = 5.0;
        let smooth = Incidence::new(target, registered, self.extra_sd_rad);
        Reducer {
            incidence: if self.exact_mesh { smooth.of_facets() } else { smooth },
            link: Link::new(radar),
            target_from_global: radar.frames().global_from_target.inverse(),
            region: self.region,
            margin_m: self.edge_margin_m.unwrap_or(radar.spot_fwhm_m()),
            exact_mesh: self.exact_mesh,
            gate_m: GATE_SD * registered.rms_m.max(LEAST_RMS_M),
            threshold_w: watts_from_dbm(radar.threshold_dbm),
            only_detected: false,
        }
    }
}

impl Reducer<'_> {
    fn wants(&self, sighting: &Sighting) -> bool {
        self.region.is_none_or(|region| region == sighting.region)
    }

    /// Facets that stand for a smooth surface have their error in the angle's deviation.
    fn is_sure(&self, ray: &Ray<Global>, sighting: &Sighting) -> bool {
        !self.exact_mesh || self.incidence.is_sure_of_its_facet(ray, sighting)
    }

    fn judge(&self, point: &CloudPoint, ray: &Ray<Global>, chirp: u32) -> Fate {
        let Some(sighting) = self.incidence.sight(ray) else {
            return Fate::Missed;
        };
        let range_m = ray.origin.distance_m(point.point);
        if (range_m - sighting.hit.range_m).abs() > self.gate_m {
            return Fate::OffSurface;
        }
        if !self.wants(&sighting) {
            return Fate::OtherRegion;
        }
        if !self.incidence.is_clear(ray, &sighting, self.margin_m) {
            return Fate::NearEdge;
        }
        if !self.is_sure(ray, &sighting) {
            return Fate::Unsure;
        }
        self.row(ray, &sighting, range_m, point.power_w, chirp, false)
    }

    fn row(
        &self,
        ray: &Ray<Global>,
        sighting: &Sighting,
        range_m: f64,
        power_w: f64,
        chirp: u32,
        censored: bool,
    ) -> Fate {
        let Sighting { hit, theta_sd_rad, .. } = *sighting;
        let sigma0 = sigma0(&self.link, ray, range_m, hit.cos_theta, power_w);
        let at = Point::from(ray.origin.xyz + range_m * ray.direction.xyz());
        let at = (self.target_from_global * at).xyz;
        let level = Observation::of_level(hit.theta_rad(), sigma0, censored);
        let limit = self.only_detected.then_some(sigma0 * self.threshold_w / power_w);
        let observation = Observation {
            threshold_sigma0: level.threshold_sigma0.or(limit),
            theta_sd_rad: Some(theta_sd_rad),
            power_w: Some(power_w),
            range_m: Some(range_m),
            chirp: Some(chirp),
            target_m: Some([at.x, at.y]),
            ..level
        };
        Fate::Row(observation, Widening::of(&self.incidence, &self.link.beam, ray, sighting))
    }
}

fn detected(
    reducer: &Reducer,
    cloud: &Cloud,
    point_rays: &[Ray<Global>],
    assignment: &Assignment,
    left_out: &mut Exclusions,
) -> Vec<(Observation, Widening)> {
    let fates: Vec<Fate> = cloud
        .points()
        .par_iter()
        .zip(point_rays)
        .zip(&assignment.chirp_of_point)
        .map(|((point, ray), chirp)| reducer.judge(point, ray, *chirp))
        .collect();
    let mut rows = Vec::new();
    for fate in fates {
        match fate {
            Fate::Row(row, widening) => rows.push((row, widening)),
            Fate::Missed => left_out.missed += 1,
            Fate::OffSurface => left_out.off_surface += 1,
            Fate::OtherRegion => left_out.other_region += 1,
            Fate::NearEdge => left_out.near_edge += 1,
            Fate::Unsure => left_out.unsure_of_facet += 1,
        }
    }
    rows
}

/// Rows of the chirps that hit the target and have no detection.
fn silent(
    reducer: &Reducer,
    chirps: &Chirps,
    assignment: &Assignment,
    left_out: &mut Exclusions,
) -> Vec<(Observation, Widening)> {
    let fates: Vec<Option<Fate>> = assignment
        .silent
        .par_iter()
        .map(|&index| {
            let (ray, chirp) = (chirps.rays.get(index)?, *chirps.number.get(index)?);
            let sighting =
                reducer.incidence.sight(ray).filter(|sighting| reducer.wants(sighting))?;
            if !reducer.incidence.is_clear(ray, &sighting, reducer.margin_m) {
                return Some(Fate::NearEdge);
            }
            if !reducer.is_sure(ray, &sighting) {
                return Some(Fate::Unsure);
            }
            let range_m = sighting.hit.range_m;
            Some(reducer.row(ray, &sighting, range_m, reducer.threshold_w, chirp, true))
        })
        .collect();
    let mut rows = Vec::new();
    for fate in fates.into_iter().flatten() {
        match fate {
            Fate::Row(row, widening) => rows.push((row, widening)),
            Fate::Unsure => left_out.unsure_of_facet += 1,
            _ => left_out.silent_near_edge += 1,
        }
    }
    rows
}

/// Which chirp each point belongs to, and which chirps have no point.
struct Assignment<'a> {
    chirp_of_point: Vec<u32>,
    /// Points on no ray of the scan.
    unmatched: usize,
    /// Indices in the scan of the chirps without a point.
    silent: &'a [usize],
    /// Whether silent chirps cannot be recognised.
    only_detected: bool,
    notices: Vec<String>,
}

impl Assignment<'_> {
    fn new(point_rays: &PointRays, only_detected: bool) -> Assignment<'_> {
        let unmatched = point_rays.chirps.iter().filter(|chirp| chirp.is_none()).count();
        let chirp_of_point =
            point_rays.chirps.iter().zip(0..).map(|(chirp, place)| chirp.unwrap_or(place));
        // More strays than false alarms explain: then silent chirps cannot be recognised.
        let lost = unmatched * 10 > point_rays.chirps.len();
        let only_detected = only_detected || lost;
        let silent = if only_detected { &[] } else { point_rays.silent.as_slice() };
        let mut notices = Vec::new();
        if unmatched > 0 {
            let effect = if lost {
                "; which chirps were silent is not known, so that the curve holds only detections: give the scene the \
                 scan of the measurement"
            } else {
                ""
            };
            notices.push(format!(
                "{unmatched} points lie on no ray of the scan and are numbered by their place in \
                 the cloud{effect}"
            ));
        }
        let chirp_of_point = chirp_of_point.collect();
        Assignment { chirp_of_point, unmatched, silent, only_detected, notices }
    }

    /// Refuses a cloud of which most points lie on no ray, and one whose points share their chirps.
    fn check(&self) -> Result<(), ReductionError> {
        let points = self.chirp_of_point.len();
        if 2 * self.unmatched > points {
            return Err(ReductionError::OffRays { off: self.unmatched, points });
        }
        let chirps: HashSet<u32> = self.chirp_of_point.iter().copied().collect();
        let shared = points - chirps.len();
        if shared * TOLERATED > points {
            return Err(ReductionError::SharedChirps { shared, points });
        }
        Ok(())
    }
}

/// Counts levels of an unknown unit from the strongest of them; their powers are no watts.
fn from_strongest(observations: &mut [Observation]) {
    let strongest = observations.iter().filter_map(|row| row.sigma0).fold(0.0, f64::max);
    for row in observations.iter_mut().filter(|_| strongest > 0.0) {
        row.power_w = None;
        for level in [&mut row.sigma0, &mut row.threshold_sigma0].into_iter().flatten() {
            *level /= strongest;
        }
    }
}

/// The least power of a cloud, W: what a radar of unknown level detects at least.
fn weakest_w(cloud: &Cloud) -> f64 {
    cloud.points().iter().map(|point| point.power_w).fold(f64::INFINITY, f64::min)
}

/// The threshold of the scene must be that of the measurement, or silence means something else.
pub(super) fn check_threshold(radar: &Radar, cloud: &Cloud) -> Result<(), ReductionError> {
    // A file may round its powers by this ratio, 0.05 dB.
    const ROUNDING: f64 = 0.988_553;
    let threshold_w = watts_from_dbm(radar.threshold_dbm);
    let least_w = ROUNDING * threshold_w;
    let below = cloud.points().iter().filter(|point| point.power_w < least_w).count();
    let points = cloud.points().len();
    if below * TOLERATED <= points {
        return Ok(());
    }
    let weakest_w = weakest_w(cloud);
    Err(ReductionError::BelowThreshold { below, points, threshold_w, weakest_w })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::settings::Registration;
    use crate::measure::synthetic::{SyntheticScan, f_per_sr, mannequin};
    use crate::units::db_from_ratio;

    fn target(measured: &SyntheticScan) -> Target {
        let region_of_facet =
            measured.mesh.facets.iter().map(|f| above(measured, f)).collect::<Vec<u16>>();
        let mesh = measured.mesh.clone();
        Target { mesh, meshes: vec![], regions: vec![], region_of_facet }
    }

    /// Two regions, below and above 1.1 m.
    fn above(measured: &SyntheticScan, facet: &[u32; 3]) -> u16 {
        u16::from(measured.mesh.vertices[facet[0] as usize].y > 1.1)
    }

    fn reduce(
        measured: &SyntheticScan,
        settings: Reduction,
    ) -> Result<ReductionResult, ReductionError> {
        let registered = measured.register(&Registration::default()).unwrap();
        let SyntheticScan { radar, chirps, cloud, .. } = measured;
        settings.run(&target(measured), radar, chirps, cloud, &registered)
    }

    #[test]
    fn relative_levels_hold_no_watts() {
        let row = |sigma0: f64| Observation {
            power_w: Some(sigma0 * 1e-9),
            ..Observation::backscatter(0.3, Some(sigma0), Some(0.02))
        };
        let mut rows = [row(8.0), row(2.0)];
        from_strongest(&mut rows);
        assert_eq!(rows.map(|row| row.sigma0), [Some(1.0), Some(0.25)]);
        assert_eq!(rows.map(|row| row.threshold_sigma0), [Some(0.0025); 2]);
        assert_eq!(rows.map(|row| row.power_w), [None; 2]);
    }

    #[test]
    fn the_curve_is_the_law_that_made_the_cloud() {
        let reduced = reduce(&mannequin(2e-3, 1), Reduction::default()).unwrap();
        let mut off_db: Vec<f64> = reduced
            .curve
            .detected()
            .map(|row| {
                let theta_rad = row.theta_i_rad;
                let law = 4.0 * PI * f_per_sr(theta_rad) * theta_rad.cos().powi(2);
                db_from_ratio(row.sigma0.unwrap() / law).abs()
            })
            .collect();
        assert!(off_db.len() > 5000, "{}", off_db.len());
        // A hundredth of a degree at 0.5 dB a degree, and 2 mm of range.
        let middle = off_db.len() / 2;
        let median_db = *off_db.select_nth_unstable_by(middle, f64::total_cmp).1;
        assert!(median_db < 0.02, "{median_db}");
    }

    #[test]
    fn silent_chirps_are_rows_where_the_law_is_below_the_threshold() {
        let measured = mannequin(2e-3, 1);
        let reduced = reduce(&measured, Reduction::default()).unwrap();
        let link = Link::new(&measured.radar);
        let rows = &reduced.curve.observations;
        let censored: Vec<&Observation> = rows.iter().filter(|row| row.is_censored()).collect();
        assert!(censored.len() > 50, "{}", censored.len());
        let rightly = censored.iter().filter(|row| {
            let (theta_rad, range_m) = (row.theta_i_rad, row.range_m.unwrap());
            let axis = &measured.chirps.rays[row.chirp.unwrap() as usize];
            let power_w =
                link.power_w(&link.beam.along(axis), range_m, theta_rad.cos(), f_per_sr(theta_rad));
            power_w < 1.05 * row.power_w.unwrap()
        });
        // A pose that is off by a hundredth of a degree moves few of them across.
        assert!(rightly.count() as f64 > 0.98 * censored.len() as f64);
    }

    #[test]
    fn without_chirp_numbers_the_same_chirps_are_silent() {
        let measured = mannequin(2e-3, 1);
        let points = measured.cloud.points();
        let points = points.iter().map(|point| CloudPoint { chirp: None, ..*point }).collect();
        let bare = SyntheticScan { cloud: Cloud::new(points).unwrap(), ..measured.clone() };
        let [told, bare] =
            [&measured, &bare].map(|measured| reduce(measured, Reduction::default()).unwrap());
        let (told, bare) = (told.curve.observations, bare.curve.observations);
        assert_eq!(told.len(), bare.len());
        let same = std::iter::zip(&told, &bare).filter(|(a, b)| a.chirp == b.chirp).count();
        // Ellipses of the scan cross: a few chirps look at one place.
        assert!(same as f64 > 0.99 * told.len() as f64);
    }

    #[test]
    fn regions_and_edges_are_left_out() {
        let measured = mannequin(2e-3, 2);
        let all = Reduction { edge_margin_m: Some(0.0), ..Default::default() };
        let every = reduce(&measured, all).unwrap();
        assert_eq!(every.left_out.near_edge, 0);
        let upper = reduce(&measured, Reduction { region: Some(1), ..all }).unwrap();
        let lower = reduce(&measured, Reduction { region: Some(0), ..all }).unwrap();
        let rows = |reduced: &ReductionResult| reduced.curve.observations.len();
        assert_eq!(rows(&upper) + rows(&lower), rows(&every));
        assert!(rows(&upper) > 100 && rows(&lower) > 100);
        let inner = reduce(&measured, Reduction::default()).unwrap();
        assert!(inner.left_out.near_edge > 100 && rows(&inner) < rows(&every));
        let none = reduce(&measured, Reduction { region: Some(2), ..all }).unwrap_err();
        assert_eq!(none, ReductionError::UnknownRegion { region: 2, regions: 2 });
    }

    #[test]
    fn false_alarms_are_neither_rows_nor_silent() {
        let measured = mannequin(2e-3, 3).with_false_alarms(10, 3);
        let reduced = reduce(&measured, Reduction::default()).unwrap();
        // A tenth of the points, and a window of ±10 mm in a metre.
        let alarms = measured.cloud.points().len().div_ceil(10);
        let left = reduced.left_out.off_surface + reduced.left_out.missed;
        assert!(left as f64 > 0.95 * alarms as f64, "{left} of {alarms}");
        let numbers: HashSet<u32> =
            measured.cloud.points().iter().filter_map(|point| point.chirp).collect();
        let mut silent = reduced.curve.observations.iter().filter(|row| row.is_censored());
        assert!(silent.all(|row| !numbers.contains(&row.chirp.unwrap())));
    }

    #[test]
    fn the_curve_says_how_its_target_was_lit() {
        let measured = mannequin(2e-3, 1);
        let lit = reduce(&measured, Reduction::default()).unwrap().curve.illumination;
        assert_eq!(lit.footprint, Some(Footprint::Paper));
        // λ/(2π·13.589 mm) at the centre and at the focus; the spot grows to 1.5 times that 0.5 m away.
        let beam_rad = lit.beam_rad.unwrap();
        assert!((0.6 * 0.011704..0.011704).contains(&beam_rad), "{beam_rad}");
    }

    #[test]
    fn one_power_reduced_in_both_forms_differs_by_the_cosine() {
        let at = |footprint| {
            let radar = Radar { footprint, ..Default::default() };
            let (link, origin) = (Link::new(&radar), radar.frames().origin());
            let axis =
                Ray { origin, direction: origin.towards(Point::new(0.1, 1.0, 0.0)).unwrap() };
            sigma0(&link, &axis, 8.2, 0.5, 1e-9)
        };
        let ratio = at(Footprint::Projected) / at(Footprint::Paper);
        assert!((ratio - 0.5).abs() < 1e-12, "3 dB at 60°: {ratio}");
        let there = Footprint::Paper.factor_to(Footprint::Projected, 0.5);
        let back = Footprint::Projected.factor_to(Footprint::Paper, 0.5);
        assert_eq!((there, there * back), (0.5, 1.0));
    }

    #[test]
    fn both_footprints_give_back_f() {
        for (footprint, air_loss_db_per_m) in
            [(Footprint::Paper, 0.0), (Footprint::Projected, 0.0), (Footprint::Paper, 0.7)]
        {
            let radar = Radar { footprint, air_loss_db_per_m, ..Default::default() };
            let (link, origin) = (Link::new(&radar), radar.frames().origin());
            let direction = origin.towards(Point::new(0.1, 1.0, 0.0)).unwrap();
            let axis = Ray { origin, direction };
            let power_w = link.power_w(&link.beam.along(&axis), 8.2, 0.3, 0.07);
            let expected = 4.0 * PI * 0.07 * 0.09;
            assert!((sigma0(&link, &axis, 8.2, 0.3, power_w) / expected - 1.0).abs() < 1e-12);
        }
    }
}
