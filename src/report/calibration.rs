//! What the cloud of a calibration target says of a radar: its loss, its spot and its divergence, beside the scene's.

use std::f64::consts::PI;
use std::path::Path;

use serde_json::{Value, json};

use crate::brdf::{Brdf, Scattering, ScatteringModel};
use crate::error::Error;
use crate::formats::words::listed;
use crate::frames::Direction;
use crate::measure::{Calibration, CalibrationResult, Cloud, Estimate};
use crate::radar::{Beam, Radar};
use crate::scene::{ReferenceShape, ReferenceTarget};
use crate::setup::ReadyScene;

/// A calibration of a scene's radar.
pub struct CalibrationReport<'a> {
    radar: &'a Radar,
    /// The target.
    pub target: ReferenceTarget,
    /// Share of the power that its metal reflects, 0 to 1.
    pub reflectance: f64,
    /// Points of the cloud.
    pub points: usize,
    /// What was found.
    pub result: CalibrationResult,
    /// Effects that the scene declares, which the returns of targets do without.
    pub effects: Vec<String>,
}

/// A difference of the beam below this share is not worth a change, whatever its significance.
const LEAST_DIFFERENCE: f64 = 0.01;

impl<'a> CalibrationReport<'a> {
    /// Calibrates the radar of a scene by a cloud of its target; `file` names the cloud in errors.
    ///
    /// # Errors
    /// A scene without a calibration target or with a rough one, a cloud that does not show it.
    pub fn new(
        ready: &'a ReadyScene,
        cloud: &Cloud,
        file: &Path,
        calibration: Calibration,
    ) -> Result<CalibrationReport<'a>, Error> {
        let scene = &ready.scene;
        let target = scene.reference_target(&ready.path)?;
        let material = ready.material_of_region[usize::from(target.region)];
        let material = &ready.materials[usize::from(material)];
        if !(material.scattering.is_smooth() && material.scattering.has_smooth_mirror()) {
            return Err(Error::usage(
                format!("{}: `{}` is not a smooth mirror", ready.path.display(), material.name),
                "give the calibration target a smooth metal, such as `steel`",
            ));
        }
        let one = reflectance(&material.scattering);
        // A corner reflects three times; a metal does so at 55° as at 0°, within 0.01 dB.
        let reflectance = match target.shape {
            ReferenceShape::Corner { .. } => one.powi(3),
            _ => one,
        };
        let radar = scene.radar();
        let result = calibration
            .run(&target.shape, reflectance, radar, &scene.chirps, cloud)
            .map_err(|error| Error::Calibration { file: file.to_owned(), error })?;
        let entries = radar.effect.iter().chain(&scene.file.effect);
        let effects = entries.map(|entry| entry.name.clone()).collect();
        let points = cloud.points().len();
        Ok(CalibrationReport { radar, target, reflectance, points, result, effects })
    }

    /// The spot's diameter in the scene's own convention, m.
    pub fn spot_diameter_m(&self) -> Estimate {
        self.result.waist_ratio.times(self.radar.spot_diameter_m)
    }

    /// Divergence δ₀ of the beam, rad.
    pub fn divergence_rad(&self) -> Estimate {
        let Estimate { value, sd, interval_95: [low, high] } = self.result.waist_ratio;
        let scene_rad = self.scene_divergence_rad();
        Estimate {
            value: scene_rad / value,
            sd: scene_rad * sd / (value * value),
            interval_95: [scene_rad / high, scene_rad / low],
        }
    }

    /// Divergence of the scene's beam at the centre of the field of view, rad.
    pub fn scene_divergence_rad(&self) -> f64 {
        Beam::new(self.radar).towards(0.0, 0.0).divergence_rad()
    }

    /// Whether the cloud shows the divergence, as that of a plate does; others show the spot. Each follows from the
    /// other, for a beam of one Gaussian mode.
    pub fn shows_divergence(&self) -> bool {
        matches!(self.target.shape, ReferenceShape::Plate { .. })
    }

    /// Whether the scene's beam is the one that the cloud shows.
    pub fn is_beam_right(&self) -> bool {
        let Estimate { value, interval_95: [low, high], .. } = self.result.waist_ratio;
        (low..=high).contains(&1.0) || (value - 1.0).abs() < LEAST_DIFFERENCE
    }

    /// Sentences about what a person should not overlook.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        if !self.is_beam_right() {
            notices.push(format!(
                "the cloud shows another beam than the scene: give it radar.spot_diameter_m = {:.5} as well; the loss was \
                 found with that beam",
                self.spot_diameter_m().value
            ));
        }
        if !self.effects.is_empty() {
            notices.push(format!(
                "the scene declares {}, which a calibration leaves out: what it changes is in the loss and the beam",
                listed(&self.effects)
            ));
        }
        notices
    }

    /// The calibration for scripts.
    pub fn record(&self, cloud: &Path, scene: &Path, notices: &[String]) -> Value {
        let CalibrationResult { system_loss_db, off, range_m, within_db, used, rms_db, .. } =
            self.result;
        let place = match self.target.shape {
            ReferenceShape::Plate { .. } => json!({ "tilt_rad": off[0].hypot(off[1]) }),
            _ => json!({ "aside_m": off[0].hypot(off[1]) }),
        };
        json!({
            "schema": 1,
            "cloud": cloud.display().to_string(),
            "scene": scene.display().to_string(),
            "target": {
                "kind": self.target.shape.name(),
                "mesh": self.target.name,
                "reflectance": self.reflectance,
                "range_m": range_m,
                "off": place,
            },
            "system_loss_db": beside(&system_loss_db, self.radar.system_loss_db),
            "spot_diameter_m": beside(&self.spot_diameter_m(), self.radar.spot_diameter_m),
            "divergence_rad": beside(&self.divergence_rad(), self.scene_divergence_rad()),
            "shown": if self.shows_divergence() { "divergence" } else { "spot" },
            "beam_agrees": self.is_beam_right(),
            "points": { "all": self.points, "used": used, "within_db": within_db },
            "rms_db": rms_db,
            "notices": notices,
        })
    }

    /// The calibration for a person.
    pub fn text(&self) -> String {
        let CalibrationResult { system_loss_db, range_m, within_db, used, rms_db, .. } =
            self.result;
        let (spot, divergence) = (self.spot_diameter_m(), self.divergence_rad());
        let [of_spot, of_divergence] = if self.shows_divergence() {
            ["follows from it", "seen"]
        } else {
            ["seen", "follows from it"]
        };
        format!(
            "{} `{}` at {range_m:.3} m: {used} points within {within_db:.0} dB of the peak, residuals {rms_db:.2} dB rms\n\
             system_loss_db   {:.3} ± {:.3} dB; the scene has {}\n\
             spot diameter    {:.3} ± {:.3} mm; the scene has {:.3} ({of_spot})\n\
             divergence       {:.3} ± {:.3} mrad; the scene has {:.3} ({of_divergence})\n",
            self.target.shape.name(),
            self.target.name,
            system_loss_db.value,
            rounded_up(system_loss_db.sd),
            self.radar.system_loss_db,
            1e3 * spot.value,
            rounded_up(1e3 * spot.sd),
            1e3 * self.radar.spot_diameter_m,
            1e3 * divergence.value,
            rounded_up(1e3 * divergence.sd),
            1e3 * self.scene_divergence_rad(),
        )
    }
}

