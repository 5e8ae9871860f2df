//! A measured cloud against the chirps of its scan: which point is the detection of which chirp.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::alarms::{Alarms, MOST_OVER_THRESHOLD, odds};
use super::beside::{Beside, GATE_M, SHELLS_M, lengths_near_m, reach};
use super::error::DiagnoseError;
use super::observation::{NO_LIMIT_W, Observation};
use crate::effects::{Antenna, BeamSpot, Model, Shot, Stage};
use crate::frames::{Global, Point, Ray};
use crate::measure::cloud::{Cloud, CloudPoint};
use crate::measure::median_point;
use crate::measure::nearest::Nearest;
use crate::radar::{Chirps, Returns};

/// Share of a cloud off the target from which it is a cloud of another target.
pub(super) const MOST_STRAYS: f64 = 0.25;
/// Largest distance of a detection from its chirp's ray, m: less than from one chirp to the next.
const ON_RAY_M: f64 = 0.01;

/// A detection that belongs to no shot: its chirp misses the target, or meets it at another range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// Its chirp, with range 0 where that misses; none where the scan has no such chirp.
    pub shot: Option<Shot>,
    /// Range of the detection, m.
    pub range_m: f64,
}

impl Stray {
    /// Whether the detection lies beside an edge of the target where the effects of a model place it, within the reach of the
    /// radar's own beam.
    pub(super) fn is_beside_edge(&self, model: &Model, stage: &Stage) -> bool {
        let beam = own_beam(stage);
        self.shot.is_some_and(|shot| shot.misses())
            && self.is_on_target(&with_own_beam(model, &beam), stage)
    }

    /// Whether the detection lies on the target where the effects of a model place it.
    pub(super) fn is_on_target(&self, model: &Model, stage: &Stage) -> bool {
        let ranges_m = self.shot.map_or(Vec::new(), |shot| model.ranges_m(stage, &shot));
        ranges_m.iter().any(|range_m| (range_m - self.range_m).abs() <= GATE_M)
    }
}

/// The points of a cloud, assigned to the shots of its scan.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudMatch {
    /// One for each shot.
    pub observations: Vec<Observation>,
    /// Detections that belong to no shot and are no false alarms.
    pub strays: Vec<Stray>,
    /// What the chirps report that see no target.
    pub alarms: Alarms,
}

/// What a radar reports.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reported {
    /// Up to four times this power a detection without a target may be a false alarm, W.
    pub threshold_w: f64,
    /// Which detections of a chirp.
    pub returns: Returns,
    /// The antenna of the cloud; none for the radar's own.
    pub antenna: Option<Antenna>,
    /// Length of a range cell, and how far a spot spreads in range on a slope of 45°, m, of a radar that reports its strongest
    /// detection and whose receiver parts second-order paths from the first surface: a detection farther than that by
    /// more than the two is by such a path, and the first surface then was weaker.
    pub parted_m: Option<[f64; 2]>,
    /// Range cells of the gate; none where it is not declared.
    pub gate_cells: Option<f64>,
    /// Length of a range cell, m.
    pub cell_m: f64,
}

/// Assigns the points of a cloud to the shots of its scan, by chirp numbers or, without them, by directions. The shots of one chirp
/// follow each other, and a point is of the one to which it is nearest. Of several
/// detections of a chirp that reports all, the one nearest to the target is its echo. A detection
/// farther than 0.1 m from where its chirp meets the target is a stray or, up to 6 dB above the threshold, a false alarm. Its
/// chirp then counts as silent: an echo is weaker than the false alarm that was reported as the strongest, and unknown
/// behind the one that was reported as the first.
///
/// # Errors
/// When points have no chirp number and no direction from a common origin, when they lie on the rays of
/// other chirps than their numbers state, or when more than a quarter are further points of their chirps, or are
/// neither on the target nor past its edge by a wide spot.
pub fn match_cloud(
    cloud: &Cloud,
    chirps: &Chirps,
    shots: &[Shot],
    reported: Reported,
) -> Result<CloudMatch, DiagnoseError> {
    let index_of_chirp = chirps.number.iter().copied().zip(0..).collect();
    let directions = Directions::new(chirps);
    Scan { chirps, index_of_chirp, reported, directions }.match_cloud(cloud, shots)
}

/// An assignment and its quality.
struct Assignment {
    cloud_match: CloudMatch,
    /// Detections on the target, one per chirp.
    on_target: usize,
    /// Further detections of chirps that already have one.
    second: usize,
    /// Number of chirps that meet the target, and of those that miss it.
    sent: [usize; 2],
}

