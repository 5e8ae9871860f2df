//! Promise: many scans at once on a graphics processor give what the renderer gives of each by itself, for any pose,
//! material, seed and number of rays in a spot: powers to 0.02 dB. What is more than a device holds takes turns or is refused with the
//! number. Feature `gpu`.
//!
//! A driver in software will do. Where there is none the tests say so and pass, unless `MATDB_NEED_GPU` is set.

use crate::support;
use glam::DVec3;
use matdb::brdf::{Brdf, CookTorrance, Distribution, Shadowing};
use matdb::frames::{Global, Pose};
use matdb::geometry::Mesh;
use matdb::material::builtin;
use matdb::radar::{Chirps, Noise, Pattern, Radar, Speckle, scan::Elliptical};
use matdb::render::{
    Batch, Echo, Observer, RenderError, Setup, Surface, Take, Takes, shade, trace,
};
use matdb::scene::{Scene, solids};
use matdb::trace::{Bvh, Gpu, GpuError, ScanGeometry, TraceError, Tracer};
use matdb::units::{db_from_ratio, dbm_from_watts};

/// What f32 and the device's functions may cost.
const POWER_DB: f64 = 0.02;
/// The same for the range, of itself and of the target's radius over cos θ, as a ratio.
const RANGE: f64 = 1.1e-6;
/// Of echoes below this no more is known, dBm.
const FAINTEST_DBM: f64 = -300.0;

