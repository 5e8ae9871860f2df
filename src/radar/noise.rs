//! Thermal noise and range error as plain laws, for scans that skip the beat signal.
//!
//! An echo of power P in noise of power N has the complex amplitude √P·a + √N·w with w circular
//! Gaussian. Under speckle of L looks a is Gaussian too, and the mean of L such powers is
//! Gamma(L, (P + N)/L); without speckle it is |√P + √N·w|². The full chain of
//! [`RangeProcessor`](super::RangeProcessor) does the same by its samples.
//!
//! Noise and threshold are one statement: a receiver that discards what is below T does so because noise
//! seldom reaches T. A gate of n cells gives a false alarm with the probability
//! P_fa = 1 − (1 − p)ⁿ, where p = Q(L, L·T/N) is that of one cell and Q the regularised upper incomplete
//! gamma function; p = exp(−T/N) for a single look, hence N ≈ T/ln(n/P_fa). Where a scene states no level,
//! N follows from T in this way. It is an effective floor: as thermal noise of the default sweep, −88.4 dBm
//! would be a noise figure of 44 dB.

use serde::{Deserialize, Serialize};
use statrs::function::gamma::gamma_ur;

use super::error::{RadarError, in_range};
use super::random::Draws;
use super::speckle::IndependentSpeckle;
use crate::units::watts_from_dbm;

/// Noise of a detection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Noise {
    /// Noise power N in the cell of an echo, dBm, from −300 to 100. None: the effective floor at which noise
    /// alone passes the radar's threshold as seldom as the three fields below say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_dbm: Option<f64>,
    /// Probability P_fa, from 1e-15 to 0.5, that a gate without echo gives a detection. 1e-6 when not given:
    /// assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub false_alarm_probability: Option<f64>,
    /// Range cells n of the gate, from 1 to 1e6. 1 when neither it nor the gate's length is given: assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gate_cells: Option<f64>,
    /// Length of the gate, m, from 1e-6 to 1e6, in place of its cells of c/2B.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gate_length_m: Option<f64>,
    /// Where noise joins the echo. `before-looks`: assumed.
    #[serde(skip_serializing_if = "is_default")]
    pub added: Addition,
    /// Standard deviation of a range, m, from 0 to 10. 0.001: assumed.
    pub range_sd_m: f64,
}

/// Where noise joins an echo whose looks are averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Addition {
    /// Each look has noise of its own, and the average calms both.
    #[default]
    BeforeLooks,
    /// The average of the looks has noise once.
    AfterLooks,
}

/// P_fa where a scene states none.
const FALSE_ALARM_PROBABILITY: f64 = 1e-6;

impl Default for Noise {
    fn default() -> Self {
        Noise {
            level_dbm: None,
            false_alarm_probability: None,
            gate_cells: None,
            gate_length_m: None,
            added: Addition::default(),
            range_sd_m: 0.001,
        }
    }
}

impl Noise {
    /// Checks every setting against the range in which it has a meaning.
    ///
    /// # Errors
    /// The first setting out of range, by name; a level that is stated twice.
    pub fn validate(&self) -> Result<(), RadarError> {
        let checks = [
            ("noise.level_dbm", self.level_dbm.unwrap_or(0.0), (-300.0, 100.0)),
            (
                "noise.false_alarm_probability",
                self.false_alarm_probability.unwrap_or(FALSE_ALARM_PROBABILITY),
                (1e-15, 0.5),
            ),
            ("noise.gate_cells", self.gate_cells.unwrap_or(1.0), (1.0, 1e6)),
            ("noise.gate_length_m", self.gate_length_m.unwrap_or(1.0), (1e-6, 1e6)),
            ("noise.range_sd_m", self.range_sd_m, (0.0, 10.0)),
        ];
        checks.into_iter().try_for_each(in_range)?;
        let of_alarms = [
            ("false_alarm_probability", self.false_alarm_probability),
            ("gate_cells", self.gate_cells),
            ("gate_length_m", self.gate_length_m),
        ];
        let mut given = of_alarms.into_iter().filter(|(_, value)| value.is_some());
        match (self.level_dbm, given.next()) {
            (Some(_), Some((key, _))) => Err(RadarError::NoiseLevelTwice { key }),
            _ if self.gate_cells.is_some() && self.gate_length_m.is_some() => {
                Err(RadarError::GateTwice)
            }
            _ => Ok(()),
        }
    }

    /// Noise power N in a cell, W: the stated one, or the one that passes the threshold as seldom as is asked.
    ///
    /// `cell_m` is the length of a range cell and `looks` the looks that a detection averages.
    pub fn level_w(&self, threshold_w: f64, cell_m: f64, looks: f64) -> f64 {
        if let Some(level_dbm) = self.level_dbm {
            return watts_from_dbm(level_dbm);
        }
        let looks = match self.added {
            Addition::BeforeLooks => looks,
            Addition::AfterLooks => 1.0,
        };
        let by_length = self.gate_length_m.map_or(1.0, |length_m| length_m / cell_m);
        let cells = self.gate_cells.unwrap_or(by_length).max(1.0);
        let alarms = self.false_alarm_probability.unwrap_or(FALSE_ALARM_PROBABILITY);
        // 1 − (1 − p)ⁿ = P_fa, solved for p.
        let of_a_cell = -((-alarms).ln_1p() / cells).exp_m1();
        threshold_w / threshold_over_noise(of_a_cell, looks)
    }
}

