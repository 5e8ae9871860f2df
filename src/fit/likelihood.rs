//! The default: the censored Gamma likelihood with the angle error marginalised.
//!
//! A detected power y has the density g(y; L, μ) of Gamma(L, μ/L), a chirp without a detection the
//! probability G(T; L, μ) of staying below the threshold T. μ = σ⁰(t) + thermal noise, t the true
//! angle. Where only detections were recorded, each is divided by the probability of passing its threshold, the mean
//! of 1 − G over t. Each chirp has one unknown but fixed t, so the likelihood is averaged over t,
//! p(y) = Σ_q w_q·g(y; L, μ(t_q)), not the mean: averaging μ would smear the lobe but leave each
//! chirp the scatter of speckle alone. The curvature is the sum of the scores' outer products (Berndt,
//! Hall, Hall & Hausman 1974).

use nalgebra::DVector;
use rayon::prelude::*;

use super::angle::{coarse_angles, true_angles};
use super::coordinates::Coordinates;
use super::gamma_law::{GammaLaw, LnProbability};
use super::minimise::Local;
use super::sensitivity::derivatives;
use super::table::{Aspects, Place, Table};
use crate::material::{Aspect, Observation};

/// Rows that one task sums, fixed so that the sum is the same on any number of threads.
const CHUNK: usize = 256;

/// Which curvature a search uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Curvature {
    /// d²(−ln g)/d(ln μ)² = L·y/μ along each chirp's mean gradient: long steps from afar, where the
    /// scores' products would have tiny ones.
    FromAfar,
    /// The scores' outer products, which account for the information lost to the unknown angles.
    Scores,
}

/// A curve prepared for many evaluations.
#[derive(Clone, Debug)]
pub(super) struct Likelihood<'a> {
    coordinates: &'a Coordinates,
    chirps: Vec<Chirp>,
    /// The angles at which it needs a law.
    pub aspects: Aspects,
    /// True angles of all rows without a detection.
    limits: usize,
}

/// True angles, rad, with their weights, of a measured angle and its standard deviation, both in rad.
type AnglesOfRow = fn(f64, f64) -> Vec<(f64, f64)>;

/// Aspects that a row may have had, with their weights: those of its true angles, or its own, which is exact, where source
/// and receiver were in two directions.
fn true_aspects(row: &Observation, angles: AnglesOfRow) -> Vec<(Aspect, f64)> {
    if !row.is_retro() {
        return vec![(row.aspect(), 1.0)];
    }
    let angles = angles(row.theta_i_rad, row.theta_sd_rad.unwrap_or(0.0));
    angles.into_iter().map(|(theta_rad, weight)| (Aspect::retro(theta_rad), weight)).collect()
}

/// One row; its power is in units of σ⁰.
#[derive(Clone, Debug)]
struct Chirp {
    ln_sigma0: f64,
    noise: f64,
    censored: bool,
    /// ln of the threshold of a detection that would not be there below it.
    ln_limit: Option<f64>,
    nodes: Vec<Node>,
}

/// A true angle that a row may have.
#[derive(Clone, Copy, Debug)]
struct Node {
    place: Place,
    ln_weight: f64,
}

/// The model at one point of a search, tabulated.
pub(super) struct Tables {
    /// ln σ⁰ at the angles.
    pub ln_sigma0: Table,
    /// Its derivative by each unknown of the search; none for the looks.
    pub by_unknown: Vec<Option<Table>>,
    /// The law of the speckle.
    pub law: GammaLaw,
}

impl Tables {
    /// The unknowns that do not change σ⁰.
    fn looks(&self) -> impl Iterator<Item = usize> {
        (0..self.by_unknown.len()).filter(|&index| self.by_unknown[index].is_none())
    }
}

impl<'a> Likelihood<'a> {
    /// Prepares the rows; `noise_w` is the mean thermal power in each.
    pub fn new(coordinates: &'a Coordinates, rows: &[Observation], noise_w: f64) -> Likelihood<'a> {
        Likelihood::of_nodes(coordinates, rows, noise_w, true_angles)
    }

    /// The same with true angles that are so coarse that it only ranks laws.
    pub fn coarse(
        coordinates: &'a Coordinates,
        rows: &[Observation],
        noise_w: f64,
    ) -> Likelihood<'a> {
        Likelihood::of_nodes(coordinates, rows, noise_w, coarse_angles)
    }