fn adapter(buffer_bytes: u64) -> Option<Gpu> {
    match Gpu::limited(buffer_bytes) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(std::env::var_os("MATDB_NEED_GPU").is_none(), "MATDB_NEED_GPU is set: {error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// A target and what it is scanned with.
#[derive(Clone)]
struct Bench {
    radar: Radar,
    chirps: Chirps,
    mesh: Mesh,
    region_of_facet: Vec<u16>,
    laws: Vec<Brdf>,
}

fn chirps(radar: &Radar) -> Chirps {
    Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap()
}

fn builtin(name: &str) -> Brdf {
    builtin::get(name).unwrap().unwrap().scattering().unwrap()
}

impl Bench {
    /// A scene's target, in a scan of so many chirps.
    fn of(scene: &str, count: usize) -> Bench {
        let scene = Scene::load(&support::scene(scene)).unwrap();
        let scan = Pattern::Elliptical(Elliptical { chirps: count, ..Default::default() });
        let radar = Radar { scan, ..Radar::default() };
        let laws = scene.target.regions.iter().map(|region| builtin(&region.material)).collect();
        let (mesh, region_of_facet) = (scene.target.mesh, scene.target.region_of_facet);
        Bench { chirps: chirps(&radar), radar, mesh, region_of_facet, laws }
    }

    fn ball(radius_m: f64, subdivisions: u32, law: Brdf) -> Bench {
        let mut mesh = solids::icosphere(radius_m, subdivisions);
        mesh.vertices.iter_mut().for_each(|vertex| vertex.y += 1.1);
        let scan = Pattern::Elliptical(Elliptical { chirps: 601, ..Default::default() });
        let radar = Radar { scan, ..Radar::default() };
        let region_of_facet = vec![0; mesh.facets.len()];
        Bench { chirps: chirps(&radar), radar, mesh, region_of_facet, laws: vec![law] }
    }

    fn radius_m(&self) -> f64 {
        let middle =
            |pick: fn(DVec3, DVec3) -> DVec3| self.mesh.vertices.iter().copied().reduce(pick);
        let middle = 0.5 * (middle(DVec3::min).unwrap() + middle(DVec3::max).unwrap());
        self.mesh.vertices.iter().map(|vertex| vertex.distance(middle)).fold(0.0, f64::max)
    }

    /// What the renderer gives of a scan, the target being moved: the echo of every chirp.
    fn alone(&self, take: &Take, rays: usize) -> Vec<Option<Echo>> {
        let mut mesh = self.mesh.clone();
        let moved =
            |vertex: DVec3| (take.target * matdb::frames::Point::<Global>::from(vertex)).xyz;
        mesh.vertices.iter_mut().for_each(|vertex| *vertex = moved(*vertex));
        let surfaces: Vec<Surface> = take
            .surfaces
            .iter()
            .map(|surface| Surface { grain: take.target.rotation() * surface.grain, ..*surface })
            .collect();
        let bvh = Bvh::new(&mesh);
        let Bench { radar, chirps, region_of_facet, .. } = self;
        let geometry = ScanGeometry::new(radar, chirps, &bvh, region_of_facet);
        let footprints = trace(&geometry, rays, &|_| {}).unwrap();
        let setup = Setup { seed: take.seed, ..Setup::new(geometry, &surfaces) };
        let scan = shade(&setup, &footprints, Observer::Radar, &|_| {}).unwrap();
        let mut echoes = vec![None; self.chirps.rays.len()];
        scan.echoes.into_iter().for_each(|echo| echoes[echo.chirp as usize] = Some(echo));
        echoes
    }

    fn together(&self, gpu: &Gpu, takes: &[Take], rays: usize) -> Result<Takes, RenderError> {
        let bvh = Bvh::new(&self.mesh);
        let held = gpu.hold(&bvh).unwrap();
        self.traced(&bvh, Tracer::Gpu(&held), takes, rays)
    }

    fn traced(
        &self,
        bvh: &Bvh,
        tracer: Tracer,
        takes: &[Take],
        rays_per_chirp: usize,
    ) -> Result<Takes, RenderError> {
        let Bench { radar, chirps, region_of_facet, .. } = self;
        let geometry = ScanGeometry { radar, chirps, bvh, tracer, region_of_facet };
        Batch { geometry, rays_per_chirp }.run(takes)
    }

    /// Compares a batch with its scans one by one; the largest error in dB and the echoes that were compared.
    fn compared(&self, gpu: &Gpu, takes: &[Take], rays: usize) -> Takes {
        let found = self.together(gpu, takes, rays).unwrap();
        assert_eq!(found.rays, takes.len() * self.chirps.rays.len() * rays);
        assert_eq!(found.echoes.len(), takes.len());
        let radius_m = self.radius_m();
        let (mut worst_db, mut count, mut faint) = (0f64, 0, 0);
        let quiet = Bench {
            radar: Radar { speckle: None, noise: None, ..self.radar.clone() },
            ..self.clone()
        };
        for (take, found) in takes.iter().zip(&found.echoes) {
            let expected = self.alone(take, rays);
            let means = quiet.alone(take, rays);
            assert_eq!(found.len(), expected.len());
            for (chirp, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let expected = expected.as_ref();
                let Some(expected) =
                    expected.filter(|echo| dbm_from_watts(echo.power_w) > FAINTEST_DBM)
                else {
                    let found_dbm = found.map_or(-400.0, |found| dbm_from_watts(found.power_w));
                    assert!(found_dbm <= FAINTEST_DBM + POWER_DB, "chirp {chirp}: {found_dbm}");
                    faint += 1;
                    continue;
                };
                let found = found.unwrap_or_else(|| panic!("chirp {chirp}: {expected:?}"));
                let error_db = db_from_ratio(found.power_w / expected.power_w).abs();
                assert!(
                    error_db < POWER_DB,
                    "chirp {chirp}: {error_db} dB, {found:?} {expected:?}"
                );
                // Over a spot angles differ; where it grazes it says less.
                let cos = expected.truth.as_ref().map_or(1.0, |truth| truth.hit.cos_theta);
                let cos = if rays == 1 { cos } else { (0.1 * cos).max(2e-3) };
                let error_m = (found.range_m - expected.range_m).abs();
                let most_m = RANGE * (expected.range_m + radius_m / cos);
                // Under the noise there may be an echo that the device cannot hold, and so cannot place.
                let is_held = means[chirp]
                    .as_ref()
                    .is_some_and(|mean| dbm_from_watts(mean.power_w) > FAINTEST_DBM);
                assert!(
                    error_m < most_m || !is_held,
                    "chirp {chirp}: {error_m} m, {found:?} {expected:?}"
                );
                worst_db = worst_db.max(error_db);
                count += 1;
            }
        }
        eprintln!(
            "{count} echoes, {faint} without, at most {worst_db:.6} dB off; {} of {} rays on the processor",
            found.rays_on_processor, found.rays
        );
        assert!(count > 100 * takes.len(), "{count}");
        found
    }
}

fn surfaces(laws: &[Brdf]) -> Vec<Surface<'_>> {
    laws.iter().map(|law| Surface::new(law)).collect()
}

fn pose(turn_deg: [f64; 3], shift_m: [f64; 3]) -> Pose<Global, Global> {
    let turn_rad = DVec3::from(turn_deg.map(f64::to_radians));
    Pose::from_euler_xyz(turn_rad, shift_m.into())
}

/// As it stands, turned about the vertical, and leaning and nearer.
fn poses() -> [Pose<Global, Global>; 3] {
    let leaning = pose([-9.0, 160.0, 4.0], [0.07, 0.05, 1.3]);
    [Pose::NONE, pose([0.0, 31.0, 0.0], [0.0; 3]), leaning]
}

#[test]
fn every_scene_in_every_pose() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    for scene in ["mannequin.toml", "human.toml", "showcase.toml"] {
        let bench = Bench::of(scene, 6001);
        let surfaces = surfaces(&bench.laws);
        let take = |target| Take { target, surfaces: &surfaces, seed: 0, noise_seed: None };
        let found = bench.compared(&gpu, &poses().map(take), 1);
        let closed =
            bench.laws.iter().all(|law| matdb::brdf::Scattering::backscatter(law).is_some());
        assert!(!closed || 20 * found.rays_on_processor < found.rays, "{scene}");
    }
}

