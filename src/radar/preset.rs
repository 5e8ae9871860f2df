//! Radar presets: every constant of an instrument in one record, as scene files write it.
//!
//! Decibels, degrees and gigahertz stay here, at the edge; [`Link`](super::Link) and
//! [`RadarFrames`] hold the same numbers in SI. Every field of a preset can be overridden in a
//! scene's `[radar]` table.
//!
//! The marks in the field docs: **paper** is Ortiz-Jiménez et al., IEEE T-THz Sci. Technol. 2017
//! (DOI 10.1109/TTHZ.2017.2702590); **assumed** is a value that no publication gives and that we chose.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::beam::BeamEntry;
use super::f5::{F5, F5Error};
use super::mirror::Optics;
use super::{Chirp, ChirpEntry, Footprint, Noise, Pattern, Receiver, Speckle};
use crate::formats::{EffectEntry, FormatError};
use crate::frames::{
    Antenna, Global, Point, Pose, Target, antenna_from_target, global_from_antenna,
};
use crate::units::shown;

/// Names of the presets.
pub const PRESETS: [&str; 1] = ["upm-300ghz"];

/// An instrument. The default is `upm-300ghz`, the imaging radar of the Universidad Politécnica de
/// Madrid that the paper describes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Radar {
    /// The preset that fills the fields that are not given.
    pub preset: String,
    /// Centre frequency, GHz. 300: paper.
    pub centre_frequency_ghz: f64,
    /// Swept bandwidth, GHz. 27: table in Liang et al. 2022, DOI 10.11972/j.issn.1001-9014.2022.02.011.
    pub bandwidth_ghz: f64,
    /// Transmitted power P_t, dBm. 7: assumed.
    pub transmit_power_dbm: f64,
    /// Equivalent area of the receiving antenna A_eq, m². 0.196: assumed, a 0.5 m aperture, which
    /// is λR over the paper's spot diameter.
    pub aperture_m2: f64,
    /// Two-way losses and calibration, dB. 15: assumed, so that a painted mannequin's specular peak
    /// lands where the paper's figure 9 has it.
    pub system_loss_db: f64,
    /// Detections below this power are discarded, dBm. −77: paper, Sec. V-C.
    pub threshold_dbm: f64,
    /// How a tilted surface spreads the spot. `paper`: equation (11).
    pub footprint: Footprint,
    /// Diameter of the spot at the centre of the field of view, m. 0.016: paper, Sec. II-B.
    pub spot_diameter_m: f64,
    /// O_c: centre of the main reflector in the target frame, m. (0, 0, 8): assumed to coincide
    /// with the primary focus, 8 m (paper) in front of the target plane.
    pub reflector_centre_m: [f64; 3],
    /// O_t: secondary focus in the antenna frame, m. (0, 0, −8): 8 m is the paper's stand-off; the
    /// direction is assumed.
    pub secondary_focus_m: [f64; 3],
    /// τ: rotation of the target plane against the focal plane, degrees. 0: assumed; τ and α add
    /// up to one yaw, so that no cloud in the global frame can tell them apart.
    pub tau_deg: f64,
    /// O_a: primary focus in the global frame, m. (0, 1.1, 8): assumed; targets stand at the
    /// origin, and 1.1 m is the height of the paper's line scan.
    pub primary_focus_m: [f64; 3],
    /// α: yaw of the antenna on the table, degrees. −90: assumed; antenna and global axes are then
    /// parallel, and the radar looks along −z.
    pub alpha_deg: f64,
    /// Time from one chirp to the next, s. 200e-6: assumed; a scan of 18 529 chirps takes 3.7 s.
    pub chirp_period_s: f64,
    /// How a sweep is sampled; of use with a receiver.
    pub chirp: ChirpEntry,
    /// From the beat signal to a range and a power. None, the paper's: both are exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receiver: Option<Receiver>,
    /// Speckle of the echoes. None, the paper's: there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speckle: Option<Speckle>,
    /// Thermal noise and range error without a beat signal; a receiver has its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Physical effects of the instrument, each once. None, the paper's.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<EffectEntry>,
    /// How the spot grows away from the centre and the focus.
    pub beam: BeamEntry,
    /// The scanning mirror and the reflectors behind it.
    pub optics: Optics,
    /// Own coefficients of equation (1), in place of those fitted to `optics`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f5: Option<F5>,
    /// Where the rays go.
    #[serde(deserialize_with = "super::scan::read_pattern")]
    pub scan: Pattern,
}

