//! Covariance of the coordinates from the information, and what the data do not determine.
//!
//! The information, scaled to a unit diagonal, has the singular values that the result reports. A
//! direction whose singular value is a millionth of the largest, or less, is one that the data
//! do not determine: its coordinates have no standard deviation, only combinations across that direction have one.

use nalgebra::{DMatrix, DVector};

use super::coordinates::Coordinates;
use super::minimise::Local;

/// Relative singular value of a direction that the data do not determine.
const UNSEEN: f64 = 1e-6;
/// Share of a unit vector above which a coordinate takes part in a direction.
const TAKES_PART: f64 = 0.1;

/// Covariance of the coordinates, and what the data do not determine.
#[derive(Clone, Debug)]
pub(super) struct Uncertainty {
    /// In the search; zero for coordinates held by a bound and along directions that the data do not determine.
    pub covariance: DMatrix<f64>,
    /// Of the scaled information, largest first.
    pub singular_values: Vec<f64>,
    /// For each coordinate, whether a bound holds it.
    pub bounded: Vec<bool>,
    /// Groups of coordinates that act only together.
    pub together: Vec<Vec<usize>>,
    /// Coordinates with a standard deviation wider than their range.
    pub loose: Vec<usize>,
}

/// Standard deviations from the curvature of −ln p; none for an unknown without curvature, and for one that the data
/// determine only in combination with others.
pub(crate) fn deviations(curvature: &DMatrix<f64>) -> Vec<Option<f64>> {
    /// Beyond this an unknown is a difference of others within rounding.
    const MOST_INFLATION: f64 = 1e6;
    let scale: Vec<f64> = curvature.diagonal().iter().map(|bend| bend.max(0.0).sqrt()).collect();
    let bent: Vec<usize> = (0..scale.len()).filter(|&k| scale[k] > 0.0).collect();
    let unit = DMatrix::from_fn(bent.len(), bent.len(), |a, b| {
        curvature[(bent[a], bent[b])] / (scale[bent[a]] * scale[bent[b]])
    });
    let mut deviations = vec![None; scale.len()];
    let Some(inverse) = unit.try_inverse() else { return deviations };
    for (place, &k) in bent.iter().enumerate() {
        let variance = inverse[(place, place)];
        if (0.0..MOST_INFLATION).contains(&variance) {
            deviations[k] = Some(variance.sqrt() / scale[k]);
        }
    }
    deviations
}

/// Number of the directions that the data determine, from the curvature of −ln p and the range of each unknown: those of a
/// singular value beyond a millionth of the largest, of the unknowns that have less than their range as deviation.
pub(crate) fn determined(curvature: &DMatrix<f64>, ranges: &[f64]) -> usize {
    let bend = |k: usize| curvature[(k, k)];
    let seen: Vec<usize> =
        (0..ranges.len()).filter(|&k| bend(k) * ranges[k].powi(2) > 1.0).collect();
    let scaled = DMatrix::from_fn(seen.len(), seen.len(), |a, b| {
        curvature[(seen[a], seen[b])] / (bend(seen[a]) * bend(seen[b])).sqrt()
    });
    if scaled.iter().any(|entry| !entry.is_finite()) {
        return ranges.len();
    }
    if seen.is_empty() {
        return 0;
    }
    let values = scaled.symmetric_eigenvalues();
    values.iter().filter(|value| **value > UNSEEN * values.max()).count()
}

