//! From a scan and a measured cloud to what every chirp has seen.
//!
//! The scan pattern is known, so that every chirp is traced against the target. One that should have
//! hit and gave no detection is evidence too: its power stayed below the threshold.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use rayon::prelude::*;

use super::DiagnoseError;
use crate::effects::{Model, Shot, Stage};
use crate::frames::{Direction, Global, Point, Pose, Ray};
use crate::measure::cloud::{Cloud, CloudPoint};
use crate::measure::median_point;
use crate::measure::nearest::Nearest;
use crate::radar::{Chirps, Radar};
use crate::render::{LocalFrame, trace};
use crate::trace::{Hit, ScanGeometry};

/// What one chirp that should hit the target has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Received power, W; `None` where nothing was detected.
    pub power_w: Option<f64>,
    /// Range, m; `None` where nothing was detected or the cloud does not tell.
    pub range_m: Option<f64>,
}

/// A detection that is no shot's: its chirp meets no target, or one at another range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// The chirp; of no range where it misses, and none where the scan has no such chirp.
    pub shot: Option<Shot>,
    /// Range of the detection, m.
    pub range_m: f64,
}

impl Stray {
    /// Whether it lies on the target where the effects of a model place it.
    pub(super) fn is_on_target(&self, model: &Model, stage: &Stage) -> bool {
        let ranges_m = self.shot.map_or(Vec::new(), |shot| model.ranges_m(stage, &shot));
        ranges_m.iter().any(|range_m| (range_m - self.range_m).abs() <= GATE_M)
    }
}

/// A cloud sorted by the shots of its scan.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudMatch {
    /// One for each shot.
    pub observations: Vec<Observation>,
    /// Detections that are no shot's.
    pub strays: Vec<Stray>,
}

/// Share of a cloud beside the target, from which it is not of this target.
pub(super) const MOST_STRAYS: f64 = 0.25;
/// Detections further than this from where their chirp meets the target are not from there, m.
const GATE_M: f64 = 0.1;
/// Nearer than this to a chirp's ray a detection is that chirp's, m: less than from one chirp to the next.
const ON_RAY_M: f64 = 0.01;

/// One shot, along the axis of the beam, for every chirp that meets the target.
///
/// # Errors
/// When no chirp does.
pub fn trace_shots(
    stage: &Stage,
    radar: &Radar,
    chirps: &Chirps,
) -> Result<Vec<Shot>, DiagnoseError> {
    let footprints = trace(&ScanGeometry { radar, chirps, ..stage.geometry }, 1, &|_| {})?;
    let places: Vec<_> = chirps.target_points_m(&radar.frames()).collect();
    let progress = chirps.progress();
    let shot = |index: usize| {
        let hit = (*footprints.hits.get(index)?)?;
        let ray = *chirps.rays.get(index)?;
        let region = stage.geometry.region_of_facet.get(hit.facet as usize).copied().unwrap_or(0);
        let grain = stage.grain_of_region.get(usize::from(region)).copied();
        let back = -ray.direction.xyz();
        let frame =
            LocalFrame::new(stage.geometry.bvh.mesh(), &hit, back, grain.unwrap_or(DVec3::Y));
        let towards: Direction<_> = frame.local(back);
        let [x, y, _] = towards.xyz().to_array();
        let place = places.get(index)?;
        Some(Shot {
            hit,
            normal: frame.normal,
            azimuth_rad: y.atan2(x),
            region,
            xt_m: place.x,
            yt_m: place.y,
            edge_m: footprints.edge_m.get(index).copied().unwrap_or(0.0),
            ..missed(chirps, &progress, index)?
        })
    };
    Ok((0..chirps.rays.len()).into_par_iter().filter_map(shot).collect())
}

