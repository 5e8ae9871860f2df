//! A law with terms, fitted to the levels of a curve in dB.
//!
//! A level y is normal about the model's with a scale s; a censored one says that y lies below. s is the
//! rms of what the fit leaves, and at least the noise: a model in error must not look sure of itself.
//! Held-out levels are scored by Student's law with four degrees of freedom and the same variance:
//! what a model in error leaves has tails, and a few angles must not decide alone.

use nalgebra::{DMatrix, DVector};

use super::points::{Point, Points};
use super::terms::Term;
use crate::brdf::{Brdf, Scattering};
use crate::fit::coordinates::{Coordinates, frequencies};
use crate::fit::minimise::{Local, Minimise, Minimum};
use crate::fit::uncertainty::deviations;
use crate::fit::{FitError, normal_share};
use crate::units::db_from_ratio;

/// dB of what a model calls nothing.
const NOTHING_DB: f64 = -200.0;
/// Step of the derivatives in the search.
const STEP: f64 = 1e-5;
const SEARCH: Minimise = Minimise { iterations: 150, tolerance: 1e-5, patience: usize::MAX };
/// With censored levels the fit depends on the scale, and the scale on the fit.
const ROUNDS: usize = 3;

/// A law and the terms that are added to it.
#[derive(Clone)]
pub(super) struct Model {
    pub coordinates: Coordinates,
    pub terms: Vec<&'static dyn Term>,
}

/// Where a fit ended.
#[derive(Clone)]
pub(super) struct Fitted {
    /// The law's coordinates, then the terms' numbers over their steps.
    pub at: DVector<f64>,
    /// s, dB.
    pub scale_db: f64,
    /// ln p of the points that were fitted.
    pub log_p: f64,
    pub converged: bool,
    curvature: DMatrix<f64>,
}

/// One point as a model sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scored {
    /// 10·lg f of the model.
    pub f_db: f64,
    pub log_p: f64,
}

impl Scored {
    /// A held-out point by a level and a scale, both dB.
    pub fn new(point: &Point, f_db: f64, scale_db: f64) -> Scored {
        let log_p = match point.censored {
            true => log_p(point, f_db, scale_db),
            false => {
                // Four degrees of freedom have twice the variance of their scale, and 3/8 in the middle.
                let width_db = scale_db * std::f64::consts::FRAC_1_SQRT_2;
                let z = (point.f_db - f_db) / width_db;
                0.375f64.ln() - width_db.ln() - 2.5 * (0.25 * z * z).ln_1p()
            }
        };
        Scored { f_db, log_p }
    }
}

impl Model {
    pub fn new(law: &Brdf) -> Result<Model, FitError> {
        let coordinates = Coordinates::new(law, &frequencies(law), &[], Some(1.0))?;
        match coordinates.len() {
            0 => Err(FitError::NothingFree),
            _ => Ok(Model { coordinates, terms: Vec::new() }),
        }
    }

    /// The same with one term more.
    pub fn with(&self, term: &'static dyn Term) -> Model {
        let mut model = self.clone();
        model.terms.push(term);
        model
    }

    pub fn start(&self) -> DVector<f64> {
        self.coordinates.start()
    }

    pub fn unknowns(&self) -> usize {
        self.coordinates.len()
            + self.terms.iter().map(|term| term.parameters().len()).sum::<usize>()
    }

    fn bounds(&self) -> [DVector<f64>; 2] {
        let knobs = || self.terms.iter().flat_map(|term| term.parameters());
        let join = |law: DVector<f64>, ends: Vec<f64>| {
            DVector::from_iterator(law.len() + ends.len(), law.iter().copied().chain(ends))
        };
        [
            join(self.coordinates.lower(), knobs().map(|knob| knob.min / knob.step).collect()),
            join(self.coordinates.upper(), knobs().map(|knob| knob.max / knob.step).collect()),
        ]
    }

    /// The law, and the numbers of every term.
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

    /// 10·lg f at every point.
    pub fn levels_db(&self, at: &DVector<f64>, points: &[Point]) -> Vec<f64> {
        let (law, values) = self.numbers(at);
        let level = |point: &Point| {
            let bare = law.f_per_sr(point.i, point.o);
            let acted = self.terms.iter().zip(&values);
            let f = acted.fold(bare, |f, (term, values)| term.scatter(values, &law, point, f));
            db_from_ratio(f.max(0.0)).max(NOTHING_DB)
        };
        points.iter().map(level).collect()
    }

