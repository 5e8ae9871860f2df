//! Thermal noise beyond what the radar declares: N + N_extra.

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level, Setting};
use crate::effects::receiver::Receiver;
use crate::effects::shot::{Shot, Stage};
use crate::units::watts_from_dbm;

pub(crate) struct NoiseFloor;

/// A level below anything thermal, dBm: no noise.
const NONE_DBM: f64 = -200.0;

const ABOUT: About = About {
    name: "noise-floor",
    level: Level::Instrument,
    description: "The receiver has more thermal noise than declared: this much power is added to every echo \
         and to what is declared.",
    signature: "Echoes near the threshold come out too strong, whatever their angle and range, and more of \
         them than expected are detected. Return from below the surface flattens the curve as well, \
         but at one σ⁰ and not at one power, and also far above the threshold.",
    parameters: &[EffectParameter::new("level_dbm", "dB[mW]", [NONE_DBM, -30.0], NONE_DBM, 1.0)],
    conflicts: &[Conflict {
        with: Setting::RangeReceiver,
        problem: "adds thermal noise, and [radar.receiver] makes all of its own",
        way_out: "raise radar.receiver.noise_figure_db instead",
    }],
    has_one_form: true,
};

impl Effect for NoiseFloor {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let [least, most] = [NONE_DBM + 1.0, -30.0];
        // The lowest of them is what half a dB more noise is where false alarms are rare.
        let below_db = [16.0, 12.0, 8.0, 4.0];
        below_db.map(|b| vec![(stage.geometry.radar.threshold_dbm - b).clamp(least, most)]).to_vec()
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        let &[level_dbm] = values else { return receiver };
        let extra_w = if level_dbm > NONE_DBM { watts_from_dbm(level_dbm) } else { 0.0 };
        Receiver { noise_w: receiver.noise_w + extra_w, ..receiver }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_powers_add() {
        let declared = Receiver { looks: 4.0, noise_w: 1e-12, ..Receiver::LINEAR };
        let found = NoiseFloor.receive(&[-90.0], declared).noise_w;
        assert!((found / 2e-12 - 1.0).abs() < 1e-12);
    }
}