/// Sorts a cloud by the shots of its scan, by chirp numbers or, without them, by directions. A detection
/// further than 0.1 m from where its chirp meets the target, or beside its ray, is a stray, and its chirp then counts as
/// one that saw nothing.
///
/// # Errors
/// When points have no chirp number and no direction from a common origin, when they lie on the rays of
/// other chirps than their numbers say, when more than a quarter are second ones of their chirps, or is
/// neither on the target nor past its edge by a wide spot.
pub fn match_cloud(
    cloud: &Cloud,
    chirps: &Chirps,
    shots: &[Shot],
) -> Result<CloudMatch, DiagnoseError> {
    let is_numbered = cloud.points().iter().all(|point| point.chirp.is_some());
    let directions = Directions::new(chirps);
    let directions = directions.as_ref();
    if !is_numbered && directions.is_none() {
        return Err(DiagnoseError::Unnumbered);
    }
    let off = directions.filter(|_| is_numbered).and_then(|by| by.number_off(chirps, cloud));
    off.map_or(Ok(()), |off| Err(DiagnoseError::Misnumbered { off }))?;
    let given = sorted(cloud, chirps, shots, directions.filter(|_| !is_numbered));
    if given.is_of_target(cloud) {
        return Ok(given.matched);
    }
    let (matched, points) = (given.on_target, cloud.points().len());
    if given.second as f64 > MOST_STRAYS * points as f64 {
        return Err(DiagnoseError::Repeated { second: given.second, points });
    }
    // Rows that somebody counted are no chirps of the scan; a cloud that is only out of place keeps its own.
    let is_strange = is_numbered && !is_moved(cloud, chirps);
    let placed = directions.filter(|_| is_strange).map(|by| sorted(cloud, chirps, shots, Some(by)));
    match placed.filter(|placed| placed.is_of_target(cloud)) {
        Some(placed) => Err(DiagnoseError::Strange { placed: placed.on_target, matched, points }),
        None => Err(DiagnoseError::Elsewhere { matched, points }),
    }
}

/// Whether most points lie beside the rays of their chirps by one and the same shift.
fn is_moved(cloud: &Cloud, chirps: &Chirps) -> bool {
    let index_of_sent: HashMap<u32, usize> = chirps.number.iter().copied().zip(0..).collect();
    let shift = |point: &CloudPoint| {
        Some(beside(point, chirps.rays.get(*index_of_sent.get(&point.chirp?)?)?))
    };
    let shifts: Vec<DVec3> = cloud.points().iter().filter_map(shift).collect();
    let shift = median_point(&shifts);
    let alike = shifts.iter().filter(|own| own.distance(shift) <= GATE_M).count();
    alike as f64 >= (1.0 - MOST_STRAYS) * cloud.points().len() as f64
}

/// A cloud sorted by shots, and how well that went.
struct Sorted {
    matched: CloudMatch,
    /// Detections on the target, one of a chirp.
    on_target: usize,
    /// Further ones of chirps that have one.
    second: usize,
}

impl Sorted {
    fn is_of_target(&self, cloud: &Cloud) -> bool {
        let points = cloud.points().len();
        (points - self.on_target) as f64 <= MOST_STRAYS * points as f64
    }
}

/// Gives points to chirps by their directions, or by their numbers. A stray still speaks for the target
/// where it lies on its chirp's ray and by what others meet: a wide spot sees past the edge.
fn sorted(
    cloud: &Cloud,
    chirps: &Chirps,
    shots: &[Shot],
    by_direction: Option<&Directions>,
) -> Sorted {
    let index_of_chirp: HashMap<u32, usize> =
        shots.iter().enumerate().map(|(index, shot)| (shot.chirp, index)).collect();
    let index_of_sent: HashMap<u32, usize> = chirps.number.iter().copied().zip(0..).collect();
    let progress = chirps.progress();
    let mut observations = vec![Observation::default(); shots.len()];
    let (mut strays, mut on_target, mut second) = (Vec::new(), 0, 0);
    let places: Vec<DVec3> = shots.iter().map(|shot| shot.hit.point.xyz).collect();
    let met = Nearest::new(&places);
    let is_by_target = |point: &CloudPoint, shot: &Shot| {
        let nearest_m = met.as_ref().map_or(f64::INFINITY, |met| met.find(point.point.xyz).1);
        nearest_m <= GATE_M && beside(point, &shot.ray).length() <= ON_RAY_M
    };
    let mut past_the_edge = HashSet::new();
    for point in cloud.points() {
        let chirp = match by_direction {
            Some(directions) => directions.chirp(chirps, point.point),
            None => point.chirp,
        };
        let index = chirp.and_then(|chirp| index_of_chirp.get(&chirp).copied());
        let seen = index.and_then(|index| Some((shots.get(index)?, observations.get_mut(index)?)));
        match seen {
            None => {
                let sent = chirp.and_then(|chirp| index_of_sent.get(&chirp).copied());
                let shot = sent.and_then(|index| missed(chirps, &progress, index));
                let range_m = shot.map_or(0.0, |shot| range_m(point, &shot));
                if let Some(shot) = shot.filter(|shot| is_by_target(point, shot)) {
                    let is_first = past_the_edge.insert(shot.chirp);
                    on_target += usize::from(is_first);
                    second += usize::from(!is_first);
                }
                strays.push(Stray { shot, range_m });
            }
            Some((shot, observation)) => {
                let range_m = range_m(point, shot);
                match (off_m(point, shot) <= GATE_M, observation.power_w) {
                    (true, None) => {
                        on_target += 1;
                        let power_w = Some(point.power_w);
                        *observation = Observation { power_w, range_m: Some(range_m) };
                    }
                    (is_near, _) => {
                        second += usize::from(is_near);
                        strays.push(Stray { shot: Some(*shot), range_m });
                    }
                }
            }
        }
    }
    Sorted { matched: CloudMatch { observations, strays }, on_target, second }
}

