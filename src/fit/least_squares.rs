//! Least squares in decibels: the paper's fits, kept for comparison.
//!
//! They use detections only and treat speckle as a symmetric error, so that a curve cut at a
//! threshold flattens their tail, and their level is 10/ln 10·(ln L − ψ(L)) dB too low.
//!
//! - Piecewise MSE: the specular coordinates on θ below a split, frozen, then the diffuse ones on the
//!   rest. A model that is not a mixture has no pieces: all rows, all coordinates.
//! - TLS, the orthogonal distance: Σ ((y − f(θ + δ))/s_y)² + (δ/s_θ)², least over each row's δ. At that
//!   least δ = −g·r·s_θ with r the scaled residual and g = f′·s_θ/s_y, so the row costs r²(1 + g²) and
//!   is one residual r√(1 + g²) with the gradient ∂r/∂p/√(1 + g²) (Boggs, Byrd & Schnabel 1987,
//!   DOI 10.1137/0908085, with δ eliminated).

use nalgebra::DVector;
use rayon::prelude::*;

use super::coordinates::Coordinates;
use super::minimise::Local;
use super::moments::{Moments, dot};
use super::sensitivity::derivatives;
use super::table::{Aspects, Place, Table};
use crate::material::Observation;
use crate::units::db_from_ratio;

const DB_PER_NEPER: f64 = 10.0 / std::f64::consts::LN_10;
/// Rows that one task sums, fixed so that the sum is the same on any number of threads.
const CHUNK: usize = 256;

/// Standard deviations of both axes; an angle of 0 is exact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deviations {
    pub theta_sd_rad: f64,
    pub level_sd_db: f64,
}

/// A curve prepared for many evaluations.
#[derive(Clone, Debug)]
pub(super) struct Squares<'a> {
    coordinates: &'a Coordinates,
    deviations: Deviations,
    sums: Sums,
}

/// The detected rows, or all that counts of them.
#[derive(Clone, Debug)]
enum Sums {
    /// Where angles are exact.
    Moments(Moments),
    /// `None` for a censored row, which keeps its place so that the chunks of the sum do not change.
    Levels(Vec<Option<Level>>),
}

/// A detected row.
#[derive(Clone, Copy, Debug)]
struct Level {
    theta_rad: f64,
    level_db: f64,
    /// The place of its own angle, and the weights of the second derivative there.
    place: Place,
    bends: [f64; 4],
}

