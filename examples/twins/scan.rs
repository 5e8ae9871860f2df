//! What the radar looks at: the declared rays and what each of them meets on the declared mesh.

use glam::{DVec2, DVec3};
use matdb::frames::{Direction, Global, Point, Ray};
use matdb::geometry::Mesh;
use matdb::radar::Link;
use matdb::radar::random::{Draws, Key, Purpose};
use matdb::scene::Scene;
use matdb::trace::Bvh;
use matdb::units::watts_from_dbm;
use rayon::prelude::*;

use super::beam::{METRES_AT_ONE_GHZ, Waist};

/// Streams of random numbers that never share a draw.
#[derive(Clone, Copy, Debug)]
pub enum Stream {
    Speckle = 1,
    Thermal,
    Range,
    Tilt,
    Spot,
    Bounce,
    Effect,
    Base,
    Geometry,
    Start,
    Report,
    Place,
    Scatterer,
}

/// The draws of a seed, a chirp and a purpose.
pub fn draws(seed: u64, chirp: usize, stream: Stream) -> Draws {
    let sub_ray = stream as u64;
    Key { seed, chirp: chirp as u64, sub_ray, purpose: Purpose::Speckle }.draws()
}

/// Where a ray meets the surface, in the frame of the declared mesh.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    pub point: DVec3,
    /// Turned to the radar.
    pub normal: DVec3,
    pub to_radar: DVec3,
    pub range_m: f64,
}

impl Shot {
    pub fn cos_theta(&self) -> f64 {
        self.normal.dot(self.to_radar)
    }
}

/// One chirp as declared.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    pub chirp: usize,
    pub ray: Ray<Global>,
    /// Time since the first chirp over that of the whole scan, 0 to 1.
    pub share: f64,
    /// Where it looks in the target plane, from the field's centre, m.
    pub off_centre_m: DVec2,
    /// The same from the middle of the target plane, m.
    pub place_m: DVec2,
    /// Turn of the scanning mirror, rad; 0 for a scan without one.
    pub mirror_rad: f64,
    pub look: Option<Shot>,
}

/// A scan of a target, ready for effects.
pub struct World<'a> {
    pub bvh: Bvh<'a>,
    pub sights: Vec<Sight>,
    pub numbers: Vec<u32>,
    pub origin: DVec3,
    /// Middle of all points that are met, m.
    pub middle: DVec3,
    /// P_t·L, W.
    pub sent_w: f64,
    pub waist: Waist,
    pub threshold_w: f64,
    pub looks: f64,
    pub noise_w: f64,
    pub range_sd_m: f64,
    /// c/2B, m.
    pub range_cell_m: f64,
    pub has_mirror: bool,
}

impl<'a> World<'a> {
    pub fn new(scene: &Scene, mesh: &'a Mesh) -> World<'a> {
        let (radar, chirps) = (scene.radar(), &scene.chirps);
        let bvh = Bvh::new(mesh);
        let (frames, link) = (radar.frames(), Link::new(radar));
        let field = chirps.field(&frames);
        let centre = 0.5 * (DVec2::from(field.min_m) + DVec2::from(field.max_m));
        let ends = [chirps.time_s[0], chirps.time_s[chirps.time_s.len() - 1]];
        let targets: Vec<DVec2> = chirps.target_points_m(&frames).collect();
        let sight = |(chirp, &ray): (usize, &Ray<Global>)| Sight {
            chirp,
            ray,
            share: (chirps.time_s[chirp] - ends[0]) / (ends[1] - ends[0]).max(1e-9),
            off_centre_m: targets[chirp] - centre,
            place_m: targets[chirp],
            mirror_rad: chirps.mirror.get(chirp).map_or(0.0, |angles| angles.phi_rad),
            look: look(&bvh, &ray),
        };
        let sights: Vec<Sight> = chirps.rays.par_iter().enumerate().map(sight).collect();
        let met = || sights.iter().filter_map(|sight| sight.look);
        let middle = met().map(|l| l.point).sum::<DVec3>() / met().count().max(1) as f64;
        let noise = radar.noise.unwrap_or_default();
        World {
            sights,
            numbers: chirps.number.clone(),
            origin: frames.origin().xyz,
            middle,
            sent_w: link.transmit_power_w * link.system_gain_ratio,
            waist: Waist::new(scene),
            threshold_w: watts_from_dbm(radar.threshold_dbm),
            looks: radar.speckle.unwrap_or_default().looks,
            noise_w: radar.noise_w(),
            range_sd_m: noise.range_sd_m,
            range_cell_m: 0.5 * METRES_AT_ONE_GHZ / radar.bandwidth_ghz,
            has_mirror: !chirps.mirror.is_empty(),
            bvh,
        }
    }

    /// The chirp half way through the scan.
    pub fn middle_of_scan(&self) -> Option<&Sight> {
        self.sights.get(self.sights.len() / 2)
    }
}

/// The closest hit of a ray.
pub fn look(bvh: &Bvh, ray: &Ray<Global>) -> Option<Shot> {
    let hit = bvh.closest(ray)?;
    let to_radar = -ray.direction.xyz();
    let normal = bvh.mesh().area_normal(hit.facet as usize).try_normalize()?;
    let normal = if normal.dot(to_radar) < 0.0 { -normal } else { normal };
    Some(Shot { point: hit.point.xyz, normal, to_radar, range_m: hit.range_m })
}

/// A ray from a point along a vector of any length.
pub fn ray(origin: DVec3, along: DVec3) -> Option<Ray<Global>> {
    let direction: Direction<Global> = Direction::new(along)?;
    Some(Ray { origin: Point::from(origin), direction })
}