    fn of_nodes(
        coordinates: &'a Coordinates,
        rows: &[Observation],
        noise_w: f64,
        angles: AnglesOfRow,
    ) -> Likelihood<'a> {
        let aspects: Vec<Vec<(Aspect, f64)>> =
            rows.iter().map(|row| true_aspects(row, angles)).collect();
        let all: Vec<Aspect> = aspects.iter().flatten().map(|(aspect, _)| *aspect).collect();
        let (tabulated, places) = Aspects::of(&all);
        let mut places = places.into_iter();
        let mut chirps = Vec::with_capacity(rows.len());
        for (row, aspects) in rows.iter().zip(aspects) {
            let weights = aspects.into_iter().map(|(_, weight)| weight.ln());
            let nodes =
                weights.zip(&mut places).map(|(ln_weight, place)| Node { place, ln_weight });
            chirps.push(Chirp::new(row, noise_w, nodes.collect()));
        }
        let has_limit = |chirp: &&Chirp| chirp.censored || chirp.ln_limit.is_some();
        let limits = chirps.iter().filter(has_limit).map(|c| c.nodes.len()).sum();
        Likelihood { coordinates, chirps, aspects: tabulated, limits }
    }

    /// −ln likelihood, its gradient and a curvature.
    pub fn local(&self, curvature: Curvature, at: &DVector<f64>) -> Local {
        self.local_of(curvature, &self.tables(at))
    }

    /// −ln likelihood of a tabulated model, its gradient and a curvature.
    pub fn local_of(&self, curvature: Curvature, tables: &Tables) -> Local {
        let unknowns = tables.by_unknown.len();
        let parts: Vec<Local> = self
            .chirps
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut sum = Local::zero(unknowns);
                let mut scratch = Scratch::new(unknowns);
                for chirp in chunk {
                    sum.value -= chirp.score(tables, &mut scratch);
                    match curvature {
                        Curvature::Scores => sum.add(-1.0, 1.0, &scratch.score),
                        Curvature::FromAfar => {
                            sum.add(-1.0, 0.0, &scratch.score);
                            sum.add(0.0, scratch.bend, &scratch.gradient);
                            // Of the looks the products of the scores are all that is known.
                            for index in tables.looks() {
                                sum.curvature[(index, index)] += scratch.score[index].powi(2);
                            }
                        }
                    }
                }
                sum
            })
            .collect();
        parts.into_iter().fold(Local::zero(unknowns), Local::merge)
    }

    fn tables(&self, at: &DVector<f64>) -> Tables {
        let ln_sigma0 = self.coordinates.table(at, &self.aspects);
        let by_unknown = derivatives(self.coordinates, at, &self.aspects, &ln_sigma0);
        let law = GammaLaw::for_limits(self.coordinates.looks(at), self.limits);
        Tables { ln_sigma0, by_unknown, law }
    }

    /// ln p of each row.
    pub fn ln_p(&self, at: &DVector<f64>) -> Vec<f64> {
        let (tables, mut scratch) = (self.tables(at), Scratch::new(at.len()));
        self.chirps.iter().map(|chirp| chirp.score(&tables, &mut scratch)).collect()
    }

    /// ln p of all rows for a tabulated mean.
    pub fn ln_p_of(&self, ln_sigma0: &Table, law: &GammaLaw) -> f64 {
        self.chirps.iter().map(|chirp| chirp.ln_p(ln_sigma0, law)).sum()
    }

    /// The detected rows: ln σ⁰ and the most likely place of each among the angles.
    pub fn detections(&self) -> impl Iterator<Item = (f64, &Place)> {
        let detected = self.chirps.iter().filter(|chirp| !chirp.censored);
        detected.filter_map(|chirp| {
            let likeliest = |a: &&Node, b: &&Node| a.ln_weight.total_cmp(&b.ln_weight);
            Some((chirp.ln_sigma0, &chirp.nodes.iter().max_by(likeliest)?.place))
        })
    }

    /// ln of the probability of a lower power than that of the row, for each row.
    pub fn ln_below(&self, at: &DVector<f64>) -> Vec<f64> {
        let table = self.coordinates.table(at, &self.aspects);
        let law = GammaLaw::new(self.coordinates.looks(at));
        self.chirps.iter().map(|chirp| chirp.ln_below(&table, &law)).collect()
    }
}

