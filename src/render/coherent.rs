//! The coherent part of an echo where the spot reaches beyond the smooth piece of surface that reflects it.
//!
//! A mirror returns one wave, whose amplitude is the integral of the beam's irradiance u over the mirror. A
//! mean over rays drawn from u² adds up powers: of a plate that ends in the middle of the spot it leaves a half where the
//! wave keeps half of its amplitude, a quarter. With a the share of u on the piece and b that of u², the coherent power is a²/b of
//! what the rays say. Rays count by how much they return, so that the edge of what returns nothing, as beside the
//! glint of a sphere, changes nothing.

use glam::DVec3;
use rayon::prelude::*;

use super::path::Path;
use crate::geometry::Mesh;

/// Smallest cosine between the normals of neighbours of one piece, of 30°: curved surfaces have facets, and edges are
/// sharper.
pub(super) const SMOOTH: f64 = 0.866;
/// Rays of a piece that rays beside it are compared with.
const COMPARED: usize = 64;

/// Distance, m, below which two corners, or two parallel planes, are one.
const ONE_M: f64 = 1e-6;
/// Difference between the components of unit normals below which they are one: 1 mm at 1 m.
const ONE_NORMAL: f64 = 1e-3;

/// The smooth piece that each facet belongs to: facets of one region that are joined by edges without a kink, or that
/// lie in one plane, whose echoes have one phase whether they touch or not.
pub(super) fn smooth_pieces(mesh: &Mesh, region_of_facet: &[u16]) -> Vec<u32> {
    let facets = mesh.facets.len();
    let unit = |facet: u32| mesh.area_normal(facet as usize).normalize_or_zero();
    let mut sides: Vec<([[i64; 3]; 2], u32)> = Vec::with_capacity(3 * facets);
    for facet in 0..facets {
        let corners = mesh.corners(facet).map(|corner| rounded(corner, ONE_M));
        for side in 0..3 {
            let (a, b) = (corners[side], corners[(side + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], facet as u32));
        }
    }
    sides.par_sort_unstable();
    let mut pieces = Pieces { parent: (0..facets as u32).collect() };
    for pair in sides.windows(2) {
        let [(side, a), (other, b)] = pair else { continue };
        let region = |facet: u32| region_of_facet[facet as usize];
        if side == other && region(*a) == region(*b) && unit(*a).dot(unit(*b)).abs() > SMOOTH {
            pieces.join(*a, *b);
        }
    }
    let mut planes: Vec<(Plane, u32)> =
        (0..facets as u32).into_par_iter().map(|facet| (plane(mesh, facet), facet)).collect();
    planes.par_sort_unstable();
    for pair in planes.windows(2) {
        let [(plane, a), (other, b)] = pair else { continue };
        if plane == other && region_of_facet[*a as usize] == region_of_facet[*b as usize] {
            pieces.join(*a, *b);
        }
    }
    (0..facets as u32).map(|facet| pieces.root(facet)).collect()
}

/// Coordinates in steps: meshes repeat their vertices, and programs round them.
fn rounded(place: DVec3, step: f64) -> [i64; 3] {
    place.to_array().map(|x| (x / step).round() as i64)
}

/// A plane by its normal and its distance from the origin, in steps.
type Plane = ([i64; 3], i64);

fn plane(mesh: &Mesh, facet: u32) -> Plane {
    let normal = mesh.area_normal(facet as usize).normalize_or_zero();
    let (steps, corner) = (rounded(normal, ONE_NORMAL), mesh.corners(facet as usize)[0]);
    // Which side is outside does not matter.
    let first = steps.into_iter().find(|&step| step != 0).unwrap_or(0);
    let distance = (normal.dot(corner) / ONE_M).round() as i64;
    if first < 0 { (steps.map(|step| -step), -distance) } else { (steps, distance) }
}

/// Disjoint sets of facets.
struct Pieces {
    parent: Vec<u32>,
}

impl Pieces {
    fn root(&mut self, mut facet: u32) -> u32 {
        while self.parent[facet as usize] != facet {
            let up = self.parent[self.parent[facet as usize] as usize];
            self.parent[facet as usize] = up;
            facet = up;
        }
        facet
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

/// A single path of a ray of a spot.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayPath {
    /// Number of the ray in its spot.
    pub ray: usize,
    /// Its place in the list of paths.
    pub place: usize,
}

/// Rays of a spot as they lie in it.
#[derive(Clone, Copy)]
pub(super) struct SpotRays<'a> {
    /// Places in the spot, in radii of the beam.
    pub places: &'a [glam::DVec2],
    /// Share of the sent power on each, one way.
    pub lit_shares: &'a [f64],
}