impl Assignment {
    /// Whether most of the cloud is of the target. False alarms are nobody's, as long as they are not the most of what chirps
    /// report that meet the target. Such chirps speak no less often than others, but for chance.
    fn is_of_target(&self, cloud: &Cloud) -> bool {
        let points = cloud.points().len();
        let (alarms, of_misses) =
            (self.cloud_match.alarms.count(), self.cloud_match.alarms.of_misses.len());
        let others = points - self.on_target;
        let of_hits = points - of_misses;
        let [hits, misses] = self.sent;
        (others - alarms.min(others)) as f64 <= MOST_STRAYS * (points - alarms) as f64
            && alarms - of_misses <= of_hits / 2
            && 2 * of_hits * misses >= of_misses * hits
    }
}

/// The chirps of a scan, by number and by direction.
struct Scan<'a> {
    chirps: &'a Chirps,
    index_of_chirp: HashMap<u32, usize>,
    reported: Reported,
    /// `None` unless all rays start from one point.
    directions: Option<Directions>,
}

impl Scan<'_> {
    /// Assigns the points of a cloud to the shots.
    fn match_cloud(&self, cloud: &Cloud, shots: &[Shot]) -> Result<CloudMatch, DiagnoseError> {
        let is_numbered = cloud.points().iter().all(|point| point.chirp.is_some());
        if !is_numbered && self.directions.is_none() {
            return Err(DiagnoseError::Unnumbered);
        }
        if is_numbered && let Some(off) = self.number_off(cloud) {
            return Err(DiagnoseError::Misnumbered { off });
        }
        let own = self.assign(cloud, shots, is_numbered);
        if own.is_of_target(cloud) {
            return Ok(own.cloud_match);
        }
        let (matched, points) = (own.on_target, cloud.points().len());
        if own.second as f64 > MOST_STRAYS * points as f64 {
            return Err(DiagnoseError::Repeated { second: own.second, points });
        }
        // Row numbers are not the chirps of the scan; a cloud that is only out of place keeps its chirps.
        if is_numbered && self.directions.is_some() && !self.is_shifted(cloud) {
            let by_direction = self.assign(cloud, shots, false);
            if by_direction.is_of_target(cloud) {
                let placed = by_direction.on_target;
                return Err(DiagnoseError::Strange { placed, matched, points });
            }
        }
        Err(DiagnoseError::Elsewhere { matched, points })
    }

    /// Whether a point is by way of a second surface, in place of the first one that its shot meets.
    fn is_by_second(&self, point: &CloudPoint, shot: &Shot) -> bool {
        let Some([cell_m, spot_m]) = self.reported.parted_m else { return false };
        let slope = shot.hit.theta_rad().tan();
        let farther_m = self.range_m(point, shot) - self.expected_m(shot);
        farther_m > cell_m + spot_m * slope && off_ray_m(point, &shot.ray).length() <= ON_RAY_M
    }

    /// The ray of a chirp.
    fn ray(&self, chirp: u32) -> Option<&Ray<Global>> {
        self.chirps.rays.get(*self.index_of_chirp.get(&chirp)?)
    }

    /// The chirp in whose direction a point lies.
    fn chirp_towards(&self, point: Point<Global>) -> Option<u32> {
        self.directions.as_ref()?.chirp(self.chirps, point)
    }

    /// Range of a point, m: half of the way to the antenna.
    fn range_m(&self, point: &CloudPoint, shot: &Shot) -> f64 {
        let (radar, there) = (shot.ray.origin, point.point);
        point.range_m.unwrap_or_else(|| match self.reported.antenna {
            None => radar.distance_m(there),
            Some(antenna) => antenna.half_way_m(radar, there),
        })
    }

    /// Range at which a chirp meets the target, m: half of the way to the antenna.
    fn expected_m(&self, shot: &Shot) -> f64 {
        let way_m = self.reported.antenna.map_or(shot.hit.range_m, |antenna| {
            antenna.half_way_m(shot.ray.origin, shot.hit.point)
        });
        way_m + shot.longer_m
    }

    /// Distance of a point from where its chirp meets the target: in range and across the ray, m.
    fn off_m(&self, point: &CloudPoint, shot: &Shot) -> f64 {
        let off_m = (self.range_m(point, shot) - self.expected_m(shot)).abs();
        off_m + off_ray_m(point, &shot.ray).length()
    }

    /// Whether most points lie off the rays of their chirps by one common shift.
    fn is_shifted(&self, cloud: &Cloud) -> bool {
        let shifts: Vec<DVec3> = cloud
            .points()
            .iter()
            .filter_map(|point| Some(off_ray_m(point, self.ray(point.chirp?)?)))
            .collect();
        let shift = median_point(&shifts);
        let alike = shifts.iter().filter(|own| own.distance(shift) <= GATE_M).count();
        alike as f64 >= (1.0 - MOST_STRAYS) * cloud.points().len() as f64
    }

    /// By how much most chirp numbers are too high; `None` unless the same number is for most points. A cloud that is
    /// out of place lies on rays to either side, as the scan goes to and fro. A cloud on its own rays
    /// may also lie on those of a second pass.
    fn number_off(&self, cloud: &Cloud) -> Option<i64> {
        let offs: Vec<i64> =
            cloud.points().par_iter().filter_map(|point| self.number_off_of(point)).collect();
        let mut counts: HashMap<i64, usize> = HashMap::new();
        for off in offs {
            *counts.entry(off).or_default() += 1;
        }
        let (off, count) = counts.into_iter().max_by_key(|(off, count)| (*count, *off))?;
        (off != 0 && 2 * count > cloud.points().len()).then_some(off)
    }

    /// By how much the chirp number of a point is higher than that of the nearest ray; 0 where its own is as near.
    fn number_off_of(&self, point: &CloudPoint) -> Option<i64> {
        /// The rounding of a point by f32 in a file.
        const NEARER_M: f64 = 1e-5;
        let (own, nearest) = (point.chirp?, self.chirp_towards(point.point)?);
        if let (Some(own_ray), Some(nearest_ray)) = (self.ray(own), self.ray(nearest)) {
            let [own_m, nearest_m] =
                [own_ray, nearest_ray].map(|ray| off_ray_m(point, ray).length());
            if own_m <= nearest_m + NEARER_M {
                return Some(0);
            }
        }
        Some(i64::from(own) - i64::from(nearest))
    }

    /// The points of a cloud with their chirps, and of the shots of each that to which it is nearest. Where a chirp reports all
    /// its detections, those nearest to the target come first.
    fn in_order<'c>(
        &self,
        cloud: &'c Cloud,
        by_number: bool,
        shots: &[Shot],
        shots_of_chirp: &HashMap<u32, Range<usize>>,
    ) -> Vec<(&'c CloudPoint, Option<u32>, Option<usize>)> {
        let mut points = Vec::with_capacity(cloud.points().len());
        for point in cloud.points() {
            let chirp = if by_number { point.chirp } else { self.chirp_towards(point.point) };
            let own = chirp.and_then(|chirp| shots_of_chirp.get(&chirp)).cloned();
            let off_m = |index: usize| self.off_m(point, &shots[index]);
            let nearest = own.into_iter().flatten().min_by(|a, b| off_m(*a).total_cmp(&off_m(*b)));
            points.push((point, chirp, nearest));
        }
        if self.reported.returns == Returns::All {
            points.sort_by_cached_key(|(point, _, nearest)| {
                let off_m = nearest.map_or(0.0, |index| self.off_m(point, &shots[index]));
                // Of distances, which are positive, the bits have the same order.
                off_m.to_bits()
            });
        }
        points
    }

    /// States what the echoes of one chirp stayed below because of the one that was reported: below it where that is the
    /// strongest, and anything behind it where that is the first.
    fn limit_others(&self, shots: &[Shot], observations: &mut [Observation]) {
        let Some(reported) = observations.iter().position(|one| one.power_w.is_some()) else {
            return;
        };
        let behind_m = self.expected_m(&shots[reported]);
        let limit_w = match self.reported.returns {
            Returns::Strongest => observations[reported].power_w,
            Returns::First => Some(NO_LIMIT_W),
            Returns::All => None,
        };
        for (shot, other) in shots.iter().zip(observations) {
            let is_hidden =
                self.reported.returns == Returns::Strongest || self.expected_m(shot) > behind_m;
            if other.power_w.is_none() && is_hidden {
                other.limit_w = limit_w.or(other.limit_w);
            }
        }
    }

    /// The highest power of a false alarm, W.
    fn most_alarm_w(&self) -> f64 {
        MOST_OVER_THRESHOLD * self.reported.threshold_w
    }

    /// Whether a detection away from the target may be of noise: on its chirp's ray, at most 6 dB above the threshold, and the
    /// first such of its chirp unless all detections are reported. `spoke`: the chirps that have one.
    fn is_alarm(&self, point: &CloudPoint, shot: &Shot, spoke: &mut HashSet<u32>) -> bool {
        off_ray_m(point, &shot.ray).length() <= ON_RAY_M
            && point.power_w <= self.most_alarm_w()
            && (spoke.insert(shot.chirp) || self.reported.returns == Returns::All)
    }

    /// Assigns points to chirps by their numbers or by their directions. A stray still counts for the target
    /// where it lies on its chirp's ray and near where other chirps meet the target: a wide spot sees past the edge.
    fn assign(&self, cloud: &Cloud, shots: &[Shot], by_number: bool) -> Assignment {
        let mut shots_of_chirp: HashMap<u32, Range<usize>> = HashMap::new();
        for (index, shot) in shots.iter().enumerate() {
            shots_of_chirp.entry(shot.chirp).or_insert(index..index).end = index + 1;
        }
        let progress = self.chirps.progress();
        let places: Vec<DVec3> = shots.iter().map(|shot| shot.hit.point.xyz).collect();
        let target = Nearest::new(&places);
        let mut observations = vec![Observation::default(); shots.len()];
        let (mut strays, mut on_target, mut second) = (Vec::new(), 0, 0);
        let (mut past_the_edge, mut chirps_with_points) = (HashSet::new(), HashSet::new());
        let mut spoke = HashSet::new();
        let mut beside = Vec::new();
        let Reported { returns, gate_cells: cells, cell_m, .. } = self.reported;
        let mut alarms = Alarms { weight: 1.0, returns, cells, cell_m, ..Alarms::default() };
        let points = self.in_order(cloud, by_number, shots, &shots_of_chirp);
        let mut powers_of_chirp: HashMap<u32, Vec<f64>> = HashMap::new();
        if returns == Returns::All {
            for (point, chirp, _) in &points {
                let own = chirp.map(|chirp| powers_of_chirp.entry(chirp).or_default());
                own.into_iter().for_each(|own| own.push(point.power_w));
            }
        }
        for (point, chirp, index) in points {
            chirps_with_points.extend(chirp);
            if let Some((shot, observation)) =
                index.and_then(|index| Some((shots.get(index)?, observations.get_mut(index)?)))
            {
                // The chirp meets the target.
                let range_m = self.range_m(point, shot);
                let is_near = self.off_m(point, shot) <= GATE_M;
                let is_first = observation.power_w.is_none();
                if is_first && self.is_by_second(point, shot) {
                    on_target += 1;
                    observation.limit_w = Some(point.power_w);
                } else if is_near && is_first {
                    on_target += 1;
                    *observation = Observation {
                        point: Some(point.point),
                        rank: powers_of_chirp.get(&shot.chirp).map(|powers_w| {
                            1 + powers_w.iter().filter(|other| **other > point.power_w).count()
                                as u32
                        }),
                        ..Observation::detected(point.power_w, Some(range_m))
                    };
                    // Noise hardly ever reaches more.
                    if self.reported.returns == Returns::Strongest
                        && point.power_w <= self.most_alarm_w()
                    {
                        alarms.stronger_w.push(point.power_w);
                    }
                } else if (!is_near || self.reported.returns == Returns::All)
                    && self.is_alarm(point, shot, &mut spoke)
                {
                    let own = shots_of_chirp.get(&shot.chirp).cloned().unwrap_or_default();
                    for (shot, one) in shots[own.clone()].iter().zip(&mut observations[own]) {
                        let is_open = one.power_w.is_none();
                        match self.reported.returns {
                            Returns::Strongest if is_open => one.limit_w = Some(point.power_w),
                            Returns::First if is_open && range_m < self.expected_m(shot) => {
                                one.limit_w = Some(NO_LIMIT_W);
                            }
                            _ => {}
                        }
                    }
                    if self.reported.returns == Returns::First {
                        alarms.of_target += 1;
                    } else {
                        alarms.powers_w.push(point.power_w);
                    }
                } else {
                    second += usize::from(is_near);
                    strays.push(Stray { shot: Some(*shot), range_m });
                }
            } else {
                // The chirp misses, or the scan has no such chirp.
                let sent = chirp.and_then(|chirp| self.index_of_chirp.get(&chirp).copied());
                let shot = sent.map(|index| Shot::missed(self.chirps, index, progress[index]));
                let range_m = shot.map_or(0.0, |shot| self.range_m(point, &shot));
                if let Some(shot) = shot {
                    let may_be_alarm = self.is_alarm(point, &shot, &mut spoke);
                    let power_w = point.power_w;
                    if let Some(off_m) = off_target_m(point, &shot, target.as_ref()) {
                        beside.push(Beside { shot, range_m, power_w, off_m, may_be_alarm });
                        continue;
                    } else if may_be_alarm {
                        alarms.powers_w.push(power_w);
                        alarms.of_misses.push((shot, range_m));
                        continue;
                    }
                }
                strays.push(Stray { shot, range_m });
            }
        }
        let rays = self.chirps.rays.iter().zip(&self.chirps.number);
        let (missing, numbers): (Vec<&Ray<Global>>, Vec<&u32>) =
            rays.filter(|(_, number)| !shots_of_chirp.contains_key(*number)).unzip();
        let lengths_m = lengths_near_m(&missing, shots, target.as_ref());
        let near = reach(&beside, lengths_m, &alarms);
        alarms.near_m = lengths_m[near];
        for Beside { shot, range_m, power_w, off_m, .. } in beside {
            if off_m > SHELLS_M[near] {
                alarms.powers_w.push(power_w);
                alarms.of_misses.push((shot, range_m));
                continue;
            }
            let is_first = past_the_edge.insert(shot.chirp);
            on_target += usize::from(is_first);
            second += usize::from(!is_first);
            strays.push(Stray { shot: Some(shot), range_m });
        }
        for own in shots_of_chirp.values().filter(|own| own.len() > 1) {
            self.limit_others(&shots[own.clone()], &mut observations[own.clone()]);
        }
        let spoke_not = numbers.into_iter().filter(|number| !chirps_with_points.contains(*number));
        alarms.silent_misses = spoke_not.count();
        alarms.silent = match self.reported.returns {
            // Chirps without any detection.
            Returns::Strongest => self.chirps.rays.len().saturating_sub(chirps_with_points.len()),
            Returns::First => alarms.silent_misses,
            Returns::All => self.chirps.rays.len(),
        };
        let cloud_match = CloudMatch { observations, strays, alarms };
        Assignment { cloud_match, on_target, second, sent: [shots_of_chirp.len(), missing.len()] }
    }
}

