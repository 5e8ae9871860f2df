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

/// A square patch of a sphere about the origin, around +z, that reaches `half_angle_rad` from there along x and y.
///
/// Its facets turn by about `step_rad` from one to the next. A radar's beam sees the glint of a smooth sphere only on
/// facets that turn by less than half its divergence, which a whole sphere would have by the million.
///
/// ```
/// let front = matdb::scene::solids::sphere_cap(0.1, 0.1, 0.05);
/// assert_eq!(front.facets.len(), 32);
/// ```
pub fn sphere_cap(radius_m: f64, half_angle_rad: f64, step_rad: f64) -> Mesh {
    let cells = (2.0 * half_angle_rad / step_rad).ceil().max(1.0) as u32;
    let mut mesh = Mesh::default();
    for row in 0..=cells {
        for column in 0..=cells {
            let [x_rad, y_rad] = [column, row]
                .map(|node| half_angle_rad * (2.0 * f64::from(node) / f64::from(cells) - 1.0));
            let direction = DVec3::new(x_rad.tan(), y_rad.tan(), 1.0).normalize();
            mesh.vertices.push(radius_m * direction);
        }
    }
    for row in 0..cells {
        for column in 0..cells {
            let a = row * (cells + 1) + column;
            let (b, d) = (a + 1, a + cells + 1);
            mesh.facets.extend([[a, b, d + 1], [a, d + 1, d]]);
        }
    }
    mesh
}

/// Three triangles at right angles, open towards +z: a trihedral corner reflector. Vertex 0 is its apex, at the origin;
/// the others are the ends of its three legs, the first of them upwards (+y).
///
/// ```
/// let corner = matdb::scene::solids::trihedral(0.1);
/// assert_eq!(corner.facets.len(), 3);
/// ```
pub fn trihedral(leg_m: f64) -> Mesh {
    let (across_m, along_m) = (leg_m * (2.0f64 / 3.0).sqrt(), leg_m / 3f64.sqrt());
    let mut vertices = vec![DVec3::ZERO];
    for azimuth_deg in [90.0f64, 210.0, 330.0] {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        vertices.push(DVec3::new(across_m * cos, across_m * sin, along_m));
    }
    Mesh { vertices, facets: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]], labels: Vec::new() }
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
    fn a_cap_lies_on_its_sphere_and_turns_by_its_step() {
        let (half_angle_rad, step_rad) = (0.4, 0.01);
        let cap = sphere_cap(0.2, half_angle_rad, step_rad);
        assert!(cap.vertices.iter().all(|v| (v.length() / 0.2 - 1.0).abs() < ROUNDING));
        for facet in 0..cap.facets.len() {
            let outwards = cap.centroid(facet).normalize();
            let off_rad = cap.area_normal(facet).normalize().dot(outwards).min(1.0).acos();
            assert!(off_rad < step_rad, "{facet}: {off_rad}");
        }
        let edge = cap.vertices.iter().map(|v| (v.x / v.z).atan()).fold(0.0, f64::max);
        assert!((edge - half_angle_rad).abs() < ROUNDING);
    }

    #[test]
    fn a_trihedral_has_right_angles_and_faces_the_radar() {
        let corner = trihedral(0.1);
        let legs = [1, 2, 3].map(|end| corner.vertices[end] - corner.vertices[0]);
        for (one, other) in [(0, 1), (1, 2), (2, 0)] {
            assert!(legs[one].dot(legs[other]).abs() < 1e-15);
            assert!((legs[one].length() - 0.1).abs() < 1e-15);
        }
        // Every plate is seen at arccos(1/√3) from straight ahead.
        for facet in 0..3 {
            let cos = corner.area_normal(facet).normalize().z;
            assert!((cos - 1.0 / 3f64.sqrt()).abs() < ROUNDING, "{facet}: {cos}");
        }
    }

    #[test]
    fn a_plate_faces_the_radar() {
        let mirror = plate(0.3, 0.2);
        assert!((area_m2(&mirror) - 0.06).abs() < ROUNDING);
        assert!((0..2).all(|f| mirror.area_normal(f).normalize() == DVec3::Z));
    }
}
