//! The base law refitted: Levenberg–Marquardt on decibels over S, m, R and α, from three starts.
//!
//! What it leaves is the strength of an effect: the part that no choice of the four identified
//! parameters can take up. A prediction below the threshold counts as the threshold, because a chirp
//! that was detected all the same is expected just above it: otherwise one grazing chirp, 40 dB off,
//! would outweigh a thousand others.

use nalgebra::{Matrix4, Vector4};

use super::base::{Base, Local};

/// One detected chirp of the declared geometry.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub cos_theta: f64,
    /// Power per f, W·sr: P_t·L·A_eq/R²·cos²θ.
    pub watts_per_f: f64,
    pub power_db: f64,
    /// Width of the beam's slopes, as a tangent.
    pub beam_slope: f64,
}

/// ln S, ln m, ln R, α.
type Parameters = Vector4<f64>;

const DB_PER_NEPER: f64 = 10.0 / std::f64::consts::LN_10;
const STEPS: usize = 40;
/// A step that takes off less than this share of the sum of squares is the last.
const GAIN: f64 = 1e-5;

/// What the instrument is declared to be, W.
#[derive(Clone, Copy, Debug)]
pub struct Floor {
    pub noise_w: f64,
    pub threshold_w: f64,
}

/// Root mean square, dB, that the best base law leaves.
pub fn rms_left_db(points: &[Point], start: &Base, floor: Floor) -> f64 {
    let local = start.local();
    let starts = [(1.0, local.alpha), (0.6, 1.0), (1.7, 10.0)];
    let best = starts.iter().map(|&(wider, alpha)| {
        let m = (local.m[0] * wider).min(1.5);
        let from = [local.specular.ln(), m.ln(), local.diffuse.ln(), alpha];
        minimise(points, local, floor, Vector4::from(from))
    });
    (best.fold(f64::INFINITY, f64::min) / points.len().max(1) as f64).sqrt()
}

/// The least sum of squares, dB², that a start leads to.
fn minimise(points: &[Point], law: Local, floor: Floor, mut at: Parameters) -> f64 {
    let mut damping = 1e-3;
    let (mut cost, mut normal, mut slope) = expand(points, law, floor, &at);
    for _ in 0..STEPS {
        let damped =
            normal + Matrix4::from_diagonal(&(normal.diagonal() * damping).add_scalar(1e-9));
        let Some(step) = damped.lu().solve(&slope) else { break };
        let to = within(at + step);
        let (trial, n, s) = expand(points, law, floor, &to);
        if trial < cost {
            let little = cost - trial < GAIN * cost;
            (at, cost, normal, slope) = (to, trial, n, s);
            damping = (damping * 0.2).max(1e-9);
            if little {
                break;
            }
        } else {
            damping *= 8.0;
            if damping > 1e8 {
                break;
            }
        }
    }
    cost
}

/// The bounds of the program's own models.
fn within(p: Parameters) -> Parameters {
    let bound = |x: f64, low: f64, high: f64| x.clamp(low, high);
    const LEAST: f64 = -40.0;
    Vector4::new(
        bound(p[0], LEAST, 0.0),
        bound(p[1], 0.001f64.ln(), 2f64.ln()),
        bound(p[2], LEAST, 0.0),
        bound(p[3], 0.0, 1000.0),
    )
}

fn law_at(law: Local, p: &Parameters) -> Local {
    let m = [p[1].exp(); 2];
    Local { specular: p[0].exp(), m, diffuse: p[2].exp(), alpha: p[3], ..law }
}

/// Sum of squares, JᵀJ and Jᵀr.
fn expand(
    points: &[Point],
    law: Local,
    floor: Floor,
    at: &Parameters,
) -> (f64, Matrix4<f64>, Vector4<f64>) {
    const STEP: f64 = 1e-5;
    let here = law_at(law, at);
    let specular = Local { diffuse: 0.0, ..here };
    let diffuse = Local { specular: 0.0, ..here };
    let moved = |index: usize| {
        let mut p = *at;
        p[index] += STEP;
        law_at(law, &p)
    };
    let (wider, steeper) = (moved(1), moved(3));
    let (mut cost, mut normal, mut slope) = (0.0, Matrix4::zeros(), Vector4::zeros());
    for point in points {
        let (cos, beam_slope) = (point.cos_theta, point.beam_slope);
        let s = Local { beam_slope, ..specular }.f_per_sr(cos);
        let d = diffuse.f_per_sr(cos);
        let total_w = point.watts_per_f * (s + d) + floor.noise_w;
        let per_f = DB_PER_NEPER * point.watts_per_f / total_w;
        let by_m = (Local { diffuse: 0.0, beam_slope, ..wider }.f_per_sr(cos) - s) / STEP;
        let by_alpha = (Local { specular: 0.0, ..steeper }.f_per_sr(cos) - d) / STEP;
        let j = Vector4::new(s, by_m, d, by_alpha) * per_f;
        let r = point.power_db - DB_PER_NEPER * total_w.max(floor.threshold_w).ln();
        cost += r * r;
        if total_w < floor.threshold_w {
            continue;
        }
        normal += j * j.transpose();
        slope += j * r;
    }
    (cost, normal, slope)
}
