//! What a fit found, how well it knows it, and how to find it again.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::coordinates::{Coordinates, DIFFUSE_LEVEL, SPECULAR_LEVEL};
use super::goodness::{goodness_of, normal_share, shares};
use super::interval::{DEVIATE_95, End};
use super::likelihood::Likelihood;
use super::minimise::Stop;
use super::search::Found;
use super::sensitivity::derivatives;
use super::settings::{Fit, Method};
use super::table::{Place, Table};
use super::verdict::Finding;
use crate::brdf::{Brdf, ParameterError, Scattering};
use crate::formats::words::significant;
use crate::material::{Estimate, Goodness, HeldOut, Observation};
use crate::measure::curve::Curve;
use crate::radar::speckle::standard_deviation_db;
use crate::units::db_from_ratio;

/// A 95 % band of the fitted mean σ⁰.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Lower end, a pure number.
    pub low: f64,
    /// The fit.
    pub mid: f64,
    /// Upper end.
    pub high: f64,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitResult {
    /// The settings.
    pub fit: Fit,
    /// The fitted model, in the gauge that [`gauge_k`](Self::gauge_k) says.
    pub model: Brdf,
    /// k as chosen where only the products S and R were found; `None` for other models.
    pub gauge_k: Option<f64>,
    /// The fitted numbers.
    pub estimates: Vec<Estimate>,
    /// Covariance of the fitted numbers, in the order of `estimates`; rows and columns of those without
    /// a standard deviation are 0 and say nothing.
    pub covariance: Vec<Vec<f64>>,
    /// Singular values of the information, scaled to a unit diagonal, largest first; a millionth
    /// of the first is an unseen direction.
    pub singular_values: Vec<f64>,
    /// Looks L: given or estimated; `None` for least squares.
    pub looks: Option<f64>,
    /// Thermal power used, W.
    pub noise_w: f64,
    /// ln likelihood per unit of ln power (default method), else half the sum of scaled squares, negative.
    pub objective: f64,
    /// How well the rows are explained.
    pub goodness: Goodness,
    /// How well rows are told that took no part, once [`FitResult::hold_out`] was asked.
    pub held_out: Option<HeldOut>,
    /// Whether the search ended at an optimum.
    pub converged: bool,
    /// Why it ended.
    pub stop: Stop,
    /// Steps of the best start.
    pub iterations: usize,
    /// Starts that reached the best fit.
    pub agreeing_starts: usize,
    /// What the fit cannot promise.
    pub verdict: Vec<Finding>,
    /// Hash (BLAKE3, hexadecimal) of the rows as numbers.
    pub data_hash: String,
    /// Version of this crate.
    pub version: &'static str,
    #[serde(skip)]
    pub(super) coordinates: Coordinates,
    #[serde(skip)]
    pub(super) at: DVector<f64>,
    #[serde(skip)]
    covariance_searched: DMatrix<f64>,
}

/// Correlation from which two numbers are said to be hard to tell apart.
const CORRELATED: f64 = 0.95;
/// Kolmogorov's distance times √rows that chance passes once in a hundred times.
const KOLMOGOROV_1_PERCENT: f64 = 1.63;
/// The split where the method has none, degrees.
const SPLIT_DEG: f64 = 6.0;

