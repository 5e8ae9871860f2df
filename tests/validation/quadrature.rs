//! Gauss and Legendre's rule, on one interval and on panels that narrow towards a peak.

use std::f64::consts::PI;

/// Nodes and weights on −1 to 1, by Newton's method from Tricomi's estimate.
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=count {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

/// ∫ f over `low` to `high` with so many nodes.
pub fn integral(nodes: usize, low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    points(nodes, &[low, high]).into_iter().map(|(x, weight)| weight * f(x)).sum()
}

/// Nodes and weights of the rule on every panel between ascending edges.
pub fn points(nodes: usize, edges: &[f64]) -> Vec<(f64, f64)> {
    let rule = gauss_legendre(nodes);
    let panel = |pair: &[f64]| {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        rule.iter().map(|(x, w)| (middle + half * x, half * w)).collect::<Vec<_>>()
    };
    edges.windows(2).flat_map(panel).collect()
}

/// Edges between `low` and `high` that lie the denser the nearer to `peak`, from `first` on.
pub fn graded_edges((low, high): (f64, f64), peak: f64, first: f64) -> Vec<f64> {
    const GROWTH: f64 = 2.5;
    let steps = || std::iter::successors(Some(first), |step| Some(step * GROWTH));
    let mut edges = vec![low, high];
    edges.extend(steps().map(|step| peak + step).take_while(|&edge| edge < high));
    edges.extend(steps().map(|step| peak - step).take_while(|&edge| edge > low));
    edges.extend([peak].into_iter().filter(|&edge| edge > low && edge < high));
    edges
}

/// In ascending order, without edges that nearly coincide.
pub fn sorted(mut edges: Vec<f64>) -> Vec<f64> {
    edges.sort_by(f64::total_cmp);
    edges.dedup_by(|b, a| *b - *a < 1e-9);
    edges
}