/// Why a radar cannot exist.
#[derive(Debug, Error, PartialEq)]
pub enum RadarError {
    /// No such preset.
    #[error("there is no radar preset `{name}`; the presets are: {}", PRESETS.join(", "))]
    UnknownPreset {
        /// The name that was asked for.
        name: String,
    },
    /// A constant without a physical meaning.
    #[error("radar.{name} = {} is out of range; give a value from {} to {}", shown(*value), shown(*min), shown(*max))]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest accepted value.
        min: f64,
        /// Largest accepted value.
        max: f64,
    },
    /// Noise by its law and by a receiver.
    #[error(
        "[radar.noise] and [radar.receiver] both bring thermal noise; remove [radar.noise], the \
         receiver's is set by radar.receiver.noise_figure_db"
    )]
    NoiseTwice,
    /// A receiver adds up whole looks.
    #[error(
        "radar.speckle.looks = {looks} cannot be made of beat signals; give a whole number from 1 \
         to 10 000, or remove [radar.receiver]"
    )]
    PartialLook {
        /// The looks asked for.
        looks: f64,
    },
    /// Equation (1) cannot be had.
    #[error(transparent)]
    F5(#[from] F5Error),
    /// The file of an explicit scan cannot be read.
    #[error("cannot read the scan {file}: {reason}; it is looked for beside the scene file")]
    Unreadable {
        /// The file, as the scene gives it.
        file: String,
        /// Why.
        reason: String,
    },
    /// The file of an explicit scan does not follow its format.
    #[error("{file}: {error}")]
    Explicit {
        /// The file, as the scene gives it.
        file: String,
        /// What is wrong.
        error: FormatError,
    },
    /// Equation (2) has no real root for a chirp.
    #[error(
        "chirp {chirp} would look at ({xt_m}, {yt_m}) m in the target plane, beyond the reach of a \
         range of {range_m} m; shrink the scan or move radar.reflector_centre_m back"
    )]
    OutOfReach {
        /// Chirp number, from 0.
        chirp: usize,
        /// x in the target plane, m.
        xt_m: f64,
        /// y in the target plane, m.
        yt_m: f64,
        /// Range at which the pattern is drawn, m.
        range_m: f64,
    },
}

/// The instrument's frames, placed in the global one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarFrames {
    /// Equation (4) after equation (3).
    pub global_from_target: Pose<Global, Target>,
    /// O_c in the target frame.
    pub reflector_centre: Point<Target>,
}

impl Default for Radar {
    fn default() -> Self {
        Radar {
            preset: PRESETS[0].to_owned(),
            centre_frequency_ghz: 300.0,
            bandwidth_ghz: 27.0,
            transmit_power_dbm: 7.0,
            aperture_m2: 0.196,
            system_loss_db: 15.0,
            threshold_dbm: -77.0,
            footprint: Footprint::Paper,
            spot_diameter_m: 0.016,
            reflector_centre_m: [0.0, 0.0, 8.0],
            secondary_focus_m: [0.0, 0.0, -8.0],
            tau_deg: 0.0,
            primary_focus_m: [0.0, 1.1, 8.0],
            alpha_deg: -90.0,
            chirp_period_s: 200e-6,
            chirp: ChirpEntry::default(),
            receiver: None,
            speckle: None,
            noise: None,
            effect: Vec::new(),
            beam: BeamEntry::default(),
            optics: Optics::default(),
            f5: None,
            scan: Pattern::default(),
        }
    }
}