/// Buffers for the sums of one chirp.
struct Scratch {
    terms: Vec<f64>,
    laws: Vec<(LnProbability, f64)>,
    /// d ln p/du.
    score: Vec<f64>,
    /// Mean of d ln μ/du over the angles, and of −d² ln p/d(ln μ)².
    gradient: Vec<f64>,
    bend: f64,
}

impl Scratch {
    fn new(len: usize) -> Scratch {
        let (score, gradient) = (vec![0.0; len], vec![0.0; len]);
        Scratch { terms: Vec::new(), laws: Vec::new(), score, gradient, bend: 0.0 }
    }
}

impl Chirp {
    /// Prepares a row that has a σ⁰ or a limit.
    fn new(row: &Observation, noise_w: f64, nodes: Vec<Node>) -> Chirp {
        let sigma0 = row.level_sigma0().unwrap_or(f64::NAN);
        Chirp {
            ln_sigma0: sigma0.ln(),
            noise: noise_w * sigma0 / row.power_w.unwrap_or(sigma0),
            censored: row.is_censored(),
            ln_limit: row.threshold_sigma0.filter(|_| !row.is_censored()).map(f64::ln),
            nodes,
        }
    }

    fn ln_mean(&self, table: &Table, place: &Place) -> f64 {
        let ln_sigma0 = table.at(place);
        if self.noise > 0.0 { (ln_sigma0.exp() + self.noise).ln() } else { ln_sigma0 }
    }

    /// ln of the probability of a lower power, averaged over the true angle; of one above the threshold, where only
    /// detections were recorded.
    fn ln_below(&self, table: &Table, law: &GammaLaw) -> f64 {
        let below = self.averaged(table, |ln_mean| law.below(self.ln_sigma0, ln_mean).value);
        let Some(ln_limit) = self.ln_limit else { return below };
        let silent = self.averaged(table, |ln_mean| law.below(ln_limit, ln_mean).value);
        let between = below + (-(silent - below).min(0.0).exp()).ln_1p();
        between - self.ln_above(table, law, ln_limit)
    }

    /// ln of the probability of passing a threshold, averaged over the true angle.
    fn ln_above(&self, table: &Table, law: &GammaLaw, ln_limit: f64) -> f64 {
        self.averaged(table, |ln_mean| law.above(ln_limit, ln_mean).value)
    }

    /// ln p of the chirp.
    fn ln_p(&self, table: &Table, law: &GammaLaw) -> f64 {
        if self.censored {
            return self.ln_below(table, law);
        }
        let own = self.averaged(table, |ln_mean| law.detected(self.ln_sigma0, ln_mean).value);
        own - self.ln_limit.map_or(0.0, |ln_limit| self.ln_above(table, law, ln_limit))
    }

    /// ln of a probability, known by its logarithm for each ln of the mean, averaged over the true angle.
    fn averaged(&self, table: &Table, ln_p: impl Fn(f64) -> f64) -> f64 {
        if let [Node { place, .. }] = self.nodes.as_slice() {
            return ln_p(self.ln_mean(table, place));
        }
        let mut terms = Vec::with_capacity(self.nodes.len());
        for Node { place, ln_weight, .. } in &self.nodes {
            terms.push(ln_weight + ln_p(self.ln_mean(table, place)));
        }
        ln_sum(&terms)
    }

    /// ln p of the chirp; its derivatives are left in `scratch.score`.
    fn score(&self, tables: &Tables, scratch: &mut Scratch) -> f64 {
        scratch.score.fill(0.0);
        let own = |ln_mean| {
            if self.censored {
                tables.law.below(self.ln_sigma0, ln_mean)
            } else {
                tables.law.detected(self.ln_sigma0, ln_mean)
            }
        };
        let above = self.ln_limit.map_or(0.0, |ln_limit| {
            self.add_score(tables, scratch, -1.0, |ln_mean| tables.law.above(ln_limit, ln_mean))
        });
        // Last, since the curvature is that of the law itself.
        self.add_score(tables, scratch, 1.0, own) - above
    }

