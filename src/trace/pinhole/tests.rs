use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::frames::Point;
use crate::scene::{mannequin, solids};
use crate::trace::brute;
use crate::trace::testing::{mesh, ray, soup};

/// Relative difference of ranges from the naive loop, which uses another formula.
const RANGE: f64 = 1e-9;

/// Rays from one point through many.
fn rays(origin: DVec3, through: impl IntoIterator<Item = DVec3>) -> Vec<Ray<Global>> {
    through.into_iter().map(|at| ray(origin, at)).collect()
}

/// Asserts that the fan gives the hits of the hierarchy, bit for bit, on one thread and on three, however the work is
/// split. Returns the hits.
fn traced(mesh: &Mesh, rays: &[Ray<Global>]) -> Vec<Option<Hit>> {
    let bvh = Bvh::new(mesh);
    let expected: Vec<_> = rays.iter().map(|ray| bvh.closest(ray)).collect();
    let fan = Fan::new(rays).unwrap();
    let picture = Picture::new(&fan, mesh);
    let alone = split_by_facets(&picture, 1);
    for shares in [2, 7] {
        assert!(split_by_facets(&picture, shares) == alone, "{shares} parts of the facets");
        assert!(split_by_rays(&picture, shares) == alone, "{shares} bands");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| Fan::new(rays).unwrap().closest(mesh));
        for (number, pair) in found.iter().zip(&expected).enumerate() {
            assert_eq!(pair.0, pair.1, "ray {number} of {}, {threads} threads", rays.len());
        }
    }
    expected
}

/// Asserts that the fan also gives the hits of the naive loop, up to rounding. Returns the hits.
fn judged(mesh: &Mesh, rays: &[Ray<Global>]) -> Vec<Option<Hit>> {
    let found = traced(mesh, rays);
    for (ray, found) in rays.iter().zip(&found) {
        match (found, brute::closest(mesh, ray)) {
            (None, None) => {}
            (Some(fast), Some(slow)) => {
                assert!(
                    (fast.range_m - slow.range_m).abs() < RANGE * slow.range_m,
                    "{fast:?} {slow:?}"
                );
            }
            other => panic!("{ray:?}: {other:?}"),
        }
    }
    found
}

/// Points of a grid in the plane z = 0.
fn grid(side: usize, half_m: f64) -> impl Iterator<Item = DVec3> {
    let at = move |i: usize| half_m * (2.0 * (i as f64 + 0.5) / side as f64 - 1.0);
    (0..side * side).map(move |i| DVec3::new(at(i % side), at(i / side), 0.0))
}

/// Every vertex, the middle of every edge and two more of its points.
fn edges(mesh: &Mesh) -> Vec<DVec3> {
    let of_facet = |facet: usize| {
        let [a, b, c] = mesh.corners(facet);
        [a, 0.5 * (a + b), b + (c - b) / 3.0, a.lerp(c, 0.618)]
    };
    (0..mesh.facets.len()).flat_map(of_facet).collect()
}

#[test]
fn no_ray_leaks_through_the_edges_and_corners_of_a_closed_mesh() {
    for subdivisions in [0, 1, 4] {
        let ball = solids::icosphere(0.5, subdivisions);
        for origin in [DVec3::new(0.0, 0.0, 8.0), DVec3::new(3.0, -2.0, 5.5)] {
            let rays = rays(origin, edges(&ball));
            let hits = traced(&ball, &rays);
            let half_way_m = origin.length();
            for (ray, hit) in rays.iter().zip(hits) {
                // Around the rim a ray may pass the ball; elsewhere its front is met.
                let beside_m = (-origin).cross(ray.direction.xyz()).length();
                let inner_m = [0.39, 0.46, 0.4985][subdivisions.min(2) as usize];
                if beside_m < inner_m {
                    assert!(hit.unwrap().range_m < half_way_m, "{subdivisions}: {ray:?} {hit:?}");
                }
            }
        }
    }
}

#[test]
fn no_ray_leaks_through_the_mannequin() {
    let body = mannequin::mannequin();
    let origin = DVec3::new(0.0, 1.1, 8.0);
    // Within the torso, far from any outline; behind it is its back.
    let torso = |at: &DVec3| at.x.abs() < 0.08 && (1.0..1.3).contains(&at.y);
    let rays = rays(origin, edges(&body).into_iter().filter(torso));
    assert!(rays.len() > 5_000, "{}", rays.len());
    for (ray, hit) in rays.iter().zip(traced(&body, &rays)) {
        assert!(hit.is_some_and(|hit| hit.point.xyz.z > 0.0), "{ray:?}: {hit:?}");
    }
}

