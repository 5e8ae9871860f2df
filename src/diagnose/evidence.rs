//! The evidence for an effect.

use serde::{Serialize, Serializer};

use crate::effects::Effect;

/// Standard errors by which an effect may make the predictions of one cloud worse by chance.
const BY_CHANCE: f64 = 2.0;

/// Gain in ln p of the held-out patches of one cloud by an effect of a joint diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CloudGain {
    /// Number of the cloud, from 1.
    pub cloud: usize,
    /// Gain in ln p.
    pub gain: f64,
    /// Its standard error.
    pub se: f64,
}

impl CloudGain {
    /// Whether the effect makes the predictions of the cloud worse beyond chance.
    pub(super) fn contradicts(&self) -> bool {
        self.gain < -BY_CHANCE * self.se
    }
}

/// Numbers of scans as a file has them: from 1.
pub(super) fn from_one<S: Serializer>(scans: &[u16], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(scans.iter().map(|scan| scan + 1))
}

/// An effect in one round of the search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Round, from 1.
    pub round: usize,
    /// Name of the effect.
    pub name: &'static str,
    /// Scans on which it acts, of several that are diagnosed together; empty for all.
    #[serde(rename = "clouds", serialize_with = "from_one", skip_serializing_if = "Vec::is_empty")]
    pub scans: Vec<u16>,
    /// Number of its parameters.
    pub numbers: usize,
    /// Gain in ln likelihood over the model so far.
    pub gain: f64,
    /// Whether the gain is that of a sample of the shots, too small for a fit to all of them.
    pub sampled: bool,
    /// Largest gain of a placebo with as many parameters, at most six; only for effects on the short list.
    pub placebo_gain: Option<f64>,
    /// Gain in ln p of held-out patches and its standard error; only for effects on the short list.
    pub held_out: Option<[f64; 2]>,
    /// Change of the data: root mean square of mean powers, or of the spread, dB.
    pub size_db: f64,
    /// Whether the fit converged.
    pub converged: bool,
    /// Whether the effect was added in this round and stayed.
    pub accepted: bool,
    /// Gain in each of several clouds; empty for one cloud, and for an effect that is not supported.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub by_cloud: Vec<CloudGain>,
}

impl Candidate {
    /// A candidate of which only the gain on a sample is known.
    pub(super) fn sampled(round: usize, effect: &dyn Effect, gain: f64) -> Candidate {
        let numbers = effect.parameters().len();
        Candidate {
            round,
            name: effect.name(),
            scans: effect.scans().to_vec(),
            numbers,
            gain,
            sampled: true,
            placebo_gain: None,
            held_out: None,
            size_db: 0.0,
            converged: false,
            accepted: false,
            by_cloud: Vec::new(),
        }
    }

    /// Whether another one is of the same effect on the same scans.
    pub(super) fn is_same(&self, other: &Candidate) -> bool {
        self.name == other.name && self.scans == other.scans
    }

    /// Whether one of several clouds on which it acts excludes it.
    pub(super) fn is_excluded(&self) -> bool {
        self.acting().any(CloudGain::contradicts)
    }

    /// Its gains in the clouds on which it acts.
    pub(super) fn acting(&self) -> impl Iterator<Item = &CloudGain> {
        let acts = |one: &&CloudGain| {
            self.scans.is_empty()
                || self.scans.iter().any(|scan| usize::from(*scan) + 1 == one.cloud)
        };
        self.by_cloud.iter().filter(acts)
    }
}

/// Why an effect was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// Gain in ln likelihood over the model before.
    pub gain: f64,
    /// Gain of a placebo with as many parameters, at most six.
    pub placebo_gain: f64,
    /// Gain in ln p of held-out patches.
    pub held_out_gain: f64,
    /// Its standard error over patches.
    pub held_out_se: f64,
    /// Change of the data: root mean square of mean powers, or of the spread, dB.
    pub size_db: f64,
    /// Gain in ln p of the held-out patches of each of several clouds; empty for one cloud.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub by_cloud: Vec<CloudGain>,
}

impl From<&Candidate> for Evidence {
    fn from(candidate: &Candidate) -> Evidence {
        let [held_out_gain, held_out_se] = candidate.held_out.unwrap_or_default();
        Evidence {
            gain: candidate.gain,
            placebo_gain: candidate.placebo_gain.unwrap_or_default(),
            held_out_gain,
            held_out_se,
            size_db: candidate.size_db,
            by_cloud: candidate.by_cloud.clone(),
        }
    }
}

/// Share of the largest gain below which an effect may compensate for an error of the form of another.
const SHARE_OF_GAIN: f64 = 0.1;
/// The same share for an effect on the scatter, which gains little for its size.
const SHARE_OF_GAIN_OF_SPREAD: f64 = 0.05;
/// Largest gain per shot that measures how large an effect is. A larger one shows that something was out of place.
const MOST_OF_A_SHOT: f64 = 2.0;

/// Gain by false alarms alone, in least gains, from which they show an effect by themselves.
const FAR_BEYOND_ALARMS: f64 = 4.0;

/// Whether false alarms show an effect by themselves.
pub(super) fn is_shown_by_alarms(of_alarms: f64, least: f64) -> bool {
    of_alarms >= FAR_BEYOND_ALARMS * least
}

/// The largest size, dB, and the largest gain in ln likelihood among effects.
#[derive(Clone, Copy, Default)]
pub(super) struct Largest {
    pub size_db: f64,
    gain: f64,
}

impl Largest {
    /// The largest of several effects; zero of none.
    pub fn of<'e>(evidence: impl Iterator<Item = &'e Evidence>) -> Largest {
        evidence.fold(Largest::default(), |Largest { size_db, gain }, one| Largest {
            size_db: size_db.max(one.size_db),
            gain: gain.max(one.gain),
        })
    }

    /// The largest of the others as far as it counts against an effect that gains so much by the false alarms alone. An
    /// error of another effect's form changes no detection off the target.
    pub fn beside(self, of_alarms: f64, least: f64) -> Largest {
        if is_shown_by_alarms(of_alarms, least) { Largest::default() } else { self }
    }

    /// Gain below which another effect may only correct the form of the largest, on a scan of this many independent shots.
    pub fn least_gain(self, is_spread: bool, shots: f64) -> f64 {
        let share = if is_spread { SHARE_OF_GAIN_OF_SPREAD } else { SHARE_OF_GAIN };
        share * self.gain.min(MOST_OF_A_SHOT * shots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_beside_a_large_effect_must_be_large_itself() {
        let is_near = |gain: f64, expected: f64| (gain - expected).abs() < 1e-9;
        let large = Largest { size_db: 2.0, gain: 7_580.0 };
        assert!(is_near(Largest::default().least_gain(false, 18_529.0), 0.0));
        assert!(is_near(large.least_gain(false, 18_529.0), 758.0));
        assert!(is_near(large.least_gain(true, 18_529.0), 379.0));
        // What false alarms show by themselves is no error of another effect's form.
        let beside = |of_alarms: f64| large.beside(of_alarms, 5.0).least_gain(true, 18_529.0);
        assert!(is_near(beside(19.0), 379.0) && is_near(beside(21.0), 0.0));
        // A pose far off gains without end at edges, which must not hide any other effect.
        let far = Largest { gain: 170_150.0, ..large };
        assert!(is_near(far.least_gain(false, 8_708.0), 1_741.6));
    }
}
