//! A measured cloud: one point and one power per detection, in the global frame.
//!
//! Nothing else that a file may know, such as the facet a simulated ray has hit, is kept: a
//! measurement does not know it.

use std::collections::HashMap;

use thiserror::Error;

use crate::formats::FormatError;
use crate::frames::{Global, Point};

/// Larger than any target of this radar, m: beyond, the unit is wrong.
const LARGEST_M: f64 = 100.0;
/// No receiver takes more, dBm.
const STRONGEST_DBM: f64 = 60.0;
/// Far below the thermal noise of a hertz, dBm.
const WEAKEST_DBM: f64 = -300.0;
/// 10 mW: every received power in watts is below, and hardly one of many levels in dBm lies between
/// it and zero.
const STRONGEST_W: f64 = 0.01;

/// One detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Chirp number, when the file tells it.
    pub chirp: Option<u32>,
    /// Where the radar puts the echo.
    pub point: Point<Global>,
    /// Range R as the file gives it, m.
    pub range_m: Option<f64>,
    /// Received power, dBm.
    pub power_dbm: f64,
}

/// A measured cloud that passed [`Cloud::new`].
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    points: Vec<CloudPoint>,
    /// What a person should know of it.
    pub notices: Vec<String>,
}

/// Why a cloud cannot be used.
#[derive(Debug, Error, PartialEq)]
pub enum CloudError {
    /// The file does not follow its format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// There is no point.
    #[error("the cloud has no points; check that the radar detected something")]
    Empty,
    /// A number is NaN or infinite.
    #[error("{what} of point {point} is not finite; remove the point or mend the export")]
    NotFinite {
        /// `the position`, `the range` or `the power`.
        what: &'static str,
        /// Point, from 0.
        point: usize,
    },
    /// Lengths that no target of this radar has.
    #[error(
        "the cloud is {size_m:.0} m across, beyond {LARGEST_M} m; is the file in millimetres? state \
         its unit"
    )]
    TooLarge {
        /// Diagonal of the bounding box, m.
        size_m: f64,
    },
    /// Powers in watts that were announced as dBm.
    #[error(
        "all {points} powers lie between 0 and {largest:e}: these are watts, not dBm; \
         state the unit of the power, and leave out points of 0 W"
    )]
    Watts {
        /// Number of points.
        points: usize,
        /// The largest power as given.
        largest: f64,
    },
    /// A power that cannot have been received.
    #[error(
        "point {point} has {power_dbm} dBm, which is not from {WEAKEST_DBM} to {STRONGEST_DBM}; check \
         the unit of the power"
    )]
    NoSuchPower {
        /// Point, from 0.
        point: usize,
        /// Its power.
        power_dbm: f64,
    },
    /// A power in watts that is not positive.
    #[error("point {point} has a power of {power_w:e} W, which is not positive; are these dBm?")]
    NotPositive {
        /// Point, from 0.
        point: usize,
        /// Its power.
        power_w: f64,
    },
    /// Two detections of one chirp.
    #[error(
        "points {first} and {second} are both of chirp {chirp}; keep one detection per chirp, or \
         leave the chirp numbers out"
    )]
    DuplicateChirp {
        /// The chirp.
        chirp: u32,
        /// Point, from 0.
        first: usize,
        /// Point, from 0.
        second: usize,
    },
    /// The header of a cloud file lacks a column.
    #[error("the file has no column {column}; it has: {found}")]
    MissingColumn {
        /// What is needed.
        column: &'static str,
        /// What is there.
        found: String,
    },
    /// A chirp number that is none.
    #[error("point {point} has the chirp number {value}; give a whole number, 0 or greater")]
    BadChirp {
        /// Point, from 0.
        point: usize,
        /// What stands there.
        value: f64,
    },
}

impl Cloud {
    /// A cloud from its points.
    ///
    /// # Errors
    /// When there is no point, a number is not finite, the size or the powers betray a wrong unit,
    /// or a chirp is there twice.
    pub fn new(points: Vec<CloudPoint>) -> Result<Cloud, CloudError> {
        if points.is_empty() {
            return Err(CloudError::Empty);
        }
        check_finite(&points)?;
        check_size(&points)?;
        check_powers(&points)?;
        check_chirps(&points)?;
        let mut notices = Vec::new();
        let unnumbered = points.iter().filter(|point| point.chirp.is_none()).count();
        if unnumbered > 0 {
            notices.push(format!(
                "{unnumbered} of {} points have no chirp number; they are matched to the scan by \
                 their direction",
                points.len()
            ));
        }
        Ok(Cloud { points, notices })
    }

