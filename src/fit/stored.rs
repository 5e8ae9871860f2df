//! A fit as a material stores it, and the 95 % band of a stored fit.

use super::coordinates::LOOKS;
use super::interval::DEVIATE_95;
use super::result::{Band, FitResult};
use super::settings::Method;
use crate::brdf::{Brdf, Scattering, ThroughBeam};
use crate::material::{self, BEAM, Covariance, Estimate, FitReport, FixedNumber, Lobes};

/// Relative step of a difference quotient.
const STEP: f64 = 1e-4;

impl FitResult {
    /// `mse`, `tls`, `tls-tail` (the tail's exponent held) or `censored`.
    pub fn method_name(&self) -> &'static str {
        let tail_is_held =
            self.fit.fixed.iter().any(|(path, _)| path.rsplit('.').next() == Some("alpha"));
        match self.fit.method {
            Method::Mse { .. } => "mse",
            Method::Tls { .. } if tail_is_held => "tls-tail",
            Method::Tls { .. } => "tls",
            Method::Censored => "censored",
        }
    }

    /// The fit of a material's curve; `source` is the key of where the curve comes from, which then
    /// is where the numbers come from.
    pub fn stored(&self, name: &str, curve: &str, source: &str) -> material::Fit {
        material::Fit {
            name: name.to_owned(),
            model: self.model.clone(),
            estimator: self.method_name().to_owned(),
            curve: Some(curve.to_owned()),
            source: source.to_owned(),
            lobes: if self.fit.beam_rad.is_some() {
                Lobes::Surface
            } else {
                Lobes::RadarAndSurface
            },
            parameter_sources: Vec::new(),
            covariance: self.parameter_covariance(),
            report: Some(self.report()),
        }
    }

    /// Covariance of those estimates that are parameters of the model and have a deviation.
    fn parameter_covariance(&self) -> Option<Covariance> {
        let parameters = self.model.parameters();
        let known: Vec<usize> = self
            .estimates
            .iter()
            .enumerate()
            .filter(|(_, e)| e.sd.is_some() && parameters.iter().any(|p| p.path == e.name))
            .map(|(index, _)| index)
            .collect();
        // Symmetric to the last bit.
        let mut matrix = Vec::new();
        for &a in &known {
            let mut row = Vec::new();
            for &b in &known {
                let (above, below) =
                    (self.covariance.get(a)?.get(b)?, self.covariance.get(b)?.get(a)?);
                row.push((above + below) / 2.0);
            }
            matrix.push(row);
        }
        let parameters =
            known.iter().filter_map(|&k| Some(self.estimates.get(k)?.name.clone())).collect();
        let covariance = Covariance { parameters, matrix };
        // A matrix that rounding has made indefinite is left out; the report keeps it as found.
        (!known.is_empty() && covariance.is_sound()).then_some(covariance)
    }

    fn report(&self) -> FitReport {
        FitReport {
            method: self.method_name().to_owned(),
            given: self.given(),
            looks: self.looks,
            noise_w: self.noise_w,
            gauge: self.gauge_k.map(|k| format!("k = {k} was chosen; S and R are found")),
            estimates: self.estimates.clone(),
            covariance: self.covariance.clone(),
            singular_values: self.singular_values.clone(),
            objective: self.objective,
            goodness: self.goodness,
            held_out: self.held_out.clone(),
            converged: self.converged,
            stop: self.stop.as_str().to_owned(),
            iterations: count(self.iterations),
            starts: count(self.fit.starts),
            agreeing_starts: count(self.agreeing_starts),
            verdict: self.verdict.iter().map(ToString::to_string).collect(),
            data_hash: self.data_hash.clone(),
            seed: self.fit.seed,
            version: self.version.to_owned(),
        }
    }

    fn given(&self) -> Vec<FixedNumber> {
        let settings = match self.fit.method {
            Method::Mse { split_rad } => vec![("method.split_rad", split_rad)],
            Method::Tls { theta_sd_rad, level_sd_db } => {
                vec![("method.theta_sd_rad", theta_sd_rad), ("method.level_sd_db", level_sd_db)]
            }
            Method::Censored => Vec::new(),
        };
        let settings = settings.into_iter().map(|(name, value)| (name.to_owned(), value));
        let looks = self.looks.and(self.fit.looks).map(|looks| (LOOKS.to_owned(), looks));
        let beam = self.fit.beam_rad.map(|beam_rad| (BEAM.to_owned(), beam_rad));
        let bounds = self.fit.bounds.iter().flat_map(|(name, [min, max])| {
            [(format!("{name}.min"), *min), (format!("{name}.max"), *max)]
        });
        let all = self.fit.fixed.iter().cloned().chain(bounds).chain(settings).chain(looks);
        let all = all.chain(beam);
        all.map(|(name, value)| FixedNumber { name, value }).collect()
    }
}

