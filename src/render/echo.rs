//! An echo and what caused it.

use super::detect::Detector;
use super::observer::Observer;
use super::path::Path;
use super::setup::Setup;
use super::spot::Footprints;
use crate::frames::{Global, Point, Pose, Target};
use crate::radar::Detection;
use crate::trace::Hit;

/// What came back from one chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Chirp number, from 0 or as an explicit scan gives it.
    pub chirp: u32,
    /// Where the radar believes the echo comes from: on the beam's axis, at its range.
    pub point: Point<Global>,
    /// Half the way from the radar to the antenna, m.
    pub range_m: f64,
    /// x in the target frame, m.
    pub xt_m: f64,
    /// y in the target frame, m.
    pub yt_m: f64,
    /// Received power, W; 0 when nothing comes back.
    pub power_w: f64,
    /// What caused it; none for a false alarm.
    pub truth: Option<Truth>,
}

/// What caused an echo: the strongest path of the stronger kind, direct or by way of a second
/// surface, among those that the receiver saw as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Where the path first met the target.
    pub hit: Hit,
    /// Region of that facet.
    pub region: u16,
    /// Standard deviation of the incidence over the rays of the spot, rad; 0 for a single ray.
    pub theta_sd_rad: f64,
    /// Azimuth of the radar about the facet's normal, from the grain of its region, rad.
    pub azimuth_rad: f64,
    /// Surfaces that the path met: 1 for a direct echo, 2 for one by way of another surface.
    pub surfaces: u8,
    /// Share of the power that every surface on the way reflects like a mirror, rough or not.
    pub specular_share: f64,
    /// Distance in the target plane to the nearest edge in depth, m, at most three spots.
    pub edge_m: f64,
}

/// Turns what a receiver saw of a chirp into an echo.
pub(super) struct Echoes<'a> {
    pub setup: &'a Setup<'a>,
    pub footprints: &'a Footprints,
    pub observer: Observer,
    pub detector: &'a Detector,
    pub target_from_global: Pose<Target, Global>,
}

impl Echoes<'_> {
    /// The echo of a chirp that met the target, however weak, or a false alarm.
    pub fn echo(
        &self,
        chirp: usize,
        hits: &[Option<Hit>],
        paths: &[Path],
        seen: Option<Detection>,
    ) -> Option<Echo> {
        let detected = seen.filter(|seen| seen.power_w >= self.detector.threshold_w());
        let reach_m = self.detector.reach_m();
        let near = |path: &&Path| match (detected, reach_m) {
            (Some(seen), Some(reach_m)) => (path.range_m - seen.range_m).abs() <= reach_m,
            _ => true,
        };
        let cause = cause(paths, near);
        // Below the threshold a peak is noise as likely as not; the path says where it would be.
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
            truth: cause.map(|path| self.truth(chirp, hits, path)),
        })
    }

    fn truth(&self, chirp: usize, hits: &[Option<Hit>], path: &Path) -> Truth {
        Truth {
            hit: path.hit,
            region: self.setup.geometry.region_of_facet[path.hit.facet as usize],
            theta_sd_rad: theta_sd_rad(hits),
            azimuth_rad: path.azimuth_rad,
            surfaces: path.surfaces,
            specular_share: path.specular_share,
            edge_m: self.footprints.edge_m[chirp],
        }
    }
}

/// The strongest path of the kind that brings more power. Second-order paths are many weak samples of
/// one integral: only their sum compares with a direct path.
fn cause(paths: &[Path], near: impl Fn(&&Path) -> bool) -> Option<&Path> {
    let [direct_w, second_order_w] = [1, 2].map(|surfaces| {
        let of_kind = paths.iter().filter(&near).filter(|path| path.surfaces == surfaces);
        of_kind.map(|path| path.power_w).sum::<f64>()
    });
    let surfaces = if second_order_w > direct_w { 2 } else { 1 };
    let of_kind = paths.iter().filter(&near).filter(|path| path.surfaces == surfaces);
    of_kind.reduce(|a, b| if b.power_w > a.power_w { b } else { a })
}

fn theta_sd_rad(hits: &[Option<Hit>]) -> f64 {
    if hits.len() == 1 {
        return 0.0;
    }
    let count = hits.iter().flatten().count() as f64;
    let mean_rad = hits.iter().flatten().map(Hit::theta_rad).sum::<f64>() / count;
    let squares = hits.iter().flatten().map(|hit| (hit.theta_rad() - mean_rad).powi(2));
    (squares.sum::<f64>() / count).sqrt()
}
