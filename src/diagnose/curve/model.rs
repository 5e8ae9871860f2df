//! A scattering model with terms, fitted to the levels of a curve in dB.
//!
//! A level y is normal about the model's with a scale s, times its own spread; a censored one states that y lies below. s is
//! the rms residual of the fit, and at least the noise: a wrong model must not appear certain.
//! Held-out levels and limits are scored by Student's distribution with four degrees of freedom and the same variance:
//! the residual of a wrong model has tails, and a few angles must not decide alone.

use nalgebra::{DMatrix, DVector};
use statrs::function::beta::beta_reg;

use super::points::Kind;
use super::points::{Point, Points};
use super::terms::{LawAt, Term};
use crate::brdf::{Brdf, Scattering};
use crate::fit::by_parts::ByParts;
use crate::fit::coordinates::{Coordinates, frequencies};
use crate::fit::minimise::{Local, Minimise, Minimum, step_each};
use crate::fit::uncertainty::{determined, deviations};
use crate::fit::{FitError, normal_share};
use crate::units::db_from_ratio;

/// Level where the model is zero, dB.
const NOTHING_DB: f64 = -200.0;
/// Step of the derivatives in the search.
const STEP: f64 = 1e-5;
const SEARCH: Minimise = Minimise { iterations: 150, tolerance: 1e-5, patience: usize::MAX };
/// The first steps of a search, which show where it goes.
const GLANCE: Minimise = Minimise { iterations: 4, tolerance: 1e-5, patience: usize::MAX };
/// Rounds of fit and scale: with censored levels each depends on the other.
const ROUNDS: usize = 3;

/// A scattering model and the terms that are added to it.
#[derive(Clone)]
pub(super) struct Model {
    pub coordinates: Coordinates,
    pub terms: Vec<&'static dyn Term>,
}

/// The end of a fit.
#[derive(Clone)]
pub(super) struct Fit {
    /// The coordinates of the scattering model, then the parameters of the terms in steps.
    pub at: DVector<f64>,
    /// s, dB.
    pub scale_db: f64,
    /// ln p of the points that were fitted.
    pub log_p: f64,
    pub converged: bool,
    curvature: DMatrix<f64>,
    /// Half of what Schwarz's criterion takes for the unknowns that the data determine.
    penalty: f64,
}

impl Fit {
    /// Schwarz's criterion, halved (Ann. Stat. 6 (1978) 461): of models that explain a curve the one with the least is the
    /// best. Unknowns count as far as the data determine them.
    pub fn criterion(&self) -> f64 {
        self.penalty - self.log_p
    }
}

/// The score of a model at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Score {
    /// 10·lg f of the model.
    pub f_db: f64,
    pub log_p: f64,
}

impl Score {
    /// The score of a level at a held-out point; level and scale in dB.
    pub fn new(point: &Point, f_db: f64, scale_db: f64) -> Score {
        // With four degrees of freedom the variance is twice the squared scale, and the peak density 3/8.
        let width_db = scale_db * point.spread * std::f64::consts::FRAC_1_SQRT_2;
        let z = (point.f_db - f_db) / width_db;
        if point.censored {
            return Score { f_db, log_p: student_below(z).max(f64::MIN_POSITIVE).ln() };
        }
        let log_p = 0.375f64.ln() - width_db.ln() - 2.5 * (0.25 * z * z).ln_1p();
        Score { f_db, log_p }
    }
}

impl Model {
    /// The model of a curve of this kind.
    pub fn new(law: &Brdf, kind: Kind) -> Result<Model, FitError> {
        let of = match kind {
            Kind::Backscatter => Coordinates::new,
            Kind::InPlane => Coordinates::of_pairs,
        };
        let coordinates = of(law, &frequencies(law), &[], Some(1.0))?;
        if coordinates.len() == 0 {
            return Err(FitError::NothingFree);
        }
        Ok(Model { coordinates, terms: Vec::new() })
    }

    /// The model with one more term.
    pub fn with(&self, term: &'static dyn Term) -> Model {
        let mut model = self.clone();
        model.terms.push(term);
        model
    }

