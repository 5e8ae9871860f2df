//! Why an instrument cannot exist, and the check of a constant against its range.

use thiserror::Error;

use crate::formats::FormatError;
use crate::units::shown;

/// Why a radar cannot exist.
#[derive(Debug, Error, PartialEq)]
pub enum RadarError {
    /// No such preset.
    #[error("there is no radar preset `{name}`; the presets are: {}", presets.join(", "))]
    UnknownPreset {
        /// The name that was asked for.
        name: String,
        /// Names of all presets.
        presets: &'static [&'static str],
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
    /// A beam as narrow as its wave is long is no beam.
    #[error(
        "radar.spot_diameter_m = {diameter_m} gives the beam a waist radius of {:.3} mm, less than the wavelength \
         of {:.3} mm; give a diameter of {:.6} m or more",
        1e3 * waist_m, 1e3 * wavelength_m, least_m
    )]
    NarrowBeam {
        /// The spot's diameter, m.
        diameter_m: f64,
        /// The beam's waist radius, m.
        waist_m: f64,
        /// The wavelength, m.
        wavelength_m: f64,
        /// Least possible diameter, m.
        least_m: f64,
    },
    /// The focus lies in the reflector.
    #[error(
        "radar.beam.focus_m = {focus_m} lies inside the reflector, where the beam has a radius of {reflector_m:.3} m; \
         give a longer distance"
    )]
    FocusInReflector {
        /// Distance of the focus from the reflector, m.
        focus_m: f64,
        /// The beam's radius at the reflector, m.
        reflector_m: f64,
    },
    /// Noise by its law and by a receiver.
    #[error(
        "[radar.noise] and [radar.receiver] both bring thermal noise; remove [radar.noise], the \
         receiver's is set by radar.receiver.noise_figure_db"
    )]
    NoiseTwice,
    /// A level of noise beside what a level follows from.
    #[error(
        "[radar.noise] has level_dbm and {key}, and each says how strong the noise is; remove one: without level_dbm the \
         level follows from radar.threshold_dbm"
    )]
    NoiseLevelTwice {
        /// The other key.
        key: &'static str,
    },
    /// A gate by its cells and by its length.
    #[error(
        "[radar.noise] has gate_cells and gate_length_m, and both say how long the gate is; remove one"
    )]
    GateTwice,
    /// Looks that are fields of their own are whole numbers.
    #[error(
        "radar.speckle.looks = {looks} is no number of fields; give a whole number from 1 to {most}, or \
         form = \"independent\", whose looks need not be whole"
    )]
    PartOfAField {
        /// The looks asked for.
        looks: f64,
        /// The most that there can be.
        most: f64,
    },
    /// A receiver averages a whole number of looks.
    #[error(
        "radar.speckle.looks = {looks} cannot be made of beat signals; give a whole number from 1 \
         to 10 000, or remove [radar.receiver]"
    )]
    PartialLook {
        /// The looks asked for.
        looks: f64,
    },
    /// The phase of an average of powers.
    #[error(
        "radar.phases = true, and an average over radar.speckle.looks = {looks} has no phase; set looks = 1"
    )]
    PhaseOfLooks {
        /// The looks.
        looks: f64,
    },
    /// The phase of a power that is drawn from its law.
    #[error(
        "radar.phases = true, and speckle of the form \"independent\" is a law of powers without phases; set \
         radar.speckle.form = \"scatterers\" or \"law\""
    )]
    PhaseOfDraws,
    /// Equation (1) cannot be fitted.
    #[error(transparent)]
    F5(#[from] F5Error),
    /// A place that is half given.
    #[error("radar.{name} is missing beside the other keys of the radar's place: {way_out}")]
    HalfAPlace {
        /// The key.
        name: &'static str,
        /// What to do.
        way_out: &'static str,
    },
    /// Keys that are no place.
    #[error(
        "radar.position_m, look_at_m and up are no place for a radar: give finite metres, from 1 mm to 10 km apart, and an \
         `up` that does not lie along the line of sight"
    )]
    NoPlace,
    /// Two places.
    #[error(
        "the radar has two places: leave out position_m, look_at_m and up, or reflector_centre_m, secondary_focus_m, \
         tau_deg, primary_focus_m and alpha_deg"
    )]
    TwoPlaces,
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

/// Why optics have no polynomial.
#[derive(Debug, Error, PartialEq)]
pub enum F5Error {
    /// The beam leaves backwards somewhere in the domain.
    #[error(
        "the beam misses the target plane at γ = {gamma_rad} rad, φ = {phi_rad} rad; reduce the \
         field of view or raise radar.optics.angular_magnification"
    )]
    NoBeam {
        /// Tilt, rad.
        gamma_rad: f64,
        /// Rotation, rad.
        phi_rad: f64,
    },
    /// Own coefficients that do not make a polynomial.
    #[error("radar.f5: {problem}; `matdb radar` writes a complete table to start from")]
    Own {
        /// What is wrong.
        problem: &'static str,
    },
    /// The equations have no solution.
    #[error("no polynomial fits the optics; check radar.optics and the size of the scan")]
    Singular,
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
