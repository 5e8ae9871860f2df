//! Searches from several starts, for each method.

use nalgebra::{DMatrix, DVector};

use super::coordinates::Coordinates;
use super::interval::{End, Profile};
use super::least_squares::{Deviations, Squares};
use super::likelihood::{Curvature, Likelihood};
use super::minimise::{Local, Minimise, Minimum, Stop};
use super::projection::Projection;
use super::settings::{Fit, Method};
use super::shapes;
use super::uncertainty::{Uncertainty, observed_information};
use crate::material::Observation;

/// Most steps of one search.
const ITERATIONS: usize = 200;
/// The search ends when a step promises less ln likelihood: a thousandth of what moves an interval.
const LIKELIHOOD_TOLERANCE: f64 = 1e-6;
/// Most steps of the approach with fixed looks, and the promised ln likelihood that ends it.
const APPROACH: usize = 40;
const NEAR: f64 = 1.0;
/// Steps with the second derivatives themselves, where the products of the scores do not arrive: of few rows they are a
/// poor guide. They promise less than this at the end.
const POLISH: Minimise = Minimise { iterations: 200, tolerance: 1e-5, patience: usize::MAX };
/// Least second derivative that counts, as a share of the largest.
const LEAST_BEND: f64 = 1e-12;
/// Least squares ends when a step promises to lower the cost by less; its parameters are compared with other programs.
const SQUARES_TOLERANCE: f64 = 1e-8;
/// Loss of cost that still counts as the same optimum.
const SAME: f64 = 0.01;
/// Difference in ln p of two halves of the starts from which more shapes are tried: these cost little.
const ALIKE: f64 = 0.1;
/// Difference in ln p of two halves of the starts that is more than chance: one standard deviation of one number.
const CHANCE: f64 = 0.5;
/// How many times the usual shapes are tried, one after the other.
const MORE_SHAPES: [usize; 3] = [1, 4, 16];

/// The result of a search.
pub(super) struct SearchResult {
    pub best: Minimum,
    pub agreeing: usize,
    pub uncertainty: Uncertainty,
    /// Profile intervals; empty for least squares.
    pub profiles: Vec<Option<[End; 2]>>,
}

impl Fit {
    /// Searches with this fit's method.
    pub(super) fn search(&self, coordinates: &Coordinates, rows: &[Observation]) -> SearchResult {
        match self.method {
            Method::Censored => self.search_likelihood(coordinates, rows),
            Method::Tls { .. } | Method::Mse { .. } => {
                let search = |start: &DVector<f64>| self.nearest_optimum(coordinates, rows, start);
                let (best, agreeing) = self.best(coordinates, rows, search);
                squares_found(coordinates, rows, best, agreeing)
            }
        }
    }

    /// Where the search ends from this point of it.
    pub(super) fn nearest_optimum(
        &self,
        coordinates: &Coordinates,
        rows: &[Observation],
        start: &DVector<f64>,
    ) -> Minimum {
        match self.method {
            Method::Censored => {
                let likelihood = Likelihood::new(coordinates, rows, self.noise_w.unwrap_or(0.0));
                let cost = |at: &DVector<f64>| likelihood.local(Curvature::Scores, at);
                polished(
                    coordinates,
                    search_freely(&likelihood_search(), coordinates, start, cost),
                    cost,
                )
            }
            Method::Tls { theta_sd_rad, level_sd_db } => {
                let deviations = Deviations { theta_sd_rad, level_sd_db };
                let squares = Squares::new(coordinates, rows, deviations);
                search_freely(&squares_search(), coordinates, start, |at| squares.local(at))
            }
            Method::Mse { split_rad } => pieces(coordinates, rows, split_rad, start),
        }
    }

    fn search_likelihood(&self, coordinates: &Coordinates, rows: &[Observation]) -> SearchResult {
        let likelihood = Likelihood::new(coordinates, rows, self.noise_w.unwrap_or(0.0));
        let cost = |at: &DVector<f64>| likelihood.local(Curvature::Scores, at);
        let (best, agreeing) = self.likeliest(coordinates, rows, &likelihood);
        let information = observed_information(coordinates, &best.at, &best.local, cost);
        let mut uncertainty = Uncertainty::new(coordinates, &best.at, &information);
        uncertainty.join(&coordinates.redundant);
        let search = Minimise { tolerance: 1e3 * LIKELIHOOD_TOLERANCE, ..likelihood_search() };
        let profile = Profile { coordinates, best: &best, uncertainty: &uncertainty, search, cost };
        let mut profiles = Vec::new();
        for index in 0..coordinates.len() {
            let wanted = best.converged() && uncertainty.is_identified(index);
            profiles.push(if wanted { profile.interval(index) } else { None });
        }
        SearchResult { best, agreeing, uncertainty, profiles }
    }

