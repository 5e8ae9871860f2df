//! Runs a fit: checks its settings and its rows, then searches.

use super::coordinates::{Coordinates, DIFFUSE_LEVEL, LOOKS, SPECULAR_LEVEL};
use super::error::FitError;
use super::own_law::OwnLaw;
use super::parts::Parts;
use super::result::FitResult;
use super::search::SearchResult;
use super::settings::{Fit, Method};
use super::summary::summarise;
use crate::brdf::Brdf;
use crate::material::Observation;
use crate::measure::curve::{Curve, level_sigma0};

impl Fit {
    /// Fits a model to a curve, starting at the model as given.
    ///
    /// # Errors
    /// A setting, a start or a row without a meaning, a curve without detections or with fewer than
    /// unknowns. What else the data do not determine is in the [verdict](FitResult::verdict).
    pub fn run(&self, start: &Brdf, curve: &Curve) -> Result<FitResult, FitError> {
        let looks = self.checked_looks(curve)?;
        let are_retro = curve.observations.iter().all(Observation::is_retro);
        let of = if are_retro { Coordinates::new } else { Coordinates::of_pairs };
        if curve.illumination.relative && !are_retro {
            return Err(FitError::RelativePairs);
        }
        self.run_from(of(start, &self.fixed, &self.bounds, looks)?, curve)
    }

    /// As [`Fit::run`], of a law of a program's own. The model of the result is the law at the values that were found, as a
    /// table.
    ///
    /// # Errors
    /// As [`Fit::run`], and a curve of which source and receiver were in two directions.
    pub fn run_own(&self, law: &OwnLaw, curve: &Curve) -> Result<FitResult, FitError> {
        let looks = self.checked_looks(curve)?;
        if let Some(row) = curve.observations.iter().position(|row| !row.is_retro()) {
            return Err(FitError::OwnPairs { row });
        }
        self.run_from(Coordinates::of_own(law, &self.fixed, &self.bounds, looks)?, curve)
    }

    /// Checks settings and rows.
    fn checked_looks(&self, curve: &Curve) -> Result<Option<f64>, FitError> {
        self.validate()?;
        check_rows(&curve.observations)?;
        Ok(match self.method {
            Method::Censored => self.looks,
            Method::Mse { .. } | Method::Tls { .. } => {
                if let Some(row) = curve.observations.iter().position(|row| !row.is_retro()) {
                    return Err(FitError::Bistatic { row });
                }
                Some(self.looks.unwrap_or(1.0))
            }
        })
    }

    fn run_from(&self, coordinates: Coordinates, curve: &Curve) -> Result<FitResult, FitError> {
        let mut coordinates = coordinates.seen_by(self.beam_rad.unwrap_or(0.0));
        if self.method == Method::Censored {
            coordinates.redundant = Parts::of(&coordinates, &curve.observations).redundant;
        }
        let unknowns = coordinates.len();
        if coordinates.list.iter().all(|c| c.name == LOOKS) {
            return Err(FitError::NothingFree);
        }
        let detected = curve.detected().count();
        if detected == 0 {
            return Err(FitError::AllCensored { rows: curve.observations.len() });
        }
        // As many detections as unknowns are fitted exactly and leave no residual to estimate the errors from.
        if detected <= unknowns {
            return Err(FitError::TooFewRows { detected, unknowns });
        }
        let found = self.search(&coordinates, &curve.observations);
        let result = summarise(self, coordinates, &found, curve);
        match stopped_level(&result, &found).filter(|_| curve.illumination.relative) {
            Some((name, most)) => {
                let change = if most { "lower" } else { "raise" };
                Err(FitError::RelativeLevels { name, change })
            }
            None => Ok(result),
        }
    }
}

/// A level of the model that stopped at the end of its range though the fit would improve beyond it, and whether it is the
/// upper end.
fn stopped_level(result: &FitResult, found: &SearchResult) -> Option<(String, bool)> {
    const LEVELS: [&str; 5] = [SPECULAR_LEVEL, DIFFUSE_LEVEL, "albedo", "r_s", "f_lambda"];
    /// The way there and back through the scale of the search rounds.
    const NEARLY_1: f64 = 1.0 - 1e-9;
    if result.coordinates.is_own() {
        return None;
    }
    let gradient = found.best.local.gradient.iter();
    let levels = result.estimates.iter().zip(&result.coordinates.list).zip(gradient);
    let levels = levels.filter(|((estimate, _), _)| {
        LEVELS.contains(&estimate.name.rsplit('.').next().unwrap_or_default())
    });
    let above =
        levels.clone().find(|((estimate, _), slope)| estimate.value >= NEARLY_1 && **slope < 0.0);
    if let Some(((estimate, _), _)) = above {
        return Some((estimate.name.clone(), true));
    }
    // One part may be absent, but not all of them.
    let mut first = None;
    for ((estimate, coordinate), slope) in levels {
        if estimate.value > coordinate.min.max(1e-9) || *slope <= 0.0 {
            return None;
        }
        first = first.or(Some((estimate.name.clone(), false)));
    }
    first
}