/// The shot of a chirp that meets nothing.
pub(super) fn missed(chirps: &Chirps, progress: &[f64], index: usize) -> Option<Shot> {
    let ray = *chirps.rays.get(index)?;
    let hit = Hit { facet: u32::MAX, range_m: 0.0, point: ray.origin, cos_theta: 1.0 };
    Some(Shot {
        chirp: *chirps.number.get(index)?,
        time_s: chirps.time_s.get(index).copied().unwrap_or(0.0),
        progress: *progress.get(index)?,
        ray,
        hit,
        normal: -ray.direction.xyz(),
        target: Pose::NONE,
        azimuth_rad: 0.0,
        region: 0,
        xt_m: 0.0,
        yt_m: 0.0,
        edge_m: 0.0,
    })
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

    /// By how much most chirp numbers are too high; `None` where they are not, all alike. A cloud that is
    /// out of place lies on rays to either side, as the scan goes to and fro, and one that lies on its own rays
    /// may lie on those of a second pass as well.
    fn number_off(&self, chirps: &Chirps, cloud: &Cloud) -> Option<i64> {
        /// As much nearer to another ray as f32 in a file may round a point.
        const NEARER_M: f64 = 1e-5;
        let index_of_sent: HashMap<u32, usize> = chirps.number.iter().copied().zip(0..).collect();
        let beside_m = |point: &CloudPoint, chirp: u32| {
            let ray = chirps.rays.get(*index_of_sent.get(&chirp)?)?;
            Some(beside(point, ray).length())
        };
        let off = |point: &CloudPoint| {
            let (own, nearest) = (point.chirp?, self.chirp(chirps, point.point)?);
            let is_own = beside_m(point, own)
                .zip(beside_m(point, nearest))
                .is_some_and(|(own_m, nearest_m)| own_m <= nearest_m + NEARER_M);
            Some(if is_own { 0 } else { i64::from(own) - i64::from(nearest) })
        };
        let mut counts: HashMap<i64, usize> = HashMap::new();
        for off in cloud.points().par_iter().filter_map(off).collect::<Vec<_>>() {
            *counts.entry(off).or_default() += 1;
        }
        let (off, count) = counts.into_iter().max_by_key(|(off, count)| (*count, *off))?;
        (off != 0 && 2 * count > cloud.points().len()).then_some(off)
    }
}

fn range_m(point: &CloudPoint, shot: &Shot) -> f64 {
    point.range_m.unwrap_or_else(|| shot.ray.origin.distance_m(point.point))
}

/// Where a point lies beside a ray, m.
fn beside(point: &CloudPoint, ray: &Ray<Global>) -> DVec3 {
    let along = ray.direction.xyz();
    let from_origin = point.point.xyz - ray.origin.xyz;
    from_origin - from_origin.dot(along) * along
}

/// How far a point lies from where its chirp meets the target: along the ray and beside it, m.
fn off_m(point: &CloudPoint, shot: &Shot) -> f64 {
    (range_m(point, shot) - shot.hit.range_m).abs() + beside(point, &shot.ray).length()
}
