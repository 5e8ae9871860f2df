//! Milliseconds per fit of a curve from a file, as JSON: the half that `benches/rivals/fits.py` starts.
//!
//!     cargo run --release --example fit_speed -- curve.csv

use std::time::Instant;

use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Shadowing};
use matdb::fit::{Fit, Method};
use matdb::measure::curve::Curve;

const REPEATS: usize = 21;
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

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give a curve: theta_deg,sigma0_db")?;
    let curve = Curve::read(&std::fs::read(path)?)?;
    let squares = |theta_sd_rad| {
        let method = Method::Tls { theta_sd_rad, level_sd_db: LEVEL_SD_DB };
        Fit { method, starts: 1, ..Fit::default() }
    };
    let censored = Fit { starts: 1, ..Fit::default() };
    let fits = [
        ("least squares", squares(0.0)),
        ("orthogonal distance", squares(THETA_SD_DEG.to_radians())),
        ("censored, with profiles", censored),
    ];
    let mut found = serde_json::Map::new();
    for (name, fit) in fits {
        let mut times_ms = Vec::new();
        let mut result = fit.run(&start(), &curve)?;
        for _ in 0..REPEATS {
            let began = Instant::now();
            result = fit.run(&start(), &curve)?;
            times_ms.push(1e3 * began.elapsed().as_secs_f64());
        }
        times_ms.sort_by(f64::total_cmp);
        let value = |name: &str| result.estimate(name).map(|e| e.value);
        let values = ["specular.m", "diffuse.alpha", "S", "R"].map(value);
        let entry = serde_json::json!({
            "ms": times_ms[REPEATS / 2],
            "values": values,
            "converged": result.converged,
            "iterations": result.iterations,
        });
        found.insert(name.to_owned(), entry);
    }
    println!("{}", serde_json::Value::Object(found));
    Ok(())
}