#[test]
fn a_body_and_a_ball_are_the_naive_loop_s() {
    let mut scene = solids::icosphere(0.2, 3);
    scene.vertices.iter_mut().for_each(|v| *v += DVec3::new(0.3, 0.1, 0.5));
    scene.append(&solids::icosphere(0.4, 4)).unwrap();
    let hits = judged(&scene, &rays(DVec3::new(0.1, 0.2, 3.0), grid(60, 0.7)));
    let near = hits.iter().flatten().filter(|hit| hit.facet < 1280).count();
    assert!(near > 200 && hits.iter().flatten().count() > near + 500 && hits.contains(&None));
}

#[test]
fn one_facet_and_one_ray_will_do() {
    let mesh = mesh(&[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]);
    let origin = DVec3::new(0.2, 0.1, 4.0);
    assert!(judged(&mesh, &rays(origin, [DVec3::ZERO]))[0].is_some());
    assert!(judged(&mesh, &rays(origin, [DVec3::new(0.9, 0.9, 0.0)]))[0].is_none());
    // The same ray many times: a field without sides.
    assert!(judged(&mesh, &rays(origin, [DVec3::ZERO; 40])).iter().all(Option::is_some));
    // A line.
    let line = (0..100).map(|i| DVec3::new(0.02 * f64::from(i) - 1.0, -0.5, 0.0));
    assert_eq!(judged(&mesh, &rays(origin, line)).iter().flatten().count(), 75);
}

#[test]
fn of_facets_on_top_of_each_other_the_first_is_met() {
    let corners = [[-1.0, -1.0, 0.3], [1.0, -1.0, -0.2], [0.9, 1.0, 0.1], [-1.0, 1.0, 0.0]];
    // Twice the same, once turned around, and a part of its plane.
    let mut mesh = mesh(&corners, &[[0, 1, 2], [1, 2, 0], [0, 2, 1], [0, 2, 3]]);
    let [a, b, c] = mesh.corners(0);
    mesh.vertices.push((a + b + c) / 3.0);
    mesh.facets.push([0, 1, 4]);
    let hits = judged(&mesh, &rays(DVec3::new(0.0, 0.0, 3.0), grid(40, 0.9)));
    assert!(hits.iter().flatten().all(|hit| hit.facet == 0 || hit.facet >= 2));
    assert!(hits.iter().flatten().filter(|hit| hit.facet == 0).count() > 500);
}

#[test]
fn facets_behind_across_and_beside_the_origin() {
    let origin = DVec3::new(0.0, 0.0, 1.0);
    let corners = [
        // A floor from behind the origin far ahead.
        [-9.0, -0.2, 20.0],
        [9.0, -0.2, 20.0],
        [0.0, -0.2, -30.0],
        // A wall behind, a wall in the plane of the origin, and one ahead.
        [-1.0, -1.0, 2.0],
        [1.0, -1.0, 2.0],
        [0.0, 1.0, 2.0],
        [-1.0, 0.5, 1.0],
        [1.0, 0.5, 1.0],
        [0.0, 2.0, 1.0],
        [-5.0, -5.0, -9.0],
        [5.0, -5.0, -9.0],
        [0.0, 5.0, -9.0],
        // A needle that starts at the origin.
        [0.0, 0.0, 1.0],
        [0.01, 0.01, -4.0],
        [0.03, 0.0, -4.0],
    ];
    let mesh = mesh(&corners, &[[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11], [12, 13, 14]]);
    let through = grid(50, 0.5).chain([DVec3::new(0.004, 0.003, 0.0)]);
    let hits = judged(&mesh, &rays(origin, through));
    let met = |facet: u32| hits.iter().flatten().filter(|hit| hit.facet == facet).count();
    assert!(met(0) > 500 && met(3) > 200, "{} {}", met(0), met(3));
    assert_eq!(met(1) + met(2), 0);
    let fan_rays = rays(origin, grid(50, 0.5));
    let fan = Fan::new(&fan_rays).unwrap();
    // Of the left-out facets only those that rays may meet have a hierarchy.
    assert_eq!(Picture::new(&fan, &mesh).left_out(), [0, 4]);
    let ball = solids::icosphere(0.5, 2);
    assert!(Picture::new(&fan, &ball).left_out().is_empty());
}

