//! Whether an instrument can exist: every constant against the range in which it has a meaning.

use super::beam::Beam;
use super::error::{RadarError, in_range};
use super::preset::PRESETS;
use super::settings::Radar;
use super::speckle::{Speckle, SpeckleForm};

impl Radar {
    /// Checks every constant against the range in which it has a meaning.
    pub fn validate(&self) -> Result<(), RadarError> {
        if !PRESETS.contains(&self.preset.as_str()) {
            return Err(RadarError::UnknownPreset { name: self.preset.clone(), presets: &PRESETS });
        }
        let [x_c, y_c, z_c] = self.reflector_centre_m;
        let [x_t, y_t, z_t] = self.secondary_focus_m;
        let [x_a, y_a, z_a] = self.primary_focus_m;
        let far_m = (-1e4, 1e4);
        let checks = [
            ("centre_frequency_ghz", self.centre_frequency_ghz, (1.0, 1e4)),
            ("bandwidth_ghz", self.bandwidth_ghz, (1e-3, 2.0 * self.centre_frequency_ghz)),
            ("transmit_power_dbm", self.transmit_power_dbm, (-100.0, 100.0)),
            ("aperture_m2", self.aperture_m2.unwrap_or(1.0), (1e-9, 1e6)),
            ("system_loss_db", self.system_loss_db, (-200.0, 200.0)),
            ("air_loss_db_per_m", self.air_loss_db_per_m, (0.0, 100.0)),
            ("threshold_dbm", self.threshold_dbm, (-300.0, 100.0)),
            ("spot_diameter_m", self.spot_diameter_m, (1e-5, 10.0)),
            ("reflector_centre_m[0]", x_c, far_m),
            ("reflector_centre_m[1]", y_c, far_m),
            ("reflector_centre_m[2]", z_c.abs(), (1e-3, 1e4)),
            ("secondary_focus_m[0]", x_t, far_m),
            ("secondary_focus_m[1]", y_t, far_m),
            ("secondary_focus_m[2]", z_t, far_m),
            ("primary_focus_m[0]", x_a, far_m),
            ("primary_focus_m[1]", y_a, far_m),
            ("primary_focus_m[2]", z_a, far_m),
            ("tau_deg", self.tau_deg, (-180.0, 180.0)),
            ("alpha_deg", self.alpha_deg, (-360.0, 360.0)),
            ("chirp_period_s", self.chirp_period_s, (1e-9, 3600.0)),
        ];
        self.validate_place()?;
        let parts = self.beam.checks().into_iter().chain(self.optics.checks());
        let parts = parts.chain(self.polarisation.checks());
        let parts = parts.chain(self.scan.checks());
        checks.into_iter().chain(parts).try_for_each(in_range)?;
        self.validate_beam()?;
        self.validate_receiver()?;
        self.f5.as_ref().map_or(Ok(()), |f5| Ok(f5.validate()?))
    }

    /// A beam has to be wider than its wave, and to be focused in front of its reflector.
    fn validate_beam(&self) -> Result<(), RadarError> {
        let (waist_m, wavelength_m) = (self.waist_m(), self.wavelength_m());
        if waist_m < wavelength_m {
            // Rounded up to what the message shows.
            let least_m = (1e6 * self.spot_diameter_m * wavelength_m / waist_m).ceil() / 1e6;
            return Err(RadarError::NarrowBeam {
                diameter_m: self.spot_diameter_m,
                waist_m,
                wavelength_m,
                least_m,
            });
        }
        let focus_m = self.beam.focus_m;
        let reflector_m = Beam::new(self).towards(0.0, 0.0).section(0.0).radius_m;
        if focus_m < reflector_m {
            return Err(RadarError::FocusInReflector { focus_m, reflector_m });
        }
        Ok(())
    }

    /// One look of one field has a phase, and an average of several has none.
    fn validate_phases(&self) -> Result<(), RadarError> {
        match self.speckle {
            Some(Speckle { looks, .. }) if self.phases && looks != 1.0 => {
                Err(RadarError::PhaseOfLooks { looks })
            }
            Some(Speckle { form: Some(SpeckleForm::Independent), .. }) if self.phases => {
                Err(RadarError::PhaseOfDraws)
            }
            _ => Ok(()),
        }
    }

    fn validate_receiver(&self) -> Result<(), RadarError> {
        self.chirp().validate()?;
        if let Some(receiver) = self.receiver {
            receiver.validate()?;
            let far_m = receiver.gate_m.map_or(0.0, |[_, far_m]| far_m);
            in_range(("receiver.gate_m[1]", far_m, (0.0, self.chirp().max_range_m())))?;
            let leakage_m = receiver.leakage.map_or(0.0, |leakage| leakage.range_m);
            let max_range_m = self.chirp().max_range_m();
            in_range(("receiver.leakage.range_m", leakage_m, (0.0, max_range_m)))?;
            in_range(("chirp.duration_s", self.chirp.duration_s, (1e-9, self.chirp_period_s)))?;
        }
        self.speckle.map_or(Ok(()), |speckle| speckle.validate())?;
        self.noise.map_or(Ok(()), |noise| noise.validate())?;
        if self.receiver.is_some() && self.noise.is_some() {
            return Err(RadarError::NoiseTwice);
        }
        match (self.receiver, self.speckle) {
            (Some(_), Some(Speckle { looks, .. })) if looks.fract() != 0.0 || looks > 1e4 => {
                return Err(RadarError::PartialLook { looks });
            }
            _ => {}
        }
        self.validate_phases()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::BeamEntry;

    #[test]
    fn a_constant_without_meaning_is_named() {
        let radar = Radar { spot_diameter_m: -1.0, ..Default::default() };
        assert!(radar.validate().unwrap_err().to_string().contains("spot_diameter_m = -1"));
        let radar = Radar { alpha_deg: f64::NAN, ..Default::default() };
        assert!(radar.validate().is_err());
        let radar = Radar { aperture_m2: Some(0.0), ..Default::default() };
        assert!(radar.validate().unwrap_err().to_string().contains("aperture_m2 = 0"));
        for (air_loss_db_per_m, is_valid) in
            [(0.0, true), (100.0, true), (-0.001, false), (100.1, false), (f64::NAN, false)]
        {
            let radar = Radar { air_loss_db_per_m, ..Default::default() };
            assert_eq!(radar.validate().is_ok(), is_valid, "{air_loss_db_per_m}");
        }
        let radar = Radar { preset: "upm".into(), ..Default::default() };
        assert!(radar.validate().unwrap_err().to_string().contains("upm-300ghz"));
    }

    #[test]
    fn a_beam_that_cannot_be_is_refused() {
        let narrow = Radar { spot_diameter_m: 0.001, ..Default::default() };
        let error = narrow.validate().unwrap_err().to_string();
        assert!(
            error.contains("spot_diameter_m = 0.001") && error.contains("0.001177 m"),
            "{error}"
        );
        let near = BeamEntry { focus_m: 0.012, ..Default::default() };
        let near = Radar { beam: near, ..Default::default() };
        let error = near.validate().unwrap_err().to_string();
        assert!(error.contains("beam.focus_m = 0.012"), "{error}");
        let wide = Radar { spot_diameter_m: 0.001177, ..Default::default() };
        wide.validate().unwrap();
    }
}
