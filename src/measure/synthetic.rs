//! Measurements for tests: what a radar would have measured of a mesh, range noise included.

use glam::DVec3;

use super::cloud::{Cloud, CloudPoint};
use super::error::RegistrationError;
use super::icp::Motion;
use super::register::{RegistrationResult, Stop};
use super::settings::Registration;
use super::tracer::{Intersection, RaySet, Tracer};
use crate::frames::{Global, Point, Pose};
use crate::geometry::Mesh;
use crate::radar::random::{Draws, Key, Purpose};
use crate::radar::{Chirps, Link, Radar};
use crate::scene::mannequin;
use crate::units::watts_from_dbm;

/// A pose that is known exactly.
pub fn exact() -> RegistrationResult {
    RegistrationResult {
        pose: Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO),
        covariance: [[0.0; 6]; 6],
        told_covariance: [[0.0; 6]; 6],
        free: vec![],
        pivot: Point::new(0.0, 0.0, 0.0),
        kept: false,
        rms_m: 0.0,
        widened: 1.0,
        inliers: 1,
        points: 1,
        scans: 1,
        iterations: 1,
        stop: Stop::Still,
        converged: true,
        verdicts: vec![],
    }
}

/// A mesh where it stood, and its cloud.
#[derive(Clone)]
pub struct SyntheticScan {
    pub mesh: Mesh,
    pub radar: Radar,
    pub chirps: Chirps,
    pub cloud: Cloud,
}

/// f of every synthetic surface, 1/sr: of −77 dBm at some 60° from 8 m.
pub fn f_per_sr(theta_rad: f64) -> f64 {
    0.5 * (-theta_rad / 0.1).exp() + 1.6e-4
}

impl SyntheticScan {
    /// A mesh around the origin or on the floor of the global frame, detected above the threshold.
    pub fn of(mut mesh: Mesh, range_sd_m: f64, seed: u64) -> SyntheticScan {
        let lowest_m = mesh.vertices.iter().map(|v| v.y).fold(f64::INFINITY, f64::min);
        if lowest_m < 0.0 {
            mesh.vertices.iter_mut().for_each(|v| v.y += 1.1);
        }
        let radar = Radar::default();
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let here = Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
        let seen = Tracer::new(&mesh).scan(&here, &RaySet::new(&mesh, &chirps.rays));
        let link = Link::new(&radar);
        let threshold_w = watts_from_dbm(radar.threshold_dbm);
        let mut draws = draws(seed, 0);
        let mut points = Vec::new();
        for ((seen, ray), number) in seen.into_iter().zip(&chirps.rays).zip(&chirps.number) {
            let Some(Intersection { hit, .. }) = seen else { continue };
            let f_per_sr = f_per_sr(hit.theta_rad());
            let power_w = link.power_w(&link.beam.along(ray), hit.range_m, hit.cos_theta, f_per_sr);
            let range_m = hit.range_m + range_sd_m * normal(&mut draws);
            let point = Point::from(ray.origin.xyz + range_m * ray.direction.xyz());
            if power_w >= threshold_w {
                let (chirp, range_m) = (Some(*number), Some(range_m));
                points.push(CloudPoint { chirp, point, range_m, power_w });
            }
        }
        let cloud = Cloud::new(points).unwrap();
        SyntheticScan { mesh, radar, chirps, cloud }
    }

    /// Registers the mesh to its cloud.
    pub fn register(
        &self,
        settings: &Registration,
    ) -> Result<RegistrationResult, RegistrationError> {
        settings.run(&self.mesh, &self.radar, &self.chirps, &self.cloud)
    }

    /// The first points only.
    pub fn first(&self, count: usize) -> Cloud {
        Cloud::new(self.cloud.points()[..count].to_vec()).unwrap()
    }

    /// Every n-th point becomes a false alarm: at its ray, but anywhere within a metre.
    pub fn with_false_alarms(mut self, every: usize, seed: u64) -> SyntheticScan {
        let mut draws = draws(seed, 1);
        let origin = self.radar.frames().origin();
        let mut points = self.cloud.points().to_vec();
        for echo in points.iter_mut().step_by(every) {
            let along = origin.towards(echo.point).unwrap().xyz();
            let range_m = 7.5 + draws.uniform();
            echo.point = Point::from(origin.xyz + range_m * along);
            echo.range_m = Some(range_m);
        }
        self.cloud = Cloud::new(points).unwrap();
        self
    }
}

/// A cylinder along y, about the origin.
pub fn cylinder(radius_m: f64, height_m: f64, sides: usize) -> Mesh {
    let ring = |y: f64| {
        (0..sides).map(move |side| {
            let (sin, cos) = (std::f64::consts::TAU * side as f64 / sides as f64).sin_cos();
            DVec3::new(radius_m * sin, y, radius_m * cos)
        })
    };
    let vertices = ring(-0.5 * height_m).chain(ring(0.5 * height_m)).collect();
    let sides = sides as u32;
    let facets = (0..sides).flat_map(|side| {
        let next = (side + 1) % sides;
        [[side, next, next + sides], [side, next + sides, side + sides]]
    });
    Mesh { vertices, facets: facets.collect(), labels: Vec::new() }
}

/// A mesh stretched along each axis.
pub fn stretched(mut mesh: Mesh, by: DVec3) -> Mesh {
    mesh.vertices.iter_mut().for_each(|vertex| *vertex *= by);
    mesh
}

/// A mesh turned about the axes, degrees.
pub fn turned(mut mesh: Mesh, by_deg: DVec3) -> Mesh {
    let pose = Pose::<Global, Global>::from_euler_xyz(
        by_deg * (std::f64::consts::PI / 180.0),
        DVec3::ZERO,
    );
    mesh.vertices.iter_mut().for_each(|v| *v = (pose * Point::from(*v)).xyz);
    mesh
}

/// The built-in mannequin.
pub fn mannequin(range_sd_m: f64, seed: u64) -> SyntheticScan {
    SyntheticScan::of(mannequin::mannequin(), range_sd_m, seed)
}

fn draws(seed: u64, sub_ray: u64) -> Draws {
    Key { seed, chirp: 0, sub_ray, purpose: Purpose::Noise }.draws()
}

/// A Gaussian of unit variance.
fn normal(draws: &mut Draws) -> f64 {
    draws.complex_gaussian().re * std::f64::consts::SQRT_2
}

/// A rough pose, off by this much in a random direction about the middle of the cloud.
pub fn pushed(
    measured: &SyntheticScan,
    off_m: f64,
    off_rad: f64,
    seed: u64,
) -> Pose<Global, Global> {
    let mut draws = draws(seed, 2);
    let mut direction =
        || DVec3::from_array([(); 3].map(|()| normal(&mut draws))).normalize_or(DVec3::X);
    let motion = Motion { shift_m: off_m * direction(), turn_rad: off_rad * direction() };
    let points = measured.cloud.points();
    let middle = points.iter().map(|p| p.point.xyz).sum::<DVec3>() / points.len() as f64;
    motion.about(middle)
}

/// Error of a pose whose truth is to stay: shift of the middle of the cloud (m) and turn (rad).
pub fn apart(found: &RegistrationResult) -> (f64, f64) {
    let error = Motion::of(&found.pose, found.pivot.xyz);
    (error.shift_m.length(), error.turn_rad.length())
}
