//! By how much the facets of a curved surface turn from one to the next.
//!
//! A facet has one normal. A lobe that is narrower than the step between the normals of neighbours falls between them:
//! the echo then depends on how the mesh happens to lie, and not on the surface.

use glam::DVec3;
use rayon::prelude::*;

use super::coherent::SMOOTH;
use crate::geometry::Mesh;

/// About as many sides of facets are compared; of larger meshes these are an even sample.
const COMPARED: usize = 1 << 16;
/// Share of the area that may turn by more than the reported step: creases and small parts count little.
const STEEPER: f64 = 0.25;

/// A side of a facet.
#[derive(Clone, Copy)]
struct Side {
    /// What the two facets of one edge share.
    key: u64,
    facet: u32,
}

/// The step between the normals of neighbouring facets that three quarters of each region do not exceed, by area,
/// rad; none for regions that are not asked for, or have no neighbours on a smooth surface.
///
/// Edges with a kink above 30° do not count.
pub fn facet_steps(
    mesh: &Mesh,
    region_of_facet: &[u16],
    is_asked: impl Fn(usize) -> bool + Sync,
) -> Vec<Option<f64>> {
    let regions = region_of_facet.iter().max().map_or(0, |last| usize::from(*last) + 1);
    let asked: Vec<bool> = (0..regions).map(is_asked).collect();
    let mut steps: Vec<Vec<Step>> = vec![Vec::new(); regions];
    if !asked.contains(&true) {
        return vec![None; regions];
    }
    // An edge is in the sample by its corners, so that both of its facets are.
    let part = (3 * mesh.facets.len() / COMPARED).max(1).next_power_of_two() as u64;
    let facets = (0..mesh.facets.len()).into_par_iter().with_min_len(1 << 12);
    let facets = facets.filter(|&facet| asked[usize::from(region_of_facet[facet])]);
    let mut sides: Vec<Side> = facets
        .flat_map_iter(|facet| {
            let corners = mesh.corners(facet).map(hash);
            let keys = [0, 1, 2].map(|side| corners[side].wrapping_add(corners[(side + 1) % 3]));
            let sampled = keys.into_iter().filter(move |key| key >> 32 & (part - 1) == 0);
            sampled.map(move |key| Side { key, facet: facet as u32 })
        })
        .collect();
    sides.par_sort_unstable_by_key(|side| (side.key, side.facet));
    for pair in sides.windows(2).filter(|pair| pair[0].key == pair[1].key) {
        let [a, b] = [pair[0].facet as usize, pair[1].facet as usize];
        let region = usize::from(region_of_facet[a]);
        if usize::from(region_of_facet[b]) == region {
            steps[region].extend(step(mesh.area_normal(a), mesh.area_normal(b)));
        }
    }
    steps.into_iter().map(quartile_rad).collect()
}

/// The turn at an edge.
#[derive(Clone, Copy)]
struct Step {
    turn_rad: f64,
    /// Area of both facets, in any unit.
    area: f64,
}

/// The step between two facets by their normals times area; `None` at a kink and beside a facet without area.
fn step(a: DVec3, b: DVec3) -> Option<Step> {
    let area = a.length() + b.length();
    let across = a.cross(b).length();
    // Facets may be wound either way.
    let along = a.dot(b).abs();
    let is_smooth = along > SMOOTH * a.length() * b.length();
    is_smooth.then(|| Step { turn_rad: across.atan2(along), area })
}

/// The turn that all but a quarter of the area stays below.
fn quartile_rad(mut steps: Vec<Step>) -> Option<f64> {
    steps.sort_unstable_by(|a, b| b.turn_rad.total_cmp(&a.turn_rad));
    let steeper = STEEPER * steps.iter().map(|step| step.area).sum::<f64>();
    let mut passed = 0.0;
    let at = steps.iter().find(|step| {
        passed += step.area;
        passed > steeper
    });
    at.map(|step| step.turn_rad)
}

/// A number that tells a corner from others by its coordinates: meshes repeat their vertices.
fn hash(corner: DVec3) -> u64 {
    // Adding 0 makes one of both zeros. The multipliers are those of SplitMix64 (Steele et al., OOPSLA 2014).
    corner.to_array().into_iter().fold(0, |hash: u64, x| {
        let mixed = (hash ^ (x + 0.0).to_bits()).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ mixed >> 31).wrapping_mul(0x94d0_49bb_1331_11eb).rotate_left(29)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::solids;

    fn step_deg(mesh: &Mesh) -> Option<f64> {
        let regions = vec![0; mesh.facets.len()];
        facet_steps(mesh, &regions, |_| true).first().copied().flatten().map(f64::to_degrees)
    }

    #[test]
    fn the_facets_of_a_ball_turn_by_their_size_over_its_radius() {
        // Each split halves them; the sixth has more sides than are compared.
        let [fifth, sixth] =
            [5, 6].map(|splits| step_deg(&solids::icosphere(0.15, splits)).unwrap());
        // 20 480 equal triangles on a ball have centres 0.0217 rad apart.
        assert!((fifth / 0.0217f64.to_degrees() - 1.0).abs() < 0.15, "{fifth}");
        assert!((fifth / sixth - 2.0).abs() < 0.05, "{fifth} {sixth}");
        let cap = step_deg(&solids::sphere_cap(0.15, 0.2, 0.004)).unwrap();
        assert!((cap / 0.004f64.to_degrees() - 1.0).abs() < 0.3, "{cap}");
    }

    #[test]
    fn flat_faces_have_no_step_and_their_edges_are_none() {
        assert!(step_deg(&solids::cuboid(DVec3::ONE, 0.05)).unwrap() < 1e-6);
        assert!(step_deg(&solids::plate(0.3, 0.3)).unwrap() < 1e-6);
        assert_eq!(step_deg(&Mesh::default()), None);
    }

    #[test]
    fn only_the_regions_that_are_asked_for_are_measured() {
        let ball = solids::icosphere(0.15, 4);
        let regions: Vec<u16> =
            (0..ball.facets.len()).map(|facet| u16::from(ball.centroid(facet).z > 0.0)).collect();
        let found = facet_steps(&ball, &regions, |region| region == 1);
        assert!(found[0].is_none() && found[1].is_some());
        assert_eq!(facet_steps(&ball, &regions, |_| false), [None, None]);
    }

    /// A check that costs nothing next to a rendering: a million facets, compared in a sample.
    #[test]
    fn a_large_mesh_is_sampled_evenly() {
        let ball = solids::icosphere(0.15, 7);
        let found = step_deg(&ball).unwrap();
        assert!((found / (0.0217f64.to_degrees() / 4.0) - 1.0).abs() < 0.15, "{found}");
    }
}