fn is_default(added: &Addition) -> bool {
    *added == Addition::default()
}

/// T/N at which the mean of `looks` powers of noise alone passes T with a probability from 1e-21 to 0.5.
fn threshold_over_noise(probability: f64, looks: f64) -> f64 {
    // A tail of a Gamma variate of mean 1 falls at least as fast as that of Chernoff's bound, exp(−L(t − 1 − ln t)).
    let (mut low, mut high) = (0.0, 2.0 + 4.0 * (-probability.ln() / looks).max(1.0));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let above = gamma_ur(looks, looks * middle);
        if above > probability { low = middle } else { high = middle }
    }
    high
}

/// A power, W, in noise of mean `noise_w` that joins it once.
pub fn in_noise_w(power_w: f64, noise_w: f64, draws: &mut Draws) -> f64 {
    (power_w.sqrt() + draws.complex_gaussian() * noise_w.sqrt()).norm_sqr()
}

/// A power, W, as it is measured: `mean_w` with speckle that is drawn anew, in noise of mean `noise_w`.
pub fn measured_w(
    mean_w: f64,
    noise_w: f64,
    added: Addition,
    speckle: Option<IndependentSpeckle>,
    draws: &mut Draws,
) -> f64 {
    let Some(speckle) = speckle else { return in_noise_w(mean_w, noise_w, draws) };
    if added == Addition::AfterLooks {
        let echo_w = mean_w * speckle.intensity_factor(draws);
        return in_noise_w(echo_w, noise_w, draws);
    }
    let IndependentSpeckle { looks, coherent_ratio } = speckle;
    // Diffuse echo and noise are one Gaussian; beside it the coherent part keeps its power.
    let coherent_w = mean_w * coherent_ratio / (1.0 + coherent_ratio);
    let gaussian_w = mean_w - coherent_w + noise_w;
    if gaussian_w <= 0.0 {
        return coherent_w;
    }
    let together = IndependentSpeckle { looks, coherent_ratio: coherent_w / gaussian_w };
    (coherent_w + gaussian_w) * together.intensity_factor(draws)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    const COUNT: u64 = 40_000;

    /// Mean and standard deviation of measured powers.
    fn moments(
        mean_w: f64,
        noise_w: f64,
        added: Addition,
        speckle: Option<IndependentSpeckle>,
    ) -> [f64; 2] {
        let mut draws = Key { seed: 3, chirp: 0, sub_ray: 0, purpose: Purpose::Noise }.draws();
        let powers: Vec<f64> =
            (0..COUNT).map(|_| measured_w(mean_w, noise_w, added, speckle, &mut draws)).collect();
        let mean = powers.iter().sum::<f64>() / COUNT as f64;
        let variance = powers.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / COUNT as f64;
        [mean, variance.sqrt()]
    }

    const BEFORE: Addition = Addition::BeforeLooks;
    const AFTER: Addition = Addition::AfterLooks;

    #[test]
    fn powers_add_and_spread_as_their_laws_say() {
        // Rice: variance N² + 2PN. Gamma: (P + N)²/L. With a coherent part C: (G² + 2CG)/L. Noise after the
        // looks: N² + 2PN + P²/L.
        let developed = |looks| Some(IndependentSpeckle { looks, coherent_ratio: 0.0 });
        let partial = Some(IndependentSpeckle { looks: 4.0, coherent_ratio: 1.0 });
        for (added, speckle, sd) in [
            (BEFORE, None, (0.25f64 + 2.0 * 0.5).sqrt()),
            (AFTER, None, (0.25f64 + 2.0 * 0.5).sqrt()),
            (BEFORE, developed(1.0), 1.5),
            (AFTER, developed(1.0), 1.5),
            (BEFORE, developed(4.0), 0.75),
            (AFTER, developed(4.0), (0.25f64 + 2.0 * 0.5 + 0.25).sqrt()),
            (BEFORE, partial, ((1.0f64 + 2.0 * 0.5) / 4.0).sqrt()),
        ] {
            let [mean, found] = moments(1.0, 0.5, added, speckle);
            let bound = 5.0 * sd / (COUNT as f64).sqrt();
            assert!((mean - 1.5).abs() < bound, "{added:?} {speckle:?}: {mean}");
            assert!((found / sd - 1.0).abs() < 0.05, "{added:?} {speckle:?}: {found} is not {sd}");
        }
    }

    #[test]
    fn without_noise_and_speckle_a_power_stays_as_it_is() {
        let [mean, deviation] = moments(2.0, 0.0, BEFORE, None);
        assert!((mean - 2.0).abs() < 1e-12 && deviation < 1e-12);
        let silent = Some(IndependentSpeckle { looks: 1.0, coherent_ratio: 0.0 });
        assert_eq!(moments(0.0, 0.0, BEFORE, silent), [0.0, 0.0]);
    }

    /// The paper's threshold, W, and the cell of 27 GHz, m.
    const THRESHOLD_W: f64 = 1.995_262_315e-11;
    const CELL_M: f64 = 299_792_458.0 / 54e9;

    fn level_dbm(noise: &Noise, looks: f64) -> f64 {
        crate::units::dbm_from_watts(noise.level_w(THRESHOLD_W, CELL_M, looks))
    }

    #[test]
    fn without_a_level_the_floor_follows_from_the_threshold() {
        // −77 − 10·lg ln(n/10⁻⁶): ln 10⁶ = 13.816 and ln 10⁸ = 18.421.
        let gate = |cells| Noise { gate_cells: Some(cells), ..Noise::default() };
        assert!((level_dbm(&Noise::default(), 1.0) + 88.4037).abs() < 1e-4);
        assert!((level_dbm(&gate(100.0), 1.0) + 89.6530).abs() < 1e-4);
        let length = Noise { gate_length_m: Some(100.0 * CELL_M), ..Noise::default() };
        assert!((level_dbm(&length, 1.0) - level_dbm(&gate(100.0), 1.0)).abs() < 1e-9);
        // A gate within a cell is that cell.
        let short = Noise { gate_length_m: Some(0.1 * CELL_M), ..Noise::default() };
        assert_eq!(level_dbm(&short, 1.0), level_dbm(&Noise::default(), 1.0));
        // Four looks calm the noise: e⁻ˣ(1 + x + x²/2 + x³/6) = 10⁻⁶ at x = 4·T/N.
        let x = 4.0 * THRESHOLD_W / Noise::default().level_w(THRESHOLD_W, CELL_M, 4.0);
        let above = (-x).exp() * (1.0 + x + x * x / 2.0 + x.powi(3) / 6.0);
        assert!((above / 1e-6 - 1.0).abs() < 1e-6, "{above}");
        // Noise after the looks is not averaged.
        let after = Noise { added: AFTER, ..Noise::default() };
        assert!((level_dbm(&after, 4.0) + 88.4037).abs() < 1e-4);
        let stated = Noise { level_dbm: Some(-100.0), ..Noise::default() };
        assert!((level_dbm(&stated, 4.0) + 100.0).abs() < 1e-9);
    }

    #[test]
    fn every_probability_and_number_of_looks_has_its_floor() {
        for alarms in [1e-15, 1e-6, 0.5] {
            for looks in [0.1, 1.0, 2.5, 100.0, 1e4] {
                let ratio = threshold_over_noise(alarms, looks);
                let found = gamma_ur(looks, looks * ratio);
                assert!((found / alarms - 1.0).abs() < 1e-6, "{alarms} {looks}: {found}");
            }
        }
    }

    #[test]
    fn a_gate_of_noise_alone_passes_the_threshold_as_often_as_is_asked() {
        const GATES: u64 = 20_000;
        for (alarms, cells, looks, added) in [
            (0.02, 1, 1.0, BEFORE),
            (0.05, 25, 1.0, BEFORE),
            (0.05, 25, 4.0, BEFORE),
            (0.05, 25, 4.0, AFTER),
        ] {
            let noise = Noise {
                false_alarm_probability: Some(alarms),
                gate_cells: Some(f64::from(cells)),
                added,
                ..Noise::default()
            };
            let noise_w = noise.level_w(THRESHOLD_W, CELL_M, looks);
            let speckle = Some(IndependentSpeckle { looks, coherent_ratio: 0.0 });
            let is_alarm = |gate: &u64| {
                let key = Key { seed: 4, chirp: *gate, sub_ray: 0, purpose: Purpose::Noise };
                let mut draws = key.draws();
                let mut powers =
                    (0..cells).map(|_| measured_w(0.0, noise_w, added, speckle, &mut draws));
                powers.any(|power_w| power_w >= THRESHOLD_W)
            };
            let found = (0..GATES).filter(is_alarm).count() as f64;
            let expected = alarms * GATES as f64;
            // Four standard deviations of a binomial count.
            assert!((found - expected).abs() < 4.0 * expected.sqrt(), "{noise:?}: {found}");
        }
    }

    #[test]
    fn a_setting_without_meaning_is_named() {
        let text = |noise: Noise| noise.validate().unwrap_err().to_string();
        let gate = Noise { gate_cells: Some(0.0), ..Noise::default() };
        assert!(text(gate).contains("noise.gate_cells = 0"));
        let often = Noise { false_alarm_probability: Some(0.9), ..Noise::default() };
        assert!(text(often).contains("noise.false_alarm_probability = 0.9"));
        let twice = Noise { level_dbm: Some(-90.0), gate_cells: Some(9.0), ..Noise::default() };
        assert!(text(twice).contains("level_dbm and gate_cells"), "{}", text(twice));
        let gates = Noise { gate_length_m: Some(1.0), gate_cells: Some(9.0), ..Noise::default() };
        assert!(text(gates).contains("gate_length_m"), "{}", text(gates));
        Noise::default().validate().unwrap();
    }
}