/// A count as files and the database keep it.
fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

/// The 95 % band of a stored fit at an angle (rad), as a beam of this angular radius (rad; 0: the surface itself) sees it,
/// by the delta method on ln σ⁰; `None` for a fit without a report, for one that did not converge, and where a number of
/// the law is undetermined. It is the band of a law of this form: how far the form itself is off is no part of it. The
/// derivatives are difference quotients of the stored model.
pub fn stored_band(fit: &material::Fit, beam_rad: f64, theta_rad: f64) -> Option<Band> {
    let report = fit.report.as_ref().filter(|report| report.converged)?;
    if undetermined(report).next().is_some() {
        return None;
    }
    let slopes: Vec<f64> =
        report.estimates.iter().map(|e| slope(&fit.model, e, beam_rad, theta_rad)).collect();
    let terms = report.covariance.iter().zip(&slopes).flat_map(|(row, a)| {
        row.iter().zip(&slopes).map(move |(covariance, b)| a * b * covariance)
    });
    let factor = (DEVIATE_95 * terms.sum::<f64>().max(0.0).sqrt()).exp();
    let mid = ThroughBeam { law: &fit.model, beam_rad }.sigma0(theta_rad);
    Some(Band { low: mid / factor, mid, high: mid * factor })
}

/// Names of the numbers of a law that have no variance at all, not even together with others: those at a bound. The looks
/// are no part of the level.
pub fn undetermined(report: &material::FitReport) -> impl Iterator<Item = &str> {
    let variance = |at: usize| report.covariance.get(at)?.get(at).copied();
    let unknown = report.estimates.iter().enumerate().filter(move |(at, one)| {
        one.sd.is_none() && one.name != "looks" && variance(*at).unwrap_or(0.0) == 0.0
    });
    unknown.map(|(_, one)| one.name.as_str())
}

