//! Every constant of an instrument in one record, as scene files write it.
//!
//! Decibels, degrees and gigahertz stay here, at the edge; [`Link`](super::Link), [`Chirp`] and
//! [`RadarFrames`](super::RadarFrames) hold the same numbers in SI. Every field of a preset can be
//! overridden in a scene's `[radar]` table.
//!
//! The marks in the field docs: **paper** is Ortiz-Jiménez et al., IEEE T-THz Sci. Technol. 2017
//! (DOI 10.1109/TTHZ.2017.2702590); **assumed** is a value that no publication gives and that we chose.

use std::f64::consts::LN_2;

use serde::{Deserialize, Serialize};

use super::chirp::{Chirp, ChirpEntry};
use super::error::Check;
use super::f5::F5;
use super::mirror::Optics;
use super::noise::{Addition, Noise};
use super::polarisation::Polarisation;
use super::receiver::Receiver;
use super::scan::pattern::{self, Pattern};
use super::speckle::{Speckle, SpeckleForm};
use super::window::Window;
use crate::formats::EffectEntry;
use crate::units::watts_from_dbm;

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
    /// Equivalent area of the receiving antenna A_eq, m², in place of the beam's own λ²R²/(πw²), which
    /// is 0.110 m² at 8 m. None: the antenna receives by the beam that it sends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_m2: Option<f64>,
    /// Two-way losses and calibration, dB. 12.5: assumed, so that a painted mannequin's specular peak
    /// lands where the paper's figure 9 has it.
    pub system_loss_db: f64,
    /// Loss of the air, dB per metre of a path, there and back. 0: none.
    #[serde(skip_serializing_if = "is_zero")]
    pub air_loss_db_per_m: f64,
    /// Whether `system_loss_db` was measured, so that a diagnosis takes the level of the radar as it is. false: a
    /// diagnosis finds how far the level is off.
    #[serde(skip_serializing_if = "is_off")]
    pub calibrated: bool,
    /// Detections below this power are discarded, dBm. −77: paper, Sec. V-C.
    pub threshold_dbm: f64,
    /// Which echoes of a chirp are reported where several part in range. `strongest`: paper, one point per chirp.
    #[serde(skip_serializing_if = "Returns::is_strongest")]
    pub returns: Returns,
    /// How a tilted surface spreads the spot. `paper`: equation (11).
    pub footprint: Footprint,
    /// Diameter of the spot at the centre of the field of view, m. 0.016: paper, Sec. II-B.
    pub spot_diameter_m: f64,
    /// Which width of the beam that is. `one-way-fwhm`: assumed.
    pub spot_diameter_is: SpotDiameter,
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
    /// Where the rays start, m, in the global frame: together with `look_at_m` in place of the five keys before, for a
    /// radar without the paper's frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 3]>,
    /// The middle of the target plane, m, in the global frame; patterns have their sizes there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look_at_m: Option<[f64; 3]>,
    /// Which way is up in the image; of any length. (0, 1, 0) beside a `position_m`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Time from one chirp to the next, s. 200e-6: assumed; a scan of 18 529 chirps takes 3.7 s.
    pub chirp_period_s: f64,
    /// How a sweep is sampled; of use with a receiver.
    pub chirp: ChirpEntry,
    /// From the beat signal to a range and a power. None, the paper's: both are exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receiver: Option<Receiver>,
    /// What the antennas send and receive.
    pub polarisation: Polarisation,
    /// Speckle of the echoes. None, the paper's: there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speckle: Option<Speckle>,
    /// Whether the phase of each echo is reported, too: a column of the cloud and two channels of the image. The paper
    /// does not use it.
    #[serde(skip_serializing_if = "is_off")]
    pub phases: bool,
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
    #[serde(deserialize_with = "pattern::read")]
    pub scan: Pattern,
}

/// Which echoes of a chirp a receiver reports, where several part in range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Returns {
    /// The strongest.
    #[default]
    Strongest,
    /// The nearest at or above the threshold.
    First,
    /// Every one.
    All,
}

/// What serde leaves out.
fn is_off(on: &bool) -> bool {
    !*on
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

impl Returns {
    fn is_strongest(&self) -> bool {
        *self == Returns::Strongest
    }
}

/// How a tilted surface spreads the spot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Footprint {
    /// Equation (11) as the paper has it, with cos²θ.
    #[default]
    Paper,
    /// The lit area grows as 1/cos θ, which leaves cos θ once.
    Projected,
}

