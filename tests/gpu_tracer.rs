//! Promise: hits found on a graphics processor are those of the hierarchy, bit for bit, on every chirp of every
//! scene and on meshes made to be hard; what the device cannot take is refused in a sentence, and without a
//! device the program goes on without. Feature `gpu`.
//!
//! A driver in software will do. Where there is none the tests say so and pass, unless `MATDB_NEED_GPU` is set.

use std::fs;
use std::path::Path;

use crate::support::meshes::{edges, mesh, needles, one_facet, pile, ray, square};
use crate::support::{self, entries};
use glam::DVec3;
use matdb::frames::{Direction, Global, Ray};
use matdb::geometry::Mesh;
use matdb::scene::{Scene, mannequin, solids};
use matdb::trace::{Answer, Bvh, Gpu, GpuError, Hit, TraceError, Tracer};
use proptest::prelude::*;

/// Set to anything, it makes the absence of an adapter a failure.
const NEEDED: &str = "MATDB_NEED_GPU";

/// An adapter; `None`, with a word about it, where there is none.
fn adapter(buffer_bytes: u64) -> Option<Gpu> {
    match Gpu::limited(buffer_bytes) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(std::env::var_os(NEEDED).is_none(), "{NEEDED} is set: {error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// The hits, after comparing them with the hierarchy's, and how many the device left open.
fn traced(gpu: &Gpu, mesh: &Mesh, rays: &[Ray<Global>]) -> (Vec<Option<Hit>>, usize) {
    let (hits, open) = traced_each(gpu, mesh, rays);
    (hits, open.iter().filter(|&&open| open).count())
}

/// The same, with which of the rays the device left open.
fn traced_each(gpu: &Gpu, mesh: &Mesh, rays: &[Ray<Global>]) -> (Vec<Option<Hit>>, Vec<bool>) {
    let bvh = Bvh::new(mesh);
    let held = gpu.hold(&bvh).unwrap();
    let hits = Tracer::Gpu(&held).closest(&bvh, rays).unwrap();
    let expected = Tracer::Bvh.closest(&bvh, rays).unwrap();
    assert_eq!(hits.len(), rays.len());
    for (ray, pair) in std::iter::zip(&hits, &expected).enumerate() {
        assert_eq!(pair.0, pair.1, "ray {ray}: {:?}", rays[ray]);
    }
    let answers = held.answers(rays).unwrap();
    for (answer, hit) in std::iter::zip(&answers, &hits) {
        assert!(
            match answer {
                Answer::Nothing => hit.is_none(),
                Answer::Facet(facet) => hit.is_some_and(|hit| hit.facet == *facet),
                Answer::Unsure => true,
            },
            "{answer:?} is not {hit:?}"
        );
    }
    (hits, answers.iter().map(|&answer| answer == Answer::Unsure).collect())
}

/// Whether a hit is as near to an edge as f32 can tell.
fn is_on_edge(mesh: &Mesh, hit: &Hit) -> bool {
    let corners = mesh.corners(hit.facet as usize);
    (0..3).any(|side| {
        let along = corners[(side + 1) % 3] - corners[side];
        along.cross(hit.point.xyz - corners[side]).length() < 1e-5 * along.length()
    })
}

#[test]
fn on_every_scene() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let scenes = entries(&support::root().join("scenes"));
    let scenes: Vec<_> = scenes.iter().filter(|name| name.ends_with(".toml")).collect();
    assert!(scenes.len() >= 5);
    for name in scenes {
        let scene = Scene::load(&support::scene(name)).unwrap();
        let mesh = &scene.target.mesh;
        let (hits, open) = traced_each(&gpu, mesh, &scene.chirps.rays);
        // The corner is small in the field of view.
        let least = if *name == "calibration-trihedral.toml" { 200 } else { 1_000 };
        assert!(hits.iter().flatten().count() > least, "{name}");
        // A scan that has the symmetry of its target also meets edges, which are the processor's.
        let is_on_edge = |hit: &Option<Hit>| hit.is_some_and(|hit| is_on_edge(mesh, &hit));
        let beside = open.iter().zip(&hits).filter(|(open, hit)| **open && !is_on_edge(hit));
        let open = beside.count();
        assert!(50 * open < hits.len(), "{name}: {open} of {} left open", hits.len());
    }
}

#[test]
fn rays_from_everywhere_to_everywhere() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let body = mannequin::mannequin();
    let turn = |i: usize, step: f64| (i as f64 * step).fract();
    let anywhere = |i: usize, reach_m: f64| {
        let along = |step| reach_m * (2.0 * turn(i, step) - 1.0);
        DVec3::new(along(0.754_877_666), along(0.569_840_291), along(0.381_966_011))
    };
    let middle = DVec3::new(0.0, 1.0, 0.0);
    let rays: Vec<_> = (0..20_000)
        .map(|i| {
            // From within the body to a thousand kilometres off.
            let from = middle + anywhere(i, 10f64.powf(7.0 * turn(i, 0.618_033_989) - 1.0));
            ray(from, middle + anywhere(i + 77_777, 1.0))
        })
        .collect();
    let (hits, unsure) = traced(&gpu, &body, &rays);
    let met = hits.iter().flatten().count();
    assert!(met > 2000 && met < 18_000, "{met}");
    assert!(20 * unsure < rays.len(), "{unsure} left open");
}