/// The device does not know the loss: the processor computes the echoes.
#[test]
fn air_with_a_loss_is_the_renderer_s() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let mut bench = Bench::of("mannequin.toml", 701);
    bench.radar.air_loss_db_per_m = 0.5;
    let surfaces = surfaces(&bench.laws);
    let take = |target| Take { target, surfaces: &surfaces, seed: 0, noise_seed: None };
    for rays in [1, 40] {
        let found = bench.compared(&gpu, &poses().map(take), rays);
        assert_eq!(found.rays_on_processor, found.rays);
    }
}

#[test]
fn every_spot_is_averaged() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let bench = Bench::of("mannequin.toml", 701);
    let surfaces = surfaces(&bench.laws);
    let take = |target| Take { target, surfaces: &surfaces, seed: 0, noise_seed: None };
    // One share of rays and a part of one, and more.
    for rays in [2, 32, 75] {
        let found = bench.compared(&gpu, &poses().map(take), rays);
        assert!(20 * found.rays_on_processor < found.rays, "{rays}");
    }
}

#[test]
fn every_scan_has_its_own_material_and_seed() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let mut bench = Bench::ball(0.3, 4, builtin("ptfe"));
    bench.radar.speckle = Some(Speckle { looks: 3.0, ..Default::default() });
    bench.radar.noise =
        Some(Noise { level_dbm: Some(-95.0), range_sd_m: 0.002, ..Noise::default() });
    let laws = [
        "aluminium",
        "mannequin-paint",
        "garment",
        "water-25c",
        "cotton",
        "human-skin",
        "concrete",
    ];
    let laws = laws.map(builtin);
    let surfaces = laws.each_ref().map(|law| [Surface::new(law)]);
    let takes: Vec<Take> = surfaces
        .iter()
        .zip(1..)
        .flat_map(|(surfaces, seed)| {
            [pose([5.0, 0.0, 0.0], [0.0; 3]), pose([0.0; 3], [0.05, -0.1, 0.3])]
                .map(|target| Take { target, surfaces, seed, noise_seed: None })
        })
        .collect();
    let found = bench.compared(&gpu, &takes, 5);
    let same = bench.together(&gpu, &takes[..1], 5).unwrap();
    assert_eq!(same.echoes[0], found.echoes[0], "a scan does not depend on its neighbours");
    let other = bench.together(&gpu, &[Take { seed: 99, ..takes[0] }], 5).unwrap();
    assert_ne!(other.echoes[0], found.echoes[0]);
}