impl Radar {
    /// Checks every constant against the range in which it has a meaning.
    pub fn validate(&self) -> Result<(), RadarError> {
        if !PRESETS.contains(&self.preset.as_str()) {
            return Err(RadarError::UnknownPreset { name: self.preset.clone() });
        }
        let [x_c, y_c, z_c] = self.reflector_centre_m;
        let [x_t, y_t, z_t] = self.secondary_focus_m;
        let [x_a, y_a, z_a] = self.primary_focus_m;
        let far_m = (-1e4, 1e4);
        let checks = [
            ("centre_frequency_ghz", self.centre_frequency_ghz, (1.0, 1e4)),
            ("bandwidth_ghz", self.bandwidth_ghz, (1e-3, 2.0 * self.centre_frequency_ghz)),
            ("transmit_power_dbm", self.transmit_power_dbm, (-100.0, 100.0)),
            ("aperture_m2", self.aperture_m2, (1e-9, 1e6)),
            ("system_loss_db", self.system_loss_db, (-200.0, 200.0)),
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
        let parts = self.beam.checks().into_iter().chain(self.optics.checks());
        let parts = parts.chain(self.scan.checks());
        checks.into_iter().chain(parts).try_for_each(in_range)?;
        self.validate_receiver()?;
        self.f5.as_ref().map_or(Ok(()), |f5| Ok(f5.validate()?))
    }

    fn validate_receiver(&self) -> Result<(), RadarError> {
        self.chirp().validate()?;
        if let Some(receiver) = self.receiver {
            receiver.validate()?;
            let far_m = receiver.gate_m.map_or(0.0, |[_, far_m]| far_m);
            in_range(("receiver.gate_m[1]", far_m, (0.0, self.chirp().max_range_m())))?;
            in_range(("chirp.duration_s", self.chirp.duration_s, (1e-9, self.chirp_period_s)))?;
        }
        self.speckle.map_or(Ok(()), |speckle| speckle.validate())?;
        self.noise.map_or(Ok(()), |noise| noise.validate())?;
        if self.receiver.is_some() && self.noise.is_some() {
            return Err(RadarError::NoiseTwice);
        }
        match (self.receiver, self.speckle) {
            (Some(_), Some(Speckle { looks, .. })) if looks.fract() != 0.0 || looks > 1e4 => {
                Err(RadarError::PartialLook { looks })
            }
            _ => Ok(()),
        }
    }

    /// The sweep, in SI.
    pub fn chirp(&self) -> Chirp {
        Chirp {
            centre_frequency_hz: self.centre_frequency_ghz * 1e9,
            bandwidth_hz: self.bandwidth_ghz * 1e9,
            duration_s: self.chirp.duration_s,
            samples: self.chirp.samples,
            start_phase_rad: 0.0,
        }
    }

    /// The typed poses of equations (3) and (4).
    pub fn frames(&self) -> RadarFrames {
        let point = glam::DVec3::from_array;
        RadarFrames {
            global_from_target: global_from_antenna(
                self.alpha_deg.to_radians(),
                Point::from(point(self.primary_focus_m)),
            ) * antenna_from_target(
                self.tau_deg.to_radians(),
                Point::<Antenna>::from(point(self.secondary_focus_m)),
            ),
            reflector_centre: Point::from(point(self.reflector_centre_m)),
        }
    }
}

impl RadarFrames {
    /// O_c in the global frame: where every ray starts and every range is measured from.
    pub fn origin(&self) -> Point<Global> {
        self.global_from_target * self.reflector_centre
    }
}

/// A named constant with its value and its smallest and largest accepted value.
pub(super) type Check = (&'static str, f64, (f64, f64));

pub(super) fn in_range((name, value, (min, max)): Check) -> Result<(), RadarError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(RadarError::OutOfRange { name, value, min, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_stands_eight_metres_in_front_of_the_target() {
        let radar = Radar::default();
        radar.validate().unwrap();
        let frames = radar.frames();
        assert!(frames.origin().distance_m(Point::new(0.0, 1.1, 8.0)) < 1e-12);
        let focus = frames.global_from_target * Point::new(0.0, 0.0, 0.0);
        assert!(focus.distance_m(Point::new(0.0, 1.1, 0.0)) < 1e-12);
    }

    #[test]
    fn a_constant_without_meaning_is_named() {
        let radar = Radar { spot_diameter_m: -1.0, ..Default::default() };
        assert!(radar.validate().unwrap_err().to_string().contains("spot_diameter_m = -1"));
        let radar = Radar { alpha_deg: f64::NAN, ..Default::default() };
        assert!(radar.validate().is_err());
        let radar = Radar { preset: "upm".into(), ..Default::default() };
        assert!(radar.validate().unwrap_err().to_string().contains("upm-300ghz"));
    }
}