#[test]
fn nothing_slips_through_the_edges_and_corners_of_closed_meshes() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    for (subdivisions, inner_m) in [(0, 0.39), (2, 0.48), (4, 0.4985)] {
        let ball = solids::icosphere(0.5, subdivisions);
        for origin in [DVec3::new(0.0, 0.0, 8.0), DVec3::new(3.0, -2.0, 5.5)] {
            let is_inner = |ray: &Ray<Global>| origin.cross(ray.direction.xyz()).length() < inner_m;
            // On the side that is seen: nearer than the horizon.
            let front = edges(&ball).into_iter().filter(|at| at.dot(origin) > 0.3);
            let rays: Vec<_> = front.map(|at| ray(origin, at)).filter(is_inner).collect();
            let (hits, unsure) = traced(&gpu, &ball, &rays);
            assert!(hits.iter().all(|hit| hit.is_some_and(|hit| hit.range_m < origin.length())));
            assert_eq!(unsure, rays.len(), "a ray along an edge is the processor's");
        }
    }
}

#[test]
fn facets_on_top_of_each_other_behind_across_and_without_area() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let mesh = pile();
    let rays: Vec<_> = square(60, 0.9).map(|at| ray(3.0 * DVec3::Z, at)).collect();
    let (hits, _) = traced(&gpu, &mesh, &rays);
    let met = |facet: u32| hits.iter().flatten().filter(|hit| hit.facet == facet).count();
    assert!(met(0) > 200 && met(3) > 200 && met(6) > 200, "{} {} {}", met(0), met(3), met(6));
    assert_eq!(met(1) + met(2) + met(4) + met(5), 0);
}

#[test]
fn needles_slivers_and_one_facet() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let from = DVec3::new(0.1, 0.0, 8.0);
    let aims = (0..3000).map(|i| DVec3::new(1.7e-7 * f64::from(i), 0.31, 0.0));
    let rays: Vec<_> = aims
        .map(|at| ray(8.0 * DVec3::Z, at))
        .chain(square(40, 0.25).map(|at| ray(from, at + DVec3::new(0.1, 0.1, 0.0))))
        .collect();
    assert!(traced(&gpu, &needles(), &rays).0.iter().flatten().count() > 300);

    // Down onto it, along its plane, and away.
    let rays: Vec<_> = square(20, 1.2)
        .flat_map(|at| {
            [
                ray(4.0 * DVec3::Z, at),
                ray(-3.0 * DVec3::X, at),
                ray(at + DVec3::Z, at + 2.0 * DVec3::Z),
            ]
        })
        .collect();
    let (hits, _) = traced(&gpu, &one_facet(), &rays);
    let down = hits.iter().step_by(3).flatten().count();
    assert!(down > 100 && hits.iter().flatten().count() == down, "{down}");
}

#[test]
fn no_rays_and_no_area_meet_nothing() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    assert_eq!(traced(&gpu, &solids::plate(1.0, 1.0), &[]).0, []);
    let flat = mesh(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[[0, 1, 2]]);
    let rays = [ray(DVec3::Z, DVec3::ZERO)];
    assert_eq!(traced(&gpu, &flat, &rays), (vec![None], 0));
}

#[test]
fn more_rays_than_a_buffer_holds_take_turns() {
    let Some(gpu) = adapter(4096) else { return };
    let ball = solids::icosphere(0.5, 0);
    let rays: Vec<_> = square(99, 0.6).map(|at| ray(8.0 * DVec3::Z, at)).collect();
    let (hits, unsure) = traced(&gpu, &ball, &rays);
    assert!(hits.iter().flatten().count() > 3000 && hits.contains(&None));
    assert!(100 * unsure < rays.len(), "{unsure}");
}

#[test]
fn a_mesh_that_is_too_large_is_refused_with_the_number() {
    let Some(gpu) = adapter(4096) else { return };
    let ball = solids::icosphere(0.5, 3);
    let bvh = Bvh::new(&ball);
    let error = gpu.hold(&bvh).err().unwrap();
    let GpuError::TooLarge { needed, .. } = error else { panic!("{error}") };
    // The corners, or the boxes if those take more.
    let facets = ball.facets.len() as u64;
    assert!((48 * facets..=64 * facets).contains(&needed), "{needed}");
    assert_eq!(
        error.to_string(),
        format!(
            "the mesh takes {needed} bytes in one buffer of `{}`, which has room for 4096; use the \
             tracer `bvh`",
            gpu.adapter()
        )
    );
}

