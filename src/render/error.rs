//! Why there is nothing to render.

use thiserror::Error;

use crate::radar::{Aliased, Field, RadarError};
use crate::trace::TraceError;

/// Why there is nothing to render.
#[derive(Debug, Error, PartialEq)]
pub enum RenderError {
    /// No ray meets the target.
    #[error(
        "no chirp of the scan hits the target: at 8 m the scan covers {scan}, the target lies at {target} of the \
         target frame; {way_out}"
    )]
    Miss {
        /// Where the scan looks.
        scan: Field,
        /// Where the target is.
        target: Field,
        /// What to do.
        way_out: &'static str,
    },
    /// An antenna stands inside the target.
    #[error(
        "the receiver at ({x_m}, {y_m}, {z_m}) m stands inside the target and sees nothing; move its \
         position_m"
    )]
    Inside {
        /// x in the global frame, m.
        x_m: f64,
        /// y, m.
        y_m: f64,
        /// z, m.
        z_m: f64,
    },
    /// A path is longer than the sampling can tell.
    #[error(transparent)]
    Aliased(#[from] Aliased),
    /// A receiver adds amplitudes, and nothing says with which phases.
    #[error(
        "the paths of one chirp reach the receiver with unknown phases, which is speckle; add \
         [radar.speckle] (looks = 64 averages most of it away), or set spot.rays = 1 and remove \
         [bounce]"
    )]
    Phases,
    /// The coherent part of speckle is that of one path.
    #[error(
        "radar.speckle.coherent_ratio is that of a whole echo and cannot be shared out among several \
         paths; set it to 0, or set spot.rays = 1 and remove [bounce]"
    )]
    Coherent,
    /// A receiver works on beat signals, and a batch has powers.
    #[error(
        "a batch of scans has no beat signals for a [radar.receiver]; remove it, or render the scans one \
         by one"
    )]
    Signals,
    /// An effect that would count twice, or that cannot be had.
    #[error("effect `{effect}` {problem}; {way_out}")]
    Effect {
        /// The effect.
        effect: &'static str,
        /// What is wrong.
        problem: &'static str,
        /// What to do.
        way_out: &'static str,
    },
    /// The receiver cannot work.
    #[error(transparent)]
    Radar(#[from] RadarError),
    /// The tracer that was asked for does not take the rays of the scan, or stopped working.
    #[error(transparent)]
    Tracer(#[from] TraceError),
}