impl FitResult {
    pub(super) fn new(fit: &Fit, coordinates: Coordinates, curve: &Curve) -> FitResult {
        let found = fit.search(&coordinates, &curve.observations);
        let at = found.best.at.clone();
        let model = coordinates.model(&at);
        let law = fit.method == Method::Censored;
        let mut result = FitResult {
            gauge_k: coordinates.gauge().map(|_| chosen_k(&model)),
            estimates: estimates(&coordinates, &found),
            covariance: covariance(&coordinates, &found),
            singular_values: found.uncertainty.singular_values.clone(),
            looks: law.then(|| coordinates.looks(&at)),
            noise_w: fit.noise_w.filter(|_| law).unwrap_or(0.0),
            objective: -found.best.local.value,
            goodness: goodness(fit, &coordinates, &at, &curve.observations),
            held_out: None,
            converged: found.best.converged(),
            stop: found.best.stop,
            iterations: found.best.iterations,
            agreeing_starts: found.agreeing,
            verdict: Vec::new(),
            data_hash: data_hash(&curve.observations),
            version: env!("CARGO_PKG_VERSION"),
            fit: fit.clone(),
            covariance_searched: found.uncertainty.covariance.clone(),
            model,
            coordinates,
            at,
        };
        result.verdict = result.judge(&found, &curve.observations);
        result
    }

    /// The fitted mean σ⁰ at an angle with its 95 % band, by the delta method on ln σ⁰.
    ///
    /// Directions that the data do not see and numbers at a bound add nothing to it.
    pub fn band(&self, theta_rad: f64) -> Band {
        let place = Place::new(theta_rad);
        let here = Table::new(&self.model);
        let by = derivatives(&self.coordinates, &self.at, &here);
        let slopes = by.iter().map(|table| table.as_ref().map_or(0.0, |table| table.at(&place)));
        let slopes = DVector::from_iterator(self.at.len(), slopes);
        let variance = slopes.dot(&(&self.covariance_searched * &slopes));
        let factor = (DEVIATE_95 * variance.max(0.0).sqrt()).exp();
        let mid = self.model.sigma0(theta_rad);
        Band { low: mid / factor, mid, high: mid * factor }
    }

    /// A fitted number by its name.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }

    fn judge(&self, found: &Found, rows: &[Observation]) -> Vec<Finding> {
        let range = self.model.validate();
        // Out of range k is what the levels make of it, and nobody chose it.
        let gauge = self.gauge_k.filter(|_| range.is_ok());
        let mut findings: Vec<Finding> = gauge.map(|k| Finding::Gauge { k }).into_iter().collect();
        if !self.converged {
            findings.push(Finding::NotConverged { stop: self.stop });
        }
        let (agreeing, starts) = (self.agreeing_starts, self.fit.starts);
        if 2 * agreeing < starts {
            findings.push(Finding::StartsDisagree { agreeing, starts });
        }
        findings.extend(self.judge_rows(rows));
        findings.extend(self.judge_numbers(found));
        if let Err(ParameterError { path, value, .. }) = range {
            let problem = format!("{path} would be {}", significant(value, 4));
            let held = self.fit.fixed.iter().map(|(path, _)| path.clone()).collect();
            let of_levels = |f: &Finding| matches!(f, Finding::AtBound { name, .. } if [SPECULAR_LEVEL, DIFFUSE_LEVEL].contains(&name.as_str()));
            findings.retain(|finding| !of_levels(finding));
            findings.push(Finding::OutOfRange { problem, held });
        }
        let limit = KOLMOGOROV_1_PERCENT / f64::from(self.goodness.rows.max(1)).sqrt();
        let ks_distance = self.goodness.ks_distance;
        if self.fit.method == Method::Censored && ks_distance > limit {
            findings.push(Finding::PoorFit { ks_distance, limit });
        }
        findings
    }

    fn judge_rows(&self, rows: &[Observation]) -> Vec<Finding> {
        let mut findings = Vec::new();
        let split_deg = match self.fit.method {
            Method::Mse { split_rad } => split_rad.to_degrees(),
            _ => SPLIT_DEG,
        };
        let detected = || rows.iter().filter(|row| !row.is_censored());
        let near = detected().filter(|row| row.theta_i_rad.to_degrees() < split_deg).count();
        let mixture = matches!(self.model, Brdf::Mixture(_));
        if mixture && near == 0 {
            findings.push(Finding::NoSpecularRows { below_deg: split_deg });
        }
        if mixture && near == detected().count() {
            findings.push(Finding::NoDiffuseRows { above_deg: split_deg });
        }
        let censored = rows.len() - detected().count();
        if self.fit.method != Method::Censored && censored > 0 {
            findings.push(Finding::CensoredIgnored { censored, rows: rows.len() });
        }
        findings
    }

