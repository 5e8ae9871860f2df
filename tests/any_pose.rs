//! Promise: where the radar and the target stand together does not matter. A radar with its own τ, α
//! and reflector, moved rigidly with its target, sees what the straight one sees.

use crate::support;
use glam::DVec3;
use matdb::brdf::Lambert;
use matdb::frames::{Global, Model, Point, Pose};
use matdb::geometry::Mesh;
use matdb::radar::{Chirps, Radar};
use matdb::render::Echo;
use matdb::scene::mannequin;
use matdb::units::dbm_from_watts;

/// Metres and dB that rounding may move.
const ROUNDING: f64 = 1e-9;

fn echoes(radar: &Radar, mesh: &Mesh) -> Vec<Echo> {
    let chirps = Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap();
    support::echoes(radar, &chirps, mesh, &Lambert { albedo: 0.5 })
}

fn facet(echo: &Echo) -> Option<u32> {
    echo.truth.map(|truth| truth.hit.facet)
}

fn moved(mesh: &Mesh, pose: Pose<Global, Model>) -> Mesh {
    let vertices = mesh.vertices.iter().map(|&vertex| (pose * Point::from(vertex)).xyz).collect();
    Mesh { vertices, ..mesh.clone() }
}

fn assert_same(radar: &Radar, mesh: &Mesh, other_radar: &Radar, other_mesh: &Mesh) {
    let (these, those) = (echoes(radar, mesh), echoes(other_radar, other_mesh));
    assert!(these.len() > 10_000 && these.len().abs_diff(those.len()) < 5);
    let mut compared = 0;
    for (a, b) in std::iter::zip(&these, &those).filter(|(a, b)| facet(a) == facet(b)) {
        for (a, b) in [
            (a.xt_m, b.xt_m),
            (a.yt_m, b.yt_m),
            (a.range_m, b.range_m),
            (dbm_from_watts(a.power_w), dbm_from_watts(b.power_w)),
        ] {
            assert!((a - b).abs() < ROUNDING, "{a} is not {b}");
        }
        compared += 1;
    }
    assert!(compared > 10_000);
}

#[test]
fn a_radar_turned_by_alpha_and_tau_sees_a_target_turned_with_it() {
    let straight = Radar::default();
    let turned = Radar {
        tau_deg: 12.0,
        alpha_deg: -50.0,
        secondary_focus_m: [0.7, -0.1, -7.5],
        primary_focus_m: [3.0, 1.4, -2.0],
        ..Radar::default()
    };
    let mesh = mannequin::mannequin();
    let target_from_straight = straight.frames().global_from_target.inverse();
    let turned_from_straight = turned.frames().global_from_target * target_from_straight;
    let pose = Pose::new(turned_from_straight.rotation(), turned_from_straight.translation_m());
    assert_same(&straight, &mesh, &turned, &moved(&mesh, pose));
}

#[test]
fn tau_and_alpha_turn_the_papers_way() {
    // By hand from (3) and (4): r_g = O_a + M(α)(O_t + Ry(τ) r_t) with r_t = (1, 2, 3).
    let (tau, alpha) = (0.2f64, -1.3f64);
    let radar = Radar {
        tau_deg: tau.to_degrees(),
        alpha_deg: alpha.to_degrees(),
        secondary_focus_m: [0.5, 0.25, -8.0],
        primary_focus_m: [1.0, 1.1, 7.0],
        ..Radar::default()
    };
    let antenna = DVec3::new(
        0.5 + tau.cos() - 3.0 * tau.sin(),
        0.25 + 2.0,
        -8.0 + tau.sin() + 3.0 * tau.cos(),
    );
    let global = DVec3::new(
        1.0 - alpha.sin() * antenna.x - alpha.cos() * antenna.z,
        1.1 + antenna.y,
        7.0 + alpha.cos() * antenna.x - alpha.sin() * antenna.z,
    );
    let found = radar.frames().global_from_target * Point::new(1.0, 2.0, 3.0);
    assert!(found.xyz.distance(global) < 1e-12);
}

#[test]
fn a_reflector_off_the_axis_still_aims_at_its_target_plane() {
    let radar = Radar { reflector_centre_m: [0.9, -0.4, 7.9], ..Radar::default() };
    let frames = radar.frames();
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    let field = chirps.field(&frames);
    let [width_m, height_m] = field.sides_m();
    assert!((width_m - 0.5).abs() < 0.02 && (height_m - 0.9).abs() < 0.02, "{field}");
    // The middle of the field is the secondary focus, where the undeflected beam goes.
    let middle_m = [0, 1].map(|axis| 0.5 * (field.min_m[axis] + field.max_m[axis]));
    assert!(middle_m.iter().all(|m| m.abs() < 0.02), "{field}");
}