impl Footprint {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Footprint::Paper => "paper",
            Footprint::Projected => "projected",
        }
    }

    /// Factor on a σ⁰ that was reduced in this form to what another form makes of the same power. The paper's takes
    /// the power for f·cos²θ and the projected for f·cos θ, so that σ⁰ = 4π·f·cos²θ differs by cos θ.
    pub fn factor_to(self, other: Footprint, cos_theta: f64) -> f64 {
        match (self, other) {
            (Footprint::Paper, Footprint::Projected) => cos_theta,
            (Footprint::Projected, Footprint::Paper) => 1.0 / cos_theta,
            _ => 1.0,
        }
    }
}

/// How the spot grows, as scene files write it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BeamEntry {
    /// Range at which the beam is focused, m. 8: paper.
    pub focus_m: f64,
    /// Waist at `edge_m` from the centre of the field of view over the one at the centre. 1.5: assumed.
    pub edge_growth: f64,
    /// Distance from the centre at which it has grown so, m. 0.5: assumed, about the corner of the
    /// paper's field of view.
    pub edge_m: f64,
}

impl Default for BeamEntry {
    fn default() -> Self {
        BeamEntry { focus_m: 8.0, edge_growth: 1.5, edge_m: 0.5 }
    }
}

impl BeamEntry {
    pub(super) fn checks(&self) -> Vec<Check> {
        vec![
            ("beam.focus_m", self.focus_m, (1e-3, 1e4)),
            ("beam.edge_growth", self.edge_growth, (0.1, 100.0)),
            ("beam.edge_m", self.edge_m, (1e-3, 1e3)),
        ]
    }
}

/// Which width of the beam at its focus a stated diameter is. The paper does not say which its 1.6 cm is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpotDiameter {
    /// Full width at half maximum of the irradiance, one way: w₀ = D/√(2·ln 2).
    #[default]
    #[serde(rename = "one-way-fwhm")]
    OneWayFwhm,
    /// Full width at half maximum of the two-way weight u²: w₀ = D/√(ln 2).
    #[serde(rename = "two-way-fwhm")]
    TwoWayFwhm,
    /// Diameter on which the irradiance is 1/e² of that on the axis: w₀ = D/2.
    #[serde(rename = "1/e2")]
    InverseE2,
}

impl SpotDiameter {
    /// Waist radius w₀ over the diameter D.
    pub(super) fn waist_per_diameter(self) -> f64 {
        match self {
            SpotDiameter::OneWayFwhm => 1.0 / (2.0 * LN_2).sqrt(),
            SpotDiameter::TwoWayFwhm => 1.0 / LN_2.sqrt(),
            SpotDiameter::InverseE2 => 0.5,
        }
    }
}

impl Radar {
    /// The window before the Fourier transform: the receiver's, or Hann's.
    pub fn window(&self) -> Window {
        self.receiver.map_or(Window::Hann, |receiver| receiver.window)
    }

    /// Distance in range at which two echoes part, m: the peak of one lies on the first zero of the other. It is 11.1 mm
    /// for 27 GHz and Hann's window.
    pub fn range_cell_m(&self) -> f64 {
        self.window().first_zero_bins() * self.chirp().range_resolution_m()
    }

    /// Mean noise power in the cell of an echo by `[radar.noise]`, W; 0 without it.
    pub fn noise_w(&self) -> f64 {
        let looks = self.speckle.map_or(1.0, |speckle| speckle.looks);
        let (threshold_w, cell_m) =
            (watts_from_dbm(self.threshold_dbm), self.chirp().range_resolution_m());
        self.noise.map_or(0.0, |noise| noise.level_w(threshold_w, cell_m, looks))
    }

    /// Range cells of the gate, where `[radar.noise]` states its cells or its length.
    pub fn gate_cells(&self) -> Option<f64> {
        let noise = self.noise?;
        let by_length = noise.gate_length_m.map(|m| m / self.chirp().range_resolution_m());
        noise.gate_cells.or(by_length).map(|cells| cells.max(1.0))
    }

    /// Looks of a cell with noise alone: those of the speckle, as of a range receiver, or one where noise joins their
    /// average or there is no speckle.
    pub fn noise_looks(&self) -> f64 {
        match (self.noise, self.speckle) {
            (_, Some(speckle)) if self.receiver.is_some() => speckle.looks,
            (Some(Noise { added: Addition::BeforeLooks, .. }), Some(speckle)) => speckle.looks,
            _ => 1.0,
        }
    }

    /// The form of its speckle, for a scan that several antennas see or not, with several paths per chirp or not.
    pub fn speckle_form(&self, several_antennas: bool, several_paths: bool) -> SpeckleForm {
        let has_beats = self.receiver.is_some() && several_paths;
        let usual = if self.phases || several_antennas || has_beats {
            SpeckleForm::Scatterers
        } else {
            SpeckleForm::Law
        };
        self.speckle.and_then(|speckle| speckle.form).unwrap_or(usual)
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
}
