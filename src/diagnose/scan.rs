//! The diagnosis of a cloud against the scene that was measured.

use super::error::DiagnoseError;
use super::matching::match_cloud;
use super::observation::ReceiverLimits;
use super::report::{MeshPose, Report};
use super::settings::Diagnosis;
use super::shots::trace_shots;
use super::subject::Subject;
use crate::brdf::Brdf;
use crate::effects::{Effect, Receiver, Stage, middle};
use crate::measure::Cloud;
use crate::radar::{Link, Radar};
use crate::scene::Scene;
use crate::trace::{Bvh, ScanGeometry};
use crate::units::watts_from_dbm;

/// Looks that represent a radar without speckle: a likelihood needs some spread.
const MOST_LOOKS: f64 = 1e4;

/// A scene and the cloud that was measured of it.
#[derive(Clone, Copy)]
pub struct MeasuredScene<'a> {
    /// Radar, scan and target.
    pub scene: &'a Scene,
    /// The cloud, in the global frame.
    pub cloud: &'a Cloud,
    /// Scattering model of each region, where the refit begins.
    pub laws: &'a [Brdf],
    /// Width of the narrowest lobe of a region whose lobes include the beam that saw them, rad.
    pub seen_lobe_rad: &'a [Option<f64>],
    /// Effects that the scene declares, at fixed values.
    pub declared_effects: &'a [(&'a dyn Effect, Vec<f64>)],
}

impl MeasuredScene<'_> {
    /// Diagnoses the cloud, trying these effects; `notify` receives a few words about each step.
    ///
    /// # Errors
    /// When the data are too few for an answer, or are not of this scene.
    pub fn diagnose(
        &self,
        seed: u64,
        effects: &[&dyn Effect],
        notify: &(dyn Fn(&str) + Sync),
    ) -> Result<Report, DiagnoseError> {
        let MeasuredScene { scene, cloud, laws, seen_lobe_rad, declared_effects } = *self;
        let radar = scene.radar();
        // Every chirp against the target.
        let bvh = Bvh::new(&scene.target.mesh);
        let grain_of_region: Vec<_> = scene.target.regions.iter().map(|r| r.grain).collect();
        let mut stage = Stage {
            geometry: ScanGeometry::new(radar, &scene.chirps, &bvh, &scene.target.region_of_facet),
            link: Link::new(radar),
            grain_of_region: &grain_of_region,
            seen_lobe_rad,
            on_wavefront: false,
            middle: glam::DVec3::ZERO,
        };
        let shots = trace_shots(&stage)?;
        stage.middle = middle(&shots);
        // The cloud against the chirps.
        let (receiver, declared) = declared_receiver(radar);
        let mut matched =
            match_cloud(cloud, &scene.chirps, &shots, declared.threshold_w, radar.returns)?;
        matched.alarms.cells = radar.gate_cells();
        matched.alarms.looks = radar.noise_looks();
        let subject = Subject {
            stage: &stage,
            laws,
            at_work: declared_effects,
            receiver,
            declared,
            shots: &shots,
            observations: &matched.observations,
            strays: &matched.strays,
            alarms: &matched.alarms,
            pose: &poses(scene),
        };
        Diagnosis { seed, ..Diagnosis::for_spot(radar.spot_fwhm_m()) }
            .run_with(&subject, effects, notify)
    }
}

/// A radar's receiver, its threshold and its error of ranges, as declared.
pub fn declared_receiver(radar: &Radar) -> (Receiver, ReceiverLimits) {
    let receiver = Receiver::declared(radar);
    let receiver = Receiver { looks: receiver.looks.min(MOST_LOOKS), ..receiver };
    let range_sd_m = radar.noise.map_or(0.0, |noise| noise.range_sd_m);
    let threshold_w = watts_from_dbm(radar.threshold_dbm);
    (receiver, ReceiverLimits { threshold_w, range_sd_m })
}

/// Poses of the meshes of a scene.
fn poses(scene: &Scene) -> Vec<MeshPose> {
    let mut poses = Vec::new();
    for mesh in &scene.file.mesh {
        let (rotation_deg, translation_m) = (mesh.rotation_deg, mesh.translation_m);
        poses.push(MeshPose { mesh: mesh.name.clone(), rotation_deg, translation_m });
    }
    poses
}
