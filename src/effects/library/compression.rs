//! A receiver that saturates: P becomes P/(1 + (P/P_sat)^p)^(1/p), with the knee p (Rapp, Proc. 2nd
//! Eur. Conf. Satell. Commun. (1991) 179, for powers), or what comes to its ceiling faster than that
//! (`effects/onset.rs`).
//!
//! The knee is a family by itself: 1 is a soft ceiling, 4 nearly a clip.
//!
//! A receiver that saturates at once also compresses the speckle, each look by itself or the mean of all; a
//! gain control slower than a chirp passes all of it.

use crate::effects::ceiling::Ceiling;
use crate::effects::effect::{About, Effect, EffectParameter, Level};
use crate::effects::receiver::Receiver;
use crate::effects::shot::{Shot, Stage};
use crate::units::watts_from_dbm;

pub(crate) struct Compression;

/// A saturation that no echo reaches, dBm.
const NONE_DBM: f64 = 60.0;

/// What the best knee and saturation leave of another ceiling, such as a hyperbolic tangent, dB.
const FORM_ERROR_DB: f64 = 0.2;

const ABOUT: About = About {
    name: "compression",
    level: Level::Instrument,
    description: "The receiver saturates: strong echoes come out weaker than they are, with a soft ceiling.",
    signature: "The residual falls with the predicted power, only at the strongest echoes and at any angle \
         or place that is as strong. A rougher lobe or an error of the angle lowers the peak too, but \
         raises the flanks beside it.",
    parameters: &[
        EffectParameter::new("saturation_dbm", "dB[mW]", [-90.0, NONE_DBM], NONE_DBM, 0.4),
        EffectParameter::new("at_once", "1", [0.0, 1.0], 1.0, 0.2),
        EffectParameter::new("knee", "1", [0.7, 4.0], 1.0, 0.2),
        EffectParameter::new("averaged", "1", [0.0, 1.0], 1.0, 0.2),
        EffectParameter::new("approach", "1", [1.0, 20.0], 1.0, 0.5),
    ],
    conflicts: &[],
    has_one_form: true,
};

impl Effect for Compression {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        // Powers above a ceiling are outliers, which do not lead a search to the right ceiling.
        let mut starts = Vec::new();
        for level in -27..=-7 {
            let saturation_dbm = 3.0 * f64::from(level);
            for [at_once, averaged] in [[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]] {
                starts.push(vec![saturation_dbm, at_once, 1.5, averaged, 1.0]);
            }
        }
        starts
    }

    /// Behind the average of the looks, before it, and slower than a chirp; the first two also with another approach.
    fn members(&self) -> &'static [&'static [usize]] {
        &[&[0, 2], &[0, 2, 3], &[0, 1, 2], &[0, 2, 4], &[0, 2, 3, 4]]
    }

    /// A receiver is one of the three, and not between.
    fn searched(&self, parameter: usize) -> [f64; 2] {
        let EffectParameter { min, max, .. } = ABOUT.parameters[parameter];
        if matches!(parameter, 1 | 3) { [0.0, 0.0] } else { [min, max] }
    }

    /// Outputs near the ceiling vary by hundredths of a decibel, over which ln p is a parabola of the ceiling.
    fn widest_difference(&self) -> f64 {
        0.001
    }

    fn form_error(&self, parameter: usize, _values: &[f64]) -> f64 {
        if parameter == 0 { FORM_ERROR_DB } else { 0.0 }
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        match *values {
            [saturation_dbm, at_once, knee, averaged, approach] if saturation_dbm < NONE_DBM => {
                let saturation_w = watts_from_dbm(saturation_dbm);
                let ceiling = Ceiling { saturation_w, knee, approach, at_once, averaged };
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
        let receiver = Compression.receive(&[-40.0, 0.0, 1.0, 1.0, 1.0], Receiver::LINEAR);
        let after_db = |power_w: f64| db(receiver.saturating().ln_mean(power_w.ln()).exp() / 1e-3);
        assert!((after_db(1e-7) + 40.0 + db(2.0)).abs() < 1e-9);
        assert!((after_db(1.0) + 40.0).abs() < 1e-3);
        assert!((after_db(1e-12) + 90.0).abs() < 1e-3);
    }

    #[test]
    fn one_that_no_echo_comes_near_is_none() {
        let receiver = Compression.receive(&[NONE_DBM, 1.0, 1.0, 1.0, 1.0], Receiver::LINEAR);
        assert_eq!(receiver, Receiver::LINEAR);
    }
}