    fn judge_numbers(&self, found: &Found) -> Vec<Finding> {
        let uncertainty = &found.uncertainty;
        let name = |index: usize| self.estimates.get(index).map_or("", |e| &e.name).to_owned();
        let value = |index: usize| self.estimates.get(index).map_or(f64::NAN, |e| e.value);
        let mut findings = Vec::new();
        for group in &uncertainty.together {
            findings.push(match group.as_slice() {
                [one] => Finding::Unconstrained { name: name(*one) },
                _ => Finding::OnlyTogether { names: group.iter().map(|&i| name(i)).collect() },
            });
        }
        for &index in &uncertainty.loose {
            findings.push(Finding::Unconstrained { name: name(index) });
        }
        for (index, _) in uncertainty.bounded.iter().enumerate().filter(|(_, held)| **held) {
            findings.push(Finding::AtBound { name: name(index), value: value(index) });
        }
        for (a, b, correlation) in correlations(&found.uncertainty, self.estimates.len()) {
            findings.push(Finding::HardToTellApart { names: [name(a), name(b)], correlation });
        }
        for (index, profile) in found.profiles.iter().enumerate() {
            for end in profile.iter().flatten().filter(|end| end.open) {
                let value = self.coordinates.list.get(index).map_or(f64::NAN, |c| c.value(end.at));
                findings.push(Finding::OpenInterval { name: name(index), value });
            }
        }
        findings
    }
}

fn correlations(
    uncertainty: &super::uncertainty::Uncertainty,
    count: usize,
) -> Vec<(usize, usize, f64)> {
    let known: Vec<usize> = (0..count).filter(|&i| uncertainty.is_identified(i)).collect();
    let correlation = |a: usize, b: usize| {
        let scale = uncertainty.deviation(a) * uncertainty.deviation(b);
        uncertainty.covariance[(a, b)] / scale
    };
    let pairs = known.iter().flat_map(|&a| known.iter().map(move |&b| (a, b)));
    pairs
        .filter(|(a, b)| a < b)
        .map(|(a, b)| (a, b, correlation(a, b)))
        .filter(|(.., correlation)| correlation.abs() > CORRELATED)
        .collect()
}

fn chosen_k(model: &Brdf) -> f64 {
    let parameters = model.parameters();
    parameters.iter().find(|p| p.path == "k").map_or(f64::NAN, |p| p.value)
}

fn estimates(coordinates: &Coordinates, found: &Found) -> Vec<Estimate> {
    let estimate = |(index, (coordinate, &u)): (usize, (&super::coordinates::Coordinate, &f64))| {
        let known = found.best.converged() && found.uncertainty.is_identified(index);
        let deviation = found.uncertainty.deviation(index);
        let wald = [-DEVIATE_95, DEVIATE_95].map(|z| coordinate.value(u + z * deviation));
        let profile = found.profiles.get(index);
        let ends = |ends: [End; 2]| ends.map(|end| coordinate.value(end.at));
        let interval = profile.map_or(Some(wald), |profile| profile.map(ends));
        Estimate {
            name: coordinate.name.clone(),
            value: coordinate.value(u),
            sd: known.then(|| deviation * coordinate.slope(u)),
            interval_95: interval.filter(|_| known),
        }
    };
    coordinates.list.iter().zip(found.best.at.iter()).enumerate().map(estimate).collect()
}

