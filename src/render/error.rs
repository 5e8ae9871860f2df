//! Errors of rendering.

use thiserror::Error;

use crate::radar::{AliasError, Field, RadarError};
use crate::trace::TraceError;

/// Why a scan cannot be rendered.
#[derive(Debug, Error, PartialEq)]
pub enum RenderError {
    /// No ray hits the target.
    #[error(
        "no chirp of the scan hits the target: at 8 m the scan covers {scan}, the target lies at {target} of the \
         target frame; {way_out}"
    )]
    Miss {
        /// The field of view at 8 m, in the target frame.
        scan: Field,
        /// The extent of the target, in the target frame.
        target: Field,
        /// The likely remedy.
        way_out: &'static str,
    },
    /// An antenna stands inside the target.
    #[error("the {antenna} at ({x_m}, {y_m}, {z_m}) m stands inside the target; move its {key}")]
    Inside {
        /// Which antenna.
        antenna: &'static str,
        /// The key that says where it stands.
        key: &'static str,
        /// x in the global frame, m.
        x_m: f64,
        /// y, m.
        y_m: f64,
        /// z, m.
        z_m: f64,
    },
    /// A path is longer than the unambiguous range of the sampling.
    #[error(transparent)]
    Alias(#[from] AliasError),
    /// A receiver adds amplitudes of several paths, whose phases are undeclared.
    #[error(
        "the paths of one chirp reach the receiver with unknown phases, which is speckle; add \
         [radar.speckle] (looks = 64 averages most of it away), or set spot.rays = 1 and remove \
         [bounce]"
    )]
    Phases,
    /// The law of speckle has one amplitude per chirp, and a receiver of beat signals sees several ranges.
    #[error(
        "radar.speckle.form = \"law\" has one amplitude per chirp, and the paths of one chirp reach the [radar.receiver] from \
         several ranges; set form = \"scatterers\", or set spot.rays = 1 and remove [bounce]"
    )]
    LawOfTones,
    /// The field of the speckle would not fit into memory.
    #[error(
        "the speckle of this scan is too large a field: its rays aim too far apart for the width of the beam, the \
         beam widens more than twenty times towards the edge, or radar.speckle.looks is too large; set radar.speckle.form = \"independent\""
    )]
    SpeckleField,
    /// Scatterers are placed as one antenna sees them.
    #[error(
        "radar.speckle.form = \"scatterers\" needs a radar that stays in its place, and the rays of this scan start from places \
         further apart than its beam's waist; set form = \"law\""
    )]
    ScattererOrigins,
    /// Scatterers for so large a target would not fit into memory.
    #[error(
        "the target has room for {count} scatterers, three on the beam's waist; leave out meshes that the scan does not \
         need, or set radar.speckle.form = \"law\""
    )]
    ScattererCount {
        /// Number of scatterers.
        count: usize,
    },
    /// The beams pass their foci too far apart for scatterers.
    #[error(
        "the beams of this scan pass their foci over {squares:.1e} squares of their waist, and scatterers take {most:.1e} at \
         most; set radar.beam.focus_m nearer to the target, or radar.speckle.form = \"independent\""
    )]
    ScattererField {
        /// Squares as wide as the waist between the outermost beams.
        squares: f64,
        /// The most that there can be.
        most: f64,
    },
    /// Amplitudes of so many scatterers and looks would not fit into memory.
    #[error(
        "{scatterers} scatterers of radar.speckle.looks = {looks} have more than {most:.1e} amplitudes; lower looks, or \
         set radar.speckle.form = \"independent\""
    )]
    ScattererLooks {
        /// Number of scatterers that the radar sees.
        scatterers: usize,
        /// Looks.
        looks: usize,
        /// The most amplitudes that there can be.
        most: f64,
    },
    /// A batch does not place scatterers.
    #[error(
        "a batch of scans has the speckle of the law; remove radar.speckle.form = \"scatterers\" and radar.phases, or render the \
         scans one by one"
    )]
    BatchScatterers,
    /// A receiver needs beat signals, which a batch does not compute.
    #[error(
        "a batch of scans has no beat signals for a [radar.receiver]; remove it, or render the scans one \
         by one"
    )]
    Signals,
    /// A surface lets the wave pass on, and a batch sees only what lies in front.
    #[error(
        "a batch of scans sees the first surface only, and a region lets the wave pass on; remove its `transmits` or \
         `thickness_m`, or render the scans one by one"
    )]
    Sheets,
    /// An effect would be counted twice, or is undefined for this scan.
    #[error("effect `{effect}` {problem}; {way_out}")]
    Effect {
        /// Name of the effect.
        effect: &'static str,
        /// The conflict.
        problem: &'static str,
        /// The likely remedy.
        way_out: &'static str,
    },
    /// The settings of the receiver are inconsistent.
    #[error(transparent)]
    Radar(#[from] RadarError),
    /// The chosen tracer does not accept the rays of the scan, or failed.
    #[error(transparent)]
    Tracer(#[from] TraceError),
}
