//! Curves drawn from a law.

use super::points::{Kind, Point, Points};
use crate::brdf::{Brdf, Scattering};
use crate::material::file::in_plane::InPlane;
use crate::measure::Curve;
use crate::radar::random::{Key, Purpose};
use crate::units::{db_from_ratio, ratio_from_db};

/// Directions in the plane of incidence every so many degrees up to 80°.
fn angles(incidences_deg: &[f64], step_deg: f64) -> Vec<[f64; 2]> {
    let count = (160.0 / step_deg) as i32;
    let scan = |&i: &f64| (0..=count).map(move |k| [i, -80.0 + step_deg * f64::from(k)]);
    incidences_deg.iter().flat_map(scan).collect()
}

/// Points of a law without noise.
pub(super) fn in_plane(law: &Brdf, incidences_deg: &[f64], step_deg: f64) -> Vec<Point> {
    let points = curve_of(&noisy(incidences_deg, step_deg, 0.0, |_| 0.0), None).points;
    let level = |p: Point| Point { f_db: db_from_ratio(law.f_per_sr(p.i, p.o)), ..p };
    points.into_iter().map(level).collect()
}

/// Values of a level in dB with normal noise.
pub(super) fn noisy(
    incidences_deg: &[f64],
    step_deg: f64,
    noise_db: f64,
    level_db: impl Fn(&Point) -> f64,
) -> Vec<InPlane> {
    let bare = |[i, s]: [f64; 2]| InPlane {
        theta_i_rad: i.to_radians(),
        theta_s_rad: s.to_radians(),
        f_per_sr: 1.0,
    };
    let values: Vec<InPlane> = angles(incidences_deg, step_deg).into_iter().map(bare).collect();
    let points = curve_of(&values, Some(1.0)).points;
    values
        .into_iter()
        .zip(&points)
        .enumerate()
        .map(|(index, (value, point))| {
            let db = level_db(point) + noise_db * normal(index);
            InPlane { f_per_sr: ratio_from_db(db), ..value }
        })
        .collect()
}

/// A standard normal number.
pub(super) fn normal(index: usize) -> f64 {
    let key = Key { seed: 11, chirp: index as u64, sub_ray: 0, purpose: Purpose::Fit };
    let mut draws = key.draws();
    (0..12).map(|_| draws.uniform()).sum::<f64>() - 6.0
}

/// The points of values in the plane of incidence.
pub(super) fn curve_of(values: &[InPlane], noise_db: Option<f64>) -> Points {
    let observations = values.iter().map(InPlane::observation).collect();
    let curve = Curve { observations, ..Curve::default() };
    let points = Points::of_curve(&curve, &[], noise_db).unwrap();
    assert_eq!(points.kind, Kind::InPlane);
    points
}