impl SpotRays<'_> {
    /// Gives the coherent parts of the single paths of a chirp the power of the waves of their pieces.
    pub fn cut_waves(&self, direct: &[RayPath], paths: &mut [Path]) {
        // A ray that returns no wave is on its piece all the same.
        let mut left = direct.to_vec();
        while let Some(first) = left.first() {
            let (pieces, sheets) = (paths[first.place].pieces, paths[first.place].sheets);
            let is_here = |ray: &RayPath| {
                paths[ray.place].pieces == pieces && paths[ray.place].sheets == sheets
            };
            let (here, others) = left.iter().copied().partition::<Vec<_>, _>(is_here);
            let is_wave = here.iter().any(|ray| paths[ray.place].coherent_w() > 0.0);
            if is_wave && here.len() < self.places.len() {
                let ratio = self.wave_over_rays(&here, paths);
                for ray in &here {
                    paths[ray.place].scale_coherent(ratio);
                }
            }
            left = others;
        }
    }

    /// a²/b of a piece.
    fn wave_over_rays(&self, here: &[RayPath], paths: &[Path]) -> f64 {
        let level = |ray: &RayPath| paths[ray.place].coherent_w();
        let mut is_here = vec![false; self.places.len()];
        here.iter().for_each(|ray| is_here[ray.ray] = true);
        let compared: Vec<&RayPath> =
            here.iter().step_by(here.len().div_ceil(COMPARED).max(1)).collect();
        let (mut seen, mut missed) = ([0.0; 2], [0.0; 2]);
        for ray in here {
            let shares = [self.lit_shares[ray.ray], 1.0].map(|share| share * level(ray));
            (0..2).for_each(|i| seen[i] += shares[i]);
        }
        for ray in (0..self.places.len()).filter(|&ray| !is_here[ray]) {
            // What the piece would return there, were it larger: as much as where it is nearest.
            let distance =
                |other: &RayPath| self.places[ray].distance_squared(self.places[other.ray]);
            let nearest = compared.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let there = nearest.map_or(0.0, |nearest| level(nearest));
            let shares = [self.lit_shares[ray], 1.0].map(|share| share * there);
            (0..2).for_each(|i| missed[i] += shares[i]);
        }
        let [a, b] = [0, 1].map(|i| seen[i] / (seen[i] + missed[i]));
        // Powers near the smallest number leave none.
        if a > 0.0 && b > 0.0 { a * a / b } else { 1.0 }
    }
}

impl Path {
    /// Power of its coherent part, W.
    fn coherent_w(&self) -> f64 {
        self.power_w * self.coherent_share
    }

    /// Multiplies the power of its coherent part.
    fn scale_coherent(&mut self, ratio: f64) {
        let coherent_w = self.coherent_w();
        let power_w = self.power_w + (ratio - 1.0) * coherent_w;
        self.coherent_share = if power_w > 0.0 { ratio * coherent_w / power_w } else { 0.0 };
        self.power_w = power_w;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::solids;

    #[test]
    fn a_sphere_is_one_piece_and_a_box_six() {
        let count = |mesh: &Mesh| {
            let regions = vec![0; mesh.facets.len()];
            let mut pieces = smooth_pieces(mesh, &regions);
            pieces.sort_unstable();
            pieces.dedup();
            pieces.len()
        };
        assert_eq!(count(&solids::icosphere(0.1, 3)), 1);
        assert_eq!(count(&solids::cuboid(glam::DVec3::ONE, 0.2)), 6);
        // Two halves of a plate of different materials are two mirrors.
        let plate = solids::plate(1.0, 1.0);
        assert_eq!(smooth_pieces(&plate, &[0, 1]), [0, 1]);
        assert_eq!(smooth_pieces(&plate, &[0, 0]), [0, 0]);
        // A second plate in the same plane, turned over, is a part of the same mirror; one behind it is another one.
        for (offset_m, expected) in [(0.0, [0, 0, 0, 0]), (-0.001, [0, 0, 2, 2])] {
            let mut beside = plate.clone();
            beside.vertices.iter_mut().for_each(|v| *v += glam::DVec3::new(3.0, 1e-12, offset_m));
            beside.facets.iter_mut().for_each(|facet| facet.reverse());
            let mut both = plate.clone();
            both.append(&beside).unwrap();
            assert_eq!(smooth_pieces(&both, &[0; 4]), expected, "{offset_m}");
        }
    }
}
