//! Promise: every tracer agrees with the naive loop on every chirp of every scene: the same facet at
//! the same range and angle, or on a shared edge the other facet at the same range. The pinhole and the
//! hierarchy agree to the bit, and nothing slips through the edges and corners of a closed mesh.

use crate::support::meshes::{edges, needles, one_facet, pile, ray, square};
use crate::support::{self, entries};
use glam::{DQuat, DVec3, EulerRot};
use matdb::frames::{Direction, Global, Point, Ray};
use matdb::geometry::Mesh;
use matdb::scene::{Scene, mannequin, solids};
use matdb::trace::{Bvh, Fan, Hit, Tracer};

/// Both measure in f64 by different formulas; at 8 m a unit in the last place is 2e-15 m.
const RANGE: f64 = 1e-12;
/// The same where the plane of a sliver is hardly known.
const SLIVER: f64 = 1e-6;
/// Rounding of the facet's normal.
const COSINE: f64 = 1e-12;

/// The hits of the pinhole, after comparing it with the hierarchy.
fn traced(mesh: &Mesh, rays: &[Ray<Global>]) -> Vec<Option<Hit>> {
    let bvh = Bvh::new(mesh);
    let fast = Tracer::Automatic.closest(&bvh, rays).unwrap();
    assert!(!bvh.is_built(), "rays of one origin need none");
    let general = Tracer::Bvh.closest(&bvh, rays).unwrap();
    for (ray, (fast, general)) in fast.iter().zip(&general).enumerate() {
        assert_eq!(fast, general, "ray {ray}");
    }
    fast
}

/// The same, after comparing them with the naive loop: ranges to a share of themselves.
fn judged(mesh: &Mesh, rays: &[Ray<Global>], share: f64) -> Vec<Option<Hit>> {
    let fast = traced(mesh, rays);
    let slow = Tracer::Brute.closest(&Bvh::new(mesh), rays).unwrap();
    for (ray, pair) in fast.iter().zip(&slow).enumerate() {
        match pair {
            (None, None) => {}
            (Some(fast), Some(slow)) => {
                let apart_m = (fast.range_m - slow.range_m).abs();
                assert!(apart_m < share * slow.range_m, "ray {ray}: {fast:?} is not {slow:?}");
                assert!(fast.point.distance_m(slow.point) < share * slow.range_m);
                let turned = (fast.cos_theta - slow.cos_theta).abs();
                assert!(fast.facet != slow.facet || turned < COSINE, "ray {ray}");
            }
            _ => panic!("ray {ray}: {pair:?}"),
        }
    }
    fast
}

fn check(name: &str) {
    let scene = Scene::load(&support::scene(name)).unwrap();
    let hits = judged(&scene.target.mesh, &scene.chirps.rays, RANGE);
    // The front of a calibration sphere is small.
    assert!(hits.len() > 1000 && hits.iter().flatten().count() > 50, "{name}");
}

#[test]
fn on_every_scene() {
    let scenes = entries(&support::root().join("scenes"));
    let scenes: Vec<_> = scenes.iter().filter(|name| name.ends_with(".toml")).collect();
    assert!(scenes.len() >= 5);
    scenes.into_iter().for_each(|name| check(name));
}

/// Rays through every corner of a mesh, the middle of every edge, and two more of its points.
fn through_edges(mesh: &Mesh, origin: Point<Global>) -> Vec<Ray<Global>> {
    edges(mesh).into_iter().map(|at| ray(origin.xyz, at)).collect()
}

#[test]
fn nothing_slips_into_a_ball() {
    for (subdivisions, inner_m) in [(0, 0.39), (2, 0.48), (5, 0.499)] {
        let ball = solids::icosphere(0.5, subdivisions);
        for origin in [Point::new(0.0, 0.0, 8.0), Point::new(3.0, -2.0, 5.5)] {
            let rays = through_edges(&ball, origin);
            let is_inner =
                |ray: &Ray<Global>| (-origin.xyz).cross(ray.direction.xyz()).length() < inner_m;
            let inner: Vec<Ray<Global>> = rays.into_iter().filter(is_inner).collect();
            assert!(!inner.is_empty());
            for hit in traced(&ball, &inner) {
                assert!(hit.is_some_and(|hit| hit.range_m < origin.xyz.length()), "{hit:?}");
            }
        }
    }
}

/// Rays around another.
const BESIDE: usize = 8;

/// Rays a tenth of a millimetre beside another at 10 m.
fn beside(ray: &Ray<Global>) -> impl Iterator<Item = Ray<Global>> {
    const TANGENT: f64 = 1e-5;
    let (Ray { origin, direction }, turn) = (*ray, std::f64::consts::TAU / BESIDE as f64);
    let (right, up) = direction.xyz().any_orthonormal_pair();
    (0..BESIDE).map(move |i| {
        let (sin, cos) = (i as f64 * turn).sin_cos();
        let aside = direction.xyz() + TANGENT * (cos * right + sin * up);
        Ray { origin, direction: Direction::new(aside).unwrap() }
    })
}

