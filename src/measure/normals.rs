//! The deviation of the normals of a mesh's facets from those of the surface that it approximates.
//!
//! Two errors, both as the variance of one of the two tilts of a facet's normal. *Noise*: the vertices
//! of a scanned mesh are off, so that a facet leans against its neighbours. Between a normal with
//! independent tilts of variance s² and the mean of its three neighbours the squared angle is
//! 2·s²·(1 + 1/3) on average, and 3/8 of it is s². *Flatness*: a facet is flat where the surface turns
//! by about the angle ψ to the neighbour; spread evenly that is a variance of ψ²/12 in the direction of
//! bending, half of it per tilt. Creases sharper than 30° are taken for edges of the shape.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::Mesh;

/// Cosine of the sharpest bend between facets of one smooth surface, 30°.
const CREASE_COS: f64 = 0.866_025_4;

/// Variance of one tilt of every facet's normal, rad²; averaged over a facet and its neighbours. 0 for
/// a facet without smooth neighbours.
pub fn tilt_variance_rad2(mesh: &Mesh) -> Vec<f64> {
    let normals: Vec<DVec3> =
        (0..mesh.facets.len()).map(|facet| mesh.area_normal(facet).normalize_or_zero()).collect();
    let neighbours = smooth_neighbours(mesh, &normals);
    let own: Vec<f64> = std::iter::zip(&normals, &neighbours)
        .map(|(&normal, near)| facet_variance_rad2(normal, near, &normals))
        .collect();
    std::iter::zip(&own, &neighbours)
        .map(|(own_rad2, near)| {
            let sum = own_rad2 + near.iter().map(|&n| own[n as usize]).sum::<f64>();
            sum / (1 + near.len()) as f64
        })
        .collect()
}

fn facet_variance_rad2(normal: DVec3, near: &[u32], normals: &[DVec3]) -> f64 {
    if near.is_empty() {
        return 0.0;
    }
    let count = near.len() as f64;
    let (mut sum, mut bend) = (DVec3::ZERO, 0.0);
    for &facet in near {
        let other = normals[facet as usize];
        sum += other;
        bend += normal.angle_between(other).powi(2);
    }
    let noise = normal.angle_between(sum.normalize_or_zero()).powi(2) / (2.0 * (1.0 + 1.0 / count));
    noise + bend / count / 24.0
}

/// Facets across each edge, without those beyond a crease. Vertices at one place are one vertex:
/// some formats repeat them for every facet.
fn smooth_neighbours(mesh: &Mesh, normals: &[DVec3]) -> Vec<Vec<u32>> {
    let mut number_of_place: HashMap<[u64; 3], u32> = HashMap::new();
    let welded: Vec<u32> = std::iter::zip(&mesh.vertices, 0..)
        .map(|(vertex, number)| {
            // Adding 0 makes −0 and 0 the same bits.
            let place = (*vertex + DVec3::ZERO).to_array().map(f64::to_bits);
            *number_of_place.entry(place).or_insert(number)
        })
        .collect();
    let mut facets_of_edge: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for (corners, facet) in std::iter::zip(&mesh.facets, 0..) {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let [a, b] = [corners[a], corners[b]].map(|corner| welded[corner as usize]);
            facets_of_edge.entry([a.min(b), a.max(b)]).or_default().push(facet);
        }
    }
    let mut neighbours = vec![Vec::new(); mesh.facets.len()];
    // Where three facets share an edge, none is the continuation of another.
    for pair in facets_of_edge.values().filter(|facets| facets.len() == 2) {
        let (a, b) = (pair[0] as usize, pair[1] as usize);
        if normals[a].dot(normals[b]) >= CREASE_COS {
            neighbours[a].push(pair[1]);
            neighbours[b].push(pair[0]);
        }
    }
    // The map's order is random.
    neighbours.iter_mut().for_each(|near| near.sort_unstable());
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};
    use crate::scene::solids;

    #[test]
    fn a_cuboid_is_exact_and_its_edges_are_edges() {
        let mesh = solids::cuboid(DVec3::ONE, 0.1);
        assert!(tilt_variance_rad2(&mesh).iter().all(|v| *v < 1e-20));
    }

    #[test]
    fn a_spheres_facets_are_off_by_their_flatness() {
        // Within a facet of edge h the normal of a sphere turns by about h/(√12·R) a tilt.
        let mesh = solids::icosphere(1.0, 4);
        let [a, b, _] = mesh.corners(0);
        let flatness_rad = a.distance(b) / 12f64.sqrt();
        let variances = tilt_variance_rad2(&mesh);
        let sd_rad = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
        assert!((0.3..1.5).contains(&(sd_rad / flatness_rad)), "{sd_rad} {flatness_rad}");
    }

    #[test]
    fn noise_of_the_vertices_is_found_in_the_normals() {
        let mut mesh = solids::cuboid(DVec3::new(1.0, 1.0, 0.1), 0.02);
        let key = Key { seed: 1, chirp: 0, sub_ray: 0, purpose: Purpose::Noise };
        let mut draws = key.draws();
        let front = |mesh: &Mesh, f: usize| mesh.corners(f).iter().all(|c| c.z > 0.045);
        for vertex in &mut mesh.vertices {
            vertex.z += 5e-4 * draws.complex_gaussian().re;
        }
        let variances = tilt_variance_rad2(&mesh);
        let facets: Vec<usize> = (0..mesh.facets.len()).filter(|&f| front(&mesh, f)).collect();
        let tilt2 = |f: usize| {
            let n = mesh.area_normal(f).normalize();
            0.5 * (n.x * n.x + n.y * n.y)
        };
        let mean = |value: &dyn Fn(usize) -> f64| {
            facets.iter().map(|&f| value(f)).sum::<f64>() / facets.len() as f64
        };
        // Tilts of facets that share vertices are not independent, which the 3/8 takes them for.
        let ratio = mean(&|f| variances[f]) / mean(&tilt2);
        assert!((0.5..2.5).contains(&ratio), "{ratio}");
    }
}
