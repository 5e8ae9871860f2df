//! Simple bodies for calibration and for answers that can be computed by hand.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::{FacetLabels, Mesh};

/// A closed box centred at the origin, its faces cut into roughly `cell_m` squares of two facets.
///
/// All sides of `size_m` and `cell_m` are positive; a cell larger than the box gives the twelve
/// facets of a plain cuboid. The label `side` says `-x`, `+x`, `-y`, `+y`, `-z` or `+z`.
///
/// ```
/// let brick = matdb::scene::solids::cuboid(glam::DVec3::new(0.2, 0.1, 0.05), 1.0);
/// assert_eq!(brick.facets.len(), 12);
/// ```
pub fn cuboid(size_m: DVec3, cell_m: f64) -> Mesh {
    let cells = (size_m / cell_m).round().max(DVec3::ONE).as_uvec3().to_array();
    let mut mesh = Mesh::default();
    let mut vertex_at = HashMap::new();
    let mut side_of_facet = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for (sign, end) in [("-", 0), ("+", cells[axis])] {
            for mut quad in face_quads(&cells, axis, end) {
                if end == 0 {
                    quad.reverse();
                }
                let [a, b, c, d] = quad.map(|node| {
                    *vertex_at.entry(node).or_insert_with(|| {
                        let part = [0, 1, 2].map(|i| node[i] as f64 / cells[i] as f64 - 0.5);
                        mesh.vertices.push(size_m * DVec3::from_array(part));
                        mesh.vertices.len() as u32 - 1
                    })
                });
                mesh.facets.extend([[a, b, c], [a, c, d]]);
                side_of_facet.extend([sign, sign].map(|sign| format!("{sign}{name}")));
            }
        }
    }
    mesh.labels.push(FacetLabels::from_names("side", side_of_facet));
    mesh
}

/// The squares of one face as lattice nodes, right-handed about the positive axis.
fn face_quads(
    cells: &[u32; 3],
    axis: usize,
    end: u32,
) -> impl Iterator<Item = [[u32; 3]; 4]> + use<> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let (across, along) = (cells[u], cells[v]);
    (0..along).flat_map(move |j| {
        (0..across).map(move |i| {
            [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| {
                let mut node = [end; 3];
                (node[u], node[v]) = (i, j);
                node
            })
        })
    })
}

/// A sphere about the origin from an icosahedron, each facet split in four `subdivisions` times.
///
/// There are 20 · 4ⁿ facets, so n is 0 to about 8 (1.3 million). Vertices lie on the sphere, so the
/// mesh is inscribed: its area and volume are too small by a part that falls fourfold with each step.
///
/// ```
/// let ball = matdb::scene::solids::icosphere(0.1, 3);
/// assert_eq!(ball.facets.len(), 1280);
/// ```
pub fn icosphere(radius_m: f64, subdivisions: u32) -> Mesh {
    let (mut directions, mut facets) = icosahedron();
    for _ in 0..subdivisions {
        facets = split_in_four(&mut directions, &facets);
    }
    let vertices = directions.into_iter().map(|direction| radius_m * direction).collect();
    Mesh { vertices, facets, labels: Vec::new() }
}

/// Unit directions of the corners, and the facets: five about each pole, ten in the belt between.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut directions = vec![DVec3::Y, DVec3::NEG_Y];
    let (height, ring_radius) = (0.2f64.sqrt(), 0.8f64.sqrt());
    let mut facets = Vec::new();
    for i in 0..5u32 {
        for (half_steps, y) in [(2 * i, height), (2 * i + 1, -height)] {
            let (sin, cos) = (f64::from(half_steps) * std::f64::consts::PI / 5.0).sin_cos();
            directions.push(DVec3::new(ring_radius * sin, y, ring_radius * cos));
        }
        let [up, down] = [2 + 2 * i, 3 + 2 * i];
        let [next_up, next_down] = [2 + (2 * i + 2) % 10, 2 + (2 * i + 3) % 10];
        facets.extend([[0, up, next_up], [1, next_down, down]]);
        facets.extend([[up, down, next_up], [next_up, down, next_down]]);
    }
    (directions, facets)
}

