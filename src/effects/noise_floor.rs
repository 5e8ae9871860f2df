//! Thermal noise beyond what the radar declares: N + N_extra.

use super::{Effect, Knob, Level, Receiver, Shot, Stage};
use crate::units::watts_from_dbm;

/// The effect `noise-floor`.
pub(super) struct NoiseFloor;

/// A level below anything thermal, dBm: no noise.
const NONE_DBM: f64 = -200.0;

impl Effect for NoiseFloor {
    fn name(&self) -> &'static str {
        "noise-floor"
    }

    fn level(&self) -> Level {
        Level::Instrument
    }

    fn knobs(&self) -> &'static [Knob] {
        const KNOBS: [Knob; 1] =
            [Knob::new("level_dbm", "dB[mW]", [NONE_DBM, -30.0], NONE_DBM, 1.0)];
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "The receiver has more thermal noise than declared: this much power is added to every echo \
         and to what is declared."
    }

    fn shows(&self) -> &'static str {
        "Echoes near the threshold come out too strong, whatever their angle and range, and more of \
         them than expected are detected. Return from below the surface flattens the curve as well, \
         but at one σ⁰ and not at one power, and also far above the threshold."
    }

    fn starts(&self, stage: &Stage, _looks: &[Shot]) -> Vec<Vec<f64>> {
        let [least, most] = [NONE_DBM + 1.0, -30.0];
        let below_db = [13.0, 8.0, 4.0];
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
