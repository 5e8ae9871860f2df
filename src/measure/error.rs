//! Why the registration or the reduction of a cloud fails.

use super::exclusions::Exclusions;
use thiserror::Error;

use crate::formats::words::counted;
use crate::units::{dbm_from_watts, rounded};

/// Why a registration fails.
#[derive(Debug, Error, PartialEq)]
pub enum RegistrationError {
    /// A point of a chirp that the scan does not have.
    #[error(
        "point {point} is of chirp {chirp}, which the scan does not have; give the scan of the measurement, or leave the column of the \
         chirps out"
    )]
    NoSuchChirp {
        /// Point, from 0.
        point: usize,
        /// Its chirp.
        chirp: u32,
    },
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
         give a better rough pose, or check the mesh's size, unit (scale) and frame", 1e3 * reach_m
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
    /// Most points lie on no ray of the scan.
    #[error(
        "{off} of {points} points lie on no ray of the scan: is the radar's place right, and is this its scan? `matdb new scene \
         --cloud` writes a scene with the rays of a cloud"
    )]
    OffRays {
        /// Points on no ray.
        off: usize,
        /// Number of points.
        points: usize,
    },
    /// The registration has not converged.
    #[error(
        "the registration has not converged, and a curve needs a pose; give a rough pose that is nearer"
    )]
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
    #[error("no detection became a row: {}", reasons(.0))]
    NoRows(Exclusions),
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

/// Why a cloud does not calibrate a radar.
#[derive(Debug, Error, PartialEq)]
pub enum CalibrationError {
    /// Cloud, radar and scan do not belong together.
    #[error(transparent)]
    Cloud(#[from] ReductionError),
    /// There is no point.
    #[error("the cloud has no points; check that the radar detected the target")]
    Nothing,
    /// The peak hardly passes the threshold.
    #[error(
        "the strongest point has {peak_dbm:.1} dBm, and the radar's threshold is {} dBm: a calibration needs {} dBm or \
         more; bring the target nearer to the focus or face it to the radar", rounded(*threshold_dbm), rounded(*least_dbm)
    )]
    Weak {
        /// Power of the strongest point, dBm.
        peak_dbm: f64,
        /// The threshold, dBm.
        threshold_dbm: f64,
        /// Least power that is enough, dBm.
        least_dbm: f64,
    },
    /// The strongest point is not on the target.
    #[error(
        "the strongest point, at a range of {range_m:.3} m, is {} the {target} of the scene; give the scene the target's \
         place, or check that the cloud is of this scene", distance(*off_m)
    )]
    Elsewhere {
        /// What the target is.
        target: &'static str,
        /// Range of the strongest point, m.
        range_m: f64,
        /// Distance from the target, m; infinite where the ray misses it.
        off_m: f64,
    },
    /// The radar sees the corner from outside.
    #[error(
        "the corner of the scene is turned away: the radar does not look into it; turn it with rotation_deg, it opens \
         towards +z"
    )]
    TurnedAway,
    /// Too few points near the peak.
    #[error(
        "the {target} has {} within {within_db:.0} dB of the peak, and a calibration needs {least}; measure with a finer \
         scan, or check that the cloud is of this scene", counted(*points, "point")
    )]
    Few {
        /// What the target is.
        target: &'static str,
        /// Points near the peak.
        points: usize,
        /// Least number.
        least: usize,
        /// What counts as near, dB.
        within_db: f64,
    },
    /// The powers are not those of the target.
    #[error(
        "the powers scatter by {rms_db:.1} dB about the return of a {target}; is this the cloud of a smooth metal {target} \
         and nothing else?"
    )]
    OtherReturn {
        /// What the target is.
        target: &'static str,
        /// Root mean square of the residuals, dB.
        rms_db: f64,
    },
    /// The powers do not tell loss and beam apart.
    #[error(
        "the points determine neither the loss nor the beam; scan the {target} with points all around its peak, from directions \
         that differ by less than the spot"
    )]
    Undetermined {
        /// What the target is.
        target: &'static str,
    },
    /// The powers fall off as no beam of this radar makes them.
    #[error(
        "as the return of a {target} the powers need a beam {ratio:.2} times as wide as the radar's; is it another target, \
         or radar.spot_diameter_m of another radar?"
    )]
    OtherWidth {
        /// What the target is.
        target: &'static str,
        /// Waist over that of the scene's radar.
        ratio: f64,
    },
    /// Chirps that should have seen the target did not.
    #[error(
        "{detected} of {expected} chirps near the peak of the {target} have a point; is this the cloud of this scene, and \
         complete?"
    )]
    Holes {
        /// What the target is.
        target: &'static str,
        /// Chirps with a point.
        detected: usize,
        /// Chirps that the target answers.
        expected: usize,
    },
}

/// How many detections are left out for each reason, and what lets them in.
fn reasons(left_out: &Exclusions) -> String {
    let Exclusions { missed, off_surface, other_region, near_edge, unsure_of_facet, .. } =
        *left_out;
    let all = [
        (missed, "beside the target", "check the mesh and --pose"),
        (off_surface, "off its surface", "check the mesh and --pose"),
        (other_region, "of other regions", "choose another --region"),
        (near_edge, "near an edge or another region", "give a smaller --edge-margin"),
        (unsure_of_facet, "on facets that the pose leaves uncertain", "leave --exact-mesh out"),
    ];
    let some = all.into_iter().filter(|(count, ..)| *count > 0);
    let words: Vec<String> =
        some.map(|(count, what, way_out)| format!("{count} {what} ({way_out})")).collect();
    if words.is_empty() { "the cloud has none".to_owned() } else { words.join(", ") }
}

/// A distance as a person would say it.
fn distance(off_m: f64) -> String {
    if off_m.is_finite() { format!("{:.0} mm off", 1e3 * off_m) } else { "beside".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_is_counted_with_its_way_out() {
        let left_out = Exclusions { near_edge: 7, unsure_of_facet: 3, ..Exclusions::default() };
        let words = ReductionError::NoRows(left_out).to_string();
        assert!(words.contains("7 near an edge or another region (give a smaller --edge-margin)"));
        assert!(
            words.contains("3 on facets that the pose leaves uncertain (leave --exact-mesh out")
        );
        assert!(!words.contains("beside the target"), "{words}");
    }
}
