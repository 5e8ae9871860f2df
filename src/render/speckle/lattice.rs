//! Speckle as a law: a Gaussian field over the focal surface with the beam's own correlation.
//!
//! Two beams of the waist w₀ that pass their foci d apart see amplitudes with the correlation exp(−d²/w₀²), however far
//! from the focus the surface lies, since their overlap does not change along the way. Convolving white noise with
//! exp(−2d²/w₀²), the amplitude of the two-way weight at the waist, gives just that.

use num_complex::Complex;
use rayon::prelude::*;

use super::identity::Identity;
use crate::radar::random::Purpose;

/// Distance beyond which the kernel is cut off, in waists: 0.6 % of its middle.
const REACH: f64 = 1.6;
/// Least nodes per waist. At two the field's power is the same at and between the nodes to 1e-4.
const NODES_PER_WAIST: f64 = 2.0;
/// Distances of nodes, m, are whole powers of this, so that a beam of nearly the same waist sees the same noise.
const SPACINGS: f64 = std::f64::consts::SQRT_2;
/// Most nodes of the kernel along an axis: a beam at least twenty times as wide as the narrowest one of its scan.
const MOST_NODES: f64 = 192.0;
/// Nodes on a side of a block, whose noise has one key.
const BLOCK: i64 = 32;
/// Most values of the lattices of a scan, 2 GiB.
const MOST_VALUES: f64 = 134_217_728.0;

/// Where a chirp's beam passes its focus, in the target frame, m, and its waist there, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    pub at_m: [f64; 2],
    pub waist_m: f64,
}

/// Complex noise of unit variance on a square lattice, one value per look at each node.
pub(super) struct Lattice {
    spacing_m: f64,
    /// Node of the lower left corner, counted from the origin of the target plane.
    first: [i64; 2],
    /// Nodes along x and y.
    size: [usize; 2],
    looks: usize,
    values: Vec<Complex<f64>>,
}

/// The nodes of a lattice under some aims.
struct Extent {
    spacing_m: f64,
    /// First and last node along each axis.
    ends: [[f64; 2]; 2],
    /// Number of nodes along each axis.
    sides: [f64; 2],
}

impl Extent {
    /// `None` where beams are so unlike that a kernel has more nodes than one holds.
    fn of(aims: &[Aim]) -> Option<Extent> {
        let waists_m = aims.iter().map(|aim| aim.waist_m);
        let least_m = waists_m.clone().fold(f64::INFINITY, f64::min);
        let spacing_m = SPACINGS.powf((least_m / NODES_PER_WAIST).log(SPACINGS).floor());
        let widest_nodes = 2.0 * REACH * waists_m.fold(0.0, f64::max) / spacing_m + 1.0;
        if widest_nodes.is_nan() || widest_nodes > MOST_NODES {
            return None;
        }
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for Aim { at_m, waist_m } in aims {
            for (end, at_m) in ends.iter_mut().zip(at_m) {
                let reach = [at_m - REACH * waist_m, at_m + REACH * waist_m];
                let [low, high] = reach.map(|m| (m / spacing_m).floor());
                *end = [end[0].min(low), end[1].max(high + 1.0)];
            }
        }
        Some(Extent { spacing_m, ends, sides: ends.map(|[low, high]| high - low + 1.0) })
    }

    /// Whether so many values per node are no more than memory should hold. A side that is no number is too large.
    fn fits(&self, values_per_node: f64) -> bool {
        self.sides[0] * self.sides[1] * values_per_node <= MOST_VALUES
    }
}

impl Lattice {
    /// Whether memory should hold so many lattices under all aims at once.
    pub fn fits(aims: &[Aim], looks: usize, layers: usize) -> bool {
        Extent::of(aims).is_some_and(|extent| extent.fits(looks as f64 * layers as f64))
    }

