//! Speckle: what many scatterers of unknown phase in one resolution cell do to its intensity.
//!
//! Fully developed, averaged over L looks, the intensity is multiplied by a Gamma(L, 1/L) variate
//! (Goodman 2007, "Speckle Phenomena in Optics", ch. 3 and 5). In decibels that is an offset of
//! 10/ln 10 · (ψ(L) − ln L) and a standard deviation of 10/ln 10 · √ψ′(L). With a coherent part K
//! times as strong as the diffuse one, the phasor is √(K/(K+1)) + z/√(K+1) with z circular Gaussian,
//! and its intensity Rician. Every factor has the mean 1.
//!
//! The scatterers are fixed to the surface. Chirps whose spots overlap see the same ones, so that their
//! speckle is alike: `render/speckle` has the forms of that field.

use std::fmt;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::error::{RadarError, in_range};
use super::random::Draws;

/// Speckle of the echoes. The default is that of a single look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SpeckleEntry")]
pub struct Speckle {
    /// Independent looks L averaged in one detection. A whole number from 1 to [`MOST_FIELDS`], each look a field of its
    /// own, as another frequency or another pose would have; from 0.1 to 1e6, not necessarily whole, for
    /// [`SpeckleForm::Independent`]. 1: assumed; the paper averages no chirps.
    pub looks: f64,
    /// How the field is made. None: [`SpeckleForm::Scatterers`] for a radar that reports phases and for a scene with
    /// receivers elsewhere or several paths in a beat signal, [`SpeckleForm::Law`] for any other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub form: Option<SpeckleForm>,
    /// What a file without a `form` states that only 0.1.0 knew; [`form`](Self::form) is then
    /// [`SpeckleForm::Independent`], the speckle of 0.1.0.
    #[serde(skip)]
    pub earlier: Option<EarlierSpeckle>,
}

/// What says that speckle was written for 0.1.0, which drew it anew for every chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EarlierSpeckle {
    /// Looks that are no number of fields: the number.
    Looks(f64),
    /// The ratio K of the coherent part to the diffuse one, for the whole scene. Each material has a ratio of its own
    /// now, and K does nothing.
    CoherentRatio(f64),
}

impl fmt::Display for EarlierSpeckle {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            EarlierSpeckle::Looks(looks) => write!(
                f,
                "radar.speckle.looks = {looks} is drawn anew for every chirp, as in 0.1.0, since speckle that is fixed to the \
                 surface has whole looks from 1 to {MOST_FIELDS}; form = \"independent\" states it"
            ),
            EarlierSpeckle::CoherentRatio(ratio) => write!(
                f,
                "radar.speckle.coherent_ratio = {ratio} is ignored, since each material has a coherent share of its own; \
                 speckle is drawn anew for every chirp, as in 0.1.0; remove the key, and state form = \"independent\" to keep \
                 that"
            ),
        }
    }
}

/// How the speckle of neighbouring chirps is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpeckleForm {
    /// A Gaussian field over the target plane with the beam's correlation, exp(−d²/w₀²) between the amplitudes of chirps
    /// that aim d apart. As right as scatterers for a single antenna and fast.
    Law,
    /// Scatterers on the facets, whose waves add up with their phases: also right between antennas, poses and frequencies.
    Scatterers,
    /// Drawn anew for every chirp. Neighbours that share most of their spots then have nothing in common, so that images
    /// look smoother and fits seem surer than any measurement.
    Independent,
}

impl SpeckleForm {
    /// The word that a scene uses.
    pub fn as_str(self) -> &'static str {
        match self {
            SpeckleForm::Law => "law",
            SpeckleForm::Scatterers => "scatterers",
            SpeckleForm::Independent => "independent",
        }
    }
}

/// Largest number of looks that are fields. Their mean has a contrast of 6 %.
pub const MOST_FIELDS: f64 = 256.0;

/// The table as written.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct SpeckleEntry {
    looks: f64,
    form: Option<SpeckleForm>,
    coherent_ratio: f64,
}

impl Default for SpeckleEntry {
    fn default() -> Self {
        let Speckle { looks, form, .. } = Speckle::default();
        SpeckleEntry { looks, form, coherent_ratio: 0.0 }
    }
}

impl TryFrom<SpeckleEntry> for Speckle {
    type Error = &'static str;

