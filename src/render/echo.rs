//! An echo and its cause.

use super::detect::Detector;
use super::observer::Observer;
use super::path::Path;
use super::returns::{Measured, Seen};
use super::setup::Setup;
use super::spot::Footprints;
use crate::frames::{Global, Point, Pose, Target};
use crate::trace::Hit;

/// An echo of one chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Chirp number, from 0 or as an explicit scan gives it.
    pub chirp: u32,
    /// The measured position: on the beam's axis, at the measured range.
    pub point: Point<Global>,
    /// Measured range, half the path length from the radar to the antenna, m.
    pub range_m: f64,
    /// x in the target frame, m.
    pub xt_m: f64,
    /// y in the target frame, m.
    pub yt_m: f64,
    /// Received power, W; 0 without an echo.
    pub power_w: f64,
    /// Phase of its beat in the middle of the sweep, rad, −π to π; none where the radar reports no phases.
    pub phase_rad: Option<f64>,
    /// Its place among the echoes of its chirp by power: 1 for the strongest.
    pub rank: u16,
    /// The cause; `None` for a false alarm.
    pub truth: Option<Truth>,
}

/// The cause of an echo: among the paths that the receiver does not separate, the strongest of the kind, single or
/// second-order, that brings more power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// First intersection of the path with the target.
    pub hit: Hit,
    /// Mean power over speckle and noise, W: the sum of those of all paths that the receiver does not separate.
    pub mean_power_w: f64,
    /// Region of that facet.
    pub region: u16,
    /// Standard deviation of the incidence angle over the rays of the spot, rad; 0 for a single ray.
    pub theta_sd_rad: f64,
    /// Azimuth of the radar about the facet's normal, from the grain of its region, rad.
    pub azimuth_rad: f64,
    /// Number of sheets that the radar's ray passes before the first surface: 0 for what lies in front.
    pub sheets: u8,
    /// Share of the power, 0 to 1, that the sheets on the path let through, there and back.
    pub passed_share: f64,
    /// Number of surfaces on the path: 1 for a single path, 2 for a second-order one.
    pub surfaces: u8,
    /// Share of the power that is specular at every surface of the path, 0 to 1.
    pub specular_share: f64,
    /// Distance in the target plane to the nearest edge in depth, m, at most three spots. Behind sheets it is that of what
    /// lies there.
    pub edge_m: f64,
}

/// Builds echoes from the detections of a receiver.
pub(super) struct Echoes<'a> {
    pub setup: &'a Setup<'a>,
    pub footprints: &'a Footprints,
    pub observer: Observer,
    pub detector: &'a Detector<'a>,
    pub target_from_global: Pose<Target, Global>,
}

