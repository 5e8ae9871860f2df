//! How long the closest hits of a scan take, by the pinhole, the hierarchy and the naive loop, and on a
//! graphics processor where there is one and the program is built with `--features gpu`.
//!
//! `cargo bench --bench trace` runs the paper's scan on the mannequin and how times grow with facets and
//! rays, on one thread and on two; `-- paper` runs the first alone. Ways are taken in turns, and the
//! median of several is printed: ratios say something on any machine, times only on one. With `json`, too, a line
//! for each mesh and its rays has the quartiles of the graphics processor; without one nothing is traced.

#[path = "support/clock.rs"]
mod clock;

use clock::quartiles;
use glam::DVec3;
use matdb::frames::{Global, Point, Ray};
use matdb::geometry::Mesh;
use matdb::radar::{Chirps, Radar};
use matdb::scene::{mannequin, solids};
use matdb::trace::{Answer, Bvh, Fan, Gpu, GpuError, Tracer};

const ORIGIN: DVec3 = DVec3::new(0.0, 1.1, 8.0);

fn main() {
    let only_paper = is_given("paper");
    let gpu = Gpu::new();
    match &gpu {
        Ok(gpu) => println!("graphics processor: {}", gpu.adapter()),
        Err(GpuError::NotBuilt) => {}
        Err(error) => println!("{error}"),
    }
    let gpu = gpu.ok();
    if is_given("json") && gpu.is_none() {
        return;
    }
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            paper(threads, gpu.as_ref());
            if !only_paper {
                growth(threads, gpu.as_ref());
            }
        });
    }
}

fn is_given(word: &str) -> bool {
    std::env::args().any(|argument| argument == word)
}

/// The elliptical scan on the mannequin.
fn paper(threads: usize, gpu: Option<&Gpu>) {
    let radar = Radar::default();
    let scan = Chirps::draw(&radar, |_| Err("no file".to_owned())).expect("the paper's scan");
    let mesh = mannequin::mannequin();
    println!(
        "{} rays of the paper's scan, {} facets, {threads} threads",
        scan.rays.len(),
        mesh.facets.len()
    );
    compare(&mesh, &scan.rays, 41, gpu);
    let slow_ms = timed(|| Tracer::Brute.closest(&Bvh::new(&mesh), &scan.rays[..200]));
    println!(
        "  naive loop, from 200 of the rays: {:.0} ms",
        slow_ms * scan.rays.len() as f64 / 200.0
    );
}

/// Balls of ever more facets under ever more rays.
fn growth(threads: usize, gpu: Option<&Gpu>) {
    for subdivisions in [3, 5, 6, 8] {
        let mut ball = solids::icosphere(0.5, subdivisions);
        ball.vertices.iter_mut().for_each(|vertex| *vertex += 1.1 * DVec3::Y);
        for side in [100, 316, 1000] {
            println!(
                "{} rays, a ball of {} facets, {threads} threads",
                side * side,
                ball.facets.len()
            );
            compare(&ball, &square(side), 5, gpu);
        }
    }
}

/// Rays to a square grid of points.
fn square(side: usize) -> Vec<Ray<Global>> {
    const HALF_M: f64 = 0.55;
    let at = |i: usize| HALF_M * (2.0 * (i as f64 + 0.5) / side as f64 - 1.0);
    let origin = Point::from(ORIGIN);
    let ray = |i: usize| {
        let through = Point::new(at(i % side), 1.1 + at(i / side), 0.0);
        Ray { origin, direction: origin.towards(through).expect("two points") }
    };
    (0..side * side).map(ray).collect()
}

/// All ways in turns.
fn compare(mesh: &Mesh, rays: &[Ray<Global>], turns: usize, gpu: Option<&Gpu>) {
    let (mut hold, mut find, mut decide, mut unsure) = (vec![], vec![], vec![], 0);
    let (mut grid, mut pinhole, mut build, mut trace) = (vec![], vec![], vec![], vec![]);
    for _ in 0..turns {
        grid.push(timed(|| Fan::new(rays)));
        let fan = Fan::new(rays).expect("one origin");
        pinhole.push(timed(|| fan.closest(mesh)));
        let bvh = Bvh::new(mesh);
        build.push(timed(|| bvh.closest(&rays[0])));
        trace.push(timed(|| Tracer::Bvh.closest(&bvh, rays)));
        if let Some(gpu) = gpu {
            hold.push(timed(|| gpu.hold(&bvh).map(drop)));
            let held = gpu.hold(&bvh).expect("room for the mesh");
            find.push(timed(|| held.answers(rays)));
            decide.push(timed(|| held.closest(rays)));
            let answers = held.answers(rays).expect("a device that works");
            unsure = answers.iter().filter(|&&answer| answer == Answer::Unsure).count();
        }
    }
    let [grid, pinhole, build, trace] = [grid, pinhole, build, trace].map(median);
    println!(
        "  pinhole {pinhole:.3} ms, its grid once {grid:.3} ms; hierarchy {build:.2} + {trace:.2} ms; \
         ratio {:.1}, with the grid {:.1}",
        (build + trace) / pinhole,
        (build + trace) / (grid + pinhole)
    );
    if let Some(gpu) = gpu {
        let [holds, answers, hits] = [hold, find, decide].map(quartiles);
        if is_given("json") {
            println!(
                "{}",
                serde_json::json!({
                    "adapter": gpu.adapter(), "threads": rayon::current_num_threads(),
                    "facets": mesh.facets.len(), "rays": rays.len(),
                    "hold": holds, "answers": answers, "hits": hits,
                })
            );
        }
        let [hold, find, decide] = [holds, answers, hits].map(|[_, median, _]| median);
        println!(
            "  graphics processor: takes the hierarchy over in {hold:.2} ms, answers in {find:.2} ms, {:.2} million \
             rays a second, and leaves {unsure} open; hits in {decide:.2} ms, {:.2} of the hierarchy's time",
            rays.len() as f64 / find / 1e3,
            decide / trace
        );
    }
}

/// Time of a call, ms.
fn timed<T>(call: impl FnOnce() -> T) -> f64 {
    clock::timed(call).0
}

fn median(times_ms: Vec<f64>) -> f64 {
    quartiles(times_ms)[1]
}
