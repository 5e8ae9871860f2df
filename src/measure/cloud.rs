//! A measured cloud: one point and one power per detection, in the global frame.
//!
//! Other columns of a file, such as the facet that a simulated ray hit, are not read: a measurement
//! has none of them.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use glam::DVec3;
use thiserror::Error;

use crate::formats::FormatError;
use crate::frames::{Global, Point};
use crate::material::Scale;
use crate::render::Echo;
use crate::units::{dbm_from_watts, rounded, shown, watts_from_dbm};

/// Larger than any target of this radar, m: beyond, the unit is wrong.
const LARGEST_M: f64 = 100.0;
/// Powers that can have been received, dBm: from far below the thermal noise of a hertz to more than any receiver takes.
pub(super) const POSSIBLE_DBM: RangeInclusive<f64> = -300.0..=60.0;

/// One detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Chirp number, if the file has it.
    pub chirp: Option<u32>,
    /// Where the radar puts the echo.
    pub point: Point<Global>,
    /// Range R as the file gives it, m.
    pub range_m: Option<f64>,
    /// Received power, W.
    pub power_w: f64,
}

impl From<&Echo> for CloudPoint {
    /// The point that the radar reports of an echo.
    fn from(echo: &Echo) -> CloudPoint {
        let Echo { chirp, point, range_m, power_w, .. } = *echo;
        CloudPoint { chirp: Some(chirp), point, range_m: Some(range_m), power_w }
    }
}

/// A measured cloud that passed [`Cloud::new`].
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    points: Vec<CloudPoint>,
    /// Whether the powers are known, or only up to a common factor.
    pub scale: Scale,
    /// Notices for the user.
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
        "the cloud is {size_m:.0} m across, beyond {LARGEST_M} m; is the file in millimetres? say --unit mm, or name its \
         columns x_mm, y_mm and z_mm"
    )]
    TooLarge {
        /// Diagonal of the bounding box, m.
        size_m: f64,
    },
    /// Powers in watts that a file states as dBm.
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
    /// A column of powers in which nothing stands.
    #[error("all {points} powers are 0: the file has none; choose another column, or another file")]
    NoPowers {
        /// Number of points.
        points: usize,
    },
    /// A power that cannot have been received.
    #[error(
        "point {point} has {} dBm, which is not from {} to {}; check the unit of the power",
        shown(rounded(*power_dbm)), POSSIBLE_DBM.start(), POSSIBLE_DBM.end()
    )]
    NoSuchPower {
        /// Point, from 0.
        point: usize,
        /// Its power, dBm: as the file states it, which in W may be beyond any number.
        power_dbm: f64,
    },
    /// A power in watts that is not positive.
    #[error("point {point} has a power of {power_w:e} W, which is not positive; are these dBm?")]
    NotPositive {
        /// Point, from 0.
        point: usize,
        /// Its power, W.
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
    /// The header of a cloud file lacks columns.
    #[error(
        "the file has no {missing}; it has: {found}; say which they are, as by --columns {example}"
    )]
    MissingColumns {
        /// The columns that are missing, in words.
        missing: String,
        /// The columns of the file.
        found: String,
        /// What the flag would say.
        example: String,
    },
    /// Powers in two units.
    #[error("the file has both {first} and {second}; pass one over, as by --columns {second}=-")]
    TwoPowers {
        /// A column of powers.
        first: &'static str,
        /// Another.
        second: &'static str,
    },
    /// Counts that are no power.
    #[error(
        "point {point} has {counts} counts, and powers are above zero; leave out what was not detected, or give --power relative \
         where these are decibels"
    )]
    NoCounts {
        /// Point, from 0.
        point: usize,
        /// Its counts.
        counts: f64,
    },
    /// Powers that are known up to a common factor only.
    #[error(
        "the powers are relative, and this needs dBm or watts; `matdb measure` takes relative ones"
    )]
    Relative,
    /// A chirp number that is not a whole number from 0.
    #[error("point {point} has the chirp number {value}; give a whole number, 0 or greater")]
    BadChirp {
        /// Point, from 0.
        point: usize,
        /// The number in the file.
        value: f64,
    },
}

impl Cloud {
    /// A cloud from its points, of known powers.
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
        Ok(Cloud { points, scale: Scale::Absolute, notices })
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
            ("the power", point.power_w.is_finite()),
        ];
        if let Some((what, _)) = checks.into_iter().find(|(_, finite)| !finite) {
            return Err(CloudError::NotFinite { what, point: number });
        }
    }
    Ok(())
}

fn check_size(points: &[CloudPoint]) -> Result<(), CloudError> {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in points {
        min = min.min(point.point.xyz);
        max = max.max(point.point.xyz);
    }
    let size_m = min.distance(max);
    if size_m > LARGEST_M { Err(CloudError::TooLarge { size_m }) } else { Ok(()) }
}

fn check_powers(points: &[CloudPoint]) -> Result<(), CloudError> {
    let possible_w = watts_from_dbm(*POSSIBLE_DBM.start())..=watts_from_dbm(*POSSIBLE_DBM.end());
    for (number, &CloudPoint { power_w, .. }) in points.iter().enumerate() {
        if power_w < 0.0 {
            return Err(CloudError::NotPositive { point: number, power_w });
        }
        if !possible_w.contains(&power_w) {
            let power_dbm = dbm_from_watts(power_w);
            return Err(CloudError::NoSuchPower { point: number, power_dbm });
        }
    }
    Ok(())
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
        let power_w = watts_from_dbm(power_dbm);
        CloudPoint { chirp: Some(chirp), point, range_m: None, power_w }
    }

    fn refused(points: Vec<CloudPoint>) -> CloudError {
        Cloud::new(points).unwrap_err()
    }

    #[test]
    fn levels_given_as_watts_are_refused() {
        let point = CloudPoint { power_w: -60.0, ..point(0, 0.0, -60.0) };
        assert_eq!(refused(vec![point]), CloudError::NotPositive { point: 0, power_w: -60.0 });
        let none = CloudPoint { power_w: 0.0, ..point };
        assert!(matches!(refused(vec![none]), CloudError::NoSuchPower { point: 0, .. }));
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
        assert!(strong.to_string().contains("point 0 has 75 dBm"), "{strong}");
        assert!(Cloud::new(vec![point(0, 0.0, -300.0), point(1, 0.0, 60.0)]).is_ok());
        let twice = refused(vec![point(3, 0.0, -60.0), point(4, 0.0, -60.0), point(3, 0.1, -60.0)]);
        assert_eq!(twice, CloudError::DuplicateChirp { chirp: 3, first: 0, second: 2 });
    }
}
