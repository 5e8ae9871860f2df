//! Fewer looks of speckle than the radar declares.

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level, Setting};
use crate::effects::receiver::Receiver;
use crate::effects::shot::{Shot, Stage};

pub(crate) struct Speckle;

/// A number of looks that leaves no speckle.
const ALL: f64 = 1e6;

const ABOUT: About = About {
    name: "speckle",
    level: Level::Instrument,
    description: "The echo of a rough surface fluctuates like an average of this many independent looks, fewer \
         than the radar is said to average.",
    signature: "The powers scatter more than they should, alike at every angle, place and power, and their \
         mean in watts stays right. An error of the angle scatters only where the curve is steep; a \
         higher noise floor only the weak echoes.",
    parameters: &[EffectParameter::new("looks", "1", [0.3, ALL], ALL, 0.5)],
    conflicts: &[Conflict {
        with: Setting::RangeReceiver,
        problem: "sets the looks of speckle, and [radar.receiver] averages whole beat signals",
        way_out: "set radar.speckle.looks instead",
    }],
    has_one_form: true,
};

impl Effect for Speckle {
    fn about(&self) -> &About {
        &ABOUT
    }

    /// As shares of the declared looks, or absolute where the radar declares no speckle.
    fn starts(&self, stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        let declared = stage.geometry.radar.speckle.map(|speckle| speckle.looks);
        match declared {
            Some(looks) => {
                [0.95, 0.85, 0.6, 0.3].map(|share| vec![(share * looks).clamp(0.3, ALL)]).to_vec()
            }
            None => [8.0, 4.0, 2.0, 1.0].map(|looks| vec![looks]).to_vec(),
        }
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        let &[looks] = values else { return receiver };
        if looks >= ALL {
            return receiver;
        }
        Receiver { looks: receiver.looks.min(looks), ..receiver }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_fewer_looks_change_anything() {
        let declared = Receiver { looks: 4.0, noise_w: 1e-13, ..Receiver::LINEAR };
        assert_eq!(Speckle.receive(&[2.5], declared).looks, 2.5);
        assert_eq!(Speckle.receive(&[9.0], declared), declared);
    }
}