/// The directions of a scan whose rays start from one point.
struct Directions {
    origin: Point<Global>,
    tree: Nearest,
}

impl Directions {
    fn new(chirps: &Chirps) -> Option<Directions> {
        const APART_M: f64 = 1e-6;
        let origin = chirps.rays.first()?.origin;
        let common = chirps.rays.iter().all(|ray| ray.origin.distance_m(origin) < APART_M);
        let directions: Vec<DVec3> = chirps.rays.iter().map(|ray| ray.direction.xyz()).collect();
        let tree = Nearest::new(&directions)?;
        common.then_some(Directions { origin, tree })
    }

    fn chirp(&self, chirps: &Chirps, point: Point<Global>) -> Option<u32> {
        let direction = self.origin.towards(point)?;
        chirps.number.get(self.tree.find(direction.xyz()).0).copied()
    }
}

/// Distance of a point on its chirp's ray from the target, m, which that ray misses; none where it is not near.
fn off_target_m(point: &CloudPoint, shot: &Shot, target: Option<&Nearest>) -> Option<f64> {
    let nearest_m = target.map_or(f64::INFINITY, |target| target.find(point.point.xyz).1);
    (nearest_m <= GATE_M && off_ray_m(point, &shot.ray).length() <= ON_RAY_M).then_some(nearest_m)
}