impl Echoes<'_> {
    /// Appends the echoes of a chirp, of its paths and of what the receiver has seen of them.
    pub fn append(
        &self,
        chirp: usize,
        hits: &[Option<Hit>],
        paths: &[Path],
        seen: &[Seen],
        found: &mut Vec<Echo>,
    ) {
        if seen.is_empty() {
            found.extend(self.echo(chirp, hits, paths, None));
        }
        let first = found.len();
        for Seen { measured, paths: places } in seen {
            found.extend(self.echo(chirp, hits, &paths[places.clone()], Some(*measured)));
        }
        if seen.len() > 1 {
            rank(&mut found[first..]);
        }
    }

    /// An echo of a chirp: of one that hits the target, however weak, or a false alarm. `None` for any other chirp.
    fn echo(
        &self,
        chirp: usize,
        hits: &[Option<Hit>],
        paths: &[Path],
        seen: Option<Measured>,
    ) -> Option<Echo> {
        let phase_rad = seen.and_then(|seen| seen.phase_rad);
        let seen = seen.map(|seen| seen.detection);
        let detected = seen.filter(|seen| seen.power_w >= self.detector.threshold_w());
        let reach_m = self.detector.reach_m();
        let near = |path: &&Path| match (detected, reach_m) {
            (Some(seen), Some(reach_m)) => (path.range_m - seen.range_m).abs() <= reach_m,
            _ => true,
        };
        let cause = cause(paths, near);
        // Below the threshold a peak may be noise, and the range is taken from the path.
        let range_m = detected.map(|seen| seen.range_m).or(cause.map(|path| path.range_m))?;
        let range_m = if reach_m.is_none() { seen?.range_m } else { range_m };
        let point = self.observer.on_axis(&self.setup.geometry.chirps.rays[chirp], range_m)?;
        let in_target = self.target_from_global * point;
        Some(Echo {
            chirp: self.setup.geometry.chirps.number[chirp],
            point,
            range_m,
            xt_m: in_target.xyz.x,
            yt_m: in_target.xyz.y,
            power_w: seen.map_or(0.0, |seen| seen.power_w),
            phase_rad,
            rank: 1,
            truth: cause.map(|path| {
                let mean_power_w = paths.iter().filter(&near).map(|path| path.power_w).sum();
                self.truth(chirp, hits, path, mean_power_w)
            }),
        })
    }

    fn truth(&self, chirp: usize, hits: &[Option<Hit>], path: &Path, mean_power_w: f64) -> Truth {
        // What lies behind sheets has hits of its own.
        let behind = usize::from(path.sheets).checked_sub(1);
        let behind = behind.map(|number| &self.footprints.behind[number]);
        let hits = behind
            .map_or(hits, |behind| &behind.hits[chirp * hits.len()..(chirp + 1) * hits.len()]);
        let edge_m = behind.map_or(&self.footprints.edge_m, |behind| &behind.edge_m);
        Truth {
            hit: path.hit,
            mean_power_w,
            region: self.setup.geometry.region_of_facet[path.hit.facet as usize],
            theta_sd_rad: theta_sd_rad(hits),
            sheets: path.sheets,
            passed_share: path.passed_share,
            azimuth_rad: path.azimuth_rad,
            surfaces: path.surfaces,
            specular_share: path.specular_share,
            edge_m: edge_m[chirp],
        }
    }
}

/// Numbers echoes from the strongest.
fn rank(echoes: &mut [Echo]) {
    let powers: Vec<f64> = echoes.iter().map(|echo| echo.power_w).collect();
    let mut by_power: Vec<usize> = (0..echoes.len()).collect();
    by_power.sort_by(|&a, &b| powers[b].total_cmp(&powers[a]));
    for (rank, place) in (1..).zip(by_power) {
        echoes[place].rank = rank;
    }
}

/// The strongest path of the kind, single or second-order, that brings more power. Second-order paths are many weak
/// samples of one integral, so that only their sum is comparable with a single path.
fn cause(paths: &[Path], near: impl Fn(&&Path) -> bool) -> Option<&Path> {
    let [direct_w, second_order_w] = [1, 2].map(|surfaces| {
        let of_kind = paths.iter().filter(&near).filter(|path| path.surfaces == surfaces);
        of_kind.map(|path| path.power_w).sum::<f64>()
    });
    let surfaces = if second_order_w > direct_w { 2 } else { 1 };
    let of_kind = paths.iter().filter(&near).filter(|path| path.surfaces == surfaces);
    of_kind.reduce(|a, b| if b.power_w > a.power_w { b } else { a })
}

/// Standard deviation of the incidence angle over the hits of a chirp, rad; 0 for a single ray.
fn theta_sd_rad(hits: &[Option<Hit>]) -> f64 {
    if hits.len() == 1 {
        return 0.0;
    }
    let count = hits.iter().flatten().count() as f64;
    let mean_rad = hits.iter().flatten().map(Hit::theta_rad).sum::<f64>() / count;
    let squares = hits.iter().flatten().map(|hit| (hit.theta_rad() - mean_rad).powi(2));
    (squares.sum::<f64>() / count).sqrt()
}
