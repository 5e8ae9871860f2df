//! Milliseconds per fit of a curve from a file, one JSON line for every line on stdin: the half that
//! `benches/rivals/fits.py` starts.
//!
//!     cargo run --release --example fit_speed -- curve.csv            one fit of each kind
//!     cargo run --release --example fit_speed -- curve.csv refits     least squares of 1 000 curves drawn from it

#[path = "support/turns.rs"]
mod turns;

use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Shadowing};
use matdb::fit::{Fit, Method};
use matdb::measure::curve::Curve;
use rayon::prelude::*;
use turns::{Answer, join_pool, serve, timed};

const LEVEL_SD_DB: f64 = 2.0;
const THETA_SD_DEG: f64 = 1.0;

/// m = 0.1, α = 2, S = 0.07, R = 0.006.
fn start() -> Brdf {
    let specular = CookTorrance {
        f_lambda: 0.1,
        m: 0.1,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    };
    let diffuse = Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.02, alpha: 2.0 }));
    let specular = Box::new(Brdf::CookTorrance(specular));
    Brdf::Mixture(Mixture { k: 0.3, diffuse, specular })
}

/// Bootstrap curves that are fitted in a turn.
const REFITS: u64 = 1000;

/// As many rows as the curve has, drawn with replacement (SplitMix64 of the number).
fn drawn(curve: &Curve, number: u64) -> Curve {
    let mut state = number << 32;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as usize
    };
    let rows = &curve.observations;
    let observations = rows.iter().map(|_| rows[next() % rows.len()]).collect();
    Curve { observations, ..Curve::default() }
}

/// Milliseconds of all refits, each from what the curve itself gave, and how many of them converged.
fn refits(fit: &Fit, curve: &Curve) -> Answer<()> {
    let start = fit.run(&start(), curve)?.model;
    serve(|| {
        let again = |number| fit.run(&start, &drawn(curve, number)).is_ok_and(|fit| fit.converged);
        let (ms, converged) =
            timed(|| (0..REFITS).into_par_iter().filter(|number| again(*number)).count());
        Ok(serde_json::json!({ "ms": ms, "refits": REFITS, "converged": converged }))
    })
}

fn main() -> Answer<()> {
    join_pool()?;
    let path = std::env::args().nth(1).ok_or("give a curve: theta_deg,sigma0_db")?;
    let curve = Curve::read(&std::fs::read(path)?)?;
    let squares = |theta_sd_rad| {
        let method = Method::Tls { theta_sd_rad, level_sd_db: LEVEL_SD_DB };
        Fit { method, starts: 1, ..Fit::default() }
    };
    if std::env::args().nth(2).as_deref() == Some("refits") {
        return refits(&squares(0.0), &curve);
    }
    let censored = Fit { starts: 1, ..Fit::default() };
    let fits = [
        ("least squares", squares(0.0)),
        ("orthogonal distance", squares(THETA_SD_DEG.to_radians())),
        ("censored, with profiles", censored),
    ];
    serve(|| {
        let mut found = serde_json::Map::new();
        for (name, fit) in &fits {
            let (ms, result) = timed(|| fit.run(&start(), &curve));
            let result = result?;
            let value = |name: &str| result.estimate(name).map(|e| e.value);
            let values = ["specular.m", "diffuse.alpha", "S", "R"].map(value);
            let (converged, iterations) = (result.converged, result.iterations);
            let entry = serde_json::json!({
                "ms": ms, "values": values, "converged": converged, "iterations": iterations,
            });
            found.insert((*name).to_owned(), entry);
        }
        Ok(serde_json::Value::Object(found))
    })
}
