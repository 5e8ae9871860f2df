//! Levels of a model over the angle, in the range for which a material's numbers are claimed.

use crate::brdf::Scattering;
use crate::formats::words::decibels;
use crate::material::{Material, Reach};
use crate::units::db_from_ratio;

/// Below this level there is no echo, dB.
pub(super) const FAINTEST_DB: f64 = -80.0;

/// Angles of the small curves, °: dense where lobes are narrow.
pub(super) const SMALL_DEG: [f64; 27] = [
    0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0,
    35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 70.0, 80.0, 85.0,
];

/// Angles of tables, °.
pub(super) const TABLE_DEG: [f64; 9] = [0.0, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0];

/// A model within the angles for which a material claims it.
pub(super) struct Levels<'a> {
    model: &'a dyn Scattering,
    reach: Reach,
    range_deg: [f64; 2],
}

impl<'a> Levels<'a> {
    /// Levels of what scenes render.
    pub fn rendered(material: &Material, model: &'a dyn Scattering) -> Levels<'a> {
        Levels { reach: material.reach(), ..Levels::stated(material, model) }
    }

    /// Levels of a model that holds in the whole claimed range of the material.
    pub fn stated(material: &Material, model: &'a dyn Scattering) -> Levels<'a> {
        let reach = Reach::new(material.theta_rad, None);
        Levels { model, reach, range_deg: range_deg(material) }
    }

    /// σ⁰ in dB to a tenth at an angle; none where it is not claimed, or there is no echo.
    pub fn db(&self, theta_deg: f64) -> Option<f64> {
        let level_db = db_from_ratio(self.model.sigma0(theta_deg.to_radians()));
        (self.is_claimed(theta_deg) && level_db >= FAINTEST_DB).then(|| tenth(level_db))
    }

    /// σ⁰ at an angle in words; a bound where only a threshold is known.
    pub fn text(&self, theta_deg: f64) -> String {
        match (self.below_db(theta_deg), self.db(theta_deg)) {
            (Some(threshold_db), _) => format!("< {}", decibels(threshold_db)),
            (None, Some(level_db)) => decibels(level_db),
            (None, None) if self.is_claimed(theta_deg) => "nothing".to_owned(),
            (None, None) => "not claimed".to_owned(),
        }
    }

    fn below_db(&self, theta_deg: f64) -> Option<f64> {
        let threshold = self.reach.below_sigma0(theta_deg.to_radians())?;
        self.is_claimed(theta_deg).then(|| db_from_ratio(threshold))
    }

    fn is_claimed(&self, theta_deg: f64) -> bool {
        self.reach.outside_rad(theta_deg.to_radians()) < ROUNDING_RAD
    }

    /// A curve fine enough for the lobe of a smooth surface: (°, dB), one list per unbroken piece.
    pub fn line(&self) -> Vec<Vec<(f64, f64)>> {
        let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
        for theta_deg in angles_deg(self.range_deg) {
            match (self.db(theta_deg), pieces.last_mut()) {
                (Some(level_db), Some(piece)) => piece.push((theta_deg, level_db)),
                (None, Some(piece)) if !piece.is_empty() => pieces.push(Vec::new()),
                _ => {}
            }
        }
        pieces.retain(|piece| piece.len() > 1);
        pieces
    }
}

/// Rounding of an angle that was converted to degrees and back, rad.
const ROUNDING_RAD: f64 = 1e-7;

/// Angles from end to end of the claimed range, °: every tenth up to 12°, then every half.
pub(super) fn angles_deg([least, most]: [f64; 2]) -> impl Iterator<Item = f64> {
    let fine = (0..120).map(|step: u32| f64::from(step) / 10.0);
    let coarse = (24..180).map(|step: u32| f64::from(step) / 2.0);
    let inner = fine.chain(coarse).filter(move |a| *a > least && *a < most);
    std::iter::once(least).chain(inner).chain((most > least && most < 90.0).then_some(most))
}

/// The claimed range, °, as people write it.
pub(super) fn range_deg(material: &Material) -> [f64; 2] {
    material.theta_rad.map(|rad| (rad.to_degrees() * 1e6).round() / 1e6)
}

/// To a tenth, and never −0.
pub(super) fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0 + 0.0
}
