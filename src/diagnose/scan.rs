//! The diagnosis of a cloud against the scene that was measured.

use glam::DVec3;

use super::error::DiagnoseError;
use super::matching::{Reported, match_cloud};
use super::observation::ReceiverLimits;
use super::report::{MeshPose, Report};
use super::settings::Diagnosis;
use super::shots::{trace_layers, trace_shots};
use super::subject::Subject;
use super::unresolved::Unresolved;
use crate::brdf::Brdf;
use crate::effects::{Antenna, Effect, MOST_LOOKS, Receiver, Shot, Stage, middle};
use crate::measure::Cloud;
use crate::radar::{Link, Radar, RadarError, RangeProcessor, Returns};
use crate::render::{Setup, Sheet, Surface};
use crate::scene::Scene;
use crate::trace::{Bvh, ScanGeometry};
use crate::units::watts_from_dbm;

/// A scene and the cloud that was measured of it.
#[derive(Clone, Copy)]
pub struct MeasuredScene<'a> {
    /// Radar, scan and target.
    pub scene: &'a Scene,
    /// The cloud, in the global frame.
    pub cloud: &'a Cloud,
    /// The antenna that the cloud is of; none for the radar's own.
    pub antenna: Option<Antenna>,
    /// Scattering model of each region, where the refit begins.
    pub laws: &'a [Brdf],
    /// The sheet of each region that lets a part of the wave through; none of any other, and beyond the last.
    pub sheets: &'a [Option<Sheet>],
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
        options: Options,
        effects: &[&dyn Effect],
        notify: &(dyn Fn(&str) + Sync),
    ) -> Result<Report, DiagnoseError> {
        diagnose_together(&[*self], options, effects, notify)
    }
}

/// How clouds are diagnosed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Seed of folds, placebos and everything random.
    pub seed: u64,
    /// Whether controls are computed: what terms without a meaning gain, and the size from which on each effect would have
    /// been found. They take about a third of the time and change no answer.
    pub controls: bool,
}

/// Diagnoses several clouds of one target together, trying these effects; `notify` receives a few words about each step.
/// The scenes have the same regions with the same materials, and the laws are those of the first.
///
/// # Errors
/// When the data are too few for an answer, or are not of these scenes; when meshes or receivers differ.
pub fn diagnose_together(
    measured: &[MeasuredScene],
    options: Options,
    effects: &[&dyn Effect],
    notify: &(dyn Fn(&str) + Sync),
) -> Result<Report, DiagnoseError> {
    let Some(first) = measured.first() else {
        return Err(DiagnoseError::TooFew { detected: 0 });
    };
    let targets = measured.iter().map(|one| &one.scene.target);
    let bvhs: Vec<Bvh> = targets.clone().map(|target| Bvh::new(&target.mesh)).collect();
    let grains: Vec<Vec<DVec3>> =
        targets.map(|target| target.regions.iter().map(|region| region.grain).collect()).collect();
    let (receiver, declared) = declared_receiver(first.scene.radar())?;
    let (mut stages, mut shots, mut unresolved) = (Vec::new(), Vec::new(), Vec::new());
    let (mut observations, mut strays, mut alarms) = (Vec::new(), Vec::new(), Vec::new());
    for (number, one) in measured.iter().enumerate() {
        if one.received()? != first.received()? {
            return Err(DiagnoseError::OtherReceiver { cloud: number + 1 });
        }
        let MeasuredScene { scene, cloud, antenna, seen_lobe_rad, .. } = *one;
        let radar = scene.radar();
        // Every chirp against the target.
        let (bvh, region_of_facet) = (&bvhs[number], &scene.target.region_of_facet);
        let mut stage = Stage {
            geometry: ScanGeometry::new(radar, &scene.chirps, bvh, region_of_facet),
            link: Link::new(radar),
            grain_of_region: &grains[number],
            seen_lobe_rad,
            on_wavefront: false,
            antenna,
            middle: DVec3::ZERO,
        };
        let (mut own, parts) = one.echoes(&stage)?;
        stage.middle = middle(&own);
        // The cloud against the chirps.
        let ReceiverLimits { threshold_w, .. } = declared;
        let is_parted = radar.receiver.is_some() && scene.file.bounce.is_some();
        let cell_m = radar.chirp().range_resolution_m();
        let reported = Reported {
            threshold_w,
            returns: if is_parted { Returns::Strongest } else { radar.returns },
            antenna: antenna.filter(|_| !is_parted),
            parted_m: is_parted.then(|| [radar.range_cell_m(), radar.spot_fwhm_m()]),
            gate_cells: radar.gate_cells(),
            cell_m,
        };
        let mut matched = match_cloud(cloud, &scene.chirps, &own, reported)?;
        matched.alarms.looks = radar.noise_looks();
        let of_strays = matched.strays.iter_mut().filter_map(|stray| stray.shot.as_mut());
        own.iter_mut().chain(of_strays).for_each(|shot| shot.scan = number as u16);
        stages.push(stage);
        shots.extend(own);
        unresolved.push(parts);
        observations.extend(matched.observations);
        strays.push(matched.strays);
        alarms.push(matched.alarms);
    }
    let at_work: Vec<Vec<(&dyn Effect, Vec<f64>)>> = std::iter::zip(measured, &unresolved)
        .map(|(one, unresolved)| {
            let mut effects = one.declared_effects.to_vec();
            if !unresolved.is_empty() {
                effects.push((unresolved, Vec::new()));
            }
            effects
        })
        .collect();
    let at_work: Vec<_> = at_work.iter().map(Vec::as_slice).collect();
    let subject = Subject {
        stages: &stages,
        laws: first.laws,
        at_work: &at_work,
        receiver,
        declared,
        shots: &shots,
        observations: &observations,
        strays: &strays,
        alarms: &alarms,
        pose: &measured.iter().flat_map(|one| poses(one.scene)).collect::<Vec<_>>(),
    };
    let spots_m = stages.iter().map(|stage| stage.geometry.radar.spot_fwhm_m());
    let Options { seed, controls } = options;
    Diagnosis { seed, controls, ..Diagnosis::for_spot(spots_m.fold(0.0, f64::max)) }
        .run_with(&subject, effects, notify)
}