    /// The most likely end of all searches, one that converged if any did, and how many of them reached it. The starts
    /// come from two halves of the shapes, the given one with the second. Where the halves do not end alike, more shapes
    /// are tried.
    fn likeliest(
        &self,
        coordinates: &Coordinates,
        rows: &[Observation],
        likelihood: &Likelihood,
    ) -> (Minimum, usize) {
        let own = search_from(coordinates, likelihood, &coordinates.start());
        if self.starts == 1 {
            return (own, 1);
        }
        let mut least = [f64::INFINITY, own.local.value];
        let mut ends = vec![own];
        let projection = Projection::new(coordinates, rows, self.noise_w.unwrap_or(0.0));
        let counts = [self.starts / 2, (self.starts - 1) / 2].map(|count| count.max(1));
        for factor in MORE_SHAPES {
            for half in 0..2 {
                for start in projection.starts(half, factor, counts[half]) {
                    let end = search_from(coordinates, likelihood, &start);
                    least[half] = least[half].min(end.local.value);
                    ends.push(end);
                }
            }
            if (least[0] - least[1]).abs() <= ALIKE {
                break;
            }
        }
        let metals: Vec<DVector<f64>> =
            ends.iter().filter_map(|end| metal(coordinates, &end.at)).collect();
        ends.extend(metals.iter().map(|at| search_from(coordinates, likelihood, at)));
        ends.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
        let limit = rank(&ends[0]) + SAME;
        let agreeing = ends.iter().filter(|end| rank(end) <= limit).count();
        let arrived = ends.iter().take(agreeing).position(Minimum::converged);
        let mut best = ends.swap_remove(arrived.unwrap_or(0));
        if (least[0] - least[1]).abs() > CHANCE {
            best.stop = Stop::StartsDisagree;
        }
        (best, agreeing.min(self.starts))
    }

    /// The lowest cost of all starts, and how many starts reached it.
    fn best(
        &self,
        coordinates: &Coordinates,
        rows: &[Observation],
        search: impl Fn(&DVector<f64>) -> Minimum,
    ) -> (Minimum, usize) {
        let mut best = search(&coordinates.start());
        let mut costs = vec![best.local.value];
        for start in self.other_starts(coordinates, rows) {
            let found = search(&start);
            costs.push(found.local.value);
            let improves = found.local.value < best.local.value || !best.local.value.is_finite();
            if improves && found.local.value.is_finite() {
                best = found;
            }
        }
        let agreeing = costs.iter().filter(|cost| **cost - best.local.value <= SAME).count();
        (best, agreeing)
    }

    /// Starts beside the given one: the best of all shapes, and drawn ones where those are fewer than wanted.
    fn other_starts(&self, coordinates: &Coordinates, rows: &[Observation]) -> Vec<DVector<f64>> {
        let wanted = self.starts - 1;
        if wanted == 0 {
            return Vec::new();
        }
        let rows = shapes::sample(rows);
        let mut starts = match self.method {
            Method::Tls { theta_sd_rad, level_sd_db } => {
                let deviations = Deviations { theta_sd_rad, level_sd_db };
                let squares = Squares::new(coordinates, &rows, deviations);
                shapes::starts(coordinates, wanted, |at| squares.local(at))
            }
            // In two pieces there is no cost of all numbers; a likelihood has starts of its own.
            Method::Mse { .. } | Method::Censored => Vec::new(),
        };
        for number in starts.len() + 1..=wanted {
            starts.push(coordinates.drawn(self.seed, number));
        }
        starts
    }
}

fn likelihood_search() -> Minimise {
    Minimise { iterations: ITERATIONS, tolerance: LIKELIHOOD_TOLERANCE, patience: usize::MAX }
}

fn squares_search() -> Minimise {
    Minimise { iterations: ITERATIONS, tolerance: SQUARES_TOLERANCE, patience: usize::MAX }
}

fn search_freely(
    search: &Minimise,
    coordinates: &Coordinates,
    start: &DVector<f64>,
    cost: impl Fn(&DVector<f64>) -> Local,
) -> Minimum {
    let [lower, upper] = coordinates.bounds(start);
    search.run(start, [&lower, &upper], cost)
}

/// A search that ended at the largest permittivity, started again at the least one: a dielectric of 10⁹ still lets a
/// ten-thousandth in, and a metal nothing.
fn metal(coordinates: &Coordinates, at: &DVector<f64>) -> Option<DVector<f64>> {
    let index = (0..at.len()).find(|&index| {
        let number = &coordinates.list[index];
        let ([low, high], [rising, _]) = (number.ends(), number.rising_ends());
        low < rising && at[index] == high
    })?;
    let mut metal = at.clone();
    metal[index] = coordinates.list[index].ends()[0];
    Some(metal)
}

/// The cost of an end; one without a finite cost is the worst.
fn rank(end: &Minimum) -> f64 {
    if end.local.value.is_finite() { end.local.value } else { f64::INFINITY }
}

