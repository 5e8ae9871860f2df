//! A receiver that saturates: P becomes P/(1 + (P/P_sat)^p)^(1/p), with the knee p (Rapp, Proc. 2nd
//! Eur. Conf. Satell. Commun. (1991) 179, for powers).
//!
//! One that does so at once holds the speckle down, too: of a small relative fluctuation about the mean
//! P̄ it passes 1/(1 + (P̄/P_sat)^p). A gain control slower than a chirp passes all of it.

use super::{Arrived, Effect, Knob, Level, Look, Receiver, Stage, Surveyed};
use crate::brdf::Brdf;
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

    fn knobs(&self) -> &'static [Knob] {
        const KNOBS: [Knob; 3] = [
            Knob::new("saturation_dbm", "dB[mW]", [-90.0, NONE_DBM], NONE_DBM, 2.0),
            Knob::new("at_once", "1", [0.0, 1.0], 1.0, 0.2),
            Knob::new("knee", "1", [1.0, 4.0], 1.0, 0.2),
        ];
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "The receiver saturates: strong echoes come out weaker than they are, with a soft ceiling."
    }

    fn shows(&self) -> &'static str {
        "The residual falls with the predicted power, only at the strongest echoes and at any angle \
         or place that is as strong. A rougher lobe or an error of the angle lowers the peak too, but \
         raises the flanks beside it."
    }

    fn starts(&self, _stage: &Stage, _looks: &[Look]) -> Vec<Vec<f64>> {
        let levels_dbm = [-25.0, -35.0, -45.0, -55.0];
        let start =
            |at_once: f64| levels_dbm.map(|saturation_dbm| vec![saturation_dbm, at_once, 1.0]);
        [1.0, 0.0].map(start).concat()
    }

    fn arrive(&self, values: &[f64], _: &Surveyed, _: &[Brdf], arrived: &mut [Option<Arrived>]) {
        let &[saturation_dbm, _, knee] = values else { return };
        if saturation_dbm < NONE_DBM {
            let saturation_w = watts_from_dbm(saturation_dbm);
            let soft = |one: &mut Arrived| {
                one.power_w /= (1.0 + (one.power_w / saturation_w).powf(knee)).powf(1.0 / knee);
            };
            arrived.iter_mut().flatten().for_each(soft);
        }
    }

    /// 1/(1 + (P̄/P_sat)^p) is 1 less the p-th power of the compressed mean over P_sat.
    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        match *values {
            [saturation_dbm, at_once, knee] if saturation_dbm < NONE_DBM => {
                let ceiling_w = watts_from_dbm(saturation_dbm) * at_once.powf(-1.0 / knee);
                Receiver { ceiling_w, knee, ..receiver }
            }
            _ => receiver,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn the_ceiling_is_soft() {
        let bench = Bench::plate();
        let after_db = |power_w: f64| {
            let mut arrived = [Some(Arrived { power_w, range_m: 8.0 })];
            let scan = Surveyed { stage: &bench.stage(), looks: &[], survey: None };
            Compression.arrive(&[-40.0, 1.0, 1.0], &scan, &[], &mut arrived);
            db(arrived[0].unwrap().power_w / 1e-3)
        };
        assert!((after_db(1e-7) + 40.0 + db(2.0)).abs() < 1e-9);
        assert!((after_db(1.0) + 40.0).abs() < 1e-3);
        assert!((after_db(1e-12) + 90.0).abs() < 1e-3);
    }

    #[test]
    fn only_what_saturates_at_once_holds_the_speckle_down() {
        let receiver = |at_once: f64| Compression.receive(&[-40.0, at_once, 1.0], Receiver::LINEAR);
        // A mean that came in at the saturation leaves at half of it.
        assert!((receiver(1.0).passes(0.5e-7) - 0.5).abs() < 1e-12);
        assert!((receiver(0.5).passes(0.5e-7) - 0.75).abs() < 1e-12);
        assert_eq!(receiver(0.0).passes(0.5e-7), 1.0);
    }
}