    fn try_from(entry: SpeckleEntry) -> Result<Speckle, Self::Error> {
        let SpeckleEntry { looks, form, coherent_ratio } = entry;
        if !EARLIER_RATIOS.contains(&coherent_ratio) {
            return Err(
                "coherent_ratio is not a number from 0 to 1e9; it is no longer a key, remove it",
            );
        }
        if form.is_some() && coherent_ratio != 0.0 {
            return Err(
                "coherent_ratio is not a key with a form: how much of an echo is coherent follows from the \
                        material, all of a smooth surface's and nothing of a diffuse one's; remove it",
            );
        }
        let is_earlier = !is_number_of_fields(looks) && EARLIER_LOOKS.contains(&looks);
        let earlier = match form {
            None if coherent_ratio != 0.0 => Some(EarlierSpeckle::CoherentRatio(coherent_ratio)),
            None if is_earlier => Some(EarlierSpeckle::Looks(looks)),
            _ => None,
        };
        let form = form.or(earlier.map(|_| SpeckleForm::Independent));
        Ok(Speckle { looks, form, earlier })
    }
}

/// What 0.1.0 took as looks and as the ratio of the coherent part to the diffuse one.
const EARLIER_LOOKS: RangeInclusive<f64> = 0.1..=1e6;
const EARLIER_RATIOS: RangeInclusive<f64> = 0.0..=1e9;

/// Whether looks can be fields of their own.
fn is_number_of_fields(looks: f64) -> bool {
    looks.fract() == 0.0 && (1.0..=MOST_FIELDS).contains(&looks)
}

impl Default for Speckle {
    fn default() -> Self {
        Speckle { looks: 1.0, form: None, earlier: None }
    }
}

impl Speckle {
    /// Checks the number of looks against the range in which it has a meaning.
    ///
    /// # Errors
    /// A number of looks out of range, or one that is no number of fields.
    pub fn validate(&self) -> Result<(), RadarError> {
        let looks = self.looks;
        match self.form {
            Some(SpeckleForm::Independent) => in_range(("speckle.looks", looks, (0.1, 1e6))),
            _ if is_number_of_fields(looks) => Ok(()),
            _ => Err(RadarError::PartOfAField { looks, most: MOST_FIELDS }),
        }
    }
}

/// Speckle that is drawn anew for every echo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndependentSpeckle {
    /// Looks L, above 0, not necessarily whole.
    pub looks: f64,
    /// K: power of the coherent part over that of the diffuse part, 0 or above.
    pub coherent_ratio: f64,
}

impl IndependentSpeckle {
    /// Factor on a power, of mean 1: the mean of L intensities |√K + z|²/(1 + K), drawn at once.
    ///
    /// It is a Gamma variate whose shape is L plus a Poisson count of mean LK; with K = 0 it is the Gamma(L, 1/L) of
    /// developed speckle.
    pub fn intensity_factor(&self, draws: &mut Draws) -> f64 {
        let shape = self.looks + draws.poisson(self.looks * self.coherent_ratio);
        shape * draws.gamma(shape) / (self.looks * (1.0 + self.coherent_ratio))
    }

    /// Standard deviation of the intensity over its mean, √((1 + 2K)/L)/(1 + K); 1/√L without a
    /// coherent part.
    pub fn contrast(&self) -> f64 {
        ((1.0 + 2.0 * self.coherent_ratio) / self.looks).sqrt() / (1.0 + self.coherent_ratio)
    }
}

/// Mean of the decibels of developed speckle of L looks, less the decibels of its mean: −2.51 for
/// one look, towards 0 for many.
pub fn mean_offset_db(looks: f64) -> f64 {
    DB_PER_NEPER * (digamma(looks) - looks.ln())
}

/// Standard deviation of the decibels of developed speckle of L looks: 5.57 for one look.
pub fn standard_deviation_db(looks: f64) -> f64 {
    DB_PER_NEPER * trigamma(looks).sqrt()
}

/// Decibels of a power ratio e.
const DB_PER_NEPER: f64 = 10.0 / std::f64::consts::LN_10;

/// Below this argument the recurrences climb; above it the asymptotic series are good to 1e-13.
const LARGE: f64 = 12.0;

/// ψ(x) for x > 0: ψ(x) = ψ(x + 1) − 1/x up to a large x, then the asymptotic series (Abramowitz and
/// Stegun 6.3.18).
fn digamma(x: f64) -> f64 {
    if x < LARGE {
        return digamma(x + 1.0) - 1.0 / x;
    }
    let y = 1.0 / (x * x);
    let series = y * (1.0 / 12.0 - y * (1.0 / 120.0 - y * (1.0 / 252.0 - y * (1.0 / 240.0))));
    x.ln() - 0.5 / x - series
}

