//! Least squares of levels at exact angles by the sums that they enter: the cost of a fit then does not depend on their number.
//!
//! A level y at an angle is compared with w·t, the interpolated table t of the law. Σ(w·t − y)² is a quadratic form in t, whose
//! matrix Σw·wᵀ couples knots at most three apart. Levels and table count from a reference, so that little cancels.

use super::table::{Place, Table};

/// Knots that one place joins, and so the diagonals of the matrix on one side.
const JOINED: usize = 4;

/// Σ over levels of what least squares needs.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// The table that all counts from.
    reference: Table,
    /// Σ w·wᵀ: for each knot its products with itself and the three after it.
    products: Vec<[f64; JOINED]>,
    /// Σ w·y and Σ y², with y over the reference.
    by_level: Vec<f64>,
    squares: f64,
}

impl Moments {
    /// Sums over places and ln σ⁰ there.
    pub fn new<'p>(reference: Table, levels: impl Iterator<Item = (&'p Place, f64)>) -> Moments {
        let knots = reference.values().len();
        let (mut products, mut by_level) = (vec![[0.0; JOINED]; knots], vec![0.0; knots]);
        let mut squares = 0.0;
        for (place, level) in levels {
            let over = level - reference.at(place);
            squares += over * over;
            for (knot, weight) in place.terms() {
                by_level[knot] += weight * over;
                for (other, of_other) in place.terms().filter(|(other, _)| *other >= knot) {
                    products[knot][other - knot] += weight * of_other;
                }
            }
        }
        Moments { reference, products, by_level, squares }
    }

    /// Σ of squared differences between a table and the levels, and Σ w·(w·t − y), the slope of half of it by every knot.
    pub fn squares_and_slopes(&self, table: &Table) -> (f64, Vec<f64>) {
        let pairs = table.values().iter().zip(self.reference.values());
        let over: Vec<f64> = pairs.map(|(value, reference)| value - reference).collect();
        let mut slopes = self.times(&over);
        let both = dot(&over, &slopes) - 2.0 * dot(&over, &self.by_level);
        slopes.iter_mut().zip(&self.by_level).for_each(|(slope, level)| *slope -= level);
        ((self.squares + both).max(0.0), slopes)
    }

    /// Σ w·(w·t) of a table that counts from nothing, such as a derivative.
    pub fn times(&self, table: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; table.len()];
        for (knot, products) in self.products.iter().enumerate() {
            sums[knot] += products[0] * table[knot];
            for (apart, product) in products.iter().enumerate().skip(1) {
                if let Some(&other) = table.get(knot + apart) {
                    sums[knot] += product * other;
                    sums[knot + apart] += product * table[knot];
                }
            }
        }
        sums
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::table::Aspects;
    use super::super::twin::mixture;
    use super::*;

    #[test]
    fn sums_over_knots_are_those_over_levels() {
        let table = |m, alpha| Table::new(&mixture(m, alpha, 0.05, 0.002), 0.0, Aspects::knots());
        let (reference, law) = (table(0.05, 6.0), table(0.07, 4.0));
        // The first cell's knots are mirrored, and the last angles are beyond the last knot.
        let angles = (0..700).map(|step| 0.0023 * f64::from(step));
        let levels: Vec<(Place, f64)> = angles
            .map(|theta| (Place::new(theta), reference.at(&Place::new(theta)) + theta.sin()))
            .collect();
        let moments = Moments::new(reference, levels.iter().map(|(place, y)| (place, *y)));
        let off: Vec<f64> = levels.iter().map(|(place, y)| law.at(place) - y).collect();
        let squares: f64 = off.iter().map(|x| x * x).sum();
        let (found, found_slopes) = moments.squares_and_slopes(&law);
        assert!((found / squares - 1.0).abs() < 1e-9);
        let mut slopes = vec![0.0; law.values().len()];
        for ((place, _), off) in levels.iter().zip(&off) {
            place.terms().for_each(|(knot, weight)| slopes[knot] += weight * off);
        }
        for (knot, (found, slope)) in found_slopes.iter().zip(&slopes).enumerate() {
            assert!((found - slope).abs() < 1e-9, "{knot}: {found} {slope}");
        }
    }
}