fn covariance(coordinates: &Coordinates, found: &Found) -> Vec<Vec<f64>> {
    let at = &found.best.at;
    let scale = |index: usize| {
        let slope = coordinates.list.get(index).map_or(0.0, |c| c.slope(at[index]));
        if found.uncertainty.is_identified(index) { slope } else { 0.0 }
    };
    let entry = |row: usize, column: usize| {
        found.uncertainty.covariance[(row, column)] * scale(row) * scale(column)
    };
    let row = |row: usize| (0..at.len()).map(|column| entry(row, column)).collect();
    (0..at.len()).map(row).collect()
}

/// Detected σ⁰ over the model, dB.
pub(super) fn residuals_db(
    fit: &Fit,
    coordinates: &Coordinates,
    at: &DVector<f64>,
    rows: &[Observation],
) -> Vec<f64> {
    let table = Table::new(&coordinates.model(at));
    let noise_w = fit.noise_w.unwrap_or(0.0);
    let detected = rows.iter().filter(|row| !row.is_censored());
    detected
        .filter_map(|row| {
            let sigma0 = row.sigma0?;
            let noise = noise_w * sigma0 / row.power_w.unwrap_or(sigma0);
            let model = table.at(&Place::new(row.theta_i_rad)).exp() + noise;
            Some(db_from_ratio(sigma0) - db_from_ratio(model))
        })
        .collect()
}

fn goodness(
    fit: &Fit,
    coordinates: &Coordinates,
    at: &DVector<f64>,
    rows: &[Observation],
) -> Goodness {
    let residuals_db = residuals_db(fit, coordinates, at, rows);
    if fit.method == Method::Censored {
        let noise_w = fit.noise_w.unwrap_or(0.0);
        let below = Likelihood::new(coordinates, rows, noise_w).ln_below(at);
        let censored: Vec<bool> = rows.iter().map(Observation::is_censored).collect();
        let speckle_db = standard_deviation_db(coordinates.looks(at));
        return goodness_of(&residuals_db, shares(&below, &censored, fit.seed), Some(speckle_db));
    }
    let squares: f64 = residuals_db.iter().map(|r| r * r).sum();
    let rms_db = (squares / residuals_db.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE);
    let shares = residuals_db.iter().map(|r| normal_share(r / rms_db)).collect();
    goodness_of(&residuals_db, shares, None)
}