#[test]
fn a_law_with_a_grain_is_the_processor_s() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let brushed = CookTorrance {
        f_lambda: 0.9,
        m: 0.1,
        m_across: Some(0.4),
        distribution: Distribution::Ggx,
        shadowing: Shadowing::Separable,
    };
    let bench = Bench::ball(0.3, 3, Brdf::CookTorrance(brushed));
    let surfaces = surfaces(&bench.laws);
    let take = |target| Take { target, surfaces: &surfaces, seed: 0, noise_seed: None };
    let found = bench.compared(&gpu, &[take(pose([0.0, 0.0, 70.0], [1.1, 0.7, 0.0]))], 3);
    let hits = found.echoes[0].iter().flatten().count();
    assert!(found.rays_on_processor > 2 * hits, "{} {hits}", found.rays_on_processor);
}

#[test]
fn a_target_that_is_smaller_than_the_spot_is_the_processor_s() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let bench = Bench::ball(0.004, 2, builtin("ptfe"));
    let surfaces = surfaces(&bench.laws);
    let take = Take { target: Pose::NONE, surfaces: &surfaces, seed: 0, noise_seed: None };
    let found = bench.together(&gpu, &[take], 64).unwrap();
    let bvh = Bvh::new(&bench.mesh);
    let expected = bench.traced(&bvh, Tracer::Automatic, &[take], 64).unwrap();
    assert!(found.rays_on_processor > 0 && expected.rays_on_processor == expected.rays);
    assert_eq!(found.echoes, expected.echoes);
}

#[test]
fn what_is_more_than_a_buffer_takes_turns_or_is_refused_with_the_number() {
    let (Some(gpu), Some(small)) = (adapter(u64::MAX), adapter(4096)) else { return };
    let bench = Bench::ball(0.4, 0, builtin("ptfe"));
    let surfaces = surfaces(&bench.laws);
    let take = Take { target: Pose::NONE, surfaces: &surfaces, seed: 0, noise_seed: None };
    let (all, in_turns) =
        (bench.together(&gpu, &[take; 3], 40), bench.together(&small, &[take; 3], 40));
    assert_eq!(all.unwrap(), in_turns.unwrap());
    let refused = bench.together(&small, &[take; 600], 1).unwrap_err();
    // Two terms of 16 bytes for each scan; its law itself takes 8.
    let needed = 600 * 32;
    assert_eq!(
        refused.to_string(),
        format!(
            "the materials and spots of the scans take {needed} bytes in one buffer of `{}`, which has room for \
             4096; give fewer scans at once",
            small.adapter()
        )
    );
}

#[test]
fn what_a_batch_cannot_do_is_refused() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let mut bench = Bench::ball(0.3, 1, builtin("ptfe"));
    let surfaces = surfaces(&bench.laws);
    let take = Take { target: Pose::NONE, surfaces: &surfaces, seed: 0, noise_seed: None };
    let [one, other] = [Bvh::new(&bench.mesh), Bvh::new(&bench.mesh)];
    let held = gpu.hold(&one).unwrap();
    let refused = bench.traced(&other, Tracer::Gpu(&held), &[take], 1);
    assert_eq!(refused, Err(RenderError::Tracer(TraceError::Gpu(GpuError::OtherMesh))));
    let nothing = bench.traced(&one, Tracer::Gpu(&held), &[], 1).unwrap();
    assert_eq!(nothing, Takes { echoes: vec![], rays: 0, rays_on_processor: 0 });
    bench.radar.receiver = Some(Default::default());
    let refused = bench.traced(&one, Tracer::Gpu(&held), &[take], 1);
    assert!(refused.unwrap_err().to_string().contains("[radar.receiver]"));
}
