//! Where scatterers lie on a mesh: evenly by area, whatever its facets.

use glam::DVec3;
use rayon::prelude::*;

use super::identity::Identity;
use crate::geometry::Mesh;
use crate::radar::random::{Draws, Purpose};

/// Scatterers whose places have one key.
const BLOCK: usize = 1024;

/// A place on a facet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Site {
    /// Number of the scatterer.
    pub number: usize,
    pub facet: u32,
    pub point: DVec3,
}

/// The facets of a mesh in an order that keeps neighbours together, and the area up to each.
pub(super) struct Placement<'a> {
    mesh: &'a Mesh,
    facets: Vec<u32>,
    /// Area of all facets up to and with each, m².
    area_m2: Vec<f64>,
    /// Number of scatterers.
    pub count: usize,
}

impl<'a> Placement<'a> {
    /// One scatterer for every square of this side, m.
    pub fn new(mesh: &'a Mesh, spacing_m: f64) -> Placement<'a> {
        let facets = along_curve(mesh);
        let mut total_m2 = 0.0;
        let area_m2 = facets.iter().map(|&facet| {
            total_m2 += 0.5 * mesh.area_normal(facet as usize).length();
            total_m2
        });
        let area_m2: Vec<f64> = area_m2.collect();
        let count = (total_m2 / (spacing_m * spacing_m)).ceil() as usize;
        Placement { mesh, facets, area_m2, count }
    }

    /// The places that `keep` accepts. The area is divided alike, and each part has one scatterer, anywhere in it.
    pub fn sites(&self, identity: Identity, keep: impl Fn(&Site) -> bool + Sync) -> Vec<Site> {
        let blocks = (0..self.count.div_ceil(BLOCK)).into_par_iter();
        let keep = &keep;
        let sites = blocks.flat_map_iter(|block| {
            let mut draws = identity.draws(Purpose::Placement, [block as i64, 0], 0);
            let numbers = block * BLOCK..((block + 1) * BLOCK).min(self.count);
            numbers.map(move |number| self.site(number, &mut draws)).filter(keep)
        });
        sites.collect()
    }

    fn site(&self, number: usize, draws: &mut Draws) -> Site {
        let total_m2 = self.area_m2.last().copied().unwrap_or(0.0);
        let at_m2 = total_m2 * (number as f64 + draws.uniform()) / self.count as f64;
        let place = self.area_m2.partition_point(|&up_to_m2| up_to_m2 <= at_m2);
        let facet = self.facets[place.min(self.facets.len() - 1)];
        let [a, b, c] = self.mesh.corners(facet as usize);
        // Uniform over the triangle (Shirley and Chiu 1997).
        let (root, share) = (draws.uniform().sqrt(), draws.uniform());
        let point = a + root * ((1.0 - share) * (b - a) + share * (c - a));
        Site { number, facet, point }
    }
}

/// Facets along Morton's curve through their centroids.
fn along_curve(mesh: &Mesh) -> Vec<u32> {
    /// Bits of a coordinate.
    const BITS: u32 = 20;
    let (low, high) = mesh
        .vertices
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    let side_m = (high - low).max_element().max(f64::MIN_POSITIVE);
    let scale = f64::from((1u32 << BITS) - 1) / side_m;
    let mut keyed: Vec<(u64, u32)> = (0..mesh.facets.len() as u32)
        .into_par_iter()
        .map(|facet| {
            let at = (mesh.centroid(facet as usize) - low) * scale;
            let code = at.to_array().map(|x| spread(x as u64)).into_iter().enumerate();
            (code.map(|(axis, bits)| bits << axis).sum(), facet)
        })
        .collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, facet)| facet).collect()
}

/// Puts two zeros between the lowest 20 bits of a number.
fn spread(bits: u64) -> u64 {
    (0..20).map(|bit| (bits >> bit & 1) << (3 * bit)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::solids;

    const IDENTITY: Identity = Identity { seed: 1, surface: 2 };

    #[test]
    fn scatterers_lie_evenly_on_the_facets_whatever_their_size() {
        let mesh = solids::icosphere(0.5, 4);
        let placement = Placement::new(&mesh, 0.02);
        let sites = placement.sites(IDENTITY, |_| true);
        let area_m2: f64 = (0..mesh.facets.len()).map(|f| 0.5 * mesh.area_normal(f).length()).sum();
        assert_eq!(sites.len(), (area_m2 / 0.0004).ceil() as usize);
        // An eighth of the sphere has an eighth of them, much closer than chance would be.
        let eighth = sites.iter().filter(|site| site.point.min_element() > 0.0).count() as f64;
        let expected = sites.len() as f64 / 8.0;
        assert!((eighth - expected).abs() < 0.5 * expected.sqrt(), "{eighth} is not {expected}");
        for site in &sites {
            let [a, b, c] = mesh.corners(site.facet as usize);
            let normal = (b - a).cross(c - a).normalize();
            assert!((site.point - a).dot(normal).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_left_out_moves_nothing_else() {
        let mesh = solids::icosphere(0.5, 3);
        let placement = Placement::new(&mesh, 0.02);
        let all = placement.sites(IDENTITY, |_| true);
        let upper = placement.sites(IDENTITY, |site| site.point.y > 0.0);
        let expected: Vec<DVec3> = all.iter().map(|s| s.point).filter(|p| p.y > 0.0).collect();
        assert_eq!(upper.iter().map(|site| site.point).collect::<Vec<_>>(), expected);
    }
}