    /// The law that the model was made of, in the coordinates of the search.
    pub fn start(&self) -> DVector<f64> {
        self.coordinates.start()
    }

    pub fn unknowns(&self) -> usize {
        self.coordinates.len()
            + self.terms.iter().map(|term| term.parameters().len()).sum::<usize>()
    }

    fn bounds(&self) -> [DVector<f64>; 2] {
        let mut lower: Vec<f64> = self.coordinates.lower().iter().copied().collect();
        let mut upper: Vec<f64> = self.coordinates.upper().iter().copied().collect();
        for known in self.terms.iter().flat_map(|term| term.parameters()) {
            lower.push(known.min / known.step);
            upper.push(known.max / known.step);
        }
        [DVector::from_vec(lower), DVector::from_vec(upper)]
    }

    /// The scattering model, and the parameters of every term.
    pub fn numbers(&self, at: &DVector<f64>) -> (Brdf, Vec<Vec<f64>>) {
        let of_law = self.coordinates.len().min(at.len());
        let law = self.coordinates.model(&at.rows(0, of_law).into_owned());
        let mut rest = at.iter().skip(of_law);
        let values = self
            .terms
            .iter()
            .map(|term| term.parameters().iter().zip(&mut rest).map(|(k, u)| u * k.step).collect());
        (law, values.collect())
    }

    /// A point at which the term of this number changes nothing.
    pub fn without(&self, at: &DVector<f64>, term: usize) -> DVector<f64> {
        let mut without = at.clone();
        let before = self.terms.iter().take(term).map(|term| term.parameters().len());
        let first = self.coordinates.len() + before.sum::<usize>();
        for (place, known) in self.terms[term].parameters().iter().enumerate() {
            without[first + place] = known.absent / known.step;
        }
        without
    }

    /// 10·lg f at every point.
    pub fn levels_db(&self, at: &DVector<f64>, points: &[Point]) -> Vec<f64> {
        let (law, values) = self.numbers(at);
        self.with_terms(&at_points(&law, points), &values)
    }

    /// 10·lg f of a law with the terms of these parameters at every point.
    fn with_terms(&self, law: &[LawAt], values: &[Vec<f64>]) -> Vec<f64> {
        law.iter().map(|at| level_db(self.f_per_sr(at, values))).collect()
    }

    /// f of a law with the terms of these parameters at a point, 1/sr.
    fn f_per_sr(&self, at: &LawAt, values: &[Vec<f64>]) -> f64 {
        let terms = self.terms.iter().zip(values);
        terms.fold(at.f_per_sr, |f, (term, values)| term.scatter(values, at, f))
    }

    /// 10·lg f at every point with one more term, for each of these values of its parameters.
    pub fn levels_with(
        &self,
        at: &DVector<f64>,
        term: &'static dyn Term,
        values: &[Vec<f64>],
        points: &[Point],
    ) -> Vec<Vec<f64>> {
        let (law, before) = self.numbers(at);
        let law = at_points(&law, points);
        let f_per_sr: Vec<f64> = law.iter().map(|at| self.f_per_sr(at, &before)).collect();
        values
            .iter()
            .map(|values| {
                let pairs = law.iter().zip(&f_per_sr);
                pairs.map(|(at, &f)| level_db(term.scatter(values, at, f))).collect()
            })
            .collect()
    }

