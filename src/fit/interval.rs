//! Profile intervals: the values of one coordinate that the data do not reject.
//!
//! With one coordinate held and the others at their best, twice the loss of ln likelihood stays below
//! χ²₁(0.95) = 1.96² (Wilks 1938, DOI 10.1214/aoms/1177732360). Its root is nearly linear in the
//! coordinate, so that a secant finds the ends in two or three searches.

use nalgebra::DVector;

use super::coordinates::Coordinates;
use super::minimise::{Local, Minimise, Minimum};
use super::uncertainty::Uncertainty;

/// Normal deviate of a 95 % interval.
pub(super) const DEVIATE_95: f64 = 1.959_964;
/// Largest error of the deviate at an end, and the most searches for it.
const NEAR: f64 = 0.02;
const SEARCHES: usize = 8;

/// One end of an interval, in the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct End {
    /// Where it is.
    pub at: f64,
    /// The range of the coordinate ends before the data reject it.
    pub open: bool,
}

/// What every profile of one fit shares.
pub(super) struct Profile<'a, F> {
    pub coordinates: &'a Coordinates,
    pub best: &'a Minimum,
    pub uncertainty: &'a Uncertainty,
    pub search: Minimise,
    pub cost: F,
}

impl<F: Fn(&DVector<f64>) -> Local> Profile<'_, F> {
    /// Both ends for a coordinate; `None` where a search failed.
    pub fn interval(&self, index: usize) -> Option<[End; 2]> {
        Some([self.end(index, -1.0)?, self.end(index, 1.0)?])
    }

    fn end(&self, index: usize, side: f64) -> Option<End> {
        let centre = self.best.at[index];
        let [low, high] = self.coordinates.list.get(index)?.ends();
        let limit = if side < 0.0 { centre - low } else { high - centre };
        let (mut inside, mut outside) = ((0.0, 0.0), None::<(f64, f64)>);
        let mut x = (DEVIATE_95 * self.uncertainty.deviation(index)).min(limit);
        for _ in 0..SEARCHES {
            let deviate = self.deviate(index, side * x)?;
            if (deviate - DEVIATE_95).abs() < NEAR {
                return Some(End { at: centre + side * x, open: false });
            }
            if deviate < DEVIATE_95 {
                if x >= limit {
                    return Some(End { at: centre + side * limit, open: true });
                }
                inside = (x, deviate);
            } else {
                outside = Some((x, deviate));
            }
            x = match outside {
                Some((far, above)) => {
                    let share = (DEVIATE_95 - inside.1) / (above - inside.1);
                    inside.0 + share.clamp(0.05, 0.95) * (far - inside.0)
                }
                None => (x * (DEVIATE_95 / deviate.max(0.3)).clamp(1.05, 3.0)).min(limit),
            };
        }
        None
    }

    /// Root of twice the loss of ln likelihood when one coordinate is moved and the others are fitted again.
    fn deviate(&self, index: usize, offset: f64) -> Option<f64> {
        let covariance = &self.uncertainty.covariance;
        let follow = covariance.column(index) / covariance[(index, index)];
        let start = &self.best.at + follow * offset;
        let [mut lower, mut upper] = self.coordinates.bounds(&start);
        lower[index] = self.best.at[index] + offset;
        upper[index] = lower[index];
        let found = self.search.run(&start, [&lower, &upper], &self.cost);
        let loss = 2.0 * (found.local.value - self.best.local.value);
        loss.is_finite().then(|| loss.max(0.0).sqrt())
    }
}
