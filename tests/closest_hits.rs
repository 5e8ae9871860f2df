//! Promise: the fast tracer and the naive loop agree on every chirp of every scene.

mod support;

use matdb::scene::Scene;
use matdb::trace::{brute, closest_hits};
use rayon::prelude::*;

/// Two facets may share the point: then the ranges agree, relative.
const RANGE: f64 = 1e-6;

fn check(name: &str) {
    let scene = Scene::load(&support::scene(name)).unwrap();
    let rays = &scene.chirps.rays;
    let mesh = &scene.target.mesh;
    let fast = closest_hits(mesh, rays, &|_| {});
    let slow: Vec<_> = rays.par_iter().map(|ray| brute::closest(mesh, ray)).collect();
    assert_eq!(fast.len(), 18_529);
    assert!(slow.iter().flatten().count() > 1000);
    for (chirp, pair) in fast.iter().zip(&slow).enumerate() {
        match pair {
            (None, None) => {}
            (Some(fast), Some(slow)) => assert!(
                fast.facet == slow.facet
                    || (fast.range_m - slow.range_m).abs() < RANGE * slow.range_m,
                "chirp {chirp}: {fast:?} is not {slow:?}"
            ),
            _ => panic!("chirp {chirp}: {pair:?}"),
        }
    }
}

#[test]
fn on_the_mannequin() {
    check("mannequin.toml");
}

#[test]
fn on_the_human() {
    check("human.toml");
}
