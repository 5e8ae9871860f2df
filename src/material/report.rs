//! The record of a fit, stored with its values so that a reader knows how far to trust them.

use serde::{Deserialize, Serialize};

use super::error::{MaterialError, value};
use super::form::is_hash;

/// The record of one fit to one curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitReport {
    /// `mse`, `tls`, `tls-tail` or `censored`.
    pub method: String,
    /// Numbers that were set and not found: held parameters by their path, narrower ranges as their
    /// path and `.min` or `.max`, settings as `method.…`, `looks`.
    pub given: Vec<FixedNumber>,
    /// Looks L of the speckle, given or found; none for least squares.
    pub looks: Option<f64>,
    /// Mean thermal power that the fit allowed for, W, 0 or more.
    pub noise_w: f64,
    /// How numbers that the data do not determine were chosen; none where there was no choice.
    pub gauge: Option<String>,
    /// The numbers found.
    pub estimates: Vec<Estimate>,
    /// Their covariance, row by row, without the directions that the data do not determine; rows of estimates at a bound
    /// are 0. Before 0.2.0 so were those of all estimates without a deviation.
    pub covariance: Vec<Vec<f64>>,
    /// Singular values of the information, scaled to a unit diagonal, largest first.
    pub singular_values: Vec<f64>,
    /// ln likelihood for `censored`, else half the sum of scaled squares, negative.
    pub objective: f64,
    /// How well the curve is explained.
    pub goodness: Goodness,
    /// How well points are predicted that took no part in the fit; none where that was not tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<CrossValidation>,
    /// Whether the search ended at an optimum.
    pub converged: bool,
    /// Why it ended.
    pub stop: String,
    /// Steps of the best start.
    pub iterations: u32,
    /// Points that the search started from.
    pub starts: u32,
    /// Starts that reached the best fit.
    pub agreeing_starts: u32,
    /// What the fit cannot promise, a sentence each.
    pub verdict: Vec<String>,
    /// Hash (BLAKE3, hexadecimal) of the rows that were fitted.
    pub data_hash: String,
    /// Seed of the search.
    pub seed: u64,
    /// Version of the program that fitted.
    pub version: String,
}

/// How well points are predicted by fits that they took no part in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrossValidation {
    /// Parts that took turns at being held out.
    pub folds: u32,
    /// Blocks of neighbouring points that the parts were dealt.
    pub blocks: u32,
    /// What these are: `squares` of the target, `runs` of consecutive chirps, or single `points`.
    pub blocks_of: String,
    /// Side of squares, m; none for others.
    pub block_m: Option<f64>,
    /// Mean ln p of a point, per unit of ln power; none for least squares.
    pub score: Option<f64>,
    /// Its standard error over blocks, 0 or more.
    pub score_sd: Option<f64>,
    /// Root mean square of detections over the model that was fitted without them, dB, 0 or more.
    pub rms_db: f64,
    /// Hash (BLAKE3, hexadecimal) of the part of every point.
    pub fold_hash: String,
}

/// A number that was set and not found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedNumber {
    /// As [`FitReport::given`] says.
    pub name: String,
    /// Its value, in its own unit.
    pub value: f64,
}

/// A number that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimate {
    /// A parameter's path; `S` for (1 − k)·f_λ and `R` for k·r_s; `looks`.
    pub name: String,
    /// Its value, in its own unit.
    pub value: f64,
    /// Standard deviation, 0 or more; none where the data do not determine the number by itself.
    pub sd: Option<f64>,
    /// 95 % interval; none as for `sd`.
    pub interval_95: Option<[f64; 2]>,
}

/// How well a fit explains its curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goodness {
    /// Root mean square of detections over the model, dB.
    pub rms_db: f64,
    /// Mean of detections over the model, dB.
    pub mean_db: f64,
    /// Standard deviation of speckle alone about its own mean, dB; none for least squares.
    pub speckle_db: Option<f64>,
    /// Mean of the normal residuals, 0 if the law is right.
    pub z_mean: f64,
    /// Their variance, 1 if the law is right.
    pub z_variance: f64,
    /// Kolmogorov's distance of the residuals from their law, 0 to 1.
    pub ks_distance: f64,
    /// Number of residuals.
    pub rows: u32,
}

