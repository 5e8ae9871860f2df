//! Radar presets.

use super::chirp::ChirpEntry;
use super::mirror::Optics;
use super::polarisation::Polarisation;
use super::scan::pattern::Pattern;
use super::settings::{BeamEntry, Footprint, Radar, Returns, SpotDiameter};

/// Names of the presets.
pub const PRESETS: [&str; 1] = ["upm-300ghz"];

impl Default for Radar {
    fn default() -> Self {
        Radar {
            preset: PRESETS[0].to_owned(),
            centre_frequency_ghz: 300.0,
            bandwidth_ghz: 27.0,
            transmit_power_dbm: 7.0,
            aperture_m2: None,
            system_loss_db: 12.5,
            air_loss_db_per_m: 0.0,
            calibrated: false,
            threshold_dbm: -77.0,
            returns: Returns::default(),
            footprint: Footprint::Paper,
            spot_diameter_m: 0.016,
            spot_diameter_is: SpotDiameter::default(),
            reflector_centre_m: [0.0, 0.0, 8.0],
            secondary_focus_m: [0.0, 0.0, -8.0],
            tau_deg: 0.0,
            primary_focus_m: [0.0, 1.1, 8.0],
            alpha_deg: -90.0,
            position_m: None,
            look_at_m: None,
            up: None,
            chirp_period_s: 200e-6,
            chirp: ChirpEntry::default(),
            receiver: None,
            speckle: None,
            phases: false,
            noise: None,
            effect: Vec::new(),
            polarisation: Polarisation::default(),
            beam: BeamEntry::default(),
            optics: Optics::default(),
            f5: None,
            scan: Pattern::default(),
        }
    }
}
