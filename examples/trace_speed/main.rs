//! Milliseconds that the closest hits of rays from a file take, one JSON line for every line on stdin:
//! the half that `benches/rivals/tracers/` starts.
//!
//!     cargo run --release --example trace_speed -- write MESH RAYS
//!     cargo run --release --example trace_speed -- pinhole|bvh MESH RAYS HITS
//!     cargo run --release --example trace_speed -- power
//!
//! `write` writes the mannequin and the rays of the paper's scan; `power` turns the hits of that scan into
//! echoes.

mod files;
#[path = "../support/turns.rs"]
mod turns;

use std::hint::black_box;

use matdb::frames::{Global, Ray};
use matdb::geometry::Mesh;
use matdb::material::builtin;
use matdb::radar::{Chirps, Radar};
use matdb::render::{Observer, Setup, Surface, shade, trace};
use matdb::scene::mannequin::mannequin;
use matdb::trace::{Bvh, Fan, Hit, ScanGeometry, Tracer};
use serde_json::{Value, json};
use turns::{Answer, join_pool, serve, timed};

type Hits = Vec<Option<Hit>>;

fn main() -> Answer<()> {
    join_pool()?;
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", mesh, rays] => {
            files::write_mesh(mesh.as_ref(), &mannequin())?;
            Ok(files::write_rays(rays.as_ref(), &scan(&Radar::default())?.rays)?)
        }
        ["pinhole", mesh, rays, hits] => tracer(mesh, rays, hits, pinhole),
        ["bvh", mesh, rays, hits] => tracer(mesh, rays, hits, hierarchy),
        ["power"] => power(),
        _ => Err("the head of this example tells the arguments".into()),
    }
}

fn tracer(
    mesh: &str,
    rays: &str,
    hits: &str,
    closest: impl Fn(&Mesh, &[Ray<Global>]) -> Answer<(Value, Hits)>,
) -> Answer<()> {
    let (mesh, rays) = (files::read_mesh(mesh.as_ref())?, files::read_rays(rays.as_ref())?);
    let mut found = Vec::new();
    serve(|| {
        // Those of the last turn first, so that they are not held twice.
        found = Vec::new();
        let (times_ms, hits) = closest(&mesh, &rays)?;
        found = hits;
        Ok(times_ms)
    })?;
    Ok(files::write_hits(hits.as_ref(), &found)?)
}

fn pinhole(mesh: &Mesh, rays: &[Ray<Global>]) -> Answer<(Value, Hits)> {
    let (once_ms, fan) = timed(|| Fan::new(rays));
    let fan = fan?;
    let (trace_ms, hits) = timed(|| fan.closest(mesh));
    Ok((json!({ "once": once_ms, "build": 0.0, "trace": trace_ms }), hits))
}

fn hierarchy(mesh: &Mesh, rays: &[Ray<Global>]) -> Answer<(Value, Hits)> {
    let bvh = Bvh::new(mesh);
    // It is built for the first ray.
    let (build_ms, _) = timed(|| rays.first().map(|ray| bvh.closest(ray)));
    let (trace_ms, hits) = timed(|| Tracer::Bvh.closest(&bvh, rays));
    Ok((json!({ "build": build_ms, "trace": trace_ms }), hits?))
}

/// From the hits of the paper's scan on the mannequin to its echoes.
fn power() -> Answer<()> {
    let (radar, mesh) = (Radar::default(), mannequin());
    let (chirps, bvh, regions) = (scan(&radar)?, Bvh::new(&mesh), vec![0; mesh.facets.len()]);
    let paint = builtin::get("mannequin-paint").ok_or("no such material")??.scattering()?;
    let surfaces = [Surface::new(&paint)];
    let geometry = ScanGeometry::new(&radar, &chirps, &bvh, &regions);
    let footprints = trace(&geometry, 1, &|_| {})?;
    let setup = Setup::new(geometry, &surfaces);
    serve(|| {
        let (power_ms, scan) = timed(|| shade(&setup, &footprints, Observer::Radar, &|_| {}));
        black_box(scan?);
        Ok(json!({ "power": power_ms }))
    })
}

fn scan(radar: &Radar) -> Answer<Chirps> {
    Ok(Chirps::draw(radar, |_| Err("no file".to_owned()))?)
}