/// d ln σ⁰ / d estimate; 0 for an estimate that is not a parameter of the model, such as the looks.
fn slope(model: &Brdf, estimate: &Estimate, beam_rad: f64, theta_rad: f64) -> f64 {
    // S is proportional to f_λ and R to r_s while k stays.
    let path = match estimate.name.as_str() {
        "S" => "specular.f_lambda",
        "R" => "diffuse.r_s",
        path => path,
    };
    let Some(parameter) = model.parameters().into_iter().find(|p| p.path == path) else {
        return 0.0;
    };
    let scale = if path == estimate.name { 1.0 } else { estimate.value / parameter.value };
    let step = STEP * parameter.value.abs().max(STEP * (parameter.max - parameter.min));
    let ends = [-step, step].map(|d| (parameter.value + d).clamp(parameter.min, parameter.max));
    let [below, above] = ends.map(|value| {
        let mut moved = model.clone();
        moved.set_parameter(path, value);
        ThroughBeam { law: &moved, beam_rad }.sigma0(theta_rad).ln()
    });
    let slope = (above - below) / ((ends[1] - ends[0]) * scale);
    if slope.is_finite() { slope } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::settings::Fit;
    use super::super::twin::{Twin, mixture};
    use super::*;

    #[test]
    fn the_band_of_a_stored_fit_is_that_of_the_fit() {
        let curve = Twin { rows: 500, ..Twin::default() }.curve(3);
        let found =
            Fit { starts: 1, ..Fit::default() }.run(&mixture(0.1, 3.0, 0.02, 0.004), &curve);
        let found = found.unwrap();
        let stored = found.stored("fit", "scan", "bench");
        let beam_rad = stored.beam_rad().unwrap_or(0.0);
        for theta_deg in [0.0f64, 3.0, 8.0, 30.0, 60.0] {
            let fresh = found.band(theta_deg.to_radians());
            let kept = stored_band(&stored, beam_rad, theta_deg.to_radians()).unwrap();
            let width = |band: Band| (band.high / band.low).ln();
            // Second-order terms of the difference quotients and of the fit's own table.
            assert!(
                (width(kept) / width(fresh) - 1.0).abs() < 0.02,
                "{theta_deg}: {fresh:?} {kept:?}"
            );
        }
    }

    #[test]
    fn numbers_that_cannot_be_told_apart_do_not_widen_the_band() {
        // Within eight degrees a lobe of m = 0.3 is nearly flat: its level, its width and the tail make up for each other.
        let twin = Twin {
            model: mixture(0.3, 6.0, 0.05, 0.0016),
            rows: 2000,
            theta_sd_deg: 0.3,
            theta_deg: [0.0, 8.0],
            ..Twin::default()
        };
        let found = Fit::default().run(&mixture(0.1, 3.0, 0.02, 0.004), &twin.curve(3)).unwrap();
        let stored = found.stored("fit", "scan", "bench");
        let covariance = &stored.report.as_ref().unwrap().covariance;
        // R, α, S and m.
        let [level, shape] = [[0, 2], [1, 3]]
            .map(|[a, b]| covariance[a][b] / (covariance[a][a] * covariance[b][b]).sqrt());
        assert!(level < -0.95 && shape > 0.95, "{covariance:?}");
        let is_told = |name: &str| {
            let numbers = stored.numbers();
            numbers.iter().any(|number| number.name == name && number.is_identified())
        };
        assert!(!is_told("R") && !is_told("diffuse.alpha"), "{:#?}", found.estimates);
        for theta_deg in [0.0f64, 2.0, 4.0, 6.0, 8.0] {
            let band = stored_band(&stored, 0.0, theta_deg.to_radians()).unwrap();
            let truth = twin.model.sigma0(theta_deg.to_radians());
            assert!(band.high / band.low < 1.3, "{theta_deg}: {band:?}");
            assert!((band.low..band.high).contains(&truth), "{theta_deg}: {band:?}, {truth}");
        }
    }

    #[test]
    fn a_report_holds_what_the_fit_found_and_was_given() {
        let curve = Twin { rows: 200, ..Twin::default() }.curve(3);
        let method = Method::Tls { theta_sd_rad: 0.05, level_sd_db: 5.6 };
        let fixed = vec![("diffuse.alpha".to_owned(), 5.0)];
        let bounds = vec![("specular.m".to_owned(), [0.01, 1.0])];
        let fit = Fit { method, fixed, bounds, starts: 1, seed: 7, ..Fit::default() };
        let found = fit.run(&mixture(0.1, 3.0, 0.02, 0.004), &curve).unwrap();
        let stored = found.stored("fit", "scan", "bench");
        let report = stored.report.unwrap();
        assert_eq!((report.method.as_str(), stored.estimator.as_str()), ("tls-tail", "tls-tail"));
        let given: Vec<(&str, f64)> =
            report.given.iter().map(|g| (g.name.as_str(), g.value)).collect();
        let held = [("diffuse.alpha", 5.0), ("specular.m.min", 0.01), ("specular.m.max", 1.0)];
        let settings = [("method.theta_sd_rad", 0.05), ("method.level_sd_db", 5.6)];
        assert_eq!(given, [held.to_vec(), settings.to_vec()].concat());
        assert_eq!((report.looks, report.seed, report.starts), (None, 7, 1));
        assert_eq!(report.verdict.len(), found.verdict.len());
        let m = found.estimate("specular.m").unwrap();
        let covariance = stored.covariance.unwrap();
        let sd = covariance.standard_deviation("specular.m").unwrap();
        assert!((sd / m.sd.unwrap() - 1.0).abs() < 1e-9, "{sd} {m:?}");
        assert!(covariance.standard_deviation("k").is_none());
    }
}
