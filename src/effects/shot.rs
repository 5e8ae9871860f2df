//! The geometry of a chirp, and what all chirps of a scan share.

use glam::DVec3;

use super::antenna::Antenna;
use super::receiver::LEAST_COHERENT;
use crate::brdf::{Brdf, Scattering, widening_rad};
use crate::frames::{Direction, Global, Point, Pose, Ray, Surface};
use crate::radar::{Chirps, GaussianBeam, Link};
use crate::trace::{Hit, ScanGeometry};

/// Facet of a shot that misses the target.
const NO_FACET: u32 = u32::MAX;

/// One chirp and its intersection with the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Number of its scan, from 0: of several scans that are diagnosed together.
    pub scan: u16,
    /// Chirp number.
    pub chirp: u32,
    /// Time of the chirp, s.
    pub time_s: f64,
    /// Share of the scan that is over, 0 to 1, by the chirp's place in it.
    pub progress: f64,
    /// The ray.
    pub ray: Ray<Global>,
    /// Its intersection with the target.
    pub hit: Hit,
    /// Unit normal there, towards the radar.
    pub normal: DVec3,
    /// Motion of the target by effects, from where the scene places it.
    pub target: Pose<Global, Global>,
    /// Azimuth of the radar about the normal, from the grain of the region, rad.
    pub azimuth_rad: f64,
    /// Region of the facet.
    pub region: u16,
    /// x in the target frame of the point of the ray at 8 m, m.
    pub xt_m: f64,
    /// y in the target frame of the point of the ray at 8 m, m.
    pub yt_m: f64,
    /// Distance in the target plane to the nearest edge in depth, m, at most three spots.
    pub edge_m: f64,
    /// Number of sheets in front of the hit.
    pub sheets: u8,
    /// Factor on the power of the echo by sheets: by those in front, and of a sheet by what the radar's sweep reads of it over
    /// what its law says.
    pub by_sheets: f64,
    /// What these seem to add to the range, m.
    pub longer_m: f64,
}

impl Shot {
    /// The shot of a chirp that misses the target, at place 0 of the target frame and with range 0. `index` is that of the
    /// chirp in the scan, and `progress` the share of the scan that is over.
    pub(crate) fn missed(chirps: &Chirps, index: usize, progress: f64) -> Shot {
        let ray = chirps.rays[index];
        Shot {
            scan: 0,
            chirp: chirps.number[index],
            time_s: chirps.time_s.get(index).copied().unwrap_or(0.0),
            progress,
            ray,
            hit: Hit { facet: NO_FACET, range_m: 0.0, point: ray.origin, cos_theta: 1.0 },
            normal: -ray.direction.xyz(),
            target: Pose::NONE,
            azimuth_rad: 0.0,
            region: 0,
            xt_m: 0.0,
            yt_m: 0.0,
            edge_m: 0.0,
            sheets: 0,
            by_sheets: 1.0,
            longer_m: 0.0,
        }
    }

    /// Direction to the radar in the local frame of the surface.
    pub(crate) fn to_radar(self) -> Direction<Surface> {
        Direction::from_angles(self.hit.theta_rad(), self.azimuth_rad)
    }

    /// Whether the chirp misses the target.
    pub(crate) fn misses(&self) -> bool {
        self.hit.facet == NO_FACET
    }
}

/// What all shots of a scan share: the instrument and the target as the scene places it.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// The instrument and its target.
    pub geometry: ScanGeometry<'a>,
    /// The instrument's power balance.
    pub link: Link,
    /// Direction of the grain of every region, global frame.
    pub grain_of_region: &'a [DVec3],
    /// Width of the narrowest lobe of a region whose lobes include the beam that saw them, rad; none, also in a region
    /// beyond the last, where they are the surface's own.
    pub seen_lobe_rad: &'a [Option<f64>],
    /// Whether shots are rays on the beam's curved wavefront, several in a spot: its curvature then is no part of the divergence
    /// that widens lobes. A single ray along the axis stands for the whole beam.
    pub on_wavefront: bool,
    /// The antenna that receives the echoes; none for the radar's own.
    pub antenna: Option<Antenna>,
    /// The pivot of a pose, m, global frame: the [`middle`] of all shots of the scan, even if only some are predicted.
    pub middle: DVec3,
}

impl Stage<'_> {
    /// The beam of a shot's chirp.
    pub fn beam(&self, shot: &Shot) -> GaussianBeam {
        self.link.beam.towards(shot.xt_m, shot.yt_m)
    }

    /// Range of the echo of a hit, m: half of the way to the antenna.
    pub(crate) fn range_m(&self, radar: Point<Global>, hit: &Hit) -> f64 {
        self.antenna.map_or(hit.range_m, |antenna| antenna.half_way_m(radar, hit.point))
    }

    /// How far a beam of a divergence, rad, widens the lobes of a region, rad.
    pub(crate) fn widening_rad(&self, region: u16, divergence_rad: f64) -> f64 {
        let seen_lobe_rad = self.seen_lobe_rad.get(usize::from(region)).copied().flatten();
        widening_rad(seen_lobe_rad, divergence_rad)
    }

    /// How far the beam of a shot widens the lobes that it meets, rad.
    pub(crate) fn widening_of_shot_rad(&self, shot: &Shot) -> f64 {
        self.widening_rad(shot.region, self.divergence_rad(shot))
    }

    /// Divergence of the beam in the middle of the field, rad.
    pub(super) fn middle_divergence_rad(&self) -> f64 {
        self.link.beam.towards(0.0, 0.0).divergence_rad()
    }

    /// Divergence of the beam at a shot, rad.
    pub(crate) fn divergence_rad(&self, shot: &Shot) -> f64 {
        let beam = self.beam(shot);
        if self.on_wavefront {
            beam.section(shot.hit.range_m).divergence_rad()
        } else {
            beam.divergence_rad()
        }
    }
}

/// Whether a surface returns to a beam of a divergence, rad, a part of its echo in one wave that counts: face on, where its
/// lobes are strongest.
pub(super) fn returns_wave(law: &Brdf, beam_rad: f64) -> bool {
    let facing = Direction::from_angles(0.0, 0.0);
    law.seen_by(beam_rad, facing, facing).coherent_share > LEAST_COHERENT
}

/// Mean of the intersections of the shots, m, global frame; the origin without shots.
pub fn middle(shots: &[Shot]) -> DVec3 {
    mean(shots.iter().map(|shot| shot.hit.point.xyz))
}

/// Mean of some points; the origin without points.
pub(crate) fn mean(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let (mut sum, mut count) = (DVec3::ZERO, 0.0_f64);
    for point in points {
        (sum, count) = (sum + point, count + 1.0);
    }
    sum / count.max(1.0)
}