#[test]
fn another_mesh_than_the_one_that_is_held_is_refused() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let [one, other] = [solids::plate(1.0, 1.0), solids::plate(2.0, 2.0)];
    let [one, other] = [Bvh::new(&one), Bvh::new(&other)];
    let held = gpu.hold(&one).unwrap();
    let refused = Tracer::Gpu(&held).closest(&other, &[ray(DVec3::Z, DVec3::ZERO)]);
    assert_eq!(refused, Err(TraceError::Gpu(GpuError::OtherMesh)));
}

/// Renders a scene in a folder; what it writes, and what it has to note.
fn render(scene: &Path, tracer: &[&str], drivers: Option<&str>) -> (Vec<Vec<u8>>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = support::matdb(folder.path());
    if let Some(drivers) = drivers {
        command.envs([("VK_ICD_FILENAMES", drivers), ("VK_DRIVER_FILES", drivers)]);
    }
    let output = command.args(["render", "-o", "out"]).args(tracer).arg(scene).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let out = folder.path().join("out");
    // Drivers have their own say.
    let notes = said.lines().filter(|line| line.starts_with("note: ")).map(str::to_owned);
    (entries(&out).iter().map(|name| fs::read(out.join(name)).unwrap()).collect(), notes.collect())
}

#[test]
fn the_program_says_on_what_it_traces_and_writes_the_same_bytes() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    // With several rays in every spot.
    let scan = "[radar.scan]\npattern = \"elliptical\"\nchirps = 1201\n[spot]\nrays = 7\n[[mesh]]";
    let text = fs::read_to_string(support::scene("human.toml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let spots = folder.path().join("spots.toml");
    fs::write(&spots, text.replacen("[[mesh]]", scan, 1)).unwrap();
    std::os::unix::fs::symlink(support::scene("meshes"), folder.path().join("meshes")).unwrap();
    for scene in [support::scene("mannequin.toml"), spots] {
        let (files, notes) = render(&scene, &["--tracer", "gpu"], None);
        assert_eq!(notes[0], format!("note: tracing on {}", gpu.adapter()));
        let (expected, others) = render(&scene, &[], None);
        assert!(files == expected && notes[1..] == others, "{}", scene.display());
    }
}

#[test]
fn without_a_driver_the_program_goes_on_without() {
    let scene = support::scene("mannequin.toml");
    let (files, notes) = render(&scene, &["--tracer", "gpu"], Some("/nonexistent"));
    let note = &notes[0];
    assert!(
        note.starts_with("note: the tracer `gpu` finds no adapter with a Vulkan driver: "),
        "{note}"
    );
    assert!(note.ends_with("; tracing on the processor instead"), "{note}");
    assert!(files == render(&scene, &[], None).0);
}

prop_compose! {
    fn soup()(
        corners in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 3..90),
        picks in prop::collection::vec(prop::array::uniform3(0usize..90), 1..60),
    ) -> Mesh {
        let n = corners.len();
        Mesh {
            vertices: corners.into_iter().map(DVec3::from).collect(),
            facets: picks.into_iter().map(|p| p.map(|i| (i % n) as u32)).collect(),
            labels: vec![],
        }
    }
}

#[test]
fn on_any_soup_of_facets() {
    let Some(gpu) = adapter(u64::MAX) else { return };
    let scales = prop::array::uniform2(-6.0f64..4.0);
    let ends =
        prop::collection::vec(prop::array::uniform2(prop::array::uniform3(-1.5f64..1.5)), 200);
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig::with_cases(64));
    runner
        .run(&(soup(), scales, ends), |(mut mesh, [size, shift], ends)| {
            // From micrometres to kilometres, up to ten kilometres off.
            let place = |at: DVec3| 10f64.powf(size) * at + 10f64.powf(shift) * DVec3::X;
            let eye = DVec3::new(0.4, 0.3, 9.0);
            // From anywhere to anywhere; and at every edge, and beside it by ever less.
            let beside = |(i, at): (usize, DVec3)| {
                let aside = DVec3::new(0.6, -0.8, 0.3) * 0.1f64.powi(3 + i as i32 % 7);
                [[eye, at], [eye, at + aside]]
            };
            let rays = ends
                .iter()
                .map(|ends| ends.map(DVec3::from))
                .chain(edges(&mesh).into_iter().enumerate().flat_map(beside))
                .map(|ends| ends.map(place))
                .filter_map(|[from, to]| {
                    let direction = Direction::new(to - from)?;
                    Some(Ray { origin: from.into(), direction })
                });
            let rays: Vec<_> = rays.collect();
            mesh.vertices.iter_mut().for_each(|vertex| *vertex = place(*vertex));
            traced(&gpu, &mesh, &rays);
            Ok(())
        })
        .unwrap();
}
