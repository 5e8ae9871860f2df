//! The way of an echo to an antenna apart from the radar's.
//!
//! A surface sends the share f(i, o)·cos θ_o·Ω of the power on it to an antenna that it sees in the direction o and in the
//! solid angle Ω. The range of the echo is half of the whole way.

use glam::DVec3;

use super::antenna::Antenna;
use super::intersection::grain;
use super::shot::{Shot, Stage};
use crate::brdf::{Brdf, Scattering, Seen};
use crate::frames::{Direction, Global, Point, Ray, Surface};
use crate::radar::jones::Field;
use crate::radar::{Channel, Polarisation};
use crate::trace::LocalFrame;

/// Distance from a surface at which a ray starts, m, so that the surface does not block it.
const CLEARANCE_M: f64 = 1e-7;

/// The way of an echo from a surface to an antenna apart from the radar's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WayBack {
    to_radar: Direction<Surface>,
    to_antenna: Direction<Surface>,
    frame: LocalFrame,
    /// cos θ_o·Ω, sr; 0 where the target hides the antenna.
    pub projected_sr: f64,
    /// Half of the way from the radar to the antenna, m.
    pub range_m: f64,
}

impl WayBack {
    /// The way from a shot's surface to an antenna.
    pub fn new(antenna: &Antenna, stage: &Stage, shot: &Shot) -> WayBack {
        let point = shot.hit.point;
        // The grain turns with the target.
        let grain = shot.target.rotation() * grain(stage, shot.region);
        let frame = LocalFrame::new(shot.normal, grain);
        let distance_m = point.distance_m(antenna.position);
        let towards = point.towards(antenna.position);
        let to_antenna = frame.local(towards.map_or(-frame.normal(), |towards| towards.xyz()));
        let is_seen = to_antenna.cos_theta() > 0.0
            && towards
                .is_some_and(|towards| is_free(stage, shot, frame.normal(), towards, distance_m));
        let solid_angle_sr = match antenna.aperture_m2 {
            Some(aperture_m2) => aperture_m2 / (distance_m * distance_m),
            None => stage.beam(shot).section(shot.hit.range_m).solid_angle_sr(),
        };
        WayBack {
            to_radar: frame.local(-shot.ray.direction.xyz()),
            to_antenna,
            frame,
            projected_sr: if is_seen { to_antenna.cos_theta() * solid_angle_sr } else { 0.0 },
            range_m: antenna.half_way_m(shot.ray.origin, point),
        }
    }

    /// What a beam of a divergence, rad, sees of a law on this way.
    pub fn seen(&self, law: &Brdf, beam_rad: f64) -> Seen {
        law.seen_by(beam_rad, self.to_radar, self.to_antenna)
    }

    /// Share of the power of an echo whose field is that which the antenna receives. Diffuse power has the polarisation
    /// that was sent, and facets turn the field of the specular part.
    pub fn co_polar_share(&self, antenna: &Polarisation, law: &Brdf, specular_share: f64) -> f64 {
        if specular_share == 0.0 {
            return 1.0;
        }
        let [from, to] = [-self.to_radar.xyz(), self.to_antenna.xyz()].map(|d| self.frame.world(d));
        let amplitudes = law.facet_amplitudes(self.to_radar, self.to_antenna);
        let field = Field::linear(antenna.field(from)).reflected(from, to, amplitudes);
        let received = field.power_along(antenna.received(-to, Channel::CoPolar));
        specular_share * received + (1.0 - specular_share)
    }
}

/// Whether nothing of the target stands in a direction from a shot's surface within a distance, m. The target is traced
/// where the scene has it.
fn is_free(
    stage: &Stage,
    shot: &Shot,
    normal: DVec3,
    direction: Direction<Global>,
    distance_m: f64,
) -> bool {
    let origin = Point::from(shot.hit.point.xyz + CLEARANCE_M * normal);
    let way = shot.target.inverse() * Ray { origin, direction };
    stage.geometry.bvh.closest(&way).is_none_or(|hit| hit.range_m >= distance_m)
}
