//! Why the registration or the reduction of a cloud fails.

use thiserror::Error;

use crate::units::{dbm_from_watts, rounded};

/// Why a registration fails.
#[derive(Debug, Error, PartialEq)]
pub enum RegistrationError {
    /// Too few points.
    #[error("the cloud has {points} points, a pose needs {least}; measure with more chirps")]
    TooFew {
        /// Points of the cloud.
        points: usize,
        /// Least number.
        least: usize,
    },
    /// A point where its ray starts.
    #[error("point {point} lies where the radar's rays start; check the frame of the cloud")]
    AtTheRadar {
        /// Point, from 0.
        point: usize,
    },
    /// Ranges contradict positions.
    #[error(
        "the ranges of the cloud differ from the distances of its points from the radar by {:.0} mm; \
         check its frame, its unit and the radar's place", 1e3 * typical_m
    )]
    RangesDisagree {
        /// Typical difference, m.
        typical_m: f64,
    },
    /// Chirp numbers contradict positions.
    #[error(
        "{off} of {numbered} points do not lie on the ray of their chirp; check the frame of the cloud \
         and the radar's scan"
    )]
    ChirpsDisagree {
        /// Points off their ray or of an unknown chirp.
        off: usize,
        /// Points with a chirp number.
        numbered: usize,
    },
    /// The virtual scan sees nothing.
    #[error(
        "no chirp of the scan hits the mesh at the rough pose; give a rough pose within the field of \
         view, and check that the cloud lies there, too"
    )]
    NothingInView,
    /// The clouds do not overlap.
    #[error(
        "{near} of {points} points are within {:.0} mm of the mesh at the rough pose: no overlap; \
         give a better rough pose, or check frame and unit", 1e3 * reach_m
    )]
    NoOverlap {
        /// Points with a neighbour.
        near: usize,
        /// Points that were paired.
        points: usize,
        /// Farthest neighbour, m.
        reach_m: f64,
    },
    /// The pose ran away.
    #[error(
        "the pose moved {:.0} mm and {:.1}° from the rough one: it diverged; give a better rough pose",
        1e3 * shift_m, turn_rad.to_degrees()
    )]
    Diverged {
        /// Shift of the target, m.
        shift_m: f64,
        /// Turn, rad.
        turn_rad: f64,
    },
    /// The surface does not explain the points.
    #[error(
        "only {inliers} of {points} points lie on the registered surface; is this the mesh that was \
         measured, and the rough pose near?"
    )]
    NoFit {
        /// Points on the surface.
        inliers: usize,
        /// All points.
        points: usize,
    },
}

/// Why a reduction fails.
#[derive(Debug, Error, PartialEq)]
pub enum ReductionError {
    /// The registration has not converged.
    #[error("the registration has not converged; a curve needs a pose, so allow more steps")]
    NotConverged,
    /// No such region.
    #[error("there is no region {region}; the target has {regions}")]
    UnknownRegion {
        /// The region of the settings.
        region: u16,
        /// Number of regions.
        regions: usize,
    },
    /// Cloud, radar and scan do not belong together.
    #[error(transparent)]
    Cloud(#[from] RegistrationError),
    /// No detection became a row.
    #[error(
        "no detection became a row: {missed} miss the target, {off_surface} lie off its surface, \
         {other_region} are of other regions and {near_edge} near an edge; choose another region or a \
         smaller edge margin"
    )]
    NoRows {
        /// See [`Exclusions`](super::Exclusions).
        missed: usize,
        /// See [`Exclusions`](super::Exclusions).
        off_surface: usize,
        /// See [`Exclusions`](super::Exclusions).
        other_region: usize,
        /// See [`Exclusions`](super::Exclusions).
        near_edge: usize,
    },
    /// The radar of the scene could not have detected this.
    #[error(
        "{below} of {points} powers lie below the scene's threshold of {} dBm, the weakest \
         at {:.1} dBm; give the scene the radar.threshold_dbm of the measurement, or check \
         the unit of the power",
        rounded(dbm_from_watts(*threshold_w)), dbm_from_watts(*weakest_w)
    )]
    BelowThreshold {
        /// Detections below it.
        below: usize,
        /// All detections.
        points: usize,
        /// The threshold, W.
        threshold_w: f64,
        /// The weakest power, W.
        weakest_w: f64,
    },
    /// Several detections of one chirp.
    #[error(
        "{shared} of {points} points share a chirp with another point; keep one detection per chirp, \
         or give the scene the scan of the measurement"
    )]
    SharedChirps {
        /// Points beyond the first of their chirp.
        shared: usize,
        /// All points.
        points: usize,
    },
}