impl Goodness {
    /// How far the form of the law is off, dB rms: by how much the normal residuals, which count what was not detected, scatter
    /// more than speckle does. Nearly so up to as much as the speckle itself; of a larger one it is too small. 0 where it is
    /// no more than chance leaves in so many independent rows, two standard deviations of their variance; none where the
    /// speckle is not known.
    pub fn form_error_db(&self) -> Option<f64> {
        let beyond = self.z_variance + self.z_mean.powi(2) - 1.0;
        let chance = 2.0 * (2.0 / f64::from(self.rows.max(1))).sqrt();
        let in_speckle = if beyond > chance { beyond.sqrt() } else { 0.0 };
        self.speckle_db.map(|speckle_db| in_speckle * speckle_db)
    }
}

impl CrossValidation {
    /// What the blocks are, in words.
    pub fn of(&self) -> String {
        match (self.blocks_of.as_str(), self.block_m) {
            ("squares", Some(side_m)) => format!("squares of {:.3} m", side_m),
            ("runs", _) => "runs of chirps".to_owned(),
            ("points", _) => "single points".to_owned(),
            (other, _) => other.to_owned(),
        }
    }

    fn numbers(&self) -> impl Iterator<Item = f64> {
        [self.block_m, self.score, self.score_sd, Some(self.rms_db)].into_iter().flatten()
    }
}

impl Estimate {
    fn numbers(&self) -> impl Iterator<Item = f64> {
        let interval = self.interval_95.into_iter().flatten();
        [Some(self.value), self.sd].into_iter().flatten().chain(interval)
    }
}

impl FitReport {
    /// Parameters that backscatter sees only inside S = (1 − k)·f_λ and R = k·r_s: where
    /// [`gauge`](FitReport::gauge) says that there was a choice, their values are a convention.
    pub const BY_CONVENTION: [&str; 3] = ["diffuse.r_s", "k", "specular.f_lambda"];

    /// Whether the value of a parameter is a convention, and not determined by the data.
    pub fn is_by_convention(&self, path: &str) -> bool {
        self.gauge.is_some()
            && Self::BY_CONVENTION.contains(&path)
            && self.given.iter().all(|given| given.name != path)
    }

    /// A found number by its name.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }

    pub(super) fn validate(&self, place: &str) -> Result<(), MaterialError> {
        match self.problem() {
            None => Ok(()),
            Some(problem) => {
                Err(value(&format!("{place}, report"), problem, "fit the curve again"))
            }
        }
    }