impl<'a> Squares<'a> {
    /// Prepares the rows.
    pub fn new(
        coordinates: &'a Coordinates,
        rows: &[Observation],
        deviations: Deviations,
    ) -> Squares<'a> {
        let levels: Vec<Option<Level>> = rows.iter().map(Level::new).collect();
        let sums = if deviations.theta_sd_rad > 0.0 {
            Sums::Levels(levels)
        } else {
            let reference = coordinates.table(&coordinates.start(), Aspects::knots());
            let detected = levels.iter().flatten();
            let levels = detected.map(|level| (&level.place, level.level_db / DB_PER_NEPER));
            Sums::Moments(Moments::new(reference, levels))
        };
        Squares { coordinates, deviations, sums }
    }

    /// ½Σ of squared residuals of detected rows, scaled by the deviations.
    pub fn local(&self, at: &DVector<f64>) -> Local {
        let table = self.coordinates.table(at, Aspects::knots());
        let by_coordinate = derivatives(self.coordinates, at, Aspects::knots(), &table);
        match &self.sums {
            Sums::Moments(moments) => self.sum_of_all(moments, &table, &by_coordinate),
            Sums::Levels(levels) => {
                let parts = levels.par_chunks(CHUNK);
                let parts = parts.map(|levels| self.sum_of(levels, &table, &by_coordinate));
                let parts: Vec<Local> = parts.collect();
                parts.into_iter().fold(Local::zero(at.len()), Local::merge)
            }
        }
    }

    /// Of levels at exact angles.
    fn sum_of_all(
        &self,
        moments: &Moments,
        table: &Table,
        by_coordinate: &[Option<Table>],
    ) -> Local {
        let scale = (DB_PER_NEPER / self.deviations.level_sd_db).powi(2);
        let mut sum = Local::zero(by_coordinate.len());
        let (squares, slopes) = moments.squares_and_slopes(table);
        sum.value = 0.5 * scale * squares;
        for (row, by_row) in by_coordinate.iter().enumerate() {
            let Some(by_row) = by_row else { continue };
            sum.gradient[row] = scale * dot(&slopes, by_row.values());
            let products = moments.times(by_row.values());
            for (column, by_column) in by_coordinate.iter().enumerate() {
                let product =
                    by_column.as_ref().map_or(0.0, |other| dot(&products, other.values()));
                sum.curvature[(row, column)] = scale * product;
            }
        }
        sum
    }

    fn sum_of(
        &self,
        levels: &[Option<Level>],
        table: &Table,
        by_coordinate: &[Option<Table>],
    ) -> Local {
        let unknowns = by_coordinate.len();
        let (mut sum, mut jacobian) = (Local::zero(unknowns), vec![0.0; unknowns]);
        for level in levels.iter().flatten() {
            let nearest = Gap { table, level, deviations: self.deviations }.nearest();
            let stretch = nearest.gain.hypot(1.0);
            for (slot, table) in jacobian.iter_mut().zip(by_coordinate) {
                let slope = table.as_ref().map_or(0.0, |table| table.at(&nearest.place));
                *slot = DB_PER_NEPER * slope / self.deviations.level_sd_db / stretch;
            }
            // Unlike r²(1 + g²)/2 this is not moved by a small error of δ.
            sum.value += 0.5 * nearest.cost();
            sum.add(nearest.residual * stretch, 1.0, &jacobian);
        }
        sum
    }
}

impl Level {
    /// `None` for a censored row.
    fn new(row: &Observation) -> Option<Level> {
        let level_db = db_from_ratio(row.sigma0.filter(|_| !row.is_censored())?);
        let (place, bends) = Place::bending(row.theta_i_rad);
        Some(Level { theta_rad: row.theta_i_rad, level_db, place, bends })
    }
}

/// A row and the curve of a model.
struct Gap<'a> {
    table: &'a Table,
    level: &'a Level,
    deviations: Deviations,
}

/// A point of the curve, as a row sees it.
struct Nearest {
    place: Place,
    /// δ/s_θ.
    offset: f64,
    /// (f − y)/s_y there.
    residual: f64,
    /// f′·s_θ/s_y there.
    gain: f64,
    /// f″·s_θ²/s_y there.
    bend: f64,
}

impl Nearest {
    /// Squared distance of the row from this point.
    fn cost(&self) -> f64 {
        self.residual.powi(2) + self.offset.powi(2)
    }
}

/// Most candidates for δ on either side of 0, and their distance, in standard deviations.
const CANDIDATES: i32 = 12;
const APART: f64 = 1.0 / 3.0;
/// Most Newton steps, of which a handful suffices, and the change of the offset that ends them, in standard
/// deviations.
const STEPS: usize = 30;
const NEAR: f64 = 1e-8;