/// How many false alarms lie beside an edge by chance, where others do not; 0 where the length of the gate is unknown.
pub(super) fn expected_beside_edge(alarms: &Alarms, model: &Model, stage: &Stage) -> f64 {
    let Some(gate_m) = alarms.gate_m() else { return 0.0 };
    let beam = own_beam(stage);
    let model = with_own_beam(model, &beam);
    let chances = alarms.of_misses.par_iter().map(|(shot, _)| {
        let mut edges_m = model.ranges_m(stage, shot);
        edges_m.sort_by(f64::total_cmp);
        let apart_m = edges_m.windows(2).map(|pair| (pair[1] - pair[0]).min(2.0 * GATE_M));
        let near_m = apart_m.sum::<f64>() + if edges_m.is_empty() { 0.0 } else { 2.0 * GATE_M };
        odds(near_m, gate_m)
    });
    chances.sum()
}

/// The radar's own beam, which reads ranges as a radar without a range receiver does.
fn own_beam(stage: &Stage) -> BeamSpot {
    BeamSpot { diameter_m: stage.geometry.radar.spot_fwhm_m(), cell: None }
}

/// A model whose chirps see all that the radar's own beam reaches.
fn with_own_beam<'a>(model: &Model<'a>, beam: &'a BeamSpot) -> Model<'a> {
    let mut model = model.clone();
    model.effects.push((beam, Vec::new()));
    model
}

/// The shortest way from a ray to a point, m.
fn off_ray_m(point: &CloudPoint, ray: &Ray<Global>) -> DVec3 {
    let along = ray.direction.xyz();
    let from_origin = point.point.xyz - ray.origin.xyz;
    from_origin - from_origin.dot(along) * along
}