/// Detections at larger angles than this, rad, no law explains: a ten-thousandth below a right angle.
const GRAZING_RAD: f64 = std::f64::consts::FRAC_PI_2 - 1e-4;

fn check_rows(rows: &[Observation]) -> Result<(), FitError> {
    if rows.is_empty() {
        return Err(FitError::Empty);
    }
    rows.iter().enumerate().try_for_each(|(index, row)| check_row(index, row))
}

/// Refuses a row that has no level, or a number without a meaning; `row` counts from 0.
fn check_row(row: usize, observation: &Observation) -> Result<(), FitError> {
    const QUARTER_RAD: f64 = std::f64::consts::FRAC_PI_2;
    let theta_sd_rad = observation.theta_sd_rad.unwrap_or(0.0);
    for (name, value) in [
        ("theta_rad", observation.theta_i_rad),
        ("theta_r_rad", observation.theta_r_rad),
        ("theta_sd_rad", theta_sd_rad),
    ] {
        if !(0.0..=QUARTER_RAD).contains(&value) {
            return Err(FitError::Row { row, name, value, wanted: "not from 0 to π/2" });
        }
    }
    for (name, value) in
        [("theta_rad", observation.theta_i_rad), ("theta_r_rad", observation.theta_r_rad)]
    {
        if value > GRAZING_RAD && !observation.is_censored() {
            let wanted = "at grazing incidence, where no law returns anything";
            return Err(FitError::Row { row, name, value, wanted });
        }
    }
    if !observation.delta_phi_rad.is_finite() {
        let (name, value) = ("delta_phi_rad", observation.delta_phi_rad);
        return Err(FitError::Row { row, name, value, wanted: "not a finite number" });
    }
    let sigma0 = level_sigma0(row, observation)?;
    for (name, value) in [("sigma0", sigma0), ("power_w", observation.power_w.unwrap_or(sigma0))] {
        if !(value.is_finite() && value > 0.0) {
            return Err(FitError::Row { row, name, value, wanted: "not above 0" });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{BlinnPhong, Lambert, Scattering, Tabulated};
    use crate::fit::coordinates::{DIFFUSE_LEVEL, SPECULAR_LEVEL};
    use crate::fit::result::Band;
    use crate::fit::twin::{Twin, mixture};
    use crate::fit::verdict::Finding;
    use crate::material::Aspect;
    use crate::radar::random::{Key, Purpose};
    use crate::units::db_from_ratio;

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
    fn relative_levels_above_any_law_are_refused_and_others_are_not() {
        let raised = |by: f64| {
            let mut curve = Twin { rows: 400, ..Twin::default() }.curve(1);
            curve.illumination.relative = true;
            for row in &mut curve.observations {
                row.sigma0 = row.sigma0.map(|sigma0| by * sigma0);
                row.threshold_sigma0 = row.threshold_sigma0.map(|limit| by * limit);
            }
            quick().run(&start(), &curve)
        };
        let error = raised(1e6).unwrap_err();
        assert!(error.to_string().contains("lower all levels"), "{error}");
        let flat = Brdf::Lambert(Lambert { albedo: 0.5 });
        let sum = Brdf::Sum(crate::brdf::Sum { parts: vec![flat.clone(), start()] });
        let bright = |law: &Brdf| {
            let mut curve = Curve::default();
            curve.illumination.relative = true;
            curve.observations = (0..40)
                .map(|k| {
                    let theta_rad = 0.02 * f64::from(k);
                    let level = 300.0 * theta_rad.cos().powi(2) * (1.0 + 0.1 * f64::from(k % 3));
                    Observation::backscatter(theta_rad, Some(level), None)
                })
                .collect();
            quick().run(law, &curve).unwrap_err()
        };
        for (law, name) in [(&flat, "albedo"), (&sum, "0.albedo")] {
            let name = name.to_owned();
            assert_eq!(bright(law), FitError::RelativeLevels { name, change: "lower" });
        }
        assert!(raised(1e-20).unwrap_err().to_string().contains("raise all levels"));
        let [own, lowered] = [1.0, 0.1].map(|by| raised(by).unwrap());
        let mut pairs = Twin { rows: 40, ..Twin::default() }.curve(1);
        pairs.illumination.relative = true;
        pairs.observations[3].theta_r_rad = 0.0;
        assert_eq!(quick().run(&start(), &pairs).unwrap_err(), FitError::RelativePairs);
        let alpha = |result| value(result, "diffuse.alpha");
        assert!((alpha(&own) - alpha(&lowered)).abs() < 1e-3, "{}", alpha(&lowered));
    }

    #[test]
    fn levels_without_noise_are_not_called_unexplained() {
        let curve = Curve::read(
            (0..60)
                .map(|deg| (deg, start().sigma0(f64::from(deg).to_radians())))
                .fold("theta_deg,sigma0_db\n".to_owned(), |text, (deg, sigma0)| {
                    text + &format!("{deg},{:.6}\n", db_from_ratio(sigma0))
                })
                .as_bytes(),
        );
        let found = quick().run(&start(), &curve.unwrap()).unwrap();
        let is_doubted =
            |f: &Finding| matches!(f, Finding::PoorFit { .. } | Finding::NeighboursAlike { .. });
        assert!(!found.verdict.iter().any(is_doubted), "{:?}", found.verdict);
        assert!((value(&found, "diffuse.alpha") - 3.0).abs() < 1e-2, "{found:?}");
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
        let curve = Twin { rows: 150, ..Twin::default() }.curve(4);
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
        let detected = curve.detected().take(3).copied().collect();
        let few = Curve { observations: detected, ..Curve::default() };
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
    fn detections_alone_give_the_truth_where_their_thresholds_are_known() {
        let twin = Twin { rows: 3000, threshold_dbm: -72.0, ..Twin::default() };
        let curve = twin.only_detected(5);
        let fit = Fit { looks: Some(1.0), ..quick() };
        let found = fit.run(&start(), &curve).unwrap();
        let cut = Curve {
            observations: curve
                .detected()
                .map(|row| Observation { threshold_sigma0: None, ..*row })
                .collect(),
            ..Curve::default()
        };
        let fooled = fit.run(&start(), &cut).unwrap();
        for (name, truth) in
            [(SPECULAR_LEVEL, 0.05), (DIFFUSE_LEVEL, 0.0016), ("diffuse.alpha", 6.0)]
        {
            let off = |of: &FitResult| {
                let estimate = of.estimate(name).unwrap();
                (estimate.value - truth).abs() / estimate.sd.unwrap()
            };
            assert!(off(&found) < 4.0, "{name}: {found:?}");
            assert!(name != DIFFUSE_LEVEL || off(&fooled) > 5.0, "{name}: {fooled:?}");
        }
        let least = Fit { method: Method::Mse { split_rad: 0.1 }, ..quick() };
        let said = least.run(&start(), &curve).unwrap().verdict;
        assert!(said.contains(&Finding::CutIgnored), "{said:?}");
    }

    /// A table in the plane of incidence of a law, of which each level is off by some looks of speckle.
    fn plane(law: &Brdf, looks: f64) -> Curve {
        let mut rows = Vec::new();
        for (incidence_deg, chirp) in [10.0f64, 30.0, 50.0].into_iter().zip(0u32..) {
            for (receiver_deg, place) in (-80..=80i32).step_by(2).zip(0u32..) {
                let chirp = 1000 * chirp + place;
                let key = Key { seed: 3, chirp: chirp.into(), sub_ray: 0, purpose: Purpose::Fit };
                let theta_i_rad = incidence_deg.to_radians();
                let aspect = Aspect::in_plane(theta_i_rad, f64::from(receiver_deg).to_radians());
                let row = Observation {
                    theta_r_rad: aspect.theta_r_rad,
                    delta_phi_rad: aspect.delta_phi_rad,
                    chirp: Some(chirp),
                    ..Observation::backscatter(theta_i_rad, Some(1.0), None)
                };
                let noise = 1.0 + key.draws().complex_gaussian().re * (2.0 / looks).sqrt();
                let sigma0 = aspect.sigma0(law) * noise.max(0.1);
                rows.push(Observation { sigma0: Some(sigma0), ..row });
            }
        }
        Curve { observations: rows, ..Curve::default() }
    }

    #[test]
    fn a_law_is_found_from_two_directions_as_from_one() {
        let truth = mixture(0.2, 3.0, 0.05, 0.004);
        let curve = plane(&truth, 100.0);
        let found = Fit::default().run(&mixture(0.6, 30.0, 0.01, 0.02), &curve).unwrap();
        assert!(found.converged, "{found:?}");
        assert_eq!(found.gauge_k, None, "a facet that is met at an angle tells f_lambda from k");
        for (name, truth) in
            [("specular.f_lambda", 0.05 / 0.9), ("specular.m", 0.2), ("diffuse.alpha", 3.0)]
        {
            let estimate = found.estimate(name).unwrap();
            let off = (estimate.value - truth).abs() / estimate.sd.unwrap();
            assert!(off < 4.0, "{name}: {estimate:?}");
        }
        for (found, truth) in
            found.model.identified_products().unwrap().into_iter().zip([0.05, 0.004])
        {
            assert!((found / truth).ln().abs() < 0.1, "{found} {truth}");
        }
        assert!((found.looks.unwrap() / 100.0).ln().abs() < 0.5, "{:?}", found.looks);
        let mirror = Aspect::in_plane(0.5, 0.5);
        let Band { low, mid, high } = found.band_of(mirror);
        let level = mirror.sigma0(&truth);
        assert!(low < mid && mid < high && (level / mid).ln().abs() < 2.0 * (high / mid).ln());
        let held = found.hold_out(&curve).unwrap();
        assert!(held.rms_db < 1.2 * found.goodness.rms_db, "{held:?}");
        // The data are others where they are seen from elsewhere.
        let mut moved = curve.clone();
        moved.observations[0].theta_r_rad += 1e-3;
        let again = quick().run(&found.model, &moved).unwrap();
        assert_ne!(again.data_hash, found.data_hash);
    }

    #[test]
    fn a_permittivity_is_told_where_it_is_met_at_an_angle() {
        let truth = crate::fit::model("kirchhoff-go").unwrap();
        let found = Fit::default().run(&truth, &plane(&truth, 1e4)).unwrap();
        let together = |f: &Finding| matches!(f, Finding::OnlyTogether { .. });
        assert!(!found.verdict.iter().any(together), "{:?}", found.verdict);
        let eps = found.estimate("eps_real").unwrap();
        assert!((eps.value - 3.0).abs() < 4.0 * eps.sd.unwrap(), "{eps:?}");
    }

    #[test]
    fn a_law_of_another_form_leaves_neighbours_alike() {
        let curve = plane(&mixture(0.2, 3.0, 0.05, 0.004), 1000.0);
        let alike = |model: &str| {
            let found = Fit::default().run(&crate::fit::model(model).unwrap(), &curve).unwrap();
            found.verdict.iter().any(|f| matches!(f, Finding::NeighboursAlike { .. }))
        };
        assert!(alike("mixture-ggx") && !alike("mixture"));
    }

    #[test]
    fn what_two_directions_do_not_allow_is_refused() {
        let mut curve = plane(&start(), 100.0);
        let method = Method::Mse { split_rad: 0.1 };
        let refused = Fit { method, ..quick() }.run(&start(), &curve).unwrap_err();
        assert_eq!(refused, FitError::Bistatic { row: 0 });
        curve.observations[5].delta_phi_rad = f64::INFINITY;
        let refused = quick().run(&start(), &curve).unwrap_err().to_string();
        assert!(refused.contains("row 5") && refused.contains("not a finite number"), "{refused}");
    }

    #[test]
    fn a_shape_is_found_where_the_level_is_held() {
        let truth = Brdf::BlinnPhong(BlinnPhong { r_s: 0.01, alpha: 4.0 });
        let curve = Twin { model: truth, rows: 600, ..Twin::default() }.curve(3);
        let held = Fit { fixed: vec![("r_s".to_owned(), 0.01)], ..Fit::default() };
        let start = Brdf::BlinnPhong(BlinnPhong { r_s: 0.01, alpha: 300.0 });
        let found = held.run(&start, &curve).unwrap();
        let alpha = found.estimate("alpha").unwrap();
        assert!(
            found.converged && (alpha.value - 4.0).abs() < 4.0 * alpha.sd.unwrap(),
            "{found:?}"
        );
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
    #[test]
    fn seven_levels_that_no_law_explains_are_not_said_to_tell_every_number() {
        // Measured averages of the sea at 9.3 GHz, VV, sea state 3 (Nathanson, in NRL/MR/5310--12-9346).
        let sea =
            "theta_deg,sigma0_db\n30,-16\n60,-26\n80,-32\n87,-38\n89,-39\n89.7,-45\n89.9,-51\n";
        let curve = Curve::read(sea.as_bytes()).unwrap();
        let lambert = Brdf::Lambert(Lambert { albedo: 0.1 });
        let found = Fit::default().run(&lambert, &curve).unwrap();
        let says = |wanted: fn(&Finding) -> bool| found.verdict.iter().any(wanted);
        assert!(says(|one| matches!(one, Finding::FewRows { detected: 7, .. })), "{found:?}");
        assert!(says(|one| matches!(one, Finding::MoreThanSpeckle { .. })), "{found:?}");
    }
}