impl Gap<'_> {
    /// The point of the curve that the row is nearest to.
    fn nearest(&self) -> Nearest {
        let mut best = self.there(0.0, self.level.place, &self.level.bends);
        if self.deviations.theta_sd_rad <= 0.0 {
            return best;
        }
        let mut least = best.residual.powi(2);
        // An offset beyond the residual costs more by itself than none does.
        let beyond = (best.residual.abs() / APART).min(f64::from(CANDIDATES)) as i32 + 2;
        let costs: Vec<f64> = (-beyond..=beyond).map(|c| self.at(offset(c)).cost()).collect();
        // Every valley is followed to its floor: the deepest candidate need not lead to the deepest one.
        for (candidate, around) in (1 - beyond..).zip(costs.windows(3)) {
            if around[1] <= around[0] && around[1] <= around[2] {
                let found = self.descend(offset(candidate), around[1]);
                let there = found.cost();
                if there <= least {
                    (best, least) = (found, there);
                }
            }
        }
        best
    }

    /// The floor of the valley around an offset of known cost, by damped Newton steps.
    fn descend(&self, offset: f64, cost: f64) -> Nearest {
        let (mut best, mut least, mut length) = (self.at(offset), cost, 1.0f64);
        for _ in 0..STEPS {
            // Halves of the first two derivatives of the cost by the offset; where the second one is negative,
            // without the term that makes it so.
            let slope = best.residual * best.gain + best.offset;
            let stiff = 1.0 + best.gain.powi(2);
            let bend = stiff + best.residual * best.bend;
            let newton = -slope / if bend > 0.0 { bend } else { stiff };
            if newton.abs() < NEAR || length < 1e-6 {
                break;
            }
            let next = self.at(best.offset + length * newton);
            let there = next.cost();
            if there < least {
                (best, least) = (next, there);
                length = (2.0 * length).min(1.0);
            } else {
                length *= 0.5;
            }
        }
        best
    }

    /// The point at an offset of the angle, in standard deviations.
    fn at(&self, offset: f64) -> Nearest {
        let theta_rad = self.level.theta_rad + offset * self.deviations.theta_sd_rad;
        let (place, bends) = Place::bending(theta_rad);
        self.there(offset, place, &bends)
    }

    fn there(&self, offset: f64, place: Place, bends: &[f64; 4]) -> Nearest {
        let Deviations { theta_sd_rad, level_sd_db } = self.deviations;
        let residual = (DB_PER_NEPER * self.table.at(&place) - self.level.level_db) / level_sd_db;
        let scale = DB_PER_NEPER * theta_sd_rad / level_sd_db;
        let gain = scale * self.table.slope_per_rad(&place);
        let bend = scale * theta_sd_rad * self.table.weighted(&place, bends);
        Nearest { place, offset, residual, gain, bend }
    }
}

/// The offset of a candidate, in standard deviations.
fn offset(candidate: i32) -> f64 {
    APART * f64::from(candidate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::twin::{Twin, mixture};

    const TLS: Deviations = Deviations { theta_sd_rad: 0.03, level_sd_db: 3.0 };

    #[test]
    fn the_gradient_is_that_of_the_value() {
        let start = mixture(0.06, 4.0, 0.04, 0.003);
        let coordinates = Coordinates::new(&start, &[], &[], Some(1.0)).unwrap();
        let curve = Twin { rows: 200, ..Twin::default() }.curve(1);
        for deviations in [TLS, Deviations { theta_sd_rad: 0.0, ..TLS }] {
            let at = coordinates.start();
            let squares = Squares::new(&coordinates, &curve.observations, deviations);
            let cost = |at: &DVector<f64>| squares.local(at);
            for index in 0..at.len() {
                let value = |step: f64| {
                    let mut there = at.clone();
                    there[index] += step;
                    cost(&there).value
                };
                let slope = (value(1e-5) - value(-1e-5)) / 2e-5;
                let found = cost(&at).gradient[index];
                let gap = (found - slope).abs();
                assert!(
                    gap < 1e-3 * (1.0 + slope.abs()),
                    "{index} {deviations:?}: {found} {slope}"
                );
            }
        }
    }

    #[test]
    fn the_nearest_point_is_nearer_than_its_neighbours() {
        let table = Table::new(&mixture(0.05, 6.0, 0.05, 0.002), 0.0, Aspects::knots());
        for row in (Twin { rows: 100, ..Twin::default() }).curve(3).observations {
            let Some(level) = Level::new(&row) else { continue };
            let cost = Gap { table: &table, level: &level, deviations: TLS }.nearest().cost();
            for step in -400..=400 {
                let offset = f64::from(step) / 100.0;
                let theta_rad = level.theta_rad + offset * TLS.theta_sd_rad;
                let level_db = DB_PER_NEPER * table.at(&Place::new(theta_rad));
                let gap = (level_db - level.level_db) / TLS.level_sd_db;
                // A second valley between the candidates could be deeper by a little.
                assert!(cost <= gap * gap + offset * offset + 1e-3, "{level:?} {offset}");
            }
        }
    }
}