    /// ln of a probability, averaged over the true angle; its derivatives, times a factor, are added to
    /// `scratch.score`, and `scratch.gradient` and `scratch.bend` become its own.
    fn add_score(
        &self,
        tables: &Tables,
        scratch: &mut Scratch,
        factor: f64,
        ln_p: impl Fn(f64) -> LnProbability,
    ) -> f64 {
        let Scratch { terms, laws, score, gradient, bend } = scratch;
        terms.clear();
        laws.clear();
        for Node { place, ln_weight, .. } in &self.nodes {
            let ln_mean = self.ln_mean(&tables.ln_sigma0, place);
            let law = ln_p(ln_mean);
            terms.push(ln_weight + law.value);
            // The share of σ⁰ in the mean, the rest being noise.
            let share = if self.noise > 0.0 { 1.0 - self.noise / ln_mean.exp() } else { 1.0 };
            laws.push((law, share));
        }
        let sum_ln = shares_of(terms);
        gradient.fill(0.0);
        *bend = 0.0;
        for ((Node { place, .. }, &weight), (law, share)) in
            self.nodes.iter().zip(&*terms).zip(&*laws)
        {
            if weight < 1e-9 {
                continue;
            }
            *bend += weight * law.bend;
            for (index, table) in tables.by_unknown.iter().enumerate() {
                let Some(table) = table else {
                    score[index] += factor * weight * law.by_ln_looks;
                    continue;
                };
                let slope = weight * share * table.at(place);
                gradient[index] += slope;
                score[index] += factor * law.by_ln_mean * slope;
            }
        }
        sum_ln
    }
}

/// Replaces each number by the share of its exponential in their sum, and returns ln of the sum.
fn shares_of(terms: &mut [f64]) -> f64 {
    if let [only] = terms {
        return std::mem::replace(only, 1.0);
    }
    let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    terms.iter_mut().for_each(|term| *term = (*term - largest).exp());
    let sum: f64 = terms.iter().sum();
    terms.iter_mut().for_each(|term| *term /= sum);
    largest + sum.ln()
}

/// ln Σ exp.
fn ln_sum(terms: &[f64]) -> f64 {
    let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return largest;
    }
    largest + terms.iter().map(|term| (term - largest).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::twin::{Twin, mixture};
    use crate::measure::Curve;

    #[test]
    fn the_gradient_is_that_of_the_value() {
        let start = mixture(0.06, 4.0, 0.04, 0.003);
        let coordinates = Coordinates::new(&start, &[], &[], None).unwrap();
        let twin = Twin { rows: 200, ..Twin::default() };
        let curves = [twin.curve(1), twin.only_detected(1)];
        for (noise_w, curve) in
            [0.0, 1e-11].into_iter().flat_map(|w| curves.each_ref().map(|c| (w, c)))
        {
            let likelihood = Likelihood::new(&coordinates, &curve.observations, noise_w);
            let at = coordinates.start();
            let local = likelihood.local(Curvature::Scores, &at);
            for index in 0..at.len() {
                let value = |step: f64| {
                    let mut there = at.clone();
                    there[index] += step;
                    likelihood.local(Curvature::Scores, &there).value
                };
                let slope = (value(1e-4) - value(-1e-4)) / 2e-4;
                let found = local.gradient[index];
                assert!((found - slope).abs() < 1e-3 * (1.0 + slope.abs()), "{found} {slope}");
            }
        }
    }

    #[test]
    fn rows_below_their_own_power_are_uniform_under_the_truth() {
        let all = Twin { rows: 2000, threshold_dbm: -300.0, ..Twin::default() };
        check_uniform(&all, &all.curve(2));
        // A third of the chirps is silent, and not recorded.
        let cut = Twin { rows: 3000, threshold_dbm: -72.0, ..Twin::default() };
        let curve = cut.only_detected(2);
        assert!((1500..2300).contains(&curve.observations.len()), "{}", curve.observations.len());
        check_uniform(&cut, &curve);
    }

    fn check_uniform(twin: &Twin, curve: &Curve) {
        let count = curve.observations.len() as f64;
        let coordinates = Coordinates::new(&twin.model, &[], &[], Some(twin.looks)).unwrap();
        let likelihood = Likelihood::new(&coordinates, &curve.observations, 0.0);
        let mut shares: Vec<f64> =
            likelihood.ln_below(&coordinates.start()).into_iter().map(f64::exp).collect();
        shares.sort_by(f64::total_cmp);
        let gap = shares.iter().enumerate().map(|(i, u)| (u - (i as f64 + 0.5) / count).abs());
        // Kolmogorov: 1.95/√n is passed once in a thousand.
        assert!(gap.fold(0.0, f64::max) < 1.95 / count.sqrt());
    }
}
