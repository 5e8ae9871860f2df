//! Laws that return what no surface does through a beam.
//!
//! A beam of the divergence δ returns 4π·δ²·f·cos θ of its power at its focus, which is 1 for a facing mirror. Models are
//! convolved with the beam and stay below. A tabulated curve is used as it is: where it is above 1/(4π·δ²·cos θ), or falls
//! faster than the beam's own lobe, it is not that of a surface which this beam looks at.

use std::f64::consts::PI;

use super::models::Brdf;
use super::scattering::{Scattering, ScatteringModel};
use super::through_beam::ThroughBeam;
use crate::frames::Direction;
use crate::units::db_from_ratio;

/// Steps of the angle in a width of the beam, and how many widths have such steps.
const STEPS_PER_BEAM: u32 = 32;
const BEAMS: u32 = 8;
/// Steps beyond, rad, up to 80°, from where on no model holds.
const STEP_RAD: f64 = PI / 180.0;
const STEPS: u32 = 80;
/// What interpolation between points may add to a level.
const SLACK: f64 = 0.01;
/// Share of the beam's width that a peak may be narrower by interpolation.
const NARROW: f64 = 0.9;

/// How a law is not that of a surface seen by a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeyondBeam {
    /// It returns more than a mirror.
    Strong {
        /// The incidence at which it returns most, rad.
        theta_rad: f64,
        /// By how much more than was sent, dB.
        excess_db: f64,
    },
    /// Its peak is narrower than the beam.
    Narrow {
        /// The incidence at which it has fallen to 1/e, rad.
        lobe_rad: f64,
    },
}

impl BeyondBeam {
    /// What a law has that no surface shows to a beam of a divergence δ, rad, above 0; none for laws without a tabulated
    /// curve.
    pub fn of(law: &Brdf, beam_rad: f64) -> Option<BeyondBeam> {
        if !law.has_curve() {
            return None;
        }
        let seen = Seen { law, beam_rad };
        let step_rad = beam_rad / f64::from(STEPS_PER_BEAM);
        let near = (0..STEPS_PER_BEAM * BEAMS).map(|step| f64::from(step) * step_rad);
        let angles = near.chain((0..=STEPS).map(|step| f64::from(step) * STEP_RAD));
        let levels = angles.map(|theta_rad| (theta_rad, seen.returned(theta_rad)));
        let (theta_rad, most) =
            levels.fold((0.0, 0.0), |most, level| if level.1 > most.1 { level } else { most });
        if most > 1.0 + SLACK {
            return Some(BeyondBeam::Strong { theta_rad, excess_db: db_from_ratio(most) });
        }
        let fallen = seen.returned(0.0) / std::f64::consts::E;
        let within = (1..STEPS_PER_BEAM).map(|step| f64::from(step) * step_rad);
        let mut within = within.take_while(|theta_rad| *theta_rad < NARROW * beam_rad);
        let lobe_rad = within.find(|theta_rad| seen.returned(*theta_rad) < fallen)?;
        Some(BeyondBeam::Narrow { lobe_rad })
    }

    /// As the end of a sentence about a law, for the same beam.
    pub fn words(&self, beam_rad: f64) -> String {
        let beam_deg = beam_rad.to_degrees();
        let what = match self {
            BeyondBeam::Strong { theta_rad, excess_db } => format!(
                "returns {excess_db:.1} dB more than a mirror at an incidence of {:.1}°, seen by a beam of {beam_deg:.2}°",
                theta_rad.to_degrees()
            ),
            BeyondBeam::Narrow { lobe_rad } => format!(
                "falls to 1/e within {:.2}°, less than the beam of {beam_deg:.2}° that sees it",
                lobe_rad.to_degrees()
            ),
        };
        format!("{what}; a curve is not widened, and a model that is fitted to it (`matdb fit`) is")
    }
}

/// A law as a beam sees it.
struct Seen<'a> {
    law: &'a Brdf,
    beam_rad: f64,
}

impl Seen<'_> {
    /// What the beam gets back at its focus of what it sent, 4π·δ²·f·cos θ.
    fn returned(&self, theta_rad: f64) -> f64 {
        let i = Direction::from_angles(theta_rad, 0.0);
        let f_per_sr = ThroughBeam { law: self.law, beam_rad: self.beam_rad }.f_per_sr(i, i);
        4.0 * PI * self.beam_rad * self.beam_rad * f_per_sr * i.cos_theta()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Fresnel, Lambert, Tabulated, VIEWING_RAD};
    use crate::units::ratio_from_db;

    fn curve(points_deg_db: &[(f64, f64)]) -> Brdf {
        let points = points_deg_db.iter().map(|(deg, db)| (deg.to_radians(), ratio_from_db(*db)));
        Brdf::Tabulated(Tabulated::new(&points.collect::<Vec<_>>()).unwrap())
    }

    #[test]
    fn a_curve_above_a_mirror_is_named_with_its_excess() {
        // 1/δ² is 38.64 dB.
        let law = curve(&[(0.0, 45.0), (0.3, 10.0), (60.0, -10.0)]);
        let Some(BeyondBeam::Strong { theta_rad, excess_db }) = BeyondBeam::of(&law, VIEWING_RAD)
        else {
            panic!("it is not named");
        };
        assert_eq!(theta_rad, 0.0);
        assert!((excess_db - 6.36).abs() < 0.01, "{excess_db}");
        // A wider beam has a lower mirror, and a narrower one, 50.5 dB, is only too wide for the peak.
        assert!(matches!(BeyondBeam::of(&law, 0.05), Some(BeyondBeam::Strong { .. })));
        assert_eq!(BeyondBeam::of(&law, 0.0005), None);
    }

    #[test]
    fn a_peak_narrower_than_the_beam_is_named_and_a_wide_one_is_not() {
        let narrow = curve(&[(0.0, 30.0), (0.3, 10.0), (60.0, -10.0)]);
        let found = BeyondBeam::of(&narrow, VIEWING_RAD);
        let Some(BeyondBeam::Narrow { lobe_rad }) = found else { panic!("{found:?}") };
        assert!(lobe_rad < 0.3f64.to_radians(), "{lobe_rad}");
        // What a mirror returns through the beam itself, and chalk.
        let mirror: Vec<(f64, f64)> = (0..60)
            .map(|step| {
                let theta_rad = 0.1 * f64::from(step) * VIEWING_RAD;
                let db = 38.6 - 4.343 * (theta_rad / VIEWING_RAD).powi(2);
                (theta_rad.to_degrees(), db)
            })
            .collect();
        assert_eq!(BeyondBeam::of(&curve(&mirror), VIEWING_RAD), None);
        assert_eq!(BeyondBeam::of(&curve(&[(0.0, 3.0), (60.0, -3.0)]), VIEWING_RAD), None);
    }

    #[test]
    fn models_are_convolved_and_never_named() {
        for law in [
            Brdf::Lambert(Lambert { albedo: 1.0 }),
            Brdf::Fresnel(Fresnel { eps_real: 1.0, eps_imag: 1e9, lobe_rad: None }),
        ] {
            assert_eq!(BeyondBeam::of(&law, VIEWING_RAD), None);
        }
    }
}
