//! The angles and frequencies for which a material is claimed to hold.

use super::curve::{Censor, Curve};
use super::revision::Material;

/// Angles at which a material answers: those that it claims and, of a curve that is rendered, no farther
/// than its points go.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    claimed_rad: [f64; 2],
    points: Option<Points>,
}

/// Where a curve has points in backscatter.
#[derive(Clone, Debug, PartialEq)]
struct Points {
    /// The first and the last detection, rad.
    seen_rad: [f64; 2],
    /// What lies below the threshold beyond the last detection, by angle: rad, and the threshold as σ⁰.
    silent: Vec<(f64, f64)>,
}

impl Reach {
    /// Of what is claimed for a range, rad, and of the curve that is rendered, if it is one.
    pub fn new(claimed_rad: [f64; 2], curve: Option<&Curve>) -> Reach {
        Reach { claimed_rad, points: curve.and_then(Points::of) }
    }

    /// Smallest and largest angle with an answer, rad; the smallest is the larger where there is none.
    pub fn span_rad(&self) -> [f64; 2] {
        let [least, most] = self.claimed_rad;
        let Some(points) = &self.points else { return self.claimed_rad };
        let last = points.silent_rad().map_or(points.seen_rad[1], |[_, last]| last);
        [least.max(points.seen_rad[0]), most.min(last)]
    }

    /// How far an incidence, rad, lies outside; 0 within.
    pub fn outside_rad(&self, theta_rad: f64) -> f64 {
        let beyond_points = self.points.as_ref().map_or(0.0, |points| {
            let silent = points.silent_rad().map_or(f64::INFINITY, |of| outside(of, theta_rad));
            outside(points.seen_rad, theta_rad).min(silent)
        });
        outside(self.claimed_rad, theta_rad).max(beyond_points)
    }

    /// The threshold, as σ⁰, below which the curve lies at an incidence, rad, where it has only
    /// thresholds: that of the nearest of them.
    pub fn below_sigma0(&self, theta_rad: f64) -> Option<f64> {
        let points = self.points.as_ref()?;
        let nearest = points
            .silent
            .iter()
            .min_by(|a, b| (a.0 - theta_rad).abs().total_cmp(&(b.0 - theta_rad).abs()))?;
        (outside(points.silent_rad()?, theta_rad) <= 0.0).then_some(nearest.1)
    }
}

impl Points {
    fn of(curve: &Curve) -> Option<Points> {
        let retro = curve.observations.iter().filter(|o| o.is_retro());
        let seen = retro.clone().filter(|o| o.sigma0.is_some()).map(|o| o.theta_i_rad);
        let seen_rad = [seen.clone().reduce(f64::min)?, seen.reduce(f64::max)?];
        let mut silent: Vec<(f64, f64)> = retro
            .filter(|o| o.censor == Censor::Left && o.theta_i_rad > seen_rad[1])
            .filter_map(|o| Some((o.theta_i_rad, o.threshold_sigma0?)))
            .collect();
        silent.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Points { seen_rad, silent })
    }

    /// The first and the last of the thresholds, rad.
    fn silent_rad(&self) -> Option<[f64; 2]> {
        Some([self.silent.first()?.0, self.silent.last()?.0])
    }
}

impl Material {
    /// How far it answers for what scenes render.
    pub fn reach(&self) -> Reach {
        let curve = self.curves.iter().find(|curve| curve.name == self.render);
        Reach::new(self.theta_rad, curve)
    }

    /// How far a frequency, Hz, lies outside [`frequency_hz`](Material::frequency_hz), Hz; 0 within.
    pub fn frequency_outside_hz(&self, frequency_hz: f64) -> f64 {
        outside(self.frequency_hz, frequency_hz)
    }
}

/// Distance of a number from a range, 0 within.
fn outside([low, high]: [f64; 2], x: f64) -> f64 {
    (low - x).max(x - high).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_answers_where_it_has_points_and_a_threshold_is_a_bound() {
        let points = Points { seen_rad: [0.1, 0.3], silent: vec![(0.6, 1e-3), (0.8, 1e-4)] };
        let reach = Reach { claimed_rad: [0.0, 1.0], points: Some(points) };
        for (theta_rad, outside_rad) in
            [(0.0, 0.1), (0.2, 0.0), (0.4, 0.1), (0.55, 0.05), (0.7, 0.0), (1.1, 0.3)]
        {
            assert!((reach.outside_rad(theta_rad) - outside_rad).abs() < 1e-12, "{theta_rad}");
        }
        let below = [0.2, 0.5, 0.65, 0.8, 0.9].map(|theta_rad| reach.below_sigma0(theta_rad));
        assert_eq!(below, [None, None, Some(1e-3), Some(1e-4), None]);
        assert_eq!(reach.span_rad(), [0.1, 0.8]);
        let claimed = Reach::new([0.0, 1.0], None);
        assert_eq!((claimed.outside_rad(0.5), claimed.span_rad()), (0.0, [0.0, 1.0]));
    }
}