    /// The lattice under all aims; `None` where it would be larger than memory should hold, or where the widest beam is
    /// more than some twenty times as wide as the narrowest.
    pub fn new(aims: &[Aim], identity: Identity, looks: usize) -> Option<Lattice> {
        let extent = Extent::of(aims).filter(|extent| extent.fits(looks as f64))?;
        let Extent { spacing_m, ends, sides } = extent;
        let (first, size) = (ends.map(|end| end[0] as i64), sides.map(|side| side as usize));
        let mut lattice = Lattice { spacing_m, first, size, looks, values: Vec::new() };
        lattice.fill(identity);
        Some(lattice)
    }

    /// Draws the noise of every block, which is the same whatever else the lattice covers.
    fn fill(&mut self, identity: Identity) {
        let [width, height] = self.size.map(|size| size as i64);
        let [left, low] = self.first;
        let columns = left.div_euclid(BLOCK)..=(left + width - 1).div_euclid(BLOCK);
        let row_length = width as usize * self.looks;
        let mut values = vec![Complex::ZERO; row_length * height as usize];
        // Rows of blocks begin at multiples of a block; the first may be cut.
        let cut = (BLOCK - low.rem_euclid(BLOCK)).min(height) as usize * row_length;
        let (top, rest) = values.split_at_mut(cut);
        let mut bands: Vec<&mut [Complex<f64>]> = vec![top];
        bands.extend(rest.chunks_mut(row_length * BLOCK as usize));
        bands.into_par_iter().enumerate().for_each(|(number, band)| {
            let row = low.div_euclid(BLOCK) + number as i64;
            let from = (low - row * BLOCK).max(0);
            let rows = (band.len() / row_length) as i64;
            for column in columns.clone() {
                for look in 0..self.looks {
                    let mut draws = identity.draws(Purpose::Scatterers, [column, row], look);
                    for place in 0..BLOCK * BLOCK {
                        let value = draws.complex_gaussian();
                        let x = column * BLOCK + place % BLOCK - left;
                        let y = place / BLOCK - from;
                        if (0..width).contains(&x) && (0..rows).contains(&y) {
                            band[(y * width + x) as usize * self.looks + look] = value;
                        }
                    }
                }
            }
        });
        self.values = values;
    }

    /// Replaces `amplitudes` by the field at an aim, one value of unit variance per look.
    pub fn amplitudes(&self, aim: &Aim, amplitudes: &mut Vec<Complex<f64>>) {
        amplitudes.clear();
        amplitudes.resize(self.looks, Complex::ZERO);
        let [across, along] = [0, 1].map(|axis| self.weights(aim, axis));
        for (look, sum) in amplitudes.iter_mut().enumerate() {
            for (row, y_weight) in (along.first..).zip(&along.values) {
                let start = (row * self.size[0] + across.first) * self.looks + look;
                let nodes = self.values[start..].iter().step_by(self.looks);
                let of_row: Complex<f64> =
                    across.values.iter().zip(nodes).map(|(weight, node)| weight * node).sum();
                *sum += y_weight * of_row;
            }
        }
        let norm = 1.0 / (across.square_sum() * along.square_sum()).sqrt();
        amplitudes.iter_mut().for_each(|amplitude| *amplitude *= norm);
    }

    /// The kernel exp(−2d²/w₀²) at the nodes along one axis.
    fn weights(&self, aim: &Aim, axis: usize) -> Weights {
        let (at_m, reach_m) = (aim.at_m[axis], REACH * aim.waist_m);
        let low = ((at_m - reach_m) / self.spacing_m).ceil();
        let high = ((at_m + reach_m) / self.spacing_m).floor();
        // From node to node a Gaussian changes by a ratio, and the ratio by the same factor each time.
        let (off, step) =
            ((low * self.spacing_m - at_m) / aim.waist_m, self.spacing_m / aim.waist_m);
        let mut weight = (-2.0 * off * off).exp();
        let mut ratio = (-2.0 * step * (2.0 * off + step)).exp();
        let factor = (-4.0 * step * step).exp();
        let count = (high - low) as usize + 1;
        let mut values = Vec::with_capacity(count);
        for _ in 0..count {
            values.push(weight);
            weight *= ratio;
            ratio *= factor;
        }
        Weights { first: (low as i64 - self.first[axis]) as usize, values }
    }
}