/// Where a search of the likelihood ends from a start that may be far.
fn search_from(
    coordinates: &Coordinates,
    likelihood: &Likelihood,
    start: &DVector<f64>,
) -> Minimum {
    let approach = Minimise { iterations: APPROACH, tolerance: NEAR, patience: usize::MAX };
    let from_afar = |at: &DVector<f64>| likelihood.local(Curvature::FromAfar, at);
    let cost = |at: &DVector<f64>| likelihood.local(Curvature::Scores, at);
    // With free looks the search would explain a far start by strong speckle instead of improving it.
    let [lower, upper] = coordinates.holding_looks(start);
    let near = approach.run(start, [&lower, &upper], from_afar);
    // Where angles are exact, this curvature is nearer to the true one than that of the scores.
    let search = Minimise { iterations: APPROACH, ..likelihood_search() };
    let near = search_freely(&search, coordinates, &near.at, from_afar);
    let end = search_freely(&likelihood_search(), coordinates, &near.at, cost);
    polished(coordinates, end, cost)
}

/// A search that did not arrive, continued with the second derivatives themselves.
fn polished(
    coordinates: &Coordinates,
    found: Minimum,
    cost: impl Fn(&DVector<f64>) -> Local,
) -> Minimum {
    if found.converged() || found.stop == Stop::NotFinite {
        return found;
    }
    let better = search_freely(&POLISH, coordinates, &found.at, |at| {
        let local = cost(at);
        let bends = observed_information(coordinates, at, &local, &cost);
        if !local.value.is_finite() || bends.iter().any(|bend| !bend.is_finite()) {
            return local;
        }
        let mut bends = bends.symmetric_eigen();
        // Where it bends down, a step as long as where it bends up as much.
        let most = bends.eigenvalues.amax();
        bends.eigenvalues.apply(|bend| *bend = bend.abs().max(LEAST_BEND * most));
        Local { curvature: bends.recompose(), ..local }
    });
    Minimum { iterations: found.iterations + better.iterations, ..better }
}

/// Information of least squares: the curvature over the residuals' own variance.
fn squares_found(
    coordinates: &Coordinates,
    rows: &[Observation],
    best: Minimum,
    agreeing: usize,
) -> SearchResult {
    let detected = rows.iter().filter(|row| !row.is_censored()).count();
    let spare = (detected - coordinates.len().min(detected)).max(1) as f64;
    let variance = (2.0 * best.local.value / spare).max(f64::MIN_POSITIVE);
    let information = &best.local.curvature / variance;
    let uncertainty = Uncertainty::new(coordinates, &best.at, &information);
    SearchResult { best, agreeing, uncertainty, profiles: Vec::new() }
}

/// Specular coordinates below the split, then diffuse ones above it; all at once without pieces.
fn pieces(
    coordinates: &Coordinates,
    rows: &[Observation],
    split_rad: f64,
    start: &DVector<f64>,
) -> Minimum {
    let Some(diffuse) = coordinates.is_diffuse() else {
        let all = vec![true; start.len()];
        return piece(coordinates, rows, &all, start);
    };
    let specular: Vec<bool> = diffuse.iter().map(|is_diffuse| !is_diffuse).collect();
    let (near, far): (Vec<Observation>, Vec<Observation>) =
        rows.iter().partition(|row| row.theta_i_rad < split_rad);
    let first = piece(coordinates, &near, &specular, start);
    let second = piece(coordinates, &far, &diffuse, &first.at);
    Minimum {
        iterations: first.iterations + second.iterations,
        stop: if first.converged() { second.stop } else { first.stop },
        at: second.at,
        local: first.local.merge(second.local),
    }
}

/// Least squares of some coordinates on some rows; a piece without rows stays at its start.
fn piece(
    coordinates: &Coordinates,
    rows: &[Observation],
    moves: &[bool],
    start: &DVector<f64>,
) -> Minimum {
    const DB: Deviations = Deviations { theta_sd_rad: 0.0, level_sd_db: 1.0 };
    let (mut lower, mut upper) = (coordinates.lower(), coordinates.upper());
    let start = start.zip_zip_map(&lower, &upper, |u, low, high| u.max(low).min(high));
    for (index, _) in moves.iter().enumerate().filter(|(_, moves)| !**moves) {
        (lower[index], upper[index]) = (start[index], start[index]);
    }
    let squares = Squares::new(coordinates, rows, DB);
    let mut found = squares_search().run(&start, [&lower, &upper], |at| squares.local(at));
    let mask = DVector::from_iterator(moves.len(), moves.iter().map(|&m| f64::from(u8::from(m))));
    let mask: DMatrix<f64> = &mask * mask.transpose();
    found.local.curvature.component_mul_assign(&mask);
    if found.stop == Stop::Bounded && !moves.contains(&true) {
        found.stop = Stop::Stationary;
    }
    found
}
