//! Normals that differ from the mesh's from chirp to chirp: two Gaussian tilts of one spread.

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::receiver::Receiver;
use crate::effects::shot::{Shot, Stage};

pub(crate) struct AngleError;

/// Tilts may have longer tails than normal ones, and a fit sees their core: of Student's t with five degrees of freedom 0.74
/// and 0.81 of the standard deviation on two scans. Two of these errors cover both.
const FORM_ERROR: f64 = 0.2;

const ABOUT: About = About {
    name: "angle-error",
    level: Level::Scene,
    description: "The true normal under each spot is tilted at random from the mesh's, by this standard \
         deviation in each of two directions: a coarse mesh, or a surface that waves.",
    signature: "The lobe looks broader and its peak lower, and the scatter of powers is wide where the curve \
         is steep. A rougher surface broadens the lobe without the scatter; speckle widens the \
         scatter alike at every angle.",
    parameters: &[EffectParameter::new("sd_deg", "deg", [0.0, 20.0], 0.0, 1.0)],
    conflicts: &[Conflict::OF_BACKSCATTER],
    has_one_form: false,
};

impl Effect for AngleError {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![0.4], vec![1.0], vec![3.0]]
    }

    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        FORM_ERROR * values[parameter]
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        let &[sd_deg] = values else { return receiver };
        let tilt_sd_rad = receiver.tilt_sd_rad.hypot(sd_deg.to_radians());
        Receiver { tilt_sd_rad, ..receiver }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_tilts_add_in_quadrature() {
        let declared = Receiver {
            looks: 4.0,
            noise_w: 1e-13,
            tilt_sd_rad: 3f64.to_radians(),
            ..Receiver::LINEAR
        };
        let found = AngleError.receive(&[4.0], declared);
        assert!((found.tilt_sd_rad.to_degrees() - 5.0).abs() < 1e-12);
        assert_eq!(found.looks, 4.0);
    }
}
