//! How much a model changes the data.

use super::observation::Observation;
use super::residual::scatter_db;
use super::score::DB;
use crate::effects::Prediction;

/// Change of the data between two predictions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Size {
    /// Root mean square change of the mean powers of the detections, dB; of a ceiling the change of their spread, if larger.
    pub mean_db: f64,
    /// Change of the spread, dB.
    pub spread_db: f64,
}

impl Size {
    /// The change from one prediction to another.
    pub fn of(observations: &[Observation], before: &Prediction, after: &Prediction) -> Size {
        let mut changes = Vec::new();
        for (shot, _) in observations.iter().enumerate().filter(|(_, o)| o.power_w.is_some()) {
            let [now, then] = [after, before].map(|p| p.passed_w(shot).max(f64::MIN_POSITIVE).ln());
            changes.push(DB * (now - then));
        }
        let by_speckle = wider([after, before].map(scatter_db));
        let by_tilts = wider([after, before].map(tilt_spread_db));
        // A ceiling holds the means and their scatter alike, and is no effect on the scatter.
        if after.receiver.ceiling != before.receiver.ceiling {
            return Size { mean_db: rms(&changes).max(by_speckle), spread_db: by_tilts };
        }
        Size { mean_db: rms(&changes), spread_db: by_speckle.max(by_tilts) }
    }

    /// The larger of both changes, dB.
    pub fn larger_db(self) -> f64 {
        self.mean_db.max(self.spread_db)
    }

    /// Whether the scatter changes more than the means.
    pub fn is_spread(self) -> bool {
        self.spread_db > self.mean_db
    }
}

/// Root mean square spread by random tilts, dB.
fn tilt_spread_db(prediction: &Prediction) -> f64 {
    let spreads: Vec<f64> =
        (0..prediction.tilts.len()).map(|shot| prediction.tilt_spread(shot)).collect();
    DB * rms(&spreads)
}

/// The spread that turns one into the other: spreads add in squares.
fn wider([a, b]: [f64; 2]) -> f64 {
    (a * a - b * b).abs().sqrt()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Ceiling, MeanEcho, Receiver};

    #[test]
    fn looks_spread_and_a_ceiling_shifts() {
        let predicted = |receiver: Receiver| Prediction {
            arrived: vec![Some(MeanEcho::at_once(1e-7, 8.0))],
            tilts: Vec::new(),
            receiver,
            saturating: receiver.saturating(),
        };
        let four = Receiver { looks: 4.0, ..Receiver::LINEAR };
        let two = Receiver { looks: 2.0, ..four };
        let ceiling = Ceiling { saturation_w: 1e-7, ..Ceiling::NONE };
        let observed = [Observation::detected(1e-7, None)];
        let size = |receiver| Size::of(&observed, &predicted(four), &predicted(receiver));
        let looks = size(two);
        assert!(looks.is_spread() && looks.mean_db == 0.0 && looks.spread_db > 1.0, "{looks:?}");
        let held = size(Receiver { ceiling, ..four });
        assert!(!held.is_spread() && held.mean_db > 1.0, "{held:?}");
    }
}