/// Weights of the nodes along an axis.
struct Weights {
    /// Number of the first node along the axis.
    first: usize,
    values: Vec<f64>,
}

impl Weights {
    fn square_sum(&self) -> f64 {
        self.values.iter().map(|weight| weight * weight).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIST_M: f64 = 0.0136;

    fn aim(x_m: f64, y_m: f64) -> Aim {
        Aim { at_m: [x_m, y_m], waist_m: WAIST_M }
    }

    fn identity(surface: u64) -> Identity {
        Identity { seed: 7, surface }
    }

    /// The field at an aim, of a lattice under some aims.
    fn field(lattice: &Lattice, aim: &Aim) -> Vec<Complex<f64>> {
        let mut amplitudes = Vec::new();
        lattice.amplitudes(aim, &mut amplitudes);
        amplitudes
    }

    #[test]
    fn amplitudes_of_beams_d_apart_have_the_correlation_of_the_beams() {
        let shares = [0.0, 0.3, 0.7, 1.0, 1.5];
        let pairs: Vec<[Aim; 2]> = (0..40)
            .flat_map(|i| (0..40).map(move |j| [0.07 * f64::from(i), 0.067 * f64::from(j)]))
            .flat_map(|[x, y]| shares.map(|share| [aim(x, y), aim(x + share * WAIST_M, y)]))
            .collect();
        let all: Vec<Aim> = pairs.iter().flatten().copied().collect();
        let lattice = Lattice::new(&all, identity(1), 2).unwrap();
        for (place, share) in shares.iter().enumerate() {
            let (mut found, mut count) = (Complex::ZERO, 0.0);
            for pair in pairs.iter().skip(place).step_by(shares.len()) {
                let [a, b] = [field(&lattice, &pair[0]), field(&lattice, &pair[1])];
                found += std::iter::zip(a, b).map(|(a, b)| a * b.conj()).sum::<Complex<f64>>();
                count += 2.0;
            }
            let (found, expected) = (found / count, (-share * share).exp());
            assert!((found - expected).norm() < 4.0 / f64::sqrt(count), "{share}: {found}");
        }
    }

    #[test]
    fn the_field_is_the_surface_s_and_not_the_scan_s() {
        let (near, far) = (aim(0.013, -0.021), aim(0.9, 0.8));
        let small = Lattice::new(&[near], identity(1), 3).unwrap();
        let large = Lattice::new(&[near, far, aim(-0.7, -0.4)], identity(1), 3).unwrap();
        assert_eq!(field(&small, &near), field(&large, &near));
        let other = Lattice::new(&[near], identity(2), 3).unwrap();
        assert_ne!(field(&small, &near), field(&other, &near));
    }

    #[test]
    fn a_lattice_beyond_memory_is_none() {
        assert!(Lattice::new(&[aim(0.0, 0.0), aim(1e4, 1e4)], identity(1), 1).is_none());
        assert!(Lattice::new(&[aim(0.0, 0.0), aim(1e300, 0.0)], identity(1), 1).is_none());
        // 11 thousand nodes squared are within the bound once and above it twice.
        let aims = [aim(0.0, 0.0), aim(60.0, 60.0)];
        assert!(Lattice::fits(&aims, 1, 1) && !Lattice::fits(&aims, 1, 2));
        assert!(!Lattice::fits(&aims, 2, 1) && !Lattice::fits(&aims, 1, usize::MAX));
    }

    #[test]
    fn beams_that_a_kernel_would_cut_off_are_none() {
        let of = |ratio: f64| {
            let wide = Aim { at_m: [0.0; 2], waist_m: ratio * WAIST_M };
            Lattice::new(&[aim(0.0, 0.0), wide], identity(1), 1)
        };
        assert!(of(19.0).is_some());
        assert!(of(25.0).is_none());
        assert!(of(f64::NAN).is_none() || of(f64::INFINITY).is_none());
    }
}