    /// Fits to the points for which `used` is true, from a start.
    pub fn fit(&self, points: &Points, used: &[bool], start: &DVector<f64>) -> Fitted {
        let chosen: Vec<Point> = points
            .points
            .iter()
            .zip(used)
            .filter_map(|(point, used)| used.then_some(*point))
            .collect();
        let bounds = self.bounds();
        let censored = chosen.iter().any(|point| point.censored);
        let mut scale_db = self.scale_db(start, &chosen, points.noise.sd_db);
        let mut found = self.search(start, &bounds, &chosen, scale_db);
        for round in 1..=ROUNDS {
            scale_db = self.scale_db(&found.at, &chosen, points.noise.sd_db);
            if !censored || round == ROUNDS {
                break;
            }
            found = self.search(&found.at, &bounds, &chosen, scale_db);
        }
        let levels = self.levels_db(&found.at, &chosen);
        let log_p = chosen.iter().zip(&levels).map(|(p, db)| log_p(p, *db, scale_db)).sum();
        let curvature = self.local(&found.at, &bounds[1], &chosen, scale_db).curvature;
        Fitted { scale_db, log_p, converged: found.converged(), curvature, at: found.at }
    }

    fn search(
        &self,
        start: &DVector<f64>,
        bounds: &[DVector<f64>; 2],
        points: &[Point],
        scale_db: f64,
    ) -> Minimum {
        SEARCH
            .run(start, [&bounds[0], &bounds[1]], |at| self.local(at, &bounds[1], points, scale_db))
    }

    /// Rms of what is left of the detections, per degree of freedom, and at least the noise, dB.
    fn scale_db(&self, at: &DVector<f64>, points: &[Point], noise_db: f64) -> f64 {
        let levels = self.levels_db(at, points);
        let seen = points.iter().zip(&levels).filter(|(point, _)| !point.censored);
        let squares: Vec<f64> = seen.map(|(point, db)| (point.f_db - db).powi(2)).collect();
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
        let here = self.levels_db(at, points);
        let moved: Vec<(f64, Vec<f64>)> = (0..at.len())
            .map(|index| {
                let step = if at[index] + STEP > upper[index] { -STEP } else { STEP };
                let mut there = at.clone();
                there[index] += step;
                (step, self.levels_db(&there, points))
            })
            .collect();
        let mut sum = Local::zero(at.len());
        for (row, (point, level_db)) in points.iter().zip(&here).enumerate() {
            let slope = |(step, there): &(f64, Vec<f64>)| (there[row] - level_db) / step;
            let jacobian: Vec<f64> = moved.iter().map(slope).collect();
            let z = (point.f_db - level_db) / scale_db;
            let (first, second) = match point.censored {
                true => {
                    // d/dμ of −ln Φ((T − μ)/s), and an expected curvature that is never negative.
                    let pull = mills(z);
                    (pull / scale_db, (pull * (pull + z)).max(0.0) / scale_db.powi(2))
                }
                false => (-z / scale_db, scale_db.powi(-2)),
            };
            sum.value -= log_p(point, *level_db, scale_db);
            sum.add(first, second, &jacobian);
        }
        sum
    }

    /// How every point fares with a fit.
    pub fn scored(&self, fitted: &Fitted, points: &[Point]) -> Vec<Scored> {
        let levels = self.levels_db(&fitted.at, points);
        let pairs = points.iter().zip(&levels);
        pairs.map(|(point, f_db)| Scored::new(point, *f_db, fitted.scale_db)).collect()
    }

    /// Standard deviations of all unknowns in the search; none at a bound or where the data do not
    /// tell. `correlated`: by how much neighbours that err together stretch variances.
    pub fn deviations(&self, fitted: &Fitted, correlated: f64) -> Vec<Option<f64>> {
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

/// ln p of a point about a model's level, both dB.
fn log_p(point: &Point, level_db: f64, scale_db: f64) -> f64 {
    let z = (point.f_db - level_db) / scale_db;
    match point.censored {
        true => log_below(z),
        false => -0.5 * z * z - scale_db.ln() - 0.5 * std::f64::consts::TAU.ln(),
    }
}

/// ln Φ(z).
fn log_below(z: f64) -> f64 {
    if z < -30.0 {
        return -0.5 * z * z - (-z * std::f64::consts::TAU.sqrt()).ln();
    }
    normal_share(z).max(f64::MIN_POSITIVE).ln()
}

/// φ(z)/Φ(z).
fn mills(z: f64) -> f64 {
    let log_density = -0.5 * z * z - 0.5 * std::f64::consts::TAU.ln();
    (log_density - log_below(z)).exp()
}