fn data_hash(rows: &[Observation]) -> String {
    let mut hasher = blake3::Hasher::new();
    for (row, index) in rows.iter().zip(0u32..) {
        let sigma0 = row.level_sigma0().unwrap_or(f64::NAN);
        for number in [
            row.theta_i_rad,
            row.theta_sd_rad.unwrap_or(0.0),
            row.power_w.unwrap_or(sigma0),
            sigma0,
            row.range_m.unwrap_or(0.0),
        ] {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(&row.chirp.unwrap_or(index).to_le_bytes());
        hasher.update(&[u8::from(row.is_censored())]);
    }
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{BlinnPhong, Lambert, Tabulated};
    use crate::fit::FitError;
    use crate::fit::coordinates::{DIFFUSE_LEVEL, LOOKS, SPECULAR_LEVEL};
    use crate::fit::twin::{Twin, mixture};

    fn start() -> Brdf {
        mixture(0.1, 3.0, 0.02, 0.004)
    }

    fn value(result: &FitResult, name: &str) -> f64 {
        result.estimate(name).unwrap().value
    }

    fn quick() -> Fit {
        Fit { starts: 1, ..Fit::default() }
    }

    /// Error of the fitted curve at 55°, dB.
    fn error_at_55_db(result: &FitResult, truth: &Brdf) -> f64 {
        let theta_rad = 55f64.to_radians();
        db_from_ratio(result.model.sigma0(theta_rad) / truth.sigma0(theta_rad))
    }

    #[test]
    fn the_default_keeps_a_tail_that_least_squares_flattens() {
        let twin = Twin { rows: 3000, ..Twin::default() };
        let curve = twin.curve(11);
        assert!(curve.detected().count() < 2600, "{}", curve.detected().count());
        let default = quick().run(&start(), &curve).unwrap();
        assert!(default.converged, "{default:?}");
        let alpha = default.estimate("diffuse.alpha").unwrap();
        let [low, high] = alpha.interval_95.unwrap();
        assert!((alpha.value - 6.0).abs() < 3.0 * alpha.sd.unwrap(), "{alpha:?}");
        assert!(high - low < 3.0 && low < high, "{alpha:?}");
        assert!(error_at_55_db(&default, &twin.model).abs() < 1.0);
        for method in [
            Method::Mse { split_rad: 6f64.to_radians() },
            Method::Tls { theta_sd_rad: 2f64.to_radians(), level_sd_db: 5.6 },
        ] {
            let squares = Fit { method, ..quick() }.run(&start(), &curve).unwrap();
            assert!(value(&squares, "diffuse.alpha") < 4.5, "{squares:?}");
            assert!(squares.verdict.iter().any(|f| matches!(f, Finding::CensoredIgnored { .. })));
        }
    }

    #[test]
    fn the_orthogonal_distance_converges_where_angles_are_vague() {
        for seed in 0..3 {
            let curve = Twin { theta_sd_deg: 3.0, ..Twin::default() }.curve(seed);
            let method = Method::Tls { theta_sd_rad: 3f64.to_radians(), level_sd_db: 5.57 };
            let found = Fit { method, ..quick() }.run(&start(), &curve).unwrap();
            assert!(found.converged, "{:?} after {}", found.stop, found.iterations);
        }
    }

    #[test]
    fn intervals_cover_the_truth_about_as_often_as_they_say() {
        const SEEDS: u64 = 20;
        let twin = Twin { rows: 800, ..Twin::default() };
        let truth = [("S", 0.05), ("R", 0.0016), ("diffuse.alpha", 6.0), ("specular.m", 0.07)];
        let mut covered = [0; 4];
        let mut z_alpha = 0.0;
        for seed in 100..100 + SEEDS {
            let found = quick().run(&start(), &twin.curve(seed)).unwrap();
            for (count, (name, truth)) in covered.iter_mut().zip(truth) {
                let estimate = found.estimate(name).unwrap();
                let [low, high] = estimate.interval_95.unwrap();
                *count += usize::from((low..=high).contains(&truth));
                if name == "diffuse.alpha" {
                    z_alpha += (estimate.value - truth) / estimate.sd.unwrap() / SEEDS as f64;
                }
            }
        }
        // 15 of 20 or fewer happens to a true 95 % once in 400 times; the mean of 20 z is 0 ± 0.22.
        assert!(covered.iter().all(|&count| count > 15), "{covered:?}");
        assert!(z_alpha.abs() < 0.9, "{z_alpha}");
    }

    #[test]
    fn a_product_is_found_and_its_factors_are_not() {
        let found = quick().run(&start(), &Twin::default().curve(5)).unwrap();
        assert!(found.verdict.contains(&Finding::Gauge { k: 0.1 }));
        assert!(found.estimate("k").is_none() && found.estimate("specular.f_lambda").is_none());
        // The same model inside a sum has no gauge of its own: the singular values must say it.
        let sum = Brdf::Sum(crate::brdf::Sum { parts: vec![start()] });
        let found = quick().run(&sum, &Twin::default().curve(5)).unwrap();
        let together = found.verdict.iter().find_map(|finding| match finding {
            Finding::OnlyTogether { names } => Some(names.clone()),
            _ => None,
        });
        let together = together.expect("k, f_lambda and r_s are one family");
        assert!(together.contains(&"0.k".to_owned()), "{together:?}");
        assert!(found.estimate("0.k").unwrap().sd.is_none());
        assert!(found.estimate("0.diffuse.alpha").unwrap().sd.is_some());
    }

    #[test]
    fn the_likelihood_averages_each_chirp_and_not_the_mean() {
        // Eight looks and 3° of tilt: on the flank of the lobe the angle moves a power far more than
        // speckle does. A fit with exact angles must call that speckle.
        let twin = Twin { looks: 8.0, theta_sd_deg: 3.0, rows: 2000, ..Twin::default() };
        let curve = twin.curve(21);
        let found = quick().run(&start(), &curve).unwrap();
        assert!((found.looks.unwrap() / 8.0 - 1.0).abs() < 0.15, "{:?}", found.looks);
        assert!((found.goodness.z_variance - 1.0).abs() < 0.15, "{:?}", found.goodness);
        let mut blind = curve;
        blind.observations.iter_mut().for_each(|row| row.theta_sd_rad = Some(0.0));
        let blind = quick().run(&start(), &blind).unwrap();
        assert!(blind.looks.unwrap() < 5.0, "{:?}", blind.looks);
    }

    #[test]
    fn thermal_noise_is_told_from_the_tail() {
        let noise_w = 2e-11;
        let twin = Twin { threshold_dbm: -300.0, looks: 4.0, rows: 1500, ..Twin::default() };
        let mut curve = twin.curve(8);
        for row in &mut curve.observations {
            // Noise of as many looks on its own, so that the sum is Gamma only nearly.
            let (sigma0, power_w) = (row.sigma0.unwrap(), row.power_w.unwrap());
            row.power_w = Some(power_w + noise_w);
            row.sigma0 = Some((power_w + noise_w) * (sigma0 / power_w));
        }
        let with = Fit { noise_w: Some(noise_w), ..quick() }.run(&start(), &curve).unwrap();
        let without = quick().run(&start(), &curve).unwrap();
        let error = |result: &FitResult| (value(result, "diffuse.alpha") - 6.0).abs();
        assert!(error(&with) < 0.7 && error(&without) > 2.0 * error(&with), "{with:?}");
    }

    #[test]
    fn the_verdict_says_what_is_missing() {
        let far = Twin { theta_deg: [10.0, 60.0], theta_sd_deg: 0.5, ..Twin::default() };
        let found = quick().run(&start(), &far.curve(1)).unwrap();
        assert!(found.verdict.iter().any(|f| matches!(f, Finding::NoSpecularRows { .. })));
        let near = Twin { theta_deg: [0.0, 5.0], ..Twin::default() };
        let found = quick().run(&start(), &near.curve(1)).unwrap();
        assert!(found.verdict.iter().any(|f| matches!(f, Finding::NoDiffuseRows { .. })));
        let alpha = found.estimate("diffuse.alpha").unwrap();
        let vague = alpha.interval_95.is_none_or(|[low, high]| high - low > 10.0);
        assert!(vague, "{alpha:?} {:?}", found.verdict);
    }

    #[test]
    fn another_law_of_slopes_is_called_a_poor_fit() {
        let twin = Twin { looks: 8.0, theta_sd_deg: 0.0, ..Twin::default() };
        let lambert = Brdf::Lambert(Lambert { albedo: 0.1 });
        let found = quick().run(&lambert, &twin.curve(1)).unwrap();
        assert!(found.verdict.iter().any(|f| matches!(f, Finding::PoorFit { .. })), "{found:?}");
        let right = quick().run(&start(), &twin.curve(1)).unwrap();
        assert!(!right.verdict.iter().any(|f| matches!(f, Finding::PoorFit { .. })), "{right:?}");
    }

    #[test]
    fn any_model_with_a_free_number_fits_and_the_band_holds_the_truth() {
        let truth = Brdf::BlinnPhong(BlinnPhong { r_s: 0.01, alpha: 4.0 });
        let twin = Twin { model: truth.clone(), rows: 600, ..Twin::default() };
        let start = Brdf::BlinnPhong(BlinnPhong { r_s: 0.1, alpha: 20.0 });
        let found = quick().run(&start, &twin.curve(3)).unwrap();
        for theta_deg in [0.0f64, 20.0, 45.0, 60.0] {
            let Band { low, mid, high } = found.band(theta_deg.to_radians());
            assert!(low < mid && mid < high && high / low < 2.0, "{theta_deg}: {found:?}");
            let ratio = truth.sigma0(theta_deg.to_radians()) / mid;
            // A band is 1.96 deviations wide; truth within twice that.
            assert!(ratio.ln().abs() < 2.0 * (high / mid).ln(), "{theta_deg}: {ratio} {found:?}");
        }
    }

    #[test]
    fn a_bound_that_stops_a_number_is_said() {
        let bounds = vec![("diffuse.alpha".to_owned(), [0.0, 3.0])];
        let found = Fit { bounds, ..quick() }.run(&start(), &Twin::default().curve(1)).unwrap();
        let at_bound = |f: &Finding| matches!(f, Finding::AtBound { name, value } if name == "diffuse.alpha" && *value == 3.0);
        assert!(found.verdict.iter().any(at_bound), "{:?}", found.verdict);
        assert!(found.estimate("diffuse.alpha").unwrap().sd.is_none());
    }

    #[test]
    fn the_same_seed_gives_the_same_result_on_any_number_of_threads() {
        let curve = Twin { rows: 600, ..Twin::default() }.curve(4);
        let fit = Fit { starts: 2, seed: 9, ..Fit::default() };
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let run = || serde_json::to_string(&fit.run(&start(), &curve).unwrap()).unwrap();
        assert_eq!(one.install(run), three.install(run));
    }

    #[test]
    fn data_that_cannot_be_fitted_are_refused() {
        let curve = Twin { rows: 40, ..Twin::default() }.curve(1);
        let refused = |curve: &Curve| quick().run(&start(), curve).unwrap_err();
        assert_eq!(refused(&Curve::default()), FitError::Empty);
        let few = Curve { observations: curve.detected().take(3).copied().collect() };
        assert_eq!(refused(&few), FitError::TooFewRows { detected: 3, unknowns: 5 });
        let mut censored = curve.clone();
        for row in &mut censored.observations {
            *row = Observation::backscatter(row.theta_i_rad, None, row.level_sigma0());
        }
        assert_eq!(refused(&censored), FitError::AllCensored { rows: 40 });
        for (bad, name) in [(f64::NAN, "nan"), (-1.0, "negative"), (f64::INFINITY, "infinite")] {
            let mut broken = curve.clone();
            let row = &mut broken.observations[7];
            *row = Observation::backscatter(row.theta_i_rad, Some(bad), None);
            assert!(matches!(refused(&broken), FitError::Row { row: 7, .. }), "{name}");
            broken = curve.clone();
            broken.observations[7].theta_i_rad = bad;
            assert!(matches!(refused(&broken), FitError::Row { row: 7, .. }), "{name}");
        }
        let table = Brdf::Tabulated(Tabulated::new(&[(0.0, 1.0), (1.0, 0.1)]).unwrap());
        assert_eq!(quick().run(&table, &curve).unwrap_err(), FitError::NothingFree);
        let settings = Fit { looks: Some(0.0), ..quick() }.run(&start(), &curve).unwrap_err();
        assert!(settings.to_string().contains("fit.looks = 0"), "{settings}");
    }

    #[test]
    fn looks_are_estimated_beside_the_model() {
        let twin = Twin { looks: 4.0, ..Twin::default() };
        let found = quick().run(&start(), &twin.curve(2)).unwrap();
        let looks = found.estimate(LOOKS).unwrap();
        assert!((looks.value - 4.0).abs() < 4.0 * looks.sd.unwrap(), "{looks:?}");
        let [s, r] = found.model.identified_products().unwrap();
        assert!((s / value(&found, SPECULAR_LEVEL) - 1.0).abs() < 1e-9);
        assert!((r / value(&found, DIFFUSE_LEVEL) - 1.0).abs() < 1e-9);
    }
}