#[test]
fn needles_and_slivers() {
    // A fan of needles 1 m long and 1 µm wide, and slivers seen almost edge-on.
    let mut mesh = Mesh::default();
    for i in 0..400u32 {
        let x = 1e-6 * f64::from(i);
        let n = mesh.vertices.len() as u32;
        mesh.vertices.extend([
            DVec3::new(x, -0.5, 0.0),
            DVec3::new(x + 1e-6, -0.5, 0.0),
            DVec3::new(x, 0.5, 0.1),
            DVec3::new(0.1 + x, 0.0, 0.0),
            DVec3::new(0.1 + x * 1.1, 0.2, 0.3),
            DVec3::new(0.1 + x, 0.1, -3.0),
        ]);
        mesh.facets.extend([[n, n + 1, n + 2], [n + 3, n + 4, n + 5]]);
    }
    let aims = (0..3000).map(|i| DVec3::new(1.7e-7 * f64::from(i), 0.31, 0.0));
    let hits = judged(&mesh, &rays(DVec3::new(0.0, 0.0, 8.0), aims));
    assert!(hits.iter().flatten().count() > 300);
    let aims = grid(40, 0.25).map(|at| at + DVec3::new(0.1, 0.1, 0.0));
    traced(&mesh, &rays(DVec3::new(0.1, 0.0, 8.0), aims));
}

#[test]
fn a_facet_without_area_is_met_by_nothing() {
    let corners =
        [[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [1.0, 1.0, -1.0]];
    let mesh = mesh(&corners, &[[0, 3, 2], [0, 0, 2], [0, 2, 4]]);
    let aims = (0..=1000).map(|i| DVec3::new(0.0, 1e-3 * f64::from(i), 0.0));
    assert!(traced(&mesh, &rays(DVec3::Z, aims)).iter().flatten().all(|hit| hit.facet == 2));
}

#[test]
fn rays_of_no_fan_are_refused() {
    assert_eq!(Fan::new(&[]).err(), Some(NoFan::Count { rays: 0 }));
    let mut around = rays(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 1.0, 1.0)]);
    assert!(Fan::new(&around).is_ok());
    around.push(ray(DVec3::ZERO, DVec3::NEG_X));
    assert!(matches!(Fan::new(&around).err(), Some(NoFan::Wide { .. })));
    around[2].origin = Point::new(0.0, 0.0, 1e-300);
    assert_eq!(Fan::new(&around).err(), Some(NoFan::Origins { ray: 2 }));
}

#[test]
fn the_bounds_hold() {
    // Random facets and points near their edges: what f32 calls sure is so in f64.
    let mut state = 1u64;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for round in 0..300 {
        let size = 10f64.powf(-3.0 * uniform());
        let mut near = |spread: f64| {
            DVec3::new(uniform() - 0.5, uniform() - 0.5, 0.3 * (uniform() - 0.5)) * spread
        };
        let middle = near(0.8);
        let corners = [0; 3].map(|_| (middle + near(size)).to_array());
        let mesh = mesh(&corners, &[[0, 1, 2]]);
        let [a, b, c] = mesh.corners(0);
        let aims = (0..200).map(|i| {
            let along = a.lerp(b, f64::from(i) / 199.0);
            // Up to some ten micrometres beside the edge, at every scale below.
            along + (c - along).normalize() * 1e-5 * 0.8f64.powi(i) * (-1.0f64).powi(i)
        });
        let field = [DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 0.0)];
        let hits = traced(&mesh, &rays(DVec3::new(0.0, 0.0, 8.0), aims.chain(field)));
        assert!(hits.iter().flatten().count() > 20, "{round}");
    }
}

proptest! {
    #[test]
    fn it_traces_as_the_naive_loop_does(
        mesh in soup(),
        // Within a facet: exactly on an outer edge the two may round to different sides.
        aims in prop::collection::vec((0usize..60, 0.01f64..0.49, 0.01f64..0.49), 40),
        far in 0.2f64..20.0,
    ) {
        let origin = DVec3::new(0.4, 0.3, far);
        let through = aims.into_iter().filter_map(|(facet, u, v)| {
            let facet = facet % mesh.facets.len();
            let [a, b, c] = mesh.corners(facet);
            let at = a + u * (b - a) + v * (c - a);
            // From within the soup only what is ahead.
            (!mesh.is_degenerate(facet) && at.z < far - 0.8 * at.distance(origin)).then_some(at)
        });
        let rays = rays(origin, through);
        if !rays.is_empty() {
            judged(&mesh, &rays);
        }
    }

    #[test]
    fn it_traces_as_the_hierarchy_does_on_edges_and_corners(
        mesh in soup(),
        far in 1.5f64..20.0,
    ) {
        traced(&mesh, &rays(DVec3::new(0.4, 0.3, far), edges(&mesh)));
    }
}