impl MeasuredScene<'_> {
    /// The shots of the scan's chirps, and what else their echoes hold where surfaces are sheets.
    fn echoes(&self, stage: &Stage) -> Result<(Vec<Shot>, Unresolved), DiagnoseError> {
        if self.sheets.iter().all(Option::is_none) {
            return Ok((trace_shots(stage)?, Unresolved::default()));
        }
        let regions = self.scene.target.regions.iter().zip(self.laws).enumerate();
        let surfaces = regions.map(|(number, (region, law))| {
            let seen_lobe_rad = self.seen_lobe_rad.get(number).copied().flatten();
            let opaque = Surface { seen_lobe_rad, ..Surface::new(law) };
            let sheet = self.sheets.get(number).and_then(Option::as_ref);
            Surface { grain: region.grain, ..sheet.map_or(opaque, Surface::of_sheet) }
        });
        let surfaces: Vec<Surface> = surfaces.collect();
        let most_sheets = self.scene.file.transmission.sheets;
        let setup = Setup { most_sheets, ..Setup::new(stage.geometry, &surfaces) };
        trace_layers(stage, &setup, self.laws)
    }

    /// The receiver with the declared effects on it, and its limits.
    fn received(&self) -> Result<(Receiver, ReceiverLimits), RadarError> {
        let (receiver, limits) = declared_receiver(self.scene.radar())?;
        let effects = self.declared_effects.iter();
        Ok((effects.fold(receiver, |receiver, (effect, v)| effect.receive(v, receiver)), limits))
    }
}

/// A radar's receiver, its threshold and its error of ranges, as declared. One with `[radar.receiver]` has the noise in a bin
/// of its spectrum and its own threshold.
///
/// # Errors
/// A setting of the range receiver that is out of range.
pub fn declared_receiver(radar: &Radar) -> Result<(Receiver, ReceiverLimits), RadarError> {
    let mut receiver = Receiver::declared(radar);
    let range_sd_m = radar.noise.map_or(0.0, |noise| noise.range_sd_m);
    let mut threshold_w = watts_from_dbm(radar.threshold_dbm);
    if let Some(of_ranges) = radar.receiver {
        let looks = radar.speckle.map_or(1, |speckle| speckle.looks as u32);
        let processor =
            RangeProcessor::new(&of_ranges, &radar.chirp(), radar.threshold_dbm, looks)?;
        (receiver.noise_w, threshold_w) = (processor.noise_per_bin_w(), processor.threshold_w());
    }
    // A likelihood needs some spread, also of a radar without speckle.
    receiver.looks = receiver.looks.min(MOST_LOOKS);
    Ok((receiver, ReceiverLimits { threshold_w, range_sd_m }))
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
