//! Promise: the fast tracer and the naive loop agree on every chirp of every scene: the same facet at
//! the same range and angle, or on a shared edge the other facet at the same range.

mod support;

use matdb::render::trace;
use matdb::scene::Scene;
use matdb::trace::{Bvh, brute};
use rayon::prelude::*;

/// Both measure in f64 by different formulas; at 8 m a unit in the last place is 2e-15 m.
const RANGE: f64 = 1e-12;
/// Rounding of the facet's normal.
const COSINE: f64 = 1e-12;

fn check(name: &str) {
    let scene = Scene::load(&support::scene(name)).unwrap();
    let rays = &scene.chirps.rays;
    let mesh = &scene.target.mesh;
    let fast = trace(scene.radar(), &scene.chirps, &Bvh::new(mesh), 1, &|_| {}).unwrap().hits;
    let slow: Vec<_> = rays.par_iter().map(|ray| brute::closest(mesh, ray)).collect();
    assert_eq!(fast.len(), 18_529);
    assert!(slow.iter().flatten().count() > 1000);
    for (chirp, pair) in fast.iter().zip(&slow).enumerate() {
        match pair {
            (None, None) => {}
            (Some(fast), Some(slow)) => {
                let apart_m = (fast.range_m - slow.range_m).abs();
                assert!(apart_m < RANGE * slow.range_m, "chirp {chirp}: {fast:?} is not {slow:?}");
                assert!(fast.point.distance_m(slow.point) < RANGE * slow.range_m);
                let turned = (fast.cos_theta - slow.cos_theta).abs();
                assert!(fast.facet != slow.facet || turned < COSINE, "chirp {chirp}");
            }
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
