//! How a cloud is registered: the metric, the rough pose and the limits.

use glam::DVec3;

use super::icp::Kernel;
use crate::frames::{Global, Pose};

/// The distances that a registration minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Metric {
    /// Distances to the nearest virtual point: the paper's.
    PointToPoint,
    /// Distances to the plane of the nearest virtual point.
    PointToPlane,
    /// Point to plane first, then gaps along the measured rays.
    #[default]
    AlongRay,
}

/// Settings of a registration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// The distances to minimise.
    pub metric: Metric,
    /// Weight of outliers.
    pub kernel: Kernel,
    /// The rough pose.
    pub start: Start,
    /// Farthest neighbours at the rough pose, m, above 0.
    pub reach_m: f64,
    /// Most virtual scans, 1 or more.
    pub max_scans: usize,
    /// Most alignment steps per virtual scan, and along the rays, 1 or more.
    pub max_steps: usize,
    /// The pose has stopped changing when a step moves the target by less, m, above 0.
    pub still_m: f64,
    /// Most measured points that the coarse loop uses.
    pub coarse_points: usize,
    /// Fewer points are refused.
    pub least_points: usize,
    /// A smaller share of points on the surface is refused, 0 to 1.
    pub least_inliers: f64,
    /// A pose farther from the rough one has diverged, m.
    pub farthest_m: f64,
    /// A pose turned farther from the rough one has diverged, rad.
    pub farthest_rad: f64,
    /// Keep a pose given by hand when the points do not speak against it, at 5 %: it may be known
    /// better than from the points, and on flat facets a tenth of a millimetre moves angles by degrees.
    pub keep_given: bool,
    /// Keep the given pose whatever the points say.
    pub keep: bool,
    /// The echoes are of whole spots: a range is the mean over the beam, and not that along its axis. Only
    /// [`Metric::AlongRay`] takes it into account.
    pub of_spots: bool,
}

impl Default for Registration {
    fn default() -> Self {
        Registration {
            metric: Metric::default(),
            kernel: Kernel::default(),
            start: Start::default(),
            reach_m: 0.12,
            max_scans: 30,
            max_steps: 40,
            still_m: 1e-5,
            coarse_points: 2500,
            least_points: 50,
            least_inliers: 0.5,
            farthest_m: 0.25,
            farthest_rad: 0.5,
            keep_given: true,
            keep: false,
            of_spots: false,
        }
    }
}

impl Registration {
    /// The paper's: point to point, all points, every pair counts alike.
    pub fn paper() -> Registration {
        Registration {
            metric: Metric::PointToPoint,
            kernel: Kernel::Square,
            coarse_points: usize::MAX,
            max_scans: 100,
            ..Default::default()
        }
    }
}

/// The rough pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// By hand: what moves the mesh, as the scene places it, near to the cloud. The default is to
    /// leave it where it is.
    Given(Pose<Global, Global>),
    /// Twelve yaws about the vertical, from the scene's place and from the middle of the mesh on the
    /// middle of the cloud, each aligned coarsely; the one that fits best. The mesh must stand
    /// upright. A symmetric target may be found rotated.
    Automatic,
}

impl Default for Start {
    fn default() -> Self {
        Start::Given(Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO))
    }
}
