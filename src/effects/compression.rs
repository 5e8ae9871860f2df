//! A receiver that saturates: P becomes P/(1 + P/P_sat).

use super::{Arrived, Effect, Knob, Level, Look, Stage, Surveyed};
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
        const KNOBS: [Knob; 1] =
            [Knob::new("saturation_dbm", "dB[mW]", [-90.0, NONE_DBM], NONE_DBM, 2.0)];
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
        [-25.0, -35.0, -45.0, -55.0].map(|saturation_dbm| vec![saturation_dbm]).to_vec()
    }

    fn arrive(&self, values: &[f64], _: &Surveyed, _: &[Brdf], arrived: &mut [Option<Arrived>]) {
        let &[saturation_dbm] = values else { return };
        if saturation_dbm < NONE_DBM {
            let saturation_w = watts_from_dbm(saturation_dbm);
            let soft = |one: &mut Arrived| one.power_w /= 1.0 + one.power_w / saturation_w;
            arrived.iter_mut().flatten().for_each(soft);
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
            Compression.arrive(&[-40.0], &scan, &[], &mut arrived);
            db(arrived[0].unwrap().power_w / 1e-3)
        };
        assert!((after_db(1e-7) + 40.0 + db(2.0)).abs() < 1e-9);
        assert!((after_db(1.0) + 40.0).abs() < 1e-3);
        assert!((after_db(1e-12) + 90.0).abs() < 1e-3);
    }
}