    /// The detections, at least one, all finite.
    pub fn points(&self) -> &[CloudPoint] {
        &self.points
    }
}

fn check_finite(points: &[CloudPoint]) -> Result<(), CloudError> {
    for (number, point) in points.iter().enumerate() {
        let checks = [
            ("the position", point.point.xyz.is_finite()),
            ("the range", point.range_m.is_none_or(f64::is_finite)),
            ("the power", point.power_dbm.is_finite()),
        ];
        if let Some((what, _)) = checks.into_iter().find(|(_, finite)| !finite) {
            return Err(CloudError::NotFinite { what, point: number });
        }
    }
    Ok(())
}

fn check_size(points: &[CloudPoint]) -> Result<(), CloudError> {
    let places = || points.iter().map(|point| point.point.xyz);
    let min = places().fold(glam::DVec3::INFINITY, glam::DVec3::min);
    let max = places().fold(glam::DVec3::NEG_INFINITY, glam::DVec3::max);
    let size_m = min.distance(max);
    if size_m > LARGEST_M { Err(CloudError::TooLarge { size_m }) } else { Ok(()) }
}

fn check_powers(points: &[CloudPoint]) -> Result<(), CloudError> {
    let powers = || points.iter().map(|point| point.power_dbm);
    let largest = powers().fold(f64::NEG_INFINITY, f64::max);
    if powers().all(|power| power >= 0.0) && largest <= STRONGEST_W {
        return Err(CloudError::Watts { points: points.len(), largest });
    }
    let outside = |power: f64| !(WEAKEST_DBM..=STRONGEST_DBM).contains(&power);
    match points.iter().enumerate().find(|(_, point)| outside(point.power_dbm)) {
        Some((point, &CloudPoint { power_dbm, .. })) => {
            Err(CloudError::NoSuchPower { point, power_dbm })
        }
        None => Ok(()),
    }
}

fn check_chirps(points: &[CloudPoint]) -> Result<(), CloudError> {
    let mut seen = HashMap::new();
    for (second, point) in points.iter().enumerate() {
        if let Some(chirp) = point.chirp
            && let Some(first) = seen.insert(chirp, second)
        {
            return Err(CloudError::DuplicateChirp { chirp, first, second });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(chirp: u32, x_m: f64, power_dbm: f64) -> CloudPoint {
        let point = Point::new(x_m, 1.0, 0.0);
        CloudPoint { chirp: Some(chirp), point, range_m: None, power_dbm }
    }

    fn refused(points: Vec<CloudPoint>) -> CloudError {
        Cloud::new(points).unwrap_err()
    }

    #[test]
    fn watts_given_as_dbm_are_told() {
        let error = refused(vec![point(0, 0.0, 2e-11), point(1, 0.1, 3e-7)]);
        assert_eq!(error, CloudError::Watts { points: 2, largest: 3e-7 });
        assert!(error.to_string().contains("these are watts, not dBm"), "{error}");
        let error = refused(vec![point(0, 0.0, 0.0), point(1, 0.1, 3e-7)]);
        assert!(matches!(error, CloudError::Watts { .. }), "{error}");
        assert!(Cloud::new(vec![point(0, 0.0, -60.0), point(1, 0.1, 3e-7)]).is_ok());
    }

    #[test]
    fn what_cannot_have_been_measured_is_refused() {
        assert_eq!(refused(vec![]), CloudError::Empty);
        let nan = refused(vec![point(0, 0.0, -60.0), point(1, 0.0, f64::NAN)]);
        assert_eq!(nan, CloudError::NotFinite { what: "the power", point: 1 });
        let nan = refused(vec![point(0, f64::NAN, -60.0)]);
        assert_eq!(nan, CloudError::NotFinite { what: "the position", point: 0 });
        let far = refused(vec![point(0, 0.0, -60.0), point(1, 250.0, -60.0)]);
        assert!(far.to_string().contains("millimetres"), "{far}");
        let strong = refused(vec![point(0, 0.0, 75.0)]);
        assert_eq!(strong, CloudError::NoSuchPower { point: 0, power_dbm: 75.0 });
        let twice = refused(vec![point(3, 0.0, -60.0), point(4, 0.0, -60.0), point(3, 0.1, -60.0)]);
        assert_eq!(twice, CloudError::DuplicateChirp { chirp: 3, first: 0, second: 2 });
    }
}