    /// A fit to the points for which `used` is true, from a start.
    pub fn fit(&self, points: &Points, used: &[bool], start: &DVector<f64>) -> Fit {
        let chosen: Vec<Point> = points
            .points
            .iter()
            .zip(used)
            .filter_map(|(point, used)| used.then_some(*point))
            .collect();
        let bounds = self.bounds();
        let censored = chosen.iter().any(|point| point.censored);
        let mut scale_db = self.scale_db(start, &chosen, points.noise.sd_db);
        let mut found = self.search(&SEARCH, start, &bounds, &chosen, scale_db);
        for round in 1..=ROUNDS {
            scale_db = self.scale_db(&found.at, &chosen, points.noise.sd_db);
            if !censored || round == ROUNDS {
                break;
            }
            found = self.search(&SEARCH, &found.at, &bounds, &chosen, scale_db);
        }
        let levels = self.levels_db(&found.at, &chosen);
        let log_p = chosen.iter().zip(&levels).map(|(p, db)| log_p(p, *db, scale_db)).sum();
        let curvature = self.local(&found.at, &bounds[1], &chosen, scale_db).curvature;
        let ranges = &bounds[1] - &bounds[0];
        let determined = determined(&curvature, ranges.as_slice()) as f64;
        let penalty = 0.5 * determined * (chosen.len().max(1) as f64).ln();
        Fit { scale_db, log_p, converged: found.converged(), curvature, penalty, at: found.at }
    }

    /// The end of a few steps of the search from a start.
    pub fn glance(&self, points: &Points, start: &DVector<f64>) -> DVector<f64> {
        let all = &points.points;
        let scale_db = self.scale_db(start, all, points.noise.sd_db);
        self.search(&GLANCE, start, &self.bounds(), all, scale_db).at
    }

    fn search(
        &self,
        search: &Minimise,
        start: &DVector<f64>,
        bounds: &[DVector<f64>; 2],
        points: &[Point],
        scale_db: f64,
    ) -> Minimum {
        search.run_with(
            start,
            [&bounds[0], &bounds[1]],
            |at| cost(points, &self.levels_db(at, points), scale_db),
            |at| self.local(at, &bounds[1], points, scale_db),
        )
    }

    /// Rms residual of the detections, per degree of freedom, and at least the noise, dB.
    fn scale_db(&self, at: &DVector<f64>, points: &[Point], noise_db: f64) -> f64 {
        let levels = self.levels_db(at, points);
        let seen = points.iter().zip(&levels).filter(|(point, _)| !point.censored);
        let squares: Vec<f64> =
            seen.map(|(point, db)| ((point.f_db - db) / point.spread).powi(2)).collect();
        let spare = squares.len().saturating_sub(self.unknowns()).max(1);
        (squares.iter().sum::<f64>() / spare as f64).sqrt().max(noise_db)
    }

    /// −ln p, its gradient and its curvature.
    fn local(
        &self,
        at: &DVector<f64>,
        upper: &DVector<f64>,
        points: &[Point],
        scale_db: f64,
    ) -> Local {
        let directions: Vec<_> = points.iter().map(|point| [point.i, point.o]).collect();
        let (law, values) = self.numbers(at);
        let by_parts = ByParts::new(&law, &directions);
        let law_here = known_at_points(&law, by_parts.f_per_sr(), points);
        let here = self.with_terms(&law_here, &values);
        let moved = step_each(at, upper, STEP, |there| {
            let (moved, values) = self.numbers(there);
            if moved == law {
                return self.with_terms(&law_here, &values);
            }
            let f_per_sr = by_parts.moved_to(&moved, &directions).f_per_sr();
            self.with_terms(&known_at_points(&moved, f_per_sr, points), &values)
        });
        let mut sum = Local::zero(at.len());
        for (row, (point, level_db)) in points.iter().zip(&here).enumerate() {
            let jacobian: Vec<f64> =
                moved.iter().map(|(step, there)| (there[row] - level_db) / step).collect();
            let own_db = scale_db * point.spread;
            let z = (point.f_db - level_db) / own_db;
            let (first, second) = if point.censored {
                // d/dμ of −ln Φ((T − μ)/s), and an expected curvature that is never negative.
                let pull = mills(z);
                (pull / own_db, (pull * (pull + z)).max(0.0) / own_db.powi(2))
            } else {
                (-z / own_db, own_db.powi(-2))
            };
            sum.add(first, second, &jacobian);
        }
        sum.value = cost(points, &here, scale_db);
        sum
    }

    /// The score of every point under a fit.
    pub fn scores(&self, fitted: &Fit, points: &[Point]) -> Vec<Score> {
        let levels = self.levels_db(&fitted.at, points);
        let pairs = points.iter().zip(&levels);
        pairs.map(|(point, f_db)| Score::new(point, *f_db, fitted.scale_db)).collect()
    }