/// Cuts every facet at the middles of its sides, pushed out to unit length.
fn split_in_four(directions: &mut Vec<DVec3>, facets: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middle_of = HashMap::new();
    let mut middle = |from: u32, to: u32| {
        *middle_of.entry((from.min(to), from.max(to))).or_insert_with(|| {
            directions.push((directions[from as usize] + directions[to as usize]).normalize());
            directions.len() as u32 - 1
        })
    };
    let mut quarters = Vec::with_capacity(4 * facets.len());
    for &[a, b, c] in facets {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        quarters.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    quarters
}

/// A rectangle of two facets in the plane z = 0, centred at the origin and facing +z.
///
/// Width (along x) and height (along y) are positive, in metres.
///
/// ```
/// let mirror = matdb::scene::solids::plate(0.3, 0.2);
/// assert_eq!(mirror.area_normal(0), glam::DVec3::new(0.0, 0.0, 0.06));
/// ```
pub fn plate(width_m: f64, height_m: f64) -> Mesh {
    let (x, y) = (0.5 * width_m, 0.5 * height_m);
    let vertices = [(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| DVec3::new(x, y, 0.0));
    Mesh { vertices: vertices.into(), facets: vec![[0, 1, 2], [0, 2, 3]], labels: Vec::new() }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::geometry::checks::{area_m2, euler_characteristic, is_closed, volume_m3};

    /// Rounding of sums over a few thousand facets, relative.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn a_cuboid_is_closed_with_its_area_and_volume() {
        let size_m = DVec3::new(0.3, 0.2, 0.1);
        for (cell_m, facets) in [(1.0, 12), (0.1, 44), (0.01, 4400)] {
            let brick = cuboid(size_m, cell_m);
            assert!(is_closed(&brick));
            assert_eq!(euler_characteristic(&brick), 2);
            assert_eq!(brick.facets.len(), facets);
            assert!((area_m2(&brick) - 0.22).abs() < ROUNDING);
            assert!((volume_m3(&brick) - 0.006).abs() < ROUNDING);
        }
    }

    #[test]
    fn a_cuboids_sides_are_named_by_their_normals() {
        let brick = cuboid(DVec3::new(0.3, 0.2, 0.1), 0.05);
        let sides = &brick.labels[0];
        assert_eq!(sides.property, "side");
        assert_eq!(sides.names.len(), 6);
        for facet in 0..brick.facets.len() {
            let (sign, axis) = sides.names[sides.name_of_facet[facet] as usize].split_at(1);
            let axis = ["x", "y", "z"].iter().position(|&a| a == axis).unwrap();
            let normal = brick.area_normal(facet).normalize();
            let expected = if sign == "+" { 1.0 } else { -1.0 };
            assert!((normal[axis] - expected).abs() < ROUNDING);
        }
    }

    #[test]
    fn an_icosphere_has_its_vertices_on_the_sphere() {
        for subdivisions in 0..5 {
            let ball = icosphere(0.25, subdivisions);
            assert!(is_closed(&ball));
            assert_eq!(euler_characteristic(&ball), 2);
            assert_eq!(ball.facets.len(), 20 << (2 * subdivisions));
            assert!(ball.vertices.iter().all(|v| (v.length() / 0.25 - 1.0).abs() < 1e-15));
        }
    }

    #[test]
    fn an_icospheres_area_and_volume_converge_from_below() {
        let relative_errors = |subdivisions| {
            let ball = icosphere(1.0, subdivisions);
            [1.0 - area_m2(&ball) / (4.0 * PI), 1.0 - volume_m3(&ball) / (4.0 / 3.0 * PI)]
        };
        for (coarse, fine) in relative_errors(3).into_iter().zip(relative_errors(4)) {
            assert!(fine > 0.0 && fine < 5e-3, "{fine}");
            assert!((3.8..4.2).contains(&(coarse / fine)), "{coarse} {fine}");
        }
    }

    #[test]
    fn a_plate_faces_the_radar() {
        let mirror = plate(0.3, 0.2);
        assert!((area_m2(&mirror) - 0.06).abs() < ROUNDING);
        assert!((0..2).all(|f| mirror.area_normal(f).normalize() == DVec3::Z));
    }
}