impl Uncertainty {
    /// Inverts the information at a point of the search.
    pub fn new(coordinates: &Coordinates, at: &DVector<f64>, information: &DMatrix<f64>) -> Self {
        let ends: Vec<[f64; 2]> = coordinates.list.iter().map(|c| c.ends()).collect();
        let bounded: Vec<bool> = (ends.iter().zip(at.iter()))
            .map(|([low, high], u)| u - low < 1e-9 || high - u < 1e-9)
            .collect();
        let free: Vec<usize> = (0..at.len()).filter(|&i| !bounded[i]).collect();
        // A coordinate that the data do not see at all must not be scaled up to one that they do.
        let scale: Vec<f64> = (free.iter())
            .map(|&i| information[(i, i)].max((ends[i][1] - ends[i][0]).powi(-2)).sqrt())
            .collect();
        let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            information[(free[a], free[b])] / (scale[a] * scale[b])
        });
        let mut found = Uncertainty {
            covariance: DMatrix::zeros(at.len(), at.len()),
            singular_values: Vec::new(),
            bounded,
            together: Vec::new(),
            loose: Vec::new(),
        };
        found.read(&free, &scale, scaled);
        for i in free {
            if found.deviation(i) > ends[i][1] - ends[i][0] {
                found.loose.push(i);
            }
        }
        found
    }

    fn read(&mut self, free: &[usize], scale: &[f64], scaled: DMatrix<f64>) {
        if free.is_empty() {
            return;
        }
        if scaled.iter().any(|entry| !entry.is_finite()) {
            // Overflow: nothing is known of any of them.
            self.together.extend(free.iter().map(|&index| vec![index]));
            return;
        }
        let eigen = scaled.symmetric_eigen();
        let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            self.singular_values.push(value.abs());
            if *value <= UNSEEN * largest {
                let parts = free.iter().zip(direction.iter());
                let parts = parts.filter(|(_, part)| part.abs() > TAKES_PART);
                self.together.push(parts.map(|(&i, _)| i).collect());
                continue;
            }
            for (a, &i) in free.iter().enumerate() {
                for (b, &j) in free.iter().enumerate() {
                    self.covariance[(i, j)] +=
                        direction[a] * direction[b] / (value * scale[a] * scale[b]);
                }
            }
        }
        self.singular_values.sort_by(|a, b| b.total_cmp(a));
    }

    /// Notes that each of some numbers changes the model only as another one does: the data determine neither.
    pub fn join(&mut self, redundant: &[[usize; 2]]) {
        for pair in redundant {
            let [number, _] = *pair;
            self.bounded[number] = false;
            let is_known = |group: &Vec<usize>| pair.iter().all(|index| group.contains(index));
            if self.together.iter().any(is_known) {
                continue;
            }
            match self.together.iter_mut().find(|group| group.contains(&pair[1])) {
                Some(group) => group.push(number),
                None => self.together.push(vec![pair[1], number]),
            }
            self.singular_values.push(0.0);
        }
    }

    /// Standard deviation of a coordinate in the search.
    pub fn deviation(&self, index: usize) -> f64 {
        self.covariance[(index, index)].max(0.0).sqrt()
    }

    /// Whether the data know a coordinate by itself.
    pub fn is_identified(&self, index: usize) -> bool {
        let apart = !self.together.iter().any(|group| group.contains(&index));
        apart && !self.bounded[index] && !self.loose.contains(&index)
    }
}

/// The observed information: the second derivatives of a cost, by differences of its gradient over
/// a tenth of a standard deviation.
pub(super) fn observed_information(
    coordinates: &Coordinates,
    at: &DVector<f64>,
    local: &Local,
    cost: impl Fn(&DVector<f64>) -> Local,
) -> DMatrix<f64> {
    let (lower, upper) = (coordinates.lower(), coordinates.upper());
    let mut information = DMatrix::zeros(at.len(), at.len());
    for index in 0..at.len() {
        let step = (0.1 / local.curvature[(index, index)].sqrt()).clamp(1e-5, 0.1);
        let [high, low] = [step, -step].map(|step| {
            let mut there = at.clone();
            there[index] = (at[index] + step).max(lower[index]).min(upper[index]);
            there
        });
        let change = cost(&high).gradient - cost(&low).gradient;
        information.set_column(index, &(change / (high[index] - low[index])));
    }
    0.5 * (&information + information.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_counts_where_the_data_determine_it() {
        let of = |rows: [[f64; 2]; 2], ranges: [f64; 2]| {
            determined(&DMatrix::from_fn(2, 2, |a, b| rows[a][b]), &ranges)
        };
        assert_eq!(of([[4.0, 0.0], [0.0, 9.0]], [1.0; 2]), 2);
        // The same change by either; wider than its range; held by its bounds.
        assert_eq!(of([[4.0, 6.0], [6.0, 9.0]], [1.0; 2]), 1);
        assert_eq!(of([[4.0, 0.0], [0.0, 0.5]], [1.0; 2]), 1);
        assert_eq!(of([[4.0, 0.0], [0.0, 9.0]], [1.0, 0.0]), 1);
        assert_eq!(of([[0.0; 2]; 2], [1.0; 2]), 0);
        // Where nothing is known of them, all count.
        assert_eq!(of([[4.0, f64::INFINITY], [f64::INFINITY, 9.0]], [1.0; 2]), 2);
    }
}