/// A deviation to three decimals, never 0.000: what a model leaves out is as large.
fn rounded_up(sd: f64) -> f64 {
    1e-3 * (1e3 * sd).ceil()
}

/// An estimate beside what the scene has.
fn beside(found: &Estimate, scene: f64) -> Value {
    json!({ "value": found.value, "sd": found.sd, "interval_95": found.interval_95, "scene": scene })
}

/// Share that a smooth surface reflects at normal incidence, 0 to 1.
fn reflectance(law: &Brdf) -> f64 {
    // Far wider than any lobe: f = R/(4π·δ²).
    const WIDE_RAD: f64 = 10.0;
    let normal = Direction::from_angles(0.0, 0.0);
    4.0 * PI * WIDE_RAD * WIDE_RAD * law.seen_by(WIDE_RAD, normal, normal).f_per_sr
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Fresnel;

    #[test]
    fn the_reflectance_does_not_depend_on_the_lobe() {
        for lobe_rad in [None, Some(0.02), Some(0.5)] {
            let metal = Fresnel { eps_real: 1.0, eps_imag: 83_884.0, lobe_rad };
            let found = reflectance(&Brdf::Fresnel(metal));
            assert!((found / metal.reflectance(0.0) - 1.0).abs() < 0.003, "{lobe_rad:?}: {found}");
        }
    }
}
