//! A receiver that saturates: P becomes P/(1 + (P/P_sat)^p)^(1/p), with the knee p (Rapp, Proc. 2nd
//! Eur. Conf. Satell. Commun. (1991) 179, for powers).
//!
//! One that does so at once holds the speckle down, too, each look by itself or the mean of all; a gain
//! control slower than a chirp lets all of it pass.

use super::{Ceiling, Effect, EffectParameter, Level, Receiver, Shot, Stage};
use crate::units::watts_from_dbm;

/// The effect `compression`.
pub(super) struct Compression;

/// A ceiling that no echo comes near, dBm.
const NONE_DBM: f64 = 60.0;

impl Effect for Compression {
    fn name(&self) -> &'static str {
        "compression"
    }

    fn level(&self) -> Level {
        Level::Instrument
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const PARAMETERS: [EffectParameter; 4] = [
            EffectParameter::new("saturation_dbm", "dB[mW]", [-90.0, NONE_DBM], NONE_DBM, 2.0),
            EffectParameter::new("at_once", "1", [0.0, 1.0], 1.0, 0.2),
            EffectParameter::new("knee", "1", [1.0, 4.0], 1.0, 0.2),
            EffectParameter::new("averaged", "1", [0.0, 1.0], 1.0, 0.2),
        ];
        &PARAMETERS
    }

    fn description(&self) -> &'static str {
        "The receiver saturates: strong echoes come out weaker than they are, with a soft ceiling."
    }

    fn signature(&self) -> &'static str {
        "The residual falls with the predicted power, only at the strongest echoes and at any angle \
         or place that is as strong. A rougher lobe or an error of the angle lowers the peak too, but \
         raises the flanks beside it."
    }

    fn starts(&self, _stage: &Stage, _looks: &[Shot]) -> Vec<Vec<f64>> {
        // Powers that a ceiling leaves no room for are outliers, which show no way to the right one.
        let levels_dbm = (-27..=-7).map(|level| 3.0 * f64::from(level));
        let ways = [[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let start = |saturation_dbm: f64| {
            ways.map(|[at_once, averaged]| vec![saturation_dbm, at_once, 1.5, averaged])
        };
        levels_dbm.flat_map(start).collect()
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        match *values {
            [saturation_dbm, at_once, knee, averaged] if saturation_dbm < NONE_DBM => {
                let saturation_w = watts_from_dbm(saturation_dbm);
                let ceiling = Ceiling { saturation_w, knee, at_once, averaged };
                Receiver { ceiling, ..receiver }
            }
            _ => receiver,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::db;

    #[test]
    fn the_ceiling_is_soft() {
        let receiver = Compression.receive(&[-40.0, 0.0, 1.0, 1.0], Receiver::LINEAR);
        let after_db =
            |power_w: f64| db(receiver.saturating().of(power_w.ln()).ln_mean.exp() / 1e-3);
        assert!((after_db(1e-7) + 40.0 + db(2.0)).abs() < 1e-9);
        assert!((after_db(1.0) + 40.0).abs() < 1e-3);
        assert!((after_db(1e-12) + 90.0).abs() < 1e-3);
    }

    #[test]
    fn one_that_no_echo_comes_near_is_none() {
        let receiver = Compression.receive(&[NONE_DBM, 1.0, 1.0, 1.0], Receiver::LINEAR);
        assert_eq!(receiver, Receiver::LINEAR);
    }
}