    /// Standard deviations of all unknowns; none at a bound or where the data do not determine the unknown.
    /// `correlated`: factor on variances by the correlation of neighbours.
    pub fn deviations(&self, fitted: &Fit, correlated: f64) -> Vec<Option<f64>> {
        let [lower, upper] = self.bounds();
        let at = &fitted.at;
        let free: Vec<usize> =
            (0..at.len()).filter(|&k| at[k] > lower[k] && at[k] < upper[k]).collect();
        let curvature =
            DMatrix::from_fn(free.len(), free.len(), |a, b| fitted.curvature[(free[a], free[b])]);
        let mut all = vec![None; at.len()];
        for (&k, sd) in free.iter().zip(deviations(&curvature)) {
            all[k] = sd.map(|sd| correlated.sqrt() * sd);
        }
        all
    }
}

/// A law at every point.
fn at_points<'a>(law: &'a Brdf, points: &'a [Point]) -> Vec<LawAt<'a>> {
    let f_per_sr = points.iter().map(|point| law.f_per_sr(point.i, point.o));
    known_at_points(law, f_per_sr.collect(), points)
}

/// A law at every point, of which f is known, 1/sr.
fn known_at_points<'a>(law: &'a Brdf, f_per_sr: Vec<f64>, points: &'a [Point]) -> Vec<LawAt<'a>> {
    points.iter().zip(f_per_sr).map(|(point, f)| LawAt::new(law, point, f)).collect()
}

/// 10·lg f.
fn level_db(f_per_sr: f64) -> f64 {
    db_from_ratio(f_per_sr.max(0.0)).max(NOTHING_DB)
}

/// Root mean square difference of two models' levels, dB.
pub(super) fn rms_apart_db(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len().max(1) as f64).sqrt()
}

/// −ln p of points about a model's levels, dB.
fn cost(points: &[Point], levels_db: &[f64], scale_db: f64) -> f64 {
    let pairs = points.iter().zip(levels_db);
    -pairs.map(|(point, level_db)| log_p(point, *level_db, scale_db)).sum::<f64>()
}

/// ln p of a point about a model's level, both dB.
fn log_p(point: &Point, level_db: f64, scale_db: f64) -> f64 {
    let own_db = scale_db * point.spread;
    let z = (point.f_db - level_db) / own_db;
    if point.censored {
        return log_below(z);
    }
    -0.5 * z * z - own_db.ln() - 0.5 * std::f64::consts::TAU.ln()
}

/// ln Φ(z).
fn log_below(z: f64) -> f64 {
    if z < -30.0 {
        return -0.5 * z * z - (-z * std::f64::consts::TAU.sqrt()).ln();
    }
    normal_share(z).max(f64::MIN_POSITIVE).ln()
}

/// Probability of a number below z by Student's distribution with four degrees of freedom.
fn student_below(z: f64) -> f64 {
    let share = 4.0 / (4.0 + z * z);
    let tail = 0.5 * beta_reg(2.0, 0.5, share);
    if z < 0.0 { tail } else { 1.0 - tail }
}

/// φ(z)/Φ(z).
fn mills(z: f64) -> f64 {
    let log_density = -0.5 * z * z - 0.5 * std::f64::consts::TAU.ln();
    (log_density - log_below(z)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_have_the_tails_of_student() {
        // Tables: the 97.5 and the 99.95 % quantile of four degrees of freedom.
        for (z, share) in [(0.0, 0.5), (2.776_445, 0.975), (8.610_302, 0.9995)] {
            assert!((student_below(z) - share).abs() < 1e-6, "{z}");
            assert!((student_below(-z) - (1.0 - share)).abs() < 1e-6, "{z}");
        }
        // The density 12/|z|⁵ far out, over the tail: 3/z⁴.
        assert!((student_below(-1e4) / 3e-16 - 1.0).abs() < 1e-6);
    }
}