#[test]
fn nothing_slips_into_the_mannequin() {
    let body = mannequin::mannequin();
    let origin = Point::new(0.0, 1.1, 8.0);
    let mut rays = through_edges(&body, origin);
    let hits = traced(&body, &rays);
    // Each aims at the body, so that it may miss it only where it grazes its outline: then a ray beside
    // it misses, too.
    let missing: Vec<&Ray<Global>> =
        std::iter::zip(&rays, &hits).filter(|(_, hit)| hit.is_none()).map(|(ray, _)| ray).collect();
    let around: Vec<Ray<Global>> = missing.iter().flat_map(|ray| beside(ray)).collect();
    let around = traced(&body, &around);
    for (ray, around) in std::iter::zip(missing, around.chunks(BESIDE)) {
        assert!(around.contains(&None), "{ray:?} slips through");
    }
    rays.retain(|ray| {
        let at = origin.xyz + 8.0 * ray.direction.xyz();
        at.x.abs() < 0.08 && (1.0..1.3).contains(&at.y)
    });
    assert!(rays.len() > 5000 && Fan::new(&rays).is_ok());
    for hit in traced(&body, &rays) {
        assert!(hit.is_some_and(|hit| hit.point.xyz.z > 0.0), "the torso's front: {hit:?}");
    }
}

#[test]
fn on_piles_needles_slivers_and_one_facet() {
    let hits = |hits: Vec<Option<Hit>>| hits.into_iter().flatten().count();
    let fan = |from: DVec3, aims: &mut dyn Iterator<Item = DVec3>| -> Vec<Ray<Global>> {
        aims.map(|at| ray(from, at)).collect()
    };
    let eye = 3.0 * DVec3::Z;
    assert!(hits(judged(&pile(), &fan(eye, &mut square(60, 0.9)), SLIVER)) > 1000);
    let mut aims = (0..3000).map(|i| DVec3::new(1.7e-7 * f64::from(i), 0.31, 0.0));
    assert!(hits(judged(&needles(), &fan(8.0 * DVec3::Z, &mut aims), SLIVER)) > 300);
    // Down onto it, away from it, and along its plane.
    let one = one_facet();
    assert!(hits(judged(&one, &fan(4.0 * DVec3::Z, &mut square(20, 1.2)), SLIVER)) > 100);
    assert_eq!(
        hits(judged(&one, &fan(DVec3::NEG_Z, &mut square(20, 0.2).map(|at| at - eye)), SLIVER)),
        0
    );
    assert_eq!(hits(judged(&one, &fan(-3.0 * DVec3::X, &mut square(20, 1.2)), SLIVER)), 0);
}

/// Rays along every edge of a mesh and across every facet in its plane, in both directions, from so far outside of it.
fn in_planes(mesh: &Mesh, off_m: f64) -> Vec<Ray<Global>> {
    let of_facet = |facet: usize| {
        let [a, b, c] = mesh.corners(facet);
        let ways =
            [(a, b), (b, c), (c, a), (a, b.midpoint(c)), (b, c.midpoint(a)), (c, a.midpoint(b))];
        ways.into_iter().flat_map(move |(from, to)| {
            let along = off_m * (to - from).normalize();
            [ray(from - along, to), ray(to + along, from)]
        })
    };
    (0..mesh.facets.len()).flat_map(of_facet).collect()
}

/// The hit of a ray by every tracer.
fn by_all(mesh: &Mesh, bvh: &Bvh, ray: &Ray<Global>) -> [Option<Hit>; 3] {
    // Of one ray the pinhole has no picture.
    let rays: Vec<Ray<Global>> = std::iter::once(*ray).chain(beside(ray)).collect();
    traced(mesh, &rays);
    [Tracer::Pinhole, Tracer::Bvh, Tracer::Brute].map(|way| way.closest(bvh, &rays).unwrap()[0])
}

const PLACE_M: DVec3 = DVec3::new(0.1, 1.2, -0.3);

/// Turned about the origin and moved, so that no number is round.
fn placed(mut mesh: Mesh) -> Mesh {
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.3, 0.7, -0.4);
    mesh.vertices.iter_mut().for_each(|at| *at = turn * *at + PLACE_M);
    mesh
}