/// ψ′(x) for x > 0, in the same way (Abramowitz and Stegun 6.4.12).
fn trigamma(x: f64) -> f64 {
    if x < LARGE {
        return trigamma(x + 1.0) + 1.0 / (x * x);
    }
    let y = 1.0 / (x * x);
    let series = y * (1.0 / 6.0 - y * (1.0 / 30.0 - y * (1.0 / 42.0 - y * (1.0 / 30.0))));
    (1.0 + 0.5 / x + series) / x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};
    use crate::units::db_from_ratio;

    const COUNT: usize = 20_000;

    fn draws(chirp: u64) -> Draws {
        Key { seed: 5, chirp, sub_ray: 0, purpose: Purpose::Speckle }.draws()
    }

    fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64;
        [mean, variance.sqrt()]
    }

    /// Looks, offset and standard deviation, dB.
    const PUBLISHED_DB: [(f64, f64, f64); 4] =
        [(1.0, -2.51, 5.57), (2.0, -1.17, 3.49), (4.0, -0.57, 2.31), (8.0, -0.28, 1.59)];

    #[test]
    fn decibels_have_their_closed_forms() {
        for (looks, offset_db, deviation_db) in PUBLISHED_DB {
            assert!((mean_offset_db(looks) - offset_db).abs() < 0.01, "{looks}");
            assert!((standard_deviation_db(looks) - deviation_db).abs() < 0.01, "{looks}");
        }
    }

    #[test]
    fn psi_matches_its_special_values() {
        const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;
        let pi2 = std::f64::consts::PI.powi(2);
        assert!((digamma(1.0) + EULER_GAMMA).abs() < 1e-12);
        assert!((digamma(0.5) + EULER_GAMMA + 2.0 * std::f64::consts::LN_2).abs() < 1e-12);
        assert!((trigamma(1.0) - pi2 / 6.0).abs() < 1e-12);
        assert!((trigamma(0.5) - pi2 / 2.0).abs() < 1e-12);
    }

    #[test]
    fn samples_have_the_stated_decibels_and_contrast() {
        for (looks, ..) in PUBLISHED_DB {
            let mut draws = draws(looks as u64);
            let factors: Vec<f64> = (0..COUNT)
                .map(|_| {
                    IndependentSpeckle { looks, coherent_ratio: 0.0 }.intensity_factor(&mut draws)
                })
                .collect();
            let levels_db: Vec<f64> = factors.iter().map(|&x| db_from_ratio(x)).collect();
            let [mean_db, deviation_db] = mean_and_deviation(&levels_db);
            let bound_db = 5.0 * standard_deviation_db(looks) / (COUNT as f64).sqrt();
            assert!((mean_db - mean_offset_db(looks)).abs() < bound_db, "{looks}: {mean_db}");
            // The decibels are skewed, which widens the law of their deviation less than twice.
            let gap_db = (deviation_db - standard_deviation_db(looks)).abs();
            assert!(gap_db < 2.0 * bound_db, "{looks}: {deviation_db}");
            let [mean, deviation] = mean_and_deviation(&factors);
            assert!((deviation / mean * looks.sqrt() - 1.0).abs() < 0.05, "{looks}");
        }
    }

    #[test]
    fn a_coherent_part_calms_the_speckle() {
        for ratio in [0.0, 0.5, 4.0, 100.0] {
            for looks in [1.0, 2.5] {
                let speckle = IndependentSpeckle { looks, coherent_ratio: ratio };
                let mut draws = draws(100);
                let factors: Vec<f64> =
                    (0..COUNT).map(|_| speckle.intensity_factor(&mut draws)).collect();
                let [mean, deviation] = mean_and_deviation(&factors);
                let expected = speckle.contrast();
                assert!(
                    (mean - 1.0).abs() < 5.0 * expected / (COUNT as f64).sqrt(),
                    "{ratio}: {mean}"
                );
                assert!((deviation / expected - 1.0).abs() < 0.05, "{looks} {ratio}");
            }
        }
    }

    #[test]
    fn drawn_at_once_or_look_by_look_is_one_law() {
        let (looks, ratio) = (3, 2f64);
        let (mut some, mut other) = (draws(1), draws(2));
        let of_a_look = |draws: &mut Draws| (ratio.sqrt() + draws.complex_gaussian()).norm_sqr();
        let mut powers: Vec<f64> = (0..COUNT)
            .map(|_| (0..looks).map(|_| of_a_look(&mut some)).sum::<f64>())
            .map(|sum| sum / (f64::from(looks) * (1.0 + ratio)))
            .collect();
        let at_once = IndependentSpeckle { looks: f64::from(looks), coherent_ratio: ratio };
        let mut factors: Vec<f64> =
            (0..COUNT).map(|_| at_once.intensity_factor(&mut other)).collect();
        powers.sort_by(f64::total_cmp);
        factors.sort_by(f64::total_cmp);
        // Two-sample Kolmogorov–Smirnov: 1.95·√(2/n) is passed once in a thousand.
        let below = |x: f64| factors.partition_point(|&f| f <= x) as f64 / COUNT as f64;
        let gap = powers
            .iter()
            .enumerate()
            .map(|(i, &x)| (below(x) - i as f64 / COUNT as f64).abs())
            .fold(0.0, f64::max);
        assert!(gap < 1.95 * (2.0 / COUNT as f64).sqrt(), "{gap}");
    }

    #[test]
    fn looks_are_fields_unless_they_are_independent() {
        let of = |looks, form| Speckle { looks, form, earlier: None }.validate();
        for form in [None, Some(SpeckleForm::Law), Some(SpeckleForm::Scatterers)] {
            of(4.0, form).unwrap();
            for looks in [0.0, 2.5, 257.0, f64::NAN] {
                let error = of(looks, form).unwrap_err().to_string();
                assert!(
                    error.contains("radar.speckle.looks") && error.contains("independent"),
                    "{error}"
                );
            }
        }
        of(2.5, Some(SpeckleForm::Independent)).unwrap();
        assert!(of(0.0, Some(SpeckleForm::Independent)).is_err());
    }

    #[test]
    fn the_share_that_was_stated_is_now_the_material_s() {
        let read = |text: &str| toml::from_str::<Speckle>(text);
        let kept = read("looks = 2\ncoherent_ratio = 0").unwrap();
        assert_eq!(kept, Speckle { looks: 2.0, ..Default::default() });
        for form in ["law", "scatterers", "independent"] {
            let error = read(&format!("form = \"{form}\"\ncoherent_ratio = 3")).unwrap_err();
            assert!(error.to_string().contains("follows from the material"), "{error}");
        }
        for ratio in ["-1", "nan", "inf", "1e10"] {
            let error = read(&format!("coherent_ratio = {ratio}")).unwrap_err().to_string();
            assert!(error.contains("from 0 to 1e9"), "{error}");
        }
    }

    #[test]
    fn a_table_of_0_1_0_that_has_no_field_is_drawn_anew_and_says_so() {
        for (text, looks, said) in [
            ("looks = 2.5", 2.5, "radar.speckle.looks = 2.5 is drawn anew"),
            ("looks = 1000", 1000.0, "radar.speckle.looks = 1000 is drawn anew"),
            ("looks = 4\ncoherent_ratio = 3", 4.0, "radar.speckle.coherent_ratio = 3 is ignored"),
        ] {
            let speckle: Speckle = toml::from_str(text).unwrap();
            speckle.validate().unwrap();
            assert_eq!((speckle.looks, speckle.form), (looks, Some(SpeckleForm::Independent)));
            let notice = speckle.earlier.unwrap().to_string();
            assert!(notice.contains(said) && notice.contains("\"independent\""), "{notice}");
            // What a record keeps of it states the form and needs no notice.
            let record = toml::to_string(&speckle).unwrap();
            assert!(record.contains("form = \"independent\"") && !record.contains("coherent"));
            assert_eq!(toml::from_str::<Speckle>(&record).unwrap().earlier, None);
        }
        let whole: Speckle = toml::from_str("looks = 4").unwrap();
        assert_eq!((whole.form, whole.earlier), (None, None));
        for text in ["looks = 0", "looks = -2", "looks = nan", "looks = 1e7"] {
            assert!(toml::from_str::<Speckle>(text).unwrap().validate().is_err(), "{text}");
        }
        let stated: Speckle = toml::from_str("looks = 2.5\nform = \"law\"").unwrap();
        assert!(stated.validate().is_err());
    }
}