    /// What of it has no meaning.
    fn problem(&self) -> Option<&'static str> {
        if self.numbers().any(|number| !number.is_finite()) {
            return Some("a number is not finite");
        }
        let not_negative = [self.noise_w, self.looks.unwrap_or(0.0)];
        let deviations = self.estimates.iter().filter_map(|estimate| estimate.sd);
        let held_out = self.held_out.iter().flat_map(|h| [h.score_sd, Some(h.rms_db), h.block_m]);
        let deviations = deviations.chain(held_out.flatten());
        if not_negative.into_iter().chain(deviations).any(|number| number < 0.0) {
            return Some("the looks, the noise, a deviation or an error is negative");
        }
        if self.estimates.iter().filter_map(|e| e.interval_95).any(|[low, high]| low > high) {
            return Some("an interval ends before it begins");
        }
        let n = self.estimates.len();
        if self.covariance.len() != n || self.covariance.iter().any(|row| row.len() != n) {
            return Some("the covariance has another size than the list of estimates");
        }
        let fold_hash = self.held_out.as_ref().map(|held| &held.fold_hash);
        if ![&self.data_hash].into_iter().chain(fold_hash).all(|hash| is_hash(hash)) {
            return Some("the hash of the data or of the folds is not 64 hexadecimal digits");
        }
        None
    }

    fn numbers(&self) -> impl Iterator<Item = f64> {
        let Goodness { rms_db, mean_db, speckle_db, z_mean, z_variance, ks_distance, .. } =
            self.goodness;
        [rms_db, mean_db, z_mean, z_variance, ks_distance, self.noise_w, self.objective]
            .into_iter()
            .chain(speckle_db)
            .chain(self.held_out.iter().flat_map(CrossValidation::numbers))
            .chain(self.looks)
            .chain(self.given.iter().map(|given| given.value))
            .chain(self.estimates.iter().flat_map(Estimate::numbers))
            .chain(self.covariance.iter().flatten().copied())
            .chain(self.singular_values.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_form_is_what_speckle_leaves_unexplained() {
        let form_error_db = |z_variance, z_mean, rows, speckle_db| {
            let goodness = Goodness { z_variance, z_mean, rows, speckle_db, ..report().goodness };
            goodness.form_error_db()
        };
        assert_eq!(form_error_db(2.0, 0.0, 200, Some(3.0)), Some(3.0));
        assert_eq!(form_error_db(1.0, 1.0, 200, Some(3.0)), Some(3.0));
        // 200 rows: the variance scatters by a tenth.
        assert_eq!(form_error_db(1.15, 0.0, 200, Some(3.0)), Some(0.0));
        assert!(form_error_db(1.15, 0.0, 20_000, Some(3.0)).unwrap() > 1.1);
        assert_eq!(form_error_db(0.5, 0.0, 200, Some(3.0)), Some(0.0));
        assert_eq!(form_error_db(2.0, 0.0, 200, None), None);
    }

    fn report() -> FitReport {
        let estimate = Estimate {
            name: "S".to_owned(),
            value: 0.05,
            sd: Some(0.01),
            interval_95: Some([0.03, 0.07]),
        };
        FitReport {
            method: "censored".to_owned(),
            given: vec![FixedNumber { name: "looks".to_owned(), value: 1.0 }],
            looks: Some(1.0),
            noise_w: 0.0,
            gauge: None,
            estimates: vec![estimate],
            covariance: vec![vec![1e-4]],
            singular_values: vec![1.0],
            objective: -1.0,
            goodness: Goodness {
                rms_db: 5.6,
                mean_db: -2.5,
                speckle_db: Some(5.57),
                z_mean: 0.0,
                z_variance: 1.0,
                ks_distance: 0.1,
                rows: 9,
            },
            held_out: Some(CrossValidation {
                folds: 5,
                blocks: 9,
                blocks_of: "squares".to_owned(),
                block_m: Some(0.05),
                score: Some(-1.2),
                score_sd: Some(0.1),
                rms_db: 5.7,
                fold_hash: "0b".repeat(32),
            }),
            converged: true,
            stop: "stationary".to_owned(),
            iterations: 3,
            starts: 1,
            agreeing_starts: 1,
            verdict: Vec::new(),
            data_hash: "0a".repeat(32),
            seed: 0,
            version: "0.1.0".to_owned(),
        }
    }

    #[test]
    fn a_report_without_a_meaning_is_refused() {
        assert_eq!(report().validate("fit"), Ok(()));
        type Spoil = fn(&mut FitReport);
        let cases: [(Spoil, &str); 12] = [
            (|r| r.objective = f64::NAN, "not finite"),
            (|r| r.given[0].value = f64::INFINITY, "not finite"),
            (|r| r.estimates[0].interval_95 = Some([0.0, f64::INFINITY]), "not finite"),
            (|r| r.covariance[0][0] = f64::NAN, "not finite"),
            (|r| r.estimates[0].sd = Some(-1.0), "negative"),
            (|r| r.noise_w = -1.0, "negative"),
            (|r| r.estimates[0].interval_95 = Some([1.0, 0.0]), "ends before it begins"),
            (|r| r.covariance = Vec::new(), "another size"),
            (|r| r.data_hash = "0A".repeat(32), "hexadecimal"),
            (|r| r.held_out.as_mut().unwrap().fold_hash.clear(), "hexadecimal"),
            (|r| r.held_out.as_mut().unwrap().score = Some(f64::NAN), "not finite"),
            (|r| r.held_out.as_mut().unwrap().rms_db = -1.0, "negative"),
        ];
        for (spoil, expected) in cases {
            let mut spoilt = report();
            spoil(&mut spoilt);
            let message = spoilt.validate("fit `a`").unwrap_err().to_string();
            assert!(
                message.starts_with("fit `a`, report: ") && message.contains(expected),
                "{message}"
            );
        }
    }
}
