//! Why a curve cannot be diagnosed.

use thiserror::Error;

use super::settings::{LEAST_BLOCKS, LEAST_POINTS};
use crate::fit::FitError;
use crate::units::{rounded, shown};

/// Why the diagnosis of a curve has no answer.
#[derive(Debug, Error, PartialEq)]
pub enum CurveDiagnoseError {
    /// The scattering model cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Too few detections.
    #[error("{detected} detected levels cannot distinguish terms; measure {LEAST_POINTS} or more")]
    TooFew {
        /// Levels.
        detected: usize,
    },
    /// Too few runs of angles.
    #[error(
        "the angles make {blocks} runs of {}° and {LEAST_BLOCKS} are needed to hold some out; \
         measure more angles or more incidences", shown(rounded(*.width_deg))
    )]
    TooShort {
        /// Runs.
        blocks: usize,
        /// Their width, degrees.
        width_deg: f64,
    },
    /// Two repeats of the curve are of different levels.
    #[error(
        "repeats {} and {} of the angles contradict each other: they are {:.1} dB apart at one end of the angles, \
         and their difference scatters by {:.1} dB about a line; find what changed between them, or diagnose each by itself",
        .repeats[0], .repeats[1], .apart_db, .scatter_db
    )]
    Contradiction {
        /// Their numbers, from 1, in the order of the file.
        repeats: [usize; 2],
        /// How far apart they are at the end of the angles where they are farther, dB.
        apart_db: f64,
        /// Standard deviation of the difference about a line, dB.
        scatter_db: f64,
    },
    /// The noise is unknown.
    #[error(
        "the levels do not determine the noise: no incidence has three angles, none is repeated and no `sd_db` is \
         given; state it, or measure more angles of each incidence"
    )]
    Noiseless,
    /// A noise without a meaning.
    #[error("a noise of {noise_db} dB has no meaning; give a value above 0 and up to 100")]
    Noise {
        /// Declared noise, dB.
        noise_db: f64,
    },
}