#[test]
fn what_is_seen_edge_on_hides_nothing() {
    // A sheet in four by four parts, and a wall around it that every ray in the plane of the sheet meets.
    let mut sheet = relief(4);
    sheet.vertices.iter_mut().for_each(|at| at.z = 0.0);
    // Off its middle, so that no ray meets the wall at an edge.
    let mut wall = solids::cuboid(DVec3::new(31.0, 33.0, 35.0), 40.0);
    wall.vertices.iter_mut().for_each(|at| *at += DVec3::new(0.37, 0.21, 0.43));
    let wall = placed(wall);
    let sheet = placed(sheet);
    let mut both = sheet.clone();
    both.append(&wall).unwrap();
    let bvh = Bvh::new(&both);
    for off_m in [0.5, 1.0, 8.0] {
        for ray in in_planes(&sheet, off_m) {
            let behind = Bvh::new(&wall).closest(&ray).unwrap();
            for hit in by_all(&both, &bvh, &ray) {
                let apart_m = hit.map(|hit| (hit.range_m - behind.range_m).abs());
                assert!(apart_m.is_some_and(|m| m < 1e-6 * behind.range_m), "{ray:?}: {hit:?}");
            }
        }
    }
}

#[test]
fn a_needle_along_the_rays_hides_no_wall() {
    // Its picture has an area that f32 is sure of, and its plane is left to rounding.
    let needle = [[0.0, 0.0, 1.0], [4e-6, 0.0, 0.0], [0.0, 4e-6, 0.0]];
    let wall = [[-1.0, -1.0, -1.0], [3.0, -1.0, -1.0], [-1.0, 3.0, -1.0]];
    let vertices = needle.into_iter().chain(wall).map(DVec3::from).collect();
    let mesh = Mesh { vertices, facets: vec![[0, 1, 2], [3, 4, 5]], labels: Vec::new() };
    let origin = Point::new(0.0, 0.0, 8.0);
    let at = |k: u32| 8e-6 * f64::from(k) / 19.0;
    let through = (0..400).map(|k| Point::new(at(k % 20), at(k / 20), 0.0));
    let rays: Vec<_> =
        through.map(|to| Ray { origin, direction: origin.towards(to).unwrap() }).collect();
    let hits = judged(&mesh, &rays, SLIVER);
    assert!(hits.iter().all(Option::is_some), "the wall is behind");
}

#[test]
fn rays_along_edges_of_a_closed_mesh_meet_nothing_beside_it() {
    /// Just above the angle from which a facet counts as seen edge-on, m.
    const ROUNDING_M: f64 = 1e-5;
    let ball = placed(solids::icosphere(0.5, 1));
    let bvh = Bvh::new(&ball);
    for off_m in [0.5, 8.0] {
        for ray in in_planes(&ball, off_m) {
            for hit in by_all(&ball, &bvh, &ray).into_iter().flatten() {
                let from_middle_m = hit.point.xyz.distance(PLACE_M);
                assert!((0.45..0.5 + ROUNDING_M).contains(&from_middle_m), "{ray:?}: {hit:?}");
            }
        }
    }
}

/// A square sheet of two by two metres with hills and valleys, facing +z.
fn relief(cells: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let across = cells + 1;
    for (j, i) in (0..across).flat_map(|j| (0..across).map(move |i| (j, i))) {
        let [x, y] = [i, j].map(|n| 2.0 * f64::from(n) / f64::from(cells) - 1.0);
        mesh.vertices.push(DVec3::new(x, y, 0.05 * (37.0 * x).sin() * (23.0 * y + x).cos()));
    }
    for (j, i) in (0..cells).flat_map(|j| (0..cells).map(move |i| (j, i))) {
        let a = j * across + i;
        let [b, c, d] = [a + 1, a + across + 1, a + across];
        mesh.facets.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

#[test]
fn on_ten_million_facets() {
    const CELLS: u32 = 2237;
    let mesh = relief(CELLS);
    assert!(mesh.facets.len() > 10_000_000);
    let origin = Point::new(0.3, -0.2, 8.0);
    let towards = |n: u32| {
        // Every third aims at a corner within the sheet, the others between them.
        let [i, j] = [7919, 78_643].map(|step| 1 + n * step % (CELLS - 2));
        let at = mesh.vertices[(j * (CELLS + 1) + i) as usize];
        let aside = if n.is_multiple_of(3) { 0.0 } else { 3.1e-4 };
        origin.towards((at + DVec3::new(aside, 0.7 * aside, 0.0)).into()).unwrap()
    };
    let rays: Vec<_> = (0..24).map(|n| Ray { origin, direction: towards(n) }).collect();
    let fast = traced(&mesh, &rays);
    let slow = Tracer::Brute.closest(&Bvh::new(&mesh), &rays).unwrap();
    assert!(slow.iter().all(Option::is_some));
    for (ray, (fast, slow)) in fast.iter().zip(&slow).enumerate() {
        let range_m = |hit: &Option<Hit>| hit.map_or(f64::INFINITY, |hit| hit.range_m);
        let [fast_m, slow_m] = [range_m(fast), range_m(slow)];
        assert!(
            fast_m == slow_m || (fast_m - slow_m).abs() < RANGE * slow_m,
            "ray {ray}: {fast:?} is not {slow:?}"
        );
    }
}
